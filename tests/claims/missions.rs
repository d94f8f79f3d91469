//! Simulated and live missions through the API: stored as clients saw them, unchanged by a restart.

use std::{fs, sync::Arc, time::Duration};

use axum::{
    Router,
    body::Body,
    http::{HeaderValue, Request, StatusCode},
};
use clock::Clock;
use futures_util::StreamExt as _;
use planner::{
    los::{LosLaw, LosTuning},
    parameters::Parameters,
};
use serde_json::{Value, json};
use service::{
    Settings,
    missions::{Missions, replay::replay},
};
use sim::{
    guide::{LosGuide, MpcGuide},
    mission,
    scenario::Scenario,
};
use store::{EventReader, EventStore, FILE_NAME};
use tempfile::TempDir;
use tests::client::{Answer, get, post, send_to, simulated_machine};
use tower::ServiceExt as _;

mod changes;
mod earth;
mod laws;
mod orders;
mod parts;

/// A service on a simulated machine: its time passes while everything waits.
struct Service {
    clock: Clock,
    router: Router,
    missions: Missions,
    data: TempDir,
}

impl Service {
    /// With no missions yet.
    async fn start() -> Self {
        let data = tempfile::tempdir().expect("is made");
        Self::start_in(simulated_machine(), data, u64::MAX).await
    }

    /// On the store in `data`, of which a client may use `share` bytes.
    async fn start_in(settings: Settings, data: TempDir, share: u64) -> Self {
        let clock = settings.clock.clone();
        let store = EventStore::open_with(data.path(), share, &clock).expect("opens");
        let (router, missions) = service::service(settings, store).await.expect("starts");
        Self {
            clock,
            router,
            missions,
            data,
        }
    }

    async fn restart(self) -> Self {
        let Self {
            clock,
            router,
            missions,
            data,
        } = self;
        missions.close();
        drop((router, missions));
        // Simulated time passes when the store's writer has ended.
        clock.sleep(Duration::from_millis(1)).await;
        let settings = Settings {
            clock,
            ..simulated_machine()
        };
        Self::start_in(settings, data, u64::MAX).await
    }

    /// Time on the clock of a rehearsal at tenfold speed.
    fn mission_now(&self, mission: &Value) -> f64 {
        let created = mission["created_s"].as_f64().expect("has a time");
        created + 10.0 * (self.clock.unix_s() - created)
    }

    async fn get(&self, path: &str) -> Answer {
        send_to(self.router.clone(), get(path)).await
    }

    async fn post(&self, path: &str, body: &Value) -> Answer {
        send_to(self.router.clone(), post(path, body.to_string())).await
    }

    async fn post_keyed(&self, path: &str, body: &Value, key: &'static str) -> Answer {
        let mut request = post(path, body.to_string());
        request
            .headers_mut()
            .insert("idempotency-key", HeaderValue::from_static(key));
        send_to(self.router.clone(), request).await
    }

    /// Creates a mission, and returns its path.
    async fn create(&self, body: &Value) -> String {
        let made = self.post("/v1/missions", body).await;
        assert_eq!(made.status, StatusCode::CREATED, "{}", made.text);
        let path = made.headers["location"].to_str().expect("is text").to_owned();
        assert!(path.ends_with(made.json()["id"].as_str().expect("has a name")));
        path
    }

    async fn ask(&self, path: &str) -> Value {
        let answer = self.get(path).await;
        assert_eq!(answer.status, StatusCode::OK, "{}", answer.text);
        answer.json()
    }

    async fn order(&self, mission: &str, order: &str, body: Value) -> Value {
        let answer = self.post(&format!("{mission}/{order}"), &body).await;
        assert_eq!(answer.status, StatusCode::OK, "{}", answer.text);
        answer.json()
    }

    /// The mission with that status, which it must reach within a simulated minute.
    async fn until(&self, mission: &str, status: &str) -> Value {
        let start = self.clock.now();
        loop {
            let seen = self.ask(mission).await;
            if seen["status"] == status {
                return seen;
            }
            assert!(
                self.clock.since(start) < Duration::from_mins(1),
                "is not {status}: {seen}"
            );
            self.clock.sleep(Duration::from_millis(20)).await;
        }
    }

    /// Asserts that the simulated mission is `flown`, to the bit. Returns its plans.
    async fn assert_is(&self, mission: &str, flown: &sim::record::Record) -> Vec<Value> {
        let mut planned = self.record(mission).await;
        planned.retain(|event| event["kind"] == "planned");
        assert_eq!(planned.len(), flown.rows.len());
        for (event, row) in planned.iter().zip(&flown.rows) {
            let craft = row.surface_craft.as_ref().expect("is there");
            let truth = &event["truth"];
            assert_eq!(
                (&event["t_s"], &event["outcome"]),
                (&json!(row.time), &json!("ok"))
            );
            assert_eq!(truth["asc"]["north_m"], craft.position.x);
            assert_eq!(truth["asc"]["east_m"], craft.position.y);
            assert_eq!(truth["distance_m"], craft.distance());
            assert_eq!(event["reference"]["speed_mps"], craft.reference.speed);
        }
        planned
    }

    /// Replays every plan of a mission, and asserts that all are equal. Returns their number.
    fn n_replayed(&self, mission: &str) -> u64 {
        let id = mission.rsplit('/').next().expect("has a name");
        let reader = EventReader::of(self.data.path()).expect("opens");
        let replayed = replay(&reader, id, &mut |_, _| {})
            .expect("is whole")
            .expect("is there");
        assert_eq!((&*replayed.different, replayed.cut_short), (&[] as &[u64], 0));
        replayed.equal
    }

    /// Every event of the mission.
    async fn record(&self, mission: &str) -> Vec<Value> {
        let answer = self.get(&format!("{mission}/record?format=events_ndjson")).await;
        assert_eq!(answer.status, StatusCode::OK, "{}", answer.text);
        let lines = answer
            .text
            .lines()
            .map(|line| serde_json::from_str(line).expect("is JSON"));
        lines.collect()
    }
}

fn simulated(scenario: &str) -> Value {
    json!({ "schema_version": "1.0", "simulated": { "scenario": scenario, "seed": 1 } })
}

/// A scenario of a minute, as a client sends a whole one.
fn short_scenario() -> Value {
    let text = Scenario::text("paper-tracking").expect("exists");
    let duration = text
        .lines()
        .find(|line| line.starts_with("duration_s"))
        .expect("is there");
    let text = text.replace(duration, "duration_s = 60.0");
    let settled = text.lines().find(|line| line.starts_with("settled_after_s"));
    let text = settled.map_or(text.clone(), |line| text.replace(line, "settled_after_s = 0.0"));
    json!({ "schema_version": "1.0", "simulated": { "scenario_file": text, "seed": 3 } })
}

