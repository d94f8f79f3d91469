//! Surface craft that the planner has not met: hulls, thrusters and autopilots drawn from a seed.
//!
//! A craft that does not hold its heading or speed in the [step tests](super::step_test) is drawn anew, so that every
//! craft could have passed its commissioning.

use planner::craft::{HeadingHeld, SpeedHeld};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use super::{
    SurfaceHull,
    step_test::{StepTested, step_test},
};
use crate::world::inner_loop::SurfaceAutopilot;

mod draw;

use draw::Draw;

/// Dry masses drawn, kg: from what two hands carry to what a trailer does.
pub const MASS: [f64; 2] = [20.0, 500.0];
/// Target lags of heading and surge loops, s.
pub const LAG: [f64; 2] = [0.5, 8.0];
/// Accelerations, m/s².
pub const ACCELERATION: [f64; 2] = [0.03, 0.8];
/// Delays of a reference on its way to the loops, s.
pub const DELAY: [f64; 2] = [0.0, 2.0];

/// Draws until a craft is given up.
const ATTEMPTS: u64 = 300;

/// What is wished of a craft; what is not is drawn.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CraftWishes {
    /// Dry mass, kg.
    pub mass: Option<f64>,
    /// Kind of heading loop.
    pub heading_loop: Option<HeadingLoopKind>,
    /// Lag that the heading loop is tuned for, s.
    pub heading_lag: Option<f64>,
    /// Kind of surge loop.
    pub surge_loop: Option<SurgeLoopKind>,
    /// Lag that the surge loop is tuned for, s.
    pub surge_lag: Option<f64>,
    /// Largest acceleration that the surge loop asks for, m/s².
    pub acceleration: Option<f64>,
    /// Delay of a reference, s.
    pub delay: Option<f64>,
    /// What the surge loop holds.
    pub speed_held: Option<SpeedHeld>,
    /// What the heading loop holds.
    pub heading_held: Option<HeadingHeld>,
}

/// Kinds of heading loop.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HeadingLoopKind {
    /// [`HeadingLoop::ProportionalDerivative`](crate::world::inner_loop::HeadingLoop::ProportionalDerivative).
    ProportionalDerivative,
    /// [`HeadingLoop::ProportionalIntegralDerivative`](crate::world::inner_loop::HeadingLoop::ProportionalIntegralDerivative).
    ProportionalIntegralDerivative,
    /// [`HeadingLoop::ReferenceModel`](crate::world::inner_loop::HeadingLoop::ReferenceModel).
    ReferenceModel,
    /// [`HeadingLoop::Cascade`](crate::world::inner_loop::HeadingLoop::Cascade).
    Cascade,
}

/// Kinds of surge loop.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SurgeLoopKind {
    /// Proportional, with drag feed-forward.
    Proportional,
    /// Proportional-integral, its integral part held while the thrusters saturate.
    AntiWindup,
    /// Proportional-integral, its integral part always integrating.
    Windup,
}

/// A craft that was drawn.
#[derive(Clone, Debug, PartialEq)]
pub struct RandomCraft {
    /// Its hull.
    pub hull: SurfaceHull,
    /// Its autopilot.
    pub autopilot: SurfaceAutopilot,
    /// What its step tests found.
    pub tested: StepTested,
    /// What was drawn for it.
    pub traits: CraftTraits,
    /// How many were drawn until this one passed its tests.
    pub attempts: u64,
}

/// What was drawn for a craft, beside its hull and gains.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CraftTraits {
    /// Dry mass, kg.
    pub mass: f64,
    /// Length, m.
    pub length: f64,
    /// Kind of heading loop.
    pub heading_loop: HeadingLoopKind,
    /// Lag that the heading loop is tuned for, without the delay, s.
    pub heading_lag: f64,
    /// Kind of surge loop.
    pub surge_loop: SurgeLoopKind,
    /// Lag that the surge loop is tuned for, without the delay, s.
    pub surge_lag: f64,
    /// Largest acceleration that the surge loop asks for, m/s².
    pub acceleration: f64,
    /// Delay of a reference, s.
    pub delay: f64,
}

/// No craft was found.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("none of {attempts} craft drawn with seed {seed} passes its step tests; wish for less")]
pub struct NoCraft {
    /// The seed.
    pub seed: u64,
    /// How many were tried.
    pub attempts: u64,
}

impl RandomCraft {
    /// The craft of a seed: the first draw that passes its step tests.
    pub fn draw(seed: u64, wishes: &CraftWishes) -> Result<Self, NoCraft> {
        for attempt in 0..ATTEMPTS {
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            rng.set_stream(attempt);
            let (hull, autopilot, traits) = Draw { rng, wishes }.craft();
            if let Ok(tested) = step_test(&hull, &autopilot) {
                return Ok(Self {
                    hull,
                    autopilot,
                    tested,
                    traits,
                    attempts: attempt + 1,
                });
            }
        }
        Err(NoCraft {
            seed,
            attempts: ATTEMPTS,
        })
    }
}
