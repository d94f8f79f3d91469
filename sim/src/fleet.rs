//! Several surface craft that share the AUVs of one goal.
//!
//! ```text
//! missions ─ requests ─► shared knowledge ─► assigner ─► a plan for each craft ─► missions
//! ```
//! Each craft has a [`Mission`] in a world of its own, which differs from the others by the craft
//! alone: nothing that a craft does moves an AUV, but for ranges by which AUVs are localised, and
//! those all worlds get from all craft. What the craft hear of the AUVs they tell each other at
//! once. A dead craft is silent: it is planned for no more, and the others keep clear of the place
//! where it was last heard.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use nalgebra::Vector2;
use planner::angle::Heading;
use planner::fleet::{Assignment, CraftAssignment, Fleet, Member};
use planner::los::Reference;
use planner::parameters::Parameters;
use planner::plan::{Method, Plan, Workspace, plan};
use planner::snapshot::{FieldError, PlanRequest, PreviousPlan, Snapshot, VehicleId, Vessel};
use planner::stop::Stop;

use crate::guide::{Guidance, GuideError};
use crate::mission::Mission;
use crate::record::{FleetCraft, Record};
use crate::scenario::{Calls, Scenario, Start, SurfaceCraftFile};

mod assigner;
mod calls;
mod knowledge;
mod metrics;

pub use assigner::Assigner;
pub use metrics::FleetMetrics;

use calls::{Call, slots};
use knowledge::shared;

/// Time between two assignments of rules other than the planner's, s.
const ANEW: f64 = 60.0;

/// Runs `scenario`, which has several surface craft, with `seed` to its end; plans are timed by
/// `clock`. `progress` receives the completed fraction.
///
/// # Errors
/// Those of the scenario, and what the planner refuses.
pub fn run(
    scenario: &Scenario,
    assigner: Assigner,
    (seed, clock): (u64, Option<fn() -> Instant>),
    progress: &mut dyn FnMut(f64),
) -> Result<Record, GuideError> {
    let mut mission = FleetMission::new(scenario.starts(seed)?, scenario, assigner, seed);
    mission.clock = clock;
    while !mission.is_over() {
        mission.step()?;
        progress(mission.done());
    }
    Ok(mission.into_record())
}

/// A craft's name, and the AUVs that it may serve.
type Name = (VehicleId, Option<Vec<VehicleId>>);

/// A mission of several craft that its caller advances tick by tick.
#[derive(Debug)]
pub struct FleetMission {
    missions: Vec<Mission>,
    names: Vec<Name>,
    assigner: Assigner,
    /// What makes an AUV send.
    calls: Calls,
    /// The last assignment, the time of the last by a rule, s, and the last plans.
    before: Option<Assignment>,
    assigned_at: f64,
    plans: BTreeMap<VehicleId, PreviousPlan>,
    /// The place where each craft was last heard, as a vessel.
    heard: BTreeMap<VehicleId, Vessel>,
    /// The planner's parameters.
    pub parameters: Parameters,
    /// A clock that times its plans; the simulator has none.
    pub clock: Option<fn() -> Instant>,
    workspace: Workspace,
    /// The last plans of the craft that were not dead.
    last: Vec<Planned>,
}

/// A craft's plan, with what it was made for and the time that it took.
#[derive(Debug)]
struct Planned {
    snapshot: Snapshot,
    plan: Plan,
    solve_time: Option<Duration>,
}

impl AsRef<Plan> for Planned {
    fn as_ref(&self) -> &Plan {
        &self.plan
    }
}

impl FleetMission {
    /// The mission from the `starts` of all craft of `scenario`, which the caller may have changed.
    pub fn new(starts: Vec<Start>, scenario: &Scenario, assigner: Assigner, seed: u64) -> Self {
        let mission = |start| Mission::from_start(start, scenario, assigner.guide(), seed);
        let missions: Vec<Mission> = starts.into_iter().map(mission).collect();
        let name = |file: &SurfaceCraftFile| {
            let serves = file.serves.as_ref().map(|auvs| auvs.iter().cloned().map(VehicleId).collect());
            (VehicleId(file.id.clone().unwrap_or_default()), serves)
        };
        let names: Vec<Name> = scenario.surface_craft.iter().map(name).collect();
        let mut mission = Self {
            missions,
            names,
            assigner,
            calls: scenario.knowledge.acoustics.as_ref().map_or(Calls::Unasked, |file| file.calls),
            before: None,
            assigned_at: f64::NEG_INFINITY,
            plans: BTreeMap::new(),
            heard: BTreeMap::new(),
            parameters: Parameters::default(),
            clock: None,
            workspace: Workspace::default(),
            last: vec![],
        };
        mission.begin_record();
        mission
    }

    /// Names all craft and their faults in the record, which is that of the first.
    fn begin_record(&mut self) {
        let records = self.missions.iter().map(Mission::record);
        let craft = self.names.iter().zip(records.clone());
        let craft = craft.map(|((id, _), record)| FleetCraft { id: id.to_string(), limits: record.limits });
        let (fleet, mut faults) = (craft.collect(), vec![]);
        for fault in records.flat_map(|record| &record.faults) {
            if !faults.contains(fault) {
                faults.push(*fault);
            }
        }
        let record = self.missions[0].record_mut();
        (record.fleet, record.faults) = (fleet, faults);
    }

