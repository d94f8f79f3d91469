//! Memory of the previous schedule: costs advanced to now, met deadlines, the present visit.

use crate::facts::auv::VehicleId;
use crate::facts::schedule::{LeftOut, Schedule, ServedVehicle, Visit};
use crate::facts::visit::Visits;
use crate::predict::forecast::AuvForecast;
use crate::snapshot::build::Snapshot;
use crate::visit::cost::ServicePlace;
use crate::visit::depth::DepthAhead;
use crate::visit::fleet::Fleet;
use crate::visit::hearing::{Heard, Hearing};
use crate::visit::search::{PlannedVisit, PresentVisit};

/// An AUV that the goal depends on.
pub(crate) struct Vehicle {
    /// Its index in the snapshot.
    pub(crate) auv: usize,
    pub(crate) served: ServedVehicle,
    /// A pending deadline, s after now.
    pub(crate) deadline: Option<f64>,
}

/// The previous schedule as memory.
pub(crate) struct Memory<'a> {
    now: f64,
    /// Age of the schedule, s, and the schedule, if its costs are of the goal's kind.
    before: Option<(f64, &'a Schedule)>,
    /// The same for costs of any kind: hearing does not depend on them.
    heard: Option<(f64, &'a Schedule)>,
}

impl<'a> Memory<'a> {
    /// The memory in the previous plan; only the hearing if its costs are of another kind.
    pub(crate) fn of(snapshot: &'a Snapshot, visits: &Visits) -> Self {
        let previous = snapshot.previous_plan.as_ref();
        let heard = previous.and_then(|plan| {
            let elapsed = (snapshot.t_s - plan.made_at()?).max(0.0);
            Some((elapsed, plan.schedule.as_ref()?))
        });
        Self {
            now: snapshot.t_s,
            before: heard.filter(|(_, schedule)| schedule.unit == visits.cost.unit()),
            heard,
        }
    }

    /// All AUVs that the goal depends on, in its order, with costs advanced to now. An AUV near the
    /// craft counts as served since the previous schedule.
    pub(crate) fn vehicles(
        &self,
        snapshot: &Snapshot,
        visits: &Visits,
        depths: &[DepthAhead],
        forecasts: &[AuvForecast],
        report_age_max: f64,
    ) -> Vec<Vehicle> {
        let law = &visits.cost;
        let vehicle = |id: &VehicleId| {
            let auv = snapshot.auvs.iter().position(|auv| auv.id == *id);
            let auv = auv.expect("a snapshot's goal names only vehicles that are in it");
            let (forecast, known) = (&forecasts[auv], served(self.before, id));
            let distance = (forecast.at(0.0).position - snapshot.asc.position()).norm();
            let depth = depths[auv].at(0.0);
            let heard = Heard::of(snapshot, auv, distance);
            let (elapsed, before) = served(self.heard, id).unzip();
            let before = before.map_or_else(Hearing::default, |before| Hearing {
                within: before.heard_within_m,
                unheard: before.unheard_s,
            });
            let hearing = before.later(elapsed.unwrap_or(0.0), &heard);
            let silent = hearing.is_silent(&heard, report_age_max);
            let near = !silent && distance <= visits.within() && law.reaches(depth);
            let carried = known.map_or_else(
                || law.fresh(),
                |(elapsed, known)| {
                    let later = if near {
                        law.served(known.cost, elapsed, ServicePlace { distance, depth })
                    } else {
                        law.unserved(known.cost, elapsed)
                    };
                    later.cost
                },
            );
            let asked = visits.serve_by_s.get(id).copied();
            let met = known.and_then(|(_, known)| known.served_by_s);
            let met = asked.filter(|asked| near || met == Some(*asked));
            let left_out = if silent {
                Some(LeftOut::Silent)
            } else {
                (!law.reaches(depths[auv].shallowest(next_half_hour()))).then_some(LeftOut::TooDeep)
            };
            Vehicle {
                auv,
                deadline: asked.filter(|_| met.is_none()).map(|asked| asked - self.now),
                served: ServedVehicle {
                    auv: id.clone(),
                    cost: visits.costs_now.get(id).copied().unwrap_or(carried),
                    served_by_s: met,
                    heard_within_m: hearing.within,
                    unheard_s: hearing.unheard,
                    left_out,
                },
            }
        };
        snapshot.goal.goal.vehicles().map(vehicle).collect()
    }

    pub(crate) fn schedule(&self) -> Option<&'a Schedule> {
        self.before.map(|(_, schedule)| schedule)
    }

    /// The present visit, or else the next one.
    pub(crate) fn next(&self) -> Option<&'a Visit> {
        let (_, schedule) = self.before?;
        schedule.visits.iter().find(|visit| self.now < visit.leave_s)
    }

    /// `true` if the visit to `id`, the next, is over: it was before, or the craft has been `near`
    /// it for the least time.
    pub(crate) fn was_visited_next(&self, id: &VehicleId, near: bool, dwell_min: f64) -> bool {
        let before = self.heard.map(|(elapsed, schedule)| (self.now - elapsed, schedule));
        let has_lasted = before.is_some_and(|(then, schedule)| {
            let on = schedule.visits.first();
            on.is_some_and(|on| on.auv == *id && on.arrive_s <= then && on.arrive_s + dwell_min <= self.now)
        });
        before.is_some_and(|(_, schedule)| schedule.next_visited.as_ref() == Some(id))
            || near && (dwell_min <= 0.0 || has_lasted)
    }

    /// The remaining visits to those of `ids` that can be visited.
    pub(crate) fn visits_left(&self, ids: &[&VehicleId]) -> Vec<PlannedVisit> {
        let schedule = self.schedule();
        let visits = schedule.iter().flat_map(|schedule| &schedule.visits);
        let left = visits.filter(|visit| self.now < visit.leave_s);
        let planned = left.filter_map(|visit| {
            let candidate = ids.iter().position(|id| **id == visit.auv)?;
            Some((candidate, visit.leave_s - visit.arrive_s))
        });
        planned.collect()
    }

    /// The present visit, or the one that begins now as the craft is there.
    pub(crate) fn present(&self, fleet: &Fleet, ids: &[&VehicleId]) -> Option<PresentVisit> {
        let visit = self.next()?;
        let candidate = ids.iter().position(|id| **id == visit.auv)?;
        let near = fleet.candidates[candidate].track.at(0.0).norm() <= fleet.within;
        near.then_some(PresentVisit {
            candidate,
            since: (visit.arrive_s - self.now).min(0.0),
            leave: visit.leave_s - self.now,
        })
    }
}

/// An AUV in the previous schedule, and the age of that, s.
fn served<'a>(before: Option<(f64, &'a Schedule)>, id: &VehicleId) -> Option<(f64, &'a ServedVehicle)> {
    let (elapsed, schedule) = before?;
    let known = schedule.costs.iter().find(|known| known.auv == *id)?;
    Some((elapsed, known))
}

/// Times in the next half hour, s, a fraction of a sawtooth's period apart.
fn next_half_hour() -> impl Iterator<Item = f64> {
    (0..=90_u8).map(|i| 20.0 * f64::from(i))
}
