//! Bounds of the craft's position: keep-outs, area, acoustic range, distance to surfaced AUVs.

use std::f64::consts::{FRAC_PI_2, TAU};
use std::fmt::Display;

use nalgebra::Vector2;
use serde::{Deserialize, Serialize};
use serde_json::json;
use serde_with::skip_serializing_none;
use utoipa::ToSchema;

use crate::facts::{
    field_error::FieldError,
    ranges::{ACOUSTIC_RANGE, AREA_CORNERS, COORDINATE_MAX, KEEP_OUT, KEEP_OUTS_MAX, SURFACING_SEPARATION},
};

/// Shortest side and least width of an area, and side of the smallest square, m.
pub(crate) const SIZE_MIN: f64 = 0.1;

/// Largest turn of a corner to the wrong side, rad, for rounded corners on a straight side: a side
/// of a kilometre then leaves the area by a millimetre.
const STRAIGHT: f64 = 1.0e-6;

/// Largest distance of a corner within the sides of an area, m; the area then omits the corner.
/// Degrees of six decimals are 0.11 m apart and move a corner of a straight side inwards by up to
/// 0.16 m; a side of 2 km along a parallel at 60° bends by 0.14 m.
const DENT_MAX: f64 = 0.2;

/// A disc to keep out of.
#[skip_serializing_none]
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct KeepOut {
    /// Its centre, north of the datum, m.
    pub north_m: f64,
    /// Its centre, east of the datum, m.
    pub east_m: f64,
    /// Latitude of its centre, degrees, positive north. Needs `origin`, as in other positions.
    pub lat_deg: Option<f64>,
    /// Longitude of its centre, degrees, positive east.
    pub lon_deg: Option<f64>,
    /// Its radius, m.
    pub radius_m: f64,
}

impl KeepOut {
    /// A disc about `centre` (north, east), m, of `radius`, m.
    pub fn new(centre: Vector2<f64>, radius: f64) -> Self {
        Self { north_m: centre.x, east_m: centre.y, lat_deg: None, lon_deg: None, radius_m: radius }
    }

    /// Its centre (north, east), m.
    pub fn centre(&self) -> Vector2<f64> {
        Vector2::new(self.north_m, self.east_m)
    }
}

/// All faults of the bounds of a request, by field.
pub fn bounds_faults(
    keep_outs: &[KeepOut],
    area: &[Vector2<f64>],
    range_max: Option<f64>,
) -> Vec<FieldError> {
    let n = keep_outs.len();
    let mut faults = Vec::from_iter(FieldError::of_length("/keep_outs", n, &(0..=KEEP_OUTS_MAX), "items"));
    for (i, disc) in keep_outs.iter().enumerate() {
        let numbers = [disc.north_m, disc.east_m, disc.radius_m];
        for ((name, range), given) in KEEP_OUT.into_iter().zip(numbers) {
            faults.extend(FieldError::outside(format_args!("/keep_outs/{i}/{name}"), given, &range));
        }
    }
    faults.extend(area_faults(area));
    if let Some(range) = range_max {
        faults.extend(FieldError::outside("/acoustics/range_max_m", range, &ACOUSTIC_RANGE));
    }
    faults
}

/// The fault of the distance to keep from AUVs at the surface, if any.
pub(crate) fn separation_fault(separation: Option<f64>) -> Option<FieldError> {
    FieldError::outside("/surfacing_separation_m", separation?, &SURFACING_SEPARATION)
}

/// Corners of a checked area without its dents, clockwise, from the first remaining one.
pub fn clockwise(area: &[Vector2<f64>]) -> Vec<Vector2<f64>> {
    let mut border: Vec<_> = border(area).into_iter().map(|i| area[i]).collect();
    if doubled_area(area) < 0.0 {
        border[1..].reverse();
    }
    border
}

/// Indices of the corners of `area` without those at most [`DENT_MAX`] within its sides.
fn border(area: &[Vector2<f64>]) -> Vec<usize> {
    let mut kept: Vec<usize> = (0..area.len()).collect();
    let orientation = doubled_area(area).signum();
    // The corners before and after the k-th.
    let around = |kept: &[usize], k: usize| {
        let n = kept.len();
        [kept[(k + n - 1) % n], kept[(k + 1) % n]]
    };
    let is_dent = |kept: &[usize], k: usize| {
        let [before, after] = around(kept, k);
        let turn = orientation * turn(area[before], area[kept[k]], area[after]);
        let side = (area[after] - area[before]).normalize();
        // Corners removed earlier are within the new side too.
        let mut between =
            (before + 1..after + area.len() * usize::from(after < before)).map(|i| area[i % area.len()]);
        (-FRAC_PI_2..-STRAIGHT).contains(&turn)
            && between.all(|corner| side.perp(&(corner - area[before])).abs() <= DENT_MAX)
    };
    while let Some(k) = (0..kept.len()).find(|k| 3 < kept.len() && is_dent(&kept, *k)) {
        kept.remove(k);
    }
    kept
}

