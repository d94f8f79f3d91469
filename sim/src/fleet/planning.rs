//! The planner of several craft: from what all of them know to a plan for each.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use nalgebra::Vector2;
use planner::fleet::{Assignment, CraftAssignment, Fleet, Member, SlotUse};
use planner::goal::GoalForecast;
use planner::parameters::Parameters;
use planner::plan::{Plan, Workspace, plan};
use planner::snapshot::{FieldError, PlanRequest, PreviousPlan, Snapshot, VESSELS_MAX, VehicleId, Vessel};
use planner::stop::Stop;

use super::assigner::Assigner;
use super::knowledge::shared;
use crate::guide::GuideError;

/// Time between two assignments of rules other than the planner's, s.
const ANEW: f64 = 60.0;

/// A craft's name, and the AUVs that it may serve.
type Name = (VehicleId, Option<Vec<VehicleId>>);

/// The planner with its memory.
#[derive(Debug)]
pub(super) struct FleetPlanner {
    names: Vec<Name>,
    /// Names of the AUVs, in the order of the requests.
    auvs: Vec<VehicleId>,
    assigner: Assigner,
    /// The last assignment, the last by a rule with its time, s, and the last plans.
    before: Option<Assignment>,
    assigned_at: f64,
    plans: BTreeMap<VehicleId, PreviousPlan>,
    /// The slots of the last assignment.
    slots: Vec<Vec<SlotUse>>,
    /// The place where each craft was last heard, as a vessel.
    heard: BTreeMap<VehicleId, Vessel>,
    parameters: Parameters,
    /// A clock that times plans; the simulator has none.
    clock: Option<fn() -> Instant>,
    workspace: Workspace,
}

/// A craft's plan, with what it was made for and the time that it took.
#[derive(Debug)]
pub(super) struct Planned {
    /// Number of the craft.
    pub(super) craft: usize,
    pub(super) snapshot: Snapshot,
    pub(super) plan: Plan,
    pub(super) solve_time: Option<Duration>,
}

impl AsRef<Plan> for Planned {
    fn as_ref(&self) -> &Plan {
        &self.plan
    }
}

impl FleetPlanner {
    pub(super) fn new(
        names: Vec<Name>,
        assigner: Assigner,
        (parameters, clock): (Parameters, Option<fn() -> Instant>),
    ) -> Self {
        Self {
            names,
            auvs: vec![],
            assigner,
            before: None,
            assigned_at: f64::NEG_INFINITY,
            plans: BTreeMap::new(),
            slots: vec![],
            heard: BTreeMap::new(),
            parameters,
            clock,
            workspace: Workspace::default(),
        }
    }

    /// Names of the craft.
    pub(super) fn ids(&self) -> impl Iterator<Item = &VehicleId> {
        self.names.iter().map(|(id, _)| id)
    }

    /// The plans of the craft that have a request: the others are dead.
    pub(super) fn plan(&mut self, requests: Vec<Option<PlanRequest>>) -> Result<Vec<Planned>, GuideError> {
        let (alive, requests): (Vec<usize>, Vec<PlanRequest>) =
            requests.into_iter().enumerate().filter_map(|(number, request)| Some((number, request?))).unzip();
        let Some(leading) = requests.first() else {
            (self.before, self.slots) = (None, vec![]);
            return Ok(vec![]);
        };
        let now = leading.t_s;
        let wanted: Vec<VehicleId> = leading.goal.goal.vehicles().cloned().collect();
        self.auvs = leading.auvs.iter().map(|auv| auv.id.clone()).collect();
        let fleet = self.fleet(&alive, requests)?;
        let assignment = self.assign(&alive, &fleet, (now, &wanted));
        self.slots = fleet.slots(&assignment);
        let (parameters, workspace, clock) = (&self.parameters, &mut self.workspace, self.clock);
        let planned = fleet.plans(&assignment, |snapshot, left| {
            let begun = clock.map(|now| now());
            let plan = plan(&snapshot, parameters, workspace);
            let solve_time = begun.map(|begun| begun.elapsed());
            Planned { craft: alive[alive.len() - left], snapshot, plan, solve_time }
        });
        for (place, Planned { craft, snapshot, plan, .. }) in planned.iter().enumerate() {
            let id = &self.names[*craft].0;
            let mut previous = PreviousPlan::from(plan);
            let keep = |auv: &VehicleId| Fleet::tells_of(place, &assignment, auv);
            previous.targets.iter_mut().for_each(|targets| targets.retain(|target| keep(&target.id)));
            self.plans.insert(id.clone(), previous);
            let last = Vessel::of_craft(id.clone(), now, snapshot.asc.position(), Vector2::zeros(), vec![]);
            self.heard.insert(id.clone(), last);
        }
        self.before = Some(assignment);
        Ok(planned)
    }

    /// Who calls whom by the planner's table: numbers of craft, AUV and slot.
    pub(super) fn table(&self) -> Vec<(usize, usize, usize)> {
        let slots = self.slots.iter().enumerate();
        let uses = slots.flat_map(|(slot, uses)| uses.iter().map(move |of| (&of.craft, &of.auv, slot)));
        uses.filter_map(|(craft, auv, slot)| self.numbered(craft, auv, slot)).collect()
    }

