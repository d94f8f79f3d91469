//! Way-point lists of MAVLink (QGC WPL), MOOS points, and CSV.

use std::mem;

use crate::{
    json,
    lawnmower::{LawnMower, lanes_over},
    progress::Progress,
    route::{Route, RoutePoint, Unread, number, shortened},
};

pub(crate) fn routes(text: &str, mut progress: Progress<'_>) -> Result<Vec<Route>, Unread> {
    if text.trim_start().starts_with("QGC WPL") {
        return wpl(text, &mut progress);
    }
    let first = text.lines().map(uncommented).find(|line| !line.is_empty());
    if first.is_some_and(is_moos) {
        return moos(text, &mut progress);
    }
    csv(text, &mut progress)
}

/// Columns of an item of a way-point list.
const WPL_COLUMNS: usize = 12;

/// Source: MAVLink, "File formats": index, current, frame, command, seven parameters, autocontinue.
fn wpl(text: &str, progress: &mut Progress<'_>) -> Result<Vec<Route>, Unread> {
    let lines = || text.lines().enumerate().skip(1);
    let mut items = lines().filter(|(_, line)| !line.trim().is_empty());
    // ArduPilot's tools write the home position first, in absolute height and nothing else so.
    let home = items.next().map(wpl_item).transpose()?;
    let mut is_home = false;
    for item in items {
        let (place, item) = wpl_item(item)?;
        progress.look(&place)?;
        is_home |= item[2] != 0.0;
    }
    is_home &= home.is_some_and(|(_, home)| home[2] == 0.0);
    let (mut route, mut speed) = (Route::default(), None);
    let items = lines().filter(|(_, line)| !line.trim().is_empty());
    for item in items.skip(usize::from(is_home)) {
        let (place, item) = wpl_item(item)?;
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "what is no command saturates, and is none"
        )]
        let command = item[3] as u64;
        let given = |column: usize| Some(item[column]).filter(|number| number.is_finite());
        let numbers = [4, 5, 8, 9, 10].map(given);
        json::take(&mut route, &mut speed, (&place, progress), command, numbers)?;
    }
    let mut routes = Vec::new();
    progress.route(&mut routes, "file", route)?;
    Ok(routes)
}

/// An item of a numbered line, and its place.
fn wpl_item((k, line): (usize, &str)) -> Result<(String, [f64; WPL_COLUMNS]), Unread> {
    let place = format!("line {}", k + 1);
    let n = line.split_whitespace().count();
    if n != WPL_COLUMNS {
        return Err(Unread::new(place, format!("has {n} columns, not {WPL_COLUMNS}")));
    }
    let mut item = [0.0; WPL_COLUMNS];
    for (number, text) in item.iter_mut().zip(line.split_whitespace()) {
        // Parameters that the command does not have may be NaN.
        let parsed = text.parse();
        *number = parsed.map_err(|_| Unread::new(&*place, format!("{:?} is no number", shortened(text))))?;
    }
    Ok((place, item))
}

fn uncommented(line: &str) -> &str {
    line.split("//").next().unwrap_or_default().trim()
}

fn is_moos(line: &str) -> bool {
    let key = line
        .split('=')
        .next()
        .unwrap_or_default()
        .trim()
        .to_ascii_lowercase();
    matches!(
        key.as_str(),
        "points" | "pts" | "polygon" | "format" | "point" | "seglist"
    ) || line.contains("pts={")
        || (line.contains(':') && line.split(':').all(|pair| pair.split(',').count() >= 2))
}

