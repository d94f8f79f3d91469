//! What lists and single missions tell about the last plan, of missions that run here, and of others as they are stored.

use std::sync::Arc;

use super::{
    actor::{Checkpoint, LiveMission, StoredPlan},
    clock::MissionClock,
    event::parsed,
    registry::Missions,
    simulation,
};
use crate::{
    pool::Priority,
    problem::Problem,
    role::TokenLimit,
    store::{EventReader, StoreError, StoredMission},
};
use clock::Clock;
use wire::mission::{Mission, MissionList, PlanSummary, Status};

/// Longest list of missions, bytes of their stored form, except for a list of one.
const LIST_BYTES_MAX: usize = 64 << 10;

impl Missions {
    /// At most `most` missions after the one numbered `after`, and the number after which more follow. Of them, those within
    /// the caller's `limit`.
    pub(super) async fn list(
        &self,
        after: u64,
        most: usize,
        limit: Option<TokenLimit>,
    ) -> Result<MissionList, Problem> {
        let missions = self.clone();
        let page = move |reader: &EventReader| {
            let (stored, more) = reader.missions(after, most, LIST_BYTES_MAX)?;
            let plans = stored
                .iter()
                .map(|stored| match missions.stored_plan(reader, stored) {
                    Err(StoreError::Damaged(_)) => Ok(None),
                    plan => plan,
                });
            Ok((plans.collect::<Result<Vec<_>, _>>()?, stored, more))
        };
        let (plans, stored, more) = self.read(page).await?;
        let missions = self.clone();
        let is_within = move |mission: &Mission| {
            let named =
                |limit: &TokenLimit| limit.names(&mission.id) || limit.names_craft_of(&mission.metadata);
            limit.as_ref().is_none_or(named)
        };
        let list = move || MissionList {
            next: stored.last().filter(|_| more).map(|last| last.number),
            missions: stored
                .iter()
                .zip(plans)
                .filter_map(|(stored, plan)| missions.listed(stored, plan))
                .filter(is_within)
                .collect(),
        };
        // On a thread for long work: many clients may ask at once.
        self.planners.read_for_mission(Priority::Long, list).await
    }

    /// A mission with a summary of its last plan; none if it is damaged.
    fn listed(&self, stored: &StoredMission, plan: Option<PlanSummary>) -> Option<Mission> {
        let mission = stored.summary().and_then(parsed::<Mission>);
        let mission = mission.inspect_err(|error| self.store.note_damage(error.to_string()));
        mission.ok().map(|mission| Mission {
            plan: plan.or_else(|| self.last_plan(&stored.id)),
            ..mission
        })
    }

    /// A summary of the last plan of the mission `id`, if the mission is active.
    fn last_plan(&self, id: &str) -> Option<PlanSummary> {
        let (view, live) = {
            let actors = self.actors();
            let handle = actors.as_ref()?.get(id)?;
            (handle.view.clone(), handle.live.clone())
        };
        let view = view.borrow();
        let plan = view.plan.as_ref()?;
        Some(summary(
            plan,
            live.as_deref(),
            view.mission.t_s,
            view.waits_for.clone(),
            self.clock(),
        ))
    }

    /// The same of a mission that runs at another service, as it is stored.
    fn stored_plan(
        &self,
        reader: &EventReader,
        stored: &StoredMission,
    ) -> Result<Option<PlanSummary>, StoreError> {
        if !self.are_shared() || matches!(self.active(&stored.id), Ok(Some(_))) {
            return Ok(None);
        }
        let mission: Mission = parsed(stored.summary()?)?;
        let body = reader.snapshot(stored.number)?;
        let Some((_, body)) = body.filter(|_| mission.status == Status::Running) else {
            return Ok(None);
        };
        let Checkpoint { state, plan } = parsed(&body)?;
        let live = state.as_ref().map(|state| LiveMission {
            config: state.config().clone(),
            clock: MissionClock::new(mission.created_s, Some(state.config())),
        });
        let waits_for = live.as_ref().zip(state.as_ref());
        let waits_for = waits_for.map(|(live, state)| state.waits_for(live.clock.now(self.clock())));
        let summary = |plan: Arc<StoredPlan>| {
            summary(
                &plan,
                live.as_ref(),
                mission.t_s,
                waits_for.unwrap_or_default(),
                self.clock(),
            )
        };
        Ok(plan.map(summary))
    }

    /// The mission `id` as stored last, and what is known of its last plan.
    pub(super) async fn find_with_plan(&self, id: &str) -> Result<Mission, Problem> {
        let (missions, name) = (self.clone(), id.to_owned());
        let found = self.read(move |reader| {
            let Some(stored) = reader.mission(&name)? else {
                return Ok(None);
            };
            let plan = missions.stored_plan(reader, &stored)?;
            Ok(Some((stored, plan)))
        });
        let (stored, plan) = found.await?.ok_or(Problem::NoMission)?;
        let mission: Mission = parsed(stored.summary()?)?;
        Ok(Mission {
            plan: plan.or_else(|| self.last_plan(id)),
            ..mission
        })
    }
}

/// What a list tells about a plan of a mission whose clock shows `now` if it is simulated.
fn summary(
    plan: &StoredPlan,
    live: Option<&LiveMission>,
    now: f64,
    waits_for: Vec<String>,
    clock: &Clock,
) -> PlanSummary {
    let answer = &plan.answer.answer;
    let warnings = || answer.warnings.iter();
    PlanSummary {
        outcome: answer.outcome,
        reason: answer.reason.clone(),
        method: answer.method,
        age_s: plan.age(live, now, clock),
        period_s: live.map_or(simulation::PERIOD, |live| live.config.period_s),
        late_s: plan.late,
        warnings: warnings().map(|warning| warning.detail.clone()).collect(),
        warning_codes: warnings().map(|warning| warning.code.clone()).collect(),
        heard_s: plan.heard.clone(),
        waits_for,
    }
}
