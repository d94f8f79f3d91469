//! Depth forecast of an AUV that rises and falls without a declared or found dive.

use std::f64::consts::PI;

use crate::facts::auv::Auv;
use crate::facts::evidence::Report;
use crate::predict::forecast::{AuvForecast, BETWEEN_MIN};
use crate::snapshot::build::Snapshot;
use crate::tuned::VisitNumbers;

/// Fewest reported depths.
const DEPTHS_MIN: usize = 6;

/// A depth as a damped oscillation about its mean: its phase is known for about a period.
#[derive(Clone, Copy, Debug)]
struct Swing {
    /// Second least and greatest reported depth, and the mean, m; one extreme may be an error.
    least: f64,
    most: f64,
    mean: f64,
    /// Distance of the newest depth below the mean, m, and its age, s.
    below: f64,
    age: f64,
    /// Amplitude in quadrature, m: the present rate over the frequency.
    ahead: f64,
    frequency: f64,
}

impl Swing {
    /// From `reports` until `now`, s.
    fn seen(reports: &[Report], now: f64, tuned: &VisitNumbers) -> Option<Self> {
        let depth = |report: &Report| Some([report.t_s, report.depth_m?]);
        let mut depths: Vec<[f64; 2]> = reports.iter().filter_map(depth).collect();
        depths.sort_by(|a, b| a[0].total_cmp(&b[0]));
        depths.dedup_by(|later, earlier| later[0] - earlier[0] < BETWEEN_MIN);
        if depths.len() < DEPTHS_MIN {
            return None;
        }
        let mut sorted: Vec<f64> = depths.iter().map(|[_, depth]| *depth).collect();
        sorted.sort_by(f64::total_cmp);
        let (least, most) = (sorted[1], sorted[sorted.len() - 2]);
        let kept = |depth: f64| depth.clamp(least, most);
        // Largest rise and largest fall.
        let (mut low, mut high, mut rise, mut fall) = (f64::INFINITY, f64::NEG_INFINITY, 0.0_f64, 0.0_f64);
        for [_, depth] in &depths {
            let depth = kept(*depth);
            (low, high) = (low.min(depth), high.max(depth));
            (rise, fall) = (rise.max(depth - low), fall.max(high - depth));
        }
        if rise.min(fall) < tuned.swing_height_min {
            return None;
        }
        let [newest, depth_now] = depths[depths.len() - 1];
        let before = depths.iter().rev().find(|[time, _]| tuned.swing_rate_time <= newest - time)?;
        // A period is twice the height at the mean rate, with rests.
        let steps = depths.windows(2);
        let gone: f64 = steps.map(|pair| (kept(pair[1][1]) - kept(pair[0][1])).abs()).sum();
        let height = most - least;
        let frequency = PI * gone / ((newest - depths[0][0]) * height);
        let mean = depths.iter().map(|[_, depth]| kept(*depth)).sum::<f64>() / depths.len() as f64;
        let rate = (kept(depth_now) - kept(before[1])) / (newest - before[0]);
        Some(Self {
            least,
            most,
            mean,
            below: kept(depth_now) - mean,
            age: (now - newest).max(0.0),
            ahead: (rate / frequency).clamp(-0.5 * height, 0.5 * height),
            frequency,
        })
    }

    /// Expected depth `ahead` seconds from now, m.
    fn at(&self, ahead: f64) -> f64 {
        let phase = self.frequency * (self.age + ahead);
        let swung = self.below * phase.cos() + self.ahead * phase.sin();
        (self.mean + swung * (-phase / (2.0 * PI)).exp()).clamp(self.least, self.most)
    }
}

/// Depth forecast of an AUV.
#[derive(Clone, Copy, Debug)]
pub(crate) struct DepthAhead<'a> {
    forecast: &'a AuvForecast,
    swing: Option<Swing>,
}

impl DepthAhead<'_> {
    /// Expected depth `ahead` seconds from now, m.
    pub(crate) fn at(&self, ahead: f64) -> f64 {
        let forecast = || self.forecast.depth_at(ahead).max(0.0);
        self.swing.map_or_else(forecast, |swing| swing.at(ahead))
    }

    /// Least depth, m, at `times` from now, s.
    pub(crate) fn shallowest(&self, times: impl Iterator<Item = f64>) -> f64 {
        match self.swing {
            Some(swing) => swing.least,
            None => times.map(|time| self.at(time)).fold(f64::INFINITY, f64::min),
        }
    }
}

