//! Unix time.

use std::time::{SystemTime, UNIX_EPOCH};

/// Unix time now, s.
pub(crate) fn unix_now() -> f64 {
    SystemTime::now()
        .duration_since(UNIX_EPOCH)
        .map_or(0.0, |since| since.as_secs_f64())
}
