use std::f64::consts::{PI, TAU};

use serde_json::Value;

use super::*;
use crate::{facts::path::piece::Piece, tests::prelude::*};

fn mower() -> Path {
    Path::lawn_mower(Vector2::new(3.0, -2.0), 0.4, 50.0, 20.0, 4)
}

fn points<const N: usize>(points: [(f64, f64); N]) -> [Vector2<f64>; N] {
    points.map(|(n, e)| Vector2::new(n, e))
}

fn square(fillet_radius: f64) -> Result<Path, InvalidPath> {
    let corners = points([(0.0, 0.0), (40.0, 0.0), (40.0, 30.0), (0.0, 30.0)]);
    Path::waypoints(&corners, fillet_radius, true)
}

fn corners_of_zigzag() -> [Vector2<f64>; 5] {
    points([(0.0, 0.0), (30.0, 5.0), (35.0, -20.0), (70.0, -20.0), (80.0, 15.0)])
}

fn zigzag() -> Path {
    Path::waypoints(&corners_of_zigzag(), 4.0, false).expect("fits")
}

/// Way-points of a real plan: corners of any angle, short legs, a repeated point, a reversal.
fn turning(radius: f64, closed: bool) -> Path {
    let first = [(0.0, 0.0), (60.0, 5.0), (60.0, 5.0), (62.0, 5.0), (62.0, 7.0)];
    let then = [(10.0, 7.5), (45.0, 40.0), (45.0, 0.0), (45.0, 40.0)];
    route(&[&first[..], &then].concat(), radius, closed).expect("is a path")
}

fn route(points: &[(f64, f64)], radius: f64, closed: bool) -> Result<Path, InvalidPath> {
    let waypoints = Segment::Waypoints {
        points: points.iter().map(|(north, east)| [*north, *east]).collect(),
        fillet_m: None,
        turn_radius_m: Some(radius),
        legs: vec![],
    };
    Path::from_segments(&[waypoints], closed)
}

fn several() -> [Path; 6] {
    let circle = Path::circle(Vector2::new(10.0, 20.0), 15.0, Side::Port, 0.3);
    [
        mower(),
        zigzag(),
        square(6.0).expect("fits"),
        circle.expect("is one"),
        turning(6.0, false),
        turning(3.0, true),
    ]
}

/// Numbers in [0, 1): the fractions of multiples of the golden ratio and of √2.
fn scattered(k: u32) -> (f64, f64) {
    let k = f64::from(k);
    ((k * 0.618_033_988_75).fract(), (k * 0.414_213_562_37).fract())
}

#[test]
fn arc_length_tangent_and_curvature_agree_with_finite_differences() {
    let h = 1e-4;
    for path in several() {
        // Beyond both ends; a closed path continues its laps.
        for gamma in [-5.3, 10.1, 55.2, 70.4, 100.7, 140.9, 301.3] {
            let (_, local) = path.lap_of(gamma);
            let off_joints =
                |piece: &Piece| (local - piece.from).abs() > h && (local - piece.end()).abs() > h;
            assert!(path.pieces.iter().all(off_joints), "the curvature jumps at {gamma}");
            // h²/6 κ² of the central difference, and rounding of 10² m over h.
            let moves = slope(|gamma| path.at(gamma).position, gamma, h);
            near_to(moves, direction(path.at(gamma).tangent), 1e-7);
            let turns = path.at(gamma + h).tangent - path.at(gamma - h).tangent;
            near(turns / (2.0 * h), path.at(gamma).curvature, 1e-7);
        }
    }
}

#[test]
fn the_path_and_its_tangent_are_continuous_also_at_the_seam() {
    for path in several() {
        for piece in &path.pieces {
            for lap in [-2.0, 0.0, 1.0] {
                let lap = if path.is_closed() { lap } else { 0.0 };
                for joint in [piece.from, piece.end()].map(|joint| joint + lap * path.length()) {
                    let (before, after) = (path.at(joint - 1e-9), path.at(joint + 1e-9));
                    near_to(before.position, after.position, 1e-8);
                    near(before.tangent, after.tangent, 1e-8);
                }
            }
        }
    }
}

