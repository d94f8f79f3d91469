"""Statistics and reports of campaigns: of rows made by hand, beside printed and worked values, and of a campaign
that is flown."""

import json
import math
import subprocess
import sys

import numpy as np
import pandas as pd
import pytest
import scipy.stats
from conftest import program

from pilotfish.analysis import report, write
from pilotfish.analysis.report import SCHEMA_VERSION
from pilotfish.analysis.runs import MEASURED, NotReportableError, Runs
from pilotfish.analysis.statistics import compare, effect, holm, mean, quantile, spearman
from pilotfish.analysis.words import number

SCENARIOS = ["paper-tracking", "switching"]


def near(value):
    return pytest.approx(value, rel=1e-9, abs=1e-9)


def line(controller, replicate, rms, **others):
    """A row, as far as it matters here."""
    row = {"scenario": "one", "craft": "scenario", "controller": controller, "objectives": "", "replicate": replicate}
    values = {"param.drawn": float(replicate), "rms_m": rms, "energy_j": 10 * rms, "failure": ""}
    return {**row, **values, **others}


def lost(controller, replicate, **others):
    """A mission that failed."""
    return line(controller, replicate, math.nan, failure="no answer", **others)


@pytest.fixture
def made(tmp_path):
    """Writes the rows of a campaign of these lines, and its design; returns the directory."""

    def make(lines, controllers=("a", "b"), **design):
        rows = pd.DataFrame(lines).assign(seed=1.0, duration_s=100.0)
        rows.insert(0, "run", np.arange(len(rows), dtype=float))
        ends = ["_s", "_sigma_s", "_tested_s"]
        learnt = [f"{name}{end}" for name in ("heading_lag", "surge_lag", "sway_per_yaw_rate") for end in ends]
        violations = [f"{kind}_violations" for kind in ("speed", "reference", "turn_rate", "keep_out", "area", "range")]
        gains = ["look_ahead_m", "along_track_gain_per_s", "integral_gain_mps"]
        others = ["alarms", "noticed_after_s", "bound_rms_m", "energy_violations"]
        for name in [*learnt, *violations, *gains, *MEASURED, *others]:
            rows[name] = math.nan
        kinds, same = {"planner": "planner"}, {"paths": "as_scenario", "information": "", "breaks": False}
        scenarios = dict.fromkeys(rows["scenario"])
        design = {
            "title": "Who <wins>",
            **dict.fromkeys(["seed", "replicates", "n_runs"], 6),
            "duration_s": None,
            "objectives": ["rms_m"],
            "parameters": [],
            "reference": controllers[-1],
            "metrics": ["rms_m", "energy_j"],
            "pareto_front": None,
            "claims": [],
            "controllers": [
                {"name": name, "entry": name, "kind": kinds.get(name, "law"), **same} for name in controllers
            ],
            "scenarios": [{"name": name, "title": "", "grants_paths": False} for name in scenarios],
            "craft": list(dict.fromkeys(rows["craft"])),
            **design,
        }
        rows.to_parquet(tmp_path / "runs.parquet")
        (tmp_path / "campaign.json").write_text(json.dumps({"name": "made-up", "design": design}))
        return tmp_path

    return make


def beside(directory, metric="rms_m", scenario=None):
    return compare(Runs(directory), "a", "b", metric, scenario)


def test_equal_replicates_of_a_mission_are_one_observation(made):
    def lines(replicate, scenario, noise):
        drawn = {"scenario": scenario, "param.drawn": 0.0}
        return [line("a", replicate, 1.0 + noise, **drawn), line("b", replicate, 2.0, **drawn)]

    still = [row for k in range(20) for row in lines(k, "still", 0.0)]
    noisy = [row for k in range(20) for row in lines(k, "noisy", 0.01 * k)]
    directory = made(still + noisy)
    assert report(directory)["campaign"]["repeated"] == ["still (scenario)"]
    found = beside(directory, scenario="still")
    assert (found["n_pairs"], found["estimate"], found["student_95"], found["p"]) == (1, 0.5, None, None)
    found = beside(directory, scenario="noisy")
    assert (found["n_pairs"], found["n_clusters"]) == (20, 20) and found["student_95"][0] < found["student_95"][1]


