//! Line-of-sight gains tuned for a scenario, so that the planner is compared with no straw man.

use planner::los::LosGains;

use crate::{
    guide::{GuideError, LosGuide},
    metrics::Metrics,
    mission::run,
    scenario::Scenario,
};

/// Look-ahead distances tried, m.
pub const LOOK_AHEADS: [f64; 4] = [3.0, 5.0, 10.0, 20.0];
/// Along-track gains tried, 1/s.
pub const ALONG_TRACK_GAINS: [f64; 4] = [0.05, 0.1, 0.15, 0.3];

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

/// The gains of the grid with the least root mean square distance to the goal over the whole mission,
/// and what they achieve. Of equals the first counts. `progress` is told the fraction done.
pub fn tune_los(
    scenario: &Scenario,
    seed: u64,
    progress: &mut dyn FnMut(f64),
) -> Result<(LosGains, Metrics), TuningError> {
    let grid: Vec<LosGains> = LOOK_AHEADS
        .iter()
        .flat_map(|&look_ahead| {
            ALONG_TRACK_GAINS.map(|along_track_gain| LosGains {
                look_ahead,
                along_track_gain,
            })
        })
        .collect();
    let no_surface_craft = || TuningError::NoSurfaceCraft {
        scenario: scenario.name.clone(),
    };
    let mut best: Option<(f64, LosGains, Metrics)> = None;
    let share = 1.0 / f64::from(u32::try_from(grid.len()).expect("a grid of sixteen"));
    let mut done = 0.0;
    for gains in grid {
        let record = run(scenario, &mut LosGuide::new(gains), seed, &mut |part| {
            progress(done + part * share);
        })
        .map_err(TuningError::Mission)?;
        done += share;
        let metrics = Metrics::of(&record);
        let rms = metrics.surface_craft.as_ref().ok_or_else(no_surface_craft)?.rms_m;
        if best.as_ref().is_none_or(|(least, ..)| rms < *least) {
            best = Some((rms, gains, metrics));
        }
    }
    best.map(|(_, gains, metrics)| (gains, metrics))
        .ok_or_else(no_surface_craft)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_gains_of_the_grid_beat_the_tuned_ones() {
        let scenario = Scenario::named("paper-tracking").expect("exists").lasting(120.0);
        let (tuned, metrics) = tune_los(&scenario, 1, &mut |_| {}).expect("tunes");
        let least = metrics.surface_craft.expect("has one").rms_m;
        let mut met = 0;
        for look_ahead in LOOK_AHEADS {
            for along_track_gain in ALONG_TRACK_GAINS {
                let gains = LosGains {
                    look_ahead,
                    along_track_gain,
                };
                let record = run(&scenario, &mut LosGuide::new(gains), 1, &mut |_| {}).expect("runs");
                let rms = Metrics::of(&record).surface_craft.expect("has one").rms_m;
                assert!(least <= rms);
                met += usize::from(gains == tuned && (rms - least).abs() < f64::EPSILON);
            }
        }
        assert_eq!(met, 1);
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
