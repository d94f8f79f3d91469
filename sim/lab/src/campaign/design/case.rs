//! A scenario with a craft, and with the parameters of a condition.

use std::sync::Arc;

use planner::craft::Craft;
use sim::{
    scenario::{InvalidScenario, RandomCraftFile, Scenario, SurfaceClassFile},
    surface_craft::{
        SurfaceClass,
        random::{CraftConstraints, RandomCraft},
    },
};

use crate::campaign::controller::Controller;
use crate::campaign::file::{CampaignFile, CraftEntry};

/// A scenario with a craft.
#[derive(Clone, Debug)]
pub struct Case {
    /// The scenario of its file, with the craft and the duration of the campaign.
    pub scenario: Scenario,
    /// Name of the craft.
    pub craft: String,
    /// Numbers in `Campaign::controllers` of the controllers that take part.
    pub controllers: Vec<usize>,
    /// The scenario as its file says.
    as_written: Scenario,
    class: Option<SurfaceClassFile>,
    drawn: Option<Arc<RandomCraft>>,
}

/// The random craft of `entry`, equal in all scenarios. Drawn once: each takes tens of ms.
pub(super) fn drawn(entry: &CraftEntry) -> Result<Vec<Arc<RandomCraft>>, String> {
    match entry {
        CraftEntry::Random { first, count } => {
            let any = CraftConstraints::default();
            let drawn = (*first..first + count).map(|seed| RandomCraft::draw(seed, &any).map(Arc::new));
            drawn.collect::<Result<_, _>>().map_err(|error| error.to_string())
        }
        CraftEntry::Scenario | CraftEntry::Medusa | CraftEntry::Otter => Ok(vec![]),
    }
}

impl Case {
    /// The cases of a scenario with the craft of `entry`; `drawn` are its random craft.
    pub(super) fn all(
        scenario: &Scenario,
        entry: &CraftEntry,
        drawn: &[Arc<RandomCraft>],
        file: &CampaignFile,
    ) -> Vec<Self> {
        let case = |craft: String, class: Option<SurfaceClassFile>, drawn: Option<Arc<RandomCraft>>| Self {
            scenario: prepared(scenario.clone(), (class.as_ref(), drawn.as_ref()), file.duration_s),
            as_written: scenario.clone(),
            craft,
            controllers: vec![],
            class,
            drawn,
        };
        match entry {
            CraftEntry::Scenario => vec![case("scenario".to_owned(), None, None)],
            CraftEntry::Medusa => vec![case("medusa".to_owned(), Some(SurfaceClassFile::Medusa), None)],
            CraftEntry::Otter => vec![case("otter".to_owned(), Some(SurfaceClassFile::Otter), None)],
            CraftEntry::Random { first, .. } => {
                let cases = drawn.iter().zip(*first..).map(|(craft, seed)| {
                    let class = SurfaceClassFile::Random(RandomCraftFile {
                        seed: Some(seed),
                        ..RandomCraftFile::default()
                    });
                    case(format!("random {seed}"), Some(class), Some(Arc::clone(craft)))
                });
                cases.collect()
            }
        }
    }

    pub(super) fn with_controllers(mut self, controllers: &[Controller]) -> Self {
        let numbers = 0..controllers.len();
        let taking_part = numbers.filter(|&number| controllers[number].takes_part(&self.scenario));
        self.controllers = taking_part.collect();
        self
    }

    /// The scenario with these numbers in place of its own.
    pub(super) fn with_parameters(
        &self,
        parameters: &[(&str, f64)],
        duration: Option<f64>,
    ) -> Result<Scenario, InvalidScenario> {
        let mut scenario = self.as_written.clone();
        for (key, value) in parameters {
            scenario.set(key, *value)?;
        }
        Ok(prepared(scenario, (self.class.as_ref(), self.drawn.as_ref()), duration))
    }

    /// The craft's response by step tests; none if the scenario draws its craft.
    pub(in crate::campaign) fn response(&self) -> Option<Craft> {
        if let Some(drawn) = &self.drawn {
            return Some(drawn.tested.craft);
        }
        let class = match self.scenario.surface_craft.first()?.class {
            SurfaceClassFile::Medusa => SurfaceClass::Medusa,
            SurfaceClassFile::Otter => SurfaceClass::Otter,
            SurfaceClassFile::Random(_) => return None,
        };
        Some(class.craft().craft())
    }
}

/// `scenario` with the case's craft, for `duration_max` s at most.
fn prepared(
    mut scenario: Scenario,
    (class, drawn): (Option<&SurfaceClassFile>, Option<&Arc<RandomCraft>>),
    duration_max: Option<f64>,
) -> Scenario {
    if let Some(duration) = duration_max {
        let whole = scenario.duration_s.most();
        scenario = scenario.lasting(whole.min(duration));
    }
    if let Some(class) = class {
        for craft in &mut scenario.surface_craft {
            (craft.class, craft.drawn) = (class.clone(), drawn.cloned());
        }
    }
    scenario
}
