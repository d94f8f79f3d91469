//! The goal along a schedule, and its weights on the way.

use super::*;
use crate::predict::goal::GoalForecast;

#[test]
fn a_plan_follows_and_returns_its_schedule() {
    let mut request = random(12, 3, 120.0);
    request.acoustics = Some(Acoustics { range_max_m: 2000.0 });
    let plan = planned(&request);
    let schedule = plan.schedule.clone().expect("the goal visits");
    assert!(!schedule.kept);
    // The AUV that the schedule serves now or next, until departure.
    let first = &schedule.visits[0];
    let target = plan.targets.iter().find(|target| target.id == first.auv);
    let target = target.expect("is there");
    for (goal, target) in plan.goal.iter().zip(&target.trajectory) {
        if goal.t_s < first.leave_s {
            near_to(target.position(), goal.motion().position, 1e-9);
        }
    }
    request.t_s += 1.0;
    visits(&mut request).costs_now.clear();
    request.previous_plan = Some((&plan).into());
    let after = planned(&request).schedule.expect("the goal visits");
    assert!(after.kept && after.visits[0].auv == first.auv);
}

#[test]
fn ranges_are_taken_on_an_arc_about_the_visited_auv_and_fixes_right_above_it() {
    let auvs = [("here", moving(10.0, 0.0, 25.0, 0.0, 0.0), 30.0), ("far", resting(-600.0, 0.0), 2.0)];
    let goals = [1, 3].map(|cost| {
        let mut request = two(&auvs, 0.0, SPEED);
        let goal = visits(&mut request);
        (goal.cost, goal.within_m, goal.dwell_min_s) = (costs()[cost], None, None);
        goal.next = Some("here".into());
        (planned(&request), goal_within(&request))
    });
    let [(above, _), (arc, within)] = goals;
    assert_eq!((above.figure, within), (None, 40.0));
    let figure = arc.figure.clone().expect("ranges are taken");
    assert_eq!(figure.vehicles[0].auv, "here".into());
    let leave = arc.schedule.as_ref().expect("the goal visits").visits[0].leave_s;
    let mut farthest = 0.0_f64;
    for goal in arc.goal.iter().filter(|goal| goal.t_s < leave) {
        let distance = (goal.motion().position - Vector2::new(10.0, 0.0)).norm();
        assert!(9.0 < distance && distance <= 0.8 * within + 1e-9, "{distance}");
    }
    for stage in &arc.trajectory {
        farthest = farthest.max((stage.position() - Vector2::new(10.0, 0.0)).norm());
    }
    assert!((15.0..40.0).contains(&farthest), "{farthest}");
}

fn goal_within(request: &PlanRequest) -> f64 {
    let Goal::Visit(visits) = &request.goal.goal else { panic!("the goal visits") };
    visits.within()
}

#[test]
fn the_goal_leaves_an_arc_without_a_jump() {
    for seed in 0..40 {
        let mut request = random(seed, 3, 150.0);
        (request.current, request.asc.speed_mps) = (None, 1.0);
        let goal = visits(&mut request);
        (goal.cost, goal.within_m, goal.dwell_min_s) = (costs()[3], None, Some(5.0));
        let (_, goal, schedule) = scheduled_goal(request);
        let [first, second, ..] = &schedule.visits[..] else { continue };
        let leave = first.leave_s - 1000.0;
        if first.leave_s < second.arrive_s {
            near_to(goal.at(leave + 1e-6).position, goal.at(leave - 1e-6).position, 1e-3);
        }
    }
}

fn planned(request: &PlanRequest) -> crate::Plan {
    let snapshot = Snapshot::try_from(request.clone()).expect("valid");
    crate::plan(&snapshot, &crate::Parameters::default(), &mut crate::Workspace::default())
}