#[test]
fn a_closed_path_repeats_its_points_while_its_tangent_keeps_growing() {
    for (path, turn) in [(square(6.0).expect("fits"), TAU), (several()[3].clone(), -TAU)] {
        for gamma in [-31.0, 0.0, 17.0, 60.0] {
            let (here, again) = (path.at(gamma), path.at(gamma + 3.0 * path.length()));
            near_to(here.position, again.position, 1e-9);
            near(again.tangent - here.tangent, 3.0 * turn, 1e-9);
        }
    }
}

#[test]
fn lanes_are_one_spacing_apart_and_alternate_in_direction() {
    let path = Path::lawn_mower(Vector2::zeros(), 0.0, 50.0, 20.0, 3);
    near_to(path.at(50.0 + 10.0 * PI).position, Vector2::new(50.0, 20.0), 1e-9);
    near_to(path.at(path.length()).position, Vector2::new(50.0, 40.0), 1e-9);
    near(path.length(), 150.0 + 20.0 * PI, 1e-9);
}

#[test]
fn a_fillet_shortens_each_corner_by_two_tangents_less_an_arc() {
    // L = Σ legs − Σ 2 r tan(θ/2) + Σ r θ, with the corners' angles by the law of cosines.
    let points = corners_of_zigzag();
    let legs: f64 = points.windows(2).map(|leg| (leg[1] - leg[0]).norm()).sum();
    let rounding = points.windows(3).map(|corner: &[Vector2<f64>]| {
        let (a, b) = (corner[1] - corner[0], corner[2] - corner[1]);
        let theta = f64::acos(a.dot(&b) / (a.norm() * b.norm()));
        4.0 * theta - 8.0 * (theta / 2.0).tan()
    });
    near(zigzag().length(), legs + rounding.sum::<f64>(), 1e-9);
    // A rectangle of 40 by 30 m: four quarter circles make one circle.
    let path = square(6.0).expect("fits");
    near(path.length(), 140.0 - 8.0 * 6.0 + TAU * 6.0, 1e-9);
    for (gamma, north, east) in [(0.0, 6.0, 0.0), (28.0, 34.0, 0.0), (28.0 + 3.0 * PI, 40.0, 6.0)] {
        near_to(path.at(gamma).position, Vector2::new(north, east), 1e-9);
    }
}

#[test]
fn the_closest_point_agrees_with_a_search_on_the_whole_path_and_nearby() {
    for path in several() {
        for k in 0..200 {
            let ((a, b), (c, d)) = (scattered(k), scattered(k + 1_000));
            let position = Vector2::new(160.0 * a - 50.0, 160.0 * b - 50.0);
            let distance = |gamma: f64| (path.at(gamma).position - position).norm();
            // Steps of 2 cm: a search misses the best point by at most half of one.
            let searched = |from: f64, to: f64, n: u32| {
                let gamma = |i: u32| from + (to - from) * f64::from(i) / f64::from(n);
                (0..=n).map(|i| distance(gamma(i))).fold(f64::INFINITY, f64::min)
            };
            let gamma = path.closest(&position);
            let inside = distance(gamma.clamp(0.0, path.length()));
            let least = searched(0.0, path.length(), 19_999);
            assert!(inside <= least + 1e-9, "{position} {gamma} {least}");
            assert!(least <= inside + 0.011 && distance(gamma) <= inside + 1e-9);
            let (around, mut reach) = (path.length() * (1.4 * c - 0.2), 1.0 + 40.0 * d);
            let gamma = path.closest_near(&position, around, reach);
            assert!((gamma - around).abs() <= reach + 1e-9);
            if path.is_closed() {
                reach = reach.min(0.5 * path.length());
            }
            let least = searched(around - reach, around + reach, 4_000);
            assert!(distance(gamma) <= least + 1e-9, "{gamma} around {around}");
            assert!(least <= distance(gamma) + 0.011);
        }
    }
}

