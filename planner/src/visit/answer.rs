//! The answer of the chosen schedule, and the AUVs that the goal follows.

use nalgebra::Vector2;

use crate::facts::angle::ned_from_body;
use crate::facts::auv::VehicleId;
use crate::facts::ranges::VISITS_MAX;
use crate::facts::schedule::{Alternative, LeftOut, Schedule, Visit};
use crate::facts::visit::Visits;
use crate::predict::forecast::AuvForecast;
use crate::predict::goal::{GoalLeg, Turn};
use crate::snapshot::build::Snapshot;
use crate::visit::fleet::Fleet;
use crate::visit::memory::Vehicle;
use crate::visit::search::{Found, PresentVisit};
use crate::visit::sentence::{Reason, sentence};
use crate::visit::state::VisitWindow;

/// A schedule, and the AUVs that the goal follows.
#[derive(Clone, Debug)]
pub(crate) struct Scheduled {
    pub(crate) schedule: Schedule,
    /// In order of time, at least one.
    pub(crate) turns: Vec<Turn>,
}

impl Scheduled {
    /// Index in the snapshot of the AUV that is visited first, and its cost.
    pub(crate) fn visited(&self, snapshot: &Snapshot) -> Option<(usize, f64)> {
        let auv = self.turns.first()?.auv;
        let served = self.schedule.costs.iter().find(|served| served.auv == snapshot.auvs[auv].id)?;
        Some((auv, served.cost))
    }
}

/// Inputs of an answer.
pub(crate) struct ScheduleAnswer<'a> {
    pub(crate) snapshot: &'a Snapshot,
    pub(crate) visits: &'a Visits,
    pub(crate) fleet: &'a Fleet,
    /// Names of the candidates.
    pub(crate) ids: &'a [&'a VehicleId],
    pub(crate) vehicles: Vec<Vehicle>,
    pub(crate) present: Option<PresentVisit>,
    pub(crate) previous: Option<&'a Schedule>,
    /// The requested next AUV, if its visit is over.
    pub(crate) visited: Option<VehicleId>,
}

