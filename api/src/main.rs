//! The `pilotfish` program.

use std::{env, error::Error, io, process::ExitCode};

use clap::Parser;
use tracing_subscriber::{
    Layer, Registry, filter::Targets, layer::SubscriberExt as _, util::SubscriberInitExt as _,
};

use crate::cli::{Arguments, Config};

mod cli;
#[cfg(feature = "otlp")]
mod otlp;

/// What the program ends with where the command line or the configuration cannot be used, as clap does.
const USAGE: u8 = 2;

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
    log(&config, traces);
    match arguments.run(&layers, &config) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            explain(&*error);
            ExitCode::FAILURE
        }
    }
}

/// Lets the program log to standard error. `RUST_LOG` goes before the configuration, as people expect of Rust programs.
fn log(config: &Config, traces: Option<BoxedLayer>) {
    let filter: Targets = env::var("RUST_LOG")
        .ok()
        .and_then(|given| given.parse().ok())
        .or_else(|| config.log.parse().ok())
        .unwrap_or_default();
    let lines = tracing_subscriber::fmt::layer().with_writer(io::stderr);
    let lines = if config.log_format == "json" {
        lines.json().boxed()
    } else {
        lines.boxed()
    };
    let layers: Vec<BoxedLayer> = [lines].into_iter().chain(traces).collect();
    tracing_subscriber::registry()
        .with(layers.with_filter(filter))
        .init();
}

fn explain(error: &dyn Error) {
    eprintln!("pilotfish: {error}");
    let mut cause = error.source();
    while let Some(error) = cause {
        eprintln!("  because: {error}");
        cause = error.source();
    }
}
