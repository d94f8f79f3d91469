//! Forecasts of other vessels, with the distance to keep from them.

use nalgebra::Vector2;

use crate::facts::traffic::{PastVessel, VESSEL_SEPARATION_DEFAULT, Vessel};
use crate::predict::motion::Motion;
use crate::snapshot::build::Snapshot;
use crate::tuned::AvoidNumbers;

/// Age from which a position of a vessel under way is stale, s: small ones report each 180 s.
pub const VESSEL_STALE: f64 = 200.0;

/// Age from which it says nothing of a vessel under way, s.
pub const VESSEL_LOST: f64 = 900.0;

/// Least time of a leg of a plan that has a velocity, s, and the largest such velocity, m/s.
const LEG_LEAST: f64 = 0.1;
const SPEED_MOST: f64 = 60.0;

/// Least time of the leg from now that has a velocity, s.
const FIRST_LEG_LEAST: f64 = 5.0;

/// A vessel now, by its last position.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VesselNow {
    /// Its index in the snapshot.
    pub vessel: usize,
    /// Position (north, east), m.
    pub position: Vector2<f64>,
    /// Velocity over ground (north, east), m/s, if known.
    pub velocity: Option<Vector2<f64>>,
    /// Distance to keep from that position, m.
    pub separation: f64,
}

/// The vessels of `snapshot` of which it still knows, in its order.
pub fn vessels_now(snapshot: &Snapshot) -> impl Iterator<Item = VesselNow> {
    VesselForecast::all(snapshot).map(|forecast| VesselNow {
        vessel: forecast.vessel,
        position: forecast.position,
        velocity: snapshot.traffic[forecast.vessel].velocity().map(|_| forecast.velocity),
        separation: forecast.radius(0.0),
    })
}

/// `true` if a position of the vessel says nothing of where it is now.
pub fn is_lost(vessel: &Vessel, age: f64) -> bool {
    !vessel.is_made_fast() && VESSEL_LOST <= age
}

/// A vessel from now on: along its plan, or else and after it at constant velocity.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct VesselForecast {
    /// Its index in the snapshot.
    pub(crate) vessel: usize,
    pub(crate) position: Vector2<f64>,
    /// Velocity over ground now, m/s; zero if not known.
    pub(crate) velocity: Vector2<f64>,
    /// Times from now, s, and positions of its plan, m.
    plan: Vec<(f64, Vector2<f64>)>,
    /// Number of positions over which the velocity is averaged.
    pub(crate) count: f64,
    /// Distance to keep from a position without error, m.
    separation: f64,
    /// Standard deviation of the reported position and of its velocity, and the position's age.
    sigma: f64,
    sigma_velocity: f64,
    age: f64,
    deviations: f64,
    growth_max: f64,
}

impl VesselForecast {
    /// The forecasts of the vessels of `snapshot` that it still knows of.
    pub(crate) fn all(snapshot: &Snapshot) -> impl Iterator<Item = Self> {
        let previous = snapshot.previous_plan.as_ref();
        let past = previous.and_then(|plan| plan.avoidance.as_ref()).map_or(&[][..], |known| &known.vessels);
        let vessels = snapshot.traffic.iter().enumerate();
        vessels.filter_map(move |(i, vessel)| {
            let age = snapshot.vessel_age(vessel);
            let past = past.iter().find(|past| past.id == vessel.id);
            let tuned = &snapshot.tuned().avoid;
            let (velocity, count) = averaged(vessel, snapshot.t_s - age, past, tuned);
            let times = [snapshot.t_s, age];
            let known = Self::new(i, vessel, (velocity, count), times, snapshot.vessel_separation_m, tuned);
            (!is_lost(vessel, age)).then_some(known)
        })
    }

