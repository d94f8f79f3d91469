//! The program itself: its commands, exit codes and output, and the server on a real socket.

use std::collections::BTreeMap;
use std::fs;
use std::io::{BufRead, Write};
use std::process::{Command, Output, Stdio};

use planner::craft::{CraftDescription, HeadingReference, SpeedReference};
use planner::los::LosLaw;
use record::Format;
use serde_json::Value;
use tests::server::Server;

use crate::command::{
    ask, has, has_all, json, line, path, pilotfish, printed, refusal, run, serving, stderr, stdout, written,
};

#[test]
fn the_command_that_the_server_prints_works_when_pasted() {
    if !has("curl") {
        return;
    }
    let mut server = serving(&[]);
    let mut printed = server.printed.take().expect("has not ended");
    let mut command = String::new();
    while !command.contains("/v1/plan\n") {
        let mut line = String::new();
        assert_ne!(printed.read_line(&mut line).expect("prints"), 0, "{command}");
        if line.starts_with("  ") {
            command += &line;
        }
    }
    let output = Command::new("sh").args(["-c", &command]).output().expect("there is a shell");
    let plan: Value = serde_json::from_slice(&output.stdout).expect("is JSON");
    assert_eq!(plan["outcome"], "ok", "{command}");
}

#[test]
fn a_port_in_use_is_refused_with_advice() {
    let server = serving(&[]);
    let output = run(&["serve", "--port", &server.port().to_string()]);
    has_all(refusal(&output), &["--port"]);
}

#[test]
fn a_second_service_on_the_same_data_is_refused_and_the_first_continues() {
    let first = serving(&[]);
    let data = first.data.as_ref().expect("has a directory of its own").path();
    let second = run(&["serve", "--port", "0", "--data", &data.display().to_string()]);
    let parts = ["in use by another pilotfish", "--data", "missions.sqlite3"];
    has_all(refusal(&second), &parts);
    assert_eq!(stdout(&second), "", "it does not greet before it knows");
    assert!(ask(&first, "GET", "/readyz", "").status == 200);
}

#[test]
fn a_printed_scenario_can_be_changed_and_run() {
    has_all(stdout(&run(&["scenarios"])), &sim::scenario::Scenario::names());
    let scenario = printed(&run(&["scenarios", "paper-tracking"]));
    let folder = tempfile::tempdir().expect("a folder");
    let schema = "pilotfish scenarios --schema > scenario.schema.json";
    let (first, second) = scenario.split_once('\n').expect("has lines");
    assert_eq!(first, "#:schema scenario.schema.json");
    assert!(second.starts_with('#') && second.contains(schema), "{second}");
    let schema = json(stdout(&run(&["scenarios", "--schema"])));
    assert_eq!(schema["title"], "Scenario");
    assert!(schema["properties"]["auvs"].is_object());
    let mine = scenario.replace("name = \"paper-tracking\"", "name = \"mine\"");
    let fly = |file: &str| run(&["simulate", file, "--duration-s", "20"]);
    let flown = fly(&written(&folder, "my.toml", &mine));
    assert!(printed(&flown).starts_with("mine, seed 1"), "{}", stdout(&flown));

    let line = 1 + mine.lines().position(|line| line.starts_with("lane_length_m")).expect("there");
    let wrong = mine.replace("lane_length_m = 100", "lane_length_m = -100");
    let says =
        format!("my.toml:{line}: auvs[0].path.lawn_mower.lane_length_m: -100 is outside 0.01 to 100000 m");
    has_all(refusal(&fly(&written(&folder, "my.toml", &wrong))), &[&says]);
    has_all(refusal(&fly("./nowhere.toml")), &["cannot read ./nowhere.toml"]);
}

