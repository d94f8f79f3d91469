//! The id of a request, in its answer and in every line of the log about it.

use std::hash::{BuildHasher as _, RandomState};
use std::sync::LazyLock;
use std::sync::atomic::{AtomicU64, Ordering};

use axum::http::{HeaderMap, HeaderName};

pub(crate) static HEADER: HeaderName = HeaderName::from_static("x-request-id");

/// Longest accepted id of a client, bytes.
pub(crate) const LENGTH_MAX: usize = 64;

#[derive(Clone, Debug)]
pub(crate) struct RequestId(pub(crate) String);

impl RequestId {
    /// The client's own id if it is short and plain, otherwise a new one.
    pub(crate) fn of(headers: &HeaderMap) -> Self {
        let is_plain = |byte: u8| byte.is_ascii_alphanumeric() || b"-_.:".contains(&byte);
        let plain = |id: &&str| (1..=LENGTH_MAX).contains(&id.len()) && id.bytes().all(is_plain);
        let given = headers.get(&HEADER).and_then(|id| id.to_str().ok()).filter(plain);
        Self(given.map_or_else(new_id, str::to_owned))
    }
}

pub(crate) fn new_id() -> String {
    format!("{:016x}", random())
}

/// A number that is unique in this process and unlike those of other processes. It is no secret.
pub(crate) fn random() -> u64 {
    static PROCESS: LazyLock<RandomState> = LazyLock::new(RandomState::new);
    static COUNT: AtomicU64 = AtomicU64::new(0);
    PROCESS.hash_one(COUNT.fetch_add(1, Ordering::Relaxed))
}
