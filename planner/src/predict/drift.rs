use nalgebra::Vector2;

use crate::predict::motion::Motion;

/// Averaging time of drift, s, as of the current.
pub(crate) const MEMORY: f64 = 30.0;

/// Displacement by drift (north, east), m, and its rate, m/s.
pub(crate) struct Carried {
    by: Vector2<f64>,
    at: Vector2<f64>,
}

impl Carried {
    /// The modelled motion with this displacement.
    pub(crate) fn beyond(&self, modelled: Motion) -> Motion {
        Motion {
            position: modelled.position + self.by,
            velocity: modelled.velocity + self.at,
        }
    }
}

/// Displacement by a constant drift.
pub(crate) fn constant(drift: Vector2<f64>, elapsed: f64) -> Carried {
    Carried {
        by: drift * elapsed,
        at: drift,
    }
}

/// Displacement by a fading drift: a vehicle returns to its path.
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
