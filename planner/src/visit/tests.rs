//! Schedules of whole requests, and the search against the enumeration of all sequences.

mod bound;
mod tours;

use std::f64::consts::{PI, TAU};

use nalgebra::Vector2;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde_json::{Value, json};

use super::{
    fleet::{Fleet, SchedulingParameters},
    schedule::Scheduler,
    state::State,
};
use crate::{
    facts::{
        angle::{Course, Heading, direction, ned_from_body},
        asc::Asc,
        auv::{Auv, VehicleId},
        evidence::{AuvState, Report},
        goal::{Goal, Task},
        schedule::{CostUnit, LeftOut, Schedule, ServedVehicle},
        visit::{Reduce, VisitCost, Visits},
    },
    predict::goal::forecast_all,
    snapshot::build::Snapshot as Built,
    snapshot::{Acoustics, PlanRequest, Snapshot},
};

const AGE_MAX: f64 = 900.0;
const SPEED: f64 = 1.5;
const TURN_RATE: f64 = 0.17;

fn costs() -> [VisitCost; 3] {
    let uncertainty = VisitCost::Uncertainty {
        growth_m2ps: 0.03,
        sigma_m: 1.5,
        sigma_rad: 0.02,
        interval_s: 10.0,
    };
    let data = VisitCost::Data {
        growth_kbps: 0.5,
        upload_kbps: 6.0,
        range_max_m: 300.0,
    };
    [VisitCost::Age, uncertainty, data]
}

/// A request with `n` AUVs up to `far` metres away, called `auv-0` and so on, whose costs are random.
fn random(seed: u64, n: usize, far: f64) -> PlanRequest {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let auv = |i: usize, rng: &mut ChaCha8Rng| {
        let place = direction(rng.random_range(-PI..PI)) * rng.random_range(0.0..far);
        let course = Course::new(rng.random_range(-PI..PI));
        let state = AuvState::new(
            place,
            rng.random_range(0.0..40.0),
            course,
            rng.random_range(0.0..0.5),
        );
        Auv::new(format!("auv-{i}").as_str(), state)
    };
    let auvs: Vec<_> = (0..n).map(|i| auv(i, &mut rng)).collect();
    let mut visits = Visits::new(auvs.iter().map(|auv| auv.id.clone()).collect());
    visits.cost = costs()[rng.random_range(0..3)];
    visits.dwell_min_s = 30.0;
    visits.costs_now = auvs
        .iter()
        .map(|auv| (auv.id.clone(), rng.random_range(0.0..400.0)))
        .collect();
    visits.reduce = if rng.random_bool(0.3) {
        Reduce::Max
    } else {
        Reduce::Mean
    };
    let craft = Asc::new(Vector2::zeros(), Heading::new(rng.random_range(-PI..PI)), 1.0);
    let mut request = PlanRequest::new(1000.0, craft, auvs, Goal::Visit(visits));
    request.current = Some(Vector2::new(rng.random_range(-0.3..0.3), rng.random_range(-0.3..0.3)).into());
    request
}

fn visits(request: &mut PlanRequest) -> &mut Visits {
    let Goal::Visit(visits) = &mut request.goal.goal else {
        panic!("the goal visits")
    };
    visits
}

fn scheduled(request: &PlanRequest) -> Schedule {
    scheduled_with(request, &SchedulingParameters::default())
}

fn scheduled_with(request: &PlanRequest, parameters: &SchedulingParameters) -> Schedule {
    let snapshot = Snapshot::try_from(request.clone()).expect("valid");
    let scheduler = Scheduler {
        parameters,
        speed: SPEED,
        turn_rate: TURN_RATE,
        report_age_max: AGE_MAX,
        due: &|| false,
    };
    let scheduled = scheduler.schedule(&snapshot, &forecast_all(&snapshot));
    scheduled.expect("the goal visits").schedule
}

/// `request` a little later, with what was scheduled.
fn later(request: &PlanRequest, schedule: &Schedule, elapsed: f64) -> PlanRequest {
    let mut later = request.clone();
    visits(&mut later).costs_now.clear();
    later.t_s += elapsed;
    let before = json!({
        "trajectory": [{ "t_s": request.t_s, "north_m": 0.0, "east_m": 0.0, "speed_mps": 1.0, "heading_rad": 0.0 }],
        "schedule": schedule,
    });
    later.previous_plan = Some(serde_json::from_value(before).expect("a previous plan"));
    later
}