    /// `true` after its last tick.
    pub fn is_over(&self) -> bool {
        self.missions[0].is_over()
    }

    /// The completed fraction.
    pub fn done(&self) -> f64 {
        self.missions[0].done()
    }

    /// The mission of the first craft, whose record has all, and what it was last planned for.
    pub fn first(&self) -> (&Mission, Option<&Snapshot>) {
        (&self.missions[0], self.last.first().map(|planned| &planned.snapshot))
    }

    /// The record.
    pub fn into_record(mut self) -> Record {
        self.missions.swap_remove(0).into_record()
    }

    /// Advances by a tick: all craft are planned for, and sail.
    pub fn step(&mut self) -> Result<(), GuideError> {
        let here: Vec<Option<Vector2<f64>>> = self.missions.iter().map(Mission::position).collect();
        let alive: Vec<usize> = (0..here.len()).filter(|number| here[*number].is_some()).collect();
        let here: Vec<Vector2<f64>> = here.into_iter().flatten().collect();
        self.last = self.plan(&alive)?;
        let mut planned = self.last.iter();
        for (number, mission) in self.missions.iter_mut().enumerate() {
            if alive.contains(&number)
                && let Some(Planned { snapshot, plan, solve_time }) = planned.next()
            {
                mission.pursue((!snapshot.stands_by()).then_some(&snapshot.goal.goal));
                let guidance = Guidance { solve_time: *solve_time, ..Guidance::planned(snapshot, plan) };
                mission.sail(Some((snapshot, guidance)), &here);
            } else {
                let snapshot = mission.observe()?;
                let still = Reference {
                    speed: 0.0,
                    heading: snapshot.as_ref().map_or(Heading::new(0.0), |snapshot| snapshot.asc.heading()),
                };
                mission.pursue(None);
                let still = Guidance { method: Some(Method::Hold), ..still.into() };
                mission.sail(snapshot.as_ref().map(|snapshot| (snapshot, still)), &here);
            }
        }
        let there: Vec<Vector2<f64>> = self.missions.iter().filter_map(Mission::position).collect();
        self.missions.iter_mut().for_each(|mission| mission.navigate(&there));
        self.join_rows();
        Ok(())
    }

    /// Adds what the other craft did in the last tick to the row of the first.
    fn join_rows(&mut self) {
        let names = &self.names;
        let serving = |auv: &str| {
            let craft = self.before.iter().flat_map(|assignment| &assignment.craft);
            let serving = craft.clone().find(|craft| craft.auvs.iter().any(|id| id.0 == auv))?;
            names.iter().position(|(id, _)| *id == serving.id)
        };
        let auvs: Vec<Option<usize>> =
            self.missions[0].record().auv_ids.iter().map(|id| serving(id)).collect();
        let [first, others @ ..] = &mut self.missions[..] else { return };
        let Some(row) = first.record_mut().rows.last_mut() else { return };
        for (auv, craft) in row.auvs.iter_mut().zip(auvs) {
            auv.craft = craft;
        }
        for other in others.iter_mut().filter_map(|other| other.take_rows().pop()) {
            row.consorts.extend(other.surface_craft);
        }
    }

    /// The plans of the craft that are `alive`, in their order; none if all are dead.
    fn plan(&mut self, alive: &[usize]) -> Result<Vec<Planned>, GuideError> {
        let requests: Vec<PlanRequest> =
            alive.iter().filter_map(|number| self.missions[*number].request()).collect();
        if requests.is_empty() {
            self.before = None;
            return Ok(vec![]);
        }
        let fleet = self.fleet(alive, requests)?;
        let assignment = self.assign(alive, &fleet);
        self.call(&fleet, &assignment);
        let (parameters, workspace, clock) = (&self.parameters, &mut self.workspace, self.clock);
        let planned = fleet.plans(&assignment, |snapshot, _| {
            let begun = clock.map(|now| now());
            let plan = plan(&snapshot, parameters, workspace);
            Planned { snapshot, plan, solve_time: begun.map(|begun| begun.elapsed()) }
        });
        for (place, Planned { snapshot, plan, .. }) in planned.iter().enumerate() {
            let id = &assignment.craft[place].id;
            let mut previous = PreviousPlan::from(plan);
            let keep = |auv: &VehicleId| Fleet::tells_of(place, &assignment, auv);
            previous.targets.iter_mut().for_each(|targets| targets.retain(|target| keep(&target.id)));
            self.plans.insert(id.clone(), previous);
            let (at, now) = (snapshot.asc.position(), snapshot.t_s);
            let last = Vessel::of_craft(id.clone(), now, at, Vector2::zeros(), vec![]);
            self.heard.insert(id.clone(), last);
        }
        self.before = Some(assignment);
        Ok(planned)
    }

