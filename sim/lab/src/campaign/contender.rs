//! Who flies: what each knows, and what steers.

use planner::{
    craft::{CraftDescription, CraftEstimate},
    los::{LosLaw, LosTuning},
    policy::Policy,
    snapshot::{ForecastChoice, ForecastModel, Limits, Observation, Offset, Snapshot},
};

use sim::{
    guide::{Guidance, Guide, GuideError, LosGuide, MpcGuide},
    scenario::{Scenario, Start},
};

mod variation;

pub use variation::{Breakdown, Variation};

/// A controller with its information.
#[derive(Clone, Debug, PartialEq)]
pub struct Contender {
    /// Its name, unique in a campaign.
    pub name: String,
    /// Name of the entry of the campaign file that it comes from: several come from one whose law flies at a whole grid.
    pub entry: String,
    /// What it knows of paths.
    pub paths: Paths,
    /// Whether the craft's response to references and all of its limits are declared to it; else its least and its largest speed alone.
    pub craft_declared: bool,
    /// What steers.
    pub pilot: Pilot,
    /// What is other than usual.
    pub variation: Option<Variation>,
}

/// What a contender knows of the underwater vehicles' paths, speeds and dives.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Paths {
    /// What the scenario grants.
    AsScenario,
    /// Nothing, unless its very goal is given along a path.
    Uninformed,
    /// Everything, whatever the scenario says.
    Informed,
}

/// What steers.
#[derive(Clone, Debug, PartialEq)]
pub enum Pilot {
    /// A line-of-sight law, at the best gains of its grid.
    Law(LosLaw),
    /// A line-of-sight law at these gains.
    Tuned(LosTuning),
    /// The planner.
    Planner {
        /// Its numbers.
        policy: Box<Policy>,
        /// The forecast model that it has to use; none leaves it the choice.
        forecast: Option<ForecastModel>,
    },
}

impl Contender {
    /// A law with the information that the scenario grants.
    #[must_use]
    pub(super) fn law(law: LosLaw) -> Self {
        Self {
            name: law.name().to_owned(),
            entry: law.name().to_owned(),
            paths: Paths::AsScenario,
            craft_declared: true,
            pilot: Pilot::Law(law),
            variation: None,
        }
    }

    /// Whether it takes part in `scenario`. Of laws only the present counts, so that one that knows the paths differs from
    /// itself only where the present is guessed from old or noisy reports.
    #[must_use]
    pub fn takes_part(&self, scenario: &Scenario) -> bool {
        if self
            .variation
            .is_some_and(|variation| !variation.applies(scenario))
        {
            return false;
        }
        match self.pilot {
            Pilot::Law(_) | Pilot::Tuned(_) => {
                let already_known = scenario.knowledge.paths;
                self.paths != Paths::Informed || !already_known && leaves_the_present_unsure(scenario)
            }
            // The range back-off makes no difference where no range is to be kept, and the goal uncertainty none where nothing
            // but states is known, which bring no covariance.
            Pilot::Planner { ref policy, .. } => {
                let usual = Policy::default();
                (policy.range_back_off == usual.range_back_off || scenario.bounds.range_max_m.is_some())
                    && (policy.uncertain_goal_share == usual.uncertain_goal_share
                        || scenario.knowledge.acoustics.is_some())
            }
        }
    }

    /// Whether it may win. [`LosLaw::Printed`] may not, nor may a controller that knows more than the scenario grants.
    #[must_use]
    pub(super) fn may_win(&self) -> bool {
        self.law_flown().is_none_or(LosLaw::may_win) && self.paths != Paths::Informed
    }

    /// Whether it is a line-of-sight law that is to be beaten.
    #[must_use]
    pub(super) fn is_baseline(&self) -> bool {
        self.law_flown().is_some_and(LosLaw::may_win)
    }

    /// The law that steers; none where the planner does.
    #[must_use]
    pub(super) fn law_flown(&self) -> Option<LosLaw> {
        match self.pilot {
            Pilot::Law(law) => Some(law),
            Pilot::Tuned(tuning) => Some(tuning.law),
            Pilot::Planner { .. } => None,
        }
    }

    /// The gains that it always flies at; none where they are found, or it has none.
    #[must_use]
    pub(super) fn fixed_tuning(&self) -> Option<LosTuning> {
        match self.pilot {
            Pilot::Tuned(tuning) => Some(tuning),
            Pilot::Law(_) | Pilot::Planner { .. } => None,
        }
    }

    /// When something of its craft breaks, s.
    #[must_use]
    pub(super) fn breaks_at(&self) -> Option<f64> {
        match self.variation {
            Some(Variation::Breakdown(_, at)) => Some(at),
            _ => None,
        }
    }