#[test]
fn a_position_beyond_an_end_has_its_foot_on_the_continuation() {
    let path = Path::starting_at(Vector2::zeros(), 0.0).line(50.0);
    near(path.closest(&Vector2::new(-7.0, 2.0)), -7.0, 1e-12);
    near(path.closest(&Vector2::new(58.0, -2.0)), 58.0, 1e-12);
}

#[test]
fn a_path_from_its_own_segments_or_lines_and_arcs_is_the_same() {
    for path in several() {
        let again = Path::from_segments(path.segments(), path.is_closed());
        assert_eq!(again, Ok(path.clone()), "to the bit");
        let pieces: Vec<Segment> = path.lines_and_arcs().collect();
        let again = Path::from_segments(&pieces, path.is_closed()).expect("they join");
        for gamma in (0..100).map(|k| path.length() * f64::from(k) / 99.0) {
            near_to(path.at(gamma).position, again.at(gamma).position, 1e-6);
        }
    }
}

/// The place and the code of a fault, the number that it is about and the largest one accepted.
fn refused(path: Result<Path, InvalidPath>) -> (String, String, f64, f64) {
    let fault = path.expect_err("is none");
    let number = |value: &Value| value.as_f64();
    let given = fault.given.as_ref().and_then(number);
    let most = fault.limit.as_ref().and_then(|limit| number(&limit["most"]));
    (fault.pointer, fault.code, given.unwrap_or(f64::NAN), most.unwrap_or(f64::NAN))
}

#[test]
fn a_fillet_without_room_is_refused_with_the_largest_possible_radius() {
    let (place, code, given, most) = refused(square(15.1));
    // Two right angles on the leg of 30 m: 15 m each.
    assert_eq!(code, "fillet");
    assert!(place.starts_with("/segments/0/points/") && given == 15.1);
    near(most, 15.0, 1e-9);
    assert!(square(most).is_ok());
    let back = points([(0.0, 0.0), (30.0, 0.0), (0.0, 0.0)]);
    let (place, code, _, most) = refused(Path::waypoints(&back, 1.0, false));
    assert_eq!((&*place, &*code), ("/segments/0/points/1", "fillet"));
    assert!(most < 1e-9);
}

#[test]
fn a_straight_line_needs_no_fillet() {
    let row = [0.0, 10.0, 25.0].map(|north| Vector2::new(north, 2.0 * north));
    let path = Path::waypoints(&row, 0.0, false).expect("has no corner");
    near(path.length(), 25.0 * 5_f64.sqrt(), 1e-9);
}

#[test]
fn segments_that_do_not_join_are_refused_with_the_size_of_the_gap_or_kink() {
    let line = |from: [f64; 2], to: [f64; 2]| Segment::Line { from, to };
    let first = line([0.0, 0.0], [10.0, 0.0]);
    let joined = |next: Segment| Path::from_segments(&[first.clone(), next], false);
    let ring = Path::from_segments(std::slice::from_ref(&first), true);
    for (path, at, expected_code, expected) in [
        (square(0.0), "/segments/0/points/0", "kink", PI / 2.0),
        (joined(line([10.0, 0.002], [20.0, 0.002])), "/segments/1", "gap", 0.002),
        (joined(line([10.0, 0.0], [20.0, 0.1])), "/segments/1", "kink", 0.01_f64.atan()),
        (ring, "/segments/0", "gap", 10.0),
    ] {
        let (place, code, given, most) = refused(path);
        assert_eq!((&*place, &*code), (at, expected_code));
        assert_eq!(most, if code == "kink" { KINK_MAX } else { GAP_MAX });
        near(given, expected, 1e-9);
    }
    // Coordinates rounded to millimetres join.
    assert!(joined(line([10.0, 0.0004], [20.0, 0.0])).is_ok());
}

