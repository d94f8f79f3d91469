//! The shape of a scenario file. The description of an optional member states its default.

use planner::path::Side;
use planner::snapshot::{AREA_CORNERS, AUVS_MAX, ID_LENGTH_MAX, KEEP_OUTS_MAX, NO_GO_MAX, VESSELS_MAX};
use schemars::JsonSchema;
use serde::{Deserialize, Deserializer, de::Error as _};

use super::files::Files;
use super::quantity::{
    Angle, ClaimFactor, ClockTime, Coordinate, Energy, Instant, KeepOutRadius, Latitude, Longitude,
    MissionTime, Quantity, RangeToKeep, Share, SignedShare, VesselSeparation,
};
use super::several::{OneOrSeveral, one_or_several};
use super::source::Source;

mod environment;
mod traffic;
mod vehicles;

pub use environment::*;
pub use traffic::*;
pub use vehicles::*;

/// Largest number of faults, corners or knots of a scenario.
pub(super) const ITEMS_MAX: usize = 64;
/// Largest number of lanes of a lawn-mower.
pub(super) const LANES_MAX: usize = 100;
/// Characters that are safe in files, tables and URLs.
const NAME_PATTERN: &str = "^[a-z0-9-]+$";

fn yes() -> bool {
    true
}

/// A point: [north, east], m.
#[derive(Clone, Debug, PartialEq, JsonSchema)]
pub struct Point(#[schemars(length(equal = 2))] pub Vec<Quantity<Coordinate>>);

impl<'de> Deserialize<'de> for Point {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let numbers = Vec::deserialize(deserializer)?;
        if numbers.len() == 2 {
            Ok(Self(numbers))
        } else {
            let n = numbers.len();
            Err(D::Error::custom(format!("a point is [north, east], two numbers, not {n}")))
        }
    }
}

/// A situation to try guidance laws in: vehicles, goal, water, knowledge, bounds and faults.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Scenario {
    /// Version of this format.
    pub schema_version: Version,
    /// Name: lower-case letters, digits and hyphens.
    #[schemars(length(min = 1, max = ID_LENGTH_MAX), regex(pattern = NAME_PATTERN))]
    pub name: String,
    /// Description in one line.
    pub title: String,
    /// Duration, s.
    pub duration_s: Quantity<MissionTime>,
    /// Start of the settled metrics, s.
    pub settled_after_s: Quantity<Instant>,
    /// The datum on Earth; none if left out.
    pub origin: Option<OriginFile>,
    /// The surface craft, or a list of several that share the goal of the first; none if left out.
    /// What another craft of the list leaves out is as of the first.
    #[serde(default, deserialize_with = "one_or_several")]
    #[schemars(with = "OneOrSeveral<SurfaceCraftFile>")]
    pub surface_craft: Vec<SurfaceCraftFile>,
    /// The underwater vehicles.
    #[schemars(length(min = 1, max = AUVS_MAX))]
    pub auvs: Vec<AuvFile>,
    /// Other vessels; none if left out.
    #[serde(default)]
    #[schemars(length(max = VESSELS_MAX))]
    pub traffic: Vec<VesselFile>,
    /// The water; still if left out.
    #[serde(default)]
    pub water: WaterFile,
    /// Knowledge of the surface craft; everything but the paths, exactly, if left out.
    #[serde(default)]
    pub knowledge: KnowledgeFile,
    /// Bounds by which a run is judged; none if left out.
    #[serde(default)]
    pub bounds: BoundsFile,
    /// Faults; none if left out.
    #[serde(default)]
    #[schemars(length(max = ITEMS_MAX))]
    pub faults: Vec<FaultFile>,
    /// The files that it names.
    #[serde(skip)]
    pub files: Files,
    /// The text that it was read from.
    #[serde(skip)]
    pub source: Source,
}

/// Version of the format.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
pub enum Version {
    /// The current version.
    #[serde(rename = "1")]
    One,
}

/// Position of the datum on Earth (WGS 84).
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct OriginFile {
    /// Latitude, °, positive north.
    pub lat_deg: Quantity<Latitude>,
    /// Longitude, °, positive east.
    pub lon_deg: Quantity<Longitude>,
}

