//! Odometry into measurements, references into messages: no socket, no clock.

use geodesy::{Datum, NotOnEarth, Origin};

use super::{
    frames::{Motion, level_pose, level_twist},
    messages::{Header, Odometry, Path, PoseStamped, Stamp, TwistStamped},
};
use crate::{
    AuvFix, CraftMeasurement, Geographic, Measurement, Refused,
    reference::{PlannedReference, Reference, wrapped},
};

/// How a heading reference becomes a turn rate: the craft's own heading loop, for a craft that has none.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HeadingLoop {
    /// Time constant T of T ψ̇ = ψ_ref − ψ, s: `heading_loop.time_constant_s` of the craft.
    pub time_constant_s: f64,
    /// Fastest turn, rad/s: `heading_loop.rate_max_radps` of the craft.
    pub rate_max_radps: f64,
}

impl Default for HeadingLoop {
    /// T and r_max of the MEDUSA class: 2ζ/ω = 1 s and 0.3 rad/s (`Craft::MEDUSA` of the planner).
    fn default() -> Self {
        Self {
            time_constant_s: 1.0,
            rate_max_radps: 0.3,
        }
    }
}

/// Between messages of ROS and Pilotfish's measurements and references, for one map.
#[derive(Clone, Debug)]
pub struct Conversion {
    datum: Datum,
    map_frame: String,
    base_frame: String,
    heading_loop: HeadingLoop,
    /// The craft's last heading: when, s of Unix time, and which, rad.
    heading: Option<(f64, f64)>,
}

/// Map coordinates are taken as distances and directions from the origin on the ellipsoid. A tangent plane differs from
/// that by s³/(6 R²), 4 m at 100 km, and north at the origin from true north by s tan φ/R, 0.9° there at 45° of latitude.
const MAP_RADIUS_MAX_M: f64 = 100e3;

/// A stamp may be this much older than its arrival: a position that came over an acoustic link and through a filter.
const AGE_MAX_S: f64 = 60.0;

/// A stamp may be this much ahead of its arrival: the error of clocks synchronised by NTP over a radio link.
const AHEAD_MAX_S: f64 = 0.5;

/// Oldest heading from which a turn rate is computed: at r_max = 0.3 rad/s the bow turns 17° in this time.
const HEADING_AGE_MAX_S: f64 = 1.0;

impl Conversion {
    /// The conversion for a map of which `origin` is the origin. `map_frame` and `base_frame` are the names of the map's
    /// and of the craft's own frame.
    pub fn new(
        origin: Geographic,
        (map_frame, base_frame): (String, String),
        heading_loop: HeadingLoop,
    ) -> Result<Self, NotOnEarth> {
        Ok(Self {
            datum: Datum::new(&radians(origin))?,
            map_frame,
            base_frame,
            heading_loop,
            heading: None,
        })
    }

    /// The measurements in `odometry` of the craft, which arrived at `received_s` of Unix time.
    ///
    /// The twist is the pose's rate of change, so it is a velocity over ground and never one through the water.
    pub fn craft(&mut self, odometry: &Odometry, received_s: f64, refused: &mut Refused) -> Vec<Measurement> {
        let Some((motion, position)) = self.motion(odometry, refused) else {
            return Vec::new();
        };
        let t_s = stamped(odometry.header.stamp, received_s, refused);
        self.heading = Some((t_s, motion.heading()));
        let ground_velocity = motion.ground_velocity().map(CraftMeasurement::GroundVelocity);
        let yaw_rate = motion
            .twist
            .as_ref()
            .map(|twist| CraftMeasurement::YawRate(twist.rates.z));
        let pose = [
            CraftMeasurement::Position(position),
            CraftMeasurement::Heading(motion.heading()),
        ];
        pose.into_iter()
            .chain(ground_velocity)
            .chain(yaw_rate)
            .map(|measured| Measurement::Craft { t_s, measured })
            .collect()
    }

    /// The measurement in `odometry` of the AUV `auv`, which arrived at `received_s` of Unix time; z = 0 is the water's
    /// surface.
    pub fn auv(
        &self,
        auv: &str,
        odometry: &Odometry,
        received_s: f64,
        refused: &mut Refused,
    ) -> Option<Measurement> {
        let (motion, position) = self.motion(odometry, refused)?;
        Some(Measurement::Auv(AuvFix {
            auv: auv.to_owned(),
            t_s: stamped(odometry.header.stamp, received_s, refused),
            position,
            sigma_m: motion.sigma(),
            depth_m: Some(motion.position.z),
            ground_velocity: motion.ground_velocity(),
        }))
    }

