//! From a sighting to a fix: names, lever arm, attitude, travel time, depth.

use std::collections::BTreeMap;

use geodesy::{Datum, Origin};
use nalgebra::{Rotation3, Vector3};

use super::{
    Mounting, Settings, UnusableSettings,
    cut::{NO_DEPTH, cut, cut_sigma},
    mounting::attitude,
    pose::{CraftPose, PoseHistory},
    sighting::{Axes, CLOCK, Clock, NO_POSITION, Place, Sighting},
};
use crate::{AuvFix, Geographic};

const NO_POSE: &str = "no pose of the craft at that time";
const NO_MOUNTING: &str = "mounting is not set";
const TOO_FAR: &str = "farther than sound carries";

/// Farthest AUV, greatest depth and worst accuracy believed, m: a bound against damaged numbers.
const REACH_M: f64 = 20_000.0;

/// How long a depth is believed, s. An AUV at 0.3 m/s and 50° of pitch dives 2.3 m in it.
const DEPTH_KEPT_S: f64 = 10.0;

/// How many AUVs' depths are kept, so that names on a wire do not fill the memory.
const DEPTHS_MAX: usize = 64;

/// Farthest that a fix may lie behind the arrival of its bytes, s. Answers are told within seconds.
const BEHIND_MAX_S: f64 = 60.0;

/// Farthest that a fix may lie ahead of the arrival of its bytes, s: two clocks that GNSS or NTP set differ by less.
const AHEAD_MAX_S: f64 = 1.0;

/// Greatest length of a lever arm, m: no craft is longer.
const LEVER_MAX_M: f64 = 500.0;

/// Speeds of sound believed, m/s: from 1402 m/s in fresh water at 0 °C to 1546 m/s in sea water at 30 °C, both at the
/// surface, and wider. Source: Chen and Millero, J. Acoust. Soc. Am. 62 (1977), doi:10.1121/1.381646.
const SOUND_SPEED_MPS: std::ops::RangeInclusive<f64> = 1_380.0..=1_620.0;

/// A depth that is known from elsewhere.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KnownDepth {
    /// When it was so, s of Unix time.
    pub t_s: f64,
    /// Depth, m, positive down.
    pub depth_m: f64,
    /// Its standard deviation, m.
    pub sigma_m: f64,
}

/// What places a sighting on Earth.
#[derive(Debug)]
pub(super) struct Site {
    names: BTreeMap<String, String>,
    mounting: Option<Mounting>,
    sound_speed: f64,
    sigma_m: Option<f64>,
    declination: f64,
    depths: BTreeMap<String, KnownDepth>,
}

impl Site {
    pub(super) fn new(settings: &Settings) -> Result<Self, UnusableSettings> {
        let within = |name, value: f64, right: bool, must| {
            let refused = UnusableSettings::OutOfRange { name, value, must };
            if right { Ok(()) } else { Err(refused) }
        };
        let speed = settings.sound_speed_mps;
        let in_water = SOUND_SPEED_MPS.contains(&speed);
        within(
            "sound_speed_mps",
            speed,
            in_water,
            "a speed in water, 1380 to 1620 m/s",
        )?;
        let declination = settings.magnetic_declination_rad;
        let turn = declination.abs() <= std::f64::consts::PI;
        within("magnetic_declination_rad", declination, turn, "within ±π")?;
        if let Some(sigma) = settings.sigma_m {
            within("sigma_m", sigma, 0.0 < sigma && sigma <= REACH_M, "positive")?;
        }
        if let Some(mounting) = &settings.mounting {
            let lever = mounting.lever().norm();
            within(
                "mounting: its length",
                lever,
                lever <= LEVER_MAX_M,
                "at most 500 m",
            )?;
            let turns = [
                mounting.heading_offset_rad,
                mounting.pitch_offset_rad,
                mounting.roll_offset_rad,
            ];
            for angle in turns {
                within("mounting: an angle", angle, angle.is_finite(), "a number")?;
            }
            let depth = mounting.depth_m.unwrap_or(0.0);
            within(
                "mounting.depth_m",
                depth,
                depth.abs() <= LEVER_MAX_M,
                "within ±500 m",
            )?;
        }
        Ok(Self {
            names: settings.names.clone(),
            mounting: settings.mounting,
            sound_speed: speed,
            sigma_m: settings.sigma_m,
            declination,
            depths: BTreeMap::new(),
        })
    }

    pub(super) fn note_depth(&mut self, auv: &str, depth: KnownDepth) {
        let numbers = [depth.t_s, depth.depth_m, depth.sigma_m];
        let usable = numbers.iter().all(|number| number.is_finite()) && depth.sigma_m >= 0.0;
        let known = self.depths.contains_key(auv);
        if usable && (known || self.depths.len() < DEPTHS_MAX) {
            self.depths.insert(auv.to_owned(), depth);
        }
    }

