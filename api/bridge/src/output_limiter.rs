//! The last step before the wire: outputs keep their limits for any plan, service or estimate.
//!
//! | limit | from | what exceeds it |
//! |---|---|---|
//! | speed of the craft's speed loop | the lower one of mission and autopilot parameters | is cut |
//! | rise of speed | four times the lowest acceleration of both | is slowed; stopping is not |
//! | turn of the heading | the lowest turn rate of both | is slowed, by the shorter turn |
//! | age of the plan | ten seconds since it arrived, by the bridge's own clock | is not followed |
//! | finite numbers | | is not sent |
//! | distance from vessels | the mission's separation, over the next ten seconds | is replaced by the last safe reference, or a stop |
//!
//! After a pause the craft's own heading and speed take the place of the last reference.

use ::wire::{CraftDescription, DeclaredLimits};
use planner::{angle::wrap, snapshot::Limits};

use crate::{Rejects, mavlink::Parameters, reference::Reference};

mod clearance;

use self::clearance::Way;

pub(crate) use self::clearance::Other;

/// Longest use of a plan after its arrival, s, as in the service, for any stated validity.
const PLAN_AGE_MAX_S: f64 = 10.0;
/// Time after which the autopilot has stopped the craft, s; see `docs/at-sea.md#the-autopilot`.
const PAUSE_MAX_S: f64 = 3.0;
/// Rise of a reference speed per acceleration. A reference leads a speed loop by its lag times the
/// acceleration: a slower rise would add to the lag.
const RISE_PER_ACCELERATION: f64 = 4.0;
/// Least change of a reference that is counted, m/s and rad: less is no limit that a person would
/// raise.
const COUNTED_MPS: f64 = 0.01;
const COUNTED_RAD: f64 = 0.01;

#[derive(Clone, Copy, Debug, PartialEq)]
#[expect(clippy::struct_field_names, reason = "each is a maximum")]
pub(crate) struct OutputLimits {
    /// Fastest speed, m/s, as the craft's speed loop measures it.
    pub(crate) speed_max: f64,
    /// Fastest turn of the heading, rad/s.
    pub(crate) turn_rate_max: f64,
    /// Acceleration ahead, m/s².
    pub(crate) acceleration_max: f64,
}

impl Default for OutputLimits {
    /// Defaults: the planner's speed limit, and a small craft's turns and accelerations.
    fn default() -> Self {
        Self { speed_max: Limits::ANY.speed_max, turn_rate_max: 0.5, acceleration_max: 0.5 }
    }
}

impl OutputLimits {
    /// The lowest limits that a mission declares.
    pub(crate) fn declared(limits: &DeclaredLimits, craft: &CraftDescription) -> Self {
        let lowest = |stated: [Option<f64>; 2], otherwise: f64| {
            let stated = stated.into_iter().flatten().filter(|value| *value > 0.0);
            stated.reduce(f64::min).unwrap_or(otherwise)
        };
        let (turn_rate, acceleration) = (limits.turn_rate_max_radps, limits.acceleration_max_mps2);
        let (heading, surge) = (&craft.heading_loop, &craft.surge_loop);
        let any = Self::default();
        Self {
            speed_max: lowest([limits.speed_max_mps, None], any.speed_max),
            turn_rate_max: lowest([turn_rate, heading.rate_max_radps], any.turn_rate_max),
            acceleration_max: lowest([acceleration, surge.acceleration_max_mps2], any.acceleration_max),
        }
    }

    /// These limits, or the autopilot's if lower.
    pub(crate) fn within(&self, parameters: &Parameters) -> Self {
        let lower = |limit: f64, parameter: Option<f64>| parameter.map_or(limit, |most| limit.min(most));
        Self {
            speed_max: lower(self.speed_max, parameters.speed_max()),
            turn_rate_max: lower(self.turn_rate_max, parameters.turn_rate_max()),
            acceleration_max: lower(self.acceleration_max, parameters.acceleration_max()),
        }
    }
}

#[derive(Clone, Debug, Default)]
pub(crate) struct OutputLimiter {
    /// The last reference and the time it was sent, s.
    last: Option<(f64, Reference)>,
    /// The last reference that led into no vessel's distance, and its time, s.
    safe: Option<(f64, Reference)>,
    /// The vessel that the craft keeps clear of against the plan.
    pub(crate) avoided: Option<String>,
    pub(crate) changes: Rejects,
}

impl OutputLimiter {
    pub(crate) fn may_follow(arrived_s: f64, now_s: f64) -> bool {
        now_s - arrived_s <= PLAN_AGE_MAX_S
    }

