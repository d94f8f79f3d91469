//! Spare craft that help another one to localise its AUVs.

use std::cmp::Ordering;
use std::f64::consts::PI;

use nalgebra::Vector2;

use crate::facts::auv::VehicleId;
use crate::facts::fleet::{Assignment, CraftAssignment};
use crate::facts::goal::Goal;
use crate::facts::traffic::{CRAFT_LENGTH, CRAFT_SIGMA, VESSEL_SEPARATION_DEFAULT};
use crate::facts::visit::Fixes;
use crate::fleet::members::Fleet;

/// Room on the figure of craft that localise the same AUVs, as a share of what they need.
const ROOM: f64 = 1.1;

impl Fleet {
    /// Lets spare craft take part in localising by ranges: as before, or beside the craft with the
    /// fewest beside it, of these the one whose AUVs are nearest.
    pub(super) fn join(&self, craft: &mut [CraftAssignment]) {
        let leading = &self.snapshots[0];
        if !matches!(&leading.goal.goal, Goal::Localise(localise) if localise.fixes == Fixes::Range) {
            return;
        }
        let owners: Vec<usize> = (0..craft.len()).filter(|owner| !craft[*owner].auvs.is_empty()).collect();
        let mut n_together: Vec<usize> = vec![1; craft.len()];
        for spare in (0..craft.len()).filter(|spare| !owners.contains(spare)) {
            let may_join = |owner: &usize| {
                let all = craft[*owner].auvs.iter().all(|id| self.may_serve(spare, id));
                let radius = self.radius_for(n_together[*owner] + 1);
                all && radius <= leading.range_max().unwrap_or(f64::INFINITY)
            };
            let was = self.beside.iter().find(|before| before.id == self.ids[spare]);
            let goes_on = |owner: &usize| was.is_some_and(|before| before.auvs == craft[*owner].auvs);
            let key = |owner: &usize| {
                let off = self.mean_place(&craft[*owner].auvs) - self.snapshots[spare].asc.position();
                (!goes_on(owner), n_together[*owner], off.norm())
            };
            let order =
                |one: &usize, other: &usize| key(one).partial_cmp(&key(other)).unwrap_or(Ordering::Equal);
            let joined = owners.iter().copied().filter(may_join).min_by(order);
            if let Some(owner) = joined {
                n_together[owner] += 1;
                let auvs = craft[owner].auvs.clone();
                craft[spare] = CraftAssignment { id: self.ids[spare].clone(), auvs, beside: true };
            }
        }
    }

    fn may_serve(&self, craft: usize, id: &VehicleId) -> bool {
        let place = self.auvs.iter().position(|auv| self.snapshots[0].auvs[*auv].id == *id);
        place.is_some_and(|place| self.serves[craft] & (1 << place) != 0)
    }

    fn mean_place(&self, auvs: &[VehicleId]) -> Vector2<f64> {
        let leading = &self.snapshots[0];
        let known = leading.auvs.iter().zip(leading.estimates());
        let places = known.filter(|(auv, _)| auvs.contains(&auv.id)).map(|(_, of)| of.state.position());
        places.sum::<Vector2<f64>>() / auvs.len().max(1) as f64
    }

    /// Least radius of a figure of a craft, by index, with room for all that share its AUVs, m.
    pub(super) fn least_radius(&self, assignment: &Assignment, craft: usize) -> f64 {
        let together = assignment.craft.iter().filter(|other| other.auvs == assignment.craft[craft].auvs);
        self.radius_for(together.count())
    }

    /// Least radius with room for `n` craft, m: two pass at a right angle, more go side by side.
    fn radius_for(&self, n: usize) -> f64 {
        if n < 2 {
            return 0.0;
        }
        let separation = self.snapshots[0].vessel_separation_m.unwrap_or(VESSEL_SEPARATION_DEFAULT);
        let apart = separation + CRAFT_LENGTH / 2.0 + 2.0 * CRAFT_SIGMA;
        ROOM * apart / (2.0 * (PI / n.max(4) as f64).sin())
    }
}
