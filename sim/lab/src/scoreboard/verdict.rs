//! One decided claim.

/// A claim about one controller in one scenario, or in all.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Verdict {
    /// What is claimed.
    pub(super) claim: &'static str,
    /// Where; "all" where it is about all scenarios together.
    pub(super) scenario: String,
    /// Name of the controller.
    pub(super) controller: String,
    /// Name of the controller beside it; empty where there is none.
    pub(super) beside: String,
    /// What was measured.
    pub(super) measured: String,
    /// What is claimed of it.
    pub(super) limit: String,
    /// Whether that is so.
    pub(super) holds: bool,
}
