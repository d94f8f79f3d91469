//! When references may be sent: in the autopilot's guided mode, armed, heard of, with a valid plan. To PX4, which takes its guided mode
//! only while references come and passes them over outside it, in other modes too.

use std::fmt;

use super::autopilot::{Autopilot, Heartbeat};
use crate::reference::Reference;

/// A heartbeat comes once a second: three in a row missed, and the autopilot is taken to be out of reach.
const HEARTBEAT_AGE_MAX_S: f64 = 3.0;
/// A craft that has not said for so long where it is.
const STATE_AGE_MAX_S: f64 = 3.0;
/// Between two attempts at taking control.
const TAKE_INTERVAL_S: f64 = 2.0;
/// Orders that are given at most: an autopilot that has refused so often has a reason, and a person who sets another mode one too.
const ORDERS_MAX: u32 = 6;

/// Who has the craft.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Control {
    /// The wire tells: by the newest heartbeat of the autopilot, and its age, s.
    Reported(Option<(Heartbeat, f64)>),
    /// The wire tells nothing of it: the craft takes references when it is switched so.
    Unreported,
}

/// What is known at one tick; ages in s.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Conditions {
    /// Who has the craft, as far as the wire tells.
    pub control: Control,
    /// Age of the newest state of the craft, none before the first.
    pub state_age: Option<f64>,
    /// What the plan says for now; none where there is no plan, or it is too old.
    pub reference: Option<Reference>,
    /// Whether there has been any plan.
    pub has_planned: bool,
    /// Whether the mission is held.
    pub is_held: bool,
}

/// What to do at one tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Action {
    /// Send this reference.
    Send(Reference),
    /// Send this reference to an autopilot that does not act on it yet: it enters its guided mode only while references come.
    Offer(Reference),
    /// Send nothing; the autopilot's own time-out stops the craft.
    Silent(Silence),
    /// Order the guided mode.
    OrderGuided(Autopilot),
    /// Order the motors on.
    OrderArm,
}

/// Why nothing is sent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Silence {
    /// Not heard of, or not for three seconds.
    NoHeartbeat,
    /// Another mode, though this one was guided before: a person took over.
    TakenOver,
    /// Another mode since the start.
    NotGuided,
    /// The motors are off.
    NotArmed,
    /// The craft does not say where it is.
    NoPosition,
    /// There is no plan yet.
    NoPlan,
    /// The newest plan is too old to be followed.
    PlanStale,
    /// The mission is held.
    MissionHeld,
}

impl fmt::Display for Silence {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::NoHeartbeat => "no heartbeat of the autopilot: nothing is sent, it stops by itself 3 s after the last reference",
            Self::TakenOver => "the autopilot left its guided mode: a person has the craft, nothing is sent until it is handed back",
            Self::NotGuided => "the autopilot is not in its guided mode: set it, or start with --take-control",
            Self::NotArmed => "the motors are off: arm the craft, or start with --take-control",
            Self::NoPosition => "the craft does not say where it is: nothing is sent",
            Self::NoPlan => "no plan yet: nothing is sent",
            Self::MissionHeld => "the mission is held: nothing is sent until it runs (POST …/run)",
            Self::PlanStale => "the plan is too old to be followed: nothing is sent, the autopilot stops by itself",
        })
    }
}

/// Decides, tick by tick.
#[derive(Debug)]
pub struct Authority {
    take_control: bool,
    has_acted: bool,
    orders: u32,
    ordered_s: Option<f64>,
}

impl Authority {
    /// With `take_control` the guided mode is ordered and the motors are switched on, until that has led to guided and armed
    /// once; never again after that.
    #[must_use]
    pub fn new(take_control: bool) -> Self {
        Self {
            take_control,
            has_acted: false,
            orders: 0,
            ordered_s: None,
        }
    }

    /// What to do at `now`, s of a clock that is never set.
    pub fn decide(&mut self, now: f64, known: &Conditions) -> Action {
        let heartbeat = match known.control {
            Control::Reported(heard) => match heard.filter(|(_, age)| *age <= HEARTBEAT_AGE_MAX_S) {
                Some((heartbeat, _)) => Some(heartbeat),
                None => return Action::Silent(Silence::NoHeartbeat),
            },
            Control::Unreported => None,
        };
        if !known.state_age.is_some_and(|age| age <= STATE_AGE_MAX_S) {
            return Action::Silent(Silence::NoPosition);
        }
        let Some(reference) = known.reference else {
            return Action::Silent(if known.is_held {
                Silence::MissionHeld
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

    /// The order, if it may be given and the last one is not too fresh.
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

/// PX4 changes to OFFBOARD, and stays in it, only while references come; outside it passes them over.
fn offered(action: Action, heartbeat: Heartbeat, reference: Reference) -> Action {
    match (action, heartbeat.autopilot) {
        (Action::Silent(_), Autopilot::Px4) => Action::Offer(reference),
        _ => action,
    }
}
