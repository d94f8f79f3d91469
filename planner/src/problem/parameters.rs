//! Tuned numbers of the planner: those of the program here, those of visits in `visit/fleet.rs`.

use std::borrow::Cow;

use crate::{
    craft::model::CraftModel,
    estimate::from_reports::Estimate,
    facts::{asc::Limits, tuning::Tuning},
    los::law::LosGains,
    predict::goal::GoalForecast,
    snapshot::build::Snapshot,
    visit::fleet::SchedulingParameters,
};

/// Standard deviations within which an error of the craft's position cannot be distinguished from one of the goal's.
const UNCERTAINTY_DEVIATIONS: f64 = 2.0;

/// Least gap between the least and the largest speed, m/s.
const SPEED_GAP: f64 = 0.05;

/// How the planner plans: horizon, weights, gains, tolerances.
#[derive(Clone, Debug, PartialEq)]
pub struct Parameters {
    /// Lengths of the horizon's intervals, s, in order.
    pub steps: Vec<f64>,
    /// Weights of the program's cost.
    pub weights: Weights,
    /// Gains of the line-of-sight law: the baseline, an initial guess of the first SCP iteration, and a fallback level.
    pub los: LosGains,
    /// Integral gain σ of integral line of sight, m/s, where it is not tuned.
    pub integral_gain: f64,
    /// SCP iterations from one initial guess; each linearises about the directions of travel of the one before.
    pub scp_iterations: u32,
    /// Oldest previous plan that is still followed, s.
    pub previous_plan_age_max: f64,
    /// Farthest that a previous plan may lead past the craft and still be its plan, m: what 10 s at full
    /// speed on a wrong course amount to.
    pub previous_plan_miss_max: f64,
    /// Oldest report of an AUV that the goal may rest on, and limits about it count, s.
    pub report_age_max: f64,
    /// Least share of its weight that a distance to the goal keeps, however uncertain the goal is; 1 leaves uncertainty without
    /// weight.
    pub uncertain_goal_share: f64,
    /// Standard deviations √(tr P) of an AUV's position by which its acoustic range is taken to be shorter: 95 % of
    /// a circular distribution are within 2.45 deviations of one axis.
    pub range_back_off: f64,
    /// Smallest cosine between the directions that a subproblem was linearised about and those of its solution with which it
    /// has converged, and no further SCP iteration is worth its time.
    pub converged_cosine: f64,
    /// Fastest that a heading reference of the program or the previous plan turns, and a trajectory is planned to, where the craft
    /// could turn faster, rad/s. A law at speed that is preferred to those turns no faster either.
    pub heading_rate_max: f64,
    /// Share of its fastest turn with which a craft is planned that turns so fast that this is more than `heading_rate_max`.
    pub quick_craft_share: f64,
    /// Share of the largest speed reference that is planned with, and asked for by all but a law that answers.
    pub speed_share: f64,
    /// How much farther than asked the program stays from a keep-out, m.
    pub keep_out_margin: f64,
    /// Share of the largest planned speed above which a line-of-sight law that is preferred to a plan is slew-limited
    /// as one.
    pub hard_turn_share: f64,
    /// Whether the fallback level of least predicted cost answers, else the first that is available: only to see what the choice
    /// is worth.
    pub cost_decides: bool,
    /// Widest residual with which a solved or almost solved program counts.
    pub certificate_tolerance: f64,
    /// How long the reference may be used when no newer one arrives, s.
    pub validity: f64,
    /// How visits are scheduled.
    pub scheduling: SchedulingParameters,
}

