//! Memory from plan to plan: costs, and the hearing of each AUV.

use super::*;

#[test]
fn the_next_plan_drops_a_silent_auv_and_visits_a_new_one() {
    for seed in 0..30 {
        let request = random(5000 + seed, 4, 500.0);
        let schedule = scheduled(&request);
        let next = schedule.visits[0].auv.clone();
        let mut after = later(&request, &schedule, 1.0);
        assert_eq!(scheduled(&after).visits[0].auv, next);
        let lost = after
            .auvs
            .iter_mut()
            .find(|auv| auv.id == next)
            .expect("is there");
        lost.state.as_mut().expect("has a state").age_s = AGE_MAX + 1.0;
        let without = scheduled(&after);
        assert!(without.visits.iter().all(|visit| visit.auv != next) && !without.kept);
        let known = without
            .costs
            .iter()
            .find(|known| known.auv == next)
            .expect("is listed");
        assert_eq!(known.left_out, Some(LeftOut::Silent));
        assert!(
            without
                .sentence
                .contains(&format!("{next} is not heard any more"))
        );
        let again = later(&request, &without, 1.0);
        let schedule = scheduled(&again);
        assert!(schedule.visits.iter().any(|visit| visit.auv == next));
        assert!(schedule.sentence.contains(&format!("{next} is heard again")));
    }
}

/// Reports of the AUV `id` each 10 s until `until`, s, from one position at a depth of 8 m.
fn heard(id: &VehicleId, place: Vector2<f64>, until: f64) -> Auv {
    let at = |k: u32| Report {
        depth_m: Some(8.0),
        ..Report::new(until - 10.0 * f64::from(k), place, 1.5)
    };
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
        let left_out = |schedule: &Schedule| {
            let known = schedule.costs.iter().find(|known| known.auv == lost);
            known.expect("is listed").left_out
        };
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
        assert!(again.sentence.contains("is heard again"), "{}", again.sentence);
    }
}

#[test]
fn costs_continue_from_plan_to_plan_and_depend_on_the_near_auv() {
    let mut request = random(7, 2, 1.0);
    for (auv, north) in request.auvs.iter_mut().zip([5.0, 400.0]) {
        auv.state = Some(AuvState::new(
            Vector2::new(north, 0.0),
            5.0,
            Course::new(0.0),
            0.0,
        ));
    }
    visits(&mut request).cost = VisitCost::Age;
    let schedule = scheduled(&request);
    let before: Vec<_> = schedule.costs.iter().map(|known| known.cost).collect();
    let after = scheduled(&later(&request, &schedule, 12.0));
    assert!((after.costs[0].cost).abs() < 1e-12);
    assert!((after.costs[1].cost - before[1] - 12.0).abs() < 1e-9);
    // Costs of another kind are unknown.
    let mut other = later(&request, &schedule, 12.0);
    visits(&mut other).cost = costs()[2];
    let anew = scheduled(&other);
    assert_eq!(anew.unit, CostUnit::Kilobits);
    assert!(anew.costs.iter().all(|known: &ServedVehicle| known.cost == 0.0));
}

