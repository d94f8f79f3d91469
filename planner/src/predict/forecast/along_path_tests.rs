use std::{f64::consts::PI, sync::Arc};

use super::*;
use crate::tests::prelude::*;

const U_H: f64 = 0.193;

const STILL: Vector2<f64> = Vector2::new(0.0, 0.0);

/// Lanes of 50 m due north and south, 20 m apart.
fn mower() -> Path {
    Path::lawn_mower(Vector2::zeros(), 0.0, 50.0, 20.0, 4)
}

/// An AUV that follows `path` from `gamma` with an offset to starboard.
fn follower(path: Path, gamma: f64, offset: f64) -> Known {
    let point = path.at(gamma);
    let position = point.position + starboard(point.tangent) * offset;
    Known {
        state: AuvState::new(position, 5.0, Course::new(point.tangent), U_H),
        path: Some(KnownPath { path: Arc::new(path), horizontal_speed: U_H }),
        dive: None,
    }
}

fn forecast(auv: &Known, current: Vector2<f64>) -> AuvForecast {
    let forecast = auv.forecast(Forecast::Auto, &current);
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
            near_to(forecast.at(ahead).position, expected, 1e-9);
        }
    }
}

#[test]
fn position_and_velocity_agree_for_any_current_and_offset() {
    for current in [[0.0, 0.0], [0.05, 0.1], [-0.3, 0.0], [0.1, -0.4]] {
        for offset in [-2.0, 0.0, 1.5] {
            let auv = follower(mower(), 46.0, offset);
            let forecast = auv.forecast(Forecast::Path, &current.into());
            let h = 1e-4;
            for ahead in (1..400).map(|k| f64::from(k) * 0.77) {
                let moves = slope(|time| forecast.at(time).position, ahead, h);
                // At a joint the curvature, and with it the foot's speed, may jump.
                let jump = (forecast.at(ahead + h).velocity - forecast.at(ahead - h).velocity).norm();
                near_to(moves, forecast.at(ahead).velocity, 1e-6 + jump);
            }
        }
    }
}

#[test]
fn the_speed_over_ground_satisfies_the_velocity_triangle() {
    for current in [[0.0, 0.12], [0.07, -0.1], [-0.1, 0.05]].map(Vector2::from) {
        for gamma in [10.0, 60.0, 70.0, 100.0] {
            let ground = forecast(&follower(mower(), gamma, 0.0), current).at(0.0).velocity;
            // Through the water it keeps its speed, and over ground it moves along the path.
            near((ground - current).norm(), U_H, 1e-12);
            near(angle_of(&ground), wrap(mower().at(gamma).tangent), 1e-9);
        }
    }
}

#[test]
fn a_current_faster_than_the_vehicle_leaves_its_part_along_the_path() {
    let mut auv = follower(mower(), 10.0, 0.0);
    let velocity = forecast(&auv, Vector2::new(0.1, 0.5)).at(5.0).velocity;
    near_to(velocity, Vector2::new(0.1, 0.0), 1e-12);
    // An opposite, faster current carries it backwards beyond the path's beginning.
    auv.state.course_rad = PI;
    let motion = forecast(&auv, Vector2::new(-0.3, 0.0)).at(200.0);
    near_to(motion.position, Vector2::new(10.0 - 0.107 * 200.0, 0.0), 1e-9);
}

#[test]
fn the_duration_of_a_turn_in_a_current_agrees_with_small_steps() {
    let (current, gamma, offset) = (Vector2::new(0.04, 0.09), 47.0, 1.2);
    let forecast = forecast(&follower(mower(), gamma, offset), current);
    let path = mower();
    let (mut stepped, step) = (gamma, 1e-3);
    for _ in 0..78_000 {
        let rate = |gamma: f64| {
            let point = path.at(gamma);
            let flow = ned_from_body(point.tangent).transpose() * current;
            let speed = flow.x + (U_H * U_H - flow.y * flow.y).sqrt();
            speed / (1.0 - point.curvature * offset)
        };
        stepped += step * rate(stepped + 0.5 * step * rate(stepped));
    }
    let point = path.at(stepped);
    let expected = point.position + starboard(point.tangent) * offset;
    near_to(forecast.at(78.0).position, expected, 0.01);
}

