//! The water: a mean current, its slow fluctuation, its shear with depth, and waves at the surface.
//!
//! ```text
//! v_c(p, z, t) = f(z) R(α(z)) ( mean(p, t) + fluctuation(t) )
//! f(z) = 1 + (factor − 1) s,   α(z) = turn · s,   s = clamp(z / depth, 0, 1)
//! ```
//!
//! The fluctuation is the same everywhere: its patches are assumed larger than a mission's area. An
//! absent part is left out, not added as zero, so a constant current stays the same to the bit.

use std::sync::Arc;

use nalgebra::Vector2;
use planner::angle::ned_from_body;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

mod gauss_markov;
mod grid;
mod waves;

pub use gauss_markov::GaussMarkov;
pub use grid::{CurrentGrid, InvalidGrid, NODES_MAX};
pub use waves::{WaveAcceleration, Waves};

use super::inner_loop::PERIOD;
use gauss_markov::Fluctuation;
pub(crate) use waves::Oscillation;
use waves::WaveMotion;

/// Largest component of a mean current, north or east, m/s.
pub use planner::snapshot::CURRENT_MAX;

/// Properties of the water. The ranges of its numbers are those of a scenario file.
#[derive(Clone, Debug, PartialEq)]
pub struct WaterSetup {
    /// The mean current at the surface.
    pub current: MeanCurrent,
    /// Slow fluctuation of the current about its mean.
    pub gauss_markov: Option<GaussMarkov>,
    /// Change of the current with depth; without it, the current is the same at every depth.
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

/// Change of the whole current with depth: linear from the surface to `depth`, constant below.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shear {
    /// Depth at which the change is complete, m.
    pub depth: f64,
    /// Speed of the current there as a multiple of the one at the surface.
    pub factor: f64,
    /// Angle from the surface current to the one there, rad, positive clockwise.
    pub turn: f64,
}

impl WaterSetup {
    /// Still water with a constant current (north, east), m/s.
    pub fn constant(current: Vector2<f64>) -> Self {
        Self { current: MeanCurrent::Constant(current), gauss_markov: None, shear: None, waves: None }
    }
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
    /// Inner-loop periods since time 0: a count, with one rounding error in a long mission.
    periods: u32,
    mean: MeanCurrent,
    fluctuation: Option<Fluctuation>,
    shear: Option<Shear>,
    waves: Option<WaveMotion>,
}

impl Water {
    /// The water at time 0.
    ///
    /// Current and waves draw from streams of their own: a seed gives the same current with and
    /// without waves, and the same waves with and without a fluctuation.
    pub fn new(setup: &WaterSetup, mut rng: ChaCha8Rng) -> Self {
        let mut wave_rng = ChaCha8Rng::from_rng(&mut rng);
        Self {
            periods: 0,
            mean: setup.current.clone(),
            fluctuation: setup.gauss_markov.map(|setup| Fluctuation::new(setup, rng)),
            shear: setup.shear,
            waves: setup.waves.map(|setup| WaveMotion::new(&setup, &mut wave_rng)),
        }
    }

    /// Advances by one inner-loop period.
    pub fn step(&mut self) {
        self.periods += 1;
        if let Some(fluctuation) = &mut self.fluctuation {
            fluctuation.step(PERIOD);
        }
    }

    fn time(&self) -> f64 {
        f64::from(self.periods) * PERIOD
    }

    /// Current (north, east), m/s, at a position (north, east), m, and a depth, m, 0 at least.
    pub fn current(&self, position: &Vector2<f64>, depth: f64) -> Vector2<f64> {
        let mut current = match &self.mean {
            MeanCurrent::Constant(current) => *current,
            MeanCurrent::Gridded(grid) => grid.at(self.time(), position),
        };
        if let Some(fluctuation) = &self.fluctuation {
            current += fluctuation.velocity();
        }
        if let Some(shear) = &self.shear {
            current = shear.apply(current, depth);
        }
        // A snapshot accepts no stronger gust.
        current.map(|component| component.clamp(-CURRENT_MAX, CURRENT_MAX))
    }

    /// Acceleration of a craft at the surface by waves; zero without waves.
    pub fn wave_acceleration(&self) -> WaveAcceleration {
        match &self.waves {
            Some(waves) => waves.acceleration(self.time()),
            None => WaveAcceleration::default(),
        }
    }
}

#[cfg(test)]
mod tests;
