"""Estimates, intervals and tests.

    d = ln(a/b), or a - b if a value is not positive                       of a condition
    x = mean of d over a cluster                                           what counts as one observation
    estimate = mean of x;  ratio = exp(estimate)

Replicates of one group are independent; groups differ more. A comparison over several groups takes each group as
one observation (a cluster) with equal weight: its interval describes other scenarios or craft of that kind, not
more replicates of these. Ratios of errors are products of many influences, so their logarithms are nearer to
normal.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd
import scipy.stats
from scipy.special import stdtr, stdtrit
from statsmodels.stats.multitest import multipletests
from statsmodels.stats.proportion import proportion_confint

from .runs import Runs

# A standard error, or a difference, below this share of the values is rounding.
SAME = 1e-12
# Units by the ends of the columns' names.
UNITS = {"reference_jerk": "m/s³", "_mps": "m/s", "_percent": "%", "_rad": "rad", "_m": "m", "_s": "s", "_j": "J"}

Interval = list[float]


def unit(column: str) -> str:
    """Unit of a column; 1 if its name has none."""
    return next((unit for end, unit in UNITS.items() if column.endswith(end)), "1")


def mean(values: Sequence[float]) -> tuple[float, Interval | None, float | None]:
    """Mean, 95 % interval and p-value that it is 0, by Student's distribution. Of one value, and of equal ones,
    whose variance is not known, there is no interval and no test, but 1 if all are 0."""
    centre = float(np.mean(values))
    if len(values) < 2:
        return centre, None, None
    error = float(np.std(values, ddof=1)) / math.sqrt(len(values))
    if error <= SAME * abs(centre):
        return centre, None, 1.0 if centre == 0 else None
    half = float(stdtrit(len(values) - 1, 0.975)) * error
    return centre, [centre - half, centre + half], 2 * float(stdtr(len(values) - 1, -abs(centre / error)))


def quantile(values: Sequence[float], share: float) -> float:
    """The least value that a share of the values does not exceed."""
    return float(sorted(values)[max(math.ceil(share * len(values)), 1) - 1])


def holm(found: list[dict[str, Any]]) -> None:
    """Adds p-values by Holm's correction; unknown ones are not counted."""
    known = [entry for entry in found if entry["p"] is not None]
    if known:
        adjusted = multipletests([entry["p"] for entry in known], method="holm")[1]
        for entry, p in zip(known, adjusted, strict=True):
            entry["p_holm"] = float(p)


class Contrast:
    """How pairs are compared: by the logarithm of their ratio, or by their difference if a value is not positive."""

    def __init__(self, pairs: pd.DataFrame) -> None:
        self.is_ratio = bool((pairs[["value", "value_r"]] > 0).all(axis=None))
        self.name = "ratio" if self.is_ratio else "difference"
        self.nought = 1.0 if self.is_ratio else 0.0
        a, b = pairs["value"], pairs["value_r"]
        self.values = np.log(a / b) if self.is_ratio else a - b

    def shown(self, value: Any) -> Any:
        """The ratio or difference of an average, or of a list; none stays none."""
        if value is None:
            return None
        out = np.exp(value) if self.is_ratio else np.asarray(value)
        return out.tolist()

    def unit(self, metric: str) -> str:
        return "1" if self.is_ratio else unit(metric)


def complete(pairs: pd.DataFrame) -> pd.DataFrame:
    """The pairs of missions that did not fail, with both values."""
    return pairs[~pairs["failed"] & ~pairs["failed_r"]].dropna(subset=["value", "value_r"])


