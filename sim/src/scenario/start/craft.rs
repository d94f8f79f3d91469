//! The craft description that a start gives to the planner.

use planner::craft::CraftDescription;

use super::{
    draw::Draw,
    invalid::{InvalidScenario, invalid, of_snapshot},
};
use crate::scenario::{
    file::LimitsFile,
    quantity::{Distribution, unit_of},
};

/// First random number of a craft description, beyond those of all other numbers that a file can
/// have: describing the craft changes no other draw.
const NUMBERS_FROM: u64 = 1 << 32;

/// The craft description of the file, else the true one. The limits' surge lag overrides both.
pub(super) fn craft_description(
    file: Option<&CraftDescription<Distribution>>,
    limits: &LimitsFile,
    truth: CraftDescription,
    draw: &mut Draw,
) -> Result<CraftDescription, InvalidScenario> {
    let mut craft = match file {
        Some(file) => described(file, draw.seed)?,
        None => truth,
    };
    let lag = draw.take_optional(limits.surge_lag_s.as_ref());
    if lag.is_some() && file.is_some_and(|file| file.surge_loop.time_constant_s.is_some()) {
        return Err(invalid(
            "surface_craft.limits.surge_lag_s",
            "surface_craft.craft.surge_loop.time_constant_s is given too; give one of them",
        ));
    }
    craft.surge_loop.time_constant_s = lag.or(craft.surge_loop.time_constant_s);
    Ok(craft)
}

fn described(file: &CraftDescription<Distribution>, seed: u64) -> Result<CraftDescription, InvalidScenario> {
    let taken = NUMBERS_FROM;
    let mut draw = Draw { seed, taken };
    let mut out_of_range = None;
    let craft = file.map(|member, range, number| {
        if let Some(Err(reason)) = number.map(|number| number.check(range, unit_of(member))) {
            let field = format!("surface_craft.craft.{}", member.replace('/', "."));
            out_of_range.get_or_insert(invalid(field, reason));
            return None;
        }
        draw.take_within(number, range)
    });
    if let Some(wrong) = out_of_range {
        return Err(wrong);
    }
    match craft.faults().first() {
        Some(fault) => Err(of_snapshot("surface_craft", fault)),
        None => Ok(craft),
    }
}
