"""Judges flights past drawn coasts with other geometry (shapely) than the planner's: places inside an area, flights
that did not arrive although a way exists, and lengths beside the shortest way of a visibility graph.

    cargo run --release -p pilotfish-sim --example coasts -- --seeds 1-500 > flights.jsonl
    pip install shapely numpy; python tests/python/coasts.py flights.jsonl
"""

import heapq
import json
import math
import sys
from collections import defaultdict

import numpy as np
from shapely import contains_xy, points
from shapely.geometry import LineString, Point, Polygon
from shapely.ops import unary_union
from shapely.prepared import prep

# Depth that is rounding of the track, m; distance from the AUV at which a flight ends, m.
ROUNDING, ENDS_AT = 0.002, 5.0
# Time of a mission: this many times that of the shortest way, and this much more, s.
SLOWER, MORE = 2.0, 60.0


def shortest(land, start, end, clearance):
    """Length of the shortest way that keeps the clearance: Dijkstra over corners of the inflated land."""
    fat = land.buffer(clearance, quad_segs=4)
    blocked = prep(fat.buffer(-1e-6))
    if blocked.contains(start) or blocked.contains(end):
        return None
    nodes = [start.coords[0], end.coords[0]]
    for part in getattr(fat, "geoms", [fat]):
        for k, ring in enumerate([part.exterior, *part.interiors]):
            corners = np.array(ring.coords[:-1])
            before, after = corners - np.roll(corners, 1, 0), np.roll(corners, -1, 0) - corners
            cross = before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0]
            stands_out = cross > 0 if ring.is_ccw == (k == 0) else cross < 0
            nodes += [tuple(corner) for corner in corners[stands_out]]
    places = np.array(nodes)
    left = np.hypot(*(places - places[1]).T)
    lengths, done, queue = {0: 0.0}, set(), [(left[0], 0)]
    while queue:
        _, node = heapq.heappop(queue)
        if node in done:
            continue
        if node == 1:
            return lengths[1]
        done.add(node)
        there = lengths[node] + np.hypot(*(places - places[node]).T)
        for other in map(int, np.argsort(there)):
            if other in done or lengths.get(other, math.inf) <= there[other]:
                continue
            if not blocked.intersects(LineString([nodes[node], nodes[other]])):
                lengths[other] = there[other]
                heapq.heappush(queue, (there[other] + left[other], other))
    return None


def judged(flight):
    areas = [Polygon(area["polygon"], area.get("holes", [])) for area in flight["no_go"]]
    land, track = unary_union(areas), np.array(flight["track"])
    start, end = Point(flight["start"]), Point(flight["auv"])
    inside = points(track[contains_xy(land, *track.T)])
    depth = max((land.boundary.distance(place) for place in inside), default=0.0)
    crosses = LineString(track).intersection(land).length
    best = shortest(land, start, end, flight["clearance_m"])
    ratio = None
    if best and flight["arrived_s"]:
        length = np.hypot(*np.diff(track, axis=0).T).sum()
        ratio = length / max(best - ENDS_AT, 1.0)
    within = best and SLOWER * best / flight["speed_mps"] + MORE
    return {
        "depth": depth, "is_inside": ROUNDING < max(depth, 0.1 * crosses), "ratio": ratio, "has_way": best is not None,
        "trapped": best is not None and not (flight["arrived_s"] and flight["arrived_s"] <= within),
        "arrived": flight["arrived_s"] is not None,
    }


def main(names):
    kinds = defaultdict(list)
    for name in names:
        with open(name) as lines:
            for line in lines:
                flight = json.loads(line)
                found = {**judged(flight), "seed": flight["seed"], "ms": flight["plan_ms"]}
                kinds[flight["kind"]].append(found)
                kinds["all"].append(found)
    for kind, flights in kinds.items():
        seeds = lambda wanted: [flight["seed"] for flight in flights if wanted(flight)]
        times = np.concatenate([flight["ms"] for flight in flights])
        ratios = sorted((flight["ratio"], flight["seed"]) for flight in flights if flight["ratio"])
        at = lambda share: ratios[math.ceil(share * len(ratios)) - 1][0] if ratios else math.nan
        print(
            f"{kind}: {len(flights)} flights, {sum(flight['has_way'] for flight in flights)} with a way, "
            f"trapped {seeds(lambda f: f['trapped'])}, inside {seeds(lambda f: f['is_inside'])} "
            f"(deepest {max(flight['depth'] for flight in flights):.3f} m), arrived without a way "
            f"{seeds(lambda f: f['arrived'] and not f['has_way'])}\n"
            f"  length / shortest: median {at(0.5):.3f}, 95 % {at(0.95):.3f}, above 1.1 {sum(r > 1.1 for r, _ in ratios)}, "
            f"worst {[(round(float(ratio), 3), seed) for ratio, seed in ratios[-5:]]}\n"
            f"  plan: median {np.quantile(times, 0.5):.2f} ms, 99 % {np.quantile(times, 0.99):.2f} ms of {len(times)}"
        )


if __name__ == "__main__":
    main(sys.argv[1:])
