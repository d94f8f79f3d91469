//! Missions, as clients create, feed and see them.

use std::{collections::BTreeMap, mem};

use geodesy::Datum;
use nalgebra::Vector2;
use planner::{
    craft::CraftDescription,
    los::{LawGains, LosLaw},
    snapshot::{
        Acoustics, Asc, Current, DeclaredLimits, DeclaredPath, Dive, Forecast, Hold, KeepOut, Origin, Report,
        Task, Tuning,
    },
};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use serde_json::{Map, Value};
use utoipa::ToSchema;

use super::{DatumChange, FieldError, Method, Outcome, PlanResponse, Segment};

/// A mission to create: either `simulated` or `live`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct NewMission {
    /// Version of this shape: `"1.0"`.
    #[schema(example = "1.0")]
    pub schema_version: String,
    /// Name for people, at most 200 bytes. Default: the scenario and the seed, or the first AUV.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub title: Option<String>,
    /// Vehicles of the bundled simulator.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub simulated: Option<Simulated>,
    /// Real vehicles, whose fixes are posted as they arrive.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub live: Option<Live>,
    /// Any data of the client, returned with the mission. At most 4096 bytes.
    #[serde(default, skip_serializing_if = "Map::is_empty")]
    #[schema(value_type = Object)]
    pub metadata: Map<String, Value>,
}

impl NewMission {
    /// The given title, or the default.
    #[must_use]
    pub fn title(&self) -> Option<String> {
        let of_the_scenario = |simulated: &Simulated| {
            let scenario = simulated.scenario.as_deref().unwrap_or("own scenario");
            format!("{scenario}, seed {}", simulated.seed)
        };
        let first = || Some(self.live.as_ref()?.auvs.first()?.id.clone());
        let given = self.title.clone();
        given
            .or_else(|| self.simulated.as_ref().map(of_the_scenario))
            .or_else(first)
    }
}

/// A mission of the simulator: a `scenario` by name, or a complete `scenario_file`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct Simulated {
    /// Name of a built-in scenario with a surface craft.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(example = "paper-intermittent")]
    pub scenario: Option<String>,
    /// Text of a scenario's TOML file, at most 64 KiB. It may not name other files.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub scenario_file: Option<String>,
    /// Seed of the scenario's random numbers. Default: 1.
    #[serde(default = "one")]
    pub seed: u64,
    /// Controller of the surface craft. Default: `mpc`, the planner.
    #[serde(default, skip_serializing_if = "Controller::is_planner")]
    #[schema(required = false)]
    pub controller: Controller,
    /// The planner's levers, as in a snapshot. Laws do not use them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tuning: Option<Tuning>,
    /// Gains of the law that `controller` names. Default: the service's.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub gains: Option<LawGains>,
}

/// Controller of the surface craft of a simulated mission.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Controller {
    /// The planner.
    #[default]
    Mpc,
    /// The saturated line-of-sight law.
    SaturatedLos,
    /// Line of sight in the tracker's frame.
    SaturatedLosTrackerFrame,
    /// Integral line of sight.
    IntegralLos,
    /// Way-points around a box.
    WaypointBox,
}

impl Controller {
    #[expect(clippy::trivially_copy_pass_by_ref, reason = "serde hands references on")]
    fn is_planner(&self) -> bool {
        *self == Self::Mpc
    }

    /// The line-of-sight law; none for the planner.
    #[must_use]
    pub fn law(self) -> Option<LosLaw> {
        match self {
            Self::Mpc => None,
            Self::SaturatedLos => Some(LosLaw::SaturatedLos),
            Self::SaturatedLosTrackerFrame => Some(LosLaw::TrackerFrame),
            Self::IntegralLos => Some(LosLaw::Integral),
            Self::WaypointBox => Some(LosLaw::WaypointBox),
        }
    }
}

fn one() -> u64 {
    1
}