#[test]
fn a_schedule_without_hearing_is_accepted_and_an_impossible_one_is_refused() {
    type Change<'a> = &'a dyn Fn(&mut ServedVehicle);
    let request = random(0, 3, 100.0);
    let mut before = serde_json::to_value(scheduled(&request)).expect("is JSON");
    for known in before["costs"].as_array_mut().expect("is a list") {
        let known = known.as_object_mut().expect("is an object");
        assert!(known.remove("heard_within_m").is_some() && known.remove("unheard_s").is_some());
    }
    let older: Schedule = serde_json::from_value(before).expect("both are optional");
    let costs = scheduled(&later(&request, &older, 1.0)).costs;
    assert!(costs.iter().all(|known| known.left_out.is_none()));
    let changes: [(Change<'_>, &str); 2] = [
        (
            &|known| known.heard_within_m = -1.0,
            "heard_within_m: must be from 0 to 5000000",
        ),
        (
            &|known| known.unheard_s = 3e11,
            "unheard_s: must be from 0 to 200000000000",
        ),
    ];
    for (change, fault) in changes {
        let mut schedule = older.clone();
        change(&mut schedule.costs[0]);
        let error = Snapshot::try_from(later(&request, &schedule, 1.0)).expect_err("is refused");
        assert!(
            error
                .to_string()
                .contains(&format!("/previous_plan/schedule/costs/0/{fault}")),
            "{error}"
        );
    }
}

#[test]
fn an_auv_that_surfaces_repeatedly_is_not_too_deep_while_down() {
    let left_out = |swings: bool| {
        let mut request = random(31, 2, 200.0);
        visits(&mut request).cost = VisitCost::Data {
            growth_kbps: 0.2,
            upload_kbps: 10.0,
            range_max_m: 10.0,
        };
        let now = request.t_s;
        let at = |k: u32| {
            let t_s = now - 12.0 * f64::from(k);
            let depth = if swings {
                15.0 + 14.0 * (0.015 * (t_s - now)).cos()
            } else {
                29.0
            };
            Report {
                depth_m: Some(depth),
                ..Report::new(t_s, Vector2::new(100.0, 0.0), 1.5)
            }
        };
        request.auvs[0] = Auv::reported(request.auvs[0].id.clone(), (0..50).map(at).collect());
        scheduled(&request).costs[0].left_out
    };
    assert_eq!(left_out(true), None);
    assert_eq!(left_out(false), Some(LeftOut::TooDeep));
}

#[test]
fn an_added_auv_changes_the_next_visit_at_once_if_better_by_the_margin() {
    let next = |far: f64, cost: f64| {
        let at = |north: f64, east: f64| AuvState::new(Vector2::new(north, east), 5.0, Course::new(0.0), 0.0);
        let mut request = random(7, 3, 1.0);
        request.current = None;
        for (auv, state) in request
            .auvs
            .iter_mut()
            .zip([at(300.0, 0.0), at(-300.0, 0.0), at(0.0, far)])
        {
            auv.state = Some(state);
        }
        let craft = Asc::new(Vector2::zeros(), Heading::new(0.0), 0.0);
        request.asc = craft;
        let goal = visits(&mut request);
        (goal.cost, goal.reduce, goal.dwell_min_s) = (VisitCost::Age, Reduce::Mean, Some(0.0));
        let costs: Vec<_> = goal.auvs.iter().cloned().zip([300.0, 100.0, cost]).collect();
        goal.costs_now = costs.into_iter().collect();
        let mut two = request.clone();
        let added = two.auvs.pop().expect("there are three").id;
        let goal = visits(&mut two);
        goal.auvs.pop();
        goal.costs_now.remove(&added);
        let before = scheduled(&two);
        assert_eq!(before.visits[0].auv, request.auvs[0].id);
        let costs = visits(&mut request).costs_now.clone();
        let mut after = later(&request, &before, 0.0);
        visits(&mut after).costs_now = costs;
        let schedule = scheduled(&after);
        assert!(schedule.sentence.contains(&format!("{added} is new")));
        schedule.visits[0].auv.clone()
    };
    assert_eq!(next(100.0, 2000.0).0, "auv-2");
    assert_eq!(next(900.0, 100.0).0, "auv-0");
}

#[test]
fn a_request_for_the_next_visit_ends_with_it_for_any_least_time() {
    for dwell_min in [0.0, 30.0] {
        let mut request = random(7, 2, 1.0);
        for (auv, north) in request.auvs.iter_mut().zip([100.0, -112.0]) {
            auv.state = Some(AuvState::new(
                Vector2::new(north, 0.0),
                5.0,
                Course::new(0.0),
                0.0,
            ));
        }
        request.current = None;
        *visits(&mut request) = Visits {
            dwell_min_s: Some(dwell_min),
            next: Some("auv-0".into()),
            ..Visits::new(vec!["auv-0".into(), "auv-1".into()])
        };
        let mut schedule = scheduled(&request);
        assert!(
            schedule.sentence.contains("as the goal asks"),
            "{}",
            schedule.sentence
        );
        let (begun, mut left) = (request.t_s, None);
        while request.t_s < begun + 200.0 {
            // The craft goes to the AUV of the first visit, and stays there.
            let of_first = request.auvs.iter().find(|auv| auv.id == schedule.visits[0].auv);
            let goal = of_first.and_then(|auv| auv.state).expect("is there").north_m;
            let way = goal - request.asc.north_m;
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
        assert!(
            (arrives..arrives + dwell_min + 3.0).contains(&left),
            "{dwell_min}: {left}"
        );
        assert!(
            request.asc.north_m < 0.0,
            "{dwell_min}: the other one is not served"
        );
        // After another request, a repeated one is visited again.
        visits(&mut request).next = None;
        let released = scheduled(&request);
        assert_eq!(released.next_visited, None);
        let mut again = later(&request, &released, 1.0);
        visits(&mut again).next = Some("auv-0".into());
        assert_eq!(scheduled(&again).visits[0].auv, "auv-0".into());
    }
}
