//! All missions: active ones have an actor, others are in the event store only.

use std::collections::BTreeMap;
use std::sync::Arc;

use clock::Clock;
use parking_lot::{Mutex, MutexGuard};
use tokio::sync::{
    Mutex as AsyncMutex, Semaphore, broadcast::WeakSender, mpsc::error::TrySendError, oneshot,
};
use tracing::Span;

use super::actor::live::Live;
use super::actor::simulated::Simulated;
use super::actor::{
    Checkpoint, Command, Context, Handle, IdempotencyKey, LiveMission, Ownership, Request, run,
};
use super::check;
use super::clock::MissionClock;
use super::event::{Event, created, json, parsed};
use super::if_match::IfMatch;
use super::memory::{MEMORY, bytes_of};
use super::own_craft::Fleet;
use super::state::MissionState;
use store::{
    Acquired, Append, Appended, AuditEntry, EventReader, EventStore, Lease, Owned, Room, StoreError,
    StoredEvent, StoredMission,
};

use crate::edge::access::Tokens;
use crate::edge::problem::Problem;
use crate::edge::quota::{Quota, QuotaExceeded};
use crate::edge::request_id::new_id;
use crate::limits::{
    ACTORS_MAX, ANSWER_TIME, CHECK_TIME, LIVE_BYTES_MAX, OPEN_SHARE, OWNING_MAX, READERS_MAX, RECORDS_MAX,
    STREAMS_MAX,
};
use crate::metrics::Shed;
use crate::planning::planners::Planners;
use crate::planning::pool::Priority;
use wire::{
    Origin,
    mission::{Mission, NewMission, Reports, Setting, Status},
    sha256,
};

/// Hexadecimal digits of a mission's id.
const ID_DIGITS: usize = 24;

/// Actors that may be started at the same time, approximately.
const STARTS: usize = 64;

/// Every mission of a data directory. Clones share them.
#[derive(Clone, Debug)]
pub struct Missions {
    pub(super) store: EventStore,
    pub(super) planners: Planners,
    /// Handles of active missions, by id. `None` once the service stops.
    actors: Arc<Mutex<Option<BTreeMap<String, Handle>>>>,
    salt: Arc<[u8]>,
    pub(super) streams: Quota<Arc<str>>,
    pub(super) records: Quota<Arc<str>>,
    /// Bytes of active live missions, by the clients that created them.
    pub(super) memory: Quota<Arc<str>>,
    fleet: Fleet,
    reading: Arc<Semaphore>,
    /// For look-ups of owners, which long reads must not delay.
    owning: Arc<Semaphore>,
    /// Held while an actor starts. Missions share these locks by their ids.
    starts: Arc<[AsyncMutex<()>; STARTS]>,
}

impl Missions {
    /// The missions of `store`. Those that were running continue.
    pub(crate) async fn resume(
        store: EventStore,
        planners: Planners,
        tokens: Option<Tokens>,
    ) -> Result<Self, StoreError> {
        let read = store.clone();
        let salt = planners.clock.run_blocking(move || read.reader()?.salt()).await;
        let salt = salt.map_err(|_| StoreError::Closed)??.into();
        let missions = Self {
            salt,
            store,
            planners,
            actors: Arc::new(Mutex::new(Some(BTreeMap::new()))),
            streams: Quota::new(STREAMS_MAX),
            records: Quota::new(RECORDS_MAX),
            memory: Quota::new(LIVE_BYTES_MAX),
            fleet: Fleet::new(tokens),
            reading: Arc::new(Semaphore::new(READERS_MAX)),
            owning: Arc::new(Semaphore::new(OWNING_MAX)),
            starts: Arc::new(std::array::from_fn(|_| AsyncMutex::default())),
        };
        if let Some(lease) = missions.store.lease() {
            tokio::spawn(missions.clone().keep_share(lease.clone()));
            return Ok(missions);
        }
        let status = Status::Running.name();
        let running = missions.store.reader()?.missions_with_status(status)?;
        let n_running = running.len();
        for mission in running {
            let id = mission.id.clone();
            if let Err(problem) = missions.start_actor(mission, Ownership::default()).await {
                // Other missions continue; the clients of a damaged one get the error.
                tracing::error!(mission = id, ?problem, "the mission does not continue");
            }
        }
        if 0 < n_running {
            tracing::info!(n_running, "missions continue");
        }
        let store = missions.store.clone();
        let inspect = async move { store.inspect() };
        if let Err(error) = missions.clock().spawn_thread("inspect", inspect) {
            tracing::warn!(%error, "the mission log is not checked for damage");
        }
        Ok(missions)
    }

