use std::{f64::consts::PI, sync::Arc};

use nalgebra::Vector2;

use super::*;
use crate::facts::{
    angle::Course,
    known_path::KnownPath,
    path::{
        curve::{Path, Side},
        piece::starboard,
    },
};

const U_H: f64 = 0.193;

const STILL: Vector2<f64> = Vector2::new(0.0, 0.0);

/// Lanes of 50 m due north and south, 20 m apart.
fn mower() -> Path {
    Path::lawn_mower(Vector2::zeros(), 0.0, 50.0, 20.0, 4)
}

/// An AUV's state and path.
#[derive(Clone)]
struct Follower {
    state: AuvState,
    path: KnownPath,
}

impl Follower {
    fn intent(&self) -> Intent<'_> {
        Intent {
            path: Some(&self.path),
            ..Intent::default()
        }
    }
}

/// An AUV that follows `path` from `gamma` with an offset to starboard.
fn follower(path: Path, gamma: f64, offset: f64) -> Follower {
    let point = path.at(gamma);
    Follower {
        state: AuvState::new(
            point.position + starboard(point.tangent) * offset,
            5.0,
            Course::new(point.tangent),
            U_H,
        ),
        path: KnownPath {
            path: Arc::new(path),
            horizontal_speed: U_H,
        },
    }
}

fn chosen(auv: &Follower, choice: Forecast, current: &Vector2<f64>) -> AuvForecast {
    AuvForecast::new(&auv.state, auv.intent(), choice, current)
}

fn forecast(auv: &Follower, current: Vector2<f64>) -> AuvForecast {
    let forecast = chosen(auv, Forecast::Auto, &current);
    assert_eq!(forecast.model, ForecastModel::Path);
    forecast
}

#[test]
fn in_still_water_the_arc_length_is_speed_times_time() {
    for gamma in [5.0, 45.0, 60.0, 130.0] {
        let mut auv = follower(mower(), gamma, 0.0);
        auv.state.age_s = 3.0;
        let forecast = forecast(&auv, STILL);
        for ahead in [0.0, 10.0, 78.0, 600.0, 3_000.0] {
            let expected = mower().at(gamma + U_H * (3.0 + ahead)).position;
            assert!((forecast.at(ahead).position - expected).norm() < 1e-9);
        }
    }
}

#[test]
fn position_and_velocity_agree_for_any_current_and_offset() {
    for current in [
        STILL,
        Vector2::new(0.05, 0.1),
        Vector2::new(-0.3, 0.0),
        Vector2::new(0.1, -0.4),
    ] {
        for offset in [-2.0, 0.0, 1.5] {
            let auv = follower(mower(), 46.0, offset);
            let forecast = chosen(&auv, Forecast::Path, &current);
            let h = 1e-4;
            for k in 1..400 {
                let ahead = f64::from(k) * 0.77;
                let (before, after) = (forecast.at(ahead - h), forecast.at(ahead + h));
                let slope = (after.position - before.position) / (2.0 * h);
                // At a joint the curvature, and with it the foot's speed, may jump.
                let jump = (after.velocity - before.velocity).norm();
                assert!(
                    (slope - forecast.at(ahead).velocity).norm() < 1e-6 + jump,
                    "{ahead} s, {offset} m, {current}"
                );
            }
        }
    }
}

#[test]
fn the_speed_over_ground_satisfies_the_velocity_triangle() {
    for current in [
        Vector2::new(0.0, 0.12),
        Vector2::new(0.07, -0.1),
        Vector2::new(-0.1, 0.05),
    ] {
        for gamma in [10.0, 60.0, 70.0, 100.0] {
            let auv = follower(mower(), gamma, 0.0);
            let ground = forecast(&auv, current).at(0.0).velocity;
            // Through the water it keeps its speed, and over ground it moves along the path.
            assert!(((ground - current).norm() - U_H).abs() < 1e-12);
            assert!((angle_of(&ground) - crate::facts::angle::wrap(mower().at(gamma).tangent)).abs() < 1e-9);
        }
    }
}

#[test]
fn a_current_faster_than_the_vehicle_leaves_its_part_along_the_path() {
    let auv = follower(mower(), 10.0, 0.0);
    let velocity = forecast(&auv, Vector2::new(0.1, 0.5)).at(5.0).velocity;
    assert!((velocity - Vector2::new(0.1, 0.0)).norm() < 1e-12);
    // An opposite, faster current carries it backwards beyond the path's beginning.
    let mut carried = auv;
    carried.state.course_rad = (Course::new(PI)).radians();
    let current = Vector2::new(-0.3, 0.0);
    let motion = forecast(&carried, current).at(200.0);
    assert!((motion.position.x - (10.0 - 0.107 * 200.0)).abs() < 1e-9);
    assert!(motion.position.y.abs() < 1e-9);
}

#[test]
fn the_duration_of_a_turn_in_a_current_agrees_with_small_steps() {
    let (current, gamma, offset) = (Vector2::new(0.04, 0.09), 47.0, 1.2);
    let auv = follower(mower(), gamma, offset);
    let forecast = forecast(&auv, current);
    let path = mower();
    let mut stepped = gamma;
    let step = 1e-3;
    for _ in 0..78_000 {
        let rate = |gamma: f64| {
            let point = path.at(gamma);
            let (sin, cos) = point.tangent.sin_cos();
            let (along, across) = (
                current.x * cos + current.y * sin,
                current.y * cos - current.x * sin,
            );
            let speed = along + (U_H * U_H - across * across).sqrt();
            speed / (1.0 - point.curvature * offset)
        };
        stepped += step * rate(stepped + 0.5 * step * rate(stepped));
    }
    let point = path.at(stepped);
    let expected = point.position + starboard(point.tangent) * offset;
    let miss = (forecast.at(78.0).position - expected).norm();
    assert!(miss < 0.01, "{miss} m");
}

