//! What happened in a mission, second by second.

use std::io;

use nalgebra::Vector2;
use planner::{los::Reference, plan::Method, snapshot::Limits};

/// A mission's record. Holds nothing but what the scenario, the guide and the seed determine.
#[derive(Clone, Debug, PartialEq)]
pub struct Record {
    /// Name of the scenario.
    pub scenario: String,
    /// The seed.
    pub seed: u64,
    /// Names of the underwater vehicles, in the order of [`Row::divers`].
    pub diver_ids: Vec<String>,
    /// Start of the settled metrics, s.
    pub settled_after: f64,
    /// Slant range that counts as contact, m, where there is a surface craft.
    pub contact_range: Option<f64>,
    /// What the surface craft was said to be able to do, where there is one.
    pub limits: Option<Limits>,
    /// One row a second.
    pub rows: Vec<Row>,
}

/// The truth at one instant, and the reference followed from then on.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// Time since the start, s.
    pub time: f64,
    /// The surface craft, where there is one.
    pub surface_craft: Option<SurfaceCraftRow>,
    /// The underwater vehicles.
    pub divers: Vec<DiverRow>,
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
    /// The guide's reference.
    pub reference: Reference,
    /// How the guide found it.
    pub method: Method,
    /// Where the goal is (north, east), m.
    pub goal: Vector2<f64>,
    /// Propulsion energy since the start, J.
    pub energy: f64,
    /// Heading travel since the start, rad.
    pub heading_travel: f64,
}

impl SurfaceCraftRow {
    /// Distance to the goal, m.
    #[must_use]
    pub fn distance(&self) -> f64 {
        (self.position - self.goal).norm()
    }
}

/// An underwater vehicle at one instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DiverRow {
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
    /// Along-track error s₁, m, positive ahead of the point it follows.
    pub along_track: f64,
    /// Cross-track error y₁, m, positive to starboard of the path.
    pub cross_track: f64,
}

const SURFACE_CRAFT_COLUMNS: [&str; 14] = [
    "asc_north_m",
    "asc_east_m",
    "asc_heading_rad",
    "asc_surge_mps",
    "asc_sway_mps",
    "asc_yaw_rate_radps",
    "reference_speed_mps",
    "reference_heading_rad",
    "method",
    "goal_north_m",
    "goal_east_m",
    "goal_distance_m",
    "energy_j",
    "heading_travel_rad",
];

const DIVER_COLUMNS: [&str; 8] = [
    "north_m",
    "east_m",
    "depth_m",
    "pitch_rad",
    "heading_rad",
    "surge_mps",
    "along_track_m",
    "cross_track_m",
];

impl Record {
    /// Writes one header line and one line a second: numbers with six decimals, units in the names,
    /// an underwater vehicle's columns behind its name.
    pub fn write_csv(&self, out: &mut impl io::Write) -> io::Result<()> {
        let mut header = vec!["t_s".to_owned()];
        if self.limits.is_some() {
            header.extend(SURFACE_CRAFT_COLUMNS.map(str::to_owned));
        }
        for id in &self.diver_ids {
            header.extend(DIVER_COLUMNS.map(|column| format!("{}_{column}", id.replace('-', "_"))));
        }
        writeln!(out, "{}", header.join(","))?;
        for row in &self.rows {
            writeln!(out, "{}", row.cells().join(","))?;
        }
        Ok(())
    }
}

impl Row {
    fn cells(&self) -> Vec<String> {
        let mut cells = vec![number(self.time)];
        if let Some(craft) = &self.surface_craft {
            cells.extend(
                [
                    craft.position.x,
                    craft.position.y,
                    craft.heading,
                    craft.surge,
                    craft.sway,
                    craft.yaw_rate,
                    craft.reference.speed,
                    craft.reference.heading.radians(),
                ]
                .map(number),
            );
            cells.push(method_name(craft.method).to_owned());
            cells.extend(
                [
                    craft.goal.x,
                    craft.goal.y,
                    craft.distance(),
                    craft.energy,
                    craft.heading_travel,
                ]
                .map(number),
            );
        }
        for diver in &self.divers {
            cells.extend(
                [
                    diver.position.x,
                    diver.position.y,
                    diver.depth,
                    diver.pitch,
                    diver.heading,
                    diver.surge,
                    diver.along_track,
                    diver.cross_track,
                ]
                .map(number),
            );
        }
        cells
    }
}

fn number(value: f64) -> String {
    format!("{value:.6}")
}

/// The rung's name in files.
#[must_use]
pub fn method_name(method: Method) -> &'static str {
    match method {
        Method::Mpc => "mpc",
        Method::PreviousPlan => "previous_plan",
        Method::SaturatedLos => "saturated_los",
        Method::Hold => "hold",
    }
}
