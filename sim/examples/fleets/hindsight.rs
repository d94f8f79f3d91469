//! The best visits that are found with the true future: the order in which each craft goes to the
//! AUVs, by simulated annealing. Craft turn at once and have full speed at once, so that no real
//! craft does as well.

use nalgebra::Vector2;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::{SPEED, WITHIN};

/// Changes that are tried, and the temperatures, s, between which it cools.
const TRIED: usize = 400_000;
const HOT: f64 = 20.0;
const COLD: f64 = 0.05;

/// A visit: an AUV, by index, and how long the craft stays with it, s.
type Visit = (usize, usize);

/// Where each AUV is each second, m, and where each craft begins.
pub(crate) struct Hindsight {
    pub(crate) tracks: Vec<Vec<Vector2<f64>>>,
    pub(crate) craft: Vec<Vector2<f64>>,
}

impl Hindsight {
    /// The least mean age of visits, s.
    pub(crate) fn mean_age(&self, seed: u64) -> f64 {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let n = self.tracks.len();
        let seconds = self.tracks[0].len();
        let mut orders: Vec<Vec<Visit>> =
            (0..self.craft.len()).map(|k| (0..seconds / 60).map(|i| ((i + k) % n, 0)).collect()).collect();
        let mut age = self.age(&orders);
        let mut best = age;
        for i in 0..TRIED {
            let temperature = HOT * (COLD / HOT).powf(i as f64 / TRIED as f64);
            let mut changed = orders.clone();
            let craft = rng.random_range(0..changed.len());
            // The last visits are beyond the end.
            let at = rng.random_range(0..changed[craft].len());
            match rng.random_range(0..5) {
                0 => changed[craft][at].0 = rng.random_range(0..n),
                1 => changed[craft].insert(at, (rng.random_range(0..n), 0)),
                2 if changed[craft].len() > 1 => drop(changed[craft].remove(at)),
                3 => changed[craft][at].1 = rng.random_range(0..60),
                _ => {
                    let other = rng.random_range(0..changed[craft].len());
                    changed[craft].swap(at, other);
                }
            }
            let now = self.age(&changed);
            if now <= age || rng.random::<f64>() < ((age - now) / temperature).exp() {
                (orders, age) = (changed, now);
                best = best.min(age);
            }
        }
        best
    }

    /// The mean age of these visits, s.
    fn age(&self, orders: &[Vec<Visit>]) -> f64 {
        let seconds = self.tracks[0].len();
        let mut served: Vec<Vec<[usize; 2]>> = vec![vec![]; self.tracks.len()];
        for (order, start) in orders.iter().zip(&self.craft) {
            let (mut at, mut now) = (*start, 0);
            for (auv, stay) in order {
                let track = &self.tracks[*auv];
                let reaches = |t: &usize| (track[*t] - at).norm() <= SPEED * (t - now) as f64 + WITHIN;
                let Some(arrived) = (now..seconds).find(reaches) else { break };
                let leaves = (arrived + stay).min(seconds - 1);
                served[*auv].push([arrived, leaves]);
                // It keeps so far from the AUV as it may.
                let way = track[arrived] - at;
                let left = (way.norm() - WITHIN).max(0.0) / way.norm().max(f64::MIN_POSITIVE);
                at += way * left + track[leaves] - track[arrived];
                now = leaves;
            }
        }
        let ages = served.iter_mut().map(|visits| {
            visits.sort_unstable();
            let (mut since, mut sum) = (0, 0.0);
            for [arrived, leaves] in visits.iter().copied().chain([[seconds, seconds]]) {
                let age = arrived.saturating_sub(since) as f64;
                sum += 0.5 * age * age;
                since = since.max(leaves);
            }
            sum / seconds as f64
        });
        ages.sum::<f64>() / self.tracks.len() as f64
    }
}