    /// `asked`, the first of the references of the next seconds after `now_s`, s, unless their way
    /// leads into the distance to keep from one of `others`: then the last safe one, or a stop, if
    /// it keeps farther away.
    pub(crate) fn clear_of(
        &mut self,
        now_s: f64,
        asked: impl Fn(f64) -> Reference,
        others: &[Other],
        limits: &OutputLimits,
    ) -> Reference {
        let first = asked(0.0);
        let worst = |asked: &dyn Fn(f64) -> Reference| Way::of(limits.speed_max, asked).worst(others);
        self.avoided = None;
        if !is_finite(&first) {
            return first;
        }
        let Some((intrusion, other)) = worst(&asked) else {
            self.safe = Some((now_s, first));
            return first;
        };
        let safe = self.safe.filter(|(at, _)| Self::may_follow(*at, now_s)).map(|(_, safe)| safe);
        let stop = Reference { speed: 0.0, ..first };
        let instead = safe.into_iter().chain([stop]).map(|reference| {
            let intrusion = worst(&|_| reference).map_or(0.0, |(intrusion, _)| intrusion);
            (intrusion, reference)
        });
        match instead.min_by(|a, b| a.0.total_cmp(&b.0)) {
            Some((less, reference)) if less < intrusion => {
                self.changes.count("towards a vessel");
                self.avoided = Some(other.name.clone());
                reference
            }
            _ => first,
        }
    }

    /// The output at `now_s`, s, for `asked`, from a craft with the speed and heading `craft`;
    /// `None` if a number is not finite.
    pub(crate) fn limit(
        &mut self,
        now_s: f64,
        asked: &Reference,
        craft: &Reference,
        limits: &OutputLimits,
    ) -> Option<Reference> {
        if !is_finite(asked) || !is_finite(craft) {
            self.changes.count("not a finite number");
            return None;
        }
        let last = self.last.filter(|(at, _)| (0.0..=PAUSE_MAX_S).contains(&(now_s - at)));
        let (before_s, before) = last.unwrap_or((now_s, *craft));
        let elapsed = now_s - before_s;

        let turn = wrap(asked.heading - before.heading);
        let slew = limits.turn_rate_max * elapsed;
        if turn.abs() > slew + COUNTED_RAD {
            self.changes.count("turn too fast");
        }
        let heading = wrap(before.heading + turn.clamp(-slew, slew));

        let most = limits.speed_max;
        if asked.speed > most + COUNTED_MPS {
            self.changes.count("speed above the limit");
        }
        let from = before.speed.clamp(0.0, most);
        let rise = RISE_PER_ACCELERATION * limits.acceleration_max * elapsed;
        if asked.speed.min(most) > from + rise + COUNTED_MPS {
            self.changes.count("speed rises too fast");
        }
        let speed = asked.speed.clamp(0.0, most).min(from + rise);

        let sent = Reference { speed, heading };
        self.last = Some((now_s, sent));
        Some(sent)
    }
}

