//! Tests of the learnt craft against ships with their own equations.

#![expect(
    clippy::disallowed_macros,
    reason = "the planner has no output, its tests print what they measured"
)]

use nalgebra::Vector2;

use super::*;
use crate::{
    craft::response::limited_heading,
    facts::{
        angle::{Heading, wrap},
        asc::{Asc, Limits},
        auv::{Auv, VehicleId},
        evidence::AuvState,
        goal::Goal,
        previous_plan::{PreviousCraft, PreviousPlan},
        reference::{Reference, TrajectoryPoint},
    },
    snapshot::request::PlanRequest,
    tuned::CraftNumbers,
};

const TUNED: &CraftNumbers = &CraftNumbers::DEFAULT;

impl From<&CraftDescription> for Prior {
    fn from(declared: &CraftDescription) -> Self {
        Self::new(declared, TUNED)
    }
}

/// Pseudo-random numbers in [−1, 1): a linear congruence.
struct Noise(u64);

impl Noise {
    fn next(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        f64::from(u32::try_from(self.0 >> 33).expect("has 31 bits")) / f64::from(1_u32 << 30) - 1.0
    }

    /// A number with standard deviation `sigma`.
    fn of(&mut self, sigma: f64) -> f64 {
        sigma * (0..12).map(|_| self.next()).sum::<f64>() / 2.0
    }
}

/// A craft with first-order loops, in steps of 10 ms.
#[derive(Clone, Copy)]
struct Ship {
    position: Vector2<f64>,
    psi: f64,
    rate: f64,
    speed: f64,
    heading_lag: f64,
    surge_lag: f64,
    current: Vector2<f64>,
    holds_course: bool,
    holds_ground_speed: bool,
    /// Seconds under way, and those after which its heading and its speed are stuck.
    seconds: u32,
    heading_stuck_after: u32,
    speed_stuck_after: u32,
}

impl Ship {
    const RATE_MAX: f64 = 0.3;
    const ACCELERATION_MAX: f64 = 0.2;

    fn new(heading_lag: f64, surge_lag: f64) -> Self {
        Self {
            position: Vector2::zeros(),
            psi: 0.0,
            rate: 0.0,
            speed: 0.6,
            heading_lag,
            surge_lag,
            current: Vector2::zeros(),
            holds_course: false,
            holds_ground_speed: false,
            seconds: 0,
            heading_stuck_after: u32::MAX,
            speed_stuck_after: u32::MAX,
        }
    }

    fn over_ground(&self) -> Vector2<f64> {
        Vector2::new(self.psi.cos(), self.psi.sin()) * self.speed + self.current
    }

    fn second(&mut self, speed: f64, heading: f64) {
        let (stuck_heading, stuck_speed) = (
            self.heading_stuck_after <= self.seconds,
            self.speed_stuck_after <= self.seconds,
        );
        self.seconds += 1;
        for _ in 0..100 {
            let ground = self.over_ground();
            let held = if self.holds_course {
                ground.y.atan2(ground.x)
            } else {
                self.psi
            };
            let measured = if self.holds_ground_speed {
                ground.x * self.psi.cos() + ground.y * self.psi.sin()
            } else {
                self.speed
            };
            self.rate = (wrap(heading - held) / self.heading_lag).clamp(-Self::RATE_MAX, Self::RATE_MAX);
            if stuck_heading {
                self.rate = 0.0;
            }
            let mut acceleration =
                ((speed - measured) / self.surge_lag).clamp(-Self::ACCELERATION_MAX, Self::ACCELERATION_MAX);
            if stuck_speed {
                acceleration = 0.0;
            }
            self.position += ground * 0.01;
            self.psi += 0.01 * self.rate;
            self.speed += 0.01 * acceleration;
        }
    }
}

