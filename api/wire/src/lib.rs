//! The JSON that clients send and receive. Only this crate converts it to the planner's types.
//!
//! Units are SI and radians, and stand in the names. Positions are local north-east-down from any
//! datum that all positions of a request share; `depth_m` is positive down. Headings and courses
//! are 0 at north and positive clockwise. If the datum's place on Earth is known, headings, courses
//! and velocities are from true north at the craft. `speed_mps` of an underwater vehicle is
//! horizontal and over ground; elsewhere it is the surface craft's speed through the water.
//!
//! The types serve both directions: the service reads a [`PlanRequest`] and writes a
//! [`PlanResponse`], a Rust client does the reverse.

mod check;
mod craft_frame;
mod digest;
mod directions;
mod dump;
mod fleet;
mod json;
pub mod mission;
mod positions;
mod prediction;
mod read;
mod reports;
mod response;
mod write_answer;

pub use check::{check, snapshot, snapshot_until, unsupported_version, with_defaults};
pub use craft_frame::CraftFrame;
pub use digest::{plan_id, sha256};
pub use directions::DIRECTION_DEG;
pub use dump::program_dump;
pub use fleet::{CraftPlan, FleetRequest, FleetResponse, PreviousFleet, SurfaceCraft, is_of_fleet};
pub use json::{Body, BodyError, VALUES_MAX};
pub use planner::craft::{CraftDescription, HeadingLoop, HeadingReference, SpeedReference, SurgeLoop};
pub use planner::path::Segment;
pub use planner::plan::Method;
pub use planner::snapshot::{
    Asc, Auv, Current, DIRECTIONS, DeclaredLimits, DeclaredPath, FieldError, Origin, PlanRequest,
    PreviousPlan, Report, SCHEMA_VERSION, Task, TrajectoryPoint, VehicleId, Vessel, VesselStatus, shortened,
};
pub use positions::{DatumChange, LATITUDE_MAX_DEG, LONGITUDE_MAX_DEG};
pub use prediction::{Heard, PredictedAuv, PredictedVessel, Prediction};
pub use read::{read, read_each, read_from};
pub use reports::read_reports;
pub use response::{Comparison, Learnt, Outcome, PlanResponse, Plans, Reference, Warning};
pub use write_answer::Answer;

/// Time for an answer, ms. A shorter one ends before the request is read; no client steers by an
/// answer that takes longer.
pub const DEADLINE_MS: std::ops::RangeInclusive<f64> = 0.05..=60_000.0;

/// Largest `metadata`, bytes of compact JSON: enough for identifiers, too little for storage.
pub const METADATA_BYTES_MAX: usize = 4096;
