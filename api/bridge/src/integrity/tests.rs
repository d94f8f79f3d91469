//! Single measurements against one another, at the limits of each check.

use planner::angle::direction;

use super::*;

const AUTOPILOT: Source = Source { wire: 0, talker: [0; 2] };
const SENSOR: Source = Source { wire: 1, talker: *b"HE" };

/// Times a tenth of a second apart, s.
fn tenths(n: u32) -> impl Iterator<Item = f64> {
    (0..n).map(|tenth| 0.1 * f64::from(tenth))
}

/// A place near the equator, m north and east of it.
fn position(north_m: f64, east_m: f64) -> CraftMeasurement {
    let scale = (1.0 / 6_371_000.0_f64).to_degrees();
    CraftMeasurement::Position(Origin { lat_deg: north_m * scale, lon_deg: east_m * scale })
}

#[test]
fn a_receiver_frozen_at_rest_is_named_six_metres_after_departure() {
    let mut integrity = Integrity::default();
    for t_s in tenths(900) {
        let speed = if t_s < 80.0 { 0.0 } else { 1.0 };
        assert!(integrity.admits_velocity(t_s, Vector2::new(speed, 0.0)));
        assert!(integrity.admits(t_s, AUTOPILOT, &position(0.0, 0.0)));
        if (t_s - 85.7).abs() > 0.15 {
            let expected = (85.7 < t_s).then_some(Alarm::PositionFrozen);
            assert_eq!(integrity.alarms().next(), expected, "{t_s} s");
        }
    }
}

#[test]
fn a_receiver_that_works_again_is_trusted_at_once_even_at_low_speed() {
    let mut integrity = Integrity::default();
    let mut north = 0.0;
    for t_s in tenths(200) {
        // The receiver is frozen until 16 s, the craft at rest from 8 s on.
        let speed = match t_s {
            ..8.0 => 1.0,
            ..16.0 => 0.0,
            _ => 0.2,
        };
        north += if t_s < 16.0 { 0.0 } else { 0.1 * speed };
        assert!(integrity.admits_velocity(t_s, Vector2::new(speed, 0.0)));
        assert!(integrity.admits(t_s, AUTOPILOT, &position(north, 0.0)));
        let is_frozen = integrity.alarms().any(|alarm| alarm == Alarm::PositionFrozen);
        let is_near = |change_s: f64| (t_s - change_s).abs() < 0.15;
        if !is_near(5.7) && !is_near(16.5) {
            assert_eq!(is_frozen, 5.7 < t_s && t_s < 16.5, "{t_s} s");
        }
    }
}

#[test]
fn no_measurement_beyond_the_possible_and_none_of_a_second_source_is_admitted() {
    let (far, near) = (Vector2::new(60.0, 0.0), Vector2::new(0.6, 0.0));
    for (impossible, possible) in [
        (CraftMeasurement::GroundVelocity(far), CraftMeasurement::GroundVelocity(near)),
        (CraftMeasurement::GroundSpeed(60.0), CraftMeasurement::GroundSpeed(0.6)),
        (CraftMeasurement::WaterVelocity(far), CraftMeasurement::WaterVelocity(near)),
        (CraftMeasurement::YawRate(30.0), CraftMeasurement::YawRate(0.3)),
    ] {
        let mut integrity = Integrity::default();
        assert!(!integrity.admits(0.0, AUTOPILOT, &impossible), "{impossible:?}");
        assert!(integrity.admits(0.1, AUTOPILOT, &possible), "{possible:?}");
        assert!(!integrity.admits(0.2, SENSOR, &possible), "{possible:?}");
    }
}

#[test]
fn a_steady_velocity_is_admitted_at_any_speed_and_a_jump_is_not() {
    let mut integrity = Integrity::default();
    let fast = Vector2::new(5.0, 0.0);
    assert!([99.9, 100.0].iter().all(|t_s| integrity.admits_velocity(*t_s, fast)));
    // 3 m/s in a tenth of a second, and in half a second.
    assert!(!integrity.admits_velocity(100.1, fast * 1.6));
    assert!(integrity.admits_velocity(100.5, fast * 1.6));
}

#[test]
fn positions_are_predicted_by_a_velocity_of_the_last_two_seconds() {
    let mut integrity = Integrity::default();
    let velocity = Vector2::new(18.0, 0.0);
    for t_s in (90..101).map(f64::from) {
        let measured = position(18.0 * (t_s - 90.0), 0.0);
        assert!(integrity.admits_velocity(t_s, velocity));
        assert!(integrity.admits(t_s, AUTOPILOT, &measured), "{t_s} s");
    }
    // The craft has stopped, in silence.
    for t_s in [102.0, 104.0, 106.0] {
        assert!(integrity.admits(t_s, AUTOPILOT, &position(216.0, 0.0)), "{t_s} s");
    }
}

#[test]
fn headings_are_predicted_by_a_yaw_rate_of_the_last_two_seconds() {
    let mut integrity = Integrity::default();
    let heading = |turned: f64| CraftMeasurement::Heading(wrap(turned));
    for t_s in (90..101).map(f64::from) {
        assert!(integrity.admits(t_s, AUTOPILOT, &CraftMeasurement::YawRate(1.0)));
        assert!(integrity.admits(t_s, AUTOPILOT, &heading(t_s)), "{t_s} s");
    }
    // The craft keeps its heading, in silence.
    for t_s in [103.0, 104.0, 105.0] {
        assert!(integrity.admits(t_s, AUTOPILOT, &heading(103.0)), "{t_s} s");
    }
}

