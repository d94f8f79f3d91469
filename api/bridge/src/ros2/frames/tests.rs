use std::f64::consts::{FRAC_1_SQRT_2, FRAC_PI_2, FRAC_PI_4, PI};

use nalgebra::SMatrix;
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;

use super::{super::messages::*, *};

/// A few roundings of numbers up to 100.
const ROUNDING: f64 = 1e-12;

fn odometry() -> Odometry {
    Odometry {
        header: Header::default(),
        child_frame_id: String::new(),
        pose: PoseWithCovariance {
            pose: Pose {
                position: [0.0; 3],
                orientation: [0.0, 0.0, 0.0, 1.0],
            },
            covariance: [[0.0; 6]; 6],
        },
        twist: TwistWithCovariance {
            twist: Twist {
                linear: [0.0; 3],
                angular: [0.0; 3],
            },
            covariance: [[0.0; 6]; 6],
        },
    }
}

fn random_quaternion(rng: &mut ChaCha8Rng) -> UnitQuaternion<f64> {
    UnitQuaternion::from_quaternion(Quaternion::new(
        rng.random_range(-1.0..1.0),
        rng.random_range(-1.0..1.0),
        rng.random_range(-1.0..1.0),
        rng.random_range(0.1..1.0),
    ))
}

fn random_vector(rng: &mut ChaCha8Rng) -> [f64; 3] {
    [(); 3].map(|()| rng.random_range(-10.0..10.0))
}

fn random_covariance(rng: &mut ChaCha8Rng) -> Covariance {
    let root = SMatrix::<f64, 6, 6>::from_fn(|_, _| rng.random_range(-1.0..1.0));
    let p = root * root.transpose();
    std::array::from_fn(|i| std::array::from_fn(|j| p[(i, j)]))
}

#[test]
fn a_body_that_looks_east_has_yaw_zero_and_heading_ninety_degrees() {
    let motion = Motion::from_odometry(&odometry()).expect("is motion");
    assert!((motion.heading() - FRAC_PI_2).abs() < ROUNDING);
    assert!(motion.pitch().abs() < ROUNDING && motion.roll().abs() < ROUNDING);
}

#[test]
fn bow_up_is_positive_and_starboard_down_is_positive() {
    // Turns about y, which is left, by −45° lift the bow; about x, which is forward, by 45° lower starboard.
    let about = |axis: Vector3<f64>, angle: f64| {
        let q = UnitQuaternion::from_scaled_axis(axis * angle);
        let mut odometry = odometry();
        odometry.pose.pose.orientation = q.coords.into();
        Motion::from_odometry(&odometry).expect("is motion")
    };
    assert!((about(Vector3::y(), -FRAC_PI_4).pitch() - FRAC_PI_4).abs() < ROUNDING);
    assert!((about(Vector3::x(), FRAC_PI_4).roll() - FRAC_PI_4).abs() < ROUNDING);
}

/// Second route: quaternions alone, as MAVROS does it. T and D are half turns about (1, 1, 0)/√2 and (1, 0, 0).
#[test]
fn attitudes_are_those_that_quaternions_give() {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let t = Quaternion::new(0.0, FRAC_1_SQRT_2, FRAC_1_SQRT_2, 0.0);
    let d = Quaternion::new(0.0, 1.0, 0.0, 0.0);
    for _ in 0..200 {
        let q = random_quaternion(&mut rng);
        let mut odometry = odometry();
        odometry.pose.pose.orientation = q.coords.into();
        let motion = Motion::from_odometry(&odometry).expect("is motion");
        let (roll, pitch, heading) = UnitQuaternion::from_quaternion(t * q.quaternion() * d).euler_angles();
        assert!((motion.heading() - heading).abs() < ROUNDING);
        assert!((motion.pitch() - pitch).abs() < ROUNDING);
        assert!((motion.roll() - roll).abs() < ROUNDING);
    }
}

