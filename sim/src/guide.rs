//! Guidance laws as the mission sees them: a snapshot goes in, a reference comes out.

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
}

/// A guidance law. What it remembers between calls is its own.
pub trait Guide {
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
    fn guide(&mut self, snapshot: &Snapshot) -> Result<Guidance, GuideError> {
        let target = GoalForecast::new(snapshot).at(0.0);
        let course = target_course(&target, self.course);
        self.course = Some(course);
        let asc = AscNow::from(snapshot);
        let reference = saturated_los(&asc, &target, course, self.gains, &snapshot.limits);
        Ok(Guidance {
            reference,
            method: Method::SaturatedLos,
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
        })
    }
}
