//! Missions in lists and single answers, with the last plan and the last report of steering.

use std::sync::Arc;

use super::actor::{Checkpoint, LiveMission, StoredPlan, leading};
use super::clock::MissionClock;
use super::craft_state::CraftView;
use super::event::parsed;
use super::registry::Missions;
use super::simulation;
use super::state::MissionState;
use store::{EventReader, StoreError, StoredMission};

use crate::edge::problem::Problem;
use crate::edge::role::TokenLimit;
use crate::limits::LIST_BYTES_MAX;
use crate::planning::pool::Priority;
use clock::Clock;
use wire::mission::{CraftSummary, LastSteering, Mission, MissionList, PlanSummary, Status, Steering};

impl Missions {
    /// Lists those of the `most` missions after number `after` that the caller's `limit` allows,
    /// and the number after which more follow.
    pub(super) async fn list(
        &self,
        after: u64,
        most: usize,
        limit: Option<TokenLimit>,
    ) -> Result<MissionList, Problem> {
        let missions = self.clone();
        let page = move |reader: &EventReader| {
            let (stored, more) = reader.missions(after, most, LIST_BYTES_MAX)?;
            let known = |stored: &StoredMission| match missions.stored_last(reader, stored) {
                Err(StoreError::Damaged(_)) => Ok(None),
                last => last,
            };
            let known = stored.iter().map(known).collect::<Result<Vec<_>, _>>()?;
            Ok((known, stored, more))
        };
        let (known, stored, more) = self.read(page).await?;
        let missions = self.clone();
        let is_within =
            move |mission: &Mission| limit.as_ref().is_none_or(|limit: &TokenLimit| limit.sees(mission));
        let list = move || {
            let all = stored.iter().zip(known);
            let listed = all.filter_map(|(stored, last)| missions.listed(stored, last));
            MissionList {
                missions: listed.filter(is_within).collect(),
                next: stored.last().filter(|_| more).map(|last| last.number),
            }
        };
        // On a thread for long work: many clients may ask at once.
        self.planners.read_for_mission(Priority::Long, list).await
    }

    /// A mission with its last plan and steering; `None` if it is damaged.
    fn listed(&self, stored: &StoredMission, last: Option<LastValues>) -> Option<Mission> {
        let mission = stored.summary().and_then(parsed::<Mission>);
        let mission = mission.inspect_err(|error| self.store.note_damage(error.to_string()));
        mission.ok().map(|mission| self.with(last, mission))
    }

    /// The mission with its last plan and steering.
    fn with(&self, last: Option<LastValues>, mission: Mission) -> Mission {
        let last = last.or_else(|| self.last(&mission.id)).unwrap_or_default();
        let LastValues { plan, steering, surface_craft } = last;
        Mission { plan, steering, surface_craft, ..mission }
    }

    /// The last plan and steering of the mission `id`, if it is active.
    fn last(&self, id: &str) -> Option<LastValues> {
        let (view, live) = {
            let actors = self.actors();
            let handle = actors.as_ref()?.get(id)?;
            (handle.view.clone(), handle.live.clone())
        };
        let view = view.borrow();
        let (live, clock) = (live.as_deref(), self.clock());
        let now = live.map_or(view.mission.t_s, |live| live.clock.now(clock));
        let waits_for = &view.waits_for;
        let summary = |plan: &StoredPlan| summary(plan, live, view.mission.t_s, waits_for.clone(), clock);
        Some(LastValues::of((&view.plans, &view.fleet), view.steering.as_ref(), now, summary))
    }

    /// The last values of a mission that runs at another service, from the store.
    fn stored_last(
        &self,
        reader: &EventReader,
        stored: &StoredMission,
    ) -> Result<Option<LastValues>, StoreError> {
        if !self.are_shared() || matches!(self.active(&stored.id), Ok(Some(_))) {
            return Ok(None);
        }
        let mission: Mission = parsed(stored.summary()?)?;
        let body = reader.snapshot(stored.number)?;
        let Some((_, body)) = body.filter(|_| mission.status == Status::Running) else {
            return Ok(None);
        };
        let checkpoint: Checkpoint = parsed(&body)?;
        let (mut live, mut waits_for, mut now) = (None, vec![], mission.t_s);
        if let Some(state) = &checkpoint.state {
            let clock = MissionClock::new(mission.created_s, Some(state.config()));
            now = clock.now(self.clock());
            waits_for = state.waits_for(now);
            live = Some(LiveMission { config: state.config().clone(), clock });
        }
        let state = checkpoint.state.as_ref();
        let fleet = state.map_or_else(Vec::new, |state| state.fleet_view(now));
        let steering = state.and_then(MissionState::steering);
        let summary =
            |plan: &StoredPlan| summary(plan, live.as_ref(), mission.t_s, waits_for.clone(), self.clock());
        Ok(Some(LastValues::of((&checkpoint.plans(), &fleet), steering, now, summary)))
    }

    pub(super) async fn find_with_plan(&self, id: &str) -> Result<Mission, Problem> {
        let (missions, name) = (self.clone(), id.to_owned());
        let found = self.read(move |reader| {
            let Some(stored) = reader.mission(&name)? else {
                return Ok(None);
            };
            let last = missions.stored_last(reader, &stored)?;
            Ok(Some((stored, last)))
        });
        let (stored, last) = found.await?.ok_or(Problem::NoMission)?;
        Ok(self.with(last, parsed(stored.summary()?)?))
    }
}

/// The last plan, the last report of whether the craft is steered, and both of each of a fleet.
#[derive(Default)]
struct LastValues {
    plan: Option<PlanSummary>,
    steering: Option<LastSteering>,
    surface_craft: Vec<CraftSummary>,
}

impl LastValues {
    /// The values at `now` on the mission's clock, s.
    fn of(
        (plans, fleet): (&[Arc<StoredPlan>], &[CraftView]),
        steering: Option<&Steering>,
        now: f64,
        summary: impl Fn(&StoredPlan) -> PlanSummary,
    ) -> Self {
        let of_craft = |craft: &CraftView| {
            let plan = plans.iter().find(|plan| plan.craft.as_ref() == Some(&craft.id));
            CraftSummary {
                id: craft.id.clone(),
                auvs: craft.auvs.clone(),
                away: craft.away,
                plan: plan.map(|plan| summary(plan)),
                steering: craft.steering.as_ref().map(|said| said.at(now)),
                battery: craft.battery,
            }
        };
        Self {
            plan: leading(plans).map(|plan| summary(plan)),
            steering: steering.map(|said| said.at(now)),
            surface_craft: fleet.iter().map(of_craft).collect(),
        }
    }
}

/// A plan's entry in lists. A simulated mission's clock shows `now`.
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
