//! Test for references without effect: an actuator fault rather than a slow parameter.
//!
//! ```text
//! y_s⁺ = response(y_s, reference) of the slowest plausible craft, from the nearer of y_s and y
//! X ← a (X + y_s⁺ − y_s)    Y ← a (Y + y⁺ − y)    a = exp(−Δ/τ)    recent: expected, measured
//! Y′ = Y if it has the sign of X, else 0
//! g ← clamp(g + Δ ((X² − 2 X Y′)/(2(σ² + κ²X²)) − f), 0, 2h)         no effect if h ≤ g
//! ```
//! The increment is the log-likelihood ratio of the measured change: no effect (mean 0) against the
//! effect on the slowest craft (mean X). It is 0 for half of X. Constant offsets, steady turns and
//! constant references do not change it. Evidence fades at the rate f.
//!
//! Source: E. S. Page, "Continuous inspection schemes", 1954, doi:10.1093/biomet/41.1-2.100. Missed
//! faults and false alarms: `docs/evidence.md#random-craft`.

/// Averaging time τ of changes, s.
const MEMORY: f64 = 10.0;

/// Rate of an opposite expected change, in deviations per second, that restarts the changes: a
/// craft faster than the slowest reverses sooner.
const REVERSAL: f64 = 0.2;

/// Evidence h at which references are assumed without effect.
const EVIDENCE_ENOUGH: f64 = 9.0;

/// Time in which sufficient evidence fades, s.
const FADING_TIME: f64 = 60.0;

/// Relative error κ of an expected change: a first-order lag has no dead times, overshoot or
/// integrators. It bounds the evidence per second: a late response to a large step is no fault.
const MODEL_ERROR: f64 = 0.5;

/// Standard deviation σ of heading changes from noise and waves, rad.
pub(super) const HEADING_SIGMA: f64 = 0.04;

/// Standard deviation of speed changes, m/s. Waves exceed it, but briefly.
pub(super) const SPEED_SIGMA: f64 = 0.02;

/// The effect of one loop's references.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Effect {
    /// Heading or speed of the slowest plausible craft, rad or m/s.
    pub expected: f64,
    /// Last measured heading or speed, rad or m/s.
    pub seen: f64,
    /// Recent change of the slowest craft.
    pub expected_change: f64,
    /// Recent measured change.
    pub seen_change: f64,
    /// Evidence for references without effect, at least 0.
    pub evidence: f64,
}

/// Largest evidence; a regained effect is recognised after half of it.
pub(super) const EVIDENCE_MAX: f64 = 2.0 * EVIDENCE_ENOUGH;

impl Effect {
    /// The start, for a loop at `seen`.
    pub(super) fn new(seen: f64) -> Self {
        Self {
            expected: seen,
            seen,
            expected_change: 0.0,
            seen_change: 0.0,
            evidence: 0.0,
        }
    }

    /// `true` if references are assumed without effect.
    #[must_use]
    pub fn is_missing(&self) -> bool {
        EVIDENCE_ENOUGH <= self.evidence
    }

    /// Its numbers, in the order of the memory.
    pub(super) fn memory(&self) -> [f64; 5] {
        [
            self.expected,
            self.seen,
            self.expected_change,
            self.seen_change,
            self.evidence,
        ]
    }

    /// The same `elapsed` later, s, for a loop with this `reference`, now at `seen`. `response` is
    /// the slowest craft's; `difference` is a − b of two headings or speeds.
    pub(super) fn after(
        &self,
        (reference, seen): (f64, f64),
        sigma: f64,
        elapsed: f64,
        difference: impl Fn(f64, f64) -> f64,
        response: impl Fn(f64) -> f64,
    ) -> Self {
        let left = |from: f64| difference(reference, from).abs();
        let from = if left(self.seen) < left(self.expected) {
            self.seen
        } else {
            self.expected
        };
        let expected = response(from);
        let (expected_now, seen_now) = (difference(expected, from), difference(seen, self.seen));
        let reverses =
            expected_now * self.expected_change < 0.0 && expected_now.abs() > REVERSAL * sigma * elapsed;
        let kept = if reverses { 0.0 } else { 1.0 };
        let fade = (-elapsed / MEMORY).exp();
        let expected_change = fade * (kept * self.expected_change + expected_now);
        let seen_change = fade * (kept * self.seen_change + seen_now);
        // An opposite change has another cause, such as an integrator that unwinds.
        let answer = (seen_change * expected_change).max(0.0);
        let square = expected_change * expected_change;
        let variance = sigma * sigma + MODEL_ERROR * MODEL_ERROR * square;
        let gain = (square - 2.0 * answer) / (2.0 * variance);
        // A craft beyond the reference that the slowest still approaches has nothing to do.
        let is_asked = difference(reference, seen) * expected_change > 0.0;
        let gain = if is_asked { gain } else { gain.min(0.0) };
        let fading = EVIDENCE_ENOUGH / FADING_TIME;
        Self {
            expected,
            seen,
            expected_change,
            seen_change,
            evidence: (self.evidence + elapsed * (gain - fading)).clamp(0.0, EVIDENCE_MAX),
        }
    }

    /// The same for a loop at `seen` whose changes restart.
    pub(super) fn restarted(&self, seen: f64) -> Self {
        Self {
            evidence: self.evidence,
            ..Self::new(seen)
        }
    }

    /// The same while nothing can be expected of the loop at `seen`: the slowest craft moves with
    /// it, so a lasting offset, as in a current, is not expected to shrink afterwards.
    pub(super) fn paused(&self, seen: f64, difference: impl Fn(f64, f64) -> f64) -> Self {
        Self {
            expected: difference(seen + difference(self.expected, self.seen), 0.0),
            ..self.restarted(seen)
        }
    }
}
