//! Closed-loop response of a surface craft: data, not code.
//!
//! ```text
//! heading   T ψ̇ = ψ_ref(t − t_d) − ψ,  |ψ̇| ≤ r_max                       first order, or
//!           ψ̈ = ω²(ψ_ref(t − t_d) − ψ) − 2ζω ψ̇,  |ψ̇| ≤ r_max          second order
//! surge     u̇ = clamp((u_ref(t − t_d) − u)/T_u, −a_dec, a_acc) + b,   ḃ = (u̇ − b)/T_i
//! drift     β = v/u = −k_β r
//! power     P = c₁ u + c₃ u³
//! ```
//! Source of the heading and surge models: T. I. Fossen, *Handbook of Marine Craft Hydrodynamics
//! and Motion Control* (2011), closed loops of autopilots; K. Nomoto's first-order model.
//!
//! [`Limits`](crate::snapshot::Limits) are the operator's, a [`Craft`] is the hull with its loops.

pub(crate) mod closed_loop;
mod covariance;
pub(crate) mod description;
pub(crate) mod effect;
pub(crate) mod estimate;
pub(crate) mod learn_by_ekf;
mod learnt_model;
pub(crate) mod memory;
pub(crate) mod model;
mod modes;
pub(crate) mod monitor;
pub(crate) mod one_step;
pub(crate) mod presets;
pub(crate) mod prior;
pub(crate) mod response;
#[cfg(test)]
mod tests;

pub use closed_loop::{
    Craft, HeadingDynamics, HeadingReference, HeadingResponse, Power, SpeedReference, SurgeResponse,
};
pub use description::{CraftDescription, HeadingLoop, SurgeLoop};
pub use effect::Effect;
pub use estimate::CraftEstimate;
pub use memory::MEMORY_LENGTH;
pub use model::CraftModel;
pub use monitor::{Monitor, Realised, Trial, TrialCraft};
pub use presets::{PRESETS, Preset};
pub use prior::{Gaussian, Prior};
