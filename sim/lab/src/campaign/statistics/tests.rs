//! Pairs, intervals and corrections, beside known and printed values.

use std::borrow::Cow;

use rand::SeedableRng as _;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution as _, LogNormal};
use record::parquet::{Column, Table, Values, write_table};

use super::{compare::wilson, effect::spearman, *};
use crate::campaign::rows::Rows;

/// A row, as far as it matters here.
#[derive(Clone, Debug)]
pub(crate) struct Line {
    pub(crate) scenario: &'static str,
    pub(crate) craft: &'static str,
    pub(crate) controller: &'static str,
    pub(crate) objectives: &'static str,
    pub(crate) replicate: u32,
    pub(crate) rms_m: Option<f64>,
    pub(crate) failure: &'static str,
    pub(crate) drawn: f64,
}

impl Line {
    pub(crate) fn new(controller: &'static str, replicate: u32, rms_m: f64) -> Self {
        Self {
            scenario: "one",
            craft: "scenario",
            controller,
            objectives: "",
            replicate,
            rms_m: Some(rms_m),
            failure: "",
            drawn: 0.0,
        }
    }
}

/// The rows of these lines, as runs 0, 1, …
pub(crate) fn rows(lines: &[Line]) -> Rows {
    let words = |name: &str, of: fn(&Line) -> &'static str| Column {
        name: name.to_owned(),
        values: Values::Words(lines.iter().map(|line| Cow::Borrowed(of(line))).collect()),
    };
    let numbers = |name: &str, values: Vec<Option<f64>>| Column {
        name: name.to_owned(),
        values: Values::Numbers(values),
    };
    let of = |of: fn(&Line) -> Option<f64>| lines.iter().map(of).collect::<Vec<_>>();
    let runs = (0_u32..).map(|run| Some(f64::from(run)));
    let mut file = vec![];
    let table = Table {
        name: "runs",
        columns: vec![
            numbers("run", runs.take(lines.len()).collect()),
            words("scenario", |line| line.scenario),
            words("craft", |line| line.craft),
            words("controller", |line| line.controller),
            words("objectives", |line| line.objectives),
            numbers("replicate", of(|line| Some(f64::from(line.replicate)))),
            numbers("param.drawn", of(|line| Some(line.drawn))),
            numbers("rms_m", of(|line| line.rms_m)),
            numbers("energy_j", of(|line| line.rms_m.map(|rms| 10.0 * rms))),
            words("failure", |line| line.failure),
        ],
        about: vec![],
    };
    write_table(&table, &mut file).expect("memory takes everything");
    Rows::read(file).expect("was just written")
}

fn beside<'a>(metric: &'a str, scenario: Option<&'a str>) -> Question<'a> {
    Question {
        controller: "a",
        reference: "b",
        metric,
        scenario,
        objective: None,
    }
}

#[test]
fn replicates_of_one_mission_are_one_observation() {
    let mut lines = vec![];
    for replicate in 0..20 {
        for scenario in ["still", "noisy"] {
            let noise = if scenario == "noisy" {
                0.01 * f64::from(replicate)
            } else {
                0.0
            };
            for (controller, rms_m) in [("a", 1.0 + noise), ("b", 2.0)] {
                lines.push(Line {
                    scenario,
                    ..Line::new(controller, replicate, rms_m)
                });
            }
        }
    }
    let runs = RunTable::of(&rows(&lines));
    let repeated: Vec<_> = runs
        .repeated
        .iter()
        .map(|&group| &runs.groups[group].scenario)
        .collect();
    assert_eq!(repeated, ["still"]);
    let still = compare(&runs, beside("rms_m", Some("still")));
    assert_eq!(
        (still.n_pairs, still.n_clusters, still.estimate),
        (1, 1, Some(0.5))
    );
    assert_eq!((still.student_95, still.p), (None, None));
    let noisy = compare(&runs, beside("rms_m", Some("noisy")));
    assert_eq!((noisy.n_pairs, noisy.n_clusters), (20, 20));
    assert!(noisy.student_95.is_some_and(|[low, high]| low < high));
}