fn fleet(request: &PlanRequest, horizon: f64) -> Fleet {
    let parameters = SchedulingParameters {
        horizon_min: horizon,
        horizon_max: horizon,
        ..SchedulingParameters::default()
    };
    let snapshot: Built = Snapshot::try_from(request.clone()).expect("valid");
    let Goal::Visit(visits) = &snapshot.goal.goal else {
        panic!("the goal visits")
    };
    let members: Vec<_> = (0..snapshot.auvs.len())
        .map(|auv| super::fleet::Member {
            auv,
            weight: 1.0,
            cost: visits.costs_now[&snapshot.auvs[auv].id],
            deadline: (auv == 0).then_some(0.4 * horizon),
        })
        .collect();
    let forecasts = forecast_all(&snapshot);
    Fleet::new(
        &snapshot,
        visits,
        &members,
        &forecasts,
        (SPEED, TURN_RATE),
        &parameters,
    )
}

/// A horizon that is short enough to enumerate all sequences, whose visits may have several lengths where the cost is a variance.
fn horizon(request: &PlanRequest, of_one_length: f64) -> f64 {
    match &request.goal.goal {
        Goal::Visit(Visits {
            cost: VisitCost::Uncertainty { .. },
            ..
        }) => 0.5 * of_one_length,
        _ => of_one_length,
    }
}

/// The least `worth` of all sequences of visits that go on from `state`.
fn enumerated(fleet: &Fleet, state: &State, only: Option<usize>, worth: fn(&Fleet, &State) -> f64) -> f64 {
    let mut best = f64::INFINITY;
    for to in (0..fleet.candidates.len()).filter(|to| only.is_none_or(|only| only == *to)) {
        let track = &fleet.candidates[to].track;
        let from = fleet.departure(state);
        if state.with == Some(to) {
            continue;
        }
        let Some(arrival) = fleet.craft.arrive(track, &from, fleet.within, fleet.horizon) else {
            continue;
        };
        let there = fleet.travelled(state, to, arrival);
        for dwell in fleet
            .law
            .dwells(there.costs[to], track.depth_at(arrival.time), fleet.dwell_min)
        {
            let left = fleet.stayed(&there, to, fleet.horizon.min(arrival.time + dwell));
            best = best.min(worth(fleet, &fleet.stayed(&left, to, fleet.horizon)));
            if left.time < fleet.horizon {
                best = best.min(enumerated(fleet, &left, None, worth));
            }
        }
    }
    best
}

#[test]
fn of_up_to_three_auvs_the_search_finds_the_best_of_all_sequences() {
    let mut n_compared = 0;
    for seed in 0..60 {
        let n = 1 + usize::try_from(seed % 3).expect("small");
        let request = random(seed, n, 400.0);
        let fleet = fleet(&request, horizon(&request, 900.0));
        for first in 0..fleet.candidates.len() {
            // The search knows tours by the clock too, whose times of service are others.
            let candidates: Vec<_> = (0..fleet.candidates.len()).collect();
            let orders = orders(&candidates).into_iter().filter(|order| order[0] == first);
            let tours = orders.flat_map(|order| DWELLS.map(|dwell| by_the_clock(&fleet, &order, dwell)));
            let expected = tours.fold(
                enumerated(&fleet, &fleet.start(), Some(first), Fleet::value),
                f64::min,
            );
            let found = fleet
                .best_first(first, (None, &[]), 2_000_000, &|| false)
                .expect("every candidate is in reach");
            assert!(found.exact, "seed {seed}");
            assert!(
                (found.value - expected).abs() <= 1e-8 * expected,
                "seed {seed}, first {first}: {} instead of {expected}",
                found.value
            );
            n_compared += 1;
        }
    }
    assert!(100 < n_compared);
}

/// Times with each AUV, s, that a clock is tuned over.
const DWELLS: [f64; 4] = [30.0, 60.0, 120.0, 240.0];

