//! Telemetry of the service: metrics, logs and traces.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use axum::{Router, body::Body, http::Request};
use planner::plan::plan_until;
use serde_json::{Value, json};
use service::Settings;
use tests::client::{call, example, get, post, send_to, simulated_machine, with};
use tests::voyage::Log;
use tracing_subscriber::filter::LevelFilter;

use super::missions::{Service, id};

const DASHBOARD: &str = include_str!("../../packaging/grafana-dashboard.json");

/// Every sample by its name and labels, as written.
struct Samples(BTreeMap<String, f64>);

impl Samples {
    async fn of(service: &Router) -> Self {
        let answer = send_to(service.clone(), get("/metrics")).await;
        answer.must_be(200);
        let media_type = "application/openmetrics-text; version=1.0.0; charset=utf-8";
        assert_eq!(answer.content_type(), media_type);
        let lines = answer.text.strip_suffix("# EOF\n");
        let lines = lines.expect("ends as it should").lines();
        let sample = |line: &str| {
            let (name, value) = line.rsplit_once(' ').expect("is a name and a value");
            (name.to_owned(), value.parse().expect("is a number"))
        };
        Self(lines.filter(|line| !line.starts_with("# ")).map(sample).collect())
    }

    /// The sum of the samples of that name with all of these labels.
    fn sum(&self, name: &str, labels: &[&str]) -> f64 {
        let of_name = |sample: &&String| sample.split('{').next() == Some(name);
        let samples = self.0.iter().filter(|(sample, _)| of_name(sample));
        samples
            .filter(|(sample, _)| labels.iter().all(|label| sample.contains(label)))
            .map(|(_, value)| value)
            .sum()
    }

    fn names(&self) -> BTreeSet<&str> {
        self.0.keys().map(|sample| sample.split('{').next().unwrap_or(sample)).collect()
    }
}

async fn posted(service: &Router, path: &str, body: &Value) {
    let answer = send_to(service.clone(), post(path, body.to_string())).await;
    assert!(answer.status.is_success(), "{}", answer.text);
}

/// A period of a running mission, on the service's clock.
const PERIOD: Duration = Duration::from_millis(100);

/// The metrics that the dashboard's queries name.
fn asked_for() -> BTreeSet<String> {
    let dashboard: Value = serde_json::from_str(DASHBOARD).expect("is JSON");
    let list = |value: &Value| value.as_array().cloned().unwrap_or_default();
    let panels = list(&dashboard["panels"]).into_iter();
    let targets = panels.flat_map(|panel| list(&panel["targets"]));
    let queries = targets.map(|target| target["expr"].as_str().expect("is a query").to_owned());
    let variables = list(&dashboard["templating"]["list"]).into_iter();
    let of_variables = variables.filter_map(|variable| Some(variable["definition"].as_str()?.to_owned()));
    let queries: Vec<_> = queries.chain(of_variables).collect();
    let is_metric = |word: &&str| word.starts_with("pilotfish_") || word.starts_with("process_");
    let words = queries
        .iter()
        .flat_map(|query| query.split(|letter: char| !letter.is_ascii_alphanumeric() && letter != '_'));
    words.filter(is_metric).map(str::to_owned).collect()
}

#[tokio::test(start_paused = true)]
async fn the_dashboard_queries_existing_metrics() {
    let service = Service::start_with(simulated_machine()).await;
    posted(&service.router, "/v1/plan", &example("track")).await;
    service.running().await;
    service.clock.sleep(PERIOD).await;
    let samples = Samples::of(&service.router).await;
    assert!(0.0 < samples.sum("pilotfish_mission_plan_late_seconds_count", &[]));
    let (told, asked) = (samples.names(), asked_for());
    assert!(20 < asked.len(), "{asked:?}");
    let missing: Vec<_> = asked.iter().filter(|name| !told.contains(name.as_str())).collect();
    assert!(missing.is_empty(), "{missing:?} are not among {told:#?}");
    assert!(1e6 < samples.sum("process_resident_memory_bytes", &[]));
}

