//! Reads a MAVLink stream as events of the autopilot and its craft, and fixes of AUVs.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::io::{self, Read};
use std::sync::Arc;
use std::time::Duration;

use ::mavlink::dialects::ardupilotmega::{
    AIS_VESSEL_DATA, AisFlags, EkfStatusFlags, FOLLOW_TARGET_DATA, GLOBAL_POSITION_INT_DATA, GpsFixType,
    HEARTBEAT_DATA, MavAutopilot, MavMessage, MavModeFlag, MavResult, MavType,
};
use ::mavlink::{MAVLinkMessageRaw, MavlinkReader as FrameReader, Message as _};
use nalgebra::Vector2;
use parking_lot::Mutex;

use super::autopilot::{Autopilot, Heartbeat};
use crate::nmea::vessel_status;
use crate::{AuvFix, CraftMeasurement, Measurement, Origin, Rejects, VesselFix, VesselMessage, on_earth};

#[derive(Clone, Debug, PartialEq)]
pub(crate) enum AutopilotEvent {
    /// A measurement of the surface craft or of an AUV.
    Measured(Measurement),
    Heartbeat(Heartbeat),
    Parameter {
        name: String,
        value: f32,
    },
    Text(String),
    /// The answer of the craft's autopilot to a command of this number.
    Acknowledged {
        command: u32,
        is_accepted: bool,
    },
    /// The first heartbeat of a vehicle that is no surface craft: its system number and type.
    NoCraft {
        system: u8,
        kind: String,
    },
    PositionKnown(bool),
    /// Share of the craft's energy that is left.
    Battery(f64),
    /// Time on the clock of the craft's autopilot, s of Unix time.
    Time(f64),
    /// Roll and pitch of the craft, rad, positive starboard down and nose up.
    Attitude {
        roll: f64,
        pitch: f64,
    },
}

impl AutopilotEvent {
    /// A measurement of the surface craft on a wire without talkers.
    pub(crate) fn of_craft(t_s: f64, measured: CraftMeasurement) -> Self {
        Self::Measured(Measurement::Craft { t_s, talker: [0; 2], measured })
    }
}

/// Reads a stream in pieces of any size.
///
/// Messages of the craft count from its autopilot only (component 1); AUVs are other systems.
pub(crate) struct MavlinkReader {
    frames: FrameReader<Feed>,
    feed: Feed,
    /// Pushed bytes that are in no frame yet, and bytes of the frames read since.
    pending: usize,
    framed: usize,
    pub(crate) craft: Option<u8>,
    /// The type in the last heartbeat of each system's autopilot.
    types: BTreeMap<u8, MavType>,
    /// Systems that were reported as no surface craft.
    others: BTreeSet<u8>,
    autopilot: Option<Autopilot>,
    /// The senders' own times of the newest positions, by system and message number.
    timed: BTreeMap<(u8, u32), u64>,
    auvs: BTreeMap<u8, String>,
    /// AUVs whose own filter reports that it does not know the position.
    lost: BTreeSet<u8>,
    pub(crate) rejects: Rejects,
}

/// Longest frame, bytes.
const FRAME_BYTES_MAX: usize = 280;
/// Component number of an autopilot. Source: MAVLink, `MAV_COMP_ID_AUTOPILOT1`.
const AUTOPILOT: u8 = 1;
/// Types of steered vehicles: ArduPilot's Rover and PX4's rover give a boat either one.
const SURFACE_CRAFT: [MavType; 2] = [MavType::MAV_TYPE_GROUND_ROVER, MavType::MAV_TYPE_SURFACE_BOAT];
/// Unknown heading in `GLOBAL_POSITION_INT`, centidegrees.
const HEADING_UNKNOWN: u16 = u16::MAX;
const DEGREES: f64 = 1e-7;
const METRES_PER_SECOND: f64 = 0.01;
const CENTIDEGREES: f64 = 0.01;
const METRES: f64 = 0.001;
/// Bits of `FOLLOW_TARGET.est_capabilities`: position, velocity.
const KNOWS_POSITION: u8 = 1;
const KNOWS_VELOCITY: u8 = 2;

impl MavlinkReader {
    /// A reader for the craft `system`, or the first one heard, and AUVs by system number.
    pub(crate) fn new(system: Option<u8>, auvs: BTreeMap<u8, String>) -> Self {
        let feed = Feed::default();
        Self {
            frames: FrameReader::new(feed.clone()),
            feed,
            pending: 0,
            framed: 0,
            craft: system,
            types: BTreeMap::new(),
            others: BTreeSet::new(),
            autopilot: None,
            timed: BTreeMap::new(),
            auvs,
            lost: BTreeSet::new(),
            rejects: Rejects::default(),
        }
    }

