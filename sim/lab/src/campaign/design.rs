//! The design of a campaign: its cases, conditions and numbered runs.

use std::path::Path;

use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use serde_json::{Value, json};
use sim::scenario::{InvalidScenario, Scenario};

use super::controller::{ControlLaw, Controller};
use super::file::{CampaignError, CampaignFile, CraftEntry, Objective, SEED_MAX};

mod case;
mod scenario_files;

pub use case::Case;
pub use scenario_files::ScenarioFiles;

/// Offset of the random streams of tuning replicates.
const TUNING_STREAM: u64 = 1 << 40;
/// Random streams of one replicate: one for the seed, one for each parameter.
const STREAMS: u64 = 1 << 10;
/// Fewest runs of a chunk, if the case has that many. A killed process loses at most a chunk.
const RUNS_PER_CHUNK: u64 = 6;

/// A campaign that can be run.
#[derive(Clone, Debug)]
pub struct Campaign {
    /// Its file.
    pub file: CampaignFile,
    /// The file's text.
    pub text: String,
    /// The scenario files that it names.
    pub scenario_files: ScenarioFiles,
    /// Its controllers, in the file's order.
    pub controllers: Vec<Controller>,
    /// Every scenario with every craft.
    pub cases: Vec<Case>,
}

/// A replicate of a case: start, water, noise and parameters, equal for all controllers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct Condition {
    /// Its case's number.
    pub case: usize,
    /// Number of the replicate.
    pub replicate: u64,
    /// `true` if it is for tuning.
    pub tuning: bool,
}

/// One mission of one controller.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct Run {
    /// Its number in the campaign, from 0 on.
    pub number: u64,
    /// Its condition.
    pub condition: Condition,
    /// Its controller's number in `Campaign::controllers`.
    pub controller: usize,
    /// Number of the tuning objective of a tuned law; 0 for others.
    pub objective: usize,
}

/// Runs that are stored together: all runs of some replicates of one case.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Chunk {
    /// Its number, from 0 on.
    pub number: u64,
    /// Its case's number.
    pub case: usize,
    /// Its first replicate.
    pub first: u64,
    /// Number of replicates.
    pub count: u64,
}

impl Chunk {
    pub(super) fn conditions(self) -> impl Iterator<Item = Condition> {
        (self.first..self.first + self.count).map(move |replicate| Condition {
            case: self.case,
            replicate,
            tuning: false,
        })
    }
}

impl Campaign {
    /// The campaign in the file at `path`, with the scenario files that it names.
    pub fn read(path: &Path) -> Result<Self, CampaignError> {
        let (text, name) = (CampaignFile::text(path)?, path.display().to_string());
        let folder = path.parent().unwrap_or(Path::new(""));
        let campaign = CampaignFile::parse(&text, &name)?;
        let files = ScenarioFiles::read(&campaign, folder)?;
        Self::of(campaign, &text, &name, files)
    }

    /// The campaign in `text`, which came from `file`, with the scenario files that it names.
    pub fn parse(text: &str, file: &str, scenario_files: ScenarioFiles) -> Result<Self, CampaignError> {
        Self::of(CampaignFile::parse(text, file)?, text, file, scenario_files)
    }

    /// These entries of a campaign file on one mission; gains are found on the same mission.
    pub(crate) fn of_mission(
        scenario: &Scenario,
        seed: u64,
        objective: Objective,
        controllers: &[Value],
    ) -> Self {
        let file = json!({
            "schema_version": "1",
            "name": "comparison",
            "title": scenario.title,
            "replicates": 1,
            "first_seed": seed,
            "tuning": { "replicates": 1, "first_seed": seed, "objectives": [objective] },
            "controllers": controllers,
        });
        let file: CampaignFile = serde_json::from_value(file).expect("these are members of a campaign file");
        let controllers = file.all_controllers();
        let cases = Case::all(scenario, &CraftEntry::Scenario, &[], &file).into_iter();
        Self {
            cases: cases.map(|case| case.with_controllers(&controllers)).collect(),
            controllers,
            text: String::new(),
            scenario_files: ScenarioFiles::default(),
            file,
        }
    }

