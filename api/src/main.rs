//! The `pilotfish` program.

use std::{env, io, process::ExitCode};

use clap::Parser;
use tracing_subscriber::{
    filter::{LevelFilter, Targets},
    layer::SubscriberExt as _,
    util::SubscriberInitExt as _,
};

mod cli;

fn main() -> ExitCode {
    // RUST_LOG as targets and levels, such as `pilotfish=debug,warn`; ours are those whose names begin so.
    let usual = || {
        Targets::new()
            .with_default(LevelFilter::WARN)
            .with_target("pilotfish", LevelFilter::INFO)
    };
    let given = env::var("RUST_LOG").ok().and_then(|given| given.parse().ok());
    tracing_subscriber::registry()
        .with(given.unwrap_or_else(usual))
        .with(tracing_subscriber::fmt::layer().with_writer(io::stderr))
        .init();

    match cli::Arguments::parse().run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("pilotfish: {error}");
            let mut cause = error.source();
            while let Some(error) = cause {
                eprintln!("  because: {error}");
                cause = error.source();
            }
            ExitCode::FAILURE
        }
    }
}
