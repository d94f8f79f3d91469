//! Claims about the geometry of no-go areas.

use std::f64::consts::TAU;

use nalgebra::Vector2;

use crate::coast::land::Land;
use crate::coast::shape::shape_faults;
use crate::coast::way::{Search, length};
use crate::facts::angle::direction;
use crate::facts::no_go::NoGo;

fn land(polygons: &[&[[f64; 2]]]) -> Land {
    Land::new(&polygons.iter().map(|polygon| NoGo::new(polygon.to_vec())).collect::<Vec<_>>())
}

fn way(land: &Land, clearance: f64, from: [f64; 2], to: [f64; 2]) -> Option<Vec<Vector2<f64>>> {
    let search = Search { land, clearance, due: &|| false };
    search.way(&from.into(), &to.into())
}

/// A basin open to the north, 40 m wide inside, with hooks at its mouth.
const BAY: [[f64; 2]; 12] = [
    [-5.0, -25.0],
    [60.0, -25.0],
    [60.0, -10.0],
    [55.0, -10.0],
    [55.0, -20.0],
    [0.0, -20.0],
    [0.0, 20.0],
    [55.0, 20.0],
    [55.0, 10.0],
    [60.0, 10.0],
    [60.0, 25.0],
    [-5.0, 25.0],
];

const SQUARE: [[f64; 2]; 4] = [[0.0, 0.0], [10.0, 0.0], [10.0, 10.0], [0.0, 10.0]];

#[test]
fn the_way_out_of_a_bay_goes_round_its_hooks() {
    let (land, from, to) = (land(&[&BAY]), [20.0, 5.0], [-30.0, 5.0]);
    let way = way(&land, 1.0, from, to).expect("a way out");
    // Taut round the corners of the eastern hook and arm themselves.
    let corners = [from, [60.0, 10.0], [60.0, 25.0], [-5.0, 25.0], to].map(Vector2::from);
    let taut = length(&corners);
    assert!(taut < length(&way) && length(&way) < 1.04 * taut, "{way:?} {taut}");
    for leg in way.windows(2) {
        for share in 0..=100 {
            assert!(land.is_free(&leg[0].lerp(&leg[1], 0.01 * f64::from(share)), 0.97));
        }
    }
}

#[test]
fn a_round_cape_is_passed_at_the_clearance_by_an_arc_and_two_tangents() {
    let (radius, clearance, n) = (50.0_f64, 2.0, 400);
    let corner = |k: i32| (direction(TAU * f64::from(k) / f64::from(n)) * radius).into();
    let island: Vec<[f64; 2]> = (0..n).map(corner).collect();
    let way = way(&land(&[&island]), clearance, [-100.0, 0.0], [100.0, 0.0]).expect("a way round");
    let off = radius + clearance;
    let tangents = 2.0 * (100.0_f64.powi(2) - off * off).sqrt();
    let taut = tangents + off * (TAU / 2.0 - 2.0 * (off / 100.0).acos());
    assert!(taut < 1.0001 * length(&way) && length(&way) < 1.005 * taut, "{} {taut}", length(&way));
    assert!(way.len() < 40, "a few legs, not one for each of {n} corners: {}", way.len());
}

/// A closed basin with a wall across it, in which a passage has this width.
fn strait(width: f64) -> [Vec<[f64; 2]>; 3] {
    let rectangle = |n: [f64; 2], e: [f64; 2]| vec![[n[0], e[0]], [n[1], e[0]], [n[1], e[1]], [n[0], e[1]]];
    let mut basin = rectangle([-60.0, 60.0], [-40.0, 40.0]);
    // Its inside, joined to the outside where the ring is closed.
    basin.extend([
        [-60.0, -40.0],
        [-50.0, -30.0],
        [-50.0, 30.0],
        [50.0, 30.0],
        [50.0, -30.0],
        [-50.0, -30.0],
    ]);
    [basin, rectangle([-3.0, 3.0], [-35.0, 7.0]), rectangle([-3.0, 3.0], [7.0 + width, 35.0])]
}

