"""Charts of a report, as SVG."""

from __future__ import annotations

import io
import math
from typing import Any

import matplotlib as mpl
from matplotlib.figure import Figure

from .statistics import unit

# Colours that colour-blind readers can distinguish: M. Okabe, K. Ito, "Color Universal Design", 2008.
COLOURS = ["#0072B2", "#009E73", "#D55E00", "#CC79A7"]
COLUMNS = 2
# Points beyond this many times the least of the laws are not drawn, so that the others can be distinguished.
SHOWN = 2.0


def front(points: list[dict[str, Any]], metrics: list[str]) -> str:
    """The second column against the first, a panel for each scenario: a dot for each gain of a law, the planners
    joined in order."""
    scenarios = list(dict.fromkeys(point["scenario"] for point in points))
    rows = math.ceil(len(scenarios) / COLUMNS)
    figure = Figure(figsize=(5 * COLUMNS, 3.6 * rows), layout="constrained")
    panels = figure.subplots(rows, COLUMNS, squeeze=False).flat
    for scenario, axes in zip(scenarios, panels, strict=False):
        here = [point for point in points if point["scenario"] == scenario]
        laws = [point for point in here if not point["is_planner"]]
        farthest = SHOWN * min((point["means"][0] for point in laws), default=math.inf)
        for number, entry in enumerate(dict.fromkeys(point["entry"] for point in laws)):
            own = [law["means"] for law in laws if law["entry"] == entry and law["means"][0] <= farthest]
            axes.scatter(*_axes(own), s=12, color=COLOURS[number % len(COLOURS)], label=entry)
        planners = [point["means"] for point in here if point["is_planner"]]
        axes.plot(*_axes(planners), "o-", color="black", markersize=4, label="planner, in the file's order")
        labels = [f"{metric}, {unit(metric)}" for metric in metrics]
        axes.set(title=scenario, xlabel=labels[0], ylabel=labels[1])
    for axes in panels:
        axes.set_visible(False)
    figure.legend(*figure.axes[0].get_legend_handles_labels(), loc="outside upper center", ncols=3)
    picture = io.StringIO()
    # The same points give the same bytes.
    with mpl.rc_context({"svg.hashsalt": "pilotfish", "svg.fonttype": "none"}):
        figure.savefig(picture, format="svg", metadata={"Date": None})
    return picture.getvalue().partition("<svg")[2].join(["<svg", ""])


def _axes(means: list[list[float]]) -> tuple[list[float], list[float]]:
    return [mean[0] for mean in means], [mean[1] for mean in means]
