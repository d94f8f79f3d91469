//! The time of a plan: in the library, and over HTTP on loopback.
//!
//! One call a sample, so that the samples' own percentiles mean something: criterion leaves them in
//! `target/criterion/*/*/new/sample.json`.

use std::net::{Ipv4Addr, TcpListener};
use std::time::Duration;

use criterion::measurement::WallTime;
use criterion::{BenchmarkGroup, Criterion, SamplingMode, criterion_group, criterion_main};
use planner::parameters::Parameters;
use planner::plan::{Workspace, plan};
use tests::{goals, observation, snapshot};

const NAMES: [&str; 3] = ["track", "intermittent", "midpoint"];

fn group<'a>(criterion: &'a mut Criterion, name: &str) -> BenchmarkGroup<'a, WallTime> {
    let mut group = criterion.benchmark_group(name);
    group.sampling_mode(SamplingMode::Flat).sample_size(1000);
    group.measurement_time(Duration::from_millis(500));
    group
}

/// `planner::plan`: two AUVs, default horizon, a kept workspace.
fn in_the_library(criterion: &mut Criterion) {
    let mut group = group(criterion, "plan");
    let parameters = Parameters::default();
    for (name, goal) in NAMES.into_iter().zip(goals()) {
        let snapshot = snapshot(observation(goal));
        let mut workspace = Workspace::default();
        group.bench_function(name, |bencher| {
            bencher.iter(|| plan(&snapshot, &parameters, &mut workspace));
        });
    }
    group.finish();
}

/// `POST /v1/plan` end to end: one connection kept open, the whole answer read.
fn over_http(criterion: &mut Criterion) {
    let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).expect("a free port");
    let address = listener.local_addr().expect("bound");
    listener.set_nonblocking(true).expect("a socket of ours");
    std::thread::spawn(move || {
        let runtime = tokio::runtime::Runtime::new().expect("threads");
        runtime.block_on(async {
            let listener = tokio::net::TcpListener::from_std(listener).expect("non-blocking");
            axum::serve(listener, service::app(service::Settings::default())).await
        })
    });
    let (agent, url) = (ureq::Agent::new_with_defaults(), format!("http://{address}/v1/plan"));
    let mut group = group(criterion, "post_plan");
    for (name, goal) in NAMES.into_iter().zip(goals()) {
        let request = observation(goal);
        let body = serde_json::to_vec(&request).expect("a request is JSON");
        let post = || {
            let request = agent.post(&url).content_type("application/json");
            let mut answer = request.send(&body).expect("the service answers");
            answer.body_mut().read_to_vec().expect("the answer ends").len()
        };
        group.bench_function(name, |bencher| bencher.iter(post));
    }
    group.finish();
}

criterion_group!(benches, in_the_library, over_http);
criterion_main!(benches);
