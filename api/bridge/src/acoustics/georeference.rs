//! From an observation to a fix: names, lever arm, attitude, travel time, depth.

use std::{collections::BTreeMap, f64::consts::PI, ops::RangeInclusive};

use geodesy::Datum;
use nalgebra::{Rotation3, Vector3};

use super::depth_intersection::{NO_DEPTH, intersect, intersection_sigma};
use super::mounting::{Mounting, attitude};
use super::observation::{Axes, Location, NO_POSITION, Observation, SignalTime};
use super::pose::{CraftPose, PoseHistory};
use super::settings::{Settings, UnusableSettings};
use crate::{AuvFix, Origin, Parsed, on_earth, reject_if};

const CLOCK: &str = "the modem's clock and ours differ";
const LOCAL_TIME: &str = "the modem's clock is on local time, not UTC";
const NO_POSE: &str = "no pose of the craft at that time";
const NO_MOUNTING: &str = "mounting is not set";
const TOO_FAR: &str = "farther than sound carries";

/// Farthest AUV, greatest depth and worst accuracy accepted, m, against damaged numbers.
const REACH_M: f64 = 20_000.0;

/// Least slant range accepted, m.
const RANGE_MIN_M: f64 = 0.1;

/// Longest use of a depth, s. An AUV at 0.3 m/s and 50° of pitch dives 2.3 m in it.
const DEPTH_KEPT_S: f64 = 10.0;

/// Most AUVs whose depths are kept, so that names on a wire do not fill the memory.
const DEPTHS_MAX: usize = 64;

/// Greatest delay from a fix to the arrival of its bytes, s. Modems answer within seconds.
const BEHIND_MAX_S: f64 = 60.0;

/// Greatest lead of a fix over its bytes, s: clocks set by GNSS or NTP differ by less.
const AHEAD_MAX_S: f64 = 1.0;

/// Steps of time zones and the farthest one, s, and the greatest delay of a fix with a local time.
const ZONE_STEP_S: f64 = 900.0;
const ZONE_MAX_S: f64 = 14.0 * 3600.0;
const ZONE_BEHIND_MAX_S: f64 = 10.0;

/// Greatest length of a lever arm, m: no craft is longer.
const LEVER_MAX_M: f64 = 500.0;

/// Accepted speeds of sound, m/s; at the surface, 1402 in fresh water at 0 °C, 1546 in sea water at
/// 30 °C. Source: Chen and Millero, J. Acoust. Soc. Am. 62 (1977), doi:10.1121/1.381646.
const SOUND_SPEED_MPS: RangeInclusive<f64> = 1_380.0..=1_620.0;

#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct KnownDepth {
    pub(crate) t_s: f64,
    pub(crate) depth_m: f64,
    pub(crate) sigma_m: f64,
}

#[derive(Debug)]
pub(super) struct Georeference {
    names: BTreeMap<String, String>,
    mounting: Option<Mounting>,
    sound_speed: f64,
    sigma_m: Option<f64>,
    declination: f64,
    depths: BTreeMap<String, KnownDepth>,
}