/// The depths of all AUVs by the `forecasts`, or by an oscillation of undeclared reported depths.
pub(crate) fn depths_ahead<'a>(snapshot: &Snapshot, forecasts: &'a [AuvForecast]) -> Vec<DepthAhead<'a>> {
    let depth = |(auv, forecast): (&Auv, &'a AuvForecast)| {
        let undeclared = auv.dive.is_none() && forecast.holds_depth();
        let reports = auv.reports.as_deref().filter(|_| undeclared);
        DepthAhead {
            forecast,
            swing: reports.and_then(|reports| Swing::seen(reports, snapshot.t_s, &snapshot.tuned().visit)),
        }
    };
    snapshot.auvs.iter().zip(forecasts).map(depth).collect()
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector2;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::*;

    const TUNED: &VisitNumbers = &VisitNumbers::DEFAULT;

    /// Depth of a glider that dives to `deepest`, m, at `rate`, m/s, rises, and rests `rest`, s.
    fn glider(time: f64, deepest: f64, rate: f64, rest: f64) -> f64 {
        let down = deepest / rate;
        let phase = time.rem_euclid(2.0 * down + rest);
        (rate * phase.min(2.0 * down - phase)).max(0.0)
    }

    fn reports(depth: impl Fn(f64) -> f64, now: f64, n: u32) -> Vec<Report> {
        let report = |k: u32| {
            let t_s = now - 5.0 - 12.0 * f64::from(k);
            Report { depth_m: Some(depth(t_s)), ..Report::new(t_s, Vector2::zeros(), 1.5) }
        };
        (0..n).map(report).collect()
    }

    #[test]
    fn the_depth_of_a_glider_is_forecast_better_than_a_constant() {
        let mut rng = ChaCha8Rng::seed_from_u64(35);
        // Square errors of the oscillation and of a constant depth, by time ahead.
        let aheads = [30.0, 60.0, 120.0, 240.0, 600.0, 1500.0];
        let (mut errors, mut n_seen) = ([[0.0; 2]; 6], 0);
        for _ in 0..400 {
            let (deepest, rate) = (rng.random_range(20.0..60.0), rng.random_range(0.08..0.25));
            let (rest, now) = (rng.random_range(0.0..200.0), rng.random_range(0.0..2000.0));
            let depth = |time: f64| glider(time, deepest, rate, rest);
            // 64 reports are half a period of the slowest.
            let Some(swing) = Swing::seen(&reports(depth, now, 64), now, TUNED) else {
                continue;
            };
            n_seen += 1;
            for (ahead, errors) in aheads.iter().zip(&mut errors) {
                let then = depth(now + ahead);
                errors[0] += (swing.at(*ahead) - then).powi(2);
                errors[1] += (depth(now) - then).powi(2);
            }
        }
        assert!(300 < n_seen, "{n_seen} of 400 swing");
        let ratios = errors.map(|[swing, held]: [f64; 2]| (swing / held).sqrt());
        assert!(ratios.iter().all(|ratio| *ratio < 0.85), "{ratios:?} at {aheads:?}");
    }

    #[test]
    fn a_monotonic_depth_does_not_oscillate() {
        let deep = |time: f64| glider(time, 30.0, 0.15, 60.0);
        let level = |time: f64| 20.0 + 1.5 * (0.3 * time).sin();
        let launched = |time: f64| (0.5 * (time - 180.0)).clamp(0.0, 60.0);
        let dropout = |time: f64| if (500.0..510.0).contains(&time) { 0.0 } else { 60.0 };
        let depths: [&dyn Fn(f64) -> f64; 4] = [&deep, &level, &launched, &dropout];
        let seen = depths.map(|depth| Swing::seen(&reports(depth, 900.0, 64), 900.0, TUNED).is_some());
        assert_eq!(seen, [true, false, false, false]);
        for n in [0, 5] {
            assert!(Swing::seen(&reports(deep, 900.0, n), 900.0, TUNED).is_none());
        }
        let mut unknown = reports(deep, 900.0, 64);
        for report in &mut unknown {
            report.depth_m = None;
        }
        assert!(Swing::seen(&unknown, 900.0, TUNED).is_none());
    }

    #[test]
    fn a_forecast_oscillation_stays_within_reported_depths() {
        let mut rng = ChaCha8Rng::seed_from_u64(36);
        let mut n_seen = 0;
        for _ in 0..300 {
            let (step, n) = (rng.random_range(0.0..30.0), rng.random_range(6..64));
            let mut reports = reports(|_| 0.0, 900.0, n);
            let (mut least, mut most) = (f64::MAX, 0.0_f64);
            for report in &mut reports {
                let deeper = rng.random_bool(0.3);
                let depth = 40.0 + rng.random_range(-0.5..0.5) + if deeper { step } else { 0.0 };
                (least, most) = (least.min(depth), most.max(depth));
                report.depth_m = Some(depth);
                report.t_s += rng.random_range(-12.0..12.0);
            }
            if let Some(swing) = Swing::seen(&reports, 900.0, TUNED) {
                n_seen += 1;
                let mut depths = (0..400).map(|k| swing.at(10.0 * f64::from(k)));
                assert!(depths.all(|depth| (least..=most).contains(&depth)));
            }
        }
        assert!(100 < n_seen, "{n_seen} swing");
    }
}
