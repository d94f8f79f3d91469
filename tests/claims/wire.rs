//! JSON that is written is read back equal.

use std::time::Duration;

use nalgebra::Vector2;
use planner::{
    craft::{Craft, CraftDescription},
    parameters::Parameters,
    plan::{Plan, Workspace, plan},
    snapshot::{Dive, Limits, Snapshot},
};
use serde_json::{Value, json};
use tests::{answer, goals, observation, random, snapshot};
use wire::{Answer, CraftFrame, Origin, PlanRequest, PlanResponse, PreviousPlan, TrajectoryPoint, plan_id};

fn through_json(request: &PlanRequest) -> PlanRequest {
    let text = serde_json::to_string(request).expect("becomes JSON");
    serde_json::from_str(&text).expect("is a request")
}

fn read(request: &PlanRequest) -> Snapshot {
    wire::snapshot(request.clone()).expect("is valid")
}

fn plain() -> PlanRequest {
    observation(goals()[0].clone())
}

fn planned(snapshot: &Snapshot) -> Plan {
    plan(snapshot, &Parameters::default(), &mut Workspace::default())
}

/// The codes of the warnings in the answer.
fn warnings(request: &PlanRequest) -> Vec<String> {
    let snapshot = read(request);
    let warnings = answer(&snapshot, &planned(&snapshot)).warnings;
    warnings.into_iter().map(|warning| warning.code).collect()
}

/// Numbers without a decimal fraction, in every member that a seed draws.
#[test]
fn a_request_survives_json_to_the_bit() {
    for seed in 0..200 {
        let request = random::observation(seed);
        assert_eq!(through_json(&request), request, "seed {seed}");
        if let (Ok(there), Ok(here)) = (wire::snapshot(through_json(&request)), wire::snapshot(request)) {
            assert_eq!((plan_id(&there), &there), (plan_id(&here), &here), "seed {seed}");
        }
    }
}

