//! Validation of new missions, of changes and of reports.

use std::ops::RangeInclusive;

use clock::Clock;
use planner::fleet::{CRAFT_MAX, HAND_OVER, Member};
use planner::{los::LawGains, snapshot::pointer_token};
use serde_json::json;

use super::clock::AHEAD_MAX;
use super::simulation;
use super::state::trial_request;
use wire::mission::{Controller, Live, LiveCraft, Mission, NewMission, Reports, Setting, Simulated};
use wire::{FieldError, METADATA_BYTES_MAX, PlanRequest, Segment, check, shortened, unsupported_version};

pub(crate) const TITLE_BYTES_MAX: usize = 200;
pub(crate) const NOTE_BYTES_MAX: usize = 500;
const SCENARIO_BYTES_MAX: usize = 64 << 10;
/// Time between two plans, s.
pub(crate) const PERIOD: RangeInclusive<f64> = 0.5..=60.0;
/// Seconds of a rehearsal's clock in one second.
pub(crate) const CLOCK_RATE: RangeInclusive<f64> = 1.0..=60.0;
/// Shortest time between two plans of a rehearsal in real time, s.
const REAL_PERIOD_MIN: f64 = 0.05;
/// Seconds of a simulated mission in one second.
pub(crate) const SPEED_FACTOR: RangeInclusive<f64> = 0.1..=1000.0;
/// Plans of one step.
pub(crate) const TICKS: RangeInclusive<u32> = 1..=60;
/// Share of a surface craft's energy that is left.
pub(crate) const BATTERY: RangeInclusive<f64> = 0.0..=1.0;
/// Greatest age of a report, s. An older time is not on the mission's clock.
const AGE_MAX: f64 = 86_400.0;
/// Greatest age of a state of the surface craft, s: an older one steers nothing. Less than a time
/// zone, because receivers and modems state local time as UTC.
const STATE_AGE_MAX: f64 = 1800.0;

pub(crate) fn new_mission(new: &NewMission) -> Result<(), Vec<FieldError>> {
    let mut errors = Vec::from_iter(unsupported_version(&new.schema_version));
    if let Some(title) = &new.title
        && TITLE_BYTES_MAX < title.len()
    {
        errors.push(FieldError::too_long("/title", title.len(), TITLE_BYTES_MAX));
    }
    let metadata = serde_json::to_vec(&new.metadata).map_or(0, |bytes| bytes.len());
    if METADATA_BYTES_MAX < metadata {
        errors.push(FieldError::too_long("/metadata", metadata, METADATA_BYTES_MAX));
    }
    match (&new.live, &new.simulated) {
        (Some(live), None) => errors.extend(check_live(live)),
        (None, Some(simulated)) => errors.extend(check_simulated(simulated)),
        _ => {
            let detail = "give `live` or `simulated`, one of them";
            errors.push(FieldError::new("", "one_of", detail));
        }
    }
    none(errors)
}

fn check_live(config: &Live) -> Vec<FieldError> {
    let mut errors = vec![];
    let rate = |range| FieldError::outside("/live/clock_rate", config.clock_rate, range);
    errors.extend(FieldError::outside("/live/period_s", config.period_s, &PERIOD));
    errors.extend(rate(&CLOCK_RATE));
    if errors.is_empty() && config.period_s / config.clock_rate < REAL_PERIOD_MIN {
        let most = config.period_s / REAL_PERIOD_MIN;
        errors.extend(rate(&(1.0..=most)));
    }
    if let Some(auv) = config.auvs.iter().position(|auv| auv.id == "asc") {
        let detail = "is the name of the surface craft";
        errors.push(FieldError::new(format!("/live/auvs/{auv}/id"), "reserved", detail).given("asc"));
    }
    if let Err(wrong) = trial(config, |_| {}) {
        errors.extend(wrong.into_iter().map(|mut error| {
            error.pointer.insert_str(0, "/live");
            error
        }));
    }
    errors
}

