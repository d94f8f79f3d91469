//! Services that share missions through PostgreSQL: if one is killed or stopped, another continues
//! with all acknowledged data and the same plans.

use std::{
    sync::atomic::Ordering,
    thread,
    time::{Duration, Instant},
};

use rustix::process::Signal;
use serde_json::Value;
use tempfile::TempDir;
use tests::{
    postgres::{database, psql},
    server::{Server, certificate},
};

use super::kill::{
    Acknowledged, Home, PATIENCE, check_numbers, check_posts, ended, live_mission, pilotfish,
    running_mission, terminate, unix_now, while_clients_post,
};
use crate::{
    access::curl,
    ask_at,
    command::{self, agent, try_ask},
};

/// Longest time from the end of an owner to the first plan of the next: 3 s and a period at the
/// default lease, twice for a busy machine.
const REPLACED: Duration = Duration::from_secs(7);

/// Longest time without a plan when an owner is told to end: a period of 0.5 s, the plan, and a
/// busy machine. Without a hand-over it would be the lease of 2 s and more.
const HANDED_OVER: f64 = 2.0;

/// Services on one database, and a running mission of the first.
struct Fleet {
    url: String,
    _data: TempDir,
    services: Vec<Server>,
    mission: String,
}

impl Fleet {
    /// `None` without PostgreSQL.
    fn start(n_services: usize) -> Option<Self> {
        let url = database()?;
        let data = tempfile::tempdir().expect("there is room");
        let serve = |k: usize| {
            let mut serve = pilotfish();
            serve.args(["serve", "--store", &url, "--data"]);
            serve.arg(data.path().join(k.to_string()));
            Server::start_on(serve, 0)
        };
        let services: Vec<Server> = (0..n_services).map(serve).collect();
        let mission = running_mission(&format!("{}/v1/missions", services[0].url()));
        Some(Self {
            url,
            _data: data,
            services,
            mission,
        })
    }

    fn at(&self, service: usize) -> String {
        format!("{}/v1/missions/{}", self.services[service].url(), self.mission)
    }

    /// The service that has the mission: on a busy machine the first may have lost it.
    fn owner(&self) -> usize {
        let query = "SELECT url FROM missions JOIN services ON services.id = owner_service";
        let begun = Instant::now();
        loop {
            let owner = psql(&self.url, query);
            if let Some(found) = self.services.iter().position(|service| service.url() == owner) {
                return found;
            }
            assert!(begun.elapsed() < PATIENCE, "{owner:?} has the mission");
            thread::sleep(Duration::from_millis(20));
        }
    }

    fn record(&self, service: usize) -> Vec<Value> {
        super::kill::record_at(&self.at(service))
    }

    /// Waits for a plan made after `time`, Unix time, s. Returns the waiting time.
    fn await_plan(&self, service: usize, time: f64) -> Duration {
        let begun = Instant::now();
        loop {
            let url = format!("{}/reference?wait_s=1", self.at(service));
            let answer = try_ask(&agent(), "GET", &url, &[], "");
            let plan = answer.map_or(Value::Null, |answer| answer.json());
            if plan["t_s"].as_f64().is_some_and(|made| time < made) {
                return begun.elapsed();
            }
            assert!(begun.elapsed() < PATIENCE, "no plan after {time}: {plan}");
            thread::sleep(Duration::from_millis(20));
        }
    }

    /// The output of `replay`, which finds no difference.
    fn replay(&self) -> String {
        let mut replay = pilotfish();
        replay.args(["replay", &self.mission, "--store", &self.url]);
        let output = replay.output().expect("the program starts");
        assert!(
            output.status.success(),
            "{}",
            String::from_utf8_lossy(&output.stderr)
        );
        command::printed(&output)
    }

    /// Calls `disturb` with the owner and another service. Returns the posts acknowledged
    /// meanwhile.
    fn meanwhile(&mut self, disturb: impl FnOnce(&mut Self, usize, usize)) -> Vec<Acknowledged> {
        let owner = self.owner();
        let other = (owner + 1) % self.services.len();
        let url = format!("{}/reports", self.at(other));
        let ((), acknowledged) = while_clients_post(&url, |so_far| {
            while so_far.iter().any(|posts| posts.load(Ordering::SeqCst) == 0) {
                thread::sleep(Duration::from_millis(5));
            }
            self.await_plan(other, unix_now());
            disturb(self, owner, other);
        });
        acknowledged
    }

