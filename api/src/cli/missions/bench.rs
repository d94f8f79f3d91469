//! `pilotfish bench`: the scoreboard as files.

use std::{
    error::Error,
    fmt::Write as _,
    io::{self, IsTerminal as _},
    num::NonZeroUsize,
    path::PathBuf,
};

use clap::{Args, builder::RangedU64ValueParser};
use lab::{
    bench::{
        Board, Contender, TRANSIENTS, TUNING_SEED, ablations, other_plant, pareto_front, sensitivity,
        strangers::{FAULT_CRAFT, StrangersBench},
    },
    figures::pareto_chart,
    scoreboard::{
        PARETO_PICTURE, Provenance, Results, document, threads, worst_document, worst_runs, write_breakdowns,
        write_runs, write_strangers,
    },
    strangers,
};
use sim::scenario::Scenario;

use super::{
    declared::lasting,
    error::MissionError,
    files::OTHER_DIRECTORY,
    progress::{bar, show},
};
use crate::cli::{
    out_file::{NotWritten, OutFile, directory, print},
    scenarios::{NoScenario, scenario},
};

#[derive(Debug, Args)]
pub(crate) struct Bench {
    /// Directory for `benchmark.md`, `benchmark.html`, `runs.parquet` and what they show; made if it is not there.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Name or file of a scenario with a surface craft; may be given several times. All built-in ones if left out.
    #[arg(long, value_name = "SCENARIO")]
    scenario: Vec<String>,
    /// Score the seeds 1 to N.
    #[arg(
        long, value_name = "N", default_value_t = 30,
        value_parser = scored_seeds()
    )]
    seeds: u64,
    /// Find the gains of the line-of-sight laws on so many other seeds.
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u64).range(1..=1_000))]
    tuning_seeds: u64,
    /// End every mission after this many seconds, if it is not over before.
    #[arg(long, value_name = "S", value_parser = clap::value_parser!(u32).range(1..=86_400))]
    duration_s: Option<u32>,
    /// Then fly the planner at several prices of energy, and every law at every gain, where nearness has a price, over the
    /// seeds 1 to N [5 if N is left out].
    #[arg(long, value_name = "N", num_args = 0..=1, default_missing_value = "5",
        value_parser = scored_seeds())]
    pareto: Option<u64>,
    /// Then fly the planner and the laws on an Otter instead of a MEDUSA [seeds as above].
    #[arg(long, value_name = "N", num_args = 0..=1, default_missing_value = "5",
        value_parser = scored_seeds())]
    other_plant: Option<u64>,
    /// Then fly the planner without each of its parts [seeds as above].
    #[arg(long, value_name = "N", num_args = 0..=1, default_missing_value = "5",
        value_parser = scored_seeds())]
    ablations: Option<u64>,
    /// Then fly it under circumstances that it was not tuned for [seeds as above].
    #[arg(long, value_name = "N", num_args = 0..=1, default_missing_value = "5",
        value_parser = scored_seeds())]
    sensitivity: Option<u64>,
    /// Then draw N craft at random, and fly the best-tuned law and the planner, with the craft declared and not, in six
    /// missions each; and see how soon it notices breakdowns [20 if N is left out].
    #[arg(long, value_name = "N", num_args = 0..=1, default_missing_value = "20",
        value_parser = scored_seeds())]
    crafts: Option<u64>,
    /// Seed of the first of those craft. The planner's numbers were chosen on craft 1 to 24.
    #[arg(long, value_name = "SEED", default_value_t = 101, requires = "crafts", value_parser = scored_seeds())]
    first_craft: u64,
    /// Fly no scenarios.
    #[arg(long, requires = "crafts", conflicts_with_all = ["scenario", "pareto", "other_plant", "ablations", "sensitivity", "worst"])]
    crafts_only: bool,
    /// Fly the planner's ten worst runs of each scenario again, and show them with a sentence each: `worst.html` and
    /// its pictures.
    #[arg(long)]
    worst: bool,
    /// Runs at once [default: the number of processors]. It changes no result.
    #[arg(long, value_name = "N")]
    threads: Option<NonZeroUsize>,
    /// The commit that the program was built from, to be named in what is written.
    #[arg(long, value_name = "HASH")]
    commit: Option<String>,
}

