//! A live mission whose vehicles report latitude and longitude.

use std::time::Duration;

use serde_json::{Value, json};
use tests::client::fault;

use super::{Service, live, number};

/// Metres of a degree of latitude at 38.41° (WGS 84).
const DEGREE_M: f64 = 111_005.0;

/// All vehicles `north_deg` north of (38.41, −9.12).
fn heard(now: f64, north_deg: f64) -> Value {
    let fix = |east_deg: f64| json!([{ "t_s": now, "lat_deg": 38.41 + north_deg, "lon_deg": -9.12 + east_deg, "sigma_m": 1.0 }]);
    let state = json!({ "lat_deg": 38.41 + north_deg, "lon_deg": -9.12, "heading_rad": 0.0, "speed_mps": 0.2,
        "sway_mps": 0.0, "yaw_rate_radps": 0.0 });
    json!({ "auvs": { "auv-1": fix(0.0001), "auv-2": fix(-0.0001) }, "asc": [{ "t_s": now, "state": state }] })
}

fn is_near(value: &Value, expected: f64, tolerance: f64) {
    let value = number(value);
    assert!((value - expected).abs() < tolerance, "{value} is not {expected}");
}

#[tokio::test(start_paused = true)]
async fn the_first_fix_becomes_the_origin_and_everything_has_both_positions() {
    let service = Service::start().await;
    let mission = service.create(&live()).await;
    assert_eq!(service.ask(&mission).await["origin"], Value::Null);
    service.order(&mission, "run", json!({})).await;

    let reports = format!("{mission}/reports");
    // A state of steering has no position.
    let now = service.now(&mission).await;
    service.order(&mission, "reports", json!({ "steering": [{ "t_s": now, "state": "waiting" }] })).await;
    let first = heard(service.now(&mission).await, 0.0);
    let accepted = service.post_keyed(&reports, &first, "first").await.json();
    // The craft's is the first in the post.
    let origin = json!({ "lat_deg": 38.41, "lon_deg": -9.12 });
    assert_eq!(accepted["origin"], origin, "{accepted}");
    assert_eq!(service.ask(&mission).await["origin"], origin);
    // Sent again, with a known origin: the same answer.
    let again = service.post_keyed(&reports, &first, "first").await;
    assert_eq!(again.expected(200), accepted);

    service.clock.sleep(Duration::from_millis(100)).await;
    let now = service.now(&mission).await;
    let accepted = service.order(&mission, "reports", heard(now, 0.001)).await;
    assert_eq!(accepted["origin"], Value::Null);
    let plan = &service.reference_after(&mission, &accepted["sequence"]).await["plan"];
    assert_eq!(plan["origin"], origin);
    let here = &plan["trajectory"][0];
    is_near(&here["north_m"], 0.001 * DEGREE_M, 2.0);
    is_near(&here["east_m"], 0.0, 2.0);
    is_near(&here["lat_deg"], 38.411, 2e-5);
    is_near(&here["lon_deg"], -9.12, 2e-5);

    let heard = service.record(&mission, "events_ndjson&kinds=reported").await;
    assert_eq!(heard[1]["heard"]["origin"], origin);
    let fix = &heard[2]["heard"]["auvs"]["auv-1"][0];
    is_near(&fix["north_m"], 0.001 * DEGREE_M, 0.01);
    is_near(&fix["lat_deg"], 38.411, 1e-9);
    let mut fixes = service.record(&mission, "ndjson").await;
    fixes.retain(|row| row["kind"] == "fix");
    assert_eq!(fixes.len(), 4);
    let has_both = |row: &Value| row["lat_deg"].is_number() && row["north_m"].is_number();
    assert!(fixes.iter().all(has_both), "{fixes:?}");
    let map = service.get(&format!("{mission}/record?format=geojson")).await;
    map.must_be(200);

    // The same from a service that was started again.
    let service = service.restart().await;
    assert_eq!(service.ask(&mission).await["origin"], origin);
    service.order(&mission, "finish", json!({})).await;
    assert!(0 < service.n_replayed(&mission));
}

