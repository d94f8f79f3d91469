//! Campaigns on many machines, over NATS JetStream.
//!
//! ```text
//! submit ── manifest ─▶ bucket of the campaign      worker: work ─▶ result in the bucket ─▶ reply
//!        └─ work ─────▶ work queue ─▶ workers       last gains of a case ─▶ work: its chunks
//! collect ◀── gains, rows ── bucket
//! ```
//! A piece of work is acknowledged after its result is stored: if a worker dies, the broker sends
//! its work to another. Stored work is not repeated. Every machine gives the same rows, except for
//! measured times, so that duplicates are harmless.
//!
//! [`broker`] is the connection and its names; [`mod@submit`], [`worker`] and [`mod@collect`] are
//! the three programs.

pub mod broker;
pub mod collect;
pub mod submit;
pub mod worker;

pub use broker::{Access, Broker, ClusterError, WorkerEvent};
pub use collect::{Progress, collect, progress};
pub use submit::{Submitted, submit};
pub use worker::Worker;