    /// The events that `bytes` complete, received at `received_s`, s of Unix time.
    pub(crate) fn push(&mut self, bytes: &[u8], received_s: f64) -> Vec<AutopilotEvent> {
        self.feed.extend(bytes);
        self.pending += bytes.len();
        let mut heard = vec![];
        // Fails only if the feed is empty.
        while let Ok(raw) = self.frames.read_any_raw_message::<MavMessage>() {
            self.framed += match &raw {
                MAVLinkMessageRaw::V1(frame) => frame.raw_bytes().len(),
                MAVLinkMessageRaw::V2(frame) => frame.raw_bytes().len(),
            };
            match MavMessage::parse(raw.version(), raw.message_id(), raw.payload()) {
                Ok(message) => self.take(&raw, &message, received_s, &mut heard),
                Err(_) => self.rejects.count("message out of its ranges"),
            }
        }
        self.count_strays();
        heard
    }

    /// Counts bytes outside frames, except those that may begin the next frame.
    fn count_strays(&mut self) {
        let stray = self.pending.saturating_sub(self.framed + FRAME_BYTES_MAX);
        self.rejects.add("byte of no whole frame", stray as u64);
        self.pending = (self.pending - stray).saturating_sub(self.framed);
        self.framed = 0;
    }

    fn take(
        &mut self,
        raw: &MAVLinkMessageRaw,
        message: &MavMessage,
        received_s: f64,
        heard: &mut Vec<AutopilotEvent>,
    ) {
        let component = raw.component_id();
        let Ok(system) = u8::try_from(raw.system_id()) else {
            return self.rejects.count("system number above 255");
        };
        if let MavMessage::HEARTBEAT(heartbeat) = message {
            return heard.extend(self.heartbeat(system, component, heartbeat));
        }
        let is_craft = self.craft == Some(system) && component == AUTOPILOT;
        if (is_craft || self.auvs.contains_key(&system)) && self.is_repeated(system, message) {
            return self.rejects.count("repeated message");
        }
        if is_craft {
            self.craft_message(message, received_s, heard);
        } else if let Some(auv) = self.auvs.get(&system) {
            match knows_position(message) {
                Some(true) => drop(self.lost.remove(&system)),
                Some(false) => drop(self.lost.insert(system)),
                None => {}
            }
            let fix = match message {
                MavMessage::GLOBAL_POSITION_INT(at) => fix_of_position(auv, at, received_s),
                MavMessage::FOLLOW_TARGET(at) => fix_of_target(auv, at, received_s),
                _ => return,
            };
            match fix {
                Some(_) if self.lost.contains(&system) => {
                    self.rejects.count("AUV that does not know its position");
                }
                Some(fix) => heard.push(AutopilotEvent::Measured(Measurement::Auv(fix))),
                None => self.rejects.count("AUV without a position"),
            }
        }
    }

    /// `true` if a position repeats the sender's own time: a relay repeats it. 0 means no clock.
    fn is_repeated(&mut self, system: u8, message: &MavMessage) -> bool {
        let sent_ms = match message {
            MavMessage::GLOBAL_POSITION_INT(at) => u64::from(at.time_boot_ms),
            MavMessage::FOLLOW_TARGET(at) => at.timestamp,
            _ => return false,
        };
        let before = self.timed.insert((system, message.message_id()), sent_ms);
        sent_ms != 0 && before == Some(sent_ms)
    }

    /// A heartbeat of an autopilot or a ground station. Two heartbeats determine a vehicle's type:
    /// the first one after a start may state another type.
    fn heartbeat(&mut self, system: u8, component: u8, heartbeat: &HEARTBEAT_DATA) -> Option<AutopilotEvent> {
        let autopilot = match heartbeat.autopilot {
            MavAutopilot::MAV_AUTOPILOT_ARDUPILOTMEGA => Autopilot::ArduPilot,
            MavAutopilot::MAV_AUTOPILOT_PX4 => Autopilot::Px4,
            _ => return None,
        };
        if component != AUTOPILOT || self.auvs.contains_key(&system) {
            return None;
        }
        let kind = heartbeat.mavtype;
        if self.types.insert(system, kind) != Some(kind) {
            return None;
        }
        if !SURFACE_CRAFT.contains(&kind) {
            let kind = format!("{kind:?}");
            return (self.others.insert(system)).then_some(AutopilotEvent::NoCraft { system, kind });
        }
        if *self.craft.get_or_insert(system) != system {
            self.rejects.count("another craft's heartbeat");
            return None;
        }
        self.autopilot = Some(autopilot);
        let is_armed = heartbeat.base_mode.contains(MavModeFlag::MAV_MODE_FLAG_SAFETY_ARMED);
        let heartbeat = Heartbeat::of_mavlink(autopilot, heartbeat.custom_mode, is_armed);
        Some(AutopilotEvent::Heartbeat(heartbeat))
    }