    /// What it knows, for people.
    #[must_use]
    pub fn information(&self) -> String {
        let of_paths = match self.paths {
            Paths::AsScenario => "what the scenario grants",
            Paths::Uninformed => "what the scenario grants, but no path",
            Paths::Informed => "what the scenario grants, and all paths, speeds and dives",
        };
        let uses = match &self.pilot {
            Pilot::Law(_) | Pilot::Tuned(_) => "looks at the present only",
            Pilot::Planner { forecast: None, .. } => {
                "forecasts along paths where known, else by rate of turn, and with the drift that it found out"
            }
            Pilot::Planner {
                forecast: Some(model),
                ..
            } => match model {
                ForecastModel::Hold => "forecasts that all stay where they are",
                ForecastModel::ConstantVelocity => {
                    "forecasts that all keep their velocity, and the drift that it found out"
                }
                ForecastModel::ConstantTurn => "forecasts that all keep their rate of turn",
                ForecastModel::Path => "forecasts along the paths",
            },
        };
        let of_craft = if self.craft_declared {
            ""
        } else {
            "; of its craft the speeds alone"
        };
        format!("{of_paths}{of_craft}; {uses}")
    }

    /// The scenario that it flies.
    #[must_use]
    pub(super) fn scenario(&self, scenario: &Scenario) -> Scenario {
        let mut scenario = scenario.clone();
        scenario.knowledge.paths |= self.paths == Paths::Informed;
        if let Some(variation) = self.variation {
            variation.vary_scenario(&mut scenario);
        }
        scenario
    }

    /// Varies the start that it flies from, and leaves of the craft what is declared to it.
    pub(super) fn vary_start(&self, start: &mut Start) {
        if let Some(variation) = self.variation {
            variation.vary_start(start);
        }
        if !self.craft_declared
            && let Some(observer) = &mut start.observer
        {
            let briefing = observer.briefing_mut();
            briefing.craft = CraftDescription::default();
            briefing.limits = Limits {
                speed_min: briefing.limits.speed_min,
                speed_max: briefing.limits.speed_max,
                ..Limits::ANY
            };
        }
    }

    /// What steers, without memory. `tuning` is a law's.
    pub(super) fn guide(&self, tuning: Option<LosTuning>) -> Box<dyn Guide> {
        let adapted = |guide| Adapted {
            guide,
            without_paths: self.paths == Paths::Uninformed,
            forecast: None,
        };
        let guide: Box<dyn Guide> = match (&self.pilot, tuning) {
            (Pilot::Tuned(tuning), _) => Box::new(adapted(LosGuide::tuned(*tuning))),
            (Pilot::Law(_), Some(tuning)) => Box::new(adapted(LosGuide::tuned(tuning))),
            (Pilot::Law(law), None) => Box::new(adapted(LosGuide::tuned(crate::tuning::grid(*law)[0]))),
            (Pilot::Planner { policy, forecast }, _) => Box::new(Adapted {
                guide: MpcGuide::new(Policy::clone(policy)),
                without_paths: self.paths == Paths::Uninformed,
                forecast: *forecast,
            }),
        };
        match self.variation {
            Some(variation) => variation.around(guide),
            None => guide,
        }
    }
}

/// Whether reports come late, noisy or not at all.
fn leaves_the_present_unsure(scenario: &Scenario) -> bool {
    use sim::scenario::FaultKindFile::{AuvDies, Silence};
    let silent = |fault: &sim::scenario::FaultFile| matches!(fault.what, Silence { .. } | AuvDies { .. });
    scenario.knowledge.acoustics.is_some() || scenario.faults.iter().any(silent)
}

/// A guide whose snapshots differ from what was observed.
struct Adapted<G> {
    guide: G,
    without_paths: bool,
    forecast: Option<ForecastModel>,
}

impl<G: Guide> Guide for Adapted<G> {
    fn name(&self) -> &'static str {
        self.guide.name()
    }

    fn craft_estimate(&self) -> Option<&CraftEstimate> {
        self.guide.craft_estimate()
    }

    fn guide(&mut self, snapshot: &Snapshot) -> Result<Guidance, GuideError> {
        if !self.without_paths && self.forecast.is_none() {
            return self.guide.guide(snapshot);
        }
        let mut observation = Observation::clone(snapshot);
        if let Some(model) = self.forecast {
            observation.forecast = ForecastChoice::Model(model);
        }
        if self.without_paths && !matches!(observation.offset, Some(Offset::Path(_))) {
            for auv in &mut observation.auvs {
                (auv.path, auv.dive) = (None, None);
            }
        }
        self.guide.guide(&Snapshot::try_from(observation)?)
    }
}
