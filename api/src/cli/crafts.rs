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
        let line = |craft: &Preset| {
            let (name, title, source) = (craft.name, craft.title, craft.source);
            format!("{name:<12}{title}\n{:12}source: {source}\n", "")
        };
        return Ok(print(&PRESETS.iter().map(line).collect::<String>())?);
    };
    let preset = Preset::named(name).ok_or_else(|| {
        let names: Vec<_> = PRESETS.iter().map(|preset| preset.name).collect();
        let names = names.join(", ");
        format!("unknown craft {name:?}; the built-in craft are {names}")
    })?;
    Ok(print_json(&CraftDescription::from(&preset.craft))?)
}
