//! One run: a mission and its result.

use std::time::Instant;

use planner::los::LosLaw;
use planner::parameters::Parameters;
use planner::snapshot::{Goal, Snapshot};
use sim::fleet::FleetMission;
use sim::guide::{Guide, GuideError};
use sim::mission::Mission;
use sim::record::Record;
use sim::scenario::Scenario;

use super::controller::{ControlLaw, Controller};
use super::design::{Campaign, Condition, Run};
use super::grid::{Setting, grid, tuned};
use super::learnt::CraftLearning;
use super::rows::{LEARNT, MORE, Rows, RunRow};
use super::score::{SCORES, Score, steps_above};
use crate::{
    bound::bound_rms_m,
    http_guide::NoGuidance,
    stopwatch::{CLOCK, timed},
};

/// Tolerance of the turn limit: planned references may turn as fast as the craft, up to rounding.
const ROUNDING: f64 = 1.0 + 1e-6;

#[derive(Clone, Debug)]
pub(crate) struct FlownMission {
    pub(crate) record: Record,
    /// The planner's estimates of its craft; `None` for a law.
    pub(super) learnt: Option<CraftLearning>,
}

/// A mission of `controller` in `condition`, timed, at a point of its grid.
pub(super) fn fly(
    campaign: &Campaign,
    condition: Condition,
    controller: &Controller,
    setting: Setting,
) -> Result<FlownMission, GuideError> {
    let flown = fly_while(campaign, condition, controller, setting, &mut |_, _| true)?;
    Ok(flown.expect("nothing stops it"))
}

/// The same while `goes_on` is `true` after each tick, which had that snapshot; `None` if stopped.
pub(crate) fn fly_while(
    campaign: &Campaign,
    condition: Condition,
    controller: &Controller,
    setting: Setting,
    goes_on: &mut dyn FnMut(&Mission, Option<&Snapshot>) -> bool,
) -> Result<Option<FlownMission>, GuideError> {
    let scenario = controller.scenario(&campaign.scenario(condition)?);
    let seed = campaign.seed(condition);
    if scenario.has_fleet() {
        return fly_fleet(&scenario, seed, controller, goes_on);
    }
    let mut start = scenario.start(seed)?;
    controller.vary_start(&mut start);
    let mut guide: Box<dyn Guide> = controller.guide(setting);
    let mut mission = Mission::from_start(start, &scenario, guide.name(), seed);
    let mut learnt: Option<CraftLearning> = None;
    while !mission.is_over() {
        let (time, interval) = (mission.time(), mission.record().interval);
        let snapshot = mission.observe()?;
        let asked = snapshot.as_ref().map(|snapshot| timed(guide.as_mut(), snapshot));
        let asked = asked.transpose()?;
        if let (Some(known), Some(snapshot)) = (guide.craft_estimate(), &snapshot) {
            let learnt = learnt.get_or_insert_default();
            learnt.observe(time, interval, known, &snapshot.tuned().craft);
        }
        mission.step(snapshot.as_ref().zip(asked));
        if !goes_on(&mission, snapshot.as_ref()) {
            return Ok(None);
        }
    }
    Ok(Some(FlownMission { record: mission.into_record(), learnt }))
}

/// The same of several craft, of which `goes_on` gets the first.
fn fly_fleet(
    scenario: &Scenario,
    seed: u64,
    controller: &Controller,
    goes_on: &mut dyn FnMut(&Mission, Option<&Snapshot>) -> bool,
) -> Result<Option<FlownMission>, GuideError> {
    let mut starts = scenario.starts(seed)?;
    for start in &mut starts {
        controller.vary_start(start);
    }
    let assigner = controller.entry.assign.clone().unwrap_or_default();
    let parameters = match &controller.law {
        ControlLaw::Planner { parameters, .. } => Parameters::clone(parameters),
        _ => Parameters::default(),
    };
    let mut mission = FleetMission::new(starts, scenario, (assigner, parameters), (seed, Some(CLOCK)));
    while !mission.is_over() {
        mission.step()?;
        let (first, snapshot) = mission.first();
        if !goes_on(first, snapshot) {
            return Ok(None);
        }
    }
    Ok(Some(FlownMission { record: mission.into_record(), learnt: None }))
}

/// The row of a run, whose condition has this lower bound of `rms_m`. If the mission fails, the row
/// says why. An external law without an answer has no row: it may answer later.
pub(super) fn result(
    campaign: &Campaign,
    run: Run,
    gains: &RunGains,
    bound_rms_m: Option<f64>,
) -> Result<RunRow, NoGuidance> {
    let controller = &campaign.controllers[run.controller];
    let begun = Instant::now();
    let flown = match fly(campaign, run.condition, controller, gains.setting) {
        Ok(flown) => Ok(flown),
        Err(error) => match error.downcast::<NoGuidance>() {
            Ok(away) if away.may_pass() => return Err(*away),
            Ok(wrong) => Err(wrong.to_string()),
            Err(error) => Err(error.to_string()),
        },
    };
    let took = begun.elapsed().as_secs_f64();
    let scored = flown.and_then(|flown| {
        let score = Score::of(&flown.record).ok_or("there is no surface craft in the record")?;
        Ok((score, flown))
    });
    Ok(row(campaign, run, gains, &scored, bound_rms_m, took))
}

