//! The goal `visit` as JSON.

use super::*;

fn task(goal: Value) -> Result<Task, String> {
    serde_json::from_value(goal).map_err(|error| error.to_string())
}

#[test]
fn a_goal_survives_json_with_explicit_defaults() {
    let short = task(json!({ "kind": "visit", "auvs": ["a", "b"] })).expect("valid");
    assert_eq!(short.goal, Goal::Visit(Visits::new(vec!["a".into(), "b".into()])));
    let spelled = serde_json::to_value(&short).expect("is JSON");
    assert_eq!(
        spelled,
        json!({ "kind": "visit", "auvs": ["a", "b"], "cost": { "kind": "age" }, "within_m": 20.0, "dwell_min_s": 0.0,
            "reduce": "mean" })
    );
    let long = json!({
        "kind": "visit", "auvs": ["a", "b"], "weights": { "a": 2.0 }, "within_m": 15.0, "dwell_min_s": 60.0,
        "cost": { "kind": "uncertainty", "growth_m2ps": 0.1, "sigma_m": 2.0, "sigma_rad": 0.01, "interval_s": 5.0 },
        "serve_by_s": { "b": 900.0 }, "reduce": "max", "costs_now": { "a": 3.0 }, "next": "b",
    });
    assert_eq!(
        serde_json::to_value(task(long.clone()).expect("valid")).expect("is JSON"),
        long
    );
    let defaulted = task(
        json!({ "kind": "visit", "auvs": ["a"], "cost": { "kind": "uncertainty", "growth_m2ps": 0.1 } }),
    );
    let VisitCost::Uncertainty {
        sigma_m,
        sigma_rad,
        interval_s,
        ..
    } = (match defaulted.expect("valid").goal {
        Goal::Visit(visits) => visits.cost,
        other => panic!("{other:?}"),
    })
    else {
        panic!("another cost")
    };
    assert_eq!([sigma_m, sigma_rad, interval_s], [1.5, 0.02, 10.0]);
    for (goal, fault) in [
        (json!({ "kind": "visit" }), "auvs"),
        (
            json!({ "kind": "visit", "auvs": ["a"], "dwell_s": 3.0 }),
            "dwell_s",
        ),
        (json!({ "kind": "midpoint", "auvs": ["a"], "next": "a" }), "next"),
        (
            json!({ "kind": "visit", "auvs": ["a"], "cost": { "kind": "data", "growth_kbps": 1.0 } }),
            "upload_kbps",
        ),
        (
            json!({ "kind": "visit", "auvs": ["a"], "cost": { "kind": "age", "sigma_m": 1.0 } }),
            "sigma_m",
        ),
    ] {
        let error = task(goal).expect_err("is refused");
        assert!(error.contains(fault), "{error}");
    }
}

#[test]
fn an_invalid_visit_goal_is_refused_by_field_and_value() {
    type Change<'a> = &'a dyn Fn(&mut Visits);
    let changes: [(Change<'_>, &str); 12] = [
        (
            &|visits| visits.auvs.push("auv-0".into()),
            "/goal/auvs/3: duplicate name (given: \"auv-0\")",
        ),
        (
            &|visits| visits.auvs.push("x".into()),
            "/goal/auvs/3: no vehicle in `auvs` has this id (given: \"x\")",
        ),
        (
            &|visits| visits.auvs.clear(),
            "/goal/auvs: must have 1 to 16 items (given: 0)",
        ),
        (
            &|visits| visits.within_m = 0.5,
            "/goal/within_m: must be from 1 to 5000 (given: 0.5)",
        ),
        (
            &|visits| visits.dwell_min_s = Some(f64::NAN),
            "/goal/dwell_min_s: must be from 0 to 3600",
        ),
        (
            &|visits| visits.weights = visits.auvs.iter().map(|id| (id.clone(), 0.0)).collect(),
            "/goal/weights: at least one",
        ),
        (
            &|visits| _ = visits.weights.insert("auv-1".into(), -1.0),
            "/goal/weights/auv-1: must be from 0 to 1000000 (given: -1.0)",
        ),
        (
            &|visits| _ = visits.serve_by_s.insert("x".into(), 1.0),
            "/goal/serve_by_s/x: only vehicles in goal/auvs",
        ),
        (
            &|visits| _ = visits.costs_now.insert("auv-1".into(), 1e13),
            "/goal/costs_now/auv-1: must be from 0 to 1000000000000 (given",
        ),
        (
            &|visits| visits.next = Some("y".into()),
            "/goal/next: only vehicles in goal/auvs",
        ),
        (
            &|visits| {
                visits.cost = VisitCost::Data {
                    growth_kbps: 1.0,
                    upload_kbps: 0.0,
                    range_max_m: 0.1,
                }
            },
            "/goal/cost/upload_kbps: must be from 0.001 to 1000000 (given: 0.0)",
        ),
        (
            &|visits| {
                visits.cost = VisitCost::Uncertainty {
                    growth_m2ps: 1e9,
                    sigma_m: 1.0,
                    sigma_rad: 0.0,
                    interval_s: 1.0,
                };
            },
            "/goal/cost/growth_m2ps: must be from 0.000001 to 1000000 (given",
        ),
    ];
    for (change, fault) in changes {
        let mut request = random(0, 3, 100.0);
        change(visits(&mut request));
        let error = Snapshot::try_from(request).expect_err("is refused").to_string();
        assert!(error.contains(fault), "{error}");
    }
}
