//! The simulation of a mission, one plan at a time. It is deterministic.

use std::time::Duration;

use clock::Clock;
use planner::{
    angle::Heading,
    los::{LosTuning, Reference},
    nalgebra::Vector2,
    parameters::Parameters,
    plan::{Plan, SolverReport, Workspace, baseline_from, plan, plan_until},
    snapshot::{PlanRequest, PreviousPlan, Snapshot, Tuning},
    stop::Stop,
    tuned::Tuned,
};
use sim::guide::{Guidance, Guide as _, GuideError, LosGuide};
use sim::record::{Row, VesselRow};
use sim::scenario::{Files, Scenario};

use super::event::{Planned, StoredAnswer, Written};
use crate::planning::planners;
use wire::mission::{Simulated, TrueVehicle, TrueVessel, Truth};

/// Time between two plans of the simulator, s.
pub(super) const PERIOD: f64 = 1.0;

/// The simulated world, and the controller with its memory.
#[derive(Debug)]
pub(super) struct Simulation {
    clock: Clock,
    mission: sim::mission::Mission,
    ids: Vec<String>,
    vessel_ids: Vec<String>,
    parameters: Parameters,
    tuning: Option<Tuning>,
    previous: Option<PreviousPlan>,
    /// The controller, if it is not the planner.
    law: Option<LosGuide>,
}

#[derive(Debug)]
pub(super) struct Tick {
    pub(super) planned: Planned,
    pub(super) answer: StoredAnswer,
    pub(super) made: planners::Planned,
}

/// The scenario that the client named or sent. The error is a text for users.
pub(super) fn scenario(config: &Simulated) -> Result<Scenario, String> {
    let scenario = match (&config.scenario, &config.scenario_file) {
        (Some(name), None) => Scenario::named(name).ok_or_else(|| {
            let known = Scenario::names().join(", ");
            format!("there is no such scenario; the scenarios are {known}")
        }),
        (None, Some(text)) => {
            Scenario::parse(text, "scenario_file", Files::default()).map_err(|error| error.to_string())
        }
        _ => return Err("give either scenario, a name, or scenario_file, the content of a file".to_owned()),
    }?;
    match &scenario.surface_craft[..] {
        [craft] if craft.parameters == Tuned::DEFAULT => Ok(scenario),
        [_] => Err("surface_craft.parameters: a client may not set them".to_owned()),
        [] => Err("the scenario has no surface craft to plan for".to_owned()),
        [_, ..] => {
            let n = scenario.surface_craft.len();
            Err(format!(
                "surface_craft: a simulated mission has one craft, not {n}; `pilotfish simulate` flies several"
            ))
        }
    }
}

impl Simulation {
    pub(super) fn new(config: &Simulated, clock: &Clock) -> Result<Self, String> {
        let parameters = Parameters::default();
        let law = config.controller.law().map(|law| {
            let integral_gain = parameters.integral_gain;
            LosGuide::tuned(match config.gains {
                Some(gains) => gains.tuning(law, integral_gain),
                None => LosTuning { law, gains: parameters.los, integral_gain },
            })
        });
        let name = law.as_ref().map_or("mpc", |law| law.name());
        let mission = sim::mission::Mission::new(&scenario(config)?, name, config.seed);
        let mut mission = mission.map_err(|error| error.to_string())?;
        mission.forget_paths();
        Ok(Self {
            clock: clock.clone(),
            law,
            ids: mission.record().auv_ids.clone(),
            vessel_ids: mission.record().vessel_ids.clone(),
            mission,
            parameters,
            tuning: config.tuning.clone(),
            previous: None,
        })
    }

    pub(super) fn is_over(&self) -> bool {
        self.mission.is_over()
    }

