//! Sequential convex programming: subproblems linearised about the previous directions of travel.

use nalgebra::Vector2;

use crate::craft::response::{Rollout, Stage, surge_disturbances};
use crate::predict::motion::Motion;
use crate::problem::horizon::Horizon;
use crate::problem::limits::Shore;
use crate::problem::parameters::Parameters;
use crate::problem::shores::shores;
use crate::problem::stage_constraints::StageConstraints;
use crate::problem::violation::{SoftLimit, Violation};
use crate::program::build::Program;
use crate::program::layout::{Layout, Slack};
use crate::program::subproblem::Subproblem;
use crate::program::units::{LENGTH_UNIT, SLACK_UNIT};
use crate::scp::follower::follow;
use crate::scp::predicted_cost::Violations;
use crate::scp::result::{CandidateTrajectory, Degraded, ScpResult};
use crate::solve::by_shape::ByShape;
use crate::solve::certificate::Residuals;
use crate::solve::clarabel::{Solution, SolverStatus};
use crate::solve::stop::Stop;

/// Cosine of the turn, 45°, beyond which a solution was at the limit of its linearisation's cone.
const PRESSED_COSINE: f64 = std::f64::consts::FRAC_1_SQRT_2;

/// Largest slack within the solver's tolerance, m/s or m/s².
const SLACK_NOTICEABLE: f64 = 1e-3;

/// Multiple of the horizon's reach and of the top speed at which the goal's distance and speed are
/// capped: bounds the cost's gradient, and with it the price of soft limits.
const GOAL_REACH: f64 = 1.5;

/// Largest negligible predicted cost, m² s: a centimetre over a hundred seconds.
const NEGLIGIBLE_COST: f64 = 0.01;

/// Sequential convex programming on one snapshot.
pub(crate) struct Scp<'a> {
    pub(crate) horizon: &'a Horizon<'a>,
    pub(crate) stop: &'a Stop,
    pub(crate) solve: &'a mut dyn FnMut(&Program) -> Solution,
    /// Earlier programs, to be restated in place.
    pub(crate) programs: &'a mut ByShape<Program>,
}

/// Linearisation of a subproblem, and the facts within its reach, craft frame.
struct Linearisation {
    directions: Vec<Vector2<f64>>,
    /// The goal, capped to the reach.
    goal: Vec<Vector2<f64>>,
    /// Velocity through the water that matches the goal's, m/s.
    goal_velocity: Vec<Vector2<f64>>,
    /// Acceleration disturbance of the surge loop, m/s².
    surge_disturbance: Vec<f64>,
    constraints: StageConstraints,
    shores: Vec<Shore>,
}

/// A solved subproblem.
struct Solved {
    layout: Layout,
    /// The goal to which the solution's deviations refer.
    goal: Vec<Vector2<f64>>,
    solution: Solution,
    residuals: Option<Residuals>,
}

