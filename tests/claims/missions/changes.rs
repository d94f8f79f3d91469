//! Changes of a live mission's goal, limits, craft, keep-outs and area while it runs.

use serde_json::{Value, json};
use sim::scenario::Scenario;
use tests::client::{get, post};
use tests::refusals::assert_refused;

use super::{Service, live, number, simulated, streams::read};

impl Service {
    async fn run_live(&self) -> String {
        let mission = self.create(&live()).await;
        self.order(&mission, "run", json!({})).await;
        mission
    }

    /// The next plan after new reports of the vehicles.
    async fn next_plan(&self, mission: &str) -> Value {
        let accepted = self.hear(mission).await;
        let next = self.reference_after(mission, &accepted["sequence"]).await;
        next["plan"].clone()
    }

    async fn finish(&self, mission: &str) {
        self.order(mission, "finish", json!({})).await;
    }
}

/// Goal at the time of the plan, (north, east), m.
fn goal_of(plan: &Value) -> [f64; 2] {
    let point = &plan["goal"]["trajectory"][0];
    ["north_m", "east_m"].map(|axis| number(&point[axis]))
}

/// Least distance of the planned trajectory from (north, east), m.
fn nearest(plan: &Value, [north, east]: [f64; 2]) -> f64 {
    let points = plan["trajectory"].as_array().expect("is a list").iter();
    let at = points.map(|point| [number(&point["north_m"]), number(&point["east_m"])]);
    at.fold(f64::INFINITY, |least, at| least.min((at[0] - north).hypot(at[1] - east)))
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
    let only_goal = |goal: Value| {
        json!({ "goal": goal, "limits": null, "craft": null, "keep_outs": null, "area": null, "no_go": null,
            "tuning": null, "vessel_separation_m": null })
    };
    let made = service.ask(&mission).await;
    assert_eq!(made["setting"], only_goal(live()["live"]["goal"].clone()));
    let is_near = |[north, east]: [f64; 2], expected: f64| {
        assert!((north - 10.0).hypot(east - expected) < 1.0, "{north}, {east}");
    };
    let before = service.next_plan(&mission).await;
    // The midpoint, then `auv-2`.
    is_near(goal_of(&before), 0.0);
    let changed = service.change(&mission, json!({ "goal": track("auv-2") })).await;
    assert_eq!(changed["setting"]["goal"], track("auv-2"));
    let after = service.next_plan(&mission).await;
    is_near(goal_of(&after), 20.0);
    // The heading turns there from its former value: 9.7° a second of the mission's clock.
    let heading = |plan: &Value| number(&plan["reference"]["heading_rad"]);
    let turned = heading(&after) - heading(&before);
    assert!((0.05..1.4).contains(&turned), "to starboard, {turned} rad");

    let disc = json!({ "north_m": 5.0, "east_m": 10.0, "radius_m": 4.0 });
    let straight = nearest(&after, [5.0, 10.0]);
    assert!(straight < 4.0, "the way there leads through the disc: {straight}");
    let changed = service.change(&mission, json!({ "keep_outs": [disc] })).await;
    let around = service.next_plan(&mission).await;
    assert!(3.9 < nearest(&around, [5.0, 10.0]), "{around}");
    // Members that are left out stay.
    assert_eq!(changed["setting"]["goal"], track("auv-2"));

    let slow = json!({ "limits": { "speed_max_mps": 0.3 }, "area": [[-90, -90], [90, -90], [0, 90]] });
    service.change(&mission, slow).await;
    let speed = number(&service.next_plan(&mission).await["reference"]["speed_mps"]);
    assert!(speed <= 0.3, "{speed}");

    let undone = json!({ "keep_outs": [], "area": null, "limits": null, "goal": track("auv-1") });
    let changed = service.change(&mission, undone).await;
    assert_eq!(changed["setting"], only_goal(track("auv-1")));
    let last = service.next_plan(&mission).await;
    assert!(goal_of(&last)[1] < -19.0, "{last}");
    service.finish(&mission).await;
    assert!(5 <= service.n_replayed(&mission));
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
    service.finish(&mission).await;

    let events = service.events(&mission).await;
    let before = live()["live"]["goal"].clone();
    let expected = json!([
        ["changed", { "goal": track("auv-1"), "keep_outs": null }, { "goal": before, "keep_outs": null }],
        ["changed", { "keep_outs": [disc] }, { "keep_outs": null }],
    ]);
    let changes = events[1..3].iter();
    let changes: Vec<_> =
        changes.map(|event| json!([event["kind"], event["setting"], event["replaced"]])).collect();
    assert_eq!(json!(changes), expected);
    let stream = get(&format!("{mission}/events?after=0"));
    let text = read(&service, stream).await;
    assert_eq!(text.matches("event: changed").count(), 2, "{text}");
    let table = service.get(&format!("{mission}/record?format=csv")).await;
    assert_eq!(table.text.matches(",changed,").count(), 2, "{}", table.text);
}

