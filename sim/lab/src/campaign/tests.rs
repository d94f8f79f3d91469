//! The same rows however a campaign is flown; mistakes are named; and what the bench scores, a campaign scores.

use std::{fs, num::NonZeroUsize, path::Path};

use tempfile::TempDir;

use super::{
    Campaign, CampaignError, Directory, DirectoryError, Manifest, Shard, design::World, replay, rows::Rows,
    run,
};
use crate::bench::{AUTO, Bench, Contender, Metric, PATH};
use sim::scenario::Scenario;

/// Two scenarios, two craft, three controllers, a drawn parameter, gains for two objectives; a minute each.
const SMALL: &str = r#"
schema_version = "1"
name = "small"
title = "whether anything depends on how it is flown"
seed = 7
scenarios = ["paper-tracking", "noisy-fixes"]
duration_s = 40
replicates = 3
craft = ["scenario", "otter"]

[[parameters]]
key = "surface_craft.speed_mps"
uniform = [0.1, 0.3]

[tuning]
replicates = 1
objectives = ["rms_m", "energy_j"]

[[controllers]]
name = "mpc auto"
planner = {}

[[controllers]]
name = "saturated_los"
law = { name = "saturated_los" }

[[controllers]]
name = "service"
law = { name = "saturated_los_tracker_frame", gains = { look_ahead_m = 5, along_track_gain_per_s = 0.15 } }
"#;

fn campaign(text: &str) -> Campaign {
    Campaign::parse(text, "small.toml", Path::new(".")).expect("is a campaign")
}

fn refused(text: &str) -> String {
    Campaign::parse(text, "small.toml", Path::new("."))
        .expect_err("is refused")
        .to_string()
}

fn flown(campaign: &Campaign, path: &Path, jobs: usize, shard: Shard) -> (Directory, Rows) {
    let directory =
        Directory::create(path, Manifest::of(campaign, Path::new("."), shard)).expect("is a directory");
    let jobs = NonZeroUsize::new(jobs).expect("positive");
    let rows = run(campaign, &directory, jobs, &mut |_| {}).expect("flies");
    (directory, rows)
}

#[test]
fn rows_are_the_same_on_one_thread_and_two_after_a_break_and_in_parts() {
    let (campaign, folder) = (campaign(SMALL), TempDir::new().expect("is a folder"));
    let at = |name: &str| folder.path().join(name);
    let (directory, whole) = flown(&campaign, &at("one"), 1, Shard::WHOLE);
    assert!(
        whole
            .words("failure")
            .expect("a column")
            .iter()
            .all(|words| words.is_empty())
    );
    assert!(directory.is_collected() && !at("one").join("chunks").exists());
    assert_eq!(directory.rows().expect("are there").digest(), whole.digest());

    assert_eq!(
        flown(&campaign, &at("two"), 2, Shard::WHOLE).1.digest(),
        whole.digest()
    );

    // Broken off: some chunks and gains are there, another is half written.
    let begun = Directory::create(
        &at("broken"),
        Manifest::of(&campaign, Path::new("."), Shard::WHOLE),
    )
    .expect("is new");
    flown(&campaign, &at("again"), 2, Shard::new(1, 2));
    let chunks = campaign.chunks();
    for chunk in Shard::new(1, 2).chunks(&chunks).iter().skip(1) {
        // What a process that was killed had kept: the rows of its whole chunks.
        let part = Directory::open(&at("again"))
            .expect("is there")
            .rows()
            .expect("are there");
        let runs: Vec<u64> = (chunk.first..chunk.first + chunk.count)
            .flat_map(|replicate| {
                campaign.runs_in(World {
                    arena: chunk.arena,
                    replicate,
                    tuning: false,
                })
            })
            .map(|run| run.number)
            .collect();
        let mut kept = Rows::default();
        for rows in runs.iter().filter_map(|&number| part.only(number)) {
            kept.append(rows).expect("the same columns");
        }
        begun.keep_chunk(chunk.number, &kept).expect("is kept");
    }
    fs::write(at("broken").join("chunks").join(".9.parquet.1.part"), b"PAR1").expect("is written");
    assert!(matches!(begun.rows(), Err(DirectoryError::Unfinished(_))));
    let mut first = None;
    let rows = run(&campaign, &begun, NonZeroUsize::MIN, &mut |progress| {
        first.get_or_insert(progress.runs);
    });
    assert_eq!(rows.expect("goes on").digest(), whole.digest());
    let (done, of) = first.expect("was told");
    assert!(0 < done && done < of, "{done} of {of}");

    for n in [3, 7] {
        let parts: Vec<Directory> = (1..=n)
            .map(|index| {
                flown(
                    &campaign,
                    &at(&format!("{index} of {n}")),
                    2,
                    Shard::new(index, n),
                )
                .0
            })
            .collect();
        let (_, merged) = Directory::merge(&at(&format!("merged {n}")), &parts).expect("merges");
        assert_eq!(merged.digest(), whole.digest(), "{n} parts");
        let missing = Directory::merge(&at("incomplete"), &parts[1..]).expect_err("a part is missing");
        assert!(missing.to_string().contains("each is needed once"), "{missing}");
    }
}

