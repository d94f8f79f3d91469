//! How deep an AUV will be that goes up and down in its own way, when no dive is declared or found.

use std::f64::consts::PI;

use crate::{
    facts::evidence::Report,
    predict::forecast::{AuvForecast, BETWEEN_MIN},
    snapshot::build::Snapshot,
};

/// Least difference of the reported depths that counts, m. Assumption: swell and gauges make less.
const HEIGHT_MIN: f64 = 4.0;

/// Fewest reported depths.
const DEPTHS_MIN: usize = 5;

/// A depth that swings about its mean, known less and less: its expectation is a damped oscillation.
#[derive(Clone, Copy, Debug)]
struct Swing {
    /// Of the depths reported, m.
    mean: f64,
    /// How far the newest one is below that, m, at this age, s; and how fast it grows, m/s.
    below: f64,
    age: f64,
    rate: f64,
    /// rad/s.
    frequency: f64,
}

impl Swing {
    /// By what the `reports` say until `now`, s.
    fn seen(reports: &[Report], now: f64) -> Option<Self> {
        let depth = |report: &Report| Some([report.t_s, report.depth_m?]);
        let mut depths: Vec<[f64; 2]> = reports.iter().filter_map(depth).collect();
        depths.sort_by(|a, b| a[0].total_cmp(&b[0]));
        depths.dedup_by(|later, earlier| later[0] - earlier[0] < BETWEEN_MIN);
        let [.., before, newest] = depths[..] else {
            return None;
        };
        let (least, most) = depths
            .iter()
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(least, most), [_, depth]| {
                (least.min(*depth), most.max(*depth))
            });
        let height = most - least;
        if depths.len() < DEPTHS_MIN || height < HEIGHT_MIN {
            return None;
        }
        // Up and down once takes as long as twice the height at the mean rate, rests included.
        let gone: f64 = depths
            .windows(2)
            .map(|pair| (pair[1][1] - pair[0][1]).abs())
            .sum();
        let mean_rate = gone / (newest[0] - depths[0][0]);
        let mean = 0.5 * (least + most);
        Some(Self {
            mean,
            below: newest[1] - mean,
            age: (now - newest[0]).max(0.0),
            rate: (newest[1] - before[1]) / (newest[0] - before[0]),
            frequency: PI * mean_rate / height,
        })
    }

    /// Expected depth `ahead` seconds from now, m. A swing is forgotten over one period.
    fn at(&self, ahead: f64) -> f64 {
        let elapsed = self.age + ahead;
        let phase = self.frequency * elapsed;
        let swung = self.below * phase.cos() + self.rate / self.frequency * phase.sin();
        (self.mean + swung * (-phase / (2.0 * PI)).exp()).max(0.0)
    }
}

/// Expected depth of the AUV at the place `auv` of the snapshot, m, as a function of the time from now, s: that of its `forecast`, or of
/// the swing of its reported depths where the forecast is of one depth, until `horizon`, s.
pub(crate) fn depth_ahead<'a>(
    snapshot: &Snapshot,
    auv: usize,
    forecast: &'a AuvForecast,
    horizon: f64,
) -> impl Fn(f64) -> f64 + 'a {
    let now = forecast.depth_at(0.0);
    #[expect(clippy::float_cmp, reason = "a depth that is held is the same number")]
    let held = (1..=4).all(|k| forecast.depth_at(0.25 * horizon * f64::from(k)) == now);
    let reports = snapshot.auvs[auv].reports.as_deref().unwrap_or_default();
    let swing = if held {
        Swing::seen(reports, snapshot.t_s)
    } else {
        None
    };
    move |ahead| swing.map_or_else(|| forecast.depth_at(ahead).max(0.0), |swing| swing.at(ahead))
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector2;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::*;

    /// Depth of a glider that goes down to `deepest`, m, and up again at `rate`, m/s, and then rests at the surface for `rest`, s.
    fn glider(time: f64, deepest: f64, rate: f64, rest: f64) -> f64 {
        let down = deepest / rate;
        let phase = time.rem_euclid(2.0 * down + rest);
        (rate * phase.min(2.0 * down - phase)).max(0.0)
    }

    fn reports(depth: impl Fn(f64) -> f64, now: f64, n: u32) -> Vec<Report> {
        let report = |k: u32| {
            let t_s = now - 5.0 - 12.0 * f64::from(k);
            Report {
                depth_m: Some(depth(t_s)),
                ..Report::new(t_s, Vector2::zeros(), 1.5)
            }
        };
        (0..n).map(report).collect()
    }

    #[test]
    fn the_depth_of_a_glider_is_expected_better_than_if_it_stayed_there() {
        let mut rng = ChaCha8Rng::seed_from_u64(35);
        // Mean square errors of the swing and of the depth now, by the time ahead.
        let aheads = [30.0, 60.0, 120.0, 240.0, 600.0, 1500.0];
        let mut errors = [[0.0; 2]; 6];
        for _ in 0..400 {
            let (deepest, rate) = (rng.random_range(20.0..60.0), rng.random_range(0.08..0.25));
            let (rest, now) = (rng.random_range(0.0..200.0), rng.random_range(0.0..2000.0));
            let depth = |time: f64| glider(time, deepest, rate, rest);
            let swing = Swing::seen(&reports(depth, now, 64), now).expect("swings");
            for (ahead, errors) in aheads.iter().zip(&mut errors) {
                let then = depth(now + ahead);
                errors[0] += (swing.at(*ahead) - then).powi(2);
                errors[1] += (depth(now) - then).powi(2);
            }
        }
        for (ahead, [swing, held]) in aheads.iter().zip(errors) {
            let ratio = (swing / held).sqrt();
            assert!(ratio < 0.85, "{ahead} s ahead: {ratio}");
        }
    }

    #[test]
    fn a_depth_that_hardly_changes_or_is_hardly_known_does_not_swing() {
        let level = |time: f64| 20.0 + 1.5 * (0.3 * time).sin();
        assert!(Swing::seen(&reports(level, 900.0, 64), 900.0).is_none());
        let deep = |time: f64| glider(time, 30.0, 0.15, 60.0);
        assert!(Swing::seen(&reports(deep, 900.0, 4), 900.0).is_none());
        assert!(Swing::seen(&[], 0.0).is_none());
        let mut unknown = reports(deep, 900.0, 64);
        for report in &mut unknown {
            report.depth_m = None;
        }
        assert!(Swing::seen(&unknown, 900.0).is_none());
    }
}