/// The estimate of the ship after `seconds` of references from `law`, with `noise` (rad, m/s).
fn learnt(
    ship: &mut Ship,
    declared: &CraftDescription,
    seconds: u32,
    noise: (f64, f64),
    mut law: impl FnMut(u32) -> (f64, f64),
    mut look: impl FnMut(&CraftEstimate),
) -> CraftEstimate {
    let prior = Prior::from(declared);
    let mut random = Noise(7);
    let mut known: Option<(CraftEstimate, Reference)> = None;
    for second in 0..seconds {
        let mut seen = observation(declared);
        seen.t_s = f64::from(second);
        seen.asc = Asc {
            yaw_rate_radps: ship.rate,
            ..Asc::new(
                ship.position,
                Heading::new(ship.psi + random.of(noise.0)),
                ship.speed + random.of(noise.1),
            )
            .with_ground_velocity(Some(ship.over_ground()))
        };
        seen.current = Some(ship.current.into());
        seen.previous_plan =
            known.map(|(estimate, asked)| previous(f64::from(second) - 1.0, &estimate, asked));
        let estimate = CraftEstimate::new(&seen.craft_observation(&Limits::ANY), &prior);
        look(&estimate);
        let (speed, heading) = law(second);
        let asked = Reference {
            speed,
            heading: Heading::new(heading),
        };
        ship.second(speed, heading);
        known = Some((estimate, asked));
    }
    known.expect("at least a second").0
}

fn previous(time: f64, estimate: &CraftEstimate, asked: Reference) -> PreviousPlan {
    PreviousPlan {
        trajectory: vec![TrajectoryPoint::new(
            time,
            Vector2::zeros(),
            0.0,
            Heading::new(0.0),
        )],
        craft_estimate: Some(PreviousCraft {
            asked_speed_mps: asked.speed,
            asked_heading_rad: asked.heading.radians(),
            memory: estimate.memory().to_vec(),
        }),
        reference: Some(asked.into()),
        ..PreviousPlan::default()
    }
}

fn observation(declared: &CraftDescription) -> PlanRequest {
    let id = VehicleId("a".to_owned());
    PlanRequest {
        craft: Some(declared.clone()),
        ..PlanRequest::new(
            0.0,
            Asc::new(Vector2::zeros(), Heading::new(0.0), 0.6),
            vec![Auv::new(
                id.clone(),
                AuvState::new(Vector2::zeros(), 5.0, crate::facts::angle::Course::new(0.0), 0.2),
            )],
            Goal::Track { auv: id },
        )
    }
}

/// Loops without delay, with known limits and unknown time constants.
fn undeclared() -> CraftDescription {
    CraftDescription {
        heading_loop: HeadingLoop {
            delay_s: Some(0.0),
            rate_max_radps: Some(Ship::RATE_MAX),
            ..HeadingLoop::default()
        },
        surge_loop: SurgeLoop {
            delay_s: Some(0.0),
            acceleration_max_mps2: Some(Ship::ACCELERATION_MAX),
            deceleration_max_mps2: Some(Ship::ACCELERATION_MAX),
            integrates: Some(false),
            ..SurgeLoop::default()
        },
        ..CraftDescription::default()
    }
}

fn declared(lag: f64) -> CraftDescription {
    let mut declared = CraftDescription {
        speed_held: Some(SpeedReference::ThroughWater),
        heading_held: Some(HeadingReference::Heading),
        ..undeclared()
    };
    declared.heading_loop.time_constant_s = Some(lag);
    declared.surge_loop.time_constant_s = Some(lag);
    declared
}

/// 0.4 rad to either side, 0.4 m/s and 0.8 m/s, 20 s each, alternating.
fn zig_zag(second: u32) -> (f64, f64) {
    (
        if ((second + 10) / 20).is_multiple_of(2) {
            0.4
        } else {
            0.8
        },
        if (second / 20).is_multiple_of(2) {
            0.4
        } else {
            -0.4
        },
    )
}

#[test]
fn lags_are_learnt_to_a_tenth_by_a_zig_zag() {
    for (heading_lag, surge_lag) in [(1.0, 4.0), (2.0, 2.0), (4.0, 1.2)] {
        let mut ship = Ship::new(heading_lag, surge_lag);
        let known = learnt(&mut ship, &undeclared(), 300, (0.01, 0.01), zig_zag, |_| ());
        let (heading, _) = known.heading_time();
        let (surge, _) = known.surge_time();
        assert!(
            (heading / heading_lag - 1.0).abs() < 0.1,
            "{heading} of {heading_lag}"
        );
        assert!((surge / surge_lag - 1.0).abs() < 0.1, "{surge} of {surge_lag}");
    }
}

