//! `pilotfish simulate`: one mission with one controller.

use std::{error::Error, fmt::Write as _, path::PathBuf};

use clap::{Args, ValueEnum};
use lab::{
    comparison::Gains,
    report::ReportedRun,
    scores::{Scores, auv_lines},
    stopwatch::Stopwatch,
    tuning::tune,
};
use planner::{
    los::{LosGains, LosLaw, LosTuning},
    policy::Policy,
};
use sim::{
    guide::{Guide, LosGuide, MpcGuide},
    metrics::Metrics,
    mission,
    record::Record,
    scenario::Scenario,
};

use super::{
    declared::{declare, lasting},
    error::MissionError,
    files::{RecordFile, record_file, report_file, write_report},
    progress::{bar, show},
    snapshots::{KeptPlanner, snapshot_file, write_snapshots},
};
use crate::cli::{declared_craft::DeclaredCraft, out_file::print, scenarios::scenario, trial::trial};

const LOOK_AHEAD: &str = "look-ahead-m";
const ALONG_TRACK_GAIN: &str = "along-track-gain-per-s";

#[derive(Debug, Args)]
pub(crate) struct Simulate {
    /// Name of a scenario (`pilotfish scenarios` lists them), or the path of a scenario file, as ./my.toml. Of a trial
    /// also medusa, which is the default, or otter.
    #[arg(required_unless_present = "trial")]
    scenario: Option<String>,
    /// Put the scenario's craft through a sea trial in its water (docs/commissioning.md) and log it, for
    /// `pilotfish identify`.
    #[arg(
        long, requires = "out",
        conflicts_with_all = ["controller", "duration_s", "untimed", "report", "snapshots", "craft", "tuned"]
    )]
    trial: bool,
    #[command(flatten)]
    craft: DeclaredCraft,
    /// What guides the surface craft.
    #[arg(long, value_enum, default_value_t = Controller::Mpc)]
    controller: Controller,
    /// Seed of everything that the scenario leaves to chance.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// End the mission after this many seconds, whatever the scenario says. Settled metrics that would begin later
    /// begin at once.
    #[arg(long, value_name = "S", value_parser = clap::value_parser!(u32).range(1..=86_400))]
    duration_s: Option<u32>,
    /// Write the record to this file; may be given several times. Its ending says how: .csv, .parquet and .ndjson
    /// are the table of docs/records.md, .geojson is a map, .mcap is for Foxglove and Lichtblick. A pipe or a
    /// device gets CSV.
    #[arg(long, value_name = "FILE")]
    out: Vec<PathBuf>,
    /// Leave solve times out of record and page, so that the same command writes the same bytes again.
    #[arg(long)]
    untimed: bool,
    /// Write an interactive page about the mission to this file.
    #[arg(long, value_name = "FILE.html")]
    report: Option<PathBuf>,
    /// Write every snapshot that the planner was asked to this file, as requests to plan again, one a line.
    #[arg(long, value_name = "FILE.ndjson")]
    snapshots: Option<PathBuf>,
    /// Of the snapshots, write the first and every N-th after it.
    #[arg(
        long, value_name = "N", default_value_t = 1, requires = "snapshots",
        value_parser = clap::value_parser!(u32).range(1..)
    )]
    every: u32,
    /// Search for the gains of the line-of-sight law first, as `pilotfish compare` does: the best of its grid for this
    /// scenario and seed.
    #[arg(long, conflicts_with_all = ["look_ahead_m", "along_track_gain_per_s"])]
    tuned: bool,
    #[arg(
        long, value_name = "M", allow_negative_numbers = true,
        help = format!("Look-ahead distance of the line-of-sight laws, m [default: {}]", Policy::default().los.look_ahead)
    )]
    look_ahead_m: Option<f64>,
    #[arg(
        long, value_name = "GAIN", allow_negative_numbers = true,
        help = format!("Along-track gain of the line-of-sight laws, 1/s [default: {}]", Policy::default().los.along_track_gain)
    )]
    along_track_gain_per_s: Option<f64>,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum Controller {
    /// The planner.
    #[value(name = "mpc")]
    Mpc,
    /// The saturated line-of-sight law, errors in the target's frame.
    #[value(name = "saturated_los")]
    SaturatedLos,
    /// The saturated line-of-sight law, errors in the tracker's frame.
    #[value(name = "saturated_los_tracker_frame")]
    TrackerFrame,
    /// Integral line of sight.
    #[value(name = "integral_los")]
    Integral,
    /// Way-points round a box, drawn every 360 s.
    #[value(name = "waypoint_box")]
    WaypointBox,
    /// Line of sight exactly as printed, which runs away.
    #[value(name = "printed_los")]
    Printed,
}

impl Controller {
    /// The law that it is; none for the planner.
    fn law(self) -> Option<LosLaw> {
        match self {
            Self::Mpc => None,
            Self::SaturatedLos => Some(LosLaw::SaturatedLos),
            Self::TrackerFrame => Some(LosLaw::TrackerFrame),
            Self::Integral => Some(LosLaw::Integral),
            Self::WaypointBox => Some(LosLaw::WaypointBox),
            Self::Printed => Some(LosLaw::Printed),
        }
    }
}

