//! A service that is killed at any moment loses nothing acknowledged, stores nothing twice, and
//! resumes by itself. Deleted missions stay deleted, and every backup can be served. After a stop
//! signal the service does not wait for clients that only listen.
//!
//! More: `PILOTFISH_KILLS=200 PILOTFISH_STOPS=20 cargo test -p pilotfish --test soak kill`.

use std::collections::{HashMap, HashSet};
use std::io::{BufRead, BufReader, Read, Write};
use std::net::{Ipv4Addr, TcpListener, TcpStream};
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};
use std::{env, fs, thread};

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rustix::process::Signal;
use serde_json::{Value, json};
use tempfile::TempDir;
use tests::{client::Answer, server::Server};

use crate::command::{self, agent, json, try_ask};
use crate::{PATIENCE, ask_at, until_some};

/// Kills in one run, unless `PILOTFISH_KILLS` says otherwise.
const KILLS: usize = 5;
/// Orders to stop among them, unless `PILOTFISH_STOPS` says otherwise.
const STOPS: usize = 1;
/// Time from ready to the kill, ms: from before the first commit to after the first plan.
const LIFE_MS: RangeInclusive<u64> = 20..=600;
/// One life in so many lasts until a plan is made, to show that plans continue.
const PLANS_IN_ONE_OF: usize = 3;
/// Clients, each with an AUV of its own.
const CLIENTS: usize = 2;
/// One additional mission in so many is kept, the others are deleted.
const KEPT_ONE_OF: u64 = 20;
/// Pause between two additional missions.
const PAUSE_BESIDE: Duration = Duration::from_millis(10);
/// Pause between two backups.
const PAUSE_OF_BACKUPS: Duration = Duration::from_secs(1);
/// Time between two plans, s: the shortest allowed.
const PERIOD_S: f64 = 0.5;
/// Time for open requests after a stop signal.
const DRAIN: Duration = Duration::from_secs(10);
/// Ports below those of outgoing connections: an outgoing connection to a port without a service
/// can connect to itself, and the service then finds its port in use.
const PORTS: RangeInclusive<u16> = 20_000..=29_999;

/// Data directory and port of a service that is started again and again.
pub(crate) struct Home {
    pub(crate) folder: TempDir,
    pub(crate) port: u16,
}

impl Home {
    pub(crate) fn new() -> Self {
        let free = |port: &u16| TcpListener::bind((Ipv4Addr::LOCALHOST, *port)).is_ok();
        // Tests that run at the same time begin their search at different places.
        let seed = unix_now().to_bits() ^ u64::from(std::process::id());
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut ports = std::iter::repeat_with(|| random.random_range(PORTS));
        Self {
            folder: tempfile::tempdir().expect("a folder"),
            port: ports.find(free).expect("some port is free"),
        }
    }

    pub(crate) fn data(&self) -> PathBuf {
        self.folder.path().join("data")
    }

    pub(crate) fn url(&self, path: &str) -> String {
        format!("http://127.0.0.1:{}/v1/missions{path}", self.port)
    }

    pub(crate) fn serve(&self) -> Command {
        serve_in(&self.data())
    }

    pub(crate) fn start(&self) -> Server {
        Server::start_on(self.serve(), self.port)
    }

    /// The id of a new running live mission.
    pub(crate) fn mission(&self) -> String {
        running_mission(&self.url(""))
    }

    /// Waits for a plan made after `time`, Unix time, s.
    pub(crate) fn await_plan(&self, mission: &str, time: f64) {
        let reference = self.url(&format!("/{mission}/reference?wait_s=5"));
        until_some(&format!("no plan after {time}"), || {
            ask_at("GET", &reference, "").json()["t_s"].as_f64().filter(|made| time < *made)
        });
    }

    /// All events of a mission.
    pub(crate) fn record(&self, mission: &str) -> Vec<Value> {
        record_at(&self.url(&format!("/{mission}")))
    }
}

