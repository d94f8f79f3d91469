//! `pilotfish simulate`: one mission with one controller.

use std::{error::Error, fmt::Write as _, path::PathBuf};

use bridge::rehearsal::Rehearsal;
use bridge::wire::Endpoint;
use clap::Args;
use clap::builder::{PossibleValuesParser, TypedValueParser};
use lab::comparison::best_gains;
use lab::http_guide::{GuideUrl, HttpGuide};
use lab::report::{ReportedRun, report};
use lab::scores::lines;
use lab::stopwatch::{CLOCK, Stopwatch};
use planner::los::{LawGains, LosGains, LosLaw, LosTuning};
use planner::parameters::Parameters;
use planner::snapshot::Origin;
use sim::{
    fleet::{self, Assigner},
    guide::{Guide, LosGuide, MpcGuide},
    mission,
    record::Record,
};

use super::rehearse::WireGuide;
use super::run::{RecordFile, RunArguments, one_craft_unless};
use super::snapshots::{RecordedPlanner, write_snapshots};
use crate::cli::failure::because_of;
use crate::cli::out_file::{OutFile, print};
use crate::cli::progress::{bar, show};
use crate::cli::scenarios::NameOrFile;
use crate::cli::trial::trial;

#[derive(Debug, Args)]
pub(crate) struct Simulate {
    /// A built-in scenario (`pilotfish scenarios` lists them), or the path of a scenario file, such
    /// as ./my.toml. With --trial also medusa (the default) or otter.
    #[arg(required_unless_present = "trial", value_parser = NameOrFile, hide_possible_values = true)]
    scenario: Option<String>,
    /// Simulate a sea trial (docs/commissioning.md) of the scenario's craft and write its log for
    /// `pilotfish identify`.
    #[arg(
        long, requires = "out",
        conflicts_with_all = ["moos", "imc", "controller", "duration_s", "untimed", "report", "snapshots", "craft", "route", "tuned", "guide", "set"]
    )]
    trial: bool,
    #[command(flatten)]
    run: RunArguments,
    /// The planner (mpc) or a line-of-sight law.
    #[arg(long, value_parser = ControllerName::parser(), default_value = ControllerName::PLANNER)]
    controller: ControllerName,
    /// Steer by the law at this address, which gets each snapshot over HTTP (docs/own-law.md), such
    /// as http://127.0.0.1:8000/.
    #[arg(
        long, value_name = "URL",
        conflicts_with_all = ["controller", "snapshots", "tuned", "look_ahead_m", "along_track_gain_per_s"]
    )]
    guide: Option<GuideUrl>,
    /// Rehearse with MOOS: play the vehicles in real time on the MOOSDB at this address, and follow
    /// DESIRED_HEADING and DESIRED_SPEED (docs/at-sea.md).
    #[arg(long, value_name = "HOST:PORT", value_parser = database, conflicts_with_all = NOT_ON_WIRES)]
    moos: Option<Endpoint>,
    /// Rehearse with Neptus: play vehicles that run DUNE in real time on the network of this
    /// address, one of this computer.
    #[arg(long, value_name = "ADDRESS:PORT", value_parser = network, conflicts_with_all = NOT_ON_WIRES, conflicts_with = "moos")]
    imc: Option<Endpoint>,
    /// Write the record to this file; may be repeated. The suffix chooses the format: .csv,
    /// .parquet and .ndjson are the table of docs/records.md, .geojson is a map, .mcap is for
    /// Foxglove and Lichtblick. A pipe or a device gets CSV.
    #[arg(long, value_name = "FILE")]
    out: Vec<PathBuf>,
    /// Leave solve times out of record and report, so that the same command writes the same bytes.
    #[arg(long)]
    untimed: bool,
    /// Write an interactive report of the mission to this file.
    #[arg(long, value_name = "FILE.html")]
    report: Option<PathBuf>,
    /// Write the planner's snapshots to this file, as requests to plan again, one for each line.
    #[arg(long, value_name = "FILE.ndjson")]
    snapshots: Option<PathBuf>,
    /// Write only the first snapshot and every N-th after it.
    #[arg(
        long, value_name = "N", default_value_t = 1, requires = "snapshots",
        value_parser = clap::value_parser!(u32).range(1..)
    )]
    every: u32,
    /// First tune the gains of the line-of-sight law for this scenario and seed, as `pilotfish
    /// compare` does.
    #[arg(long, conflicts_with_all = ["look_ahead_m", "along_track_gain_per_s"])]
    tuned: bool,
    #[arg(
        long, value_name = "M", allow_negative_numbers = true,
        help = format!("Look-ahead distance of the line-of-sight laws, m [default: {}]", Parameters::default().los.look_ahead)
    )]
    look_ahead_m: Option<f64>,
    #[arg(
        long, value_name = "GAIN", allow_negative_numbers = true,
        help = format!("Along-track gain of the line-of-sight laws, 1/s [default: {}]", Parameters::default().los.along_track_gain)
    )]
    along_track_gain_per_s: Option<f64>,
}

