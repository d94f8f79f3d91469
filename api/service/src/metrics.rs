//! The metrics of the service, for Prometheus: `GET /metrics`.
//!
//! Every label has few values, none chosen by clients: no paths, no names of missions or clients.

use std::{fmt, fs, sync::Arc, time::Duration};

use axum::extract::State;
use axum::http::{Method, StatusCode, header};
use axum::response::IntoResponse;
use planner::plan::{self, Plan};
use prometheus_client::collector::Collector;
use prometheus_client::encoding::text::encode;
use prometheus_client::encoding::{DescriptorEncoder, EncodeMetric};
use prometheus_client::metrics::counter::{ConstCounter, Counter};
use prometheus_client::metrics::family::Family;
use prometheus_client::metrics::gauge::{ConstGauge, Gauge};
use prometheus_client::metrics::histogram::Histogram;
use prometheus_client::metrics::info::Info;
use prometheus_client::registry::Registry;
use rustix::time::{ClockId, clock_gettime};
use store::StoreMetrics;

/// Times, s, from that of a small plan to that after which clients have given up.
const SECONDS: [f64; 14] = [5e-4, 1e-3, 2.5e-3, 5e-3, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1.0, 2.5, 5.0, 10.0];

/// Interior-point iterations of a plan: some ten for each subproblem.
const SOLVER_ITERATIONS: [f64; 9] = [10.0, 20.0, 40.0, 60.0, 80.0, 100.0, 150.0, 200.0, 400.0];

/// Subproblems of a plan: a few for each initial guess.
const SCP_ITERATIONS: [f64; 8] = [1.0, 2.0, 3.0, 4.0, 6.0, 8.0, 12.0, 16.0];

