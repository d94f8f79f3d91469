//! What the service counts, for Prometheus: `GET /metrics`.
//!
//! Every label has few values, none of which a client can choose: no paths, no names of missions or clients.

use std::{fmt, fs, sync::Arc, time::Duration};

use axum::{
    extract::State,
    http::{Method, StatusCode, header},
    response::IntoResponse,
};
use planner::plan::{self, Plan};
use prometheus_client::{
    collector::Collector,
    encoding::{DescriptorEncoder, EncodeMetric, text::encode},
    metrics::{
        counter::{ConstCounter, Counter},
        family::Family,
        gauge::{ConstGauge, Gauge},
        histogram::Histogram,
        info::Info,
    },
    registry::Registry,
};
use rustix::time::{ClockId, clock_gettime};

/// Times from that of a small plan to that after which clients have gone away, s.
const SECONDS: [f64; 14] = [
    5e-4, 1e-3, 2.5e-3, 5e-3, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1.0, 2.5, 5.0, 10.0,
];

/// Interior-point iterations of a plan: some ten for each subproblem.
const SOLVER_ITERATIONS: [f64; 9] = [10.0, 20.0, 40.0, 60.0, 80.0, 100.0, 150.0, 200.0, 400.0];

/// Subproblems of a plan: a few for each initial guess.
const SCP_ITERATIONS: [f64; 8] = [1.0, 2.0, 3.0, 4.0, 6.0, 8.0, 12.0, 16.0];

type Labels<T, const N: usize> = [(&'static str, T); N];

/// What a service counts. Clones share it.
#[derive(Clone, Debug)]
pub(crate) struct Metrics {
    counts: Arc<Counts>,
    /// Has them by their names.
    registry: Arc<Registry>,
}

#[derive(Debug)]
struct Counts {
    requests: Family<Labels<String, 3>, Histogram>,
    shed: Family<Labels<&'static str, 1>, Counter>,
    admitted: Family<Labels<&'static str, 1>, Gauge>,
    waiting: Family<Labels<&'static str, 2>, Gauge>,
    plans: Family<Labels<&'static str, 3>, Counter>,
    solve_time: Family<Labels<&'static str, 1>, Histogram>,
    solver_iterations: Histogram,
    scp_iterations: Histogram,
    missions: Family<Labels<&'static str, 2>, Gauge>,
    late: Histogram,
    missed: Counter,
    does_not_follow: Gauge,
    does_not_follow_begun: Counter,
}

/// Counted as one, until it is dropped.
#[derive(Debug)]
pub struct Counted(Gauge);

impl Counted {
    fn new(gauge: Gauge) -> Self {
        gauge.inc();
        Self(gauge)
    }
}

impl Drop for Counted {
    fn drop(&mut self) {
        self.0.dec();
    }
}

/// Why something was not taken on.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Shed {
    /// Those before it leave it no time, or too many wait.
    Admission,
    /// It waited too long for a thread.
    Pool,
    /// There was no room for its body.
    Room,
    /// Its mission has too many requests before it.
    Mailbox,
    /// There are as many missions, streams or records as there may be.
    Places,
}

impl Shed {
    const ALL: [Self; 5] = [
        Self::Admission,
        Self::Pool,
        Self::Room,
        Self::Mailbox,
        Self::Places,
    ];

    fn name(self) -> &'static str {
        match self {
            Self::Admission => "admission",
            Self::Pool => "pool",
            Self::Room => "room",
            Self::Mailbox => "mailbox",
            Self::Places => "places",
        }
    }
}

/// What a plan is for.
#[derive(Clone, Copy, Debug)]
pub(crate) enum PlanFor {
    /// A request of a client that keeps its own mission.
    Request,
    /// A live mission.
    Live,
    /// A simulated mission.
    Simulated,
}

impl PlanFor {
    fn name(self) -> &'static str {
        match self {
            Self::Request => "request",
            Self::Live => "live",
            Self::Simulated => "simulated",
        }
    }
}

/// The connections of a server, which counts them. Clones share the count.
#[derive(Clone, Debug, Default)]
pub struct Connections {
    open: Gauge,
    turned_away: Counter,
}

impl Connections {
    /// One more, for as long as the answer lives.
    #[must_use]
    pub fn opened(&self) -> Counted {
        Counted::new(self.open.clone())
    }

    /// One was not taken on.
    pub fn turned_away(&self) {
        self.turned_away.inc();
    }

    fn register(&self, registry: &mut Registry) {
        registry.register("connections", "Connections that are open", self.open.clone());
        let turned_away = self.turned_away.clone();
        registry.register("connections_turned_away", "Connections not taken on", turned_away);
    }
}

/// What the mission log counts. Clones share it.
#[derive(Clone, Debug)]
pub(crate) struct StoreMetrics {
    commits: Histogram,
    failures: Counter,
    events: Counter,
}

impl Default for StoreMetrics {
    fn default() -> Self {
        Self {
            commits: Histogram::new(SECONDS),
            failures: Counter::default(),
            events: Counter::default(),
        }
    }
}

