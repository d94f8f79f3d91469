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

/// Largest component of a mean current, north or east, m/s: what the planner accepts as a current.
pub const CURRENT_MAX: f64 = 3.0;

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
mod tests {
    use std::f64::consts::FRAC_PI_2;

    use super::*;

    const SURFACE: f64 = 0.0;

    fn rng() -> ChaCha8Rng {
        ChaCha8Rng::seed_from_u64(5)
    }

    fn everything() -> WaterSetup {
        WaterSetup {
            gauss_markov: Some(GaussMarkov {
                sigma: 0.05,
                correlation_time: 300.0,
            }),
            shear: Some(Shear {
                depth: 20.0,
                factor: 0.5,
                turn: FRAC_PI_2,
            }),
            waves: Some(Waves {
                heading_sigma: 0.05,
                surge_sigma: 0.1,
                peak_period: 3.0,
                damping: 0.1,
            }),
            ..WaterSetup::constant(Vector2::new(0.1, -0.2))
        }
    }

    #[test]
    fn a_constant_current_alone_is_the_same_to_the_bit() {
        let constant = Vector2::new(-0.0, 0.1 + 0.2);
        let mut water = Water::new(&WaterSetup::constant(constant), rng());
        for depth in [SURFACE, 20.0] {
            water.step(0.1);
            let bits = water.current(&Vector2::new(3.0, 4.0), depth).map(f64::to_bits);
            assert_eq!(bits, constant.map(f64::to_bits));
        }
        assert_eq!(water.wave_acceleration(), WaveAcceleration::default());
    }

    #[test]
    fn a_seed_means_the_same_water_and_another_seed_another_one() {
        let run = |seed| {
            let mut water = Water::new(&everything(), ChaCha8Rng::seed_from_u64(seed));
            for _ in 0..100 {
                water.step(0.1);
            }
            (water.current(&Vector2::zeros(), 7.0), water.wave_acceleration())
        };
        assert_eq!(run(1), run(1));
        assert_ne!(run(1).0, run(2).0);
        assert_ne!(run(1).1, run(2).1);
    }

    #[test]
    fn neither_waves_nor_fluctuation_change_the_other() {
        let calm = WaterSetup {
            waves: None,
            ..everything()
        };
        let steady = WaterSetup {
            gauss_markov: None,
            ..everything()
        };
        let [mut all, mut calm, mut steady] =
            [everything(), calm, steady].map(|setup| Water::new(&setup, rng()));
        for _ in 0..100 {
            for water in [&mut all, &mut calm, &mut steady] {
                water.step(0.1);
            }
        }
        let current = |water: &Water| water.current(&Vector2::zeros(), SURFACE);
        assert_eq!(current(&all), current(&calm));
        assert_eq!(all.wave_acceleration(), steady.wave_acceleration());
        assert_ne!(current(&all), current(&steady));
    }

    #[test]
    fn shear_leaves_the_surface_as_it_is_and_is_complete_from_its_depth_down() {
        let shear = Shear {
            depth: 20.0,
            factor: 0.5,
            turn: FRAC_PI_2,
        };
        let north = Vector2::new(0.4, 0.0);
        assert_eq!(shear.apply(north, SURFACE), north);
        assert_eq!(shear.apply(north, -1.0), north, "above the surface");
        // Clockwise by a right angle: north becomes east.
        let below = Vector2::new(0.0, 0.2);
        assert!((shear.apply(north, 20.0) - below).norm() < 1e-15);
        assert_eq!(shear.apply(north, 20.0), shear.apply(north, 500.0));
        // Half-way: 45° clockwise, three quarters of the speed.
        let half = shear.apply(north, 10.0);
        assert!((half.norm() - 0.3).abs() < 1e-15 && (half.x - half.y).abs() < 1e-15);
    }

    #[test]
    fn shear_acts_on_mean_and_fluctuation_alike() {
        let water = Water::new(&everything(), rng());
        let surface = water.current(&Vector2::zeros(), SURFACE);
        assert_ne!(surface, Vector2::new(0.1, -0.2));
        let below = water.current(&Vector2::zeros(), 30.0);
        assert!((below - 0.5 * Vector2::new(-surface.y, surface.x)).norm() < 1e-15);
    }

    #[test]
    fn the_clock_counts_and_keeps_its_time_when_the_period_changes() {
        let mut clock = Clock::default();
        for _ in 0..18_000 {
            clock.step(0.1);
        }
        assert_eq!(clock.time(), 18_000.0 * 0.1);
        clock.step(0.5);
        clock.step(0.5);
        assert_eq!(clock.time(), 1801.0);
    }

    #[test]
    fn a_gridded_current_is_taken_at_the_waters_own_time() {
        let table = "t_s,north_m,east_m,current_north_mps,current_east_mps\n0,0,0,0,0\n10,0,0,1,-1\n";
        let grid = CurrentGrid::read(table.as_bytes()).expect("two nodes");
        let setup = WaterSetup {
            current: MeanCurrent::Gridded(Arc::new(grid)),
            ..WaterSetup::constant(Vector2::zeros())
        };
        let mut water = Water::new(&setup, rng());
        for _ in 0..10 {
            water.step(0.5);
        }
        assert_eq!(water.current(&Vector2::zeros(), SURFACE), Vector2::new(0.5, -0.5));
    }

    #[test]
    fn every_number_outside_its_range_is_named_with_its_value_and_limits() {
        type Spoil = fn(&mut WaterSetup, f64);

        assert_eq!(everything().check(), Ok(()));
        let spoils: [(&str, Spoil); 11] = [
            ("current/north_mps", |setup, bad| {
                setup.current = MeanCurrent::Constant(Vector2::new(bad, 0.0));
            }),
            ("current/east_mps", |setup, bad| {
                setup.current = MeanCurrent::Constant(Vector2::new(0.0, bad));
            }),
            ("gauss_markov/sigma_mps", |setup, bad| {
                setup.gauss_markov.as_mut().expect("set").sigma = bad;
            }),
            ("gauss_markov/correlation_time_s", |setup, bad| {
                setup.gauss_markov.as_mut().expect("set").correlation_time = bad;
            }),
            ("shear/depth_m", |setup, bad| {
                setup.shear.as_mut().expect("set").depth = bad;
            }),
            ("shear/factor", |setup, bad| {
                setup.shear.as_mut().expect("set").factor = bad;
            }),
            ("shear/turn_rad", |setup, bad| {
                setup.shear.as_mut().expect("set").turn = bad;
            }),
            ("waves/heading_sigma_rad", |setup, bad| {
                setup.waves.as_mut().expect("set").heading_sigma = bad;
            }),
            ("waves/surge_sigma_mps", |setup, bad| {
                setup.waves.as_mut().expect("set").surge_sigma = bad;
            }),
            ("waves/peak_period_s", |setup, bad| {
                setup.waves.as_mut().expect("set").peak_period = bad;
            }),
            ("waves/damping", |setup, bad| {
                setup.waves.as_mut().expect("set").damping = bad;
            }),
        ];
        for (field, spoil) in spoils {
            for bad in [-4.0, 1.0e9, f64::NAN, f64::INFINITY] {
                let mut setup = everything();
                spoil(&mut setup, bad);
                let error = setup.check().expect_err(field);
                assert_eq!(error.field, field);
                assert_eq!(error.given.to_bits(), bad.to_bits());
                assert!(!(error.least <= bad && bad <= error.most));
            }
        }
    }
}