type Labels<T, const N: usize> = [(&'static str, T); N];

/// Defines a struct of metrics with `default` and `register`. A field's doc is its help.
macro_rules! metrics {
    ($(#[$meta:meta])* $visibility:vis struct $name:ident {
        $(#[doc = $help:literal] $field:ident: $kind:ty = $metric:literal, $new:expr;)*
    }) => {
        $(#[$meta])*
        #[derive(Clone, Debug)]
        $visibility struct $name {
            $(#[doc = $help] $field: $kind,)*
        }

        impl Default for $name {
            fn default() -> Self {
                Self { $($field: $new,)* }
            }
        }

        impl $name {
            fn register(&self, registry: &mut Registry) {
                $(registry.register($metric, $help.trim(), self.$field.clone());)*
            }
        }
    };
}

metrics! {
    /// The metrics of a service.
    struct Counts {
        /// Requests, and the time from their heads to those of their answers
        requests: Family<Labels<String, 3>, Histogram> = "http_request_duration_seconds",
            Family::new_with_constructor(|| Histogram::new(SECONDS));
        /// Requests refused because the service is busy, by reason
        shed: Family<Labels<&'static str, 1>, Counter> = "requests_shed", Family::default();
        /// Requests for plans that were admitted and are not done, by the length of their bodies
        admitted: Family<Labels<&'static str, 1>, Gauge> = "requests_admitted", Family::default();
        /// Jobs that wait for a thread of a pool, by priority
        waiting: Family<Labels<&'static str, 2>, Gauge> = "jobs_waiting", Family::default();
        /// Plans answered, by purpose, method and outcome
        plans: Family<Labels<&'static str, 3>, Counter> = "plans", Family::default();
        /// Time of the planner for a plan
        solve_time: Family<Labels<&'static str, 1>, Histogram> = "solve_duration_seconds",
            Family::new_with_constructor(|| Histogram::new(SECONDS));
        /// Interior-point iterations of a plan
        solver_iterations: Histogram = "solver_iterations", Histogram::new(SOLVER_ITERATIONS);
        /// Convex subproblems of a plan
        scp_iterations: Histogram = "scp_iterations", Histogram::new(SCP_ITERATIONS);
        /// Unfinished missions in memory: all that run, and others that were requested
        missions: Family<Labels<&'static str, 2>, Gauge> = "missions", Family::default();
        /// Time from when a plan of a live mission was due to when it was made
        late: Histogram = "mission_plan_late_seconds", Histogram::new(SECONDS);
        /// Plans of live missions that were due and not made
        missed: Counter = "mission_plans_missed", Counter::default();
        /// Running live missions whose newest plan warns that the craft does not follow
        does_not_follow: Gauge = "missions_craft_does_not_follow", Gauge::default();
        /// Times that a craft of a live mission began not to follow
        does_not_follow_begun: Counter = "craft_does_not_follow", Counter::default();
    }
}

metrics! {
    /// The connections of a server, which counts them. Clones share the count.
    pub struct Connections {
        /// Connections that are open
        open: Gauge = "connections", Gauge::default();
        /// Connections refused
        turned_away: Counter = "connections_turned_away", Counter::default();
    }
}

/// The metrics of a service. Clones share them.
#[derive(Clone, Debug)]
pub(crate) struct Metrics {
    counts: Arc<Counts>,
    registry: Arc<Registry>,
}

/// Counts one until it is dropped.
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

#[derive(Clone, Copy, Debug)]
pub(crate) enum Shed {
    /// Too many wait, or the work before it leaves no time for it.
    Admission,
    /// It waited too long for a thread.
    Pool,
    /// There was no memory for its body or its answer.
    Memory,
    /// Its mission has too many requests before it.
    Mailbox,
    /// A limit of missions, streams or records is reached.
    Limit,
}

impl Shed {
    /// Their labels, in this order.
    const NAMES: [&str; 5] = ["admission", "pool", "room", "mailbox", "places"];
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum PlanFor {
    /// A request to `/v1/plan`.
    Request,
    Live,
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

impl Connections {
    /// Counts one more until the result is dropped.
    pub fn opened(&self) -> Counted {
        Counted::new(self.open.clone())
    }

    /// Counts a refused connection.
    pub fn turned_away(&self) {
        self.turned_away.inc();
    }
}

impl Metrics {
    pub(crate) fn new(
        connections: &Connections,
        store: &StoreMetrics,
        log_lines_dropped: fn() -> u64,
    ) -> Self {
        let counts = Counts::default();
        // A counter that appears with its first increment has no rate for it.
        for reason in Shed::NAMES {
            counts.shed.get_or_create_owned(&[("reason", reason)]);
        }
        let mut registry = Registry::default();
        registry.register_collector(Box::new(Process { log_lines_dropped }));
        let ours = registry.sub_registry_with_prefix("pilotfish");
        let build = Info::new([("version", env!("CARGO_PKG_VERSION"))]);
        ours.register("build", "What runs", build);
        counts.register(ours);
        connections.register(ours);
        store.register(ours);
        Self { counts: Arc::new(counts), registry: Arc::new(registry) }
    }

    pub(crate) fn request(&self, method: &Method, route: &str, status: StatusCode, took: Duration) {
        let labels = [
            ("method", known(method).to_owned()),
            ("route", route.to_owned()),
            ("status", format!("{}xx", status.as_u16() / 100)),
        ];
        let times = self.counts.requests.get_or_create(&labels);
        times.observe(took.as_secs_f64());
    }

    pub(crate) fn shed(&self, reason: Shed) {
        let reason = Shed::NAMES[reason as usize];
        self.counts.shed.get_or_create(&[("reason", reason)]).inc();
    }

    /// The number of admitted requests, by `body`: `short` or `long`.
    pub(crate) fn admitted(&self, body: &'static str) -> Gauge {
        self.counts.admitted.get_or_create_owned(&[("body", body)])
    }

    /// The number of jobs that wait in `pool` with a priority.
    pub(crate) fn waiting(&self, pool: &'static str, priority: &'static str) -> Gauge {
        let labels = [("pool", pool), ("lane", priority)];
        self.counts.waiting.get_or_create_owned(&labels)
    }

    /// Counts a mission that waits for a planner, until the result is dropped.
    pub(crate) fn mission_waits(&self) -> Counted {
        Counted::new(self.waiting("missions", "mission"))
    }

    pub(crate) fn plan(&self, made_for: PlanFor, plan: &Plan, solve_time: Duration) {
        let labels = [
            ("purpose", made_for.name()),
            ("method", method(plan.method)),
            ("outcome", if plan.degraded.is_some() { "degraded" } else { "ok" }),
        ];
        let counts = &self.counts;
        counts.plans.get_or_create(&labels).inc();
        let times = counts.solve_time.get_or_create(&[("purpose", made_for.name())]);
        times.observe(solve_time.as_secs_f64());
        let iterations = f64::from(plan.solver.iterations);
        counts.solver_iterations.observe(iterations);
        counts.scp_iterations.observe(plan.solver.scp_iterations as f64);
    }

    /// Counts a mission in memory, until the result is dropped.
    pub(crate) fn mission(&self, kind: &str, status: &'static str) -> Counted {
        let kind = if kind == "live" { "live" } else { "simulated" };
        let labels = [("kind", kind), ("status", status)];
        Counted::new(self.counts.missions.get_or_create_owned(&labels))
    }

    /// Records the delay with which a plan of a live mission was stored.
    pub(crate) fn late(&self, late: Duration) {
        self.counts.late.observe(late.as_secs_f64());
    }

    pub(crate) fn missed(&self, n: u64) {
        self.counts.missed.inc_by(n);
    }

    /// Counts a craft that does not follow, until the result is dropped.
    pub(crate) fn does_not_follow(&self) -> Counted {
        self.counts.does_not_follow_begun.inc();
        Counted::new(self.counts.does_not_follow.clone())
    }
}

/// The name of a standard method, or another label for invented ones.
fn known(method: &Method) -> &str {
    match method.as_str() {
        known @ ("GET" | "HEAD" | "POST" | "PUT" | "PATCH" | "DELETE" | "OPTIONS") => known,
        _ => "other",
    }
}

fn method(method: plan::Method) -> &'static str {
    use plan::Method;
    match method {
        Method::Mpc => "mpc",
        Method::PreviousPlan => "previous_plan",
        Method::SaturatedLos => "saturated_los",
        Method::Hold => "hold",
        Method::SaturatedLosTrackerFrame | Method::IntegralLos | Method::WaypointBox => "law",
    }
}

/// The process's use of the machine, by the standard names of Prometheus clients.
#[derive(Debug)]
struct Process {
    log_lines_dropped: fn() -> u64,
}

impl Collector for Process {
    fn encode(&self, mut encoder: DescriptorEncoder) -> fmt::Result {
        let mut write = |name, help, metric: &dyn EncodeMetric| {
            let encoder = encoder.encode_descriptor(name, help, None, metric.metric_type())?;
            metric.encode(encoder)
        };
        #[expect(clippy::disallowed_methods, reason = "processor time, which decides nothing")]
        let cpu = clock_gettime(ClockId::ProcessCPUTime);
        let cpu = Duration::try_from(cpu).unwrap_or_default().as_secs_f64();
        let help = "Processor time, user and system.";
        write("process_cpu_seconds", help, &ConstCounter::new(cpu))?;
        let help = "Log lines dropped because standard error was not read.";
        let dropped = ConstCounter::new((self.log_lines_dropped)());
        write("pilotfish_log_lines_dropped", help, &dropped)?;
        if let Some(bytes) = resident_bytes() {
            let help = "Resident memory.";
            write("process_resident_memory_bytes", help, &ConstGauge::new(bytes))?;
        }
        if let Ok(files) = fs::read_dir("/proc/self/fd") {
            let n = files.count();
            write("process_open_fds", "Files that are open.", &ConstGauge::new(n))?;
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

/// Returns the metrics of the service, for Prometheus.
#[utoipa::path(get, path = "/metrics", tag = "service", responses(
    (status = 200, description = "Metrics in the text format of OpenMetrics.", body = String,
        content_type = "application/openmetrics-text")))]
pub(crate) async fn get_metrics(State(metrics): State<Metrics>) -> impl IntoResponse {
    let mut text = String::new();
    encode(&mut text, &metrics.registry).expect("a string takes all that is written to it");
    let content_type = "application/openmetrics-text; version=1.0.0; charset=utf-8";
    ([(header::CONTENT_TYPE, content_type)], text)
}
