//! The passes of the convex program: each around the directions of travel of the one before.

use std::ops::Range;

use nalgebra::Vector2;

use crate::{
    answer::{Degraded, Predicted, SoftLimit, Violation},
    certificate::{Products, Residuals},
    follower::follow,
    forecast::Motion,
    goal::GoalForecast,
    horizon::{Horizon, previous_points},
    merit::{Broken, predict},
    optimum::{Optimum, Way},
    policy::Policy,
    program::{LENGTH_UNIT, Layout, Pass, Program, SLACK_UNIT, Slack},
    refilled::refill,
    response::{Rollout, Stage, surge_biases},
    seeds::Seeds,
    snapshot::Snapshot,
    solve::{SHAPES_MAX, Solution, SolverStatus},
    stop::Stop,
    surroundings::Surroundings,
    ways::Ways,
};

/// A last pass that turned any stage by more than this, as a cosine, was pressed against its cone: 45°.
const PRESSED_COSINE: f64 = std::f64::consts::FRAC_1_SQRT_2;

/// A slack below this is the solver's tolerance, not a broken limit, m/s or m/s².
const SLACK_NOTICEABLE: f64 = 1e-3;

/// A goal beyond this multiple of the way that the horizon allows, or faster than this multiple of the top speed,
/// pulls no harder for being farther or faster: it bounds the cost's gradient, and with it the price at which soft limits hold.
const GOAL_REACH: f64 = 1.5;

/// A merit that no craft shows, m² s: a centimetre over a hundred seconds.
const NEGLIGIBLE_MERIT: f64 = 0.01;

/// The passes of the convex program on one snapshot.
pub(crate) struct Optimiser<'a> {
    pub(crate) snapshot: &'a Snapshot,
    pub(crate) policy: &'a Policy,
    pub(crate) horizon: &'a Horizon,
    pub(crate) goal: &'a GoalForecast,
    pub(crate) stop: &'a Stop,
    pub(crate) solve: &'a mut dyn FnMut(&Program, &mut Solution),
    pub(crate) sheets: &'a mut Sheets,
}

/// What passes are worked out on; it serves the next snapshot too.
#[derive(Debug, Default)]
pub(crate) struct Sheets {
    /// Programs stated before, one for each of the [`SHAPES_MAX`] shapes used last, to be restated in place.
    pub(crate) programs: Vec<Program>,
    /// All ways that are looked at for the snapshot.
    pub(crate) ways: Ways,
    /// The way that is being rolled out.
    pub(crate) rollout: Rollout,
    given: Given,
    solution: Solution,
    products: Products,
}

/// What a pass is told, craft frame.
#[derive(Debug, Default)]
struct Given {
    /// Directions of travel.
    directions: Vec<Vector2<f64>>,
    /// The goal, within reach.
    goal: Vec<Vector2<f64>>,
    /// Velocity through the water that matches the goal's, m/s.
    goal_velocity: Vec<Vector2<f64>>,
    /// What the surge loop gives unasked, m/s².
    surge_bias: Vec<f64>,
    around: Surroundings,
}