    fn of(
        campaign: CampaignFile,
        text: &str,
        file: &str,
        scenario_files: ScenarioFiles,
    ) -> Result<Self, CampaignError> {
        let invalid = |field: String, reason: String| CampaignError::invalid(text, file, field, reason);
        let controllers = campaign.all_controllers();
        let names: Vec<String> = if campaign.scenarios.is_empty() {
            let flown = Scenario::names().into_iter().filter_map(Scenario::named);
            let flown = flown.filter(Scenario::has_surface_craft);
            flown.map(|scenario| scenario.name).collect()
        } else {
            campaign.scenarios.clone()
        };
        let crafts = crafts(&campaign);
        let drawn = crafts
            .iter()
            .enumerate()
            .map(|(k, entry)| case::drawn(entry).map_err(|reason| invalid(format!("craft[{k}]"), reason)));
        let drawn = drawn.collect::<Result<Vec<_>, _>>()?;
        let mut cases = vec![];
        for (i, name) in names.iter().enumerate() {
            let wrong = |reason: String| invalid(format!("scenarios[{i}]"), reason);
            let built_in = Scenario::named(name).map(Ok);
            let found = built_in.or_else(|| scenario_files.scenario(name));
            let known = || Scenario::names().join(", ");
            let scenario =
                found.ok_or_else(|| wrong(format!("there is no scenario {name:?}, only {}", known())))??;
            let is_second = |case: &Case| case.scenario.name == scenario.name;
            if cases.iter().any(is_second) {
                let reason = format!("{name} is the second with the name {}", scenario.name);
                return Err(wrong(reason));
            }
            if !scenario.has_surface_craft() {
                return Err(wrong(format!("{name} has no surface craft to score")));
            }
            for (entry, drawn) in crafts.iter().zip(&drawn) {
                let all = Case::all(&scenario, entry, drawn, &campaign);
                cases.extend(all.into_iter().map(|case| case.with_controllers(&controllers)));
            }
        }
        let made = Self { file: campaign, text: text.to_owned(), scenario_files, controllers, cases };
        let checked = made.check_parameters();
        checked.map_err(|(field, reason)| invalid(field, reason))?;
        Ok(made)
    }

    /// Outline for reports: the file with its defaults, controllers, scenarios and craft.
    pub(super) fn outline(&self) -> Value {
        let controller = |controller: &Controller| {
            json!({
                "name": controller.name,
                "entry": controller.entry.name,
                "kind": match controller.law {
                    ControlLaw::Tuned(_) | ControlLaw::Fixed(_) => "law",
                    ControlLaw::Planner { .. } => "planner",
                    ControlLaw::Guide(_) => "guide",
                },
                "paths": controller.entry.paths,
                "information": controller.information(),
                "breaks": controller.breaks_at().is_some(),
            })
        };
        // Every scenario has every craft.
        let first = |case: &&Case| case.craft == self.cases[0].craft;
        let scenario = |case: &Case| {
            let of = &case.scenario;
            json!({ "name": of.name, "title": of.title, "grants_paths": of.knowledge.paths })
        };
        let same = |case: &&Case| case.scenario.name == self.cases[0].scenario.name;
        let file = &self.file;
        json!({
            "title": file.title,
            "seed": file.seed,
            "replicates": file.replicates,
            "duration_s": file.duration_s,
            "n_runs": self.n_runs(),
            "objectives": self.objectives(),
            "parameters": file.parameters,
            "reference": self.reference(),
            "metrics": file.report.metrics,
            "pareto_front": file.report.pareto_front,
            "claims": file.claims,
            "controllers": self.controllers.iter().map(controller).collect::<Vec<_>>(),
            "scenarios": self.cases.iter().filter(first).map(scenario).collect::<Vec<_>>(),
            "craft": self.cases.iter().filter(same).map(|case| &case.craft).collect::<Vec<_>>(),
        })
    }

    /// The reference of ratios: the file's, else the first law, else the first controller.
    pub(super) fn reference(&self) -> &str {
        let mut controllers = self.controllers.iter();
        let law = controllers.find(|controller| controller.los_law().is_some());
        let first = law.or(self.controllers.first());
        let first = first.map(|controller| controller.name.as_str());
        let stated = self.file.report.reference.as_deref();
        stated.or(first).unwrap_or_default()
    }

    /// Largest number of runs: a law with the same gains for two objectives flies once for both.
    pub fn n_runs(&self) -> u64 {
        self.n_runs_before(self.cases.len())
    }

    fn n_runs_before(&self, case: usize) -> u64 {
        let per_replicate = (0..case).map(|case| self.runs_per_condition(case));
        self.file.replicates * per_replicate.sum::<u64>()
    }

    /// The runs of a condition, in order.
    pub fn runs_in(&self, condition: Condition) -> Vec<Run> {
        let per_condition = self.runs_per_condition(condition.case);
        let first = self.n_runs_before(condition.case) + condition.replicate * per_condition;
        let flown = self.cases[condition.case].controllers.iter();
        let flown = flown.flat_map(|&controller| {
            (0..self.n_objectives(controller)).map(move |objective| (controller, objective))
        });
        let numbered = flown.zip(first..);
        let runs = numbered.map(|((controller, objective), number)| Run {
            number,
            condition,
            controller,
            objective,
        });
        runs.collect()
    }

