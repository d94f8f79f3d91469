//! Simulated vehicles on a network of IMC: a craft with DUNE's supervisor and its manoeuvre
//! FollowReference, and AUVs that say where they are.

use super::codec::{
    Announce, ByteOrder, EstimatedState, FollowReference, Header, Heartbeat, Message, PacketReader,
    PlanControl, PlanControlState, Reference as PlaceAndSpeed, UsblFixExtended, VehicleState, packet,
};
use super::link::{ALL, DONE, LOAD, REQUEST, START};
use super::mode::{FOLLOW_REFERENCE, MANEUVER, SERVICE};
use super::reader::Z_DEPTH;
use crate::recent_positions::moved;
use crate::reference::Reference;
use crate::rehearsal::vehicle::Placed;
use crate::wire::{Endpoint, Received};
use crate::{Origin, on_earth};

/// Number of the craft as a system; those of its AUVs follow.
const CRAFT: u16 = 0x2C80;

/// Ends a plan.
const END: u8 = 1;
/// `Announce.sys_type`.
const USV: u8 = 3;
const UUV: u8 = 2;
const NO_MANEUVER: u16 = 0xFFFF;
/// `PlanControlState.state`: a plan is ready, or is executed.
const READY: u8 = 1;
const EXECUTING: u8 = 3;
/// Distance within which DUNE is at a place, m.
const TOLERANCE_M: f64 = 15.0;

/// The craft and its AUVs. Times are the rehearsal's, s.
#[derive(Default)]
pub(crate) struct ImcVehicles {
    packets: PacketReader,
    services: String,
    /// The manoeuvre under way, and the time since which its references are missing.
    follows: Option<(FollowReference, f64)>,
    reference: Option<PlaceAndSpeed>,
    /// Times of what was said of the AUVs last.
    said_s: Vec<f64>,
    answers: Vec<Message>,
}

impl ImcVehicles {
    pub(crate) fn new(endpoint: Endpoint) -> Self {
        let services = match endpoint {
            Endpoint::Imc(address) => format!("imc+udp://{address}/"),
            _ => String::new(),
        };
        Self { services, ..Self::default() }
    }

    /// Takes a piece of the wire at `t_s`.
    pub(crate) fn take(&mut self, piece: &Received, t_s: f64) {
        for packet in self.packets.push(&piece.bytes, piece.is_datagram) {
            if ![CRAFT, ALL].contains(&packet.header.destination) {
                continue;
            }
            match packet.message {
                Some(Message::PlanControl(plan)) if plan.kind == REQUEST => self.order(plan, t_s),
                Some(Message::Reference(place)) => {
                    let by = packet.header.source;
                    if let Some((plan, heard_s)) = &mut self.follows
                        && [ALL, by].contains(&plan.control_src)
                    {
                        *heard_s = t_s;
                        let is_done = place.flags & DONE != 0;
                        self.reference = Some(place).filter(|_| !is_done);
                        self.follows.take_if(|_| is_done);
                    }
                }
                _ => {}
            }
        }
    }

    fn order(&mut self, plan: PlanControl, t_s: f64) {
        let PlanControl { op, plan_id, arg, .. } = plan;
        let state = if op == LOAD { READY } else { EXECUTING };
        match (op, arg) {
            (LOAD, Some(_)) => {}
            (START, Some(arg)) => {
                self.answers.push(arg.clone().into());
                (self.follows, self.reference) = (Some((arg, t_s)), None);
            }
            (START | END, _) => return (self.follows, self.reference) = (None, None),
            _ => return,
        }
        self.answers.push(PlanControlState { state, plan_id, ..PlanControlState::default() }.into());
    }

    /// The packets of `t_s`, and what steers the craft.
    pub(crate) fn say(
        &mut self,
        t_s: f64,
        craft: &Placed,
        auvs: &[Placed],
    ) -> (Vec<Vec<u8>>, Option<Reference>) {
        self.follows.take_if(|(plan, heard_s)| f64::from(plan.timeout) < t_s - *heard_s);
        let reference = self.reference.as_ref().filter(|_| self.follows.is_some());
        let steered = reference.and_then(|reference| towards(reference, &craft.place));
        let (op_mode, maneuver_type) =
            if self.follows.is_some() { (MANEUVER, FOLLOW_REFERENCE) } else { (SERVICE, NO_MANEUVER) };
        let state = VehicleState { op_mode, maneuver_type, ..VehicleState::default() };
        let own = [self.announce(craft, USV), Heartbeat {}.into(), state_of(craft), state.into()];
        let mut said: Vec<(u16, Message)> =
            own.into_iter().chain(self.answers.drain(..)).map(|message| (CRAFT, message)).collect();
        self.said_s.resize(auvs.len(), f64::NEG_INFINITY);
        for (index, (auv, number)) in auvs.iter().zip(CRAFT + 1..).enumerate() {
            said.push((number, self.announce(auv, UUV)));
            if self.said_s[index] < auv.vehicle.t_s {
                self.said_s[index] = auv.vehicle.t_s;
                // A modem of the craft hears those that do not say how they move.
                let by = if auv.vehicle.velocity.is_some() { number } else { CRAFT };
                said.push((by, state_of(auv)));
            }
        }
        let bytes = |(source, message): &(u16, Message)| {
            packet(&Header::new(craft.unix_s, *source, ALL), message, ByteOrder::Little)
        };
        (said.iter().map(bytes).collect(), steered)
    }

    fn announce(&self, at: &Placed, sys_type: u8) -> Message {
        Announce {
            sys_name: at.vehicle.name.clone(),
            sys_type,
            owner: ALL,
            lat: at.place.lat_deg.to_radians(),
            lon: at.place.lon_deg.to_radians(),
            height: 0.0,
            services: self.services.clone(),
        }
        .into()
    }
}

/// The reference that leads from `here` to a place; none at it.
fn towards(reference: &PlaceAndSpeed, here: &Origin) -> Option<Reference> {
    let away = moved(here, &on_earth(reference.lat.to_degrees(), reference.lon.to_degrees())?);
    let speed = reference.speed.as_ref()?.value;
    let is_one = TOLERANCE_M <= away.norm() && 0.0 <= speed && speed.is_finite();
    is_one.then(|| Reference { speed, heading: away.y.atan2(away.x) })
}

#[expect(clippy::cast_possible_truncation, reason = "the message is that coarse")]
fn state_of(at: &Placed) -> Message {
    let (vehicle, place) = (at.vehicle, &at.place);
    let [lat, lon] = [place.lat_deg, place.lon_deg].map(f64::to_radians);
    let Some(velocity) = vehicle.velocity else {
        let (target, z) = (vehicle.name.clone(), vehicle.depth_m as f32);
        return UsblFixExtended { target, lat, lon, z_units: Z_DEPTH, z, accuracy: 0.0 }.into();
    };
    EstimatedState {
        lat,
        lon,
        psi: vehicle.heading as f32,
        r: vehicle.yaw_rate as f32,
        vx: velocity.x as f32,
        vy: velocity.y as f32,
        depth: vehicle.depth_m as f32,
        alt: -1.0,
        ..EstimatedState::default()
    }
    .into()
}
