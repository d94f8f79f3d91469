//! GeoJSON, and plans of QGroundControl.

use std::{collections::BTreeMap, io::BufReader};

use geojson::{Feature, GeoJson, GeometryValue, Position};
use serde_json::{Value, value::RawValue};

use crate::mission::Mission;
use crate::progress::{BYTES_MAX, Progress};
use crate::route::{HOLES, NAMES_TOLD, Route, RoutePoint, Unread, lines_in, number, refused, shortened};

/// Most memory for the values of a file, bytes: four times the largest file.
const VALUES_BYTES_MAX: usize = 4 * BYTES_MAX;

/// Least memory of an array (four values), an object (eleven members) and a value, bytes.
const ARRAY_BYTES: usize = 4 * VALUE_BYTES;
const OBJECT_BYTES: usize = 11 * (size_of::<String>() + VALUE_BYTES);
const VALUE_BYTES: usize = size_of::<Value>();

pub(crate) fn routes(text: &str, mut progress: Progress<'_>) -> Result<Vec<Route>, Unread> {
    let value = parsed(text, &progress)?;
    let routes =
        if value["fileType"] == "Plan" { plan(&value, &mut progress) } else { geojson(value, &mut progress) };
    routes.map_err(|unread| Unread { place: located(text, &unread.place), ..unread })
}

/// The values of a file.
pub(crate) fn parsed(text: &str, progress: &Progress<'_>) -> Result<Value, Unread> {
    let broken = |error: serde_json::Error| {
        Unread::new(format!("line {}", error.line()), format!("is no JSON: {error}"))
    };
    weigh(text)?;
    serde_json::from_reader(BufReader::new(progress.watched(text.as_bytes()))).map_err(broken)
}

/// Fails before the values of `text` take too much memory.
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
            return refused(place, fault);
        }
    }
    Ok(())
}

