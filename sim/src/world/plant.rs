//! Physical limits of a hull under any guidance: speed and acceleration through the water.
//!
//! Both come from the three-degree-of-freedom model of [`crate::world::hull`] with every force and
//! moment at its largest and in the worst direction, so they bound every motion of the model:
//!
//! ```text
//! m_u u̇ = F + c_v v r − D_u(u), m_v v̇ = −c_u u r − D_v(v), m_r ṙ = M + (c_u − c_v) u v − D_r(r)
//! ```
//! **Speed.** With α = c_u m_u / (c_v m_v) the yaw rate drops out of W = α u² + v²:
//!
//! ```text
//! ½ dW/dt = α u (F − D_u(u)) / m_u − v D_v(v) / m_v
//! ```
//! W can rise only where the first term is larger, so W stays below W_max, the largest W where both
//! are equal with F at its largest: 0 ≤ u ≤ U with D_u(U) = F_max, v ≥ 0. The speed is at most
//! √(W_max max(1, 1/α)): for a hull with enough sway drag U itself, thrust in balance with drag.
//!
//! **Acceleration**, in a frame that does not turn, ahead and to starboard:
//!
//! ```text
//! u̇ − r v = F / m_u + (c_v / m_u − 1) v r − D_u(u) / m_u
//! v̇ + r u =           (1 − c_u / m_v) u r − D_v(v) / m_v
//! ```
//! term by term at |u| ≤ √(W_max/α), at |v| ≤ √W_max or, if less, the D_v(v) = c_u·|u r| of the
//! largest turn, and at D_r(r) = M_max + |c_u − c_v| |u v| with |u v| ≤ W_max / (2 √α).
//!
//! A craft that starts within these bounds stays within them; a current moves it and adds nothing.

use crate::world::hull::{Drag, SurfaceHull};

/// Factor on both limits: integration steps and the grid of the search for W_max err by less.
const MARGIN: f64 = 1.01;

/// Points of the search for W_max.
const GRID: u32 = 1000;

/// Halvings of an interval with a root: the resolution of a double.
const BISECTIONS: u32 = 64;

/// Physical limits of a craft.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plant {
    /// Top speed through the water, m/s.
    pub speed_max: f64,
    /// Largest acceleration through the water, in any direction, m/s².
    pub acceleration_max: f64,
}

impl Plant {
    /// The limits of `hull` with sound thrusters in calm water; every drag grows without limit.
    pub fn of(hull: &SurfaceHull) -> Self {
        let (m_u, m_v) = (hull.mass_surge, hull.mass_sway);
        let (c_u, c_v) = (hull.coriolis.surge, hull.coriolis.sway);
        let thrusters = &hull.thrusters;
        let surge_force_max = 2.0 * thrusters.ahead_max.max(thrusters.astern_max);
        let yaw_moment_max = thrusters.arm * (thrusters.ahead_max + thrusters.astern_max);
        let alpha = c_u * m_u / (c_v * m_v);
        let w_max = weighted_speed_squared_max(hull, surge_force_max, alpha);
        let (u_max, largest_product) = ((w_max / alpha).sqrt(), 0.5 * w_max / alpha.sqrt());
        let r_max = speed_against(&hull.drag_yaw, yaw_moment_max + (c_u - c_v).abs() * largest_product);
        let v_max = speed_against(&hull.drag_sway, c_u * u_max * r_max).min(w_max.sqrt());
        let ahead = surge_force_max + hull.drag_surge.resistance(u_max);
        let ahead = (ahead + (c_v - m_u).abs() * v_max * r_max) / m_u;
        let starboard = ((m_v - c_u).abs() * u_max * r_max + hull.drag_sway.resistance(v_max)) / m_v;
        Self {
            speed_max: MARGIN * u_max.max(w_max.sqrt()),
            acceleration_max: MARGIN * ahead.hypot(starboard),
        }
    }
}

/// `W_max`: the largest α u² + v² over the surge speeds that full thrust can still raise, with v
/// where sway drag takes the power that thrust gives.
fn weighted_speed_squared_max(hull: &SurfaceHull, force: f64, alpha: f64) -> f64 {
    let top = speed_against(&hull.drag_surge, force);
    let weighted = |i: u32| {
        let u = top * f64::from(i) / f64::from(GRID);
        let gain = alpha * u * (force - hull.drag_surge.resistance(u)) / hull.mass_surge;
        let lost = |v: f64| v * hull.drag_sway.resistance(v) / hull.mass_sway;
        let v = root(|v| lost(v) - gain);
        alpha * u * u + v * v
    };
    (0..=GRID).map(weighted).fold(0.0, f64::max)
}

/// Speed, m/s or rad/s, at which `drag` takes up `load`, N or N m.
fn speed_against(drag: &Drag, load: f64) -> f64 {
    root(|speed| drag.resistance(speed) - load)
}

