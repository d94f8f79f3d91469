//! From a snapshot to a plan: forecast, program, and the ladder of answers behind it.

use nalgebra::Vector2;

use crate::{
    angle::Course,
    forecast::{AuvForecast, Motion},
    goal::GoalForecast,
    los::{AscNow, Reference, saturated_los, target_course},
    policy::Policy,
    snapshot::{ForecastModel, HoldStyle, Snapshot, TrajectoryPoint, VehicleId},
};

/// The answer to a snapshot.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    /// The rung of the ladder that answered.
    pub method: Method,
    /// Why the answer is degraded; `None` when the program was solved.
    pub degraded: Option<Degraded>,
    /// Speed and heading for the inner loops, now.
    pub reference: Reference,
    /// Until when the reference and the trajectory may be followed without a newer plan, s.
    pub valid_until: f64,
    /// The planned trajectory, from now on.
    pub trajectory: Vec<TrajectoryPoint>,
    /// The goal at the times of the trajectory.
    pub goal: Vec<Motion>,
    /// The goal's course when it last moved; hand it back in the next request.
    pub goal_course: Course,
    /// How each AUV was forecast, in the snapshot's order.
    pub targets: Vec<TargetForecast>,
    /// What the line-of-sight law would do.
    pub baseline: Baseline,
    /// What the solver did.
    pub solver: SolverReport,
    /// What the answer is predicted to lead to.
    pub predicted: Predicted,
    /// Soft limits that the plan does not keep.
    pub violations: Vec<Violation>,
}

/// A rung of the decision ladder.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// The convex program, solved.
    Mpc,
    /// The previous plan, followed further.
    PreviousPlan,
    /// The saturated line-of-sight law.
    SaturatedLos,
    /// Slow turn or stop.
    Hold,
}

/// Why an answer is degraded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Degraded {
    /// The solver ended in a status that proves nothing.
    Solver(SolverStatus),
}

/// How a solve ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SolverStatus {
    /// Not started.
    Unsolved,
    /// Optimal within tolerance.
    Solved,
    /// Optimal within a wider tolerance.
    AlmostSolved,
    /// No point satisfies the constraints.
    PrimalInfeasible,
    /// The cost is unbounded below.
    DualInfeasible,
    /// Primal infeasible within a wider tolerance.
    AlmostPrimalInfeasible,
    /// Dual infeasible within a wider tolerance.
    AlmostDualInfeasible,
    /// Out of iterations.
    MaxIterations,
    /// Out of time.
    MaxTime,
    /// The arithmetic failed.
    NumericalError,
    /// Steps became too short.
    InsufficientProgress,
    /// The caller asked it to stop.
    CallbackTerminated,
}

/// Where one AUV is expected at the times of the trajectory.
#[derive(Clone, Debug, PartialEq)]
pub struct TargetForecast {
    /// The AUV.
    pub id: VehicleId,
    /// The model used.
    pub model: ForecastModel,
    /// Positions (north, east) at the times of the trajectory, m.
    pub positions: Vec<Vector2<f64>>,
}

/// The line-of-sight law on the same snapshot.
#[derive(Clone, Debug, PartialEq)]
pub struct Baseline {
    /// Its reference.
    pub reference: Reference,
    /// Where it leads, rolled out over the horizon.
    pub trajectory: Vec<TrajectoryPoint>,
    /// What it is predicted to lead to.
    pub predicted: Predicted,
}

/// What a trajectory costs, computed from the trajectory alone.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Predicted {
    /// Tracking, velocity and acceleration terms of the program's cost.
    pub merit: f64,
    /// Root mean square distance to the goal over the horizon, m.
    pub rms_error: f64,
    /// Propulsion energy over the horizon, J.
    pub energy: f64,
}

/// What the solver did, over all passes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SolverReport {
    /// Status of the last pass.
    pub status: SolverStatus,
    /// Programs solved.
    pub passes: usize,
    /// Interior-point iterations, all passes together.
    pub iterations: u32,
    /// Residuals of the last pass, recomputed outside the solver.
    pub residuals: Option<Residuals>,
}

/// How well a solution satisfies the optimality conditions, recomputed from the program's data.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Residuals {
    /// ‖A x + s − b‖∞ relative to the size of its terms.
    pub primal: f64,
    /// ‖P x + q + Aᵀ z‖∞ relative to the size of its terms.
    pub dual: f64,
    /// Difference of primal and dual objective relative to their size.
    pub gap: f64,
}

/// A soft limit that a plan does not keep.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Violation {
    /// Which.
    pub limit: SoftLimit,
    /// Time of the worst, s on the snapshot's clock.
    pub time: f64,
    /// By how much at worst, in the limit's own unit (m/s, or m/s² for the turn rate's row).
    pub amount: f64,
}

/// Limits that may be broken at a price.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SoftLimit {
    /// Least forward speed, m/s.
    ForwardSpeed,
    /// Turn rate, as lateral acceleration beyond speed × rate, m/s².
    TurnRate,
    /// Cone around the direction of travel in which the program is a good model, m/s.
    TrustCone,
}

/// Memory that a caller keeps between plans: solvers by problem shape. Has no effect on any answer.
#[derive(Debug, Default)]
pub struct Workspace {}

/// STUB while the program is being written: LOS only.
#[must_use]
pub fn plan(snapshot: &Snapshot, policy: &Policy, _workspace: &mut Workspace) -> Plan {
    let goal = GoalForecast::new(snapshot);
    let now = goal.at(0.0);
    let held = snapshot
        .previous_plan
        .as_ref()
        .and_then(|previous| previous.goal_course);
    let course = target_course(&now, held);
    let reference = saturated_los(
        &AscNow::from(snapshot),
        &now,
        course,
        policy.los,
        &snapshot.limits,
    );
    let _ = HoldStyle::Stop;
    let times: Vec<f64> = std::iter::once(0.0)
        .chain(policy.steps.iter().scan(0.0, |t, step| {
            *t += step;
            Some(*t)
        }))
        .collect();
    let trajectory: Vec<_> = times
        .iter()
        .map(|t| TrajectoryPoint {
            time: snapshot.time + t,
            position: snapshot.asc.position,
            speed: reference.speed,
            heading: reference.heading,
        })
        .collect();
    let predicted = Predicted {
        merit: 0.0,
        rms_error: 0.0,
        energy: 0.0,
    };
    Plan {
        method: Method::SaturatedLos,
        degraded: Some(Degraded::Solver(SolverStatus::Unsolved)),
        reference,
        valid_until: snapshot.time + policy.validity,
        goal: times.iter().map(|t| goal.at(*t)).collect(),
        goal_course: course,
        targets: snapshot
            .auvs
            .iter()
            .map(|auv| {
                let forecast = AuvForecast::new(auv, snapshot.forecast);
                TargetForecast {
                    id: auv.id.clone(),
                    model: forecast.model,
                    positions: times.iter().map(|t| forecast.at(*t).position).collect(),
                }
            })
            .collect(),
        baseline: Baseline {
            reference,
            trajectory: trajectory.clone(),
            predicted,
        },
        trajectory,
        solver: SolverReport {
            status: SolverStatus::Unsolved,
            passes: 0,
            iterations: 0,
            residuals: None,
        },
        predicted,
        violations: vec![],
    }
}
