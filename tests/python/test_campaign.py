"""A campaign's statistics, worked out again with pandas and SciPy from the same rows.

PILOTFISH is the path of the program. The report's numbers are those of report.json; the rows are runs.parquet.
"""

import json
import subprocess

import numpy as np
import pandas as pd
import pytest
import scipy.stats

from program import pilotfish, program

METRICS = ["rms_m", "energy_j", "steep_steps_percent"]
SCENARIOS = ["paper-tracking", "switching"]
REFERENCE = "ahead"
REPLICATES = 6
PARAMETER = "surface_craft.speed_mps"
TOLERANCE = 1e-9

# Three look-aheads of one law: no solves, so that it takes seconds.
CAMPAIGN = f"""
schema_version = "1"
name = "statistics"
title = "Whether <numbers> agree & are those of SciPy"
seed = 5
scenarios = {json.dumps(SCENARIOS)}
duration_s = 120
replicates = {REPLICATES}

[[parameters]]
key = "{PARAMETER}"
uniform = [0.05, 0.3]

[[controllers]]
name = "near"
law = {{ name = "saturated_los", gains = {{ look_ahead_m = 3, along_track_gain_per_s = 0.15 }} }}

[[controllers]]
name = "{REFERENCE}"
law = {{ name = "saturated_los", gains = {{ look_ahead_m = 8, along_track_gain_per_s = 0.15 }} }}

[[controllers]]
name = "slow"
law = {{ name = "saturated_los", gains = {{ look_ahead_m = 8, along_track_gain_per_s = 0.05 }} }}

[report]
reference = "{REFERENCE}"
metrics = {json.dumps(METRICS)}
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A campaign that was flown, with its report."""
    folder = tmp_path_factory.mktemp("campaign")
    file = folder / "statistics.toml"
    file.write_text(CAMPAIGN)
    out = folder / "out"
    subprocess.run([program(), "campaign", "run", str(file), "--out", str(out)], check=True)
    subprocess.run([program(), "campaign", "report", str(out)], check=True)
    return out


@pytest.fixture(scope="module")
def rows(folder):
    return pd.read_parquet(folder / "runs.parquet")


@pytest.fixture(scope="module")
def report(folder):
    return json.loads((folder / "report.json").read_text())


def near(value):
    return pytest.approx(value, rel=TOLERANCE, abs=TOLERANCE)


def paired(rows, controller, metric):
    """Values of a controller and of the reference, a row a world that both flew."""
    world = ["scenario", "craft", "replicate"]
    columns = world + [metric, "run", f"param.{PARAMETER}"]
    of = [rows.loc[rows["controller"] == name, columns].set_index(world) for name in (controller, REFERENCE)]
    return of[0].join(of[1].add_suffix("_reference")).dropna().reset_index()


def contrasts(pairs, metric, measure):
    a, b = pairs[metric], pairs[f"{metric}_reference"]
    return np.log(a / b) if measure == "ratio" else a - b


def observations(pairs, metric, measure):
    """What the estimate is the mean of: groups where there are several, else pairs."""
    values = contrasts(pairs, metric, measure)
    groups = values.groupby([pairs["scenario"], pairs["craft"]]).mean()
    return groups.to_numpy() if len(groups) > 1 else values.to_numpy()


def shown(measure):
    return np.exp if measure == "ratio" else np.asarray


def holm(p):
    """S. Holm, Scand. J. Stat. 6 (1979), 65-70."""
    order = np.argsort(p, kind="stable")
    factors = np.arange(len(p), 0, -1)
    adjusted = np.empty(len(p))
    adjusted[order] = np.minimum(1.0, np.maximum.accumulate(factors * np.asarray(p)[order]))
    return adjusted


def are_equal(values):
    """Whether they are, but for rounding."""
    return np.ptp(values) <= 1e-11 * np.abs(values).max()


def of_place(rows, comparison):
    pairs = paired(rows, comparison["controller"], comparison["metric"])
    if comparison["scenario"] is not None:
        pairs = pairs[pairs["scenario"] == comparison["scenario"]]
    return pairs


def test_every_run_is_a_row_and_the_report_compares_everyone_everywhere(rows, report):
    assert len(rows) == report["campaign"]["n_rows"] == 3 * len(SCENARIOS) * REPLICATES
    assert (rows["failure"] == "").all() and report["campaign"]["n_failed"] == 0
    assert report["campaign"]["reference"] == REFERENCE
    found = [(c["metric"], c["controller"], c["scenario"]) for c in report["comparisons"]]
    expected = [(m, c, s) for m in METRICS for c in ("near", "slow") for s in (None, *SCENARIOS)]
    assert found == expected