#[test]
fn all_controllers_of_a_world_have_its_seed_and_its_parameters_and_worlds_differ() {
    let (campaign, folder) = (campaign(SMALL), TempDir::new().expect("is a folder"));
    let (_, rows) = flown(&campaign, folder.path(), 2, Shard::WHOLE);
    let cell = |name: &str, i: usize| rows.numbers(name).expect("a column")[i];
    let mut speeds = vec![];
    for i in 0..rows.len() {
        for k in 0..i {
            let same_world = cell("replicate", i) == cell("replicate", k);
            assert_eq!(cell("seed", i) == cell("seed", k), same_world);
            let speed = |i| cell("param.surface_craft.speed_mps", i);
            assert_eq!(speed(i) == speed(k), same_world);
        }
        speeds.push(cell("param.surface_craft.speed_mps", i).expect("drawn"));
    }
    assert!(speeds.iter().all(|speed| (0.1..=0.3).contains(speed)));
    // A parameter is flown, and not only written down: a faster start is another mission.
    let rms = rows.numbers("rms_m").expect("a column");
    assert!(rms.windows(2).any(|pair| pair[0] != pair[1]));
    // Both craft fly, and no world that gains are found in is scored.
    let crafts = rows.words("craft").expect("a column");
    assert!(crafts.iter().any(|craft| craft == "otter") && crafts.iter().any(|craft| craft == "scenario"));
    for arena in 0..campaign.arenas.len() {
        for world in campaign.tuning_worlds(arena) {
            let scored = (0..campaign.file.replicates).map(|replicate| World {
                arena,
                replicate,
                tuning: false,
            });
            assert!(
                scored
                    .map(|scored| campaign.seed(scored))
                    .all(|seed| seed != campaign.seed(world))
            );
        }
    }
}

#[test]
fn every_number_of_a_run_leads_to_that_run_and_a_replay_is_the_same_to_the_bit() {
    let (campaign, folder) = (campaign(SMALL), TempDir::new().expect("is a folder"));
    let all = campaign.chunks().into_iter().flat_map(|chunk| {
        let worlds = (chunk.first..chunk.first + chunk.count).map(move |replicate| World {
            arena: chunk.arena,
            replicate,
            tuning: false,
        });
        worlds
            .flat_map(|world| campaign.runs_in(world))
            .collect::<Vec<_>>()
    });
    let all: Vec<_> = all.collect();
    assert_eq!(all.len() as u64, campaign.n_runs());
    for (number, run) in (0..).zip(&all) {
        assert_eq!((run.number, campaign.run(number)), (number, Some(*run)));
    }
    assert_eq!(campaign.run(campaign.n_runs()), None);

    let (_, rows) = flown(&campaign, folder.path(), 2, Shard::WHOLE);
    let runs = rows.numbers("run").expect("a column");
    for i in [0, 1, rows.len() / 2, rows.len() - 1] {
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a run's number"
        )]
        let number = runs[i].expect("numbered") as u64;
        let again = replay(&campaign, &rows, number).expect("flies");
        assert!(again.same, "run {number}");
        assert_eq!(again.controller, rows.words("controller").expect("a column")[i]);
    }
    assert!(replay(&campaign, &rows, campaign.n_runs()).is_err());
}