/// The faults of the mission of `config`, whose request `shorten` may shorten.
fn trial(config: &Live, shorten: impl Fn(&mut PlanRequest)) -> Result<(), Vec<FieldError>> {
    let outside = |hand_over: f64| FieldError::outside("/hand_over_s", hand_over, &HAND_OVER);
    if let Some(fault) = config.hand_over_s.and_then(outside) {
        return Err(vec![fault]);
    }
    if config.surface_craft.is_empty() {
        if config.hand_over_s.is_some() {
            let detail = "a mission of one craft hands nothing over: leave this one out";
            return Err(vec![FieldError::new("/hand_over_s", "contradicts", detail)]);
        }
        let mut alone = trial_request((config, None), 0.0);
        shorten(&mut alone);
        return check(&alone);
    }
    let craft = &config.surface_craft;
    if let Some(length) = FieldError::of_length("/surface_craft", craft.len(), &(1..=CRAFT_MAX), "items") {
        return Err(vec![length]);
    }
    let mut errors = vec![];
    for (member, is_given) in [("limits", config.limits.is_some()), ("craft", config.craft.is_some())] {
        if is_given {
            let detail = "each of `surface_craft` has its own: leave this one out";
            errors.push(FieldError::new(format!("/{member}"), "contradicts", detail));
        }
    }
    for (i, LiveCraft { id, battery_min, .. }) in craft.iter().enumerate() {
        let pointer = || format!("/surface_craft/{i}/battery_min");
        errors.extend(battery_min.and_then(|least| FieldError::outside(pointer(), least, &BATTERY)));
        let detail = "is the name of an AUV";
        if config.auvs.iter().any(|auv| auv.id == id.0) {
            errors.push(FieldError::new(format!("/surface_craft/{i}/id"), "duplicate", detail).given(&*id.0));
        }
    }
    let members = craft.iter().map(|craft| {
        let mut request = trial_request((config, Some(&craft.id.0)), 0.0);
        shorten(&mut request);
        Member {
            id: craft.id.clone(),
            serves: craft.serves.clone(),
            is_away: false,
            place_before: 0,
            request,
        }
    });
    errors.extend(Member::faults(&members.collect::<Vec<_>>(), &[]));
    none(errors)
}

/// The fault of a call about `craft`, as code and detail: the mission has no such craft, or it has
/// several and none is named.
pub(crate) fn craft(mission: &Mission, craft: Option<&str>) -> Option<(&'static str, String)> {
    let fleet = mission.setting.as_ref().and_then(|setting| setting.surface_craft.as_deref());
    let known: Vec<&str> = fleet.unwrap_or_default().iter().map(|craft| &*craft.id.0).collect();
    let all = known.join(", ");
    match craft {
        None if known.is_empty() => None,
        None => Some(("missing", format!("the mission has several craft: name one of {all}"))),
        Some(craft) if known.contains(&craft) => None,
        Some(_) if known.is_empty() => {
            Some(("unknown_craft", "the mission has one craft, without a name: leave this out".to_owned()))
        }
        Some(_) => Some(("unknown_craft", format!("the mission has no such craft, but {all}"))),
    }
}

fn check_simulated(config: &Simulated) -> Vec<FieldError> {
    let (pointer, length) = match (&config.scenario, &config.scenario_file) {
        (Some(_), None) => ("/simulated/scenario", 0),
        (None, Some(text)) => ("/simulated/scenario_file", text.len()),
        _ => ("/simulated", 0),
    };
    if SCENARIO_BYTES_MAX < length {
        return vec![FieldError::too_long(pointer, length, SCENARIO_BYTES_MAX)];
    }
    let tuning = config.tuning.as_ref();
    let levers = tuning.map_or_else(Vec::new, |tuning| tuning.faults("/simulated/tuning"));
    if !levers.is_empty() {
        return levers;
    }
    if let Some(gains) = &config.gains {
        let errors = wrong_gains(gains, config.controller);
        if !errors.is_empty() {
            return errors;
        }
    }
    // Some scenarios cannot start with some seeds.
    let started = simulation::Simulation::new(config, &Clock::machine());
    let wrong = |wrong| FieldError::new(pointer, "invalid", wrong);
    started.err().map(wrong).into_iter().collect()
}

