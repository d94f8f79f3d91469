//! `observe` is the only input of a guidance law: no law reads the truth, and all get the same.

use pilotfish_sim::{
    guide::{Guidance, Guide, GuideError},
    mission::run,
    observe::Observer,
    scenario::{Files, Scenario},
    world::World,
};
use planner::{
    nalgebra::Vector2,
    snapshot::{PlanRequest, Snapshot},
};

use crate::{los, mpc, named};

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
    let mut witness = Witness {
        guide,
        exchanged: vec![],
    };
    run(scenario, &mut witness, 1, &mut |_| {}).expect("runs");
    witness.exchanged
}

fn corners(snapshot: &Snapshot) -> Vec<Vector2<f64>> {
    snapshot.area.iter().copied().map(Vector2::from).collect()
}

#[test]
fn snapshots_contain_the_bounds_that_judge_the_craft() {
    let scenario = named("crowded").lasting(2.0);
    let bounds = scenario.start(1).expect("valid").bounds;
    for (snapshot, _) in exchanges(&scenario, &mut los()) {
        assert_eq!(snapshot.keep_outs, bounds.keep_outs);
        assert_eq!(
            (corners(&snapshot), snapshot.range_max()),
            (bounds.area.clone(), bounds.range_max)
        );
        assert!(!snapshot.area.is_empty() && snapshot.range_max().is_some());
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
            assert_eq!(
                alone.guide(&snapshot).expect("answers"),
                guidance,
                "{}",
                alone.name()
            );
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
    for world in [&mut world, &mut displaced] {
        while world.time() < 691.0 {
            world.step(None);
        }
    }
    assert_ne!(
        look(&world, &mut observer.clone()).auvs,
        look(&displaced, &mut observer).auvs
    );
}

#[test]
fn the_plan_of_a_vehicle_is_known_but_not_its_progress() {
    // Two plans that differ only beyond 5 m along the path, and a vehicle that is never heard: the
    // plan at its last known position is the same for both.
    let speeds = |beyond: f64| {
        let text = Scenario::text("silence").expect("exists").to_owned();
        let text = text.replace("from_s = 510", "from_s = 0").replace(
            "leg = \"down\"",
            &format!(
                "leg = \"down\"\nspeed_profile = [{{along_m = 5, speed_mps = 0.3}}, {{along_m = 6, speed_mps = {beyond}}}]"
            ),
        );
        let text = text + "\n[knowledge]\npaths = true\n";
        let scenario = Scenario::parse(&text, "silent.toml", Files::default()).expect("valid");
        let (world, mut observer) = after(&scenario, 120);
        let auv = look(&world, &mut observer).auvs.remove(0);
        (world.auvs[0].gamma, auv.path.expect("given").speed_mps)
    };
    let (slow, fast) = (speeds(0.3), speeds(0.6));
    assert!(6.0 < slow.0 && slow.0 + 5.0 < fast.0, "{slow:?} {fast:?}");
    assert_eq!(slow.1, fast.1);
}

#[test]
fn a_craft_without_gnss_does_not_notice_a_displacement() {
    // "faults" has no GNSS from 700 s to 880 s.
    let scenario = named("faults");
    let (world, mut observer) = after(&scenario, 701);
    let mut displaced = world.clone();
    displaced.surface_craft.as_mut().expect("has one").state[1] += 300.0;
    assert_eq!(
        look(&world, &mut observer.clone()).asc.position(),
        look(&displaced, &mut observer).asc.position()
    );
}

#[test]
fn every_law_gets_the_same_errors() {
    // Two laws steer differently; the errors of the craft's sensors, measurement less truth, are
    // equal. (Which messages arrive depends on the range, and so on the law.)
    let scenario = named("rough-water").lasting(300.0);
    let errors = |guide: &mut dyn Guide| {
        let record = run(&scenario, guide, 4, &mut |_| {}).expect("runs");
        let rows = record.rows.into_iter().filter_map(|row| row.surface_craft);
        let errors = rows.map(|craft| {
            let position = craft.known.position - craft.position;
            [
                position.x,
                position.y,
                planner::angle::wrap(craft.known.heading.radians() - craft.heading),
                craft.known.surge - craft.surge,
            ]
        });
        errors.collect::<Vec<_>>()
    };
    for (los, mpc) in errors(&mut los()).into_iter().zip(errors(&mut mpc())) {
        for (a, b) in los.into_iter().zip(mpc) {
            // The errors are added to different positions, so the rounding differs.
            assert!((a - b).abs() < 1e-9, "{a} and {b}");
        }
    }
}
