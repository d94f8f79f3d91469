//! Missions as clients make, feed and see them.

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

use super::{FieldError, Method, Outcome, PlanResponse, Recount, Segment};

/// A mission to be made: either `simulated` or `live`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct NewMission {
    /// Version of this shape: `"1.0"`.
    #[schema(example = "1.0")]
    pub schema_version: String,
    /// What people call it, at most 200 bytes. Default: the scenario and the seed, or the first AUV.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub title: Option<String>,
    /// Vehicles of the bundled simulator.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub simulated: Option<Simulated>,
    /// Real vehicles, whose fixes are posted as they arrive.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub live: Option<Live>,
    /// Anything; comes back with the mission. At most 4096 bytes.
    #[serde(default, skip_serializing_if = "Map::is_empty")]
    #[schema(value_type = Object)]
    pub metadata: Map<String, Value>,
}

impl NewMission {
    /// Its title. By default the scenario and the seed, or the first AUV.
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

/// A mission of the simulator: `scenario` by name, or a whole one as `scenario_file`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct Simulated {
    /// Name of a built-in scenario with a surface craft.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(example = "paper-intermittent")]
    pub scenario: Option<String>,
    /// A scenario as its TOML file has it, at most 64 KiB. It may name no other file.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub scenario_file: Option<String>,
    /// Seed of everything that the scenario leaves to chance. Default: 1.
    #[serde(default = "one")]
    pub seed: u64,
    /// What steers the surface craft. Default: `mpc`, the planner.
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

/// What steers the surface craft of a simulated mission.
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
    /// Way-points round a box.
    WaypointBox,
}

impl Controller {
    #[expect(clippy::trivially_copy_pass_by_ref, reason = "serde hands references on")]
    fn is_planner(&self) -> bool {
        *self == Self::Mpc
    }

    /// The law, where it is one.
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

/// A mission of real vehicles. Its times are Unix times, s, but for a rehearsal's.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct Live {
    /// The underwater vehicles, 1 to 16, and what is known of their plans.
    pub auvs: Vec<LiveAuv>,
    /// What to do.
    pub goal: Task,
    /// Current at the surface, as in a snapshot.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub current: Option<Current>,
    /// What the surface craft is allowed, as in a snapshot.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub limits: Option<DeclaredLimits>,
    /// How the surface craft answers its references, as in a snapshot.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub craft: Option<CraftDescription>,
    /// Discs to keep out of, as in a snapshot.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub keep_outs: Vec<KeepOut>,
    /// Corners of the area to stay in, as in a snapshot.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub area: Vec<[f64; 2]>,
    /// What the acoustic link needs, as in a snapshot.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub acoustics: Option<Acoustics>,
    /// Horizontal distance to keep from surfacing vehicles, as in a snapshot.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub surfacing_separation_m: Option<f64>,
    /// The planner's levers, as in a snapshot.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tuning: Option<Tuning>,
    /// How to guess the underwater vehicles' future, as in a snapshot.
    #[serde(default)]
    pub forecast: Forecast,
    /// What the last fallback level does, as in a snapshot.
    #[serde(default)]
    pub hold: Hold,
    /// Time between two plans, s, from 0.5 to 60. Default: 1.
    #[serde(default = "unit")]
    pub period_s: f64,
    /// For rehearsals: how many seconds pass on the mission's clock in one, from 1 to 60, since the mission was made.
    /// Default: 1. The mission's clock shows `created_s + clock_rate · (Unix time − created_s)`.
    #[serde(default = "unit")]
    pub clock_rate: f64,
    /// Where the datum of all positions lies on Earth, as in a snapshot. Default: where the first fix in latitude and
    /// longitude is, as long as the mission has no position in metres.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub origin: Option<Origin>,
}

fn unit() -> f64 {
    1.0
}

impl Live {
    /// Puts the datum at `origin`. Positions stay where they are on Earth; if that was unknown, they stay as they are.
    pub fn count_from(&mut self, origin: Origin) {
        let before = self.origin.replace(origin);
        let Some(recount) = before.and_then(|before| Recount::new(before, origin)) else {
            return;
        };
        for disc in &mut self.keep_outs {
            recount.position(&mut disc.north_m, &mut disc.east_m);
        }
        for corner in &mut self.area {
            recount.point(corner);
        }
        let paths = self.auvs.iter_mut().filter_map(|auv| auv.path.as_mut());
        for point in paths
            .flat_map(|path| &mut path.segments)
            .flat_map(Segment::points_mut)
        {
            recount.point(point);
        }
    }
}

