//! Depth forecast of an AUV in a sawtooth dive.

use crate::facts::{auv::Dive, evidence::SPEED_AT_REST};

/// Depth over time.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum DepthForecast {
    /// Constant depth, m.
    Held(f64),
    /// Two equally likely flights; equal if the direction is known.
    Sawtooth([SawtoothFlight; 2]),
}

/// Lead of a vehicle over one with its mean pitch: it moves level at each reversal.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Lead {
    pub(crate) distance: f64,
    /// Its rate of change, m/s.
    pub(crate) speed: f64,
}

/// A sawtooth from a known depth in a known direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct SawtoothFlight {
    cycle: Cycle,
    depth: f64,
    /// Rate of change of depth until the vehicle joins the sawtooth, m/s.
    rate: f64,
    /// Duration of that, s; 0 on the sawtooth.
    approach: f64,
    /// Phase of the cycle at the join, s.
    phase: f64,
}

/// One cycle: a leg down, a reversal, a leg up, a reversal.
///
/// ```text
/// leg        z = z_min + w t                      w = u sinθ, for (z_max − z_min) / w
/// reversal   z = z_max + w t (1 − t / T)          sin of the pitch linear in time, for T
/// ```
/// and the same upwards. The vehicle begins to turn at the depth that ends a leg, and passes it
/// again a time T later. Differences of simulated AUVs: `docs/rationale.md#forecasts`.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Cycle {
    dive: Dive,
    /// Speed along the body through the water u, m/s, positive.
    speed: f64,
}

impl DepthForecast {
    /// Along its sawtooth, if known, at the horizontal speed `u_h` through the water, m/s.
    ///
    /// Without a reported direction, the mean of the equally likely ones is least wrong.
    pub(crate) fn at_speed(depth: f64, dive: Option<Dive>, u_h: f64) -> Self {
        match dive {
            Some(dive) if SPEED_AT_REST <= u_h => {
                let cycle = Cycle { dive, speed: u_h / dive.pitch_rad.cos() };
                let flight = |descending| SawtoothFlight::new(cycle, depth, descending);
                Self::Sawtooth(match dive.descending {
                    Some(descending) => [flight(descending); 2],
                    None => [flight(true), flight(false)],
                })
            }
            Some(_) | None => Self::Held(depth),
        }
    }

    /// Expected depth `elapsed` seconds after the report, m.
    pub(crate) fn at(&self, elapsed: f64) -> f64 {
        match self {
            Self::Held(depth) => *depth,
            Self::Sawtooth([one, other]) => 0.5 * (one.depth(elapsed) + other.depth(elapsed)),
        }
    }

    /// Least possible depth at that time, m: of both flights, if the direction is unknown.
    pub(crate) fn shallowest(&self, elapsed: f64) -> f64 {
        match self {
            Self::Held(depth) => *depth,
            Self::Sawtooth([one, other]) => one.depth(elapsed).min(other.depth(elapsed)),
        }
    }

    /// Expected lead over a vehicle with the legs' horizontal speed, since the report.
    ///
    /// Its benefit to a craft that follows the AUV: `docs/rationale.md#forecasts`.
    pub(crate) fn lead(&self, elapsed: f64) -> Lead {
        match self {
            Self::Held(_) => Lead::default(),
            Self::Sawtooth(flights) => {
                let [one, other] = flights.map(|flight| flight.lead(elapsed));
                Lead {
                    distance: 0.5 * (one.distance + other.distance),
                    speed: 0.5 * (one.speed + other.speed),
                }
            }
        }
    }
}

