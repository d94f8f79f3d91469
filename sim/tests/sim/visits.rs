//! Missions whose craft chooses the AUV to visit.

use pilotfish_sim::{
    guide::Guide,
    metrics::Metrics,
    mission::run,
    record::Record,
    scenario::{Files, Scenario},
};

use crate::{los, mpc};

/// Distance within which a vehicle counts as served, m: the default of the goal.
const WITHIN: f64 = 20.0;

/// `paper-intermittent` with this goal instead.
fn text(goal: &str) -> String {
    let text = Scenario::text("paper-intermittent").expect("is built in");
    let (before, rest) = text
        .split_once("[surface_craft.goal.intermittent]")
        .expect("has a goal");
    let (_, after) = rest.split_once("[[auvs]]").expect("has vehicles");
    format!("{before}{goal}\n\n[[auvs]]{after}")
}

/// The scenario with this goal, of 16 minutes.
fn with_goal(goal: &str) -> Scenario {
    Scenario::parse(&text(goal), "visits.toml", Files::default())
        .expect("is a scenario")
        .lasting(960.0)
}

/// Mean and largest true age of all vehicles, s, after two minutes.
fn ages(record: &Record) -> (f64, f64) {
    let mut ages = vec![0.0; record.auv_ids.len()];
    let (mut sum, mut n, mut largest) = (0.0, 0.0, 0.0_f64);
    for row in &record.rows {
        let craft = row.surface_craft.as_ref().expect("there is one").position;
        for (age, auv) in ages.iter_mut().zip(&row.auvs) {
            *age = if (auv.position - craft).norm() <= WITHIN {
                0.0
            } else {
                *age + record.interval
            };
            if 120.0 <= row.time {
                (sum, n, largest) = (sum + *age, n + 1.0, largest.max(*age));
            }
        }
    }
    (sum / n, largest)
}

fn flown(scenario: &Scenario, guide: &mut dyn Guide) -> (f64, f64) {
    let record = run(scenario, guide, 1, &mut |_| {}).expect("runs");
    // The true goal is a vehicle.
    for row in &record.rows {
        let goal = row.surface_craft.as_ref().expect("there is one").goal;
        assert!(row.auvs.iter().any(|auv| (auv.position - goal).norm() < 1e-9));
    }
    ages(&record)
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
    assert!(
        by_the_clock
            .iter()
            .all(|clock| planned.0 <= clock.0 && planned.1 <= clock.1),
        "mean and largest age, s: {planned:?}, by the clock {by_the_clock:?}"
    );
    // Line of sight, which slows down before a goal, follows the same schedules.
    let by_the_law = flown(&visit, &mut los());
    assert!(by_the_law.0 < by_the_clock[4].0, "{by_the_law:?}");
}

#[test]
fn a_scenario_sets_the_cost_of_visits_and_refuses_unvisited_vehicles() {
    let goal = "[surface_craft.goal.visit]\nauvs = [\"auv-1\", \"auv-2\"]\nreduce = \"max\"\nwithin_m = 15\n\
        cost = {data = {growth_kbps = 0.5, upload_kbps = 6, range_max_m = 200}}\nserve_by_s = {auv-2 = 900}";
    let mut scenario = with_goal(goal);
    scenario
        .set("surface_craft.goal.visit.cost.data.upload_kbps", 3.0)
        .expect("is a number of the scenario");
    assert!(scenario.start(0).is_ok());
    let wrong = text(&goal.replace("serve_by_s = {auv-2", "serve_by_s = {auv-9"));
    let read = Scenario::parse(&wrong, "visits.toml", Files::default());
    let error = read.and_then(Scenario::checked).expect_err("is refused");
    let error = error.to_string();
    assert!(
        error.contains("surface_craft.goal.visit.serve_by_s.auv-9"),
        "{error}"
    );
}

#[test]
fn true_costs_of_a_mission_match_its_positions() {
    let scenario = with_goal("[surface_craft.goal.visit]\nauvs = [\"auv-1\", \"auv-2\"]").lasting(400.0);
    let record = run(&scenario, &mut los(), 1, &mut |_| {}).expect("runs");
    let mut ages = [0.0; 2];
    let (mut sum, mut largest, mut visits) = (0.0, 0.0_f64, 0);
    for row in &record.rows {
        let craft = row.surface_craft.as_ref().expect("there is one").position;
        for (age, auv) in ages.iter_mut().zip(&row.auvs) {
            let near = (auv.position - craft).norm() <= WITHIN;
            visits += usize::from(near && (*age > 0.0 || row.time == 0.0));
            *age = if near || row.time == 0.0 { 0.0 } else { *age + 1.0 };
            (sum, largest) = (sum + *age, largest.max(*age));
        }
    }
    let metrics = Metrics::of(&record).surface_craft.expect("there is one");
    let known = metrics.visits.expect("the goal visits");
    assert!(
        4 < visits && known.visits == visits,
        "{known:?}, counted {visits}"
    );
    assert!((known.mean_cost - sum / 800.0).abs() < 1e-9 && (known.max_cost - largest).abs() < 1e-9);
    assert!(3 < known.changes, "{known:?}");
}
