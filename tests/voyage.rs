//! Voyages in one process and in simulated time: one service with its store, or two with a shared
//! database, a bridge, an autopilot with its boat, an AUV with a modem, and an operator. Faults and
//! actions follow from a seed.
//!
//! ```text
//! faults ──► boat ⇄ wire ⇄ bridge ⇄ network ⇄ host (service, store, disk) ⇄ network ⇄ operator
//!               └───────────┴──────────┴── checker: every claim, against one history ─┘
//! ```
//! A voyage runs on one thread with Tokio's paused clock: a seed repeats its history to the byte.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::ops::Range;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::Duration;

use clock::Clock;
use rand::SeedableRng as _;
use rand_chacha::ChaCha8Rng;
use tokio::runtime::Builder;

mod bridge;
mod checker;
mod database;
mod faults;
mod host;
mod imc;
mod moos;
mod operator;
mod planners;
mod sea;
mod ships;
mod shown;

use bridge::BridgeProcess;
use checker::Checker;
pub use checker::{Entry, claims};
use database::Database;
pub use faults::Kind;
use faults::{Fault, Now, schedule};
use host::Host;
use operator::Operator;
use sea::Sea;
pub use shown::{Log, Shown};

/// Wall time at the start of every voyage, Unix time, s.
const START_S: f64 = 1.8e9;

/// Time without faults after which everything works, s.
const CLEAR_S: f64 = 30.0;

/// Duration of a service's fault after which the other service takes its missions, s.
const TAKES_S: f64 = 4.0;

/// One seed in this many has two services.
const SHARED: u64 = 10;

/// Course of a voyage.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Course {
    /// Its duration, s.
    pub duration_s: f64,
    /// `true`: no faults.
    pub is_nominal: bool,
    /// The only fault, of known begin and end, in a voyage that shows it.
    pub only: Option<Kind>,
    /// `true`: two services share a database. None: every tenth seed. Never without PostgreSQL.
    pub is_shared: Option<bool>,
    /// `true`: the bridge may not move the boat, which with an odd seed is guided and armed.
    pub is_dry: bool,
    /// What the boat speaks.
    pub wire: Wire,
}

/// A wire to a boat.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Wire {
    /// A stream that may be damaged.
    #[default]
    Mavlink,
    /// A connection to a MOOSDB, which may be cut or delayed.
    Moos,
    /// Datagrams of IMC, which may be lost, doubled or damaged.
    Imc,
}

/// Result of a voyage.
#[derive(Clone, Debug, PartialEq)]
pub struct Voyage {
    /// Its seed.
    pub seed: u64,
    /// Simulated time, s.
    pub duration_s: f64,
    /// Number of faults injected, by kind.
    pub faults: BTreeMap<Kind, u64>,
    /// Durations of sent references and, of these, of steering without a reservation, s.
    pub steered_s: [f64; 2],
    /// Displays during the only fault.
    pub shown: Vec<Shown>,
    /// Number of checks of each claim.
    pub claims: BTreeMap<&'static str, u64>,
    /// The first claim that did not hold.
    pub broken: Option<String>,
    /// The newest events.
    pub last: Vec<Entry>,
    /// Digest of the whole history.
    pub digest: u64,
}

impl Voyage {
    /// The voyage in words: broken claim, faults and newest events.
    pub fn told(&self) -> String {
        let broken = self.broken.as_deref().unwrap_or("every claim holds");
        let faults: Vec<String> = self.faults.iter().map(|(kind, n)| format!("{n} {kind}")).collect();
        let mut told = format!(
            "seed {}: {broken}\nfaults: {}\n\n{:>10}  {:<9} event\n",
            self.seed,
            faults.join(", "),
            "time, s",
            "who"
        );
        for Entry { t_s, who, what } in &self.last {
            writeln!(told, "{t_s:10.3}  {who:<9} {what}").expect("a string takes all that is written to it");
        }
        told + "\ntime since the start of the voyage; who did it: sea (boat, AUV), wire (between boat and bridge), bridge, network\n\
                (between bridge, operator and service), host (service and store), operator, fault (begins, ends)\n"
    }
}

/// State that all parts of a voyage share.
struct World {
    /// The clock of the boat's computer, where the bridge runs.
    aboard: Clock,
    /// The clocks of the machines of the services.
    ashore: [Clock; 2],
    start: std::time::Instant,
    course: Course,
    checker: Mutex<Checker>,
    /// The faults that are active.
    now: Mutex<Now>,
}