/// The table of a campaign, without rows.
pub(super) fn no_rows(campaign: &Campaign) -> Rows {
    let (run, gains) = (Run::default(), RunGains::default());
    Rows::without_rows(row(campaign, run, &gains, &Err(String::new()), None, 0.0))
}

/// The row of a run that took so long, s, and that was flown and scored, or failed.
fn row(
    campaign: &Campaign,
    run: Run,
    gains: &RunGains,
    scored: &Result<(Score, FlownMission), String>,
    bound_rms_m: Option<f64>,
    took: f64,
) -> RunRow {
    let controller = &campaign.controllers[run.controller];
    let case = &campaign.cases[run.condition.case];
    let law = controller.los_law().zip(gains.setting.gains);
    let law = law.map(|(law, gains)| tuned(law, gains));
    let score = scored.as_ref().ok().map(|(score, _)| score);
    let learnt = scored.as_ref().ok().and_then(|(_, flown)| flown.learnt.as_ref());
    let response = case.response();
    let too_fast = response.zip(scored.as_ref().ok()).map(|(response, (_, flown))| {
        let (above, all) = steps_above(ROUNDING * response.heading.rate_max, &flown.record);
        100.0 * above / all
    });
    let tested = response.map(|craft| [craft.heading.lag(), craft.surge.lag(), craft.sway_per_yaw_rate]);

    let mut row = RunRow::default();
    row.count("run", run.number);
    row.word("scenario", &case.scenario.name);
    row.word("craft", &case.craft);
    row.word("controller", &controller.name);
    row.word("information", &controller.information());
    row.word("objectives", &gains.objectives);
    row.count("replicate", run.condition.replicate);
    row.count("seed", campaign.seed(run.condition));
    row.number("look_ahead_m", law.map(|law| law.gains.look_ahead));
    let along_track_gain = law.map(|law| law.gains.along_track_gain);
    row.number("along_track_gain_per_s", along_track_gain);
    row.number("integral_gain_mps", law.map(|law| law.integral_gain));
    row.number("dwell_s", gains.setting.dwell_s);
    row.number("figure_radius_m", gains.setting.figure.map(|figure| figure.radius_m));
    row.number("figure_speed_share", gains.setting.figure.map(|figure| figure.speed_share));
    for (key, value) in campaign.parameters(run.condition) {
        row.number(&format!("param.{key}"), Some(value));
    }
    for column in SCORES {
        row.number(column.0, score.and_then(|score| score.value(column)));
    }
    let [too_fast_steps, alarms, alarm_s, noticed] = MORE;
    row.number(too_fast_steps, too_fast);
    row.number(alarms, learnt.map(|learnt| learnt.alarms_at_s.len() as f64));
    row.number(alarm_s, learnt.map(|learnt| learnt.alarm_s));
    let broken = learnt.zip(controller.breaks_at());
    let noticed_after_s = broken.and_then(|(learnt, at)| learnt.noticed_after_s(at));
    row.number(noticed, noticed_after_s);
    for (k, [value, sigma, of_test]) in LEARNT.into_iter().enumerate() {
        let estimate = learnt.and_then(|learnt| Some(learnt.estimates?[k]));
        row.number(value, estimate.map(|(value, _)| value));
        row.number(sigma, estimate.map(|(_, sigma)| sigma));
        row.number(of_test, tested.map(|tested| tested[k]));
    }
    row.number("bound_rms_m", bound_rms_m);
    row.word("failure", scored.as_ref().err().map_or("", |why| why));
    row.number("solve_ms_p50", score.and_then(|score| score.metrics.solve_ms_p50));
    row.number("solve_ms_p99", score.and_then(|score| score.metrics.solve_ms_p99));
    row.number("run_s", Some(took));
    row
}

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
    let changes = |controller: &Controller| {
        let variation = controller.entry.variation;
        variation.filter(|variation| variation.changes_craft())
    };
    let mut variations = controllers.map(changes);
    let first = variations.next()?;
    if variations.any(|variation| variation != first) {
        return None;
    }
    let scenario = campaign.scenario(condition).ok()?;
    let briefed = scenario.start(campaign.seed(condition)).ok()?;
    // The controller itself chooses the place of a goal that visits or localises.
    if matches!(briefed.observer?.briefing.goal, Goal::Visit(_) | Goal::Localise(_)) {
        return None;
    }
    // Goal, current and plant are the same under every controller.
    let mut controller = Controller::law(LosLaw::SaturatedLos);
    controller.entry.variation = first;
    let setting = Setting { gains: Some(grid(LosLaw::SaturatedLos)[0].into()), ..Setting::default() };
    let flown = fly(campaign, condition, &controller, setting).ok()?;
    bound_rms_m(&flown.record)
}
