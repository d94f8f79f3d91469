//! The planner notices an actuator without effect, and only that.

use pilotfish_sim::guide::Guide;
use pilotfish_sim::mission::Mission;
use pilotfish_sim::scenario::{RandomCraftFile, Scenario, SurfaceClassFile};
use pilotfish_sim::world::fault::{Fault, FaultKind};
use planner::{angle::wrap, craft::CraftDescription, path::Side, snapshot::DeclaredLimits};

use crate::{mpc, named};

/// Alarms of the planner in a mission.
#[derive(Debug, Default)]
struct Noticed {
    /// There was an alarm that references have no effect.
    alarmed: bool,
    /// Time from the breakdown to the first reference 0.3 rad and 0.2 m/s away, s.
    asked: [Option<f64>; 2],
    /// Time from the breakdown to the alarm that the craft does not follow, s.
    follows_not: Option<f64>,
}

/// `scenario` with the faults `broken` from `at` s on.
fn flown(scenario: &Scenario, broken: &[FaultKind], at: f64) -> Noticed {
    let mut guide = mpc();
    let mut start = scenario.start(1).expect("starts");
    start.world.faults.0.extend(broken.iter().map(|what| Fault {
        from: at,
        until: f64::INFINITY,
        what: *what,
    }));
    let mut mission = Mission::from_start(start, scenario, guide.name(), 1);
    let mut noticed = Noticed::default();
    while !mission.is_over() {
        let since = mission.time() - at;
        let snapshot = mission.observe().expect("is in range").expect("has a craft");
        let guidance = guide.guide(&snapshot).expect("answers");
        let known = guide.craft_estimate().expect("has planned");
        let alarms =
            [known.heading_effect.is_missing(), known.speed_effect.is_missing(), known.monitor.alarm];
        noticed.alarmed |= alarms[0] || alarms[1];
        let (_, plan) = guide.planned().expect("has planned");
        let asked = plan.reference_through_water;
        if since >= 0.0 {
            let away = [
                wrap(asked.heading.radians() - snapshot.asc.heading_rad).abs() > 0.3,
                (asked.speed - snapshot.asc.speed_mps).abs() > 0.2,
            ];
            let begin = |first: &mut Option<f64>, is: bool| *first = first.or(is.then_some(since));
            (noticed.asked.iter_mut().zip(away)).for_each(|(first, is)| begin(first, is));
            begin(&mut noticed.follows_not, alarms[2]);
        }
        mission.step(Some((&snapshot, guidance)));
    }
    noticed
}

/// A scenario for `seconds` with another craft, declared or not.
fn with_craft(name: &str, class: SurfaceClassFile, declared: bool, seconds: f64) -> Scenario {
    let mut scenario = named(name);
    let craft = scenario.surface_craft.first_mut().expect("has one");
    craft.class = class;
    craft.limits = DeclaredLimits::default();
    craft.craft = (!declared).then(CraftDescription::default);
    scenario.lasting(seconds)
}

fn random(seed: u64) -> SurfaceClassFile {
    SurfaceClassFile::Random(RandomCraftFile { seed: Some(seed), ..RandomCraftFile::default() })
}

/// MEDUSA, Otter and `n` random craft, or as many as the variable `CRAFT` says, to measure rates.
fn classes(n: u64) -> impl Iterator<Item = SurfaceClassFile> {
    let n = std::env::var("CRAFT").map_or(n, |craft| craft.parse().expect("a number"));
    [SurfaceClassFile::Medusa, SurfaceClassFile::Otter].into_iter().chain((1..=n).map(random))
}

#[test]
fn working_craft_raise_no_alarm() {
    let (mut flights, mut alarmed) = (0, vec![]);
    for name in ["about-face", "switching", "rough-water"] {
        for class in classes(1) {
            for declared in [true, false] {
                let scenario = with_craft(name, class.clone(), declared, 240.0);
                flights += 1;
                if flown(&scenario, &[], f64::INFINITY).alarmed {
                    alarmed.push((name, class.clone(), declared));
                }
            }
        }
    }
    assert!(20 * alarmed.len() < flights, "{alarmed:?} of {flights}");
}

#[test]
fn a_broken_actuator_is_noticed_soon_after_its_next_use() {
    let dead = [Side::Port, Side::Starboard].map(|side| FaultKind::Thruster { side, share: 0.0 });
    let jammed = [FaultKind::RudderStuck(0.0)];
    for (loop_, broken) in [&jammed[..], &dead].into_iter().enumerate() {
        let (mut flights, mut late) = (0, vec![]);
        for class in classes(2) {
            for declared in [true, false] {
                // The next AUV is followed from 480 s on.
                let scenario = with_craft("switching", class.clone(), declared, 540.0);
                let noticed = flown(&scenario, broken, 470.0);
                let asked = noticed.asked[loop_].expect("the next AUV is elsewhere");
                flights += 1;
                if noticed.follows_not.is_none_or(|at| at - asked > 12.0) {
                    late.push((class.clone(), declared, noticed));
                }
            }
        }
        // An undeclared Otter looks like a slow craft that has begun to turn.
        assert!(6 * late.len() <= flights, "{broken:?}: {late:?} of {flights}");
    }
}
