//! Prediction: forecasts of the AUVs and the goal, with uncertainty.

pub(crate) mod along_path;
pub(crate) mod covariance;
pub(crate) mod dive;
pub mod forecast;
pub mod goal;
pub(crate) mod motion;
pub(crate) mod offset;
pub mod smallest_circle;
pub mod vessel;
