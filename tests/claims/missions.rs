//! Simulated and live missions through the API: stored as clients saw them, unchanged by a restart.

use std::{fs, sync::Arc, time::Duration};

use axum::{body::Body, http::Request};
use futures_util::StreamExt as _;
use planner::los::{LosLaw, LosTuning};
use planner::parameters::Parameters;
use serde_json::{Value, json};
use sim::guide::{LosGuide, MpcGuide};
use sim::mission;
use sim::scenario::Scenario;
use store::FILE_NAME;
use tests::client::{get, post, simulated_machine, with};
use tests::refusals::assert_refused;
use tower::ServiceExt as _;

mod changes;
mod earth;
mod fleet;
mod harness;
mod laws;
mod orders;
mod reports;
mod sharing;
mod streams;

pub(crate) use harness::{Service, id};
use harness::{UNIX_RESOLUTION_S, asc, fix, heard, live, number, short_scenario, simulated};

#[tokio::test(start_paused = true)]
async fn every_plan_has_its_prediction_and_a_record_can_be_read_in_parts() {
    let service = Service::start().await;
    let mission = service.create(&simulated("noisy-fixes")).await;
    service.order(&mission, "step", json!({ "ticks": 30 })).await;
    let part = "events_ndjson&kinds=planned&after=11&max_events=3";
    let events = service.record(&mission, part).await;
    let sequences: Vec<_> = events.iter().map(|event| &event["sequence"]).collect();
    assert_eq!(sequences, [12, 13, 14]);
    for event in &events {
        assert!(event["prediction"].to_string().len() < 2_000, "{event}");
        let prediction: wire::Prediction =
            serde_json::from_value(event["prediction"].clone()).expect("has the shape");
        let (n, auv) = (prediction.after_s.len(), &prediction.auvs[0]);
        assert!((2..=13).contains(&n) && prediction.after_s[0] == 0.0 && prediction.after_s.is_sorted());
        let lengths = [
            prediction.asc.len(),
            prediction.goal.len(),
            prediction.line_of_sight.len(),
            auv.positions.len(),
            auv.depths_m.len(),
            auv.covariances_m2.len(),
        ];
        assert_eq!(lengths, [n; 6]);
        // Variances and the correlation of a covariance, which grows with time.
        let mut covariances = auv.covariances_m2.iter();
        assert!(covariances.all(|[nn, ne, ee]| 0.0 < *nn && ne * ne <= nn * ee));
        let mut pairs = auv.covariances_m2.windows(2);
        assert!(pairs.all(|pair| pair[0][0] + pair[0][2] <= pair[1][0] + pair[1][2] + 1e-3));
        // The future is unknown: the fix is one that was sent, and its age is that of the estimate.
        assert!(auv.heard.expect("was heard").t_s <= number(&event["t_s"]));
    }
    let unknown = format!("{mission}/record?format=csv&kinds=planned,nonsense");
    let answer = service.get(&unknown).await;
    answer.must_be(422);
    answer.must_say("\"kinds\"");
    answer.must_say("clock_set");
}

/// The log has four plans a page; reading gives their whole JSON.
#[tokio::test(start_paused = true)]
async fn a_plan_takes_less_than_a_kilobyte_of_the_disk() {
    let service = Service::start().await;
    let mission = service.create(&simulated("paper-intermittent")).await;
    service.order(&mission, "step", json!({ "ticks": 30 })).await;
    let log = rusqlite::Connection::open(service.data.path().join(FILE_NAME)).expect("opens");
    let bytes = |query: &str| log.query_row(query, [], |row| row.get::<_, i64>(0)).expect("reads");
    let plan = bytes("SELECT CAST(avg(length(body)) AS INTEGER) FROM events WHERE kind = 'planned'");
    let checkpoint = bytes("SELECT length(body) FROM snapshots");
    assert!(plan < 1_000 && checkpoint < 10_000, "{plan}, {checkpoint}");
    let read = format!("{mission}/record?format=events_ndjson&kinds=planned");
    let read = service.get(&read).await.text;
    assert!(read.lines().count() == 30 && 30 * 2_000 < read.len());
}

