//! References need a recent heartbeat and position, a valid plan, and an armed, guided autopilot.
//! PX4 gets them in all modes: it enters OFFBOARD only while they arrive.

use std::fmt;

use super::autopilot::{Autopilot, Heartbeat};
use crate::{Alarm, reference::Reference};

/// Three missed heartbeats, one per second, s: the autopilot is out of reach.
pub(crate) const HEARTBEAT_AGE_MAX_S: f64 = 3.0;
/// Largest age of the craft's state, s.
const STATE_AGE_MAX_S: f64 = 3.0;
/// Between two attempts at taking control.
const TAKE_INTERVAL_S: f64 = 2.0;
/// Most orders: an autopilot that rejects them, or a person who sets another mode, has a reason.
const ORDERS_MAX: u32 = 6;

/// The control of the craft.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Control {
    /// The wire reports it: the newest heartbeat of the autopilot, and its age, s.
    Reported(Option<(Heartbeat, f64)>),
    /// The wire does not report it: the craft follows references when it is switched to them.
    Unreported,
}

/// The known facts of one tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Conditions {
    pub(crate) control: Control,
    /// The reason that the craft's navigation is untrustworthy, if any.
    pub(crate) distrust: Option<Alarm>,
    /// Age of the newest state of the craft, s; `None` before the first.
    pub(crate) state_age: Option<f64>,
    /// The plan's present reference; `None` without a plan or if it is too old.
    pub(crate) reference: Option<Reference>,
    /// `true` if there is a plan, valid or not.
    pub(crate) has_planned: bool,
    pub(crate) is_paused: bool,
}

/// The action of one tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Action {
    Send(Reference),
    /// Send this outside the guided mode, which PX4 enters only while references arrive.
    Offer(Reference),
    /// Send nothing; the autopilot's own time-out stops the craft.
    Silent(Silence),
    /// Order the guided mode.
    OrderGuided(Autopilot),
    /// Order the autopilot to arm.
    OrderArm,
}

/// The reason that nothing is sent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Silence {
    NoHeartbeat,
    /// Another mode after the guided mode: a person took over.
    TakenOver,
    /// Another mode since the start.
    NotGuided,
    NotArmed,
    /// The craft's navigation contradicts itself.
    Distrust(Alarm),
    /// No recent position, heading or velocity.
    NoPosition,
    NoPlan,
    PlanStale,
    MissionPaused,
}

impl Silence {
    /// `true` if a person caused it or is about to end it; any other silence is an alarm.
    pub(crate) fn is_meant(self) -> bool {
        match self {
            Self::TakenOver | Self::NotGuided | Self::NotArmed | Self::NoPlan | Self::MissionPaused => true,
            Self::NoHeartbeat | Self::Distrust(_) | Self::NoPosition | Self::PlanStale => false,
        }
    }
}

impl fmt::Display for Silence {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let text = match self {
            Self::Distrust(alarm) => return write!(f, "{alarm}; no references are sent until it clears"),
            Self::NoHeartbeat => {
                "no heartbeat of the autopilot: nothing is sent; it stops by itself 3 s after the last reference"
            }
            Self::TakenOver => {
                "the autopilot left its guided mode: a person or a failsafe has the craft; nothing is sent until the mode is set again"
            }
            Self::NotGuided => {
                "the autopilot is not in its guided mode: set it, or start with --take-control"
            }
            Self::NotArmed => "not armed: arm the craft, or start with --take-control",
            Self::NoPosition => "no recent position, heading or velocity of the craft: nothing is sent",
            Self::NoPlan => "no plan yet: nothing is sent",
            Self::MissionPaused => "the mission is paused: nothing is sent until it runs (POST …/run)",
            Self::PlanStale => "the plan is too old: nothing is sent; the autopilot stops by itself",
        };
        f.write_str(text)
    }
}

/// Decides at each tick what to send.
#[derive(Debug)]
pub(crate) struct Authority {
    take_control: bool,
    has_acted: bool,
    orders: u32,
    ordered_s: Option<f64>,
}

impl Authority {
    /// With `take_control` it orders guided mode and arming until both were reached once.
    pub(crate) fn new(take_control: bool) -> Self {
        Self {
            take_control,
            has_acted: false,
            orders: 0,
            ordered_s: None,
        }
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
            return Action::Silent(if known.is_paused {
                Silence::MissionPaused
            } else if known.has_planned {
                Silence::PlanStale
            } else {
                Silence::NoPlan
            });
        };
        if let Some(heartbeat) = heartbeat {
            if !heartbeat.is_guided() {
                let why = if self.has_acted {
                    Silence::TakenOver
                } else {
                    Silence::NotGuided
                };
                let action = self.order(now, Action::OrderGuided(heartbeat.autopilot), why);
                return offered(action, heartbeat, reference);
            }
            if !heartbeat.is_armed {
                let action = self.order(now, Action::OrderArm, Silence::NotArmed);
                return offered(action, heartbeat, reference);
            }
        }
        self.has_acted = true;
        Action::Send(reference)
    }

    /// The order, if it is allowed and the last one is old enough.
    fn order(&mut self, now: f64, order: Action, otherwise: Silence) -> Action {
        let is_due = self
            .ordered_s
            .is_none_or(|before| now - before >= TAKE_INTERVAL_S);
        if self.take_control && !self.has_acted && is_due && self.orders < ORDERS_MAX {
            self.orders += 1;
            self.ordered_s = Some(now);
            order
        } else {
            Action::Silent(otherwise)
        }
    }
}

/// PX4 enters and keeps OFFBOARD only while references arrive; in other modes it ignores them.
fn offered(action: Action, heartbeat: Heartbeat, reference: Reference) -> Action {
    match (action, heartbeat.autopilot) {
        (Action::Silent(_), Autopilot::Px4) => Action::Offer(reference),
        _ => action,
    }
}
