//! Schedules of whole requests.

mod bound;
mod json;
mod memory;
mod search;
mod slow;
mod way;

use std::f64::consts::{PI, TAU};

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde_json::{Value, json};

use super::depth::depths_ahead;
use super::fleet::{Fleet, SchedulingParameters};
use super::schedule::Scheduler;
use super::state::CostState;
use crate::coast::way::Search;
use crate::facts::schedule::{CostUnit, LeftOut, Schedule, ServedVehicle};
use crate::facts::visit::{Fixes, Reduce, VisitCost, Visits};
use crate::predict::goal::forecast_all;
use crate::snapshot::Acoustics;
use crate::tests::prelude::*;

const AGE_MAX: f64 = 900.0;
const SPEED: f64 = 1.5;
const TURN_RATE: f64 = 0.17;

fn cost(cost: Value) -> VisitCost {
    serde_json::from_value(cost).expect("is a cost")
}

fn costs() -> [VisitCost; 4] {
    let data = json!({ "kind": "data", "growth_kbps": 0.5, "upload_kbps": 6.0, "range_max_m": 300.0 });
    let uncertainty = json!({ "kind": "uncertainty", "growth_m2ps": 0.03 });
    let ranges = json!({ "kind": "uncertainty", "fixes": "range", "growth_m2ps": 0.03 });
    [VisitCost::Age, cost(uncertainty), cost(data), cost(ranges)]
}

/// A request with `n` AUVs up to `far` metres away, `auv-0` and so on, with random costs.
fn random(seed: usize, n: usize, far: f64) -> PlanRequest {
    let mut rng = ChaCha8Rng::seed_from_u64(seed as u64);
    let auv = |i: usize, rng: &mut ChaCha8Rng| {
        let place = direction(rng.random_range(-PI..PI)) * rng.random_range(0.0..far);
        let course = Course::new(rng.random_range(-PI..PI));
        let (depth, speed) = (rng.random_range(0.0..40.0), rng.random_range(0.0..0.5));
        Auv::new(format!("auv-{i}").as_str(), AuvState::new(place, depth, course, speed))
    };
    let auvs: Vec<_> = (0..n).map(|i| auv(i, &mut rng)).collect();
    let ids: Vec<_> = auvs.iter().map(|auv| auv.id.clone()).collect();
    let mut visits = Visits::new(ids.clone());
    visits.cost = costs()[rng.random_range(0..4)];
    visits.dwell_min_s = Some(30.0);
    let costs = ids.into_iter().map(|id| (id, rng.random_range(0.0..400.0)));
    visits.costs_now = costs.collect();
    if rng.random_bool(0.3) {
        visits.reduce = Reduce::Max;
    }
    let craft = Asc::new(Vector2::zeros(), Heading::new(rng.random_range(-PI..PI)), 1.0);
    let mut request = PlanRequest::new(1000.0, craft, auvs, Goal::Visit(visits));
    let current = [(); 2].map(|()| rng.random_range(-0.3..0.3));
    request.current = Some(Vector2::from(current).into());
    request
}

/// A request of a craft at the datum to visit two AUVs with these states and costs.
fn two(auvs: &[(&str, AuvState, f64); 2], heading: f64, speed: f64) -> PlanRequest {
    let ids = || auvs.iter().map(|(id, ..)| VehicleId::from(*id));
    let mut goal = Visits::new(ids().collect());
    goal.costs_now = ids().zip(auvs.iter().map(|(.., cost)| *cost)).collect();
    let auvs = auvs.iter().map(|(id, state, _)| Auv::new(*id, *state));
    let craft = Asc::new(Vector2::zeros(), Heading::new(heading), speed);
    PlanRequest::new(1000.0, craft, auvs.collect(), Goal::Visit(goal))
}

/// The state of an AUV that rests there.
fn resting(north: f64, east: f64) -> AuvState {
    moving(north, east, 5.0, 0.0, 0.0)
}

fn states(request: &mut PlanRequest) -> impl Iterator<Item = &mut AuvState> {
    request.auvs.iter_mut().filter_map(|auv| auv.state.as_mut())
}

/// The request by mean age without a least time, from a craft at rest in still water.
fn by_age(mut request: PlanRequest) -> PlanRequest {
    (request.current, request.asc.speed_mps) = (None, 0.0);
    let goal = visits(&mut request);
    (goal.cost, goal.reduce, goal.dwell_min_s) = (VisitCost::Age, Reduce::Mean, Some(0.0));
    request
}

