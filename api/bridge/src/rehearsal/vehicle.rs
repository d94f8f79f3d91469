//! A vehicle of a rehearsal.

use ::geodesy::Datum;
use nalgebra::Vector2;

use crate::Origin;

/// Age of a reference from which on the craft stops, s: ArduPilot's.
pub(crate) const REFERENCE_AGE_MAX_S: f64 = 3.0;

/// What is known of a vehicle.
#[derive(Clone, Debug, PartialEq)]
pub struct Vehicle {
    /// Its name.
    pub name: String,
    /// Time of the rehearsal at which this held, s.
    pub t_s: f64,
    /// (north, east) of the rehearsal's origin, m.
    pub position: Vector2<f64>,
    /// Over ground (north, east), m/s, if it is known.
    pub velocity: Option<Vector2<f64>>,
    /// rad.
    pub heading: f64,
    /// rad/s.
    pub yaw_rate: f64,
    /// m, positive down.
    pub depth_m: f64,
}

/// A vehicle on Earth.
pub(crate) struct Placed<'a> {
    pub(crate) vehicle: &'a Vehicle,
    pub(crate) place: Origin,
    /// Unix time at which this held, s.
    pub(crate) unix_s: f64,
}

impl<'a> Placed<'a> {
    /// A vehicle of a rehearsal that began at `begin_s` of Unix time.
    pub(super) fn at(vehicle: &'a Vehicle, datum: &Datum, begin_s: f64) -> Self {
        let place = datum.from_local(&vehicle.position).into();
        Self { vehicle, place, unix_s: begin_s + vehicle.t_s }
    }
}
