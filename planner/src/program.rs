//! The second-order cone program of one pass: what is promised, and where each number stands.
//!
//! Standard form, the one Clarabel solves:
//!
//! ```text
//! minimise ½ xᵀ P x + qᵀ x   subject to   A x + s = b,  s ∈ K
//! ```
//! Variables, stage by stage k = 1 … N over intervals Δt_0 … Δt_{N−1}: deviation from the goal
//! d_k = p_k − r_k, velocity through the water v_k, and three slacks. The acceleration of an interval,
//! a_k = (v_{k+1} − v_k) / Δt_k, is eliminated. The frame is the craft's own: origin and axes (ahead,
//! starboard) are those of its position and heading now, so that a plan cannot depend on where
//! north is. Positions are counted in units of [`LENGTH_UNIT`], slacks in
//! units of [`SLACK_UNIT`].

use nalgebra::Vector2;

use crate::{
    policy::Weights,
    snapshot::Limits,
    sparse::{Sparse, Triplet},
};

mod layout;

pub use layout::Layout;
use layout::N_SLACKS;
pub(crate) use layout::Slack;

/// Unit of length inside the program, m: errors of a few metres and speeds of a few tenths of a m/s
/// become numbers of the same size.
pub const LENGTH_UNIT: f64 = 10.0;

/// Unit of a slack inside the program, m/s or m/s²: with the price of a slack at 10⁵, measured 26 to 35
/// iterations in two passes over six scenes near and far, 40 to 49 where slacks count in units of 1.
pub const SLACK_UNIT: f64 = 0.01;

/// Half-angle of the trust cone around the direction of travel, as a tangent: 60°.
///
/// Beyond it the forward half-plane and the turn-rate row describe another manoeuvre.
const TRUST_CONE_TANGENT: f64 = 1.732_050_807_568_877_2;

/// A block of consecutive rows and the cone that their slacks s lie in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cone {
    /// s = 0.
    Zero(usize),
    /// s ≥ 0.
    Nonnegative(usize),
    /// s₀ ≥ ‖(s₁, s₂, …)‖.
    SecondOrder(usize),
}

/// The facts of one pass, in the craft's frame.
#[derive(Clone, Debug)]
pub struct Pass<'a> {
    /// Lengths of the intervals Δt_0 … Δt_{N−1}, s.
    pub steps: &'a [f64],
    /// Velocity through the water now, v_0, m/s.
    pub velocity: Vector2<f64>,
    /// Current v_c, m/s.
    pub current: Vector2<f64>,
    /// Goal positions r_0 … r_N, m.
    pub goal: &'a [Vector2<f64>],
    /// Velocity through the water that matches the goal's at stages 0 … N, m/s.
    pub goal_velocity: &'a [Vector2<f64>],
    /// Directions of travel c_0 … c_N: unit vectors.
    pub directions: &'a [Vector2<f64>],
    /// What the craft can do.
    pub limits: &'a Limits,
    /// Acceleration that the surge loop gives unasked at the start of each interval, m/s².
    pub surge_bias: &'a [f64],
    /// Weights of the cost.
    pub weights: &'a Weights,
}

/// One program in standard form.
#[derive(Clone, Debug, PartialEq)]
pub struct Program {
    /// Where each number stands.
    pub layout: Layout,
    /// Quadratic cost, upper triangle.
    pub quadratic: Sparse,
    /// Linear cost.
    pub linear: Vec<f64>,
    /// Constraint matrix.
    pub constraints: Sparse,
    /// Right-hand side.
    pub bounds: Vec<f64>,
    /// Cones of the rows, in order.
    pub cones: Vec<Cone>,
    cost_triplets: Vec<Triplet>,
    row_triplets: Vec<Triplet>,
}

