//! A record as `GeoJSON` (RFC 7946): lines with times for vehicles and goal; paths, discs and area.
//!
//! Positions are longitude, latitude and, if an AUV's depth is known, minus the depth as altitude,
//! in WGS 84. This altitude is above the sea surface, RFC 7946's above the ellipsoid: this sea has
//! no geoid. Lines are not cut at the antimeridian: longitudes continue beyond ±180°.
//!
//! The record is read once to find the vehicles and twice for each of them: a line has one list of
//! points and one of times, and neither fits into memory.

use std::collections::{BTreeMap, VecDeque};
use std::f64::consts::TAU;
use std::io::{self, Write};

use geodesy::{Datum, Origin};
use nalgebra::Vector2;
use serde_json::{Map, Value, json};

use crate::source::Placed;
use crate::table::{Row, SURFACE_CRAFT};
use crate::{ExportError, Source};

/// Decimals of a degree: 1e-9° is 0.1 mm.
const DEGREE_DECIMALS: i32 = 9;
/// Decimals of a metre.
const METRE_DECIMALS: i32 = 3;

/// Number of points held back for sorting by time; a report that is later keeps its position.
const WINDOW: usize = 4_096;

/// Least number of points of a line (RFC 7946, 3.1.4).
const POINTS_MIN: usize = 2;

pub(super) fn write<S: Source>(record: &Placed<'_, S>, out: &mut impl Write) -> Result<(), S::Error> {
    let source = record.record;
    let (origin, datum) = source.origin().zip(record.datum).ok_or(ExportError::NoOrigin)?;
    let about = source.about().into_iter();
    let run = about.filter(|(key, _)| ["scenario", "seed"].contains(key));
    let chart =
        Chart { source, origin, datum, run: run.map(|(key, value)| (key.to_owned(), value)).collect() };
    out.write_all(b"{\"type\":\"FeatureCollection\",\"features\":[")?;
    let mut separator: &[u8] = b"\n";
    for (track, _) in chart.points_of_each()?.into_iter().filter(|(_, n)| POINTS_MIN <= *n) {
        out.write_all(std::mem::replace(&mut separator, b",\n"))?;
        chart.track(&track, out)?;
    }
    for feature in chart.scene() {
        out.write_all(std::mem::replace(&mut separator, b",\n"))?;
        serde_json::to_writer(&mut *out, &feature).map_err(io::Error::from)?;
    }
    out.write_all(b"\n]}\n")?;
    Ok(())
}

/// Owner of a line: kind and id. The surface craft comes first.
type TrackKey = (&'static str, String);

/// Position of a vehicle or the goal at a time.
#[derive(Clone, Copy, Debug, PartialEq)]
struct TimedPosition {
    /// On the mission's clock, s.
    time: f64,
    /// (north, east), m.
    position: Vector2<f64>,
    /// m.
    depth: Option<f64>,
}

/// The positions in a row and their owners.
fn track_points<'a>(row: &Row<'a>) -> impl Iterator<Item = (&'static str, &'a str, TimedPosition)> {
    let time = row.t_s.unwrap_or_default();
    let place = |position, depth| TimedPosition { time, position, depth };
    let vehicle = row.place().map(|(id, position)| {
        // One of several surface craft has a name of its own.
        if id == SURFACE_CRAFT || row.energy_j.is_some() {
            ("asc", id, place(position, None))
        } else {
            ("auv", id, place(position, row.depth_m))
        }
    });
    let goal = row.goal_north_m.zip(row.goal_east_m);
    let of_one = row.vehicle.filter(|id| *id != SURFACE_CRAFT).unwrap_or("goal");
    let goal = goal.map(|(north, east)| ("goal", of_one, place(Vector2::new(north, east), None)));
    vehicle.into_iter().chain(goal)
}

struct Chart<'a, S> {
    source: &'a S,
    origin: Origin,
    datum: Datum,
    /// Properties of the run, for every feature.
    run: Map<String, Value>,
}

