//! Figures of whole requests, and the law of a measurement by a second route.

use std::f64::consts::{PI, TAU};

use nalgebra::Matrix2;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde_json::{Value, json};

use super::{candidates::FixedFigure, choose::Localiser, scene::Scene};
use crate::{
    Parameters, Workspace,
    coast::way::Search,
    facts::{
        localise::{Figure, FigureKind, Localise},
        ranges::FIGURE_ROWS_MAX,
        tuning::Tuning,
        visit::{Fixes, Reduce},
    },
    plan,
    predict::goal::forecast_all,
    snapshot::{Acoustics, KeepOut, NoGo},
    tests::prelude::*,
};

const SPEED: f64 = 1.5;
const TURN_RATE: f64 = 0.3;

fn goal(members: &Value) -> Localise {
    let mut goal = json!({ "growth_m2ps": 0.03 });
    for (member, value) in members.as_object().expect("is an object") {
        goal[member] = value.clone();
    }
    serde_json::from_value(goal).expect("is a goal")
}

/// A craft at the datum that localises these AUVs, `auv-0` and so on, each with 25 m² of variance.
fn request(states: &[AuvState]) -> PlanRequest {
    let ids: Vec<_> = (0..states.len()).map(|i| format!("auv-{i}")).collect();
    let localise = goal(&json!({
        "auvs": ids, "costs_now": ids.iter().map(|id| (id.clone(), json!(25.0))).collect::<serde_json::Map<_, _>>(),
    }));
    let auvs = ids.iter().zip(states).map(|(id, state)| Auv::new(&**id, *state));
    let craft = Asc::new(Vector2::zeros(), Heading::new(0.4), 1.0);
    let mut request = PlanRequest::new(1000.0, craft, auvs.collect(), Goal::Localise(localise));
    request.limits = Some(Limits { speed_max: SPEED, turn_rate_max: TURN_RATE, ..Limits::ANY }.into());
    request
}

fn localise(request: &mut PlanRequest) -> &mut Localise {
    let Goal::Localise(localise) = &mut request.goal.goal else { panic!("the goal localises") };
    localise
}

fn one() -> PlanRequest {
    request(&[moving(10.0, 5.0, 20.0, 0.7, 0.3)])
}

fn random(seed: u64) -> PlanRequest {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let n = rng.random_range(1..=8);
    let far = [50.0, 300.0, 3000.0][rng.random_range(0..3)];
    let states: Vec<_> = (0..n)
        .map(|_| {
            let place = direction(rng.random_range(-PI..PI)) * rng.random_range(0.0..far);
            let (depth, course) = (rng.random_range(0.0..80.0), rng.random_range(-PI..PI));
            moving(place.x, place.y, depth, course, rng.random_range(0.0..1.2))
        })
        .collect();
    let mut request = request(&states);
    request.asc.heading_rad = rng.random_range(-PI..PI);
    request.current = Some(Vector2::new(rng.random_range(-0.3..0.3), 0.1).into());
    let goal = localise(&mut request);
    for cost in goal.costs_now.values_mut() {
        *cost = rng.random_range(0.0..400.0);
    }
    if rng.random_bool(0.3) {
        goal.reduce = Reduce::Max;
    }
    request
}

fn figure(request: &PlanRequest) -> Figure {
    let snapshot = Snapshot::try_from(request.clone()).expect("valid");
    let localiser = Localiser {
        speed: SPEED,
        turn_rate: TURN_RATE,
        clearance: 1.3,
        fixed: None,
        is_stale: &|_| false,
        due: &|| false,
    };
    let found = localiser.figure(&snapshot, &forecast_all(&snapshot), None);
    found.expect("the goal localises").0
}

fn scene(request: &PlanRequest) -> Scene {
    let snapshot = Snapshot::try_from(request.clone()).expect("valid");
    let Goal::Localise(goal) = &snapshot.goal.goal else { panic!("the goal localises") };
    let auvs: Vec<_> = (0..snapshot.auvs.len()).collect();
    let forecasts = forecast_all(&snapshot);
    let ways = Search { land: snapshot.land(), clearance: 1.3, due: &|| false };
    Scene::new(&snapshot, goal, &forecasts, &auvs, (SPEED, TURN_RATE), &ways).expect("has AUVs")
}

