//! Memory from plan to plan: costs, and the hearing of each AUV.

use super::*;

#[test]
fn the_next_plan_drops_a_silent_auv_and_visits_a_new_one() {
    for seed in 0..30 {
        let request = random(5000 + seed, 4, 500.0);
        let schedule = scheduled(&request);
        let first = schedule.visits[0].auv.clone();
        let mut after = later(&request, &schedule, 1.0);
        assert_eq!(next(&after), first);
        let lost = after.auvs.iter_mut().find(|auv| auv.id == first);
        lost.and_then(|auv| auv.state.as_mut()).expect("is there").age_s = AGE_MAX + 1.0;
        let without = scheduled(&after);
        assert!(without.visits.iter().all(|visit| visit.auv != first) && !without.kept);
        assert_eq!(known(&without, &first).left_out, Some(LeftOut::Silent));
        says(&without, &format!("{first} is not heard any more"));
        let schedule = scheduled(&later(&request, &without, 1.0));
        assert_eq!(known(&schedule, &first).left_out, None);
        says(&schedule, &format!("{first} is heard again"));
    }
}

#[track_caller]
fn says(schedule: &Schedule, words: &str) {
    assert!(schedule.sentence.contains(words), "{}", schedule.sentence);
}

/// Reports of the AUV `id` each 10 s until `until`, s, from one position at a depth of 8 m.
fn heard(id: &VehicleId, place: Vector2<f64>, until: f64) -> Auv {
    let at = |k: u32| Report { depth_m: Some(8.0), ..Report::new(until - 10.0 * f64::from(k), place, 1.5) };
    Auv::reported(id.clone(), (0..6).map(at).collect())
}

#[test]
fn an_auv_without_reports_for_eight_intervals_is_left_out_until_heard() {
    // The hearing is independent of changes of the cost's kind.
    for kinds in [[0, 0, 0, 0], [0, 1, 2, 1]] {
        let mut request = random(31, 3, 200.0);
        let lost = request.auvs[1].id.clone();
        let place = request.auvs[1].state.as_ref().expect("has a state").position();
        let last_heard = request.t_s;
        request.auvs[1] = heard(&lost, place, last_heard);
        visits(&mut request).cost = costs()[0];
        let mut schedule = scheduled(&request);
        let left_out = |schedule: &Schedule| known(schedule, &lost).left_out;
        let ages = (1..=8).map(|k| 10.0 * f64::from(k)).chain([81.0, 82.0]);
        for (plan, age) in ages.enumerate() {
            request = later(&request, &schedule, last_heard + age - request.t_s);
            visits(&mut request).cost = costs()[kinds[plan.saturating_sub(6)]];
            // The craft finally departs; a silent AUV stays silent.
            request.asc.north_m += if age == 82.0 { 900.0 } else { 0.0 };
            schedule = scheduled(&request);
            let silent = (80.0 < age).then_some(LeftOut::Silent);
            assert_eq!(left_out(&schedule), silent, "{age}");
        }
        // An older report that arrives now adds nothing.
        request = later(&request, &schedule, 1.0);
        let reports = request.auvs[1].reports.as_mut().expect("is known by reports");
        reports.push(Report::new(last_heard - 5.0, place, 1.5));
        schedule = scheduled(&request);
        assert_eq!(left_out(&schedule), Some(LeftOut::Silent));
        request = later(&request, &schedule, 5.0);
        request.auvs[1] = heard(&lost, place, request.t_s);
        let again = scheduled(&request);
        assert_eq!(left_out(&again), None);
        assert!(again.visits.iter().any(|visit| visit.auv == lost));
        says(&again, "is heard again");
    }
}

#[test]
fn costs_continue_from_plan_to_plan_and_depend_on_the_near_auv() {
    let mut request = random(7, 2, 1.0);
    (request.auvs[0].state, request.auvs[1].state) = (Some(resting(5.0, 0.0)), Some(resting(400.0, 0.0)));
    visits(&mut request).cost = VisitCost::Age;
    let schedule = scheduled(&request);
    let after = scheduled(&later(&request, &schedule, 12.0));
    near(after.costs[0].cost, 0.0, 1e-12);
    near(after.costs[1].cost, schedule.costs[1].cost + 12.0, 1e-9);
    // Costs of another kind are unknown.
    let mut other = later(&request, &schedule, 12.0);
    visits(&mut other).cost = costs()[2];
    let anew = scheduled(&other);
    assert_eq!(anew.unit, CostUnit::Kilobits);
    assert!(anew.costs.iter().all(|known| known.cost == 0.0));
}