/// A mission of real vehicles. Its times are Unix times, s, except in a rehearsal.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct Live {
    /// The underwater vehicles, 1 to 16, with their known paths and dives.
    pub auvs: Vec<LiveAuv>,
    /// The goal.
    pub goal: Task,
    /// Current at the surface, as in a snapshot.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub current: Option<Current>,
    /// Limits of the surface craft, as in a snapshot.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub limits: Option<DeclaredLimits>,
    /// Closed-loop response of the surface craft, as in a snapshot.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub craft: Option<CraftDescription>,
    /// Discs to keep out of, as in a snapshot.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub keep_outs: Vec<KeepOut>,
    /// Corners of the area to stay in, as in a snapshot.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub area: Vec<[f64; 2]>,
    /// Needs of the acoustic link, as in a snapshot.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub acoustics: Option<Acoustics>,
    /// Horizontal distance to keep from surfacing vehicles, as in a snapshot.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub surfacing_separation_m: Option<f64>,
    /// The planner's levers, as in a snapshot.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tuning: Option<Tuning>,
    /// Forecast of the underwater vehicles, as in a snapshot.
    #[serde(default)]
    pub forecast: Forecast,
    /// Behaviour of the last fallback level, as in a snapshot.
    #[serde(default)]
    pub hold: Hold,
    /// Time between two plans, s, from 0.5 to 60. Default: 1.
    #[serde(default = "unit")]
    pub period_s: f64,
    /// For rehearsals: seconds of the mission's clock per second, from 1 to 60. Default: 1. The
    /// clock shows `created_s + clock_rate · (Unix time − created_s)`.
    #[serde(default = "unit")]
    pub clock_rate: f64,
    /// Place of the datum of all positions on Earth, as in a snapshot. Default: the first fix in
    /// latitude and longitude, while the mission has no position in metres.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub origin: Option<Origin>,
}

fn unit() -> f64 {
    1.0
}

impl Live {
    /// Puts the datum at `origin`. Positions keep their place on Earth, or else their numbers.
    pub fn count_from(&mut self, origin: Origin) {
        let before = self.origin.replace(origin);
        let Some(change) = before.and_then(|before| DatumChange::new(before, origin)) else {
            return;
        };
        for disc in &mut self.keep_outs {
            change.position(&mut disc.north_m, &mut disc.east_m);
        }
        for corner in &mut self.area {
            change.point(corner);
        }
        let paths = self.auvs.iter_mut().filter_map(|auv| auv.path.as_mut());
        for point in paths
            .flat_map(|path| &mut path.segments)
            .flat_map(Segment::points_mut)
        {
            change.point(point);
        }
    }
}

/// The members of a live mission that can be changed while it runs.
///
/// In a patch, a given member replaces the previous one as a whole, without merging. `null` removes
/// it. Members that are left out stay. At least one is given.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct Setting {
    /// The goal. `null` is refused: every mission has one.
    #[serde(default, deserialize_with = "required")]
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(value_type = Task, required = false)]
    pub goal: Option<Task>,
    /// The operator's limits of the surface craft. Without `craft`, they also describe the craft.
    #[serde(default, deserialize_with = "removable")]
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(value_type = Option<DeclaredLimits>)]
    pub limits: Option<Option<DeclaredLimits>>,
    /// Closed-loop response of the surface craft. After a change, learning starts anew.
    #[serde(default, deserialize_with = "removable")]
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(value_type = Option<CraftDescription>)]
    pub craft: Option<Option<CraftDescription>>,
    /// The planner's levers.
    #[serde(default, deserialize_with = "removable")]
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(value_type = Option<Tuning>)]
    pub tuning: Option<Option<Tuning>>,
    /// Discs to keep out of.
    #[serde(default, deserialize_with = "removable")]
    #[serde(serialize_with = "null_if_empty", skip_serializing_if = "Option::is_none")]
    #[schema(value_type = Option<Vec<KeepOut>>)]
    pub keep_outs: Option<Vec<KeepOut>>,
    /// Corners of the area to stay in.
    #[serde(default, deserialize_with = "removable")]
    #[serde(serialize_with = "null_if_empty", skip_serializing_if = "Option::is_none")]
    #[schema(value_type = Option<Vec<[f64; 2]>>)]
    pub area: Option<Vec<[f64; 2]>>,
    /// Place of the datum on Earth. Everything keeps its place on Earth. `null` is refused. A
    /// mission shows its `origin` beside its setting.
    #[serde(default, deserialize_with = "removable")]
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(value_type = Origin, required = false)]
    pub origin: Option<Option<Origin>>,
    /// Paths of AUVs by name. Each replaces the AUV's path as a whole; `null` removes it. Other
    /// AUVs keep theirs. A mission shows paths in its scene, not in its setting.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub paths: BTreeMap<String, ChangedPath>,
}

/// The new path of an AUV; `null` for none.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(transparent)]
pub struct ChangedPath(pub Option<DeclaredPath>);

/// Reads a member that must not be `null`.
fn required<'de, T: Deserialize<'de>, D: Deserializer<'de>>(given: D) -> Result<Option<T>, D::Error> {
    T::deserialize(given).map(Some)
}

/// Reads a member that `null` removes.
fn removable<'de, T, D>(given: D) -> Result<Option<T>, D::Error>
where
    T: Deserialize<'de> + Default,
    D: Deserializer<'de>,
{
    Option::deserialize(given).map(|given| Some(given.unwrap_or_default()))
}