/// Angles of two figures differ by a turn at most, and their numbers by rounding.
#[track_caller]
fn alike(found: &Figure, expected: &Figure, turned: f64) {
    let sizes = |figure: &Figure| {
        let shape = [figure.ahead_m, figure.semi_ahead_m, figure.semi_starboard_m, figure.rate_radps];
        shape.map(f64::abs)
    };
    assert_eq!(found.kind, expected.kind);
    for (found, expected) in sizes(found).into_iter().zip(sizes(expected)) {
        assert!((found - expected).abs() < 1e-6 * (1.0 + expected.abs()), "{found} {expected}");
    }
    for time in [0.0, 20.0, 50.0] {
        let ((place, _), (other, _)) = (found.at(time), expected.at(time));
        let other = ned_from_body(turned) * other;
        assert!((place - other).norm() < 1e-6 * (1.0 + place.norm()), "{place} {other} at {time} s");
    }
}

#[test]
fn a_range_adds_its_information_along_the_line_of_sight_and_none_from_right_above() {
    let scene = scene(&one());
    let before = Matrix2::new(30.0, -4.0, -4.0, 12.0);
    for (off, depth) in [([30.0, 0.0], 0.0), ([12.0, -40.0], 20.0), ([0.5, 0.5], 60.0)] {
        let mut after = before;
        let off = Vector2::from(off);
        scene.measure(&mut after, &off, depth);
        // The information form: P⁻¹ + h hᵀ / σ².
        let slope = off / off.norm().hypot(depth);
        let gained = slope * slope.transpose() / scene.noise[0];
        let expected = (before.try_inverse().expect("is regular") + gained).try_inverse();
        assert!((after - expected.expect("is regular")).norm() < 1e-9, "{after}");
    }
    let mut above = before;
    scene.measure(&mut above, &Vector2::zeros(), 20.0);
    assert_eq!(above, before);
}

#[test]
fn frequent_measurements_count_as_one_of_less_noise() {
    let [often, rarely] = [1.0, 10.0].map(|interval| {
        let mut request = one();
        localise(&mut request).interval_s = interval;
        figure(&request).vehicles[0].sigma_m
    });
    // The stationary variance of fixes is about √(q σ² Δt); ranges also need time to look about.
    let ratio = rarely / often;
    assert!((1.3..10.0_f64.powf(0.25)).contains(&ratio), "{ratio}");
}

#[test]
fn ranges_are_taken_from_a_circle_and_usbl_fixes_from_right_above() {
    let mut request = one();
    let found = figure(&request);
    assert_eq!(found.kind, FigureKind::Circle);
    assert!((15.0..60.0).contains(&found.semi_ahead_m), "{found:?}");
    let vehicle = &found.vehicles[0];
    assert!(vehicle.sigma_m < 0.4 * vehicle.sigma_above_m, "{found:?}");
    assert!(found.sentence.starts_with("circling auv-0 to "), "{}", found.sentence);
    localise(&mut request).fixes = Fixes::Usbl;
    assert_eq!(figure(&request).kind, FigureKind::Above);
}

#[test]
fn errors_over_time_begin_now_and_their_second_half_is_what_the_figure_leaves() {
    let vehicle = figure(&one()).vehicles.remove(0);
    let rows = &vehicle.over_time;
    assert_eq!((rows.len(), rows[0], rows[20][0]), (FIGURE_ROWS_MAX, [0.0, 5.0, 5.0], 600.0));
    for (column, expected) in [(1, vehicle.sigma_m), (2, vehicle.sigma_above_m)] {
        let squares: f64 = rows[11..].iter().map(|row| row[column].powi(2)).sum();
        // Every third measurement instead of each.
        assert!(((squares / 10.0).sqrt() / expected - 1.0).abs() < 0.05, "{vehicle:?}");
    }
}

#[test]
fn a_figure_about_several_auvs_is_larger_than_about_one() {
    let apart = |far: f64| {
        let east = [0.0, far].map(|east| moving(0.0, east, 20.0, 0.0, 0.3));
        let found = figure(&request(&east));
        found.semi_ahead_m.max(found.semi_starboard_m)
    };
    assert!(apart(0.0) < apart(150.0) && apart(150.0) < apart(600.0));
}

#[test]
fn a_figure_turns_with_the_request_and_knows_no_names_or_clock() {
    for seed in 0..40 {
        let request = random(seed);
        let expected = figure(&request);
        let mut turned = request.clone();
        let by = 0.9;
        for auv in &mut turned.auvs {
            let state = auv.state.as_mut().expect("is given");
            let place = ned_from_body(by) * state.position();
            (state.north_m, state.east_m) = (place.x, place.y);
            state.course_rad = wrap(state.course_rad + by);
        }
        turned.asc.heading_rad = wrap(turned.asc.heading_rad + by);
        let current: Vector2<f64> = turned.current.expect("is given").into();
        turned.current = Some((ned_from_body(by) * current).into());
        alike(&figure(&turned), &expected, by);

        let mut later = request.clone();
        later.t_s += 1.0e6;
        alike(&figure(&later), &expected, 0.0);

        let mut renamed = request.clone();
        renamed.auvs.reverse();
        localise(&mut renamed).auvs.reverse();
        alike(&figure(&renamed), &expected, 0.0);
    }
}

