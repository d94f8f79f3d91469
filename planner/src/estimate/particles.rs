//! Particle filter of a vehicle of which ranges are known: rings, mirror images, outliers.
//!
//! ```text
//! p⁺ ~ π(p⁺ | p, v̂, z)                     v | p⁺ ~ N(v̂⁺, V⁺ I)
//! w⁺ = w L(z | p⁺) N(p⁺; p + f v̂, S I) / π    S = f² V + q_p
//! v̂⁺ = e v̂ + (C/S)(p⁺ − p − f v̂)           V⁺ = e² V + q_v − C²/S    C = f e V + q_c
//! ```
//! A particle has a position and one of the two motions of the interacting filter; its velocity is
//! a Gaussian, whose variance V is the same along both axes (Rao and Blackwell). f, e and q are the
//! moments of its motion. π draws most positions from the ring of the range, in polar coordinates
//! about the craft, and the others from the motion alone: a range that went a longer way leaves
//! enough particles. Gaussians instead of particles die too early where a ring bends: of Gaussians
//! that are updated one by one a fifth of the sure ones were on the wrong side.
//!
//! The noise is a fixed sequence, told along and across the line of sight: equal requests have
//! equal answers, and turned ones turned answers but for the sampling. Sources: A. Doucet, S.
//! Godsill, C. Andrieu, "On sequential Monte Carlo sampling methods for Bayesian filtering", 2000,
//! doi:10.1023/A:1008935410038; N. Gordon, D. Salmond, A. Smith, 1993.

use std::f64::consts::{PI, TAU};

use nalgebra::{Matrix4, Vector2, Vector4};

use crate::{estimate::motion_model::MotionModel, facts::angle::starboard_of, tuned::EstimateNumbers};

/// Share of the particles that begin on the first range's ring; the others begin within it.
const ON_RING: f64 = 0.7;

/// Share of particles that move without the range, where it is as expected and where it is not.
const UNGUIDED: [f64; 2] = [0.1, 0.9];

/// Square of the normalised innovation from which on a range is not as expected.
const FAR: f64 = 16.0;

/// Share of too short ranges among those that are wrong: multipath is longer.
const SHORT: f64 = 1e-3;

/// Spread of directions about the craft from which on all are equally likely, rad.
const ROUND: f64 = 0.8;

/// Effective share of the particles below which they are resampled.
const EFFECTIVE: f64 = 0.5;

/// Least variance, m² and m²/s²: no division by 0.
pub(crate) const VARIANCE_MIN: f64 = 1e-9;

/// Least probability density, so that no weight is lost in rounding.
const DENSITY_MIN: f64 = 1e-300;

/// A measurement of the position.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Seen {
    /// A slant range from a place, m. The depth is None if no report has one.
    Range { from: Vector2<f64>, range: f64, depth: Option<f64> },
    /// A position, m.
    Position(Vector2<f64>),
}

/// A measurement.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sight {
    pub(crate) time: f64,
    pub(crate) sigma: f64,
    pub(crate) seen: Seen,
    /// Telemetered velocity, m/s, and its variance along either axis.
    pub(crate) velocity: Option<(Vector2<f64>, f64)>,
}

/// A possible vehicle.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Particle {
    pub(crate) weight: f64,
    pub(crate) position: Vector2<f64>,
    pub(crate) velocity: Vector2<f64>,
    /// Variance of the velocity along either axis.
    pub(crate) variance: f64,
    /// Depth, m, if no report has one.
    pub(crate) depth: f64,
    pub(crate) turns: bool,
}

/// All possible vehicles after the last measurement; their weights sum to 1.
#[derive(Clone, Debug)]
pub(crate) struct Cloud {
    pub(crate) particles: Vec<Particle>,
    /// Probability that each measurement but the first is an outlier.
    pub(crate) outliers: Vec<f64>,
    /// Log-likelihood of the measurements but the first.
    pub(crate) log_likelihood: f64,
}

