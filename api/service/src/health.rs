//! Whether the service lives, whether it can plan, and what it is.

use std::{
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
    time::{Duration, Instant},
};

use axum::{Json, extract::State};
use planner::{plan::Degraded, snapshot::Snapshot};
use serde::{Deserialize, Serialize};
use tokio::sync::Mutex;
use utoipa::ToSchema;

use crate::{
    deadline::Arrival,
    examples::EXAMPLES,
    missions::Missions,
    planners::Planners,
    problem::{Problem, ProblemDocument},
    store::StoreError,
};
use wire::{PlanRequest, SCHEMA_VERSION};

/// How long a verdict on readiness is valid, s: probes come every few seconds and should cost nothing.
const VERDICT_LIFE: Duration = Duration::from_secs(10);

/// How long the disk may take to store next to nothing.
const PROBE_TIME: Duration = Duration::from_secs(5);

/// The service answers.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Health {
    /// `live` or `ready`.
    pub status: String,
}

/// What the service is.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Version {
    /// Name of the program.
    pub name: String,
    /// Version of the program.
    pub version: String,
    /// Version of the requests and answers it speaks.
    pub schema_version: String,
}

/// Whether the service can plan, and when that was found out.
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
        Self {
            planners,
            missions,
            verdict: Arc::default(),
            stopping,
        }
    }

    async fn check(&self) -> Result<(), Problem> {
        if self.stopping.load(Ordering::Relaxed) {
            return Err(Problem::NotReady(
                "the service is about to stop; ask another".to_owned(),
            ));
        }
        // Held while planning, so that a burst of probes is one plan.
        let mut verdict = self.verdict.lock().await;
        match &*verdict {
            Some((reached, result)) if reached.elapsed() < VERDICT_LIFE => result.clone(),
            Some(_) | None => {
                let result = self.try_everything().await;
                // Busy is no verdict: it is over in a moment.
                let busy = matches!(
                    result,
                    Err(Problem::Overloaded | Problem::TimedOut | Problem::Log(StoreError::Busy))
                );
                if !busy {
                    *verdict = Some((Instant::now(), result.clone()));
                }
                result
            }
        }
    }

    async fn try_everything(&self) -> Result<(), Problem> {
        self.plan_something().await?;
        if let Some(missions) = &self.missions {
            let probe = tokio::time::timeout(PROBE_TIME, missions.probe());
            probe.await.map_err(|_| Problem::Log(StoreError::Busy))??;
        }
        Ok(())
    }

    async fn plan_something(&self) -> Result<(), Problem> {
        let request: PlanRequest =
            serde_json::from_str(EXAMPLES[0].body).expect("the tests post every example");
        let snapshot = Snapshot::try_from(&request).map_err(Problem::Invalid)?;
        let (now, limit) = (Arrival(Instant::now()), self.planners.deadline());
        // As for a mission: that requests are turned away says nothing of missions.
        let planned = self.planners.plan_in_turn(|| Ok(snapshot), now, limit).await?;
        match planned.plan.degraded {
            None => Ok(()),
            Some(Degraded::Deadline) => Err(Problem::TimedOut),
            Some(why) => {
                let reason = format!("a plain snapshot was not solved: {why:?}");
                Err(Problem::NotReady(reason))
            }
        }
    }
}

/// Is the process alive?
#[utoipa::path(get, path = "/livez", tag = "service",
    responses((status = 200, description = "It is.", body = Health)))]
pub(crate) async fn livez() -> Json<Health> {
    Json(Health {
        status: "live".to_owned(),
    })
}

/// Can it plan, and store what missions hear? Tries both, and keeps the result for ten seconds.
#[utoipa::path(get, path = "/readyz", tag = "service", responses(
    (status = 200, description = "It can.", body = Health),
    (status = 503, description = "It cannot, it is about to stop, every planner is busy, or the mission log is damaged or cannot be written.", body = ProblemDocument,
        content_type = "application/problem+json"),
    (status = 504, description = "Not in time.", body = ProblemDocument,
        content_type = "application/problem+json")))]
pub(crate) async fn readyz(State(readiness): State<Readiness>) -> Result<Json<Health>, Problem> {
    readiness.check().await?;
    Ok(Json(Health {
        status: "ready".to_owned(),
    }))
}

/// What is it?
#[utoipa::path(get, path = "/version", tag = "service",
    responses((status = 200, description = "Name and versions.", body = Version)))]
pub(crate) async fn version() -> Json<Version> {
    Json(Version {
        name: "pilotfish".to_owned(),
        version: env!("CARGO_PKG_VERSION").to_owned(),
        schema_version: SCHEMA_VERSION.to_owned(),
    })
}
