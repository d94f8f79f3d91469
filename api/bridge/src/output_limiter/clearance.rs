//! The way of the next seconds beside the vessels that the bridge hears.

use ::wire::{PlanResponse, Warning};
use nalgebra::Vector2;
use planner::angle::direction;
use planner::snapshot::Vessel;
use planner::vessel::VESSEL_STALE;

use crate::recent_positions::moved;
use crate::reference::Reference;
use crate::{Origin, on_earth};

/// Time over which a way is looked at, s: a craft stops in less, and a planner has long acted.
const AHEAD_S: u8 = 10;
/// A smaller approach is noise, m.
const APPROACH_MIN: f64 = 0.5;

/// A vessel, seen from the craft now.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Other {
    /// Its name, or its MMSI.
    pub(crate) name: String,
    /// Position (north, east) from the craft, m.
    position: Vector2<f64>,
    /// Velocity over ground (north, east), m/s.
    velocity: Vector2<f64>,
    /// Distance to keep, m.
    distance: f64,
}

impl Other {
    /// `vessel`, as extrapolated to `now`, s, from a craft at `here` that keeps `separation` m from
    /// its sides, or less if `plan` does; none if it may be elsewhere by now, or if the plan says
    /// itself that it passes too near.
    pub(crate) fn seen(
        vessel: &Vessel,
        now: f64,
        here: &Origin,
        separation: f64,
        plan: &PlanResponse,
    ) -> Option<Self> {
        let age = now - vessel.t_s.unwrap_or(now);
        let there = on_earth(vessel.lat_deg?, vessel.lon_deg?)?;
        let mut encounters = plan.avoidance.iter().flat_map(|avoidance| &avoidance.encounters);
        let met = encounters.find(|met| met.vessel == vessel.id);
        let distance = vessel.half_length() + separation;
        let distance = met.map_or(distance, |met| distance.min(met.separation_m));
        let warned = |warning: &Warning| {
            warning.code == "vessel_too_near"
                && warning.detail.starts_with(&format!("{} comes ", vessel.called()))
        };
        let is_said = met.is_some_and(|met| met.passes_m < distance) || plan.warnings.iter().any(warned);
        let is_known = vessel.is_made_fast() || age <= VESSEL_STALE;
        let velocity = vessel.velocity().unwrap_or_default();
        let position = moved(here, &there) + velocity * age;
        (is_known && !is_said).then(|| Self {
            name: vessel.called().to_owned(),
            position,
            velocity,
            distance,
        })
    }

    /// How far inside the distance to keep the craft comes on `way`, m; 0 if it does not come
    /// nearer than it is.
    fn intrusion(&self, way: &Way) -> f64 {
        let gap = |(second, place): (u8, &Vector2<f64>)| {
            let there = self.position + self.velocity * f64::from(second);
            (there - place).norm() - self.distance
        };
        let least = (1..).zip(&way.0).map(gap).fold(f64::INFINITY, f64::min);
        let now = self.position.norm() - self.distance;
        if least < now - APPROACH_MIN { (-least).max(0.0) } else { 0.0 }
    }
}

/// Positions (north, east) from the craft after each of the next seconds, m.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Way(Vec<Vector2<f64>>);

impl Way {
    /// The way of a craft that does at once what the reference says in so many seconds, up to
    /// `speed_max`, m/s. Currents are left out: they carry it a few metres.
    pub(super) fn of(speed_max: f64, reference: impl Fn(f64) -> Reference) -> Self {
        let mut place = Vector2::zeros();
        let places = (0..AHEAD_S).map(|second| {
            let Reference { speed, heading } = reference(f64::from(second));
            place += direction(heading) * speed.min(speed_max);
            place
        });
        Self(places.collect())
    }

