//! `pilotfish route`: a route of a planning tool's file as it is followed; lanes over an area.

use std::error::Error;
use std::f64::consts::PI;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use clap::Args;
use geodesy::Datum;
use planner::nalgebra::{Rotation2, Vector2};
use planner::path::{LOOP_FROM, Path as TrackPath, REPEATED_WITHIN, Segment};
use planner::snapshot::Origin;
use route::{LawnMower, Route as FileRoute, lanes_over};
use serde_json::json;

use crate::cli::declared_routes::{CANNOT_SAIL, declared, first_on_earth, local, read};
use crate::cli::failure::because_of;
use crate::cli::out_file::{OutFile, print};

const LEGS_PRINTED: usize = 40;

/// Printed speed of a route without one, m/s.
const SPEED_ASSUMED: f64 = 1.0;

#[derive(Debug, Args)]
pub(crate) struct Route {
    /// A route file: GeoJSON, KML, KMZ, GPX, RTZ, QGroundControl .plan, QGC WPL, MOOS points, or
    /// CSV with named columns.
    #[arg(required_unless_present = "rectangle")]
    file: Option<PathBuf>,
    /// Name of the route in the file.
    #[arg(long, requires = "file")]
    name: Option<String>,
    /// Horizontal speed of the AUV through the water, m/s. Default: the file's.
    #[arg(long, value_name = "M/S")]
    speed: Option<f64>,
    /// Take the route for the corners of an area, and lay lanes over it this far apart, m.
    #[arg(long, value_name = "M")]
    lanes: Option<f64>,
    /// In place of a file: a rectangle from its first corner, AHEAD metres long and STARBOARD
    /// metres wide, as seen along the lanes.
    #[arg(
        long,
        value_name = "LAT,LON,AHEAD,STARBOARD",
        value_delimiter = ',',
        num_args = 1,
        allow_hyphen_values = true,
        requires = "lanes",
        conflicts_with = "file"
    )]
    rectangle: Option<Vec<f64>>,
    /// Heading of the first lane, degrees, clockwise from north.
    #[arg(
        long,
        value_name = "DEG",
        default_value_t = 0.0,
        requires = "lanes",
        allow_negative_numbers = true
    )]
    heading: f64,
    /// Write the route to this file: GeoJSON, or CSV where it has metres.
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Draw the route as it is sailed to this file.
    #[arg(long, value_name = "FILE.svg")]
    svg: Option<PathBuf>,
}

pub(crate) fn route(arguments: &Route) -> Result<(), Box<dyn Error>> {
    let open = |file: &Option<PathBuf>| file.as_deref().map(OutFile::new).transpose();
    let (out, svg) = (open(&arguments.out)?, open(&arguments.svg)?);
    let heading_rad = arguments.heading.to_radians();
    let (mut route, origin, mut points) = match (&arguments.file, &arguments.rectangle) {
        (Some(file), _) => of_file(file, arguments.name.as_deref())?,
        (None, Some(rectangle)) => of_rectangle(rectangle, heading_rad)?,
        (None, None) => unreachable!("clap requires one of the two"),
    };
    let datum = origin.map(|origin| Datum::new(&origin.into())).transpose()?;
    let stated = arguments.speed.or_else(|| route.speed_mps());
    if let Some(spacing_m) = arguments.lanes {
        let pattern = LawnMower { spacing_m, heading_rad };
        points = lanes_over(&points, &pattern)?;
        (route.closed, route.points) = (false, vec![]);
    }
    let path = declared(&route, points.clone(), stated.unwrap_or(SPEED_ASSUMED));
    let followed = path.path().map_err(because_of(CANNOT_SAIL))?;
    if let Some(file) = out {
        file.write_text(&file_of(&route, &points, datum.as_ref(), stated))?;
    }
    if let Some(file) = svg {
        file.write_text(&picture(&followed, &points))?;
    }
    let radius = route.turn_radius_m().unwrap_or(path.turn_radius());
    let mut text = legs(&points, route.closed, datum.as_ref());
    let (speed, length) = (path.speed_mps, followed.length());
    if !route.name.is_empty() {
        let _ = write!(text, "{}: ", route.name);
    }
    let closed = if route.closed { "closed" } else { "open" };
    let assumed = stated.map_or(" (assumed: the file states none)", |_| "");
    let (n_points, minutes) = (points.len(), length / speed / 60.0);
    let _ = writeln!(
        text,
        "{n_points} way-points, {length:.0} m as sailed, {closed}; {minutes:.1} min at {speed} m/s{assumed}; turns of {radius:.1} m"
    );
    let repairs = repairs(&followed, &points, radius);
    for note in repairs.into_iter().chain(route.left_out()) {
        let _ = writeln!(text, "note: {note}");
    }
    Ok(print(&text)?)
}

