//! The missions behind the figures.

use crate::tuning::{ComparisonError, tune};
use planner::{los::LosLaw, parameters::Parameters};
use sim::{
    guide::{LosGuide, MpcGuide},
    mission,
    record::Record,
    scenario::Scenario,
};

/// The missions behind the figures.
#[derive(Clone, Debug, PartialEq)]
pub struct PaperMissions {
    /// One underwater vehicle on its path: Figs. 3 to 6.
    pub path_following: Record,
    /// The surface craft above one underwater vehicle: Figs. 8 to 10.
    pub tracking: Both,
    /// Two underwater vehicles in turn: Fig. 14.
    pub intermittent: Both,
    /// The midpoint of two underwater vehicles: Fig. 15.
    pub midpoint: Both,
}

/// The same scenario and seed under both controllers.
#[derive(Clone, Debug, PartialEq)]
pub struct Both {
    /// Guided by the planner.
    pub planner: Record,
    /// Guided by the line-of-sight law with gains tuned for this scenario and seed.
    pub line_of_sight: Record,
}

impl PaperMissions {
    /// Flies them all, each for `duration_max` s at most. `progress` gets the scenario and the fraction of it
    /// done.
    pub fn fly(
        seed: u64,
        duration_max: f64,
        progress: &mut dyn FnMut(&'static str, f64),
    ) -> Result<Self, ComparisonError> {
        let mut both = |name| fly_both(name, seed, duration_max, &mut |done| progress(name, done));
        let [tracking, intermittent, midpoint] =
            ["paper-tracking", "paper-intermittent", "paper-midpoint"].map(&mut both);
        let alone = "paper-path-following";
        // Without a surface craft, the guide is never called.
        let mut guide = LosGuide::new(Parameters::default().los);
        let scenario = scenario(alone, duration_max);
        let path_following = mission::run(&scenario, &mut guide, seed, &mut |done| progress(alone, done));
        Ok(Self {
            path_following: path_following.map_err(ComparisonError::mission(&scenario))?,
            tracking: tracking?,
            intermittent: intermittent?,
            midpoint: midpoint?,
        })
    }
}

fn scenario(name: &'static str, duration_max: f64) -> Scenario {
    let scenario = Scenario::named(name).expect("the paper's scenarios are built in");
    let duration = scenario.duration_s.most().min(duration_max);
    scenario.lasting(duration)
}

fn fly_both(
    name: &'static str,
    seed: u64,
    duration_max: f64,
    progress: &mut dyn FnMut(f64),
) -> Result<Both, ComparisonError> {
    const STAGES: f64 = 3.0;
    let scenario = scenario(name, duration_max);
    let failed = ComparisonError::mission(&scenario);
    let (tuning, _) = tune(LosLaw::SaturatedLos, &scenario, seed, &mut |done| {
        progress(done / STAGES);
    })?;
    let line_of_sight = mission::run(&scenario, &mut LosGuide::tuned(tuning), seed, &mut |done| {
        progress((1.0 + done) / STAGES);
    });
    let mut guide = MpcGuide::new(Parameters::default());
    let planner = mission::run(&scenario, &mut guide, seed, &mut |done| {
        progress((2.0 + done) / STAGES);
    });
    Ok(Both {
        planner: planner.map_err(&failed)?,
        line_of_sight: line_of_sight.map_err(&failed)?,
    })
}
