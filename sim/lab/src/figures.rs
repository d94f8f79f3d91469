//! The source paper's figures, drawn from missions that are flown here, and other charts.
//!
//! Where the paper shows its line-of-sight law, a figure shows the planner beside it, on the same scenario and
//! seed. [`PaperMissions`] flies, [`draw`] draws, [`stated()`] sets the paper's numbers beside the measured ones.

use crate::{
    chart,
    tuning::{TuningError, tune_los},
};
use planner::policy::Policy;
use sim::{
    guide::{GuideError, LosGuide, MpcGuide},
    mission,
    record::Record,
    scenario::Scenario,
};

mod gallery;
mod over_time;
mod stated;
mod tracks;

pub use gallery::gallery;
pub use stated::{Stated, stated, table};

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

/// A drawn figure.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Figure {
    /// Its number in the paper.
    pub number: u8,
    /// What it shows, in one line.
    pub caption: String,
    /// The picture, a whole SVG document.
    pub svg: String,
}

impl Figure {
    /// Its file's name.
    #[must_use]
    pub fn file_name(&self) -> String {
        format!("fig-{:02}.svg", self.number)
    }
}

/// Why there are no figures.
#[derive(Debug, thiserror::Error)]
pub enum FiguresError {
    /// A mission failed.
    #[error("the mission {scenario} failed")]
    Mission {
        /// The scenario.
        scenario: &'static str,
        /// Why.
        source: GuideError,
    },
    /// The line-of-sight law could not be tuned.
    #[error("the line-of-sight law could not be tuned for {scenario}")]
    Tuning {
        /// The scenario.
        scenario: &'static str,
        /// Why.
        source: TuningError,
    },
}

impl PaperMissions {
    /// Flies them all, each for `duration_max` s at most. `progress` gets the scenario and the fraction of it
    /// done.
    pub fn fly(
        seed: u64,
        duration_max: f64,
        progress: &mut dyn FnMut(&'static str, f64),
    ) -> Result<Self, FiguresError> {
        let mut both = |name| fly_both(name, seed, duration_max, &mut |done| progress(name, done));
        let [tracking, intermittent, midpoint] =
            ["paper-tracking", "paper-intermittent", "paper-midpoint"].map(&mut both);
        let alone = "paper-path-following";
        // It is never asked: there is no surface craft.
        let mut guide = LosGuide::new(Policy::default().los);
        let path_following = mission::run(&scenario(alone, duration_max), &mut guide, seed, &mut |done| {
            progress(alone, done);
        });
        Ok(Self {
            path_following: path_following.map_err(|source| FiguresError::Mission {
                scenario: alone,
                source,
            })?,
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
) -> Result<Both, FiguresError> {
    const STAGES: f64 = 3.0;
    let scenario = scenario(name, duration_max);
    let failed = |source| FiguresError::Mission {
        scenario: name,
        source,
    };
    let (gains, _) = tune_los(&scenario, seed, &mut |done| progress(done / STAGES)).map_err(|source| {
        FiguresError::Tuning {
            scenario: name,
            source,
        }
    })?;
    let line_of_sight = mission::run(&scenario, &mut LosGuide::new(gains), seed, &mut |done| {
        progress((1.0 + done) / STAGES);
    });
    let mut guide = MpcGuide::new(Policy::default());
    let planner = mission::run(&scenario, &mut guide, seed, &mut |done| {
        progress((2.0 + done) / STAGES);
    });
    Ok(Both {
        planner: planner.map_err(failed)?,
        line_of_sight: line_of_sight.map_err(failed)?,
    })
}

/// Draws the nine figures, in the paper's order.
#[must_use]
pub fn draw(missions: &PaperMissions) -> Vec<Figure> {
    let figure = |number, record: &Record, caption: &str, sheet: chart::Sheet| Figure {
        number,
        caption: caption.to_owned(),
        svg: sheet.svg(&format!(
            "Fig. {number}: {}, seed {}",
            record.scenario, record.seed
        )),
    };
    let PaperMissions {
        path_following: alone,
        tracking,
        intermittent,
        midpoint,
    } = missions;
    vec![
        figure(
            3,
            alone,
            "An AUV finds its lawn-mower path and stays on it.",
            tracks::alone(alone),
        ),
        figure(
            4,
            alone,
            "Its depth: a sawtooth between two limits.",
            over_time::depth(alone),
        ),
        figure(
            5,
            alone,
            "Its distance from the point of the path that it follows.",
            over_time::path_error(alone),
        ),
        figure(
            6,
            alone,
            "References of its inner loops, and what they do.",
            over_time::inner_loops(alone),
        ),
        figure(
            8,
            &tracking.planner,
            "A surface craft above one AUV.",
            tracks::both(tracking),
        ),
        figure(
            9,
            &tracking.planner,
            "The surface craft's place relative to the AUV, along and across the AUV's course.",
            over_time::relative(tracking),
        ),
        figure(
            10,
            &tracking.planner,
            "Surge, pitch and heading of both craft; the surface craft has no pitch to steer.",
            over_time::both_craft(tracking),
        ),
        figure(
            14,
            &intermittent.planner,
            "A surface craft that looks after two AUVs in turn.",
            tracks::both(intermittent),
        ),
        figure(
            15,
            &midpoint.planner,
            "A surface craft that keeps to the midpoint of two AUVs.",
            tracks::both_with_goal(midpoint),
        ),
    ]
}
