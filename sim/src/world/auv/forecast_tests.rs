use planner::angle::Course;
use planner::forecast::{AuvForecast, Intent};
use planner::snapshot::{self, AuvState, Forecast, KnownPath};

use super::*;
use crate::{scenario::Scenario, tests::near};

const STILL: Vector2<f64> = Vector2::new(0.0, 0.0);
/// Inner-loop periods of a second.
const SECOND: usize = 10;

/// The first AUV of a scenario, on a path due north, `east` of it.
fn auv(scenario: &str, east: f64) -> SimulatedAuv {
    let start = Scenario::named(scenario).expect("exists").start(1).expect("valid");
    let mut auv = start.world.auvs[0].clone();
    auv.path = Arc::new(Path::starting_at(STILL, 0.0).line(1e4));
    (auv.state[0], auv.state[1], auv.state[4]) = (0.0, east, 0.0);
    auv.position_estimate = auv.position();
    auv
}

/// The AUV at every second.
fn followed(mut auv: SimulatedAuv, current: Vector2<f64>, seconds: usize) -> Vec<SimulatedAuv> {
    let mut states = Vec::with_capacity(seconds);
    for period in 0..seconds * SECOND {
        if period % SECOND == 0 {
            states.push(auv.clone());
        }
        auv.step(Behaviour::FollowsPath, &current);
    }
    states
}

/// The forecast by knowledge without any error.
fn forecast(auv: &SimulatedAuv, current: Vector2<f64>, diving: bool) -> AuvForecast {
    let ground = direction(auv.heading()) * auv.horizontal_speed() + current;
    let state = AuvState::new(auv.position(), auv.depth(), Course::of(&ground), ground.norm());
    let path = KnownPath {
        path: auv.path.clone(),
        horizontal_speed: auv.speed_at(auv.gamma) * auv.dive.pitch.cos(),
    };
    let dive = snapshot::Dive {
        depth_min_m: auv.dive.depth_min,
        depth_max_m: auv.dive.depth_max,
        pitch_rad: auv.dive.pitch,
        reversal_s: Some(auv.loops.reversal_time()),
        descending: Some(auv.pitch() < 0.0),
    };
    let intent = Intent { path: Some(&path), dive: diving.then_some(dive), ..Intent::default() };
    AuvForecast::new(&state, intent, Forecast::Path, &current)
}

fn root_mean_square(values: impl Iterator<Item = f64>) -> f64 {
    let (n, sum) = values.fold((0.0, 0.0), |(n, sum), value| (n + 1.0, sum + value * value));
    f64::sqrt(sum / n)
}

#[test]
fn the_forecast_depth_matches_the_auv_over_a_whole_cycle() {
    for (scenario, speed_settles) in [("paper-tracking", 30), ("slocum", 100)] {
        let auvs = followed(auv(scenario, 0.0), STILL, 900);
        for now in (speed_settles..600).step_by(7) {
            let forecast = forecast(&auvs[now], STILL, true);
            for ahead in 0_u32..=200 {
                let depth = auvs[now + ahead as usize].depth();
                near(forecast.depth_at(f64::from(ahead)), depth, 0.3);
            }
        }
    }
}

#[test]
fn the_forecast_includes_the_surge_at_reversals() {
    let auvs = followed(auv("paper-tracking", 0.0), STILL, 900);
    let error = |diving| {
        let auvs = &auvs;
        root_mean_square((30..600).flat_map(move |now| {
            let forecast = forecast(&auvs[now], STILL, diving);
            (0_u32..=78).map(move |ahead| {
                let then = auvs[now + ahead as usize].position();
                (forecast.at(f64::from(ahead)).position - then).norm()
            })
        }))
    };
    let (with, without) = (error(true), error(false));
    assert!(with < 0.25 * without && without > 0.1, "{with} m, {without} m");
}

#[test]
fn an_offset_forecast_beats_a_constant_one_and_is_exact_when_steady() {
    for current in [Vector2::new(0.0, 0.1), STILL] {
        for (transient, starts, first, last) in
            [(true, &[-4.0, -2.0, 0.0, 2.0, 4.0][..], 0, 30), (false, &[0.0], 120, 480)]
        {
            let (mut forecasts, mut kept) = (Vec::new(), Vec::new());
            for east in starts {
                let auvs = followed(auv("paper-tracking", *east), current, last + 61);
                for now in first..last {
                    let forecast = forecast(&auvs[now], current, true);
                    for ahead in 0_u32..=60 {
                        let then = auvs[now + ahead as usize].position().y;
                        forecasts.push(forecast.at(f64::from(ahead)).position.y - then);
                        kept.push(auvs[now].position().y - then);
                    }
                }
            }
            let [with, without] = [forecasts, kept].map(|errors| root_mean_square(errors.into_iter()));
            let most = if transient { 0.65 * without } else { 0.1 };
            assert!(with < most, "{with} m, kept {without} m");
        }
    }
}
