//! Rows are the same on all ways of flying, and equal missions flown alone; mistakes are named.

use std::{fs, num::NonZeroUsize, path::Path, sync::OnceLock};

use tempfile::TempDir;

use planner::{los::LosGains, parameters::Parameters};
use sim::{
    guide::{Guide, LosGuide, MpcGuide},
    metrics::Metrics,
    mission,
    scenario::Scenario,
};

use super::design::{Chunk, Condition};
use super::file::Objective;
use super::fly::fly;
use super::grid::Setting;
use super::rows::{LEARNT, Rows};
use super::score::Score;
use super::tune::tune;
use super::{
    Campaign, CampaignError, Directory, DirectoryError, Manifest, ScenarioFiles, Shard, replay, run,
};

/// Two scenarios, two craft, three controllers, a drawn parameter, two objectives; a minute each.
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
    Campaign::parse(text, "small.toml", ScenarioFiles::default()).expect("is a campaign")
}

fn refused(text: &str) -> String {
    Campaign::parse(text, "small.toml", ScenarioFiles::default()).expect_err("is refused").to_string()
}

fn flown(campaign: &Campaign, path: &Path, jobs: usize, shard: Shard) -> (Directory, Rows) {
    let directory = Directory::create(path, Manifest::of(campaign, shard)).expect("is a directory");
    let jobs = NonZeroUsize::new(jobs).expect("positive");
    let rows = run(campaign, &directory, jobs, &mut |_| {}).expect("flies");
    (directory, rows)
}

/// [`SMALL`] and its rows, flown once for all tests.
fn small() -> &'static (Campaign, Rows) {
    static FLOWN: OnceLock<(Campaign, Rows)> = OnceLock::new();
    FLOWN.get_or_init(|| {
        let (campaign, folder) = (campaign(SMALL), TempDir::new().expect("is a folder"));
        let (_, rows) = flown(&campaign, folder.path(), 2, Shard::WHOLE);
        (campaign, rows)
    })
}

#[test]
fn a_directory_of_another_campaign_is_refused_and_stays_as_it_is() {
    let folder = TempDir::new().expect("is a folder");
    let one = campaign(SMALL);
    Directory::create(folder.path(), Manifest::of(&one, Shard::WHOLE)).expect("is new");
    let before = fs::read(folder.path().join("campaign.json")).expect("is there");
    let other = campaign(&SMALL.replace("seed = 7", "seed = 8"));
    for (campaign, shard) in [(&other, Shard::WHOLE), (&one, Shard { index: 1, of: 2 })] {
        let refused = Directory::create(folder.path(), Manifest::of(campaign, shard));
        let refused = refused.expect_err("is another").to_string();
        assert!(refused.contains("holds another campaign"), "{refused}");
    }
    let after = fs::read(folder.path().join("campaign.json")).expect("is there");
    assert_eq!(after, before);
    let nowhere = Directory::open(Path::new("/nowhere"));
    assert!(matches!(nowhere, Err(DirectoryError::NotOne(_))));
}

/// Mistakes in [`SMALL`]: what it says | what is written instead | what the refusal says.
const MISTAKES: &str = r#"
seed = 7 | seed = -7 | small.toml:5: seed:
replicates = 3 | replicates = 0 | small.toml:8: replicates: 0 is outside 1 to 1000000
duration_s = 40 | duration_s = 1e9 | small.toml:7: duration_s: 1000000000 is outside
duration_s = 40 | duration = 40 | small.toml:7: duration: unknown field `duration`
"noisy-fixes"] | "noisy"] | scenarios[1]: there is no scenario "noisy", only paper-path-following
"noisy-fixes"] | "paper-tracking"] | scenarios[1]: paper-tracking is the second with the name paper-tracking
"noisy-fixes"] | "paper-path-following"] | has no surface craft to score
uniform = [0.1, 0.3] | uniform = [0.3, 0.1] | parameters[0].uniform: [0.3, 0.1] are not two limits
uniform = [0.1, 0.3] |  | parameters[0].uniform: give either uniform or choice
uniform = [0.1, 0.3] | uniform = [0.1, 30] | parameters[0].key: surface_craft.speed_mps = 30 does not fit into paper
surface_craft.speed_mps | surface_craft.sped | parameters[0].key: surface_craft.sped = 0.1 does not fit
name = "service" | name = "mpc auto" | controllers[2].name: "mpc auto" is the name of two
planner = {} |  | controllers[0].planner: give one of planner, law and guide
planner = {} | planner = {scp = 3} | unknown field `scp`
planner = {} | planner = {energy_weight = 1} | unknown field `energy_weight`, expected one of
planner = {} | planner = {energy_weight = 1} | `energy_weight_per_j`
planner = {} | planner = { parameters.estimate.gates = 9.2 } | there is no tuned number estimate.gates
name = "saturated_los" } | name = "straight" } | controllers[1].law.name: there is no law "straight", only saturated_los
[tuning] | [report]\nmetrics = ["rms_m", "rms"]\n[tuning] | report.metrics[1]: there is no column "rms", only rms_m
[tuning]\nreplicates = 1\nobjectives = ["rms_m", "energy_j"] |  | say in [tuning] how they are found
"#;

