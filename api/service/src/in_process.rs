//! Other services in the same process, which simulated voyages have.

use std::{fmt, pin::Pin, sync::Arc};

use axum::{extract::Request, response::Response};

/// The answer of another service, or whether the call may have reached it.
pub type Answering = Pin<Box<dyn Future<Output = Result<Response, MayHaveArrived>> + Send>>;

/// Whether a call without an answer may have been carried out.
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
