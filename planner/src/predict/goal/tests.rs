use super::*;
use crate::{craft::description::CraftDescription, estimate::tests::Random, tests::prelude::*};

fn auv(id: &str, north: f64, east: f64, course: f64) -> Auv {
    Auv::new(id, moving(north, east, 5.0, course, 0.193))
}

fn state(auv: &mut Auv) -> &mut crate::AuvState {
    auv.state.as_mut().expect("the state is given")
}

fn ids(names: &[&str]) -> Vec<VehicleId> {
    names.iter().map(|name| VehicleId((*name).into())).collect()
}

fn observation(auvs: Vec<Auv>, goal: Goal, offset: Option<Offset>) -> PlanRequest {
    let asc = Asc::new(Vector2::zeros(), Heading::new(0.0), 0.3);
    PlanRequest {
        limits: Some(Limits::MEDUSA.into()),
        craft: Some(CraftDescription::default()),
        ..PlanRequest::new(0.0, asc, auvs, Task { goal, offset })
    }
}

fn track(vehicle: Auv, offset: Offset) -> PlanRequest {
    let auv = vehicle.id.clone();
    observation(vec![vehicle], Goal::Track { auv }, Some(offset))
}

fn forecast(observation: &PlanRequest) -> GoalForecast {
    GoalForecast::new(&snapshot(observation.clone()))
}

fn snapshot(observation: PlanRequest) -> Snapshot {
    Snapshot::try_from(observation).expect("valid")
}

/// From the followed point to the goal.
fn arm(goal: &GoalForecast, ahead: f64) -> Vector2<f64> {
    goal.at(ahead).position - goal.followed(ahead).position
}

/// Three AUVs with different courses, one of them turning, at three depths.
fn three() -> Vec<Auv> {
    let (a, b) = (auv("a", 0.0, 0.0, 0.3), auv("b", 40.0, 55.0, 1.1));
    let mut three = vec![a, b, auv("c", -20.0, 70.0, -0.4)];
    state(&mut three[0]).turn_rate_radps = 0.02;
    state(&mut three[1]).depth_m = 20.0;
    three
}

/// On the first lane of a lawn-mower, 10 m before its turn of 10 m radius, 2 m to starboard.
fn mower() -> Auv {
    let path = Path::lawn_mower(Vector2::zeros(), 0.0, 50.0, 20.0, 3);
    Auv { path: Some(DeclaredPath::new(&path, 0.5)), ..auv("a", 40.0, 2.0, 0.0) }
}

#[test]
fn turns_are_half_open_also_before_the_epoch() {
    let at = |elapsed: [f64; 6], n| elapsed.map(|elapsed| in_turn(elapsed, 240.0, n));
    let found = at([-480.1, -240.0, -0.1, 0.0, 239.9, 240.0], 2);
    assert_eq!(found, [1, 1, 1, 0, 0, 1]);
    assert_eq!(at([0.0, 240.0, 480.0, 719.9, 720.0, -0.1], 3), [0, 1, 2, 2, 0, 2]);
}

#[test]
fn equal_weights_give_the_midpoint_and_weight_0_excludes_an_auv() {
    let goal = |weights: &[f64]| {
        let weights = ids(&["a", "b", "c"]).into_iter().zip(weights.iter().copied());
        let weights = weights.collect();
        forecast(&observation(three(), Goal::Weighted { weights }, None))
    };
    let midpoint = |names: &[&str]| {
        let auvs = ids(names);
        forecast(&observation(three(), Goal::Midpoint { auvs }, None))
    };
    for (weighted, plain) in [
        (goal(&[0.3, 0.3, 0.3]), midpoint(&["a", "b", "c"])),
        (goal(&[5e5, 0.0, 5e5]), midpoint(&["a", "c"])),
        (goal(&[0.0, 1e-300, 0.0]), midpoint(&["b"])),
    ] {
        for ahead in [0.0, 30.0, 78.0] {
            let (weighted, plain) = (weighted.at(ahead), plain.at(ahead));
            near_to(weighted.position, plain.position, 1e-12);
            near_to(weighted.velocity, plain.velocity, 1e-12);
        }
    }
    // The weights 0.7 and 0.3 are three tenths along the line.
    let [a, b] = ["a", "b"].map(|name| midpoint(&[name]).at(9.0).position);
    let between = goal(&[0.7, 0.3, 0.0]);
    near_to(between.at(9.0).position, a.lerp(&b, 0.3), 1e-12);
    assert_eq!(between.members().len(), 2);
}

