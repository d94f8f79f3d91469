//! Changes of a live mission's goal, limits, craft, keep-outs and area while it runs.

use axum::http::{HeaderValue, Method, StatusCode, header};
use serde_json::{Value, json};
use sim::scenario::Scenario;
use tests::client::{Answer, get, post, send_to};
use tower::ServiceExt as _;

use super::{Service, heard, live, read, simulated};

impl Service {
    async fn patch_keyed(&self, mission: &str, body: &Value, key: Option<&'static str>) -> Answer {
        let mut request = post(mission, body.to_string());
        *request.method_mut() = Method::PATCH;
        let merge_patch = HeaderValue::from_static("application/merge-patch+json");
        request.headers_mut().insert(header::CONTENT_TYPE, merge_patch);
        if let Some(key) = key {
            let key = HeaderValue::from_static(key);
            request.headers_mut().insert("idempotency-key", key);
        }
        send_to(self.router.clone(), request).await
    }

    async fn patch(&self, mission: &str, body: &Value) -> Answer {
        self.patch_keyed(mission, body, None).await
    }

    /// Changes the mission, and returns it.
    async fn change(&self, mission: &str, body: Value) -> Value {
        let changed = self.patch(mission, &body).await;
        assert_eq!(changed.status, StatusCode::OK, "{}", changed.text);
        changed.json()
    }

    async fn run_live(&self) -> String {
        let mission = self.create(&live()).await;
        self.order(&mission, "run", json!({})).await;
        mission
    }

    /// The next plan after new reports of the vehicles.
    async fn next_plan(&self, mission: &str) -> Value {
        let now = self.mission_now(&self.ask(mission).await);
        let accepted = self.order(mission, "reports", heard(now)).await;
        let sequence = &accepted["sequence"];
        let next = format!("{mission}/reference?wait_s=10&after={sequence}");
        let planned = self.ask(&next).await;
        assert!(sequence.as_u64() < planned["sequence"].as_u64(), "{planned}");
        planned["plan"].clone()
    }
}

/// Goal at the time of the plan, (north, east), m.
fn goal_of(plan: &Value) -> [f64; 2] {
    let point = &plan["goal"]["trajectory"][0];
    ["north_m", "east_m"].map(|axis| point[axis].as_f64().expect("is a number"))
}

/// Least distance of the planned trajectory from (north, east), m.
fn nearest(plan: &Value, [north, east]: [f64; 2]) -> f64 {
    let points = plan["trajectory"].as_array().expect("is a list").iter();
    let coordinate = |point: &Value, axis| point[axis].as_f64().expect("is a number");
    points
        .map(|point| (coordinate(point, "north_m") - north).hypot(coordinate(point, "east_m") - east))
        .fold(f64::INFINITY, f64::min)
}

fn track(auv: &str) -> Value {
    json!({ "kind": "track", "auv": auv })
}

fn route(points: &[[f64; 2]]) -> Value {
    json!({ "segments": [{ "kind": "waypoints", "points": points }], "closed": false, "speed_mps": 0.2 })
}

#[tokio::test(start_paused = true)]
async fn every_plan_after_a_change_follows_it_and_all_replay_equal() {
    let service = Service::start().await;
    let mission = service.run_live().await;
    let made = service.ask(&mission).await;
    assert_eq!(
        made["setting"],
        json!({ "goal": live()["live"]["goal"], "limits": null, "craft": null, "keep_outs": null, "area": null, "tuning": null })
    );
    let before = service.next_plan(&mission).await;
    let [north, east] = goal_of(&before);
    assert!(
        (north - 10.0).hypot(east) < 1.0,
        "above the midpoint: {north}, {east}"
    );

    let changed = service.change(&mission, json!({ "goal": track("auv-2") })).await;
    assert_eq!(changed["setting"]["goal"], track("auv-2"));
    let after = service.next_plan(&mission).await;
    let [north, east] = goal_of(&after);
    assert!(
        (north - 10.0).hypot(east - 20.0) < 1.0,
        "above auv-2: {north}, {east}"
    );
    // The heading turns there from its former value: 9.7° a second of the mission's clock.
    let heading = |plan: &Value| plan["reference"]["heading_rad"].as_f64().expect("is a number");
    let turned = heading(&after) - heading(&before);
    assert!((0.05..1.4).contains(&turned), "to starboard, {turned} rad");

    let disc = json!({ "north_m": 5.0, "east_m": 10.0, "radius_m": 4.0 });
    let straight = nearest(&after, [5.0, 10.0]);
    assert!(straight < 4.0, "the way there leads through the disc: {straight}");
    let changed = service.change(&mission, json!({ "keep_outs": [disc] })).await;
    let around = service.next_plan(&mission).await;
    assert!(3.9 < nearest(&around, [5.0, 10.0]), "{around}");
    assert_eq!(
        changed["setting"]["goal"],
        track("auv-2"),
        "what is left out stays"
    );

    service
        .change(
            &mission,
            json!({ "limits": { "speed_max_mps": 0.3 }, "area": [[-90, -90], [90, -90], [0, 90]] }),
        )
        .await;
    let slower = service.next_plan(&mission).await;
    let speed = slower["reference"]["speed_mps"].as_f64().expect("is a number");
    assert!(speed <= 0.3, "{speed}");

    let changed = service
        .change(
            &mission,
            json!({ "keep_outs": [], "area": null, "limits": null, "goal": track("auv-1") }),
        )
        .await;
    assert_eq!(
        changed["setting"],
        json!({ "goal": track("auv-1"), "limits": null, "craft": null, "keep_outs": null, "area": null, "tuning": null })
    );
    let last = service.next_plan(&mission).await;
    assert!(goal_of(&last)[1] < -19.0, "{last}");
    service.order(&mission, "finish", json!({})).await;
    assert!(5 <= service.n_replayed(&mission));
}

