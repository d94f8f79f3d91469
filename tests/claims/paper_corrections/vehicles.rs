//! Kinematics and dynamics: eqs. (1) to (6).

use std::f64::consts::FRAC_PI_2;

use nalgebra::{Matrix2, Rotation3, Vector2, Vector3};
use sim::{
    integrate::rk4,
    surface_craft::{Drag, SurfaceHull, SurfaceInput, Thrust},
    underwater_vehicle::{UnderwaterHull, UnderwaterInput, UnderwaterState},
};

const CRAFT: SurfaceHull = SurfaceHull::MEDUSA;
const AUV: UnderwaterHull = UnderwaterHull::MEDUSA;

#[test]
fn eq_1_a_craft_that_heads_east_goes_east() {
    let velocity = Vector2::new(1.0, 0.0);
    let (sin, cos) = FRAC_PI_2.sin_cos();
    let body_from_ned = Matrix2::new(cos, sin, -sin, cos);
    let printed = body_from_ned * velocity;
    assert!((printed - Vector2::new(0.0, -1.0)).norm() < 1e-12, "as described, it goes west");

    let calm = Vector2::zeros();
    let state = CRAFT.cruising(&calm, FRAC_PI_2, 1.0);
    let slope = CRAFT.derivative(&state, Thrust::default(), SurfaceInput::default(), &calm);
    assert!((slope.fixed_rows::<2>(0) - Vector2::new(0.0, 1.0)).norm() < 1e-12);
}

#[test]
fn eq_3_a_pitched_vehicle_turns_faster_than_its_yaw_rate_and_changes_depth() {
    let (theta, psi, u, r) = (-50_f64.to_radians(), 0.4, 0.3, 0.1);
    let state = UnderwaterState::from([0.0, 0.0, 5.0, theta, psi, u, 0.0, r]);
    let slope = AUV.derivative(&state, UnderwaterInput::default(), &Vector2::zeros());

    // Second route: turn the attitude matrix by the body's rate for a moment, and take its heading.
    let attitude = Rotation3::from_euler_angles(0.0, theta, psi);
    let h = 1e-6;
    let turned = attitude * Rotation3::new(Vector3::new(0.0, 0.0, r * h));
    let heading_rate = (turned.euler_angles().2 - psi) / h;
    let printed = r;
    assert!(heading_rate / printed > 1.5, "cos 50° leaves the printed rate a third short");
    assert!((slope[4] - heading_rate).abs() < 1e-6);

    let over_ground = attitude * Vector3::new(u, 0.0, 0.0);
    assert!((slope.fixed_rows::<3>(0) - over_ground).norm() < 1e-12);
    assert!(slope[2] > 0.2, "nose down is down");
}

/// Largest kinetic energy in ten seconds of free motion without drag, over that at the start.
fn energy_gain(acceleration: impl Fn(&Vector3<f64>) -> Vector3<f64>) -> f64 {
    let mut velocity = Vector3::new(1.0, 0.2, 0.5);
    let masses = Vector3::new(CRAFT.mass_surge, CRAFT.mass_sway, CRAFT.inertia_yaw);
    let energy = |velocity: &Vector3<f64>| velocity.component_mul(velocity).dot(&masses);
    let start = energy(&velocity);
    let mut largest: f64 = 1.0;
    for _ in 0..10_000 {
        velocity = rk4(&velocity, 1e-3, &acceleration);
        largest = largest.max(energy(&velocity) / start);
    }
    largest
}

#[test]
fn eq_5_the_printed_sway_sign_creates_energy() {
    let (m_u, m_v, m_r) = (CRAFT.mass_surge, CRAFT.mass_sway, CRAFT.inertia_yaw);
    let printed = energy_gain(|velocity| {
        let (u, v, r) = (velocity.x, velocity.y, velocity.z);
        Vector3::new(m_v * v * r / m_u, m_u * u * r / m_v, (m_u - m_v) * u * v / m_r)
    });
    let none = Drag { linear: 0.0, quadratic: 0.0 };
    let frictionless = SurfaceHull { drag_surge: none, drag_sway: none, drag_yaw: none, ..CRAFT };
    let corrected = energy_gain(|velocity| frictionless.acceleration(velocity, SurfaceInput::default()));
    println!("largest energy without drag: printed ×{printed:.2}, corrected ×{corrected:.9}");
    assert!(printed > 1.2);
    assert!((corrected - 1.0).abs() < 1e-9);
}

/// Speed after five minutes of `thrust` N against `resistance`.
fn steady_speed(thrust: f64, resistance: impl Fn(f64) -> f64) -> f64 {
    let mut speed = nalgebra::Vector1::new(0.0);
    for _ in 0..3000 {
        speed = rk4(&speed, 0.1, |u| nalgebra::Vector1::new((thrust - resistance(u.x)) / CRAFT.mass_surge));
    }
    speed.x
}

#[test]
fn eq_5_and_6_linear_drag_alone_cannot_give_the_craft_its_speeds() {
    // Any linear coefficient may be fitted at one speed; fitted at 14 N it fails at 60 N.
    let coefficient = 14.0 / 0.714;
    let printed = steady_speed(60.0, |u| coefficient * u);
    assert!(printed > 2.0 * 1.477, "{printed}");
    for (thrust, measured) in [(14.0, 0.714), (15.0, 0.739), (60.0, 1.477)] {
        assert!((steady_speed(thrust, |u| CRAFT.drag_surge.resistance(u)) - measured).abs() < 5e-4);
        assert!((steady_speed(thrust, |u| AUV.drag_surge.resistance(u)) - measured).abs() < 5e-4);
    }
}

#[test]
fn eq_6_a_restoring_term_without_the_pitch_tumbles_the_vehicle() {
    let calm = Vector2::zeros();
    let free = UnderwaterInput::default();
    let pitch_after_a_minute = |start: f64, constant: Option<f64>| {
        let state = UnderwaterState::from([0.0, 0.0, 5.0, start, 0.0, 0.0, 0.0, 0.0]);
        let end = (0..600).fold(state, |state, _| {
            rk4(&state, 0.1, |x| {
                let mut slope = AUV.derivative(x, free, &calm);
                if let Some(g) = constant {
                    slope[6] = (-AUV.drag_pitch.resistance(x[6]) - g) / AUV.inertia_pitch;
                }
                slope
            })
        });
        end[3]
    };
    let printed = pitch_after_a_minute(0.0, Some(AUV.restoring_moment));
    assert!(printed.abs() > 6.0, "a level vehicle is turned over: {printed} rad");
    assert!(pitch_after_a_minute(0.0, None).abs() < 1e-12);
    assert!(pitch_after_a_minute(0.8, None).abs() < 1e-3);
}