impl Scp<'_> {
    /// The best result from the previous plan's trajectory and, if needed, from new guesses.
    ///
    /// New guesses are needed without a previous plan, if its trajectory is worse than line of
    /// sight or leads into a no-go area, and while the iterations still turn: if the goal changes,
    /// two iterations cannot leave a cone that points elsewhere.
    pub(crate) fn run(&mut self, los: &Rollout, los_cost: f64) -> ScpResult {
        let horizon = self.horizon;
        let Some(previous) = &horizon.previous else {
            return self.best_of(None, horizon.guesses_without_plan(&los.stages));
        };
        let previous = horizon.stages_along(previous);
        let first = self.iterate(previous.clone());
        let is_ashore = first.candidate.iter().flat_map(|candidate| candidate.violations).flatten();
        let is_ashore = is_ashore.into_iter().any(|violation| violation.limit == SoftLimit::NoGo);
        let others = if first.converged && !is_ashore && first.cost() <= los_cost + NEGLIGIBLE_COST {
            horizon.guesses_beside_plan(&previous)
        } else {
            horizon.guesses_without_plan(&los.stages)
        };
        self.best_of(Some(first), others)
    }

    fn best_of(&mut self, first: Option<ScpResult>, guesses: Vec<Vec<Stage>>) -> ScpResult {
        let results = guesses.into_iter().map(|guess| self.iterate(guess));
        first
            .into_iter()
            .chain(results)
            .reduce(ScpResult::or)
            .unwrap_or_else(|| ScpResult::none(Degraded::Solver(SolverStatus::Unsolved)))
    }

    /// Iterates from `guess` until convergence. A failed iteration keeps the previous result.
    fn iterate(&mut self, guess: Vec<Stage>) -> ScpResult {
        let mut result = ScpResult::none(Degraded::Solver(SolverStatus::Unsolved));
        let (mut about, parameters) = (guess, self.horizon.parameters);
        for _ in 0..parameters.scp_iterations {
            if self.stop.is_due() {
                if result.candidate.is_none() {
                    result.degraded = Some(Degraded::Deadline);
                }
                break;
            }
            // 1. Linearise and solve.
            let solved = self.solve_subproblem(&about);
            result.report.scp_iterations += 1;
            result.report.iterations += solved.solution.iterations;
            if let Err(reason) = accept(&solved.solution, solved.residuals.as_ref(), parameters) {
                if result.candidate.is_none() {
                    result.report.status = solved.solution.status;
                    result.degraded = Some(reason);
                }
                break;
            }
            // 2. Follow the solution on the response model, and predict its cost.
            let stages = solved.stages(self.horizon);
            let turned = cosine_of_turn(&about, &stages);
            let rollout = follow(self.horizon, &stages);
            let candidate = CandidateTrajectory::new(self.horizon, stages.clone(), &rollout);
            // 3. Keep the best. A later iteration is another linearisation, not a descent step.
            if candidate.predicted.cost <= result.cost() {
                result.report.status = solved.solution.status;
                result.report.residuals = solved.residuals;
                result.degraded = None;
                result.violations = solved.violations(self.horizon);
                result.converged = turned > PRESSED_COSINE;
                result.candidate = Some(candidate);
            }
            if turned > parameters.converged_cosine {
                break;
            }
            about = stages;
        }
        result
    }

    /// States and solves the subproblem linearised about `stages`.
    fn solve_subproblem(&mut self, stages: &[Stage]) -> Solved {
        let (horizon, craft) = (self.horizon, &self.horizon.craft);
        let about = Linearisation::about(stages, horizon);
        let subproblem = Subproblem {
            steps: &horizon.parameters.steps,
            velocity: horizon.start.velocity,
            acceleration: horizon.acceleration(),
            course_lag: craft.course_lag(),
            current: horizon.current,
            goal: &about.goal,
            goal_velocity: &about.goal_velocity,
            directions: &about.directions,
            limits: &craft.limits,
            surge_disturbance: &about.surge_disturbance,
            ranges: &about.constraints.ranges,
            discs: &about.constraints.discs,
            shores: &about.shores,
            edges: &about.constraints.edges,
            minimax: &about.constraints.minimax,
            weights: &horizon.weights,
            power: craft.power,
        };
        let program = restated(self.programs, &subproblem);
        let solution = (self.solve)(program);
        let is_whole = solution.primal.len() == program.layout.n_variables();
        let residuals = is_whole.then(|| Residuals::of(program, &solution));
        Solved { layout: program.layout, goal: about.goal, solution, residuals }
    }
}

impl Solved {
    fn stages(&self, horizon: &Horizon<'_>) -> Vec<Stage> {
        let Self { layout, goal, solution, .. } = self;
        let later = (1..=layout.n_stages).map(|k| Stage {
            position: goal[k] + vector_at(solution, layout.deviation(k)) * LENGTH_UNIT,
            velocity: vector_at(solution, layout.velocity(k)),
        });
        std::iter::once(horizon.start).chain(later).collect()
    }

