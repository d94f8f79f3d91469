//! Bytes of a MAVLink stream → what was heard.

use std::{
    collections::{BTreeMap, VecDeque},
    fmt,
    io::{self, Read},
    sync::{Arc, Mutex, PoisonError},
    time::Duration,
};

use ::mavlink::{
    MAVLinkMessageRaw, MavlinkReader as FrameReader, Message as _,
    dialects::ardupilotmega::{
        EkfStatusFlags, FOLLOW_TARGET_DATA, GLOBAL_POSITION_INT_DATA, GpsFixType, HEARTBEAT_DATA,
        MavAutopilot, MavMessage, MavModeFlag, MavResult,
    },
};
use nalgebra::Vector2;

use super::autopilot::{Autopilot, Heartbeat};
use crate::{AuvFix, CraftMeasurement, Geographic, Measurement, Refused};

/// What one message said.
#[derive(Clone, Debug, PartialEq)]
pub enum Heard {
    /// Of the surface craft, or of an AUV.
    Measured(Measurement),
    /// The craft's autopilot lives.
    Heartbeat(Heartbeat),
    /// A parameter of the craft's autopilot.
    Parameter {
        /// Its name.
        name: String,
        /// Its value.
        value: f32,
    },
    /// What the craft's autopilot says to people.
    Text(String),
    /// The craft's autopilot carried out a command, or did not.
    Acknowledged {
        /// MAVLink's number of the command.
        command: u32,
        /// Whether it was carried out.
        is_accepted: bool,
    },
    /// Whether the craft's autopilot knows where it is.
    PositionKnown(bool),
    /// The time by the craft's autopilot, s of Unix time.
    Time(f64),
    /// Roll and pitch of the craft, rad, positive starboard down and nose up.
    Attitude {
        /// Roll, rad.
        roll: f64,
        /// Pitch, rad.
        pitch: f64,
    },
}

/// Reads a stream in whatever pieces it comes.
///
/// What the craft says is taken from its autopilot alone (component 1); AUVs are other systems, each by its number.
pub struct MavlinkReader {
    frames: FrameReader<Feed>,
    feed: Feed,
    /// Bytes that are in no frame yet, and those of the frames read since.
    pending: usize,
    framed: usize,
    craft: Option<u8>,
    autopilot: Option<Autopilot>,
    auvs: BTreeMap<u8, String>,
    refused: Refused,
}

/// Longest frame, bytes: what may wait for its end.
const FRAME_BYTES_MAX: usize = 280;
/// Component number of an autopilot. Source: MAVLink, `MAV_COMP_ID_AUTOPILOT1`.
const AUTOPILOT: u8 = 1;
/// Unknown heading in `GLOBAL_POSITION_INT`, centidegrees.
const HEADING_UNKNOWN: u16 = u16::MAX;
/// Positions and velocities that are no craft's: the unit is 1e-7 degrees, and 0, 0 is what an autopilot sends that has no
/// position.
const DEGREES: f64 = 1e-7;
const METRES_PER_SECOND: f64 = 0.01;
const CENTIDEGREES: f64 = 0.01;
const METRES: f64 = 0.001;
/// Bits of `FOLLOW_TARGET.est_capabilities`: position, velocity.
const KNOWS_POSITION: u8 = 1;
const KNOWS_VELOCITY: u8 = 2;

impl fmt::Debug for MavlinkReader {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut shown = f.debug_struct("MavlinkReader");
        shown.field("craft", &self.craft).field("auvs", &self.auvs);
        // The crate's reader of frames shows nothing of itself.
        shown.field("refused", &self.refused).finish_non_exhaustive()
    }
}

impl MavlinkReader {
    /// A reader for the craft `system`, or the first autopilot that is heard where none is given, and AUVs by the numbers
    /// of their systems.
    #[must_use]
    pub fn new(system: Option<u8>, auvs: BTreeMap<u8, String>) -> Self {
        let feed = Feed::default();
        Self {
            frames: FrameReader::new(feed.clone()),
            feed,
            pending: 0,
            framed: 0,
            craft: system,
            autopilot: None,
            auvs,
            refused: Refused::default(),
        }
    }

    /// The craft's system number, once it is known.
    #[must_use]
    pub fn craft(&self) -> Option<u8> {
        self.craft
    }

