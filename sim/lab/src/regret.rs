//! How much nearer to its goal the surface craft could have stayed, had it known the whole future.

use nalgebra::Vector2;
use planner::{
    angle::ned_from_body,
    clairvoyant::{ClairvoyantError, Pursuit, clairvoyant},
};

use sim::record::{Record, SurfaceCraftRow};

/// A mission beside the best that its plant allows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Regret {
    /// Root mean square distance to the goal over the whole mission that no craft of this plant, from this
    /// start and in the recorded current, can come below, m.
    pub(crate) bound_rms_m: f64,
    /// Root mean square distance less that bound, m.
    pub(crate) regret_m: f64,
}

/// The regret of `record`; none where there is no surface craft or its plant is not known.
///
/// Solves a program of as many ticks as there are rows: not for every run of a search.
pub(crate) fn regret(record: &Record) -> Result<Option<Regret>, ClairvoyantError> {
    let crafts: Option<Vec<&SurfaceCraftRow>> =
        record.rows.iter().map(|row| row.surface_craft.as_ref()).collect();
    let (Some(crafts), Some(plant)) = (crafts, record.plant) else {
        return Ok(None);
    };
    let Some(first) = crafts.first() else {
        return Ok(None);
    };
    let least = clairvoyant(&Pursuit {
        start: first.position,
        start_velocity: ned_from_body(first.heading) * Vector2::new(first.surge, first.sway),
        goal: crafts.iter().map(|craft| craft.goal).collect(),
        current: crafts.iter().map(|craft| craft.current).collect(),
        interval: record.interval,
        speed_max: plant.speed_max,
        acceleration_max: plant.acceleration_max,
    })?;
    #[expect(
        clippy::cast_precision_loss,
        reason = "a mission has thousands of rows, not 2⁵³"
    )]
    let n = crafts.len() as f64;
    let mean_square = crafts.iter().map(|craft| craft.distance().powi(2)).sum::<f64>() / n;
    let bound_rms_m = least.mean_square.sqrt();
    Ok(Some(Regret {
        bound_rms_m,
        regret_m: mean_square.sqrt() - bound_rms_m,
    }))
}

#[cfg(test)]
mod tests {
    use planner::policy::Policy;

    use super::*;
    use sim::{
        guide::{Guide, LosGuide, MpcGuide},
        mission::run,
        scenario::Scenario,
    };

    fn flown(scenario: &Scenario, guide: &mut dyn Guide, seed: u64) -> Record {
        run(scenario, guide, seed, &mut |_| {}).expect("runs")
    }

    fn los() -> LosGuide {
        LosGuide::new(Policy::default().los)
    }

    fn short(name: &str) -> Scenario {
        Scenario::named(name).expect("exists").lasting(90.0)
    }

    #[test]
    fn no_run_is_better_than_its_bound() {
        for name in Scenario::names() {
            let scenario = short(name);
            if !scenario.has_surface_craft() || scenario.water.waves.is_some() {
                continue;
            }
            let guides: [&mut dyn Guide; 2] = [&mut los(), &mut MpcGuide::new(Policy::default())];
            for guide in guides {
                let record = flown(&scenario, guide, 2);
                let found = regret(&record).expect("solves").expect("has a craft and a plant");
                assert!(
                    0.0 <= found.regret_m && 0.0 <= found.bound_rms_m,
                    "{name}: {found:?}"
                );
            }
        }
    }

    #[test]
    fn the_bound_of_a_run_is_what_its_limits_leave_of_the_start() {
        // The goal is put where it was not, out of reach and at rest: straight ahead at top speed is best.
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
        let found = regret(&record).expect("solves").expect("has a craft and a plant");
        // Within its first second this craft can be at its top speed.
        assert!(
            (found.bound_rms_m / mean.sqrt() - 1.0).abs() < 1e-6,
            "{found:?} and {mean}"
        );
    }

    #[test]
    fn without_a_craft_or_its_plant_there_is_no_regret() {
        let alone = flown(&short("paper-path-following"), &mut los(), 1);
        assert_eq!(regret(&alone), Ok(None));
        let record = flown(&short("paper-tracking"), &mut los(), 1);
        assert_eq!(
            regret(&Record {
                plant: None,
                ..record.clone()
            }),
            Ok(None)
        );
        assert_eq!(
            regret(&Record {
                rows: vec![],
                ..record
            }),
            Ok(None)
        );
    }
}