    /// Checks that acknowledged reports are stored once, in order, and plans repeatable. Returns
    /// times.
    fn check(&self, acknowledged: &[Acknowledged]) -> Vec<f64> {
        let events = self.record(self.owner());
        check_numbers(&events);
        check_posts(&events, acknowledged);
        println!("{}", self.replay().trim());
        let plans = events.iter().filter(|event| event["kind"] == "planned");
        plans.filter_map(|plan| plan["t_s"].as_f64()).collect()
    }

    fn signal(&self, service: usize, signal: Signal) {
        command::signal(&self.services[service].process, signal);
    }
}

/// The longest time between two plans, s.
fn longest_gap(plans: &[f64]) -> f64 {
    let gaps = plans.windows(2).map(|pair| pair[1] - pair[0]);
    gaps.fold(0.0, f64::max)
}

#[test]
fn another_service_continues_when_the_owner_is_killed() {
    let Some(mut fleet) = Fleet::start(3) else { return };
    let mut took = Duration::ZERO;
    let acknowledged = fleet.meanwhile(|fleet, owner, other| {
        fleet.services[owner].process.kill().expect("is ours");
        fleet.services[owner].process.wait().expect("is ours");
        took = fleet.await_plan(other, unix_now());
    });
    let plans = fleet.check(&acknowledged);
    println!(
        "{took:?} to the next plan, at most {:.2} s between two plans",
        longest_gap(&plans)
    );
    assert!(took < REPLACED, "{took:?}");
    assert_eq!(psql(&fleet.url, "SELECT count(*) FROM services"), "2");
}

#[test]
fn a_service_that_was_paused_neither_stores_nor_answers_as_the_owner() {
    let Some(mut fleet) = Fleet::start(2) else { return };
    let mut took = Duration::ZERO;
    let acknowledged = fleet.meanwhile(|fleet, owner, other| {
        fleet.signal(owner, Signal::STOP);
        took = fleet.await_plan(other, unix_now());
        fleet.signal(owner, Signal::CONT);
        // From now on it forwards to the other one, which makes new plans.
        let mut n_answered = 0;
        for _ in 0..20 {
            let asked = unix_now();
            let answer = ask_at("GET", &format!("{}/reference", fleet.at(owner)), "");
            if answer.status == 200 {
                let age = asked - answer.json()["t_s"].as_f64().expect("has a time");
                assert!(age < 2.0, "a reference of {age} s ago");
                n_answered += 1;
            }
            thread::sleep(Duration::from_millis(50));
        }
        assert!(0 < n_answered, "it forwards");
    });
    fleet.check(&acknowledged);
    println!("{took:?} to the next plan");
    assert!(took < REPLACED, "{took:?}");
}

#[test]
fn a_service_that_is_told_to_end_hands_over_its_missions() {
    let Some(mut fleet) = Fleet::start(2) else { return };
    let acknowledged = fleet.meanwhile(|fleet, owner, other| {
        terminate(&fleet.services[owner]);
        fleet.await_plan(other, unix_now());
        assert!(ended(&mut fleet.services[owner]).success());
        fleet.await_plan(other, unix_now());
    });
    let gap = longest_gap(&fleet.check(&acknowledged));
    println!("at most {gap:.2} s between two plans");
    assert!(gap < HANDED_OVER, "{gap} s");
}

#[test]
fn a_stream_has_the_same_numbers_at_every_service() {
    let Some(mut fleet) = Fleet::start(2) else { return };
    fleet.meanwhile(|_, _, _| {});
    let events = fleet.record(0);
    check_numbers(&events);
    let last = events.len() as u64;
    for service in 0..2 {
        let url = format!("{}/events", fleet.at(service));
        let answer = agent()
            .get(url)
            .header("Last-Event-ID", (last - 3).to_string())
            .call();
        let mut stream = answer.expect("the service answers").into_body().into_reader();
        let mut text = String::new();
        while !text.contains(&format!("id: {last}\n")) {
            let mut chunk = [0; 4096];
            let n = std::io::Read::read(&mut stream, &mut chunk).expect("goes on");
            assert_ne!(n, 0, "{text}");
            text.push_str(&String::from_utf8_lossy(&chunk[..n]));
        }
        let numbers = text.lines().filter_map(|line| line.strip_prefix("id: ")).take(3);
        let numbers: Vec<u64> = numbers
            .map(|number| number.parse().expect("is a number"))
            .collect();
        assert_eq!(numbers, [last - 2, last - 1, last], "{text}");
    }
}

