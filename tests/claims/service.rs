//! Answers of the service to valid requests.

use std::collections::BTreeSet;

use axum::http::StatusCode;
use geodesy::Datum;
use nalgebra::Vector2;
use planner::{
    craft::{CraftDescription, PRESETS},
    los::LosLaw,
    parameters::Parameters,
    plan::{SoftLimit, Unit},
    program::Slack,
};
use serde_json::{Value, json};
use service::{Settings, examples::EXAMPLES};
use tests::client::{Answer, answered, call, example, get, post, send, served, simulated_machine, with};

/// The answer to `request`, without errors, on a simulated machine.
async fn asked(request: axum::http::Request<axum::body::Body>) -> Answer {
    send(simulated_machine(), request).await
}

/// The answer to `body` in its shape.
async fn read<T: serde::de::DeserializeOwned>(path: &str, body: &Value) -> T {
    let answer = answered(path, body.to_string()).await;
    serde_json::from_value(answer).expect("has the shape")
}

fn number(value: &Value) -> f64 {
    value.as_f64().expect("is a number")
}

#[tokio::test(start_paused = true)]
async fn every_example_is_planned_and_no_worse_than_line_of_sight() {
    let mut by_the_program = 0;
    for example in EXAMPLES {
        let name = example.name;
        let mut body: Value = serde_json::from_str(example.body).expect("is JSON");
        let metadata = json!({ "run": 7, "nested": { "list": [1, null, "é"] } });
        body["metadata"] = metadata.clone();
        let plan: wire::PlanResponse = read("/v1/plan", &body).await;
        assert_eq!(plan.outcome, wire::Outcome::Ok, "{name}");
        assert_eq!(json!(plan.metadata), metadata);
        // A law with full turn rate from rest is predicted to do better if the craft faces away.
        by_the_program += usize::from(plan.method == wire::Method::Mpc);
        let methods = [wire::Method::Mpc, wire::Method::SaturatedLos];
        assert!(methods.contains(&plan.method), "{name}: {:?}", plan.method);
        assert!(plan.predicted.cost <= plan.baseline.predicted_cost, "{name}");
        // No time passes while a simulated machine works.
        let solver = plan.solver.expect("a program was solved");
        assert_eq!(solver.solve_time_ms, Some(0.0));
        let n = plan.trajectory.len();
        assert_eq!(plan.goal.trajectory.len(), n);
        for target in &plan.targets {
            let lengths = [target.trajectory.len(), target.depths_m.len(), target.position_sigma_m.len()];
            assert_eq!(lengths, [n; 3]);
            assert!(target.position_sigma_m.is_sorted(), "uncertainty grows with time");
        }
        assert!(plan.warnings.is_empty(), "{name}: {:?}", plan.warnings);
    }
    assert!(EXAMPLES.len() < 2 * by_the_program, "{by_the_program}");
}

#[tokio::test(start_paused = true)]
async fn an_explanation_sums_to_the_answer_and_comes_only_on_request() {
    for example in EXAMPLES {
        let name = example.name;
        let plain = answered("/v1/plan/compare", example.body).await;
        assert!(plain.get("explanation").is_none(), "{name}");
        let answer = answered("/v1/plan/compare?explain=true", example.body).await;
        let compared: wire::Comparison = serde_json::from_value(answer).expect("has the shape");
        let (plans, found) = (compared.plans, compared.explanation.expect("was asked for"));

        // Another sum of the same numbers: equal but for rounding.
        for (law, plan) in [
            ("mpc", &plans.mpc),
            ("saturated_los", &plans.saturated_los),
            ("waypoint_box", &plans.waypoint_box),
        ] {
            let terms = json!(found.cost_terms[law]);
            let terms = terms.as_object().into_iter().flat_map(|terms| terms.values());
            let (sum, cost) = (terms.filter_map(Value::as_f64).sum::<f64>(), plan.predicted.cost);
            let is_close = (sum - cost).abs() <= 1e-9 * cost.abs().max(1.0);
            assert!(is_close, "{name}, {law}: {sum} and {cost}");
        }
        let solver = plans.mpc.solver.expect("a program was solved");
        // The subproblem that answered is in the log, and those of other initial guesses too.
        let log = &found.log;
        assert!(solver.scp_iterations <= log.len(), "{name}");
        let iterations = log.iter().map(|one| one.iterations).sum();
        assert!(solver.iterations <= iterations, "{name}");
        assert!(log.iter().any(|one| one.status == solver.status), "{name}");
        assert!(log.iter().any(|one| one.residuals == solver.residuals), "{name}");
        let size = found.program;
        let least = size.equalities + size.inequalities + 2 * size.second_order_cones;
        assert!(least <= size.rows, "{name}: {size:?}");
        assert!((1..size.variables).contains(&size.stages), "{name}: {size:?}");
    }
}

