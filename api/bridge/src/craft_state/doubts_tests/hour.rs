//! An hour of forty random faults: output keeps its limits, stops with the navigation, and resumes.

use super::*;
use crate::{
    mavlink::{Action, Authority, Autopilot, Conditions, Control, Heartbeat},
    output_limiter::{OutputLimiter, OutputLimits},
};

const LIMITS: OutputLimits = OutputLimits {
    speed_max: 2.0,
    turn_rate_max: 0.4,
    acceleration_max: 0.5,
};
const FAULTS: u32 = 40;
/// A fault and the quiet time after it, s: together an hour.
const FAULT_S: u32 = 30;
const QUIET_S: u32 = 60;
/// Time of a fault after which nothing is sent, and of quiet after which something is, s.
const SILENT_AFTER_S: f64 = 15.0;
const BACK_AFTER_S: f64 = 15.0;
/// Rounding of sums of a few numbers below 10.
const ROUNDING: f64 = 1e-9;

/// The fault.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Fault {
    PositionStays,
    TwoPlaces,
    PositionWanders,
    TwoHeadings,
    NothingArrives,
    VelocityStays,
    ImpossibleVelocity,
    Outliers,
    WildPlan,
    NoPlan,
}

const KINDS: [Fault; 10] = [
    Fault::PositionStays,
    Fault::TwoPlaces,
    Fault::PositionWanders,
    Fault::TwoHeadings,
    Fault::NothingArrives,
    Fault::VelocityStays,
    Fault::ImpossibleVelocity,
    Fault::Outliers,
    Fault::WildPlan,
    Fault::NoPlan,
];

impl Fault {
    /// `true` if nothing may be sent.
    fn stops(self) -> bool {
        match self {
            Self::PositionStays
            | Self::TwoPlaces
            | Self::PositionWanders
            | Self::TwoHeadings
            | Self::NothingArrives
            | Self::NoPlan => true,
            Self::VelocityStays | Self::ImpossibleVelocity | Self::Outliers | Self::WildPlan => false,
        }
    }

    /// The measurement that replaces `measured`; `start` is the craft's place when the fault began.
    fn of(
        self,
        voyage: &Voyage,
        measured: CraftMeasurement,
        start: &Vector2<f64>,
        draw: &mut Random,
    ) -> Option<CraftMeasurement> {
        let is_even = voyage.tenths.is_multiple_of(2);
        Some(match self {
            Self::NothingArrives => return None,
            Self::PositionStays => at(place(start), measured),
            Self::TwoPlaces if is_even => off_by(Vector2::new(0.0, 300.0), voyage, measured),
            Self::PositionWanders => off_by(draw.normals() * 150.0, voyage, measured),
            Self::Outliers if voyage.tenths.is_multiple_of(50) => {
                off_by(draw.normals() * 500.0, voyage, measured)
            }
            Self::TwoHeadings if is_even => turned(2.0, measured),
            Self::VelocityStays => moving(Vector2::zeros(), measured),
            Self::ImpossibleVelocity => moving(Vector2::new(60.0, -60.0), measured),
            _ => measured,
        })
    }
}

/// A bridge's decisions about one craft, without wires.
struct Loop {
    voyage: Voyage,
    authority: Authority,
    limiter: OutputLimiter,
    plan: Reference,
    sent: Option<(f64, Reference)>,
}

