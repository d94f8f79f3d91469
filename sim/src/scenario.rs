//! Scenario files, some of them built in.
//!
//! TOML of the shape of [`Scenario`]. Any number may be a distribution, which each seed draws.

use std::{collections::BTreeMap, io, path::Path};

use planner::snapshot::{LIMITS_ALONE, Range, TIME, VISIT_COST, WEIGHT, ranges_by_shape};
use serde_json::{Value, json};

mod file;
mod files;
mod quantity;
mod set;
mod several;
mod source;
mod start;

pub use file::*;
pub use files::{Files, UnreadableFile};
pub use quantity::*;
pub use source::{Source, line_of, line_of_field};
pub use start::{InvalidScenario, Start};

use quantity::{schema_within, unit_of};
use several::{completed, relaxed};

macro_rules! built_in {
    ($($name:literal),* $(,)?) => {
        &[$(($name, include_str!(concat!("../scenarios/", $name, ".toml")))),*]
    };
}

/// The built-in scenarios: name and file.
const BUILT_IN: &[(&str, &str)] = built_in![
    "paper-path-following",
    "paper-tracking",
    "paper-intermittent",
    "paper-midpoint",
    "calm",
    "cross-current",
    "cross-current-unknown",
    "cross-current-sheared",
    "about-face",
    "switching",
    "switching-opposed",
    "anti-phase",
    "target-stops",
    "silence",
    "silence-path",
    "silence-path-drift",
    "noisy-fixes",
    "fast-lawn-mower",
    "survey-lanes",
    "survey-declared",
    "survey-resumed",
    "survey-random",
    "crowded",
    "rough-water",
    "faults",
    "otter",
    "slocum",
    "localise-straight",
    "localise-lanes",
    "localise-dives",
    "localise-two",
    "localise-three",
    "localise-square",
    "localise-anchored",
    "localise-transponder",
    "localise-beacon",
    "localise-tag",
    "visit-near",
    "visit-far",
    "visit-five",
    "visit-gliders",
    "visit-relay",
    "visit-dies",
    "visit-unknown",
    "visit-noisy",
    "visit-current",
    "visit-ranges",
    "traffic-head-on",
    "traffic-crossing",
    "traffic-ferry",
    "traffic-anchored",
    "traffic-lane",
    "no-go-bay",
    "no-go-strait",
    "fleet-survey",
    "fleet-square",
    "fleet-dies",
    "fleet-speeds",
    "fleet-localise",
    "fleet-relay",
    "fleet-traffic",
];

/// Largest size of a scenario file, bytes: hundreds of times the largest built-in one.
const SCENARIO_BYTES_MAX: u64 = 1_000_000;

/// Reason why a scenario file was refused.
#[derive(Debug, thiserror::Error)]
pub enum ScenarioError {
    /// It cannot be read.
    #[error("cannot read {0}")]
    Unreadable(String, #[source] io::Error),
    /// Invalid: the file, the line from 1 on, the member with value and limit.
    #[error("{0}:{1}: {2}")]
    Invalid(String, usize, InvalidScenario),
}

impl Scenario {
    /// The names of the built-in scenarios.
    pub fn names() -> Vec<&'static str> {
        BUILT_IN.iter().map(|(name, _)| *name).collect()
    }

