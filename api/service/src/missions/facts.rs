//! What a live mission plans for at one moment: one craft, or a fleet with who serves whom.

use std::sync::Arc;

use planner::fleet::{Assignment, Fleet, SlotUse};
use planner::parameters::Parameters;
use planner::snapshot::Snapshot;
use planner::stop::Stop;

use super::event::Written;
use super::own_craft::OwnCraft;
use super::state::{AbsenceOf, Absences, MissionState};
use crate::planning::planners;
use wire::mission::Assigned;
use wire::{FieldError, Origin, VehicleId};

/// Share of the time within which the AUVs of a fleet are estimated and assigned: a third.
const ASSIGNED_IN: usize = 3;

/// What is planned for.
pub(super) enum Facts {
    One(Box<Snapshot>),
    Fleet(Box<FleetFacts>),
}

pub(super) struct FleetFacts {
    fleet: Fleet,
    assigned: Assigned,
    absences: Absences,
    slots: Vec<Vec<SlotUse>>,
}

/// The plan of a craft, with its name in a fleet.
pub(super) struct CraftPlan {
    pub(super) id: Option<String>,
    pub(super) made: planners::Planned,
    /// Its index in the assignment.
    place: usize,
}

impl Facts {
    /// The facts of a mission at `now` on its clock, s, with the other craft of the service; `None`
    /// while reports are missing. `share` gives the stop signal of a part of the time.
    pub(super) fn of(
        state: &MissionState,
        (now, own): (f64, &OwnCraft),
        parameters: &Parameters,
        share: &dyn Fn(usize) -> Stop,
    ) -> Option<Result<Self, Vec<FieldError>>> {
        if !state.is_of_fleet() {
            let stop = share(1);
            let valid = wire::snapshot_until(state.request(now, own)?, &|| stop.is_due());
            // A previous plan can be invalid, for example beyond all coordinates: it is left out.
            let valid = valid.or_else(|_| {
                let mut request = state.request(now, own).expect("waits for no vehicle");
                request.previous_plan = None;
                wire::snapshot_until(request, &|| stop.is_due())
            });
            return Some(valid.map(|snapshot| Self::One(Box::new(snapshot))));
        }
        let absences = state.absences(now);
        let stop = share(ASSIGNED_IN);
        let fleet = state.fleet_request(now, own, &absences.away)?.fleet(&|| stop.is_due());
        let fleet = fleet.or_else(|_| {
            let request = state.fleet_request(now, own, &absences.away).expect("waits for no vehicle");
            request.without_previous_plans().fleet(&|| stop.is_due())
        });
        Some(fleet.map(|fleet| {
            let assignment = fleet.assign(parameters, &stop);
            let (away, cut_short) = (absences.away.clone(), stop.was_due());
            let assigned = Assigned { t_s: now, assignment, away, cut_short };
            let slots = fleet.slots(&assigned.assignment);
            Self::Fleet(Box::new(FleetFacts { fleet, assigned, absences, slots }))
        }))
    }

    /// The plan of each craft. `plan` plans for a snapshot, if so many plans are left with it.
    pub(super) fn plans(
        &self,
        mut plan: impl FnMut(Arc<Snapshot>, usize) -> planners::Planned,
    ) -> Vec<CraftPlan> {
        match self {
            Self::One(snapshot) => {
                vec![CraftPlan { id: None, made: plan(Arc::new(Snapshot::clone(snapshot)), 1), place: 0 }]
            }
            Self::Fleet(facts) => {
                let assignment = &facts.assigned.assignment;
                let made = facts.fleet.plans(assignment, |snapshot, left| plan(snapshot.into(), left));
                let named = made.into_iter().zip(&assignment.craft).enumerate();
                named
                    .map(|(place, (made, craft))| CraftPlan { id: Some(craft.id.0.clone()), made, place })
                    .collect()
            }
        }
    }

    fn fleet(&self) -> Option<&FleetFacts> {
        match self {
            Self::One(_) => None,
            Self::Fleet(facts) => Some(facts),
        }
    }

