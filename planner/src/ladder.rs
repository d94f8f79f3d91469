//! The decision ladder: one snapshot, one answer, never silence.
//!
//! Solved program → previous plan, followed further → saturated line of sight → hold.

use nalgebra::Vector2;

use crate::{
    angle::Heading,
    certificate::Residuals,
    forecast::AuvForecast,
    goal::GoalForecast,
    horizon::{Horizon, point_at, previous_points},
    los::{AscNow, Reference, saturated_los},
    plan::{Baseline, Degraded, Method, Plan, Programs, SoftLimit, SolverReport, TargetForecast, Violation},
    policy::Policy,
    program::{LENGTH_UNIT, Layout, Pass, Program, Slack},
    response::Stage,
    snapshot::{Goal, HoldStyle, Limits, Snapshot, TrajectoryPoint},
    solve::{Solution, SolverStatus},
};

/// A slack below this is the solver's tolerance, not a broken limit, m/s or m/s².
const SLACK_NOTICEABLE: f64 = 1e-3;

/// A goal beyond this multiple of the way that the horizon allows pulls no harder for being farther:
/// it bounds the cost's gradient, and with it the price at which soft limits hold.
const GOAL_REACH: f64 = 1.5;

/// How far a slow turn's heading reference leads the craft, rad, starboard.
const SLOW_TURN_LEAD: f64 = 0.2;

/// What one rung offers.
struct Candidate {
    method: Method,
    reference: Reference,
    stages: Vec<Stage>,
}

/// Plans for `snapshot` from the highest rung that holds.
pub(crate) fn descend(
    snapshot: &Snapshot,
    policy: &Policy,
    programs: &mut Programs,
    solve: &mut dyn FnMut(&Program) -> Solution,
) -> Plan {
    let goal = GoalForecast::new(snapshot);
    let horizon = Horizon::new(snapshot, policy, &goal);
    let los_stages = horizon.los_stages(snapshot, policy, &goal, policy.los);
    let los = Candidate {
        method: Method::SaturatedLos,
        reference: saturated_los(
            &AscNow::from(snapshot),
            &goal.at(0.0),
            horizon.goal_course,
            policy.los,
            &snapshot.limits,
        ),
        stages: los_stages,
    };
    let baseline = Baseline {
        reference: los.reference,
        trajectory: horizon.trajectory(&los.stages),
        predicted: horizon.predict(&los.stages, &policy.weights),
    };

    let mut optimiser = Optimiser {
        snapshot,
        policy,
        horizon: &horizon,
        programs,
        solve,
    };
    let optimum = if goal_is_stale(snapshot, policy) {
        Optimum::none(Degraded::StaleReport)
    } else {
        optimiser.run(&los.stages)
    };
    let candidate = match (&optimum.stages, optimum.degraded) {
        (Some(stages), _) => Candidate {
            method: Method::Mpc,
            reference: reference_of(&horizon, stages, snapshot, policy),
            stages: stages.clone(),
        },
        (None, Some(Degraded::StaleReport)) => hold(snapshot, &horizon),
        (None, _) => previous_plan(snapshot, policy, &horizon).unwrap_or(los),
    };
    Plan {
        method: candidate.method,
        degraded: optimum.degraded,
        reference: candidate.reference,
        valid_until: snapshot.time + policy.validity,
        trajectory: horizon.trajectory(&candidate.stages),
        goal: horizon.times.iter().map(|time| goal.at(*time)).collect(),
        goal_course: horizon.goal_course,
        targets: targets(snapshot, &horizon),
        baseline,
        solver: optimum.report,
        predicted: horizon.predict(&candidate.stages, &policy.weights),
        violations: optimum.violations,
    }
}

/// Whether the goal rests on a report that is too old to be forecast.
fn goal_is_stale(snapshot: &Snapshot, policy: &Policy) -> bool {
    let named = match &snapshot.goal {
        Goal::Track { auv } => std::slice::from_ref(auv),
        Goal::Intermittent { auvs, .. } | Goal::Midpoint { auvs } => auvs.as_slice(),
    };
    named
        .iter()
        .filter_map(|id| snapshot.auv(id))
        .any(|auv| auv.age > policy.report_age_max)
}

fn targets(snapshot: &Snapshot, horizon: &Horizon) -> Vec<TargetForecast> {
    let forecast = |auv| AuvForecast::new(auv, snapshot.forecast);
    snapshot
        .auvs
        .iter()
        .map(|auv| TargetForecast {
            id: auv.id.clone(),
            model: forecast(auv).model,
            positions: horizon
                .times
                .iter()
                .map(|time| forecast(auv).at(*time).position)
                .collect(),
        })
        .collect()
}