#[test]
fn an_unknown_suffix_of_a_record_is_refused_before_the_mission() {
    let folder = tempfile::tempdir().expect("a folder");
    for name in ["record.xlsx", "record"] {
        let [good, bad] = ["record.csv", name].map(|name| path(&folder, name));
        let output = line(&format!("simulate paper-tracking --out {good} --out {bad}"));
        let suffixes = [name, ".csv", ".parquet", ".geojson", ".mcap", ".ndjson"];
        has_all(refusal(&output), &suffixes);
        assert_eq!(stdout(&output), "");
        assert_eq!(fs::read_dir(&folder).expect("is there").count(), 0);
    }
}

#[test]
fn one_mission_is_written_in_every_format() {
    let folder = tempfile::tempdir().expect("a folder");
    let directory = folder.path();
    let mut mission = pilotfish();
    mission.args(["simulate", "paper-tracking", "--controller", "saturated_los"]);
    for format in Format::ALL {
        mission.arg("--out").arg(directory.join(format!("record.{format}")));
    }
    let output = mission.output().expect("starts");
    printed(&output);
    assert_eq!(stderr(&output), "", "no progress bar without a terminal");
    let read = |format: Format| fs::read(directory.join(format!("record.{format}"))).expect("was written");
    assert!(read(Format::Csv).starts_with(b"sequence,"));
    // The marks by which the formats are known, first and last.
    let parquet = read(Format::Parquet);
    assert!(parquet.starts_with(b"PAR1") && parquet.ends_with(b"PAR1"));
    let mcap = read(Format::Mcap);
    assert!(mcap.starts_with(b"\x89MCAP0\r\n") && mcap.ends_with(b"\x89MCAP0\r\n"));
    let map: Value = serde_json::from_slice(&read(Format::Geojson)).expect("is JSON");
    assert_eq!(map["type"], "FeatureCollection");
    let names = fs::read_dir(directory).expect("is there").count();
    assert_eq!(names, Format::ALL.len(), "nothing else was left there");
}

#[test]
fn every_shell_gets_completions_and_every_command_a_manual_page() {
    let help = run(&["--help"]);
    let (_, commands) = stdout(&help).split_once("Commands:\n").expect("lists its commands");
    let commands: Vec<&str> = commands
        .lines()
        .take_while(|line| line.starts_with("  "))
        .filter_map(|line| line.split_whitespace().next())
        .filter(|command| *command != "help")
        .collect();
    assert!(commands.contains(&"serve") && commands.contains(&"man"), "{commands:?}");

    for shell in ["bash", "fish", "zsh"] {
        let output = run(&["completions", shell]);
        let missing = commands.iter().find(|command| !stdout(&output).contains(*command));
        assert_eq!(missing, None, "{shell}");
    }
    let pages = tempfile::tempdir().expect("there is room");
    let directory = pages.path().join("man1");
    printed(&run(&["man", directory.to_str().expect("is text")]));
    for command in commands {
        let page = fs::read_to_string(directory.join(format!("pilotfish-{command}.1")));
        assert!(page.is_ok_and(|page| page.contains(".SH SYNOPSIS")), "{command}");
    }
    let serve = fs::read_to_string(directory.join("pilotfish-serve.1")).expect("was written");
    assert!(serve.contains("PILOTFISH_PORT"));
}

#[test]
fn the_program_has_the_version_of_the_newest_changes() {
    let changes = include_str!("../../../CHANGELOG.md");
    let newest = changes
        .lines()
        .filter_map(|line| line.strip_prefix("## "))
        .find(|heading| heading.starts_with(|first: char| first.is_ascii_digit()))
        .and_then(|heading| heading.split_whitespace().next())
        .expect("a version has changes");
    assert_eq!(stdout(&run(&["--version"])), format!("pilotfish {newest}\n"));
}

#[test]
fn other_machines_are_let_in_only_with_insecure() {
    for (value, lets_in) in [("yes", true), ("0", false)] {
        let mut program = pilotfish();
        program.env("PILOTFISH_INSECURE", value).env("PILOTFISH_HOST", "0.0.0.0");
        if lets_in {
            let server = Server::start(program);
            assert!(server.address.starts_with("127.0.0.1:"), "{}", server.address);
        } else {
            let output = program.args(["--port", "0"]).output().expect("starts");
            assert_eq!(output.status.code(), Some(1));
            has_all(refusal(&output), &["--insecure"]);
        }
    }
}

