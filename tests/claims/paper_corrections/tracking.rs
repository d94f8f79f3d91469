//! Target tracking and formations: eqs. (34) to (51).

use std::f64::consts::{FRAC_PI_2, PI};

use nalgebra::Vector2;
use planner::{
    angle::{Course, Heading, direction, ned_from_body, wrap},
    forecast::Motion,
    goal::GoalForecast,
    los::{AscNow, LosGains, Reference, saturated_los, saturated_los_tracker_frame, target_course},
    snapshot::{Goal, Limits},
};
use tests::{auv, both, observation, snapshot};

const GAINS: LosGains = LosGains { look_ahead: 5.0, along_track_gain: 0.1 };
/// Horizontal speed of the target, m/s.
const U_D: f64 = 0.193;

fn target(time: f64, course: f64) -> Motion {
    let velocity = direction(course) * U_D;
    Motion { position: velocity * time, velocity }
}

fn projects(position: Vector2<f64>, target: &Motion, current: Vector2<f64>) -> Reference {
    let asc = AscNow { position, heading: Heading::new(0.0), current };
    saturated_los(&asc, target, Course::of(&target.velocity), GAINS, &Limits::MEDUSA)
}

/// (s, e) of `position` in the target's frame, turned by `angle`.
fn in_frame(angle: f64, position: Vector2<f64>, target: &Motion) -> Vector2<f64> {
    ned_from_body(angle).transpose() * (position - target.position)
}

/// Distance to a target on `course` after `seconds`, for a craft without lag.
fn distance_after(
    seconds: u32,
    start: Vector2<f64>,
    course: f64,
    current: Vector2<f64>,
    law: impl Fn(Vector2<f64>, &Motion) -> Reference,
) -> f64 {
    let step = 0.1;
    let mut position = start;
    for k in 0..seconds * 10 {
        let reference = law(position, &target(f64::from(k) * step, course));
        position += (reference.heading.unit() * reference.speed + current) * step;
    }
    (position - target(f64::from(seconds), course).position).norm()
}

#[test]
fn eqs_34_to_38_the_frame_is_the_target_s_and_its_rotation_is_transposed() {
    // Ten metres behind an eastbound target, for any heading of the craft.
    let (psi_d, position) = (FRAC_PI_2, Vector2::new(0.0, -10.0));
    let still = target(0.0, psi_d);
    let corrected = in_frame(psi_d, position, &still);
    assert!((corrected - Vector2::new(-10.0, 0.0)).norm() < 1e-12);
    let printed_36 = ned_from_body(psi_d) * position;
    assert!((printed_36 - Vector2::new(10.0, 0.0)).norm() < 1e-12, "behind becomes ahead");
    let by_own_heading = in_frame(PI, position, &still);
    assert!((by_own_heading - Vector2::new(0.0, 10.0)).norm() < 1e-12, "behind becomes abreast");

    // The project's law is ten metres behind: straight on, faster by k₃ · 10 m.
    for own_heading in [0.0, 1.0, PI] {
        let asc = AscNow { position, heading: Heading::new(own_heading), current: Vector2::zeros() };
        let reference = saturated_los(&asc, &still, Course::new(psi_d), GAINS, &Limits::MEDUSA);
        assert!((reference.heading.radians() - psi_d).abs() < 1e-12);
        assert!((reference.speed - (U_D + 1.0)).abs() < 1e-12);
    }
}

#[test]
fn eqs_40_to_42_a_course_steered_as_a_heading_drifts_off() {
    let current = Vector2::new(0.0, 0.12);
    let printed = |position: Vector2<f64>, target: &Motion| projects(position, target, Vector2::zeros());
    let corrected = |position: Vector2<f64>, target: &Motion| projects(position, target, current);
    let start = Vector2::new(-5.0, -3.0);
    let off = distance_after(600, start, 0.0, current, printed);
    let on = distance_after(600, start, 0.0, current, corrected);
    println!("0.12 m/s across: course as heading {off:.2} m, compensated {on:.4} m");
    assert!(off > 2.0);
    assert!(on < 0.05);
}

#[test]
fn eq_41_the_range_is_open_so_the_law_never_turns_back() {
    for e in [-1e6, -10.0, 10.0, 1e6] {
        let ahead_and_beside = Vector2::new(50.0, e);
        let reference = projects(ahead_and_beside, &target(0.0, 0.0), Vector2::zeros());
        // The printed closed interval promises ±π/2, which no error reaches.
        assert!(reference.heading.radians().abs() < FRAC_PI_2);
    }
}

