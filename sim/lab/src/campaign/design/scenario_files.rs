//! Scenario files that a campaign names, with the files that they name: with them it can be flown anywhere.

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
};

use serde::{Deserialize, Serialize};
use sim::scenario::{Files, Scenario, ScenarioError};

use crate::campaign::file::{CampaignError, CampaignFile};

/// Scenario files of a campaign, by the names that it calls them.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct ScenarioFiles(BTreeMap<String, ScenarioFile>);

/// A scenario file.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
struct ScenarioFile {
    text: String,
    /// Texts of the files that it names, by name.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    beside: BTreeMap<String, String>,
}

impl ScenarioFiles {
    /// Those that `campaign` names and does not have in itself, read from `folder`.
    pub(super) fn read(campaign: &CampaignFile, folder: &Path) -> Result<Self, CampaignError> {
        let mut files = BTreeMap::new();
        for (i, name) in campaign.scenarios.iter().enumerate() {
            let is_path = Path::new(name).extension().is_some() || 1 < Path::new(name).components().count();
            if !is_path || campaign.scenario_files.contains_key(name) {
                continue;
            }
            let path: PathBuf = folder.join(name);
            let scenario = Scenario::read(&path)?;
            let beside = scenario.texts_beside().map_err(|error| CampaignError::Invalid {
                file: path.display().to_string(),
                line: 1,
                field: format!("scenarios[{i}]"),
                reason: error.to_string(),
            })?;
            let text = scenario.source.text;
            files.insert(name.clone(), ScenarioFile { text, beside });
        }
        Ok(Self(files))
    }

    /// The scenario in the file called `name`, if it is here.
    pub(super) fn scenario(&self, name: &str) -> Option<Result<Scenario, ScenarioError>> {
        let file = self.0.get(name)?;
        Some(Scenario::parse(
            &file.text,
            name,
            Files::kept(file.beside.clone()),
        ))
    }

    /// All that is in them, for a digest.
    pub(in crate::campaign) fn parts(&self) -> impl Iterator<Item = String> {
        self.0.iter().flat_map(|(name, file)| {
            let beside = file.beside.iter().map(|(name, text)| format!("{name}\0{text}"));
            std::iter::once(format!("{name}\0{}", file.text)).chain(beside)
        })
    }
}

#[cfg(test)]
mod tests {
    use std::{fs, num::NonZeroUsize};

    use tempfile::TempDir;

    use super::*;
    use crate::campaign::{Campaign, Directory, Manifest, Shard, run};

    const CAMPAIGN: &str = r#"
schema_version = "1"
name = "elsewhere"
title = "a scenario of one's own, with a grid of currents and a track of its own"
scenarios = ["waters/mine.toml", "calm"]
duration_s = 20
replicates = 1
[[parameters]]
key = "surface_craft.speed_mps"
uniform = [0.2, 0.4]
[[controllers]]
name = "planner"
planner = {}
"#;

    /// The cross-current with its water in a grid, and its path on a map.
    fn mine() -> String {
        let built_in = Scenario::text("cross-current").expect("is built in");
        let (before, path_and_water) = built_in.split_once("[auvs.path.lawn_mower]").expect("has a path");
        assert!(path_and_water.contains("[water.current.constant]"));
        let before = before.replace("\"cross-current\"", "\"mine\"");
        format!(
            "{before}[auvs.path.geojson]\nfile = \"track.geojson\"\nfillet_m = 5\n\n\
             [water.current.grid]\nfile = \"grid.csv\"\n"
        )
    }

    fn folder(east_mps: f64) -> TempDir {
        let folder = TempDir::new().expect("is a folder");
        let waters = folder.path().join("waters");
        fs::create_dir(&waters).expect("is new");
        let track =
            r#"{"type": "LineString", "coordinates": [[-9.12, 38.41], [-9.12, 38.411], [-9.119, 38.411]]}"#;
        let grid = format!(
            "t_s,north_m,east_m,current_north_mps,current_east_mps\n0,0,0,0,{east_mps}\n0,500,0,0,{east_mps}\n"
        );
        for (name, text) in [
            ("campaign.toml", CAMPAIGN),
            ("waters/mine.toml", &mine()),
            ("waters/track.geojson", track),
            ("waters/grid.csv", &grid),
        ] {
            fs::write(folder.path().join(name), text).expect("is written");
        }
        folder
    }

