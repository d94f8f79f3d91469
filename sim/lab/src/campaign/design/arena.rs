//! A scenario with a craft, and the numbers that a world puts into its file.

use std::sync::Arc;

use planner::craft::Craft;
use sim::{
    scenario::{RandomCraftFile, Scenario, SurfaceClassFile},
    surface_craft::{
        SurfaceClass,
        random::{CraftWishes, RandomCraft},
    },
};
use toml::{Table, Value};

use crate::campaign::{
    contender::Contender,
    file::{CampaignFile, CraftEntry},
};

/// A scenario with a craft.
#[derive(Clone, Debug)]
pub struct Arena {
    /// The scenario, as its file says, but for the craft and the duration.
    pub scenario: Scenario,
    /// Which craft, for people and for the table.
    pub craft: String,
    /// Numbers, in `Campaign::controllers`, of those that take part.
    pub controllers: Vec<usize>,
    class: Option<SurfaceClassFile>,
    drawn: Option<Arc<RandomCraft>>,
}

/// The craft that `entry` draws, each some tens of ms: they are the same in all scenarios.
pub(super) fn drawn(entry: &CraftEntry) -> Result<Vec<Arc<RandomCraft>>, String> {
    match entry {
        CraftEntry::Random { first, count } => (*first..first + count)
            .map(|seed| RandomCraft::draw(seed, &CraftWishes::default()).map(Arc::new))
            .collect::<Result<_, _>>()
            .map_err(|error| error.to_string()),
        CraftEntry::Scenario | CraftEntry::Medusa | CraftEntry::Otter => Ok(vec![]),
    }
}

impl Arena {
    /// Every arena of a scenario with the craft of `entry`, of which `drawn` are those that it draws.
    pub(super) fn all(
        scenario: &Scenario,
        entry: &CraftEntry,
        drawn: &[Arc<RandomCraft>],
        file: &CampaignFile,
    ) -> Vec<Self> {
        let arena = |craft: String, class, drawn| {
            let mut scenario = scenario.clone();
            if let Some(duration) = file.duration_s {
                let whole = scenario.duration_s.most();
                scenario = scenario.lasting(whole.min(duration));
            }
            let mut arena = Self {
                scenario,
                craft,
                controllers: vec![],
                class,
                drawn,
            };
            let (mut scenario, class, drawn) =
                (arena.scenario.clone(), arena.class.clone(), arena.drawn.clone());
            put_craft(&mut scenario, class, drawn);
            arena.scenario = scenario;
            arena
        };
        match entry {
            CraftEntry::Scenario => vec![arena("scenario".to_owned(), None, None)],
            CraftEntry::Medusa => vec![arena("medusa".to_owned(), Some(SurfaceClassFile::Medusa), None)],
            CraftEntry::Otter => vec![arena("otter".to_owned(), Some(SurfaceClassFile::Otter), None)],
            CraftEntry::Random { first, .. } => {
                let arenas = drawn.iter().zip(*first..).map(|(craft, seed)| {
                    let class = SurfaceClassFile::Random(RandomCraftFile {
                        seed: Some(seed),
                        ..RandomCraftFile::default()
                    });
                    arena(format!("random {seed}"), Some(class), Some(Arc::clone(craft)))
                });
                arenas.collect()
            }
        }
    }

    pub(super) fn with_controllers(mut self, controllers: &[Contender]) -> Self {
        let all = controllers.iter().enumerate();
        self.controllers = all
            .filter(|(_, contender)| contender.takes_part(&self.scenario))
            .map(|(number, _)| number)
            .collect();
        self
    }

    /// The scenario with these numbers in its file.
    pub(super) fn with_parameters(
        &self,
        parameters: &[(&str, f64)],
        duration: Option<f64>,
    ) -> Result<Scenario, String> {
        let source = &self.scenario.source.text;
        let mut document: Table = source
            .parse()
            .map_err(|error: toml::de::Error| error.to_string())?;
        for (key, value) in parameters {
            put(&mut document, key, *value)?;
        }
        let text = toml::to_string(&document).map_err(|error| error.to_string())?;
        let mut scenario = Scenario::parse(&text, &self.scenario.source.file, self.scenario.files.clone())
            .map_err(|error| error.to_string())?;
        if let Some(duration) = duration {
            let whole = scenario.duration_s.most();
            scenario = scenario.lasting(whole.min(duration));
        }
        put_craft(&mut scenario, self.class.clone(), self.drawn.clone());
        Ok(scenario)
    }

    /// How the craft answers references, as its step tests say; none of a craft of the scenario's own.
    pub(in crate::campaign) fn response(&self) -> Option<Craft> {
        if let Some(drawn) = &self.drawn {
            return Some(drawn.tested.craft);
        }
        let class = match self.scenario.surface_craft.as_ref()?.class {
            SurfaceClassFile::Medusa => SurfaceClass::Medusa,
            SurfaceClassFile::Otter => SurfaceClass::Otter,
            SurfaceClassFile::Random(_) => return None,
        };
        Some(class.craft().craft())
    }
}

fn put_craft(scenario: &mut Scenario, class: Option<SurfaceClassFile>, drawn: Option<Arc<RandomCraft>>) {
    if let (Some(class), Some(craft)) = (class, &mut scenario.surface_craft) {
        craft.class = class;
        craft.drawn = drawn;
    }
}

/// Puts `value` at `key`, as `knowledge.acoustics.sigma_m` or `auvs[0].speed_mps`. Tables on the way are made; items of lists
/// have to be there.
fn put(document: &mut Table, key: &str, value: f64) -> Result<(), String> {
    let (steps, last) = key
        .rsplit_once('.')
        .map_or(("", key), |(steps, last)| (steps, last));
    let mut table = document;
    for step in steps.split('.').filter(|step| !step.is_empty()) {
        let (name, index) = match step.split_once('[') {
            Some((name, rest)) => {
                let index = rest
                    .strip_suffix(']')
                    .and_then(|index| index.parse::<usize>().ok());
                (
                    name,
                    Some(index.ok_or_else(|| format!("{step} has no whole number in its brackets"))?),
                )
            }
            None => (step, None),
        };
        let entry = table.entry(name).or_insert_with(|| Value::Table(Table::new()));
        let entry = match (entry, index) {
            (Value::Array(items), Some(index)) => {
                let n = items.len();
                items
                    .get_mut(index)
                    .ok_or_else(|| format!("{name} has {n} items, and none numbered {index}"))?
            }
            (entry, None) => entry,
            (_, Some(_)) => return Err(format!("{name} is no list")),
        };
        let Value::Table(inner) = entry else {
            return Err(format!("{step} is no table"));
        };
        table = inner;
    }
    table.insert(last.to_owned(), Value::Float(value));
    Ok(())
}
