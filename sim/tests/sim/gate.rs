//! `observe` is the only input of a guidance law: no law reads the truth, and all get the same.

use pilotfish_sim::guide::{Guidance, Guide, GuideError};
use pilotfish_sim::observe::Observer;
use pilotfish_sim::scenario::Scenario;
use pilotfish_sim::world::World;
use planner::angle::wrap;
use planner::nalgebra::Vector2;
use planner::snapshot::{PlanRequest, Snapshot};

use crate::{craft, flown_by, los, mpc, named, near, parsed, step_until};

/// Keeps the snapshots and answers of a guide.
struct Witness<'a> {
    guide: &'a mut dyn Guide,
    exchanged: Vec<(Snapshot, Guidance)>,
}

impl Guide for Witness<'_> {
    fn name(&self) -> &'static str {
        self.guide.name()
    }

    fn guide(&mut self, snapshot: &Snapshot) -> Result<Guidance, GuideError> {
        let guidance = self.guide.guide(snapshot)?;
        self.exchanged.push((snapshot.clone(), guidance));
        Ok(guidance)
    }
}

fn exchanges(scenario: &Scenario, guide: &mut dyn Guide) -> Vec<(Snapshot, Guidance)> {
    let mut witness = Witness { guide, exchanged: vec![] };
    let _ = flown_by(scenario, &mut witness, 1);
    witness.exchanged
}

#[test]
fn snapshots_contain_the_bounds_that_judge_the_craft() {
    let scenario = named("crowded").lasting(2.0);
    let bounds = scenario.start(1).expect("valid").bounds;
    assert!(!bounds.area.is_empty() && bounds.range_max.is_some());
    for (snapshot, _) in exchanges(&scenario, &mut los()) {
        let corners: Vec<_> = snapshot.area.iter().copied().map(Vector2::from).collect();
        assert_eq!(&snapshot.keep_outs, &bounds.keep_outs);
        assert_eq!(corners, bounds.area.clone());
        assert_eq!(snapshot.range_max(), bounds.range_max);
    }
}

#[test]
fn the_answers_of_a_law_depend_on_snapshots_alone() {
    // Knowledge is far from the truth in the roughest water. A fresh law without a world must give
    // the same answers to the same snapshots, to the bit.
    let scenario = named("rough-water").lasting(200.0);
    let laws: [fn() -> Box<dyn Guide>; 2] = [|| Box::new(los()), || Box::new(mpc())];
    for law in laws {
        let mut alone = law();
        for (snapshot, guidance) in exchanges(&scenario, law().as_mut()) {
            let again = alone.guide(&snapshot).expect("answers");
            assert_eq!(again, guidance, "{}", alone.name());
        }
    }
}

/// World and observer after `seconds` with one look each, without a reference to follow.
fn after(scenario: &Scenario, seconds: u32) -> (World, Observer) {
    let start = scenario.start(1).expect("valid");
    let (mut world, mut observer) = (start.world, start.observer.expect("has a surface craft"));
    for _ in 0..seconds {
        look(&world, &mut observer);
        for _ in 0..10 {
            world.step(None);
            observer.listen(&world);
        }
    }
    (world, observer)
}

fn look(world: &World, observer: &mut Observer) -> PlanRequest {
    let craft = world.surface_craft.as_ref().expect("has one");
    PlanRequest::clone(&observer.observe(world, craft, 1.0).expect("inside the limits"))
}

#[test]
fn an_unheard_change_is_not_known() {
    // "silence" is silent from 510 s to 690 s. Nothing that happens to the vehicle meanwhile
    // changes the knowledge of it.
    let scenario = named("silence");
    let (mut world, mut observer) = after(&scenario, 510);
    let mut displaced = world.clone();
    displaced.auvs[0].state[0] += 500.0;
    displaced.auvs[0].state[2] += 7.0;
    let known = look(&world, &mut observer.clone());
    assert_eq!(known, look(&displaced, &mut observer));

    // The difference shows once it is heard again.
    step_until(&mut world, 691.0);
    step_until(&mut displaced, 691.0);
    let known = look(&world, &mut observer.clone());
    assert_ne!(known.auvs, look(&displaced, &mut observer).auvs);
}

#[test]
fn the_plan_of_a_vehicle_is_known_but_not_its_progress() {
    // Two plans that differ only beyond 5 m along the path, and a vehicle that is never heard: the
    // plan at its last known position is the same for both.
    let [slow, fast] = [0.3, 0.6].map(|beyond| {
        let text = Scenario::text("silence").expect("exists");
        let knots = format!("[{{along_m = 5, speed_mps = 0.3}}, {{along_m = 6, speed_mps = {beyond}}}]");
        let profile = format!("leg = \"down\"\nspeed_profile = {knots}");
        let text = text.replace("from_s = 510", "from_s = 0").replace("leg = \"down\"", &profile);
        let (world, mut observer) = after(&parsed(&(text + "\n[knowledge]\npaths = true\n")), 120);
        let auv = look(&world, &mut observer).auvs.remove(0);
        (world.auvs[0].gamma, auv.path.expect("given").speed_mps)
    });
    assert!(6.0 < slow.0 && slow.0 + 5.0 < fast.0, "{slow:?} {fast:?}");
    assert_eq!(slow.1, fast.1);
}

#[test]
fn every_law_gets_the_same_errors() {
    // Two laws steer differently; the errors of the craft's sensors, measurement less truth, are
    // equal. (Which messages arrive depends on the range, and so on the law.)
    let scenario = named("rough-water").lasting(300.0);
    let [los, mpc] = [&mut los() as &mut dyn Guide, &mut mpc()].map(|guide| flown_by(&scenario, guide, 4));
    for (los, mpc) in los.rows.iter().zip(&mpc.rows) {
        let [los, mpc] = [los, mpc].map(|row| {
            let craft = craft(row);
            let position = craft.known.position - craft.position;
            let heading = wrap(craft.known.heading.radians() - craft.heading);
            [position.x, position.y, heading, craft.known.surge - craft.surge]
        });
        // The errors are added to different positions, so the rounding differs.
        los.into_iter().zip(mpc).for_each(|(a, b)| near(a, b, 1e-9));
    }
}