    /// Who has whom: numbers of craft and AUV, and the AUV's place among those of its craft.
    pub(super) fn in_turn(&self) -> Vec<(usize, usize, usize)> {
        let craft = self.before.iter().flat_map(|assignment| &assignment.craft);
        let each = craft.flat_map(|of| of.auvs.iter().enumerate().map(|(place, auv)| (&of.id, auv, place)));
        each.filter_map(|(craft, auv, place)| self.numbered(craft, auv, place)).collect()
    }

    fn numbered(&self, craft: &VehicleId, auv: &VehicleId, slot: usize) -> Option<(usize, usize, usize)> {
        let craft = self.ids().position(|id| id == craft)?;
        Some((craft, self.auvs.iter().position(|id| id == auv)?, slot))
    }

    /// The fleet of the craft that are `alive`, with these requests, among the dead ones.
    fn fleet(&self, alive: &[usize], requests: Vec<PlanRequest>) -> Result<Fleet, GuideError> {
        let id = |number: &usize| self.names[*number].0.clone();
        let dead = (0..self.names.len()).filter(|number| !alive.contains(number));
        // They stay where they were last heard, for as long as the mission lasts.
        let there =
            |number| Some(Vessel { t_s: Some(requests[0].t_s), ..self.heard.get(&id(&number))?.clone() });
        let drifting: Vec<Vessel> = dead.filter_map(there).collect();
        let leading = PlanRequest { auvs: shared(&requests), ..requests[0].clone() };
        let members = alive.iter().zip(requests).map(|(number, own)| Member {
            id: id(number),
            serves: self.names[*number].1.clone(),
            is_away: false,
            place_before: 0,
            request: PlanRequest {
                asc: own.asc,
                craft: own.craft,
                limits: own.limits,
                traffic: drifting.iter().cloned().chain(own.traffic).take(VESSELS_MAX).collect(),
                previous_plan: self.plans.get(&id(number)).cloned(),
                ..leading.clone()
            },
        });
        let members: Vec<Member> = members.collect();
        let gone = self.before.iter().flat_map(|before| &before.craft).filter_map(|gone| {
            let is_gone = members.iter().all(|member| member.id != gone.id);
            let previous_plan = self.plans.get(&gone.id).cloned();
            let request = PlanRequest { previous_plan, ..leading.clone() };
            let id = gone.id.clone();
            is_gone.then(|| Member { id, serves: Some(vec![]), is_away: true, place_before: 0, request })
        });
        let gone: Vec<Member> = gone.collect();
        let refused = |faults: Vec<FieldError>| -> GuideError {
            let first = faults.first().map(|fault| format!("{}: {}", fault.pointer, fault.words()));
            first.unwrap_or_default().into()
        };
        Fleet::new(members, (self.before.as_ref(), &gone), &|| false).map_err(refused)
    }

    /// Who serves whom of those AUVs that are `wanted`, at time `now`, s.
    fn assign(&mut self, alive: &[usize], fleet: &Fleet, (now, wanted): (f64, &[VehicleId])) -> Assignment {
        if self.assigner == Assigner::Planner {
            return fleet.assign(&self.parameters, &Stop::never());
        }
        let ids = || alive.iter().map(|number| &self.names[*number].0);
        let same = self.before.as_ref().filter(|before| before.craft.iter().map(|craft| &craft.id).eq(ids()));
        if let Some(before) = same.filter(|_| now < self.assigned_at + ANEW) {
            return before.clone();
        }
        self.assigned_at = now;
        let nobody = ids().cloned().map(|id| CraftAssignment { id, auvs: vec![], beside: false });
        let mut assignment = Assignment { craft: nobody.collect(), ..Assignment::default() };
        let known: Vec<Snapshot> =
            (0..alive.len()).map(|place| fleet.snapshot(place, &assignment, &[])).collect();
        let craft: Vec<Vector2<f64>> = known.iter().map(|snapshot| snapshot.asc.position()).collect();
        let forecast = GoalForecast::holding(&known[0], None);
        let auvs: Vec<Vector2<f64>> = forecast.auvs().iter().map(|auv| auv.at(0.0).position).collect();
        let may_serve = |place: usize, auv: usize| {
            let (serves, id) = (self.names[alive[place]].1.as_ref(), &self.auvs[auv]);
            wanted.contains(id) && serves.is_none_or(|serves| serves.contains(id))
        };
        let of = match &self.assigner {
            // Numbers are of all craft, dead ones too.
            Assigner::Fixed(of) => {
                let place = |number: &usize| alive.iter().position(|alive| alive == number);
                (0..auvs.len()).map(|auv| of.get(auv).and_then(place)).collect()
            }
            rule => rule.assign(&craft, &auvs, &may_serve),
        };
        for (id, place) in self.auvs.iter().zip(of) {
            if let Some(place) = place {
                assignment.craft[place].auvs.push(id.clone());
            }
        }
        assignment
    }
}
