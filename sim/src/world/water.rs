//! The water: a mean current, its slow fluctuation, its shear with depth, and waves at the surface.
//!
//! ```text
//! v_c(p, z, t) = f(z) R(α(z)) ( mean(p, t) + fluctuation(t) )
//! f(z) = 1 + (factor − 1) s,   α(z) = turn · s,   s = clamp(z / depth, 0, 1)
//! ```
//!
//! The fluctuation is the same everywhere: its patches are taken to be larger than a mission's area. What is
//! not set up is left out, not added as zero, so a constant current stays the same to the bit.

use std::sync::Arc;

use nalgebra::Vector2;
use planner::angle::ned_from_body;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

mod gauss_markov;
mod grid;
mod waves;

pub use gauss_markov::GaussMarkov;
pub use grid::{CurrentGrid, InvalidGrid, NODES_MAX, Node};
pub use waves::{WaveAcceleration, Waves};

use gauss_markov::Fluctuation;
use waves::WaveMotion;

/// Largest component of a mean current, north or east, m/s.
pub use planner::snapshot::CURRENT_MAX;

/// Largest standard deviation of the yaw rate that waves may give, rad/s: a snapshot accepts 3 rad/s, six times that.
const YAW_RATE_SIGMA_MAX: f64 = 0.5;

/// What the water is like. [`Self::check`] says whether it can be.
#[derive(Clone, Debug, PartialEq)]
pub struct WaterSetup {
    /// The mean current at the surface.
    pub current: MeanCurrent,
    /// Slow fluctuation of the current about its mean.
    pub gauss_markov: Option<GaussMarkov>,
    /// Change of the current with depth; without it, the current at depth is the one at the surface.
    pub shear: Option<Shear>,
    /// Waves that move the surface craft.
    pub waves: Option<Waves>,
}

/// The mean current at the surface.
#[derive(Clone, Debug, PartialEq)]
pub enum MeanCurrent {
    /// The same everywhere and always (north, east), m/s, each within ±[`CURRENT_MAX`].
    Constant(Vector2<f64>),
    /// Given on a grid in time and space.
    Gridded(Arc<CurrentGrid>),
}

/// Change of the whole current, mean and fluctuation, with depth: linear from the surface to `depth`, the
/// same from there down.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shear {
    /// Depth at which the change is complete, m, in [0.1, 12 000].
    pub depth: f64,
    /// Speed of the current there as a multiple of the one at the surface, in [0, 2].
    pub factor: f64,
    /// Angle by which the current there is turned from the one at the surface, rad, positive clockwise, in
    /// [−π, π].
    pub turn: f64,
}

/// A number of a [`WaterSetup`] that is not finite or outside its range.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{field}: {given} is not in [{least}, {most}]")]
pub struct InvalidWater {
    /// Which one, as slash-separated names that carry units: `shear/depth_m`.
    pub field: &'static str,
    /// The value.
    pub given: f64,
    /// Least value accepted.
    pub least: f64,
    /// Largest value accepted.
    pub most: f64,
}

impl WaterSetup {
    /// Still water with a constant current (north, east), m/s.
    #[must_use]
    pub fn constant(current: Vector2<f64>) -> Self {
        Self {
            current: MeanCurrent::Constant(current),
            gauss_markov: None,
            shear: None,
            waves: None,
        }
    }

    /// The first number outside its range, if there is one. A grid was checked when it was read.
    pub fn check(&self) -> Result<(), InvalidWater> {
        if let MeanCurrent::Constant(current) = &self.current {
            within("current/north_mps", current.x, -CURRENT_MAX, CURRENT_MAX)?;
            within("current/east_mps", current.y, -CURRENT_MAX, CURRENT_MAX)?;
        }
        if let Some(GaussMarkov {
            sigma,
            correlation_time,
        }) = self.gauss_markov
        {
            within("gauss_markov/sigma_mps", sigma, 0.0, 1.0)?;
            within("gauss_markov/correlation_time_s", correlation_time, 0.1, 1.0e6)?;
        }
        if let Some(Shear { depth, factor, turn }) = self.shear {
            within("shear/depth_m", depth, 0.1, 12_000.0)?;
            within("shear/factor", factor, 0.0, 2.0)?;
            within(
                "shear/turn_rad",
                turn,
                -std::f64::consts::PI,
                std::f64::consts::PI,
            )?;
        }
        if let Some(waves) = self.waves {
            within("waves/heading_sigma_rad", waves.heading_sigma, 0.0, 0.5)?;
            within("waves/surge_sigma_mps", waves.surge_sigma, 0.0, 1.0)?;
            within("waves/peak_period_s", waves.peak_period, 1.0, 30.0)?;
            within("waves/damping", waves.damping, 0.01, 0.5)?;
            let heading_sigma_max = YAW_RATE_SIGMA_MAX * waves.peak_period / std::f64::consts::TAU;
            within(
                "waves/heading_sigma_rad",
                waves.heading_sigma,
                0.0,
                heading_sigma_max,
            )?;
        }
        Ok(())
    }
}

