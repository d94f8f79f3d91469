//! The positions of the last seconds, and the travel by the measured velocity in that time.

use std::collections::VecDeque;

use nalgebra::Vector2;
use planner::angle::wrap;

use crate::Origin;

/// Mean radius: the ellipsoid differs by 0.3 %, over a few metres.
const EARTH_RADIUS_M: f64 = 6_371_000.0;
/// Time between two kept positions, s.
const KEEP_EACH_S: f64 = 0.5;
/// Time for which they are kept, s.
const KEPT_S: f64 = 20.0;
/// Times over which positions show a velocity, s: noise of 1 m makes 0.7 m/s in the shortest one.
const VELOCITY_SPAN_S: [f64; 2] = [2.0, 5.0];
/// Measurements farther apart than this belong to different motions, s.
const GAP_MAX_S: f64 = 3.0;

/// Least number of values of a trend.
const TREND_COUNT_MIN: usize = 5;

/// Positions by time.
#[derive(Clone, Debug, Default)]
pub(crate) struct RecentPositions {
    samples: VecDeque<PositionSample>,
    newest: Option<PositionSample>,
    /// Integral of the measured velocity (north, east), m.
    pub(crate) travelled: Vector2<f64>,
    /// The newest measured velocity (north, east), m/s, and its time, s.
    velocity: Option<(f64, Vector2<f64>)>,
    /// Time since which velocities have come without a gap, s.
    measured_since_s: f64,
}

#[derive(Clone, Copy, Debug)]
struct PositionSample {
    t_s: f64,
    position: Origin,
    travelled: Vector2<f64>,
}

impl RecentPositions {
    /// Adds the position at `t_s`, s. A gap or a clock set back restarts. `true` if it is kept.
    pub(crate) fn push(&mut self, t_s: f64, position: Origin) -> bool {
        let gap = self.newest.map_or(0.0, |before| t_s - before.t_s);
        if !(0.0..=GAP_MAX_S).contains(&gap) {
            self.samples.clear();
        }
        // The velocity of this moment comes later.
        let since = self.velocity.map(|(at, velocity)| (t_s - at, velocity));
        let since = since.filter(|(elapsed, _)| (0.0..=GAP_MAX_S).contains(elapsed));
        let since = since.map_or_else(Vector2::zeros, |(elapsed, velocity)| velocity * elapsed);
        let travelled = self.travelled + since;
        let newest = PositionSample { t_s, position, travelled };
        self.newest = Some(newest);
        let last = self.samples.back();
        let is_kept = last.is_none_or(|last| t_s - last.t_s >= KEEP_EACH_S);
        if is_kept {
            self.samples.push_back(newest);
        }
        let is_old = |oldest: &PositionSample| t_s - oldest.t_s > KEPT_S;
        while self.samples.front().is_some_and(is_old) {
            self.samples.pop_front();
        }
        is_kept
    }

    /// Adds the measured velocity over ground (north, east), m/s, at `t_s`, s.
    pub(crate) fn travel(&mut self, t_s: f64, velocity: Vector2<f64>) {
        match self.velocity {
            Some((before_s, before)) if (0.0..=GAP_MAX_S).contains(&(t_s - before_s)) => {
                self.travelled += (before + velocity) * (0.5 * (t_s - before_s));
            }
            _ => self.measured_since_s = t_s,
        }
        self.velocity = Some((t_s, velocity));
    }

    /// Forgets all positions: the next one belongs to another motion.
    pub(crate) fn clear(&mut self) {
        self.samples.clear();
        self.newest = None;
    }

    /// Mean velocity over ground (north, east), m/s, of positions over at least two seconds.
    pub(crate) fn velocity(&self) -> Option<Vector2<f64>> {
        let newest = self.newest?;
        let [least, most] = VELOCITY_SPAN_S;
        let mut samples = self.samples.iter();
        let start = samples.find(|sample| newest.t_s - sample.t_s <= most)?;
        let span = newest.t_s - start.t_s;
        (span >= least).then(|| moved(&start.position, &newest.position) / span)
    }

    /// The present velocity is no measurement.
    pub(crate) fn travel_unmeasured(&mut self) {
        self.velocity = None;
    }

    /// Drift between positions and the integral of the measured velocity (north, east), m.
    pub(crate) fn drift(&self) -> Option<Trend> {
        let start = self.newest.filter(|_| self.has_velocity())?;
        trend(self.measured().map(|sample| {
            let by_velocity = sample.travelled - start.travelled;
            (sample.t_s, moved(&start.position, &sample.position) - by_velocity)
        }))
    }

