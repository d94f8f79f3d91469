//! The planner's outside: JSON, HTTP, the command line, and no control law.
//!
//! ```text
//! edge (id) → posted (JSON, in time) → wire → planners (a thread each, in time) → wire → edge (problems, headers)
//! ```
//! Every failure on the way becomes a [`problem::Problem`], and only there a status code. [`app`] is the whole service
//! without a socket, [`service`] the same with missions, whose events are in the [`store`].

use axum::{
    Json, Router,
    extract::{DefaultBodyLimit, FromRef},
    middleware,
    routing::get,
};
use tower_http::catch_panic::CatchPanicLayer;

pub mod crafts;
mod deadline;
mod edge;
pub mod examples;
pub mod health;
pub mod missions;
pub mod offline;
mod openapi;
mod page;
mod planners;
mod planning;
mod posted;
pub mod problem;
mod settings;
pub mod store;

use health::Readiness;
use missions::Missions;
use planners::Planners;
pub use posted::BODY_BYTES_MAX;
use posted::BodyTimeLimit;
use problem::Problem;
pub use settings::{PlanFn, Settings};
use store::{EventStore, StoreError};

#[derive(Clone, FromRef)]
struct Shared {
    planners: Planners,
    missions: Option<Missions>,
    readiness: Readiness,
    body_time_limit: BodyTimeLimit,
}

/// The whole service, but for missions.
///
/// Must be called inside a Tokio runtime's reach: plans run on its blocking threads.
pub fn app(settings: Settings) -> Router {
    routed(settings, Planners::new(&settings), None)
}

/// The whole service, with the missions of `store`: those that were running go on.
pub async fn service(settings: Settings, store: EventStore) -> Result<(Router, Missions), StoreError> {
    let planners = Planners::new(&settings);
    let missions = Missions::resume(store, planners.clone()).await?;
    Ok((routed(settings, planners, Some(missions.clone())), missions))
}

fn routed(settings: Settings, planners: Planners, missions: Option<Missions>) -> Router {
    let shared = Shared {
        readiness: Readiness::new(planners.clone(), missions.clone()),
        planners,
        missions,
        body_time_limit: BodyTimeLimit(settings.body_time_limit),
    };
    let (router, _) = openapi::documented().split_for_parts();
    router
        .merge(page::router())
        .route("/openapi.json", get(async || Json(openapi::document())))
        .fallback(async || Problem::NoRoute)
        .method_not_allowed_fallback(async || Problem::MethodNotAllowed)
        .layer(DefaultBodyLimit::max(BODY_BYTES_MAX))
        .layer(CatchPanicLayer::custom(edge::caught_panic))
        .layer(middleware::from_fn(edge::pass))
        .with_state(shared)
}
