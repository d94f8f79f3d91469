//! The service's process and its disk.

use std::{
    collections::BTreeMap,
    fs,
    hash::{DefaultHasher, Hash as _, Hasher as _},
    path::{Path, PathBuf},
    sync::{Arc, Mutex},
    time::Duration,
};

use axum::{
    Router,
    body::{Body, to_bytes},
    http::{Request as HttpRequest, header},
};
use rand::RngExt as _;
use rand_chacha::ChaCha8Rng;
use serde_json::Value;
use service::{
    Settings,
    missions::{Missions, replay::replay},
    store::{EventReader, EventStore},
};
use tempfile::TempDir;
use tokio::sync::watch;
use tower::ServiceExt as _;

use super::{World, lock, planners, rng};

/// Longest answer read, bytes.
const ANSWER_BYTES_MAX: usize = 16 << 20;
/// Files of a store: SQLite's, and the list of what was acknowledged.
const WRITE_AHEAD: &str = "missions.sqlite3-wal";
/// How long the writes go on that a power cut tears, s.
const TORN_S: f64 = 1.2;

/// A request as the service gets it: a POST if it has a body.
#[derive(Clone, Debug)]
pub(super) struct Request {
    pub(super) path: String,
    pub(super) key: Option<String>,
    pub(super) body: Option<Vec<u8>>,
}

pub(super) struct Host {
    world: Arc<World>,
    /// On the memory disk: a sync costs nothing, and what a real disk does is tested by real processes.
    root: TempDir,
    state: Mutex<State>,
    killed: watch::Sender<u64>,
    rng: Mutex<ChaCha8Rng>,
}

#[derive(Default)]
struct State {
    /// Number of the directory of the store: a kill leaves the last one as it was.
    generation: u64,
    running: Option<Running>,
    mission: Option<String>,
    /// The highest number that a client knows.
    known_last: u64,
    /// Answers to keys: the events' numbers.
    acknowledged: BTreeMap<String, u64>,
    /// References that clients saw, by the number of their plan.
    seen: BTreeMap<u64, Value>,
    /// Digests of events that are known, by number.
    history: BTreeMap<u64, u64>,
}

struct Running {
    router: Router,
    missions: Missions,
    store: EventStore,
}

impl Host {
    pub(super) fn new(world: &Arc<World>, seed: u64) -> Self {
        planners::begin();
        let memory = Path::new("/dev/shm");
        let root = if memory.is_dir() {
            tempfile::tempdir_in(memory)
        } else {
            tempfile::tempdir()
        };
        Self {
            world: Arc::clone(world),
            root: root.expect("a directory can be made"),
            state: Mutex::default(),
            killed: watch::Sender::new(0),
            rng: Mutex::new(rng(seed, 3)),
        }
    }

    fn directory(&self, generation: u64) -> PathBuf {
        self.root.path().join(format!("data-{generation}"))
    }

    /// The mission of the voyage, once it is made.
    pub(super) fn mission(&self) -> Option<String> {
        lock(&self.state).mission.clone()
    }

    pub(super) async fn start(&self) {
        let generation = lock(&self.state).generation;
        let directory = self.directory(generation);
        let store = EventStore::open(&directory, &self.world.ashore).expect("the store opens");
        let settings = Settings {
            clock: self.world.ashore.clone(),
            plan: planners::plan,
            planners: 2,
            ..Settings::default()
        };
        let started = service::service(settings, store.clone()).await;
        let (router, missions) = started.expect("the service starts");
        self.world.note("host", "the service starts");
        let probed = store.probe().await;
        self.world
            .claim("no loss reported", probed.is_ok(), || format!("{probed:?}"));
        self.check_store(&directory);
        lock(&self.state).running = Some(Running {
            router,
            missions,
            store,
        });
    }

    /// Kills the service; with `torn`, in the middle of its next write. What comes to the disk later counts for nothing.
    pub(super) async fn kill(&self, torn: bool) {
        let (running, generation) = {
            let mut state = lock(&self.state);
            state.generation += 1;
            (state.running.take(), state.generation)
        };
        let Some(running) = running else { return };
        self.world.note("host", "the service is killed");
        self.killed.send_modify(|number| *number += 1);
        let (old, new) = (self.directory(generation - 1), self.directory(generation));
        copy(&old, &new);
        if torn {
            self.world.ashore.sleep(Duration::from_secs_f64(TORN_S)).await;
            let (before, after) = (read(&new, WRITE_AHEAD), read(&old, WRITE_AHEAD));
            if let Some(more) = after.strip_prefix(&before[..]) {
                let kept = lock(&self.rng).random_range(0..=more.len());
                let torn = [&before[..], &more[..kept]].concat();
                fs::write(new.join(WRITE_AHEAD), torn).expect("is written");
                self.world
                    .note("host", format!("{kept} of {} bytes reached the disk", more.len()));
            }
        }
        running.missions.close();
    }

