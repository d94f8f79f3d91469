//! The same scenario, guide and seed give the same record, to the bit.

use std::thread;

use pilotfish_sim::{guide::Guide, record::Record, scenario::Scenario};

use crate::{flown_by, los, mpc, named};

fn mission(name: &str, guide: &mut dyn Guide, seed: u64) -> Record {
    // Schedules take longest.
    let seconds = if name.starts_with("visit") { 10.0 } else { 60.0 };
    flown_by(&named(name).lasting(seconds), guide, seed)
}

#[test]
fn equal_seeds_give_equal_records_and_other_seeds_others() {
    for name in Scenario::names() {
        let first = mission(name, &mut los(), 3);
        assert_eq!(first, mission(name, &mut los(), 3), "{name}");
        assert_ne!(first.rows, mission(name, &mut los(), 4).rows, "{name}");
    }
}

#[test]
fn records_do_not_depend_on_the_number_of_threads() {
    let names = Scenario::names();
    let alone: Vec<Record> = names.iter().map(|name| mission(name, &mut mpc(), 5)).collect();
    for n_threads in [2, 5] {
        // Every thread runs its share with one guide after the other, like a campaign.
        let together = thread::scope(|scope| {
            let share = |first: usize| {
                let names = &names;
                scope.spawn(move || {
                    let mine = (first..names.len()).step_by(n_threads);
                    let flown = mine.map(|i| (i, mission(names[i], &mut mpc(), 5)));
                    flown.collect::<Vec<_>>()
                })
            };
            let shares: Vec<_> = (0..n_threads).map(share).collect();
            let records = shares
                .into_iter()
                .flat_map(|share| share.join().expect("no panic"));
            records.collect::<Vec<_>>()
        });
        assert_eq!(together.len(), names.len());
        for (i, record) in together {
            assert_eq!(record, alone[i], "{} on {n_threads} threads", names[i]);
        }
    }
}
