//! `pilotfish demo`: a service with one simulated mission, and the page that shows it.

use std::error::Error;
use std::fs;
use std::net::{SocketAddr, TcpListener};
use std::os::unix::process::CommandExt as _;
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::mpsc::channel;

use clap::Args;
use clock::Clock;
use rustix::process::{Signal, getpid, kill_process};
use serde_json::{Value, json};

use crate::cli::config::{Config, Layers};
use crate::cli::failure::because_of;
use crate::cli::out_file::print;
use crate::cli::scenarios::{NameOrFile, scenario};
use crate::cli::serve::{HangUp, serve_and};

#[derive(Debug, Args)]
pub(crate) struct Demo {
    /// Built-in scenario, or a scenario file that names no other file.
    #[arg(default_value = "switching", value_parser = NameOrFile, hide_possible_values = true)]
    scenario: String,
    /// Seed of all random numbers.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Seconds of the mission per second.
    #[arg(long, value_name = "FACTOR", default_value_t = 20.0)]
    speed_factor: f64,
    /// Port on 127.0.0.1 [default: 8080, or a free one if that is in use]
    #[arg(long)]
    port: Option<u16>,
    /// Print the address of the page, and open no browser.
    #[arg(long)]
    no_browser: bool,
}

/// Serves, runs the mission and opens its page until Ctrl-C. Without `--data` it is then deleted.
pub(crate) fn demo(demo: &Demo, layers: &Layers, config: &Config) -> Result<(), Box<dyn Error>> {
    let title = scenario(&demo.scenario)?.title;
    let body = demo.mission()?;
    let temporary = if layers.has_flag("data") {
        None
    } else {
        let directory = tempfile::Builder::new().prefix("pilotfish-demo-").tempdir();
        let advice = "cannot make a directory for the mission: name one with --data";
        Some(directory.map_err(because_of(advice))?)
    };
    let mut own = config.on_any_loopback_port();
    own.port = demo.port.unwrap_or_else(|| free_or_any(config.port));
    let kept = if let Some(directory) = &temporary {
        directory.path().clone_into(&mut own.data);
        own.tokens = None;
        "deletes the mission (--data DIRECTORY keeps it)".to_owned()
    } else {
        format!("keeps the mission in {}", own.data.display())
    };
    let (speed_factor, opens) = (demo.speed_factor, !demo.no_browser);
    let show = move |address| {
        let page = begin(address, &body, speed_factor)?;
        print(&format!(
            "{title}, {speed_factor} times as fast as life:\n\n  {page}\n\nCtrl-C ends it and {kept}.\n"
        ))?;
        if opens { open(&page) } else { Ok(()) }
    };
    let (failed, failure) = channel();
    serve_and(&own, HangUp::Stops, |address, _| {
        let shown = async move {
            if let Err(error) = show(address) {
                // The receiver exists until the service has stopped.
                let _ = failed.send(error);
                let _ = kill_process(getpid(), Signal::INT);
            }
        };
        if let Err(error) = Clock::machine().spawn_thread("show", shown) {
            tracing::error!(%error, "the mission does not begin");
        }
    })?;
    failure.try_recv().map_or(Ok(()), |error| Err(error as Box<dyn Error>))
}

impl Demo {
    /// The body that creates the mission.
    fn mission(&self) -> Result<Value, Box<dyn Error>> {
        let path = Path::new(&self.scenario);
        let (name, key, value) = if path.extension().is_some() || path.components().count() != 1 {
            let name = path.file_stem().unwrap_or_default().to_string_lossy();
            (name, "scenario_file", fs::read_to_string(path)?)
        } else {
            (self.scenario.as_str().into(), "scenario", self.scenario.clone())
        };
        Ok(json!({
            "schema_version": "1.0",
            "title": format!("{name}, seed {}", self.seed),
            "simulated": { key: value, "seed": self.seed },
        }))
    }
}

/// The port, or 0 if it is in use.
fn free_or_any(port: u16) -> u16 {
    TcpListener::bind(("127.0.0.1", port)).map_or(0, |_| port)
}

/// Creates and runs the mission. Returns the address of its page.
fn begin(
    address: SocketAddr,
    body: &Value,
    speed_factor: f64,
) -> Result<String, Box<dyn Error + Send + Sync>> {
    let made = post(&format!("http://{address}/v1/missions"), body)?;
    let id = made["id"].as_str().unwrap_or_default();
    let order = json!({ "speed_factor": speed_factor });
    post(&format!("http://{address}/v1/missions/{id}/run"), &order)?;
    Ok(format!("http://{address}/#/mission/{id}"))
}

fn post(url: &str, body: &Value) -> Result<Value, Box<dyn Error + Send + Sync>> {
    const UNANSWERED: &str = "the service did not answer";
    let call = ureq::post(url).config().http_status_as_error(false).proxy(None).build();
    let mut answer = call.send_json(body).map_err(because_of(UNANSWERED))?;
    let is_done = answer.status().is_success();
    let answer = answer.body_mut().read_json::<Value>().map_err(because_of(UNANSWERED))?;
    if is_done {
        return Ok(answer);
    }
    let fault = answer["errors"][0]["detail"].as_str();
    let detail = fault.or(answer["detail"].as_str()).unwrap_or_default();
    Err(format!("the service refuses the mission: {detail}").into())
}

/// Opens the page in the user's browser, which Ctrl-C does not end.
fn open(page: &str) -> Result<(), Box<dyn Error + Send + Sync>> {
    let opened = Command::new("xdg-open")
        .arg(page)
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .process_group(0)
        .status();
    if !opened.is_ok_and(|status| status.success()) {
        print("No browser could be opened: open the address in one.\n")?;
    }
    Ok(())
}
