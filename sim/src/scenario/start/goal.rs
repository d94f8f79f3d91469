//! The surface craft's task at a start.

use nalgebra::Vector2;
use planner::{
    angle::Course,
    path::Path,
    snapshot::{Auv, AuvState, DeclaredPath, Goal, Offset, Task, VehicleId},
};

use super::draw::{Checked, Draw};
use super::invalid::{InvalidScenario, of_snapshot, refused};
use crate::scenario::file::{Scenario, SurfaceCraftFile};

impl Scenario {
    /// The goal and its offset, which obey the rules of a snapshot.
    pub(super) fn task(&self, file: &SurfaceCraftFile, draw: &mut Draw) -> Result<Task, InvalidScenario> {
        let mut checked = Checked::new(draw, "surface_craft.goal");
        let mut take = |place: &str, range: &_, number: Option<&_>| checked.take(place, range, number);
        let goal = file.goal.map(&mut take);
        let mut goal = checked.all(goal)?;
        // As in a snapshot that was read.
        if let Goal::Visit(visits) = &mut goal {
            visits.fill_defaults();
        }
        let mut checked = Checked::new(draw, "surface_craft.goal_offset");
        let offset = file.goal_offset.as_ref();
        let offset =
            offset.map(|offset| offset.map(&mut |place, range, number| checked.take(place, range, number)));
        let offset = offset.map(|offset| checked.all(offset)).transpose()?;
        let task = Task { goal, offset };
        let is_along_path = matches!(task.offset, Some(Offset::Path { .. }));
        if is_along_path && task.goal.follows_one() && !self.knowledge.paths {
            return refused(
                "surface_craft.goal_offset.path",
                "the surface craft knows no paths; set knowledge.paths",
            );
        }
        match task.faults(&self.known_auvs()).first() {
            None => Ok(task),
            Some(fault) if fault.pointer.starts_with("/goal/offset") => {
                refused("surface_craft.goal_offset.path", fault.words())
            }
            Some(fault) => {
                // A scenario's goal is in a table of its kind.
                let written = serde_json::to_value(&task).unwrap_or_default();
                let kind = written["kind"].as_str().unwrap_or_default();
                let pointer = fault.pointer.replacen("/goal", &format!("/goal/{kind}"), 1);
                Err(of_snapshot("surface_craft", &pointer, fault))
            }
        }
    }

    /// The AUVs by name, with a path where they follow one.
    fn known_auvs(&self) -> Vec<Auv> {
        let nowhere = AuvState::new(Vector2::zeros(), 0.0, Course::new(0.0), 0.0);
        let path = DeclaredPath::new(&Path::starting_at(Vector2::zeros(), 0.0), 1.0);
        let auv = |file: &crate::scenario::AuvFile| Auv {
            path: file.track.is_none().then(|| path.clone()),
            ..Auv::new(VehicleId(file.id.clone()), nowhere)
        };
        self.auvs.iter().map(auv).collect()
    }
}
