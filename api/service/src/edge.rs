//! The edge: requests before their work, and answers after it. It knows no planner and no mission.
//!
//! ```text
//! middleware (request id, hosts, access) → body, query → handler → answer, problem → middleware
//! ```

pub mod access;
pub(crate) mod answer;
pub(crate) mod arrival;
pub(crate) mod body;
pub(crate) mod hosts;
pub(crate) mod in_process;
pub(crate) mod middleware;
pub(crate) mod page;
pub mod problem;
pub(crate) mod query;
pub mod quota;
pub(crate) mod request_id;
pub(crate) mod role;
pub mod slots;
pub(crate) mod trace;
