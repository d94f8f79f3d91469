//! `pilotfish scenarios`: what there is to simulate, and how to write one's own.

use std::{io, path::Path};

use clap::Args;
use sim::scenario::{Scenario, ScenarioError};

use crate::cli::out_file::print;

#[derive(Debug, Args)]
pub(crate) struct Scenarios {
    /// Print the file of this scenario: something to start one's own from.
    scenario: Option<String>,
    /// Print the JSON Schema of scenario files.
    #[arg(long, conflicts_with = "scenario")]
    schema: bool,
}

/// Why no scenario was found, or shown.
#[derive(Debug, thiserror::Error)]
pub(crate) enum NoScenario {
    #[error(
        "there is no scenario {0:?}; the scenarios are {list}; a file of your own is given by its path, as ./my.toml",
        list = Scenario::names().join(", ")
    )]
    Unknown(String),
    #[error(transparent)]
    File(#[from] ScenarioError),
    #[error("cannot print the result")]
    Print(#[from] io::Error),
}

/// The scenario that a command line names: a built-in one, or the file at a path.
pub(crate) fn scenario(argument: &str) -> Result<Scenario, NoScenario> {
    let path = Path::new(argument);
    if path.extension().is_some() || path.components().count() != 1 {
        return Ok(Scenario::read(path)?);
    }
    Scenario::named(argument).ok_or_else(|| NoScenario::Unknown(argument.to_owned()))
}

/// Prints the list, a file, or the schema.
pub(crate) fn scenarios(arguments: &Scenarios) -> Result<(), NoScenario> {
    if arguments.schema {
        let json = serde_json::to_string_pretty(&Scenario::schema()).expect("a schema is JSON");
        return Ok(print(&(json + "\n"))?);
    }
    if let Some(name) = &arguments.scenario {
        let text = Scenario::text(name).ok_or_else(|| NoScenario::Unknown(name.clone()))?;
        return Ok(print(text)?);
    }
    let line = |name: &str| {
        let scenario = Scenario::named(name).expect("listed");
        format!("{name:<24}{}\n", scenario.title)
    };
    Ok(print(
        &Scenario::names().into_iter().map(line).collect::<String>(),
    )?)
}
