//! The second-order cone program of one SCP iteration: what is promised, and where each number stands.
//!
//! Standard form, the one Clarabel solves:
//!
//! ```text
//! minimise ½ xᵀ P x + qᵀ x   subject to   A x + s = b,  s ∈ K
//! ```
//! Variables, stage by stage k = 1 … N over intervals Δt_0 … Δt_{N−1}: deviation from the goal
//! d_k = p_k − r_k, velocity through the water v_k, one slack for each kind of soft row; where the goal is a minimax
//! range its excess τ_k, and where energy has a price a bound σ_k of the speed, m_k ≥ σ_k² and e_k ≥ σ_k³. The
//! acceleration of an interval, a_k = (v_{k+1} − v_k) / Δt_k, is eliminated. The frame is the craft's own:
//! origin and axes (ahead, starboard) are those of its position and heading now, so that a plan cannot depend on
//! where north or the datum is. Positions are counted in units of [`LENGTH_UNIT`], slacks in units of
//! [`SLACK_UNIT`], the cost in units of [`COST_UNIT`].

pub(crate) mod bounds;
pub(crate) mod build;
pub(crate) mod cost;
pub(crate) mod layout;
pub(crate) mod motion;
pub(crate) mod names;
pub mod sparse;
pub(crate) mod standard_form;
pub(crate) mod subproblem;
pub(crate) mod units;

#[cfg(test)]
mod tests;

pub use build::Program;
pub use layout::{Layout, Slack};
pub use standard_form::Cone;
pub use subproblem::Subproblem;
pub use units::{COST_UNIT, LENGTH_UNIT, SLACK_UNIT};

pub use crate::problem::limits::{AcousticRange, Disc, Edge, MinimaxRange};
