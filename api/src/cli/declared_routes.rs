//! `--route`: the routes that AUVs follow, from the files of planning tools.

use std::error::Error;
use std::fs;
use std::path::{Path, PathBuf};

use clap::Args;
use geodesy::Datum;
use planner::path::Segment;
use planner::snapshot::{DeclaredPath, Origin};
use route::{Place, Route};
use serde_json::{Value, json};
use service::route_files::{PathOfFile, legs};
use sim::scenario::{Kind, OriginFile, PathFile, Point, Quantity, Scenario, SegmentFile};

use super::failure::{Failure, because_of};

/// Routes that the AUVs follow.
#[derive(Debug, Args)]
pub(crate) struct DeclaredRoutes {
    /// The route that an AUV follows, from the file of a planning tool (docs/routes.md). FILE#NAME
    /// chooses one of several routes. May be repeated.
    #[arg(long, value_name = "AUV=FILE", value_parser = auv_and_file)]
    route: Vec<(String, RouteFile)>,
    /// Horizontal speed of these AUVs through the water, m/s. Default: the file's.
    #[arg(long, value_name = "M/S", requires = "route")]
    route_speed: Option<f64>,
}

#[derive(Clone, Debug)]
struct RouteFile {
    path: PathBuf,
    name: Option<String>,
}

/// The failure of a path with turns that no vehicle makes.
pub(crate) const CANNOT_SAIL: &str = "no vehicle can sail the route";

fn auv_and_file(text: &str) -> Result<(String, RouteFile), String> {
    let Some((auv, file)) = text.split_once('=').filter(|(auv, file)| !auv.is_empty() && !file.is_empty())
    else {
        return Err("must be AUV=FILE".to_owned());
    };
    let (path, name) = match file.rsplit_once('#') {
        Some((path, name)) if !Path::new(file).exists() => (path, Some(name.to_owned())),
        _ => (file, None),
    };
    let path = path.into();
    Ok((auv.to_owned(), RouteFile { path, name }))
}

/// The route called `name` in a file, or its only route.
pub(crate) fn read(file: &Path, name: Option<&str>) -> Result<Route, Failure> {
    let bytes = fs::read(file).map_err(because_of(format!("cannot read {}", file.display())))?;
    let route = route::read(&bytes).and_then(|routes| route::select(routes, name));
    route.map_err(because_of(file.display().to_string()))
}

/// Its first point on Earth.
pub(crate) fn first_on_earth(route: &Route) -> Option<Origin> {
    match route.points.first()?.place {
        Place::Earth { lat_deg, lon_deg } => Some(Origin { lat_deg, lon_deg }),
        Place::Local(_) => None,
    }
}

/// Its points (north, east), m; those on Earth from `datum`.
pub(crate) fn local(route: &Route, datum: Option<&Datum>) -> Result<Vec<[f64; 2]>, Box<dyn Error>> {
    let metres = |place: Place| match (place, datum) {
        (Place::Earth { lat_deg, lon_deg }, Some(datum)) => {
            Ok(datum.to_local(&Origin { lat_deg, lon_deg }.into())?.into())
        }
        (Place::Local(point), None) => Ok(point),
        (Place::Earth { .. }, None) | (Place::Local(_), Some(_)) => {
            Err("a route has either latitudes and longitudes or metres, not both".into())
        }
    };
    route.points.iter().map(|point| metres(point.place)).collect()
}

/// The path through these `points` (north, east), m, which are those of `route`.
pub(crate) fn declared(route: &Route, points: Vec<[f64; 2]>, speed_mps: f64) -> DeclaredPath {
    let turn_radius_m = route.turn_radius_m();
    DeclaredPath {
        segments: vec![Segment::Waypoints { points, fillet_m: None, turn_radius_m, legs: legs(route) }],
        closed: route.closed,
        speed_mps,
    }
}

impl DeclaredRoutes {
    pub(crate) fn is_empty(&self) -> bool {
        self.route.is_empty()
    }

