//! AUVs that do not sail what they plan: weaves, late turns, slow dives, and what they declare.

use std::f64::consts::{SQRT_2, TAU};

use nalgebra::Vector2;
use planner::path::{Path, Segment};

use crate::{near, parsed, step_until, world};

/// One AUV at 0.9 m/s in still water, with these members.
fn text(members: &str) -> String {
    format!(
        r#"
schema_version = "1"
name = "alone"
title = "one vehicle"
duration_s = 3000
settled_after_s = 0
knowledge.paths = true
[surface_craft]
class = "otter"
north_m = 0
east_m = 0
heading_rad = 0
speed_mps = 0
contact_range_m = 40
goal.track.auv = "auv-1"
[[auvs]]
id = "auv-1"
speed_mps = 0.9
depth_m = 9
dive = {{depth_min_m = 8, depth_max_m = 11, pitch_rad = 0.1}}
{members}
"#
    )
}

/// A path due north.
const LINE: &str = "path.segments.segments = [{line = {from = [0, 0], to = [5000, 0]}}]\n";
/// A corner to starboard.
const CORNER: &str = "path.waypoints = {points = [[0, 0], [300, 0], [300, 400]], turn_radius_m = 10}\n";

/// Its positions, once a second for `seconds`.
fn sailed(members: &str, seed: u64, seconds: u32) -> Vec<Vector2<f64>> {
    let mut world = world(&parsed(&text(members)), seed);
    let at = |time: u32| {
        step_until(&mut world, time.into());
        world.auvs[0].position()
    };
    (0..seconds).map(at).collect()
}

/// Its distances to starboard of [`LINE`] from the second minute on, once a second.
fn across(weave: &str, seed: u64) -> Vec<f64> {
    let members = format!("{LINE}tracking_error.weave = {{{weave}}}");
    let track = sailed(&members, seed, 3000);
    track[60..].iter().map(|position| position.y).collect()
}

fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let (n, sum) = values.fold((0.0, 0.0), |(n, sum), value| (n + 1.0, sum + value));
    sum / n
}

/// Correlation of values this many seconds apart.
fn correlation(values: &[f64], lag: usize) -> f64 {
    let products = values.iter().zip(&values[lag..]).map(|(a, b)| a * b);
    mean(products) / mean(values.iter().map(|value| value * value))
}

#[test]
fn a_sine_has_its_amplitude_and_period_and_no_other_frequency() {
    for (amplitude, period) in [(4.0, 60.0), (1.0, 20.0)] {
        let across = across(&format!("amplitude_m = {amplitude}, period_s = {period}"), 1);
        // Fourier's coefficient at that frequency; whole periods.
        let of = |wave: fn(f64) -> f64| {
            let waves = (0_u32..).map(|t| wave(TAU * f64::from(t) / period));
            2.0 * mean(across.iter().zip(waves).map(|(y, wave)| y * wave))
        };
        let found = of(f64::cos).hypot(of(f64::sin));
        // The path follower lags behind a quick weave.
        near(found / amplitude, 1.0, 0.15);
        let power = mean(across.iter().map(|y| y * y));
        near(power / (0.5 * found * found), 1.0, 0.01);
    }
}

#[test]
fn a_random_weave_is_stationary_with_its_sigma_and_forgets_its_phase() {
    let weave = "amplitude_m = 4, period_s = 40, damping = 0.2";
    let (mut powers, mut crossings, mut far) = (vec![], vec![], vec![]);
    for seed in 0..12 {
        let across = across(weave, seed);
        let halves = across.split_at(across.len() / 2);
        powers.push([halves.0, halves.1].map(|half| mean(half.iter().map(|y| y * y))));
        let upwards = across.windows(2).filter(|pair| pair[0] < 0.0 && 0.0 <= pair[1]);
        crossings.push(upwards.map(|_| 1.0).sum::<f64>());
        far.push(correlation(&across, 400));
        near(mean(across.iter().copied()), 0.0, 0.3);
    }
    let sigma = |half: usize| mean(powers.iter().map(|power| power[half])).sqrt();
    // The path follower lags behind the quicker half of the spectrum.
    for half in 0..2 {
        near(sigma(half) * SQRT_2 / 4.0, 0.95, 0.08);
    }
    // Rice: crossings of a second are the root of the spectrum's second moment over 2π. In 2940 s.
    let moment = |power: i32| {
        let spectrum = |w: f64| w * w / ((1.0 - w * w).powi(2) + (0.4 * w).powi(2));
        let frequencies = (0..3000).map(|k| 0.5 + (f64::from(k) + 0.5) * 0.0005);
        mean(frequencies.map(|w| w.powi(power) * spectrum(w)))
    };
    let expected = 2940.0 / 40.0 * (moment(2) / moment(0)).sqrt();
    near(mean(crossings.into_iter()) / expected, 0.99, 0.04);
    // Ten periods later little is left; of a sine all is.
    assert!(mean(far.iter().map(|r| r * r)).sqrt() < 0.25, "{far:?}");
    let sine = across("amplitude_m = 4, period_s = 40", 1);
    assert!(0.98 < correlation(&sine, 400));
}

#[test]
fn weaves_differ_by_seed_and_change_nothing_else() {
    let weave = "amplitude_m = 2, period_s = 40, damping = 0.1";
    let [one, other] = [1, 2].map(|seed| across(weave, seed));
    assert_ne!(one, other);
    assert_eq!(one, across(weave, 1));
    let path = |members: &str| world(&parsed(&text(members)), 3).auvs[0].path.clone();
    let survey = "path.random_survey = {}\n";
    assert_eq!(path(survey), path(&format!("{survey}tracking_error.weave = {{{weave}}}")));
}