/// The root of a rising function, from above; the search begins at 0.
fn root(rising: impl Fn(f64) -> f64) -> f64 {
    let (mut below, mut above) = (0.0, 1.0);
    // A drag that grows without limit takes up any load long before the numbers end.
    while rising(above) < 0.0 && above < f64::MAX.sqrt() {
        above *= 2.0;
    }
    for _ in 0..BISECTIONS {
        let middle = 0.5 * (below + above);
        if rising(middle) < 0.0 {
            below = middle;
        } else {
            above = middle;
        }
    }
    above
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector2;
    use planner::angle::ned_from_body;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::*;
    use crate::world::hull::{CoriolisMasses, Thrusters};

    const MEDUSA: SurfaceHull = SurfaceHull::MEDUSA;

    /// A hull that sways easily and turns hard, so that more than the balance ahead matters.
    const SLIPPERY: SurfaceHull = SurfaceHull {
        drag_sway: Drag { linear: 5.0, quadratic: 8.0 },
        thrusters: Thrusters { arm: 40.0 / 72.0, ..MEDUSA.thrusters },
        ..MEDUSA
    };

    /// A hull whose water is not carried along in a turn.
    const DRY: SurfaceHull = SurfaceHull { coriolis: CoriolisMasses { surge: 30.0, sway: 30.0 }, ..MEDUSA };

    fn derivative(hull: &SurfaceHull, [u, v, r]: [f64; 3], force: f64, moment: f64) -> [f64; 3] {
        let (c_u, c_v) = (hull.coriolis.surge, hull.coriolis.sway);
        [
            (force + c_v * v * r - hull.drag_surge.resistance(u)) / hull.mass_surge,
            (-c_u * u * r - hull.drag_sway.resistance(v)) / hull.mass_sway,
            (moment + (c_u - c_v) * u * v - hull.drag_yaw.resistance(r)) / hull.inertia_yaw,
        ]
    }

    /// Largest speed and acceleration over random full-force manoeuvres from rest.
    fn driven(hull: &SurfaceHull, seed: u64) -> (f64, f64) {
        const STEP: f64 = 0.002;
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let (mut state, mut psi, mut most) = ([0.0; 3], 0.0, (0.0_f64, 0.0_f64));
        let mut velocity = Vector2::zeros();
        let thrust = 2.0 * hull.thrusters.ahead_max;
        for _ in 0..200 {
            let hold = rng.random_range(0.2..20.0_f64);
            let [force, moment] = [thrust, thrust * hull.thrusters.arm].map(|most| {
                let is_ahead = rng.random_range(0.0..1.0) < 0.5;
                if is_ahead { most } else { -most }
            });
            let mut time = 0.0;
            while time < hold {
                let slope = derivative(hull, state, force, moment);
                state = std::array::from_fn(|i| state[i] + STEP * slope[i]);
                psi += STEP * state[2];
                // The acceleration in a frame that does not turn, without the formula for it.
                let now = ned_from_body(psi) * Vector2::new(state[0], state[1]);
                most = (most.0.max(now.norm()), most.1.max((now - velocity).norm() / STEP));
                velocity = now;
                time += STEP;
            }
        }
        most
    }

    #[test]
    fn thrust_and_drag_balance_at_the_top_speed_of_a_hull_that_hardly_sways() {
        let plant = Plant::of(&MEDUSA);
        let balance = (72.0_f64 / 27.5).sqrt();
        assert!((plant.speed_max / MARGIN - balance).abs() < 1e-3, "{plant:?}");
    }

    #[test]
    fn no_manoeuvre_at_full_force_breaks_the_bounds() {
        for hull in [MEDUSA, SLIPPERY, DRY] {
            let plant = Plant::of(&hull);
            for seed in 0..4 {
                let (speed, acceleration) = driven(&hull, seed);
                assert!(speed < plant.speed_max, "{speed} against {plant:?}");
                assert!(acceleration < plant.acceleration_max, "{acceleration}, {plant:?}");
            }
        }
    }

    #[test]
    fn full_ahead_then_full_astern_nearly_reaches_the_bounds() {
        let plant = Plant::of(&MEDUSA);
        let surge = |u: f64, force: f64| derivative(&MEDUSA, [u, 0.0, 0.0], force, 0.0)[0];
        let ahead = (0..30_000).fold(0.0, |u, _| u + 0.001 * surge(u, 72.0));
        assert!(0.98 * plant.speed_max < ahead, "{ahead} of {plant:?}");
        // Thrust and drag together; what a turn adds at worst is the rest.
        let braking = -surge(ahead, -72.0);
        assert!(0.7 * plant.acceleration_max < braking, "{braking} of {plant:?}");
    }
}