#[tokio::test(start_paused = true)]
async fn a_scene_has_the_contents_of_a_map_and_the_controller_s_task() {
    let service = Service::start().await;
    let mut new = simulated("crowded");
    new["simulated"]["controller"] = json!("saturated_los");
    let mission = service.create(&new).await;
    let scene = service.ask(&format!("{mission}/scene")).await;
    // Like `pilotfish compare`, whose scores are of a record of the same scenario.
    let scenario = Scenario::named("crowded").expect("exists");
    let flown = mission::Mission::new(&scenario, "", 1).expect("starts");
    let expected = json!(["saturated_los", 1920.0, flown.record().settled_after]);
    assert_eq!(json!([scene["controller"], scene["duration_s"], scene["settled_after_s"]]), expected);
    assert_eq!(service.ask("/v1/missions").await["missions"][0]["controller"], scene["controller"]);
    let n_paths = scene["paths"].as_object().map(serde_json::Map::len);
    let n_discs = scene["keep_outs"].as_array().map(Vec::len);
    assert_eq!((n_discs, n_paths), (Some(1), Some(2)));
    let information = scene["information"].as_str().unwrap_or_default();
    assert!(scene["range_max_m"].is_number() && information.contains("current"));

    let mut new = live();
    new["live"]["auvs"][0]["path"] =
        json!({ "segments": [{ "kind": "line", "from": [0, 0], "to": [100, 0] }], "speed_mps": 0.3 });
    new["live"]["area"] = json!([[-50, -50], [-50, 50], [50, 50], [50, -50]]);
    let mission = service.create(&new).await;
    let scene = service.ask(&format!("{mission}/scene")).await;
    let path = scene["paths"]["auv-1"].as_array().expect("is known");
    assert_eq!(json!([path[0], path.last()]), json!([[0.0, 0.0], [100.0, 0.0]]));
    let n_corners = scene["area"].as_array().map(Vec::len);
    assert_eq!((scene["clock_rate"].as_f64(), n_corners), (Some(10.0), Some(4)));
    assert!(scene["information"].is_null() && scene["settled_after_s"].is_null());
    service.get("/v1/missions/m-nowhere/scene").await.must_be(404);

    let everything = json!({ "role": "admin", "caller": null, "protected": false });
    assert_eq!(service.ask("/v1/access").await, everything);
}

#[tokio::test(start_paused = true)]
async fn a_whole_scenario_may_be_sent_and_its_errors_are_named() {
    let service = Service::start().await;
    let mission = service.create(&short_scenario()).await;
    service.order(&mission, "run", json!({})).await;
    assert_eq!(service.until(&mission, "finished").await["t_s"], 59.0);
    let create = async |body: Value| service.post("/v1/missions", &body).await;
    let table = r#"
        /simulated/scenario  "nowhere"                  invalid  ~paper-tracking
        .                    {"schema_version":"1.0"}   one_of   ~`live` or `simulated`
    "#;
    assert_refused(&simulated("calm"), table, &create).await;
    let table = r#"/simulated/scenario_file  "title = 1"  invalid  ~scenario_file:1"#;
    assert_refused(&short_scenario(), table, &create).await;
    let mut of_one = live();
    of_one["live"]["goal"]["auvs"] = json!(["auv-2"]);
    let long = "x".repeat(201);
    let table = format!(
        r#"
        /schema_version   "9"       unsupported      ~1.0
        /title            "{long}"  too_long         ~200
        /live/period_s    0.1       out_of_range     ~0.5
        /live/clock_rate  100.0     out_of_range     ~60
        /live/auvs/0/id   ""        length
        /live/auvs/0/id   "asc"     reserved         ~surface craft
        /live/goal/auvs   ["x"]     unknown_vehicle  /live/goal/auvs/0
    "#
    );
    assert_refused(&of_one, &table, &create).await;
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
    let named = json!([made["title"], made["metadata"]["boat"]]);
    assert_eq!(named, json!(["two AUVs", 7]));
    service.order(&mission, "run", json!({})).await;
    let reference = format!("{mission}/reference");
    let unknown = service.get(&reference).await;
    unknown.must_refuse(409, "no_plan_yet");
    unknown.must_say("asc, auv-1, auv-2");

    let now = service.mission_now(&made);
    let accepted = service.order(&mission, "reports", heard(now)).await;
    let first = service.reference_after(&mission, &accepted["sequence"]).await;
    assert_eq!(json!([first["outcome"], first["method"]]), json!(["ok", "mpc"]));
    let heard_s = json!({ "asc": now, "auv-1": now - 4.0, "auv-2": now - 2.0 });
    assert_eq!(first["heard_s"], heard_s);
    // Periods of 1 s on a clock of tenfold speed, as exactly as a float holds Unix time.
    let second = service.reference_after(&mission, &first["sequence"]).await;
    let apart = number(&second["t_s"]) - number(&first["t_s"]);
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
    let listed = async || service.ask("/v1/missions").await["missions"][0]["plan"].clone();
    let before = listed().await;
    let periods = json!([before["period_s"], before["waits_for"]]);
    assert_eq!(periods, json!([1.0, ["asc"]]));
    service.clock.sleep(Duration::from_millis(500)).await;
    let aged = number(&listed().await["age_s"]) - number(&before["age_s"]);
    assert!((aged - 5.0).abs() < UNIX_RESOLUTION_S, "{aged}");
    let carried = number(&silent["t_s"]) - now;
    assert!((carried - 10.0).abs() < UNIX_RESOLUTION_S, "{carried}");
    assert_eq!(silent["heard_s"]["auv-1"], now - 1.0);

    assert_eq!(silent["missed"], 0);
    assert_eq!(service.n_replayed(&mission), 10);
}

