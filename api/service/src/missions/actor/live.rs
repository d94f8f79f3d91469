//! A live mission: it plans once a period from the reports so far, even without new ones.

use std::sync::Arc;
use std::time::{Duration, Instant};

use clock::Clock;
use planner::{fleet::SlotUse, stop::Stop};

use super::{Actor, Checkpoint, Command, Context, IdempotencyKey, LiveMission, StoredPlan};
use crate::{
    edge::{arrival::Arrival, problem::Problem},
    metrics::{Counted, PlanFor},
    missions::{
        check,
        clock::{ClockWatch, MissionClock},
        craft_state::Left,
        event::Event,
        facts::Facts,
        memory::bytes_of,
        own_craft::{Berth, Craft, OwnCraft},
        state::{AbsenceOf, MissionState},
    },
    planning::pool::Priority,
};
use wire::mission::{Assigned, Reports, Setting, SteeringState};
use wire::{FieldError, Method, Origin, Outcome, PlanResponse};

/// Most events after a checkpoint: a restart reads them one by one.
const EVENTS_PER_CHECKPOINT_MAX: u32 = 64;

/// Most points of a plan that other missions see.
const PLAN_POINTS: usize = 16;

pub(in crate::missions) struct Live {
    context: Context,
    state: Arc<MissionState>,
    mission: Arc<LiveMission>,
    /// Real time between two plans.
    period: Duration,
    due: Instant,
    since_checkpoint: u32,
    watch: ClockWatch,
    /// Where other missions see the craft, and what the last plan saw of theirs.
    berth: Berth,
    own_craft: OwnCraft,
    /// Counts the mission while its craft does not follow.
    does_not_follow: Option<Counted>,
}

impl Live {
    pub(in crate::missions) fn new(
        context: Context,
        mission: Arc<LiveMission>,
        state: MissionState,
        berth: Berth,
    ) -> Self {
        let LiveMission { config, clock } = &*mission;
        let mut this = Self {
            due: next_due(clock, config.period_s, context.clock()),
            period: Duration::from_secs_f64(config.period_s / config.clock_rate),
            watch: ClockWatch::new(context.clock()),
            context,
            state: Arc::new(state),
            mission,
            since_checkpoint: 0,
            berth,
            own_craft: OwnCraft::default(),
            does_not_follow: None,
        };
        this.show_heard();
        this.count_does_not_follow();
        this
    }
}

impl Actor for Live {
    fn context(&mut self) -> &mut Context {
        &mut self.context
    }

    fn due(&self) -> Instant {
        self.due
    }

    async fn execute(&mut self, command: Command, key: Option<IdempotencyKey>) -> Result<Vec<u8>, Problem> {
        let at_s = self.context.clock().unix_s();
        let event = match command {
            Command::Step(_) => {
                let why = "a live mission runs by the clock; only simulated missions take steps";
                return Err(Problem::conflict(why));
            }
            Command::Run(Some(_)) => {
                let why = "a live mission runs in real time; only simulated missions take a speed_factor";
                return Err(Problem::conflict(why));
            }
            Command::Run(None) if self.context.is_running() => return self.context.unchanged(key).await,
            // Another request has set another origin. This one, repeated, is read with that.
            Command::Report(_, Some(origin)) | Command::Change(_, Some(origin))
                if self.state.origin() != Some(origin) =>
            {
                return Err(Problem::Behind);
            }
            // The craft has left the fleet since the reports were read.
            Command::Report(heard, _) if self.state.craft(heard.craft.as_deref()).is_none() => {
                return Err(Problem::Behind);
            }
            Command::Report(mut heard, read_with) => {
                self.check_origin(&heard, read_with)?;
                self.state.place_ranges(&mut heard);
                if heard.is_empty() {
                    return Err(Problem::Invalid(heard.rejected));
                }
                return self.append_and_apply(Event::Reported { at_s, heard }, key).await;
            }
            Command::Change(setting, _) => return self.change(at_s, setting, key).await,
            Command::Run(None) => {
                let LiveMission { config, clock } = &*self.mission;
                self.due = next_due(clock, config.period_s, self.context.clock());
                let speed_factor = None;
                Event::Ran { at_s, speed_factor }
            }
            Command::Pause => Event::Paused { at_s },
            Command::Finish => Event::Finished { at_s },
        };
        let stored = self.context.append(&[event], key, None).await?;
        self.since_checkpoint += u32::from(stored.is_new);
        self.count_does_not_follow();
        self.show_to_others(false);
        Ok(stored.answer)
    }

