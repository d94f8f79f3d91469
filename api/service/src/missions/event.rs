//! The events of a mission, as stored and streamed.

use std::time::Duration;

use planner::plan::Degraded;
use serde::{Deserialize, Deserializer, Serialize, Serializer, de::DeserializeOwned, de::Error as _};
use serde_json::Map;
use serde_json::value::{RawValue, to_raw_value};
use utoipa::ToSchema;

use store::{EventReader, StoreError, StoredEvent};

use super::own_craft::OwnCraft;
use crate::planning::planners;
use wire::{
    Answer, CraftFrame, Method, Origin, Outcome, PlanResponse, Prediction, PreviousPlan, Reference,
    VehicleId,
    mission::{Assigned, NewMission, Reports, Setting, Truth},
    sha256,
};

/// An event of a mission. Times are Unix times, s, except those on a simulated mission's clock.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Event {
    /// The mission was created.
    Created {
        /// Time of this event.
        at_s: f64,
        /// The request that created it.
        mission: Box<NewMission>,
    },
    /// The mission was started or resumed.
    Ran {
        /// Time of this event.
        at_s: f64,
        /// Seconds of the mission in one second; none for live missions and unlimited speed.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        speed_factor: Option<f64>,
    },
    /// The mission was paused.
    Paused {
        /// Time of this event.
        at_s: f64,
    },
    /// The setting was changed. Later plans use the new one.
    Changed {
        /// Time of this event.
        at_s: f64,
        /// The new members. The others are unchanged.
        setting: Box<Setting>,
        /// The members before.
        replaced: Box<Setting>,
    },
    /// Reports came in.
    Reported {
        /// Time when the service received them.
        at_s: f64,
        /// The reports.
        heard: Box<Reports>,
    },
    /// A plan was made from the reports so far; in a fleet, one of its plans of that time.
    Planned(Box<Planned>),
    /// With the plans before it, AUVs of a fleet were assigned anew, or a craft became unable to
    /// serve, or able again.
    Assigned(Box<Assigned>),
    /// The service's clock was set while the mission was running.
    ClockSet {
        /// Time by the new clock.
        at_s: f64,
        /// Step of the clock, s, positive forward.
        by_s: f64,
    },
    /// The mission finished.
    Finished {
        /// Time of this event.
        at_s: f64,
    },
    /// The mission failed.
    Failed {
        /// Time of this event.
        at_s: f64,
        /// The reason.
        reason: String,
    },
}

/// A plan, in short. The whole answer can be computed again from the events before it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Planned {
    /// The craft of a fleet that it is for.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub craft: Option<String>,
    /// Time of the plan on the mission's clock, s.
    pub t_s: f64,
    /// Time from when it was due to when it was made, s.
    pub late_s: f64,
    /// Solve time, ns.
    pub solve_time_ns: u64,
    /// The plan's outcome: as requested, or degraded.
    pub outcome: Outcome,
    /// The method of the plan.
    pub method: Method,
    /// The reason of the outcome `degraded`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reason: Option<String>,
    /// The reference to steer.
    pub reference: Reference,
    /// SHA-256 of the answer's JSON, hexadecimal.
    pub answer_sha256: String,
    /// The next plan's input from this one, if the deadline cut it short: it cannot be repeated.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cut_short: Option<Box<PreviousPlan>>,
    /// Other craft of the service that the plan saw.
    #[serde(default, skip_serializing_if = "OwnCraft::is_none")]
    pub own_craft: OwnCraft,
    /// The true states of all vehicles, in a simulated mission.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub truth: Option<Box<Truth>>,
    /// The plan's prediction; events that 0.2.0 stored have none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub prediction: Option<Box<Prediction>>,
}

/// The answer of a mission's plan, as it is stored and as the next plan needs it.
#[derive(Debug)]
pub(super) struct Written {
    pub(super) answer: StoredAnswer,
    prediction: Box<Prediction>,
    /// The next plan's input from this one.
    pub(super) previous: PreviousPlan,
}