#[test]
fn the_offset_is_kept_in_a_turn() {
    let path = mower();
    for offset in [-3.0, 1.0, 4.0] {
        let forecast = forecast(&follower(mower(), 48.0, offset), Vector2::new(0.03, 0.05));
        for ahead in 0..300 {
            let position = forecast.at(f64::from(ahead)).position;
            let point = path.at(path.closest(&position));
            let found = (position - point.position).dot(&starboard(point.tangent));
            near(found, offset, 1e-9);
        }
    }
}

#[test]
fn a_changing_offset_settles() {
    for (offset, course) in [(0.0, 0.3), (-2.0, 0.4), (3.0, -0.6), (1.0, 0.0)] {
        let mut auv = follower(mower(), 5.0, offset);
        auv.state.course_rad = course;
        let forecast = forecast(&auv, STILL);
        // At first as observed,
        near(forecast.at(0.0).velocity.y, U_H * course.sin(), 1e-12);
        let [settled, far] = [80.0, 160.0].map(|ahead| forecast.at(ahead).position.y);
        // and by no more than a follower's approach.
        near(settled, far, 1e-3);
        assert!((settled - offset).abs() < 2.0 && (settled - offset) * course >= 0.0);
    }
}

#[test]
fn the_course_distinguishes_two_close_lanes() {
    // Lanes 6 m apart; a fix 0.4 m nearer to the neighbour.
    let path = Path::lawn_mower(Vector2::zeros(), 0.0, 50.0, 6.0, 4);
    for (course, sign) in [(0.05, 1.0), (PI - 0.05, -1.0)] {
        let mut auv = follower(path.clone(), 25.0, 3.2);
        auv.state.course_rad = course;
        let moved = forecast(&auv, STILL).at(30.0).position - auv.state.position();
        // Abeam, the course of 0.05 rad continues for a metre or two.
        near(moved.x, sign * U_H * 30.0, 1e-9);
        near(moved.y, 0.0, 0.1);
    }
}

#[test]
fn a_closed_path_is_followed_for_ever() {
    let centre = Vector2::new(1.0, 2.0);
    let circle = Path::circle(centre, 10.0, Side::Port, 0.0).expect("is one");
    for current in [STILL, Vector2::new(0.06, -0.02)] {
        let forecast = forecast(&follower(circle.clone(), 58.0, 0.5), current);
        for ahead in [0.0, 40.0, 5_000.0] {
            let position = forecast.at(ahead).position;
            // The centre is to port, so starboard is outside.
            near((position - centre).norm(), 10.5, 1e-9);
            if current == STILL {
                near_to(forecast.at(ahead + 21.0 * PI / U_H).position, position, 1e-6);
            }
        }
    }
}

#[test]
fn a_vehicle_without_a_path_or_off_it_or_at_rest_is_forecast_by_motion() {
    let on_path = follower(mower(), 10.0, 0.0);
    let without = Known { path: None, ..on_path.clone() };
    let by = |auv: &Known, choice| auv.forecast(choice, &STILL);
    assert_eq!(by(&without, Forecast::Path), by(&without, Forecast::Auto));
    let off = follower(mower(), 10.0, -15.1);
    let mut at_rest = on_path;
    at_rest.state.speed_mps = 0.04;
    for (auv, model) in [(off, ForecastModel::ConstantVelocity), (at_rest, ForecastModel::Hold)] {
        assert_eq!(by(&auv, Forecast::Auto).model, model);
        assert_eq!(by(&auv, Forecast::Path).model, ForecastModel::Path);
    }
}

#[test]
fn an_endlessly_winding_path_gives_finite_forecasts() {
    let mut path = Path::starting_at(Vector2::zeros(), 0.0);
    for side in [Side::Port, Side::Starboard].into_iter().cycle().take(128) {
        path = path.arc(side, 1e-3, 6.0).line(1e-3);
    }
    for speed in [0.01, 10.0] {
        for current in [[0.0, 0.0], [3.0, -3.0], [0.01, 0.0]] {
            for offset in [-5.0, 0.0, 5.0] {
                let mut auv = follower(path.clone(), 0.1, offset);
                auv.path.as_mut().expect("has one").horizontal_speed = speed;
                let forecast = auv.forecast(Forecast::Path, &current.into());
                for ahead in [0.0, 1.0, 78.0, 3_600.0] {
                    let Motion { position, velocity } = forecast.at(ahead);
                    assert!(position.norm().is_finite() && velocity.norm().is_finite());
                }
            }
        }
    }
}