/// Bounds of the surface craft. The planner gets all but the energy; violations of all are counted.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BoundsFile {
    /// Discs to stay out of; none if left out.
    #[serde(default)]
    #[schemars(length(max = KEEP_OUTS_MAX))]
    pub keep_outs: Vec<KeepOutFile>,
    /// Polygons to stay out of, such as land; none if left out.
    #[serde(default)]
    #[schemars(length(max = NO_GO_MAX))]
    pub no_go: Vec<NoGoFile>,
    /// Corners of a convex area to stay in; none if left out.
    #[serde(default)]
    #[schemars(length(max = *AREA_CORNERS.end()))]
    pub area: Vec<Point>,
    /// Largest slant range to every AUV, m; none if left out.
    pub range_max_m: Option<Quantity<RangeToKeep>>,
    /// Propulsion energy, J; unlimited if left out.
    pub energy_max_j: Option<Quantity<Energy>>,
    /// Distance to keep from other vessels' sides, m; 30 if left out.
    pub vessel_separation_m: Option<Quantity<VesselSeparation>>,
}

/// A disc to stay out of.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct KeepOutFile {
    /// Centre, m.
    pub north_m: Quantity<Coordinate>,
    /// Centre, m.
    pub east_m: Quantity<Coordinate>,
    /// Radius, m.
    pub radius_m: Quantity<KeepOutRadius>,
}

/// A polygon to stay out of.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct NoGoFile {
    /// Corners of its border, in order, convex or not.
    pub polygon: Vec<Point>,
    /// Borders of the parts in which the craft may be; none if left out.
    #[serde(default)]
    pub holes: Vec<Vec<Point>>,
}

/// A fault that lasts for a while.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FaultFile {
    /// Start, s.
    pub from_s: Quantity<Instant>,
    /// End, s; the end of the mission if left out.
    pub until_s: Option<Quantity<Instant>>,
    /// The surface craft that has it, of several; all if left out.
    pub craft: Option<String>,
    /// Its kind.
    pub what: FaultKindFile,
}

/// A kind of fault.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum FaultKindFile {
    /// A thruster delivers only a share of its thrust; 0: lost.
    Thruster {
        /// Side of the thruster.
        side: Side,
        /// The share.
        share: Quantity<Share>,
    },
    /// The surface craft has no power: it drifts and is silent.
    CraftDies,
    /// No GNSS position.
    GnssOutage,
    /// The surface craft's clock is wrong.
    ClockOffset {
        /// Time by which it is ahead, s.
        offset_s: Quantity<ClockTime>,
    },
    /// No message of the AUV arrives.
    Silence {
        /// The AUV's name.
        auv: String,
    },
    /// The AUV surfaces and waits there, then rejoins its path.
    AuvStops {
        /// The AUV's name.
        auv: String,
    },
    /// The AUV loses power: it drifts, and is silent.
    AuvDies {
        /// The AUV's name.
        auv: String,
    },
    /// The AUV leaves its path, then rejoins it at the nearest place that is not on another lane.
    AuvLeavesPath {
        /// The AUV's name.
        auv: String,
        /// Its heading, rad; its own if left out.
        heading_rad: Option<Quantity<Angle>>,
    },
    /// Rudder or differential thrust is stuck.
    RudderStuck {
        /// Share of the largest yaw moment, positive to starboard.
        share: Quantity<SignedShare>,
    },
    /// The thrust is stuck.
    ThrustStuck {
        /// Share of the largest thrust ahead.
        share: Quantity<Share>,
    },
    /// The AUV's fixes have a wrong accuracy.
    WrongAccuracy {
        /// The AUV's name.
        auv: String,
        /// Reported standard deviation over the true one.
        factor: Quantity<ClaimFactor>,
    },
    /// The AUV reports speed 0.
    ReportsSpeedZero {
        /// The AUV's name.
        auv: String,
    },
    /// Every message of the AUV arrives twice.
    MessagesTwice {
        /// The AUV's name.
        auv: String,
    },
}
