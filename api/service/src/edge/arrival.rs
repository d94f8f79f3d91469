//! The arrival of a request.

use std::time::Instant;

/// Time when the head of a request was read.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Arrival(pub(crate) Instant);
