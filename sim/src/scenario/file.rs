//! The shape of a scenario file. Every number may be a distribution; what is left out has the value
//! that its description names.

use schemars::JsonSchema;
use serde::{Deserialize, Deserializer, de::Error as _};

use super::{
    files::Files,
    quantity::{
        ClockTime, Coordinate, Energy, Instant, KeepOutRadius, Latitude, Longitude, MissionTime, Quantity,
        RangeToKeep, Share,
    },
};

mod craft;
mod surroundings;
mod vehicles;

pub use craft::*;
pub use surroundings::*;
pub use vehicles::*;

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

/// A situation to try guidance laws in: who is where, what is to be done, in which water, with what knowledge.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Scenario {
    /// Version of this format.
    pub schema_version: Version,
    /// Its name: lower-case letters, digits and hyphens.
    pub name: String,
    /// What happens, in one line.
    pub title: String,
    /// How long it lasts, s.
    pub duration_s: Quantity<MissionTime>,
    /// From when on every vehicle has had time to find its path or goal, s: start of the settled metrics.
    pub settled_after_s: Quantity<Instant>,
    /// Where the datum lies on Earth; needed for GeoJSON, in or out.
    pub origin: Option<OriginFile>,
    /// The surface craft; without one the underwater vehicles are alone.
    pub surface_craft: Option<SurfaceCraftFile>,
    /// The underwater vehicles.
    pub auvs: Vec<AuvFile>,
    /// The water; still if left out.
    #[serde(default)]
    pub water: WaterFile,
    /// What the surface craft knows; everything at once, but for paths, if left out.
    #[serde(default)]
    pub knowledge: KnowledgeFile,
    /// Where the surface craft is meant to stay; anywhere if left out.
    #[serde(default)]
    pub bounds: BoundsFile,
    /// What goes wrong, and when.
    #[serde(default)]
    pub faults: Vec<FaultFile>,
    /// The folder of the files it names.
    #[serde(skip)]
    pub files: Files,
    /// Where it was read from.
    #[serde(skip)]
    pub source: Source,
}

/// Where a scenario was read from: what its mistakes are shown in.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Source {
    /// Name of the file.
    pub file: String,
    /// What it says.
    pub text: String,
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

/// Where the surface craft is meant to stay: it is told all but the energy, and its runs are judged by all.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BoundsFile {
    /// Discs to stay out of.
    #[serde(default)]
    pub keep_outs: Vec<KeepOutFile>,
    /// Corners of a convex area to stay in; anywhere if left out.
    #[serde(default)]
    pub area: Vec<Point>,
    /// Slant range to every underwater vehicle to keep within, m.
    pub range_max_m: Option<Quantity<RangeToKeep>>,
    /// Propulsion energy to do with, J.
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