    /// The assignment of AUVs to craft, of a fleet.
    pub(super) fn assigned(&self) -> Option<&Assigned> {
        self.fleet().map(|facts| &facts.assigned)
    }

    /// Who serves whom in a fleet, if that is not as `before`.
    pub(super) fn news(&self, before: Option<&Assigned>) -> Option<Assigned> {
        let now = self.assigned()?;
        let of = |assigned: &Assigned| {
            let Assignment { craft, unserved, .. } = assigned.assignment.clone();
            (assigned.away.clone(), craft, unserved)
        };
        let is_as_before = |before: &Assigned| of(before) == of(now);
        (!before.is_some_and(is_as_before)).then(|| now.clone())
    }

    /// The answer to a craft, and what it leaves for its next plan.
    pub(super) fn written(&self, craft: &CraftPlan, origin: Option<Origin>) -> Written {
        let of_all = |_: &VehicleId| true;
        let Some(assigned) = self.assigned() else {
            return Written::new(&craft.made, origin, of_all);
        };
        Written::new(&craft.made, origin, |auv| Fleet::tells_of(craft.place, &assigned.assignment, auv))
    }

    /// Slots of the acoustic network of a fleet.
    pub(super) fn slots(&self) -> Vec<Vec<SlotUse>> {
        self.fleet().map_or_else(Vec::new, |facts| facts.slots.clone())
    }

    /// The absence of each craft of a fleet after the plans.
    pub(super) fn absences(&self) -> AbsenceOf {
        self.fleet().map_or_else(AbsenceOf::new, |facts| facts.absences.after.clone())
    }
}

#[cfg(test)]
mod tests {
    use serde_json::{Value, json};

    use super::*;

    fn heard(craft: Option<&str>, t_s: f64, north: f64) -> wire::mission::Reports {
        let fix = json!([{ "t_s": t_s, "north_m": north, "east_m": 5.0, "sigma_m": 1.0 }]);
        let heard = json!({ "craft": craft, "auvs": { "a": fix }, "asc": [{ "t_s": t_s, "state": { "north_m": north,
            "east_m": 0.0, "heading_rad": 0.0, "speed_mps": 1.0 } }] });
        serde_json::from_value(heard).expect("has the shape")
    }

    fn state(change: &Value) -> MissionState {
        let mut config = json!({ "auvs": [{ "id": "a" }], "goal": { "kind": "track", "auv": "a" } });
        for (name, value) in change.as_object().expect("is an object") {
            config[name] = value.clone();
        }
        MissionState::new(serde_json::from_value(config).expect("has the shape"))
    }

    fn take(state: &mut MissionState, heard: wire::mission::Reports, at_s: f64) {
        let clock = crate::missions::clock::MissionClock { created: 0.0, rate: 1.0 };
        state.apply(&crate::missions::event::Event::Reported { at_s, heard: Box::new(heard) }, &clock);
    }

    fn facts(state: &MissionState, now: f64) -> Facts {
        let facts = Facts::of(state, (now, &OwnCraft::default()), &Parameters::default(), &|_| Stop::never());
        facts.expect("waits for no vehicle").expect("is valid")
    }

    #[test]
    fn a_mission_survives_a_previous_plan_that_leads_beyond_all_coordinates() {
        for (craft, change) in [(None, json!({})), (Some("x"), json!({ "surface_craft": [{ "id": "x" }] }))] {
            let mut state = state(&change);
            take(&mut state, heard(craft, 10.0, 1e6), 10.0);
            let beyond = json!({ "trajectory": [{ "t_s": 9.0, "north_m": 3e6, "east_m": 0.0, "speed_mps": 1.0,
                "heading_rad": 0.0 }] });
            let known = state.craft_mut(craft).expect("is there");
            known.previous_plan = Some(serde_json::from_value(beyond).expect("has the shape"));
            let previous = |facts: &Facts| match facts {
                Facts::One(snapshot) => snapshot.previous_plan.clone(),
                Facts::Fleet(facts) => {
                    facts.fleet.snapshot(0, &facts.assigned.assignment, &[]).previous_plan.clone()
                }
            };
            assert_eq!(previous(&facts(&state, 10.0)), None);
        }
    }
}
