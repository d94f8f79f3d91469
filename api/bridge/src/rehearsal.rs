//! Simulated vehicles on the wire of a craft: an operator rehearses with the displays of MOOS or IMC.
//!
//! The simulator says once a second where its craft and AUVs are, and takes what steers the craft.

use std::time::{Duration, Instant};

use ::geodesy::Datum;
use clock::Clock;
use tokio::sync::mpsc::{Receiver, channel};

use crate::Origin;
use crate::imc::ImcVehicles;
use crate::moos::MoosVehicles;
use crate::reference::Reference;
use crate::wire::{Endpoint, Input, Output, Received, open};

pub(crate) mod vehicle;

use self::vehicle::Placed;
pub use self::vehicle::Vehicle;

/// Pieces that may wait for the next second.
const PIECES_MAX: usize = 4096;

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
        // A craft's clock that is set back does not stop the rehearsal.
        let due = Duration::try_from_secs_f64(t_s).unwrap_or_default();
        let wait = due.saturating_sub(self.clock.since(self.begin));
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
