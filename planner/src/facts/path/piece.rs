//! Lines and arcs, in closed form.

use std::f64::consts::TAU;

use nalgebra::Vector2;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_with::skip_serializing_none;
use utoipa::ToSchema;

use crate::facts::angle::{angle_of, direction, sinc};

/// A vehicle's motion on a leg, to the end of the turn at its last point.
#[skip_serializing_none]
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, ToSchema, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Leg {
    /// Horizontal speed through the water, m/s. Default: the path's.
    pub speed_mps: Option<f64>,
    /// Depth, m, positive down. Default: unchanged. A `dive` overrides it.
    pub depth_m: Option<f64>,
}

/// A point of a path, with tangent and curvature.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PathPoint {
    /// Position (north, east), m.
    pub position: Vector2<f64>,
    /// Tangent angle `ψ_P`, rad, clockwise from north, not wrapped: continuous along the path.
    #[doc(alias = "psi_P")]
    pub tangent: f64,
    /// Signed curvature κ, 1/m, positive to starboard.
    #[doc(alias = "kappa")]
    pub curvature: f64,
    /// Its leg.
    pub leg: Leg,
}

/// A piece of constant curvature: a line where the curvature is zero, else an arc.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Piece {
    /// Arc length of the path at its beginning, m.
    pub(crate) from: f64,
    pub(crate) start: Vector2<f64>,
    /// Tangent angle at its beginning, rad, not wrapped.
    pub(crate) tangent: f64,
    /// Signed curvature, 1/m, positive to starboard.
    pub(crate) curvature: f64,
    pub(crate) length: f64,
    pub(crate) leg: Leg,
}

impl Piece {
    pub(crate) fn line(start: Vector2<f64>, tangent: f64, length: f64) -> Self {
        Self { from: 0.0, start, tangent, curvature: 0.0, length, leg: Leg::default() }
    }

    /// An arc through `angle`, rad, positive to starboard.
    pub(crate) fn arc(start: Vector2<f64>, tangent: f64, radius: f64, angle: f64) -> Self {
        Self {
            from: 0.0,
            start,
            tangent,
            curvature: angle.signum() / radius,
            length: radius * angle.abs(),
            leg: Leg::default(),
        }
    }

    pub(crate) fn end(&self) -> f64 {
        self.from + self.length
    }

    /// The chord of an arc, regular where the curvature κ vanishes:
    /// p(ℓ) = p₀ + ℓ sinc(κ ℓ / 2) [cos(ψ + κ ℓ / 2), sin(ψ + κ ℓ / 2)].
    pub(crate) fn at(&self, length: f64) -> PathPoint {
        let half_turn = 0.5 * self.curvature * length;
        PathPoint {
            position: self.start + direction(self.tangent + half_turn) * (length * sinc(half_turn)),
            tangent: self.tangent + 2.0 * half_turn,
            curvature: self.curvature,
            leg: self.leg,
        }
    }

    /// The part between two arc lengths of the path, `low` ≤ `high`, both inside.
    pub(crate) fn cut(&self, low: f64, high: f64) -> Self {
        let point = self.at(low - self.from);
        Self { from: low, start: point.position, tangent: point.tangent, length: high - low, ..*self }
    }

    /// Length along it of its point closest to `position`, in [0, `length`].
    pub(crate) fn closest(&self, position: &Vector2<f64>) -> f64 {
        let from_start = position - self.start;
        if self.curvature == 0.0 {
            let along = from_start.dot(&direction(self.tangent));
            return along.max(0.0).min(self.length);
        }
        let (radius, side) = (1.0 / self.curvature.abs(), self.curvature.signum());
        let centre_from_start = starboard(self.tangent) * (side * radius);
        let from_centre = from_start - centre_from_start;
        let sweep = (side * (angle_of(&from_centre) - angle_of(&-centre_from_start))).rem_euclid(TAU);
        let turn = self.length / radius;
        if sweep <= turn {
            (sweep * radius).min(self.length)
        } else if sweep - turn < TAU - sweep {
            self.length
        } else {
            0.0
        }
    }
}

/// Unit vector 90° clockwise of `tangent`.
pub(crate) fn starboard(tangent: f64) -> Vector2<f64> {
    let ahead = direction(tangent);
    Vector2::new(-ahead.y, ahead.x)
}
