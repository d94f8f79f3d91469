//! Hand-made snapshots, and the goals that a rule gives its guide.

use std::{cell::RefCell, collections::BTreeSet, rc::Rc};

use planner::angle::{Course, Heading};
use planner::los::Reference;
use planner::plan::Method;
use planner::snapshot::{Asc, Auv, AuvState};

use super::*;

/// A guide that stores the requested goals.
#[derive(Default)]
struct GoalRecorder(Rc<RefCell<Vec<Goal>>>);

impl Guide for GoalRecorder {
    fn name(&self) -> &'static str {
        "asked"
    }

    fn guide(&mut self, snapshot: &Snapshot) -> Result<Guidance, GuideError> {
        self.0.borrow_mut().push(snapshot.goal.goal.clone());
        let reference = Reference { speed: 0.0, heading: Heading::new(0.0) };
        Ok(Guidance { method: Some(Method::Hold), ..reference.into() })
    }
}

/// Four vehicles at rest on a line eastwards: at 100, 0, 400 and 150 m.
const PLACES: [f64; 4] = [100.0, 0.0, 400.0, 150.0];

fn visits(cost: VisitCost) -> Visits {
    let auvs = (0..PLACES.len()).map(|i| VehicleId(format!("auv-{i}"))).collect();
    Visits { cost, ..Visits::new(auvs) }
}

/// A snapshot with the craft at this place on the line; `silent` is not heard after the start.
fn snapshot(t: f64, east: f64, visits: &Visits, silent: Option<usize>) -> Snapshot {
    let auv = |(i, east): (usize, &f64)| {
        let mut state = AuvState::new(Vector2::new(0.0, *east), 5.0, Course::new(0.0), 0.0);
        state.age_s = if silent == Some(i) { 1000.0 + t } else { 0.0 };
        Auv::new(format!("auv-{i}").as_str(), state)
    };
    let auvs = PLACES.iter().enumerate().map(auv).collect();
    let craft = Asc::new(Vector2::new(0.0, east), Heading::new(0.0), 0.0);
    let request = PlanRequest::new(t, craft, auvs, Goal::Visit(visits.clone()));
    Snapshot::try_from(request).expect("valid")
}

/// The AUV that a rule follows in each of `seconds`. The craft jumps to a new place a minute after
/// its order.
fn followed(rule: Rule, dwell: f64, visits: &Visits, seconds: u32, silent: Option<usize>) -> Vec<usize> {
    let mut guide = RuleGuide::new(Box::new(GoalRecorder::default()), rule, dwell);
    let (mut east, mut told, mut all) = (-50.0, (0, usize::MAX), vec![]);
    for second in 0..seconds {
        let guided = guide.guide(&snapshot(f64::from(second), east, visits, silent));
        let next = guided.expect("answers").serves.expect("one is followed");
        if next != told.1 {
            told = (second, next);
        } else if told.0 + 60 == second {
            east = PLACES[next];
        }
        all.push(next);
    }
    all
}

/// Each once as long as it stays.
fn in_order(followed: &[usize]) -> Vec<usize> {
    let mut order = followed.to_vec();
    order.dedup();
    order
}

#[test]
fn oldest_first_repeats_the_order_of_service_and_nearest_first_serves_each_once_a_round() {
    let order = |rule| in_order(&followed(rule, 0.0, &visits(VisitCost::Age), 700, None));
    // Equal ages at first: by travel from −50 m. Then 60 s at each; service is within 20 m.
    assert_eq!(order(Rule::OldestFirst)[..8], [1, 0, 3, 2, 1, 0, 3, 2]);
    // On a line, there and back: the last one of a round is the first of the next.
    assert_eq!(order(Rule::NearestFirst)[..10], [1, 0, 3, 2, 3, 0, 1, 0, 3, 2]);
}

#[test]
fn the_greatest_cost_per_time_agrees_with_a_hand_calculation() {
    let mut visits = visits(VisitCost::Age);
    // From 0 m, 60 s after the start: 60 s over 80 m, 3 · 60 s over 380 m, 60 s over 130 m.
    visits.weights.insert(VehicleId("auv-2".to_owned()), 3.0);
    let order = in_order(&followed(Rule::CostPerTime, 0.0, &visits, 130, None));
    assert_eq!(order[..2], [1, 0]);
    visits.weights.insert(VehicleId("auv-2".to_owned()), 6.0);
    let order = in_order(&followed(Rule::CostPerTime, 0.0, &visits, 130, None));
    assert_eq!(order[..2], [1, 2]);
}