#[test]
fn a_mirrored_request_has_the_mirrored_figure() {
    let mut mirrored_once = 0;
    for seed in 0..40 {
        let mut request = random(seed);
        request.current = None;
        let expected = figure(&request);
        for auv in &mut request.auvs {
            let state = auv.state.as_mut().expect("is given");
            (state.east_m, state.course_rad) = (-state.east_m, -state.course_rad);
        }
        request.asc.heading_rad = -request.asc.heading_rad;
        let found = figure(&request);
        assert_eq!(found.kind, expected.kind, "seed {seed}");
        for (found, expected) in found.vehicles.iter().zip(&expected.vehicles) {
            // A zigzag abeam reverses on one line, where rounding decides the side.
            assert!((found.sigma_m - expected.sigma_m).abs() < 1e-3 * expected.sigma_m, "seed {seed}");
        }
        mirrored_once += usize::from(found.rate_radps * expected.rate_radps < 0.0);
    }
    assert!(20 < mirrored_once, "{mirrored_once}");
}

#[test]
fn an_unknown_navigation_is_said_to_be_unknown() {
    let mut request = one();
    localise(&mut request).costs_now.clear();
    let found = figure(&request);
    assert_eq!(found.vehicles[0].sigma_now_m, None);
    assert!(found.sentence.ends_with("present uncertainty not known"), "{}", found.sentence);
    let mut covariance = [[0.0; 4]; 4];
    for (i, variance) in [9.0, 16.0, 0.01, 0.01].into_iter().enumerate() {
        covariance[i][i] = variance;
    }
    request.auvs[0].state.as_mut().expect("is given").covariance = Some(covariance);
    assert_eq!(figure(&request).vehicles[0].sigma_now_m, Some(5.0));
}

#[test]
fn a_figure_keeps_the_distance_the_range_and_the_area() {
    let mut far = one();
    localise(&mut far).stand_off_m = 60.0;
    assert!(60.0 <= figure(&far).semi_ahead_m);
    let mut near = one();
    near.acoustics = Some(Acoustics { range_max_m: 30.0 });
    let found = figure(&near);
    assert!(found.semi_ahead_m.hypot(20.0) < 30.0, "{found:?}");
    // A disc where the craft would circle.
    let free = figure(&one());
    let mut closed = one();
    closed.keep_outs = vec![KeepOut::new(Vector2::new(10.0, 5.0) + direction(0.7) * 40.0, 35.0)];
    assert_ne!(figure(&closed), free);
}

#[test]
fn a_trial_goes_round_a_wall_and_costs_what_one_without_walls_does_that_is_as_far_by_way() {
    let cost = |request: &PlanRequest| {
        let scene = scene(request);
        let circle = FixedFigure { kind: FigureKind::Circle, radius_m: 20.0, speed_share: 1.0 };
        scene.sail(&scene.fixed(&circle), f64::INFINITY).expect("is sailed").cost
    };
    // A wall between the craft and the AUV, which is at rest 200 m off and heard within 60 m.
    let mut far = request(&[moving(200.0, 0.0, 20.0, 0.0, 0.0)]);
    far.acoustics = Some(Acoustics { range_max_m: 60.0 });
    let mut behind = far.clone();
    behind.asc.heading_rad = 1.3;
    let free = cost(&behind);
    behind.no_go = vec![NoGo::new(vec![[90.0, -900.0], [110.0, -900.0], [110.0, 300.0], [90.0, 300.0]])];
    // Taut round the two eastern corners.
    let by_way = 2.0 * 90.0_f64.hypot(300.0) + 20.0;
    (far.asc.north_m, far.asc.heading_rad) = (200.0 - by_way, 0.0);
    let [round, expected] = [&behind, &far].map(cost);
    assert!((round - expected).abs() < 0.05 * expected, "{round} {expected}");
    assert!(1.3 * free < round, "{free} {round}");
}

