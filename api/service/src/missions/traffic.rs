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
    /// farthest from the `craft` if there are too many to plan with.
    pub(super) fn take(&mut self, heard: &[Vessel], now: f64, craft: Option<Vector2<f64>>) {
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
            craft.map_or(now - time(vessel), |at| (vessel.position() - at).norm())
        });
    }

    /// Keeps so many vessels of the least distance.
    fn keep(&mut self, most: usize, distance: impl Fn(&Vessel) -> f64) {
        if self.0.len() <= most {
            return;
        }
        let mut distances: Vec<f64> = self.0.values().map(&distance).collect();
        distances.sort_by(f64::total_cmp);
        let farthest = distances[most.max(1) - 1];
        self.0.retain(|_, vessel| distance(vessel) <= farthest);
        while most < self.0.len() {
            self.0.pop_last();
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