    /// What was not understood, or not believed.
    #[must_use]
    pub fn refused(&self) -> &Refused {
        &self.refused
    }

    /// What `bytes`, which came at `received_s`, s of Unix time, complete.
    pub fn push(&mut self, bytes: &[u8], received_s: f64) -> Vec<Heard> {
        self.feed.extend(bytes);
        self.pending += bytes.len();
        let mut heard = vec![];
        // The only failure is that the feed is empty.
        while let Ok(raw) = self.frames.read_any_raw_message::<MavMessage>() {
            let length = match &raw {
                MAVLinkMessageRaw::V1(frame) => frame.raw_bytes().len(),
                MAVLinkMessageRaw::V2(frame) => frame.raw_bytes().len(),
            };
            self.framed += length;
            match MavMessage::parse(raw.version(), raw.message_id(), raw.payload()) {
                Ok(message) => self.take(&raw, &message, received_s, &mut heard),
                Err(_) => self.refused.count("message out of its ranges"),
            }
        }
        self.count_strays();
        heard
    }

    /// Counts what was in no frame, but for what may be the beginning of the next one.
    fn count_strays(&mut self) {
        let stray = self.pending.saturating_sub(self.framed + FRAME_BYTES_MAX);
        self.refused.add("byte of no whole frame", stray as u64);
        self.pending -= stray + self.framed.min(self.pending - stray);
        self.framed = 0;
    }

    fn take(
        &mut self,
        raw: &MAVLinkMessageRaw,
        message: &MavMessage,
        received_s: f64,
        heard: &mut Vec<Heard>,
    ) {
        let component = raw.component_id();
        let Ok(system) = u8::try_from(raw.system_id()) else {
            return self.refused.count("system number above 255");
        };
        if let MavMessage::HEARTBEAT(heartbeat) = message {
            if let Some(heartbeat) = self.heartbeat(system, component, heartbeat) {
                heard.push(Heard::Heartbeat(heartbeat));
            }
            return;
        }
        if self.craft == Some(system) && component == AUTOPILOT {
            self.craft_message(message, received_s, heard);
        } else if let Some(auv) = self.auvs.get(&system).cloned() {
            let fix = match message {
                MavMessage::GLOBAL_POSITION_INT(at) => fix_of_position(auv, at, received_s),
                MavMessage::FOLLOW_TARGET(at) => fix_of_target(auv, at, received_s),
                _ => return,
            };
            match fix {
                Some(fix) => heard.push(Heard::Measured(Measurement::Auv(fix))),
                None => self.refused.count("AUV without a position"),
            }
        }
    }

    /// An autopilot's: others, such as ground stations, have heartbeats too.
    fn heartbeat(&mut self, system: u8, component: u8, heartbeat: &HEARTBEAT_DATA) -> Option<Heartbeat> {
        let autopilot = match heartbeat.autopilot {
            MavAutopilot::MAV_AUTOPILOT_ARDUPILOTMEGA => Autopilot::ArduPilot,
            MavAutopilot::MAV_AUTOPILOT_PX4 => Autopilot::Px4,
            _ => return None,
        };
        if component != AUTOPILOT || self.auvs.contains_key(&system) {
            return None;
        }
        if *self.craft.get_or_insert(system) != system {
            self.refused.count("another craft's heartbeat");
            return None;
        }
        self.autopilot = Some(autopilot);
        Some(Heartbeat {
            autopilot,
            mode: heartbeat.custom_mode,
            is_armed: heartbeat
                .base_mode
                .contains(MavModeFlag::MAV_MODE_FLAG_SAFETY_ARMED),
        })
    }

