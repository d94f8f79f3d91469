//! Closed-loop underwater vehicles.

use std::f64::consts::FRAC_PI_2;

use nalgebra::Vector2;
use pilotfish_sim::{
    dive::Leg,
    inner_loop::{DragFeedForward, PERIOD, SurgeLoop, UnderwaterReference},
    integrate::rk4,
    underwater_vehicle::{PITCH_MAX, UnderwaterClass, UnderwaterHull, UnderwaterInput, UnderwaterState},
};
use planner::path::SpeedProfile;

use crate::named;

const CLASSES: [UnderwaterClass; 2] = [UnderwaterClass::Medusa, UnderwaterClass::Slocum];

/// States at the end of each of `n` periods with this reference, in still water.
fn follow(
    class: UnderwaterClass,
    start: UnderwaterState,
    reference: UnderwaterReference,
    n: u32,
) -> Vec<UnderwaterState> {
    let (hull, loops) = (class.hull(), class.loops());
    let mut surge = SurgeLoop::settled_at(class.speed(), DragFeedForward::Off, hull.drag_surge);
    let mut state = start;
    (0..n)
        .map(|_| {
            let input = loops.command(&hull, &mut surge, &state, &reference);
            state = rk4(&state, PERIOD, |x| hull.derivative(x, input, &Vector2::zeros()));
            state
        })
        .collect()
}

/// Time from a steady dive to within 5 % of a steady climb, s, and the largest pitch, rad.
fn reversal(class: UnderwaterClass) -> (f64, f64) {
    let pitch = class.dive().pitch;
    let start = UnderwaterState::from([0.0, 0.0, 20.0, -pitch, 0.0, class.speed(), 0.0, 0.0]);
    let reference = UnderwaterReference {
        surge: class.speed(),
        pitch,
        yaw_rate: 0.0,
    };
    let states = follow(class, start, reference, 600);
    let last_outside = states
        .iter()
        .rposition(|state| (state[3] - pitch).abs() > 0.05 * 2.0 * pitch)
        .expect("starts outside");
    let largest = states.iter().map(|state| state[3]).fold(f64::MIN, f64::max);
    (
        PERIOD * f64::from(u32::try_from(last_outside + 2).expect("few")),
        largest,
    )
}

#[test]
fn pitch_reversals_take_four_seconds_or_a_few_times_that() {
    let [(medusa, medusa_largest), (slocum, slocum_largest)] = CLASSES.map(reversal);
    println!(
        "pitch reversals: {medusa:.1} s to {:.2} deg, {slocum:.1} s to {:.2} deg",
        medusa_largest.to_degrees(),
        slocum_largest.to_degrees()
    );
    assert!((medusa / 4.0 - 1.0).abs() < 0.15, "{medusa} s");
    assert!(medusa_largest.to_degrees() < 52.0);
    assert!((2.0 * medusa..5.0 * medusa).contains(&slocum), "{slocum} s");
    assert!(slocum_largest.to_degrees() < 28.0);
}

#[test]
fn a_glide_has_its_published_ground_speed_and_slope() {
    let class = UnderwaterClass::Slocum;
    let pitch = class.dive().pitch;
    assert!((class.speed() - 0.29 / 26_f64.to_radians().cos()).abs() < 1e-12);
    let start = UnderwaterState::from([0.0, 0.0, 1.0, -pitch, 0.0, class.speed(), 0.0, 0.0]);
    let reference = UnderwaterReference {
        surge: class.speed(),
        pitch: -pitch,
        yaw_rate: 0.0,
    };
    let end = follow(class, start, reference, 1000)[999];
    assert!((end[0] - 0.29 * 100.0).abs() < 1e-6, "{}", end[0]);
    assert!(
        (end[2] - 1.0 - 29.0 * 26_f64.to_radians().tan()).abs() < 1e-6,
        "{}",
        end[2]
    );
}

#[test]
fn the_glider_turns_on_seven_metres() {
    let class = UnderwaterClass::Slocum;
    let start = UnderwaterState::from([0.0, 0.0, 5.0, 0.0, 0.0, 0.29, 0.0, 0.0]);
    let reference = UnderwaterReference {
        surge: 0.29,
        pitch: 0.0,
        yaw_rate: 1.0,
    };
    let end = follow(class, start, reference, 1200)[1199];
    let radius = end[5] / end[7];
    println!("tightest turn of the glider: {radius:.2} m");
    assert!((radius / 7.0 - 1.0).abs() < 0.05, "{radius}");
}