impl World {
    /// Time since the start, s.
    fn t_s(&self) -> f64 {
        self.aboard.since(self.start).as_secs_f64()
    }

    fn checker(&self) -> MutexGuard<'_, Checker> {
        lock(&self.checker)
    }

    fn now(&self) -> MutexGuard<'_, Now> {
        lock(&self.now)
    }

    fn note(&self, who: &'static str, what: impl Into<String>) {
        let t_s = self.t_s();
        self.checker().note(t_s, who, what.into());
    }

    /// Checks the claim `name`; `otherwise` gives the observation that breaks it.
    fn claim(&self, name: &'static str, holds: bool, otherwise: impl FnOnce() -> String) {
        let t_s = self.t_s();
        self.checker().claim(t_s, name, holds, otherwise);
    }

    fn is_broken(&self) -> bool {
        self.checker().broken.is_some()
    }
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Random numbers of one part: another draw of one part changes no other.
fn rng(seed: u64, part: u64) -> ChaCha8Rng {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(part);
    rng
}

/// Sails the voyage of `seed`.
pub fn sail(seed: u64, course: Course) -> Voyage {
    let log = Log::default();
    let listen = || course.only.map(|_| log.listen());
    // With one subscriber, the thread that logs first, of any voyage, decides what is logged.
    let (_first, _second) = (listen(), listen());
    let runtime = Builder::new_current_thread().enable_time().start_paused(true).build();
    runtime.expect("a runtime starts").block_on(sailed(seed, course, log.clone()))
}

/// Sails the voyages of `seeds` on this many threads, else one on each processor, while `goes_on`.
pub fn sail_all(
    seeds: Range<u64>,
    course: Course,
    jobs: Option<usize>,
    goes_on: impl Fn(&Voyage) -> bool + Sync,
) -> Vec<Voyage> {
    let next = AtomicU64::new(seeds.start);
    let work = || {
        let mut voyages = vec![];
        loop {
            let seed = next.fetch_add(1, Ordering::Relaxed);
            if seeds.end <= seed {
                return voyages;
            }
            let voyage = sail(seed, course);
            if !goes_on(&voyage) {
                next.store(seeds.end, Ordering::Relaxed);
            }
            voyages.push(voyage);
        }
    };
    let jobs = jobs.unwrap_or_else(|| thread::available_parallelism().map_or(1, Into::into));
    thread::scope(|scope| {
        let workers: Vec<_> = (0..jobs).map(|_| scope.spawn(work)).collect();
        let joined = workers.into_iter().map(thread::ScopedJoinHandle::join);
        joined.flat_map(|voyages| voyages.unwrap_or_else(|panic| std::panic::resume_unwind(panic))).collect()
    })
}

async fn sailed(seed: u64, mut course: Course, log: Log) -> Voyage {
    if course.only.is_some() {
        course.duration_s = shown::DURATION_S;
    }
    let aboard = Clock::simulated(START_S);
    let world = Arc::new(World {
        start: aboard.now(),
        ashore: [(); 2].map(|()| Clock::simulated(START_S)),
        aboard,
        course,
        checker: Mutex::default(),
        now: Mutex::default(),
    });
    let is_shared = course.is_shared.unwrap_or(seed.is_multiple_of(SHARED));
    planners::begin(course.is_nominal || course.only.is_some());
    let host = Arc::new(Host::new(&world, seed, is_shared.then(Database::new).flatten()));
    for service in 0..host.n_services {
        host.start(service).await;
    }
    let sea = Arc::new(Sea::new(&world, seed));
    let mut bridge = BridgeProcess::new(&world, &sea, &host, seed);
    bridge.start();
    let operator = tokio::spawn(Operator::new(&world, &host, seed).run());
    let reading = (1 < host.n_services)
        .then(|| tokio::spawn(Operator::read(Arc::clone(&world), Arc::clone(&host), seed)));
    let sailing = tokio::spawn(Arc::clone(&sea).sail());
    let looking = course.only.map(|kind| {
        let (world, host, sea) = (Arc::clone(&world), Arc::clone(&host), Arc::clone(&sea));
        tokio::spawn(shown::look(world, host, sea, log, kind))
    });
    let faults = if let Some(kind) = course.only {
        vec![shown::only(kind)]
    } else if course.is_nominal {
        vec![]
    } else {
        schedule(&mut rng(seed, 0), course.duration_s, host.n_services)
    };
    let mut counts = BTreeMap::new();
    for fault in &faults {
        *counts.entry(fault.kind).or_default() += 1;
    }
    suffer(&world, &host, &sea, &mut bridge, &faults).await;
    let shown = match looking {
        Some(looking) => looking.await.expect("does not panic"),
        None => vec![],
    };
    operator.abort();
    reading.inspect(tokio::task::JoinHandle::abort);
    sailing.abort();
    bridge.kill();
    host.check_at_the_end().await;
    sea.expect_told_of_silence();
    let pauses = std::mem::take(&mut world.now().pauses);
    let is_shared = 1 < host.n_services;
    world.checker().expect_names(&faults, &pauses, course, is_shared);
    let checker = std::mem::take(&mut *world.checker());
    Voyage {
        seed,
        duration_s: world.t_s(),
        faults: counts,
        steered_s: checker.steered_s,
        shown,
        digest: checker.digest(),
        claims: checker.claims,
        broken: checker.broken,
        last: checker.last.into(),
    }
}