    fn read(folder: &TempDir) -> Campaign {
        Campaign::read(&folder.path().join("campaign.toml")).expect("is a campaign")
    }

    fn flown(campaign: &Campaign) -> String {
        let out = TempDir::new().expect("is a folder");
        let directory = Directory::create(out.path(), Manifest::of(campaign, Shard::WHOLE)).expect("is new");
        let rows = run(campaign, &directory, NonZeroUsize::MIN, &mut |_| {}).expect("flies");
        assert!(
            rows.words("failure")
                .expect("a column")
                .iter()
                .all(|why| why.is_empty())
        );
        rows.digest()
    }

    #[test]
    fn a_campaign_takes_its_scenarios_and_their_files_with_it() {
        let here = folder(0.12);
        let campaign = read(&here);
        let manifest = Manifest::of(&campaign, Shard::WHOLE);
        let json = serde_json::to_string(&manifest).expect("is JSON");
        let rows = flown(&campaign);
        // Gone, as seen from another machine.
        drop(here);
        let received: Manifest = serde_json::from_str(&json).expect("is a manifest");
        assert_eq!(received, manifest);
        let there = received.campaign("elsewhere").expect("needs no file");
        assert_eq!(Manifest::of(&there, Shard::WHOLE).digest, manifest.digest);
        assert_eq!(flown(&there), rows);
        // Other water is another campaign, though its file and its scenarios say the same.
        let other = read(&folder(0.2));
        assert_ne!(Manifest::of(&other, Shard::WHOLE).digest, manifest.digest);
        assert_ne!(flown(&other), rows);
    }

    #[test]
    fn a_scenario_in_the_campaign_file_is_the_file_beside_it() {
        let text = Scenario::text("cross-current")
            .expect("is built in")
            .replace("\"cross-current\"", "\"mine\"");
        let folder = TempDir::new().expect("is a folder");
        fs::create_dir(folder.path().join("waters")).expect("is new");
        fs::write(folder.path().join("waters/mine.toml"), &text).expect("is written");
        let file = folder.path().join("campaign.toml");
        fs::write(&file, CAMPAIGN).expect("is written");
        let beside = Campaign::read(&file).expect("is a campaign");
        let one_file = format!("{CAMPAIGN}\n[scenario_files]\n\"waters/mine.toml\" = '''{text}'''\n");
        let inside = Campaign::parse(&one_file, "one.toml", ScenarioFiles::default()).expect("is a campaign");
        assert_eq!(flown(&inside), flown(&beside));
    }

    #[test]
    fn what_is_wrong_with_a_scenario_file_is_named() {
        let text = Scenario::text("calm").expect("is built in");
        for (name, key, text, says) in [
            (
                "crowded",
                "calm",
                text.to_owned(),
                "one.toml:9: scenario_files.calm: is the name of a built-in scenario",
            ),
            (
                "crowded",
                "mine",
                text.to_owned(),
                "one.toml:9: scenario_files.mine: scenarios does not name it",
            ),
            (
                "mine",
                "mine",
                text.to_owned(),
                "one.toml:5: scenarios[1]: calm is the second with the name calm",
            ),
            (
                "mine",
                "mine",
                text.replace("speed_mps = 0.19", "speed_mps = -3"),
                "mine:18: surface_craft.speed_mps: -3",
            ),
            (
                "x.toml",
                "",
                text.to_owned(),
                "one.toml:5: scenarios[0]: there is no scenario \"x.toml\", only paper-path",
            ),
        ] {
            let file = CAMPAIGN.replace("waters/mine.toml", name);
            let (head, rest) = file.split_once("[[parameters]]").expect("has parameters");
            let files = if key.is_empty() {
                String::new()
            } else {
                format!("[scenario_files]\n{key} = '''{text}'''\n")
            };
            let file = format!("{head}{files}[[parameters]]{rest}");
            let refused = Campaign::parse(&file, "one.toml", ScenarioFiles::default())
                .expect_err(says)
                .to_string();
            assert!(refused.contains(says), "{refused}");
        }
        let here = folder(0.12);
        fs::remove_file(here.path().join("waters/grid.csv")).expect("is there");
        let refused = Campaign::read(&here.path().join("campaign.toml"))
            .expect_err("there is no water")
            .to_string();
        assert!(
            refused.contains("waters/mine.toml:") && refused.contains("grid.csv"),
            "{refused}"
        );
    }
}