type LocalRoute = (FileRoute, Option<Origin>, Vec<[f64; 2]>);

/// A route, the datum of its metres, and its points (north, east), m.
fn of_file(file: &Path, name: Option<&str>) -> Result<LocalRoute, Box<dyn Error>> {
    let route = read(file, name)?;
    let origin = first_on_earth(&route);
    let datum = origin.map(|origin| Datum::new(&origin.into())).transpose()?;
    let points = local(&route, datum.as_ref())?;
    Ok((route, origin, points))
}

fn of_rectangle(rectangle: &[f64], heading: f64) -> Result<LocalRoute, &'static str> {
    let &[lat_deg, lon_deg, ahead, starboard] = rectangle else {
        return Err("--rectangle needs four numbers: latitude, longitude, length and width");
    };
    let corner = |ahead, starboard| (Rotation2::new(heading) * Vector2::new(ahead, starboard)).into();
    let ends = [(0.0, 0.0), (ahead, 0.0), (ahead, starboard), (0.0, starboard)];
    let corners = ends.map(|(ahead, starboard)| corner(ahead, starboard)).into();
    Ok((FileRoute::default(), Some(Origin { lat_deg, lon_deg }), corners))
}

/// A table of the legs: end, length and direction of each.
fn legs(points: &[[f64; 2]], closed: bool, datum: Option<&Datum>) -> String {
    let (first, second) = datum.map_or(("north, m", "east, m"), |_| ("latitude", "longitude"));
    let mut text = format!("   to{first:>13}{second:>13}    leg, m  course, °\n");
    let first = points.first().filter(|_| closed);
    let ends = points.iter().chain(first).enumerate();
    for (k, end) in ends.take(LEGS_PRINTED) {
        let place = datum.map(|datum| Origin::from(datum.from_local(&Vector2::from(*end))));
        let number = k % points.len();
        let _ = match place {
            Some(Origin { lat_deg, lon_deg }) => write!(text, "{number:>5}{lat_deg:>13.6}{lon_deg:>13.6}"),
            None => write!(text, "{number:>5}{:>13.1}{:>13.1}", end[0], end[1]),
        };
        if k > 0 {
            let leg = Vector2::from(*end) - Vector2::from(points[k - 1]);
            let course = leg.y.atan2(leg.x).to_degrees().rem_euclid(360.0);
            let _ = write!(text, "{:>10.1}{course:>11.0}", leg.norm());
        }
        text.push('\n');
    }
    let more = (points.len() + usize::from(closed)).saturating_sub(LEGS_PRINTED);
    if more > 0 {
        let _ = writeln!(text, "{:>5}", format!("… and {more} more"));
    }
    text
}

/// Differences of the path from straight legs, beyond corners of `radius`, m.
fn repairs(path: &TrackPath, points: &[[f64; 2]], radius: f64) -> Vec<String> {
    let apart =
        |pair: &&[[f64; 2]]| (Vector2::from(pair[1]) - Vector2::from(pair[0])).norm() < REPEATED_WITHIN;
    let repeated = points.windows(2).filter(apart).count();
    let arc = |piece| match piece {
        Segment::Arc { from, centre, angle_rad } => {
            let radius = (Vector2::from(from) - Vector2::from(centre)).norm();
            Some((radius, angle_rad.abs()))
        }
        Segment::Line { .. } | Segment::Waypoints { .. } => None,
    };
    let arcs: Vec<(f64, f64)> = path.lines_and_arcs().filter_map(arc).collect();
    let loops = arcs.iter().filter(|(_, angle)| LOOP_FROM < *angle).count();
    // Smaller differences are rounding.
    let radii = arcs.iter().map(|(tight, _)| *tight);
    let tight: Vec<f64> = radii.filter(|tight| *tight < radius * (1.0 - 1e-6)).collect();
    let tightest = tight.iter().copied().fold(f64::INFINITY, f64::min);
    let mut notes = vec![];
    if repeated > 0 {
        notes.push(format!("points that repeat the one before and are left out: {repeated}"));
    }
    if !tight.is_empty() {
        let n = tight.len();
        notes.push(format!(
            "arcs that are tighter because their legs are short: {n}, down to {tightest:.2} m"
        ));
    }
    if loops > 0 {
        let from = LOOP_FROM.to_degrees();
        notes.push(format!("corners beyond {from:.0}°, turned by a loop: {loops}"));
    }
    notes
}