/// Second route: the velocity is turned into the map first, and its members are then swapped by hand.
#[test]
fn ground_velocity_is_the_bodys_velocity_in_the_map() {
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    for _ in 0..200 {
        let q = random_quaternion(&mut rng);
        let mut odometry = odometry();
        odometry.pose.pose.orientation = q.coords.into();
        odometry.twist.twist.linear = random_vector(&mut rng);
        odometry.twist.twist.angular = random_vector(&mut rng);
        let motion = Motion::from_odometry(&odometry).expect("is motion");
        let in_map = q * Vector3::from(odometry.twist.twist.linear);
        let ground = motion.ground_velocity().expect("is stated");
        assert!((ground - Vector2::new(in_map.y, in_map.x)).norm() < 100.0 * ROUNDING);
        let [x, y, z] = odometry.twist.twist.linear;
        let twist = motion.twist.expect("is stated");
        assert_eq!(twist.velocity, Vector3::new(x, -y, -z));
        let [x, y, z] = odometry.twist.twist.angular;
        assert_eq!(twist.rates, Vector3::new(x, -y, -z));
    }
}

/// Second route: indices and signs, P'_ij = s_i s_j P_σ(i)σ(j).
#[test]
fn covariances_are_permuted_and_change_sign_with_their_axes() {
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    for _ in 0..50 {
        let mut odometry = odometry();
        odometry.pose.covariance = random_covariance(&mut rng);
        odometry.twist.covariance = random_covariance(&mut rng);
        let motion = Motion::from_odometry(&odometry).expect("is motion");
        let pose = motion.pose_covariance.expect("is stated");
        let twist = motion
            .twist
            .and_then(|twist| twist.covariance)
            .expect("is stated");
        let (order, pose_signs) = ([1, 0, 2, 4, 3, 5], [1.0, 1.0, -1.0, 1.0, 1.0, -1.0]);
        let twist_signs = [1.0, -1.0, -1.0, 1.0, -1.0, -1.0];
        for i in 0..6 {
            for j in 0..6 {
                let expected = pose_signs[i] * pose_signs[j] * odometry.pose.covariance[order[i]][order[j]];
                assert!((pose[(i, j)] - expected).abs() < ROUNDING);
                let expected = twist_signs[i] * twist_signs[j] * odometry.twist.covariance[i][j];
                assert!((twist[(i, j)] - expected).abs() < ROUNDING);
            }
        }
    }
}

#[test]
fn sigma_is_the_deviation_in_the_direction_where_it_is_largest() {
    const DIRECTIONS: u32 = 10_000;
    let mut rng = ChaCha8Rng::seed_from_u64(4);
    for _ in 0..20 {
        let mut odometry = odometry();
        odometry.pose.covariance = random_covariance(&mut rng);
        let [[xx, xy, ..], [_, yy, ..], ..] = odometry.pose.covariance;
        let largest = (0..DIRECTIONS)
            .map(|k| (PI * f64::from(k) / f64::from(DIRECTIONS)).sin_cos())
            .map(|(s, c)| c * c * xx + 2.0 * s * c * xy + s * s * yy)
            .fold(0.0, f64::max)
            .sqrt();
        let sigma = Motion::from_odometry(&odometry)
            .expect("is motion")
            .sigma()
            .expect("is stated");
        // The best of the directions is within π/20,000 of the largest; a maximum is flat.
        assert!((sigma - largest).abs() < 1e-6, "{sigma} {largest}");
    }
}

#[test]
fn a_level_pose_and_twist_come_back() {
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    for _ in 0..200 {
        let (position, heading) = (
            Vector2::new(rng.random_range(-100.0..100.0), rng.random_range(-100.0..100.0)),
            rng.random_range(-PI..PI),
        );
        let (surge, yaw_rate) = (rng.random_range(0.1..2.0), rng.random_range(-0.5..0.5));
        let mut odometry = odometry();
        odometry.pose.pose = level_pose(&position, heading);
        odometry.twist.twist = level_twist(surge, yaw_rate);
        let motion = Motion::from_odometry(&odometry).expect("is motion");
        assert_eq!(motion.position.xy(), position);
        assert!((motion.heading() - heading).abs() < ROUNDING);
        assert!(motion.pitch().abs() < ROUNDING && motion.roll().abs() < ROUNDING);
        let twist = motion.twist.expect("is stated");
        assert_eq!((twist.velocity.x, twist.rates.z), (surge, yaw_rate));
    }
}