/// Mistakes in [`VISITS`].
const MISTAKES_OF_RULES: &str = r#"
dwell_s = 40 | dwell_s = 0.5 | controllers[1].rule.dwell_s: 0.5 is outside 1 to 100000 s
dwell_s = 40 | dwell_s = nan | controllers[1].rule.dwell_s: NaN is outside
{ name = "clock",  | { name = "watch",  | unknown variant `watch`
"#;

#[test]
fn a_mistake_is_named_with_its_line_its_member_and_what_would_do() {
    for (file, mistakes) in [(SMALL, MISTAKES), (VISITS, MISTAKES_OF_RULES), (FIGURES, MISTAKES_OF_FIGURES)] {
        for mistake in mistakes.lines().filter(|line| !line.is_empty()) {
            let parts: Vec<String> = mistake.splitn(3, " | ").map(|part| part.replace("\\n", "\n")).collect();
            let [right, wrong, says] = &parts[..] else { panic!("{mistake}") };
            assert!(file.contains(right), "{mistake}");
            let message = refused(&file.replacen(right, wrong, 1));
            assert!(message.contains(says), "{message}\n{mistake}");
        }
    }
    campaign(&SMALL.replacen("replicates = 1\n", "replicates = 1\nfirst_seed = 2\n", 1));
    let overlapping = SMALL
        .replace("seed = 7", "first_seed = 1")
        .replace("replicates = 1\n", "replicates = 1\nfirst_seed = 3\n");
    assert!(refused(&overlapping).contains("overlap the scored ones"));
    let unreadable = Campaign::read(Path::new("/nowhere.toml"));
    assert!(matches!(unreadable, Err(CampaignError::Unreadable(..))));
}

/// Mistakes in [`FIGURES`].
const MISTAKES_OF_FIGURES: &str = r#"
radius_m = 30 | radius_m = 0.5 | controllers[1].planner.figure.radius_m: 0.5 is outside 1 to 10000
radius_m = 30 | radius_m = 30, speed_share = 2 | controllers[1].planner.figure.speed_share: 2 is outside 0.1 to 1
kind = "circle" | kind = "ellipse" | controllers[1].planner.figure.kind: must be above, circle or zigzag_astern
"#;

/// A goal that localises and one that does not.
const FIGURES: &str = r#"
schema_version = "1"
name = "figures"
title = "whether a figure is flown"
scenarios = ["localise-straight", "paper-tracking"]
duration_s = 1000
replicates = 1
first_seed = 1

[[controllers]]
name = "mpc"
planner = {}

[[controllers]]
name = "circle"
planner = { figure = { kind = "circle", radius_m = 30 } }

[[controllers]]
name = "above"
planner = { figure = { kind = "above" } }

[[controllers]]
name = "greedy"
planner = {}
rule = { name = "greedy" }
"#;

/// A goal that visits and one that does not; the clock with both its followers, and the planner.
const VISITS: &str = r#"
schema_version = "1"
name = "visits"
title = "whether a rule is tuned and flown"
scenarios = ["visit-near", "paper-tracking"]
duration_s = 200
replicates = 1
first_seed = 1

[tuning]
replicates = 1
first_seed = 2
objectives = ["visit_mean_cost"]

[[controllers]]
name = "mpc"
planner = {}

[[controllers]]
name = "clock"
planner = {}
rule = { name = "clock", dwell_s = 40 }

[[controllers]]
name = "clock_los"
law = { name = "saturated_los", gains = { look_ahead_m = 5, along_track_gain_per_s = 0.3 } }
rule = { name = "clock" }
"#;

mod slow {
    use super::*;

    /// The objective at each point of a controller's grid, every mission flown to its end; the
    /// search breaks off beaten ones.
    fn values(campaign: &Campaign, controller: usize, objective: Objective) -> Vec<(Setting, f64)> {
        let controller = &campaign.controllers[controller];
        let condition = campaign.tuning_conditions(0).next().expect("is one");
        let value = |setting| {
            let flown = fly(campaign, condition, controller, setting).expect("flies");
            (setting, objective.of(&Score::of(&flown.record).expect("has a craft")))
        };
        controller.grid().into_iter().map(value).collect()
    }

    fn first_least(values: &[(Setting, f64)]) -> (Setting, f64) {
        let values = values.iter().copied();
        let least = values.reduce(|least, other| if other.1 < least.1 { other } else { least });
        least.expect("a grid has points")
    }

    #[test]
    fn a_clock_flies_at_its_best_turn_and_only_for_a_goal_that_visits() {
        let campaign = campaign(VISITS);
        let values = values(&campaign, 2, Objective::VisitMeanCost);
        let (best, least) = first_least(&values);
        let found = tune(&campaign, 0, 2, &mut |_| {});
        assert_eq!((found.best[0].setting, found.best[0].mean), (best, least));
        assert!(values.iter().any(|(_, cost)| least + 1.0 < *cost), "{values:?}");

        let folder = TempDir::new().expect("is a folder");
        let (_, rows) = flown(&campaign, folder.path(), 1, Shard::WHOLE);
        let controllers = rows.words("controller").expect("a column");
        assert_eq!(controllers, ["mpc", "clock", "clock_los", "mpc"]);
        let numbers = |name: &str| rows.numbers(name).expect("a column");
        assert_eq!(numbers("dwell_s"), [None, Some(40.0), best.dwell_s, None]);
        let costs = numbers("visit_mean_cost");
        assert!(costs[..3].iter().all(|cost| cost.is_some_and(|cost| 5.0 < cost)) && costs[3].is_none());
        // The bound is of a goal that is the same for all.
        let bounds = numbers("bound_rms_m").into_iter();
        assert!(bounds.map(|bound| bound.is_some()).eq([false, false, false, true]));
        for run in 0..4 {
            assert!(replay(&campaign, &rows, run).expect("flies").same, "{run}");
        }
    }

    #[test]
    fn a_circle_and_a_greedy_heading_fix_an_auv_better_than_a_stay_above() {
        let campaign = campaign(FIGURES);
        let folder = TempDir::new().expect("is a folder");
        let (_, rows) = flown(&campaign, folder.path(), 1, Shard::WHOLE);
        let controllers = rows.words("controller").expect("a column");
        assert_eq!(controllers, ["mpc", "circle", "above", "greedy", "mpc"]);
        let numbers = |name: &str| rows.numbers(name).expect("a column");
        assert_eq!(numbers("figure_radius_m"), [None, Some(30.0), Some(0.0), None, None]);
        let errors: Vec<_> = numbers("navigation_rms_m").into_iter().flatten().collect();
        let [planned, circle, above, greedy] = errors[..] else { panic!("{errors:?}") };
        assert!(1.5 * planned.max(circle).max(greedy) < above, "{errors:?}");
        for run in [1, 3] {
            assert!(replay(&campaign, &rows, run).expect("flies").same, "{run}");
        }
    }

    #[test]
    fn rows_are_the_same_on_one_thread_and_two_after_a_break_and_in_parts() {
        let (campaign, on_two_threads) = small();
        let folder = TempDir::new().expect("is a folder");
        let at = |name: &str| folder.path().join(name);
        let (directory, whole) = flown(campaign, &at("one"), 1, Shard::WHOLE);
        let failures = whole.words("failure").expect("a column");
        assert!(failures.iter().all(|words| words.is_empty()));
        assert!(directory.is_collected().expect("can be seen") && !at("one").join("chunks").exists());
        assert_eq!(directory.rows().expect("are there").digest(), whole.digest());

        assert_eq!(on_two_threads.digest(), whole.digest());

        // Broken off: some chunks and gains are there, another is half written.
        let begun = Directory::create(&at("broken"), Manifest::of(campaign, Shard::WHOLE)).expect("is new");
        flown(campaign, &at("again"), 2, Shard { index: 1, of: 2 });
        let chunks = campaign.chunks();
        for chunk in (Shard { index: 1, of: 2 }).chunks(&chunks).iter().skip(1) {
            // A killed process had kept the rows of its whole chunks.
            let part = Directory::open(&at("again")).and_then(|part| part.rows());
            let part = part.expect("are there");
            let conditions = chunk.conditions();
            let runs = conditions.flat_map(|condition| campaign.runs_in(condition));
            let mut kept = Rows::default();
            for rows in runs.filter_map(|run| part.only(run.number)) {
                kept.append(rows).expect("the same columns");
            }
            begun.store_chunk(chunk.number, &kept).expect("is kept");
        }
        fs::write(at("broken").join("chunks").join(".9.parquet.1.part"), b"PAR1").expect("is written");
        assert!(matches!(begun.rows(), Err(DirectoryError::Unfinished(_))));
        let mut first = None;
        let rows = run(campaign, &begun, NonZeroUsize::MIN, &mut |progress| {
            first.get_or_insert(progress.runs);
        });
        assert_eq!(rows.expect("continues").digest(), whole.digest());
        let (done, of) = first.expect("reports progress");
        assert!(0 < done && done < of, "{done} of {of}");

        for n in [3, 7] {
            let parts: Vec<Directory> = (1..=n)
                .map(|index| {
                    let shard = Shard { index, of: n };
                    flown(campaign, &at(&format!("{index} of {n}")), 2, shard).0
                })
                .collect();
            let (_, merged) = Directory::merge(&at(&format!("merged {n}")), &parts).expect("merges");
            assert_eq!(merged.digest(), whole.digest(), "{n} parts");
            let missing = Directory::merge(&at("incomplete"), &parts[1..]).expect_err("a part is missing");
            assert!(missing.to_string().contains("each is needed once"), "{missing}");
        }
    }

    #[test]
    fn all_controllers_of_a_condition_have_its_seed_and_parameters_and_conditions_differ() {
        let (campaign, rows) = small();
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
        // Both craft fly, and no condition that gains are found in is scored.
        let crafts = rows.words("craft").expect("a column");
        assert!(crafts.contains(&"otter") && crafts.contains(&"scenario"));
        for case in 0..campaign.cases.len() {
            for condition in campaign.tuning_conditions(case) {
                let scored = |replicate| Condition { replicate, tuning: false, ..condition };
                let mut scored = (0..campaign.file.replicates).map(scored);
                assert!(scored.all(|scored| campaign.seed(scored) != campaign.seed(condition)));
            }
        }
    }

    #[test]
    fn the_number_of_a_run_finds_it_and_its_replay_is_bit_identical() {
        let (campaign, rows) = small();
        let conditions = campaign.chunks().into_iter().flat_map(Chunk::conditions);
        let all: Vec<_> = conditions.flat_map(|condition| campaign.runs_in(condition)).collect();
        assert_eq!(all.len() as u64, campaign.n_runs());
        for (number, run) in (0..).zip(&all) {
            assert_eq!((run.number, campaign.run(number)), (number, Some(*run)));
        }
        assert_eq!(campaign.run(campaign.n_runs()), None);

        let runs = rows.numbers("run").expect("a column");
        for i in [0, 1, rows.len() / 2, rows.len() - 1] {
            #[expect(clippy::cast_possible_truncation, reason = "a run's number")]
            let number = runs[i].expect("numbered") as u64;
            let again = replay(campaign, rows, number).expect("flies");
            assert!(again.same, "run {number}");
            assert_eq!(again.controller, rows.words("controller").expect("a column")[i]);
        }
        assert!(replay(campaign, rows, campaign.n_runs()).is_err());
    }

    #[test]
    fn a_row_is_the_mission_flown_alone_and_no_craft_is_nearer_than_the_bound() {
        let text = r#"
schema_version = "1"
name = "board"
title = "rows beside missions"
scenarios = ["paper-tracking", "switching"]
duration_s = 60
replicates = 2
first_seed = 1
[[controllers]]
name = "law"
law = { name = "saturated_los", gains = { look_ahead_m = 5, along_track_gain_per_s = 0.15 } }
[[controllers]]
name = "planner"
planner = {}
"#;
        let (campaign, folder) = (campaign(text), TempDir::new().expect("is a folder"));
        let (_, rows) = flown(&campaign, folder.path(), 2, Shard::WHOLE);
        assert_eq!(rows.len(), 8);
        let words = |name: &str, i: usize| rows.words(name).expect("a column")[i];
        let cell = |name: &str, i: usize| rows.numbers(name).expect("a column")[i].expect("has a value");
        for i in 0..rows.len() {
            let scenario = Scenario::named(words("scenario", i)).expect("exists").lasting(60.0);
            let gains = LosGains { look_ahead: 5.0, along_track_gain: 0.15 };
            let mut guide: Box<dyn Guide> = match words("controller", i) {
                "law" => Box::new(LosGuide::new(gains)),
                _ => Box::new(MpcGuide::new(Parameters::default())),
            };
            let seed: u32 = if i % 4 < 2 { 1 } else { 2 };
            assert_eq!(cell("seed", i), f64::from(seed));
            let record = mission::run(&scenario, guide.as_mut(), seed.into(), &mut |_| {}).expect("runs");
            let metrics = Metrics::of(&record).surface_craft.expect("has a craft");
            for (name, alone) in [
                ("rms_m", metrics.rms_m),
                ("p95_m", metrics.p95_m),
                ("energy_j", metrics.energy_j),
                ("heading_travel_rad", metrics.heading_travel_rad),
            ] {
                assert_eq!(cell(name, i), alone, "row {i}");
            }
            assert!(cell("bound_rms_m", i) <= cell("rms_m", i), "row {i}");
        }
    }

    #[test]
    fn no_gains_of_the_grid_beat_the_tuned_gains_on_the_tuning_conditions() {
        let text = SMALL
            .replace("[\"paper-tracking\", \"noisy-fixes\"]", "[\"switching\"]")
            .replace("craft = [\"scenario\", \"otter\"]", "")
            .replace("replicates = 3", "replicates = 1");
        let campaign = campaign(&text);
        let found = tune(&campaign, 0, 1, &mut |_| {});
        assert_eq!(found.best.len(), 2);
        for (objective, best) in campaign.objectives().iter().zip(&found.best) {
            let least = first_least(&values(&campaign, 1, *objective));
            assert_eq!((best.setting, best.mean), least, "{objective:?}");
        }
    }

    #[test]
    fn a_planner_without_the_craft_s_response_flies_another_mission_and_learns_the_response() {
        let text = SMALL
            .replace("craft = [\"scenario\", \"otter\"]", "craft = [{ random = { first = 7, count = 1 } }]")
            .replace(", \"noisy-fixes\"", "")
            .replace("duration_s = 40", "duration_s = 320")
            .replace("replicates = 3", "replicates = 1")
            + r#"
[[controllers]]
name = "speeds alone"
planner = {}
craft = "speeds"

[[controllers]]
name = "noisy log"
planner = { parameters.craft.speed_noise = 1.0 }

[[controllers]]
name = "thruster lost"
planner = {}
variation = { breakdown = { what = "port_thruster_lost", at_s = 150.0 } }
"#;
        let (campaign, folder) = (campaign(&text), TempDir::new().expect("is a folder"));
        let (_, rows) = flown(&campaign, folder.path(), 2, Shard::WHOLE);
        let of = |controller: &str, name: &str| {
            let words = rows.words("controller").expect("a column");
            let row = words.iter().position(|word| *word == controller).expect("flew");
            rows.numbers(name).expect("a column")[row]
        };
        for other in ["speeds alone", "noisy log"] {
            assert_ne!(of("mpc auto", "rms_m"), of(other, "rms_m"), "{other}");
        }
        for name in LEARNT.as_flattened() {
            assert!(of("speeds alone", name).is_some_and(f64::is_finite), "{name}");
        }
        assert_eq!(of("mpc auto", "heading_lag_tested_s"), of("speeds alone", "heading_lag_tested_s"));
        assert_eq!(of("saturated_los", "alarms"), None);
        assert_eq!(of("mpc auto", "noticed_after_s"), None);
        let noticed = of("thruster lost", "noticed_after_s").expect("a lost thruster is noticed");
        // Of 12 craft in two missions the slowest took 32 s.
        assert!((0.0..60.0).contains(&noticed), "{noticed}");
        // The craft is another one for one of them, so that there is no bound for all.
        assert_eq!(of("mpc auto", "bound_rms_m"), None);
    }
}

#[test]
fn a_campaign_whose_files_cannot_be_seen_is_not_replaced() {
    let campaign = campaign(SMALL);
    let manifest = || Manifest::of(&campaign, Shard::WHOLE);
    for name in ["campaign.json", "runs.parquet"] {
        let folder = TempDir::new().expect("is a folder");
        Directory::create(folder.path(), manifest()).expect("is created");
        let file = folder.path().join(name);
        let _ = fs::remove_file(&file);
        // A link to itself: any look at it fails.
        std::os::unix::fs::symlink(&file, &file).expect("is made");
        let seen =
            Directory::create(folder.path(), manifest()).and_then(|directory| directory.rows().map(drop));
        assert!(matches!(seen, Err(DirectoryError::Io { .. })), "{name}: {seen:?}");
        assert!(file.is_symlink(), "{name} was replaced");
    }
}
