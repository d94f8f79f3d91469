//! `pilotfish campaign`: many missions of many controllers under many conditions.

use std::error::Error;
use std::io::{self, IsTerminal as _};
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use clap::{Args, Subcommand};
use clock::Clock;
use indicatif::{ProgressBar, ProgressStyle};
use lab::{
    campaign::{Campaign, CampaignFile, Directory, Manifest, Progress, Shard, jobs, replay, run, summary},
    report::ReportedRun,
};

use crate::cli::out_file::{OutFile, print, print_json, print_rows, visible};

#[cfg(feature = "nats")]
mod cluster;

#[cfg(feature = "nats")]
pub(crate) use cluster::{WorkerFlags, work};

/// Time between two lines of progress, where no bar is drawn.
const LINE_EVERY: Duration = Duration::from_secs(30);

#[derive(Debug, Subcommand)]
pub(crate) enum CampaignCommand {
    /// Fly a campaign, or continue one. Ctrl-C and kill lose only the runs under way.
    Run(Fly),
    /// Fly one run again, check that its row is the same to the bit, and write its page.
    Replay(ReplayRun),
    /// Merge the shards of a campaign.
    Merge(Merge),
    /// Print the SHA-256 of all rows except measured times. Equal results have equal digests.
    Digest(Flown),
    /// Print the JSON Schema of campaign files.
    Schema,
    /// Send a campaign to workers over NATS JetStream, and print its id.
    #[cfg(feature = "nats")]
    Submit(cluster::Submit),
    /// Show the progress of a submitted campaign until it is over.
    #[cfg(feature = "nats")]
    Watch(cluster::Submitted),
    /// Collect the rows of a submitted campaign into a directory.
    #[cfg(feature = "nats")]
    Collect(cluster::Collect),
}

#[derive(Debug, Args)]
pub(crate) struct Fly {
    /// The campaign file, TOML (docs/campaigns.md).
    file: PathBuf,
    /// Directory for the rows; created if missing. If it holds the same campaign, that is
    /// continued. [default: the campaign's name]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Runs in parallel; the results do not depend on it. [default: the number of processors]
    #[arg(long, value_name = "N")]
    jobs: Option<NonZeroUsize>,
    /// Fly only this part, such as 1/3 for the first of three (for job arrays). `campaign merge`
    /// merges the parts.
    #[arg(long, value_name = "I/N", default_value_t = Shard::WHOLE)]
    shard: Shard,
    /// Show what would be flown, and fly nothing.
    #[arg(long)]
    dry_run: bool,
}

#[derive(Debug, Args)]
pub(crate) struct Flown {
    /// Directory of a campaign that was flown.
    dir: PathBuf,
}

#[derive(Debug, Args)]
pub(crate) struct ReplayRun {
    /// Directory of a campaign that was flown.
    dir: PathBuf,
    /// Number of the run: column `run` of runs.parquet.
    run: u64,
    /// File for the page [default: replay-RUN.html in the directory].
    #[arg(long, value_name = "FILE.html")]
    report: Option<PathBuf>,
}

#[derive(Debug, Args)]
pub(crate) struct Merge {
    /// Directories of the shards.
    #[arg(required = true)]
    parts: Vec<PathBuf>,
    /// Directory for the merged rows; created if missing.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
}

pub(crate) fn campaign(command: &CampaignCommand) -> Result<(), Box<dyn Error>> {
    match command {
        CampaignCommand::Run(arguments) => fly(arguments),
        CampaignCommand::Replay(arguments) => fly_again(arguments),
        CampaignCommand::Merge(Merge { parts, out }) => {
            let parts = parts.iter().map(|part| Directory::open(part));
            let parts = parts.collect::<Result<Vec<_>, _>>()?;
            let (whole, rows) = Directory::merge(out, &parts)?;
            print_rows(whole.path(), rows.len(), &rows.digest())
        }
        CampaignCommand::Digest(Flown { dir }) => {
            let rows = Directory::open(dir)?.rows()?;
            Ok(print(&format!("{}\n", rows.digest()))?)
        }
        CampaignCommand::Schema => Ok(print_json(&CampaignFile::schema())?),
        #[cfg(feature = "nats")]
        CampaignCommand::Submit(arguments) => cluster::send(arguments),
        #[cfg(feature = "nats")]
        CampaignCommand::Watch(arguments) => cluster::watch_until_over(arguments),
        #[cfg(feature = "nats")]
        CampaignCommand::Collect(arguments) => cluster::fetch_all(arguments),
    }
}

fn fly(arguments: &Fly) -> Result<(), Box<dyn Error>> {
    let campaign = Campaign::read(&arguments.file)?;
    if arguments.dry_run {
        return Ok(print(&outline(&campaign))?);
    }
    let out = arguments.out.as_deref().unwrap_or(Path::new(&campaign.file.name));
    let directory = Directory::create(out, Manifest::of(&campaign, arguments.shard))?;
    let mut display = ProgressDisplay::new();
    let jobs = arguments.jobs.unwrap_or_else(jobs);
    let mut show = |progress| display.show(progress);
    let rows = run(&campaign, &directory, jobs, &mut show)?;
    display.end();
    print_rows(directory.path(), rows.len(), &rows.digest())?;
    Ok(print(&summary(&campaign, &rows))?)
}