/// What it costs to visit by the clock: the candidates in this order, again and again, each for `dwell` seconds.
fn by_the_clock(fleet: &Fleet, order: &[usize], dwell: f64) -> f64 {
    let mut state = fleet.start();
    for to in order.iter().cycle() {
        let track = &fleet.candidates[*to].track;
        let arrival = fleet
            .craft
            .arrive(track, &fleet.departure(&state), fleet.within, fleet.horizon);
        let Some(arrival) = arrival else { break };
        let there = fleet.travelled(&state, *to, arrival);
        state = fleet.stayed(&there, *to, fleet.horizon.min(arrival.time + dwell));
        if fleet.horizon <= state.time {
            break;
        }
    }
    let end = state
        .with
        .map_or(state, |with| fleet.stayed(&state, with, fleet.horizon));
    fleet.value(&end)
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
fn of_five_auvs_no_order_by_the_clock_at_its_best_dwell_is_better_and_a_quarter_of_them_cost_five_percent_more()
 {
    let mut ratios = Vec::new();
    for seed in 0..48 {
        let fleet = fleet(&random(8000 + seed, 5, 600.0), 1800.0);
        let candidates: Vec<_> = (0..fleet.candidates.len()).collect();
        let clocks = orders(&candidates);
        let clocks = clocks
            .iter()
            .flat_map(|order| DWELLS.map(|dwell| by_the_clock(&fleet, order, dwell)));
        let clock = clocks.fold(f64::INFINITY, f64::min);
        let tried = SchedulingParameters::default().visits_tried;
        let found = candidates
            .iter()
            .filter_map(|first| fleet.best_first(*first, (None, &[]), tried, &|| false));
        let found = found.map(|found| found.value).fold(f64::INFINITY, f64::min);
        ratios.push(found / clock);
    }
    ratios.sort_by(f64::total_cmp);
    assert!(ratios.iter().all(|ratio| *ratio <= 1.0 + 1e-9));
    // Even though each clock has the best of 120 orders and four dwells for its own fleet.
    assert!(ratios[ratios.len() / 4] < 0.955, "{ratios:?}");
}

#[test]
fn no_schedule_costs_less_than_its_bound_and_its_visits_are_in_order_and_long_enough() {
    for seed in 0..120 {
        let n = 1 + usize::try_from(seed % 6).expect("small");
        let request = random(1000 + seed, n, 900.0);
        let schedule = scheduled(&request);
        assert!(
            (0.0..=1.0).contains(&schedule.gap),
            "seed {seed}: {}",
            schedule.gap
        );
        assert!(0.0 <= schedule.bound && schedule.bound <= schedule.cost);
        assert!(
            schedule
                .alternatives
                .iter()
                .all(|other| schedule.bound <= other.cost + 1e-6)
        );
        assert!(
            schedule
                .visits
                .is_sorted_by(|a, b| a.leave_s <= b.arrive_s && a.auv != b.auv)
        );
        for visit in &schedule.visits[..schedule.visits.len() - 1] {
            assert!(30.0 - 1e-9 <= visit.leave_s - visit.arrive_s);
        }
    }
}

#[test]
fn a_visit_is_where_its_auv_goes_until_the_craft_arrives() {
    for seed in 0..30 {
        let mut request = random(seed, 3, 900.0);
        // Faster than what counts as at rest.
        for state in request.auvs.iter_mut().filter_map(|auv| auv.state.as_mut()) {
            state.speed_mps += 0.1;
        }
        for visit in scheduled(&request).visits {
            let mut auvs = request.auvs.iter();
            let auv = auvs.find(|auv| auv.id == visit.auv).expect("it is visited");
            let state = auv.state.as_ref().expect("it is given so");
            let ahead = visit.arrive_s - request.t_s;
            let way = state.speed_mps * ahead;
            let (sin, cos) = state.course_rad.sin_cos();
            let off = Vector2::new(
                state.north_m + way * cos - visit.north_m,
                state.east_m + way * sin - visit.east_m,
            );
            assert!(
                off.norm() < 1e-6,
                "seed {seed}, {} in {ahead} s: {} m off",
                visit.auv,
                off.norm()
            );
        }
    }
}

/// That two schedules visit the same AUVs, `b` calling them `names[i]` where `a` has `auv-i`, at the same times within `tolerance`, s.
fn assert_same(a: &Schedule, b: &Schedule, names: impl Fn(&VehicleId) -> VehicleId, tolerance: f64) {
    assert_eq!(a.visits.len(), b.visits.len());
    for (a, b) in a.visits.iter().zip(&b.visits) {
        assert_eq!(names(&a.auv), b.auv);
        assert!((a.arrive_s - b.arrive_s).abs() <= tolerance && (a.leave_s - b.leave_s).abs() <= tolerance);
    }
    assert!((a.cost - b.cost).abs() <= tolerance * (1.0 + a.cost));
}

#[test]
fn the_same_request_has_the_same_schedule_whatever_its_auvs_are_called_and_however_they_are_ordered() {
    for seed in 0..80 {
        let n = 2 + usize::try_from(seed % 5).expect("small");
        let request = random(2000 + seed, n, 700.0);
        let schedule = scheduled(&request);
        assert_eq!(schedule, scheduled(&request));
        // auv-0 becomes z-n, and so on: both orders are turned round.
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
        named.costs_now = named
            .costs_now
            .iter()
            .map(|(id, cost)| (renamed(id), *cost))
            .collect();
        assert_same(&schedule, &scheduled(&other), renamed, 0.0);
    }
}

#[test]
fn a_schedule_depends_neither_on_where_north_is_nor_on_the_datum() {
    for seed in 0..40_u32 {
        let request = random(3000 + u64::from(seed), 3, 600.0);
        let schedule = scheduled(&request);
        let (turn, by) = (1.1 + TAU / 7.0 * f64::from(seed), Vector2::new(3000.0, -500.0));
        let rotation = ned_from_body(turn);
        let mut other = request.clone();
        for auv in &mut other.auvs {
            let state = auv.state.as_mut().expect("has a state");
            let place = rotation * state.position() + by;
            (state.north_m, state.east_m) = (place.x, place.y);
            state.course_rad = Course::new(state.course_rad + turn).radians();
        }
        (other.asc.north_m, other.asc.east_m) = (by.x, by.y);
        other.asc.heading_rad = Heading::new(other.asc.heading_rad + turn).radians();
        other.current = Some((rotation * request.current()).into());
        // Arrivals are found to a millisecond.
        assert_same(&schedule, &scheduled(&other), VehicleId::clone, 0.05);
    }
}

#[test]
fn of_two_alike_auvs_the_one_to_starboard_is_next() {
    for heading in [0.0, 0.9, -2.5] {
        let at =
            |bearing: f64| AuvState::new(direction(heading + bearing) * 150.0, 10.0, Course::new(0.0), 0.0);
        let auvs = vec![Auv::new("a-port", at(-0.8)), Auv::new("b-starboard", at(0.8))];
        let goal = Visits::new(auvs.iter().map(|auv| auv.id.clone()).collect());
        let craft = Asc::new(Vector2::zeros(), Heading::new(heading), 1.0);
        let request = PlanRequest::new(0.0, craft, auvs, Goal::Visit(goal));
        assert_eq!(scheduled(&request).visits[0].auv.0, "b-starboard");
    }
}

/// `request` `step` seconds later, the craft having gone straight to the AUV of its `schedule`, after a turn on the spot.
fn sailed(request: &PlanRequest, schedule: &Schedule, step: f64) -> PlanRequest {
    let target = request.auv(&schedule.visits[0].auv).and_then(|auv| auv.state);
    let mut after = later(request, schedule, step);
    let way = target.expect("is there").position() - request.asc.position();
    if 0.0 < way.norm() {
        let off = Course::of(&way).radians() - request.asc.heading_rad;
        let off = off.sin().atan2(off.cos());
        let turned = off.clamp(-TURN_RATE * step, TURN_RATE * step);
        let goes = SPEED * (step - turned.abs() / TURN_RATE);
        let place = request.asc.position() + way * (goes / way.norm().max(goes.max(f64::MIN_POSITIVE)));
        (after.asc.north_m, after.asc.east_m) = (place.x, place.y);
        after.asc.heading_rad = Heading::new(request.asc.heading_rad + turned).radians();
    }
    for auv in &mut after.auvs {
        let state = auv.state.as_mut().expect("has a state");
        let place = state.position() + state.velocity() * step;
        (state.north_m, state.east_m) = (place.x, place.y);
    }
    after.current = None;
    after
}

/// How often the next AUV of a craft that follows its schedule, planned for every `step` seconds, changes although that before had not been
/// visited for the least time.
fn changes_of_mind(mut request: PlanRequest, step: f64, n_plans: usize) -> usize {
    // It turns on the spot.
    request.asc.speed_mps = 0.0;
    let mut schedule = scheduled(&request);
    let mut changes = 0;
    for _ in 0..n_plans {
        let next = schedule.visits[0].clone();
        let dwells = 0.0 < visits(&mut request).dwell_min_s;
        let over = if dwells { next.leave_s } else { next.arrive_s };
        request = sailed(&request, &schedule, step);
        schedule = scheduled(&request);
        if next.auv != schedule.visits[0].auv && request.t_s < over {
            changes += 1;
        }
    }
    changes
}

#[test]
fn between_auvs_of_equal_cost_the_craft_does_not_change_its_mind() {
    for seed in 0..200 {
        let mut rng = ChaCha8Rng::seed_from_u64(4000 + seed);
        let mut request = random(4000 + seed, 2, 1.0);
        request.current = None;
        let (bearing, apart) = (rng.random_range(-PI..PI), rng.random_range(0.3..1.5));
        // Farther apart than what is served on the way.
        let distance = rng.random_range(100.0..500.0);
        for (auv, side) in request.auvs.iter_mut().zip([-apart, apart]) {
            let state = auv.state.as_mut().expect("has a state");
            let place = direction(bearing + side) * distance;
            (state.north_m, state.east_m) = (place.x, place.y);
            state.depth_m = 10.0;
            state.speed_mps = 0.0;
        }
        let goal = visits(&mut request);
        goal.reduce = Reduce::Mean;
        for cost in goal.costs_now.values_mut() {
            *cost = 100.0;
        }
        goal.dwell_min_s = if seed % 2 == 0 { 0.0 } else { 30.0 };
        assert_eq!(changes_of_mind(request, 4.0, 25), 0, "seed {seed}");
    }
}

#[test]
fn of_random_fleets_the_next_visit_hardly_ever_changes_before_it_was_made() {
    let (mut changes, mut plans) = (0, 0);
    for seed in 0..60 {
        let n = 2 + usize::try_from(seed % 3).expect("small");
        let mut request = random(4500 + seed, n, 500.0);
        request.current = None;
        changes += changes_of_mind(request, 5.0, 20);
        plans += 20;
    }
    assert!(changes * 100 <= plans, "{changes} changes in {plans} plans");
}

#[test]
fn a_search_with_no_time_goes_on_with_the_schedule_before() {
    let hurried = SchedulingParameters {
        visits_tried: 1,
        ..SchedulingParameters::default()
    };
    let mut worse_without = 0;
    for seed in 0..12 {
        let mut request = random(9000 + seed, 8, 1000.0);
        (request.current, request.asc.speed_mps) = (None, 0.0);
        let schedule = scheduled(&request);
        let request = sailed(&request, &schedule, 1.0);
        let after = scheduled_with(&request, &hurried);
        assert!(after.kept || after.visits[0].arrive_s <= request.t_s, "{seed}");
        assert!(
            after.cost <= 1.01 * schedule.cost,
            "{seed}: {} after {}",
            after.cost,
            schedule.cost
        );
        let mut forgotten = request.clone();
        visits(&mut forgotten).costs_now = after
            .costs
            .iter()
            .map(|known| (known.auv.clone(), known.cost))
            .collect();
        forgotten.previous_plan = None;
        worse_without += usize::from(after.cost * 1.01 < scheduled_with(&forgotten, &hurried).cost);
    }
    assert!(
        1 < worse_without,
        "the schedule before helps {worse_without} of 12 times"
    );
}

#[test]
fn an_auv_that_falls_silent_is_no_longer_visited_from_the_next_plan_on_and_who_comes_is() {
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
        assert!(schedule.visits.iter().any(|visit| visit.auv == next) && !schedule.kept);
    }
}

