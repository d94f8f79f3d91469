//! Tests of the learnt craft against ships with their own equations.

use super::*;
use crate::{
    craft::response::{Slew, limited_heading},
    facts::{
        previous_plan::PreviousCraft,
        reference::{Reference, TrajectoryPoint},
    },
    tests::prelude::*,
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
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
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
    /// Its loops hold course and speed over ground.
    over_ground: bool,
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
            over_ground: false,
            seconds: 0,
            heading_stuck_after: u32::MAX,
            speed_stuck_after: u32::MAX,
        }
    }

    fn ground_velocity(&self) -> Vector2<f64> {
        direction(self.psi) * self.speed + self.current
    }

    fn second(&mut self, speed: f64, heading: f64) {
        let has_rudder = self.seconds < self.heading_stuck_after;
        let has_thrust = self.seconds < self.speed_stuck_after;
        self.seconds += 1;
        for _ in 0..100 {
            let ground = self.ground_velocity();
            let (held, measured) = if self.over_ground {
                (ground.y.atan2(ground.x), ground.dot(&direction(self.psi)))
            } else {
                (self.psi, self.speed)
            };
            let clamped =
                |rate: f64, most: f64, works: bool| if works { rate.clamp(-most, most) } else { 0.0 };
            self.rate = clamped(wrap(heading - held) / self.heading_lag, Self::RATE_MAX, has_rudder);
            let acceleration = (speed - measured) / self.surge_lag;
            self.position += ground * 0.01;
            self.psi += 0.01 * self.rate;
            self.speed += 0.01 * clamped(acceleration, Self::ACCELERATION_MAX, has_thrust);
        }
    }
}

/// The estimate of the ship after `seconds` of references from `law`, with `noise` (rad and m/s).
fn learnt(
    ship: &mut Ship,
    declared: &CraftDescription,
    seconds: u32,
    noise: f64,
    mut law: impl FnMut(u32) -> (f64, f64),
    mut look: impl FnMut(&CraftEstimate),
) -> CraftEstimate {
    let prior = Prior::from(declared);
    let mut random = Noise(7);
    let mut known: Option<(CraftEstimate, Reference)> = None;
    for second in 0..seconds {
        let mut seen = observation(declared);
        seen.t_s = f64::from(second);
        let heading = Heading::new(ship.psi + random.of(noise));
        let asc = Asc::new(ship.position, heading, ship.speed + random.of(noise));
        seen.asc = asc.with_ground_velocity(Some(ship.ground_velocity()));
        seen.asc.yaw_rate_radps = ship.rate;
        seen.current = Some(ship.current.into());
        seen.previous_plan =
            known.map(|(estimate, asked)| previous(f64::from(second) - 1.0, &estimate, asked));
        let estimate = CraftEstimate::new(&seen.craft_observation(&Limits::ANY), &prior);
        look(&estimate);
        let (speed, heading) = law(second);
        ship.second(speed, heading);
        known = Some((estimate, reference(speed, heading)));
    }
    known.expect("at least a second").0
}

fn reference(speed: f64, heading: f64) -> Reference {
    let heading = Heading::new(heading);
    Reference { speed, heading }
}

