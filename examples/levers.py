#!/usr/bin/env python3
"""Draws what nearness, energy and calm cost each other, from the report of examples/campaigns/levers.toml.

    pilotfish campaign run examples/campaigns/levers.toml --out target/levers
    python -m pilotfish.analysis report target/levers
    python3 examples/levers.py target/levers/report.json > docs/levers.svg

A panel for each scenario and pair of metrics. Points are means over the seeds; a line joins the values of one lever in order, through the
usual one. It needs nothing but Python. A campaign of yours needs the same names: `usual` (planner = {}), and a lever of LEVERS with its value, such as
`velocity 1.5`; and the metrics rms_m, energy_j, heading_travel_rad.
"""

import json
import math
import sys

# The planner's default of each lever, in the unit of the controllers' names, and a colour (Okabe and Ito).
LEVERS = {
    "energy": (0.0, "#d55e00"),
    "position": (1.0, "#0072b2"),
    "velocity": (15.0, "#009e73"),
    "acceleration": (100.0, "#cc79a7"),
    "horizon": (78.0, "#56b4e9"),
    "iterations": (2.0, "#e69f00"),
}
METRICS = {
    "rms_m": "distance to the goal, RMS, m",
    "energy_j": "propulsion energy, kJ",
    "heading_travel_rad": "heading travel, rad",
}
SCALE = {"energy_j": 1e-3}
WIDTH, HEIGHT, LEFT, BOTTOM, TOP, RIGHT = 380, 270, 52, 42, 24, 14
LEGEND = 26


def panel(scenario, means, across, x0, y0):
    """One scenario: distance to the goal upwards, another metric across."""
    points = {name: (mean[across], mean["rms_m"]) for name, mean in means.items()}
    lows, highs = zip(*[(min(axis), max(axis)) for axis in zip(*points.values())])
    pad = [0.06 * (high - low) or 1.0 for low, high in zip(lows, highs)]
    low = [value - gap for value, gap in zip(lows, pad)]
    high = [value + gap for value, gap in zip(highs, pad)]

    def place(point):
        share = [(value - a) / (b - a) for value, a, b in zip(point, low, high)]
        x = x0 + LEFT + share[0] * (WIDTH - LEFT - RIGHT)
        y = y0 + HEIGHT - BOTTOM - share[1] * (HEIGHT - TOP - BOTTOM)
        return x, y

    out = [text(x0 + LEFT, y0 + 15, f"{scenario}: {METRICS[across].split(',')[0]}", weight="bold")]
    out.append(frame(x0, y0))
    for tick in ticks(low[0], high[0]):
        x, _ = place((tick, low[1]))
        out.append(text(x, y0 + HEIGHT - BOTTOM + 14, f"{tick:g}", anchor="middle"))
    for tick in ticks(low[1], high[1]):
        _, y = place((low[0], tick))
        out.append(text(x0 + LEFT - 5, y + 3.5, f"{tick:g}", anchor="end"))
    out.append(text(x0 + (LEFT + WIDTH - RIGHT) / 2, y0 + HEIGHT - 10, METRICS[across], anchor="middle"))
    middle = y0 + (TOP + HEIGHT - BOTTOM) / 2
    turned = f'rotate(-90 {x0 + 12} {middle})'
    out.append(text(x0 + 12, middle, METRICS["rms_m"], anchor="middle", transform=turned))
    for lever, (usual, colour) in LEVERS.items():
        values = {float(name.split()[1]): name for name in points if name.startswith(f"{lever} ")}
        line = [place(points[name]) for _, name in sorted({**values, usual: "usual"}.items())]
        way = " ".join(f"{x:.1f},{y:.1f}" for x, y in line)
        out.append(f'<polyline points="{way}" fill="none" stroke="{colour}" stroke-width="1.4"/>')
        for value, name in values.items():
            x, y = place(points[name])
            out.append(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="3" fill="{colour}"/>')
            out.append(text(x + 5, y - 4, f"{value:g}", fill=colour))
    x, y = place(points["usual"])
    out.append(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="4.5" fill="#222"/>')
    return out


def frame(x0, y0):
    size = f'width="{WIDTH - LEFT - RIGHT}" height="{HEIGHT - TOP - BOTTOM}"'
    return f'<rect x="{x0 + LEFT}" y="{y0 + TOP}" {size} fill="none" stroke="#999"/>'


def text(x, y, words, anchor="start", fill="#222", weight="normal", transform=None):
    turned = f' transform="{transform}"' if transform else ""
    style = f'text-anchor="{anchor}" fill="{fill}" font-weight="{weight}"'
    return f'<text x="{x:.1f}" y="{y:.1f}" {style}{turned}>{words}</text>'


def ticks(low, high):
    """About four round numbers between two."""
    step = 10 ** math.floor(math.log10((high - low) / 4))
    step *= next(factor for factor in (1, 2, 5, 10) if (high - low) / (factor * step) <= 5)
    first = math.ceil(low / step)
    return [round(k * step, 9) for k in range(first, math.floor(high / step) + 1)]


def is_drawn(name):
    """Whether a controller is `usual`, or a lever of LEVERS with its value."""
    if name == "usual":
        return True
    lever, _, value = name.partition(" ")
    if lever not in LEVERS:
        return False
    try:
        return math.isfinite(float(value))
    except ValueError:
        sys.exit(f"levers.py: the controller {name!r} needs a number after {lever}")


def main():
    report = json.load(open(sys.argv[1], encoding="utf-8"))
    metrics = report["metrics"]
    scenarios = {}
    drawn = {name for name in {score["controller"] for score in report["scores"]} if is_drawn(name)}
    for score in report["scores"]:
        if not score.get("means") or score["controller"] not in drawn:
            continue
        means = {metric: SCALE.get(metric, 1) * mean for metric, mean in zip(metrics, score["means"])}
        scenarios.setdefault(score["scenario"], {})[score["controller"]] = means
    if not scenarios or not all("usual" in means for means in scenarios.values()) or not METRICS.keys() <= set(metrics):
        sys.exit("levers.py needs a controller named usual, others named such as 'velocity 1.5', and the metrics " + ", ".join(METRICS))
    width, height = 2 * WIDTH, len(scenarios) * HEIGHT + LEGEND
    print(f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" font-family="sans-serif" font-size="10">')
    print(f'<rect width="{width}" height="{height}" fill="#fff"/>')
    x = LEFT
    flown = {name.split()[0] for means in scenarios.values() for name in means}
    colours = {"usual": "#222"} | {lever: colour for lever, (_, colour) in LEVERS.items()}
    for name, colour in ((name, colour) for name, colour in colours.items() if name in flown):
        print(f'<circle cx="{x}" cy="14" r="4" fill="{colour}"/>', text(x + 8, 17.5, name))
        x += 95
    for row, (scenario, means) in enumerate(scenarios.items()):
        for column, across in enumerate(["energy_j", "heading_travel_rad"]):
            print("\n".join(panel(scenario, means, across, column * WIDTH, LEGEND + row * HEIGHT)))
    print("</svg>")


if __name__ == "__main__":
    main()
