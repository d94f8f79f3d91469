//! The service of these claims, and what its clients send.

use std::time::Duration;

use axum::Router;
use axum::body::Body;
use axum::http::{Method, Request};
use clock::Clock;
use serde_json::{Value, json};
use service::{
    Settings,
    missions::{Missions, replay::replay},
};
use sim::scenario::Scenario;
use store::{EventReader, EventStore};
use tempfile::TempDir;
use tests::client::{Answer, call, get, post, send_to, simulated_machine, with};

/// A service on a simulated machine: its time passes while everything waits.
pub(crate) struct Service {
    pub(crate) clock: Clock,
    pub(crate) router: Router,
    pub(super) missions: Missions,
    pub(super) data: TempDir,
}

impl Service {
    /// With no missions yet.
    pub(super) async fn start() -> Self {
        Self::start_with(simulated_machine()).await
    }

    pub(crate) async fn start_with(settings: Settings) -> Self {
        Self::start_in(settings, tempfile::tempdir().expect("is made"), u64::MAX).await
    }

    /// On the store in `data`, of which a client may use `share` bytes.
    pub(super) async fn start_in(settings: Settings, data: TempDir, share: u64) -> Self {
        let clock = settings.clock.clone();
        let store = EventStore::open_with(data.path(), share, &clock).expect("opens");
        let (router, missions) = service::service(settings, store).await.expect("starts");
        Self { clock, router, missions, data }
    }

    pub(super) async fn restart(self) -> Self {
        let Self { clock, data, .. } = self;
        self.missions.close();
        drop((self.router, self.missions));
        // Simulated time passes when the store's writer has ended.
        clock.sleep(Duration::from_millis(1)).await;
        let settings = Settings { clock, ..simulated_machine() };
        Self::start_in(settings, data, u64::MAX).await
    }

    /// Time on the clock of a rehearsal at tenfold speed.
    pub(super) fn mission_now(&self, mission: &Value) -> f64 {
        let created = mission["created_s"].as_f64().expect("has a time");
        created + 10.0 * (self.clock.unix_s() - created)
    }

    /// Time on the clock of the rehearsal at that path.
    pub(super) async fn now(&self, mission: &str) -> f64 {
        self.mission_now(&self.ask(mission).await)
    }

    pub(super) async fn send(&self, request: Request<Body>) -> Answer {
        send_to(self.router.clone(), request).await
    }

    pub(super) async fn get(&self, path: &str) -> Answer {
        self.send(get(path)).await
    }

    pub(super) async fn post(&self, path: &str, body: &Value) -> Answer {
        self.send(post(path, body.to_string())).await
    }

    pub(super) async fn post_keyed(&self, path: &str, body: &Value, key: &str) -> Answer {
        let request = post(path, body.to_string());
        self.send(with(request, "idempotency-key", key)).await
    }

    pub(super) async fn patch_keyed(&self, mission: &str, body: &Value, key: &str) -> Answer {
        let mut request = with(post(mission, body.to_string()), "idempotency-key", key);
        *request.method_mut() = Method::PATCH;
        let merge_patch = "application/merge-patch+json";
        self.send(with(request, "content-type", merge_patch)).await
    }

    pub(super) async fn patch(&self, mission: &str, body: &Value) -> Answer {
        let mut request = post(mission, body.to_string());
        *request.method_mut() = Method::PATCH;
        self.send(request).await
    }

    /// Changes the mission, and returns it.
    pub(super) async fn change(&self, mission: &str, body: Value) -> Value {
        self.patch(mission, &body).await.expected(200)
    }

    pub(super) async fn delete(&self, mission: &str) -> Answer {
        self.send(call("DELETE", mission)).await
    }

    /// Creates a mission, and returns its path.
    pub(super) async fn create(&self, body: &Value) -> String {
        let made = self.post("/v1/missions", body).await;
        made.must_be(201);
        let path = made.header("location").to_owned();
        assert!(path.ends_with(made.json()["id"].as_str().expect("has a name")));
        path
    }

    pub(super) async fn ask(&self, path: &str) -> Value {
        self.get(path).await.expected(200)
    }

    pub(crate) async fn order(&self, mission: &str, order: &str, body: Value) -> Value {
        self.post(&format!("{mission}/{order}"), &body).await.expected(200)
    }

    /// Reports both AUVs and the surface craft of now.
    pub(super) async fn hear(&self, mission: &str) -> Value {
        let now = self.now(mission).await;
        self.order(mission, "reports", heard(now)).await
    }

    /// Starts a live mission with reports.
    pub(crate) async fn running(&self) -> String {
        let mission = self.create(&live()).await;
        self.hear(&mission).await;
        self.order(&mission, "run", json!({})).await;
        mission
    }

    /// The reference by the next plan after that event.
    pub(super) async fn reference_after(&self, mission: &str, sequence: &Value) -> Value {
        let path = format!("{mission}/reference?wait_s=10&after={sequence}");
        let reference = self.ask(&path).await;
        assert!(sequence.as_u64() < reference["sequence"].as_u64(), "{reference}");
        reference
    }

