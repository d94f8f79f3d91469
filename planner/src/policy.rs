//! Every tuned number of the planner, once.

use crate::los::LosGains;

/// How the planner plans: horizon, weights, gains, tolerances.
#[derive(Clone, Debug, PartialEq)]
pub struct Policy {
    /// Lengths of the horizon's intervals, s, in order.
    pub steps: Vec<f64>,
    /// Weights of the program's cost.
    pub weights: Weights,
    /// Gains of the line-of-sight law: the baseline, the seed of the first pass, and a rung of the ladder.
    pub los: LosGains,
    /// Integral gain σ of integral line of sight, m/s, where nobody tunes it.
    pub integral_gain: f64,
    /// Number of convex programs solved for one plan; each takes its directions of travel from the last.
    pub passes: usize,
    /// Oldest previous plan that is still followed, s.
    pub previous_plan_age_max: f64,
    /// Farthest that a previous plan may lead past the craft and still be its plan, m: what 10 s at full
    /// speed on a wrong course amount to.
    pub previous_plan_miss_max: f64,
    /// Oldest report of an AUV that the goal may rest on, s.
    pub report_age_max: f64,
    /// Standard deviations √(tr P) of an AUV's position by which its acoustic range is taken to be shorter: 95 % of
    /// a circular doubt are within 2.45 deviations of one axis.
    pub range_doubt: f64,
    /// Smallest cosine between what a pass was linearised about and what it answers with which the answer stands,
    /// and no further pass is worth its time.
    pub settled_cosine: f64,
    /// Half-angle of the trust cone around the direction of travel, as a tangent. Beyond it the forward half-plane and
    /// the turn-rate row describe another manoeuvre.
    pub trust_cone_tangent: f64,
    /// Whether the rung with the least merit answers; else the first that holds. Otherwise only to see what that choice
    /// is worth.
    pub merit_decides: bool,
    /// Widest residual with which a solved or almost solved program counts.
    pub certificate_tolerance: f64,
    /// How long the reference may be used when no newer one arrives, s.
    pub validity: f64,
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
    /// Change of acceleration from one interval to the next, 1/(m/s²)², not per second.
    pub acceleration_change: f64,
    /// Distance to the goal at the end of the horizon, 1/m², not per second.
    pub terminal_position: f64,
    /// Relative velocity at the end of the horizon, 1/(m/s)², not per second.
    pub terminal_velocity: f64,
    /// Propulsion energy, 1/J; where it is 0, the program has no energy in it.
    pub energy: f64,
    /// Linear and quadratic price of being where no acoustic range is, per metre, m² and stage.
    pub range_slack: (f64, f64),
    /// Of leaving the area.
    pub area_slack: (f64, f64),
    /// Of entering a keep-out disc.
    pub keep_out_slack: (f64, f64),
    /// Linear and quadratic price of breaking a soft row of motion (m/s or m/s²), per stage. The linear one is above
    /// what a goal abeam at the edge of the reach bids: measured, 3·10⁴ is enough and 10⁴ is not.
    pub slack: (f64, f64),
}

impl Default for Policy {
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
            passes: 2,
            previous_plan_age_max: 10.0,
            previous_plan_miss_max: 15.0,
            report_age_max: 900.0,
            range_doubt: 1.73,
            settled_cosine: 0.94,
            // 60°.
            trust_cone_tangent: 1.732_050_807_568_877_2,
            merit_decides: true,
            certificate_tolerance: 1e-4,
            validity: 10.0,
        }
    }
}

impl Default for Weights {
    fn default() -> Self {
        Self {
            position: 1.0,
            velocity: 10.0,
            acceleration: 100.0,
            acceleration_change: 10.0,
            terminal_position: 10.0,
            terminal_velocity: 100.0,
            energy: 0.0,
            range_slack: (1.0e4, 1.0e2),
            area_slack: (3.0e4, 1.0e2),
            keep_out_slack: (1.0e5, 1.0e2),
            slack: (3.0e4, 1.0e3),
        }
    }
}
