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
    until_some(what, || so().then_some(()));
}

/// Tries until there is an answer; fails with `otherwise`.
fn until_some<T>(otherwise: &str, mut tried: impl FnMut() -> Option<T>) -> T {
    let end = Instant::now() + PATIENCE;
    loop {
        if let Some(answer) = tried() {
            return answer;
        }
        assert!(Instant::now() < end, "{otherwise}");
        sleep(Duration::from_millis(3));
    }
}

/// The answer to a request on a connection of its own.
fn ask_at(method: &str, url: &str, body: &str) -> Answer {
    try_ask(&agent(), method, url, &[], body).expect("the service answers")
}