    pub(crate) fn clock(&self) -> &Clock {
        &self.planners.clock
    }

    /// Ends every actor and every stream. The next start continues from the stored events.
    pub fn close(&self) {
        self.end_actors();
    }

    /// As [`Self::close`]. A result has no sender once its actor has ended.
    pub(super) fn end_actors(&self) -> Vec<WeakSender<StoredEvent>> {
        let ended = self.actors().take().into_iter().flatten();
        ended.map(|(_, handle)| handle.events).collect()
    }

    /// `true` if other services may have the missions.
    pub(crate) fn are_shared(&self) -> bool {
        self.store.lease().is_some()
    }

    /// `true` until the service closes its missions.
    pub(super) fn is_open(&self) -> bool {
        self.actors().is_some()
    }

    /// Ends the actor of the mission `id` after its plan.
    pub(super) fn forget(&self, id: &str) {
        if let Some(actors) = self.actors().as_mut() {
            actors.remove(id);
        }
    }

    /// Ends the actors of missions from before the service had lost all of them.
    pub(super) fn forget_before(&self, incarnation: u64) {
        if let Some(actors) = self.actors().as_mut() {
            actors.retain(|_, handle| handle.ownership.incarnation == incarnation);
        }
    }

    /// Closes the store once everything is stored, after [`Self::close`] and the last request.
    pub async fn close_store(&self) -> Result<(), StoreError> {
        self.store.close().await
    }

    /// Fails if the store cannot write.
    pub(crate) async fn probe(&self) -> Result<(), StoreError> {
        self.store.probe().await
    }

    pub(super) async fn create(
        &self,
        new: NewMission,
        key: Option<IdempotencyKey>,
        order: AuditEntry,
    ) -> Result<Mission, Problem> {
        if let Some(key) = &key {
            // Earlier versions derived the id from the key without a salt.
            let id = format!("m-{}", &sha256(format!("key {}", key.key).as_bytes())[..16]);
            if let Some(before) = key.answered(&self.store, &id).await? {
                return Ok(parsed(&before)?);
            }
        }
        let caller = order.caller.clone();
        if OPEN_SHARE <= self.read(move |reader| reader.count_open(&caller)).await? {
            let (what, limit) = ("missions that are not over", OPEN_SHARE);
            return Err(Problem::Share { what, limit });
        }
        let new = self.checked(new).await?;
        let at_s = self.clock().unix_s();
        let by_key = key.as_ref().map(|key| format!("key {}", key.key));
        let id = self.mission_id(&by_key.unwrap_or_else(|| format!("{} {at_s}", new_id())));
        let mission = Mission {
            title: new.title().unwrap_or_else(|| id.clone()),
            kind: if new.live.is_some() { "live" } else { "simulated" }.to_owned(),
            controller: new.simulated.as_ref().map(|simulated| simulated.controller),
            created_s: at_s,
            t_s: if new.live.is_some() { at_s } else { 0.0 },
            sequence: 1,
            revision: 1,
            setting: new.live.as_ref().map(Setting::from),
            origin: new.live.as_ref().and_then(|live| live.origin),
            metadata: new.metadata.clone(),
            id,
            ..Mission::default()
        };
        let checkpoint = new.live.clone().map(|live| Checkpoint::new(Some(MissionState::new(live)), &[]));
        let event = Event::Created { at_s, mission: Box::new(new) };
        let append = Append {
            mission: mission.id.clone(),
            status: mission.status.name().to_owned(),
            events: vec![event.stored(mission.sequence)],
            summary: json(&mission),
            snapshot: checkpoint.as_ref().map(json),
            answered: key.map(|key| key.with(json(&mission))),
            order: Some(order),
            room: Room::Half,
            ..Append::default()
        };
        match self.store.append(append).await? {
            Appended::Stored => {
                // A mission with this id may have been deleted just now.
                self.forget(&mission.id);
                let Mission { id, kind, .. } = &mission;
                Span::current().record("mission", id);
                tracing::info!(mission = id, kind, change = "created", "a mission changed");
                Ok(mission)
            }
            Appended::AnsweredBefore(answer) => Ok(parsed(&answer)?),
            Appended::KeyTaken => Err(Problem::KeyTaken),
            Appended::ShareUsed => Err(Problem::DiskShare),
            Appended::MissionGone | Appended::OutOfSequence | Appended::NotOwner => Err(Problem::NoMission),
        }
    }

