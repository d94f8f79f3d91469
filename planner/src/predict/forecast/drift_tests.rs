use super::*;
use crate::facts::{angle::Course, path::curve::Path};

const HEADING: f64 = 0.4;

/// A current unknown to the vehicle, m/s.
const CURRENT: Vector2<f64> = Vector2::new(-0.03, 0.05);

const STILL: Vector2<f64> = Vector2::new(0.0, 0.0);

/// Report of a vehicle `at` a time, `age` seconds later, with its velocity through the water.
fn reported(at: f64, age: f64) -> AuvState {
    let through_the_water = crate::facts::angle::direction(HEADING) * 0.29;
    AuvState {
        age_s: age,
        ..AuvState::new(
            (through_the_water + CURRENT) * at,
            5.0,
            Course::of(&through_the_water),
            through_the_water.norm(),
        )
    }
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
        let (intent, state) = (
            Intent {
                path,
                ..Intent::default()
            },
            reported(now),
        );
        let forecast = match &before {
            None => AuvForecast::new(&state, intent, choice, &STILL),
            Some((before, reported)) => {
                let between = now - state.age_s - reported;
                AuvForecast::after(before, between, &state, (intent, choice, &STILL))
            }
        };
        before = Some((left(&forecast, &state), now - state.age_s));
        last = Some(forecast);
    }
    last.expect("a time at least")
}

/// Memory of a forecast for the next answer.
fn left(forecast: &AuvForecast, state: &AuvState) -> RememberedTarget {
    RememberedTarget {
        model: forecast.model,
        estimate: state.into(),
        drift: forecast.drift(),
    }
}

fn seconds(n: u32) -> impl Iterator<Item = f64> {
    (0..=n).map(f64::from)
}

#[test]
fn the_drift_of_a_velocity_through_the_water_is_estimated() {
    for model in [ForecastModel::ConstantVelocity, ForecastModel::ConstantTurn] {
        let drift = |n| in_turn(Forecast::from(model), None, seconds(n), |at| reported(at, 0.0)).drift();
        assert_eq!(drift(0), STILL);
        // The error decreases by a thirtieth per second.
        for n in [10, 60, 300] {
            let missing = CURRENT * (1.0 - 1.0_f64 / 30.0).powf(f64::from(n));
            assert!((drift(n) - (CURRENT - missing)).norm() < 1e-12, "{n}");
        }
    }
}

#[test]
fn the_forecast_includes_the_drift() {
    let forecast = in_turn(Forecast::Auto, None, seconds(400), |at| reported(at, 0.0));
    for ahead in [0.0, 10.0, 78.0] {
        let motion = forecast.at(ahead);
        assert!((motion.position - reported(400.0 + ahead, 0.0).position()).norm() < 1e-3);
        let h = 1e-3;
        let slope = (forecast.at(ahead + h).position - forecast.at(ahead - h).position) / (2.0 * h);
        assert!((slope - motion.velocity).norm() < 1e-9);
    }
}

#[test]
fn late_and_rare_reports_give_the_same_drift() {
    // Every ten seconds, with a latency of seven seconds.
    let rare = in_turn(Forecast::Auto, None, seconds(400), |now| {
        let sent = ((now - 7.0) / 10.0).floor() * 10.0;
        reported(sent, now - sent)
    });
    assert!((rare.drift() - CURRENT).norm() < 1e-4, "{}", rare.drift());
    // Every half minute: the whole drift is adopted at once. A minute works too.
    for interval in [30.0, 60.0] {
        let seldom = in_turn(Forecast::Auto, None, seconds(125), |now| {
            let sent = (now / interval).floor() * interval;
            reported(sent, now - sent)
        });
        assert!((seldom.drift() - CURRENT).norm() < 1e-9, "{}", seldom.drift());
    }
    // In two minutes a vehicle may turn.
    let hardly = in_turn(Forecast::Auto, None, seconds(1000), |now| {
        let sent = (now / 120.0).floor() * 120.0;
        reported(sent, now - sent)
    });
    assert_eq!(hardly.drift(), STILL);
}

#[test]
fn a_strong_current_is_estimated_from_rare_reports() {
    for interval in [1.0, 10.0, 30.0, 60.0] {
        let strong = in_turn(Forecast::Auto, None, seconds(600), |now| {
            let sent = (now / interval).floor() * interval;
            let mut state = reported(sent, now - sent);
            state.north_m -= 0.2 * sent;
            state
        });
        assert!(
            (strong.drift() - CURRENT + Vector2::new(0.2, 0.0)).norm() < 1e-3,
            "{interval}: {}",
            strong.drift()
        );
    }
}