#[expect(clippy::ref_option, reason = "this is how serde calls it")]
fn null_if_empty<T: Serialize, S: Serializer>(
    given: &Option<Vec<T>>,
    serializer: S,
) -> Result<S::Ok, S::Error> {
    given
        .as_ref()
        .filter(|items| !items.is_empty())
        .serialize(serializer)
}

impl Setting {
    /// Largest number of members.
    pub const MEMBERS: usize = 8;

    /// Exchanges the given members with those of `config`.
    pub fn exchange_with(&mut self, config: &mut Live) {
        fn exchange<T>(given: Option<&mut T>, place: &mut T) {
            if let Some(given) = given {
                mem::swap(given, place);
            }
        }
        exchange(self.goal.as_mut(), &mut config.goal);
        exchange(self.limits.as_mut(), &mut config.limits);
        exchange(self.craft.as_mut(), &mut config.craft);
        exchange(self.tuning.as_mut(), &mut config.tuning);
        exchange(self.keep_outs.as_mut(), &mut config.keep_outs);
        exchange(self.area.as_mut(), &mut config.area);
        exchange(self.origin.as_mut(), &mut config.origin);
        for auv in &mut config.auvs {
            exchange(self.paths.get_mut(&auv.id).map(|path| &mut path.0), &mut auv.path);
        }
    }
}

impl From<&Live> for Setting {
    /// Every member of the mission's setting, without origin and paths.
    fn from(config: &Live) -> Self {
        Self {
            goal: Some(config.goal.clone()),
            limits: Some(config.limits),
            craft: Some(config.craft.clone()),
            tuning: Some(config.tuning.clone()),
            keep_outs: Some(config.keep_outs.clone()),
            area: Some(config.area.clone()),
            ..Self::default()
        }
    }
}

/// An underwater vehicle of a live mission.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct LiveAuv {
    /// Its name, unique in the mission, 1 to 64 bytes.
    #[schema(example = "auv-1")]
    pub id: String,
    /// Its path, if known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub path: Option<DeclaredPath>,
    /// The sawtooth in which it dives, if known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub dive: Option<Dive>,
}

/// Reports in any order, also late or repeated. Each is accepted or rejected by itself.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct Reports {
    /// Place of the datum, if the first of these fixes has set it. Written by the service.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub origin: Option<Origin>,
    /// The first fault of each rejected report, at its place in the body. Written by the service.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub rejected: Vec<FieldError>,
    /// Unix time at which the surface craft received them, s. Default: that of the service.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub received_s: Option<f64>,
    /// Fixes, at most 64 of each underwater vehicle; `t_s` is the Unix time of sending.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub auvs: BTreeMap<String, Vec<Report>>,
    /// States of the surface craft, at most 64. The newest counts.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub asc: Vec<AscReport>,
    /// Events aboard for the mission's log, at most 64. No plan depends on them.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub notes: Vec<Note>,
    /// States of steering, from the program that steers, at most 64. The newest counts.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub steering: Vec<Steering>,
}

impl Reports {
    /// All positions, as north, east, latitude and longitude.
    fn positions(
        &mut self,
    ) -> impl Iterator<Item = (&mut f64, &mut f64, &mut Option<f64>, &mut Option<f64>)> {
        let states = self.asc.iter_mut().map(|report| {
            let at = &mut report.state;
            (&mut at.north_m, &mut at.east_m, &mut at.lat_deg, &mut at.lon_deg)
        });
        let fixes = self.auvs.values_mut().flatten();
        states.chain(fixes.map(|at| (&mut at.north_m, &mut at.east_m, &mut at.lat_deg, &mut at.lon_deg)))
    }

    /// Adds latitude and longitude to positions in metres, if `origin` is a place on Earth.
    pub fn complete(&mut self, origin: Origin) {
        let Ok(datum) = Datum::new(&origin.into()) else {
            return;
        };
        for (north, east, lat_deg, lon_deg) in self.positions() {
            if lat_deg.is_none() {
                let place = Origin::from(datum.from_local(&Vector2::new(*north, *east)));
                (*lat_deg, *lon_deg) = (Some(place.lat_deg), Some(place.lon_deg));
            }
        }
    }

    /// `true` if every position has its latitude.
    #[must_use]
    pub fn is_complete(&self) -> bool {
        let fixes = self.auvs.values().flatten().map(|fix| fix.lat_deg);
        let states = self.asc.iter().map(|report| report.state.lat_deg);
        fixes.chain(states).all(|lat_deg| lat_deg.is_some())
    }

