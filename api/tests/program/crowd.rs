//! Clients that take places, memory or the log: the program must still serve the others.

#![expect(clippy::disallowed_methods, reason = "a client that reads while the test writes")]

use std::collections::BTreeSet;
use std::io::{Read, Write};
use std::net::{Ipv4Addr, SocketAddr, TcpStream};
use std::os::unix::net::UnixDatagram;
use std::process::{Command, Stdio};
use std::time::Duration;

use rustix::net::{AddressFamily, SocketType, bind, connect, socket};
use tests::server::Server;

use crate::command::{ask, metric, pilotfish, serving};

/// A longer wait fails the test.
const PATIENCE: Duration = Duration::from_mins(1);

/// Places for connections of a service that may open few files.
const PLACES: u32 = 40;

/// The rest of its files, which it keeps for itself.
const OTHER_FILES: u32 = 256;

/// A connection from another address of this machine.
fn connected(from: [u8; 4], to: &Server) -> TcpStream {
    let new = socket(AddressFamily::INET, SocketType::STREAM, None).expect("is free");
    bind(&new, &SocketAddr::from((from, 0))).expect("all of 127/8 is this machine");
    connect(&new, &SocketAddr::from((Ipv4Addr::LOCALHOST, to.port()))).expect("listens");
    let stream = TcpStream::from(new);
    stream.set_read_timeout(Some(PATIENCE)).expect("is a socket");
    stream
}

#[test]
fn two_addresses_that_take_every_place_leave_some_to_a_third() {
    let mut shell = Command::new("sh");
    let run = format!("ulimit -n {}; exec \"$0\" \"$@\"", PLACES + OTHER_FILES);
    shell.args(["-c", &run, env!("CARGO_BIN_EXE_pilotfish")]);
    let server = Server::start(shell);
    let kinds = [
        "",
        "GET /livez HTTP/1.1\r\nhost: localhost\r\nx: ",
        "GET /openapi.json HTTP/1.1\r\nhost: localhost\r\n\r\n",
        "POST /v1/plan HTTP/1.1\r\nhost: localhost\r\ncontent-type: application/json\r\ncontent-length: 9\r\n\r\n{",
    ];
    for kind in kinds {
        let held: Vec<_> = (0..3 * PLACES)
            .map(|i| {
                let mut socket = connected([127, 0, 0, if i % 2 == 0 { 2 } else { 3 }], &server);
                // The service may have closed it for another.
                let _ = socket.write_all(kind.as_bytes());
                socket
            })
            .collect();
        for _ in 0..10 {
            let answer = ask(&server, "GET", "/livez", "");
            assert_eq!(answer.status, 200, "{kind:?}: {}", answer.text);
        }
        drop(held);
    }
    assert!(metric(&server, "pilotfish_connections") <= f64::from(PLACES));
}

#[test]
fn a_head_over_16_kib_is_refused() {
    let server = serving(&[]);
    for (name_bytes, status) in [(8 << 10, 200), (17 << 10, 431)] {
        let mut socket = connected([127, 0, 0, 1], &server);
        let long = "x".repeat(name_bytes);
        let head =
            format!("GET /livez HTTP/1.1\r\nhost: localhost\r\nconnection: close\r\nx: {long}\r\n\r\n");
        // It may be refused before its end.
        let _ = socket.write_all(head.as_bytes());
        let mut answer = [0; 12];
        socket.read_exact(&mut answer).expect("answers");
        assert_eq!(String::from_utf8_lossy(&answer), format!("HTTP/1.1 {status}"));
    }
}

#[test]
fn a_log_that_no_one_reads_delays_no_plan_and_its_lines_are_counted() {
    let mut silent = pilotfish();
    silent.args(["--log", "debug"]).stderr(Stdio::piped());
    let server = Server::start(silent);
    let mut socket = connected([127, 0, 0, 1], &server);
    let mut answers = socket.try_clone().expect("is a socket");
    let reader = std::thread::spawn(move || std::io::copy(&mut answers, &mut std::io::sink()));
    for i in 0..10_000 {
        let end = if i == 9_999 { "connection: close\r\n" } else { "" };
        let request = format!("GET /livez HTTP/1.1\r\nhost: localhost\r\n{end}\r\n");
        socket.write_all(request.as_bytes()).expect("takes a request");
    }
    let read = reader.join().expect("does not panic");
    read.expect("reads to the end");
    let plan = ask(&server, "POST", "/v1/plan", service::examples::EXAMPLES[0].body);
    assert_eq!(plan.status, 200, "{}", plan.text);
    assert!(0.0 < metric(&server, "pilotfish_log_lines_dropped_total"));
}

#[test]
fn the_service_notifies_systemd_that_it_listens_and_that_its_planners_work() {
    let directory = tempfile::tempdir().expect("there is room");
    let path = directory.path().join("notify");
    let notes = UnixDatagram::bind(&path).expect("is free");
    notes.set_read_timeout(Some(PATIENCE)).expect("is a socket");
    let mut watched = pilotfish();
    watched.env("NOTIFY_SOCKET", &path).env("WATCHDOG_USEC", "20000000");
    watched.env_remove("WATCHDOG_PID");
    let _server = Server::start(watched);
    // In either order: the planners start before the socket does.
    let mut awaited = BTreeSet::from(["READY=1", "WATCHDOG=1"]);
    let mut note = [0; 64];
    while !awaited.is_empty() {
        let n = notes.recv(&mut note).expect("comes");
        let note = str::from_utf8(&note[..n]).expect("is text");
        assert!(awaited.remove(note) || note == "WATCHDOG=1", "{note}");
    }
}
