//! `--craft`: what the planner is told of the surface craft.

use std::{fs, io};

use clap::Args;
use planner::craft::Preset;
use serde::de::DeserializeOwned;
use serde_json::{Value, json};

/// What the planner is told of the surface craft.
#[derive(Debug, Args)]
pub(crate) struct ToldCraft {
    /// What the planner is told of the surface craft, instead of the `craft` of the snapshot or scenario, whose limits still
    /// count: a name that `pilotfish crafts` lists, or the path of a craft file, as `pilotfish identify --craft` writes it.
    #[arg(long, value_name = "NAME|FILE")]
    craft: Option<String>,
}

/// Why the planner cannot be told of a craft.
#[derive(Debug, thiserror::Error)]
pub(crate) enum NoToldCraft {
    #[error("--craft {given}: no craft of that name (`pilotfish crafts` lists them), and no file to read")]
    Read { given: String, source: io::Error },
    #[error("--craft {given}: not a craft file (docs/craft.md has the members)")]
    NotACraft {
        given: String,
        source: serde_json::Error,
    },
}

impl ToldCraft {
    /// The `craft` object, if one is given: checked for its members, not for their ranges.
    pub(crate) fn json(&self) -> Result<Option<Value>, NoToldCraft> {
        self.read::<api::wire::Craft>()
            .map(|read| read.map(|(json, _)| json))
    }

    /// The craft, if one is given, as `T` writes it, and as it was written.
    pub(crate) fn read<T: DeserializeOwned>(&self) -> Result<Option<(Value, T)>, NoToldCraft> {
        let Some(given) = self.craft.clone() else {
            return Ok(None);
        };
        let json = if Preset::named(&given).is_some() {
            json!({ "preset": given })
        } else {
            match fs::read(&given) {
                Ok(text) => match serde_json::from_slice(&text) {
                    Ok(json) => json,
                    Err(source) => return Err(NoToldCraft::NotACraft { given, source }),
                },
                Err(source) => return Err(NoToldCraft::Read { given, source }),
            }
        };
        match serde_json::from_value(json.clone()) {
            Ok(craft) => Ok(Some((json, craft))),
            Err(source) => Err(NoToldCraft::NotACraft { given, source }),
        }
    }
}
