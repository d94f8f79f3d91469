//! Limits of request bodies.

/// Longest body accepted, bytes.
pub const BODY_BYTES_MAX: usize = 1 << 20;

/// Longest body that is parsed where it arrives, bytes: that takes a fraction of a millisecond. Longer ones are parsed on threads
/// that keep no mission waiting.
pub(crate) const SHORT_BYTES_MAX: usize = 16 << 10;