def test_ratios_intervals_and_probabilities_are_those_of_scipy(rows, report):
    for comparison in report["comparisons"]:
        pairs = of_place(rows, comparison)
        metric, measure = comparison["metric"], comparison["measure"]
        positive = (pairs[[metric, f"{metric}_reference"]] > 0.0).all(axis=None)
        assert measure == ("ratio" if positive else "difference")
        values = observations(pairs, metric, measure)
        assert comparison["n_pairs"] == len(pairs)
        assert comparison["n_clusters"] == len(values)
        assert comparison["cluster"] == ("replicate" if comparison["scenario"] else "scenario")
        out = shown(measure)
        assert comparison["estimate"] == near(out(values.mean()))
        means = [pairs[metric].mean(), pairs[f"{metric}_reference"].mean()]
        assert [comparison["mean"], comparison["reference_mean"]] == near(means)
        if are_equal(values):
            # How much they vary is not known: there is no test, but of values that are all 0.
            assert comparison["p"] in (None, 1.0)
            continue
        test = scipy.stats.ttest_1samp(values, 0.0)
        interval = test.confidence_interval(0.95)
        assert comparison["student_95"] == near(list(out([interval.low, interval.high])))
        assert comparison["p"] == near(test.pvalue)


def test_some_comparisons_are_ratios_and_the_laws_do_differ(report):
    ratios = [c for c in report["comparisons"] if c["metric"] == "rms_m"]
    assert {c["measure"] for c in ratios} == {"ratio"}
    assert any(c["student_95"][0] < c["estimate"] < c["student_95"][1] for c in ratios)


def test_wins_and_their_interval_are_those_of_scipy(rows, report):
    for comparison in report["comparisons"]:
        pairs = of_place(rows, comparison)
        a, b = pairs[comparison["metric"]], pairs[f"{comparison['metric']}_reference"]
        wins = (a < b).sum() + 0.5 * (a == b).sum()
        assert comparison["wins"]["share"] == near(wins / len(pairs))
        if wins == round(wins):
            wilson = scipy.stats.binomtest(int(wins), len(pairs)).proportion_ci(method="wilson")
            assert comparison["wins"]["wilson_95"] == near([wilson.low, wilson.high])


def test_probabilities_are_adjusted_by_holm_together(report):
    for table in ("comparisons", "effects"):
        known = [entry for entry in report[table] if entry["p"] is not None]
        assert [entry["p_holm"] for entry in known] == near(list(holm([entry["p"] for entry in known])))
        assert all(entry["p_holm"] is None for entry in report[table] if entry["p"] is None)


def test_effects_of_the_parameter_are_those_of_scipy(rows, report):
    assert len(report["effects"]) == len(METRICS) * 2
    for effect in report["effects"]:
        assert effect["parameter"] == f"param.{PARAMETER}"
        pairs = paired(rows, effect["controller"], effect["metric"])
        values = contrasts(pairs, effect["metric"], effect["measure"])
        # No mission failed: the groups' means cancel, and a replicate's value is its mean over the groups.
        by_replicate = values.groupby(pairs["replicate"]).mean()
        drawn = pairs.groupby("replicate")[effect["parameter"]].first()
        assert effect["n_replicates"] == len(by_replicate) == REPLICATES
        if by_replicate.nunique() > 1 and effect["metric"] != "steep_steps_percent":
            expected = scipy.stats.spearmanr(drawn, by_replicate)
            assert effect["spearman"] == near(expected.statistic)
            assert effect["p"] == near(expected.pvalue)
        order = np.argsort(drawn.to_numpy())
        for third, places in zip(effect["thirds"], np.array_split(order, 3)):
            assert third["parameter"] == [drawn.iloc[places[0]], drawn.iloc[places[-1]]]
            inside = by_replicate.iloc[places]
            assert third["estimate"] == near(shown(effect["measure"])(inside.mean()))
            half = scipy.stats.t.ppf(0.975, len(inside) - 1) * scipy.stats.sem(inside)
            limits = [inside.mean() - half, inside.mean() + half]
            if are_equal(inside):
                assert third["student_95"] is None
            else:
                assert third["student_95"] == near(list(shown(effect["measure"])(limits)))


def test_a_report_of_the_same_rows_is_the_same_and_needs_nothing_else(folder):
    names = ["report.html", "report.md", "report.json"]
    before = [(folder / name).read_bytes() for name in names]
    assert pilotfish("campaign", "report", str(folder)).returncode == 0
    assert [(folder / name).read_bytes() for name in names] == before
    page = before[0].decode()
    assert "<title>Whether &lt;numbers&gt; agree &amp; are those of SciPy</title>" in page
    for reference in ("<link", "<img", "href=", "src=", "url("):
        assert reference not in page