/// An address for documentation (RFC 5737), without a database.
#[test]
fn services_of_other_machines_are_not_told_a_loopback_address() {
    let store = "postgres://pilotfish@192.0.2.1/pilotfish?sslmode=disable";
    for (advertise, says) in [
        ("", "add --advertise http://HOST:PORT"),
        (" --advertise http://ship-a:8080", "cannot use the mission log"),
    ] {
        let output = line(&format!("serve --port 0 --store {store}{advertise}"));
        assert_eq!(output.status.code(), Some(1));
        has_all(refusal(&output), &[says]);
    }
}

/// Before anything is simulated or printed.
#[test]
fn a_wrong_command_line_is_refused_with_the_reason() {
    let scenarios = sim::scenario::Scenario::names().join(", ");
    let table = "
        1 | simulate paper-trackin | SCENARIOS
        1 | compare paper-trackin | SCENARIOS
        1 | demo paper-trackin | SCENARIOS
        1 | compare paper-path-following | pilotfish simulate paper-path-following
        1 | simulate calm --out /nowhere/all.csv | cannot write /nowhere/all.csv
        1 | simulate calm --report /nowhere/all.html | cannot write /nowhere/all.html
        1 | simulate calm --look-ahead-m 5 | --look-ahead-m is a gain of the line-of-sight laws: add --controller saturated_los
        1 | simulate calm --tuned | --tuned searches for gains of a line-of-sight law
        1 | LAW --snapshots asked.ndjson | only the planner has snapshots
        1 | LAW --look-ahead-m 0 | --look-ahead-m must be above 0, not 0
        1 | LAW --look-ahead-m -5 | --look-ahead-m must be above 0, not -5
        1 | LAW --along-track-gain-per-s -0.1 | --along-track-gain-per-s must be above 0, not -0.1
        1 | plan no-such-file.json | no-such-file.json
        1 | crafts titanic | medusa
        2 | plan --tolerance 0 | 1e-10
        2 | plan --tolerance tight | not a number
        2 | serve --deadline-ms 0 | 0.05
        2 | serve --deadline-ms NaN | 0.05
        2 | --deadline-ms 70000 | 60000
    ";
    let table = table.replace("LAW", "simulate calm --controller saturated_los");
    for row in table.replace("SCENARIOS", &scenarios).trim().lines() {
        let [code, command, says] = row.trim().split(" | ").collect::<Vec<_>>()[..] else { panic!("{row}") };
        let output = line(command);
        assert_eq!(output.status.code(), code.parse().ok(), "{command}");
        has_all(refusal(&output), &[says]);
        assert_eq!(stdout(&output), "", "{command}");
    }
}

#[test]
fn a_number_of_a_scenario_is_set() {
    let flown = |set: &str| line(&format!("simulate calm --duration-s 5 --untimed --out /dev/stdout{set}"));
    let levers = "position_weight_per_m2=0.1 --set surface_craft.tuning.acceleration_weight_per_m2ps4=9000";
    let (tuned, plain) = (flown(&format!(" --set surface_craft.tuning.{levers}")), flown(""));
    let (tuned, plain) = (stdout(&tuned), stdout(&plain));
    assert!(tuned.contains(',') && tuned != plain, "{tuned}");
    for (set, says) in [
        ("surface_craft.tuning.position_weight_per_m2=11", "must be from 0.01 to 10"),
        ("surface_craft.tuning.scp_iterations=1.5", "expected u32"),
        ("surface_craft.sped=1", "no number with this key"),
        ("seed", "give a key"),
    ] {
        has_all(refusal(&flown(&format!(" --set {set}"))), &[says]);
    }
}

