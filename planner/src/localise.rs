//! Figures on which the craft localises AUVs.
//!
//! ```text
//! P ← P + q Δt I                              between measurements: the vehicle's own navigation
//! P ← P − P h hᵀ P / (hᵀ P h + σ²)            at a range, with h = d / √(‖d‖² + z²)
//! minimise  (Σ wᵢ mean tr Pᵢ) (1 + energy + breaches)      or the largest wᵢ tr Pᵢ
//! ```
//! over circles, ellipses and zigzags about the moving mean of the AUVs, each sailed by a
//! rolled-out craft. `scene` samples the AUVs and the craft, `trial` sails a figure, `candidates`
//! lists them, `choose` selects one, and `sentence` describes it.

pub(crate) mod candidates;
pub(crate) mod choose;
pub(crate) mod scene;
pub(crate) mod sentence;
#[cfg(test)]
mod tests;
pub(crate) mod trial;
