//! The search against enumerated sequences and tours by the clock; deadlines, pins and turns.

use std::cell::Cell;

use super::*;

/// Times with each AUV, s, over which a clock is tuned.
const DWELLS: [f64; 4] = [30.0, 60.0, 120.0, 240.0];

#[test]
fn the_search_is_optimal_for_up_to_three_auvs() {
    let mut n_compared = 0;
    for seed in 0..60 {
        let request = random(seed, 1 + seed % 3, 400.0);
        let fleet = fleet(&request, horizon(&request, 900.0));
        let candidates: Vec<_> = (0..fleet.candidates.len()).collect();
        for first in candidates.iter().copied() {
            // The search includes tours by the clock with other times of service.
            let orders = orders(&candidates).into_iter().filter(|order| order[0] == first);
            let tours = orders.flat_map(|order| DWELLS.map(|dwell| by_the_clock(&fleet, &order, dwell)));
            let least = enumerated(&fleet, &fleet.start(), Some(first), Fleet::value);
            let expected = tours.fold(least, f64::min);
            let found = fleet.best_first(first, (None, &[]), 2_000_000, &|| false);
            let found = found.expect("every candidate is in reach");
            assert!(found.exact, "seed {seed}");
            assert!((found.value - expected).abs() <= 1e-8 * expected, "{seed}, {first}");
            n_compared += 1;
        }
    }
    assert!(100 < n_compared);
}

/// Cost of visits by the clock: the candidates in this order, repeated, each for `dwell` seconds.
fn by_the_clock(fleet: &Fleet, order: &[usize], dwell: f64) -> f64 {
    let mut state = fleet.start();
    for to in order.iter().cycle() {
        let (track, from) = (&fleet.candidates[*to].track, fleet.departure(&state));
        let Some(arrival) = fleet.craft.arrive(track, &from, fleet.within, fleet.horizon) else {
            break;
        };
        let there = fleet.travelled(&state, *to, arrival);
        state = fleet.visited_until(&there, *to, fleet.horizon.min(arrival.time + dwell));
        if fleet.horizon <= state.time {
            break;
        }
    }
    if let Some(with) = state.with {
        state = fleet.visited_until(&state, with, fleet.horizon);
    }
    fleet.value(&state)
}

/// All orders of `items`.
fn orders(items: &[usize]) -> Vec<Vec<usize>> {
    if items.len() < 2 {
        return vec![items.to_vec()];
    }
    let with_first = |first: usize| {
        let others: Vec<_> = items.iter().copied().filter(|item| *item != first).collect();
        let rest = orders(&others);
        rest.into_iter().map(move |rest| [vec![first], rest].concat())
    };
    items.iter().copied().flat_map(with_first).collect()
}

#[test]
fn no_tour_of_five_auvs_by_the_clock_is_better_and_a_quarter_cost_five_percent_more() {
    let tried = SchedulingParameters::default().visits_tried;
    let ratio = |seed: usize| {
        let fleet = fleet(&random(8000 + seed, 5, 600.0), 1800.0);
        let candidates: Vec<_> = (0..fleet.candidates.len()).collect();
        let orders = orders(&candidates).into_iter();
        let clocks = orders.flat_map(|order| DWELLS.map(|dwell| by_the_clock(&fleet, &order, dwell)));
        let found = candidates.iter();
        let found = found.filter_map(|first| fleet.best_first(*first, (None, &[]), tried, &|| false));
        let found = found.map(|found| found.value).fold(f64::INFINITY, f64::min);
        found / clocks.fold(f64::INFINITY, f64::min)
    };
    let mut ratios: Vec<_> = (0..48).map(ratio).collect();
    ratios.sort_by(f64::total_cmp);
    assert!(ratios.iter().all(|ratio| *ratio <= 1.0 + 1e-9));
    // Each clock has the best of 120 orders and four dwells for its own fleet.
    assert!(ratios[ratios.len() / 4] < 0.955, "{ratios:?}");
}

#[test]
fn among_auvs_side_by_side_the_search_ends_soon() {
    let request = random(7, 16, 10.0);
    let fleet = Fleet { law: VisitCost::Age, within: 5000.0, dwell_min: 0.0, ..fleet(&request, 7200.0) };
    let tried = SchedulingParameters::default().visits_tried;
    let looks = Cell::new(0);
    let looked = || {
        looks.set(looks.get() + 1);
        false
    };
    for first in 0..fleet.candidates.len() {
        let found = fleet.best_first(first, (None, &[]), tried, &looked);
        assert!(!found.expect("is in reach").exact);
    }
    // A tour looks once for an arrival and a stay, which count, and may take half of the work.
    assert!(looks.get() < 3 * tried, "{}", looks.get());
}

#[test]
fn schedules_respect_their_bound_and_the_order_and_length_of_visits() {
    for seed in 0..120 {
        let schedule = scheduled(&random(1000 + seed, 1 + seed % 6, 900.0));
        let Schedule { gap, bound, cost, visits, .. } = &schedule;
        assert!((0.0..=1.0).contains(gap), "seed {seed}: {gap}");
        assert!(0.0 <= *bound && bound <= cost);
        let mut others = schedule.alternatives.iter();
        assert!(others.all(|other| *bound <= other.cost + 1e-6));
        assert!(visits.is_sorted_by(|a, b| a.leave_s <= b.arrive_s && a.auv != b.auv));
        for visit in &visits[..visits.len() - 1] {
            assert!(30.0 - 1e-9 <= visit.leave_s - visit.arrive_s);
        }
    }
}

