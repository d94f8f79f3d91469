"""The runs of a campaign by condition, and the pairs of two controllers.

Two controllers are compared under the conditions that both flew: the same start, water and noise, so that their
effect cancels. A group is a scenario with a craft, a condition a group with a replicate. Failed missions have no
values; they are counted beside the pairs. Replicate k of every group has the same seed and parameters: an interval
over groups holds them fixed.
"""

from __future__ import annotations

import hashlib
import json
import struct
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

# Columns with measured times, which differ each time.
MEASURED = ["solve_ms_p50", "solve_ms_p99", "run_s"]
# Metrics for which gains of another objective than the distance count.
OBJECTIVES = {
    "energy_j": ["energy_j", "energy_violations"],
    "heading_travel_rad": [
        "heading_travel_rad",
        "heading_reference_travel_rad",
        "steep_steps_percent",
        "reference_jerk",
    ],
}


class NotReportableError(Exception):
    """The directory holds no campaign that can be reported."""


class Runs:
    """The rows of a campaign, and its design: the file's members with their defaults, controllers, scenarios and
    craft."""

    def __init__(self, directory: Path) -> None:
        try:
            manifest = json.loads((directory / "campaign.json").read_text(encoding="utf-8"))
            self.rows = pd.read_parquet(directory / "runs.parquet")
        except FileNotFoundError as missing:
            raise NotReportableError(f"{directory} holds no finished campaign: {missing.filename} is missing") from None
        self.design: dict[str, Any] = manifest.get("design")
        if self.design is None:
            raise NotReportableError(f"{directory} is from an older program: fly the campaign into a new directory")
        self.name: str = manifest["name"]
        self.rows = self.rows.sort_values("run", kind="stable", ignore_index=True)
        words = ["scenario", "craft", "controller", "objectives", "failure"]
        self.rows = self.rows.astype(dict.fromkeys(words, object))
        self.rows["failed"] = self.rows["failure"] != ""
        self.rows["group"], groups = pd.factorize(pd.MultiIndex.from_frame(self.rows[["scenario", "craft"]]))
        self.groups: list[tuple[str, str]] = list(groups)
        self.rows["condition"] = self.rows.groupby(["group", "replicate"]).ngroup()
        self.judged, self.values, self.pairs = cache(self._judged), cache(self._values), cache(self._pairs)
        self.repeated, counted = self._repeated()
        self.counted = dict(list(counted.groupby("controller")))

    def _repeated(self) -> tuple[list[int], pd.DataFrame]:
        """Groups whose replicates are all the same missions, and the rows that count: of these the first replicate
        alone."""
        own = self.rows.drop(columns=["run", "replicate", "seed", "condition", *MEASURED])
        missions = pd.util.hash_pandas_object(own, index=False).groupby([self.rows["group"], self.rows["replicate"]])
        each = missions.agg(tuple).groupby("group")
        repeated = [group for group, of in each if len(of) > 1 and of.nunique() == 1]
        first = self.rows.groupby("group")["replicate"].transform("min")
        return repeated, self.rows[~self.rows["group"].isin(repeated) | (self.rows["replicate"] == first)]

    def _judged(self, controller: str, objective: str) -> pd.Series[int]:
        """The rows that count for a controller by condition, failed ones too: of a law with several gains the row
        at those tuned for the objective, else the first."""
        if controller not in self.counted:
            return pd.Series([], dtype=int)
        rows = self.counted[controller]
        others = [objective not in names.split() for names in rows["objectives"]]
        rows = rows.assign(other=others).sort_values(["condition", "other", "run"]).drop_duplicates("condition")
        return pd.Series(rows.index, rows["condition"])

    def _values(self, metric: str) -> pd.Series[float]:
        """The values of a column. If the craft never came near, its time to come near is the whole mission."""
        if metric not in self.rows:
            return pd.Series(np.nan, self.rows.index)
        values = self.rows[metric]
        values = values.fillna(self.rows["duration_s"]) if metric == "time_to_3_m_s" else values
        return values.where(np.isfinite(values))

    def of_controller(self, controller: str, metric: str) -> pd.DataFrame:
        """The rows of a controller, with the metric in the column `value`."""
        rows = self.judged(controller, objective_of(metric))
        return self.rows.loc[rows].assign(value=self.values(metric)[rows])

    def observations(self, controller: str, metric: str, scenario: str) -> list[float]:
        """Values in one scenario: the replicates of one craft, or the means of several craft."""
        rows = self.judged(controller, objective_of(metric)).to_numpy()
        places, values = self.rows["group"].to_numpy()[rows], self.values(metric).to_numpy()[rows]
        kept = ~np.isnan(values)
        in_scenario = [group for group, (name, _) in enumerate(self.groups) if name == scenario]
        by_craft = [craft for group in in_scenario if len(craft := values[kept & (places == group)])]
        return [craft.mean() for craft in by_craft] if len(by_craft) > 1 else list(*by_craft)

    def _pairs(self, controller: str, reference: str, metric: str, objective: str | None = None) -> pd.DataFrame:
        """The conditions that both flew; columns of the reference end in `_r`."""
        a, b = (self.judged(name, objective or objective_of(metric)) for name in (controller, reference))
        conditions = a.index.intersection(b.index)
        pairs: dict[str, Any] = {}
        for end, rows in ("", a[conditions].to_numpy()), ("_r", b[conditions].to_numpy()):
            columns = {name: self.rows[name].to_numpy()[rows] for name in ("group", "replicate", "run", "failed")}
            columns |= {"row": rows, "value": self.values(metric).to_numpy()[rows]}
            pairs |= {name + end: column for name, column in columns.items()}
        return pd.DataFrame(pairs)

    @property
    def parameters(self) -> list[str]:
        """Columns that hold drawn parameters."""
        return [name for name in self.rows if name.startswith("param.")]

    def digest(self) -> str:
        """SHA-256 of all cells except the measured ones, as `pilotfish campaign digest` prints it."""
        digest = hashlib.sha256()
        for name, column in self.rows.drop(columns=[*MEASURED, "failed", "group", "condition"]).items():
            digest.update(str(name).encode())
            if pd.api.types.is_numeric_dtype(column):
                cells = column.to_numpy(dtype="<f8")
                bits = np.where(np.isnan(cells), np.uint64(0xFFFF_FFFF_FFFF_FFFF), cells.view("<u8"))
                digest.update(bits.astype("<u8").tobytes())
            else:
                for word in column:
                    digest.update(struct.pack("<Q", len(word.encode())) + word.encode())
        return digest.hexdigest()


def objective_of(metric: str) -> str:
    """The tuning objective whose gains count for a metric."""
    return next((objective for objective, metrics in OBJECTIVES.items() if metric in metrics), "rms_m")