    /// The same request, if it is valid.
    async fn checked(&self, new: NewMission) -> Result<NewMission, Problem> {
        let is_simulated = new.simulated.is_some();
        let check = move || check::new_mission(&new).map(|()| new);
        // The check starts the scenario, so it runs among simulations, before their work.
        let new = if is_simulated {
            let (checked, _job) = self.planners.simulate(Priority::Short, check);
            let checked = self.clock().timeout(CHECK_TIME, checked).await;
            let checked = checked.map_err(|_| self.planners.too_late())?;
            checked.map_err(|_| Problem::Panicked)?
        } else {
            self.planners.read_for_mission(Priority::Long, check).await?
        };
        new.map_err(Problem::Invalid)
    }

    /// The mission `id` as stored last, and its number.
    pub(super) async fn find(&self, id: &str) -> Result<(u64, Mission), Problem> {
        let stored = self.stored(id).await?;
        Ok((stored.number, parsed(stored.summary()?)?))
    }

    /// The mission `id` as it is now, or was stored last.
    pub(super) async fn known(&self, id: &str) -> Result<Arc<Mission>, Problem> {
        match self.active(id)? {
            Some(handle) => Ok(Arc::clone(&handle.view.borrow().mission)),
            None => Ok(self.find(id).await?.1.into()),
        }
    }

