//! A lower bound on a recorded surface craft's distance to its goal, with the future known.

use nalgebra::Vector2;
use planner::angle::ned_from_body;
use sim::record::{Record, Row, SurfaceCraftRow};

use crate::clairvoyant::{Pursuit, clairvoyant};

/// Lower bound of the root mean square distance to the goal over the whole mission, m, for this
/// plant, start and recorded current. `None` without a surface craft or its plant, for several,
/// and for a goal that visits: its guide chooses where to go. A program with a stage per row: slow.
pub(crate) fn bound_rms_m(record: &Record) -> Option<f64> {
    let visits = |row: &Row| row.auvs.iter().any(|auv| auv.service.is_some());
    if record.rows.iter().any(visits) || !record.fleet.is_empty() {
        return None;
    }
    let crafts: Vec<&SurfaceCraftRow> = record.surface_craft_rows().map(|(_, craft)| craft).collect();
    let plant = record.plant?;
    let first = crafts.first()?;
    let least = clairvoyant(&Pursuit {
        start: first.position,
        start_velocity: ned_from_body(first.heading) * Vector2::new(first.surge, first.sway),
        goal: crafts.iter().map(|craft| craft.goal).collect(),
        current: crafts.iter().map(|craft| craft.current).collect(),
        interval: record.interval,
        speed_max: plant.speed_max,
        acceleration_max: plant.acceleration_max,
    })?;
    Some(least.mean_square.sqrt())
}

#[cfg(test)]
mod tests {
    use planner::parameters::Parameters;

    use super::*;
    use crate::scores::Scores;
    use sim::guide::{Guide, LosGuide, MpcGuide};
    use sim::mission::run;
    use sim::scenario::Scenario;

    fn flown(scenario: &Scenario, guide: &mut dyn Guide, seed: u64) -> Record {
        run(scenario, guide, seed, &mut |_| {}).expect("runs")
    }

    fn los() -> LosGuide {
        LosGuide::new(Parameters::default().los)
    }

    fn short(name: &str) -> Scenario {
        Scenario::named(name).expect("exists").lasting(90.0)
    }

    #[test]
    fn no_run_is_better_than_its_bound() {
        for name in Scenario::names() {
            let scenario = short(name);
            if !scenario.has_surface_craft()
                || scenario.water.waves.is_some()
                || name.starts_with("visit")
                || scenario.has_fleet()
            {
                continue;
            }
            let guides: [&mut dyn Guide; 2] = [&mut los(), &mut MpcGuide::new(Parameters::default())];
            for guide in guides {
                let record = flown(&scenario, guide, 2);
                let scores = Scores::of(&record).expect("has a craft");
                let regret = scores.regret_m.expect("has a plant");
                assert!(0.0 <= regret, "{name}: {scores:?}");
            }
        }
    }

    #[test]
    fn the_bound_of_a_run_follows_from_its_start_and_limits() {
        // The goal is moved out of reach and at rest: straight ahead at top speed is best.
        let mut record = flown(&short("cross-current"), &mut los(), 1);
        let plant = record.plant.expect("calm water");
        let start = record.rows[0].surface_craft.expect("has one");
        let away = 1000.0;
        for (row, k) in record.rows.iter_mut().zip(0_u32..) {
            let craft = row.surface_craft.as_mut().expect("has one");
            // It drifts with the water, so that the current does not matter.
            craft.goal = start.position + Vector2::new(away, 0.0) + start.current * f64::from(k);
        }
        let fastest = |k: u32| away - plant.speed_max * f64::from(k);
        let mean: f64 = (0..90).map(|k| fastest(k).powi(2)).sum::<f64>() / 90.0;
        assert_eq!(record.rows.len(), 90);
        let bound = bound_rms_m(&record).expect("has a craft and a plant");
        // Within its first second this craft can be at its top speed.
        assert!((bound / mean.sqrt() - 1.0).abs() < 1e-6, "{bound} and {mean}");
    }

    #[test]
    fn without_a_craft_or_its_plant_there_is_no_bound() {
        let alone = flown(&short("paper-path-following"), &mut los(), 1);
        assert_eq!(bound_rms_m(&alone), None);
        let mut record = flown(&short("paper-tracking"), &mut los(), 1);
        let plant = record.plant.take();
        assert_eq!(bound_rms_m(&record), None);
        (record.plant, record.rows) = (plant, vec![]);
        assert_eq!(bound_rms_m(&record), None);
    }
}