#[test]
fn eqs_44_to_48_each_frame_has_its_own_error_rates() {
    // A target that turns and a craft on another course; rates by central differences.
    let (psi_d, r_d, u, chi) = (0.6, 0.05, 0.4, -0.3);
    let craft = |t: f64| Vector2::new(3.0, -4.0) + direction(chi) * (u * t);
    let motion = |t: f64| Motion {
        position: (direction(psi_d + r_d * t - FRAC_PI_2) - direction(psi_d - FRAC_PI_2)) * (U_D / r_d),
        velocity: direction(psi_d + r_d * t) * U_D,
    };
    let h = 1e-4;
    let rate = |frame: &dyn Fn(f64) -> f64| {
        (in_frame(frame(h), craft(h), &motion(h)) - in_frame(frame(-h), craft(-h), &motion(-h))) / (2.0 * h)
    };
    let chi_r = chi - psi_d;
    let in_target = in_frame(psi_d, craft(0.0), &motion(0.0));
    let printed =
        Vector2::new(r_d * in_target.y + u - U_D * chi_r.cos(), -r_d * in_target.x + U_D * chi_r.sin());
    let corrected =
        Vector2::new(r_d * in_target.y + u * chi_r.cos() - U_D, -r_d * in_target.x + u * chi_r.sin());
    let measured = rate(&|t| psi_d + r_d * t);
    assert!((measured - corrected).norm() < 1e-7);
    assert!((measured - printed).norm() > 0.1);

    // The printed rates are those of the tracker's frame, which does not turn here.
    let tracker = rate(&|_| chi);
    assert!((tracker - Vector2::new(u - U_D * chi_r.cos(), U_D * chi_r.sin())).norm() < 1e-7);
}

#[test]
fn eq_48_convergence_is_asymptotic() {
    // Straight behind: ds/dt = −k₃ s once unsaturated, so every second takes the same share.
    let distance = |seconds| {
        let law = |position: Vector2<f64>, target: &Motion| projects(position, target, Vector2::zeros());
        distance_after(seconds, Vector2::new(-5.0, 0.0), 0.0, Vector2::zeros(), law)
    };
    let (first, second) = (distance(60) / distance(30), distance(90) / distance(60));
    assert!((first - second).abs() < 1e-6 && distance(90) > 0.0, "no finite time, as printed");
    // e^(−k₃ · 30 s), up to the step's share.
    assert!((first - (-3.0_f64).exp()).abs() < 1e-3);
}

#[test]
fn eq_45_in_the_target_s_frame_the_printed_speed_lets_the_error_grow() {
    // V = ½ (s² + e²), dV/dt = s (u cos χ_r − u_d) + e u sin χ_r in the target's frame.
    let (s, e, delta, k_3): (f64, f64, f64, f64) = (-10.0, 3.0, 3.0, 0.005);
    let chi_r = (-e / delta).atan();
    let growth = |u: f64| s * (u * chi_r.cos() - U_D) + e * u * chi_r.sin();
    let printed = U_D * chi_r.cos() - k_3 * s;
    let definite = (U_D - k_3 * s) / chi_r.cos();
    assert!(growth(printed) > 0.0, "{}", growth(printed));
    assert!(growth(definite) < 0.0);
    assert!((growth(definite) - (-k_3 * s * s - e * e * (U_D - k_3 * s) / delta)).abs() < 1e-12);

    // In the tracker's frame, turned by the law's course, the printed speed reduces it as proved.
    let (start, target) = (Vector2::new(s, e), target(0.0, 0.0));
    let asc = AscNow { position: start, heading: Heading::new(0.0), current: Vector2::zeros() };
    let gains = LosGains { look_ahead: delta, along_track_gain: k_3 };
    let reference =
        saturated_los_tracker_frame(&asc, &target, Course::of(&target.velocity), gains, &Limits::MEDUSA);
    let velocity = reference.heading.unit() * reference.speed;
    let own = in_frame(reference.heading.radians(), start, &target);
    let proved = -k_3 * own.x * own.x - U_D * own.y * own.y / own.y.hypot(delta);
    let rate = start.dot(&(velocity - target.velocity));
    assert!((rate - proved).abs() < 1e-12 && proved < 0.0, "{rate} and {proved}");

    // The saturated law keeps the printed speed and still converges: only its proof is lost.
    let law = |position: Vector2<f64>, target: &Motion| projects(position, target, Vector2::zeros());
    assert!(distance_after(300, Vector2::new(s, e), 0.0, Vector2::zeros(), law) < 0.1);
}

