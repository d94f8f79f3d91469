//! Interacting multiple models: straight motion and manoeuvre.

use nalgebra::{Matrix4, Vector2, Vector4};

use crate::{
    estimate::{
        kalman::{Kalman, Measurement},
        motion_model::MotionModel,
        track::{Filter, Innovation, Track},
    },
    facts::evidence::Report,
    tuned::EstimateNumbers,
};

/// Number of motion models: straight, manoeuvre.
const N_MODELS: usize = 2;

const MANOEUVRE: usize = 1;

/// Least probability of a model, so that no measurement excludes it for good.
const PROBABILITY_MIN: f64 = 1.0e-9;

/// A Kalman filter and a probability for each motion model.
///
/// ```text
/// π_ij(t)                       straight → manoeuvre at rate s/ℓ_s, back at s/ℓ_m, by distance
/// μ⁻_j = Σ_i π_ij μ_i           mixed mean and covariance of model j: weights π_ij μ_i / μ⁻_j
/// μ_j ∝ μ⁻_j N(z − H x_j; 0, H P_j Hᵀ + R)
/// ```
/// The speed s is the root mean square of the velocity, or the telemetered one if that is larger
/// and the acceleration is possible.
/// Source: H. A. P. Blom, Y. Bar-Shalom, "The interacting multiple model algorithm for systems with
/// Markovian switching coefficients", 1988, doi:10.1109/9.1299.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Interacting<'a> {
    tuned: &'a EstimateNumbers,
    models: [Kalman; N_MODELS],
    probabilities: [f64; N_MODELS],
    /// Telemetered rate of turn at the last report, rad/s.
    turn_rate: Option<f64>,
}

impl<'a> Interacting<'a> {
    /// The track through `reports`, at least one, in order of time.
    pub(crate) fn track(reports: &[(usize, Report)], tuned: &'a EstimateNumbers) -> Track<Self> {
        Track::through(reports, |report| Self::of_one(Kalman::start(report, tuned), report, tuned))
    }

    fn of_one(filter: Kalman, report: &Report, tuned: &'a EstimateNumbers) -> Self {
        let (straight, manoeuvre) = (tuned.straight_length, tuned.manoeuvre_length);
        let length = straight + manoeuvre;
        Self {
            tuned,
            models: [filter.clone(), filter],
            probabilities: [straight / length, manoeuvre / length],
            turn_rate: report.turn_rate_radps,
        }
    }

    /// Mean and covariance over all models.
    pub(crate) fn combined(&self) -> Kalman {
        mixture(&self.models, &self.probabilities)
    }

    fn predicted(&self, report: &Report) -> Self {
        let t = report.t_s - self.models[0].time;
        let speed = self.speed(report);
        let (begin, end) = (speed / self.tuned.straight_length, speed / self.tuned.manoeuvre_length);
        let settled = -(-(begin + end) * t).exp_m1() / (begin + end);
        let (begun, ended) = (settled * begin, settled * end);
        let transition = [[1.0 - begun, begun], [ended, 1.0 - ended]];
        let turn_rate = match (self.turn_rate, report.turn_rate_radps) {
            // The mean rate in between is nearer to this mean than to either rate.
            (Some(before), Some(now)) => 0.5 * (before + now),
            (None, _) | (_, None) => 0.0,
        };
        let motions =
            [MotionModel::straight(speed, self.tuned), MotionModel::manoeuvre(speed, turn_rate, self.tuned)];
        let joint = |j: usize| -> [f64; N_MODELS] {
            std::array::from_fn(|i| self.probabilities[i] * transition[i][j])
        };
        let probabilities = std::array::from_fn(|j| joint(j).iter().sum());
        let models = std::array::from_fn(|j| {
            let shares = joint(j).map(|share| share / probabilities[j]);
            mixture(&self.models, &shares).after(report.t_s, &motions[j])
        });
        Self { tuned: self.tuned, models, probabilities, turn_rate: report.turn_rate_radps }
    }

