//! The passes of the convex program: each around the directions of travel of the one before.

use nalgebra::Vector2;

use crate::{
    answer::{Degraded, SoftLimit, SolverReport, Violation},
    certificate::Residuals,
    horizon::{Horizon, previous_points},
    policy::Policy,
    program::{LENGTH_UNIT, Layout, Pass, Program, SLACK_UNIT, Slack},
    response::Stage,
    snapshot::Snapshot,
    solve::{Solution, SolverStatus},
};

/// A last pass that turned any stage by more than this, as a cosine, was pressed against its cone: 45°.
const SETTLED_COSINE: f64 = std::f64::consts::FRAC_1_SQRT_2;

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
    /// Predicted merit of the stages; infinite where there are none.
    merit: f64,
    /// Whether the last pass left the directions that it was given about as they were.
    settled: bool,
    pub(crate) stages: Option<Vec<Stage>>,
    pub(crate) degraded: Option<Degraded>,
    pub(crate) report: SolverReport,
    pub(crate) violations: Vec<Violation>,
}

impl Optimum {
    pub(crate) fn none(reason: Degraded) -> Self {
        Self {
            merit: f64::INFINITY,
            settled: false,
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
    /// Solves from the previous plan's directions of travel where there is one, else from the
    /// line-of-sight law's; and from the law's as well where the previous plan's led to something worse than
    /// the law, or the passes still turn: when the goal has changed under a plan, two passes cannot leave a
    /// cone that points elsewhere.
    pub(crate) fn run(&mut self, los_stages: &[Stage]) -> Optimum {
        let los_directions = Horizon::directions_of(los_stages);
        let Some(points) = previous_points(self.snapshot, self.policy) else {
            return self.refine(los_directions);
        };
        let los_merit = self.merit(los_stages);
        let seeded = self.refine(self.horizon.directions_along(points));
        if seeded.settled && seeded.merit <= los_merit {
            return seeded;
        }
        let anew = self.refine(los_directions);
        let passes = seeded.report.passes + anew.report.passes;
        let iterations = seeded.report.iterations + anew.report.iterations;
        let mut better = if anew.merit < seeded.merit { anew } else { seeded };
        better.report = SolverReport {
            passes,
            iterations,
            ..better.report
        };
        better
    }

    /// Predicted merit: the same for every candidate, whatever led to it.
    fn merit(&self, stages: &[Stage]) -> f64 {
        self.horizon.predict(stages, &self.policy.weights).merit
    }

    /// Pass after pass, each around the directions of travel of the one before. A pass that fails leaves
    /// the answer to the pass before it.
    fn refine(&mut self, mut directions: Vec<Vector2<f64>>) -> Optimum {
        let mut optimum = Optimum::none(Degraded::Solver(SolverStatus::Unsolved));
        for _ in 0..self.policy.passes {
            let (layout, solution, residuals, stages) = self.pass(&directions);
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
            optimum.violations = self.violations(layout, &solution);
            optimum.merit = self.merit(&stages);
            let travelled = Horizon::directions_of(&stages);
            let turned = travelled
                .iter()
                .zip(&directions)
                .map(|(now, before)| now.dot(before));
            optimum.settled = turned.fold(1.0, f64::min) > SETTLED_COSINE;
            directions = travelled;
            optimum.stages = Some(stages);
        }
        optimum
    }

    fn pass(&mut self, directions: &[Vector2<f64>]) -> (Layout, Solution, Option<Residuals>, Vec<Stage>) {
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
            ranges: &[],
            discs: &[],
            edges: &[],
            worst: &[],
            weights: &self.policy.weights,
        };
        let program = restated(self.programs, &pass);
        let solution = (self.solve)(program);
        if solution.primal.len() != program.layout.n_variables() {
            return (program.layout, solution, None, Vec::new());
        }
        let residuals = Residuals::of(program, &solution);
        let layout = program.layout;
        let mut stages = vec![horizon.start];
        stages.extend((1..=layout.n_stages).map(|k| Stage {
            position: goal[k] + vector_at(&solution, layout.deviation(k)) * LENGTH_UNIT,
            velocity: vector_at(&solution, layout.velocity(k)),
        }));
        (layout, solution, Some(residuals), stages)
    }

    /// The worst of each soft limit of motion, where it is noticeable.
    fn violations(&self, layout: Layout, solution: &Solution) -> Vec<Violation> {
        let rows = |limit, k| match limit {
            SoftLimit::ForwardSpeed => layout.forward_speed(k)..layout.forward_speed(k) + 1,
            SoftLimit::TurnRate => layout.turn_rate(k)..layout.turn_rate(k) + 2,
            SoftLimit::TrustCone => layout.trust_cone(k)..layout.trust_cone(k) + 2,
        };
        let amount = |limit, k| {
            // s = (what the row leaves) + ξ, so that ξ − s is by how much it is broken.
            let least = solution.slack[rows(limit, k)]
                .iter()
                .copied()
                .fold(f64::INFINITY, f64::min);
            solution.primal[layout.slack(k, Slack::Motion)] * SLACK_UNIT - least
        };
        let worst = |limit| {
            let worst =
                (1..=layout.n_stages).max_by(|a, b| amount(limit, *a).total_cmp(&amount(limit, *b)))?;
            (amount(limit, worst) > SLACK_NOTICEABLE).then(|| Violation {
                limit,
                time: self.snapshot.time + self.horizon.times[worst],
                amount: amount(limit, worst),
            })
        };
        [SoftLimit::ForwardSpeed, SoftLimit::TurnRate, SoftLimit::TrustCone]
            .into_iter()
            .filter_map(worst)
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
    let layout = pass.layout();
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
