//! Speed along a path.

use crate::facts::field_error::FieldError;
use crate::facts::path::limits::{InvalidPath, LENGTH_MAX, require_count, require_within};

/// Fastest speed along a path, m/s: that of the fastest AUV that a snapshot accepts.
const SPEED_MAX: f64 = 10.0;

/// Slowest speed along a path, m/s; slower vehicles do not follow one.
const SPEED_MIN: f64 = 1e-3;

/// Speed `U_d`(γ), m/s, over arc length γ, m: piecewise linear between knots, constant outside.
#[derive(Clone, Debug, PartialEq)]
pub struct SpeedProfile {
    /// Arc length and speed, at least one, arc lengths increasing.
    knots: Vec<(f64, f64)>,
}

impl SpeedProfile {
    /// The same `speed` everywhere, m/s. Fails unless positive and finite.
    pub fn constant(speed: f64) -> Result<Self, InvalidPath> {
        Self::new(vec![(0.0, speed)])
    }

    /// From `knots` of arc length, m, and speed, m/s. Fails without knots, or with the first whose
    /// arc length does not increase, or whose speed is not positive; both must be finite.
    pub fn new(knots: Vec<(f64, f64)>) -> Result<Self, InvalidPath> {
        require_count(format_args!("/knots"), knots.len(), &(1..=usize::MAX), "items")?;
        for (k, (gamma, speed)) in knots.iter().enumerate() {
            require_within(format_args!("/knots/{k}/0"), *gamma, -LENGTH_MAX, LENGTH_MAX)?;
            require_within(format_args!("/knots/{k}/1"), *speed, SPEED_MIN, SPEED_MAX)?;
        }
        for (k, pair) in knots.windows(2).enumerate() {
            let (before, given) = (pair[0].0, pair[1].0);
            if given <= before {
                let place = format_args!("/knots/{}/0", k + 1);
                return Err(Box::new(FieldError::not_increasing(place, given, before)));
            }
        }
        Ok(Self { knots })
    }

    /// Speed at arc length `gamma`, m/s, always positive.
    pub fn at(&self, gamma: f64) -> f64 {
        let after = self.knots.partition_point(|(at, _)| *at <= gamma);
        if after == 0 {
            return self.knots[0].1;
        }
        if after == self.knots.len() {
            return self.knots[after - 1].1;
        }
        let ((from, slow), (to, fast)) = (self.knots[after - 1], self.knots[after]);
        slow + (fast - slow) * (gamma - from) / (to - from)
    }
}