#[tokio::test(start_paused = true)]
async fn an_unattainable_limit_has_slack() {
    let mut body = example("track");
    // On top of the craft, which cannot leave it at once.
    let asc = &body["asc"];
    body["keep_outs"] = json!([{ "north_m": asc["north_m"], "east_m": asc["east_m"], "radius_m": 15 }]);
    let compared: wire::Comparison = read("/v1/plan/compare?explain=true", &body).await;
    let slack = compared.explanation.expect("was asked for").slack;
    let mut violations = compared.plans.mpc.violations.iter();
    assert!(violations.any(|broken| broken.limit == SoftLimit::KeepOut));
    let of = |limit: Slack| slack.iter().find(move |used| used.limit == limit);
    let used = of(Slack::KeepOut).expect("is used");
    assert!(0.0 < used.amount && used.unit == Unit::Metres, "{used:?}");
    let unused = [Slack::Area, Slack::AcousticRange].map(of);
    assert!(unused.iter().all(Option::is_none), "{slack:?}");
}

#[tokio::test(start_paused = true)]
async fn a_comparison_has_a_whole_answer_of_every_law_and_its_missing_state() {
    let answer = answered("/v1/plan/compare", EXAMPLES[1].body).await;
    let plans = serde_json::from_value::<wire::Comparison>(answer.clone()).expect("has the shape");
    let (mpc, los) = (&plans.plans.mpc, &plans.plans.saturated_los);
    assert_eq!(mpc.method, wire::Method::Mpc);
    assert_eq!(mpc.baseline.speed_mps, los.reference.speed_mps);
    assert_eq!(mpc.baseline.heading_rad, los.reference.heading_rad);
    assert_eq!(mpc.baseline.predicted_rms_error_m, los.predicted.rms_error_m);
    assert_ne!(mpc.trajectory, los.trajectory);
    for law in LosLaw::ALL {
        let plan = answer["plans"][law.name()].clone();
        assert_eq!(plan["method"], law.name());
        let plan: wire::PlanResponse = serde_json::from_value(plan).expect("has the shape");
        assert_eq!((plan.outcome, &plan.solver), (wire::Outcome::Ok, &None));
        // It starts at the craft, like the planner's.
        let [first, of_mpc] = [&plan, mpc].map(|plan| &plan.trajectory[0]);
        let at = |point: &wire::TrajectoryPoint| (point.t_s, point.north_m, point.east_m);
        assert_eq!(at(first), at(of_mpc));
        let mut codes = plan.warnings.iter().map(|warning| warning.code.as_str());
        let remembers = [LosLaw::Integral, LosLaw::WaypointBox].contains(&law);
        let warned = codes.any(|code| code == "law_without_memory");
        assert_eq!(warned, remembers, "{}", law.name());
    }
}

#[tokio::test(start_paused = true)]
async fn every_law_is_compared_in_the_craft_s_kind_of_reference() {
    let compared = async |held: Value| {
        let mut body = example("cross-current");
        body["craft"] = json!({ "preset": "medusa", "speed_held": held[0], "heading_held": held[1] });
        body["current"] = json!({ "north_mps": 0.05, "east_mps": -0.08 });
        let answer = answered("/v1/plan/compare", body.to_string()).await;
        answer["plans"].clone()
    };
    let water = compared(json!(["through_water", "heading"])).await;
    let ground = compared(json!(["over_ground", "course"])).await;
    for law in LosLaw::ALL {
        let of = |plans: &Value, name: &str| number(&plans[law.name()]["reference"][name]);
        let (speed, heading) = (of(&water, "speed_mps"), of(&water, "heading_rad"));
        let (north, east) = (speed * heading.cos() + 0.05, speed * heading.sin() - 0.08);
        let along = north * heading.cos() + east * heading.sin();
        let slower = of(&ground, "speed_mps") - along.max(0.0);
        let turned = (of(&ground, "heading_rad") - east.atan2(north)).sin();
        assert!(slower.abs() < 1e-9 && turned.abs() < 1e-9, "{}", law.name());
    }
}