    fn craft_message(&mut self, message: &MavMessage, received_s: f64, heard: &mut Vec<AutopilotEvent>) {
        let mut measured = |measured| heard.push(AutopilotEvent::of_craft(received_s, measured));
        match message {
            MavMessage::GLOBAL_POSITION_INT(at) => match position(at.lat, at.lon) {
                Some(position) => {
                    measured(CraftMeasurement::Position(position));
                    measured(CraftMeasurement::GroundVelocity(velocity(at)));
                    if at.hdg != HEADING_UNKNOWN {
                        let heading = (f64::from(at.hdg) * CENTIDEGREES).to_radians();
                        measured(CraftMeasurement::Heading(heading));
                    }
                }
                None => self.rejects.count("craft without a position"),
            },
            MavMessage::ATTITUDE(attitude) => {
                let numbers = [attitude.roll, attitude.pitch, attitude.yaw, attitude.yawspeed];
                let [roll, pitch, yaw, rate] = numbers.map(f64::from);
                if !numbers.iter().all(|angle| angle.is_finite()) {
                    self.rejects.count("attitude that is no number");
                }
                if yaw.is_finite() {
                    measured(CraftMeasurement::Heading(yaw));
                }
                if rate.is_finite() {
                    measured(CraftMeasurement::YawRate(rate));
                }
                if roll.is_finite() && pitch.is_finite() {
                    heard.push(AutopilotEvent::Attitude { roll, pitch });
                }
            }
            MavMessage::EKF_STATUS_REPORT(_) => {
                heard.extend(knows_position(message).map(AutopilotEvent::PositionKnown));
            }
            // ArduPilot's filter reports if it knows the position, even for a time without GNSS.
            MavMessage::GPS_RAW_INT(gps) if self.autopilot == Some(Autopilot::Px4) => {
                let has_fix = !matches!(
                    gps.fix_type,
                    GpsFixType::GPS_FIX_TYPE_NO_GPS | GpsFixType::GPS_FIX_TYPE_NO_FIX
                );
                heard.push(AutopilotEvent::PositionKnown(has_fix));
            }
            MavMessage::PARAM_VALUE(parameter) => match parameter.param_id.to_str() {
                Ok(name) => heard
                    .push(AutopilotEvent::Parameter { name: name.to_owned(), value: parameter.param_value }),
                Err(_) => self.rejects.count("name that is no text"),
            },
            MavMessage::STATUSTEXT(text) => match text.text.to_str() {
                Ok(said) => heard.push(AutopilotEvent::Text(said.to_owned())),
                Err(_) => self.rejects.count("status that is no text"),
            },
            // Percent; -1 if the autopilot does not know.
            MavMessage::SYS_STATUS(status) => {
                let percent =
                    Some(f64::from(status.battery_remaining)).filter(|left| (0.0..=100.0).contains(left));
                heard.extend(percent.map(|left| AutopilotEvent::Battery(left / 100.0)));
            }
            // 0 before the first fix.
            MavMessage::SYSTEM_TIME(time) if time.time_unix_usec != 0 => {
                heard.push(AutopilotEvent::Time(Duration::from_micros(time.time_unix_usec).as_secs_f64()));
            }
            MavMessage::AIS_VESSEL(vessel) => {
                heard.push(AutopilotEvent::Measured(Measurement::Vessel(vessel_message(vessel))));
            }
            MavMessage::COMMAND_ACK(answer) => heard.push(AutopilotEvent::Acknowledged {
                command: answer.command as u32,
                is_accepted: answer.result == MavResult::MAV_RESULT_ACCEPTED,
            }),
            _ => {}
        }
    }
}

fn position(lat: i32, lon: i32) -> Option<Origin> {
    on_earth(f64::from(lat) * DEGREES, f64::from(lon) * DEGREES)
}

fn velocity(at: &GLOBAL_POSITION_INT_DATA) -> Vector2<f64> {
    Vector2::new(f64::from(at.vx), f64::from(at.vy)) * METRES_PER_SECOND
}