/// What steers no rehearsal.
const NOT_ON_WIRES: [&str; 6] =
    ["controller", "guide", "snapshots", "tuned", "look_ahead_m", "along_track_gain_per_s"];

/// The origin of a rehearsal without one in its scenario: that of examples/moos.
const ORIGIN: Origin = Origin { lat_deg: 43.8253, lon_deg: -70.3304 };

fn database(address: &str) -> Result<Endpoint, String> {
    format!("tcp:{address}").parse().map_err(|_| "write HOST:PORT, such as localhost:9000".to_owned())
}

fn network(address: &str) -> Result<Endpoint, String> {
    let wrong = "write ADDRESS:PORT, one of this computer's, such as 127.0.0.1:6020";
    format!("imc:{address}").parse().map_err(|_| wrong.to_owned())
}

/// The planner, or a law instead.
#[derive(Clone, Copy, Debug)]
struct ControllerName(Option<LosLaw>);

impl ControllerName {
    const PLANNER: &str = "mpc";

    /// Parses the value of `--controller`.
    fn parser() -> impl TypedValueParser<Value = Self> {
        let names = [Self::PLANNER].into_iter().chain(LosLaw::ALL.map(LosLaw::name));
        PossibleValuesParser::new(names)
            .map(|name| Self(LosLaw::ALL.into_iter().find(|law| law.name() == name)))
    }
}