#[tokio::test(start_paused = true)]
async fn another_craft_starts_without_the_estimates_of_the_previous_one() {
    let service = Service::start().await;
    let mission = service.run_live().await;
    let lag = |plan: &Value| plan["craft_estimate"]["heading_lag_s"].clone();
    let first = service.next_plan(&mission).await;
    let craft = json!({ "preset": "medusa", "relative_uncertainty": 0.0 });
    let changed = service.change(&mission, json!({ "craft": craft })).await;
    assert_eq!(changed["setting"]["craft"], craft);
    let certain = service.next_plan(&mission).await;
    // A lag that is certain is still that of a loop which is not quite of first order.
    let sigma = |plan: &Value| lag(plan)["sigma"].as_f64().expect("is a number");
    assert!(
        sigma(&certain) < 0.2 && 0.2 < sigma(&first),
        "{} {}",
        lag(&certain),
        lag(&first)
    );
    service.change(&mission, json!({ "craft": null })).await;
    let unknown = service.next_plan(&mission).await;
    assert_eq!(
        lag(&unknown),
        lag(&first),
        "nothing that the other one was said to be is left"
    );
    service.order(&mission, "finish", json!({})).await;
    assert!(3 <= service.n_replayed(&mission));
}

#[tokio::test(start_paused = true)]
async fn a_change_is_an_event_in_streams_and_records() {
    let service = Service::start().await;
    let mission = service.create(&live()).await;
    let goal = json!({ "goal": track("auv-1"), "keep_outs": null });
    assert_eq!(service.change(&mission, goal).await["sequence"], 2);
    let disc = json!({ "north_m": 50.0, "east_m": 0.0, "radius_m": 4.0 });
    service.change(&mission, json!({ "keep_outs": [disc] })).await;
    // A change without effect is no event.
    let again = service.change(&mission, json!({ "goal": track("auv-1") })).await;
    assert_eq!(again["sequence"], 3);
    service.order(&mission, "finish", json!({})).await;

    let events = service.record(&mission).await;
    let changes: Vec<_> = events[1..3]
        .iter()
        .map(|event| (&event["kind"], &event["setting"], &event["replaced"]))
        .collect();
    let before = live()["live"]["goal"].clone();
    assert_eq!(
        changes,
        [
            (
                &json!("changed"),
                &json!({ "goal": track("auv-1"), "keep_outs": null }),
                &json!({ "goal": before, "keep_outs": null })
            ),
            (
                &json!("changed"),
                &json!({ "keep_outs": [disc] }),
                &json!({ "keep_outs": null })
            ),
        ]
    );
    let stream = get(&format!("{mission}/events?after=0"));
    let text = read(&service.router, stream, |_| false).await;
    assert_eq!(text.matches("event: changed").count(), 2, "{text}");
    let table = service.get(&format!("{mission}/record?format=csv")).await;
    assert_eq!(table.text.matches(",changed,").count(), 2, "{}", table.text);
    for format in ["ndjson", "parquet", "mcap"] {
        let record = get(&format!("{mission}/record?format={format}"));
        let record = service.router.clone().oneshot(record).await;
        let record = record.expect("answers");
        assert_eq!(record.status(), StatusCode::OK, "{format}");
        let body = axum::body::to_bytes(record.into_body(), 1 << 20)
            .await
            .expect("ends");
        assert!(body.windows(7).any(|piece| piece == b"changed"), "{format}");
    }
}