    pub(super) fn move_directory(&self, away: bool) {
        let here = self.directory(lock(&self.state).generation);
        let there = here.with_extension("away");
        let (from, to) = if away { (here, there) } else { (there, here) };
        fs::rename(from, to).expect("is renamed");
    }

    pub(super) async fn fill_disk(&self, full: bool) {
        let store = lock(&self.state)
            .running
            .as_ref()
            .map(|running| running.store.clone());
        if let Some(store) = store {
            let limited = store.limit_growth(full.then_some(2)).await;
            self.world
                .note("host", format!("the disk is full: {full}, {limited:?}"));
        }
    }

    /// The answer of the service: status and body. Fails if there is none.
    pub(super) async fn ask(&self, request: Request) -> Result<(u16, Vec<u8>), String> {
        let mut killed = self.killed.subscribe();
        let router = lock(&self.state)
            .running
            .as_ref()
            .map(|running| running.router.clone());
        let router = router.ok_or("connection refused")?;
        let mut builder = HttpRequest::builder().uri(&request.path);
        if let Some(key) = &request.key {
            builder = builder.header("idempotency-key", key);
        }
        let built = match &request.body {
            None => builder.body(Body::empty()),
            Some(body) => builder
                .method("POST")
                .header(header::CONTENT_TYPE, "application/json")
                .body(Body::from(body.clone())),
        };
        let built = built.expect("is a request");
        let answered = async {
            let response = router.oneshot(built).await.expect("a router always answers");
            let status = response.status().as_u16();
            let body = to_bytes(response.into_body(), ANSWER_BYTES_MAX).await;
            (status, body.expect("is read").to_vec())
        };
        let (status, body) = tokio::select! {
            biased;
            _ = killed.changed() => return Err("connection reset".to_owned()),
            answered = answered => answered,
        };
        let path = request.path.rsplit('/').next().unwrap_or_default();
        let path = path.split('?').next().unwrap_or_default();
        self.world.note("host", format!("{status} {path}"));
        if (200..300).contains(&status) {
            self.learn(&request, &body);
        }
        Ok((status, body))
    }

    /// Takes note of what a client knows from an answer.
    fn learn(&self, request: &Request, body: &[u8]) {
        let Ok(answer) = serde_json::from_slice::<Value>(body) else {
            return;
        };
        let mut state = lock(&self.state);
        if request.path == "/v1/missions" && request.body.is_some() {
            let id = answer["id"].as_str().expect("a mission has an id").to_owned();
            let before = state.mission.get_or_insert(id.clone()).clone();
            drop(state);
            self.world
                .claim("one mission", before == id, || format!("{before}, then {id}"));
            return;
        }
        let Some(sequence) = answer["sequence"].as_u64() else {
            return;
        };
        if request.path.contains("/reference") {
            state.known_last = state.known_last.max(sequence);
            state.seen.insert(sequence, answer["plan"]["reference"].clone());
        } else if let Some(key) = &request.key {
            state.known_last = state.known_last.max(sequence);
            let first = *state.acknowledged.entry(key.clone()).or_insert(sequence);
            drop(state);
            self.world.claim("repeated", first == sequence, || {
                format!("{key} was event {first}, then {sequence}")
            });
        }
    }

