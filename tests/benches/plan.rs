//! The time of a plan: in the library, and over HTTP on loopback.
//!
//! One call a sample, so that the samples' own percentiles mean something: criterion leaves them in
//! `target/criterion/*/*/new/sample.json`.

use std::{
    net::{Ipv4Addr, TcpListener},
    time::Duration,
};

use criterion::{
    BenchmarkGroup, Criterion, SamplingMode, criterion_group, criterion_main, measurement::WallTime,
};
use nalgebra::Vector2;
use planner::{
    angle::Heading,
    parameters::Parameters,
    path::Segment,
    plan::{Workspace, plan},
    snapshot::{Asc, Auv, DeclaredPath, Forecast, Goal, PlanRequest, Report},
};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
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

/// `planner::plan` with its snapshot: one AUV on lanes, 64 fixes 10 s apart. Its route is unused,
/// found, declared with its turn radius, and declared without.
fn with_a_route(criterion: &mut Criterion) {
    let mut group = group(criterion, "route");
    let parameters = Parameters::default();
    let requests = [
        ("unused", on_lanes(None, Forecast::Declared)),
        ("found", on_lanes(None, Forecast::Auto)),
        ("declared", on_lanes(Some(lanes(Some(10.0))), Forecast::Auto)),
        ("any_radius", on_lanes(Some(lanes(None)), Forecast::Auto)),
    ];
    for (name, request) in requests {
        let mut workspace = Workspace::default();
        group.bench_function(name, |bencher| {
            bencher.iter(|| plan(&snapshot(request.clone()), &parameters, &mut workspace));
        });
    }
    group.finish();
}

/// Lanes of 200 m, 30 m apart, sailed at 1 m/s.
fn lanes(turn_radius_m: Option<f64>) -> DeclaredPath {
    let ends = (0..12).flat_map(|lane| {
        let (east, far) = (30.0 * f64::from(lane), 200.0);
        let (from, to) = if lane % 2 == 0 { (0.0, far) } else { (far, 0.0) };
        [[from, east], [to, east]]
    });
    let segments = vec![Segment::Waypoints {
        points: ends.collect(),
        fillet_m: None,
        turn_radius_m,
        legs: vec![],
    }];
    DeclaredPath {
        segments,
        closed: false,
        speed_mps: 1.0,
    }
}

/// The request 15 minutes after the AUV began its lanes.
fn on_lanes(path: Option<DeclaredPath>, forecast: Forecast) -> PlanRequest {
    let sailed = lanes(Some(10.0)).path().expect("can be sailed");
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let mut error = || 1.5 * (0..12).map(|_| rng.random::<f64>() - 0.5).sum::<f64>();
    let fix = |k: u32| {
        let t = 267.0 + 10.0 * f64::from(k);
        Report::new(t, sailed.at(t).position + Vector2::new(error(), error()), 1.5)
    };
    let reports: Vec<_> = (0..64).map(fix).collect();
    let near = reports[63].position() + Vector2::new(-5.0, 8.0);
    let auv = Auv {
        path,
        ..Auv::reported("auv-1", reports)
    };
    let craft = Asc::new(near, Heading::new(0.3), 0.9);
    PlanRequest {
        forecast,
        ..PlanRequest::new(900.0, craft, vec![auv], Goal::Track { auv: "auv-1".into() })
    }
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
    let (agent, url) = (
        ureq::Agent::new_with_defaults(),
        format!("http://{address}/v1/plan"),
    );
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

criterion_group!(benches, in_the_library, with_a_route, over_http);
criterion_main!(benches);