fn live() -> Value {
    json!({ "schema_version": "1.0", "title": "two AUVs", "metadata": { "boat": 7 }, "live": {
        "auvs": [{ "id": "auv-1" }, { "id": "auv-2" }],
        "goal": { "kind": "midpoint", "auvs": ["auv-1", "auv-2"] },
        "period_s": 1.0, "clock_rate": 10.0,
    } })
}

/// A few times the resolution of Unix time in an `f64`, s, on a clock ten times as fast.
const UNIX_RESOLUTION_S: f64 = 1e-5;

fn fix(t_s: f64, north_m: f64, east_m: f64) -> Value {
    json!({ "t_s": t_s, "north_m": north_m, "east_m": east_m, "sigma_m": 1.0 })
}

fn asc(t_s: f64) -> Value {
    json!([{ "t_s": t_s, "state": { "north_m": 0.0, "east_m": 0.0, "heading_rad": 0.0, "speed_mps": 0.2,
        "sway_mps": 0.0, "yaw_rate_radps": 0.0 } }])
}

/// Both AUVs a few seconds ago, and the surface craft now.
fn heard(now: f64) -> Value {
    json!({ "received_s": now, "auvs": {
        "auv-1": [fix(now - 4.0, 10.0, -20.0)],
        "auv-2": [fix(now - 2.0, 10.0, 20.0)],
    }, "asc": asc(now) })
}

#[tokio::test(start_paused = true)]
async fn every_plan_has_its_prediction_and_a_record_can_be_read_in_parts() {
    let service = Service::start().await;
    let mission = service.create(&simulated("noisy-fixes")).await;
    service.order(&mission, "step", json!({ "ticks": 30 })).await;
    let part = async |query: &str| {
        let answer = service.get(&format!("{mission}/record?{query}")).await;
        assert_eq!(answer.status, StatusCode::OK, "{}", answer.text);
        answer.text
    };
    let lines = part("format=events_ndjson&kinds=planned&after=11&max_events=3").await;
    let events: Vec<Value> = lines
        .lines()
        .map(|line| serde_json::from_str(line).expect("is JSON"))
        .collect();
    assert_eq!(
        events
            .iter()
            .map(|event| event["sequence"].as_u64())
            .collect::<Vec<_>>(),
        [Some(12), Some(13), Some(14)]
    );
    for event in &events {
        assert!(event["prediction"].to_string().len() < 2_000, "{event}");
        let prediction: wire::Prediction =
            serde_json::from_value(event["prediction"].clone()).expect("has the shape");
        let n = prediction.after_s.len();
        assert!((2..=13).contains(&n) && prediction.after_s[0] == 0.0 && prediction.after_s.is_sorted());
        assert!(
            [
                prediction.asc.len(),
                prediction.goal.len(),
                prediction.line_of_sight.len()
            ] == [n; 3]
        );
        let auv = &prediction.auvs[0];
        assert!([auv.positions.len(), auv.depths_m.len(), auv.covariances_m2.len()] == [n; 3]);
        // Variances and the correlation of a covariance, which grows with time.
        assert!(
            auv.covariances_m2
                .iter()
                .all(|[nn, ne, ee]| 0.0 < *nn && ne * ne <= nn * ee)
        );
        assert!(
            auv.covariances_m2
                .windows(2)
                .all(|pair| pair[0][0] + pair[0][2] <= pair[1][0] + pair[1][2] + 1e-3)
        );
        // The future is unknown: the fix is one that was sent, and its age is that of the estimate.
        let heard = auv.heard.expect("was heard");
        assert!(heard.t_s <= event["t_s"].as_f64().expect("has a time"));
    }
    let first = part("format=csv&max_events=1").await;
    assert_eq!(first.lines().count(), 2, "a header and the making: {first}");
    let orders = part("format=csv&kinds=created,ran").await;
    assert!(
        orders.lines().skip(1).all(|line| line.contains("created")),
        "{orders}"
    );
    assert_eq!(part("format=events_ndjson&after=99999").await, "");
    let known = part("format=csv&kinds=planned&max_events=1").await;
    assert!(known.lines().any(|line| line.contains(",known,")), "{known}");
    let answer = service
        .get(&format!("{mission}/record?format=csv&kinds=planned,nonsense"))
        .await;
    assert_eq!(answer.status, StatusCode::UNPROCESSABLE_ENTITY);
    assert!(
        answer.text.contains("\"kinds\"") && answer.text.contains("clock_set"),
        "{}",
        answer.text
    );
}

/// The log has four plans a page; reading gives their whole JSON.
#[tokio::test(start_paused = true)]
async fn a_plan_takes_less_than_a_kilobyte_of_the_disk() {
    let service = Service::start().await;
    let mission = service.create(&simulated("paper-intermittent")).await;
    service.order(&mission, "step", json!({ "ticks": 30 })).await;
    let log = rusqlite::Connection::open(service.data.path().join(FILE_NAME)).expect("opens");
    let bytes = |query: &str| {
        log.query_row(query, [], |row| row.get::<_, i64>(0))
            .expect("reads")
    };
    let plan = bytes("SELECT CAST(avg(length(body)) AS INTEGER) FROM events WHERE kind = 'planned'");
    let checkpoint = bytes("SELECT length(body) FROM snapshots");
    assert!(plan < 1_000 && checkpoint < 10_000, "{plan}, {checkpoint}");
    let read = service
        .get(&format!("{mission}/record?format=events_ndjson&kinds=planned"))
        .await;
    assert!(read.text.lines().count() == 30 && 30 * 2_000 < read.text.len());
}