#[test]
fn a_comparison_writes_the_record_of_every_controller() {
    let folder = tempfile::tempdir().expect("a folder");
    let compare = |out: &str| line(&format!("compare calm --duration-s 5 --out {out}"));
    let out = path(&folder, "a/b");
    printed(&compare(&out));
    let mut n = 0;
    for name in ["mpc"].into_iter().chain(LosLaw::ALL.map(LosLaw::name)) {
        let parquet = fs::read(format!("{out}/{name}.parquet")).expect("is written");
        assert!(parquet.starts_with(b"PAR1") && parquet.ends_with(b"PAR1"));
        n += 1;
    }
    assert_eq!(fs::read_dir(&out).expect("is made").count(), n);

    let refused = compare(&written(&folder, "file", "in the way"));
    assert_eq!(refused.status.code(), Some(1));
    has_all(refusal(&refused), &["cannot write"]);
}

#[test]
fn a_tuned_law_has_the_gains_of_the_comparison() {
    let compared = json(&printed(&line("compare calm --duration-s 20 --format json")));
    let law = &compared["controllers"]["saturated_los"];
    let output = line("simulate calm --duration-s 20 --controller saturated_los --tuned");
    let text = stdout(&output);
    let line = |name: &str| text.lines().find(|line| line.starts_with(name)).expect("is there");
    let rms = format!("{:.3}", law["rms_m"].as_f64().expect("a number"));
    assert!(line("rms_m").ends_with(&rms), "{rms} in {text}");
    let look_ahead = law["gains"]["look_ahead_m"].as_f64().expect("a number");
    let said = format!("look-ahead {look_ahead} m,");
    assert!(line("saturated_los:").contains(&said), "{said} in {text}");
}

#[test]
fn a_report_loads_no_other_file() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = path(&folder, "report.html");
    let said = printed(&line(&format!("simulate paper-path-following --report {path}")));
    // It has no surface craft.
    has_all(&said, &["auv-1.cross_track_max_m"]);
    assert!(!said.contains("rms_m"), "{said}");
    let page = fs::read_to_string(&path).expect("is written");
    for loads in ["src=", "href=", "<link", "@import", "url(", "fetch("] {
        assert!(!page.contains(loads), "{loads} in {page}");
    }
    assert!(page.contains("default-src 'none'"));
    let shown = ["paper-path-following", "seed 1", "auv-1.cross_track_max_m", "depth_m"];
    has_all(&page, &shown);
}

/// `pilotfish plan` with `body` on its standard input.
fn plan_of(body: &str, arguments: &[&str]) -> Output {
    let mut process = pilotfish()
        .arg("plan")
        .args(arguments)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("starts");
    let mut stdin = process.stdin.take().expect("is piped");
    stdin.write_all(body.as_bytes()).expect("takes it");
    drop(stdin);
    process.wait_with_output().expect("ends")
}

fn example_body(name: &str) -> &'static str {
    let mut examples = service::examples::EXAMPLES.into_iter();
    examples.find(|example| example.name == name).expect("exists").body
}

/// An answer without the member that differs between equal requests.
fn untimed(text: &str) -> Value {
    let mut answer: Value = serde_json::from_str(text).expect("is JSON");
    answer["solver"]["solve_time_ms"] = Value::Null;
    answer
}

#[test]
fn a_plan_without_a_server_equals_the_server_s_answer() {
    let server = serving(&[]);
    let folder = tempfile::tempdir().expect("a folder");
    for name in ["track", "crowded"] {
        let body_text = example_body(name);
        let served = untimed(&ask(&server, "POST", "/v1/plan", body_text).text);
        let path = written(&folder, "snapshot.json", body_text);
        for output in
            [plan_of(body_text, &[]), plan_of(body_text, &["-", "--compact"]), run(&["plan", &path])]
        {
            assert_eq!(untimed(&printed(&output)), served);
        }
    }
    let lines = |arguments: &[&str]| stdout(&plan_of(example_body("track"), arguments)).lines().count();
    assert_eq!(lines(&["--compact"]), 1);
    assert!(lines(&[]) > 100);
}