/// The JSON pointer, with the line of its last step that exists.
pub(crate) fn located(text: &str, pointer: &str) -> String {
    let mut at = text;
    for step in pointer.split('/').skip(1) {
        let inner = match step.parse::<usize>() {
            Ok(k) => serde_json::from_str::<Vec<&RawValue>>(at).ok().and_then(|items| items.get(k).copied()),
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

/// The features of a file, each with its place.
pub(crate) fn features(mut value: Value) -> Result<Vec<(String, Value)>, Unread> {
    let crs = value["crs"].to_string();
    if crs.contains("EPSG") && !crs.contains("4326") {
        return refused("/crs", "is not WGS 84; export it in longitude and latitude");
    }
    if value["type"] != "FeatureCollection" {
        return Ok(vec![(String::new(), value)]);
    }
    let Value::Array(items) = value["features"].take() else {
        return refused("/features", "is no list");
    };
    let feature = |(k, item)| (format!("/features/{k}"), item);
    Ok(items.into_iter().enumerate().map(feature).collect())
}

/// The feature at a place, and the place of its geometry.
pub(crate) fn feature(item: Value, place: String) -> Result<(Feature, String), Unread> {
    let no_geojson = |error: serde_json::Error| {
        let fault = format!("is neither GeoJSON nor a plan of QGroundControl: {error}");
        Unread::new(&*place, fault)
    };
    match serde_json::from_value(item).map_err(no_geojson)? {
        GeoJson::Feature(feature) => Ok((feature, format!("{place}/geometry"))),
        GeoJson::Geometry(geometry) => Ok((Feature::from(geometry), place)),
        GeoJson::FeatureCollection(_) => refused(place, "is a collection inside another"),
    }
}

fn geojson(value: Value, progress: &mut Progress<'_>) -> Result<Vec<Route>, Unread> {
    let (mut routes, mut loose) = (Vec::new(), Route::default());
    for (place, item) in features(value)? {
        let properties_at = format!("{place}/properties");
        let (feature, place) = feature(item, place)?;
        let coordinates_at = format!("{place}/coordinates");
        let name = feature.property("name").and_then(Value::as_str).unwrap_or_default();
        let [speed, depth] = ["speed_mps", "depth_m"].map(|wanted| stated(&properties_at, &feature, wanted));
        let (speed, depth) = (speed?, depth?);
        let mut route = Route::named(name);
        let note = unused(&feature);
        let mut ring = false;
        match feature.geometry.as_ref().map(|geometry| &geometry.value) {
            Some(GeometryValue::Point { coordinates }) => {
                let mut point = position(&coordinates_at, coordinates)?;
                (point.speed_mps, point.depth_m) = (speed, depth.or(point.depth_m));
                loose.notes.extend(note.filter(|note| loose.notes.last() != Some(note)));
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
                    if 1 < coordinates.len() {
                        route.note(HOLES);
                    }
                }
            }
            Some(GeometryValue::MultiPolygon { .. } | GeometryValue::GeometryCollection { .. }) => {
                return refused(place, "is of many areas or kinds; keep one line or one area");
            }
            None => continue,
        }
        for point in &mut route.points {
            point.speed_mps = speed;
            point.depth_m = depth.or(point.depth_m);
        }
        route.notes.extend(note);
        let route = if ring { route.ring() } else { route };
        progress.route(&mut routes, &coordinates_at, route)?;
    }
    if routes.is_empty() {
        progress.route(&mut routes, "", loose)?;
    }
    Ok(routes)
}

/// The number in a property.
fn stated(place: &str, feature: &Feature, wanted: &str) -> Result<Option<f64>, Unread> {
    let place = || format!("{place}/{wanted}");
    match feature.property(wanted) {
        None | Some(Value::Null) => Ok(None),
        Some(Value::String(text)) => number(&place(), text).map(Some),
        Some(given) => match given.as_f64() {
            None => refused(place(), "is no number"),
            number => Ok(number),
        },
    }
}

/// Names the properties that a route does not use.
fn unused(feature: &Feature) -> Option<String> {
    let given = feature.properties.iter().flatten().filter(|(_, value)| !value.is_null());
    let names = given.map(|(name, _)| name.as_str());
    let names = names.filter(|name| !["name", "speed_mps", "depth_m"].contains(name));
    let names: Vec<String> = names.take(NAMES_TOLD).map(shortened).collect();
    let note = || format!("properties that are not used: {}", names.join(", "));
    (!names.is_empty()).then(note)
}

pub(crate) fn extend(
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
        _ => refused(place, "needs a longitude and a latitude"),
    }
}

fn plan(value: &Value, progress: &mut Progress<'_>) -> Result<Vec<Route>, Unread> {
    let Some(items) = value["mission"]["items"].as_array() else {
        return refused("/mission/items", "is missing");
    };
    // `cruiseSpeed` is the ground station's assumption for durations, not the vehicle's speed.
    let mut mission = Mission::default();
    for (k, item) in items.iter().enumerate() {
        let place = format!("/mission/items/{k}");
        let inner = &item["TransectStyleComplexItem"]["Items"];
        match (item["type"].as_str(), inner.as_array()) {
            (_, Some(inner)) => {
                for (k, item) in inner.iter().enumerate() {
                    let place = format!("{place}/TransectStyleComplexItem/Items/{k}");
                    simple(&mut mission, (&place, progress), item)?;
                }
            }
            (Some("SimpleItem"), None) => simple(&mut mission, (&place, progress), item)?,
            _ => {
                let fault =
                    "is a pattern without its way-points; save the plan again, or draw it as way-points";
                return refused(place, fault);
            }
        }
    }
    let mut routes = Vec::new();
    progress.route(&mut routes, "/mission/items", mission.route)?;
    Ok(routes)
}

fn simple(mission: &mut Mission, place: (&str, &mut Progress<'_>), item: &Value) -> Result<(), Unread> {
    let param = |k: usize| item["params"][k].as_f64();
    let whole = |member: &str| item[member].as_u64().unwrap_or_default();
    let numbers = [param(0), param(1), param(4), param(5), param(6)];
    mission.take(place, (whole("doJumpId"), whole("command")), numbers)
}