impl Cloud {
    /// The vehicles that `sights`, at least one, leave possible: few of them once `due`.
    pub(crate) fn new(
        sights: &[Sight],
        normals: &Normals,
        tuned: &EstimateNumbers,
        due: &dyn Fn() -> bool,
    ) -> Self {
        let most = if due() { tuned.particles_least } else { tuned.particles_most };
        let (first, later) = sights.split_first().expect("there is a range");
        Self::of(started(first, count(most), tuned, normals)).after(0, first.time, later, normals, tuned, due)
    }

    /// These vehicles before any measurement.
    pub(crate) fn of(particles: Vec<Particle>) -> Self {
        let mut cloud = Self { particles, outliers: Vec::new(), log_likelihood: 0.0 };
        cloud.normalise();
        cloud
    }

    /// Those that later `sights` leave possible; `time` is that of measurement number `done`.
    #[must_use]
    pub(crate) fn after(
        mut self,
        done: u64,
        mut time: f64,
        sights: &[Sight],
        normals: &Normals,
        tuned: &EstimateNumbers,
        due: &dyn Fn() -> bool,
    ) -> Self {
        for (sight, k) in sights.iter().zip(done + 1..) {
            self.resample(k, tuned, if due() { tuned.particles_least } else { tuned.particles_most });
            let elapsed = sight.time - time;
            let mut outlier = 0.0;
            for (particle, i) in self.particles.iter_mut().zip(0..) {
                let mut draws = Draws { noise: Noise::new(k, i), normals };
                outlier += particle.step(elapsed, sight, tuned, &mut draws) * particle.weight;
            }
            let sum = self.normalise();
            self.outliers.push(outlier / sum);
            self.log_likelihood += sum.ln();
            time = sight.time;
        }
        self
    }

    pub(crate) fn moments(&self) -> (Vector4<f64>, Matrix4<f64>) {
        let state = |of: &Particle| Vector4::new(of.position.x, of.position.y, of.velocity.x, of.velocity.y);
        let mean: Vector4<f64> = self.particles.iter().map(|of| state(of) * of.weight).sum();
        let covariance = self.particles.iter().map(|of| {
            let off = state(of) - mean;
            let own = Matrix4::from_diagonal(&Vector4::new(0.0, 0.0, of.variance, of.variance));
            (off * off.transpose() + own) * of.weight
        });
        let sum: Matrix4<f64> = covariance.sum();
        (mean, (sum + sum.transpose()) * 0.5)
    }

    /// Divides the weights by their sum, and returns it; without any they are equal.
    fn normalise(&mut self) -> f64 {
        let sum: f64 = self.particles.iter().map(|of| of.weight).sum();
        let is_lost = !(DENSITY_MIN <= sum && sum.is_finite());
        let equal = 1.0 / self.particles.len() as f64;
        for particle in &mut self.particles {
            particle.weight = if is_lost { equal } else { particle.weight / sum };
        }
        if is_lost { DENSITY_MIN } else { sum }
    }

    /// Resamples if few particles have most of the weight, or another number suits their spread.
    fn resample(&mut self, k: u64, tuned: &EstimateNumbers, most: f64) {
        let (mean, covariance) = self.moments();
        debug_assert!(mean.iter().all(|number| number.is_finite()));
        let spread = (covariance.m11 + covariance.m22).max(0.0).sqrt();
        let wanted = (tuned.particles_most * spread / tuned.particles_spread)
            .clamp(tuned.particles_least, most.max(tuned.particles_least));
        let squares: f64 = self.particles.iter().map(|of| of.weight * of.weight).sum();
        let now = self.particles.len() as f64;
        let suits = wanted <= 1.5 * now && now <= 1.5 * wanted;
        if suits && EFFECTIVE * now * squares <= 1.0 {
            return;
        }
        let wanted = count(wanted);
        let weight = 1.0 / wanted as f64;
        let (mut next, mut passed) = (weight * Noise::new(k, u64::from(u32::MAX)).unit(), 0.0);
        let mut drawn = Vec::with_capacity(wanted);
        for particle in &self.particles {
            passed += particle.weight;
            while next < passed && drawn.len() < wanted {
                drawn.push(Particle { weight, ..*particle });
                next += weight;
            }
        }
        self.particles = drawn;
    }
}

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "tuned numbers are positive")]
pub(crate) fn count(of: f64) -> usize {
    of.min(1e5) as usize + 1
}