#[test]
fn an_invalid_snapshot_gets_the_problem_document_and_a_failure() {
    let wrong = example_body("track").replace("0.193", "-0.193");
    let mut strict: Value = serde_json::from_str(example_body("track")).expect("is JSON");
    strict["fallback"] = "none".into();
    strict["auvs"][0]["state"]["age_s"] = 2000.0.into();
    for (text, code, pointer) in [
        ("{", "syntax", Some("")),
        (&wrong, "invalid_request", Some("/auvs/0/state/speed_mps")),
        (&strict.to_string(), "no_solution", None),
    ] {
        let output = plan_of(text, &[]);
        assert_eq!(output.status.code(), Some(1), "{text}");
        let problem = json(stdout(&output));
        assert_eq!(problem["code"], code);
        let found = problem["errors"][0]["pointer"].as_str();
        assert_eq!(found, pointer, "{problem}");
        has_all(refusal(&output), &[problem["detail"].as_str().expect("text")]);
    }
}

/// `tests/python/test_oracle.py` solves dumps with other solvers.
#[test]
fn a_dumped_program_is_that_of_the_answer() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = path(&folder, "program.json");
    let answer = json(&printed(&plan_of(example_body("track"), &["--dump", &file])));
    let dump: Value = serde_json::from_slice(&fs::read(&file).expect("written")).expect("is JSON");
    assert_eq!(dump["status"], "solved");
    let numbers = |list: &Value| -> Vec<f64> { serde_json::from_value(list.clone()).expect("are numbers") };
    let places = |list: &Value| -> Vec<usize> { serde_json::from_value(list.clone()).expect("are places") };
    let x = numbers(&dump["solution"]["x"]);
    let [q, b] = ["q", "b"].map(|name| numbers(&dump[name]));

    // Its columns give the speed of the second point of the trajectory, 1 s from now.
    let unit = dump["v1"]["unit_mps"].as_f64().expect("a number");
    let speed = places(&dump["v1"]["columns"]).into_iter().map(|column| x[column] * unit);
    let speed = speed.fold(0.0, f64::hypot);
    let planned = answer["trajectory"][1]["speed_mps"].as_f64().expect("a number");
    assert!((speed - planned).abs() < 1e-9, "{planned}");

    // Columns and rows have names, and those of the speed say so.
    let names = |list: &Value| -> Vec<String> { serde_json::from_value(list.clone()).expect("are names") };
    let [columns, rows] = ["columns", "rows"].map(|list| names(&dump[list]));
    assert_eq!((columns.len(), rows.len()), (q.len(), b.len()));
    let of_the_speed = places(&dump["v1"]["columns"]).into_iter();
    let of_the_speed: Vec<_> = of_the_speed.map(|column| columns[column].as_str()).collect();
    assert_eq!(of_the_speed, ["velocity[1].ahead", "velocity[1].starboard"]);
}

#[test]
fn written_snapshots_lead_to_the_same_plans() {
    let folder = tempfile::tempdir().expect("a folder");
    let [asked, record] = ["asked.ndjson", "record.csv"].map(|name| path(&folder, name));
    let mission = |every: u32| {
        let files = format!("--out {record} --snapshots {asked} --every {every}");
        printed(&line(&format!("simulate crowded --duration-s 10 --untimed {files}")));
        fs::read_to_string(&asked).expect("written")
    };
    let asked = mission(1);
    assert_eq!(asked.lines().count(), 10);
    let mut table = csv::Reader::from_path(&record).expect("written");
    let rows = table.deserialize().map(|row| row.expect("is a row"));
    let plans = rows.filter(|row: &BTreeMap<String, String>| row["kind"] == "planned");
    let flown: Vec<f64> = plans.map(|row| row["reference_speed_mps"].parse().expect("a number")).collect();
    let planned = asked.lines().map(|line| {
        let answer = json(&printed(&plan_of(line, &["--compact"])));
        answer["reference"]["speed_mps"].as_f64().expect("a number")
    });
    assert_eq!(planned.collect::<Vec<_>>(), flown);
    let request = json(asked.lines().nth(1).expect("is there"));
    assert!(request["previous_plan"]["trajectory"].is_array());
    assert_eq!(request["acoustics"]["range_max_m"], 60.0);

    let fourth: Vec<_> = mission(4).lines().map(str::to_owned).collect();
    let expected: Vec<_> = asked.lines().step_by(4).collect();
    assert_eq!(fourth, expected);
}