#[tokio::test(start_paused = true)]
async fn plans_and_calls_are_counted_under_fixed_labels() {
    let service = service::app(simulated_machine());
    posted(&service, "/v1/plan", &example("track")).await;
    let mut hurried = example("track");
    hurried["deadline_ms"] = json!(0.05);
    posted(&service, "/v1/plan", &hurried).await;
    let batch = json!({ "requests": [example("track"), example("track")] });
    posted(&service, "/v1/plan/batch", &batch).await;
    for request in [get("/v1/examples/of-a-client"), get("/of-a-client"), call("INVENTED", "/version")] {
        send_to(service.clone(), request).await;
    }

    let samples = Samples::of(&service).await;
    let plans = |labels: &[&str]| samples.sum("pilotfish_plans_total", labels);
    assert_eq!(plans(&["purpose=\"request\"", "outcome=\"ok\""]), 3.0);
    assert_eq!(plans(&["outcome=\"degraded\""]), 1.0);
    assert_eq!(plans(&["method=\"mpc\""]), 3.0);
    assert_eq!(samples.sum("pilotfish_solve_duration_seconds_count", &[]), 4.0);
    assert!(10.0 < samples.sum("pilotfish_solver_iterations_sum", &[]));
    assert!(3.0 <= samples.sum("pilotfish_scp_iterations_sum", &[]));
    let calls = |labels: &[&str]| samples.sum("pilotfish_http_request_duration_seconds_count", labels);
    for (labels, n) in [
        (&["method=\"POST\"", "route=\"/v1/plan\"", "status=\"2xx\""][..], 2.0),
        (&["route=\"/v1/examples/{name}\"", "status=\"4xx\""], 1.0),
        (&["route=\"unmatched\"", "status=\"4xx\""], 1.0),
        (&["method=\"other\"", "route=\"/version\""], 1.0),
    ] {
        assert_eq!(calls(labels), n, "{labels:?}");
    }
    let of_a_client = |sample: &&String| sample.contains("of-a-client") || sample.contains("INVENTED");
    assert_eq!(samples.0.keys().find(of_a_client), None);
}

#[tokio::test(start_paused = true)]
async fn refused_requests_are_counted_by_reason() {
    let settings = Settings { planners: 1, waiting: 0, ..simulated_machine() };
    let clock = settings.clock.clone();
    clock.delay_threads(Duration::from_millis(300));
    let service = service::app(settings);
    let call = || send_to(service.clone(), post("/v1/plan", example("track").to_string()));
    let admitted = async {
        clock.sleep(Duration::from_millis(1)).await;
        let samples = Samples::of(&service).await;
        let admitted = samples.sum("pilotfish_requests_admitted", &["body=\"short\""]);
        assert_eq!(admitted, 1.0);
        call().await
    };
    let (first, second) = tokio::join!(call(), admitted);
    first.must_be(200);
    second.must_be(503);
    let samples = Samples::of(&service).await;
    assert_eq!(samples.sum("pilotfish_requests_admitted", &[]), 0.0);
    let shed = |labels: &[&str]| samples.sum("pilotfish_requests_shed_total", labels);
    assert_eq!((shed(&["reason=\"admission\""]), shed(&[])), (1.0, 1.0));
}

/// `true` while the craft of the test below follows.
static FOLLOWS: AtomicBool = AtomicBool::new(true);

#[tokio::test(start_paused = true)]
async fn missions_are_counted_by_status_and_by_craft_that_do_not_follow() {
    let mut settings = simulated_machine();
    settings.plan = |snapshot, parameters, workspace, stop| {
        let mut plan = plan_until(snapshot, parameters, workspace, stop);
        plan.craft.monitor.alarm = !FOLLOWS.load(Ordering::Relaxed);
        plan
    };
    let service = Service::start_with(settings).await;
    let router = &service.router;
    let after_a_period = async || {
        service.clock.sleep(PERIOD).await;
        Samples::of(router).await
    };
    let log = Log::default();
    let _logs = listen(&log);
    let mission = service.running().await;
    let id = id(&mission);
    let warns = |samples: &Samples| samples.sum("pilotfish_missions_craft_does_not_follow", &[]);
    let samples = after_a_period().await;
    assert!(0.0 < samples.sum("pilotfish_plans_total", &["purpose=\"live\""]));
    let missions =
        |samples: &Samples, status: &str| samples.sum("pilotfish_missions", &["kind=\"live\"", status]);
    let running = missions(&samples, "status=\"running\"");
    assert_eq!((running, warns(&samples)), (1.0, 0.0));
    // Creation, report, run and plan.
    assert!(4.0 <= samples.sum("pilotfish_store_events_total", &[]));
    assert!(4.0 <= samples.sum("pilotfish_store_commit_duration_seconds_count", &[]));

    FOLLOWS.store(false, Ordering::Relaxed);
    assert_eq!(warns(&after_a_period().await), 1.0);
    FOLLOWS.store(true, Ordering::Relaxed);
    let samples = after_a_period().await;
    assert_eq!(warns(&samples), 0.0);
    assert_eq!(samples.sum("pilotfish_craft_does_not_follow_total", &[]), 1.0);
    service.order(&mission, "pause", json!({})).await;
    let samples = Samples::of(router).await;
    assert_eq!(missions(&samples, "status=\"paused\""), 1.0);
    assert_eq!(missions(&samples, ""), 1.0);
    service.order(&mission, "finish", json!({})).await;
    assert_eq!(missions(&Samples::of(router).await, ""), 0.0);

    for told in ["the craft does not follow", "the craft follows again"] {
        assert_eq!(lines_of(&log, &[told, id]).len(), 1, "{told}");
    }
}

