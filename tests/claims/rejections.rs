//! Every refusal: a problem document, the right status, and the field at fault.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use axum::{body::Body, http::StatusCode};
use futures_util::{StreamExt as _, stream};
use hyper::server::conn::http1;
use hyper_util::{rt::TokioIo, service::TowerToHyperService};
use planner::parameters::Parameters;
use planner::plan::{Degraded, Plan, Workspace, plan_until};
use planner::snapshot::Snapshot;
use planner::solve::SolverStatus;
use planner::stop::Stop;
use serde_json::{Value, json};
use service::{Hosts, Settings, app, examples::EXAMPLES};
use tests::{
    broken::places_of,
    client::{Answer, call, example, fault, get, post, send, send_to, simulated_machine, with},
    refusals::{self, put},
};
use tokio::io::{AsyncReadExt as _, AsyncWriteExt as _, duplex};

async fn planned(body: impl Into<Body>) -> Answer {
    send(simulated_machine(), post("/v1/plan", body)).await
}

/// The answer to a request without changes and with that header.
async fn with_header(settings: Settings, name: &'static str, value: &str) -> Answer {
    send(settings, with(post("/v1/plan", EXAMPLES[0].body), name, value)).await
}

async fn assert_refused(base: &Value, table: &str) {
    refusals::assert_refused(base, table, async |body: Value| planned(body.to_string()).await).await;
}

/// `true` if the track example is planned with `value` at `place`.
async fn is_accepted(place: &str, value: Value) -> bool {
    let mut body = example("track");
    put(&mut body, place, Some(value));
    planned(body.to_string()).await.status == StatusCode::OK
}

