//! Slots of the acoustic network: no two transmissions in one slot where one may drown the other.

use nalgebra::Vector2;

use crate::facts::fleet::{Assignment, SlotUse};
use crate::fleet::members::Fleet;
use crate::predict::goal::forecast_all;

/// Reach of a sound that disturbs others over the largest range of a link. Assumption.
const DISTURBS: f64 = 2.0;

/// A transmission: the caller's and the called one's position, m.
pub(super) type Call = (Vector2<f64>, Vector2<f64>);

impl Fleet {
    /// Slots of the network, in order, in each of which transmissions do not disturb each other.
    pub fn slots(&self, assignment: &Assignment) -> Vec<Vec<SlotUse>> {
        let leading = &self.snapshots[0];
        let forecasts = forecast_all(leading);
        let (mut uses, mut calls) = (Vec::new(), Vec::new());
        for (k, (craft, snapshot)) in assignment.craft.iter().zip(&self.snapshots).enumerate() {
            for auv in assignment.serves(k) {
                let at = leading.auvs.iter().position(|known| known.id == *auv);
                let at = at.map_or_else(Vector2::zeros, |auv| forecasts[auv].at(0.0).position);
                uses.push(SlotUse { craft: craft.id.clone(), auv: auv.clone() });
                calls.push((snapshot.asc.position(), at));
            }
        }
        let mut table: Vec<Vec<SlotUse>> = Vec::new();
        for (slot, used) in slots(&calls, leading.range_max()).into_iter().zip(uses) {
            table.resize_with(table.len().max(slot + 1), Vec::new);
            table[slot].push(used);
        }
        table
    }
}

/// The slot of each of `calls`: the first in which none disturbs another; any two without a range.
pub(super) fn slots(calls: &[Call], range: Option<f64>) -> Vec<usize> {
    let reach = range.map_or(f64::INFINITY, |range| DISTURBS * range);
    let reaches = |from: &Vector2<f64>, to: &Vector2<f64>| (from - to).norm() <= reach;
    // Both ends send and listen.
    let disturb = |one: &Call, other: &Call| {
        let ends = |call: &Call| [call.0, call.1];
        ends(one).iter().any(|from| ends(other).iter().any(|to| reaches(from, to)))
    };
    let mut slots: Vec<usize> = Vec::with_capacity(calls.len());
    for (i, call) in calls.iter().enumerate() {
        let is_free =
            |slot: &usize| (0..i).all(|other| slots[other] != *slot || !disturb(call, &calls[other]));
        let slot = (0..=i).find(is_free).unwrap_or(i);
        slots.push(slot);
    }
    slots
}
