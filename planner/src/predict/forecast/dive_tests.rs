use super::*;
use crate::tests::prelude::*;

/// Speed along the body of known vehicles, m/s.
const U_D: f64 = 0.3;

const STILL: Vector2<f64> = Vector2::new(0.0, 0.0);

fn sawtooth(descending: Option<bool>) -> Dive {
    Dive {
        depth_min_m: 1.0,
        depth_max_m: 23.0,
        pitch_rad: 50_f64.to_radians(),
        reversal_s: Some(Dive::REVERSAL_MEDUSA),
        descending,
    }
}

/// A vehicle on a straight path due north that dives in `dive`, now at `depth`.
fn auv(dive: Dive, depth: f64) -> Known {
    let u_h = U_D * dive.pitch_rad.cos();
    Known {
        state: AuvState::new(STILL, depth, Course::new(0.0), u_h),
        path: Some(KnownPath {
            path: std::sync::Arc::new(Path::starting_at(STILL, 0.0).line(1e4)),
            horizontal_speed: u_h,
        }),
        dive: Some(dive),
    }
}

fn forecast(auv: &Known) -> AuvForecast {
    auv.forecast(Forecast::Auto, &STILL)
}

/// The forecast of a vehicle in the sawtooth at `depth`.
fn diving(descending: Option<bool>, depth: f64) -> AuvForecast {
    forecast(&auv(sawtooth(descending), depth))
}

/// Times of a cycle and a half, s.
fn times() -> impl Iterator<Item = f64> {
    (0..3_000).map(|k| f64::from(k) * 0.1)
}

#[test]
fn horizontal_and_vertical_speed_combine_to_the_body_s_speed() {
    // Second route: finite differences are two legs of a triangle whose third is the speed.
    for (depth, descending) in [(10.0, true), (10.0, false), (23.1, true), (0.9, true)] {
        let forecast = diving(Some(descending), depth);
        let h = 1e-4;
        for t in times().skip(1) {
            let sink = (forecast.depth_at(t + h) - forecast.depth_at(t - h)) / (2.0 * h);
            let along = (forecast.at(t + h).position.x - forecast.at(t - h).position.x) / (2.0 * h);
            // Curvature of the depth times h at the beginning of a reversal.
            near(sink.hypot(along), U_D, 1e-4);
            near(forecast.at(t).velocity.x, along, 1e-4);
        }
    }
}

#[test]
fn a_dive_begins_as_reported_and_repeats_after_a_cycle() {
    for descending in [true, false] {
        for depth in (0..=240).map(|k| 0.85 + 0.093 * f64::from(k)) {
            let forecast = diving(Some(descending), depth);
            near(forecast.depth_at(0.0), depth, 1e-12);
            let deeper = forecast.depth_at(0.05) > depth;
            // Just before an extreme depth the direction may change.
            assert!(deeper == descending || !(0.9..=23.1).contains(&depth), "{depth} m");
            // Two legs and two reversals: 198.66 s; the simulated AUV takes 198.6.
            let cycle = 2.0 * (22.0 / (U_D * 50_f64.to_radians().sin()) + 3.6);
            near(forecast.depth_at(cycle), depth, 1e-9);
        }
    }
}

#[test]
fn a_reversal_extends_beyond_the_depth_that_ends_a_leg() {
    let forecast = diving(Some(true), 10.0);
    let depths = || times().map(|t| forecast.depth_at(t));
    // The simulated AUV: 23.203 and 0.780 m.
    near(depths().fold(0.0, f64::max), 23.2, 0.02);
    near(depths().fold(99.0, f64::min), 0.79, 0.02);
    assert!(times().any(|t| forecast.surfaced(t)) && times().any(|t| !forecast.surfaced(t)));
}

