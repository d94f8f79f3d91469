//! What a service is built with.

use std::{
    num::NonZeroUsize,
    sync::{Arc, atomic::AtomicBool},
    time::Duration,
};

use planner::{
    plan::{Plan, Workspace},
    policy::Policy,
    snapshot::Snapshot,
    stop::Stop,
};

use crate::{access::Tokens, hosts::Hosts, metrics::Connections, trace::TraceFn};

/// What makes a plan of a snapshot: [`planner::plan::plan_until`], or in tests something that fails on purpose.
pub type PlanFn = fn(&Snapshot, &Policy, &mut Workspace, &Stop) -> Plan;

/// What a service is built with.
#[derive(Clone, Debug)]
pub struct Settings {
    /// What makes the plans.
    pub plan: PlanFn,
    /// Plans made at once.
    pub planners: usize,
    /// Requests that may wait for a planner; more are turned away.
    pub waiting: usize,
    /// Longest time for a body to arrive.
    pub body_time_limit: Duration,
    /// Longest time for an answer, from the head of its request on. A request may ask for a shorter one.
    pub deadline: Duration,
    /// Names under which clients may call the service over a network; none where requests come from this program.
    pub hosts: Option<Hosts>,
    /// Tokens of which every request needs one once one is made; none where every client may do everything.
    pub tokens: Option<Tokens>,
    /// True once the service is to stop: it answers on, and says that it is not ready.
    pub stopping: Arc<AtomicBool>,
    /// The connections of the server before it.
    pub connections: Connections,
    /// What has requests traced.
    pub trace: TraceFn,
}

impl Default for Settings {
    /// One planner for each processor; a queue that empties in well under the deadline; time for a body long
    /// enough for a slow link, short enough to notice; a deadline of the interval at which references are renewed.
    fn default() -> Self {
        Self {
            plan: planner::plan::plan_until,
            planners: std::thread::available_parallelism().map_or(1, NonZeroUsize::get),
            waiting: 64,
            body_time_limit: Duration::from_secs(10),
            deadline: Duration::from_secs(1),
            hosts: None,
            tokens: None,
            stopping: Arc::default(),
            connections: Connections::default(),
            trace: |_, _, _| None,
        }
    }
}