#[tokio::test(start_paused = true)]
async fn a_batch_answers_each_request_as_if_alone() {
    let mut wrong = example("track");
    wrong["asc"]["speed_mps"] = json!(100.0);
    let mut odd = example("track");
    odd["auv"] = json!([]);
    let batch = json!({ "requests": [example("track"), wrong, odd, example("crowded")] });
    let answer = answered("/v1/plan/batch", batch.to_string()).await;
    let answers = answer["answers"].clone();
    for (i, name) in [(0, "track"), (3, "crowded")] {
        let alone = answered("/v1/plan", example(name).to_string()).await;
        assert_eq!(answers[i]["status"], 200);
        for member in ["plan_id", "reference"] {
            assert_eq!(answers[i]["plan"][member], alone[member], "{name}");
        }
    }
    for (i, pointer) in [(1, "/requests/1/asc/speed_mps"), (2, "/requests/2/auv")] {
        let problem = &answers[i]["problem"];
        assert_eq!(answers[i]["status"], 422);
        assert_eq!(problem["errors"][0]["pointer"], pointer);
        assert!(!problem["request_id"].as_str().expect("is text").is_empty());
    }
    for body in [json!([]), json!({ "requests": [] }), json!({ "requests": vec![0; 65] })] {
        let refused = asked(post("/v1/plan/batch", body.to_string())).await;
        refused.must_be(422);
        assert_eq!(refused.faults()[0].0, "/requests");
    }
}

#[tokio::test(start_paused = true)]
async fn a_snapshot_is_validated_without_a_plan() {
    let looked_at = answered("/v1/plan/validate", EXAMPLES[0].body).await;
    let planned = answered("/v1/plan", EXAMPLES[0].body).await;
    assert_eq!(looked_at["plan_id"], planned["plan_id"]);
    let again = answered("/v1/plan/validate", looked_at["request"].to_string()).await;
    assert_eq!(again, looked_at);
    asked(post("/v1/plan/validate", "{}")).await.must_be(422);
    let limits = served("/v1/limits").await;
    let some = json!([limits["auvs"], limits["deadline_most_ms"]]);
    assert_eq!(some, json!([16, 1000.0]));
    let document = served("/openapi.json").await;
    let batch = &document["components"]["schemas"]["Batch"]["properties"]["requests"];
    assert_eq!(limits["batch_requests"], batch["maxItems"]);
}

#[tokio::test(start_paused = true)]
async fn a_plan_id_depends_on_the_request_s_meaning_alone() {
    let id = async |body: Value| {
        let answer = answered("/v1/plan", body.to_string()).await;
        answer["plan_id"].as_str().expect("has an id").to_owned()
    };
    let plain = id(example("track")).await;
    assert_eq!(plain.len(), 64);

    let mut spelled_out = example("track");
    spelled_out["asc"]["sway_mps"] = json!(0.0);
    spelled_out["limits"] = json!({ "speed_max_mps": 1.5 });
    spelled_out["metadata"] = json!({ "note": "no part of the meaning" });
    assert_eq!(id(spelled_out).await, plain);

    let mut other = example("track");
    other["asc"]["north_m"] = json!(1e-9);
    assert_ne!(id(other).await, plain);
}

#[tokio::test(start_paused = true)]
async fn no_answer_is_for_a_page_of_another_origin() {
    let evil = "http://evil.example";
    let preflight = with(call("OPTIONS", "/v1/plan"), "origin", evil);
    let preflight = with(preflight, "access-control-request-method", "POST");
    let preflight = with(preflight, "access-control-request-headers", "content-type");
    for (request, status) in [
        (get("/"), 200),
        (get("/openapi.json"), 200),
        (get("/nowhere"), 404),
        (post("/v1/plan", EXAMPLES[0].body), 200),
        (with(post("/v1/plan", EXAMPLES[0].body), "origin", evil), 200),
        (preflight, 405),
    ] {
        let path = request.uri().path().to_owned();
        let answer = asked(request).await;
        answer.must_be(status);
        for (name, value) in [
            ("x-frame-options", "DENY"),
            ("referrer-policy", "no-referrer"),
            ("cross-origin-resource-policy", "same-origin"),
            ("cross-origin-opener-policy", "same-origin"),
        ] {
            assert_eq!(answer.header(name), value, "{path}: {name}");
        }
        let mut names = answer.headers.keys().map(axum::http::HeaderName::as_str);
        assert!(!names.any(|name| name.starts_with("access-control-")), "{path}");
    }
}

#[tokio::test(start_paused = true)]
async fn a_stated_origin_may_frame_the_page_and_nothing_else() {
    let framed_by = vec!["http://blueos.local:80".parse().expect("is a value")];
    let settings = || Settings { framed_by: framed_by.clone(), ..simulated_machine() };
    for path in ["/", "/docs", "/page.css"] {
        let answer = send(settings(), get(path)).await;
        let policy = answer.header("content-security-policy");
        assert!(policy.starts_with("default-src 'self'; base-uri 'none'"), "{path}: {policy}");
        assert!(policy.ends_with("; frame-ancestors http://blueos.local:80"), "{path}: {policy}");
        // Browsers that know both obey this one, too.
        assert!(!answer.headers.contains_key("x-frame-options"), "{path}");
    }
    for path in ["/openapi.json", "/version", "/v1/limits"] {
        let answer = send(settings(), get(path)).await;
        assert_eq!(answer.header("x-frame-options"), "DENY", "{path}");
        assert!(answer.header("content-security-policy").ends_with("frame-ancestors 'none'"), "{path}");
    }
}