impl Optimiser<'_> {
    /// Solves from the previous plan's way where there is one, else from ways that lead to the goal anew; and from
    /// these as well where the previous plan's led to something worse than line of sight, or the passes still turn:
    /// when the goal has changed under a plan, two passes cannot leave a cone that points elsewhere.
    pub(crate) fn run(&mut self, los: &Rollout, los_merit: f64) -> Optimum {
        let Some(points) = previous_points(self.snapshot, self.policy) else {
            let ways = self.seeds().anew(&los.stages);
            return self.best_of(None, ways);
        };
        let previous = self.sheets.ways.add(self.horizon.stages_along(points));
        let seeded = self.refine(previous);
        let others = if seeded.settled && seeded.merit() <= los_merit + NEGLIGIBLE_MERIT {
            self.seeds().beside(previous)
        } else {
            self.seeds().anew(&los.stages)
        };
        self.best_of(Some(seeded), others)
    }

    fn seeds(&mut self) -> Seeds<'_> {
        Seeds {
            snapshot: self.snapshot,
            policy: self.policy,
            horizon: self.horizon,
            goal: self.goal,
            ways: &mut self.sheets.ways,
            rollout: &mut self.sheets.rollout,
        }
    }

    fn best_of(&mut self, first: Option<Optimum>, ways: Range<usize>) -> Optimum {
        let optima = ways.map(|way| self.refine(way));
        first
            .into_iter()
            .chain(optima)
            .reduce(Optimum::or)
            .unwrap_or_else(|| Optimum::none(Degraded::Solver(SolverStatus::Unsolved)))
    }

    /// Pass after pass, each around the way of the one before, until it changes little. A pass that fails leaves
    /// the answer to the pass before it.
    fn refine(&mut self, seed: usize) -> Optimum {
        let mut optimum = Optimum::none(Degraded::Solver(SolverStatus::Unsolved));
        let mut way = seed;
        for _ in 0..self.policy.passes {
            if self.stop.is_due() {
                if optimum.way.is_none() {
                    optimum.degraded = Some(Degraded::Deadline);
                }
                break;
            }
            let (layout, residuals) = self.pass(way);
            let solution = &self.sheets.solution;
            optimum.report.passes += 1;
            optimum.report.iterations += solution.iterations;
            if let Err(reason) = accept(solution, residuals.as_ref(), self.policy) {
                if optimum.way.is_none() {
                    optimum.report.status = solution.status;
                    optimum.degraded = Some(reason);
                }
                break;
            }
            let solved = self.add_solved(layout);
            let turned = cosine_of_turn(&self.sheets.ways[way], &self.sheets.ways[solved]);
            way = solved;
            let (predicted, violations) = self.follow(way);
            // A later pass may do worse: it is another linearisation, not a step of a descent.
            if predicted.merit <= optimum.merit() {
                optimum.report.status = self.sheets.solution.status;
                optimum.report.residuals = residuals;
                optimum.degraded = None;
                optimum.violations = self.violations(layout);
                optimum.settled = turned > PRESSED_COSINE;
                optimum.way = Some(Way {
                    number: way,
                    predicted,
                    violations,
                });
            }
            if turned > self.policy.settled_cosine {
                break;
            }
        }
        optimum
    }

    /// Solves the program around a way: its shape, and how good the solution is, where there is one.
    fn pass(&mut self, way: usize) -> (Layout, Option<Residuals>) {
        let (horizon, snapshot, policy) = (self.horizon, self.snapshot, self.policy);
        let Sheets {
            programs,
            ways,
            given,
            solution,
            products,
            ..
        } = &mut *self.sheets;
        given.state(horizon, snapshot, policy, &ways[way]);
        let craft = policy.planned(snapshot.craft_model());
        let pass = Pass {
            steps: &policy.steps,
            velocity: horizon.start.velocity,
            acceleration: horizon.acceleration(),
            course_lag: craft.course_lag(),
            current: horizon.current,
            goal: &given.goal,
            goal_velocity: &given.goal_velocity,
            directions: &given.directions,
            limits: &craft.limits,
            surge_bias: &given.surge_bias,
            ranges: &given.around.ranges,
            discs: &given.around.discs,
            edges: &given.around.edges,
            worst: &given.around.worst,
            weights: &horizon.weights,
            power: craft.power,
        };
        let program = restated(programs, &pass);
        (self.solve)(program, solution);
        let is_whole = solution.primal.len() == program.layout.n_variables();
        let residuals = is_whole.then(|| Residuals::of(program, solution, products));
        (program.layout, residuals)
    }

    /// Adds the way that the solution says.
    fn add_solved(&mut self, layout: Layout) -> usize {
        let Sheets {
            ways,
            given,
            solution,
            ..
        } = &mut *self.sheets;
        let later = (1..=layout.n_stages).map(|k| Stage {
            position: given.goal[k] + vector_at(solution, layout.deviation(k)) * LENGTH_UNIT,
            velocity: vector_at(solution, layout.velocity(k)),
        });
        ways.add(std::iter::once(self.horizon.start).chain(later))
    }

    /// What following a way is predicted to lead to.
    fn follow(&mut self, way: usize) -> (Predicted, Broken<4>) {
        let Sheets { ways, rollout, .. } = &mut *self.sheets;
        follow(self.horizon, &ways[way], self.snapshot, self.policy, rollout);
        predict(self.horizon, rollout, &self.horizon.weights)
    }

    /// The worst of each soft limit of motion, where it is noticeable.
    fn violations(&self, layout: Layout) -> Broken<2> {
        let solution = &self.sheets.solution;
        [SoftLimit::ForwardSpeed, SoftLimit::TurnRate].map(|limit| {
            let rows = |k| match limit {
                SoftLimit::TurnRate => layout.turn_rate(k)..layout.turn_rate(k) + 2,
                _ => layout.forward_speed(k)..layout.forward_speed(k) + 1,
            };
            let amount = |k: usize| {
                // s is what the row leaves, ξ included: ξ − s is by how much it is broken.
                let least = solution.slack[rows(k)]
                    .iter()
                    .copied()
                    .fold(f64::INFINITY, f64::min);
                solution.primal[layout.slack(k, Slack::Motion)] * SLACK_UNIT - least
            };
            let worst = (1..=layout.n_stages).max_by(|a, b| amount(*a).total_cmp(&amount(*b)))?;
            (amount(worst) > SLACK_NOTICEABLE).then(|| Violation {
                limit,
                about: None,
                time: self.horizon.time(worst),
                amount: amount(worst),
            })
        })
    }
}

