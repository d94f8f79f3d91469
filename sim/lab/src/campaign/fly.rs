//! One run: a mission flown, and what it came to.

use std::time::Instant;

use planner::los::{LosLaw, LosTuning};
use sim::{
    guide::{Guide, GuideError},
    mission::run_from,
    record::Record,
};

use super::{
    design::{Campaign, Run, World},
    rows::Row,
};
use crate::{
    bench::{Contender, Score},
    regret::regret,
    stopwatch::Stopwatch,
};

/// A mission of `contender` in `world`, timed. `tuning` is a law's.
pub(super) fn fly(
    campaign: &Campaign,
    world: World,
    contender: &Contender,
    tuning: Option<LosTuning>,
) -> Result<Record, GuideError> {
    let scenario = contender.scenario(&campaign.scenario(world)?);
    let seed = campaign.seed(world);
    let mut start = scenario.start(seed)?;
    campaign.arenas[world.arena].declare(&mut start);
    if let Some(variation) = contender.variation {
        variation.vary_start(&mut start);
    }
    let mut guide: Box<dyn Guide> = contender.guide(tuning);
    let mut stopwatch = Stopwatch::new(guide.as_mut());
    run_from(start, &scenario, &mut stopwatch, seed, &mut |_| {})
}

/// What a run came to. A mission that fails gives a row that says why.
pub(super) fn row(campaign: &Campaign, run: Run, flight: &Flight, bound_rms_m: Option<f64>) -> Row {
    let contender = &campaign.controllers[run.controller];
    let begun = Instant::now();
    let flown = fly(campaign, run.world, contender, flight.tuning);
    let took = begun.elapsed().as_secs_f64();
    let outcome = flown.map_err(|error| error.to_string()).and_then(|record| {
        Score::of(&record).ok_or_else(|| "there is no surface craft in the record".to_owned())
    });
    let arena = &campaign.arenas[run.world.arena];
    Row {
        run: run.number,
        scenario: arena.scenario.name.clone(),
        craft: arena.craft.clone(),
        controller: contender.name.clone(),
        information: contender.information(),
        objectives: flight.objectives.clone(),
        replicate: run.world.replicate,
        seed: campaign.seed(run.world),
        tuning: flight.tuning.or(contender.fixed_tuning()),
        parameters: campaign
            .parameters(run.world)
            .into_iter()
            .map(|(_, value)| value)
            .collect(),
        outcome,
        bound_rms_m,
        run_s: took,
    }
}

/// The gains that a run is flown at, and what for.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Flight {
    /// A tuned law's gains.
    pub(super) tuning: Option<LosTuning>,
    /// Names of the objectives that they are the best for.
    pub(super) objectives: String,
}

/// Root mean square distance to the goal that no craft could have come below in this world, m; none where that is unknown, or
/// not the same for all controllers.
pub(super) fn bound(campaign: &Campaign, world: World) -> Option<f64> {
    let mut variations = campaign.arenas[world.arena]
        .controllers
        .iter()
        .map(|&controller| campaign.controllers[controller].variation);
    let first = variations.next()?;
    if variations.any(|variation| variation != first) {
        return None;
    }
    // Where the goal went, in which current and on which plant, is the same under every controller.
    let anyone = Contender {
        variation: first,
        ..Contender::law(LosLaw::SaturatedLos)
    };
    let record = fly(campaign, world, &anyone, None).ok()?;
    regret(&record).ok().flatten().map(|regret| regret.bound_rms_m)
}