/// Captures at the program's level, on the test's thread, which is that of calls and missions.
fn listen(log: &Log) -> impl Drop + use<> {
    let subscriber = tracing_subscriber::fmt()
        .with_max_level(LevelFilter::INFO)
        .with_ansi(false)
        .with_writer(Mutex::new(log.clone()));
    tracing_subscriber::util::SubscriberInitExt::set_default(subscriber)
}

/// The lines of a log with all of these parts.
fn lines_of(log: &Log, parts: &[&str]) -> Vec<String> {
    let text = log.text();
    let holds = |line: &&str| parts.iter().all(|part| line.contains(part));
    text.lines().filter(holds).map(str::to_owned).collect()
}

fn called(request: Request<Body>, id: &str) -> Request<Body> {
    with(request, "x-request-id", id)
}

#[tokio::test(start_paused = true)]
async fn calls_and_changes_are_logged_with_their_call_and_probes_are_not() {
    let service = Service::start_with(simulated_machine()).await;
    let router = &service.router;
    let log = Log::default();
    let _logs = listen(&log);
    let mission = service.running().await;
    let id = id(&mission);
    let paused = called(post(&format!("{mission}/pause"), "{}"), "the-pause");
    send_to(router.clone(), paused).await;
    for probe in ["/livez", "/readyz", "/metrics"] {
        send_to(router.clone(), called(get(probe), "the-probe")).await;
    }
    send_to(router.clone(), called(call("DELETE", &mission), "the-end")).await;

    for (request, change) in [("the-pause", "paused"), ("the-end", "deleted")] {
        let lines = lines_of(&log, &[request, "a mission changed", id]);
        assert!(lines.len() == 1 && lines[0].contains(change), "{lines:?}");
        let route = "route=\"/v1/missions/{id}";
        let lines = lines_of(&log, &[request, "answered", route, "ms=", id, "trace_id="]);
        assert!(lines.len() == 1 && lines[0].contains("INFO"), "{lines:?}");
    }
    assert_eq!(lines_of(&log, &["a mission changed", "created", id]).len(), 1);
    assert_eq!(lines_of(&log, &["the-probe"]), [""; 0]);
}

#[tokio::test(start_paused = true)]
async fn a_trace_continues_in_log_and_answer() {
    const TRACE: &str = "0af7651916cd43dd8448eb211c80319c";
    let service = service::app(simulated_machine());
    let log = Log::default();
    let _logs = listen(&log);
    let mut answered = vec![];
    for given in ["b7ad6b7169203331-01", "b7ad6b7169203331-zz"] {
        let parent = format!("00-{TRACE}-{given}");
        let request = with(get("/version"), "traceparent", &parent);
        let answer = send_to(service.clone(), request).await;
        answered.push(answer.header("traceresponse").to_owned());
    }
    assert_eq!(answered[0].split('-').nth(1), Some(TRACE));
    assert_ne!(answered[0].split('-').nth(2), Some("b7ad6b7169203331"));
    // An invalid context counts as absent.
    let own = answered[1].split('-').nth(1).expect("is a context");
    assert!(own.len() == 32 && own != TRACE, "{own}");
    for trace in [TRACE, own] {
        assert_eq!(lines_of(&log, &["answered", &format!("trace_id={trace}")]).len(), 1);
    }
}
