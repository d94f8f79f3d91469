//! Guidance laws as the mission sees them: a snapshot goes in, a reference comes out.

use std::time::Duration;

use planner::{
    angle::Course,
    goal::GoalForecast,
    los::{AscNow, LosGains, Reference, saturated_los, target_course},
    plan::{Method, Workspace, plan},
    policy::Policy,
    snapshot::{Observation, PreviousPlan, Snapshot},
};

/// Why a mission could not go on. Guides may live behind a network, so any error may reach here.
pub type GuideError = Box<dyn std::error::Error + Send + Sync>;

/// What a guide answers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Guidance {
    /// Speed and heading for the inner loops.
    pub reference: Reference,
    /// How it was found.
    pub method: Method,
    /// Root mean square distance to the goal that the guide predicts over its horizon, m, if it predicts.
    pub predicted_rms: Option<f64>,
    /// How long it took to find, where somebody held a clock; the simulator has none.
    pub solve_time: Option<Duration>,
}

/// A guidance law. What it remembers between calls is its own.
pub trait Guide {
    /// Its name in records.
    fn name(&self) -> &'static str;

    /// The reference for the next second.
    fn guide(&mut self, snapshot: &Snapshot) -> Result<Guidance, GuideError>;
}

/// The saturated line-of-sight law. Remembers the goal's course while the goal stands still.
#[derive(Clone, Debug)]
pub struct LosGuide {
    gains: LosGains,
    course: Option<Course>,
}

impl LosGuide {
    /// The law with these gains.
    #[must_use]
    pub fn new(gains: LosGains) -> Self {
        Self { gains, course: None }
    }
}

impl Guide for LosGuide {
    fn name(&self) -> &'static str {
        "saturated_los"
    }

    fn guide(&mut self, snapshot: &Snapshot) -> Result<Guidance, GuideError> {
        let target = GoalForecast::new(snapshot).at(0.0);
        let course = target_course(&target, self.course);
        self.course = Some(course);
        let asc = AscNow::from(snapshot);
        let reference = saturated_los(&asc, &target, course, self.gains, &snapshot.limits);
        Ok(Guidance {
            reference,
            method: Method::SaturatedLos,
            predicted_rms: None,
            solve_time: None,
        })
    }
}

/// The planner. Hands each plan back with the next snapshot.
#[derive(Debug)]
pub struct MpcGuide {
    policy: Policy,
    workspace: Workspace,
    previous: Option<PreviousPlan>,
}

impl MpcGuide {
    /// The planner under `policy`.
    #[must_use]
    pub fn new(policy: Policy) -> Self {
        Self {
            policy,
            workspace: Workspace::default(),
            previous: None,
        }
    }
}

impl Guide for MpcGuide {
    fn name(&self) -> &'static str {
        "mpc"
    }

    fn guide(&mut self, snapshot: &Snapshot) -> Result<Guidance, GuideError> {
        let observation = Observation {
            previous_plan: self.previous.take(),
            ..Observation::clone(snapshot)
        };
        let plan = plan(
            &Snapshot::try_from(observation)?,
            &self.policy,
            &mut self.workspace,
        );
        self.previous = Some(PreviousPlan::from(&plan));
        Ok(Guidance {
            reference: plan.reference,
            method: plan.method,
            predicted_rms: Some(plan.predicted.rms_error),
            solve_time: None,
        })
    }
}
