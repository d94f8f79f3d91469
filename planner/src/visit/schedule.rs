//! The schedule that answers: the best of those that begin with each AUV, unless the one before is about as good.

use std::collections::BTreeSet;

use crate::{
    facts::{
        auv::VehicleId,
        goal::Goal,
        ranges::VISITS_MAX,
        schedule::{Alternative, LeftOut, Schedule, ServedVehicle, Visit},
        visit::Visits,
    },
    predict::{forecast::AuvForecast, goal::Turn},
    snapshot::build::Snapshot,
    visit::{
        fleet::{Fleet, Member, SchedulingParameters},
        search::{Found, Present, TIE},
        sentence::sentence,
        state::Stay,
    },
};

/// A schedule, and whom the goal follows by it.
#[derive(Clone, Debug)]
pub(crate) struct Scheduled {
    pub(crate) schedule: Schedule,
    /// In order of time, at least one.
    pub(crate) turns: Vec<Turn>,
}

/// What a schedule needs to know beside the snapshot.
#[derive(Clone, Copy)]
pub(crate) struct Scheduler<'a> {
    pub(crate) parameters: &'a SchedulingParameters,
    /// Largest speed through the water that is planned, m/s, and rate of turn, rad/s.
    pub(crate) speed: f64,
    pub(crate) turn_rate: f64,
    /// Oldest report of an AUV that is visited, s.
    pub(crate) report_age_max: f64,
    /// Whether it is time to stop.
    pub(crate) due: &'a dyn Fn() -> bool,
}

impl Scheduler<'_> {
    /// The schedule of `snapshot`; none if its goal does not visit. `forecasts` are those of all its AUVs.
    pub(crate) fn schedule(&self, snapshot: &Snapshot, forecasts: &[AuvForecast]) -> Option<Scheduled> {
        let Goal::Visit(visits) = &snapshot.goal.goal else {
            return None;
        };
        let memory = Memory::of(snapshot, visits);
        let mut vehicles = memory.vehicles(snapshot, visits, forecasts, self.report_age_max);
        let fleet = self.fleet(snapshot, visits, &vehicles, forecasts);
        for vehicle in &mut vehicles {
            if fleet.out_of_reach.contains(&vehicle.auv) {
                vehicle.served.left_out = Some(LeftOut::OutOfReach);
            }
        }
        let ids: Vec<&VehicleId> = fleet
            .candidates
            .iter()
            .map(|candidate| &snapshot.auvs[candidate.auv].id)
            .collect();
        let present = memory.present(&fleet, &ids);
        let found = self.of_each_first(&fleet, &ids, present, visits.next.as_ref());
        let before = memory.next_if_still_so(&vehicles);
        let before = before.and_then(|id| ids.iter().position(|known| *known == id));
        let chosen = chosen(&found, before, self.parameters.keep_margin);
        Some(
            Answer {
                snapshot,
                visits,
                fleet: &fleet,
                ids: &ids,
                vehicles,
                present,
            }
            .of(&found, chosen, before, forecasts),
        )
    }

    fn fleet(
        &self,
        snapshot: &Snapshot,
        visits: &Visits,
        vehicles: &[Vehicle],
        forecasts: &[AuvForecast],
    ) -> Fleet {
        let visited = vehicles
            .iter()
            .filter(|vehicle| vehicle.served.left_out.is_none());
        let members: Vec<_> = visited
            .map(|vehicle| Member {
                auv: vehicle.auv,
                weight: visits.weight(&vehicle.served.auv),
                cost: vehicle.served.cost,
                deadline: vehicle.deadline,
            })
            .collect();
        let craft = (self.speed, self.turn_rate);
        Fleet::new(snapshot, visits, &members, forecasts, craft, self.parameters)
    }

    /// The best schedule that begins with each candidate that may be first.
    fn of_each_first(
        &self,
        fleet: &Fleet,
        ids: &[&VehicleId],
        present: Option<Present>,
        pinned: Option<&VehicleId>,
    ) -> Vec<(usize, Found)> {
        let pinned = pinned.and_then(|pinned| ids.iter().position(|id| *id == pinned));
        // No visit is cut short.
        let begun = present.filter(|present| 0.0 < present.since + fleet.dwell_min);
        let only = pinned.or(begun.map(|present| present.candidate));
        let firsts = (0..ids.len()).filter(|first| only.is_none_or(|only| only == *first));
        let best = |first| {
            let found = fleet.best_first(first, present, self.parameters.visits_tried, self.due);
            found.map(|found| (first, found))
        };
        firsts.filter_map(best).collect()
    }
}

/// The place in `found` of the schedule that answers: the best, unless the one that begins as `before` is about as good.
fn chosen(found: &[(usize, Found)], before: Option<usize>, keep_margin: f64) -> Option<usize> {
    let value = |place: usize| found[place].1.value;
    let best = (0..found.len()).reduce(|best, next| {
        if value(next) < value(best) - TIE * value(best).abs() {
            next
        } else {
            best
        }
    })?;
    let kept = found.iter().position(|(first, _)| Some(*first) == before);
    kept.filter(|kept| value(*kept) <= value(best) * (1.0 + keep_margin))
        .or(Some(best))
}

