//! `pilotfish campaign` for its users: in parts, inspected, refused.

use std::{fs, path::Path, process::Output};

use tempfile::TempDir;

use crate::command::{self, SMALL_CAMPAIGN, has_all, path, printed, refusal, written};

fn run(arguments: &[&str]) -> Output {
    command::run(&[&["campaign"], arguments].concat())
}

#[test]
fn a_campaign_that_cannot_be_flown_says_what_to_do() {
    let folder = TempDir::new().expect("is a folder");
    let none = SMALL_CAMPAIGN.replace("replicates = 8", "replicates = 0");
    let none = written(&folder, "none.toml", &none);
    let file = written(&folder, "small.toml", SMALL_CAMPAIGN);
    let [nothing, nowhere] = ["nothing", "nowhere.toml"].map(|name| path(&folder, name));
    let shard = "is not a shard: write 1/3 for the first of three";
    for (arguments, says) in [
        (&["run", &*none][..], "none.toml:7: replicates: 0 is outside 1 to 1000000"),
        (&["run", &file, "--shard", "4/3"], shard),
        (&["replay", &nothing, "0"], "holds no campaign"),
        (&["run", &nowhere], "cannot read"),
    ] {
        has_all(refusal(&run(arguments)), &[says]);
    }
    let out = path(&folder, "out");
    let outline = printed(&run(&["run", &file, "--dry-run", "--out", &out]));
    has_all(&outline, &["32 runs at most"]);
    assert!(!Path::new(&out).exists());
    has_all(&printed(&run(&["schema"])), &["\"replicates\""]);
}

#[test]
fn every_campaign_of_the_examples_is_one() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples/campaigns");
    let mut n = 0;
    for entry in fs::read_dir(folder).expect("is there") {
        let file = entry.expect("is there").path();
        // Their own scenarios are in a folder.
        if file.is_dir() {
            continue;
        }
        let outline = printed(&run(&["run", &file.display().to_string(), "--dry-run"]));
        has_all(&outline, &["runs at most"]);
        n += 1;
    }
    assert!(8 <= n, "{n}");
}

mod slow {
    use super::*;

    #[test]
    fn a_campaign_in_parts_has_the_same_rows_and_is_flown_again() {
        let folder = TempDir::new().expect("is a folder");
        let file = written(&folder, "small.toml", SMALL_CAMPAIGN);
        let whole = path(&folder, "whole");
        printed(&run(&["run", &file, "--out", &whole, "--jobs", "2"]));
        let digest = printed(&run(&["digest", &whole]));

        let parts: Vec<String> = (1..=3).map(|i| path(&folder, &format!("part-{i}"))).collect();
        for (i, part) in (1..).zip(&parts) {
            printed(&run(&["run", &file, "--out", part, "--shard", &format!("{i}/3")]));
        }
        let merged = path(&folder, "merged");
        let all: Vec<&str> =
            ["merge", "--out", &merged].into_iter().chain(parts.iter().map(String::as_str)).collect();
        printed(&run(&all));
        assert_eq!(printed(&run(&["digest", &merged])), digest);

        let again = printed(&run(&["replay", &merged, "0"]));
        has_all(&again, &["mpc auto in paper-tracking, replicate 0: the same row, to the bit"]);
        assert!(Path::new(&merged).join("replay-0.html").exists());
    }
}
