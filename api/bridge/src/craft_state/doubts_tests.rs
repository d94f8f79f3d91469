//! Voyages with and without faults: the raised alarms, their delays, and the absence of others.

mod hour;

use std::f64::consts::{PI, TAU};

use super::*;
use crate::reference::wrapped;

/// Seconds between two steps of a voyage.
const STEP_S: f64 = 0.1;
const AUTOPILOT: Source = Source {
    wire: 0,
    talker: [0; 2],
};
const SENSOR: Source = Source {
    wire: 1,
    talker: *b"HE",
};

/// Random numbers: xorshift64*.
struct Random(u64);

impl Random {
    #[expect(clippy::cast_precision_loss, reason = "53 bits are kept")]
    fn uniform(&mut self) -> f64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        (self.0.wrapping_mul(0x2545_F491_4F6C_DD1D) >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// A number of standard deviation 1.
    fn normal(&mut self) -> f64 {
        (-2.0 * (1.0 - self.uniform()).ln()).sqrt() * (TAU * self.uniform()).cos()
    }

    fn normals(&mut self) -> Vector2<f64> {
        Vector2::new(self.normal(), self.normal())
    }
}

/// The sensors of the craft.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Sensors {
    /// An autopilot's filter: everything, ten times a second.
    Filter,
    /// A receiver with white noise, m, once a second, without a course at rest; and a compass.
    Receiver(f64),
}

/// A craft that changes speed and heading at random, in waves and a current that turns.
struct Voyage {
    sensors: Sensors,
    random: Random,
    tenths: u32,
    /// Position (north, east), m.
    position: Vector2<f64>,
    heading: f64,
    yaw_rate: f64,
    speed: f64,
    asked: Reference,
    asked_until_s: f64,
    drift: Vector2<f64>,
    state: CraftState,
    raised: Vec<Alarm>,
}

impl Voyage {
    fn new(sensors: Sensors, seed: u64) -> Self {
        Self {
            sensors,
            random: Random(seed),
            tenths: 0,
            position: Vector2::zeros(),
            heading: 0.0,
            yaw_rate: 0.0,
            speed: 1.0,
            asked: Reference {
                speed: 1.0,
                heading: 0.0,
            },
            asked_until_s: 60.0,
            drift: Vector2::zeros(),
            state: CraftState::default(),
            raised: vec![],
        }
    }

    fn now_s(&self) -> f64 {
        STEP_S * f64::from(self.tenths)
    }

    /// Velocity over ground, m/s.
    fn velocity(&self) -> Vector2<f64> {
        let t_s = self.now_s();
        let current = direction(TAU * t_s / 10_000.0) * 0.5;
        let waves = direction(1.0) * (0.4 * (TAU * t_s / 6.0).sin());
        direction(self.heading) * self.speed + current + waves
    }

    /// A step, whose measurements `fault` replaces or removes.
    fn step(&mut self, fault: &mut dyn FnMut(&Self, CraftMeasurement) -> Option<CraftMeasurement>) {
        self.tenths += 1;
        let t_s = self.now_s();
        if t_s > self.asked_until_s {
            self.asked_until_s = t_s + 10.0 + 80.0 * self.random.uniform();
            let speed = [0.0, 0.3, 1.0, 2.0, 3.0][self.tenths as usize % 5];
            self.asked = Reference {
                speed,
                heading: self.random.uniform() * TAU,
            };
        }
        let waves = 0.07 * (TAU * t_s / 6.0).sin();
        let turn = wrapped(self.asked.heading + waves - self.heading);
        let yaw_rate = (turn / 1.5).clamp(-0.5, 0.5);
        self.yaw_rate = yaw_rate;
        self.heading = wrapped(self.heading + yaw_rate * STEP_S);
        self.speed += (self.asked.speed - self.speed).clamp(-1.0, 1.0) * STEP_S;
        self.position += self.velocity() * STEP_S;
        for measured in self.measured() {
            if let Some(measured) = fault(self, measured) {
                self.state.take(t_s, AUTOPILOT, &measured);
            }
        }
        self.state.sent(&self.asked.clone(), STEP_S);
        for alarm in self.state.alarms().collect::<Vec<_>>() {
            if !self.raised.contains(&alarm) {
                self.raised.push(alarm);
            }
        }
    }

