//! A scenario, with what the command line says otherwise.

use std::error::Error;

use sim::scenario::Scenario;

use super::error::MissionError;
use crate::cli::declared_craft::DeclaredCraft;

pub(super) fn lasting(scenario: Scenario, duration_s: Option<u32>) -> Scenario {
    match duration_s {
        Some(duration) => scenario.lasting(duration.into()),
        None => scenario,
    }
}

/// The scenario, with the craft that the command line declares.
pub(super) fn declare(mut scenario: Scenario, craft: &DeclaredCraft) -> Result<Scenario, Box<dyn Error>> {
    if let Some((_, craft)) = craft.read()? {
        let surface_craft = scenario.surface_craft.as_mut();
        surface_craft.ok_or(MissionError::NoSurfaceCraft)?.craft = Some(craft);
    }
    Ok(scenario)
}
