//! What goes out as JSON comes back as what it was.

use std::sync::Arc;

use nalgebra::{Matrix4, Vector2};
use planner::{
    angle::{Course, Heading, direction},
    craft::{
        Craft, CraftDescription, HeadingDynamics, HeadingHeld, Integrator, Preset, PropulsionPower, SpeedHeld,
    },
    los::Reference,
    path::{Path, Segment},
    plan::{Plan, Workspace, plan},
    policy::Policy,
    snapshot::{
        self as domain, Dive, Evidence, Fallback, ForecastChoice, ForecastModel, GroundTrack, HoldStyle,
        KnownPath, Limits, Offset, Report, Snapshot,
    },
};
use tests::{goals, observation, snapshot, state};
use wire::{PlanRequest, PlanResponse, PreviousPlan, plan_id};

fn through_json(snapshot: &Snapshot) -> Snapshot {
    let text = serde_json::to_string(&PlanRequest::from(snapshot)).expect("becomes JSON");
    let request: PlanRequest = serde_json::from_str(&text).expect("is a request");
    Snapshot::try_from(&request).expect("is valid")
}

fn planned(snapshot: &Snapshot) -> Plan {
    plan(snapshot, &Policy::default(), &mut Workspace::default())
}

/// Every kind of segment, with lengths and angles that no decimal fraction is.
fn known_path() -> KnownPath {
    let mower = Path::lawn_mower(Vector2::new(0.1, -1.0 / 3.0), 0.7, 50.0 / 3.0, 20.0, 3);
    let end = mower.at(mower.length());
    let mut segments = mower.segments().to_vec();
    segments.push(Segment::Waypoints {
        points: [(0.0, 0.0), (10.0, 0.0), (30.0, 0.3)]
            .map(|(length, turn)| end.position + direction(end.tangent + turn) * length)
            .to_vec(),
        fillet_radius: 20.0,
    });
    KnownPath {
        path: Arc::new(Path::from_segments(&segments, false).expect("joins")),
        horizontal_speed: 0.1 + 0.2,
    }
}

/// One that tells everything, in numbers that no decimal fraction is, and one that tells only what it must.
fn reports(now: f64) -> Vec<Report> {
    let bare = Report {
        time: now - 1.0 / 3.0,
        position: Vector2::new(12.0 + 1.0 / 3.0, -3.1),
        sigma: 1.5,
        depth: None,
        ground_track: None,
        turn_rate: None,
    };
    let whole = Report {
        time: now - 10.0 / 3.0,
        depth: Some(0.1 + 0.2),
        ground_track: Some(GroundTrack {
            course: Course::new(-3.0),
            speed: 0.2 / 3.0,
        }),
        turn_rate: Some(0.01 / 3.0),
        ..bare
    };
    vec![bare, whole]
}

