"""The plans of the planner and of the line-of-sight laws for one snapshot."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from html import escape
from typing import TYPE_CHECKING, cast

from . import types
from .frames import pandas

if TYPE_CHECKING:
    from pandas import DataFrame

# Compared quantities: less is better.
ROWS: Mapping[str, Callable[[types.PlanResponse], float]] = {
    "predicted cost": lambda plan: plan["predicted"]["cost"],
    "RMS distance to the goal, m": lambda plan: plan["predicted"]["rms_error_m"],
    "propulsion energy, J": lambda plan: plan["predicted"]["energy_j"],
}

# Larger numbers have no decimals.
THOUSAND = 1000


class Comparison:
    """Plans for one snapshot, by law; `mpc` is the planner's. In a notebook it is a table."""

    def __init__(self, answer: types.Comparison) -> None:
        self.plans = cast("dict[str, types.PlanResponse]", answer["plans"])

    def winner(self, row: str) -> str:
        """The law that is predicted to do best in a row of the table."""
        return min(self.plans, key=lambda law: ROWS[row](self.plans[law]))

    def frame(self) -> DataFrame:
        """Reference and prediction of each law, one row for each."""
        rows = {
            law: {
                "speed_mps": plan["reference"]["speed_mps"],
                "heading_rad": plan["reference"]["heading_rad"],
                "predicted_cost": plan["predicted"]["cost"],
                "predicted_rms_error_m": plan["predicted"]["rms_error_m"],
                "predicted_energy_j": plan["predicted"]["energy_j"],
            }
            for law, plan in self.plans.items()
        }
        return pandas().DataFrame.from_dict(rows, orient="index").rename_axis("law")

    def __repr__(self) -> str:
        best = ", ".join(f"{row}: {self.winner(row)}" for row in ROWS)
        return f"<Comparison of {', '.join(self.plans)}; best {best}>"

    def _repr_html_(self) -> str:
        head = "".join(f"<th>{escape(law)}</th>" for law in self.plans)
        return f"<table><tr><th></th>{head}</tr>{''.join(map(self._row, ROWS))}</table>"

    def _row(self, row: str) -> str:
        winner = self.winner(row)
        cells = ""
        for law, plan in self.plans.items():
            number = ROWS[row](plan)
            figure = f"{number:,.0f}" if number >= THOUSAND else f"{number:.4g}"
            cells += f"<td><b>{figure}</b></td>" if law == winner else f"<td>{figure}</td>"
        return f"<tr><th>{escape(row)}</th>{cells}</tr>"
