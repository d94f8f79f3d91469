//! Voyages of two hundred seeds, and one voyage twice. `just voyages N` sails more and longer ones.

use std::ops::Range;

use tests::voyage::{Course, Kind, Voyage, Wire, sail, sail_all};

const SEEDS: u64 = 200;

const COURSE: Course = Course {
    duration_s: 100.0,
    is_nominal: false,
    only: None,
    is_shared: None,
    is_dry: false,
    wire: Wire::Mavlink,
};

/// The voyages of `seeds`, in which every claim holds.
fn unbroken(seeds: Range<u64>, course: Course) -> Vec<Voyage> {
    sail_all(seeds, course, None, |voyage| {
        assert!(voyage.broken.is_none(), "{}", voyage.told());
        true
    })
}

#[test]
fn every_claim_holds_in_two_hundred_voyages_with_faults() {
    unbroken(1..1 + SEEDS, COURSE);
}

#[test]
fn a_voyage_without_faults_has_no_alarm() {
    let quiet = Course { is_nominal: true, ..COURSE };
    unbroken(2..5, quiet);
    let is_shared = Some(true);
    unbroken(5..6, Course { is_shared, ..quiet });
}

#[test]
fn every_claim_holds_on_other_wires() {
    for wire in [Wire::Moos, Wire::Imc] {
        unbroken(1..7, Course { wire, ..COURSE });
        unbroken(2..3, Course { wire, is_nominal: true, ..COURSE });
    }
}

#[test]
fn a_dry_run_reports_and_moves_nothing() {
    let dry = Course { is_nominal: true, is_dry: true, ..COURSE };
    for voyage in unbroken(1..3, dry) {
        // A plan needs reports. Every reference and every order is checked.
        let checks = ["plans", "limits", "orders"].map(|claim| voyage.claims.contains_key(claim));
        assert_eq!(checks, [true, false, false], "{}", voyage.told());
    }
}

/// Faults without evidence within 3 s: no fix of an AUV, a stuck rudder until the next turn.
const LATER_S: [(Kind, f64); 2] = [(Kind::AuvSilent, 15.0), (Kind::RudderStuck, 5.0)];

#[test]
fn no_display_reports_steering_three_seconds_after_a_fault() {
    let wires = [Wire::Mavlink, Wire::Moos];
    for (kind, wire) in Kind::SHOWN.into_iter().flat_map(|kind| wires.map(|wire| (kind, wire))) {
        let only = Some(kind);
        let voyage = sail(1, Course { only, wire, ..COURSE });
        let later = LATER_S.into_iter().find(|(late, _)| *late == kind);
        let after_s = later.map_or(3.0, |(_, after_s)| after_s);
        let mut seen = 0;
        for shown in voyage.shown.iter().filter(|shown| !shown.is_over) {
            if shown.after_s < 0.0 || after_s <= shown.after_s {
                assert_eq!(shown.good(), [shown.after_s < 0.0; 3], "{shown:?}");
                seen += 1;
            }
        }
        assert!(2 <= seen, "{kind} {wire:?}");
    }
}

#[test]
fn a_seed_replays_to_the_byte() {
    let long = Course { duration_s: 300.0, ..COURSE };
    for is_shared in [false, true].map(Some) {
        let course = Course { is_shared, ..long };
        assert_eq!(sail(5, course), sail(5, course));
    }
}
