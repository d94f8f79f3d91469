//! KML, GPX and RTZ: elements by local name, at any depth. No entity makes a text grow.

use std::borrow::Cow;
use std::io::{Cursor, Read as _};

use quick_xml::Reader;
use quick_xml::events::{BytesStart, Event};

use crate::progress::{BYTES_MAX, Progress};
use crate::route::{HOLES, Route, RoutePoint, Unread, lines_in, number, refused, shortened};

const DEPTH_MAX: usize = 64;

/// Longest tag, with its attributes, bytes.
const TAG_BYTES_MAX: usize = 64 << 10;

/// Source: RTZ 1.0 (IEC 61174, annex S): radii in nautical miles, speeds in knots.
const NAUTICAL_MILE_M: f64 = 1852.0;
const KNOT_MPS: f64 = NAUTICAL_MILE_M / 3600.0;

/// Elements that are one route each.
const ROUTES: [&str; 4] = ["rte", "trk", "Placemark", "route"];

/// The KML file in a KMZ file.
pub(crate) fn unpacked(bytes: &[u8], progress: &Progress<'_>) -> Result<Vec<u8>, Unread> {
    let broken = |error: &dyn std::fmt::Display| Unread::new("ZIP archive", error.to_string());
    let mut archive = zip::ZipArchive::new(Cursor::new(bytes)).map_err(|error| broken(&error))?;
    let names = archive.file_names().filter_map(Result::ok);
    let is_kml = |name: &Cow<'_, str>| name.to_ascii_lowercase().ends_with(".kml");
    let mut names: Vec<String> = names.filter(is_kml).map(Cow::into_owned).collect();
    let main = names.iter().position(|name| name == "doc.kml").unwrap_or(0);
    if names.is_empty() {
        return refused("ZIP archive", "has no .kml file");
    }
    let name = names.swap_remove(main);
    let file = archive.by_name(&name).map_err(|error| broken(&error))?;
    let mut unpacked = Vec::new();
    // The archive's statement of its size is unverified.
    let limit = u64::try_from(BYTES_MAX).expect("8 MiB fit") + 1;
    progress.watched(file).take(limit).read_to_end(&mut unpacked).map_err(|error| broken(&error))?;
    if BYTES_MAX < unpacked.len() {
        return refused(name, format!("is larger than {BYTES_MAX} bytes when unpacked"));
    }
    Ok(unpacked)
}

pub(crate) fn routes(text: &str, progress: Progress<'_>) -> Result<Vec<Route>, Unread> {
    let mut reader = Reader::from_str(text);
    let mut found = Found {
        progress,
        line: 1,
        open: Vec::new(),
        text: String::new(),
        text_line: 0,
        route: None,
        routes: Vec::new(),
        loose: Route::default(),
        turn_radius_m: None,
        default_radius_m: None,
    };
    let mut before = 0;
    loop {
        found.progress.look("file")?;
        let event =
            reader.read_event().map_err(|error| Unread::new(found.place(), format!("is no XML: {error}")))?;
        match event {
            Event::Start(element) => {
                found.begin(&element)?;
                if DEPTH_MAX < found.open.len() {
                    return refused(found.place(), format!("more than {DEPTH_MAX} elements in each other"));
                }
            }
            Event::Empty(element) => {
                found.begin(&element)?;
                found.end()?;
            }
            Event::End(_) => found.end()?,
            Event::Text(text) => found.take(&String::from_utf8_lossy(&text)),
            Event::CData(text) => found.take(&String::from_utf8_lossy(&text)),
            Event::GeneralRef(entity) => {
                if let Ok(Some(char)) = entity.resolve_char_ref() {
                    found.take(char.encode_utf8(&mut [0; 4]));
                } else if &*entity == b"amp" {
                    found.take("&");
                }
            }
            Event::Eof if found.open.is_empty() => return found.routes(),
            Event::Eof => {
                let open = found.open.last().map_or("", String::as_str);
                let fault = format!("the file ends inside <{}>; is it whole?", shortened(open));
                return refused(found.place(), fault);
            }
            Event::Comment(_) | Event::Decl(_) | Event::PI(_) | Event::DocType(_) => {}
        }
        let after = usize::try_from(reader.buffer_position()).unwrap_or(text.len());
        found.line += lines_in(text.get(before..after).unwrap_or_default());
        before = after;
    }
}

struct Found<'a> {
    progress: Progress<'a>,
    line: usize,
    /// Local names of the open elements.
    open: Vec<String>,
    /// Text of the innermost element so far.
    text: String,
    /// Line at which the text begins.
    text_line: usize,
    route: Option<Route>,
    routes: Vec<Route>,
    /// Way-points outside all routes: a route if there is no other.
    loose: Route,
    /// Turn radius of the RTZ way-point, m, and of way-points without one.
    turn_radius_m: Option<f64>,
    default_radius_m: Option<f64>,
}

