//! What paths are made of, checked: lines, arcs, and way-points with rounded corners.

use std::f64::consts::{FRAC_PI_2, TAU};

use nalgebra::Vector2;
use serde::{Deserialize, Deserializer, Serialize};
use utoipa::ToSchema;

use crate::facts::{
    angle::{angle_of, direction, wrap},
    invalid_field::{InvalidField, InvalidReason},
    members::{needed, none_left, schema_of},
    path::piece::Piece,
    ranges::COORDINATE_MAX,
};

/// Most segments of a path, every way-point counted as one.
pub const SEGMENTS_MAX: usize = 256;

/// Longest line or leg, and largest radius, m: the same as the largest coordinate.
pub const LENGTH_MAX: f64 = COORDINATE_MAX;

/// Shortest line or leg, and smallest radius, m: what is shorter has no direction once it was written down in
/// millimetres.
pub const LENGTH_MIN: f64 = 1e-3;

/// Farthest that a segment may begin from the end of the one before it, m: coordinates written down in
/// millimetres miss by up to 0.7 mm.
pub const GAP_MAX: f64 = 1e-3;

/// Largest change of direction between two segments, rad: a millimetre on a metre, 0.06°. A vehicle that turns
/// at 0.3 rad/s makes it in 3 ms.
pub const KINK_MAX: f64 = 1e-3;

/// Shorter than this, a piece between or inside fillets is nothing but rounding, m.
const LENGTH_OF_ROUNDING: f64 = 1e-9;

/// Most of an arc, rad: full circle, and what rounding makes of it.
pub const ARC_ANGLE_MAX: f64 = TAU + KINK_MAX;

/// A segment of a path; positions are (north, east), m.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Segment {
    /// A straight line.
    Line {
        /// Where it begins.
        from: [f64; 2],
        /// Where it ends.
        to: [f64; 2],
    },
    /// Part of a circle.
    Arc {
        /// Where it begins.
        from: [f64; 2],
        /// Centre of the circle.
        centre: [f64; 2],
        /// How far it turns, rad, positive to starboard, up to a full circle.
        angle_rad: f64,
    },
    /// Straight legs between points, joined by fillets: arcs that touch both legs.
    Waypoints {
        /// Where the legs would meet.
        points: Vec<[f64; 2]>,
        /// Radius of the fillets, m; 0 where all points lie on one line.
        fillet_m: f64,
    },
}

/// A segment of a path. Which members are needed depends on `kind`. Points are (north, east), m.
#[derive(Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
struct SegmentMembers {
    /// Which segment.
    kind: SegmentKind,
    /// `line`, `arc`: where it begins.
    #[serde(default)]
    from: Option<[f64; 2]>,
    /// `line`: where it ends.
    #[serde(default)]
    to: Option<[f64; 2]>,
    /// `arc`: centre of its circle.
    #[serde(default)]
    centre: Option<[f64; 2]>,
    /// `arc`: how far it turns, rad, positive to starboard, up to a full circle.
    #[serde(default)]
    angle_rad: Option<f64>,
    /// `waypoints`: where its straight legs would meet.
    #[serde(default)]
    points: Option<Vec<[f64; 2]>>,
    /// `waypoints`: radius by which corners are rounded, m; 0 only where no leg turns.
    #[serde(default)]
    fillet_m: Option<f64>,
}

/// The kinds of segments.
#[derive(Clone, Copy, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
enum SegmentKind {
    /// A straight line: `from`, `to`.
    Line,
    /// Part of a circle: `from`, `centre`, `angle_rad`.
    Arc,
    /// Straight legs with rounded corners: `points`, `fillet_m`.
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
                fillet_m: needed(&mut given.fillet_m, "fillet_m")?,
            },
        };
        none_left(&[
            ("from", given.from.is_some()),
            ("to", given.to.is_some()),
            ("centre", given.centre.is_some()),
            ("angle_rad", given.angle_rad.is_some()),
            ("points", given.points.is_some()),
            ("fillet_m", given.fillet_m.is_some()),
        ])?;
        Ok(segment)
    }
}

schema_of!(Segment: SegmentMembers, "Segment");