fn known<'a>(schedule: &'a Schedule, id: &VehicleId) -> &'a ServedVehicle {
    let known = schedule.costs.iter().find(|known| known.auv == *id);
    known.expect("is listed")
}

fn visits(request: &mut PlanRequest) -> &mut Visits {
    let Goal::Visit(visits) = &mut request.goal.goal else { panic!("the goal visits") };
    visits
}

fn scheduled(request: &PlanRequest) -> Schedule {
    scheduled_with(request, &SchedulingParameters::default())
}

/// The AUV of the first visit.
fn next(request: &PlanRequest) -> VehicleId {
    scheduled(request).visits[0].auv.clone()
}

fn scheduled_with(request: &PlanRequest, parameters: &SchedulingParameters) -> Schedule {
    let snapshot = Snapshot::try_from(request.clone()).expect("valid");
    let scheduler = Scheduler {
        parameters,
        speed: SPEED,
        turn_rate: TURN_RATE,
        report_age_max: AGE_MAX,
        clearance: 1.3,
        due: &|| false,
    };
    let scheduled = scheduler.schedule(&snapshot, &forecast_all(&snapshot));
    scheduled.expect("the goal visits").schedule
}

/// `request` after `elapsed` s, with the schedule in its previous plan.
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
    let snapshot = Snapshot::try_from(request.clone()).expect("valid");
    let Goal::Visit(visits) = &snapshot.goal.goal else { panic!("the goal visits") };
    let member = |auv: usize| super::fleet::ScheduledAuv {
        auv,
        weight: 1.0,
        cost: visits.costs_now[&snapshot.auvs[auv].id],
        deadline: (auv == 0).then_some(0.4 * horizon),
    };
    let members: Vec<_> = (0..snapshot.auvs.len()).map(member).collect();
    let forecasts = forecast_all(&snapshot);
    let depths = depths_ahead(&snapshot, &forecasts);
    let craft = (SPEED, TURN_RATE);
    let ways = Search { land: snapshot.land(), clearance: 1.3, due: &|| false };
    Fleet::new(&snapshot, visits, &members, (&forecasts, &depths), craft, &parameters, &ways)
}

/// A horizon short enough for enumeration, as variances allow visits of several lengths.
fn horizon(request: &PlanRequest, of_one_length: f64) -> f64 {
    match &request.goal.goal {
        Goal::Visit(Visits { cost: VisitCost::Uncertainty { .. }, .. }) => 0.5 * of_one_length,
        _ => of_one_length,
    }
}

/// The least `worth` of all sequences of visits that continue `state`.
fn enumerated(
    fleet: &Fleet,
    state: &CostState,
    only: Option<usize>,
    worth: fn(&Fleet, &CostState) -> f64,
) -> f64 {
    let mut best = f64::INFINITY;
    for to in 0..fleet.candidates.len() {
        if only.is_some_and(|only| only != to) || state.with == Some(to) {
            continue;
        }
        let track = &fleet.candidates[to].track;
        let from = fleet.departure(state);
        let Some(arrival) = fleet.craft.arrive(track, &from, fleet.within, fleet.horizon) else {
            continue;
        };
        let there = fleet.travelled(state, to, arrival);
        let (cost, place) = (there.costs[to], fleet.service_place(track.depth_at(arrival.time)));
        for dwell in fleet.law.dwells(cost, place, fleet.dwell_min, &fleet.tuned) {
            let left = fleet.visited_until(&there, to, fleet.horizon.min(arrival.time + dwell));
            best = best.min(worth(fleet, &fleet.visited_until(&left, to, fleet.horizon)));
            if left.time < fleet.horizon {
                best = best.min(enumerated(fleet, &left, None, worth));
            }
        }
    }
    best
}

/// `request` after `step` seconds of a turn on the spot and a leg to its `schedule`'s AUV.
fn after_leg(request: &PlanRequest, schedule: &Schedule, step: f64) -> PlanRequest {
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
    for state in states(&mut after) {
        let place = state.position() + state.velocity() * step;
        (state.north_m, state.east_m) = (place.x, place.y);
    }
    after.current = None;
    after
}
