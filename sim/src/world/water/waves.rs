//! Wave-frequency motion of the surface craft in surge and heading.
//!
//! The spectrum is that of the usual second-order shaping filter driven by white noise w,
//!
//! ```text
//! h(s) = K_w s / (s² + 2 λ ω₀ s + ω₀²),   K_w = 2 σ √(λ ω₀),   ∫ |h(iω)|² dω / 2π = σ²
//! ```
//!
//! Source: T. I. Fossen, Handbook of Marine Craft Hydrodynamics and Motion Control, Wiley 2011,
//! chapter 8, linear wave-response approximation. The filter itself is not used. Its output is ẋ₁
//! of the state ẋ₁ = x₂, ẋ₂ = −ω₀² x₁ − 2 λ ω₀ x₂ + K_w w: the output's rate contains the white
//! noise, so accelerations would have infinite variance, and stepped approximations would grow with
//! the step rate. The motion is instead a sum of sinusoids with random phases, drawn from |h(iω)|²
//! between half and twice ω₀: every derivative is exact and finite, and no step length enters. The
//! band holds (2/π) atan(3 / (4 λ)) of the filter's power, 92 % at λ = 0.1; the sinusoids share the
//! whole σ².
//!
//! With ω = ω₀ eˢ, |h(iω)|² depends on |s| only and is a Cauchy density in sinh s; the rest of dω
//! weighs the two signs of s. Frequencies are drawn exactly, without rejection or tables:
//!
//! ```text
//! sinh|s| = λ tan(q θ),   tan θ = sinh(ln 2) / λ,   q uniform in (0, 1)
//! s > 0 with probability 1 / (1 + e^(−2|s|))
//! ```
//!
//! q is stratified, one draw in each of N equal parts: one realisation has the filter's shape.
//!
//! The weave of an underwater vehicle about its path has the same spectrum, of a longer period.

use std::f64::consts::{LN_2, TAU};

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

/// Sinusoids in each motion: nearly normal (kurtosis 2.95; docs/rationale.md#sim-sinusoids).
const N_SINUSOIDS: u32 = 32;
/// Logarithm of the band's upper edge over ω₀, and of ω₀ over the lower edge. Assumption: swell and
/// wind waves that move a small craft lie within an octave of the peak.
const BAND: f64 = LN_2;

/// Statistics of a free hull's motion in waves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Waves {
    /// Standard deviation of the heading ψ_w, rad, in [0, 0.5].
    pub heading_sigma: f64,
    /// Standard deviation of the surge velocity u_w, m/s, in [0, 1].
    pub surge_sigma: f64,
    /// Period of the spectrum's peak 2π/ω₀ as met by the craft, s, in [1, 30].
    pub peak_period: f64,
    /// Relative damping λ in [0.01, 0.5]: 0.1 for a narrow sea, 0.26 for a fully developed one.
    pub damping: f64,
}

/// Acceleration of a free hull by waves; times its inertia, with added mass, force and moment.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct WaveAcceleration {
    /// u̇_w, m/s², ahead.
    pub surge: f64,
    /// ψ̈_w, rad/s², positive clockwise.
    pub yaw: f64,
}

/// One realisation of the waves. Surge and heading are independent of each other.
#[derive(Clone, Debug)]
pub(super) struct WaveMotion {
    surge: Oscillation,
    heading: Oscillation,
}

impl WaveMotion {
    pub(super) fn new(waves: &Waves, rng: &mut ChaCha8Rng) -> Self {
        Self {
            surge: Oscillation::new(waves.surge_sigma, waves.peak_period, waves.damping, rng),
            heading: Oscillation::new(waves.heading_sigma, waves.peak_period, waves.damping, rng),
        }
    }

    /// Acceleration at `time` s.
    pub(super) fn acceleration(&self, time: f64) -> WaveAcceleration {
        WaveAcceleration { surge: self.surge.rate(time), yaw: self.heading.acceleration(time) }
    }
}

/// A stationary motion: N sinusoids of one amplitude σ √(2/N).
#[derive(Clone, Debug)]
pub(crate) struct Oscillation {
    amplitude: f64,
    sinusoids: Vec<Sinusoid>,
}

#[derive(Clone, Copy, Debug)]
struct Sinusoid {
    /// ω, rad/s.
    frequency: f64,
    /// Phase at time 0, rad.
    phase: f64,
}