#[test]
fn an_unchanged_report_changes_nothing() {
    let before = in_turn(Forecast::Auto, None, seconds(60), |at| reported(at, 0.0));
    let silent = in_turn(Forecast::Auto, None, seconds(120), |at| {
        let heard = at.min(60.0);
        reported(heard, at - heard)
    });
    assert!((before.drift() - silent.drift()).norm() < 1e-12);
}

#[test]
fn position_noise_mostly_cancels() {
    // A metre to the left and a metre to the right, alternating.
    let noisy = |at: f64| {
        let side = if at.rem_euclid(2.0) < 0.5 { 1.0 } else { -1.0 };
        let mut state = reported(at, 0.0);
        [state.north_m, state.east_m] =
            (state.position() + (Vector2::new(-HEADING.sin(), HEADING.cos()) * side)).into();
        state
    };
    let drift = in_turn(Forecast::Auto, None, seconds(601), noisy).drift();
    // The last error, not the sum.
    assert!((drift - CURRENT).norm() < 1.1 / 30.0, "{drift}");
}

#[test]
fn a_jump_changes_no_drift() {
    let jumps = |at: f64| {
        let mut state = reported(at, 0.0);
        if 300.0 <= at {
            state.east_m += 20.0;
        }
        state
    };
    let drift = in_turn(Forecast::Auto, None, seconds(300), jumps).drift();
    assert!((drift - CURRENT).norm() < 1e-4, "{drift}");
}

#[test]
fn a_turn_between_two_seconds_is_no_drift() {
    let circling = |at: f64| AuvState {
        north_m: (Vector2::new((0.02 * at).sin(), -(0.02 * at).cos()) * (0.29 / 0.02)).x,
        east_m: (Vector2::new((0.02 * at).sin(), -(0.02 * at).cos()) * (0.29 / 0.02)).y,
        course_rad: (Course::new(0.02 * at)).radians(),
        turn_rate_radps: 0.02,
        ..reported(at, 0.0)
    };
    let halves = (0..200).map(|n| 0.5 * f64::from(n));
    assert!(in_turn(Forecast::Auto, None, halves, circling).drift().norm() < 1e-9);
}

#[test]
fn a_drift_along_a_path_is_not_used_for_motion() {
    let (state, next) = (reported(60.0, 0.0), reported(61.0, 0.0));
    let before = left(
        &in_turn(Forecast::Auto, None, seconds(60), |at| reported(at, 0.0)),
        &state,
    );
    let drift_after = |model: ForecastModel| {
        let declared = (Intent::default(), Forecast::Auto, &STILL);
        let before = RememberedTarget { model, ..before };
        AuvForecast::after(&before, 1.0, &next, declared).drift()
    };
    assert_eq!(drift_after(ForecastModel::Path), STILL);
    assert_eq!(drift_after(ForecastModel::Hold), before.drift);
    let straight = drift_after(ForecastModel::ConstantVelocity);
    assert!(before.drift.norm() < straight.norm());
    assert_eq!(drift_after(ForecastModel::ConstantTurn), straight);
}

#[test]
fn an_older_report_changes_nothing() {
    let (state, late) = (reported(60.0, 0.0), reported(50.0, 11.0));
    let before = in_turn(Forecast::Auto, None, seconds(60), |at| reported(at, 0.0));
    let declared = (Intent::default(), Forecast::Auto, &STILL);
    let forecast = AuvForecast::after(&left(&before, &state), -10.0, &late, declared);
    assert_eq!(forecast.drift(), before.drift());
}

#[test]
fn a_held_vehicle_keeps_its_position() {
    let choice = Forecast::Hold;
    let held = in_turn(choice, None, seconds(60), |at| reported(at, 0.0));
    assert_eq!(held.drift(), STILL);
    assert_eq!(held.at(60.0).position, reported(60.0, 0.0).position());
}

#[test]
fn the_drift_fades_along_a_path() {
    let line = Path::starting_at(Vector2::zeros(), HEADING).line(900.0);
    let known = KnownPath {
        path: std::sync::Arc::new(line),
        horizontal_speed: 0.29,
    };
    let carried = in_turn(Forecast::Auto, Some(&known), seconds(200), |at| reported(at, 0.0));
    assert_eq!(carried.model, ForecastModel::Path);
    assert!(
        (carried.drift() - CURRENT).norm() < 0.1 * CURRENT.norm(),
        "{}",
        carried.drift()
    );
    let intent = Intent {
        path: Some(&known),
        ..Intent::default()
    };
    let without = AuvForecast::new(&reported(200.0, 0.0), intent, Forecast::Auto, &STILL);
    // By thirty seconds of drift, and no farther.
    let by = carried.at(900.0).position - without.at(900.0).position;
    assert!((by - carried.drift() * 30.0).norm() < 1e-9, "{by}");
}