#[test]
fn an_unexcited_parameter_keeps_its_prior() {
    let prior = Prior::from(&undeclared());
    let mut ship = Ship::new(6.0, 6.0);
    let known = learnt(&mut ship, &undeclared(), 600, (0.0, 0.0), |_| (0.6, 0.0), |_| ());
    assert!(
        (known.heading.y - prior.heading_lag.mean).abs() < 1e-3,
        "{known:?}"
    );
    assert!((known.surge.y - prior.surge_lag.mean).abs() < 1e-3, "{known:?}");
    // Its uncertainty stays.
    assert!(known.heading_covariance.m22 > 0.9 * prior.heading_lag.variance);
    assert!(known.surge_covariance.m22 > 0.9 * prior.surge_lag.variance);
}

/// In still water the modes are indistinguishable.
#[test]
fn modes_of_the_loops_are_found_in_a_current_and_not_in_still_water() {
    let over_ground = (HeadingReference::Course, SpeedReference::OverGround);
    let through_water = (HeadingReference::Heading, SpeedReference::ThroughWater);
    for (holds, current, expected) in [
        (true, Vector2::new(0.2, -0.25), over_ground),
        (false, Vector2::new(0.2, -0.25), through_water),
        (true, Vector2::zeros(), through_water),
        (false, Vector2::zeros(), through_water),
    ] {
        let mut ship = Ship {
            current,
            holds_course: holds,
            holds_ground_speed: holds,
            ..Ship::new(2.0, 2.0)
        };
        let known = learnt(&mut ship, &undeclared(), 400, (0.02, 0.02), zig_zag, |_| ());
        let modes = known.modes(&Prior::from(&undeclared()));
        assert_eq!(modes, expected, "{holds} {current}: {:?}", known.evidence);
    }
}

#[test]
fn declared_modes_are_not_estimated() {
    let mut ship = Ship {
        current: Vector2::new(0.2, -0.25),
        holds_course: true,
        ..Ship::new(2.0, 2.0)
    };
    let known = learnt(&mut ship, &declared(2.0), 400, (0.02, 0.02), zig_zag, |_| ());
    assert_eq!(
        known.modes(&Prior::from(&declared(2.0))).0,
        HeadingReference::Heading
    );
}

#[test]
fn a_craft_as_declared_raises_no_alarm_in_ten_hours() {
    let mut alarms = 0;
    let mut ship = Ship::new(2.0, 2.0);
    let look = |known: &CraftEstimate| alarms += u32::from(known.monitor.alarm);
    let _ = learnt(&mut ship, &declared(2.0), 36_000, (0.03, 0.03), zig_zag, look);
    assert_eq!(alarms, 0);
}

/// A description with this lag, or without one.
fn maybe_declared(lag: Option<f64>) -> CraftDescription {
    lag.map_or_else(undeclared, declared)
}

/// Seconds of the first alarms for headings and speeds without effect.
fn noticed(ship: &mut Ship, declared: &CraftDescription, noise: f64) -> [Option<u32>; 2] {
    let (mut second, mut at) = (0, [None; 2]);
    let look = |known: &CraftEstimate| {
        let missing = [known.heading_effect.is_missing(), known.speed_effect.is_missing()];
        for (at, missing) in at.iter_mut().zip(missing) {
            *at = at.or(missing.then_some(second));
            assert!(known.monitor.alarm || !missing);
        }
        second += 1;
    };
    let _ = learnt(ship, declared, 200, (noise, noise), zig_zag, look);
    at
}

#[test]
fn references_without_effect_are_noticed_within_ten_seconds() {
    for (said, lag) in [
        (None, 0.8),
        (None, 2.0),
        (None, 6.0),
        (Some(1.0), 1.2),
        (Some(2.0), 2.0),
        (Some(3.0), 4.0),
    ] {
        for noise in [0.0, 0.01, 0.03] {
            // The speed reference changes at 110 s, the heading reference at 120 s.
            let declared = maybe_declared(said);
            let mut jammed = Ship {
                heading_stuck_after: 105,
                ..Ship::new(lag, lag)
            };
            let mut adrift = Ship {
                speed_stuck_after: 105,
                ..Ship::new(lag, lag)
            };
            let (heading, speed) = (
                noticed(&mut jammed, &declared, noise),
                noticed(&mut adrift, &declared, noise),
            );
            println!("declared {said:?} s, lag {lag} s, noise {noise}: {heading:?}, {speed:?}");
            assert!(heading[1].is_none() && heading[0].is_some_and(|at| (120..=130).contains(&at)));
            assert!(speed[0].is_none() && speed[1].is_some_and(|at| (110..=120).contains(&at)));
        }
    }
}