impl Oscillation {
    /// The motion of deviation `sigma`, peak at `peak_period` s and relative `damping`, from `rng`.
    pub(crate) fn new(sigma: f64, peak_period: f64, damping: f64, rng: &mut ChaCha8Rng) -> Self {
        let n = f64::from(N_SINUSOIDS);
        let (lambda, omega_0) = (damping, TAU / peak_period);
        let theta = (BAND.sinh() / lambda).atan();
        let mut stratum = 0.0;
        let sinusoid = |_| {
            let q = (stratum + rng.random_range(0.0..1.0)) / n;
            stratum += 1.0;
            let s = (lambda * (q * theta).tan()).asinh();
            let above = rng.random_range(0.0..1.0) * (1.0 + (-2.0 * s).exp()) < 1.0;
            Sinusoid {
                frequency: omega_0 * if above { s.exp() } else { (-s).exp() },
                phase: rng.random_range(0.0..TAU),
            }
        };
        Self { amplitude: sigma * (2.0 / n).sqrt(), sinusoids: (0..N_SINUSOIDS).map(sinusoid).collect() }
    }

    /// A sine of this `amplitude` and `period`, s, whose phase `rng` draws.
    pub(crate) fn sine(amplitude: f64, period: f64, rng: &mut ChaCha8Rng) -> Self {
        Self {
            amplitude,
            sinusoids: vec![Sinusoid { frequency: TAU / period, phase: rng.random_range(0.0..TAU) }],
        }
    }

    /// The motion at `time` s.
    pub(crate) fn at(&self, time: f64) -> f64 {
        self.sum(time, |_, phase| phase.cos())
    }

    /// Sum over the sinusoids of a function of ω and the phase at `time` s.
    fn sum(&self, time: f64, of: impl Fn(f64, f64) -> f64) -> f64 {
        let terms = self.sinusoids.iter();
        let terms = terms.map(|one| of(one.frequency, one.frequency * time + one.phase));
        self.amplitude * terms.sum::<f64>()
    }

    /// First derivative in time at `time` s.
    fn rate(&self, time: f64) -> f64 {
        self.sum(time, |omega, phase| -omega * phase.sin())
    }

    /// Second derivative in time at `time` s.
    fn acceleration(&self, time: f64) -> f64 {
        self.sum(time, |omega, phase| -omega.powi(2) * phase.cos())
    }
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;

    use super::*;
    use crate::tests::{binomial, near};

    const SETUP: Waves = Waves { heading_sigma: 0.05, surge_sigma: 0.12, peak_period: 4.0, damping: 0.1 };
    const OMEGA_0: f64 = TAU / SETUP.peak_period;
    const SEEDS: u64 = 200;

    fn motion(seed: u64) -> WaveMotion {
        WaveMotion::new(&SETUP, &mut ChaCha8Rng::seed_from_u64(seed))
    }

    /// ∫ g(ω) |h(iω)|² dω between two frequencies as multiples of ω₀, by the midpoint rule, without
    /// the substitutions that draw frequencies.
    fn integral(from: f64, to: f64, g: impl Fn(f64) -> f64) -> f64 {
        let n = 20_000;
        let width = (to - from) * OMEGA_0 / f64::from(n);
        let power = |w: f64| {
            let (real, imaginary) = (OMEGA_0.powi(2) - w * w, 2.0 * SETUP.damping * OMEGA_0 * w);
            w * w / (real * real + imaginary * imaginary)
        };
        (0..n)
            .map(|i| {
                let w = from * OMEGA_0 + (f64::from(i) + 0.5) * width;
                g(w) * power(w) * width
            })
            .sum()
    }

    /// Mean of a power of the frequency over the band's spectrum.
    fn moment(power: i32) -> f64 {
        integral(0.5, 2.0, |w| w.powi(power)) / integral(0.5, 2.0, |_| 1.0)
    }

    fn times(period: f64, n: u32) -> impl Iterator<Item = f64> {
        (0..n).map(move |i| f64::from(i) * period)
    }

    fn count<T>(items: impl Iterator<Item = T>) -> f64 {
        items.map(|_| 1.0).sum()
    }

    fn root_mean_square(samples: impl Iterator<Item = f64>) -> f64 {
        let (n, sum) = samples.fold((0.0, 0.0), |(n, sum), x| (n + 1.0, sum + x * x));
        (sum / n).sqrt()
    }

    #[test]
    fn surge_and_heading_have_their_sigma() {
        // Sinusoids of neighbouring frequencies decorrelate over 20 000 s except for the closest
        // pairs: 0.6 % of σ at worst was measured.
        for motion in (0..5).map(motion) {
            let sigma = |of: &Oscillation| root_mean_square(times(0.5, 40_000).map(|t| of.at(t)));
            near(sigma(&motion.surge) / SETUP.surge_sigma, 1.0, 0.02);
            near(sigma(&motion.heading) / SETUP.heading_sigma, 1.0, 0.02);
        }
    }