/// The passes of the convex program on one snapshot.
struct Optimiser<'a> {
    snapshot: &'a Snapshot,
    policy: &'a Policy,
    horizon: &'a Horizon,
    programs: &'a mut Programs,
    solve: &'a mut dyn FnMut(&Program) -> Solution,
}

/// What the passes led to: stages, or the reason why there are none.
struct Optimum {
    stages: Option<Vec<Stage>>,
    degraded: Option<Degraded>,
    report: SolverReport,
    violations: Vec<Violation>,
}

impl Optimum {
    fn none(reason: Degraded) -> Self {
        Self {
            stages: None,
            degraded: Some(reason),
            report: SolverReport {
                status: SolverStatus::Unsolved,
                passes: 0,
                iterations: 0,
                residuals: None,
            },
            violations: Vec::new(),
        }
    }
}

impl Optimiser<'_> {
    /// Solves pass after pass, each around the directions of travel of the one before; the first takes
    /// them from the previous plan, else from the line-of-sight law. A pass that fails leaves the
    /// answer to the pass before it.
    fn run(&mut self, los_stages: &[Stage]) -> Optimum {
        let previous = self.snapshot.previous_plan.as_ref();
        let mut directions = previous
            .and_then(|plan| {
                self.horizon
                    .directions_of_plan(plan, self.policy.previous_plan_age_max)
            })
            .unwrap_or_else(|| Horizon::directions_of(los_stages));
        let mut optimum = Optimum::none(Degraded::Solver(SolverStatus::Unsolved));
        for _ in 0..self.policy.passes {
            let (solution, residuals, stages) = self.pass(&directions);
            optimum.report.passes += 1;
            optimum.report.iterations += solution.iterations;
            if let Err(reason) = accept(&solution, residuals.as_ref(), self.policy) {
                if optimum.stages.is_none() {
                    optimum.report.status = solution.status;
                    optimum.degraded = Some(reason);
                }
                break;
            }
            optimum.report.status = solution.status;
            optimum.report.residuals = residuals;
            optimum.degraded = None;
            optimum.violations = self.violations(&solution);
            directions = Horizon::directions_of(&stages);
            optimum.stages = Some(stages);
        }
        optimum
    }

    fn pass(&mut self, directions: &[Vector2<f64>]) -> (Solution, Option<Residuals>, Vec<Stage>) {
        let horizon = self.horizon;
        let reach = GOAL_REACH * self.snapshot.limits.speed_max * self.policy.steps.iter().sum::<f64>();
        let goal: Vec<_> = horizon
            .goal
            .iter()
            .map(|motion| motion.position.cap_magnitude(reach))
            .collect();
        let goal_velocity: Vec<_> = horizon
            .goal
            .iter()
            .map(|motion| motion.velocity - horizon.current)
            .collect();
        let pass = Pass {
            steps: &self.policy.steps,
            velocity: horizon.start.velocity,
            current: horizon.current,
            goal: &goal,
            goal_velocity: &goal_velocity,
            directions,
            limits: &self.snapshot.limits,
            surge_bias: &self.horizon.surge_bias,
            weights: &self.policy.weights,
        };
        let program = restated(self.programs, &pass);
        let solution = (self.solve)(program);
        if solution.primal.len() != program.layout.n_variables() {
            return (solution, None, Vec::new());
        }
        let residuals = Residuals::of(program, &solution);
        let layout = program.layout;
        let mut stages = vec![horizon.start];
        stages.extend((1..=layout.n_stages).map(|k| Stage {
            position: goal[k] + vector_at(&solution, layout.deviation(k)) * LENGTH_UNIT,
            velocity: vector_at(&solution, layout.velocity(k)),
        }));
        (solution, Some(residuals), stages)
    }

    /// The worst of each soft limit, where it is noticeable.
    fn violations(&self, solution: &Solution) -> Vec<Violation> {
        let layout = Layout {
            n_stages: self.policy.steps.len(),
        };
        [
            (Slack::ForwardSpeed, SoftLimit::ForwardSpeed),
            (Slack::TurnRate, SoftLimit::TurnRate),
            (Slack::TrustCone, SoftLimit::TrustCone),
        ]
        .into_iter()
        .filter_map(|(slack, limit)| {
            let amount = |k: usize| solution.primal[layout.slack(k, slack)];
            let worst = (1..=layout.n_stages).max_by(|a, b| amount(*a).total_cmp(&amount(*b)))?;
            (amount(worst) > SLACK_NOTICEABLE).then(|| Violation {
                limit,
                time: self.snapshot.time + self.horizon.times[worst],
                amount: amount(worst),
            })
        })
        .collect()
    }
}