/// How many seeds may be scored: gains are found on those from [`TUNING_SEED`] on.
fn scored_seeds() -> RangedU64ValueParser {
    clap::value_parser!(u64).range(1..TUNING_SEED)
}

/// Runs everything, writes the board, and prints where it is.
pub(crate) fn bench(arguments: &Bench) -> Result<(), Box<dyn Error>> {
    let scenarios = scenarios(arguments)?;
    let (first, last) = (arguments.first_craft, TUNING_SEED - 1);
    let crafts = arguments.crafts.map_or(0, |crafts| crafts.max(FAULT_CRAFT));
    if last + 1 < first + crafts {
        return Err(MissionError::CraftSeeds { first, crafts, last }.into());
    }
    // Before the missions: a directory that cannot be written should not cost them.
    directory(&arguments.out, OTHER_DIRECTORY)?;
    let file = |name: &str| out_file(arguments, name);
    let board = [
        file("runs.parquet")?,
        file("benchmark.html")?,
        file("benchmark.md")?,
    ];

    let bench = lab::bench::Bench {
        scenarios,
        contenders: Contender::all(),
        seeds: arguments.seeds,
        tuning_seeds: arguments.tuning_seeds,
        threads: arguments.threads.unwrap_or_else(threads),
    };
    let more = |stage: &str, flyers: Vec<Contender>, seeds: Option<u64>, scenarios: &[Scenario]| {
        let Some(seeds) = seeds.filter(|_| !scenarios.is_empty()) else {
            return Ok(None);
        };
        let more = lab::bench::Bench {
            contenders: flyers,
            seeds,
            scenarios: scenarios.to_vec(),
            ..bench.clone()
        };
        watched(stage, |progress| Ok(more.run(progress)?)).map(Some)
    };
    let all = &bench.scenarios;
    let transient = |scenario: &&Scenario| TRANSIENTS.contains(&scenario.name.as_str());
    let transients: Vec<Scenario> = all.iter().filter(transient).cloned().collect();
    let results = Results {
        board: if arguments.crafts_only {
            Board {
                seeds: vec![],
                matches: vec![],
            }
        } else {
            watched("every controller, every scenario", |progress| {
                Ok(bench.run(progress)?)
            })?
        },
        pareto: more(
            "nearness and energy",
            pareto_front(),
            arguments.pareto,
            &transients,
        )?,
        other_plant: more("on an Otter", other_plant(), arguments.other_plant, all)?,
        ablations: more("ablations", ablations(), arguments.ablations, all)?,
        sensitivity: more("sensitivity", sensitivity(), arguments.sensitivity, all)?,
        strangers: strangers_bench(arguments)
            .map(|bench| watched("strangers", |progress| Ok(bench.run(progress)?)))
            .transpose()?,
    };

    let provenance = Provenance {
        command: command(arguments),
        commit: arguments.commit.clone(),
        tuning_seeds: arguments.tuning_seeds,
    };
    let mut written = write_board(arguments, &results, &provenance, board)?;
    if arguments.worst {
        let bar = bar();
        let runs = worst_runs(&results.board, all, &mut |done| show(&bar, "worst runs", done))
            .map_err(MissionError::Bench)?;
        bar.finish_and_clear();
        for run in &runs {
            file(&run.file_name)?.write_text(&run.svg)?;
        }
        // Last: where it is, so is what it shows.
        let page = file("worst.html")?;
        page.write_text(&worst_document(&runs).html())?;
        written.push(page);
    }
    let names = written.iter().map(|file| format!("{}\n", file.name.display()));
    Ok(print(&names.collect::<String>())?)
}

