//! The cost of a craft that visits AUVs: that of the best schedule of a short search.

use crate::facts::visit::{Reduce, Visits};
use crate::predict::forecast::AuvForecast;
use crate::snapshot::build::Snapshot;
use crate::visit::fleet::{Candidate, Fleet, SchedulingParameters};
use crate::visit::memory::Memory;
use crate::visit::schedule::Scheduler;

/// Visits tried for the cost of a set of AUVs.
const TRIED: usize = 60;

/// The scheduling problem of one craft with all AUVs.
pub(super) struct Schedules {
    pub(super) fleet: Fleet,
    /// AUVs of the goal: index in the snapshot, share of the weight, and present cost.
    auvs: Vec<(usize, f64, f64)>,
}

impl Schedules {
    /// The problem of a craft, one of `n_craft`, over the same time as that of the `first` one.
    pub(super) fn new(
        (snapshot, visits): (&Snapshot, &Visits),
        scheduler: &Scheduler<'_>,
        (forecasts, auvs): (&[AuvForecast], &[usize]),
        (n_craft, first): (f64, Option<&Self>),
    ) -> Self {
        let given = scheduler.parameters;
        let [least, most] =
            first.map_or([given.horizon_min, given.horizon_max], |first| [first.fleet.horizon; 2]);
        let parameters = SchedulingParameters {
            horizon_min: least,
            horizon_max: most,
            horizon_tours: given.horizon_tours / n_craft,
            straight_most: snapshot.tuned().fleet.straight_most,
            ..given.clone()
        };
        let memory = Memory::of(snapshot, visits);
        let scheduler = Scheduler { parameters: &parameters, ..*scheduler };
        let (mut fleet, vehicles) = scheduler.fleet(snapshot, visits, &memory, forecasts);
        fleet.afterwards = first.map_or(fleet.afterwards / n_craft, |first| first.fleet.afterwards);
        let weight = |auv: usize| visits.weight(&snapshot.auvs[auv].id);
        let sum: f64 = auvs.iter().map(|auv| weight(*auv)).sum();
        let known = |auv: usize| {
            let vehicle = vehicles.iter().find(|vehicle| vehicle.auv == auv);
            vehicle.map_or(0.0, |vehicle| vehicle.served.cost)
        };
        Self { auvs: auvs.iter().map(|auv| (*auv, weight(*auv) / sum, known(*auv))).collect(), fleet }
    }

    /// `true` if the craft reaches all AUVs of the goal.
    pub(super) fn reaches_all(&self) -> bool {
        self.fleet.candidates.len() == self.auvs.len()
    }

    pub(super) fn cost(&self, set: u32, due: &dyn Fn() -> bool) -> f64 {
        let members = self.auvs.iter().enumerate().filter(|(i, _)| set & (1 << i) != 0);
        let members: Vec<_> =
            members.map(|(_, member)| *member).filter(|(_, share, _)| 0.0 < *share).collect();
        let of = |candidate: &Candidate| members.iter().find(|(auv, ..)| *auv == candidate.auv);
        let candidates = self.fleet.candidates.iter();
        let mut candidates: Vec<_> = candidates
            .filter_map(|candidate| {
                of(candidate).map(|(_, share, _)| Candidate { share: *share, ..candidate.clone() })
            })
            .collect();
        let n = candidates.len() as f64;
        let is_reached = |auv: usize| candidates.iter().any(|candidate| candidate.auv == auv);
        let (law, horizon, all) = (&self.fleet.law, self.fleet.horizon, self.auvs.len() as f64);
        // Nobody comes to an AUV that the craft does not reach, for twice as long as is planned.
        let unreached = members.iter().filter(|(auv, ..)| !is_reached(*auv));
        let unreached = unreached.map(|(_, share, cost)| share * law.unserved(*cost, 2.0 * horizon).cost);
        let (sum, largest) =
            unreached.fold((0.0, 0.0), |(sum, most), cost| (sum + cost, f64::max(most, cost)));
        let reached: f64 = candidates.iter().map(|candidate| candidate.share).sum();
        for candidate in &mut candidates {
            candidate.share /= reached;
        }
        let fleet = self.fleet.with(candidates);
        let firsts = 0..fleet.candidates.len();
        let found = firsts.filter_map(|first| fleet.best_first(first, (None, &[]), TRIED, due));
        let cost = found.map(|found| found.value).reduce(f64::min).unwrap_or(0.0);
        match fleet.reduce {
            Reduce::Mean => cost * reached + sum,
            // Weights relative to the mean of all AUVs, not of these.
            Reduce::Max => (cost * all * reached / n.max(1.0)).max(largest * all),
        }
    }
}
