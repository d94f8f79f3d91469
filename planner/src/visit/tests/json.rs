//! The goal `visit` as JSON.

use super::*;

fn task(goal: Value) -> Result<Task, String> {
    serde_json::from_value(goal).map_err(|error| error.to_string())
}

#[test]
fn a_goal_survives_json_with_explicit_defaults() {
    let short = task(json!({ "kind": "visit", "auvs": ["a", "b"] })).expect("valid");
    assert_eq!(short.goal, Goal::Visit(Visits::new(vec!["a".into(), "b".into()])));
    let spelled = json!({
        "kind": "visit", "auvs": ["a", "b"], "cost": { "kind": "age" }, "within_m": 20.0, "dwell_min_s": 0.0,
        "reduce": "mean",
    });
    assert_eq!(serde_json::to_value(&short).expect("is JSON"), spelled);
    let long = json!({
        "kind": "visit", "auvs": ["a", "b"], "weights": { "a": 2.0 }, "within_m": 15.0, "dwell_min_s": 60.0,
        "cost": { "kind": "uncertainty", "fixes": "range", "growth_m2ps": 0.1, "sigma_m": 2.0, "sigma_rad": 0.01, "interval_s": 5.0 },
        "serve_by_s": { "b": 900.0 }, "reduce": "max", "costs_now": { "a": 3.0 }, "next": "b",
    });
    let found = serde_json::to_value(task(long.clone()).expect("valid")).expect("is JSON");
    assert_eq!(found, long);
    let mut visit = json!({ "kind": "visit", "auvs": ["a"] });
    visit["cost"] = json!({ "kind": "uncertainty", "growth_m2ps": 0.1 });
    let whole = VisitCost::Uncertainty {
        fixes: Fixes::Usbl,
        growth_m2ps: 0.1,
        sigma_m: 1.5,
        sigma_rad: 0.02,
        interval_s: 10.0,
    };
    let defaulted = task(visit.clone()).expect("valid").goal;
    assert!(matches!(defaulted, Goal::Visit(Visits { cost, .. }) if cost == whole));
    for [member, value, fault] in rows(
        r#"
        auvs    | null       | auvs
        dwell_s | 3.0        | dwell_s
        kind    | "midpoint" | cost
        cost    | { "kind": "data", "growth_kbps": 1.0 } | upload_kbps
        cost    | { "kind": "age", "sigma_m": 1.0 }      | sigma_m
        "#,
    ) {
        let mut goal = visit.clone();
        goal[member] = serde_json::from_str(&value).expect("is JSON");
        let error = task(goal).expect_err("is refused");
        assert!(error.contains(&fault), "{error}");
    }
}

#[test]
fn an_invalid_visit_goal_is_refused_by_field_and_value() {
    for [member, value, fault] in rows(
        r#"
        auvs        | ["auv-0", "auv-1", "auv-0"]          | auvs/2: duplicate name (given: "auv-0")
        auvs        | ["auv-0", "x"]                       | auvs/1: no vehicle in `auvs` has this id (given: "x")
        auvs        | []                                   | auvs: must have 1 to 16 items (given: 0)
        within_m    | 0.5                                  | within_m: must be from 1 to 5000 (given: 0.5)
        dwell_min_s | -1.0                                 | dwell_min_s: must be from 0 to 3600 (given: -1.0)
        weights     | { "auv-0": 0, "auv-1": 0, "auv-2": 0 } | weights: at least one
        weights     | { "auv-1": -1 }                      | weights/auv-1: must be from 0 to 1000000 (given: -1.0)
        serve_by_s  | { "x": 1 }                           | serve_by_s/x: only vehicles in goal/auvs
        costs_now   | { "auv-1": 1e13 }                    | costs_now/auv-1: must be from 0 to 1000000000000 (given
        next        | "y"                                  | next: only vehicles in goal/auvs
        cost | { "kind": "data", "growth_kbps": 1, "upload_kbps": 0, "range_max_m": 9 } | cost/upload_kbps: must be from 0.001 to 1000000 (given: 0.0)
        cost | { "kind": "uncertainty", "growth_m2ps": 1e9 } | cost/growth_m2ps: must be from 0.000001 to 1000000 (given
        "#,
    ) {
        let mut request = random(0, 3, 100.0);
        let mut goal = serde_json::to_value(&request.goal).expect("is JSON");
        goal[member] = serde_json::from_str(&value).expect("is JSON");
        request.goal = task(goal).expect("has the shape");
        let error = Snapshot::try_from(request).expect_err("is refused").to_string();
        assert!(error.contains(&format!("/goal/{fault}")), "{error}");
    }
}
