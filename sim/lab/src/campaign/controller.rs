//! A controller of a campaign: its control law, its knowledge, and its variation.

use planner::craft::{CraftDescription, CraftEstimate};
use planner::los::{LosLaw, LosTuning};
use planner::parameters::Parameters;
use planner::snapshot::{Forecast, ForecastModel, Goal, Limits, Offset, PlanRequest, Snapshot, Tuning};
use planner::tuned::Tuned;
use sim::{
    guide::{Guidance, Guide, GuideError, LosGuide, MpcGuide},
    scenario::{Scenario, Start},
};

use super::grid::{Setting, grid, tuned};
use crate::{
    http_guide::{GuideUrl, HttpGuide},
    rules::{GreedyGuide, Rule, RuleGuide},
};

mod entry;
mod variation;

use entry::FigureFile;
pub use entry::{ControllerFile, CraftKnowledge, LawFile, Paths, PlannerFile, RuleFile};
pub use variation::{Breakdown, Variation};

/// A control law with its information.
#[derive(Clone, Debug, PartialEq)]
pub struct Controller {
    /// Its name, unique in a campaign.
    pub name: String,
    /// The law that steers.
    pub law: ControlLaw,
    /// Its entry in the campaign file. A `whole_grid` entry gives several controllers.
    pub entry: ControllerFile,
}

/// The law that steers.
#[derive(Clone, Debug, PartialEq)]
pub enum ControlLaw {
    /// A line-of-sight law, at the best gains of its grid.
    Tuned(LosLaw),
    /// A line-of-sight law at these gains.
    Fixed(LosTuning),
    /// The planner.
    Planner {
        /// Its parameters.
        parameters: Box<Parameters>,
        /// The levers that replace those of the scenario, if it sets any.
        tuning: Option<Tuning>,
        /// The tuned numbers that replace those of the scenario, if it sets any.
        tuned: Option<Box<Tuned>>,
        /// The forecast model that it must use; its own choice if none.
        forecast: Option<ForecastModel>,
    },
    /// A law outside of this program.
    Guide(GuideUrl),
}

impl Controller {
    /// A law with the information that the scenario grants.
    pub(super) fn law(law: LosLaw) -> Self {
        Self { name: law.name().to_owned(), law: ControlLaw::Tuned(law), entry: ControllerFile::default() }
    }

    /// `true` if it takes part in `scenario`. A law uses only the present, so knowing the paths
    /// matters only where the present is estimated from old or noisy reports.
    pub fn takes_part(&self, scenario: &Scenario) -> bool {
        let variation = self.entry.variation;
        if variation.is_some_and(|variation| !variation.applies(scenario)) {
            return false;
        }
        if scenario.has_fleet() || self.entry.assign.is_some() {
            return scenario.has_fleet() && self.steers_fleets();
        }
        let goal = scenario.surface_craft.first().map(|craft| &craft.goal);
        let localises = matches!(goal, Some(Goal::Localise(_)));
        let fits = match self.entry.rule {
            Some(RuleFile { name: Rule::Greedy, .. }) => localises,
            Some(_) => matches!(goal, Some(Goal::Visit(_))),
            None => localises || self.figure().is_none(),
        };
        if !fits {
            return false;
        }
        match self.law {
            ControlLaw::Tuned(_) | ControlLaw::Fixed(_) => {
                let already_known = scenario.knowledge.paths;
                self.entry.paths != Paths::Known || !already_known && leaves_the_present_unsure(scenario)
            }
            // No range to keep: no back-off. Exact states, without acoustics, have no covariance.
            ControlLaw::Planner { ref parameters, .. } => {
                let usual = Parameters::default();
                (parameters.range_back_off == usual.range_back_off || scenario.bounds.range_max_m.is_some())
                    && (parameters.uncertain_goal_share == usual.uncertain_goal_share
                        || scenario.knowledge.acoustics.is_some())
            }
            ControlLaw::Guide(_) => true,
        }
    }

