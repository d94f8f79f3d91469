//! The shape of a scenario file. Every number may be a distribution; what is left out has the value
//! that its description names.

use planner::snapshot::{AREA_CORNERS, AUVS_MAX, ID_LENGTH_MAX, KEEP_OUTS_MAX};
use schemars::JsonSchema;
use serde::{Deserialize, Deserializer, de::Error as _};

use super::{
    files::Files,
    quantity::{
        ClockTime, Coordinate, Energy, Instant, KeepOutRadius, Latitude, Longitude, MissionTime, Quantity,
        RangeToKeep, Share,
    },
    source::Source,
};

mod craft;
mod environment;
mod vehicles;

pub use craft::*;
pub use environment::*;
pub use vehicles::*;

/// Most faults, corners or knots of a scenario.
pub(super) const ITEMS_MAX: usize = 64;
/// Most lanes of a lawn-mower.
pub(super) const LANES_MAX: usize = 100;
/// Names end up in files, tables and addresses.
const NAME_PATTERN: &str = "^[a-z0-9-]+$";

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
            Err(D::Error::custom(format!("{n} numbers; a point is [north, east]")))
        }
    }
}

/// A situation to try guidance laws in: vehicles, goal, water, knowledge, bounds and faults.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Scenario {
    /// Version of this format.
    pub schema_version: Version,
    /// Its name: lower-case letters, digits and hyphens.
    #[schemars(length(min = 1, max = ID_LENGTH_MAX), regex(pattern = NAME_PATTERN))]
    pub name: String,
    /// What happens, in one line.
    pub title: String,
    /// How long it lasts, s.
    pub duration_s: Quantity<MissionTime>,
    /// Start of the settled metrics, s: by then every vehicle has had time to reach its path or goal.
    pub settled_after_s: Quantity<Instant>,
    /// Where the datum lies on Earth, which GeoJSON needs; nowhere if left out.
    pub origin: Option<OriginFile>,
    /// The surface craft; none if left out.
    pub surface_craft: Option<SurfaceCraftFile>,
    /// The underwater vehicles.
    #[schemars(length(min = 1, max = AUVS_MAX))]
    pub auvs: Vec<AuvFile>,
    /// The water; still if left out.
    #[serde(default)]
    pub water: WaterFile,
    /// What the surface craft knows; all but the paths, at once and exactly, if left out.
    #[serde(default)]
    pub knowledge: KnowledgeFile,
    /// Bounds of the surface craft; none if left out.
    #[serde(default)]
    pub bounds: BoundsFile,
    /// What goes wrong, and when; nothing if left out.
    #[serde(default)]
    #[schemars(length(max = ITEMS_MAX))]
    pub faults: Vec<FaultFile>,
    /// Where the files that it names are.
    #[serde(skip)]
    pub files: Files,
    /// Where it was read from.
    #[serde(skip)]
    pub source: Source,
}

/// A version of the format.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
pub enum Version {
    /// The only one so far.
    #[serde(rename = "1")]
    One,
}

/// Where the datum lies on Earth (WGS 84).
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct OriginFile {
    /// Latitude, °, positive north.
    pub lat_deg: Quantity<Latitude>,
    /// Longitude, °, positive east.
    pub lon_deg: Quantity<Longitude>,
}

/// Bounds of the surface craft: the planner is given all but the energy, and violations of all are counted.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BoundsFile {
    /// Discs to stay out of; none if left out.
    #[serde(default)]
    #[schemars(length(max = KEEP_OUTS_MAX))]
    pub keep_outs: Vec<KeepOutFile>,
    /// Corners of a convex area to stay in; anywhere if left out.
    #[serde(default)]
    #[schemars(length(max = *AREA_CORNERS.end()))]
    pub area: Vec<Point>,
    /// Slant range to every underwater vehicle to keep within, m; none if left out.
    pub range_max_m: Option<Quantity<RangeToKeep>>,
    /// Propulsion energy available, J; unlimited if left out.
    pub energy_max_j: Option<Quantity<Energy>>,
}

/// A disc to stay out of.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct KeepOutFile {
    /// Its centre, north, m.
    pub north_m: Quantity<Coordinate>,
    /// Its centre, east, m.
    pub east_m: Quantity<Coordinate>,
    /// Its radius, m.
    pub radius_m: Quantity<KeepOutRadius>,
}

/// Something that goes wrong for a while.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FaultFile {
    /// From when on, s.
    pub from_s: Quantity<Instant>,
    /// Until when, s; to the end if left out.
    pub until_s: Option<Quantity<Instant>>,
    /// What.
    pub what: FaultKindFile,
}

/// What goes wrong.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum FaultKindFile {
    /// A thruster of the surface craft gives only a share of its thrust; 0 is a lost one.
    Thruster {
        /// Which.
        side: SideFile,
        /// The share.
        share: Quantity<Share>,
    },
    /// The surface craft's GNSS receiver gives nothing.
    GnssOutage,
    /// The surface craft's clock is ahead by this much, s; negative if behind.
    ClockOffset {
        /// By how much, s.
        offset_s: Quantity<ClockTime>,
    },
    /// Nothing is heard of an underwater vehicle.
    Silence {
        /// Which.
        auv: String,
    },
    /// An underwater vehicle surfaces and waits there.
    AuvStops {
        /// Which.
        auv: String,
    },
    /// An underwater vehicle loses power: it drifts, and is not heard.
    AuvDies {
        /// Which.
        auv: String,
    },
    /// An underwater vehicle keeps its heading, wherever its path goes.
    AuvLeavesPath {
        /// Which.
        auv: String,
    },
}