/// An AUV that the goal depends on.
struct Vehicle {
    /// Its place among the snapshot's AUVs.
    auv: usize,
    served: ServedVehicle,
    /// A deadline that is not met yet, s after now.
    deadline: Option<f64>,
}

/// What the schedule before says.
struct Memory<'a> {
    now: f64,
    /// Time since it was made, s, and the schedule.
    before: Option<(f64, &'a Schedule)>,
}

impl<'a> Memory<'a> {
    /// Of a schedule for another kind of cost, nothing is remembered.
    fn of(snapshot: &'a Snapshot, visits: &Visits) -> Self {
        let previous = snapshot.previous_plan.as_ref();
        let before = previous.and_then(|plan| Some((plan.made_at()?, plan.schedule.as_ref()?)));
        let same = before.filter(|(_, schedule)| schedule.unit == visits.cost.unit());
        Self {
            now: snapshot.t_s,
            before: same.map(|(then, schedule)| ((snapshot.t_s - then).max(0.0), schedule)),
        }
    }

    /// All that the goal depends on, in its order, their costs carried on until now. An AUV that the craft is near now counts as
    /// served since the schedule before.
    fn vehicles(
        &self,
        snapshot: &Snapshot,
        visits: &Visits,
        forecasts: &[AuvForecast],
        report_age_max: f64,
    ) -> Vec<Vehicle> {
        let law = &visits.cost;
        let vehicle = |id: &VehicleId| {
            let auv = snapshot.auvs.iter().position(|auv| auv.id == *id);
            let auv = auv.expect("a snapshot's goal names only vehicles that are in it");
            let (forecast, age) = (&forecasts[auv], snapshot.estimates()[auv].state.age_s);
            let silent = report_age_max < age;
            let distance = (forecast.at(0.0).position - snapshot.asc.position()).norm();
            let depth = forecast.depth_at(0.0).max(0.0);
            let near = !silent && distance <= visits.within_m && law.reaches(depth);
            let known = self.known(id);
            let carried = known.map_or_else(
                || law.fresh(),
                |(elapsed, known)| {
                    let later = if near {
                        law.served(known.cost, elapsed, depth.hypot(distance))
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
                (!can_be_served(visits, forecast)).then_some(LeftOut::TooDeep)
            };
            Vehicle {
                auv,
                deadline: asked.filter(|_| met.is_none()).map(|asked| asked - self.now),
                served: ServedVehicle {
                    auv: id.clone(),
                    cost: visits.costs_now.get(id).copied().unwrap_or(carried),
                    served_by_s: met,
                    left_out,
                },
            }
        };
        snapshot.goal.goal.vehicles().map(vehicle).collect()
    }

    fn known(&self, id: &VehicleId) -> Option<(f64, &'a ServedVehicle)> {
        let (elapsed, schedule) = self.before?;
        let known = schedule.costs.iter().find(|known| known.auv == *id)?;
        Some((elapsed, known))
    }

    /// The visit that is on, or else the next one.
    fn next(&self) -> Option<&'a Visit> {
        let (_, schedule) = self.before?;
        schedule.visits.iter().find(|visit| self.now < visit.leave_s)
    }

    /// The AUV of [`Memory::next`], if the same AUVs can be visited as then: else everything is scheduled anew.
    fn next_if_still_so(&self, vehicles: &[Vehicle]) -> Option<&'a VehicleId> {
        let (_, schedule) = self.before?;
        let then = schedule.costs.iter();
        let then: BTreeSet<_> = then
            .filter(|known| known.left_out.is_none())
            .map(|known| &known.auv)
            .collect();
        let now = vehicles
            .iter()
            .filter(|vehicle| vehicle.served.left_out.is_none());
        let now: BTreeSet<_> = now.map(|vehicle| &vehicle.served.auv).collect();
        self.next().filter(|_| then == now).map(|visit| &visit.auv)
    }

    /// The visit that is on, or that begins now because the craft is there.
    fn present(&self, fleet: &Fleet, ids: &[&VehicleId]) -> Option<Present> {
        let visit = self.next()?;
        let candidate = ids.iter().position(|id| **id == visit.auv)?;
        let near = fleet.candidates[candidate].track.at(0.0).norm() <= fleet.within;
        near.then_some(Present {
            candidate,
            since: (visit.arrive_s - self.now).min(0.0),
            leave: visit.leave_s - self.now,
        })
    }
}

/// Whether an AUV is ever shallow enough to be served, in the next half hour.
fn can_be_served(visits: &Visits, forecast: &AuvForecast) -> bool {
    let times = (0..=SAMPLES_OF_DEPTH).map(|i| f64::from(i) * DEPTH_SAMPLED_EVERY);
    times
        .map(|time| forecast.depth_at(time).max(0.0))
        .any(|depth| visits.cost.reaches(depth))
}