#[tokio::test(start_paused = true)]
async fn the_openapi_document_states_dependencies_of_members() {
    let document = served("/openapi.json").await;
    let schemas = &document["components"]["schemas"];
    let mut n_rules = 0;
    for (shape, schema) in schemas.as_object().expect("an object") {
        for rule in schema["allOf"].as_array().into_iter().flatten() {
            let variants = ["oneOf", "anyOf"].iter().find_map(|word| rule[word].as_array());
            for variant in variants.expect("one of them") {
                let named = variant["properties"].as_object().into_iter().flat_map(|names| names.keys());
                let required = variant["required"].as_array().into_iter().flatten().filter_map(Value::as_str);
                for name in named.map(String::as_str).chain(required) {
                    assert!(schema["properties"][name].is_object(), "{shape} has no {name}");
                }
                n_rules += 1;
            }
        }
    }
    assert!(25 <= n_rules, "{n_rules}");
    for (place, said) in [
        ("Auv/allOf/0/oneOf/0/required", json!(["state"])),
        ("Auv/allOf/0/oneOf/0/properties/reports/type", json!("null")),
        ("Goal/discriminator/mapping/intermittent", json!("#/components/schemas/GoalIntermittent")),
        ("GoalIntermittent/properties/kind/enum", json!(["intermittent"])),
        ("GoalIntermittent/properties/dwell_s/type", json!("number")),
        ("GoalVisit/additionalProperties", json!(false)),
        ("PlanRequest/properties/schema_version/const", json!("1.0")),
        ("PlanRequest/properties/area/items/anyOf/0/maxItems", json!(2)),
        ("Live/properties/area/items/anyOf/0/items/maximum", json!(1e6)),
        ("AuvState/properties/covariance/items/minItems", json!(4)),
        ("SegmentWaypoints/properties/fillet_m/minimum", json!(0.0)),
        ("Simulated/properties/seed/maximum", json!(u64::MAX)),
    ] {
        assert_eq!(schemas.pointer(&format!("/{place}")), Some(&said), "{place}");
    }
    let angle = &schemas["SegmentArc"]["properties"]["angle_rad"];
    assert_eq!(angle["minimum"].as_f64(), angle["maximum"].as_f64().map(|most| -most));
    // The least request gives no defaults, and absent members are not null.
    for place in ["GoalTrack/properties/auv/default", "Auv/properties/id/default", "PlanRequest/oneOf"] {
        assert_eq!(schemas.pointer(&format!("/{place}")), None, "{place}");
    }
    let body = &document["paths"]["/v1/plan"]["post"]["requestBody"]["content"]["application/json"]["schema"];
    let either =
        ["PlanRequest", "FleetRequest"].map(|name| json!({ "$ref": format!("#/components/schemas/{name}") }));
    assert_eq!(body, &json!({ "oneOf": either }));
    let parameters = &document["paths"]["/v1/missions/{id}/events"]["get"]["parameters"];
    for parameter in parameters.as_array().expect("a list") {
        assert!(parameter["schema"]["type"].is_string(), "{parameter}");
    }
    let links = &document["paths"]["/v1/missions"]["post"]["responses"]["201"]["links"];
    assert_eq!(links["run_mission"]["parameters"]["id"], "$response.body#/id");
}

#[tokio::test(start_paused = true)]
async fn a_stale_report_and_an_unknown_current_cause_warnings() {
    let mut body = example("track");
    body["auvs"][0]["state"]["age_s"] = json!(45.0);
    body.as_object_mut().expect("an object").remove("current");
    let answer = answered("/v1/plan", body.to_string()).await;
    let warnings = answer["warnings"].as_array().expect("a list").iter();
    let codes: Vec<_> = warnings.map(|warning| &warning["code"]).collect();
    assert_eq!(codes, ["stale_report", "current_unknown"]);
    assert_eq!(answer["warnings"][0]["pointer"], "/auvs/0/state/age_s");
}

