//! Line-of-sight laws tuned for a scenario, so that the planner is compared with strong laws.

use planner::{
    los::{LawGains, LosGains, LosLaw, LosTuning},
    parameters::Parameters,
};
use serde::{Deserialize, Serialize};
use sim::{
    guide::{GuideError, LosGuide},
    metrics::{Metrics, SurfaceCraftMetrics},
    mission::run,
    scenario::Scenario,
};

/// Look-ahead distances tried, m.
const LOOK_AHEADS: [f64; 5] = [1.0, 3.0, 5.0, 10.0, 20.0];
/// Along-track gains tried, 1/s.
const ALONG_TRACK_GAINS: [f64; 5] = [0.05, 0.1, 0.15, 0.3, 0.6];
/// Integral gains tried, m/s: behind an AUV at 0.193 m/s they damp the cross-track error by 2.2, 1.3 and 0.7.
const INTEGRAL_GAINS: [f64; 3] = [0.01, 0.03, 0.1];

/// A point of a grid.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Setting {
    /// Gains of a law.
    pub gains: Option<LawGains>,
    /// Time of a rule's turn, or of its stay beyond the goal's least time, s.
    pub dwell_s: Option<f64>,
}

impl Setting {
    /// All gains with all times; of either one none is one.
    #[must_use]
    pub fn grid(laws: &[LosTuning], dwells: &[f64]) -> Vec<Self> {
        fn some_or_none<T>(all: impl Iterator<Item = T>) -> Vec<Option<T>> {
            let all: Vec<_> = all.map(Some).collect();
            if all.is_empty() { vec![None] } else { all }
        }
        let laws = some_or_none(laws.iter().copied().map(LawGains::from));
        let dwells = some_or_none(dwells.iter().copied());
        let with = |gains: &Option<LawGains>| {
            let gains = *gains;
            dwells.iter().map(move |dwell_s| Self {
                gains,
                dwell_s: *dwell_s,
            })
        };
        laws.iter().flat_map(with).collect()
    }
}

/// `law` with these gains, and the planner's default integral gain if they have none.
pub(crate) fn tuned(law: LosLaw, gains: LawGains) -> LosTuning {
    gains.tuning(law, Parameters::default().integral_gain)
}

/// Why missions that are compared gave no result.
#[derive(Debug, thiserror::Error)]
pub enum ComparisonError {
    /// There is nothing to guide.
    #[error(
        "scenario {0} has no surface craft, so there is nothing to compare; `pilotfish simulate {0}` runs it"
    )]
    NoSurfaceCraft(String),
    /// A mission of a scenario failed.
    #[error("a mission of scenario {0} failed")]
    Mission(String, #[source] GuideError),
}

impl ComparisonError {
    pub(crate) fn no_surface_craft(scenario: &Scenario) -> Self {
        Self::NoSurfaceCraft(scenario.name.clone())
    }

    pub(crate) fn mission(scenario: &Scenario) -> impl Fn(GuideError) -> Self {
        |error| Self::Mission(scenario.name.clone(), error)
    }
}

/// The grid of `law`: look-aheads times along-track gains, and times integral gains for [`LosLaw::Integral`].
#[must_use]
pub fn grid(law: LosLaw) -> Vec<LosTuning> {
    let default = [Parameters::default().integral_gain];
    let integral_gains: &[f64] = match law {
        LosLaw::Integral => &INTEGRAL_GAINS,
        LosLaw::SaturatedLos | LosLaw::TrackerFrame | LosLaw::WaypointBox => &default,
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

/// The tuning of the law's grid with the least root mean square distance to the goal over the whole mission,
/// and what it achieves. Of equals the first counts. `progress` gets the fraction done.
pub fn tune(
    law: LosLaw,
    scenario: &Scenario,
    seed: u64,
    progress: &mut dyn FnMut(f64),
) -> Result<(LosTuning, SurfaceCraftMetrics), ComparisonError> {
    let grid = grid(law);
    let mut best: Option<(LosTuning, SurfaceCraftMetrics)> = None;
    let share = 1.0 / f64::from(u32::try_from(grid.len()).expect("a grid of dozens"));
    let mut done = 0.0;
    for tuning in grid {
        let record = run(scenario, &mut LosGuide::tuned(tuning), seed, &mut |part| {
            progress(done + part * share);
        })
        .map_err(ComparisonError::mission(scenario))?;
        done += share;
        let metrics = Metrics::of(&record).surface_craft;
        let metrics = metrics.ok_or_else(|| ComparisonError::no_surface_craft(scenario))?;
        if best.as_ref().is_none_or(|(_, least)| metrics.rms_m < least.rms_m) {
            best = Some((tuning, metrics));
        }
    }
    Ok(best.expect("a grid has points"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_gains_of_the_grid_beat_the_tuned_ones() {
        let scenario = Scenario::named("paper-tracking").expect("exists").lasting(120.0);
        for law in LosLaw::ALL {
            let (tuned, metrics) = tune(law, &scenario, 1, &mut |_| {}).expect("tunes");
            let mut met = 0;
            for tuning in grid(law) {
                let record = run(&scenario, &mut LosGuide::tuned(tuning), 1, &mut |_| {}).expect("runs");
                let other = Metrics::of(&record).surface_craft.expect("has one").rms_m;
                assert!(metrics.rms_m <= other, "{tuning:?}");
                met += usize::from(tuning == tuned && (other - metrics.rms_m).abs() < f64::EPSILON);
            }
            assert_eq!(met, 1, "{law:?}");
        }
    }

    #[test]
    fn tuned_each_law_keeps_to_its_target() {
        let scenario = Scenario::named("paper-tracking").expect("exists").lasting(600.0);
        let worst = |law| tune(law, &scenario, 1, &mut |_| {}).expect("tunes").1.rms_m;
        for law in [LosLaw::SaturatedLos, LosLaw::TrackerFrame, LosLaw::Integral] {
            // Most of it is the approach from 17 m off.
            assert!(worst(law) < 2.5, "{law:?}: {}", worst(law));
        }
        // Half the box's diagonal, and as much as the target moves on from it.
        let round_the_box = worst(LosLaw::WaypointBox);
        assert!((15.0..70.0).contains(&round_the_box), "{round_the_box}");
    }

    #[test]
    fn a_scenario_without_a_surface_craft_is_refused() {
        let scenario = Scenario::named("paper-path-following")
            .expect("exists")
            .lasting(10.0);
        let refused = tune(LosLaw::SaturatedLos, &scenario, 0, &mut |_| {});
        assert!(matches!(refused, Err(ComparisonError::NoSurfaceCraft(_))));
    }
}