#[tokio::test(start_paused = true)]
async fn a_client_that_waits_for_a_plan_is_answered_when_the_service_stops() {
    let service = Service::start().await;
    let mission = service.create(&live()).await;
    service.order(&mission, "run", json!({})).await;
    // Without reports no plan comes.
    let reference = format!("{mission}/reference?wait_s=60");
    let waits = service.get(&reference);
    let stops = async {
        service.clock.sleep(Duration::from_secs(1)).await;
        service.missions.stop().await;
    };
    let asked = service.clock.now();
    let (answer, ()) = tokio::join!(waits, stops);
    answer.must_be(409);
    assert!(service.clock.since(asked) < Duration::from_secs(2));
}

#[tokio::test(start_paused = true)]
async fn a_restart_keeps_all_knowledge_and_plans_as_before() {
    let mut service = Service::start().await;
    let mission = service.create(&live()).await;
    let reference = format!("{mission}/reference");
    service.order(&mission, "run", json!({})).await;
    for _ in 0..3 {
        let now = service.now(&mission).await;
        service.hear(&mission).await;
        service.ask(&format!("{reference}?wait_s=5")).await;
        // Heard after the last snapshot.
        let more = json!({ "auvs": { "auv-2": [fix(now - 1.0, 11.0, 20.0)] } });
        let heard = service.order(&mission, "reports", more).await;
        service = service.restart().await;
        // The previous plan is there until the next, which is made without a request.
        assert_eq!(service.ask(&reference).await["plan"]["outcome"], "ok");
        let planned = service.reference_after(&mission, &heard["sequence"]).await;
        assert_eq!(planned["heard_s"]["auv-2"], now - 1.0);
    }
    let last = service.ask(&reference).await;
    for _ in 0..2 {
        let finished = service.order(&mission, "finish", json!({})).await;
        assert_eq!(finished["status"], "finished");
    }
    // The last plan is there; a client does not wait for the next, which never comes.
    let service = service.restart().await;
    let asked = service.clock.now();
    let kept = service.ask(&format!("{reference}?wait_s=60")).await;
    assert_eq!(service.clock.now(), asked);
    assert!(last["sequence"].as_u64() <= kept["sequence"].as_u64());
    let state = json!([kept["status"], kept["plan"]["schema_version"]]);
    assert_eq!(state, json!(["finished", "1.0"]));
    assert!(3 < service.n_replayed(&mission));
    let events = service.events(&mission).await;
    let sequences = events.iter().filter_map(|event| event["sequence"].as_u64());
    assert!(sequences.eq(1..=events.len() as u64), "{events:?}");
    assert_eq!(events.last().expect("is there")["kind"], "finished");
}