#[tokio::test(start_paused = true)]
async fn velocities_that_no_current_explains_are_set_aside_with_a_warning() {
    let mut body = example("track");
    body.as_object_mut().expect("an object").remove("current");
    // Bow north: velocities through the water are along the axes.
    body["asc"]["heading_rad"] = json!(0);
    (body["asc"]["speed_mps"], body["asc"]["sway_mps"]) = (json!(1.5), json!(0));
    let kept = Some([0.5, 0.25]);
    let current = |[north, east]: [f64; 2]| json!({ "north_mps": north, "east_mps": east });
    for (north, east, remembered, taken, warned) in [
        (4.25, -2.75, None, Some([2.75, -2.75]), None),
        (4.75, 0.0, None, None, Some("/asc/ground_north_mps")),
        (0.0, -3.25, None, None, Some("/asc/ground_east_mps")),
        (25.0, 0.0, kept, kept, Some("/asc/ground_north_mps")),
    ] {
        body["asc"]["ground_north_mps"] = json!(north);
        body["asc"]["ground_east_mps"] = json!(east);
        let point = json!({ "t_s": 119, "north_m": 0, "east_m": 0, "speed_mps": 0.3, "heading_rad": 0 });
        body["previous_plan"] =
            json!(remembered.map(|kept| json!({ "trajectory": [point], "current": current(kept) })));
        let answer = answered("/v1/plan", body.to_string()).await;
        assert_eq!(answer["current"], json!(taken.map(current)), "{north}, {east}");
        let warnings = answer["warnings"].as_array().expect("a list");
        let is_about = |warning: &&Value| warning["code"] == "velocities_contradict";
        let contradict = warnings.iter().find(is_about);
        let pointer = contradict.and_then(|warning| warning["pointer"].as_str());
        assert_eq!(pointer, warned, "{north}, {east}: {warnings:?}");
    }
}

#[tokio::test(start_paused = true)]
async fn raw_fixes_are_answered_with_their_estimate() {
    let answer = answered("/v1/plan", example("reports").to_string()).await;
    let estimate = &answer["targets"][0]["estimate"];
    // The sixth is 24 m north and 11 m west of where the vehicle was.
    assert_eq!(estimate["rejected"], json!([5]));
    assert_eq!(estimate["age_s"], 5.0);
    // It went at 0.19 m/s on a course of 0.35 rad from (2, -6).
    let travelled = 0.19 * 115.0;
    let (sin, cos) = 0.35_f64.sin_cos();
    let truth = [2.0 + travelled * cos, -6.0 + travelled * sin];
    let miss = (number(&estimate["north_m"]) - truth[0]).hypot(number(&estimate["east_m"]) - truth[1]);
    let sigma = number(&estimate["position_sigma_m"]);
    assert!(miss < 2.0 * sigma && sigma < 1.5, "{miss} m, sigma {sigma} m");
}

#[tokio::test(start_paused = true)]
async fn every_listed_example_is_served_as_its_file() {
    let list = served("/v1/examples").await;
    let listed = list["examples"].as_array().expect("a list");
    assert_eq!(listed.len(), EXAMPLES.len());
    for (entry, example) in listed.iter().zip(EXAMPLES) {
        let named = json!([entry["name"], entry["title"]]);
        assert_eq!(named, json!([example.name, example.title]));
        let served = asked(get(&format!("/v1/examples/{}", example.name))).await;
        assert_eq!((&*served.text, served.content_type()), (example.body, "application/json"));
    }
}

#[tokio::test(start_paused = true)]
async fn every_listed_craft_is_a_valid_description_with_a_source() {
    let list = served("/v1/crafts").await;
    let listed = list["crafts"].as_array().expect("a list");
    assert_eq!(listed.len(), PRESETS.len());
    for (entry, preset) in listed.iter().zip(PRESETS) {
        let named = json!([entry["name"], entry["source"]]);
        assert_eq!(named, json!([preset.name, preset.source]));
        let described: CraftDescription = serde_json::from_value(entry["craft"].clone()).expect("a craft");
        assert_eq!(described, CraftDescription::from(&preset.craft));
    }
}

#[tokio::test(start_paused = true)]
async fn health_readiness_and_version_have_their_answers() {
    let version = env!("CARGO_PKG_VERSION");
    for (path, expected) in [
        ("/livez", json!({ "status": "live" })),
        ("/readyz", json!({ "status": "ready" })),
        ("/version", json!({ "name": "pilotfish", "version": version, "schema_version": "1.0" })),
    ] {
        assert_eq!(served(path).await, expected);
    }
}