#[tokio::test(start_paused = true)]
async fn an_invalid_patch_is_refused_with_its_fault_s_place_and_changes_nothing() {
    let service = Service::start().await;
    let mission = service.create(&live()).await;
    let before = service.ask(&mission).await;
    let many = json!(vec![json!({ "north_m": 0.0, "east_m": 0.0, "radius_m": 4.0 }); 33]);
    let table = format!(
        r#"
        .  {{}}  missing
        /goals  {{"kind":"track","auv":"auv-1"}}  unknown_field
        /auvs  []  unknown_field
        /goal  null  wrong_type
        /goal  {{"kind":"track","auv":"auv-3"}}  unknown_vehicle  /goal/auv
        /goal  {{"kind":"track"}}  missing  /goal/auv
        /goal  {{"kind":"track","auv":"auv-1","offset":{{"frame":"path","ahead_m":1,"starboard_m":1}}}}  no_path  /goal/offset/frame
        .  {{"goal":{{"kind":"track","auv":"auv-1"}},"craft":{{"preset":"raft"}}}}  unknown_preset  /craft/preset
        /craft/surge_loop/delay_s  11  out_of_range
        /limits  {{"speed_min_mps":0.5,"speed_max_mps":0.4}}  out_of_range  /limits/speed_max_mps
        /limits  {{"surge_lag_s":100}}  out_of_range  /limits/surge_lag_s
        /keep_outs  [{{"north_m":0,"east_m":0,"radius_m":0}}]  out_of_range  /keep_outs/0/radius_m
        /keep_outs  {many}  length
        /area  [[0,0],[0,1]]  length
        /area  [[0,0],[0,9],[9,0],[9,9]]  not_convex  /area/0
        .  {{"paths":{{}}}}  missing
        /paths  {{"auv-3":null}}  unknown_auv  /paths/auv-3
        /paths  {{"auv-2":{{"segments":[{{"kind":"waypoints","points":[[0,0],[0,0.01]]}}],"closed":false,"speed_mps":0.2}}}}  one_place  /paths/auv-2/segments/0/points
    "#
    );
    let patch = async |body: Value| service.patch(&mission, &body).await;
    assert_refused(&json!({}), &table, patch).await;
    assert_eq!(service.ask(&mission).await, before);
}

