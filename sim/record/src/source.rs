//! The source of a record: a simulated run in memory, or a mission's stored events.

use std::io;

use geodesy::{Datum, Origin};
use nalgebra::Vector2;
use serde_json::Value;

use crate::{ExportError, table::Row};

/// A record that can be read several times without holding it in memory.
pub trait Source {
    /// Reason why it could not be read or written.
    type Error: From<ExportError> + From<io::Error>;

    /// Metadata of the record, as names and values.
    fn about(&self) -> Vec<(&'static str, Value)>;

    /// Position of the datum on Earth, if known.
    fn origin(&self) -> Option<Origin>;

    /// `true` if headings are from true north at the vehicle; `false` in a flat simulated world.
    fn has_true_headings(&self) -> bool {
        false
    }

    /// The fixed things.
    fn scene(&self) -> Scene<'_> {
        Scene::default()
    }

    /// Passes every entry to `take`, in order, until it fails.
    fn for_each(
        &self,
        take: &mut dyn FnMut(&Entry<'_>) -> Result<(), Self::Error>,
    ) -> Result<(), Self::Error>;

    /// [`Source::for_each`], which may skip entries without a vehicle's position.
    fn for_each_with_places(
        &self,
        take: &mut dyn FnMut(&Entry<'_>) -> Result<(), Self::Error>,
    ) -> Result<(), Self::Error> {
        self.for_each(take)
    }
}

/// A record, with latitude and longitude for every position if the datum's place is known.
pub(crate) struct Placed<'a, S> {
    pub(crate) record: &'a S,
    pub(crate) datum: Option<Datum>,
}

impl<'a, S: Source> Placed<'a, S> {
    pub(crate) fn new(record: &'a S) -> Result<Self, S::Error> {
        let datum = record.origin().as_ref().map(Datum::new).transpose();
        Ok(Self { record, datum: datum.map_err(ExportError::from)? })
    }

    /// [`Source::for_each`].
    pub(crate) fn for_each(
        &self,
        take: &mut dyn FnMut(&Entry<'_>) -> Result<(), S::Error>,
    ) -> Result<(), S::Error> {
        let Some(datum) = &self.datum else { return self.record.for_each(take) };
        self.record.for_each(&mut |entry| {
            let rows = entry.rows.iter().map(|row| on_earth(datum, row)).collect();
            take(&Entry { rows, ..*entry })
        })
    }
}

fn on_earth<'a>(datum: &Datum, row: &Row<'a>) -> Row<'a> {
    let Some((north, east)) = row.north_m.zip(row.east_m) else { return *row };
    let place = datum.from_local(&Vector2::new(north, east));
    Row { lat_deg: Some(place.latitude.to_degrees()), lon_deg: Some(place.longitude.to_degrees()), ..*row }
}

/// An event of a mission, or an instant of a simulated run, with its rows.
#[derive(Clone, Debug, Default)]
pub struct Entry<'a> {
    /// Time on the mission's clock, s.
    pub logged_s: f64,
    /// The event in JSON, with its number; none in a simulated run.
    pub event: Option<&'a [u8]>,
    /// The observations.
    pub rows: Vec<Row<'a>>,
}

/// Fixed things. Points are (north, east), m.
#[derive(Clone, Debug, Default)]
pub struct Scene<'a> {
    /// The AUVs' ids and paths.
    pub paths: Vec<(&'a str, &'a [Vector2<f64>])>,
    /// Keep-out discs.
    pub keep_outs: Vec<Disc>,
    /// Corners of the area to stay in; empty for no limit.
    pub area: &'a [Vector2<f64>],
}

impl Scene<'_> {
    pub(crate) fn is_empty(&self) -> bool {
        self.paths.is_empty() && self.keep_outs.is_empty() && self.area.is_empty()
    }
}

/// A disc.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Disc {
    /// Centre (north, east), m.
    pub centre: Vector2<f64>,
    /// Radius, m.
    pub radius: f64,
}

impl Disc {
    /// A polygon within 0.12 % of the radius, 1 − cos(π/64), with corners clockwise from above.
    pub(crate) fn outline(&self) -> Vec<Vector2<f64>> {
        const CORNERS: u32 = 64;
        let angle = |k| std::f64::consts::TAU * f64::from(k) / f64::from(CORNERS);
        (0..CORNERS).map(|k| self.centre + geodesy::direction(angle(k)) * self.radius).collect()
    }
}

/// A value in a file's metadata: words without quotes.
pub(crate) fn plain(value: &Value) -> String {
    value.as_str().map_or_else(|| value.to_string(), str::to_owned)
}