/// Plans once a second for a craft that moves as planned, and an AUV whose variance falls.
fn sailed(mut request: PlanRequest, seconds: usize, mut each: impl FnMut(&PlanRequest, &crate::Plan)) {
    let (parameters, mut workspace) = (Parameters::default(), Workspace::default());
    for _ in 0..seconds {
        let snapshot = Snapshot::try_from(request.clone()).expect("valid");
        let plan = plan(&snapshot, &parameters, &mut workspace);
        each(&request, &plan);
        let next = plan.trajectory[1];
        request.t_s += 1.0;
        (request.asc.north_m, request.asc.east_m) = (next.north_m, next.east_m);
        (request.asc.heading_rad, request.asc.speed_mps) = (next.heading_rad, next.speed_mps);
        for auv in &mut request.auvs {
            let state = auv.state.as_mut().expect("is given");
            let place = state.position() + state.velocity();
            (state.north_m, state.east_m) = (place.x, place.y);
        }
        for cost in localise(&mut request).costs_now.values_mut() {
            *cost = cost.mul_add(0.95, 0.2);
        }
        request.previous_plan = Some((&plan).into());
    }
}

#[test]
fn a_craft_goes_on_the_way_round_that_it_began_and_keeps_its_distance() {
    let mut request = one();
    localise(&mut request).stand_off_m = 15.0;
    let (mut turned, mut senses, mut angle) = (0.0, Vec::new(), None);
    sailed(request, 240, |request, plan| {
        let figure = plan.figure.as_ref().expect("the goal localises");
        assert_eq!(figure.kind, FigureKind::Circle);
        senses.push(figure.rate_radps.signum());
        let off = request.asc.position() - request.auvs[0].state.expect("is given").position();
        let now = angle_of(&off);
        turned += angle.map_or(0.0, |before| wrap(now - before));
        angle = Some(now);
        if 60 < senses.len() {
            assert!(13.0 < off.norm() && off.norm() < 60.0, "{off}");
        }
    });
    assert!(senses.iter().all(|sense| *sense == senses[0]));
    // 1.2 m/s about it at some 35 m are more than a turn in four minutes.
    assert!(TAU * 0.9 < turned.abs(), "{turned}");
}

#[test]
fn a_distance_between_two_radii_that_are_tried_is_a_radius_itself() {
    let mut request = one();
    localise(&mut request).stand_off_m = 150.0;
    request.acoustics = Some(Acoustics { range_max_m: 200.0 });
    sailed(request, 1, |_, plan| {
        let figure = plan.figure.as_ref().expect("the goal localises");
        assert!(figure.kind == FigureKind::Circle && 150.0 <= figure.size(), "{figure:?}");
    });
}

#[test]
fn every_fleet_has_a_finite_figure_and_a_plan_that_sails_it() {
    for seed in 100..160 {
        let mut request = random(seed);
        request.tuning = Some(Tuning::default());
        sailed(request, 3, |_, plan| {
            let figure = plan.figure.as_ref().expect("the goal localises");
            let (place, velocity) = figure.at(30.0);
            assert!(place.norm().is_finite() && velocity.norm() < 2.0 * SPEED, "{figure:?}");
            assert!(figure.vehicles.iter().all(|vehicle| 0.0 < vehicle.sigma_m && vehicle.sigma_m < 1e4));
        });
    }
}

#[test]
fn an_invalid_goal_is_refused_by_field_and_value() {
    for [member, value, fault] in rows(
        r#"
        auvs        | ["auv-0", "x"]   | auvs/1: no vehicle in `auvs` has this id (given: "x")
        auvs        | []               | auvs: must have 1 to 16 items (given: 0)
        growth_m2ps | 0.0              | growth_m2ps: must be from 0.000001 to 1000000 (given: 0.0)
        sigma_m     | -1.0             | sigma_m: must be from 0.001 to 100000 (given: -1.0)
        interval_s  | 0.0              | interval_s: must be from 0.1 to 3600 (given: 0.0)
        stand_off_m | 2000.0           | stand_off_m: must be from 0 to 1000 (given: 2000.0)
        weights     | { "auv-0": 0 }   | weights: at least one weight must be above 0
        weights     | { "auv-9": 1 }   | weights/auv-9: only vehicles in goal/auvs count
        costs_now   | { "auv-0": -1 }  | costs_now/auv-0: must be from 0 to 1000000000000 (given: -1.0)
        offset      | { "frame": "ned", "north_m": 5, "east_m": 0 } | offset: a goal that localises chooses the craft's place itself
        "#,
    ) {
        let mut task = json!({ "kind": "localise", "auvs": ["auv-0"], "growth_m2ps": 0.03 });
        task[&member] = serde_json::from_str(&value).expect("is JSON");
        let mut request = one();
        request.goal = serde_json::from_value(task).expect("has the shape");
        let invalid = Snapshot::try_from(request).expect_err("is refused");
        let found = invalid.to_string();
        assert!(found.contains(&format!("/goal/{fault}")), "{found}");
    }
}