/// A speed loop with `reference` that is stuck for a second; the slowest craft goes half the way.
fn stuck(before: &Effect, reference: f64) -> Effect {
    let half = |from: f64| from + 0.5 * (reference - from);
    before.after(
        (reference, before.seen),
        (TUNED.effect_speed_sigma, TUNED),
        1.0,
        |a, b| a - b,
        half,
    )
}

#[test]
fn a_response_four_seconds_late_is_no_fault_for_any_step() {
    for step in [0.1, 1.0, 100.0] {
        let mut effect = Effect::new(0.0);
        for second in 1..=10 {
            effect = stuck(&effect, step);
            assert!(4 < second || !effect.is_missing(), "{step}: {second} s");
        }
        assert!(effect.is_missing(), "{step}");
    }
}

#[test]
fn a_craft_beyond_an_approaching_reference_adds_no_evidence() {
    let mut effect = Effect {
        expected: 1.7,
        ..Effect::new(1.95)
    };
    for second in 0..30 {
        effect = stuck(&effect, 1.7 + 0.005 * f64::from(second));
        assert_eq!(effect.evidence, 0.0, "{second} s");
    }
}

#[test]
fn a_loop_without_effect_is_not_learnt() {
    let mut jammed = Ship {
        heading_stuck_after: 105,
        ..Ship::new(2.0, 2.0)
    };
    let known = learnt(&mut jammed, &undeclared(), 400, (0.02, 0.02), zig_zag, |_| ());
    let prior = Prior::from(&undeclared());
    assert!(known.heading_effect.is_missing());
    assert_eq!((known.heading.y, known.heading.z), (prior.heading_lag.mean, 0.0));
    let model = |estimate: &CraftEstimate| {
        CraftModel::learnt(&prior, estimate, &Limits::ANY, &Vector2::zeros(), TUNED)
    };
    let rate = model(&known).limits.turn_rate_max;
    assert_eq!(rate, 0.5 * Ship::RATE_MAX);
    // The loop works again.
    jammed.heading_stuck_after = u32::MAX;
    let known = learnt(&mut jammed, &undeclared(), 120, (0.02, 0.02), zig_zag, |_| ());
    assert!(!known.heading_effect.is_missing() && model(&known).limits.turn_rate_max > rate);
}

#[test]
fn references_with_an_effect_raise_no_alarm_in_ten_hours() {
    for (said, lag) in [
        (None, 0.5),
        (None, 2.0),
        (None, 8.0),
        (Some(1.0), 0.7),
        (Some(2.0), 2.8),
        (Some(6.0), 8.0),
    ] {
        let mut most = [0.0_f64; 2];
        let mut random = Noise(9);
        // Random steps every 20 s, with an oscillation in between.
        let mut to = (0.6, 0.0);
        let law = |second: u32| {
            if second.is_multiple_of(20) {
                to = (0.7 + 0.5 * random.next(), 3.0 * random.next());
            }
            let swing = 0.2 * (f64::from(second) * 0.7).sin();
            (to.0, wrap(to.1 + swing))
        };
        let look = |known: &CraftEstimate| {
            for (most, effect) in most.iter_mut().zip([known.heading_effect, known.speed_effect]) {
                *most = most.max(effect.evidence);
                assert!(!effect.is_missing());
            }
        };
        let _ = learnt(
            &mut Ship::new(lag, lag),
            &maybe_declared(said),
            36_000,
            (0.03, 0.03),
            law,
            look,
        );
        println!("declared {said:?} s, lag {lag} s: evidence {most:.1?} of 9");
    }
}

