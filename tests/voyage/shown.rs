//! Displays after one fault: status line, ground station, and the mission on the page.

use std::io;
use std::sync::{Arc, Mutex};
use std::time::Duration;

use serde::Serialize;
use serde_json::Value;
use tracing_subscriber::util::SubscriberInitExt as _;

use super::faults::{Fault, Kind};
use super::host::{Host, Request};
use super::sea::Sea;
use super::{World, lock};

/// Begin and duration of the fault, s: longer than a frozen position is trusted.
const BEGINS_S: f64 = 120.0;
const TAKES_S: f64 = 40.0;
/// Times of the looks, s after the begin and after the end.
const LOOKS_S: [f64; 5] = [-1.0, 1.0, 3.0, 5.0, 15.0];
/// Length of the voyage, s.
pub(super) const DURATION_S: f64 = BEGINS_S + TAKES_S + 20.0;
/// Beginnings of a status line.
const LINES: [&str; 5] = ["steering", "DEGRADED", "NOT STEERING", "not steering", "waiting"];

/// Displays at one moment.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Shown {
    /// The fault.
    pub fault: String,
    /// `true` after its end.
    pub is_over: bool,
    /// Time since its begin or end, s.
    pub after_s: f64,
    /// Time of the voyage, s.
    pub t_s: f64,
    /// The bridge's newest status line.
    pub line: String,
    /// The newest text to the ground station.
    pub text: String,
    /// Time since the bridge's last heartbeat, s.
    pub silent_s: f64,
    /// The mission from the service; none without an answer.
    pub mission: Option<Value>,
}

impl Shown {
    /// `true` for status line, ground station and mission if they report unreserved steering.
    pub fn good(&self) -> [bool; 3] {
        let said = self.mission.as_ref().map(|mission| &mission["steering"]);
        // Words from before the bridge's silence do not count.
        let is_alive = self.silent_s < 3.0;
        [
            is_alive && self.line.starts_with("steering,"),
            is_alive && self.text == "Pilotfish steering",
            said.is_some_and(|said| {
                said["state"] == "steering"
                    && said["why"].as_str().is_none_or(str::is_empty)
                    && said["age_s"].as_f64().is_some_and(|age_s| age_s <= 3.0)
            }),
        ]
    }
}

/// The only fault of a voyage.
pub(super) fn only(kind: Kind) -> Fault {
    Fault { kind, begins_s: BEGINS_S, ends_s: BEGINS_S + TAKES_S, size: 0.0, service: 0, is_alone: true }
}

/// The log of this thread's programs, as text.
#[derive(Clone, Debug, Default)]
pub struct Log(Arc<Mutex<Vec<u8>>>);

impl io::Write for Log {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        lock(&self.0).extend(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Log {
    /// Takes the log of this thread from now on.
    pub(super) fn listen(&self) -> impl Sized + use<> {
        let text =
            tracing_subscriber::fmt().with_ansi(false).with_target(false).with_level(false).without_time();
        text.with_writer(Mutex::new(self.clone())).finish().set_default()
    }

    /// All of it.
    pub fn text(&self) -> String {
        String::from_utf8_lossy(&lock(&self.0)).into_owned()
    }

    /// The newest status line.
    fn line(&self) -> String {
        let text = self.text();
        let is_status = |line: &&str| LINES.iter().any(|with| line.starts_with(with));
        let line = text.lines().rev().map(str::trim).find(is_status);
        line.unwrap_or_default().to_owned()
    }
}

/// Looks at the displays at [`LOOKS_S`].
pub(super) async fn look(
    world: Arc<World>,
    host: Arc<Host>,
    sea: Arc<Sea>,
    log: Log,
    kind: Kind,
) -> Vec<Shown> {
    let mut all = vec![];
    for (is_over, from_s) in [(false, BEGINS_S), (true, BEGINS_S + TAKES_S)] {
        let wait_s = from_s - world.t_s();
        if is_over {
            world.aboard.sleep(Duration::from_secs_f64(wait_s)).await;
            if kind == Kind::BridgeKilled {
                // The next process has a terminal of its own.
                lock(&log.0).clear();
            }
        }
        for after_s in LOOKS_S.into_iter().filter(|after_s| !is_over || 0.0 < *after_s) {
            let wait_s = from_s + after_s - world.t_s();
            world.aboard.sleep(Duration::from_secs_f64(wait_s)).await;
            let (text, silent_s) = sea.ground_station();
            let path = format!("/v1/missions/{}", host.mission().unwrap_or_default());
            let request = Request { path, key: None, body: None };
            let line = log.line();
            let answer = world.aboard.timeout(Duration::from_secs(1), host.ask(0, request));
            let mission = match answer.await {
                Ok(Ok((200, body))) => serde_json::from_slice(&body).ok(),
                _ => None,
            };
            all.push(Shown {
                fault: kind.to_string(),
                is_over,
                after_s,
                t_s: world.t_s(),
                line,
                text,
                silent_s,
                mission,
            });
        }
    }
    all
}