impl Georeference {
    pub(super) fn new(settings: &Settings) -> Result<Self, UnusableSettings> {
        let (speed, declination) = (settings.sound_speed_mps, settings.magnetic_declination_rad);
        let sigma = settings.sigma_m.unwrap_or(REACH_M);
        let mounting = settings.mounting;
        let lever = mounting.map_or(0.0, |mounting| mounting.lever().norm());
        let [roll, pitch, heading] = mounting.map_or([0.0; 3], |mounting| mounting.angles());
        let depth = mounting.and_then(|mounting| mounting.depth_m).unwrap_or(0.0);
        let (positive, finite) = (f64::MIN_POSITIVE..=REACH_M, f64::MIN..=f64::MAX);
        let (length, depths) = (0.0..=LEVER_MAX_M, -LEVER_MAX_M..=LEVER_MAX_M);
        let (slowest, fastest) = SOUND_SPEED_MPS.into_inner();
        let water = format!("a speed in water, {slowest} to {fastest} m/s");
        let reach = format!("positive and at most {REACH_M}");
        let [lever_max, depth_max] = ["at most ", "within ±"].map(|most| format!("{most}{LEVER_MAX_M} m"));
        for (name, value, range, must) in [
            ("sound_speed_mps", speed, SOUND_SPEED_MPS, &*water),
            ("magnetic_declination_rad", declination, -PI..=PI, "within ±π"),
            ("sigma_m", sigma, positive, &*reach),
            ("mounting: its length", lever, length, &*lever_max),
            ("mounting: an angle", roll + pitch + heading, finite, "a number"),
            ("mounting.depth_m", depth, depths, &*depth_max),
        ] {
            if !range.contains(&value) {
                return Err(UnusableSettings(format!("{name} is {value}; it must be {must}")));
            }
        }
        Ok(Self {
            names: settings.names.clone(),
            mounting,
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

    /// The fix of `observation`, whose line arrived at `received_s`, or the reason for none.
    pub(super) fn fix(
        &self,
        observation: &Observation,
        received_s: f64,
        poses: &PoseHistory,
    ) -> Parsed<AuvFix> {
        let name = self.names.get(&observation.address).cloned();
        let auv = name.unwrap_or_else(|| format!("usbl-{}", observation.address));
        let mut range_m = None;
        let (t_s, position, depth_m, sigma_m) = match observation.location {
            Location::Geographic(position) => (self.times(observation, 0.0).1, position, None, None),
            Location::Vector { axes, vector, has_depth } => {
                let (arrival_s, t_s) = self.times(observation, vector.norm());
                let (mounting, pose) = self.craft(poses, arrival_s, received_s)?;
                let sight = self.ned_from(axes, mounting, &pose) * vector;
                let transducer = observation.transducer_depth_m.or(mounting.depth_m);
                let depth = transducer.filter(|_| has_depth).map(|depth| depth + sight.z);
                (t_s, place(mounting, &pose, &sight)?, depth, None)
            }
            Location::Direction { axes, unit, sigma_rad } => {
                let (arrival_s, _) = self.times(observation, 0.0);
                let (mounting, pose) = self.craft(poses, arrival_s, received_s)?;
                let direction = self.ned_from(axes, mounting, &pose) * unit;
                let known = self.depths.get(&auv);
                let known = known.filter(|known| (known.t_s - arrival_s).abs() <= DEPTH_KEPT_S);
                let transducer = observation.transducer_depth_m.or(mounting.depth_m);
                let (known, transducer) = known.zip(transducer).ok_or(NO_DEPTH)?;
                let sight = intersect(&direction, known.depth_m - transducer)?;
                let sigma = intersection_sigma(&sight, sigma_rad, known.sigma_m);
                let (_, t_s) = self.times(observation, sight.norm());
                (t_s, place(mounting, &pose, &sight)?, Some(known.depth_m), Some(sigma))
            }
            Location::Range(range) => {
                reject_if(range < RANGE_MIN_M, NO_POSITION)?;
                reject_if(!(RANGE_MIN_M..=REACH_M).contains(&range), TOO_FAR)?;
                let (arrival_s, t_s) = self.times(observation, range);
                let (mounting, pose) = self.craft(poses, arrival_s, received_s)?;
                let known = self.depths.get(&auv);
                let known = known.filter(|known| (known.t_s - arrival_s).abs() <= DEPTH_KEPT_S);
                range_m = Some(range);
                (t_s, end_of(mounting, &pose, &Vector3::zeros())?, known.map(|known| known.depth_m), None)
            }
        };
        check_clock(t_s, received_s)?;
        // A modem that prints 0 states no accuracy.
        let stated = observation.sigma_m.or(sigma_m).filter(|sigma| *sigma > 0.0);
        let (sigma_m, depth_m) = (stated.or(self.sigma_m), observation.depth_m.or(depth_m));
        let is_plausible = |metres: Option<f64>| metres.is_none_or(|metres| metres.abs() <= REACH_M);
        reject_if(!is_plausible(sigma_m) || !is_plausible(depth_m), TOO_FAR)?;
        Ok(AuvFix { auv, t_s, position, range_m, sigma_m, depth_m, ground_velocity: None })
    }

    /// Times of arrival and sending of a signal from an AUV at `distance`, m.
    fn times(&self, observation: &Observation, distance: f64) -> (f64, f64) {
        let travel = observation.travel_s.unwrap_or(distance / self.sound_speed);
        match observation.time {
            SignalTime::Arrived(arrival_s) => (arrival_s, arrival_s - travel),
            SignalTime::Sent(sent_s) => (sent_s + travel, sent_s),
        }
    }

    fn craft(&self, poses: &PoseHistory, arrival_s: f64, received_s: f64) -> Parsed<(&Mounting, CraftPose)> {
        let mounting = self.mounting.as_ref().ok_or(NO_MOUNTING)?;
        let pose = poses.at(arrival_s);
        // A wrong clock is the reason for a missing pose.
        let pose = pose.ok_or_else(|| check_clock(arrival_s, received_s).err().unwrap_or(NO_POSE))?;
        Ok((mounting, pose))
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

/// Fails if a modem's time `t_s` contradicts the arrival of its bytes, as local time or otherwise.
fn check_clock(t_s: f64, received_s: f64) -> Parsed<()> {
    let behind = received_s - t_s;
    if (-AHEAD_MAX_S..=BEHIND_MAX_S).contains(&behind) {
        return Ok(());
    }
    let delay = (behind + AHEAD_MAX_S).rem_euclid(ZONE_STEP_S) - AHEAD_MAX_S;
    if behind.abs() <= ZONE_MAX_S + ZONE_BEHIND_MAX_S && delay <= ZONE_BEHIND_MAX_S {
        Err(LOCAL_TIME)
    } else {
        Err(CLOCK)
    }
}

fn ned_from_craft(pose: &CraftPose) -> Rotation3<f64> {
    attitude(pose.roll, pose.pitch, pose.heading)
}

/// The position of the far end of `sight` (north, east, down from the transducer, m).
fn place(mounting: &Mounting, pose: &CraftPose, sight: &Vector3<f64>) -> Parsed<Origin> {
    let length = sight.norm();
    reject_if(length == 0.0, NO_POSITION)?;
    reject_if(!(0.0..=REACH_M).contains(&length), TOO_FAR)?;
    end_of(mounting, pose, sight)
}

/// The position at the far end of `sight`, of any length: of 0, that of the transducer.
fn end_of(mounting: &Mounting, pose: &CraftPose, sight: &Vector3<f64>) -> Parsed<Origin> {
    let from_reference = ned_from_craft(pose) * mounting.lever() + sight;
    let datum = Datum::new(&pose.position.into()).map_err(|_| NO_POSE)?;
    let place = Origin::from(datum.from_local(&from_reference.xy()));
    // Degrees to radians and back may round beyond the antimeridian.
    on_earth(place.lat_deg, place.lon_deg.clamp(-180.0, 180.0)).ok_or(TOO_FAR)
}
