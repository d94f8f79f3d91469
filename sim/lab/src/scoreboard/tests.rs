use std::sync::LazyLock;

use crate::bench::{AUTO, Bench, PATH};
use parquet::file::reader::{FileReader as _, SerializedFileReader};
use sim::scenario::Scenario;

use super::*;

/// Two scenarios for a minute, two seeds.
static BOARD: LazyLock<Board> = LazyLock::new(|| {
    let short = |name| Scenario::named(name).expect("exists").lasting(60.0);
    let bench = Bench {
        scenarios: ["noisy-fixes", "calm"].map(short).into(),
        contenders: Contender::all(),
        seeds: 2,
        tuning_seeds: 1,
        threads: threads(),
    };
    bench.run(&mut |_| {}).expect("runs")
});

/// The same with all that may be asked for, of one scenario for ten seconds.
static RESULTS: LazyLock<Results> = LazyLock::new(|| {
    let of = |contenders| {
        let bench = Bench {
            scenarios: vec![Scenario::named("switching").expect("exists").lasting(10.0)],
            contenders,
            seeds: 2,
            tuning_seeds: 1,
            threads: threads(),
        };
        Some(bench.run(&mut |_| {}).expect("runs"))
    };
    Results {
        board: BOARD.clone(),
        pareto: of(crate::bench::pareto_front()),
        other_plant: of(crate::bench::other_plant()),
        ablations: of(crate::bench::ablations()),
        sensitivity: of(crate::bench::sensitivity()),
        strangers: None,
    }
});

/// A board and no other.
fn alone(board: Board) -> Results {
    Results {
        board,
        pareto: None,
        other_plant: None,
        ablations: None,
        sensitivity: None,
        strangers: None,
    }
}

fn provenance() -> Provenance {
    Provenance {
        command: "pilotfish bench".to_owned(),
        commit: Some("abc1234".to_owned()),
        tuning_seeds: 1,
    }
}

/// Of those that take part in calm, each at so many times its own metric.
fn scaled(factors: &[(&str, f64)]) -> Board {
    let mut board = BOARD.clone();
    for found in &mut board.matches {
        for entry in &mut found.entries {
            let named = factors.iter().find(|(name, _)| *name == entry.contender.name);
            let rms = named.map_or(10.0, |(_, factor)| *factor);
            for flown in &mut entry.flown {
                for (score, seed) in flown.scores.iter_mut().zip([1.0, 2.0]) {
                    score.metrics.rms_m = rms * seed;
                }
            }
        }
    }
    board
}

#[test]
fn the_page_names_every_controller_its_knowledge_and_the_commit_in_both_forms() {
    let document = document(&RESULTS, &provenance());
    for text in [document.markdown(), document.html()] {
        assert!(text.contains("abc1234"));
        for name in [
            "saturated_los",
            "integral_los + paths",
            "printed_los",
            AUTO,
            PATH,
            CLAIRVOYANT,
        ] {
            assert!(text.contains(name), "{name}");
        }
        for found in &BOARD.matches {
            assert!(text.contains(&found.title));
        }
    }
}

#[test]
fn every_table_is_rectangular() {
    for block in document(&RESULTS, &provenance()).0 {
        if let Block::Table(Table { columns, rows, .. }) = block {
            assert!(!rows.is_empty());
            assert!(rows.iter().all(|row| row.len() == columns.len()));
        }
    }
}

#[test]
fn a_part_that_takes_no_part_has_a_dash_and_others_a_ratio() {
    let ablations = RESULTS.ablations.as_ref().expect("asked for");
    let Block::Table(table) = &variations::ablations(ablations)[3] else {
        panic!("a table follows its heading");
    };
    let cell = |name: &str| {
        let column = table.columns.iter().position(|column| column == name);
        table.rows[0][column.expect("is a column")].as_str()
    };
    // Nothing bounds the range in this scenario; it does hand over.
    assert!(!table.columns.iter().any(|name| name == "no range back-off"));
    assert!(cell("no preview of hand-overs").contains('['), "{table:?}");
    assert!(cell("one SCP iteration").contains('['), "{table:?}");
}