/// Why segments make no path: the first field at fault, as slash-separated names (`segments/2/points/0/1` is
/// the east of the first point of the third segment).
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{0}")]
pub struct InvalidPath(pub InvalidField);

impl Segment {
    /// How many segments it counts as: every way-point as one.
    #[must_use]
    pub fn count(&self) -> usize {
        match self {
            Self::Line { .. } | Self::Arc { .. } => 1,
            Self::Waypoints { points, .. } => points.len(),
        }
    }

    pub(crate) fn pieces(&self) -> Vec<Piece> {
        self.pieces_of(false)
    }

    pub(super) fn check(&self, field: &str, ring: bool) -> Result<(), InvalidPath> {
        match self {
            Self::Line { from, to } => {
                require_point(&format!("{field}/from"), from)?;
                require_point(&format!("{field}/to"), to)?;
                let length = between(from, to).norm();
                require_within(&format!("{field}/to"), length, LENGTH_MIN, LENGTH_MAX)
            }
            Self::Arc {
                from,
                centre,
                angle_rad,
            } => {
                require_point(&format!("{field}/from"), from)?;
                require_point(&format!("{field}/centre"), centre)?;
                let radius = between(centre, from).norm();
                require_within(&format!("{field}/centre"), radius, LENGTH_MIN, LENGTH_MAX)?;
                let (field, least) = (format!("{field}/angle_rad"), LENGTH_MIN / radius);
                require_within(&field, angle_rad.abs(), least, ARC_ANGLE_MAX)
            }
            Self::Waypoints { points, fillet_m } => Legs::new(points, ring).check(field, *fillet_m),
        }
    }

    pub(super) fn pieces_of(&self, ring: bool) -> Vec<Piece> {
        match self {
            Self::Line { from, to } => {
                let along = between(from, to);
                vec![Piece::line(Vector2::from(*from), angle_of(&along), along.norm())]
            }
            Self::Arc {
                from,
                centre,
                angle_rad,
            } => {
                let to_centre = between(from, centre);
                let tangent = angle_of(&to_centre) - FRAC_PI_2.copysign(*angle_rad);
                vec![Piece::arc(
                    Vector2::from(*from),
                    tangent,
                    to_centre.norm(),
                    *angle_rad,
                )]
            }
            Self::Waypoints { points, fillet_m } => Legs::new(points, ring).pieces(*fillet_m),
        }
    }
}

/// The vector from one point to another, m.
fn between(from: &[f64; 2], to: &[f64; 2]) -> Vector2<f64> {
    Vector2::from(*to) - Vector2::from(*from)
}

/// Straight legs between points, and the corners between them.
struct Legs {
    points: Vec<Vector2<f64>>,
    /// Whether there is a leg from the last point to the first.
    ring: bool,
}

impl Legs {
    fn new(points: &[[f64; 2]], ring: bool) -> Self {
        let points = points.iter().map(|point| Vector2::from(*point)).collect();
        Self { points, ring }
    }

    /// Number of legs; the k-th begins at the k-th point.
    fn n(&self) -> usize {
        self.points.len() - usize::from(!self.ring)
    }

    fn vector(&self, leg: usize) -> Vector2<f64> {
        self.points[(leg + 1) % self.points.len()] - self.points[leg]
    }

    /// Change of direction at a point, rad, positive to starboard; 0 at the ends.
    fn turn(&self, point: usize) -> f64 {
        if !self.ring && (point == 0 || point + 1 == self.points.len()) {
            return 0.0;
        }
        let before = (point + self.points.len() - 1) % self.points.len();
        wrap(angle_of(&self.vector(point)) - angle_of(&self.vector(before)))
    }

    /// How much of both legs a fillet of radius 1 at a point takes: tan(|θ| / 2).
    fn tangent_length(&self, point: usize) -> f64 {
        (0.5 * self.turn(point % self.points.len()).abs()).tan()
    }