/// What of a live mission can be changed while it runs, each member as the mission was made with it.
///
/// As a patch: a member that is given replaces the one there was as a whole, and is not merged with it; `null` leaves
/// nothing; what is left out stays. At least one is given.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct Setting {
    /// What to do. `null` is refused: every mission has a goal.
    #[serde(default, deserialize_with = "required")]
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(value_type = Task, required = false)]
    pub goal: Option<Task>,
    /// What the operator allows the surface craft. Without `craft`, they also describe the craft.
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
    /// Where the datum lies on Earth. All that the mission knows stays where it is on Earth. `null` is refused. The mission itself has
    /// its `origin` beside its setting.
    #[serde(default, deserialize_with = "removable")]
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(value_type = Origin, required = false)]
    pub origin: Option<Option<Origin>>,
    /// Paths of AUVs by name: each replaces the AUV's path as a whole, and `null` leaves it none. AUVs that are not named keep theirs. The
    /// mission's scene has its paths, its setting has not.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub paths: BTreeMap<String, ChangedPath>,
}

/// The new path of an AUV; `null` for none.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(transparent)]
pub struct ChangedPath(pub Option<DeclaredPath>);

/// A member that is given, and not as `null`.
fn required<'de, T: Deserialize<'de>, D: Deserializer<'de>>(given: D) -> Result<Option<T>, D::Error> {
    T::deserialize(given).map(Some)
}

/// A member that is given, of which `null` leaves nothing.
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
    /// How many members it has at most.
    pub const MEMBERS: usize = 8;

    /// Puts the members that are given into `config`, and keeps those that they replace instead.
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

    /// The setting with the members that `patch` gives replaced, but for origin and paths.
    #[must_use]
    pub fn patched(self, patch: Self) -> Self {
        Self {
            goal: patch.goal.or(self.goal),
            limits: patch.limits.or(self.limits),
            craft: patch.craft.or(self.craft),
            tuning: patch.tuning.or(self.tuning),
            keep_outs: patch.keep_outs.or(self.keep_outs),
            area: patch.area.or(self.area),
            ..Self::default()
        }
    }
}

impl From<&Live> for Setting {
    /// Every member, as the mission has it, but for origin and paths.
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
    /// The path that it follows, where that is known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub path: Option<DeclaredPath>,
    /// The sawtooth in which it dives, where that is known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub dive: Option<Dive>,
}

/// What was heard, in any order: late, twice, out of turn. Each report is accepted or rejected by itself.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct Reports {
    /// Where the datum of the mission was put: by the first of these fixes, of a mission that had none. Written by the
    /// service.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub origin: Option<Origin>,
    /// The reports that were rejected: of each the first fault, with a pointer into the body as it was posted. Written by the service.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub rejected: Vec<FieldError>,
    /// When the surface craft received them, Unix time, s. Default: when the service did.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub received_s: Option<f64>,
    /// Fixes, at most 64 of each underwater vehicle; `t_s` of each is the Unix time when it was sent.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub auvs: BTreeMap<String, Vec<Report>>,
    /// States of the surface craft, at most 64. The newest counts.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub asc: Vec<AscReport>,
    /// What happened aboard that the mission's log is to tell, at most 64. No plan depends on it.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub notes: Vec<Note>,
    /// Whether the surface craft is steered, by whoever steers it, at most 64. The newest counts. No plan depends on it.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub steering: Vec<Steering>,
}

impl Reports {
    /// Every position, as north, east, latitude and longitude.
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

    /// Gives positions in metres from `origin` their latitude and longitude. Leaves all where `origin` is no place on Earth.
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

    /// Whether every position has its latitude.
    #[must_use]
    pub fn is_complete(&self) -> bool {
        let fixes = self.auvs.values().flatten().map(|fix| fix.lat_deg);
        let states = self.asc.iter().map(|report| report.state.lat_deg);
        fixes.chain(states).all(|lat_deg| lat_deg.is_some())
    }

    /// Whether there is no report.
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

/// Something that happened aboard: a person took over, a heartbeat was lost.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct Note {
    /// When, Unix time, s: at most a day ago, and at most 1 s ahead.
    pub t_s: f64,
    /// What, at most 500 bytes.
    #[schema(example = "a person has the craft")]
    pub text: String,
}

/// Whether the surface craft is steered, as only who steers it knows: a bridge says it once a second. Nobody else can.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct Steering {
    /// When it was so, Unix time, s: at most half an hour ago, and at most 1 s ahead.
    pub t_s: f64,
    /// What is so.
    pub state: SteeringState,
    /// Why, for people, at most 500 bytes.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    #[schema(example = "the autopilot left its guided mode")]
    pub why: String,
}