#[tokio::test(start_paused = true)]
async fn a_scene_has_the_contents_of_a_map_and_the_controller_s_task() {
    let service = Service::start().await;
    let mut new = simulated("crowded");
    new["simulated"]["controller"] = json!("saturated_los");
    let mission = service.create(&new).await;
    let scene = service.ask(&format!("{mission}/scene")).await;
    assert_eq!(
        (scene["controller"].as_str(), scene["duration_s"].as_f64()),
        (Some("saturated_los"), Some(1920.0))
    );
    // Like `pilotfish compare`, whose scores are of a record of the same scenario.
    let scenario = Scenario::named("crowded").expect("exists");
    let flown = mission::Mission::new(&scenario, "", 1).expect("starts");
    assert_eq!(
        scene["settled_after_s"].as_f64(),
        Some(flown.record().settled_after)
    );
    assert_eq!(scene["keep_outs"].as_array().map(Vec::len), Some(1));
    assert_eq!(scene["paths"].as_object().map(serde_json::Map::len), Some(2));
    assert!(
        scene["range_max_m"].as_f64().is_some()
            && scene["information"]
                .as_str()
                .is_some_and(|said| said.contains("current"))
    );

    let mut new = live();
    new["live"]["auvs"][0]["path"] =
        json!({ "segments": [{ "kind": "line", "from": [0, 0], "to": [100, 0] }], "speed_mps": 0.3 });
    new["live"]["area"] = json!([[-50, -50], [-50, 50], [50, 50], [50, -50]]);
    let mission = service.create(&new).await;
    let scene = service.ask(&format!("{mission}/scene")).await;
    let path = scene["paths"]["auv-1"].as_array().expect("is known");
    assert_eq!(
        (&path[0], path.last()),
        (&json!([0.0, 0.0]), Some(&json!([100.0, 0.0])))
    );
    assert_eq!(
        (
            scene["clock_rate"].as_f64(),
            scene["area"].as_array().map(Vec::len)
        ),
        (Some(10.0), Some(4))
    );
    assert!(scene["information"].is_null() && scene["settled_after_s"].is_null());
    assert_eq!(
        service.get("/v1/missions/m-nowhere/scene").await.status,
        StatusCode::NOT_FOUND
    );

    let access = service.ask("/v1/access").await;
    assert_eq!(
        access,
        json!({ "role": "admin", "caller": null, "protected": false })
    );
}

#[tokio::test(start_paused = true)]
async fn a_whole_scenario_may_be_sent_and_its_errors_are_named() {
    let service = Service::start().await;
    let mission = service.create(&short_scenario()).await;
    service.order(&mission, "run", json!({})).await;
    let finished = service.until(&mission, "finished").await;
    assert_eq!(finished["t_s"], 59.0);

    for (mut body, place, value, pointer, said) in [
        (
            simulated("nowhere"),
            "",
            Value::Null,
            "/simulated/scenario",
            "paper-tracking",
        ),
        (
            json!({ "schema_version": "1.0" }),
            "",
            Value::Null,
            "",
            "either simulated or live",
        ),
        (
            short_scenario(),
            "/simulated/scenario_file",
            json!("title = 1"),
            "/simulated/scenario_file",
            "scenario_file:1",
        ),
        (live(), "/schema_version", json!("9"), "/schema_version", "1.0"),
        (live(), "/title", json!("x".repeat(201)), "/title", "200"),
        (live(), "/live/period_s", json!(0.1), "/live/period_s", "0.5"),
        (live(), "/live/clock_rate", json!(100.0), "/live/clock_rate", "60"),
        (live(), "/live/auvs/0/id", json!(""), "/live/auvs/0/id", ""),
        (
            live(),
            "/live/auvs/0/id",
            json!("asc"),
            "/live/auvs/0/id",
            "surface craft",
        ),
        (live(), "/live/goal/auvs", json!(["x"]), "/live/goal/auvs/0", ""),
    ] {
        if !place.is_empty() {
            *body.pointer_mut(place).expect("is there") = value;
        }
        let answer = service.post("/v1/missions", &body).await;
        assert_eq!(answer.status, StatusCode::UNPROCESSABLE_ENTITY, "{}", answer.text);
        assert_eq!(answer.faults()[0].0, pointer, "{}", answer.text);
        assert!(answer.text.contains(said), "{}", answer.text);
    }
}

#[tokio::test(start_paused = true)]
async fn a_mission_without_a_title_is_called_by_its_scenario_or_its_first_auv() {
    let service = Service::start().await;
    let mut untitled = live();
    untitled["title"] = Value::Null;
    for (body, title) in [
        (simulated("paper-tracking"), "paper-tracking, seed 1"),
        (short_scenario(), "own scenario, seed 3"),
        (untitled, "auv-1"),
        (live(), "two AUVs"),
    ] {
        let mission = service.create(&body).await;
        assert_eq!(service.ask(&mission).await["title"], title);
    }
}

#[tokio::test(start_paused = true)]
async fn a_live_mission_plans_every_period_degrades_with_age_and_names_missing_vehicles() {
    let service = Service::start().await;
    let mission = service.create(&live()).await;
    let made = service.ask(&mission).await;
    assert_eq!(
        (&made["title"], &made["metadata"]["boat"]),
        (&json!("two AUVs"), &json!(7))
    );
    service.order(&mission, "run", json!({})).await;
    let reference = format!("{mission}/reference");
    let unknown = service.get(&reference).await;
    assert_eq!(unknown.status, StatusCode::CONFLICT);
    assert_eq!(unknown.problem()["code"], "no_plan_yet");
    assert!(unknown.text.contains("asc, auv-1, auv-2"), "{}", unknown.text);

    let now = service.mission_now(&made);
    let accepted = service.order(&mission, "reports", heard(now)).await;
    let first = service.ask(&format!("{reference}?wait_s=10")).await;
    assert!(accepted["sequence"].as_u64() < first["sequence"].as_u64());
    assert_eq!(
        (&first["outcome"], &first["method"]),
        (&json!("ok"), &json!("mpc"))
    );
    assert_eq!(
        first["heard_s"],
        json!({ "asc": now, "auv-1": now - 4.0, "auv-2": now - 2.0 })
    );
    // Periods of 1 s on a clock of tenfold speed, as exactly as a float holds Unix time.
    let after = first["sequence"].as_u64().expect("is a number");
    let second = service.ask(&format!("{reference}?wait_s=10&after={after}")).await;
    let apart = second["t_s"].as_f64().expect("is one") - first["t_s"].as_f64().expect("is one");
    assert!((apart - 1.0).abs() < UNIX_RESOLUTION_S, "{apart}");
    // A fix from before all others, one twice, and one out of turn.
    let late = json!({ "auvs": { "auv-1": [fix(now - 1.0, 10.6, -20.0), fix(now - 60.0, 0.0, -20.0),
        fix(now - 1.0, 10.6, -20.0)] } });
    service.order(&mission, "reports", late).await;

    // The craft's position is unknown after ten seconds of the mission, one of the service.
    service.clock.sleep(Duration::from_millis(1_150)).await;
    let silent = service.ask(&reference).await;
    assert_eq!(silent["waits_for"], json!(["asc"]));
    // A client that lists missions sees that the plan is several periods old.
    let listed = service.ask("/v1/missions").await["missions"][0]["plan"].clone();
    assert_eq!(
        (listed["period_s"].as_f64(), &listed["waits_for"]),
        (Some(1.0), &json!(["asc"]))
    );
    service.clock.sleep(Duration::from_millis(500)).await;
    let later = service.ask("/v1/missions").await["missions"][0]["plan"].clone();
    let age = |plan: &Value| plan["age_s"].as_f64().expect("is one");
    assert!(
        (age(&later) - age(&listed) - 5.0).abs() < UNIX_RESOLUTION_S,
        "{listed} {later}"
    );
    let carried = silent["t_s"].as_f64().expect("is one") - now;
    assert!((carried - 10.0).abs() < UNIX_RESOLUTION_S, "{carried}");
    assert_eq!(silent["heard_s"]["auv-1"], now - 1.0);

    assert_eq!(silent["missed"], 0);
    assert_eq!(service.n_replayed(&mission), 10);
}

