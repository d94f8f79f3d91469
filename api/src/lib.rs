//! The planner's outside: JSON, HTTP, the command line, and no control law.
//!
//! ```text
//! edge (id) → posted (JSON, in time) → wire → planners (a thread each, in time) → wire → edge (problems, headers)
//! ```
//! Whatever goes wrong on the way becomes a [`problem::Problem`], and only there a status code. [`app`] is
//! the whole service without a socket; [`comparison`] is the planner and line of sight on one mission.

use std::{num::NonZeroUsize, time::Duration};

use axum::{
    Json, Router,
    extract::{DefaultBodyLimit, FromRef},
    middleware,
    routing::get,
};
use tower_http::catch_panic::CatchPanicLayer;
use utoipa::OpenApi;
use utoipa_axum::{router::OpenApiRouter, routes};

pub mod bench;
pub mod comparison;
pub mod crafts;
mod deadline;
mod edge;
pub mod examples;
pub mod export;
pub mod figures;
pub mod health;
pub mod identify;
pub mod missions;
pub mod offline;
mod page;
mod planners;
mod planning;
mod posted;
pub mod problem;
pub mod report;
pub mod scores;
pub mod stopwatch;
mod unwrap;
pub mod wire;

use health::Readiness;
use missions::{
    Missions,
    log::{Log, LogError},
};
pub use planners::PlanFn;
use planners::Planners;
pub use posted::BODY_BYTES_MAX;
use posted::BodyTimeLimit;
use problem::Problem;

/// What a service is built with.
#[derive(Clone, Copy, Debug)]
pub struct Settings {
    /// What makes the plans.
    pub plan: PlanFn,
    /// Plans made at once.
    pub planners: usize,
    /// Requests that may wait for a planner; more are turned away.
    pub waiting: usize,
    /// Longest time for a body to arrive.
    pub body_time_limit: Duration,
    /// Longest time for an answer, from the head of its request on. A request may ask for a shorter one.
    pub deadline: Duration,
}

impl Default for Settings {
    /// One planner for each processor; a queue that empties in well under the deadline; time for a body long
    /// enough for a slow link, short enough to notice; a deadline of the interval at which references are renewed.
    fn default() -> Self {
        Self {
            plan: planner::plan::plan_until,
            planners: std::thread::available_parallelism().map_or(1, NonZeroUsize::get),
            waiting: 64,
            body_time_limit: Duration::from_secs(10),
            deadline: Duration::from_secs(1),
        }
    }
}

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

/// The whole service, with the missions of `log`: those that were running go on.
pub async fn service(settings: Settings, log: Log) -> Result<(Router, Missions), LogError> {
    let planners = Planners::new(&settings);
    let missions = Missions::resume(log, planners.clone()).await?;
    Ok((routed(settings, planners, Some(missions.clone())), missions))
}

fn routed(settings: Settings, planners: Planners, missions: Option<Missions>) -> Router {
    let shared = Shared {
        readiness: Readiness::new(planners.clone(), missions.clone()),
        planners,
        missions,
        body_time_limit: BodyTimeLimit(settings.body_time_limit),
    };
    let (router, openapi) = documented().split_for_parts();
    router
        .merge(page::router())
        .route("/openapi.json", get(async move || Json(openapi)))
        .fallback(async || Problem::NoRoute)
        .method_not_allowed_fallback(async || Problem::MethodNotAllowed)
        .layer(DefaultBodyLimit::max(BODY_BYTES_MAX))
        .layer(CatchPanicLayer::custom(edge::caught_panic))
        .layer(middleware::from_fn(edge::pass))
        .with_state(shared)
}

/// The routes that the `OpenAPI` document lists.
fn documented() -> OpenApiRouter<Shared> {
    #[derive(OpenApi)]
    #[openapi(info(
        title = "Pilotfish",
        description = "Formation planner: snapshots of underwater vehicles in, speed and heading references for \
            a surface craft out. SI units and radians, named in every field; positions are local north-east-down; \
            headings and courses are 0 at north, positive clockwise. Every refusal is a problem document, but for \
            what the HTTP library refuses before the service sees it, with no body: malformed HTTP (400), a path over \
            64 KiB (414), and a head that is too long or has over 100 headers (431)."
    ))]
    struct Document;

    OpenApiRouter::with_openapi(Document::openapi())
        .routes(routes!(planning::plan))
        .routes(routes!(planning::compare))
        .routes(routes!(examples::list))
        .routes(routes!(examples::one))
        .routes(routes!(crafts::list))
        .routes(routes!(missions::routes::create, missions::routes::list))
        .routes(routes!(missions::routes::one, missions::routes::delete))
        .routes(routes!(missions::routes::run))
        .routes(routes!(missions::routes::pause))
        .routes(routes!(missions::routes::finish))
        .routes(routes!(missions::routes::step))
        .routes(routes!(missions::routes::reports))
        .routes(routes!(missions::routes::reference))
        .routes(routes!(missions::routes::events))
        .routes(routes!(missions::routes::record))
        .routes(routes!(health::livez))
        .routes(routes!(health::readyz))
        .routes(routes!(health::version))
}