fn near(found: f64, expected: f64, tolerance: f64) {
    assert!((found - expected).abs() <= tolerance, "{found}, not {expected}");
}

#[test]
fn a_law_that_is_tuned_for_several_objectives_is_judged_at_the_gains_for_the_metric() {
    let lines = [
        Line::new("a", 0, 1.0),
        Line {
            objectives: "rms_m",
            ..Line::new("b", 0, 2.0)
        },
        Line {
            objectives: "energy_j heading_travel_rad",
            ..Line::new("b", 0, 4.0)
        },
        // Another condition, in which both objectives have the same gains.
        Line::new("a", 1, 1.0),
        Line {
            objectives: "rms_m energy_j",
            ..Line::new("b", 1, 8.0)
        },
        // A condition that the other did not fly.
        Line::new("a", 2, 1.0),
    ];
    let runs = RunTable::of(&rows(&lines));
    for (metric, expected) in [("rms_m", [0.5, 0.125]), ("energy_j", [0.25, 0.125])] {
        let pairing = runs.pairing(["a", "b"], metric, None);
        let ratios: Vec<f64> = pairing
            .pairs
            .iter()
            .map(|pair| pair.values.0 / pair.values.1)
            .collect();
        assert_eq!(ratios, expected, "{metric}");
    }
    let found = compare(&runs, beside("energy_j", None));
    near(
        found.estimate.expect("two pairs"),
        (0.25_f64 * 0.125).sqrt(),
        1e-15,
    );
    assert_eq!((found.n_pairs, found.cluster), (2, Cluster::Replicate));
}

#[test]
fn missions_that_failed_and_values_that_are_missing_are_counted() {
    let failed = |line: Line| Line {
        rms_m: None,
        failure: "no answer",
        ..line
    };
    let lines = [
        Line::new("a", 0, 1.0),
        Line::new("b", 0, 2.0),
        failed(Line::new("a", 1, 1.0)),
        Line::new("b", 1, 2.0),
        failed(Line::new("a", 2, 1.0)),
        failed(Line::new("b", 2, 2.0)),
        Line {
            rms_m: None,
            ..Line::new("a", 3, 1.0)
        },
        Line::new("b", 3, 2.0),
    ];
    let found = compare(&RunTable::of(&rows(&lines)), beside("rms_m", None));
    let counts = (
        found.n_pairs,
        found.n_failed,
        found.n_reference_failed,
        found.n_missing,
    );
    assert_eq!(counts, (1, 2, 1, 1));
    assert_eq!(
        (found.estimate, found.student_95, found.p),
        (Some(0.5), None, None)
    );
}

#[test]
fn values_that_are_not_positive_are_compared_by_their_differences() {
    let lines = [(0.0, 1.0), (2.0, 1.0), (1.0, 4.0)];
    let lines: Vec<Line> = (0..)
        .zip(lines)
        .flat_map(|(k, (a, b))| [Line::new("a", k, a), Line::new("b", k, b)])
        .collect();
    let found = compare(&RunTable::of(&rows(&lines)), beside("rms_m", None));
    assert_eq!((found.measure, found.unit), (Measure::Difference, "m"));
    near(found.estimate.expect("three pairs"), -1.0, 1e-15);
    // −1, 1, −3: standard deviation 2, and t of two degrees of freedom is 4.303.
    let [low, high] = found.student_95.expect("three pairs");
    near(high - low, 2.0 * 4.303 * 2.0 / 3.0_f64.sqrt(), 2e-3);
    near(found.wins.expect("three pairs").share, 2.0 / 3.0, 1e-15);
}

