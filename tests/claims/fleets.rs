//! Fleets through `POST /v1/plan`: each craft's plan is that of a request for it alone.

use serde_json::{Value, json};
use tests::client::{answered, example, post, send, simulated_machine};

/// A fleet with the craft, goal and AUVs of an example, and these further craft.
fn fleet(name: &str, others: &[Value]) -> Value {
    let mut body = example(name);
    let members = body.as_object_mut().expect("is an object");
    let mut own = json!({ "id": "asc-0" });
    for member in ["asc", "craft", "limits"] {
        own[member] = members.remove(member).unwrap_or_default();
    }
    body["surface_craft"] = [&[own], others].concat().into();
    body
}

fn craft(id: &str, north_m: f64, east_m: f64) -> Value {
    json!({ "id": id, "asc": { "north_m": north_m, "east_m": east_m, "heading_rad": 0.3, "speed_mps": 0.4 } })
}

/// A previous answer with these craft and plans.
fn before(plans: &[(&str, Value)]) -> Value {
    let assignment =
        json!({ "craft": [], "cost": 1, "bound": 1, "exact": true, "kept": true, "changed_s": 0 });
    let craft = plans.iter().map(|(id, plan)| json!({ "id": id, "plan": plan })).collect::<Vec<_>>();
    json!({ "assignment": assignment, "surface_craft": craft })
}

/// A number at a pointer.
fn at(value: &Value, pointer: &str) -> f64 {
    let found = value.pointer(pointer).and_then(Value::as_f64);
    found.unwrap_or_else(|| panic!("{pointer} in {value}"))
}

#[tokio::test(start_paused = true)]
async fn a_fleet_of_one_is_planned_as_one_craft() {
    for name in ["track", "midpoint", "visit", "range", "reports", "crowded"] {
        let alone = answered("/v1/plan", example(name).to_string()).await;
        let answer = answered("/v1/plan", fleet(name, &[]).to_string()).await;
        let plan = &answer["surface_craft"][0]["plan"];
        for member in ["reference", "trajectory", "predicted", "craft_estimate", "schedule", "plan_id"] {
            assert_eq!(plan[member], alone[member], "{name}: {member}");
        }
    }
}

#[tokio::test(start_paused = true)]
async fn the_second_craft_plans_for_its_part_among_the_first_as_a_vessel() {
    let body = fleet("midpoint", &[craft("asc-1", 30.0, 60.0)]);
    let answer = answered("/v1/plan", body.to_string()).await;
    let (first, second) = (&answer["surface_craft"][0], &answer["surface_craft"][1]);
    let parts: Vec<&Value> = answer["assignment"]["craft"].as_array().expect("is a list").iter().collect();
    let mut served: Vec<String> = parts
        .iter()
        .flat_map(|part| part["auvs"].as_array().expect("is a list"))
        .map(ToString::to_string)
        .collect();
    served.sort();
    assert_eq!(served, ["\"auv-1\"", "\"auv-2\""], "each AUV has one craft");

    let mut alone = example("midpoint");
    let asc = &body["surface_craft"][1]["asc"];
    (alone["asc"], alone["limits"], alone["craft"]) = (asc.clone(), Value::Null, Value::Null);
    alone["goal"]["auvs"] = parts[1]["auvs"].clone();
    let own = &body["surface_craft"][0]["asc"];
    let trajectory = first["plan"]["trajectory"].as_array().expect("is a list");
    let step = trajectory.len().div_ceil(32);
    let points = trajectory.iter().skip(step).step_by(step);
    let points = points.map(|point| json!([point["t_s"], point["north_m"], point["east_m"]]));
    let (heading, speed) = (at(own, "/heading_rad"), at(own, "/speed_mps"));
    let current = |axis: &str| first["plan"]["current"][axis].as_f64().unwrap_or(0.0);
    let velocity =
        [heading.cos() * speed + current("north_mps"), heading.sin() * speed + current("east_mps")];
    alone["traffic"] = json!([{ "id": "asc-0", "t_s": body["t_s"], "north_m": own["north_m"], "east_m": own["east_m"],
        "course_rad": velocity[1].atan2(velocity[0]), "speed_mps": velocity[0].hypot(velocity[1]),
        "length_m": 5.0, "sigma_m": 3.0, "plan": points.collect::<Vec<_>>() }]);
    let alone = answered("/v1/plan", alone.to_string()).await;
    for member in ["/reference/speed_mps", "/reference/heading_rad", "/predicted/cost"] {
        let (found, expected) = (at(&second["plan"], member), at(&alone, member));
        assert!((found - expected).abs() <= 1e-6 * expected.abs().max(1.0), "{member}: {found}, {expected}");
    }
    let both = serde_json::to_string(&answer["slots"]).expect("is JSON");
    assert_eq!(both.matches("\"auv\"").count(), 2, "{both}");
}

