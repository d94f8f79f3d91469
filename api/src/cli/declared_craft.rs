//! `--craft`: the surface craft as it is declared to the planner.

use std::{fs, io};

use clap::Args;
use planner::craft::{CraftDescription, Preset};
use serde::de::DeserializeOwned;
use serde_json::{Value, json};

/// The surface craft as it is declared to the planner.
#[derive(Debug, Args)]
pub(crate) struct DeclaredCraft {
    /// The surface craft as declared to the planner, in place of the snapshot's or scenario's
    /// `craft`; their limits still apply. Either a name from `pilotfish crafts`, or a craft file,
    /// such as `pilotfish identify --craft` writes.
    #[arg(long, value_name = "NAME|FILE")]
    craft: Option<String>,
}

/// The declared craft cannot be read.
#[derive(Debug, thiserror::Error)]
pub(crate) enum NoDeclaredCraft {
    #[error("--craft {given}: neither a built-in craft (`pilotfish crafts` lists them) nor a readable file")]
    Read { given: String, source: io::Error },
    #[error("--craft {given}: not a craft file (see docs/craft.md)")]
    NotACraft {
        given: String,
        source: serde_json::Error,
    },
}

impl DeclaredCraft {
    /// The given `craft` object, whose members are checked, not their ranges.
    pub(crate) fn json(&self) -> Result<Option<Value>, NoDeclaredCraft> {
        self.read::<CraftDescription>()
            .map(|read| read.map(|(json, _)| json))
    }

    /// The given craft: its JSON and its value.
    pub(crate) fn read<T: DeserializeOwned>(&self) -> Result<Option<(Value, T)>, NoDeclaredCraft> {
        let Some(given) = self.craft.clone() else {
            return Ok(None);
        };
        let json = if Preset::named(&given).is_some() {
            json!({ "preset": given })
        } else {
            match fs::read(&given) {
                Ok(text) => {
                    match serde_json::from_slice(text.strip_prefix("\u{feff}".as_bytes()).unwrap_or(&text)) {
                        Ok(json) => json,
                        Err(source) => return Err(NoDeclaredCraft::NotACraft { given, source }),
                    }
                }
                Err(source) => return Err(NoDeclaredCraft::Read { given, source }),
            }
        };
        match serde_json::from_value(json.clone()) {
            Ok(craft) => Ok(Some((json, craft))),
            Err(source) => Err(NoDeclaredCraft::NotACraft { given, source }),
        }
    }
}
