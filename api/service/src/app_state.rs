//! The state of handlers, by type.

use axum::extract::FromRef;

use crate::{
    edge::body::Bodies, health::Readiness, metrics::Metrics, missions::Missions, planning::planners::Planners,
};

#[derive(Clone, FromRef)]
pub(crate) struct AppState {
    pub(crate) planners: Planners,
    pub(crate) missions: Option<Missions>,
    pub(crate) readiness: Readiness,
    pub(crate) bodies: Bodies,
    pub(crate) metrics: Metrics,
}
