//! Route files of planning tools, as way-points.

use std::borrow::Cow;

use axum::Extension;
use axum::extract::{Request, State};
use axum::response::Response;
use planner::path::{Leg, SEGMENTS_MAX};
use route::{Place, Route, RoutePoint, Unread};
use serde::{Deserialize, Serialize};
use utoipa::{IntoParams, ToSchema};

use crate::edge::arrival::Arrival;
use crate::edge::body::Bodies;
use crate::edge::problem::{Problem, Refusals};
use crate::edge::query::{ValidQuery, wrong_parameter};
use crate::planning::admission::Work;
use crate::planning::deadline::Deadline;
use crate::planning::planners::Planners;
use crate::planning::valid_request::written;
use wire::{FieldError, Origin};

/// A route of a file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct RouteOfFile {
    /// Name of the route in the file; empty without one.
    pub name: String,
    /// Its way-points, in order.
    pub points: Vec<WayPoint>,
    /// The first speed that the file states, m/s.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub speed_mps: Option<f64>,
    /// The `path` of an AUV, in a snapshot or a change of a mission.
    pub path: PathOfFile,
    /// Statements of the file that a path does not have.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub notes: Vec<String>,
}

/// A `path`. Add `speed_mps` if the file states no speed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct PathOfFile {
    /// One segment of way-points.
    pub segments: Vec<WayPointsOfFile>,
    /// `true` if the last point leads back to the first.
    pub closed: bool,
    /// The first speed that the file states, m/s.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub speed_mps: Option<f64>,
}

/// A segment of `waypoints`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct WayPointsOfFile {
    /// `waypoints`.
    #[schema(value_type = String, example = "waypoints")]
    pub kind: Cow<'static, str>,
    /// The way-points, in order.
    pub points: Vec<WayPoint>,
    /// The first turn radius that the file states, m.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub turn_radius_m: Option<f64>,
    /// Speed and depth of the legs, if the file states different ones.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub legs: Vec<Leg>,
}

impl From<&Route> for PathOfFile {
    fn from(route: &Route) -> Self {
        let point = |point: &RoutePoint| match point.place {
            Place::Earth { lat_deg, lon_deg } => WayPoint::Earth(Origin { lat_deg, lon_deg }),
            Place::Local(point) => WayPoint::Metres(point),
        };
        let segment = WayPointsOfFile {
            kind: "waypoints".into(),
            points: route.points.iter().map(point).collect(),
            turn_radius_m: route.turn_radius_m(),
            legs: legs(route),
        };
        Self { segments: vec![segment], closed: route.closed, speed_mps: route.speed_mps() }
    }
}

/// Speed and depth of the legs of `route`, if they differ.
pub fn legs(route: &Route) -> Vec<Leg> {
    let leg = |end: &RoutePoint| Leg { speed_mps: end.speed_mps, depth_m: end.depth_m };
    route.ends_of_legs().into_iter().map(leg).collect()
}

/// A way-point: latitude and longitude, or north and east of an unnamed datum, m.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(untagged)]
pub enum WayPoint {
    /// On Earth.
    Earth(Origin),
    /// In metres.
    Metres([f64; 2]),
}

#[derive(Debug, Default, Deserialize, IntoParams)]
#[into_params(parameter_in = Query)]
#[serde(deny_unknown_fields)]
pub(crate) struct RouteQuery {
    /// Name of the route in the file. Default: the only one.
    #[serde(default)]
    name: Option<String>,
}

/// Reads a route from the file of a planning tool, sent unchanged: GeoJSON, KML, KMZ, GPX, RTZ,
/// QGroundControl `.plan`, `QGC WPL`, MOOS points, or CSV with named columns.
///
/// The content determines the format, not the content type. A file without a route is refused with
/// its line and the reason. The service keeps nothing: PATCH a mission's `paths` with the `path` of
/// the answer.
#[utoipa::path(post, path = "/v1/routes", tag = "missions", params(RouteQuery),
    request_body(content = String, content_type = "application/octet-stream", description = "The file."),
    responses((status = 200, description = "The route.", body = RouteOfFile), Refusals))]
pub(crate) async fn read_route(
    State(planners): State<Planners>,
    State(bodies): State<Bodies>,
    Extension(arrival): Extension<Arrival>,
    ValidQuery(RouteQuery { name }): ValidQuery<RouteQuery>,
    request: Request,
) -> Result<Response, Problem> {
    let body = bodies.receive(request).await?;
    let permit = planners.admit(Work::Reading, body.bytes.len())?;
    let (clock, limit) = (planners.clock.clone(), planners.deadline);
    let read = move |caller| {
        let stop = Deadline::new(arrival, None, limit).stop(&clock, caller);
        let fault = |error: Unread| FieldError::new("", "route_file", error.to_string());
        let routes = route::read_until(&body.bytes, &|| stop.is_due()).map_err(|error| {
            if stop.was_due() { Problem::FileTimedOut(limit) } else { Problem::Invalid(vec![fault(error)]) }
        })?;
        let route = route::select(routes, name.as_deref())
            .map_err(|error| wrong_parameter("name", "route_name", error.to_string()))?;
        let n_points = route.points.len();
        if SEGMENTS_MAX < n_points {
            let fault = FieldError::too_long("", n_points, SEGMENTS_MAX);
            return Err(Problem::Invalid(vec![fault]));
        }
        let path = PathOfFile::from(&route);
        Ok(written(|| RouteOfFile {
            points: path.segments[0].points.clone(),
            speed_mps: path.speed_mps,
            notes: route.left_out(),
            name: route.name,
            path,
        }))
    };
    planners.read(&permit, read).await?
}