impl Steering {
    /// What this tells at `now` on the mission's clock, s.
    #[must_use]
    pub fn at(&self, now: f64) -> LastSteering {
        LastSteering {
            state: self.state,
            why: self.why.clone(),
            age_s: (now - self.t_s).max(0.0),
        }
    }
}

/// Who has the surface craft.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum SteeringState {
    /// The mission's references are sent to it.
    Steering,
    /// They are, and something is wrong with them or with how it follows them.
    Degraded,
    /// A person has it.
    Person,
    /// Nothing is sent to it yet, as is meant: there is no plan, it is not armed, or this is a dry run.
    Waiting,
    /// Nothing is sent to it, and somebody has to look why.
    NotSteering,
}

/// What was said last of whether the surface craft is steered.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct LastSteering {
    /// What was so.
    pub state: SteeringState,
    /// Why, for people.
    pub why: String,
    /// How long ago, s on the mission's clock. What is older than 3 s is no longer known.
    pub age_s: f64,
}

/// A state of the surface craft.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct AscReport {
    /// When it was so, Unix time, s: at most a day ago, and at most 1 s ahead.
    pub t_s: f64,
    /// What it was.
    pub state: Asc,
    /// Current as the craft's own observer has it: it counts before the mission's `current`, and nothing is made of the velocities.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub current: Option<Current>,
    /// Whether the mission's references steered it. Where a person did, nothing is learnt of how it answers references, what was learnt
    /// stays, and the next reference turns from where the bow is. Default: yes.
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

/// Where a mission is in its life.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Status {
    /// Made, and not begun.
    Created,
    /// Under way.
    Running,
    /// Paused; can be resumed.
    Paused,
    /// Over.
    Finished,
    /// Over, for a reason that its events tell.
    Failed,
}

impl Status {
    /// Whether nothing more will happen.
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
    /// What people call it.
    pub title: String,
    /// `simulated` or `live`.
    pub kind: String,
    /// Where it is in its life.
    pub status: Status,
    /// When it was made, Unix time, s.
    pub created_s: f64,
    /// When it was begun, Unix time, s.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub started_s: Option<f64>,
    /// When it was over, Unix time, s.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub finished_s: Option<f64>,
    /// When it was planned for last, on its own clock: s since the start of a simulated mission, Unix time of a live one.
    pub t_s: f64,
    /// How many seconds of it pass in one; none: as fast as it can, or it is live.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub speed_factor: Option<f64>,
    /// Number of its last event.
    pub sequence: u64,
    /// Number of the event that last changed its setting or status: the `ETag` of answers with this mission, for `If-Match`.
    #[serde(default)]
    pub revision: u64,
    /// Of a live mission, what it does now and within which bounds: PATCH changes it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub setting: Option<Setting>,
    /// Where the datum of a live mission lies on Earth, where that is known: as it was made with, by its first fix, or as it was changed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub origin: Option<Origin>,
    /// What the client gave it along.
    #[serde(default, skip_serializing_if = "Map::is_empty")]
    #[schema(value_type = Object)]
    pub metadata: Map<String, Value>,
    /// The last plan, of a mission that was asked for or has run since the service was started.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub plan: Option<PlanSummary>,
    /// Whether the craft of a live mission is steered, as was said last. None: nobody has said it since the mission was begun.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub steering: Option<LastSteering>,
}

/// What the last plan of a mission amounts to.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct PlanSummary {
    /// Whether it is what was asked for.
    pub outcome: Outcome,
    /// Why the outcome is `degraded`, as the answer's `reason`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reason: Option<String>,
    /// What led to it.
    pub method: Method,
    /// Time since the plan's own, s on the mission's clock. It grows while no new plan is made: beyond some `period_s` of a mission
    /// that is running, plans are missed. 0 of a simulated mission, whose clock stands still from one plan to the next.
    pub age_s: f64,
    /// Time between two plans, s on the mission's clock.
    pub period_s: f64,
    /// How long after it was due it was made, s.
    pub late_s: f64,
    /// What it warns of, for people.
    pub warnings: Vec<String>,
    /// Codes of `warnings`, in their order.
    #[serde(default)]
    pub warning_codes: Vec<String>,
    /// When each vehicle of a live mission was last heard, s on its clock.
    pub heard_s: BTreeMap<String, f64>,
    /// Vehicles without recent reports, because of which no plan is made.
    pub waits_for: Vec<String>,
}