    /// Speed of a manoeuvre until `report`, m/s.
    fn speed(&self, report: &Report) -> f64 {
        let t = report.t_s - self.models[0].time;
        let known = self.combined().mean_square_speed().sqrt();
        let reported = report.ground_track().map_or(0.0, |track| track.speed);
        reported.min(known + self.tuned.acceleration_max * t).max(known).max(self.tuned.manoeuvre_speed_min)
    }

    /// `true` if a measurement is inside a model's gate; the manoeuvre's includes turns.
    fn is_in_gate(&self, measurement: &Measurement) -> bool {
        let inside = |model: &Kalman| measurement.normalised_square(model) <= self.tuned.gate;
        self.models.iter().any(inside)
    }

    fn innovation(&self, position: &Measurement) -> Innovation {
        let densities = self.models.iter().zip(&self.probabilities);
        let density: f64 =
            densities.map(|(model, probability)| probability * model.log_likelihood(position).exp()).sum();
        Innovation {
            accepted: self.is_in_gate(position),
            normalised: position.normalised_square(&self.combined()),
            density: density / std::f64::consts::TAU,
            square: position.square_distance(&self.combined()),
            variance: self.models[MANOEUVRE].innovation_variance(position),
        }
    }

    fn update(&mut self, measurement: &Measurement) {
        let logs: [f64; N_MODELS] = std::array::from_fn(|i| self.models[i].log_likelihood(measurement));
        let best = logs.into_iter().fold(f64::NEG_INFINITY, f64::max);
        for (i, model) in self.models.iter_mut().enumerate() {
            model.update(measurement);
            self.probabilities[i] = (self.probabilities[i] * (logs[i] - best).exp()).max(PROBABILITY_MIN);
        }
        let sum: f64 = self.probabilities.iter().sum();
        self.probabilities = self.probabilities.map(|probability| probability / sum);
    }

    /// Updates with the telemetered velocity, if it is inside the gate.
    ///
    /// The velocity comes first, as it predicts the position. In the other order, an outlier after
    /// a long gap would resemble a fast vehicle, and its telemetered speed a mistake.
    fn take_velocity(&mut self, report: &Report) {
        let track = report.ground_track();
        let velocity = track.map(|track| Measurement::of_velocity(&track, self.tuned));
        if let Some(velocity) = velocity.filter(|velocity| self.is_in_gate(velocity)) {
            self.update(&velocity);
        }
    }
}

impl Filter for Interacting<'_> {
    fn tuned(&self) -> &EstimateNumbers {
        self.tuned
    }

    fn accept(&mut self, report: &Report) -> Innovation {
        let mut then = self.predicted(report);
        then.take_velocity(report);
        let position = Measurement::of_position(report);
        let innovation = then.innovation(&position);
        if innovation.accepted {
            then.update(&position);
            *self = then;
        }
        innovation
    }

    /// Keeps the velocity of the manoeuvre model.
    fn found_at(&self, report: &Report) -> Self {
        let there = self.predicted(report).models[MANOEUVRE].found_at(&report.position(), report.sigma_m);
        let mut found = Self::of_one(there, report, self.tuned);
        found.take_velocity(report);
        found
    }
}

/// The Gaussian with the mean and covariance of a mixture, whose weights sum to 1.
fn mixture(models: &[Kalman; N_MODELS], weights: &[f64; N_MODELS]) -> Kalman {
    let weighted = || models.iter().zip(weights);
    let first = models[0].mean;
    // Relative to the first, so that the mean of equals is exact.
    let mean: Vector4<f64> =
        first + weighted().map(|(model, weight)| (model.mean - first) * *weight).sum::<Vector4<f64>>();
    let covariance: Matrix4<f64> = weighted()
        .map(|(model, weight)| {
            let off = model.mean - mean;
            (model.covariance + off * off.transpose()) * *weight
        })
        .sum();
    let velocity = Vector2::new(mean.z, mean.w);
    Kalman::new(models[0].time, &mean.xy(), &velocity, &covariance)
}
