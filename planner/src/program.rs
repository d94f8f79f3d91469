//! The second-order cone program of one SCP iteration: its promises and its layout.
//!
//! Clarabel's standard form:
//!
//! ```text
//! minimise ½ xᵀ P x + qᵀ x   subject to   A x + s = b,  s ∈ K
//! ```
//! Variables, by stage k = 1 … N over intervals Δt_0 … Δt_{N−1}: deviation from the goal d_k = p_k
//! − r_k, velocity through the water v_k, one slack for each kind of soft row; for a minimax goal
//! the excess τ_k of its range; with a price of energy a bound σ_k of the speed, m_k ≥ σ_k² and e_k
//! ≥ σ_k³. The acceleration of an interval, a_k = (v_{k+1} − v_k) / Δt_k, is eliminated. The frame
//! is the craft's: origin and axes (ahead, starboard) are its present position and heading, so that
//! a plan is invariant to north and the datum. Positions are in units of [`LENGTH_UNIT`], slacks in
//! units of [`SLACK_UNIT`], the cost in units of [`COST_UNIT`].

pub(crate) mod bounds;
pub(crate) mod build;
pub(crate) mod cost;
pub(crate) mod layout;
pub(crate) mod motion;
pub(crate) mod names;
pub mod sparse;
pub(crate) mod subproblem;
pub(crate) mod units;

#[cfg(test)]
mod tests;

pub use build::{Cone, Program};
pub use layout::{Layout, Slack};
pub use subproblem::Subproblem;
pub use units::{COST_UNIT, LENGTH_UNIT, SLACK_UNIT};

pub use crate::problem::limits::{AcousticRange, Disc, Edge, MinimaxRange};