    /// Each AUV's route, and its speed on it, m/s.
    fn read(&self) -> impl Iterator<Item = Result<(&str, Route, Result<f64, String>), Failure>> {
        self.route.iter().map(|(auv, file)| {
            let mut route = read(&file.path, file.name.as_deref())?;
            for point in route.points.iter_mut().filter(|_| self.route_speed.is_some()) {
                point.speed_mps = self.route_speed;
            }
            let none = || format!("{} states no speed: add --route-speed", file.path.display());
            let speed = route.speed_mps().ok_or_else(none);
            Ok((auv.as_str(), route, speed))
        })
    }

    /// The first point of the first route, if on Earth: an origin for a mission without another.
    pub(crate) fn origin(&self) -> Result<Option<Origin>, Failure> {
        let first = self.read().next().transpose()?;
        Ok(first.and_then(|(_, route, _)| first_on_earth(&route)))
    }

    /// Gives the AUVs of `body`, a snapshot or the live part of a mission, their paths.
    pub(crate) fn put_into(&self, body: &mut Value) -> Result<(), Box<dyn Error>> {
        for read in self.read() {
            let (id, route, speed) = read?;
            let auvs = body.get_mut("auvs").and_then(Value::as_array_mut);
            let mut auvs = auvs.into_iter().flatten().filter_map(Value::as_object_mut);
            let auv = auvs.find(|auv| auv.get("id").is_some_and(|name| name == id));
            let auv = auv.ok_or_else(|| no_auv(id))?;
            speed?;
            auv.insert("path".to_owned(), json!(PathOfFile::from(&route)));
        }
        Ok(())
    }

    /// Lets the AUVs of `scenario` follow their routes. The first point on Earth can be the origin.
    pub(crate) fn follow(&self, scenario: &mut Scenario, seed: u64) -> Result<(), Box<dyn Error>> {
        for read in self.read() {
            let (id, route, speed) = read?;
            let mut origin = scenario.start(seed)?.origin;
            if let (None, Some(first)) = (origin, first_on_earth(&route)) {
                origin = Some(first.into());
                let lat_deg = fixed("a latitude", first.lat_deg)?;
                let lon_deg = fixed("a longitude", first.lon_deg)?;
                scenario.origin = Some(OriginFile { lat_deg, lon_deg });
            }
            let datum = origin.filter(|_| first_on_earth(&route).is_some());
            let datum = datum.map(|origin| Datum::new(&origin)).transpose()?;
            let points = local(&route, datum.as_ref())?;
            let auv = scenario.auvs.iter_mut().find(|auv| auv.id == id).ok_or_else(|| no_auv(id))?;
            if let Ok(speed) = speed {
                auv.speed_mps = Some(fixed("a speed", speed)?);
                auv.speed_profile = None;
            }
            let path = declared(&route, points, speed.unwrap_or(auv.class.speed())).path();
            let path = path.map_err(because_of(CANNOT_SAIL))?;
            let segments = path.lines_and_arcs().map(|piece| segment(&piece));
            let segments = segments.collect::<Result<_, _>>()?;
            auv.track = None;
            auv.path = Some(PathFile::Segments { segments, closed: route.closed });
        }
        Ok(())
    }
}

fn no_auv(id: &str) -> String {
    format!("--route {id}: no AUV has this id")
}

fn segment(piece: &Segment) -> Result<SegmentFile, String> {
    let coordinate = |value| fixed("coordinates", value);
    let point = |[north, east]: [f64; 2]| Ok::<_, String>(Point(vec![coordinate(north)?, coordinate(east)?]));
    match *piece {
        Segment::Line { from, to } => Ok(SegmentFile::Line { from: point(from)?, to: point(to)? }),
        Segment::Arc { from, centre, angle_rad } => Ok(SegmentFile::Arc {
            from: point(from)?,
            centre: point(centre)?,
            angle_rad: fixed("an angle", angle_rad)?,
        }),
        Segment::Waypoints { .. } => unreachable!("a path is followed along lines and arcs"),
    }
}

/// The number, if it is within the scenario's range.
pub(crate) fn fixed<K: Kind>(what: &'static str, value: f64) -> Result<Quantity<K>, String> {
    if K::RANGE.contains(&value) {
        return Ok(Quantity::fixed(value));
    }
    let (least, most) = K::RANGE.into_inner();
    Err(format!("scenarios take {what} from {least} to {most}, and the route has {value}"))
}