/// Begins and ends the faults at their times, until the voyage ends or a claim is broken.
async fn suffer(
    world: &Arc<World>,
    host: &Arc<Host>,
    sea: &Arc<Sea>,
    bridge: &mut BridgeProcess,
    faults: &[Fault],
) {
    let mut changes: Vec<(f64, usize, bool)> = vec![];
    for (number, fault) in faults.iter().enumerate() {
        changes.push((fault.begins_s, number, true));
        changes.push((fault.ends_s, number, false));
    }
    changes.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut changes = changes.into_iter().peekable();
    // The other service does everything.
    let mut replaced = vec![false; faults.len()];
    while world.t_s() < world.course.duration_s && !world.is_broken() {
        let next_s = changes.peek().map_or(f64::INFINITY, |(at_s, ..)| *at_s);
        // A broken claim ends a voyage within a second.
        let wait_s = (next_s.min(world.course.duration_s) - world.t_s()).clamp(0.0, 1.0);
        world.aboard.sleep(Duration::from_secs_f64(wait_s)).await;
        if world.t_s() < next_s {
            continue;
        }
        let Some((_, number, begins)) = changes.next() else { continue };
        let fault = &faults[number];
        world.note("fault", format!("{} {}", if begins { "begins:" } else { "ends:" }, fault.kind));
        if begins && fault.kind.leaves_another() {
            replaced[number] = world.now().is_quiet() && host.is_replaced(fault.service);
        }
        if !replaced[number] {
            world.now().change(fault.kind, begins, world.t_s());
        }
        let ashore = &world.ashore[fault.service];
        match (fault.kind, begins) {
            (Kind::ServiceKilled, true) => host.kill(fault.service, false).await,
            (Kind::ServiceStopped, true) => host.stop(fault.service).await,
            (Kind::PowerLostAshore, true) => host.kill(fault.service, true).await,
            (Kind::ServiceKilled | Kind::ServiceStopped | Kind::PowerLostAshore, false) => {
                host.start(fault.service).await;
            }
            (
                Kind::ServiceCutOff
                | Kind::LeaseNotRenewed
                | Kind::DatabaseDown
                | Kind::DatabaseFull
                | Kind::ConnectionsLost
                | Kind::DatabaseAnswersLost,
                begins,
            ) => host.trouble(fault, begins),
            (Kind::BridgeKilled, true) => bridge.kill(),
            (Kind::BridgeKilled, false) => bridge.start(),
            (Kind::ClockSetAshore, _) => ashore.set_by(if begins { fault.size } else { -fault.size }),
            (Kind::ClockSetAboard, _) => world.aboard.set_by(if begins { fault.size } else { -fault.size }),
            (Kind::SlowThreads, true) => ashore.delay_threads(Duration::from_secs_f64(fault.size)),
            (Kind::SlowThreads, false) => ashore.delay_threads(Duration::ZERO),
            (Kind::DirectoryAway, away) => host.move_directory(away),
            (Kind::DiskFull, full) => host.fill_disk(full).await,
            (kind, begins) => sea.change(kind, begins),
        }
        if begins && replaced[number] && TAKES_S < fault.ends_s - fault.begins_s {
            tokio::spawn(Arc::clone(host).expect_taken(fault.service, fault.kind));
        }
    }
}