#[test]
fn a_late_turn_goes_beyond_its_way_point_and_an_early_one_cuts_the_corner() {
    let radius = 10.0;
    let north = |late: f64| {
        let track = sailed(&format!("{CORNER}tracking_error.turns_late_m = {late}"), 1, 700);
        // Half way along the next leg it is back.
        let there = track.iter().filter(|position| 200.0 < position.y);
        there.for_each(|position| near(position.x, 300.0, 0.3));
        track.into_iter().map(|position| position.x).fold(0.0, f64::max)
    };
    for late in [10.0, 25.0] {
        // An arc of the turn radius between the legs, which meet at more than a right angle.
        let turn = 0.5 * std::f64::consts::PI + (0.25_f64).atan();
        let beyond = late - radius * ((0.5 * turn).tan() - 1.0);
        near(north(late), 300.0 + beyond, 0.7);
    }
    let inside = |late: f64| {
        let track = sailed(&format!("{CORNER}tracking_error.turns_late_m = {late}"), 1, 700);
        let from_corner = |position: &Vector2<f64>| (position - Vector2::new(300.0, 0.0)).norm();
        track.iter().map(from_corner).fold(f64::INFINITY, f64::min)
    };
    // The chord from 20 m before to 80 m beyond the way-point passes it at this distance.
    let chord = 20.0 * 80.0 / 20.0_f64.hypot(80.0);
    near(inside(-20.0), chord, 1.0);
    assert!(north(-20.0) < 300.3);
}

#[test]
fn a_slow_diver_loses_its_share_nose_down() {
    // Legs of some minutes.
    let text = text(&format!("{LINE}tracking_error.slower_diving_share = 0.3"));
    let mut world = world(&parsed(&text.replace("depth_max_m = 11", "depth_max_m = 40")), 1);
    let mut speeds = [vec![], vec![]];
    for _ in 0..20_000 {
        world.step(None);
        let auv = &world.auvs[0];
        // Steady, far from the reversals.
        if (20.0..30.0).contains(&auv.depth()) {
            speeds[usize::from(auv.pitch() < 0.0)].push(auv.state[5]);
        }
    }
    let [up, down] = speeds.map(|speeds| mean(speeds.into_iter()));
    near(down / up, 0.7, 0.03);
}

#[test]
fn a_plan_is_declared_without_the_errors_and_a_track_with_them() {
    let errors = "tracking_error = {turns_late_m = 20, weave = {amplitude_m = 4, period_s = 60, damping = 0.1}}\n\
                  navigation_error = {north_m = 15, drift_share = 0.01}\n";
    let declared = |declares: &str| {
        let scenario = parsed(&text(&format!("{CORNER}{errors}declares = \"{declares}\"")));
        let start = scenario.start(4).expect("valid");
        let (mut world, mut observer) = (start.world, start.observer.expect("has a craft"));
        let craft = world.surface_craft.clone().expect("has one");
        let known = observer.observe(&world, &craft, 1.0).expect("valid");
        let path = known.auvs[0].path.clone().expect("is known");
        let route: Path = path.path().expect("joins");
        // Its distance from the truth at every second.
        let distance = |time: u32| {
            step_until(&mut world, time.into());
            let position = world.auvs[0].position();
            (route.at(route.closest(&position)).position - position).norm()
        };
        let worst = (0..700).map(distance).fold(0.0, f64::max);
        (path.segments, worst)
    };
    let (plan, off) = declared("plan");
    let [Segment::Waypoints { points, .. }] = &plan[..] else { panic!("{plan:?}") };
    assert_eq!(*points, [[0.0, 0.0], [300.0, 0.0], [300.0, 400.0]]);
    assert!(15.0 < off, "{off}");
    let (_, off) = declared("sailed");
    assert!(off < 0.5, "{off}");
}

#[test]
fn patterns_that_are_never_drawn_are_what_they_are_called() {
    let path = |pattern: &str, seed| {
        let members =
            format!("path.random_survey = {{pattern = \"{pattern}\", leg_m = 200, spacing_m = 25}}");
        world(&parsed(&text(&members)), seed).auvs[0].path.clone()
    };
    let turned = |path: &Path| {
        let n = 20_000;
        let step = path.length() / f64::from(n);
        let pieces = (0..n).map(|k| path.at((f64::from(k) + 0.5) * step).curvature * step);
        pieces.sum::<f64>()
    };
    for seed in 0..10 {
        let eight = path("figure_of_eight", seed);
        assert!(eight.is_closed());
        near(turned(&eight), 0.0, 0.05);
        let spiral = path("spiral", seed);
        let way_points = |path: &Path| match path.segments() {
            [Segment::Waypoints { points, .. }] => {
                points.iter().copied().map(Vector2::from).collect::<Vec<_>>()
            }
            other => panic!("{other:?}"),
        };
        // Always to one side, and each turn 25 m wider than the last: chords grow by 25 m × 45°.
        let points = way_points(&spiral);
        near(
            turned(&spiral).abs(),
            TAU / 8.0 * f64::from(u32::try_from(points.len() - 2).expect("few")),
            0.6,
        );
        let chord = |k: usize| (points[k + 1] - points[k]).norm();
        near(chord(24) - chord(16), 25.0 * 2.0 * (TAU / 16.0).sin(), 0.5);
        let lanes = way_points(&path("unequal_lanes", seed));
        let lengths = lanes.chunks(2).map(|lane| (lane[1] - lane[0]).norm());
        let lengths: Vec<f64> = lengths.collect();
        let [least, most] =
            [f64::min, f64::max].map(|of| lengths.iter().copied().reduce(of).expect("has lanes"));
        assert!(least + 5.0 < most && most < 200.1 && 39.9 < least, "{lengths:?}");
    }
}