#[tokio::test(start_paused = true)]
async fn a_mission_that_is_simulated_over_or_unknown_is_not_changed() {
    let service = Service::start().await;
    let change = json!({ "keep_outs": [] });
    let unreal = service.create(&simulated("paper-tracking")).await;
    let refused = service.patch(&unreal, &change).await;
    refused.must_be(409);
    refused.must_say("scenario_file");
    assert_eq!(service.ask(&unreal).await["setting"], Value::Null);

    let over = service.create(&live()).await;
    service.finish(&over).await;
    let refused = service.patch(&over, &json!({ "goal": track("auv-1") })).await;
    refused.must_be(409);
    refused.must_say("is over");
    let unknown = service.patch("/v1/missions/unknown", &change).await;
    assert_eq!(unknown.problem()["code"], "no_mission");
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
        let forecasts = targets.map(|target| target["forecast"].clone());
        forecasts.collect::<Vec<_>>()
    };
    assert!(!forecasts(&service.next_plan(&mission).await).contains(&json!("path")));
    let ends = [[90.0, -20.0], [20.0, -90.0]];
    let (first, second) = (route(&[[10.0, -20.0], ends[0]]), route(&[[10.0, -20.0], [10.0, -90.0], ends[1]]));
    for (k, path) in [&first, &second].into_iter().enumerate() {
        let paths = json!({ "paths": { "auv-1": path } });
        let changed = service.change(&mission, paths).await;
        assert_eq!(changed["setting"].get("paths"), None);
        if k == 0 {
            service.next_plan(&mission).await;
        }
        service = service.restart().await;
        let scene = service.ask(&format!("{mission}/scene")).await;
        let paths = scene["paths"].as_object().expect("is one");
        let points = paths["auv-1"].as_array().expect("is a list");
        let at = [0, 1].map(|axis| number(&points[points.len() - 1][axis]));
        let off = (at[0] - ends[k][0]).hypot(at[1] - ends[k][1]);
        assert!(paths.len() == 1 && off < 0.01, "{at:?}");
        assert_eq!(forecasts(&service.next_plan(&mission).await)[0], "path");
    }
    let none = json!({ "paths": { "auv-1": null } });
    service.change(&mission, none).await;
    assert!(!forecasts(&service.next_plan(&mission).await).contains(&json!("path")));
    service.finish(&mission).await;
    let events = service.events(&mission).await;
    let changes = events.iter().filter(|event| event["kind"] == "changed");
    let replaced: Vec<_> = changes.map(|event| event["replaced"]["paths"]["auv-1"].clone()).collect();
    let stored = |path: &Value| serde_json::from_value::<wire::DeclaredPath>(path.clone()).expect("is one");
    assert_eq!(replaced[0], Value::Null);
    assert_eq!([&replaced[1], &replaced[2]].map(stored), [&first, &second].map(stored));
    assert!(5 <= service.n_replayed(&mission));
}

#[tokio::test(start_paused = true)]
async fn a_route_file_is_read_or_refused_by_line() {
    let service = Service::start().await;
    let read = async |query: &str, file: &str| {
        let request = post(&format!("/v1/routes{query}"), file.to_owned());
        service.send(request).await
    };
    let file = "lat,lon,speed_mps,route\n38.41,-9.12,1.5,a\n38.42,-9.12,1.5,a\n38.41,-9.12,1.5,b\n";
    let answer = read("?name=a", file).await.expected(200);
    let points = [38.41, 38.42].map(|lat| json!({ "lat_deg": lat, "lon_deg": -9.12 }));
    let segment = json!({ "kind": "waypoints", "points": points });
    let path = json!({ "segments": [segment], "closed": false, "speed_mps": 1.5 });
    let expected = json!({ "name": "a", "points": points, "speed_mps": 1.5, "path": path });
    assert_eq!(answer, expected);
    // The path is one that a mission takes.
    let mut body = live();
    body["live"]["origin"] = json!({ "lat_deg": 38.41, "lon_deg": -9.12 });
    body["live"]["auvs"][0]["path"] = path;
    service.create(&body).await;
    let lanes = "format=lawnmower,x=0,y=0,width=9,height=9,lane_width=3";
    let lanes = read("", lanes).await.json();
    assert_eq!(lanes["points"].as_array().map(Vec::len), Some(8));
    for (query, file, detail) in [
        ("", file, "\"a\", \"b\""),
        ("?name=c", file, "is not in the file"),
        ("", "lat,lon\n38,-9\n91,-9\n", "line 3: latitude 91"),
        ("", "", "is empty"),
    ] {
        let refused = read(query, file).await;
        refused.must_be(422);
        refused.must_say(&detail.replace('"', "\\\""));
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
    let stored = json!({ "steps_s": [1.0, 1.0, 2.0, 2.0, 4.0] });
    assert_eq!(changed["setting"]["tuning"], stored);
    assert_eq!(points(&service.next_plan(&mission).await), 6);
    let short = json!({ "tuning": { "steps_s": [1, 1] } });
    let refused = service.patch(&mission, &short).await;
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
    // They are asked for something else.
    assert_ne!(usual["plan_id"], tuned["plan_id"]);
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
        (json!({ "scenario_file": file("[1, 1]") }), "surface_craft.tuning.steps_s"),
        (json!({ "scenario_file": numbers }), "surface_craft.parameters"),
        (json!({ "scenario": "fleet-dies" }), "surface_craft: a simulated mission has one craft, not 3"),
    ] {
        let wrong = json!({ "schema_version": "1.0", "simulated": wrong });
        let refused = service.post("/v1/missions", &wrong).await;
        refused.must_be(422);
        refused.must_say(key);
    }
}