/// Writes the board; the files that it is in.
fn write_board(
    arguments: &Bench,
    results: &Results,
    provenance: &Provenance,
    [parquet, html, markdown]: [OutFile; 3],
) -> Result<Vec<OutFile>, NotWritten> {
    let document = document(results, provenance);
    parquet.write(|out| write_runs(results, provenance, out))?;
    html.write_text(&document.html())?;
    markdown.write_text(&document.markdown())?;
    let mut written = vec![parquet, html, markdown];
    if let Some(board) = &results.pareto {
        let picture = out_file(arguments, PARETO_PICTURE)?;
        picture.write_text(&pareto_chart(board, "Nearness and energy"))?;
        written.push(picture);
    }
    if let Some(board) = &results.strangers {
        let flights = out_file(arguments, "strangers.parquet")?;
        flights.write(|out| write_strangers(board, provenance, out))?;
        let breakdowns = out_file(arguments, "breakdowns.parquet")?;
        breakdowns.write(|out| write_breakdowns(board, provenance, out))?;
        written.extend([flights, breakdowns]);
    }
    Ok(written)
}

fn out_file(arguments: &Bench, name: &str) -> Result<OutFile, NotWritten> {
    OutFile::new(&arguments.out.join(name), OTHER_DIRECTORY)
}

fn strangers_bench(arguments: &Bench) -> Option<StrangersBench> {
    Some(StrangersBench {
        first: arguments.first_craft,
        crafts: arguments.crafts?,
        duration: arguments.duration_s.map_or(strangers::DURATION, |most| {
            strangers::DURATION.min(f64::from(most))
        }),
        faults: true,
        threads: arguments.threads.unwrap_or_else(threads),
    })
}

/// Runs a bench; how far it is shows on standard error, as a bar or, where that is no terminal, in lines.
fn watched<Board>(
    stage: &str,
    run: impl FnOnce(&mut (dyn FnMut(f64) + Send)) -> Result<Board, MissionError>,
) -> Result<Board, MissionError> {
    /// Lines of a whole run.
    const LINES: f64 = 20.0;
    let bar = bar();
    let in_lines = !io::stderr().is_terminal();
    let mut lines = 0.0;
    let board = run(&mut |done| {
        show(&bar, stage, done);
        if in_lines && lines + 1.0 <= done * LINES {
            lines = (done * LINES).floor();
            eprintln!("{stage}: {:.0} %", 100.0 * done);
        }
    })?;
    bar.finish_and_clear();
    Ok(board)
}

fn scenarios(arguments: &Bench) -> Result<Vec<Scenario>, NoScenario> {
    let chosen = if arguments.scenario.is_empty() {
        let built_in = Scenario::names().into_iter().filter_map(Scenario::named);
        built_in.filter(Scenario::has_surface_craft).collect()
    } else {
        let named = arguments.scenario.iter().map(|name| scenario(name));
        named.collect::<Result<Vec<_>, _>>()?
    };
    Ok(chosen
        .into_iter()
        .map(|scenario| lasting(scenario, arguments.duration_s))
        .collect())
}

/// What makes the same board again, but for where it is written to.
fn command(arguments: &Bench) -> String {
    let mut text = if arguments.crafts_only {
        "pilotfish bench --crafts-only".to_owned()
    } else {
        format!(
            "pilotfish bench --seeds {} --tuning-seeds {}",
            arguments.seeds, arguments.tuning_seeds
        )
    };
    for (name, seeds) in [
        ("pareto", arguments.pareto),
        ("other-plant", arguments.other_plant),
        ("ablations", arguments.ablations),
        ("sensitivity", arguments.sensitivity),
        ("crafts", arguments.crafts),
    ] {
        if let Some(seeds) = seeds {
            write!(text, " --{name} {seeds}").expect("a string takes everything");
        }
    }
    if arguments.crafts.is_some() {
        write!(text, " --first-craft {}", arguments.first_craft).expect("a string takes everything");
    }
    for name in &arguments.scenario {
        write!(text, " --scenario {name}").expect("a string takes everything");
    }
    if let Some(duration) = arguments.duration_s {
        write!(text, " --duration-s {duration}").expect("a string takes everything");
    }
    text + " --out DIR"
}
