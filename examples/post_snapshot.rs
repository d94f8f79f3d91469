//! The smallest client: posts a snapshot, prints the speed and the heading to steer.
//!
//! ```text
//! cargo run --release                                          # the server, in another terminal
//! cargo run --release -p examples --example post_snapshot
//! cargo run --release -p examples --example post_snapshot -- examples/snapshots/midpoint.json
//! ```

use std::{error::Error, fs, process::ExitCode};

use clap::Parser;
use serde_json::Value;

#[derive(Parser)]
pub(crate) struct Arguments {
    /// The snapshot to post.
    #[arg(default_value = "examples/snapshots/track.json")]
    snapshot: String,
    /// The server to ask.
    #[arg(long, default_value = "http://127.0.0.1:8080")]
    url: String,
}

fn main() -> ExitCode {
    match ask(&Arguments::parse()) {
        Ok(reference) => println!("{reference}"),
        Err(error) => {
            eprintln!("{error}");
            return ExitCode::FAILURE;
        }
    }
    ExitCode::SUCCESS
}

pub(crate) fn ask(arguments: &Arguments) -> Result<String, Box<dyn Error>> {
    let Arguments { snapshot, url } = arguments;
    let body = fs::read_to_string(snapshot).map_err(|error| format!("{snapshot}: {error}"))?;

    // A refusal has a problem document as its body, so it is read like any other answer.
    let agent: ureq::Agent =
        ureq::Agent::config_builder().http_status_as_error(false).proxy(None).build().into();
    let post = agent.post(format!("{url}/v1/plan")).content_type("application/json");
    let mut response = post.send(body).map_err(|error| {
        format!("{url}: {error}. Is the server running? `cargo run --release` starts one.")
    })?;
    let answer: Value = response.body_mut().read_json()?;
    if !response.status().is_success() {
        return Err(format!("the snapshot was refused: {answer:#}").into());
    }

    let reference = |name| answer["reference"][name].as_f64().ok_or("the answer has no reference");
    let (speed, heading) = (reference("speed_mps")?, reference("heading_deg")?);
    Ok(format!("speed {speed:.2} m/s, heading {heading:.1}°"))
}
