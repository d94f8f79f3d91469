//! The record of a mission, one row a tick: truth, knowledge, references, results.

use nalgebra::{Matrix2, Vector2};
use planner::{
    angle::Heading,
    los::Reference,
    plan::Method,
    snapshot::{KeepOut, Limits, NoGo},
};

use crate::{fault::Fault, plant::Plant};

mod rows;

pub use ::record::Origin;

/// A mission's record. Scenario, guide and seed determine all of it except solve times.
#[derive(Clone, Debug, PartialEq)]
pub struct Record {
    /// Name of the scenario.
    pub scenario: String,
    /// Title of the scenario.
    pub title: String,
    /// Name of the guide; empty without a surface craft.
    pub guide: String,
    /// The seed.
    pub seed: u64,
    /// Time from one row to the next, s.
    pub interval: f64,
    /// Position of the datum on Earth, if the scenario has one.
    pub origin: Option<Origin>,
    /// Start of the settled metrics, s.
    pub settled_after: f64,
    /// Slant range that counts as contact, m, if there is a surface craft.
    pub contact_range: Option<f64>,
    /// Declared limits of the surface craft, if there is one.
    pub limits: Option<Limits>,
    /// Names and limits of several surface craft, the first as in the other members; empty for one.
    pub fleet: Vec<FleetCraft>,
    /// Physical limits of the surface craft, if known.
    pub plant: Option<Plant>,
    /// Bounds of the surface craft.
    pub bounds: Bounds,
    /// Faults, in the scenario's order.
    pub faults: Vec<Fault>,
    /// Names of the underwater vehicles, in the order of [`Row::auvs`].
    pub auv_ids: Vec<String>,
    /// Names of the other vessels, in the order of [`Row::vessels`].
    pub vessel_ids: Vec<String>,
    /// Paths of the underwater vehicles, in the order of their names: points (north, east), m, 1 m apart up to 10,000 points.
    pub paths: Vec<Vec<Vector2<f64>>>,
    /// One row a tick, from the start on.
    pub rows: Vec<Row>,
}

impl Record {
    /// The surface craft's rows, with their times, s; none without a surface craft.
    pub fn surface_craft_rows(&self) -> impl Iterator<Item = (f64, &SurfaceCraftRow)> {
        let rows = self.rows.iter();
        rows.filter_map(|row| Some((row.time, row.surface_craft.as_ref()?)))
    }

    /// The record of the craft with this number of several alone, with what all craft did for the AUVs.
    #[must_use]
    pub fn of_craft(&self, number: usize) -> Self {
        let mut own = Self { fleet: vec![], limits: self.limits_of(number), ..self.clone() };
        for row in &mut own.rows {
            let craft = row.craft().nth(number).copied();
            (row.surface_craft, row.consorts) = (craft, vec![]);
        }
        own
    }

    /// Declared limits of the surface craft with this number.
    pub fn limits_of(&self, number: usize) -> Option<Limits> {
        self.fleet.get(number).map_or(self.limits, |craft| craft.limits)
    }

    /// The rows from the settling time on.
    pub fn settled_rows(&self) -> impl Iterator<Item = &Row> {
        self.rows.iter().filter(|row| self.settled_after <= row.time)
    }
}

/// One of several surface craft.
#[derive(Clone, Debug, PartialEq)]
pub struct FleetCraft {
    /// Its name.
    pub id: String,
    /// Its declared limits.
    pub limits: Option<Limits>,
}

/// Bounds of the surface craft.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Bounds {
    /// Keep-out discs.
    pub keep_outs: Vec<KeepOut>,
    /// Polygons to keep out of.
    pub no_go: Vec<NoGo>,
    /// Corners (north, east) of the convex area to stay in, m, in either sense; empty for no limit.
    pub area: Vec<Vector2<f64>>,
    /// Largest slant range to every underwater vehicle, m.
    pub range_max: Option<f64>,
    /// Available propulsion energy, J.
    pub energy_max: Option<f64>,
    /// Distance to keep from other vessels' sides, m.
    pub vessel_separation: Option<f64>,
}

/// One instant, and the references from then on.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// True time since the start, s.
    pub time: f64,
    /// The surface craft, if there is one, or the first of several.
    pub surface_craft: Option<SurfaceCraftRow>,
    /// The craft after the first of several.
    pub consorts: Vec<SurfaceCraftRow>,
    /// The underwater vehicles.
    pub auvs: Vec<AuvRow>,
    /// The other vessels.
    pub vessels: Vec<VesselRow>,
}

/// Another vessel at one instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VesselRow {
    /// Position (north, east), m.
    pub position: Vector2<f64>,
    /// Course over ground, rad.
    pub course: f64,
    /// Speed over ground, m/s.
    pub speed: f64,
    /// Length over all, m.
    pub length: f64,
}