#[tokio::test(start_paused = true)]
async fn the_page_loads_nothing_from_elsewhere() {
    assert!(20 < page::FILES.len());
    let [mut first_load, mut documentation] = [0; 2];
    for file in page::FILES.iter() {
        if !page::ON_DEMAND.contains(&file.path) {
            first_load += file.content.len();
        } else if file.path.starts_with("/docs") {
            documentation += file.content.len();
        }
        let answer = asked(get(file.path)).await;
        answer.must_be(200);
        assert_eq!(answer.content_type(), file.media_type);
        let policy = answer.header("content-security-policy");
        assert!(policy.starts_with("default-src 'self';"), "{policy}");
        let text = answer.text.replace("http://www.w3.org/2000/svg", "");
        assert!(!text.contains("://"), "{}", file.path);
    }
    // The first load of a phone: missions, with the pictures of the gallery. Manual orders come with
    // the first live mission, fleets, comparisons and plans of a snapshot with the first of them.
    assert!(first_load < 270_000, "{first_load} bytes");
    assert!(documentation < 25_000, "{documentation} bytes");
    // Interactive documentation runs no script but its own.
    for path in ["/docs", "/docs.js", "/docs.css"] {
        let answer = asked(get(path)).await;
        answer.must_be(200);
        let policy = answer.header("content-security-policy");
        assert!(policy.starts_with("default-src 'self'; base-uri"), "{policy}");
    }
    asked(get("/docs/nothing")).await.must_refuse(404, "no_route");
}

#[tokio::test(start_paused = true)]
async fn a_file_of_the_page_is_cached_and_nothing_else_is() {
    let with_tags = async |path: &str, tags: &str| asked(with(get(path), "if-none-match", tags)).await;
    let mut tags = BTreeSet::new();
    for file in page::FILES.iter() {
        let first = asked(get(file.path)).await;
        let tag = first.header("etag");
        // From the content alone: another version of the program has another tag.
        let digest = wire::sha256(file.content.as_bytes());
        assert_eq!(tag, format!("\"{}\"", &digest[..32]));
        assert!(tags.insert(tag.to_owned()), "{}", file.path);
        assert_eq!(first.header("cache-control"), "no-cache");
        for held in [tag.to_owned(), format!("W/{tag}"), format!("\"older\", {tag}")] {
            let again = with_tags(file.path, &held).await;
            let headers = ["etag", "cache-control"].map(|name| again.header(name));
            again.must_be(304);
            assert_eq!((headers, &*again.text), ([tag, "no-cache"], ""), "{held}");
        }
        let changed = with_tags(file.path, "\"0123456789abcdef0123456789abcdef\"").await;
        assert_eq!((changed.status, &*changed.text), (StatusCode::OK, file.content));
    }
    for path in ["/v1/examples", "/version", "/openapi.json", "/nowhere"] {
        let answer = with_tags(path, "*").await;
        assert_ne!(answer.status, StatusCode::NOT_MODIFIED, "{path}");
        assert_eq!(answer.header("cache-control"), "no-store", "{path}");
    }
}

#[tokio::test(start_paused = true)]
async fn the_goals_of_all_examples_fit_their_kind_in_the_openapi_document() {
    let schemas = served("/openapi.json").await["components"]["schemas"].take();
    let mapping = schemas["Goal"]["discriminator"]["mapping"].as_object().expect("is there");
    let mut kinds = std::collections::BTreeSet::new();
    for name in EXAMPLES.iter().map(|example| example.name) {
        let goal = &example(name)["goal"];
        let kind = goal["kind"].as_str().expect("is named");
        let schema = mapping[kind].as_str().and_then(|reference| reference.rsplit('/').next());
        let schema = &schemas[schema.expect("is a reference")];
        for member in goal.as_object().expect("an object").keys() {
            assert!(schema["properties"][member].is_object(), "{name}: {member}");
        }
        for member in schema["required"].as_array().into_iter().flatten().filter_map(Value::as_str) {
            assert!(!goal[member].is_null(), "{name}: {member}");
        }
        kinds.insert(kind.to_owned());
    }
    assert!(mapping.keys().all(|kind| kinds.contains(kind)), "{kinds:?}");
}

#[tokio::test(start_paused = true)]
async fn the_openapi_document_resolves_every_reference() {
    let document = served("/openapi.json").await;
    assert!(document["paths"]["/readyz"]["get"]["responses"]["503"].is_object());
    let text = document.to_string();
    for rest in text.split("\"#/").skip(1) {
        let reference = rest.split('"').next().unwrap_or_default();
        assert!(document.pointer(&format!("/{reference}")).is_some(), "{reference}");
    }
}

#[tokio::test(start_paused = true)]
async fn the_openapi_document_lists_every_refusal_of_a_posted_snapshot() {
    let document = served("/openapi.json").await;
    for path in ["/v1/plan", "/v1/plan/compare"] {
        let responses = &document["paths"][path]["post"]["responses"];
        let listed: Vec<_> = responses.as_object().expect("an object").keys().collect();
        assert_eq!(
            listed,
            ["200", "400", "401", "403", "408", "413", "415", "422", "500", "503", "504"],
            "{path}"
        );
        for status in &listed[1..] {
            let content = &responses[status.as_str()]["content"]["application/problem+json"];
            assert!(
                content["schema"]["$ref"].as_str().is_some_and(|shape| shape.ends_with("/ProblemDocument")),
                "{path} {status}: {responses}"
            );
        }
    }
    for member in ["given", "limit"] {
        let schema = &document["components"]["schemas"]["FieldError"]["properties"][member];
        assert!(schema.is_object(), "{member} is not listed");
        for narrowed in ["type", "oneOf", "$ref"] {
            assert!(schema.get(narrowed).is_none(), "{member} may be any JSON: {schema}");
        }
    }
}

