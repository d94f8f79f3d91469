//! Way-point lists of MAVLink (QGC WPL), MOOS points, and CSV.

use crate::{
    json,
    lawnmower::{LawnMower, lanes_over},
    route::{POINTS_MAX, Route, RoutePoint, Unread, number, shortened},
};

pub(crate) fn routes(text: &str) -> Result<Vec<Route>, Unread> {
    if text.trim_start().starts_with("QGC WPL") {
        return wpl(text);
    }
    let first = text.lines().map(uncommented).find(|line| !line.is_empty());
    if first.is_some_and(is_moos) {
        return moos(text);
    }
    csv(text)
}

/// Source: MAVLink, "File formats": index, current, frame, command, seven parameters, autocontinue.
fn wpl(text: &str) -> Result<Vec<Route>, Unread> {
    let mut items = Vec::new();
    for (k, line) in text
        .lines()
        .enumerate()
        .skip(1)
        .filter(|(_, line)| !line.trim().is_empty())
    {
        let place = format!("line {}", k + 1);
        // Parameters that the command does not have may be NaN.
        let parsed = |text: &str| {
            text.parse::<f64>()
                .map_err(|_| Unread::new(&*place, format!("{:?} is no number", shortened(text))))
        };
        let numbers = line.split_whitespace().map(parsed);
        let numbers = numbers.collect::<Result<Vec<_>, _>>()?;
        if numbers.len() != 12 {
            return Err(Unread::new(
                place,
                format!("has {} columns, not 12", numbers.len()),
            ));
        }
        items.push((place, numbers));
    }
    // ArduPilot's tools write the home position first, in absolute height and nothing else so.
    let is_home = match &items[..] {
        [(_, home), rest @ ..] => home[2] == 0.0 && rest.iter().any(|(_, item)| item[2] != 0.0),
        [] => false,
    };
    let (mut route, mut speed) = (Route::default(), None);
    for (place, item) in &items[usize::from(is_home)..] {
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "what is no command saturates, and is none"
        )]
        let command = item[3] as u64;
        let given = |column: usize| Some(item[column]).filter(|number| number.is_finite());
        let numbers = [4, 5, 8, 9, 10].map(given);
        json::take(&mut route, &mut speed, place, command, numbers)?;
    }
    Ok(vec![route])
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
fn moos(text: &str) -> Result<Vec<Route>, Unread> {
    let mut routes = Vec::new();
    let (mut single, mut bare) = (Route::default(), Route::default());
    for (k, line) in text.lines().map(uncommented).enumerate() {
        let place = format!("line {}", k + 1);
        if line.is_empty() || !is_moos(line) {
            continue;
        }
        let (key, rest) = match line.split_once('=') {
            Some((key, rest)) if !key.contains(['{', ',', ':']) => {
                (key.trim().to_ascii_lowercase(), rest.trim())
            }
            _ => (String::new(), line),
        };
        if POINTS_MAX < routes.iter().map(|route: &Route| route.points.len()).sum() {
            return Err(Unread::new(
                place,
                format!("more than {POINTS_MAX} points until here"),
            ));
        }
        if key == "format" || rest.contains("format=") || rest.contains("format =") {
            let whole = if key == "format" { line } else { rest };
            routes.push(pattern(&place, whole)?);
        } else if key == "point" {
            points(&mut single, &place, rest)?;
        } else if key.is_empty() && !rest.contains('{') {
            points(&mut bare, &place, rest)?;
        } else {
            let (list, after) = braced(if key == "pts" { line } else { rest });
            let label = members(after)
                .find(|(key, _)| key == "label")
                .map(|(_, value)| value);
            let mut route = Route::named(label.unwrap_or_default());
            points(&mut route, &place, list)?;
            routes.push(if key == "polygon" { route.ring() } else { route });
        }
    }
    routes.extend([single, bare]);
    Ok(routes)
}

/// What `pts={…}` holds and what stands after it; without braces, the whole.
fn braced(text: &str) -> (&str, &str) {
    match (text.find('{'), text.find('}')) {
        (Some(open), Some(close)) if open < close => (&text[open + 1..close], &text[close + 1..]),
        _ => (text, ""),
    }
}

fn points(route: &mut Route, place: &str, list: &str) -> Result<(), Unread> {
    for pair in list.split(':').map(str::trim).filter(|pair| !pair.is_empty()) {
        let mut numbers = pair.split(',');
        let (Some(x), Some(y)) = (numbers.next(), numbers.next()) else {
            return Err(Unread::new(place, format!("{:?} is no x,y", shortened(pair))));
        };
        route
            .points
            .push(RoutePoint::local(place, number(place, y)?, number(place, x)?)?);
    }
    Ok(())
}

fn members(text: &str) -> impl Iterator<Item = (String, &str)> {
    let pairs = text.split(',').filter_map(|pair| pair.split_once('='));
    pairs.map(|(key, value)| (key.trim().to_ascii_lowercase(), value.trim()))
}

/// `format=lawnmower`: lanes over a rectangle about a centre, turned clockwise by `degs`.
fn pattern(place: &str, text: &str) -> Result<Route, Unread> {
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
        route.points.push(RoutePoint::local(place, north, east)?);
    }
    Ok(route)
}

/// Columns by their names, in any order. A column `route` begins a new route where it changes.
fn csv(text: &str) -> Result<Vec<Route>, Unread> {
    let header = text.lines().next().unwrap_or_default();
    let delimiter = [b'\t', b';', b',']
        .into_iter()
        .find(|byte| header.as_bytes().contains(byte));
    let delimiter = delimiter.unwrap_or(b',');
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
    let mut routes: Vec<Route> = Vec::new();
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
        if routes.last().is_none_or(|route| route.name != named) {
            routes.push(Route::named(named));
        }
        if let Some(route) = routes.last_mut() {
            route.points.push(point);
        }
    }
    Ok(routes)
}
