//! No-go areas: polygons, convex or not, that the craft keeps out of.

use nalgebra::Vector2;
use serde::{Deserialize, Serialize};
use serde_with::skip_serializing_none;
use utoipa::ToSchema;

use crate::facts::{
    field_error::FieldError,
    ranges::{COORDINATE_MAX, ID_LENGTH_MAX, NO_GO_CORNERS_MAX, NO_GO_MAX},
};

/// Corners of a ring.
const RING_CORNERS: std::ops::RangeInclusive<usize> = 3..=NO_GO_CORNERS_MAX;

/// An area to keep out of, such as land or shallow water.
#[skip_serializing_none]
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct NoGo {
    /// Corners [north, east] of its border, m, convex or not: in order, in either direction, each
    /// once. Sides do not cross.
    #[schema(example = json!([[100.0, -20.0], [140.0, -20.0], [140.0, 60.0], [120.0, 60.0], [120.0, 0.0], [100.0, 0.0]]))]
    pub polygon: Vec<[f64; 2]>,
    /// Borders of parts in which the craft may be, such as a lagoon's; none if left out.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub holes: Vec<Vec<[f64; 2]>>,
    /// Its name for people, at most 64 bytes; none if left out.
    pub name: Option<String>,
}

impl NoGo {
    /// An area with this border and no holes.
    pub fn new(polygon: Vec<[f64; 2]>) -> Self {
        Self { polygon, holes: Vec::new(), name: None }
    }

    /// Its border, then its holes.
    pub fn rings(&self) -> impl Iterator<Item = &Vec<[f64; 2]>> {
        std::iter::once(&self.polygon).chain(&self.holes)
    }

    /// All its corners.
    pub fn corners_mut(&mut self) -> impl Iterator<Item = &mut [f64; 2]> {
        std::iter::once(&mut self.polygon).chain(&mut self.holes).flatten()
    }

    /// The border or hole number `ring` as a JSON pointer within it.
    pub(crate) fn pointer(ring: usize) -> String {
        if ring == 0 { "/polygon".to_owned() } else { format!("/holes/{}", ring - 1) }
    }
}

pub(crate) fn corners_of(ring: &[[f64; 2]]) -> Vec<Vector2<f64>> {
    ring.iter().copied().map(Vector2::from).collect()
}

/// The faults of the sizes of `no_go`, by field.
pub(crate) fn no_go_lengths(no_go: &[NoGo]) -> Vec<FieldError> {
    let mut faults = Vec::from_iter(FieldError::of_length("/no_go", no_go.len(), &(0..=NO_GO_MAX), "items"));
    let corners = no_go.iter().flat_map(NoGo::rings).map(Vec::len).sum();
    let most = 0..=NO_GO_CORNERS_MAX;
    faults.extend(FieldError::of_length("/no_go", corners, &most, "corners in all"));
    if faults.is_empty() {
        for (i, area) in no_go.iter().enumerate() {
            for (ring, corners) in area.rings().enumerate() {
                let place = format!("/no_go/{i}{}", NoGo::pointer(ring));
                faults.extend(FieldError::of_length(place, corners.len(), &RING_CORNERS, "items"));
            }
            if let Some(name) = &area.name {
                let place = format_args!("/no_go/{i}/name");
                faults.extend(FieldError::of_length(place, name.len(), &(0..=ID_LENGTH_MAX), "bytes"));
            }
        }
    }
    faults
}

/// The faults of the numbers of `no_go`, by field.
pub(crate) fn no_go_numbers(no_go: &[NoGo]) -> Vec<FieldError> {
    let range = -COORDINATE_MAX..=COORDINATE_MAX;
    let mut faults = Vec::new();
    for (i, area) in no_go.iter().enumerate() {
        for (ring, corners) in area.rings().enumerate() {
            for (k, corner) in corners.iter().enumerate() {
                for (axis, given) in corner.iter().enumerate() {
                    if !range.contains(given) {
                        let place = format!("/no_go/{i}{}/{k}/{axis}", NoGo::pointer(ring));
                        faults.extend(FieldError::outside(place, *given, &range));
                    }
                }
            }
        }
    }
    faults
}
