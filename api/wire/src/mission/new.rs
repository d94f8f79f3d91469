//! A mission to create.

use planner::craft::CraftDescription;
use planner::los::{LawGains, LosLaw};
use planner::snapshot::{
    Acoustics, Current, DeclaredLimits, DeclaredPath, Dive, Forecast, Hold, KeepOut, NoGo, Origin, Task,
    Tuning, VehicleId,
};
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};
use serde_with::skip_serializing_none;
use utoipa::ToSchema;

use crate::{DatumChange, Segment};

/// A mission to create: either `simulated` or `live`.
#[skip_serializing_none]
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct NewMission {
    /// Version of this shape: `"1.0"`.
    #[schema(example = "1.0")]
    pub schema_version: String,
    /// Name for people, at most 200 bytes. Default: the scenario and the seed, or the first AUV.
    pub title: Option<String>,
    /// Vehicles of the bundled simulator.
    pub simulated: Option<Simulated>,
    /// Real vehicles, whose fixes are posted as they arrive.
    pub live: Option<Live>,
    /// Any data of the client, returned with the mission. At most 4096 bytes.
    #[serde(default, skip_serializing_if = "Map::is_empty")]
    #[schema(value_type = Object)]
    pub metadata: Map<String, Value>,
}

impl NewMission {
    /// The given title, or the default.
    pub fn title(&self) -> Option<String> {
        let of_the_scenario = |simulated: &Simulated| {
            let scenario = simulated.scenario.as_deref().unwrap_or("own scenario");
            format!("{scenario}, seed {}", simulated.seed)
        };
        let first = || Some(self.live.as_ref()?.auvs.first()?.id.clone());
        let of_the_scenario = || self.simulated.as_ref().map(of_the_scenario);
        self.title.clone().or_else(of_the_scenario).or_else(first)
    }
}

/// A mission of the simulator: a `scenario` by name, or a complete `scenario_file`.
#[skip_serializing_none]
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct Simulated {
    /// Name of a built-in scenario with a surface craft.
    #[schema(example = "paper-intermittent")]
    pub scenario: Option<String>,
    /// Text of a scenario's TOML file, at most 64 KiB. It may not name other files.
    pub scenario_file: Option<String>,
    /// Seed of the scenario's random numbers. Default: 1.
    #[serde(default = "one")]
    pub seed: u64,
    /// Controller of the surface craft. Default: `mpc`, the planner.
    #[serde(default, skip_serializing_if = "Controller::is_planner")]
    #[schema(required = false)]
    pub controller: Controller,
    /// The planner's levers, as in a snapshot. Laws do not use them.
    pub tuning: Option<Tuning>,
    /// Gains of the law that `controller` names. Default: the service's.
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
#[skip_serializing_none]
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct Live {
    /// The underwater vehicles, 1 to 16, with their known paths and dives.
    pub auvs: Vec<LiveAuv>,
    /// The goal.
    pub goal: Task,
    /// Current at the surface, as in a snapshot.
    pub current: Option<Current>,
    /// Limits of the surface craft, as in a snapshot.
    pub limits: Option<DeclaredLimits>,
    /// Closed-loop response of the surface craft, as in a snapshot.
    pub craft: Option<CraftDescription>,
    /// The surface craft of a fleet, 1 to 6 in the order of way, in place of `limits` and `craft`.
    /// Default: one craft without a name.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub surface_craft: Vec<LiveCraft>,
    /// Time for which a craft of a fleet still serves an AUV that was given to another, s. Default:
    /// 0.
    pub hand_over_s: Option<f64>,
    /// Discs to keep out of, as in a snapshot.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub keep_outs: Vec<KeepOut>,
    /// Polygons to keep out of, as in a snapshot.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub no_go: Vec<NoGo>,
    /// Corners of the area to stay in, as in a snapshot.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub area: Vec<[f64; 2]>,
    /// Needs of the acoustic link, as in a snapshot.
    pub acoustics: Option<Acoustics>,
    /// Horizontal distance to keep from surfacing vehicles, as in a snapshot.
    pub surfacing_separation_m: Option<f64>,
    /// Distance to keep from other vessels' sides, as in a snapshot.
    pub vessel_separation_m: Option<f64>,
    /// The planner's levers, as in a snapshot.
    pub tuning: Option<Tuning>,
    /// Forecast of the underwater vehicles, as in a snapshot.
    #[serde(default)]
    pub forecast: Forecast,
    /// Behaviour of the last fallback level, as in a snapshot.
    #[serde(default)]
    pub hold: Hold,
    /// Time between two plans, s. Default: 1.
    #[serde(default = "unit")]
    pub period_s: f64,
    /// For rehearsals: seconds of the mission's clock per second. Default: 1. The clock shows
    /// `created_s + clock_rate · (Unix time − created_s)`.
    #[serde(default = "unit")]
    pub clock_rate: f64,
    /// Place of the datum of all positions on Earth, as in a snapshot. Default: the first fix in
    /// latitude and longitude, while the mission has no position in metres.
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
        self.area.iter_mut().for_each(|corner| change.point(corner));
        self.no_go.iter_mut().flat_map(NoGo::corners_mut).for_each(|corner| change.point(corner));
        let paths = self.auvs.iter_mut().filter_map(|auv| auv.path.as_mut());
        let segments = paths.flat_map(|path| &mut path.segments);
        segments.flat_map(Segment::points_mut).for_each(|point| change.point(point));
    }
}

/// A surface craft of a fleet.
#[skip_serializing_none]
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct LiveCraft {
    /// Its name, unique among all vehicles of the mission, 1 to 64 bytes.
    #[schema(value_type = String, example = "asc-1")]
    pub id: VehicleId,
    /// Its limits, as in a snapshot.
    pub limits: Option<DeclaredLimits>,
    /// Its closed-loop response, as in a snapshot.
    pub craft: Option<CraftDescription>,
    /// The AUVs that it may serve, such as those whose modem it has; with an empty list it stands
    /// by. Default: all.
    #[schema(value_type = Option<Vec<String>>)]
    pub serves: Option<Vec<VehicleId>>,
    /// Share of its energy below which it gives its AUVs to others. Default: 0.2.
    pub battery_min: Option<f64>,
}

/// An underwater vehicle of a live mission.
#[skip_serializing_none]
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct LiveAuv {
    /// Its name, unique in the mission, 1 to 64 bytes.
    #[schema(example = "auv-1")]
    pub id: String,
    /// Its path, if known.
    pub path: Option<DeclaredPath>,
    /// The sawtooth in which it dives, if known.
    pub dive: Option<Dive>,
}
