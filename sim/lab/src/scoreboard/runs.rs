//! Every run of a board as a row of Apache Parquet.

use std::{borrow::Cow, io::Write};

use crate::bench::{Board, Family, Flown, Score};
use planner::los::LosTuning;

use super::{CLAIRVOYANT, Provenance, Results};
use record::{
    ExportError,
    parquet::{Column, Table, Values, write_table},
};

/// A run, and what it is of.
struct Run<'a> {
    board: &'static str,
    scenario: &'a str,
    controller: &'a str,
    information: String,
    /// The families that it is judged in: those whose gains are the same share their runs.
    families: String,
    tuning: Option<LosTuning>,
    seed: u64,
    /// None of the clairvoyant, which flies nothing.
    score: Option<&'a Score>,
    bound_rms_m: Option<f64>,
}

/// Writes a row for every run, and one for every bound; the column `board` says of which of [`Results`].
pub fn write_runs(
    results: &Results,
    provenance: &Provenance,
    out: &mut (impl Write + Send),
) -> Result<(), ExportError> {
    let mut all = runs("contenders", &results.board);
    for (name, board) in [
        ("pareto", &results.pareto),
        ("other_plant", &results.other_plant),
        ("ablations", &results.ablations),
        ("sensitivity", &results.sensitivity),
    ] {
        all.extend(board.iter().flat_map(|board| runs(name, board)));
    }
    let about = vec![
        ("schema_version", "1".to_owned()),
        ("command", provenance.command.clone()),
        ("commit", provenance.commit.clone().unwrap_or_default()),
    ];
    write_table(
        &Table {
            name: "runs",
            columns: columns(&all),
            about,
        },
        out,
    )
}

fn runs<'a>(name: &'static str, board: &'a Board) -> Vec<Run<'a>> {
    let mut runs = vec![];
    for found in &board.matches {
        let bound = |k: usize| found.bound_rms_m.as_ref().map(|bounds| bounds[k]);
        for entry in &found.entries {
            for (i, Flown { tuning, scores }) in entry.flown.iter().enumerate() {
                let shares = |other: &Flown| other.tuning == *tuning;
                if entry.flown[..i].iter().any(shares) {
                    continue;
                }
                let families = Family::ALL.into_iter().zip(&entry.flown);
                let names: Vec<&str> = families
                    .filter(|(_, other)| shares(other))
                    .map(|(family, _)| family.name())
                    .collect();
                runs.extend(scores.iter().enumerate().map(|(k, score)| Run {
                    board: name,
                    scenario: &found.scenario,
                    controller: &entry.contender.name,
                    information: entry.contender.information(),
                    families: names.join(" "),
                    tuning: *tuning,
                    seed: board.seeds[k],
                    score: Some(score),
                    bound_rms_m: bound(k),
                }));
            }
        }
        for (k, seed) in board.seeds.iter().enumerate() {
            runs.extend(bound(k).map(|bound| Run {
                board: name,
                scenario: &found.scenario,
                controller: CLAIRVOYANT,
                information: "the truth and the whole future".to_owned(),
                families: Family::Nearness.name().to_owned(),
                tuning: None,
                seed: *seed,
                score: None,
                bound_rms_m: Some(bound),
            }));
        }
    }
    runs
}

fn columns(runs: &[Run<'_>]) -> Vec<Column> {
    let words = |name: &str, of: &dyn Fn(&Run<'_>) -> String| Column {
        name: name.to_owned(),
        values: Values::Words(runs.iter().map(|run| Cow::Owned(of(run))).collect()),
    };
    let numbers = |name: &str, of: &dyn Fn(&Run<'_>) -> Option<f64>| Column {
        name: name.to_owned(),
        values: Values::Numbers(runs.iter().map(of).collect()),
    };
    let mut columns = vec![
        words("board", &|run| run.board.to_owned()),
        words("scenario", &|run| run.scenario.to_owned()),
        words("controller", &|run| run.controller.to_owned()),
        words("information", &|run| run.information.clone()),
        words("families", &|run| run.families.clone()),
        #[expect(clippy::cast_precision_loss, reason = "seeds count from 1")]
        numbers("seed", &|run| Some(run.seed as f64)),
        numbers("look_ahead_m", &|run| Some(run.tuning?.gains.look_ahead)),
        numbers("along_track_gain_per_s", &|run| {
            Some(run.tuning?.gains.along_track_gain)
        }),
        numbers("integral_gain_mps", &|run| Some(run.tuning?.integral_gain)),
    ];
    for (name, of) in SCORES {
        columns.push(numbers(name, &|run| run.score.and_then(of)));
    }
    columns.push(numbers("bound_rms_m", &|run| run.bound_rms_m));
    columns
}

type Number = (&'static str, fn(&Score) -> Option<f64>);

#[expect(
    clippy::cast_precision_loss,
    reason = "thousands of episodes and ticks, not 2⁵³"
)]
pub(crate) const SCORES: [Number; 26] = [
    ("rms_m", |score| Some(score.metrics.rms_m)),
    ("mean_m", |score| Some(score.metrics.mean_m)),
    ("p95_m", |score| Some(score.metrics.p95_m)),
    ("max_m", |score| Some(score.metrics.max_m)),
    ("settled_rms_m", |score| Some(score.metrics.settled_rms_m)),
    ("time_to_3_m_s", |score| score.near_after_s),
    ("duration_s", |score| Some(score.duration_s)),
    ("energy_j", |score| Some(score.metrics.energy_j)),
    ("heading_travel_rad", |score| {
        Some(score.metrics.heading_travel_rad)
    }),
    ("reference_jerk", |score| Some(score.metrics.reference_jerk)),
    ("steep_steps_percent", |score| Some(100.0 * score.steep_share)),
    ("reference_violations", |score| Some(score.reference.count as f64)),
    ("reference_violation_worst_mps", |score| {
        Some(score.reference.worst)
    }),
    ("speed_violations", |score| {
        Some(score.metrics.violations.speed.count as f64)
    }),
    ("speed_violation_worst_mps", |score| {
        Some(score.metrics.violations.speed.worst)
    }),
    ("turn_rate_violations", |score| {
        Some(score.metrics.violations.turn_rate.count as f64)
    }),
    ("keep_out_violations", |score| {
        Some(score.metrics.violations.keep_out.count as f64)
    }),
    ("keep_out_violation_worst_m", |score| {
        Some(score.metrics.violations.keep_out.worst)
    }),
    ("area_violations", |score| {
        Some(score.metrics.violations.area.count as f64)
    }),
    ("range_violations", |score| {
        Some(score.metrics.violations.range.count as f64)
    }),
    ("range_violation_s", |score| {
        Some(score.metrics.violations.range.seconds)
    }),
    ("energy_violations", |score| {
        Some(score.metrics.violations.energy.count as f64)
    }),
    ("answers_mpc", |score| {
        Some(score.metrics.answers_by_method.mpc as f64)
    }),
    ("answers_previous_plan", |score| {
        Some(score.metrics.answers_by_method.previous_plan as f64)
    }),
    ("answers_saturated_los", |score| {
        Some(score.metrics.answers_by_method.saturated_los as f64)
    }),
    ("answers_hold", |score| {
        Some(score.metrics.answers_by_method.hold as f64)
    }),
];
