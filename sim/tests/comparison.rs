//! The planner against the line-of-sight law tuned for the very mission, on the same observations.

use planner::policy::Policy;
use sim::{
    guide::MpcGuide,
    metrics::{Metrics, SurfaceCraftMetrics},
    mission::run,
    scenario::Scenario,
    tuning::tune_los,
};

const SEED: u64 = 1;

/// Tuned line of sight, then the planner.
fn both(name: &str) -> [SurfaceCraftMetrics; 2] {
    let scenario = Scenario::named(name).expect("exists");
    let (gains, los) = tune_los(&scenario, SEED, &mut |_| {}).expect("tunes");
    let record = run(
        &scenario,
        &mut MpcGuide::new(Policy::default()),
        SEED,
        &mut |_| {},
    )
    .expect("runs");
    let metrics = [los, Metrics::of(&record)].map(|metrics| metrics.surface_craft.expect("has one"));
    for (method, of) in ["los", "mpc"].into_iter().zip(&metrics) {
        println!(
            "{name} {method}: rms {:.3} settled {:.3} energy {:.0} travel {:.1} {:?} (los {gains:?})",
            of.rms_m, of.settled_rms_m, of.energy_j, of.heading_travel_rad, of.rungs
        );
    }
    metrics
}

#[test]
fn the_planner_is_never_worse_than_tuned_line_of_sight() {
    for name in ["paper-tracking", "paper-midpoint", "cross-current"] {
        let [los, mpc] = both(name);
        assert!(
            mpc.rms_m <= los.rms_m,
            "{name}: {} against {}",
            mpc.rms_m,
            los.rms_m
        );
        assert!(mpc.settled_rms_m <= los.settled_rms_m, "{name}");
        assert_eq!(mpc.rungs.mpc, 1800, "{name}: {:?}", mpc.rungs);
    }
}

#[test]
fn anticipating_the_hand_over_halves_the_error() {
    let [los, mpc] = both("paper-intermittent");
    assert!(
        mpc.rms_m <= 0.5 * los.rms_m,
        "{} against {}",
        mpc.rms_m,
        los.rms_m
    );
    assert_eq!(mpc.rungs.mpc, 1920, "{:?}", mpc.rungs);
}
