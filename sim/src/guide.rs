//! Guidance laws for missions: from a snapshot to a reference.

use std::time::Duration;

use nalgebra::Vector2;
use planner::{
    angle::{Course, Heading},
    craft::CraftEstimate,
    goal::GoalForecast,
    los::{AscNow, LosGains, LosLaw, LosTuning, Reference, TrackingLaw},
    parameters::Parameters,
    plan::{Method, Plan, Workspace, plan, scheduled_goal},
    snapshot::{Goal, PlanRequest, PreviousPlan, Schedule, Snapshot, TrajectoryPoint},
    stop::Stop,
};

/// Error that ends a mission. A guide may be a network client, so any error is possible.
pub type GuideError = Box<dyn std::error::Error + Send + Sync>;

/// The answer of a guide.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Guidance {
    /// Speed and heading for the inner loops.
    pub reference: Reference,
    /// The method of the reference; none for a law outside of this program.
    pub method: Option<Method>,
    /// Predicted root mean square distance to the goal over the horizon, m, if the guide predicts.
    pub predicted_rms: Option<f64>,
    /// Index in the snapshot of the AUV that its schedule serves, if it has a schedule.
    pub serves: Option<usize>,
    /// Heading by which it keeps clear of other vessels, rad, while it manoeuvres for them.
    pub manoeuvre: Option<f64>,
    /// Computing time, if the caller measured it; the simulator has no clock.
    pub solve_time: Option<Duration>,
}

impl Guidance {
    /// What `plan` for `snapshot` asks for.
    pub fn planned(snapshot: &Snapshot, plan: &Plan) -> Self {
        Self {
            reference: plan.reference,
            method: Some(plan.method),
            predicted_rms: Some(plan.predicted.rms_error_m),
            serves: served(snapshot, plan.schedule.as_ref()),
            manoeuvre: manoeuvre(plan),
            solve_time: None,
        }
    }
}

impl From<Reference> for Guidance {
    /// A reference of which nothing else is known.
    fn from(reference: Reference) -> Self {
        Self { reference, method: None, predicted_rms: None, serves: None, manoeuvre: None, solve_time: None }
    }
}

/// A guidance law, with its state.
pub trait Guide {
    /// Its name in records.
    fn name(&self) -> &'static str;

    /// The reference for the next second.
    fn guide(&mut self, snapshot: &Snapshot) -> Result<Guidance, GuideError>;

    /// Its latest estimate of the craft, if it makes one.
    fn craft_estimate(&self) -> Option<&CraftEstimate> {
        None
    }
}

/// A line-of-sight law with its state.
#[derive(Clone, Debug)]
pub struct LosGuide {
    tracking: TrackingLaw,
    /// Last course of the point that the goal follows.
    course: Option<Course>,
    /// Time, s, and value (north, east), m/s, of the last known current, as the planner keeps it.
    current: Option<(f64, Vector2<f64>)>,
    /// Time, schedule and figure of the last call, if the goal visits or localises.
    chosen: Option<PreviousPlan>,
    parameters: Parameters,
}

impl LosGuide {
    /// The saturated law with these gains.
    pub fn new(gains: LosGains) -> Self {
        Self::tuned(LosTuning {
            law: LosLaw::SaturatedLos,
            gains,
            integral_gain: Parameters::default().integral_gain,
        })
    }

    /// Any of the laws.
    pub fn tuned(tuning: LosTuning) -> Self {
        Self {
            tracking: TrackingLaw::new(tuning, None),
            course: None,
            current: None,
            chosen: None,
            parameters: Parameters::default(),
        }
    }

    /// The law with its state after the last call.
    pub fn tracking(&self) -> &TrackingLaw {
        &self.tracking
    }

    /// The current (north, east) of the last call, m/s, if it was known.
    pub fn current(&self) -> Option<Vector2<f64>> {
        self.current.map(|(_, current)| current)
    }

    /// Previous plan from which a planner makes the same schedule or figure; none for other goals.
    pub fn previous_plan(&self) -> Option<PreviousPlan> {
        self.chosen.clone()
    }