fn previous(time: f64, estimate: &CraftEstimate, asked: Reference) -> PreviousPlan {
    let point = TrajectoryPoint::new(time, Vector2::zeros(), 0.0, Heading::new(0.0));
    PreviousPlan {
        trajectory: vec![point],
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
    let auv = Auv::new(id.clone(), moving(0.0, 0.0, 5.0, 0.0, 0.2));
    let asc = Asc::new(Vector2::zeros(), Heading::new(0.0), 0.6);
    PlanRequest {
        craft: Some(declared.clone()),
        ..PlanRequest::new(0.0, asc, vec![auv], Goal::Track { auv: id })
    }
}

/// The estimate from a first look.
fn first_estimate(declared: &CraftDescription) -> CraftEstimate {
    let seen = observation(declared);
    CraftEstimate::new(&seen.craft_observation(&Limits::ANY), &Prior::from(declared))
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
    let is_even = |second: u32| (second / 20).is_multiple_of(2);
    let speed = if is_even(second + 10) { 0.4 } else { 0.8 };
    (speed, if is_even(second) { 0.4 } else { -0.4 })
}

#[test]
fn lags_are_learnt_to_a_tenth_by_a_zig_zag() {
    for (heading_lag, surge_lag) in [(1.0, 4.0), (2.0, 2.0), (4.0, 1.2)] {
        let mut ship = Ship::new(heading_lag, surge_lag);
        let known = learnt(&mut ship, &undeclared(), 300, 0.01, zig_zag, |_| ());
        near(known.heading_time().0 / heading_lag, 1.0, 0.1);
        near(known.surge_time().0 / surge_lag, 1.0, 0.1);
    }
}

#[test]
fn an_unexcited_parameter_keeps_its_prior() {
    let prior = Prior::from(&undeclared());
    let mut ship = Ship::new(6.0, 6.0);
    let known = learnt(&mut ship, &undeclared(), 600, 0.0, |_| (0.6, 0.0), |_| ());
    near(known.heading.y, prior.heading_lag.mean, 1e-3);
    near(known.surge.y, prior.surge_lag.mean, 1e-3);
    // Its uncertainty stays.
    assert!(known.heading_covariance.m22 > 0.9 * prior.heading_lag.variance);
    assert!(known.surge_covariance.m22 > 0.9 * prior.surge_lag.variance);
}

/// In still water the modes are indistinguishable; declared ones are not estimated.
#[test]
fn undeclared_modes_of_the_loops_are_found_in_a_current() {
    let mode = (HeadingReference::Course, SpeedReference::OverGround);
    let default = (HeadingReference::Heading, SpeedReference::ThroughWater);
    let (still, current) = (Vector2::zeros(), Vector2::new(0.2, -0.25));
    for (declared, over_ground, current, expected) in [
        (undeclared(), true, current, mode),
        (undeclared(), false, current, default),
        (undeclared(), true, still, default),
        (undeclared(), false, still, default),
        (declared(2.0), true, current, default),
    ] {
        let mut ship = Ship { current, over_ground, ..Ship::new(2.0, 2.0) };
        let known = learnt(&mut ship, &declared, 400, 0.02, zig_zag, |_| ());
        let modes = known.modes(&Prior::from(&declared));
        assert_eq!(modes, expected, "{over_ground} {current}: {:?}", known.evidence);
    }
}

#[test]
fn a_craft_as_declared_raises_no_alarm_in_ten_hours() {
    let mut alarms = 0;
    let mut ship = Ship::new(2.0, 2.0);
    let look = |known: &CraftEstimate| alarms += u32::from(known.monitor.alarm);
    let _ = learnt(&mut ship, &declared(2.0), 36_000, 0.03, zig_zag, look);
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
    let _ = learnt(ship, declared, 200, noise, zig_zag, look);
    at
}

#[test]
fn references_without_effect_are_noticed_within_ten_seconds() {
    for (said, lag) in
        [(None, 0.8), (None, 2.0), (None, 6.0), (Some(1.0), 1.2), (Some(2.0), 2.0), (Some(3.0), 4.0)]
    {
        for noise in [0.0, 0.01, 0.03] {
            // The speed reference changes at 110 s, the heading reference at 120 s.
            let sound = Ship::new(lag, lag);
            let mut jammed = Ship { heading_stuck_after: 105, ..sound };
            let mut adrift = Ship { speed_stuck_after: 105, ..sound };
            let [heading, speed] =
                [&mut jammed, &mut adrift].map(|ship| noticed(ship, &maybe_declared(said), noise));
            let case = format!("declared {said:?} s, lag {lag} s, noise {noise}: {heading:?}, {speed:?}");
            assert!(heading[0].is_some_and(|at| (120..=130).contains(&at)), "{case}");
            assert!(speed[1].is_some_and(|at| (110..=120).contains(&at)), "{case}");
            assert_eq!((heading[1], speed[0]), (None, None), "{case}");
        }
    }
}

/// A speed loop with `reference` that is stuck for a second; the slowest craft goes half the way.
fn stuck(before: &Effect, reference: f64) -> Effect {
    let half = |from: f64| from + 0.5 * (reference - from);
    let seen = (reference, before.seen);
    let sigma = (TUNED.effect_speed_sigma, TUNED);
    before.after(seen, sigma, 1.0, |a, b| a - b, half)
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
    let mut effect = Effect { expected: 1.7, ..Effect::new(1.95) };
    for second in 0..30 {
        effect = stuck(&effect, 1.7 + 0.005 * f64::from(second));
        assert_eq!(effect.evidence, 0.0, "{second} s");
    }
}

#[test]
fn a_loop_without_effect_is_not_learnt() {
    let mut jammed = Ship { heading_stuck_after: 105, ..Ship::new(2.0, 2.0) };
    let known = learnt(&mut jammed, &undeclared(), 400, 0.02, zig_zag, |_| ());
    let prior = Prior::from(&undeclared());
    assert!(known.heading_effect.is_missing());
    assert_eq!((known.heading.y, known.heading.z), (prior.heading_lag.mean, 0.0));
    let rate = |estimate: &CraftEstimate| {
        let model = CraftModel::learnt(&prior, estimate, &Limits::ANY, &Vector2::zeros(), TUNED);
        model.limits.turn_rate_max
    };
    assert_eq!(rate(&known), 0.5 * Ship::RATE_MAX);
    // The loop works again.
    jammed.heading_stuck_after = u32::MAX;
    let again = learnt(&mut jammed, &undeclared(), 120, 0.02, zig_zag, |_| ());
    assert!(!again.heading_effect.is_missing() && rate(&again) > rate(&known));
}

#[test]
fn references_with_an_effect_raise_no_alarm_in_ten_hours() {
    for (said, lag) in
        [(None, 0.5), (None, 2.0), (None, 8.0), (Some(1.0), 0.7), (Some(2.0), 2.8), (Some(6.0), 8.0)]
    {
        let mut random = Noise(9);
        // Random steps every 20 s, with an oscillation in between.
        let mut to = (0.6, 0.0);
        let law = |second: u32| {
            if second.is_multiple_of(20) {
                to = (0.7 + 0.5 * random.next(), 3.0 * random.next());
            }
            (to.0, wrap(to.1 + 0.2 * (f64::from(second) * 0.7).sin()))
        };
        let look = |known: &CraftEstimate| {
            let effects = [known.heading_effect, known.speed_effect];
            assert!(effects.iter().all(|effect| !effect.is_missing()), "{said:?} {lag}");
        };
        let declared = maybe_declared(said);
        let _ = learnt(&mut Ship::new(lag, lag), &declared, 36_000, 0.03, law, look);
    }
}

/// Largest statistic of the monitor, and its alarm, in ten minutes of turns by twice `amplitude`.
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
    let _ = learnt(&mut Ship::new(lag, lag), &declared(2.0), 600, 0.03, law, look);
    (worst, alarm)
}

