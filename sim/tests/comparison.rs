//! The planner against the line-of-sight law tuned for the very mission, on the same observations.

use planner::{los::LosLaw, policy::Policy};
use sim::{
    guide::MpcGuide,
    metrics::{Metrics, SurfaceCraftMetrics},
    mission::run,
    scenario::Scenario,
    tuning::{tune, tune_los},
};

/// Starts up to 1 m and 0.1 rad apart.
const SEEDS: [u64; 3] = [1, 2, 3];

/// Tuned line of sight, then the planner.
fn both(scenario: &Scenario, seed: u64) -> [SurfaceCraftMetrics; 2] {
    let name = &scenario.name;
    let (gains, los) = tune_los(scenario, seed, &mut |_| {}).expect("tunes");
    let record = run(scenario, &mut MpcGuide::new(Policy::default()), seed, &mut |_| {}).expect("runs");
    let metrics = [los, Metrics::of(&record)].map(|metrics| metrics.surface_craft.expect("has one"));
    for (method, of) in ["los", "mpc"].into_iter().zip(&metrics) {
        println!(
            "{name} {seed} {method}: rms {:.3} settled {:.3} energy {:.0} travel {:.1} {:?} (los {gains:?})",
            of.rms_m, of.settled_rms_m, of.energy_j, of.heading_travel_rad, of.rungs
        );
    }
    metrics
}

/// Most of the whole mission's error is the approach, which the thrusters bound for both.
#[test]
fn the_planner_is_never_worse_than_tuned_line_of_sight() {
    for name in ["paper-tracking", "paper-midpoint", "cross-current"] {
        let scenario = Scenario::named(name).expect("exists");
        for seed in SEEDS {
            let [los, mpc] = both(&scenario, seed);
            assert!(
                mpc.rms_m <= los.rms_m,
                "{name}, seed {seed}: {} against {}",
                mpc.rms_m,
                los.rms_m
            );
            assert!(
                mpc.settled_rms_m <= 0.5 * los.settled_rms_m,
                "{name}, seed {seed}"
            );
            // Two of the midpoint's answers are other rungs, predicted to do better.
            let others = if name == "paper-midpoint" { 2 } else { 0 };
            assert_eq!(mpc.rungs.mpc, 1800 - others, "{name}: {:?}", mpc.rungs);
            assert_eq!(mpc.rungs.hold, 0, "{name}: {:?}", mpc.rungs);
        }
    }
}

/// The strongest of the laws, which the planner does not beat everywhere: measured, its approach is up to 1.8 %
/// nearer, for more energy.
#[test]
fn line_of_sight_in_the_tracker_s_frame_gains_a_little_on_the_approach_and_loses_the_rest() {
    for name in ["paper-tracking", "paper-midpoint", "cross-current"] {
        let scenario = Scenario::named(name).expect("exists");
        let (_, law) = tune(LosLaw::TrackerFrame, &scenario, SEEDS[0], &mut |_| {}).expect("tunes");
        let law = law.surface_craft.expect("has one");
        let [_, mpc] = both(&scenario, SEEDS[0]);
        assert!(
            mpc.rms_m <= 1.03 * law.rms_m,
            "{name}: {} against {}",
            mpc.rms_m,
            law.rms_m
        );
        assert!(mpc.settled_rms_m < law.settled_rms_m, "{name}");
        assert!(mpc.energy_j < law.energy_j, "{name}");
    }
}

#[test]
fn anticipating_the_hand_over_halves_the_error() {
    let scenario = Scenario::named("paper-intermittent").expect("exists");
    for seed in SEEDS {
        let [los, mpc] = both(&scenario, seed);
        assert!(
            mpc.rms_m <= 0.5 * los.rms_m,
            "seed {seed}: {} against {}",
            mpc.rms_m,
            los.rms_m
        );
        // Measured: 169 to 173 answers are the previous plan's, predicted to do better than a program solved anew.
        assert!(1745 <= mpc.rungs.mpc, "{:?}", mpc.rungs);
        assert_eq!(mpc.rungs.mpc + mpc.rungs.previous_plan, 1920, "{:?}", mpc.rungs);
    }
}

/// The loop that winds up: the planner's model of it is optimistic. Its approach is slower than line of
/// sight's by a few per cent, it keeps closer afterwards and at hand-overs, and pays with energy and with
/// circles that it turns while the loop slows down.
#[test]
fn without_drag_feed_forward_the_approach_is_lost_by_a_little_and_the_rest_won() {
    for (name, share) in [
        ("paper-tracking", 1.04),
        ("paper-midpoint", 1.04),
        ("cross-current", 1.04),
        ("paper-intermittent", 0.5),
    ] {
        let mut scenario = Scenario::named(name).expect("exists");
        scenario
            .surface_craft
            .as_mut()
            .expect("has one")
            .drag_feed_forward = false;
        let [los, mpc] = both(&scenario, SEEDS[0]);
        assert!(
            mpc.rms_m <= share * los.rms_m,
            "{name}: {} against {}",
            mpc.rms_m,
            los.rms_m
        );
        assert!(mpc.settled_rms_m <= 0.5 * los.settled_rms_m, "{name}");
    }
}