#[tokio::test(start_paused = true)]
async fn the_openapi_document_has_the_checked_ranges() {
    let document = served("/openapi.json").await;
    let schemas = &document["components"]["schemas"];
    for (place, limit) in [
        ("Report/properties/sigma_m/minimum", json!(0.001)),
        ("Report/properties/course_rad/maximum", json!(std::f64::consts::TAU)),
        ("Auv/properties/reports/maxItems", json!(64)),
        ("Auv/properties/id/maxLength", json!(64)),
        ("PlanRequest/properties/auvs/minItems", json!(1)),
        ("PlanRequest/properties/forecast/default", json!("auto")),
        ("PreviousPlan/properties/trajectory/maxItems", json!(256)),
        ("TrajectoryPoint/properties/speed_mps/maximum", json!(2000.0)),
        ("PreviousEstimate/properties/age_s/minimum", json!(0.0)),
        ("Limits/properties/speed_max_mps/default", json!(1.5)),
        ("Live/properties/period_s/default", json!(1.0)),
        ("Reports/properties/asc/maxItems", json!(64)),
        ("Reports/properties/rejected/readOnly", json!(true)),
        ("Assignment/properties/unserved/maxItems", json!(16)),
        ("Step/properties/ticks/maximum", json!(60)),
    ] {
        assert_eq!(schemas.pointer(&format!("/{place}")), Some(&limit), "{place}");
    }
}

#[tokio::test(start_paused = true)]
async fn a_plain_request_id_is_kept_and_a_strange_one_replaced() {
    let with_id = async |id: &str| asked(with(get("/nowhere"), "x-request-id", id)).await;
    let kept = with_id("mission-7.42").await;
    assert_eq!(kept.header("x-request-id"), "mission-7.42");
    assert_eq!(kept.problem()["request_id"], "mission-7.42");
    let replaced = with_id("<script>").await;
    assert_eq!(replaced.header("x-request-id").len(), 16);
}

#[tokio::test(start_paused = true)]
async fn the_documented_defaults_of_the_limits_are_the_ones_used() {
    let document = served("/openapi.json").await;
    let request = tests::observation(tests::goals()[0].clone());
    let used = serde_json::to_value(request.limits).expect("becomes JSON");
    for (member, schema) in
        document["components"]["schemas"]["Limits"]["properties"].as_object().expect("an object")
    {
        let text = schema["description"].as_str().expect("every member is described");
        let documented = text.rsplit("Default: ").next().expect("a default").trim_end_matches('.');
        // A number limits speeds, the craft everything else.
        if let Ok(number) = documented.parse::<f64>() {
            assert!(member.starts_with("speed_"), "{member}: {text}");
            assert_eq!(Some(number), used[member].as_f64(), "{member}: {text}");
        } else {
            assert!(!member.starts_with("speed_"), "{member}: {text}");
            assert!(documented.contains("craft"), "{member}: {text}");
        }
    }
}

#[tokio::test(start_paused = true)]
async fn the_documented_defaults_of_the_levers_are_the_ones_used() {
    let page = include_str!("../../docs/program.md");
    let document = served("/openapi.json").await;
    let usual = Parameters::default();
    let weights = &usual.weights;
    for (member, used) in [
        ("position_weight_per_m2", weights.position),
        ("velocity_weight_per_m2ps2", weights.velocity),
        ("acceleration_weight_per_m2ps4", weights.acceleration),
        ("terminal_position_weight_per_m2", weights.terminal_position),
        ("terminal_velocity_weight_per_m2ps2", weights.terminal_velocity),
        ("energy_weight_per_j", weights.energy),
        ("scp_iterations", usual.scp_iterations.into()),
    ] {
        let description = &document["components"]["schemas"]["Tuning"]["properties"][member]["description"];
        let text = description.as_str().expect("every member is described");
        let default = text.split("Default: ").nth(1).expect("a default");
        let number = default.trim_end_matches('.').split(',').next();
        assert_eq!(number.unwrap_or_default().parse(), Ok(used), "{member}: {text}");
        let (_, row) = page.split_once(&format!("\n| `{member}` |")).expect(member);
        let cell = row.split('|').nth(1).expect("is in the table of levers");
        assert_eq!(cell.trim().parse(), Ok(used), "{member} in docs/program.md");
    }
    let steps = [vec![1.0; 6], vec![2.0; 12], vec![4.0; 12]].concat();
    assert_eq!(usual.steps, steps, "6 of 1, 12 of 2 and 12 of 4");
}