#[test]
fn a_passage_is_open_from_twice_the_clearance_on_and_the_order_of_areas_has_no_effect() {
    for (width, is_open) in [(4.1, true), (3.8, false)] {
        let mut areas = strait(width);
        let found = |areas: &[Vec<[f64; 2]>; 3]| {
            let land = land(&[&areas[0], &areas[1], &areas[2]]);
            way(&land, 2.0, [-30.0, -10.0], [30.0, -10.0])
        };
        let first = found(&areas);
        assert_eq!(first.is_some(), is_open, "{width}");
        areas.rotate_left(1);
        for area in &mut areas {
            area.reverse();
        }
        let turned = found(&areas);
        assert_eq!(first.as_deref().map(length), turned.as_deref().map(length));
    }
}

#[test]
fn the_place_outside_is_the_nearest_of_all_areas_together() {
    let beside = SQUARE.map(|[north, east]| [north + 8.0, east + 1.0]);
    let land = land(&[&SQUARE, &beside]);
    // 1 m from the first square's northern side, which is in the second.
    let place = land.permitted(&Vector2::new(9.0, 7.0), 0.5);
    assert!((place - Vector2::new(9.0, 11.5)).norm() < 1e-9, "{place}");
    assert_eq!(land.inside(&Vector2::new(1.0, 4.0)), Some((0, 1.0)));
    let outside = Vector2::new(-1.0, -1.0);
    assert_eq!((land.permitted(&outside, 0.5), land.inside(&outside)), (outside, None));
}

#[test]
fn a_hole_is_outside_and_its_island_inside_again() {
    let ring = |size: f64| SQUARE.map(|corner| corner.map(|x| 5.0 + (x - 5.0) * size)).to_vec();
    let lagoon = NoGo { holes: vec![ring(0.6), ring(0.2)], ..NoGo::new(ring(1.0)) };
    assert_eq!(shape_faults(std::slice::from_ref(&lagoon)), []);
    let land = Land::new(&[lagoon]);
    let inside = |north: f64| land.inside(&Vector2::new(north, 5.0)).map(|(_, depth)| depth);
    assert_eq!([1.0, 3.0, 5.0].map(inside), [Some(1.0), None, Some(1.0)]);
}

#[test]
fn faults_of_shape_name_the_corner() {
    let [a, b, c, d] = SQUARE;
    let far = SQUARE.map(|[north, east]| [north + 20.0, east]).to_vec();
    let with_hole = |hole: Vec<[f64; 2]>| NoGo { holes: vec![hole], ..NoGo::new(SQUARE.to_vec()) };
    for (area, place, code) in [
        (NoGo::new(vec![a, c, b, d]), "/no_go/1/polygon", "crosses"),
        (NoGo::new(vec![a, b, c, d, [0.0, 10.05]]), "/no_go/1/polygon/4", "too_near"),
        (NoGo::new(vec![a, b, [5.0, 0.0]]), "/no_go/1/polygon", "too_small"),
        (with_hole(far.clone()), "/no_go/1/holes/0", "hole_outside"),
        (with_hole(vec![[5.0, 5.0], [15.0, 5.0], [5.0, 6.0]]), "/no_go/1/", "crosses"),
    ] {
        let faults = shape_faults(&[NoGo::new(far.clone()), area]);
        assert_eq!(faults.len(), 1, "{faults:?}");
        assert!(faults[0].pointer.starts_with(place) && faults[0].code == code, "{:?}", faults[0]);
    }
    // Either direction, and rings that touch, as charts have them.
    let touching = with_hole(vec![a, [5.0, 3.0], [3.0, 5.0]]);
    assert_eq!(shape_faults(&[touching, NoGo::new(vec![d, c, b, a])]), []);
}
