//! Machine failures lose no acknowledged data, open no access, and delete nothing by a wrong clock.
//!
//! `faults.c` is the failing machine. More power cuts than usual: `PILOTFISH_CUTS=100 cargo test -p
//! pilotfish --test soak faults -- --nocapture`.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::LazyLock;
use std::time::Duration;
use std::{env, fs, thread};

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use tempfile::TempDir;
use tests::server::Server;

use super::kill::{
    Home, check_numbers, check_posts, check_replay, pilotfish, terminate, unix_now, while_clients_post,
};
use crate::{
    ask_at,
    command::{ask, ask_as, has_all, printed, refusal, said},
    until,
};

/// Power cuts in one run, unless `PILOTFISH_CUTS` says otherwise.
const CUTS: usize = 6;

/// Bytes that a disk writes whole.
const SECTOR: usize = 512;

/// Numbers of the errors `EIO` and `ENOSPC`.
const IO: u8 = 5;
const FULL: u8 = 28;

const DAY_S: i64 = 86_400;

/// The failing machine, built once.
static MACHINE: LazyLock<(TempDir, PathBuf)> = LazyLock::new(|| {
    let folder = tempfile::tempdir().expect("there is room");
    let library = folder.path().join("faults.so");
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/soak/faults.c");
    let mut build = Command::new("cc");
    build.args(["-O1", "-shared", "-fPIC", "-o"]).arg(&library).arg(source).arg("-ldl");
    assert!(build.status().expect("there is a C compiler").success());
    (folder, library)
});

/// The file in which a service finds its faults.
struct Faults {
    folder: TempDir,
}

impl Faults {
    fn new() -> Self {
        let faults = Self { folder: tempfile::tempdir().expect("there is room") };
        fs::create_dir(faults.durable()).expect("there is room");
        faults
    }

    fn durable(&self) -> PathBuf {
        self.folder.path().join("durable")
    }

    /// Lines such as `write 5 7`: every seventh write fails with error 5.
    fn disk(&self, rules: &str) {
        fs::write(self.folder.path().join("rules"), rules).expect("there is room");
    }

    /// Sets the clock of the programs that have these faults.
    fn clock(&self, ahead_s: i64) {
        fs::write(self.folder.path().join("clock"), ahead_s.to_string()).expect("there is room");
    }

    fn on(&self, program: &mut Command, data: &Path) {
        let here = |name: &str| self.folder.path().join(name);
        program
            .env("LD_PRELOAD", &MACHINE.1)
            .env("FAULTS_DATA", data)
            .env("FAULTS_DURABLE", self.durable())
            .env("FAULTS_RULES", here("rules"))
            .env("FAULTS_CLOCK", here("clock"));
    }

    fn start(&self, home: &Home) -> Server {
        let mut serve = home.serve();
        self.on(&mut serve, &home.data());
        Server::start_on(serve, home.port)
    }
}

/// The files of a killed service after a power cut: old or new content of each unsynced sector.
fn cut_the_power(faults: &Faults, data: &Path, random: &mut ChaCha8Rng) {
    let names = fs::read_dir(data).expect("is there");
    let names = names.map(|entry| entry.expect("is there").file_name());
    let names: BTreeSet<String> = names.map(|name| name.into_string().expect("is text")).collect();
    let read = |path: PathBuf| fs::read(path).unwrap_or_default();
    for name in names {
        let (now, synced) = (read(data.join(&name)), read(faults.durable().join(&name)));
        if name.ends_with("-shm") || (synced.is_empty() && random.random()) {
            fs::remove_file(data.join(&name)).expect("is there");
            continue;
        }
        let length = if random.random() { now.len() } else { synced.len() };
        let mut left = vec![0; length];
        for (i, sector) in left.chunks_mut(SECTOR).enumerate() {
            let mut sources = [&synced, &now];
            if random.random() {
                sources.reverse();
            }
            for source in sources {
                let from = source.get(i * SECTOR..).unwrap_or_default();
                let n = from.len().min(sector.len());
                sector[..n].copy_from_slice(&from[..n]);
            }
        }
        fs::write(data.join(&name), &left).expect("there is room");
        fs::write(faults.durable().join(&name), &left).expect("there is room");
    }
}

/// Posts during `trouble`, which ends with a ready service. All acknowledged posts are stored once.
fn check_through(home: &Home, mission: &str, trouble: impl FnOnce() -> Server) -> usize {
    let url = home.url(&format!("/{mission}/reports"));
    let (mut server, acknowledged) = while_clients_post(&url, |_| {
        let server = trouble();
        home.await_plan(mission, unix_now());
        server
    });
    until("it is ready", || ask(&server, "GET", "/readyz", "").status == 200);
    let events = home.record(mission);
    check_numbers(&events);
    check_posts(&events, &acknowledged);
    terminate(&mut server);
    println!("{}", check_replay(&home.data(), mission));
    acknowledged.len()
}

