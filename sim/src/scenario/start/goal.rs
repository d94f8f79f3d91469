//! The surface craft's task at a start.

use std::collections::BTreeMap;

use nalgebra::Vector2;
use planner::snapshot::{Goal, Offset, VehicleId};

use super::{
    draw::Draw,
    invalid::{InvalidScenario, invalid},
};
use crate::scenario::file::{GoalFile, OffsetFile, Scenario};

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
                if !matches!(goal, GoalFile::Track { .. } | GoalFile::Intermittent { .. }) {
                    return Err(invalid(
                        field,
                        "only a goal that follows one vehicle at a time has a path",
                    ));
                }
                if !self.knowledge.paths {
                    return Err(invalid(
                        field,
                        "the surface craft knows no paths; set knowledge.paths",
                    ));
                }
                Offset::path(pair(ahead_m, starboard_m))
            }
        })
    }
}
