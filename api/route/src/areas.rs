//! Areas from GeoJSON: its polygons, with their holes.

use geojson::{GeometryValue, Position};
use serde_json::Value;

use crate::file::text_of;
use crate::json::{extend, feature, features, located, parsed};
use crate::progress::Progress;
use crate::route::{Route, RoutePoint, Unread, refused};

/// An area of a file.
#[derive(Clone, Debug, PartialEq)]
pub struct Area {
    /// Its name in the file, or empty.
    pub name: String,
    /// Its border, then its holes, without last points that repeat the first.
    pub rings: Vec<Vec<RoutePoint>>,
}

/// The polygons of a GeoJSON file. Other geometry is an error: nothing would keep the craft off it.
pub fn areas(bytes: &[u8]) -> Result<Vec<Area>, Unread> {
    let text = text_of(bytes)?;
    let progress = Progress::new(&|| false);
    let json = parsed(&text, &progress)?;
    polygons(json, progress).map_err(|unread| Unread { place: located(&text, &unread.place), ..unread })
}

fn polygons(json: Value, mut progress: Progress<'_>) -> Result<Vec<Area>, Unread> {
    let mut areas = Vec::new();
    for (place, item) in features(json)? {
        let (feature, place) = feature(item, place)?;
        let at = format!("{place}/coordinates");
        let name = feature.property("name").and_then(Value::as_str).unwrap_or_default();
        let mut area = |at: &str, polygon: &[Vec<Position>]| {
            let mut ring = |(k, line): (usize, &Vec<Position>)| {
                let mut ring = Route::default();
                extend(&mut progress, &mut ring, &format!("{at}/{k}"), line)?;
                Ok(ring.ring().points)
            };
            let rings = polygon.iter().enumerate().map(&mut ring).collect::<Result<Vec<_>, _>>()?;
            areas.push(Area { name: name.to_owned(), rings });
            Ok(())
        };
        match feature.geometry.as_ref().map(|geometry| &geometry.value) {
            Some(GeometryValue::Polygon { coordinates }) => area(&at, coordinates)?,
            Some(GeometryValue::MultiPolygon { coordinates }) => {
                for (k, polygon) in coordinates.iter().enumerate() {
                    area(&format!("{at}/{k}"), polygon)?;
                }
            }
            _ => return refused(place, "is no polygon; draw round it, or take it out"),
        }
    }
    Ok(areas)
}