def test_a_law_tuned_for_several_objectives_is_judged_at_the_gains_for_the_metric(made):
    directory = made(
        [
            line("a", 0, 1.0),
            line("b", 0, 2.0, objectives="rms_m"),
            line("b", 0, 4.0, objectives="energy_j heading_travel_rad"),
            line("a", 1, 1.0),
            line("b", 1, 8.0, objectives="rms_m energy_j"),
            # The other did not fly it.
            line("a", 2, 1.0),
        ]
    )
    for metric, estimate in (("rms_m", math.sqrt(0.5 * 0.125)), ("energy_j", math.sqrt(0.25 * 0.125))):
        found = beside(directory, metric)
        assert (found["estimate"], found["n_pairs"], found["cluster"]) == (near(estimate), 2, "replicate")


def test_missions_that_failed_and_values_that_are_missing_are_counted_and_in_no_pair(made):
    lines = [line("a", 0, 1.0), line("b", 0, 2.0), lost("a", 1), line("b", 1, 2.0), lost("a", 2), lost("b", 2)]
    directory = made([*lines, line("a", 3, math.nan), line("b", 3, 2.0)])
    found = beside(directory)
    assert [found[n] for n in ("n_pairs", "n_failed", "n_reference_failed", "n_missing")] == [1, 2, 1, 1]
    assert (found["estimate"], found["student_95"], found["p"]) == (0.5, None, None)
    write(directory)
    text = (directory / "report.md").read_text()
    assert "| `a` | `one`, scenario | no answer | `pilotfish campaign replay DIR 2` | 2 |" in text
    assert "| `a` | `one` | 1, 2 failed, 1 failed of the reference, 1 without a value |" in text


def test_values_that_are_not_positive_are_compared_by_their_differences(made):
    values = [(0.0, 1.0), (2.0, 1.0), (1.0, 4.0)]
    found = beside(made([line(name, k, values[k][i]) for k in range(3) for i, name in enumerate("ab")]))
    assert (found["measure"], found["unit"], found["estimate"]) == ("difference", "m", near(-1.0))
    # -1, 1, -3: standard deviation 2, and t of two degrees of freedom is 4.303.
    low, high = found["student_95"]
    assert high - low == pytest.approx(2 * 4.303 * 2 / math.sqrt(3), abs=2e-3)
    assert found["wins"]["share"] == near(2 / 3)


def test_scenarios_and_craft_are_clusters_of_equal_weight_where_there_are_several(made):
    groups = [("one", "x", 0.5, 4), ("one", "y", 0.25, 1), ("two", "x", 1.0, 2), ("two", "y", 2.0, 2)]
    lines = [
        line(name, k, rms, scenario=scenario, craft=craft)
        for scenario, craft, factor, n in groups
        for k in range(n)
        for name, rms in (("a", factor), ("b", 1.0))
    ]
    directory = made(lines)
    found = beside(directory)
    assert (found["cluster"], found["n_clusters"], found["n_pairs"]) == ("scenario_and_craft", 4, 9)
    assert found["estimate"] == near(0.25**0.25)
    found = beside(directory, scenario="one")
    assert (found["cluster"], found["n_clusters"], found["estimate"]) == ("craft", 2, near(math.sqrt(0.125)))
    # ln 2 apart: half the distance is the standard error.
    low, high = found["student_95"]
    assert math.log(high / low) == pytest.approx(2 * 12.706 * 0.5 * math.log(2), abs=1e-3)


def test_an_effect_is_by_replicate_and_a_group_that_failed_does_not_shift_it(made):
    lines = []
    for k in range(9):
        for scenario, level in (("one", 1.0), ("two", 8.0)):
            own = lost("a", k) if scenario == "two" and k > 6 else line("a", k, level * 2.0**k)
            lines += [{**row, "scenario": scenario} for row in (own, line("b", k, 1.0))]
    found = effect(Runs(made(lines)), "a", "b", "rms_m", "param.drawn")
    assert (found["n_replicates"], found["spearman"]) == (9, near(1.0))
    thirds = found["thirds"]
    assert [(third["parameter"], third["n_replicates"]) for third in thirds] == [([0, 2], 3), ([3, 5], 3), ([6, 8], 3)]
    # Three doublings from third to third. Means are of 0 to 8 in one scenario and of 0 to 6 in the other, which shifts
    # what is in both by half a doubling against what is in one.
    assert thirds[1]["estimate"] / thirds[0]["estimate"] == near(8.0)
    assert math.log2(thirds[2]["estimate"] / thirds[1]["estimate"]) == near(3.0 - 0.5 * 2 / 3)


