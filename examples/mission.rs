//! A whole mission through the HTTP API: the world is simulated here, the server guides it.
//!
//! ```text
//! cargo run --release                                             # the server, in another terminal
//! cargo run --release -p examples --example mission
//! cargo run --release -p examples --example mission -- cross-current --duration 300
//! ```

use std::{process::ExitCode, time::Instant};

use clap::Parser;
use examples::remote_guide::RemoteGuide;
use indicatif::{ProgressBar, ProgressStyle};
use sim::{
    guide::GuideError,
    metrics::{Metrics, SurfaceCraftMetrics},
    mission,
    scenario::Scenario,
};

#[derive(Parser)]
struct Arguments {
    /// Name of a scenario.
    #[arg(default_value = "paper-tracking")]
    scenario: String,
    /// The server.
    #[arg(long, default_value = "http://127.0.0.1:8080")]
    url: String,
    /// Cut the mission short, s of mission time.
    #[arg(long, value_name = "S")]
    duration: Option<u32>,
    /// Seed of the starting positions.
    #[arg(long, default_value_t = 1)]
    seed: u64,
}

fn main() -> ExitCode {
    match fly(&Arguments::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{error}");
            ExitCode::FAILURE
        }
    }
}

fn fly(arguments: &Arguments) -> Result<(), GuideError> {
    let Some(mut scenario) = Scenario::named(&arguments.scenario) else {
        return Err(format!("the scenarios are {}", Scenario::names().join(", ")).into());
    };
    if !scenario.has_surface_craft() {
        return Err(format!("{} has no surface craft to guide", scenario.name).into());
    }
    if let Some(duration) = arguments.duration {
        scenario = scenario.lasting(duration.into());
    }

    // Draws nothing where there is no terminal.
    let bar = ProgressBar::no_length()
        .with_style(ProgressStyle::with_template("{spinner} {pos} s of {msg}")?)
        .with_message(format!("{} s", scenario.duration_s.most()));
    let mut guide = RemoteGuide::new(&arguments.url);
    let start = Instant::now();
    let record = mission::run(&scenario, &mut guide, arguments.seed, &mut |_| bar.inc(1))?;
    let elapsed = start.elapsed();
    bar.finish_and_clear();

    println!(
        "{}, seed {}, guided by {}",
        record.scenario, record.seed, arguments.url
    );
    let metrics = Metrics::of(&record).surface_craft;
    print_scores(&metrics.ok_or("the mission lasted less than a second")?);
    let per_request = elapsed / record.rows.len().try_into()?;
    println!(
        "{:<20}{:>10.1}",
        "requests_per_s",
        per_request.as_secs_f64().recip()
    );
    Ok(())
}

fn print_scores(metrics: &SurfaceCraftMetrics) {
    let answers = &metrics.answers_by_method;
    println!("{:<20}{:>10.3}", "rms_m", metrics.rms_m);
    println!("{:<20}{:>10.0}", "energy_j", metrics.energy_j);
    println!("{:<20}{:>10.2}", "heading_travel_rad", metrics.heading_travel_rad);
    println!("{:<20}{:>10}", "answers.mpc", answers.mpc);
    println!("{:<20}{:>10}", "answers.previous_plan", answers.previous_plan);
    println!("{:<20}{:>10}", "answers.saturated_los", answers.saturated_los);
    println!("{:<20}{:>10}", "answers.hold", answers.hold);
}
