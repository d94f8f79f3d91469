//! Claims that need real processes, sockets, disks and clocks. `cargo test -p pilotfish --test soak
//! -- kill` runs one module. These tests wait and measure: `.ci/soak` runs them one by one.

#![expect(clippy::disallowed_methods, reason = "real processes live in real time")]

use std::thread::sleep;
use std::time::{Duration, Instant};

use tests::client::Answer;

use command::{agent, try_ask};

mod access;
mod bridge;
mod commands;
mod connections;
mod faults;
mod kill;
mod shared;

#[path = "../program/command.rs"]
#[expect(dead_code, reason = "the program tests need more of it")]
mod command;

/// Longest wait for an expected event, on a busy machine.
const PATIENCE: Duration = Duration::from_mins(1);

/// Waits until it is so.
fn until(what: &str, mut so: impl FnMut() -> bool) {
    let end = Instant::now() + PATIENCE;
    while !so() {
        assert!(Instant::now() < end, "{what}");
        sleep(Duration::from_millis(50));
    }
}

/// The answer to a request on a connection of its own.
fn ask_at(method: &str, url: &str, body: &str) -> Answer {
    try_ask(&agent(), method, url, &[], body).expect("the service answers")
}
