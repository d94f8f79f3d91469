//! The planner against the line-of-sight law tuned for the very mission, on the same observations.

use pilotfish_lab::comparison::best_gains;
use planner::{
    los::{LosLaw, LosTuning},
    parameters::Parameters,
    plan::Method,
};
use sim::guide::{LosGuide, MpcGuide};
use sim::metrics::{Metrics, SurfaceCraftMetrics};
use sim::mission::run;
use sim::record::Record;
use sim::scenario::Scenario;

/// Starts up to 1 m and 0.1 rad apart.
const SEEDS: [u64; 3] = [1, 2, 3];

/// Unless the previous plan missed an event, a newly solved program is predicted best except for
/// near ties: a lower fallback level answers at most once in this number.
const ONE_IN: usize = 100;

/// Time from one hand-over to the next in paper-intermittent, s.
const DWELL: f64 = 240.0;

/// Time after a hand-over within which the previous plan may be as good, s. Measured: 29 s.
const JUST_HANDED_OVER: f64 = 30.0;

/// The law's best gains for this mission, and their metrics.
fn tune(law: LosLaw, scenario: &Scenario, seed: u64) -> (LosTuning, SurfaceCraftMetrics) {
    let tuning = best_gains(law, scenario, seed, &mut |_| {}).expect("tunes");
    let record = run(scenario, &mut LosGuide::tuned(tuning), seed, &mut |_| {}).expect("runs");
    (tuning, Metrics::of(&record).surface_craft.expect("has one"))
}

fn planned(scenario: &Scenario, seed: u64) -> Record {
    let mut planner = MpcGuide::new(Parameters::default());
    run(scenario, &mut planner, seed, &mut |_| {}).expect("runs")
}

/// Tuned line of sight, then the planner, and the planner's record.
fn both(scenario: &Scenario, seed: u64) -> ([SurfaceCraftMetrics; 2], Record) {
    let name = &scenario.name;
    let (tuning, los) = tune(LosLaw::SaturatedLos, scenario, seed);
    let record = planned(scenario, seed);
    let metrics = [los, Metrics::of(&record).surface_craft.expect("has one")];
    for (method, of) in ["los", "mpc"].into_iter().zip(&metrics) {
        println!(
            "{name} {seed} {method}: rms {:.3} settled {:.3} energy {:.0} travel {:.1} {:?} (los {tuning:?})",
            of.rms_m, of.settled_rms_m, of.energy_j, of.heading_travel_rad, of.answers_by_method
        );
    }
    (metrics, record)
}

/// Asserts that an RMS is at most this share of another one.
fn assert_at_most(share: f64, ours: f64, theirs: f64, of: &str) {
    assert!(ours <= share * theirs, "{of}: {ours} against {theirs}");
}

/// Asserts that a program gave nearly every answer at the times, s, that are `counted`.
fn assert_by_the_program(record: &Record, counted: impl Fn(f64) -> bool) {
    let rows = record.rows.iter().filter(|row| counted(row.time));
    let methods: Vec<_> = rows.filter_map(|row| row.surface_craft.as_ref()?.method).collect();
    let others = methods.iter().filter(|method| **method != Method::Mpc).count();
    let (name, seed, n) = (&record.scenario, record.seed, methods.len());
    assert!(0 < n && others * ONE_IN <= n, "{name}, {seed}: {others} of {n}");
}

/// Most of the whole mission's error is the approach, which the thrusters bound for both.
#[test]
fn the_planner_is_never_worse_than_tuned_line_of_sight() {
    for name in ["paper-tracking", "paper-midpoint", "cross-current"] {
        let scenario = Scenario::named(name).expect("exists");
        for seed in SEEDS {
            let ([los, mpc], record) = both(&scenario, seed);
            let of = format!("{name}, seed {seed}");
            assert_at_most(1.0, mpc.rms_m, los.rms_m, &of);
            assert_at_most(0.5, mpc.settled_rms_m, los.settled_rms_m, &of);
            // Measured: all, except two of lower fallback levels in the approach of paper-midpoint.
            assert_by_the_program(&record, |_| true);
        }
    }
}

/// The strongest law. Measured: its approach is up to 1.8 % nearer, for more energy.
#[test]
fn line_of_sight_in_the_tracker_s_frame_wins_slightly_in_the_approach_and_loses_afterwards() {
    for name in ["paper-tracking", "paper-midpoint", "cross-current"] {
        let scenario = Scenario::named(name).expect("exists");
        let (_, law) = tune(LosLaw::TrackerFrame, &scenario, SEEDS[0]);
        let ([_, mpc], _) = both(&scenario, SEEDS[0]);
        assert_at_most(1.03, mpc.rms_m, law.rms_m, name);
        assert!(mpc.settled_rms_m < law.settled_rms_m, "{name}");
        assert!(mpc.energy_j < law.energy_j, "{name}");
    }
}

/// The gliders of `slocum` report their velocity through the water, without 0.05 m/s of current.
/// Read as a velocity over ground, it leaves the craft 0.37 m behind.
#[test]
fn a_current_that_the_vehicles_do_not_report_is_estimated() {
    let scenario = Scenario::named("slocum").expect("exists").lasting(400.0);
    let record = planned(&scenario, SEEDS[0]);
    let craft = record.rows.iter().filter(|row| 300.0 <= row.time);
    let distances = craft.filter_map(|row| Some(row.surface_craft.as_ref()?.distance()));
    let farthest = distances.fold(0.0, f64::max);
    assert!(0.0 < farthest && farthest < 0.05, "{farthest}");
}

#[test]
fn anticipating_the_hand_over_halves_the_error() {
    let scenario = Scenario::named("paper-intermittent").expect("exists");
    for seed in SEEDS {
        let ([los, mpc], record) = both(&scenario, seed);
        assert_at_most(0.5, mpc.rms_m, los.rms_m, &format!("seed {seed}"));
        // Just before and after a foreseen hand-over the previous plan may be as good: measured, in
        // a tenth of the answers then. Line of sight does not foresee it and is never better.
        let horizon: f64 = Parameters::default().steps.iter().sum();
        let far_from_hand_overs =
            |time: f64| (JUST_HANDED_OVER..DWELL - horizon).contains(&time.rem_euclid(DWELL));
        assert_by_the_program(&record, far_from_hand_overs);
        let answers = mpc.answers_by_method;
        assert_eq!((answers.saturated_los, answers.hold), (0, 0), "seed {seed}");
    }
}

/// A winding-up loop: the planner's model of it is optimistic. Its approach is slower than line of
/// sight's by a few per cent. It keeps closer afterwards and at hand-overs, and pays with energy
/// and with circles that it turns while the loop slows down.
#[test]
fn without_drag_feed_forward_the_planner_loses_slightly_in_the_approach_and_wins_afterwards() {
    for (name, share) in [
        ("paper-tracking", 1.04),
        ("paper-midpoint", 1.04),
        ("cross-current", 1.04),
        ("paper-intermittent", 0.5),
    ] {
        let mut scenario = Scenario::named(name).expect("exists");
        let craft = scenario.surface_craft.first_mut().expect("has one");
        craft.drag_feed_forward = false;
        let ([los, mpc], _) = both(&scenario, SEEDS[0]);
        assert_at_most(share, mpc.rms_m, los.rms_m, name);
        assert_at_most(0.5, mpc.settled_rms_m, los.settled_rms_m, name);
    }
}
