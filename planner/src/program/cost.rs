//! The cost that the program minimises.

use crate::problem::parameters::Weights;
use crate::program::build::Program;
use crate::program::layout::Slack;
use crate::program::subproblem::Subproblem;
use crate::program::units::{LENGTH_UNIT, SLACK_UNIT};

/// Least priced cubic coefficient, W/(m/s)³; without a price e_k has no upper bound.
const CUBIC_MIN: f64 = 1e-3;

impl Program {
    /// The craft stays with the goal: Σ w_k ‖d_k‖², trapezoidal in time, with a terminal weight.
    pub(crate) fn tracking_cost(&mut self, subproblem: &Subproblem<'_>) {
        let scale = cost_scale(subproblem);
        for k in self.stages() {
            let weight = scale * position_weight(subproblem, k) * LENGTH_UNIT * LENGTH_UNIT;
            let d = self.layout.deviation(k);
            self.price(d, weight);
            self.price(d + 1, weight);
        }
    }

    /// The largest range stays small: Σ w_k (ρ_k + τ_k)² minus its constant, with ‖(p_k − p_i,k,
    /// z_i,k)‖ ≤ ρ_k + τ_k for every AUV i. ρ_k is the largest range at the goal, its minimum.
    pub(crate) fn minimax_range_cost(&mut self, subproblem: &Subproblem<'_>) {
        let scale = cost_scale(subproblem);
        for k in self.stages() {
            let weight = scale * position_weight(subproblem, k) * LENGTH_UNIT * LENGTH_UNIT;
            let distance = |member: &super::MinimaxRange| {
                let across = (subproblem.goal[k] - member.positions[k]).norm();
                across.hypot(member.depths[k])
            };
            let least = subproblem.minimax.iter().map(distance).fold(0.0, f64::max) / LENGTH_UNIT;
            let tau = self.layout.minimax(k);
            self.price(tau, weight);
            self.linear[tau] += 2.0 * weight * least;
            for (i, member) in subproblem.minimax.iter().enumerate() {
                let row = self.layout.minimax_cone(k, i);
                self.add(row, tau, -1.0);
                self.bounds[row] = least;
                self.add_axes(row + 1, self.layout.deviation(k), -1.0);
                self.bound(row + 1, (subproblem.goal[k] - member.positions[k]) / LENGTH_UNIT);
                self.bounds[row + 3] = member.depths[k] / LENGTH_UNIT;
            }
        }
    }

    /// The craft moves with the goal: Σ w_k ‖v_k − v_goal,k‖², trapezoidal, with a terminal weight.
    pub(crate) fn velocity_cost(&mut self, subproblem: &Subproblem<'_>) {
        let scale = cost_scale(subproblem);
        for k in self.stages() {
            let last = k == self.layout.n_stages;
            let terminal = if last { subproblem.weights.terminal_velocity } else { 0.0 };
            let weight = scale * (subproblem.weights.velocity * duration(subproblem, k) + terminal);
            for axis in 0..2 {
                let v = self.layout.velocity(k) + axis;
                self.price(v, weight);
                self.linear[v] -= 2.0 * weight * subproblem.goal_velocity[k][axis];
            }
        }
    }

    /// The thrusters are spared: Σ Δt_k w_a ‖a_k‖², a_k = (v_{k+1} − v_k) / Δt_k; v_0 is data.
    pub(crate) fn acceleration_cost(&mut self, subproblem: &Subproblem<'_>) {
        let scale = cost_scale(subproblem);
        for k in 0..self.layout.n_stages {
            let weight = scale * subproblem.weights.acceleration / subproblem.steps[k];
            for axis in 0..2 {
                let end = self.layout.velocity(k + 1) + axis;
                self.price(end, weight);
                if k == 0 {
                    self.linear[end] -= 2.0 * weight * subproblem.velocity[axis];
                } else {
                    let start = self.layout.velocity(k) + axis;
                    self.price(start, weight);
                    self.cost_triplets.push((start, end, -2.0 * weight));
                }
            }
        }
    }

    /// The batteries are spared: Σ w_E Δt (c₁ σ_k + c₃ e_k), with e_k ≥ σ_k³ as two rotated cones:
    ///
    /// ```text
    /// σ² ≤ m       ⇔  ‖(σ, (m − 1)/2)‖ ≤ (m + 1)/2
    /// m² ≤ e σ     ⇔  ‖(m, (e − σ)/2)‖ ≤ (e + σ)/2
    /// ```
    pub(crate) fn energy_cost(&mut self, subproblem: &Subproblem<'_>) {
        let scale = cost_scale(subproblem);
        for k in self.stages() {
            let sigma = self.layout.energy(k);
            let (square, cube) = (sigma + 1, sigma + 2);
            let price = scale * subproblem.weights.energy * duration(subproblem, k);
            self.linear[sigma] += price * subproblem.power.linear_w_per_mps;
            self.linear[cube] += price * subproblem.power.cubic_w_per_mps3.max(CUBIC_MIN);
            let first = self.layout.energy_cones(k);
            self.add(first, square, -0.5);
            self.bounds[first] = 0.5;
            self.add(first + 1, sigma, -1.0);
            self.add(first + 2, square, -0.5);
            self.bounds[first + 2] = -0.5;
            let second = first + 3;
            self.add(second, cube, -0.5);
            self.add(second, sigma, -0.5);
            self.add(second + 1, square, -1.0);
            self.add(second + 2, cube, -0.5);
            self.add(second + 2, sigma, 0.5);
        }
    }

    /// Every slack has a price: ρ₁ ξ + ρ₂ ξ², ξ ≥ 0.
    pub(crate) fn slack_cost(&mut self, subproblem: &Subproblem<'_>) {
        for k in self.stages() {
            for slack in self.layout.slacks() {
                let (linear, quadratic) = price(slack, subproblem.weights);
                let column = self.layout.slack(k, slack);
                self.linear[column] += linear * SLACK_UNIT;
                self.cost_triplets.push((column, column, 2.0 * quadratic * SLACK_UNIT * SLACK_UNIT));
                self.row_triplets.push((self.layout.slack_sign(k, slack), column, -1.0));
            }
        }
    }
}

fn price(slack: Slack, weights: &Weights) -> (f64, f64) {
    match slack {
        Slack::Motion => weights.slack,
        Slack::AcousticRange => weights.range_slack,
        Slack::OtherRange => weights.other_range_slack,
        Slack::Area => weights.area_slack,
        Slack::KeepOut => weights.keep_out_slack,
    }
}

/// Duration of stage k, s: half of the intervals on either side.
fn duration(subproblem: &Subproblem<'_>, k: usize) -> f64 {
    0.5 * (subproblem.steps[k - 1] + subproblem.steps.get(k).copied().unwrap_or(0.0))
}

fn position_weight(subproblem: &Subproblem<'_>, k: usize) -> f64 {
    let last = k == subproblem.steps.len();
    let terminal = if last { subproblem.weights.terminal_position } else { 0.0 };
    subproblem.weights.position * duration(subproblem, k) + terminal
}

/// Factor on all costs but the slacks' price: no distant goal outbids a soft row.
pub(crate) fn cost_scale(subproblem: &Subproblem<'_>) -> f64 {
    let farthest =
        |points: &[nalgebra::Vector2<f64>]| points.iter().map(nalgebra::Vector2::norm).fold(0.0, f64::max);
    let members = subproblem.minimax.iter().map(|member| farthest(&member.positions));
    1.0 / (1.0 + members.fold(farthest(subproblem.goal), f64::max) / LENGTH_UNIT)
}
