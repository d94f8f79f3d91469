//! The roles of callers, and the missions that a caller may be limited to.

use std::fmt;

use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};
use utoipa::ToSchema;
use wire::mission::Mission;

/// Member of a mission's metadata that names its craft: `--name` of the bridge that created it.
const CRAFT: &str = "bridge";

/// The permissions of a caller. Each role includes the ones before it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Role {
    /// May ask for plans and see missions, and changes nothing.
    ReadOnly,
    /// May also create missions, run them and post reports.
    Operator,
    /// May also delete missions and read the audit list.
    Admin,
}

impl Role {
    /// Every role, from least to most.
    pub const ALL: [Self; 3] = [Self::ReadOnly, Self::Operator, Self::Admin];

    /// Its name in files, on the command line and in answers.
    pub fn name(self) -> &'static str {
        match self {
            Self::ReadOnly => "read-only",
            Self::Operator => "operator",
            Self::Admin => "admin",
        }
    }
}

/// Missions to which a token is limited: the named ones, and all of the named craft.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct TokenLimit {
    /// IDs of missions.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub missions: Vec<String>,
    /// Names of craft, which missions have in `metadata.bridge`, or fleets in `surface_craft`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub craft: Vec<String>,
}

impl TokenLimit {
    pub(crate) fn names(&self, id: &str) -> bool {
        self.missions.iter().any(|mission| mission == id)
    }

    /// `true` if it names the mission, its craft, or one of its fleet: the caller may see it, and
    /// report for that craft.
    pub(crate) fn sees(&self, mission: &Mission) -> bool {
        let fleet = mission.setting.iter().flat_map(|setting| &setting.surface_craft).flatten();
        let mut fleet = fleet.map(|craft| &craft.id.0);
        self.commands(mission) || fleet.any(|craft| self.names_craft(craft))
    }

    /// `true` if it names the mission, or its craft: the caller may also give it orders.
    pub(crate) fn commands(&self, mission: &Mission) -> bool {
        self.names(&mission.id) || self.names_craft_of(&mission.metadata)
    }

    pub(crate) fn names_craft(&self, craft: &str) -> bool {
        self.craft.iter().any(|named| named == craft)
    }

    pub(crate) fn names_craft_of(&self, metadata: &Map<String, Value>) -> bool {
        let craft = metadata.get(CRAFT).and_then(Value::as_str);
        craft.is_some_and(|craft| self.names_craft(craft))
    }
}

impl fmt::Display for TokenLimit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { missions, craft } = self;
        let mut listed = vec![];
        for (kind, names) in [("missions", missions), ("craft", craft)] {
            if !names.is_empty() {
                listed.push(format!("{kind} {}", names.join(", ")));
            }
        }
        f.write_str(&listed.join("; "))
    }
}

impl fmt::Display for Role {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}
