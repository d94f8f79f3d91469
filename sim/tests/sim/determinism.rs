//! The same scenario, guide and seed give the same record, to the bit.

use pilotfish_sim::scenario::Scenario;

use crate::{flown_by, los, named};

#[test]
fn equal_seeds_give_equal_records_and_other_seeds_others() {
    for name in Scenario::names() {
        // Schedules take longest.
        let seconds = if name.starts_with("visit") { 10.0 } else { 60.0 };
        let mission = |seed| flown_by(&named(name).lasting(seconds), &mut los(), seed);
        let first = mission(3);
        assert_eq!(first, mission(3), "{name}");
        assert_ne!(first.rows, mission(4).rows, "{name}");
    }
}
