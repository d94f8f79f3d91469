//! `pilotfish scenarios`: the built-in scenarios and the schema of scenario files.

use std::{error::Error, ffi::OsStr, path::Path};

use clap::builder::{PossibleValue, StringValueParser, TypedValueParser};
use clap::{Arg, Args, Command};
use sim::scenario::Scenario;

use crate::cli::out_file::{print, print_json};

#[derive(Debug, Args)]
pub(crate) struct Scenarios {
    /// Print the file of this scenario, as a start for your own.
    #[arg(value_parser = NameOrFile, hide_possible_values = true)]
    scenario: Option<String>,
    /// Print the JSON Schema of scenario files.
    #[arg(long, conflicts_with = "scenario")]
    schema: bool,
}

/// The built-in name that is most similar to `argument`.
fn nearest(argument: &str) -> Option<&'static str> {
    /// Least similarity of a misspelling, from 0 to 1, as in clap's own suggestions.
    const SIMILAR: f64 = 0.7;
    let similarity = |name: &&'static str| strsim::jaro(argument, name);
    let names = Scenario::names().into_iter();
    let best = names.max_by(|a, b| similarity(a).total_cmp(&similarity(b)));
    best.filter(|name| SIMILAR < similarity(name))
}

/// Parser of an argument that takes any text. Shells complete the names of the built-in scenarios.
#[derive(Clone)]
pub(crate) struct NameOrFile;

impl TypedValueParser for NameOrFile {
    type Value = String;

    fn parse_ref(
        &self,
        command: &Command,
        argument: Option<&Arg>,
        value: &OsStr,
    ) -> Result<String, clap::Error> {
        StringValueParser::new().parse_ref(command, argument, value)
    }

    fn possible_values(&self) -> Option<Box<dyn Iterator<Item = PossibleValue> + '_>> {
        Some(Box::new(Scenario::names().into_iter().map(PossibleValue::new)))
    }
}

/// The built-in scenario of that name, or the scenario file at that path.
pub(crate) fn scenario(argument: &str) -> Result<Scenario, Box<dyn Error>> {
    let path = Path::new(argument);
    if path.extension().is_some() || path.components().count() != 1 {
        return Ok(Scenario::read(path)?);
    }
    Ok(Scenario::named(argument).ok_or_else(|| unknown(argument))?)
}

fn unknown(argument: &str) -> String {
    let nearest = nearest(argument).map(|name| format!(" (did you mean {name:?}?)"));
    format!(
        "unknown scenario {argument:?}{}; the built-in scenarios are {}; name your own file by its path, such as ./my.toml",
        nearest.unwrap_or_default(),
        Scenario::names().join(", ")
    )
}

/// The first line of every scenario file, by which editors find the schema.
const SCHEMA_LINE: &str = "#:schema scenario.schema.json\n";

/// A built-in file for a user's own directory, with a second line on writing the schema there.
fn copied_out(text: &str) -> String {
    let note = "# The schema beside this file: pilotfish scenarios --schema > scenario.schema.json\n";
    text.replacen(SCHEMA_LINE, &format!("{SCHEMA_LINE}{note}"), 1)
}

pub(crate) fn scenarios(arguments: &Scenarios) -> Result<(), Box<dyn Error>> {
    if arguments.schema {
        return Ok(print_json(&Scenario::schema())?);
    }
    if let Some(name) = &arguments.scenario {
        let text = Scenario::text(name).ok_or_else(|| unknown(name))?;
        return Ok(print(&copied_out(text))?);
    }
    let line = |name: &str| {
        let scenario = Scenario::named(name).expect("listed");
        format!("{name:<24}{}\n", scenario.title)
    };
    let lines = Scenario::names().into_iter().map(line);
    Ok(print(&lines.collect::<String>())?)
}