def test_a_mean_of_one_value_and_of_equal_ones_has_no_interval():
    for equal in ([3.0], [0.1 + 0.2, 0.3, 0.3]):
        assert mean(equal) == (near(equal[-1]), None, None)
    assert mean([0.0, 0.0]) == (0.0, None, 1.0)
    # 1, 2, 3: t = 2 sqrt(3), and P(|t| of two degrees > t) = 1 - t / sqrt(2 + t^2).
    t = 2 * math.sqrt(3)
    assert mean([1.0, 2.0, 3.0])[2] == near(1 - t / math.sqrt(2 + t * t))
    assert [quantile([5.0, 1.0, 4.0, 2.0, 3.0], share) for share in (0, 0.2, 0.5, 0.61, 1)] == [1, 1, 3, 4, 5]


def test_corrections_and_ranks_are_the_worked_examples():
    found = [{"p": p, "p_holm": None} for p in (0.01, 0.04, None, 0.03, 0.005)]
    holm(found)
    assert [entry["p_holm"] for entry in found] == [near(0.03), near(0.06), None, near(0.06), near(0.02)]
    # Ranks 1 2 3 4 5 beside 2 1 4 3 5: 1 - 6 * 4 / (5 * 24).
    assert spearman(np.arange(5), np.array([0.2, 0.1, 40.0, 3.0, 500.0]))[0] == near(0.8)
    assert spearman(np.arange(4), np.ones(4)) == (None, None)
    shown = [number(value) for value in (-0.0001, 0.5, -12.34, 99999.5, 1.5e7)]
    assert shown == ["0.000", "0.500", "−12.3", "100000", "1.50e7"]


def test_the_worst_run_has_the_largest_ratio_and_is_named_with_the_references(made):
    values = [(1.0, 2.0), (3.0, 1.0), (90.0, 100.0)]
    controllers = ("planner", "law")
    lines = [line(name, k, values[k][i]) for k in range(3) for i, name in enumerate(controllers)]
    directory = made(lines, controllers)
    worst = report(directory)["worst"]
    assert [(run["run"], run["reference_run"]) for run in worst] == [(2, 3), (4, 5), (0, 1)]
    # As the reference it is compared with none: its worst runs have the largest values.
    worst = report(made(lines, ("law", "planner")))["worst"]
    assert [(run["run"], run["by"]) for run in worst] == [(4, None), (2, None), (0, None)]


def test_claims_are_decided_and_a_broken_one_is_named_with_what_broke_it(made):
    def claim(claim, controllers, asked, **others):
        usual = {"scenarios": [], "metric": "rms_m", "beside": []}
        return {"claim": claim, "controllers": controllers, "is": asked, **usual, **others}

    lines = [
        line(name, k, rms, scenario=scenario)
        for scenario in SCENARIOS
        for k in range(6)
        for name, rms in (("planner", 0.5 + 0.02 * k), ("law", 1.0))
    ]
    claims = [
        claim("half", ["planner"], {"ratio_at_most": 0.56}, beside=["law"]),
        claim("surely half", ["planner"], {"ratio_surely_at_most": 0.5}, beside=["law"], scenarios=["switching"]),
        claim("near", ["planner", "law"], {"mean_at_most": 0.9}),
        claim("nearer and cheaper", ["planner"], "undominated", beside=["law"]),
        claim("the other way", ["law"], "undominated", beside=["planner"], scenarios=["switching"]),
    ]
    directory = made(lines, ("planner", "law"), claims=claims, pareto_front=["rms_m", "energy_j"])
    found = report(directory)
    verdicts = [(v["claim"], v["controller"], v["scenario"], v["holds"]) for v in found["claims"]]
    assert verdicts == [
        ("half", "planner", "paper-tracking", True),
        ("half", "planner", "switching", True),
        ("surely half", "planner", "switching", False),
        ("near", "planner", None, True),
        ("near", "law", None, False),
        ("nearer and cheaper", "planner", "paper-tracking", True),
        ("nearer and cheaper", "planner", "switching", True),
        ("the other way", "law", "switching", False),
    ]
    assert all((w["controller"], w["as_good"]) == ("planner", []) for w in found["winners"])
    write(directory)
    text, page = ((directory / name).read_text() for name in ("report.md", "report.html"))
    assert "| near | all | law |  | `paper-tracking` 1.00, `switching` 1.00 | ≤ 0.9 | **no** |" in text
    assert "| `planner` | **0.550 ± 0.039** | **5.50 ± 0.393** |" in text
    assert "<title>Who &lt;wins&gt;</title>" in page and "Mean energy_j against mean rms_m, by scenario" in page
    for reference in ("<link", "<img", "<script", "src=", 'href="http'):
        assert reference not in page
    before = page
    write(directory)
    assert (directory / "report.html").read_text() == before


