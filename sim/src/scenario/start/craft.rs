//! The craft description that a start gives to the planner.

use planner::craft::CraftDescription;

use super::draw::{Checked, Draw};
use super::invalid::{InvalidScenario, of_snapshot, refused};
use crate::scenario::quantity::Distribution;

/// First random number of a craft description, beyond those of all other numbers that a file can
/// have: describing the craft changes no other draw.
const NUMBERS_FROM: u64 = 1 << 32;

/// The file's craft description, else the true one. A `surge_lag` of the limits, s, overrides both.
pub(super) fn craft_description(
    file: Option<&CraftDescription<Distribution>>,
    surge_lag: Option<f64>,
    truth: CraftDescription,
    seed: u64,
) -> Result<CraftDescription, InvalidScenario> {
    let mut craft = match file {
        Some(file) => described(file, seed)?,
        None => truth,
    };
    if surge_lag.is_some() && file.is_some_and(|file| file.surge_loop.time_constant_s.is_some()) {
        return refused(
            "surface_craft.limits.surge_lag_s",
            "surface_craft.craft.surge_loop.time_constant_s is given too; give one of them",
        );
    }
    craft.surge_loop.time_constant_s = surge_lag.or(craft.surge_loop.time_constant_s);
    Ok(craft)
}

fn described(file: &CraftDescription<Distribution>, seed: u64) -> Result<CraftDescription, InvalidScenario> {
    let taken = NUMBERS_FROM;
    let mut draw = Draw { seed, taken };
    let mut checked = Checked::new(&mut draw, "surface_craft.craft");
    let craft = file.map(|place, range, number| checked.take(place, range, number));
    let craft = checked.all(Some(craft))?;
    match craft.faults().first() {
        Some(fault) => Err(of_snapshot("surface_craft", &fault.pointer, fault)),
        None => Ok(craft),
    }
}
