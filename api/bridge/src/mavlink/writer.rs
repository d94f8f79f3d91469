//! Frames to an autopilot.

use ::mavlink::dialects::ardupilotmega::{
    COMMAND_LONG_DATA, HEARTBEAT_DATA, MavAutopilot, MavCmd, MavFrame, MavMessage, MavModeFlag, MavSeverity,
    MavState, MavType, PARAM_REQUEST_READ_DATA, PositionTargetTypemask, SET_POSITION_TARGET_LOCAL_NED_DATA,
    STATUSTEXT_DATA,
};
use ::mavlink::types::CharArray;
use ::mavlink::{MAVLinkV2MessageRaw, MavHeader};

use super::autopilot::{ARDUPILOT_GUIDED, Autopilot, PX4_OFFBOARD};
use crate::reference::Reference;

#[derive(Debug)]
pub(crate) struct MavlinkWriter {
    sequence: u8,
    system: u8,
}

/// An onboard computer. Source: MAVLink, `MAV_COMP_ID_ONBOARD_COMPUTER`.
const ONBOARD_COMPUTER: u8 = 191;
const AUTOPILOT: u8 = 1;

/// Most bytes of a text. Source: MAVLink, `STATUSTEXT`.
pub(crate) const TEXT_BYTES: usize = 50;

/// Type mask for velocity and yaw only. It ignores bits 0 to 2, 6 to 8 and 11 (yaw rate).
const SPEED_AND_HEADING: u16 = 0x9C7;
/// Type mask that ignores all but velocity.
const VELOCITY: u16 = 0xDC7;
/// A custom mode follows. Source: MAVLink, `MAV_MODE_FLAG_CUSTOM_MODE_ENABLED`.
const CUSTOM_MODE: f32 = 1.0;
/// Numbers and rates, Hz, of the messages that the bridge needs.
const STREAMS: [(f32, f32); 6] = [
    // GLOBAL_POSITION_INT, ATTITUDE: the start of a plan.
    (33.0, 10.0),
    (30.0, 10.0),
    // GPS_RAW_INT, EKF_STATUS_REPORT: the state of its position.
    (24.0, 2.0),
    (193.0, 2.0),
    // SYSTEM_TIME: the error of its clock.
    (2.0, 1.0),
    // SYS_STATUS: the charge of its battery.
    (1.0, 0.5),
];
const MICROSECONDS: f32 = 1e6;

impl MavlinkWriter {
    /// Frames of the computer beside the autopilot `system`.
    pub(crate) fn new(system: u8) -> Self {
        Self { sequence: 0, system }
    }

    /// The heartbeat of this computer, once a second.
    pub(crate) fn heartbeat(&mut self) -> Vec<u8> {
        self.frame(&MavMessage::HEARTBEAT(HEARTBEAT_DATA {
            custom_mode: 0,
            mavtype: MavType::MAV_TYPE_ONBOARD_CONTROLLER,
            autopilot: MavAutopilot::MAV_AUTOPILOT_INVALID,
            base_mode: MavModeFlag::empty(),
            system_status: MavState::MAV_STATE_ACTIVE,
            mavlink_version: 3,
        }))
    }

    /// A text for the ground station, to which the autopilot passes on its first `TEXT_BYTES`.
    pub(crate) fn text(&mut self, severity: MavSeverity, text: &str) -> Vec<u8> {
        let mut bytes = [0; TEXT_BYTES];
        let kept = text.floor_char_boundary(bytes.len());
        bytes[..kept].copy_from_slice(&text.as_bytes()[..kept]);
        let text = CharArray::new(bytes);
        self.frame(&MavMessage::STATUSTEXT(STATUSTEXT_DATA { severity, text }))
    }

    /// Speed ahead and heading, at `boot_ms` of this computer.
    ///
    /// ArduPilot's Rover takes the length of the velocity as speed ahead, over ground, and the yaw
    /// as heading; negative speeds mean astern. PX4 takes speed and bearing from the velocity.
    pub(crate) fn reference(&mut self, autopilot: Autopilot, reference: &Reference, boot_ms: u32) -> Vec<u8> {
        let speed = reference.speed.max(0.0);
        let (mask, [vx, vy]) = if autopilot == Autopilot::Px4 {
            let (sin, cos) = reference.heading.sin_cos();
            (VELOCITY, [speed * cos, speed * sin])
        } else {
            (SPEED_AND_HEADING, [speed, 0.0])
        };
        let [vx, vy, yaw] = [vx, vy, reference.heading].map(single);
        self.frame(&MavMessage::SET_POSITION_TARGET_LOCAL_NED(SET_POSITION_TARGET_LOCAL_NED_DATA {
            time_boot_ms: boot_ms,
            vx,
            vy,
            yaw,
            type_mask: PositionTargetTypemask::from_bits_retain(mask),
            target_system: self.system,
            target_component: AUTOPILOT,
            coordinate_frame: MavFrame::MAV_FRAME_LOCAL_NED,
            ..SET_POSITION_TARGET_LOCAL_NED_DATA::DEFAULT
        }))
    }

    pub(crate) fn streams(&mut self) -> Vec<u8> {
        let interval = MavCmd::MAV_CMD_SET_MESSAGE_INTERVAL;
        let frame = |(message, hz)| self.command(interval, [message, MICROSECONDS / hz]);
        STREAMS.into_iter().flat_map(frame).collect()
    }

    pub(crate) fn read_parameter(&mut self, name: &str) -> Vec<u8> {
        let mut id = [0; 16];
        let kept = name.len().min(id.len());
        id[..kept].copy_from_slice(&name.as_bytes()[..kept]);
        self.frame(&MavMessage::PARAM_REQUEST_READ(PARAM_REQUEST_READ_DATA {
            // Requested by name.
            param_index: -1,
            target_system: self.system,
            target_component: AUTOPILOT,
            param_id: CharArray::new(id),
        }))
    }

    pub(crate) fn set_guided(&mut self, autopilot: Autopilot) -> Vec<u8> {
        let mode = if autopilot == Autopilot::Px4 { PX4_OFFBOARD } else { ARDUPILOT_GUIDED };
        self.command(MavCmd::MAV_CMD_DO_SET_MODE, [CUSTOM_MODE, mode as f32])
    }

    pub(crate) fn arm(&mut self) -> Vec<u8> {
        self.command(MavCmd::MAV_CMD_COMPONENT_ARM_DISARM, [1.0, 0.0])
    }

    fn command(&mut self, command: MavCmd, [param1, param2]: [f32; 2]) -> Vec<u8> {
        self.frame(&MavMessage::COMMAND_LONG(COMMAND_LONG_DATA {
            param1,
            param2,
            command,
            target_system: self.system,
            target_component: AUTOPILOT,
            ..COMMAND_LONG_DATA::DEFAULT
        }))
    }

    fn frame(&mut self, message: &MavMessage) -> Vec<u8> {
        let header = MavHeader {
            system_id: u32::from(self.system),
            component_id: ONBOARD_COMPUTER,
            sequence: self.sequence,
        };
        self.sequence = self.sequence.wrapping_add(1);
        let mut raw = MAVLinkV2MessageRaw::new();
        raw.serialize_message(header, message);
        raw.raw_bytes().to_vec()
    }
}

#[expect(clippy::cast_possible_truncation, reason = "speeds and angles keep seven digits")]
fn single(value: f64) -> f32 {
    value as f32
}