impl Row {
    /// Every surface craft.
    pub fn craft(&self) -> impl Iterator<Item = &SurfaceCraftRow> {
        self.surface_craft.iter().chain(&self.consorts)
    }

    /// Mean cost of the visited underwater vehicles that are alive, if any.
    pub fn mean_cost(&self) -> Option<f64> {
        let costs = self.auvs.iter().filter_map(|auv| Some(auv.service?.cost));
        let (sum, n) = costs.fold((0.0, 0.0), |(sum, n), cost| (sum + cost, n + 1.0));
        (0.0 < n).then(|| sum / n)
    }
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
    /// Current at its position (north, east), m/s.
    pub current: Vector2<f64>,
    /// Position of the goal (north, east), m.
    pub goal: Vector2<f64>,
    /// Propulsion energy since the start, J.
    pub energy: f64,
    /// Heading travel since the start, rad.
    pub heading_travel: f64,
    /// Its knowledge of itself.
    pub known: KnownSurfaceCraft,
    /// The guide's reference.
    pub reference: Reference,
    /// The method of the reference; none for a law outside of this program.
    pub method: Option<Method>,
    /// Index of the underwater vehicle that the guide goes to, if it chooses one.
    pub serves: Option<usize>,
    /// Heading by which it keeps clear of other vessels, rad, while it manoeuvres for them.
    pub manoeuvre: Option<f64>,
    /// Predicted root mean square distance to the goal over the horizon, m, if the guide predicts.
    pub predicted_rms: Option<f64>,
    /// Computing time of the guide, ms, if measured.
    pub solve_ms: Option<f64>,
}

impl SurfaceCraftRow {
    /// `true` unless the craft stands by, or is dead: its goal is then where it is.
    pub fn has_goal(&self) -> bool {
        self.method != Some(Method::Hold) || self.position != self.goal
    }

    /// True distance to the goal, m.
    pub fn distance(&self) -> f64 {
        (self.position - self.goal).norm()
    }
}

/// The surface craft's knowledge of itself when it called its guide.
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
    /// Current (north, east), m/s, if known.
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
    /// Current at its position (north, east), m/s.
    pub current: Vector2<f64>,
    /// References of its inner loops.
    pub reference: AuvReference,
    /// The point of its path that it follows (north, east), m.
    pub path_point: Vector2<f64>,
    /// True along-track error s₁, m, positive ahead of that point.
    pub along_track: f64,
    /// True cross-track error y₁, m, positive to starboard of the path.
    pub cross_track: f64,
    /// The surface craft's knowledge of it; none without a surface craft.
    pub known: Option<KnownAuv>,
    /// Its service; none if it is dead or the goal does not visit it.
    pub service: Option<Service>,
    /// Number of the surface craft that has it, of several.
    pub craft: Option<usize>,
    /// Its own navigation; none if the goal does not localise it.
    pub navigation: Option<NavigationRow>,
}

/// Service of an underwater vehicle that a goal visits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Service {
    /// Cost while unserved, in the unit of the goal's cost, times its weight over the mean weight.
    pub cost: f64,
    /// `true` while it is served.
    pub served: bool,
    /// `true` once its deadline passed before its first service.
    pub late: bool,
}

/// The navigation of an AUV at one instant, or the craft's estimate where ranges are reported.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NavigationRow {
    /// True error of its position estimate, m.
    pub error: f64,
    /// Root-mean-square error that its filter states, m.
    pub sigma: f64,
    /// Squared error over its stated covariance; 2 on average of a consistent filter.
    pub nees: f64,
}

impl NavigationRow {
    /// The row of an estimate with this error and stated covariance; none if that is singular.
    pub(crate) fn of(error: Vector2<f64>, covariance: &Matrix2<f64>) -> Option<Self> {
        Some(Self {
            error: error.norm(),
            sigma: covariance.trace().sqrt(),
            nees: error.dot(&(covariance.try_inverse()? * error)),
        })
    }
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

/// The surface craft's knowledge of an underwater vehicle when it called its guide.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KnownAuv {
    /// Position (north, east) in its last message, m.
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

/// Name in files of a law outside of this program.
pub const OWN_LAW: &str = "own_law";

/// Name in files of `method`.
pub fn method_name(method: Method) -> &'static str {
    match method {
        Method::Mpc => "mpc",
        Method::PreviousPlan => "previous_plan",
        Method::SaturatedLos => "saturated_los",
        Method::Hold => "hold",
        Method::SaturatedLosTrackerFrame => "saturated_los_tracker_frame",
        Method::IntegralLos => "integral_los",
        Method::WaypointBox => "waypoint_box",
    }
}
