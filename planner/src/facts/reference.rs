//! References and trajectories, and what an earlier answer says of them.

use nalgebra::Vector2;

use crate::facts::{angle::Heading, auv::VehicleId, options::ForecastModel};

/// What a guidance law asks of the inner loops.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reference {
    /// Speed through the water, m/s.
    pub speed: f64,
    /// Heading ψ.
    pub heading: Heading,
}

/// One point of a planned trajectory.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrajectoryPoint {
    /// Time on the snapshot's clock, s.
    pub time: f64,
    /// Position (north, east), m.
    pub position: Vector2<f64>,
    /// Speed through the water, m/s.
    pub speed: f64,
    /// Heading ψ.
    pub heading: Heading,
}

/// What an earlier answer knew of an AUV, and how it had found it to drift.
#[derive(Clone, Debug, PartialEq)]
pub struct PreviousTarget {
    /// The AUV.
    pub id: VehicleId,
    /// The model that it was forecast by.
    pub model: ForecastModel,
    /// Age of the report then, s.
    pub report_age: f64,
    /// Position (north, east) at the report, m.
    pub position: Vector2<f64>,
    /// Depth at the report, m, positive down.
    pub depth: f64,
    /// Velocity over ground (north, east) at the report, as declared, m/s.
    pub velocity: Vector2<f64>,
    /// Rate of turn of the course at the report, rad/s, positive clockwise.
    pub turn_rate: f64,
    /// Velocity over ground (north, east) beyond what the model and the report explained, m/s, within 0.5 m/s along
    /// either axis; what is faster counts as that fast.
    pub drift: Vector2<f64>,
}
