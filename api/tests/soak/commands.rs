//! Commands that are observed while they run.

use std::fs;
use std::io::{Read as _, Write as _};
use std::net::{TcpListener, TcpStream};
use std::os::unix::fs::PermissionsExt as _;
use std::process::Stdio;
use std::thread::sleep;
use std::time::Duration;

use rustix::process::Signal;
use tests::server::Server;

use crate::command::{ask, path, pilotfish, serving, signal, written};
use crate::until;

#[test]
fn a_server_runs_without_a_reader_of_its_output() {
    let free = TcpListener::bind("127.0.0.1:0").and_then(|listener| listener.local_addr()).expect("is free");
    let data = tempfile::tempdir().expect("there is room");
    let mut process = pilotfish()
        .args(["--port", &free.port().to_string()])
        .env("PILOTFISH_DATA", data.path())
        .stdout(Stdio::piped())
        .spawn()
        .expect("starts");
    drop(process.stdout.take());
    let server = Server { process, printed: None, address: free.to_string(), data: Some(data) };
    until("it listens", || TcpStream::connect(&server.address).is_ok());
    assert_eq!(ask(&server, "GET", "/livez", "").text, r#"{"status":"live"}"#);
}

#[test]
fn a_stop_signal_lets_an_open_request_finish() {
    let mut server = serving(&[]);
    let mut socket = TcpStream::connect(&server.address).expect("listens");
    let body = service::examples::EXAMPLES[0].body;
    let head = format!(
        "POST /v1/plan HTTP/1.1\r\nhost: localhost\r\ncontent-type: application/json\r\n\
         content-length: {}\r\n\r\n",
        body.len()
    );
    socket.write_all(head.as_bytes()).expect("takes it");
    sleep(Duration::from_millis(300));
    signal(&server.process, Signal::TERM);
    sleep(Duration::from_millis(300));
    socket.write_all(body.as_bytes()).expect("takes the rest");
    let mut answer = String::new();
    socket.read_to_string(&mut answer).expect("answers and hangs up");
    assert!(answer.starts_with("HTTP/1.1 200 OK"), "{answer}");
    assert!(server.process.wait().expect("ends").success());
}

#[test]
fn with_a_shutdown_delay_the_server_answers_but_is_not_ready() {
    let mut server = serving(&["--shutdown-delay-s", "30"]);
    assert_eq!(ask(&server, "GET", "/readyz", "").status, 200);
    signal(&server.process, Signal::TERM);
    until("it is not ready", || {
        let answer = ask(&server, "GET", "/readyz", "");
        answer.status == 503 && answer.text.contains("about to stop")
    });
    assert_eq!(ask(&server, "GET", "/livez", "").status, 200);
    // A second signal ends the delay.
    signal(&server.process, Signal::TERM);
    assert!(server.process.wait().expect("ends").success());
}

#[test]
fn an_older_record_stays_until_the_mission_ends() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = written(&folder, "record.csv", "of before");
    let mut mission = pilotfish()
        .args(["simulate", "paper-tracking", "--out", &path])
        .stdout(Stdio::null())
        .spawn()
        .expect("starts");
    sleep(Duration::from_millis(300));
    let running = mission.try_wait().expect("is ours").is_none();
    let kept = fs::read_to_string(&path).expect("is there");
    mission.kill().expect("is ours");
    mission.wait().expect("is ours");
    assert!(running, "the mission outlasts the look at its file");
    assert_eq!(kept, "of before");
    let n_files = fs::read_dir(&folder).expect("is there").count();
    assert_eq!(n_files, 1, "a mission that was killed leaves nothing");
}

#[test]
fn a_demo_sends_the_browser_to_its_page() {
    let folder = tempfile::tempdir().expect("there is room");
    let opened = path(&folder, "opened");
    let script = format!("#!/bin/sh\nprintf %s \"$1\" > '{opened}.new' && mv '{opened}.new' '{opened}'\n");
    let browser = written(&folder, "xdg-open", &script);
    fs::set_permissions(&browser, fs::Permissions::from_mode(0o755)).expect("is ours");
    let paths = std::env::var("PATH").expect("is set");
    let demo = pilotfish()
        .args(["demo", "--port", "0"])
        .env("PATH", format!("{}:{paths}", folder.path().display()))
        .stdout(Stdio::null())
        .spawn();
    let _ended_at_last =
        Server { process: demo.expect("starts"), printed: None, address: String::new(), data: None };
    until("the browser is sent to the page", || {
        fs::read_to_string(&opened).is_ok_and(|page| page.contains("/#/mission/"))
    });
}