/// Runs one mission, prints its scores, and writes the requested files.
pub(crate) fn simulate(arguments: &Simulate) -> Result<(), Box<dyn Error>> {
    let Some(name) = arguments.scenario.as_deref().filter(|_| !arguments.trial) else {
        let craft = arguments.scenario.as_deref().unwrap_or("medusa");
        return trial(craft, arguments.run.seed, &arguments.out);
    };
    let scenario = arguments.run.scenario(name)?;
    check(arguments)?;
    let options = "--controller, --guide, --moos, --imc, --snapshots and --report";
    one_craft_unless(!arguments.steers_one(), &scenario, options)?;
    // Before the mission, so that a file that cannot be written does not waste it.
    let files = arguments.out.iter().map(|path| RecordFile::new(path, &scenario));
    let files = files.collect::<Result<Vec<_>, _>>()?;
    let page = arguments.report.as_deref().map(OutFile::new).transpose()?;
    let requests = arguments.snapshots.as_deref().map(OutFile::new).transpose()?;

    let bar = bar();
    let mut show_tuning = |done| show(&bar, "tuning", done);
    let tuning = match arguments.controller.0 {
        Some(law) if arguments.tuned => {
            Some(best_gains(law, &scenario, arguments.run.seed, &mut show_tuning)?)
        }
        Some(law) => Some(arguments.tuning(law)),
        None => None,
    };
    let (mut asked, mut predictions) = (Vec::new(), Vec::new());
    let wire = arguments.moos.as_ref().or(arguments.imc.as_ref());
    let origin = scenario.start(arguments.run.seed)?.origin.map_or(ORIGIN, Origin::from);
    let begin = |wire| Rehearsal::begin(wire, origin).ok_or("the scenario's origin is no place");
    let rehearsal = wire.map(begin).transpose()?;
    let mut guide: Box<dyn Guide + '_> = match (rehearsal, &arguments.guide, tuning) {
        (Some(rehearsal), ..) => Box::new(WireGuide(rehearsal)),
        (None, Some(url), _) => Box::new(HttpGuide::new(url)),
        (None, None, Some(tuning)) => Box::new(LosGuide::tuned(tuning)),
        (None, None, None) => Box::new(RecordedPlanner {
            planner: MpcGuide::new(Parameters::default()),
            n_plans: 0,
            every: arguments.snapshots.is_some().then_some(arguments.every as usize),
            asked: &mut asked,
            predictions: page.is_some().then_some(&mut predictions),
        }),
    };
    let mut progress = |done| show(&bar, "mission", done);
    let record = if scenario.has_fleet() {
        let clock = (!arguments.untimed).then_some(CLOCK);
        fleet::run(&scenario, Assigner::Planner, (arguments.run.seed, clock), &mut progress)
    } else if arguments.untimed {
        mission::run(&scenario, guide.as_mut(), arguments.run.seed, &mut progress)
    } else {
        mission::run(&scenario, &mut Stopwatch(guide.as_mut()), arguments.run.seed, &mut progress)
    };
    let record = record.map_err(because_of("the mission failed"))?;
    drop(guide);
    bar.finish_and_clear();

    // The mission took long: if one file fails, the others are still written.
    let write = |file: &RecordFile| file.write(&record);
    let written = files.iter().map(write).fold(Ok(()), Result::and);
    let requests = requests.map_or(Ok(()), |file| write_snapshots(&file, &asked));
    let page = page.map_or(Ok(()), |file| {
        let run = ReportedRun {
            predictions: &predictions,
            gains: tuning.map(LawGains::from),
            ..ReportedRun::from(&record)
        };
        file.write_text(&report(&[run]))
    });
    page.and(requests).and(written)?;
    let found = tuning.filter(|_| arguments.tuned);
    let found = found.map(|tuning| format!("{}: {}.\n", tuning.law.name(), LawGains::from(tuning)));
    let found = found.unwrap_or_default();
    Ok(print(&(summary(&record) + &found))?)
}

/// Checks the options of the planner and of the laws.
fn check(arguments: &Simulate) -> Result<(), Box<dyn Error>> {
    let gains = [
        ("look-ahead-m", arguments.look_ahead_m),
        ("along-track-gain-per-s", arguments.along_track_gain_per_s),
    ];
    let mut gains = gains.into_iter().filter_map(|(name, given)| Some((name, given?)));
    if arguments.controller.0.is_none() {
        return match gains.next() {
            Some((name, _)) => {
                Err(format!("--{name} is a gain of the line-of-sight laws: add --controller saturated_los")
                    .into())
            }
            None if arguments.tuned => {
                Err("--tuned searches for gains of a line-of-sight law: add --controller saturated_los"
                    .into())
            }
            None => Ok(()),
        };
    }
    if arguments.snapshots.is_some() {
        return Err("only the planner has snapshots: remove --snapshots or --controller".into());
    }
    match gains.find(|(_, given)| !(given.is_finite() && 0.0 < *given)) {
        Some((name, given)) => Err(format!("--{name} must be above 0, not {given}").into()),
        None => Ok(()),
    }
}

impl Simulate {
    /// `true` with an option that one craft alone has.
    fn steers_one(&self) -> bool {
        let other = self.controller.0.is_some() || self.guide.is_some();
        other
            || self.moos.is_some()
            || self.imc.is_some()
            || self.snapshots.is_some()
            || self.report.is_some()
    }

    /// The law with the given gains.
    fn tuning(&self, law: LosLaw) -> LosTuning {
        let usual = Parameters::default();
        LosTuning {
            law,
            gains: LosGains {
                look_ahead: self.look_ahead_m.unwrap_or(usual.los.look_ahead),
                along_track_gain: self.along_track_gain_per_s.unwrap_or(usual.los.along_track_gain),
            },
            integral_gain: usual.integral_gain,
        }
    }
}

fn summary(record: &Record) -> String {
    let mut text = format!("{}, seed {}\n", record.scenario, record.seed);
    for (name, value) in lines(record) {
        writeln!(text, "{name:<34}{value:>20}").expect("a string takes everything");
    }
    text
}
