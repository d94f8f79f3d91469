//! Tuned numbers of the program; those of visits are in `visit/fleet.rs`.

use std::borrow::Cow;

use crate::craft::model::CraftModel;
use crate::estimate::from_reports::Estimate;
use crate::facts::asc::Limits;
use crate::facts::tuning::Tuning;
use crate::localise::candidates::FixedFigure;
use crate::los::law::LosGains;
use crate::predict::goal::GoalForecast;
use crate::snapshot::build::Snapshot;
use crate::visit::fleet::SchedulingParameters;

/// Standard deviations within which errors of craft and goal are indistinguishable.
const UNCERTAINTY_DEVIATIONS: f64 = 2.5;

/// Least gap between the least and the largest speed, m/s.
const SPEED_GAP: f64 = 0.05;

/// Parameters of the planner: horizon, weights, gains, tolerances.
#[derive(Clone, Debug, PartialEq)]
pub struct Parameters {
    /// Lengths of the horizon's intervals, s, in order.
    pub steps: Vec<f64>,
    /// Weights of the program's cost.
    pub weights: Weights,
    /// Gains of the line-of-sight law: baseline, initial guess and fallback level.
    pub los: LosGains,
    /// Default integral gain σ of integral line of sight, m/s.
    pub integral_gain: f64,
    /// SCP iterations from one guess; each linearises about the previous directions of travel.
    pub scp_iterations: u32,
    /// Largest age of a previous plan that is followed, s.
    pub previous_plan_age_max: f64,
    /// Largest distance of a previous plan from the craft, m: 10 s at full speed on a wrong course.
    pub previous_plan_miss_max: f64,
    /// Oldest report that goals and limits may use, s.
    pub report_age_max: f64,
    /// Least share of the weight of a distance to an uncertain goal; 1 disables the reduction.
    pub uncertain_goal_share: f64,
    /// Back-off of acoustic ranges in standard deviations √(tr P) of an AUV's position: 95 % of a
    /// circular distribution are within 2.45 deviations of one axis.
    pub range_back_off: f64,
    /// Smallest cosine between directions before and after at which the iterations have converged.
    pub converged_cosine: f64,
    /// Largest rate of planned headings and references, rad/s, for craft that could turn faster.
    pub heading_rate_max: f64,
    /// Planned share of the largest turn rate, if this share exceeds `heading_rate_max`.
    pub quick_craft_share: f64,
    /// Planned share of the largest speed reference; only a law that answers exceeds it.
    pub speed_share: f64,
    /// Distance that the program adds to a keep-out, m.
    pub keep_out_margin: f64,
    /// Share of the largest planned speed above which a law that answers is slew-limited.
    pub hard_turn_share: f64,
    /// `true`: the level of least predicted cost answers; `false`: the first, as a comparison.
    pub cost_decides: bool,
    /// Largest residual of an accepted solution, solved or almost solved.
    pub certificate_tolerance: f64,
    /// Duration for which the reference may be used without a newer one, s.
    pub validity: f64,
    /// Parameters of the scheduling of visits.
    pub scheduling: SchedulingParameters,
    /// The only figure that a goal that localises may sail, for comparisons.
    pub figure: Option<FixedFigure>,
}

/// Weights of the cost, each on a squared deviation per second unless stated otherwise.
#[derive(Clone, Debug, PartialEq)]
pub struct Weights {
    /// Distance to the goal, 1/m².
    pub position: f64,
    /// Velocity over ground relative to the goal's, 1/(m/s)²; prevents circling a slow goal.
    pub velocity: f64,
    /// Acceleration, 1/(m/s²)².
    pub acceleration: f64,
    /// Distance to the goal at the end of the horizon, 1/m², not per second.
    pub terminal_position: f64,
    /// Relative velocity at the end of the horizon, 1/(m/s)², not per second.
    pub terminal_velocity: f64,
    /// Propulsion energy, 1/J; 0 removes energy from the program.
    pub energy: f64,
    /// Linear and quadratic price of leaving a named AUV's acoustic range, per m, m² and stage.
    pub range_slack: (f64, f64),
    /// The same for other AUVs: a lower price per metre never breaks a named AUV's range.
    pub other_range_slack: (f64, f64),
    /// Price of leaving the area.
    pub area_slack: (f64, f64),
    /// Price of entering a keep-out disc.
    pub keep_out_slack: (f64, f64),
    /// Linear and quadratic price of breaking a soft row of motion, per stage. The linear one
    /// exceeds the bid of a detour around a surfacing AUV, see `docs/rationale.md#prices`.
    pub slack: (f64, f64),
}