#[tokio::test(start_paused = true)]
async fn invalid_json_is_refused_at_its_fault() {
    let and_more = format!("{} x", EXAMPLES[0].body);
    for (body, pointer) in [
        ("", ""),
        ("{", ""),
        ("not json", ""),
        (&*and_more, ""),
        (r#"{"t_s":NaN}"#, "/t_s"),
        (r#"{"asc":{"north_m":1e999}}"#, "/asc/north_m"),
        (r#"{"auvs":[{"id":"a"#, "/auvs/0/id"),
    ] {
        let answer = planned(body.to_owned()).await;
        answer.must_be(400);
        assert_eq!(answer.faults(), fault(pointer, "syntax"), "{body}");
    }
}

#[tokio::test(start_paused = true)]
async fn a_member_is_refused_by_place_and_reason() {
    let table = r#"
        /auvs/0/fixes             []                  unknown_field
        /a~1b~0c                  1                   unknown_field
        /asc/speed_mps            absent              missing
        /asc/ground_north_mps     0.3                 missing           /asc/ground_east_mps
        /auvs/0/state/speed_mps   -0.1                out_of_range      0..10
        /auvs/0/state             [18,6,9,0,0,0,0]    wrong_type
        /deadline_ms              60001               out_of_range
        # An angle in degrees is not wrapped.
        /asc/heading_rad          90                  out_of_range      must be from -6.283185307179586 to 6.283185307179586 rad, not degrees (`heading_deg` takes degrees)
        /auvs/0/state/course_rad  45                  out_of_range      must be from -6.283185307179586 to 6.283185307179586 rad, not degrees (`course_deg` takes degrees)
        /asc/heading_deg          30                  mixed
        # An AUV has a state or reports.
        /auvs/0/reports           [{"t_s":110,"north_m":1,"east_m":2,"sigma_m":1.5}]  unexpected
        /auvs/0                   {"id":"auv-1"}      missing           /auvs/0/state

        # A craft's numbers contradict one another.
        /craft/preset        "titanic"            unknown_preset
        /craft/heading_loop  {"damping":0.8}      missing        /craft/heading_loop/natural_frequency_radps
        /craft/heading_loop  {"natural_frequency_radps":1}  missing  /craft/heading_loop/damping
        /craft/heading_loop  {"time_constant_s":1,"damping":1}  unexpected  /craft/heading_loop/time_constant_s
        /craft/heading_loop  {"lag_s":1}          unknown_field  /craft/heading_loop/lag_s
        /craft/surge_loop    {"integrates":true}  missing        /craft/surge_loop/integral_time_s
        /craft/surge_loop    {"integrates":false,"integral_time_s":9}  unexpected  /craft/surge_loop/integral_time_s

        # Details are in the words of JSON.
        .             []              wrong_type       must be an object, not a list
        .             3               wrong_type       must be an object, not a number
        /asc/north_m  "far"           wrong_type       must be a number, not text
        /auvs/0/id    7               wrong_type       must be text, not a number
        /auvs         {}              wrong_type       must be a list, not an object
        /auvs         []              length           must have 1 to 16 items
        /goal/kind    null            wrong_type       must be text, not null
        /goal/kind    "attend"        unknown_variant  ~must be one of `track`, `
        /auvs/0       {"name":"a"}    unknown_field    /auvs/0/name  unknown member; known members are `id`, `state`, `reports`, `path`, `dive`
    "#;
    assert_refused(&example("track"), table).await;
    let long = "é".repeat(65);
    for (id, code, said) in
        [(&*long, "length", "must have 1 to 64 bytes"), ("auv\u{0}1", "control_character", "")]
    {
        let mut body = example("track");
        (body["auvs"][0]["id"], body["goal"]["auv"]) = (json!(id), json!(id));
        let answer = planned(body.to_string()).await;
        answer.must_say(said);
        assert_eq!(answer.faults(), fault("/auvs/0/id", code));
    }
    let marked = planned(format!("\u{feff}{}", EXAMPLES[0].body)).await;
    marked.must_say("byte order mark");
}

#[tokio::test(start_paused = true)]
async fn a_list_instead_of_an_object_is_refused_even_beside_ignored_members() {
    let deep = format!("{}{}", "[".repeat(500), "]".repeat(500));
    for junk in ["1e400", deep.as_str()] {
        let mut body = example("track");
        body["current"] = json!([0.0, 0.1]);
        body["previous_plan"] = json!({ "trajectory": [], "ignored": "JUNK" });
        let answer = planned(body.to_string().replace("\"JUNK\"", junk)).await;
        answer.must_be(400);
        let faults = answer.faults();
        assert_eq!(faults[0].1, "syntax");
        assert!(faults[0].0.starts_with("/previous_plan/ignored"), "{faults:?}");
    }
}

#[tokio::test(start_paused = true)]
async fn a_repeated_name_and_too_many_values_are_refused() {
    let and = |member: &str| EXAMPLES[0].body.replacen('{', &format!("{{{member},"), 1);
    let long = format!(r#""metadata":[{}0]"#, "0,".repeat(200_000));
    let twice = r#"{"asc":{"north_m":1,"north_m":2}}"#;
    let deep = r#""metadata":{"a":[{"b":1,"c":2,"b":3}]}"#;
    let weights = r#""kind":"weighted","weights":{"auv-1":1,"auv-1":2}"#;
    let weighted = example("track").to_string().replace(r#""kind":"track""#, weights);
    for (body, pointer, code) in [
        (and(r#""t_s":1"#), "/t_s", "duplicate_field"),
        (twice.to_owned(), "/asc/north_m", "duplicate_field"),
        (weighted, "/goal/weights/auv-1", "duplicate_field"),
        (and(deep), "/metadata/a/0/b", "duplicate_field"),
        (and(&long), "", "too_many_values"),
    ] {
        let answer = planned(body).await;
        answer.must_be(422);
        assert_eq!(answer.faults(), fault(pointer, code));
    }
}

#[tokio::test(start_paused = true)]
async fn an_invalid_report_is_located() {
    let good = json!({ "t_s": 120.9, "north_m": 1, "east_m": 2, "sigma_m": 1.5, "depth_m": 3, "course_rad": 0.1,
        "speed_mps": 0.2, "turn_rate_radps": 0 });
    let mut body = example("track");
    body["auvs"] = json!([{ "id": "auv-1", "reports": [good, good] }]);
    let many = json!(vec![good; 65]);
    let table = format!(
        "
        /auvs/0/reports/1/t_s              121.1    out_of_range
        /auvs/0/reports/1/t_s              180.0    out_of_range  ~is 60.0 s ahead of the request's `t_s`
        /auvs/0/reports/1/sigma_m          0        out_of_range
        /auvs/0/reports/1/course_rad       45       out_of_range
        /auvs/0/reports/1/course_rad       null     missing
        /auvs/0/reports/1/speed_mps        null     missing
        /auvs/0/reports/1/height_m         0        unknown_field
        /auvs/0/reports                    []       length
        /auvs/0/reports                    {many}   length
    "
    );
    assert_refused(&body, &table).await;
}

#[tokio::test(start_paused = true)]
async fn an_invalid_covariance_is_refused_with_the_reason() {
    let mut body = example("track");
    let mut rows = [[0.0; 4]; 4];
    (rows[0][0], rows[1][1]) = (2.25, 2.25);
    body["auvs"][0]["state"]["covariance"] = json!(rows);
    assert_eq!(planned(body.to_string()).await.status, StatusCode::OK);
    let place = "/auvs/0/state/covariance";
    let row = "a row of 4 numbers of a symmetric positive semidefinite 4×4 matrix";
    let whole = "a symmetric positive semidefinite 4×4 matrix, a list of 4 rows";
    let [m33, m45, m24, m54] = [(3, 3), (4, 5), (2, 4), (5, 4)].map(|(rows, columns)| matrix(rows, columns));
    let list = json!(vec![0.0; 16]);
    let table = format!(
        r#"
        {place}/0/0  2e10          out_of_range
        # Not the mirror image of what stands at (0, 3).
        {place}/3/0  0.1           out_of_range
        {place}/2/2  -1            negative_variance  {place}
        {place}      {m33}         length             {place}/0    4..4    must have 4 items, not 3: {row}
        {place}      {m45}         length             {place}/0    must have 4 items, not 5: {row}
        {place}      {m24}         length             must have 4 items, not 2: {whole}
        {place}      {m54}         length             must have 4 items, not 5: {whole}
        {place}      {list}        wrong_type         {place}/0    must be {row}, not a number
        {place}      "diagonal"    wrong_type         must be {whole}, not text
        {place}      {{}}          wrong_type         must be {whole}, not an object
        {place}      [[0,"0",0,0]] wrong_type         {place}/0/1  must be a number, not text
    "#
    );
    assert_refused(&body, &table.replace("]] wrong", "]]  wrong")).await;
}

fn matrix(n_rows: usize, n_columns: usize) -> Value {
    json!(vec![vec![0.0; n_columns]; n_rows])
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
    (body["forecast"], body["fallback"], body["hold"]) = (json!("auto"), json!("los"), json!("stop"));
    body["previous_plan"] = json!({
        "trajectory": [{ "t_s": 119, "north_m": 0, "east_m": 0, "speed_mps": 0.3, "heading_rad": 0 }],
        "goal_course_rad": 0, "current": { "north_mps": 0, "east_mps": 0 },
        "reference": { "speed_mps": 0.3 },
        "craft_estimate": { "asked_speed_mps": 0.3, "asked_heading_rad": 0, "memory": [0, 0.5] }
    });
    body
}

#[tokio::test(start_paused = true)]
async fn no_error_demands_the_type_that_was_sent() {
    let whole = with_everything();
    let service = app(simulated_machine());
    let others = json!([true, "text", -7.5, [], [1, 2, 3], vec![1; 20], {}, null]);
    let mut n_wrong_types = 0;
    for place in places_of(&whole, |_| true) {
        for wrong in others.as_array().expect("is a list") {
            let mut body = whole.clone();
            *body.pointer_mut(&place).expect("was just listed") = wrong.clone();
            let answer = send_to(service.clone(), post("/v1/plan", body.to_string())).await;
            assert_eq!(answer.status, 422, "{place}: {}", answer.text);
            let error = answer.problem()["errors"][0].clone();
            if error["code"] != "wrong_type" {
                continue;
            }
            n_wrong_types += 1;
            let detail = error["detail"].as_str().expect("text");
            let wanted = detail.strip_prefix("must be ").expect("says what is wanted");
            let (wanted, given) = wanted.rsplit_once(", not ").expect("says what is given");
            let is_apt = given != "this" && !wanted.starts_with(given);
            assert!(is_apt, "{place}: {wrong}: {detail}");
            // The member of a whole request has the required type.
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
    // Most of over a hundred places have six wrong types.
    assert!(400 < n_wrong_types, "{n_wrong_types}");
}

#[tokio::test(start_paused = true)]
async fn a_returned_plan_is_checked() {
    let whole = json!({
        "trajectory": [{ "t_s": 119, "north_m": 0, "east_m": 0, "speed_mps": 0.3, "heading_rad": 0 }],
        "goal_course_rad": 0,
        "current": { "north_mps": 0, "east_mps": 0 },
        "reference": { "speed_mps": 0.4, "heading_rad": 1.1 },
        // An unusable memory is ignored, not refused.
        "craft_estimate": { "asked_speed_mps": 0.3, "asked_heading_rad": 1, "memory": [0, 0.5] },
        "targets": [{
            "id": "a",
            "estimate": {
                "age_s": 2.0, "north_m": 0, "east_m": 0, "depth_m": 5, "north_mps": 0.2, "east_mps": 0,
                "turn_rate_radps": 0,
            },
            "forecast": "constant_velocity",
            "drift": { "north_mps": 0.0, "east_mps": 0.1 },
        }],
    });
    // Incomplete plans are ignored.
    for (place, value) in [
        ("", whole.clone()),
        ("/targets", json!(null)),
        ("/targets", json!([])),
        ("/targets", json!([{ "id": "a" }])),
    ] {
        let mut given = whole.clone();
        put(&mut given, place, Some(value));
        assert!(is_accepted("/previous_plan", given.clone()).await, "{given}");
    }
    let mut body = example("track");
    body["previous_plan"] = whole.clone();
    let many = json!(vec![&whole["targets"][0]; 17]);
    let table = format!(
        r#"
        /previous_plan/craft_estimate/asked_speed_mps              41       out_of_range
        /previous_plan/reference/speed_mps                         1e300    out_of_range
        /previous_plan/goal_course_rad                             90       out_of_range
        # It is no faster than a current that is given.
        /current                        {{"north_mps":-3.1,"east_mps":0}}   out_of_range     /current/north_mps  -3..3
        /previous_plan/current/east_mps                            -3.1     out_of_range     -3..3
        /previous_plan/targets/0/drift/east_mps                    3.1      out_of_range
        /previous_plan/targets/0  {{"id":"auv-1","estimate":{{"age_s":-1,"north_m":0,"east_m":0,"depth_m":0,"north_mps":0,"east_mps":0,"turn_rate_radps":0}}}}  out_of_range  /previous_plan/targets/0/estimate/age_s
        /previous_plan/origin  {{"lat_deg":0,"lon_deg":-361}}  out_of_range  /previous_plan/origin/lon_deg
        /previous_plan/targets/0/forecast                          "straight"  unknown_variant
        /previous_plan/targets/0/states  [[1,2]]  length  /previous_plan/targets/0/states/0  6..6  must have 6 items, not 2: a past state, a list of its time, north, east, sigma, and velocity north and east
        /previous_plan/targets/0/track   [[1,2]]  length  /previous_plan/targets/0/track/0  must have 3 items, not 2: a corner of a track, a list of its time, north and east
        /previous_plan/targets                                     {many}   length
    "#
    );
    assert_refused(&body, &table).await;
}

#[tokio::test(start_paused = true)]
async fn a_goal_has_exactly_the_members_of_its_kind() {
    let crowd: serde_json::Map<_, _> = (0..17).map(|i| (format!("auv-{i}"), json!(1.0))).collect();
    let crowd = json!(crowd);
    let table = format!(
        r#"
        /goal          {{"kind":"track"}}                                                     missing       /goal/auv
        /goal          {{"kind":"track","auv":"auv-1","dwell_s":240}}                         unknown_field  /goal/dwell_s
        /goal          {{"kind":"intermittent","auvs":["auv-1"],"dwell_s":240}}               missing       /goal/epoch_s
        /goal          {{"kind":"midpoint","auvs":["auv-1","auv-9"]}}                         unknown_vehicle  /goal/auvs/1
        /goal          {{"kind":"midpoint","auvs":["auv-1","auv-1"]}}                         duplicate     /goal/auvs/1
        /goal          {{"kind":"weighted"}}                                                  missing       /goal/weights
        /goal          {{"kind":"weighted","weights":{{}}}}                                   length        /goal/weights
        /goal          {{"kind":"weighted","weights":{crowd}}}                                length        /goal/weights
        /goal          {{"kind":"weighted","weights":{{"auv-1":0}}}}                          all_zero      /goal/weights
        /goal          {{"kind":"weighted","weights":{{"auv-1":-0.1}}}}                       out_of_range  /goal/weights/auv-1
        /goal          {{"kind":"weighted","weights":{{"auv-1":"much"}}}}                     wrong_type    /goal/weights/auv-1
        /goal          {{"kind":"weighted","weights":{{"auv-1":1,"a/b~c":1}}}}                unknown_vehicle  /goal/weights/a~1b~0c
        /goal          {{"kind":"weighted","weights":[0.7,0.3]}}                              wrong_type    /goal/weights
        /goal          {{"kind":"range","auvs":["auv-1"]}}                                    missing       /goal/range_m
        /goal          {{"kind":"range","auvs":["auv-1"],"range_m":0.9}}                      out_of_range  /goal/range_m
        /goal/offset   {{"frame":"ned","north_m":1}}                                          missing       /goal/offset/east_m
        /goal/offset   {{"frame":"target","ahead_m":1,"starboard_m":2,"north_m":0}}           unknown_field  /goal/offset/north_m
        /goal/offset   {{"frame":"polar","range_m":-1,"bearing_rad":0}}                       out_of_range  /goal/offset/range_m
        /goal/offset   {{"frame":"body"}}                                                     unknown_variant  /goal/offset/frame
        /goal/offset   {{"frame":"path","ahead_m":1,"starboard_m":2}}                         no_path       /goal/offset/frame
        /goal/offset   ["ned",1,2]                                                            wrong_type
    "#
    );
    assert_refused(&example("track"), &table).await;
}

#[tokio::test(start_paused = true)]
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

/// Half a circle, as exact as a client may write it.
fn turn() -> Value {
    let angle = (std::f64::consts::PI * 1e5).round() / 1e5;
    json!({ "kind": "arc", "from": [50.0, 0.0], "centre": [50.0, 10.0], "angle_rad": angle })
}

#[tokio::test(start_paused = true)]
async fn a_continuous_path_is_accepted_and_used_in_the_forecast() {
    let mut body = example("track");
    let back = json!({ "kind": "waypoints", "points": [[50, 20], [0, 20], [0, 60]], "fillet_m": 5 });
    body["auvs"][0]["path"] = json!({ "segments": [lane(), turn(), back], "speed_mps": 0.193 });
    body["forecast"] = json!("path");
    let answer = planned(body.to_string()).await.expected(200);
    assert_eq!(answer["targets"][0]["forecast"], "path");
}

#[tokio::test(start_paused = true)]
async fn an_invalid_path_is_located() {
    let mut body = example("track");
    body["auvs"][0]["path"] = json!({ "segments": [lane()], "speed_mps": 0.193 });
    let at = "/auvs/0/path/segments";
    let corner = |fillet: f64| json!([{ "kind": "waypoints", "points": [[0, 0], [9, 0], [9, 9]], "fillet_m": fillet }]);
    let (kink, wide, negative) = (corner(0.0), corner(9.1), corner(-1.0));
    let mut gap = turn();
    gap["from"] = json!([50.5, 0.0]);
    let (gap, twice) = (json!([lane(), gap]), json!([turn(), turn()]));
    let long = json!([{ "kind": "waypoints", "points": vec![[0, 0]; 10_001], "fillet_m": 0 }]);
    let table = format!(
        r#"
        {at}  []          length
        {at}  {gap}       gap           {at}/1
        {at}  {twice}     gap           {at}/1
        {at}  {kink}      kink          {at}/0/points/1
        {at}  {wide}      fillet        {at}/0/points/1
        {at}  {negative}  out_of_range  {at}/0/fillet_m
        {at}  {long}      length
        {at}/0/to         [2e6,0]       out_of_range  {at}/0/to/0
        {at}/0/to         absent        missing
        {at}/0/angle_rad  1             unknown_field
        {at}/0/from       [1,2,3]       length
        {at}/0/from       {{"north_m":1}}  wrong_type
        /auvs/0/path/speed_mps  0       out_of_range  0.01..10
    "#
    );
    assert_refused(&body, &table).await;
    body["auvs"][0]["path"]["segments"] = wide;
    let error = planned(body.to_string()).await.problem()["errors"][0].clone();
    assert_eq!(error["given"], 9.1);
    let most = error["limit"]["most"].as_f64().expect("a number");
    // One right angle on legs of 9 m.
    assert!((most - 9.0).abs() < 1e-9);
}

#[tokio::test(start_paused = true)]
async fn invalid_bounds_and_dives_are_located() {
    let mut body = example("track");
    body["auvs"][0]["dive"] = json!({ "depth_min_m": 1.0, "depth_max_m": 23.0, "pitch_rad": 0.873 });
    let disc = |radius: f64| json!({ "north_m": 0.0, "east_m": 0.0, "radius_m": radius });
    let (flat, many) = (json!([disc(1.0), disc(0.0)]), json!(vec![disc(1.0); 33]));
    let corners = json!(vec![[0, 0]; 65]);
    let table = format!(
        r#"
        /keep_outs               {flat}                           out_of_range  /keep_outs/1/radius_m
        /keep_outs               {many}                           length
        /keep_outs               [{{"north_m":0,"radius_m":1}}]   missing       /keep_outs/0/east_m
        /keep_outs               [[0,0,1]]                        wrong_type    /keep_outs/0
        /area                    [[0,0],[9,0]]                    length
        /area                    {corners}                        length
        /area                    [[0,0],[9,0],[9,9,0]]            length        /area/2
        /area                    [[0,0],[9,0],[9,2e6]]            out_of_range  /area/2/1
        /area                    [[0,0],[9,0],[5,2],[9,9],[0,9]]  not_convex    /area/2
        /area                    [[0,0],[9,0],[9,9],[0,0]]        too_near      /area/0
        /area                    [[0,0],[9,0],[18,0]]             too_narrow
        /acoustics               {{}}                             missing       /acoustics/range_max_m
        /acoustics/range_max_m   30000                            out_of_range  1..20000
        /surfacing_separation_m  0.4                              out_of_range
        /tuning/position_weight_per_m2            0               out_of_range  0.01..10
        /tuning/scp_iterations                    2.5             wrong_type
        /tuning/steps_s                           [10]            length        2..120
        /tuning/steps_s                           [1,1]           out_of_range  5..600
        /tuning/steps_s                           [9,0.05]        out_of_range  /tuning/steps_s/1
        /tuning  {{"scp_iterations":10,"steps_s":[1,1,1,1,1,1,1,1,1,1,1,1,1,1,1,1,1,1,1,1,1,1,1,1,1,1,1,1,1,1,1]}}  out_of_range  /tuning/scp_iterations
        /tuning/slack                             1               unknown_field
        /auvs/0/dive/depth_min_m  -0.1                            out_of_range  0..11999.5
        /auvs/0/dive/depth_max_m  1.4                             out_of_range  1.5..12000
    "#
    );
    assert_refused(&body, &table).await;
}

#[tokio::test(start_paused = true)]
async fn another_version_and_long_metadata_are_refused_together() {
    let mut body = example("track");
    body["schema_version"] = json!("2.0");
    body["metadata"] = json!({ "long": "x".repeat(5000) });
    let (version, metadata) = (fault("/schema_version", "unsupported"), fault("/metadata", "length"));
    let answer = planned(body.to_string()).await;
    assert_eq!(answer.faults(), [version, metadata].concat());
}

#[tokio::test(start_paused = true)]
async fn a_huge_list_is_not_compared_and_a_long_name_not_repeated_in_full() {
    let names: Vec<_> = (0..50_000).map(|i| i.to_string()).collect();
    for (goal, pointer, code) in [
        (json!({ "kind": "midpoint", "auvs": names }), "/goal/auvs", "length"),
        (json!({ "kind": "track", "auv": "x".repeat(100_000) }), "/goal/auv", "unknown_vehicle"),
    ] {
        let mut body = example("track");
        body["goal"] = goal;
        let answer = planned(body.to_string()).await;
        assert_eq!(answer.faults(), fault(pointer, code));
        assert!(answer.text.len() < 2_000);
    }
}

#[tokio::test(start_paused = true)]
async fn a_body_in_another_type_coding_or_character_set_is_refused() {
    for (name, value, said) in [
        ("content-encoding", "gzip", "gzip"),
        ("content-encoding", "identity, br", "br"),
        ("content-type", "application/json; charset=utf-16", "utf-16"),
        ("content-type", "application/json; Charset=\"latin1\"", "latin1"),
    ] {
        let answer = with_header(simulated_machine(), name, value).await;
        answer.must_be(415);
        let detail = answer.problem()["detail"].to_string();
        assert!(detail.contains(said), "{detail}");
    }
    for other in ["text/plain", "application/x-www-form-urlencoded"] {
        let answer = with_header(simulated_machine(), "content-type", other).await;
        answer.must_refuse(415, "unsupported_media_type");
    }
    for (name, value) in
        [("content-encoding", "Identity"), ("content-type", "application/json;charset=\"UTF-8\"")]
    {
        with_header(simulated_machine(), name, value).await.must_be(200);
    }
    let mut untyped = post("/v1/plan", EXAMPLES[0].body);
    untyped.headers_mut().clear();
    let answer = send(simulated_machine(), untyped).await;
    answer.must_refuse(415, "unsupported_media_type");
}

#[tokio::test(start_paused = true)]
async fn a_body_of_over_a_mebibyte_is_refused() {
    let answer = planned(" ".repeat(service::BODY_BYTES_MAX + 1)).await;
    answer.must_refuse(413, "body_too_large");
    // All of a mebibyte is read.
    planned(" ".repeat(service::BODY_BYTES_MAX)).await.must_be(400);
    // Refused before it is read.
    let long = (service::BODY_BYTES_MAX + 1).to_string();
    let announced = with_header(simulated_machine(), "content-length", &long).await;
    announced.must_refuse(413, "body_too_large");
}

/// The service's whole answer to the bytes of `request`, until it closes the connection.
async fn said(settings: Settings, request: &str) -> String {
    let (mut client, connection) = duplex(1 << 17);
    let service = TowerToHyperService::new(app(settings));
    let serve = http1::Builder::new().serve_connection(TokioIo::new(connection), service);
    client.write_all(request.as_bytes()).await.expect("has room");
    let mut answer = String::new();
    // The client gets an error of the connection before that.
    let (_, read) = tokio::join!(serve, client.read_to_string(&mut answer));
    read.expect("answers and closes");
    answer
}

#[tokio::test(start_paused = true)]
async fn a_slow_body_is_refused_before_planning() {
    const LIMIT: Duration = Duration::from_millis(50);
    let settings = Settings { body_time_limit: LIMIT, ..simulated_machine() };
    let half = "POST /v1/plan HTTP/1.1\r\nhost: localhost\r\ncontent-type: application/json\r\n\
        content-length: 100\r\n\r\n{";
    let clock = settings.clock.clone();
    let start = clock.now();
    let answer = said(settings, half).await;
    assert_eq!(clock.since(start), LIMIT);
    assert!(answer.starts_with("HTTP/1.1 408 "), "{answer}");
    for part in ["connection: close", "application/problem+json", r#""code":"body_timed_out""#] {
        assert!(answer.contains(part), "{answer}");
    }
}

#[tokio::test(start_paused = true)]
async fn a_body_slower_than_the_deadline_is_answered_by_a_lower_level() {
    let settings = Settings { deadline: Duration::from_millis(50), ..simulated_machine() };
    let clock = settings.clock.clone();
    let (head, tail) = EXAMPLES[0].body.split_at(20);
    let late = stream::once(async move {
        clock.sleep(Duration::from_millis(200)).await;
        Ok::<_, std::io::Error>(tail)
    });
    let pieces = Body::from_stream(stream::iter([Ok(head)]).chain(late));
    let answer = send(settings, post("/v1/plan", pieces)).await.expected(200);
    assert_eq!(answer["reason"], "deadline");
}

#[tokio::test(start_paused = true)]
async fn a_body_of_too_many_pieces_is_refused_even_if_they_are_short() {
    for (n_pieces, status) in [(8_000, 200), (9_000, 400)] {
        let spaces = (1..n_pieces).map(|_| " ");
        let pieces = spaces.chain([EXAMPLES[0].body]).map(Ok::<_, std::io::Error>);
        planned(Body::from_stream(stream::iter(pieces))).await.must_be(status);
    }
}

#[tokio::test(start_paused = true)]
async fn an_unknown_route_and_an_unknown_example_are_not_found() {
    let answer = send(simulated_machine(), get("/v2/plan")).await;
    answer.must_refuse(404, "no_route");
    assert_eq!(answer.problem()["instance"], "/v2/plan");
    for path in ["/v1/examples/nothing", "/v1/examples/%ff"] {
        let answer = send(simulated_machine(), get(path)).await;
        answer.must_be(404);
        let detail = answer.problem()["detail"].to_string();
        assert!(detail.contains("GET /v1/examples"), "{detail}");
    }
}

#[tokio::test(start_paused = true)]
async fn a_wrong_method_is_answered_with_the_right_ones() {
    for (method, path, allowed) in [
        ("GET", "/v1/plan", "POST"),
        ("DELETE", "/v1/examples", "GET,HEAD"),
        ("POST", "/", "GET,HEAD"),
        ("PUT", "/openapi.json", "GET,HEAD"),
    ] {
        let answer = send(simulated_machine(), call(method, path)).await;
        answer.must_refuse(405, "method_not_allowed");
        assert_eq!(answer.header("allow"), allowed, "{path}");
    }
}

/// Asserts a refusal; `again`: of a request that may succeed later.
fn assert_refusal(answer: &Answer, status: u16, code: &str, again: bool) {
    answer.must_refuse(status, code);
    assert_eq!(answer.header("retry-after"), if again { "1" } else { "" });
}

#[tokio::test(start_paused = true)]
async fn a_request_beyond_the_queue_is_refused_and_the_others_are_answered() {
    let settings = Settings { planners: 1, waiting: 1, ..simulated_machine() };
    settings.clock.delay_threads(Duration::from_millis(300));
    let service = app(settings);
    let asked = (0..3).map(|_| send_to(service.clone(), post("/v1/plan", EXAMPLES[0].body)));
    let answers = futures_util::future::join_all(asked).await.into_iter();
    let (served, turned_away): (Vec<_>, Vec<_>) = answers.partition(|answer| answer.status == 200);
    assert_eq!((served.len(), turned_away.len()), (2, 1));
    assert_refusal(&turned_away[0], 503, "overloaded", true);
}

#[tokio::test(start_paused = true)]
async fn a_deadline_too_short_for_an_iteration_is_refused_without_a_fallback() {
    let mut strict = example("track");
    strict["fallback"] = json!("none");
    strict["deadline_ms"] = json!(20.0);
    let settings = simulated_machine();
    settings.clock.delay_threads(Duration::from_millis(30));
    let answer = send(settings, post("/v1/plan", strict.to_string())).await;
    assert_refusal(&answer, 504, "timed_out", true);
}

#[tokio::test(start_paused = true)]
async fn a_panic_is_a_problem_document_and_the_next_request_is_served() {
    let mut settings = Settings { planners: 1, waiting: 0, ..simulated_machine() };
    settings.plan = |snapshot, parameters, workspace, stop| {
        assert!(snapshot.asc.position().x < 1e3, "on purpose");
        plan_until(snapshot, parameters, workspace, stop)
    };
    let service = app(settings);
    let mut far = example("track");
    far["asc"]["north_m"] = json!(2e3);
    let answer = send_to(service.clone(), post("/v1/plan", far.to_string())).await;
    answer.must_refuse(500, "internal");
    assert!(!answer.text.contains("on purpose"));
    let next = send_to(service, post("/v1/plan", EXAMPLES[0].body)).await;
    next.must_be(200);
}

/// The planner, with a solver that ran out of iterations.
fn gives_up(snapshot: &Snapshot, parameters: &Parameters, workspace: &mut Workspace, stop: &Stop) -> Plan {
    let plan = plan_until(snapshot, parameters, workspace, stop);
    Plan { degraded: Some(Degraded::Solver(SolverStatus::MaxIterations)), ..plan }
}

#[tokio::test(start_paused = true)]
async fn the_client_chooses_a_fallback_or_a_refusal_without_a_solution() {
    let settings = Settings { plan: gives_up, ..simulated_machine() };
    let degraded = send(settings.clone(), post("/v1/plan", EXAMPLES[0].body)).await;
    let degraded = degraded.expected(200);
    assert_eq!(
        (&degraded["outcome"], &degraded["reason"]),
        (&json!("degraded"), &json!("solver_max_iterations"))
    );
    let mut strict = example("track");
    strict["fallback"] = json!("none");
    let refused = send(settings.clone(), post("/v1/plan", strict.to_string())).await;
    assert_refusal(&refused, 503, "no_solution", false);
    refused.must_say("solver_max_iterations");
    // A service whose planner gives up is not ready.
    let answer = send(settings, get("/readyz")).await;
    assert_refusal(&answer, 503, "not_ready", false);
}

#[tokio::test(start_paused = true)]
async fn readiness_is_tested_again_after_a_second() {
    static GIVES_UP: AtomicBool = AtomicBool::new(false);
    let mut settings = simulated_machine();
    settings.plan = |snapshot, parameters, workspace, stop| {
        let plan = if GIVES_UP.load(Ordering::Relaxed) { gives_up } else { plan_until };
        plan(snapshot, parameters, workspace, stop)
    };
    let clock = settings.clock.clone();
    let service = app(settings);
    let ready = async || send_to(service.clone(), get("/readyz")).await.status;
    assert_eq!(ready().await, StatusCode::OK);
    GIVES_UP.store(true, Ordering::Relaxed);
    clock.sleep(Duration::from_millis(999)).await;
    assert_eq!(ready().await, StatusCode::OK, "the verdict is kept");
    clock.sleep(Duration::from_millis(1)).await;
    assert_eq!(ready().await, StatusCode::SERVICE_UNAVAILABLE);
}

#[tokio::test(start_paused = true)]
async fn another_origin_and_another_host_get_a_reason() {
    let settings = || Settings { hosts: Some(Hosts::default()), ..simulated_machine() };
    let asked = async |name: &'static str, value: &'static str| {
        let here = with(post("/v1/plan", EXAMPLES[0].body), "host", "localhost:8080");
        send(settings(), with(here, name, value)).await
    };
    asked("origin", "http://localhost:8080").await.must_be(200);
    let foreign = asked("origin", "http://evil.example").await;
    foreign.must_refuse(403, "cross_site");
    let rebound = asked("host", "evil.example").await;
    rebound.must_be(421);
    rebound.must_say("--allow-host evil.example");
    let nameless = send(settings(), post("/v1/plan", EXAMPLES[0].body)).await;
    nameless.must_refuse(400, "host_header");
}
