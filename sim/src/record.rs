//! The record of a mission, tick by tick: truth, knowledge, references, outcome.

use nalgebra::Vector2;
use planner::{
    angle::Heading,
    los::Reference,
    plan::Method,
    snapshot::{KeepOut, Limits},
};

use crate::plant::Plant;

mod rows;

pub use ::record::Origin;

/// A mission's record. Holds nothing but what scenario, guide and seed determine, solve times excepted.
#[derive(Clone, Debug, PartialEq)]
pub struct Record {
    /// Name of the scenario.
    pub scenario: String,
    /// What happens in it, in one line.
    pub title: String,
    /// What guided the surface craft; empty where there is none.
    pub guide: String,
    /// The seed.
    pub seed: u64,
    /// Time from one row to the next, s.
    pub interval: f64,
    /// Where the datum lies on Earth, where the scenario says so.
    pub origin: Option<Origin>,
    /// Start of the settled metrics, s.
    pub settled_after: f64,
    /// Slant range that counts as contact, m, where there is a surface craft.
    pub contact_range: Option<f64>,
    /// What the surface craft was said to be able to do, where there is one.
    pub limits: Option<Limits>,
    /// What the surface craft can physically do, where that is known.
    pub plant: Option<Plant>,
    /// Where the surface craft is meant to stay.
    pub bounds: Bounds,
    /// Names of the underwater vehicles, in the order of [`Row::auvs`].
    pub auv_ids: Vec<String>,
    /// The paths they are to follow, in the same order, as points (north, east), m: a metre apart or less, or
    /// ten thousand where that would be more.
    pub paths: Vec<Vec<Vector2<f64>>>,
    /// One row a tick, from the start on.
    pub rows: Vec<Row>,
}

/// Where the surface craft is meant to stay.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Bounds {
    /// Discs to stay out of.
    pub keep_outs: Vec<KeepOut>,
    /// Corners (north, east) of the convex area to stay in, m, clockwise or not; empty for no limit.
    pub area: Vec<Vector2<f64>>,
    /// Slant range to every underwater vehicle to keep within, m.
    pub range_max: Option<f64>,
    /// Propulsion energy to do with, J.
    pub energy_max: Option<f64>,
}

/// One instant, and the references followed from then on.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// True time since the start, s.
    pub time: f64,
    /// The surface craft, where there is one.
    pub surface_craft: Option<SurfaceCraftRow>,
    /// The underwater vehicles.
    pub auvs: Vec<AuvRow>,
}

/// The surface craft at one instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfaceCraftRow {
    /// Position (north, east), m.
    pub position: Vector2<f64>,
    /// Heading ψ, rad, in (−π, π].
    pub heading: f64,
    /// Surge speed through the water, m/s.
    pub surge: f64,
    /// Sway speed through the water, m/s, positive to starboard.
    pub sway: f64,
    /// Yaw rate, rad/s, positive to starboard.
    pub yaw_rate: f64,
    /// Thrust of the port thruster, N.
    pub thrust_port: f64,
    /// Thrust of the starboard thruster, N.
    pub thrust_starboard: f64,
    /// Current where it is (north, east), m/s.
    pub current: Vector2<f64>,
    /// Where the goal is (north, east), m.
    pub goal: Vector2<f64>,
    /// Propulsion energy since the start, J.
    pub energy: f64,
    /// Heading travel since the start, rad.
    pub heading_travel: f64,
    /// What it knew of itself.
    pub known: KnownSurfaceCraft,
    /// The guide's reference.
    pub reference: Reference,
    /// How the guide found it.
    pub method: Method,
    /// Distance to the goal that the guide predicts over its horizon (root mean square), m, if it does.
    pub predicted_rms: Option<f64>,
    /// Time the guide took, ms, where somebody held a clock.
    pub solve_ms: Option<f64>,
}

impl SurfaceCraftRow {
    /// True distance to the goal, m.
    #[must_use]
    pub fn distance(&self) -> f64 {
        (self.position - self.goal).norm()
    }
}

/// What the surface craft knew of itself when it asked its guide.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KnownSurfaceCraft {
    /// Time on its clock, s.
    pub time: f64,
    /// Position (north, east), m.
    pub position: Vector2<f64>,
    /// Heading ψ.
    pub heading: Heading,
    /// Surge speed through the water, m/s.
    pub surge: f64,
    /// Current (north, east), m/s, where it was known.
    pub current: Option<Vector2<f64>>,
}

/// An underwater vehicle at one instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AuvRow {
    /// Position (north, east), m.
    pub position: Vector2<f64>,
    /// Depth, m, positive down.
    pub depth: f64,
    /// Pitch θ, rad, positive nose-up.
    pub pitch: f64,
    /// Heading ψ, rad, in (−π, π].
    pub heading: f64,
    /// Speed along the body, through the water, m/s.
    pub surge: f64,
    /// Current where it is (north, east), m/s.
    pub current: Vector2<f64>,
    /// References of its inner loops.
    pub reference: AuvReference,
    /// The point of its path that it follows (north, east), m.
    pub path_point: Vector2<f64>,
    /// True along-track error s₁, m, positive ahead of that point.
    pub along_track: f64,
    /// True cross-track error y₁, m, positive to starboard of the path.
    pub cross_track: f64,
    /// What the surface craft knew of it; none where there is no surface craft.
    pub known: Option<KnownAuv>,
}

/// References of an underwater vehicle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AuvReference {
    /// Speed along the body, m/s.
    pub surge: f64,
    /// Pitch θ, rad.
    pub pitch: f64,
    /// Heading that the path-following law approaches ψ_P + δ, rad, in (−π, π].
    pub heading: f64,
}

/// What the surface craft knew of an underwater vehicle when it asked its guide.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KnownAuv {
    /// Position (north, east) when it was last heard, m.
    pub position: Vector2<f64>,
    /// Depth then, m.
    pub depth: f64,
    /// Course over ground then, rad, in (−π, π].
    pub course: f64,
    /// Horizontal speed over ground then, m/s.
    pub speed: f64,
    /// Time since then, s, by the surface craft's clock.
    pub age: f64,
}

/// The name in files of who answered.
#[must_use]
pub fn method_name(method: Method) -> &'static str {
    match method {
        Method::Mpc => "mpc",
        Method::PreviousPlan => "previous_plan",
        Method::SaturatedLos => "saturated_los",
        Method::Hold => "hold",
        Method::SaturatedLosTrackerFrame => "saturated_los_tracker_frame",
        Method::IntegralLos => "integral_los",
        Method::WaypointBox => "waypoint_box",
        Method::PrintedLos => "printed_los",
    }
}
