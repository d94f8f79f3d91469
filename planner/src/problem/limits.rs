//! Limits of position at the stages.

use nalgebra::Vector2;

/// Horizontal distance to keep within of an AUV, at stages 0 … N.
#[derive(Clone, Debug, PartialEq)]
pub struct AcousticRange {
    /// Where the AUV is, m.
    pub centres: Vec<Vector2<f64>>,
    /// Farthest horizontal distance, m, never negative.
    pub radii: Vec<f64>,
    /// Whether the goal names the AUV.
    pub named: bool,
}

/// A disc to stay out of, at stages 0 … N; it may move, as an AUV that surfaces does.
#[derive(Clone, Debug, PartialEq)]
pub struct Disc {
    /// Its centre, m.
    pub centres: Vec<Vector2<f64>>,
    /// Distance to keep from the centre, m; negative where the disc is not there.
    pub radii: Vec<f64>,
    /// For each interval k − 1 → k at place k, the unit vector from the disc to the side on which the craft passes; at
    /// place 0 none is used.
    pub normals: Vec<Vector2<f64>>,
}

/// A half-plane to stay in: normal · p ≤ offset.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Edge {
    /// Unit vector out of the area.
    pub normal: Vector2<f64>,
    /// Distance of the edge from the craft's position now, m.
    pub offset: f64,
}

/// An AUV whose slant range is one of those of which the largest is to be small (minimax), at stages 0 … N.
#[derive(Clone, Debug, PartialEq)]
pub struct MinimaxRange {
    /// Where it is, m.
    pub positions: Vec<Vector2<f64>>,
    /// How deep, m.
    pub depths: Vec<f64>,
}
