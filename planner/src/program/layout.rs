//! Where each number of a program stands: all index arithmetic, and nothing else.

/// Where each variable and each row stands; depends on the number of stages only.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Layout {
    /// Number of stages N.
    pub n_stages: usize,
}

/// Soft rows of a stage, each with a slack of its own.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Slack {
    ForwardSpeed = 0,
    TurnRate = 1,
    TrustCone = 2,
}

pub(super) const N_SLACKS: usize = 3;
const N_STATES: usize = 4;

#[expect(
    clippy::unused_self,
    reason = "callers need not know which places depend on the number of stages"
)]
impl Layout {
    /// Number of variables.
    #[must_use]
    pub fn n_variables(self) -> usize {
        (N_STATES + N_SLACKS) * self.n_stages
    }

    /// Number of rows.
    #[must_use]
    pub fn n_rows(self) -> usize {
        self.speed_cone(self.n_stages + 1)
    }

    /// First of the two columns of d_k, k = 1 … N.
    pub(crate) fn deviation(self, k: usize) -> usize {
        N_STATES * (k - 1)
    }

    /// First of the two columns of v_k, k = 1 … N.
    pub(crate) fn velocity(self, k: usize) -> usize {
        N_STATES * (k - 1) + 2
    }

    /// Column of a slack of stage k = 1 … N.
    pub(crate) fn slack(self, k: usize, slack: Slack) -> usize {
        N_STATES * self.n_stages + N_SLACKS * (k - 1) + slack as usize
    }

    // Rows, block after block: two of dynamics, two of acceleration, one of forward speed, two of turn
    // rate, two of the trust cone, three of slacks, three of the speed cone for each stage.
    pub(super) fn dynamics(self, k: usize) -> usize {
        2 * (k - 1)
    }

    pub(super) fn acceleration(self, k: usize) -> usize {
        2 * self.n_stages + 2 * (k - 1)
    }

    pub(super) fn forward_speed(self, k: usize) -> usize {
        4 * self.n_stages + (k - 1)
    }

    pub(super) fn turn_rate(self, k: usize) -> usize {
        5 * self.n_stages + 2 * (k - 1)
    }

    pub(super) fn trust_cone(self, k: usize) -> usize {
        7 * self.n_stages + 2 * (k - 1)
    }

    pub(super) fn slack_sign(self, k: usize, slack: Slack) -> usize {
        9 * self.n_stages + N_SLACKS * (k - 1) + slack as usize
    }

    pub(super) fn speed_cone(self, k: usize) -> usize {
        (9 + N_SLACKS) * self.n_stages + 3 * (k - 1)
    }
}