#[test]
#[expect(clippy::too_many_lines, reason = "every member of a snapshot, said in full")]
fn a_snapshot_survives_the_way_through_json_to_the_bit() {
    let mut rich = observation(goals()[1].clone());
    rich.time = 1_700_000_000.123_456;
    rich.asc.ground_velocity = Some(Vector2::new(1.0 / 3.0, -0.1));
    state(&mut rich, 1).turn_rate = -0.017;
    let third = 1.0 / 3.0;
    let factor = Matrix4::from_fn(|row, column| third * (1.0 + 0.1 * f64::from(u8::from(row == column))));
    state(&mut rich, 1).covariance = Some(factor * factor.transpose());
    rich.auvs[0].evidence = Evidence::Reports(reports(rich.time));
    rich.auvs[0].path = Some(known_path());
    rich.auvs[0].dive = Some(Dive {
        depth_min: 1.0 / 3.0,
        depth_max: 23.1,
        pitch: 0.1 + 0.2,
        reversal: 10.7,
        descending: Some(false),
    });
    rich.limits = Limits {
        speed_max: 0.7,
        ..Limits::MEDUSA
    };
    rich.craft = CraftDescription {
        preset: Preset::named("otter"),
        heading_dynamics: Some(HeadingDynamics::SecondOrder {
            natural_frequency: 1.0 / 3.0,
            damping: 0.1 + 0.6,
        }),
        heading_delay: Some(0.1 + 0.2),
        heading_rate_max: Some(0.7 / 3.0),
        surge_time_constant: Some(4.9),
        surge_delay: Some(0.0),
        acceleration_max: Some(0.2 / 3.0),
        deceleration_max: Some(0.1 / 3.0),
        integrator: Some(Integrator::Gathers { time: 26.0 / 3.0 }),
        sway_per_yaw_rate: Some(-0.1 / 3.0),
        power: Some(PropulsionPower {
            linear: 1.0 / 3.0,
            cubic: 27.5,
        }),
        speed_held: Some(SpeedHeld::OverGround),
        heading_held: Some(HeadingHeld::Course),
        relative_uncertainty: Some(0.1 / 3.0),
    };
    rich.keep_outs = [3.0, 0.1 + 0.2]
        .map(|radius| domain::KeepOut {
            centre: Vector2::new(-1.0 / 3.0, 40.0),
            radius,
        })
        .to_vec();
    rich.area = [[-50.0, -50.0], [200.1, -50.0], [200.1, 1.0 / 3.0 + 150.0]]
        .map(Vector2::from)
        .to_vec();
    rich.range_max = Some(100.0 / 3.0);
    rich.surfacing_separation = Some(16.0 / 3.0);
    rich.forecast = ForecastChoice::Model(ForecastModel::ConstantTurn);
    rich.fallback = Fallback::None;
    rich.hold = HoldStyle::Stop;
    let point = domain::TrajectoryPoint {
        time: 1.0,
        position: Vector2::new(0.1 + 0.2, -4.0),
        speed: 0.3,
        heading: Heading::new(-3.0),
    };
    rich.previous_plan = Some(domain::PreviousPlan {
        trajectory: vec![point],
        goal_course: Some(Course::new(2.0)),
        current: Some(Vector2::new(0.1, 1.0 / 3.0)),
        reference: Some(Reference {
            speed: 0.7 / 3.0,
            heading: Heading::new(2.5),
        }),
        command: Some(Reference {
            speed: 0.1 + 0.2,
            heading: Heading::new(-2.5 / 3.0),
        }),
        craft: Some(planned(&snapshot(observation(goals()[0].clone()))).craft),
        targets: vec![domain::PreviousTarget {
            id: domain::VehicleId("a".to_owned()),
            model: ForecastModel::Path,
            report_age: 1.0 / 3.0,
            position: Vector2::new(2.0 / 3.0, 7.0),
            depth: 5.1,
            velocity: Vector2::new(0.1, 0.7 / 3.0),
            turn_rate: -0.01,
            drift: Vector2::new(-0.1, 0.2 / 3.0),
        }],
    });
    let rich = snapshot(rich);
    assert_eq!(through_json(&rich), rich);
    assert_eq!(plan_id(&through_json(&rich)), plan_id(&rich));

    let mut bare = observation(goals()[1].clone());
    for craft in [
        CraftDescription::default(),
        CraftDescription {
            integrator: Some(Integrator::Absent),
            heading_dynamics: Some(HeadingDynamics::FirstOrder {
                time_constant: 1.0 / 3.0,
            }),
            ..CraftDescription::default()
        },
    ] {
        bare.craft = craft;
        let bare = snapshot(bare.clone());
        assert_eq!(through_json(&bare), bare);
    }

    for goal in goals() {
        let plain = snapshot(observation(goal));
        assert_eq!(through_json(&plain), plain);
    }
}

#[test]
fn an_area_means_the_same_whichever_way_its_corners_are_listed() {
    let mut request = PlanRequest::from(&snapshot(observation(goals()[0].clone())));
    request.area = vec![[0.0, 0.0], [100.0, 0.0], [120.0, 50.0], [0.0, 80.0]];
    let clockwise = Snapshot::try_from(&request).expect("is valid");
    request.area[1..].reverse();
    let counter = Snapshot::try_from(&request).expect("is valid");
    assert_eq!(clockwise, counter);
    assert_eq!(plan_id(&clockwise), plan_id(&counter));
}

#[test]
fn an_offset_survives_the_way_through_json_to_the_bit() {
    let by = Vector2::new(-0.1, 1.0 / 3.0);
    for offset in [Offset::Ned(by), Offset::Target(by), Offset::Path(by)] {
        let mut beside = observation(goals()[0].clone());
        beside.auvs[0].path = Some(known_path());
        beside.offset = Some(offset);
        let beside = snapshot(beside);
        assert_eq!(through_json(&beside), beside);
    }
}

#[test]
fn a_range_and_a_bearing_are_another_way_to_say_north_and_east() {
    let mut request = PlanRequest::from(&snapshot(observation(goals()[0].clone())));
    let text = r#"{ "frame": "polar", "range_m": 20.0, "bearing_rad": -1.5707963267948966 }"#;
    request.goal.offset = Some(serde_json::from_str(text).expect("has the shape"));
    let Some(Offset::Ned(by)) = Snapshot::try_from(&request).expect("is valid").offset else {
        panic!("{request:?}")
    };
    assert!((by - Vector2::new(0.0, -20.0)).norm() < 1e-12, "{by}");
}

