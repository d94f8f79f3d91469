//! `pilotfish crafts`: the craft that are known by name.

use std::error::Error;

use clap::Args;
use planner::craft::{PRESETS, Preset};
use wire::Craft;

use crate::cli::out_file::print;

#[derive(Debug, Args)]
pub(crate) struct Crafts {
    /// Print this craft's file: something to start one's own from.
    craft: Option<String>,
}

/// There is no craft of that name.
#[derive(Debug, thiserror::Error)]
#[error(
    "there is no craft {0:?}; the craft are {list}",
    list = PRESETS.iter().map(|preset| preset.name).collect::<Vec<_>>().join(", ")
)]
struct NoCraft(String);

/// Prints the list, or one craft's file.
pub(crate) fn crafts(arguments: &Crafts) -> Result<(), Box<dyn Error>> {
    let Some(name) = &arguments.craft else {
        let line = |preset: &Preset| {
            format!(
                "{:<12}{}\n{:12}source: {}\n",
                preset.name, preset.title, "", preset.source
            )
        };
        return Ok(print(&PRESETS.iter().map(line).collect::<String>())?);
    };
    let preset = Preset::named(name).ok_or_else(|| NoCraft(name.clone()))?;
    let craft = serde_json::to_string_pretty(&Craft::from(&preset.craft)).expect("a craft is JSON");
    Ok(print(&(craft + "\n"))?)
}
