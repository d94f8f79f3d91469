//! What a plan was made by: the size of its program, every subproblem, and which soft rows gave way.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::{
    choose::select::select_answer,
    problem::policy::Policy,
    program::{build::Program, layout::Slack, standard_form::Cone, units::SLACK_UNIT},
    snapshot::build::Snapshot,
    solve::{
        certificate::Residuals,
        clarabel::{Solution, SolverStatus, Solvers},
        stop::Stop,
    },
};

/// A slack below this is the solver's tolerance, m, m/s or m/s².
const NOTICEABLE: f64 = 1e-3;

/// How the plan of a snapshot comes about.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Explanation {
    /// Size of the last subproblem; zeros where none was stated.
    pub size: ProgramSize,
    /// Every subproblem, in the order in which they were solved.
    pub subproblems: Vec<SubproblemReport>,
    /// The slacks of the last subproblem that are noticeably used, by stage.
    pub slacks: Vec<UsedSlack>,
}

/// Size of a cone program `minimise ½ xᵀPx + qᵀx, Ax + s = b, s ∈ K`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
pub struct ProgramSize {
    /// Stages of the horizon.
    pub stages: usize,
    /// Length of x.
    pub variables: usize,
    /// Rows in all.
    pub rows: usize,
    /// Rows whose s is 0.
    pub equalities: usize,
    /// Rows whose s is at least 0.
    pub inequalities: usize,
    /// Second-order cones.
    pub second_order_cones: usize,
    /// Entries of A that are stored.
    pub constraint_entries: usize,
    /// Entries of the upper triangle of P that are stored.
    pub quadratic_entries: usize,
}

/// A convex subproblem and how it was solved.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SubproblemReport {
    /// How the solver ended.
    pub status: SolverStatus,
    /// Interior-point iterations.
    pub iterations: u32,
    /// How well its optimality conditions hold, recomputed outside the solver; none without a solution.
    pub residuals: Option<Residuals>,
}

/// A soft row that gave way.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UsedSlack {
    /// Which rows share it.
    pub rows: SoftRows,
    /// The stage, from 1 on.
    pub stage: usize,
    /// How long after now that is, s.
    pub after: f64,
    /// By how much: m, or of motion m/s and m/s².
    pub amount: f64,
}

/// Soft rows of one kind, which share a slack a stage.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SoftRows {
    /// Forward speed and turn rate.
    Motion,
    /// Ranges to the AUVs that the goal names.
    AcousticRange,
    /// Ranges to the others.
    OtherRange,
    /// Edges of the area.
    Area,
    /// Discs to keep out of.
    KeepOut,
}

impl From<Slack> for SoftRows {
    fn from(slack: Slack) -> Self {
        match slack {
            Slack::Motion => Self::Motion,
            Slack::AcousticRange => Self::AcousticRange,
            Slack::OtherRange => Self::OtherRange,
            Slack::Area => Self::Area,
            Slack::KeepOut => Self::KeepOut,
        }
    }
}

/// Plans for `snapshot` again, as [`crate::plan::plan_until`] does, and keeps what was solved.
#[must_use]
pub fn explain(snapshot: &Snapshot, policy: &Policy, stop: &Stop) -> Explanation {
    let mut solvers = Solvers::default();
    let mut explanation = Explanation::default();
    let times: Vec<f64> = policy
        .steps
        .iter()
        .scan(0.0, |time, step| {
            *time += step;
            Some(*time)
        })
        .collect();
    let _ = select_answer(snapshot, policy, &mut vec![], stop, &mut |program| {
        let solution = solvers.solve_until(program, stop);
        let is_whole = solution.primal.len() == program.layout.n_variables();
        explanation.subproblems.push(SubproblemReport {
            status: solution.status,
            iterations: solution.iterations,
            residuals: is_whole.then(|| Residuals::of(program, &solution)),
        });
        explanation.size = size(program);
        explanation.slacks = if is_whole {
            slacks(program, &solution, &times)
        } else {
            vec![]
        };
        solution
    });
    explanation
}

fn size(program: &Program) -> ProgramSize {
    let mut size = ProgramSize {
        stages: program.layout.n_stages,
        variables: program.layout.n_variables(),
        rows: program.layout.n_rows(),
        constraint_entries: program.constraints.values.len(),
        quadratic_entries: program.quadratic.values.len(),
        ..ProgramSize::default()
    };
    for cone in &program.cones {
        match *cone {
            Cone::Zero(rows) => size.equalities += rows,
            Cone::Nonnegative(rows) => size.inequalities += rows,
            Cone::SecondOrder(_) => size.second_order_cones += 1,
        }
    }
    size
}

fn slacks(program: &Program, solution: &Solution, times: &[f64]) -> Vec<UsedSlack> {
    let layout = program.layout;
    let stages = (1..=layout.n_stages).zip(times);
    let used = stages.flat_map(|(stage, after)| {
        layout.slacks().map(move |slack| UsedSlack {
            rows: slack.into(),
            stage,
            after: *after,
            amount: solution.primal[layout.slack(stage, slack)] * SLACK_UNIT,
        })
    });
    used.filter(|slack| NOTICEABLE < slack.amount).collect()
}
