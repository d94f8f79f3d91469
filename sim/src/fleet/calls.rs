//! Calls of several craft in the slots of one acoustic network.

use nalgebra::Vector2;

/// A craft calls an AUV.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Call {
    /// Number of the craft.
    pub(super) craft: usize,
    /// Number of the AUV.
    pub(super) auv: usize,
    /// Number of the slot.
    pub(super) slot: usize,
    /// Where both are (north, east), m.
    pub(super) ends: [Vector2<f64>; 2],
}

/// The slot of each of `n_auvs` in which this craft calls it and is understood: calls in one slot
/// drown each other if an end of one is within `range`, m, of an end of the other.
pub(super) fn slots(calls: &[Call], craft: usize, n_auvs: usize, range: f64) -> Vec<Option<usize>> {
    let near = |one: &Call, other: &Call| {
        one.ends.iter().any(|from| other.ends.iter().any(|to| (from - to).norm() <= range))
    };
    let drowns = |one: &Call, other: &Call| one != other && one.slot == other.slot && near(one, other);
    let mut slots = vec![None; n_auvs];
    for call in calls.iter().filter(|call| call.craft == craft) {
        if !calls.iter().any(|other| drowns(call, other)) {
            slots[call.auv] = Some(call.slot);
        }
    }
    slots
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn calls_in_one_slot_are_lost_within_range_alone() {
        let call = |craft, auv, slot, north: f64| {
            let at = Vector2::new(north, 0.0);
            Call { craft, auv, slot, ends: [at, at + Vector2::new(0.0, 50.0)] }
        };
        let calls = [call(0, 0, 0, 0.0), call(1, 1, 0, 100.0), call(0, 2, 1, 0.0), call(2, 3, 0, 900.0)];
        let of = |craft, range| slots(&calls, craft, 4, range);
        assert_eq!(of(0, 99.0), [Some(0), None, Some(1), None]);
        assert_eq!(of(0, 101.0), [None, None, Some(1), None]);
        assert_eq!(of(1, 101.0), [None; 4]);
        assert_eq!(of(2, 101.0), [None, None, None, Some(0)]);
    }
}