/// Particles that the first measurement leaves possible.
fn started(first: &Sight, count: usize, tuned: &EstimateNumbers, normals: &Normals) -> Vec<Particle> {
    let unknown = (Vector2::zeros(), tuned.range_speed_sigma.powi(2));
    let (velocity, variance) = first.velocity.unwrap_or(unknown);
    let manoeuvres = tuned.manoeuvre_length / (tuned.manoeuvre_length + tuned.straight_length);
    let each = (0..count).zip(0..).map(|(place, i)| {
        let mut noise = Noise::new(0, i);
        let [ahead, beside] = normals.pair(&mut noise);
        let turns = noise.unit() < manoeuvres;
        let (position, depth, weight) = match first.seen {
            Seen::Position(at) => (at + Vector2::new(ahead, beside) * first.sigma, 0.0, 1.0),
            Seen::Range { from, range, depth } => {
                let depth = depth.unwrap_or(range * noise.unit());
                // Uniform over the disc that the range allows.
                let farthest = ((range + 4.0 * first.sigma).powi(2) - depth * depth).max(1.0).sqrt();
                let ring = ((range + first.sigma * ahead).powi(2) - depth * depth).max(0.0).sqrt();
                let is_on_ring = noise.unit() < ON_RING && 0.0 < ring && ring < farthest;
                let distance = if is_on_ring { ring } else { farthest * noise.unit().sqrt() };
                let slant = length(distance, depth);
                let drawn = ON_RING * gaussian(slant - range, first.sigma.powi(2)) / slant
                    + (1.0 - ON_RING) * 2.0 / (farthest * farthest);
                let angle = TAU * (place as f64 + noise.unit()) / count as f64;
                let likelihood = likelihood(range - slant, first.sigma, tuned).0;
                (from + Vector2::new(angle.cos(), angle.sin()) * distance, depth, likelihood / drawn)
            }
        };
        Particle { weight, position, velocity, variance, depth, turns }
    });
    each.collect()
}

impl Particle {
    /// Moves it to a measurement, and returns the probability that this is an outlier.
    fn step(&mut self, elapsed: f64, sight: &Sight, tuned: &EstimateNumbers, draws: &mut Draws) -> f64 {
        let square = self.velocity.norm_squared() + 2.0 * self.variance;
        let speed = square.sqrt().max(tuned.manoeuvre_speed_min);
        let (begin, end) = (speed / tuned.straight_length, speed / tuned.manoeuvre_length);
        let settled = (1.0 - (-(begin + end) * elapsed).exp()) / (begin + end);
        let drawn = draws.noise.unit();
        self.turns = if self.turns { settled * end <= drawn } else { drawn < settled * begin };
        let motion = if self.turns {
            MotionModel::manoeuvre(speed, 0.0, tuned)
        } else {
            MotionModel::straight(speed, tuned)
        };
        let moments = motion.moments(elapsed);
        let (travelled, kept) = (moments.travelled.re, moments.kept.re);
        let [position, velocity] = moments.variances;
        let mut ahead = Ahead {
            position: self.position + self.velocity * travelled,
            velocity: self.velocity * kept,
            spread: travelled * travelled * self.variance + position + VARIANCE_MIN,
            variance: kept * kept * self.variance + velocity,
            covariance: travelled * kept * self.variance + moments.correlation.re,
        };
        if let Some(said) = sight.velocity {
            self.weight *= ahead.take_velocity(said, tuned);
        }
        let (at, weight, outlier) = match sight.seen {
            Seen::Position(fix) => ahead.at_fix(&fix, sight.sigma, tuned, draws),
            Seen::Range { from, range, depth } => {
                let ring = Ring { from, range, depth: depth.unwrap_or(self.depth), sigma: sight.sigma };
                ahead.at_range(&ring, tuned, draws)
            }
        };
        let gain = ahead.covariance / ahead.spread;
        self.weight *= weight;
        self.velocity = ahead.velocity + (at - ahead.position) * gain;
        self.variance = (ahead.variance - gain * ahead.covariance).max(VARIANCE_MIN);
        self.position = at;
        outlier
    }
}

