//! Motion of the craft.

use nalgebra::Vector2;

use crate::{
    facts::angle::starboard_of,
    program::{build::Program, layout::Slack, subproblem::Subproblem, units::LENGTH_UNIT},
};

impl Program {
    /// The craft moves as its velocity says: d_k − d_{k−1} − ½ Δt (v_{k−1} + v_k) = Δt v_c − (r_k −
    /// r_{k−1}).
    pub(crate) fn dynamics(&mut self, subproblem: &Subproblem<'_>) {
        for k in self.stages() {
            let dt = subproblem.steps[k - 1];
            let drift =
                (subproblem.current * dt - (subproblem.goal[k] - subproblem.goal[k - 1])) / LENGTH_UNIT;
            let half = 0.5 * dt / LENGTH_UNIT;
            let row = self.layout.dynamics(k);
            self.add_axes(row, self.layout.deviation(k), 1.0);
            self.add_axes(row, self.layout.velocity(k), -half);
            if k > 1 {
                self.add_axes(row, self.layout.deviation(k - 1), -1.0);
                self.add_axes(row, self.layout.velocity(k - 1), -half);
                self.bound(row, drift);
            } else {
                // The craft is the origin: d_0 = −r_0.
                let start = subproblem.velocity * half - subproblem.goal[0] / LENGTH_UNIT;
                self.bound(row, drift + start);
            }
        }
    }

    /// The surge loop can make the acceleration: b − a_dec ≤ c̄ᵀ a ≤ b + a_acc along the interval's
    /// mean direction, with the disturbance b. Hard: [`Self::top_speed`] allows for a larger one.
    pub(crate) fn acceleration_limits(&mut self, subproblem: &Subproblem<'_>) {
        for k in self.stages() {
            let dt = subproblem.steps[k - 1];
            let c = mean_direction(subproblem.directions, k);
            let row = self.layout.acceleration(k);
            for (row, sign, most) in [
                (row, 1.0, subproblem.limits.acceleration_max),
                (row + 1, -1.0, subproblem.limits.deceleration_max),
            ] {
                self.add_velocity(row, k, c * (sign / dt));
                self.bounds[row] = most + sign * subproblem.surge_disturbance[k - 1];
                if k > 1 {
                    self.add_velocity(row, k - 1, c * (-sign / dt));
                } else {
                    self.bounds[row] += sign * c.dot(&subproblem.velocity) / dt;
                }
            }
        }
    }

    /// The craft moves ahead: c_kᵀ v_k ≥ u_min − ξ, which implies ‖v_k‖ ≥ u_min without slack.
    pub(crate) fn forward_speed(&mut self, subproblem: &Subproblem<'_>) {
        for k in self.stages() {
            let row = self.layout.forward_speed(k);
            self.add_velocity(row, k, -subproblem.directions[k]);
            self.soften(row, k, Slack::Motion, 1.0);
            self.bounds[row] = -subproblem.limits.speed_min;
        }
    }

    /// The heading reference turns no faster than the craft can: |n̄ᵀ (a_k + (T/Δ) (a_k −
    /// a_{k−1}))| ≤ r_max c̄ᵀ (v_{k−1} + v_k)/2 + ξ, as lateral acceleration is speed times rate.
    ///
    /// A heading loop of lag T follows T ψ̇ = ψ_ref − ψ, so a plan's reference is ψ_ref = ψ + T ψ̇
    /// with the rate ψ̇ + T ψ̈: the bracket over the speed. The bound r_max also bounds ψ̇ and the
    /// beginning of a turn. Δ is the time between the middles of both intervals.
    ///
    /// The interval's mean speed, not its initial one, lets a craft at rest begin to turn.
    pub(crate) fn turn_rate(&mut self, subproblem: &Subproblem<'_>) {
        for k in self.stages() {
            let dt = subproblem.steps[k - 1];
            let dt_before = if k > 1 { subproblem.steps[k - 2] } else { dt };
            let lead = subproblem.course_lag / (0.5 * (dt + dt_before));
            let c = mean_direction(subproblem.directions, k);
            let n = starboard_of(c);
            let ahead = c * (0.5 * subproblem.limits.turn_rate_max);
            for (i, sign) in [1.0, -1.0].into_iter().enumerate() {
                let row = self.layout.turn_rate(k) + i;
                let now = n * (sign * (1.0 + lead) / dt);
                let before = n * (sign * lead / dt_before);
                self.add_velocity(row, k, now - ahead);
                self.soften(row, k, Slack::Motion, 1.0);
                let last = -now - before - ahead;
                match k {
                    1 => {
                        let ahead_of_start = n * (sign / dt) + ahead;
                        let change = n * (sign * lead / dt);
                        self.bounds[row] = (ahead_of_start + change).dot(&subproblem.velocity)
                            + sign * lead * n.dot(&subproblem.acceleration);
                    }
                    2 => {
                        self.add_velocity(row, k - 1, last);
                        self.bounds[row] = -before.dot(&subproblem.velocity);
                    }
                    _ => {
                        self.add_velocity(row, k - 1, last);
                        self.add_velocity(row, k - 2, before);
                    }
                }
            }
        }
    }

    /// The plan never outruns the craft: ‖v_k‖ ≤ max(u_max, w_k), w_0 = ‖v_0‖, w_k = max(0, w_{k−1}
    /// − (a − |b|) Δt_k): a craft that starts too fast slows down at its limit.
    ///
    /// With the weaker limit a of acceleration and deceleration, v_{k−1} shortened by a Δt_k
    /// satisfies the acceleration rows for any directions; so does v_{k−1} + sgn(b) c̄ (|b| − a)
    /// Δt_k if the disturbance b exceeds the limits. The hard rows always have a common point.
    pub(crate) fn top_speed(&mut self, subproblem: &Subproblem<'_>) {
        let weaker = subproblem.limits.acceleration_max.min(subproblem.limits.deceleration_max);
        let mut slowed = subproblem.velocity.norm();
        for k in self.stages() {
            slowed = (slowed
                - (weaker - subproblem.surge_disturbance[k - 1].abs()) * subproblem.steps[k - 1])
                .max(0.0);
            let row = self.layout.speed_cone(k);
            let most = subproblem.limits.speed_max.max(slowed);
            if self.layout.energy {
                // ‖v_k‖ ≤ σ_k ≤ most
                let (sigma, top) = (self.layout.energy(k), self.layout.top_speed(k));
                self.add(row, sigma, -1.0);
                self.add(top, sigma, 1.0);
                self.bounds[top] = most;
            } else {
                self.bounds[row] = most;
            }
            self.add_axes(row + 1, self.layout.velocity(k), -1.0);
        }
    }
}

/// Unit vector halfway between the directions at both ends of interval k (from stage k − 1 to k).
fn mean_direction(directions: &[Vector2<f64>], k: usize) -> Vector2<f64> {
    let sum = directions[k - 1] + directions[k];
    // Opposite directions have no mean: the later one is the craft's aim.
    sum.try_normalize(1e-3).unwrap_or(directions[k])
}