impl StoreMetrics {
    /// A commit took so long and stored so many events, or failed.
    pub(crate) fn committed(&self, took: Duration, n_events: Option<usize>) {
        self.commits.observe(took.as_secs_f64());
        let _before = match n_events {
            Some(n) => self.events.inc_by(n as u64),
            None => self.failures.inc(),
        };
    }

    fn register(&self, registry: &mut Registry) {
        let help = "Time of a commit of the mission log";
        registry.register("store_commit_duration_seconds", help, self.commits.clone());
        registry.register(
            "store_commit_failures",
            "Commits that failed",
            self.failures.clone(),
        );
        registry.register("store_events", "Events stored", self.events.clone());
    }
}

impl Default for Counts {
    fn default() -> Self {
        Self {
            requests: Family::new_with_constructor(|| Histogram::new(SECONDS)),
            shed: Family::default(),
            admitted: Family::default(),
            waiting: Family::default(),
            plans: Family::default(),
            solve_time: Family::new_with_constructor(|| Histogram::new(SECONDS)),
            solver_iterations: Histogram::new(SOLVER_ITERATIONS),
            scp_iterations: Histogram::new(SCP_ITERATIONS),
            missions: Family::default(),
            late: Histogram::new(SECONDS),
            missed: Counter::default(),
            does_not_follow: Gauge::default(),
            does_not_follow_begun: Counter::default(),
        }
    }
}

impl Counts {
    fn register(&self, registry: &mut Registry) {
        let help = "Requests, and the time from their heads to those of their answers";
        registry.register("http_request_duration_seconds", help, self.requests.clone());
        let help = "Requests not taken on, by reason";
        registry.register("requests_shed", help, self.shed.clone());
        let help = "Requests for plans that were taken on and are not done, by the length of their bodies";
        registry.register("requests_admitted", help, self.admitted.clone());
        let help = "Jobs that wait for a thread of a pool, by who asks";
        registry.register("jobs_waiting", help, self.waiting.clone());
        let help = "Plans answered, by what they are for, what answered and the outcome";
        registry.register("plans", help, self.plans.clone());
        let help = "Time of the planner for a plan";
        registry.register("solve_duration_seconds", help, self.solve_time.clone());
        let help = "Interior-point iterations of a plan";
        registry.register("solver_iterations", help, self.solver_iterations.clone());
        let help = "Convex subproblems of a plan";
        registry.register("scp_iterations", help, self.scp_iterations.clone());
        let help = "Missions in memory that are not over: all that run, and others that were asked for";
        registry.register("missions", help, self.missions.clone());
        let help = "Time from when a plan of a live mission was due to when it was made";
        registry.register("mission_plan_late_seconds", help, self.late.clone());
        let help = "Plans of live missions that were due and not made";
        registry.register("mission_plans_missed", help, self.missed.clone());
        let help = "Running live missions whose newest plan warns that the craft does not follow";
        registry.register(
            "missions_craft_does_not_follow",
            help,
            self.does_not_follow.clone(),
        );
        let help = "How often a craft of a live mission began not to follow";
        registry.register("craft_does_not_follow", help, self.does_not_follow_begun.clone());
    }
}

impl Metrics {
    pub(crate) fn new(connections: &Connections, store: &StoreMetrics) -> Self {
        let counts = Counts::default();
        // A counter that appears with its first increment has no rate for it.
        for reason in Shed::ALL {
            counts.shed.get_or_create_owned(&[("reason", reason.name())]);
        }
        let mut registry = Registry::default();
        registry.register_collector(Box::new(Process));
        let ours = registry.sub_registry_with_prefix("pilotfish");
        let build = Info::new([("version", env!("CARGO_PKG_VERSION"))]);
        ours.register("build", "What runs", build);
        counts.register(ours);
        connections.register(ours);
        store.register(ours);
        Self {
            counts: Arc::new(counts),
            registry: Arc::new(registry),
        }
    }

    /// A request was answered.
    pub(crate) fn request(&self, method: &Method, route: &str, status: StatusCode, took: Duration) {
        let labels = [
            ("method", known(method).to_owned()),
            ("route", route.to_owned()),
            ("status", format!("{}xx", status.as_u16() / 100)),
        ];
        self.counts
            .requests
            .get_or_create(&labels)
            .observe(took.as_secs_f64());
    }

    /// Something was not taken on.
    pub(crate) fn shed(&self, reason: Shed) {
        self.counts.shed.get_or_create(&[("reason", reason.name())]).inc();
    }

    /// The number of requests that were taken on, by `body`: `short` or `long`.
    pub(crate) fn admitted(&self, body: &'static str) -> Gauge {
        self.counts.admitted.get_or_create_owned(&[("body", body)])
    }

    /// The number of jobs that wait in `pool`, by `lane`.
    pub(crate) fn waiting(&self, pool: &'static str, lane: &'static str) -> Gauge {
        let labels = [("pool", pool), ("lane", lane)];
        self.counts.waiting.get_or_create_owned(&labels)
    }