    /// The mission with that status, which it must reach within a simulated minute.
    pub(super) async fn until(&self, mission: &str, status: &str) -> Value {
        let start = self.clock.now();
        loop {
            let seen = self.ask(mission).await;
            if seen["status"] == status {
                return seen;
            }
            let waited = self.clock.since(start);
            assert!(waited < Duration::from_mins(1), "is not {status}: {seen}");
            self.clock.sleep(Duration::from_millis(20)).await;
        }
    }

    /// Asserts that the simulated mission is `flown`, to the bit. Returns its plans.
    pub(super) async fn assert_is(&self, mission: &str, flown: &sim::record::Record) -> Vec<Value> {
        let planned = self.record(mission, "events_ndjson&kinds=planned").await;
        assert_eq!(planned.len(), flown.rows.len());
        for (event, row) in planned.iter().zip(&flown.rows) {
            let craft = row.surface_craft.as_ref().expect("is there");
            let (position, truth) = (craft.position, &event["truth"]);
            let found = [
                &event["t_s"],
                &truth["asc"]["north_m"],
                &truth["asc"]["east_m"],
                &truth["distance_m"],
                &event["reference"]["speed_mps"],
            ];
            let expected = [row.time, position.x, position.y, craft.distance(), craft.reference.speed];
            assert_eq!(found.map(Value::as_f64), expected.map(Some));
            assert_eq!(event["outcome"], "ok");
            for (id, vessel) in flown.vessel_ids.iter().zip(&row.vessels) {
                let found = ["north_m", "east_m"].map(|member| number(&truth["vessels"][id][member]));
                assert_eq!(found, <[f64; 2]>::from(vessel.position));
            }
        }
        planned
    }

    /// Replays every plan of a mission, and asserts that all are equal. Returns their number.
    pub(super) fn n_replayed(&self, mission: &str) -> u64 {
        let reader = EventReader::of(self.data.path()).expect("opens");
        let replayed = replay(&reader, id(mission), &mut |_, _| {});
        let replayed = replayed.expect("is whole").expect("is there");
        assert_eq!((&*replayed.different, replayed.cut_short), (&[] as &[u64], 0));
        replayed.equal
    }

    /// The lines of the mission's record in that format.
    pub(super) async fn record(&self, mission: &str, format: &str) -> Vec<Value> {
        let record = self.get(&format!("{mission}/record?format={format}")).await;
        record.must_be(200);
        let lines = record.text.lines();
        lines.map(|line| serde_json::from_str(line).expect("is JSON")).collect()
    }

    /// Every event of the mission.
    pub(super) async fn events(&self, mission: &str) -> Vec<Value> {
        self.record(mission, "events_ndjson").await
    }
}

/// The name of a mission with that path.
pub(crate) fn id(mission: &str) -> &str {
    mission.rsplit('/').next().expect("is a path")
}

pub(super) fn number(value: &Value) -> f64 {
    value.as_f64().expect("is a number")
}

pub(super) fn simulated(scenario: &str) -> Value {
    json!({ "schema_version": "1.0", "simulated": { "scenario": scenario, "seed": 1 } })
}

/// A scenario of a minute, as a client sends a whole one.
pub(super) fn short_scenario() -> Value {
    let text = Scenario::text("paper-tracking").expect("exists");
    let lines = text.lines().map(|line| match line.split_once(" = ").map_or("", |(key, _)| key) {
        "duration_s" => "duration_s = 60.0",
        "settled_after_s" => "settled_after_s = 0.0",
        _ => line,
    });
    let text = lines.collect::<Vec<_>>().join("\n");
    json!({ "schema_version": "1.0", "simulated": { "scenario_file": text, "seed": 3 } })
}

pub(super) fn live() -> Value {
    json!({ "schema_version": "1.0", "title": "two AUVs", "metadata": { "boat": 7 }, "live": {
        "auvs": [{ "id": "auv-1" }, { "id": "auv-2" }],
        "goal": { "kind": "midpoint", "auvs": ["auv-1", "auv-2"] },
        "period_s": 1.0, "clock_rate": 10.0,
    } })
}

/// A few times the resolution of Unix time in an `f64`, s, on a clock ten times as fast.
pub(super) const UNIX_RESOLUTION_S: f64 = 1e-5;

pub(super) fn fix(t_s: f64, north_m: f64, east_m: f64) -> Value {
    json!({ "t_s": t_s, "north_m": north_m, "east_m": east_m, "sigma_m": 1.0 })
}

pub(super) fn asc(t_s: f64) -> Value {
    json!([{ "t_s": t_s, "state": { "north_m": 0.0, "east_m": 0.0, "heading_rad": 0.0, "speed_mps": 0.2,
        "sway_mps": 0.0, "yaw_rate_radps": 0.0 } }])
}

/// Both AUVs a few seconds ago, and the surface craft now.
pub(super) fn heard(now: f64) -> Value {
    json!({ "received_s": now, "auvs": {
        "auv-1": [fix(now - 4.0, 10.0, -20.0)],
        "auv-2": [fix(now - 2.0, 10.0, 20.0)],
    }, "asc": asc(now) })
}