/// Reports of the AUV `id` each 10 s until `until`, s, from one place at a depth of 8 m.
fn heard(id: &VehicleId, place: Vector2<f64>, until: f64) -> Auv {
    let at = |k: u32| Report {
        depth_m: Some(8.0),
        ..Report::new(until - 10.0 * f64::from(k), place, 1.5)
    };
    Auv::reported(id.clone(), (0..6).map(at).collect())
}

#[test]
fn an_auv_whose_reports_cease_is_left_out_after_eight_of_their_intervals_until_it_is_heard() {
    // The kind of cost changes in between, or not: what is known of reports stays.
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
            // The craft goes away at last: what was silent stays so.
            request.asc.north_m += if age == 82.0 { 900.0 } else { 0.0 };
            schedule = scheduled(&request);
            let silent = (80.0 < age).then_some(LeftOut::Silent);
            assert_eq!(left_out(&schedule), silent, "{age}");
        }
        // An older report that arrives now says nothing new.
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
fn costs_are_carried_from_plan_to_plan_by_whom_the_craft_is_near() {
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
    // Of another kind of cost, nothing is known.
    let mut other = later(&request, &schedule, 12.0);
    visits(&mut other).cost = costs()[2];
    let anew = scheduled(&other);
    assert_eq!(anew.unit, CostUnit::Kilobits);
    assert!(anew.costs.iter().all(|known: &ServedVehicle| known.cost == 0.0));
}

