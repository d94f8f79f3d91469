//! Simulated vehicles on the wire of a craft: an operator rehearses with the displays of MOOS or IMC.
//!
//! The simulator says once a second where its craft and AUVs are, and takes what steers the craft.

use std::time::{Duration, Instant};

use ::geodesy::Datum;
use clock::Clock;
use nalgebra::Vector2;
use tokio::sync::mpsc::{Receiver, channel};

use crate::Origin;
use crate::imc::ImcVehicles;
use crate::moos::MoosVehicles;
use crate::reference::Reference;
use crate::wire::{Endpoint, Input, Output, Received, open};

/// Pieces that may wait for the next second.
const PIECES_MAX: usize = 4096;
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
    fn at(vehicle: &'a Vehicle, datum: &Datum, begin_s: f64) -> Self {
        let place = datum.from_local(&vehicle.position).into();
        Self { vehicle, place, unix_s: begin_s + vehicle.t_s }
    }
}

enum Stack {
    Moos(MoosVehicles),
    Imc(Box<ImcVehicles>),
}

/// The wire of a rehearsal.
pub struct Rehearsal {
    stack: Stack,
    datum: Datum,
    clock: Clock,
    begin: Instant,
    send: Output,
    received: Receiver<Received>,
}

impl std::fmt::Debug for Rehearsal {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Rehearsal").field("datum", &self.datum).finish_non_exhaustive()
    }
}

impl Rehearsal {
    /// Begins now at `endpoint`, a MOOSDB's or an address on a network of IMC; `None` for an origin
    /// that is no place.
    pub fn begin(endpoint: &Endpoint, origin: Origin) -> Option<Self> {
        let (sender, received) = channel(PIECES_MAX);
        let (clock, datum) = (Clock::machine(), Datum::new(&origin.into()).ok()?);
        let send = open(endpoint, Input { wire: 0, received: sender, clock: clock.clone() });
        let stack = match endpoint {
            Endpoint::Tcp(_) => Stack::Moos(MoosVehicles::default()),
            _ => Stack::Imc(Box::new(ImcVehicles::new(endpoint.clone()))),
        };
        Some(Self { stack, datum, begin: clock.now(), clock, send, received })
    }

    /// Waits until `t_s` of the rehearsal, s, says where its vehicles are, and returns what steers
    /// the craft.
    pub fn say(&mut self, t_s: f64, craft: &Vehicle, auvs: &[Vehicle]) -> Option<Reference> {
        let wait = Duration::from_secs_f64(t_s).saturating_sub(self.clock.since(self.begin));
        #[expect(clippy::disallowed_methods, reason = "the simulator's thread does nothing else")]
        std::thread::sleep(wait);
        let unix_s = self.clock.unix_s();
        let at = |vehicle| Placed::at(vehicle, &self.datum, unix_s - t_s);
        let (craft, auvs): (_, Vec<_>) = (at(craft), auvs.iter().map(at).collect());
        while let Ok(piece) = self.received.try_recv() {
            match &mut self.stack {
                Stack::Moos(vehicles) => {
                    if let Some(greeting) = vehicles.take(&piece.bytes, unix_s) {
                        (self.send)(&greeting);
                    }
                }
                Stack::Imc(vehicles) => vehicles.take(&piece, t_s),
            }
        }
        let (packets, reference) = match &mut self.stack {
            Stack::Moos(vehicles) => (vec![MoosVehicles::say(&craft, &auvs)], vehicles.reference(unix_s)),
            Stack::Imc(vehicles) => vehicles.say(t_s, &craft, &auvs),
        };
        for packet in packets {
            (self.send)(&packet);
        }
        reference
    }
}