    /// `true` if there is no report.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.auvs.is_empty() && self.asc.is_empty() && self.notes.is_empty() && self.steering.is_empty()
    }

    /// Adds the reports of `others`.
    pub fn extend(&mut self, others: Self) {
        for (id, fixes) in others.auvs {
            self.auvs.entry(id).or_default().extend(fixes);
        }
        self.asc.extend(others.asc);
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
    #[must_use]
    pub fn at(&self, now: f64) -> LastSteering {
        LastSteering {
            state: self.state,
            why: self.why.clone(),
            age_s: (now - self.t_s).max(0.0),
        }
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
    /// Unix time of the state, s: at most a day ago, and at most 1 s ahead.
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
}

fn yes() -> bool {
    true
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde hands references on")]
fn is_yes(said: &bool) -> bool {
    *said
}

/// Status of a mission.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Status {
    /// Created, but not started.
    Created,
    /// Running.
    Running,
    /// Paused; can be resumed.
    Paused,
    /// Over.
    Finished,
    /// Over because of a failure, which its events name.
    Failed,
}

impl Status {
    /// `true` if nothing more will happen.
    #[must_use]
    pub fn is_over(self) -> bool {
        matches!(self, Self::Finished | Self::Failed)
    }

    /// Its name in JSON.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Created => "created",
            Self::Running => "running",
            Self::Paused => "paused",
            Self::Finished => "finished",
            Self::Failed => "failed",
        }
    }
}

/// A mission.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Mission {
    /// Its name in paths.
    pub id: String,
    /// Name for people.
    pub title: String,
    /// `simulated` or `live`.
    pub kind: String,
    /// Its status.
    pub status: Status,
    /// Unix time of its creation, s.
    pub created_s: f64,
    /// Unix time of its start, s.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub started_s: Option<f64>,
    /// Unix time of its end, s.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub finished_s: Option<f64>,
    /// Time of its last plan: s since the start of a simulated mission, Unix time of a live one.
    pub t_s: f64,
    /// Seconds of a simulated mission per second; none: as fast as possible.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub speed_factor: Option<f64>,
    /// Number of its last event.
    pub sequence: u64,
    /// Number of the event that last changed its setting or status: the `ETag`, for `If-Match`.
    #[serde(default)]
    pub revision: u64,
    /// Changeable members of a live mission: PATCH changes them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub setting: Option<Setting>,
    /// Place of a live mission's datum on Earth, if its creation, a fix or a change has set it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub origin: Option<Origin>,
    /// Metadata of the client.
    #[serde(default, skip_serializing_if = "Map::is_empty")]
    #[schema(value_type = Object)]
    pub metadata: Map<String, Value>,
    /// The last plan; after a start of the service, absent until the mission runs or is requested.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub plan: Option<PlanSummary>,
    /// Last reported state of a live mission's steering. None: no report since the start.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub steering: Option<LastSteering>,
}

/// Summary of a mission's last plan.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct PlanSummary {
    /// Outcome of the plan.
    pub outcome: Outcome,
    /// Reason for the outcome `degraded`, as in the answer.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reason: Option<String>,
    /// The fallback level or law that answered.
    pub method: Method,
    /// Age of the plan, s on the mission's clock. An age of several `period_s` in a running mission
    /// means missed plans. Always 0 in a simulated mission: its clock stops between plans.
    pub age_s: f64,
    /// Time between two plans, s on the mission's clock.
    pub period_s: f64,
    /// Delay of the plan after its due time, s.
    pub late_s: f64,
    /// Its warnings, for people.
    pub warnings: Vec<String>,
    /// Codes of `warnings`, in their order.
    #[serde(default)]
    pub warning_codes: Vec<String>,
    /// Times at which vehicles of a live mission were last heard, s on its clock.
    pub heard_s: BTreeMap<String, f64>,
    /// Vehicles without recent reports, for which the next plan waits.
    pub waits_for: Vec<String>,
}

