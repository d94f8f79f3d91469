//! References need a recent heartbeat and position, a valid plan, and an armed, guided autopilot.
//! PX4 gets them in all modes: it enters OFFBOARD only while they arrive.

use super::autopilot::{Autopilot, Heartbeat};
use crate::{Alarm, reference::Reference};

/// Three missed heartbeats, one per second, s: the autopilot is out of reach.
pub(crate) const HEARTBEAT_AGE_MAX_S: f64 = 3.0;
/// Largest age of the craft's state, s.
const STATE_AGE_MAX_S: f64 = 3.0;
const TAKE_INTERVAL_S: f64 = 2.0;
/// Most orders: an autopilot that rejects them, or a person who sets another mode, has a reason.
const ORDERS_MAX: u32 = 6;

#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Control {
    /// The wire reports it: the newest heartbeat of the autopilot, and its age, s.
    Reported(Option<(Heartbeat, f64)>),
    /// The wire does not report it: the craft follows references when it is switched to them.
    Unreported,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Conditions {
    pub(crate) control: Control,
    pub(crate) distrust: Option<Alarm>,
    /// Age of the newest state of the craft, s; `None` before the first.
    pub(crate) state_age: Option<f64>,
    /// The plan's present reference; `None` without a plan or if it is too old.
    pub(crate) reference: Option<Reference>,
    pub(crate) has_planned: bool,
    pub(crate) is_paused: bool,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Action {
    Send(Reference),
    /// Send this outside the guided mode, which PX4 enters only while references arrive.
    Offer(Reference),
    /// Send nothing; the autopilot's own time-out stops the craft.
    Silent(Silence),
    OrderGuided(Autopilot),
    OrderArm,
}

/// The reason that nothing is sent.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub(crate) enum Silence {
    #[error(
        "no heartbeat of the autopilot: nothing is sent; it stops by itself 3 s after the last reference"
    )]
    NoHeartbeat,
    /// Another mode after the guided mode: a person took over.
    #[error(
        "the autopilot left its guided mode: a person or a failsafe has the craft; nothing is sent until the mode is set again"
    )]
    TakenOver,
    /// Another mode since the start.
    #[error("the autopilot is not in its guided mode: set it (MAVLink, IMC: or start with --take-control)")]
    NotGuided,
    #[error("not armed: arm the craft, or start with --take-control")]
    NotArmed,
    #[error("{0}; no references are sent until it clears")]
    Distrust(Alarm),
    #[error("no recent position, heading or velocity of the craft: nothing is sent")]
    NoPosition,
    #[error("no plan yet: nothing is sent")]
    NoPlan,
    #[error("the plan is too old: nothing is sent; the autopilot stops by itself")]
    PlanStale,
    #[error("the mission is paused: nothing is sent until it runs (POST …/run)")]
    MissionPaused,
}

impl Silence {
    /// `true` if a person caused it or is about to end it; any other silence is an alarm.
    pub(crate) fn is_meant(self) -> bool {
        matches!(
            self,
            Self::TakenOver | Self::NotGuided | Self::NotArmed | Self::NoPlan | Self::MissionPaused
        )
    }
}

#[derive(Debug, Default)]
pub(crate) struct Authority {
    take_control: bool,
    has_acted: bool,
    orders: u32,
    ordered_s: Option<f64>,
}

impl Authority {
    /// With `take_control` it orders guided mode and arming until both were reached once.
    pub(crate) fn new(take_control: bool) -> Self {
        Self { take_control, ..Self::default() }
    }

    /// The action at `now`, s on a clock that is never set.
    pub(crate) fn decide(&mut self, now: f64, known: &Conditions) -> Action {
        let heartbeat = match known.control {
            Control::Reported(heard) => match heard.filter(|(_, age)| *age <= HEARTBEAT_AGE_MAX_S) {
                Some((heartbeat, _)) => Some(heartbeat),
                None => return Action::Silent(Silence::NoHeartbeat),
            },
            Control::Unreported => None,
        };
        if let Some(alarm) = known.distrust {
            return Action::Silent(Silence::Distrust(alarm));
        }
        if !known.state_age.is_some_and(|age| age <= STATE_AGE_MAX_S) {
            return Action::Silent(Silence::NoPosition);
        }
        let Some(reference) = known.reference else {
            return Action::Silent(match known.has_planned {
                _ if known.is_paused => Silence::MissionPaused,
                true => Silence::PlanStale,
                false => Silence::NoPlan,
            });
        };
        if let Some(heartbeat) = heartbeat.filter(|heartbeat| !heartbeat.may_be_steered()) {
            let (order, otherwise) = match (heartbeat.mode.is_guided, self.has_acted) {
                (true, _) => (Action::OrderArm, Silence::NotArmed),
                (false, true) => (Action::OrderGuided(heartbeat.autopilot), Silence::TakenOver),
                (false, false) => (Action::OrderGuided(heartbeat.autopilot), Silence::NotGuided),
            };
            return match (self.order(now, order, otherwise), heartbeat.autopilot) {
                // PX4 enters and keeps OFFBOARD only while references arrive; others ignore them.
                (Action::Silent(_), Autopilot::Px4) => Action::Offer(reference),
                (action, _) => action,
            };
        }
        self.has_acted = true;
        Action::Send(reference)
    }

    /// The order, if it is allowed and the last one is old enough.
    fn order(&mut self, now: f64, order: Action, otherwise: Silence) -> Action {
        let is_due = self.ordered_s.is_none_or(|before| now - before >= TAKE_INTERVAL_S);
        if self.take_control && !self.has_acted && is_due && self.orders < ORDERS_MAX {
            self.orders += 1;
            self.ordered_s = Some(now);
            order
        } else {
            Action::Silent(otherwise)
        }
    }
}
