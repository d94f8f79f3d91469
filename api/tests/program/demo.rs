//! `pilotfish demo`: its mission, the page that it opens, and the files that it leaves.

use std::fs;
use std::io::{BufRead as _, BufReader, Read as _};
use std::process::{Command, Stdio};

use rustix::process::Signal;
use serde_json::Value;
use tests::server::Server;

use crate::command::{ask, has_all, line, path, pilotfish, printed, refusal, serving, signal, written};

/// A demo, and the address of the page that it printed.
fn demo(command: &mut Command) -> (Server, String) {
    let mut process = command.stdout(Stdio::piped()).spawn().expect("starts");
    let mut printed = BufReader::new(process.stdout.take().expect("is piped"));
    let mut page = String::new();
    while !page.contains("://") {
        page.clear();
        assert_ne!(printed.read_line(&mut page).expect("prints"), 0, "no address");
    }
    let page = page.trim().to_owned();
    let (_, rest) = page.split_once("://").expect("is an address");
    let (address, _) = rest.split_once('/').expect("has a path");
    let server = Server { process, address: address.to_owned(), printed: Some(printed), data: None };
    (server, page)
}

/// The mission that a page shows, as the service has it.
fn mission(server: &Server, page: &str) -> Value {
    let (_, id) = page.split_once("/#/mission/").expect("is a mission's page");
    ask(server, "GET", &format!("/v1/missions/{id}"), "").json()
}

/// Ends the demo by a signal. Returns the output after the address.
fn end(mut server: Server, by: Signal) -> String {
    signal(&server.process, by);
    let mut rest = String::new();
    let mut printed = server.printed.take().expect("is read here");
    printed.read_to_string(&mut rest).expect("is text");
    assert!(server.process.wait().expect("ends").success());
    rest
}

#[test]
fn a_demo_runs_a_mission_and_leaves_nothing() {
    let temporary = tempfile::tempdir().expect("there is room");
    let files = || fs::read_dir(&temporary).expect("is there").count();
    let mut program = pilotfish();
    program.args(["demo", "--no-browser"]).env("TMPDIR", temporary.path());
    let (server, page) = demo(&mut program);
    let mission = mission(&server, &page);
    for (member, value) in [("status", "running"), ("kind", "simulated"), ("title", "switching, seed 1")] {
        assert_eq!(mission[member], value);
    }
    has_all(&ask(&server, "GET", "/", "").text, &["<title>"]);
    assert_eq!(files(), 1);

    let rest = end(server, Signal::INT);
    has_all(&rest, &["deletes the mission"]);
    assert_eq!(files(), 0);
}

#[test]
fn a_demo_without_a_browser_says_so_and_keeps_its_mission_in_the_given_directory() {
    let folder = tempfile::tempdir().expect("there is room");
    let text = printed(&line("scenarios paper-intermittent"));
    let scenario = written(&folder, "lanes.toml", &text);
    let data = path(&folder, "data");
    let (mut server, page) = demo(
        pilotfish()
            .args(["demo", &scenario, "--seed", "7", "--port", "0", "--data", &data])
            // A machine without xdg-open.
            .env("PATH", folder.path()),
    );
    assert_eq!(mission(&server, &page)["title"], "lanes, seed 7");
    let printed = server.printed.as_mut().expect("was not taken");
    let mut rest = String::new();
    while !rest.contains("No browser could be opened") {
        assert_ne!(printed.read_line(&mut rest).expect("prints"), 0, "{rest}");
    }
    end(server, Signal::INT);
    has_all(&rest, &[&format!("keeps the mission in {data}")]);

    let again = serving(&["--data", &data]);
    assert_eq!(mission(&again, &page)["title"], "lanes, seed 7");
}

#[test]
fn two_demos_run_side_by_side() {
    let start = || demo(pilotfish().args(["demo", "calm", "--no-browser"]));
    let ((one, _), (other, page)) = (start(), start());
    assert_ne!(one.port(), other.port());
    assert_eq!(mission(&other, &page)["title"], "calm, seed 1");
    let port = one.port();
    let third = line(&format!("demo --no-browser --port {port}"));
    has_all(refusal(&third), &[&format!("port {port} is in use")]);
    end(one, Signal::INT);
    // As when its terminal is closed.
    end(other, Signal::HUP);
}

#[test]
fn a_mission_that_the_service_refuses_ends_the_demo() {
    let refused = line("demo paper-path-following --no-browser --port 0");
    assert_eq!(refused.status.code(), Some(1));
    has_all(refusal(&refused), &["the service refuses the mission"]);
    let refused = line("demo --speed-factor 5000 --no-browser --port 0");
    has_all(refusal(&refused), &["from 0.1 to 1000"]);
}
