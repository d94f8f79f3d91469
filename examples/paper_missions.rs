//! The two scenarios of the paper as missions of the server, which simulates them; their records as files.
//!
//! ```text
//! cargo run --release -- serve --data /tmp/missions            # the server, in another terminal
//! cargo run --release -p examples --example paper_missions -- --out /tmp/records
//! ```
//! Both run at once. The root mean square distances are those that `pilotfish simulate` prints for the same seed.

use std::{
    error::Error,
    fs::{self, File},
    io::{self, BufRead, BufReader},
    path::PathBuf,
    process::ExitCode,
    thread,
    time::{Duration, SystemTime, UNIX_EPOCH},
};

use clap::Parser;
use examples::remote_missions::{RemoteMissions, insist};
use indicatif::{ProgressBar, ProgressStyle};
use service::missions::event::Event;
use wire::mission::{Controller, NewMission, Simulated, Status};

const SCENARIOS: [&str; 2] = ["paper-tracking", "paper-intermittent"];
/// How long the server may be away.
const PATIENCE: Duration = Duration::from_mins(1);
/// Between two looks at a stream that broke off.
const REST: Duration = Duration::from_millis(200);

#[derive(Parser)]
pub(crate) struct Arguments {
    /// Folder for the records, made if it is not there.
    #[arg(long, value_name = "FOLDER", default_value = ".")]
    out: PathBuf,
    /// The server.
    #[arg(long, default_value = "http://127.0.0.1:8080")]
    url: String,
    /// Seed of the starting positions.
    #[arg(long, default_value_t = 1)]
    seed: u64,
}

fn main() -> ExitCode {
    match fly(&Arguments::parse()) {
        Ok(flown) => {
            for flown in flown {
                println!(
                    "{:<20}{:>10.3}  {}",
                    flown.scenario,
                    flown.rms_m,
                    flown.file.display()
                );
            }
            ExitCode::SUCCESS
        }
        Err(error) => {
            eprintln!("{error}");
            ExitCode::FAILURE
        }
    }
}

/// What became of a mission.
#[derive(Debug)]
pub(crate) struct Flown {
    pub(crate) scenario: &'static str,
    /// Root mean square of the true distance to the goal, m.
    pub(crate) rms_m: f64,
    /// Its record.
    pub(crate) file: PathBuf,
}

pub(crate) fn fly(arguments: &Arguments) -> Result<Vec<Flown>, Box<dyn Error>> {
    let missions = RemoteMissions::new(&arguments.url);
    fs::create_dir_all(&arguments.out)?;
    let run = SystemTime::now().duration_since(UNIX_EPOCH)?.as_nanos();
    let mut under_way = vec![];
    for scenario in SCENARIOS {
        let new = NewMission {
            schema_version: wire::SCHEMA_VERSION.to_owned(),
            title: Some(scenario.to_owned()),
            simulated: Some(Simulated {
                scenario: Some(scenario.to_owned()),
                scenario_file: None,
                seed: arguments.seed,
                controller: Controller::Mpc,
            }),
            live: None,
            metadata: serde_json::Map::new(),
        };
        let key = format!("{scenario}-{run}");
        let mission = insist(PATIENCE, || missions.create(&new, &format!("{key}-create")))?;
        insist(PATIENCE, || missions.run(&mission.id, &format!("{key}-run")))?;
        under_way.push((scenario, mission.id));
    }
    let mut flown = vec![];
    for (scenario, id) in under_way {
        follow(&missions, &id, scenario)?;
        let rms_m = rms_m(BufReader::new(missions.record(&id, "events_ndjson")?))?;
        let file = arguments.out.join(format!("{scenario}.csv"));
        io::copy(&mut missions.record(&id, "csv")?, &mut File::create(&file)?)?;
        flown.push(Flown {
            scenario,
            rms_m: rms_m.ok_or("the record has no plans")?,
            file,
        });
    }
    Ok(flown)
}

/// Watches the mission until it is over.
fn follow(missions: &RemoteMissions, id: &str, scenario: &'static str) -> Result<(), Box<dyn Error>> {
    // Draws nothing where there is no terminal.
    let bar = ProgressBar::no_length()
        .with_style(ProgressStyle::with_template("{spinner} {pos} s of {msg}")?)
        .with_message(scenario);
    let mut last = 0;
    loop {
        for event in insist(PATIENCE, || missions.events(id, last))? {
            // Where the stream breaks off, it is asked for what came after the last event.
            let Ok(event) = event else { break };
            last = event.sequence.unwrap_or(last);
            match event.kind.as_str() {
                "planned" => bar.inc(1),
                "gap" => bar.inc(missed(&event.data)),
                _ => {}
            }
        }
        match insist(PATIENCE, || missions.mission(id))?.status {
            Status::Finished => break,
            Status::Failed => return Err(format!("{scenario} failed: see its record").into()),
            Status::Created | Status::Running | Status::Paused => thread::sleep(REST),
        }
    }
    bar.finish_and_clear();
    Ok(())
}

/// How many events a gap stands for.
fn missed(gap: &serde_json::Value) -> u64 {
    match (gap["from"].as_u64(), gap["to"].as_u64()) {
        (Some(from), Some(to)) if from <= to => to - from + 1,
        _ => 0,
    }
}

/// Root mean square of the true distance to the goal, m, over all plans of a record, an event a line.
fn rms_m(record: impl BufRead) -> Result<Option<f64>, Box<dyn Error>> {
    let (mut n, mut square_sum) = (0.0, 0.0);
    for line in record.lines() {
        if let Event::Planned(planned) = serde_json::from_str(&line?)?
            && let Some(truth) = planned.truth
        {
            n += 1.0;
            square_sum += truth.distance_m * truth.distance_m;
        }
    }
    Ok((0.0 < n).then(|| f64::sqrt(square_sum / n)))
}