impl Loop {
    /// One step; `true` if a reference was sent.
    fn step(
        &mut self,
        plan: Option<Reference>,
        fault: &mut dyn FnMut(&Voyage, CraftMeasurement) -> Option<CraftMeasurement>,
    ) -> bool {
        self.voyage.step(fault);
        let now = self.voyage.now_s();
        let state = self.voyage.state.newest();
        let heartbeat = Heartbeat {
            autopilot: Autopilot::ArduPilot,
            mode: 15,
            is_armed: true,
        };
        let known = Conditions {
            control: Control::Reported(Some((heartbeat, 0.5))),
            distrust: self.voyage.state.distrusted(),
            state_age: state.map(|state| now - state.t_s),
            reference: plan,
            has_planned: true,
            is_paused: false,
        };
        let Action::Send(asked) = self.authority.decide(now, &known) else {
            // The autopilot stops by itself.
            if self.sent.is_none_or(|(at, _)| now - at > 3.0) {
                self.voyage.asked.speed = 0.0;
            }
            return false;
        };
        let state = state.expect("nothing is sent without one");
        let craft = Reference {
            speed: state.water_velocity.norm(),
            heading: state.heading,
        };
        let Some(sent) = self.limiter.limit(now, &asked, &craft, &LIMITS) else {
            return false;
        };
        assert!((0.0..=LIMITS.speed_max).contains(&sent.speed), "{sent:?}");
        if let Some((at, before)) = self.sent.filter(|(at, _)| now - at <= 3.0) {
            let elapsed = now - at;
            let turned = wrapped(sent.heading - before.heading).abs();
            assert!(
                turned <= LIMITS.turn_rate_max * elapsed + ROUNDING,
                "{before:?} {sent:?}"
            );
            let faster = sent.speed - before.speed;
            assert!(
                faster <= 4.0 * LIMITS.acceleration_max * elapsed + ROUNDING,
                "{before:?} {sent:?}"
            );
        }
        self.sent = Some((now, sent));
        self.voyage.asked = sent;
        true
    }

    /// Occasionally a new heading and speed.
    fn planned(&mut self) -> Reference {
        let voyage = &mut self.voyage;
        if voyage.tenths.is_multiple_of(200) {
            self.plan = Reference {
                speed: 0.8 + voyage.random.uniform(),
                heading: wrapped(voyage.random.uniform() * TAU),
            };
        }
        self.plan
    }
}

#[test]
fn in_an_hour_of_forty_faults_references_keep_their_limits_stop_and_resume() {
    let mut voyage = Voyage::new(Sensors::Filter, 21);
    voyage.asked_until_s = f64::INFINITY;
    let mut bridge = Loop {
        plan: voyage.asked,
        voyage,
        authority: Authority::new(false),
        limiter: OutputLimiter::default(),
        sent: None,
    };
    let mut draw = Random(22);
    let pick = |draw: &mut Random| {
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0 to 9")]
        let index = (draw.uniform() * 10.0) as usize;
        KINDS[index]
    };
    for number in 0..FAULTS {
        // Every kind at least once.
        let kind = KINDS
            .get(number as usize)
            .copied()
            .unwrap_or_else(|| pick(&mut draw));
        let (start_s, start) = (bridge.voyage.now_s(), bridge.voyage.position);
        for _ in 0..FAULT_S * 10 {
            let plan = match kind {
                Fault::NoPlan => None,
                Fault::WildPlan => Some(Reference {
                    speed: 1e6 * draw.normal(),
                    heading: draw.normal(),
                }),
                _ => Some(bridge.planned()),
            };
            let is_sent = bridge.step(plan, &mut |voyage, measured| {
                kind.of(voyage, measured, &start, &mut draw)
            });
            let since = bridge.voyage.now_s() - start_s;
            assert!(
                !is_sent || !kind.stops() || since <= SILENT_AFTER_S,
                "{kind:?}: sent after {since} s"
            );
        }
        let end_s = bridge.voyage.now_s();
        let mut back_s = None;
        for _ in 0..QUIET_S * 10 {
            let plan = Some(bridge.planned());
            if bridge.step(plan, &mut |_, measured| Some(measured)) {
                back_s = back_s.or(Some(bridge.voyage.now_s() - end_s));
            }
        }
        assert!(
            back_s.is_some_and(|back| back <= BACK_AFTER_S),
            "{kind:?}: back after {back_s:?} s"
        );
        let alarms: Vec<_> = bridge.voyage.state.alarms().collect();
        assert_eq!(alarms, [], "after {kind:?}");
    }
    let changes = bridge.limiter.changes().to_string();
    for reason in ["speed above the limit", "speed rises too fast", "turn too fast"] {
        assert!(changes.contains(reason), "{changes}");
    }
}