#[test]
fn a_deadline_that_the_craft_can_keep_is_kept_whatever_else_that_costs() {
    let mut n_decided = 0;
    for seed in 0..40 {
        let mut request = random(6000 + seed, 3, 300.0);
        let arrival = |schedule: &Schedule, id: &VehicleId| {
            let visit = schedule.visits.iter().find(|visit| visit.auv == *id);
            visit.map_or(f64::INFINITY, |visit| visit.arrive_s)
        };
        let free = scheduled(&request);
        let last = free.costs.iter().map(|known| known.auv.clone());
        let last = last.max_by(|a, b| arrival(&free, a).total_cmp(&arrival(&free, b)));
        let last = last.expect("there are three");
        visits(&mut request).next = Some(last.clone());
        let deadline = arrival(&scheduled(&request), &last) + 1.0;
        visits(&mut request).next = None;
        n_decided += u32::from(deadline < arrival(&free, &last));
        visits(&mut request).serve_by_s.insert(last.clone(), deadline);
        let schedule = scheduled(&request);
        assert!(schedule.deadlines_missed.is_empty(), "seed {seed}");
        // One that has passed is kept no more, and is served as soon as that can be.
        let passed = request.t_s - 5.0;
        visits(&mut request).serve_by_s.insert(last.clone(), passed);
        let late = scheduled(&request);
        let known = late
            .costs
            .iter()
            .find(|known| known.auv == last)
            .expect("is listed");
        // Whom the craft is near already has been served.
        assert!((late.deadlines_missed == [last.clone()]) != (known.served_by_s == Some(passed)));
    }
    assert!(20 < n_decided, "{n_decided} deadlines decide something");
}

