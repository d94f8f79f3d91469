//! Missions with and without faults: the raised alarms, their delays, and the absence of others.

use std::{collections::BTreeSet, f64::consts::TAU, mem::discriminant};

use planner::angle::wrap;

use super::*;
use crate::{recent_positions::trend, reference::Reference};

/// Time between two steps, s.
const STEP_S: f64 = 0.1;
const AUTOPILOT: Source = Source { wire: 0, talker: [0; 2] };
const SENSOR: Source = Source { wire: 1, talker: *b"HE" };

const NORTH: Reference = Reference { speed: 1.0, heading: 0.0 };

/// Random numbers: xorshift64*.
struct Random(u64);

impl Random {
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

/// Replaces a measurement.
type Fault<'a> = &'a mut dyn FnMut(&Mission, CraftMeasurement) -> CraftMeasurement;

/// A craft that changes speed and heading at random, in waves and a current that turns.
struct Mission {
    sensors: Sensors,
    random: Random,
    tenths: u32,
    /// Position (north, east), m.
    position: Vector2<f64>,
    heading: f64,
    yaw_rate: f64,
    speed: f64,
    requested: Reference,
    requested_until_s: f64,
    drift: Vector2<f64>,
    state: CraftState,
    raised: BTreeSet<Alarm>,
}

impl Mission {
    fn new(sensors: Sensors, seed: u64) -> Self {
        Self {
            sensors,
            random: Random(seed),
            tenths: 0,
            position: Vector2::zeros(),
            heading: 0.0,
            yaw_rate: 0.0,
            speed: 1.0,
            requested: NORTH,
            requested_until_s: 60.0,
            drift: Vector2::zeros(),
            state: CraftState::default(),
            raised: BTreeSet::new(),
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

    /// A step, whose measurements `fault` replaces.
    fn step(&mut self, fault: Fault<'_>) {
        self.tenths += 1;
        let t_s = self.now_s();
        if t_s > self.requested_until_s {
            self.requested_until_s = t_s + 10.0 + 80.0 * self.random.uniform();
            let speed = [0.0, 0.3, 1.0, 2.0, 3.0][self.tenths as usize % 5];
            self.requested = Reference { speed, heading: self.random.uniform() * TAU };
        }
        let waves = 0.07 * (TAU * t_s / 6.0).sin();
        let turn = wrap(self.requested.heading + waves - self.heading);
        let yaw_rate = (turn / 1.5).clamp(-0.5, 0.5);
        self.yaw_rate = yaw_rate;
        self.heading = wrap(self.heading + yaw_rate * STEP_S);
        self.speed += (self.requested.speed - self.speed).clamp(-1.0, 1.0) * STEP_S;
        self.position += self.velocity() * STEP_S;
        for measured in self.measured() {
            let measured = fault(self, measured);
            self.state.take(t_s, AUTOPILOT, &measured);
        }
        self.state.integrity.sent(&self.requested, STEP_S);
        self.raised.extend(self.state.integrity.alarms());
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
                    CraftMeasurement::Heading(wrap(heading)),
                    CraftMeasurement::YawRate(self.yaw_rate + 0.01 + 0.01 * self.random.normal()),
                ]
            }
            Sensors::Receiver(sigma) => {
                // To 0.1°, as sentences state it.
                let heading = (heading.to_degrees() * 10.0).round() / 10.0;
                let mut measured = vec![CraftMeasurement::Heading(wrap(heading.to_radians()))];
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
            self.step(&mut |_, measured| measured);
        }
    }

    /// The time until `alarm` with `fault`, s, or `None` after `seconds`.
    fn detection(&mut self, seconds: f64, alarm: Alarm, fault: Fault<'_>) -> Option<f64> {
        let start_s = self.now_s();
        while self.now_s() < start_s + seconds {
            self.step(fault);
            if self.state.integrity.alarms().any(|raised| raised == alarm) {
                return Some(self.now_s() - start_s);
            }
        }
        None
    }