    /// Makes a plan and simulates a second with it. A replay uses the `logged` reference instead.
    pub(super) fn tick(
        &mut self,
        logged: Option<&Planned>,
        workspace: &mut Workspace,
    ) -> Result<Tick, GuideError> {
        let time = self.mission.time();
        let seen = self.mission.observe()?.ok_or("there is no surface craft")?;
        let made = self.steer(&seen, logged, workspace)?;
        let schedule = made.plan.schedule.as_ref();
        let guidance = Guidance {
            reference: logged.map_or(made.plan.reference, |logged| reference(&logged.reference)),
            method: Some(made.plan.method),
            predicted_rms: self.law.is_none().then_some(made.plan.predicted.rms_error_m),
            serves: sim::guide::served(&seen, schedule),
            manoeuvre: sim::guide::manoeuvre(&made.plan),
            solve_time: None,
        };
        let origin = self.mission.record().origin;
        let written = Written::new(&made, origin.map(wire::Origin::from), |_| true);
        let (mut planned, answer, _) = written.planned(time, Duration::ZERO, &made);
        self.mission.step(Some((&seen, guidance)));
        let rows = self.mission.take_rows();
        planned.truth = rows.last().and_then(|row| truth(row, &self.ids, &self.vessel_ids)).map(Box::new);
        Ok(Tick { planned, answer, made })
    }

    /// The planner's plan for the snapshot `seen`, or the law's reference as a plan.
    fn steer(
        &mut self,
        seen: &Snapshot,
        logged: Option<&Planned>,
        workspace: &mut Workspace,
    ) -> Result<planners::Planned, GuideError> {
        let start = self.clock.now();
        let (snapshot, plan) = if let Some(law) = &mut self.law {
            let guidance = law.guide(seen)?;
            // The current that the law subtracts, which it filters.
            let known = seen.again(PlanRequest {
                current: law.current().map(Into::into),
                previous_plan: law.previous_plan(),
                ..PlanRequest::clone(seen)
            })?;
            // Forecasts and the law's trajectory need no program; the law made the schedule.
            let stop = Stop::at_once();
            let plan = plan_until(&known, &self.parameters, workspace, &stop);
            let along = baseline_from(&known, &self.parameters, law.tracking(), &stop);
            let plan = Plan {
                method: guidance.method.expect("a line-of-sight law is a method"),
                degraded: None,
                reference: guidance.reference,
                reference_through_water: guidance.reference,
                trajectory: along.trajectory,
                predicted: along.predicted,
                violations: along.violations,
                schedule: law.previous_plan().and_then(|plan| plan.schedule),
                solver: SolverReport { deadline_hit: false, ..plan.solver },
                ..plan
            };
            (seen.clone(), plan)
        } else {
            let observation = PlanRequest {
                previous_plan: self.previous.take(),
                tuning: self.tuning.clone().or_else(|| seen.tuning.clone()),
                ..PlanRequest::clone(seen)
            };
            let snapshot = seen.again(observation)?;
            let plan = plan(&snapshot, &self.parameters, workspace);
            self.previous = Some(PreviousPlan::from(&plan));
            (snapshot, plan)
        };
        let solve_time = logged
            .map_or_else(|| self.clock.since(start), |logged| Duration::from_nanos(logged.solve_time_ns));
        Ok(planners::Planned { snapshot: snapshot.into(), plan, solve_time })
    }
}

fn reference(logged: &wire::Reference) -> Reference {
    Reference { speed: logged.speed_mps, heading: Heading::new(logged.heading_rad) }
}

fn true_vessel(row: &VesselRow) -> TrueVessel {
    TrueVessel {
        north_m: row.position.x,
        east_m: row.position.y,
        course_rad: row.course,
        speed_mps: row.speed,
        length_m: row.length,
    }
}

fn truth(row: &Row, ids: &[String], vessel_ids: &[String]) -> Option<Truth> {
    let vehicle = |position: Vector2<f64>, depth_m, heading_rad, speed_mps| TrueVehicle {
        north_m: position.x,
        east_m: position.y,
        depth_m,
        heading_rad,
        speed_mps,
    };
    let craft = row.surface_craft.as_ref()?;
    let auvs = ids.iter().zip(&row.auvs).map(|(id, auv)| {
        let auv = vehicle(auv.position, auv.depth, auv.heading, auv.surge);
        (id.clone(), auv)
    });
    Some(Truth {
        asc: vehicle(craft.position, 0.0, craft.heading, craft.surge),
        auvs: auvs.collect(),
        goal_north_m: craft.goal.x,
        goal_east_m: craft.goal.y,
        distance_m: craft.distance(),
        energy_j: craft.energy,
        vessels: vessel_ids.iter().cloned().zip(row.vessels.iter().map(true_vessel)).collect(),
    })
}
