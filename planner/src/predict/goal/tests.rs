use super::*;
use crate::{
    craft::description::CraftDescription,
    estimate::tests::Random,
    facts::{
        angle::{Heading, direction, wrap},
        asc::{Asc, Limits},
        auv::{Auv, VehicleId},
        evidence::{AuvState, Report},
        goal::Task,
        known_path::DeclaredPath,
        path::curve::Path,
    },
    snapshot::request::PlanRequest,
};

fn auv(id: &str, north: f64, east: f64, course: f64) -> Auv {
    Auv::new(
        id,
        AuvState::new(Vector2::new(north, east), 5.0, Course::new(course), 0.193),
    )
}

fn state(auv: &mut Auv) -> &mut AuvState {
    auv.state.as_mut().expect("the state is given")
}

fn ids(names: &[&str]) -> Vec<VehicleId> {
    names.iter().map(|name| VehicleId((*name).into())).collect()
}

fn observation(auvs: Vec<Auv>, goal: impl Into<Task>) -> PlanRequest {
    PlanRequest {
        limits: Some(Limits::MEDUSA.into()),
        craft: Some(CraftDescription::default()),
        ..PlanRequest::new(
            0.0,
            Asc::new(Vector2::zeros(), Heading::new(0.0), 0.3),
            auvs,
            goal,
        )
    }
}

fn track(vehicle: Auv, offset: Offset) -> PlanRequest {
    let goal = Goal::Track {
        auv: vehicle.id.clone(),
    };
    let offset = Some(offset);
    observation(vec![vehicle], Task { goal, offset })
}

fn forecast(observation: &PlanRequest) -> GoalForecast {
    GoalForecast::new(&Snapshot::try_from(observation.clone()).expect("valid"))
}

/// Three AUVs with different courses, one of them turning, at three depths.
fn three() -> Vec<Auv> {
    let mut three = vec![
        auv("a", 0.0, 0.0, 0.3),
        auv("b", 40.0, 55.0, 1.1),
        auv("c", -20.0, 70.0, -0.4),
    ];
    state(&mut three[0]).turn_rate_radps = 0.02;
    state(&mut three[1]).depth_m = 20.0;
    three
}

/// On the first lane of a lawn-mower, 10 m before its turn of 10 m radius, 2 m to starboard.
fn mower() -> Auv {
    let path = Path::lawn_mower(Vector2::zeros(), 0.0, 50.0, 20.0, 3);
    Auv {
        path: Some(DeclaredPath::new(&path, 0.5)),
        ..auv("a", 40.0, 2.0, 0.0)
    }
}

#[test]
fn turns_are_half_open_also_before_the_epoch() {
    let at = |elapsed: [f64; 6], n| elapsed.map(|elapsed| in_turn(elapsed, 240.0, n));
    assert_eq!(
        at([-480.1, -240.0, -0.1, 0.0, 239.9, 240.0], 2),
        [1, 1, 1, 0, 0, 1]
    );
    assert_eq!(at([0.0, 240.0, 480.0, 719.9, 720.0, -0.1], 3), [0, 1, 2, 2, 0, 2]);
}

#[test]
fn equal_weights_give_the_midpoint_and_weight_0_excludes_an_auv() {
    let goal = |weights: &[f64]| Goal::Weighted {
        weights: ids(&["a", "b", "c"])
            .into_iter()
            .zip(weights.iter().copied())
            .collect(),
    };
    let at = |goal: Goal, ahead| forecast(&observation(three(), goal)).at(ahead);
    let midpoint = |names: &[&str]| Goal::Midpoint { auvs: ids(names) };
    for ahead in [0.0, 30.0, 78.0] {
        for (weighted, plain) in [
            (goal(&[0.3, 0.3, 0.3]), midpoint(&["a", "b", "c"])),
            (goal(&[5e5, 0.0, 5e5]), midpoint(&["a", "c"])),
            (goal(&[0.0, 1e-300, 0.0]), midpoint(&["b"])),
        ] {
            let (weighted, plain) = (at(weighted, ahead), at(plain, ahead));
            assert!((weighted.position - plain.position).norm() < 1e-12);
            assert!((weighted.velocity - plain.velocity).norm() < 1e-12);
        }
    }
    // The weights 0.7 and 0.3 are three tenths along the line.
    let (a, b) = (at(midpoint(&["a"]), 9.0), at(midpoint(&["b"]), 9.0));
    let between = at(goal(&[0.7, 0.3, 0.0]), 9.0);
    assert!((between.position - a.position.lerp(&b.position, 0.3)).norm() < 1e-12);
    assert_eq!(
        forecast(&observation(three(), goal(&[0.7, 0.3, 0.0])))
            .members()
            .len(),
        2
    );
}

