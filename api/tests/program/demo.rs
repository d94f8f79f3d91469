//! `pilotfish demo`: what it runs, what it opens, and what it leaves.

use std::{
    fs,
    io::{BufRead as _, BufReader, Read as _},
    os::unix::fs::PermissionsExt as _,
    path::Path,
    process::{Command, Stdio},
    time::Duration,
};

use serde_json::Value;
use tests::server::Server;

use crate::command::{ask, json, pilotfish, printed, run, said, stderr};

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
    let answer = ask(server, "GET", &format!("/v1/missions/{id}"), "");
    json(answer.split_once("\r\n\r\n").expect("has a body").1)
}

/// What the demo printed after the address, once Ctrl-C has ended it.
fn end(server: Server) -> String {
    end_by("-INT", server)
}

fn end_by(signal: &str, mut server: Server) -> String {
    let id = server.process.id().to_string();
    let stop = Command::new("kill").args([signal, &id]).status();
    assert!(stop.expect("there is a kill").success());
    let mut rest = String::new();
    let mut printed = server.printed.take().expect("is read here");
    printed.read_to_string(&mut rest).expect("is text");
    assert!(server.process.wait().expect("ends").success());
    rest
}

/// A program of that name that does nothing but write its argument into `file`.
fn writes_its_argument(program: &Path, file: &Path) {
    let script = format!(
        "#!/bin/sh\nprintf %s \"$1\" > '{0}.new' && mv '{0}.new' '{0}'\n",
        file.display()
    );
    fs::write(program, script).expect("there is room");
    fs::set_permissions(program, fs::Permissions::from_mode(0o755)).expect("is ours");
}

#[test]
fn a_demo_runs_a_mission_opens_its_page_and_leaves_nothing() {
    let folder = tempfile::tempdir().expect("there is room");
    let (opened, temporary) = (folder.path().join("opened"), folder.path().join("tmp"));
    fs::create_dir(&temporary).expect("there is room");
    writes_its_argument(&folder.path().join("xdg-open"), &opened);
    let path = std::env::var("PATH").expect("the kill of a test is there");
    let (server, page) = demo(
        pilotfish()
            .arg("demo")
            .env("PATH", format!("{}:{path}", folder.path().display()))
            .env("TMPDIR", &temporary),
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
    assert!(ask(&server, "GET", "/", "").contains("<title>"));
    let is_open = (0..400).any(|_| {
        std::thread::sleep(Duration::from_millis(25));
        fs::read_to_string(&opened).is_ok_and(|opened| opened == page)
    });
    assert!(is_open, "the browser was not sent to {page}");
    assert_eq!(fs::read_dir(&temporary).expect("is there").count(), 1);

    let rest = end(server);
    assert!(rest.contains("deletes the mission"), "{rest}");
    assert_eq!(fs::read_dir(&temporary).expect("is there").count(), 0);
}

#[test]
fn a_demo_without_a_browser_says_so_and_keeps_its_mission_where_it_is_told_to() {
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
    end(server);
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
    end(one);
    // As when its terminal is closed.
    end_by("-HUP", other);
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
