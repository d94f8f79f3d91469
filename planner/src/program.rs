//! The second-order cone program of one pass: what is promised, and where each number stands.
//!
//! Standard form, the one Clarabel solves:
//!
//! ```text
//! minimise ½ xᵀ P x + qᵀ x   subject to   A x + s = b,  s ∈ K
//! ```
//! Variables, stage by stage k = 1 … N over intervals Δt_0 … Δt_{N−1}: deviation from the goal
//! d_k = p_k − r_k, velocity through the water v_k, one slack for each kind of soft row; where the goal is a worst
//! range its excess τ_k, and where energy has a price a bound σ_k of the speed, m_k ≥ σ_k² and e_k ≥ σ_k³. The
//! acceleration of an interval, a_k = (v_{k+1} − v_k) / Δt_k, is eliminated. The frame is the craft's own:
//! origin and axes (ahead, starboard) are those of its position and heading now, so that a plan cannot depend on
//! where north or the datum is. Positions are counted in units of [`LENGTH_UNIT`], slacks in units of
//! [`SLACK_UNIT`], the cost in units of [`COST_UNIT`].

use nalgebra::Vector2;

use crate::{
    craft::PropulsionPower,
    policy::Weights,
    snapshot::Limits,
    solve::StandardForm,
    sparse::{Sparse, Triplet},
};

mod bounds;
mod cost;
mod layout;
mod motion;

pub use layout::Layout;
pub(crate) use layout::Slack;

/// Unit of length inside the program, m: errors of a few metres and speeds of a few tenths of a m/s
/// become numbers of the same size.
pub const LENGTH_UNIT: f64 = 10.0;

/// Unit of a slack inside the program, m/s, m/s² or m: with the price of a slack at 10⁵, measured 26 to 35
/// iterations in two passes over six scenes near and far, 40 to 49 where slacks count in units of 1.
pub const SLACK_UNIT: f64 = 0.01;

/// Unit of the cost inside the program: prices of 10⁴ and more make multipliers that an interior point reaches slowly and
/// not exactly. Over 1374 programs of closed loops of every scenario, mean iterations and largest error of the first
/// planned velocity: 12.2 and 1.4 mm/s with a unit of 1 (tolerance 1e-6), 8.4 and 0.3 mm/s with this one (1e-7);
/// 8.0 and 0.7 mm/s with 100, 8.6 and 0.3 mm/s with 1000.
pub const COST_UNIT: f64 = 300.0;

/// A block of consecutive rows and the cone that their slacks s lie in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cone {
    /// s = 0.
    Zero(usize),
    /// s ≥ 0.
    Nonnegative(usize),
    /// s₀ ≥ ‖(s₁, s₂, …)‖.
    SecondOrder(usize),
}

/// The facts of one pass, in the craft's frame.
#[derive(Clone, Debug)]
pub struct Pass<'a> {
    /// Lengths of the intervals Δt_0 … Δt_{N−1}, s.
    pub steps: &'a [f64],
    /// Velocity through the water now, v_0, m/s.
    pub velocity: Vector2<f64>,
    /// Acceleration through the water until now a_{−1}, m/s².
    pub acceleration: Vector2<f64>,
    /// By how much the direction of travel is behind a heading reference that turns T, s.
    pub course_lag: f64,
    /// Current v_c, m/s.
    pub current: Vector2<f64>,
    /// Goal positions r_0 … r_N, m.
    pub goal: &'a [Vector2<f64>],
    /// Velocity through the water that matches the goal's at stages 0 … N, m/s.
    pub goal_velocity: &'a [Vector2<f64>],
    /// Directions of travel c_0 … c_N: unit vectors.
    pub directions: &'a [Vector2<f64>],
    /// What the craft can do.
    pub limits: &'a Limits,
    /// Acceleration that the surge loop gives unasked at the start of each interval, m/s².
    pub surge_bias: &'a [f64],
    /// AUVs to stay within acoustic range of, those that the goal names first.
    pub ranges: &'a [Range],
    /// Discs to stay out of.
    pub discs: &'a [Disc],
    /// Edges of the area to stay in.
    pub edges: &'a [Edge],
    /// AUVs whose worst range is to be small; none where the goal is a point.
    pub worst: &'a [Member],
    /// Weights of the cost.
    pub weights: &'a Weights,
    /// What energy there is a price for.
    pub power: PropulsionPower,
}

/// Horizontal distance to keep within of an AUV, at stages 0 … N.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Range {
    /// Where the AUV is, m.
    pub centres: Vec<Vector2<f64>>,
    /// Farthest horizontal distance, m, never negative.
    pub radii: Vec<f64>,
    /// Whether the goal names the AUV.
    pub named: bool,
}

/// A disc to stay out of, at stages 0 … N; it may move, as an AUV that surfaces does.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Disc {
    /// Its centre, m.
    pub centres: Vec<Vector2<f64>>,
    /// Distance to keep from the centre, m; negative where the disc is not there.
    pub radii: Vec<f64>,
    /// For each interval k − 1 → k at place k, the unit vector from the disc to the side on which the craft passes; at
    /// place 0 none is used.
    pub normals: Vec<Vector2<f64>>,
}

