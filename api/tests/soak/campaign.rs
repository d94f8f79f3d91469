//! A campaign that is killed repeatedly.

use std::{fs, process::Stdio, thread::sleep, time::Duration};

use tempfile::TempDir;

use crate::command::{SMALL_CAMPAIGN, path, pilotfish, printed, run};

#[test]
fn a_campaign_killed_repeatedly_ends_with_the_same_rows() {
    let folder = TempDir::new().expect("is a folder");
    let file = path(&folder, "small.toml");
    fs::write(&file, SMALL_CAMPAIGN).expect("is written");
    let (whole, killed) = (path(&folder, "whole"), path(&folder, "killed"));
    printed(&run(&["campaign", "run", &file, "--out", &whole, "--jobs", "2"]));
    let digest = printed(&run(&["campaign", "digest", &whole]));

    let mut kills = 0;
    for after_ms in [150, 400, 900, 700, 300, 1_200] {
        let mut flying = pilotfish()
            .args(["campaign", "run", &file, "--out", &killed, "--jobs", "2"])
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .expect("starts");
        sleep(Duration::from_millis(after_ms));
        kills += u32::from(flying.try_wait().expect("is ours").is_none());
        flying.kill().expect("is ours");
        flying.wait().expect("is ours");
    }
    assert!(2 <= kills, "it has to be killed to show anything: {kills}");
    printed(&run(&["campaign", "run", &file, "--out", &killed, "--jobs", "1"]));
    assert_eq!(printed(&run(&["campaign", "digest", &killed])), digest);
    // Finished runs are not repeated.
    let again = printed(&run(&["campaign", "run", &file, "--out", &killed]));
    assert!(again.contains(digest.trim()), "{again}");
}
