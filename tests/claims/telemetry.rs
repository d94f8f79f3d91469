//! Telemetry of the service: metrics, logs and traces.

use std::{
    collections::{BTreeMap, BTreeSet},
    io::{self, Write},
    sync::{
        Arc, Mutex,
        atomic::{AtomicBool, Ordering},
    },
    time::Duration,
};

use axum::{
    Router,
    body::Body,
    http::{HeaderValue, Method, Request, StatusCode},
};
use clock::Clock;
use planner::{
    parameters::Parameters,
    plan::{Plan, Workspace, plan_until},
    snapshot::Snapshot,
    stop::Stop,
};
use serde_json::{Value, json};
use service::{Settings, examples::EXAMPLES, missions::Missions};
use store::EventStore;
use tests::client::{Answer, get, post, send_to, simulated_machine};
use tracing_subscriber::{filter::LevelFilter, fmt::MakeWriter};

const DASHBOARD: &str = include_str!("../../packaging/grafana-dashboard.json");

/// Every sample by its name and labels, as written.
struct Samples(BTreeMap<String, f64>);

impl Samples {
    async fn of(service: &Router) -> Self {
        let answer = send_to(service.clone(), get("/metrics")).await;
        assert_eq!(answer.status, StatusCode::OK);
        assert_eq!(
            answer.content_type(),
            "application/openmetrics-text; version=1.0.0; charset=utf-8"
        );
        let lines = answer
            .text
            .strip_suffix("# EOF\n")
            .expect("ends as it should")
            .lines();
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
        self.0
            .keys()
            .map(|sample| sample.split('{').next().unwrap_or(sample))
            .collect()
    }
}

/// A service with missions, and the clock of its machine.
struct Service {
    clock: Clock,
    router: Router,
    _missions: Missions,
    _data: tempfile::TempDir,
}

async fn with_missions(settings: Settings) -> Service {
    let clock = settings.clock.clone();
    let data = tempfile::tempdir().expect("there is room");
    let store = EventStore::open(data.path(), &settings.clock).expect("opens");
    let (router, missions) = service::service(settings, store).await.expect("starts");
    Service {
        clock,
        router,
        _missions: missions,
        _data: data,
    }
}

async fn order(service: &Router, path: &str, body: &Value) -> Answer {
    let answer = send_to(service.clone(), post(path, body.to_string())).await;
    assert!(answer.status.is_success(), "{}", answer.text);
    answer
}

/// Starts a live mission with one AUV at tenfold speed. Returns its path.
async fn running(Service { clock, router, .. }: &Service) -> String {
    let live = json!({ "schema_version": "1.0", "live": {
        "auvs": [{ "id": "auv-1" }], "goal": { "kind": "track", "auv": "auv-1" }, "period_s": 1.0, "clock_rate": 10.0,
    } });
    let made = order(router, "/v1/missions", &live).await;
    let path = made.headers["location"].to_str().expect("is text").to_owned();
    let created = made.json()["created_s"].as_f64().expect("has a time");
    let now = created + 10.0 * (clock.unix_s() - created);
    let heard = json!({ "received_s": now, "auvs": { "auv-1": [
        { "t_s": now - 2.0, "north_m": 10.0, "east_m": 20.0, "sigma_m": 1.0 } ] },
        "asc": [{ "t_s": now, "state": { "north_m": 0.0, "east_m": 0.0, "heading_rad": 0.0, "speed_mps": 0.2,
            "sway_mps": 0.0, "yaw_rate_radps": 0.0 } }] });
    order(router, &format!("{path}/reports"), &heard).await;
    order(router, &format!("{path}/run"), &json!({})).await;
    path
}

/// A period of the mission of [`running`], on the service's clock.
const PERIOD: Duration = Duration::from_millis(100);

