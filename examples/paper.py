#!/usr/bin/env python3
"""The figures of the paper from which Pilotfish starts, flown anew, with what it prints beside what is flown here.

    python3 examples/paper.py --program target/release/pilotfish --out target/paper

D. O. Akanji, Cooperative Motion Control of Autonomous Marine Vehicles for Ocean Observation. docs/paper.md says which scenario is which. Line of
sight is the paper's law as corrected (docs/rationale.md), with the service's gains. It needs nothing but Python and a program with the laboratory.
"""

import argparse
import csv
import math
import subprocess
import tempfile
from pathlib import Path

from levers import text, ticks

SEED = "1"
# The approach is over, s: that of the scenarios.
SETTLED_S = 120
RUNS = {"planner": "mpc", "line of sight": "saturated_los"}
COLOURS = {"planner": "#0072b2", "line of sight": "#d55e00", "auv-1": "#009e73", "auv-2": "#cc79a7", "reference": "#999", "path": "#999"}
WIDTH, HEIGHT, LEFT, BOTTOM, TOP, RIGHT = 560, 300, 54, 40, 26, 14


def flown(program, scenario, controller):
    """The rows of a mission, by what they are of; a number for each cell that has one."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder, "run.csv")
        command = [program, "simulate", scenario, "--seed", SEED, "--controller", controller, "--untimed", "--out", out]
        subprocess.run(command, check=True, capture_output=True)
        with out.open(encoding="utf-8") as file:
            rows = [{name: number(cell) for name, cell in row.items()} for row in csv.DictReader(file)]
    return {who: [row for row in rows if (row["kind"], row["vehicle"]) == ("truth", who)] for who in ("asc", "auv-1", "auv-2")}


def number(cell):
    try:
        return float(cell)
    except ValueError:
        return cell


def column(rows, name, scale=1.0):
    return [scale * row[name] for row in rows if row[name] != ""]


def over_time(rows, name, scale=1.0):
    return [(row["t_s"], scale * row[name]) for row in rows if row[name] != ""]


def headings(rows, name="heading_rad"):
    """Degrees over time that go on beyond a half turn: (time, °)."""
    out, last = [], None
    for t, value in over_time(rows, name, 180 / math.pi):
        last = value if last is None else last + math.remainder(value - last, 360)
        out.append((t, last))
    return out


def plane(rows):
    return [(row["east_m"], row["north_m"]) for row in rows]


def settled(rows):
    return [row for row in rows if row["t_s"] >= SETTLED_S]


def rms(values):
    return math.sqrt(sum(value * value for value in values) / len(values))


def ahead(run):
    """How far the tracker is ahead of its target along the target's heading: (time, m)."""
    pairs = zip(run["asc"], run["auv-1"], strict=True)
    return [
        (a["t_s"], (a["north_m"] - b["north_m"]) * math.cos(b["heading_rad"]) + (a["east_m"] - b["east_m"]) * math.sin(b["heading_rad"]))
        for a, b in pairs
    ]


def panel(title, across, upwards, curves, top, equal=False, down=False):
    """Curves (name, points, dashed) in a frame; `equal`: one scale for both axes."""
    points = [point for _, all_points, _ in curves for point in all_points]
    low, high = [min(axis) for axis in zip(*points)], [max(axis) for axis in zip(*points)]
    room = [0.04 * (b - a) or 0.1 for a, b in zip(low, high)]
    low, high = [a - gap for a, gap in zip(low, room)], [b + gap for b, gap in zip(high, room)]
    size = [WIDTH - LEFT - RIGHT, HEIGHT - TOP - BOTTOM]
    scale = [pixels / (b - a) for pixels, a, b in zip(size, low, high)]
    if equal:
        scale = [min(scale)] * 2
        middle = [(a + b) / 2 for a, b in zip(low, high)]
        low = [at - pixels / one / 2 for at, pixels, one in zip(middle, size, scale)]
        high = [at + pixels / one / 2 for at, pixels, one in zip(middle, size, scale)]

    def place(point):
        y = (point[1] - low[1]) * scale[1]
        return LEFT + (point[0] - low[0]) * scale[0], top + (TOP + y if down else HEIGHT - BOTTOM - y)

    out = [
        text(LEFT, top + 16, title, weight="bold"),
        f'<rect x="{LEFT}" y="{top + TOP}" width="{size[0]}" height="{size[1]}" fill="none" stroke="#999"/>',
    ]
    out += [text(place((tick, low[1]))[0], top + HEIGHT - BOTTOM + 13, f"{tick:g}", anchor="middle") for tick in ticks(low[0], high[0])]
    out += [text(LEFT - 5, place((low[0], tick))[1] + 3, f"{tick:g}", anchor="end") for tick in ticks(low[1], high[1])]
    out.append(text(LEFT + size[0] / 2, top + HEIGHT - 8, across, anchor="middle"))
    middle = top + TOP + size[1] / 2
    out.append(text(12, middle, upwards, anchor="middle", transform=f"rotate(-90 12 {middle})"))
    for i, (name, all_points, dashed) in enumerate(curves):
        way = " ".join(f"{x:.1f},{y:.1f}" for x, y in map(place, all_points))
        dash = ' stroke-dasharray="5 3"' if dashed else ""
        out.append(f'<polyline points="{way}" fill="none" stroke="{COLOURS[name]}" stroke-width="1.4"{dash}/>')
        out.append(text(WIDTH - RIGHT - 6, top + TOP + 14 + 12 * i, name, anchor="end", fill=COLOURS[name]))
    return out


def from_above(title, curves):
    return lambda top: panel(title, "east, m", "north, m", curves, top, equal=True)


def in_time(title, unit, curves, down=False):
    return lambda top: panel(title, "time, s", unit, curves, top, down=down)