#[test]
fn a_power_cut_loses_nothing_acknowledged() {
    let cuts = env::var("PILOTFISH_CUTS").map_or(CUTS, |given| given.parse().expect("is a number"));
    let (home, faults) = (Home::new(), Faults::new());
    let mut server = faults.start(&home);
    let mission = home.mission();
    let mut random = ChaCha8Rng::seed_from_u64(2);
    let acknowledged = check_through(&home, &mission, || {
        for _ in 0..cuts {
            thread::sleep(Duration::from_millis(random.random_range(50..=1_500)));
            drop(server);
            cut_the_power(&faults, &home.data(), &mut random);
            server = faults.start(&home);
        }
        server
    });
    println!("{cuts} power cuts: {acknowledged} posts acknowledged, none lost");
}

#[test]
fn errors_of_the_disk_lose_nothing_acknowledged() {
    let (home, faults) = (Home::new(), Faults::new());
    let mut server = faults.start(&home);
    let mission = home.mission();
    let rules = [
        format!("write {IO} 5"),
        format!("sync {IO} 3"),
        format!("read {IO} 20"),
        format!("write {FULL} 1"),
        format!("write {FULL} 4\nsync {IO} 4\nread {IO} 50"),
        format!("sync {IO} 1"),
    ];
    let acknowledged = check_through(&home, &mission, || {
        for rule in &rules {
            thread::sleep(Duration::from_millis(500));
            faults.disk(rule);
            thread::sleep(Duration::from_secs(1));
            drop(server);
            faults.disk("");
            server = faults.start(&home);
        }
        // A disk that recovers needs no restart.
        faults.disk(&rules[0]);
        thread::sleep(Duration::from_secs(1));
        faults.disk("");
        server
    });
    let n_kinds = rules.len() + 1;
    println!("{n_kinds} kinds of errors: {acknowledged} posts acknowledged, none lost");
}

/// A finished mission.
fn finished(home: &Home) -> String {
    let mission = home.mission();
    let _ = ask_at("POST", &home.url(&format!("/{mission}/finish")), "").expected(200);
    mission
}

#[test]
fn a_clock_that_jumps_a_year_ahead_deletes_no_mission() {
    let (home, faults) = (Home::new(), Faults::new());
    let keep = || {
        let mut serve = home.serve();
        serve.args(["--keep-days", "90"]);
        faults.on(&mut serve, &home.data());
        Server::start_on(serve, home.port)
    };
    let mut server = keep();
    let mission = finished(&home);
    terminate(&mut server);
    faults.clock(365 * DAY_S);
    let server = keep();
    // The service looks at once after its start.
    thread::sleep(Duration::from_secs(3));
    let _ = ask_at("GET", &home.url(&format!("/{mission}")), "").expected(200);
    drop(server);
    let retain = |more: &[&str]| {
        let mut retain = pilotfish();
        retain.args(["retention", "--days", "90", "--data"]).arg(home.data()).args(more);
        faults.on(&mut retain, &home.data());
        said(&retain.output().expect("the program starts"))
    };
    let kept = retain(&[]);
    has_all(&kept, &["365.0 days ahead", "0 missions deleted"]);
    has_all(&retain(&["--trust-clock"]), &["1 missions deleted"]);
}

fn token(home: &Home, arguments: &[&str], faults: Option<&Faults>) -> String {
    fs::create_dir_all(home.data()).expect("there is room");
    let mut add = pilotfish();
    add.args(["token", "add"]).args(arguments).arg("--data").arg(home.data());
    if let Some(faults) = faults {
        faults.on(&mut add, &home.data());
    }
    printed(&add.output().expect("the program starts")).trim().to_owned()
}

#[test]
fn a_clock_that_is_set_back_makes_no_expired_token_valid() {
    let (home, faults) = (Home::new(), Faults::new());
    let forever = token(&home, &["forever", "--role", "admin"], None);
    faults.clock(-2 * DAY_S);
    let expired = token(&home, &["expired", "--role", "admin", "--days", "1"], Some(&faults));
    for clock in [0, -2 * DAY_S] {
        faults.clock(clock);
        let mut server = faults.start(&home);
        let list = |token: &str| ask_as(&server, Some(token), "GET", "/v1/missions", "").status;
        assert_eq!(list(&forever), 200);
        assert_eq!(list(&expired), 401, "{clock}");
        terminate(&mut server);
    }
}

#[test]
fn a_service_that_had_tokens_does_not_run_without_them() {
    let home = Home::new();
    let server = home.start();
    let mission = finished(&home);
    let path = format!("/v1/missions/{mission}");
    // The first token comes while it runs.
    let admin = token(&home, &["admin", "--role", "admin"], None);
    until("the token has an effect", || ask(&server, "GET", &path, "").status == 401);
    thread::sleep(Duration::from_secs(3));
    drop(server);
    let tokens = home.data().join("tokens.json");
    let text = fs::read(&tokens).expect("is there");
    fs::remove_file(&tokens).expect("is there");
    let mut backup = pilotfish();
    let to = home.folder.path().join("copy");
    backup.arg("backup").arg(&to).arg("--data").arg(home.data());
    for program in [home.serve().args(["--port", "0"]), &mut backup] {
        let refused = program.output().expect("the program starts");
        has_all(refusal(&refused), &["the service had tokens"]);
    }
    assert!(!to.exists());
    fs::write(&tokens, text).expect("is written");
    let server = home.start();
    let delete = |token| ask_as(&server, token, "DELETE", &path, "").status;
    assert_eq!(delete(None), 401);
    assert_eq!(delete(Some(&admin)), 204);
}