    /// `true` if it steers several craft: the planner, with all that the scenario grants.
    fn steers_fleets(&self) -> bool {
        let ControlLaw::Planner { forecast: None, .. } = self.law else { return false };
        let Self { entry, .. } = self;
        let is_plain = entry.rule.is_none() && entry.variation.is_none() && self.figure().is_none();
        is_plain && entry.paths == Paths::AsScenario
    }

    pub(super) fn figure(&self) -> Option<FigureFile> {
        self.entry.planner.as_ref()?.figure
    }

    /// The law that steers; `None` for the planner.
    pub(super) fn los_law(&self) -> Option<LosLaw> {
        match self.law {
            ControlLaw::Tuned(law) => Some(law),
            ControlLaw::Fixed(tuning) => Some(tuning.law),
            ControlLaw::Planner { .. } | ControlLaw::Guide(_) => None,
        }
    }

    /// The settings to search; a single one if nothing is tuned.
    pub(crate) fn grid(&self) -> Vec<Setting> {
        let laws = match self.law {
            ControlLaw::Tuned(law) => grid(law),
            ControlLaw::Fixed(tuning) => vec![tuning],
            ControlLaw::Planner { .. } | ControlLaw::Guide(_) => vec![],
        };
        let dwells = self.entry.rule.as_ref().map(RuleFile::dwells);
        let figures = self.figure().map(|figure| figure.grid());
        Setting::grid(&laws, dwells.unwrap_or_default(), &figures.unwrap_or_default())
    }

    /// `true` if a part of it is tuned.
    pub(super) fn is_tuned(&self) -> bool {
        1 < self.grid().len()
    }

    /// Time of the craft's breakdown, s.
    pub(super) fn breaks_at(&self) -> Option<f64> {
        match self.entry.variation {
            Some(Variation::Breakdown { at_s, .. }) => Some(at_s),
            _ => None,
        }
    }

    /// Its knowledge and variation in words.
    pub fn information(&self) -> String {
        let of_paths = match self.entry.paths {
            Paths::AsScenario => "what the scenario grants",
            Paths::Unknown => "what the scenario grants, but no path",
            Paths::Known => "what the scenario grants, and all paths, speeds and dives",
        };
        let uses = match &self.law {
            ControlLaw::Tuned(_) | ControlLaw::Fixed(_) => "looks at the present only",
            ControlLaw::Guide(_) => "is a law outside of this program",
            ControlLaw::Planner { forecast: None, .. } => {
                "forecasts along paths where known, else by rate of turn, and with the drift that it found out"
            }
            ControlLaw::Planner { forecast: Some(model), .. } => match model {
                ForecastModel::Hold => "forecasts that all stay where they are",
                ForecastModel::ConstantVelocity => {
                    "forecasts that all keep their velocity, and the drift that it found out"
                }
                ForecastModel::ConstantTurn => "forecasts that all keep their rate of turn",
                ForecastModel::Path => "forecasts along the paths",
            },
        };
        let of_craft = match self.entry.craft {
            CraftKnowledge::Declared => "",
            CraftKnowledge::Speeds => "; of its craft the speeds alone",
        };
        let visits = match self.entry.rule {
            Some(rule) => format!("; {} by the rule {}", rule.name.does(), rule.name.names()[0]),
            None => String::new(),
        };
        format!("{of_paths}{of_craft}; {uses}{visits}")
    }

    /// The scenario with its knowledge and its variation.
    pub(super) fn scenario(&self, scenario: &Scenario) -> Scenario {
        let mut scenario = scenario.clone();
        scenario.knowledge.paths |= self.entry.paths == Paths::Known;
        if let Some(variation) = self.entry.variation {
            variation.vary_scenario(&mut scenario);
        }
        scenario
    }

