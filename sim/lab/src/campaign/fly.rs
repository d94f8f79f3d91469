//! One run: a mission and its result.

use std::time::Instant;

use planner::{los::LosLaw, snapshot::Goal};
use sim::{
    guide::{Guide, GuideError},
    mission::Mission,
    record::Record,
};

use super::{
    controller::Controller,
    design::{Campaign, Condition, Run},
    grid::{Setting, grid, tuned},
    learnt::Learnt,
    rows::{Outcome, RunResult},
    score::{Score, steps_above},
};
use crate::{bound::bound_rms_m, http_guide::NoGuidance, stopwatch::timed};

/// Tolerance of the turn limit: planned references may turn as fast as the craft, up to rounding.
const ROUNDING: f64 = 1.0 + 1e-6;

/// A mission that was flown.
#[derive(Clone, Debug)]
pub(super) struct FlownMission {
    pub(super) record: Record,
    /// The planner's estimates of its craft; `None` for a law.
    pub(super) learnt: Option<Learnt>,
}

/// A mission of `controller` in `condition`, timed, at a point of its grid.
pub(super) fn fly(
    campaign: &Campaign,
    condition: Condition,
    controller: &Controller,
    setting: Setting,
) -> Result<FlownMission, GuideError> {
    let flown = fly_while(campaign, condition, controller, setting, &mut |_| true)?;
    Ok(flown.expect("nothing stops it"))
}

/// The same while `goes_on` is `true` after each plan; `None` if it stopped the mission.
pub(super) fn fly_while(
    campaign: &Campaign,
    condition: Condition,
    controller: &Controller,
    setting: Setting,
    goes_on: &mut dyn FnMut(&Mission) -> bool,
) -> Result<Option<FlownMission>, GuideError> {
    let scenario = controller.scenario(&campaign.scenario(condition)?);
    let seed = campaign.seed(condition);
    let mut start = scenario.start(seed)?;
    controller.vary_start(&mut start);
    let mut guide: Box<dyn Guide> = controller.guide(setting);
    let mut mission = Mission::from_start(start, &scenario, guide.name(), seed);
    let mut learnt: Option<Learnt> = None;
    while !mission.is_over() {
        let (time, interval) = (mission.time(), mission.record().interval);
        let snapshot = mission.observe()?;
        let asked = snapshot
            .as_ref()
            .map(|snapshot| timed(guide.as_mut(), snapshot))
            .transpose()?;
        if let (Some(known), Some(snapshot)) = (guide.craft_estimate(), &snapshot) {
            let tuned = &snapshot.tuned().craft;
            learnt.get_or_insert_default().look(time, interval, known, tuned);
        }
        mission.step(snapshot.as_ref().zip(asked));
        if !goes_on(&mission) {
            return Ok(None);
        }
    }
    Ok(Some(FlownMission {
        record: mission.into_record(),
        learnt,
    }))
}

/// The result of a run, without the bound. If the mission fails, the result says why. An external
/// law without an answer has no result: it may answer later.
pub(super) fn result(campaign: &Campaign, run: Run, gains: &RunGains) -> Result<RunResult, NoGuidance> {
    let controller = &campaign.controllers[run.controller];
    let begun = Instant::now();
    let flown = fly(campaign, run.condition, controller, gains.setting);
    let flown = match flown {
        Ok(flown) => Ok(flown),
        Err(error) => match error.downcast::<NoGuidance>() {
            Ok(away) if away.may_pass() => return Err(*away),
            Ok(wrong) => Err(wrong.to_string()),
            Err(error) => Err(error.to_string()),
        },
    };
    let took = begun.elapsed().as_secs_f64();
    let case = &campaign.cases[run.condition.case];
    let response = case.response();
    let outcome = flown.and_then(|flown| {
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
    Ok(RunResult {
        run: run.number,
        scenario: case.scenario.name.clone(),
        craft: case.craft.clone(),
        controller: controller.name.clone(),
        information: controller.information(),
        objectives: gains.objectives.clone(),
        replicate: run.condition.replicate,
        seed: campaign.seed(run.condition),
        tuning: controller
            .los_law()
            .zip(gains.setting.gains)
            .map(|(law, gains)| tuned(law, gains)),
        dwell_s: gains.setting.dwell_s,
        parameters: campaign
            .parameters(run.condition)
            .into_iter()
            .map(|(_, value)| value)
            .collect(),
        outcome,
        tested: response.map(|craft| [craft.heading.lag(), craft.surge.lag(), craft.sway_per_yaw_rate]),
        breaks_at_s: controller.breaks_at(),
        bound_rms_m: None,
        run_s: took,
    })
}

/// The gains of a run.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct RunGains {
    /// Gains of a law, time of a rule.
    pub(super) setting: Setting,
    /// Names of the objectives that they are best for.
    pub(super) objectives: String,
}

/// Lower bound of `rms_m` in this condition, m; `None` if unknown or different for controllers.
pub(super) fn bound(campaign: &Campaign, condition: Condition) -> Option<f64> {
    let controllers = campaign.cases[condition.case].controllers.iter();
    let controllers = controllers.map(|controller| &campaign.controllers[*controller]);
    let mut variations =
        controllers.map(|controller| controller.variation.filter(|variation| variation.changes_craft()));
    let first = variations.next()?;
    if variations.any(|variation| variation != first) {
        return None;
    }
    let briefed = campaign
        .scenario(condition)
        .ok()?
        .start(campaign.seed(condition))
        .ok()?;
    // The controller itself chooses the place of a goal that visits.
    if matches!(briefed.observer?.briefing.goal, Goal::Visit(_)) {
        return None;
    }
    // Goal, current and plant are the same under every controller.
    let controller = Controller {
        variation: first,
        ..Controller::law(LosLaw::SaturatedLos)
    };
    let setting = Setting {
        gains: Some(grid(LosLaw::SaturatedLos)[0].into()),
        dwell_s: None,
    };
    let flown = fly(campaign, condition, &controller, setting).ok()?;
    bound_rms_m(&flown.record)
}