#[test]
fn invalid_numbers_are_refused_by_name() {
    let origin = [0.0; 2];
    let arc = |from, angle_rad| Segment::Arc { from, centre: origin, angle_rad };
    for strange in [f64::NAN, f64::INFINITY, -f64::INFINITY, 1.1e6] {
        let (from, to) = (origin, [strange, 0.0]);
        let waypoints = Segment::Waypoints {
            points: vec![origin, [5.0, 0.0], [9.0, 9.0]],
            fillet_m: Some(strange),
            turn_radius_m: None,
            legs: vec![],
        };
        for (segment, at_fault) in [
            (Segment::Line { from, to }, "to/0"),
            (arc([0.0, strange], 1.0), "from/1"),
            (arc([5.0, 0.0], strange), "angle_rad"),
            (waypoints, "fillet_m"),
        ] {
            let (place, ..) = refused(Path::from_segments(&[segment], false));
            assert_eq!(place, format!("/segments/0/{at_fault}"));
        }
        let endless = Path::starting_at(origin.into(), 0.0).line(strange);
        assert!(endless.check().is_err());
        assert!(Path::circle(origin.into(), strange, Side::Port, 0.0).is_err());
    }
    let (from, to) = (origin, origin);
    let point = Path::from_segments(&[Segment::Line { from, to }], false).expect_err("is none");
    let says = point.to_string();
    let expected = "/segments/0/to: both ends are within 0.001 m";
    assert!(says.starts_with(expected), "{says}");
    assert_eq!(refused(Path::from_segments(&[], false)).0, "/segments");
}

#[test]
fn corners_get_their_radius_or_the_largest_that_fits_their_legs() {
    let first = [(0.0, 0.0), (50.0, 0.0)];
    // Repeated points are merged, also the last of a ring that repeats the first.
    let ring = [(50.0, 50.0), (50.0, 50.05), (0.0, 50.0), (0.0, 0.0)];
    for (others, closed, expected) in [
        (&[(50.0, 50.0)][..], false, &[10.0][..]),
        // Lanes 4 m apart: two right angles share the 4 m and make a lawn-mower's half circle.
        (&[(50.0, 4.0), (0.0, 4.0)], false, &[2.0; 2]),
        // A quarter turn takes 1 m of a leg of 1 m; the other leg is long.
        (&[(50.0, 1.0)], false, &[1.0]),
        (&ring, true, &[10.0; 4]),
    ] {
        let path = route(&[&first[..], others].concat(), 10.0, closed).expect("is a path");
        let arcs = path.pieces.iter().filter(|piece| piece.curvature != 0.0);
        let radii: Vec<f64> = arcs.map(|piece| 1.0 / piece.curvature.abs()).collect();
        assert_eq!(radii.len(), expected.len(), "{radii:?}");
        for (radius, expected) in radii.iter().zip(expected) {
            near(*radius, *expected, 1e-9);
        }
    }
}

#[test]
fn a_reversal_at_a_way_point_is_a_loop() {
    let path = route(&[(0.0, 0.0), (50.0, 0.0), (0.0, 0.0)], 6.0, false).expect("is a path");
    // 60° away, a turn of 300°, 60° away.
    let expected = 100.0 + 6.0 * 7.0 * PI / 3.0;
    near(path.length(), expected, 1e-9);
    let (there, back) = (path.at(50.0), path.at(path.length() - 50.0));
    near_to(there.position, back.position, 1e-9);
    near(back.tangent - there.tangent, PI, 1e-9);
    // To and fro for ever.
    let ring = route(&[(0.0, 0.0), (50.0, 0.0)], 6.0, true).expect("is a path");
    near(ring.length(), 2.0 * expected - 100.0, 1e-9);
}