/// Samples of half an hour, and the time between them, s: a fraction of the period of a sawtooth.
const SAMPLES_OF_DEPTH: u8 = 90;
const DEPTH_SAMPLED_EVERY: f64 = 20.0;

/// What an answer is made of.
struct Answer<'a> {
    snapshot: &'a Snapshot,
    visits: &'a Visits,
    fleet: &'a Fleet,
    /// Names of the candidates.
    ids: &'a [&'a VehicleId],
    vehicles: Vec<Vehicle>,
    present: Option<Present>,
}

impl Answer<'_> {
    /// The answer with the one of `found` that was `chosen`, `before` being the candidate of the schedule before.
    fn of(
        self,
        found: &[(usize, Found)],
        chosen: Option<usize>,
        before: Option<usize>,
        forecasts: &[AuvForecast],
    ) -> Scheduled {
        let best = chosen.map(|chosen| &found[chosen].1);
        let stays = best.map_or(&[][..], |best| &best.stays);
        let cost = best.map_or(0.0, |best| best.cost);
        let bound = if best.is_some() {
            self.fleet.bound(&self.fleet.start()).min(cost)
        } else {
            0.0
        };
        let alternatives = self.alternatives(found, chosen);
        let mut schedule = Schedule {
            unit: self.visits.cost.unit(),
            visits: stays
                .iter()
                .take(VISITS_MAX)
                .map(|stay| self.visit(stay))
                .collect(),
            cost,
            bound,
            gap: if cost > 0.0 { 1.0 - bound / cost } else { 0.0 },
            exact: found.iter().all(|(_, found)| found.exact),
            alternatives,
            deadlines_missed: self.late(best.map_or(0, |best| best.missed)),
            sentence: String::new(),
            kept: before.is_some() && before == stays.first().map(|stay| stay.candidate),
            costs: Vec::new(),
        };
        let turns = self.turns(stays, forecasts);
        schedule.costs = self.vehicles.into_iter().map(|vehicle| vehicle.served).collect();
        schedule.sentence = sentence(&schedule, &self.visits.cost, self.snapshot.t_s);
        Scheduled { schedule, turns }
    }

    fn visit(&self, stay: &Stay) -> Visit {
        let now = self.snapshot.t_s;
        // One that is on began when it did.
        let begun = self
            .present
            .filter(|present| stay.arrive <= 0.0 && present.candidate == stay.candidate);
        Visit {
            auv: self.ids[stay.candidate].clone(),
            arrive_s: now + begun.map_or(stay.arrive, |present| present.since),
            leave_s: now + stay.leave,
            cost_before: stay.cost_before,
            cost_after: stay.cost_after,
        }
    }

    /// Who is not served by a deadline within the horizon.
    fn late(&self, missed: u32) -> Vec<VehicleId> {
        let late = |vehicle: &&Vehicle| match vehicle.served.left_out {
            Some(_) => vehicle
                .deadline
                .is_some_and(|deadline| deadline < self.fleet.horizon),
            None => {
                let mut candidates = self.fleet.candidates.iter();
                let place = candidates.position(|candidate| candidate.auv == vehicle.auv);
                place.is_some_and(|place| missed & (1 << place) != 0)
            }
        };
        let vehicles = self.vehicles.iter().filter(late);
        vehicles.map(|vehicle| vehicle.served.auv.clone()).collect()
    }

    /// All but the chosen one, the cheapest first, a missed deadline being dearer than any cost.
    fn alternatives(&self, found: &[(usize, Found)], chosen: Option<usize>) -> Vec<Alternative> {
        let others = found.iter().enumerate();
        let mut others: Vec<_> = others
            .filter(|(place, _)| Some(*place) != chosen)
            .map(|(_, other)| other)
            .collect();
        others.sort_by(|a, b| a.1.value.total_cmp(&b.1.value));
        let alternative = |(first, found): &(usize, Found)| Alternative {
            next: self.ids[*first].clone(),
            cost: found.cost,
            deadlines_missed: found.missed.count_ones() as usize,
        };
        others.into_iter().map(alternative).collect()
    }

    /// Whom the goal follows: the AUV of a visit from the departure of the one before. Without a visit, the nearest that was heard.
    fn turns(&self, stays: &[Stay], forecasts: &[AuvForecast]) -> Vec<Turn> {
        let turn = |stay: &Stay| Turn {
            until: stay.leave,
            auv: self.fleet.candidates[stay.candidate].auv,
        };
        let mut turns: Vec<_> = stays.iter().map(turn).collect();
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
            turns.extend(nearest.map(|vehicle| Turn {
                until: f64::INFINITY,
                auv: vehicle.auv,
            }));
        }
        turns
    }
}
