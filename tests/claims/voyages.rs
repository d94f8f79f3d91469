//! Voyages of two hundred seeds, and one voyage twice. `just voyages N` sails more and longer ones.

use std::{
    sync::atomic::{AtomicU64, Ordering},
    thread,
};

use tests::voyage::{Course, Kind, sail};

const SEEDS: u64 = 200;

const COURSE: Course = Course {
    duration_s: 100.0,
    is_nominal: false,
    only: None,
    is_shared: None,
};

/// Sails these seeds on as many threads as there are processors, each voyage on one.
fn sail_all(seeds: std::ops::Range<u64>, course: Course) {
    let next = AtomicU64::new(seeds.start);
    thread::scope(|scope| {
        for _ in 0..thread::available_parallelism().map_or(1, Into::into) {
            scope.spawn(|| {
                loop {
                    let seed = next.fetch_add(1, Ordering::Relaxed);
                    if seeds.end <= seed {
                        return;
                    }
                    let voyage = sail(seed, course);
                    assert!(voyage.broken.is_none(), "{}", voyage.told());
                }
            });
        }
    });
}

#[test]
fn every_claim_holds_in_two_hundred_voyages_with_faults() {
    sail_all(1..1 + SEEDS, COURSE);
}

#[test]
fn a_voyage_without_faults_has_no_alarm() {
    let quiet = Course {
        is_nominal: true,
        ..COURSE
    };
    sail_all(2..5, quiet);
    let is_shared = Some(true);
    sail_all(5..6, Course { is_shared, ..quiet });
}

/// Faults without evidence within 3 s: no fix of an AUV, a stuck rudder until the next turn.
const LATER_S: [(Kind, f64); 2] = [(Kind::AuvSilent, 15.0), (Kind::RudderStuck, 5.0)];

#[test]
fn no_display_reports_steering_three_seconds_after_a_fault() {
    for kind in Kind::SHOWN {
        let only = Some(kind);
        let voyage = sail(1, Course { only, ..COURSE });
        let later = LATER_S.into_iter().find(|(late, _)| *late == kind);
        let after_s = later.map_or(3.0, |(_, after_s)| after_s);
        let mut seen = 0;
        for shown in voyage.shown.iter().filter(|shown| !shown.is_over) {
            if shown.after_s < 0.0 || after_s <= shown.after_s {
                assert_eq!(shown.good(), [shown.after_s < 0.0; 3], "{shown:?}");
                seen += 1;
            }
        }
        assert!(2 <= seen, "{kind}");
    }
}

#[test]
fn a_seed_replays_to_the_byte() {
    let long = Course {
        duration_s: 300.0,
        ..COURSE
    };
    for is_shared in [false, true].map(Some) {
        let course = Course { is_shared, ..long };
        assert_eq!(sail(5, course), sail(5, course));
    }
}
