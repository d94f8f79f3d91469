//! How fast an AUV leaves its forecasts: a current that it does not know of, or a speed log that lies.

use nalgebra::Vector2;

use super::{AuvForecast, Intent, Motion};
use crate::{
    angle::Course,
    snapshot::{AuvState, ForecastChoice, ForecastModel, PreviousTarget},
};

/// How long drift is averaged over, s: as long as the current is.
const MEMORY: f64 = 30.0;

/// Longest time between two reports that drift is told by, s. Over longer ones a vehicle turns.
const BETWEEN_MAX: f64 = 60.0;

/// Reports nearer in time than this are one, s: their times come about by different sums.
const BETWEEN_MIN: f64 = 1e-3;

/// A vehicle farther than this from where it was expected has jumped, m, unless the time between the reports explains
/// it: it surfaced and found out where it is, or was mistaken for another. That tells nothing of how it goes on.
///
/// Assumption: two standard deviations of an acoustic fix (1.5 m).
const JUMP: f64 = 3.0;

/// Drift that explains a distance, m/s. Assumption: a strong current where AUVs work.
const USUAL: f64 = 0.3;

/// Fastest drift along an axis, m/s. Assumption: an AUV that stands more of it does not get home.
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

    /// Forecasts anew from `state`, in the memory of the forecast before, and takes up what an earlier answer knew from a
    /// report `between` seconds before: how fast the AUV was drifting, and where from.
    ///
    /// ```text
    /// d = d⁻ + (p − p⁻) / max(τ, Δ)          τ = 30 s
    /// ```
    /// with p the position of the newest report, p⁻ the one forecast for its time from the report before, with the drift
    /// d⁻, and Δ the time between the two; as it was, where the newest report is no newer, Δ is above a minute, or p − p⁻
    /// is a jump. Noise of the positions mostly cancels from report to report.
    ///
    /// Measured in `slocum`, whose gliders tell their velocity through the water: 0.95 times as far off, and 0.01 m once
    /// settled in place of 0.37 m. Along paths a drift that did not fade would do harm: 1.5 times as far off in `faults`,
    /// where one vehicle strays and another dies.
    pub(crate) fn update_after(
        &mut self,
        earlier: &PreviousTarget,
        between: f64,
        state: &AuvState,
        (intent, choice, current): (Intent<'_>, ForecastChoice, &Vector2<f64>),
    ) {
        let drift = earlier.drift.map(|along| along.clamp(-DRIFT_MAX, DRIFT_MAX));
        let tells = earlier.model != ForecastModel::Hold && (BETWEEN_MIN..=BETWEEN_MAX).contains(&between);
        let expected = tells.then(|| {
            let before = AuvState {
                position: earlier.position,
                depth: earlier.depth,
                course: Course::of(&earlier.velocity),
                speed: earlier.velocity.norm(),
                turn_rate: earlier.turn_rate,
                age: 0.0,
                covariance: None,
            };
            self.update(&before, intent, ForecastChoice::Model(earlier.model), current);
            self.drift = drift;
            self.at(between).position
        });
        self.update(state, intent, choice, current);
        // What a path does not explain says nothing of motion, nor the other way round.
        let along_path = |model| model == ForecastModel::Path;
        if self.model == ForecastModel::Hold || along_path(self.model) != along_path(earlier.model) {
            return;
        }
        self.drift = drift;
        let off = expected.map_or_else(Vector2::zeros, |expected| state.position - expected);
        if off.norm() <= JUMP.max(USUAL * between) {
            let drift = drift + off / between.max(MEMORY);
            self.drift = drift.map(|along| along.clamp(-DRIFT_MAX, DRIFT_MAX));
        }
    }
}