    /// The file of the built-in scenario of that name.
    pub fn text(name: &str) -> Option<&'static str> {
        BUILT_IN.iter().find_map(|(known, text)| (*known == name).then_some(*text))
    }

    /// The built-in scenario of that name.
    pub fn named(name: &str) -> Option<Self> {
        let scenario = Self::parse(Self::text(name)?, name, Files::default());
        Some(scenario.expect("a test reads every built-in scenario"))
    }

    /// The scenario in the file at `path`. Files that it names are in the same folder.
    pub fn read(path: &Path) -> Result<Self, ScenarioError> {
        let file = path.display().to_string();
        let text = files::read(path, SCENARIO_BYTES_MAX)
            .and_then(|bytes| String::from_utf8(bytes).map_err(io::Error::other))
            .map_err(|error| ScenarioError::Unreadable(file.clone(), error))?;
        let beside = path.parent().unwrap_or(Path::new("."));
        Self::parse(&text, &file, Files::beside(beside))
    }

    /// The scenario in `text`, read from `file`. [`Self::start`] checks if its numbers fit.
    pub fn parse(text: &str, file: &str, files: Files) -> Result<Self, ScenarioError> {
        let mut source = Source { file: file.to_owned(), text: text.to_owned(), tree: Value::Null };
        // A tree between text and types: they are then compiled for one reader, in half the time.
        source.tree = toml::from_str(text).map_err(|error| source.unreadable(&error))?;
        let scenario = Self::of_tree(&source.tree).map_err(|wrong| source.refused(wrong))?;
        Ok(Self { files, source, ..scenario })
    }

    /// The same scenario, if its numbers fit together with one seed.
    pub fn checked(self) -> Result<Self, ScenarioError> {
        self.start(0).map(|_| self)
    }

    fn of_tree(tree: &Value) -> Result<Self, InvalidScenario> {
        let tree = completed(tree).map_err(|(craft, shared)| InvalidScenario {
            field: format!("surface_craft[{craft}].{shared}"),
            reason: "all craft have that of the first: give it there alone".to_owned(),
        })?;
        serde_path_to_error::deserialize(&*tree).map_err(|error| {
            let field = error.path().to_string();
            // The path of the whole file is a dot.
            let field = if field == "." { "file".to_owned() } else { field };
            // TOML has no null: a number in the tree was NaN or infinite.
            let reason = error.inner().to_string().replace("type: null", "value: not a finite number");
            InvalidScenario { field, reason }
        })
    }

    /// The texts of the files that it names, by name, for [`Files::kept`].
    pub fn texts_beside(&self) -> Result<BTreeMap<String, String>, UnreadableFile> {
        let grid = match &self.water.current {
            Some(CurrentFile::Grid { file }) => Some(file),
            _ => None,
        };
        let lines = self.auvs.iter().filter_map(|auv| match &auv.path {
            Some(PathFile::Geojson { file, .. }) => Some(file),
            _ => None,
        });
        let tracks = self.auvs.iter().filter_map(|auv| auv.track.as_ref());
        let names = grid.into_iter().chain(lines).chain(tracks);
        names.map(|name| Ok((name.clone(), self.files.text(name)?))).collect()
    }

    /// The JSON Schema of scenario files.
    pub fn schema() -> serde_json::Value {
        let mut schema = schemars::schema_for!(Self).to_value();
        // The planner's shapes have numbers without a range; the table of ranges is the planner's.
        let ranges = ranges_by_shape().chain(LIMITS_ALONE.map(|range| ("Limits", range)));
        for (shape, (member, range)) in ranges {
            // The goals `visit` and `localise` are shapes of their own here.
            let own: &[&str] = if shape == "Goal" { &["Visits", "Localise"] } else { &[] };
            let shapes = [shape].into_iter().chain(own.iter().copied());
            let number = schema_within(&range, unit_of(member));
            for shape in shapes {
                for property in members(&mut schema, shape, member) {
                    let description = match (shape, &property["description"]) {
                        ("Limits", Value::String(text)) => json!(of_the_class(member, text)),
                        (_, text) => text.clone(),
                    };
                    *property = json!({ "description": description, "anyOf": [number] });
                }
            }
        }
        for (member, range) in NUMBERS_BY_AUV {
            let number = schema_within(&range, unit_of(member));
            for shape in ["Goal", "Localise", "Visits"] {
                for property in members(&mut schema, shape, member) {
                    property["additionalProperties"] = json!(number);
                }
            }
        }
        relaxed(&mut schema);
        schema
    }

    /// The scenario with this `duration`, s. Settled metrics begin at 0 if they would begin later.
    #[must_use]
    pub fn lasting(mut self, duration: f64) -> Self {
        let duration = duration.clamp(*MissionTime::RANGE.start(), MissionTime::MAX);
        self.duration_s = Quantity::fixed(duration);
        if duration.floor() - 1.0 < self.settled_after_s.most() {
            self.settled_after_s = Quantity::fixed(0.0);
        }
        self
    }

    /// `true` if there is a surface craft to guide.
    pub fn has_surface_craft(&self) -> bool {
        !self.surface_craft.is_empty()
    }

    /// `true` with several surface craft, for [`crate::fleet`]; all else flies the first alone.
    pub fn has_fleet(&self) -> bool {
        1 < self.surface_craft.len()
    }
}