#[tokio::test(start_paused = true)]
async fn the_last_answer_keeps_the_assignment_and_a_spare_craft_stops() {
    let mut body = fleet("track", &[craft("asc-1", 500.0, 60.0)]);
    // On Earth, so that positions of the answer are turned and moved.
    body["origin"] = json!({ "lat_deg": 38.41, "lon_deg": -9.12 });
    let first = answered("/v1/plan", body.to_string()).await;
    assert_eq!(first["assignment"]["craft"][1]["auvs"], json!([]));
    let spare = &first["surface_craft"][1];
    let reference = ["/plan/reference/speed_mps", "/plan/reference/heading_rad"].map(|of| at(spare, of));
    assert_eq!(reference[0], 0.0);
    assert!((reference[1] - 0.3).abs() < 1e-9, "keeps its heading: {reference:?}");
    assert_eq!((&spare["plan"]["outcome"], &spare["plan"]["method"]), (&json!("ok"), &json!("hold")));
    body["previous_plan"] = first.clone();
    body["t_s"] = json!(at(&body, "/t_s") + 30.0);
    let second = answered("/v1/plan", body.to_string()).await;
    assert_eq!(second["assignment"]["craft"], first["assignment"]["craft"]);
    // The craft that served is gone: the other one takes over at once, and knows the AUV.
    body["previous_plan"] = second;
    body["surface_craft"].as_array_mut().expect("is a list").remove(0);
    let third = answered("/v1/plan", body.to_string()).await;
    assert_eq!(third["assignment"]["craft"], json!([{ "id": "asc-1", "auvs": ["auv-1"] }]));
    let states = &third["surface_craft"][0]["plan"]["targets"][0]["states"];
    assert!(2 <= states.as_array().map_or(0, Vec::len), "{states}");
}

#[tokio::test(start_paused = true)]
async fn faults_name_the_craft_and_its_member() {
    for (change, expected) in [
        (json!({ "surface_craft": [] }), "/surface_craft length"),
        (json!({ "asc": craft("", 0.0, 0.0)["asc"] }), "/asc contradicts"),
        (
            json!({ "surface_craft": [craft("a", 0.0, 0.0), craft("a", 90.0, 0.0)] }),
            "/surface_craft/1/id duplicate",
        ),
        (json!({ "surface_craft": [craft("a", 1e9, 0.0)] }), "/surface_craft/0/asc/north_m out_of_range"),
        (json!({ "surface_craft": [{ "id": "a" }] }), "/surface_craft/0/asc missing"),
        (
            json!({ "surface_craft": [craft("a", 0.0, 0.0), craft("b", 9.0, 0.0)], "t_s": -1e300 }),
            "/t_s out_of_range",
        ),
        (json!({ "previous_plan": { "assignment": 3 } }), "/previous_plan/assignment wrong_type"),
        (
            json!({ "previous_plan": before(&[("gone", json!(null)), ("asc-0", json!({ "trajectory": [], "goal_course_rad": 99 }))]) }),
            "/previous_plan/surface_craft/1/plan/goal_course_rad out_of_range",
        ),
        (
            json!({ "previous_plan": before(&[("gone", json!({ "trajectory": [], "goal_course_rad": 99 }))]) }),
            "/previous_plan/surface_craft/0/plan/goal_course_rad out_of_range",
        ),
        (
            json!({ "previous_plan": before(&[("gone", json!({ "trajectory": [], "origin": { "lat_deg": 1, "lon_deg": 1 } }))]),
            "origin": { "lat_deg": 2, "lon_deg": 1 } }),
            "/previous_plan/surface_craft/0/plan/origin contradicts",
        ),
        (
            json!({ "surface_craft": [{ "id": "a", "asc": craft("a", 0.0, 0.0)["asc"], "serves": [] }] }),
            "/goal unserved",
        ),
        (json!({ "surface_craft": [craft("a", 0.0, 0.0)], "fleet": 1 }), "/fleet unknown_field"),
    ] {
        let mut body = fleet("track", &[]);
        for (name, value) in change.as_object().expect("is an object") {
            body[name] = value.clone();
        }
        let answer = send(simulated_machine(), post("/v1/plan", body.to_string())).await;
        answer.must_be(422);
        let found: Vec<_> =
            answer.faults().into_iter().map(|(pointer, code)| format!("{pointer} {code}")).collect();
        assert!(found.contains(&expected.to_owned()), "{expected}: {found:?}");
        assert_eq!(found.len(), 1, "{found:?}");
    }
}