    fn measured(&mut self) -> Vec<CraftMeasurement> {
        let heading = self.heading + 0.01 * self.random.normal();
        let velocity = self.velocity() + self.random.normals() * 0.05;
        match self.sensors {
            Sensors::Filter => {
                // Drift of first order, 2 m, with a time of 100 s, and white noise of 5 cm.
                self.drift += self.random.normals() * (2.0 * (2.0 * STEP_S / 100.0_f64).sqrt())
                    - self.drift * (STEP_S / 100.0);
                let position = self.position + self.drift + self.random.normals() * 0.05;
                vec![
                    CraftMeasurement::Position(place(&position)),
                    CraftMeasurement::GroundVelocity(velocity),
                    CraftMeasurement::Heading(wrapped(heading)),
                    CraftMeasurement::YawRate(self.yaw_rate + 0.01 + 0.01 * self.random.normal()),
                ]
            }
            Sensors::Receiver(sigma) => {
                // To 0.1°, as sentences state it.
                let heading = (heading.to_degrees() * 10.0).round() / 10.0;
                let mut measured = vec![CraftMeasurement::Heading(wrapped(heading.to_radians()))];
                if self.tenths.is_multiple_of(10) {
                    let position = self.position + self.random.normals() * sigma;
                    measured.push(CraftMeasurement::Position(place(&position)));
                    measured.push(if velocity.norm() < 0.3 {
                        CraftMeasurement::GroundSpeed(velocity.norm())
                    } else {
                        CraftMeasurement::GroundVelocity(velocity)
                    });
                }
                measured
            }
        }
    }

    fn nominal(&mut self, seconds: u32) {
        for _ in 0..seconds * 10 {
            self.step(&mut |_, measured| Some(measured));
        }
    }

    /// Sails with `fault`; the time until `alarm`, s, or `None` after `seconds`.
    fn detection(
        &mut self,
        seconds: u32,
        alarm: Alarm,
        fault: &mut dyn FnMut(&Self, CraftMeasurement) -> Option<CraftMeasurement>,
    ) -> Option<f64> {
        let start_s = self.now_s();
        for _ in 0..seconds * 10 {
            self.step(fault);
            if self.state.alarms().any(|raised| raised == alarm) {
                return Some(self.now_s() - start_s);
            }
        }
        None
    }
}

fn place(position: &Vector2<f64>) -> Geographic {
    let scale = (1.0 / 6_371_000.0_f64).to_degrees();
    let lat_deg = 38.0 + position.x * scale;
    Geographic {
        lat_deg,
        lon_deg: -9.0 + position.y * scale / 38.0_f64.to_radians().cos(),
    }
}

/// `measured`, with `position` in place of every position.
fn at(position: Geographic, measured: CraftMeasurement) -> CraftMeasurement {
    match measured {
        CraftMeasurement::Position(_) => CraftMeasurement::Position(position),
        other => other,
    }
}

/// The same with positions that far from the true one (north, east), m.
fn off_by(off: Vector2<f64>, voyage: &Voyage, measured: CraftMeasurement) -> CraftMeasurement {
    at(place(&(voyage.position + off)), measured)
}

/// The same with that velocity.
fn moving(velocity: Vector2<f64>, measured: CraftMeasurement) -> CraftMeasurement {
    match measured {
        CraftMeasurement::GroundVelocity(_) => CraftMeasurement::GroundVelocity(velocity),
        other => other,
    }
}

/// The same with headings that far off, rad.
fn turned(by: f64, measured: CraftMeasurement) -> CraftMeasurement {
    match measured {
        CraftMeasurement::Heading(heading) => CraftMeasurement::Heading(wrapped(heading + by)),
        other => other,
    }
}

const ALL: [Sensors; 2] = [Sensors::Filter, Sensors::Receiver(1.5)];

/// A craft that turns steadily to starboard at 1 m/s from now on.
fn circles(voyage: &mut Voyage) {
    voyage.asked.speed = 1.0;
    voyage.asked.heading = wrapped(voyage.heading + 0.5);
    voyage.asked_until_s = f64::INFINITY;
}

