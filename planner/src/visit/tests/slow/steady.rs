//! Invariance of a schedule: names, order, north, the datum, a second more.

use super::*;

/// Asserts equal visits within `tolerance`, s; `auv-i` of `a` is `names(auv-i)` in `b`.
fn assert_same(a: &Schedule, b: &Schedule, names: impl Fn(&VehicleId) -> VehicleId, tolerance: f64) {
    assert_eq!(a.visits.len(), b.visits.len());
    for (a, b) in a.visits.iter().zip(&b.visits) {
        assert_eq!(names(&a.auv), b.auv);
        assert!((a.arrive_s - b.arrive_s).abs() <= tolerance && (a.leave_s - b.leave_s).abs() <= tolerance);
    }
    assert!((a.cost - b.cost).abs() <= tolerance * (1.0 + a.cost));
}

#[test]
fn names_and_order_of_the_auvs_do_not_change_the_schedule() {
    for seed in 0..80 {
        let request = random(2000 + seed, 2 + seed % 5, 700.0);
        let schedule = scheduled(&request);
        assert_eq!(schedule, scheduled(&request));
        // auv-0 becomes z-100, and so on: both orders are reversed.
        let renamed = |id: &VehicleId| {
            let number: usize = id.0["auv-".len()..].parse().expect("a number");
            VehicleId(format!("z-{}", 100 - number))
        };
        let mut other = request.clone();
        other.auvs.reverse();
        for auv in &mut other.auvs {
            auv.id = renamed(&auv.id);
        }
        let named = visits(&mut other);
        named.auvs = named.auvs.iter().map(renamed).collect();
        let costs = std::mem::take(&mut named.costs_now).into_iter();
        named.costs_now = costs.map(|(id, cost)| (renamed(&id), cost)).collect();
        assert_same(&schedule, &scheduled(&other), renamed, 0.0);
    }
}

#[test]
fn a_schedule_is_invariant_to_north_and_datum() {
    for seed in 0..40_u32 {
        let request = random(3000 + seed as usize, 3, 600.0);
        let schedule = scheduled(&request);
        let (turn, by) = (1.1 + TAU / 7.0 * f64::from(seed), Vector2::new(3000.0, -500.0));
        let rotation = ned_from_body(turn);
        let mut other = request.clone();
        for state in states(&mut other) {
            let place = rotation * state.position() + by;
            (state.north_m, state.east_m) = (place.x, place.y);
            state.course_rad = Course::new(state.course_rad + turn).radians();
        }
        (other.asc.north_m, other.asc.east_m) = (by.x, by.y);
        other.asc.heading_rad = Heading::new(other.asc.heading_rad + turn).radians();
        other.current = Some((rotation * request.current()).into());
        // Arrivals are exact to a millisecond.
        assert_same(&schedule, &scheduled(&other), VehicleId::clone, 0.05);
    }
}

#[test]
fn the_starboard_one_of_two_equal_auvs_is_next() {
    for heading in [0.0, 0.9, -2.5] {
        let at = |bearing: f64| {
            let place = direction(heading + bearing) * 150.0;
            resting(place.x, place.y)
        };
        let auvs = [("a-port", at(-0.8), 0.0), ("b-starboard", at(0.8), 0.0)];
        assert_eq!(next(&two(&auvs, heading, 1.0)).0, "b-starboard");
    }
}

/// Changes of the next AUV before the least visit time, with a plan every `step` seconds.
fn changes_of_next(mut request: PlanRequest, step: f64, n_plans: usize) -> usize {
    // The craft turns on the spot.
    request.asc.speed_mps = 0.0;
    let mut schedule = scheduled(&request);
    let mut changes = 0;
    for _ in 0..n_plans {
        let next = schedule.visits[0].clone();
        let dwells = 0.0 < visits(&mut request).dwell_min();
        let over = if dwells { next.leave_s } else { next.arrive_s };
        request = after_leg(&request, &schedule, step);
        schedule = scheduled(&request);
        if next.auv != schedule.visits[0].auv && request.t_s < over {
            changes += 1;
        }
    }
    changes
}

