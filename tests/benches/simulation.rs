//! The speed of the simulator: the vehicles alone, with the line-of-sight law, and with the planner
//! once a second.
//!
//! Criterion's elements per second are simulated seconds per second of wall clock.

use std::{f64::consts::FRAC_PI_4, time::Duration};

use criterion::{BatchSize, BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use planner::{angle::Heading, los::Reference, parameters::Parameters};
use sim::{
    guide::{Guide, LosGuide, MpcGuide},
    mission::run,
    scenario::Scenario,
};

/// One surface craft and one underwater vehicle.
const TRACKING: &str = "paper-tracking";
/// The same underwater vehicle without a surface craft.
const PATH_FOLLOWING: &str = "paper-path-following";
/// Simulated time of one iteration, s: start, first leg of the dive and first pitch reversal.
const SIMULATED_SECONDS: u32 = 120;
/// Steps of the world in that time: the inner loops run ten times a second.
const STEPS: u32 = 10 * SIMULATED_SECONDS;

fn scenario(name: &str) -> Scenario {
    let scenario = Scenario::named(name).expect("the scenario exists");
    scenario.lasting(f64::from(SIMULATED_SECONDS))
}

/// Hulls, inner loops, path following and sawtooth; the surface craft holds one speed and heading.
fn vehicles_alone(criterion: &mut Criterion) {
    let reference = Reference {
        speed: 0.5,
        heading: Heading::new(FRAC_PI_4),
    };
    let mut group = criterion.benchmark_group("vehicles_alone");
    group.throughput(Throughput::Elements(SIMULATED_SECONDS.into()));
    for name in [TRACKING, PATH_FOLLOWING] {
        let start = scenario(name).start(1).expect("valid").world;
        group.bench_function(BenchmarkId::from_parameter(name), |bencher| {
            bencher.iter_batched_ref(
                || start.clone(),
                |world| {
                    for _ in 0..STEPS {
                        world.step(Some(&reference));
                    }
                },
                BatchSize::SmallInput,
            );
        });
    }
    group.finish();
}

/// Whole missions, with observations and a record.
fn guided<G: Guide>(criterion: &mut Criterion, group: &str, guide: impl Fn() -> G) {
    let scenario = scenario(TRACKING);
    let mut group = criterion.benchmark_group(group);
    group.throughput(Throughput::Elements(SIMULATED_SECONDS.into()));
    group.sample_size(20).measurement_time(Duration::from_secs(3));
    group.bench_function(BenchmarkId::from_parameter(TRACKING), |bencher| {
        bencher.iter(|| run(&scenario, &mut guide(), 1, &mut |_| {}).expect("nothing can fail in process"));
    });
    group.finish();
}

fn with_los(criterion: &mut Criterion) {
    guided(criterion, "with_los", || LosGuide::new(Parameters::default().los));
}

fn with_mpc(criterion: &mut Criterion) {
    guided(criterion, "with_mpc", || MpcGuide::new(Parameters::default()));
}

criterion_group!(benches, vehicles_alone, with_los, with_mpc);
criterion_main!(benches);