/// Whether a solution may be followed. Every status by name: a new one must be thought about.
fn accept(solution: &Solution, residuals: Option<&Residuals>, policy: &Policy) -> Result<(), Degraded> {
    match solution.status {
        SolverStatus::Solved | SolverStatus::AlmostSolved => match residuals {
            Some(residuals) if residuals.within(policy.certificate_tolerance) => Ok(()),
            Some(_) | None => Err(Degraded::Certificate),
        },
        status @ (SolverStatus::Unsolved
        | SolverStatus::PrimalInfeasible
        | SolverStatus::DualInfeasible
        | SolverStatus::AlmostPrimalInfeasible
        | SolverStatus::AlmostDualInfeasible
        | SolverStatus::MaxIterations
        | SolverStatus::MaxTime
        | SolverStatus::NumericalError
        | SolverStatus::InsufficientProgress
        | SolverStatus::CallbackTerminated) => Err(Degraded::Solver(status)),
    }
}

/// The program of the pass's shape, stated anew or restated in place.
fn restated<'p>(programs: &'p mut Programs, pass: &Pass<'_>) -> &'p Program {
    let layout = Layout {
        n_stages: pass.steps.len(),
    };
    if let Some(index) = programs.iter().position(|program| program.layout == layout) {
        programs[index].restate(pass);
        return &programs[index];
    }
    programs.push(Program::new(pass));
    &programs[programs.len() - 1]
}

fn vector_at(solution: &Solution, column: usize) -> Vector2<f64> {
    Vector2::new(solution.primal[column], solution.primal[column + 1])
}

/// References that the inner loops turn into the first interval of `stages`.
fn reference_of(horizon: &Horizon, stages: &[Stage], snapshot: &Snapshot, policy: &Policy) -> Reference {
    let points = horizon.trajectory(&stages[..2]);
    let bias = horizon.surge_bias[0];
    invert_response(
        snapshot.asc.surge,
        &points[1],
        policy.steps[0],
        bias,
        &snapshot.limits,
    )
}

/// The inverse of the inner loops' response over an interval dt: the heading at its end, because the
/// yaw loop is about one interval late, and the speed that makes a loop of lag τ and bias b, which
/// answers a = (u_ref − u)/τ + b, accelerate as planned.
///
/// ```text
/// u_ref = (u_0 + u_1)/2 + τ ((u_1 − u_0)/dt − b)
/// ```
fn invert_response(speed_now: f64, next: &TrajectoryPoint, dt: f64, bias: f64, limits: &Limits) -> Reference {
    let acceleration = (next.speed - speed_now) / dt;
    // A loop faster than the interval is over before it ends: no lead.
    let lead =
        limits.surge_lag.max(0.5 * dt) * acceleration - 0.5 * dt * acceleration - limits.surge_lag * bias;
    Reference {
        speed: (next.speed + lead).clamp(limits.speed_min, limits.speed_max),
        heading: next.heading,
    }
}

/// The previous plan, followed further: its trajectory from now on, held at its end.
fn previous_plan(snapshot: &Snapshot, policy: &Policy, horizon: &Horizon) -> Option<Candidate> {
    let previous = snapshot.previous_plan.as_ref()?;
    let points = previous_points(previous, snapshot.time, policy.previous_plan_age_max)?;
    let dt = policy.steps[0];
    let (now, next) = (
        point_at(points, snapshot.time),
        point_at(points, snapshot.time + dt),
    );
    let stages = horizon
        .times
        .iter()
        .map(|time| horizon.stage(&point_at(points, snapshot.time + time)));
    Some(Candidate {
        method: Method::PreviousPlan,
        reference: invert_response(now.speed, &next, dt, 0.0, &snapshot.limits),
        stages: stages.collect(),
    })
}

/// Nothing to follow: turn slowly on the spot, or stop, as the client chose.
fn hold(snapshot: &Snapshot, horizon: &Horizon) -> Candidate {
    let heading = snapshot.asc.heading;
    let reference = match snapshot.hold {
        HoldStyle::Stop => Reference { speed: 0.0, heading },
        HoldStyle::SlowTurn => Reference {
            speed: snapshot.limits.speed_min,
            heading: Heading::new(heading.radians() + SLOW_TURN_LEAD),
        },
    };
    let drifting = horizon.times.iter().map(|time| Stage {
        position: horizon.current * *time,
        velocity: Vector2::zeros(),
    });
    Candidate {
        method: Method::Hold,
        reference,
        stages: drifting.collect(),
    }
}