/// The id of a new running live mission at the service with these missions.
pub(crate) fn running_mission(url: &str) -> String {
    let made = ask_at("POST", url, &live_mission()).expected(201);
    let id = made["id"].as_str().expect("it has a name").to_owned();
    let running = ask_at("POST", &format!("{url}/{id}/run"), "{}").expected(200);
    assert_eq!(running["status"], "running");
    id
}

/// All events of the mission at `url`.
pub(crate) fn record_at(url: &str) -> Vec<Value> {
    let answer = ask_at("GET", &format!("{url}/record?format=events_ndjson"), "");
    assert_eq!(answer.status, 200, "{}", answer.text);
    answer.text.lines().map(json).collect()
}

fn serve_in(data: &Path) -> Command {
    let mut serve = pilotfish();
    serve.arg("serve").arg("--data").arg(data);
    serve
}

pub(crate) fn live_mission() -> String {
    let auvs: Vec<String> = (0..CLIENTS).map(auv).collect();
    let listed: Vec<Value> = auvs.iter().map(|id| json!({ "id": id })).collect();
    let goal = json!({ "kind": "midpoint", "auvs": auvs });
    let live = json!({ "auvs": listed, "goal": goal, "period_s": PERIOD_S });
    json!({ "schema_version": "1.0", "live": live }).to_string()
}

pub(crate) fn pilotfish() -> Command {
    let mut command = command::pilotfish();
    // Every start and stop would be logged.
    command.env("RUST_LOG", "error");
    command
}

pub(crate) fn unix_now() -> f64 {
    SystemTime::now().duration_since(UNIX_EPOCH).expect("the clock is set").as_secs_f64()
}

/// Orders a service to stop; fails if it does not end, or ends otherwise.
pub(crate) fn terminate(server: &mut Server) {
    command::signal(&server.process, Signal::TERM);
    let ended = until_some("it does not end", || server.process.try_wait().expect("is ours"));
    assert!(ended.success());
}

/// The AUV that a client reports.
fn auv(client: usize) -> String {
    format!("auv-{}", client + 1)
}

/// Distance east of a client's AUV, m, which goes north.
fn lane_m(client: usize) -> f64 {
    if client == 0 { 0.0 } else { 60.0 }
}

/// A post that differs from every other one by the position of its AUV.
#[derive(Clone, Copy)]
pub(crate) struct Post {
    client: usize,
    counter: u32,
}

impl Post {
    fn key(self) -> String {
        format!("{}-{}", self.client, self.counter)
    }

    /// A millimetre further north with every post: some hundred a second are a vehicle's pace.
    fn north_m(self) -> f64 {
        1e-3 * f64::from(self.counter)
    }

    /// The value that identifies it in the log.
    fn mark(self) -> String {
        mark(&auv(self.client), &json!(self.north_m()))
    }

    fn body(self) -> String {
        let now = unix_now();
        let lane = lane_m(self.client);
        let fix = json!({ "t_s": now, "north_m": self.north_m(), "east_m": lane, "sigma_m": 1.0 });
        let state =
            json!({ "north_m": self.north_m(), "east_m": 30.0, "heading_rad": 0.0, "speed_mps": 0.2 });
        let asc = json!({ "t_s": now, "state": state });
        json!({ "auvs": { auv(self.client): [fix] }, "asc": [asc] }).to_string()
    }
}

/// serde_json prints every number as the shortest text that reads back as the same one.
fn mark(auv: &str, north_m: &Value) -> String {
    format!("{auv} at {north_m}")
}

/// An acknowledged post, and its number.
pub(crate) type Acknowledged = (Post, u64);