    /// The goal; if it visits or localises, by the planner's schedule or figure.
    fn goal(&mut self, snapshot: &Snapshot) -> Result<GoalForecast, GuideError> {
        let (Goal::Visit(_) | Goal::Localise(_)) = &snapshot.goal.goal else {
            return Ok(GoalForecast::holding(snapshot, self.course));
        };
        let snapshot = snapshot
            .again(PlanRequest { previous_plan: self.previous_plan(), ..PlanRequest::clone(snapshot) })?;
        let (goal, schedule) = scheduled_goal(&snapshot, &self.parameters, self.course, &Stop::never());
        let nowhere = TrajectoryPoint::new(snapshot.t_s, Vector2::zeros(), 0.0, Heading::new(0.0));
        self.chosen = Some(PreviousPlan {
            trajectory: vec![nowhere],
            schedule,
            figure: goal.figure().cloned(),
            ..PreviousPlan::default()
        });
        Ok(goal)
    }
}

impl Guide for LosGuide {
    fn name(&self) -> &'static str {
        self.tracking.law().name()
    }

    fn guide(&mut self, snapshot: &Snapshot) -> Result<Guidance, GuideError> {
        let goal = self.goal(snapshot)?;
        self.course = Some(goal.course());
        let target = goal.at(0.0);
        let current = snapshot.current_after(self.current);
        self.current = current.map(|current| (snapshot.t_s, current));
        let asc = AscNow { current: current.unwrap_or_else(Vector2::zeros), ..AscNow::from(snapshot) };
        let limits = snapshot.limits();
        let through_water = self.tracking.steer(snapshot.t_s, &asc, &target, limits);
        let craft = snapshot.craft_prior().craft;
        let schedule = self.chosen.as_ref().and_then(|chosen| chosen.schedule.as_ref());
        let reference = craft.command(&through_water, &asc.current, limits.speed_max);
        Ok(Guidance {
            method: Some(Method::from(self.tracking.law())),
            serves: served(snapshot, schedule),
            ..reference.into()
        })
    }
}

/// Index in `snapshot` of the underwater vehicle that `schedule` serves now or next.
pub fn served(snapshot: &Snapshot, schedule: Option<&Schedule>) -> Option<usize> {
    let next = schedule?.next()?;
    snapshot.auvs.iter().position(|auv| auv.id == *next)
}

/// Heading by which `plan` keeps clear of other vessels, rad, if it manoeuvres for them.
pub fn manoeuvre(plan: &Plan) -> Option<f64> {
    Some(plan.avoidance.as_ref()?.manoeuvre.as_ref()?.heading_rad)
}

/// The planner with its previous plan.
#[derive(Debug)]
pub struct MpcGuide {
    parameters: Parameters,
    workspace: Workspace,
    last: Option<(Snapshot, Plan)>,
}

impl MpcGuide {
    /// The planner with `parameters`.
    pub fn new(parameters: Parameters) -> Self {
        Self { parameters, workspace: Workspace::default(), last: None }
    }

    /// The last plan and its snapshot, which has the previous plan.
    pub fn planned(&self) -> Option<&(Snapshot, Plan)> {
        self.last.as_ref()
    }
}

impl Guide for MpcGuide {
    fn name(&self) -> &'static str {
        "mpc"
    }

    fn craft_estimate(&self) -> Option<&CraftEstimate> {
        Some(self.planned()?.0.craft_estimate())
    }

    fn guide(&mut self, snapshot: &Snapshot) -> Result<Guidance, GuideError> {
        let previous_plan = self.last.take().map(|(_, plan)| PreviousPlan::from(&plan));
        let observation = PlanRequest { previous_plan, ..PlanRequest::clone(snapshot) };
        let snapshot = snapshot.again(observation)?;
        let plan = plan(&snapshot, &self.parameters, &mut self.workspace);
        let guidance = Guidance::planned(&snapshot, &plan);
        self.last = Some((snapshot, plan));
        Ok(guidance)
    }
}