#[test]
fn a_vehicle_beyond_its_sawtooth_approaches_it_straight() {
    let w = U_D * 50_f64.to_radians().sin();
    for descending in [Some(true), Some(false), None] {
        let deep = diving(descending, 40.0);
        near(deep.depth_at(30.0), 40.0 - 30.0 * w, 1e-12);
        near(deep.depth_at(17.0 / w + 2.0), 23.0 - 2.0 * w, 1e-9);
        near(diving(descending, 0.0).depth_at(10.0), 10.0 * w, 1e-9);
    }
}

#[test]
fn without_a_direction_the_depth_is_the_mean_and_surfaced_if_either_is() {
    let [unknown, down, up] = [None, Some(true), Some(false)].map(|descending| diving(descending, 6.0));
    for t in times() {
        let expected = 0.5 * (down.depth_at(t) + up.depth_at(t));
        near(unknown.depth_at(t), expected, 1e-12);
        assert_eq!(unknown.surfaced(t), down.surfaced(t) || up.surfaced(t));
    }
}

#[test]
fn a_vehicle_without_a_dive_or_at_rest_keeps_its_depth() {
    let diving = auv(sawtooth(Some(true)), 10.0);
    let (mut level, mut at_rest) = (diving.clone(), diving.clone());
    level.dive = None;
    at_rest.state.speed_mps = 0.01;
    let held = diving.forecast(Forecast::Hold, &STILL);
    for forecast in [forecast(&level), forecast(&at_rest), held] {
        assert!(times().all(|t| forecast.depth_at(t) == 10.0));
    }
}

#[test]
fn without_a_path_a_dive_uses_the_reported_speed_through_the_water() {
    let current = Vector2::new(-0.1, 0.2);
    let on_path = auv(sawtooth(Some(true)), 10.0);
    let ground = direction(0.0) * on_path.state.speed_mps + current;
    let mut carried = on_path.clone();
    carried.path = None;
    carried.state.course_rad = Course::of(&ground).radians();
    carried.state.speed_mps = ground.norm();
    let carried = carried.forecast(Forecast::Auto, &current);
    let expected = forecast(&on_path);
    times().for_each(|t| near(carried.depth_at(t), expected.depth_at(t), 1e-9));
}

#[test]
fn the_dive_of_an_old_report_is_predicted_to_now() {
    let mut old = auv(sawtooth(Some(true)), 10.0);
    old.state.age_s = 60.0;
    let (old, fresh) = (forecast(&old), diving(Some(true), 10.0));
    times().for_each(|t| near(old.depth_at(t), fresh.depth_at(t + 60.0), 1e-9));
}

#[test]
fn every_accepted_dive_gives_finite_depths_under_water() {
    let pitches = [(0.05, 0.1), (0.05, 120.0), (1.4, 0.1), (1.4, 120.0)];
    let mut dives = Vec::new();
    for (depth_min_m, depth_max_m) in [(0.0, 0.5), (1.0, 23.0), (0.0, 12_000.0)] {
        for (pitch_rad, reversal) in pitches {
            dives.extend([Some(true), Some(false), None].map(|descending| Dive {
                depth_min_m,
                depth_max_m,
                pitch_rad,
                reversal_s: Some(reversal),
                descending,
            }));
        }
    }
    for dive in dives {
        for speed in [0.01, 0.05, 10.0] {
            for depth in [-10.0, 0.0, 0.25, 0.5, 22.0, 12_000.0] {
                let mut auv = auv(dive, depth);
                auv.state.speed_mps = speed;
                auv.path.as_mut().expect("has one").horizontal_speed = speed;
                let forecast = auv.forecast(Forecast::Path, &STILL);
                for ahead in [0.0, 1.0, 78.0, 3_600.0, 1e5] {
                    let deep = forecast.depth_at(ahead);
                    assert!(deep.is_finite() && deep >= depth.min(0.0), "{deep} m of {dive:?}");
                    let Motion { position, velocity } = forecast.at(ahead);
                    assert!(position.norm().is_finite());
                    assert!(velocity.norm() <= speed / dive.pitch_rad.cos() + 1e-9);
                }
            }
        }
    }
}