impl Written {
    /// The answer with positions from `origin` and those AUVs of which it `tells_of`. Unlike a
    /// request, a mission gives no metadata.
    pub(super) fn new(
        made: &planners::Planned,
        origin: Option<Origin>,
        tells_of: impl Fn(&VehicleId) -> bool,
    ) -> Self {
        let no_metadata = Map::new();
        let answer = Answer::new(&made.snapshot, &made.plan, made.solve_time, &no_metadata);
        let mut answer = answer.on_earth(origin).planned();
        let mut prediction = Prediction::of(&made.snapshot, &made.plan, &answer);
        let mut previous = CraftFrame::previous_plan(&made.snapshot, &made.plan, origin);
        answer.targets.retain(|target| tells_of(&target.id));
        prediction.auvs.retain(|auv| tells_of(&auv.id.as_str().into()));
        previous.targets.iter_mut().for_each(|targets| targets.retain(|target| tells_of(&target.id)));
        Self { answer: answer.into(), prediction: Box::new(prediction), previous }
    }

    /// The event of the plan at `time` on the mission's clock, beside answer and next input.
    pub(super) fn planned(
        self,
        time: f64,
        late: Duration,
        made: &planners::Planned,
    ) -> (Planned, StoredAnswer, PreviousPlan) {
        let answer = &self.answer.answer;
        let plan = &made.plan;
        let cut_short = plan.solver.deadline_hit || plan.degraded == Some(Degraded::Deadline);
        let event = Planned {
            craft: None,
            t_s: time,
            late_s: late.as_secs_f64(),
            solve_time_ns: u64::try_from(made.solve_time.as_nanos()).unwrap_or(u64::MAX),
            outcome: answer.outcome,
            method: answer.method,
            reason: answer.reason.clone(),
            reference: answer.reference,
            answer_sha256: self.answer.digest(),
            cut_short: cut_short.then(|| Box::new(self.previous.clone())),
            own_craft: OwnCraft::default(),
            truth: None,
            prediction: Some(self.prediction),
        };
        (event, self.answer, self.previous)
    }
}

/// An answer with its JSON, which is written once, then hashed and stored.
#[derive(Clone, Debug)]
pub(super) struct StoredAnswer {
    pub(super) answer: PlanResponse,
    json: Box<RawValue>,
}

impl StoredAnswer {
    pub(super) fn digest(&self) -> String {
        sha256(self.json.get().as_bytes())
    }
}

impl From<PlanResponse> for StoredAnswer {
    fn from(answer: PlanResponse) -> Self {
        let json = to_raw_value(&answer).expect("strings, numbers and lists only");
        Self { answer, json }
    }
}

impl Serialize for StoredAnswer {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.json.serialize(serializer)
    }
}

impl<'de> Deserialize<'de> for StoredAnswer {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let json = Box::<RawValue>::deserialize(deserializer)?;
        let answer = serde_json::from_str(json.get()).map_err(D::Error::custom)?;
        Ok(Self { answer, json })
    }
}

pub(super) fn json<T: Serialize>(value: &T) -> Vec<u8> {
    serde_json::to_vec(value).expect("strings, numbers and lists only")
}

pub(super) fn parsed<T: DeserializeOwned>(bytes: &[u8]) -> Result<T, StoreError> {
    serde_json::from_slice(bytes).map_err(|error| StoreError::Damaged(error.to_string()))
}

pub(super) fn created(reader: &EventReader, number: u64) -> Result<NewMission, StoreError> {
    let first = reader.events(number, 0, 1)?;
    match first.first().map(Event::read).transpose()? {
        Some(Event::Created { mission, .. }) => Ok(*mission),
        _ => Err(reader.damaged(number, "it has no first event")),
    }
}

impl Event {
    /// The event in its stored form.
    pub fn read(stored: &StoredEvent) -> Result<Self, StoreError> {
        serde_json::from_slice(&stored.body).map_err(|error| {
            StoreError::Damaged(format!("event {} cannot be read: {error}", stored.sequence))
        })
    }

    pub(super) fn stored(&self, sequence: u64) -> StoredEvent {
        StoredEvent { sequence, kind: self.kind().to_owned(), body: json(self).into() }
    }
}

macro_rules! kinds {
    ($($variant:ident $name:literal)*) => {
        impl Event {
            /// The names of all kinds.
            pub const KINDS: [&str; 10] = [$($name),*];

            /// The name of its kind.
            pub fn kind(&self) -> &'static str {
                match self {
                    $(Self::$variant { .. } => $name,)*
                }
            }
        }
    };
}

kinds! {
    Created "created" Ran "ran" Paused "paused" Changed "changed" Reported "reported" Planned "planned"
    Assigned "assigned" ClockSet "clock_set" Finished "finished" Failed "failed"
}
