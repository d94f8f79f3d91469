//! Draws of a scenario's numbers for a seed.

use std::ops::RangeInclusive;

use nalgebra::Vector2;
use planner::snapshot::AUVS_MAX;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use super::invalid::{InvalidScenario, invalid, refused};
use crate::scenario::{
    file::{ITEMS_MAX, Point},
    quantity::{Distribution, Kind, Quantity, unit_of},
};

/// Uses of a seed's random numbers. Each has its own stream: another draw of one changes no other.
#[derive(Clone, Copy)]
pub(super) enum Stream {
    Scenario,
    Water,
    Sensors,
    Acoustics,
}

impl Stream {
    const COUNT: u64 = 4;
}

pub(super) fn stream(seed: u64, of: Stream) -> ChaCha8Rng {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(of as u64);
    rng
}

/// The random numbers of the survey of AUV number `i`: a stream counted from the last one down.
pub(super) fn survey_stream(seed: u64, i: usize) -> ChaCha8Rng {
    let mut rng = stream(seed, Stream::Scenario);
    rng.set_stream(u64::MAX - i as u64);
    rng
}

/// The random numbers of the weave of AUV number `i`, below those of the surveys.
pub(super) fn weave_stream(seed: u64, i: usize) -> ChaCha8Rng {
    survey_stream(seed, AUVS_MAX + i)
}

/// The random numbers of the AUVs' own navigation, below those of the weaves.
pub(super) fn navigation_stream(seed: u64) -> ChaCha8Rng {
    survey_stream(seed, 2 * AUVS_MAX)
}

/// The random numbers of AIS, below those of the AUVs' own navigation.
pub(super) fn ais_stream(seed: u64) -> ChaCha8Rng {
    survey_stream(seed, 2 * AUVS_MAX + 1)
}

/// The random numbers of this surface craft for a use: a scenario's only one, or below AIS.
pub(super) fn craft_stream(seed: u64, number: usize, of: Stream) -> ChaCha8Rng {
    match number {
        0 => stream(seed, of),
        // Sixteen numbers of each craft, one for every use.
        _ => survey_stream(seed, 2 * AUVS_MAX + 16 * number + of as usize),
    }
}

/// Draws the numbers of a scenario. Each has its own random stream, numbered in the order of the
/// draws. Fixed and omitted numbers count: making a number a distribution changes no other.
pub(super) struct Draw {
    pub(super) seed: u64,
    pub(super) taken: u64,
}

impl Draw {
    pub(super) fn take<K: Kind>(&mut self, quantity: &Quantity<K>) -> f64 {
        quantity.draw(&mut self.rng())
    }

    pub(super) fn take_or<K: Kind>(&mut self, quantity: Option<&Quantity<K>>, default: f64) -> f64 {
        self.take_optional(quantity).unwrap_or(default)
    }

    pub(super) fn take_optional<K: Kind>(&mut self, quantity: Option<&Quantity<K>>) -> Option<f64> {
        let mut rng = self.rng();
        Some(quantity?.draw(&mut rng))
    }

    /// The random numbers of the next draw.
    fn rng(&mut self) -> ChaCha8Rng {
        self.taken += 1;
        let mut rng = stream(self.seed, Stream::Scenario);
        rng.set_stream(Stream::COUNT + self.taken);
        rng
    }

    pub(super) fn point(&mut self, point: &Point) -> Vector2<f64> {
        let north = self.take(&point.0[0]);
        Vector2::new(north, self.take(&point.0[1]))
    }

    pub(super) fn points(&mut self, points: &[Point]) -> Vec<Vector2<f64>> {
        points.iter().map(|point| self.point(point)).collect()
    }
}

/// Draws numbers of a table whose ranges are those of a snapshot.
pub(super) struct Checked<'a> {
    draw: &'a mut Draw,
    table: &'static str,
    out_of_range: Option<InvalidScenario>,
}

impl<'a> Checked<'a> {
    pub(super) fn new(draw: &'a mut Draw, table: &'static str) -> Self {
        Self { draw, table, out_of_range: None }
    }

    /// The number at `place`, such as `heading_loop/delay_s`; none if it is not in its range.
    pub(super) fn take(
        &mut self,
        place: &str,
        range: &RangeInclusive<f64>,
        number: Option<&Distribution>,
    ) -> Option<f64> {
        let mut rng = self.draw.rng();
        let number = number?;
        if let Err(reason) = number.check(range, unit_of(place)) {
            let field = format!("{}.{}", self.table, place.replace('/', "."));
            self.out_of_range.get_or_insert_with(|| invalid(field, reason));
            return None;
        }
        Some(number.draw(range, &mut rng))
    }

    /// The result, if all numbers were in their ranges.
    pub(super) fn all<T>(self, made: Option<T>) -> Result<T, InvalidScenario> {
        match (self.out_of_range, made) {
            (None, Some(made)) => Ok(made),
            (Some(wrong), _) => Err(wrong),
            (None, None) => unreachable!("only numbers out of range are left out"),
        }
    }
}

pub(super) fn check_count(field: &str, n: usize) -> Result<(), InvalidScenario> {
    if n <= ITEMS_MAX {
        return Ok(());
    }
    let reason = format_args!("{n} items; at most {ITEMS_MAX} are allowed");
    refused(field, reason)
}
