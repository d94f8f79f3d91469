//! `pilotfish simulate`, `compare`, `figures` and `bench`: whole missions on the command line.

use std::{
    fmt::Write as _,
    io::{self, Write as _},
    path::{Path, PathBuf},
};

use api::{
    comparison::{Comparison, ComparisonError, Stage},
    export::{self, ExportError, Format as RecordFormat},
    figures::FiguresError,
    report::report,
    scores::{Scores, diver_lines},
    stopwatch::Stopwatch,
};
use clap::{Args, ValueEnum};
use indicatif::{ProgressBar, ProgressStyle};
use planner::{
    los::{LosGains, LosLaw, LosTuning},
    policy::Policy,
};
use sim::{
    bench::{BenchError, strangers::StrangersError},
    guide::{Guide, GuideError, LosGuide, MpcGuide},
    metrics::Metrics,
    mission,
    record::Record,
    scenario::Scenario,
};

use crate::cli::{
    out_file::{OutFile, print},
    scenarios::{NoScenario, scenario},
    told_craft::{NoToldCraft, ToldCraft},
    trial::{TrialError, trial},
};

mod bench;
mod figures;
mod snapshots;

pub(crate) use bench::{Bench, bench};
pub(crate) use figures::{Figures, figures};
use snapshots::{Witness, snapshot_file, write_snapshots};

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
        conflicts_with_all = ["controller", "duration_s", "untimed", "report", "snapshots", "craft"]
    )]
    trial: bool,
    #[command(flatten)]
    craft: ToldCraft,
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
    /// Write the record to this file; may be given several times. Its ending says how: .csv and .parquet are
    /// tables with a row a second, .geojson is a map, .mcap is for Foxglove and Lichtblick. A pipe or a device
    /// gets CSV.
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