/// Change of direction of a border at `corner`, rad, positive clockwise seen from above.
fn turn(before: Vector2<f64>, corner: Vector2<f64>, after: Vector2<f64>) -> f64 {
    let (before, after) = (corner - before, after - corner);
    before.perp(&after).atan2(before.dot(&after))
}

fn area_faults(area: &[Vector2<f64>]) -> Vec<FieldError> {
    if area.is_empty() {
        return Vec::new();
    }
    if let Some(fault) = FieldError::of_length("/area", area.len(), &AREA_CORNERS, "items") {
        return vec![fault];
    }
    let mut faults = Vec::new();
    for (i, corner) in area.iter().enumerate() {
        for (axis, given) in [corner.x, corner.y].into_iter().enumerate() {
            let range = -COORDINATE_MAX..=COORDINATE_MAX;
            faults.extend(FieldError::outside(format_args!("/area/{i}/{axis}"), given, &range));
        }
    }
    // Numbers that are not finite have no sides to measure.
    if faults.is_empty() {
        faults.extend(shape_fault(area));
    }
    faults
}

/// The first reason why `area` is not the border of a convex area, once round.
fn shape_fault(area: &[Vector2<f64>]) -> Option<FieldError> {
    let n = area.len();
    let side = |i: usize| area[(i + 1) % n] - area[i % n];
    for i in 0..n {
        let too_near = too_near(format_args!("/area/{}", (i + 1) % n), side(i).norm());
        if too_near.is_some() {
            return too_near;
        }
    }
    let given = (0..n).map(|i| width_from(area, i)).fold(f64::INFINITY, f64::min);
    if given < SIZE_MIN {
        let detail = format!("the area is only {given} m wide, less than {SIZE_MIN} m");
        return Some(too_small("/area", "too_narrow", detail, given));
    }
    let kept = border(area);
    let orientation = doubled_area(area).signum();
    let mut turned = 0.0;
    for (k, &i) in kept.iter().enumerate() {
        let corner = |k: usize| area[kept[k % kept.len()]];
        // The sign is relative to the direction in which this area goes round.
        let given = orientation * turn(corner(k + kept.len() - 1), area[i], corner(k + 1));
        turned += given;
        // Rounding adds up to far less than this radian, which tells one turn from two.
        if given < -STRAIGHT || TAU + 1.0 < turned {
            let detail =
                format!("turns by {given} rad: the corners, in order, must go once round a convex area");
            let fault = FieldError::new(format_args!("/area/{i}"), "not_convex", detail);
            return Some(fault.given(given).limit(json!({ "least": 0.0 })));
        }
    }
    None
}

/// The fault of a corner at a distance `given`, m, from the corner before it: too near.
pub(crate) fn too_near(place: impl Display, given: f64) -> Option<FieldError> {
    let detail =
        format!("is {given} m from the corner before it, less than {SIZE_MIN} m: give every corner once");
    (given < SIZE_MIN).then(|| too_small(place, "too_near", detail, given))
}

pub(crate) fn too_small(place: impl Display, code: &str, detail: String, given: f64) -> FieldError {
    FieldError::new(place, code, detail).given(given).limit(json!({ "least": SIZE_MIN }))
}

/// Distance of the farthest corner from the line along side `i`, m.
fn width_from(area: &[Vector2<f64>], i: usize) -> f64 {
    let along = (area[(i + 1) % area.len()] - area[i]).normalize();
    let across = area.iter().map(|corner| along.perp(&(corner - area[i])).abs());
    across.fold(0.0, f64::max)
}

/// Twice the enclosed area, m², positive if the corners go clockwise seen from above.
pub(crate) fn doubled_area(area: &[Vector2<f64>]) -> f64 {
    // Relative to a corner: far from the datum the differences would lose their digits.
    area.windows(2).map(|pair| (pair[0] - area[0]).perp(&(pair[1] - area[0]))).sum()
}

#[cfg(test)]
mod tests {
    use serde_json::Value;

    use super::*;
    use crate::facts::angle::direction;

    fn corners(points: &[[f64; 2]]) -> Vec<Vector2<f64>> {
        points.iter().map(|point| Vector2::from(*point)).collect()
    }