/// Weights of the cost, each on a squared deviation per second unless said otherwise.
#[derive(Clone, Debug, PartialEq)]
pub struct Weights {
    /// Distance to the goal, 1/m².
    pub position: f64,
    /// Velocity over ground relative to the goal's, 1/(m/s)²: keeps the craft from circling a slow goal.
    pub velocity: f64,
    /// Acceleration, 1/(m/s²)².
    pub acceleration: f64,
    /// Distance to the goal at the end of the horizon, 1/m², not per second.
    pub terminal_position: f64,
    /// Relative velocity at the end of the horizon, 1/(m/s)², not per second.
    pub terminal_velocity: f64,
    /// Propulsion energy, 1/J; where it is 0, the program has no energy in it.
    pub energy: f64,
    /// Linear and quadratic price of being where no acoustic range is to an AUV that the goal names, per metre, m² and
    /// stage.
    pub range_slack: (f64, f64),
    /// The same for the others. A metre towards one is at most a metre away from another, so that no range of these is
    /// kept at the price of the first: whatever they are broken by, a metre costs less here.
    pub other_range_slack: (f64, f64),
    /// Of leaving the area.
    pub area_slack: (f64, f64),
    /// Of entering a keep-out disc.
    pub keep_out_slack: (f64, f64),
    /// Linear and quadratic price of breaking a soft row of motion (m/s or m/s²), per stage. The linear one is above
    /// what a detour around a surfacing AUV bids at the planned rate of turn, see `docs/rationale.md#prices`.
    pub slack: (f64, f64),
}

impl Parameters {
    /// These with the levers that `tuning` sets.
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
                terminal_velocity: or(
                    tuning.terminal_velocity_weight_per_m2ps2,
                    weights.terminal_velocity,
                ),
                energy: or(tuning.energy_weight_per_j, weights.energy),
                ..weights.clone()
            },
            ..self.clone()
        }
    }

    /// These with the levers that `snapshot` sets.
    #[must_use]
    pub fn of(&self, snapshot: &Snapshot) -> Cow<'_, Self> {
        match &snapshot.tuning {
            Some(tuning) => Cow::Owned(self.tuned(tuning)),
            None => Cow::Borrowed(self),
        }
    }

    /// What is asked of `craft`: a little less than it can do.
    #[must_use]
    pub fn planned(&self, craft: &CraftModel) -> CraftModel {
        let limits = &craft.limits;
        CraftModel {
            limits: Limits {
                // The least gap that a request may leave stays.
                speed_max: (self.speed_share * limits.speed_max)
                    .max(limits.speed_max.min(limits.speed_min + SPEED_GAP)),
                turn_rate_max: limits.turn_rate_max.min(
                    self.heading_rate_max
                        .max(self.quick_craft_share * limits.turn_rate_max),
                ),
                ..*limits
            },
            ..*craft
        }
    }

    /// Whether an AUV was last heard of so long ago that no goal may rest on it, and no limit needs to.
    #[must_use]
    pub(crate) fn is_stale(&self, estimate: &Estimate) -> bool {
        estimate.state.age_s > self.report_age_max
    }

    /// The weights for a plan on `snapshot` with `goal`: [`Parameters::weights`], reduced by the uncertainty of the goal.
    ///
    /// The uncertainty is that of the least known of the AUVs that the goal follows now: of AUVs in turn, the present one. An AUV whose
    /// state brings no covariance is taken for known.
    #[must_use]
    pub fn weights_for(&self, snapshot: &Snapshot, goal: &GoalForecast) -> Weights {
        let estimates = goal.needs_now().map(|auv| &snapshot.estimates()[auv]);
        // Of one that is not heard of any more, there is no estimate that could be uncertain.
        let sigma = estimates
            .filter(|estimate| !self.is_stale(estimate))
            .filter_map(Estimate::position_sigma)
            .fold(0.0, f64::max);
        let distance = (goal.at(0.0).position - snapshot.asc.position()).norm();
        self.weights
            .for_uncertain_goal(distance, sigma, self.uncertain_goal_share)
    }
}

