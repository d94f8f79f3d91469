//! The convex subproblem of one SCP iteration.

use nalgebra::Vector2;

use crate::craft::closed_loop::Power;
use crate::facts::asc::Limits;
use crate::problem::limits::{AcousticRange, Disc, Edge, MinimaxRange, Shore};
use crate::problem::parameters::Weights;
use crate::program::layout::Layout;

/// The facts of one subproblem, in the craft's frame.
#[derive(Clone, Debug)]
pub struct Subproblem<'a> {
    /// Lengths of the intervals Δt_0 … Δt_{N−1}, s.
    pub steps: &'a [f64],
    /// Velocity through the water now, v_0, m/s.
    pub velocity: Vector2<f64>,
    /// Acceleration through the water before now a_{−1}, m/s².
    pub acceleration: Vector2<f64>,
    /// Lag of the direction of travel behind a heading reference that turns, T, s.
    pub course_lag: f64,
    /// Current v_c, m/s.
    pub current: Vector2<f64>,
    /// Goal positions r_0 … r_N, m.
    pub goal: &'a [Vector2<f64>],
    /// Velocity through the water that matches the goal's at stages 0 … N, m/s.
    pub goal_velocity: &'a [Vector2<f64>],
    /// Directions of travel c_0 … c_N: unit vectors.
    pub directions: &'a [Vector2<f64>],
    /// Limits of the craft.
    pub limits: &'a Limits,
    /// Acceleration disturbance of the surge loop at the start of each interval, m/s².
    pub surge_disturbance: &'a [f64],
    /// AUVs with a limit of acoustic range; those that the goal names are first.
    pub ranges: &'a [AcousticRange],
    /// Discs to stay out of.
    pub discs: &'a [Disc],
    /// Half-planes beside no-go areas.
    pub shores: &'a [Shore],
    /// Edges of the area to stay in.
    pub edges: &'a [Edge],
    /// AUVs in a minimax range; none if the goal is a point.
    pub minimax: &'a [MinimaxRange],
    /// Weights of the cost.
    pub weights: &'a Weights,
    /// Propulsion power, for a price of energy.
    pub power: Power,
}

impl Subproblem<'_> {
    /// The shape of the subproblem's program.
    pub fn layout(&self) -> Layout {
        Layout {
            n_stages: self.steps.len(),
            n_ranges: self.ranges.len(),
            n_other_ranges: self.ranges.iter().filter(|range| !range.named).count(),
            n_discs: self.discs.len() + self.shores.len(),
            n_edges: self.edges.len(),
            n_minimax: self.minimax.len(),
            energy: self.weights.energy > 0.0 && self.power != Power::default(),
        }
    }
}
