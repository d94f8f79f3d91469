//! One run of a campaign, flown again.

use planner::los::{LosGains, LosTuning};
use sim::{guide::GuideError, record::Record};

mod explanation;

use explanation::explanation;

use super::{
    contender::Pilot,
    design::{Campaign, Run},
    fly::{Flight, TO_THE_END, bound, fly, row},
    rows::{Row, Rows},
};

/// A run that was flown again.
#[derive(Clone, Debug)]
pub struct Replay {
    /// Which.
    pub run: Run,
    /// The controller's name.
    pub controller: String,
    /// What the controller knows.
    pub information: String,
    /// What happened.
    pub record: Record,
    /// When the craft was farthest off, and what the record has to explain that with.
    pub explanation: String,
    /// Whether every cell of its row is again what it was, to the bit, but for the measured ones.
    pub same: bool,
}

/// Why a run was not flown again.
#[derive(Debug, thiserror::Error)]
pub enum ReplayError {
    /// There is no such run.
    #[error("there is no run {number}: the table has {rows} of the {runs} that there are at most")]
    NoRun {
        /// The number that was given.
        number: u64,
        /// Rows of the table.
        rows: usize,
        /// Runs of the campaign.
        runs: u64,
    },
    /// The mission failed, as it may have before.
    #[error("the mission failed")]
    Mission(#[source] GuideError),
}

/// Flies the run of that number again, as its row in `rows` says.
pub fn replay(campaign: &Campaign, rows: &Rows, number: u64) -> Result<Replay, ReplayError> {
    let no_run = || ReplayError::NoRun {
        number,
        rows: rows.len(),
        runs: campaign.n_runs(),
    };
    let run = campaign.run(number).ok_or_else(no_run)?;
    let before = rows.only(number).ok_or_else(no_run)?;
    let contender = &campaign.controllers[run.controller];
    let cell = |name: &str| {
        before
            .numbers(name)
            .and_then(|cells| cells.first().copied().flatten())
    };
    let tuning = match contender.pilot {
        Pilot::Law(law) => Some(LosTuning {
            law,
            gains: LosGains {
                look_ahead: cell("look_ahead_m").ok_or_else(no_run)?,
                along_track_gain: cell("along_track_gain_per_s").ok_or_else(no_run)?,
            },
            integral_gain: cell("integral_gain_mps").ok_or_else(no_run)?,
        }),
        Pilot::Tuned(_) | Pilot::Planner { .. } => None,
    };
    let words = before.words("objectives").and_then(|words| words.first());
    let flight = Flight {
        tuning,
        objectives: words.map(ToString::to_string).unwrap_or_default(),
    };
    let to_its_end = "nothing stops it";
    let flown = fly(campaign, run.world, contender, tuning, TO_THE_END).expect(to_its_end);
    let record = flown.map_err(ReplayError::Mission)?.record;
    let again = Row {
        bound_rms_m: bound(campaign, run.world, TO_THE_END).expect(to_its_end),
        ..row(campaign, run, &flight, TO_THE_END).expect(to_its_end)
    };
    let again = Rows::of(&[again], &campaign.parameter_keys());
    Ok(Replay {
        run,
        controller: contender.name.clone(),
        information: contender.information(),
        explanation: explanation(&record),
        record,
        same: again.digest() == before.digest(),
    })
}
