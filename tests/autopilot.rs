//! A small autopilot and its boat, as ArduPilot's Rover answers a bridge, in simulated time.
//!
//! Like the real one, it follows references only in mode GUIDED and while armed: the velocity's
//! length is the speed ahead over ground, clipped at `WP_SPEED`, the yaw is the heading. It stops
//! after three seconds without a reference. Commands set mode and arming, and read parameters.

use mavlink::dialects::ardupilotmega::{
    ATTITUDE_DATA, COMMAND_ACK_DATA, EKF_STATUS_REPORT_DATA, EkfStatusFlags, GLOBAL_POSITION_INT_DATA,
    HEARTBEAT_DATA, MavAutopilot, MavCmd, MavMessage, MavModeFlag, MavResult, MavState, MavType,
    PARAM_VALUE_DATA,
};
use mavlink::{MAVLinkV2MessageRaw, MavHeader};
use nalgebra::Vector2;

/// Mode numbers. Source: ArduPilot, `Rover/mode.h`.
pub const HOLD: u32 = 4;
/// As above.
pub const GUIDED: u32 = 15;

/// Origin of positions: latitude and longitude, degrees.
pub const ORIGIN: [f64; 2] = [38.41, -9.11];
/// Metres in a degree of latitude, near enough over a few hundred metres.
const METRES_PER_DEGREE: f64 = 111_319.5;
/// Time without references after which ArduPilot stops, s.
const REFERENCE_AGE_MAX: f64 = 3.0;
/// Time constants, s. The real ones: 5° from a 30° step after 1.5 s, 10 % of speed after 2.3 s.
const HEADING_TIME: f64 = 0.8;
const SPEED_TIME: f64 = 1.0;
const ACCELERATION_MAX: f64 = 1.0;
const TURN_RATE_MAX: f64 = 2.0;
const WP_SPEED: f32 = 2.0;
/// Its parameters: one rudder, one thruster.
const PARAMETERS: [(&str, f32); 5] = [
    ("WP_SPEED", WP_SPEED),
    ("ATC_STR_RAT_MAX", 120.0),
    ("ATC_ACCEL_MAX", 1.0),
    ("SERVO1_FUNCTION", 26.0),
    ("SERVO3_FUNCTION", 70.0),
];
/// The system of the boat.
pub const SYSTEM: u32 = 1;

/// The boat and its state.
#[expect(clippy::struct_excessive_bools, reason = "its parts fail one by one")]
#[derive(Clone, Debug)]
pub struct Boat {
    /// (north, east), m.
    pub position: Vector2<f64>,
    /// rad.
    pub heading: f64,
    /// Ahead, over ground, m/s.
    pub speed: f64,
    /// As `HOLD`, `GUIDED`.
    pub mode: u32,
    /// `true` while armed.
    pub is_armed: bool,
    /// `true` while it sends heartbeats.
    pub has_heartbeat: bool,
    /// `true` while it knows its position.
    pub has_position: bool,
    /// Orders received: of a mode, or to arm.
    pub orders: u64,
    /// Time constants of its loops, s; 0 if only the fastest turn limits it.
    pub heading_time: f64,
    /// See `heading_time`.
    pub speed_time: f64,
    /// Fastest turn, rad/s.
    pub turn_rate_max: f64,
    /// Time without references after which it stops, s.
    pub watchdog_s: f64,
    /// `true` while the rudder is stuck.
    pub is_rudder_stuck: bool,
    /// Speed, m/s, heading, rad, and the time of their arrival, s.
    reference: Option<(f64, f64, f64)>,
    yaw_rate: f64,
}

/// A frame of `system`'s autopilot.
pub fn frame(system: u32, message: &MavMessage) -> Vec<u8> {
    let header = MavHeader { system_id: system, component_id: 1, sequence: 0 };
    let mut raw = MAVLinkV2MessageRaw::new();
    raw.serialize_message(header, message);
    raw.raw_bytes().to_vec()
}

/// `GLOBAL_POSITION_INT` of a vehicle at `position` (north, east), m.
#[expect(clippy::cast_possible_truncation, reason = "the message's integers are that wide")]
pub fn place(position: &Vector2<f64>, velocity: &Vector2<f64>, heading: Option<f64>) -> MavMessage {
    let [lat_deg, lon_deg] = ORIGIN;
    let lon_scale = METRES_PER_DEGREE * lat_deg.to_radians().cos();
    let centidegrees = |heading: f64| (heading.to_degrees().rem_euclid(360.0) * 100.0).clamp(0.0, 35_999.0);
    let hdg = heading.map_or(u16::MAX, |heading| centidegrees(heading) as u16);
    MavMessage::GLOBAL_POSITION_INT(GLOBAL_POSITION_INT_DATA {
        lat: ((lat_deg + position.x / METRES_PER_DEGREE) * 1e7).round() as i32,
        lon: ((lon_deg + position.y / lon_scale) * 1e7).round() as i32,
        vx: (velocity.x * 100.0).round() as i16,
        vy: (velocity.y * 100.0).round() as i16,
        hdg,
        ..GLOBAL_POSITION_INT_DATA::DEFAULT
    })
}

impl Boat {
    /// At (0, 0), heading east, in mode HOLD and disarmed.
    pub fn moored() -> Self {
        Self {
            position: Vector2::zeros(),
            heading: 1.6,
            speed: 0.0,
            mode: HOLD,
            is_armed: false,
            has_heartbeat: true,
            has_position: true,
            orders: 0,
            heading_time: HEADING_TIME,
            speed_time: SPEED_TIME,
            turn_rate_max: TURN_RATE_MAX,
            watchdog_s: REFERENCE_AGE_MAX,
            is_rudder_stuck: false,
            reference: None,
            yaw_rate: 0.0,
        }
    }

