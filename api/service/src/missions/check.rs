//! What is wrong with a mission that is to be made, or with reports that were posted.

use std::ops::RangeInclusive;

use planner::snapshot::{AUVS_MAX, REPORTS_MAX, Snapshot};
use serde_json::json;

use super::{
    simulation,
    state::{AHEAD_MAX, trial_request},
};
use wire::FieldError;
use wire::{
    METADATA_BYTES_MAX, PlanRequest, Segment, SegmentKind,
    mission::{Live, NewMission, Reports, Setting, Simulated},
    unsupported_version,
};

/// Longest title, bytes.
const TITLE_BYTES_MAX: usize = 200;
/// Longest note, bytes.
const NOTE_BYTES_MAX: usize = 500;
/// Longest scenario, bytes.
const SCENARIO_BYTES_MAX: usize = 64 << 10;
/// Time between two plans, s.
const PERIOD: RangeInclusive<f64> = 0.5..=60.0;
/// Seconds of a rehearsal's clock in one.
const CLOCK_RATE: RangeInclusive<f64> = 1.0..=60.0;
/// Shortest time between two plans of a rehearsal in real time, s.
const REAL_PERIOD_MIN: f64 = 0.05;
/// Seconds of a simulated mission in one.
const SPEED_FACTOR: RangeInclusive<f64> = 0.1..=1000.0;
/// Plans that are asked for at once.
const TICKS: RangeInclusive<u32> = 1..=60;
/// How old what was heard may be, s: what is older is no time on the mission's clock.
const AGE_MAX: f64 = 86_400.0;

