//! What a campaign amounts to: its arenas, worlds and runs, each with a number that says all of it.

use std::path::Path;

use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use sim::scenario::{Files, Scenario};

use super::{
    contender::{Contender, Pilot},
    file::{CampaignError, CampaignFile, CraftEntry, Objective, SEED_MAX},
};

mod arena;
mod scenario_files;

pub use arena::Arena;
pub use scenario_files::ScenarioFiles;

/// Replicates of tuning draw from streams of their own.
const TUNING_STREAM: u64 = 1 << 40;
/// Streams of one replicate: a seed's, and one for each parameter.
const STREAMS: u64 = 1 << 10;
/// Runs of one chunk, where a world has fewer: what is lost where a process is killed, and what one worker of many does at a time.
const RUNS_PER_CHUNK: u64 = 6;

/// A campaign that can be run.
#[derive(Clone, Debug)]
pub struct Campaign {
    /// What its file says.
    pub file: CampaignFile,
    /// The file's text.
    pub text: String,
    /// Scenario files that it names and does not hold itself.
    pub scenario_files: ScenarioFiles,
    /// Who flies, in the file's order.
    pub controllers: Vec<Contender>,
    /// Every scenario with every craft.
    pub arenas: Vec<Arena>,
}

/// A world: all that the controllers of a comparison have in common.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct World {
    /// Its arena's number.
    pub arena: usize,
    /// Which replicate of it.
    pub replicate: u64,
    /// Whether it is for finding gains.
    pub tuning: bool,
}

/// One flight of one controller.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Run {
    /// Its number in the campaign, from 0 on.
    pub number: u64,
    /// Where.
    pub world: World,
    /// Who, in `Campaign::controllers`.
    pub controller: usize,
    /// For which of the tuning's objectives a law that is tuned has its gains; 0 for all others.
    pub objective: usize,
}

/// Some runs that are done and kept together: all of some worlds of one arena.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Chunk {
    /// Its number, from 0 on.
    pub number: u64,
    /// Its arena's number.
    pub arena: usize,
    /// Its first replicate.
    pub first: u64,
    /// How many replicates.
    pub count: u64,
}

