"""The dearest request of every route: the worst that is known of each, and a random search around those that plan.

A request is dear by the CPU time of the whole service until it is answered and the work for it has ended, and by how much the
service's memory rises meanwhile.
"""

import io
import itertools
import json
import math
import os
import random
import time
import zipfile
from collections.abc import Callable, Iterator
from copy import deepcopy
from dataclasses import dataclass
from pathlib import Path as File

TOO_DEAR = " **too dear**"
TICKS_PER_S = os.sysconf("SC_CLK_TCK")
PEAK = "5"  # to clear_refs: the peak of the memory is what it is now
AUVS, SEGMENTS, REPORTS, KEEP_OUTS, CORNERS, STEPS = 16, 256, 64, 32, 64, 120
SCENARIO_BYTES = 64 << 10
BODY_BYTES = 1 << 20


@dataclass(frozen=True)
class Cost:
    """What a request took."""

    status: int
    cpu_s: float
    wall_s: float
    mib: float

    def row(self, route: str, what: str, deadline_s: float) -> str:
        most = max(self.cpu_s / deadline_s, self.mib / 64)
        verdict = "" if self.cpu_s <= 1.2 * deadline_s and self.mib <= 64 else TOO_DEAR
        return (
            f"| {route} | {what} | {self.status} | {self.cpu_s:.2f} | {self.wall_s:.2f} | {self.mib:.0f} | {most:.2f}{verdict} |"
        )


