//! How long missions are kept: those that are over, and those for which reports have ceased.

use std::time::Duration;

use super::{actor::Command, clock::unix_now, event::parsed, registry::Missions};
use crate::{
    problem::Problem,
    store::{EventReader, Order, StoreError},
};
use wire::mission::{Mission, Status};

/// How often it is looked which missions are due.
const LOOK: Duration = Duration::from_mins(10);

/// Whom the audit names.
const CALLER: &str = "the service";

/// How long missions are kept.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Retention {
    /// A mission that has been over for so long is deleted; none ever if not given.
    pub over: Option<Duration>,
    /// A live mission without a report for so long, or since the service was started, is finished; none ever if not given.
    pub abandoned: Option<Duration>,
}

/// What was done with missions that were due.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
struct Expired {
    deleted: Vec<String>,
    finished: Vec<String>,
}

impl Missions {
    /// Finishes and deletes missions that are due, now and then, for ever.
    pub async fn keep_for(self, retention: Retention) {
        if retention == Retention::default() {
            return;
        }
        loop {
            if let Err(problem) = self.expire(retention).await {
                tracing::warn!(?problem, "missions that are due stay for now");
            }
            tokio::time::sleep(LOOK).await;
        }
    }

    /// Finishes and deletes the missions that are due.
    async fn expire(&self, retention: Retention) -> Result<Expired, Problem> {
        let mut expired = Expired::default();
        if let Some(after) = retention.abandoned {
            const OPEN: [Status; 3] = [Status::Created, Status::Running, Status::Paused];
            let live = self.read(|reader| with_status(reader, &OPEN)).await?;
            for mission in live.into_iter().filter(|mission| mission.kind == "live") {
                if self.is_silent(&mission.id, after).await {
                    self.send(&mission.id, Command::Finish, None, Some(expire_order()))
                        .await?;
                    tracing::info!(mission = mission.id, "finished: no report came for too long");
                    expired.finished.push(mission.id);
                }
            }
        }
        if let Some(after) = retention.over {
            for id in self.read(move |reader| over_for(reader, after)).await? {
                self.delete(&id, expire_order()).await?;
                tracing::info!(mission = id, "deleted: it has been over for too long");
                expired.deleted.push(id);
            }
        }
        Ok(expired)
    }

    /// Whether no report came for so long, by a clock that is never set.
    async fn is_silent(&self, id: &str, after: Duration) -> bool {
        let handle = self.handle(id).await;
        handle.is_ok_and(|handle| after <= handle.view.borrow().reported.elapsed())
    }
}

/// Names of the missions that have been over for so long. Damaged ones are kept as they are.
pub fn over_for(reader: &EventReader, after: Duration) -> Result<Vec<String>, StoreError> {
    let mut over = with_status(reader, &[Status::Finished, Status::Failed])?;
    let now = unix_now();
    over.retain(|mission| after.as_secs_f64() <= now - mission.finished_s.unwrap_or(mission.created_s));
    Ok(over.into_iter().map(|mission| mission.id).collect())
}

fn with_status(reader: &EventReader, statuses: &[Status]) -> Result<Vec<Mission>, StoreError> {
    let mut all = vec![];
    for status in statuses {
        all.extend(reader.missions_with_status(status.name())?);
    }
    let whole = all.into_iter().flatten();
    Ok(whole
        .filter_map(|mission| parsed(&mission.summary).ok())
        .collect())
}

/// The service's own order to end or delete a mission that is due.
#[must_use]
pub fn expire_order() -> Order {
    Order {
        at_s: unix_now(),
        caller: CALLER.to_owned(),
        request: String::new(),
        action: "expire".to_owned(),
    }
}