fn wrong_gains(gains: &LawGains, controller: Controller) -> Vec<FieldError> {
    if controller.law().is_none() {
        let detail = "apply to laws only: set `controller` to a law";
        return vec![FieldError::new("/simulated/gains", "invalid", detail)];
    }
    let given = LawGains::RANGES.into_iter().zip(gains.values());
    let outside = |((member, range), value): ((&str, RangeInclusive<f64>), Option<f64>)| {
        FieldError::outside(format!("/simulated/gains/{member}"), value?, &range)
    };
    given.filter_map(outside).collect()
}

/// The fault of a report's time at `pointer`, received at `now` on the mission's clock, s.
fn off_the_clock(pointer: &str, time: f64, now: f64, age_max: f64) -> Option<FieldError> {
    let limits = now - age_max..=now + AHEAD_MAX;
    let clock = "the mission's clock (Unix time, except in rehearsals)";
    (!limits.contains(&time)).then(|| FieldError::off_the_clock(pointer, time, clock, now, &limits))
}

/// Fails if reports were received at an impossible time.
pub(crate) fn received(received_s: Option<f64>, now: f64) -> Result<(), Vec<FieldError>> {
    none(received_s.and_then(|received| off_the_clock("/received_s", received, now, AGE_MAX)))
}

/// The faults of the only report of `heard` at `now` on the mission's clock, s.
pub(crate) fn report(config: &Live, heard: &Reports, now: f64) -> Vec<FieldError> {
    let mut errors = vec![];
    let time = |pointer: String, time: f64| off_the_clock(&pointer, time, now, AGE_MAX);
    for (id, fixes) in &heard.auvs {
        if !config.auvs.iter().any(|auv| auv.id == *id) {
            errors.push(unknown_auv(config, "auvs", id));
            continue;
        }
        let token = pointer_token(id);
        for (i, fix) in fixes.iter().enumerate() {
            let place = format!("/auvs/{token}/{i}");
            errors.extend(time(format!("{place}/t_s"), fix.t_s));
            // The time has been checked.
            errors.extend(wire::Report { t_s: now, ..*fix }.faults(&place, now));
        }
    }
    let too_long = |pointer: String, text: &str| {
        (NOTE_BYTES_MAX < text.len()).then(|| FieldError::too_long(pointer, text.len(), NOTE_BYTES_MAX))
    };
    for (i, vessel) in heard.traffic.iter().enumerate() {
        let place = format!("/traffic/{i}");
        errors.extend(vessel.t_s.and_then(|then| time(format!("{place}/t_s"), then)));
        errors.extend(wire::Vessel { t_s: None, ..vessel.clone() }.faults(&place));
    }
    for (i, note) in heard.notes.iter().enumerate() {
        errors.extend(time(format!("/notes/{i}/t_s"), note.t_s));
        errors.extend(too_long(format!("/notes/{i}/text"), &note.text));
    }
    for (i, said) in heard.steering.iter().enumerate() {
        let pointer = format!("/steering/{i}/t_s");
        errors.extend(off_the_clock(&pointer, said.t_s, now, STATE_AGE_MAX));
        errors.extend(too_long(format!("/steering/{i}/why"), &said.why));
    }
    for (i, report) in heard.asc.iter().enumerate() {
        let pointer = format!("/asc/{i}/t_s");
        errors.extend(off_the_clock(&pointer, report.t_s, now, STATE_AGE_MAX));
        errors.extend(report.state.faults(&format!("/asc/{i}/state")));
        let outside = |battery| FieldError::outside(format!("/asc/{i}/battery"), battery, &BATTERY);
        errors.extend(report.battery.and_then(outside));
        if let Some(current) = report.current {
            errors.extend(current.faults(&format!("/asc/{i}/current")));
        }
    }
    errors
}

