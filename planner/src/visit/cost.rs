//! Evolution of the cost of one AUV, with and without service, in closed form.

use crate::facts::schedule::CostUnit;
use crate::facts::visit::Fixes;
use crate::facts::visit::VisitCost::{self, Age, Data, Uncertainty};
use crate::tuned::VisitNumbers;

/// Least horizontal distance of a range that tells anything, m.
const DISTANCE_MIN: f64 = 1.0;

/// A cost after some time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Later {
    pub(crate) cost: f64,
    /// Its integral since the start, times s.
    pub(crate) integral: f64,
}

/// Place of the craft relative to an AUV that it serves: horizontal distance and depth, m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ServicePlace {
    pub(crate) distance: f64,
    pub(crate) depth: f64,
}

impl ServicePlace {
    fn range(&self) -> f64 {
        self.distance.hypot(self.depth)
    }
}

impl VisitCost {
    /// The cost after `elapsed` seconds without service, from `cost`.
    pub(crate) fn unserved(&self, cost: f64, elapsed: f64) -> Later {
        let growth = match *self {
            Age => 1.0,
            Uncertainty { growth_m2ps, .. } => growth_m2ps,
            Data { growth_kbps, .. } => growth_kbps,
        };
        Later { cost: cost + growth * elapsed, integral: (cost + 0.5 * growth * elapsed) * elapsed }
    }

    /// The cost after `elapsed` seconds of service from `place`, from `cost`.
    pub(crate) fn served(&self, cost: f64, elapsed: f64, place: ServicePlace) -> Later {
        match *self {
            Age => Later { cost: 0.0, integral: 0.0 },
            Uncertainty { growth_m2ps, .. } => aided(cost, elapsed, growth_m2ps, self.fix_noise(place)),
            Data { growth_kbps, .. } => uploaded(cost, elapsed, growth_kbps - self.upload(place.range())),
        }
    }

    /// The cost of an AUV after long service at the surface.
    pub(crate) fn fresh(&self) -> f64 {
        self.steady(ServicePlace { distance: 0.0, depth: 0.0 })
    }

    /// The least cost after long service from `place`.
    pub(crate) fn steady(&self, place: ServicePlace) -> f64 {
        match *self {
            Age | Data { .. } => 0.0,
            Uncertainty { growth_m2ps, .. } => (growth_m2ps * self.fix_noise(place)).sqrt(),
        }
    }

    /// Distinct ascending times of service, s, for an AUV with `cost` at first, from `place`.
    ///
    /// An age is 0 at once. A variance is almost stationary after √(S/q), and longer visits pay
    /// after a long leg. A backlog ends when it is uploaded.
    pub(crate) fn dwells(&self, cost: f64, place: ServicePlace, least: f64, tuned: &VisitNumbers) -> Dwells {
        let whole = match *self {
            Age => 0.0,
            Uncertainty { growth_m2ps, .. } => (self.fix_noise(place) / growth_m2ps).sqrt(),
            Data { growth_kbps, .. } => {
                let falls = self.upload(place.range()) - growth_kbps;
                if falls > 0.0 { cost / falls } else { tuned.dwell_max }
            }
        };
        let shares: &[f64] = match self {
            Uncertainty { .. } => &[0.0, 0.5, 1.0, 1.75, 3.0],
            Age | Data { .. } => &[0.0, 0.5, 1.0],
        };
        let mut dwells = Dwells::new();
        for share in shares {
            let dwell = (share * whole).min(tuned.dwell_max).max(least);
            if dwells.last().is_none_or(|before: &f64| before * tuned.dwell_ratio < dwell) {
                dwells.push(dwell);
            }
        }
        dwells
    }

    /// `true` if an AUV at the slant range `range`, m, can be served.
    pub(crate) fn reaches(&self, range: f64) -> bool {
        match *self {
            Age | Uncertainty { .. } => true,
            Data { range_max_m, .. } => range < range_max_m,
        }
    }

    pub(crate) fn unit(&self) -> CostUnit {
        match self {
            Age => CostUnit::Seconds,
            Uncertainty { .. } => CostUnit::SquareMetres,
            Data { .. } => CostUnit::Kilobits,
        }
    }

    /// Intensity of the measurements' noise as continuous ones along either axis: R T, m² s.
    ///
    /// A range r from the horizontal distance d has the information (d/r)²/σ² along the line of
    /// sight, on an arc half of that along either axis.
    fn fix_noise(&self, place: ServicePlace) -> f64 {
        let Uncertainty { fixes, sigma_m, sigma_rad, interval_s, .. } = *self else {
            return 0.0;
        };
        let variance = match fixes {
            Fixes::Usbl => sigma_m.powi(2) + (sigma_rad * place.range()).powi(2),
            Fixes::Range => {
                2.0 * sigma_m.powi(2) * (1.0 + (place.depth / place.distance.max(DISTANCE_MIN)).powi(2))
            }
        };
        variance * interval_s
    }

    /// Rate of upload at `range`, kbit/s.
    fn upload(&self, range: f64) -> f64 {
        match *self {
            Data { upload_kbps, range_max_m, .. } => upload_kbps * (1.0 - range / range_max_m).max(0.0),
            Age | Uncertainty { .. } => 0.0,
        }
    }
}

/// Times of service to choose from.
pub(crate) type Dwells = smallvec::SmallVec<[f64; 4]>;

/// A scalar Kalman–Bucy filter with process noise `q`, m²/s, measurement noise `s` = R T, m² s.
///
/// ```text
/// Ṗ = q − P²/S,  P∞ = √(q S),  λ = √(q/S),  y₀ = P/P∞
/// P(t) = P∞ (y₀ + tanh λt) / (1 + y₀ tanh λt)
/// ∫P   = S ln(cosh λt + y₀ sinh λt)
/// ```
/// Source: separation of variables; differentiate the second line.
fn aided(cost: f64, elapsed: f64, q: f64, s: f64) -> Later {
    let (steady, rate) = ((q * s).sqrt(), (q / s).sqrt());
    let (y, x) = (cost / steady, rate * elapsed);
    let less = (-2.0 * x).exp_m1();
    let tanh = -less / (2.0 + less);
    // ln(cosh x + y sinh x) without overflow for long times.
    let growth = x + (-0.5 * (y - 1.0) * less).ln_1p();
    Later { cost: steady * (y + tanh) / (1.0 + y * tanh), integral: s * growth }
}

/// A backlog with the net `rate`, kbit/s, of either sign; never below 0.
fn uploaded(backlog: f64, elapsed: f64, rate: f64) -> Later {
    let falling = if rate < 0.0 { elapsed.min(backlog / -rate) } else { elapsed };
    Later { cost: (backlog + rate * falling).max(0.0), integral: (backlog + 0.5 * rate * falling) * falling }
}

#[cfg(test)]
mod tests;