#[tokio::test(start_paused = true)]
async fn a_vehicle_with_stale_reports_is_not_followed_and_is_named() {
    let service = Service::start().await;
    let mission = service.create(&live()).await;
    let made = service.ask(&mission).await;
    let now = service.mission_now(&made);
    let age = Parameters::default().report_age_max;
    let mut old = heard(now);
    old["auvs"]["auv-1"][0]["t_s"] = json!(now - age - 1.0);
    service.order(&mission, "reports", old).await;
    service.order(&mission, "run", json!({})).await;
    let held = service
        .ask(&format!("{mission}/reference?wait_s=5&after=0"))
        .await;
    assert_eq!(
        (&held["outcome"], &held["method"]),
        (&json!("degraded"), &json!("hold"))
    );
    assert_eq!(held["plan"]["reason"], "stale_report");
    assert_eq!(held["heard_s"]["auv-1"], now - age - 1.0);
}

#[tokio::test(start_paused = true)]
async fn a_restart_keeps_all_knowledge_and_plans_as_before() {
    let mut service = Service::start().await;
    let mission = service.create(&live()).await;
    let made = service.ask(&mission).await;
    service.order(&mission, "run", json!({})).await;
    for _ in 0..3 {
        let now = service.mission_now(&made);
        service.order(&mission, "reports", heard(now)).await;
        service.ask(&format!("{mission}/reference?wait_s=5")).await;
        // Heard after the last snapshot.
        let more = json!({ "auvs": { "auv-2": [fix(now - 1.0, 11.0, 20.0)] } });
        let heard = service.order(&mission, "reports", more).await;
        let after = heard["sequence"].as_u64().expect("is a number");
        service = service.restart().await;
        // The previous plan is there until the next, which is made without a request.
        let kept = service.ask(&format!("{mission}/reference")).await;
        assert_eq!(kept["plan"]["outcome"], "ok");
        let next = format!("{mission}/reference?wait_s=5&after={after}");
        let planned = service.ask(&next).await;
        assert_eq!(planned["heard_s"]["auv-2"], now - 1.0);
    }
    let last = service.ask(&format!("{mission}/reference")).await;
    for _ in 0..2 {
        let finished = service.order(&mission, "finish", json!({})).await;
        assert_eq!(finished["status"], "finished");
    }
    // The last plan is there; a client does not wait for the next, which never comes.
    let service = service.restart().await;
    let asked = service.clock.now();
    let kept = service.ask(&format!("{mission}/reference?wait_s=60")).await;
    assert_eq!(service.clock.now(), asked);
    assert!(last["sequence"].as_u64() <= kept["sequence"].as_u64());
    assert_eq!(
        (&kept["status"], &kept["plan"]["schema_version"]),
        (&json!("finished"), &json!("1.0"))
    );
    assert!(3 < service.n_replayed(&mission));
    let record = service.record(&mission).await;
    let sequences: Vec<u64> = record
        .iter()
        .filter_map(|event| event["sequence"].as_u64())
        .collect();
    assert!(
        sequences.iter().copied().eq(1..=record.len() as u64),
        "{sequences:?}"
    );
    assert_eq!(record.last().expect("is there")["kind"], "finished");
}

#[tokio::test(start_paused = true)]
async fn a_repeated_request_with_its_key_is_carried_out_once() {
    let service = Service::start().await;
    let made = service.post_keyed("/v1/missions", &live(), "make").await;
    assert_eq!(made.status, StatusCode::CREATED);
    let again = service.post_keyed("/v1/missions", &live(), "make").await;
    assert_eq!((again.status, again.json()), (StatusCode::CREATED, made.json()));
    let other = service
        .post_keyed("/v1/missions", &simulated("paper-tracking"), "make")
        .await;
    assert_eq!(other.problem()["code"], "idempotency_key_taken");

    let mission = format!("/v1/missions/{}", made.json()["id"].as_str().expect("has a name"));
    let reports = format!("{mission}/reports");
    let body = heard(service.mission_now(&made.json()));
    let first = service.post_keyed(&reports, &body, "first").await;
    assert_eq!(first.json(), json!({ "sequence": 2 }));
    service.post_keyed(&reports, &body, "second").await;
    service
        .post_keyed(&format!("{mission}/finish"), &json!({}), "end")
        .await;
    let service = service.restart().await;
    // A client that lost the answer gets it, although the mission is over.
    assert_eq!(
        service.post_keyed(&reports, &body, "first").await.json(),
        json!({ "sequence": 2 })
    );
    let ended = service
        .post_keyed(&format!("{mission}/finish"), &json!({}), "end")
        .await;
    assert_eq!(ended.json()["status"], "finished");
    let new = service.post_keyed(&reports, &body, "third").await;
    assert_eq!(
        (new.status, new.problem()["code"].as_str()),
        (StatusCode::CONFLICT, Some("conflict"))
    );
    assert_eq!(service.ask(&mission).await["sequence"], 4);
}