#[test]
fn a_range_goal_has_equal_largest_ranges_and_moves_with_a_formation() {
    let goal = Goal::Range {
        auvs: ids(&["a", "b", "c"]),
        range_m: 90.0,
    };
    let slants = |auvs: &[Auv], place: Vector2<f64>| -> Vec<f64> {
        let slant = |auv: &Auv| {
            let state = auv.state.as_ref().expect("is given");
            (place - state.position()).norm().hypot(state.depth_m)
        };
        auvs.iter().map(slant).collect()
    };
    let auvs = three();
    let here = forecast(&observation(auvs.clone(), goal.clone())).at(0.0);
    let slants = slants(&auvs, here.position);
    let worst = slants.iter().copied().fold(0.0, f64::max);
    let farthest = slants.iter().filter(|slant| worst - **slant < 1e-9).count();
    assert!(2 <= farthest, "{slants:?}");

    // All rotate about one centre: each at its own speed, and the point likewise.
    let centre = Vector2::new(10.0, -30.0);
    let mut formation = three();
    for auv in &mut formation {
        let state = state(auv);
        let arm = state.position() - centre;
        let velocity = Vector2::new(-arm.y, arm.x) * 0.01;
        (state.course_rad, state.speed_mps, state.turn_rate_radps) =
            (Course::of(&velocity).radians(), velocity.norm(), 0.01);
    }
    assert_velocity_is_the_slope(&observation(formation, goal), &[0.0, 25.0, 78.0]);
}

/// Central differences over 2 ms, of second order; rounding of 100 m leaves 10⁻¹¹ m/s.
fn assert_velocity_is_the_slope(observation: &PlanRequest, times: &[f64]) {
    let (goal, h) = (forecast(observation), 1e-3);
    for ahead in times {
        let slope = (goal.at(ahead + h).position - goal.at(ahead - h).position) / (2.0 * h);
        let velocity = goal.at(*ahead).velocity;
        assert!(
            (slope - velocity).norm() < 1e-7,
            "{velocity} and {slope} at {ahead} s"
        );
    }
}

#[test]
fn a_turning_offset_adds_to_the_velocity() {
    let by = Vector2::new(-12.0, 7.0);
    let mut turning = auv("a", 3.0, 4.0, 2.0);
    state(&mut turning).turn_rate_radps = -0.02;
    let times = [0.0, 10.0, 19.0, 31.3, 78.0];
    for offset in [Offset::ned(by), Offset::target(by)] {
        assert_velocity_is_the_slope(&track(turning.clone(), offset), &times);
    }
    // The path's arc lasts from 20 s, at 0.5 m/s, to less than 83 s.
    for offset in [Offset::ned(by), Offset::target(by), Offset::path(by)] {
        let mut drifting = track(mower(), offset);
        assert_velocity_is_the_slope(&drifting, &times);
        drifting.current = Some(Vector2::new(0.05, 0.1).into());
        assert_velocity_is_the_slope(&drifting, &times);
    }
    for goal in [
        Goal::Midpoint {
            auvs: ids(&["a", "b", "c"]),
        },
        Goal::Intermittent {
            auvs: ids(&["b", "a"]),
            dwell_s: 15.0,
            epoch_s: -6.5,
        },
    ] {
        let offset = Some(Offset::target(by));
        let seen = observation(three(), Task { goal, offset });
        assert_velocity_is_the_slope(&seen, &times);
    }
}

#[test]
fn an_offset_is_along_its_axes() {
    let by = Vector2::new(10.0, 3.0);
    let vehicle = mower();
    let arm = |offset, ahead| {
        let goal = forecast(&track(vehicle.clone(), offset));
        goal.at(ahead).position - goal.followed(ahead).position
    };
    // The lane leads north.
    for offset in [Offset::ned(by), Offset::target(by), Offset::path(by)] {
        assert!((arm(offset, 0.0) - by).norm() < 1e-9, "{offset:?}");
    }
    // After the half circle it leads south.
    for (offset, sign) in [
        (Offset::ned(by), 1.0),
        (Offset::target(by), -1.0),
        (Offset::path(by), -1.0),
    ] {
        assert!((arm(offset, 100.0) - by * sign).norm() < 1e-9, "{offset:?}");
    }
    // In still water the course is the path's tangent throughout.
    let apart = arm(Offset::target(by), 50.0) - arm(Offset::path(by), 50.0);
    assert!(apart.norm() < 1e-9);
}

#[test]
fn a_path_that_is_not_followed_still_gives_the_direction() {
    let mut resting = mower();
    (state(&mut resting).speed_mps, state(&mut resting).course_rad) = (0.0, 2.5);
    let by = Vector2::new(10.0, 3.0);
    let goal = forecast(&track(resting, Offset::path(by)));
    assert!((goal.at(60.0).position - Vector2::new(50.0, 5.0)).norm() < 1e-9);
    assert_eq!(goal.at(60.0).velocity, Vector2::zeros());
}