#[test]
fn scenarios_and_craft_are_clusters_where_there_are_several() {
    let mut lines = vec![];
    for (scenario, craft, factor, replicates) in [
        ("one", "x", 0.5, 4),
        ("one", "y", 0.25, 1),
        ("two", "x", 1.0, 2),
        ("two", "y", 2.0, 2),
    ] {
        for replicate in 0..replicates {
            for (controller, rms) in [("a", factor), ("b", 1.0)] {
                lines.push(Line {
                    scenario,
                    craft,
                    drawn: f64::from(replicate),
                    ..Line::new(controller, replicate, rms)
                });
            }
        }
    }
    let runs = RunTable::of(&rows(&lines));
    let all = compare(&runs, beside("rms_m", None));
    assert_eq!(
        (all.cluster, all.n_clusters, all.n_pairs),
        (Cluster::ScenarioAndCraft, 4, 9)
    );
    // Each group counts once, however many replicates it has.
    near(all.estimate.expect("pairs"), 0.25_f64.powf(0.25), 1e-12);
    let one = compare(&runs, beside("rms_m", Some("one")));
    assert_eq!((one.cluster, one.n_clusters, one.n_pairs), (Cluster::Craft, 2, 5));
    near(one.estimate.expect("pairs"), 0.125_f64.sqrt(), 1e-12);
    let [low, high] = one.student_95.expect("two craft");
    // ln 2 apart: half the distance is the standard error.
    near((high / low).ln(), 2.0 * 12.706 * 0.5 * 2.0_f64.ln(), 1e-3);
}

#[test]
fn with_two_controllers_that_are_equal_in_distribution_the_interval_covers_one_95_times_in_100() {
    const CAMPAIGNS: u32 = 400;
    let mut random = ChaCha8Rng::seed_from_u64(11);
    let condition = LogNormal::new(1.0, 0.6).expect("finite");
    let own = LogNormal::new(0.0, 0.25).expect("finite");
    let (mut student, mut rejected) = (0, 0);
    for _ in 0..CAMPAIGNS {
        let lines: Vec<Line> = (0..12)
            .flat_map(|k| {
                let common = condition.sample(&mut random);
                ["a", "b"].map(|name| Line::new(name, k, common * own.sample(&mut random)))
            })
            .collect();
        let found = compare(&RunTable::of(&rows(&lines)), beside("rms_m", None));
        let [low, high] = found.student_95.expect("twelve pairs");
        student += u32::from((low..=high).contains(&1.0));
        rejected += u32::from(found.p.expect("twelve pairs") < 0.05);
    }
    let share = f64::from(student) / f64::from(CAMPAIGNS);
    assert!((share - 0.95).abs() <= 0.03, "{share}");
    // The test and the interval are one.
    assert_eq!(student + rejected, CAMPAIGNS);
}

#[test]
fn holm_is_the_worked_example() {
    // 0.01, 0.04, 0.03, 0.005: in order 4 · 0.005, 3 · 0.01, 2 · 0.03, and 1 · 0.04, which may not be less than the one before.
    let p = [Some(0.01), Some(0.04), None, Some(0.03), Some(0.005)];
    let expected = [Some(0.03), Some(0.06), None, Some(0.06), Some(0.02)];
    for (found, expected) in holm(&p).into_iter().zip(expected) {
        assert_eq!(found.is_some(), expected.is_some());
        near(found.unwrap_or(0.0), expected.unwrap_or(0.0), 1e-15);
    }
    assert_eq!(holm(&[Some(0.7), Some(0.9)]), [Some(1.0), Some(1.0)]);
}

#[test]
fn wilson_is_the_printed_interval() {
    // R. G. Newcombe, Stat. Med. 17 (1998), 857–872, table I: 81 of 263, 15 of 148, 0 of 20, 1 of 29.
    for (wins, n, printed) in [
        (81.0, 263.0, [0.2553, 0.3662]),
        (15.0, 148.0, [0.0624, 0.1605]),
        (0.0, 20.0, [0.0, 0.1611]),
        (1.0, 29.0, [0.0061, 0.1718]),
    ] {
        let found = wilson(wins, n);
        for (found, printed) in found.into_iter().zip(printed) {
            near(found, printed, 5.1e-5);
        }
    }
}

