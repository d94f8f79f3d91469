//! What pMarineViewer draws of a plan.

use std::fmt::Write as _;

use ::geodesy::Datum;
use nalgebra::Vector2;

use super::client::MoosClient;
use crate::Origin;
use crate::mission_link::LinkStatus;

/// Most points of a drawn plan.
const POINTS_MAX: usize = 60;
/// A plan that is over.
pub(crate) const NO_PLAN: &str = "pts={0,0},label=pilotfish_plan,active=false";

impl MoosClient {
    /// Plan and goal, and in turn one of the areas to keep out of.
    /// Nothing without a plan, its origin, or the datum of x and y.
    pub(crate) fn views(&self, turn: usize, link: &LinkStatus) -> Vec<(&'static str, String)> {
        let plan = link.plan.as_ref().map(|plan| &plan.answer.plan);
        let datum = plan.and_then(|plan| Datum::new(&plan.origin?.into()).ok());
        let Some((plan, datum)) = plan.zip(datum) else { return vec![] };
        let at = |north: f64, east: f64| {
            let place: Origin = datum.from_local(&Vector2::new(north, east)).into();
            self.xy(&place).map(|[x, y]| format!("{x:.1},{y:.1}"))
        };
        let step = plan.trajectory.len().div_ceil(POINTS_MAX).max(1);
        let points = plan.trajectory.iter().step_by(step);
        let points: Option<Vec<_>> = points.map(|point| at(point.north_m, point.east_m)).collect();
        let Some(points) = points else { return vec![] };
        let mut views = vec![("VIEW_SEGLIST", format!("pts={{{}}},label=pilotfish_plan", points.join(":")))];
        let labelled = |point: String, label: &str| {
            let (x, y) = point.split_once(',').unwrap_or_default();
            format!("x={x},y={y},label={label}")
        };
        let goal = plan.goal.trajectory.first().and_then(|goal| at(goal.north_m, goal.east_m));
        views.extend(goal.map(|goal| ("VIEW_POINT", labelled(goal, "pilotfish_goal"))));
        let keep_outs = link.setting.keep_outs.iter().flatten();
        let circles = keep_outs.enumerate().filter_map(|(number, disc)| {
            let mut circle = labelled(at(disc.north_m, disc.east_m)?, &format!("keep_out_{number}"));
            write!(circle, ",radius={:.1}", disc.radius_m).ok()?;
            Some(("VIEW_CIRCLE", circle))
        });
        let no_go = link.setting.no_go.iter().flatten();
        let polygons = no_go.enumerate().filter_map(|(number, area)| {
            let corners: Option<Vec<_>> =
                area.polygon.iter().map(|[north, east]| at(*north, *east)).collect();
            Some(("VIEW_POLYGON", format!("pts={{{}}},label=no_go_{number}", corners?.join(":"))))
        });
        let areas: Vec<_> = circles.chain(polygons).collect();
        if !areas.is_empty() {
            views.push(areas[turn % areas.len()].clone());
        }
        views
    }
}