#[test]
fn at_rest_the_axes_are_remembered_or_else_reported() {
    let mut resting = auv("a", 0.0, 0.0, 1.0);
    state(&mut resting).speed_mps = 0.0;
    let mut seen = track(resting, Offset::target(Vector2::new(10.0, 0.0)));
    assert!((forecast(&seen).at(40.0).position - direction(1.0) * 10.0).norm() < 1e-12);
    seen.previous_plan = Some(PreviousPlan {
        goal_course_rad: Some(-2.0),
        ..PreviousPlan::default()
    });
    assert!((forecast(&seen).at(40.0).position - direction(-2.0) * 10.0).norm() < 1e-12);
    assert_eq!(forecast(&seen).course(), Course::new(-2.0));
    assert_eq!(forecast(&seen).at(40.0).velocity, Vector2::zeros());
    let snapshot = Snapshot::try_from(seen).expect("valid");
    let asked = GoalForecast::holding(&snapshot, Some(Course::new(0.5)));
    assert!((asked.at(0.0).position - direction(0.5) * 10.0).norm() < 1e-12);
}

/// A goal from fixes, one every ten seconds with σ 1.5 m: the AUV moves at `speed` for five minutes
/// on a course of 1 rad, then rests. Returns the offset's directions, second by second, after a
/// rest of 300 s.
fn directions_beside_a_vehicle_at_rest(seed: u64, speed: f64) -> Vec<f64> {
    let mut random = Random(seed);
    let moved = 300.0;
    let fixes: Vec<_> = (0..120_u32)
        .map(|k| {
            let time = 10.0 * f64::from(k);
            let position = direction(1.0) * (speed * time.min(moved)) + random.normal() * 1.5;
            Report::new(time, position, 1.5)
        })
        .collect();
    let (mut held, mut arms) = (None, Vec::new());
    for second in 20..1200_u32 {
        let now = f64::from(second);
        let heard: Vec<_> = fixes
            .iter()
            .filter(|fix| fix.t_s <= now && now - fix.t_s <= 300.0)
            .copied()
            .collect();
        let mut seen = track(Auv::reported("a", heard), Offset::target(Vector2::new(50.0, 0.0)));
        seen.t_s = now;
        let goal = GoalForecast::holding(&Snapshot::try_from(seen).expect("valid"), held);
        held = Some(goal.course());
        if moved + 300.0 <= now {
            arms.push(crate::facts::angle::angle_of(
                &(goal.at(0.0).position - goal.followed(0.0).position),
            ));
        }
    }
    arms
}

#[test]
fn an_offset_beside_a_vehicle_at_rest_is_stable() {
    // With a detectable speed, the offset rests ahead, otherwise at its first direction.
    for (speed, ahead) in [(0.5, Some(1.0)), (0.0, None)] {
        let mut moves = 0;
        for seed in 0..20 {
            let arms = directions_beside_a_vehicle_at_rest(seed, speed);
            let stays = ahead.unwrap_or(arms[0]);
            let farthest = arms.iter().map(|arm| wrap(arm - stays).abs()).fold(0.0, f64::max);
            moves += usize::from(farthest > 0.3);
        }
        // A velocity beyond its 99 % quantile occurs occasionally.
        assert!(moves <= 2, "{moves} of 20");
    }
}

#[test]
fn a_mean_that_comes_to_rest_keeps_its_last_course() {
    // One moves straight and the other turns to starboard until they are opposite, after 62.8 s:
    // the mean slows down, and its course turns half as fast.
    let mut turning = auv("b", 0.0, 30.0, 0.0);
    state(&mut turning).turn_rate_radps = 0.05;
    let goal = Goal::Midpoint {
        auvs: ids(&["a", "b"]),
    };
    let offset = Some(Offset::target(Vector2::new(10.0, 0.0)));
    let seen = observation(vec![auv("a", 0.0, 0.0, 0.0), turning], Task { goal, offset });
    let goal = forecast(&seen);
    let arm = |ahead: f64| goal.at(ahead).position - goal.followed(ahead).position;
    // ‖v_m‖ = 0.193 cos(ω t / 2): first below 0.05 m/s at a turn of acos(0.05/0.193).
    let turned = (0.05_f64 / 0.193).acos();
    let stop = turned / 0.025;
    assert!((arm(stop - 1e-3) - direction(turned) * 10.0).norm() < 1e-3);
    for ahead in [stop + 1e-3, stop + 1.0, 62.8] {
        assert!((arm(ahead) - direction(turned) * 10.0).norm() < 1e-5, "{ahead}");
        assert_eq!(goal.at(ahead).velocity, goal.followed(ahead).velocity);
    }
    // After the rest it moves backwards.
    let start = std::f64::consts::TAU / 0.05 - stop;
    let back = crate::facts::angle::angle_of(&arm(start + 1e-3));
    assert!(
        wrap(back - (turned + 2.0 * (std::f64::consts::FRAC_PI_2 - turned) + std::f64::consts::PI)).abs()
            < 1e-3
    );
}
