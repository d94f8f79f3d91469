//! The `pilotfish` program.

use std::{env, error::Error, io, process::ExitCode};

use clap::Parser;
use tracing_appender::non_blocking::{NonBlockingBuilder, WorkerGuard};
use tracing_subscriber::{
    Layer, Registry, filter::Targets, layer::SubscriberExt as _, util::SubscriberInitExt as _,
};

use crate::cli::{Arguments, Config};

mod cli;
#[cfg(feature = "otlp")]
mod otlp;

/// What the program ends with where the command line or the configuration cannot be used, as clap does.
const USAGE: u8 = 2;

/// Lines of the log that wait for their reader at most: some 4 MB.
const LINES_WAITING_MAX: usize = 8192;

type BoxedLayer = Box<dyn Layer<Registry> + Send + Sync>;

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    let configured = arguments.layers().and_then(|layers| {
        let config = layers.config()?;
        Ok((layers, config))
    });
    let (layers, config) = match configured {
        Ok(configured) => configured,
        Err(error) => {
            explain(&error);
            return ExitCode::from(USAGE);
        }
    };
    // Sends what is left when the program ends.
    #[cfg(feature = "otlp")]
    let tracer = otlp::Tracer::from_environment();
    #[cfg(feature = "otlp")]
    let traces = tracer.as_ref().map(|tracer| tracer.layer().boxed());
    #[cfg(not(feature = "otlp"))]
    let traces = None;
    let lines = log(&arguments.log_directives(&config), &config, traces);
    let ended = arguments.run(&layers, &config);
    // The lines of the log before what is said last.
    drop(lines);
    match ended {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            explain(&*error);
            ExitCode::FAILURE
        }
    }
}

/// Lets the program log to standard error, until what is answered is dropped: a thread of its own writes the lines, and
/// drops them while their reader does not read, so that no request waits for it. `RUST_LOG` goes before the configuration,
/// as people expect of Rust programs.
fn log(directives: &str, config: &Config, traces: Option<BoxedLayer>) -> WorkerGuard {
    let filter: Targets = env::var("RUST_LOG")
        .ok()
        .and_then(|given| given.parse().ok())
        .or_else(|| directives.parse().ok())
        .unwrap_or_default();
    let waiting = NonBlockingBuilder::default().buffered_lines_limit(LINES_WAITING_MAX);
    let (writer, guard) = waiting.finish(io::stderr());
    let lines = tracing_subscriber::fmt::layer().with_writer(writer);
    let lines = if config.log_format == "json" {
        lines.json().boxed()
    } else {
        lines.boxed()
    };
    let layers: Vec<BoxedLayer> = [lines].into_iter().chain(traces).collect();
    tracing_subscriber::registry()
        .with(layers.with_filter(filter))
        .init();
    guard
}

fn explain(error: &dyn Error) {
    eprintln!("pilotfish: {error}");
    let mut cause = error.source();
    while let Some(error) = cause {
        eprintln!("  because: {error}");
        cause = error.source();
    }
}