#[test]
fn an_area_and_weights_mean_the_same_in_any_order() {
    let of_area = |area: Vec<[f64; 2]>| PlanRequest { area, ..plain() };
    let weighted =
        |text: &str| PlanRequest { goal: serde_json::from_str(text).expect("has the shape"), ..plain() };
    for [one, other] in [
        [
            of_area(vec![[0.0, 0.0], [100.0, 0.0], [120.0, 50.0], [0.0, 80.0]]),
            of_area(vec![[0.0, 0.0], [0.0, 80.0], [120.0, 50.0], [100.0, 0.0]]),
        ],
        [
            weighted(r#"{ "kind": "weighted", "weights": { "auv-1": 0.7, "auv-2": 0.3 } }"#),
            weighted(r#"{ "weights": { "auv-2": 0.3, "auv-1": 0.7 }, "kind": "weighted" }"#),
        ],
    ] {
        let (one, other) = (read(&one), read(&other));
        assert_eq!((plan_id(&one), &one), (plan_id(&other), &other));
    }
}

#[test]
fn a_range_and_a_bearing_equal_north_and_east() {
    let mut request = plain();
    let text = r#"{ "frame": "polar", "range_m": 20.0, "bearing_rad": -1.5707963267948966 }"#;
    request.goal.offset = Some(serde_json::from_str(text).expect("has the shape"));
    let by = read(&request).goal.offset.expect("is there").vector();
    assert!((by - Vector2::new(0.0, -20.0)).norm() < 1e-12, "{by}");
}

/// Above an AUV that rests against the current, speed through the water is 0 over ground.
#[test]
fn a_reference_over_ground_below_the_slowest_speed_is_named() {
    let station = |speed_held: &str| {
        let request = json!({
            "schema_version": "1.0", "t_s": 0.0,
            "asc": { "north_m": 0.0, "east_m": 0.0, "heading_rad": 0.0, "speed_mps": 0.4, "sway_mps": 0.0, "yaw_rate_radps": 0.0 },
            "auvs": [{ "id": "a", "state": { "north_m": 0.0, "east_m": 0.0, "depth_m": 9.5, "course_rad": 0.0, "speed_mps": 0.0, "age_s": 0.0 } }],
            "goal": { "kind": "track", "auv": "a" },
            "current": { "north_mps": -0.4, "east_mps": 0.0 },
            "limits": { "speed_min_mps": 0.2 },
            "craft": { "preset": "medusa", "speed_held": speed_held },
        });
        let request: PlanRequest = serde_json::from_value(request).expect("is a request");
        let codes = warnings(&request);
        let is_named = codes.contains(&"reference_below_speed_min".to_owned());
        (planned(&read(&request)).reference.speed, is_named)
    };
    let (over_ground, is_named) = station("over_ground");
    assert!(over_ground < 0.2 && is_named, "{over_ground}");
    let (through_water, is_named) = station("through_water");
    assert!(0.2 <= through_water && !is_named, "{through_water}");
}

#[test]
fn two_vehicles_with_one_name_are_named_and_a_repeated_fix_counts_once() {
    let codes = |reports: Vec<Value>| {
        let request = json!({
            "schema_version": "1.0", "t_s": 1000.0, "auvs": [{ "id": "auv-1", "reports": reports }], "goal": { "kind": "track", "auv": "auv-1" },
            "asc": { "north_m": 0.0, "east_m": 0.0, "heading_rad": 0.0, "speed_mps": 0.5, "sway_mps": 0.0, "yaw_rate_radps": 0.0 },
        });
        warnings(&serde_json::from_value(request).expect("is a request"))
    };
    let fix = |second: u32, north_m: f64, later: f64| json!({ "t_s": 900.0 + f64::from(second) + later, "north_m": north_m, "east_m": 30.0, "sigma_m": 1.5 });
    let contradict = &"reports_contradict".to_owned();
    let seconds = || (0..100).step_by(5);
    let two = seconds().flat_map(|t| [fix(t, 20.0, 0.0), fix(t, 300.0, 2.0)]);
    assert!(codes(two.collect()).contains(contradict));
    let twice = seconds().flat_map(|t| [fix(t, 20.0, 0.0), fix(t, 20.04, 0.3)]);
    assert!(!codes(twice.collect()).contains(contradict));
    let outliers = seconds().map(|t| fix(t, if t % 20 == 0 { 200.0 } else { 20.0 }, 0.0));
    assert!(!codes(outliers.collect()).contains(contradict));
}

#[test]
fn omitted_members_of_a_dive_are_unknown_or_defaults() {
    let text = r#"{ "depth_min_m": 1.0, "depth_max_m": 23.0, "pitch_rad": 0.873 }"#;
    let mut request = plain();
    request.auvs[0].dive = Some(serde_json::from_str(text).expect("has the shape"));
    let dive = read(&request).auvs[0].dive.expect("is there");
    assert_eq!((dive.reversal(), dive.descending), (Dive::REVERSAL_MEDUSA, None));
}

#[test]
fn omitted_limits_limit_speed_alone() {
    let mut request = plain();
    request.limits = None;
    let unlimited = read(&request);
    assert_eq!(*unlimited.limits(), Limits::ANY);
    // Its description limits the craft.
    let model = unlimited.craft_model().limits;
    assert_eq!(model.turn_rate_max, Craft::MEDUSA.heading.rate_max);
    assert_eq!(model.acceleration_max, Craft::MEDUSA.surge.acceleration_max);
    let text = r#"{ "speed_max_mps": 0.9 }"#;
    request.limits = Some(serde_json::from_str(text).expect("has the shape"));
    let slow = Limits { speed_max: 0.9, ..Limits::ANY };
    assert_eq!(*read(&request).limits(), slow);
}

#[test]
fn members_of_a_craft_that_are_null_count_as_omitted() {
    let null = json!({ "heading_loop": null, "surge_loop": null, "preset": null, "power": null });
    let craft: CraftDescription = serde_json::from_value(null).expect("has the shape");
    assert_eq!(craft, CraftDescription::default());
}

/// Limits of turn rate and acceleration in a request without a craft describe the craft.
#[test]
fn limits_describe_an_undescribed_craft() {
    let mut request = plain();
    request.craft = None;
    let text = r#"{ "turn_rate_max_radps": 0.25, "acceleration_max_mps2": 0.07, "surge_lag_s": 3.5 }"#;
    request.limits = Some(serde_json::from_str(text).expect("has the shape"));
    let snapshot = read(&request);
    let mut expected = CraftDescription::default();
    expected.heading_loop.rate_max_radps = Some(0.25);
    expected.surge_loop.acceleration_max_mps2 = Some(0.07);
    expected.surge_loop.time_constant_s = Some(3.5);
    assert_eq!(snapshot.craft, Some(expected));
    // The generic craft's.
    assert_eq!(snapshot.craft_model().limits.deceleration_max, 0.06);
    // They limit a described craft.
    request.craft = Some(serde_json::from_str(r#"{ "preset": "otter" }"#).expect("has the shape"));
    let otter = read(&request);
    let limits = otter.craft_model().limits;
    assert_eq!((limits.turn_rate_max, limits.acceleration_max), (0.2, 0.07));
    assert_eq!(limits.deceleration_max, 0.2);
    let described = otter.craft.as_ref().expect("is spelled out");
    assert_eq!(described.surge_loop.time_constant_s, Some(3.5));
}

#[test]
fn an_answer_sent_back_equals_its_plan() {
    let snapshot = snapshot(plain());
    let plan = planned(&snapshot);
    let answer = answer(&snapshot, &plan);
    let text = serde_json::to_string(&answer).expect("becomes JSON");
    let received: PreviousPlan = serde_json::from_str(&text).expect("has the shape");
    assert_eq!(received, PreviousPlan::from(&plan));
    let mut older = serde_json::to_value(&answer).expect("becomes JSON");
    for (object, name, older_name) in [
        ("/solver", "scp_iterations", "passes"),
        ("/predicted", "cost", "merit"),
        ("/baseline", "predicted_cost", "predicted_merit"),
    ] {
        let object = older.pointer_mut(object).and_then(|value| value.as_object_mut());
        let object = object.expect("is an object");
        let value = object.remove(name).expect("is there");
        object.insert(older_name.to_owned(), value);
    }
    let received: PlanResponse = serde_json::from_value(older.clone()).expect("has the shape");
    assert_eq!(received, answer);
    let previous: PreviousPlan = serde_json::from_value(older).expect("has the shape");
    assert_eq!(previous, PreviousPlan::from(&plan));
}

/// References and tracks on Earth are the same from any origin, plan after plan.
#[test]
fn an_answer_on_earth_does_not_depend_on_the_origin() {
    let craft = (69.5, 18.0);
    let answers = |lat_deg: f64, lon_deg: f64| {
        let origin = Origin { lat_deg, lon_deg };
        let mut previous = None;
        let mut answers = vec![];
        for second in 0..3 {
            let t_s = f64::from(second);
            let at = |north: f64, east: f64| json!({ "lat_deg": craft.0 + north / 111_600.0, "lon_deg": craft.1 + east / 39_100.0 });
            let mut body = json!({
                "schema_version": "1.0", "t_s": t_s, "origin": origin, "craft": { "preset": "medusa" },
                "asc": { "heading_rad": 0.4, "speed_mps": 0.5, "ground_north_mps": 0.5, "ground_east_mps": 0.3 },
                "auvs": [{ "id": "a", "path": { "speed_mps": 0.5, "segments":
                    [{ "kind": "waypoints", "points": [at(0.0, 60.0), at(50.0, 60.0), at(50.0, 120.0)], "fillet_m": 8.0 }] } }],
                "goal": { "kind": "track", "auv": "a", "offset": { "frame": "ned", "north_m": -4.0, "east_m": 3.0 } },
                "keep_outs": [{ "radius_m": 9.0 }], "area": [at(-90.0, -90.0), at(200.0, -90.0), at(200.0, 300.0), at(-90.0, 300.0)],
            });
            let place = |into: &mut Value, north: f64, east: f64| {
                let members = into.as_object_mut().expect("is an object");
                members.append(at(north, east).as_object_mut().expect("is an object"));
            };
            place(&mut body["asc"], 0.5 * t_s, 0.3 * t_s);
            place(&mut body["keep_outs"][0], 25.0, 40.0);
            body["auvs"][0]["reports"] = json!([{ "t_s": t_s, "sigma_m": 0.5 }]);
            place(&mut body["auvs"][0]["reports"][0], 20.0 + 0.5 * t_s, 60.0);
            let request: PlanRequest = wire::read(body.to_string().as_bytes()).expect("has the shape");
            let snapshot = read(&PlanRequest { previous_plan: previous, ..request });
            let plan = planned(&snapshot);
            let metadata = serde_json::Map::new();
            let answer = Answer::new(&snapshot, &plan, Duration::ZERO, &metadata);
            let answer = answer.on_earth(Some(origin)).planned();
            let text = serde_json::to_string(&answer).expect("becomes JSON");
            let received: PreviousPlan = serde_json::from_str(&text).expect("has the shape");
            let kept = CraftFrame::previous_plan(&snapshot, &plan, Some(origin));
            assert_eq!(received.craft_estimate, kept.craft_estimate);
            previous = Some(received);
            answers.push(answer);
        }
        answers
    };
    let near = answers(craft.0, craft.1);
    // The vehicle goes 55 m along its path in frame metres, 0.15 % off at 600 km from the datum.
    for (far, metres) in [(answers(69.4, 18.3), 0.001), (answers(68.0, 4.0), 0.1)] {
        for (far, near) in far.iter().zip(&near) {
            let turned = far.reference.heading_rad - near.reference.heading_rad;
            let faster = far.reference.speed_mps - near.reference.speed_mps;
            assert!(turned.abs() < 1e-4 && faster.abs() < 1e-4, "{far:?}");
            let ends = [far, near].map(|answer| answer.trajectory.last().expect("has stages"));
            let off = |of: fn(&TrajectoryPoint) -> Option<f64>, per_degree: f64| {
                let [far, near] = ends.map(|end| of(end).expect("has a place"));
                (far - near).abs() * per_degree
            };
            let off = off(|end| end.lat_deg, 111_600.0).max(off(|end| end.lon_deg, 39_100.0));
            assert!(off < metres, "{off} m");
        }
    }
}
