//! The processes of the services, and the disk of one or the database of two.

use std::cell::Cell;
use std::collections::BTreeMap;
use std::fs;
use std::hash::{DefaultHasher, Hash as _, Hasher as _};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, Weak};
use std::time::Duration;

use axum::Router;
use axum::body::{Body, to_bytes};
use axum::http::{HeaderValue, Request as HttpRequest, Response as HttpResponse, header};
use rand::RngExt as _;
use rand_chacha::ChaCha8Rng;
use serde_json::Value;
use service::missions::Missions;
use service::missions::replay::replay;
use service::{InProcess, MayHaveArrived, Settings};
use store::{EventReader, EventStore, Member, Trouble};
use tempfile::TempDir;
use tokio::sync::watch;
use tower::ServiceExt as _;

use super::database::{Database, name};
use super::faults::{Fault, Kind};
use super::{World, lock, planners, rng};
use crate::client::{get, post, with};

/// Longest answer read, bytes.
const ANSWER_BYTES_MAX: usize = 16 << 20;
/// Files of a store: SQLite's, and the list of acknowledged events.
const WRITE_AHEAD: &str = "missions.sqlite3-wal";
/// Time for which a service keeps its missions without the database: the default of `--lease-s`.
const LEASE: Duration = Duration::from_secs(2);
/// Time between two turns of a service.
const TURN: Duration = Duration::from_millis(250);
/// Time until missions get another owner: a lease, two eighths of one, and a turn.
const TAKE_OVER: Duration = Duration::from_millis(2_000 + 500 + 250);
/// Delay between services, each way.
const BETWEEN: Duration = Duration::from_millis(2);

tokio::task_local! {
    /// `true` if the request under way was forwarded.
    static FORWARDED: Cell<bool>;
}

/// Duration of the writes that a power cut tears, s.
const TORN_S: f64 = 1.2;

/// A request to the service: a POST if it has a body.
#[derive(Clone, Debug)]
pub(super) struct Request {
    pub(super) path: String,
    pub(super) key: Option<String>,
    pub(super) body: Option<Vec<u8>>,
}

pub(super) struct Host {
    world: Arc<World>,
    /// On the memory disk, where a sync costs nothing; tests of real processes use a real disk.
    root: TempDir,
    /// The database of two services.
    database: Option<Database>,
    pub(super) n_services: usize,
    state: Mutex<State>,
    killed: [watch::Sender<u64>; 2],
    rng: Mutex<ChaCha8Rng>,
}

#[derive(Default)]
struct State {
    /// Number of the store's directory: a kill leaves the previous one unchanged.
    generation: u64,
    running: [Option<Running>; 2],
    /// Trouble of each service's connections to the database.
    troubles: [Option<Trouble>; 2],
    /// Time at which each service lost the database, s.
    cut_since_s: [Option<f64>; 2],
    mission: Option<String>,
    /// The highest number that a client knows.
    known_last: u64,
    /// Answers to keys: the events' numbers, and a member of each report.
    acknowledged: BTreeMap<String, (u64, Option<Value>)>,
    /// References that clients got, by the number of their plan.
    seen: BTreeMap<u64, Value>,
    /// Digests of known events, by number.
    history: BTreeMap<u64, u64>,
}

struct Running {
    router: Router,
    missions: Missions,
    store: EventStore,
}

