//! The step loop of vehicles, water, faults and observer allocates nothing.

use pilotfish_sim::scenario::Scenario;
use planner::{angle::Heading, los::Reference};

#[test]
fn stepping_and_listening_allocate_nothing() {
    let reference = Reference { speed: 0.4, heading: Heading::new(0.3) };
    for name in Scenario::names() {
        let start = Scenario::named(name).expect("exists").start(1).expect("valid");
        let (mut world, mut observer) = (start.world, start.observer);
        let mut step = |seconds: u32| {
            for _ in 0..10 * seconds {
                world.step(Some(&reference));
                if let Some(observer) = &mut observer {
                    observer.listen(&world);
                }
            }
        };
        let allocated = allocation_counter::measure(|| step(600));
        assert_eq!(allocated.count_total, 0, "{name}: {allocated:?}");
    }
}
