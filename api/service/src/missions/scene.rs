//! The scene of a mission: the facts that a map shows beside the vehicles.

use std::collections::BTreeMap;

use sim::fault::Fault;
use sim::record::Record;
use sim::scenario::{CurrentKnowledge, Scenario};

use super::simulation;
use wire::{
    Origin, Task,
    mission::{Live, NewMission, Scene, SceneFault, Simulated},
};

/// Most points of a path: a picture of a thousand pixels shows no more.
const PATH_POINTS_MAX: usize = 400;

/// The scene of a mission from its creation; empty for scenarios that this program lacks.
pub(super) fn scene(mission: &NewMission) -> Scene {
    match (&mission.live, &mission.simulated) {
        (Some(live), _) => of_live(live),
        (None, Some(simulated)) => of_simulated(simulated).unwrap_or_default(),
        (None, None) => Scene::default(),
    }
}

fn of_live(live: &Live) -> Scene {
    let paths = live.auvs.iter().filter_map(|auv| {
        let path = auv.path.as_ref()?.path().ok()?;
        let at = |k: usize| path.length() * k as f64 / (PATH_POINTS_MAX - 1) as f64;
        let points = (0..PATH_POINTS_MAX).map(|k| path.at(at(k)).position);
        Some((auv.id.clone(), points.map(|point| [point.x, point.y]).collect()))
    });
    Scene {
        period_s: live.period_s,
        clock_rate: live.clock_rate,
        auvs: live.auvs.iter().map(|auv| auv.id.clone()).collect(),
        surface_craft: live.surface_craft.iter().map(|craft| craft.id.0.clone()).collect(),
        keep_outs: live.keep_outs.clone(),
        no_go: live.no_go.clone(),
        area: live.area.clone(),
        range_max_m: live.acoustics.as_ref().map(|acoustics| acoustics.range_max_m),
        paths: paths.collect(),
        origin: live.origin,
        ..Scene::default()
    }
}

fn of_simulated(simulated: &Simulated) -> Option<Scene> {
    let scenario = simulation::scenario(simulated).ok()?;
    let start = scenario.start(simulated.seed).ok()?;
    let (duration_s, settled_after_s) = (start.duration, start.settled_after);
    let briefing = start.observer.as_ref().map(|observer| &observer.briefing);
    let goal = briefing.map(|briefing| Task { goal: briefing.goal.clone(), offset: briefing.offset });
    let mission = sim::mission::Mission::from_start(start, &scenario, "", simulated.seed);
    let record = mission.record();
    let thinned = |points: &Vec<planner::nalgebra::Vector2<f64>>| {
        let step = points.len().div_ceil(PATH_POINTS_MAX).max(1);
        let last = points.last().into_iter();
        let kept = points.iter().step_by(step).chain(last);
        kept.map(|point| [point.x, point.y]).collect()
    };
    let ids = record.auv_ids.iter().cloned();
    let paths = ids.zip(record.paths.iter().map(thinned));
    let bounds = &record.bounds;
    Some(Scene {
        duration_s: Some(duration_s),
        settled_after_s: Some(settled_after_s),
        period_s: simulation::PERIOD,
        clock_rate: 1.0,
        scenario: simulated.scenario.clone(),
        seed: Some(simulated.seed),
        controller: Some(simulated.controller),
        gains: simulated.gains,
        information: Some(information(&scenario, simulated, &record.faults)),
        faults: faults(record),
        goal,
        auvs: record.auv_ids.clone(),
        surface_craft: vec![],
        keep_outs: bounds.keep_outs.clone(),
        no_go: bounds.no_go.clone(),
        area: bounds.area.iter().map(|corner| [corner.x, corner.y]).collect(),
        range_max_m: bounds.range_max,
        paths: paths.collect::<BTreeMap<_, _>>(),
        origin: record.origin.map(Origin::from),
    })
}

/// The faults that begin before the end, in the order of their starts.
fn faults(record: &Record) -> Vec<SceneFault> {
    let mut faults = record.faults.clone();
    faults.sort_by(|a, b| a.from.total_cmp(&b.from));
    let written = faults.iter().map(|fault| SceneFault {
        from_s: fault.from,
        until_s: fault.until.is_finite().then_some(fault.until),
        what: fault.in_words(&record.auv_ids),
    });
    written.collect()
}

/// The controller's knowledge, in words. All controllers have the same; laws use the present only.
fn information(scenario: &Scenario, simulated: &Simulated, faults: &[Fault]) -> String {
    let knowledge = &scenario.knowledge;
    let auvs = if knowledge.acoustics.is_some() {
        "AUVs by acoustic fixes, late, noisy or lost"
    } else {
        "every AUV's state, at once and exact"
    };
    let ceases = if faults.iter().any(Fault::stops_messages) {
        ", except while a fault stops its messages"
    } else {
        ""
    };
    let paths = match (knowledge.paths, simulated.controller.law().is_some()) {
        (true, false) => "their paths and dives",
        (true, true) => "their paths and dives, which a law does not use",
        (false, _) => "no paths",
    };
    let current = match knowledge.current {
        CurrentKnowledge::Known => "current known",
        CurrentKnowledge::Unknown => "current from its own velocities",
    };
    format!("{auvs}{ceases}; {paths}; {current}")
}