impl Found<'_> {
    fn place(&self) -> String {
        format!("line {}", self.line)
    }

    fn take(&mut self, text: &str) {
        if self.text.is_empty() {
            self.text_line = self.line;
        }
        self.text.push_str(text);
    }

    fn begin(&mut self, element: &BytesStart<'_>) -> Result<(), Unread> {
        let place = self.place();
        if TAG_BYTES_MAX < element.len() {
            let n = element.len();
            return refused(place, format!("has a tag of {n} bytes, at most {TAG_BYTES_MAX} are read"));
        }
        let name = String::from_utf8_lossy(element.local_name().as_ref()).into_owned();
        let text = |wanted: &str| {
            // A check for repeated names would take the square of their number.
            let mut attributes = element.attributes();
            let mut given = attributes.with_checks(false).filter_map(Result::ok);
            let found = given.find(|found| found.key.as_ref() == wanted.as_bytes());
            found.map(|found| String::from_utf8_lossy(&found.value).into_owned())
        };
        let value = |wanted: &str| text(wanted).map(|text| number(&place, &text)).transpose();
        let scaled = |wanted: &str, unit: f64| match value(wanted)?.map(|given| given * unit) {
            Some(given) if given.is_infinite() => refused(&*place, format!("{wanted} is too large")),
            given => Ok(given.filter(|given| 0.0 < *given)),
        };
        self.text.clear();
        match name.as_str() {
            _ if ROUTES.contains(&name.as_str()) => {
                self.close()?;
                self.route = Some(Route::default());
            }
            "routeInfo" => {
                if let Some(route) = &mut self.route {
                    route.name = text("routeName").unwrap_or_default();
                }
            }
            "defaultWaypoint" => self.default_radius_m = scaled("radius", NAUTICAL_MILE_M)?,
            "waypoint" => {
                self.turn_radius_m = scaled("radius", NAUTICAL_MILE_M)?.or(self.default_radius_m);
            }
            "rtept" | "trkpt" | "wpt" | "position" => {
                let missing = || Unread::new(&*place, format!("<{name}> needs lat and lon"));
                let lat = value("lat")?.ok_or_else(missing)?;
                let lon = value("lon")?.ok_or_else(missing)?;
                let mut point = RoutePoint::on_earth(&place, lat, lon, None)?;
                if name == "position" {
                    point.turn_radius_m = self.turn_radius_m;
                }
                self.push(name == "wpt", &place, point)?;
            }
            "leg" => {
                let speed_mps = scaled("speedMax", KNOT_MPS)?;
                if let (Some(_), Some(point)) = (speed_mps, self.last_point()) {
                    point.speed_mps = speed_mps;
                }
            }
            _ => {}
        }
        self.open.push(name);
        Ok(())
    }

    fn end(&mut self) -> Result<(), Unread> {
        let Some(name) = self.open.pop() else { return Ok(()) };
        let text = std::mem::take(&mut self.text);
        let parent = self.open.last().map_or("", String::as_str);
        match name.as_str() {
            "name" if ROUTES.contains(&parent) => {
                if let Some(route) = &mut self.route {
                    text.trim().clone_into(&mut route.name);
                }
            }
            "ele" if matches!(parent, "rtept" | "trkpt") => {
                let height = number(&self.place(), &text)?;
                if let (true, Some(point)) = (height < 0.0, self.last_point()) {
                    point.depth_m = Some(-height);
                }
            }
            "innerBoundaryIs" => {
                if let Some(route) = &mut self.route {
                    route.note(HOLES);
                }
            }
            "coordinates" if !self.open.iter().any(|open| open == "innerBoundaryIs") => {
                let (ring, loose) = (parent == "LinearRing", parent == "Point");
                for (k, line) in text.lines().enumerate() {
                    let place = format!("line {}", self.text_line + k);
                    // Some files have blanks beside the commas of a tuple.
                    let mut tuple = String::new();
                    for word in line.split_whitespace().chain([""]) {
                        self.progress.look(&place)?;
                        let goes_on = tuple.ends_with(',') && !word.is_empty() || word.starts_with(',');
                        if !tuple.is_empty() && !goes_on {
                            let point = position(&place, &tuple, tuple.split(','))?;
                            self.push(loose, &place, point)?;
                            tuple.clear();
                        }
                        tuple.push_str(word);
                    }
                }
                if ring {
                    self.route = self.route.take().map(Route::ring);
                }
            }
            "coord" => {
                let place = self.place();
                let point = position(&place, &text, text.split_whitespace())?;
                self.push(false, &place, point)?;
            }
            _ if ROUTES.contains(&name.as_str()) => self.close()?,
            _ => {}
        }
        Ok(())
    }

    /// Ends the open route.
    fn close(&mut self) -> Result<(), Unread> {
        let (place, route) = (self.place(), self.route.take());
        self.progress.route(&mut self.routes, &place, route.unwrap_or_default())
    }

    fn push(&mut self, loose: bool, place: &str, point: RoutePoint) -> Result<(), Unread> {
        let route = match &mut self.route {
            Some(route) if !loose => route,
            _ => &mut self.loose,
        };
        self.progress.point(route, place, point)
    }

    fn last_point(&mut self) -> Option<&mut RoutePoint> {
        self.route.as_mut()?.points.last_mut()
    }

    fn routes(mut self) -> Result<Vec<Route>, Unread> {
        if self.routes.is_empty() {
            self.progress.route(&mut self.routes, "file", self.loose)?;
        }
        Ok(self.routes)
    }
}

/// Longitude, latitude and optional height of KML.
fn position<'t>(
    place: &str,
    text: &str,
    mut numbers: impl Iterator<Item = &'t str>,
) -> Result<RoutePoint, Unread> {
    let given = [(); 4].map(|()| numbers.next());
    let [Some(lon), Some(lat), height, None] = given else {
        return refused(place, format!("{:?} is no longitude,latitude[,height]", shortened(text.trim())));
    };
    let height = height.map(|height| number(place, height)).transpose()?;
    RoutePoint::on_earth(place, number(place, lat)?, number(place, lon)?, height)
}