/// Runs `trouble` while clients post to `url` and repeat each post until it is acknowledged.
/// `trouble` gets the clients' counts of them. Returns its result and all acknowledged posts.
pub(crate) fn while_clients_post<T>(
    url: &str,
    trouble: impl FnOnce(&[AtomicU32]) -> T,
) -> (T, Vec<Acknowledged>) {
    let (stop, so_far) = (AtomicBool::new(false), [const { AtomicU32::new(0) }; CLIENTS]);
    thread::scope(|scope| {
        let (stop, so_far) = (&stop, &so_far);
        let spawn = |client: usize| scope.spawn(move || post(url, client, stop, &so_far[client]));
        let clients: Vec<_> = (0..CLIENTS).map(spawn).collect();
        let at_last = StopAtLast(stop);
        let result = trouble(so_far);
        drop(at_last);
        let acknowledged = clients.into_iter().flat_map(|client| client.join().expect("was answered well"));
        (result, acknowledged.collect())
    })
}

fn post(url: &str, client: usize, stop: &AtomicBool, so_far: &AtomicU32) -> Vec<Acknowledged> {
    let agent = agent();
    let mut posted = vec![];
    for counter in 0.. {
        if stop.load(Ordering::Relaxed) {
            break;
        }
        let post = Post { client, counter };
        let (key, body) = (post.key(), post.body());
        let headers = [("idempotency-key", &*key)];
        let sequence = until_some(SILENT, || {
            let answer = try_ask(&agent, "POST", url, &headers, &body);
            acknowledged(answer, (200, "sequence"), &[503, 504, 507])
        });
        posted.push((post, sequence.as_u64().expect("it has a number")));
        so_far.store(counter + 1, Ordering::SeqCst);
    }
    posted
}

/// Message for an acknowledgement that does not come.
const SILENT: &str = "nothing is acknowledged any more";

/// A member of an acknowledgement with this status; none if the service dies while it answers, or
/// refuses with one of these statuses.
fn acknowledged(
    answer: Result<Answer, ureq::Error>,
    (status, name): (u16, &str),
    refusals: &[u16],
) -> Option<Value> {
    let answer = answer.ok()?;
    let is_refusal = refusals.contains(&answer.status.as_u16());
    (!is_refusal).then(|| answer.expected(status)[name].clone())
}

/// Additional missions: acknowledged as created, and as deleted.
#[derive(Default)]
struct Beside {
    kept: Vec<String>,
    deleted: Vec<String>,
}

/// Creates missions, each until it is acknowledged, and deletes most of them.
fn make_and_delete(url: &str, stop: &AtomicBool) -> Beside {
    let agent = agent();
    let mut beside = Beside::default();
    for counter in 0.. {
        if stop.load(Ordering::Relaxed) {
            break;
        }
        let key = format!("beside-{counter}");
        let headers = [("idempotency-key", &*key)];
        let id = until_some(SILENT, || {
            let answer = try_ask(&agent, "POST", url, &headers, &live_mission());
            acknowledged(answer, (201, "id"), &[503])
        });
        let id = id.as_str().expect("it has a name").to_owned();
        if counter % KEPT_ONE_OF == 0 {
            beside.kept.push(id);
        } else {
            until_some(SILENT, || {
                let answer = try_ask(&agent, "DELETE", &format!("{url}/{id}"), &[], "").ok()?;
                match answer.status.as_u16() {
                    // An earlier attempt, whose answer a kill removed, deleted it.
                    204 | 404 => Some(()),
                    503 => None,
                    other => panic!("{id} cannot be deleted: {other}"),
                }
            });
            beside.deleted.push(id);
        }
        thread::sleep(PAUSE_BESIDE);
    }
    beside
}

