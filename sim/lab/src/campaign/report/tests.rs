//! What a report says of rows that were made up.

use serde_json::Value;

use super::*;
use crate::campaign::{
    ScenarioFiles,
    statistics::tests::{Line, rows},
};

/// The planner and two laws.
const CAMPAIGN: &str = r#"
schema_version = "1"
name = "made-up"
title = "Who <wins>"
scenarios = ["paper-tracking", "switching"]
replicates = 6
[[parameters]]
key = "surface_craft.speed_mps"
uniform = [0.1, 0.3]
[[controllers]]
name = "law"
law = { name = "saturated_los", gains = { look_ahead_m = 5, along_track_gain_per_s = 0.15 } }
[[controllers]]
name = "planner"
planner = {}
[[controllers]]
name = "other"
law = { name = "integral_los", gains = { look_ahead_m = 5, along_track_gain_per_s = 0.15 } }
[report]
metrics = ["rms_m", "energy_j"]
"#;

fn campaign(report: &str) -> Campaign {
    let metrics = "metrics = [\"rms_m\", \"energy_j\"]\n";
    let text = CAMPAIGN.replace(metrics, &format!("{metrics}{report}\n"));
    Campaign::parse(&text, "made-up.toml", ScenarioFiles::default()).expect("is a campaign")
}

/// The planner's distance is half of the law's give or take; one of its missions failed.
fn made_up() -> Vec<Line> {
    let mut lines = vec![];
    for scenario in ["paper-tracking", "switching"] {
        for replicate in 0..6 {
            let own = 0.5 + 0.02 * f64::from(replicate);
            for (controller, rms) in [("other", 2.0), ("planner", own), ("law", 1.0)] {
                let failed = (controller, scenario, replicate) == ("planner", "switching", 5);
                lines.push(Line {
                    scenario,
                    rms_m: (!failed).then_some(rms),
                    failure: if failed { "no answer" } else { "" },
                    drawn: f64::from(replicate),
                    ..Line::new(controller, replicate, rms)
                });
            }
        }
    }
    lines
}

#[test]
fn the_first_law_is_the_reference_unless_another_controller_is_asked_for() {
    for (asked, reference) in [("", "law"), ("reference = \"other\"", "other")] {
        let report = report(&campaign(asked), &rows(&made_up()));
        let json: Value = serde_json::from_str(&report.json()).expect("is JSON");
        assert_eq!(json["campaign"]["reference"], reference);
        let text = report.markdown();
        let mut lines = text.lines();
        let planner = lines.find(|line| line.starts_with("| `planner` | `paper-tracking` |"));
        assert!(planner.is_some_and(|line| line.contains("**")), "{text}");
    }
}

#[test]
fn failures_are_listed_with_the_command_that_flies_them_again_and_are_in_no_pair() {
    let report = report(&campaign(""), &rows(&made_up()));
    let text = report.markdown();
    // The last condition: runs 33 to 35.
    assert!(
        text.contains(
            "| `planner` | `switching`, scenario | no answer | `pilotfish campaign replay DIR 34` | 34 |"
        ),
        "{text}"
    );
    assert!(
        text.contains("| `planner` | `switching` | 5, 1 failed |"),
        "{text}"
    );
    let json: Value = serde_json::from_str(&report.json()).expect("is JSON");
    assert_eq!(json["campaign"]["n_failed"], 1);
    assert_eq!(json["failures"][0]["run"], 34);
}

#[test]
fn the_worst_run_is_named_with_the_reference_in_the_same_world() {
    let report = report(&campaign(""), &rows(&made_up()));
    let json: Value = serde_json::from_str(&report.json()).expect("is JSON");
    let worst = &json["worst"][0];
    // The last replicate of the first scenario: runs 15 to 17.
    assert_eq!(
        (&worst["controller"], &worst["run"]),
        (&"planner".into(), &16.into())
    );
    assert_eq!(
        (&worst["reference_run"], &worst["value"]),
        (&17.into(), &0.6.into())
    );
    assert_eq!(json["worst"].as_array().map(Vec::len), Some(10));
    // The planner as the reference is compared with none: its worst runs are those with the largest values.
    let alone = super::report(&campaign("reference = \"planner\""), &rows(&made_up()));
    let json: Value = serde_json::from_str(&alone.json()).expect("is JSON");
    assert_eq!(
        (&json["worst"][0]["run"], &json["worst"][0]["by"]),
        (&16.into(), &Value::Null)
    );
}

#[test]
fn the_worst_run_is_the_one_with_the_largest_ratio_and_not_the_largest_value() {
    let lines: Vec<Line> = (0..)
        .zip([(1.0, 2.0), (3.0, 1.0), (90.0, 100.0)])
        .flat_map(|(k, (a, b))| [Line::new("planner", k, a), Line::new("law", k, b)])
        .collect();
    let report = report(&campaign(""), &rows(&lines));
    let json: Value = serde_json::from_str(&report.json()).expect("is JSON");
    let worst = json["worst"].as_array().expect("is a list");
    let runs: Vec<_> = worst
        .iter()
        .map(|worst| [&worst["run"], &worst["reference_run"]].map(Value::as_u64))
        .collect();
    assert_eq!(runs, [[2, 3], [4, 5], [0, 1]].map(|both| both.map(Some)));
    assert!((worst[0]["by"].as_f64().expect("is a number") - 3.0).abs() < 1e-15);
}

