use super::*;
use crate::tests::prelude::*;

const HEADING: f64 = 0.4;

/// A current unknown to the vehicle, m/s.
const CURRENT: Vector2<f64> = Vector2::new(-0.03, 0.05);

const STILL: Vector2<f64> = Vector2::new(0.0, 0.0);

/// Report of a vehicle `at` a time, `age` seconds later, with its velocity through the water.
fn reported(at: f64, age: f64) -> AuvState {
    let through_the_water = direction(HEADING) * 0.29;
    let position = (through_the_water + CURRENT) * at;
    let mut state = AuvState::new(position, 5.0, Course::new(HEADING), 0.29);
    state.age_s = age;
    state
}

/// Successive forecasts from the states `reported` at `times`, s, each with the previous forecast.
fn in_turn(
    choice: Forecast,
    path: Option<&KnownPath>,
    times: impl IntoIterator<Item = f64>,
    reported: impl Fn(f64) -> AuvState,
) -> AuvForecast {
    let mut before: Option<(RememberedTarget, f64)> = None;
    let mut last = None;
    for now in times {
        let (intent, state) = (along(path), reported(now));
        let sent = now - state.age_s;
        let forecast = match &before {
            None => AuvForecast::new(&state, intent, choice, &STILL),
            Some((before, reported)) => {
                AuvForecast::after(before, sent - reported, &state, (intent, choice, &STILL))
            }
        };
        before = Some((left(&forecast, &state), sent));
        last = Some(forecast);
    }
    last.expect("a time at least")
}

fn along(path: Option<&KnownPath>) -> Intent<'_> {
    Intent { path, ..Intent::default() }
}

/// Forecasts without a path, once a second for `n` seconds.
fn each_second(n: u32, reported: impl Fn(f64) -> AuvState) -> AuvForecast {
    in_turn(Forecast::Auto, None, seconds(n), reported)
}

fn fresh(at: f64) -> AuvState {
    reported(at, 0.0)
}

/// Reports each `interval`, heard `latency` later.
fn each(interval: f64, latency: f64) -> impl Fn(f64) -> AuvState {
    move |now| {
        let sent = ((now - latency) / interval).floor() * interval;
        reported(sent, now - sent)
    }
}

/// Memory of a forecast for the next answer.
fn left(forecast: &AuvForecast, state: &AuvState) -> RememberedTarget {
    RememberedTarget { model: forecast.model, estimate: state.into(), drift: forecast.drift() }
}

fn seconds(n: u32) -> impl Iterator<Item = f64> {
    (0..=n).map(f64::from)
}

#[test]
fn the_drift_of_a_velocity_through_the_water_is_estimated() {
    for model in [ForecastModel::ConstantVelocity, ForecastModel::ConstantTurn] {
        let drift = |n| in_turn(Forecast::from(model), None, seconds(n), fresh).drift();
        assert_eq!(drift(0), STILL);
        // The error decreases by a thirtieth per second.
        for n in [10, 60, 300] {
            let missing = CURRENT * (1.0 - 1.0_f64 / 30.0).powf(f64::from(n));
            near_to(drift(n), CURRENT - missing, 1e-12);
        }
    }
}

#[test]
fn the_forecast_includes_the_drift() {
    let forecast = each_second(400, fresh);
    for ahead in [0.0, 10.0, 78.0] {
        let motion = forecast.at(ahead);
        near_to(motion.position, fresh(400.0 + ahead).position(), 1e-3);
        let moves = slope(|time| forecast.at(time).position, ahead, 1e-3);
        near_to(moves, motion.velocity, 1e-9);
    }
}

#[test]
fn late_and_rare_reports_give_the_same_drift() {
    // Every ten seconds, with a latency of seven seconds.
    near_to(each_second(400, each(10.0, 7.0)).drift(), CURRENT, 1e-4);
    // Every half minute: the whole drift is adopted at once. A minute works too.
    for interval in [30.0, 60.0] {
        near_to(each_second(125, each(interval, 0.0)).drift(), CURRENT, 1e-9);
    }
    // In two minutes a vehicle may turn.
    assert_eq!(each_second(1000, each(120.0, 0.0)).drift(), STILL);
}

