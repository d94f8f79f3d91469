//! The figures that are tried.

use serde::{Deserialize, Serialize};

use crate::facts::localise::{Figure, FigureKind};
use crate::facts::visit::Fixes;
use crate::localise::scene::Scene;

/// Least radius of a figure, m, the ratio of two, and their number.
const RADIUS_MIN: f64 = 10.0;
const RADIUS_RATIO: f64 = 1.4;
const RADII: i32 = 12;

/// Largest ratio of a figure's size to that of the previous one.
const RESIZED: f64 = 3.0;

/// Ratio of the radii and speeds of a figure to those of its neighbours.
const NEIGHBOUR: f64 = 1.1;

/// Least share of the craft's speed along a figure, beside fast AUVs.
const SPEED_SHARE_MIN: f64 = 0.1;

/// A figure that the planner does not choose.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct FixedFigure {
    /// Its shape; only `above`, `circle` and `zigzag_astern`, else a circle.
    pub kind: FigureKind,
    /// Its radius, or its distance and half its width, m.
    pub radius_m: f64,
    /// Share of the greatest speed about the AUVs.
    pub speed_share: f64,
}

impl Scene {
    /// A figure of this shape, without phase.
    pub(crate) fn fixed(&self, fixed: &FixedFigure) -> Figure {
        let radius = fixed.radius_m;
        match (fixed.kind, self.course()) {
            (FigureKind::Above, _) => self.above(),
            (FigureKind::ZigzagAstern, Some(course)) => {
                let shape = [-radius, 0.0, 0.0, radius];
                self.figure(fixed.kind, course, shape, fixed.speed_share)
            }
            _ => self.figure(FigureKind::Circle, 0.0, [0.0, 0.0, radius, radius], fixed.speed_share),
        }
    }

    /// A point at the members' mean.
    pub(crate) fn above(&self) -> Figure {
        self.figure(FigureKind::Above, 0.0, [0.0; 4], 0.0)
    }

    /// Figures of all kinds, their axes counted from the bow, without phases; after the figure
    /// `before`, circles and ellipses of the same sense and up to three times as large or small.
    pub(crate) fn candidates(&self, before: Option<&Figure>) -> Vec<Figure> {
        let mut candidates = Vec::new();
        let least = self.stand_off.max(self.least_radius);
        let largest = self.range_max.min(self.radius_max);
        let radii = (0..RADII).map(|i| RADIUS_MIN * RADIUS_RATIO.powi(i));
        let radii =
            radii.filter(|radius| least < *radius).chain(Some(least).filter(|least| RADIUS_MIN <= *least));
        let radii = radii.filter(|radius| *radius <= largest);
        // The largest that a visit allows is usually the best.
        let radii = radii.chain(Some(self.radius_max).filter(|radius| radius.is_finite()));
        if self.fixes == Fixes::Usbl && self.stand_off <= 0.0 {
            candidates.push(self.above());
        }
        let goes_on = |figure: &Figure| {
            before.is_none_or(|before| {
                let ratio = figure.size() / before.size().max(RADIUS_MIN);
                0.0 <= figure.rate_radps * before.rate_radps && (RESIZED.recip()..RESIZED).contains(&ratio)
            })
        };
        let mut both = |kind, axis, shape: [f64; 4]| {
            let senses = [1.0, -1.0].map(|sense| self.figure(kind, axis, shape, sense));
            candidates.extend(senses.into_iter().filter(goes_on));
        };
        for radius in radii.clone() {
            both(FigureKind::Circle, 0.0, [0.0, 0.0, radius, radius]);
        }
        if let Some((axis, spread)) = self.line() {
            for radius in radii.clone().skip(1).step_by(2).take(4) {
                both(FigureKind::Ellipse, axis, [0.0, 0.0, spread + radius, radius]);
            }
        }
        if let Some(course) = self.course() {
            for radius in radii.skip(1).step_by(2).take(3) {
                candidates.push(self.figure(
                    FigureKind::ZigzagAstern,
                    course,
                    [-radius, 0.0, 0.0, radius],
                    1.0,
                ));
                for side in [radius, -radius] {
                    candidates.push(self.figure(
                        FigureKind::ZigzagAbeam,
                        course,
                        [0.0, side, radius, 0.0],
                        1.0,
                    ));
                }
            }
        }
        candidates
    }

    /// `figure` with its axis by today's AUVs, and its neighbours in size and speed.
    pub(crate) fn neighbours(&self, figure: &Figure) -> Vec<Figure> {
        let axis = match figure.kind {
            FigureKind::Above | FigureKind::Circle => Some(figure.axis_rad),
            FigureKind::Ellipse => self.line().map(|(axis, _)| nearest_end(axis, figure.axis_rad)),
            FigureKind::ZigzagAstern | FigureKind::ZigzagAbeam => self.course(),
        };
        let Some(axis_rad) = axis else {
            return Vec::new();
        };
        let figure = self.with_room(Figure { axis_rad, ..figure.clone() });
        let most = self.rate(&figure);
        let sized = |ratio: f64| figure.clone().scaled(ratio);
        let paced = |ratio: f64| Figure {
            rate_radps: (figure.rate_radps * ratio).clamp(-most, most),
            ..figure.clone()
        };
        let mut all = vec![paced(1.0)];
        if figure.kind != FigureKind::Above {
            let larger = NEIGHBOUR.min((self.radius_max / figure.size()).max(1.0));
            let smaller = NEIGHBOUR.recip().max((self.least_radius / figure.size()).min(1.0));
            all.extend([sized(larger), sized(smaller), paced(NEIGHBOUR), paced(1.0 / NEIGHBOUR)]);
        }
        all
    }

    /// The figure, if it is not too small, or one that is large enough.
    fn with_room(&self, figure: Figure) -> Figure {
        let size = figure.size();
        if figure.kind == FigureKind::Above || self.least_radius <= size {
            return figure;
        }
        figure.scaled(self.least_radius / size.max(f64::MIN_POSITIVE))
    }

    fn figure(&self, kind: FigureKind, axis: f64, shape: [f64; 4], sense: f64) -> Figure {
        let [ahead_m, starboard_m, semi_ahead_m, semi_starboard_m] = shape;
        let mut figure = Figure {
            kind,
            north_m: 0.0,
            east_m: 0.0,
            axis_rad: axis,
            ahead_m,
            starboard_m,
            semi_ahead_m,
            semi_starboard_m,
            rate_radps: 0.0,
            phase_rad: 0.0,
            vehicles: Vec::new(),
            sentence: String::new(),
        };
        figure.rate_radps = sense * self.rate(&figure);
        figure
    }

    /// Largest rate at which the craft sails `figure` about the moving AUVs, rad/s.
    fn rate(&self, figure: &Figure) -> f64 {
        let horizon = self.mean.len() - 1;
        let drift = (self.mean[horizon] - self.mean[0]).norm() / (self.interval * horizon as f64);
        let now = self.mean_at(0.0).1.norm();
        let left = (self.speed - drift.max(now)).max(SPEED_SHARE_MIN * self.speed);
        let size = figure.size();
        if 0.0 < size { left / size } else { 0.0 }
    }
}

/// The end of a line with the direction `axis` that is nearest to `before`.
fn nearest_end(axis: f64, before: f64) -> f64 {
    if (axis - before).cos() < 0.0 { axis + std::f64::consts::PI } else { axis }
}
