//! The boat as a craft that runs DUNE: its messages in IMC, and the bridge's as messages.
//!
//! The boat is guided in the manoeuvre FollowReference, which ends without references after the time
//! that the bridge has asked for. An operator then starts it again. DUNE steers towards a place: its
//! direction is that from where the bridge was told that the craft is. Packets are those of the
//! bridge's own codec, which equals imcpy's.

use bridge::imc::codec::{
    self, AisInfo, ByteOrder, EstimatedState, Header, Message, NavigationUncertainty, PacketReader,
    Reference, VehicleState,
};
use mavlink::dialects::ardupilotmega::{
    COMMAND_LONG_DATA, EkfStatusFlags, GLOBAL_POSITION_INT_DATA, HEARTBEAT_DATA, MavCmd, MavMessage,
};

use super::moos::{reference, said};
use crate::autopilot::{Boat, GUIDED, HOLD};

/// Numbers of the systems.
pub(super) const CRAFT: u16 = 0x0C01;
pub(super) const AUV: u16 = 0x001E;
/// `VehicleState`: modes of operation, and the manoeuvre FollowReference.
const SERVICE: u8 = 0;
const MANEUVER: u8 = 3;
const FOLLOW_REFERENCE: u16 = 478;
/// Distance at which DUNE is at a place, m.
const TOLERANCE_M: f64 = 15.0;
const EARTH_RADIUS_M: f64 = 6_371_000.0;
/// Time after which the operator starts the manoeuvre again, s.
const HANDS_BACK_S: f64 = 5.0;
const KNOT: f64 = 1852.0 / 3600.0;

/// DUNE's supervisor.
#[derive(Debug, Default)]
pub(super) struct Dune {
    /// Latitude and longitude, rad, that the bridge was told last.
    told: Option<[f64; 2]>,
    /// Direction of the last reference that was no stop, rad.
    heading: f64,
    /// Time without references after which the manoeuvre ends, s: the bridge's wish.
    timeout_s: f64,
    /// Begin of the manoeuvre, s, or its end by itself.
    began_s: Option<f64>,
    ended_s: Option<f64>,
}

impl Dune {
    /// Ends the manoeuvre of a `boat` without references; an operator who `hands_back` starts it.
    pub(super) fn supervise(&mut self, boat: &mut Boat, t_s: f64, hands_back: bool) {
        if boat.mode == GUIDED {
            let began_s = *self.began_s.get_or_insert(t_s);
            self.ended_s = None;
            if self.timeout_s < t_s - boat.referred_s().map_or(began_s, |at_s| at_s.max(began_s)) {
                boat.mode = HOLD;
                self.ended_s = Some(t_s);
            }
        } else {
            self.began_s = None;
            boat.forget();
            if hands_back && self.ended_s.is_some_and(|at_s| HANDS_BACK_S < t_s - at_s) {
                boat.mode = GUIDED;
            }
        }
    }

    /// Notes the place in the `bytes` that the bridge gets.
    pub(super) fn tell(&mut self, bytes: &[u8]) {
        for packet in PacketReader::default().push(bytes, true) {
            if let (CRAFT, Some(Message::EstimatedState(state))) = (packet.header.source, packet.message) {
                self.told = Some([state.lat, state.lon]);
            }
        }
    }

    /// What the bridge means by `bytes`.
    pub(super) fn messages(&mut self, bytes: &[u8]) -> Vec<MavMessage> {
        let packets = PacketReader::default().push(bytes, true).into_iter();
        packets.filter_map(|packet| self.meant(packet.message?)).collect()
    }

    fn meant(&mut self, message: Message) -> Option<MavMessage> {
        match message {
            Message::Heartbeat(_) => Some(MavMessage::HEARTBEAT(HEARTBEAT_DATA::DEFAULT)),
            // The status line is for the log book alone.
            Message::LogBookEntry(entry)
                if ["Pilotfish", "..."].iter().any(|with| entry.text.starts_with(with)) =>
            {
                Some(said(&entry.text))
            }
            Message::PlanControl(plan) => {
                self.timeout_s = plan.arg?.timeout.into();
                Some(MavMessage::COMMAND_LONG(COMMAND_LONG_DATA {
                    command: MavCmd::MAV_CMD_DO_SET_MODE,
                    param2: 15.0,
                    ..COMMAND_LONG_DATA::DEFAULT
                }))
            }
            Message::Reference(place) => Some(reference(self.towards(&place)?)),
            _ => None,
        }
    }