def test_a_directory_without_a_finished_campaign_is_named(tmp_path):
    with pytest.raises(NotReportableError, match=r"campaign\.json is missing"):
        report(tmp_path)


# Three look-aheads of one law: no solves, so that it takes seconds.
CAMPAIGN = """
schema_version = "1"
name = "statistics"
title = "Whether the numbers agree"
seed = 5
scenarios = ["paper-tracking", "switching"]
duration_s = 120
replicates = 6
parameters = [{ key = "surface_craft.speed_mps", uniform = [0.05, 0.3] }]
controllers = [
  { name = "near", law = { name = "saturated_los", gains = { look_ahead_m = 3, along_track_gain_per_s = 0.15 } } },
  { name = "ahead", law = { name = "saturated_los", gains = { look_ahead_m = 8, along_track_gain_per_s = 0.15 } } },
  { name = "slow", law = { name = "saturated_los", gains = { look_ahead_m = 8, along_track_gain_per_s = 0.05 } } },
]
[report]
reference = "ahead"
metrics = ["rms_m", "energy_j", "steep_steps_percent"]
"""


def test_a_campaign_that_is_flown_is_reported_as_scipy_counts_its_rows(tmp_path):
    file, out = tmp_path / "statistics.toml", tmp_path / "out"
    file.write_text(CAMPAIGN)

    def run(*command):
        return subprocess.run(command, check=True, capture_output=True, text=True).stdout

    table = run(program(), "campaign", "run", str(file), "--out", str(out))
    written = run(sys.executable, "-m", "pilotfish.analysis", "report", str(out)).split()
    assert written == [str(out / name) for name in ("report.html", "report.md", "report.json")]
    found, rows = json.loads((out / "report.json").read_text()), pd.read_parquet(out / "runs.parquet")
    assert found["schema_version"] == SCHEMA_VERSION
    assert found["campaign"]["n_rows"] == len(rows) == 36
    assert found["campaign"]["digest"] == run(program(), "campaign", "digest", str(out)).strip()
    columns = {name: place for place, name in enumerate(found["metrics"])}
    world = ["scenario", "replicate"]
    for comparison in found["comparisons"]:
        metric, scenario = comparison["metric"], comparison["scenario"]
        both = rows.pivot(index=world, columns="controller", values=metric)
        a, b = both[comparison["controller"]], both["ahead"]
        is_ratio = comparison["measure"] == "ratio"
        here = [a, b] if scenario is None else [a[scenario], b[scenario]]
        assert is_ratio == all((values > 0).all() for values in here)
        values = np.log(a / b) if is_ratio else a - b
        values = values[scenario] if scenario else values.groupby("scenario").mean()
        shown = np.exp if is_ratio else np.asarray
        assert comparison["estimate"] == near(float(shown(values.mean())))
        if scenario is None and is_ratio:
            line = next(line for line in table.splitlines() if line.startswith(comparison["controller"]))
            assert float(line.split()[3 + columns[metric]]) == pytest.approx(comparison["estimate"], abs=5.1e-4)
        if comparison["p"] not in (None, 1.0):
            test = scipy.stats.ttest_1samp(values, 0.0)
            assert comparison["p"] == near(test.pvalue)
            assert comparison["student_95"] == near(list(shown(list(test.confidence_interval(0.95)))))