    /// Claims that `fault` raises `alarm` within `most`, s.
    fn raises_within(&mut self, most: f64, alarm: Alarm, fault: Fault<'_>) {
        let after = self.detection(most + 1.0, alarm, fault);
        let is_in_time = after.is_some_and(|after| after <= most);
        assert!(is_in_time, "{:?}: {alarm:?} after {after:?}", self.sensors);
    }

    /// Claims that there is no state, and that there is one again after `seconds` without fault.
    fn has_no_state_for(&mut self, seconds: u32) {
        assert!(self.state.newest().is_none());
        self.nominal(seconds);
        assert!(self.state.newest().is_some(), "{:?}", self.sensors);
    }

    /// After `seconds`, keeps the heading and the speed.
    fn straight_on_after(sensors: Sensors, seed: u64, seconds: u32) -> Self {
        let mut mission = Self::new(sensors, seed);
        mission.nominal(seconds);
        mission.requested_until_s = f64::INFINITY;
        mission
    }

    fn position_error(&self) -> Vector2<f64> {
        let newest = self.state.newest().expect("has a state").position;
        moved(&place(&self.position), &newest)
    }

    /// The used velocity over ground less the true one (north, east), m/s.
    fn velocity_error(&self) -> Vector2<f64> {
        let velocity = self.state.newest().and_then(|state| state.ground_velocity);
        velocity.expect("of the positions") - self.velocity()
    }
}

fn place(position: &Vector2<f64>) -> Origin {
    let scale = (1.0 / 6_371_000.0_f64).to_degrees();
    Origin {
        lat_deg: 38.0 + position.x * scale,
        lon_deg: -9.0 + position.y * scale / 38.0_f64.to_radians().cos(),
    }
}

/// `other` in place of what is `measured`, if it is of the same kind.
fn instead(other: CraftMeasurement, measured: CraftMeasurement) -> CraftMeasurement {
    if discriminant(&other) == discriminant(&measured) { other } else { measured }
}

/// `measured`, with `position` (north, east), m, in place of every position.
fn at(position: Vector2<f64>, measured: CraftMeasurement) -> CraftMeasurement {
    instead(CraftMeasurement::Position(place(&position)), measured)
}

/// The same with headings that far off, rad.
fn turned(by: f64, measured: CraftMeasurement) -> CraftMeasurement {
    match measured {
        CraftMeasurement::Heading(heading) => CraftMeasurement::Heading(wrap(heading + by)),
        other => other,
    }
}

const ALL: [Sensors; 2] = [Sensors::Filter, Sensors::Receiver(1.5)];

#[test]
fn ten_hours_of_waves_current_and_noise_raise_no_alarm() {
    for (sensors, seed) in [(Sensors::Filter, 7), (Sensors::Receiver(1.5), 8), (Sensors::Receiver(2.5), 9)] {
        let mut mission = Mission::new(sensors, seed);
        let mut without_state = 0;
        for _ in 0..36_000 {
            mission.nominal(1);
            without_state += u32::from(mission.state.newest().is_none());
        }
        let rejects = &mission.state.integrity.rejects;
        assert!(mission.raised.is_empty(), "{sensors:?}: {:?}, {rejects}", mission.raised);
        // The first seconds, before there is a velocity.
        assert!(without_state <= 3, "{sensors:?}: {without_state} s");
    }
}

#[test]
fn a_frozen_position_of_a_moving_craft_is_not_used() {
    for sensors in ALL {
        // Straight on at 1 m/s, and on a random course, slower and with turns.
        for (is_straight, within_s) in [(true, 8.0), (false, 16.0)] {
            let mut mission = Mission::new(sensors, 1);
            mission.nominal(60);
            if is_straight {
                mission.requested.speed = 1.0;
                mission.requested_until_s = f64::INFINITY;
                mission.nominal(10);
            }
            let frozen = mission.position;
            mission.raises_within(within_s, Alarm::PositionFrozen, &mut |_, measured| at(frozen, measured));
            mission.has_no_state_for(5);
        }
    }
}

#[test]
fn a_receiver_frozen_at_the_berth_is_detected_at_departure() {
    for sensors in ALL {
        let mut mission = Mission::straight_on_after(sensors, 1, 0);
        mission.requested.speed = 0.0;
        mission.nominal(30);
        let frozen = mission.position;
        let mut stays = |_: &Mission, measured| at(frozen, measured);
        assert_eq!(mission.detection(600.0, Alarm::NoWay, &mut stays), None, "{sensors:?}");
        mission.requested.speed = 1.0;
        mission.raises_within(12.0, Alarm::PositionFrozen, &mut stays);
    }
}

#[test]
fn a_receiver_frozen_in_all_values_is_detected_by_the_references() {
    let mut mission = Mission::straight_on_after(Sensors::Filter, 2, 30);
    let frozen = mission.position;
    let still = CraftMeasurement::GroundVelocity(Vector2::zeros());
    let mut stays = |_: &Mission, measured| instead(still, at(frozen, measured));
    // 10 m at 1 m/s.
    mission.raises_within(12.0, Alarm::NoWay, &mut stays);
    mission.raises_within(21.0, Alarm::PositionFrozen, &mut stays);
}

#[test]
fn two_vehicles_with_one_number_have_no_position_until_one_is_silent() {
    for (sensors, within_s) in [(Sensors::Filter, 1.0), (Sensors::Receiver(1.5), 10.0)] {
        let mut mission = Mission::new(sensors, 3);
        mission.nominal(60);
        let mut is_other = false;
        mission.raises_within(within_s, Alarm::PositionJumps, &mut |mission, measured| {
            is_other ^= matches!(measured, CraftMeasurement::Position(_));
            let other = mission.position + Vector2::new(300.0, 0.0);
            if is_other { at(other, measured) } else { measured }
        });
        mission.has_no_state_for(10);
    }
}

#[test]
fn one_outlier_is_ignored_and_a_lasting_jump_is_accepted_after_three_seconds() {
    let far = Vector2::new(0.0, 200.0);
    for sensors in ALL {
        let mut mission = Mission::new(sensors, 4);
        mission.nominal(60);
        let mut outliers = 0;
        let mut once = |mission: &Mission, measured| match measured {
            CraftMeasurement::Position(_) if outliers == 0 => {
                outliers += 1;
                at(mission.position + far, measured)
            }
            other => other,
        };
        assert_eq!(mission.detection(10.0, Alarm::PositionJumps, &mut once), None);
        mission.raises_within(5.0, Alarm::PositionJumped, &mut |mission, measured| {
            at(mission.position + far, measured)
        });
        assert!((mission.position_error() - far).norm() < 10.0);
    }
}

#[test]
fn a_second_receiver_is_named_from_thirty_metres_away() {
    for (off_m, is_named) in [(20.0, false), (60.0, true)] {
        let mut mission = Mission::new(Sensors::Filter, 22);
        mission.nominal(60);
        for _ in 0..100 {
            mission.step(&mut |_, measured| measured);
            let there = mission.position + Vector2::new(off_m, 0.0);
            let second = CraftMeasurement::Position(place(&there));
            mission.state.take(mission.now_s(), SENSOR, &second);
        }
        let named = mission.raised.contains(&Alarm::PositionsDiffer);
        assert_eq!(named, is_named, "{off_m} m");
    }
}

#[test]
fn a_slow_craft_whose_receiver_omits_the_course_raises_no_alarm() {
    let mut state = CraftState::default();
    for t_s in (0..120).map(f64::from) {
        let position = Vector2::new(0.45 * t_s, 0.0);
        for measured in [
            CraftMeasurement::Heading(0.0),
            CraftMeasurement::Position(place(&position)),
            CraftMeasurement::GroundSpeed(0.45),
        ] {
            state.take(t_s, AUTOPILOT, &measured);
        }
        assert_eq!(state.integrity.alarms().next(), None, "{t_s} s");
    }
}

#[test]
fn a_velocity_that_contradicts_the_positions_is_not_used() {
    for (sensors, wrong) in [
        (Sensors::Filter, Vector2::zeros()),
        (Sensors::Receiver(1.5), Vector2::zeros()),
        (Sensors::Filter, Vector2::new(0.0, -1.5)),
    ] {
        let mut mission = Mission::straight_on_after(sensors, 11, 50);
        let mut stuck = |_: &Mission, measured| instead(CraftMeasurement::GroundVelocity(wrong), measured);
        mission.raises_within(20.0, Alarm::VelocityContradicts, &mut stuck);
        for _ in 0..30 {
            mission.step(&mut stuck);
        }
        assert!(mission.velocity_error().norm() < 1.2, "{sensors:?}");
        mission.nominal(30);
        assert_eq!(mission.state.integrity.alarms().next(), None, "it is right again");
    }
}

#[test]
fn the_state_survives_two_seconds_of_a_wrong_velocity() {
    for sensors in ALL {
        let mut mission = Mission::new(sensors, 12);
        mission.nominal(100);
        let wrong = CraftMeasurement::GroundVelocity(Vector2::new(-15.0, 9.0));
        for step in 0..6_020 {
            mission.step(&mut |_, measured| if step < 20 { instead(wrong, measured) } else { measured });
            assert!(mission.state.newest().is_some());
            assert!(mission.state.current.current.norm() < 1.0);
        }
    }
}

#[test]
fn a_frozen_heading_of_a_turning_craft_is_not_used() {
    for (sensors, within_s) in [(Sensors::Filter, 10.0), (Sensors::Receiver(1.5), 40.0)] {
        let mut mission = Mission::straight_on_after(sensors, 13, 60);
        mission.requested.speed = 1.0;
        let (frozen, start_s) = (mission.heading, mission.now_s());
        // Turns steadily to starboard.
        let mut is_raised = false;
        while !is_raised && mission.now_s() < start_s + within_s {
            mission.requested.heading = wrap(mission.heading + 0.3);
            let mut stays = |_: &Mission, measured| instead(CraftMeasurement::Heading(frozen), measured);
            is_raised = mission.detection(1.0, Alarm::HeadingFrozen, &mut stays).is_some();
        }
        assert!(is_raised, "{sensors:?}");
        mission.has_no_state_for(5);
    }
}

#[test]
fn a_second_compass_is_named_from_twenty_degrees_off_and_the_first_one_is_used() {
    for (off, is_named) in [(0.2, false), (1.2, true)] {
        let mut mission = Mission::new(Sensors::Filter, 14);
        mission.nominal(60);
        for tenth in 0..300 {
            mission.step(&mut |_, measured| measured);
            let second = CraftMeasurement::Heading(wrap(mission.heading + off));
            mission.state.take(mission.now_s(), SENSOR, &second);
            let state = mission.state.newest().expect("the first one is right");
            assert!(wrap(state.heading - mission.heading).abs() < 0.1);
            let named = mission.raised.contains(&Alarm::HeadingsDiffer);
            assert!(tenth < 60 || named == is_named, "{off} rad: {tenth}");
        }
    }
}

#[test]
fn another_source_is_used_from_two_seconds_of_silence_until_the_first_returned_for_five() {
    let mut state = CraftState::default();
    let here = CraftMeasurement::Position(place(&Vector2::zeros()));
    for (from, to, first, used) in [
        (0, 10, Some(0.0), 0.0),
        (11, 12, None, 0.0),
        (13, 20, None, 0.1),
        (20, 25, Some(0.0), 0.1),
        (25, 26, Some(0.0), 0.0),
    ] {
        for t_s in (from..to).map(f64::from) {
            state.take(t_s, AUTOPILOT, &here);
            state.take(t_s, AUTOPILOT, &CraftMeasurement::GroundSpeed(0.0));
            if let Some(first) = first {
                state.take(t_s, AUTOPILOT, &CraftMeasurement::Heading(first));
            }
            state.take(t_s, SENSOR, &CraftMeasurement::Heading(0.1));
            assert_eq!(state.newest().map(|state| state.heading), Some(used), "{t_s} s");
        }
    }
}

#[test]
fn a_jump_of_little_more_than_the_gate_is_named() {
    for seed in 17..22 {
        let mut mission = Mission::new(Sensors::Filter, seed);
        mission.nominal(60);
        // 40° and 22 m: the gates, once opened for a while, contain them.
        let mut off = |_: &Mission, measured| turned(0.7, measured);
        mission.raises_within(3.5, Alarm::HeadingJumped, &mut off);
        mission.raises_within(3.5, Alarm::PositionJumped, &mut |mission, measured| {
            at(mission.position + Vector2::new(0.0, 22.0), turned(0.7, measured))
        });
    }
}

#[test]
fn a_mirrored_yaw_is_named_at_the_first_turn_and_is_invisible_on_a_northern_course() {
    for (mirrored_rate, within_s) in [(1.0, 3.0), (-1.0, 12.0)] {
        let mut mission = Mission::new(Sensors::Filter, 18);
        let mut mirrored = |_: &Mission, measured| match measured {
            CraftMeasurement::Heading(heading) => CraftMeasurement::Heading(-heading),
            CraftMeasurement::YawRate(rate) => CraftMeasurement::YawRate(mirrored_rate * rate),
            other => other,
        };
        assert_eq!(mission.detection(59.0, Alarm::HeadingContradicts, &mut mirrored), None);
        mission.requested.heading = 1.5;
        mission.requested_until_s = f64::INFINITY;
        mission.raises_within(within_s, Alarm::HeadingContradicts, &mut mirrored);
    }
}

#[test]
fn a_yaw_rate_that_is_always_zero_contradicts_no_heading() {
    let mut mission = Mission::new(Sensors::Filter, 18);
    let mut unmeasured = |_: &Mission, measured| instead(CraftMeasurement::YawRate(0.0), measured);
    mission.requested.heading = 1.5;
    mission.requested_until_s = f64::INFINITY;
    let found = mission.detection(59.0, Alarm::HeadingContradicts, &mut unmeasured);
    assert_eq!(found, None);
}

#[test]
fn a_position_that_drifts_from_the_velocity_at_half_a_metre_per_second_is_named() {
    for (sensors, within_s) in [(Sensors::Filter, 16.0), (Sensors::Receiver(1.5), 20.0)] {
        let mut mission = Mission::straight_on_after(sensors, 19, 50);
        let start_s = mission.now_s();
        let mut drifts = |mission: &Mission, measured| {
            let off = direction(2.0) * (0.5 * (mission.now_s() - start_s));
            at(mission.position + off, measured)
        };
        mission.raises_within(within_s, Alarm::PositionDrifts, &mut drifts);
        for _ in 0..50 {
            mission.step(&mut drifts);
            assert!(mission.state.integrity.alarms().any(|alarm| alarm == Alarm::PositionDrifts));
        }
        assert!(mission.state.newest().is_some(), "the positions count");
    }
}

#[test]
fn a_compass_frozen_on_a_straight_course_is_named_by_a_gyro_in_waves_or_at_the_first_turn() {
    let mut with_gyro = Mission::straight_on_after(Sensors::Filter, 20, 50);
    let frozen = with_gyro.heading;
    let mut stays = |_: &Mission, measured| instead(CraftMeasurement::Heading(frozen), measured);
    with_gyro.raises_within(12.0, Alarm::HeadingFrozen, &mut stays);

    let mut without = Mission::straight_on_after(Sensors::Receiver(1.5), 20, 50);
    let frozen = without.heading;
    let mut stays = |_: &Mission, measured| instead(CraftMeasurement::Heading(frozen), measured);
    assert_eq!(without.detection(45.0, Alarm::HeadingFrozen, &mut stays), None);
    without.requested.heading = 2.5;
    without.raises_within(15.0, Alarm::HeadingFrozen, &mut stays);
}

#[test]
fn noise_of_few_positions_is_as_rarely_a_drift_as_that_of_many() {
    let (mut draw, mut beyond) = (Random(23), [0; 2]);
    for _ in 0..20_000 {
        // A receiver at 1 Hz for 10 s.
        let noise = (0..11).map(|t_s| (f64::from(t_s), draw.normals()));
        let trend = trend(noise).expect("are enough");
        for (count, sigmas) in beyond.iter_mut().zip([3.0, 5.0]) {
            *count += u32::from(trend.slope.norm() > trend.slope_beyond(sigmas));
        }
    }
    // exp(−4.5) of them are 222, with a standard deviation of 15; exp(−12.5) are 0.07.
    assert!((177..=267).contains(&beyond[0]) && beyond[1] == 0, "{beyond:?}");
}