    #[test]
    fn the_motion_at_one_moment_is_normal_across_seeds() {
        let n = 4000_u32;
        let samples = (0..n).map(|seed| motion(seed.into()).surge.at(77.0) / SETUP.surge_sigma);
        let samples: Vec<f64> = samples.collect();
        let n = f64::from(n);
        let moment = |power| samples.iter().map(|x: &f64| x.powi(power)).sum::<f64>() / n;
        // Four standard errors: √(2/n) of a normal variance, √(96/n) of its fourth moment 3; the
        // sum of N sinusoids has 3 (1 − 1 / 2N).
        near(moment(2), 1.0, 4.0 * (2.0 / n).sqrt());
        let expected = 3.0 * (1.0 - 0.5 / f64::from(N_SINUSOIDS));
        near(moment(4), expected, 4.0 * (96.0 / n).sqrt());
    }

    #[test]
    fn frequencies_follow_the_filters_spectrum() {
        // Share of the sinusoids in slices of the band against the spectrum's integral over the
        // slice. Shares are binomial at worst, stratified draws less: four standard errors.
        let sinusoids = (0..SEEDS).flat_map(|seed| motion(seed).surge.sinusoids);
        let frequencies: Vec<f64> = sinusoids.map(|sinusoid| sinusoid.frequency / OMEGA_0).collect();
        let whole = integral(0.5, 2.0, |_| 1.0);
        let edges = [0.5, 0.8, 0.9, 0.97, 1.0, 1.03, 1.1, 1.25, 2.0];
        for pair in edges.windows(2) {
            let slice = pair[0]..pair[1];
            let found = count(frequencies.iter().filter(|w| slice.contains(*w)));
            let asked = integral(slice.start, slice.end, |_| 1.0) / whole;
            binomial(found, count(frequencies.iter()), asked);
        }
        assert!(frequencies.iter().all(|w| (0.5..=2.0).contains(w)));
    }

    #[test]
    fn accelerations_are_derivatives_of_the_motion_with_finite_variance() {
        let first = motion(1);
        let h = 1e-3;
        let size = (2.0 * f64::from(N_SINUSOIDS)).sqrt();
        for time in times(0.37, 200) {
            // Central differences: h² / 6 times the third, h² / 12 times the fourth derivative,
            // each at most √(2N) σ (2ω₀)ⁿ; the second also loses 4 ε √(2N) σ / h² to rounding.
            let values = |of: &Oscillation| [time - h, time, time + h].map(|t| of.at(t));
            let given = first.acceleration(time);
            let [x, _, z] = values(&first.surge);
            let most = size * SETUP.surge_sigma * (2.0 * OMEGA_0).powi(3);
            near(given.surge, (z - x) / (2.0 * h), h * h / 6.0 * most + 1e-10);
            let [x, y, z] = values(&first.heading);
            let most = size * SETUP.heading_sigma;
            let rounding = 4.0 * f64::EPSILON * most / (h * h) * 8.0;
            let bound = h * h / 12.0 * most * (2.0 * OMEGA_0).powi(4) + rounding;
            near(given.yaw, (z - 2.0 * y + x) / (h * h), bound);
        }
        // σ of the accelerations from the spectrum's moments: N sampled frequencies leave a few %.
        let sigma = |of: fn(&WaveAcceleration) -> f64| {
            let accelerations = |motion: WaveMotion| times(0.5, 4000).map(move |t| motion.acceleration(t));
            let all = (0..20).map(motion).flat_map(accelerations);
            root_mean_square(all.map(|acceleration| of(&acceleration)))
        };
        let found = sigma(|a| a.surge) / (SETUP.surge_sigma * moment(2).sqrt());
        near(found, 1.0, 0.02);
        let found = sigma(|a| a.yaw) / (SETUP.heading_sigma * moment(4).sqrt());
        near(found, 1.0, 0.05);
    }

    #[test]
    fn the_widest_and_narrowest_accepted_setups_give_finite_motion() {
        for (peak_period, damping) in [(1.0, 0.5), (1.0, 0.01), (30.0, 0.5), (30.0, 0.01)] {
            let setup = Waves { heading_sigma: 0.5, surge_sigma: 1.0, peak_period, damping };
            let motion = WaveMotion::new(&setup, &mut ChaCha8Rng::seed_from_u64(2));
            let most = (2.0 * f64::from(N_SINUSOIDS)).sqrt();
            let omega_max = 2.0 * TAU / peak_period;
            for time in times(0.1, 1000) {
                let acceleration = motion.acceleration(time);
                assert!(acceleration.surge.abs() <= most * omega_max);
                assert!(acceleration.yaw.abs() <= 0.5 * most * omega_max.powi(2));
            }
        }
    }
}
