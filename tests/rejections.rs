//! Every way to be refused: a problem document, the right status, and the field at fault.

use std::{
    io::{Read, Write},
    net::TcpStream,
    time::Duration,
};

use axum::{
    body::Body,
    http::{HeaderValue, Method, Request, StatusCode},
};
use futures_util::StreamExt as _;
use planner::{
    plan::{Degraded, Plan, Workspace, plan_until},
    policy::Policy,
    snapshot::Snapshot,
    solve::SolverStatus,
    stop::Stop,
};
use serde_json::{Value, json};
use service::{Hosts, Settings, app, examples::EXAMPLES};
use tests::client::{Answer, example, get, post, send, send_to};
use tokio::net::TcpListener;

async fn planned(body: impl Into<Body>) -> Answer {
    send(Settings::default(), post("/v1/plan", body)).await
}

/// The faults found in the track example after `change`.
async fn faults_after(change: impl FnOnce(&mut Value)) -> Vec<(String, String)> {
    let mut body = example("track");
    change(&mut body);
    let answer = planned(body.to_string()).await;
    assert_eq!(answer.status, StatusCode::UNPROCESSABLE_ENTITY, "{}", answer.text);
    answer.faults()
}

/// The status of an answer to the track example after a change.
async fn status_after(change: impl FnOnce(&mut Value)) -> StatusCode {
    let mut body = example("track");
    change(&mut body);
    planned(body.to_string()).await.status
}

fn fault(pointer: &str, code: &str) -> Vec<(String, String)> {
    vec![(pointer.to_owned(), code.to_owned())]
}

