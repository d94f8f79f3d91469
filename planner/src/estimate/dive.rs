//! Sawtooth dives, from reported depths.

use std::ops::RangeInclusive;

use crate::{
    facts::{auv::Dive, evidence::Report},
    tuned::EstimateNumbers,
};

/// Fewest reversals: the vehicle has repeated itself.
const APEXES_MIN: usize = 3;

/// Pitch of a sawtooth, rad.
const PITCH: RangeInclusive<f64> = 0.05..=1.4;

/// A leg up or down, as a straight line through the depths between its ends.
#[derive(Clone, Copy)]
struct DepthLeg {
    /// Mean time, s, and mean depth, m.
    middle: [f64; 2],
    rate: f64,
    bent: f64,
}

/// Intersection of two legs.
struct Apex {
    time: f64,
    depth: f64,
    is_lowest: bool,
}

impl DepthLeg {
    /// Least squares; `None` for fewer than two depths.
    fn through(depths: &[[f64; 2]]) -> Option<Self> {
        let sum = |of: &dyn Fn(&[f64; 2]) -> f64| depths.iter().map(of).sum::<f64>();
        let n = sum(&|_| 1.0);
        let middle = [0, 1].map(|k| sum(&|point| point[k]) / n);
        let spread = sum(&|[t, _]| (t - middle[0]).powi(2));
        let rate = sum(&|[t, z]| (t - middle[0]) * (z - middle[1])) / spread;
        let off = sum(&|[t, z]| (z - middle[1] - rate * (t - middle[0])).powi(2));
        (depths.len() > 1 && rate.is_finite()).then(|| Self { middle, rate, bent: (off / n).sqrt() })
    }

    fn meets(&self, next: &Self) -> Apex {
        let [(t1, z1), (t2, z2)] = [self, next].map(|leg| leg.middle.into());
        let time = (z2 - z1 + self.rate * t1 - next.rate * t2) / (self.rate - next.rate);
        Apex { time, depth: z1 + self.rate * (time - t1), is_lowest: 0.0 < self.rate }
    }
}

/// The sawtooth of a vehicle with horizontal speed `u_h`, m/s, if its depths' reversals repeat.
pub(crate) fn sawtooth(reports: &[(usize, Report)], u_h: f64, tuned: &EstimateNumbers) -> Option<Dive> {
    let depth = |(_, report): &(usize, Report)| Some([report.t_s, report.depth_m?]);
    let mut depths: Vec<_> = reports.iter().filter_map(depth).collect();
    depths.dedup_by_key(|[time, _]| *time);
    let [last, _] = *depths.last()?;
    let (least, most) = depths
        .iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(least, most), [_, z]| (least.min(*z), most.max(*z)));
    let height = most - least;
    if height < tuned.sawtooth_height_min {
        return None;
    }
    let ends = ends(&depths, tuned.swing * height);
    // Reversal points are on neither leg.
    let legs = ends.windows(2).map(|end| DepthLeg::through(&depths[end[0] + 1..end[1]]));
    let legs: Vec<_> = legs.collect();
    let whole = legs.get(1..legs.len() - 1)?;
    let rates = whole.iter().flatten().map(|leg| leg.rate.abs());
    let rate = rates.sum::<f64>() / whole.len() as f64;
    let is_like_others = |leg: &DepthLeg| {
        (leg.rate.abs() - rate).abs() <= tuned.spread_max * rate && leg.bent <= tuned.bent_max * height
    };
    let like_others: Vec<_> = legs.into_iter().map(|leg| leg.filter(is_like_others)).collect();
    // The oldest leg may be nearly over, and the newest may have just begun.
    let legs: Vec<_> = match &like_others[..] {
        [first, whole @ .., last] => {
            let whole = whole.iter().copied().collect::<Option<Vec<_>>>()?;
            first.iter().copied().chain(whole).chain(*last).collect()
        }
        _ => return None,
    };
    // Legs of equal sign may be parallel and intersect nowhere.
    if legs.windows(2).any(|pair| 0.0 <= pair[0].rate * pair[1].rate) {
        return None;
    }
    let apexes: Vec<_> = legs.windows(2).map(|pair| pair[0].meets(&pair[1])).collect();
    let newest = apexes.last().filter(|_| APEXES_MIN <= apexes.len())?;
    let [shallow, deep] = [false, true].map(|is_lowest| {
        let depths = apexes.iter().filter(|apex| apex.is_lowest == is_lowest).map(|apex| apex.depth);
        let (n, sum, least, most) = depths.fold(
            (0.0, 0.0, f64::INFINITY, f64::NEG_INFINITY),
            |(n, sum, least, most): (f64, f64, f64, f64), z| (n + 1.0, sum + z, least.min(z), most.max(z)),
        );
        (sum / n, most - least)
    });
    let height = deep.0 - shallow.0;
    let pitch_rad = rate.atan2(u_h);
    // Half of the reversal is beyond the depth that ends the leg.
    let turn = 0.5 * rate * Dive::REVERSAL_MEDUSA;
    let legs_since = (rate * (last - newest.time) / height).floor();
    (shallow.1.max(deep.1) <= tuned.spread_max * height && PITCH.contains(&pitch_rad) && 2.0 * turn < height)
        .then(|| Dive {
            depth_min_m: (shallow.0 + turn).max(0.0),
            depth_max_m: deep.0 - turn,
            pitch_rad,
            reversal_s: None,
            descending: Some(newest.is_lowest == (legs_since.rem_euclid(2.0) == 1.0)),
        })
}

