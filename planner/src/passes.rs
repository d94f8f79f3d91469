//! The passes of the convex program: each around the directions of travel of the one before.

use nalgebra::Vector2;

use crate::{
    answer::{Degraded, SoftLimit, SolverReport, Violation},
    certificate::Residuals,
    horizon::Horizon,
    policy::Policy,
    program::{LENGTH_UNIT, Layout, Pass, Program, Slack},
    response::Stage,
    snapshot::Snapshot,
    solve::{Solution, SolverStatus},
};

/// Programs stated before, one for each number of stages, to be restated in place.
pub type Programs = Vec<Program>;

/// A slack below this is the solver's tolerance, not a broken limit, m/s or m/s².
const SLACK_NOTICEABLE: f64 = 1e-3;

/// A goal beyond this multiple of the way that the horizon allows pulls no harder for being farther:
/// it bounds the cost's gradient, and with it the price at which soft limits hold.
const GOAL_REACH: f64 = 1.5;

/// The passes of the convex program on one snapshot.
pub(crate) struct Optimiser<'a> {
    pub(crate) snapshot: &'a Snapshot,
    pub(crate) policy: &'a Policy,
    pub(crate) horizon: &'a Horizon,
    pub(crate) programs: &'a mut Programs,
    pub(crate) solve: &'a mut dyn FnMut(&Program) -> Solution,
}

/// What the passes led to: stages, or the reason why there are none.
pub(crate) struct Optimum {
    pub(crate) stages: Option<Vec<Stage>>,
    pub(crate) degraded: Option<Degraded>,
    pub(crate) report: SolverReport,
    pub(crate) violations: Vec<Violation>,
}

impl Optimum {
    pub(crate) fn none(reason: Degraded) -> Self {
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
    pub(crate) fn run(&mut self, los_stages: &[Stage]) -> Optimum {
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
