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
        for plan in members.filter_map(|member| member.request.previous_plan.as_ref()) {
            for target in plan.targets.iter().flatten() {
                memory.targets.entry(target.id.clone()).or_insert_with(|| target.clone());
            }
            memory.plan.get_or_insert_with(|| PreviousPlan {
                origin: plan.origin,
                // When it was made; a trajectory that ends is followed by nobody.
                trajectory: plan.trajectory.iter().take(1).copied().collect(),
                ..PreviousPlan::default()
            });
            if let Some(schedule) = &plan.schedule {
                let all = memory.schedule.get_or_insert_with(|| Schedule {
                    visits: Vec::new(),
                    costs: Vec::new(),
                    alternatives: Vec::new(),
                    ..schedule.clone()
                });
                all.remember(schedule);
            }
        }
        memory
    }

    /// Gives it to a craft, beside its own.
    pub(super) fn give_to(&self, request: &mut PlanRequest) {
        let Some(without_craft) = &self.plan else { return };
        let plan = request.previous_plan.get_or_insert_with(|| without_craft.clone());
        plan.targets = Some(self.targets.values().take(AUVS_MAX).cloned().collect());
        match (&mut plan.schedule, &self.schedule) {
            (Some(own), Some(all)) => own.remember(all),
            (own, all) => own.clone_from(all),
        }
    }
}

impl Schedule {
    /// Adds what `other` knows of AUVs that this one does not know.
    fn remember(&mut self, other: &Self) {
        if self.unit != other.unit {
            return;
        }
        self.next_visited = self.next_visited.take().or_else(|| other.next_visited.clone());
        let is_new = |id: &VehicleId| self.costs.iter().all(|known| known.auv != *id);
        let new: Vec<_> = other.costs.iter().filter(|known| is_new(&known.auv)).cloned().collect();
        self.costs.extend(new);
        self.costs.truncate(AUVS_MAX);
    }
}
