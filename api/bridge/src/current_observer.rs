//! The current, seen from a craft that measures velocity over ground and heading and has no speed log.
//!
//! ```text
//! n(ψ)ᵀ v_g = n(ψ)ᵀ c + v        n: to starboard;  v: sway, noise
//! ċ = w
//! ```
//! A craft that holds its speed over ground shows nothing of the current along its bow. Across it, what it drifts is the current,
//! but for the sway of turns; on headings that differ, both components of the current appear. A Kalman filter on two states, which
//! forgets within a tide.

use std::f64::consts::FRAC_PI_2;

use geodesy::direction;
use nalgebra::{Matrix2, Vector2};

/// Standard deviation of what is not known of the current at the start, along either axis, m/s.
const CURRENT_SIGMA: f64 = 0.3;
/// Change of the current, m/s per root second: 0.1 m/s in ten minutes.
const CHANGE: f64 = 0.1 / 24.5;
/// Standard deviation of the drift across a steady craft that is not the current: waves, wind, the heading's error, m/s.
const DRIFT_SIGMA: f64 = 0.1;
/// The same for each rad/s of its yaw rate, m/rad: what a craft slides outwards in a turn.
const DRIFT_PER_YAW_RATE: f64 = 1.0;
/// Successive measurements share their error: waves last so long, s.
const CORRELATION_S: f64 = 2.0;
/// A gap in the measurements is taken for no longer than this, s.
const GAP_MAX_S: f64 = 60.0;

/// What is known of the current so far.
#[derive(Clone, Debug)]
pub struct CurrentObserver {
    current: Vector2<f64>,
    covariance: Matrix2<f64>,
    updated_s: Option<f64>,
}

impl Default for CurrentObserver {
    fn default() -> Self {
        Self {
            current: Vector2::zeros(),
            covariance: Matrix2::identity() * CURRENT_SIGMA.powi(2),
            updated_s: None,
        }
    }
}

impl CurrentObserver {
    /// The current (north, east), m/s.
    #[must_use]
    pub fn current(&self) -> Vector2<f64> {
        self.current
    }

    /// Velocity through the water (ahead, to starboard), m/s, of a craft at `heading`, rad, with the velocity `over_ground` (north, east), m/s.
    #[must_use]
    pub fn through_water(&self, heading: f64, over_ground: &Vector2<f64>) -> Vector2<f64> {
        let through = over_ground - self.current;
        Vector2::new(
            direction(heading).dot(&through),
            direction(heading + FRAC_PI_2).dot(&through),
        )
    }

    /// Takes a measurement at `t_s`, s: the velocity `over_ground` (north, east), m/s, at `heading`, rad, while turning at `yaw_rate`, rad/s.
    pub fn update(&mut self, t_s: f64, heading: f64, yaw_rate: f64, over_ground: &Vector2<f64>) {
        let gap = self.updated_s.map_or(CORRELATION_S, |before| t_s - before);
        // A clock that was set back, or the same moment again.
        if gap <= 0.0 {
            self.updated_s = Some(t_s);
            return;
        }
        self.updated_s = Some(t_s);
        self.covariance += Matrix2::identity() * (CHANGE.powi(2) * gap.min(GAP_MAX_S));
        let across = direction(heading + FRAC_PI_2);
        let share = (CORRELATION_S / gap).max(1.0);
        let noise = (DRIFT_SIGMA.powi(2) + (DRIFT_PER_YAW_RATE * yaw_rate).powi(2)) * share;
        let projected = self.covariance * across;
        let gain = projected / (across.dot(&projected) + noise);
        self.current += gain * (across.dot(over_ground) - across.dot(&self.current));
        self.covariance -= gain * projected.transpose();
        // Rounding leaves it not quite symmetric.
        self.covariance = (self.covariance + self.covariance.transpose()) * 0.5;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Ten measurements a second of a craft that goes 1 m/s over ground along its bow and drifts across it with the current.
    fn sail(
        observer: &mut CurrentObserver,
        start_s: f64,
        seconds: u32,
        heading: f64,
        current: &Vector2<f64>,
    ) {
        for tenth in 0..seconds * 10 {
            let across = direction(heading + FRAC_PI_2);
            let over_ground = direction(heading) + across * across.dot(current);
            observer.update(start_s + 0.1 * f64::from(tenth), heading, 0.0, &over_ground);
        }
    }

    #[test]
    fn two_headings_show_both_components_of_the_current() {
        let current = Vector2::new(-0.1, 0.3);
        let mut observer = CurrentObserver::default();
        sail(&mut observer, 0.0, 60, 0.0, &current);
        assert!((observer.current().y - 0.3).abs() < 0.01, "{observer:?}");
        assert!(observer.current().x.abs() < 1e-9, "nothing shows it yet");
        sail(&mut observer, 60.0, 60, 1.5, &current);
        assert!((observer.current() - current).norm() < 0.03, "{observer:?}");
    }

    #[test]
    fn in_still_water_the_velocity_through_it_is_that_over_ground() {
        let observer = CurrentObserver::default();
        let through = observer.through_water(FRAC_PI_2, &Vector2::new(0.2, 1.0));
        assert!((through - Vector2::new(1.0, -0.2)).norm() < 1e-12);
    }

    #[test]
    fn a_clock_set_back_and_years_of_silence_leave_numbers() {
        let mut observer = CurrentObserver::default();
        for t_s in [1e9, 0.0, 0.0, 1e12, 1e12 + 0.1] {
            observer.update(t_s, 1.0, 0.5, &Vector2::new(1.0, 2.0));
            assert!(observer.current().iter().all(|part| part.is_finite()));
        }
    }
}