#[tokio::test(start_paused = true)]
async fn metres_in_a_mission_with_an_origin_get_degrees() {
    let service = Service::start().await;
    let mut body = live();
    body["live"]["origin"] = json!({ "lat_deg": 38.41, "lon_deg": -9.12 });
    body["live"]["keep_outs"] = json!([{ "lat_deg": 38.411, "lon_deg": -9.12, "radius_m": 5.0 }]);
    let mission = service.create(&body).await;
    let seen = service.ask(&mission).await;
    let disc = &seen["setting"]["keep_outs"][0];
    is_near(&disc["north_m"], 0.001 * DEGREE_M, 0.01);
    let fix = super::fix(service.mission_now(&seen), 111.005, 0.0);
    let body = json!({ "auvs": { "auv-1": [fix] } });
    service.order(&mission, "reports", body).await;
    let events = service.events(&mission).await;
    is_near(&events[1]["heard"]["auvs"]["auv-1"][0]["lat_deg"], 38.411, 1e-7);
    assert_eq!(events[1]["heard"]["origin"], Value::Null);
    // Ranges and travel times of 43.5 m, from a place in metres or on Earth.
    let now = service.mission_now(&seen);
    let report = |measured: Value, from: Value| {
        let mut report = json!({ "t_s": now, "sigma_m": 1.0, "from": from });
        report.as_object_mut().expect("is one").extend(measured.as_object().expect("is one").clone());
        report
    };
    let ranges = [
        report(json!({ "range_m": 43.5 }), json!([111.005, 0.0])),
        report(json!({ "travel": { "time_s": 0.029 } }), json!({ "lat_deg": 38.411, "lon_deg": -9.12 })),
    ];
    service.order(&mission, "reports", json!({ "auvs": { "auv-1": ranges } })).await;
    let events = service.events(&mission).await;
    for range in events[2]["heard"]["auvs"]["auv-1"].as_array().expect("is a list") {
        is_near(&range["range_m"], 43.5, 1e-9);
        is_near(&range["from"][0], 111.005, 0.01);
    }
}

#[tokio::test(start_paused = true)]
async fn degrees_are_refused_beside_metres_without_an_origin() {
    let service = Service::start().await;
    let mut body = live();
    body["live"]["keep_outs"] = json!([{ "north_m": 30.0, "east_m": 0.0, "radius_m": 5.0 }]);
    let fenced = service.create(&body).await;
    let heard_in_metres = service.create(&live()).await;
    let now = service.now(&heard_in_metres).await;
    let fix = json!({ "auvs": { "auv-1": [super::fix(now, 1.0, 0.0)] } });
    service.order(&heard_in_metres, "reports", fix).await;
    for mission in [fenced, heard_in_metres] {
        let reports = format!("{mission}/reports");
        let refused = service.post(&reports, &heard(now, 0.0)).await;
        refused.must_be(422);
        assert_eq!(refused.faults()[0].1, "no_origin", "{}", refused.text);
    }
    body["live"]["keep_outs"] = json!([{ "lat_deg": 38.0, "lon_deg": 0.0, "radius_m": 5.0 }]);
    let refused = service.post("/v1/missions", &body).await;
    assert_eq!(refused.faults()[0].0, "/live/keep_outs/0/lat_deg");
}

/// Origin of a mission whose work is 0.3° further north: 33 km.
const FAR: [f64; 2] = [38.11, -9.12];