#[test]
fn spearman_is_what_is_found_by_hand() {
    // Ranks 1 2 3 4 5 beside 2 1 4 3 5: squared differences 4 · 1, ρ = 1 − 6 · 4 / (5 · 24) = 0.8.
    let (rho, p) = spearman(&[1.0, 2.0, 3.0, 4.0, 5.0], &[0.2, 0.1, 40.0, 3.0, 500.0]);
    near(rho.expect("five"), 0.8, 1e-15);
    // t = 0.8 √(3/0.36) = 2.309; of three degrees of freedom P(|t| > 2.309) = 1 − 2/π (θ + sin θ cos θ), tan θ = t/√3.
    let theta = (0.8 / 0.36_f64.sqrt()).atan();
    let expected = 1.0 - std::f64::consts::FRAC_2_PI * (theta + theta.sin() * theta.cos());
    near(p.expect("five"), expected, 1e-12);
    // Ties have their mean rank: 1.5 1.5 3 beside 1 2 3.
    near(
        spearman(&[1.0, 1.0, 2.0], &[1.0, 2.0, 3.0]).0.expect("three"),
        0.75_f64.sqrt(),
        1e-15,
    );
    let (rho, p) = spearman(&[1.0, 2.0, 3.0, 4.0], &[4.0, 3.0, 2.0, 1.0]);
    near(rho.expect("four"), -1.0, 1e-15);
    near(p.expect("four"), 0.0, 1e-12);
    assert_eq!(spearman(&[1.0; 4], &[1.0, 2.0, 3.0, 4.0]), (None, None));
    assert_eq!(spearman(&[1.0, 2.0], &[1.0, 2.0]), (None, None));
}

#[test]
fn an_effect_is_by_replicate_and_the_level_of_a_group_that_failed_is_not_missed() {
    let mut lines = vec![];
    for replicate in 0..9 {
        for (scenario, level) in [("one", 1.0), ("two", 8.0)] {
            let drawn = f64::from(replicate);
            let lost = scenario == "two" && 6 < replicate;
            for (controller, rms) in [("a", level * 2.0_f64.powf(drawn)), ("b", 1.0)] {
                lines.push(Line {
                    scenario,
                    drawn,
                    failure: if lost && controller == "a" { "lost" } else { "" },
                    ..Line::new(controller, replicate, rms)
                });
            }
        }
    }
    let found = effect(&RunTable::of(&rows(&lines)), beside("rms_m", None), "param.drawn").expect("pairs");
    assert_eq!((found.n_replicates, found.measure), (9, Measure::Ratio));
    near(found.spearman.expect("nine"), 1.0, 1e-12);
    let thirds = found.thirds.map(|third| third.expect("three each"));
    assert_eq!(thirds.map(|third| third.n_replicates), [3; 3]);
    assert_eq!(
        thirds.map(|third| third.parameter),
        [[0.0, 2.0], [3.0, 5.0], [6.0, 8.0]]
    );
    // Three doublings from third to third. Means are of 0 to 8 in one scenario and 0 to 6 in the other, which shifts what
    // is in both by half a doubling against what is in one.
    near(thirds[1].estimate / thirds[0].estimate, 8.0, 1e-9);
    let shift = 3.0 - 0.5 * 2.0 / 3.0;
    near((thirds[2].estimate / thirds[1].estimate).log2(), shift, 1e-9);

    let choice: Vec<Line> = lines
        .into_iter()
        .map(|line| Line {
            drawn: f64::from(u8::from(line.replicate < 4)),
            ..line
        })
        .collect();
    let two = effect(
        &RunTable::of(&rows(&choice)),
        beside("rms_m", None),
        "param.drawn",
    )
    .expect("pairs");
    assert!(two.thirds[0].is_some() && two.thirds[2].is_some());
}