/// The route as a file that [`route::read`] takes.
fn file_of(route: &FileRoute, points: &[[f64; 2]], datum: Option<&Datum>, speed: Option<f64>) -> String {
    let Some(datum) = datum else {
        let lines = points.iter().map(|[north, east]| format!("{north},{east}\n"));
        return format!("north_m,east_m\n{}", lines.collect::<String>());
    };
    let first = points.first().filter(|_| route.closed);
    let line = points.iter().chain(first).map(|point| {
        let place = Origin::from(datum.from_local(&Vector2::from(*point)));
        json!([place.lon_deg, place.lat_deg])
    });
    let line: Vec<_> = line.collect();
    let geometry = if route.closed {
        json!({ "type": "Polygon", "coordinates": [line] })
    } else {
        json!({ "type": "LineString", "coordinates": line })
    };
    let properties = json!({ "name": route.name, "speed_mps": speed });
    let feature = json!({ "type": "Feature", "properties": properties, "geometry": geometry });
    let collection = json!({ "type": "FeatureCollection", "features": [feature] });
    format!("{collection}\n")
}

/// A picture of the path and its way-points, north up.
fn picture(path: &TrackPath, points: &[[f64; 2]]) -> String {
    let (mut least, mut most) = (Vector2::from(points[0]), Vector2::from(points[0]));
    for point in points.iter().copied().map(Vector2::from) {
        (least, most) = (least.inf(&point), most.sup(&point));
    }
    let span = (most - least).max().max(1.0);
    // Loops and rounded corners stay inside the margin of most routes.
    let margin = 0.1 * span;
    let on_page = |point: Vector2<f64>| (point.y - least.y + margin, most.x - point.x + margin);
    let at = |point: Vector2<f64>| {
        let (x, y) = on_page(point);
        format!("{x:.2} {y:.2}")
    };
    let mut line = format!("M{}", at(path.at(0.0).position));
    for piece in path.lines_and_arcs() {
        let _ = match piece {
            Segment::Line { to, .. } => write!(line, "L{}", at(to.into())),
            Segment::Arc { from, centre, angle_rad } => {
                let (from, centre) = (Vector2::from(from), Vector2::from(centre));
                let radius = (from - centre).norm();
                let end = centre + Rotation2::new(angle_rad) * (from - centre);
                let (large, clockwise) = (u8::from(PI < angle_rad.abs()), u8::from(0.0 < angle_rad));
                write!(line, "A{radius:.2} {radius:.2} 0 {large} {clockwise} {}", at(end))
            }
            Segment::Waypoints { .. } => Ok(()),
        };
    }
    let dot = |(k, point): (usize, &[f64; 2])| {
        let (x, y) = on_page(Vector2::from(*point));
        let radius = span * if k == 0 { 0.012 } else { 0.006 };
        format!("<circle cx=\"{x:.2}\" cy=\"{y:.2}\" r=\"{radius:.2}\"/>")
    };
    let dots: String = points.iter().enumerate().map(dot).collect();
    let (width, height) = (most.y - least.y + 2.0 * margin, most.x - least.x + 2.0 * margin);
    let scale = 10.0_f64.powf((0.5 * span).log10().floor());
    let (foot, size) = (height - 0.3 * margin, 0.35 * margin);
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width:.2} {height:.2}\" width=\"640\">\n\
         <rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n\
         <path fill=\"none\" stroke=\"#0072b2\" stroke-width=\"{:.2}\" d=\"{line}\"/>\n<g>{dots}</g>\n\
         <path stroke=\"#000\" stroke-width=\"{:.2}\" d=\"M{size:.2} {foot:.2}h{scale}\"/>\n\
         <text x=\"{:.2}\" y=\"{foot:.2}\" font-size=\"{size:.2}\" font-family=\"sans-serif\">{scale} m, north up</text>\n</svg>\n",
        0.005 * span,
        0.003 * span,
        1.5 * size + scale,
    )
}