impl Host {
    pub(super) fn new(world: &Arc<World>, seed: u64, database: Option<Database>) -> Self {
        let root = tempfile::tempdir_in("/dev/shm").or_else(|_| tempfile::tempdir());
        Self {
            world: Arc::clone(world),
            root: root.expect("a directory can be made"),
            n_services: 1 + usize::from(database.is_some()),
            database,
            state: Mutex::default(),
            killed: Default::default(),
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

    /// URLs of the services.
    pub(super) fn urls(&self) -> Vec<String> {
        (0..self.n_services).map(name).collect()
    }

    pub(super) async fn start(self: &Arc<Self>, service: usize) {
        let clock = &self.world.ashore[service];
        let store = match &self.database {
            None => EventStore::open(&self.directory(lock(&self.state).generation), clock),
            Some(database) => {
                let member = Member { url: name(service), lease: LEASE };
                EventStore::open_database(&database.url_for(service), Some(member), u64::MAX, clock)
            }
        };
        let store = store.expect("the store opens");
        if let Some(database) = &self.database {
            database.watch();
            // Beats of the lease and turns of the service are at different times.
            let later = lock(&self.rng).random_range(Duration::ZERO..TURN);
            self.world.aboard.sleep(later).await;
        }
        let others = Arc::downgrade(self);
        let settings = Settings {
            clock: clock.clone(),
            plan: planners::plan,
            planners: 2,
            others: Some(InProcess(Arc::new(move |request| {
                let _ = FORWARDED.try_with(|forwarded| forwarded.set(true));
                Box::pin(forwarded(Weak::clone(&others), request))
            }))),
            ..Settings::default()
        };
        let started = service::service(settings, store.clone()).await;
        let (router, missions) = started.expect("the service starts");
        self.world.note("host", format!("service {service} starts"));
        let probed = store.probe().await;
        let otherwise = || format!("{probed:?}");
        self.world.claim("no loss reported", probed.is_ok(), otherwise);
        self.check_store();
        let mut state = lock(&self.state);
        store.trouble(state.troubles[service]);
        state.running[service] = Some(Running { router, missions, store });
    }

    /// Kills the service; with `torn`, in the middle of its next write. Later writes do not count.
    pub(super) async fn kill(&self, service: usize, torn: bool) {
        let (running, generation) = {
            let mut state = lock(&self.state);
            state.generation += u64::from(self.database.is_none());
            (state.running[service].take(), state.generation)
        };
        let Some(running) = running else { return };
        self.world.note("host", format!("service {service} is killed"));
        self.killed[service].send_modify(|number| *number += 1);
        running.store.trouble(Some(Trouble::Cut));
        if self.database.is_none() {
            let (old, new) = (self.directory(generation - 1), self.directory(generation));
            copy(&old, &new);
            if torn {
                self.world.aboard.sleep(Duration::from_secs_f64(TORN_S)).await;
                let (before, after) = (read(&new, WRITE_AHEAD), read(&old, WRITE_AHEAD));
                if let Some(more) = after.strip_prefix(&before[..]) {
                    let kept = lock(&self.rng).random_range(0..=more.len());
                    let torn = [&before[..], &more[..kept]].concat();
                    fs::write(new.join(WRITE_AHEAD), torn).expect("is written");
                    let said = format!("{kept} of {} bytes reached the disk", more.len());
                    self.world.note("host", said);
                }
            }
        }
        running.missions.close();
    }

    /// Makes the service hand over its missions and end.
    pub(super) async fn stop(&self, service: usize) {
        let running = lock(&self.state).running[service].take();
        let Some(running) = running else { return };
        self.world.note("host", format!("service {service} stops"));
        running.missions.stop().await;
        self.killed[service].send_modify(|number| *number += 1);
        running.store.trouble(Some(Trouble::Cut));
    }

    /// Begins or ends a fault of the database or its connections.
    pub(super) fn trouble(&self, fault: &Fault, begins: bool) {
        #[expect(clippy::cast_possible_truncation, reason = "is small")]
        let each = fault.size as u32;
        let trouble = match fault.kind {
            Kind::DatabaseFull => Trouble::Full,
            Kind::ConnectionsLost => Trouble::Gone(each),
            Kind::DatabaseAnswersLost => Trouble::Unanswered(each),
            Kind::LeaseNotRenewed => Trouble::NoBeat,
            _ => Trouble::Cut,
        };
        let trouble = begins.then_some(trouble);
        let since_s = matches!(trouble, Some(Trouble::Cut | Trouble::NoBeat)).then(|| self.world.t_s());
        let mut state = lock(&self.state);
        for service in 0..self.n_services {
            if fault.kind.leaves_another() && service != fault.service {
                continue;
            }
            (state.troubles[service], state.cut_since_s[service]) = (trouble, since_s);
            if let Some(running) = &state.running[service] {
                running.store.trouble(trouble);
            }
        }
    }

    /// `true` if the other service can take this one's missions at once.
    pub(super) fn is_replaced(&self, service: usize) -> bool {
        let state = lock(&self.state);
        let other = 1 - service;
        self.database.is_some() && state.running[other].is_some() && state.troubles[other].is_none()
    }

    /// Claims that the missions of this service get another owner in time.
    pub(super) async fn expect_taken(self: Arc<Self>, service: usize, kind: Kind) {
        let is_told = kind == Kind::ServiceStopped;
        let within = if is_told { TURN } else { TAKE_OVER };
        self.world.aboard.sleep(within).await;
        let Some(database) = &self.database else { return };
        // A fault may have struck the other one meanwhile.
        let quiet_s = self.world.now().quiet_s(self.world.t_s());
        if within.as_secs_f64() <= quiet_s && self.mission().is_some() {
            let owner = database.owner();
            let taken = owner == Some(name(1 - service));
            self.world.claim("take-over", taken, || {
                format!("{within:?} after {kind} ({service}) the owner is {owner:?}")
            });
        }
    }

    pub(super) fn move_directory(&self, away: bool) {
        let here = self.directory(lock(&self.state).generation);
        let there = here.with_extension("away");
        let (from, to) = if away { (here, there) } else { (there, here) };
        fs::rename(from, to).expect("is renamed");
    }

    pub(super) async fn fill_disk(&self, full: bool) {
        let running = |state: &State| Some(state.running[0].as_ref()?.store.clone());
        let store = running(&lock(&self.state));
        if let Some(store) = store {
            let limited = store.limit_growth(full.then_some(2)).await;
            let said = format!("the disk is full: {full}, {limited:?}");
            self.world.note("host", said);
        }
    }

    /// The answer of a service: status and body. Fails if there is none.
    pub(super) async fn ask(&self, service: usize, request: Request) -> Result<(u16, Vec<u8>), String> {
        let mut built = match &request.body {
            None => get(&request.path),
            Some(body) => post(&request.path, body.clone()),
        };
        if let Some(key) = &request.key {
            built = with(built, "idempotency-key", key);
        }
        let (status, body) = self.answer(service, built).await?;
        if (200..300).contains(&status) {
            self.learn(&request, &body);
        }
        Ok((status, body))
    }

    async fn answer(&self, service: usize, request: HttpRequest<Body>) -> Result<(u16, Vec<u8>), String> {
        let mut killed = self.killed[service].subscribe();
        let running = |state: &State| Some(state.running[service].as_ref()?.router.clone());
        let router = running(&lock(&self.state)).ok_or("connection refused")?;
        let path = request.uri().path().rsplit('/').next();
        let path = path.unwrap_or_default().to_owned();
        let answered = FORWARDED.scope(Cell::new(false), async {
            let response = router.oneshot(request).await.expect("a router always answers");
            let status = response.status().as_u16();
            let body = to_bytes(response.into_body(), ANSWER_BYTES_MAX).await;
            (status, body.expect("is read").to_vec(), FORWARDED.with(Cell::get))
        });
        let (status, body, forwarded) = tokio::select! {
            biased;
            _ = killed.changed() => return Err("connection reset".to_owned()),
            answered = answered => answered,
        };
        let by = if forwarded { "through" } else { "by" };
        self.world.note("host", format!("{status} {path} {by} {service}"));
        if let Some(database) = &self.database
            && status == 200
            && path == "reference"
            && !forwarded
        {
            let owner = database.owner();
            self.world.claim("one owner", owner == Some(name(service)), || {
                format!("service {service} answers, and the owner is {owner:?}")
            });
            let cut_s =
                lock(&self.state).cut_since_s[service].map_or(0.0, |since_s| self.world.t_s() - since_s);
            self.world.claim("one owner", cut_s <= LEASE.as_secs_f64(), || {
                format!("service {service} answers {cut_s:.2} s after its last answer of the database")
            });
        }
        Ok((status, body))
    }

    /// Notes a client's knowledge from an answer.
    fn learn(&self, request: &Request, body: &[u8]) {
        let Ok(answer) = serde_json::from_slice::<Value>(body) else { return };
        let mut state = lock(&self.state);
        if request.path == "/v1/missions" && request.body.is_some() {
            let id = answer["id"].as_str().expect("a mission has an id").to_owned();
            let before = state.mission.get_or_insert(id.clone()).clone();
            drop(state);
            let otherwise = || format!("{before}, then {id}");
            return self.world.claim("one mission", before == id, otherwise);
        }
        let Some(sequence) = answer["sequence"].as_u64() else { return };
        if request.path.contains("/reference") {
            state.known_last = state.known_last.max(sequence);
            state.seen.insert(sequence, answer["plan"]["reference"].clone());
        } else if let Some(key) = &request.key {
            state.known_last = state.known_last.max(sequence);
            let reported = || reported(request.body.as_deref()?, &answer);
            let (first, _) = *state.acknowledged.entry(key.clone()).or_insert_with(|| (sequence, reported()));
            drop(state);
            self.world
                .claim("repeated", first == sequence, || format!("{key} was event {first}, then {sequence}"));
        }
    }

    fn reader(&self) -> EventReader {
        let reader = match &self.database {
            None => EventReader::of(&self.directory(lock(&self.state).generation)),
            Some(database) => EventReader::of_database(database.url()),
        };
        reader.expect("the store can be read")
    }

    /// Compares the store with the knowledge of clients.
    fn check_store(&self) {
        let Some(mission) = self.mission() else { return };
        let world = &self.world;
        let reader = self.reader();
        let (listed, _) = reader.missions(0, 10, 0).expect("missions are listed");
        world.claim("one mission", listed.len() == 1, || format!("{} missions", listed.len()));
        let Ok(Some(stored)) = reader.mission(&mission) else {
            return world.claim("acknowledged", false, || "the mission is gone".to_owned());
        };
        let events = match reader.events(stored.number, 0, usize::MAX) {
            Ok(events) => events,
            Err(error) => return world.claim("one history", false, || error.to_string()),
        };
        let numbers = events.iter().map(|event| event.sequence);
        world.claim("one history", numbers.eq(1..=events.len() as u64), || "numbers have gaps".to_owned());
        if let Some(database) = &self.database {
            let stranger = database.stranger();
            world.claim("one owner", stranger.is_none(), || stranger.clone().unwrap_or_default());
        }
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
            world.claim("one history", before == digest, || format!("event {} changed", event.sequence));
        }
        for (sequence, reference) in std::mem::take(&mut state.seen) {
            let Some(event) = events.get(usize::try_from(sequence).expect("is small") - 1) else {
                continue;
            };
            let body: Value = serde_json::from_slice(&event.body).expect("events are JSON");
            let holds = event.kind == "planned" && is_within(&body, &reference["heading_rad"]);
            world.claim("plans", holds, || format!("event {sequence} is not the plan that a client saw"));
        }
        for (key, (sequence, reported)) in &state.acknowledged {
            let event = events.get(usize::try_from(*sequence).expect("is small") - 1);
            let kind = event.map_or("missing", |event| event.kind.as_str());
            let reports = kind == "reported" || kind == "ran" || kind == "paused";
            world.claim("acknowledged", reports, || format!("event {sequence} of {key} is {kind}"));
            if let Some((event, reported)) = event.zip(reported.as_ref()) {
                let body: Value = serde_json::from_slice(&event.body).expect("events are JSON");
                world.claim("acknowledged", is_within(&body, reported), || {
                    format!("event {sequence} of {key} is without {reported}")
                });
            }
        }
    }

    /// Checks the store after the voyage.
    pub(super) async fn check_at_the_end(self: &Arc<Self>) {
        if self.world.is_broken() {
            return;
        }
        for service in 0..self.n_services {
            if lock(&self.state).running[service].is_none() {
                self.start(service).await;
            }
        }
        // Commands that were sent are carried out.
        self.world.aboard.sleep(Duration::from_secs(15)).await;
        self.check_store();
        let Some(mission) = self.mission() else {
            let otherwise = || "there is none".to_owned();
            return self.world.claim("one mission", false, otherwise);
        };
        let reader = self.reader();
        let stored = reader.mission(&mission).expect("is read").expect("is there");
        let events = reader.events(stored.number, 0, usize::MAX).expect("are read");
        let mut log = vec![];
        let mut words: Vec<Value> = vec![];
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
            let warned = body.pointer("/prediction/warnings").and_then(Value::as_array);
            log.extend(
                warned.into_iter().flatten().filter_map(|said| Some(said["code"].as_str()?.to_owned())),
            );
            let said = body.pointer("/heard/steering").and_then(Value::as_array);
            for said in said.into_iter().flatten() {
                if said["state"] == "degraded" {
                    log.push(format!("warning: {}", said["why"]));
                }
                words.push(said.clone());
            }
        }
        self.world.checker().steered_s = steered_s(&words);
        let twice = operators.iter().find(|(_, n)| **n != 1);
        self.world.claim("acknowledged", twice.is_none(), || format!("{twice:?} times in the log"));
        self.world.checker().log = log;
        let replayed = replay(&reader, &mission, &mut |_, _| {}).expect("is replayed");
        let different = replayed.expect("is there").different;
        // A planner that lied is not the one that replays.
        let holds = planners::has_lied() || different.is_empty();
        let otherwise = || format!("plans {different:?} have another answer");
        self.world.claim("replay", holds, otherwise);
    }
}

