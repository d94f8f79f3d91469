//! The second-order cone program of one subproblem, in the form of [`program`](crate::program).

use nalgebra::Vector2;

use crate::program::layout::{Layout, Slack};
use crate::program::sparse::{Sparse, Triplet};
use crate::program::subproblem::Subproblem;
use crate::program::units::{COST_UNIT, SLACK_UNIT};

/// A block of consecutive rows, and the cone of their slacks s.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cone {
    /// s = 0.
    Zero(usize),
    /// s ≥ 0.
    Nonnegative(usize),
    /// s₀ ≥ ‖(s₁, s₂, …)‖.
    SecondOrder(usize),
}

/// One program in standard form.
#[derive(Clone, Debug, PartialEq)]
pub struct Program {
    /// Indices of variables and rows.
    pub layout: Layout,
    /// Quadratic cost, upper triangle.
    pub quadratic: Sparse,
    /// Linear cost.
    pub linear: Vec<f64>,
    /// Constraint matrix.
    pub constraints: Sparse,
    /// Right-hand side.
    pub bounds: Vec<f64>,
    /// Cones of the rows, in order.
    pub cones: Vec<Cone>,
    pub(super) cost_triplets: Vec<Triplet>,
    pub(super) row_triplets: Vec<Triplet>,
}

impl Program {
    /// The program of `subproblem`.
    pub fn new(subproblem: &Subproblem<'_>) -> Self {
        let layout = subproblem.layout();
        let (n, n_stages) = (layout.n_variables(), layout.n_stages);
        let mut cones = vec![Cone::Zero(2 * n_stages), Cone::Nonnegative(layout.n_inequalities())];
        let n_cones_of_three = n_stages * (1 + layout.n_ranges);
        cones.extend((0..n_cones_of_three).map(|_| Cone::SecondOrder(3)));
        cones.extend((0..n_stages * layout.n_minimax).map(|_| Cone::SecondOrder(4)));
        let n_energy_cones = if layout.energy { 2 * n_stages } else { 0 };
        cones.extend((0..n_energy_cones).map(|_| Cone::SecondOrder(3)));
        let mut program = Self {
            layout,
            quadratic: Sparse::default(),
            linear: vec![0.0; n],
            constraints: Sparse::default(),
            bounds: vec![0.0; layout.n_rows()],
            cones,
            cost_triplets: Vec::new(),
            row_triplets: Vec::new(),
        };
        program.write(subproblem);
        program.quadratic = Sparse::new(n, n, &program.cost_triplets);
        program.constraints = Sparse::new(layout.n_rows(), n, &program.row_triplets);
        program
    }

    pub(crate) fn bytes(&self) -> usize {
        let triplets = self.cost_triplets.capacity() + self.row_triplets.capacity();
        let numbers = self.linear.capacity() + self.bounds.capacity();
        self.quadratic.bytes()
            + self.constraints.bytes()
            + size_of::<f64>() * numbers
            + size_of::<Cone>() * self.cones.capacity()
            + size_of::<Triplet>() * triplets
    }

    /// Rewrites the numbers for another subproblem of the same shape, without allocation.
    pub(crate) fn restate(&mut self, subproblem: &Subproblem<'_>) {
        self.write(subproblem);
        self.quadratic.fill(&self.cost_triplets);
        self.constraints.fill(&self.row_triplets);
    }

    /// The two columns of v_1, ahead and starboard, and their unit, m/s.
    pub fn first_velocity(&self) -> ([usize; 2], f64) {
        let column = self.layout.velocity(1);
        ([column, column + 1], 1.0)
    }

    fn write(&mut self, subproblem: &Subproblem<'_>) {
        debug_assert_eq!(subproblem.layout(), self.layout);
        self.cost_triplets.clear();
        self.row_triplets.clear();
        self.linear.fill(0.0);
        self.bounds.fill(0.0);
        if subproblem.minimax.is_empty() {
            self.tracking_cost(subproblem);
        } else {
            self.minimax_range_cost(subproblem);
        }
        self.velocity_cost(subproblem);
        self.acceleration_cost(subproblem);
        if self.layout.energy {
            self.energy_cost(subproblem);
        }
        self.slack_cost(subproblem);
        let quadratic = self.cost_triplets.iter_mut().map(|(_, _, value)| value);
        for cost in quadratic.chain(&mut self.linear) {
            *cost /= COST_UNIT;
        }
        self.dynamics(subproblem);
        self.acceleration_limits(subproblem);
        self.forward_speed(subproblem);
        self.turn_rate(subproblem);
        self.top_speed(subproblem);
        self.acoustic_ranges(subproblem);
        self.area(subproblem);
        self.keep_outs(subproblem);
        self.shores(subproblem);
    }

    pub(super) fn stages(&self) -> std::ops::RangeInclusive<usize> {
        1..=self.layout.n_stages
    }

    pub(super) fn add(&mut self, row: usize, column: usize, coefficient: f64) {
        self.row_triplets.push((row, column, coefficient));
    }

    /// Adds a multiple of the identity in two rows and columns, ahead and starboard.
    pub(super) fn add_axes(&mut self, row: usize, column: usize, coefficient: f64) {
        self.add(row, column, coefficient);
        self.add(row + 1, column + 1, coefficient);
    }

    pub(super) fn add_velocity(&mut self, row: usize, k: usize, coefficient: Vector2<f64>) {
        let column = self.layout.velocity(k);
        self.add(row, column, coefficient.x);
        self.add(row, column + 1, coefficient.y);
    }

    pub(super) fn add_deviation(&mut self, row: usize, k: usize, coefficient: Vector2<f64>) {
        let column = self.layout.deviation(k);
        self.add(row, column, coefficient.x);
        self.add(row, column + 1, coefficient.y);
    }

    pub(super) fn bound(&mut self, row: usize, by: Vector2<f64>) {
        self.bounds[row..row + 2].copy_from_slice(by.as_slice());
    }

    /// Widens a row by the slack of its kind; `unit` is the row's.
    pub(super) fn soften(&mut self, row: usize, k: usize, slack: Slack, unit: f64) {
        self.add(row, self.layout.slack(k, slack), -SLACK_UNIT / unit);
    }

    /// Adds weight · x² to the cost.
    pub(super) fn price(&mut self, column: usize, weight: f64) {
        self.cost_triplets.push((column, column, 2.0 * weight));
    }
}
