//! Whether references have an effect at all: a fault of an actuator, and no slower parameter.
//!
//! ```text
//! y_s⁺ = response(y_s, reference) of the slowest craft that is believed, never farther from the reference than y
//! X ← a (X + y_s⁺ − y_s)    Y ← a (Y + y⁺ − y)    a = exp(−Δ/τ)              changes of late: expected, and seen
//! Y′ = Y where it has the sign of X, else 0
//! g ← clamp(g + Δ ((X² − 2 X Y′)/(2(σ² + κ²X²)) − f), 0, 2h)                  no effect where h ≤ g
//! ```
//! The increment is the logarithm of how much more probable the change that is seen is where references have no effect (mean
//! 0) than where they have that of the slowest craft (mean X). It is 0 for half of that. A constant offset and a steady
//! turn change nothing in it, and nothing is decided while references ask for no change. What was decided fades at a
//! rate f.
//!
//! Source: E. S. Page, "Continuous inspection schemes", 1954, doi:10.1093/biomet/41.1-2.100. What it misses and what it raises
//! falsely: `docs/evidence.md#random-craft`.

/// Time over which changes count, s.
const MEMORY: f64 = 10.0;

/// Rate, in deviations a second, of an expected change to the other side that begins the changes anew: a craft that is faster than
/// the slowest reverses sooner.
const REVERSAL: f64 = 0.2;

/// Evidence h from which references are taken to have no effect.
const EVIDENCE_ENOUGH: f64 = 9.0;

/// Time in which evidence enough fades, s.
const FADING_TIME: f64 = 60.0;

/// Part κ of an expected change by which it may be wrong: dead times, overshoot and integrators are in no first-order lag. It
/// bounds what a second adds to the evidence: a late answer to a large step is no fault.
const MODEL_ERROR: f64 = 0.5;

/// Standard deviation σ of a change of heading that noise and waves make, rad.
pub(super) const HEADING_SIGMA: f64 = 0.04;

/// The same of a speed, m/s. Waves make more than that, but not for long.
pub(super) const SPEED_SIGMA: f64 = 0.02;

/// The effect of one loop's references.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Effect {
    /// Where the slowest craft that is believed would be, rad or m/s.
    pub expected: f64,
    /// Where the craft was seen last, rad or m/s.
    pub seen: f64,
    /// Change of late that the slowest craft makes.
    pub expected_change: f64,
    /// Change of late that was seen.
    pub seen_change: f64,
    /// Evidence that references have no effect, from 0 on.
    pub evidence: f64,
}

/// Largest evidence that is remembered: references that have an effect again are believed after half of that.
pub(super) const EVIDENCE_MAX: f64 = 2.0 * EVIDENCE_ENOUGH;

impl Effect {
    /// The start, for a loop whose heading or speed is `seen` now.
    pub(super) fn new(seen: f64) -> Self {
        Self {
            expected: seen,
            seen,
            expected_change: 0.0,
            seen_change: 0.0,
            evidence: 0.0,
        }
    }

    /// Whether references are taken to have none.
    #[must_use]
    pub fn is_missing(&self) -> bool {
        EVIDENCE_ENOUGH <= self.evidence
    }

    /// Its numbers, in the order in which a memory has them.
    pub(super) fn memory(&self) -> [f64; 5] {
        [
            self.expected,
            self.seen,
            self.expected_change,
            self.seen_change,
            self.evidence,
        ]
    }

    /// The same `elapsed` later, s, of a loop that was asked for `reference` and is `seen` now. `response` is the slowest
    /// craft's from where it is, `difference` is a − b of two headings or speeds.
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
        // What goes the other way is moved by something else, as by an integrator that unwinds.
        let answer = (seen_change * expected_change).max(0.0);
        let square = expected_change * expected_change;
        let variance = sigma * sigma + MODEL_ERROR * MODEL_ERROR * square;
        let gain = (square - 2.0 * answer) / (2.0 * variance);
        // Of one that is beyond the reference that the slowest still goes to, nothing is asked.
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

    /// The same of a loop that is `seen` now and begins anew, whatever it was asked for.
    pub(super) fn anew(&self, seen: f64) -> Self {
        Self {
            evidence: self.evidence,
            ..Self::new(seen)
        }
    }

    /// The same where nothing can be expected of the loop, which is `seen` now: the slowest craft goes with it. One that is off
    /// its reference for good, as in a current, is not expected to come nearer after that.
    pub(super) fn paused(&self, seen: f64, difference: impl Fn(f64, f64) -> f64) -> Self {
        Self {
            expected: difference(seen + difference(self.expected, self.seen), 0.0),
            ..self.anew(seen)
        }
    }
}