/// The goal along the schedule of a request.
fn scheduled_goal(request: PlanRequest) -> (Snapshot, GoalForecast, Schedule) {
    let snapshot = Snapshot::try_from(request).expect("valid");
    let (parameters, never) = (crate::Parameters::default(), crate::Stop::never());
    let (goal, schedule) = crate::plan::scheduled_goal(&snapshot, &parameters, None, &never);
    (snapshot, goal, schedule.expect("the goal visits"))
}

#[test]
fn a_distant_next_auv_does_not_shorten_a_visit() {
    // 40 m before the first AUV, at full speed; the next one is 600 m behind it.
    let auvs = [("here", resting(40.0, 0.0), 1.0), ("far", resting(-560.0, 0.0), 20.0)];
    let mut request = two(&auvs, 0.0, SPEED);
    let goal = visits(&mut request);
    (goal.cost, goal.dwell_min_s, goal.next) = (costs()[1], Some(30.0), Some("here".into()));
    let plan = planned(&request);
    let schedule = plan.schedule.expect("the goal visits");
    let (first, second) = (&schedule.visits[0], &schedule.visits[1]);
    // The program sees the end of the visit.
    let last = plan.goal.last().expect("has points");
    assert!(first.leave_s + 5.0 < last.t_s);
    let from_here = |position: Vector2<f64>| (position - Vector2::new(40.0, 0.0)).norm();
    let mut during = 0;
    for (goal, planned) in plan.goal.iter().zip(&plan.trajectory) {
        let leg = 600.0 / (second.arrive_s - first.leave_s);
        let expected = leg * (goal.t_s - first.leave_s).max(0.0);
        near(from_here(goal.motion().position), expected, 0.1);
        if first.arrive_s + 5.0 < goal.t_s && goal.t_s < first.leave_s {
            during += 1;
            assert!(from_here(planned.position()) < 20.0, "at {} s", goal.t_s);
        }
    }
    assert!(3 < during, "{during} points during the visit");
}

#[test]
fn the_goal_departs_from_the_first_auv_no_faster_than_the_craft() {
    let mut n_legs = 0;
    for apart in [41.0, 45.0, 60.0, 300.0] {
        for (course, speed) in [(0.0, 0.0), (0.7, 0.4), (4.0, 0.3)] {
            let at = |north: f64| moving(north, 0.0, 5.0, course, speed);
            let mut request = two(&[("here", at(40.0), 0.8), ("there", at(40.0 + apart), 12.0)], 0.0, 1.0);
            request.asc.north_m = 59.0;
            let goal = visits(&mut request);
            (goal.cost, goal.dwell_min_s, goal.next) = (costs()[1], Some(30.0), Some("here".into()));
            let (_, goal, schedule) = scheduled_goal(request);
            let leave = schedule.visits[0].leave_s - 1000.0;
            n_legs += usize::from(schedule.visits.len() > 1);
            let found = goal.at(leave + 1e-6).position;
            near_to(found, goal.at(leave - 1e-6).position, 1e-3);
            for time in 0..1200 {
                let velocity = goal.at(0.1 * f64::from(time)).velocity.norm();
                assert!(velocity <= 1.5 + 1e-9, "{apart} m apart: {velocity} m/s");
            }
        }
    }
    assert_eq!(n_legs, 12);
}

#[test]
fn uncertainty_of_other_auvs_keeps_the_weight_of_the_next() {
    let weights = |sigma: f64, of_next: bool| {
        let mut request = random(12, 3, 300.0);
        let next = next(&request);
        for auv in request.auvs.iter_mut().filter(|auv| (auv.id == next) == of_next) {
            let variances = [sigma * sigma, sigma * sigma, 0.01, 0.01];
            let covariance = nalgebra::Matrix4::from_diagonal(&variances.into());
            auv.state.as_mut().expect("has a state").covariance = Some(covariance.into());
        }
        visits(&mut request).next = Some(next);
        let (snapshot, goal, _) = scheduled_goal(request);
        crate::Parameters::default().weights_for(&snapshot, &goal)
    };
    assert_eq!(weights(1.0, false), weights(80.0, false));
    assert_ne!(weights(1.0, true), weights(80.0, true));
}
