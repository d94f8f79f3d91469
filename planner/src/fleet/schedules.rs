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
    /// AUVs of the goal, as indices in the snapshot, with the share of their weight.
    shares: Vec<(usize, f64)>,
}

impl Schedules {
    /// That of the craft of `snapshot`, one of `n_craft`, over the time of the `first` one's.
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
            ..given.clone()
        };
        let memory = Memory::of(snapshot, visits);
        let scheduler = Scheduler { parameters: &parameters, ..*scheduler };
        let (mut fleet, _) = scheduler.fleet(snapshot, visits, &memory, forecasts);
        fleet.afterwards = first.map_or(fleet.afterwards / n_craft, |first| first.fleet.afterwards);
        let weight = |auv: usize| visits.weight(&snapshot.auvs[auv].id);
        let sum: f64 = auvs.iter().map(|auv| weight(*auv)).sum();
        Self { fleet, shares: auvs.iter().map(|auv| (*auv, weight(*auv) / sum)).collect() }
    }

    /// The cost of a set of the goal's AUVs, as bits.
    pub(super) fn cost(&self, set: u32, due: &dyn Fn() -> bool) -> f64 {
        let members: Vec<_> = self.shares.iter().enumerate().filter(|(i, _)| set & (1 << i) != 0).collect();
        let share = |auv: usize| members.iter().find(|(_, (of, _))| *of == auv).map(|(_, (_, share))| *share);
        let candidates =
            self.fleet.candidates.iter().filter_map(|candidate| {
                Some(Candidate { share: share(candidate.auv)?, ..candidate.clone() })
            });
        let mut candidates: Vec<_> = candidates.collect();
        let n = candidates.len();
        let reached: f64 = candidates.iter().map(|candidate| candidate.share).sum();
        let all: f64 = members.iter().map(|(_, (_, share))| share).sum();
        for candidate in &mut candidates {
            candidate.share /= reached;
        }
        let fleet = Fleet { candidates, ..self.fleet.clone() };
        let firsts = (0..n).filter_map(|first| fleet.best_first(first, (None, &[]), TRIED, due));
        let cost = firsts.map(|found| found.value).reduce(f64::min).unwrap_or(0.0);
        // An AUV that the craft does not reach costs more than any that it does.
        let unreached =
            self.fleet.law.unserved(self.fleet.law.fresh(), self.fleet.horizon).cost * (all - reached);
        match fleet.reduce {
            Reduce::Mean => cost * reached + unreached,
            // Weights relative to the mean of all AUVs, not of these.
            Reduce::Max => {
                let relative = self.shares.len() as f64 * reached / (n as f64).max(1.0);
                (cost * relative).max(unreached * self.shares.len() as f64)
            }
        }
    }
}