    pub(super) fn check(&self, field: &str, radius: f64) -> Result<(), InvalidPath> {
        let n_least = if self.ring { 3 } else { 2 };
        require_count(
            &format!("{field}/points"),
            self.points.len(),
            n_least..=SEGMENTS_MAX,
        )?;
        for (k, point) in self.points.iter().enumerate() {
            require_point(&format!("{field}/points/{k}"), &[point.x, point.y])?;
        }
        for leg in 0..self.n() {
            let field = format!("{field}/points/{}", (leg + 1) % self.points.len());
            require_within(&field, self.vector(leg).norm(), LENGTH_MIN, LENGTH_MAX)?;
        }
        if radius == 0.0 {
            return (0..self.points.len())
                .try_for_each(|k| require_straight(&format!("{field}/points/{k}"), self.turn(k)));
        }
        require_within(&format!("{field}/fillet_m"), radius, LENGTH_MIN, LENGTH_MAX)?;
        self.check_room(field, radius)
    }

    /// Both fillets of every leg must fit on it. Names the sharper corner of the leg that has the least room.
    fn check_room(&self, field: &str, radius: f64) -> Result<(), InvalidPath> {
        let room =
            |leg: usize| self.vector(leg).norm() / (self.tangent_length(leg) + self.tangent_length(leg + 1));
        let tightest = (0..self.n()).min_by(|a, b| room(*a).total_cmp(&room(*b)));
        let Some(leg) = tightest else { return Ok(()) };
        let most = room(leg);
        // A polygon whose fillets use up its legs is all right, whatever the rounding.
        if radius <= most * (1.0 + LENGTH_OF_ROUNDING) {
            return Ok(());
        }
        let sharper = if self.tangent_length(leg) < self.tangent_length(leg + 1) {
            (leg + 1) % self.points.len()
        } else {
            leg
        };
        let given = radius;
        Err(invalid(
            &format!("{field}/points/{sharper}"),
            InvalidReason::Fillet { given, most },
        ))
    }

    fn pieces(&self, radius: f64) -> Vec<Piece> {
        let mut pieces = Vec::new();
        for leg in 0..self.n() {
            let along = self.vector(leg);
            let tangent = angle_of(&along);
            let (before, after) = (
                radius * self.tangent_length(leg),
                radius * self.tangent_length(leg + 1),
            );
            let start = self.points[leg] + direction(tangent) * before;
            let length = along.norm() - before - after;
            if LENGTH_OF_ROUNDING < length {
                pieces.push(Piece::line(start, tangent, length));
            }
            let turn = self.turn((leg + 1) % self.points.len());
            if LENGTH_OF_ROUNDING < radius * turn.abs() {
                let corner = self.points[leg] + along;
                let start = corner - direction(tangent) * after;
                pieces.push(Piece::arc(start, tangent, radius, turn));
            }
        }
        pieces
    }
}

pub(super) fn require_straight(field: &str, turn: f64) -> Result<(), InvalidPath> {
    let (given, most) = (turn.abs(), KINK_MAX);
    if most < given {
        return Err(invalid(field, InvalidReason::Kink { given, most }));
    }
    Ok(())
}

fn require_point(field: &str, [north, east]: &[f64; 2]) -> Result<(), InvalidPath> {
    require_within(&format!("{field}/0"), *north, -COORDINATE_MAX, COORDINATE_MAX)?;
    require_within(&format!("{field}/1"), *east, -COORDINATE_MAX, COORDINATE_MAX)
}

pub(super) fn require_count(
    field: &str,
    given: usize,
    range: std::ops::RangeInclusive<usize>,
) -> Result<(), InvalidPath> {
    if range.contains(&given) {
        return Ok(());
    }
    let (least, most) = range.into_inner();
    Err(invalid(field, InvalidReason::Length { given, least, most }))
}

pub(crate) fn require_within(field: &str, given: f64, least: f64, most: f64) -> Result<(), InvalidPath> {
    if (least..=most).contains(&given) {
        return Ok(());
    }
    Err(invalid(field, InvalidReason::OutOfRange { given, least, most }))
}

pub(crate) fn invalid(field: &str, reason: InvalidReason) -> InvalidPath {
    InvalidPath(InvalidField {
        field: field.to_owned(),
        reason,
    })
}