#[test]
fn a_range_goal_has_equal_largest_ranges_and_moves_with_a_formation() {
    let goal = |auvs| {
        let goal = Goal::Range { auvs: ids(&["a", "b", "c"]), range_m: 90.0 };
        observation(auvs, goal, None)
    };
    let place = forecast(&goal(three())).at(0.0).position;
    let slant = |mut auv: Auv| {
        let state = state(&mut auv);
        (place - state.position()).norm().hypot(state.depth_m)
    };
    let slants: Vec<f64> = three().into_iter().map(slant).collect();
    let worst = slants.iter().copied().fold(0.0, f64::max);
    let farthest = slants.iter().filter(|slant| worst - **slant < 1e-9).count();
    assert!(2 <= farthest, "{slants:?}");

    // All rotate about one centre: each at its own speed, and the point likewise.
    let mut formation = three();
    for auv in &mut formation {
        let state = state(auv);
        let arm = state.position() - Vector2::new(10.0, -30.0);
        let velocity = Vector2::new(-arm.y, arm.x) * 0.01;
        state.course_rad = Course::of(&velocity).radians();
        (state.speed_mps, state.turn_rate_radps) = (velocity.norm(), 0.01);
    }
    assert_velocity_is_the_slope(&goal(formation), &[0.0, 25.0, 78.0]);
}

