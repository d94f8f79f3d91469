//! Guidance laws as the mission sees them: a snapshot goes in, a reference comes out.

use std::time::Duration;

use nalgebra::Vector2;
use planner::{
    angle::Course,
    craft::CraftEstimate,
    goal::GoalForecast,
    los::{AscNow, LosGains, LosLaw, LosTuning, Reference, TrackingLaw},
    plan::{Method, Plan, Workspace, plan},
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
    /// Time that the guide took, where a caller measured it; the simulator has no clock.
    pub solve_time: Option<Duration>,
}

/// A guidance law. What it remembers between calls is its own.
pub trait Guide {
    /// Its name in records.
    fn name(&self) -> &'static str;

    /// The reference for the next second.
    fn guide(&mut self, snapshot: &Snapshot) -> Result<Guidance, GuideError>;

    /// What it made of its craft by the last look; none of a guide that learns nothing of it.
    fn craft_estimate(&self) -> Option<&CraftEstimate> {
        None
    }
}

/// A line-of-sight law, with its memory: the goal's course while the goal stands still, an integral, a box.
#[derive(Clone, Debug)]
pub struct LosGuide {
    tracking: TrackingLaw,
    /// Course of what the goal follows, when that last moved.
    course: Option<Course>,
    /// What the current (north, east) was last taken for, m/s, and when, s: as the planner remembers it.
    current: Option<(f64, Vector2<f64>)>,
}

impl LosGuide {
    /// The saturated law with these gains.
    #[must_use]
    pub fn new(gains: LosGains) -> Self {
        Self::tuned(LosTuning {
            law: LosLaw::SaturatedLos,
            gains,
            integral_gain: Policy::default().integral_gain,
        })
    }

    /// Any of the laws.
    #[must_use]
    pub fn tuned(tuning: LosTuning) -> Self {
        Self {
            tracking: TrackingLaw::new(tuning, None),
            course: None,
            current: None,
        }
    }
}

impl LosGuide {
    /// The law with what it remembers of the last look.
    #[must_use]
    pub fn tracking(&self) -> &TrackingLaw {
        &self.tracking
    }

    /// What the current (north, east) was taken for at the last look, m/s, where anything told it.
    #[must_use]
    pub fn current(&self) -> Option<Vector2<f64>> {
        self.current.map(|(_, current)| current)
    }
}

impl Guide for LosGuide {
    fn name(&self) -> &'static str {
        self.tracking.law().name()
    }

    fn guide(&mut self, snapshot: &Snapshot) -> Result<Guidance, GuideError> {
        let goal = GoalForecast::holding(snapshot, self.course);
        self.course = Some(goal.course());
        let target = goal.at(0.0);
        let current = snapshot.current_after(self.current);
        self.current = current.map(|current| (snapshot.time, current));
        let asc = AscNow {
            current: current.unwrap_or_else(Vector2::zeros),
            ..AscNow::from(snapshot)
        };
        let through_water = self
            .tracking
            .steer(snapshot.time, &asc, &target, &snapshot.limits);
        Ok(Guidance {
            reference: snapshot.craft_prior().craft.command(&through_water, &asc.current),
            method: Method::from(self.tracking.law()),
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
    last: Option<(Snapshot, Plan)>,
}

impl MpcGuide {
    /// The planner under `policy`.
    #[must_use]
    pub fn new(policy: Policy) -> Self {
        Self {
            policy,
            workspace: Workspace::default(),
            previous: None,
            last: None,
        }
    }

    /// The snapshot that the planner was given last, the plan before it included.
    #[must_use]
    pub fn asked(&self) -> Option<&Snapshot> {
        self.last.as_ref().map(|(snapshot, _)| snapshot)
    }

    /// The last plan, and the snapshot that it is of.
    #[must_use]
    pub fn planned(&self) -> Option<&(Snapshot, Plan)> {
        self.last.as_ref()
    }
}

impl Guide for MpcGuide {
    fn name(&self) -> &'static str {
        "mpc"
    }

    fn craft_estimate(&self) -> Option<&CraftEstimate> {
        self.asked().map(Snapshot::craft_estimate)
    }

    fn guide(&mut self, snapshot: &Snapshot) -> Result<Guidance, GuideError> {
        let observation = Observation {
            previous_plan: self.previous.take(),
            ..Observation::clone(snapshot)
        };
        let snapshot = Snapshot::try_from(observation)?;
        let plan = plan(&snapshot, &self.policy, &mut self.workspace);
        self.previous = Some(PreviousPlan::from(&plan));
        let guidance = Guidance {
            reference: plan.reference,
            method: plan.method,
            predicted_rms: Some(plan.predicted.rms_error),
            solve_time: None,
        };
        self.last = Some((snapshot, plan));
        Ok(guidance)
    }
}