#[test]
fn whose_age_counts_is_left_when_the_craft_is_near_or_passes_it_as_it_turns() {
    // The other one lies behind; the craft goes at full speed towards the first.
    let next = |distance: f64, speed: f64| {
        let at = |north: f64| AuvState::new(Vector2::new(north, 0.0), 5.0, Course::new(0.0), 0.0);
        let auvs = vec![
            Auv::new("ahead", at(distance)),
            Auv::new("behind", at(distance - 60.0)),
        ];
        let mut goal = Visits::new(auvs.iter().map(|auv| auv.id.clone()).collect());
        goal.costs_now = [("ahead".into(), 60.0), ("behind".into(), 20.0)].into();
        let craft = Asc::new(Vector2::zeros(), Heading::new(0.0), speed);
        let mut request = PlanRequest::new(1000.0, craft, auvs, Goal::Visit(goal));
        visits(&mut request).next = Some("ahead".into());
        let before = scheduled(&request);
        visits(&mut request).next = None;
        let mut request = later(&request, &before, 0.0);
        visits(&mut request).costs_now = [("ahead".into(), 60.0), ("behind".into(), 20.0)].into();
        scheduled(&request).visits[0].auv.0.clone()
    };
    assert_eq!(next(30.0, SPEED), "ahead");
    // In its turn it comes 0.4 · 1.5 / 0.17 = 3.5 m nearer; one that turns on the spot does not.
    assert_eq!(next(22.5, SPEED), "behind");
    assert_eq!(next(22.5, 0.0), "ahead");
    assert_eq!(next(19.0, 0.0), "behind");
}

