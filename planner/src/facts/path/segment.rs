//! Checked segments of paths: lines, arcs, and way-points with rounded corners.

use std::f64::consts::FRAC_PI_2;

use nalgebra::Vector2;
use serde::{Deserialize, Deserializer, Serialize};
use utoipa::ToSchema;

use crate::facts::{
    angle::angle_of,
    field_error::FieldError,
    members::{members, needed},
    path::{
        limits::{
            ARC_ANGLE_MAX, InvalidPath, LENGTH_MAX, LENGTH_MIN, TURN_RADIUS, one_place, require_point,
            require_within,
        },
        piece::{Leg, Piece},
        waypoints::{Corners, Overshot, legs},
    },
};

/// A segment of a path; positions are (north, east), m.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Segment {
    /// A straight line.
    Line {
        /// Its beginning.
        from: [f64; 2],
        /// Its end.
        to: [f64; 2],
    },
    /// Part of a circle.
    Arc {
        /// Its beginning.
        from: [f64; 2],
        /// Centre of the circle.
        centre: [f64; 2],
        /// Its turn, rad, positive to starboard, up to a full circle.
        angle_rad: f64,
    },
    /// Straight legs between points, joined by arcs that touch both legs.
    Waypoints {
        /// Points where the legs meet. Repeated points are omitted.
        points: Vec<[f64; 2]>,
        /// Radius of every arc, m, for which all legs must have room; 0 for a straight line.
        #[serde(skip_serializing_if = "Option::is_none")]
        fillet_m: Option<f64>,
        /// Without `fillet_m`: turn radius if legs have room, m. Default: [`TURN_RADIUS`].
        #[serde(skip_serializing_if = "Option::is_none")]
        turn_radius_m: Option<f64>,
        /// Differences between legs: empty, or one for each leg, beginning at the first point.
        #[serde(skip_serializing_if = "Vec::is_empty")]
        legs: Vec<Leg>,
    },
}

members! {
    /// A segment of a path. `kind` determines the other members. Points are (north, east), m.
    SegmentMembers of Segment as "Segment",
    /// Kind of segment.
    kind: SegmentKind,
    /// `line`, `arc`: beginning.
    from: Option<[f64; 2]>,
    /// `line`: end.
    to: Option<[f64; 2]>,
    /// `arc`: centre of its circle.
    centre: Option<[f64; 2]>,
    /// `arc`: turn, rad, positive to starboard, up to a full circle.
    angle_rad: Option<f64>,
    /// `waypoints`: points where the straight legs meet.
    points: Option<Vec<[f64; 2]>>,
    /// `waypoints`: radius of every corner, m, for which all legs must have room; 0 only if no leg
    /// turns. Without it, corners have the `turn_radius_m`, or the largest possible radius.
    fillet_m: Option<f64>,
    /// `waypoints` without `fillet_m`: the vehicle's turn radius, m. Default: its speed at 0.15
    /// rad/s; with `reports` also at 0.09 and 0.055 rad/s, and the best fit counts.
    turn_radius_m: Option<f64>,
    /// `waypoints`: speed and depth of every leg, beginning at the first point; for a closed path
    /// also of the leg back. Empty if they do not differ.
    legs: Vec<Leg>,
}

/// Kinds of segments.
#[derive(Clone, Copy, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
enum SegmentKind {
    /// A straight line: `from`, `to`.
    Line,
    /// Part of a circle: `from`, `centre`, `angle_rad`.
    Arc,
    /// Straight legs with rounded corners: `points`; at most one of `fillet_m` and `turn_radius_m`.
    Waypoints,
}

impl<'de> Deserialize<'de> for Segment {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let mut given = SegmentMembers::deserialize(deserializer)?;
        let segment = match given.kind {
            SegmentKind::Line => Self::Line {
                from: needed(&mut given.from, "from")?,
                to: needed(&mut given.to, "to")?,
            },
            SegmentKind::Arc => Self::Arc {
                from: needed(&mut given.from, "from")?,
                centre: needed(&mut given.centre, "centre")?,
                angle_rad: needed(&mut given.angle_rad, "angle_rad")?,
            },
            SegmentKind::Waypoints => Self::Waypoints {
                points: needed(&mut given.points, "points")?,
                fillet_m: given.fillet_m.take(),
                turn_radius_m: given.turn_radius_m.take(),
                legs: std::mem::take(&mut given.legs),
            },
        };
        given.none_left()?;
        Ok(segment)
    }
}

impl Segment {
    /// Number of segments; every way-point counts as one.
    #[must_use]
    pub fn count(&self) -> usize {
        match self {
            Self::Line { .. } | Self::Arc { .. } => 1,
            Self::Waypoints { points, .. } => points.len(),
        }
    }

    /// Its points (north, east), m.
    pub fn points_mut(&mut self) -> impl Iterator<Item = &mut [f64; 2]> {
        let (points, ends) = match self {
            Self::Line { from: a, to: b }
            | Self::Arc {
                from: a, centre: b, ..
            } => (&mut [][..], Some([a, b])),
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
            Self::Arc {
                from,
                centre,
                angle_rad,
            } => {
                let to_centre = between(from, centre);
                let tangent = angle_of(&to_centre) - FRAC_PI_2.copysign(*angle_rad);
                Some(Piece::arc(
                    Vector2::from(*from),
                    tangent,
                    to_centre.norm(),
                    *angle_rad,
                ))
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
            Self::Arc {
                from,
                centre,
                angle_rad,
            } => {
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
            Self::Waypoints {
                points,
                fillet_m,
                turn_radius_m,
                legs: declared,
            } => {
                let corners = match (*fillet_m, *turn_radius_m) {
                    (Some(radius), None) => Corners::Fillets { radius },
                    (None, radius) => Corners::Turns {
                        radius: radius.unwrap_or(TURN_RADIUS),
                        overshot,
                    },
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

/// The vector from one point to another, m.
fn between(from: &[f64; 2], to: &[f64; 2]) -> Vector2<f64> {
    Vector2::from(*to) - Vector2::from(*from)
}