    /// The fix of `sighting`, whose line arrived at `received_s`, or why there is none.
    pub(super) fn fix(
        &self,
        sighting: &Sighting,
        received_s: f64,
        poses: &PoseHistory,
    ) -> Result<AuvFix, &'static str> {
        let auv = match self.names.get(&sighting.address) {
            Some(name) => name.clone(),
            None => format!("usbl-{}", sighting.address),
        };
        let placed = match &sighting.place {
            Place::Geographic(position) => Placed {
                position: *position,
                t_s: self.times(sighting, 0.0).1,
                depth_m: None,
                sigma_m: None,
            },
            Place::Vector {
                axes,
                vector,
                tells_depth,
            } => {
                let placed = self.along(sighting, *axes, vector, poses)?;
                Placed {
                    depth_m: placed.depth_m.filter(|_| *tells_depth),
                    ..placed
                }
            }
            Place::Direction {
                axes,
                unit,
                sigma_rad,
            } => self.down_to(self.depths.get(&auv), sighting, *axes, unit, *sigma_rad, poses)?,
        };
        if !(-AHEAD_MAX_S..=BEHIND_MAX_S).contains(&(received_s - placed.t_s)) {
            return Err(CLOCK);
        }
        // A modem that prints 0 tells no accuracy.
        let told = sighting.sigma_m.or(placed.sigma_m).filter(|sigma| *sigma > 0.0);
        let fix = AuvFix {
            auv,
            t_s: placed.t_s,
            position: placed.position,
            sigma_m: told.or(self.sigma_m),
            depth_m: sighting.depth_m.or(placed.depth_m),
            ground_velocity: None,
        };
        let believed = |metres: Option<f64>| metres.is_none_or(|metres| metres.abs() <= REACH_M);
        if believed(fix.sigma_m) && believed(fix.depth_m) {
            Ok(fix)
        } else {
            Err(TOO_FAR)
        }
    }

    /// At the end of `vector`.
    fn along(
        &self,
        sighting: &Sighting,
        axes: Axes,
        vector: &Vector3<f64>,
        poses: &PoseHistory,
    ) -> Result<Placed, &'static str> {
        let (arrival_s, t_s) = self.times(sighting, vector.norm());
        let (mounting, pose) = self.craft(poses, arrival_s)?;
        let sight = self.ned_from(axes, mounting, &pose) * vector;
        let transducer = sighting.transducer_depth_m.or(mounting.depth_m);
        Ok(Placed {
            position: place(mounting, &pose, &sight)?,
            t_s,
            depth_m: transducer.map(|depth| depth + sight.z),
            sigma_m: None,
        })
    }

    /// Where the line along `unit` reaches the depth that is `known`.
    fn down_to(
        &self,
        known: Option<&KnownDepth>,
        sighting: &Sighting,
        axes: Axes,
        unit: &Vector3<f64>,
        sigma_rad: Option<f64>,
        poses: &PoseHistory,
    ) -> Result<Placed, &'static str> {
        let (arrival_s, _) = self.times(sighting, 0.0);
        let (mounting, pose) = self.craft(poses, arrival_s)?;
        let direction = self.ned_from(axes, mounting, &pose) * unit;
        let fresh = known.filter(|known| (known.t_s - arrival_s).abs() <= DEPTH_KEPT_S);
        let transducer = sighting.transducer_depth_m.or(mounting.depth_m);
        let (known, transducer) = fresh.zip(transducer).ok_or(NO_DEPTH)?;
        let sight = cut(&direction, known.depth_m - transducer)?;
        Ok(Placed {
            position: place(mounting, &pose, &sight)?,
            t_s: self.times(sighting, sight.norm()).1,
            depth_m: Some(known.depth_m),
            sigma_m: sigma_rad.map(|angle| cut_sigma(&sight, angle, known.sigma_m)),
        })
    }

    /// When the signal arrived and when it was sent, from an AUV at `distance`, m.
    fn times(&self, sighting: &Sighting, distance: f64) -> (f64, f64) {
        let travel = sighting.travel_s.unwrap_or(distance / self.sound_speed);
        match sighting.clock {
            Clock::Arrived(arrival_s) => (arrival_s, arrival_s - travel),
            Clock::Sent(sent_s) => (sent_s + travel, sent_s),
        }
    }

    fn craft(&self, poses: &PoseHistory, arrival_s: f64) -> Result<(&Mounting, CraftPose), &'static str> {
        let mounting = self.mounting.as_ref().ok_or(NO_MOUNTING)?;
        Ok((mounting, poses.at(arrival_s).ok_or(NO_POSE)?))
    }

    /// Turns vectors with these axes to north, east, down.
    fn ned_from(&self, axes: Axes, mounting: &Mounting, pose: &CraftPose) -> Rotation3<f64> {
        match axes {
            Axes::Transducer => ned_from_craft(pose) * mounting.craft_from_transducer(),
            Axes::HeadUp => attitude(0.0, 0.0, pose.heading),
            Axes::Magnetic => attitude(0.0, 0.0, self.declination),
            Axes::North => Rotation3::identity(),
        }
    }
}

struct Placed {
    position: Geographic,
    t_s: f64,
    depth_m: Option<f64>,
    sigma_m: Option<f64>,
}

fn ned_from_craft(pose: &CraftPose) -> Rotation3<f64> {
    attitude(pose.roll, pose.pitch, pose.heading)
}

/// Where the far end of `sight` (north, east, down from the transducer, m) is.
fn place(mounting: &Mounting, pose: &CraftPose, sight: &Vector3<f64>) -> Result<Geographic, &'static str> {
    let length = sight.norm();
    if length == 0.0 {
        return Err(NO_POSITION);
    }
    if !(0.0..=REACH_M).contains(&length) {
        return Err(TOO_FAR);
    }
    let from_reference = ned_from_craft(pose) * mounting.lever() + sight;
    let origin = Origin {
        latitude: pose.position.lat_deg.to_radians(),
        longitude: pose.position.lon_deg.to_radians(),
    };
    let datum = Datum::new(&origin).map_err(|_| NO_POSE)?;
    let place = datum.from_local(&from_reference.xy());
    // Degrees to radians and back may round beyond the antimeridian.
    let lon_deg = place.longitude.to_degrees().clamp(-180.0, 180.0);
    Geographic::new(place.latitude.to_degrees(), lon_deg).ok_or(TOO_FAR)
}
