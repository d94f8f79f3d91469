//! The goal along a schedule, and its weights on the way.

use super::*;

#[test]
fn a_plan_follows_and_returns_its_schedule() {
    let mut request = random(12, 3, 120.0);
    request.acoustics = Some(Acoustics { range_max_m: 2000.0 });
    let (parameters, mut workspace) = (crate::Parameters::default(), crate::Workspace::default());
    let snapshot = Snapshot::try_from(request.clone()).expect("valid");
    let plan = crate::plan(&snapshot, &parameters, &mut workspace);
    let schedule = plan.schedule.clone().expect("the goal visits");
    assert!(!schedule.kept);
    // The AUV that the schedule serves now or next, until departure.
    let (next, leave) = (&schedule.visits[0].auv, schedule.visits[0].leave_s);
    for (at, place) in plan
        .goal
        .iter()
        .enumerate()
        .filter(|(_, place)| place.t_s < leave)
    {
        let target = plan
            .targets
            .iter()
            .find(|target| target.id == *next)
            .expect("is there");
        assert!((target.trajectory[at].position() - place.motion().position).norm() < 1e-9);
    }
    request.t_s += 1.0;
    visits(&mut request).costs_now.clear();
    request.previous_plan = Some((&plan).into());
    let after = crate::plan(
        &Snapshot::try_from(request).expect("valid"),
        &parameters,
        &mut workspace,
    );
    let after = after.schedule.expect("the goal visits");
    assert!(after.kept && after.visits[0].auv == schedule.visits[0].auv);
}

#[test]
fn a_distant_next_auv_does_not_shorten_a_visit() {
    // 40 m before the first AUV, at full speed; the next one is 600 m behind it.
    let at = |north: f64| AuvState::new(Vector2::new(north, 0.0), 5.0, Course::new(0.0), 0.0);
    let auvs = vec![Auv::new("here", at(40.0)), Auv::new("far", at(-560.0))];
    let mut goal = Visits::new(auvs.iter().map(|auv| auv.id.clone()).collect());
    (goal.cost, goal.dwell_min_s) = (costs()[1], Some(30.0));
    goal.costs_now = [("here".into(), 1.0), ("far".into(), 20.0)].into();
    goal.next = Some("here".into());
    let craft = Asc::new(Vector2::zeros(), Heading::new(0.0), SPEED);
    let request = PlanRequest::new(1000.0, craft, auvs, Goal::Visit(goal));
    let snapshot = Snapshot::try_from(request).expect("valid");
    let plan = crate::plan(
        &snapshot,
        &crate::Parameters::default(),
        &mut crate::Workspace::default(),
    );
    let schedule = plan.schedule.expect("the goal visits");
    let (first, second) = (&schedule.visits[0], &schedule.visits[1]);
    let last = plan.goal.last().expect("has points");
    assert!(
        first.leave_s + 5.0 < last.t_s,
        "the program sees the end of the visit"
    );
    let mut during = 0;
    for (goal, planned) in plan.goal.iter().zip(&plan.trajectory) {
        let from_here = (goal.motion().position - Vector2::new(40.0, 0.0)).norm();
        let leg = 600.0 / (second.arrive_s - first.leave_s);
        let expected = leg * (goal.t_s - first.leave_s).max(0.0);
        assert!(
            (from_here - expected).abs() < 0.1,
            "{from_here} m, expected {expected}"
        );
        if first.arrive_s + 5.0 < goal.t_s && goal.t_s < first.leave_s {
            during += 1;
            let distance = (planned.position() - Vector2::new(40.0, 0.0)).norm();
            assert!(distance < 20.0, "{distance} m at {} s", goal.t_s);
        }
    }
    assert!(3 < during, "{during} points during the visit");
}

#[test]
fn the_goal_departs_from_the_first_auv_no_faster_than_the_craft() {
    let mut n_legs = 0;
    for apart in [41.0, 45.0, 60.0, 300.0] {
        for (course, speed) in [(0.0, 0.0), (0.7, 0.4), (4.0, 0.3)] {
            let at = |north: f64| AuvState::new(Vector2::new(north, 0.0), 5.0, Course::new(course), speed);
            let auvs = vec![Auv::new("here", at(40.0)), Auv::new("there", at(40.0 + apart))];
            let mut goal = Visits::new(auvs.iter().map(|auv| auv.id.clone()).collect());
            (goal.cost, goal.dwell_min_s) = (costs()[1], Some(30.0));
            goal.costs_now = [("here".into(), 0.8), ("there".into(), 12.0)].into();
            goal.next = Some("here".into());
            let craft = Asc::new(Vector2::new(59.0, 0.0), Heading::new(0.0), 1.0);
            let request = PlanRequest::new(1000.0, craft, auvs, Goal::Visit(goal));
            let snapshot = Snapshot::try_from(request).expect("valid");
            let parameters = crate::Parameters::default();
            let (goal, schedule) =
                crate::plan::scheduled_goal(&snapshot, &parameters, None, &crate::Stop::never());
            let schedule = schedule.expect("the goal visits");
            let leave = schedule.visits[0].leave_s - 1000.0;
            n_legs += usize::from(schedule.visits.len() > 1);
            let jump = (goal.at(leave + 1e-6).position - goal.at(leave - 1e-6).position).norm();
            assert!(jump < 1e-3, "{apart} m apart, {jump} m");
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
        let next = scheduled(&request).visits[0].auv.clone();
        for auv in request.auvs.iter_mut().filter(|auv| (auv.id == next) == of_next) {
            let state = auv.state.as_mut().expect("has a state");
            let variance = sigma * sigma;
            state.covariance = Some([
                [variance, 0.0, 0.0, 0.0],
                [0.0, variance, 0.0, 0.0],
                [0.0, 0.0, 0.01, 0.0],
                [0.0, 0.0, 0.0, 0.01],
            ]);
        }
        visits(&mut request).next = Some(next);
        let snapshot = Snapshot::try_from(request).expect("valid");
        let parameters = crate::Parameters::default();
        let (goal, _) = crate::plan::scheduled_goal(&snapshot, &parameters, None, &crate::Stop::never());
        parameters.weights_for(&snapshot, &goal)
    };
    assert_eq!(weights(1.0, false), weights(80.0, false));
    assert_ne!(weights(1.0, true), weights(80.0, true));
}
