//! All missions: active ones have an actor, the others are in the event store only.

use std::{
    collections::HashMap,
    sync::{Arc, Mutex, MutexGuard, PoisonError},
    time::Duration,
};

use serde_json::{Map, Value};
use tokio::{
    sync::{Semaphore, mpsc::error::TrySendError, oneshot},
    task::spawn_blocking,
    time::timeout,
};
use tracing::Span;

use super::{
    actor::{
        Checkpoint, Command, Context, Handle, IdempotencyKey, LiveMission, Request, live::Live, run,
        simulated::Simulated,
    },
    check,
    clock::Clock,
    event::{Event, created, json, parsed},
    if_match::IfMatch,
    simulation,
    state::MissionState,
};
use crate::{
    metrics::Shed,
    planners::Planners,
    pool::Priority,
    problem::Problem,
    quota::{Quota, QuotaExceeded},
    request_id::new_id,
    role::TokenLimit,
    store::{Append, Appended, AuditEntry, EventReader, EventStore, Room, StoreError, StoredMission},
    unix_time::unix_now,
};
use wire::{
    Origin,
    mission::{Mission, MissionList, NewMission, PlanSummary, Reports, Setting, Status},
    sha256,
};

/// Most active missions: more than two processors can plan for once a second.
const ACTORS_MAX: usize = 1_024;

/// Hexadecimal digits of a mission's id.
const ID_DIGITS: usize = 24;

/// Most missions of one client that are not over.
const OPEN_SHARE: usize = ACTORS_MAX / 2;

/// Longest list of missions, bytes of their stored form, except for a list of one.
const LIST_BYTES_MAX: usize = 64 << 10;

/// Most readers of event streams.
const STREAMS_MAX: usize = 256;

/// Most records written at the same time, each on its own thread and in at most 9 MB.
const RECORDS_MAX: usize = 16;

/// Most threads that read the store.
const READERS_MAX: usize = 16;

/// Longest wait of a client for the check of a simulation.
const CHECK_TIME: Duration = Duration::from_secs(5);

/// Longest wait of a client for a mission's reply.
const ANSWER_TIME: Duration = Duration::from_secs(10);

/// Every mission of a data directory. Clones share them.
#[derive(Clone, Debug)]
pub struct Missions {
    store: EventStore,
    planners: Planners,
    /// Handles of active missions, by id. None once the service stops.
    actors: Arc<Mutex<Option<HashMap<String, Handle>>>>,
    /// The store's salt.
    salt: Arc<[u8]>,
    pub(super) streams: Quota<Arc<str>>,
    pub(super) records: Quota<Arc<str>>,
    reading: Arc<Semaphore>,
}

impl Missions {
    /// The missions of `store`. Those that were running continue.
    pub(crate) async fn resume(store: EventStore, planners: Planners) -> Result<Self, StoreError> {
        let salt = store.reader()?.salt()?.into();
        let missions = Self {
            salt,
            store,
            planners,
            actors: Arc::new(Mutex::new(Some(HashMap::new()))),
            streams: Quota::new(STREAMS_MAX),
            records: Quota::new(RECORDS_MAX),
            reading: Arc::new(Semaphore::new(READERS_MAX)),
        };
        let running = missions
            .store
            .reader()?
            .missions_with_status(Status::Running.name())?;
        let n_running = running.len();
        for mission in running {
            let id = mission.id.clone();
            if let Err(problem) = missions.start_actor(mission).await {
                // A damaged mission does not stop the others; its clients get the error.
                tracing::error!(mission = id, ?problem, "the mission does not continue");
            }
        }
        if 0 < n_running {
            tracing::info!(n_running, "missions continue");
        }
        let store = missions.store.clone();
        std::thread::spawn(move || store.inspect());
        Ok(missions)
    }

    /// Ends every actor and every stream. The next start continues from what is stored.
    pub fn close(&self) {
        *self.actors() = None;
    }

