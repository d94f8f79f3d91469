//! `pilotfish scenarios`: the built-in scenarios and the schema of scenario files.

use std::{error::Error, path::Path};

use clap::Args;
use sim::scenario::{Scenario, ScenarioError};

use crate::cli::out_file::{print, print_json};

#[derive(Debug, Args)]
pub(crate) struct Scenarios {
    /// Print the file of this scenario, as a start for your own.
    scenario: Option<String>,
    /// Print the JSON Schema of scenario files.
    #[arg(long, conflicts_with = "scenario")]
    schema: bool,
}

/// Why no scenario was found.
#[derive(Debug, thiserror::Error)]
pub(crate) enum NoScenario {
    #[error(
        "unknown scenario {0:?}; the built-in scenarios are {list}; name your own file by its path, such as ./my.toml",
        list = Scenario::names().join(", ")
    )]
    Unknown(String),
    #[error(transparent)]
    File(#[from] ScenarioError),
}

/// The built-in scenario of that name, or the scenario file at that path.
pub(crate) fn scenario(argument: &str) -> Result<Scenario, NoScenario> {
    let path = Path::new(argument);
    if path.extension().is_some() || path.components().count() != 1 {
        return Ok(Scenario::read(path)?);
    }
    Scenario::named(argument).ok_or_else(|| NoScenario::Unknown(argument.to_owned()))
}

/// The first line of every scenario file: editors find the schema by it.
const SCHEMA_LINE: &str = "#:schema scenario.schema.json\n";

/// A built-in file for a user's own directory: its second line says how to write the schema there.
fn copied_out(text: &str) -> String {
    let note = "# The schema beside this file: pilotfish scenarios --schema > scenario.schema.json\n";
    text.replacen(SCHEMA_LINE, &format!("{SCHEMA_LINE}{note}"), 1)
}

/// Prints the list, a file, or the schema.
pub(crate) fn scenarios(arguments: &Scenarios) -> Result<(), Box<dyn Error>> {
    if arguments.schema {
        return Ok(print_json(&Scenario::schema())?);
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