#[test]
fn a_craft_four_times_slower_than_declared_raises_the_alarm_in_hard_turns() {
    // Turns of 0.8 rad are insufficient: the statistic reaches 3.6 of the required 6.
    for amplitude in [0.8, 1.2, 1.5] {
        assert!(monitored(8.0, amplitude).1, "{amplitude}");
        let (worst, alarm) = monitored(2.0, amplitude);
        assert!(!alarm && worst < 0.5, "{amplitude}: {worst}");
    }
}

#[test]
fn a_memory_is_restored_to_the_bit_and_invalid_ones_are_refused() {
    let mut ship = Ship::new(3.0, 2.0);
    let known = learnt(&mut ship, &undeclared(), 90, 0.02, zig_zag, |_| ());
    let memory = known.memory();
    let read = CraftEstimate::from_memory(&memory).expect("was just written");
    assert_eq!(read.memory().map(f64::to_bits), memory.map(f64::to_bits));
    assert_eq!(read, known, "all of the estimate is in it");
    // An earlier version had no tests for effects.
    for length in [43, 53] {
        let earlier = CraftEstimate::from_memory(&memory[..length]).expect("is one, too");
        assert_eq!(earlier.trial.real(), 0);
    }
    let earlier = CraftEstimate::from_memory(&memory[..43]).expect("is one, too");
    assert_eq!((earlier.monitor, earlier.surge), (known.monitor, known.surge));
    assert_eq!(earlier.speed_effect, Effect::new(known.surge.x));
    for invalid in [&[][..], &memory[1..], &[&memory[..], &[0.0]].concat()] {
        assert_eq!(CraftEstimate::from_memory(invalid), None);
    }
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
        let [asked, from, bow] = [(); 3].map(|()| Heading::new(std::f64::consts::PI * random.next()));
        let [step, leading_step, lead] = [0.5, 0.5, 3.0].map(|most| most * random.next().abs());
        let limits = Slew { step, leading_step, lead };
        let slew = step.max(leading_step);
        let given = limited_heading(asked, from, bow, limits).radians();
        assert!(given.is_finite());
        let [asked, from, bow] = [asked, from, bow].map(Heading::radians);
        let [ahead, wanted, side] = [from, asked, given].map(|angle| wrap(angle - bow));
        // Never so far that the bow would take the other way round.
        assert!(side.abs() < 2.6 + 1e-12, "{side}");
        if ahead.abs() <= 2.6 {
            assert!(wrap(given - from).abs() < slew + 1e-12, "{given} from {from}");
        }
        // Never beyond the request, seen from the bow.
        let (least, most) = (ahead.min(wanted).min(2.6), ahead.max(wanted).max(-2.6));
        assert!(least - 1e-12 <= side && side <= most + 1e-12, "{side}: {ahead} to {wanted}");
        // A near request is met exactly.
        if (wanted - ahead).abs() < step && wanted.abs() < 2.6 {
            near(wrap(given - asked), 0.0, 1e-12);
        }
    }
}

