//! The craft description that a start gives to the planner.

use planner::craft::{
    CraftDescription, HeadingDynamics, HeadingHeld, Integrator, PRESETS, Preset, PropulsionPower, SpeedHeld,
};

use super::{Draw, InvalidScenario, invalid};
use crate::scenario::file::{
    CraftFile, HeadingHeldFile, HeadingResponseFile, LimitsFile, SpeedHeldFile, SurgeResponseFile,
};

/// Where the random numbers of a craft's description begin, beyond those of every other number that a file can have:
/// describing the craft changes no other draw.
const NUMBERS_FROM: u64 = 1 << 32;

/// The craft description of the file, else the true one. The surge lag among the limits takes precedence over both.
pub(super) fn craft_description(
    file: Option<&CraftFile>,
    limits: &LimitsFile,
    truth: CraftDescription,
    draw: &mut Draw,
) -> Result<CraftDescription, InvalidScenario> {
    let given = match file {
        Some(file) => described(
            file,
            &mut Draw {
                seed: draw.seed,
                taken: NUMBERS_FROM,
            },
        )?,
        None => truth,
    };
    let lag = draw.take_optional(limits.surge_lag_s.as_ref());
    if lag.is_some() && file.is_some_and(|file| file.surge_loop.time_constant_s.is_some()) {
        return Err(invalid(
            "surface_craft.limits.surge_lag_s",
            "surface_craft.craft.surge_loop.time_constant_s is given too; give one of them",
        ));
    }
    Ok(CraftDescription {
        surge_time_constant: lag.or(given.surge_time_constant),
        ..given
    })
}

fn described(file: &CraftFile, draw: &mut Draw) -> Result<CraftDescription, InvalidScenario> {
    let preset = match &file.preset {
        Some(name) => Some(Preset::named(name).ok_or_else(|| {
            let known: Vec<_> = PRESETS.iter().map(|preset| preset.name).collect();
            invalid(
                "surface_craft.craft.preset",
                format_args!("there is no craft {name:?}; there are {}", known.join(", ")),
            )
        })?),
        None => None,
    };
    let (heading, surge) = (&file.heading_loop, &file.surge_loop);
    Ok(CraftDescription {
        preset,
        heading_dynamics: heading_dynamics(heading, draw)?,
        heading_delay: draw.take_optional(heading.delay_s.as_ref()),
        heading_rate_max: draw.take_optional(heading.rate_max_radps.as_ref()),
        surge_time_constant: draw.take_optional(surge.time_constant_s.as_ref()),
        surge_delay: draw.take_optional(surge.delay_s.as_ref()),
        acceleration_max: draw.take_optional(surge.acceleration_max_mps2.as_ref()),
        deceleration_max: draw.take_optional(surge.deceleration_max_mps2.as_ref()),
        integrator: integrator(surge, draw)?,
        sway_per_yaw_rate: draw.take_optional(file.sway_per_yaw_rate_s.as_ref()),
        power: file.power.as_ref().map(|power| PropulsionPower {
            linear: draw.take_or(power.linear_w_per_mps.as_ref(), 0.0),
            cubic: draw.take_or(power.cubic_w_per_mps3.as_ref(), 0.0),
        }),
        speed_held: file.speed_held.map(SpeedHeld::from),
        heading_held: file.heading_held.map(HeadingHeld::from),
        relative_uncertainty: draw.take_optional(file.relative_uncertainty.as_ref()),
    })
}

fn heading_dynamics(
    file: &HeadingResponseFile,
    draw: &mut Draw,
) -> Result<Option<HeadingDynamics>, InvalidScenario> {
    let wrong = |member: &str, reason: &str| {
        Err(invalid(
            format!("surface_craft.craft.heading_loop.{member}"),
            reason,
        ))
    };
    let together = "natural_frequency_radps and damping come together or not at all";
    let numbers = (
        draw.take_optional(file.time_constant_s.as_ref()),
        draw.take_optional(file.natural_frequency_radps.as_ref()),
        draw.take_optional(file.damping.as_ref()),
    );
    match numbers {
        (None, None, None) => Ok(None),
        (Some(time_constant), None, None) => Ok(Some(HeadingDynamics::FirstOrder { time_constant })),
        (None, Some(natural_frequency), Some(damping)) => Ok(Some(HeadingDynamics::SecondOrder {
            natural_frequency,
            damping,
        })),
        (None, Some(_), None) => wrong("natural_frequency_radps", together),
        (None, None, Some(_)) => wrong("damping", together),
        (Some(_), Some(_), _) | (Some(_), _, Some(_)) => wrong(
            "time_constant_s",
            "either a time constant, or a natural frequency and a damping ratio",
        ),
    }
}

fn integrator(file: &SurgeResponseFile, draw: &mut Draw) -> Result<Option<Integrator>, InvalidScenario> {
    let wrong = |member: &str, reason: &str| {
        Err(invalid(
            format!("surface_craft.craft.surge_loop.{member}"),
            reason,
        ))
    };
    match (file.integrates, draw.take_optional(file.integral_time_s.as_ref())) {
        (None, None) => Ok(None),
        (Some(false), None) => Ok(Some(Integrator::Absent)),
        (None | Some(true), Some(time)) => Ok(Some(Integrator::Gathers { time })),
        (Some(true), None) => wrong(
            "integrates",
            "an integrator is stated by its integral_time_s; leave integrates out to have it learnt",
        ),
        (Some(false), Some(_)) => wrong(
            "integral_time_s",
            "a loop that does not integrate has no integral time",
        ),
    }
}

impl From<SpeedHeldFile> for SpeedHeld {
    fn from(held: SpeedHeldFile) -> Self {
        match held {
            SpeedHeldFile::ThroughWater => Self::ThroughWater,
            SpeedHeldFile::OverGround => Self::OverGround,
        }
    }
}

impl From<HeadingHeldFile> for HeadingHeld {
    fn from(held: HeadingHeldFile) -> Self {
        match held {
            HeadingHeldFile::Heading => Self::Heading,
            HeadingHeldFile::Course => Self::Course,
        }
    }
}