    /// The vessel into whose distance it leads farthest, and how far, m.
    pub(super) fn worst<'a>(&self, others: &'a [Other]) -> Option<(f64, &'a Other)> {
        let intrusions = others.iter().map(|other| (other.intrusion(self), other));
        let worst = intrusions.max_by(|a, b| a.0.total_cmp(&b.0));
        worst.filter(|(intrusion, _)| 0.0 < *intrusion)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::output_limiter::{OutputLimiter, OutputLimits};

    const LIMITS: OutputLimits = OutputLimits { speed_max: 2.0, turn_rate_max: 1.0, acceleration_max: 1.0 };

    fn other(position: [f64; 2], velocity: [f64; 2]) -> Other {
        let [position, velocity] = [position, velocity].map(Vector2::from);
        Other { name: "MV Example".to_owned(), position, velocity, distance: 40.0 }
    }

    fn ahead(speed: f64) -> Reference {
        Reference { speed, heading: 0.0 }
    }

    #[test]
    fn a_reference_towards_a_vessel_is_replaced_by_the_last_safe_one_or_a_stop_and_counted() {
        let mut limiter = OutputLimiter::default();
        // 15 m before the distance to keep: 10 m are clear, 20 m are not.
        let moored = [other([55.0, 0.0], [0.0; 2])];
        assert_eq!(limiter.clear_of(0.0, |_| ahead(1.0), &moored, &LIMITS), ahead(1.0));
        assert_eq!(limiter.clear_of(1.0, |_| ahead(2.0), &moored, &LIMITS), ahead(1.0));
        assert_eq!(limiter.avoided.as_deref(), Some("MV Example"));
        // Nearer, nothing that was safe is.
        let near = [other([45.0, 0.0], [0.0; 2])];
        assert_eq!(limiter.clear_of(2.0, |_| ahead(2.0), &near, &LIMITS), ahead(0.0));
        // A safe reference of long ago does not count.
        assert_eq!(limiter.clear_of(12.0, |_| ahead(2.0), &moored, &LIMITS), ahead(0.0));
        assert_eq!(limiter.changes.to_string(), "towards a vessel: 3");
        // The speed limit comes later, and is known; away is always right.
        let slow = OutputLimits { speed_max: 0.5, ..LIMITS };
        assert_eq!(limiter.clear_of(13.0, |_| ahead(9.0), &moored, &slow), ahead(9.0));
        let inside = [other([-10.0, 0.0], [0.0; 2])];
        assert_eq!(limiter.clear_of(14.0, |_| ahead(2.0), &inside, &LIMITS), ahead(2.0));
        assert_eq!(limiter.avoided, None);
        // What is no number is refused later, and is never the last safe reference.
        assert!(limiter.clear_of(15.0, |_| ahead(f64::NAN), &moored, &LIMITS).speed.is_nan());
        assert_eq!(limiter.clear_of(16.0, |_| ahead(1.9), &near, &LIMITS), ahead(0.0));
    }

    #[test]
    fn a_plan_that_turns_in_time_or_passes_astern_is_followed_and_a_stop_before_the_bow_is_not_chosen() {
        let mut limiter = OutputLimiter::default();
        let moored = [other([55.0, 0.0], [0.0; 2])];
        let turns = |later: f64| Reference { speed: 2.0, heading: if later < 4.0 { 0.0 } else { 1.6 } };
        assert_eq!(limiter.clear_of(0.0, turns, &moored, &LIMITS), ahead(2.0));
        // It crosses from port, and is past in ten seconds.
        let crosses = [other([55.0, 0.0], [0.0, 8.0])];
        assert_eq!(limiter.clear_of(1.0, |_| ahead(2.0), &crosses, &LIMITS), ahead(2.0));
        // It comes up from astern: going on keeps farther away than a stop.
        let follows = [other([-60.0, 0.0], [5.0, 0.0])];
        let mut limiter = OutputLimiter::default();
        assert_eq!(limiter.clear_of(2.0, |_| ahead(2.0), &follows, &LIMITS), ahead(2.0));
        assert_eq!(limiter.changes.total(), 0);
    }

    proptest! {
        #[test]
        fn what_is_sent_never_leads_farther_into_a_distance_than_what_was_asked(
            vessels in prop::collection::vec((prop::array::uniform2(-90.0..90.0_f64), prop::array::uniform2(-9.0..9.0_f64)), 0..6),
            asked in prop::collection::vec((0.0..3.0_f64, -4.0..4.0_f64), 1..20),
        ) {
            let others: Vec<Other> = vessels.into_iter().map(|(place, velocity)| other(place, velocity)).collect();
            let mut limiter = OutputLimiter::default();
            let worst = |reference: Reference| {
                Way::of(LIMITS.speed_max, |_| reference).worst(&others).map_or(0.0, |(depth, _)| depth)
            };
            for (second, (speed, heading)) in (0_u8..).zip(asked) {
                let reference = Reference { speed, heading };
                let sent = limiter.clear_of(f64::from(second), |_| reference, &others, &LIMITS);
                prop_assert!(worst(sent) <= worst(reference));
            }
        }
    }
}