/// Points of MOOS-IvP: x is east, y is north.
fn moos(text: &str, progress: &mut Progress<'_>) -> Result<Vec<Route>, Unread> {
    let mut routes = Vec::new();
    let (mut single, mut bare) = (Route::default(), Route::default());
    for (k, line) in text.lines().map(uncommented).enumerate() {
        let place = format!("line {}", k + 1);
        progress.look(&place)?;
        if line.is_empty() || !is_moos(line) {
            continue;
        }
        let (key, rest) = match line.split_once('=') {
            Some((key, rest)) if !key.contains(['{', ',', ':']) => {
                (key.trim().to_ascii_lowercase(), rest.trim())
            }
            _ => (String::new(), line),
        };
        if key == "format" || rest.contains("format=") || rest.contains("format =") {
            let whole = if key == "format" { line } else { rest };
            let route = pattern(progress, &place, whole)?;
            progress.route(&mut routes, &place, route)?;
        } else if key == "point" {
            points(progress, &mut single, &place, rest)?;
        } else if key.is_empty() && !rest.contains('{') {
            points(progress, &mut bare, &place, rest)?;
        } else {
            let (list, after) = braced(if key == "pts" { line } else { rest });
            let label = members(after)
                .find(|(key, _)| key == "label")
                .map(|(_, value)| value);
            let mut route = Route::named(label.unwrap_or_default());
            points(progress, &mut route, &place, list)?;
            let route = if key == "polygon" { route.ring() } else { route };
            progress.route(&mut routes, &place, route)?;
        }
    }
    for route in [single, bare] {
        progress.route(&mut routes, "file", route)?;
    }
    Ok(routes)
}

/// What `pts={…}` holds and what stands after it; without braces, the whole.
fn braced(text: &str) -> (&str, &str) {
    match (text.find('{'), text.find('}')) {
        (Some(open), Some(close)) if open < close => (&text[open + 1..close], &text[close + 1..]),
        _ => (text, ""),
    }
}

fn points(progress: &mut Progress<'_>, route: &mut Route, place: &str, list: &str) -> Result<(), Unread> {
    for pair in list.split(':').map(str::trim).filter(|pair| !pair.is_empty()) {
        let mut numbers = pair.split(',');
        let (Some(x), Some(y)) = (numbers.next(), numbers.next()) else {
            return Err(Unread::new(place, format!("{:?} is no x,y", shortened(pair))));
        };
        let point = RoutePoint::local(place, number(place, y)?, number(place, x)?)?;
        progress.point(route, place, point)?;
    }
    Ok(())
}

fn members(text: &str) -> impl Iterator<Item = (String, &str)> {
    let pairs = text.split(',').filter_map(|pair| pair.split_once('='));
    pairs.map(|(key, value)| (key.trim().to_ascii_lowercase(), value.trim()))
}

/// `format=lawnmower`: lanes over a rectangle about a centre, turned clockwise by `degs`.
fn pattern(progress: &mut Progress<'_>, place: &str, text: &str) -> Result<Route, Unread> {
    let value = |wanted: &str| {
        members(text)
            .find(|(key, _)| key == wanted)
            .map(|(_, value)| value)
    };
    let format = value("format").unwrap_or_default();
    if format != "lawnmower" {
        let fault = format!("format={} is not read; write its points out", shortened(format));
        return Err(Unread::new(place, fault));
    }
    let needed = |wanted: &str| {
        let found = value(wanted).ok_or_else(|| Unread::new(place, format!("lawnmower needs {wanted}")))?;
        number(place, found)
    };
    let or_zero = |wanted: &str| value(wanted).map_or(Ok(0.0), |text| number(place, text));
    let (x, y, width, height) = (needed("x")?, needed("y")?, needed("width")?, needed("height")?);
    let turned = or_zero("degs")?.to_radians();
    let along_north = value("rows").is_some_and(|rows| matches!(rows, "ns" | "north-south"));
    let corners = [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)].map(|(n, e)| {
        let (north, east) = (n * height, e * width);
        let (sin, cos) = turned.sin_cos();
        [y + north * cos - east * sin, x + north * sin + east * cos]
    });
    let heading = if along_north {
        turned
    } else {
        turned + std::f64::consts::FRAC_PI_2
    };
    let mower = LawnMower {
        spacing_m: needed("lane_width")?,
        heading_rad: heading,
    };
    let mut lanes = lanes_over(&corners, &mower).map_err(|fault| Unread::new(place, fault.to_string()))?;
    if let (Some(start_x), Some(start_y)) = (value("startx"), value("starty")) {
        let start = [number(place, start_y)?, number(place, start_x)?];
        let from = |point: &[f64; 2]| (point[0] - start[0]).hypot(point[1] - start[1]);
        if lanes.last().map(from) < lanes.first().map(from) {
            lanes.reverse();
        }
    }
    let mut route = Route::named(value("label").unwrap_or_default());
    for [north, east] in lanes {
        let point = RoutePoint::local(place, north, east)?;
        progress.point(&mut route, place, point)?;
    }
    Ok(route)
}

