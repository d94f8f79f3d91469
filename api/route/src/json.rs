//! GeoJSON, and plans of QGroundControl.

use std::{collections::BTreeMap, io::BufReader};

use geojson::{Feature, GeoJson, GeometryValue, Position};
use serde_json::{Value, value::RawValue};

use crate::{
    progress::{BYTES_MAX, Progress},
    route::{Route, RoutePoint, Unread, lines_in},
};

/// MAVLink commands that go to a position: way-point, loiter (without end, turns, time), land, take-off, spline way-point.
/// Source: MAVLink, MAV_CMD.
const GO_TO: [u64; 7] = [16, 17, 18, 19, 21, 22, 82];
const JUMP: u64 = 177;
const CHANGE_SPEED: u64 = 178;

/// Most memory for the values of a file, bytes: four times the largest file.
const VALUES_BYTES_MAX: usize = 4 * BYTES_MAX;

/// What an array, an object and any value take in memory at least, bytes: room for four values, for eleven members, and itself.
const ARRAY_BYTES: usize = 4 * VALUE_BYTES;
const OBJECT_BYTES: usize = 11 * (size_of::<String>() + VALUE_BYTES);
const VALUE_BYTES: usize = size_of::<Value>();

pub(crate) fn routes(text: &str, mut progress: Progress<'_>) -> Result<Vec<Route>, Unread> {
    let broken = |error: serde_json::Error| {
        Unread::new(format!("line {}", error.line()), format!("is no JSON: {error}"))
    };
    weigh(text)?;
    let watched = BufReader::new(progress.watched(text.as_bytes()));
    let value: Value = serde_json::from_reader(watched).map_err(broken)?;
    let routes = if value["fileType"] == "Plan" {
        plan(&value, &mut progress)
    } else {
        geojson(value, &mut progress)
    };
    routes.map_err(|unread| Unread {
        place: located(text, &unread.place),
        ..unread
    })
}

/// Fails where the values of `text` take too much memory, before they take any.
fn weigh(text: &str) -> Result<(), Unread> {
    let (mut bytes, mut in_text, mut escaped) = (0, false, false);
    for (at, byte) in text.bytes().enumerate() {
        bytes += match byte {
            _ if in_text => 1,
            b'[' => ARRAY_BYTES,
            b'{' => OBJECT_BYTES,
            b',' => VALUE_BYTES,
            _ => 0,
        };
        in_text ^= byte == b'"' && !escaped;
        escaped = in_text && byte == b'\\' && !escaped;
        if VALUES_BYTES_MAX < bytes {
            let place = format!("line {}", 1 + lines_in(&text[..at]));
            let fault = format!(
                "has more lists and members until here than {VALUES_BYTES_MAX} bytes hold; thin it out"
            );
            return Err(Unread::new(place, fault));
        }
    }
    Ok(())
}

/// The JSON pointer with its line, as far as it leads.
fn located(text: &str, pointer: &str) -> String {
    let mut at = text;
    for step in pointer.split('/').skip(1) {
        let inner = match step.parse::<usize>() {
            Ok(k) => serde_json::from_str::<Vec<&RawValue>>(at)
                .ok()
                .and_then(|items| items.get(k).copied()),
            Err(_) => serde_json::from_str::<BTreeMap<&str, &RawValue>>(at)
                .ok()
                .and_then(|members| members.get(step).copied()),
        };
        let Some(inner) = inner else { break };
        at = inner.get();
    }
    let before = at.as_ptr().addr() - text.as_ptr().addr();
    let line = 1 + lines_in(&text[..before]);
    if pointer.is_empty() {
        return format!("line {line}");
    }
    format!("line {line} ({pointer})")
}

