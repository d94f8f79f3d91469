//! A figure, sailed by a rolled-out craft, and what the measurements on it leave.

use nalgebra::{Matrix2, Rotation2, Vector2};
use smallvec::SmallVec;

use crate::facts::angle::wrap;
use crate::facts::localise::Figure;
use crate::facts::ranges::{AUVS_MAX, FIGURE_ROWS_MAX};
use crate::facts::visit::{Fixes, Reduce};
use crate::localise::scene::{MEASUREMENTS, Scene};

/// Steps of the craft between two measurements.
const STEPS: usize = 4;

/// Least share of its speed that a craft keeps in a turn.
const SPEED_IN_TURN: f64 = 0.1;

/// Distance from a corner of its way at which a craft is there, as a share of a step's.
const AT_CORNER: f64 = 0.1;

/// Share of the mean variance beside the largest one.
const MEAN_BESIDE_MAX: f64 = 0.01;

/// Measurements from one row of an answer's errors over time to the next.
pub(crate) const MEASUREMENTS_OF_ROW: usize = MEASUREMENTS / (FIGURE_ROWS_MAX - 1);

/// Outcome of a trial.
#[derive(Clone, Debug)]
pub(crate) struct Outcome {
    /// Cost, m², with the prices of energy and breaches.
    pub(crate) cost: f64,
    /// Mean variance of each member over the second half, north plus east, m².
    pub(crate) variances: SmallVec<[f64; AUVS_MAX]>,
    /// Variances of all members at each row's measurement, m².
    pub(crate) rows: Vec<f64>,
}

impl Scene {
    /// Sails `figure`, whose axis is counted from the bow; none if it costs `least` or more.
    pub(crate) fn sail(&self, figure: &Figure, least: f64) -> Option<Outcome> {
        let dt = self.interval / STEPS as f64;
        let (mut position, mut bow) = (Vector2::zeros(), Vector2::new(1.0, 0.0));
        let mut covariances: SmallVec<[Matrix2<f64>; AUVS_MAX]> =
            self.members.iter().map(|member| member.covariance).collect();
        let mut outcome =
            Outcome { cost: 0.0, variances: covariances.iter().map(|_| 0.0).collect(), rows: Vec::new() };
        let n = MEASUREMENTS as f64;
        let (mut energy, mut breaches) = (0.0, 0.0);
        let mut corners = &*self.corners;
        for k in 1..=MEASUREMENTS {
            for step in 0..STEPS {
                let time = self.interval * (k - 1) as f64 + dt * step as f64;
                while let [corner, rest @ ..] = corners
                    && (corner - position).norm() < AT_CORNER * self.speed * dt
                {
                    corners = rest;
                }
                let speed = self.step(figure, time, dt, corners.first(), &mut position, &mut bow);
                energy += (speed / self.speed).powi(3);
            }
            breaches += f64::from(self.breaks_a_bound(&position, k));
            let (mut sum, mut largest) = (0.0, 0.0_f64);
            for (i, member) in self.members.iter().enumerate() {
                let covariance = &mut covariances[i];
                *covariance += Matrix2::identity() * (self.growth * self.interval);
                let before = covariance.trace();
                let (place, depth) = member.track[k];
                self.measure(covariance, &(position - place), depth);
                let variance = 0.5 * (before + covariance.trace());
                sum += member.share * variance;
                largest = largest.max(member.share * variance);
                if k % MEASUREMENTS_OF_ROW == 0 {
                    outcome.rows.push(variance);
                }
                if MEASUREMENTS / 2 < k {
                    outcome.variances[i] += variance / (MEASUREMENTS - MEASUREMENTS / 2) as f64;
                }
            }
            outcome.cost += match self.reduce {
                Reduce::Mean => sum,
                Reduce::Max => largest + MEAN_BESIDE_MAX * sum,
            };
            // What is still to come only adds.
            if least * n <= outcome.cost {
                return None;
            }
        }
        let price =
            self.tuned.energy_price * energy / (n * STEPS as f64) + self.tuned.breach_price * breaches / n;
        outcome.cost *= (1.0 + price) / n;
        (outcome.cost < least).then_some(outcome)
    }

    /// Moves the craft for `dt`, s, towards its way's `corner`, else the figure; returns its speed.
    fn step(
        &self,
        figure: &Figure,
        time: f64,
        dt: f64,
        corner: Option<&Vector2<f64>>,
        position: &mut Vector2<f64>,
        bow: &mut Vector2<f64>,
    ) -> f64 {
        let ((mean, drift), (place, velocity)) = (self.mean_at(time), figure.at(time));
        let off = mean + place - *position;
        // Over long steps no faster than one closes the distance.
        let pursuit = self.tuned.pursuit_rate.min(0.5 / dt);
        let wanted = match corner {
            Some(corner) => (corner - *position) / dt - self.current,
            None => drift + velocity + off * pursuit - self.current,
        };
        let turn = wrap(bow.perp(&wanted).atan2(bow.dot(&wanted)));
        let most = self.turn_rate * dt;
        *bow = Rotation2::new(turn.clamp(-most, most)) * *bow;
        let left = (turn.abs() - most).max(0.0).cos().max(SPEED_IN_TURN);
        let speed = wanted.norm().min(self.speed) * left;
        *position += (*bow * speed + self.current) * dt;
        speed
    }

    /// The covariance after a measurement at the horizontal offset `off` from an AUV at `depth`, m.
    pub(crate) fn measure(&self, covariance: &mut Matrix2<f64>, off: &Vector2<f64>, depth: f64) {
        let range = off.norm_squared() + depth * depth;
        if self.range_max * self.range_max < range {
            return;
        }
        match self.fixes {
            Fixes::Range if 0.0 < range => {
                let slope = off / range.sqrt();
                let seen = *covariance * slope;
                *covariance -= seen * seen.transpose() / (slope.dot(&seen) + self.noise[0]);
            }
            Fixes::Range => {}
            Fixes::Usbl => {
                let noise = Matrix2::identity() * (self.noise[0] + self.noise[1] * range);
                if let Some(inverse) = (*covariance + noise).try_inverse() {
                    *covariance -= *covariance * inverse * *covariance;
                }
            }
        }
    }

    /// `true` outside the area, within a keep-out or no-go area, or too near an AUV.
    fn breaks_a_bound(&self, position: &Vector2<f64>, k: usize) -> bool {
        let within = |(centre, radius): &(Vector2<f64>, f64)| (position - centre).norm() < *radius;
        let corners = self.area.iter();
        let mut sides = corners.clone().zip(corners.cycle().skip(1));
        let near = |place: &Vector2<f64>| (position - place).norm() < 0.9 * self.stand_off;
        let (land, craft, ned_from_craft) = &self.land;
        self.discs.iter().any(within)
            || land.covers(&(craft + ned_from_craft * position))
            || sides.any(|(from, to)| (to - from).perp(&(position - from)) < 0.0)
            || self.members.iter().any(|member| near(&member.track[k].0))
    }
}
