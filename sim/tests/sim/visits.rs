//! Missions whose craft chooses the AUV to visit.

use pilotfish_sim::guide::Guide;
use pilotfish_sim::metrics::Metrics;
use pilotfish_sim::record::{AuvRow, Record, Row};
use pilotfish_sim::scenario::{Files, Scenario};

use crate::{craft, flown_by, los, mpc, near, parsed};

/// Distance within which a vehicle counts as served, m: the default of the goal.
const WITHIN: f64 = 20.0;

/// `paper-intermittent` with this goal instead.
fn text(goal: &str) -> String {
    let text = Scenario::text("paper-intermittent").expect("is built in");
    let (before, rest) = text.split_once("[surface_craft.goal.intermittent]").expect("has a goal");
    let (_, after) = rest.split_once("[[auvs]]").expect("has vehicles");
    format!("{before}{goal}\n\n[[auvs]]{after}")
}

/// The scenario with this goal, of 16 minutes.
fn with_goal(goal: &str) -> Scenario {
    parsed(&text(goal)).lasting(960.0)
}

/// True ages of all vehicles in each row, with whether each is served.
fn ages(record: &Record) -> Vec<Vec<(f64, bool)>> {
    let mut ages = vec![0.0; record.auv_ids.len()];
    let mut row = |row: &Row| {
        let of = |(age, auv): (&mut f64, &AuvRow)| {
            let near = (auv.position - craft(row).position).norm() <= WITHIN;
            let begins = near && (*age > 0.0 || row.time == 0.0);
            *age = if near || row.time == 0.0 { 0.0 } else { *age + record.interval };
            (*age, begins)
        };
        ages.iter_mut().zip(&row.auvs).map(of).collect()
    };
    record.rows.iter().map(&mut row).collect()
}

/// Mean and largest of the ages.
fn mean_and_largest(ages: &[Vec<(f64, bool)>]) -> (f64, f64) {
    let each = || ages.iter().flatten().map(|(age, _)| *age);
    let n = each().map(|_| 1.0).sum::<f64>();
    (each().sum::<f64>() / n, each().fold(0.0, f64::max))
}

/// Mean and largest true age of all vehicles, s, after two minutes.
fn flown(scenario: &Scenario, guide: &mut dyn Guide) -> (f64, f64) {
    let record = flown_by(scenario, guide, 1);
    // The true goal is a vehicle.
    for row in &record.rows {
        let goal = craft(row).goal;
        assert!(row.auvs.iter().any(|auv| (auv.position - goal).norm() < 1e-9));
    }
    mean_and_largest(&ages(&record)[120..])
}

#[test]
fn visits_by_age_are_no_worse_than_the_best_fixed_dwell() {
    let auvs = "auvs = [\"auv-1\", \"auv-2\"]";
    let clock = |dwell: u32| {
        let goal = format!("[surface_craft.goal.intermittent]\n{auvs}\ndwell_s = {dwell}\nepoch_s = 0");
        flown(&with_goal(&goal), &mut mpc())
    };
    let visit = with_goal(&format!("[surface_craft.goal.visit]\n{auvs}"));
    let planned = flown(&visit, &mut mpc());
    // With 10 and 20 s the craft stays between both and serves neither.
    let by_the_clock = [20, 40, 80, 160, 240].map(clock);
    let is_best = by_the_clock.iter().all(|clock| planned.0 <= clock.0 && planned.1 <= clock.1);
    assert!(is_best, "mean and largest age, s: {planned:?}, by the clock {by_the_clock:?}");
    // Line of sight, which slows down before a goal, follows the same schedules.
    let by_the_law = flown(&visit, &mut los());
    assert!(by_the_law.0 < by_the_clock[4].0, "{by_the_law:?}");
}

#[test]
fn a_scenario_sets_the_cost_of_visits_and_refuses_unvisited_vehicles() {
    let goal = "[surface_craft.goal.visit]\nauvs = [\"auv-1\", \"auv-2\"]\nreduce = \"max\"\nwithin_m = 15\n\
        cost = {data = {growth_kbps = 0.5, upload_kbps = 6, range_max_m = 200}}\nserve_by_s = {auv-2 = 900}";
    let mut scenario = with_goal(goal);
    let upload = "surface_craft.goal.visit.cost.data.upload_kbps";
    scenario.set(upload, 3.0).expect("is a number of the scenario");
    assert!(scenario.start(0).is_ok());
    let wrong = text(&goal.replace("serve_by_s = {auv-2", "serve_by_s = {auv-9"));
    let read = Scenario::parse(&wrong, "visits.toml", Files::default());
    let error = read.and_then(Scenario::checked).expect_err("is refused");
    let says = "surface_craft.goal.visit.serve_by_s.auv-9";
    assert!(error.to_string().contains(says), "{error}");
}

#[test]
fn true_costs_of_a_mission_match_its_positions() {
    let scenario = with_goal("[surface_craft.goal.visit]\nauvs = [\"auv-1\", \"auv-2\"]").lasting(400.0);
    let record = flown_by(&scenario, &mut los(), 1);
    let ages = ages(&record);
    let (mean, largest) = mean_and_largest(&ages);
    let visits = ages.iter().flatten().filter(|(_, begins)| *begins).count();
    let metrics = Metrics::of(&record).surface_craft.expect("there is one");
    let known = metrics.visits.expect("the goal visits");
    assert!(4 < visits && known.visits == visits, "{known:?}, counted {visits}");
    near(known.mean_cost, mean, 1e-9);
    near(known.max_cost, largest, 1e-9);
    assert!(3 < known.changes, "{known:?}");
}
