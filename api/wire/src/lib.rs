//! The JSON that clients send and receive, and the only place where it meets the planner's types.
//!
//! Units: SI and radians, in the names. Positions are local north-east-down, their origin any datum
//! that all positions of a request share; `depth_m` is positive down. Headings and courses are 0 at
//! north and positive clockwise. `speed_mps` of the surface craft is surge through the water, that of
//! an underwater vehicle is horizontal and over ground; in references and trajectories it is the
//! surface craft's speed through the water.
//!
//! Both directions are here: the service reads a [`PlanRequest`] and writes a [`PlanResponse`], a Rust
//! client does the reverse with the same types.

mod both;
pub mod campaign;
mod craft;
mod dump;
mod field_error;
mod field_pointers;
mod json;
pub mod mission;
mod positions;
mod prediction;
mod read_evidence;
mod read_goal;
mod read_path;
mod read_request;
mod request;
mod response;
mod write_answer;
mod write_request;

pub use both::{Current, Drift, Forecast, Origin, TrajectoryPoint};
pub use craft::{Craft, HeadingHeld, HeadingLoop, Power, SpeedHeld, SurgeLoop};
pub use dump::program_dump;
pub use field_error::{FieldError, shortened};
pub use json::{Unread, VALUES_MAX, read, read_each, read_from, read_reports};
pub use positions::{LATITUDE_MAX_DEG, LONGITUDE_MAX_DEG};
pub use prediction::{Heard, PredictedAuv, PredictedCraft, Prediction, SteerBy};
pub use read_request::unsupported_version;
pub use request::{
    Acoustics, Asc, Auv, AuvState, Fallback, Goal, GoalKind, Hold, KeepOut, Limits, Offset, OffsetFrame,
    Path, PlanRequest, PreviousCraft, PreviousEstimate, PreviousPlan, PreviousReference, PreviousTarget,
    Report, Segment, SegmentKind,
};
pub use response::{
    Baseline, Comparison, CraftEstimate, Explanation, GoalPoint, GoalTrajectory, Learnt, Method, Outcome,
    PlanResponse, PlannedTarget, Plans, Predicted, ProgramSize, Reference, Residuals, Solver, Subproblem,
    TargetPoint, UsedSlack, Violation, Warning,
};
pub use write_answer::{Answer, degraded_reason};
pub use write_request::{keep_out, plan_id, sha256};

/// The version of these shapes that requests must name and answers carry.
pub const SCHEMA_VERSION: &str = "1.0";

/// Time for an answer, ms: less than the least is over before the request is read, and no client steers by an answer
/// that takes longer than the most.
pub const DEADLINE_MS: std::ops::RangeInclusive<f64> = 0.05..=60_000.0;

/// Largest `metadata`, bytes of compact JSON: enough for identifiers, too little to store things in.
pub const METADATA_BYTES_MAX: usize = 4096;
