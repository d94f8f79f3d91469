//! A record as `GeoJSON` (RFC 7946): one feature for each track, path, disc and area, in WGS 84.
//!
//! Positions are longitude, latitude and, under water, an altitude of minus the depth. That altitude counts
//! from the sea surface, RFC 7946's from the ellipsoid: the simulated sea has no geoid. Lines are not cut at
//! the antimeridian; their longitudes go on beyond ±180° instead, so that no line runs around the Earth.

use std::{f64::consts::TAU, io::Write};

use geojson::{Feature, FeatureCollection, Geometry, JsonObject, Position};
use nalgebra::Vector2;
use planner::{angle::wrap, snapshot::KeepOut};
use serde_json::json;
use sim::{
    datum::{Datum, NotOnEarth},
    record::{Origin, Record},
};

use super::ExportError;

/// Corners of a disc's polygon: within 0.12 % of the radius, 1 − cos(π/64).
const DISC_CORNERS: u32 = 64;
/// Decimals of a degree: 1e-9° is 0.1 mm.
const DEGREE_DECIMALS: i32 = 9;
/// Decimals of a metre.
const METRE_DECIMALS: i32 = 3;

pub(super) fn write(record: &Record, out: &mut impl Write) -> Result<(), ExportError> {
    let origin = record.origin.ok_or(ExportError::NoOrigin)?;
    let chart = Chart {
        record,
        frame: Frame::new(origin)?,
    };
    let mut features = vec![];
    features.extend(chart.surface_craft());
    features.extend(chart.divers());
    features.extend(chart.goal());
    features.extend(chart.paths());
    features.extend(chart.keep_outs());
    features.extend(chart.area());
    serde_json::to_writer(&mut *out, &FeatureCollection::new(features)).map_err(std::io::Error::from)?;
    out.write_all(b"\n")?;
    Ok(())
}

struct Chart<'a> {
    record: &'a Record,
    frame: Frame,
}

/// The local frame's place on Earth, for positions.
pub(crate) struct Frame {
    origin: Origin,
    datum: Datum,
}

impl Frame {
    pub(crate) fn new(origin: Origin) -> Result<Self, NotOnEarth> {
        let datum = Datum::new(&origin)?;
        Ok(Self { origin, datum })
    }

    /// Longitude and latitude of (north, east), degrees.
    pub(crate) fn degrees(&self, point: &Vector2<f64>) -> [f64; 2] {
        let place = self.datum.from_local(point);
        // On the datum's side of the antimeridian, so that lines are continuous.
        let longitude = self.origin.longitude + wrap(place.longitude - self.origin.longitude);
        [longitude, place.latitude].map(|angle| rounded(angle.to_degrees(), DEGREE_DECIMALS))
    }
}

/// Altitude at a depth, m.
pub(crate) fn altitude(depth: f64) -> f64 {
    rounded(-depth, METRE_DECIMALS)
}

/// What a feature is of.
struct Label<'a> {
    kind: &'static str,
    id: &'a str,
}