#[test]
fn an_invalid_log_is_refused_with_the_reason() {
    let folder = tempfile::tempdir().expect("a folder");
    let header = "t_s,reference_speed_mps,reference_heading_rad,heading_rad,speed_mps\n";
    let rows = |rows: &str| format!("{header}{rows}");
    let no_number = "row 1, column heading_rad: \"north\" is not a number";
    let no_speed = ("b.csv", "t_s,heading_rad\n1,2\n", "no column reference_speed_mps");
    for (name, text, reason) in [
        ("a.txt", "t_s\n", ".csv, .parquet or .mcap"),
        no_speed,
        ("c.csv", &rows("0,1,0,north,1\n"), no_number),
        ("d.csv", &rows("0,1,0,0,1\n1,1,0,0,1\n"), "lasts 1 s"),
        ("e.csv", &rows("0,1,0,0,1\n9,1,0,0,1\n"), "it must last at least 60 s"),
        ("f.parquet", "PAR0", "not Apache Parquet"),
    ] {
        let output = run(&["identify", &written(&folder, name, text)]);
        assert_eq!(output.status.code(), Some(1), "{name}");
        has_all(refusal(&output), &[reason]);
    }
}

#[test]
fn the_built_in_craft_are_listed_and_each_file_is_a_craft() {
    let listed = run(&["crafts"]);
    for preset in planner::craft::PRESETS {
        assert!(stdout(&listed).contains(preset.title), "{}", stdout(&listed));
        let printed = run(&["crafts", preset.name]);
        let craft: CraftDescription = serde_json::from_str(stdout(&printed)).expect("is a craft");
        assert_eq!(craft, CraftDescription::from(&preset.craft));
    }
}

mod slow {
    use super::*;

    #[test]
    fn a_comparison_has_all_metrics_of_all_controllers_and_their_information() {
        let comparison = json(&printed(&line("compare paper-intermittent --format json --seed 2")));
        assert_eq!(comparison["scenario"], "paper-intermittent");
        assert_eq!(comparison["seed"], 2);
        let controllers = &comparison["controllers"];
        let laws = LosLaw::ALL.map(LosLaw::name);
        let named = controllers.as_object().expect("is an object");
        assert_eq!(named.len(), 1 + laws.len());
        for controller in ["mpc"].into_iter().chain(laws) {
            let scores = &controllers[controller];
            let metrics = "rms_m mean_m p95_m max_m energy_j heading_travel_rad reference_jerk solve_ms_p50 \
                           solve_ms_p99 regret_m";
            for metric in metrics.split(' ') {
                let is_positive = scores[metric].as_f64().is_some_and(|value| value > 0.0);
                assert!(is_positive, "{controller}: {metric} in {scores}");
            }
            assert!(scores["time_in_range_s"]["auv-1"].is_number());
            assert!(scores["violations"]["turn_rate_radps"]["count"].is_number());
            assert_eq!(scores["information"]["current_known"], true);
            let answers = scores["answers_by_method"].as_object().expect("is an object");
            let is_a_method = ["mpc", "saturated_los"].contains(&controller);
            assert_eq!(
                answers.values().filter_map(Value::as_u64).sum::<u64>(),
                if is_a_method { 1_920 } else { 0 },
                "one answer a second, and none by a law that is only compared with"
            );
            assert_eq!(scores["gains"].get("integral_gain_mps").is_some(), controller == "integral_los");
        }
        let gains = &controllers["saturated_los"]["gains"];
        assert!(gains["look_ahead_m"].is_number() && gains["along_track_gain_per_s"].is_number());
    }