impl Parameters {
    /// These with the members that `tuning` sets.
    #[must_use]
    pub fn tuned(&self, tuning: &Tuning) -> Self {
        let weights = &self.weights;
        let or = |given: Option<f64>, usual: f64| given.unwrap_or(usual);
        Self {
            steps: tuning.steps_s.clone().unwrap_or_else(|| self.steps.clone()),
            scp_iterations: tuning.scp_iterations.unwrap_or(self.scp_iterations),
            weights: Weights {
                position: or(tuning.position_weight_per_m2, weights.position),
                velocity: or(tuning.velocity_weight_per_m2ps2, weights.velocity),
                acceleration: or(tuning.acceleration_weight_per_m2ps4, weights.acceleration),
                terminal_position: or(tuning.terminal_position_weight_per_m2, weights.terminal_position),
                terminal_velocity: or(tuning.terminal_velocity_weight_per_m2ps2, weights.terminal_velocity),
                energy: or(tuning.energy_weight_per_j, weights.energy),
                ..weights.clone()
            },
            ..self.clone()
        }
    }

    /// These with the tuning of `snapshot`.
    pub fn of(&self, snapshot: &Snapshot) -> Cow<'_, Self> {
        match &snapshot.tuning {
            Some(tuning) => Cow::Owned(self.tuned(tuning)),
            None => Cow::Borrowed(self),
        }
    }

    /// Times of the horizon's stages, s, from 0.
    pub(crate) fn times(&self) -> Vec<f64> {
        let later = self.steps.iter().scan(0.0, |time, step| {
            *time += step;
            Some(*time)
        });
        std::iter::once(0.0).chain(later).collect()
    }

    /// `craft` as it is planned: with slightly reduced limits.
    pub fn planned(&self, craft: &CraftModel) -> CraftModel {
        let limits = &craft.limits;
        CraftModel {
            limits: Limits {
                // Keeps the least gap that a request may have.
                speed_max: (self.speed_share * limits.speed_max)
                    .max(limits.speed_max.min(limits.speed_min + SPEED_GAP)),
                turn_rate_max: limits
                    .turn_rate_max
                    .min(self.heading_rate_max.max(self.quick_craft_share * limits.turn_rate_max)),
                ..*limits
            },
            ..*craft
        }
    }

    /// `true` if the AUV's report is too old for goals and limits.
    pub(crate) fn is_stale(&self, estimate: &Estimate) -> bool {
        estimate.state.age_s > self.report_age_max
    }

    /// The weights for a plan on `snapshot` with `goal`: [`Parameters::weights`], reduced by the
    /// goal's uncertainty, which is that of the least known AUV that the goal follows now (of AUVs
    /// in turn, the present one) at its report: what it did since then no report corrects. Without
    /// a covariance an AUV counts as exactly known.
    pub fn weights_for(&self, snapshot: &Snapshot, goal: &GoalForecast) -> Weights {
        let estimates = goal.needs_now().map(|auv| &snapshot.estimates()[auv]);
        // A figure is to be sailed however uncertain its AUVs are: that is its purpose.
        let estimates = estimates.filter(|_| goal.figure().is_none());
        // A stale AUV has no estimate that could be uncertain.
        let sigma = estimates
            .filter(|estimate| !self.is_stale(estimate))
            .filter_map(|estimate| estimate.state.position_sigma())
            .fold(0.0, f64::max);
        let distance = (goal.at(0.0).position - snapshot.asc.position()).norm();
        self.weights.for_uncertain_goal(distance, sigma, self.uncertain_goal_share)
    }
}

