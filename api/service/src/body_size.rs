//! Limits of request bodies.

/// Longest body accepted, bytes.
pub const BODY_BYTES_MAX: usize = 1 << 20;

/// Longest body that is parsed where it arrives, in a fraction of a millisecond, bytes. Longer ones
/// are parsed on threads that delay no mission.
pub(crate) const SHORT_BYTES_MAX: usize = 16 << 10;
