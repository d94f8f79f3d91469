//! The cost of company with AUVs: distances in a quarter of an hour, on the way to their middle.

use nalgebra::Vector2;

use crate::facts::options::ForecastModel;
use crate::predict::forecast::AuvForecast;
use crate::predict::smallest_circle::{Below, nearest_to_all};

/// Instants at which distances are looked at, and the time between them, s.
const INSTANTS: usize = 30;
const STEP: f64 = 30.0;

/// The craft and the AUVs.
pub(super) struct Company {
    /// Position, m, and speed over ground, m/s, of each craft.
    pub(super) craft: Vec<(Vector2<f64>, f64)>,
    /// Weight of each AUV; they sum to 1.
    weights: Vec<f64>,
    /// Where each AUV is from now on.
    tracks: Vec<Vec<Below>>,
    /// `true` if the largest distance counts, m; otherwise the mean squared one, m².
    is_largest: bool,
}

impl Company {
    /// With AUVs, each with its weight, which are foreseen to keep their courses for so long, s.
    pub(super) fn new(
        craft: Vec<(Vector2<f64>, f64)>,
        (auvs, straight): (&[(&AuvForecast, f64)], f64),
        is_largest: bool,
    ) -> Self {
        let sum: f64 = auvs.iter().map(|(_, weight)| weight).sum();
        let track = |forecast: &AuvForecast| {
            let here = forecast.at(0.0).position;
            let has_path = forecast.likeliest().model == ForecastModel::Path;
            let at = |time: f64| {
                let ahead = forecast.at(time).position - here;
                let share = straight / time * -(-time / straight).exp_m1();
                if has_path || time <= 0.0 { here + ahead } else { here + ahead * share }
            };
            (0..INSTANTS).map(|i| Below { position: at(STEP * i as f64), depth: 0.0 }).collect()
        };
        Self {
            craft,
            weights: auvs.iter().map(|(_, weight)| weight / sum).collect(),
            tracks: auvs.iter().map(|(forecast, _)| track(forecast)).collect(),
            is_largest,
        }
    }

    pub(super) fn cost(&self, craft: usize, set: u32) -> f64 {
        let counts = |auv: &usize| set & (1 << auv) != 0 && 0.0 < self.weights[*auv];
        let auvs: Vec<usize> = (0..self.tracks.len()).filter(counts).collect();
        if auvs.is_empty() {
            return 0.0;
        }
        let weight: f64 = auvs.iter().map(|auv| self.weights[*auv]).sum();
        let (mut at, speed) = self.craft[craft];
        let mut sum = 0.0;
        for i in 0..INSTANTS {
            let there: Vec<Below> = auvs.iter().map(|auv| self.tracks[*auv][i]).collect();
            let weighted = || auvs.iter().zip(&there).map(|(auv, at)| at.position * self.weights[*auv]);
            let middle = if self.is_largest {
                nearest_to_all(&there).position
            } else {
                weighted().sum::<Vector2<f64>>() / weight
            };
            if 0 < i {
                let way = middle - at;
                at += way * (speed * STEP / way.norm().max(f64::MIN_POSITIVE)).min(1.0);
            }
            let distances = there.iter().map(|there| (there.position - at).norm());
            sum += if self.is_largest {
                distances.fold(0.0, f64::max)
            } else {
                auvs.iter().zip(distances).map(|(auv, distance)| self.weights[*auv] * distance.powi(2)).sum()
            };
        }
        sum / INSTANTS as f64
    }
}