    /// Compares what is stored in `directory` with what clients know.
    fn check_store(&self, directory: &Path) {
        let Some(mission) = self.mission() else { return };
        let world = &self.world;
        let reader = EventReader::of(directory).expect("the store can be read");
        let (listed, _) = reader.missions(0, 10, 0).expect("missions are listed");
        world.claim("one mission", listed.len() == 1, || {
            format!("{} missions", listed.len())
        });
        let Ok(Some(stored)) = reader.mission(&mission) else {
            return world.claim("acknowledged", false, || "the mission is gone".to_owned());
        };
        let events = match reader.events(stored.number, 0, usize::MAX) {
            Ok(events) => events,
            Err(error) => return world.claim("one history", false, || error.to_string()),
        };
        let numbers = events.iter().map(|event| event.sequence);
        world.claim("one history", numbers.eq(1..=events.len() as u64), || {
            "numbers have gaps".to_owned()
        });
        let mut state = lock(&self.state);
        let last = events.len() as u64;
        let known_last = state.known_last;
        world.claim("acknowledged", known_last <= last, || {
            format!("event {known_last} was acknowledged, and the last one is {last}")
        });
        for event in events.iter().filter(|event| event.sequence <= known_last) {
            let mut digest = DefaultHasher::new();
            (&event.kind, &event.body).hash(&mut digest);
            let digest = digest.finish();
            let before = *state.history.entry(event.sequence).or_insert(digest);
            world.claim("one history", before == digest, || {
                format!("event {} changed", event.sequence)
            });
        }
        for (sequence, reference) in std::mem::take(&mut state.seen) {
            let Some(event) = events.get(usize::try_from(sequence).expect("is small") - 1) else {
                continue;
            };
            let body: Value = serde_json::from_slice(&event.body).expect("events are JSON");
            let holds = event.kind == "planned" && is_within(&body, &reference["heading_rad"]);
            world.claim("plans", holds, || {
                format!("event {sequence} is not the plan that a client saw")
            });
        }
        for (key, &sequence) in &state.acknowledged {
            let event = events.get(usize::try_from(sequence).expect("is small") - 1);
            let kind = event.map_or("missing", |event| event.kind.as_str());
            let reports = kind == "reported" || kind == "ran" || kind == "paused";
            world.claim("acknowledged", reports, || {
                format!("event {sequence} of {key} is {kind}")
            });
        }
    }

    /// What the store must hold after the voyage.
    pub(super) async fn check_at_the_end(&self) {
        if self.world.is_broken() {
            return;
        }
        if lock(&self.state).running.is_none() {
            self.start().await;
        }
        // Commands that were sent are carried out.
        self.world.ashore.sleep(Duration::from_secs(15)).await;
        let directory = self.directory(lock(&self.state).generation);
        self.check_store(&directory);
        let Some(mission) = self.mission() else {
            return self
                .world
                .claim("one mission", false, || "there is none".to_owned());
        };
        let reader = EventReader::of(&directory).expect("the store can be read");
        let stored = reader.mission(&mission).expect("is read").expect("is there");
        let events = reader.events(stored.number, 0, usize::MAX).expect("are read");
        let mut log = vec![];
        let mut operators: BTreeMap<String, u64> = BTreeMap::new();
        for event in &events {
            log.push(event.kind.clone());
            let body: Value = serde_json::from_slice(&event.body).expect("events are JSON");
            for text in texts(&body) {
                if text.starts_with("operator ") {
                    *operators.entry(text.clone()).or_default() += 1;
                }
                log.push(text);
            }
        }
        let twice = operators.iter().find(|(_, n)| **n != 1);
        self.world.claim("acknowledged", twice.is_none(), || {
            format!("{twice:?} times in the log")
        });
        self.world.checker().log = log;
        let replayed = replay(&reader, &mission, &mut |_, _| {})
            .expect("is replayed")
            .expect("is there");
        // A planner that lied is another one now.
        let lied = planners::has_lied();
        self.world
            .claim("replay", lied || replayed.different.is_empty(), || {
                format!("plans {:?} have another answer", replayed.different)
            });
    }
}

/// Texts of the notes in an event, at any depth.
fn texts(value: &Value) -> Vec<String> {
    match value {
        Value::Object(members) => members
            .iter()
            .flat_map(|(name, value)| match value.as_str() {
                Some(text) if name == "text" => vec![text.to_owned()],
                _ => texts(value),
            })
            .collect(),
        Value::Array(items) => items.iter().flat_map(texts).collect(),
        _ => vec![],
    }
}

/// Whether `wanted` is anywhere in `value`.
fn is_within(value: &Value, wanted: &Value) -> bool {
    value == wanted
        || match value {
            Value::Object(members) => members.values().any(|value| is_within(value, wanted)),
            Value::Array(items) => items.iter().any(|value| is_within(value, wanted)),
            _ => false,
        }
}

fn read(directory: &Path, name: &str) -> Vec<u8> {
    fs::read(directory.join(name)).unwrap_or_default()
}

fn copy(from: &Path, to: &Path) {
    fs::create_dir(to).expect("is made");
    for entry in fs::read_dir(from).expect("is there") {
        let entry = entry.expect("is there");
        // Shared memory of a dead process.
        if !entry.file_name().to_string_lossy().ends_with("-shm") {
            fs::copy(entry.path(), to.join(entry.file_name())).expect("is copied");
        }
    }
}