/// The metrics that the dashboard's queries name.
fn asked_for() -> BTreeSet<String> {
    let dashboard: Value = serde_json::from_str(DASHBOARD).expect("is JSON");
    let panels = dashboard["panels"].as_array().expect("has panels");
    let targets = panels.iter().filter_map(|panel| panel["targets"].as_array());
    let queries = targets
        .flatten()
        .map(|target| target["expr"].as_str().expect("is a query"));
    let variables = dashboard["templating"]["list"].as_array().expect("has variables");
    let of_variables = variables
        .iter()
        .filter_map(|variable| variable["definition"].as_str());
    let is_metric = |word: &&str| word.starts_with("pilotfish_") || word.starts_with("process_");
    let words = queries
        .chain(of_variables)
        .flat_map(|query| query.split(|letter: char| !letter.is_ascii_alphanumeric() && letter != '_'));
    words.filter(is_metric).map(str::to_owned).collect()
}

#[tokio::test(start_paused = true)]
async fn the_dashboard_queries_existing_metrics() {
    let service = with_missions(simulated_machine()).await;
    order(&service.router, "/v1/plan", &example()).await;
    running(&service).await;
    service.clock.sleep(PERIOD).await;
    let samples = Samples::of(&service.router).await;
    assert!(0.0 < samples.sum("pilotfish_mission_plan_late_seconds_count", &[]));
    let (told, asked) = (samples.names(), asked_for());
    assert!(20 < asked.len(), "{asked:?}");
    let missing: Vec<_> = asked
        .iter()
        .filter(|name| !told.contains(name.as_str()))
        .collect();
    assert!(missing.is_empty(), "{missing:?} are not among {told:#?}");
    assert!(1e6 < samples.sum("process_resident_memory_bytes", &[]));
}

fn example() -> Value {
    serde_json::from_str(EXAMPLES[0].body).expect("is JSON")
}

#[tokio::test(start_paused = true)]
async fn plans_and_calls_are_counted_under_fixed_labels() {
    let service = service::app(simulated_machine());
    order(&service, "/v1/plan", &example()).await;
    let mut hurried = example();
    hurried["deadline_ms"] = json!(0.05);
    order(&service, "/v1/plan", &hurried).await;
    order(
        &service,
        "/v1/plan/batch",
        &json!({ "requests": [example(), example()] }),
    )
    .await;
    for path in ["/v1/examples/of-a-client", "/of-a-client"] {
        send_to(service.clone(), get(path)).await;
    }
    let mut invented = get("/version");
    *invented.method_mut() = Method::from_bytes(b"INVENTED").expect("is a token");
    send_to(service.clone(), invented).await;

    let samples = Samples::of(&service).await;
    let plans = |labels: &[&str]| samples.sum("pilotfish_plans_total", labels);
    assert_eq!(plans(&["purpose=\"request\"", "outcome=\"ok\""]), 3.0);
    assert_eq!(plans(&["outcome=\"degraded\""]), 1.0);
    assert_eq!(plans(&["method=\"mpc\""]), 3.0);
    assert_eq!(samples.sum("pilotfish_solve_duration_seconds_count", &[]), 4.0);
    assert!(10.0 < samples.sum("pilotfish_solver_iterations_sum", &[]));
    assert!(3.0 <= samples.sum("pilotfish_scp_iterations_sum", &[]));
    let calls = |labels: &[&str]| samples.sum("pilotfish_http_request_duration_seconds_count", labels);
    assert_eq!(
        calls(&["method=\"POST\"", "route=\"/v1/plan\"", "status=\"2xx\""]),
        2.0
    );
    assert_eq!(calls(&["route=\"/v1/examples/{name}\"", "status=\"4xx\""]), 1.0);
    assert_eq!(calls(&["route=\"unmatched\"", "status=\"4xx\""]), 1.0);
    assert_eq!(calls(&["method=\"other\"", "route=\"/version\""]), 1.0);
    for sample in samples.0.keys() {
        assert!(
            !sample.contains("of-a-client") && !sample.contains("INVENTED"),
            "{sample}"
        );
    }
}

