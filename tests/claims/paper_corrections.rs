//! Figures of docs/rationale.md on equations that cannot be implemented as printed.

use nalgebra::{Vector1, Vector2};
use planner::{
    angle::{Course, Heading, direction, ned_from_body},
    forecast::Motion,
    los::{AscNow, LosGains, Reference, saturated_los},
    path::Path,
    snapshot::Limits,
};
use sim::{
    integrate::rk4,
    path_following::{PathCommand, PathError, PathFollowingGains, follow_path},
    surface_craft::SurfaceHull,
    underwater_vehicle::UnderwaterHull,
};

/// Speed of the hull after five minutes of `thrust` N against `resistance`.
fn steady_speed(thrust: f64, resistance: impl Fn(f64) -> f64) -> f64 {
    (0..3000)
        .fold(Vector1::new(0.0), |speed, _| {
            rk4(&speed, 0.1, |u| {
                Vector1::new((thrust - resistance(u.x)) / SurfaceHull::MEDUSA.mass_surge)
            })
        })
        .x
}

#[test]
fn eq_5_and_6_linear_drag_fitted_at_14_newtons_is_wrong_by_a_factor_of_two_at_60() {
    let coefficient = 14.0 / 0.714;
    let printed = steady_speed(60.0, |u| coefficient * u);
    assert!(printed > 2.0 * 1.477, "{printed}");
    for (thrust, measured) in [(14.0, 0.714), (15.0, 0.739), (60.0, 1.477)] {
        for drag in [SurfaceHull::MEDUSA.drag_surge, UnderwaterHull::MEDUSA.drag_surge] {
            assert!((steady_speed(thrust, |u| drag.resistance(u)) - measured).abs() < 5e-4);
        }
    }
}

/// Along-track error after 200 s, m, of a vehicle at 0.3 m/s and 50° that follows `law` at once from
/// 1 m beside a line.
fn trailing(law: impl Fn(&PathError, f64) -> PathCommand) -> f64 {
    let (tangent, u_h, step) = (0.3, 0.3 * 50_f64.to_radians().cos(), 0.01);
    let path = Path::starting_at(Vector2::zeros(), tangent).line(1000.0);
    let mut position = direction(tangent + std::f64::consts::FRAC_PI_2);
    let (mut psi, mut gamma) = (tangent, 0.0);
    for _ in 0..20_000 {
        let command = law(&PathError::new(&position, psi, &path.at(gamma)), u_h);
        position += direction(psi + 0.5 * command.heading_rate * step) * (u_h * step);
        psi += command.heading_rate * step;
        gamma += command.point_speed * step;
    }
    PathError::new(&position, psi, &path.at(gamma)).s_1
}

#[test]
fn eq_19_without_the_cosine_of_pitch_the_vehicle_settles_0_36_m_behind_its_point() {
    let gains = PathFollowingGains::LAB;
    // As printed, u drives the point, while the vehicle moves at u cosθ.
    let printed = trailing(|error, _| PathCommand {
        point_speed: 0.3 * error.psi_e.cos() + gains.k_3 * error.s_1,
        ..follow_path(error, 0.0, 0.3, &gains)
    });
    assert!((printed + 0.36).abs() < 0.005, "{printed}");
    assert!(trailing(|error, u_h| follow_path(error, 0.0, u_h, &gains)).abs() < 1e-3);
}

#[test]
fn eq_49_with_the_printed_sign_a_craft_20_m_behind_is_63_m_behind_after_300_s() {
    let (limits, gains) = (
        Limits::MEDUSA,
        LosGains {
            look_ahead: 5.0,
            along_track_gain: 0.1,
        },
    );
    let target = |time: f64| Motion {
        position: Vector2::new(0.193 * time, 0.0),
        velocity: Vector2::new(0.193, 0.0),
    };
    let distance = |law: &dyn Fn(Vector2<f64>, &Motion) -> Reference| {
        let mut position = Vector2::new(-20.0, 2.0);
        for k in 0..3000 {
            let reference = law(position, &target(0.1 * f64::from(k)));
            position += reference.heading.unit() * reference.speed * 0.1;
        }
        (position - target(300.0).position).norm()
    };
    // Eqs. (37), (38), (42) and (49), with the target's course, which works: u_d cosχ_r + k₃ s.
    let printed = distance(&|position, target| {
        let errors = ned_from_body(0.0).transpose() * (position - target.position);
        let chi_r = (-errors.y / gains.look_ahead).atan();
        let unlimited = target.velocity.norm() * chi_r.cos() + gains.along_track_gain * errors.x;
        let speed = if unlimited <= 0.0 {
            limits.speed_min
        } else {
            unlimited.min(limits.speed_max)
        };
        Reference {
            speed,
            heading: Heading::new(chi_r),
        }
    });
    assert!((printed - 63.0).abs() < 0.5, "{printed}");
    let corrected = distance(&|position, target| {
        let asc = AscNow {
            position,
            heading: Heading::new(0.0),
            current: Vector2::zeros(),
        };
        saturated_los(&asc, target, Course::of(&target.velocity), gains, &limits)
    });
    assert!(corrected < 0.01, "{corrected}");
}
