//! All missions: those under way as actors, the others on the disk.

use std::{
    collections::HashMap,
    sync::{Arc, Mutex, MutexGuard, PoisonError},
    time::Duration,
};

use serde::de::DeserializeOwned;
use tokio::{
    sync::{OwnedSemaphorePermit, Semaphore, mpsc::error::TrySendError, oneshot},
    task::spawn_blocking,
    time::timeout,
};

use super::{
    actor::{Desk, Handle, Key, Letter, Live, LiveMission, Order, Simulated, Snapshot, answered, json},
    check,
    clock::{Clock, unix_now},
    event::{Event, hexadecimal},
    known::Known,
    log::{self, Answered, Append, Appended, Listed, Log, LogError, Reader},
};
use crate::{
    edge::fresh_id,
    planners::Planners,
    problem::Problem,
    wire::mission::{Mission, NewMission, Reports, Status},
};

/// Missions that may be under way at once: more than two processors plan for once a second.
const UNDER_WAY_MAX: usize = 1_024;

/// Readers of event streams at once.
const STREAMS_MAX: usize = 256;

/// Records written at once, each on a thread of its own.
const RECORDS_MAX: usize = 4;

/// Threads that read the log at once.
const READERS_MAX: usize = 16;

/// How long a mission may take to answer a letter before the client is told to ask again.
const ANSWER_TIME: Duration = Duration::from_secs(10);

/// Every mission of a data directory. Clones share them.
#[derive(Clone, Debug)]
pub struct Missions {
    log: Log,
    planners: Planners,
    /// None once the service stops.
    under_way: Arc<Mutex<Option<HashMap<String, Handle>>>>,
    pub(super) streams: Places,
    pub(super) records: Places,
    reading: Arc<Semaphore>,
}

/// Room for so many, each of whom gives its place back by dropping it.
#[derive(Clone, Debug)]
pub(super) struct Places {
    what: &'static str,
    limit: usize,
    free: Arc<Semaphore>,
}

impl Places {
    fn new(what: &'static str, limit: usize) -> Self {
        Self {
            what,
            limit,
            free: Arc::new(Semaphore::new(limit)),
        }
    }

    pub(super) fn take(&self) -> Result<OwnedSemaphorePermit, Problem> {
        let Self { what, limit, .. } = *self;
        let place = Arc::clone(&self.free).try_acquire_owned();
        place.map_err(|_| Problem::Crowded { what, limit })
    }
}

impl Missions {
    /// The missions of `log`. Those that were running go on.
    pub(crate) async fn resume(log: Log, planners: Planners) -> Result<Self, LogError> {
        let missions = Self {
            log,
            planners,
            under_way: Arc::new(Mutex::new(Some(HashMap::new()))),
            streams: Places::new("event streams", STREAMS_MAX),
            records: Places::new("records", RECORDS_MAX),
            reading: Arc::new(Semaphore::new(READERS_MAX)),
        };
        let running = missions.log.reader()?.missions_that_are(Status::Running.name())?;
        let n_running = running.len();
        for listed in running {
            let id = listed.id.clone();
            if let Err(problem) = missions.take_up(listed).await {
                // One that is damaged must not keep the others from going on; whoever asks for it is told.
                tracing::error!(mission = id, ?problem, "does not go on");
            }
        }
        if 0 < n_running {
            tracing::info!(n_running, "missions go on");
        }
        let log = missions.log.clone();
        std::thread::spawn(move || log.inspect());
        Ok(missions)
    }

    /// Ends every actor and every stream. What is on the disk stays as it is: a start goes on with it.
    pub fn close(&self) {
        *self.lock() = None;
    }

    /// Whether anything can be stored.
    pub(crate) async fn probe(&self) -> Result<(), LogError> {
        self.log.probe().await
    }