#[test]
fn a_heading_of_north_is_a_yaw_of_ninety_degrees() {
    let pose = level_pose(&Vector2::new(3.0, 4.0), 0.0);
    assert_eq!(pose.position, [4.0, 3.0, 0.0]);
    let expected = [0.0, 0.0, FRAC_1_SQRT_2, FRAC_1_SQRT_2];
    for (is, expected) in pose.orientation.into_iter().zip(expected) {
        assert!((is - expected).abs() < ROUNDING);
    }
    // To starboard is clockwise, which is negative in ROS.
    assert!(level_twist(1.0, 0.2).angular[2] < 0.0);
}

#[test]
fn zeros_state_nothing() {
    let motion = Motion::from_odometry(&odometry()).expect("is motion");
    assert_eq!((motion.pose_covariance, motion.sigma()), (None, None));
    assert_eq!((&motion.twist, motion.ground_velocity()), (&None, None));
    let mut odometry = odometry();
    odometry.twist.covariance[0][0] = 0.01;
    let motion = Motion::from_odometry(&odometry).expect("is motion");
    assert_eq!(motion.ground_velocity(), Some(Vector2::zeros()));
}

#[test]
fn what_cannot_be_motion_is_refused_by_name() {
    type Spoil = fn(&mut Odometry);
    let cases: [(Spoil, NotMotion); 16] = [
        (|o| o.pose.pose.position[0] = f64::NAN, NotMotion::Position),
        (|o| o.pose.pose.position[2] = f64::INFINITY, NotMotion::Position),
        (|o| o.pose.pose.orientation = [0.0; 4], NotMotion::Orientation),
        (
            |o| o.pose.pose.orientation = [0.0, 0.0, 0.0, 1.1],
            NotMotion::Orientation,
        ),
        (|o| o.pose.pose.orientation[1] = f64::NAN, NotMotion::Orientation),
        (
            |o| o.pose.pose.orientation[3] = f64::INFINITY,
            NotMotion::Orientation,
        ),
        (|o| o.twist.twist.linear[1] = f64::NAN, NotMotion::Twist),
        (|o| o.twist.twist.angular[2] = f64::NEG_INFINITY, NotMotion::Twist),
        (|o| o.pose.covariance[0][0] = -1.0, NotMotion::PoseCovariance),
        (|o| o.pose.covariance[0][0] = 0.0, NotMotion::PoseCovariance),
        (|o| o.pose.covariance[4][4] = f64::NAN, NotMotion::PoseCovariance),
        (
            |o| o.pose.covariance[5][5] = f64::INFINITY,
            NotMotion::PoseCovariance,
        ),
        (|o| o.pose.covariance[0][1] = 0.5, NotMotion::PoseCovariance),
        (
            |o| (o.pose.covariance[0][1], o.pose.covariance[1][0]) = (1.5, 1.5),
            NotMotion::PoseCovariance,
        ),
        (
            |o| (o.twist.covariance[0][5], o.twist.covariance[5][0]) = (0.1, 0.1),
            NotMotion::TwistCovariance,
        ),
        (|o| o.twist.covariance[3][3] = -0.1, NotMotion::TwistCovariance),
    ];
    for (index, (spoil, expected)) in cases.into_iter().enumerate() {
        let mut odometry = odometry();
        for axis in 0..6 {
            odometry.pose.covariance[axis][axis] = 1.0;
        }
        spoil(&mut odometry);
        assert_eq!(Motion::from_odometry(&odometry), Err(expected), "case {index}");
    }
}

#[test]
fn an_axis_that_is_unknown_or_exact_is_no_reason_to_refuse() {
    let mut odometry = odometry();
    let variances = [1e-4, 1e-4, 0.0, 1e9, 1e9, 1e-3];
    for (axis, variance) in variances.into_iter().enumerate() {
        odometry.pose.covariance[axis][axis] = variance;
    }
    let motion = Motion::from_odometry(&odometry).expect("is motion");
    let sigma = motion.sigma().expect("is stated");
    assert!((sigma - 0.01).abs() < ROUNDING);
}