/// A heading or a text of an accepted request.
fn reported(request: &[u8], answer: &Value) -> Option<Value> {
    let request: Value = serde_json::from_slice(request).ok()?;
    let places = ["/asc/0/state/heading_rad", "/notes/0/text"];
    let reported = places.iter().find_map(|place| request.pointer(place));
    reported.filter(|_| answer.get("rejected").is_none()).cloned()
}

/// The answer of another service to a forwarded call.
async fn forwarded(
    host: Weak<Host>,
    request: HttpRequest<Body>,
) -> Result<HttpResponse<Body>, MayHaveArrived> {
    let host = host.upgrade().ok_or(MayHaveArrived(false))?;
    let to = (0..host.n_services).find(|service| request.uri().to_string().starts_with(&name(*service)));
    let to = to.ok_or(MayHaveArrived(false))?;
    host.world.aboard.sleep(BETWEEN).await;
    if host.world.now().has(Kind::ServicesApart) {
        return std::future::pending().await;
    }
    if lock(&host.state).running[to].is_none() {
        return Err(MayHaveArrived(false));
    }
    let (status, body) = host.answer(to, request).await.map_err(|_| MayHaveArrived(true))?;
    host.world.aboard.sleep(BETWEEN).await;
    if host.world.now().has(Kind::ServicesApart) {
        return std::future::pending().await;
    }
    let mut response = HttpResponse::new(Body::from(body.clone()));
    *response.status_mut() = status.try_into().expect("is a status");
    let headers = response.headers_mut();
    headers.insert(header::CONTENT_TYPE, HeaderValue::from_static("application/json"));
    headers.insert(header::CONTENT_LENGTH, body.len().into());
    Ok(response)
}

/// Durations of sent references and, of these, of steering without a reservation, s, by the reports
/// of the steering. Each report counts until the next, for 3 s at most.
fn steered_s(words: &[Value]) -> [f64; 2] {
    let time = |said: &Value| said["t_s"].as_f64().unwrap_or(0.0);
    let mut steered_s = [0.0; 2];
    for pair in words.windows(2) {
        let lasts_s = (time(&pair[1]) - time(&pair[0])).clamp(0.0, 3.0);
        let is_on = pair[0]["state"] == "steering" || pair[0]["state"] == "degraded";
        let is_good = pair[0]["state"] == "steering" && pair[0]["why"].as_str().is_none_or(str::is_empty);
        steered_s[0] += if is_on { lasts_s } else { 0.0 };
        steered_s[1] += if is_good { lasts_s } else { 0.0 };
    }
    steered_s
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

/// `true` if `wanted` is anywhere in `value`.
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
