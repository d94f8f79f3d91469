//! Several surface craft that share the AUVs of one goal.
//!
//! ```text
//! missions ─ requests ─► knowledge ─► assigner ─► a plan for each craft ─► missions
//!     ▲                                   └─ calls ─► slots of the acoustic network
//! ```
//! Each craft has a [`Mission`] in a world of its own, which differs from the others by the craft
//! alone: a craft moves no AUV, but for ranges by which AUVs are localised, which all worlds get
//! from all craft. What the craft hear of the AUVs they tell each other at once. The others keep
//! clear of the place where a dead craft was last heard.

use std::time::Instant;

use nalgebra::Vector2;
use planner::los::Reference;
use planner::parameters::Parameters;
use planner::plan::Method;
use planner::snapshot::{PlanRequest, Snapshot, VehicleId};

use crate::guide::{Guidance, GuideError};
use crate::mission::Mission;
use crate::record::{FleetCraft, Record};
use crate::scenario::{Calls, Scenario, Start, SurfaceCraftFile};

mod assigner;
mod calls;
mod knowledge;
mod metrics;
mod planning;

pub use assigner::Assigner;
pub use metrics::FleetMetrics;

use calls::{Call, slots};
use planning::{FleetPlanner, Planned};

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
    let starts = scenario.starts(seed)?;
    let mut mission = FleetMission::new(starts, scenario, (assigner, Parameters::default()), (seed, clock));
    while !mission.is_over() {
        mission.step()?;
        progress(mission.done());
    }
    Ok(mission.into_record())
}

/// A mission of several craft that its caller advances tick by tick.
#[derive(Debug)]
pub struct FleetMission {
    missions: Vec<Mission>,
    planner: FleetPlanner,
    /// What makes an AUV send.
    calls: Calls,
    /// The last plans of the craft that were not dead.
    last: Vec<Planned>,
}

impl FleetMission {
    /// The mission with `seed` from the `starts` of all craft of `scenario`. `clock` times plans.
    pub fn new(
        starts: Vec<Start>,
        scenario: &Scenario,
        (assigner, parameters): (Assigner, Parameters),
        (seed, clock): (u64, Option<fn() -> Instant>),
    ) -> Self {
        let mission = |start| Mission::from_start(start, scenario, assigner.guide(), seed);
        let missions = starts.into_iter().map(mission).collect();
        let name = |file: &SurfaceCraftFile| {
            let serves = file.serves.as_ref().map(|auvs| auvs.iter().cloned().map(VehicleId).collect());
            (VehicleId(file.id.clone().unwrap_or_default()), serves)
        };
        let names = scenario.surface_craft.iter().map(name).collect();
        let mut mission = Self {
            missions,
            planner: FleetPlanner::new(names, assigner, (parameters, clock)),
            calls: scenario.knowledge.acoustics.as_ref().map_or(Calls::Unasked, |file| file.calls),
            last: vec![],
        };
        mission.begin_record();
        mission
    }

    /// Names all craft and their faults in the record, which is that of the first.
    fn begin_record(&mut self) {
        let records = self.missions.iter().map(Mission::record);
        let craft = self.planner.ids().zip(records.clone());
        let craft = craft.map(|(id, record)| FleetCraft { id: id.to_string(), limits: record.limits });
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

    /// The mission of the first craft, whose record has all, and what was last planned for first.
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
        let alive =
            self.missions.iter_mut().map(|mission| mission.position().and_then(|_| mission.request()));
        let requests: Vec<Option<PlanRequest>> = alive.collect();
        self.last = self.planner.plan(requests)?;
        self.call(&here);
        let here: Vec<Vector2<f64>> = here.into_iter().flatten().collect();
        for (number, mission) in self.missions.iter_mut().enumerate() {
            let planned = self.last.iter().find(|planned| planned.craft == number);
            if let Some(Planned { snapshot, plan, solve_time, .. }) = planned {
                mission.pursue((!snapshot.stands_by()).then_some(&snapshot.goal.goal));
                let guidance = Guidance { solve_time: *solve_time, ..Guidance::planned(snapshot, plan) };
                mission.sail(Some((snapshot, guidance)), &here);
                continue;
            }
            mission.pursue(None);
            let snapshot = mission.observe()?;
            let drifting = snapshot.as_ref().map(|snapshot| {
                let still = Reference { speed: 0.0, heading: snapshot.asc.heading() };
                (snapshot, Guidance { method: Some(Method::Hold), ..still.into() })
            });
            mission.sail(drifting, &here);
        }
        let there: Vec<Vector2<f64>> = self.missions.iter().filter_map(Mission::position).collect();
        self.missions.iter_mut().for_each(|mission| mission.navigate(&there));
        self.join_rows();
        Ok(())
    }

    /// Lets each craft, of those that are at a place, call the AUVs that it has from now on.
    fn call(&mut self, places: &[Option<Vector2<f64>>]) {
        let auvs = self.missions[0].auv_positions();
        let call = |(craft, auv, slot): (usize, usize, usize)| {
            Some(Call { craft, auv, slot, ends: [places[craft]?, auvs[auv]] })
        };
        let calls: Vec<Call> = match self.calls {
            Calls::Unasked => return,
            Calls::Planned => self.planner.table().into_iter().filter_map(call).collect(),
            Calls::Unplanned => self.planner.in_turn().into_iter().filter_map(call).collect(),
        };
        for (number, mission) in self.missions.iter_mut().enumerate() {
            if let Some(acoustics) = mission.acoustics() {
                acoustics.call(&slots(&calls, number, auvs.len(), acoustics.range_max()));
            }
        }
    }

    /// Adds what the other craft did in the last tick to the row of the first.
    fn join_rows(&mut self) {
        let [first, others @ ..] = &mut self.missions[..] else { return };
        let Some(row) = first.record_mut().rows.last_mut() else { return };
        // Several may localise one AUV together: the first of them counts.
        for (craft, auv, _) in self.planner.in_turn().into_iter().rev() {
            row.auvs[auv].craft = Some(craft);
        }
        let leads = self.last.first().map_or(0, |planned| planned.craft);
        for (number, other) in others.iter_mut().enumerate() {
            let Some(other) = other.take_rows().pop() else { continue };
            row.consorts.extend(other.surface_craft);
            // A dead craft knows no more: what the first of the others knows counts.
            for (auv, known) in row.auvs.iter_mut().zip(other.auvs).filter(|_| number + 1 == leads) {
                (auv.known, auv.navigation) = (known.known, known.navigation);
            }
        }
    }
}