#[tokio::test(start_paused = true)]
async fn refused_requests_are_counted_by_reason() {
    let settings = Settings {
        planners: 1,
        waiting: 0,
        ..simulated_machine()
    };
    let clock = settings.clock.clone();
    clock.delay_threads(Duration::from_millis(300));
    let service = service::app(settings);
    let call = || send_to(service.clone(), post("/v1/plan", example().to_string()));
    let admitted = async {
        clock.sleep(Duration::from_millis(1)).await;
        let samples = Samples::of(&service).await;
        let admitted = samples.sum("pilotfish_requests_admitted", &["body=\"short\""]);
        assert_eq!(admitted, 1.0);
        call().await
    };
    let (first, second) = tokio::join!(call(), admitted);
    assert_eq!(
        (first.status, second.status),
        (StatusCode::OK, StatusCode::SERVICE_UNAVAILABLE)
    );
    let samples = Samples::of(&service).await;
    assert_eq!(samples.sum("pilotfish_requests_admitted", &[]), 0.0);
    let shed = |labels: &[&str]| samples.sum("pilotfish_requests_shed_total", labels);
    assert_eq!((shed(&["reason=\"admission\""]), shed(&[])), (1.0, 1.0));
}

/// `true` while the craft of the test below follows.
static FOLLOWS: AtomicBool = AtomicBool::new(true);

#[tokio::test(start_paused = true)]
async fn missions_are_counted_by_status_and_by_craft_that_do_not_follow() {
    fn alarming(
        snapshot: &Snapshot,
        parameters: &Parameters,
        workspace: &mut Workspace,
        stop: &Stop,
    ) -> Plan {
        let mut plan = plan_until(snapshot, parameters, workspace, stop);
        plan.craft.monitor.alarm = !FOLLOWS.load(Ordering::Relaxed);
        plan
    }
    let service = with_missions(Settings {
        plan: alarming,
        ..simulated_machine()
    })
    .await;
    let router = &service.router;
    let after_a_period = async || {
        service.clock.sleep(PERIOD).await;
        Samples::of(router).await
    };
    let log = Log::default();
    let _logs = log.listen();
    let mission = running(&service).await;
    let id = mission.rsplit('/').next().expect("has a name");
    let warns = |samples: &Samples| samples.sum("pilotfish_missions_craft_does_not_follow", &[]);
    let samples = after_a_period().await;
    assert!(0.0 < samples.sum("pilotfish_plans_total", &["purpose=\"live\""]));
    let missions =
        |samples: &Samples, status: &str| samples.sum("pilotfish_missions", &["kind=\"live\"", status]);
    assert_eq!(
        (missions(&samples, "status=\"running\""), warns(&samples)),
        (1.0, 0.0)
    );
    // Creation, report, run and plan.
    assert!(4.0 <= samples.sum("pilotfish_store_events_total", &[]));
    assert!(4.0 <= samples.sum("pilotfish_store_commit_duration_seconds_count", &[]));

    FOLLOWS.store(false, Ordering::Relaxed);
    assert_eq!(warns(&after_a_period().await), 1.0);
    FOLLOWS.store(true, Ordering::Relaxed);
    let samples = after_a_period().await;
    assert_eq!(warns(&samples), 0.0);
    assert_eq!(samples.sum("pilotfish_craft_does_not_follow_total", &[]), 1.0);
    order(router, &format!("{mission}/pause"), &json!({})).await;
    let samples = Samples::of(router).await;
    assert_eq!(missions(&samples, "status=\"paused\""), 1.0);
    assert_eq!(missions(&samples, ""), 1.0);
    order(router, &format!("{mission}/finish"), &json!({})).await;
    assert_eq!(missions(&Samples::of(router).await, ""), 0.0);

    for told in ["the craft does not follow", "the craft follows again"] {
        assert_eq!(log.lines(&[told, id]).len(), 1, "{told}");
    }
}