/// The faults of a `patch`, independently of the mission.
pub(crate) fn patch(patch: &Setting) -> Result<(), Vec<FieldError>> {
    if patch.origin == Some(None) {
        let detail = "the origin can be changed, not removed";
        return none([FieldError::new("/origin", "missing", detail)]);
    }
    none((*patch == Setting::default()).then(|| {
        let detail =
            "give at least one of goal, limits, craft, surface_craft, tuning, keep_outs, no_go, area, vessel_separation_m, paths and origin";
        let limit = json!({ "least": 1, "most": Setting::MEMBERS });
        FieldError::new("", "missing", detail).limit(limit)
    }))
}

/// The faults of a `patch` of the mission of `config` in any setting: AUVs that it does not have,
/// and a fleet in place of one craft or the reverse.
pub(crate) fn patch_of(config: &Live, patch: &Setting) -> Result<(), Vec<FieldError>> {
    let is_known = |id: &&String| config.auvs.iter().any(|auv| auv.id == **id);
    let unknown = patch.paths.keys().find(|id| !is_known(id));
    let fleet =
        patch.surface_craft.as_ref().filter(|fleet| fleet.is_empty() || config.surface_craft.is_empty());
    let no_fleet = fleet.map(|fleet| {
        let detail = "a fleet keeps at least one craft, and a mission of one craft has none by name: create another mission";
        FieldError::new("/surface_craft", "contradicts", detail).given(fleet.len())
    });
    none(unknown.map(|id| unknown_auv(config, "paths", id)).into_iter().chain(no_fleet))
}

/// The faults of a mission whose setting `patch` changed to that of `config`, with pointers into
/// the patch. `has_moved` is `true` if its origin was changed.
pub(crate) fn changed(config: &Live, patch: &Setting, has_moved: bool) -> Result<(), Vec<FieldError>> {
    let checked = trial(config, |request| {
        if !has_moved {
            shorten(request, patch);
        }
    });
    checked.map_err(|mut errors| {
        for error in &mut errors {
            for (i, auv) in config.auvs.iter().enumerate() {
                let rest = error.pointer.strip_prefix(&format!("/auvs/{i}/path"));
                if let Some(rest) = rest.filter(|rest| rest.is_empty() || rest.starts_with('/')) {
                    error.pointer = format!("/paths/{}{rest}", pointer_token(&auv.id));
                    break;
                }
            }
        }
        errors
    })
}

/// Removes dives and unpatched paths from a trial: they were checked before, which takes long.
fn shorten(trial: &mut PlanRequest, patch: &Setting) {
    for auv in &mut trial.auvs {
        auv.dive = None;
        if patch.paths.contains_key(&auv.id.0) {
            continue;
        }
        // The goal may need a path.
        if let Some(path) = &mut auv.path {
            path.closed = false;
            path.segments = vec![Segment::Line { from: [0.0, 0.0], to: [1.0, 0.0] }];
        }
    }
}

fn unknown_auv(config: &Live, member: &str, id: &str) -> FieldError {
    let known: Vec<&str> = config.auvs.iter().map(|auv| auv.id.as_str()).collect();
    let pointer = format!("/{member}/{}", pointer_token(&shortened(id.to_owned())));
    let error = FieldError::new(pointer, "unknown_auv", "the mission has no such AUV");
    error.given(id).limit(json!(known))
}

pub(crate) fn speed_factor(given: Option<f64>) -> Result<(), Vec<FieldError>> {
    none(given.and_then(|factor| FieldError::outside("/speed_factor", factor, &SPEED_FACTOR)))
}

pub(crate) fn ticks(given: u32) -> Result<(), Vec<FieldError>> {
    none(FieldError::outside("/ticks", given, &TICKS))
}

fn none(errors: impl IntoIterator<Item = FieldError>) -> Result<(), Vec<FieldError>> {
    let errors = Vec::from_iter(errors);
    if errors.is_empty() { Ok(()) } else { Err(errors) }
}
