//! Estimates the current for a craft without a speed log, from velocity over ground and heading.
//!
//! ```text
//! n(ψ)ᵀ v_g = n(ψ)ᵀ c + v        n: to starboard;  v: sway, noise
//! ċ = w
//! ```
//! A craft that holds its speed over ground shows nothing of the current along the bow. Across it,
//! the drift is the current, except for sway in turns. Different headings show both components. The
//! estimator is a Kalman filter with two states, which forgets within a tide.
//!
//! Innovations are limited to three standard deviations, so wrong velocities have little effect. If
//! they stay limited on one side, the covariance is reset. [`CURRENT_MAX`] bounds the current.

use std::f64::consts::FRAC_PI_2;

use nalgebra::{Matrix2, Vector2};
use planner::angle::direction;

/// Standard deviation of the current at the start, along either axis, m/s.
const CURRENT_SIGMA: f64 = 0.3;
/// Change of the current, m/s per root second: 0.1 m/s in ten minutes.
const CHANGE: f64 = 0.1 / 24.5;
/// Standard deviation of other drift, on a steady heading, m/s: waves, wind, heading error.
const DRIFT_SIGMA: f64 = 0.1;
/// The same for each rad/s of yaw rate, m/rad: sway in turns.
const DRIFT_PER_YAW_RATE: f64 = 1.0;
/// Correlation time of successive measurements, s: waves.
const CORRELATION_S: f64 = 2.0;
/// Largest innovation that counts, in standard deviations.
const INNOVATION_MAX: f64 = 3.0;
/// Time of innovations limited on one side after which the covariance is reset, s.
const CUT_MAX_S: f64 = 5.0;
/// Fastest current, m/s: beyond it are a few tidal races.
const CURRENT_MAX: f64 = 3.0;
/// Longest gap that counts, s.
const GAP_MAX_S: f64 = 60.0;

#[derive(Clone, Debug)]
pub(crate) struct CurrentObserver {
    /// The current (north, east), m/s.
    pub(crate) current: Vector2<f64>,
    covariance: Matrix2<f64>,
    updated_s: Option<f64>,
    /// Side on which innovations are limited, and the beginning of that, s.
    cut: Option<(f64, f64)>,
}

impl Default for CurrentObserver {
    fn default() -> Self {
        Self {
            current: Vector2::zeros(),
            covariance: Matrix2::identity() * CURRENT_SIGMA.powi(2),
            updated_s: None,
            cut: None,
        }
    }
}

impl CurrentObserver {
    /// Standard deviation of the current along its least known axis, m/s.
    pub(crate) fn sigma(&self) -> f64 {
        self.covariance.symmetric_eigenvalues().max().max(0.0).sqrt()
    }

    /// Velocity through the water (ahead, to starboard) from `over_ground` (north, east), m/s.
    pub(crate) fn through_water(&self, heading: f64, over_ground: &Vector2<f64>) -> Vector2<f64> {
        let through = over_ground - self.current;
        Vector2::new(direction(heading).dot(&through), direction(heading + FRAC_PI_2).dot(&through))
    }

    /// Takes the velocity `over_ground` (north, east), m/s, at `t_s`, s, and the yaw rate, rad/s.
    pub(crate) fn update(&mut self, t_s: f64, heading: f64, yaw_rate: f64, over_ground: &Vector2<f64>) {
        let gap = self.updated_s.map_or(CORRELATION_S, |before| t_s - before);
        // The clock was set back, or the moment came twice.
        if gap <= 0.0 {
            self.updated_s = Some(t_s);
            return;
        }
        self.updated_s = Some(t_s);
        self.covariance += Matrix2::identity() * (CHANGE.powi(2) * gap.min(GAP_MAX_S));
        let across = direction(heading + FRAC_PI_2);
        let share = (CORRELATION_S / gap).max(1.0);
        let noise = (DRIFT_SIGMA.powi(2) + (DRIFT_PER_YAW_RATE * yaw_rate).powi(2)) * share;
        let innovation = across.dot(over_ground) - across.dot(&self.current);
        let most = INNOVATION_MAX * (across.dot(&(self.covariance * across)) + noise).sqrt();
        self.cut = (innovation.abs() > most).then(|| {
            let (side, since_s) = self.cut.unwrap_or((innovation.signum(), t_s));
            if side == innovation.signum() { (side, since_s) } else { (-side, t_s) }
        });
        if let Some((_, since_s)) = &mut self.cut
            && t_s - *since_s > CUT_MAX_S
        {
            self.covariance = Matrix2::identity() * CURRENT_SIGMA.powi(2);
            *since_s = t_s;
        }
        let projected = self.covariance * across;
        let gain = projected / (across.dot(&projected) + noise);
        self.current += gain * innovation.clamp(-most, most);
        self.current = self.current.cap_magnitude(CURRENT_MAX);
        self.covariance -= gain * projected.transpose();
        // Removes the asymmetry of rounding.
        self.covariance = (self.covariance + self.covariance.transpose()) * 0.5;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Ten measurements a second: 1 m/s over ground along the bow, and drift with the current.
    fn observe(
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
        observe(&mut observer, 0.0, 60, 0.0, &current);
        assert!((observer.current.y - 0.3).abs() < 0.01, "{observer:?}");
        assert!(observer.current.x.abs() < 1e-9, "nothing shows it yet");
        observe(&mut observer, 60.0, 60, 1.5, &current);
        assert!((observer.current - current).norm() < 0.03, "{observer:?}");
    }

    #[test]
    fn a_river_is_found_within_half_a_minute_and_limited_to_three_metres_per_second() {
        for (flow, found) in [(2.5, 2.5), (4.0, 3.0)] {
            let mut observer = CurrentObserver::default();
            observe(&mut observer, 0.0, 30, 0.0, &Vector2::new(0.0, flow));
            assert!((observer.current.y - found).abs() < 0.15, "{observer:?}");
        }
    }

    #[test]
    fn in_still_water_both_velocities_are_equal() {
        let observer = CurrentObserver::default();
        let through = observer.through_water(FRAC_PI_2, &Vector2::new(0.2, 1.0));
        assert!((through - Vector2::new(1.0, -0.2)).norm() < 1e-12);
    }

    #[test]
    fn estimates_stay_finite_after_a_clock_set_back_and_years_of_silence() {
        let mut observer = CurrentObserver::default();
        for t_s in [1e9, 0.0, 0.0, 1e12, 1e12 + 0.1] {
            observer.update(t_s, 1.0, 0.5, &Vector2::new(1.0, 2.0));
            assert!(observer.current.iter().all(|part| part.is_finite()));
        }
    }
}