/// The captured log.
#[derive(Clone, Default)]
struct Log(Arc<Mutex<Vec<u8>>>);

impl Write for Log {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.lock().expect("is whole").write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl<'a> MakeWriter<'a> for Log {
    type Writer = Self;

    fn make_writer(&'a self) -> Self {
        self.clone()
    }
}

impl Log {
    /// Captures at the program's level, on the test's thread, which is that of calls and missions.
    fn listen(&self) -> impl Drop + use<> {
        let subscriber = tracing_subscriber::fmt()
            .with_max_level(LevelFilter::INFO)
            .with_ansi(false)
            .with_writer(self.clone());
        tracing_subscriber::util::SubscriberInitExt::set_default(subscriber)
    }

    /// The lines with all of these parts.
    fn lines(&self, parts: &[&str]) -> Vec<String> {
        let text = String::from_utf8(self.0.lock().expect("is whole").clone()).expect("is text");
        let holds = |line: &&str| parts.iter().all(|part| line.contains(part));
        text.lines().filter(holds).map(str::to_owned).collect()
    }
}

fn called(request: Request<Body>, id: &'static str) -> Request<Body> {
    let mut request = request;
    let id = HeaderValue::from_static(id);
    request.headers_mut().insert("x-request-id", id);
    request
}

#[tokio::test(start_paused = true)]
async fn calls_and_changes_are_logged_with_their_call_and_probes_are_not() {
    let service = with_missions(simulated_machine()).await;
    let router = &service.router;
    let log = Log::default();
    let _logs = log.listen();
    let mission = running(&service).await;
    let id = mission.rsplit('/').next().expect("has a name");
    let paused = called(post(&format!("{mission}/pause"), "{}"), "the-pause");
    send_to(router.clone(), paused).await;
    for probe in ["/livez", "/readyz", "/metrics"] {
        send_to(router.clone(), called(get(probe), "the-probe")).await;
    }
    let deleted = Request::delete(&mission)
        .body(Body::empty())
        .expect("is a request");
    send_to(router.clone(), called(deleted, "the-end")).await;

    for (request, change) in [("the-pause", "paused"), ("the-end", "deleted")] {
        let lines = log.lines(&[request, "a mission changed", id]);
        assert!(lines.len() == 1 && lines[0].contains(change), "{lines:?}");
        let lines = log.lines(&[
            request,
            "answered",
            "route=\"/v1/missions/{id}",
            "ms=",
            id,
            "trace_id=",
        ]);
        assert!(lines.len() == 1 && lines[0].contains("INFO"), "{lines:?}");
    }
    assert_eq!(log.lines(&["a mission changed", "created", id]).len(), 1);
    assert_eq!(log.lines(&["the-probe"]), [""; 0]);
}

#[tokio::test(start_paused = true)]
async fn a_trace_continues_in_log_and_answer() {
    const TRACE: &str = "0af7651916cd43dd8448eb211c80319c";
    let service = service::app(simulated_machine());
    let log = Log::default();
    let _logs = log.listen();
    let mut answered = vec![];
    for given in ["b7ad6b7169203331-01", "b7ad6b7169203331-zz"] {
        let mut request = get("/version");
        let parent = format!("00-{TRACE}-{given}").parse().expect("is text");
        request.headers_mut().insert("traceparent", parent);
        let answer = send_to(service.clone(), request).await;
        answered.push(
            answer.headers["traceresponse"]
                .to_str()
                .expect("is text")
                .to_owned(),
        );
    }
    assert_eq!(answered[0].split('-').nth(1), Some(TRACE));
    assert_ne!(answered[0].split('-').nth(2), Some("b7ad6b7169203331"));
    // An invalid context counts as absent.
    let own = answered[1].split('-').nth(1).expect("is a context");
    assert!(own.len() == 32 && own != TRACE, "{own}");
    for trace in [TRACE, own] {
        assert_eq!(log.lines(&["answered", &format!("trace_id={trace}")]).len(), 1);
    }
}