    /// Lets each craft call the AUVs that it has from now on.
    fn call(&mut self, fleet: &Fleet, assignment: &Assignment) {
        let uses: Vec<(usize, VehicleId, VehicleId)> = match self.calls {
            Calls::Unasked => return,
            Calls::Planned => {
                let table = fleet.slots(assignment).into_iter().enumerate();
                table
                    .flat_map(|(slot, uses)| uses.into_iter().map(move |of| (slot, of.craft, of.auv)))
                    .collect()
            }
            Calls::Unplanned => {
                let craft = assignment.craft.iter();
                let calls = craft.flat_map(|craft| {
                    let in_turn = craft.auvs.iter().enumerate();
                    in_turn.map(|(slot, auv)| (slot, craft.id.clone(), auv.clone()))
                });
                calls.collect()
            }
        };
        let auvs = self.missions[0].auv_positions();
        let call = |(slot, craft, auv): (usize, VehicleId, VehicleId)| {
            let craft = self.names.iter().position(|(id, _)| *id == craft)?;
            let auv = self.missions[0].record().auv_ids.iter().position(|id| *id == auv.0)?;
            Some(Call { craft, auv, slot, ends: [self.missions[craft].position()?, auvs[auv]] })
        };
        let calls: Vec<Call> = uses.into_iter().filter_map(call).collect();
        for (number, mission) in self.missions.iter_mut().enumerate() {
            if let Some(acoustics) = mission.acoustics() {
                acoustics.call(&slots(&calls, number, auvs.len(), acoustics.range_max()));
            }
        }
    }

    /// The fleet of the craft that are `alive`, with these requests, among the dead ones.
    fn fleet(&self, alive: &[usize], requests: Vec<PlanRequest>) -> Result<Fleet, GuideError> {
        let id = |number: &usize| self.names[*number].0.clone();
        let dead = (0..self.names.len()).filter(|number| !alive.contains(number));
        let drifting: Vec<Vessel> = dead.filter_map(|number| self.heard.get(&id(&number)).cloned()).collect();
        let auvs = shared(&requests);
        let leading = requests[0].clone();
        let members = alive.iter().zip(requests).map(|(number, own)| Member {
            id: id(number),
            serves: self.names[*number].1.clone(),
            is_away: false,
            place_before: 0,
            request: PlanRequest {
                asc: own.asc,
                craft: own.craft,
                limits: own.limits,
                previous_plan: self.plans.get(&id(number)).cloned(),
                auvs: auvs.clone(),
                traffic: drifting.clone(),
                ..leading.clone()
            },
        });
        let members: Vec<Member> = members.collect();
        let gone = self.before.iter().flat_map(|before| &before.craft).filter_map(|gone| {
            let is_gone = members.iter().all(|member| member.id != gone.id);
            let previous_plan = self.plans.get(&gone.id).cloned();
            let request = PlanRequest { previous_plan, ..leading.clone() };
            is_gone.then(|| Member {
                id: gone.id.clone(),
                serves: Some(vec![]),
                is_away: true,
                place_before: 0,
                request,
            })
        });
        let gone: Vec<Member> = gone.collect();
        let refused = |faults: Vec<FieldError>| -> GuideError {
            faults
                .first()
                .map_or_else(String::new, |fault| format!("{}: {}", fault.pointer, fault.words()))
                .into()
        };
        Fleet::new(members, (self.before.as_ref(), &gone), &|| false).map_err(refused)
    }

    /// Who serves whom now.
    fn assign(&mut self, alive: &[usize], fleet: &Fleet) -> Assignment {
        if self.assigner == Assigner::Planner {
            return fleet.assign(&self.parameters, &Stop::never());
        }
        let now = self.missions[0].time();
        if let Some(before) = &self.before
            && before.craft.len() == alive.len()
            && now < self.assigned_at + ANEW
        {
            return before.clone();
        }
        self.assigned_at = now;
        let nobody =
            alive.iter().map(|number| CraftAssignment { id: self.names[*number].0.clone(), auvs: vec![] });
        let mut assignment = Assignment { craft: nobody.collect(), ..Assignment::default() };
        let known: Vec<Snapshot> =
            (0..alive.len()).map(|place| fleet.snapshot(place, &assignment, &[])).collect();
        let craft: Vec<Vector2<f64>> = known.iter().map(|snapshot| snapshot.asc.position()).collect();
        let record = self.missions[0].record();
        let auvs = (0..record.auv_ids.len()).map(|auv| known[0].estimates()[auv].state.position());
        let may_serve = |place: usize, auv: usize| {
            let serves = self.names[alive[place]].1.as_ref();
            serves.is_none_or(|serves| serves.iter().any(|id| id.0 == record.auv_ids[auv]))
        };
        let of = self.assigner.assign(&craft, &auvs.collect::<Vec<_>>(), &may_serve);
        for (id, place) in record.auv_ids.iter().zip(of) {
            if let Some(place) = place {
                assignment.craft[place].auvs.push(VehicleId(id.clone()));
            }
        }
        assignment
    }
}