#[test]
fn the_next_visit_is_stable_between_auvs_of_equal_cost() {
    for seed in 0..200 {
        let mut rng = ChaCha8Rng::seed_from_u64(4000 + seed);
        let (bearing, apart) = (rng.random_range(-PI..PI), rng.random_range(0.3..1.5));
        // Farther apart than the passing distance.
        let distance = rng.random_range(100.0..500.0);
        let at = |side: f64| {
            let place = direction(bearing + side) * distance;
            resting(place.x, place.y)
        };
        let mut request = two(&[("auv-0", at(-apart), 100.0), ("auv-1", at(apart), 100.0)], 0.0, 0.0);
        request.asc.heading_rad = rng.random_range(-PI..PI);
        let goal = visits(&mut request);
        goal.cost = costs()[rng.random_range(0..3)];
        goal.dwell_min_s = Some(if seed % 2 == 0 { 0.0 } else { 30.0 });
        assert_eq!(changes_of_next(request, 4.0, 25), 0, "seed {seed}");
    }
}

#[test]
fn the_next_visit_in_random_fleets_rarely_changes_before_it_is_made() {
    let changes = |seed: usize| {
        let mut request = random(4500 + seed, 2 + seed % 3, 500.0);
        request.current = None;
        changes_of_next(request, 5.0, 20)
    };
    let changes: usize = (0..60).map(changes).sum();
    assert!(changes * 100 <= 60 * 20, "{changes} changes in 1200 plans");
}

#[test]
fn noise_rarely_changes_the_next_visit_in_large_fleets() {
    let (mut changes, mut plans) = (0, 0);
    for seed in 8000..8006 {
        let mut rng = ChaCha8Rng::seed_from_u64(seed as u64);
        let mut request = by_age(random(seed, 5, 1000.0));
        let mut schedule = scheduled(&request);
        for _ in 0..30 {
            let next = schedule.visits[0].clone();
            request = after_leg(&request, &schedule, 1.0);
            let mut measured = request.clone();
            for state in states(&mut measured) {
                state.north_m += rng.random_range(-3.0..3.0);
                state.east_m += rng.random_range(-3.0..3.0);
                state.speed_mps = (state.speed_mps + rng.random_range(-0.1..0.1)).max(0.0);
                state.course_rad = Course::new(state.course_rad + rng.random_range(-0.2..0.2)).radians();
            }
            schedule = scheduled(&measured);
            changes += usize::from(next.auv != schedule.visits[0].auv && request.t_s < next.arrive_s);
            plans += 1;
        }
    }
    assert!(changes * 25 <= plans, "{changes} changes in {plans} plans");
}

#[test]
fn a_search_without_time_continues_the_previous_schedule() {
    let hurried = SchedulingParameters { visits_tried: 1, ..SchedulingParameters::default() };
    let mut worse_without = 0;
    for seed in 0..12 {
        let mut request = random(9000 + seed, 8, 1000.0);
        (request.current, request.asc.speed_mps) = (None, 0.0);
        let schedule = scheduled(&request);
        let mut request = after_leg(&request, &schedule, 1.0);
        let after = scheduled_with(&request, &hurried);
        assert!(after.kept || after.visits[0].arrive_s <= request.t_s, "{seed}");
        assert!(after.cost <= 1.01 * schedule.cost, "{seed}: {}", after.cost);
        let costs = after.costs.iter().map(|known| (known.auv.clone(), known.cost));
        visits(&mut request).costs_now = costs.collect();
        request.previous_plan = None;
        worse_without += usize::from(after.cost * 1.01 < scheduled_with(&request, &hurried).cost);
    }
    // The schedule before helps.
    assert!(1 < worse_without, "{worse_without} of 12 times");
}
