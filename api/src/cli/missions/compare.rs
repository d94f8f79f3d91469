//! `pilotfish compare`: one mission with every controller.

use std::{error::Error, path::PathBuf};

use clap::{Args, ValueEnum};
use lab::{
    comparison::{Comparison, names},
    http_guide::{GUIDE, GuideUrl},
    report::{ReportedRun, report},
};

use super::run::{RecordFile, RunArguments, one_craft_unless};
use crate::cli::{
    out_file::{OutFile, directory, print, print_json},
    progress::{bar, show},
    scenarios::NameOrFile,
};

#[derive(Debug, Args)]
pub(crate) struct Compare {
    /// A built-in scenario (`pilotfish scenarios` lists them), or the path of a scenario file, such
    /// as ./my.toml.
    #[arg(value_parser = NameOrFile, hide_possible_values = true)]
    scenario: String,
    #[command(flatten)]
    run: RunArguments,
    /// Compare also the law at this address, which gets each snapshot over HTTP (docs/own-law.md),
    /// such as http://127.0.0.1:8000/.
    #[arg(long, value_name = "URL")]
    guide: Option<GuideUrl>,
    /// Format of the scores.
    #[arg(long, value_enum, default_value_t = ScoresFormat::Table)]
    format: ScoresFormat,
    /// Write an interactive report of all missions to this file.
    #[arg(long, value_name = "FILE.html")]
    report: Option<PathBuf>,
    /// Write each controller's record to this directory, as `<controller>.parquet`. It is created
    /// if missing.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum ScoresFormat {
    /// For people.
    Table,
    /// For programs.
    Json,
}

/// Tunes the line-of-sight laws or the rules, runs the missions and prints the scores.
pub(crate) fn compare(arguments: &Compare) -> Result<(), Box<dyn Error>> {
    let scenario = arguments.run.scenario(&arguments.scenario)?;
    let fits = arguments.guide.is_none() && arguments.report.is_none();
    one_craft_unless(fits, &scenario, "--guide and --report")?;
    let page = arguments.report.as_deref().map(OutFile::new).transpose()?;
    let mut files = vec![];
    if let Some(out) = &arguments.out {
        directory(out)?;
        for name in names(&scenario, arguments.guide.as_ref()) {
            files.push(RecordFile::new(&out.join(format!("{name}.parquet")), &scenario)?);
        }
    }
    let bar = bar();
    let (seed, guide) = (arguments.run.seed, arguments.guide.as_ref());
    let mut progress = |stage: &str, done| show(&bar, stage, done);
    let comparison = Comparison::run(&scenario, seed, guide, &mut progress)?;
    bar.finish_and_clear();
    // The missions took long: if one file fails, the others are still written.
    let written = files.iter().zip(&comparison.controllers);
    let written = written.map(|(file, controller)| file.write(&controller.record));
    let written = written.fold(Ok(()), Result::and);
    let page = page.map_or(Ok(()), |file| file.write_text(&report(&reported(&comparison))));
    page.and(written)?;
    match arguments.format {
        ScoresFormat::Table => Ok(print(&comparison.to_string())?),
        ScoresFormat::Json => Ok(print_json(&comparison)?),
    }
}

/// Every run, with what its controller knew.
fn reported(comparison: &Comparison) -> Vec<ReportedRun<'_>> {
    let runs = comparison.controllers.iter().map(|controller| {
        let used = if controller.name == GUIDE {
            "what a law outside of this program makes of them".to_owned()
        } else if controller.information.forecasts.is_empty() {
            "the present alone, tuned for this scenario and seed".to_owned()
        } else {
            format!("forecasts by {}", controller.information.forecasts.join(" and "))
        };
        let current = if controller.information.current_known { "known" } else { "not given" };
        ReportedRun {
            information: format!("the same snapshots; uses {used}; current {current}"),
            gains: controller.gains,
            ..ReportedRun::from(&controller.record)
        }
    });
    runs.into_iter().collect()
}
