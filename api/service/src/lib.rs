//! The planner as an HTTP service, with missions that survive it. No control law is here.
//!
//! ```text
//! middleware (id, hosts, access) → body (in time) → admission → pool:
//! wire → planners (in time) → wire → middleware (problems, headers)
//! ```
//! Every failure becomes a [`problem::Problem`], which chooses the status code. [`app`] has no
//! socket and no missions; [`service`] adds missions, whose events are in the [event store](store).

use axum::Router;
use axum::extract::Request;
use axum::middleware::{Next, from_fn};
use axum::routing::get;
use tower_http::catch_panic::CatchPanicLayer;

mod app_state;
pub mod crafts;
mod edge;
pub mod examples;
pub mod health;
pub mod limits;
mod metrics;
pub mod missions;
mod openapi;
mod planning;
mod settings;

use app_state::AppState;
use edge::answer::AnswerMemory;
use edge::body::Bodies;
#[doc(hidden)]
pub use edge::in_process::{Answering, InProcess, MayHaveArrived};
use edge::middleware::{self, Middleware};
use edge::page;
pub use edge::{
    access,
    hosts::Hosts,
    problem, quota, slots,
    trace::{TraceContext, TraceFn},
};
use health::Readiness;
pub use limits::BODY_BYTES_MAX;
pub use metrics::{Connections, Counted};
use missions::{Missions, forward::Forwarding};
use planning::planners::Planners;
pub use planning::{batch, offline, route_files};
use problem::Problem;
pub use settings::{PlanFn, Settings};
use store::{EventStore, StoreError, StoreMetrics};

/// The whole service without missions.
///
/// Call it inside a Tokio runtime: plans run on its blocking threads.
pub fn app(settings: Settings) -> Router {
    let planners = Planners::new(&settings, &StoreMetrics::default());
    routed(settings, planners, None)
}

/// The whole service with the missions of `store`: running ones continue. Fails if the service had
/// tokens and has none.
pub async fn service(settings: Settings, store: EventStore) -> Result<(Router, Missions), StoreError> {
    if let Some(tokens) = &settings.tokens {
        tokens.bind(&store).await?;
    }
    let planners = Planners::new(&settings, store.metrics());
    let missions = Missions::resume(store.clone(), planners.clone(), settings.tokens.clone()).await?;
    let router = routed(settings, planners, Some(missions.clone()));
    Ok((router, missions))
}

fn routed(settings: Settings, planners: Planners, missions: Option<Missions>) -> Router {
    let metrics = planners.metrics.clone();
    let middleware = Middleware {
        clock: planners.clock.clone(),
        hosts: settings.hosts,
        tokens: settings.tokens,
        trace: settings.trace,
        framed: middleware::framed_by(&settings.framed_by),
        metrics: metrics.clone(),
        answers: AnswerMemory::new(),
    };
    let readiness = Readiness::new(planners.clone(), missions.clone(), settings.stopping);
    if let Some((period, beat)) = settings.heartbeat {
        tokio::spawn(readiness.clone().beat(period, beat));
    }
    let forwarding = Forwarding::of(missions.as_ref(), settings.between, settings.peers, settings.others);
    let bodies = Bodies::new(settings.body_time_limit, metrics.clone(), planners.clock.clone());
    let state = AppState { planners, missions, readiness, bodies, metrics };
    let (router, _) = openapi::documented().split_for_parts();
    let router = match forwarding {
        Some(forwarding) => router
            .layer(from_fn(move |request: Request, next: Next| forwarding.clone().handle(request, next))),
        None => router,
    };
    router
        .merge(page::router())
        .route("/openapi.json", get(openapi::get_document))
        .fallback(async || Problem::NoRoute)
        .method_not_allowed_fallback(async || Problem::MethodNotAllowed)
        .layer(CatchPanicLayer::custom(middleware::caught_panic))
        .layer(from_fn(move |request, next| middleware::handle(middleware.clone(), request, next)))
        .with_state(state)
}
