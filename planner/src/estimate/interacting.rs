//! Interacting multiple models: a vehicle that goes straight on, and the same vehicle in a manoeuvre.

use nalgebra::{Matrix4, Vector2, Vector4};

use crate::{
    estimate::{
        kalman::{Kalman, Measurement},
        motion_model::MotionModel,
        track::{Filter, Innovation},
    },
    facts::evidence::Report,
};

/// Number of motion models: straight, manoeuvre.
const N_MODELS: usize = 2;

const MANOEUVRE: usize = 1;

/// Usual distance that a vehicle goes straight before it manoeuvres, m. Assumption: lanes of a survey.
const STRAIGHT_LENGTH: f64 = 100.0;

/// Usual length of a manoeuvre, m: half a turn of 10 m radius.
const MANOEUVRE_LENGTH: f64 = 30.0;

/// Slowest speed at which a manoeuvre is reckoned with, m/s: half of the slowest cruise of the vehicles at hand. A
/// vehicle that waits may set off.
const MANOEUVRE_SPEED_MIN: f64 = 0.1;

/// Acceleration with which a vehicle may have come to a telemetered speed, m/s². Assumption: from rest to 1 m/s within
/// the ten seconds between two fixes.
const ACCELERATION_MAX: f64 = 0.1;

/// Least probability that a model keeps, so that no measurement can rule it out for good.
const PROBABILITY_MIN: f64 = 1.0e-9;

/// A Kalman filter for each motion model, and how probable each is.
///
/// ```text
/// π_ij(t)           straight → manoeuvre at rate s/ℓ_s, back at s/ℓ_m: distances, so that all speeds are alike
/// μ⁻_j = Σ_i π_ij μ_i                        mixed mean and covariance of model j: weights π_ij μ_i / μ⁻_j
/// μ_j ∝ μ⁻_j N(z − H x_j; 0, H P_j Hᵀ + R)
/// ```
/// The speed s that the models take is the root mean square of the velocity's, or the telemetered one where that is more and
/// the vehicle can have come to it.
/// Source: H. A. P. Blom, Y. Bar-Shalom, "The interacting multiple model algorithm for systems with Markovian switching
/// coefficients", 1988, doi:10.1109/9.1299.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Interacting {
    models: [Kalman; N_MODELS],
    probabilities: [f64; N_MODELS],
    /// Telemetered rate of turn at the last report, rad/s.
    turn_rate: Option<f64>,
}

impl Interacting {
    /// From a report alone.
    pub(crate) fn start(report: &Report) -> Self {
        Self::of_one(Kalman::start(report), report)
    }

    fn of_one(filter: Kalman, report: &Report) -> Self {
        let length = STRAIGHT_LENGTH + MANOEUVRE_LENGTH;
        Self {
            models: [filter.clone(), filter],
            probabilities: [STRAIGHT_LENGTH / length, MANOEUVRE_LENGTH / length],
            turn_rate: report.turn_rate_radps,
        }
    }

    /// Mean and covariance over all models.
    pub(crate) fn combined(&self) -> Kalman {
        mixture(&self.models, &self.probabilities)
    }

    /// The same at the time of a report, before what that measures.
    fn predicted(&self, report: &Report) -> Self {
        let t = report.t_s - self.models[0].time();
        let speed = self.speed(report);
        let (begin, end) = (speed / STRAIGHT_LENGTH, speed / MANOEUVRE_LENGTH);
        let settled = -(-(begin + end) * t).exp_m1() / (begin + end);
        let (begun, ended) = (settled * begin, settled * end);
        let transition = [[1.0 - begun, begun], [ended, 1.0 - ended]];
        let turn_rate = match (self.turn_rate, report.turn_rate_radps) {
            // What it turned by in between is nearer to the mean than to either.
            (Some(before), Some(now)) => 0.5 * (before + now),
            (None, _) | (_, None) => 0.0,
        };
        let motions = [
            MotionModel::straight(speed),
            MotionModel::manoeuvre(speed, turn_rate),
        ];
        let joint = |j: usize| -> [f64; N_MODELS] {
            std::array::from_fn(|i| self.probabilities[i] * transition[i][j])
        };
        let probabilities = std::array::from_fn(|j| joint(j).iter().sum());
        let models = std::array::from_fn(|j| {
            let shares = joint(j).map(|share| share / probabilities[j]);
            mixture(&self.models, &shares).after(report.t_s, &motions[j])
        });
        Self {
            models,
            probabilities,
            turn_rate: report.turn_rate_radps,
        }
    }

    /// Speed that a manoeuvre until `report` is reckoned with, m/s.
    fn speed(&self, report: &Report) -> f64 {
        let t = report.t_s - self.models[0].time();
        let known = self.combined().mean_square_speed().sqrt();
        let reported = report.ground_track().map_or(0.0, |track| track.speed);
        reported
            .min(known + ACCELERATION_MAX * t)
            .max(known)
            .max(MANOEUVRE_SPEED_MIN)
    }

    /// Whether a measurement is inside the gate of one model at least: the manoeuvre's, which is as wide as the vehicle
    /// may have turned.
    fn is_in_gate(&self, measurement: &Measurement) -> bool {
        self.models.iter().any(|model| model.is_in_gate(measurement))
    }

    /// How a position compares with the one expected.
    fn innovation(&self, position: &Measurement) -> Innovation {
        let densities = self.models.iter().zip(&self.probabilities);
        let density: f64 = densities
            .map(|(model, probability)| probability * model.log_likelihood(position).exp())
            .sum();
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

    /// Takes in what the vehicle says of its velocity, where that can be.
    ///
    /// The velocity comes before the position: it says where the vehicle went since the last report, and so what
    /// position to accept. The other way round, an outlier after a long gap would be taken for a fast vehicle, and
    /// what the vehicle then says of its speed for a mistake.
    fn take_velocity(&mut self, report: &Report) {
        let velocity = report.ground_track().as_ref().map(Measurement::of_velocity);
        if let Some(velocity) = velocity.filter(|velocity| self.is_in_gate(velocity)) {
            self.update(&velocity);
        }
    }
}

impl Filter for Interacting {
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

    /// With the velocity that a manoeuvre leaves.
    fn found_at(&self, report: &Report) -> Self {
        let there = self.predicted(report).models[MANOEUVRE].found_at(&report.position(), report.sigma_m);
        let mut found = Self::of_one(there, report);
        found.take_velocity(report);
        found
    }
}

/// The Gaussian of the same mean and covariance as a mixture, of weights that sum to 1.
fn mixture(models: &[Kalman; N_MODELS], weights: &[f64; N_MODELS]) -> Kalman {
    let weighted = || models.iter().zip(weights);
    let first = models[0].mean();
    // From the first, so that the mean of equals is theirs to the bit.
    let mean: Vector4<f64> = first
        + weighted()
            .map(|(model, weight)| (model.mean() - first) * *weight)
            .sum::<Vector4<f64>>();
    let covariance: Matrix4<f64> = weighted()
        .map(|(model, weight)| {
            let off = model.mean() - mean;
            (model.covariance() + off * off.transpose()) * *weight
        })
        .sum();
    let velocity = Vector2::new(mean.z, mean.w);
    Kalman::new(models[0].time(), &mean.xy(), &velocity, &covariance)
}