#[test]
fn a_strong_current_is_estimated_from_rare_reports() {
    for interval in [1.0, 10.0, 30.0, 60.0] {
        let strong = each_second(600, |now| {
            let mut state = each(interval, 0.0)(now);
            state.north_m -= 0.2 * (now - state.age_s);
            state
        });
        near_to(strong.drift(), CURRENT - Vector2::new(0.2, 0.0), 1e-3);
    }
}

#[test]
fn an_unchanged_report_changes_nothing() {
    let silent = each_second(120, |at| {
        let heard = at.min(60.0);
        reported(heard, at - heard)
    });
    near_to(silent.drift(), each_second(60, fresh).drift(), 1e-12);
}

#[test]
fn position_noise_mostly_cancels() {
    // A metre to the left and a metre to the right, alternating.
    let noisy = each_second(601, |at| {
        let side = if at.rem_euclid(2.0) < 0.5 { 1.0 } else { -1.0 };
        let mut state = fresh(at);
        state.north_m -= HEADING.sin() * side;
        state.east_m += HEADING.cos() * side;
        state
    });
    // The last error, not the sum.
    near_to(noisy.drift(), CURRENT, 1.1 / 30.0);
}

#[test]
fn a_jump_changes_no_drift() {
    let jumped = each_second(300, |at| {
        let mut state = fresh(at);
        state.east_m += if 300.0 <= at { 20.0 } else { 0.0 };
        state
    });
    near_to(jumped.drift(), CURRENT, 1e-4);
}

#[test]
fn a_turn_between_two_seconds_is_no_drift() {
    let circling = |at: f64| {
        let course = 0.02 * at;
        let position = Vector2::new(course.sin(), -course.cos()) * (0.29 / 0.02);
        AuvState { turn_rate_radps: 0.02, ..AuvState::new(position, 5.0, Course::new(course), 0.29) }
    };
    let halves = (0..200).map(|n| 0.5 * f64::from(n));
    assert!(in_turn(Forecast::Auto, None, halves, circling).drift().norm() < 1e-9);
}

#[test]
fn a_drift_along_a_path_is_not_used_for_motion() {
    let before = left(&each_second(60, fresh), &fresh(60.0));
    let drift_after = |model: ForecastModel| {
        let declared = (Intent::default(), Forecast::Auto, &STILL);
        let before = RememberedTarget { model, ..before };
        AuvForecast::after(&before, 1.0, &fresh(61.0), declared).drift()
    };
    assert_eq!(drift_after(ForecastModel::Path), STILL);
    assert_eq!(drift_after(ForecastModel::Hold), before.drift);
    let straight = drift_after(ForecastModel::ConstantVelocity);
    assert!(before.drift.norm() < straight.norm());
    assert_eq!(drift_after(ForecastModel::ConstantTurn), straight);
}

#[test]
fn an_older_report_changes_nothing() {
    let before = each_second(60, fresh);
    let declared = (Intent::default(), Forecast::Auto, &STILL);
    let late = reported(50.0, 11.0);
    let forecast = AuvForecast::after(&left(&before, &fresh(60.0)), -10.0, &late, declared);
    assert_eq!(forecast.drift(), before.drift());
}

#[test]
fn a_held_vehicle_keeps_its_position() {
    let held = in_turn(Forecast::Hold, None, seconds(60), fresh);
    assert_eq!(held.drift(), STILL);
    assert_eq!(held.at(60.0).position, fresh(60.0).position());
}

#[test]
fn the_drift_fades_along_a_path() {
    let line = Path::starting_at(Vector2::zeros(), HEADING).line(900.0);
    let known = KnownPath { path: std::sync::Arc::new(line), horizontal_speed: 0.29 };
    let carried = in_turn(Forecast::Auto, Some(&known), seconds(200), fresh);
    assert_eq!(carried.model, ForecastModel::Path);
    near_to(carried.drift(), CURRENT, 0.1 * CURRENT.norm());
    let without = AuvForecast::new(&fresh(200.0), along(Some(&known)), Forecast::Auto, &STILL);
    // By thirty seconds of drift, and no farther.
    let by = carried.at(900.0).position - without.at(900.0).position;
    near_to(by, carried.drift() * 30.0, 1e-9);
}