    /// The place and the code of the only fault of an area, and the number that it is about.
    fn fault(points: &[[f64; 2]]) -> Option<(String, String, Option<f64>)> {
        let faults = area_faults(&corners(points));
        assert!(faults.len() < 2, "{faults:?}");
        let number = |given: Value| given.as_f64();
        let parts = |fault: FieldError| (fault.pointer, fault.code, fault.given.and_then(number));
        faults.into_iter().next().map(parts)
    }

    const SQUARE: [[f64; 2]; 4] = [[0.0, 0.0], [100.0, 0.0], [100.0, 50.0], [0.0, 50.0]];

    #[test]
    fn a_convex_area_may_go_in_either_direction_and_have_corners_on_its_sides() {
        let [a, b, c, d] = SQUARE;
        // A third along two of the sides, with the rounding of doubles.
        let dense = [a, [100.0 / 3.0, 0.0], b, c, d, [0.0, 50.0 / 3.0]];
        for area in [&[a, b, c, d][..], &[d, c, b, a], &dense] {
            assert_eq!(fault(area), None);
        }
    }

    fn is_not_convex(points: &[[f64; 2]]) -> bool {
        fault(points).is_some_and(|(_, code, _)| code == "not_convex")
    }

    #[test]
    fn a_corner_that_turns_the_other_way_is_named_for_both_directions_of_the_area() {
        let mut points = vec![SQUARE[0], SQUARE[1], [40.0, 20.0], SQUARE[2], SQUARE[3]];
        let (place, code, turn) = fault(&points).expect("a notch");
        assert_eq!((&*place, &*code), ("/area/2", "not_convex"));
        assert!(turn.is_some_and(|turn| turn < -0.5));
        points.reverse();
        assert_eq!(fault(&points).expect("a notch").0, "/area/2");
    }

    #[test]
    fn a_stored_area_goes_clockwise_without_corners_that_rounding_put_within_its_sides() {
        let with = |inside: &[[f64; 2]]| [&[SQUARE[0]], inside, &SQUARE[1..]].concat();
        // The largest dent is measured from the whole side, not from corners removed earlier.
        let bent = |depth: f64| {
            let corner = |along: f64| [100.0 * along, 4.0 * depth * along * (1.0 - along)];
            (1..10).map(|k| corner(f64::from(k) / 10.0)).collect::<Vec<_>>()
        };
        for inside in [vec![[50.0, 0.01]], vec![[30.0, 0.19]], bent(0.19), bent(-0.01)] {
            let mut area = with(&inside);
            let is_outside = inside[0][1] < 0.0;
            let expected = if is_outside { area.clone() } else { SQUARE.to_vec() };
            for _ in 0..2 {
                assert_eq!(fault(&area), None, "{inside:?}");
                assert_eq!(clockwise(&corners(&area)), corners(&expected));
                area[1..].reverse();
            }
        }
        assert!(clockwise(&[]).is_empty());
        for inside in [vec![[50.0, 0.21]], bent(0.3), vec![[110.0, 0.01], [60.0, -0.01]]] {
            assert!(is_not_convex(&with(&inside)), "{inside:?}");
        }
    }

    #[test]
    fn a_border_that_goes_round_twice_or_crosses_itself_is_not_convex() {
        let corner = |k| direction(f64::from(k) * 0.8 * std::f64::consts::PI) * 100.0;
        let star: Vec<_> = (0..5).map(|k| corner(k).into()).collect();
        let (_, code, turn) = fault(&star).expect("a pentagram turns twice");
        assert_eq!(code, "not_convex");
        assert!(turn.is_some_and(|turn| turn > 0.0));
        assert!(is_not_convex(&[SQUARE[0], SQUARE[2], SQUARE[1], SQUARE[3]]));
    }

    #[test]
    fn non_finite_numbers_and_wrong_sizes_are_faults() {
        let disc = |radius| KeepOut::new(Vector2::new(1.0, f64::NAN), radius);
        let (discs, area) = ([disc(1.0), disc(0.05)], corners(&[[0.0; 2]; 2]));
        let faults = bounds_faults(&discs, &area, Some(f64::INFINITY)).into_iter();
        let expected = [
            "/keep_outs/0/east_m",
            "/keep_outs/1/east_m",
            "/keep_outs/1/radius_m",
            "/area",
            "/acoustics/range_max_m",
        ];
        assert_eq!(faults.map(|fault| fault.pointer).collect::<Vec<_>>(), expected);
        let endless = fault(&[[0.0, 0.0], [1.0, f64::INFINITY], [2.0, 0.0]]);
        assert_eq!(endless.expect("not finite").0, "/area/1/1");
        let (_, code, given) = fault(&[[0.0; 2]; 65]).expect("too many");
        assert_eq!((&*code, given), ("length", Some(65.0)));
    }
}