/// Central differences over 2 ms, of second order; rounding of 100 m leaves 10⁻¹¹ m/s.
fn assert_velocity_is_the_slope(observation: &PlanRequest, times: &[f64]) {
    let goal = forecast(observation);
    for ahead in times {
        let moves = slope(|time| goal.at(time).position, *ahead, 1e-3);
        near_to(moves, goal.at(*ahead).velocity, 1e-7);
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
    let midpoint = Goal::Midpoint { auvs: ids(&["a", "b", "c"]) };
    let in_turn = Goal::Intermittent { auvs: ids(&["b", "a"]), dwell_s: 15.0, epoch_s: -6.5 };
    for goal in [midpoint, in_turn] {
        assert_velocity_is_the_slope(&observation(three(), goal, Some(Offset::target(by))), &times);
    }
}

#[test]
fn an_offset_is_along_its_axes() {
    let by = Vector2::new(10.0, 3.0);
    let [ned, target, path] =
        [Offset::ned, Offset::target, Offset::path].map(|offset| forecast(&track(mower(), offset(by))));
    // The lane leads north, and south after the half circle.
    for (goal, sign) in [(&ned, 1.0), (&target, -1.0), (&path, -1.0)] {
        near_to(arm(goal, 0.0), by, 1e-9);
        near_to(arm(goal, 100.0), by * sign, 1e-9);
    }
    // In still water the course is the path's tangent throughout.
    near_to(arm(&target, 50.0), arm(&path, 50.0), 1e-9);
}

#[test]
fn a_path_that_is_not_followed_still_gives_the_direction() {
    let mut resting = mower();
    (state(&mut resting).speed_mps, state(&mut resting).course_rad) = (0.0, 2.5);
    let goal = forecast(&track(resting, Offset::path(Vector2::new(10.0, 3.0)))).at(60.0);
    near_to(goal.position, Vector2::new(50.0, 5.0), 1e-9);
    assert_eq!(goal.velocity, Vector2::zeros());
}

#[test]
fn at_rest_the_axes_are_remembered_or_else_reported() {
    let mut resting = auv("a", 0.0, 0.0, 1.0);
    state(&mut resting).speed_mps = 0.0;
    let mut seen = track(resting, Offset::target(Vector2::new(10.0, 0.0)));
    near_to(forecast(&seen).at(40.0).position, direction(1.0) * 10.0, 1e-12);
    seen.previous_plan = Some(PreviousPlan { goal_course_rad: Some(-2.0), ..PreviousPlan::default() });
    let goal = forecast(&seen);
    near_to(goal.at(40.0).position, direction(-2.0) * 10.0, 1e-12);
    assert_eq!(goal.course(), Course::new(-2.0));
    assert_eq!(goal.at(40.0).velocity, Vector2::zeros());
    let asked = GoalForecast::holding(&snapshot(seen), Some(Course::new(0.5)));
    near_to(asked.at(0.0).position, direction(0.5) * 10.0, 1e-12);
}

/// A goal from fixes of σ 1.5 m every ten seconds: the AUV moves at `speed` for five minutes on a
/// course of 1 rad, then rests. Returns the offset's directions each second after 300 s of rest.
fn directions_beside_a_vehicle_at_rest(seed: u64, speed: f64) -> Vec<f64> {
    let mut random = Random(seed);
    let fix = |k: u32| {
        let time = 10.0 * f64::from(k);
        let position = direction(1.0) * (speed * time.min(300.0)) + random.normal() * 1.5;
        Report::new(time, position, 1.5)
    };
    let fixes: Vec<_> = (0..120).map(fix).collect();
    let (mut held, mut arms) = (None, Vec::new());
    for now in (20..1200_u32).map(f64::from) {
        let is_heard = |fix: &&Report| fix.t_s <= now && now - fix.t_s <= 300.0;
        let heard = fixes.iter().filter(is_heard).copied().collect();
        let mut seen = track(Auv::reported("a", heard), Offset::target(Vector2::new(50.0, 0.0)));
        seen.t_s = now;
        let goal = GoalForecast::holding(&snapshot(seen), held);
        held = Some(goal.course());
        if 600.0 <= now {
            arms.push(angle_of(&arm(&goal, 0.0)));
        }
    }
    arms
}

#[test]
fn an_offset_beside_a_vehicle_at_rest_is_stable() {
    // With a detectable speed, the offset rests ahead, otherwise at its first direction.
    for (speed, ahead) in [(0.5, Some(1.0)), (0.0, None)] {
        let moves = |seed: &u64| {
            let arms = directions_beside_a_vehicle_at_rest(*seed, speed);
            let stays = ahead.unwrap_or(arms[0]);
            arms.iter().any(|arm| wrap(arm - stays).abs() > 0.3)
        };
        // A velocity beyond its 99 % quantile occurs occasionally.
        let moves = (0..20).filter(moves).count();
        assert!(moves <= 2, "{moves} of 20");
    }
}

#[test]
fn a_mean_that_comes_to_rest_keeps_its_last_course() {
    // One moves straight and the other turns to starboard until they are opposite, after 62.8 s:
    // the mean slows down, and its course turns half as fast.
    let mut turning = auv("b", 0.0, 30.0, 0.0);
    state(&mut turning).turn_rate_radps = 0.05;
    let goal = Goal::Midpoint { auvs: ids(&["a", "b"]) };
    let offset = Some(Offset::target(Vector2::new(10.0, 0.0)));
    let seen = observation(vec![auv("a", 0.0, 0.0, 0.0), turning], goal, offset);
    let goal = forecast(&seen);
    // ‖v_m‖ = 0.193 cos(ω t / 2): first below 0.05 m/s at a turn of acos(0.05/0.193).
    let turned = (0.05_f64 / 0.193).acos();
    let stop = turned / 0.025;
    near_to(arm(&goal, stop - 1e-3), direction(turned) * 10.0, 1e-3);
    for ahead in [stop + 1e-3, stop + 1.0, 62.8] {
        near_to(arm(&goal, ahead), direction(turned) * 10.0, 1e-5);
        assert_eq!(goal.at(ahead).velocity, goal.followed(ahead).velocity);
    }
    // After the rest it moves backwards, from π less the turn until then.
    let start = std::f64::consts::TAU / 0.05 - stop;
    let back = 2.0 * std::f64::consts::PI - turned;
    near(wrap(angle_of(&arm(&goal, start + 1e-3)) - back), 0.0, 1e-3);
}
