//! An operator ashore: writes to the mission's log and sometimes pauses the mission.

use std::{sync::Arc, time::Duration};

use rand::RngExt as _;
use rand_chacha::ChaCha8Rng;
use serde_json::json;

use super::host::{Host, Request};
use super::{Course, World, rng};

/// Time between two tries.
const RETRY: Duration = Duration::from_millis(500);
/// Time between two tries to read the plan.
const READ_AGAIN: Duration = Duration::from_millis(100);
/// Longest wait for a plan.
const READ_TIME: Duration = Duration::from_secs(3);
/// Share of the actions that pause the mission.
const PAUSES: f64 = 0.15;

pub(super) struct Operator {
    world: Arc<World>,
    host: Arc<Host>,
    rng: ChaCha8Rng,
    key: u64,
    /// The service for the next request.
    service: usize,
}

impl Operator {
    pub(super) fn new(world: &Arc<World>, host: &Arc<Host>, seed: u64) -> Self {
        Self { world: Arc::clone(world), host: Arc::clone(host), rng: rng(seed, 2), key: 0, service: 0 }
    }

    pub(super) async fn run(mut self) {
        loop {
            let wait_s = self.rng.random_range(4.0..25.0);
            self.world.aboard.sleep(Duration::from_secs_f64(wait_s)).await;
            let Some(mission) = self.host.mission() else { continue };
            let Course { is_nominal, only, .. } = self.world.course;
            if !is_nominal && only.is_none() && self.rng.random_bool(PAUSES) {
                let begins_s = self.world.t_s();
                self.world.now().is_paused = true;
                self.until_done(&mission, "pause", json!({})).await;
                let wait_s = self.rng.random_range(2.0..15.0);
                self.world.aboard.sleep(Duration::from_secs_f64(wait_s)).await;
                self.until_done(&mission, "run", json!({})).await;
                let t_s = self.world.t_s();
                let mut now = self.world.now();
                (now.is_paused, now.quiet_since_s) = (false, now.quiet_since_s.max(t_s));
                now.pauses.push([begins_s, t_s]);
            } else {
                let text = format!("operator {}", self.key);
                let note = json!({ "notes": [{ "t_s": self.world.ashore[0].unix_s() - 0.5, "text": text }] });
                self.until_done(&mission, "reports", note).await;
            }
        }
    }

    /// Another person reads the plan from either service.
    pub(super) async fn read(world: Arc<World>, host: Arc<Host>, seed: u64) {
        let mut rng = rng(seed, 5);
        loop {
            let wait_s = rng.random_range(0.1..1.5);
            world.aboard.sleep(Duration::from_secs_f64(wait_s)).await;
            let service = rng.random_range(0..host.n_services);
            let Some(mission) = host.mission() else { continue };
            let wait_s = rng.random_range(0..2);
            let request = Request {
                path: format!("/v1/missions/{mission}/reference?wait_s={wait_s}"),
                key: None,
                body: None,
            };
            // Tried until it can be answered: a service may not yet know that it lost the mission.
            loop {
                let asked = world.aboard.timeout(READ_TIME, host.ask(service, request.clone()));
                if matches!(asked.await, Ok(Ok((200, _)))) {
                    break;
                }
                world.aboard.sleep(READ_AGAIN).await;
            }
        }
    }

    /// Sends until there is an answer.
    async fn until_done(&mut self, mission: &str, order: &str, body: serde_json::Value) {
        self.key += 1;
        self.world.note("operator", format!("{order} {}", self.key));
        let request = Request {
            path: format!("/v1/missions/{mission}/{order}"),
            key: Some(format!("operator-{}", self.key)),
            body: Some(body.to_string().into_bytes()),
        };
        loop {
            match self.host.ask(self.service, request.clone()).await {
                // After a change of the clock, its note has another date, and is not sent again.
                Ok((status, _)) if status < 500 && status != 429 => return,
                Ok(_) | Err(_) => {
                    self.service = (self.service + 1) % self.host.n_services;
                    self.world.aboard.sleep(RETRY).await;
                }
            }
        }
    }
}
