//! Reports to a live mission.

use std::collections::BTreeMap;

use geodesy::Datum;
use nalgebra::Vector2;
use planner::snapshot::{Asc, Current, Origin, Report, Vessel};
use serde::{Deserialize, Serialize};
use serde_with::skip_serializing_none;
use utoipa::ToSchema;

use crate::FieldError;

/// Reports in any order, also late or repeated. Each is accepted or rejected by itself.
#[skip_serializing_none]
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct Reports {
    /// Place of the datum, if the first of these fixes has set it. Written by the service.
    pub origin: Option<Origin>,
    /// The first fault of each rejected report, at its place in the body. Written by the service.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub rejected: Vec<FieldError>,
    /// The surface craft of a fleet that these reports are from: its `asc` and `steering`, and the
    /// ranges that it measured. Missions of one craft have none.
    pub craft: Option<String>,
    /// Unix time at which the surface craft received them, s. Default: that of the service.
    pub received_s: Option<f64>,
    /// Fixes and ranges, at most 64 of each underwater vehicle; `t_s` is the Unix time of sending.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub auvs: BTreeMap<String, Vec<Report>>,
    /// States of the surface craft, at most 64. The newest counts.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub asc: Vec<AscReport>,
    /// Other vessels, at most 64. The newest position of each counts; the mission knows the nearest
    /// 64. Default of `t_s`: now.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub traffic: Vec<Vessel>,
    /// Events aboard for the mission's log, at most 64. No plan depends on them.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub notes: Vec<Note>,
    /// States of steering, from the program that steers, at most 64. The newest counts.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub steering: Vec<Steering>,
}

impl Reports {
    /// Adds latitude and longitude to positions in metres, if `origin` is a place on Earth.
    pub fn complete(&mut self, origin: Origin) {
        let Ok(datum) = Datum::new(&origin.into()) else {
            return;
        };
        let place = |north, east| Origin::from(datum.from_local(&Vector2::new(north, east)));
        let degrees = |place: Origin| (Some(place.lat_deg), Some(place.lon_deg));
        for at in self.asc.iter_mut().map(|report| &mut report.state).filter(|at| at.lat_deg.is_none()) {
            (at.lat_deg, at.lon_deg) = degrees(place(at.north_m, at.east_m));
        }
        for vessel in self.traffic.iter_mut().filter(|vessel| vessel.lat_deg.is_none()) {
            (vessel.lat_deg, vessel.lon_deg) = degrees(place(vessel.north_m, vessel.east_m));
        }
        for fix in self.auvs.values_mut().flatten().filter(|fix| fix.lat_deg.is_none()) {
            if let (Some(north), Some(east)) = (fix.north_m, fix.east_m) {
                (fix.lat_deg, fix.lon_deg) = degrees(place(north, east));
            }
        }
    }

    /// `true` if every position has its latitude, those from which ranges were measured included.
    pub fn is_complete(&self) -> bool {
        self.is_on_earth() && self.auvs.values().flatten().all(|fix| fix.from.is_none())
    }

    /// `true` if every position of a vehicle has its latitude.
    pub(crate) fn is_on_earth(&self) -> bool {
        let is_on_earth = |fix: &Report| fix.lat_deg.is_some() || fix.is_range();
        self.auvs.values().flatten().all(is_on_earth)
            && self.asc.iter().all(|report| report.state.lat_deg.is_some())
            && self.traffic.iter().all(|vessel| vessel.lat_deg.is_some())
    }

    /// `true` if there is no report.
    pub fn is_empty(&self) -> bool {
        let no_vehicle = self.auvs.is_empty() && self.asc.is_empty() && self.traffic.is_empty();
        no_vehicle && self.notes.is_empty() && self.steering.is_empty()
    }

    /// `true` if some are of a surface craft: its state, its steering, or ranges without the place
    /// where they were measured.
    pub fn are_of_a_craft(&self) -> bool {
        let is_from_craft = |fix: &Report| fix.is_range() && fix.from.is_none();
        let ranges = self.auvs.values().flatten().any(is_from_craft);
        ranges || !self.asc.is_empty() || !self.steering.is_empty()
    }

    /// Adds the reports of `others`.
    pub fn extend(&mut self, others: Self) {
        for (id, fixes) in others.auvs {
            self.auvs.entry(id).or_default().extend(fixes);
        }
        self.asc.extend(others.asc);
        self.traffic.extend(others.traffic);
        self.notes.extend(others.notes);
        self.steering.extend(others.steering);
    }
}

/// An event aboard, for example a takeover by a person, or a lost heartbeat.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct Note {
    /// Unix time, s: at most a day ago, and at most 1 s ahead.
    pub t_s: f64,
    /// The event, at most 500 bytes.
    #[schema(example = "a person has the craft")]
    pub text: String,
}

/// State of steering, known only to the program that steers. A bridge posts it once a second.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct Steering {
    /// Unix time of the state, s: at most half an hour ago, and at most 1 s ahead.
    pub t_s: f64,
    /// The state.
    pub state: SteeringState,
    /// The reason, for people, at most 500 bytes.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    #[schema(example = "the autopilot left its guided mode")]
    pub why: String,
}

impl Steering {
    /// The state at `now` on the mission's clock, s.
    pub fn at(&self, now: f64) -> LastSteering {
        LastSteering { state: self.state, why: self.why.clone(), age_s: (now - self.t_s).max(0.0) }
    }
}

/// State of the surface craft's steering.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum SteeringState {
    /// The mission's references are sent to it.
    Steering,
    /// References are sent, but they or the craft's response to them are faulty.
    Degraded,
    /// A person steers it.
    Person,
    /// Nothing is sent yet, as intended: no plan, not armed, or a dry run.
    Waiting,
    /// Nothing is sent, and an operator must find the reason.
    NotSteering,
}

/// The last reported state of steering.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct LastSteering {
    /// The state.
    pub state: SteeringState,
    /// The reason, for people.
    pub why: String,
    /// Its age, s on the mission's clock. Beyond 3 s, the state is unknown.
    pub age_s: f64,
}

/// A state of the surface craft.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct AscReport {
    /// Unix time of the state, s: at most half an hour ago, and at most 1 s ahead.
    pub t_s: f64,
    /// The state.
    pub state: Asc,
    /// Current of the craft's observer: it overrides the mission's `current` and velocities.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub current: Option<Current>,
    /// `true` if the mission's references steered it. Otherwise its response is not learnt, earlier
    /// learning stays, and references turn from the present heading. Default: yes.
    #[serde(default = "yes", skip_serializing_if = "is_yes")]
    pub steered: bool,
    /// Share of its energy that is left. In a fleet, the newest known one counts, and a craft with
    /// too little gives its AUVs to others.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(example = 0.8)]
    pub battery: Option<f64>,
}

fn yes() -> bool {
    true
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde hands references on")]
fn is_yes(said: &bool) -> bool {
    *said
}

/// The accepted reports are on the disk.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Accepted {
    /// Number of the event that stores them.
    pub sequence: u64,
    /// Place of the datum, if the first of these fixes has set it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub origin: Option<Origin>,
    /// The first fault of each rejected report, with a pointer into the body. An AUV that the
    /// mission does not know is named once.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub rejected: Vec<FieldError>,
}
