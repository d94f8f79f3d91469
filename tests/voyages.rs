//! Sails voyages of many seeds, and prints their results.
//!
//! `voyages --seeds 1000 --first 1 --duration 300`; one voyage with its newest events: `--seed 7`.

use std::{collections::BTreeMap, process::ExitCode, time::Instant};

use clap::Parser;
use tests::voyage::{self, Course, Kind, Voyage, Wire, sail, sail_all};

#[derive(Debug, Parser)]
struct Arguments {
    /// Number of voyages.
    #[arg(long, default_value_t = 200)]
    seeds: u64,
    /// Seed of the first.
    #[arg(long, default_value_t = 1)]
    first: u64,
    /// One voyage alone.
    #[arg(long)]
    seed: Option<u64>,
    /// Simulated time of each, s.
    #[arg(long, default_value_t = 240.0)]
    duration: f64,
    /// Without faults.
    #[arg(long)]
    nominal: bool,
    /// The boat's wire: mavlink, moos or imc.
    #[arg(long, default_value = "mavlink", value_parser = wire)]
    wire: Wire,
    /// Displays after each fault, a line of JSON a look, for `tests/browser/shown.mjs`.
    #[arg(long)]
    shown: bool,
    /// Two services share a PostgreSQL database; else in every tenth voyage.
    #[arg(long)]
    shared: Option<bool>,
    /// Ends after the first voyage that breaks a claim.
    #[arg(long)]
    until_broken: bool,
    /// Largest number of threads.
    #[arg(long)]
    jobs: Option<usize>,
}

fn wire(name: &str) -> Result<Wire, String> {
    match name {
        "mavlink" => Ok(Wire::Mavlink),
        "moos" => Ok(Wire::Moos),
        "imc" => Ok(Wire::Imc),
        _ => Err("mavlink, moos or imc".to_owned()),
    }
}

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    let course = Course {
        duration_s: arguments.duration,
        is_nominal: arguments.nominal,
        is_shared: arguments.shared,
        wire: arguments.wire,
        ..Course::default()
    };
    if arguments.shown {
        for kind in Kind::SHOWN {
            let (only, is_shared) = (Some(kind), Some(false));
            let alone = Course { only, is_shared, ..course };
            for shown in sail(arguments.first, alone).shown {
                println!("{}", serde_json::to_string(&shown).expect("is JSON"));
            }
        }
        return ExitCode::SUCCESS;
    }
    if let Some(seed) = arguments.seed {
        let voyage = sail(seed, course);
        println!("{}digest {:016x}", voyage.told(), voyage.digest);
        return ExitCode::from(u8::from(voyage.broken.is_some()));
    }
    let began = Instant::now();
    let seeds = arguments.first..arguments.first + arguments.seeds;
    let sailed = sail_all(seeds, course, arguments.jobs, |voyage| {
        let is_broken = voyage.broken.is_some();
        if is_broken {
            println!("{}", voyage.told());
        }
        !(is_broken && arguments.until_broken)
    });
    summary(&sailed, began.elapsed().as_secs_f64())
}

fn summary(sailed: &[Voyage], took_s: f64) -> ExitCode {
    let (mut faults, mut claims) = (BTreeMap::<Kind, u64>::new(), BTreeMap::<&str, u64>::new());
    for voyage in sailed {
        for (kind, n) in &voyage.faults {
            *faults.entry(*kind).or_default() += n;
        }
        for (name, n) in &voyage.claims {
            *claims.entry(name).or_default() += n;
        }
    }
    let simulated: f64 = sailed.iter().map(|voyage| voyage.duration_s).sum();
    println!("| fault | times |\n|---|--:|");
    for (kind, n) in faults {
        println!("| {kind} | {n} |");
    }
    println!("\n| claim | checked | |\n|---|--:|---|");
    for (name, text) in voyage::claims() {
        println!("| {name} | {} | {text} |", claims.get(name).copied().unwrap_or(0));
    }
    let broken = sailed.iter().filter(|voyage| voyage.broken.is_some());
    let broken: Vec<u64> = broken.map(|voyage| voyage.seed).collect();
    let sum = |index: usize| sailed.iter().map(|voyage| voyage.steered_s[index]).sum::<f64>();
    println!(
        "\nreferences were sent for {:.0} s, of which {:.1} % without a reservation",
        sum(0),
        100.0 * sum(1) / sum(0)
    );
    println!(
        "\n{} voyages, {simulated:.0} simulated seconds in {took_s:.1} s: {:.0} to one; broken: {broken:?}",
        sailed.len(),
        simulated / took_s
    );
    ExitCode::from(u8::from(!broken.is_empty()))
}
