//! `--craft`: the surface craft as it is declared to the planner.

use std::fs;

use clap::Args;
use planner::craft::{CraftDescription, Preset};
use serde::de::DeserializeOwned;
use serde_json::{Value, json};

use super::failure::{Failure, because_of};

/// The surface craft as it is declared to the planner.
#[derive(Debug, Args)]
pub(crate) struct DeclaredCraft {
    /// The surface craft as declared to the planner, in place of the snapshot's or scenario's
    /// `craft`; their limits still apply. Either a name from `pilotfish crafts`, or a craft file,
    /// such as `pilotfish identify --craft` writes.
    #[arg(long, value_name = "NAME|FILE")]
    craft: Option<String>,
}

impl DeclaredCraft {
    /// The given `craft` object, whose members are checked, not their ranges.
    pub(crate) fn json(&self) -> Result<Option<Value>, Failure> {
        self.read::<CraftDescription>().map(|read| read.map(|(json, _)| json))
    }

    /// The given craft: its JSON and its value.
    pub(crate) fn read<T: DeserializeOwned>(&self) -> Result<Option<(Value, T)>, Failure> {
        let Some(given) = &self.craft else { return Ok(None) };
        let wrong = format!("--craft {given}: not a craft file (see docs/craft.md)");
        let json = if Preset::named(given).is_some() {
            json!({ "preset": given })
        } else {
            let text = fs::read(given).map_err(because_of(format!(
                "--craft {given}: neither a built-in craft (`pilotfish crafts` lists them) nor a readable file"
            )))?;
            let json = text.strip_prefix("\u{feff}".as_bytes()).unwrap_or(&text);
            serde_json::from_slice(json).map_err(because_of(&*wrong))?
        };
        let craft = serde_json::from_value(json.clone()).map_err(because_of(wrong))?;
        Ok(Some((json, craft)))
    }
}
