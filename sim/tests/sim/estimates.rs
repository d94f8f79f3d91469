//! The cost of knowing an underwater vehicle by reports.

use pilotfish_sim::guide::Guide;
use pilotfish_sim::metrics::Metrics;
use pilotfish_sim::mission::Mission;
use pilotfish_sim::scenario::{FaultFile, FaultKindFile, Quantity, ReportedAs, Scenario};

use crate::{flown_by, los, mpc, named};

const SEEDS: [u64; 4] = [1, 2, 3, 4];

#[test]
fn exact_reports_of_a_fast_turning_vehicle_are_as_good_as_states() {
    // Root mean square distance to the goal after the approach, m, over all seeds.
    let [reports, state] = [ReportedAs::Reports, ReportedAs::State].map(|reported_as| {
        let mut scenario = named("fast-lawn-mower");
        let acoustics = scenario.knowledge.acoustics.as_mut();
        acoustics.expect("hears by acoustics").reported_as = reported_as;
        let squares = SEEDS.map(|seed| {
            let metrics = Metrics::of(&flown_by(&scenario, &mut mpc(), seed));
            metrics.surface_craft.expect("has one").settled_rms_m.powi(2)
        });
        (squares.iter().sum::<f64>() / 4.0).sqrt()
    });
    // Measured 1.00; a filter without manoeuvres had 6.3.
    assert!(reports < 1.1 * state, "reports {reports} m, state {state} m");
}

#[test]
fn a_beacon_of_which_only_ranges_are_heard_is_found_by_the_figure_that_they_ask_for() {
    let scenario = named("localise-beacon").lasting(500.0);
    let record = flown_by(&scenario, &mut mpc(), 1);
    let navigation: Vec<_> = record.rows.iter().filter_map(|row| row.auvs[0].navigation).collect();
    let mean = |rows: &[pilotfish_sim::record::NavigationRow]| {
        rows.iter().map(|row| row.error).sum::<f64>() / rows.len() as f64
    };
    let [begin, end] = [&navigation[..10], &navigation[400..]].map(mean);
    // At first it is anywhere on a ring of 200 m.
    assert!(100.0 < begin && end < 15.0, "{begin} {end}");
}

/// Shares of estimates with a contradicted claim of the reports, and the root mean square error of
/// the estimates, m.
#[derive(Debug, Default)]
struct Claims {
    accuracy_contradicted: f64,
    velocity_contradicted: f64,
    rms: f64,
}

fn claims(scenario: &Scenario) -> Claims {
    let (mut sum, mut n) = (Claims::default(), 0.0);
    for seed in SEEDS {
        let mut guide = los();
        let mut mission = Mission::new(scenario, guide.name(), seed).expect("starts");
        while !mission.is_over() {
            let snapshot = mission.observe().expect("is in range").expect("has a craft");
            let guidance = guide.guide(&snapshot).expect("answers");
            mission.step(Some((&snapshot, guidance)));
            let row = mission.record().rows.last().expect("has stepped");
            for (estimate, auv) in snapshot.estimates().iter().zip(&row.auvs) {
                let state = &estimate.state;
                let error = state.position() + state.velocity() * state.age_s - auv.position;
                n += 1.0;
                sum.accuracy_contradicted += f64::from(u8::from(estimate.inflation > 0.0));
                sum.velocity_contradicted += f64::from(u8::from(estimate.velocity_contradicted));
                sum.rms += error.norm_squared();
            }
        }
    }
    Claims {
        accuracy_contradicted: sum.accuracy_contradicted / n,
        velocity_contradicted: sum.velocity_contradicted / n,
        rms: (sum.rms / n).sqrt(),
    }
}

fn with_fault(name: &str, fault: impl Fn(String) -> FaultKindFile) -> Scenario {
    let mut scenario = named(name);
    scenario.faults.push(FaultFile {
        from_s: Quantity::fixed(0.0),
        until_s: None,
        craft: None,
        what: fault(scenario.auvs[0].id.clone()),
    });
    scenario
}

#[test]
fn true_claims_are_hardly_ever_doubted_and_wrong_ones_cost_little() {
    let nominal = ["fast-lawn-mower", "rough-water", "noisy-fixes"].map(|name| {
        let claims = claims(&named(name));
        // Measured: 0.0007 at most; estimates without doubt differ by 0.1 mm.
        assert!(claims.accuracy_contradicted < 0.002, "{name}: {claims:?}");
        assert!(claims.velocity_contradicted < 0.002, "{name}: {claims:?}");
        claims.rms
    });
    let speed_zero = with_fault("fast-lawn-mower", |auv| FaultKindFile::ReportsSpeedZero { auv });
    let doubted = claims(&speed_zero).velocity_contradicted;
    assert!(doubted > 0.9, "{doubted}");
    for factor in [0.001, 0.1, 0.3] {
        let wrong = with_fault("noisy-fixes", |auv| FaultKindFile::WrongAccuracy {
            auv,
            factor: Quantity::fixed(factor),
        });
        let rms = claims(&wrong).rms;
        assert!(rms < 2.0 * nominal[2], "{factor}: {rms} m, nominal {nominal:?} m");
    }
    let twice = with_fault("noisy-fixes", |auv| FaultKindFile::MessagesTwice { auv });
    let rms = claims(&twice).rms;
    assert!(rms < 1.1 * nominal[2], "{rms} m, nominal {nominal:?} m");
}