#[test]
fn a_pinned_auv_is_next_whatever_it_costs() {
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

fn task(goal: Value) -> Result<Task, String> {
    serde_json::from_value(goal).map_err(|error| error.to_string())
}

#[test]
fn a_goal_comes_back_from_json_as_it_went_and_defaults_are_spelled_out() {
    let short = task(json!({ "kind": "visit", "auvs": ["a", "b"] })).expect("valid");
    assert_eq!(short.goal, Goal::Visit(Visits::new(vec!["a".into(), "b".into()])));
    let spelled = serde_json::to_value(&short).expect("is JSON");
    assert_eq!(
        spelled,
        json!({ "kind": "visit", "auvs": ["a", "b"], "cost": { "kind": "age" }, "within_m": 20.0, "dwell_min_s": 0.0,
            "reduce": "mean" })
    );
    let long = json!({
        "kind": "visit", "auvs": ["a", "b"], "weights": { "a": 2.0 }, "within_m": 15.0, "dwell_min_s": 60.0,
        "cost": { "kind": "uncertainty", "growth_m2ps": 0.1, "sigma_m": 2.0, "sigma_rad": 0.01, "interval_s": 5.0 },
        "serve_by_s": { "b": 900.0 }, "reduce": "max", "costs_now": { "a": 3.0 }, "next": "b",
    });
    assert_eq!(
        serde_json::to_value(task(long.clone()).expect("valid")).expect("is JSON"),
        long
    );
    let defaulted = task(
        json!({ "kind": "visit", "auvs": ["a"], "cost": { "kind": "uncertainty", "growth_m2ps": 0.1 } }),
    );
    let VisitCost::Uncertainty {
        sigma_m,
        sigma_rad,
        interval_s,
        ..
    } = (match defaulted.expect("valid").goal {
        Goal::Visit(visits) => visits.cost,
        other => panic!("{other:?}"),
    })
    else {
        panic!("another cost")
    };
    assert_eq!([sigma_m, sigma_rad, interval_s], [1.5, 0.02, 10.0]);
    for (goal, fault) in [
        (json!({ "kind": "visit" }), "auvs"),
        (
            json!({ "kind": "visit", "auvs": ["a"], "dwell_s": 3.0 }),
            "dwell_s",
        ),
        (json!({ "kind": "midpoint", "auvs": ["a"], "next": "a" }), "next"),
        (
            json!({ "kind": "visit", "auvs": ["a"], "cost": { "kind": "data", "growth_kbps": 1.0 } }),
            "upload_kbps",
        ),
        (
            json!({ "kind": "visit", "auvs": ["a"], "cost": { "kind": "age", "sigma_m": 1.0 } }),
            "sigma_m",
        ),
    ] {
        let error = task(goal).expect_err("is refused");
        assert!(error.contains(fault), "{error}");
    }
}

#[test]
fn what_cannot_be_visited_is_refused_by_field_and_value() {
    type Change<'a> = &'a dyn Fn(&mut Visits);
    let changes: [(Change<'_>, &str); 12] = [
        (
            &|visits| visits.auvs.push("auv-0".into()),
            "goal/auvs/3: the name \"auv-0\" stands twice",
        ),
        (
            &|visits| visits.auvs.push("x".into()),
            "goal/auvs/3: no vehicle is called \"x\"",
        ),
        (&|visits| visits.auvs.clear(), "goal/auvs: has 0 items"),
        (
            &|visits| visits.within_m = 0.5,
            "goal/within_m: 0.5 is not in [1, 5000]",
        ),
        (
            &|visits| visits.dwell_min_s = f64::NAN,
            "goal/dwell_min_s: NaN is not in [0, 3600]",
        ),
        (
            &|visits| visits.weights = visits.auvs.iter().map(|id| (id.clone(), 0.0)).collect(),
            "goal/weights: at least one",
        ),
        (
            &|visits| _ = visits.weights.insert("auv-1".into(), -1.0),
            "goal/weights/auv-1: -1 is not in [0, 1000000]",
        ),
        (
            &|visits| _ = visits.serve_by_s.insert("x".into(), 1.0),
            "goal/serve_by_s/x: only vehicles in goal/auvs",
        ),
        (
            &|visits| _ = visits.costs_now.insert("auv-1".into(), 1e13),
            "goal/costs_now/auv-1: 10000000000000 is not in",
        ),
        (
            &|visits| visits.next = Some("y".into()),
            "goal/next: only vehicles in goal/auvs",
        ),
        (
            &|visits| {
                visits.cost = VisitCost::Data {
                    growth_kbps: 1.0,
                    upload_kbps: 0.0,
                    range_max_m: 0.1,
                }
            },
            "goal/cost/upload_kbps: 0 is not in [0.001, 1000000]",
        ),
        (
            &|visits| {
                visits.cost = VisitCost::Uncertainty {
                    growth_m2ps: 1e9,
                    sigma_m: 1.0,
                    sigma_rad: 0.0,
                    interval_s: 1.0,
                };
            },
            "goal/cost/growth_m2ps: 1000000000 is not in",
        ),
    ];
    for (change, fault) in changes {
        let mut request = random(0, 3, 100.0);
        change(visits(&mut request));
        let error = Snapshot::try_from(request).expect_err("is refused").to_string();
        assert!(error.contains(fault), "{error}");
    }
}

#[test]
fn a_schedule_from_before_hearing_was_known_is_taken_and_an_impossible_one_is_refused() {
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
            "heard_within_m: -1 is not in [0, 5000000]",
        ),
        (
            &|known| known.unheard_s = 3e11,
            "unheard_s: 300000000000 is not in [0, 200000000000]",
        ),
    ];
    for (change, fault) in changes {
        let mut schedule = older.clone();
        change(&mut schedule.costs[0]);
        let error = Snapshot::try_from(later(&request, &schedule, 1.0)).expect_err("is refused");
        assert!(
            error
                .to_string()
                .contains(&format!("previous_plan/schedule/costs/0/{fault}")),
            "{error}"
        );
    }
}

