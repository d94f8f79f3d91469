//! Checked segments of paths: lines, arcs, and way-points with rounded corners.

use std::f64::consts::FRAC_PI_2;

use nalgebra::Vector2;

use crate::facts::angle::angle_of;
use crate::facts::field_error::FieldError;
use crate::facts::path::limits::{
    ARC_ANGLE_MAX, InvalidPath, LENGTH_MAX, LENGTH_MIN, TURN_RADIUS, one_place, require_point, require_within,
};
use crate::facts::path::piece::{Leg, Piece};
use crate::facts::path::waypoints::{Corners, Overshot, legs};
use crate::facts::tagged::{read_tagged, tagged};

tagged! {
    /// A segment of a path. `kind` determines the other members. Points are (north, east), m.
    #[derive(Clone, Debug, PartialEq)]
    pub enum Segment = "Segment", SegmentOutside, "kind" {
        /// A straight line.
        Line {
            /// Beginning.
            from: [f64; 2],
            /// End.
            to: [f64; 2],
        },
        /// Part of a circle.
        Arc {
            /// Beginning.
            from: [f64; 2],
            /// Centre of the circle.
            centre: [f64; 2],
            /// Turn, rad, positive to starboard, up to a full circle.
            angle_rad: f64,
        },
        /// Straight legs between points, joined by arcs that touch both legs.
        Waypoints {
            /// Points where the legs meet. Repeated points are omitted.
            points: Vec<[f64; 2]>,
            /// Radius of every corner, m, for which all legs must have room; 0 only if no leg
            /// turns. Without it, corners have the `turn_radius_m`, or the largest possible radius.
            #[serde(default, skip_serializing_if = "Option::is_none")]
            fillet_m: Option<f64>,
            /// Without `fillet_m`: the vehicle's turn radius, m. Default: its speed at 0.15 rad/s;
            /// with `reports` also at 0.09 and 0.055 rad/s, corners cut or overshot, and the best
            /// fit counts.
            #[serde(default, skip_serializing_if = "Option::is_none")]
            turn_radius_m: Option<f64>,
            /// Speed and depth of every leg, beginning at the first point; for a closed path also
            /// of the leg back. Empty if they do not differ.
            #[serde(default, skip_serializing_if = "Vec::is_empty")]
            legs: Vec<Leg>,
        },
    }
}
read_tagged!(Segment, SegmentOutside, "kind");

impl Segment {
    /// Number of segments; every way-point counts as one.
    pub fn count(&self) -> usize {
        match self {
            Self::Line { .. } | Self::Arc { .. } => 1,
            Self::Waypoints { points, .. } => points.len(),
        }
    }

    /// Its points (north, east), m.
    pub fn points_mut(&mut self) -> impl Iterator<Item = &mut [f64; 2]> {
        let (points, ends) = match self {
            Self::Line { from: a, to: b } | Self::Arc { from: a, centre: b, .. } => {
                (&mut [][..], Some([a, b]))
            }
            Self::Waypoints { points, .. } => (points.as_mut_slice(), None),
        };
        points.iter_mut().chain(ends.into_iter().flatten())
    }

    /// The unchecked piece of a line or arc; `None` for way-points.
    pub(super) fn piece(&self) -> Option<Piece> {
        match self {
            Self::Line { from, to } => {
                let along = between(from, to);
                Some(Piece::line(Vector2::from(*from), angle_of(&along), along.norm()))
            }
            Self::Arc { from, centre, angle_rad } => {
                let to_centre = between(from, centre);
                let tangent = angle_of(&to_centre) - FRAC_PI_2.copysign(*angle_rad);
                Some(Piece::arc(Vector2::from(*from), tangent, to_centre.norm(), *angle_rad))
            }
            Self::Waypoints { .. } => None,
        }
    }

    /// Its checked pieces; `ring`: way-points lead back to the first.
    pub(super) fn pieces(
        &self,
        field: &str,
        ring: bool,
        overshot: Option<Overshot>,
    ) -> Result<Vec<Piece>, InvalidPath> {
        match self {
            Self::Line { from, to } => {
                require_point(format_args!("{field}/from"), from)?;
                require_point(format_args!("{field}/to"), to)?;
                let length = between(from, to).norm();
                if length < LENGTH_MIN {
                    return Err(one_place(format_args!("{field}/to"), "both ends", LENGTH_MIN));
                }
                require_within(format_args!("{field}/to"), length, LENGTH_MIN, LENGTH_MAX)?;
            }
            Self::Arc { from, centre, angle_rad } => {
                require_point(format_args!("{field}/from"), from)?;
                require_point(format_args!("{field}/centre"), centre)?;
                let radius = between(centre, from).norm();
                if radius < LENGTH_MIN {
                    let place = format_args!("{field}/centre");
                    return Err(one_place(place, "beginning and centre", LENGTH_MIN));
                }
                require_within(format_args!("{field}/centre"), radius, LENGTH_MIN, LENGTH_MAX)?;
                let (field, least) = (format_args!("{field}/angle_rad"), LENGTH_MIN / radius);
                require_within(field, angle_rad.abs(), least, ARC_ANGLE_MAX)?;
            }
            Self::Waypoints { points, fillet_m, turn_radius_m, legs: declared } => {
                let corners = match (*fillet_m, *turn_radius_m) {
                    (Some(radius), None) => Corners::Fillets { radius },
                    (None, radius) => Corners::Turns { radius: radius.unwrap_or(TURN_RADIUS), overshot },
                    (Some(_), Some(_)) => {
                        let detail = "give fillet_m, which must fit, or turn_radius_m, which is made to fit";
                        let place = format_args!("{field}/turn_radius_m");
                        return Err(Box::new(FieldError::new(place, "unexpected", detail)));
                    }
                };
                return legs(points, declared, ring, corners, field);
            }
        }
        Ok(self.piece().into_iter().collect())
    }
}

fn between(from: &[f64; 2], to: &[f64; 2]) -> Vector2<f64> {
    Vector2::from(*to) - Vector2::from(*from)
}
