use nalgebra::Vector2;

use super::*;
use crate::facts::{
    angle::{Course, direction},
    auv::Dive,
    evidence::AuvState,
    known_path::KnownPath,
    path::curve::Path,
};

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

/// Times of a cycle and a half, s.
fn times() -> impl Iterator<Item = f64> {
    (0..3_000).map(|k| f64::from(k) * 0.1)
}

#[test]
fn horizontal_and_vertical_speed_combine_to_the_body_s_speed() {
    // Second route: finite differences are two legs of a triangle whose third is the speed.
    for (depth, descending) in [(10.0, true), (10.0, false), (23.1, true), (0.9, true)] {
        let forecast = forecast(&auv(sawtooth(Some(descending)), depth));
        let h = 1e-4;
        for t in times().skip(1) {
            let sink = (forecast.depth_at(t + h) - forecast.depth_at(t - h)) / (2.0 * h);
            let along = (forecast.at(t + h).position.x - forecast.at(t - h).position.x) / (2.0 * h);
            // Curvature of the depth times h at the beginning of a reversal.
            assert!((sink.hypot(along) - U_D).abs() < 1e-4, "{t} s: {sink}, {along}");
            assert!((forecast.at(t).velocity.x - along).abs() < 1e-4, "{t} s");
        }
    }
}

#[test]
fn a_dive_begins_as_reported_and_repeats_after_a_cycle() {
    for descending in [true, false] {
        for k in 0..=240 {
            let depth = 0.85 + 0.093 * f64::from(k);
            let forecast = forecast(&auv(sawtooth(Some(descending)), depth));
            assert!((forecast.depth_at(0.0) - depth).abs() < 1e-12, "{depth} m");
            let deeper = forecast.depth_at(0.05) > depth;
            // Just before an extreme depth the direction may change.
            assert!(
                deeper == descending || !(0.9..=23.1).contains(&depth),
                "{depth} m"
            );
            // Two legs and two reversals: 198.66 s; the simulated AUV takes 198.6.
            let cycle = 2.0 * (22.0 / (U_D * 50_f64.to_radians().sin()) + 3.6);
            assert!((forecast.depth_at(cycle) - depth).abs() < 1e-9);
        }
    }
}

#[test]
fn a_reversal_extends_beyond_the_depth_that_ends_a_leg() {
    let forecast = forecast(&auv(sawtooth(Some(true)), 10.0));
    let deepest = times().map(|t| forecast.depth_at(t)).fold(0.0, f64::max);
    let shallowest = times().map(|t| forecast.depth_at(t)).fold(99.0, f64::min);
    // The simulated AUV: 23.203 and 0.780 m.
    assert!((deepest - 23.2).abs() < 0.02, "{deepest}");
    assert!((shallowest - 0.79).abs() < 0.02, "{shallowest}");
    assert!(times().any(|t| forecast.surfaced(t)) && times().any(|t| !forecast.surfaced(t)));
}

#[test]
fn a_vehicle_beyond_its_sawtooth_approaches_it_straight() {
    let w = U_D * 50_f64.to_radians().sin();
    for descending in [Some(true), Some(false), None] {
        let deep = forecast(&auv(sawtooth(descending), 40.0));
        assert!((deep.depth_at(30.0) - (40.0 - 30.0 * w)).abs() < 1e-12);
        let joined = deep.depth_at(17.0 / w + 2.0);
        assert!((joined - (23.0 - 2.0 * w)).abs() < 1e-9);
        let shallow = forecast(&auv(sawtooth(descending), 0.0));
        assert!((shallow.depth_at(10.0) - 10.0 * w).abs() < 1e-9);
    }
}

#[test]
fn without_a_direction_the_depth_is_the_mean_and_surfaced_if_either_is() {
    let of = |descending| forecast(&auv(sawtooth(descending), 6.0));
    let (unknown, down, up) = (of(None), of(Some(true)), of(Some(false)));
    for t in times() {
        let mean = 0.5 * (down.depth_at(t) + up.depth_at(t));
        assert!((unknown.depth_at(t) - mean).abs() < 1e-12);
        assert_eq!(unknown.surfaced(t), down.surfaced(t) || up.surfaced(t));
    }
}

#[test]
fn a_vehicle_without_a_dive_or_at_rest_keeps_its_depth() {
    let diving = auv(sawtooth(Some(true)), 10.0);
    let level = Known {
        dive: None,
        ..diving.clone()
    };
    let mut at_rest = diving.clone();
    at_rest.state.speed_mps = 0.01;
    for auv in [level, at_rest] {
        assert!(times().all(|t| forecast(&auv).depth_at(t) == 10.0));
    }
    let hold = Forecast::Hold;
    assert!(times().all(|t| { diving.forecast(hold, &STILL).depth_at(t) == 10.0 }));
}

#[test]
fn without_a_path_a_dive_uses_the_reported_speed_through_the_water() {
    let current = Vector2::new(-0.1, 0.2);
    let on_path = auv(sawtooth(Some(true)), 10.0);
    let ground = direction(0.0) * on_path.state.speed_mps + current;
    let mut carried = Known {
        path: None,
        ..on_path.clone()
    };
    carried.state.course_rad = Course::of(&ground).radians();
    carried.state.speed_mps = ground.norm();
    let carried = carried.forecast(Forecast::Auto, &current);
    let expected = forecast(&on_path);
    for t in times() {
        assert!((carried.depth_at(t) - expected.depth_at(t)).abs() < 1e-9);
    }
}

#[test]
fn the_dive_of_an_old_report_is_predicted_to_now() {
    let mut old = auv(sawtooth(Some(true)), 10.0);
    old.state.age_s = 60.0;
    let fresh = auv(sawtooth(Some(true)), 10.0);
    for t in times() {
        assert!((forecast(&old).depth_at(t) - forecast(&fresh).depth_at(t + 60.0)).abs() < 1e-9);
    }
}

#[test]
fn every_accepted_dive_gives_finite_depths_under_water() {
    for (depth_min, depth_max) in [(0.0, 0.5), (1.0, 23.0), (0.0, 12_000.0)] {
        for (pitch, reversal) in [(0.05, 0.1), (0.05, 120.0), (1.4, 0.1), (1.4, 120.0)] {
            for speed in [0.01, 0.05, 10.0] {
                for depth in [-10.0, 0.0, 0.25, 0.5, 22.0, 12_000.0] {
                    for descending in [Some(true), Some(false), None] {
                        let dive = Dive {
                            depth_min_m: depth_min,
                            depth_max_m: depth_max,
                            pitch_rad: pitch,
                            reversal_s: Some(reversal),
                            descending,
                        };
                        let mut auv = auv(dive, depth);
                        auv.state.speed_mps = speed;
                        auv.path = auv.path.map(|known| KnownPath {
                            horizontal_speed: speed,
                            ..known
                        });
                        let forecast = auv.forecast(Forecast::Path, &STILL);
                        for ahead in [0.0, 1.0, 78.0, 3_600.0, 1e5] {
                            let deep = forecast.depth_at(ahead);
                            assert!(deep.is_finite() && deep >= depth.min(0.0), "{deep} m of {dive:?}");
                            assert!(forecast.at(ahead).position.norm().is_finite());
                            assert!(forecast.at(ahead).velocity.norm() <= speed / pitch.cos() + 1e-9);
                        }
                    }
                }
            }
        }
    }
}