pub(crate) fn new_mission(new: &NewMission) -> Result<(), Vec<FieldError>> {
    let mut errors = Vec::from_iter(unsupported_version(&new.schema_version));
    if let Some(title) = &new.title
        && TITLE_BYTES_MAX < title.len()
    {
        errors.push(too_long("/title", title.len(), TITLE_BYTES_MAX));
    }
    let metadata = serde_json::to_vec(&new.metadata).map_or(0, |bytes| bytes.len());
    if METADATA_BYTES_MAX < metadata {
        errors.push(too_long("/metadata", metadata, METADATA_BYTES_MAX));
    }
    match (&new.live, &new.simulated) {
        (Some(live), None) => errors.extend(check_live(live)),
        (None, Some(simulated)) => errors.extend(check_simulated(simulated)),
        _ => {
            let detail = "give either simulated or live, and not both";
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
        let detail = "is what the surface craft is called";
        errors.push(FieldError::new(format!("/live/auvs/{auv}/id"), "reserved", detail).given("asc"));
    }
    if let Err(wrong) = Snapshot::try_from(&trial_request(config, 0.0)) {
        errors.extend(moved(wrong, "", "/live"));
    }
    errors
}

fn check_simulated(config: &Simulated) -> Vec<FieldError> {
    let (pointer, length) = match (&config.scenario, &config.scenario_file) {
        (Some(_), None) => ("/simulated/scenario", 0),
        (None, Some(text)) => ("/simulated/scenario_file", text.len()),
        _ => ("/simulated", 0),
    };
    if SCENARIO_BYTES_MAX < length {
        return vec![too_long(pointer, length, SCENARIO_BYTES_MAX)];
    }
    // Some scenarios cannot start with some seeds.
    let started = simulation::Simulation::new(config);
    let errors = started
        .err()
        .map(|wrong| FieldError::new(pointer, "invalid", wrong));
    errors.into_iter().collect()
}

/// What is wrong with `heard` by the mission's clock at `now`, s.
pub(crate) fn reports(config: &Live, heard: &Reports, now: f64) -> Result<(), Vec<FieldError>> {
    let mut errors = vec![];
    let time = |pointer: String, time: f64| {
        let limits = now - AGE_MAX..=now + AHEAD_MAX;
        let clock = "the mission's clock (Unix time but in rehearsals)";
        (!limits.contains(&time)).then(|| FieldError::off_the_clock(pointer, time, clock, now, &limits))
    };
    let received = heard.received_s;
    errors.extend(received.and_then(|received| time("/received_s".to_owned(), received)));
    if heard.auvs.is_empty() && heard.asc.is_empty() && heard.notes.is_empty() {
        errors.push(FieldError::new("", "missing", "give auvs, asc or notes"));
    }
    if AUVS_MAX < heard.auvs.len() {
        errors.push(too_long("/auvs", heard.auvs.len(), AUVS_MAX));
    }
    for (pointer, given) in [("/asc", heard.asc.len()), ("/notes", heard.notes.len())]
        .into_iter()
        .chain(heard.auvs.values().map(|fixes| ("/auvs", fixes.len())))
    {
        if REPORTS_MAX < given {
            errors.push(too_long(pointer, given, REPORTS_MAX));
        }
    }
    if !errors.is_empty() {
        return Err(errors);
    }
    let mut trial = short_trial(config, now);
    trial.keep_outs.clear();
    let at_rest = trial.auvs.first().and_then(|auv| auv.reports.clone());
    for (id, fixes) in &heard.auvs {
        let Some(auv) = config.auvs.iter().position(|auv| auv.id == *id) else {
            let known: Vec<&str> = config.auvs.iter().map(|auv| auv.id.as_str()).collect();
            let pointer = format!("/auvs/{}", token(id));
            let error = FieldError::new(pointer, "unknown_auv", "the mission has no such AUV");
            errors.push(error.given(id.clone()).limit(json!(known)));
            continue;
        };
        for (i, fix) in fixes.iter().enumerate() {
            errors.extend(time(format!("/auvs/{}/{i}/t_s", token(id)), fix.t_s));
        }
        // Values are checked as those of fixes of now: their times are checked above, and kept.
        let fixes = fixes.iter().map(|fix| wire::Report { t_s: now, ..*fix });
        trial.auvs[auv].reports = Some(fixes.collect());
        if let Err(wrong) = Snapshot::try_from(&trial) {
            let here = format!("/auvs/{auv}/reports");
            errors.extend(moved(wrong, &here, &format!("/auvs/{}", token(id))));
        }
        trial.auvs[auv].reports.clone_from(&at_rest);
    }
    for (i, note) in heard.notes.iter().enumerate() {
        errors.extend(time(format!("/notes/{i}/t_s"), note.t_s));
        if NOTE_BYTES_MAX < note.text.len() {
            errors.push(too_long(
                &format!("/notes/{i}/text"),
                note.text.len(),
                NOTE_BYTES_MAX,
            ));
        }
    }
    for (i, state) in heard.asc.iter().enumerate() {
        errors.extend(time(format!("/asc/{i}/t_s"), state.t_s));
        trial.asc = state.state.clone();
        trial.current = state.current.or(config.current);
        if let Err(wrong) = Snapshot::try_from(&trial) {
            let (current, state): (Vec<_>, Vec<_>) = wrong
                .into_iter()
                .partition(|error| error.pointer.starts_with("/current"));
            errors.extend(moved(state, "/asc", &format!("/asc/{i}/state")));
            errors.extend(moved(current, "/current", &format!("/asc/{i}/current")));
        }
    }
    none(errors)
}

/// What is wrong with a `patch`, whatever the mission.
pub(crate) fn patch(patch: &Setting) -> Result<(), Vec<FieldError>> {
    none((*patch == Setting::default()).then(|| {
        let detail = "give what is to change: goal, limits, craft, keep_outs or area";
        let limit = json!({ "least": 1, "most": Setting::MEMBERS });
        FieldError::new("", "missing", detail).limit(limit)
    }))
}

/// What is wrong with a mission whose setting was changed to the one in `config`. The pointers are those of the setting.
pub(crate) fn changed(config: &Live) -> Result<(), Vec<FieldError>> {
    Snapshot::try_from(&short_trial(config, 0.0)).map(drop)
}

/// [`trial_request`] without the paths and dives, which were checked when the mission was made and are long to check again.
fn short_trial(config: &Live, now: f64) -> PlanRequest {
    let mut trial = trial_request(config, now);
    for auv in &mut trial.auvs {
        auv.dive = None;
        // A goal may need one.
        if let Some(path) = &mut auv.path {
            path.closed = false;
            path.segments = vec![Segment {
                kind: SegmentKind::Line,
                from: Some([0.0, 0.0]),
                to: Some([1.0, 0.0]),
                centre: None,
                angle_rad: None,
                points: None,
                fillet_m: None,
            }];
        }
    }
    trial
}

pub(crate) fn speed_factor(given: Option<f64>) -> Result<(), Vec<FieldError>> {
    none(given.and_then(|factor| FieldError::outside("/speed_factor", factor, &SPEED_FACTOR)))
}

pub(crate) fn ticks(given: u32) -> Result<(), Vec<FieldError>> {
    none(FieldError::outside("/ticks", given, &TICKS))
}

fn too_long(pointer: &str, given: usize, limit: usize) -> FieldError {
    let detail = format!("must be at most {limit} long, not {given}");
    FieldError::new(pointer, "too_long", detail)
        .given(given)
        .limit(json!({ "most": limit }))
}

fn none(errors: impl IntoIterator<Item = FieldError>) -> Result<(), Vec<FieldError>> {
    let errors = Vec::from_iter(errors);
    if errors.is_empty() { Ok(()) } else { Err(errors) }
}

/// The same errors, where the client finds what they are about.
fn moved(errors: Vec<FieldError>, from: &str, to: &str) -> Vec<FieldError> {
    let moved = |mut error: FieldError| {
        let rest = error.pointer.strip_prefix(from).unwrap_or(&error.pointer);
        error.pointer = format!("{to}{rest}");
        error
    };
    errors.into_iter().map(moved).collect()
}

/// Source: RFC 6901, section 3.
fn token(name: &str) -> String {
    name.replace('~', "~0").replace('/', "~1")
}
