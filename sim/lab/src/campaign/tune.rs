//! Tuning: for each case and law the best gains of its grid, under conditions that are not scored.

use serde::{Deserialize, Serialize};
use sim::{mission::Mission, record::Row};

use super::score::Score;
use super::{
    design::{Campaign, Condition, Run},
    file::Objective,
    fly::{RunGains, fly_while},
    grid::Setting,
};

/// The best gains of one law.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Tuned {
    pub(super) controller: String,
    /// The best gains for each objective, in the file's order.
    pub(crate) best: Vec<Best>,
}

/// The best setting for one objective, and its mean.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Best {
    pub(crate) setting: Setting,
    pub(super) mean: f64,
}

/// The gains of `run` of those tuned in its case; `None` if an earlier run has the same gains.
pub(super) fn gains_of(run: Run, campaign: &Campaign, all: &[Tuned]) -> Option<RunGains> {
    let controller = &campaign.controllers[run.controller];
    if !controller.is_tuned() {
        return Some(RunGains { setting: controller.grid()[0], ..RunGains::default() });
    }
    let tuned = all.iter().find(|tuned| tuned.controller == controller.name)?;
    let gains = |k: usize| tuned.best.get(k).map(|best| best.setting);
    let setting = gains(run.objective)?;
    if (0..run.objective).any(|earlier| gains(earlier) == Some(setting)) {
        return None;
    }
    let objectives = campaign.objectives().iter().enumerate();
    let shared = objectives.filter(|(k, _)| gains(*k) == Some(setting));
    let names: Vec<&str> = shared.map(|(_, objective)| objective.name()).collect();
    Some(RunGains { setting, objectives: names.join(" ") })
}

/// Controllers of a case that are tuned.
pub(super) fn tuned_in(campaign: &Campaign, case: usize) -> Vec<usize> {
    let all = campaign.cases[case].controllers.iter().copied();
    all.filter(|&controller| campaign.controllers[controller].is_tuned()).collect()
}

/// The best settings of one controller in one case; the grid's first among equals. Points with a
/// failed mission are left out. `progress` gets the fraction done.
pub(crate) fn tune(campaign: &Campaign, case: usize, number: usize, progress: &mut dyn FnMut(f64)) -> Tuned {
    let controller = &campaign.controllers[number];
    let mut best: Vec<Best> = vec![];
    let grid = controller.grid();
    let share = 1.0 / f64::from(u32::try_from(grid.len()).expect("a grid of dozens"));
    for (setting, done) in grid.into_iter().zip(0_u32..) {
        progress(share * f64::from(done));
        let beaten: Vec<f64> = best.iter().map(|best| best.mean).collect();
        let Some(means) = means(campaign, (case, number), setting, &beaten) else { continue };
        if best.is_empty() {
            best.extend(means.iter().map(|&mean| Best { setting, mean }));
        }
        for (best, mean) in best.iter_mut().zip(means) {
            if mean < best.mean {
                *best = Best { setting, mean };
            }
        }
    }
    Tuned { controller: controller.name.clone(), best }
}

/// Means of the objectives at `setting`; `None` if a mission fails, or once all exceed `beaten`.
fn means(
    campaign: &Campaign,
    (case, controller): (usize, usize),
    setting: Setting,
    beaten: &[f64],
) -> Option<Vec<f64>> {
    let controller = &campaign.controllers[controller];
    let objectives = campaign.objectives();
    let conditions: Vec<Condition> = campaign.tuning_conditions(case).collect();
    let n_conditions = conditions.len() as f64;
    let mut sums = vec![0.0; objectives.len()];
    for condition in conditions {
        let mut partial = PartialScore::default();
        let flown = fly_while(campaign, condition, controller, setting, &mut |mission, _| {
            partial.observe(mission);
            let above = |k: usize| {
                let least = partial.least(objectives[k], mission.n_rows());
                beaten[k] < (sums[k] + SURE * least) / n_conditions
            };
            beaten.is_empty() || !(0..objectives.len()).all(above)
        });
        let score = Score::of(&flown.ok()??.record)?;
        for (sum, objective) in sums.iter_mut().zip(objectives) {
            *sum += objective.of(&score);
        }
    }
    Some(sums.into_iter().map(|sum| sum / n_conditions).collect())
}

/// Margin for rounding in a sum over thousands of seconds.
const SURE: f64 = 1.0 - 1e-9;

/// Lower bounds of the objectives of a mission under way.
#[derive(Clone, Copy, Debug, Default)]
struct PartialScore {
    /// Sum of the squared distances to the goal, m².
    squares: f64,
    /// Propulsion energy, J.
    energy: f64,
    /// Heading travel, rad.
    heading_travel: f64,
    /// Sum of the mean costs of AUVs that are visited, in the unit of the goal's cost.
    costs: f64,
}

impl PartialScore {
    /// Call it once a second.
    fn observe(&mut self, mission: &Mission) {
        let last = mission.record().rows.last();
        if let Some(craft) = last.and_then(|row| row.surface_craft.as_ref()) {
            self.squares += craft.distance().powi(2);
            self.energy = craft.energy;
            self.heading_travel = craft.heading_travel;
        }
        self.costs += last.and_then(Row::mean_cost).unwrap_or(0.0);
    }

    fn least(&self, objective: Objective, n_rows: u32) -> f64 {
        match objective {
            Objective::RmsM => (self.squares / f64::from(n_rows)).sqrt(),
            Objective::EnergyJ => self.energy,
            Objective::HeadingTravelRad => self.heading_travel,
            Objective::VisitMeanCost => self.costs / f64::from(n_rows),
            // Only the settled part counts, at the end.
            Objective::NavigationRmsM => 0.0,
        }
    }
}
