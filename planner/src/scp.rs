//! Sequential convex programming (SCP): subproblems linearised about the previous solution.

pub(crate) mod detours;
pub(crate) mod follower;
pub(crate) mod initial_guesses;
pub(crate) mod iterations;
pub(crate) mod predicted_cost;
pub(crate) mod result;