impl Program {
    /// States `pass` as a program.
    #[must_use]
    pub fn new(pass: &Pass<'_>) -> Self {
        let layout = Layout {
            n_stages: pass.steps.len(),
        };
        let (n, n_stages) = (layout.n_variables(), layout.n_stages);
        let mut cones = vec![
            Cone::Zero(2 * n_stages),
            Cone::Nonnegative((7 + N_SLACKS) * n_stages),
        ];
        cones.extend((0..n_stages).map(|_| Cone::SecondOrder(3)));
        let mut program = Self {
            layout,
            quadratic: Sparse::default(),
            linear: vec![0.0; n],
            constraints: Sparse::default(),
            bounds: vec![0.0; layout.n_rows()],
            cones,
            cost_triplets: Vec::new(),
            row_triplets: Vec::new(),
        };
        program.write(pass);
        program.quadratic = Sparse::new(n, n, &program.cost_triplets);
        program.constraints = Sparse::new(layout.n_rows(), n, &program.row_triplets);
        program
    }

    /// Rewrites the numbers for another pass of the same shape; allocates nothing.
    pub fn restate(&mut self, pass: &Pass<'_>) {
        self.write(pass);
        self.quadratic.fill(&self.cost_triplets);
        self.constraints.fill(&self.row_triplets);
    }

    fn write(&mut self, pass: &Pass<'_>) {
        debug_assert_eq!(pass.steps.len(), self.layout.n_stages);
        self.cost_triplets.clear();
        self.row_triplets.clear();
        self.linear.fill(0.0);
        self.bounds.fill(0.0);
        self.stay_with_the_goal(pass);
        self.spare_the_thrusters(pass);
        self.price_the_slacks(pass);
        self.move_as_the_velocity_says(pass);
        self.accelerate_as_the_surge_loop_can(pass);
        self.keep_moving_ahead(pass);
        self.turn_no_faster_than_the_craft_can(pass);
        self.stay_near_the_direction_of_travel(pass);
        self.never_outrun_the_craft(pass);
    }

    fn stages(&self) -> std::ops::RangeInclusive<usize> {
        1..=self.layout.n_stages
    }

    /// Σ w_k ‖d_k‖² + Σ w_k ‖v_k − v_goal,k‖², trapezoidal in time, with a terminal weight.
    fn stay_with_the_goal(&mut self, pass: &Pass<'_>) {
        let scale = cost_scale(pass);
        for k in self.stages() {
            let last = k == self.layout.n_stages;
            let duration = 0.5 * (pass.steps[k - 1] + if last { 0.0 } else { pass.steps[k] });
            let (mut position, mut velocity) =
                (pass.weights.position * duration, pass.weights.velocity * duration);
            if last {
                position += pass.weights.terminal_position;
                velocity += pass.weights.terminal_velocity;
            }
            for axis in 0..2 {
                let (d, v) = (self.layout.deviation(k) + axis, self.layout.velocity(k) + axis);
                self.cost_triplets
                    .push((d, d, 2.0 * scale * position * LENGTH_UNIT * LENGTH_UNIT));
                self.cost_triplets.push((v, v, 2.0 * scale * velocity));
                self.linear[v] -= 2.0 * scale * velocity * pass.goal_velocity[k][axis];
            }
        }
    }

    /// Σ Δt_k w_a ‖a_k‖² + w_j Σ ‖a_k − a_{k−1}‖².
    fn spare_the_thrusters(&mut self, pass: &Pass<'_>) {
        let scale = cost_scale(pass);
        for k in 0..self.layout.n_stages {
            let dt = pass.steps[k];
            // a_k = (v_{k+1} − v_k) / Δt_k
            self.add_square(
                pass,
                scale * pass.weights.acceleration * dt,
                &[(k + 1, 1.0 / dt), (k, -1.0 / dt)],
            );
            if k > 0 {
                let before = pass.steps[k - 1];
                let terms = [
                    (k + 1, 1.0 / dt),
                    (k, -1.0 / dt - 1.0 / before),
                    (k - 1, 1.0 / before),
                ];
                self.add_square(pass, scale * pass.weights.acceleration_change, &terms);
            }
        }
    }

