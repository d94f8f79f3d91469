use planner::{
    angle::Course,
    forecast::{AuvForecast, Intent},
    snapshot::{self, AuvState, Forecast, KnownPath},
};

use super::*;
use crate::scenario::Scenario;

const STILL: Vector2<f64> = Vector2::new(0.0, 0.0);
/// Inner-loop periods of a second.
const SECOND: usize = 10;

/// The first AUV of a scenario, on a path due north, `east` of it.
fn auv(scenario: &str, east: f64) -> SimulatedAuv {
    let start = Scenario::named(scenario)
        .expect("exists")
        .start(1)
        .expect("valid");
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

/// Knowledge of an AUV without any error.
struct Known {
    state: AuvState,
    path: KnownPath,
    dive: Option<snapshot::Dive>,
}

fn known(auv: &SimulatedAuv, current: Vector2<f64>, diving: bool) -> Known {
    let ground = direction(auv.heading()) * auv.horizontal_speed() + current;
    Known {
        state: AuvState::new(auv.position(), auv.depth(), Course::of(&ground), ground.norm()),
        path: KnownPath {
            path: auv.path.clone(),
            horizontal_speed: auv.speed_at(auv.gamma) * auv.dive.pitch.cos(),
        },
        dive: diving.then(|| snapshot::Dive {
            depth_min_m: auv.dive.depth_min,
            depth_max_m: auv.dive.depth_max,
            pitch_rad: auv.dive.pitch,
            reversal_s: Some(auv.loops.reversal_time()),
            descending: Some(auv.pitch() < 0.0),
        }),
    }
}

fn forecast(auv: &Known, current: Vector2<f64>) -> AuvForecast {
    let intent = Intent {
        path: Some(&auv.path),
        dive: auv.dive,
        ..Intent::default()
    };
    AuvForecast::new(&auv.state, intent, Forecast::Path, &current)
}

/// Root mean square and largest of `values`.
fn size(values: impl Iterator<Item = f64>) -> (f64, f64) {
    let (mut n, mut sum, mut most) = (0.0, 0.0, 0.0_f64);
    for value in values {
        n += 1.0;
        sum += value * value;
        most = most.max(value.abs());
    }
    ((sum / n).sqrt(), most)
}

#[test]
fn the_forecast_depth_matches_the_auv_over_a_whole_cycle() {
    for (scenario, speed_settles, worst) in [("paper-tracking", 30, 0.3), ("slocum", 100, 0.3)] {
        let auvs = followed(auv(scenario, 0.0), STILL, 900);
        let errors = (speed_settles..600).step_by(7).flat_map(|now| {
            let forecast = forecast(&known(&auvs[now], STILL, true), STILL);
            let auvs = &auvs;
            (0_u32..=200)
                .map(move |ahead| forecast.depth_at(f64::from(ahead)) - auvs[now + ahead as usize].depth())
        });
        let (rms, most) = size(errors);
        println!("{scenario}: depth over 200 s wrong by {rms:.3} m, at most {most:.3} m");
        assert!(most < worst, "{scenario}: {most} m");
    }
}

#[test]
fn the_forecast_includes_the_surge_at_reversals() {
    let auvs = followed(auv("paper-tracking", 0.0), STILL, 900);
    let error = |diving| {
        let auvs = &auvs;
        size((30..600).flat_map(move |now| {
            let forecast = forecast(&known(&auvs[now], STILL, diving), STILL);
            (0_u32..=78).map(move |ahead| {
                let then = auvs[now + ahead as usize].position();
                (forecast.at(f64::from(ahead)).position - then).norm()
            })
        }))
    };
    let (with, without) = (error(true), error(false));
    println!("position over 78 s wrong by {with:?} m (rms, most), without the dive {without:?} m");
    assert!(with.0 < 0.25 * without.0 && without.0 > 0.1);
}

#[test]
fn an_offset_forecast_beats_a_constant_one_and_is_exact_when_steady() {
    for current in [Vector2::new(0.0, 0.1), STILL] {
        for (what, starts, first, last) in [
            ("transient", vec![-4.0, -2.0, 0.0, 2.0, 4.0], 0, 30),
            ("steady", vec![0.0], 120, 480),
        ] {
            let (mut forecasts, mut kept) = (Vec::new(), Vec::new());
            for east in starts {
                let auvs = followed(auv("paper-tracking", east), current, last + 61);
                for now in first..last {
                    let forecast = forecast(&known(&auvs[now], current, true), current);
                    for ahead in 0_u32..=60 {
                        let then = auvs[now + ahead as usize].position().y;
                        forecasts.push(forecast.at(f64::from(ahead)).position.y - then);
                        kept.push(auvs[now].position().y - then);
                    }
                }
            }
            let (with, without) = (size(forecasts.into_iter()).0, size(kept.into_iter()).0);
            println!(
                "{what}, {} m/s across: wrong by {with:.3} m, kept {without:.3} m",
                current.y
            );
            if what == "transient" {
                assert!(with < 0.65 * without, "{with}, {without}");
            } else {
                assert!(with < 0.1, "{with}");
            }
        }
    }
}
