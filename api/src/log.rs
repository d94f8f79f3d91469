//! The log on standard error, a line for each event. A thread writes it, so that no caller waits.

use std::backtrace::{Backtrace, BacktraceStatus};
use std::collections::HashMap;
use std::env;
use std::fmt::Write as _;
use std::io::{self, Write};
use std::panic::PanicHookInfo;
use std::sync::{LazyLock, OnceLock};
use std::time::{Duration, Instant};

use clock::Clock;
use parking_lot::Mutex;
use tracing_appender::non_blocking::{ErrorCounter, NonBlockingBuilder, WorkerGuard};
use tracing_subscriber::{
    Layer, Registry, filter::Targets, layer::SubscriberExt as _, util::SubscriberInitExt as _,
};

/// Log lines that may wait for their reader: some 4 MB.
const LINES_WAITING_MAX: usize = 8192;

/// Longest message of a panic, characters.
const PANIC_LENGTH_MAX: usize = 1000;

/// Time between two lines about panics at one place.
const PANIC_PAUSE: Duration = Duration::from_secs(1);

/// Line breaks beside control characters.
const SEPARATORS: [char; 2] = ['\u{2028}', '\u{2029}'];

pub(crate) type BoxedLayer = Box<dyn Layer<Registry> + Send + Sync>;

/// Counts the lines that had no room.
static DROPPED: OnceLock<ErrorCounter> = OnceLock::new();

/// Logs until the guard is dropped. Excess lines are dropped and counted. `RUST_LOG` overrides.
pub(crate) fn start(directives: &str, format: &str, traces: Option<BoxedLayer>) -> WorkerGuard {
    let given = env::var("RUST_LOG").ok().and_then(|given| given.parse().ok());
    let filter: Targets = given.or_else(|| directives.parse().ok()).unwrap_or_default();
    let waiting = NonBlockingBuilder::default().buffered_lines_limit(LINES_WAITING_MAX);
    let (writer, guard) = waiting.finish(io::stderr());
    DROPPED.get_or_init(|| writer.error_counter());
    let lines = tracing_subscriber::fmt::layer();
    let lines = if format == "json" {
        lines.json().with_writer(writer).boxed()
    } else {
        lines.with_writer(move || OneLine(writer.clone())).boxed()
    };
    let layers: Vec<BoxedLayer> = [lines].into_iter().chain(traces).collect();
    tracing_subscriber::registry().with(layers.with_filter(filter)).init();
    // The standard hook waits for the reader of standard error.
    std::panic::set_hook(Box::new(log_panic));
    guard
}

pub(crate) fn lines_dropped() -> u64 {
    DROPPED.get().map_or(0, |dropped| dropped.dropped_lines() as u64)
}

/// Writes each event as one line: texts of clients and vehicles cannot begin another.
struct OneLine<W>(W);

impl<W: Write> Write for OneLine<W> {
    /// Takes a whole event.
    fn write(&mut self, event: &[u8]) -> io::Result<usize> {
        let text = String::from_utf8_lossy(event);
        let line = text.strip_suffix('\n').unwrap_or(&text);
        let breaks = |c: char| c.is_control() || SEPARATORS.contains(&c);
        if line.contains(breaks) {
            let mut escaped = String::with_capacity(text.len() + 1);
            for c in line.chars() {
                if breaks(c) {
                    let _ = write!(escaped, "{}", c.escape_default());
                } else {
                    escaped.push(c);
                }
            }
            escaped.push('\n');
            self.0.write_all(escaped.as_bytes())?;
        } else {
            self.0.write_all(event)?;
        }
        Ok(event.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        self.0.flush()
    }
}

/// Panics by place: their number since the last line about them, and its time.
type Panics = HashMap<String, (u64, Option<Instant>)>;

/// Logs a panic in one line, with its request. Equal panics share a line each second.
fn log_panic(panic: &PanicHookInfo<'_>) {
    static PANICS: LazyLock<Mutex<Panics>> = LazyLock::new(Mutex::default);
    let place = panic.location().map(ToString::to_string).unwrap_or_default();
    let mut panics = PANICS.lock();
    let (count, last) = panics.entry(place.clone()).or_default();
    *count += 1;
    let clock = Clock::machine();
    if last.is_some_and(|last| clock.since(last) < PANIC_PAUSE) {
        return;
    }
    *last = Some(clock.now());
    let count = std::mem::take(count);
    drop(panics);
    let backtrace = Backtrace::capture();
    let backtrace = (backtrace.status() == BacktraceStatus::Captured).then(|| backtrace.to_string());
    let message = panic.payload_as_str().unwrap_or("no message");
    let message: String = message.chars().take(PANIC_LENGTH_MAX).collect();
    tracing::error!(place, count, backtrace, "panicked: {message}");
}

#[cfg(test)]
mod tests {
    use std::{panic, sync::Arc};

    use super::*;

    #[derive(Clone, Default)]
    struct Written(Arc<Mutex<Vec<u8>>>);

    impl Write for Written {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            self.0.lock().write(bytes)
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    /// The log of `work` as text.
    fn logged(work: impl FnOnce()) -> String {
        let written = Written::default();
        let writer = written.clone();
        let lines = tracing_subscriber::fmt::layer().with_writer(move || OneLine(writer.clone()));
        tracing::subscriber::with_default(tracing_subscriber::registry().with(lines), work);
        let bytes = written.0.lock().clone();
        String::from_utf8(bytes).expect("is text")
    }

    #[test]
    fn a_text_with_line_breaks_stays_one_line() {
        let text =
            "low battery\n2026-01-01T00:00:00Z  INFO pilotfish: all is well\r\u{1b}[2J\u{85}\u{2028}end";
        let lines = logged(|| tracing::warn!(text, %text, "{text}"));
        assert_eq!(lines.matches('\n').count(), 1, "{lines}");
        assert!(lines.ends_with('\n') && lines.contains("low battery\\n2026"), "{lines}");
        let visible = |c: char| c == '\n' || !(c.is_control() || SEPARATORS.contains(&c));
        assert!(lines.chars().all(visible), "{lines:?}");
    }

    #[test]
    fn equal_panics_share_a_line() {
        let hook = panic::take_hook();
        panic::set_hook(Box::new(log_panic));
        let lines = logged(|| {
            for i in 0..100 {
                let _ = panic::catch_unwind(|| panic!("number {i}\nof many"));
            }
        });
        panic::set_hook(hook);
        let n = lines.lines().count();
        // One a second: a slow machine may take several seconds.
        assert!((1..50).contains(&n), "{lines}");
        assert!(lines.contains("panicked: number 0\\nof many") && lines.contains("log.rs:"), "{lines}");
    }
}