/// A half-plane to stay in: normal · p ≤ offset.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Edge {
    /// Unit vector out of the area.
    pub normal: Vector2<f64>,
    /// Distance of the edge from the craft's position now, m.
    pub offset: f64,
}

/// An AUV whose slant range counts, at stages 0 … N.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Member {
    /// Where it is, m.
    pub positions: Vec<Vector2<f64>>,
    /// How deep, m.
    pub depths: Vec<f64>,
}

/// One program in standard form.
#[derive(Clone, Debug, PartialEq)]
pub struct Program {
    /// Where each number stands.
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
    cost_triplets: Vec<Triplet>,
    row_triplets: Vec<Triplet>,
}

impl Pass<'_> {
    /// The shape of the pass's program.
    #[must_use]
    pub fn layout(&self) -> Layout {
        Layout {
            n_stages: self.steps.len(),
            n_ranges: self.ranges.len(),
            n_other_ranges: self.ranges.iter().filter(|range| !range.named).count(),
            n_discs: self.discs.len(),
            n_edges: self.edges.len(),
            n_worst: self.worst.len(),
            energy: self.weights.energy > 0.0,
        }
    }
}

impl Program {
    /// States `pass` as a program.
    #[must_use]
    pub fn new(pass: &Pass<'_>) -> Self {
        let layout = pass.layout();
        let (n, n_stages) = (layout.n_variables(), layout.n_stages);
        let mut cones = vec![
            Cone::Zero(2 * n_stages),
            Cone::Nonnegative(layout.n_inequalities()),
        ];
        let n_cones_of_three = n_stages * (1 + layout.n_ranges);
        cones.extend((0..n_cones_of_three).map(|_| Cone::SecondOrder(3)));
        cones.extend((0..n_stages * layout.n_worst).map(|_| Cone::SecondOrder(4)));
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
        program.write(pass);
        program.quadratic = Sparse::new(n, n, &program.cost_triplets);
        program.constraints = Sparse::new(layout.n_rows(), n, &program.row_triplets);
        program
    }

    /// The same in the form that a solver takes.
    #[must_use]
    pub fn standard_form(&self) -> StandardForm<'_> {
        StandardForm {
            quadratic: &self.quadratic,
            linear: &self.linear,
            constraints: &self.constraints,
            bounds: &self.bounds,
            cones: &self.cones,
        }
    }

    /// Rewrites the numbers for another pass of the same shape; allocates nothing.
    pub fn restate(&mut self, pass: &Pass<'_>) {
        self.write(pass);
        self.quadratic.fill(&self.cost_triplets);
        self.constraints.fill(&self.row_triplets);
    }

    /// The two columns of v_1, ahead and starboard, and what one unit of a variable there is, m/s: all that a reader
    /// of the bare numbers needs to tell what they steer.
    #[must_use]
    pub fn first_velocity(&self) -> ([usize; 2], f64) {
        let column = self.layout.velocity(1);
        ([column, column + 1], 1.0)
    }

    fn write(&mut self, pass: &Pass<'_>) {
        debug_assert_eq!(pass.layout(), self.layout);
        self.cost_triplets.clear();
        self.row_triplets.clear();
        self.linear.fill(0.0);
        self.bounds.fill(0.0);
        if pass.worst.is_empty() {
            self.stay_with_the_goal(pass);
        } else {
            self.keep_the_worst_range_small(pass);
        }
        self.move_with_the_goal(pass);
        self.spare_the_thrusters(pass);
        if self.layout.energy {
            self.spare_the_batteries(pass);
        }
        self.price_the_slacks(pass);
        let quadratic = self.cost_triplets.iter_mut().map(|(_, _, value)| value);
        for cost in quadratic.chain(&mut self.linear) {
            *cost /= COST_UNIT;
        }
        self.move_as_the_velocity_says(pass);
        self.accelerate_as_the_surge_loop_can(pass);
        self.keep_moving_ahead(pass);
        self.turn_no_faster_than_the_craft_can(pass);
        self.never_outrun_the_craft(pass);
        self.stay_in_acoustic_range(pass);
        self.stay_in_the_area(pass);
        self.keep_out_of_the_discs(pass);
    }

    fn stages(&self) -> std::ops::RangeInclusive<usize> {
        1..=self.layout.n_stages
    }

    fn add_velocity(&mut self, row: usize, k: usize, coefficient: Vector2<f64>) {
        for axis in 0..2 {
            self.row_triplets
                .push((row, self.layout.velocity(k) + axis, coefficient[axis]));
        }
    }

    fn add_deviation(&mut self, row: usize, k: usize, coefficient: Vector2<f64>) {
        for axis in 0..2 {
            self.row_triplets
                .push((row, self.layout.deviation(k) + axis, coefficient[axis]));
        }
    }

    /// Widens a row by the slack of its kind; `unit` is that of the row's own numbers.
    fn soften(&mut self, row: usize, k: usize, slack: Slack, unit: f64) {
        self.row_triplets
            .push((row, self.layout.slack(k, slack), -SLACK_UNIT / unit));
    }
}

/// The unit vector 90° clockwise of `direction`.
pub(crate) fn starboard_of(direction: Vector2<f64>) -> Vector2<f64> {
    Vector2::new(-direction.y, direction.x)
}

#[cfg(test)]
mod tests;
