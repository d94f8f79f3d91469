//! The options of a scenario's run, and the files of its record.

use std::{error::Error, path::Path};

use clap::Args;
use record::{self, ExportError, Format};
use sim::{record::Record, scenario::Scenario};

use crate::cli::{
    declared_areas::DeclaredAreas, declared_craft::DeclaredCraft, declared_routes::DeclaredRoutes,
    failure::Failure, out_file::OutFile, scenarios::scenario,
};

#[derive(Debug, Args)]
pub(super) struct RunArguments {
    #[command(flatten)]
    craft: DeclaredCraft,
    #[command(flatten)]
    routes: DeclaredRoutes,
    #[command(flatten)]
    areas: DeclaredAreas,
    /// Seed of all random numbers.
    #[arg(long, default_value_t = 1)]
    pub(super) seed: u64,
    /// End the mission after this many seconds. If the settled metrics would begin later, they
    /// begin at once.
    #[arg(long, value_name = "S", value_parser = clap::value_parser!(u32).range(1..=86_400))]
    duration_s: Option<u32>,
    /// Set a number of the scenario (docs/scenario-keys.md), such as
    /// surface_craft.tuning.energy_weight_per_j=1; may be repeated.
    #[arg(long, value_name = "KEY=NUMBER", value_parser = assignment)]
    set: Vec<(String, f64)>,
}

fn assignment(text: &str) -> Result<(String, f64), String> {
    let (key, value) = text.split_once('=').ok_or("give a key, = and a number")?;
    let value = value.parse().map_err(|_| format!("{value:?} is no number"))?;
    Ok((key.to_owned(), value))
}

impl RunArguments {
    /// The named scenario, with the given duration and craft.
    pub(super) fn scenario(&self, name: &str) -> Result<Scenario, Box<dyn Error>> {
        let mut scenario = scenario(name)?;
        for (key, value) in &self.set {
            scenario.set(key, *value).map_err(|wrong| wrong.to_string())?;
        }
        if let Some(duration) = self.duration_s {
            scenario = scenario.lasting(duration.into());
        }
        if let Some((_, craft)) = self.craft.read()? {
            if !scenario.has_surface_craft() {
                return Err("the scenario has no surface craft: remove --craft".into());
            }
            let craft = Some(craft);
            scenario.surface_craft.iter_mut().for_each(|surface| surface.craft.clone_from(&craft));
        }
        self.routes.follow(&mut scenario, self.seed)?;
        self.areas.add_to(&mut scenario, self.seed)?;
        Ok(scenario)
    }
}

/// An error if there are several surface craft, unless `fits`; `options` are for one.
pub(super) fn one_craft_unless(fits: bool, scenario: &Scenario, options: &str) -> Result<(), String> {
    if fits || !scenario.has_fleet() {
        return Ok(());
    }
    let (name, n) = (&scenario.name, scenario.surface_craft.len());
    Err(format!("{options} are for one surface craft: {name} has {n}"))
}

pub(super) struct RecordFile {
    file: OutFile,
    format: Format,
}

impl RecordFile {
    /// The file at `path`, whose suffix chooses the format, for a record of `scenario`.
    pub(super) fn new(path: &Path, scenario: &Scenario) -> Result<Self, Failure> {
        let file = OutFile::new(path)?;
        let format = match Format::of(path) {
            // Pipes and devices seldom have a suffix.
            Err(_) if file.is_stream() && path.extension().is_none() => Format::Csv,
            named => named.map_err(|error| file.refused(error))?,
        };
        if format == Format::Geojson && scenario.origin.is_none() {
            return Err(file.refused(ExportError::NoOrigin));
        }
        Ok(Self { file, format })
    }

    pub(super) fn write(&self, record: &Record) -> Result<(), Failure> {
        self.file.write(|out| record::write(record, self.format, out))
    }
}
