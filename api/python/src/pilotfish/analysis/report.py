"""All numbers of a report, and its files. Equal rows give equal reports, unless `report.metrics` names a measured
time."""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from .document import document
from .runs import Runs
from .statistics import Contrast, compare, complete, effect, holm, mean, quantile
from .words import interval, number

# Version of the JSON's members.
SCHEMA_VERSION = "4"
# Worst runs of each planner.
WORST = 10
# Columns of violations, and their names.
BEYOND = {
    "speed_violations": "speed",
    "reference_violations": "reference",
    "turn_rate_violations": "turn rate",
    "keep_out_violations": "keep-out",
    "area_violations": "area",
    "range_violations": "range",
    "energy_violations": "energy",
}
LEARNT = ["heading_lag", "surge_lag", "sway_per_yaw_rate"]
# The two-sided 95 % point of the normal distribution.
Z = 1.959963984540054

Json = dict[str, Any]


def report(directory: Path | str) -> Json:
    """All numbers of the report on the campaign in a directory, unrounded. Ratios, shares and probabilities have no
    unit; other units are beside the numbers or at the end of their names."""
    return Numbers(Runs(Path(directory))).all()


def write(directory: Path | str) -> list[Path]:
    """Writes the report beside the rows: a page in one file, Markdown, and JSON for programs."""
    numbers = report(directory)
    made = document(numbers)
    texts = {
        "report.html": made.html(),
        "report.md": made.markdown(),
        "report.json": json.dumps(numbers, indent=2, ensure_ascii=False, allow_nan=False) + "\n",
    }
    for name, text in texts.items():
        (Path(directory) / name).write_text(text, encoding="utf-8")
    return [Path(directory) / name for name in texts]


