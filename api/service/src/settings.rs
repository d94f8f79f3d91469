//! The settings of a service.

use std::num::NonZeroUsize;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

use axum::http::HeaderValue;
use clock::Clock;
use planner::{
    parameters::Parameters,
    plan::{Plan, Workspace},
    snapshot::Snapshot,
    stop::Stop,
};
use tokio_rustls::rustls::ClientConfig;

use crate::{
    edge::{access::Tokens, hosts::Hosts, in_process::InProcess, trace::TraceFn},
    metrics::Connections,
};

/// A function that plans: [`planner::plan::plan_until`], or in tests one that fails on purpose.
pub type PlanFn = fn(&Snapshot, &Parameters, &mut Workspace, &Stop) -> Plan;

/// The settings of a service.
#[derive(Clone, Debug)]
pub struct Settings {
    /// The clock of the service.
    pub clock: Clock,
    /// The function that plans.
    pub plan: PlanFn,
    /// Most plans at the same time.
    pub planners: usize,
    /// Most requests that wait for a planner; more are refused.
    pub waiting: usize,
    /// Longest time for a body to arrive.
    pub body_time_limit: Duration,
    /// Longest time from the head of a request to its answer. Requests may set shorter deadlines.
    pub deadline: Duration,
    /// Names by which clients on a network may call the service; `None` for calls of this program.
    pub hosts: Option<Hosts>,
    /// Tokens, which every request needs once one is created. `None`: clients may do everything.
    pub tokens: Option<Tokens>,
    /// `true` before the service stops: it still answers, and reports that it is not ready.
    pub stopping: Arc<AtomicBool>,
    /// Counts the server's connections.
    pub connections: Connections,
    /// Called at least once in that time, while the service works.
    pub heartbeat: Option<(Duration, fn())>,
    /// Number of log lines that were dropped because the log's reader was too slow.
    pub log_lines_dropped: fn() -> u64,
    /// Exports traces of requests.
    pub trace: TraceFn,
    /// Configuration of HTTPS calls between services that share missions; `None`: HTTP only.
    pub between: Option<ClientConfig>,
    /// Scheme and authority of the other services: calls with tokens go only there and to those
    /// that [`Self::between`] certifies.
    pub peers: Vec<String>,
    /// Origins whose pages may show the service's page in a frame.
    pub framed_by: Vec<HeaderValue>,
    /// Replaces calls to other services. For tests.
    #[doc(hidden)]
    pub others: Option<InProcess>,
}

impl Default for Settings {
    /// One planner for each processor; a queue that empties well before the deadline; a time for
    /// bodies on slow links; a deadline equal to the interval between references.
    fn default() -> Self {
        Self {
            clock: Clock::machine(),
            plan: planner::plan::plan_until,
            planners: std::thread::available_parallelism().map_or(1, NonZeroUsize::get),
            waiting: 64,
            body_time_limit: Duration::from_secs(10),
            deadline: Duration::from_secs(1),
            hosts: None,
            tokens: None,
            stopping: Arc::default(),
            connections: Connections::default(),
            heartbeat: None,
            log_lines_dropped: || 0,
            trace: |_, _, _| None,
            between: None,
            peers: vec![],
            framed_by: vec![],
            others: None,
        }
    }
}