    fn new(
        i: usize,
        vessel: &Vessel,
        (velocity, count): (Option<Vector2<f64>>, f64),
        [now, age]: [f64; 2],
        separation: Option<f64>,
        tuned: &AvoidNumbers,
    ) -> Self {
        let sigma_velocity = match velocity {
            _ if vessel.is_made_fast() => 0.0,
            Some(velocity) => tuned.sigma_velocity + tuned.sigma_velocity_share * velocity.norm(),
            None => vessel.speed_mps.unwrap_or(tuned.unknown_speed),
        };
        let known = velocity.unwrap_or_else(Vector2::zeros);
        let after = vessel.plan.iter().map(|[time, north, east]| (time - now, Vector2::new(*north, *east)));
        Self {
            vessel: i,
            position: vessel.position() + known * age,
            velocity: known,
            plan: after.filter(|(ahead, _)| 0.0 < *ahead).collect(),
            count,
            separation: vessel.half_length() + separation.unwrap_or(VESSEL_SEPARATION_DEFAULT),
            sigma: vessel.sigma(),
            sigma_velocity,
            age,
            deviations: tuned.deviations,
            growth_max: tuned.growth_max,
        }
    }

    /// The same forecast with other coordinates.
    pub(crate) fn seen_from(&self, motion: impl Fn(&Motion) -> Motion) -> Self {
        let place = |position: Vector2<f64>| motion(&Motion { position, velocity: self.velocity });
        let Motion { position, velocity } = place(self.position);
        let plan = self.plan.iter().map(|(ahead, position)| (*ahead, place(*position).position)).collect();
        Self { position, velocity, plan, ..*self }
    }

    /// `true` if it has a plan: it gives no way.
    pub(crate) fn has_plan(&self) -> bool {
        !self.plan.is_empty()
    }

    pub(crate) fn at(&self, ahead: f64) -> Vector2<f64> {
        let Some([(from, begin), (until, end)]) = self.leg(ahead) else {
            return self.position + self.velocity * ahead;
        };
        let share = ((ahead - from) / (until - from)).clamp(0.0, 1.0);
        let after = self.velocity_at(ahead) * (ahead - until).max(0.0);
        begin + (end - begin) * share + after
    }

    /// Its velocity over ground `ahead` seconds after the snapshot, m/s.
    pub(crate) fn velocity_at(&self, ahead: f64) -> Vector2<f64> {
        self.leg(ahead).map_or(self.velocity, |[(from, begin), (until, end)]| {
            // Too short a leg from where it is now: its own error would count as speed.
            if from == 0.0 && until < FIRST_LEG_LEAST {
                return self.velocity;
            }
            ((end - begin) / (until - from).max(LEG_LEAST)).cap_magnitude(SPEED_MOST)
        })
    }

    /// Both ends of the leg of its plan that it is on then; after its plan, of the last one.
    fn leg(&self, ahead: f64) -> Option<[(f64, Vector2<f64>); 2]> {
        let last = self.plan.len().checked_sub(1)?;
        let to = self.plan.partition_point(|(time, _)| *time < ahead).min(last);
        let from = to.checked_sub(1).map_or((0.0, self.position), |before| self.plan[before]);
        Some([from, self.plan[to]])
    }

    /// Distance to keep from it, m: half its length, the distance to keep, and two σ, which grow.
    pub(crate) fn radius(&self, ahead: f64) -> f64 {
        self.radius_of(ahead, 1.0)
    }

    /// The same with `share` of those deviations.
    pub(crate) fn radius_of(&self, ahead: f64, share: f64) -> f64 {
        let grown = self.deviations * self.sigma.hypot(self.sigma_velocity * (self.age + ahead));
        self.separation + share * grown.min(self.growth_max)
    }
}

/// The velocity of a vessel, m/s, averaged over its positions of the last `velocity_memory`, and
/// their number; none if it is not known. A vessel that turns or changes its speed begins anew.
fn averaged(
    vessel: &Vessel,
    time: f64,
    past: Option<&PastVessel>,
    tuned: &AvoidNumbers,
) -> (Option<Vector2<f64>>, f64) {
    let (Some(given), Some(past)) = (vessel.velocity(), past) else {
        return (vessel.velocity(), 1.0);
    };
    let (before, elapsed) = (Vector2::new(past.north_mps, past.east_mps), time - past.t_s);
    let differs = tuned.velocity_change + tuned.velocity_change_share * before.norm();
    if !(0.0..=VESSEL_LOST).contains(&elapsed) || differs < (given - before).norm() {
        (Some(given), 1.0)
    } else if elapsed == 0.0 {
        (Some(before), past.count)
    } else {
        let count = past.count + 1.0;
        let share = (1.0 / count).max(elapsed / tuned.velocity_memory).min(1.0);
        (Some(before + (given - before) * share), count)
    }
}