/// `body` with every position in latitude and longitude from `origin`.
fn on_earth(body: &Value, origin: Value) -> Value {
    fn place(datum: &Datum, north: &Value, east: &Value) -> Option<Value> {
        let place = datum.from_local(&Vector2::new(north.as_f64()?, east.as_f64()?));
        let [lat, lon] = [place.latitude, place.longitude].map(f64::to_degrees);
        Some(json!({ "lat_deg": lat, "lon_deg": lon }))
    }
    fn moved(datum: &Datum, name: &str, value: &mut Value) {
        match value {
            Value::Array(items) if matches!(name, "from" | "to" | "centre" | "point") => {
                *value = place(datum, &items[0], &items[1]).expect("is a point");
            }
            Value::Array(items) => {
                let name = if matches!(name, "area" | "points") { "point" } else { "" };
                for item in items {
                    moved(datum, name, item);
                }
            }
            Value::Object(members) if name != "offset" => {
                if let (Some(north), Some(east)) = (members.get("north_m"), members.get("east_m")) {
                    let mut place = place(datum, north, east).expect("is a place");
                    members.retain(|name, _| !matches!(name.as_str(), "north_m" | "east_m"));
                    members.append(place.as_object_mut().expect("is an object"));
                }
                for (name, value) in members {
                    moved(datum, name, value);
                }
            }
            _ => {}
        }
    }
    let given: wire::Origin = serde_json::from_value(origin.clone()).expect("has the shape");
    let datum = Datum::new(&given.into()).expect("is on Earth");
    let mut body = body.clone();
    moved(&datum, "", &mut body);
    body["origin"] = origin;
    body
}

#[tokio::test(start_paused = true)]
async fn a_request_on_earth_gets_the_answer_of_the_same_in_metres() {
    let plan = async |body: &Value| -> wire::PlanResponse { read("/v1/plan", body).await };
    // Also at the antimeridian and near a pole; nearer, the craft's north is not the origin's.
    for place in [[38.41, -9.12], [-17.0, 179.9999], [85.0, 30.0]] {
        let origin = json!({ "lat_deg": place[0], "lon_deg": place[1] });
        for example in EXAMPLES {
            let in_metres = serde_json::from_str(example.body).expect("is JSON");
            let local = plan(&in_metres).await;
            let earth = plan(&on_earth(&in_metres, origin.clone())).await;
            assert_eq!(local.method, earth.method, "{}", example.name);
            assert_eq!((local.origin, local.trajectory[0].lat_deg), (None, None));
            assert_eq!(json!(earth.origin), origin);
            let datum = Datum::new(&earth.origin.expect("is given").into()).expect("is on Earth");
            for (one, other) in local.trajectory.iter().zip(&earth.trajectory) {
                let apart = (one.north_m - other.north_m).hypot(one.east_m - other.east_m);
                assert!(apart < 1e-3, "{} at {place:?}: {apart} m", example.name);
                let degrees = wire::Origin {
                    lat_deg: other.lat_deg.expect("is there"),
                    lon_deg: other.lon_deg.expect("is there"),
                };
                let back = datum.to_local(&degrees.into()).expect("is on Earth");
                assert!((back - Vector2::new(other.north_m, other.east_m)).norm() < 1e-6);
            }
            let places = earth.goal.trajectory.iter().map(|point| point.lat_deg);
            let targets = earth.targets.iter().flat_map(|target| &target.trajectory);
            let places = places.chain(targets.map(|point| point.lat_deg));
            let estimates = earth.targets.iter().map(|target| target.estimate.lat_deg);
            let mut all = places.chain(estimates);
            assert!(all.all(|lat| lat.is_some()), "{}", example.name);
        }
    }
}

#[tokio::test(start_paused = true)]
async fn an_answer_on_earth_is_accepted_back_and_one_from_another_origin_is_not() {
    let mut body = example("track");
    body["origin"] = json!({ "lat_deg": 38.41, "lon_deg": -9.12 });
    let plan = async |body: &Value| asked(post("/v1/plan", body.to_string())).await;
    body["previous_plan"] = plan(&body).await.json();
    plan(&body).await.must_be(200);
    body["origin"]["lat_deg"] = json!(38.42);
    let refused = plan(&body).await;
    refused.must_be(422);
    assert_eq!(refused.faults()[0].0, "/previous_plan/origin");
}