/// The runs of a campaign: a line for each scenario with its craft and controllers.
fn outline(campaign: &Campaign) -> String {
    let mut lines: Vec<(&str, &[usize], Vec<&str>)> = vec![];
    for case in &campaign.cases {
        let (name, flying) = (case.scenario.name.as_str(), &case.controllers[..]);
        match lines.last_mut() {
            Some((scenario, before, craft)) if *scenario == name && *before == flying => {
                craft.push(&case.craft);
            }
            _ => lines.push((name, flying, vec![&case.craft])),
        }
    }
    let described = lines.into_iter().map(|(scenario, flying, craft)| {
        let name = |&controller: &usize| campaign.controllers[controller].name.as_str();
        let names = flying.iter().map(name).collect::<Vec<_>>().join(", ");
        let craft = match &craft[..] {
            [one] => (*one).to_owned(),
            [first, .., last] => format!("{} craft from {first} to {last}", craft.len()),
            [] => String::new(),
        };
        format!("{scenario} ({craft}): {names}\n")
    });
    let described: String = described.collect();
    let tuning = campaign.file.tuning.as_ref();
    let n_tuning = tuning.map_or(0, |tuning| tuning.replicates);
    let (name, title) = (&campaign.file.name, &campaign.file.title);
    let (replicates, n_runs) = (campaign.file.replicates, campaign.n_runs());
    format!(
        "{name}: {title}\n{described}{replicates} replicates of each, and {n_tuning} to find gains; {n_runs} runs at most\n"
    )
}

fn fly_again(arguments: &ReplayRun) -> Result<(), Box<dyn Error>> {
    let directory = Directory::open(&arguments.dir)?;
    let file = format!("{}/campaign.json", arguments.dir.display());
    let campaign = directory.manifest.campaign(&file)?;
    let number = arguments.run;
    let page = arguments.report.clone();
    let page = page.unwrap_or_else(|| arguments.dir.join(format!("replay-{number}.html")));
    let file = OutFile::new(&page)?;
    let flown = replay(&campaign, &directory.rows()?, number)?;
    let reported = ReportedRun {
        information: flown.information.clone(),
        gains: flown.gains,
        ..ReportedRun::from(&flown.record)
    };
    file.write_text(&lab::report::report(&[reported]))?;
    let (ran_by, this) = (&directory.manifest.program, env!("CARGO_PKG_VERSION"));
    let outcome = if flown.same {
        "the same row, to the bit".to_owned()
    } else if ran_by == this {
        "NOT the same row".to_owned()
    } else {
        format!("NOT the same row (flown by version {ran_by}; this is {this})")
    };
    let (controller, scenario) = (&flown.controller, &flown.record.scenario);
    let (replicate, page) = (flown.run.condition.replicate, page.display());
    print(&format!("run {number}: {controller} in {scenario}, replicate {replicate}: {outcome}\n{page}\n"))?;
    if !flown.same {
        return Err("the run differs from its row".into());
    }
    Ok(())
}

/// Shows the progress of a campaign: a bar, or a line now and then where there is no terminal.
struct ProgressDisplay {
    bar: ProgressBar,
    clock: Clock,
    began: Instant,
    /// Time at which the runs of this process began, after the search for gains.
    flying_since: Option<Instant>,
    said: Option<Instant>,
    in_lines: bool,
}

impl ProgressDisplay {
    fn new() -> Self {
        let clock = Clock::machine();
        let style = ProgressStyle::with_template("{wide_bar} {msg}").expect("the template is a constant");
        Self {
            bar: ProgressBar::new(1).with_style(style),
            began: clock.now(),
            clock,
            flying_since: None,
            said: None,
            in_lines: !io::stderr().is_terminal(),
        }
    }

    fn show(&mut self, progress: Progress) {
        let tuning = progress.tuned.0 < progress.tuned.1;
        let (done, of) = if tuning { progress.tuned } else { progress.runs };
        let words = if tuning {
            format!("tuning before the runs: {done} of {of} searches for gains")
        } else {
            let since = *self.flying_since.get_or_insert_with(|| self.clock.now());
            let seconds = self.clock.since(since).as_secs_f64();
            let (rate, left) = (progress.flown as f64 / seconds.max(1e-3), (of - done.min(of)) as f64);
            let time_left = if progress.flown == 0 { "?".to_owned() } else { minutes(left / rate) };
            let failed = progress.failed;
            format!("{done} of {of} runs, {rate:.2}/s, {time_left} left, {failed} failed")
        };
        self.bar.set_length(of.max(1));
        self.bar.set_position(done);
        self.bar.set_message(words.clone());
        let due = self.said.is_none_or(|said| LINE_EVERY <= self.clock.since(said)) || done == of;
        if self.in_lines && due {
            self.said = Some(self.clock.now());
            eprintln!("{}", visible(&words));
        }
    }

    fn end(&self) {
        self.bar.finish_and_clear();
        if self.in_lines {
            eprintln!("took {}", minutes(self.clock.since(self.began).as_secs_f64()));
        }
    }
}

fn minutes(seconds: f64) -> String {
    if seconds < 90.0 {
        format!("{seconds:.0} s")
    } else if seconds < 5400.0 {
        format!("{:.0} min", seconds / 60.0)
    } else {
        format!("{:.1} h", seconds / 3600.0)
    }
}
