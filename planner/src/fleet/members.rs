//! The craft of a fleet, and what each of them plans for.

use nalgebra::Vector2;

use crate::choose::answer::Plan;
use crate::choose::select::scheduler;
use crate::facts::auv::{Auv, VehicleId};
use crate::facts::field_error::FieldError;
use crate::facts::fleet::{Assignment, CraftAssignment, HandOver, SlotUse};
use crate::facts::goal::Goal;
use crate::facts::localise::Figure;
use crate::facts::ranges::{HAND_OVER, VESSEL_PLAN_LENGTH};
use crate::facts::traffic::Vessel;
use crate::facts::visit::{Reduce, Visits};
use crate::fleet::assignment::{CraftOf, Found, Search};
use crate::fleet::company::Company;
use crate::fleet::member::Member;
use crate::fleet::memory::Memory;
use crate::fleet::schedules::Schedules;
use crate::fleet::slots::slots;
use crate::predict::goal::forecast_all;
use crate::problem::parameters::Parameters;
use crate::snapshot::build::Snapshot;
use crate::snapshot::check::InvalidRequest;
use crate::solve::stop::Stop;
use crate::visit::bound::least_cost_of;

/// Time for which a spare craft is said to stay where it is, s: the longest manoeuvre.
const STAYS: f64 = 300.0;

/// The craft of a fleet at one moment, in the order in which the others give way to them.
#[derive(Clone, Debug)]
pub struct Fleet {
    pub(super) ids: Vec<VehicleId>,
    pub(super) is_away: Vec<bool>,
    /// AUVs that each may serve, as bits of `auvs`.
    pub(super) serves: Vec<u32>,
    pub(super) snapshots: Vec<Snapshot>,
    /// The AUVs that the goal depends on, as indices in the snapshots.
    pub(super) auvs: Vec<usize>,
    before: CraftOf,
    /// Time of the last change of the assignment, s.
    changed: f64,
    /// AUVs that were being handed over, and the time that it takes, s.
    hand_overs: Vec<HandOver>,
    hand_over_time: f64,
    /// Craft that localised AUVs beside others.
    pub(super) beside: Vec<CraftAssignment>,
}

impl Fleet {
    /// The fleet of `members`, at least one and without faults. `before` is its previous assignment,
    /// `gone` are the craft that it has lost. Once `due`, estimates use the newest reports alone.
    ///
    /// # Errors
    /// The faults of the first member's request with the memory of all.
    pub fn new(
        mut members: Vec<Member>,
        (before, gone): (Option<&Assignment>, &[Member]),
        due: &dyn Fn() -> bool,
    ) -> Result<Self, Vec<FieldError>> {
        let memory = Memory::of(members.iter().chain(gone));
        for request in members.iter_mut().map(|member| &mut member.request) {
            memory.give_to(request);
        }
        // AUVs are estimated once, from what any craft remembers of them.
        let leading = Snapshot::until(members[0].request.clone(), due);
        let leading = leading.map_err(|InvalidRequest(faults)| faults)?;
        let others = members[1..].iter().map(|member| leading.of_other_craft(member.request.clone()));
        let snapshots: Vec<_> = [leading.clone()].into_iter().chain(others).collect();
        let place = |id: &VehicleId| leading.auvs.iter().position(|auv| auv.id == *id);
        let mut auvs: Vec<usize> = leading.goal.goal.vehicles().filter_map(place).collect();
        auvs.sort_unstable();
        let id = |auv: &usize| &leading.auvs[*auv].id;
        let may_serve = |member: &Member| {
            let bits = auvs.iter().enumerate();
            let bits = bits.filter(|(_, auv)| !member.is_away && member.may_serve(id(auv)));
            bits.fold(0, |set, (i, _)| set | 1 << i)
        };
        let craft_of = |auv: &usize| {
            let mut own = before?.craft.iter().filter(|craft| !craft.beside);
            let craft = own.find(|craft| craft.auvs.contains(id(auv)))?;
            members.iter().position(|member| member.id == craft.id)
        };
        Ok(Self {
            serves: members.iter().map(may_serve).collect(),
            before: auvs.iter().map(craft_of).collect(),
            // A clock that was set back makes no change a recent one for long.
            changed: before.map_or(f64::NEG_INFINITY, |before| before.changed_s.min(leading.t_s)),
            beside: before.map_or_else(Vec::new, |before| {
                before.craft.iter().filter(|craft| craft.beside).cloned().collect()
            }),
            hand_overs: before.map_or_else(Vec::new, |before| before.hand_overs.clone()),
            hand_over_time: 0.0,
            is_away: members.iter().map(|member| member.is_away).collect(),
            ids: members.into_iter().map(|member| member.id).collect(),
            snapshots,
            auvs,
        })
    }

