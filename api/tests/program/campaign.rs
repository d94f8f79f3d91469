//! `pilotfish campaign` for its users: in parts, inspected, refused.

use std::{fs, path::Path, process::Output};

use tempfile::TempDir;

use crate::command::{self, SMALL_CAMPAIGN, path, printed};

fn run(arguments: &[&str]) -> Output {
    command::run(&[&["campaign"], arguments].concat())
}

#[test]
fn a_campaign_that_cannot_be_flown_says_what_to_do() {
    let folder = TempDir::new().expect("is a folder");
    let file = path(&folder, "small.toml");
    let refused = |arguments: &[&str], says: &str| {
        let output = run(arguments);
        let words = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(
            !output.status.success() && words.contains(says),
            "{words}\nshould say {says}"
        );
    };
    fs::write(&file, SMALL_CAMPAIGN.replace("replicates = 8", "replicates = 0")).expect("is written");
    refused(
        &["run", &file],
        "small.toml:7: replicates: 0 is outside 1 to 1000000",
    );
    fs::write(&file, SMALL_CAMPAIGN).expect("is written");
    refused(
        &["run", &file, "--shard", "4/3"],
        "is not a shard: write 1/3 for the first of three",
    );
    refused(&["replay", &path(&folder, "nothing"), "0"], "holds no campaign");
    refused(&["run", &path(&folder, "none.toml")], "cannot read");
    let out = path(&folder, "out");
    let outline = printed(&run(&["run", &file, "--dry-run", "--out", &out]));
    assert!(
        outline.contains("32 runs at most") && !Path::new(&out).exists(),
        "{outline}"
    );
    assert!(printed(&run(&["schema"])).contains("\"replicates\""));
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
        assert!(outline.contains("runs at most"), "{outline}");
        n += 1;
    }
    assert!(8 <= n, "{n}");
}

mod slow {
    use super::*;

    #[test]
    fn a_campaign_in_parts_has_the_same_rows_and_is_flown_again() {
        let folder = TempDir::new().expect("is a folder");
        let file = path(&folder, "small.toml");
        fs::write(&file, SMALL_CAMPAIGN).expect("is written");
        let whole = path(&folder, "whole");
        printed(&run(&["run", &file, "--out", &whole, "--jobs", "2"]));
        let digest = printed(&run(&["digest", &whole]));

        let parts: Vec<String> = (1..=3).map(|i| path(&folder, &format!("part-{i}"))).collect();
        for (i, part) in (1..).zip(&parts) {
            printed(&run(&["run", &file, "--out", part, "--shard", &format!("{i}/3")]));
        }
        let merged = path(&folder, "merged");
        let all: Vec<&str> = ["merge", "--out", &merged]
            .into_iter()
            .chain(parts.iter().map(String::as_str))
            .collect();
        printed(&run(&all));
        assert_eq!(printed(&run(&["digest", &merged])), digest);

        let again = printed(&run(&["replay", &merged, "0"]));
        assert!(
            again.contains("mpc auto in paper-tracking, replicate 0: the same row, to the bit"),
            "{again}"
        );
        assert!(Path::new(&merged).join("replay-0.html").exists());
    }
}