#[tokio::test(start_paused = true)]
async fn an_invalid_patch_is_refused_with_its_fault_s_place_and_changes_nothing() {
    let service = Service::start().await;
    let mission = service.create(&live()).await;
    let before = service.ask(&mission).await;
    let disc = json!({ "north_m": 0.0, "east_m": 0.0, "radius_m": 4.0 });
    let along_a_path = json!({ "kind": "track", "auv": "auv-1",
        "offset": { "frame": "path", "ahead_m": 1.0, "starboard_m": 1.0 } });
    for (body, pointer, code) in [
        (json!({}), "", "missing"),
        (json!({ "goals": track("auv-1") }), "/goals", "unknown_field"),
        (json!({ "auvs": [] }), "/auvs", "unknown_field"),
        (json!({ "goal": null }), "/goal", "wrong_type"),
        (json!({ "goal": track("auv-3") }), "/goal/auv", "unknown_vehicle"),
        (json!({ "goal": { "kind": "track" } }), "/goal/auv", "missing"),
        (json!({ "goal": along_a_path }), "/goal/offset/frame", "no_path"),
        (
            json!({ "goal": track("auv-1"), "craft": { "preset": "raft" } }),
            "/craft/preset",
            "unknown_preset",
        ),
        (
            json!({ "craft": { "surge_loop": { "delay_s": 11.0 } } }),
            "/craft/surge_loop/delay_s",
            "out_of_range",
        ),
        (
            json!({ "limits": { "speed_min_mps": 0.5, "speed_max_mps": 0.4 } }),
            "/limits/speed_max_mps",
            "out_of_range",
        ),
        (
            json!({ "keep_outs": [disc, { "north_m": 0.0, "east_m": 0.0, "radius_m": 0.0 }] }),
            "/keep_outs/1/radius_m",
            "out_of_range",
        ),
        (
            json!({ "keep_outs": vec![disc.clone(); 33] }),
            "/keep_outs",
            "length",
        ),
        (json!({ "area": [[0, 0], [0, 1]] }), "/area", "length"),
        (json!({ "paths": {} }), "", "missing"),
        (
            json!({ "paths": { "auv-3": null } }),
            "/paths/auv-3",
            "unknown_auv",
        ),
        (
            json!({ "paths": { "auv-2": route(&[[0.0, 0.0], [0.0, 0.01]]) } }),
            "/paths/auv-2/segments/0/points",
            "one_place",
        ),
        (
            json!({ "area": [[0, 0], [0, 9], [9, 0], [9, 9]] }),
            "/area/0",
            "not_convex",
        ),
    ] {
        let refused = service.patch(&mission, &body).await;
        assert_eq!(refused.status, StatusCode::UNPROCESSABLE_ENTITY, "{body}");
        assert_eq!(
            refused.faults()[0],
            (pointer.to_owned(), code.to_owned()),
            "{body}"
        );
    }
    assert_eq!(service.ask(&mission).await, before);
}

#[tokio::test(start_paused = true)]
async fn a_mission_that_is_simulated_over_or_unknown_is_not_changed() {
    let service = Service::start().await;
    let change = json!({ "keep_outs": [] });
    let unreal = service.create(&simulated("paper-tracking")).await;
    let refused = service.patch(&unreal, &change).await;
    assert_eq!(refused.status, StatusCode::CONFLICT);
    assert!(refused.text.contains("scenario_file"), "{}", refused.text);
    assert_eq!(service.ask(&unreal).await["setting"], Value::Null);

    let over = service.create(&live()).await;
    service.order(&over, "finish", json!({})).await;
    let refused = service.patch(&over, &json!({ "goal": track("auv-1") })).await;
    assert_eq!(refused.status, StatusCode::CONFLICT);
    assert!(refused.text.contains("is over"), "{}", refused.text);
    let unknown = service.patch("/v1/missions/unknown", &change).await;
    assert_eq!(unknown.problem()["code"], "no_mission");
}

#[tokio::test(start_paused = true)]
async fn a_repeated_patch_with_its_key_is_carried_out_once() {
    let service = Service::start().await;
    let mission = service.create(&live()).await;
    let (one, other) = (
        json!({ "goal": track("auv-1") }),
        json!({ "goal": track("auv-2") }),
    );
    let first = service.patch_keyed(&mission, &one, Some("to 1")).await;
    assert_eq!(first.json()["sequence"], 2);
    service.change(&mission, other.clone()).await;
    let service = service.restart().await;
    let again = service.patch_keyed(&mission, &one, Some("to 1")).await;
    assert_eq!((again.status, again.json()), (StatusCode::OK, first.json()));
    let taken = service.patch_keyed(&mission, &other, Some("to 1")).await;
    assert_eq!(taken.problem()["code"], "idempotency_key_taken");
    let now = service.ask(&mission).await;
    assert_eq!(
        (&now["sequence"], &now["setting"]["goal"]),
        (&json!(3), &track("auv-2"))
    );
}