    async fn advance(&mut self) {
        let due = self.due;
        self.set_next_due();
        self.note_clock_set().await;
        let now = self.mission.clock.now(self.context.clock());
        if !self.state.waits_for(now).is_empty() {
            return self.show_heard();
        }
        if !self.context.may_plan() {
            return self.miss(1);
        }
        if let Err(problem) = self.plan_at(now, due).await {
            tracing::warn!(mission = self.context.mission.id, ?problem, "no plan");
            self.miss(1);
        }
    }
}

impl Live {
    /// Fails for reports that were read before the mission's origin was known, with another one or
    /// none.
    fn check_origin(&self, heard: &Reports, read_with: Option<Origin>) -> Result<(), Problem> {
        match (heard.origin, self.state.origin()) {
            (None, None) => Ok(()),
            (None, Some(_)) if read_with.is_some() || heard.is_complete() => Ok(()),
            (Some(_), None) if self.state.may_begin() => Ok(()),
            // Another request set the origin. This one, repeated, is read with that.
            (_, Some(_)) => Err(Problem::Behind),
            (Some(_), None) => {
                let detail = "the mission has positions in metres from an unknown datum: give metres, or create a mission \
                    with an `origin`";
                Err(Problem::Invalid(vec![FieldError::new("", "no_origin", detail)]))
            }
        }
    }

    /// Changes the setting, if the result is valid. A change without effect stores nothing.
    async fn change(
        &mut self,
        at_s: f64,
        mut setting: Box<Setting>,
        key: Option<IdempotencyKey>,
    ) -> Result<Vec<u8>, Problem> {
        let mut config = self.state.config().clone();
        check::patch_of(&config, &setting).map_err(Problem::Invalid)?;
        let origin = setting.origin.flatten().filter(|new| config.origin != Some(*new));
        if let Some(origin) = origin {
            config.count_from(origin);
            // Their metres change: the event and the setting show clients the new ones.
            setting.keep_outs.get_or_insert(config.keep_outs.clone());
            setting.no_go.get_or_insert(config.no_go.clone());
            setting.area.get_or_insert(config.area.clone());
        }
        let mut replaced = setting.clone();
        replaced.exchange_with(&mut self.state.config().clone());
        if replaced == setting {
            return self.context.unchanged(key).await;
        }
        setting.clone().exchange_with(&mut config);
        let bytes = self.bytes_with(&config).max(self.bytes_with(self.state.config()));
        // Checked here and not in the handler, so that no other change comes in between.
        let patch = setting.clone();
        let check = move || check::changed(&config, &patch, origin.is_some());
        let checked = self.context.planners.read_for_mission(Priority::Mission, check);
        checked.await?.map_err(Problem::Invalid)?;
        self.context.hold(bytes)?;
        let event = Event::Changed { at_s, setting, replaced };
        let answer = self.append_and_apply(event, key).await;
        self.context.hold(self.bytes_with(self.state.config()))?;
        answer
    }

    fn bytes_with(&self, config: &wire::mission::Live) -> usize {
        bytes_of(&self.mission.config, config)
    }