#[test]
fn the_offset_is_kept_in_a_turn() {
    for offset in [-3.0, 1.0, 4.0] {
        let auv = follower(mower(), 48.0, offset);
        let forecast = forecast(&auv, Vector2::new(0.03, 0.05));
        for ahead in 0..300 {
            let position = forecast.at(f64::from(ahead)).position;
            let path = mower();
            let point = path.at(path.closest(&position));
            let held = (position - point.position).dot(&starboard(point.tangent));
            assert!((held - offset).abs() < 1e-9, "{held} m after {ahead} s");
        }
    }
}

#[test]
fn a_changing_offset_settles() {
    for (offset, course) in [(0.0, 0.3), (-2.0, 0.4), (3.0, -0.6), (1.0, 0.0)] {
        let mut auv = follower(mower(), 5.0, offset);
        auv.state.course_rad = (Course::new(course)).radians();
        let forecast = forecast(&auv, STILL);
        // At first as observed,
        assert!((forecast.at(0.0).velocity.y - U_H * course.sin()).abs() < 1e-12);
        let (near, far) = (forecast.at(80.0).position.y, forecast.at(160.0).position.y);
        // and by no more than a follower's approach.
        assert!((near - far).abs() < 1e-3, "{offset} m: {near}, {far}");
        assert!((near - offset).abs() < 2.0 && (near - offset) * course >= 0.0);
    }
}

#[test]
fn the_course_distinguishes_two_close_lanes() {
    // Lanes 6 m apart; a fix 0.4 m nearer to the neighbour.
    let path = Path::lawn_mower(Vector2::zeros(), 0.0, 50.0, 6.0, 4);
    let position = Vector2::new(25.0, 3.2);
    for (course, sign) in [(0.05, 1.0), (PI - 0.05, -1.0)] {
        let mut auv = follower(path.clone(), 25.0, 0.0);
        [auv.state.north_m, auv.state.east_m] = position.into();
        auv.state.course_rad = course;
        let moved = forecast(&auv, STILL).at(30.0).position - position;
        // Abeam, the course of 0.05 rad continues for a metre or two.
        assert!((moved.x - sign * U_H * 30.0).abs() < 1e-9 && moved.y.abs() < 0.1);
    }
}

#[test]
fn a_closed_path_is_followed_for_ever() {
    let circle = Path::circle(Vector2::new(1.0, 2.0), 10.0, Side::Port, 0.0).expect("is one");
    let current = Vector2::new(0.06, -0.02);
    for (current, period) in [(STILL, 20.0 * PI / U_H), (current, f64::NAN)] {
        let forecast = forecast(&follower(circle.clone(), 58.0, 0.5), current);
        for ahead in [0.0, 40.0, 5_000.0] {
            let radius = (forecast.at(ahead).position - Vector2::new(1.0, 2.0)).norm();
            // The centre is to port, so starboard is outside.
            assert!((radius - 10.5).abs() < 1e-9);
            if period.is_finite() {
                let again = forecast.at(ahead + 10.5 / 10.0 * period).position;
                assert!((again - forecast.at(ahead).position).norm() < 1e-6);
            }
        }
    }
}

#[test]
fn a_vehicle_without_a_path_or_off_it_or_at_rest_is_forecast_by_motion() {
    let choice = Forecast::Path;
    let on_path = follower(mower(), 10.0, 0.0);
    assert_eq!(
        AuvForecast::new(&on_path.state, Intent::default(), choice, &STILL),
        AuvForecast::new(&on_path.state, Intent::default(), Forecast::Auto, &STILL)
    );
    let model = |auv: &Follower| chosen(auv, Forecast::Auto, &STILL).model;
    let off = follower(mower(), 10.0, -15.1);
    assert_eq!(model(&off), ForecastModel::ConstantVelocity);
    let mut at_rest = on_path;
    at_rest.state.speed_mps = 0.04;
    assert_eq!(model(&at_rest), ForecastModel::Hold);
    for auv in [off, at_rest] {
        assert_eq!(chosen(&auv, choice, &STILL).model, ForecastModel::Path);
    }
}

#[test]
fn an_endlessly_winding_path_gives_finite_forecasts() {
    let mut path = Path::starting_at(Vector2::zeros(), 0.0);
    for k in 0..128 {
        let side = if k % 2 == 0 { Side::Port } else { Side::Starboard };
        path = path.arc(side, 1e-3, 6.0).line(1e-3);
    }
    for speed in [0.01, 10.0] {
        for current in [STILL, Vector2::new(3.0, -3.0), Vector2::new(0.01, 0.0)] {
            for offset in [-5.0, 0.0, 5.0] {
                let mut auv = follower(path.clone(), 0.1, offset);
                auv.path.horizontal_speed = speed;
                let forecast = chosen(&auv, Forecast::Path, &current);
                for ahead in [0.0, 1.0, 78.0, 3_600.0] {
                    let Motion { position, velocity } = forecast.at(ahead);
                    assert!(position.norm().is_finite() && velocity.norm().is_finite());
                }
            }
        }
    }
}