    /// A job of a mission waits for its turn, until the answer is dropped.
    pub(crate) fn mission_waits(&self) -> Counted {
        Counted::new(self.waiting("missions", "mission"))
    }

    /// A plan is about to be answered.
    pub(crate) fn plan(&self, made_for: PlanFor, plan: &Plan, solve_time: Duration) {
        let labels = [
            ("purpose", made_for.name()),
            ("method", method(plan.method)),
            ("outcome", if plan.degraded.is_some() { "degraded" } else { "ok" }),
        ];
        let Counts {
            plans,
            solve_time: times,
            solver_iterations,
            scp_iterations,
            ..
        } = &*self.counts;
        plans.get_or_create(&labels).inc();
        times
            .get_or_create(&[("purpose", made_for.name())])
            .observe(solve_time.as_secs_f64());
        solver_iterations.observe(f64::from(plan.solver.iterations));
        #[expect(clippy::cast_precision_loss, reason = "a few")]
        scp_iterations.observe(plan.solver.scp_iterations as f64);
    }

    /// A mission of `kind` is in memory with `status`, until the answer is dropped.
    pub(crate) fn mission(&self, kind: &str, status: &'static str) -> Counted {
        let kind = if kind == "live" { "live" } else { "simulated" };
        let labels = [("kind", kind), ("status", status)];
        Counted::new(self.counts.missions.get_or_create_owned(&labels))
    }

    /// A plan of a live mission was stored, so long after it was due.
    pub(crate) fn late(&self, late: Duration) {
        self.counts.late.observe(late.as_secs_f64());
    }

    /// So many plans of a live mission were not made.
    pub(crate) fn missed(&self, n: u64) {
        self.counts.missed.inc_by(n);
    }

    /// A craft does not follow, until the answer is dropped.
    pub(crate) fn does_not_follow(&self) -> Counted {
        self.counts.does_not_follow_begun.inc();
        Counted::new(self.counts.does_not_follow.clone())
    }

    /// Everything, as Prometheus reads it.
    fn exposition(&self) -> Result<String, fmt::Error> {
        let mut text = String::new();
        encode(&mut text, &self.registry)?;
        Ok(text)
    }
}

/// The method, if it is one that means something here: clients may make up others.
fn known(method: &Method) -> &str {
    let known = [
        Method::GET,
        Method::HEAD,
        Method::POST,
        Method::PUT,
        Method::PATCH,
        Method::DELETE,
        Method::OPTIONS,
    ];
    if known.contains(method) {
        method.as_str()
    } else {
        "other"
    }
}

fn method(method: plan::Method) -> &'static str {
    match method {
        plan::Method::Mpc => "mpc",
        plan::Method::PreviousPlan => "previous_plan",
        plan::Method::SaturatedLos => "saturated_los",
        plan::Method::Hold => "hold",
        plan::Method::SaturatedLosTrackerFrame
        | plan::Method::IntegralLos
        | plan::Method::WaypointBox
        | plan::Method::PrintedLos => "law",
    }
}

/// What the process takes of the machine, where the system tells it: by the names that Prometheus clients agree on.
#[derive(Debug)]
struct Process;

impl Collector for Process {
    fn encode(&self, mut encoder: DescriptorEncoder) -> fmt::Result {
        let mut tell = |name, help, metric: &dyn EncodeMetric| {
            let encoder = encoder.encode_descriptor(name, help, None, metric.metric_type())?;
            metric.encode(encoder)
        };
        let cpu = clock_gettime(ClockId::ProcessCPUTime);
        let cpu = Duration::try_from(cpu).unwrap_or_default().as_secs_f64();
        tell(
            "process_cpu_seconds",
            "Processor time, user and system.",
            &ConstCounter::new(cpu),
        )?;
        if let Some(bytes) = resident_bytes() {
            let help = "Resident memory.";
            tell("process_resident_memory_bytes", help, &ConstGauge::new(bytes))?;
        }
        if let Ok(files) = fs::read_dir("/proc/self/fd") {
            let n = files.count();
            tell("process_open_fds", "Files that are open.", &ConstGauge::new(n))?;
        }
        Ok(())
    }
}

fn resident_bytes() -> Option<u64> {
    let status = fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"))?;
    let kib: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kib << 10)
}

/// What the service counts, for Prometheus.
#[utoipa::path(get, path = "/metrics", tag = "service", responses(
    (status = 200, description = "Metrics in the text format of OpenMetrics.", body = String,
        content_type = "application/openmetrics-text")))]
pub(crate) async fn get_metrics(State(metrics): State<Metrics>) -> impl IntoResponse {
    let text = metrics
        .exposition()
        .expect("a string takes all that is written to it");
    let content_type = "application/openmetrics-text; version=1.0.0; charset=utf-8";
    ([(header::CONTENT_TYPE, content_type)], text)
}