#[tokio::test(start_paused = true)]
async fn any_weights_and_names_are_answered_as_before() {
    // Shares of weights that round to nothing are no division by nothing.
    for (kind, auvs) in
        [("weighted", json!({ "auv-1": 1e6, "auv-2": 5e-324 })), ("visit", json!(["auv-1", "auv-2"]))]
    {
        let mut body = fleet("midpoint", &[craft("asc-1", 30.0, 60.0)]);
        body["goal"] = json!({ "kind": kind });
        let member = if kind == "visit" { "auvs" } else { "weights" };
        body["goal"][member] = auvs;
        if kind == "visit" {
            body["goal"]["weights"] = json!({ "auv-1": 1e6, "auv-2": 5e-324 });
        }
        let answer = answered("/v1/plan", body.to_string()).await;
        assert!(answer["assignment"]["cost"].is_number(), "{answer}");
    }
    // A request for one craft may speak of fleets.
    let mut alone = example("track");
    alone["metadata"] = json!({ "role": "surface_craft" });
    assert_eq!(answered("/v1/plan", alone.to_string()).await["outcome"], "ok");
}

#[tokio::test(start_paused = true)]
async fn a_fleet_is_validated_without_a_plan_and_what_takes_one_craft_says_so() {
    let mut body = fleet("midpoint", &[craft("asc-1", 30.0, 60.0)]);
    body["hand_over_s"] = json!(20.0);
    let first = answered("/v1/plan", body.to_string()).await;
    body["previous_plan"] = first;
    body["t_s"] = json!(at(&body, "/t_s") + 1.0);
    let looked_at = answered("/v1/plan/validate", body.to_string()).await;
    // What is read is again a request, which is read as the same and planned for alike.
    let read = looked_at["request"].to_string();
    assert_eq!(answered("/v1/plan/validate", read.clone()).await, looked_at);
    let [plan, again] = [body.to_string(), read].map(|body| answered("/v1/plan", body));
    let (plan, again) = (plan.await, again.await);
    for member in ["assignment", "slots"] {
        assert_eq!(plan[member], again[member], "{member}");
    }
    for k in 0..2 {
        let reference = |answer: &Value| answer["surface_craft"][k]["plan"]["reference"].clone();
        assert_eq!(reference(&plan), reference(&again));
    }
    let of_one = answered("/v1/plan/validate", example("midpoint").to_string()).await;
    assert_eq!(looked_at["request"]["surface_craft"][0]["limits"], of_one["request"]["limits"]);

    let body = fleet("midpoint", &[]);
    for (path, body, place) in [
        ("/v1/plan/compare", body.clone(), "/surface_craft"),
        ("/v1/plan/batch", json!({ "requests": [body] }), "/requests/0/surface_craft"),
    ] {
        let answer = send(simulated_machine(), post(path, body.to_string())).await.json();
        let fault = answer.pointer("/answers/0/problem").unwrap_or(&answer)["errors"][0].clone();
        assert_eq!(fault["pointer"], place);
        assert!(fault["detail"].as_str().is_some_and(|words| words.contains("/v1/plan/validate")), "{fault}");
    }
}
