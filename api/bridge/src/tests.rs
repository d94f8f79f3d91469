//! Answers of a service and messages of an autopilot, for tests.

use ::mavlink::dialects::ardupilotmega::{HEARTBEAT_DATA, MavAutopilot, MavMessage, MavModeFlag, MavType};
use ::mavlink::{MAVLinkV2MessageRaw, MavHeader};
use serde_json::{Value, json};

/// Answer of `…/reference` with the plan of event `sequence`: to the north at 20 m/s.
pub(crate) fn planned(sequence: u64) -> Value {
    let mut answer: Value = serde_json::from_str(include_str!("tests/reference.json")).expect("is JSON");
    answer["sequence"] = sequence.into();
    answer
}

/// A running mission.
pub(crate) fn mission(id: &str) -> Value {
    json!({ "id": id, "title": id, "kind": "live", "status": "running", "created_s": 0.0, "t_s": 0.0, "sequence": 1 })
}

pub(crate) const ARDUPILOT: MavAutopilot = MavAutopilot::MAV_AUTOPILOT_ARDUPILOTMEGA;
pub(crate) const BOAT: MavType = MavType::MAV_TYPE_SURFACE_BOAT;

pub(crate) fn frame(system_id: u32, component_id: u8, message: &MavMessage) -> Vec<u8> {
    let header = MavHeader { system_id, component_id, sequence: 0 };
    let mut raw = MAVLinkV2MessageRaw::new();
    raw.serialize_message(header, message);
    raw.raw_bytes().to_vec()
}

/// The heartbeat of an armed craft.
pub(crate) fn heartbeat(mavtype: MavType, autopilot: MavAutopilot, custom_mode: u32) -> MavMessage {
    MavMessage::HEARTBEAT(HEARTBEAT_DATA {
        mavtype,
        custom_mode,
        autopilot,
        base_mode: MavModeFlag::MAV_MODE_FLAG_SAFETY_ARMED,
        ..HEARTBEAT_DATA::DEFAULT
    })
}
