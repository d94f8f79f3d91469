//! Other vessels about the boat, which keep their courses, and what AIS tells of them.

use mavlink::dialects::ardupilotmega::{AIS_VESSEL_DATA, AisFlags, MavMessage};
use nalgebra::Vector2;
use rand::RngExt as _;
use rand_chacha::ChaCha8Rng;

use crate::autopilot::place;

/// Distance that the mission keeps from a vessel's side, m: the default.
const SEPARATION_M: f64 = 30.0;
/// One seed in this many meets vessels.
const MEETS: u64 = 3;
/// Time of undisturbed steering that a boat needs to keep clear, s.
const NEEDED_S: f64 = 150.0;
/// Silence after which nobody knows where a vessel is, s, and of which the operator must be told.
const HEARD_S: f64 = 60.0;
const TOLD_S: f64 = 240.0;
/// Time at the end of a voyage for which the operator must have been told, s.
const MISSED_S: f64 = 20.0;

/// A vessel that keeps its course.
#[derive(Debug)]
pub(super) struct Ship {
    mmsi: u32,
    start: Vector2<f64>,
    velocity: Vector2<f64>,
    length: f64,
    /// Time between two reports, and time of the next one, s.
    interval_s: f64,
    due_s: f64,
    /// Begin and end of its silence, s.
    silence: [f64; 2],
    /// Time of its last report, s, if it was heard.
    heard_s: Option<f64>,
}

/// The vessels of a voyage that pass an AUV at `from` (north, east), m, on `course`, rad.
pub(super) fn drawn(
    rng: &mut ChaCha8Rng,
    seed: u64,
    (from, course): (Vector2<f64>, f64),
    speed: f64,
    duration_s: f64,
) -> Vec<Ship> {
    let n = if seed.is_multiple_of(MEETS) { rng.random_range(1..3) } else { 0 };
    let ship = |i: u32| {
        let meets_s = rng.random_range(0.35..0.9) * duration_s;
        let [own, its] =
            [course, rng.random_range(-3.1..3.1)].map(|course: f64| Vector2::new(course.cos(), course.sin()));
        let velocity = its * rng.random_range(1.5..6.0);
        let aside = Vector2::new(-its.y, its.x) * rng.random_range(-50.0..50.0);
        let silent_s = meets_s - rng.random_range(50.0..250.0);
        let lasts_s = match rng.random_range(0..5) {
            0 => f64::INFINITY,
            1 | 2 => rng.random_range(20.0..90.0),
            _ => 0.0,
        };
        // One that is never heard again has to be missed by the end of a long voyage.
        let latest_s = duration_s - TOLD_S - MISSED_S;
        let silent_s =
            if lasts_s.is_infinite() && 0.0 < latest_s { silent_s.min(latest_s) } else { silent_s };
        Ship {
            mmsi: 244_000_001 + i,
            start: from + own * (speed * meets_s) + aside - velocity * meets_s,
            velocity,
            length: rng.random_range(8.0..80.0),
            interval_s: rng.random_range(2.0..10.0),
            due_s: rng.random_range(0.0..10.0),
            silence: [silent_s, silent_s + lasts_s],
            heard_s: None,
        }
    };
    (0..n).map(ship).collect()
}

impl Ship {
    fn at(&self, t_s: f64) -> Vector2<f64> {
        self.start + self.velocity * t_s
    }

    /// What the autopilot hears of it by AIS, if it reports at `t_s`.
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "the message's integers are that wide"
    )]
    pub(super) fn says(&mut self, t_s: f64) -> Option<MavMessage> {
        if t_s < self.due_s {
            return None;
        }
        self.due_s = t_s + self.interval_s;
        if self.silence[0] <= t_s && t_s < self.silence[1] {
            return None;
        }
        self.heard_s = Some(t_s);
        let MavMessage::GLOBAL_POSITION_INT(at) = place(&self.at(t_s), &self.velocity, None) else {
            return None;
        };
        let course = self.velocity.y.atan2(self.velocity.x).to_degrees().rem_euclid(360.0);
        Some(MavMessage::AIS_VESSEL(AIS_VESSEL_DATA {
            MMSI: self.mmsi,
            lat: at.lat,
            lon: at.lon,
            COG: (100.0 * course) as u16,
            heading: (100.0 * course) as u16,
            velocity: (100.0 * self.velocity.norm()) as u16,
            dimension_bow: (0.5 * self.length) as u16,
            dimension_stern: (0.5 * self.length) as u16,
            flags: AisFlags::AIS_FLAGS_VALID_COG
                | AisFlags::AIS_FLAGS_VALID_VELOCITY
                | AisFlags::AIS_FLAGS_VALID_DIMENSIONS,
            ..AIS_VESSEL_DATA::DEFAULT
        }))
    }

    /// How far `boat` is from the distance to keep, m, negative within it; none if a boat that has
    /// been steered undisturbed for `steered_s` cannot be expected to keep it.
    pub(super) fn clearance(&self, t_s: f64, boat: &Vector2<f64>, steered_s: f64) -> Option<f64> {
        let is_heard = self.heard_s.is_some_and(|heard_s| t_s - heard_s < HEARD_S);
        let may_be_expected = is_heard && NEEDED_S < steered_s;
        may_be_expected.then(|| (self.at(t_s) - boat).norm() - 0.5 * self.length - SEPARATION_M)
    }

    /// `true` if the operator must have been told at `t_s` that it is not heard any more.
    pub(super) fn is_missed(&self, t_s: f64) -> bool {
        self.heard_s.is_some_and(|heard_s| TOLD_S < t_s - heard_s)
    }
}