    #[test]
    fn a_trial_is_logged_and_identified_and_requests_accept_its_craft_file() {
        let folder = tempfile::tempdir().expect("a folder");
        let file = |name: &str| path(&folder, name);
        let (log, craft, page) = (file("trial.csv"), file("craft.json"), file("trial.html"));
        printed(&line(&format!("simulate --trial otter --seed 3 --out {log}")));
        let found = printed(&run(&["identify", &log, "--craft", &craft, "--report", &page]));
        assert!(found.contains("surge_loop/acceleration_max_mps2"), "{found}");
        let craft: CraftDescription =
            serde_json::from_str(&fs::read_to_string(&craft).expect("written")).expect("is a craft");
        assert_eq!(craft.faults(), []);
        assert_eq!(craft.speed_held, Some(SpeedReference::ThroughWater));
        assert_eq!(craft.heading_held, Some(HeadingReference::Heading));
        // The simulated loop clamps an error of 0.4 m/s: 44.5 N/(m/s) on 85.5 kg.
        let acceleration = craft.surge_loop.acceleration_max_mps2.expect("identified");
        assert!((acceleration - 0.4 * 44.5 / 85.5).abs() < 0.03, "{acceleration}");
        let page = fs::read_to_string(&page).expect("written");
        assert!(page.ends_with("</html>\n") && page.contains("heading_loop"));

        let surge_lag = |craft: &str| {
            let planned = plan_of(example_body("track"), &["-", "--craft", craft]);
            let lag = &json(&printed(&planned))["craft_estimate"]["surge_lag_s"]["value"];
            lag.as_f64().expect("a lag")
        };
        assert!(surge_lag("otter") < surge_lag("medusa"), "2 s and 2.5 s");
        surge_lag(&file("craft.json"));
        let unknown = plan_of(example_body("track"), &["-", "--craft", "no-such"]);
        assert_eq!(unknown.status.code(), Some(1));
        has_all(refusal(&unknown), &["pilotfish crafts"]);
        let flown = |craft: &str| {
            let mission = "simulate calm --duration-s 30 --untimed";
            printed(&line(&format!("{mission} --craft {craft}")))
        };
        assert_ne!(flown("otter"), flown("generic"));

        // In degrees, and without members that small craft lack.
        let text = fs::read_to_string(&log).expect("written");
        let columns = "t_s,reference_speed_mps,reference_heading_rad,heading_rad,north_m,east_m";
        let columns: Vec<_> = columns.split(',').collect();
        let mut reader = csv::Reader::from_reader(text.as_bytes());
        let header = reader.headers().expect("a header").clone();
        let place = |column| header.iter().position(|name| name == column).expect("is there");
        let mut plain = columns.join(",").replace("heading_rad", "heading_deg") + "\n";
        for row in reader.records() {
            let row = row.expect("a row");
            let cell = |i: usize| {
                let number: f64 = row[place(columns[i])].parse().expect("a number");
                let degrees = columns[i].ends_with("heading_rad");
                if degrees { number.to_degrees() } else { number }.to_string()
            };
            plain += &((0..columns.len()).map(cell).collect::<Vec<_>>().join(",") + "\n");
        }
        let log = file("plain.csv");
        fs::write(&log, plain).expect("writes");
        let found = printed(&run(&["identify", &log]));
        assert!(found.contains("heading_loop/rate_max_radps"), "{found}");
        assert!(!found.contains("power"), "no column, no power: {found}");
    }

    #[test]
    fn a_record_is_identified_from_every_format_that_is_a_table() {
        let folder = tempfile::tempdir().expect("a folder");
        let files = ["csv", "parquet", "mcap"].map(|ending| path(&folder, &format!("record.{ending}")));
        let [csv, parquet, mcap] = &files;
        let written = format!("--out {csv} --out {parquet} --out {mcap}");
        let mission = "simulate switching --controller saturated_los --untimed";
        printed(&line(&format!("{mission} {written}")));
        let [csv, parquet, mcap] = files.map(|file| printed(&run(&["identify", &file])));
        assert_eq!(parquet, mcap);
        assert_eq!(parquet, csv);
    }
}