#[test]
fn the_reference_of_a_slow_craft_takes_the_lead_of_a_turn_before_the_bow_does() {
    // At 0.07 rad/s and a lag of 12 s the lead is 0.84 rad: 5 steps of 0.17 rad instead of 12.
    let slew = Slew { step: 0.07, leading_step: 0.17, lead: 0.84 };
    let [bow, port, starboard] = [0.0, -2.5, 2.5].map(Heading::new);
    for (side, asked) in [(-1.0, port), (1.0, starboard)] {
        let mut reference = bow;
        for expected in [0.17, 0.34, 0.51, 0.68, 0.84, 0.91] {
            reference = limited_heading(asked, reference, bow, slew);
            near(side * reference.radians(), expected, 1e-12);
        }
        // Back at once, and then to the other side as fast.
        reference = limited_heading(bow, reference, bow, slew);
        near(side * reference.radians(), 0.74, 1e-12);
    }
}

#[test]
fn a_command_has_the_course_and_speed_over_ground_that_the_loops_hold() {
    let mut random = Noise(5);
    for _ in 0..1000 {
        let (psi, speed) = (3.0 * random.next(), 0.9 + 0.8 * random.next());
        let (north, east) = (0.5 * random.next(), 0.5 * random.next());
        let reference = reference(speed, psi);
        let command = |heading_held, speed_held| {
            let craft = Craft { speed_held, heading_held, ..Craft::GENERIC };
            craft.command(&reference, &Vector2::new(north, east), 1.5)
        };
        let unchanged = command(HeadingReference::Heading, SpeedReference::ThroughWater);
        assert_eq!(unchanged, reference);
        // Over ground, component by component.
        let (v_n, v_e) = (speed * psi.cos() + north, speed * psi.sin() + east);
        let along = v_n * psi.cos() + v_e * psi.sin();
        let over_ground = command(HeadingReference::Heading, SpeedReference::OverGround);
        near(over_ground.speed, along.clamp(0.0, 1.5), 1e-12);
        assert_eq!(over_ground.heading, reference.heading);
        let course = command(HeadingReference::Course, SpeedReference::ThroughWater);
        assert_eq!(course.speed, speed);
        let moves = 0.05 <= v_n.hypot(v_e);
        let expected = if moves { v_e.atan2(v_n) } else { psi };
        near(wrap(course.heading.radians() - expected), 0.0, 1e-12);
    }
}

#[test]
fn without_a_ground_velocity_the_current_is_from_positions_else_from_memory() {
    let start = first_estimate(&undeclared());
    assert_eq!(start.current_from_positions(), None, "nothing has moved yet");
    let (remembered, learnt) = (Vector2::new(0.1, -0.2), Vector2::new(0.0, 0.15));
    let with = |estimate: CraftEstimate, ground_velocity| {
        let mut later = observation(&undeclared());
        later.t_s = 1.0;
        later.asc = later.asc.with_ground_velocity(ground_velocity);
        later.previous_plan = Some(PreviousPlan {
            current: Some(remembered.into()),
            ..previous(0.0, &estimate, reference(0.6, 0.0))
        });
        later.known_current()
    };
    assert_eq!(with(start, None), Some(remembered));
    let knowing = CraftEstimate { current: learnt, current_variance: 0.0025, ..start };
    assert_eq!(with(knowing, None), Some(learnt));
    // It moves from the remembered current to the measured one, 0.
    let measured = with(knowing, Some(Vector2::new(0.6, 0.0))).expect("is measured");
    let share = measured.norm() / remembered.norm();
    assert!(0.5 < share && share < 1.0, "{measured}");
}

#[test]
fn a_new_estimate_of_the_current_turns_a_command_no_faster_than_the_craft() {
    let craft = CraftDescription {
        heading_held: Some(HeadingReference::Course),
        speed_held: Some(SpeedReference::ThroughWater),
        ..undeclared()
    };
    let asked = reference(0.6, 0.0);
    let mut later = observation(&craft);
    later.t_s = 1.0;
    later.current = Some(Vector2::new(0.0, 0.5).into());
    later.previous_plan = Some(previous(0.0, &first_estimate(&craft), asked));
    let snapshot = Snapshot::try_from(later).expect("is in range");
    let calm = |reference| snapshot.slew_limited_command(&reference).heading.radians();
    let found = snapshot.command(&asked).heading.radians();
    near(found, (0.5_f64 / 0.6).atan(), 1e-12);
    near(calm(asked), Ship::RATE_MAX, 1e-12);
    // As far as the reference itself.
    near(calm(reference(0.6, 0.5)), 0.5, 1e-12);
}