    /// Stores an event that changes the state, and applies it.
    async fn append_and_apply(
        &mut self,
        event: Event,
        key: Option<IdempotencyKey>,
    ) -> Result<Vec<u8>, Problem> {
        // Plans and changes store checkpoints. Without them, reports store one now and then.
        let is_due =
            EVENTS_PER_CHECKPOINT_MAX <= self.since_checkpoint || matches!(event, Event::Changed { .. });
        let after = is_due.then(|| {
            let mut after = MissionState::clone(&self.state);
            after.apply(&event, &self.mission.clock);
            after
        });
        let checkpoint =
            after.as_ref().map(|after| Checkpoint::new(Some(after), &self.context.view.borrow().plans));
        let events = [event];
        let stored = self.context.append(&events, key, checkpoint).await?;
        if stored.is_new {
            if let Some(after) = after {
                (self.state, self.since_checkpoint) = (Arc::new(after), 0);
            } else {
                Arc::make_mut(&mut self.state).apply(&events[0], &self.mission.clock);
                self.since_checkpoint += 1;
            }
            self.show_heard();
        }
        Ok(stored.answer)
    }

    /// Makes a plan of each craft at `now`, s, and stores them. All vehicles have been heard.
    async fn plan_at(&mut self, now: f64, due: Instant) -> Result<(), Problem> {
        let made_at = self.context.clock().now();
        let state = Arc::clone(&self.state);
        if self.is_among_others() {
            self.own_craft = self.berth.look(now, state.traffic().vessels(), &self.own_craft);
        }
        let own = self.own_craft.clone();
        let parameters = Arc::clone(&self.context.planners.parameters);
        let facts = move |share: &dyn Fn(usize) -> Stop| {
            let facts = Facts::of(&state, (now, &own), &parameters, share);
            facts.expect("waits for no vehicle").map_err(Problem::Invalid)
        };
        // The other half of the period is for the disk and for other missions.
        let (planners, limit) = (&self.context.planners, self.period / 2);
        let planned = planners.plan_in_turn(facts, |facts, plan| facts.plans(plan), Arrival(due), limit);
        let (facts, made) = planned.await?;
        let late = self.context.clock().since(due);
        let (origin, heard) = (self.state.origin(), self.state.heard());
        let (mut events, mut plans, mut left) = (vec![], vec![], vec![]);
        let mut cut_short = facts.assigned().is_some_and(|assigned| assigned.cut_short);
        for craft in &made {
            let id = craft.id.clone();
            let written = facts.written(craft, origin);
            let (mut event, answer, previous) = written.planned(now, late, &craft.made);
            // The craft after one whose plan cannot be repeated saw that.
            cut_short |= event.cut_short.is_some();
            event.cut_short =
                cut_short.then(|| event.cut_short.take().unwrap_or_else(|| Box::new(previous.clone())));
            event.craft.clone_from(&id);
            if events.is_empty() {
                event.own_craft = self.own_craft.clone();
            }
            let strays = id.is_some() && !answer.answer.craft_estimate.follows;
            left.push((id.clone(), Left { previous_plan: Some(previous), strays }));
            events.push(Event::Planned(Box::new(event)));
            plans.push(Arc::new(StoredPlan {
                craft: id,
                sequence: self.context.mission.sequence + events.len() as u64,
                time: now,
                late: late.as_secs_f64(),
                answer,
                heard: heard.clone(),
                made: Some(made_at),
            }));
        }
        let news = facts.news(self.state.assigned());
        events.extend(news.clone().map(|news| Event::Assigned(Box::new(news))));
        let after = (left, facts.absences(), news.map(Box::new));
        self.store_plans(events, plans, after, facts.slots()).await?;
        let metrics = &self.context.planners.metrics;
        for craft in &made {
            metrics.plan(PlanFor::Live, &craft.made.plan, craft.made.solve_time);
        }
        metrics.late(late);
        self.show_to_others(true);
        self.count_does_not_follow();
        self.since_checkpoint = 0;
        Ok(())
    }