#[test]
fn a_plan_follows_its_schedule_and_brings_it_back() {
    let mut request = random(12, 3, 120.0);
    request.acoustics = Some(Acoustics { range_max_m: 2000.0 });
    let (parameters, mut workspace) = (crate::Parameters::default(), crate::Workspace::default());
    let snapshot = Snapshot::try_from(request.clone()).expect("valid");
    let plan = crate::plan(&snapshot, &parameters, &mut workspace);
    let schedule = plan.schedule.clone().expect("the goal visits");
    assert!(!schedule.kept);
    // The AUV that the schedule serves now or next, until it is left.
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
fn a_visit_is_not_cut_short_by_the_far_away_auv_that_is_next() {
    // 40 m before the first AUV, at full speed; the next one lies 600 m behind it.
    let at = |north: f64| AuvState::new(Vector2::new(north, 0.0), 5.0, Course::new(0.0), 0.0);
    let auvs = vec![Auv::new("here", at(40.0)), Auv::new("far", at(-560.0))];
    let mut goal = Visits::new(auvs.iter().map(|auv| auv.id.clone()).collect());
    (goal.cost, goal.dwell_min_s) = (costs()[1], 30.0);
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
fn the_goal_goes_from_one_auv_to_the_next_no_faster_than_the_craft_and_sets_off_where_the_first_one_is() {
    let mut n_legs = 0;
    for apart in [41.0, 45.0, 60.0, 300.0] {
        for (course, speed) in [(0.0, 0.0), (0.7, 0.4), (4.0, 0.3)] {
            let at = |north: f64| AuvState::new(Vector2::new(north, 0.0), 5.0, Course::new(course), speed);
            let auvs = vec![Auv::new("here", at(40.0)), Auv::new("there", at(40.0 + apart))];
            let mut goal = Visits::new(auvs.iter().map(|auv| auv.id.clone()).collect());
            (goal.cost, goal.dwell_min_s) = (costs()[1], 30.0);
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
fn how_well_the_others_are_known_takes_nothing_from_the_way_to_the_auv_that_is_next() {
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