#[test]
fn ten_hours_of_waves_current_and_noise_raise_no_alarm() {
    for (sensors, seed) in [
        (Sensors::Filter, 7),
        (Sensors::Receiver(1.5), 8),
        (Sensors::Receiver(2.5), 9),
    ] {
        let mut voyage = Voyage::new(sensors, seed);
        let mut without_state = 0;
        for _ in 0..36_000 {
            voyage.nominal(1);
            without_state += u32::from(voyage.state.newest().is_none());
        }
        assert_eq!(voyage.raised, [], "{sensors:?}: {}", voyage.state.rejects());
        // The first seconds, before there is a velocity.
        assert!(without_state <= 3, "{sensors:?}: {without_state} s");
    }
}

#[test]
fn a_frozen_position_of_a_moving_craft_is_not_used() {
    // Straight on at 1 m/s, and on a random course, slower and with turns.
    for (sensors, straight, within_s) in ALL
        .into_iter()
        .flat_map(|all| [(all, true, 8.0), (all, false, 16.0)])
    {
        let mut voyage = Voyage::new(sensors, 1);
        voyage.nominal(60);
        if straight {
            voyage.asked.speed = 1.0;
            voyage.asked_until_s = f64::INFINITY;
            voyage.nominal(10);
        }
        let frozen = place(&voyage.position);
        let mut stays = |_: &Voyage, measured| Some(at(frozen, measured));
        let after = voyage.detection(30, Alarm::PositionFrozen, &mut stays);
        assert!(
            after.is_some_and(|after| after <= within_s),
            "{sensors:?}: {after:?}"
        );
        assert!(voyage.state.newest().is_none());
        voyage.nominal(5);
        assert!(voyage.state.newest().is_some(), "it moves again");
    }
}

#[test]
fn a_receiver_frozen_at_the_berth_is_detected_at_departure() {
    for sensors in ALL {
        let mut voyage = Voyage::new(sensors, 1);
        voyage.asked.speed = 0.0;
        voyage.asked_until_s = f64::INFINITY;
        voyage.nominal(30);
        let frozen = place(&voyage.position);
        let mut stays = |_: &Voyage, measured| Some(at(frozen, measured));
        let at_rest = voyage.detection(600, Alarm::NoWay, &mut stays);
        assert_eq!(at_rest, None, "{sensors:?}");
        voyage.asked.speed = 1.0;
        let after = voyage.detection(60, Alarm::PositionFrozen, &mut stays);
        assert!(after.is_some_and(|after| after <= 12.0), "{sensors:?}: {after:?}");
    }
}

#[test]
fn a_receiver_frozen_in_all_values_is_detected_by_the_references() {
    let mut voyage = Voyage::new(Sensors::Filter, 2);
    voyage.nominal(30);
    voyage.asked_until_s = f64::INFINITY;
    let frozen = place(&voyage.position);
    let mut stays = |_: &Voyage, measured| Some(moving(Vector2::zeros(), at(frozen, measured)));
    let after = voyage.detection(30, Alarm::NoWay, &mut stays);
    // 10 m at 1 m/s.
    assert!(after.is_some_and(|after| after <= 12.0), "{after:?}");
    let after = voyage.detection(30, Alarm::PositionFrozen, &mut stays);
    assert!(after.is_some_and(|after| after <= 21.0), "{after:?}");
}

#[test]
fn two_vehicles_with_one_number_have_no_position_until_one_is_silent() {
    for sensors in ALL {
        let mut voyage = Voyage::new(sensors, 3);
        voyage.nominal(60);
        let mut is_other = false;
        let mut two = |voyage: &Voyage, measured| {
            is_other ^= matches!(measured, CraftMeasurement::Position(_));
            Some(if is_other {
                off_by(Vector2::new(300.0, 0.0), voyage, measured)
            } else {
                measured
            })
        };
        let after = voyage.detection(20, Alarm::PositionJumps, &mut two);
        let most = if sensors == Sensors::Filter { 1.0 } else { 10.0 };
        assert!(after.is_some_and(|after| after <= most), "{sensors:?}: {after:?}");
        assert!(voyage.state.newest().is_none());
        voyage.nominal(10);
        assert!(voyage.state.newest().is_some(), "one is silent");
    }
}