impl ScheduleAnswer<'_> {
    /// The answer with the `chosen` one of `found`; `before`: the previous schedule's candidate.
    pub(crate) fn of(
        self,
        found: &[(usize, Found)],
        chosen: Option<usize>,
        before: Option<usize>,
        forecasts: &[AuvForecast],
    ) -> Scheduled {
        let best = chosen.map(|chosen| &found[chosen].1);
        let windows = best.map_or(&[][..], |best| &best.windows);
        let cost = best.map_or(0.0, |best| best.cost);
        let bound = if best.is_some() { self.fleet.least_cost().min(cost) } else { 0.0 };
        let alternatives = self.alternatives(found, chosen);
        let mut schedule = Schedule {
            unit: self.visits.cost.unit(),
            visits: windows.iter().take(VISITS_MAX).map(|window| self.visit(window)).collect(),
            cost,
            bound,
            gap: if cost > 0.0 { 1.0 - bound / cost } else { 0.0 },
            exact: found.iter().all(|(_, found)| found.exact),
            alternatives,
            deadlines_missed: self.late(best.map_or(0, |best| best.missed)),
            sentence: String::new(),
            kept: before.is_some() && before == windows.first().map(|window| window.candidate),
            costs: Vec::new(),
            next_visited: self.visited.clone(),
        };
        let turns = self.turns(windows, forecasts);
        let reason = self.reason(&schedule);
        schedule.costs = self.vehicles.into_iter().map(|vehicle| vehicle.served).collect();
        schedule.sentence = sentence(&schedule, &self.visits.cost, self.snapshot.t_s, reason, self.previous);
        Scheduled { schedule, turns }
    }

    /// The reason for the first visit, if it is not the cost.
    fn reason(&self, schedule: &Schedule) -> Option<Reason> {
        let first = schedule.next()?;
        if self.visits.next.as_ref() == Some(first) && self.visited.is_none() {
            return Some(Reason::Asked);
        }
        let vehicle = self.vehicles.iter().find(|vehicle| vehicle.served.auv == *first)?;
        let late = -vehicle.deadline?;
        (0.0 < late).then_some(Reason::Late(late))
    }

    /// Expected position of a visit's AUV at a time, s after now: m, (north, east).
    fn place(&self, window: &VisitWindow, time: f64) -> Vector2<f64> {
        let asc = &self.snapshot.asc;
        let ahead = self.fleet.candidates[window.candidate].track.at(time.max(0.0));
        asc.position() + ned_from_body(asc.heading().radians()) * ahead
    }

    fn visit(&self, window: &VisitWindow) -> Visit {
        let now = self.snapshot.t_s;
        let begun = self.begun(window);
        let place = self.place(window, window.arrive);
        Visit {
            auv: self.ids[window.candidate].clone(),
            arrive_s: now + begun.map_or(window.arrive, |present| present.since),
            leave_s: now + window.leave,
            north_m: place.x,
            east_m: place.y,
            cost_before: window.cost_before,
            cost_after: window.cost_after,
        }
    }

    /// The present visit, which keeps its beginning.
    fn begun(&self, window: &VisitWindow) -> Option<PresentVisit> {
        self.present.filter(|present| window.arrive <= 0.0 && present.candidate == window.candidate)
    }

    /// AUVs that are not served by a deadline within the horizon.
    fn late(&self, missed: u32) -> Vec<VehicleId> {
        let late = |vehicle: &&Vehicle| {
            if vehicle.served.left_out.is_some() {
                return vehicle.deadline.is_some_and(|deadline| deadline < self.fleet.horizon);
            }
            let mut candidates = self.fleet.candidates.iter();
            let place = candidates.position(|candidate| candidate.auv == vehicle.auv);
            place.is_some_and(|place| missed & (1 << place) != 0)
        };
        let vehicles = self.vehicles.iter().filter(late);
        vehicles.map(|vehicle| vehicle.served.auv.clone()).collect()
    }

    /// All but the chosen one, the cheapest first; missed deadlines outweigh any cost.
    fn alternatives(&self, found: &[(usize, Found)], chosen: Option<usize>) -> Vec<Alternative> {
        let others = found.iter().enumerate();
        let mut others: Vec<_> =
            others.filter(|(place, _)| Some(*place) != chosen).map(|(_, other)| other).collect();
        others.sort_by(|a, b| a.1.value.total_cmp(&b.1.value));
        let alternative = |(first, found): &(usize, Found)| Alternative {
            next: self.ids[*first].clone(),
            cost: found.cost,
            deadlines_missed: found.missed.count_ones() as usize,
        };
        others.into_iter().map(alternative).collect()
    }

    /// The goal's targets: the AUV of the first visit until departure, then the leg to the next
    /// one. A goal that jumped to a distant AUV would draw the craft away early. Without a least
    /// visit time, the first visit ends on arrival: the goal continues so that the craft turns in
    /// time. Without a visit, the goal is the nearest AUV that was heard.
    fn turns(&self, windows: &[VisitWindow], forecasts: &[AuvForecast]) -> Vec<Turn> {
        let of = |window: &VisitWindow, until| Turn {
            until,
            auv: self.fleet.candidates[window.candidate].auv,
            leg: None,
        };
        // No faster than the craft, whose leg lasts from near the first AUV to near the second.
        let leg = |first: &VisitWindow, second: &VisitWindow| {
            let from = forecasts[self.fleet.candidates[first.candidate].auv].at(first.leave).position;
            let to = self.place(second, second.arrive);
            let arrive = second.arrive.max(first.leave + (to - from).norm() / self.fleet.craft.speed);
            Turn { leg: Some(GoalLeg { depart: first.leave, arrive, from, to }), ..of(second, arrive) }
        };
        let mut turns: Vec<_> = match windows {
            [first, second, ..] if self.fleet.dwell_min <= 0.0 => {
                vec![of(first, second.arrive), of(second, second.leave)]
            }
            [first, second, ..] => {
                let mut turns = vec![of(first, first.leave)];
                turns.extend((first.leave < second.arrive).then(|| leg(first, second)));
                turns.push(of(second, f64::INFINITY));
                turns
            }
            [first] => vec![of(first, first.leave)],
            [] => Vec::new(),
        };
        if turns.is_empty() {
            let here = self.snapshot.asc.position();
            let key = |vehicle: &Vehicle| {
                let distance = (forecasts[vehicle.auv].at(0.0).position - here).norm();
                (vehicle.served.left_out == Some(LeftOut::Silent), distance)
            };
            let nearest = self.vehicles.iter().min_by(|a, b| {
                let (a, b) = (key(a), key(b));
                a.0.cmp(&b.0).then(a.1.total_cmp(&b.1))
            });
            turns.extend(nearest.map(|vehicle| Turn::only(vehicle.auv)));
        }
        turns
    }
}
