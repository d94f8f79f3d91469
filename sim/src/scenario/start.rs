//! From a scenario and a seed to a world that can be stepped and an observer that can look at it.

use std::fmt::Display;

use ::record::table::SURFACE_CRAFT;
use nalgebra::Vector2;
use planner::{
    craft::Craft,
    path::Side,
    snapshot::{AUVS_MAX, Goal, ID_LENGTH_MAX, Limits, Offset},
};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use crate::{
    observe::{Briefing, Observer},
    record::{Bounds, Origin},
    scenario::{
        ScenarioError,
        file::{ITEMS_MAX, Point, Scenario, SideFile},
        quantity::{Kind, Quantity},
    },
    world::World,
};

mod craft;
mod environment;
mod goal;
mod path;
mod vehicles;

use craft::craft_description;
use environment::bounds;

/// What the random numbers of one seed are for. Each has a stream of its own, so that one more draw for one
/// changes nothing for the others.
#[derive(Clone, Copy)]
enum Stream {
    Scenario,
    Water,
    Sensors,
    Acoustics,
}

impl Stream {
    /// How many there are.
    const COUNT: u64 = 4;
}

fn stream(seed: u64, of: Stream) -> ChaCha8Rng {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(of as u64);
    rng
}

/// A mission about to begin.
#[derive(Clone, Debug)]
pub struct Start {
    /// The truth.
    pub world: World,
    /// The gate to it; of no use without a surface craft.
    pub observer: Option<Observer>,
    /// The surface craft's task, where there is one.
    pub goal: Option<Goal>,
    /// How far from what the goal follows.
    pub offset: Option<Offset>,
    /// What the surface craft can do, where there is one.
    pub limits: Option<Limits>,
    /// How it answers its references, as far as that is known, where there is one.
    pub craft: Option<Craft>,
    /// Slant range that counts as contact, m, where there is a surface craft.
    pub contact_range: Option<f64>,
    /// How long the mission lasts, s.
    pub duration: f64,
    /// Start of the settled metrics, s.
    pub settled_after: f64,
    /// Where the surface craft is meant to stay.
    pub bounds: Bounds,
    /// Where the datum lies on Earth.
    pub origin: Option<Origin>,
}

/// What is wrong with a scenario beyond single numbers.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{field}: {reason}")]
pub struct InvalidScenario {
    /// The member, as `auvs[0].path`.
    pub field: String,
    /// What is wrong, with the value and the limit.
    pub reason: String,
}

fn invalid(field: impl Into<String>, reason: impl Display) -> InvalidScenario {
    InvalidScenario {
        field: field.into(),
        reason: reason.to_string(),
    }
}

/// Draws the numbers of a scenario. Every one has a random stream of its own, numbered in the order in which
/// they are taken, whether fixed, drawn or left out: making one a distribution changes no other.
struct Draw {
    seed: u64,
    taken: u64,
}

impl Draw {
    fn take<K: Kind>(&mut self, quantity: &Quantity<K>) -> f64 {
        self.taken += 1;
        let mut rng = stream(self.seed, Stream::Scenario);
        rng.set_stream(Stream::COUNT + self.taken);
        quantity.draw(&mut rng)
    }

    fn take_or<K: Kind>(&mut self, quantity: Option<&Quantity<K>>, default: f64) -> f64 {
        if let Some(quantity) = quantity {
            return self.take(quantity);
        }
        self.taken += 1;
        default
    }

    fn take_optional<K: Kind>(&mut self, quantity: Option<&Quantity<K>>) -> Option<f64> {
        if let Some(quantity) = quantity {
            return Some(self.take(quantity));
        }
        self.taken += 1;
        None
    }

    fn point(&mut self, point: &Point) -> Vector2<f64> {
        let north = self.take(&point.0[0]);
        Vector2::new(north, self.take(&point.0[1]))
    }

    fn points(&mut self, points: &[Point]) -> Vec<Vector2<f64>> {
        points.iter().map(|point| self.point(point)).collect()
    }
}

impl Scenario {
    /// The mission that `seed` gives. Nothing but the distributions written in the file differs from seed to
    /// seed, noise excepted. What one seed draws may not fit together where another's does.
    pub fn start(&self, seed: u64) -> Result<Start, ScenarioError> {
        self.begin(seed).map_err(|wrong| self.source.wrong(wrong))
    }

