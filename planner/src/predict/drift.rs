use nalgebra::Vector2;

use crate::predict::motion::Motion;

/// How long drift is averaged over, s: as long as the current is.
pub(crate) const MEMORY: f64 = 30.0;

/// How far a vehicle is carried, m, and how fast, m/s (north, east).
pub(crate) struct Carried {
    by: Vector2<f64>,
    at: Vector2<f64>,
}

impl Carried {
    /// The motion that a model foresees, and this beyond it.
    pub(crate) fn beyond(&self, modelled: Motion) -> Motion {
        Motion {
            position: modelled.position + self.by,
            velocity: modelled.velocity + self.at,
        }
    }
}

/// By a drift that stays as it is.
pub(crate) fn for_ever(drift: Vector2<f64>, elapsed: f64) -> Carried {
    Carried {
        by: drift * elapsed,
        at: drift,
    }
}

/// By a drift that fades, since a vehicle that follows a path comes back to it.
///
/// ```text
/// d τ (1 − exp(−t/τ))
/// ```
pub(crate) fn fading(drift: Vector2<f64>, elapsed: f64) -> Carried {
    let left = (-elapsed / MEMORY).exp();
    Carried {
        by: drift * (MEMORY * (1.0 - left)),
        at: drift * left,
    }
}