#[tokio::test(start_paused = true)]
async fn a_restart_keeps_a_change_with_or_without_a_plan_since() {
    let mut service = Service::start().await;
    let mission = service.run_live().await;
    service.next_plan(&mission).await;
    for (auv, east, waits) in [("auv-2", 20.0, false), ("auv-1", -20.0, true)] {
        let changed = service.change(&mission, json!({ "goal": track(auv) })).await;
        if waits {
            service.next_plan(&mission).await;
        }
        service = service.restart().await;
        assert_eq!(service.ask(&mission).await["setting"], changed["setting"]);
        let plan = service.next_plan(&mission).await;
        assert!(
            (goal_of(&plan)[1] - east).abs() < 1.0,
            "{auv}: {:?}",
            goal_of(&plan)
        );
    }
    service.order(&mission, "finish", json!({})).await;
    assert!(4 <= service.n_replayed(&mission));
}

#[tokio::test(start_paused = true)]
async fn a_replaced_route_of_an_auv_survives_a_restart() {
    let mut service = Service::start().await;
    // Its fixes do not move: the planner alone would hold it.
    let mut along_paths = live();
    along_paths["live"]["forecast"] = json!("path");
    let mission = service.create(&along_paths).await;
    service.order(&mission, "run", json!({})).await;
    let forecasts = |plan: &Value| {
        let targets = plan["targets"].as_array().expect("is a list").iter();
        targets
            .map(|target| target["forecast"].clone())
            .collect::<Vec<_>>()
    };
    assert!(!forecasts(&service.next_plan(&mission).await).contains(&json!("path")));
    let (first, second) = (
        route(&[[10.0, -20.0], [90.0, -20.0]]),
        route(&[[10.0, -20.0], [10.0, -90.0], [20.0, -90.0]]),
    );
    for (k, path) in [&first, &second].into_iter().enumerate() {
        let changed = service
            .change(&mission, json!({ "paths": { "auv-1": path } }))
            .await;
        assert_eq!(changed["setting"].get("paths"), None);
        if k == 0 {
            service.next_plan(&mission).await;
        }
        service = service.restart().await;
        let scene = service.ask(&format!("{mission}/scene")).await;
        let paths = scene["paths"].as_object().expect("is one");
        let last = paths["auv-1"]
            .as_array()
            .and_then(|points| points.last())
            .expect("is long");
        let at = [0, 1].map(|axis| last[axis].as_f64().expect("is a number"));
        let end: [f64; 2] = [[90.0, -20.0], [20.0, -90.0]][k];
        assert!(
            paths.len() == 1 && (at[0] - end[0]).hypot(at[1] - end[1]) < 0.01,
            "{at:?}"
        );
        assert_eq!(forecasts(&service.next_plan(&mission).await)[0], "path");
    }
    service
        .change(&mission, json!({ "paths": { "auv-1": null } }))
        .await;
    assert!(!forecasts(&service.next_plan(&mission).await).contains(&json!("path")));
    service.order(&mission, "finish", json!({})).await;
    let events = service.record(&mission).await;
    let changes = events.iter().filter(|event| event["kind"] == "changed");
    let replaced: Vec<_> = changes
        .map(|event| event["replaced"]["paths"]["auv-1"].clone())
        .collect();
    let stored = |path: &Value| serde_json::from_value::<wire::DeclaredPath>(path.clone()).expect("is one");
    assert_eq!(replaced[0], Value::Null);
    assert_eq!(
        [&replaced[1], &replaced[2]].map(stored),
        [&first, &second].map(stored)
    );
    assert!(5 <= service.n_replayed(&mission));
}

