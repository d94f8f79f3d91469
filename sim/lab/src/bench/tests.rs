use planner::los::LosLaw;

use super::*;
use crate::tuning::grid;

fn bench(threads: usize) -> Bench {
    let short = |name| Scenario::named(name).expect("exists").lasting(60.0);
    Bench {
        scenarios: ["noisy-fixes", "calm"].map(short).into(),
        contenders: Contender::all(),
        seeds: 2,
        tuning_seeds: 1,
        threads: NonZeroUsize::new(threads).expect("positive"),
    }
}

#[test]
fn the_board_is_the_same_on_any_number_of_threads_and_progress_ends_at_one() {
    let mut seen = vec![];
    let board = bench(1).run(&mut |done| seen.push(done)).expect("runs");
    assert!(seen.is_sorted());
    assert!(0.9 < seen[seen.len() - 1]);
    assert_eq!(bench(3).run(&mut |_| {}).expect("runs"), board);
    let names = |index: usize| -> Vec<String> {
        let entries = &board.matches[index].entries;
        entries.iter().map(|entry| entry.contender.name.clone()).collect()
    };
    // Noisy fixes: knowledge of the paths helps to tell where the vehicle is. Calm: it is known.
    assert_eq!((names(0).len(), names(1).len()), (12, 8));
    for entry in board.matches.iter().flat_map(|found| &found.entries) {
        assert!(entry.flown.iter().all(|flown| flown.scores.len() == 2));
    }
}

#[test]
fn every_score_is_that_of_the_mission_flown_alone() {
    let bench = bench(2);
    let board = bench.run(&mut |_| {}).expect("runs");
    for (scenario, found) in bench.scenarios.iter().zip(&board.matches) {
        for entry in &found.entries {
            for family in Family::ALL {
                let Flown { tuning, scores } = entry.of(family);
                let record = fly(&entry.contender, *tuning, scenario, 2).expect("runs");
                assert_eq!(
                    Score::of(&record).as_ref(),
                    Some(&scores[1]),
                    "{}",
                    entry.contender.name
                );
            }
        }
    }
}

#[test]
fn no_gains_do_better_on_the_tuning_seeds_than_those_of_the_family() {
    let bench = bench(2);
    let board = bench.run(&mut |_| {}).expect("runs");
    let scenario = &bench.scenarios[1];
    for law in [LosLaw::SaturatedLos, LosLaw::Integral] {
        let entry = board.matches[1].entry(law.name()).expect("takes part");
        for family in Family::ALL {
            let value = |tuning| {
                let record = fly(&entry.contender, Some(tuning), scenario, TUNING_SEED).expect("runs");
                family.objective().of(&Score::of(&record).expect("has a craft"))
            };
            let chosen = value(entry.of(family).tuning.expect("a law has gains"));
            assert!(
                grid(law).into_iter().all(|tuning| chosen <= value(tuning)),
                "{family:?}"
            );
        }
    }
}

#[test]
fn no_controller_is_nearer_than_the_bound() {
    let board = bench(2).run(&mut |_| {}).expect("runs");
    for found in &board.matches {
        let bounds = found.bound_rms_m.as_ref().expect("no waves");
        for entry in &found.entries {
            let values = entry.values(Metric::Rms);
            assert!(bounds.iter().zip(values).all(|(bound, value)| *bound <= value));
        }
    }
}

#[test]
fn the_bound_is_that_of_the_plant_that_is_flown() {
    let short = |contenders| Bench {
        contenders,
        seeds: 1,
        scenarios: vec![Scenario::named("about-face").expect("exists").lasting(60.0)],
        ..bench(2)
    };
    let bound = |bench: &Bench| {
        bench.run(&mut |_| {}).expect("runs").matches[0]
            .bound_rms_m
            .clone()
    };
    let medusa = bound(&short(vec![Contender::law(LosLaw::SaturatedLos)])).expect("calm water");
    let otter = bound(&short(other_plant())).expect("calm water");
    // An Otter is faster.
    assert!(otter[0] < medusa[0], "{otter:?} {medusa:?}");
    // Where some fly another hull than others, nothing is bounded.
    assert_eq!(bound(&short(sensitivity())), None);
}

#[test]
fn a_planner_without_paths_forecasts_as_if_there_were_none() {
    let scenario = Scenario::named("silence-path").expect("exists").lasting(60.0);
    let blind = Scenario::named("silence").expect("exists").lasting(60.0);
    let rows = |paths, scenario: &Scenario| {
        let contender = Contender::planner("any", paths, None);
        fly(&contender, None, scenario, 1).expect("runs").rows
    };
    assert_eq!(
        rows(Paths::Uninformed, &scenario),
        rows(Paths::AsScenario, &blind)
    );
    assert_eq!(rows(Paths::Informed, &blind), rows(Paths::AsScenario, &scenario));
    assert_ne!(rows(Paths::Informed, &blind), rows(Paths::Uninformed, &blind));
}

#[test]
fn a_scenario_without_a_surface_craft_is_refused() {
    let refused = Bench {
        scenarios: vec![Scenario::named("paper-path-following").expect("exists")],
        ..bench(1)
    }
    .run(&mut |_| {});
    assert!(matches!(refused, Err(BenchError::NoSurfaceCraft { .. })));
}