    fn craft_message(&mut self, message: &MavMessage, received_s: f64, heard: &mut Vec<Heard>) {
        let mut measured = |measured| {
            heard.push(Heard::Measured(Measurement::Craft {
                t_s: received_s,
                measured,
            }));
        };
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
                None => self.refused.count("craft without a position"),
            },
            MavMessage::ATTITUDE(attitude) => {
                let [roll, pitch, yaw, rate] =
                    [attitude.roll, attitude.pitch, attitude.yaw, attitude.yawspeed].map(f64::from);
                if [roll, pitch, yaw, rate].iter().all(|angle| angle.is_finite()) {
                    measured(CraftMeasurement::Heading(yaw));
                    measured(CraftMeasurement::YawRate(rate));
                    heard.push(Heard::Attitude { roll, pitch });
                } else {
                    self.refused.count("attitude that is no number");
                }
            }
            MavMessage::EKF_STATUS_REPORT(status) => {
                let knows = status.flags.contains(EkfStatusFlags::EKF_POS_HORIZ_ABS)
                    && !status.flags.contains(EkfStatusFlags::EKF_CONST_POS_MODE);
                heard.push(Heard::PositionKnown(knows));
            }
            // ArduPilot's filter says itself what it knows, and for how long it goes on without GNSS.
            MavMessage::GPS_RAW_INT(gps) if self.autopilot == Some(Autopilot::Px4) => {
                let has_fix = !matches!(
                    gps.fix_type,
                    GpsFixType::GPS_FIX_TYPE_NO_GPS | GpsFixType::GPS_FIX_TYPE_NO_FIX
                );
                heard.push(Heard::PositionKnown(has_fix));
            }
            MavMessage::PARAM_VALUE(parameter) => match parameter.param_id.to_str() {
                Ok(name) => heard.push(Heard::Parameter {
                    name: name.to_owned(),
                    value: parameter.param_value,
                }),
                Err(_) => self.refused.count("name that is no text"),
            },
            MavMessage::STATUSTEXT(text) => match text.text.to_str() {
                Ok(said) => heard.push(Heard::Text(said.to_owned())),
                Err(_) => self.refused.count("status that is no text"),
            },
            // 0 before the first fix.
            MavMessage::SYSTEM_TIME(time) if time.time_unix_usec != 0 => {
                heard.push(Heard::Time(
                    Duration::from_micros(time.time_unix_usec).as_secs_f64(),
                ));
            }
            MavMessage::COMMAND_ACK(answer) => heard.push(Heard::Acknowledged {
                command: answer.command as u32,
                is_accepted: answer.result == MavResult::MAV_RESULT_ACCEPTED,
            }),
            _ => {}
        }
    }
}

fn position(lat: i32, lon: i32) -> Option<Geographic> {
    if (lat, lon) == (0, 0) {
        return None;
    }
    Geographic::new(f64::from(lat) * DEGREES, f64::from(lon) * DEGREES)
}

fn velocity(at: &GLOBAL_POSITION_INT_DATA) -> Vector2<f64> {
    Vector2::new(f64::from(at.vx), f64::from(at.vy)) * METRES_PER_SECOND
}

/// Depth, m, of an altitude above mean sea level, m: none above the surface.
fn depth(altitude: f64) -> Option<f64> {
    altitude.is_finite().then(|| (-altitude).max(0.0))
}

fn fix_of_position(auv: String, at: &GLOBAL_POSITION_INT_DATA, received_s: f64) -> Option<AuvFix> {
    Some(AuvFix {
        auv,
        t_s: received_s,
        position: position(at.lat, at.lon)?,
        sigma_m: None,
        depth_m: depth(f64::from(at.alt) * METRES),
        ground_velocity: Some(velocity(at)),
    })
}

/// `FOLLOW_TARGET.timestamp` counts from the sender's start, so that the time is that of its arrival.
fn fix_of_target(auv: String, at: &FOLLOW_TARGET_DATA, received_s: f64) -> Option<AuvFix> {
    if at.est_capabilities & KNOWS_POSITION == 0 {
        return None;
    }
    let [north, east] = [at.vel[0], at.vel[1]].map(f64::from);
    let knows_velocity = at.est_capabilities & KNOWS_VELOCITY != 0 && north.is_finite() && east.is_finite();
    let sigma = f64::from(at.position_cov[0]);
    Some(AuvFix {
        auv,
        t_s: received_s,
        position: position(at.lat, at.lon)?,
        sigma_m: (sigma.is_finite() && sigma > 0.0).then_some(sigma),
        depth_m: depth(f64::from(at.alt)),
        ground_velocity: knows_velocity.then(|| Vector2::new(north, east)),
    })
}

/// Bytes on their way from [`MavlinkReader::push`] to the crate's reader of frames, which owns its source.
#[derive(Clone, Debug, Default)]
struct Feed(Arc<Mutex<VecDeque<u8>>>);

impl Feed {
    fn extend(&self, bytes: &[u8]) {
        self.0
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .extend(bytes);
    }
}

impl Read for Feed {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).read(into)
    }
}
