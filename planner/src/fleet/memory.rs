//! What the craft of a fleet remember of AUVs, which another one may have to serve next.

use std::collections::BTreeMap;

use crate::facts::auv::VehicleId;
use crate::facts::previous_plan::{PreviousPlan, PreviousTarget};
use crate::facts::ranges::AUVS_MAX;
use crate::facts::schedule::Schedule;
use crate::fleet::member::Member;
use crate::snapshot::request::PlanRequest;

/// The memory of all craft.
#[derive(Default)]
pub(super) struct Memory {
    targets: BTreeMap<VehicleId, PreviousTarget>,
    /// A plan without anything of its craft, and a schedule without visits, of all AUVs.
    plan: Option<PreviousPlan>,
    schedule: Option<Schedule>,
}

impl Memory {
    pub(super) fn of<'a>(members: impl Iterator<Item = &'a Member>) -> Self {
        let mut memory = Self::default();
        let mut plans: Vec<_> = members.filter_map(|member| member.request.previous_plan.as_ref()).collect();
        // A craft that returns knows less than those that went on.
        plans.sort_by(|one, other| made_at(other).total_cmp(&made_at(one)));
        for plan in plans {
            for target in plan.targets.iter().flatten() {
                memory.targets.entry(target.id.clone()).or_insert_with(|| target.clone());
            }
            let newest = memory.plan.get_or_insert_with(|| PreviousPlan {
                origin: plan.origin,
                // When it was made; a trajectory that ends is followed by nobody.
                trajectory: plan.trajectory.iter().take(1).copied().collect(),
                ..PreviousPlan::default()
            });
            let is_newest = made_at(newest) <= made_at(plan);
            if let Some(schedule) = &plan.schedule {
                let all = memory.schedule.get_or_insert_with(|| Schedule {
                    visits: Vec::new(),
                    costs: Vec::new(),
                    alternatives: Vec::new(),
                    ..schedule.clone()
                });
                all.remember(schedule, is_newest);
            }
        }
        memory
    }

    /// Gives it to a craft, beside its own, which counts less if it is older.
    pub(super) fn give_to(&self, request: &mut PlanRequest) {
        let Some(without_craft) = &self.plan else { return };
        let plan = request.previous_plan.get_or_insert_with(|| without_craft.clone());
        let is_newest = made_at(without_craft) <= made_at(plan);
        plan.targets = Some(self.targets.values().take(AUVS_MAX).cloned().collect());
        match (&mut plan.schedule, &self.schedule) {
            (Some(own), Some(all)) if is_newest => own.remember(all, true),
            (own, all) => own.clone_from(all),
        }
    }
}

fn made_at(plan: &PreviousPlan) -> f64 {
    plan.made_at().unwrap_or(f64::NEG_INFINITY)
}

impl Schedule {
    /// Adds what `other` alone knows, and its lower costs if it is as new: both may have served.
    fn remember(&mut self, other: &Self, is_as_new: bool) {
        if self.unit != other.unit {
            return;
        }
        // What a craft said that was lost since may be of an earlier order.
        let theirs = other.next_visited.as_ref().filter(|_| is_as_new);
        self.next_visited = self.next_visited.take().or_else(|| theirs.cloned());
        for theirs in &other.costs {
            match self.costs.iter_mut().find(|known| known.auv == theirs.auv) {
                Some(known) if is_as_new && theirs.cost < known.cost => known.clone_from(theirs),
                Some(_) => {}
                None => self.costs.push(theirs.clone()),
            }
        }
        self.costs.truncate(AUVS_MAX);
    }
}