/// A range from a place, with the vehicle's depth.
struct Ring {
    from: Vector2<f64>,
    range: f64,
    depth: f64,
    sigma: f64,
}

/// A particle's prediction: means, variances along either axis, and their covariance.
struct Ahead {
    position: Vector2<f64>,
    velocity: Vector2<f64>,
    spread: f64,
    variance: f64,
    covariance: f64,
}

impl Ahead {
    /// Updates with a telemetered velocity inside the gate, and returns its likelihood.
    fn take_velocity(&mut self, (said, variance): (Vector2<f64>, f64), tuned: &EstimateNumbers) -> f64 {
        let off = said - self.velocity;
        let sum = self.variance + variance;
        let distance = off.norm_squared() / sum;
        let (covariance, kept) = (self.covariance, variance / sum);
        if distance <= tuned.gate {
            self.position += off * (covariance / sum);
            self.velocity += off * (self.variance / sum);
            self.spread = (self.spread - covariance * covariance / sum).max(VARIANCE_MIN);
            self.covariance *= kept;
            self.variance *= kept;
        }
        (-0.5 * distance.min(tuned.gate)).exp() / sum
    }

    /// A position after a fix, its weight, and the probability that the fix is an outlier.
    fn at_fix(
        &self,
        fix: &Vector2<f64>,
        sigma: f64,
        tuned: &EstimateNumbers,
        draws: &mut Draws,
    ) -> (Vector2<f64>, f64, f64) {
        let (off, sum) = (fix - self.position, self.spread + sigma * sigma);
        let square = off.norm_squared();
        let direct = (1.0 - tuned.multipath_share) * (-0.5 * square / sum).exp() / (TAU * sum);
        let scale = sum + tuned.outlier_scale.powi(2);
        let other = tuned.multipath_share * (1.0 + 0.5 * square / scale).powi(-2) / (TAU * scale);
        let outlier = other / (direct + other);
        let gain = if draws.noise.unit() < outlier { 0.0 } else { self.spread / sum };
        let [along, across] = draws.normals.pair(&mut draws.noise);
        let drawn = Vector2::new(along, across) * (self.spread * (1.0 - gain)).sqrt();
        (self.position + off * gain + drawn, direct + other, outlier)
    }

    /// A position after a range, its weight, and the probability that the range is an outlier.
    fn at_range(&self, ring: &Ring, tuned: &EstimateNumbers, draws: &mut Draws) -> (Vector2<f64>, f64, f64) {
        let to = self.position - ring.from;
        let (distance, variance) = (to.norm(), ring.sigma * ring.sigma);
        let expected = (distance * distance + self.spread).sqrt();
        // The likeliest distance, by Newton's method; the slant range bends near the craft.
        let (mut radius, mut radial) = (expected, self.spread);
        for _ in 0..3 {
            let slant = length(radius, ring.depth);
            let slope = radius / slant;
            let sum = slope * slope * self.spread + variance;
            radial = self.spread * variance / sum;
            let innovation = ring.range - slant + slope * (radius - expected);
            radius = (expected + self.spread * slope / sum * innovation).max(0.0);
        }
        let late = ring.range - length(expected, ring.depth);
        let is_far = FAR * (self.spread + variance) < late * late;
        let unguided = UNGUIDED[usize::from(is_far)];
        let bend = self.spread.sqrt() / radius.max(VARIANCE_MIN);
        let is_round = ROUND < bend;
        let ahead = if 0.0 < distance { to / distance } else { Vector2::new(1.0, 0.0) };
        let aside = starboard_of(ahead);
        let is_unguided = draws.noise.unit() < unguided;
        let [along, across] = draws.normals.pair(&mut draws.noise);
        let (at, angle) = if is_unguided {
            let at = self.position + (ahead * along + aside * across) * self.spread.sqrt();
            let to = at - ring.from;
            (at, if is_round { 0.0 } else { aside.dot(&to).atan2(ahead.dot(&to)) })
        } else {
            let angle = if is_round { PI * (2.0 * draws.noise.unit() - 1.0) } else { bend * across };
            let (sin, cos) = angle.sin_cos();
            let at = (ahead * cos + aside * sin) * (radius + radial.sqrt() * along).abs();
            (ring.from + at, angle)
        };
        let distance = (at - ring.from).norm().max(1e-3);
        let angular = if is_round { 1.0 / TAU } else { gaussian(angle, bend * bend) };
        let reflected =
            if radius * radius < FAR * radial { gaussian(distance + radius, radial) } else { 0.0 };
        let guided = (gaussian(distance - radius, radial) + reflected) * angular;
        let moved = (-0.5 * (at - self.position).norm_squared() / self.spread).exp() / (TAU * self.spread);
        let drawn = (1.0 - unguided) * guided / distance + unguided * moved;
        let (likelihood, outlier) = likelihood(ring.range - length(distance, ring.depth), ring.sigma, tuned);
        (at, likelihood * moved.max(DENSITY_MIN) / drawn.max(DENSITY_MIN), outlier)
    }
}

