//! Campaigns on many machines, over NATS JetStream.
//!
//! ```text
//! submit ── manifest ─▶ bucket of the campaign                  worker: a piece of work ─▶ does it ─▶ puts what it came to into the
//!        └─ work ─────▶ stream, a work queue ─▶ workers         bucket ─▶ acknowledges it;  the last gains of a case send its chunks
//! collect ◀── gains, rows ── bucket
//! ```
//! A piece of work is acknowledged after its result is stored, so a worker that dies loses nothing: the broker sends its work to
//! another. Stored work is not done again. Every piece of work gives the same rows on any machine, except for measured times, so
//! duplicates are harmless.
//!
//! In reading order: [`broker`] is the connection and the names in it, [`event`] is what a worker reports, and [`mod@submit`], [`worker`]
//! and [`mod@collect`] are the three programs.

pub mod broker;
pub mod collect;
pub mod event;
pub mod submit;
pub mod worker;

pub use broker::{Access, Broker, ClusterError};
pub use collect::{Progress, collect, progress};
pub use event::WorkerEvent;
pub use submit::{Submitted, submit};
pub use worker::Worker;