    /// Direction, rad, and speed, m/s, of a reference; no speed at its place.
    fn towards(&mut self, place: &Reference) -> Option<(f64, f64)> {
        let [lat, lon] = self.told?;
        let (north, east) = (place.lat - lat, (place.lon - lon) * lat.cos());
        if EARTH_RADIUS_M * north.hypot(east) < TOLERANCE_M {
            return Some((self.heading, 0.0));
        }
        self.heading = east.atan2(north);
        Some((self.heading, place.speed.as_ref()?.value))
    }
}

/// The packets of `messages` of a boat at `unix_s`, s.
pub(super) fn written(boat: &Boat, messages: &[MavMessage], unix_s: f64) -> Vec<u8> {
    let follows = boat.mode == GUIDED && boat.is_armed;
    let turn = messages.iter().find_map(|message| match message {
        MavMessage::ATTITUDE(attitude) => Some((attitude.yaw, attitude.yawspeed)),
        _ => None,
    });
    let meant = messages.iter().filter_map(|message| match message {
        MavMessage::GLOBAL_POSITION_INT(place) => {
            let (psi, r) = turn?;
            Some(EstimatedState { psi, r, ..state(place) }.into())
        }
        MavMessage::HEARTBEAT(_) => Some(
            VehicleState {
                op_mode: if follows { MANEUVER } else { SERVICE },
                maneuver_type: if follows { FOLLOW_REFERENCE } else { u16::MAX },
                ..VehicleState::default()
            }
            .into(),
        ),
        MavMessage::EKF_STATUS_REPORT(status) => {
            let is_known = status.flags.contains(EkfStatusFlags::EKF_POS_HORIZ_ABS);
            let variance = if is_known { 1.0 } else { 1e4 };
            Some(
                NavigationUncertainty { x: variance, y: variance, ..NavigationUncertainty::default() }.into(),
            )
        }
        MavMessage::AIS_VESSEL(vessel) => {
            let [lat, lon] = [vessel.lat, vessel.lon].map(radians);
            let knots = f64::from(vessel.velocity) * 0.01 / KNOT;
            #[expect(clippy::cast_possible_truncation, reason = "the message is that coarse")]
            Some(
                AisInfo {
                    mmsi: vessel.MMSI.to_string(),
                    lat,
                    lon,
                    course: (f64::from(vessel.COG) * 0.01).to_radians() as f32,
                    speed: knots as f32,
                    a: vessel.dimension_bow.into(),
                    b: vessel.dimension_stern.into(),
                    ..AisInfo::default()
                }
                .into(),
            )
        }
        _ => None,
    });
    meant.flat_map(|message: Message| packet(CRAFT, &message, unix_s)).collect()
}

/// The packet with the state of an AUV at the place in `message`.
pub(super) fn auv(message: &MavMessage, unix_s: f64) -> Vec<u8> {
    let MavMessage::GLOBAL_POSITION_INT(place) = message else { unreachable!("is a place") };
    packet(AUV, &state(place).into(), unix_s)
}

fn state(place: &GLOBAL_POSITION_INT_DATA) -> EstimatedState {
    let [lat, lon] = [place.lat, place.lon].map(radians);
    let [vx, vy] = [place.vx, place.vy].map(|speed| f32::from(speed) * 0.01);
    EstimatedState { lat, lon, vx, vy, alt: -1.0, ..EstimatedState::default() }
}

fn radians(degrees: i32) -> f64 {
    (f64::from(degrees) * 1e-7).to_radians()
}

fn packet(source: u16, message: &Message, time_s: f64) -> Vec<u8> {
    let header = Header { time_s, source, destination: 0xFFFF, ..Header::default() };
    codec::packet(&header, message, ByteOrder::Big)
}