#[test]
fn one_outlier_is_ignored_and_a_lasting_jump_is_accepted_after_three_seconds() {
    for sensors in ALL {
        let mut voyage = Voyage::new(sensors, 4);
        voyage.nominal(60);
        let mut outliers = 0;
        let far = Vector2::new(0.0, 200.0);
        let mut once = |voyage: &Voyage, measured| match measured {
            CraftMeasurement::Position(_) if outliers == 0 => {
                outliers += 1;
                Some(off_by(far, voyage, measured))
            }
            other => Some(other),
        };
        assert_eq!(voyage.detection(10, Alarm::PositionJumps, &mut once), None);
        let mut moved_away = |voyage: &Voyage, measured| Some(off_by(far, voyage, measured));
        let after = voyage.detection(10, Alarm::PositionJumped, &mut moved_away);
        assert!(after.is_some_and(|after| after <= 5.0), "{sensors:?}: {after:?}");
        let there = voyage.state.newest().expect("the new place counts").position;
        assert!(moved(&there, &place(&(voyage.position + far))).norm() < 10.0);
    }
}

#[test]
fn a_wandering_position_is_not_used() {
    let mut voyage = Voyage::new(Sensors::Filter, 5);
    voyage.nominal(60);
    let mut draw = Random(6);
    let mut wanders = |voyage: &Voyage, measured| Some(off_by(draw.normals() * 200.0, voyage, measured));
    let after = voyage.detection(10, Alarm::PositionJumps, &mut wanders);
    assert!(after.is_some_and(|after| after <= 5.0), "{after:?}");
    assert!(voyage.state.newest().is_none());
}

#[test]
fn impossible_speeds_and_turns_are_not_used() {
    let mut voyage = Voyage::new(Sensors::Filter, 10);
    voyage.nominal(30);
    let mut fast = |_: &Voyage, measured| match measured {
        CraftMeasurement::YawRate(_) => Some(CraftMeasurement::YawRate(30.0)),
        other => Some(moving(Vector2::new(60.0, 0.0), other)),
    };
    for _ in 0..200 {
        voyage.step(&mut fast);
    }
    let state = voyage.state.newest().expect("positions say the velocity");
    let velocity = state.ground_velocity.expect("of the positions");
    assert!((velocity - voyage.velocity()).norm() < 1.5, "{velocity}");
    assert_eq!(state.yaw_rate, 0.0);
    let rejects = voyage.state.rejects().to_string();
    assert!(rejects.contains("faster than a surface craft: 200"), "{rejects}");
}

#[test]
fn a_velocity_that_contradicts_the_positions_is_not_used() {
    for (sensors, wrong) in [
        (Sensors::Filter, Vector2::zeros()),
        (Sensors::Receiver(1.5), Vector2::zeros()),
        (Sensors::Filter, Vector2::new(0.0, -1.5)),
    ] {
        let mut voyage = Voyage::new(sensors, 11);
        voyage.nominal(50);
        voyage.asked_until_s = f64::INFINITY;
        let mut stuck = |_: &Voyage, measured| Some(moving(wrong, measured));
        let after = voyage.detection(40, Alarm::VelocityContradicts, &mut stuck);
        assert!(after.is_some_and(|after| after <= 20.0), "{sensors:?}: {after:?}");
        for _ in 0..30 {
            voyage.step(&mut stuck);
        }
        let velocity = voyage.state.newest().and_then(|state| state.ground_velocity);
        let off = velocity.expect("of the positions") - voyage.velocity();
        assert!(off.norm() < 1.2, "{sensors:?}: {off}");
        voyage.nominal(30);
        assert_eq!(voyage.state.alarms().next(), None, "it is right again");
    }
}

#[test]
fn the_state_survives_two_seconds_of_a_wrong_velocity() {
    for sensors in ALL {
        let mut voyage = Voyage::new(sensors, 12);
        voyage.nominal(100);
        let mut wrong = |_: &Voyage, measured| Some(moving(Vector2::new(-15.0, 9.0), measured));
        for _ in 0..20 {
            voyage.step(&mut wrong);
            assert!(voyage.state.newest().is_some());
        }
        assert!(
            voyage.state.current().current().norm() < 1.0,
            "{:?}",
            voyage.state.current()
        );
        for _ in 0..600 {
            voyage.nominal(1);
            assert!(voyage.state.newest().is_some());
        }
        assert!(
            voyage.state.current().current().norm() < 1.0,
            "{:?}",
            voyage.state.current()
        );
    }
}