#[test]
fn a_jump_is_shown_for_ten_seconds() {
    let mut integrity = Integrity::default();
    for t_s in (100..130).map(f64::from) {
        let north = if t_s < 105.0 { 0.0 } else { 200.0 };
        integrity.admits(t_s, AUTOPILOT, &position(north, 0.0));
        let is_shown = integrity.alarms().any(|alarm| alarm == Alarm::PositionJumped);
        // The new position counts after three seconds.
        assert_eq!(is_shown, (108.0..=118.0).contains(&t_s), "{t_s} s");
    }
}

#[test]
fn a_course_far_off_the_heading_is_named_after_ten_seconds() {
    let mut integrity = Integrity::default();
    for t_s in (100..120).map(f64::from) {
        assert!(integrity.admits_velocity(t_s, direction(1.2)));
        assert!(integrity.admits(t_s, AUTOPILOT, &CraftMeasurement::Heading(0.0)));
        let expected = (110.0 <= t_s).then_some(Alarm::CourseOffHeading);
        assert_eq!(integrity.alarms().next(), expected, "{t_s} s");
    }
}

/// Takes headings and yaw rates; returns the alarms with the times from which they are raised, s.
fn turns(samples: impl Iterator<Item = (f64, f64, f64)>) -> Vec<(Alarm, f64)> {
    let mut integrity = Integrity::default();
    let mut raised: Vec<(Alarm, f64)> = vec![];
    for (t_s, heading, rate) in samples {
        assert!(integrity.admits(t_s, AUTOPILOT, &CraftMeasurement::YawRate(rate)));
        assert!(integrity.admits(t_s, AUTOPILOT, &CraftMeasurement::Heading(wrap(heading))));
        for alarm in integrity.alarms() {
            if raised.iter().all(|(before, _)| *before != alarm) {
                raised.push((alarm, t_s));
            }
        }
    }
    raised
}

#[test]
fn a_heading_that_stays_after_a_turn_is_not_frozen_despite_the_bias_of_a_gyro() {
    let turn = |t_s: f64| (t_s, 0.2 * t_s.min(10.0), if t_s < 10.0 { 0.2 } else { 0.035 });
    assert_eq!(turns(tenths(1000).map(turn)), []);
    // Samples need not fall on the end of a window.
    assert_eq!(turns(tenths(1000).step_by(3).map(turn)), []);
}

#[test]
fn a_slow_turn_to_the_wrong_side_is_named_after_four_seconds() {
    let raised = turns(tenths(60).map(|t_s| (t_s, -0.1 * t_s, 0.1)));
    let is_named = matches!(raised[..], [(Alarm::HeadingContradicts, at_s)] if 3.9 < at_s && at_s < 5.1);
    assert!(is_named, "{raised:?}");
}

#[test]
fn turns_between_two_samples_of_the_yaw_rate_contradict_nothing() {
    // Each second 0.25 rad in 0.1 s, of which samples 0.2 s apart make 0.5 rad.
    let samples = (0..100).map(|fifth: u32| {
        let (turns, phase) = (f64::from(fifth / 5), fifth % 5);
        let (now, rate) = match phase {
            0 => (0.0, 0.0),
            1 => (0.125, 2.5),
            _ => (0.25, 0.0),
        };
        (0.2 * f64::from(fifth), 0.25 * turns + now, rate)
    });
    assert_eq!(turns(samples), []);
}

#[test]
fn one_position_within_its_gate_makes_no_contradiction_with_the_velocity() {
    let mut integrity = Integrity::default();
    for t_s in (0..20).map(f64::from) {
        let east = if t_s == 7.0 { 12.0 } else { 0.0 };
        let measured = position(t_s, east);
        assert!(integrity.admits_velocity(t_s, Vector2::new(1.0, 0.0)));
        assert!(integrity.admits(t_s, AUTOPILOT, &measured), "{t_s} s");
        assert_eq!(integrity.alarms().next(), None, "{t_s} s");
    }
}

#[test]
fn positions_of_a_craft_that_measures_no_velocity_contradict_none() {
    let mut integrity = Integrity::default();
    for t_s in tenths(600) {
        // A velocity is measured from 20 to 25 s.
        if (20.0..25.0).contains(&t_s) {
            assert!(integrity.admits_velocity(t_s, Vector2::new(1.0, 0.0)));
        }
        assert!(integrity.admits(t_s, AUTOPILOT, &position(t_s, 0.0)));
        assert_eq!(integrity.alarms().next(), None, "{t_s} s");
    }
}

#[test]
fn a_third_source_that_agrees_does_not_hide_that_the_second_differs() {
    let source = |wire| Source { wire, talker: *b"GP" };
    for (n, every) in [(2, 1), (3, 1), (3, 25)] {
        let mut integrity = Integrity::default();
        for (tenth, t_s) in tenths(100).enumerate() {
            integrity.admits(t_s, source(0), &position(0.0, 0.0));
            if tenth % every == 0 {
                integrity.admits(t_s, source(1), &position(500.0, 0.0));
            }
            if n == 3 {
                integrity.admits(t_s, source(2), &position(0.5, 0.0));
            }
        }
        assert!(integrity.alarms().any(|alarm| alarm == Alarm::PositionsDiffer), "{n} sources");
    }
}

#[test]
fn a_spare_source_is_heard_once_eight_others_are_silent() {
    let mut integrity = Integrity::default();
    for wire in 0..8 {
        integrity.admits(0.0, Source { wire, talker: *b"GP" }, &position(0.0, 0.0));
    }
    let spare = Source { wire: 9, talker: *b"GP" };
    assert!(!integrity.admits(1.0, spare, &position(0.0, 0.0)));
    assert!(integrity.admits(10.0, spare, &position(0.0, 0.0)));
}
