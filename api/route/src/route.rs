//! A route, and the fault of a file that has none.

use serde::Serialize;

/// Most points of all routes of a file.
pub const POINTS_MAX: usize = 200_000;

/// Most names in an error or a note.
pub(crate) const NAMES_TOLD: usize = 20;

pub(crate) const HOLES: &str = "holes of the area, which are left out";

/// A route of a file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Route {
    /// Its name in the file, or empty.
    pub name: String,
    /// Its way-points, in order.
    pub points: Vec<RoutePoint>,
    /// `true` if the last point leads back to the first.
    pub closed: bool,
    /// Statements of the file that the route does not have.
    pub notes: Vec<String>,
}

/// A way-point, with the file's statements about it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RoutePoint {
    /// Its place.
    pub place: Place,
    /// Depth, m, positive down; none for heights above the sea.
    pub depth_m: Option<f64>,
    /// Speed on the leg that leads to it, m/s.
    pub speed_mps: Option<f64>,
    /// Radius of the turn at it, m.
    pub turn_radius_m: Option<f64>,
}

/// Place of a way-point.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Place {
    /// On Earth, WGS 84.
    Earth {
        /// Latitude, degrees, positive north.
        lat_deg: f64,
        /// Longitude, degrees, positive east.
        lon_deg: f64,
    },
    /// North and east of a datum that the file does not name, m.
    Local([f64; 2]),
}

/// The fault of a file that is no route.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{place}: {fault}")]
pub struct Unread {
    /// Its place in the file: a line, an element, an item.
    pub place: String,
    /// The fault at that place, with advice.
    pub fault: String,
}

impl Unread {
    pub(crate) fn new(place: impl Into<String>, fault: impl Into<String>) -> Self {
        /// Messages of parsers may repeat the file.
        const CHARS: usize = 300;
        let (place, fault) = (place.into(), fault.into().chars().take(CHARS).collect());
        Self { place, fault }
    }
}

/// Refuses a file for the fault at a place.
pub(crate) fn refused<T>(place: impl Into<String>, fault: impl Into<String>) -> Result<T, Unread> {
    Err(Unread::new(place, fault))
}

impl Route {
    /// The first speed of its points, m/s.
    pub fn speed_mps(&self) -> Option<f64> {
        self.points.iter().find_map(|point| point.speed_mps)
    }

    /// The first turn radius of its points, m.
    pub fn turn_radius_m(&self) -> Option<f64> {
        self.points.iter().find_map(|point| point.turn_radius_m)
    }

    /// The end points of its legs, if legs differ in speed or depth; else none.
    pub fn ends_of_legs(&self) -> Vec<&RoutePoint> {
        let first = self.points.first().filter(|_| self.closed);
        let ends: Vec<_> = self.points.iter().skip(1).chain(first).collect();
        let are_unlike = |pair: &[&RoutePoint]| {
            [pair[0].speed_mps, pair[0].depth_m] != [pair[1].speed_mps, pair[1].depth_m]
        };
        if ends.windows(2).any(are_unlike) { ends } else { Vec::new() }
    }

    /// Statements of the file that a path with one turn radius lacks.
    pub fn left_out(&self) -> Vec<String> {
        let stated = || self.points.iter().filter_map(|point| point.turn_radius_m);
        let least = stated().fold(f64::INFINITY, f64::min);
        let most = stated().fold(least, f64::max);
        let first = stated().next().filter(|_| least < most);
        let note = |first| format!("turn radii are from {least} to {most} m; the first is taken, {first} m");
        self.notes.iter().cloned().chain(first.map(note)).collect()
    }

    pub(crate) fn note(&mut self, note: &str) {
        if !self.notes.iter().any(|known| known == note) {
            self.notes.push(note.to_owned());
        }
    }

    pub(crate) fn named(name: impl Into<String>) -> Self {
        Self { name: name.into(), ..Self::default() }
    }

    /// Closes the route, without a last point that repeats the first.
    pub(crate) fn ring(mut self) -> Self {
        self.closed = true;
        if self.points.len() > 1 && self.points.first() == self.points.last() {
            self.points.pop();
        }
        self
    }
}

impl RoutePoint {
    /// A point on Earth. `height` is in m, positive up.
    pub(crate) fn on_earth(
        place: &str,
        lat_deg: f64,
        lon_deg: f64,
        height: Option<f64>,
    ) -> Result<Self, Unread> {
        if !(-90.0..=90.0).contains(&lat_deg) || !(-360.0..=360.0).contains(&lon_deg) {
            let [lat, lon] = [lat_deg, lon_deg].map(|degrees| shortened(&degrees.to_string()));
            let fault = format!(
                "latitude {lat}, longitude {lon} is not on Earth; check their order and that they are degrees"
            );
            return refused(place, fault);
        }
        let below = height.filter(|height| *height < 0.0 && height.is_finite());
        Ok(Self { depth_m: below.map(|height| -height), ..Self::at(Place::Earth { lat_deg, lon_deg }) })
    }

    pub(crate) fn local(place: &str, north_m: f64, east_m: f64) -> Result<Self, Unread> {
        if north_m.is_finite() && east_m.is_finite() {
            return Ok(Self::at(Place::Local([north_m, east_m])));
        }
        let fault = format!("north {north_m}, east {east_m} is no position");
        refused(place, fault)
    }

    fn at(place: Place) -> Self {
        Self { place, depth_m: None, speed_mps: None, turn_radius_m: None }
    }
}

/// The route called `name`, or the only one. The error lists the names.
pub fn select(mut routes: Vec<Route>, name: Option<&str>) -> Result<Route, Unread> {
    let found = match name {
        Some(name) => routes.iter().position(|route| route.name == name),
        None => (routes.len() == 1).then_some(0),
    };
    if let Some(k) = found {
        return Ok(routes.swap_remove(k));
    }
    let names = routes.iter().map(|route| format!("{:?}", route.name));
    let listed = names.take(NAMES_TOLD).collect::<Vec<_>>();
    let n = routes.len();
    let more = match n.saturating_sub(NAMES_TOLD) {
        0 => String::new(),
        more => format!(" and {more} more"),
    };
    let listed = listed.join(", ") + &more;
    Err(match name {
        Some(name) => {
            let fault = format!("is not in the file, which has {listed}");
            Unread::new(format!("route {name:?}"), fault)
        }
        None => Unread::new("file", format!("has {n} routes, choose one by name: {listed}")),
    })
}

/// Number of line ends in `text`.
pub(crate) fn lines_in(text: &str) -> usize {
    text.bytes().filter(|byte| *byte == b'\n').count()
}

pub(crate) fn number(place: &str, text: &str) -> Result<f64, Unread> {
    let text = text.trim();
    let number = text.parse().ok().filter(|number: &f64| number.is_finite());
    number.ok_or_else(|| Unread::new(place, format!("{:?} is no number", shortened(text))))
}

/// The beginning of a text, for an error.
pub(crate) fn shortened(text: &str) -> String {
    const CHARS: usize = 40;
    text.chars().take(CHARS).collect()
}