#[tokio::test(start_paused = true)]
async fn reports_without_an_acceptable_one_are_refused_with_each_fault_s_place() {
    let service = Service::start().await;
    let mission = service.create(&live()).await;
    let now = service.mission_now(&service.ask(&mission).await);
    let mut body = heard(now);
    body["auvs"]["auv-1"][0]["north_m"] = json!(1e9);
    body["auvs"]["auv-2"][0]["sigma_m"] = json!(-1.0);
    body["auvs"]["a/b"] = json!([fix(now, 0.0, 0.0)]);
    body["asc"][0]["state"]["speed_mps"] = json!(1e6);
    body["asc"][0]["t_s"] = json!(5.0);
    body["asc"][0]["current"] = json!({ "north_mps": 1e6, "east_mps": 0 });
    let note = |t_s: f64, length: usize| json!({ "t_s": t_s, "text": "x".repeat(length) });
    body["notes"] = json!([note(5.0, 3), note(now, 501)]);
    let refused = service.post(&format!("{mission}/reports"), &body).await;
    let mut pointers: Vec<String> = refused.faults().into_iter().map(|(pointer, _)| pointer).collect();
    pointers.sort();
    assert_eq!(
        pointers,
        [
            "/asc/0/current/north_mps",
            "/asc/0/state/speed_mps",
            "/asc/0/t_s",
            "/auvs/auv-1/0/north_m",
            "/auvs/auv-2/0/sigma_m",
            "/auvs/a~1b",
            "/notes/0/t_s",
            "/notes/1/text"
        ]
    );
    let ahead = json!({ "auvs": { "auv-1": [fix(now + 1000.0, 0.0, 0.0)] } });
    let refused = service.post(&format!("{mission}/reports"), &ahead).await;
    assert_eq!(
        refused.faults(),
        [("/auvs/auv-1/0/t_s".to_owned(), "out_of_range".to_owned())]
    );
    for nothing in [json!({}), json!({ "received_s": now })] {
        let refused = service.post(&format!("{mission}/reports"), &nothing).await;
        assert_eq!(refused.faults()[0].1, "missing");
    }
    let many = json!({ "auvs": { "auv-1": vec![fix(now, 0.0, 0.0); 65] } });
    let refused = service.post(&format!("{mission}/reports"), &many).await;
    assert_eq!(refused.faults()[0].1, "too_long");
    // A map would keep one of two equal names.
    let twice = format!(
        r#"{{"auvs":{{"auv-1":[{0}],"auv-1":[{0}]}}}}"#,
        fix(now, 0.0, 0.0)
    );
    let refused = send_to(service.router.clone(), post(&format!("{mission}/reports"), twice)).await;
    assert_eq!(
        refused.faults(),
        [("/auvs/auv-1".to_owned(), "duplicate_field".to_owned())]
    );
    let others: serde_json::Map<String, Value> = (0..1000).map(|k| (k.to_string(), json!([]))).collect();
    let refused = service
        .post(&format!("{mission}/reports"), &json!({ "auvs": others }))
        .await;
    assert_eq!(refused.faults(), [("/auvs".to_owned(), "too_long".to_owned())]);
    assert_eq!(service.ask(&mission).await["sequence"], 1);
}

#[tokio::test(start_paused = true)]
async fn a_rejected_report_affects_no_other() {
    let service = Service::start().await;
    let mission = service.create(&live()).await;
    let now = service.mission_now(&service.ask(&mission).await);
    let mut body = heard(now);
    let mut odd = fix(now, 3.0, 4.0);
    odd["sigma_m"] = json!(1e9);
    let list = body["auvs"]["auv-1"].as_array_mut().expect("a list");
    list.splice(0..0, [odd, json!({ "t_s": now })]);
    body["auvs"]["auv-9"] = json!([fix(now, 0.0, 0.0), fix(now, 1.0, 0.0)]);
    body["notes"] = json!([{ "t_s": now, "text": 5 }, { "t_s": now, "text": "kept" }]);
    let reports = format!("{mission}/reports");
    let answer = service.post_keyed(&reports, &body, "some").await;
    assert_eq!(answer.status, StatusCode::OK, "{}", answer.text);
    let accepted = answer.json();
    let rejected = accepted["rejected"].as_array().expect("a list");
    let mut pointers: Vec<_> = rejected.iter().map(|error| error["pointer"].as_str()).collect();
    pointers.sort();
    let expected = [
        "/auvs/auv-1/0/sigma_m",
        "/auvs/auv-1/1/north_m",
        "/auvs/auv-9",
        "/notes/0/text",
    ];
    assert_eq!(pointers, expected.map(Some), "{accepted}");
    let sigma = rejected
        .iter()
        .find(|error| error["pointer"] == expected[0])
        .expect("is there");
    assert_eq!(
        (&sigma["given"], &sigma["code"]),
        (&json!(1e9), &json!("out_of_range"))
    );
    assert!(sigma["limit"]["most"].is_number(), "{sigma}");
    assert_eq!(service.post_keyed(&reports, &body, "some").await.json(), accepted);

    let stored = &service.record(&mission).await[1]["heard"];
    let left = heard(now);
    assert_eq!(stored["auvs"], left["auvs"]);
    assert_eq!(stored["notes"], json!([{ "t_s": now, "text": "kept" }]));
    assert_eq!(stored["rejected"], accepted["rejected"]);
    assert_eq!(service.ask(&mission).await["sequence"], 2);
}

#[tokio::test(start_paused = true)]
async fn a_wrong_clock_is_reported_in_seconds() {
    let service = Service::start().await;
    let mission = service.create(&live()).await;
    for (off, told) in [(1000.0, "ahead of"), (-90_000.0, "behind")] {
        let now = service.mission_now(&service.ask(&mission).await);
        let off_clock = json!({ "received_s": now + off, "auvs": { "auv-1": [fix(now + off, 0.0, 0.0)] }, "asc": asc(now + off) });
        let refused = service.post(&format!("{mission}/reports"), &off_clock).await;
        let document = refused.problem();
        let errors = document["errors"].as_array().expect("a list");
        let pointers: Vec<_> = errors.iter().map(|error| error["pointer"].as_str()).collect();
        let expected = ["/received_s", "/auvs/auv-1/0/t_s", "/asc/0/t_s"].map(Some);
        assert!(
            pointers.iter().all(|pointer| expected.contains(pointer)),
            "{document}"
        );
        for error in errors {
            let detail = error["detail"].as_str().expect("a text");
            let (seconds, rest) = detail
                .strip_prefix("is ")
                .and_then(|rest| rest.split_once(" s "))
                .expect(detail);
            assert!(
                rest.starts_with(&format!("{told} the mission's clock")),
                "{detail}"
            );
            let seconds: f64 = seconds.parse().expect("a number");
            assert_eq!(seconds, off.abs(), "{detail}");
        }
    }
    // A receiver on local time: an AUV's fix may be that old, a state of the craft not.
    let late = service.mission_now(&service.ask(&mission).await) - 3600.0;
    let reports = json!({ "auvs": { "auv-1": [fix(late, 0.0, 0.0)] }, "asc": asc(late) });
    let accepted = service.post(&format!("{mission}/reports"), &reports).await.json();
    let rejected = accepted["rejected"].as_array().expect("a list");
    assert_eq!(rejected.len(), 1, "{accepted}");
    assert_eq!(rejected[0]["pointer"], "/asc/0/t_s");
}

