//! The events of a mission, as they are stored and streamed.

use std::time::Duration;

use planner::{plan::Degraded, snapshot};
use serde::{Deserialize, Deserializer, Serialize, Serializer, de::DeserializeOwned, de::Error as _};
use serde_json::value::{RawValue, to_raw_value};
use utoipa::ToSchema;

use crate::{
    planners, planning,
    store::{EventReader, StoreError, StoredEvent},
};
use wire::{
    Method, Origin, Outcome, PlanResponse, Prediction, PreviousPlan, Reference,
    mission::{NewMission, Reports, Setting, Truth},
    sha256,
};

/// An event of a mission. Times are Unix times, s, but for those of a simulated mission's own clock.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Event {
    /// It was made.
    Created {
        /// When.
        at_s: f64,
        /// As what.
        mission: Box<NewMission>,
    },
    /// It was begun, or gone on with.
    Ran {
        /// When.
        at_s: f64,
        /// How many seconds of the mission pass in one; none for a mission that is live, or as fast as it can.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        speed_factor: Option<f64>,
    },
    /// It was held.
    Paused {
        /// When.
        at_s: f64,
    },
    /// Its setting was changed: plans after it are made by the new one.
    Changed {
        /// When.
        at_s: f64,
        /// The members that are new. Those that are not here stayed.
        setting: Box<Setting>,
        /// What they replaced.
        replaced: Box<Setting>,
    },
    /// Something was heard.
    Reported {
        /// When the service took it up.
        at_s: f64,
        /// What.
        heard: Box<Reports>,
    },
    /// A plan was made of what had been heard until then.
    Planned(Box<Planned>),
    /// The service's clock was set, while the mission went on.
    ClockSet {
        /// When, by the new time.
        at_s: f64,
        /// How far it was set forward; back where negative, s.
        by_s: f64,
    },
    /// It was over.
    Finished {
        /// When.
        at_s: f64,
    },
    /// It could not go on.
    Failed {
        /// When.
        at_s: f64,
        /// Why.
        reason: String,
    },
}

/// A plan: what it was made at, and what its answer amounts to. The answer itself is made again from what was heard.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Planned {
    /// Time of the plan on the mission's clock, s.
    pub t_s: f64,
    /// How long after it was due it was made and about to be stored, s.
    pub late_s: f64,
    /// How long the planner took, ns: the answer says it too.
    pub solve_time_ns: u64,
    /// Whether it is what was asked for.
    pub outcome: Outcome,
    /// What led to it.
    pub method: Method,
    /// Why the outcome is `degraded`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reason: Option<String>,
    /// What to steer.
    pub reference: Reference,
    /// SHA-256 of the answer's JSON, hexadecimal.
    pub answer_sha256: String,
    /// What the next plan needs of this one, where the deadline cut it short and it cannot be made again.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cut_short: Option<Box<PreviousPlan>>,
    /// Where every vehicle was, in a simulated mission.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub truth: Option<Box<Truth>>,
    /// What it predicts, for people to look at. Versions before 0.3 kept none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub prediction: Option<Box<Prediction>>,
}

/// The answer of a mission's plan. Unlike a request, a mission gives no metadata.
pub(super) fn answer(made: &planners::Planned, origin: Option<Origin>) -> StoredAnswer {
    let context = planning::Context {
        origin,
        ..planning::Context::default()
    };
    planning::answer(made, &context).planned().into()
}

/// What the next plan needs of this one.
pub(super) fn previous(made: &planners::Planned) -> PreviousPlan {
    PreviousPlan::from(&snapshot::PreviousPlan::from(&made.plan))
}

/// The event of a plan made at `time` on the mission's clock.
pub(super) fn planned(
    time: f64,
    late: Duration,
    made: &planners::Planned,
    written: &StoredAnswer,
) -> Planned {
    let answer = &written.answer;
    let plan = &made.plan;
    let cut_short = plan.solver.deadline_hit || plan.degraded == Some(Degraded::Deadline);
    Planned {
        t_s: time,
        late_s: late.as_secs_f64(),
        solve_time_ns: u64::try_from(made.solve_time.as_nanos()).unwrap_or(u64::MAX),
        outcome: answer.outcome,
        method: answer.method,
        reason: answer.reason.clone(),
        reference: answer.reference,
        answer_sha256: written.digest(),
        cut_short: cut_short.then(|| Box::new(previous(made))),
        truth: None,
        prediction: Some(Box::new(Prediction::of(&made.snapshot, plan, answer))),
    }
}

/// An answer with its JSON, which is written once and hashed and stored as written.
#[derive(Clone, Debug)]
pub(super) struct StoredAnswer {
    pub(super) answer: PlanResponse,
    json: Box<RawValue>,
}

impl StoredAnswer {
    /// SHA-256 of the answer's JSON, hexadecimal.
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

impl PartialEq for StoredAnswer {
    fn eq(&self, other: &Self) -> bool {
        self.answer == other.answer
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

/// A value that was stored as JSON.
pub(super) fn parsed<T: DeserializeOwned>(bytes: &[u8]) -> Result<T, StoreError> {
    serde_json::from_slice(bytes).map_err(|error| StoreError::Damaged(error.to_string()))
}

/// What the mission was made with: its first event.
pub(super) fn created(reader: &EventReader, number: u64) -> Result<NewMission, StoreError> {
    let first = reader.events(number, 0, 1)?;
    match first.first().map(Event::read).transpose()? {
        Some(Event::Created { mission, .. }) => Ok(*mission),
        _ => Err(reader.damaged(number, format!("mission number {number} has no beginning"))),
    }
}

impl Event {
    /// The event that is stored.
    pub fn read(stored: &StoredEvent) -> Result<Self, StoreError> {
        serde_json::from_slice(&stored.body)
            .map_err(|error| StoreError::Damaged(format!("event {} is no event: {error}", stored.sequence)))
    }

    /// As it is stored under that number.
    pub(super) fn stored(&self, sequence: u64) -> StoredEvent {
        StoredEvent {
            sequence,
            kind: self.kind().to_owned(),
            body: json(self).into(),
        }
    }

    /// Every kind's name.
    pub const KINDS: [&str; 9] = [
        "created",
        "ran",
        "paused",
        "changed",
        "reported",
        "planned",
        "clock_set",
        "finished",
        "failed",
    ];

    /// Its kind's name.
    #[must_use]
    pub fn kind(&self) -> &'static str {
        match self {
            Self::Created { .. } => "created",
            Self::Ran { .. } => "ran",
            Self::Paused { .. } => "paused",
            Self::Changed { .. } => "changed",
            Self::Reported { .. } => "reported",
            Self::Planned(_) => "planned",
            Self::ClockSet { .. } => "clock_set",
            Self::Finished { .. } => "finished",
            Self::Failed { .. } => "failed",
        }
    }
}
