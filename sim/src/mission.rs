//! A whole mission: observe, ask the guide, hold its reference for a second, and again.

use nalgebra::Vector2;
use planner::{
    angle::wrap,
    snapshot::{Goal, VehicleId},
};

use crate::{
    guide::{Guidance, Guide, GuideError},
    observe::observe,
    record::{Bounds, DiverReference, DiverRow, KnownSurfaceCraft, Record, Row, SurfaceCraftRow},
    scenario::{Scenario, SurfaceCraftSetup},
    world::{Diver, SurfaceCraft, World},
};

/// Inner-loop periods between two looks at the guide: it plans once a second.
const PERIODS_PER_PLAN: u32 = 10;
/// Time between two looks at the guide, s.
const PLAN_INTERVAL: f64 = 1.0;

/// Runs `scenario` from the start that `seed` gives to its end. `progress` is told the fraction done.
///
/// Without a surface craft the guide is never asked. An error is the guide's own, or an observation
/// that left the range of a snapshot.
pub fn run(
    scenario: &Scenario,
    guide: &mut dyn Guide,
    seed: u64,
    progress: &mut dyn FnMut(f64),
) -> Result<Record, GuideError> {
    let mut world = scenario.world(seed);
    let n_plans = whole_plans(scenario.duration);
    let mut rows = Vec::new();
    for k in 0..n_plans {
        let time = f64::from(k) * PLAN_INTERVAL;
        let divers = world
            .divers
            .iter()
            .map(|diver| diver_row(diver, &world.current))
            .collect();
        let surface_craft = match (&scenario.surface_craft, &world.surface_craft) {
            (Some(setup), Some(craft)) => {
                let guidance = guide.guide(&observe(&world, craft, setup, time)?)?;
                Some(surface_craft_row(&world, craft, setup, time, guidance))
            }
            _ => None,
        };
        for _ in 0..PERIODS_PER_PLAN {
            world.step(surface_craft.as_ref().map(|row| &row.reference));
        }
        rows.push(Row {
            time,
            surface_craft,
            divers,
        });
        progress(f64::from(k + 1) / f64::from(n_plans));
    }
    Ok(Record {
        scenario: scenario.name.to_owned(),
        title: scenario.title.to_owned(),
        guide: String::new(),
        seed,
        interval: PLAN_INTERVAL,
        origin: None,
        bounds: Bounds::default(),
        paths: vec![],
        diver_ids: scenario.divers.iter().map(|setup| setup.id.to_string()).collect(),
        settled_after: scenario.settled_after,
        contact_range: scenario.surface_craft.as_ref().map(|setup| setup.contact_range),
        limits: scenario.surface_craft.as_ref().map(SurfaceCraftSetup::limits),
        rows,
    })
}

#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a scenario lasts hours at most, and the cast saturates"
)]
fn whole_plans(duration: f64) -> u32 {
    (duration / PLAN_INTERVAL) as u32
}

fn surface_craft_row(
    world: &World,
    craft: &SurfaceCraft,
    setup: &SurfaceCraftSetup,
    time: f64,
    guidance: Guidance,
) -> SurfaceCraftRow {
    SurfaceCraftRow {
        position: craft.position(),
        heading: wrap(craft.state[2]),
        surge: craft.state[3],
        sway: craft.state[4],
        yaw_rate: craft.state[5],
        thrust_port: 0.0,
        thrust_starboard: 0.0,
        current: world.current,
        known: KnownSurfaceCraft {
            time,
            position: craft.position(),
            heading: planner::angle::Heading::new(craft.state[2]),
            surge: craft.state[3],
            current: Some(world.current),
        },
        predicted_rms: None,
        solve_ms: None,
        reference: guidance.reference,
        method: guidance.method,
        goal: goal_position(&setup.goal, &world.divers, time),
        energy: craft.energy,
        heading_travel: craft.heading_travel,
    }
}

