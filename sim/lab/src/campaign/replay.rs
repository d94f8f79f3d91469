//! Replay of a run.

use planner::FixedFigure;
use planner::los::LawGains;
use sim::{guide::GuideError, record::Record};

use super::controller::ControlLaw;
use super::design::{Campaign, Run};
use super::fly::{RunGains, bound, fly, result};
use super::grid::Setting;
use super::rows::Rows;

/// A replayed run.
#[derive(Clone, Debug)]
pub struct Replay {
    /// The run.
    pub run: Run,
    /// The controller's name.
    pub controller: String,
    /// The controller's knowledge in words.
    pub information: String,
    /// Gains of its law; none for another controller.
    pub gains: Option<LawGains>,
    /// Its record.
    pub record: Record,
    /// `true` if its row is bit-identical, except for measured cells.
    pub same: bool,
}

/// A run cannot be replayed.
#[derive(Debug, thiserror::Error)]
pub enum ReplayError {
    /// There is no such run.
    #[error("there is no run {0}: the table has {1} of at most {2} runs")]
    NoRun(u64, usize, u64),
    /// The mission failed, perhaps as before.
    #[error("the mission failed")]
    Mission(#[source] GuideError),
}

/// Flies the run of that number again, at the gains of its row in `rows`.
pub fn replay(campaign: &Campaign, rows: &Rows, number: u64) -> Result<Replay, ReplayError> {
    let no_run = || ReplayError::NoRun(number, rows.len(), campaign.n_runs());
    let run = campaign.run(number).ok_or_else(no_run)?;
    let before = rows.only(number).ok_or_else(no_run)?;
    let controller = &campaign.controllers[run.controller];
    let cell = |name: &str| *before.numbers(name)?.first()?;
    let setting = Setting {
        gains: match controller.law {
            ControlLaw::Tuned(_) | ControlLaw::Fixed(_) => Some(LawGains {
                look_ahead_m: cell("look_ahead_m").ok_or_else(no_run)?,
                along_track_gain_per_s: cell("along_track_gain_per_s").ok_or_else(no_run)?,
                integral_gain_mps: cell("integral_gain_mps"),
            }),
            ControlLaw::Planner { .. } | ControlLaw::Guide(_) => None,
        },
        dwell_s: cell("dwell_s"),
        figure: controller.figure().and_then(|figure| {
            let (radius_m, speed_share) = cell("figure_radius_m").zip(cell("figure_speed_share"))?;
            Some(FixedFigure { kind: figure.kind, radius_m, speed_share })
        }),
    };
    let gains = RunGains { setting, objectives: before.words("objectives").unwrap_or_default().concat() };
    let flown = fly(campaign, run.condition, controller, setting);
    let record = flown.map_err(ReplayError::Mission)?.record;
    let again = result(campaign, run, &gains, bound(campaign, run.condition));
    let again = Rows::of([again.map_err(|away| ReplayError::Mission(away.into()))?]);
    Ok(Replay {
        run,
        controller: controller.name.clone(),
        information: controller.information(),
        gains: setting.gains,
        record,
        same: again.digest() == before.digest(),
    })
}
