//! All missions: those under way as actors, the others in the event store.

use std::{
    collections::HashMap,
    sync::{Arc, Mutex, MutexGuard, PoisonError},
    time::Duration,
};

use tokio::{
    sync::{Semaphore, mpsc::error::TrySendError, oneshot, watch},
    task::spawn_blocking,
    time::timeout,
};
use tracing::Span;

use super::{
    actor::{
        Command, Context, Handle, IdempotencyKey, LiveMission, NO_REPORTS, Request, Snapshot, live::Live,
        run, simulated::Simulated,
    },
    check,
    clock::{Clock, unix_now},
    event::{Event, created, json, parsed},
    simulation,
    state::MissionState,
};
use crate::{
    edge::fresh_id,
    metrics::Shed,
    planners::Planners,
    pool::Lane,
    problem::Problem,
    slots::{NoSlot, Slots},
    store::{Append, Appended, EventReader, EventStore, Order, Room, StoreError, StoredMission},
};
use wire::{
    mission::{Mission, NewMission, PlanSummary, Reports, Setting, Status},
    sha256,
};

/// Missions that may be under way at once: more than two processors plan for once a second.
const ACTORS_MAX: usize = 1_024;

/// Hexadecimal digits of a mission's id.
const ID_DIGITS: usize = 24;

/// Missions of one client that are not over: the others keep room for theirs.
const OPEN_SHARE: usize = ACTORS_MAX / 2;

/// Readers of event streams at once.
const STREAMS_MAX: usize = 256;

/// Records written at once, each on a thread of its own and in at most 9 MB.
const RECORDS_MAX: usize = 16;

/// Threads that read the store at once.
const READERS_MAX: usize = 16;

/// How long a client waits for the check of a simulation before it is told to come again.
const CHECK_TIME: Duration = Duration::from_secs(5);

/// How long a mission may take to reply before the client is asked to retry.
const ANSWER_TIME: Duration = Duration::from_secs(10);

/// Every mission of a data directory. Clones share them.
#[derive(Clone, Debug)]
pub struct Missions {
    store: EventStore,
    planners: Planners,
    /// Missions under way, by id. None once the service stops.
    actors: Arc<Mutex<Option<HashMap<String, Handle>>>>,
    /// The store's.
    salt: Arc<[u8]>,
    pub(super) streams: Slots<Arc<str>>,
    pub(super) records: Slots<Arc<str>>,
    reading: Arc<Semaphore>,
    /// True once the service stops.
    closing: watch::Sender<bool>,
}

impl Missions {
    /// The missions of `store`. Those that were running go on.
    pub(crate) async fn resume(store: EventStore, planners: Planners) -> Result<Self, StoreError> {
        let salt = store.reader()?.salt()?.into();
        let missions = Self {
            salt,
            store,
            planners,
            actors: Arc::new(Mutex::new(Some(HashMap::new()))),
            streams: Slots::new(STREAMS_MAX),
            records: Slots::new(RECORDS_MAX),
            reading: Arc::new(Semaphore::new(READERS_MAX)),
            closing: watch::Sender::new(false),
        };
        let running = missions
            .store
            .reader()?
            .missions_with_status(Status::Running.name())?;
        let n_running = running.len();
        for mission in running {
            let mission = match mission {
                Ok(mission) => mission,
                Err(error) => {
                    missions.store.note_damage(error.to_string());
                    continue;
                }
            };
            let id = mission.id.clone();
            if let Err(problem) = missions.start_actor(mission).await {
                // A damaged mission must not keep the others from going on; its clients get the error.
                tracing::error!(mission = id, ?problem, "does not go on");
            }
        }
        if 0 < n_running {
            tracing::info!(n_running, "missions go on");
        }
        let store = missions.store.clone();
        std::thread::spawn(move || store.inspect());
        Ok(missions)
    }