fn geojson(mut value: Value, progress: &mut Progress<'_>) -> Result<Vec<Route>, Unread> {
    let crs = value["crs"].to_string();
    if crs.contains("EPSG") && !crs.contains("4326") {
        return Err(Unread::new(
            "/crs",
            "is not WGS 84; export it in longitude and latitude",
        ));
    }
    let features = if value["type"] == "FeatureCollection" {
        let Value::Array(items) = value["features"].take() else {
            return Err(Unread::new("/features", "is no list"));
        };
        let feature = |(k, item)| (format!("/features/{k}"), item);
        items.into_iter().enumerate().map(feature).collect()
    } else {
        vec![(String::new(), value)]
    };
    let (mut routes, mut loose) = (Vec::new(), Route::default());
    for (place, item) in features {
        let no_geojson = |error: serde_json::Error| {
            let fault = format!("is neither GeoJSON nor a plan of QGroundControl: {error}");
            Unread::new(&*place, fault)
        };
        let (feature, place) = match serde_json::from_value(item).map_err(no_geojson)? {
            GeoJson::Feature(feature) => (feature, format!("{place}/geometry")),
            GeoJson::Geometry(geometry) => (Feature::from(geometry), place),
            GeoJson::FeatureCollection(_) => {
                return Err(Unread::new(place, "is a collection inside another"));
            }
        };
        let coordinates_at = format!("{place}/coordinates");
        let name = feature
            .property("name")
            .and_then(Value::as_str)
            .unwrap_or_default();
        let speed = feature.property("speed_mps").and_then(Value::as_f64);
        let depth = feature.property("depth_m").and_then(Value::as_f64);
        let mut route = Route::named(name);
        let mut ring = false;
        match feature.geometry.as_ref().map(|geometry| &geometry.value) {
            Some(GeometryValue::Point { coordinates }) => {
                let point = position(&coordinates_at, coordinates)?;
                progress.point(&mut loose, &coordinates_at, point)?;
                continue;
            }
            Some(GeometryValue::LineString { coordinates } | GeometryValue::MultiPoint { coordinates }) => {
                extend(progress, &mut route, &coordinates_at, coordinates)?;
            }
            Some(GeometryValue::MultiLineString { coordinates }) => {
                for (k, part) in coordinates.iter().enumerate() {
                    extend(progress, &mut route, &format!("{coordinates_at}/{k}"), part)?;
                }
            }
            Some(GeometryValue::Polygon { coordinates }) => {
                if let Some(outer) = coordinates.first() {
                    extend(progress, &mut route, &format!("{coordinates_at}/0"), outer)?;
                    ring = true;
                }
            }
            Some(GeometryValue::MultiPolygon { .. } | GeometryValue::GeometryCollection { .. }) => {
                return Err(Unread::new(
                    place,
                    "is of many areas or kinds; keep one line or one area",
                ));
            }
            None => continue,
        }
        for point in &mut route.points {
            point.speed_mps = speed;
            point.depth_m = depth.or(point.depth_m);
        }
        let route = if ring { route.ring() } else { route };
        progress.route(&mut routes, &coordinates_at, route)?;
    }
    if routes.is_empty() {
        progress.route(&mut routes, "", loose)?;
    }
    Ok(routes)
}

fn extend(
    progress: &mut Progress<'_>,
    route: &mut Route,
    place: &str,
    line: &[Position],
) -> Result<(), Unread> {
    for (k, at) in line.iter().enumerate() {
        let place = format!("{place}/{k}");
        progress.point(route, &place, position(&place, at)?)?;
    }
    Ok(())
}

fn position(place: &str, at: &Position) -> Result<RoutePoint, Unread> {
    match at.as_slice() {
        [lon, lat, rest @ ..] => RoutePoint::on_earth(place, *lat, *lon, rest.first().copied()),
        _ => Err(Unread::new(place, "needs a longitude and a latitude")),
    }
}

fn plan(value: &Value, progress: &mut Progress<'_>) -> Result<Vec<Route>, Unread> {
    let mission = &value["mission"];
    let Some(items) = mission["items"].as_array() else {
        return Err(Unread::new("/mission/items", "is missing"));
    };
    let mut route = Route::default();
    let mut speed = mission["cruiseSpeed"].as_f64();
    for (k, item) in items.iter().enumerate() {
        let place = format!("/mission/items/{k}");
        let inner = &item["TransectStyleComplexItem"]["Items"];
        match (item["type"].as_str(), inner.as_array()) {
            (_, Some(inner)) => {
                for (k, item) in inner.iter().enumerate() {
                    let place = format!("{place}/TransectStyleComplexItem/Items/{k}");
                    simple(&mut route, &mut speed, (&place, progress), item)?;
                }
            }
            (Some("SimpleItem"), None) => simple(&mut route, &mut speed, (&place, progress), item)?,
            _ => {
                let fault =
                    "is a pattern without its way-points; save the plan again, or draw it as way-points";
                return Err(Unread::new(place, fault));
            }
        }
    }
    let mut routes = Vec::new();
    progress.route(&mut routes, "/mission/items", route)?;
    Ok(routes)
}

fn simple(
    route: &mut Route,
    speed: &mut Option<f64>,
    place: (&str, &mut Progress<'_>),
    item: &Value,
) -> Result<(), Unread> {
    let param = |k: usize| item["params"][k].as_f64();
    let command = item["command"].as_u64().unwrap_or_default();
    let numbers = [param(0), param(1), param(4), param(5), param(6)];
    take(route, speed, place, command, numbers)
}

/// Takes a mission item of MAVLink: parameters 1, 2, 5, 6 and 7.
pub(crate) fn take(
    route: &mut Route,
    speed: &mut Option<f64>,
    (place, progress): (&str, &mut Progress<'_>),
    command: u64,
    [first, second, lat, lon, height]: [Option<f64>; 5],
) -> Result<(), Unread> {
    match command {
        CHANGE_SPEED => *speed = second.filter(|speed| 0.0 < *speed).or(*speed),
        JUMP if first.is_some_and(|to| to <= 2.0) => route.closed = true,
        JUMP => {
            return Err(Unread::new(
                place,
                "jumps into the middle of the route; write its legs out",
            ));
        }
        _ if GO_TO.contains(&command) => {
            let (Some(lat), Some(lon)) = (lat, lon) else {
                return Err(Unread::new(place, "has no position"));
            };
            // Zeros stand for where the vehicle is.
            if lat != 0.0 || lon != 0.0 {
                let mut point = RoutePoint::on_earth(place, lat, lon, height)?;
                point.speed_mps = *speed;
                progress.point(route, place, point)?;
            }
        }
        _ => {}
    }
    Ok(())
}