impl Weights {
    /// These weights at `distance` from a goal that is known to within `sigma`, the root mean square of how far it may
    /// be from where it is taken to be, both m; they keep `least` of themselves.
    ///
    /// ```text
    /// w ← w max(least, e⁴ / (e⁴ + (2 d)⁴))      for both weights of position
    /// ```
    /// An error that is no larger than the uncertainty is as likely the estimate's as the craft's, and the next report takes
    /// a part of it back: a craft that chases it travels farther, and is no nearer; see `docs/rationale.md#prices`.
    #[must_use]
    pub(crate) fn for_uncertain_goal(&self, distance: f64, sigma: f64, least: f64) -> Self {
        let (error, sigma) = (distance.powi(4), (UNCERTAINTY_DEVIATIONS * sigma).powi(4));
        let share = if sigma > 0.0 {
            (error / (error + sigma)).max(least)
        } else {
            1.0
        };
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
            los: LosGains {
                look_ahead: 10.0,
                along_track_gain: 0.15,
            },
            // Damping ½ √(u/σ) of the cross-track error: 1.3 behind an AUV at 0.193 m/s.
            integral_gain: 0.03,
            scp_iterations: 2,
            previous_plan_age_max: 10.0,
            previous_plan_miss_max: 15.0,
            report_age_max: 900.0,
            // The craft then takes 39 s over what it takes 4 s over when it is sure, √(velocity / position).
            uncertain_goal_share: 0.01,
            range_back_off: 1.73,
            converged_cosine: 0.94,
            // Just under 10°/s: what a small twin-thruster craft follows without a jerk; `docs/rationale.md#references`.
            heading_rate_max: 0.17,
            // A quick boat that goes about at 10°/s is 16 m behind an AUV that sets off the other way; `docs/rationale.md#references`.
            quick_craft_share: 0.2,
            // The surge loop overshoots, and thrusters at their limits cannot hold a heading; `docs/rationale.md#references`.
            speed_share: 0.98,
            // The least with which the craft is never inside; `docs/rationale.md#prices`.
            keep_out_margin: 0.5,
            hard_turn_share: 0.5,
            cost_decides: true,
            certificate_tolerance: 1e-4,
            validity: 10.0,
            scheduling: SchedulingParameters::default(),
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

    /// Share that a weight keeps at least.
    const LEAST: f64 = 0.01;

    #[test]
    fn a_goal_that_is_known_is_worth_its_whole_weight() {
        let weights = Weights::default();
        for distance in [0.0, 1e-3, 1e6] {
            assert_eq!(weights.for_uncertain_goal(distance, 0.0, LEAST), weights);
        }
    }

    #[test]
    fn the_nearer_and_the_more_uncertain_the_less_an_error_weighs() {
        let weights = Weights::default();
        let share =
            |distance, sigma| weights.for_uncertain_goal(distance, sigma, LEAST).position / weights.position;
        // As far as two deviations: as likely the one as the other.
        assert!((share(2.0, 1.0) - 0.5).abs() < 1e-12);
        let distances = [0.0, 0.5, 1.0, 2.0, 5.0, 50.0];
        assert!(distances.is_sorted_by(|a, b| share(*a, 1.0) <= share(*b, 1.0)));
        assert!(distances.is_sorted_by(|a, b| share(3.0, *a) >= share(3.0, *b)));
        // Far from an uncertain goal it is the goal's error no more: 1 − (2/50)⁴.
        assert!(share(50.0, 1.0) > 0.999);
        for (distance, sigma) in [(0.0, 1e6), (1e6, 1e6), (1e6, 1e-6)] {
            assert!((LEAST..=1.0).contains(&share(distance, sigma)));
        }
    }

    #[test]
    fn uncertainty_of_the_place_takes_nothing_from_velocity_acceleration_or_limits() {
        let (weights, uncertain) = (
            Weights::default(),
            Weights::default().for_uncertain_goal(1.0, 1.0, LEAST),
        );
        let restored = Weights {
            position: weights.position,
            terminal_position: weights.terminal_position,
            ..uncertain
        };
        assert_eq!(restored, weights);
    }
}
