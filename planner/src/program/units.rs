//! Units inside the program.

/// Unit of length in the program, m: makes errors and speeds similar numbers.
pub const LENGTH_UNIT: f64 = 10.0;

/// Unit of a slack in the program, m/s, m/s² or m: fewer iterations (`docs/rationale.md#solver`).
pub const SLACK_UNIT: f64 = 0.01;

/// Unit of the cost in the program: prices of 10⁴ and more have multipliers that an interior point
/// reaches slowly and inexactly; see `docs/rationale.md#solver`.
pub const COST_UNIT: f64 = 300.0;