    /// Closes the event store once everything is stored. Call it after [`Self::close`] and the last request.
    pub async fn close_store(&self) -> Result<(), StoreError> {
        self.store.close().await
    }

    /// Reads the machine's clocks, and stores the trusted time.
    pub(super) async fn read_clocks(&self) -> Result<(), StoreError> {
        self.store.read_clocks().await
    }

    /// The trusted time, Unix time, s.
    pub(super) fn now_trusted_s(&self) -> f64 {
        self.store.clock().now_s()
    }

    /// Fails if nothing can be stored.
    pub(crate) async fn probe(&self) -> Result<(), StoreError> {
        self.store.probe().await
    }

    /// Creates a mission.
    pub(super) async fn create(
        &self,
        new: NewMission,
        key: Option<IdempotencyKey>,
        order: AuditEntry,
    ) -> Result<Mission, Problem> {
        // Earlier versions derived the id from the key without a salt.
        if let Some(key) = &key
            && let Some(before) = key
                .answered(
                    &self.store,
                    &format!("m-{}", &sha256(format!("key {}", key.key).as_bytes())[..16]),
                )
                .await?
        {
            return Ok(parsed(&before)?);
        }
        let caller = order.caller.clone();
        if OPEN_SHARE <= self.read(move |reader| reader.count_open(&caller)).await? {
            return Err(Problem::Share {
                what: "missions that are not over",
                limit: OPEN_SHARE,
            });
        }
        let is_simulated = new.simulated.is_some();
        let check = move || check::new_mission(&new).map(|()| new);
        // The check of a simulated mission starts its scenario, so it runs where simulations run.
        let new = if is_simulated {
            let checked = timeout(CHECK_TIME, self.planners.simulate(check)).await;
            checked.map_err(|_| self.planners.too_late())??
        } else {
            self.planners.read_for_mission(Priority::Long, check).await?
        };
        let new = new.map_err(Problem::Invalid)?;
        let at_s = unix_now();
        let id = self.mission_id(&key.as_ref().map_or_else(
            || format!("{} {at_s}", new_id()),
            |key| format!("key {}", key.key),
        ));
        let mission = Mission {
            title: new.title().unwrap_or_else(|| id.clone()),
            kind: if new.live.is_some() { "live" } else { "simulated" }.to_owned(),
            status: Status::Created,
            created_s: at_s,
            started_s: None,
            finished_s: None,
            t_s: if new.live.is_some() { at_s } else { 0.0 },
            speed_factor: None,
            sequence: 1,
            revision: 1,
            setting: new.live.as_ref().map(Setting::from),
            origin: new.live.as_ref().and_then(|live| live.origin),
            metadata: new.metadata.clone(),
            plan: None,
            id,
        };
        let state = new.live.clone().map(MissionState::new);
        let checkpoint = state.map(|state| Checkpoint::json(Some(state), None));
        let event = Event::Created {
            at_s,
            mission: Box::new(new),
        };
        let append = Append {
            mission: mission.id.clone(),
            number: None,
            status: mission.status.name().to_owned(),
            events: vec![event.stored(mission.sequence)],
            summary: json(&mission),
            snapshot: checkpoint,
            answered: key.map(|key| key.with(json(&mission))),
            order: Some(order),
            room: Room::Half,
        };
        match self.store.append(append).await? {
            Appended::Stored => {
                // A mission with this id may have been deleted just now.
                if let Some(actors) = self.actors().as_mut() {
                    actors.remove(&mission.id);
                }
                let Mission { id, kind, .. } = &mission;
                Span::current().record("mission", id);
                tracing::info!(mission = id, kind, change = "created", "a mission changed");
                Ok(mission)
            }
            Appended::AnsweredBefore(answer) => Ok(parsed(&answer)?),
            Appended::KeyTaken => Err(Problem::KeyTaken),
            Appended::ShareUsed => Err(Problem::DiskShare),
            Appended::MissionGone | Appended::OutOfSequence => Err(Problem::NoMission),
        }
    }