fn diver_row(diver: &Diver, current: &Vector2<f64>) -> DiverRow {
    let error = diver.path_error();
    DiverRow {
        position: diver.position(),
        depth: diver.depth(),
        pitch: diver.pitch(),
        heading: wrap(diver.heading()),
        surge: diver.state[5],
        current: *current,
        reference: DiverReference {
            surge: diver.speed,
            pitch: diver.leg.pitch(&diver.dive),
            heading: 0.0,
        },
        path_point: diver.path.at(diver.gamma).position,
        known: None,
        along_track: error.s_1,
        cross_track: error.y_1,
    }
}

/// Where the goal truly is (north, east), m: from positions alone, whatever the guide knows.
fn goal_position(goal: &Goal, divers: &[Diver], time: f64) -> Vector2<f64> {
    let position = |id: &VehicleId| {
        divers
            .iter()
            .find(|diver| diver.id == *id)
            .map(Diver::position)
            .expect("a scenario's goal names its own vehicles")
    };
    match goal {
        Goal::Track { auv } => position(auv),
        Goal::Intermittent { auvs, dwell, epoch } => {
            position(&auvs[in_turn(time - epoch, *dwell, auvs.len())])
        }
        Goal::Midpoint { auvs } => {
            let sum: Vector2<f64> = auvs.iter().map(position).sum();
            #[expect(clippy::cast_precision_loss, reason = "a handful of vehicles")]
            let n = auvs.len() as f64;
            sum / n
        }
    }
}

/// Whose turn it is `elapsed` s after the epoch: half-open intervals [k T, (k + 1) T), in turn.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_possible_wrap,
    reason = "a mission has few dwells, and rem_euclid is never negative"
)]
fn in_turn(elapsed: f64, dwell: f64, n: usize) -> usize {
    ((elapsed / dwell).floor() as i64).rem_euclid(n as i64) as usize
}

#[cfg(test)]
mod tests {
    use planner::{los::LosGains, policy::Policy};

    use super::*;
    use crate::guide::{LosGuide, MpcGuide};

    fn record(scenario: &Scenario, guide: &mut dyn Guide, seed: u64) -> Record {
        run(scenario, guide, seed, &mut |_| {}).expect("runs")
    }

    fn short(name: &str) -> Scenario {
        Scenario {
            duration: 60.0,
            ..Scenario::named(name).expect("exists")
        }
    }

    #[test]
    fn the_same_seed_gives_the_same_bytes() {
        let los = || {
            LosGuide::new(LosGains {
                look_ahead: 10.0,
                along_track_gain: 0.15,
            })
        };
        let mpc = || MpcGuide::new(Policy::default());
        for name in Scenario::names() {
            let scenario = short(name);
            let first = record(&scenario, &mut los(), 3);
            assert_eq!(first, record(&scenario, &mut los(), 3), "{name}");
            assert_ne!(first, record(&scenario, &mut los(), 4), "{name}");
            assert_eq!(
                record(&scenario, &mut mpc(), 3),
                record(&scenario, &mut mpc(), 3),
                "{name}"
            );
        }
    }

    #[test]
    fn the_goal_changes_hands_at_the_dwell_and_not_after_it() {
        assert_eq!(
            [0.0, 239.9, 240.0, 479.9, 480.0].map(|t| in_turn(t, 240.0, 2)),
            [0, 0, 1, 1, 0]
        );
    }

    #[test]
    fn progress_ends_at_one_and_never_falls() {
        let mut seen = vec![];
        let mut guide = LosGuide::new(LosGains {
            look_ahead: 10.0,
            along_track_gain: 0.15,
        });
        run(&short("paper-tracking"), &mut guide, 0, &mut |done| {
            seen.push(done);
        })
        .expect("runs");
        assert!(seen.is_sorted());
        assert_eq!(seen.last(), Some(&1.0));
    }

    #[test]
    fn a_guide_that_fails_ends_the_mission_with_its_error() {
        struct Broken;
        impl Guide for Broken {
            fn guide(&mut self, _: &planner::snapshot::Snapshot) -> Result<Guidance, GuideError> {
                Err("the line is dead".into())
            }
        }
        let error = run(&short("paper-tracking"), &mut Broken, 0, &mut |_| {}).expect_err("fails");
        assert_eq!(error.to_string(), "the line is dead");
    }
}