#[test]
fn weights_mean_the_same_in_any_order() {
    let read = |text: &str| {
        let mut request = PlanRequest::from(&snapshot(observation(goals()[0].clone())));
        request.goal = serde_json::from_str(text).expect("has the shape");
        Snapshot::try_from(&request).expect("is valid")
    };
    let one = read(r#"{ "kind": "weighted", "weights": { "auv-1": 0.7, "auv-2": 0.3 } }"#);
    let other = read(r#"{ "weights": { "auv-2": 0.3, "auv-1": 0.7 }, "kind": "weighted" }"#);
    assert_eq!(one, other);
    assert_eq!(plan_id(&one), plan_id(&other));
}

#[test]
fn every_forecast_has_its_own_name() {
    let models = [
        ForecastModel::Hold,
        ForecastModel::ConstantVelocity,
        ForecastModel::ConstantTurn,
        ForecastModel::Path,
    ];
    let choices = models
        .map(ForecastChoice::Model)
        .into_iter()
        .chain([ForecastChoice::Auto]);
    for choice in choices {
        let mut chosen = observation(goals()[0].clone());
        chosen.forecast = choice;
        assert_eq!(through_json(&snapshot(chosen)).forecast, choice);
    }
}

#[test]
fn what_a_dive_leaves_out_is_unknown_or_the_default_vehicles() {
    let text = r#"{ "depth_min_m": 1.0, "depth_max_m": 23.0, "pitch_rad": 0.873 }"#;
    let mut request = PlanRequest::from(&snapshot(observation(goals()[0].clone())));
    request.auvs[0].dive = Some(serde_json::from_str(text).expect("has the shape"));
    let dive = Snapshot::try_from(&request).expect("is valid").auvs[0]
        .dive
        .expect("is there");
    assert_eq!((dive.reversal, dive.descending), (Dive::REVERSAL_MEDUSA, None));
}

#[test]
fn limits_that_a_request_leaves_out_are_no_limits_but_of_speed() {
    let mut request = PlanRequest::from(&snapshot(observation(goals()[0].clone())));
    request.limits = None;
    let unlimited = Snapshot::try_from(&request).expect("is valid");
    assert_eq!(unlimited.limits, Limits::ANY);
    // The craft does what it can, which its description says.
    let model = unlimited.craft_model().limits;
    assert_eq!(model.turn_rate_max, Craft::MEDUSA.heading.rate_max);
    assert_eq!(model.acceleration_max, Craft::MEDUSA.surge.acceleration_max);
    let text = r#"{ "speed_max_mps": 0.9 }"#;
    request.limits = Some(serde_json::from_str(text).expect("has the shape"));
    let limits = Snapshot::try_from(&request).expect("is valid").limits;
    assert_eq!(
        limits,
        Limits {
            speed_max: 0.9,
            ..Limits::ANY
        }
    );
}

/// A request that says nothing of the craft but how fast it may turn and gather way means that it does so.
#[test]
fn limits_of_a_craft_that_is_not_described_describe_it() {
    let mut request = PlanRequest::from(&snapshot(observation(goals()[0].clone())));
    request.craft = None;
    let text = r#"{ "turn_rate_max_radps": 0.25, "acceleration_max_mps2": 0.07, "surge_lag_s": 3.5 }"#;
    request.limits = Some(serde_json::from_str(text).expect("has the shape"));
    let read = Snapshot::try_from(&request).expect("is valid");
    let expected = CraftDescription {
        heading_rate_max: Some(0.25),
        acceleration_max: Some(0.07),
        surge_time_constant: Some(3.5),
        ..CraftDescription::default()
    };
    assert_eq!(read.craft, expected);
    assert_eq!(
        read.craft_model().limits.deceleration_max,
        0.06,
        "the generic craft's"
    );
    // A described craft is limited by them.
    request.craft = Some(serde_json::from_str(r#"{ "preset": "otter" }"#).expect("has the shape"));
    let otter = Snapshot::try_from(&request).expect("is valid");
    let limits = otter.craft_model().limits;
    assert_eq!((limits.turn_rate_max, limits.acceleration_max), (0.2, 0.07));
    assert_eq!(limits.deceleration_max, 0.2);
    assert_eq!(otter.craft.surge_time_constant, Some(3.5));
}

#[test]
fn an_answer_handed_back_is_the_plan_that_was_made() {
    let snapshot = snapshot(observation(goals()[0].clone()));
    let plan = planned(&snapshot);
    let metadata = serde_json::Map::new();
    let answer = wire::Answer::new(&snapshot, &plan, std::time::Duration::ZERO, &metadata);
    let text = serde_json::to_string(&answer.planned()).expect("becomes JSON");
    let received: PreviousPlan = serde_json::from_str(&text).expect("has the shape");
    let handed_back = domain::PreviousPlan::from(&received);
    assert_eq!(handed_back, domain::PreviousPlan::from(&plan));
}

#[test]
fn an_answer_with_the_names_of_older_answers_is_read_as_the_same_answer() {
    let snapshot = snapshot(observation(goals()[0].clone()));
    let plan = planned(&snapshot);
    let metadata = serde_json::Map::new();
    let answer = wire::Answer::new(&snapshot, &plan, std::time::Duration::ZERO, &metadata).planned();
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
    assert_eq!(
        domain::PreviousPlan::from(&previous),
        domain::PreviousPlan::from(&plan)
    );
}
