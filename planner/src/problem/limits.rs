//! Limits of position at the stages.

use nalgebra::Vector2;

use crate::facts::asc::Limits;

/// Largest horizontal distance to an AUV, at stages 0 … N.
#[derive(Clone, Debug, PartialEq)]
pub struct AcousticRange {
    /// Positions of the AUV, m.
    pub centres: Vec<Vector2<f64>>,
    /// Largest horizontal distance, m, never negative.
    pub radii: Vec<f64>,
    /// `true` if the goal names the AUV.
    pub named: bool,
}

/// A disc to stay out of, at stages 0 … N; it may move, like a surfacing AUV.
#[derive(Clone, Debug, PartialEq)]
pub struct Disc {
    /// Its centre, m.
    pub centres: Vec<Vector2<f64>>,
    /// Distance to keep from the centre, m; negative while the disc is inactive.
    pub radii: Vec<f64>,
    /// Unit vector from the disc to the craft's side in interval k − 1 → k, for k ≥ 1; 0 is unused.
    pub normals: Vec<Vector2<f64>>,
}

/// A half-plane beside a no-go area for each interval of a horizon.
#[derive(Clone, Debug, PartialEq)]
pub struct Shore {
    /// Element k ≥ 1, for interval k − 1 → k: a point of its edge, m.
    pub points: Vec<Vector2<f64>>,
    /// The unit vector to the craft's side; zero without a limit.
    pub normals: Vec<Vector2<f64>>,
    /// Distance to keep from the edge, m.
    pub margin: f64,
}

/// A half-plane to stay in: normal · p ≤ offset.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Edge {
    /// Unit vector out of the area.
    pub normal: Vector2<f64>,
    /// Distance of the edge from the craft's position now, m.
    pub offset: f64,
}

/// An AUV in a minimax range (the largest slant range is minimised), at stages 0 … N.
#[derive(Clone, Debug, PartialEq)]
pub struct MinimaxRange {
    /// Positions, m.
    pub positions: Vec<Vector2<f64>>,
    /// Depths, m.
    pub depths: Vec<f64>,
}

/// Largest distance of the craft's way over `dt`, s, from its chord, m: Δt² ‖a‖ / 8.
pub(crate) fn sag(dt: f64, limits: &Limits) -> f64 {
    let ahead = limits.acceleration_max.max(limits.deceleration_max);
    dt * dt * ahead.hypot(limits.turn_rate_max * limits.speed_max) / 8.0
}

/// The same to the side that a turn bends it to. Beside a shore this decides: what speeds up or
/// slows down stays on the chord, and an unknown craft's acceleration would close every strait.
pub(crate) fn sag_in_turn(dt: f64, limits: &Limits) -> f64 {
    dt * dt * limits.turn_rate_max * limits.speed_max / 8.0
}
