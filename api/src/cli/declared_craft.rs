//! `--craft`: the surface craft as it is declared to the planner.

use std::{fs, io};

use clap::Args;
use planner::craft::Preset;
use serde::de::DeserializeOwned;
use serde_json::{Value, json};

/// The surface craft as it is declared to the planner.
#[derive(Debug, Args)]
pub(crate) struct DeclaredCraft {
    /// The surface craft as the planner is to take it, instead of the `craft` of the snapshot or scenario, whose limits still
    /// count: a name that `pilotfish crafts` lists, or the path of a craft file, as `pilotfish identify --craft` writes it.
    #[arg(long, value_name = "NAME|FILE")]
    craft: Option<String>,
}

/// Why there is no craft to declare.
#[derive(Debug, thiserror::Error)]
pub(crate) enum NoDeclaredCraft {
    #[error("--craft {given}: no craft of that name (`pilotfish crafts` lists them), and no file to read")]
    Read { given: String, source: io::Error },
    #[error("--craft {given}: not a craft file (docs/craft.md has the members)")]
    NotACraft {
        given: String,
        source: serde_json::Error,
    },
}

impl DeclaredCraft {
    /// The `craft` object, if one is given: checked for its members, not for their ranges.
    pub(crate) fn json(&self) -> Result<Option<Value>, NoDeclaredCraft> {
        self.read::<wire::Craft>().map(|read| read.map(|(json, _)| json))
    }

    /// The craft, if one is given, as `T` writes it, and as it was written.
    pub(crate) fn read<T: DeserializeOwned>(&self) -> Result<Option<(Value, T)>, NoDeclaredCraft> {
        let Some(given) = self.craft.clone() else {
            return Ok(None);
        };
        let json = if Preset::named(&given).is_some() {
            json!({ "preset": given })
        } else {
            match fs::read(&given) {
                Ok(text) => match serde_json::from_slice(&text) {
                    Ok(json) => json,
                    Err(source) => return Err(NoDeclaredCraft::NotACraft { given, source }),
                },
                Err(source) => return Err(NoDeclaredCraft::Read { given, source }),
            }
        };
        match serde_json::from_value(json.clone()) {
            Ok(craft) => Ok(Some((json, craft))),
            Err(source) => Err(NoDeclaredCraft::NotACraft { given, source }),
        }
    }
}