#[tokio::test]
async fn what_is_not_json_is_refused_where_it_breaks() {
    for (body, pointer) in [
        ("", ""),
        ("{", ""),
        ("not json", ""),
        (r#"{"t_s":NaN}"#, "/t_s"),
        (r#"{"asc":{"north_m":1e999}}"#, "/asc/north_m"),
        (r#"{"auvs":[{"id":"a"#, "/auvs/0/id"),
    ] {
        let answer = planned(body).await;
        assert_eq!(answer.status, StatusCode::BAD_REQUEST, "{body}");
        assert_eq!(answer.faults(), fault(pointer, "syntax"), "{body}");
    }
    let answer = planned(format!("{} x", EXAMPLES[0].body)).await;
    assert_eq!(
        (answer.status, answer.faults()),
        (StatusCode::BAD_REQUEST, fault("", "syntax"))
    );
}

#[tokio::test]
async fn an_unknown_member_is_named() {
    let faults = faults_after(|body| body["auvs"][0]["fixes"] = json!([])).await;
    assert_eq!(faults, fault("/auvs/0/fixes", "unknown_field"));
    let faults = faults_after(|body| body["a/b~c"] = json!(1)).await;
    assert_eq!(faults, fault("/a~1b~0c", "unknown_field"));
}

#[tokio::test]
async fn a_missing_member_is_named() {
    let faults = faults_after(|body| {
        body["asc"]
            .as_object_mut()
            .expect("an object")
            .remove("speed_mps");
    })
    .await;
    assert_eq!(faults, fault("/asc/speed_mps", "missing"));
}

#[tokio::test]
async fn a_wrong_type_and_an_unknown_variant_are_named() {
    let faults = faults_after(|body| body["auvs"][0]["state"]["depth_m"] = json!("deep")).await;
    assert_eq!(faults, fault("/auvs/0/state/depth_m", "wrong_type"));
    let faults = faults_after(|body| body["goal"]["kind"] = json!("attend")).await;
    assert_eq!(faults, fault("/goal/kind", "unknown_variant"));
}

#[tokio::test]
async fn a_list_is_no_object_whatever_its_order() {
    let faults = faults_after(|body| body["current"] = json!([0.0, 0.1])).await;
    assert_eq!(faults, fault("/current", "wrong_type"));
    let faults = faults_after(|body| body["auvs"][0]["state"] = json!([18, 6, 9.5, 0.35, 0.193, 0, 0])).await;
    assert_eq!(faults, fault("/auvs/0/state", "wrong_type"));
}

#[tokio::test]
async fn a_name_of_another_type_is_a_wrong_type_and_not_bad_json() {
    for pointer in ["/goal/kind", "/forecast", "/fallback", "/hold"] {
        for wrong in [
            json!(null),
            json!(3),
            json!(true),
            json!([]),
            json!({}),
            json!({ "auto": null, "track": null }),
            json!({ "hold": null }),
            json!({ "stop": null }),
            json!({ "none": null }),
            json!({ "track": null }),
        ] {
            let faults = faults_after(|body| {
                let (parent, name) = pointer.rsplit_once('/').expect("has a slash");
                body.pointer_mut(parent).expect("is there")[name] = wrong.clone();
            })
            .await;
            let [(at, code)] = faults.as_slice() else {
                panic!("{pointer} {wrong}: {faults:?}")
            };
            assert!(at.starts_with(pointer), "{pointer} {wrong}: {at}");
            assert!(
                code == "wrong_type" || wrong.is_object() && code == "unknown_variant",
                "{pointer} {wrong}: {code}"
            );
        }
    }
}

#[tokio::test]
async fn nothing_hides_a_list_for_an_object_not_even_an_ignored_member() {
    let deep = format!("{}{}", "[".repeat(500), "]".repeat(500));
    for junk in ["1e400", deep.as_str()] {
        let mut body = example("track");
        body["current"] = json!([0.0, 0.1]);
        body["previous_plan"] = json!({ "trajectory": [], "ignored": "JUNK" });
        let answer = planned(body.to_string().replace("\"JUNK\"", junk)).await;
        assert_eq!(answer.status, StatusCode::BAD_REQUEST, "{}", answer.text);
        let faults = answer.faults();
        assert_eq!(faults[0].1, "syntax");
        assert!(faults[0].0.starts_with("/previous_plan/ignored"), "{faults:?}");
    }
}

#[tokio::test]
async fn a_member_that_stands_twice_is_named() {
    let body = EXAMPLES[0].body.trim_end();
    let twice = format!("{},\"t_s\":1}}", &body[..body.len() - 1]);
    let answer = planned(twice).await;
    assert_eq!(answer.status, StatusCode::UNPROCESSABLE_ENTITY);
    assert_eq!(answer.faults(), fault("/t_s", "duplicate_field"));
    let answer = planned(r#"{"asc":{"north_m":1,"north_m":2}}"#).await;
    assert_eq!(answer.faults(), fault("/asc/north_m", "duplicate_field"));
}

#[tokio::test]
async fn a_name_that_stands_twice_in_metadata_is_named_too_and_so_is_a_flood_of_values() {
    let body = example("track").to_string();
    let with = |metadata: &str| body.replacen('{', &format!("{{\"metadata\":{metadata},"), 1);
    let answer = planned(with(r#"{"a":[{"b":1,"c":2,"b":3}]}"#)).await;
    assert_eq!(answer.faults(), fault("/metadata/a/0/b", "duplicate_field"));
    let answer = planned(with(&format!("[{}0]", "0,".repeat(200_000)))).await;
    assert_eq!(answer.faults(), fault("", "too_many_values"));
}

#[tokio::test]
async fn a_control_character_in_a_name_is_refused() {
    let faults = faults_after(|body| {
        body["auvs"][0]["id"] = json!("auv\u{0}1");
        body["goal"]["auv"] = json!("auv\u{0}1");
    });
    assert_eq!(faults.await, fault("/auvs/0/id", "control_character"));
}

#[tokio::test]
async fn details_are_in_the_words_of_json_and_not_of_the_program() {
    let detail = async |body: String| {
        let problem = planned(body).await.problem();
        problem["errors"][0]["detail"].as_str().expect("text").to_owned()
    };
    let changed = |pointer: &str, value: Value| {
        let mut body = example("track");
        *body.pointer_mut(pointer).expect("is there") = value;
        body.to_string()
    };
    assert_eq!(detail("[]".into()).await, "must be an object, not a list");
    assert_eq!(detail("3".into()).await, "must be an object, not a number");
    assert_eq!(
        detail(changed("/asc/north_m", json!("far"))).await,
        "must be a number, not text"
    );
    assert_eq!(
        detail(changed("/auvs/0/id", json!(7))).await,
        "must be text, not a number"
    );
    assert_eq!(
        detail(changed("/auvs", json!({}))).await,
        "must be a list, not an object"
    );
    assert_eq!(
        detail(changed("/goal/kind", json!(null))).await,
        "must be text, not null"
    );
    assert_eq!(
        detail(changed("/goal/kind", json!("attend"))).await,
        "must be one of `track`, `intermittent`, `midpoint`, `weighted`, `range`"
    );
    assert_eq!(
        detail(changed("/auvs/0", json!({ "name": "a" }))).await,
        "there is no such member, only `id`, `state`, `reports`, `path`, `dive`"
    );
    assert_eq!(
        detail(changed("/auvs/0/id", json!("é".repeat(65)))).await,
        "must have 1 to 64 bytes"
    );
    assert_eq!(
        detail(changed("/auvs", json!([]))).await,
        "must have 1 to 16 items"
    );
    let marked = detail(format!("\u{feff}{}", EXAMPLES[0].body)).await;
    assert!(marked.contains("byte order mark"), "{marked}");
}

#[tokio::test]
async fn a_number_out_of_range_comes_back_with_its_limits() {
    let mut body = example("track");
    body["auvs"][0]["state"]["speed_mps"] = json!(-0.1);
    let answer = planned(body.to_string()).await;
    assert_eq!(answer.faults(), fault("/auvs/0/state/speed_mps", "out_of_range"));
    let error = &answer.problem()["errors"][0];
    assert_eq!(error["given"], -0.1);
    assert_eq!(error["limit"], json!({ "least": 0.0, "most": 10.0 }));
}

#[tokio::test]
async fn an_auv_has_a_state_or_reports_and_not_both() {
    let report = json!({ "t_s": 110.0, "north_m": 1, "east_m": 2, "sigma_m": 1.5 });
    let both = faults_after(|body| body["auvs"][0]["reports"] = json!([report])).await;
    assert_eq!(both, fault("/auvs/0/reports", "unexpected"));
    let neither = faults_after(|body| body["auvs"][0] = json!({ "id": "auv-1" })).await;
    assert_eq!(neither, fault("/auvs/0/state", "missing"));
}

/// The faults of the track example, which is of 120 s, where its vehicle is known by these reports.
async fn faults_of_reports(reports: Value) -> Vec<(String, String)> {
    faults_after(|body| body["auvs"][0] = json!({ "id": "auv-1", "reports": reports })).await
}

#[tokio::test]
async fn an_invalid_report_is_located() {
    for (member, value, code) in [
        ("t_s", json!(-2.1e11), "out_of_range"),
        ("t_s", json!(121.1), "out_of_range"),
        ("north_m", json!(2e6), "out_of_range"),
        ("sigma_m", json!(0.0), "out_of_range"),
        ("depth_m", json!(-11.0), "out_of_range"),
        ("course_rad", json!(45.0), "out_of_range"),
        ("speed_mps", json!(-0.1), "out_of_range"),
        ("turn_rate_radps", json!(1.1), "out_of_range"),
        ("course_rad", json!(null), "missing"),
        ("speed_mps", json!(null), "missing"),
        ("height_m", json!(0.0), "unknown_field"),
    ] {
        let good = json!({ "t_s": 120.9, "north_m": 1, "east_m": 2, "sigma_m": 1.5, "depth_m": 3, "course_rad": 0.1,
            "speed_mps": 0.2, "turn_rate_radps": 0 });
        let mut bad = good.clone();
        bad[member] = value.clone();
        let faults = faults_of_reports(json!([good, bad])).await;
        let expected = fault(&format!("/auvs/0/reports/1/{member}"), code);
        assert_eq!(faults, expected, "{member}: {value}");
    }
    let ahead = json!([{ "t_s": 180.0, "north_m": 1, "east_m": 2, "sigma_m": 1.5 }]);
    let mut body = example("track");
    body["auvs"] = json!([{ "id": "auv-1", "reports": ahead }]);
    let detail = planned(body.to_string()).await.problem()["detail"].to_string();
    assert!(
        detail.contains("is 60.0 s ahead of the request's `t_s`"),
        "{detail}"
    );
    let empty = faults_of_reports(json!([])).await;
    assert_eq!(empty, fault("/auvs/0/reports", "length"));
    let report = json!({ "t_s": 110.0, "north_m": 1, "east_m": 2, "sigma_m": 1.5 });
    let many = faults_of_reports(json!(vec![report; 65])).await;
    assert_eq!(many, fault("/auvs/0/reports", "length"));
}

#[tokio::test]
async fn an_invalid_covariance_is_refused_with_the_reason() {
    let mut body = example("track");
    for ((row, column), value, pointer, code) in [
        ((0, 0), 2e10, "/0/0", "out_of_range"),
        // Not the mirror image of what stands at (0, 3).
        ((3, 0), 0.1, "/3/0", "out_of_range"),
        ((2, 2), -1.0, "", "negative_variance"),
    ] {
        let mut rows = [[0.0; 4]; 4];
        (rows[0][0], rows[1][1]) = (2.25, 2.25);
        body["auvs"][0]["state"]["covariance"] = json!(rows);
        let answer = planned(body.to_string()).await;
        assert_eq!(answer.status, StatusCode::OK, "{}", answer.text);
        rows[row][column] = value;
        let faults = faults_after(|body| body["auvs"][0]["state"]["covariance"] = json!(rows)).await;
        let expected = fault(&format!("/auvs/0/state/covariance{pointer}"), code);
        assert_eq!(faults, expected);
    }
}

fn matrix(n_rows: usize, n_columns: usize) -> Value {
    json!(vec![vec![0.0; n_columns]; n_rows])
}

#[tokio::test]
async fn a_covariance_of_another_shape_is_refused_with_the_right_one() {
    let row = "a row of 4 numbers of a symmetric positive semidefinite 4×4 matrix";
    let whole = "a symmetric positive semidefinite 4×4 matrix, a list of 4 rows";
    for (given, at, code, detail) in [
        (
            matrix(3, 3),
            "/0",
            "length",
            format!("must have 4 items, not 3: {row}"),
        ),
        (
            matrix(4, 5),
            "/0",
            "length",
            format!("must have 4 items, not 5: {row}"),
        ),
        (
            matrix(2, 4),
            "",
            "length",
            format!("must have 4 items, not 2: {whole}"),
        ),
        (
            matrix(5, 4),
            "",
            "length",
            format!("must have 4 items, not 5: {whole}"),
        ),
        (
            json!(vec![0.0; 16]),
            "/0",
            "wrong_type",
            format!("must be {row}, not a number"),
        ),
        (
            json!("diagonal"),
            "",
            "wrong_type",
            format!("must be {whole}, not text"),
        ),
        (
            json!({}),
            "",
            "wrong_type",
            format!("must be {whole}, not an object"),
        ),
        (
            json!([[0, "0", 0, 0]]),
            "/0/1",
            "wrong_type",
            "must be a number, not text".to_owned(),
        ),
    ] {
        let mut body = example("track");
        body["auvs"][0]["state"]["covariance"] = given.clone();
        let answer = planned(body.to_string()).await;
        let pointer = format!("/auvs/0/state/covariance{at}");
        assert_eq!(answer.faults(), fault(&pointer, code), "{given}");
        assert_eq!(answer.problem()["errors"][0]["detail"], detail, "{given}");
    }
    let mut body = example("track");
    body["auvs"][0]["state"]["covariance"] = matrix(3, 3);
    let error = planned(body.to_string()).await.problem()["errors"][0].clone();
    assert_eq!(
        (&error["given"], &error["limit"]),
        (&json!(3), &json!({ "least": 4, "most": 4 }))
    );
}

/// The track example with a member of every kind.
fn with_everything() -> Value {
    let mut body = example("track");
    body["asc"]["ground_north_mps"] = json!(0.3);
    body["asc"]["ground_east_mps"] = json!(0.0);
    body["auvs"][0]["state"]["covariance"] = matrix(4, 4);
    let corners = json!({ "kind": "waypoints", "points": [[90, 0], [90, 20], [0, 20]], "fillet_m": 5 });
    body["auvs"][0]["path"] = json!({ "segments": [lane(), corners], "closed": false, "speed_mps": 0.2 });
    body["auvs"][0]["dive"] =
        json!({ "depth_min_m": 1, "depth_max_m": 23, "pitch_rad": 0.8, "descending": true });
    body["goal"]["offset"] = json!({ "frame": "ned", "north_m": 1, "east_m": 2 });
    body["goal"]["weights"] = json!({ "auv-1": 1.0 });
    body["goal"]["auvs"] = json!(["auv-1"]);
    body["current"] = json!({ "north_mps": 0, "east_mps": 0.1 });
    body["limits"] = json!({ "speed_max_mps": 1.5 });
    body["craft"] = json!({
        "preset": "medusa",
        "heading_loop": {
            "natural_frequency_radps": 1.6, "damping": 0.8, "delay_s": 0.1, "rate_max_radps": 0.3
        },
        "surge_loop": {
            "time_constant_s": 2.5, "delay_s": 0, "acceleration_max_mps2": 0.09, "deceleration_max_mps2": 0.09,
            "integrates": true, "integral_time_s": 8.7
        },
        "sway_per_yaw_rate_s": 0.9,
        "power": { "linear_w_per_mps": 0, "cubic_w_per_mps3": 27.5 },
        "speed_held": "through_water",
        "heading_held": "heading",
        "relative_uncertainty": 0.1
    });
    body["keep_outs"] = json!([{ "north_m": 0, "east_m": 0, "radius_m": 1 }]);
    body["area"] = json!([[-50, -50], [200, -50], [200, 150]]);
    body["acoustics"] = json!({ "range_max_m": 100 });
    body["metadata"] = json!({ "mission": "any" });
    body["previous_plan"] = json!({
        "trajectory": [{ "t_s": 119, "north_m": 0, "east_m": 0, "speed_mps": 0.3, "heading_rad": 0 }],
        "goal_course_rad": 0, "current": { "north_mps": 0, "east_mps": 0 },
        "reference": { "speed_mps": 0.3 },
        "craft_estimate": { "asked_speed_mps": 0.3, "asked_heading_rad": 0, "memory": [0, 0.5] }
    });
    body
}

/// Every place in a document, as pointers; the root is the empty one.
fn places(value: &Value, at: &str) -> Vec<String> {
    let below: Vec<_> = match value {
        Value::Array(items) => items
            .iter()
            .enumerate()
            .map(|(i, item)| (i.to_string(), item))
            .collect(),
        Value::Object(members) => members.iter().map(|(name, item)| (name.clone(), item)).collect(),
        _ => vec![],
    };
    let below = below
        .into_iter()
        .flat_map(|(token, item)| places(item, &format!("{at}/{token}")));
    std::iter::once(at.to_owned()).chain(below).collect()
}

#[tokio::test]
async fn no_error_demands_what_was_sent() {
    let whole = with_everything();
    let service = app(Settings::default());
    let mut n_wrong_types = 0;
    for place in places(&whole, "") {
        for wrong in [
            json!(true),
            json!("text"),
            json!(-7.5),
            json!([]),
            json!([1, 2, 3]),
            json!(vec![1; 20]),
            json!({}),
            json!(null),
        ] {
            let mut body = whole.clone();
            *body.pointer_mut(&place).expect("was just listed") = wrong.clone();
            let answer = send_to(service.clone(), post("/v1/plan", body.to_string())).await;
            assert_eq!(
                answer.status,
                StatusCode::UNPROCESSABLE_ENTITY,
                "{place}: {}",
                answer.text
            );
            let error = answer.problem()["errors"][0].clone();
            if error["code"] != "wrong_type" {
                continue;
            }
            n_wrong_types += 1;
            let detail = error["detail"].as_str().expect("text");
            let wanted = detail.strip_prefix("must be ").expect("says what is wanted");
            let (wanted, given) = wanted.rsplit_once(", not ").expect("says what is given");
            assert!(
                given != "this" && !wanted.starts_with(given),
                "{place}: {wrong}: {detail}"
            );
            // What stands there in a whole request is of the type that is asked for.
            let pointer = error["pointer"].as_str().expect("text");
            let right = match whole.pointer(pointer) {
                Some(Value::Bool(_)) => "true or false",
                Some(Value::Number(_)) => "a number",
                Some(Value::String(_)) => "text",
                Some(Value::Object(_)) => "an object",
                _ => continue,
            };
            assert_eq!(wanted, right, "{place}: {wrong}");
        }
    }
    // Of more than a hundred places most have six types that they are not of.
    assert!(400 < n_wrong_types, "{n_wrong_types}");
}

#[tokio::test]
async fn an_angle_in_degrees_is_refused_and_not_wrapped() {
    for pointer in ["/asc/heading_rad", "/auvs/0/state/course_rad"] {
        let change = |body: &mut Value| *body.pointer_mut(pointer).expect("is there") = json!(45.0);
        assert_eq!(faults_after(change).await, fault(pointer, "out_of_range"));
    }
    let previous = json!({ "trajectory": [
        { "t_s": 119.0, "north_m": 0, "east_m": 0, "speed_mps": 0.3, "heading_rad": 90.0 }
    ], "goal_course_rad": 90.0 });
    let faults = faults_after(|body| body["previous_plan"] = previous).await;
    let pointers: Vec<_> = faults.iter().map(|(pointer, _)| pointer.as_str()).collect();
    assert_eq!(
        pointers,
        [
            "/previous_plan/goal_course_rad",
            "/previous_plan/trajectory/0/heading_rad"
        ]
    );
}

#[tokio::test]
async fn what_is_said_of_a_craft_is_checked_number_by_number() {
    for (pointer, least, most) in [
        ("heading_loop/time_constant_s", 0.0, 60.0),
        ("heading_loop/delay_s", 0.0, 10.0),
        ("heading_loop/rate_max_radps", 0.001, 3.0),
        ("surge_loop/time_constant_s", 0.0, 60.0),
        ("surge_loop/delay_s", 0.0, 10.0),
        ("surge_loop/acceleration_max_mps2", 0.001, 10.0),
        ("surge_loop/deceleration_max_mps2", 0.001, 10.0),
        ("surge_loop/integral_time_s", 0.5, 600.0),
        ("sway_per_yaw_rate_s", -5.0, 20.0),
        ("power/linear_w_per_mps", 0.0, 1.0e6),
        ("power/cubic_w_per_mps3", 0.0, 1.0e6),
        ("relative_uncertainty", 0.0, 2.0),
    ] {
        let said = |value: f64| {
            pointer
                .rsplit('/')
                .fold(json!(value), |inner, name| json!({ name: inner }))
        };
        for value in [least, most] {
            let status = status_after(|body| body["craft"] = said(value)).await;
            assert_eq!(status, StatusCode::OK, "{pointer}: {value}");
        }
        for value in [least - 1e-6, most + 1e-6] {
            let expected = fault(&format!("/craft/{pointer}"), "out_of_range");
            let faults = faults_after(|body| body["craft"] = said(value)).await;
            assert_eq!(faults, expected, "{value}");
        }
    }
    let stranger = faults_after(|body| body["craft"] = json!({ "preset": "titanic" })).await;
    assert_eq!(stranger, fault("/craft/preset", "unknown_preset"));
    let half = json!({ "heading_loop": { "damping": 0.8 } });
    let missing = fault("/craft/heading_loop/natural_frequency_radps", "missing");
    assert_eq!(faults_after(|body| body["craft"] = half).await, missing);
}

/// What an earlier answer asked for and what it commanded the craft are two references: neither may be anything.
#[tokio::test]
async fn both_references_of_an_earlier_answer_are_checked() {
    let previous = |asked: (f64, f64), commanded: (f64, f64)| {
        json!({
            "trajectory": [{ "t_s": 119, "north_m": 0, "east_m": 0, "speed_mps": 0.3, "heading_rad": 0 }],
            "reference": { "speed_mps": commanded.0, "heading_rad": commanded.1 },
            "craft_estimate": { "asked_speed_mps": asked.0, "asked_heading_rad": asked.1, "memory": [0, 0.5] }
        })
    };
    // A memory that is none is no fault.
    let whole = previous((0.3, 1.0), (0.4, 1.1));
    let status = status_after(|body| body["previous_plan"] = whole).await;
    assert_eq!(status, StatusCode::OK);
    for (asked, commanded, pointer) in [
        ((41.0, 1.0), (0.4, 1.1), "craft_estimate/asked_speed_mps"),
        ((0.3, 45.0), (0.4, 1.1), "craft_estimate/asked_heading_rad"),
        ((0.3, 1.0), (1.0e300, 1.1), "reference/speed_mps"),
        ((0.3, 1.0), (-0.1, 1.1), "reference/speed_mps"),
        ((0.3, 1.0), (0.4, 45.0), "reference/heading_rad"),
    ] {
        let expected = fault(&format!("/previous_plan/{pointer}"), "out_of_range");
        let given = previous(asked, commanded);
        assert_eq!(faults_after(|body| body["previous_plan"] = given).await, expected);
    }
}

#[tokio::test]
async fn a_goal_must_have_what_its_kind_needs_and_nothing_else() {
    let goal = |goal: Value| faults_after(|body: &mut Value| body["goal"] = goal);
    assert_eq!(
        goal(json!({ "kind": "track" })).await,
        fault("/goal/auv", "missing")
    );
    let too_much = json!({ "kind": "track", "auv": "auv-1", "dwell_s": 240.0 });
    assert_eq!(goal(too_much).await, fault("/goal/dwell_s", "unexpected"));
    let in_turn = json!({ "kind": "intermittent", "auvs": ["auv-1"], "dwell_s": 240.0 });
    assert_eq!(goal(in_turn).await, fault("/goal/epoch_s", "missing"));
    let stranger = json!({ "kind": "midpoint", "auvs": ["auv-1", "auv-9"] });
    assert_eq!(goal(stranger).await, fault("/goal/auvs/1", "unknown_vehicle"));
    let twice = json!({ "kind": "midpoint", "auvs": ["auv-1", "auv-1"] });
    assert_eq!(goal(twice).await, fault("/goal/auvs/1", "duplicate"));
}

#[tokio::test]
async fn weights_and_a_range_are_checked_one_by_one() {
    let goal = |goal: Value| faults_after(|body: &mut Value| body["goal"] = goal);
    let weights = |weights: Value| goal(json!({ "kind": "weighted", "weights": weights }));
    assert_eq!(
        goal(json!({ "kind": "weighted" })).await,
        fault("/goal/weights", "missing")
    );
    for (given, pointer, code) in [
        (json!({}), "/goal/weights", "length"),
        (json!({ "auv-1": 0.0 }), "/goal/weights", "all_zero"),
        (json!({ "auv-1": -0.1 }), "/goal/weights/auv-1", "out_of_range"),
        (json!({ "auv-1": 1.1e6 }), "/goal/weights/auv-1", "out_of_range"),
        (json!({ "auv-1": "much" }), "/goal/weights/auv-1", "wrong_type"),
        (json!({ "auv-1": null }), "/goal/weights/auv-1", "wrong_type"),
        (
            json!({ "auv-1": 1.0, "a/b~c": 1.0 }),
            "/goal/weights/a~1b~0c",
            "unknown_vehicle",
        ),
        (json!([0.7, 0.3]), "/goal/weights", "wrong_type"),
        (json!(0.7), "/goal/weights", "wrong_type"),
    ] {
        assert_eq!(weights(given.clone()).await, fault(pointer, code), "{given}");
    }
    let crowd: serde_json::Map<_, _> = (0..17).map(|i| (format!("auv-{i}"), json!(1.0))).collect();
    assert_eq!(weights(json!(crowd)).await, fault("/goal/weights", "length"));

    let twice = example("track").to_string().replace(
        r#""kind":"track""#,
        r#""kind":"weighted","weights":{"auv-1":1,"auv-1":2}"#,
    );
    let answer = planned(twice).await;
    assert_eq!(answer.status, StatusCode::UNPROCESSABLE_ENTITY, "{}", answer.text);
    assert_eq!(answer.faults(), fault("/goal/weights/auv-1", "duplicate_field"));

    let range = |range: Value| goal(json!({ "kind": "range", "auvs": ["auv-1"], "range_m": range }));
    assert_eq!(range(json!(0.9)).await, fault("/goal/range_m", "out_of_range"));
    assert_eq!(range(json!(20_001)).await, fault("/goal/range_m", "out_of_range"));
    assert_eq!(
        goal(json!({ "kind": "range", "auvs": ["auv-1"] })).await,
        fault("/goal/range_m", "missing")
    );
}

#[tokio::test]
async fn an_offset_must_have_what_its_frame_needs_and_nothing_else() {
    let offset = |offset: Value| faults_after(|body: &mut Value| body["goal"]["offset"] = offset);
    let at = |name: &str| format!("/goal/offset/{name}");
    for (given, name, code) in [
        (json!({ "frame": "ned", "north_m": 1.0 }), "east_m", "missing"),
        (
            json!({ "frame": "target", "ahead_m": 1.0, "starboard_m": 2.0, "north_m": 0.0 }),
            "north_m",
            "unexpected",
        ),
        (
            json!({ "frame": "target", "ahead_m": 1.0, "starboard_m": 1000.1 }),
            "starboard_m",
            "out_of_range",
        ),
        (
            json!({ "frame": "ned", "north_m": -1000.1, "east_m": 0.0 }),
            "north_m",
            "out_of_range",
        ),
        (
            json!({ "frame": "polar", "range_m": -1.0, "bearing_rad": 0.0 }),
            "range_m",
            "out_of_range",
        ),
        (
            json!({ "frame": "polar", "range_m": 1.0, "bearing_rad": 90.0 }),
            "bearing_rad",
            "out_of_range",
        ),
        (json!({ "frame": "body" }), "frame", "unknown_variant"),
        (
            json!({ "frame": "path", "ahead_m": 1.0, "starboard_m": 2.0 }),
            "frame",
            "no_path",
        ),
    ] {
        assert_eq!(offset(given.clone()).await, fault(&at(name), code), "{given}");
    }
    assert_eq!(
        offset(json!(["ned", 1.0, 2.0])).await,
        fault("/goal/offset", "wrong_type")
    );
}

#[tokio::test]
async fn several_vehicles_have_no_path_in_common() {
    let mut body = example("midpoint");
    let path = json!({ "segments": [lane()], "speed_mps": 0.193 });
    for auv in [0, 1] {
        body["auvs"][auv]["path"] = path.clone();
    }
    let offset = json!({ "frame": "path", "ahead_m": 1.0, "starboard_m": 2.0 });
    body["goal"]["offset"] = offset.clone();
    let answer = planned(body.to_string()).await;
    assert_eq!(answer.faults(), fault("/goal/offset/frame", "no_path"));

    body["goal"] =
        json!({ "kind": "intermittent", "auvs": ["auv-1", "auv-2"], "dwell_s": 240.0, "epoch_s": 0.0 });
    body["goal"]["offset"] = offset;
    assert_eq!(planned(body.to_string()).await.status, StatusCode::OK);
    body["auvs"][1].as_object_mut().expect("an object").remove("path");
    let answer = planned(body.to_string()).await;
    assert_eq!(answer.faults(), fault("/goal/offset/frame", "no_path"));
    assert_eq!(answer.problem()["errors"][0]["given"], "auv-2");
}

fn lane() -> Value {
    json!({ "kind": "line", "from": [0.0, 0.0], "to": [50.0, 0.0] })
}

/// Half a circle, as exact as a client may write it down.
fn turn() -> Value {
    let angle = (std::f64::consts::PI * 1e5).round() / 1e5;
    json!({ "kind": "arc", "from": [50.0, 0.0], "centre": [50.0, 10.0], "angle_rad": angle })
}

/// The first fault of the track example with a path of these segments, and its problem's first error.
async fn path_fault(segments: Value, speed: f64) -> Value {
    let mut body = example("track");
    body["auvs"][0]["path"] = json!({ "segments": segments, "speed_mps": speed });
    let answer = planned(body.to_string()).await;
    assert_eq!(answer.status, StatusCode::UNPROCESSABLE_ENTITY, "{}", answer.text);
    assert_eq!(answer.faults().len(), 1, "{}", answer.text);
    answer.problem()["errors"][0].clone()
}

#[tokio::test]
async fn a_path_that_joins_is_accepted_and_forecast_along() {
    let mut body = example("track");
    let back = json!({ "kind": "waypoints", "points": [[50, 20], [0, 20], [0, 60]], "fillet_m": 5 });
    body["auvs"][0]["path"] = json!({ "segments": [lane(), turn(), back], "speed_mps": 0.193 });
    body["forecast"] = json!("path");
    let answer = planned(body.to_string()).await;
    assert_eq!(answer.status, StatusCode::OK, "{}", answer.text);
    let answer: Value = serde_json::from_str(&answer.text).expect("is JSON");
    assert_eq!(answer["targets"][0]["forecast"], "path");
}

#[tokio::test]
async fn an_invalid_path_is_located() {
    let at = "/auvs/0/path/segments";
    let corner =
        |fillet: f64| json!({ "kind": "waypoints", "points": [[0, 0], [9, 0], [9, 9]], "fillet_m": fillet });
    let mut gap = turn();
    gap["from"] = json!([50.5, 0.0]);
    for (segments, pointer, code) in [
        (json!([]), at.to_owned(), "length"),
        (json!([lane(), gap]), format!("{at}/1"), "gap"),
        (json!([turn(), turn()]), format!("{at}/1"), "gap"),
        (json!([corner(0.0)]), format!("{at}/0/points/1"), "kink"),
        (json!([corner(9.1)]), format!("{at}/0/points/1"), "fillet"),
        (json!([corner(-1.0)]), format!("{at}/0/fillet_m"), "out_of_range"),
        (
            json!([{ "kind": "line", "from": [0, 0], "to": [2e6, 0] }]),
            format!("{at}/0/to/0"),
            "out_of_range",
        ),
        (
            json!([{ "kind": "line", "from": [0, 0] }]),
            format!("{at}/0/to"),
            "missing",
        ),
        (
            json!([{ "kind": "line", "from": [0, 0], "to": [1, 0], "angle_rad": 1 }]),
            format!("{at}/0/angle_rad"),
            "unexpected",
        ),
        (
            json!([{ "kind": "waypoints", "points": vec![[0, 0]; 257], "fillet_m": 0 }]),
            at.to_owned(),
            "length",
        ),
    ] {
        let error = path_fault(segments, 0.193).await;
        assert_eq!(
            (&error["pointer"], &error["code"]),
            (&json!(pointer), &json!(code))
        );
    }
    let error = path_fault(json!([corner(9.1)]), 0.193).await;
    assert_eq!(error["given"], 9.1);
    let most = error["limit"]["most"].as_f64().expect("a number");
    // One right angle on legs of 9 m.
    assert!((most - 9.0).abs() < 1e-9);
    let error = path_fault(json!([lane()]), 0.0).await;
    assert_eq!(error["pointer"], "/auvs/0/path/speed_mps");
    assert_eq!(error["limit"], json!({ "least": 0.01, "most": 10.0 }));
}

#[tokio::test]
async fn a_point_has_two_numbers() {
    for (point, code) in [
        (json!([1.0]), "length"),
        (json!([1.0, 2.0, 3.0]), "length"),
        (json!({ "north_m": 1.0 }), "wrong_type"),
        (json!("here"), "wrong_type"),
    ] {
        let error = path_fault(json!([{ "kind": "line", "from": point, "to": [9, 9] }]), 0.193).await;
        assert_eq!(error["code"], code, "{point}: {error}");
        let at = error["pointer"].as_str().expect("text");
        assert!(at.starts_with("/auvs/0/path/segments/0/from"), "{error}");
    }
}

#[tokio::test]
async fn invalid_bounds_are_located() {
    let disc = |radius: f64| json!({ "north_m": 0.0, "east_m": 0.0, "radius_m": radius });
    let notched = json!([[0, 0], [9, 0], [5, 2], [9, 9], [0, 9]]);
    let closed = json!([[0, 0], [9, 0], [9, 9], [0, 0]]);
    for (name, value, pointer, code) in [
        (
            "keep_outs",
            json!([disc(1.0), disc(0.0)]),
            "/keep_outs/1/radius_m",
            "out_of_range",
        ),
        ("keep_outs", json!(vec![disc(1.0); 33]), "/keep_outs", "length"),
        (
            "keep_outs",
            json!([{ "north_m": 0, "radius_m": 1 }]),
            "/keep_outs/0/east_m",
            "missing",
        ),
        ("keep_outs", json!([[0, 0, 1]]), "/keep_outs/0", "wrong_type"),
        ("area", json!([[0, 0], [9, 0]]), "/area", "length"),
        ("area", json!(vec![[0, 0]; 65]), "/area", "length"),
        ("area", json!([[0, 0], [9, 0], [9]]), "/area/2", "length"),
        ("area", json!([[0, 0], [9, 0], [9, 9, 0]]), "/area/2", "length"),
        (
            "area",
            json!([[0, 0], [9, 0], [9, 2e6]]),
            "/area/2/1",
            "out_of_range",
        ),
        ("area", notched, "/area/2", "not_convex"),
        ("area", closed, "/area/0", "too_near"),
        ("area", json!([[0, 0], [9, 0], [18, 0]]), "/area", "too_narrow"),
        ("acoustics", json!({}), "/acoustics/range_max_m", "missing"),
        (
            "acoustics",
            json!({ "range_max_m": 0.5 }),
            "/acoustics/range_max_m",
            "out_of_range",
        ),
        ("acoustics", json!(100.0), "/acoustics", "wrong_type"),
        (
            "surfacing_separation_m",
            json!(0.4),
            "/surfacing_separation_m",
            "out_of_range",
        ),
        (
            "surfacing_separation_m",
            json!("5 m"),
            "/surfacing_separation_m",
            "wrong_type",
        ),
    ] {
        let faults = faults_after(|body| body[name] = value.clone()).await;
        let [(at, found)] = faults.as_slice() else {
            panic!("{name} {value}: {faults:?}")
        };
        assert!(
            at.starts_with(pointer) && found == code,
            "{name} {value}: {faults:?}"
        );
    }
    let mut body = example("track");
    body["acoustics"] = json!({ "range_max_m": 30_000.0 });
    let error = planned(body.to_string()).await.problem()["errors"][0].clone();
    assert_eq!(error["given"], 30_000.0);
    assert_eq!(error["limit"], json!({ "least": 1.0, "most": 20_000.0 }));
}

#[tokio::test]
async fn an_invalid_dive_is_located() {
    for (member, given, least, most) in [
        ("depth_min_m", -0.1, 0.0, 11_999.5),
        ("depth_max_m", 1.4, 1.5, 12_000.0),
        ("pitch_rad", 50.0, 0.05, 1.4),
        ("reversal_s", 0.0, 0.1, 120.0),
    ] {
        let mut body = example("track");
        body["auvs"][0]["dive"] = json!({ "depth_min_m": 1.0, "depth_max_m": 23.0, "pitch_rad": 0.873 });
        body["auvs"][0]["dive"][member] = json!(given);
        let answer = planned(body.to_string()).await;
        let pointer = format!("/auvs/0/dive/{member}");
        assert_eq!(
            answer.faults(),
            fault(&pointer, "out_of_range"),
            "{}",
            answer.text
        );
        let error = &answer.problem()["errors"][0];
        assert_eq!(error["given"], given);
        assert_eq!(error["limit"], json!({ "least": least, "most": most }));
    }
}

#[tokio::test]
async fn a_current_that_is_handed_back_is_no_faster_than_one_that_is_given() {
    for pointer in ["/current/north_mps", "/previous_plan/current/east_mps"] {
        let mut body = example("track");
        let still = json!({ "north_mps": 0, "east_mps": 0 });
        body["current"] = still.clone();
        body["previous_plan"] = json!({ "trajectory": [], "current": still });
        *body.pointer_mut(pointer).expect("is there") = json!(-3.1);
        let answer = planned(body.to_string()).await;
        assert_eq!(answer.faults(), fault(pointer, "out_of_range"));
        let error = &answer.problem()["errors"][0];
        assert_eq!(error["given"], -3.1);
        assert_eq!(error["limit"], json!({ "least": -3.0, "most": 3.0 }));
    }
}

/// What an earlier answer knew of a vehicle, as it is handed back.
fn previous_target() -> Value {
    json!({
        "id": "a",
        "estimate": {
            "age_s": 2.0, "north_m": 0, "east_m": 0, "depth_m": 5, "north_mps": 0.2, "east_mps": 0,
            "turn_rate_radps": 0,
        },
        "forecast": "constant_velocity",
        "drift": { "north_mps": 0.0, "east_mps": 0.1 },
    })
}

#[tokio::test]
async fn what_was_known_of_a_vehicle_is_checked() {
    let of = "/previous_plan/targets";
    for (place, wrong, code) in [
        ("/0/estimate/age_s", json!(-1.0), "out_of_range"),
        ("/0/estimate/north_m", json!(2.1e6), "out_of_range"),
        ("/0/estimate/depth_m", json!(-11), "out_of_range"),
        ("/0/estimate/east_mps", json!(21), "out_of_range"),
        ("/0/estimate/turn_rate_radps", json!(1.1), "out_of_range"),
        ("/0/drift/east_mps", json!(3.1), "out_of_range"),
        ("/0/forecast", json!("straight"), "unknown_variant"),
        ("", json!(vec![previous_target(); 17]), "length"),
    ] {
        let pointer = format!("{of}{place}");
        let change = |body: &mut Value| {
            body["previous_plan"] = json!({ "trajectory": [], "targets": [previous_target()] });
            *body.pointer_mut(&pointer).expect("is there") = wrong;
        };
        assert_eq!(faults_after(change).await, fault(&pointer, code));
    }
}

#[tokio::test]
async fn what_is_not_handed_back_whole_starts_anew() {
    let mut body = example("track");
    for targets in [
        json!(null),
        json!([]),
        json!([{ "id": "a" }]),
        json!([previous_target()]),
    ] {
        body["previous_plan"] = json!({ "trajectory": [], "targets": targets });
        assert_eq!(
            planned(body.to_string()).await.status,
            StatusCode::OK,
            "{targets}"
        );
    }
}

#[tokio::test]
async fn half_a_ground_velocity_is_refused() {
    let faults = faults_after(|body| body["asc"]["ground_north_mps"] = json!(0.3)).await;
    assert_eq!(faults, fault("/asc/ground_east_mps", "missing"));
}

#[tokio::test]
async fn another_version_and_long_metadata_are_refused_together() {
    let faults = faults_after(|body| {
        body["schema_version"] = json!("2.0");
        body["metadata"] = json!({ "long": "x".repeat(5000) });
    })
    .await;
    assert_eq!(
        faults,
        [
            fault("/schema_version", "unsupported"),
            fault("/metadata", "length")
        ]
        .concat()
    );
}

#[tokio::test]
async fn a_huge_list_is_refused_before_its_items_are_compared() {
    let names: Vec<_> = (0..50_000).map(|i| i.to_string()).collect();
    let goal = json!({ "kind": "midpoint", "auvs": names });
    assert_eq!(
        faults_after(|body| body["goal"] = goal).await,
        fault("/goal/auvs", "length")
    );
}

#[tokio::test]
async fn a_long_name_is_not_repeated_in_full() {
    let mut body = example("track");
    body["goal"]["auv"] = json!("x".repeat(100_000));
    let answer = planned(body.to_string()).await;
    assert_eq!(answer.faults(), fault("/goal/auv", "unknown_vehicle"));
    assert!(answer.text.len() < 2_000);
}

#[tokio::test]
async fn a_body_that_is_not_announced_as_json_is_refused() {
    for content_type in [
        None,
        Some("text/plain"),
        Some("application/x-www-form-urlencoded"),
    ] {
        let mut request = Request::post("/v1/plan");
        if let Some(content_type) = content_type {
            request = request.header("content-type", content_type);
        }
        let request = request.body(Body::from(EXAMPLES[0].body)).expect("a request");
        let answer = send(Settings::default(), request).await;
        assert_eq!(answer.status, StatusCode::UNSUPPORTED_MEDIA_TYPE);
        assert_eq!(answer.problem()["code"], "unsupported_media_type");
    }
}

#[tokio::test]
async fn a_body_of_over_a_mebibyte_is_refused() {
    let answer = planned(" ".repeat(service::BODY_BYTES_MAX + 1)).await;
    assert_eq!(answer.status, StatusCode::PAYLOAD_TOO_LARGE);
    assert_eq!(answer.problem()["code"], "body_too_large");
    let full = planned(" ".repeat(service::BODY_BYTES_MAX)).await;
    assert_eq!(full.status, StatusCode::BAD_REQUEST, "all of a mebibyte is read");
}

#[tokio::test]
async fn a_body_announced_as_too_long_is_refused_before_it_is_read() {
    let mut request = post("/v1/plan", EXAMPLES[0].body);
    let long = HeaderValue::from(service::BODY_BYTES_MAX + 1);
    request.headers_mut().insert("content-length", long);
    let answer = send(Settings::default(), request).await;
    assert_eq!(answer.status, StatusCode::PAYLOAD_TOO_LARGE, "{}", answer.text);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_body_that_comes_too_slowly_is_given_up_before_the_planner_is_asked() {
    let listener = TcpListener::bind("127.0.0.1:0").await.expect("is free");
    let address = listener.local_addr().expect("is bound");
    let service = app(Settings {
        body_time_limit: Duration::from_millis(50),
        ..Settings::default()
    });
    tokio::spawn(async { axum::serve(listener, service).await });
    let mut socket = TcpStream::connect(address).expect("listens");
    let limit = Some(Duration::from_secs(5));
    socket.set_read_timeout(limit).expect("is a socket");
    let half = "POST /v1/plan HTTP/1.1\r\nhost: localhost\r\ncontent-type: application/json\r\n\
        content-length: 100\r\n\r\n{";
    socket.write_all(half.as_bytes()).expect("takes it");
    let mut answer = String::new();
    socket.read_to_string(&mut answer).expect("answers and closes");
    assert!(answer.starts_with("HTTP/1.1 408 "), "{answer}");
    assert!(answer.contains("connection: close"), "{answer}");
    assert!(answer.contains("application/problem+json"), "{answer}");
    assert!(answer.contains(r#""code":"body_timed_out""#), "{answer}");
}

#[tokio::test]
async fn a_body_that_takes_longer_than_an_answer_may_is_answered_by_a_lower_level() {
    let settings = Settings {
        deadline: Duration::from_millis(50),
        ..Settings::default()
    };
    let (head, tail) = EXAMPLES[0].body.split_at(20);
    let pieces = futures_util::stream::once(async move { Ok::<_, std::io::Error>(head) }).chain(
        futures_util::stream::once(async move {
            tokio::time::sleep(Duration::from_millis(200)).await;
            Ok(tail)
        }),
    );
    let answer = send(settings, post("/v1/plan", Body::from_stream(pieces))).await;
    assert_eq!(answer.status, StatusCode::OK, "{}", answer.text);
    assert_eq!(answer.json()["reason"], "deadline");
}

#[tokio::test(flavor = "multi_thread")]
async fn what_http_itself_refuses_has_a_status_and_no_body() {
    let listener = TcpListener::bind("127.0.0.1:0").await.expect("is free");
    let address = listener.local_addr().expect("is bound");
    tokio::spawn(async { axum::serve(listener, app(Settings::default())).await });
    for (head, status) in [
        ("this is no HTTP\r\n\r\n".to_owned(), 400),
        (
            "GET /livez HTTP/1.1\r\nhost: a\r\ncontent-length: none\r\n\r\n".to_owned(),
            400,
        ),
        (
            format!("GET /{} HTTP/1.1\r\nhost: a\r\n\r\n", "x".repeat(1 << 16)),
            414,
        ),
        (
            format!("GET /livez HTTP/1.1\r\n{}\r\n", "a: b\r\n".repeat(101)),
            431,
        ),
    ] {
        let mut socket = TcpStream::connect(address).expect("listens");
        let limit = Some(Duration::from_secs(5));
        socket.set_read_timeout(limit).expect("is a socket");
        socket.write_all(head.as_bytes()).expect("takes it");
        let mut answer = String::new();
        socket.read_to_string(&mut answer).expect("answers and closes");
        assert!(answer.starts_with(&format!("HTTP/1.1 {status} ")), "{answer}");
        let (_, body) = answer.split_once("\r\n\r\n").expect("has a head");
        assert_eq!(body, "", "{status}");
    }
}

#[tokio::test]
async fn a_body_in_another_coding_or_character_set_is_refused() {
    for (name, value, said) in [
        ("content-encoding", "gzip", "gzip"),
        ("content-encoding", "identity, br", "br"),
        ("content-type", "application/json; charset=utf-16", "utf-16"),
        ("content-type", "application/json; Charset=\"latin1\"", "latin1"),
    ] {
        let mut request = post("/v1/plan", EXAMPLES[0].body);
        let value = HeaderValue::from_static(value);
        request.headers_mut().insert(name, value);
        let answer = send(Settings::default(), request).await;
        assert_eq!(answer.status, StatusCode::UNSUPPORTED_MEDIA_TYPE, "{said}");
        let problem = answer.problem();
        assert!(
            problem["detail"].as_str().expect("text").contains(said),
            "{problem}"
        );
    }
    for (name, value) in [
        ("content-encoding", "Identity"),
        ("content-type", "application/json;charset=\"UTF-8\""),
    ] {
        let mut request = post("/v1/plan", EXAMPLES[0].body);
        request
            .headers_mut()
            .insert(name, HeaderValue::from_static(value));
        assert_eq!(
            send(Settings::default(), request).await.status,
            StatusCode::OK,
            "{value}"
        );
    }
}

#[tokio::test]
async fn an_unknown_route_and_an_unknown_example_are_not_found() {
    let answer = send(Settings::default(), get("/v2/plan")).await;
    assert_eq!(
        (answer.status, answer.problem()["code"].clone()),
        (StatusCode::NOT_FOUND, json!("no_route"))
    );
    assert_eq!(answer.problem()["instance"], "/v2/plan");
    for path in ["/v1/examples/nothing", "/v1/examples/%ff"] {
        let answer = send(Settings::default(), get(path)).await;
        assert_eq!(answer.status, StatusCode::NOT_FOUND);
        assert!(
            answer.problem()["detail"]
                .as_str()
                .expect("text")
                .contains("track")
        );
    }
}

#[tokio::test]
async fn a_wrong_method_is_answered_with_the_right_ones() {
    for (method, path, allowed) in [
        (Method::GET, "/v1/plan", "POST"),
        (Method::DELETE, "/v1/examples", "GET,HEAD"),
        (Method::POST, "/", "GET,HEAD"),
        (Method::PUT, "/openapi.json", "GET,HEAD"),
    ] {
        let request = Request::builder()
            .method(method)
            .uri(path)
            .body(Body::empty())
            .expect("a request");
        let answer = send(Settings::default(), request).await;
        assert_eq!(answer.status, StatusCode::METHOD_NOT_ALLOWED, "{path}");
        assert_eq!(answer.problem()["code"], "method_not_allowed");
        assert_eq!(answer.headers["allow"], allowed, "{path}");
    }
}

fn assert_try_again(answer: &Answer, status: StatusCode, code: &str) {
    assert_eq!(answer.status, status, "{}", answer.text);
    assert_eq!(answer.problem()["code"], code);
    assert_eq!(answer.headers["retry-after"], "1");
}

/// The same request would get the same answer.
fn assert_do_not_try_again(answer: &Answer, code: &str) {
    assert_eq!(answer.status, StatusCode::SERVICE_UNAVAILABLE, "{}", answer.text);
    assert_eq!(answer.problem()["code"], code);
    assert!(!answer.headers.contains_key("retry-after"));
}

fn slow(snapshot: &Snapshot, policy: &Policy, workspace: &mut Workspace, stop: &Stop) -> Plan {
    std::thread::sleep(Duration::from_millis(300));
    plan_until(snapshot, policy, workspace, stop)
}

#[tokio::test]
async fn a_request_more_than_the_queue_holds_is_turned_away_and_the_others_are_answered() {
    let settings = Settings {
        plan: slow,
        planners: 1,
        waiting: 1,
        ..Settings::default()
    };
    let service = app(settings);
    let asked = (0..3).map(|_| tokio::spawn(send_to(service.clone(), post("/v1/plan", EXAMPLES[0].body))));
    let mut answers = Vec::new();
    for answer in asked.collect::<Vec<_>>() {
        answers.push(answer.await.expect("no panic"));
    }
    let (served, turned_away): (Vec<_>, Vec<_>) = answers
        .into_iter()
        .partition(|answer| answer.status == StatusCode::OK);
    assert_eq!((served.len(), turned_away.len()), (2, 1));
    assert_try_again(&turned_away[0], StatusCode::SERVICE_UNAVAILABLE, "overloaded");
}

#[tokio::test]
async fn a_deadline_that_no_iteration_can_keep_is_refused_if_nothing_else_will_do() {
    let mut strict = example("track");
    strict["fallback"] = json!("none");
    strict["deadline_ms"] = json!(20.0);
    let settings = Settings {
        plan: slow,
        ..Settings::default()
    };
    let answer = send(settings, post("/v1/plan", strict.to_string())).await;
    assert_try_again(&answer, StatusCode::GATEWAY_TIMEOUT, "timed_out");
}

#[tokio::test]
async fn a_deadline_out_of_range_is_named() {
    for wrong in [0.0, 0.049, 60_001.0, -1.0] {
        let faults = faults_after(|body| body["deadline_ms"] = json!(wrong)).await;
        assert_eq!(faults, fault("/deadline_ms", "out_of_range"), "{wrong}");
    }
    let faults = faults_after(|body| body["deadline_ms"] = json!("soon")).await;
    assert_eq!(faults, fault("/deadline_ms", "wrong_type"));
}

#[tokio::test]
async fn a_panic_is_a_problem_document_and_the_next_request_is_served() {
    fn panics_ahead_of_north(
        snapshot: &Snapshot,
        policy: &Policy,
        workspace: &mut Workspace,
        stop: &Stop,
    ) -> Plan {
        assert!(snapshot.asc.position.x < 1e3, "on purpose");
        plan_until(snapshot, policy, workspace, stop)
    }
    let service = app(Settings {
        plan: panics_ahead_of_north,
        planners: 1,
        waiting: 0,
        // A debug build takes a second and more to print where it panicked.
        deadline: Duration::from_mins(1),
        ..Settings::default()
    });
    let mut far = example("track");
    far["asc"]["north_m"] = json!(2e3);
    let answer = send_to(service.clone(), post("/v1/plan", far.to_string())).await;
    assert_eq!(answer.status, StatusCode::INTERNAL_SERVER_ERROR);
    assert_eq!(answer.problem()["code"], "internal");
    assert!(!answer.text.contains("on purpose"));
    let next = send_to(service, post("/v1/plan", EXAMPLES[0].body)).await;
    assert_eq!(next.status, StatusCode::OK);
}

/// The planner, with a solver that ran out of iterations.
fn gives_up(snapshot: &Snapshot, policy: &Policy, workspace: &mut Workspace, stop: &Stop) -> Plan {
    let plan = plan_until(snapshot, policy, workspace, stop);
    Plan {
        degraded: Some(Degraded::Solver(SolverStatus::MaxIterations)),
        ..plan
    }
}

#[tokio::test]
async fn without_a_solution_the_client_chooses_between_a_lower_fallback_level_and_a_refusal() {
    let settings = Settings {
        plan: gives_up,
        ..Settings::default()
    };
    let degraded = send(settings.clone(), post("/v1/plan", EXAMPLES[0].body)).await;
    assert_eq!(degraded.status, StatusCode::OK);
    assert_eq!(degraded.json()["outcome"], "degraded");
    assert_eq!(degraded.json()["reason"], "solver_max_iterations");

    let mut strict = example("track");
    strict["fallback"] = json!("none");
    let refused = send(settings, post("/v1/plan", strict.to_string())).await;
    assert_do_not_try_again(&refused, "no_solution");
    assert!(
        refused.problem()["detail"]
            .as_str()
            .expect("text")
            .contains("solver_max_iterations")
    );
}

#[tokio::test]
async fn a_service_whose_planner_gives_up_is_not_ready() {
    let answer = send(
        Settings {
            plan: gives_up,
            ..Settings::default()
        },
        get("/readyz"),
    )
    .await;
    assert_do_not_try_again(&answer, "not_ready");
}

#[tokio::test]
async fn a_page_of_another_site_and_another_name_are_told_why() {
    let settings = || Settings {
        hosts: Some(Hosts::default()),
        ..Settings::default()
    };
    let with = async |name: &'static str, value: &'static str| {
        let mut request = post("/v1/plan", EXAMPLES[0].body);
        let headers = request.headers_mut();
        headers.insert("host", HeaderValue::from_static("localhost:8080"));
        headers.insert(name, HeaderValue::from_static(value));
        send(settings(), request).await
    };
    assert_eq!(
        with("origin", "http://localhost:8080").await.status,
        StatusCode::OK
    );
    let foreign = with("origin", "http://evil.example").await;
    assert_eq!(foreign.status, StatusCode::FORBIDDEN);
    assert_eq!(foreign.problem()["code"], "cross_site");
    let rebound = with("host", "evil.example").await;
    assert_eq!(rebound.status, StatusCode::MISDIRECTED_REQUEST);
    assert!(
        rebound.text.contains("--allow-host evil.example"),
        "{}",
        rebound.text
    );
    let nameless = send(settings(), post("/v1/plan", EXAMPLES[0].body)).await;
    assert_eq!(nameless.status, StatusCode::BAD_REQUEST);
    assert_eq!(nameless.problem()["code"], "host_header");
}
