//! Own sensors of the surface craft: GNSS, compass, speed log, and dead reckoning without GNSS.

use std::array;

use nalgebra::Vector2;
use planner::{
    angle::{Heading, ned_from_body},
    snapshot::Asc,
};
use rand_chacha::ChaCha8Rng;

use super::noise::{disturbed, disturbed_vector, normal_pair};
use crate::world::SurfaceCraft;

/// Time over which dead reckoning averages the current while GNSS works, s. Assumption: far longer
/// than the second between two measurements, whose noise is white; far shorter than a tide's hours.
const CURRENT_MEMORY: f64 = 30.0;

/// Errors of the surface craft's own sensors. Each σ is a standard deviation; 0 means no error.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SensorSetup {
    /// σ of the satellite position along north and along east, m.
    pub position_sigma: f64,
    /// Correlation time τ of the satellite position's error, s: exp(−T/τ) is left after T; 0:
    /// white.
    pub position_correlation_time: f64,
    /// σ of the satellite velocity over ground along north and along east, m/s; white.
    pub velocity_sigma: f64,
    /// σ of the heading, rad; white.
    pub heading_sigma: f64,
    /// Constant error of the compass, rad, positive clockwise: deviation and misalignment.
    pub heading_bias: f64,
    /// σ of the yaw rate, rad/s; white.
    pub yaw_rate_sigma: f64,
    /// σ of surge and of sway through the water in the speed log, m/s; white.
    pub speed_sigma: f64,
}

impl SensorSetup {
    /// Sensors of a small craft: uncorrected GNSS, micro-mechanical compass, log.
    pub const SMALL_CRAFT: Self = Self {
        // Half of all fixes within 2.5 m (data sheet of the u-blox NEO-M8), over √(2 ln 2) = 1.177.
        position_sigma: 2.1,
        // Assumption: ionosphere and orbits change over minutes, reflections faster.
        position_correlation_time: 100.0,
        // The same data sheet.
        velocity_sigma: 0.05,
        // 1° (data sheet of the Xsens MTi-300).
        heading_sigma: 0.0175,
        // Assumption: 1° remains after the compass was swung.
        heading_bias: 0.0175,
        // Assumption: a rate gyroscope behind a filter of a few hertz.
        yaw_rate_sigma: 0.003,
        // Assumption: 1 % of the craft's speed and waves.
        speed_sigma: 0.02,
    };
}

/// The surface craft's sensors with their state.
#[derive(Clone, Debug)]
pub struct SurfaceSensors {
    setup: SensorSetup,
    rng: ChaCha8Rng,
    /// Error of the satellite position (north, east), m.
    position_error: Vector2<f64>,
    /// Result of the last measurement; none before the first.
    track: Option<DeadReckoning>,
}

/// Start of dead reckoning.
#[derive(Clone, Copy, Debug)]
struct DeadReckoning {
    /// Estimated position (north, east), m.
    position: Vector2<f64>,
    /// Current (north, east), m/s, averaged while GNSS works; none before that.
    current: Option<Vector2<f64>>,
}

impl SurfaceSensors {
    /// Sensors before their first measurement, with a stationary satellite error.
    pub fn new(setup: SensorSetup, mut rng: ChaCha8Rng) -> Self {
        let position_error = normal_pair(&mut rng) * setup.position_sigma;
        Self { setup, rng, position_error, track: None }
    }

    /// The state of `craft` as measured in a `current` (north, east), m/s, `period` s after
    /// another.
    ///
    /// Without GNSS there is no ground velocity, and the position is reckoned:
    /// ```text
    /// p̂ ← p̂ + (R(ψ_m) [u_m, v_m] + v̂_c) T     v̂_c: 30 s mean of ground less water velocity
    /// ```
    /// with this measurement. When GNSS returns, its position applies at once. The first
    /// measurement has a satellite position even without GNSS: a craft departs with a fix.
    ///
    /// Every measurement draws as many random numbers: one seed has the same errors in any mission.
    pub fn measure(
        &mut self,
        craft: &SurfaceCraft,
        current: &Vector2<f64>,
        gnss_works: bool,
        period: f64,
    ) -> Asc {
        let setup = self.setup;
        let [_, _, true_heading, surge, sway, yaw_rate, ..]: [f64; 8] = craft.state.into();
        // White errors, in units of their σ.
        let [position, velocity, turning, speed] = array::from_fn(|_| normal_pair(&mut self.rng));
        self.position_error = self.next_position_error(&position, period);
        let heading_error = setup.heading_bias + setup.heading_sigma * turning.x;
        let mut state = Asc {
            sway_mps: disturbed(sway, setup.speed_sigma * speed.y),
            yaw_rate_radps: disturbed(yaw_rate, setup.yaw_rate_sigma * turning.y),
            ..Asc::new(
                disturbed_vector(&craft.position(), &self.position_error),
                Heading::new(disturbed(true_heading, heading_error)),
                disturbed(surge, setup.speed_sigma * speed.x),
            )
            .with_ground_velocity(gnss_works.then(|| {
                let over_ground = craft.water_velocity() + current;
                disturbed_vector(&over_ground, &(velocity * setup.velocity_sigma))
            }))
        };
        self.keep_track(&mut state, period);
        state
    }

    /// A first-order Gauss–Markov process sampled at each measurement, at its stationary variance.
    ///
    /// ```text
    /// e ← φ e + σ √(1 − φ²) w,   φ = exp(−T/τ)
    /// ```
    fn next_position_error(&self, white: &Vector2<f64>, period: f64) -> Vector2<f64> {
        let (sigma, tau) = (self.setup.position_sigma, self.setup.position_correlation_time);
        if tau == 0.0 {
            return white * sigma;
        }
        // expm1: over a period far shorter than τ, 1 − φ² would lose its digits.
        let fresh = (-(-2.0 * period / tau).exp_m1()).sqrt();
        self.position_error * (-period / tau).exp() + white * (sigma * fresh)
    }

    /// Reckons the position in `state` without GNSS, and averages the current with it.
    fn keep_track(&mut self, state: &mut Asc, period: f64) {
        let through_water =
            ned_from_body(state.heading().radians()) * Vector2::new(state.speed_mps, state.sway_mps);
        let mut current = self.track.and_then(|track| track.current);
        match (state.ground_velocity(), self.track) {
            (Some(ground), _) => {
                let seen = ground - through_water;
                let gain = -(-period / CURRENT_MEMORY).exp_m1();
                current = Some(current.map_or(seen, |mean| mean + (seen - mean) * gain));
            }
            (None, Some(track)) => {
                let drift = current.unwrap_or_else(Vector2::zeros);
                [state.north_m, state.east_m] = (track.position + (through_water + drift) * period).into();
            }
            (None, None) => {}
        }
        self.track = Some(DeadReckoning { position: state.position(), current });
    }
}

#[cfg(test)]
mod tests;