    /// Makes a mission.
    pub(super) async fn create(&self, new: NewMission, key: Option<Key>) -> Result<Mission, Problem> {
        // A scenario is tried, which takes what a simulation takes.
        let turn = match &new.simulated {
            Some(_) => Some(self.planners.simulation().await),
            None => None,
        };
        let new = spawn_blocking(move || {
            let _turn = turn;
            check::new_mission(&new).map(|()| new)
        });
        let new = new
            .await
            .map_err(|_| Problem::Panicked)?
            .map_err(Problem::Invalid)?;
        let at_s = unix_now();
        let id = named(&key.as_ref().map_or_else(
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
            metadata: new.metadata.clone(),
            id,
        };
        let snapshot = new.live.clone().map(|config| {
            json(&Snapshot {
                known: Some(Known::new(config)),
                plan: None,
            })
        });
        let event = Event::Created {
            at_s,
            mission: Box::new(new),
        };
        let append = Append {
            mission: mission.id.clone(),
            number: None,
            status: mission.status.name().to_owned(),
            events: vec![log::Event {
                sequence: 1,
                kind: event.kind().to_owned(),
                body: json(&event),
            }],
            summary: json(&mission),
            snapshot,
            answered: key.map(|Key { key, request }| Answered {
                key,
                request,
                answer: json(&mission),
            }),
        };
        match self.log.append(append).await? {
            Appended::Now => {
                // A mission of that name may have been deleted just now.
                if let Some(under_way) = self.lock().as_mut() {
                    under_way.remove(&mission.id);
                }
                Ok(mission)
            }
            Appended::Before(answer) => Ok(parsed(&answer)?),
            Appended::KeyTaken => Err(Problem::KeyTaken),
            Appended::Gone | Appended::Overtaken => Err(Problem::NoMission),
        }
    }

    /// At most `most` missions after the one numbered `after`, and its number with each.
    pub(super) async fn list(&self, after: u64, most: usize) -> Result<Vec<(u64, Mission)>, Problem> {
        let listed = self.read(move |reader| reader.missions(after, most)).await?;
        let read = |listed: &Listed| Ok((listed.number, parsed(&listed.summary)?));
        Ok(listed.iter().map(read).collect::<Result<_, LogError>>()?)
    }

    /// The mission called `id`, as it was stored last, and its number.
    pub(super) async fn find(&self, id: &str) -> Result<(u64, Mission), Problem> {
        let listed = self.listed(id).await?;
        Ok((listed.number, parsed(&listed.summary)?))
    }

    async fn listed(&self, id: &str) -> Result<Listed, Problem> {
        let id = id.to_owned();
        let found = self.read(move |reader| reader.mission(&id)).await?;
        found.ok_or(Problem::NoMission)
    }

    /// Forgets the mission called `id`.
    pub(super) async fn delete(&self, id: &str) -> Result<(), Problem> {
        // Its actor ends with its last letter, and finds no mission to store anything of.
        let gone = self.log.delete(id.to_owned()).await?;
        if let Some(under_way) = self.lock().as_mut() {
            under_way.remove(id);
        }
        if gone { Ok(()) } else { Err(Problem::NoMission) }
    }

    /// Takes up what was heard, and answers once it is on the disk.
    pub(super) async fn hear(&self, id: &str, heard: Reports, key: Option<Key>) -> Result<Vec<u8>, Problem> {
        let handle = self.handle(id).await?;
        let Some(live) = &handle.live else {
            let why = "a simulated mission hears its own vehicles; reports are for live ones";
            return Err(Problem::conflict(why));
        };
        if let Err(wrong) = check::reports(&live.config, &heard, live.clock.now()) {
            // What was right when it was first sent may be too old by now.
            let before = match &key {
                Some(key) => answered(&self.log, id, key).await?,
                None => None,
            };
            return before.ok_or(Problem::Invalid(wrong));
        }
        self.ask(id, Order::Hear(Box::new(heard)), key).await
    }

    /// Has the mission called `id` carry out an order.
    pub(super) async fn ask(&self, id: &str, order: Order, key: Option<Key>) -> Result<Vec<u8>, Problem> {
        let (told, answer) = oneshot::channel();
        let mut letter = Letter { order, key, told };
        // The actor of a mission that is over may end just now; another one answers then.
        for _ in 0..2 {
            match self.handle(id).await?.mailbox.try_send(letter) {
                Err(TrySendError::Closed(back)) => letter = back,
                Err(TrySendError::Full(_)) => return Err(Problem::Behind),
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

    /// The actor of the mission called `id`, begun if it is not there.
    pub(super) async fn handle(&self, id: &str) -> Result<Handle, Problem> {
        let known = match self.lock().as_ref() {
            Some(under_way) => under_way.get(id).cloned(),
            None => return Err(Problem::Log(LogError::Closed)),
        };
        match known.filter(|handle| !handle.mailbox.is_closed()) {
            Some(handle) => Ok(handle),
            None => self.take_up(self.listed(id).await?).await,
        }
    }

    async fn take_up(&self, listed: Listed) -> Result<Handle, Problem> {
        let number = listed.number;
        let mission: Mission = parsed(&listed.summary)?;
        let (created_s, sequence) = (mission.created_s, mission.sequence);
        let (created, Snapshot { known, plan }) = self
            .read(move |reader| fold(reader, number, created_s, sequence))
            .await?;
        let mut under_way = self.lock();
        let under_way = under_way.as_mut().ok_or(Problem::Log(LogError::Closed))?;
        // The actors of missions that are over have ended.
        under_way.retain(|_, handle| !handle.mailbox.is_closed());
        // Another request may have been faster.
        if let Some(handle) = under_way.get(&listed.id) {
            return Ok(handle.clone());
        }
        if UNDER_WAY_MAX <= under_way.len() {
            // Those that do nothing are begun again when somebody asks for them.
            under_way.retain(|_, handle| {
                let asked = 1 < handle.mailbox.strong_count();
                asked || handle.seen.borrow().mission.status == Status::Running
            });
        }
        if UNDER_WAY_MAX <= under_way.len() {
            return Err(Problem::Crowded {
                what: "running missions",
                limit: UNDER_WAY_MAX,
            });
        }
        let live = created.live.map(|config| {
            let clock = Clock {
                created: mission.created_s,
                rate: config.clock_rate,
            };
            Arc::new(LiveMission { config, clock })
        });
        let (desk, handle) = Desk::new(
            number,
            mission,
            plan,
            live.clone(),
            self.log.clone(),
            self.planners.clone(),
        );
        match (live, known, created.simulated) {
            (Some(live), Some(known), _) => drop(tokio::spawn(Live::new(desk, live, known).run())),
            (None, None, Some(config)) => drop(tokio::spawn(Simulated::new(desk, config).run())),
            _ => return Err(LogError::Damaged(format!("{} is of no kind", listed.id)).into()),
        }
        under_way.insert(listed.id, handle.clone());
        Ok(handle)
    }

    /// Reads the log on a thread that may wait for the disk.
    pub(super) async fn read<T: Send + 'static>(
        &self,
        read: impl FnOnce(&Reader) -> Result<T, LogError> + Send + 'static,
    ) -> Result<T, Problem> {
        let turn = Arc::clone(&self.reading).acquire_owned().await;
        let turn: OwnedSemaphorePermit = turn.expect("is never closed");
        let log = self.log.clone();
        let read = spawn_blocking(move || {
            let _turn = turn;
            read(&log.reader()?)
        });
        let read = read.await.map_err(|_| Problem::Panicked)?;
        if let Err(LogError::Damaged(what)) = &read {
            self.log.note_damage(what.clone());
        }
        Ok(read?)
    }

    /// A connection for whoever reads for long.
    pub(super) fn reader(&self) -> Result<Reader, LogError> {
        self.log.reader()
    }

    fn lock(&self) -> MutexGuard<'_, Option<HashMap<String, Handle>>> {
        self.under_way.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// What the events of a mission come to: how it was made and, if it is live, what is known.
fn fold(
    reader: &Reader,
    number: u64,
    created_s: f64,
    sequence: u64,
) -> Result<(NewMission, Snapshot), LogError> {
    let created = created(reader, number)?;
    let Some((after, body)) = reader.snapshot(number)? else {
        let nothing = Snapshot {
            known: None,
            plan: None,
        };
        return Ok((created, nothing));
    };
    let mut snapshot: Snapshot = parsed(&body)?;
    let Some(known) = &mut snapshot.known else {
        // A simulated mission is simulated again.
        return Ok((created, snapshot));
    };
    let clock = Clock {
        created: created_s,
        rate: created.live.as_ref().map_or(1.0, |live| live.clock_rate),
    };
    // Every plan leaves a snapshot, so that none of these is one.
    reader.each(number, after, sequence, &mut |stored| {
        if let Event::Reported { heard, at_s } = Event::read(stored)? {
            known.hear(&heard, clock.at(at_s));
        }
        Ok(())
    })?;
    Ok((created, snapshot))
}

/// How the mission was made: its first event.
pub(super) fn created(reader: &Reader, number: u64) -> Result<NewMission, LogError> {
    match reader
        .events(number, 0, 1)?
        .first()
        .map(Event::read)
        .transpose()?
    {
        Some(Event::Created { mission, .. }) => Ok(*mission),
        _ => Err(LogError::Damaged(format!(
            "mission number {number} has no beginning"
        ))),
    }
}

pub(super) fn parsed<T: DeserializeOwned>(bytes: &[u8]) -> Result<T, LogError> {
    serde_json::from_slice(bytes).map_err(|error| LogError::Damaged(error.to_string()))
}

/// The same name for the same text, so that a request sent again finds what it made.
fn named(text: &str) -> String {
    use sha2::{Digest as _, Sha256};
    format!("m-{}", &hexadecimal(&Sha256::digest(text))[..16])
}
