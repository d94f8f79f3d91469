//! Prediction: where each AUV and the goal will be, and how surely.

pub(crate) mod along_path;
pub(crate) mod covariance;
pub(crate) mod dive;
pub(crate) mod drift;
pub mod forecast;
pub mod goal;
pub(crate) mod motion;
pub(crate) mod offset;
pub mod smallest_circle;
