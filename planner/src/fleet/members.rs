//! The craft of a fleet, and who serves whom.

use crate::choose::select::scheduler;
use crate::facts::auv::VehicleId;
use crate::facts::field_error::FieldError;
use crate::facts::fleet::{Assignment, CraftAssignment, HandOver};
use crate::facts::goal::Goal;
use crate::facts::ranges::HAND_OVER;
use crate::facts::visit::{Reduce, Visits};
use crate::fleet::assignment::{CraftOf, Found, Search};
use crate::fleet::company::Company;
use crate::fleet::member::Member;
use crate::fleet::memory::Memory;
use crate::fleet::schedules::Schedules;
use crate::predict::goal::forecast_all;
use crate::problem::parameters::Parameters;
use crate::snapshot::build::Snapshot;
use crate::snapshot::check::InvalidRequest;
use crate::solve::stop::Stop;
use crate::visit::bound::least_cost_of;

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
            request.place_ranges();
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
}