#[tokio::test(start_paused = true)]
async fn a_route_file_is_read_or_refused_by_line() {
    let service = Service::start().await;
    let read = async |query: &str, file: &str| {
        send_to(
            service.router.clone(),
            post(&format!("/v1/routes{query}"), file.to_owned()),
        )
        .await
    };
    let file = "lat,lon,speed_mps,route\n38.41,-9.12,1.5,a\n38.42,-9.12,1.5,a\n38.41,-9.12,1.5,b\n";
    let answer = read("?name=a", file).await;
    assert_eq!(answer.status, StatusCode::OK, "{}", answer.text);
    let points = [38.41, 38.42].map(|lat| json!({ "lat_deg": lat, "lon_deg": -9.12 }));
    let segment = json!({ "kind": "waypoints", "points": points });
    let path = json!({ "segments": [segment], "closed": false, "speed_mps": 1.5 });
    assert_eq!(
        answer.json(),
        json!({ "name": "a", "points": points, "speed_mps": 1.5, "path": path })
    );
    // The path is one that a mission takes.
    let mut body = live();
    body["live"]["origin"] = json!({ "lat_deg": 38.41, "lon_deg": -9.12 });
    body["live"]["auvs"][0]["path"] = path;
    service.create(&body).await;
    assert_eq!(
        read("", "format=lawnmower,x=0,y=0,width=9,height=9,lane_width=3")
            .await
            .json()["points"]
            .as_array()
            .map(Vec::len),
        Some(8)
    );
    for (query, file, detail) in [
        ("", file, "\"a\", \"b\""),
        ("?name=c", file, "is not in the file"),
        ("", "lat,lon\n38,-9\n91,-9\n", "line 3: latitude 91"),
        ("", "", "is empty"),
    ] {
        let refused = read(query, file).await;
        assert_eq!(refused.status, StatusCode::UNPROCESSABLE_ENTITY, "{file}");
        assert!(
            refused.text.contains(&detail.replace('"', "\\\"")),
            "{}",
            refused.text
        );
    }
}

#[tokio::test(start_paused = true)]
async fn the_levers_of_a_mission_make_its_plans_and_can_be_changed() {
    let points = |plan: &Value| plan["trajectory"].as_array().expect("is a list").len();
    let steps = json!({ "steps_s": [1, 1, 2, 2, 4] });
    let service = Service::start().await;
    let mission = service.run_live().await;
    assert_eq!(points(&service.next_plan(&mission).await), 31);
    let changed = service.change(&mission, json!({ "tuning": steps })).await;
    assert_eq!(
        changed["setting"]["tuning"],
        json!({ "steps_s": [1.0, 1.0, 2.0, 2.0, 4.0] })
    );
    assert_eq!(points(&service.next_plan(&mission).await), 6);
    let refused = service
        .patch(&mission, &json!({ "tuning": { "steps_s": [1, 1] } }))
        .await;
    assert_eq!(refused.problem()["errors"][0]["pointer"], "/tuning/steps_s");
    service.change(&mission, json!({ "tuning": null })).await;
    assert_eq!(points(&service.next_plan(&mission).await), 31);
    let plan_of = async |mut simulated: Value| {
        simulated["seed"] = json!(1);
        let body = json!({ "schema_version": "1.0", "simulated": simulated });
        let mission = service.create(&body).await;
        service.order(&mission, "step", json!({ "ticks": 1 })).await;
        service.ask(&format!("{mission}/reference")).await["plan"].clone()
    };
    let usual = plan_of(json!({ "scenario": "switching" })).await;
    let tuned = plan_of(json!({ "scenario": "switching", "tuning": steps })).await;
    assert_eq!((points(&usual), points(&tuned)), (31, 6));
    assert_ne!(
        usual["plan_id"], tuned["plan_id"],
        "they are asked for something else"
    );
    let with = |line: &str| {
        let text = Scenario::text("switching").expect("exists");
        let (before, after) = text.split_once("[surface_craft]\n").expect("has a craft");
        format!("{before}[surface_craft]\n{line}\n{after}")
    };
    let file = |steps: &str| with(&format!("tuning.steps_s = {steps}"));
    let from_file = plan_of(json!({ "scenario_file": file("[1, 1, 2, 2, 4]") })).await;
    assert_eq!(from_file["plan_id"], tuned["plan_id"]);
    let replaced = json!({ "scenario_file": file("[2, 2, 2]"), "tuning": steps });
    assert_eq!(plan_of(replaced).await["plan_id"], tuned["plan_id"]);
    let numbers = with("parameters.estimate.gate = 9.2");
    for (wrong, key) in [
        (file("[1, 1]"), "surface_craft.tuning.steps_s"),
        (numbers, "surface_craft.parameters"),
    ] {
        let wrong = json!({ "schema_version": "1.0", "simulated": { "scenario_file": wrong } });
        let refused = service.post("/v1/missions", &wrong).await;
        assert_eq!(refused.status, StatusCode::UNPROCESSABLE_ENTITY);
        assert!(refused.text.contains(key), "{}", refused.text);
    }
}