#[tokio::test(start_paused = true)]
async fn a_repeated_request_with_its_key_is_carried_out_once() {
    let service = Service::start().await;
    let made = service.post_keyed("/v1/missions", &live(), "make").await;
    let again = service.post_keyed("/v1/missions", &live(), "make").await;
    assert_eq!(again.expected(201), made.expected(201));
    let other = simulated("paper-tracking");
    let other = service.post_keyed("/v1/missions", &other, "make").await;
    assert_eq!(other.problem()["code"], "idempotency_key_taken");

    let mission = made.header("location").to_owned();
    let (reports, finish) = (format!("{mission}/reports"), format!("{mission}/finish"));
    let body = heard(service.now(&mission).await);
    let to_auv_1 = json!({ "goal": { "kind": "track", "auv": "auv-1" } });
    let report = async |service: &Service, key: &str| service.post_keyed(&reports, &body, key).await;
    let first = report(&service, "first").await;
    assert_eq!(first.json(), json!({ "sequence": 2 }));
    report(&service, "second").await;
    let changed = service.patch_keyed(&mission, &to_auv_1, "to 1").await;
    assert_eq!(changed.json()["sequence"], 4);
    service.post_keyed(&finish, &json!({}), "end").await;
    let service = service.restart().await;
    // A client that lost the answer gets it, although the mission is over.
    assert_eq!(report(&service, "first").await.json(), first.json());
    let again = service.patch_keyed(&mission, &to_auv_1, "to 1").await;
    assert_eq!(again.expected(200), changed.json());
    let taken = service.patch_keyed(&mission, &json!({ "area": null }), "to 1").await;
    assert_eq!(taken.problem()["code"], "idempotency_key_taken");
    let ended = service.post_keyed(&finish, &json!({}), "end").await;
    assert_eq!(ended.json()["status"], "finished");
    report(&service, "third").await.must_refuse(409, "conflict");
    assert_eq!(service.ask(&mission).await["sequence"], 5);
}

#[tokio::test(start_paused = true)]
async fn every_call_names_a_wrong_parameter() {
    let service = Service::start().await;
    let mission = service.create(&live()).await;
    let assert_names = async |request: Request<Body>, name: &str, code: &str| {
        let path = request.uri().to_string();
        let refused = service.send(request).await;
        refused.must_be(422);
        let document = refused.problem();
        let error = &document["errors"][0];
        let found = json!([error["parameter"], error["code"], error["pointer"]]);
        assert_eq!(found, json!([name, code, ""]), "{path}: {document}");
        let detail = document["detail"].as_str().expect("a text");
        assert!(detail.starts_with(&format!("the parameter {name}: ")), "{detail}");
    };
    let table = "
        /v1/missions?after=-1            after   query
        /v1/missions?limit=ten           limit   query
        /v1/missions?after=0&limit=0     limit   out_of_range
        /v1/missions?limit=1&limit=2     limit   duplicate_field
        /v1/missions?page=1              page    query
        MISSION/reference?wait_s=soon    wait_s  query
        MISSION/reference?wait_s=61      wait_s  out_of_range
        MISSION/reference?after=x        after   query
        MISSION/events?after=1.5         after   query
        MISSION/record?format=xlsx       format  query
        MISSION/record                   format  missing
    ";
    for row in table.trim().lines() {
        let cells: Vec<_> = row.split_whitespace().collect();
        let path = cells[0].replace("MISSION", &mission);
        assert_names(get(&path), cells[1], cells[2]).await;
    }
    let events = with(get(&format!("{mission}/events")), "last-event-id", "last");
    assert_names(events, "Last-Event-ID", "last_event_id").await;
    let mut keyed: Vec<_> =
        ["run", "pause", "finish", "step"].map(|order| (format!("{mission}/{order}"), json!({}), "é")).into();
    keyed.push(("/v1/missions".to_owned(), live(), ""));
    keyed.push((format!("{mission}/reports"), heard(service.clock.unix_s()), ""));
    for (path, body, key) in keyed {
        let request = with(post(&path, body.to_string()), "idempotency-key", key);
        assert_names(request, "Idempotency-Key", "idempotency_key").await;
    }
}

