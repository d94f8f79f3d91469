//! Limits of position at the stages.

use nalgebra::Vector2;

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
    /// Element k ≥ 1, for interval k − 1 → k: the unit vector from the disc to the side on which
    /// the craft passes. Element 0 is unused.
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

/// An AUV in a minimax range (the largest slant range is minimised), at stages 0 … N.
#[derive(Clone, Debug, PartialEq)]
pub struct MinimaxRange {
    /// Positions, m.
    pub positions: Vec<Vector2<f64>>,
    /// Depths, m.
    pub depths: Vec<f64>,
}