/// Columns by their names, in any order. A column `route` begins a new route where it changes.
fn csv(text: &str, progress: &mut Progress<'_>) -> Result<Vec<Route>, Unread> {
    let header = text.lines().next().unwrap_or_default();
    let delimiter = [b'\t', b';', b',']
        .into_iter()
        .find(|byte| header.as_bytes().contains(byte));
    let delimiter = delimiter.unwrap_or(b',');
    progress.columns(text, delimiter)?;
    let mut reader = ::csv::ReaderBuilder::new()
        .delimiter(delimiter)
        .trim(::csv::Trim::All)
        .from_reader(text.as_bytes());
    let broken = |error: ::csv::Error| {
        let line = error.position().map_or(1, ::csv::Position::line);
        Unread::new(format!("line {line}"), error.to_string())
    };
    let names: Vec<String> = reader
        .headers()
        .map_err(broken)?
        .iter()
        .map(str::to_lowercase)
        .collect();
    let column = |known: &[&str]| names.iter().position(|name| known.contains(&name.as_str()));
    let lat = column(&["lat", "latitude", "lat_deg"]);
    let lon = column(&["lon", "lng", "long", "longitude", "lon_deg"]);
    let north = column(&["north", "north_m", "northing"]);
    let east = column(&["east", "east_m", "easting"]);
    let (on_earth, first, second) = match (lat, lon, north, east) {
        (Some(lat), Some(lon), ..) => (true, lat, lon),
        (None, None, Some(north), Some(east)) => (false, north, east),
        _ => {
            let fault =
                "needs the columns lat and lon, or north_m and east_m (tools differ in what x and y are)";
            return Err(Unread::new("line 1", fault));
        }
    };
    let depth = column(&["depth", "depth_m"]);
    let speed = column(&["speed", "speed_mps"]);
    let name = column(&["route", "name"]);
    let (mut routes, mut route) = (Vec::new(), Route::default());
    for record in reader.records() {
        let record = record.map_err(broken)?;
        let place = format!("line {}", record.position().map_or(0, ::csv::Position::line));
        let read = |column: usize| {
            let text = record.get(column).unwrap_or_default();
            // With semicolons between columns, decimals have commas.
            if delimiter == b';' {
                number(&place, &text.replace(',', "."))
            } else {
                number(&place, text)
            }
        };
        let given = |column: Option<usize>| {
            column.filter(|column| record.get(*column).is_some_and(|text| !text.is_empty()))
        };
        let (first, second) = (read(first)?, read(second)?);
        let mut point = if on_earth {
            RoutePoint::on_earth(&place, first, second, None)?
        } else {
            RoutePoint::local(&place, first, second)?
        };
        point.depth_m = given(depth).map(read).transpose()?;
        point.speed_mps = given(speed).map(read).transpose()?;
        let named = name.and_then(|column| record.get(column)).unwrap_or_default();
        if route.name != named {
            let before = mem::replace(&mut route, Route::named(named));
            progress.route(&mut routes, &place, before)?;
        }
        progress.point(&mut route, &place, point)?;
    }
    progress.route(&mut routes, "file", route)?;
    Ok(routes)
}
