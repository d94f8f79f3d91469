//! Campaigns on many machines, over NATS JetStream.
//!
//! ```text
//! submit ── manifest ─▶ bucket of the campaign                  worker: a piece of work ─▶ does it ─▶ puts what it came to into the
//!        └─ work ─────▶ stream, a work queue ─▶ workers         bucket ─▶ acknowledges it;  the last gains of an arena send its chunks
//! collect ◀── gains, rows ── bucket
//! ```
//! A piece of work is acknowledged after what it came to is stored, so that a worker that dies loses nothing: the broker sends its
//! work to another. What was stored already is not done again. Every piece of work gives the same rows wherever it is done, but for
//! the columns that the clock measures, so that a duplicate does no harm.
//!
//! In reading order: [`broker`] is the connection and the names in it, [`mod@submit`], [`worker`] and [`mod@collect`] are the three programs.

pub mod broker;
pub mod collect;
pub mod submit;
pub mod worker;

pub use broker::{Access, Broker, ClusterError};
pub use collect::{Standing, collect, standing};
pub use submit::{Submitted, submit};
pub use worker::{Worker, WorkerEvent};