    /// Adds weight · ‖Σ coefficient · v_k‖² for (k, coefficient) in decreasing k; v_0 is data.
    fn add_square(&mut self, pass: &Pass<'_>, weight: f64, terms: &[(usize, f64)]) {
        for axis in 0..2 {
            for (i, &(k, c_k)) in terms.iter().enumerate() {
                if k == 0 {
                    continue;
                }
                let column = self.layout.velocity(k) + axis;
                for &(j, c_j) in &terms[i..] {
                    if j == 0 {
                        self.linear[column] += 2.0 * weight * c_k * c_j * pass.velocity[axis];
                    } else {
                        // Decreasing k: (j, k) is in the upper triangle.
                        let row = self.layout.velocity(j) + axis;
                        self.cost_triplets.push((row, column, 2.0 * weight * c_k * c_j));
                    }
                }
            }
        }
    }

    /// ρ₁ ξ + ρ₂ ξ², ξ ≥ 0.
    fn price_the_slacks(&mut self, pass: &Pass<'_>) {
        let (linear, quadratic) = pass.weights.slack;
        for k in self.stages() {
            for slack in [Slack::ForwardSpeed, Slack::TurnRate, Slack::TrustCone] {
                let column = self.layout.slack(k, slack);
                self.linear[column] += linear * SLACK_UNIT;
                self.cost_triplets
                    .push((column, column, 2.0 * quadratic * SLACK_UNIT * SLACK_UNIT));
                self.row_triplets
                    .push((self.layout.slack_sign(k, slack), column, -1.0));
            }
        }
    }

    /// d_k − d_{k−1} − ½ Δt (v_{k−1} + v_k) = Δt v_c − (r_k − r_{k−1}).
    fn move_as_the_velocity_says(&mut self, pass: &Pass<'_>) {
        for k in self.stages() {
            let dt = pass.steps[k - 1];
            let drift = (pass.current * dt - (pass.goal[k] - pass.goal[k - 1])) / LENGTH_UNIT;
            let half = 0.5 * dt / LENGTH_UNIT;
            for axis in 0..2 {
                let row = self.layout.dynamics(k) + axis;
                self.row_triplets
                    .push((row, self.layout.deviation(k) + axis, 1.0));
                self.row_triplets
                    .push((row, self.layout.velocity(k) + axis, -half));
                self.bounds[row] = drift[axis];
                if k > 1 {
                    self.row_triplets
                        .push((row, self.layout.deviation(k - 1) + axis, -1.0));
                    self.row_triplets
                        .push((row, self.layout.velocity(k - 1) + axis, -half));
                } else {
                    // The craft is the origin: d_0 = −r_0.
                    self.bounds[row] += half * pass.velocity[axis] - pass.goal[0][axis] / LENGTH_UNIT;
                }
            }
        }
    }

    /// b − a_dec ≤ c̄ᵀ a ≤ b + a_acc along the mean direction of the interval, b the surge loop's bias.
    /// Hard: as |b| is less than both limits, keeping on is always allowed.
    fn accelerate_as_the_surge_loop_can(&mut self, pass: &Pass<'_>) {
        for k in self.stages() {
            let dt = pass.steps[k - 1];
            let c = mean_direction(pass.directions, k);
            let row = self.layout.acceleration(k);
            for (row, sign, most) in [
                (row, 1.0, pass.limits.acceleration_max),
                (row + 1, -1.0, pass.limits.deceleration_max),
            ] {
                self.add_velocity(row, k, c * (sign / dt));
                self.bounds[row] = most + sign * pass.surge_bias[k - 1];
                if k > 1 {
                    self.add_velocity(row, k - 1, c * (-sign / dt));
                } else {
                    self.bounds[row] += sign * c.dot(&pass.velocity) / dt;
                }
            }
        }
    }

    /// c_kᵀ v_k ≥ u_min − ξ: the inner half-plane, which implies ‖v_k‖ ≥ u_min.
    fn keep_moving_ahead(&mut self, pass: &Pass<'_>) {
        for k in self.stages() {
            let row = self.layout.forward_speed(k);
            self.add_velocity(row, k, -pass.directions[k]);
            self.row_triplets
                .push((row, self.layout.slack(k, Slack::ForwardSpeed), -SLACK_UNIT));
            self.bounds[row] = -pass.limits.speed_min;
        }
    }