    /// Applies its variation to the start, and removes undeclared parts of the craft.
    pub(super) fn vary_start(&self, start: &mut Start) {
        if let Some(variation) = self.entry.variation {
            variation.vary_start(start);
        }
        if let ControlLaw::Planner { tuning, tuned, .. } = &self.law
            && let Some(observer) = &mut start.observer
        {
            let briefing = &mut observer.briefing;
            briefing.tuning = tuning.clone().or(briefing.tuning.take());
            briefing.tuned = tuned.as_deref().copied().unwrap_or(briefing.tuned);
        }
        if self.entry.craft == CraftKnowledge::Speeds
            && let Some(observer) = &mut start.observer
        {
            let briefing = &mut observer.briefing;
            briefing.craft = CraftDescription::default();
            briefing.limits = Limits {
                speed_min: briefing.limits.speed_min,
                speed_max: briefing.limits.speed_max,
                ..Limits::ANY
            };
        }
    }

    /// The guide, without memory, at a point of its grid.
    pub(crate) fn guide(&self, setting: Setting) -> Box<dyn Guide> {
        let gains =
            |law| -> LosTuning { setting.gains.map_or_else(|| grid(law)[0], |gains| tuned(law, gains)) };
        let (guide, forecast): (Box<dyn Guide>, _) = match &self.law {
            ControlLaw::Fixed(tuning) => (Box::new(LosGuide::tuned(*tuning)), None),
            ControlLaw::Tuned(law) => (Box::new(LosGuide::tuned(gains(*law))), None),
            ControlLaw::Planner { parameters, forecast, .. } => {
                let parameters = Parameters { figure: setting.figure, ..Parameters::clone(parameters) };
                (Box::new(MpcGuide::new(parameters)), *forecast)
            }
            ControlLaw::Guide(url) => (Box::new(HttpGuide::new(url)), None),
        };
        let guide: Box<dyn Guide> = match self.entry.rule {
            Some(RuleFile { name: Rule::Greedy, .. }) => Box::new(GreedyGuide),
            Some(rule) => Box::new(RuleGuide::new(guide, rule.name, setting.dwell_s.unwrap_or(0.0))),
            None => guide,
        };
        Box::new(AdaptedGuide {
            guide,
            without_paths: self.entry.paths == Paths::Unknown,
            forecast,
            variation: self.entry.variation,
            asked: 0,
            held: None,
        })
    }
}

/// `true` if reports are late, noisy or missing.
fn leaves_the_present_unsure(scenario: &Scenario) -> bool {
    use sim::scenario::FaultKindFile::{AuvDies, Silence};
    let silent = |fault: &sim::scenario::FaultFile| matches!(fault.what, Silence { .. } | AuvDies { .. });
    scenario.knowledge.acoustics.is_some() || scenario.faults.iter().any(silent)
}

/// A guide whose snapshots are adapted to its controller's knowledge and variation.
struct AdaptedGuide {
    guide: Box<dyn Guide>,
    without_paths: bool,
    forecast: Option<ForecastModel>,
    variation: Option<Variation>,
    asked: u32,
    held: Option<Guidance>,
}

impl Guide for AdaptedGuide {
    fn name(&self) -> &'static str {
        self.guide.name()
    }

    fn craft_estimate(&self) -> Option<&CraftEstimate> {
        self.guide.craft_estimate()
    }

    fn guide(&mut self, snapshot: &Snapshot) -> Result<Guidance, GuideError> {
        if self.variation.is_none() && !self.without_paths && self.forecast.is_none() {
            return self.guide.guide(snapshot);
        }
        let every = match self.variation {
            Some(Variation::AskedEveryS(every)) => every.max(1),
            _ => 1,
        };
        let due = self.asked.is_multiple_of(every);
        self.asked += 1;
        if let Some(held) = self.held.filter(|_| !due) {
            return Ok(held);
        }
        let mut observation = PlanRequest::clone(snapshot);
        if let Some(variation) = self.variation {
            variation.vary_observation(&mut observation);
        }
        if let Some(model) = self.forecast {
            observation.forecast = Forecast::from(model);
        }
        if self.without_paths && !matches!(observation.goal.offset, Some(Offset::Path { .. })) {
            for auv in &mut observation.auvs {
                (auv.path, auv.dive) = (None, None);
            }
        }
        let guidance = self.guide.guide(&snapshot.again(observation)?)?;
        self.held = Some(guidance);
        Ok(guidance)
    }
}