impl Given {
    /// The facts of `horizon` for a pass around `stages`.
    fn state(&mut self, horizon: &Horizon, snapshot: &Snapshot, policy: &Policy, stages: &[Stage]) {
        refill(&mut self.directions, Horizon::directions_of(stages));
        let reach = GOAL_REACH * snapshot.limits.speed_max * policy.steps.iter().sum::<f64>();
        let near = |motion: &Motion| motion.position.cap_magnitude(reach);
        refill(&mut self.goal, horizon.goal.iter().map(near));
        let fastest = GOAL_REACH * snapshot.limits.speed_max;
        let slow = |motion: &Motion| (motion.velocity - horizon.current).cap_magnitude(fastest);
        refill(&mut self.goal_velocity, horizon.goal.iter().map(slow));
        let biases = surge_biases(stages, &policy.steps, snapshot.craft_model());
        refill(&mut self.surge_bias, biases);
        self.around.copy_from(&horizon.surroundings);
        self.around.keep_clear(policy.keep_out_margin);
        self.around.pass_as(stages);
        self.around.bring_within(reach, &horizon.goal, &self.goal);
    }
}

/// Cosine of the largest angle between directions before and after a pass.
fn cosine_of_turn(before: &[Stage], after: &[Stage]) -> f64 {
    Horizon::directions_of(before)
        .zip(Horizon::directions_of(after))
        .map(|(before, after)| before.dot(&after))
        .fold(1.0, f64::min)
}

/// Whether a solution may be followed: one that a solver got to, however it names it, if the certificate holds.
/// Every status by name: a new one must be thought about.
fn accept(solution: &Solution, residuals: Option<&Residuals>, policy: &Policy) -> Result<(), Degraded> {
    let certified = residuals.is_some_and(|residuals| residuals.within(policy.certificate_tolerance));
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

/// The program of the pass's shape, stated anew or restated in place.
fn restated<'p>(programs: &'p mut Vec<Program>, pass: &Pass<'_>) -> &'p Program {
    let layout = pass.layout();
    if let Some(index) = programs.iter().position(|program| program.layout == layout) {
        programs[index..].rotate_left(1);
        let last = programs.len() - 1;
        programs[last].restate(pass);
        return &programs[last];
    }
    if programs.len() == SHAPES_MAX {
        programs.remove(0);
    }
    programs.push(Program::new(pass));
    &programs[programs.len() - 1]
}

fn vector_at(solution: &Solution, column: usize) -> Vector2<f64> {
    Vector2::new(solution.primal[column], solution.primal[column + 1])
}