/// Numbers of a goal that have the names of AUVs.
const NUMBERS_BY_AUV: [Range; 3] = [("weights", WEIGHT), ("serve_by_s", TIME), ("costs_now", VISIT_COST)];

/// The schemas of a member of a shape, or of each of its kinds that has it.
fn members<'a>(schema: &'a mut Value, shape: &str, member: &str) -> Vec<&'a mut Value> {
    let Some(shape) = schema.pointer_mut(&format!("/$defs/{shape}")) else { return vec![] };
    let objects = if shape.get("oneOf").is_some() {
        let kinds = shape["oneOf"].as_array_mut().into_iter().flatten();
        let named = kinds.filter_map(|kind| kind.get_mut("properties")?.as_object_mut());
        named.flat_map(|named| named.values_mut()).collect()
    } else {
        vec![shape]
    };
    let place = format!("/properties/{member}");
    let of = |object: &'a mut Value| object.pointer_mut(&place);
    objects.into_iter().filter_map(of).collect()
}

/// The description of a limit, whose default in a scenario is that of the craft's class.
fn of_the_class(member: &str, description: &str) -> String {
    let (what, _) = description.split_once(['.', ';']).unwrap_or((description, ""));
    let default = if member == "surge_lag_s" { "that of `craft`" } else { "the class's" };
    format!("{what}; {default} if left out.")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tests::rows;

    #[test]
    fn every_built_in_file_has_the_name_of_its_scenario() {
        for name in Scenario::names() {
            assert_eq!(Scenario::named(name).expect("listed").name, name);
        }
        assert!(Scenario::named("nowhere").is_none());
    }

    #[test]
    fn a_wrong_file_names_line_member_value_and_limit() {
        let text = Scenario::text("paper-midpoint").expect("exists");
        for [right, wrong, says] in rows(
            r#"
            duration_s = 1800       | duration_s = 1e9              | duration_s: 1000000000 is outside 1 to 86400 s
            duration_s = 1800       | duration_s = "long"           | duration_s: invalid type
            duration_s = 1800       | duration_s =                  | syntax
            settled_after_s = 120   | settled_after_s = 1800        | settled_after_s: 1800 s is less than a second before
            id = "auv-2"            | id = "auv-1"                  | auvs[1].id: "auv-1" is the name of two
            auvs = ["auv-1", "auv-2"] | auvs = ["auv-1", "auv-3"]   | auvs[1]: no vehicle in `auvs` has this id (given: "auv-3")
            lanes = 4               | lanes = 0                     | lawn_mower.lanes: 0 is outside 1 to 100
            lane_length_m = 100     | lane_length = 100             | lane_length: unknown field `lane_length`, expected one of
            contact_range_m = 30    |                               | surface_craft: missing field `contact_range_m`
            class = "medusa"        | class = "catamaran"           | surface_craft.class: unknown variant `catamaran`
            "#,
        ) {
            assert!(text.contains(&right), "{right}");
            let text = text.replacen(&right, &wrong, 1);
            let read = Scenario::parse(&text, "my.toml", Files::default());
            let error = read.and_then(Scenario::checked).expect_err(&wrong);
            let message = error.to_string();
            assert!(message.contains(&says), "{message}");
            // The last line: an earlier equal one is right. A missing member is on no line: its
            // table is named.
            let wrong = if wrong.is_empty() { "[surface_craft]" } else { &wrong };
            let lines: Vec<&str> = text.lines().collect();
            let line = lines.iter().rposition(|line| line.contains(wrong)).expect("there") + 1;
            let begin = format!("my.toml:{line}: ");
            assert!(message.starts_with(&begin), "{message}, {begin}");
        }
    }
}
