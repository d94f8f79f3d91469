//! Several surface craft of a start.

use planner::fleet::CRAFT_MAX;

use super::check_name;
use super::draw::Draw;
use super::invalid::{InvalidScenario, invalid, refused};
use crate::observe::Briefing;
use crate::scenario::file::{Scenario, SurfaceCraftFile};
use crate::world::SurfaceCraft;
use crate::world::vessel::Behaviour;

impl Scenario {
    /// Every craft, with what it knows and its contact range, m. All have the goal of the first.
    pub(super) fn all_craft(
        &self,
        draw: &mut Draw,
    ) -> Result<Vec<(SurfaceCraft, Briefing, f64)>, InvalidScenario> {
        let mut all: Vec<(SurfaceCraft, Briefing, f64)> = vec![];
        for (i, file) in self.surface_craft.iter().enumerate() {
            let named = |wrong: InvalidScenario| {
                if self.has_fleet() { wrong.of_item("surface_craft", i) } else { wrong }
            };
            let (craft, briefing, range) = self.surface_craft(file, draw).map_err(named)?;
            let goal = all.first().map_or(&briefing.goal, |(_, first, _)| &first.goal).clone();
            all.push((craft, Briefing { goal, ..briefing }, range));
        }
        for id in all.iter().flat_map(|(_, briefing, _)| briefing.goal.vehicles()) {
            let may_serve =
                |file: &SurfaceCraftFile| file.serves.as_ref().is_none_or(|ids| ids.contains(&id.0));
            if self.has_fleet() && !self.surface_craft.iter().any(may_serve) {
                let reason = format_args!("no craft may serve {:?}: add it to `serves` of one", id.0);
                return refused("surface_craft[0].goal", reason);
            }
        }
        Ok(all)
    }

    /// The number of the surface craft with this `id`.
    pub(super) fn craft_called(&self, field: &str, id: &str) -> Result<usize, InvalidScenario> {
        let found = self.surface_craft.iter().position(|craft| craft.id.as_deref() == Some(id));
        found.ok_or_else(|| invalid(field, format_args!("there is no surface craft {id:?}")))
    }

    /// Names and what they may serve; what is not flown among several craft.
    pub(super) fn check_fleet(&self) -> Result<(), InvalidScenario> {
        let n = self.surface_craft.len();
        if CRAFT_MAX < n {
            return refused("surface_craft", format_args!("{n} craft; at most {CRAFT_MAX} are allowed"));
        }
        if !self.has_fleet() {
            return Ok(());
        }
        // Each craft has a world of its own, in which a vessel would give way to it alone.
        if let Some(i) = self.traffic.iter().position(|vessel| vessel.behaviour == Behaviour::GivesWay) {
            return refused(format!("traffic[{i}].behaviour"), "no vessel gives way to several craft");
        }
        for (i, craft) in self.surface_craft.iter().enumerate() {
            self.check_craft(i, craft)?;
        }
        Ok(())
    }

    fn check_craft(&self, i: usize, craft: &SurfaceCraftFile) -> Result<(), InvalidScenario> {
        let field = format!("surface_craft[{i}].id");
        let id = craft.id.as_ref().ok_or_else(|| invalid(&field, "is missing; several craft have names"))?;
        check_name(&field, id)?;
        let of_craft = self.surface_craft[..i].iter().any(|other| other.id.as_ref() == Some(id));
        if of_craft || self.auvs.iter().any(|auv| auv.id == *id) {
            return refused(field, format_args!("{id:?} is the name of two vehicles"));
        }
        for (j, auv) in craft.serves.iter().flatten().enumerate() {
            self.auv_called(&format!("surface_craft[{i}].serves[{j}]"), auv)?;
        }
        if craft.parameters != planner::tuned::Tuned::DEFAULT {
            let field = format!("surface_craft[{i}].parameters");
            return refused(field, "several craft are planned for with the planner's own");
        }
        Ok(())
    }
}
