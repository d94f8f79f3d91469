//! How fast an AUV leaves its forecasts: a current that it does not know of, or a speed log that lies.

use nalgebra::Vector2;

use super::{AuvForecast, Motion};
use crate::snapshot::{ForecastModel, PreviousTarget};

/// How long drift is averaged over, s.
const MEMORY: f64 = 30.0;

/// Oldest forecast that drift is told by, s.
const FORECAST_AGE_MAX: f64 = 60.0;

/// A vehicle farther from where it was expected has jumped, m: it surfaced and found out where it is, or was mistaken
/// for another. That tells nothing of how it goes on.
const JUMP: f64 = 3.0;

/// Fastest drift along an axis, m/s.
const DRIFT_MAX: f64 = 0.5;

/// How far a vehicle is carried, m, and how fast, m/s (north, east).
pub(super) struct Carried {
    by: Vector2<f64>,
    at: Vector2<f64>,
}

impl Carried {
    /// The motion that a model foresees, and this beyond it.
    pub(super) fn beyond(&self, modelled: Motion) -> Motion {
        Motion {
            position: modelled.position + self.by,
            velocity: modelled.velocity + self.at,
        }
    }
}

/// By a drift that stays as it is.
pub(super) fn for_ever(drift: Vector2<f64>, elapsed: f64) -> Carried {
    Carried {
        by: drift * elapsed,
        at: drift,
    }
}

/// By a drift that fades, since whoever follows a path comes back to it.
///
/// ```text
/// d τ (1 − exp(−t/τ))
/// ```
pub(super) fn fading(drift: Vector2<f64>, elapsed: f64) -> Carried {
    let left = (-elapsed / MEMORY).exp();
    Carried {
        by: drift * (MEMORY * (1.0 - left)),
        at: drift * left,
    }
}

impl AuvForecast {
    /// Velocity over ground (north, east) beyond what the model and the report explain, m/s.
    #[must_use]
    pub fn drift(&self) -> Vector2<f64> {
        self.drift
    }

    /// Takes up what an earlier answer tells: how fast the AUV was drifting, and where it was expected `now`, s.
    ///
    /// ```text
    /// d = d⁻ + (p − p⁻) / max(τ, Δ)
    /// ```
    /// with p⁻ the place now that the earlier answer expected, p the one that a forecast with the same drift from the
    /// newest report expects, and Δ the time between the reports. Noise of the positions cancels from report to
    /// report; one that was not renewed changes nothing.
    ///
    /// Measured in `slocum`, whose gliders tell their velocity through the water: 0.95 times as far off, and 0.01 m once
    /// settled in place of 0.37 m. Along paths a drift that did not fade would do harm: 1.5 times as far off in `faults`,
    /// where one vehicle strays and another dies.
    pub(crate) fn take_up(&mut self, earlier: &PreviousTarget, now: f64) {
        let (Some((then, _)), Some(expected)) = (earlier.positions.first(), earlier.position_at(now)) else {
            return;
        };
        if self.model == ForecastModel::Hold || FORECAST_AGE_MAX < now - then {
            return;
        }
        self.drift = earlier.drift;
        let off = self.at(0.0).position - expected;
        if off.norm() <= JUMP {
            let between = (now - self.age) - (then - earlier.report_age);
            self.drift += off / between.max(MEMORY);
        }
        self.drift = self.drift.map(|along| along.clamp(-DRIFT_MAX, DRIFT_MAX));
    }
}