def compare(
    runs: Runs, controller: str, reference: str, metric: str, scenario: str | None, objective: str | None = None
) -> dict[str, Any]:
    """A controller beside another, in a scenario or in all."""
    all_pairs = runs.pairs(controller, reference, metric, objective)
    if scenario is not None:
        inside = [group for group, (name, _) in enumerate(runs.groups) if name == scenario]
        all_pairs = all_pairs[all_pairs["group"].isin(inside)]
    pairs = complete(all_pairs)
    contrast = Contrast(pairs)
    groups = contrast.values.groupby(pairs["group"])
    values = groups.mean() if groups.ngroups > 1 else contrast.values
    cluster = "replicate"
    if groups.ngroups > 1:
        scenarios, crafts = map(set, zip(*(runs.groups[group] for group in groups.groups), strict=True))
        cluster = "craft" if len(scenarios) == 1 else "scenario" if len(crafts) == 1 else "scenario_and_craft"
    centre, bounds, p = mean(values.to_numpy()) if len(pairs) else (None, None, None)
    failed = all_pairs["failed"], all_pairs["failed_r"]
    wins, quantiles = None, None
    if len(pairs):
        won = float((pairs["value"] < pairs["value_r"]).sum() + 0.5 * (pairs["value"] == pairs["value_r"]).sum())
        wilson = proportion_confint(won, len(pairs), 0.05, method="wilson")
        wins = {"share": won / len(pairs), "wilson_95": np.clip(wilson, 0.0, 1.0).tolist()}
        each = contrast.shown(contrast.values)
        quantiles = [float(np.median(each)), quantile(each, 0.9), quantile(each, 1.0)]
    return {
        "controller": controller,
        "reference": reference,
        "metric": metric,
        "scenario": scenario,
        "measure": contrast.name,
        "unit": contrast.unit(metric),
        "n_pairs": len(pairs),
        "n_failed": int(failed[0].sum()),
        "n_reference_failed": int(failed[1].sum()),
        "n_missing": len(all_pairs) - int((failed[0] | failed[1]).sum()) - len(pairs),
        "mean": float(pairs["value"].mean()) if len(pairs) else None,
        "reference_mean": float(pairs["value_r"].mean()) if len(pairs) else None,
        "cluster": cluster,
        "n_clusters": len(values),
        "estimate": contrast.shown(centre),
        "student_95": contrast.shown(bounds),
        "wins": wins,
        "quantiles": quantiles,
        "p": p,
        "p_holm": None,
    }


def effect(runs: Runs, controller: str, reference: str, metric: str, parameter: str) -> dict[str, Any] | None:
    """The effect of a parameter on a comparison; none if no pair has it.

    All groups of a replicate have the same parameters, so each replicate is one observation: its mean over groups
    of the distances from their means. A group whose mission failed in a replicate is left out there, which adds no
    bias.
    """
    both = complete(runs.pairs(controller, reference, metric))
    pairs = both.assign(drawn=runs.rows[parameter].to_numpy()[both["row"]]).dropna(subset="drawn")
    if pairs.empty:
        return None
    contrast = Contrast(both)
    values = contrast.values.loc[pairs.index]
    means = values.groupby(pairs["group"]).mean()
    by_replicate = (values - pairs["group"].map(means)).groupby(pairs["replicate"]).mean() + means.mean()
    drawn = pairs.groupby("replicate")["drawn"].first()
    rho, p = spearman(drawn, by_replicate)
    # Equal values are in the same third, so that one may be empty.
    third_of = np.minimum(np.floor(3 * (scipy.stats.rankdata(drawn) - 0.5) / len(drawn)), 2)
    thirds: list[dict[str, Any] | None] = []
    for third in range(3):
        inside, limits = by_replicate[third_of == third], drawn[third_of == third]
        if inside.empty:
            thirds.append(None)
            continue
        centre, bounds, _ = mean(inside.to_numpy())
        thirds.append(
            {
                "parameter": [float(limits.min()), float(limits.max())],
                "n_replicates": len(inside),
                "estimate": contrast.shown(centre),
                "student_95": contrast.shown(bounds),
            }
        )
    return {
        "controller": controller,
        "reference": reference,
        "metric": metric,
        "parameter": parameter,
        "measure": contrast.name,
        "unit": contrast.unit(metric),
        "n_replicates": len(drawn),
        "spearman": rho,
        "p": p,
        "p_holm": None,
        "thirds": thirds,
    }


def spearman(drawn: Any, values: Any) -> tuple[float | None, float | None]:
    """Spearman's rank correlation and its p-value; none of fewer than three values, and of equal ones. Rounding is
    not ranked."""
    size = np.abs(values).max()
    values = np.rint(values / (SAME * size if size > 0 else 1.0))
    if len(drawn) < 3 or np.ptp(drawn) == 0 or np.ptp(values) == 0:
        return None, None
    found = scipy.stats.spearmanr(drawn, values)
    return float(found.statistic), float(found.pvalue)
