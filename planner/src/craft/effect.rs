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

use crate::tuned::CraftNumbers;

/// Evidence h at which references are assumed without effect; it bounds an answer's memory.
const EVIDENCE_ENOUGH: f64 = 9.0;

/// The effect of one loop's references.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
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
        Self { expected: seen, seen, ..Self::default() }
    }

    /// `true` if references are assumed without effect.
    pub fn is_missing(&self) -> bool {
        EVIDENCE_ENOUGH <= self.evidence
    }

    /// The same `elapsed` later, s, for a loop with this `reference`, now at `seen`. `response` is
    /// the slowest craft's; `difference` is a − b of two headings or speeds.
    pub(super) fn after(
        &self,
        (reference, seen): (f64, f64),
        (sigma, tuned): (f64, &CraftNumbers),
        elapsed: f64,
        difference: impl Fn(f64, f64) -> f64,
        response: impl Fn(f64) -> f64,
    ) -> Self {
        let left = |from: f64| difference(reference, from).abs();
        let from = if left(self.seen) < left(self.expected) { self.seen } else { self.expected };
        let expected = response(from);
        let (expected_now, seen_now) = (difference(expected, from), difference(seen, self.seen));
        let reverses = expected_now * self.expected_change < 0.0
            && expected_now.abs() > tuned.effect_reversal * sigma * elapsed;
        let kept = if reverses { 0.0 } else { 1.0 };
        let fade = (-elapsed / tuned.effect_memory).exp();
        let expected_change = fade * (kept * self.expected_change + expected_now);
        let seen_change = fade * (kept * self.seen_change + seen_now);
        // An opposite change has another cause, such as an integrator that unwinds.
        let answer = (seen_change * expected_change).max(0.0);
        let square = expected_change * expected_change;
        let variance = sigma * sigma + tuned.effect_model_error * tuned.effect_model_error * square;
        let gain = (square - 2.0 * answer) / (2.0 * variance);
        // A craft beyond the reference that the slowest still approaches has nothing to do.
        let is_asked = difference(reference, seen) * expected_change > 0.0;
        let gain = if is_asked { gain } else { gain.min(0.0) };
        let fading = EVIDENCE_ENOUGH / tuned.effect_fading_time;
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
        Self { evidence: self.evidence, ..Self::new(seen) }
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
