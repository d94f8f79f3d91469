//! Scenario files of a campaign with the files that they name, so that it can be flown anywhere.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use sim::scenario::{Files, Scenario, ScenarioError};

use crate::campaign::file::{CampaignError, CampaignFile};

/// Scenario files of a campaign, by name.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct ScenarioFiles(BTreeMap<String, ScenarioFile>);

#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
struct ScenarioFile {
    text: String,
    /// Texts of the files that it names, by name.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    beside: BTreeMap<String, String>,
}

impl ScenarioFiles {
    pub(super) fn read(campaign: &CampaignFile, folder: &Path) -> Result<Self, CampaignError> {
        let mut files = BTreeMap::new();
        for (i, name) in campaign.scenarios.iter().enumerate() {
            let is_path = Path::new(name).extension().is_some() || 1 < Path::new(name).components().count();
            if !is_path {
                continue;
            }
            let path: PathBuf = folder.join(name);
            // Numbers that do not fit together are found before hours of work.
            let scenario = Scenario::read(&path)?.checked()?;
            let beside = scenario.texts_beside().map_err(|error| {
                let (file, field) = (path.display().to_string(), format!("scenarios[{i}]"));
                CampaignError::Invalid(file, 1, field, error.to_string())
            })?;
            let text = scenario.source.text;
            files.insert(name.clone(), ScenarioFile { text, beside });
        }
        Ok(Self(files))
    }

    /// The scenario of that name; none if there is no such file.
    pub(super) fn scenario(&self, name: &str) -> Option<Result<Scenario, ScenarioError>> {
        let file = self.0.get(name)?;
        let beside = Files::kept(file.beside.clone());
        Some(Scenario::parse(&file.text, name, beside))
    }

    /// Their contents, for a digest.
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
        let mut failures = rows.words("failure").expect("a column").into_iter();
        assert!(failures.all(str::is_empty));
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
}