#[test]
fn a_visit_is_at_the_forecast_position_of_its_auv() {
    for seed in 0..30 {
        let mut request = random(seed, 3, 900.0);
        // Faster than the threshold of rest.
        states(&mut request).for_each(|state| state.speed_mps += 0.1);
        for visit in scheduled(&request).visits {
            let state = request.auv(&visit.auv).and_then(|auv| auv.state).expect("is given");
            // The mean over turns, the first of which comes after 200 s at the mean.
            let straight = 200.0 * -(-(visit.arrive_s - request.t_s) / 200.0).exp_m1();
            let expected = state.position() + state.velocity() * straight;
            near_to(Vector2::new(visit.north_m, visit.east_m), expected, 0.1);
        }
    }
}

#[test]
fn the_cost_before_a_visit_includes_the_growth_until_arrival() {
    let mut on_the_way = 0;
    for seed in 0..60 {
        let request = by_age(random(2200 + seed, 3, 900.0));
        let schedule = scheduled(&request);
        let first = &schedule.visits[0];
        if request.t_s < first.arrive_s {
            let now = known(&schedule, &first.auv).cost;
            near(first.cost_before, now + first.arrive_s - request.t_s, 1e-6);
            on_the_way += 1;
        }
    }
    assert!(50 < on_the_way, "{on_the_way} of 60 are not there yet");
}

#[test]
fn a_feasible_deadline_is_kept_at_any_cost() {
    let mut n_decided = 0;
    for seed in 0..40 {
        let mut request = random(6000 + seed, 3, 300.0);
        let arrival = |schedule: &Schedule, id: &VehicleId| {
            let visit = schedule.visits.iter().find(|visit| visit.auv == *id);
            visit.map_or(f64::INFINITY, |visit| visit.arrive_s)
        };
        let free = scheduled(&request);
        let ids = free.costs.iter().map(|known| &known.auv);
        let last = ids.max_by(|a, b| arrival(&free, a).total_cmp(&arrival(&free, b)));
        let last = last.expect("there are three");
        visits(&mut request).next = Some(last.clone());
        let deadline = arrival(&scheduled(&request), last) + 1.0;
        visits(&mut request).next = None;
        n_decided += u32::from(deadline < arrival(&free, last));
        visits(&mut request).serve_by_s.insert(last.clone(), deadline);
        assert!(scheduled(&request).deadlines_missed.is_empty(), "seed {seed}");
        // A passed deadline is not kept; its AUV is served as soon as possible.
        let passed = request.t_s - 5.0;
        visits(&mut request).serve_by_s.insert(last.clone(), passed);
        let late = scheduled(&request);
        // An AUV near the craft has already been served.
        let is_served = known(&late, last).served_by_s == Some(passed);
        assert!((late.deadlines_missed == [last.clone()]) != is_served);
    }
    assert!(20 < n_decided, "{n_decided} deadlines decide something");
}

#[test]
fn an_auv_with_an_age_is_left_when_near_or_passed_in_a_turn() {
    // The other one is astern; the craft moves at full speed towards the first.
    let next = |distance: f64, speed: f64| {
        let ahead = ("ahead", resting(distance, 0.0), 60.0);
        let behind = ("behind", resting(distance - 60.0, 0.0), 20.0);
        let mut request = two(&[ahead, behind], 0.0, speed);
        let costs = visits(&mut request).costs_now.clone();
        visits(&mut request).next = Some("ahead".into());
        let before = scheduled(&request);
        visits(&mut request).next = None;
        let mut request = later(&request, &before, 0.0);
        visits(&mut request).costs_now = costs;
        next(&request).0
    };
    assert_eq!(next(30.0, SPEED), "ahead");
    // In its turn it advances 0.4 · 1.5 / 0.17 = 3.5 m; a turn on the spot does not.
    assert_eq!(next(22.5, SPEED), "behind");
    assert_eq!(next(22.5, 0.0), "ahead");
    assert_eq!(next(19.0, 0.0), "behind");
}

#[test]
fn a_pinned_auv_is_next_at_any_cost() {
    for seed in 0..20 {
        let mut request = random(7000 + seed, 4, 800.0);
        let free = scheduled(&request);
        let Some(other) = free.alternatives.last().map(|other| other.next.clone()) else {
            continue;
        };
        visits(&mut request).next = Some(other.clone());
        let pinned = scheduled(&request);
        assert_eq!(pinned.visits[0].auv, other);
        assert!(pinned.alternatives.is_empty() && free.cost <= pinned.cost + 1e-9);
    }
}

#[test]
fn after_the_deadline_few_of_many_visits_are_tried() {
    for seed in 0..20 {
        // All sixteen are always near and need no stay: thousands of visits fit.
        let mut request = random(seed, 16, 300.0);
        let visits = visits(&mut request);
        (visits.within_m, visits.dwell_min_s) = (Some(5000.0), Some(0.0));
        let fleet = fleet(&request, horizon(&request, 1800.0));
        let first = fleet.candidates.len() - 1;
        for n in [0, 7, 600] {
            let looks = Cell::new(0);
            let due = || n <= looks.replace(looks.get() + 1);
            let found = fleet.best_first(first, (None, &[]), 24_000, &due);
            let found = found.expect("is near");
            assert!(!found.exact && found.windows[0].candidate == first);
            assert!(looks.get() <= n + 5, "{} looks, due at {n}", looks.get());
        }
    }
}
