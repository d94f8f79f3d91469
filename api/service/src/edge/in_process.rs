//! Other services in the same process, for simulated voyages.

use std::{fmt, pin::Pin, sync::Arc};

use axum::{extract::Request, response::Response};

/// The answer of another service; without one, the error says if the call may have arrived.
pub type Answering = Pin<Box<dyn Future<Output = Result<Response, MayHaveArrived>> + Send>>;

/// `true` if a call without an answer may have been executed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MayHaveArrived(pub bool);

/// The other services in the same process, for tests.
#[derive(Clone)]
pub struct InProcess(pub Arc<dyn Fn(Request) -> Answering + Send + Sync>);

impl fmt::Debug for InProcess {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("in process")
    }
}