    /// The fleet whose craft still serve AUVs for that time, s, after these were given to another.
    #[must_use]
    pub fn handing_over(self, hand_over_time: f64) -> Self {
        Self { hand_over_time, ..self }
    }

    /// Who serves whom. Once `stop` is due, the best that is known by then.
    pub fn assign(&self, parameters: &Parameters, stop: &Stop) -> Assignment {
        let due = || stop.is_due();
        let leading = &self.snapshots[0];
        let parameters = &*parameters.of(leading);
        let goal = &leading.goal.goal;
        let found = if let Goal::Visit(visits) = goal {
            let schedules = self.schedules(visits, parameters, &due);
            let cost = |craft: usize, set| schedules[craft].cost(set, &due);
            let found = self.search((&cost, visits.reduce == Reduce::Max), &due);
            let reach_all = schedules.iter().all(Schedules::reaches_all);
            let fleets: Vec<_> = schedules.iter().map(|schedules| &schedules.fleet).collect();
            let bound = if reach_all { least_cost_of(&fleets).unwrap_or(0.0) } else { 0.0 };
            Found { bound: bound.min(found.cost), ..found }
        } else {
            let forecasts = forecast_all(leading);
            let craft = self.snapshots.iter().map(|snapshot| {
                let planned = parameters.planned(snapshot.craft_model()).limits;
                (snapshot.asc.position(), planned.speed_max)
            });
            let weight = |auv: &usize| goal.weight(&leading.auvs[*auv].id);
            let auvs: Vec<_> = self.auvs.iter().map(|auv| (&forecasts[*auv], weight(auv))).collect();
            let is_largest = matches!(goal, Goal::Range { .. });
            let company =
                Company::new(craft.collect(), (&auvs, leading.tuned().fleet.straight_most), is_largest);
            let cost = |craft, set| company.cost(craft, set);
            self.search((&cost, is_largest), &due)
        };
        let Found { craft_of, cost, bound, exact, kept } = found;
        let craft = self.ids.iter().enumerate().map(|(craft, id)| {
            let of = self.auvs.iter().zip(&craft_of).filter(|(_, of)| **of == Some(craft));
            CraftAssignment {
                id: id.clone(),
                auvs: of.map(|(auv, _)| leading.auvs[*auv].id.clone()).collect(),
                beside: false,
            }
        });
        let mut craft: Vec<_> = craft.collect();
        self.join(&mut craft);
        let is_as_before = craft_of == self.before && self.changed.is_finite();
        let changed_s = if is_as_before { self.changed } else { leading.t_s };
        let hand_overs = self.hand_overs_to(&craft_of);
        let unserved = self.auvs.iter().zip(&craft_of).filter(|(_, of)| of.is_none());
        let unserved = unserved.map(|(auv, _)| leading.auvs[*auv].id.clone()).collect();
        Assignment { craft, cost, bound, exact, kept, changed_s, hand_overs, unserved }
    }

    /// AUVs that other craft than those of `craft_of` still serve.
    fn hand_overs_to(&self, craft_of: &CraftOf) -> Vec<HandOver> {
        let leading = &self.snapshots[0];
        let until_s = leading.t_s + self.hand_over_time;
        let auvs = self.auvs.iter().zip(self.before.iter().zip(craft_of));
        let new = auvs.filter_map(|(auv, (before, now))| {
            let craft = self.ids[before.filter(|before| now.is_some_and(|now| now != *before))?].clone();
            Some(HandOver { auv: leading.auvs[*auv].id.clone(), craft, until_s })
        });
        let all = self.hand_overs.iter().cloned().chain(new);
        let goes_on = |hand_over: &HandOver| {
            let place = self.ids.iter().position(|id| *id == hand_over.craft);
            let auv = self.auvs.iter().position(|auv| leading.auvs[*auv].id == hand_over.auv);
            let left = hand_over.until_s - leading.t_s;
            0.0 < left
                && left <= *HAND_OVER.end()
                && auv.is_some_and(|auv| {
                    let may_serve = |place: usize| self.serves[place] & (1 << auv) != 0;
                    craft_of[auv] != place && place.is_some_and(may_serve)
                })
        };
        let mut going = Vec::<HandOver>::new();
        for hand_over in all.filter(goes_on) {
            // What was given to and fro is handed over anew.
            going.retain(|known| (&known.auv, &known.craft) != (&hand_over.auv, &hand_over.craft));
            going.push(hand_over);
        }
        going
    }

