//! Closed-loop underwater vehicles.

use std::f64::consts::FRAC_PI_2;

use nalgebra::Vector2;
use pilotfish_sim::{
    dive::Leg,
    inner_loop::{DragFeedForward, PERIOD, SurgeLoop, UnderwaterReference},
    integrate::rk4,
    underwater_vehicle::{PITCH_MAX, UnderwaterClass, UnderwaterState},
};
use planner::path::SpeedProfile;

use crate::{named, near, world};

const CLASSES: [UnderwaterClass; 2] = [UnderwaterClass::Medusa, UnderwaterClass::Slocum];

/// States at the end of each of `n` periods with this reference, in still water.
fn follow(
    class: UnderwaterClass,
    start: [f64; 8],
    [surge, pitch, yaw_rate]: [f64; 3],
    n: u32,
) -> Vec<UnderwaterState> {
    let (hull, loops) = (class.hull(), class.loops());
    let mut surge_loop = SurgeLoop::settled_at(class.speed(), DragFeedForward::Off, hull.drag_surge);
    let reference = UnderwaterReference { surge, pitch, yaw_rate };
    let mut state = UnderwaterState::from(start);
    (0..n)
        .map(|_| {
            let input = loops.command(&hull, &mut surge_loop, &state, &reference);
            state = rk4(&state, PERIOD, |x| hull.derivative(x, input, &Vector2::zeros()));
            state
        })
        .collect()
}

fn at(depth: f64, pitch: f64, surge: f64) -> [f64; 8] {
    [0.0, 0.0, depth, pitch, 0.0, surge, 0.0, 0.0]
}

/// Time from a steady dive to within 5 % of a steady climb, s, and the largest pitch, rad.
fn reversal(class: UnderwaterClass) -> (f64, f64) {
    let pitch = class.dive().pitch;
    let states = follow(class, at(20.0, -pitch, class.speed()), [class.speed(), pitch, 0.0], 600);
    let is_outside = |state: &UnderwaterState| (state[3] - pitch).abs() > 0.05 * 2.0 * pitch;
    let last_outside = states.iter().rposition(is_outside).expect("starts outside");
    let largest = states.iter().map(|state| state[3]).fold(f64::MIN, f64::max);
    (PERIOD * f64::from(u32::try_from(last_outside + 2).expect("few")), largest)
}

#[test]
fn pitch_reversals_take_four_seconds_or_a_few_times_that() {
    let [(medusa, medusa_largest), (slocum, slocum_largest)] = CLASSES.map(reversal);
    near(medusa / 4.0, 1.0, 0.15);
    assert!(medusa_largest.to_degrees() < 52.0);
    assert!((2.0 * medusa..5.0 * medusa).contains(&slocum), "{slocum} s");
    assert!(slocum_largest.to_degrees() < 28.0);
}

#[test]
fn a_glide_has_its_published_ground_speed_and_slope() {
    let class = UnderwaterClass::Slocum;
    let pitch = class.dive().pitch;
    near(class.speed(), 0.29 / 26_f64.to_radians().cos(), 1e-12);
    let end = follow(class, at(1.0, -pitch, class.speed()), [class.speed(), -pitch, 0.0], 1000)[999];
    near(end[0], 0.29 * 100.0, 1e-6);
    near(end[2] - 1.0, 29.0 * 26_f64.to_radians().tan(), 1e-6);
}

#[test]
fn the_glider_turns_on_seven_metres() {
    let class = UnderwaterClass::Slocum;
    let end = follow(class, at(5.0, 0.0, 0.29), [0.29, 0.0, 1.0], 1200)[1199];
    near(end[5] / end[7] / 7.0, 1.0, 0.05);
}

#[test]
fn both_vehicles_follow_a_lawn_mower_in_their_sawtooth() {
    for class in CLASSES {
        let mut world = world(&named("paper-path-following"), 1);
        let auv = &mut world.auvs[0];
        (auv.hull, auv.loops) = (class.hull(), class.loops());
        let speed = SpeedProfile::constant(class.speed()).expect("a speed");
        (auv.dive, auv.speed, auv.leg) = (class.dive(), speed, Leg::Down);
        auv.state[5] = class.speed();
        auv.surge = SurgeLoop::settled_at(class.speed(), DragFeedForward::Off, auv.hull.drag_surge);
        let mut deepest = 0.0_f64;
        for k in 0..12_000 {
            world.step(None);
            let auv = &world.auvs[0];
            deepest = deepest.max(auv.depth());
            if k > 1_200 {
                // Either can turn on 10 m, and both laws know the path's curvature.
                let error = auv.path_error();
                assert!(error.s_1.hypot(error.y_1) < 0.1, "{class:?}: {error:?}");
            }
        }
        let beyond = deepest - class.dive().depth_max;
        assert!((0.0..1.0).contains(&beyond), "{deepest}");
    }
}

#[test]
fn a_disturbed_vehicle_returns_to_its_reference_without_a_nan() {
    for class in CLASSES {
        for pitch in [FRAC_PI_2, -FRAC_PI_2, 1.6, 3.1, -2.5] {
            for (pitch_rate, yaw_rate) in [(0.0, 0.0), (4.0, -3.0), (-4.0, 3.0)] {
                let start = [0.0, 0.0, 5.0, pitch, 0.5, -1.0, pitch_rate, yaw_rate];
                let states = follow(class, start, [class.speed(), 0.3, 0.0], 6000);
                assert!(states.iter().flatten().all(|x| x.is_finite()));
                let end = states.last().expect("some");
                near(end[3], 0.3, 1e-3);
                near(end[7], 0.0, 1e-6);
            }
        }
    }
}

#[test]
fn no_pitch_reference_leads_to_the_pole() {
    for class in CLASSES {
        for asked in [FRAC_PI_2, -10.0] {
            let states = follow(class, at(5.0, 0.0, class.speed()), [class.speed(), asked, 0.02], 1200);
            let steepest = states.iter().map(|state| state[3].abs()).fold(0.0, f64::max);
            // The loop's overshoot stays within the 5° up to the bound of the heading rate.
            let expected = PITCH_MAX - 0.01..85_f64.to_radians();
            assert!(expected.contains(&steepest), "{steepest}");
        }
    }
}