#[test]
fn a_directory_of_another_campaign_is_refused_and_stays_as_it_is() {
    let folder = TempDir::new().expect("is a folder");
    let one = campaign(SMALL);
    Directory::create(folder.path(), Manifest::of(&one, Path::new("."), Shard::WHOLE)).expect("is new");
    let before = fs::read(folder.path().join("campaign.json")).expect("is there");
    let other = campaign(&SMALL.replace("seed = 7", "seed = 8"));
    for manifest in [
        Manifest::of(&other, Path::new("."), Shard::WHOLE),
        Manifest::of(&one, Path::new("."), Shard::new(1, 2)),
    ] {
        let refused = Directory::create(folder.path(), manifest).expect_err("is another");
        assert!(
            refused.to_string().contains("holds another campaign"),
            "{refused}"
        );
    }
    assert_eq!(
        fs::read(folder.path().join("campaign.json")).expect("is there"),
        before
    );
    assert!(matches!(
        Directory::open(Path::new("/nowhere")),
        Err(DirectoryError::NotOne(_))
    ));
}

#[test]
fn a_mistake_is_named_with_its_line_its_member_and_what_would_do() {
    for (right, wrong, says) in [
        ("seed = 7", "seed = -7", "small.toml:5: seed: "),
        (
            "replicates = 3",
            "replicates = 0",
            "small.toml:8: replicates: 0 is outside 1 to 1000000",
        ),
        (
            "duration_s = 40",
            "duration_s = 1e9",
            "small.toml:7: duration_s: 1000000000 is outside",
        ),
        (
            "duration_s = 40",
            "duration = 40",
            "small.toml:7: duration: unknown field `duration`",
        ),
        (
            "\"noisy-fixes\"]",
            "\"noisy\"]",
            "scenarios[1]: there is no scenario \"noisy\", only paper-path-following",
        ),
        (
            "\"noisy-fixes\"]",
            "\"paper-path-following\"]",
            "has no surface craft to score",
        ),
        (
            "uniform = [0.1, 0.3]",
            "uniform = [0.3, 0.1]",
            "parameters[0].uniform: [0.3, 0.1] are not two limits",
        ),
        (
            "uniform = [0.1, 0.3]",
            "",
            "parameters[0].uniform: give either uniform or choice",
        ),
        (
            "uniform = [0.1, 0.3]",
            "uniform = [0.1, 30]",
            "parameters[0].key: surface_craft.speed_mps = 30 does not fit into paper-tracking",
        ),
        (
            "key = \"surface_craft.speed_mps\"",
            "key = \"surface_craft.sped\"",
            "parameters[0].key: surface_craft.sped = 0.1 does not fit",
        ),
        (
            "name = \"service\"",
            "name = \"mpc auto\"",
            "controllers[2].name: \"mpc auto\" is the name of two",
        ),
        (
            "planner = {}",
            "",
            "controllers[0].planner: give either planner or law",
        ),
        ("planner = {}", "planner = {scp = 3}", "unknown field `scp`"),
        (
            "name = \"saturated_los\" }",
            "name = \"straight\" }",
            "controllers[1].law.name: there is no law \"straight\", only saturated_los",
        ),
        (
            "[tuning]\nreplicates = 1\nobjectives = [\"rms_m\", \"energy_j\"]",
            "",
            "there is no [tuning]",
        ),
        ("replicates = 1\n", "replicates = 1\nfirst_seed = 2\n", ""),
    ] {
        assert!(SMALL.contains(right), "{right}");
        let text = SMALL.replacen(right, wrong, 1);
        if says.is_empty() {
            campaign(&text);
        } else {
            let message = refused(&text);
            assert!(message.contains(says), "{message}\nshould say {says}");
        }
    }
    let unknown = format!("{SMALL}\n[report]\nmetrics = [\"rms_m\", \"rms\"]\n");
    assert!(
        refused(&unknown).contains("report.metrics[1]: there is no column \"rms\", only rms_m"),
        "{}",
        refused(&unknown)
    );
    let overlapping = SMALL
        .replace("seed = 7", "first_seed = 1")
        .replace("replicates = 1\n", "replicates = 1\nfirst_seed = 3\n");
    assert!(
        refused(&overlapping).contains("are scored too"),
        "{}",
        refused(&overlapping)
    );
    assert!(matches!(
        Campaign::read(Path::new("/nowhere.toml")),
        Err(CampaignError::Unreadable { .. })
    ));
}