    /// Ends every actor and every stream. The next start goes on with what is stored.
    pub fn close(&self) {
        *self.actors() = None;
        self.closing.send_replace(true);
    }

    /// True after [`Self::close`]; without a sender once the missions are gone.
    pub(crate) fn closing(&self) -> watch::Receiver<bool> {
        self.closing.subscribe()
    }

    /// Ends the event store once everything is stored, after [`Self::close`] and the last request.
    pub async fn close_store(&self) -> Result<(), StoreError> {
        self.store.close().await
    }

    /// Whether anything can be stored.
    pub(crate) async fn probe(&self) -> Result<(), StoreError> {
        self.store.probe().await
    }

    /// Makes a mission.
    pub(super) async fn create(
        &self,
        new: NewMission,
        key: Option<IdempotencyKey>,
        order: Order,
    ) -> Result<Mission, Problem> {
        // A key that was answered before ids had a salt.
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
        // The check of a simulated one starts the scenario, which takes as long as a simulation.
        let new = if is_simulated {
            let checked = timeout(CHECK_TIME, self.planners.simulate(check)).await;
            checked.map_err(|_| self.planners.too_late())??
        } else {
            self.planners.read_for_mission(Lane::Long, check).await?
        };
        let new = new.map_err(Problem::Invalid)?;
        let at_s = unix_now();
        let id = self.mission_id(&key.as_ref().map_or_else(
            || format!("{} {at_s}", fresh_id()),
            |key| format!("key {}", key.key),
        ));
        let mission = Mission {
            title: new.title.clone().unwrap_or_else(|| id.clone()),
            kind: if new.live.is_some() { "live" } else { "simulated" }.to_owned(),
            status: Status::Created,
            created_s: at_s,
            started_s: None,
            finished_s: None,
            t_s: if new.live.is_some() { at_s } else { 0.0 },
            speed_factor: None,
            sequence: 1,
            setting: new.live.as_ref().map(Setting::from),
            origin: new.live.as_ref().and_then(|live| live.origin),
            metadata: new.metadata.clone(),
            plan: None,
            id,
        };
        let state = new.live.clone().map(MissionState::new);
        let snapshot = state.map(|state| Snapshot::json(Some(state), None));
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
            snapshot,
            answered: key.map(|key| key.with(json(&mission))),
            order: Some(order),
            room: Room::Half,
        };
        match self.store.append(append).await? {
            Appended::Stored => {
                // A mission of that name may have been deleted just now.
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

    /// At most `most` missions after the one numbered `after`, and its number with each.
    pub(super) async fn list(&self, after: u64, most: usize) -> Result<Vec<(u64, Mission)>, Problem> {
        let stored = self.read(move |reader| reader.missions(after, most)).await?;
        let mut listed = vec![];
        for mission in stored {
            match mission {
                Ok(mission) => listed.push((mission.number, parsed(&mission.summary)?)),
                Err(error) => self.store.note_damage(error.to_string()),
            }
        }
        Ok(listed)
    }

    /// What the last plan of the mission called `id` amounts to, where that is in memory.
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
            heard_s: plan.heard.clone(),
            waits_for: view.waits_for.clone(),
        })
    }

    /// The mission called `id`, as it was stored last, and its number.
    pub(super) async fn find(&self, id: &str) -> Result<(u64, Mission), Problem> {
        let stored = self.stored(id).await?;
        Ok((stored.number, parsed(&stored.summary)?))
    }

    async fn stored(&self, id: &str) -> Result<StoredMission, Problem> {
        let id = id.to_owned();
        let found = self.read(move |reader| reader.mission(&id)).await?;
        found.ok_or(Problem::NoMission)
    }

    /// Deletes the mission called `id`.
    pub(super) async fn delete(&self, id: &str, order: Order) -> Result<(), Problem> {
        // Its actor ends after its last request: nothing of a deleted mission is stored.
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

    /// Takes up reports, and answers once they are on the disk.
    pub(super) async fn report(
        &self,
        id: &str,
        mut heard: Reports,
        key: Option<IdempotencyKey>,
    ) -> Result<Vec<u8>, Problem> {
        let handle = self.handle(id).await?;
        let Some(live) = handle.live else {
            return Err(Problem::conflict(NO_REPORTS));
        };
        let origin = handle.view.borrow().mission.origin.or(heard.origin);
        let check = move || {
            let checked = check::reports(&live.config, &heard, live.clock.now());
            if let (Ok(()), Some(origin)) = (&checked, origin) {
                heard.complete(origin);
            }
            (checked, heard)
        };
        let (checked, heard) = self.planners.read_for_mission(Lane::Mission, check).await?;
        if let Err(wrong) = checked {
            // Reports that were right when they were first sent may be too old by now.
            let before = match &key {
                Some(key) => key.answered(&self.store, id).await?,
                None => None,
            };
            return before.ok_or(Problem::Invalid(wrong));
        }
        self.send(id, Command::Report(Box::new(heard)), key, None).await
    }

    /// Sends a command to the mission called `id`, and waits for the reply.
    pub(super) async fn send(
        &self,
        id: &str,
        command: Command,
        key: Option<IdempotencyKey>,
        order: Option<Order>,
    ) -> Result<Vec<u8>, Problem> {
        let (reply, answer) = oneshot::channel();
        let span = Span::current();
        let mut request = Request {
            command,
            key,
            order,
            reply,
            span,
        };
        // The actor of a mission that is over may end just now; a new one answers then.
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
                        // The mission was deleted meanwhile, or the service stops.
                        Ok(Err(_)) => Err(Problem::NoMission),
                        Err(_) => Err(Problem::Unanswered),
                    };
                }
            }
        }
        Err(Problem::Behind)
    }

    /// The actor of the mission called `id`, started if it does not run.
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
        let (created, Snapshot { state, plan }) = self
            .read(move |reader| fold(reader, number, created_s, sequence))
            .await?;
        // An older version did not write it there.
        mission.setting = state.as_ref().map(|state| Setting::from(state.config()));
        mission.origin = state.as_ref().and_then(MissionState::origin);
        let mut actors = self.actors();
        let actors = actors.as_mut().ok_or(Problem::Log(StoreError::Closed))?;
        // The actors of missions that are over have ended.
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

    /// Why there is no slot for `what`.
    pub(super) fn no_slot(&self, no_slot: NoSlot, what: &'static str) -> Problem {
        self.planners.metrics().shed(Shed::Places);
        match no_slot {
            NoSlot::OfAll(limit) => Problem::Crowded { what, limit },
            NoSlot::OfClient(limit) => Problem::Share { what, limit },
        }
    }

    /// A connection of its own, for reading that takes long.
    pub(super) fn reader(&self) -> Result<EventReader, StoreError> {
        self.store.reader()
    }

    /// The same id for the same text, so that a request that is sent again finds the mission that it made; unguessable for
    /// a client that does not know the store's salt.
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

/// What a mission was made with, and the fold of its events up to the one numbered `last`.
fn fold(
    reader: &EventReader,
    number: u64,
    created_s: f64,
    last: u64,
) -> Result<(NewMission, Snapshot), StoreError> {
    let created = created(reader, number)?;
    let Some((after, body)) = reader.snapshot(number)? else {
        return Ok((created, Snapshot::default()));
    };
    let mut snapshot: Snapshot = parsed(&body)?;
    // A simulated mission has no state to fold: it is simulated again.
    if let Some(state) = &mut snapshot.state {
        let clock = Clock::new(created_s, created.live.as_ref());
        // Every plan leaves a snapshot, so that no plan is among these events.
        reader.each(number, after, last, &mut |stored| {
            state.apply(&Event::read(stored)?, &clock);
            Ok(())
        })?;
    }
    Ok((created, snapshot))
}