/// Makes backups and checks each. Returns their number.
fn back_up_and_restore(home: &Home, mission: &str, so_far: &[AtomicU32], stop: &AtomicBool) -> usize {
    let copy = home.folder.path().join("copy");
    let mut copies = 0;
    while !stop.load(Ordering::Relaxed) {
        let before: Vec<u32> = so_far.iter().map(|n| n.load(Ordering::SeqCst)).collect();
        let mut back_up = pilotfish();
        back_up.arg("backup").arg(&copy).arg("--data").arg(home.data());
        let output = back_up.output().expect("the program starts");
        command::printed(&output);
        let mut restored = Server::start_on(serve_in(&copy), 0);
        let events = record_at(&format!("{}/v1/missions/{mission}", restored.url()));
        check_numbers(&events);
        let heard: HashSet<String> = of_kind(&events, "reported").flat_map(marks).collect();
        for (client, n) in before.into_iter().enumerate() {
            for counter in 0..n {
                let post = Post { client, counter };
                assert!(heard.contains(&post.mark()), "{} is missing", post.key());
            }
        }
        terminate(&mut restored);
        check_replay(&copy, mission);
        fs::remove_dir_all(&copy).expect("is ours");
        copies += 1;
        thread::sleep(PAUSE_OF_BACKUPS);
    }
    copies
}

/// Stops the clients, also when the test fails.
struct StopAtLast<'a>(&'a AtomicBool);

impl Drop for StopAtLast<'_> {
    fn drop(&mut self) {
        self.0.store(true, Ordering::Relaxed);
    }
}

/// Kills, stops and restarts the service so many times. Returns the times at which it was ready
/// again, Unix time, s, and the longest start.
fn end_again_and_again(
    home: &Home,
    mission: &str,
    (kills, stops): (usize, usize),
    mut server: Server,
) -> (Vec<f64>, Duration, Server) {
    let mut random = ChaCha8Rng::seed_from_u64(1);
    let (mut all_ready, mut longest) = (vec![], Duration::ZERO);
    let mut ready = unix_now();
    for life in 1..=kills + stops {
        if life % PLANS_IN_ONE_OF == 0 {
            home.await_plan(mission, ready);
        }
        thread::sleep(Duration::from_millis(random.random_range(LIFE_MS)));
        // Spread evenly.
        if (life - 1) * stops / (kills + stops) < life * stops / (kills + stops) {
            terminate(&mut server);
        }
        drop(server);
        let ended = Instant::now();
        server = home.start();
        longest = longest.max(ended.elapsed());
        ready = unix_now();
        all_ready.push(ready);
    }
    home.await_plan(mission, ready);
    (all_ready, longest, server)
}

#[test]
fn a_killed_service_loses_nothing_acknowledged_and_stores_nothing_twice() {
    let number = |name, usual| env::var(name).map_or(usual, |given| given.parse().expect("is a number"));
    let (kills, stops) = (number("PILOTFISH_KILLS", KILLS), number("PILOTFISH_STOPS", STOPS));
    let home = Home::new();
    let server = home.start();
    let mission = home.mission();
    let stop = AtomicBool::new(false);
    let url = home.url(&format!("/{mission}/reports"));
    let (((all_ready, longest, mut server), beside, copies), acknowledged) =
        while_clients_post(&url, |so_far| {
            thread::scope(|scope| {
                let beside = scope.spawn(|| make_and_delete(&home.url(""), &stop));
                let copies = scope.spawn(|| back_up_and_restore(&home, &mission, so_far, &stop));
                let at_last = StopAtLast(&stop);
                let ended = end_again_and_again(&home, &mission, (kills, stops), server);
                drop(at_last);
                let beside = beside.join().expect("was answered well");
                (ended, beside, copies.join().expect("every copy is whole"))
            })
        });
    let events = home.record(&mission);
    let found = ask_at("GET", &home.url(&format!("/{mission}")), "").expected(200);
    assert_eq!(found["status"], "running");
    for (ids, status) in [(&beside.kept, 200), (&beside.deleted, 404)] {
        for id in ids {
            let found = ask_at("GET", &home.url(&format!("/{id}")), "");
            assert_eq!(found.status, status, "{}", found.text);
        }
    }
    terminate(&mut server);

    check_numbers(&events);
    check_posts(&events, &acknowledged);
    let plans = of_kind(&events, "planned").filter_map(|event| event["t_s"].as_f64());
    let plans: Vec<f64> = plans.collect();
    for ready in all_ready {
        assert!(plans.iter().any(|made| ready < *made), "no plan after {ready}");
    }
    let replayed = check_replay(&home.data(), &mission);
    println!(
        "{kills} kills, {stops} stops: {} posts acknowledged, {} plans, at most {longest:?} from an end to the greeting, \
         {} missions made beside and kept, {} deleted, {copies} backups restored and replayed; {replayed}",
        acknowledged.len(),
        plans.len(),
        beside.kept.len(),
        beside.deleted.len(),
    );
}