/// Largest statistic of the monitor, and its alarm, in ten minutes of turns of twice `amplitude`,
/// rad, every 20 s, with 2 s declared.
fn monitored(lag: f64, amplitude: f64) -> (f64, bool) {
    let (mut worst, mut alarm) = (0.0_f64, false);
    let look = |known: &CraftEstimate| {
        worst = worst.max(known.monitor.statistic);
        alarm |= known.monitor.alarm;
    };
    let law = |second| {
        let (speed, heading) = zig_zag(second);
        (speed, heading * (amplitude / 0.4))
    };
    let _ = learnt(
        &mut Ship::new(lag, lag),
        &declared(2.0),
        600,
        (0.03, 0.03),
        law,
        look,
    );
    (worst, alarm)
}

#[test]
fn a_craft_four_times_slower_than_declared_raises_the_alarm_in_hard_turns() {
    // Turns of 0.8 rad are insufficient: the statistic reaches 3.6 of the required 6.
    for amplitude in [0.8, 1.2, 1.5] {
        let (_, alarm) = monitored(8.0, amplitude);
        assert!(alarm, "{amplitude}");
        let (worst, alarm) = monitored(2.0, amplitude);
        assert!(!alarm && worst < 0.5, "{amplitude}: {worst}");
    }
}

#[test]
fn a_memory_is_restored_to_the_bit_and_invalid_ones_are_refused() {
    let mut ship = Ship::new(3.0, 2.0);
    let known = learnt(&mut ship, &undeclared(), 90, (0.02, 0.02), zig_zag, |_| ());
    let memory = known.memory();
    let read = CraftEstimate::from_memory(&memory).expect("was just written");
    assert_eq!(read.memory().map(f64::to_bits), memory.map(f64::to_bits));
    assert_eq!(read, known, "all of the estimate is in it");
    assert_eq!(CraftEstimate::from_memory(&[]), None);
    // An earlier version had no tests for effects.
    let earlier = CraftEstimate::from_memory(&memory[..43]).expect("is one, too");
    assert_eq!((earlier.monitor, earlier.surge), (known.monitor, known.surge));
    assert_eq!(earlier.speed_effect, Effect::new(known.surge.x));
    assert_eq!(CraftEstimate::from_memory(&memory[1..]), None);
    assert_eq!(
        CraftEstimate::from_memory(&[memory.as_slice(), &[0.0]].concat()),
        None
    );
    for place in 0..MEMORY_LENGTH {
        for wrong in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1.0e300] {
            let mut garbage = memory;
            garbage[place] = wrong;
            assert_eq!(CraftEstimate::from_memory(&garbage), None, "{place}: {wrong}");
        }
    }
}

#[test]
fn a_heading_reference_turns_with_the_bow_in_steps_within_the_slew() {
    let mut random = Noise(3);
    for _ in 0..20_000 {
        let [asked, from, bow] = [(); 3].map(|()| std::f64::consts::PI * random.next());
        let slew = 0.5 * random.next().abs();
        let heading = |angle| Heading::new(angle);
        let given = limited_heading(heading(asked), heading(from), heading(bow), slew).radians();
        assert!(given.is_finite());
        let (ahead, wanted) = (wrap(from - bow), wrap(asked - bow));
        let side = wrap(given - bow);
        assert!(
            side.abs() < 2.6 + 1e-12,
            "never so far that the bow would take the other way round"
        );
        if ahead.abs() <= 2.6 {
            assert!(wrap(given - from).abs() < slew + 1e-12, "{given} from {from}");
        }
        // Never beyond the request, seen from the bow.
        let (least, most) = (ahead.min(wanted), ahead.max(wanted));
        let within = |side: f64| (least.min(2.6) - 1e-12..=most.max(-2.6) + 1e-12).contains(&side);
        assert!(within(side), "{side} is not between {ahead} and {wanted}");
        // A near request is met exactly.
        if (wanted - ahead).abs() < slew && wanted.abs() < 2.6 {
            assert!(wrap(given - asked).abs() < 1e-12);
        }
    }
}