    /// The twist that follows `reference` at `t_s` of Unix time, in the craft's own frame.
    ///
    /// ```text
    /// r = (ψ_ref − ψ)/T, |r| ≤ r_max
    /// ```
    ///
    /// A twist has no heading; a craft that takes one has a loop for surge and one for the yaw rate. This law closes the
    /// heading loop about them as `craft.heading_loop` declares it. None without a recent heading of the craft: a
    /// turn rate of zero would be a command to go straight on.
    pub fn twist(&self, reference: &Reference, t_s: f64, refused: &mut Refused) -> Option<TwistStamped> {
        let is_recent = |seen_s: f64| (t_s - seen_s).abs() <= HEADING_AGE_MAX_S;
        let Some((_, heading)) = self.heading.filter(|(seen_s, _)| is_recent(*seen_s)) else {
            refused.count("reference: no recent heading of the craft");
            return None;
        };
        let HeadingLoop {
            time_constant_s,
            rate_max_radps,
        } = self.heading_loop;
        let yaw_rate = wrapped(reference.heading - heading) / time_constant_s;
        if !(yaw_rate.is_finite() && reference.speed.is_finite()) {
            refused.count("reference: not finite");
            return None;
        }
        Some(TwistStamped {
            header: header(t_s, &self.base_frame, refused)?,
            twist: level_twist(reference.speed, yaw_rate.clamp(-rate_max_radps, rate_max_radps)),
        })
    }

    /// The planned trajectory in the map: each pose has the time of its stage as its stamp, and the reference heading
    /// as its orientation. None where a stage has no place on Earth, since the mission's origin is not the map's.
    pub fn path(&self, plan: &PlannedReference, refused: &mut Refused) -> Option<Path> {
        let mut poses = Vec::with_capacity(plan.stages.len());
        for stage in &plan.stages {
            let place = stage.geographic.map(radians);
            let position = place.and_then(|place| self.datum.to_local(&place).ok());
            let Some(position) = position.filter(|position| position.norm() <= MAP_RADIUS_MAX_M) else {
                refused.count("plan: a stage is not on the map");
                return None;
            };
            poses.push(PoseStamped {
                header: header(stage.t_s, &self.map_frame, refused)?,
                pose: level_pose(&position, stage.reference.heading),
            });
        }
        Some(Path {
            header: header(plan.planned_s, &self.map_frame, refused)?,
            poses,
        })
    }

    fn motion(&self, odometry: &Odometry, refused: &mut Refused) -> Option<(Motion, Geographic)> {
        if odometry.header.frame_id.trim_start_matches('/') != self.map_frame {
            refused.count("odometry: frame_id is not map_frame");
            return None;
        }
        // What MAVROS calls the body's frame in PX4's own axes.
        if odometry.child_frame_id.ends_with("_frd") {
            refused.count("odometry: child_frame_id is not forward-left-up");
            return None;
        }
        let motion = match Motion::from_odometry(odometry) {
            Ok(motion) => motion,
            Err(reason) => {
                refused.count(reason.reason());
                return None;
            }
        };
        let local = motion.position.xy();
        let place = (local.norm() <= MAP_RADIUS_MAX_M).then(|| self.datum.from_local(&local));
        let position = place
            .and_then(|place| Geographic::new(place.latitude.to_degrees(), place.longitude.to_degrees()));
        if position.is_none() {
            refused.count("odometry: position is off the map");
        }
        Some((motion, position?))
    }
}

/// The time of a message, s of Unix time: its stamp, or its arrival if the stamp is implausible.
fn stamped(stamp: Stamp, received_s: f64, refused: &mut Refused) -> f64 {
    let t_s = stamp.seconds();
    if received_s - AGE_MAX_S <= t_s && t_s <= received_s + AHEAD_MAX_S {
        t_s
    } else {
        refused.count("odometry: stamp implausible, arrival time used");
        received_s
    }
}

fn header(t_s: f64, frame: &str, refused: &mut Refused) -> Option<Header> {
    let stamp = Stamp::at(t_s);
    if stamp.is_none() {
        refused.count("time: outside 32-bit seconds");
    }
    Some(Header {
        stamp: stamp?,
        frame_id: frame.to_owned(),
    })
}

fn radians(place: Geographic) -> Origin {
    Origin {
        latitude: place.lat_deg.to_radians(),
        longitude: place.lon_deg.to_radians(),
    }
}

#[cfg(test)]
mod tests;
