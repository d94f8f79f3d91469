//! The other vessels that a live mission was told of.

use std::collections::BTreeMap;

use planner::nalgebra::Vector2;
use planner::snapshot::VESSELS_MAX;
use planner::vessel::is_lost;
use serde::{Deserialize, Serialize};

use super::clock::is_ahead;
use super::own_craft::OwnCraft;
use wire::Vessel;

/// Age from which a mission forgets a vessel, s: those at anchor report each three minutes.
const FORGOTTEN: f64 = 6.0 * 3600.0;

/// Time for which a lost vessel under way is told of, s: most have left the range of AIS.
const TOLD_FOR: f64 = 300.0;

/// The newest position of each vessel, by its identity.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub(super) struct Traffic(BTreeMap<String, Vessel>);

impl Traffic {
    pub(super) fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    pub(super) fn vessels(&self) -> impl Iterator<Item = &Vessel> {
        self.0.values()
    }

    /// Takes the newest position of each vessel. Forgets those that are long lost, and those that are
    /// farthest from all `craft` if there are too many to plan with.
    pub(super) fn take(&mut self, heard: &[Vessel], now: f64, craft: &[Vector2<f64>]) {
        let time = |vessel: &Vessel| vessel.t_s.unwrap_or(now);
        for vessel in heard {
            let is_newer = |known: &Vessel| time(known) <= time(vessel);
            if self.0.get(&vessel.id.0).is_none_or(is_newer) {
                let dated = Vessel { t_s: Some(time(vessel)), ..vessel.clone() };
                self.0.insert(vessel.id.0.clone(), dated);
            }
        }
        self.0.retain(|_, vessel| {
            let age = now - time(vessel);
            age < FORGOTTEN && !is_lost(vessel, age - TOLD_FOR) && !is_ahead(time(vessel), now)
        });
        self.keep(VESSELS_MAX, |vessel| {
            if is_lost(vessel, now - time(vessel)) {
                return f64::INFINITY;
            }
            let nearest = craft.iter().map(|at| (vessel.position() - at).norm()).reduce(f64::min);
            nearest.unwrap_or(now - time(vessel))
        });
    }

    /// Keeps so many vessels of the least distance.
    fn keep(&mut self, most: usize, distance: impl Fn(&Vessel) -> f64) {
        if self.0.len() <= most {
            return;
        }
        let each = self.0.iter().map(|(id, vessel)| (distance(vessel), id.clone()));
        let mut all: Vec<(f64, String)> = each.collect();
        all.sort_by(|(one, _), (other, _)| one.total_cmp(other));
        for (_, id) in &all[most..] {
            self.0.remove(id);
        }
    }

    /// Moves every position, and forgets vessels that are then beyond all coordinates.
    pub(super) fn count_from(
        &mut self,
        change: impl Fn(&mut f64, &mut f64),
        is_near: impl Fn(f64, f64) -> bool,
    ) {
        let positions = self.0.values_mut().flat_map(Vessel::positions_mut);
        positions.for_each(|(north, east)| change(north, east));
        self.0.retain(|_, vessel| is_near(vessel.north_m, vessel.east_m));
    }

    /// The vessels of a request of a craft at `here`: what was heard, but for names of which
    /// `is_craft` says that they are those of the fleet, with the `own` craft of the service, and
    /// `silent` ones of the fleet.
    pub(super) fn with(
        &self,
        (own, silent): (&OwnCraft, &[Vessel]),
        here: Vector2<f64>,
        is_craft: impl Fn(&str) -> bool,
    ) -> Vec<Vessel> {
        let mut others = self.clone();
        others.0.retain(|id, vessel| !own.echoes.contains(&vessel.id) && !is_craft(id));
        let known = own.vessels.len() + silent.len();
        others.keep(VESSELS_MAX.saturating_sub(known), |vessel| (vessel.position() - here).norm());
        others.0.into_values().chain(own.vessels.iter().chain(silent).cloned()).collect()
    }
}

#[cfg(test)]
mod tests {
    use wire::VehicleId;

    use super::*;

    #[test]
    fn vessels_near_any_craft_are_kept_among_many_near_another() {
        let vessel = |id: String, place: Vector2<f64>| {
            Vessel::of_craft(VehicleId(id), 0.0, place, Vector2::zeros(), vec![])
        };
        let there = Vector2::new(20_000.0, 0.0);
        let near = (0..6).map(|i| vessel(format!("near-{i}"), there + Vector2::new(0.0, 200.0)));
        let many = (0..VESSELS_MAX).map(|i| vessel(format!("far-{i}"), Vector2::new(0.0, 900.0)));
        let mut traffic = Traffic::default();
        traffic.take(&many.chain(near).collect::<Vec<_>>(), 0.0, &[Vector2::zeros(), there]);
        let n_near = traffic.vessels().filter(|vessel| vessel.id.0.starts_with("near")).count();
        assert_eq!((traffic.vessels().count(), n_near), (VESSELS_MAX, 6));
    }
}