    /// |n̄ᵀ a| ≤ r_max c̄ᵀ (v_{k−1} + v_k)/2 + ξ: lateral acceleration is speed times rate.
    ///
    /// The mean speed of the interval, not the one at its start, lets a craft at rest begin to turn.
    fn turn_no_faster_than_the_craft_can(&mut self, pass: &Pass<'_>) {
        for k in self.stages() {
            let dt = pass.steps[k - 1];
            let c = mean_direction(pass.directions, k);
            let n = starboard_of(c);
            let ahead = c * (0.5 * pass.limits.turn_rate_max);
            for (i, sign) in [1.0, -1.0].into_iter().enumerate() {
                let row = self.layout.turn_rate(k) + i;
                self.add_velocity(row, k, n * (sign / dt) - ahead);
                self.row_triplets
                    .push((row, self.layout.slack(k, Slack::TurnRate), -SLACK_UNIT));
                if k > 1 {
                    self.add_velocity(row, k - 1, n * (-sign / dt) - ahead);
                } else {
                    self.bounds[row] = (n * (sign / dt) + ahead).dot(&pass.velocity);
                }
            }
        }
    }

    /// |n_kᵀ v_k| ≤ tan 60° c_kᵀ v_k + ξ.
    fn stay_near_the_direction_of_travel(&mut self, pass: &Pass<'_>) {
        for k in self.stages() {
            let c = pass.directions[k];
            for (i, sign) in [1.0, -1.0].into_iter().enumerate() {
                let row = self.layout.trust_cone(k) + i;
                self.add_velocity(row, k, starboard_of(c) * sign - c * TRUST_CONE_TANGENT);
                self.row_triplets
                    .push((row, self.layout.slack(k, Slack::TrustCone), -SLACK_UNIT));
            }
        }
    }

    /// ‖v_k‖ ≤ max(u_max, ‖v_0‖ − a t_k): a craft that starts too fast slows down as hard as it can.
    ///
    /// The ramp uses the weakest of acceleration and deceleration that a bias leaves, so that shrinking v_0 satisfies the
    /// acceleration rows whatever the directions are: the hard rows always have a common point.
    fn never_outrun_the_craft(&mut self, pass: &Pass<'_>) {
        let bias = pass
            .surge_bias
            .iter()
            .fold(0.0, |most: f64, bias| most.max(bias.abs()));
        let ramp = pass.limits.acceleration_max.min(pass.limits.deceleration_max) - bias;
        let mut time = 0.0;
        for k in self.stages() {
            time += pass.steps[k - 1];
            let row = self.layout.speed_cone(k);
            self.bounds[row] = pass.limits.speed_max.max(pass.velocity.norm() - ramp * time);
            for axis in 0..2 {
                self.row_triplets
                    .push((row + 1 + axis, self.layout.velocity(k) + axis, -1.0));
            }
        }
    }

    fn add_velocity(&mut self, row: usize, k: usize, coefficient: Vector2<f64>) {
        for axis in 0..2 {
            self.row_triplets
                .push((row, self.layout.velocity(k) + axis, coefficient[axis]));
        }
    }
}

/// Factor on all costs but the slacks' price: the further the goal, the smaller, so that no goal is
/// far enough to buy its way through a soft row.
fn cost_scale(pass: &Pass<'_>) -> f64 {
    let farthest = pass.goal.iter().map(Vector2::norm).fold(0.0, f64::max);
    1.0 / (1.0 + farthest / LENGTH_UNIT)
}

/// Unit vector halfway between the directions at both ends of interval k (from stage k − 1 to k).
fn mean_direction(directions: &[Vector2<f64>], k: usize) -> Vector2<f64> {
    let sum = directions[k - 1] + directions[k];
    // Opposite directions have no mean: the later one is where the craft is to go.
    sum.try_normalize(1e-3).unwrap_or(directions[k])
}

/// The unit vector 90° clockwise of `direction`.
pub(crate) fn starboard_of(direction: Vector2<f64>) -> Vector2<f64> {
    Vector2::new(-direction.y, direction.x)
}

#[cfg(test)]
mod tests;