/// What a map of a mission shows beside the vehicles, and what its controller knows, as of the mission's creation. Later changes are in
/// its `setting`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Scene {
    /// Duration of a simulated mission, s.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub duration_s: Option<f64>,
    /// Start of the settled scores (such as `settled_rms_m` of `pilotfish compare`) in a simulated mission, s since its start.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub settled_after_s: Option<f64>,
    /// Time between two plans, s.
    pub period_s: f64,
    /// Seconds that pass on a live mission's clock in one.
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
    /// Gains that the law of a simulated mission was given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub gains: Option<LawGains>,
    /// Faults of a simulated mission, in the order of their starts.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub faults: Vec<SceneFault>,
    /// What the controller knows, in words.
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
    /// Points (north, east) of the paths of the underwater vehicles whose paths are known to the simulator or the mission, m.
    pub paths: BTreeMap<String, Vec<[f64; 2]>>,
    /// Where the datum lies on Earth, where that is known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub origin: Option<Origin>,
}

/// A fault of a simulated mission.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct SceneFault {
    /// Start, s since the mission's.
    pub from_s: f64,
    /// End, s; none if it lasts until the mission's end.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub until_s: Option<f64>,
    /// What goes wrong, in words.
    pub what: String,
}

/// Missions, in the order in which they were made.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct MissionList {
    /// Some of them.
    pub missions: Vec<Mission>,
    /// Where the next ones begin: the `after` to ask for them with. None: there are no more.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub next: Option<u64>,
}

/// An order that changed a mission, or deleted it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Order {
    /// Its number.
    pub number: u64,
    /// When it was given, Unix time, s.
    pub at_s: f64,
    /// Who gave it: the name of a token, or an address where the service asks for none.
    pub caller: String,
    /// The request, as the service's log has it.
    pub request_id: String,
    /// The mission's `id`.
    pub mission: String,
    /// What was ordered: `create`, `run`, `pause`, `step`, `change`, `finish`, `delete` or, by the service itself, `expire`.
    pub action: String,
}

/// Orders, in the order in which they were stored.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct OrderList {
    /// Some of them.
    pub orders: Vec<Order>,
    /// Where the next ones begin: the `after` to ask for them with. None: there are no more.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub next: Option<u64>,
}

/// How to go on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct Run {
    /// How many seconds of a simulated mission pass in one, from 0.1 to 1000. Default: as fast as it can.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub speed_factor: Option<f64>,
}

/// How far to go on.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct Step {
    /// How many plans to make and follow, from 1 to 60. Default: 1.
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

/// What was accepted of what was heard is on the disk.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Accepted {
    /// Number of the event that stores it.
    pub sequence: u64,
    /// Where the datum of the mission was put, by the first of these fixes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub origin: Option<Origin>,
    /// The reports that were rejected: of each the first fault, with a pointer into the body. An AUV that the mission does not know is
    /// named once. The others are on the disk.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub rejected: Vec<FieldError>,
}

/// Where everybody truly is in a simulated mission, when a plan is made.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Truth {
    /// The surface craft.
    pub asc: TrueVehicle,
    /// The underwater vehicles, by name.
    pub auvs: BTreeMap<String, TrueVehicle>,
    /// The goal's position, m.
    pub goal_north_m: f64,
    /// The goal's position, m.
    pub goal_east_m: f64,
    /// From the surface craft to the goal, m.
    pub distance_m: f64,
    /// Propulsion energy since the start, J.
    pub energy_j: f64,
}

/// A vehicle of a simulated mission.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct TrueVehicle {
    /// Position, m.
    pub north_m: f64,
    /// Position, m.
    pub east_m: f64,
    /// Depth, m, positive down.
    pub depth_m: f64,
    /// Heading, rad, in (−π, π].
    pub heading_rad: f64,
    /// Surge speed through the water, m/s.
    pub speed_mps: f64,
}

/// The reference that counts now.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct CurrentReference {
    /// The mission.
    pub mission: String,
    /// Where it is in its life: only one that is running plans anew.
    pub status: Status,
    /// Number of the event that stored the plan.
    pub sequence: u64,
    /// When the plan was made, on the mission's clock, s.
    pub t_s: f64,
    /// How long after it was due the plan was made, s.
    pub late_s: f64,
    /// Its age, s of the mission's clock. Beyond `plan.reference.valid_until_s` it should not be followed.
    pub age_s: f64,
    /// Whether it is what was asked for.
    pub outcome: Outcome,
    /// What led to it.
    pub method: Method,
    /// When each vehicle was last heard, on the mission's clock, s: `asc` and the AUVs of the plan.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub heard_s: BTreeMap<String, f64>,
    /// Vehicles of which nothing is known that another plan could rest on; empty as long as there is one every period.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub waits_for: Vec<String>,
    /// Plans that were due and not made since the service took the mission up: it had too much to do, the disk took nothing,
    /// or what was known made no valid facts.
    pub missed: u64,
    /// The plan, whole.
    pub plan: PlanResponse,
}