impl SawtoothFlight {
    /// From `depth`, m. A vehicle between the two depths continues; one beyond them is in a
    /// reversal, or approaches the sawtooth if it is farther out than any reversal.
    fn new(cycle: Cycle, depth: f64, descending: bool) -> Self {
        let Dive { depth_min_m: depth_min, depth_max_m: depth_max, .. } = cycle.dive;
        let reversal = cycle.dive.reversal();
        let (w, half) = (cycle.sink_rate(), cycle.half_period());
        let on_it = |phase| Self { cycle, depth, rate: 0.0, approach: 0.0, phase };
        // By symmetry of the reversals: `beyond` the depth that ends a leg, outwards or back.
        let reversing = |beyond: f64, going: bool, leg_end: f64, inward: f64| {
            let root = 1.0 - 4.0 * beyond / (w * reversal);
            if root < 0.0 {
                Self { rate: inward * w, approach: beyond / w, ..on_it(leg_end + reversal) }
            } else {
                let before_middle = 0.5 * reversal * root.sqrt();
                on_it(leg_end + 0.5 * reversal + if going { -before_middle } else { before_middle })
            }
        };
        if depth_max < depth {
            reversing(depth - depth_max, descending, half - reversal, -1.0)
        } else if depth < depth_min {
            reversing(depth_min - depth, !descending, 2.0 * half - reversal, 1.0)
        } else if descending {
            on_it((depth - depth_min) / w)
        } else {
            on_it(half + (depth_max - depth) / w)
        }
    }

    fn depth(&self, elapsed: f64) -> f64 {
        if elapsed < self.approach {
            self.depth + self.rate * elapsed
        } else {
            self.cycle.depth(self.phase + elapsed - self.approach)
        }
    }

    fn lead(&self, elapsed: f64) -> Lead {
        let phase = self.phase + (elapsed - self.approach).max(0.0);
        let (now, start) = (self.cycle.lead(phase), self.cycle.lead(self.phase));
        Lead { distance: now.distance - start.distance, speed: now.speed }
    }
}

impl Cycle {
    /// Rate of change of depth on a leg w, m/s.
    fn sink_rate(&self) -> f64 {
        self.speed * self.dive.pitch_rad.sin()
    }

    fn leg(&self) -> f64 {
        (self.dive.depth_max_m - self.dive.depth_min_m) / self.sink_rate()
    }

    /// Duration of a leg and a reversal, s.
    fn half_period(&self) -> f64 {
        self.leg() + self.dive.reversal()
    }

    /// Completed half periods, and the time since, s.
    fn split(&self, phase: f64) -> (f64, f64) {
        let half = (phase / self.half_period()).floor();
        (half, phase - half * self.half_period())
    }

    fn depth(&self, phase: f64) -> f64 {
        let (half, since) = self.split(phase);
        let (w, reversal) = (self.sink_rate(), self.dive.reversal());
        let in_reversal = since - self.leg();
        let travelled = if in_reversal < 0.0 {
            w * since
        } else {
            self.dive.depth_max_m - self.dive.depth_min_m + w * in_reversal * (1.0 - in_reversal / reversal)
        };
        // Vehicles do not fly.
        if half.rem_euclid(2.0) == 0.0 {
            self.dive.depth_min_m + travelled
        } else {
            (self.dive.depth_max_m - travelled).max(0.0)
        }
    }

    /// Lead since the beginning of the cycle over a vehicle with the legs' horizontal speed.
    ///
    /// ```text
    /// ∫ u (cosθ(t) − cosθ_leg) dt        sinθ(t) = sinθ_leg (1 − 2 t / T)
    /// ```
    fn lead(&self, phase: f64) -> Lead {
        let (half, since) = self.split(phase);
        let (sin, cos) = self.dive.pitch_rad.sin_cos();
        let reversal = self.dive.reversal();
        // Antiderivative of √(1 − y²), the cosine of the pitch with sine y.
        let primitive = |y: f64| 0.5 * (y * (1.0 - y * y).sqrt() + y.asin());
        let distance =
            |t: f64, y: f64| self.speed * (0.5 * reversal / sin * (primitive(sin) - primitive(y)) - cos * t);
        let whole = half * distance(reversal, -sin);
        let in_reversal = since - self.leg();
        if in_reversal < 0.0 {
            return Lead { distance: whole, speed: 0.0 };
        }
        let y = sin * (1.0 - 2.0 * (in_reversal / reversal).min(1.0));
        Lead { distance: whole + distance(in_reversal, y), speed: self.speed * ((1.0 - y * y).sqrt() - cos) }
    }
}
