//! Rigid motion of one piece of a track onto another.

use nalgebra::Complex;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// Shape of a repeated track.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Pattern {
    /// Lanes of a lawn-mower: each is the previous one, mirrored and shifted.
    Lanes,
    /// A closed lap: a box, a racetrack, or to and fro.
    Laps,
    /// Another pattern, repeated elsewhere.
    Other,
}

/// A rotation and a translation, after a reflection if mirrored.
#[derive(Clone)]
pub(crate) struct RigidMotion {
    pub(crate) mirrored: bool,
    turn: Complex<f64>,
    from: Complex<f64>,
    to: Complex<f64>,
    /// Remaining root-mean-square distance, m.
    pub(crate) residual: f64,
    /// Radius of gyration of the moved piece, m.
    pub(crate) extent: f64,
}

impl RigidMotion {
    /// The motion of `earlier` closest to `later` in the mean square: by the phase of Σ ā b.
    pub(crate) fn between(earlier: &[Complex<f64>], later: &[Complex<f64>], mirrored: bool) -> Self {
        let n = later.len() as f64;
        let reflected = |point: &Complex<f64>| if mirrored { point.conj() } else { *point };
        let from = earlier.iter().map(reflected).sum::<Complex<f64>>() / n;
        let to = later.iter().sum::<Complex<f64>>() / n;
        let (mut product, mut squares, mut extent) = (Complex::new(0.0, 0.0), 0.0, 0.0);
        for (a, b) in earlier.iter().zip(later) {
            let (a, b) = (reflected(a) - from, b - to);
            product += a.conj() * b;
            squares += a.norm_sqr() + b.norm_sqr();
            extent += b.norm_sqr();
        }
        let size = product.norm();
        Self {
            mirrored,
            turn: if size > 0.0 { product / size } else { Complex::new(1.0, 0.0) },
            from,
            to,
            residual: ((squares - 2.0 * size) / n).max(0.0).sqrt(),
            extent: (extent / n).sqrt(),
        }
    }

    /// Translation along its axis, m, if mirrored.
    pub(crate) fn glide(&self) -> f64 {
        0.5 * (self.of(self.of(self.to)) - self.to).norm()
    }

    /// Shape of a track that repeats by this motion. Points nearer than `same`, m, coincide.
    pub(crate) fn pattern(&self, same: f64) -> Pattern {
        if self.mirrored && same < self.glide() {
            return Pattern::Lanes;
        }
        // A lap may consist of up to eight equal rotated pieces.
        let laps = (1..=8).scan(self.to, |place, _| {
            *place = self.of(*place);
            Some(*place)
        });
        let closes = laps.enumerate().any(|(turns, place)| {
            let turn = self.turn.powf((turns + 1) as f64);
            (place - self.to).norm() < same && (self.mirrored || (turn - 1.0).norm() * self.extent < same)
        });
        if closes { Pattern::Laps } else { Pattern::Other }
    }

    pub(crate) fn of(&self, point: Complex<f64>) -> Complex<f64> {
        let point = if self.mirrored { point.conj() } else { point };
        self.to + self.turn * (point - self.from)
    }
}