#[tokio::test(start_paused = true)]
async fn every_call_names_a_wrong_parameter() {
    let service = Service::start().await;
    let mission = service.create(&live()).await;
    let faults = async |request: Request<Body>| {
        let refused = send_to(service.router.clone(), request).await;
        assert_eq!(
            refused.status,
            StatusCode::UNPROCESSABLE_ENTITY,
            "{}",
            refused.text
        );
        let document = refused.problem();
        let error = document["errors"][0].clone();
        let (name, pointer) = (error["parameter"].as_str(), error["pointer"].as_str());
        assert_eq!(pointer, Some(""), "{document}");
        let name = name
            .unwrap_or_else(|| panic!("no parameter: {document}"))
            .to_owned();
        let detail = document["detail"].as_str().expect("a text");
        assert!(detail.starts_with(&format!("the parameter {name}: ")), "{detail}");
        (name, error["code"].as_str().expect("a text").to_owned())
    };
    let fault = |name: &str, code: &str| (name.to_owned(), code.to_owned());
    for (path, expected) in [
        ("/v1/missions?after=-1".to_owned(), fault("after", "query")),
        ("/v1/missions?limit=ten".to_owned(), fault("limit", "query")),
        (
            "/v1/missions?after=0&limit=0".to_owned(),
            fault("limit", "out_of_range"),
        ),
        (
            "/v1/missions?limit=1&limit=2".to_owned(),
            fault("limit", "duplicate_field"),
        ),
        ("/v1/missions?page=1".to_owned(), fault("page", "query")),
        (
            format!("{mission}/reference?wait_s=soon"),
            fault("wait_s", "query"),
        ),
        (
            format!("{mission}/reference?wait_s=61"),
            fault("wait_s", "out_of_range"),
        ),
        (format!("{mission}/reference?after=x"), fault("after", "query")),
        (format!("{mission}/events?after=1.5"), fault("after", "query")),
        (format!("{mission}/record?format=xlsx"), fault("format", "query")),
        (format!("{mission}/record"), fault("format", "missing")),
    ] {
        assert_eq!(faults(get(&path)).await, expected, "{path}");
    }
    let with = |mut request: Request<Body>, name: &'static str, value: &str| {
        let value = HeaderValue::from_bytes(value.as_bytes()).expect("is one");
        request.headers_mut().insert(name, value);
        request
    };
    let events = get(&format!("{mission}/events"));
    assert_eq!(
        faults(with(events, "last-event-id", "last")).await,
        fault("Last-Event-ID", "last_event_id")
    );
    for call in ["run", "pause", "finish", "step"] {
        let order = post(&format!("{mission}/{call}"), "{}");
        let fault = fault("Idempotency-Key", "idempotency_key");
        assert_eq!(faults(with(order, "idempotency-key", "é")).await, fault, "{call}");
    }
    for (path, body) in [
        ("/v1/missions".to_owned(), live()),
        (format!("{mission}/reports"), heard(service.clock.unix_s())),
    ] {
        let sent = with(post(&path, body.to_string()), "idempotency-key", "");
        assert_eq!(
            faults(sent).await,
            fault("Idempotency-Key", "idempotency_key"),
            "{path}"
        );
    }
}

#[tokio::test(start_paused = true)]
async fn a_command_of_another_kind_of_mission_is_a_conflict() {
    let service = Service::start().await;
    let real = service.create(&live()).await;
    let unreal = service.create(&simulated("paper-tracking")).await;
    let now = service.clock.unix_s();
    for (path, body) in [
        (format!("{real}/step"), json!({})),
        (format!("{real}/run"), json!({ "speed_factor": 2.0 })),
        (format!("{unreal}/reports"), heard(now)),
        (format!("{unreal}/reference"), json!(null)),
    ] {
        let refused = match body {
            Value::Null => service.get(&path).await,
            body => service.post(&path, &body).await,
        };
        assert_eq!(refused.status, StatusCode::CONFLICT, "{path}: {}", refused.text);
    }
    service
        .order(&unreal, "run", json!({ "speed_factor": 0.5 }))
        .await;
    let refused = service.post(&format!("{unreal}/step"), &json!({})).await;
    assert!(refused.text.contains("pause it first"), "{}", refused.text);
    for (path, body) in [
        ("run", json!({ "speed_factor": 0.0 })),
        ("step", json!({ "ticks": 0 })),
    ] {
        let refused = service.post(&format!("{unreal}/{path}"), &body).await;
        assert_eq!(refused.faults()[0].1, "out_of_range");
    }
    for unknown_id in ["%ff", "deleted%201", "a%2Fb"] {
        let unknown = service.get(&format!("/v1/missions/{unknown_id}")).await;
        assert_eq!(unknown.problem()["code"], "no_mission", "{unknown_id}");
    }
    let unknown = service.get("/v1/missions/unknown").await;
    assert_eq!(
        (unknown.status, unknown.problem()["code"].as_str()),
        (StatusCode::NOT_FOUND, Some("no_mission"))
    );
}

#[tokio::test(start_paused = true)]
async fn missions_are_listed_in_order_page_by_page_and_a_deleted_one_is_gone() {
    let service = Service::start().await;
    let mut made = vec![];
    for _ in 0..5 {
        made.push(service.create(&simulated("paper-tracking")).await);
    }
    let ids = |list: &Value| -> Vec<String> {
        let missions = list["missions"].as_array().expect("is a list");
        missions
            .iter()
            .map(|mission| format!("/v1/missions/{}", mission["id"].as_str().expect("is text")))
            .collect()
    };
    let (mut after, mut listed) = (0, vec![]);
    loop {
        let page = service.ask(&format!("/v1/missions?after={after}&limit=2")).await;
        listed.extend(ids(&page));
        match page["next"].as_u64() {
            Some(next) => after = next,
            None => break,
        }
    }
    assert_eq!(listed, made);
    let delete = |path: &str| Request::delete(path).body(Body::empty()).expect("is a path");
    let gone = send_to(service.router.clone(), delete(&made[2])).await;
    assert_eq!(gone.status, StatusCode::NO_CONTENT);
    assert_eq!(service.get(&made[2]).await.status, StatusCode::NOT_FOUND);
    let gone = send_to(service.router.clone(), delete(&made[2])).await;
    assert_eq!(gone.status, StatusCode::NOT_FOUND);
    made.remove(2);
    assert_eq!(ids(&service.ask("/v1/missions").await), made);
}