#[test]
fn a_campaign_without_rows_has_a_report_too() {
    let none = report(&campaign(""), &Rows::default());
    assert!(none.markdown().contains("0 runs"));
    let json: Value = serde_json::from_str(&none.json()).expect("is JSON");
    assert_eq!(json["comparisons"], Value::Array(vec![]));
}

/// Claims about the planner beside the law, as `made_up` has it: half as far, a tenth of it over all scenarios.
const CLAIMS: &str = r#"
pareto_front = ["rms_m", "energy_j"]
[[claims]]
claim = "half as far"
controllers = ["planner"]
beside = ["law"]
is = { ratio_at_most = 0.56 }
[[claims]]
claim = "surely half as far"
controllers = ["planner"]
beside = ["law"]
scenarios = ["switching"]
is = { ratio_surely_at_most = 0.5 }
[[claims]]
claim = "near"
controllers = ["planner", "law"]
is = { mean_at_most = 0.9 }
[[claims]]
claim = "both nearer and cheaper"
controllers = ["planner"]
beside = ["law"]
is = "undominated"
[[claims]]
claim = "the other way round"
controllers = ["law"]
beside = ["planner"]
is = "undominated"
"#;

#[test]
fn claims_are_decided_and_a_broken_one_is_named_with_what_broke_it() {
    let report = report(&campaign(CLAIMS), &rows(&made_up()));
    let json: Value = serde_json::from_str(&report.json()).expect("is JSON");
    let verdicts: Vec<(String, String, bool)> = json["claims"]
        .as_array()
        .expect("a list")
        .iter()
        .map(|verdict| {
            let word = |name: &str| verdict[name].as_str().unwrap_or("all").to_owned();
            let about = format!("{} {}", word("claim"), word("controller"));
            (
                about,
                word("scenario"),
                verdict["holds"].as_bool().expect("is decided"),
            )
        })
        .collect();
    let expected = [
        ("half as far planner", "paper-tracking", true),
        ("half as far planner", "switching", true),
        ("surely half as far planner", "switching", false),
        ("near law", "all", false),
        ("near planner", "all", true),
        ("both nearer and cheaper planner", "paper-tracking", true),
        ("both nearer and cheaper planner", "switching", true),
        ("the other way round law", "paper-tracking", false),
        ("the other way round law", "switching", false),
    ];
    let found: Vec<(&str, &str, bool)> = verdicts
        .iter()
        .map(|(about, scenario, holds)| (about.as_str(), scenario.as_str(), *holds))
        .collect();
    assert_eq!(found, expected);
    let text = report.markdown();
    assert!(
        text.contains("| near | all | law |  | `paper-tracking` 1.00, `switching` 1.00 | ≤ 0.9 | **no** |"),
        "{text}"
    );
    // The picture of the front is in the page.
    assert!(
        report
            .html()
            .contains("Mean energy_j against mean rms_m, by scenario")
    );
}

#[test]
fn the_least_wins() {
    let report = report(&campaign(""), &rows(&made_up()));
    let json: Value = serde_json::from_str(&report.json()).expect("is JSON");
    for winner in json["winners"].as_array().expect("a list") {
        assert_eq!(
            (&winner["controller"], &winner["as_good"]),
            (&"planner".into(), &Value::Array(vec![]))
        );
    }
    let text = report.markdown();
    assert!(
        text.contains("| `planner` | **0.550 ± 0.039** | **5.50 ± 0.393** |"),
        "{text}"
    );
}

#[test]
fn a_claim_that_cannot_be_decided_is_refused_by_its_member() {
    for (right, wrong, says) in [
        (
            "controllers = [\"planner\"]\nbeside",
            "controllers = [\"pilot\"]\nbeside",
            "claims[0].controllers: there is no controller \"pilot\"",
        ),
        (
            "beside = [\"law\"]\nis = { ratio",
            "is = { ratio",
            "claims[0].beside: is empty",
        ),
        (
            "pareto_front = [\"rms_m\", \"energy_j\"]",
            "",
            "claims[3].is: undominated needs report.pareto_front",
        ),
        (
            "pareto_front = [\"rms_m\"",
            "pareto_front = [\"rms\"",
            "report.pareto_front[0]: there is no column \"rms\"",
        ),
        ("ratio_at_most = 0.56", "ratio = 0.56", "unknown variant `ratio`"),
    ] {
        assert!(CLAIMS.contains(right), "{right}");
        let text = format!("{CAMPAIGN}{}", CLAIMS.replacen(right, wrong, 1));
        let refused =
            Campaign::parse(&text, "made-up.toml", ScenarioFiles::default()).expect_err("is refused");
        assert!(refused.to_string().contains(says), "{refused}\nshould say {says}");
    }
}
