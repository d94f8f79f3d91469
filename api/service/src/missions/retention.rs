//! Retention: deletes old finished missions, and finishes live missions without reports.
//!
//! The store's trusted time decides the age of missions: a wrong clock deletes nothing.

use std::{panic::AssertUnwindSafe, time::Duration};

use clock::Clock;
use futures_util::FutureExt as _;

use super::{actor::Command, event::parsed, if_match::IfMatch, registry::Missions};
use store::{AuditEntry, EventReader, StoreError, StoredMission};

use crate::edge::problem::Problem;
use wire::mission::{Mission, Status};

/// Time between two checks for missions that are due.
const CHECK: Duration = Duration::from_mins(10);

/// Shortest remaining time of a disk without a warning.
const SHORT: Duration = Duration::from_hours(7 * 24);

/// The caller of these orders in the audit list.
const CALLER: &str = "the service";

/// Times for which missions are kept.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Retention {
    /// Time from a mission's end to its deletion, by the trusted time; unlimited without one.
    pub over: Option<Duration>,
    /// Time from a live mission's last report, or this start, to its end; unlimited without.
    pub abandoned: Option<Duration>,
}

#[derive(Clone, Debug, Default, PartialEq, Eq)]
struct Expired {
    deleted: Vec<String>,
    finished: Vec<String>,
}

impl Missions {
    /// Repeatedly follows the machine's clocks, and finishes and deletes missions that are due.
    pub async fn keep_for(self, retention: Retention) {
        let mut measured = None;
        loop {
            let lasts = self.store.disk_lasts(&mut measured);
            if let Some(lasts) = lasts.filter(|lasts| *lasts < SHORT) {
                let hours = lasts.as_secs() / 3600;
                tracing::warn!(
                    hours,
                    "at the present rate the disk of the mission log is full after so many hours"
                );
            }
            if let Err(error) = self.store.read_clocks().await {
                tracing::warn!(%error, "the trusted time was not stored");
            }
            if let Err(problem) = or_panicked(self.expire(retention)).await {
                tracing::warn!(?problem, "missions that are due were not all finished or deleted");
            }
            self.planners.clock.sleep(CHECK).await;
        }
    }

    async fn expire(&self, retention: Retention) -> Result<Expired, Problem> {
        let mut expired = Expired::default();
        if let Some(after) = retention.abandoned {
            const OPEN: [Status; 3] = [Status::Created, Status::Running, Status::Paused];
            let live = self.read(|reader| with_status(reader, &OPEN)).await?;
            for mission in live.into_iter().filter(|mission| mission.kind == "live") {
                if self.is_silent(&mission, after).await {
                    let order = Some(expire_order(&self.planners.clock));
                    let finish = self.send(&mission.id, Command::Finish, None, IfMatch::default(), order);
                    finish.await?;
                    tracing::info!(mission = mission.id, "finished: no report within abandoned_hours");
                    expired.finished.push(mission.id);
                }
            }
        }
        if let Some(after) = retention.over {
            let before_s = self.store.clock().now_s() - after.as_secs_f64();
            for id in self.read(move |reader| reader.over_before(before_s)).await? {
                let order = expire_order(&self.planners.clock);
                match self.delete(&id, &IfMatch::default(), order).await {
                    // Another service that shares the store was faster.
                    Err(Problem::NoMission) => continue,
                    deleted => deleted?,
                }
                tracing::info!(mission = id, "deleted: finished for longer than keep_days");
                expired.deleted.push(id);
            }
        }
        Ok(expired)
    }

    /// `true` if no report came for `after`, by a monotonic clock.
    async fn is_silent(&self, mission: &Mission, after: Duration) -> bool {
        let handle = if self.are_shared() && mission.status == Status::Running {
            // Each service judges its own missions: a handle would take over another's.
            self.active(&mission.id).ok().flatten()
        } else {
            self.handle(&mission.id).await.ok()
        };
        handle.is_some_and(|handle| after <= self.planners.clock.since(handle.view.borrow().reported))
    }
}

/// The result of `work`; a panic is an error too, and the next round tries again.
async fn or_panicked<T>(work: impl Future<Output = Result<T, Problem>>) -> Result<T, Problem> {
    let caught = AssertUnwindSafe(work).catch_unwind().await;
    caught.unwrap_or(Err(Problem::Panicked))
}

fn with_status(reader: &EventReader, statuses: &[Status]) -> Result<Vec<Mission>, StoreError> {
    let mut all = vec![];
    for status in statuses {
        all.extend(reader.missions_with_status(status.name())?);
    }
    let whole = |mission: &StoredMission| mission.summary().and_then(parsed).ok();
    Ok(all.iter().filter_map(whole).collect())
}

/// The service's order to finish or delete a mission that is due.
pub fn expire_order(clock: &Clock) -> AuditEntry {
    AuditEntry {
        at_s: clock.unix_s(),
        caller: CALLER.to_owned(),
        request: String::new(),
        action: "expire".to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test(start_paused = true)]
    async fn a_round_that_panics_is_a_problem_and_the_next_round_runs() {
        let panics = async { panic!("a test wants this panic") };
        assert_eq!(or_panicked::<()>(panics).await, Err(Problem::Panicked));
        assert_eq!(or_panicked(async { Ok(1) }).await, Ok(1));
    }
}