/// Likelihood of a range, longer by `late` than the distance, and the probability of a longer way.
fn likelihood(late: f64, sigma: f64, tuned: &EstimateNumbers) -> (f64, f64) {
    let share = tuned.multipath_share;
    let direct = (1.0 - share) * gaussian(late, sigma * sigma);
    let decay = if 0.0 < late { (-late / tuned.multipath_length).exp().max(SHORT) } else { SHORT };
    let longer = share * decay / tuned.multipath_length;
    (direct + longer, longer / (direct + longer))
}

fn gaussian(off: f64, variance: f64) -> f64 {
    (-0.5 * off * off / variance).exp() / (TAU * variance).sqrt()
}

/// Length of the hypotenuse, m, above 0; without the care for overflows, which takes time.
fn length(along: f64, across: f64) -> f64 {
    (along * along + across * across).sqrt().max(VARIANCE_MIN)
}

/// The numbers of one particle at one measurement.
struct Draws<'a> {
    noise: Noise,
    normals: &'a Normals,
}

/// A fixed sequence of numbers for each particle and measurement.
pub(crate) struct Noise(u64);

impl Noise {
    pub(crate) fn new(measurement: u64, particle: u64) -> Self {
        Self((measurement << 40) | (particle << 4))
    }

    /// A number above 0 and below 1, of even distribution. Source: G. Steele, D. Lea, C. Flood,
    /// "Fast splittable pseudorandom number generators", 2014, doi:10.1145/2714064.2660195.
    fn unit(&mut self) -> f64 {
        (self.bits() as f64 + 0.5) / (1_u64 << 52) as f64
    }

    /// 52 bits.
    fn bits(&mut self) -> u64 {
        self.0 += 1;
        let mut bits = self.0.wrapping_mul(0x9E37_79B9_7F4A_7C15);
        bits = (bits ^ (bits >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        bits = (bits ^ (bits >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        (bits ^ (bits >> 31)) >> 12
    }
}

/// Pairs of numbers of standard normal distribution: a table is faster than their formula.
pub(crate) struct Normals(Vec<[f64; 2]>);

/// A power of two.
const NORMALS: u64 = 4096;

impl Normals {
    /// Their radii are evenly distributed quantiles, so that mean and variance are exact.
    pub(crate) fn new() -> Self {
        let pair = |i: u64| {
            let mut noise = Noise::new(u64::from(u16::MAX), i);
            let length = (-2.0 * ((i as f64 + 0.5) / NORMALS as f64).ln()).sqrt();
            let (sin, cos) = (TAU * noise.unit()).sin_cos();
            [length * cos, length * sin]
        };
        Self((0..NORMALS).map(pair).collect())
    }

    pub(crate) fn pair(&self, noise: &mut Noise) -> [f64; 2] {
        self.0[(noise.bits() & (NORMALS - 1)) as usize]
    }
}