#[tokio::test(start_paused = true)]
async fn a_list_of_long_missions_comes_in_short_pages() {
    let service = Service::start().await;
    let mut long = simulated("paper-tracking");
    long["metadata"] = json!({ "text": "x".repeat(4_000) });
    for _ in 0..100 {
        service.create(&long).await;
    }
    let (mut after, mut n_listed, mut pages) = (0, 0, 0);
    loop {
        let page = service
            .get(&format!("/v1/missions?after={after}&limit=1000"))
            .await;
        assert!(page.text.len() < 100_000, "{}", page.text.len());
        let page = page.json();
        n_listed += page["missions"].as_array().expect("is a list").len();
        pages += 1;
        match page["next"].as_u64() {
            Some(next) => after = next,
            None => break,
        }
    }
    assert_eq!(n_listed, 100);
    assert!(4 < pages, "{pages}");
}

#[tokio::test(start_paused = true)]
async fn a_mission_deleted_during_reads_is_gone_and_not_damaged() {
    let service = Arc::new(Service::start().await);
    for _ in 0..4 {
        let mission = service.create(&live()).await;
        service.order(&mission, "run", json!({})).await;
        let now = service.mission_now(&service.ask(&mission).await);
        for _ in 0..40 {
            service.order(&mission, "reports", heard(now)).await;
        }
        let (answered, mut answers) = tokio::sync::mpsc::unbounded_channel();
        let readers: Vec<_> = [
            "reference",
            "reference?wait_s=1",
            "record?format=csv",
            "events?after=0",
        ]
        .map(|call| {
            let (service, path, answered) = (
                Arc::clone(&service),
                format!("{mission}/{call}"),
                answered.clone(),
            );
            tokio::spawn(async move {
                loop {
                    let request = Request::get(&path).body(Body::empty()).expect("is a path");
                    let answer = service.router.clone().oneshot(request).await.expect("answers");
                    let status = answer.status();
                    // A stream or a record may end early: it is not whole.
                    let mut pieces = answer.into_body().into_data_stream();
                    while let Some(Ok(_)) = pieces.next().await {}
                    // The test may have seen enough.
                    let _ = answered.send(());
                    tokio::task::yield_now().await;
                    match status {
                        StatusCode::OK | StatusCode::CONFLICT => {}
                        StatusCode::NOT_FOUND => return,
                        other => panic!("{path}: {other}"),
                    }
                }
            })
        })
        .into();
        for _ in 0..40 {
            answers.recv().await.expect("goes on");
        }
        let delete = Request::delete(&mission).body(Body::empty()).expect("is a path");
        let gone = send_to(service.router.clone(), delete).await;
        assert_eq!(gone.status, StatusCode::NO_CONTENT);
        for reader in readers {
            reader.await.expect("sees no damage");
        }
    }
    assert_eq!(service.get("/readyz").await.status, StatusCode::OK);
}

/// Text of a stream of events until `enough` of it has come, or its end.
async fn read(router: &Router, request: Request<Body>, enough: impl Fn(&str) -> bool) -> String {
    let answer = router.clone().oneshot(request).await.expect("answers");
    assert_eq!(answer.status(), StatusCode::OK);
    let mut pieces = answer.into_body().into_data_stream();
    let mut text = String::new();
    while !enough(&text) {
        let Some(piece) = pieces.next().await else { break };
        text.push_str(std::str::from_utf8(&piece.expect("is whole")).expect("is text"));
    }
    text
}

fn ids(text: &str) -> Vec<u64> {
    let ids = text.lines().filter_map(|line| line.strip_prefix("id: "));
    ids.map(|id| id.parse().expect("is a number")).collect()
}

#[tokio::test(start_paused = true)]
async fn a_stream_sends_every_event_once_from_the_reader_s_position_on() {
    let service = Service::start().await;
    let mission = service.create(&short_scenario()).await;
    service.order(&mission, "step", json!({ "ticks": 20 })).await;
    let events = format!("{mission}/events");
    let from_the_start = read(&service.router, get(&format!("{events}?after=0")), |text| {
        ids(text).len() == 21
    });
    assert_eq!(ids(&from_the_start.await), (1..=21).collect::<Vec<_>>());

    let mut resumed = get(&events);
    resumed
        .headers_mut()
        .insert("last-event-id", HeaderValue::from_static("7"));
    let router = service.router.clone();
    let reader = tokio::spawn(async move { read(&router, resumed, |_| false).await });
    service.order(&mission, "run", json!({})).await;
    let finished = service.until(&mission, "finished").await;
    let last = finished["sequence"].as_u64().expect("is a number");
    let text = reader.await.expect("does not panic");
    assert_eq!(ids(&text), (8..=last).collect::<Vec<_>>());
    assert!(text.contains("event: finished"));
    // Nothing more comes, which keeps a browser from asking for ever.
    for after in [last, u64::MAX] {
        let over = service.get(&format!("{events}?after={after}")).await;
        assert_eq!(over.status, StatusCode::NO_CONTENT);
    }
}

#[tokio::test(start_paused = true)]
async fn a_slow_reader_learns_the_numbers_of_missed_events() {
    let service = Service::start().await;
    let mission = service.create(&live()).await;
    let answer = service
        .router
        .clone()
        .oneshot(get(&format!("{mission}/events")))
        .await;
    let mut pieces = answer.expect("answers").into_body().into_data_stream();
    let made = service.ask(&mission).await;
    let post = async || {
        service
            .order(&mission, "reports", heard(service.mission_now(&made)))
            .await
    };
    post().await;
    let mut text = String::new();
    let mut take = async |text: &mut String, last: u64| {
        while !text.contains(&format!("id: {last}\n")) {
            let piece = pieces.next().await;
            text.push_str(std::str::from_utf8(&piece.expect("goes on").expect("is whole")).expect("is text"));
        }
    };
    take(&mut text, 2).await;
    for _ in 0..100 {
        post().await;
    }
    take(&mut text, 102).await;
    assert_eq!(text.matches("event: gap").count(), 1);
    // The last 64 are kept for a client that is behind.
    let gap = text
        .lines()
        .find_map(|line| line.strip_prefix("data: {\"from\""))
        .expect("is there");
    assert_eq!(gap, ":3,\"kind\":\"gap\",\"to\":38}");
    assert_eq!(ids(&text), [2].into_iter().chain(39..=102).collect::<Vec<_>>());
}