    /// The scheduling problem of each craft.
    pub(super) fn schedules(
        &self,
        visits: &Visits,
        parameters: &Parameters,
        due: &dyn Fn() -> bool,
    ) -> Vec<Schedules> {
        let mut schedules: Vec<Schedules> = Vec::new();
        for snapshot in &self.snapshots {
            let forecasts = forecast_all(snapshot);
            let scheduler = scheduler(snapshot, parameters, due);
            let of = (self.snapshots.len() as f64, schedules.first());
            schedules.push(Schedules::new((snapshot, visits), &scheduler, (&forecasts, &self.auvs), of));
        }
        schedules
    }

    fn search(&self, cost: (&dyn Fn(usize, u32) -> f64, bool), due: &dyn Fn() -> bool) -> Found {
        Search::new(self.auvs.len(), self.serves.clone(), cost, due, &self.snapshots[0].tuned().fleet)
            .best(&self.before, self.snapshots[0].t_s - self.changed)
    }

    /// The number of craft.
    pub fn n_craft(&self) -> usize {
        self.ids.len()
    }

    /// Plans for every craft by `assignment`, in the order of way: each among those before it and
    /// spare ones, as vessels with plans. `plan` gets the number of plans that are left, too.
    pub fn plans<P: AsRef<Plan>>(
        &self,
        assignment: &Assignment,
        mut plan: impl FnMut(Snapshot, usize) -> P,
    ) -> Vec<P> {
        let mut ahead = self.at_rest(assignment);
        let planned = (0..self.n_craft()).map(|craft| {
            let snapshot = self.snapshot(craft, assignment, &ahead);
            let planned = plan(snapshot, self.n_craft() - craft);
            self.add_to(&mut ahead, craft, planned.as_ref());
            planned
        });
        planned.collect()
    }

    /// Adds a craft, by index, with its plan to the vessels that those after it see, unless it is a
    /// spare one, which all see.
    pub fn add_to(&self, ahead: &mut Vec<Vessel>, craft: usize, plan: &Plan) {
        if ahead.iter().all(|vessel| vessel.id != self.ids[craft]) {
            ahead.push(self.as_vessel(craft, plan));
        }
    }

    /// The spare craft as vessels that stay where they are, or go straight on if they are away.
    pub fn at_rest(&self, assignment: &Assignment) -> Vec<Vessel> {
        let spare = (0..self.n_craft()).filter(|craft| assignment.serves(*craft).next().is_none());
        let at_rest = spare.map(|craft| {
            let snapshot = &self.snapshots[craft];
            let (asc, now) = (&snapshot.asc, snapshot.t_s);
            // Without way on it drifts with the current.
            let end = asc.position() + snapshot.current() * STAYS;
            let stays = (snapshot.current(), vec![[now + STAYS, end.x, end.y]]);
            let (velocity, plan) = if self.is_away[craft] { (self.velocity(craft), vec![]) } else { stays };
            Vessel::of_craft(self.ids[craft].clone(), now, asc.position(), velocity, plan)
        });
        at_rest.collect()
    }

    /// Velocity of a craft, by index, over ground (north, east), m/s.
    fn velocity(&self, craft: usize) -> Vector2<f64> {
        let snapshot = &self.snapshots[craft];
        let asc = &snapshot.asc;
        asc.ground_velocity().unwrap_or_else(|| asc.water_velocity() + snapshot.current())
    }