#[test]
fn a_schedule_without_hearing_is_accepted_and_an_impossible_one_is_refused() {
    type Change = fn(&mut ServedVehicle);
    let request = random(0, 3, 100.0);
    let mut before = serde_json::to_value(scheduled(&request)).expect("is JSON");
    for known in before["costs"].as_array_mut().expect("is a list") {
        let known = known.as_object_mut().expect("is an object");
        assert!(known.remove("heard_within_m").is_some() && known.remove("unheard_s").is_some());
    }
    let older: Schedule = serde_json::from_value(before).expect("both are optional");
    let costs = scheduled(&later(&request, &older, 1.0)).costs;
    assert!(costs.iter().all(|known| known.left_out.is_none()));
    let far: Change = |known| known.heard_within_m = -1.0;
    let long: Change = |known| known.unheard_s = 3e11;
    for (change, fault) in [
        (far, "heard_within_m: must be from 0 to 5000000"),
        (long, "unheard_s: must be from 0 to 200000000000"),
    ] {
        let mut schedule = older.clone();
        change(&mut schedule.costs[0]);
        let refused = Snapshot::try_from(later(&request, &schedule, 1.0)).expect_err("is refused");
        let fault = format!("/previous_plan/schedule/costs/0/{fault}");
        assert!(refused.to_string().contains(&fault), "{refused}");
    }
}

#[test]
fn an_auv_that_surfaces_repeatedly_is_not_too_deep_while_down() {
    for (swing, expected) in [(14.0, None), (0.0, Some(LeftOut::TooDeep))] {
        let mut request = random(31, 2, 200.0);
        let data = json!({ "kind": "data", "growth_kbps": 0.2, "upload_kbps": 10.0, "range_max_m": 10.0 });
        visits(&mut request).cost = cost(data);
        let now = request.t_s;
        let at = |k: u32| {
            let age = 12.0 * f64::from(k);
            Report {
                depth_m: Some(29.0 - swing + swing * (0.015 * age).cos()),
                ..Report::new(now - age, Vector2::new(100.0, 0.0), 1.5)
            }
        };
        request.auvs[0] = Auv::reported(request.auvs[0].id.clone(), (0..50).map(at).collect());
        assert_eq!(scheduled(&request).costs[0].left_out, expected);
    }
}

#[test]
fn an_added_auv_changes_the_next_visit_at_once_if_better_by_the_margin() {
    for (far, cost, expected) in [(100.0, 2000.0, "auv-2"), (900.0, 100.0, "auv-0")] {
        let [ahead, astern] = [resting(300.0, 0.0), resting(-300.0, 0.0)];
        let few = two(&[("auv-0", ahead, 300.0), ("auv-1", astern, 100.0)], 0.0, 0.0);
        let before = scheduled(&few);
        assert_eq!(before.visits[0].auv.0, "auv-0");
        let mut task = few.goal.clone();
        let mut after = later(&few, &before, 0.0);
        after.auvs.push(Auv::new("auv-2", resting(0.0, far)));
        let Goal::Visit(goal) = &mut task.goal else { panic!("the goal visits") };
        goal.auvs.push("auv-2".into());
        goal.costs_now.insert("auv-2".into(), cost);
        after.goal = task;
        let schedule = scheduled(&after);
        says(&schedule, "auv-2 is new");
        assert_eq!(schedule.visits[0].auv.0, expected);
    }
}

#[test]
fn a_request_for_the_next_visit_ends_with_it_for_any_least_time() {
    for dwell_min in [0.0, 30.0] {
        let auvs = [("auv-0", resting(100.0, 0.0), 0.0), ("auv-1", resting(-112.0, 0.0), 0.0)];
        let mut request = two(&auvs, 0.0, 1.0);
        visits(&mut request).costs_now.clear();
        visits(&mut request).dwell_min_s = Some(dwell_min);
        visits(&mut request).next = Some("auv-0".into());
        let mut schedule = scheduled(&request);
        says(&schedule, "as the goal asks");
        let (begun, mut left) = (request.t_s, None);
        while request.t_s < begun + 200.0 {
            // The craft goes to the AUV of the first visit, and stays there.
            let of_first = request.auv(&schedule.visits[0].auv).and_then(|auv| auv.state);
            let way = of_first.expect("is there").north_m - request.asc.north_m;
            request.asc.north_m += way.clamp(-SPEED, SPEED);
            request.asc.heading_rad = if way < 0.0 { PI } else { 0.0 };
            request = later(&request, &schedule, 1.0);
            schedule = scheduled(&request);
            let over = schedule.next_visited.is_some();
            assert_eq!(over, schedule.sentence.contains("was visited as the goal asks"));
            if over && left.is_none() {
                left = Some(request.t_s - begun);
            }
        }
        let left = left.expect("the visit is over");
        let arrives = (100.0 - 20.0) / SPEED;
        assert!((arrives..arrives + dwell_min + 3.0).contains(&left), "{dwell_min}: {left}");
        assert!(request.asc.north_m < 0.0, "{dwell_min}: the other one is not served");
        // After another request, a repeated one is visited again.
        visits(&mut request).next = None;
        let released = scheduled(&request);
        assert_eq!(released.next_visited, None);
        let mut again = later(&request, &released, 1.0);
        visits(&mut again).next = Some("auv-0".into());
        assert_eq!(next(&again), "auv-0".into());
    }
}
