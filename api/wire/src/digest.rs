//! Digests that name plans and answers.

use planner::snapshot::{PlanRequest, Snapshot};
use serde_json::Map;
use sha2::{Digest, Sha256};

/// SHA-256, hexadecimal, of the checked request with its defaults, without members that change no
/// plan. With an origin, positions count from the craft, and the origin is the craft's place.
pub fn plan_id(snapshot: &Snapshot) -> String {
    let request = PlanRequest { deadline_ms: None, metadata: Map::new(), ..PlanRequest::clone(snapshot) };
    sha256(&serde_json::to_vec(&request).expect("strings, numbers and lists only"))
}

/// SHA-256, hexadecimal.
pub fn sha256(bytes: &[u8]) -> String {
    format!("{:x}", Sha256::digest(bytes))
}