    /// Worst noticeable violation of each soft limit of motion.
    fn violations(&self, horizon: &Horizon<'_>) -> Violations<2> {
        let (layout, solution) = (self.layout, &self.solution);
        [SoftLimit::ForwardSpeed, SoftLimit::TurnRate].map(|limit| {
            let rows = |k| match limit {
                SoftLimit::TurnRate => layout.turn_rate(k)..layout.turn_rate(k) + 2,
                _ => layout.forward_speed(k)..layout.forward_speed(k) + 1,
            };
            let amount = |k: usize| {
                // s is the row's margin with ξ: ξ − s is its violation.
                let least = solution.slack[rows(k)].iter().copied().fold(f64::INFINITY, f64::min);
                solution.primal[layout.slack(k, Slack::Motion)] * SLACK_UNIT - least
            };
            let worst = (1..=layout.n_stages).max_by(|a, b| amount(*a).total_cmp(&amount(*b)))?;
            (amount(worst) > SLACK_NOTICEABLE).then(|| Violation {
                limit,
                pointer: None,
                t_s: horizon.time(worst),
                amount: amount(worst),
                unit: limit.unit(),
            })
        })
    }
}

impl Linearisation {
    /// The facts of `horizon` for a subproblem about `stages`.
    fn about(stages: &[Stage], horizon: &Horizon<'_>) -> Self {
        let (snapshot, parameters) = (horizon.snapshot, horizon.parameters);
        let reach = GOAL_REACH * snapshot.limits().speed_max * parameters.steps.iter().sum::<f64>();
        let near = |motion: &Motion| motion.position.cap_magnitude(reach);
        let goal: Vec<_> = horizon.goal.iter().map(near).collect();
        let fastest = GOAL_REACH * snapshot.limits().speed_max;
        let slow = |motion: &Motion| (motion.velocity - horizon.current).cap_magnitude(fastest);
        let mut constraints = horizon.constraints.clone();
        constraints.widen_keep_outs(parameters.keep_out_margin);
        constraints.set_normals(stages);
        constraints.limit_to_reach(reach, &horizon.goal, &goal);
        let speed = snapshot.limits().speed_max;
        let beside = |land| shores(land, &horizon.frame, stages, speed, parameters.keep_out_margin);
        Self {
            shores: horizon.land_near().map(beside).unwrap_or_default(),
            directions: Horizon::directions_of(stages).collect(),
            goal_velocity: horizon.goal.iter().map(slow).collect(),
            goal,
            surge_disturbance: surge_disturbances(stages, &parameters.steps, snapshot.craft_model())
                .collect(),
            constraints,
        }
    }
}

/// Cosine of the largest angle between directions before and after an iteration.
fn cosine_of_turn(before: &[Stage], after: &[Stage]) -> f64 {
    Horizon::directions_of(before)
        .zip(Horizon::directions_of(after))
        .map(|(before, after)| before.dot(&after))
        .fold(1.0, f64::min)
}

/// Accepts any status with a result whose certificate holds. A new status needs a decision.
fn accept(
    solution: &Solution,
    residuals: Option<&Residuals>,
    parameters: &Parameters,
) -> Result<(), Degraded> {
    let certified = residuals.is_some_and(|residuals| residuals.within(parameters.certificate_tolerance));
    match solution.status {
        SolverStatus::Solved
        | SolverStatus::AlmostSolved
        | SolverStatus::MaxIterations
        | SolverStatus::InsufficientProgress
            if certified =>
        {
            Ok(())
        }
        SolverStatus::Solved | SolverStatus::AlmostSolved => Err(Degraded::Certificate),
        status @ (SolverStatus::Unsolved
        | SolverStatus::PrimalInfeasible
        | SolverStatus::DualInfeasible
        | SolverStatus::AlmostPrimalInfeasible
        | SolverStatus::AlmostDualInfeasible
        | SolverStatus::MaxIterations
        | SolverStatus::MaxTime
        | SolverStatus::NumericalError
        | SolverStatus::InsufficientProgress) => Err(Degraded::Solver(status)),
        SolverStatus::CallbackTerminated => Err(Degraded::Deadline),
    }
}

/// The program of the subproblem's shape, new or restated in place.
fn restated<'p>(programs: &'p mut ByShape<Program>, subproblem: &Subproblem<'_>) -> &'p Program {
    let layout = subproblem.layout();
    if programs.is_kept(&layout) {
        let kept = programs.last().into_iter();
        kept.for_each(|program| program.restate(subproblem));
    } else {
        let program = Program::new(subproblem);
        programs.insert(layout, program.bytes(), program);
    }
    programs.last().expect("is kept or was inserted")
}

fn vector_at(solution: &Solution, column: usize) -> Vector2<f64> {
    Vector2::new(solution.primal[column], solution.primal[column + 1])
}