/// Map objects beside the vehicles, and the controller's information, as of the mission's creation.
/// Later changes are in its `setting`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Scene {
    /// Duration of a simulated mission, s.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub duration_s: Option<f64>,
    /// Start of the settled scores, such as `settled_rms_m`, s since a simulated mission's start.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub settled_after_s: Option<f64>,
    /// Time between two plans, s.
    pub period_s: f64,
    /// Seconds of a live mission's clock per second.
    pub clock_rate: f64,
    /// Name of the scenario, if it has one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub scenario: Option<String>,
    /// The seed of a simulated mission.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub seed: Option<u64>,
    /// Controller of a simulated mission.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub controller: Option<Controller>,
    /// Gains of a simulated mission's law.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub gains: Option<LawGains>,
    /// Faults of a simulated mission, in the order of their starts.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub faults: Vec<SceneFault>,
    /// The controller's information, in words.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub information: Option<String>,
    /// The goal of a simulated mission; that of a live one is in its setting.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub goal: Option<Task>,
    /// The underwater vehicles.
    pub auvs: Vec<String>,
    /// Discs to keep out of.
    pub keep_outs: Vec<KeepOut>,
    /// Corners (north, east) of the area to stay in, m.
    pub area: Vec<[f64; 2]>,
    /// Slant range to keep within, m.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub range_max_m: Option<f64>,
    /// Points (north, east) of the known paths of underwater vehicles, m.
    pub paths: BTreeMap<String, Vec<[f64; 2]>>,
    /// Place of the datum on Earth, if known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub origin: Option<Origin>,
}

/// A fault of a simulated mission.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct SceneFault {
    /// Start, s since the mission's start.
    pub from_s: f64,
    /// End, s; none if it lasts until the mission's end.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub until_s: Option<f64>,
    /// The fault, in words.
    pub what: String,
}

/// Missions, in the order of their creation.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct MissionList {
    /// A page of missions.
    pub missions: Vec<Mission>,
    /// Parameter `after` of the next page; none on the last page.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub next: Option<u64>,
}

/// An order that changed or deleted a mission.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Order {
    /// Its number.
    pub number: u64,
    /// Unix time of the order, s.
    pub at_s: f64,
    /// Its author: the name of a token, or an address if the service needs no tokens.
    pub caller: String,
    /// The request's id in the service's log.
    pub request_id: String,
    /// The mission's `id`.
    pub mission: String,
    /// `create`, `run`, `pause`, `step`, `change`, `finish`, `delete`, or the service's `expire`.
    pub action: String,
}

/// Orders, oldest first.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct OrderList {
    /// A page of orders.
    pub orders: Vec<Order>,
    /// Parameter `after` of the next page; none on the last page.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub next: Option<u64>,
}

/// Parameters of a run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct Run {
    /// Seconds of a simulated mission per second, from 0.1 to 1000. Default: as fast as possible.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub speed_factor: Option<f64>,
}

/// Parameters of a step.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct Step {
    /// Plans to make and follow, from 1 to 60. Default: 1.
    #[serde(default = "one_tick")]
    pub ticks: u32,
}

fn one_tick() -> u32 {
    1
}

impl Default for Step {
    fn default() -> Self {
        Self { ticks: one_tick() }
    }
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

/// True states in a simulated mission at the time of a plan.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Truth {
    /// The surface craft.
    pub asc: TrueVehicle,
    /// The underwater vehicles, by name.
    pub auvs: BTreeMap<String, TrueVehicle>,
    /// The goal's position north, m.
    pub goal_north_m: f64,
    /// The goal's position east, m.
    pub goal_east_m: f64,
    /// Distance of the surface craft to the goal, m.
    pub distance_m: f64,
    /// Propulsion energy since the start, J.
    pub energy_j: f64,
}

/// A vehicle of a simulated mission.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct TrueVehicle {
    /// Position north, m.
    pub north_m: f64,
    /// Position east, m.
    pub east_m: f64,
    /// Depth, m, positive down.
    pub depth_m: f64,
    /// Heading, rad, in (−π, π].
    pub heading_rad: f64,
    /// Surge speed through the water, m/s.
    pub speed_mps: f64,
}

/// The reference to follow now.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct CurrentReference {
    /// The mission.
    pub mission: String,
    /// The mission's status. Only a running mission makes new plans.
    pub status: Status,
    /// Number of the event that stored the plan.
    pub sequence: u64,
    /// Time of the plan on the mission's clock, s.
    pub t_s: f64,
    /// Delay of the plan after its due time, s.
    pub late_s: f64,
    /// Its age, s on the mission's clock. Do not follow it after `plan.reference.valid_until_s`.
    pub age_s: f64,
    /// Outcome of the plan.
    pub outcome: Outcome,
    /// The fallback level or law that answered.
    pub method: Method,
    /// Times at which `asc` and the plan's AUVs were last heard, on the mission's clock, s.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub heard_s: BTreeMap<String, f64>,
    /// Vehicles without recent reports, for which the next plan waits; empty while plans are made.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub waits_for: Vec<String>,
    /// Due plans that were not made since the service took over the mission: it was overloaded, the
    /// disk refused to write, or the known facts were invalid.
    pub missed: u64,
    /// The complete plan.
    pub plan: PlanResponse,
}
