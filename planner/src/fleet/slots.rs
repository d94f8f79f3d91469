//! Slots of the acoustic network: no two transmissions in one slot where one may drown the other.

use nalgebra::Vector2;

/// A sound that may be too weak to be understood still disturbs others: how much farther it
/// reaches than the largest range of a link. Assumption.
const DISTURBS: f64 = 2.0;

/// A transmission: the caller's and the called one's position, m.
pub(super) type Call = (Vector2<f64>, Vector2<f64>);

/// The slot of each of `calls`: the first in which no other disturbs it, or it another. Without a
/// range, all disturb each other.
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