#[test]
fn a_controller_with_more_information_or_made_to_fail_never_wins() {
    let board = scaled(&[
        (PATH, 0.1),
        ("printed_los", 0.1),
        ("integral_los + paths", 0.1),
        (AUTO, 2.0),
    ]);
    for found in &board.matches {
        assert_eq!(winner(found, Metric::Rms), AUTO);
    }
}

#[test]
fn a_loss_is_shown_as_one_and_a_win_as_one() {
    let verdict_of = |auto: f64| {
        let board = scaled(&[(AUTO, auto), ("saturated_los", 1.0)]);
        let verdicts = claims::verdicts(&alone(board)).into_iter();
        let rms = "RMS distance beside the best-tuned law";
        let mut about =
            verdicts.filter(|verdict| (verdict.claim, verdict.controller.as_str()) == (rms, AUTO));
        about.next().expect("is decided")
    };
    let (won, lost) = (verdict_of(0.9), verdict_of(1.1));
    assert_eq!((won.holds, won.beside.as_str()), (true, "saturated_los"));
    assert!(won.measured.starts_with("0.900 ["), "{}", won.measured);
    assert!(
        !lost.holds && lost.measured.starts_with("1.100 ["),
        "{}",
        lost.measured
    );
}

#[test]
fn a_law_that_is_nearer_and_no_dearer_breaks_the_pareto_front_and_one_that_trades_does_not() {
    let with_law_at = |rms: f64, energy: f64| {
        let mut results = RESULTS.clone();
        let pareto = results.pareto.as_mut().expect("asked for");
        for entry in &mut pareto.matches[0].entries {
            let (near, cheap) = match entry.contender.law_flown() {
                None => (2.0, 2.0),
                Some(_) => (rms, energy),
            };
            for score in entry.flown.iter_mut().flat_map(|flown| &mut flown.scores) {
                (score.metrics.rms_m, score.metrics.energy_j) = (near, cheap);
            }
        }
        let pareto = claims::verdicts(&results).into_iter();
        let mut pareto = pareto.filter(|verdict| verdict.claim.starts_with("points of laws"));
        pareto.next().expect("is decided").holds
    };
    assert!(!with_law_at(1.0, 1.0));
    assert!(!with_law_at(1.0, 2.0) && !with_law_at(2.0, 1.0));
    assert!(with_law_at(1.0, 2.1) && with_law_at(2.1, 1.0) && with_law_at(2.0, 2.0));
}

#[test]
fn on_another_plant_the_nearest_law_is_sought_among_those_that_fly_it() {
    let mut results = RESULTS.clone();
    let other_plant = results.other_plant.as_mut().expect("asked for");
    for entry in &mut other_plant.matches[0].entries {
        let rms = if entry.contender.is_baseline() { 2.0 } else { 1.0 };
        for score in entry.flown.iter_mut().flat_map(|flown| &mut flown.scores) {
            score.metrics.rms_m = rms;
        }
    }
    let verdicts = claims::verdicts(&results).into_iter();
    let mut on_an_otter = verdicts.filter(|verdict| verdict.claim.contains("on an Otter"));
    let verdict = on_an_otter.next().expect("is decided");
    assert!(
        verdict.holds && verdict.measured.starts_with("0.500"),
        "{verdict:?}"
    );
}

#[test]
fn equals_are_named_together() {
    let board = scaled(&[(AUTO, 1.0), ("saturated_los", 1.0)]);
    assert_eq!(
        winner(&board.matches[1], Metric::Rms),
        format!("saturated_los = {AUTO}")
    );
}

#[test]
fn the_file_of_runs_has_a_row_for_every_run_and_every_bound() {
    let mut bytes = vec![];
    let results = alone(BOARD.clone());
    write_runs(&results, &provenance(), &mut bytes).expect("can be written");
    let file = SerializedFileReader::new(bytes::Bytes::from(bytes)).expect("is a Parquet file");
    let distinct = |entry: &Entry| {
        let tunings: Vec<_> = entry.flown.iter().map(|flown| flown.tuning).collect();
        (0..3).filter(|i| !tunings[..*i].contains(&tunings[*i])).count()
    };
    let entries = BOARD.matches.iter().flat_map(|found| &found.entries);
    let expected = 2 * (entries.map(distinct).sum::<usize>() + BOARD.matches.len());
    assert_eq!(
        usize::try_from(file.metadata().file_metadata().num_rows()),
        Ok(expected)
    );
}