impl Weights {
    /// These weights at `distance`, m, from a goal with the root-mean-square position error
    /// `sigma`, m; at least a share `least` remains.
    ///
    /// ```text
    /// w ← w max(least, e⁴ / (e⁴ + (2.5 σ)⁴))      for both weights of position
    /// ```
    /// An error below the uncertainty is as likely the estimate's as the craft's: chasing it is
    /// longer and no nearer; see `docs/rationale.md#prices`.
    pub(crate) fn for_uncertain_goal(&self, distance: f64, sigma: f64, least: f64) -> Self {
        let (error, sigma) = (distance.powi(4), (UNCERTAINTY_DEVIATIONS * sigma).powi(4));
        let share = if sigma > 0.0 { (error / (error + sigma)).max(least) } else { 1.0 };
        Self {
            position: self.position * share,
            terminal_position: self.terminal_position * share,
            ..self.clone()
        }
    }
}

impl Default for Parameters {
    fn default() -> Self {
        let steps = [[1.0].repeat(6), [2.0].repeat(12), [4.0].repeat(12)].concat();
        Self {
            steps,
            weights: Weights::default(),
            los: LosGains { look_ahead: 10.0, along_track_gain: 0.15 },
            // Damping ½ √(u/σ) of the cross-track error: 1.3 behind an AUV at 0.193 m/s.
            integral_gain: 0.03,
            scp_iterations: 2,
            previous_plan_age_max: 10.0,
            previous_plan_miss_max: 15.0,
            report_age_max: 900.0,
            // The craft then takes 39 s instead of 4 s for a certain goal, √(velocity / position).
            uncertain_goal_share: 0.01,
            range_back_off: 1.73,
            converged_cosine: 0.94,
            // Just under 10°/s, without a jerk; `docs/rationale.md#references`.
            heading_rate_max: 0.17,
            // At 10°/s a quick boat turns wide behind a fast AUV; `docs/rationale.md#references`.
            quick_craft_share: 0.5,
            // Saturated thrusters cannot hold a heading; `docs/rationale.md#references`.
            speed_share: 0.98,
            // The least margin with which the craft never enters; `docs/rationale.md#prices`.
            keep_out_margin: 0.5,
            hard_turn_share: 0.5,
            cost_decides: true,
            certificate_tolerance: 1e-4,
            validity: 10.0,
            scheduling: SchedulingParameters::default(),
            figure: None,
        }
    }
}

impl Default for Weights {
    fn default() -> Self {
        Self {
            position: 1.0,
            velocity: 15.0,
            acceleration: 100.0,
            terminal_position: 10.0,
            terminal_velocity: 150.0,
            energy: 0.0,
            range_slack: (1.0e4, 1.0e2),
            other_range_slack: (5.0e3, 0.0),
            area_slack: (3.0e4, 1.0e2),
            keep_out_slack: (1.0e5, 1.0e2),
            slack: (1.0e5, 1.0e3),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Least remaining share of a weight.
    const LEAST: f64 = 0.01;

    #[test]
    fn a_known_goal_keeps_its_whole_weight() {
        let weights = Weights::default();
        for distance in [0.0, 1e-3, 1e6] {
            assert_eq!(weights.for_uncertain_goal(distance, 0.0, LEAST), weights);
        }
    }

    #[test]
    fn an_error_weighs_less_when_nearer_or_more_uncertain() {
        let weights = Weights::default();
        let share =
            |distance, sigma| weights.for_uncertain_goal(distance, sigma, LEAST).position / weights.position;
        // At so many deviations the causes are equally likely.
        assert!((share(UNCERTAINTY_DEVIATIONS, 1.0) - 0.5).abs() < 1e-12);
        let distances = [0.0, 0.5, 1.0, 2.0, 5.0, 50.0];
        assert!(distances.is_sorted_by(|a, b| share(*a, 1.0) <= share(*b, 1.0)));
        assert!(distances.is_sorted_by(|a, b| share(3.0, *a) >= share(3.0, *b)));
        // Far away the error is not the goal's: 1 − (2.5/50)⁴.
        assert!(share(50.0, 1.0) > 0.999);
        for (distance, sigma) in [(0.0, 1e6), (1e6, 1e6), (1e6, 1e-6)] {
            assert!((LEAST..=1.0).contains(&share(distance, sigma)));
        }
    }

    #[test]
    fn position_uncertainty_keeps_the_weights_of_velocity_acceleration_and_limits() {
        let (weights, uncertain) =
            (Weights::default(), Weights::default().for_uncertain_goal(1.0, 1.0, LEAST));
        let restored =
            Weights { position: weights.position, terminal_position: weights.terminal_position, ..uncertain };
        assert_eq!(restored, weights);
    }
}