    async fn stored(&self, id: &str) -> Result<StoredMission, Problem> {
        let id = id.to_owned();
        let found = self.read(move |reader| reader.mission(&id)).await?;
        found.ok_or(Problem::NoMission)
    }

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
        // Its actor may serve a last request: the store rejects events of a deleted mission.
        let gone = self.store.delete(id.to_owned(), order).await?;
        self.forget(id);
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
                match (self.send(id, report, key.clone(), IfMatch::default(), None).await, &key) {
                    // A repeated range may have been from a known place when it was first sent.
                    (Err(problem @ Problem::Invalid(_)), Some(key)) => {
                        key.answered(&self.store, id).await?.ok_or(problem)
                    }
                    (answer, _) => answer,
                }
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
        let mut request = Request { command, key, if_match, order, reply, span: Span::current() };
        // The actor of a finished mission may end at this moment; then a new one answers.
        for _ in 0..2 {
            match self.handle(id).await?.requests.try_send(request) {
                Err(TrySendError::Closed(back)) => request = back,
                Err(TrySendError::Full(_)) => {
                    self.planners.metrics.shed(Shed::Mailbox);
                    return Err(Problem::Behind);
                }
                Ok(()) => {
                    return match self.clock().timeout(ANSWER_TIME, answer).await {
                        Ok(Ok(answer)) => answer,
                        // The mission was deleted, or the store has events unknown to its actor.
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

    /// The actor of the mission `id`, started if necessary. Fails if another service may own it.
    pub(super) async fn handle(&self, id: &str) -> Result<Handle, Problem> {
        if let Some(handle) = self.active(id)? {
            return Ok(handle);
        }
        let _start = self.start_of(id).lock().await;
        if let Some(handle) = self.active(id)? {
            return Ok(handle);
        }
        let Some(lease) = self.store.lease() else {
            let stored = self.stored(id).await?;
            return self.start_actor(stored, Ownership::default()).await;
        };
        let (lease, name) = (lease.clone(), id.to_owned());
        let acquire = move || Ok((lease.incarnation()?, lease.acquire(&name)?));
        match self.own(acquire).await? {
            (incarnation, Acquired::Here(Owned { mission, epoch })) => {
                let ownership = Ownership { epoch, incarnation };
                self.start_actor(mission, ownership).await
            }
            (_, Acquired::At(url)) => Err(Problem::Elsewhere(url)),
            (_, Acquired::NoMission) => Err(Problem::NoMission),
        }
    }

    /// The actor of the mission `id`, if it runs here and this service owns the mission.
    pub(super) fn active(&self, id: &str) -> Result<Option<Handle>, Problem> {
        let incarnation = self.store.lease().map(Lease::incarnation).transpose()?;
        let actors = self.actors();
        let actors = actors.as_ref().ok_or(Problem::Log(StoreError::Closed))?;
        let handle = actors.get(id).filter(|handle| !handle.requests.is_closed());
        let own = |handle: &&Handle| handle.ownership.incarnation == incarnation.unwrap_or(0);
        Ok(handle.filter(own).cloned())
    }

    pub(super) fn start_of(&self, id: &str) -> &AsyncMutex<()> {
        let mix = |sum: usize, byte: u8| sum.wrapping_mul(31) + usize::from(byte);
        &self.starts[id.bytes().fold(0, mix) % STARTS]
    }

    pub(super) async fn start_actor(
        &self,
        stored: StoredMission,
        ownership: Ownership,
    ) -> Result<Handle, Problem> {
        let mut mission: Mission = parsed(stored.summary()?)?;
        let (number, id, owner) = (stored.number, stored.id, stored.owner);
        let (created_s, sequence) = (mission.created_s, mission.sequence);
        let folded = self.read(move |reader| fold(reader, number, created_s, sequence));
        let (created, checkpoint) = folded.await?;
        let (plans, state) = (checkpoint.plans(), checkpoint.state);
        // Earlier versions did not store them here.
        if let Some(state) = &state {
            state.show_in(&mut mission);
        }
        let mut actors = self.actors();
        let actors = actors.as_mut().ok_or(Problem::Log(StoreError::Closed))?;
        // Actors of finished missions may have ended.
        actors.retain(|_, handle| !handle.requests.is_closed());
        // Another request may have been faster.
        if let Some(handle) = actors.get(&id)
            && ownership.epoch <= handle.ownership.epoch
        {
            return Ok(handle.clone());
        }
        if ACTORS_MAX <= actors.len() {
            // Idle actors end here, and start again with the next request.
            actors.retain(|_, handle| is_in_use(handle));
        }
        if ACTORS_MAX <= actors.len() {
            self.planners.metrics.shed(Shed::Limit);
            let (what, limit) = ("running missions", ACTORS_MAX);
            return Err(Problem::Crowded { what, limit });
        }
        let memory = state.as_ref().zip(created.live.as_ref()).map(|(state, live)| {
            let (owner, bytes) = (Arc::from(owner), bytes_of(live, state.config()));
            if mission.status == Status::Running {
                // It was within the limits, here or at another service.
                return Ok(self.memory.existing(owner, bytes));
            }
            self.memory.take(owner, bytes).map_err(|exceeded| {
                // Idle actors end here, and start again with the next request.
                actors.retain(|_, handle| is_in_use(handle));
                self.quota_exceeded(exceeded, MEMORY)
            })
        });
        let memory = memory.transpose()?;
        let clock = MissionClock::new(created_s, created.live.as_ref());
        let live = created.live.map(|config| Arc::new(LiveMission { config, clock }));
        let (store, planners) = (self.store.clone(), self.planners.clone());
        let (mission, held) = ((number, mission), live.clone().zip(memory));
        let berth = self.fleet.place(number);
        let (context, handle) = Context::new(mission, ownership, plans, held, store, planners);
        match (live, state, created.simulated) {
            (Some(live), Some(state), _) => drop(tokio::spawn(run(Live::new(context, live, state, berth)))),
            (None, None, Some(config)) => drop(tokio::spawn(run(Simulated::new(context, config)))),
            _ => return Err(StoreError::Damaged(format!("{id} is of no kind")).into()),
        }
        actors.insert(id, handle.clone());
        Ok(handle)
    }

    /// Number of missions that can still start here.
    pub(super) fn n_startable(&self) -> usize {
        let actors = self.actors();
        let kept = actors.iter().flat_map(BTreeMap::values);
        ACTORS_MAX.saturating_sub(kept.filter(|handle| is_in_use(handle)).count())
    }

    /// Reads the store on a thread that may wait for the disk.
    pub(super) async fn read<T: Send + 'static>(
        &self,
        read: impl FnOnce(&EventReader) -> Result<T, StoreError> + Send + 'static,
    ) -> Result<T, Problem> {
        let store = self.store.clone();
        self.block(&self.reading, move || read(&store.reader()?)).await
    }

    /// Looks up an owner on a thread that may wait for the database.
    pub(super) async fn own<T: Send + 'static>(
        &self,
        ask: impl FnOnce() -> Result<T, StoreError> + Send + 'static,
    ) -> Result<T, Problem> {
        self.block(&self.owning, ask).await
    }

    async fn block<T: Send + 'static>(
        &self,
        threads: &Arc<Semaphore>,
        ask: impl FnOnce() -> Result<T, StoreError> + Send + 'static,
    ) -> Result<T, Problem> {
        let permit = Arc::clone(threads).acquire_owned().await;
        let permit = permit.expect("is never closed");
        let asked = self.clock().run_blocking(move || {
            let _permit = permit;
            ask()
        });
        let asked = asked.await.map_err(|_| Problem::Panicked)?;
        if let Err(StoreError::Damaged(what)) = &asked {
            self.store.note_damage(what.clone());
        }
        Ok(asked?)
    }

    /// The problem of a client with an exhausted quota of `what`.
    pub(super) fn quota_exceeded(&self, exceeded: QuotaExceeded, what: &'static str) -> Problem {
        self.planners.metrics.shed(Shed::Limit);
        exceeded.problem(what)
    }

    /// An id that depends on the text alone, for repeated requests; the store's salt hides it.
    fn mission_id(&self, text: &str) -> String {
        let digest = sha256(&[&*self.salt, text.as_bytes()].concat());
        format!("m-{}", &digest[..ID_DIGITS])
    }

    pub(super) fn actors(&self) -> MutexGuard<'_, Option<BTreeMap<String, Handle>>> {
        self.actors.lock()
    }
}

/// `true` for actors that run a mission or serve a client: they do not end.
fn is_in_use(handle: &Handle) -> bool {
    1 < handle.requests.strong_count() || handle.view.borrow().mission.status == Status::Running
}

/// The request that created `mission`, with the present origin and paths.
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

/// The request that created a mission, and the fold of its events up to the one numbered `last`.
fn fold(
    reader: &EventReader,
    number: u64,
    created_s: f64,
    last: u64,
) -> Result<(NewMission, Checkpoint), StoreError> {
    let created = created(reader, number)?;
    let Some((after, body)) = reader.snapshot(number)? else {
        return Ok((created, Checkpoint::new(None, &[])));
    };
    let mut checkpoint: Checkpoint = parsed(&body)?;
    // A simulated mission has no state to fold: its events are simulated again.
    if let Some(state) = &mut checkpoint.state {
        let clock = MissionClock::new(created_s, created.live.as_ref());
        // Each plan stores a checkpoint, so no plan is among these events.
        reader.each(number, after, last, &mut |stored| {
            state.apply(&Event::read(stored)?, &clock);
            Ok(())
        })?;
    }
    Ok((created, checkpoint))
}