def cpu_s(pid: int) -> float:
    fields = File(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / TICKS_PER_S


def mib(pid: int, what: str) -> float:
    lines = File(f"/proc/{pid}/status").read_text().splitlines()
    return next(int(line.split()[1]) for line in lines if line.startswith(what)) / 1024


def cost(pid: int, ask: Callable[[], tuple[int, bytes]]) -> Cost:
    """Of a request to the service with that `pid`, which does nothing else."""
    File(f"/proc/{pid}/clear_refs").write_text(PEAK)
    before, cpu, start = mib(pid, "VmRSS"), cpu_s(pid), time.monotonic()
    status, _ = ask()
    wall, now = time.monotonic() - start, cpu_s(pid)
    # Work may go on after the answer.
    while True:
        time.sleep(0.1)
        was, now = now, cpu_s(pid)
        if now - was < 2 / TICKS_PER_S:
            return Cost(status, now - cpu, wall, mib(pid, "VmHWM") - before)


Shape = dict[str, float]

# What a random snapshot is made of, each between two limits; those of a ratio are drawn by their logarithm.
SHAPE: dict[str, tuple[float, float]] = {
    "auvs": (1, AUVS),
    "segments": (0, SEGMENTS),
    "reports": (0, REPORTS),
    "keep_outs": (0, KEEP_OUTS),
    "corners": (0, CORNERS),
    "steps": (2, STEPS),
    "iterations": (1, 10),
    "spread_m": (0.1, 20_000),
    "within_m": (1, 5_000),
    "dwell_s": (0, 600),
    "leg_m": (0.1, 1_000),
    "auv_speed_mps": (0, 2),
    "speed_mps": (0.2, 20),
    "age_s": (0, 200),
    "goal": (0, 6),
    "energy": (0, 1),
    "deadlines": (0, 1),
    "range_m": (1, 5_000),
}
RATIOS = {"spread_m", "within_m", "leg_m", "range_m", "speed_mps"}

SIDE_BY_SIDE: Shape = {"goal": 6, "auvs": 16, "within_m": 5_000, "dwell_s": 0, "spread_m": 1}
KNOWN: dict[str, Shape] = {
    "16 AUVs side by side, visits of no time": SIDE_BY_SIDE,
    "16 AUVs, paths of 256 segments, 64 reports": dict(goal=3, auvs=16, segments=256, reports=64, spread_m=100),
    "120 steps, 32 keep-outs, energy, a range to 16 AUVs": dict(
        goal=5, auvs=16, steps=120, iterations=2, keep_outs=32, corners=64, energy=1, spread_m=300, range_m=50
    ),
    "visits of data with deadlines": dict(goal=6, auvs=16, deadlines=1, within_m=200, dwell_s=1, spread_m=50),
}


def drawn(rng: random.Random) -> Shape:
    return {name: between(rng, name) for name in SHAPE}


def between(rng: random.Random, name: str) -> float:
    least, most = SHAPE[name]
    if name in RATIOS:
        return math.exp(rng.uniform(math.log(least), math.log(most)))
    return rng.choice([least, most, rng.uniform(least, most)])


def changed(rng: random.Random, shape: Shape) -> Shape:
    """Another shape: some of its members are drawn again."""
    return shape | {name: between(rng, name) for name in rng.sample(sorted(SHAPE), k=rng.randint(1, 4))}


def snapshot(shape: Shape, seed: int = 0) -> dict:
    """A snapshot of that shape; what it does not say is ordinary."""
    rng = random.Random(seed)
    ordinary = {"auvs": 16, "segments": 0, "reports": 0, "keep_outs": 0, "corners": 0, "steps": 0, "iterations": 2}
    ordinary |= {"spread_m": 300, "within_m": 20, "dwell_s": 30, "leg_m": 100, "auv_speed_mps": 0.3, "speed_mps": 1.5}
    ordinary |= {"age_s": 5, "goal": 0, "energy": 0, "deadlines": 0, "range_m": 100}
    of = ordinary | shape
    n = round(of["auvs"])
    names = [f"a{i}" for i in range(n)]
    side = math.ceil(math.sqrt(n))

    def auv(i: int) -> dict:
        here = [of["spread_m"] * (i % side) + rng.random(), of["spread_m"] * (i // side) + rng.random()]
        made: dict = {"id": names[i]}
        corners = [[here[0] + of["leg_m"] * (k % 2), here[1] + 0.3 * of["leg_m"] * k] for k in range(round(of["segments"]))]
        if 1 < len(corners):
            segments = [{"kind": "waypoints", "points": corners, "turn_radius_m": 0.05 * of["leg_m"]}]
            made["path"] = {"segments": segments, "speed_mps": max(0.05, of["auv_speed_mps"])}
        if of["reports"] < 1:
            state = {"depth_m": 5.0, "course_rad": i / 3, "speed_mps": of["auv_speed_mps"], "age_s": of["age_s"]}
            return made | {"state": {"north_m": here[0], "east_m": here[1]} | state}
        made["reports"] = [
            {"t_s": 900.0 - 3 * k, "north_m": here[0] + rng.gauss(0, 2), "east_m": here[1] + rng.gauss(0, 2), "sigma_m": 1.5}
            for k in reversed(range(round(of["reports"])))
        ]
        return made

    some = names[: max(1, n)]
    goals = [
        {"kind": "track", "auv": names[0]},
        {"kind": "intermittent", "auvs": some, "dwell_s": 30.0, "epoch_s": 0.0},
        {"kind": "midpoint", "auvs": some},
        {"kind": "weighted", "weights": dict.fromkeys(some, 1.0)},
        {"kind": "midpoint", "auvs": some[:2]},
        {"kind": "range", "auvs": some, "range_m": of["range_m"]},
        {"kind": "visit", "auvs": some, "within_m": min(5_000.0, of["within_m"]), "dwell_min_s": of["dwell_s"]},
    ]
    goal = goals[min(6, int(of["goal"]))]
    if goal["kind"] == "visit" and 0.5 < of["deadlines"]:
        goal["serve_by_s"] = {name: 900.0 + 200 * (i + 1) for i, name in enumerate(some)}
    request: dict = {
        "schema_version": "1.0",
        "t_s": 900.0,
        "asc": {"north_m": 0.0, "east_m": 0.0, "heading_rad": 0.3, "speed_mps": 1.0},
        "craft": {"preset": "medusa"},
        "auvs": [auv(i) for i in range(n)],
        "goal": goal,
        "limits": {"speed_max_mps": of["speed_mps"]},
    }
    if 1 <= of["keep_outs"]:
        request["keep_outs"] = [
            {"north_m": 40.0 + 11 * k, "east_m": 30.0 * (k % 5) - 60, "radius_m": 5.0 + k} for k in range(round(of["keep_outs"]))
        ]
    if 3 <= of["corners"]:
        m = round(of["corners"])
        angles = [2 * math.pi * k / m for k in range(m)]
        request["area"] = [[1e4 * math.cos(a), 1e4 * math.sin(a)] for a in angles]
    if 2 <= of["steps"]:
        m = round(of["steps"])
        iterations = max(1, min(round(of["iterations"]), 300 // m))
        request["tuning"] = {"steps_s": [min(10.0, max(0.1, 120 / m))] * m, "scp_iterations": iterations}
        if not 5 <= sum(request["tuning"]["steps_s"]) <= 600:
            request["tuning"]["steps_s"] = [3.0] * max(2, m)
    if 0.5 < of["energy"]:
        request.setdefault("tuning", {})["energy_weight_per_j"] = 1.0
    return request


def scenario(shape: Shape) -> str:
    """A scenario file of that shape."""
    of = {"auvs": 16, "within_m": 20, "dwell_s": 0, "spread_m": 300, "goal": 6} | shape
    n = round(of["auvs"])
    names = json.dumps([f"a{i}" for i in range(n)])
    side = math.ceil(math.sqrt(n))
    goal = f"visit = {{ auvs = {names}, within_m = {min(5000, of['within_m'])}, dwell_min_s = {of['dwell_s']} }}"
    if of["goal"] < 6:
        goal = f"range = {{ auvs = {names}, range_m = {of.get('range_m', 50)} }}"
    head = f"""schema_version = "1"
name = "dear"
title = "dear"
duration_s = {of.get("duration_s", 3600)}
settled_after_s = 0
[surface_craft]
class = "medusa"
north_m = 0
east_m = 0
heading_rad = 0
speed_mps = 0.5
contact_range_m = 50
goal.{goal}
"""
    auvs = [
        f"""[[auvs]]
id = "a{i}"
depth_m = {5 + i}
speed_mps = 0.5
path.lawn_mower = {{ from = [{of["spread_m"] * (i % side)}, {of["spread_m"] * (i // side)}], heading_rad = 0.0, \
lane_length_m = 100, lane_spacing_m = 20, lanes = {int(of.get("lanes", 6))} }}
"""
        for i in range(n)
    ]
    return head + "".join(auvs)


def routes() -> Iterator[tuple[str, bytes]]:
    """Files of routes that are as long as is accepted."""
    n = BODY_BYTES // 64
    yield "CSV", ("lat,lon\n" + "".join(f"{40 + i * 1e-6:.6f},{-8 - i * 1e-6:.6f}\n" for i in range(BODY_BYTES // 22))).encode()
    points = "".join(f"{i}.5,{i % 7}.25:" for i in range(BODY_BYTES // 16))[:-1]
    yield "MOOS points", f"points = pts={{{points}}}".encode()
    yield "MOOS lines without points", ("points = \n" * (BODY_BYTES // 10))[: BODY_BYTES - 1].encode()
    yield "nested GeoJSON", (b'{"a":' * (BODY_BYTES // 10) + b"1" + b"}" * (BODY_BYTES // 10))[: BODY_BYTES - 1]
    yield "nested KML", b"<kml>" + b"<a>" * (BODY_BYTES // 4)
    gpx = "".join(f'<rtept lat="{40 + i * 1e-6:.6f}" lon="-8"/>' for i in range(n // 1))[: BODY_BYTES - 100]
    yield "GPX", f"<gpx><rte>{gpx[: gpx.rfind('<')]}</rte></gpx>".encode()
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("doc.kml", b"<kml>" + b"<a>" * (100 << 20 >> 2))
    yield "KMZ of 100 MiB", packed.getvalue()
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("doc.kml", b'{"":' * (25 << 20))
    yield "KMZ of nested JSON", packed.getvalue()


def dearest(service, searched: int, seed: int) -> Iterator[str]:
    """Rows of a table: what is known to be dear of each route, and the dearest of `searched` random plans around it."""
    pid = service.process.pid
    limits = json.loads(service.ask("GET", "/v1/limits")[1])
    deadline_s = limits["deadline_most_ms"] / 1e3
    rng = random.Random(seed)

    def of(method: str, path: str, body: str | bytes | None = None) -> Cost:
        return cost(pid, lambda: service.ask(method, path, body))

    plans = ["/v1/plan", "/v1/plan/compare", "/v1/plan/compare?explain=true", "/v1/plan/validate"]
    for path in plans:
        found = [(of("POST", path, json.dumps(snapshot(shape))), what, shape) for what, shape in KNOWN.items()]
        for _ in range(searched):
            shape = drawn(rng) if rng.random() < 0.3 else changed(rng, max(found, key=lambda f: f[0].cpu_s)[2])
            body = json.dumps(snapshot(shape))
            if len(body) < BODY_BYTES:
                found.append((of("POST", path, body), "found: " + described(shape), shape))
        accepted = [one for one in found if one[0].status < 300 or one[0].status in (503, 504)]
        refused = len(found) - len(accepted)
        by_cpu = max(accepted, key=lambda one: one[0].cpu_s)
        by_mib = max(accepted, key=lambda one: one[0].mib)
        yield by_cpu[0].row(path, f"{by_cpu[1]} (most CPU of {len(found)}, {refused} refused)", deadline_s)
        yield by_mib[0].row(path, f"{by_mib[1]} (most memory)", deadline_s)
    small = [snapshot(shape) for shape in KNOWN.values()]
    batch = list(itertools.islice(itertools.cycle(deepcopy(small)), 64))
    while BODY_BYTES < len(json.dumps({"requests": batch})):
        batch.pop()
    yield of("POST", "/v1/plan/batch", json.dumps({"requests": batch})).row("/v1/plan/batch", f"{len(batch)} of the above", deadline_s)
    for what, body in routes():
        yield of("POST", "/v1/routes", body).row("/v1/routes", what, deadline_s)
    for what, shape in {
        "16 AUVs side by side": {"within_m": 5000, "spread_m": 1},
        "16 AUVs, 100 lanes": {"lanes": 100, "duration_s": 86_400},
    }.items():
        new = {"schema_version": "1.0", "simulated": {"scenario_file": scenario(shape)}}
        yield of("POST", "/v1/missions", json.dumps(new)).row("POST /v1/missions", f"simulated, {what}", deadline_s)
        mission = service.ask("POST", "/v1/missions", json.dumps(new))
        name = f"/v1/missions/{json.loads(mission[1])['id']}"
        yield of("POST", f"{name}/step", json.dumps({"ticks": 1})).row("step of 1", what, deadline_s)
        yield of("POST", f"{name}/step", json.dumps({"ticks": 1})).row("step of 1, again", what, deadline_s)
        yield of("GET", f"{name}/scene").row("scene", what, deadline_s)
        for form in ("ndjson", "parquet", "mcap"):
            yield of("GET", f"{name}/record?format={form}").row(f"record, {form}", what, deadline_s)
    auvs = snapshot({"auvs": 16, "segments": 256})["auvs"]
    large = {"auvs": [{"id": auv["id"], "path": auv["path"]} for auv in auvs], "goal": {"kind": "track", "auv": "a0"}}
    new = json.dumps({"schema_version": "1.0", "live": large | {"period_s": 1.0}})
    yield of("POST", "/v1/missions", new).row("POST /v1/missions", f"live, {len(new) >> 10} kB of paths", deadline_s)
    name = "/v1/missions/" + json.loads(service.ask("POST", "/v1/missions", new)[1])["id"]
    for method, path, body in (
        ("PATCH", name, json.dumps({"paths": {auv["id"]: auv["path"] for auv in large["auvs"]}})),
        ("PATCH", name, json.dumps({"goal": {"kind": "track", "auv": "a1"}})),
        ("GET", name, None),
        ("GET", f"{name}/scene", None),
        ("GET", "/v1/missions?limit=100", None),
        ("GET", "/v1/audit?limit=100", None),
        ("GET", f"{name}/record?format=events_ndjson", None),
        ("GET", "/openapi.json", None),
        ("GET", "/v1/crafts", None),
        ("GET", "/metrics", None),
        ("GET", "/", None),
        ("GET", "/readyz", None),
    ):
        shown = path.replace(name, "/v1/missions/{id}")
        yield of(method, path, body).row(f"{method} {shown}", "" if body is None else f"{len(body) >> 10} kB", deadline_s)


def described(shape: Shape) -> str:
    return ", ".join(f"{name} {value:.3g}" for name, value in sorted(shape.items()))
