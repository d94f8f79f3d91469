//! `pilotfish scenarios`: what there is to simulate, and how to write one's own.

use std::{error::Error, path::Path};

use clap::Args;
use sim::scenario::{Scenario, ScenarioError};

use crate::cli::out_file::print;

#[derive(Debug, Args)]
pub(crate) struct Scenarios {
    /// Print the file of this scenario: something to start one's own from, with the command that writes its schema.
    scenario: Option<String>,
    /// Print the JSON Schema of scenario files.
    #[arg(long, conflicts_with = "scenario")]
    schema: bool,
}

/// Why no scenario was found.
#[derive(Debug, thiserror::Error)]
pub(crate) enum NoScenario {
    #[error(
        "there is no scenario {0:?}; the scenarios are {list}; a file of your own is given by its path, as ./my.toml",
        list = Scenario::names().join(", ")
    )]
    Unknown(String),
    #[error(transparent)]
    File(#[from] ScenarioError),
}

/// The scenario that a command line names: a built-in one, or the file at a path.
pub(crate) fn scenario(argument: &str) -> Result<Scenario, NoScenario> {
    let path = Path::new(argument);
    if path.extension().is_some() || path.components().count() != 1 {
        return Ok(Scenario::read(path)?);
    }
    Scenario::named(argument).ok_or_else(|| NoScenario::Unknown(argument.to_owned()))
}

/// The first line of every scenario file, which names its schema to editors.
const SCHEMA_LINE: &str = "#:schema scenario.schema.json\n";

/// A built-in file as it is copied out: its schema is not beside it yet, and its second line says how to write it.
fn copied_out(text: &str) -> String {
    let note = "# The schema beside this file: pilotfish scenarios --schema > scenario.schema.json\n";
    text.replacen(SCHEMA_LINE, &format!("{SCHEMA_LINE}{note}"), 1)
}

/// Prints the list, a file, or the schema.
pub(crate) fn scenarios(arguments: &Scenarios) -> Result<(), Box<dyn Error>> {
    if arguments.schema {
        let json = serde_json::to_string_pretty(&Scenario::schema()).expect("a schema is JSON");
        return Ok(print(&(json + "\n"))?);
    }
    if let Some(name) = &arguments.scenario {
        let text = Scenario::text(name).ok_or_else(|| NoScenario::Unknown(name.clone()))?;
        return Ok(print(&copied_out(text))?);
    }
    let line = |name: &str| {
        let scenario = Scenario::named(name).expect("listed");
        format!("{name:<24}{}\n", scenario.title)
    };
    Ok(print(
        &Scenario::names().into_iter().map(line).collect::<String>(),
    )?)
}