    /// What a craft, by index, plans for by `assignment`, among the vessels `ahead` of
    /// it.
    pub fn snapshot(&self, craft: usize, assignment: &Assignment, ahead: &[Vessel]) -> Snapshot {
        let snapshot = &self.snapshots[craft];
        let served: Vec<_> = assignment.serves(craft).collect();
        let goal = snapshot.goal.goal.only(|id| served.contains(&id));
        let others = (0..self.n_craft()).filter(|other| *other != craft);
        let of_others = others.flat_map(|other| assignment.serves(other));
        let of_others = of_others.filter(|id| !served.contains(id)).cloned().collect();
        let others = ahead.iter().filter(|vessel| vessel.id != self.ids[craft]);
        let least_radius = self.least_radius(assignment, craft);
        snapshot.part(goal, others.cloned(), of_others, least_radius)
    }

    /// The vessel with its `plan` that the craft after this one, an index, see.
    fn as_vessel(&self, craft: usize, plan: &Plan) -> Vessel {
        let snapshot = &self.snapshots[craft];
        let asc = &snapshot.asc;
        let most = *VESSEL_PLAN_LENGTH.end() / if plan.figure.is_some() { 2 } else { 1 };
        let step = plan.trajectory.len().div_ceil(most).max(1);
        let points = plan.trajectory.iter().skip(step).step_by(step);
        let mut points: Vec<_> = points.map(|at| [at.t_s, at.north_m, at.east_m]).collect();
        // A craft on a figure goes on with it: others would dodge one that goes straight on.
        if let (Some(figure), Some(last)) = (&plan.figure, points.last()) {
            let ends = last[0] - snapshot.t_s;
            let mean = self.mean_of(figure);
            points.extend((1..=most).map(|i| {
                let ahead = ends + (STAYS - ends).max(1.0) * i as f64 / most as f64;
                let at = mean(ahead) + figure.at(ahead).0;
                [snapshot.t_s + ahead, at.x, at.y]
            }));
        }
        Vessel::of_craft(self.ids[craft].clone(), snapshot.t_s, asc.position(), self.velocity(craft), points)
    }

    /// `true` for the AUVs that the answer to a craft, by index, tells of and remembers: those that
    /// it serves, and in that to the first craft those that nobody serves.
    pub fn tells_of(craft: usize, assignment: &Assignment, id: &VehicleId) -> bool {
        let serves = |craft: usize| assignment.serves(craft).any(|served| served == id);
        serves(craft) || craft == 0 && !(0..assignment.craft.len()).any(serves)
    }

    /// Where the mean of the vehicles of a figure is after a time, s.
    fn mean_of(&self, figure: &Figure) -> impl Fn(f64) -> Vector2<f64> + use<> {
        let leading = &self.snapshots[0];
        let weight = |id: &VehicleId| leading.goal.goal.weight(id);
        let of = |forecast, auv: &Auv| (forecast, weight(&auv.id));
        let all = forecast_all(leading).into_iter().zip(&leading.auvs);
        let is_of = |auv: &Auv| figure.vehicles.iter().any(|vehicle| vehicle.auv == auv.id);
        let auvs: Vec<_> =
            all.filter(|(_, auv)| is_of(auv)).map(|(forecast, auv)| of(forecast, auv)).collect();
        let sum: f64 = auvs.iter().map(|(_, weight)| weight).sum();
        move |ahead| auvs.iter().map(|(forecast, weight)| forecast.at(ahead).position * (weight / sum)).sum()
    }

    /// Slots of the acoustic network, one after the other, in each of which these transmissions do
    /// not disturb each other.
    pub fn slots(&self, assignment: &Assignment) -> Vec<Vec<SlotUse>> {
        let leading = &self.snapshots[0];
        let forecasts = forecast_all(leading);
        let (mut uses, mut calls) = (Vec::new(), Vec::new());
        for (k, (craft, snapshot)) in assignment.craft.iter().zip(&self.snapshots).enumerate() {
            for auv in assignment.serves(k) {
                let at = leading.auvs.iter().position(|known| known.id == *auv);
                let at = at.map_or_else(Vector2::zeros, |auv| forecasts[auv].at(0.0).position);
                uses.push(SlotUse { craft: craft.id.clone(), auv: auv.clone() });
                calls.push((snapshot.asc.position(), at));
            }
        }
        let mut table: Vec<Vec<SlotUse>> = Vec::new();
        for (slot, used) in slots(&calls, leading.range_max()).into_iter().zip(uses) {
            table.resize_with(table.len().max(slot + 1), Vec::new);
            table[slot].push(used);
        }
        table
    }
}
