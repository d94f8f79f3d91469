//! Way-point lists of MAVLink (QGC WPL), MOOS points, and CSV.

use std::{f64::consts::FRAC_PI_2, mem};

use crate::lawnmower::NoLanes;
use crate::mission::Mission;
use crate::progress::Progress;
use crate::route::{POINTS_MAX, Route, RoutePoint, Unread, number, refused, shortened};

pub(crate) fn routes(text: &str, mut progress: Progress<'_>) -> Result<Vec<Route>, Unread> {
    if text.trim_start().starts_with("QGC WPL") {
        return wpl(text, &mut progress);
    }
    let mut lines = text.lines().map(uncommented).filter(|line| !line.is_empty());
    if lines.next().is_some_and(|first| is_moos(first) || is_behavior(first)) || lines.any(is_behavior) {
        return moos(text, &mut progress);
    }
    csv(text, &mut progress)
}

const WPL_COLUMNS: usize = 12;

/// Source: MAVLink, "File formats": index, current, frame, command, seven parameters, autocontinue.
fn wpl(text: &str, progress: &mut Progress<'_>) -> Result<Vec<Route>, Unread> {
    let lines = || text.lines().enumerate().skip(1);
    let mut items = lines().filter(|(_, line)| !line.trim().is_empty());
    // ArduPilot's tools write the home position first: only this item has an absolute height.
    let home = items.next().map(wpl_item).transpose()?;
    let mut is_home = false;
    for item in items {
        let (place, item) = wpl_item(item)?;
        progress.look(&place)?;
        is_home |= item[2] != 0.0;
    }
    is_home &= home.is_some_and(|(_, home)| home[2] == 0.0);
    let mut mission = Mission::default();
    let items = lines().filter(|(_, line)| !line.trim().is_empty());
    for item in items.skip(usize::from(is_home)) {
        let (place, item) = wpl_item(item)?;
        #[expect(
            clippy::cast_possible_truncation,
            reason = "what is no number or no command saturates, and is none"
        )]
        let number_and_command = (item[0] as u64, item[3] as u64);
        let given = |column: usize| Some(item[column]).filter(|number| number.is_finite());
        let numbers = [4, 5, 8, 9, 10].map(given);
        mission.take((&place, progress), number_and_command, numbers)?;
    }
    let mut routes = Vec::new();
    progress.route(&mut routes, "file", mission.route)?;
    Ok(routes)
}

/// An item of a numbered line, and its place.
fn wpl_item((k, line): (usize, &str)) -> Result<(String, [f64; WPL_COLUMNS]), Unread> {
    let place = format!("line {}", k + 1);
    let n = line.split_whitespace().count();
    if n != WPL_COLUMNS {
        return refused(place, format!("has {n} columns, not {WPL_COLUMNS}"));
    }
    let mut item = [0.0; WPL_COLUMNS];
    for (number, text) in item.iter_mut().zip(line.split_whitespace()) {
        // Parameters that a command lacks may be NaN.
        let parsed = text.parse();
        *number = parsed.map_err(|_| Unread::new(&*place, format!("{:?} is no number", shortened(text))))?;
    }
    Ok((place, item))
}

fn uncommented(line: &str) -> &str {
    line.split("//").next().unwrap_or_default().trim()
}

/// Key and value of a line `key = value`.
fn key_of(line: &str) -> (String, &str) {
    match line.split_once('=') {
        Some((key, value)) => (key.trim().to_ascii_lowercase(), value.trim()),
        None => (String::new(), line),
    }
}

fn is_behavior(line: &str) -> bool {
    line.get(..8).is_some_and(|word| word.eq_ignore_ascii_case("behavior")) && key_of(line).0 == "behavior"
}

fn is_moos(line: &str) -> bool {
    let (key, _) = key_of(line);
    let known = ["points", "pts", "polygon", "format", "point", "seglist"];
    known.contains(&key.as_str())
        || line.contains("pts={")
        || (!line.contains('=') && line.contains(':') && line.split(':').all(|pair| pair.contains(',')))
}

/// The points of a block of a behaviour file, and their common settings.
#[derive(Default)]
struct Behaviour {
    name: String,
    speed_mps: Option<f64>,
    /// Number of repetitions; infinite without end.
    repeat: f64,
    reversed: bool,
    /// Points in lines of their own.
    single: Route,
    bare: Route,
    /// Number of routes before the block.
    n_before: usize,
}