#[test]
fn a_stay_exceeds_the_least_time_by_the_requested_one() {
    let data = VisitCost::Data { growth_kbps: 1.0, upload_kbps: 5.0, range_max_m: 100.0 };
    let mut visits = visits(data);
    visits.dwell_min_s = Some(30.0);
    for (dwell, longer) in [(0.0, 0), (45.0, 45)] {
        let all = followed(Rule::OldestFirst, dwell, &visits, 200, None);
        // There from the 61st second on, as it jumps after the 60th.
        let left = all.iter().position(|next| *next != 1).expect("another is next");
        assert_eq!(left, 61 + 30 + longer);
    }
}

#[test]
fn the_clock_follows_the_hour_and_skips_a_silent_vehicle() {
    let visits = visits(VisitCost::Age);
    let all = followed(Rule::Clock, 40.0, &visits, 320, None);
    // The shortest closed tour of places on a line: there and back, from the nearest to the craft.
    for (second, next) in all.iter().enumerate() {
        assert_eq!(*next, all[40 * (second / 40) % 160], "{second}");
    }
    assert_eq!((all[0], in_order(&all).len()), (1, 8));
    for rule in &Rule::ALL[..4] {
        let all = followed(*rule, 40.0, &visits, 400, Some(0));
        let others = (1..4).all(|other| all.contains(&other));
        assert!(!all.contains(&0) && others, "{rule:?}");
    }
}

#[test]
fn every_rule_replaces_its_goal_by_one_that_planner_and_laws_know() {
    let asked = Rc::new(RefCell::new(vec![]));
    let visits = visits(VisitCost::Age);
    for rule in Rule::ALL {
        let mut guide = RuleGuide::new(Box::new(GoalRecorder(asked.clone())), rule, 40.0);
        guide.guide(&snapshot(7.0, -50.0, &visits, None)).expect("answers");
    }
    let asked = asked.borrow();
    let Goal::Intermittent { auvs, dwell_s, epoch_s } = &asked[0] else { panic!("{:?}", asked[0]) };
    assert_eq!((auvs.len(), *dwell_s, *epoch_s), (4, 40.0, 7.0));
    let nearest = Goal::Track { auv: "auv-1".into() };
    assert!(asked[1..4].iter().all(|goal| *goal == nearest));
    let Goal::Midpoint { auvs } = &asked[4] else { panic!("{:?}", asked[4]) };
    let names: BTreeSet<_> = auvs.iter().collect();
    assert_eq!(names, visits.auvs.iter().collect());
    let (auvs, range_m) = (auvs.clone(), RANGE);
    assert_eq!(asked[5], Goal::Range { auvs, range_m });
}

/// All orders of `left` after `tour`.
fn least(tour: &mut Vec<usize>, left: &mut Vec<usize>, length: &dyn Fn(&[usize]) -> f64) -> f64 {
    if left.is_empty() {
        return length(tour);
    }
    let mut best = f64::INFINITY;
    for i in 0..left.len() {
        tour.push(left.remove(i));
        best = best.min(least(tour, left, length));
        left.insert(i, tour.pop().expect("was pushed"));
    }
    best
}

#[test]
fn the_tour_of_the_clock_is_nearly_the_shortest_of_all_orders() {
    // Scattered by the golden angle and its powers.
    for set in 1..40_u32 {
        let place = |i: u32| {
            let (a, b) = (f64::from(i * set) * 0.618_034, f64::from(i * i + set) * 0.754_878);
            Vector2::new(a.fract(), b.fract()) * 2000.0
        };
        let places: Vec<_> = (0..6).map(place).collect();
        let length = |tour: &[usize]| -> f64 {
            (0..tour.len()).map(|i| (places[tour[i]] - places[tour[(i + 1) % tour.len()]]).norm()).sum()
        };
        let tour = short_tour(&Vector2::zeros(), &places);
        let mut sorted = tour.clone();
        sorted.sort_unstable();
        assert_eq!(sorted, (0..6).collect::<Vec<_>>());
        let shortest = least(&mut vec![0], &mut (1..6).collect(), &length);
        let found = length(&tour);
        // A tour that no exchange of two legs shortens may be longer than the shortest.
        assert!(found < 1.05 * shortest, "{set}: {found}, shortest {shortest}");
    }
}
