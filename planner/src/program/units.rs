//! Units inside the program.

/// Unit of length inside the program, m: errors of a few metres and speeds of a few tenths of a m/s
/// become numbers of the same size.
pub const LENGTH_UNIT: f64 = 10.0;

/// Unit of a slack inside the program, m/s, m/s² or m: it saves a third of the iterations, see `docs/rationale.md#solver`.
pub const SLACK_UNIT: f64 = 0.01;

/// Unit of the cost inside the program: prices of 10⁴ and more make multipliers that an interior point reaches slowly and
/// not exactly; see `docs/rationale.md#solver`.
pub const COST_UNIT: f64 = 300.0;
