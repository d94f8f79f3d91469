//! `pilotfish compare`: one mission with every controller.

use std::{error::Error, path::PathBuf};

use clap::{Args, ValueEnum};
use lab::{
    comparison::{Comparison, Stage},
    report::ReportedRun,
};
use sim::record::Record;

use super::{
    declared::{declare, lasting},
    files::{record_files, report_file, write_report},
    progress::{bar, show},
};
use crate::cli::{declared_craft::DeclaredCraft, out_file::print, scenarios::scenario};

#[derive(Debug, Args)]
pub(crate) struct Compare {
    /// Name of a scenario (`pilotfish scenarios` lists them), or the path of a scenario file, as ./my.toml.
    scenario: String,
    #[command(flatten)]
    craft: DeclaredCraft,
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
    /// Write the record of every controller into this directory, as `<controller>.parquet`: a table with a row a second.
    /// The directory is made if it is not there.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum Format {
    /// For people.
    Table,
    /// For programs.
    Json,
}

/// Tunes the line-of-sight laws, runs all missions, prints all scores.
pub(crate) fn compare(arguments: &Compare) -> Result<(), Box<dyn Error>> {
    let scenario = lasting(scenario(&arguments.scenario)?, arguments.duration_s);
    let scenario = declare(scenario, &arguments.craft)?;
    let page = arguments.report.as_deref().map(report_file).transpose()?;
    let files = arguments.out.as_deref().map(record_files).transpose()?;
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
    // The missions are not to be had again: what one file does not take, the others still get.
    let files = files.unwrap_or_default();
    let written = files
        .iter()
        .zip(&runs)
        .map(|(file, record)| file.write(record))
        .fold(Ok(()), Result::and);
    let page = page.map_or(Ok(()), |file| write_report(&file, &reported(&comparison)));
    page.and(written)?;
    match arguments.format {
        Format::Table => Ok(print(&comparison.to_string())?),
        Format::Json => {
            let json = serde_json::to_string_pretty(&comparison).expect("strings, numbers and lists only");
            Ok(print(&(json + "\n"))?)
        }
    }
}

/// Every run, with what its controller was told.
fn reported(comparison: &Comparison) -> Vec<ReportedRun<'_>> {
    let runs = comparison.controllers.named().map(|(_, controller)| {
        let used = if controller.information.forecasts.is_empty() {
            "the present alone, at gains tuned for this scenario and seed".to_owned()
        } else {
            format!("forecasts by {}", controller.information.forecasts.join(" and "))
        };
        let current = if controller.information.current_known {
            "known"
        } else {
            "not given"
        };
        ReportedRun {
            information: format!("the same snapshots; uses {used}; current {current}"),
            ..ReportedRun::from(&controller.record)
        }
    });
    runs.into_iter().collect()
}