#[derive(Debug, Args)]
pub(crate) struct Compare {
    /// Name of a scenario (`pilotfish scenarios` lists them), or the path of a scenario file, as ./my.toml.
    scenario: String,
    #[command(flatten)]
    craft: ToldCraft,
    /// How to print the scores.
    #[arg(long, value_enum, default_value_t = Format::Table)]
    format: Format,
    /// Seed of everything that the scenario leaves to chance.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// End the mission after this many seconds, whatever the scenario says. Settled metrics that would begin later
    /// begin at once.
    #[arg(long, value_name = "S", value_parser = clap::value_parser!(u32).range(1..=86_400))]
    duration_s: Option<u32>,
    /// Write an interactive page about all the missions to this file.
    #[arg(long, value_name = "FILE.html")]
    report: Option<PathBuf>,
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

#[derive(Clone, Copy, Debug, ValueEnum)]
enum Format {
    /// For people.
    Table,
    /// For programs.
    Json,
}

/// Why a mission gave no result.
#[derive(Debug, thiserror::Error)]
pub(crate) enum MissionError {
    #[error(transparent)]
    Scenario(#[from] NoScenario),
    #[error(transparent)]
    ToldCraft(#[from] NoToldCraft),
    #[error("the scenario has no surface craft: leave --craft out")]
    NoSurfaceCraft,
    #[error("--{name} must be above 0, not {given}")]
    Gain { name: &'static str, given: f64 },
    #[error("--{0} is a gain of line of sight and the planner has none: add --controller saturated_los")]
    GainOfAnother(&'static str),
    #[error("only the planner is asked in snapshots: leave --snapshots out, or --controller")]
    SnapshotsOfAnother,
    #[error("cannot write {path}: choose another file with --snapshots")]
    Snapshots { path: PathBuf, source: io::Error },
    #[error(transparent)]
    Trial(#[from] TrialError),
    #[error("the mission failed")]
    Mission(#[source] GuideError),
    #[error(transparent)]
    Comparison(#[from] ComparisonError),
    #[error("cannot write {path}: see --out in `pilotfish simulate --help`")]
    Out { path: PathBuf, source: ExportError },
    #[error("cannot write {path}: choose another file with --report")]
    Report { path: PathBuf, source: io::Error },
    #[error("cannot write {path}: choose another directory with --out")]
    Figure { path: PathBuf, source: io::Error },
    #[error(transparent)]
    Figures(#[from] FiguresError),
    #[error(
        "--first-craft {first}: {crafts} craft lead beyond seed {last}, and gains are found on the seeds after it"
    )]
    CraftSeeds { first: u64, crafts: u64, last: u64 },
    #[error("the benchmark could not be run")]
    Bench(#[from] BenchError),
    #[error("the benchmark of random craft could not be run")]
    Strangers(#[from] StrangersError),
    #[error("cannot print the result")]
    Print(#[from] io::Error),
}

fn lasting(scenario: Scenario, duration_s: Option<u32>) -> Scenario {
    match duration_s {
        Some(duration) => scenario.lasting(duration.into()),
        None => scenario,
    }
}

/// The scenario, with the planner told of its craft what the command line says.
fn told(mut scenario: Scenario, told: &ToldCraft) -> Result<Scenario, MissionError> {
    if let Some((_, craft)) = told.read()? {
        let surface_craft = scenario.surface_craft.as_mut();
        surface_craft.ok_or(MissionError::NoSurfaceCraft)?.craft = Some(craft);
    }
    Ok(scenario)
}

/// Runs one mission, prints what it is worth, and keeps the record where asked to.
pub(crate) fn simulate(arguments: &Simulate) -> Result<(), MissionError> {
    let Some(name) = arguments.scenario.as_deref().filter(|_| !arguments.trial) else {
        let craft = arguments.scenario.as_deref().unwrap_or("medusa");
        return Ok(trial(craft, arguments.seed, &arguments.out)?);
    };
    let scenario = told(lasting(scenario(name)?, arguments.duration_s), &arguments.craft)?;
    let mut asked = Vec::new();
    let mut guide: Box<dyn Guide + '_> = match arguments.controller.law() {
        None if arguments.look_ahead_m.is_some() => {
            return Err(MissionError::GainOfAnother(LOOK_AHEAD));
        }
        None if arguments.along_track_gain_per_s.is_some() => {
            return Err(MissionError::GainOfAnother(ALONG_TRACK_GAIN));
        }
        None if arguments.snapshots.is_some() => Box::new(Witness {
            planner: MpcGuide::new(Policy::default()),
            every: arguments.every as usize,
            looks: 0,
            asked: &mut asked,
        }),
        None => Box::new(MpcGuide::new(Policy::default())),
        Some(_) if arguments.snapshots.is_some() => return Err(MissionError::SnapshotsOfAnother),
        Some(law) => Box::new(LosGuide::tuned(LosTuning {
            law,
            gains: gains(arguments)?,
            integral_gain: Policy::default().integral_gain,
        })),
    };
    // Before the mission: a file that cannot be written should not cost one.
    let files = arguments.out.iter().map(|path| record_file(path, &scenario));
    let files = files.collect::<Result<Vec<_>, _>>()?;
    let page = report_file(arguments.report.as_deref())?;
    let requests = snapshot_file(arguments.snapshots.as_deref())?;

    let bar = bar();
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
    let written = write_snapshots(requests, &asked).and(written);
    write_report(page, &[&record]).and(written)?;
    Ok(print(&summary(&record))?)
}

/// A file for the record.
struct RecordFile {
    path: PathBuf,
    file: OutFile,
    format: RecordFormat,
}

fn record_file(path: &Path, scenario: &Scenario) -> Result<RecordFile, MissionError> {
    let refused = |source| MissionError::Out {
        path: path.to_owned(),
        source,
    };
    let file = OutFile::new(path).map_err(|source| refused(source.into()))?;
    let format = match RecordFormat::of(path) {
        // Pipes and devices have no ending as a rule, and CSV reads well in any of them.
        Err(_) if file.is_stream() && path.extension().is_none() => RecordFormat::Csv,
        named => named.map_err(refused)?,
    };
    if format == RecordFormat::Geojson && scenario.origin.is_none() {
        return Err(refused(ExportError::NoOrigin));
    }
    Ok(RecordFile {
        path: path.to_owned(),
        file,
        format,
    })
}

impl RecordFile {
    fn write(&self, record: &Record) -> Result<(), MissionError> {
        let written = self.file.write(|out| export::write(record, self.format, out));
        written.map_err(|source| MissionError::Out {
            path: self.path.clone(),
            source,
        })
    }
}

/// A file for the report, where one is asked for.
fn report_file(path: Option<&Path>) -> Result<Option<(PathBuf, OutFile)>, MissionError> {
    let Some(path) = path else { return Ok(None) };
    let path = path.to_owned();
    match OutFile::new(&path) {
        Ok(file) => Ok(Some((path, file))),
        Err(source) => Err(MissionError::Report { path, source }),
    }
}

fn write_report(file: Option<(PathBuf, OutFile)>, runs: &[&Record]) -> Result<(), MissionError> {
    let Some((path, file)) = file else { return Ok(()) };
    let written = file.write(|out| out.write_all(report(runs).as_bytes()));
    written.map_err(|source| MissionError::Report { path, source })
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
    for diver in &metrics.divers {
        for (name, value) in diver_lines(diver) {
            line(&format!("{}.{name}", diver.id), format!("{value:.3}"));
        }
    }
    text
}

/// Tunes the line-of-sight laws, runs all missions, prints all scores.
pub(crate) fn compare(arguments: &Compare) -> Result<(), MissionError> {
    let scenario = lasting(scenario(&arguments.scenario)?, arguments.duration_s);
    let scenario = told(scenario, &arguments.craft)?;
    let page = report_file(arguments.report.as_deref())?;
    let bar = bar();
    let comparison = Comparison::run(&scenario, arguments.seed, &mut |stage, done| {
        let stage = match stage {
            Stage::Tuning(law) => format!("tuning {}", law.name()),
            Stage::LineOfSight(law) => law.name().to_owned(),
            Stage::Planner => "mpc".to_owned(),
        };
        show(&bar, &stage, done);
    })?;
    bar.finish_and_clear();
    let controllers = comparison.controllers.named();
    let runs: Vec<&Record> = controllers.map(|(_, controller)| &controller.record).collect();
    write_report(page, &runs)?;
    match arguments.format {
        Format::Table => Ok(print(&comparison.to_string())?),
        Format::Json => {
            let json = serde_json::to_string_pretty(&comparison).expect("strings, numbers and lists only");
            Ok(print(&(json + "\n"))?)
        }
    }
}

/// On standard error, and only where that is a terminal.
fn bar() -> ProgressBar {
    const TICKS: u64 = 1000;
    let style = ProgressStyle::with_template("{msg:34} {wide_bar} {percent:>3} % {eta:>4}")
        .expect("the template is a constant");
    ProgressBar::new(TICKS).with_style(style)
}

fn show(bar: &ProgressBar, stage: &str, done: f64) {
    if bar.message() != stage {
        bar.set_message(stage.to_owned());
        bar.reset();
    }
    let ticks = bar.length().unwrap_or_default();
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        clippy::cast_precision_loss,
        reason = "a fraction of a thousand ticks, and the cast saturates"
    )]
    bar.set_position((done * ticks as f64) as u64);
}
