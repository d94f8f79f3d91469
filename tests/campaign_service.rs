//! A service that is killed while it flies a campaign goes on with it by itself, to the rows that `pilotfish campaign run` has.

use std::{
    env, fs,
    net::{Ipv4Addr, TcpListener},
    process::Command,
    thread::sleep,
    time::{Duration, Instant},
};

use serde_json::Value;
use tempfile::tempdir;
use tests::server::Server;
use ureq::Agent;

/// A wait that takes longer fails the test.
const PATIENCE: Duration = Duration::from_mins(1);

const FILE: &str = r#"
schema_version = "1"
name = "small"
title = "a campaign of a service that is killed"
scenarios = ["noisy-fixes"]
duration_s = 60
replicates = 60
[tuning]
replicates = 1
[[controllers]]
name = "mpc auto"
planner = {}
[[controllers]]
name = "saturated_los"
law = { name = "saturated_los" }
"#;

fn pilotfish() -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_pilotfish"));
    for (name, _) in env::vars().filter(|(name, _)| name.starts_with("PILOTFISH_")) {
        command.env_remove(name);
    }
    command
}

fn agent() -> Agent {
    let config = Agent::config_builder().http_status_as_error(false).proxy(None);
    config.timeout_global(Some(PATIENCE)).build().new_agent()
}

fn ask(url: &str) -> Value {
    let mut answer = agent().get(url).call().expect("the service answers");
    let text = answer.body_mut().read_to_string().expect("the answer ends");
    assert_eq!(answer.status(), 200, "{text}");
    serde_json::from_str(&text).expect("is JSON")
}

#[test]
fn a_campaign_of_a_service_that_is_killed_comes_to_the_rows_of_the_command_line() {
    let folder = tempdir().expect("there is room");
    let file = folder.path().join("small.toml");
    fs::write(&file, FILE).expect("is written");
    let out = folder.path().join("out");
    let run = pilotfish()
        .args(["campaign", "run"])
        .arg(&file)
        .arg("--out")
        .arg(&out)
        .output();
    let run = run.expect("the program starts");
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    let said = String::from_utf8(run.stdout).expect("is text");
    let digest = said.trim().rsplit(' ').next().expect("ends with it").to_owned();

    let port = TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).and_then(|free| free.local_addr());
    let port = port.expect("some port is free").port();
    let start = || {
        let mut serve = pilotfish();
        serve.arg("serve").arg("--data").arg(folder.path().join("data"));
        Server::start_on(serve, port)
    };
    let mut server = start();
    let all = format!("{}/v1/campaigns", server.url());
    let mut answer = agent()
        .post(&all)
        .content_type("application/toml")
        .send(FILE)
        .expect("answers");
    // It is killed as soon as it has said that it took it on.
    server.process.kill().expect("is ours");
    server.process.wait().expect("is ours");
    assert_eq!(answer.status(), 202);
    let text = answer.body_mut().read_to_string().expect("has come");
    let posted: Value = serde_json::from_str(&text).expect("is JSON");
    let url = format!("{all}/{}", posted["id"].as_str().expect("has one"));

    let mut done_before = 0;
    for _ in 0..3 {
        let mut server = start();
        let end = Instant::now() + PATIENCE;
        loop {
            let seen = ask(&url);
            let done = seen["progress"]["runs_done"].as_u64().expect("is counted");
            if done_before + 24 <= done {
                assert_eq!(
                    seen["status"], "running",
                    "it has to be killed to show anything: {seen}"
                );
                done_before = done;
                break;
            }
            assert!(Instant::now() < end, "{seen}");
            sleep(Duration::from_millis(1));
        }
        server.process.kill().expect("is ours");
        server.process.wait().expect("is ours");
    }
    let server = start();
    let end = Instant::now() + PATIENCE;
    let done = loop {
        let seen = ask(&url);
        if seen["status"] == "done" {
            break seen;
        }
        assert!(Instant::now() < end, "{seen}");
        sleep(Duration::from_millis(10));
    };
    assert_eq!(done["digest"].as_str(), Some(digest.as_str()));
    drop(server);
}