    /// Stores the events of `plans` with what they leave to the state, and shows them.
    async fn store_plans(
        &mut self,
        events: Vec<Event>,
        plans: Vec<Arc<StoredPlan>>,
        after: AfterPlans,
        slots: Vec<Vec<SlotUse>>,
    ) -> Result<(), Problem> {
        let is_assigned = after.2.is_some();
        let mut before = exchange(Arc::make_mut(&mut self.state), after);
        let shown = self.context.with_others(plans.clone(), |id| self.state.craft(id).is_some());
        let checkpoint = Checkpoint::new(Some(&*self.state), &shown);
        if let Err(problem) = self.context.append(&events, None, Some(checkpoint)).await {
            // The next plan follows the last one that is stored.
            let (state, assigned) = (Arc::make_mut(&mut self.state), before.2.take());
            exchange(state, before);
            if is_assigned {
                state.replace_assigned(assigned);
            }
            return Err(problem);
        }
        for plan in &plans {
            self.log_changes(plan);
        }
        self.context.show(shown, slots);
        if is_assigned {
            tracing::info!(mission = self.context.mission.id, "AUVs are assigned");
            self.show_heard();
        }
        Ok(())
    }

    /// Stores an event if the clock was set since the last plan: older reports do not match then.
    async fn note_clock_set(&mut self) {
        let Some(by_s) = self.watch.set_by(self.context.clock()) else {
            return;
        };
        tracing::warn!(mission = self.context.mission.id, by_s, "the clock was set");
        let at_s = self.context.clock().unix_s();
        let events = [Event::ClockSet { at_s, by_s }];
        match self.context.append(&events, None, None).await {
            Ok(_) => self.since_checkpoint += 1,
            Err(problem) => tracing::warn!(?problem, "the change of the clock was not stored"),
        }
    }

    /// The next plan is due a period after this one. Plans whose time has passed are missed.
    fn set_next_due(&mut self) {
        let now = self.context.clock().now();
        self.due += self.period;
        let mut missed = 0;
        while self.due < now {
            self.due += self.period;
            missed += 1;
        }
        if 0 < missed {
            self.miss(missed);
        }
    }

    /// Logs changes in whether plans are degraded and the craft follows.
    fn log_changes(&self, newest: &StoredPlan) {
        let (mission, craft) = (&self.context.mission.id, newest.craft.as_deref());
        let before = self.context.view.borrow().plan(newest.craft.as_deref()).cloned();
        let degraded = |plan: &StoredPlan| plan.answer.answer.outcome == Outcome::Degraded;
        match (before.as_deref().is_some_and(degraded), degraded(newest)) {
            (false, true) => {
                let reason = newest.answer.answer.reason.as_deref();
                tracing::warn!(mission, craft, reason, "plans are degraded");
            }
            (true, false) => tracing::info!(mission, craft, "plans are no longer degraded"),
            (false, false) | (true, true) => {}
        }
        match (before.as_deref().is_none_or(follows), follows(newest)) {
            (true, false) => tracing::warn!(mission, craft, "the craft does not follow"),
            (false, true) => tracing::info!(mission, craft, "the craft follows again"),
            (true, true) | (false, false) => {}
        }
    }

    /// Counts the mission while it runs and its newest plan warns that the craft does not follow.
    fn count_does_not_follow(&mut self) {
        let view = self.context.view.borrow();
        let newest = view.plans.iter().map(|plan| plan.time).fold(f64::NEG_INFINITY, f64::max);
        let does_follow = view.plans.iter().all(|plan| plan.time < newest || follows(plan));
        drop(view);
        let warns = self.context.is_running() && !does_follow;
        if warns != self.does_not_follow.is_some() {
            let metrics = &self.context.planners.metrics;
            self.does_not_follow = warns.then(|| metrics.does_not_follow());
        }
    }

    fn miss(&self, plans: u64) {
        self.context.planners.metrics.missed(plans);
        self.context.view.send_modify(|view| view.missed += plans);
    }

    /// `true` for missions whose clock the others share.
    fn is_among_others(&self) -> bool {
        self.mission.clock.rate == 1.0
    }

