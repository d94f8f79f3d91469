//! The `pilotfish` program, as a library so that its tests build it with every feature.

#![cfg_attr(
    not(feature = "laboratory"),
    expect(dead_code, reason = "the commands that are left out share it")
)]

use std::{error::Error, process::ExitCode};

#[cfg(feature = "otlp")]
use tracing_subscriber::Layer as _;

use crate::cli::{Arguments, visible};

mod cli;
mod log;
#[cfg(feature = "otlp")]
mod otlp;

/// Exit code for a wrong command line or configuration, as in clap.
const USAGE: u8 = 2;

/// Runs the command line of this process.
pub fn run() -> ExitCode {
    let arguments = Arguments::of_process();
    let layers = match arguments.layers() {
        Ok(layers) => layers,
        Err(error) => {
            explain(&*error);
            return ExitCode::from(USAGE);
        }
    };
    let config = layers.config();
    // Sends the last spans when it is dropped.
    #[cfg(feature = "otlp")]
    let tracer = otlp::Tracer::from_environment();
    #[cfg(feature = "otlp")]
    let traces = tracer.as_ref().map(|tracer| tracer.layer().boxed());
    #[cfg(not(feature = "otlp"))]
    let traces = None;
    let lines = log::start(&arguments.log_directives(&config), &config.log_format, traces);
    let ended = arguments.run(&layers, &config);
    // Log lines are written before the final message.
    drop(lines);
    match ended {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            explain(&*error);
            ExitCode::FAILURE
        }
    }
}

fn explain(error: &dyn Error) {
    eprintln!("pilotfish: {}", visible(&error.to_string()));
    let mut cause = error.source();
    while let Some(error) = cause {
        eprintln!("  because: {}", visible(&error.to_string()));
        cause = error.source();
    }
}