/// `true` if a filter's status has a known position. Both messages have the same bits.
fn knows_position(message: &MavMessage) -> Option<bool> {
    let flags = match message {
        MavMessage::EKF_STATUS_REPORT(status) => status.flags.bits(),
        MavMessage::ESTIMATOR_STATUS(status) => status.flags.bits(),
        _ => return None,
    };
    let has = |flag: EkfStatusFlags| flags & flag.bits() != 0;
    Some(has(EkfStatusFlags::EKF_POS_HORIZ_ABS) && !has(EkfStatusFlags::EKF_CONST_POS_MODE))
}

/// Depth below the water surface, m, from a height above the home, m, on the surface, or from an
/// altitude above sea level, m, useless in lakes. Without a home the height is 0.
fn depth(above_home: f64, altitude: f64) -> Option<f64> {
    if above_home != 0.0 {
        return Some((-above_home).max(0.0));
    }
    (altitude <= 0.0).then_some(-altitude)
}

fn fix_of_position(auv: &str, at: &GLOBAL_POSITION_INT_DATA, received_s: f64) -> Option<AuvFix> {
    Some(AuvFix {
        depth_m: depth(f64::from(at.relative_alt) * METRES, f64::from(at.alt) * METRES),
        ground_velocity: Some(velocity(at)),
        ..AuvFix::at(auv, received_s, position(at.lat, at.lon)?)
    })
}

/// Reads a vessel that the autopilot heard by AIS. Values without their flag, and headings beyond a
/// circle, are not known.
fn vessel_message(at: &AIS_VESSEL_DATA) -> VesselMessage {
    let valid = |flag: AisFlags, value: f64| at.flags.contains(flag).then_some(value);
    let direction = |centidegrees: f64| {
        let degrees = centidegrees * CENTIDEGREES;
        (degrees < 360.0).then(|| degrees.to_radians())
    };
    let fix = position(at.lat, at.lon).map(|position| VesselFix {
        age_s: at.tslc.into(),
        position,
        course: valid(AisFlags::AIS_FLAGS_VALID_COG, at.COG.into()).and_then(direction),
        speed: valid(AisFlags::AIS_FLAGS_VALID_VELOCITY, f64::from(at.velocity) * METRES_PER_SECOND),
        heading: direction(at.heading.into()),
        status: vessel_status(at.navigational_status as u8),
    });
    let [bow, stern, port, starboard] =
        [at.dimension_bow, at.dimension_stern, at.dimension_port.into(), at.dimension_starboard.into()]
            .map(f64::from);
    let has_length = at.flags.contains(AisFlags::AIS_FLAGS_VALID_DIMENSIONS) && 0.0 < bow + stern;
    let name = at.name.to_str().unwrap_or_default().trim();
    let has_name = at.flags.contains(AisFlags::AIS_FLAGS_VALID_NAME) && !name.is_empty();
    VesselMessage {
        mmsi: at.MMSI,
        is_own: false,
        fix,
        name: has_name.then(|| name.to_owned()),
        dimensions: has_length.then_some([bow, stern, port, starboard]),
    }
}

/// The time is that of arrival: `FOLLOW_TARGET.timestamp` counts from the sender's start.
fn fix_of_target(auv: &str, at: &FOLLOW_TARGET_DATA, received_s: f64) -> Option<AuvFix> {
    if at.est_capabilities & KNOWS_POSITION == 0 {
        return None;
    }
    let [north, east] = [at.vel[0], at.vel[1]].map(f64::from);
    let knows_velocity = at.est_capabilities & KNOWS_VELOCITY != 0 && north.is_finite() && east.is_finite();
    let sigma = f64::from(at.position_cov[0]);
    Some(AuvFix {
        sigma_m: (sigma.is_finite() && sigma > 0.0).then_some(sigma),
        depth_m: depth(0.0, f64::from(at.alt)),
        ground_velocity: knows_velocity.then(|| Vector2::new(north, east)),
        ..AuvFix::at(auv, received_s, position(at.lat, at.lon)?)
    })
}

/// Bytes from [`MavlinkReader::push`] for the crate's frame reader, which owns its source.
#[derive(Clone, Debug, Default)]
struct Feed(Arc<Mutex<VecDeque<u8>>>);

impl Feed {
    fn extend(&self, bytes: &[u8]) {
        self.0.lock().extend(bytes);
    }
}

impl Read for Feed {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        self.0.lock().read(into)
    }
}
