//! The other vessels of a scenario file, and how the surface craft hears of them.

use planner::snapshot::{ID_LENGTH_MAX, VesselStatus};
use schemars::JsonSchema;
use serde::Deserialize;

use super::NAME_PATTERN;
use crate::scenario::quantity::{
    Angle, AngleNoise, Coordinate, FrameTime, Instant, LostShare, MessageTime, OffsetComponent,
    PositionNoise, Quantity, VesselLength, VesselSpeed,
};
use crate::world::vessel::Behaviour;

/// Another vessel, which passes a place at a time.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct VesselFile {
    /// Identity: lower-case letters, digits and hyphens.
    #[schemars(length(min = 1, max = ID_LENGTH_MAX), regex(pattern = NAME_PATTERN))]
    pub id: String,
    /// The place that it passes, m.
    pub north_m: Quantity<Coordinate>,
    /// The same, m.
    pub east_m: Quantity<Coordinate>,
    /// Distance at which it passes that place, m, positive if the place is then to port; 0 if left
    /// out.
    pub off_m: Option<Quantity<OffsetComponent>>,
    /// Time at which it does, s; 0 if left out.
    pub at_s: Option<Quantity<Instant>>,
    /// Course over ground, rad.
    pub course_rad: Quantity<Angle>,
    /// Speed over ground, m/s.
    pub speed_mps: Quantity<VesselSpeed>,
    /// Length over all, m; 20 if left out.
    pub length_m: Option<Quantity<VesselLength>>,
    /// What it does about the surface craft; `stands_on` if left out.
    #[serde(default)]
    pub behaviour: Behaviour,
    /// Angle by which it turns, rad; 0.5 if left out.
    pub turn_rad: Option<Quantity<Angle>>,
    /// Time of its turn, s; 60 if left out.
    pub turns_at_s: Option<Quantity<Instant>>,
    /// The status that it reports; `under_way` if left out.
    #[serde(default)]
    #[schemars(with = "Option<StatusFile>")]
    pub status: VesselStatus,
}

/// What a vessel says that it does.
#[derive(JsonSchema)]
#[schemars(rename_all = "snake_case", rename = "VesselStatus")]
#[expect(dead_code, reason = "the schema of a type of the planner")]
enum StatusFile {
    UnderWay,
    AtAnchor,
    Moored,
    Aground,
    Fishing,
    Restricted,
}

/// AIS aboard the surface craft.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AisFile {
    /// Time between two reports of a vessel, s; 6 if left out.
    pub interval_s: Option<Quantity<FrameTime>>,
    /// Time from a position to its reception, s; 1 if left out.
    pub latency_s: Option<Quantity<MessageTime>>,
    /// Share of lost reports; 0.1 if left out.
    pub lost_share: Option<Quantity<LostShare>>,
    /// Standard deviation of a position along either axis, m; 5 if left out.
    pub position_sigma_m: Option<Quantity<PositionNoise>>,
    /// Standard deviation of a course, rad; 0.02 if left out.
    pub course_sigma_rad: Option<Quantity<AngleNoise>>,
}
