//! Line-of-sight laws tuned for a scenario, so that the planner is compared with no straw man.

use planner::{
    los::{LosGains, LosLaw, LosTuning},
    policy::Policy,
};

use sim::{
    guide::{GuideError, LosGuide},
    metrics::Metrics,
    mission::run,
    scenario::Scenario,
};

/// Look-ahead distances tried, m.
const LOOK_AHEADS: [f64; 5] = [1.0, 3.0, 5.0, 10.0, 20.0];
/// Along-track gains tried, 1/s.
const ALONG_TRACK_GAINS: [f64; 5] = [0.05, 0.1, 0.15, 0.3, 0.6];
/// Integral gains tried, m/s: behind an AUV at 0.193 m/s they damp the cross-track error by 2.2, 1.3 and 0.7.
const INTEGRAL_GAINS: [f64; 3] = [0.01, 0.03, 0.1];

/// Why a law could not be tuned.
#[derive(Debug, thiserror::Error)]
pub enum TuningError {
    /// There is nothing to tune for.
    #[error("scenario {scenario} has no surface craft to guide")]
    NoSurfaceCraft {
        /// The scenario's name.
        scenario: String,
    },
    /// A mission failed.
    #[error("a mission of the grid failed")]
    Mission(#[source] GuideError),
}

/// The tunings of `law` that are tried: look-aheads times along-track gains, and times integral gains for
/// [`LosLaw::Integral`].
#[must_use]
pub fn grid(law: LosLaw) -> Vec<LosTuning> {
    let default = [Policy::default().integral_gain];
    let integral_gains: &[f64] = match law {
        LosLaw::Integral => &INTEGRAL_GAINS,
        LosLaw::SaturatedLos | LosLaw::TrackerFrame | LosLaw::WaypointBox | LosLaw::Printed => &default,
    };
    let mut grid = vec![];
    for &integral_gain in integral_gains {
        for look_ahead in LOOK_AHEADS {
            for along_track_gain in ALONG_TRACK_GAINS {
                grid.push(LosTuning {
                    law,
                    gains: LosGains {
                        look_ahead,
                        along_track_gain,
                    },
                    integral_gain,
                });
            }
        }
    }
    grid
}

/// [`tune`] for the saturated law.
pub fn tune_los(
    scenario: &Scenario,
    seed: u64,
    progress: &mut dyn FnMut(f64),
) -> Result<(LosGains, Metrics), TuningError> {
    let (tuning, metrics) = tune(LosLaw::SaturatedLos, scenario, seed, progress)?;
    Ok((tuning.gains, metrics))
}

/// The tuning of the law's grid with the least root mean square distance to the goal over the whole mission,
/// and what it achieves. Of equals the first counts. `progress` gets the fraction done.
pub fn tune(
    law: LosLaw,
    scenario: &Scenario,
    seed: u64,
    progress: &mut dyn FnMut(f64),
) -> Result<(LosTuning, Metrics), TuningError> {
    let grid = grid(law);
    let no_surface_craft = || TuningError::NoSurfaceCraft {
        scenario: scenario.name.clone(),
    };
    let mut best: Option<(f64, LosTuning, Metrics)> = None;
    let share = 1.0 / f64::from(u32::try_from(grid.len()).expect("a grid of dozens"));
    let mut done = 0.0;
    for tuning in grid {
        let record = run(scenario, &mut LosGuide::tuned(tuning), seed, &mut |part| {
            progress(done + part * share);
        })
        .map_err(TuningError::Mission)?;
        done += share;
        let metrics = Metrics::of(&record);
        let rms = metrics.surface_craft.as_ref().ok_or_else(no_surface_craft)?.rms_m;
        if best.as_ref().is_none_or(|(least, ..)| rms < *least) {
            best = Some((rms, tuning, metrics));
        }
    }
    best.map(|(_, tuning, metrics)| (tuning, metrics))
        .ok_or_else(no_surface_craft)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rms(metrics: &Metrics) -> f64 {
        metrics.surface_craft.as_ref().expect("has one").rms_m
    }

    #[test]
    fn no_gains_of_the_grid_beat_the_tuned_ones() {
        let scenario = Scenario::named("paper-tracking").expect("exists").lasting(120.0);
        for law in LosLaw::ALL {
            let (tuned, metrics) = tune(law, &scenario, 1, &mut |_| {}).expect("tunes");
            let mut met = 0;
            for tuning in grid(law) {
                let record = run(&scenario, &mut LosGuide::tuned(tuning), 1, &mut |_| {}).expect("runs");
                let other = rms(&Metrics::of(&record));
                assert!(rms(&metrics) <= other, "{tuning:?}");
                met += usize::from(tuning == tuned && (other - rms(&metrics)).abs() < f64::EPSILON);
            }
            assert_eq!(met, 1, "{law:?}");
        }
    }

    #[test]
    fn tuned_each_law_keeps_to_its_target_but_the_printed_one() {
        let scenario = Scenario::named("paper-tracking").expect("exists").lasting(600.0);
        let worst = |law| rms(&tune(law, &scenario, 1, &mut |_| {}).expect("tunes").1);
        for law in [LosLaw::SaturatedLos, LosLaw::TrackerFrame, LosLaw::Integral] {
            // Most of it is the approach from 17 m off.
            assert!(worst(law) < 2.5, "{law:?}: {}", worst(law));
        }
        // Half the box's diagonal, and as much as the target moves on from it.
        let round_the_box = worst(LosLaw::WaypointBox);
        assert!((15.0..70.0).contains(&round_the_box), "{round_the_box}");
        assert!(worst(LosLaw::Printed) > 40.0, "{}", worst(LosLaw::Printed));
    }

    #[test]
    fn a_scenario_without_a_surface_craft_is_refused() {
        let scenario = Scenario::named("paper-path-following")
            .expect("exists")
            .lasting(10.0);
        let refused = tune_los(&scenario, 0, &mut |_| {});
        assert!(matches!(refused, Err(TuningError::NoSurfaceCraft { .. })));
    }
}
