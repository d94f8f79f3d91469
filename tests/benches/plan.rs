//! How long a plan takes: in the library, and over HTTP on loopback.
//!
//! One call a sample, so that the samples' own percentiles mean something: criterion leaves them in
//! `target/criterion/*/*/new/sample.json`.

use std::{
    io::{BufRead, BufReader, Read, Write},
    net::{Ipv4Addr, TcpListener, TcpStream},
    time::Duration,
};

use criterion::{
    BenchmarkGroup, Criterion, SamplingMode, criterion_group, criterion_main, measurement::WallTime,
};
use planner::{
    parameters::Parameters,
    plan::{Workspace, plan},
};
use tests::{goals, observation, snapshot};

const NAMES: [&str; 3] = ["track", "intermittent", "midpoint"];

fn group<'a>(criterion: &'a mut Criterion, name: &str) -> BenchmarkGroup<'a, WallTime> {
    let mut group = criterion.benchmark_group(name);
    group.sampling_mode(SamplingMode::Flat).sample_size(1000);
    group.measurement_time(Duration::from_millis(500));
    group
}

/// `planner::plan`: two AUVs, default horizon, a workspace that is kept.
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
    let mut connection = BufReader::new(TcpStream::connect(address).expect("listening"));
    connection.get_ref().set_nodelay(true).expect("a TCP socket");
    let mut group = group(criterion, "post_plan");
    for (name, goal) in NAMES.into_iter().zip(goals()) {
        let request = observation(goal);
        let body = serde_json::to_vec(&request).expect("a request is JSON");
        group.bench_function(name, |bencher| bencher.iter(|| post(&mut connection, &body)));
    }
    group.finish();
}

/// One exchange; answers the length of the body read.
fn post(connection: &mut BufReader<TcpStream>, body: &[u8]) -> usize {
    let head = format!(
        "POST /v1/plan HTTP/1.1\r\nhost: localhost\r\ncontent-type: application/json\r\ncontent-length: {}\r\n\r\n",
        body.len()
    );
    let request = [head.as_bytes(), body].concat();
    connection
        .get_mut()
        .write_all(&request)
        .expect("the service reads");
    let mut length = 0;
    let mut line = String::new();
    let mut first = true;
    loop {
        line.clear();
        connection.read_line(&mut line).expect("the service answers");
        assert!(!first || line.starts_with("HTTP/1.1 200"), "{line}");
        first = false;
        let header = line.trim_end().to_ascii_lowercase();
        if let Some(value) = header.strip_prefix("content-length:") {
            length = value.trim().parse().expect("a length");
        }
        if header.is_empty() {
            break;
        }
    }
    let mut answer = vec![0; length];
    connection.read_exact(&mut answer).expect("as long as it says");
    answer.len()
}

criterion_group!(benches, in_the_library, over_http);
criterion_main!(benches);