impl<S: Source> Chart<'_, S> {
    /// Longitude and latitude of (north, east), degrees.
    fn degrees(&self, point: &Vector2<f64>) -> [f64; 2] {
        let place = self.datum.from_local(point);
        // On the datum's side of the antimeridian: lines are continuous.
        let turns = ((place.longitude - self.origin.longitude) / TAU).round();
        let longitude = place.longitude - TAU * turns;
        [longitude, place.latitude].map(|angle| rounded(angle.to_degrees(), DEGREE_DECIMALS))
    }

    fn for_each_place(
        &self,
        mut take: impl FnMut(&'static str, &str, TimedPosition) -> Result<(), S::Error>,
    ) -> Result<(), S::Error> {
        self.source.for_each_with_places(&mut |entry| {
            let mut places = entry.rows.iter().flat_map(track_points);
            places.try_for_each(|(kind, id, place)| take(kind, id, place))
        })
    }

    fn points_of_each(&self) -> Result<BTreeMap<TrackKey, usize>, S::Error> {
        let mut points = BTreeMap::new();
        self.for_each_place(|kind, id, _| {
            *points.entry((kind, id.to_owned())).or_default() += 1;
            Ok(())
        })?;
        Ok(points)
    }

    fn track(&self, track: &TrackKey, out: &mut impl Write) -> Result<(), S::Error> {
        let properties = self.properties(track.0, &track.1).to_string();
        let open = properties.strip_suffix('}').unwrap_or(&properties);
        write!(out, r#"{{"type":"Feature","properties":{open},"t_s":"#)?;
        self.list(track, out, |out, place| number(out, place.time))?;
        write!(out, r#"}},"geometry":{{"type":"LineString","coordinates":"#)?;
        self.list(track, out, |out, place| {
            let [longitude, latitude] = self.degrees(&place.position);
            out.write_all(b"[")?;
            number(out, longitude)?;
            out.write_all(b",")?;
            number(out, latitude)?;
            if let Some(depth) = place.depth {
                out.write_all(b",")?;
                number(out, rounded(-depth, METRE_DECIMALS))?;
            }
            out.write_all(b"]")
        })?;
        out.write_all(b"}}")?;
        Ok(())
    }

    /// A JSON list of the track's places in order of time, each written by `write_place`.
    fn list<W: Write>(
        &self,
        (kind, id): &TrackKey,
        out: &mut W,
        write_place: impl Fn(&mut W, &TimedPosition) -> io::Result<()>,
    ) -> Result<(), S::Error> {
        let mut separator: &[u8] = b"[";
        let mut item = |place: Option<TimedPosition>| {
            let Some(place) = place else { return Ok(()) };
            out.write_all(std::mem::replace(&mut separator, b","))?;
            write_place(out, &place)
        };
        let mut window = Window::default();
        self.for_each_place(|of, whose, place| {
            if (of, whose) == (kind, id) {
                item(window.push(place))?;
            }
            Ok(())
        })?;
        while let Some(place) = window.0.pop_front() {
            item(Some(place))?;
        }
        out.write_all(b"]")?;
        Ok(())
    }

    fn scene(&self) -> Vec<Value> {
        let scene = self.source.scene();
        let mut features = vec![];
        for (id, path) in scene.paths.iter().filter(|(_, path)| POINTS_MIN <= path.len()) {
            let line: Vec<_> = path.iter().map(|point| self.degrees(point)).collect();
            features.push(self.feature("path", id, &json!({"type": "LineString", "coordinates": line})));
        }
        for (i, disc) in scene.keep_outs.iter().enumerate() {
            let id = format!("keep-out-{}", i + 1);
            features.push(self.feature("keep_out", &id, &self.polygon(&disc.outline())));
        }
        if !scene.area.is_empty() {
            features.push(self.feature("area", "area", &self.polygon(scene.area)));
        }
        features
    }

    /// A closed ring, counter-clockwise from above (RFC 7946, 3.1.6).
    fn polygon(&self, corners: &[Vector2<f64>]) -> Value {
        let mut ring: Vec<_> = corners.iter().map(|corner| self.degrees(corner)).collect();
        if is_clockwise(corners) {
            ring.reverse();
        }
        ring.extend(ring.first().copied());
        json!({"type": "Polygon", "coordinates": [ring]})
    }

    fn feature(&self, kind: &str, id: &str, geometry: &Value) -> Value {
        json!({"type": "Feature", "properties": self.properties(kind, id), "geometry": geometry})
    }

    fn properties(&self, kind: &str, id: &str) -> Value {
        let mut properties = self.run.clone();
        properties.insert("kind".to_owned(), json!(kind));
        properties.insert("id".to_owned(), json!(id));
        Value::Object(properties)
    }
}

/// Points in order of time, except late ones.
#[derive(Debug, Default)]
struct Window(VecDeque<TimedPosition>);

impl Window {
    /// Adds a point, and returns the earliest if the window is full.
    fn push(&mut self, place: TimedPosition) -> Option<TimedPosition> {
        let order = self.0.partition_point(|earlier| earlier.time <= place.time);
        self.0.insert(order, place);
        let is_full = WINDOW < self.0.len();
        is_full.then(|| self.0.pop_front()).flatten()
    }
}

/// `true` if (north, east) corners go clockwise seen from above: the signed area is positive.
fn is_clockwise(corners: &[Vector2<f64>]) -> bool {
    let next = corners.iter().cycle().skip(1);
    let twice_area: f64 = corners.iter().zip(next).map(|(a, b)| a.perp(b)).sum();
    0.0 < twice_area
}

fn number(out: &mut impl Write, number: f64) -> io::Result<()> {
    Ok(serde_json::to_writer(out, &number)?)
}

fn rounded(value: f64, decimals: i32) -> f64 {
    let scale = 10_f64.powi(decimals);
    (value * scale).round() / scale
}
#[cfg(test)]
mod tests {
    use super::*;
    use crate::sample_for_tests::{self, Sample};

    fn written(record: &Sample) -> Vec<Value> {
        let mut bytes = vec![];
        crate::write(record, crate::Format::Geojson, &mut bytes).expect("can be written");
        let value: Value = serde_json::from_slice(&bytes).expect("is JSON");
        assert_eq!(value["type"], "FeatureCollection");
        value["features"].as_array().expect("is a list").clone()
    }

    fn of_kind(features: &[Value], kind: &str) -> Value {
        let mut found = features.iter().filter(|feature| feature["properties"]["kind"] == kind);
        let feature = found.next().expect("is there").clone();
        assert!(found.next().is_none(), "{kind} is there once");
        feature
    }

    fn points(coordinates: &Value) -> Vec<Vec<f64>> {
        serde_json::from_value(coordinates.clone()).expect("is a list of positions")
    }

    /// Metres east and north of the datum, by the ellipsoid's radii at 38.41°.
    fn metres(point: &[f64]) -> (f64, f64) {
        let radii = (6_360_075.0, 6_386_394.0);
        let latitude = 38.41_f64.to_radians();
        ((point[0] + 9.12).to_radians() * radii.1 * latitude.cos(), (point[1] - 38.41).to_radians() * radii.0)
    }

    #[test]
    fn every_kind_has_its_geometry_and_its_run() {
        let features = written(&sample_for_tests::record());
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
    fn tracks_have_longitude_latitude_minus_depth_and_times() {
        let features = written(&sample_for_tests::record());
        let auv = of_kind(&features, "auv");
        let line = points(&auv["geometry"]["coordinates"]);
        assert_eq!(auv["properties"]["t_s"], json!([0.0, 0.5, 1.0]));
        for (point, (north, depth)) in line.iter().zip([(4.0, 9.0), (4.5, 9.5), (5.0, 10.0)]) {
            let (east_of, north_of) = metres(point);
            // The radii are rounded to a metre in six million, the degrees to 0.1 mm.
            assert!((east_of - 5.0).abs() < 5e-4 && (north_of - north).abs() < 5e-4, "{point:?}");
            assert_eq!(point[2], -depth);
        }
        let asc = of_kind(&features, "asc");
        let line = points(&asc["geometry"]["coordinates"]);
        assert!(line.len() == 3 && line.iter().all(|point| point.len() == 2));
    }

    #[test]
    fn rings_are_closed_and_counter_clockwise_for_either_order_of_corners() {
        let mut record = sample_for_tests::record();
        for _ in 0..2 {
            record.area.reverse();
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
                let signed: f64 =
                    metres.windows(2).map(|pair| 0.5 * (pair[0].0 * pair[1].1 - pair[1].0 * pair[0].1)).sum();
                // Meridians converge: 1e-4 over 100 m exceeds that and the rounding.
                assert!((signed / area - 1.0).abs() < 1e-4, "{kind}: {signed} and {area}");
            }
        }
    }

    #[test]
    fn a_line_over_the_antimeridian_does_not_run_around_the_earth() {
        let record = Sample {
            origin: Some(Origin { latitude: 0.3, longitude: (-179.999_95_f64).to_radians() }),
            ..sample_for_tests::record()
        };
        for feature in written(&record) {
            let coordinates = &feature["geometry"]["coordinates"];
            let line = if feature["geometry"]["type"] == "Polygon" {
                points(&coordinates[0])
            } else {
                points(coordinates)
            };
            let (west, east) = line
                .iter()
                .fold((f64::MAX, f64::MIN), |(west, east), point| (west.min(point[0]), east.max(point[0])));
            assert!(east - west < 0.01, "{feature}");
        }
    }
}