/// Indices where the depths reverse by more than `swing`, m, with the first, and one past the last.
fn ends(depths: &[[f64; 2]], swing: f64) -> Vec<usize> {
    let (mut ends, mut extreme, mut sense) = (vec![0], 0, 0.0);
    for (k, [_, z]) in depths.iter().enumerate() {
        let beyond = z - depths[extreme][1];
        if sense == 0.0 {
            if swing < beyond.abs() {
                (extreme, sense) = (k, beyond.signum());
            }
        } else if 0.0 <= sense * beyond {
            extreme = k;
        } else if swing < -sense * beyond {
            ends.push(extreme);
            (extreme, sense) = (k, -sense);
        }
    }
    ends.push(depths.len());
    ends
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector2;

    use super::*;
    use crate::{estimate::tests::Random, predict::dive::DepthForecast};

    fn sawtooth(reports: &[(usize, Report)], u_h: f64) -> Option<Dive> {
        super::sawtooth(reports, u_h, &EstimateNumbers::DEFAULT)
    }

    fn report(t_s: f64, depth: f64) -> (usize, Report) {
        let depth_m = Some(depth);
        let fix = Report::new(t_s, Vector2::zeros(), 1.0);
        (0, Report { depth_m, ..fix })
    }

    /// Reports of `depth` over 640 s, every ten seconds, three in ten lost, with a gauge of 0.1 m.
    fn reports(depth: impl Fn(f64) -> f64, random: &mut Random) -> Vec<(usize, Report)> {
        let heard = |k: u32| {
            let t_s = 10.0 * f64::from(k);
            let depth = depth(t_s) + 0.1 * random.normal().x;
            (0.3 < random.uniform()).then(|| report(t_s, depth))
        };
        (0..64).filter_map(heard).collect()
    }

    #[test]
    fn a_sawtooth_is_found_and_forecasts_the_depth() {
        let (mut found, mut held, mut n) = (0.0, 0.0, 0);
        for (seed, (height, pitch)) in
            (0..100_u32).zip([(20.0, 0.6), (40.0, 0.9), (15.0, 0.4)].into_iter().cycle())
        {
            let mut random = Random(seed.into());
            let dive = Dive {
                depth_min_m: 2.0,
                depth_max_m: 2.0 + height,
                pitch_rad: pitch,
                reversal_s: None,
                descending: Some(true),
            };
            let start = 2.0 + height * random.uniform();
            let truth = DepthForecast::at_speed(start, Some(dive), 0.3);
            let reports = reports(|t| truth.at(t), &mut random);
            let Some(seen) = sawtooth(&reports, 0.3) else {
                continue;
            };
            n += 1;
            let (_, newest) = reports.last().expect("most are heard");
            let depth = newest.depth_m.expect("all have one");
            let forecast = DepthForecast::at_speed(depth, Some(seen), 0.3);
            for ahead in [20.0, 60.0, 100.0] {
                let then = truth.at(newest.t_s + ahead);
                found += (forecast.at(ahead) - then).powi(2);
                held += (depth - then).powi(2);
            }
        }
        assert!(90 <= n && found < 0.2_f64.powi(2) * held, "{n}, {found} m², {held} m²");
    }

    #[test]
    fn any_depths_give_a_sawtooth_with_possible_depths() {
        // Few different depths, so that legs often have the same rate.
        for seed in 0..20_000 {
            let mut random = Random(seed);
            let report = |k: u32| report(10.0 * f64::from(k), (6.0 * random.uniform()).floor() * 3.0);
            let reports: Vec<_> = (0..24).map(report).collect();
            if let Some(dive) = sawtooth(&reports, 0.3) {
                let (least, most) = (dive.depth_min_m, dive.depth_max_m);
                assert!(0.0 <= least && least < most && most < 40.0, "{seed}");
            }
        }
    }

    #[test]
    fn depths_over_rough_ground_are_no_sawtooth() {
        let is_found = |seed: &u64| {
            let mut random = Random(*seed);
            let waves: Vec<_> = (0..6).map(|_| (random.normal(), random.uniform())).collect();
            let depth = |t: f64| {
                let wave =
                    |(a, f): &(Vector2<f64>, f64)| a.x * (0.03 * f * t).sin() + a.y * (0.03 * f * t).cos();
                30.0 + 4.0 * waves.iter().map(wave).sum::<f64>()
            };
            sawtooth(&reports(depth, &mut random), 0.5).is_some()
        };
        let n = (0..200).filter(is_found).count();
        assert!(n <= 2, "{n}");
    }
}