impl Chart<'_> {
    fn surface_craft(&self) -> Option<Feature> {
        let points = self.record.rows.iter().filter_map(|row| {
            let craft = row.surface_craft.as_ref()?;
            Some((row.time, self.position(&craft.position)))
        });
        self.track(
            &Label {
                kind: "asc",
                id: "asc",
            },
            points,
        )
    }

    fn divers(&self) -> impl Iterator<Item = Feature> {
        self.record.diver_ids.iter().enumerate().filter_map(|(i, id)| {
            let points = self.record.rows.iter().filter_map(|row| {
                let diver = row.divers.get(i)?;
                let [longitude, latitude] = self.frame.degrees(&diver.position);
                let position = [longitude, latitude, altitude(diver.depth)];
                Some((row.time, Position::from(position)))
            });
            self.track(&Label { kind: "auv", id }, points)
        })
    }

    fn goal(&self) -> Option<Feature> {
        let points = self.record.rows.iter().filter_map(|row| {
            let craft = row.surface_craft.as_ref()?;
            Some((row.time, self.position(&craft.goal)))
        });
        let label = Label {
            kind: "goal",
            id: "goal",
        };
        self.track(&label, points)
    }

    fn paths(&self) -> impl Iterator<Item = Feature> {
        let paths = self.record.diver_ids.iter().zip(&self.record.paths);
        paths.filter(|(_, path)| is_line(path)).map(|(id, path)| {
            let line = path.iter().map(|point| self.position(point));
            self.feature(&Label { kind: "path", id }, Geometry::new_line_string(line))
        })
    }

    fn keep_outs(&self) -> impl Iterator<Item = Feature> {
        let discs = self.record.bounds.keep_outs.iter().enumerate();
        discs.map(|(i, disc)| {
            let label = Label {
                kind: "keep_out",
                id: &format!("keep-out-{}", i + 1),
            };
            self.polygon(&label, &corners(disc))
        })
    }

    fn area(&self) -> Option<Feature> {
        let area = &self.record.bounds.area;
        let label = Label {
            kind: "area",
            id: "area",
        };
        (!area.is_empty()).then(|| self.polygon(&label, area))
    }

    /// A line with the times of its points; none of less than two, which is no line.
    fn track(&self, label: &Label, points: impl Iterator<Item = (f64, Position)>) -> Option<Feature> {
        let (times, line): (Vec<f64>, Vec<Position>) = points.unzip();
        is_line(&line).then(|| {
            let mut feature = self.feature(label, Geometry::new_line_string(line));
            feature.set_property("t_s", times);
            feature
        })
    }

    /// Closed, and counter-clockwise seen from above (RFC 7946, 3.1.6).
    fn polygon(&self, label: &Label, corners: &[Vector2<f64>]) -> Feature {
        let mut ring: Vec<Position> = corners.iter().map(|corner| self.position(corner)).collect();
        if is_clockwise(corners) {
            ring.reverse();
        }
        ring.extend(ring.first().cloned());
        self.feature(label, Geometry::new_polygon([ring]))
    }

    fn feature(&self, label: &Label, geometry: Geometry) -> Feature {
        let mut properties = JsonObject::new();
        properties.insert("kind".to_owned(), json!(label.kind));
        properties.insert("id".to_owned(), json!(label.id));
        properties.insert("scenario".to_owned(), json!(self.record.scenario));
        properties.insert("seed".to_owned(), json!(self.record.seed));
        Feature {
            properties: Some(properties),
            ..Feature::from(geometry)
        }
    }

    fn position(&self, point: &Vector2<f64>) -> Position {
        Position::from(self.frame.degrees(point))
    }
}

fn is_line<T>(points: &[T]) -> bool {
    2 <= points.len()
}

/// The disc's corners, counter-clockwise seen from above.
fn corners(disc: &KeepOut) -> Vec<Vector2<f64>> {
    (0..DISC_CORNERS)
        .map(|k| {
            let angle = -TAU * f64::from(k) / f64::from(DISC_CORNERS);
            disc.centre + planner::angle::direction(angle) * disc.radius
        })
        .collect()
}

/// Whether (north, east) corners go around clockwise seen from above: the signed area is positive.
fn is_clockwise(corners: &[Vector2<f64>]) -> bool {
    let next = corners.iter().cycle().skip(1);
    let twice_area: f64 = corners.iter().zip(next).map(|(a, b)| a.perp(b)).sum();
    0.0 < twice_area
}

fn rounded(value: f64, decimals: i32) -> f64 {
    let scale = 10_f64.powi(decimals);
    (value * scale).round() / scale
}

#[cfg(test)]
mod tests {
    use serde_json::Value;

    use super::*;
    use crate::export::sample;

    fn written(record: &Record) -> Vec<Value> {
        let mut bytes = vec![];
        write(record, &mut bytes).expect("can be written");
        let value: Value = serde_json::from_slice(&bytes).expect("is JSON");
        assert_eq!(value["type"], "FeatureCollection");
        value["features"].as_array().expect("is a list").clone()
    }

    fn of_kind(features: &[Value], kind: &str) -> Value {
        let mut found = features
            .iter()
            .filter(|feature| feature["properties"]["kind"] == kind);
        let feature = found.next().expect("is there").clone();
        assert!(found.next().is_none(), "{kind} is there once");
        feature
    }

    fn points(coordinates: &Value) -> Vec<Vec<f64>> {
        serde_json::from_value(coordinates.clone()).expect("is a list of positions")
    }