/// Runs one mission, prints what it is worth, and keeps the record where asked to.
pub(crate) fn simulate(arguments: &Simulate) -> Result<(), Box<dyn Error>> {
    let Some(name) = arguments.scenario.as_deref().filter(|_| !arguments.trial) else {
        let craft = arguments.scenario.as_deref().unwrap_or("medusa");
        return trial(craft, arguments.seed, &arguments.out);
    };
    let scenario = declare(lasting(scenario(name)?, arguments.duration_s), &arguments.craft)?;
    check(arguments)?;
    // Before the mission: a file that cannot be written should not cost one.
    let files = arguments.out.iter().map(|path| record_file(path, &scenario));
    let files = files.collect::<Result<Vec<_>, _>>()?;
    let page = arguments.report.as_deref().map(report_file).transpose()?;
    let requests = arguments.snapshots.as_deref().map(snapshot_file);
    let requests = requests.transpose()?;

    let bar = bar();
    let tuning = match arguments.controller.law() {
        Some(law) => Some(law_tuning(law, &scenario, arguments, &mut |done| {
            show(&bar, "tuning", done);
        })?),
        None => None,
    };
    let (mut asked, mut predictions) = (Vec::new(), Vec::new());
    let mut guide: Box<dyn Guide + '_> = match tuning {
        Some(tuning) => Box::new(LosGuide::tuned(tuning)),
        None => Box::new(KeptPlanner {
            planner: MpcGuide::new(Policy::default()),
            n_plans: 0,
            every: arguments.snapshots.is_some().then_some(arguments.every as usize),
            asked: &mut asked,
            predictions: page.is_some().then_some(&mut predictions),
        }),
    };
    let mut progress = |done| show(&bar, "mission", done);
    let record = if arguments.untimed {
        mission::run(&scenario, guide.as_mut(), arguments.seed, &mut progress)
    } else {
        let mut stopwatch = Stopwatch::new(guide.as_mut());
        mission::run(&scenario, &mut stopwatch, arguments.seed, &mut progress)
    };
    let record = record.map_err(MissionError::Mission)?;
    drop(guide);
    bar.finish_and_clear();

    // The mission is not to be had again: what one file does not take, the others still get.
    let write = |file: &RecordFile| file.write(&record);
    let written = files.iter().map(write).fold(Ok(()), Result::and);
    let requests = requests.map_or(Ok(()), |file| write_snapshots(&file, &asked));
    let page = page.map_or(Ok(()), |file| {
        let run = ReportedRun {
            predictions: &predictions,
            ..ReportedRun::from(&record)
        };
        write_report(&file, &[run])
    });
    page.and(requests).and(written)?;
    let found = tuning
        .filter(|_| arguments.tuned)
        .map_or_else(String::new, |tuning| {
            format!("{}: {}.\n", tuning.law.name(), Gains::from(tuning))
        });
    Ok(print(&(summary(&record) + &found))?)
}

/// Refuses what one kind of controller does not have.
fn check(arguments: &Simulate) -> Result<(), MissionError> {
    match arguments.controller.law() {
        None if arguments.look_ahead_m.is_some() => Err(MissionError::GainOfAnother(LOOK_AHEAD)),
        None if arguments.along_track_gain_per_s.is_some() => {
            Err(MissionError::GainOfAnother(ALONG_TRACK_GAIN))
        }
        None if arguments.tuned => Err(MissionError::TunedOfAnother),
        Some(_) if arguments.snapshots.is_some() => Err(MissionError::SnapshotsOfAnother),
        None => Ok(()),
        Some(_) => gains(arguments).map(drop),
    }
}

/// How `law` flies: with the gains that are given, or the best of its grid.
fn law_tuning(
    law: LosLaw,
    scenario: &Scenario,
    arguments: &Simulate,
    progress: &mut dyn FnMut(f64),
) -> Result<LosTuning, MissionError> {
    if arguments.tuned {
        let (tuning, _) = tune(law, scenario, arguments.seed, progress)?;
        return Ok(tuning);
    }
    Ok(LosTuning {
        law,
        gains: gains(arguments)?,
        integral_gain: Policy::default().integral_gain,
    })
}

fn gains(arguments: &Simulate) -> Result<LosGains, MissionError> {
    let positive = |name, given: f64| {
        if given.is_finite() && 0.0 < given {
            Ok(given)
        } else {
            Err(MissionError::Gain { name, given })
        }
    };
    let LosGains {
        look_ahead,
        along_track_gain,
    } = Policy::default().los;
    Ok(LosGains {
        look_ahead: positive(LOOK_AHEAD, arguments.look_ahead_m.unwrap_or(look_ahead))?,
        along_track_gain: positive(
            ALONG_TRACK_GAIN,
            arguments.along_track_gain_per_s.unwrap_or(along_track_gain),
        )?,
    })
}

fn summary(record: &Record) -> String {
    let metrics = Metrics::of(record);
    let mut text = format!("{}, seed {}\n", record.scenario, record.seed);
    let mut line = |name: &str, value: String| {
        writeln!(text, "{name:<34}{value:>20}").expect("a string takes everything");
    };
    if let Some(surface_craft) = metrics.surface_craft {
        for (name, value) in Scores::new(record, surface_craft).lines() {
            line(&name, value);
        }
    }
    for auv in &metrics.auvs {
        for (name, value) in auv_lines(auv) {
            line(&format!("{}.{name}", auv.id), format!("{value:.3}"));
        }
    }
    text
}
