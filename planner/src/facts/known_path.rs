//! A path that an AUV is known to follow, the AUV's place on it, and its speed along it.

use std::{f64::consts::PI, sync::Arc};

use nalgebra::Vector2;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::facts::{
    angle::{direction, ned_from_body},
    evidence::{AuvState, SPEED_AT_REST},
    path::{curve::Path, limits::InvalidPath, piece::PathPoint, segment::Segment, waypoints::Overshot},
};

/// A path that an underwater vehicle is known to follow.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
#[schema(as = Path)]
pub struct DeclaredPath {
    /// Segments in order. Each begins where the previous one ends, in the same direction, to a
    /// millimetre and a milliradian. At most 10,000; every way-point counts as one.
    pub segments: Vec<Segment>,
    /// `true` if the last segment leads to the first again; way-points alone return to their first
    /// point by themselves. An open path continues straight. Default: `false`.
    #[serde(default)]
    pub closed: bool,
    /// Horizontal speed through the water, m/s, on legs without their own.
    pub speed_mps: f64,
}

/// Rates of turn of vehicles without a declared radius, rad/s. The first counts until a turn was
/// observed. Assumption: survey AUVs of 1.5 m/s turn at 10 m, others at up to 27 m.
pub(crate) const TURN_RATES: [f64; 3] = [0.15, 0.09, 0.055];

/// Least turn of a corner that is not cut, rad: its arc would begin 1.7 radii from the way-point.
const SHARP_FROM: f64 = PI * 2.0 / 3.0;

/// Rate of turn at such a corner of a vehicle that cuts others, rad/s.
const SHARP_TURN_RATE: f64 = 0.6;

/// Most way-points of a path tried at several rates: 1,000 corners take as long as the filters.
const OTHER_RATES_COUNT_MAX: usize = 1000;

impl DeclaredPath {
    /// A `path` followed at a horizontal speed through the water, m/s.
    pub fn new(path: &Path, speed_mps: f64) -> Self {
        Self { segments: path.segments().to_vec(), closed: path.is_closed(), speed_mps }
    }

    /// Number of segments; every way-point counts as one, and so does an empty list.
    pub(crate) fn count(&self) -> usize {
        let of = |segment: &Segment| segment.count().max(1);
        self.segments.iter().map(of).sum()
    }

    /// Radius of turns at way-points without their own, m.
    pub fn turn_radius(&self) -> f64 {
        self.speed_mps / TURN_RATES[0]
    }

    /// The path, if its segments join; [`Self::turn_radius`] applies without a declared one.
    pub fn path(&self) -> Result<Path, InvalidPath> {
        self.turned_at(self.turn_radius(), None)
    }

    /// The same with a `radius`, m, at way-points without their own.
    fn turned_at(&self, radius: f64, overshot: Option<Overshot>) -> Result<Path, InvalidPath> {
        let mut segments = self.segments.clone();
        for unnamed in segments.iter_mut().filter_map(unnamed_radius) {
            *unnamed = Some(radius);
        }
        Path::turned(&segments, self.closed, overshot)
    }

    pub(crate) fn known(&self) -> Result<KnownPath, InvalidPath> {
        Ok(self.with_path(self.path()?))
    }

    fn with_path(&self, path: Path) -> KnownPath {
        KnownPath { path: Arc::new(path), horizontal_speed: self.speed_mps }
    }

    /// The same path for other ways to turn, the likeliest first; none if it declares its radii.
    pub(crate) fn with_other_turn_radii(&self) -> Vec<KnownPath> {
        let leaves_open = |segment: &Segment| {
            matches!(segment, Segment::Waypoints { fillet_m: None, turn_radius_m: None, .. })
        };
        if OTHER_RATES_COUNT_MAX < self.count() || !self.segments.iter().any(leaves_open) {
            return Vec::new();
        }
        let radii = TURN_RATES.iter().map(|rate| self.speed_mps / rate);
        let sharp = Overshot { from: SHARP_FROM, radius: self.speed_mps / SHARP_TURN_RATE };
        let cut = radii.clone().map(|radius| (radius, sharp));
        let overshot = radii.map(|radius| (radius, Overshot { from: 0.0, radius }));
        let paths = cut.chain(overshot).flat_map(|(radius, overshot)| self.turned_at(radius, Some(overshot)));
        paths.map(|path| self.with_path(path)).collect()
    }
}

/// The undeclared radius of a segment of way-points.
fn unnamed_radius(segment: &mut Segment) -> Option<&mut Option<f64>> {
    match segment {
        Segment::Waypoints { fillet_m: None, turn_radius_m: radius @ None, .. } => Some(radius),
        _ => None,
    }
}

/// A path that an AUV follows, and its speed.
#[derive(Clone, Debug, PartialEq)]
pub struct KnownPath {
    /// The path.
    pub path: Arc<Path>,
    /// Horizontal speed through the water `u_h` on legs without their own, m/s.
    #[doc(alias = "u_h")]
    pub horizontal_speed: f64,
}

impl KnownPath {
    pub(crate) fn speed_at(&self, point: &PathPoint) -> f64 {
        point.leg.speed_mps.unwrap_or(self.horizontal_speed)
    }
}

/// Largest distance at which an AUV is on its path, m. Assumption: ten σ of an acoustic fix.
pub(crate) const OFFSET_FROM_PATH_MAX: f64 = 15.0;

/// Position uncertainty in the search for the place, m: two standard deviations of an acoustic fix
/// (1.5 m), or a follower's offset in a current. Within it, the course is decisive.
const POSITION_UNCERTAINTY: f64 = 3.0;

/// Ratio by which a place that leads against the reported course must be closer than one along it.
/// Assumption: lanes of a lawn-mower are distinguished up to four fifths of the way between them.
const WRONG_WAY: f64 = 4.0;

/// Arc length of a vehicle on its known path: the closest place, where those against its
/// course count as farther away.
pub(crate) fn place_on_path(state: &AuvState, known: &KnownPath, current: &Vector2<f64>) -> f64 {
    known.path.closest_by(&state.position(), |distance, point| {
        // Against a strong current the vehicle moves backwards along its path.
        let forward = speed_along(known.speed_at(point), current, point.tangent).signum();
        let agreement = if state.speed_mps < SPEED_AT_REST {
            1.0
        } else {
            (direction(point.tangent) * forward).dot(&state.course().unit())
        };
        (distance + POSITION_UNCERTAINTY) * (1.0 + (WRONG_WAY - 1.0) * 0.5 * (1.0 - agreement))
    })
}

/// Least ratio of a vehicle's speed over ground to that of its foot on a bend of its path. The foot
/// of a vehicle far inside a bend is fast, at the centre infinitely so. At half the radius it has
/// twice the vehicle's speed; farther inside, a vehicle does not follow the bend.
pub(crate) const FOOT_FACTOR_MIN: f64 = 0.5;

/// Speed of the vehicle's place on a path with this `tangent`, m/s; `sense` −1: backwards.
pub(crate) fn foot_speed(u_h: f64, current: &Vector2<f64>, tangent: f64, sense: f64) -> f64 {
    if sense < 0.0 { -speed_along(u_h, current, tangent + PI) } else { speed_along(u_h, current, tangent) }
}

/// Speed over ground along a tangent, m/s, at `u_h` through the water in a `current`, m/s.
pub(crate) fn speed_along(u_h: f64, current: &Vector2<f64>, tangent: f64) -> f64 {
    let in_path_frame = ned_from_body(tangent).transpose() * current;
    let (along, across) = (in_path_frame.x, in_path_frame.y);
    along + (u_h * u_h - across * across).max(0.0).sqrt()
}