def figure(folder, number, *panels):
    write(folder / f"fig-{number}.svg", *panels)


def write(file, *panels):
    """Panels below each other, as a file."""
    body = [line for i, draw in enumerate(panels) for line in draw(i * HEIGHT)]
    size = f'width="{WIDTH}" viewBox="0 0 {WIDTH} {len(panels) * HEIGHT}"'
    head = f'<svg xmlns="http://www.w3.org/2000/svg" {size} font-family="sans-serif" font-size="10">'
    lines = [head, '<rect width="100%" height="100%" fill="#fff"/>', *body, "</svg>", ""]
    file.write_text("\n".join(lines), encoding="utf-8")


def path_following(folder, auv):
    """Figs. 3 to 6."""
    error = [(row["t_s"], math.hypot(row["along_track_m"], row["cross_track_m"])) for row in auv]
    path = [(row["path_east_m"], row["path_north_m"]) for row in auv]
    figure(folder, "03", from_above("Fig. 3: path following", [("path", path, True), ("auv-1", plane(auv), False)]))
    figure(folder, "04", in_time("Fig. 4: the sawtooth", "depth, m", [("auv-1", over_time(auv, "depth_m"), False)], down=True))
    figure(folder, "05", in_time("Fig. 5: distance from the point on the path", "m", [("auv-1", error, False)]))
    loops = [
        ("surge", "m/s", lambda name: over_time(auv, name), "speed_mps"),
        ("pitch", "°", lambda name: over_time(auv, name, 180 / math.pi), "pitch_rad"),
        ("heading", "°", lambda name: headings(auv, name), "heading_rad"),
    ]
    both = lambda of, name: [("reference", of(f"reference_{name}"), True), ("auv-1", of(name), False)]  # noqa: E731
    figure(folder, "06", *(in_time(f"Fig. 6: {what}", unit, both(of, name)) for what, unit, of, name in loops))
    across, depths = column(settled(auv), "cross_track_m"), column(auv, "depth_m")
    surge, pitch = column(auv, "speed_mps"), column(auv, "pitch_rad", 180 / math.pi)
    apart = max(value for t, value in error if t >= SETTLED_S)
    return [
        ("3", "error across the path, settled", "± 1.2 m", f"± {max(map(abs, across)):.3f} m", "–"),
        ("4", "depths of the sawtooth", "1 to 23 m", f"{min(depths):.2f} to {max(depths):.2f} m", "–"),
        ("5", "distance from the point on the path, settled", "less than 1 m", f"{apart:.3f} m", "–"),
        ("6", "surge; pitch", "0.3 m/s; ± 50°", f"{sum(surge) / len(surge):.3f} m/s; {min(pitch):.1f} to {max(pitch):.1f}°", "–"),
    ]


def beside(what, number_of, said, runs, value):
    """A row of the table: the law first, as the paper has it."""
    return (number_of, what, said, *(value(runs[name]) for name in ("line of sight", "planner")))


def tracking(folder, runs):
    """Figs. 8 to 10."""
    auv = runs["planner"]["auv-1"]
    curves = lambda of: [("auv-1", of(auv), False), *((name, of(run["asc"]), name != "planner") for name, run in runs.items())]  # noqa: E731
    figure(folder, "08", from_above("Fig. 8: the craft follows one AUV", curves(plane)))
    leads = [(name, ahead(run), name != "planner") for name, run in runs.items()]
    figure(folder, "09", in_time("Fig. 9: along-track error, ahead +", "m", leads))
    surge = in_time("Fig. 10: surge", "m/s", curves(lambda rows: over_time(rows, "speed_mps")))
    figure(folder, "10", surge, in_time("Fig. 10: heading", "°", curves(headings)))
    overshoot = lambda run: f"{max(value for t, value in ahead(run) if t < SETTLED_S):.2f} m"  # noqa: E731
    return [
        beside("distance from the AUV, settled (RMS)", "8", "≈ 1 m", runs, apart),
        beside("overshoot ahead of the AUV", "9", "drawn", runs, overshoot),
    ]


def apart(run):
    return f"{rms(column(settled(run['asc']), 'goal_distance_m')):.3f} m"


def cooperation(folder, number_of, what, runs):
    """Figs. 14 and 15."""
    curves = [(who, plane(runs["planner"][who]), False) for who in ("auv-1", "auv-2")]
    curves += [(name, plane(run["asc"]), name != "planner") for name, run in runs.items()]
    figure(folder, number_of, from_above(f"Fig. {number_of}: {what}", curves))
    return beside("distance from the goal, settled (RMS)", number_of, "drawn", runs, apart)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--program", default="pilotfish")
    parser.add_argument("--out", type=Path, default=Path("target/paper"))
    arguments = parser.parse_args()
    program, out = arguments.program, arguments.out
    out.mkdir(parents=True, exist_ok=True)
    both = lambda scenario: {name: flown(program, scenario, controller) for name, controller in RUNS.items()}  # noqa: E731
    rows = [
        *path_following(out, flown(program, "paper-path-following", "mpc")["auv-1"]),
        *tracking(out, both("paper-tracking")),
        cooperation(out, "14", "two AUVs in turn, 240 s each (scenario I)", both("paper-intermittent")),
        cooperation(out, "15", "the midpoint of two AUVs (scenario II)", both("paper-midpoint")),
    ]
    lines = ["| Fig. | what | the paper | as corrected | planner |", "|---|---|---|---|---|", *(f"| {' | '.join(row)} |" for row in rows)]
    (out / "table.md").write_text("\n".join([*lines, ""]), encoding="utf-8")
    print("\n".join(lines))


if __name__ == "__main__":
    main()
