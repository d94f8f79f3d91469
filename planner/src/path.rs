//! Horizontal paths made of lines and arcs, parametrised by arc length.

use std::f64::consts::PI;

use crate::{angle::direction, forecast::sinc};
use nalgebra::Vector2;

/// A piece of constant curvature: a line where the curvature is zero, else an arc.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Piece {
    /// Arc length at its beginning, m.
    from: f64,
    /// Where it begins (north, east), m.
    start: Vector2<f64>,
    /// Tangent angle where it begins, rad, not wrapped.
    tangent: f64,
    /// Signed curvature, 1/m, positive to starboard.
    curvature: f64,
    /// Its length, m.
    length: f64,
}

impl Piece {
    /// The chord of an arc, regular where the curvature κ vanishes:
    /// p(ℓ) = p₀ + ℓ sinc(κ ℓ / 2) [cos(ψ + κ ℓ / 2), sin(ψ + κ ℓ / 2)].
    fn at(&self, length: f64) -> PathPoint {
        let half_turn = 0.5 * self.curvature * length;
        PathPoint {
            position: self.start + direction(self.tangent + half_turn) * (length * sinc(half_turn)),
            tangent: self.tangent + 2.0 * half_turn,
            curvature: self.curvature,
        }
    }
}

/// A point of a path, and how the path passes through it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PathPoint {
    /// Position (north, east), m.
    pub position: Vector2<f64>,
    /// Tangent angle `ψ_P`, rad, clockwise from north, not wrapped.
    #[doc(alias = "psi_P")]
    pub tangent: f64,
    /// Signed curvature κ, 1/m, positive to starboard.
    #[doc(alias = "kappa")]
    pub curvature: f64,
}

/// A path with a continuous tangent. It goes on straight before its beginning and after its end.
#[derive(Clone, Debug, PartialEq)]
pub struct Path {
    pieces: Vec<Piece>,
    end: PathPoint,
    length: f64,
}

/// To which side a path turns, seen in its own direction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// To the left.
    Port,
    /// To the right.
    Starboard,
}

impl Path {
    /// A path of no length at `start` (north, east), m, that points along `tangent`, rad.
    #[must_use]
    pub fn starting_at(start: Vector2<f64>, tangent: f64) -> Self {
        let end = PathPoint {
            position: start,
            tangent,
            curvature: 0.0,
        };
        Self {
            pieces: vec![],
            end,
            length: 0.0,
        }
    }

    /// Appends a line of `length` metres.
    #[must_use]
    pub fn line(self, length: f64) -> Self {
        self.piece(0.0, length)
    }

    /// Appends an arc of `radius` metres through `angle` radians, both positive.
    #[must_use]
    pub fn arc(self, side: Side, radius: f64, angle: f64) -> Self {
        let curvature = match side {
            Side::Port => -1.0 / radius,
            Side::Starboard => 1.0 / radius,
        };
        self.piece(curvature, radius * angle)
    }

    /// Lanes of `lane_length` metres, `lane_spacing` metres apart, joined by half circles; the first
    /// turn is to starboard.
    #[must_use]
    pub fn lawn_mower(
        start: Vector2<f64>,
        tangent: f64,
        lane_length: f64,
        lane_spacing: f64,
        n_lanes: usize,
    ) -> Self {
        let first = Self::starting_at(start, tangent).line(lane_length);
        (1..n_lanes).fold(first, |path, lane| {
            let side = if lane % 2 == 1 {
                Side::Starboard
            } else {
                Side::Port
            };
            path.arc(side, 0.5 * lane_spacing, PI).line(lane_length)
        })
    }

    fn piece(mut self, curvature: f64, length: f64) -> Self {
        let PathPoint {
            position: start,
            tangent,
            ..
        } = self.end;
        let piece = Piece {
            from: self.length,
            start,
            tangent,
            curvature,
            length,
        };
        self.end = PathPoint {
            curvature: 0.0,
            ..piece.at(length)
        };
        self.pieces.push(piece);
        self.length += length;
        self
    }

    /// Length, m.
    #[must_use]
    pub fn length(&self) -> f64 {
        self.length
    }

    /// The point at arc length `gamma`, m.
    #[must_use]
    pub fn at(&self, gamma: f64) -> PathPoint {
        let beyond = |point: PathPoint, length: f64| PathPoint {
            position: point.position + direction(point.tangent) * length,
            curvature: 0.0,
            ..point
        };
        match self.pieces.iter().rev().find(|piece| piece.from <= gamma) {
            Some(piece) if gamma <= piece.from + piece.length => piece.at(gamma - piece.from),
            Some(_) => beyond(self.end, gamma - self.length),
            None => beyond(self.pieces.first().map_or(self.end, |first| first.at(0.0)), gamma),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mower() -> Path {
        Path::lawn_mower(Vector2::new(3.0, -2.0), 0.4, 50.0, 20.0, 4)
    }

    #[test]
    fn arc_length_tangent_and_curvature_agree_with_finite_differences() {
        let path = mower();
        let h = 1e-4;
        // Off the joints, where the curvature jumps.
        for gamma in [-5.0, 10.0, 55.0, 70.0, 100.0, 140.0, 300.0] {
            let (before, now, after) = (path.at(gamma - h), path.at(gamma), path.at(gamma + h));
            let slope = (after.position - before.position) / (2.0 * h);
            assert!(
                (slope - direction(now.tangent)).norm() < 1e-7,
                "tangent at {gamma}"
            );
            let turn = (after.tangent - before.tangent) / (2.0 * h);
            assert!((turn - now.curvature).abs() < 1e-7, "curvature at {gamma}");
        }
    }

    #[test]
    fn the_path_and_its_tangent_have_no_jump() {
        let path = mower();
        for piece in &path.pieces {
            for joint in [piece.from, piece.from + piece.length] {
                let (before, after) = (path.at(joint - 1e-9), path.at(joint + 1e-9));
                assert!((before.position - after.position).norm() < 1e-8);
                assert!((before.tangent - after.tangent).abs() < 1e-8);
            }
        }
    }

    #[test]
    fn lanes_lie_their_spacing_apart_and_run_back_and_forth() {
        let path = Path::lawn_mower(Vector2::zeros(), 0.0, 50.0, 20.0, 3);
        let second = path.at(50.0 + 10.0 * PI);
        assert!((second.position - Vector2::new(50.0, 20.0)).norm() < 1e-9);
        assert!((path.at(path.length()).position - Vector2::new(50.0, 40.0)).norm() < 1e-9);
        assert!((path.length() - (150.0 + 20.0 * PI)).abs() < 1e-9);
    }
}
