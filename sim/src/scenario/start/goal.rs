//! The surface craft's task at a start.

use std::collections::BTreeMap;

use nalgebra::Vector2;
use planner::snapshot::{Goal, Offset, VehicleId, VisitCost, Visits};

use super::{
    draw::Draw,
    invalid::{InvalidScenario, invalid},
};
use crate::scenario::file::{GoalFile, OffsetFile, Scenario, VisitCostFile};

impl Scenario {
    pub(super) fn goal(&self, file: &GoalFile, draw: &mut Draw) -> Result<Goal, InvalidScenario> {
        let called = |field: &str, id: &String| {
            self.auv_called(field, id)?;
            Ok(VehicleId(id.clone()))
        };
        let all = |kind: &str, ids: &[String]| {
            if ids.is_empty() {
                return Err(invalid(
                    format!("surface_craft.goal.{kind}.auvs"),
                    "a goal needs at least one vehicle",
                ));
            }
            let each = ids.iter().enumerate().map(|(i, id)| {
                let field = format!("surface_craft.goal.{kind}.auvs[{i}]");
                if ids[..i].contains(id) {
                    return Err(invalid(field, format_args!("{id:?} is named twice")));
                }
                called(&field, id)
            });
            each.collect::<Result<Vec<_>, _>>()
        };
        Ok(match file {
            GoalFile::Track { auv } => Goal::Track {
                auv: called("surface_craft.goal.track.auv", auv)?,
            },
            GoalFile::Intermittent {
                auvs,
                dwell_s,
                epoch_s,
            } => Goal::Intermittent {
                auvs: all("intermittent", auvs)?,
                dwell_s: draw.take(dwell_s),
                epoch_s: draw.take(epoch_s),
            },
            GoalFile::Midpoint { auvs } => Goal::Midpoint {
                auvs: all("midpoint", auvs)?,
            },
            GoalFile::Weighted { weights } => {
                let field = "surface_craft.goal.weighted.weights";
                let weigh = |(id, weight)| Ok((called(&format!("{field}.{id}"), id)?, draw.take(weight)));
                let weights: BTreeMap<_, _> = weights.iter().map(weigh).collect::<Result<_, _>>()?;
                if weights.values().all(|weight| *weight == 0.0) {
                    return Err(invalid(field, "at least one of them must be above 0"));
                }
                Goal::Weighted { weights }
            }
            GoalFile::Range { auvs, range_m } => Goal::Range {
                auvs: all("range", auvs)?,
                range_m: draw.take(range_m),
            },
            GoalFile::Visit {
                auvs,
                cost,
                weights,
                within_m,
                dwell_min_s,
                serve_by_s,
                reduce,
            } => {
                let default = Visits::new(all("visit", auvs)?);
                let field = "surface_craft.goal.visit";
                let is_visited = |member: &str, id: &String| {
                    if auvs.contains(id) {
                        return Ok(VehicleId(id.clone()));
                    }
                    let field = format!("{field}.{member}.{id}");
                    Err(invalid(field, "only vehicles that are visited may be named"))
                };
                let mut weighted = BTreeMap::new();
                for (id, weight) in weights {
                    weighted.insert(is_visited("weights", id)?, draw.take(weight));
                }
                let mut deadlines = BTreeMap::new();
                for (id, deadline) in serve_by_s {
                    deadlines.insert(is_visited("serve_by_s", id)?, draw.take(deadline));
                }
                let cost = visit_cost(cost, draw);
                let visits = Visits {
                    cost,
                    weights: weighted,
                    within_m: draw.take_or(within_m.as_ref(), default.within_m),
                    dwell_min_s: draw.take_or(dwell_min_s.as_ref(), cost.dwell_min()),
                    serve_by_s: deadlines,
                    reduce: *reduce,
                    ..default
                };
                if visits.auvs.iter().all(|id| visits.weight(id) == 0.0) {
                    return Err(invalid(
                        format!("{field}.weights"),
                        "at least one of them must be above 0",
                    ));
                }
                Goal::Visit(visits)
            }
        })
    }

    pub(super) fn offset(
        &self,
        file: &OffsetFile,
        goal: &GoalFile,
        draw: &mut Draw,
    ) -> Result<Offset, InvalidScenario> {
        let mut pair = |first, second| Vector2::new(draw.take(first), draw.take(second));
        Ok(match file {
            OffsetFile::Ned { north_m, east_m } => Offset::ned(pair(north_m, east_m)),
            OffsetFile::Target { ahead_m, starboard_m } => Offset::target(pair(ahead_m, starboard_m)),
            OffsetFile::Path { ahead_m, starboard_m } => {
                let field = "surface_craft.goal_offset.path";
                if !matches!(
                    goal,
                    GoalFile::Track { .. } | GoalFile::Intermittent { .. } | GoalFile::Visit { .. }
                ) {
                    return Err(invalid(
                        field,
                        "an offset along a path needs a goal that follows one vehicle at a time",
                    ));
                }
                if !self.knowledge.paths {
                    return Err(invalid(
                        field,
                        "the surface craft knows no paths; set knowledge.paths",
                    ));
                }
                if let Some(auv) = self.auvs.iter().find(|auv| auv.track.is_some()) {
                    let reason = format_args!("{:?} repeats a track, of which no path is known", auv.id);
                    return Err(invalid(field, reason));
                }
                Offset::path(pair(ahead_m, starboard_m))
            }
        })
    }
}

fn visit_cost(file: &VisitCostFile, draw: &mut Draw) -> VisitCost {
    match file {
        VisitCostFile::Age => VisitCost::Age,
        VisitCostFile::Uncertainty {
            growth_m2ps,
            sigma_m,
            sigma_rad,
            interval_s,
        } => VisitCost::Uncertainty {
            growth_m2ps: draw.take(growth_m2ps),
            sigma_m: draw.take(sigma_m),
            sigma_rad: draw.take(sigma_rad),
            interval_s: draw.take(interval_s),
        },
        VisitCostFile::Data {
            growth_kbps,
            upload_kbps,
            range_max_m,
        } => VisitCost::Data {
            growth_kbps: draw.take(growth_kbps),
            upload_kbps: draw.take(upload_kbps),
            range_max_m: draw.take(range_max_m),
        },
    }
}
