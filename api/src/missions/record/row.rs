//! The record as a table: one row an observation, one definition of every column for the formats that are tables.

use crate::{
    missions::event::{Event, Planned},
    wire::{
        Method, Outcome, Report,
        mission::{AscReport, TrueVehicle},
    },
};

/// Something that was observed, planned, or done to the mission.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Row<'a> {
    /// Number of the event that tells it.
    pub(super) sequence: u64,
    /// `truth`, `fix` or `asc_state` for what was observed; else the event's kind.
    pub(super) kind: &'static str,
    /// When it was so, on the mission's clock, s.
    pub(super) t_s: f64,
    /// When it was received: a report by the surface craft, on the mission's clock, s; an order by the service, Unix
    /// time, s.
    pub(super) received_s: Option<f64>,
    /// Whom it is of, where it is of one vehicle.
    pub(super) vehicle: Option<Vehicle<'a>>,
    /// (north, east), m.
    pub(super) position: Option<[f64; 2]>,
    /// m, positive down.
    pub(super) depth_m: Option<f64>,
    /// rad.
    pub(super) heading_rad: Option<f64>,
    /// Course over ground, rad.
    pub(super) course_rad: Option<f64>,
    /// m/s: of a fix over ground, else surge through the water.
    pub(super) speed_mps: Option<f64>,
    /// Standard deviation of the position along either axis, m.
    pub(super) sigma_m: Option<f64>,
    /// Speed through the water and heading to steer, m/s and rad.
    pub(super) reference: Option<[f64; 2]>,
    pub(super) outcome: Option<Outcome>,
    pub(super) method: Option<Method>,
    /// Why a plan is degraded, or the mission failed.
    pub(super) reason: Option<&'a str>,
    /// How long after it was due a plan was about to be stored, s.
    pub(super) late_s: Option<f64>,
}

/// A vehicle of the mission. The surface craft comes first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Vehicle<'a> {
    Asc,
    Auv(&'a str),
}

impl<'a> Vehicle<'a> {
    pub(super) fn id(self) -> &'a str {
        match self {
            Self::Asc => "asc",
            Self::Auv(id) => id,
        }
    }
}

