//! Random surface craft: hulls, thrusters and autopilots drawn from a seed.
//!
//! A craft that does not hold its heading or speed in the [step tests](super::step_response) is
//! drawn again: every craft could have passed its commissioning.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use super::SurfaceHull;
use super::step_response::{StepTestResult, step_test};
use crate::world::inner_loop::SurfaceAutopilot;

mod draw;
mod traits;

pub use traits::{
    ACCELERATION, CraftConstraints, CraftTraits, DELAY, HeadingLoopKind, LAG, MASS, SurgeLoopKind,
};

use draw::Draw;

const ATTEMPTS: u64 = 300;

/// A random craft.
#[derive(Clone, Debug, PartialEq)]
pub struct RandomCraft {
    /// Its hull.
    pub hull: SurfaceHull,
    /// Its autopilot.
    pub autopilot: SurfaceAutopilot,
    /// Result of its step tests.
    pub tested: StepTestResult,
    /// Its drawn properties.
    pub traits: CraftTraits,
    /// Number of draws up to this one, the first that passed the step tests.
    pub attempts: u64,
}

/// No craft was found.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("none of {attempts} random craft with seed {seed} passes the step tests; relax the given properties")]
pub struct NoCraft {
    /// The seed.
    pub seed: u64,
    /// Number of draws.
    pub attempts: u64,
}

impl RandomCraft {
    /// The craft of a seed: the first draw that passes its step tests.
    pub fn draw(seed: u64, constraints: &CraftConstraints) -> Result<Self, NoCraft> {
        for attempt in 0..ATTEMPTS {
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            rng.set_stream(attempt);
            let (hull, autopilot, traits) = Draw { rng, constraints }.craft();
            if let Ok(tested) = step_test(&hull, &autopilot) {
                return Ok(Self { hull, autopilot, tested, traits, attempts: attempt + 1 });
            }
        }
        Err(NoCraft { seed, attempts: ATTEMPTS })
    }
}