impl Chunk {
    /// Its worlds.
    pub(super) fn worlds(self) -> impl Iterator<Item = World> {
        (self.first..self.first + self.count).map(move |replicate| World {
            arena: self.arena,
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
        let files = ScenarioFiles::read(&CampaignFile::parse(&text, &name)?, folder)?;
        Self::parse(&text, &name, files)
    }

    /// The campaign in `text`, which came from `file`, with the scenario files that it names and does not hold itself.
    pub fn parse(text: &str, file: &str, scenario_files: ScenarioFiles) -> Result<Self, CampaignError> {
        let campaign = CampaignFile::parse(text, file)?;
        let invalid = |field: String, reason: String| CampaignError::invalid(text, file, field, reason);
        let controllers: Vec<Contender> = campaign
            .controllers
            .iter()
            .filter_map(|controller| controller.contenders().ok())
            .flatten()
            .collect();
        let names: Vec<String> = if campaign.scenarios.is_empty() {
            let built_in = Scenario::names().into_iter();
            let flown =
                built_in.filter(|name| Scenario::named(name).is_some_and(|found| found.has_surface_craft()));
            flown.map(str::to_owned).collect()
        } else {
            campaign.scenarios.clone()
        };
        let crafts = crafts(&campaign);
        let drawn = crafts
            .iter()
            .enumerate()
            .map(|(k, entry)| arena::drawn(entry).map_err(|reason| invalid(format!("craft[{k}]"), reason)))
            .collect::<Result<Vec<_>, _>>()?;
        let mut arenas = vec![];
        for (i, name) in names.iter().enumerate() {
            let scenario = scenario(name, &campaign, &scenario_files).ok_or_else(|| {
                let known = Scenario::names().join(", ");
                invalid(
                    format!("scenarios[{i}]"),
                    format!("there is no scenario {name:?}, only {known}"),
                )
            })??;
            if arenas
                .iter()
                .any(|arena: &Arena| arena.scenario.name == scenario.name)
            {
                return Err(invalid(
                    format!("scenarios[{i}]"),
                    format!("{name} is the second with the name {}", scenario.name),
                ));
            }
            if !scenario.has_surface_craft() {
                return Err(invalid(
                    format!("scenarios[{i}]"),
                    format!("{name} has no surface craft to score"),
                ));
            }
            for (entry, drawn) in crafts.iter().zip(&drawn) {
                let all = Arena::all(&scenario, entry, drawn, &campaign);
                arenas.extend(all.into_iter().map(|arena| arena.with_controllers(&controllers)));
            }
        }
        let made = Self {
            file: campaign,
            text: text.to_owned(),
            scenario_files,
            controllers,
            arenas,
        };
        made.check_parameters()
            .map_err(|(field, reason)| invalid(field, reason))?;
        Ok(made)
    }

    /// How many runs there are at most: laws whose gains are the same for two objectives fly once for both.
    #[must_use]
    pub fn n_runs(&self) -> u64 {
        (0..self.arenas.len())
            .map(|arena| self.runs_per_world(arena) * self.file.replicates)
            .sum()
    }

    /// The runs of a world, in order.
    #[must_use]
    pub fn runs_in(&self, world: World) -> Vec<Run> {
        let before: u64 = (0..world.arena)
            .map(|arena| self.runs_per_world(arena) * self.file.replicates)
            .sum();
        let first = before + world.replicate * self.runs_per_world(world.arena);
        let flights = self.arenas[world.arena].controllers.iter();
        let flights = flights.flat_map(|&controller| {
            (0..self.flights_of(controller)).map(move |objective| (controller, objective))
        });
        let numbered = flights.zip(first..);
        let runs = numbered.map(|((controller, objective), number)| Run {
            number,
            world,
            controller,
            objective,
        });
        runs.collect()
    }

    /// The run of that number.
    #[must_use]
    pub fn run(&self, number: u64) -> Option<Run> {
        let mut first = 0;
        for arena in 0..self.arenas.len() {
            let each = self.runs_per_world(arena);
            let end = first + each * self.file.replicates;
            if number < end {
                let replicate = (number - first) / each;
                let world = World {
                    arena,
                    replicate,
                    tuning: false,
                };
                return self.runs_in(world).into_iter().find(|run| run.number == number);
            }
            first = end;
        }
        None
    }

    /// All runs in chunks.
    #[must_use]
    pub fn chunks(&self) -> Vec<Chunk> {
        let mut chunks = vec![];
        for arena in 0..self.arenas.len() {
            let per_world = self.runs_per_world(arena);
            if per_world == 0 {
                continue;
            }
            let count = (RUNS_PER_CHUNK / per_world).max(1);
            let mut first = 0;
            while first < self.file.replicates {
                let count = count.min(self.file.replicates - first);
                chunks.push(Chunk {
                    number: chunks.len() as u64,
                    arena,
                    first,
                    count,
                });
                first += count;
            }
        }
        chunks
    }

    /// The objectives that gains are found for.
    #[must_use]
    pub fn objectives(&self) -> &[Objective] {
        self.file.tuning.as_ref().map_or(&[], |tuning| &tuning.objectives)
    }

    /// The worlds that gains are found in.
    pub(super) fn tuning_worlds(&self, arena: usize) -> impl Iterator<Item = World> {
        let replicates = self.file.tuning.as_ref().map_or(0, |tuning| tuning.replicates);
        (0..replicates).map(move |replicate| World {
            arena,
            replicate,
            tuning: true,
        })
    }

    /// The seed of a world's mission.
    #[must_use]
    pub fn seed(&self, world: World) -> u64 {
        let tuning = self.file.tuning.as_ref();
        let first = if world.tuning {
            tuning.and_then(|tuning| tuning.first_seed)
        } else {
            self.file.first_seed
        };
        match first {
            Some(first) => first + world.replicate,
            None => self.rng(world, 0).random_range(1..SEED_MAX),
        }
    }

    /// The parameters of a world: keys and values, in the file's order. The same replicate of every arena has the same.
    #[must_use]
    pub fn parameters(&self, world: World) -> Vec<(&str, f64)> {
        let all = self.file.parameters.iter().zip(1..);
        all.map(|(parameter, stream)| {
            (
                parameter.key.as_str(),
                parameter.draw(&mut self.rng(world, stream)),
            )
        })
        .collect()
    }

    /// Keys of the parameters, in the file's order.
    pub(super) fn parameter_keys(&self) -> Vec<&str> {
        self.file
            .parameters
            .iter()
            .map(|parameter| parameter.key.as_str())
            .collect()
    }

    /// The scenario of a world, with its parameters.
    pub(super) fn scenario(&self, world: World) -> Result<Scenario, String> {
        let arena = &self.arenas[world.arena];
        let parameters = self.parameters(world);
        if parameters.is_empty() {
            return Ok(arena.scenario.clone());
        }
        arena.with_parameters(&parameters, self.file.duration_s)
    }

    /// Randomness of its own for each world and purpose. It does not depend on the arena, so that arenas can be compared.
    fn rng(&self, world: World, stream: u64) -> ChaCha8Rng {
        let mut rng = ChaCha8Rng::seed_from_u64(self.file.seed);
        let replicate = world.replicate + if world.tuning { TUNING_STREAM } else { 0 };
        rng.set_stream(replicate * STREAMS + stream);
        rng
    }

    fn flights_of(&self, controller: usize) -> usize {
        match self.controllers[controller].pilot {
            Pilot::Law(_) => self.objectives().len(),
            Pilot::Tuned(_) | Pilot::Planner { .. } => 1,
        }
    }

    fn runs_per_world(&self, arena: usize) -> u64 {
        self.arenas[arena]
            .controllers
            .iter()
            .map(|&controller| self.flights_of(controller) as u64)
            .sum()
    }

    /// Tries each parameter's extremes in each scenario: a campaign should not find out after hours.
    fn check_parameters(&self) -> Result<(), (String, String)> {
        let mut tried: Vec<&str> = vec![];
        for arena in &self.arenas {
            if tried.contains(&arena.scenario.name.as_str()) {
                continue;
            }
            tried.push(&arena.scenario.name);
            for (i, parameter) in self.file.parameters.iter().enumerate() {
                for value in parameter.extremes() {
                    arena
                        .with_parameters(&[(&parameter.key, value)], self.file.duration_s)
                        .map_err(|reason| {
                            let place = format!("parameters[{i}].key");
                            (
                                place,
                                format!(
                                    "{} = {value} does not fit into {}: {reason}",
                                    parameter.key, arena.scenario.name
                                ),
                            )
                        })?;
                }
            }
        }
        Ok(())
    }
}

fn crafts(file: &CampaignFile) -> Vec<CraftEntry> {
    if file.craft.is_empty() {
        vec![CraftEntry::Scenario]
    } else {
        file.craft.clone()
    }
}

/// The scenario called `name`: a built-in one, one of the campaign file's own, or one of `files`. None if there is none.
fn scenario(
    name: &str,
    campaign: &CampaignFile,
    files: &ScenarioFiles,
) -> Option<Result<Scenario, CampaignError>> {
    if let Some(built_in) = Scenario::named(name) {
        return Some(Ok(built_in));
    }
    let scenario = match campaign.scenario_files.get(name) {
        Some(text) => Scenario::parse(text, name, Files::default()),
        None => files.scenario(name)?,
    };
    Some(scenario.map_err(CampaignError::from))
}
