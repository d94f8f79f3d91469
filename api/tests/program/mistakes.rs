//! The program's answers to mistakes of its users.

use std::fs;

use serde_json::Value;

use crate::command::{has_all, json, line, path, printed, refusal, said, stdout, written};

/// A snapshot whose craft is known by name.
const TRACK: &str = include_str!("../../../examples/snapshots/track.json");

#[test]
fn a_misspelt_scenario_is_answered_with_the_nearest_name() {
    let nearest = "unknown scenario \"noisy-fixs\" (did you mean \"noisy-fixes\"?); the built-in";
    has_all(refusal(&line("simulate noisy-fixs")), &[nearest]);
    let none_near = "unknown scenario \"zzz\"; the built-in scenarios are";
    has_all(refusal(&line("scenarios zzz")), &[none_near]);
}

#[test]
fn shells_complete_scenario_names_and_files_are_still_taken() {
    let script = printed(&line("completions bash"));
    let mut lines = script.lines();
    lines.find(|line| line.trim() == "pilotfish__subcmd__simulate)").expect("has simulate");
    has_all(lines.next().expect("are on a line"), &[" noisy-fixes "]);
    // No help names all of them.
    assert!(!stdout(&line("simulate --help")).contains("noisy-fixes"));
    let output = line("simulate ./none.toml");
    has_all(refusal(&output), &["none.toml"]);
    assert!(!said(&output).contains("unknown"));
}

#[test]
fn a_command_of_another_package_names_that_package() {
    let output = line("ros2");
    assert_eq!(output.status.code(), Some(2));
    has_all(refusal(&output), &["pilotfish_ros2"]);
    assert!(!said(&output).contains("similar"));
    assert!(!refusal(&line("sail")).contains("brings it"));
}

#[test]
fn help_shows_the_flags_of_stored_missions_where_they_have_an_effect() {
    let have_none = ["plan", "simulate", "campaign", "campaign run", "man"];
    let have_them = ["serve", "replay", "token add", "bridge nmea"];
    for command in have_none.iter().chain(&have_them) {
        let help = printed(&line(&format!("{command} --help")));
        let shows = ["--data", "--tokens"].map(|flag| help.contains(flag));
        assert_eq!(shows, [have_them.contains(command); 2], "{command}");
        has_all(&help, &["--log"]);
    }
    // Scripts that give them to every command still work.
    printed(&line("scenarios --data elsewhere"));
    printed(&line("--data elsewhere scenarios"));
}

#[test]
fn a_bridge_that_hears_no_craft_ends_in_the_given_time() {
    let folder = tempfile::tempdir().expect("there is room");
    let ended = line(&format!(
        "bridge mavlink --connect udp:127.0.0.1:0 --auv 1=auv-1 --end-after 1 --data {}",
        path(&folder, "data")
    ));
    assert_eq!(ended.status.code(), Some(1));
    has_all(&said(&ended), &["no craft was heard on --connect within 1 s"]);
}

#[test]
fn a_moosdb_is_not_looked_for_on_a_wire_on_which_none_answers() {
    for wire in ["udp:127.0.0.1:9000", "imc:127.0.0.1:9000"] {
        let refused = line(&format!("bridge moos --connect {wire} --auv auv-1"));
        has_all(refusal(&refused), &["a MOOSDB does not answer on", wire, "tcp:HOST:PORT"]);
    }
}

#[test]
fn an_unknown_field_of_a_modem_file_is_named() {
    let folder = tempfile::tempdir().expect("there is room");
    let file = written(&folder, "usbl.json", r#"{ "modle": "seatrac" }"#);
    let refused = line(&format!(
        "bridge mavlink --connect udp:127.0.0.1:0 --auv 1=auv-1 --modem tcp:127.0.0.1:9={file}"
    ));
    let reason = "usbl.json cannot be read as the settings of a modem";
    has_all(refusal(&refused), &[reason, "unknown field"]);
    assert!(!said(&refused).contains("JSON"));
}

#[test]
fn the_warning_of_an_unknown_craft_names_what_is_missing() {
    let folder = tempfile::tempdir().expect("there is room");
    let file = path(&folder, "snapshot.json");
    let warning = |craft: &str| {
        let mut snapshot = json(TRACK);
        snapshot["craft"] = json(craft);
        fs::write(&file, snapshot.to_string()).expect("is written");
        let answer = json(&printed(&line(&format!("plan {file}"))));
        let warnings = answer["warnings"].as_array().cloned().unwrap_or_default();
        let unknown = |warning: &&Value| warning["code"] == "craft_unknown";
        let found = warnings.iter().find(unknown);
        found.map(|warning| warning["detail"].as_str().expect("is text").to_owned())
    };
    let rates = r#""rate_max_radps": 0.2 }, "surge_loop": { "acceleration_max_mps2": 0.1"#;
    let detail = warning(&format!(r#"{{ "heading_loop": {{ {rates} }} }}"#)).expect("warns");
    let loops = "the craft's heading and surge loops have no declared time constants";
    assert!(detail.starts_with(loops), "{detail}");
    has_all(&detail, &["at most 11°/s and 0.10 m/s²"]);
    assert_eq!(warning(r#"{ "heading_loop": { "time_constant_s": 2.0 } }"#), None);
}
