//! W3C trace context: the trace of a request.
//!
//! Source: W3C, "Trace Context", Recommendation of 23 November 2021; the answer's header: Level 2.

use std::fmt;

use axum::http::{HeaderMap, HeaderName};
use tracing::Span;

static TRACEPARENT: HeaderName = HeaderName::from_static("traceparent");

pub(crate) static TRACERESPONSE: HeaderName = HeaderName::from_static("traceresponse");

/// Puts a request's named span into its client's trace. Returns its own context, with a tracer.
pub type TraceFn = fn(&Span, fmt::Arguments<'_>, Option<TraceContext>) -> Option<TraceContext>;

/// A span of a trace, by which the next span continues it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TraceContext {
    /// The trace; not zero.
    pub trace: u128,
    /// The span within it; not zero.
    pub span: u64,
    /// `true` if the caller records it.
    pub sampled: bool,
}

impl TraceContext {
    /// The client's context, if it has one valid header.
    pub(crate) fn of(headers: &HeaderMap) -> Option<Self> {
        let mut given = headers.get_all(&TRACEPARENT).iter();
        match (given.next(), given.next()) {
            (Some(only), None) => Self::parse(only.to_str().ok()?),
            _ => None,
        }
    }

    /// Parses `version-trace-span-flags`; later versions may append more.
    fn parse(text: &str) -> Option<Self> {
        let mut parts = text.splitn(5, '-');
        let version = hex(parts.next()?, 2)?;
        let (trace, span, flags) = (hex(parts.next()?, 32)?, hex(parts.next()?, 16)?, hex(parts.next()?, 2)?);
        let more = parts.next().is_some();
        if version == 0xff || (version == 0 && more) || trace == 0 || span == 0 {
            return None;
        }
        Some(Self { trace, span: u64::try_from(span).ok()?, sampled: flags & 1 == 1 })
    }

    /// A span in the client's trace, or in a new one; `fresh` gives random numbers.
    pub(crate) fn within(parent: Option<Self>, fresh: impl Fn() -> u64) -> Self {
        let own = || u128::from(fresh()) << 64 | u128::from(fresh());
        Self {
            trace: parent.map_or_else(own, |parent| parent.trace).max(1),
            span: fresh().max(1),
            sampled: false,
        }
    }
}

impl fmt::Display for TraceContext {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { trace, span, sampled } = *self;
        write!(f, "00-{trace:032x}-{span:016x}-{:02x}", u8::from(sampled))
    }
}

/// A number with exactly `digits` lower-case hexadecimal digits.
fn hex(text: &str, digits: usize) -> Option<u128> {
    let valid = |byte| matches!(byte, b'0'..=b'9' | b'a'..=b'f');
    if text.len() != digits || !text.bytes().all(valid) {
        return None;
    }
    u128::from_str_radix(text, 16).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    const VALID: &str = "00-0af7651916cd43dd8448eb211c80319c-b7ad6b7169203331-01";

    #[test]
    fn a_written_trace_context_is_read_back() {
        let context = TraceContext::parse(VALID).expect("is the standard's example");
        assert_eq!(context.span, 0xb7ad_6b71_6920_3331);
        assert!(context.sampled);
        assert_eq!(context.to_string(), VALID);
    }

    #[test]
    fn a_later_version_may_append_more_and_ff_is_invalid() {
        let later = VALID.replacen("00", "cc", 1);
        assert_eq!(TraceContext::parse(&later), TraceContext::parse(VALID));
        let more = format!("{later}-what-the-future-brings");
        assert_eq!(TraceContext::parse(&more), TraceContext::parse(VALID));
        for invalid in [
            format!("{VALID}-more"),
            format!("{later}."),
            VALID.replacen("00", "ff", 1),
            VALID.to_uppercase(),
            VALID.replace("b7ad6b7169203331", "0000000000000000"),
            VALID.replace("0af7651916cd43dd8448eb211c80319c", &"0".repeat(32)),
            VALID.replacen("0af", "+af", 1),
            VALID[..52].to_owned(),
            String::new(),
        ] {
            assert_eq!(TraceContext::parse(&invalid), None, "{invalid}");
        }
    }

    #[test]
    fn a_trace_continues_in_a_new_span_and_two_headers_are_ignored() {
        let client = TraceContext::parse(VALID);
        let service = TraceContext::within(client, || 7);
        assert_eq!((service.trace, service.span), (client.expect("is valid").trace, 7));
        let mut headers = HeaderMap::new();
        headers.append(&TRACEPARENT, VALID.parse().expect("is text"));
        assert_eq!(TraceContext::of(&headers), client);
        headers.append(&TRACEPARENT, VALID.parse().expect("is text"));
        assert_eq!(TraceContext::of(&headers), None);
    }
}
