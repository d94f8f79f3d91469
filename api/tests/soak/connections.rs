//! Connections that take places from others, or that a service has to end.

use std::io::{Read as _, Write as _};
use std::net::TcpStream;
use std::time::Duration;

use serde_json::json;

use crate::command::{ask_as, metric, path, printed, run, serving};
use crate::{PATIENCE, until};

#[test]
fn a_connection_that_takes_no_answer_is_closed() {
    let server = serving(&[]);
    let mut unread: Vec<_> = (0..4).map(|_| TcpStream::connect(&server.address).expect("listens")).collect();
    for socket in &mut unread {
        let request = "GET /openapi.json HTTP/1.1\r\nhost: localhost\r\n\r\n".repeat(30);
        socket.write_all(request.as_bytes()).expect("takes a request");
    }
    until("all are open", || metric(&server, "pilotfish_connections") >= 5.0);
    until("one stays open", || metric(&server, "pilotfish_connections") == 1.0);
}

#[test]
fn a_header_that_does_not_end_is_cut_off() {
    let server = serving(&[]);
    let mut socket = TcpStream::connect(&server.address).expect("listens");
    socket.write_all(b"GET /livez HTTP/1.1\r\nhost:").expect("takes it");
    socket.set_read_timeout(Some(Duration::from_secs(20))).expect("is a socket");
    let mut answer = String::new();
    socket.read_to_string(&mut answer).expect("hangs up");
    assert!(!answer.contains("200 OK"), "{answer}");
}

#[test]
fn the_stream_and_the_waiting_request_of_a_revoked_token_end() {
    let directory = tempfile::tempdir().expect("there is room");
    let file = path(&directory, "tokens.json");
    let token = |arguments: &[&str]| {
        let output = run(&[&["token"], arguments, &["--tokens", &file]].concat());
        printed(&output).trim().to_owned()
    };
    let [bridge, page] = ["bridge", "page"].map(|name| token(&["add", name, "--role", "operator"]));
    let server = serving(&["--tokens", &file]);

    let live = json!({ "schema_version": "1.0", "live": {
        "auvs": [{ "id": "auv-1" }], "goal": { "kind": "track", "auv": "auv-1" }, "period_s": 1.0 } });
    let answer = ask_as(&server, Some(&page), "POST", "/v1/missions", &live.to_string());
    let path = answer.headers["location"].to_str().expect("is text");
    let sent = |token: &str, path: &str| {
        let mut socket = TcpStream::connect(&server.address).expect("listens");
        let request = format!(
            "GET {path} HTTP/1.1\r\nhost: localhost\r\nconnection: close\r\nauthorization: Bearer {token}\r\n\r\n"
        );
        socket.write_all(request.as_bytes()).expect("takes a request");
        socket.set_read_timeout(Some(PATIENCE)).expect("is a socket");
        socket
    };
    let streams = [&bridge, &page].map(|token| {
        let mut stream = sent(token, &format!("{path}/events?after=0"));
        let mut head = [0; 12];
        stream.read_exact(&mut head).expect("answers");
        assert_eq!(&head, b"HTTP/1.1 200");
        stream
    });
    let reference = format!("{path}/reference?wait_s=30&after=1000000");
    let mut waiting = sent(&bridge, &reference);
    token(&["revoke", "bridge"]);
    let mut status = [0; 12];
    waiting.read_exact(&mut status).expect("answers");
    assert_eq!(&status, b"HTTP/1.1 401");
    let [mut revoked, mut kept] = streams;
    let mut events = vec![];
    // Without a revocation the stream lasts as long as the mission.
    revoked.read_to_end(&mut events).expect("ends");
    assert!(String::from_utf8_lossy(&events).contains("event: created"));
    assert!(!events.ends_with(b"0\r\n\r\n"), "is cut off, not complete");
    kept.set_nonblocking(true).expect("is a socket");
    let still_open = |read: std::io::Result<usize>| !matches!(read, Ok(0));
    let mut rest = [0; 4096];
    while let Ok(1..) = kept.read(&mut rest) {}
    assert!(still_open(kept.read(&mut rest)));
}