fn of_kind<'a>(events: &'a [Value], kind: &'a str) -> impl Iterator<Item = &'a Value> {
    events.iter().filter(move |event| event["kind"] == kind)
}

/// The values that identify the posts of a `reported` event.
fn marks(event: &Value) -> impl Iterator<Item = String> {
    let fixes = event["heard"]["auvs"].as_object().expect("each has a fix");
    fixes.iter().map(|(auv, fixes)| mark(auv, &fixes[0]["north_m"]))
}

/// Events are numbered from 1 without gaps.
pub(crate) fn check_numbers(events: &[Value]) {
    for (number, event) in (1_u64..).zip(events) {
        assert_eq!(event["sequence"].as_u64(), Some(number), "{event}");
    }
}

/// Each acknowledged post is stored once, under its number, and no other post is.
pub(crate) fn check_posts(events: &[Value], acknowledged: &[Acknowledged]) {
    let mut stored: HashMap<String, &Value> = HashMap::new();
    for event in of_kind(events, "reported") {
        for mark in marks(event) {
            let before = stored.insert(mark, event);
            assert_eq!(before, None, "was stored twice, again as {event}");
        }
    }
    for (post, sequence) in acknowledged {
        let event = stored.remove(&post.mark());
        let found = event.and_then(|event| event["sequence"].as_u64());
        assert_eq!(found, Some(*sequence), "{} is lost or elsewhere", post.key());
    }
    // Every client repeated its last post until it was acknowledged.
    assert!(stored.is_empty(), "no client was told of {stored:?}");
}

/// The output of `replay`, which finds no difference.
pub(crate) fn check_replay(data: &Path, mission: &str) -> String {
    let mut replay = pilotfish();
    replay.args(["replay", mission, "--data"]).arg(data);
    let output = replay.output().expect("the program starts");
    let found = command::printed(&output);
    assert!(!found.trim().is_empty(), "it does not say what it found");
    found.trim().to_owned()
}

#[test]
fn a_stop_signal_ends_streams_and_waits_for_a_plan() {
    let home = Home::new();
    let mut server = home.start();
    let mission = home.mission();
    let asked = |path: &str| {
        let mut socket = TcpStream::connect(&server.address).expect("listens");
        socket.set_read_timeout(Some(PATIENCE)).expect("is a socket");
        let request = format!("GET /v1/missions/{mission}/{path} HTTP/1.1\r\nhost: localhost\r\n\r\n");
        socket.write_all(request.as_bytes()).expect("takes a request");
        BufReader::new(socket)
    };
    let mut stream = asked("events?after=0");
    let mut received = String::new();
    while !received.contains("event: ran") {
        assert_ne!(stream.read_line(&mut received).expect("goes on"), 0, "{received}");
    }
    // Without reports there is no plan to wait for.
    let mut wait = asked("reference?wait_s=60");
    thread::sleep(Duration::from_millis(300));
    let begun = Instant::now();
    terminate(&mut server);
    let took = begun.elapsed();
    assert!(took < DRAIN, "it took {took:?}");
    stream.read_to_string(&mut received).expect("ends");
    // The last chunk shows the client that the answer is complete.
    assert!(received.ends_with("\r\n0\r\n\r\n"), "{received}");
    let mut answer = String::new();
    wait.read_to_string(&mut answer).expect("is answered");
    assert!(answer.starts_with("HTTP/1.1 409"), "{answer}");
    command::has_all(&answer, &["no_plan_yet"]);
    println!("stopped after {took:?}");
}