    /// The samples since which velocities have come without a gap.
    fn measured(&self) -> impl Iterator<Item = &PositionSample> {
        self.samples.iter().filter(|sample| sample.t_s >= self.measured_since_s)
    }

    /// `true` if velocities come.
    pub(crate) fn has_velocity(&self) -> bool {
        self.newest.zip(self.velocity).is_some_and(|(newest, (at, _))| newest.t_s - at <= GAP_MAX_S)
    }

    /// Time, s, and distance, m, between travel by positions and by the measured velocity, over the
    /// longest time with both.
    pub(crate) fn mismatch(&self) -> Option<(f64, f64)> {
        let (newest, start) = (self.newest?, self.measured().next()?);
        let by_positions = moved(&start.position, &newest.position);
        let by_velocity = newest.travelled - start.travelled;
        Some((newest.t_s - start.t_s, (by_positions - by_velocity).norm()))
    }
}

/// The straight line through values by time.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Trend {
    pub(crate) span_s: f64,
    /// Change of the values per second, and its standard deviation along either axis.
    pub(crate) slope: Vector2<f64>,
    slope_sigma: f64,
    /// Degrees of freedom of `slope_sigma`, along both axes.
    freedom: f64,
    /// Root mean square of the deviations.
    pub(crate) rms: f64,
}

impl Trend {
    /// The length of a slope that noise exceeds as rarely as a normal one of two axes exceeds this
    /// many `sigmas`. The standard deviation is an estimate, from few values a poor one:
    ///
    /// ```text
    /// P(|slope| > k s) = (1 + k²/ν)^(−ν/2) = exp(−sigmas²/2)        |slope|²/2s²: F(2, ν)
    /// ```
    pub(crate) fn slope_beyond(&self, sigmas: f64) -> f64 {
        let square = self.freedom * (sigmas.powi(2) / self.freedom).exp_m1();
        square.sqrt() * self.slope_sigma
    }
}

/// Least squares through (time, s, value); `None` for less than [`TREND_COUNT_MIN`] values.
pub(crate) fn trend(values: impl Iterator<Item = (f64, Vector2<f64>)>) -> Option<Trend> {
    let values: Vec<_> = values.collect();
    let count = f64::from(u32::try_from(values.len()).ok()?);
    if values.len() < TREND_COUNT_MIN {
        return None;
    }
    let times: f64 = values.iter().map(|(t_s, _)| t_s).sum();
    let sum: Vector2<f64> = values.iter().map(|(_, value)| value).sum();
    let (middle_s, mean) = (times / count, sum / count);
    let (mut spread, mut slope, mut square) = (0.0, Vector2::zeros(), 0.0);
    for (t_s, value) in &values {
        spread += (t_s - middle_s).powi(2);
        slope += (value - mean) * (t_s - middle_s);
        square += (value - mean).norm_squared();
    }
    slope /= spread;
    let residual = (square - slope.norm_squared() * spread).max(0.0);
    let freedom = 2.0 * (count - 2.0);
    Some(Trend {
        span_s: (values[0].0 - values[values.len() - 1].0).abs(),
        slope,
        slope_sigma: (residual / freedom / spread).sqrt(),
        freedom,
        rms: (residual / count).sqrt(),
    })
}

/// Displacement (north, east), m, between two nearby positions.
pub(crate) fn moved(from: &Origin, to: &Origin) -> Vector2<f64> {
    let north = (to.lat_deg - from.lat_deg).to_radians();
    // The shorter distance, also across the antimeridian.
    let east = wrap((to.lon_deg - from.lon_deg).to_radians());
    Vector2::new(north, east * from.lat_deg.to_radians().cos()) * EARTH_RADIUS_M
}

/// The position at this displacement (north, east), m, from `from`.
pub(crate) fn displaced(from: &Origin, by: &Vector2<f64>) -> Origin {
    let east = by.y / from.lat_deg.to_radians().cos().max(f64::EPSILON);
    Origin {
        lat_deg: (from.lat_deg + (by.x / EARTH_RADIUS_M).to_degrees()).clamp(-90.0, 90.0),
        lon_deg: wrap(from.lon_deg.to_radians() + east / EARTH_RADIUS_M).to_degrees().clamp(-180.0, 180.0),
    }
}