#[test]
fn a_campaign_scores_what_the_bench_scores() {
    let text = r#"
schema_version = "1"
name = "board"
title = "the bench"
scenarios = ["paper-tracking", "switching"]
duration_s = 60
replicates = 2
first_seed = 1
[tuning]
replicates = 2
first_seed = 1001
objectives = ["rms_m", "energy_j", "heading_travel_rad"]
[[controllers]]
name = "saturated_los"
law = { name = "saturated_los" }
[[controllers]]
name = "mpc auto"
planner = {}
[[controllers]]
name = "mpc path"
paths = "known"
planner = {}
"#;
    let (campaign, folder) = (campaign(text), TempDir::new().expect("is a folder"));
    let (_, rows) = flown(&campaign, folder.path(), 2, Shard::WHOLE);
    let all = Contender::all();
    let contenders = ["saturated_los", AUTO, PATH].map(|name| {
        all.iter()
            .find(|contender| contender.name == name)
            .expect("is one")
            .clone()
    });
    let scenarios =
        ["paper-tracking", "switching"].map(|name| Scenario::named(name).expect("exists").lasting(60.0));
    let board = Bench {
        scenarios: scenarios.to_vec(),
        contenders: contenders.to_vec(),
        seeds: 2,
        tuning_seeds: 2,
        threads: NonZeroUsize::MIN,
    }
    .run(&mut |_| {})
    .expect("runs");
    let words = |name: &str, i: usize| rows.words(name).expect("a column")[i].clone();
    let mut compared = 0;
    for found in &board.matches {
        for entry in &found.entries {
            for metric in Metric::ALL {
                let Some(column) = rows.numbers(metric.name()) else {
                    continue;
                };
                let expected = entry.values(metric);
                let objective = metric.family().objective().name();
                let is_it = |i: &usize| {
                    let objectives = words("objectives", *i);
                    words("scenario", *i) == found.scenario
                        && words("controller", *i) == entry.contender.name
                        && (objectives.is_empty() || objectives.split(' ').any(|name| name == objective))
                };
                let values: Vec<f64> = (0..rows.len()).filter(is_it).filter_map(|i| column[i]).collect();
                if metric != Metric::TimeToNear {
                    assert_eq!(
                        values,
                        expected,
                        "{} {} {}",
                        found.scenario,
                        entry.contender.name,
                        metric.name()
                    );
                    compared += values.len();
                }
            }
        }
        let bounds = rows.numbers("bound_rms_m").expect("a column");
        let expected = found.bound_rms_m.clone().expect("is known");
        for i in (0..rows.len()).filter(|&i| words("scenario", i) == found.scenario) {
            let seed = rows.numbers("seed").expect("a column")[i].expect("has one");
            assert_eq!(bounds[i], Some(expected[usize::from(seed > 1.5)]));
        }
    }
    assert!(compared >= 2 * 3 * 4 * 2, "{compared}");
}

#[test]
fn a_drawn_craft_that_is_not_declared_to_the_planner_is_another_flight_of_the_same_world() {
    let craft = "craft = [{ random = { first = 7, count = 1 } }, { random = { first = 7, count = 1, declared = false } }]";
    let text = SMALL
        .replace("craft = [\"scenario\", \"otter\"]", craft)
        .replace(", \"noisy-fixes\"", "");
    let (campaign, folder) = (campaign(&text), TempDir::new().expect("is a folder"));
    let (_, rows) = flown(&campaign, folder.path(), 2, Shard::WHOLE);
    let words = |name: &str, i: usize| rows.words(name).expect("a column")[i].clone();
    let planner = |craft: &str| -> Vec<Option<f64>> {
        let is_it = |i: &usize| words("craft", *i) == craft && words("controller", *i) == "mpc auto";
        let rms = rows.numbers("rms_m").expect("a column");
        (0..rows.len()).filter(is_it).map(|i| rms[i]).collect()
    };
    let (declared, undeclared) = (planner("random 7"), planner("random 7, undeclared"));
    assert_eq!((declared.len(), undeclared.len()), (3, 3));
    assert!(declared.iter().chain(&undeclared).all(Option::is_some));
    assert_ne!(declared, undeclared);
}