#[test]
fn a_frozen_heading_of_a_turning_craft_is_not_used() {
    for (sensors, most) in [(Sensors::Filter, 10.0), (Sensors::Receiver(1.5), 40.0)] {
        let mut voyage = Voyage::new(sensors, 13);
        voyage.nominal(60);
        circles(&mut voyage);
        let frozen = voyage.heading;
        let (start_s, mut after) = (voyage.now_s(), None);
        let mut stays = |_: &Voyage, measured| match measured {
            CraftMeasurement::Heading(_) => Some(CraftMeasurement::Heading(frozen)),
            other => Some(other),
        };
        while after.is_none() && voyage.now_s() < start_s + 60.0 {
            voyage.asked.heading = wrapped(voyage.heading + 0.3);
            after = voyage
                .detection(1, Alarm::HeadingFrozen, &mut stays)
                .map(|_| voyage.now_s() - start_s);
        }
        assert!(after.is_some_and(|after| after <= most), "{sensors:?}: {after:?}");
        assert!(voyage.state.newest().is_none());
        voyage.nominal(5);
        assert!(voyage.state.newest().is_some(), "it turns again");
    }
}

#[test]
fn a_second_compass_that_differs_is_named_and_the_first_one_is_used() {
    let mut voyage = Voyage::new(Sensors::Filter, 14);
    voyage.nominal(60);
    let mut after = None;
    for tenth in 0..300_u16 {
        voyage.step(&mut |_, measured| Some(measured));
        let (t_s, heading) = (voyage.now_s(), wrapped(voyage.heading + 1.2));
        voyage
            .state
            .take(t_s, SENSOR, &CraftMeasurement::Heading(heading));
        let state = voyage.state.newest().expect("the first one is right");
        assert!(wrapped(state.heading - voyage.heading).abs() < 0.1);
        if after.is_none() && voyage.state.alarms().any(|alarm| alarm == Alarm::HeadingsDiffer) {
            after = Some(0.1 * f64::from(tenth));
        }
    }
    assert!(after.is_some_and(|after| after <= 6.0), "{after:?}");
}

#[test]
fn another_source_is_used_from_two_seconds_of_silence_until_the_first_returned_for_five() {
    let mut state = CraftState::default();
    let mut heading = |t_s: f64, first: Option<f64>, second: f64| {
        state.take(
            t_s,
            AUTOPILOT,
            &CraftMeasurement::Position(place(&Vector2::zeros())),
        );
        state.take(t_s, AUTOPILOT, &CraftMeasurement::GroundSpeed(0.0));
        if let Some(first) = first {
            state.take(t_s, AUTOPILOT, &CraftMeasurement::Heading(first));
        }
        state.take(t_s, SENSOR, &CraftMeasurement::Heading(second));
        state.newest().map(|state| state.heading)
    };
    let seconds = |from: u8, to: u8| (from..to).map(f64::from);
    for t_s in seconds(0, 10) {
        assert_eq!(heading(t_s, Some(0.0), 0.1), Some(0.0));
    }
    assert_eq!(heading(11.0, None, 0.1), Some(0.0));
    for t_s in seconds(13, 20) {
        assert_eq!(heading(t_s, None, 0.1), Some(0.1));
    }
    for t_s in seconds(20, 25) {
        assert_eq!(heading(t_s, Some(0.0), 0.1), Some(0.1));
    }
    assert_eq!(heading(25.0, Some(0.0), 0.1), Some(0.0));
}

#[test]
fn alternating_headings_are_not_used() {
    let mut voyage = Voyage::new(Sensors::Filter, 15);
    voyage.nominal(60);
    let mut is_other = false;
    let mut two = |_: &Voyage, measured| {
        is_other ^= matches!(measured, CraftMeasurement::Heading(_));
        Some(turned(if is_other { PI / 2.0 } else { 0.0 }, measured))
    };
    let after = voyage.detection(10, Alarm::HeadingJumps, &mut two);
    assert!(after.is_some_and(|after| after <= 1.0), "{after:?}");
    assert!(voyage.state.newest().is_none());
}

#[test]
fn a_compass_with_a_sudden_offset_raises_two_alarms() {
    let mut voyage = Voyage::new(Sensors::Filter, 16);
    voyage.nominal(50);
    voyage.asked_until_s = f64::INFINITY;
    let mut off = |_: &Voyage, measured| Some(turned(1.22, measured));
    let jumped = voyage.detection(10, Alarm::HeadingJumped, &mut off);
    assert!(jumped.is_some_and(|after| after <= 3.5), "{jumped:?}");
    let named = voyage.detection(30, Alarm::CourseOffHeading, &mut off);
    assert!(named.is_some_and(|after| after <= 12.0), "{named:?}");
    assert!(voyage.state.newest().is_some(), "it may be the current");
}