class Numbers:
    """The numbers of a campaign's runs."""

    def __init__(self, runs: Runs) -> None:
        self.runs = runs
        self.design = runs.design
        self.controllers: list[Json] = self.design["controllers"]
        self.scenarios = [scenario["name"] for scenario in self.design["scenarios"]]
        self.metrics: list[str] = self.design["metrics"]
        self.eligible = [each for each in self.controllers if each["paths"] != "known"]
        self.reference: str = self.design["reference"]
        self.compared = [each["name"] for each in self.controllers if each["name"] != self.reference]
        self.first_objective: str = (self.design["objectives"] or ["rms_m"])[0]
        self.front: list[str] | None = self.design["pareto_front"]
        self.interval = cache(self._interval)

    def all(self) -> Json:
        winners = self.winners()
        failures = self.failures()
        planners = [controller["name"] for controller in self.controllers if controller["kind"] == "planner"]
        return {
            "schema_version": SCHEMA_VERSION,
            "campaign": {
                "name": self.runs.name,
                **{member: self.design[member] for member in ("title", "seed", "replicates", "duration_s")},
                "n_rows": len(self.runs.rows),
                "n_runs_at_most": self.design["n_runs"],
                "n_failed": len(failures),
                "digest": self.runs.digest(),
                "reference": self.reference,
                "repeated": ["{} ({})".format(*self.runs.groups[group]) for group in self.runs.repeated],
            },
            "metrics": self.metrics,
            "cases": [
                {"scenario": scenario["name"], "title": scenario["title"], "craft": self.design["craft"]}
                for scenario in self.design["scenarios"]
            ],
            "parameters": self.design["parameters"],
            "controllers": [self.flown(controller) for controller in self.controllers],
            "claims": [verdict for claim in self.design["claims"] for verdict in self.decided(claim)],
            "winners": winners,
            "comparisons": self.comparisons(),
            "scores": self.scores(winners),
            "pareto_metrics": self.front,
            "pareto": self.pareto(),
            "effects": self.effects(),
            "worst": [run for planner in planners for run in self.worst(planner)],
            "estimated": self.estimated(),
            "alarms": self.alarms(),
            "failures": failures,
        }

    def flown(self, controller: Json) -> Json:
        rows = self.runs.rows[self.runs.rows["controller"] == controller["name"]]
        part = "knows_more" if controller["paths"] == "known" else "compared"
        return {
            "name": controller["name"],
            "information": controller["information"],
            "part": "reference" if controller["name"] == self.reference else part,
            "n_runs": len(rows),
            "n_failed": int(rows["failed"].sum()),
        }

    def failures(self) -> list[Json]:
        rows = self.runs.rows[self.runs.rows["failed"]]
        rows = rows[["run", "controller", "scenario", "craft", "failure"]].rename(columns={"failure": "reason"})
        return [{**row, "run": int(row["run"])} for row in rows.to_dict("records")]

    def _interval(self, controller: str, metric: str, scenario: str) -> tuple[float, list[float] | None] | None:
        """The mean in a scenario with its interval; none without values."""
        values = self.runs.observations(controller, metric, scenario)
        return mean(values)[:2] if values else None

    def mean(self, controller: str, metric: str, scenario: str) -> float | None:
        found = self.interval(controller, metric, scenario)
        return found and found[0]

    def least(self, controllers: list[Json], metric: str, scenario: str) -> str | None:
        """The controller with the least mean; of equals the first."""
        means = [(self.mean(each["name"], metric, scenario), each["name"]) for each in controllers]
        flown = [(value, name) for value, name in means if value is not None]
        return min(flown, key=lambda each: each[0])[1] if flown else None

    def comparisons(self) -> list[Json]:
        """All controllers beside the reference in every metric: overall, then by scenario."""
        found = [
            compare(self.runs, controller, self.reference, metric, scenario)
            for metric in self.metrics
            for controller in self.compared
            for scenario in [None, *self.scenarios]
        ]
        counts = ("n_pairs", "n_failed", "n_reference_failed", "n_missing")
        found = [entry for entry in found if any(entry[count] for count in counts)]
        holm(found)
        return found

    def effects(self) -> list[Json]:
        found = [
            effect(self.runs, controller, self.reference, metric, parameter)
            for parameter in self.runs.parameters
            for metric in self.metrics
            for controller in self.compared
        ]
        known = [entry for entry in found if entry is not None]
        holm(known)
        return known

    def worst(self, controller: str) -> list[Json]:
        """The worst runs in the first metric, by the ratio to the reference; of the reference itself, by value."""
        if not self.metrics:
            return []
        metric = self.metrics[0]
        if controller == self.reference:
            rows = self.runs.of_controller(controller, metric).dropna(subset="value")
            rows = rows.assign(run_r=None, value_r=None, measure=None, by=None, badness=rows["value"])
        else:
            rows = complete(self.runs.pairs(controller, self.reference, metric))
            contrast = Contrast(rows)
            by = contrast.shown(contrast.values)
            rows = rows.assign(measure=contrast.name, by=by, badness=by)
        rows = rows.sort_values("badness", ascending=False, kind="stable").head(WORST)
        return [
            {
                "controller": controller,
                "metric": metric,
                "run": int(row["run"]),
                "scenario": self.runs.groups[row["group"]][0],
                "craft": self.runs.groups[row["group"]][1],
                "replicate": row["replicate"],
                "value": row["value"],
                "reference_run": None if row["run_r"] is None else int(row["run_r"]),
                "reference_value": row["value_r"],
                "measure": row["measure"],
                "by": row["by"],
            }
            for row in rows.to_dict("records")
        ]

    def winners(self) -> list[Json]:
        """The least mean of each metric among controllers that know no more than the scenario grants, and those
        that a paired 95 % interval does not distinguish from it."""
        winners = []
        for scenario in self.scenarios:
            for metric in self.metrics:
                least = self.least(self.eligible, metric, scenario)
                if least is None:
                    continue
                others = [each["name"] for each in self.eligible if each["name"] != least]
                as_good = [other for other in others if self.is_as_good(other, least, metric, scenario)]
                winners.append({"scenario": scenario, "metric": metric, "controller": least, "as_good": as_good})
        return winners

    def is_as_good(self, other: str, least: str, metric: str, scenario: str) -> bool:
        found = compare(self.runs, other, least, metric, scenario)
        nought = 1.0 if found["measure"] == "ratio" else 0.0
        low, high = found["student_95"] or [found["estimate"]] * 2
        return low is not None and bool(low <= nought <= high)

    def scores(self, winners: list[Json]) -> list[Json]:
        least = {(winner["scenario"], winner["metric"], winner["controller"]) for winner in winners}
        scores = []
        for scenario in self.scenarios:
            for name in (controller["name"] for controller in self.controllers):
                found = [self.interval(name, metric, scenario) for metric in self.metrics]
                if not any(found):
                    continue
                beyond = [(words, self.mean(name, column, scenario)) for column, words in BEYOND.items()]
                scores.append(
                    {
                        "scenario": scenario,
                        "controller": name,
                        "means": [each and each[0] for each in found],
                        "half_widths": [each[1][1] - each[0] if each and each[1] else None for each in found],
                        "is_least": [(scenario, metric, name) in least for metric in self.metrics],
                        "beyond": [[words, episodes] for words, episodes in beyond if episodes],
                        "gains": self.gains(name, scenario),
                    }
                )
        return scores

    def gains(self, controller: str, scenario: str) -> list[str]:
        """Gains of a tuned law with their objectives, if there is one craft, from the rows of the first replicate."""
        if sum(name == scenario for name, _ in self.runs.groups) != 1:
            return []
        rows = self.runs.rows
        own = (rows["controller"] == controller) & (rows["scenario"] == scenario) & (rows["replicate"] == 0)
        rows = rows[own & (rows["objectives"] != "")]
        columns = ["look_ahead_m", "along_track_gain_per_s", "integral_gain_mps"]
        named = rows.dropna(subset=columns)[[*columns, "objectives"]].itertuples(index=False)
        return [f"{' / '.join(f'{gain:g}' for gain in gains)} for {objectives}" for *gains, objectives in named]

    def point(self, controller: str, scenario: str) -> list[float] | None:
        """Both means of the Pareto front; none if the controller did not fly, or without a front."""
        means = [self.mean(controller, metric, scenario) for metric in self.front or [""]]
        return [value for value in means if value is not None] if None not in means else None

    def pareto(self) -> list[Json]:
        points = []
        for scenario in self.scenarios if self.front else []:
            all_means = [(each, self.point(each["name"], scenario)) for each in self.eligible]
            flown = [(each, means) for each, means in all_means if means is not None]
            for controller, means in flown:
                is_law = controller["kind"] == "law"
                beating = [(other["kind"] == "law") == is_law for other, its in flown if dominates(its, means)]
                points.append(
                    {
                        "scenario": scenario,
                        "controller": controller["name"],
                        "entry": controller["entry"],
                        "is_planner": not is_law,
                        "means": means,
                        "beaten_by": beating.count(False),
                        "beaten_by_its_kind": True in beating,
                    }
                )
        return points

    def estimated(self) -> list[Json]:
        """What the planner learnt of its craft, beside step tests of the craft."""
        found = []
        for controller in (controller["name"] for controller in self.controllers):
            for quantity in LEARNT:
                rows = self.runs.of_controller(controller, f"{quantity}_s")
                value, sigma, tested = (rows[f"{quantity}{end}_s"] for end in ("", "_sigma", "_tested"))
                errors = (value - tested).abs()[sigma.notna()].dropna()
                if errors.empty:
                    continue
                held = (errors <= Z * sigma[errors.index]).mean()
                found.append(
                    {
                        "controller": controller,
                        "quantity": f"{quantity}_s",
                        "n_runs": len(errors),
                        "error_median_s": float(errors.median()),
                        "error_90_s": quantile(errors.to_list(), 0.9),
                        "held": float(held),
                    }
                )
        return found

    def alarms(self) -> list[Json]:
        """Alarms of each planner that the craft does not follow."""
        found = []
        for controller in self.controllers:
            rows = self.runs.of_controller(controller["name"], "alarms").dropna(subset=["alarms", "duration_s"])
            if rows.empty:
                continue
            noticed = rows["noticed_after_s"].dropna()
            found.append(
                {
                    "controller": controller["name"],
                    "n_runs": len(rows),
                    "breaks": controller["breaks"],
                    "per_hour": float(rows["alarms"].sum() * 3600.0 / rows["duration_s"].sum()),
                    "alarmed": float((rows["alarms"] > 0).mean()),
                    "n_noticed": len(noticed),
                    "noticed_after_median_s": float(noticed.median()) if len(noticed) else None,
                    "noticed_after_worst_s": float(noticed.max()) if len(noticed) else None,
                }
            )
        return found

    def decided(self, claim: Json) -> list[Json]:
        """The verdicts on a claim of the campaign file."""
        asked: Json = claim["is"] if isinstance(claim["is"], dict) else {claim["is"]: None}
        ((kind, limit),) = asked.items()
        named = claim["controllers"], claim["beside"]
        scenarios = [name for name in self.scenarios if name in (claim["scenarios"] or self.scenarios)]
        own, beside = ([each for each in self.controllers if each["entry"] in entries] for entries in named)
        if kind == "undominated":
            return [verdict for each in scenarios if (verdict := self.undominated(claim, own, beside, each))]
        if kind in ("ratio_at_most", "ratio_surely_at_most"):
            surely = kind == "ratio_surely_at_most"
            verdicts = [self.ratio(claim, each, beside, name, limit, surely) for name in scenarios for each in own]
        elif kind == "mean_at_most":
            verdicts = [self.means(claim, each["name"], scenarios, limit) for each in own]
        else:
            verdicts = [self.within_bound(claim, each["name"], scenarios, **limit) for each in own]
        return [verdict for verdict in verdicts if verdict is not None]

    def ratio(
        self, claim: Json, controller: Json, laws: list[Json], scenario: str, most: float, surely: bool
    ) -> Json | None:
        beside = self.least(laws, self.first_objective, scenario)
        # Without the paths that the scenario grants, a comparison proves nothing.
        grants = next(each["grants_paths"] for each in self.design["scenarios"] if each["name"] == scenario)
        if beside is None or (controller["paths"] == "unknown" and grants):
            return None
        found = compare(self.runs, controller["name"], beside, claim["metric"], scenario, self.first_objective)
        if found["estimate"] is None:
            return None
        bounds = found["student_95"]
        upper = bounds[1] if surely and bounds else found["estimate"]
        return verdict(
            claim,
            controller["name"],
            scenario=scenario,
            beside=beside,
            measured=found["estimate"],
            student_95=bounds,
            words=f"{number(found['estimate'])} {interval(bounds)}".strip(),
            limit=f"upper end ≤ {most:g}" if surely else f"≤ {most:g}",
            holds=upper <= most,
        )

    def means(self, claim: Json, controller: str, scenarios: list[str], most: float) -> Json | None:
        """The largest mean of all scenarios; larger ones than claimed are named."""
        every = {scenario: self.mean(controller, claim["metric"], scenario) for scenario in scenarios}
        means = {scenario: value for scenario, value in every.items() if value is not None}
        if not means:
            return None
        worst = max(means.values())
        above = [f"`{scenario}` {number(value)}" for scenario, value in means.items() if value > most]
        words = ", ".join(above) or f"{number(worst)} at most"
        return verdict(claim, controller, measured=worst, words=words, limit=f"≤ {most:g}", holds=not above)

    def within_bound(
        self, claim: Json, controller: str, scenarios: list[str], factor: float, spare_m: float
    ) -> Json | None:
        """The median over scenarios of a controller's value over the allowed one."""
        rows = self.runs.of_controller(controller, claim["metric"]).dropna(subset=["value", "bound_rms_m"])
        allowed = factor * rows["bound_rms_m"] + spare_m
        ratios = []
        for scenario in scenarios:
            here = rows["scenario"] == scenario
            values, limits = rows["value"][here], allowed[here]
            if len(values) and (values > 0).all() and (limits > 0).all():
                ratios.append(float(np.exp(np.log(values / limits).mean())))
        if not ratios:
            return None
        middle = float(np.median(ratios))
        limit = f"≤ 1 of {factor:g} × bound + {spare_m:g} m"
        return verdict(
            claim, controller, beside="bound", measured=middle, words=number(middle), limit=limit, holds=middle <= 1
        )

    def undominated(self, claim: Json, own: list[Json], others: list[Json], scenario: str) -> Json | None:
        """No other controller dominates any of the controllers in the columns of the Pareto front."""
        of_own, of_others = (
            [point for each in side if (point := self.point(each["name"], scenario))] for side in (own, others)
        )
        if not of_own or not of_others:
            return None
        beaten = sum(any(dominates(other, point) for point in of_own) for other in of_others)
        return verdict(
            claim,
            ", ".join(claim["controllers"]),
            scenario=scenario,
            beside=", ".join(claim["beside"]),
            words=f"{beaten} of {len(of_others)} dominate one",
            limit="0",
            holds=beaten == 0,
        )


def verdict(claim: Json, controller: str, **found: Any) -> Json:
    """A claim about one controller in one scenario, or in all, decided."""
    open_members = {"scenario": None, "beside": None, "measured": None, "student_95": None}
    members = {"claim": claim["claim"], "controller": controller, **open_members, **found}
    order = ["claim", "scenario", "controller", "beside", "measured", "student_95", "words", "limit", "holds"]
    return {member: members[member] for member in order}


def dominates(a: list[float], b: list[float]) -> bool:
    """Whether `a` is no worse in both, and better in one."""
    return a[0] <= b[0] and a[1] <= b[1] and a != b