/// Points of MOOS-IvP: x is east, y is north.
fn moos(text: &str, progress: &mut Progress<'_>) -> Result<Vec<Route>, Unread> {
    let (mut routes, mut behaviour) = (Vec::new(), Behaviour::default());
    for (k, line) in text.lines().map(uncommented).enumerate() {
        let place = format!("line {}", k + 1);
        progress.look(&place)?;
        let (key, value) = key_of(line);
        match key.as_str() {
            "" if line == "}" => behaviour = behaviour.end(progress, &place, &mut routes)?,
            "name" => value.clone_into(&mut behaviour.name),
            "speed" => behaviour.speed_mps = Some(number(&place, value)?).filter(|speed| 0.0 < *speed),
            "repeat" if value == "forever" => behaviour.repeat = f64::INFINITY,
            "repeat" => behaviour.repeat = number(&place, value)?,
            "order" => behaviour.reversed = value.starts_with("rev"),
            _ if !is_moos(line) => {}
            _ if member(line, "format").is_some() => {
                let route = pattern(progress, &place, line)?;
                progress.route(&mut routes, &place, route)?;
            }
            "point" => points(progress, &mut behaviour.single, &place, value)?,
            "" => points(progress, &mut behaviour.bare, &place, value)?,
            _ => {
                let (list, before, after) = match (line.find('{'), line.find('}')) {
                    (Some(open), Some(close)) if open < close => {
                        (&line[open + 1..close], &line[..open], &line[close + 1..])
                    }
                    _ => (value, "", ""),
                };
                let label = member(after, "label").or(member(before, "label"));
                let mut route = Route::named(label.unwrap_or_default());
                points(progress, &mut route, &place, list)?;
                let route = if key == "polygon" { route.ring() } else { route };
                progress.route(&mut routes, &place, route)?;
            }
        }
    }
    behaviour.end(progress, "file", &mut routes)?;
    Ok(routes)
}

impl Behaviour {
    /// Ends the block, whose points are in `routes`.
    fn end(self, progress: &mut Progress<'_>, place: &str, routes: &mut Vec<Route>) -> Result<Self, Unread> {
        for route in [self.single, self.bare] {
            progress.route(routes, place, route)?;
        }
        for route in &mut routes[self.n_before..] {
            if route.name.is_empty() {
                route.name.clone_from(&self.name);
            }
            if self.reversed {
                route.points.reverse();
            }
            let n_points = route.points.len();
            for point in &mut route.points {
                point.speed_mps = self.speed_mps;
            }
            route.closed |= self.repeat == f64::INFINITY;
            let mut sailed = 0.0;
            while !route.closed && sailed < self.repeat {
                for k in 0..n_points {
                    let point = route.points[k];
                    progress.point(route, place, point)?;
                }
                sailed += 1.0;
            }
        }
        Ok(Self { n_before: routes.len(), ..Self::default() })
    }
}

/// Words of older lists about their drawing.
const DRAWN: [&str; 6] = ["source", "active", "msg", "type", "id", "time"];

/// Adds the points of a list such as `label,lanes : 10,15 : 20,25`.
fn points(progress: &mut Progress<'_>, route: &mut Route, place: &str, list: &str) -> Result<(), Unread> {
    for pair in list.split(':').map(str::trim).filter(|pair| !pair.is_empty()) {
        let mut parts = pair.split(',').map(str::trim);
        let (Some(x), Some(y)) = (parts.next(), parts.next()) else {
            return refused(place, format!("{:?} is no x,y of MOOS", shortened(pair)));
        };
        if x == "label" {
            y.clone_into(&mut route.name);
        } else if !DRAWN.contains(&x) && !x.ends_with("_color") && !x.ends_with("_size") {
            let point = RoutePoint::local(place, number(place, y)?, number(place, x)?)?;
            progress.point(route, place, point)?;
        }
    }
    Ok(())
}

/// The value in `key=value`, also after the key of its line.
fn member<'t>(text: &'t str, wanted: &str) -> Option<&'t str> {
    let mut pairs = text.split(',').filter_map(|pair| pair.rsplit_once('='));
    let is_it = |key: &str| key.rsplit('=').next().is_some_and(|key| key.trim().eq_ignore_ascii_case(wanted));
    pairs.find(|(key, _)| is_it(key)).map(|(_, value)| value.trim())
}

/// Part of a lane that gets no lane: it is within rounding.
const LANE_ROUNDING: f64 = 1e-5;

