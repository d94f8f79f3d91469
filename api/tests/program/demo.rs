//! `pilotfish demo`: its mission, the page that it opens, and the files that it leaves.

use std::{
    fs,
    io::{BufRead as _, BufReader, Read as _},
    process::{Command, Stdio},
};

use rustix::process::Signal;
use serde_json::Value;
use tests::server::Server;

use crate::command::{ask, pilotfish, printed, run, said, signal, stderr};

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
    let server = Server {
        process,
        address: address.to_owned(),
        printed: Some(printed),
        data: None,
    };
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
    let (server, page) = demo(
        pilotfish()
            .args(["demo", "--no-browser"])
            .env("TMPDIR", temporary.path()),
    );
    let mission = mission(&server, &page);
    assert_eq!(
        (&mission["status"], &mission["kind"], &mission["title"]),
        (
            &"running".into(),
            &"simulated".into(),
            &"switching, seed 1".into()
        )
    );
    assert!(ask(&server, "GET", "/", "").text.contains("<title>"));
    assert_eq!(files(), 1);

    let rest = end(server, Signal::INT);
    assert!(rest.contains("deletes the mission"), "{rest}");
    assert_eq!(files(), 0);
}

#[test]
fn a_demo_without_a_browser_says_so_and_keeps_its_mission_in_the_given_directory() {
    let folder = tempfile::tempdir().expect("there is room");
    let scenario = folder.path().join("lanes.toml");
    let text = printed(&run(&["scenarios", "paper-intermittent"]));
    fs::write(&scenario, text).expect("there is room");
    let data = folder.path().join("data");
    let (mut server, page) = demo(
        pilotfish()
            .arg("demo")
            .arg(&scenario)
            .args(["--seed", "7", "--port", "0"])
            .arg("--data")
            .arg(&data)
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
    assert!(
        rest.contains(&format!("keeps the mission in {}", data.display())),
        "{rest}"
    );

    let mut again = pilotfish();
    let again = Server::start_on(
        {
            again.arg("--data").arg(&data);
            again
        },
        0,
    );
    assert_eq!(mission(&again, &page)["title"], "lanes, seed 7");
}

#[test]
fn two_demos_run_side_by_side() {
    let start = || demo(pilotfish().args(["demo", "calm", "--no-browser"]));
    let ((one, _), (other, page)) = (start(), start());
    assert_ne!(one.port(), other.port());
    assert_eq!(mission(&other, &page)["title"], "calm, seed 1");
    let port = one.port().to_string();
    let third = run(&["demo", "--no-browser", "--port", &port]);
    assert!(
        stderr(&third).contains(&format!("port {port} is in use")),
        "{}",
        said(&third)
    );
    end(one, Signal::INT);
    // As when its terminal is closed.
    end(other, Signal::HUP);
}

#[test]
fn a_mission_that_the_service_refuses_ends_the_demo() {
    let refused = run(&["demo", "paper-path-following", "--no-browser", "--port", "0"]);
    assert_eq!(refused.status.code(), Some(1), "{}", said(&refused));
    assert!(
        stderr(&refused).contains("the service refuses the mission"),
        "{}",
        said(&refused)
    );
    let refused = run(&["demo", "--speed-factor", "5000", "--no-browser", "--port", "0"]);
    assert!(
        stderr(&refused).contains("from 0.1 to 1000"),
        "{}",
        said(&refused)
    );
}