    /// Takes a message at `t_s`, s; adds its answers.
    pub fn take(&mut self, message: &MavMessage, t_s: f64, answers: &mut Vec<MavMessage>) {
        match message {
            MavMessage::SET_POSITION_TARGET_LOCAL_NED(target)
                if self.mode == GUIDED && target.type_mask.bits() == 0x9C7 =>
            {
                let speed = f64::from(target.vx.hypot(target.vy).min(WP_SPEED));
                self.reference = Some((speed, f64::from(target.yaw), t_s));
            }
            MavMessage::COMMAND_LONG(order) => {
                match order.command {
                    MavCmd::MAV_CMD_DO_SET_MODE => {
                        self.orders += 1;
                        self.mode = if order.param2 == 15.0 { GUIDED } else { HOLD };
                    }
                    MavCmd::MAV_CMD_COMPONENT_ARM_DISARM => {
                        self.orders += 1;
                        self.is_armed = order.param1 == 1.0;
                    }
                    _ => {}
                }
                answers.push(MavMessage::COMMAND_ACK(COMMAND_ACK_DATA {
                    command: order.command,
                    result: MavResult::MAV_RESULT_ACCEPTED,
                }));
            }
            MavMessage::PARAM_REQUEST_READ(asked) => {
                let known = PARAMETERS.iter().find(|(name, _)| asked.param_id.to_str() == Ok(name));
                answers.extend(known.map(|(_, value)| {
                    MavMessage::PARAM_VALUE(PARAM_VALUE_DATA {
                        param_value: *value,
                        param_id: asked.param_id,
                        ..PARAM_VALUE_DATA::DEFAULT
                    })
                }));
            }
            _ => {}
        }
    }

    /// Sails for `dt` from `t_s` on, s, in a current (north, east), m/s.
    pub fn step(&mut self, t_s: f64, dt: f64, current: &Vector2<f64>) {
        let (speed, heading) = self.followed(t_s).unwrap_or((0.0, self.heading));
        let turn = (heading - self.heading).sin().atan2((heading - self.heading).cos());
        if !self.is_rudder_stuck {
            self.yaw_rate = (turn / self.heading_time.max(dt)).clamp(-self.turn_rate_max, self.turn_rate_max);
        }
        self.heading += self.yaw_rate * dt;
        let faster = (speed - self.speed) / self.speed_time.max(dt);
        self.speed += faster.clamp(-ACCELERATION_MAX, ACCELERATION_MAX) * dt;
        self.position += self.velocity(current) * dt;
    }

    /// The speed, m/s, and heading, rad, that it follows at `t_s`, s.
    pub fn followed(&self, t_s: f64) -> Option<(f64, f64)> {
        let may_run = self.is_armed && self.mode == GUIDED;
        let fresh = self.reference.filter(|(_, _, at_s)| may_run && t_s - at_s <= self.watchdog_s);
        fresh.map(|(speed, heading, _)| (speed, heading))
    }

    /// The time of its last reference, s.
    pub fn referred_s(&self) -> Option<f64> {
        self.reference.map(|(_, _, at_s)| at_s)
    }

    /// Forgets its last reference.
    pub fn forget(&mut self) {
        self.reference = None;
    }

    /// Over ground (north, east), m/s: its loop holds the speed ahead; the current adds drift.
    fn velocity(&self, current: &Vector2<f64>) -> Vector2<f64> {
        let (sin, cos) = self.heading.sin_cos();
        let (bow, starboard) = (Vector2::new(cos, sin), Vector2::new(-sin, cos));
        bow * self.speed + starboard * starboard.dot(current)
    }

    /// Its messages at this step, of fifty in a second.
    pub fn messages(&self, step: u64, current: &Vector2<f64>) -> Vec<MavMessage> {
        let mut said = vec![];
        if step.is_multiple_of(50) && self.has_heartbeat {
            let mut base_mode = MavModeFlag::MAV_MODE_FLAG_CUSTOM_MODE_ENABLED;
            base_mode.set(MavModeFlag::MAV_MODE_FLAG_SAFETY_ARMED, self.is_armed);
            said.push(MavMessage::HEARTBEAT(HEARTBEAT_DATA {
                custom_mode: self.mode,
                mavtype: MavType::MAV_TYPE_SURFACE_BOAT,
                autopilot: MavAutopilot::MAV_AUTOPILOT_ARDUPILOTMEGA,
                base_mode,
                system_status: MavState::MAV_STATE_ACTIVE,
                mavlink_version: 3,
            }));
        }
        if step.is_multiple_of(50) {
            let mut flags = EkfStatusFlags::empty();
            flags.set(EkfStatusFlags::EKF_POS_HORIZ_ABS, self.has_position);
            said.push(MavMessage::EKF_STATUS_REPORT(EKF_STATUS_REPORT_DATA {
                flags,
                ..EKF_STATUS_REPORT_DATA::DEFAULT
            }));
        }
        if step.is_multiple_of(5) {
            said.push(place(&self.position, &self.velocity(current), Some(self.heading)));
            #[expect(clippy::cast_possible_truncation, reason = "the message is that coarse")]
            said.push(MavMessage::ATTITUDE(ATTITUDE_DATA {
                yaw: self.heading.sin().atan2(self.heading.cos()) as f32,
                yawspeed: self.yaw_rate as f32,
                ..ATTITUDE_DATA::DEFAULT
            }));
        }
        said
    }
}
