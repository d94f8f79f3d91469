//! `pilotfish crafts`: the built-in craft.

use std::error::Error;

use clap::Args;
use planner::craft::{CraftDescription, PRESETS, Preset};

use crate::cli::out_file::{print, print_json};

#[derive(Debug, Args)]
pub(crate) struct Crafts {
    /// Print the craft file of this craft, as a start for your own.
    craft: Option<String>,
}

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
    let preset = Preset::named(name).ok_or_else(|| {
        let names: Vec<_> = PRESETS.iter().map(|preset| preset.name).collect();
        format!(
            "unknown craft {name:?}; the built-in craft are {}",
            names.join(", ")
        )
    })?;
    Ok(print_json(&CraftDescription::from(&preset.craft))?)
}