#[test]
fn a_jump_of_little_more_than_the_gate_is_named() {
    for seed in 17..22 {
        let mut voyage = Voyage::new(Sensors::Filter, seed);
        voyage.nominal(60);
        // 40° and 22 m: the gates, once opened for a while, contain them.
        let mut off = |_: &Voyage, measured| Some(turned(0.7, measured));
        let after = voyage.detection(10, Alarm::HeadingJumped, &mut off);
        assert!(after.is_some_and(|after| after <= 3.5), "{after:?}");
        let mut moved_away =
            |voyage: &Voyage, measured| Some(off_by(Vector2::new(0.0, 22.0), voyage, turned(0.7, measured)));
        let after = voyage.detection(10, Alarm::PositionJumped, &mut moved_away);
        assert!(after.is_some_and(|after| after <= 3.5), "{after:?}");
    }
}

#[test]
fn a_mirrored_yaw_is_named_at_the_first_turn_and_is_invisible_on_a_northern_course() {
    for mirrored_rate in [1.0, -1.0] {
        let mut voyage = Voyage::new(Sensors::Filter, 18);
        let mut mirrored = |_: &Voyage, measured| {
            Some(match measured {
                CraftMeasurement::Heading(heading) => CraftMeasurement::Heading(-heading),
                CraftMeasurement::YawRate(rate) => CraftMeasurement::YawRate(mirrored_rate * rate),
                other => other,
            })
        };
        assert_eq!(
            voyage.detection(59, Alarm::HeadingContradicts, &mut mirrored),
            None
        );
        voyage.asked.heading = 1.5;
        voyage.asked_until_s = f64::INFINITY;
        let after = voyage.detection(30, Alarm::HeadingContradicts, &mut mirrored);
        let most = if mirrored_rate > 0.0 { 3.0 } else { 12.0 };
        assert!(
            after.is_some_and(|after| after <= most),
            "{mirrored_rate}: {after:?}"
        );
    }
}

#[test]
fn a_position_that_drifts_from_the_velocity_at_half_a_metre_per_second_is_named() {
    for (sensors, most) in [(Sensors::Filter, 16.0), (Sensors::Receiver(1.5), 20.0)] {
        let mut voyage = Voyage::new(sensors, 19);
        voyage.nominal(50);
        voyage.asked_until_s = f64::INFINITY;
        let start_s = voyage.now_s();
        let mut drifts = |voyage: &Voyage, measured| {
            let off = direction(2.0) * (0.5 * (voyage.now_s() - start_s));
            Some(off_by(off, voyage, measured))
        };
        let after = voyage.detection(40, Alarm::PositionDrifts, &mut drifts);
        assert!(after.is_some_and(|after| after <= most), "{sensors:?}: {after:?}");
        assert!(voyage.state.newest().is_some(), "the positions count");
    }
}

#[test]
fn a_compass_frozen_on_a_straight_course_is_named_by_a_gyro_in_waves_or_at_the_first_turn() {
    for (sensors, straight) in [(Sensors::Filter, true), (Sensors::Receiver(1.5), false)] {
        let mut voyage = Voyage::new(sensors, 20);
        voyage.nominal(50);
        voyage.asked_until_s = f64::INFINITY;
        let frozen = voyage.heading;
        let mut stays = |_: &Voyage, measured| match measured {
            CraftMeasurement::Heading(_) => Some(CraftMeasurement::Heading(frozen)),
            other => Some(other),
        };
        let after = voyage.detection(45, Alarm::HeadingFrozen, &mut stays);
        let is_named = after.is_some_and(|after| after <= 12.0);
        assert!(
            if straight { is_named } else { after.is_none() },
            "{sensors:?}: {after:?}"
        );
        if !straight {
            voyage.asked.heading = 2.5;
            let after = voyage.detection(30, Alarm::HeadingFrozen, &mut stays);
            assert!(after.is_some_and(|after| after <= 15.0), "{sensors:?}: {after:?}");
        }
    }
}
