//! What a report says of rows that were made up.

use std::path::Path;

use serde_json::Value;

use super::*;
use crate::campaign::statistics::tests::{Line, rows};

/// The planner, a law as it was printed, and a law that may win.
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
name = "printed"
law = { name = "printed_los", gains = { look_ahead_m = 5, along_track_gain_per_s = 0.15 } }
[[controllers]]
name = "planner"
planner = {}
[[controllers]]
name = "law"
law = { name = "saturated_los", gains = { look_ahead_m = 5, along_track_gain_per_s = 0.15 } }
[report]
metrics = ["rms_m", "energy_j"]
"#;

fn campaign(report: &str) -> Campaign {
    let text = CAMPAIGN.replace("[report]\n", &format!("[report]\n{report}\n"));
    Campaign::parse(&text, "made-up.toml", Path::new(".")).expect("is a campaign")
}

/// The planner's distance is half of the law's give or take; one of its missions failed.
fn made_up() -> Vec<Line> {
    let mut lines = vec![];
    for scenario in ["paper-tracking", "switching"] {
        for replicate in 0..6 {
            let own = 0.5 + 0.02 * f64::from(replicate);
            for (controller, rms) in [("printed", 0.01 * own), ("planner", own), ("law", 1.0)] {
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
fn the_law_as_printed_is_no_reference_no_winner_and_not_drawn() {
    for asked in ["", "reference = \"printed\""] {
        let report = report(&campaign(asked), &rows(&made_up()));
        let json: Value = serde_json::from_str(&report.json()).expect("is JSON");
        assert_eq!(json["campaign"]["reference"], "law");
        assert_eq!(json["campaign"]["reference_replaced"], !asked.is_empty());
        let text = report.markdown();
        assert_eq!(
            text.contains("The file asks for another reference"),
            !asked.is_empty()
        );
        // It has by far the least, and certainly so, and is not in bold.
        let of = |name: &str| {
            let line = text
                .lines()
                .find(|line| line.starts_with(&format!("| `{name}` | `paper-tracking` |")));
            line.expect("is in the table").to_owned()
        };
        assert!(!of("printed").contains("**"), "{}", of("printed"));
        assert!(of("planner").contains("**"), "{}", of("planner"));
        let page = report.html();
        let (_, drawing) = page.split_once("<svg").expect("a picture");
        let (drawing, _) = drawing.split_once("</svg>").expect("it ends");
        assert!(drawing.contains(">planner<") && !drawing.contains(">printed<"));
    }
}

#[test]
fn failures_are_told_with_the_command_that_flies_them_again_and_are_in_no_pair() {
    let report = report(&campaign(""), &rows(&made_up()));
    let text = report.markdown();
    // The last world: runs 33 to 35.
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
fn a_page_needs_nothing_else_and_its_title_is_the_campaigns() {
    let page = report(&campaign(""), &rows(&made_up())).html();
    assert!(page.contains("<title>Pilotfish: Who &lt;wins&gt;</title>"));
    assert!(page.contains("<h1>Who &lt;wins&gt;</h1>"));
    for reference in [
        "<script", "<link", "<img", "href=", "src=", "url(", "NaN", "=\"inf",
    ] {
        assert!(!page.contains(reference), "{reference}");
    }
    // One picture a metric that is known.
    assert_eq!(page.matches("<svg").count(), 2);
}

#[test]
fn a_campaign_without_rows_has_a_report_too() {
    let none = report(&campaign(""), &Rows::default());
    assert!(none.markdown().contains("0 runs"));
    assert!(!none.html().contains("<svg"));
    let json: Value = serde_json::from_str(&none.json()).expect("is JSON");
    assert_eq!(json["comparisons"], Value::Array(vec![]));
}