#[tokio::test(start_paused = true)]
async fn a_command_of_another_kind_of_mission_is_a_conflict() {
    let service = Service::start().await;
    let real = service.create(&live()).await;
    let unreal = service.create(&simulated("paper-tracking")).await;
    for (path, body) in [
        (format!("{real}/step"), json!({})),
        (format!("{real}/run"), json!({ "speed_factor": 2.0 })),
        (format!("{unreal}/reports"), heard(service.clock.unix_s())),
    ] {
        service.post(&path, &body).await.must_be(409);
    }
    service.get(&format!("{unreal}/reference")).await.must_be(409);
    let slowly = json!({ "speed_factor": 0.5 });
    service.order(&unreal, "run", slowly).await;
    let refused = service.post(&format!("{unreal}/step"), &json!({})).await;
    refused.must_say("pause it first");
    for (order, body) in [("run", json!({ "speed_factor": 0.0 })), ("step", json!({ "ticks": 0 }))] {
        let refused = service.post(&format!("{unreal}/{order}"), &body).await;
        assert_eq!(refused.faults()[0].1, "out_of_range");
    }
    for unknown in ["unknown", "%ff", "deleted%201", "a%2Fb"] {
        let unknown = service.get(&format!("/v1/missions/{unknown}")).await;
        unknown.must_refuse(404, "no_mission");
    }
}

/// All missions, read in pages of at most `limit` missions and `bytes_max` bytes, and the number of
/// pages.
async fn pages(service: &Service, limit: u32, bytes_max: usize) -> (Vec<String>, usize) {
    let (mut after, mut paths) = (json!(0), vec![]);
    for n in 1.. {
        let page = service.get(&format!("/v1/missions?after={after}&limit={limit}")).await;
        assert!(page.text.len() < bytes_max, "{}", page.text.len());
        let page = page.json();
        let missions = page["missions"].as_array().expect("is a list");
        let ids = missions.iter().filter_map(|mission| mission["id"].as_str());
        paths.extend(ids.map(|id| format!("/v1/missions/{id}")));
        after = page["next"].clone();
        if after.is_null() {
            return (paths, n);
        }
    }
    unreachable!("there is a last page")
}

#[tokio::test(start_paused = true)]
async fn missions_are_listed_in_order_page_by_page_and_a_deleted_one_is_gone() {
    let service = Service::start().await;
    let mut made = vec![];
    for _ in 0..5 {
        made.push(service.create(&simulated("paper-tracking")).await);
    }
    assert_eq!(pages(&service, 2, usize::MAX).await, (made.clone(), 3));
    service.delete(&made[2]).await.must_be(204);
    service.get(&made[2]).await.must_be(404);
    service.delete(&made[2]).await.must_be(404);
    made.remove(2);
    assert_eq!(pages(&service, 100, usize::MAX).await, (made, 1));
    // Pages of long missions are short.
    let mut long = simulated("paper-tracking");
    long["metadata"] = json!({ "text": "x".repeat(4_000) });
    for _ in 0..100 {
        service.create(&long).await;
    }
    let (listed, n_pages) = pages(&service, 1000, 100_000).await;
    assert_eq!(listed.len(), 104);
    assert!(4 < n_pages, "{n_pages}");
}

#[tokio::test(start_paused = true)]
async fn a_mission_deleted_during_reads_is_gone_and_not_damaged() {
    let service = Arc::new(Service::start().await);
    for _ in 0..4 {
        let mission = service.running().await;
        for _ in 0..40 {
            service.hear(&mission).await;
        }
        let (answered, mut answers) = tokio::sync::mpsc::unbounded_channel();
        let calls = ["reference", "reference?wait_s=1", "record?format=csv", "events?after=0"];
        let readers = calls.map(|call| {
            let (service, answered) = (Arc::clone(&service), answered.clone());
            let path = format!("{mission}/{call}");
            tokio::spawn(async move {
                loop {
                    let answer = service.router.clone().oneshot(get(&path)).await;
                    let answer = answer.expect("answers");
                    let status = answer.status().as_u16();
                    // A stream or a record may end early: it is not whole.
                    let mut pieces = answer.into_body().into_data_stream();
                    while let Some(Ok(_)) = pieces.next().await {}
                    // The test may have seen enough.
                    let _ = answered.send(());
                    tokio::task::yield_now().await;
                    match status {
                        200 | 409 => {}
                        404 => return,
                        other => panic!("{path}: {other}"),
                    }
                }
            })
        });
        for _ in 0..40 {
            answers.recv().await.expect("goes on");
        }
        service.delete(&mission).await.must_be(204);
        for reader in readers {
            reader.await.expect("sees no damage");
        }
    }
    service.get("/readyz").await.must_be(200);
}