    /// At most `most` missions after the one numbered `after`, and the number after which more follow. Of them, those within
    /// the caller's `limit`.
    pub(super) async fn list(
        &self,
        after: u64,
        most: usize,
        limit: Option<TokenLimit>,
    ) -> Result<MissionList, Problem> {
        let page = move |reader: &EventReader| reader.missions(after, most, LIST_BYTES_MAX);
        let (stored, more) = self.read(page).await?;
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
                .filter_map(|stored| missions.listed(stored))
                .filter(is_within)
                .collect(),
        };
        // On a thread for long work: many clients may ask at once.
        self.planners.read_for_mission(Priority::Long, list).await
    }

    /// A mission with a summary of its last plan; none if it is damaged.
    fn listed(&self, stored: &StoredMission) -> Option<Mission> {
        let mission = parsed::<Mission>(&stored.summary);
        let mission = mission.inspect_err(|error| self.store.note_damage(error.to_string()));
        mission.ok().map(|mission| Mission {
            plan: self.last_plan(&stored.id),
            ..mission
        })
    }

    /// A summary of the last plan of the mission `id`, if the mission is active.
    pub(super) fn last_plan(&self, id: &str) -> Option<PlanSummary> {
        let (view, live) = {
            let actors = self.actors();
            let handle = actors.as_ref()?.get(id)?;
            (handle.view.clone(), handle.live.clone())
        };
        let view = view.borrow();
        let plan = view.plan.as_ref()?;
        let answer = &plan.answer.answer;
        Some(PlanSummary {
            outcome: answer.outcome,
            reason: answer.reason.clone(),
            method: answer.method,
            age_s: live
                .as_ref()
                .map_or(view.mission.t_s - plan.time, |live| plan.age(&live.clock)),
            period_s: live.map_or(simulation::PERIOD, |live| live.config.period_s),
            late_s: plan.late,
            warnings: answer
                .warnings
                .iter()
                .map(|warning| warning.detail.clone())
                .collect(),
            warning_codes: answer
                .warnings
                .iter()
                .map(|warning| warning.code.clone())
                .collect(),
            heard_s: plan.heard.clone(),
            waits_for: view.waits_for.clone(),
        })
    }

    /// The mission `id` as stored last, and its number.
    pub(super) async fn find(&self, id: &str) -> Result<(u64, Mission), Problem> {
        let stored = self.stored(id).await?;
        Ok((stored.number, parsed(&stored.summary)?))
    }

    /// What the client attached to the mission `id`.
    pub(super) async fn metadata(&self, id: &str) -> Result<Map<String, Value>, Problem> {
        let active = self.actors().as_ref().and_then(|actors| actors.get(id).cloned());
        match active {
            Some(handle) => Ok(handle.view.borrow().mission.metadata.clone()),
            None => Ok(self.find(id).await?.1.metadata),
        }
    }

    async fn stored(&self, id: &str) -> Result<StoredMission, Problem> {
        let id = id.to_owned();
        let found = self.read(move |reader| reader.mission(&id)).await?;
        found.ok_or(Problem::NoMission)
    }

    /// Deletes the mission `id`.
    pub(super) async fn delete(
        &self,
        id: &str,
        if_match: &IfMatch,
        order: AuditEntry,
    ) -> Result<(), Problem> {
        // A damaged mission can be deleted too, so no actor is asked.
        if *if_match != IfMatch::default() {
            let (_, mission) = self.find(id).await?;
            if_match.check(&mission)?;
        }
        // Its actor may serve a last request: the store stores nothing for a deleted mission.
        let gone = self.store.delete(id.to_owned(), order).await?;
        if let Some(actors) = self.actors().as_mut() {
            actors.remove(id);
        }
        if !gone {
            return Err(Problem::NoMission);
        }
        tracing::info!(mission = id, change = "deleted", "a mission changed");
        Ok(())
    }

    /// Adds reports that were read with that `origin`, and answers once they are on the disk.
    pub(super) async fn report(
        &self,
        id: &str,
        reports: Result<Reports, Problem>,
        origin: Option<Origin>,
        key: Option<IdempotencyKey>,
    ) -> Result<Vec<u8>, Problem> {
        match (reports, &key) {
            (Ok(reports), _) => {
                let report = Command::Report(Box::new(reports), origin);
                self.send(id, report, key, IfMatch::default(), None).await
            }
            // A repeated request may have been valid when it was first sent, and too old now.
            (Err(problem), Some(key)) => key.answered(&self.store, id).await?.ok_or(problem),
            (Err(problem), None) => Err(problem),
        }
    }

    /// Sends a command to the mission `id`, and waits for the reply.
    pub(super) async fn send(
        &self,
        id: &str,
        command: Command,
        key: Option<IdempotencyKey>,
        if_match: IfMatch,
        order: Option<AuditEntry>,
    ) -> Result<Vec<u8>, Problem> {
        let (reply, answer) = oneshot::channel();
        let span = Span::current();
        let mut request = Request {
            command,
            key,
            if_match,
            order,
            reply,
            span,
        };
        // The actor of a finished mission may end at this moment; then a new one answers.
        for _ in 0..2 {
            match self.handle(id).await?.requests.try_send(request) {
                Err(TrySendError::Closed(back)) => request = back,
                Err(TrySendError::Full(_)) => {
                    self.planners.metrics().shed(Shed::Mailbox);
                    return Err(Problem::Behind);
                }
                Ok(()) => {
                    return match timeout(ANSWER_TIME, answer).await {
                        Ok(Ok(answer)) => answer,
                        // The mission was deleted meanwhile, or its actor ended because the store knows more than it.
                        Ok(Err(_)) => {
                            self.stored(id).await?;
                            Err(Problem::Behind)
                        }
                        Err(_) => Err(Problem::Unanswered),
                    };
                }
            }
        }
        Err(Problem::Behind)
    }

    /// The actor of the mission `id`, started if it is not running.
    pub(super) async fn handle(&self, id: &str) -> Result<Handle, Problem> {
        let handle = match self.actors().as_ref() {
            Some(actors) => actors.get(id).cloned(),
            None => return Err(Problem::Log(StoreError::Closed)),
        };
        match handle.filter(|handle| !handle.requests.is_closed()) {
            Some(handle) => Ok(handle),
            None => self.start_actor(self.stored(id).await?).await,
        }
    }

    async fn start_actor(&self, stored: StoredMission) -> Result<Handle, Problem> {
        let StoredMission { number, id, summary } = stored;
        let mut mission: Mission = parsed(&summary)?;
        let (created_s, sequence) = (mission.created_s, mission.sequence);
        let (created, Checkpoint { state, plan }) = self
            .read(move |reader| fold(reader, number, created_s, sequence))
            .await?;
        // Earlier versions did not store them here.
        mission.setting = state.as_ref().map(|state| Setting::from(state.config()));
        mission.origin = state.as_ref().and_then(MissionState::origin);
        let mut actors = self.actors();
        let actors = actors.as_mut().ok_or(Problem::Log(StoreError::Closed))?;
        // Actors of finished missions may have ended.
        actors.retain(|_, handle| !handle.requests.is_closed());
        // Another request may have been faster.
        if let Some(handle) = actors.get(&id) {
            return Ok(handle.clone());
        }
        if ACTORS_MAX <= actors.len() {
            // Idle actors end here, and start again with the next request.
            actors.retain(|_, handle| {
                let in_use = 1 < handle.requests.strong_count();
                in_use || handle.view.borrow().mission.status == Status::Running
            });
        }
        if ACTORS_MAX <= actors.len() {
            self.planners.metrics().shed(Shed::Places);
            return Err(Problem::Crowded {
                what: "running missions",
                limit: ACTORS_MAX,
            });
        }
        let clock = Clock::new(created_s, created.live.as_ref());
        let live = created.live.map(|config| Arc::new(LiveMission { config, clock }));
        let (store, planners) = (self.store.clone(), self.planners.clone());
        let (context, handle) = Context::new(number, mission, plan, live.clone(), store, planners);
        match (live, state, created.simulated) {
            (Some(live), Some(state), _) => drop(tokio::spawn(run(Live::new(context, live, state)))),
            (None, None, Some(config)) => drop(tokio::spawn(run(Simulated::new(context, config)))),
            _ => return Err(StoreError::Damaged(format!("{id} is of no kind")).into()),
        }
        actors.insert(id, handle.clone());
        Ok(handle)
    }

    /// Reads the store on a thread that may wait for the disk.
    pub(super) async fn read<T: Send + 'static>(
        &self,
        read: impl FnOnce(&EventReader) -> Result<T, StoreError> + Send + 'static,
    ) -> Result<T, Problem> {
        let permit = Arc::clone(&self.reading).acquire_owned().await;
        let permit = permit.expect("is never closed");
        let store = self.store.clone();
        let read = spawn_blocking(move || {
            let _permit = permit;
            read(&store.reader()?)
        });
        let read = read.await.map_err(|_| Problem::Panicked)?;
        if let Err(StoreError::Damaged(what)) = &read {
            self.store.note_damage(what.clone());
        }
        Ok(read?)
    }

    /// The problem of a client whose quota of `what` is used up.
    pub(super) fn quota_exceeded(&self, exceeded: QuotaExceeded, what: &'static str) -> Problem {
        self.planners.metrics().shed(Shed::Places);
        match exceeded {
            QuotaExceeded::OfAll(limit) => Problem::Crowded { what, limit },
            QuotaExceeded::OfClient(limit) => Problem::Share { what, limit },
        }
    }

    /// A separate connection, for reading that takes long.
    pub(super) fn reader(&self) -> Result<EventReader, StoreError> {
        self.store.reader()
    }

    /// The same id for the same text: a repeated request finds the mission that it created. Without the store's salt the id
    /// cannot be guessed.
    fn mission_id(&self, text: &str) -> String {
        format!(
            "m-{}",
            &sha256(&[&*self.salt, text.as_bytes()].concat())[..ID_DIGITS]
        )
    }

    fn actors(&self) -> MutexGuard<'_, Option<HashMap<String, Handle>>> {
        self.actors.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// What `mission` was created with, counted from its origin now, with its paths of now.
