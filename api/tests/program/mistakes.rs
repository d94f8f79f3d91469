//! The program's answers to mistakes of its users.

use std::fs;

use serde_json::Value;

use crate::command::{json, line, path, printed, said, stderr, stdout};

/// A snapshot whose craft is known by name.
const TRACK: &str = include_str!("../../../examples/snapshots/track.json");

#[test]
fn a_misspelt_scenario_is_answered_with_the_nearest_name() {
    let words = stderr(&line("simulate noisy-fixs")).to_owned();
    assert!(
        words.contains("unknown scenario \"noisy-fixs\" (did you mean \"noisy-fixes\"?); the built-in"),
        "{words}"
    );
    let words = stderr(&line("scenarios zzz")).to_owned();
    assert!(
        words.contains("unknown scenario \"zzz\"; the built-in scenarios are"),
        "{words}"
    );
}

#[test]
fn shells_complete_scenario_names_and_files_are_still_taken() {
    let script = printed(&line("completions bash"));
    let mut lines = script.lines();
    lines
        .find(|line| line.trim() == "pilotfish__subcmd__simulate)")
        .expect("has simulate");
    let options = lines.next().expect("are on a line");
    assert!(options.contains(" noisy-fixes "), "{options}");
    // No help names all of them.
    assert!(!stdout(&line("simulate --help")).contains("noisy-fixes"));
    let words = stderr(&line("simulate ./none.toml")).to_owned();
    assert!(
        words.contains("none.toml") && !words.contains("unknown"),
        "{words}"
    );
}

#[test]
fn a_command_of_another_package_names_that_package() {
    let output = line("ros2");
    assert_eq!(output.status.code(), Some(2));
    let words = stderr(&output);
    assert!(
        words.contains("pilotfish_ros2") && !words.contains("similar"),
        "{words}"
    );
    assert!(!stderr(&line("sail")).contains("brings it"));
}

#[test]
fn help_shows_the_flags_of_stored_missions_where_they_have_an_effect() {
    for command in ["plan", "simulate", "campaign", "campaign run", "man"] {
        let output = line(&format!("{command} --help"));
        let help = printed(&output);
        assert!(
            !help.contains("--data") && !help.contains("--tokens") && help.contains("--log"),
            "{command}: {help}"
        );
    }
    for command in ["serve", "replay", "token add", "bridge nmea"] {
        let help = printed(&line(&format!("{command} --help")));
        assert!(
            help.contains("--data") && help.contains("--tokens"),
            "{command}: {help}"
        );
    }
    // Scripts that give them to every command still work.
    printed(&line("scenarios --data elsewhere"));
    printed(&line("--data elsewhere scenarios"));
}

#[test]
fn an_unknown_log_level_is_refused() {
    let refused = line("scenarios --log loud");
    assert_eq!(refused.status.code(), Some(2));
    assert!(
        stderr(&refused).contains("must be a level (error, warn, info, debug, trace, off)"),
        "{}",
        stderr(&refused)
    );
}

#[test]
fn a_bridge_that_hears_no_craft_ends_in_the_given_time() {
    let folder = tempfile::tempdir().expect("there is room");
    let ended = line(&format!(
        "bridge mavlink --connect udp:127.0.0.1:0 --auv 1=auv-1 --end-after 1 --data {}",
        path(&folder, "data")
    ));
    assert_eq!(ended.status.code(), Some(1), "{}", said(&ended));
    let words = said(&ended);
    assert!(
        words.contains("no craft was heard on --connect within 1 s"),
        "{words}"
    );
}

#[test]
fn an_unknown_field_of_a_modem_file_is_named() {
    let folder = tempfile::tempdir().expect("there is room");
    let file = path(&folder, "usbl.json");
    fs::write(&file, r#"{ "modle": "seatrac" }"#).expect("is written");
    let refused = line(&format!(
        "bridge mavlink --connect udp:127.0.0.1:0 --auv 1=auv-1 --modem tcp:127.0.0.1:9={file}"
    ));
    let words = stderr(&refused);
    assert!(
        words.contains("usbl.json cannot be read as the settings of a modem")
            && words.contains("unknown field")
            && !words.contains("JSON"),
        "{words}"
    );
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
    assert!(
        detail.starts_with("the craft's heading and surge loops have no declared time constants")
            && detail.contains("at most 11°/s and 0.10 m/s²"),
        "{detail}"
    );
    assert_eq!(warning(r#"{ "heading_loop": { "time_constant_s": 2.0 } }"#), None);
}