#[test]
fn services_with_certificates_call_only_each_other_by_https() {
    let Some(store) = database() else { return };
    let folders = [(); 3].map(|()| tempfile::tempdir().expect("there is room"));
    // The first two have the same self-signed one.
    let files = [0, 0, 1].map(|k: usize| certificate(folders[k].path()));
    let serve = |k: usize| {
        let (certificate, key) = &files[k];
        let mut serve = pilotfish();
        serve.args(["serve", "--store", &store, "--advertise-ca", certificate]);
        serve.args(["--tls-certificate", certificate, "--tls-key", key, "--data"]);
        serve.arg(folders[2].path().join(k.to_string()));
        Server::start_on(serve, 0)
    };
    let services = [serve(0), serve(1), serve(2)];
    let ask = |k: usize, path: &str, body: Option<&str>| {
        let url = format!("https://127.0.0.1:{}/v1/missions{path}", services[k].port());
        let mut arguments = vec!["--cacert", &files[k].0, &url];
        if let Some(body) = body {
            arguments.extend(["--json", body]);
        }
        curl(&arguments)
    };
    let (status, made) = ask(0, "", Some(&live_mission()));
    assert_eq!(status, 201, "{made}");
    let made: Value = serde_json::from_str(&made).expect("is JSON");
    let mission = made["id"].as_str().expect("it has a name");
    let run = format!("/{mission}/run");
    assert_eq!(ask(0, &run, Some("{}")).0, 200, "the first service has it");

    assert_eq!(ask(1, &run, Some("{}")).0, 200);
    let encoded = format!("/%6d{}/run", &mission[1..]);
    assert_eq!(
        ask(1, &encoded, Some("{}")).0,
        200,
        "the same name, written another way"
    );
    let (status, problem) = ask(2, &run, Some("{}"));
    assert!(
        status == 503 && problem.contains("mission_elsewhere"),
        "{problem}"
    );
}

#[test]
fn only_stored_changes_are_acknowledged() {
    let Some(fleet) = Fleet::start(1) else { return };
    let _ = psql(&fleet.url, "ALTER TABLE events RENAME TO elsewhere");
    let url = format!("{}/finish", fleet.at(0));
    assert_eq!(ask_at("POST", &url, "").status, 503);
    let _ = psql(&fleet.url, "ALTER TABLE elsewhere RENAME TO events");
    // A finished mission has no owner: it can be finished again.
    for _ in 0..2 {
        let _ = ask_at("POST", &url, "").expected(200);
    }
    check_numbers(&fleet.record(0));
}

#[test]
fn missions_move_to_a_database_and_back_with_the_same_plans() {
    let Some(url) = database() else { return };
    let home = Home::new();
    let mut server = home.start();
    let mission = home.mission();
    while_clients_post(&home.url(&format!("/{mission}/reports")), |_| {
        for _ in 0..5 {
            home.await_plan(&mission, unix_now());
        }
    });
    let events = home.record(&mission).len();
    terminate(&server);
    assert!(ended(&mut server).success());
    let back = home.folder.path().join("back");
    let places = [
        home.data().display().to_string(),
        url.clone(),
        back.display().to_string(),
    ];
    for pair in places.windows(2) {
        let mut copy = pilotfish();
        copy.args(["copy-store", "--from", &pair[0], "--to", &pair[1]]);
        let said = command::printed(&copy.output().expect("the program starts"));
        assert!(said.contains("copied 1 missions"), "{said}");
    }
    let replay = |place: [&str; 2]| {
        let mut replay = pilotfish();
        replay.args(["replay", &mission]).args(place);
        command::printed(&replay.output().expect("the program starts"))
    };
    let before = replay(["--data", &places[0]]);
    assert!(
        before.contains(&format!("{events} events")) && before.contains(" 0 different"),
        "{before}"
    );
    assert_eq!(replay(["--store", &places[1]]), before);
    assert_eq!(replay(["--data", &places[2]]), before);
    print!("{before}");
}