#[tokio::test(start_paused = true)]
async fn another_origin_moves_no_position_on_earth_and_ends_the_warning() {
    let service = Service::start().await;
    let mut body = live();
    body["live"]["origin"] = json!({ "lat_deg": FAR[0], "lon_deg": FAR[1] });
    body["live"]["keep_outs"] = json!([{ "lat_deg": 38.411, "lon_deg": -9.12, "radius_m": 5.0 }]);
    let mission = service.create(&body).await;
    service.order(&mission, "run", json!({})).await;
    let plan_after_reports = async |north_deg: f64| {
        let body = heard(service.now(&mission).await, north_deg);
        let accepted = service.order(&mission, "reports", body).await;
        let next = service.reference_after(&mission, &accepted["sequence"]).await;
        next["plan"].clone()
    };
    let has_warning = |plan: &Value| {
        let warnings = plan["warnings"].as_array().expect("a list");
        warnings.iter().any(|warning| warning["code"] == "origin_far")
    };
    let before = plan_after_reports(0.0).await;
    assert!(has_warning(&before), "{before}");
    is_near(&before["trajectory"][0]["north_m"], 0.3 * DEGREE_M, 30.0);
    let summary = service.ask(&mission).await["plan"]["warnings"].to_string();
    assert!(summary.contains("33 km from the origin"), "{summary}");

    let discs = json!({ "keep_outs": [{ "lat_deg": 38.411, "lon_deg": -9.12, "radius_m": 5.0 }] });
    let kept = service.patch_keyed(&mission, &discs, "discs").await.expected(200);
    let near = json!({ "lat_deg": 38.41, "lon_deg": -9.12 });
    let patch = async |origin: &Value| service.patch(&mission, &json!({ "origin": origin })).await;
    let refused = patch(&Value::Null).await;
    assert_eq!(refused.faults(), fault("/origin", "missing"));
    let refused = patch(&json!({ "lat_deg": 91.0, "lon_deg": 0.0 })).await;
    assert_eq!(refused.faults()[0].0, "/origin/lat_deg");
    let changed = patch(&near).await.expected(200);
    assert_eq!(changed["setting"]["origin"], Value::Null);
    let scene = service.ask(&format!("{mission}/scene")).await;
    for (origin, setting) in [(&changed["origin"], &changed["setting"]), (&scene["origin"], &scene)] {
        assert_eq!(*origin, near);
        is_near(&setting["keep_outs"][0]["north_m"], 0.001 * DEGREE_M, 0.01);
    }
    // Sent again, in other metres: the same answer.
    assert_eq!(service.patch_keyed(&mission, &discs, "discs").await.expected(200), kept);
    // It is set already.
    let again = patch(&near).await.json();
    assert_eq!(again["sequence"], changed["sequence"]);

    // Without new reports: everything stays at its place on Earth.
    let plan = service.reference_after(&mission, &changed["sequence"]).await["plan"].clone();
    assert!(!has_warning(&plan), "{plan}");
    assert_eq!(plan["origin"], near);
    let start = &plan["trajectory"][0];
    is_near(&start["north_m"], 0.0, 20.0);
    is_near(&start["lat_deg"], 38.41, 2e-4);
    for at in ["/targets/0/estimate", "/goal/trajectory/0"] {
        let degrees = |plan: &Value| number(&plan.pointer(at).expect("is there")["lat_deg"]);
        let apart = degrees(&before) - degrees(&plan);
        // The AUVs rest, except for the filter's drift.
        assert!(apart.abs() < 1e-4, "{at}: {apart}°");
    }
    plan_after_reports(0.0001).await;

    let mut states = service.record(&mission, "ndjson").await;
    states.retain(|row| row["kind"] == "asc_state");
    assert_eq!(states.len(), 2);
    for (state, north_deg) in states.iter().zip([0.0, 0.0001]) {
        is_near(&state["north_m"], north_deg * DEGREE_M, 0.01);
        is_near(&state["lat_deg"], 38.41 + north_deg, 1e-9);
    }
    let service = service.restart().await;
    assert_eq!(service.ask(&mission).await["origin"], near);
    service.order(&mission, "finish", json!({})).await;
    assert!(3 <= service.n_replayed(&mission));
}