#[tokio::test(start_paused = true)]
async fn an_overloaded_mission_sends_a_retry_time_and_delays_no_other() {
    let service = Service::start().await;
    let flooded = service.create(&live()).await;
    let neighbour = service.create(&live()).await;
    let made = service.ask(&neighbour).await;
    let body = heard(service.mission_now(&made)).to_string();
    let posts = (0..200).map(|_| {
        send_to(
            service.router.clone(),
            post(&format!("{flooded}/reports"), body.clone()),
        )
    });
    let flood = futures_util::future::join_all(posts);
    let reports = format!("{neighbour}/reports");
    let calm = heard(service.mission_now(&made));
    let beside = service.post(&reports, &calm);
    let (answers, beside) = tokio::join!(flood, beside);
    assert_eq!(beside.status, StatusCode::OK, "{}", beside.text);
    let accepted = answers
        .iter()
        .filter(|answer| answer.status == StatusCode::OK)
        .count();
    let refused: Vec<&Answer> = answers
        .iter()
        .filter(|answer| answer.status != StatusCode::OK)
        .collect();
    assert!(!refused.is_empty() && 32 <= accepted, "{accepted}");
    for answer in refused {
        assert_eq!(answer.problem()["code"], "mission_behind");
        assert_eq!(answer.headers["retry-after"], "1");
    }
    // Refused requests are not stored, acknowledged ones are.
    assert_eq!(service.ask(&flooded).await["sequence"], accepted + 1);
}

#[tokio::test(start_paused = true)]
async fn a_service_without_its_data_directory_acknowledges_nothing_and_is_not_ready() {
    let service = Service::start().await;
    let (here, away) = (service.data.path(), service.data.path().with_extension("away"));
    fs::rename(here, &away).expect("is there");
    for answer in [
        service.post("/v1/missions", &live()).await,
        service.get("/readyz").await,
    ] {
        assert_eq!(answer.status, StatusCode::SERVICE_UNAVAILABLE);
        let detail = answer.problem()["detail"].to_string();
        assert!(detail.contains("deleted or replaced"), "{detail}");
    }
    fs::rename(&away, here).expect("is there");
}

#[tokio::test(start_paused = true)]
async fn a_service_without_a_data_directory_names_the_option() {
    let answer = tests::client::send(simulated_machine(), get("/v1/missions")).await;
    assert_eq!(answer.status, StatusCode::SERVICE_UNAVAILABLE);
    assert!(answer.text.contains("--data"), "{}", answer.text);
}

mod slow {
    use super::*;

    #[tokio::test(start_paused = true)]
    async fn a_simulated_mission_equals_the_simulator_s_own() {
        let service = Service::start().await;
        let mission = service.create(&simulated("paper-intermittent")).await;
        assert_eq!(service.ask(&mission).await["status"], "created");
        let stepped = service.order(&mission, "step", json!({ "ticks": 5 })).await;
        assert_eq!(stepped["sequence"], 6);
        let running = service
            .order(&mission, "run", json!({ "speed_factor": 100.0 }))
            .await;
        assert_eq!(
            (running["status"].as_str(), &running["speed_factor"]),
            (Some("running"), &json!(100.0))
        );
        service.clock.sleep(Duration::from_millis(305)).await;
        let paused = service.order(&mission, "pause", json!({})).await;
        assert_eq!(paused["status"], "paused");
        // Five plans by steps, the next at once, then one each 10 ms; the first was at 0 s.
        assert_eq!(paused["t_s"], 35.0);
        service.clock.sleep(Duration::from_millis(100)).await;
        assert_eq!(service.ask(&mission).await["t_s"], paused["t_s"]);

        // A restart in the middle.
        let service = service.restart().await;
        service.order(&mission, "run", json!({})).await;
        let finished = service.until(&mission, "finished").await;
        for time in ["created_s", "started_s", "finished_s"] {
            assert!(finished[time].as_f64().is_some(), "{time}: {finished}");
        }

        let scenario = Scenario::named("paper-intermittent").expect("exists");
        let flown = mission::run(
            &scenario,
            &mut MpcGuide::new(Parameters::default()),
            1,
            &mut |_| {},
        );
        service.assert_is(&mission, &flown.expect("flies")).await;
        assert_eq!(service.n_replayed(&mission), 1920);
    }

    #[tokio::test(start_paused = true)]
    async fn a_law_s_mission_equals_the_simulator_s_and_replays_equal() {
        for (name, law) in [
            ("saturated_los", LosLaw::SaturatedLos),
            ("integral_los", LosLaw::Integral),
            ("waypoint_box", LosLaw::WaypointBox),
        ] {
            let service = Service::start().await;
            let mut new = simulated("paper-intermittent");
            new["simulated"]["controller"] = json!(name);
            let mission = service.create(&new).await;
            service.order(&mission, "step", json!({ "ticks": 40 })).await;
            // A law's memory is restored by flying the stored mission again.
            let service = service.restart().await;
            for _ in 0..4 {
                service.order(&mission, "step", json!({ "ticks": 60 })).await;
            }

            let parameters = Parameters::default();
            let tuning = LosTuning {
                law,
                gains: parameters.los,
                integral_gain: parameters.integral_gain,
            };
            // Slightly longer than the mission's plans.
            let scenario = Scenario::named("paper-intermittent")
                .expect("exists")
                .lasting(300.0);
            let mut flown =
                mission::run(&scenario, &mut LosGuide::tuned(tuning), 1, &mut |_| {}).expect("flies");
            flown.rows.truncate(280);
            for event in service.assert_is(&mission, &flown).await {
                assert_eq!(event["method"], name);
            }
            assert_eq!(service.n_replayed(&mission), flown.rows.len() as u64, "{name}");
        }
    }
}

#[tokio::test(start_paused = true)]
async fn a_simulated_mission_pauses_before_its_job_begins_and_loses_no_plan() {
    let service = Service::start().await;
    let mission = service.create(&simulated("paper-tracking")).await;
    let step = async || service.order(&mission, "step", json!({ "ticks": 1 })).await;
    let first = step().await["t_s"].as_f64().expect("is a time");
    // Earlier simulations of others.
    service.clock.delay_threads(Duration::from_mins(1));
    service.order(&mission, "run", json!({})).await;
    let start = service.clock.now();
    service.order(&mission, "pause", json!({})).await;
    assert!(service.clock.since(start) < Duration::from_secs(1));
    service.clock.delay_threads(Duration::ZERO);
    assert_eq!(step().await["t_s"], first + 1.0);
}