    /// Metres to the east and to the north of the datum, by the ellipsoid's radii at 38.41°.
    fn metres(point: &[f64]) -> (f64, f64) {
        let radii = (6_360_075.0, 6_386_394.0);
        let latitude = 38.41_f64.to_radians();
        (
            (point[0] + 9.12).to_radians() * radii.1 * latitude.cos(),
            (point[1] - 38.41).to_radians() * radii.0,
        )
    }

    #[test]
    fn every_kind_has_its_geometry_and_names_its_run() {
        let features = written(&sample::record());
        for (kind, id, geometry) in [
            ("asc", "asc", "LineString"),
            ("auv", "auv-1", "LineString"),
            ("goal", "goal", "LineString"),
            ("path", "auv-1", "LineString"),
            ("keep_out", "keep-out-1", "Polygon"),
            ("area", "area", "Polygon"),
        ] {
            let feature = of_kind(&features, kind);
            assert_eq!(feature["type"], "Feature");
            assert_eq!(feature["geometry"]["type"], geometry);
            let properties = &feature["properties"];
            assert_eq!((&properties["id"], &properties["seed"]), (&json!(id), &json!(7)));
            assert_eq!(properties["scenario"], "by-hand");
        }
        assert_eq!(features.len(), 6);
    }

    #[test]
    fn tracks_are_longitude_latitude_and_minus_depth_with_a_time_each() {
        let features = written(&sample::record());
        let auv = of_kind(&features, "auv");
        let line = points(&auv["geometry"]["coordinates"]);
        assert_eq!(auv["properties"]["t_s"], json!([0.0, 0.5, 1.0]));
        for (point, (north, depth)) in line.iter().zip([(4.0, 9.0), (4.5, 9.5), (5.0, 10.0)]) {
            let (east_of, north_of) = metres(point);
            // The radii are rounded to a metre in six million, the degrees to 0.1 mm.
            assert!(
                (east_of - 5.0).abs() < 5e-4 && (north_of - north).abs() < 5e-4,
                "{point:?}"
            );
            assert_eq!(point[2], -depth);
        }
        let asc = of_kind(&features, "asc");
        let line = points(&asc["geometry"]["coordinates"]);
        assert!(line.len() == 3 && line.iter().all(|point| point.len() == 2));
    }

    #[test]
    fn rings_are_closed_and_counter_clockwise_whatever_way_the_corners_were_given() {
        let mut record = sample::record();
        for _ in 0..2 {
            record.bounds.area.reverse();
            let features = written(&record);
            for (kind, corners, area) in [
                // A regular polygon of 64 sides: (64/2) r² sin(2π/64).
                ("keep_out", 64, 32.0 * 144.0 * (TAU / 64.0).sin()),
                ("area", 4, 150.0 * 150.0),
            ] {
                let rings = of_kind(&features, kind)["geometry"]["coordinates"].clone();
                let ring = points(&rings[0]);
                assert_eq!(ring.len(), corners + 1);
                assert_eq!(ring.first(), ring.last());
                let metres: Vec<_> = ring.iter().map(|point| metres(point)).collect();
                let signed: f64 = metres
                    .windows(2)
                    .map(|pair| 0.5 * (pair[0].0 * pair[1].1 - pair[1].0 * pair[0].1))
                    .sum();
                // Meridians converge: 1e-4 over 100 m is more than that, and than the rounding.
                assert!((signed / area - 1.0).abs() < 1e-4, "{kind}: {signed} and {area}");
            }
        }
    }

    #[test]
    fn a_line_over_the_antimeridian_does_not_run_around_the_earth() {
        let record = Record {
            origin: Some(Origin {
                latitude: 0.3,
                longitude: (-179.999_95_f64).to_radians(),
            }),
            ..sample::record()
        };
        for feature in written(&record) {
            let coordinates = &feature["geometry"]["coordinates"];
            let line = if feature["geometry"]["type"] == "Polygon" {
                points(&coordinates[0])
            } else {
                points(coordinates)
            };
            let (west, east) = line.iter().fold((f64::MAX, f64::MIN), |(west, east), point| {
                (west.min(point[0]), east.max(point[0]))
            });
            assert!(east - west < 0.01, "{feature}");
        }
    }
}