/// The tracker as printed in its source:
///
/// ```text
/// (s, e) = R(ψ_d)ᵀ (p − p_d)             ψ = ψ_d + atan(−e / Δ)
/// u = 0.05 where u* ≤ 0,   1.5 where 1.5 < u*,   else u* = u_d cos(ψ − ψ_d) + k₃ s
/// ```
/// Source: eqs. (37), (38), (42), (49). They contradict each other in the ψ that rotates the
/// errors: here it is the target's, which works.
fn printed_los(asc: &AscNow, target: &Motion) -> Reference {
    let (limits, psi_d) = (Limits::MEDUSA, Course::of(&target.velocity).radians());
    let errors = in_frame(psi_d, asc.position, target);
    let chi_r = (-errors.y / GAINS.look_ahead).atan();
    let unlimited = target.velocity.norm() * chi_r.cos() + GAINS.along_track_gain * errors.x;
    Reference {
        speed: if unlimited <= 0.0 { limits.speed_min } else { unlimited.min(limits.speed_max) },
        heading: Heading::new(psi_d + chi_r),
    }
}

#[test]
fn eq_49_the_printed_sign_runs_away() {
    let printed = |position: Vector2<f64>, target: &Motion| {
        let asc = AscNow { position, heading: Heading::new(0.0), current: Vector2::zeros() };
        printed_los(&asc, target)
    };
    let corrected = |position: Vector2<f64>, target: &Motion| projects(position, target, Vector2::zeros());
    let calm = Vector2::zeros();
    let behind = Vector2::new(-20.0, 2.0);
    let (off, on) =
        (distance_after(300, behind, 0.0, calm, printed), distance_after(300, behind, 0.0, calm, corrected));
    println!("(49) after 300 s from 20 m behind: printed {off:.1} m, corrected {on:.4} m");
    assert!(off > 50.0);
    assert!(on < 0.01);

    // Its lower bound admits speeds above 0 and below the least speed that steers.
    let creeping = Vector2::new(-1.92, 0.0);
    let speed = printed(creeping, &target(0.0, 0.0)).speed;
    assert!(0.0 < speed && speed < 0.05);
    let far_ahead = projects(Vector2::new(1.92, 0.0), &target(0.0, 0.0), calm).speed;
    assert!((far_ahead - 0.05).abs() < 1e-12);
}

#[test]
fn eq_50_exactly_one_vehicle_is_followed_at_the_hand_over() {
    let dwell = 240.0;
    let claimed =
        |t: f64| (0..4).filter(|k| (f64::from(*k) * dwell..=f64::from(k + 1) * dwell).contains(&t)).count();
    assert_eq!(claimed(240.0), 2, "closed intervals: both vehicles at once");

    let followed_at = |time: f64| {
        let mut seen = observation(Goal::Intermittent { auvs: both(), dwell_s: dwell, epoch_s: 0.0 });
        seen.t_s = time;
        let now = GoalForecast::new(&snapshot(seen)).at(0.0).position;
        if now.y < 30.0 { 1 } else { 2 }
    };
    assert_eq!([0.0, 239.9, 240.0, 479.9, 480.0].map(followed_at), [1, 1, 2, 2, 1]);
}

#[test]
fn eq_51_velocities_are_averaged_and_headings_never() {
    let midpoint = |first: f64, second: f64| {
        let mut seen = observation(Goal::Midpoint { auvs: both() });
        seen.auvs = vec![auv("auv-1", 0.0, 0.0, first), auv("auv-2", 0.0, 60.0, second)];
        GoalForecast::new(&snapshot(seen)).at(0.0)
    };
    // Two southbound vehicles, one degree either side: the mean of their headings points north.
    let (first, second) = (PI - 0.02, -PI + 0.02);
    let mean_of_headings = 0.5 * (first + second);
    assert!(mean_of_headings.abs() < 1e-12);
    let motion = midpoint(first, second);
    let course = target_course(&motion, None).radians();
    assert!(wrap(course - PI).abs() < 1e-9);
    assert!((motion.position.y - 30.0).abs() < 1e-9);

    // A printed midpoint is a point: without its velocity the law would stop 1 m behind.
    assert!((motion.velocity.norm() - U_D * 0.02_f64.cos()).abs() < 1e-12);

    // Opposite vehicles: the midpoint stands still, its course is held and its speed is not.
    let standing = midpoint(0.3, 0.3 + PI);
    assert!(standing.velocity.norm() < 1e-12);
    let held = target_course(&standing, Some(Course::new(0.3)));
    assert_eq!(held, Course::new(0.3));
    // Moving again, the held course is dropped.
    assert!(wrap(target_course(&motion, Some(Course::new(0.3))).radians() - PI).abs() < 1e-9);
}
