//! Campaigns on many machines, over NATS JetStream.
//!
//! ```text
//! submit ── manifest ─▶ bucket of the campaign      worker: work ─▶ result in the bucket ─▶ reply
//!        └─ work ─────▶ work queue ─▶ workers       last gains of a case ─▶ work: its chunks
//! collect ◀── gains, rows ── bucket
//! ```
//! Work is acknowledged after its result is stored: if a worker dies, another gets its work. Every
//! machine gives the same rows, but for measured times: duplicates are harmless.
//!
//! [`broker`] is the connection; [`mod@submit`], [`worker`] and [`mod@collect`] are the programs.

pub mod broker;
pub mod collect;
pub mod submit;
pub mod worker;

pub use broker::{Access, Broker, ClusterError, WorkerEvent};
pub use collect::{Progress, collect, progress};
pub use submit::{Submitted, submit};
pub use worker::Worker;
