//! The planner's outside: JSON, HTTP, the command line, and no control law.
//!
//! ```text
//! edge (id, hosts, access) → posted (in time) → admission → pool: wire → planners (in time) → wire → edge (problems, headers)
//! ```
//! Every failure on the way becomes a [`problem::Problem`], and only there a status code. [`app`] is the whole service
//! without a socket, [`service`] the same with missions, whose events are in the [`store`].

use axum::{Json, Router, extract::FromRef, middleware, routing::get};
use tower_http::catch_panic::CatchPanicLayer;

pub mod access;
mod admission;
pub mod batch;
mod campaigns;
pub mod crafts;
mod deadline;
mod docs;
mod edge;
pub mod examples;
pub mod health;
mod hosts;
mod metrics;
pub mod missions;
pub mod offline;
mod openapi;
mod page;
mod planners;
mod planning;
mod pool;
mod posted;
pub mod problem;
mod settings;
pub mod slots;
pub mod store;
mod trace;

use campaigns::Campaigns;
use edge::Edge;
use health::Readiness;
pub use hosts::Hosts;
pub use metrics::{Connections, Counted};
use metrics::{Metrics, StoreMetrics};
use missions::Missions;
use planners::Planners;
pub use posted::BODY_BYTES_MAX;
use posted::Bodies;
use problem::Problem;
pub use settings::{PlanFn, Settings};
use store::{EventStore, StoreError};
pub use trace::{TraceContext, TraceFn};

#[derive(Clone, FromRef)]
struct Shared {
    planners: Planners,
    missions: Option<Missions>,
    campaigns: Option<Campaigns>,
    readiness: Readiness,
    bodies: Bodies,
    metrics: Metrics,
}

/// The whole service, but for missions and campaigns.
///
/// Must be called inside a Tokio runtime's reach: plans run on its blocking threads.
pub fn app(settings: Settings) -> Router {
    let metrics = Metrics::new(&settings.connections, &StoreMetrics::default());
    let planners = Planners::new(&settings, metrics);
    routed(settings, planners, None, None)
}

/// The whole service, with the missions of `store`, and the campaigns beside it: those that were running go on.
pub async fn service(settings: Settings, store: EventStore) -> Result<(Router, Missions), StoreError> {
    let metrics = Metrics::new(&settings.connections, store.metrics());
    let planners = Planners::new(&settings, metrics);
    let missions = Missions::resume(store.clone(), planners.clone()).await?;
    let campaigns = Campaigns::resume(&store, planners.clone(), missions.closing())?;
    let router = routed(settings, planners, Some(missions.clone()), Some(campaigns));
    Ok((router, missions))
}

fn routed(
    settings: Settings,
    planners: Planners,
    missions: Option<Missions>,
    campaigns: Option<Campaigns>,
) -> Router {
    let metrics = planners.metrics().clone();
    let edge = Edge {
        hosts: settings.hosts,
        tokens: settings.tokens,
        trace: settings.trace,
        metrics: metrics.clone(),
    };
    let shared = Shared {
        readiness: Readiness::new(planners.clone(), missions.clone(), settings.stopping.clone()),
        planners,
        missions,
        campaigns,
        bodies: Bodies::new(settings.body_time_limit, metrics.clone()),
        metrics,
    };
    let (router, _) = openapi::documented().split_for_parts();
    router
        .merge(page::router())
        .merge(docs::router())
        .route("/openapi.json", get(async || Json(openapi::document())))
        .fallback(async || Problem::NoRoute)
        .method_not_allowed_fallback(async || Problem::MethodNotAllowed)
        .layer(CatchPanicLayer::custom(edge::caught_panic))
        .layer(middleware::from_fn(move |request, next| {
            edge::pass(edge.clone(), request, next)
        }))
        .with_state(shared)
}
