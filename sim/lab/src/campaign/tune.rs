//! The gains of laws: for each arena and law the best of its grid, on worlds that are not scored.

use planner::los::{LosGains, LosLaw, LosTuning};
use serde::{Deserialize, Serialize};
use sim::mission::Mission;

use super::{contender::Pilot, score::Score};
use super::{
    design::{Campaign, World},
    file::Objective,
    fly::{Flight, GoOn, Stopped, fly_while},
};
use crate::tuning::grid;

/// The best gains of the laws that are tuned in one arena.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Gains(pub(super) Vec<Tuned>);

/// The best gains of one law.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Tuned {
    /// The controller's name.
    pub(super) controller: String,
    /// The best gains, an entry for each objective in the file's order.
    pub(super) best: Vec<Best>,
}

/// The best gains for one objective.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Best {
    /// Look-ahead distance, m.
    pub(super) look_ahead_m: f64,
    /// Along-track gain, 1/s.
    pub(super) along_track_gain_per_s: f64,
    /// Integral gain, m/s.
    pub(super) integral_gain_mps: f64,
    /// Mean of the objective over the worlds.
    pub(super) mean: f64,
}

impl Best {
    fn of(tuning: LosTuning, mean: f64) -> Self {
        Self {
            look_ahead_m: tuning.gains.look_ahead,
            along_track_gain_per_s: tuning.gains.along_track_gain,
            integral_gain_mps: tuning.integral_gain,
            mean,
        }
    }

    fn tuning(self, law: LosLaw) -> LosTuning {
        LosTuning {
            law,
            gains: LosGains {
                look_ahead: self.look_ahead_m,
                along_track_gain: self.along_track_gain_per_s,
            },
            integral_gain: self.integral_gain_mps,
        }
    }
}

impl Gains {
    /// What the run of `controller` for the objective of that number is flown at; none where an earlier one has the same gains, and
    /// stands for both.
    pub(super) fn flight(&self, campaign: &Campaign, controller: usize, objective: usize) -> Option<Flight> {
        let contender = &campaign.controllers[controller];
        let Pilot::Law(law) = contender.pilot else {
            return Some(Flight::default());
        };
        let tuned = self.0.iter().find(|tuned| tuned.controller == contender.name)?;
        let gains = |k: usize| tuned.best.get(k).map(|best| best.tuning(law));
        let tuning = gains(objective)?;
        if (0..objective).any(|earlier| gains(earlier) == Some(tuning)) {
            return None;
        }
        let shared = campaign
            .objectives()
            .iter()
            .enumerate()
            .filter(|(k, _)| gains(*k) == Some(tuning));
        let names: Vec<&str> = shared.map(|(_, objective)| objective.name()).collect();
        Some(Flight {
            tuning: Some(tuning),
            objectives: names.join(" "),
        })
    }
}

/// Controllers of an arena whose gains are to be found.
pub(super) fn tuned_in(campaign: &Campaign, arena: usize) -> Vec<usize> {
    let all = campaign.arenas[arena].controllers.iter().copied();
    all.filter(|&controller| matches!(campaign.controllers[controller].pilot, Pilot::Law(_)))
        .collect()
}

/// The best gains of one law in one arena: of equals the first of the grid. A point of the grid at which a mission fails is none.
pub(super) fn tune(
    campaign: &Campaign,
    arena: usize,
    controller: usize,
    go_on: GoOn<'_>,
) -> Result<Tuned, Stopped> {
    let contender = &campaign.controllers[controller];
    let Pilot::Law(law) = contender.pilot else {
        unreachable!("only laws are tuned");
    };
    let mut best: Vec<Best> = vec![];
    for tuning in grid(law) {
        let beaten: Vec<f64> = best.iter().map(|best| best.mean).collect();
        let Some(means) = means(campaign, (arena, controller), tuning, &beaten, go_on)? else {
            continue;
        };
        if best.is_empty() {
            best.extend(means.iter().map(|mean| Best::of(tuning, *mean)));
        }
        for (best, mean) in best.iter_mut().zip(means) {
            if mean < best.mean {
                *best = Best::of(tuning, mean);
            }
        }
    }
    Ok(Tuned {
        controller: contender.name.clone(),
        best,
    })
}

/// Means of the objectives at `tuning`; none where a mission failed, or where all are certain to be above those that are to be `beaten`:
/// what is left of the missions is not flown then. All objectives only grow during a mission.
fn means(
    campaign: &Campaign,
    (arena, controller): (usize, usize),
    tuning: LosTuning,
    beaten: &[f64],
    go_on: GoOn<'_>,
) -> Result<Option<Vec<f64>>, Stopped> {
    let contender = &campaign.controllers[controller];
    let objectives = campaign.objectives();
    let worlds: Vec<World> = campaign.tuning_worlds(arena).collect();
    #[expect(clippy::cast_precision_loss, reason = "a million at most")]
    let n_worlds = worlds.len() as f64;
    let mut sums = vec![0.0; objectives.len()];
    for world in worlds {
        let mut so_far = SoFar::default();
        let mut stopped = false;
        let flown = fly_while(campaign, world, contender, Some(tuning), &mut |mission| {
            so_far.look(mission);
            let above = |k: usize| {
                let least = so_far.least(objectives[k], mission.n_rows());
                beaten[k] < (sums[k] + SURE * least) / n_worlds
            };
            stopped = go_on().is_break();
            !stopped && (beaten.is_empty() || !(0..objectives.len()).all(above))
        });
        if stopped {
            return Err(Stopped);
        }
        let flown = flown.ok().flatten();
        let Some(score) = flown.and_then(|flown| Score::of(&flown.record)) else {
            return Ok(None);
        };
        for (sum, objective) in sums.iter_mut().zip(objectives) {
            *sum += objective.of(&score);
        }
    }
    Ok(Some(sums.into_iter().map(|sum| sum / n_worlds).collect()))
}

/// Rounding in a sum of thousands of seconds is far below what this leaves.
const SURE: f64 = 1.0 - 1e-9;

/// What a mission under way comes to at least.
#[derive(Clone, Copy, Debug, Default)]
struct SoFar {
    /// Sum of the squared distances to the goal, m².
    squares: f64,
    /// Propulsion energy, J.
    energy: f64,
    /// Heading travel, rad.
    heading_travel: f64,
}

impl SoFar {
    /// To be called once a second.
    fn look(&mut self, mission: &Mission) {
        let last = mission.record().rows.last();
        if let Some(craft) = last.and_then(|row| row.surface_craft.as_ref()) {
            self.squares += craft.distance().powi(2);
            self.energy = craft.energy;
            self.heading_travel = craft.heading_travel;
        }
    }

    fn least(&self, objective: Objective, n_rows: u32) -> f64 {
        match objective {
            Objective::RmsM => (self.squares / f64::from(n_rows)).sqrt(),
            Objective::EnergyJ => self.energy,
            Objective::HeadingTravelRad => self.heading_travel,
        }
    }
}