pub(super) fn with_paths_of_now(
    reader: &EventReader,
    number: u64,
    mission: &Mission,
) -> Result<NewMission, StoreError> {
    let (mut created, Checkpoint { state, .. }) = fold(reader, number, mission.created_s, mission.sequence)?;
    if let Some(live) = &mut created.live {
        if let Some(origin) = mission.origin {
            live.count_from(origin);
        }
        let now = state.as_ref().map_or(&[][..], |state| &state.config().auvs);
        for (auv, now) in live.auvs.iter_mut().zip(now) {
            auv.path.clone_from(&now.path);
        }
    }
    Ok(created)
}

/// What a mission was created with, and the fold of its events up to the one numbered `last`.
fn fold(
    reader: &EventReader,
    number: u64,
    created_s: f64,
    last: u64,
) -> Result<(NewMission, Checkpoint), StoreError> {
    let created = created(reader, number)?;
    let Some((after, body)) = reader.snapshot(number)? else {
        return Ok((created, Checkpoint::default()));
    };
    let mut checkpoint: Checkpoint = parsed(&body)?;
    // A simulated mission has no state to fold: it is simulated again.
    if let Some(state) = &mut checkpoint.state {
        let clock = Clock::new(created_s, created.live.as_ref());
        // Every plan stores a checkpoint: no plan is among these events.
        reader.each(number, after, last, &mut |stored| {
            state.apply(&Event::read(stored)?, &clock);
            Ok(())
        })?;
    }
    Ok((created, checkpoint))
}