    /// Shows the craft to other missions of the service, if it has a place on Earth; `is_planned`
    /// if its plan is of now.
    fn show_to_others(&self, is_planned: bool) {
        if self.context.mission.status.is_over() {
            return self.berth.leave();
        }
        let Some(origin) = self.state.origin().filter(|_| self.is_among_others()) else { return };
        let view = self.context.view.borrow();
        let newest = view.plans.iter().map(|plan| plan.time).fold(f64::NEG_INFINITY, f64::max);
        let mut shown = vec![];
        for (place, (id, known)) in self.state.each_craft().enumerate() {
            let (Some(asc), Some(velocity)) = (known.asc.as_ref(), known.velocity()) else { continue };
            let (Some(lat_deg), Some(lon_deg)) = (asc.state.lat_deg, asc.state.lon_deg) else { continue };
            let plan = view.plan(id);
            let is_planned = is_planned && plan.is_some_and(|plan| newest <= plan.time);
            let answer = plan.map(|plan| &plan.answer.answer);
            let follows = |answer: &PlanResponse| {
                let gives_way = answer.outcome == Outcome::Ok && answer.method != Method::Hold;
                gives_way && answer.craft_estimate.follows && asc.steered
            };
            let steering = known.steering.as_ref().is_none_or(|said| said.state == SteeringState::Steering);
            // A plan from before the origin changed has other coordinates.
            let placed = answer.filter(|answer| answer.origin.is_some_and(|of| of == origin));
            let trajectory = placed.map_or(&[][..], |answer| &answer.trajectory);
            let step = trajectory.len().div_ceil(PLAN_POINTS).max(1);
            let points = trajectory.iter().skip(step).step_by(step);
            let craft = Craft {
                mission: Arc::clone(&self.context.mission),
                id: id.map(str::to_owned),
                origin,
                place: Origin { lat_deg, lon_deg },
                t_s: asc.t_s,
                position: asc.state.position(),
                velocity,
                plan: points.map(|point| [point.t_s, point.north_m, point.east_m]).collect(),
                period: self.mission.config.period_s,
                is_orderly: is_planned && steering && answer.is_some_and(follows),
            };
            shown.push((place, craft));
        }
        self.berth.show(shown, self.context.clock().unix_s());
    }

    fn show_heard(&self) {
        self.show_to_others(false);
        let now = self.mission.clock.now(self.context.clock());
        let (waits_for, fleet) = (self.state.waits_for(now), self.state.fleet_view(now));
        self.context.view.send_if_modified(|view| {
            let changed = view.waits_for != waits_for;
            (view.waits_for, view.fleet) = (waits_for, fleet);
            view.steering = self.state.steering().cloned();
            changed
        });
    }
}

/// Parts of the state that plans replace: memories of the craft, their absences, and a new
/// assignment.
type AfterPlans = (Vec<(Option<String>, Left)>, AbsenceOf, Option<Box<Assigned>>);

/// Replaces these parts of the state, and returns the previous ones.
fn exchange(state: &mut MissionState, (left, absences, assigned): AfterPlans) -> AfterPlans {
    let left = left.into_iter().filter_map(|(id, left)| {
        let before = state.craft_mut(id.as_deref())?.replace_left(left);
        Some((id, before))
    });
    let left = left.collect();
    let assigned = assigned.and_then(|assigned| state.replace_assigned(Some(assigned)));
    (left, state.replace_absences(absences), assigned)
}

fn follows(plan: &StoredPlan) -> bool {
    plan.answer.answer.craft_estimate.follows
}

/// The next whole period since the mission's creation, so that a restart aligns no missions.
fn next_due(clock: &MissionClock, period: f64, machine: &Clock) -> Instant {
    let since = (clock.now(machine) - clock.created) / period;
    let left = (since.ceil() - since).clamp(0.0, 1.0) * period / clock.rate;
    machine.now() + Duration::from_secs_f64(left)
}