#[test]
fn both_vehicles_follow_a_lawn_mower_in_their_sawtooth() {
    for class in CLASSES {
        let mut world = named("paper-path-following").start(1).expect("valid").world;
        let auv = &mut world.auvs[0];
        (auv.hull, auv.loops) = (class.hull(), class.loops());
        let speed = SpeedProfile::constant(class.speed()).expect("a speed");
        (auv.dive, auv.speed, auv.leg) = (class.dive(), speed, Leg::Down);
        auv.state[5] = class.speed();
        auv.surge = SurgeLoop::settled_at(class.speed(), DragFeedForward::Off, auv.hull.drag_surge);
        let (mut deepest, mut furthest): (f64, f64) = (0.0, 0.0);
        for k in 0..12_000 {
            world.step(None);
            let auv = &world.auvs[0];
            deepest = deepest.max(auv.depth());
            if k > 1_200 {
                let error = auv.path_error();
                furthest = furthest.max(error.s_1.hypot(error.y_1));
            }
        }
        println!("{class:?}: to {deepest:.2} m, off its path by up to {furthest:.2} m");
        assert!(
            (0.0..1.0).contains(&(deepest - class.dive().depth_max)),
            "{deepest}"
        );
        // Either can turn on 10 m, and both laws know the path's curvature.
        assert!(furthest < 0.1, "{class:?}: {furthest}");
    }
}

#[test]
fn a_disturbed_vehicle_returns_to_its_reference_without_a_nan() {
    for class in CLASSES {
        for pitch in [FRAC_PI_2, -FRAC_PI_2, 1.6, 3.1, -2.5] {
            for (pitch_rate, yaw_rate) in [(0.0, 0.0), (4.0, -3.0), (-4.0, 3.0)] {
                let start = UnderwaterState::from([0.0, 0.0, 5.0, pitch, 0.5, -1.0, pitch_rate, yaw_rate]);
                let reference = UnderwaterReference {
                    surge: class.speed(),
                    pitch: 0.3,
                    yaw_rate: 0.0,
                };
                let states = follow(class, start, reference, 6000);
                assert!(states.iter().all(|state| state.iter().all(|x| x.is_finite())));
                let end = states.last().expect("some");
                assert!((end[3] - 0.3).abs() < 1e-3, "{class:?} from {pitch}: {}", end[3]);
                assert!(end[7].abs() < 1e-6);
            }
        }
    }
}

#[test]
fn no_pitch_reference_leads_to_the_pole() {
    for class in CLASSES {
        let start = UnderwaterState::from([0.0, 0.0, 5.0, 0.0, 0.0, class.speed(), 0.0, 0.0]);
        for asked in [FRAC_PI_2, -10.0] {
            let reference = UnderwaterReference {
                surge: class.speed(),
                pitch: asked,
                yaw_rate: 0.02,
            };
            let states = follow(class, start, reference, 1200);
            let steepest = states.iter().map(|state| state[3].abs()).fold(0.0, f64::max);
            // The loop's overshoot stays within the 5° up to the bound of the heading rate.
            assert!(
                (PITCH_MAX - 0.01..85_f64.to_radians()).contains(&steepest),
                "{steepest}"
            );
        }
    }
}

/// A dive that turns, without a change of sign of any velocity.
fn smooth_dive(hull: &UnderwaterHull, step: f64, n: u32) -> UnderwaterState {
    let input = UnderwaterInput {
        surge_force: 0.9 * hull.force_max,
        pitch_moment: -0.3 * hull.pitch_moment_max,
        yaw_moment: 0.3 * hull.yaw_moment_max,
    };
    let start = UnderwaterState::from([0.0, 0.0, 5.0, 0.1, 0.0, 0.2, -0.05, 0.02]);
    (0..n).fold(start, |state, _| {
        rk4(&state, step, |x| {
            hull.derivative(x, input, &Vector2::new(0.1, 0.0))
        })
    })
}

#[test]
fn halving_the_step_divides_the_hull_s_error_by_sixteen() {
    for hull in CLASSES.map(UnderwaterClass::hull) {
        let exact = smooth_dive(&hull, 0.2 / 64.0, 640);
        let error = |step, n| (smooth_dive(&hull, step, n) - exact).norm();
        let (coarse, fine) = (error(0.2, 10), error(0.1, 20));
        println!("RK4: {coarse:.2e} and {fine:.2e}, ratio {:.2}", coarse / fine);
        // 2⁴ up to the next order's share, of the size of h times the fastest rate (0.2 s · 1.5/s).
        assert!((coarse / fine - 16.0).abs() < 3.0, "ratio {}", coarse / fine);
    }
}