fn within(field: &'static str, given: f64, least: f64, most: f64) -> Result<(), InvalidWater> {
    if least <= given && given <= most {
        return Ok(());
    }
    Err(InvalidWater {
        field,
        given,
        least,
        most,
    })
}

impl Shear {
    fn apply(&self, surface_current: Vector2<f64>, depth: f64) -> Vector2<f64> {
        let share = (depth / self.depth).clamp(0.0, 1.0);
        if share == 0.0 {
            return surface_current;
        }
        ned_from_body(self.turn * share) * surface_current * (1.0 + (self.factor - 1.0) * share)
    }
}

/// The water at one moment.
#[derive(Clone, Debug)]
pub struct Water {
    clock: Clock,
    mean: MeanCurrent,
    fluctuation: Option<Fluctuation>,
    shear: Option<Shear>,
    waves: Option<WaveMotion>,
}

impl Water {
    /// The water at time 0. `setup` has passed [`WaterSetup::check`].
    ///
    /// Current and waves draw from streams of their own: the same seed gives the same current with and
    /// without waves, and the same waves with and without a fluctuation.
    #[must_use]
    pub fn new(setup: &WaterSetup, mut rng: ChaCha8Rng) -> Self {
        debug_assert_eq!(setup.check(), Ok(()));
        let mut wave_rng = ChaCha8Rng::from_rng(&mut rng);
        Self {
            clock: Clock::default(),
            mean: setup.current.clone(),
            fluctuation: setup.gauss_markov.map(|setup| Fluctuation::new(setup, rng)),
            shear: setup.shear,
            waves: setup.waves.map(|setup| WaveMotion::new(&setup, &mut wave_rng)),
        }
    }

    /// Lets `period` s pass.
    pub fn step(&mut self, period: f64) {
        self.clock.step(period);
        if let Some(fluctuation) = &mut self.fluctuation {
            fluctuation.step(period);
        }
    }

    /// The current (north, east), m/s, at a position (north, east), m, and a depth, m; above the surface, the
    /// one at the surface.
    #[must_use]
    pub fn current(&self, position: &Vector2<f64>, depth: f64) -> Vector2<f64> {
        let mut current = match &self.mean {
            MeanCurrent::Constant(current) => *current,
            MeanCurrent::Gridded(grid) => grid.at(self.clock.time(), position),
        };
        if let Some(fluctuation) = &self.fluctuation {
            current += fluctuation.velocity();
        }
        if let Some(shear) = &self.shear {
            current = shear.apply(current, depth);
        }
        // No gust is stronger than what a snapshot accepts.
        current.map(|component| component.clamp(-CURRENT_MAX, CURRENT_MAX))
    }

    /// What the waves do to a craft at the surface; zero without waves.
    #[must_use]
    pub fn wave_acceleration(&self) -> WaveAcceleration {
        match &self.waves {
            Some(waves) => waves.acceleration(self.clock.time()),
            None => WaveAcceleration::default(),
        }
    }
}

/// Time as a count of equal steps, so that a long mission's clock has one rounding error, not one a step.
#[derive(Clone, Copy, Debug, Default)]
struct Clock {
    /// When the steps of this length began, s.
    origin: f64,
    steps: u32,
    period: f64,
}

impl Clock {
    fn time(&self) -> f64 {
        self.origin + f64::from(self.steps) * self.period
    }

    fn step(&mut self, period: f64) {
        if period != self.period || self.steps == u32::MAX {
            *self = Self {
                origin: self.time(),
                steps: 0,
                period,
            };
        }
        self.steps += 1;
    }
}

#[cfg(test)]
mod tests;
