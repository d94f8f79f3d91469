//! The selected schedule: the best over all first AUVs, unless the previous one is almost as good.

use crate::coast::way::Search;
use crate::facts::auv::VehicleId;
use crate::facts::goal::Goal;
use crate::facts::schedule::LeftOut;
use crate::facts::visit::Visits;
use crate::predict::forecast::AuvForecast;
use crate::snapshot::build::Snapshot;
use crate::visit::answer::{ScheduleAnswer, Scheduled};
use crate::visit::depth::depths_ahead;
use crate::visit::fleet::{Fleet, ScheduledAuv, SchedulingParameters};
use crate::visit::memory::{Memory, Vehicle};
use crate::visit::search::{Found, PlannedVisit, PresentVisit};
use crate::visit::state::TIE;

/// Inputs of a schedule besides the snapshot.
#[derive(Clone, Copy)]
pub(crate) struct Scheduler<'a> {
    pub(crate) parameters: &'a SchedulingParameters,
    /// Largest planned speed through the water, m/s, and turn rate, rad/s.
    pub(crate) speed: f64,
    pub(crate) turn_rate: f64,
    /// Largest age of the last report of a visited AUV, s.
    pub(crate) report_age_max: f64,
    /// Distance of ways from no-go areas, m.
    pub(crate) clearance: f64,
    pub(crate) due: &'a dyn Fn() -> bool,
}

impl Scheduler<'_> {
    /// The schedule of `snapshot`; `None` unless its goal visits. `forecasts` are of all its AUVs.
    pub(crate) fn schedule(&self, snapshot: &Snapshot, forecasts: &[AuvForecast]) -> Option<Scheduled> {
        let Goal::Visit(visits) = &snapshot.goal.goal else {
            return None;
        };
        let memory = Memory::of(snapshot, visits);
        let (fleet, vehicles) = self.fleet(snapshot, visits, &memory, forecasts);
        let ids: Vec<&VehicleId> =
            fleet.candidates.iter().map(|candidate| &snapshot.auvs[candidate.auv].id).collect();
        let present = memory.present(&fleet, &ids);
        let left = memory.visits_left(&ids);
        let visited = visits.next.as_ref().filter(|next| {
            let near = ids
                .iter()
                .position(|id| id == next)
                .is_some_and(|candidate| fleet.candidates[candidate].track.at(0.0).norm() <= fleet.within);
            memory.was_visited_next(next, near, fleet.dwell_min)
        });
        let pinned = visits.next.as_ref().filter(|_| visited.is_none());
        let found = self.best_by_first(&fleet, &ids, (present, &left), pinned);
        // A requested visit does not continue beyond its end as the present one.
        let ends = visited.is_some()
            && memory.schedule().is_none_or(|schedule| schedule.next_visited.as_ref() != visited);
        let before = memory.next().filter(|visit| !ends || Some(&visit.auv) != visited);
        let before = before.and_then(|visit| ids.iter().position(|id| **id == visit.auv));
        let chosen = chosen(&fleet, &found, before, self.parameters.keep_margin);
        Some(
            ScheduleAnswer {
                snapshot,
                visits,
                fleet: &fleet,
                ids: &ids,
                vehicles,
                present,
                previous: memory.schedule(),
                visited: visited.cloned(),
            }
            .of(&found, chosen, before, forecasts),
        )
    }

    /// The scheduling problem, and all AUVs of the goal.
    pub(crate) fn fleet(
        &self,
        snapshot: &Snapshot,
        visits: &Visits,
        memory: &Memory<'_>,
        forecasts: &[AuvForecast],
    ) -> (Fleet, Vec<Vehicle>) {
        let depths = depths_ahead(snapshot, forecasts);
        let mut vehicles = memory.vehicles(snapshot, visits, &depths, forecasts, self.report_age_max);
        let visited = vehicles.iter().filter(|vehicle| vehicle.served.left_out.is_none());
        let members: Vec<_> = visited
            .map(|vehicle| ScheduledAuv {
                auv: vehicle.auv,
                weight: visits.weight(&vehicle.served.auv),
                cost: vehicle.served.cost,
                deadline: vehicle.deadline,
            })
            .collect();
        let craft = (self.speed, self.turn_rate);
        let ways = Search { land: snapshot.land(), clearance: self.clearance, due: self.due };
        let forecasts = (forecasts, &*depths);
        let fleet = Fleet::new(snapshot, visits, &members, forecasts, craft, self.parameters, &ways);
        for vehicle in &mut vehicles {
            if fleet.out_of_reach.contains(&vehicle.auv) {
                vehicle.served.left_out = Some(LeftOut::OutOfReach);
            }
        }
        (fleet, vehicles)
    }

    /// The best schedule for each possible first candidate.
    fn best_by_first(
        &self,
        fleet: &Fleet,
        ids: &[&VehicleId],
        (present, left): (Option<PresentVisit>, &[PlannedVisit]),
        pinned: Option<&VehicleId>,
    ) -> Vec<(usize, Found)> {
        let pinned = pinned.and_then(|pinned| ids.iter().position(|id| *id == pinned));
        // A visit lasts at least the requested time.
        let begun = present.filter(|present| 0.0 < present.since + fleet.dwell_min);
        let only = pinned.or(begun.map(|present| present.candidate));
        let firsts = (0..ids.len()).filter(|first| only.is_none_or(|only| only == *first));
        let best = |first| fleet.best_first(first, (present, left), self.parameters.visits_tried, self.due);
        // After a completed visit, another one is first.
        let mut found: Vec<(usize, Found)> = Vec::new();
        for best in firsts.filter_map(best) {
            let first = best.windows[0].candidate;
            match found.iter_mut().find(|(known, _)| *known == first) {
                Some((_, known)) if known.value <= best.value => {}
                Some((_, known)) => *known = best,
                None => found.push((first, best)),
            }
        }
        found
    }
}

/// The index in `found` of the selected schedule: the best, unless the one that begins as `before`
/// is almost as good. An AUV that the craft passes while it turns to the next needs no visit.
fn chosen(fleet: &Fleet, found: &[(usize, Found)], before: Option<usize>, keep_margin: f64) -> Option<usize> {
    let value = |place: usize| found[place].1.value;
    let best = (0..found.len())
        .reduce(|best, next| if value(next) < value(best) - TIE * value(best).abs() { next } else { best })?;
    let before = before.filter(|before| 0.0 < fleet.dwell_min || !fleet.turns_past(*before, found[best].0));
    let exact = found.iter().all(|(_, found)| found.exact);
    let margin = if exact { keep_margin } else { 2.0 * keep_margin };
    let kept = found.iter().position(|(first, _)| Some(*first) == before);
    // The margin excludes the price of missed deadlines, which would dominate it.
    kept.filter(|kept| value(*kept) <= value(best) + margin * found[best].1.cost).or(Some(best))
}
