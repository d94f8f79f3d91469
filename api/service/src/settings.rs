//! The settings of a service.

use std::{
    num::NonZeroUsize,
    sync::{Arc, atomic::AtomicBool},
    time::Duration,
};

use clock::Clock;
use planner::{
    parameters::Parameters,
    plan::{Plan, Workspace},
    snapshot::Snapshot,
    stop::Stop,
};
use tokio_rustls::rustls::ClientConfig;

use crate::{access::Tokens, hosts::Hosts, in_process::InProcess, metrics::Connections, trace::TraceFn};

/// A function that plans: [`planner::plan::plan_until`], or in tests one that fails on purpose.
pub type PlanFn = fn(&Snapshot, &Parameters, &mut Workspace, &Stop) -> Plan;

/// The settings of a service.
#[derive(Clone, Debug)]
pub struct Settings {
    /// The time by which everything happens.
    pub clock: Clock,
    /// The function that plans.
    pub plan: PlanFn,
    /// Most plans at the same time.
    pub planners: usize,
    /// Most requests that wait for a planner; more are refused.
    pub waiting: usize,
    /// Longest time for a body to arrive.
    pub body_time_limit: Duration,
    /// Longest time for an answer, from the head of its request. A request may set a shorter deadline.
    pub deadline: Duration,
    /// Names under which clients may call the service over a network; none if the requests come from this program.
    pub hosts: Option<Hosts>,
    /// Tokens: every request needs one as soon as one is created. None: every client may do everything.
    pub tokens: Option<Tokens>,
    /// True once the service is about to stop: it still answers, and reports that it is not ready.
    pub stopping: Arc<AtomicBool>,
    /// Counts the server's connections.
    pub connections: Connections,
    /// Called at least once in that time, as long as the service works.
    pub heartbeat: Option<(Duration, fn())>,
    /// How many log lines were dropped because the log's reader was too slow.
    pub log_lines_dropped: fn() -> u64,
    /// Exports traces of requests.
    pub trace: TraceFn,
    /// How services that share missions call each other by HTTPS; none: by HTTP only.
    pub between: Option<ClientConfig>,
    /// Where the other services are, as scheme and authority: calls with tokens go there alone, and to those that [`Self::between`]
    /// certifies.
    pub peers: Vec<String>,
    /// Takes the place of calls to other services. For tests.
    #[doc(hidden)]
    pub others: Option<InProcess>,
}

impl Default for Settings {
    /// One planner for each processor; a queue that empties well before the deadline; a time for bodies that suits a slow
    /// link; a deadline equal to the interval at which references are renewed.
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
            others: None,
        }
    }
}