#[test]
fn any_ten_thousand_points_make_a_searchable_path() {
    let point = |k: u32| {
        let (a, b) = scattered(k / 2);
        (400.0 * a, 400.0 * b + f64::from(k % 2) * a)
    };
    let points: Vec<(f64, f64)> = (0..10_000).map(point).collect();
    let path = route(&points, 5.0, false).expect("is a path");
    for pair in path.pieces.windows(2) {
        let end = pair[0].at(pair[0].length);
        near_to(end.position, pair[1].start, 1e-6);
        near(wrap(end.tangent - pair[1].tangent), 0.0, 1e-9);
    }
    // The skipped blocks change nothing.
    for k in 0..20 {
        let (a, b) = scattered(k + 77);
        let position = Vector2::new(500.0 * a - 50.0, 500.0 * b - 50.0);
        let nearest = path.pieces.iter().map(|piece| {
            let length = piece.closest(&position);
            let distance = (position - piece.at(length).position).norm_squared();
            (piece.from + length, distance)
        });
        let nearest = nearest.reduce(|best, next| if next.1 < best.1 { next } else { best });
        assert_eq!(Some(path.closest(&position)), nearest.map(|(gamma, _)| gamma));
    }
}

#[test]
fn way_points_at_one_place_are_refused() {
    let (place, code, ..) = refused(route(&[(5.0, 0.0), (5.0, 0.05), (5.0, 0.0)], 5.0, false));
    assert_eq!((&*place, &*code), ("/segments/0/points", "one_place"));
    let (place, ..) = refused(route(&[(0.0, 0.0), (9.0, 2e6)], 5.0, false));
    assert_eq!(place, "/segments/0/points/1/1");
}

#[test]
fn a_speed_profile_is_straight_between_its_knots_and_constant_outside() {
    let profile = SpeedProfile::new(vec![(10.0, 0.2), (20.0, 0.4), (40.0, 0.1)]).expect("is one");
    let at = [-5.0, 10.0, 15.0, 20.0, 30.0, 90.0].map(|gamma| profile.at(gamma));
    for (speed, expected) in at.into_iter().zip([0.2, 0.2, 0.3, 0.4, 0.25, 0.1]) {
        near(speed, expected, 1e-12);
    }
    assert!(SpeedProfile::constant(0.3).is_ok_and(|profile| profile.at(1e5) == 0.3));
    for (knots, at_fault) in [
        (vec![], "/knots"),
        (vec![(0.0, 0.0)], "/knots/0/1"),
        (vec![(0.0, f64::NAN)], "/knots/0/1"),
        (vec![(0.0, 0.1), (f64::INFINITY, 0.1)], "/knots/1/0"),
        (vec![(0.0, 0.1), (1.0, 0.1), (1.0, 0.2)], "/knots/2/0"),
    ] {
        let fault = SpeedProfile::new(knots).expect_err("is none");
        assert_eq!(fault.pointer, at_fault);
    }
}

#[test]
fn legs_keep_their_speeds_and_depths_at_repeated_points_and_back_to_the_first() {
    let leg = |speed: f64| Leg { speed_mps: Some(speed), depth_m: Some(10.0 * speed) };
    let path = |speeds: &[f64], closed| {
        let waypoints = Segment::Waypoints {
            points: vec![[0.0, 0.0], [100.0, 0.0], [100.0, 0.0], [100.0, 100.0]],
            fillet_m: None,
            turn_radius_m: Some(5.0),
            legs: speeds.iter().map(|speed| leg(*speed)).collect(),
        };
        Path::from_segments(&[waypoints], closed)
    };
    let middles = [([50.0, 0.0], 1.0), ([100.0, 50.0], 3.0), ([50.0, 50.0], 4.0)];
    for (speeds, closed, n) in [(&[1.0, 2.0, 3.0][..], false, 2), (&[1.0, 2.0, 3.0, 4.0], true, 3)] {
        let path = path(speeds, closed).expect("is a path");
        for (place, speed) in &middles[..n] {
            let point = path.at(path.closest(&Vector2::from(*place)));
            assert_eq!(point.leg, leg(*speed), "{place:?}");
        }
    }
    let field = |speeds: &[f64], closed| refused(path(speeds, closed)).0;
    assert_eq!(field(&[1.0; 2], false), "/segments/0/legs");
    assert_eq!(field(&[1.0; 3], true), "/segments/0/legs");
    assert_eq!(field(&[1.0, 11.0, 1.0], false), "/segments/0/legs/1/speed_mps");
}
