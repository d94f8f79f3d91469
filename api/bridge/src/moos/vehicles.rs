//! Simulated vehicles on a MOOSDB, in the place of the craft's navigation and engines.

use super::packet::{Message, NOTIFY, PacketReader, connection, packet};
use crate::reference::Reference;
use crate::rehearsal::vehicle::{Placed, REFERENCE_AGE_MAX_S};

const NAME: &str = "pPilotfishSimulator";
const DESIRED: [&str; 2] = ["DESIRED_HEADING", "DESIRED_SPEED"];

/// The craft and its AUVs.
#[derive(Debug, Default)]
pub(crate) struct MoosVehicles {
    packets: PacketReader,
    /// Number and Unix time of arrival, s, of the desired heading and speed.
    desired: [Option<(f64, f64)>; 2],
}

impl MoosVehicles {
    /// Takes `bytes`; what begins a new connection.
    pub(crate) fn take(&mut self, bytes: &[u8], unix_s: f64) -> Option<Vec<u8>> {
        if bytes.is_empty() {
            self.packets.restart();
            return Some(connection(NAME, &DESIRED, unix_s));
        }
        for message in self.packets.push(bytes).iter().filter(|message| message.kind == NOTIFY) {
            if let Some(index) = DESIRED.iter().position(|key| *key == message.key) {
                self.desired[index] = Some((message.number, unix_s));
            }
        }
        None
    }

    /// The reference by which the craft is steered now.
    pub(crate) fn reference(&self, unix_s: f64) -> Option<Reference> {
        let [heading, speed] = self.desired.map(|desired| {
            let (number, at_s) = desired?;
            (unix_s - at_s <= REFERENCE_AGE_MAX_S).then_some(number)
        });
        Some(Reference { heading: heading?.to_radians(), speed: speed?.max(0.0) })
    }

    /// The packet that says where they are.
    pub(crate) fn say(craft: &Placed, auvs: &[Placed]) -> Vec<u8> {
        let Placed { vehicle, place, unix_s } = craft;
        let degrees = |angle: f64| angle.to_degrees().rem_euclid(360.0);
        let velocity = vehicle.velocity.unwrap_or_default();
        let (speed, [vx, vy]) = (velocity.norm(), velocity.into());
        let numbers = [
            ("NAV_X", vehicle.position.y),
            ("NAV_Y", vehicle.position.x),
            ("NAV_LAT", place.lat_deg),
            ("NAV_LONG", place.lon_deg),
            ("NAV_HEADING", degrees(vehicle.heading)),
            ("NAV_SPEED", speed),
            ("NAV_SPEED_OVER_GROUND", speed),
            ("NAV_HEADING_OVER_GROUND", degrees(f64::atan2(vy, vx))),
        ];
        let message = |key: &str| Message {
            kind: NOTIFY,
            source: NAME.to_owned(),
            key: key.to_owned(),
            t_s: *unix_s,
            ..Message::default()
        };
        let report = |(key, kind, Placed { vehicle, place, unix_s }): (&str, &str, &Placed)| {
            let (x, y, depth) = (vehicle.position.y, vehicle.position.x, vehicle.depth_m);
            let motion = vehicle
                .velocity
                .map(|velocity| format!("SPD={:.2},HDG={:.2},", velocity.norm(), degrees(vehicle.heading)));
            let motion = motion.unwrap_or_default();
            let text = format!(
                "NAME={},TYPE={kind},X={x:.2},Y={y:.2},LAT={:.8},LON={:.8},{motion}DEP={depth:.2},TIME={unix_s:.2}",
                vehicle.name, place.lat_deg, place.lon_deg,
            );
            Message { text: Some(text), ..message(key) }
        };
        let numbers = numbers.into_iter().map(|(key, number)| Message { number, ..message(key) });
        let own = [("NODE_REPORT_LOCAL", "KAYAK", craft)].into_iter();
        let all = own.chain(auvs.iter().map(|auv| ("NODE_REPORT", "UUV", auv)));
        packet(&numbers.chain(all.map(report)).collect::<Vec<_>>())
    }
}