    fn begin(&self, seed: u64) -> Result<Start, InvalidScenario> {
        let mut draw = Draw { seed, taken: 0 };
        self.check_names()?;
        let duration = draw.take(&self.duration_s);
        let settled_after = draw.take(&self.settled_after_s);
        // The last row of a record is up to a second before the end.
        if duration.floor() - 1.0 < settled_after {
            return Err(invalid(
                "settled_after_s",
                format_args!("{settled_after} s is not a second before the end at {duration} s"),
            ));
        }
        let origin = self.origin.as_ref().map(|origin| Origin {
            latitude: draw.take(&origin.lat_deg).to_radians(),
            longitude: draw.take(&origin.lon_deg).to_radians(),
        });
        let craft = match &self.surface_craft {
            Some(file) => Some(self.surface_craft(file, &mut draw)?),
            None => None,
        };
        let auvs = (0..)
            .zip(&self.auvs)
            .map(|(i, file)| self.auv(i, file, origin, &mut draw))
            .collect::<Result<Vec<_>, _>>()?;
        let water = self.water(&self.water, seed, &mut draw)?;
        let bounds = bounds(&self.bounds, &mut draw)?;
        let faults = self.faults(&mut draw)?;
        let (surface_craft, briefing, contact_range) = match craft {
            Some((craft, briefing, range)) => {
                let bounds = bounds.clone();
                (Some(craft), Some(Briefing { bounds, ..briefing }), Some(range))
            }
            None => (None, None, None),
        };
        let world = World::new(surface_craft, auvs, water, faults);
        let offset = briefing.as_ref().and_then(|briefing| briefing.offset);
        let (goal, limits) = (
            briefing.as_ref().map(|briefing| briefing.goal.clone()),
            briefing.as_ref().map(|briefing| briefing.limits),
        );
        let craft = briefing.as_ref().map(|briefing| briefing.craft.craft());
        let observer = match briefing {
            Some(briefing) => Some(self.observer(&world, briefing, seed, &mut draw)?),
            None => None,
        };
        Ok(Start {
            world,
            observer,
            goal,
            offset,
            limits,
            craft,
            contact_range,
            duration,
            settled_after,
            bounds,
            origin,
        })
    }

    fn check_names(&self) -> Result<(), InvalidScenario> {
        check_name("name", &self.name)?;
        if !(1..=AUVS_MAX).contains(&self.auvs.len()) {
            return Err(invalid(
                "auvs",
                format_args!("{} vehicles, and 1 to {AUVS_MAX} are allowed", self.auvs.len()),
            ));
        }
        for (i, auv) in self.auvs.iter().enumerate() {
            check_name(&format!("auvs[{i}].id"), &auv.id)?;
            if auv.id == SURFACE_CRAFT {
                return Err(invalid(
                    format!("auvs[{i}].id"),
                    format_args!("{SURFACE_CRAFT:?} is what the surface craft is called"),
                ));
            }
            if self.auvs[..i].iter().any(|earlier| earlier.id == auv.id) {
                return Err(invalid(
                    format!("auvs[{i}].id"),
                    format_args!("{:?} is the name of two vehicles", auv.id),
                ));
            }
        }
        Ok(())
    }

    /// The number of the vehicle called `id`.
    fn auv_called(&self, field: &str, id: &str) -> Result<usize, InvalidScenario> {
        self.auvs.iter().position(|auv| auv.id == id).ok_or_else(|| {
            let known: Vec<&str> = self.auvs.iter().map(|auv| auv.id.as_str()).collect();
            invalid(
                field,
                format_args!("there is no vehicle {id:?}; there are {}", known.join(", ")),
            )
        })
    }
}

fn side(file: SideFile) -> Side {
    match file {
        SideFile::Port => Side::Port,
        SideFile::Starboard => Side::Starboard,
    }
}

fn check_count(field: &str, n: usize) -> Result<(), InvalidScenario> {
    if n <= ITEMS_MAX {
        Ok(())
    } else {
        Err(invalid(
            field,
            format_args!("{n} of them, and {ITEMS_MAX} are allowed"),
        ))
    }
}

/// Names end up in files, tables and addresses.
fn check_name(field: &str, name: &str) -> Result<(), InvalidScenario> {
    let plain = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '-';
    if (1..=ID_LENGTH_MAX).contains(&name.len()) && name.chars().all(plain) {
        Ok(())
    } else {
        Err(invalid(
            field,
            format_args!("{name:?} is not 1 to {ID_LENGTH_MAX} lower-case letters, digits and hyphens"),
        ))
    }
}