/// How a column's cell is read off a row.
#[derive(Clone, Copy)]
pub(super) enum Cell {
    /// A whole number.
    Count(fn(&Row<'_>) -> u64),
    /// A number, in the unit that the name says.
    Number(fn(&Row<'_>) -> Option<f64>),
    /// A word, or a sentence.
    Word(for<'a> fn(&Row<'a>) -> Option<&'a str>),
}

/// The columns: their names and cells.
pub(super) const COLUMNS: [(&str, Cell); 18] = [
    ("sequence", Cell::Count(|row| row.sequence)),
    ("kind", Cell::Word(|row| Some(row.kind))),
    ("t_s", Cell::Number(|row| Some(row.t_s))),
    ("received_s", Cell::Number(|row| row.received_s)),
    ("vehicle", Cell::Word(|row| row.vehicle.map(Vehicle::id))),
    (
        "north_m",
        Cell::Number(|row| row.position.map(|[north, _]| north)),
    ),
    ("east_m", Cell::Number(|row| row.position.map(|[_, east]| east))),
    ("depth_m", Cell::Number(|row| row.depth_m)),
    ("heading_rad", Cell::Number(|row| row.heading_rad)),
    ("course_rad", Cell::Number(|row| row.course_rad)),
    ("speed_mps", Cell::Number(|row| row.speed_mps)),
    ("sigma_m", Cell::Number(|row| row.sigma_m)),
    (
        "reference_speed_mps",
        Cell::Number(|row| row.reference.map(|[speed, _]| speed)),
    ),
    (
        "reference_heading_rad",
        Cell::Number(|row| row.reference.map(|[_, heading]| heading)),
    ),
    ("outcome", Cell::Word(|row| row.outcome.map(outcome))),
    ("method", Cell::Word(|row| row.method.map(method))),
    ("reason", Cell::Word(|row| row.reason)),
    ("late_s", Cell::Number(|row| row.late_s)),
];

pub(super) fn outcome(outcome: Outcome) -> &'static str {
    match outcome {
        Outcome::Ok => "ok",
        Outcome::Degraded => "degraded",
    }
}

pub(super) fn method(method: Method) -> &'static str {
    match method {
        Method::Mpc => "mpc",
        Method::PreviousPlan => "previous_plan",
        Method::SaturatedLos => "saturated_los",
        Method::Hold => "hold",
        Method::SaturatedLosTrackerFrame => "saturated_los_tracker_frame",
        Method::IntegralLos => "integral_los",
        Method::WaypointBox => "waypoint_box",
        Method::PrintedLos => "printed_los",
    }
}

/// What a mission's clock showed, learnt from its events in order.
#[derive(Clone, Copy, Debug)]
pub(super) enum Timeline {
    /// It stands still from one plan to the next: when the last was made, s since the start.
    Simulated { planned: f64 },
    /// It runs by itself.
    Live {
        /// When the mission was made, Unix time, s.
        created: f64,
        /// Seconds on it in one.
        rate: f64,
    },
}

impl Default for Timeline {
    fn default() -> Self {
        Self::Simulated { planned: 0.0 }
    }
}

impl Timeline {
    /// What it showed at the event, s.
    pub(super) fn take_up(&mut self, event: &Event) -> f64 {
        let at_s = match event {
            Event::Planned(plan) => {
                if let Self::Simulated { planned } = self {
                    *planned = plan.t_s;
                }
                return plan.t_s;
            }
            Event::Created { at_s, mission } => {
                if let Some(live) = &mission.live {
                    *self = Self::Live {
                        created: *at_s,
                        rate: live.clock_rate,
                    };
                }
                *at_s
            }
            Event::Ran { at_s, .. }
            | Event::Paused { at_s }
            | Event::Reported { at_s, .. }
            | Event::Finished { at_s }
            | Event::Failed { at_s, .. } => *at_s,
        };
        match *self {
            Self::Simulated { planned } => planned,
            // To the bit, where it is everybody's clock.
            Self::Live { rate: 1.0, .. } => at_s,
            Self::Live { created, rate } => created + rate * (at_s - created),
        }
    }
}

/// What the event numbered `sequence` tells, when the mission's clock showed `time`.
pub(super) fn rows(sequence: u64, time: f64, event: &Event) -> Vec<Row<'_>> {
    let row = Row {
        sequence,
        kind: event.kind(),
        t_s: time,
        ..Row::default()
    };
    match event {
        Event::Created { at_s, .. }
        | Event::Ran { at_s, .. }
        | Event::Paused { at_s }
        | Event::Finished { at_s } => vec![Row {
            received_s: Some(*at_s),
            ..row
        }],
        Event::Failed { at_s, reason } => vec![Row {
            received_s: Some(*at_s),
            reason: Some(reason),
            ..row
        }],
        Event::Reported { heard, .. } => {
            let row = Row {
                received_s: Some(heard.received_s.unwrap_or(time)),
                ..row
            };
            let states = heard.asc.iter().map(|state| asc_state(row, state));
            let fixes = heard
                .auvs
                .iter()
                .flat_map(|(id, fixes)| fixes.iter().map(move |told| fix(row, id, told)));
            states.chain(fixes).collect()
        }
        Event::Planned(plan) => {
            let craft = plan.truth.iter().map(|truth| (Vehicle::Asc, &truth.asc));
            let divers = plan.truth.iter().flat_map(|truth| &truth.auvs);
            let divers = divers.map(|(id, vehicle)| (Vehicle::Auv(id), vehicle));
            let truths = craft.chain(divers).map(|(vehicle, is)| truth(row, vehicle, is));
            [planned(row, plan)].into_iter().chain(truths).collect()
        }
    }
}

fn asc_state<'a>(row: Row<'a>, told: &AscReport) -> Row<'a> {
    Row {
        kind: "asc_state",
        t_s: told.t_s,
        vehicle: Some(Vehicle::Asc),
        position: Some([told.state.north_m, told.state.east_m]),
        heading_rad: Some(told.state.heading_rad),
        speed_mps: Some(told.state.speed_mps),
        ..row
    }
}

fn fix<'a>(row: Row<'a>, id: &'a str, told: &Report) -> Row<'a> {
    Row {
        kind: "fix",
        t_s: told.t_s,
        vehicle: Some(Vehicle::Auv(id)),
        position: Some([told.north_m, told.east_m]),
        depth_m: told.depth_m,
        course_rad: told.course_rad,
        speed_mps: told.speed_mps,
        sigma_m: Some(told.sigma_m),
        ..row
    }
}

fn planned<'a>(row: Row<'a>, plan: &'a Planned) -> Row<'a> {
    Row {
        reference: Some([plan.reference.speed_mps, plan.reference.heading_rad]),
        outcome: Some(plan.outcome),
        method: Some(plan.method),
        reason: plan.reason.as_deref(),
        late_s: Some(plan.late_s),
        ..row
    }
}

fn truth<'a>(row: Row<'a>, vehicle: Vehicle<'a>, is: &TrueVehicle) -> Row<'a> {
    Row {
        kind: "truth",
        vehicle: Some(vehicle),
        position: Some([is.north_m, is.east_m]),
        depth_m: Some(is.depth_m),
        heading_rad: Some(is.heading_rad),
        speed_mps: Some(is.speed_mps),
        ..row
    }
}