    /// The run of that number.
    pub fn run(&self, number: u64) -> Option<Run> {
        let conditions = self.chunks().into_iter().flat_map(Chunk::conditions);
        let mut runs = conditions.flat_map(|condition| self.runs_in(condition));
        runs.find(|run| run.number == number)
    }

    /// All runs in chunks.
    pub fn chunks(&self) -> Vec<Chunk> {
        let mut chunks = vec![];
        for case in 0..self.cases.len() {
            let per_condition = self.runs_per_condition(case);
            if per_condition == 0 {
                continue;
            }
            let count = (RUNS_PER_CHUNK / per_condition).max(1);
            let mut first = 0;
            while first < self.file.replicates {
                let count = count.min(self.file.replicates - first);
                chunks.push(Chunk { number: chunks.len() as u64, case, first, count });
                first += count;
            }
        }
        chunks
    }

    pub(super) fn chunk(&self, number: u64) -> Option<Chunk> {
        self.chunks().into_iter().find(|chunk| chunk.number == number)
    }

    /// The tuning objectives.
    pub fn objectives(&self) -> &[Objective] {
        self.file.tuning.as_ref().map_or(&[], |tuning| &tuning.objectives)
    }

    pub(super) fn tuning_conditions(&self, case: usize) -> impl Iterator<Item = Condition> {
        let replicates = self.file.tuning.as_ref().map_or(0, |tuning| tuning.replicates);
        (0..replicates).map(move |replicate| Condition { case, replicate, tuning: true })
    }

    /// The seed of a condition's mission.
    pub fn seed(&self, condition: Condition) -> u64 {
        let tuning = self.file.tuning.as_ref();
        let first =
            if condition.tuning { tuning.and_then(|tuning| tuning.first_seed) } else { self.file.first_seed };
        match first {
            Some(first) => first + condition.replicate,
            None => self.rng(condition, 0).random_range(1..SEED_MAX),
        }
    }

    /// Keys and values of the parameters, in the file's order; equal in a replicate of all cases.
    pub fn parameters(&self, condition: Condition) -> Vec<(&str, f64)> {
        let all = self.file.parameters.iter().zip(1..);
        let drawn = all.map(|(parameter, stream)| {
            let value = parameter.draw(&mut self.rng(condition, stream));
            (parameter.key.as_str(), value)
        });
        drawn.collect()
    }

    pub(super) fn scenario(&self, condition: Condition) -> Result<Scenario, InvalidScenario> {
        let case = &self.cases[condition.case];
        let parameters = self.parameters(condition);
        if parameters.is_empty() {
            return Ok(case.scenario.clone());
        }
        case.with_parameters(&parameters, self.file.duration_s)
    }

    /// A random stream for each replicate and purpose, equal in all cases: they can be compared.
    fn rng(&self, condition: Condition, stream: u64) -> ChaCha8Rng {
        let mut rng = ChaCha8Rng::seed_from_u64(self.file.seed);
        let replicate = condition.replicate + if condition.tuning { TUNING_STREAM } else { 0 };
        rng.set_stream(replicate * STREAMS + stream);
        rng
    }

    fn n_objectives(&self, controller: usize) -> usize {
        if self.controllers[controller].is_tuned() { self.objectives().len() } else { 1 }
    }

    pub(super) fn runs_per_condition(&self, case: usize) -> u64 {
        let controllers = self.cases[case].controllers.iter();
        controllers.map(|number| self.n_objectives(*number) as u64).sum()
    }

    /// Tries the extremes of each parameter in each scenario before hours of work.
    fn check_parameters(&self) -> Result<(), (String, String)> {
        let mut tried: Vec<&str> = vec![];
        for case in &self.cases {
            if tried.contains(&case.scenario.name.as_str()) {
                continue;
            }
            tried.push(&case.scenario.name);
            for (i, parameter) in self.file.parameters.iter().enumerate() {
                let (key, name) = (&parameter.key, &case.scenario.name);
                for value in parameter.extremes() {
                    let wrong = |reason: String| {
                        let reason = format!("{key} = {value} does not fit into {name}: {reason}");
                        (format!("parameters[{i}].key"), reason)
                    };
                    let scenario = case.with_parameters(&[(key, value)], self.file.duration_s);
                    let scenario = scenario.map_err(|error| wrong(error.to_string()))?;
                    scenario.start(0).map_err(|error| wrong(error.to_string()))?;
                }
            }
        }
        Ok(())
    }
}

fn crafts(file: &CampaignFile) -> Vec<CraftEntry> {
    if file.craft.is_empty() { vec![CraftEntry::Scenario] } else { file.craft.clone() }
}