/// `format=lawnmower`: lanes over a turned rectangle, from the corner nearest to the start.
fn pattern(progress: &mut Progress<'_>, place: &str, text: &str) -> Result<Route, Unread> {
    let format = member(text, "format").unwrap_or_default();
    if format != "lawnmower" {
        return refused(place, format!("format={} is not read; write its points out", shortened(format)));
    }
    let given = |wanted: &str| member(text, wanted).map(|text| number(place, text)).transpose();
    let needed = |wanted: &str| {
        let missing = || Unread::new(place, format!("lawnmower needs {wanted}"));
        given(wanted)?.ok_or_else(missing)
    };
    let (x, y, width, height) = (needed("x")?, needed("y")?, needed("width")?, needed("height")?);
    let spacing = given("swath")?.map_or_else(|| needed("lane_width"), Ok)?;
    let [turned, start_x, start_y] =
        ["degs", "startx", "starty"].map(|wanted| Ok(given(wanted)?.unwrap_or(0.0)));
    let (turned, start) = (turned?.to_radians(), [start_y?, start_x?]);
    let along_north = member(text, "rows").is_some_and(|rows| matches!(rows, "ns" | "north-south"));
    let (across, along, heading) =
        if along_north { (width, height, turned) } else { (height, width, turned + FRAC_PI_2) };
    // The last lane lies on the far edge or beyond it.
    let n_lanes = (across / spacing - LANE_ROUNDING).ceil() + 1.0;
    let n_lanes_max = POINTS_MAX as f64 / 2.0;
    if !(0.0 < spacing && 1.0 <= n_lanes && n_lanes <= n_lanes_max) {
        return refused(place, NoLanes::Spacing(spacing).to_string());
    }
    let (sin, cos) = heading.sin_cos();
    // A corner: half a length ahead of the middle or behind it, this far to port.
    let corner = |port: f64, ahead: f64| [y + ahead * cos + port * sin, x + ahead * sin - port * cos];
    let far = 0.5 * across - (n_lanes - 1.0) * spacing;
    let entries = [(0.5 * across, 0.5), (0.5 * across, -0.5), (far, 0.5), (far, -0.5)];
    let away = |(port, end): &(f64, f64)| {
        let [north, east] = corner(*port, end * along);
        (north - start[0]).hypot(east - start[1])
    };
    let entries = entries.into_iter();
    let nearest = entries.min_by(|one, other| away(one).total_cmp(&away(other)));
    let (first, mut end) = nearest.expect("there are four");
    let step = if first == far { spacing } else { -spacing };
    let mut route = Route::named(member(text, "label").unwrap_or_default());
    let mut lane = 0.0;
    while lane < n_lanes {
        for end in [end, -end] {
            let [north, east] = corner(first + lane * step, end * along);
            progress.point(&mut route, place, RoutePoint::local(place, north, east)?)?;
        }
        (lane, end) = (lane + 1.0, -end);
    }
    Ok(route)
}

/// Columns by name, in any order. A change in the column `route` begins a new route. So does one in
/// a column of names, unless each name has one point and so belongs to it.
fn csv(text: &str, progress: &mut Progress<'_>) -> Result<Vec<Route>, Unread> {
    let header = text.lines().next().unwrap_or_default();
    let is_in_header = |byte: &u8| header.as_bytes().contains(byte);
    let delimiter = *b"\t;".iter().find(|byte| is_in_header(byte)).unwrap_or(&b',');
    progress.columns(text, delimiter)?;
    let mut reader =
        ::csv::ReaderBuilder::new().delimiter(delimiter).trim(::csv::Trim::All).from_reader(text.as_bytes());
    let broken = |error: ::csv::Error| {
        let line = error.position().map_or(1, ::csv::Position::line);
        Unread::new(format!("line {line}"), error.to_string())
    };
    let names = reader.headers().map_err(broken)?.iter();
    let names: Vec<String> = names.map(str::to_lowercase).collect();
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
            return refused("line 1", fault);
        }
    };
    let depth = column(&["depth", "depth_m"]);
    let speed = column(&["speed", "speed_mps"]);
    let named_route = column(&["route"]);
    let name = named_route.or(column(&["name"]));
    let (mut routes, mut route) = (Vec::new(), Route::default());
    for record in reader.records() {
        let record = record.map_err(broken)?;
        let place = format!("line {}", record.position().map_or(0, ::csv::Position::line));
        let read = |column: usize| {
            let text = record.get(column).unwrap_or_default();
            // If semicolons separate columns, decimals have commas.
            let decimal = if delimiter == b';' { "," } else { "." };
            number(&place, &text.replace(decimal, "."))
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
    if named_route.is_none() && 1 < routes.len() && routes.iter().all(|route| route.points.len() == 1) {
        let mut joined = Route::named("");
        joined.points = routes.into_iter().flat_map(|route| route.points).collect();
        return Ok(vec![joined]);
    }
    Ok(routes)
}