#[test]
fn a_command_has_the_course_and_speed_over_ground_that_the_loops_hold() {
    let mut random = Noise(5);
    for _ in 0..1000 {
        let (psi, speed) = (3.0 * random.next(), 0.9 + 0.8 * random.next());
        let (north, east) = (0.5 * random.next(), 0.5 * random.next());
        let reference = Reference {
            speed,
            heading: Heading::new(psi),
        };
        let command = |heading_held, speed_held| {
            let craft = Craft {
                speed_held,
                heading_held,
                ..Craft::GENERIC
            };
            craft.command(&reference, &Vector2::new(north, east), 1.5)
        };
        assert_eq!(
            command(HeadingReference::Heading, SpeedReference::ThroughWater),
            reference
        );
        // Over ground, component by component.
        let (v_n, v_e) = (speed * psi.cos() + north, speed * psi.sin() + east);
        let along = v_n * psi.cos() + v_e * psi.sin();
        let over_ground = command(HeadingReference::Heading, SpeedReference::OverGround);
        assert!((over_ground.speed - along.clamp(0.0, 1.5)).abs() < 1e-12);
        assert_eq!(over_ground.heading, reference.heading);
        let course = command(HeadingReference::Course, SpeedReference::ThroughWater);
        assert_eq!(course.speed, speed);
        let expected = if v_n.hypot(v_e) < 0.05 {
            psi
        } else {
            v_e.atan2(v_n)
        };
        assert!(wrap(course.heading.radians() - expected).abs() < 1e-12);
    }
}

#[test]
fn without_a_ground_velocity_the_current_is_from_positions_else_from_memory() {
    let prior = Prior::from(&undeclared());
    let undeclared_craft = observation(&undeclared());
    let start = CraftEstimate::new(&undeclared_craft.craft_observation(&Limits::ANY), &prior);
    assert_eq!(start.current_from_positions(), None, "nothing has moved yet");
    let asked = Reference {
        speed: 0.6,
        heading: Heading::new(0.0),
    };
    let (remembered, learnt) = (Vector2::new(0.1, -0.2), Vector2::new(0.0, 0.15));
    let with = |estimate: CraftEstimate, ground_velocity| {
        let mut later = observation(&undeclared());
        later.t_s = 1.0;
        later.asc = later.asc.with_ground_velocity(ground_velocity);
        later.previous_plan = Some(PreviousPlan {
            current: Some(remembered.into()),
            ..previous(0.0, &estimate, asked)
        });
        later.known_current()
    };
    assert_eq!(with(start, None), Some(remembered));
    let knowing = CraftEstimate {
        current: learnt,
        current_variance: 0.0025,
        ..start
    };
    assert_eq!(with(knowing, None), Some(learnt));
    let measured = with(knowing, Some(Vector2::new(0.6, 0.0))).expect("is measured");
    let share = measured.norm() / remembered.norm();
    assert!(
        0.5 < share && share < 1.0,
        "it moves from {remembered} to 0: {measured}"
    );
}

#[test]
fn a_new_estimate_of_the_current_turns_a_command_no_faster_than_the_craft() {
    let craft = CraftDescription {
        heading_held: Some(HeadingReference::Course),
        speed_held: Some(SpeedReference::ThroughWater),
        ..undeclared()
    };
    let asked = Reference {
        speed: 0.6,
        heading: Heading::new(0.0),
    };
    let estimate = CraftEstimate::new(
        &observation(&craft).craft_observation(&Limits::ANY),
        &Prior::from(&craft),
    );
    let mut later = observation(&craft);
    later.t_s = 1.0;
    later.current = Some(Vector2::new(0.0, 0.5).into());
    later.previous_plan = Some(previous(0.0, &estimate, asked));
    let snapshot = crate::snapshot::build::Snapshot::try_from(later).expect("is in range");
    let course = snapshot.command(&asked).heading.radians();
    assert!((course - (0.5_f64 / 0.6).atan()).abs() < 1e-12);
    let calm = snapshot.slew_limited_command(&asked).heading.radians();
    assert!((calm - Ship::RATE_MAX).abs() < 1e-12, "{calm}");
    let turned = Reference {
        heading: Heading::new(0.5),
        ..asked
    };
    let calm = snapshot.slew_limited_command(&turned).heading.radians();
    assert!(
        (calm - 0.5).abs() < 1e-12,
        "as far as the reference itself: {calm}"
    );
}
