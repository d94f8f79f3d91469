//! Liveness, readiness and version.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use axum::{Json, extract::State};
use planner::plan::Degraded;
use serde::{Deserialize, Serialize};
use tokio::sync::Mutex;
use utoipa::ToSchema;

use store::StoreError;

use crate::edge::arrival::Arrival;
use crate::edge::problem::{Problem, ProblemDocument};
use crate::examples::EXAMPLES;
use crate::missions::Missions;
use crate::planning::planners::Planners;
use wire::{PlanRequest, SCHEMA_VERSION};

/// Lifetime of a verdict on readiness: any number of probes cost one test a second.
const VERDICT_LIFE: Duration = Duration::from_secs(1);

/// Time limit of the test of the planners, and of that of the disk.
const PROBE_TIME: Duration = Duration::from_secs(5);

/// State of the service.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Health {
    /// `live` or `ready`.
    pub status: String,
}

/// Name and versions.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Version {
    /// Name of the program.
    pub name: String,
    /// Version of the program.
    pub version: String,
    /// Version of its requests and answers.
    pub schema_version: String,
}

type Verdict = (Instant, Result<(), Problem>);

/// The last verdict on readiness.
#[derive(Clone, Debug)]
pub(crate) struct Readiness {
    planners: Planners,
    missions: Option<Missions>,
    verdict: Arc<Mutex<Option<Verdict>>>,
    stopping: Arc<AtomicBool>,
}

impl Readiness {
    pub(crate) fn new(planners: Planners, missions: Option<Missions>, stopping: Arc<AtomicBool>) -> Self {
        Self { planners, missions, verdict: Arc::default(), stopping }
    }

    async fn check(&self) -> Result<(), Problem> {
        if self.stopping.load(Ordering::Relaxed) {
            let reason = "the service is about to stop; use another";
            return Err(Problem::NotReady(reason.to_owned()));
        }
        // The lock is held while planning, so that a burst of probes makes one plan.
        let mut verdict = self.verdict.lock().await;
        if let Some((reached, result)) = &*verdict
            && self.planners.clock.since(*reached) < VERDICT_LIFE
        {
            return result.clone();
        }
        let result = self.try_everything().await;
        *verdict = Some((self.planners.clock.now(), result.clone()));
        result
    }

    /// Calls `beat` once a `period` or oftener while planners and the log's writer work.
    pub(crate) async fn beat(self, period: Duration, beat: fn()) {
        loop {
            let plans = self.try_planners(period / 4, period / 4).await.is_ok();
            if plans && self.probe(period / 4).await != Err(Problem::Log(StoreError::Closed)) {
                beat();
            }
            self.planners.clock.sleep(period / 4).await;
        }
    }

    async fn try_everything(&self) -> Result<(), Problem> {
        self.try_planners(self.planners.deadline, PROBE_TIME).await?;
        self.probe(PROBE_TIME).await
    }

    /// Stores something within `time`.
    async fn probe(&self, time: Duration) -> Result<(), Problem> {
        if let Some(missions) = &self.missions {
            let probe = self.planners.clock.timeout(time, missions.probe());
            probe.await.map_err(|_| Problem::Log(StoreError::Busy))??;
        }
        Ok(())
    }

    /// Makes a plan until `limit` and runs a job in each pool of threads, all within `time`.
    async fn try_planners(&self, limit: Duration, time: Duration) -> Result<(), Problem> {
        // A snapshot is too large for the stacks of those who wait.
        let tried = Box::pin(async {
            self.plan_something(limit).await?;
            self.planners.try_pools().await
        });
        let tried = self.planners.clock.timeout(time, tried).await;
        tried.map_err(|_| Problem::TimedOut)?
    }

    async fn plan_something(&self, limit: Duration) -> Result<(), Problem> {
        let request: PlanRequest =
            serde_json::from_str(EXAMPLES[0].body).expect("the tests post every example");
        let snapshot = Arc::new(wire::snapshot(request).map_err(Problem::Invalid)?);
        let now = Arrival(self.planners.clock.now());
        // At a mission's priority: refused requests do not affect missions.
        let planned = self.planners.plan_in_turn(
            |_| Ok(snapshot),
            |snapshot, plan| plan(Arc::clone(snapshot), 1),
            now,
            limit,
        );
        match planned.await?.1.plan.degraded {
            None => Ok(()),
            Some(Degraded::Deadline) => Err(Problem::TimedOut),
            Some(why) => {
                let reason = format!("an example snapshot was not solved: {why:?}");
                Err(Problem::NotReady(reason))
            }
        }
    }
}

/// Tests whether the process is alive.
#[utoipa::path(get, path = "/livez", tag = "service",
    responses((status = 200, description = "The process is alive.", body = Health)))]
pub(crate) async fn livez() -> Json<Health> {
    Json(Health { status: "live".to_owned() })
}

/// Tests whether the service can plan and store. The result is kept for a second.
#[utoipa::path(get, path = "/readyz", tag = "service", responses(
    (status = 200, description = "The service is ready.", body = Health),
    (status = 503, description = "The service cannot plan, is about to stop, is busy, or the mission log is damaged, cannot be written, or its disk is full.", body = ProblemDocument,
        content_type = "application/problem+json"),
    (status = 504, description = "The test took too long.", body = ProblemDocument,
        content_type = "application/problem+json")))]
pub(crate) async fn readyz(State(readiness): State<Readiness>) -> Result<Json<Health>, Problem> {
    // A probe expects status 503.
    readiness.check().await.map_err(|problem| match problem {
        Problem::Log(StoreError::Full) => Problem::NotReady(problem.to_string()),
        other => other,
    })?;
    Ok(Json(Health { status: "ready".to_owned() }))
}

/// Returns the name and the versions of the service.
#[utoipa::path(get, path = "/version", tag = "service",
    responses((status = 200, description = "Name and versions.", body = Version)))]
pub(crate) async fn version() -> Json<Version> {
    Json(Version {
        name: "pilotfish".to_owned(),
        version: env!("CARGO_PKG_VERSION").to_owned(),
        schema_version: SCHEMA_VERSION.to_owned(),
    })
}
