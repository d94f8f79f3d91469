//! One run: a mission flown, and what it came to.

use std::{ops::ControlFlow, time::Instant};

use planner::{
    craft::CraftEstimate,
    los::{LosLaw, LosTuning},
};
use sim::{
    guide::{Guide, GuideError},
    mission::Mission,
    record::Record,
};

use super::{
    contender::Contender,
    design::{Campaign, Run, World},
    rows::{Outcome, Row},
    score::{Score, steps_above},
};
use crate::{regret::regret, stopwatch::timed};

/// When what the planner made of its craft is looked at, s.
const LEARNT_AT_S: f64 = 300.0;
/// A step of the heading reference that is larger than the craft turns by no more than this factor is rounding: the planner's references
/// turn as fast as the craft does where they must.
const ROUNDING: f64 = 1.0 + 1e-6;

/// A mission that was flown.
#[derive(Clone, Debug)]
pub(super) struct Flown {
    pub(super) record: Record,
    /// What the planner made of its craft; none of a law.
    pub(super) learnt: Option<Learnt>,
}

/// What a planner made of its craft on the way.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Learnt {
    /// When it began to say that the craft does not follow, s.
    pub(super) alarms_at_s: Vec<f64>,
    /// For how long it said so, s.
    pub(super) alarm_s: f64,
    /// Lag of the heading loop, lag of the surge loop and sway per yaw rate, s, each with its standard deviation, after
    /// `LEARNT_AT_S`; none of a shorter mission.
    pub(super) estimates: Option<[(f64, f64); 3]>,
    is_alarmed: bool,
}

impl Learnt {
    fn look(&mut self, time: f64, interval: f64, known: &CraftEstimate) {
        let alarm = known.monitor.alarm;
        if alarm {
            self.alarm_s += interval;
        }
        if alarm && !self.is_alarmed {
            self.alarms_at_s.push(time);
        }
        self.is_alarmed = alarm;
        if self.estimates.is_none() && LEARNT_AT_S <= time {
            let drift = (known.drift.mean, known.drift.variance.max(0.0).sqrt());
            self.estimates = Some([known.heading_lag(), known.surge_lag(), drift]);
        }
    }
}

/// What is asked after every plan of every mission: whether to go on. It may wait before it answers.
pub type GoOn<'a> = &'a (dyn Fn() -> ControlFlow<()> + Sync);

/// Never stops.
pub(super) const TO_THE_END: GoOn<'static> = &|| ControlFlow::Continue(());

/// It was stopped: what was under way came to nothing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Stopped;

/// A mission of `contender` in `world`, timed, or why it failed. `tuning` is a law's.
pub(super) fn fly(
    campaign: &Campaign,
    world: World,
    contender: &Contender,
    tuning: Option<LosTuning>,
    go_on: GoOn<'_>,
) -> Result<Result<Flown, GuideError>, Stopped> {
    let flown = fly_while(campaign, world, contender, tuning, &mut |_| go_on().is_continue());
    flown.transpose().ok_or(Stopped)
}

/// The same, as long as `goes_on`, which is asked after each plan; none where it was broken off.
pub(super) fn fly_while(
    campaign: &Campaign,
    world: World,
    contender: &Contender,
    tuning: Option<LosTuning>,
    goes_on: &mut dyn FnMut(&Mission) -> bool,
) -> Result<Option<Flown>, GuideError> {
    let scenario = contender.scenario(&campaign.scenario(world)?);
    let seed = campaign.seed(world);
    let mut start = scenario.start(seed)?;
    contender.vary_start(&mut start);
    let mut guide: Box<dyn Guide> = contender.guide(tuning);
    let mut mission = Mission::from_start(start, &scenario, guide.name(), seed);
    let mut learnt: Option<Learnt> = None;
    while !mission.is_over() {
        let (time, interval) = (mission.time(), mission.record().interval);
        let snapshot = mission.look()?;
        let asked = snapshot
            .as_ref()
            .map(|snapshot| timed(guide.as_mut(), snapshot))
            .transpose()?;
        if let Some(known) = guide.craft_estimate() {
            learnt.get_or_insert_default().look(time, interval, known);
        }
        mission.go_on(snapshot.as_ref().zip(asked));
        if !goes_on(&mission) {
            return Ok(None);
        }
    }
    Ok(Some(Flown {
        record: mission.into_record(),
        learnt,
    }))
}

/// What a run came to, without its world's bound. A mission that fails gives a row that says why.
pub(super) fn row(campaign: &Campaign, run: Run, flight: &Flight, go_on: GoOn<'_>) -> Result<Row, Stopped> {
    let contender = &campaign.controllers[run.controller];
    let begun = Instant::now();
    let flown = fly(campaign, run.world, contender, flight.tuning, go_on)?;
    let took = begun.elapsed().as_secs_f64();
    let arena = &campaign.arenas[run.world.arena];
    let response = arena.response();
    let outcome = flown.map_err(|error| error.to_string()).and_then(|flown| {
        let score = Score::of(&flown.record).ok_or("there is no surface craft in the record")?;
        let too_fast_steps_percent = response.map(|response| {
            let most = ROUNDING * response.heading.rate_max;
            let (above, all) = steps_above(most, &flown.record);
            100.0 * above / all
        });
        Ok(Outcome {
            score,
            too_fast_steps_percent,
            learnt: flown.learnt,
        })
    });
    Ok(Row {
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
        tested: response.map(|craft| [craft.heading.lag(), craft.surge.lag(), craft.sway_per_yaw_rate]),
        breaks_at_s: contender.breaks_at(),
        bound_rms_m: None,
        run_s: took,
    })
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
pub(super) fn bound(campaign: &Campaign, world: World, go_on: GoOn<'_>) -> Result<Option<f64>, Stopped> {
    let takes_part = |controller: &usize| &campaign.controllers[*controller];
    let mut variations = campaign.arenas[world.arena].controllers.iter().map(|controller| {
        takes_part(controller)
            .variation
            .filter(|variation| variation.changes_craft())
    });
    let Some(first) = variations.next() else {
        return Ok(None);
    };
    if variations.any(|variation| variation != first) {
        return Ok(None);
    }
    // Where the goal went, in which current and on which plant, is the same under every controller.
    let anyone = Contender {
        variation: first,
        ..Contender::law(LosLaw::SaturatedLos)
    };
    let flown = fly(campaign, world, &anyone, None, go_on)?;
    let regret = flown.ok().and_then(|flown| regret(&flown.record).ok().flatten());
    Ok(regret.map(|regret| regret.bound_rms_m))
}