fn is_finite(reference: &Reference) -> bool {
    reference.speed.is_finite() && reference.heading.is_finite()
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use proptest::prelude::*;

    use super::*;

    const LIMITS: OutputLimits = OutputLimits { speed_max: 1.0, turn_rate_max: 0.2, acceleration_max: 0.1 };
    /// Rounding of sums of a few numbers below 10.
    const ROUNDING: f64 = 1e-9;

    fn reference(speed: f64, heading: f64) -> Reference {
        Reference { speed, heading }
    }

    /// Any number that JSON or arithmetic can produce.
    fn any_number() -> impl Strategy<Value = f64> {
        prop_oneof![-4.0..4.0_f64, -1e7..1e7_f64, any::<f64>(), Just(f64::NAN), Just(f64::INFINITY)]
    }

    proptest! {
        #[test]
        fn no_output_exceeds_a_limit(
            plan in prop::collection::vec((0.0..5.0_f64, any_number(), any_number(), -0.5..3.0_f64, -PI..PI), 1..200),
        ) {
            let mut limiter = OutputLimiter::default();
            let (mut now, mut last): (f64, Option<(f64, Reference)>) = (0.0, None);
            for (pause, speed, heading, craft_speed, bow) in plan {
                now += pause;
                let craft = reference(craft_speed, bow);
                let Some(sent) = limiter.limit(now, &reference(speed, heading), &craft, &LIMITS) else {
                    continue;
                };
                prop_assert!((0.0..=LIMITS.speed_max).contains(&sent.speed), "{sent:?}");
                prop_assert!(sent.heading.abs() <= PI, "{sent:?}");
                let (elapsed, before) = match last {
                    Some((at, before)) if now - at <= PAUSE_MAX_S => (now - at, before),
                    _ => (0.0, reference(craft_speed.clamp(0.0, LIMITS.speed_max), bow)),
                };
                let turned = wrap(sent.heading - before.heading).abs();
                prop_assert!(turned <= LIMITS.turn_rate_max * elapsed + ROUNDING, "{turned} rad in {elapsed} s");
                let faster = sent.speed - before.speed;
                prop_assert!(faster <= 4.0 * LIMITS.acceleration_max * elapsed + ROUNDING, "{faster} m/s in {elapsed} s");
                last = Some((now, sent));
            }
        }

        #[test]
        fn a_reference_within_all_limits_is_sent_unchanged(speed in 0.0..1.0_f64, heading in -PI..PI) {
            let mut limiter = OutputLimiter::default();
            let asked = reference(speed, heading);
            for tenth in 0..40_u8 {
                let sent = limiter.limit(0.1 * f64::from(tenth), &asked, &asked, &LIMITS).expect("is finite");
                prop_assert!((sent.speed - speed).abs() < ROUNDING && wrap(sent.heading - heading).abs() < ROUNDING);
            }
            prop_assert_eq!(limiter.changes.total(), 0);
        }
    }

    #[test]
    fn every_change_is_counted_by_its_reason() {
        let mut limiter = OutputLimiter::default();
        let rest = reference(0.0, 0.0);
        assert_eq!(limiter.limit(0.0, &rest, &rest, &LIMITS), Some(rest));
        for (asked, reasons) in [
            (reference(0.5, 0.0), "speed rises too fast: 1"),
            (reference(0.0, PI), "speed rises too fast: 1, turn too fast: 1"),
            (reference(f64::NAN, 0.0), "not a finite number: 1, speed rises too fast: 1, turn too fast: 1"),
        ] {
            limiter.limit(0.1, &asked, &rest, &LIMITS);
            assert_eq!(limiter.changes.to_string(), reasons);
        }
    }

    #[test]
    fn a_turn_goes_towards_the_reference_by_the_shorter_way() {
        // In a tenth of a second, 0.02 rad.
        for (before, asked, expected) in
            [(0.0, 1.0, 0.02), (0.0, -1.0, -0.02), (3.13, -3.0, 3.15 - 2.0 * PI), (1.0, 1.01, 1.01)]
        {
            let mut limiter = OutputLimiter::default();
            let before = reference(0.5, before);
            assert_eq!(limiter.limit(0.0, &before, &before, &LIMITS), Some(before));
            let sent = limiter.limit(0.1, &reference(0.5, asked), &before, &LIMITS);
            let heading = sent.expect("is finite").heading;
            assert!((heading - expected).abs() < ROUNDING, "{heading} rad");
        }
    }

    #[test]
    fn the_fastest_speed_is_sent_unchanged_and_a_faster_one_is_cut_and_counted() {
        let mut limiter = OutputLimiter::default();
        let fastest = reference(LIMITS.speed_max, 0.0);
        assert_eq!(limiter.limit(0.0, &fastest, &fastest, &LIMITS), Some(fastest));
        assert_eq!(limiter.changes.total(), 0);
        // A rounded limit of the service counts for nothing.
        let rounded = limiter.limit(0.05, &reference(1.001, 0.001), &fastest, &LIMITS);
        assert_eq!((rounded.map(|sent| sent.speed), limiter.changes.total()), (Some(1.0), 0));
        let sent = limiter.limit(0.1, &reference(1.5, 0.0), &fastest, &LIMITS);
        assert_eq!(sent, Some(fastest));
        assert_eq!(limiter.changes.to_string(), "speed above the limit: 1");
    }

    #[test]
    fn a_plan_is_followed_until_ten_seconds_after_its_arrival() {
        assert!(OutputLimiter::may_follow(5.0, 15.0));
        assert!(!OutputLimiter::may_follow(5.0, 15.1));
    }

    #[test]
    fn stopping_is_never_delayed() {
        let mut limiter = OutputLimiter::default();
        let fast = reference(1.0, 0.0);
        assert_eq!(limiter.limit(0.0, &fast, &fast, &LIMITS), Some(fast));
        let stopped = limiter.limit(0.1, &reference(0.0, 0.0), &fast, &LIMITS);
        assert_eq!(stopped, Some(reference(0.0, 0.0)));
    }

    #[test]
    fn limits_are_the_lower_ones_of_mission_and_autopilot() {
        let (mut limits, mut craft) = (DeclaredLimits::default(), CraftDescription::default());
        assert_eq!(OutputLimits::declared(&limits, &craft), OutputLimits::default());
        (limits.speed_max_mps, limits.acceleration_max_mps2) = (Some(1.2), Some(0.1));
        // Zero is no limit.
        (limits.turn_rate_max_radps, craft.heading_loop.rate_max_radps) = (Some(0.0), Some(0.4));
        craft.surge_loop.acceleration_max_mps2 = Some(0.3);
        let declared = OutputLimits::declared(&limits, &craft);
        let expected = OutputLimits { speed_max: 1.2, turn_rate_max: 0.4, acceleration_max: 0.1 };
        assert_eq!(declared, expected);
        let mut parameters = Parameters::default();
        assert_eq!(declared.within(&parameters), declared);
        parameters.note("WP_SPEED", 1.0);
        parameters.note("ATC_STR_RAT_MAX", 10.0);
        let within = declared.within(&parameters);
        assert!((within.speed_max - 1.0).abs() < ROUNDING);
        assert!((within.turn_rate_max - 10.0_f64.to_radians()).abs() < ROUNDING);
    }
}