#[tokio::test(start_paused = true)]
async fn an_overloaded_mission_sends_a_retry_time_and_delays_no_other() {
    let service = Service::start().await;
    let flooded = service.create(&live()).await;
    let neighbour = service.create(&live()).await;
    let (flood, calm) = (format!("{flooded}/reports"), format!("{neighbour}/reports"));
    let body = heard(service.now(&neighbour).await);
    let flood = futures_util::future::join_all((0..200).map(|_| service.post(&flood, &body)));
    let (answers, beside) = tokio::join!(flood, service.post(&calm, &body));
    beside.must_be(200);
    let (accepted, refused): (Vec<_>, Vec<_>) = answers.iter().partition(|answer| answer.status == 200);
    assert!(!refused.is_empty() && 32 <= accepted.len(), "{}", accepted.len());
    for answer in refused {
        assert_eq!(answer.problem()["code"], "mission_behind");
        assert_eq!(answer.header("retry-after"), "1");
    }
    // Refused requests are not stored, acknowledged ones are.
    assert_eq!(service.ask(&flooded).await["sequence"], accepted.len() + 1);
}

#[tokio::test(start_paused = true)]
async fn a_service_without_its_data_directory_acknowledges_nothing_and_is_not_ready() {
    let service = Service::start().await;
    let (here, away) = (service.data.path(), service.data.path().with_extension("away"));
    fs::rename(here, &away).expect("is there");
    for answer in [service.post("/v1/missions", &live()).await, service.get("/readyz").await] {
        answer.must_be(503);
        answer.must_say("deleted or replaced");
    }
    fs::rename(&away, here).expect("is there");
    let none = tests::client::send(simulated_machine(), get("/v1/missions")).await;
    none.must_be(503);
    none.must_say("--data");
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
        let fast = json!({ "speed_factor": 100.0 });
        let running = service.order(&mission, "run", fast).await;
        let seen = json!([running["status"], running["speed_factor"]]);
        assert_eq!(seen, json!(["running", 100.0]));
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
        let mut guide = MpcGuide::new(Parameters::default());
        let flown = mission::run(&scenario, &mut guide, 1, &mut |_| {}).expect("flies");
        service.assert_is(&mission, &flown).await;
        assert_eq!(service.n_replayed(&mission), 1920);
    }

    #[tokio::test(start_paused = true)]
    async fn events_and_record_of_a_simulated_mission_have_the_simulator_s_vessels() {
        let service = Service::start().await;
        let mission = service.create(&simulated("traffic-anchored")).await;
        service.order(&mission, "step", json!({ "ticks": 20 })).await;
        let scenario = Scenario::named("traffic-anchored").expect("exists");
        let mut guide = MpcGuide::new(Parameters::default());
        let mut flown = mission::run(&scenario.lasting(150.0), &mut guide, 1, &mut |_| {}).expect("flies");
        flown.rows.truncate(20);
        assert!(1 < flown.vessel_ids.len());
        service.assert_is(&mission, &flown).await;
        let rows = service.record(&mission, "ndjson").await;
        let rows: Vec<_> = rows.iter().filter(|row| row["kind"] == "vessel").collect();
        assert_eq!(rows.len(), 20 * flown.vessel_ids.len());
        for (id, vessel) in flown.vessel_ids.iter().zip(&flown.rows[19].vessels) {
            let last = rows.iter().rfind(|row| row["vehicle"] == **id).expect("is there");
            let found = ["t_s", "north_m", "east_m", "course_rad", "speed_mps", "length_m"]
                .map(|member| number(&last[member]));
            let [north, east] = vessel.position.into();
            assert_eq!(found, [flown.rows[19].time, north, east, vessel.course, vessel.speed, vessel.length]);
        }
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
            let tuning = LosTuning { law, gains: parameters.los, integral_gain: parameters.integral_gain };
            // Slightly longer than the mission's plans.
            let scenario = Scenario::named("paper-intermittent").expect("exists");
            let (scenario, mut guide) = (scenario.lasting(300.0), LosGuide::tuned(tuning));
            let mut flown = mission::run(&scenario, &mut guide, 1, &mut |_| {}).expect("flies");
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
