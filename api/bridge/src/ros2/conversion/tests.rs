use std::f64::consts::{FRAC_PI_2, PI};

use nalgebra::Vector2;

use super::*;
use crate::{
    reference::Stage,
    ros2::messages::{PoseWithCovariance, TwistWithCovariance},
};

const ORIGIN: Geographic = Geographic {
    lat_deg: 38.41,
    lon_deg: -9.12,
};
const NOW_S: f64 = 1_700_000_000.0;

/// m, of coordinates that go to degrees and back, and rad.
const ROUNDING: f64 = 1e-6;

fn conversion() -> Conversion {
    let frames = ("map".to_owned(), "base_link".to_owned());
    let heading_loop = HeadingLoop {
        time_constant_s: 2.0,
        rate_max_radps: 0.25,
    };
    Conversion::new(ORIGIN, frames, heading_loop).expect("is on Earth")
}

/// Of a body on `heading` at (north, east) with 1 m/s ahead.
fn odometry(position: [f64; 2], heading: f64, t_s: f64) -> Odometry {
    let mut pose_covariance = [[0.0; 6]; 6];
    for (axis, row) in pose_covariance.iter_mut().enumerate() {
        row[axis] = 4.0;
    }
    Odometry {
        header: Header {
            stamp: Stamp::at(t_s).expect("can be told"),
            frame_id: "map".to_owned(),
        },
        child_frame_id: "base_link".to_owned(),
        pose: PoseWithCovariance {
            pose: level_pose(&position.into(), heading),
            covariance: pose_covariance,
        },
        twist: TwistWithCovariance {
            twist: level_twist(1.0, 0.1),
            covariance: [[0.0; 6]; 6],
        },
    }
}

fn measured(measurements: &[Measurement]) -> Vec<CraftMeasurement> {
    let of_craft = |measurement: &Measurement| match measurement {
        Measurement::Craft { measured, .. } => *measured,
        Measurement::Auv(_) => panic!("is of the craft"),
    };
    measurements.iter().map(of_craft).collect()
}

#[test]
fn the_craft_tells_position_heading_ground_velocity_and_yaw_rate_but_no_water_velocity() {
    let mut refused = Refused::default();
    let message = odometry([300.0, -400.0], FRAC_PI_2, NOW_S - 0.25);
    let measurements = conversion().craft(&message, NOW_S, &mut refused);
    assert!(
        measurements
            .iter()
            .all(|m| matches!(m, Measurement::Craft { t_s, .. } if *t_s == NOW_S - 0.25))
    );
    let [
        CraftMeasurement::Position(place),
        CraftMeasurement::Heading(heading),
        CraftMeasurement::GroundVelocity(velocity),
        CraftMeasurement::YawRate(rate),
    ] = measured(&measurements)[..]
    else {
        panic!("{measurements:?}");
    };
    let datum = Datum::new(&radians(ORIGIN)).expect("is on Earth");
    let back = datum.to_local(&radians(place)).expect("is on Earth");
    assert!((back - Vector2::new(300.0, -400.0)).norm() < ROUNDING);
    assert!((heading - FRAC_PI_2).abs() < ROUNDING);
    assert!((velocity - Vector2::new(0.0, 1.0)).norm() < ROUNDING);
    assert_eq!(rate, 0.1);
    assert_eq!(refused, Refused::default());
}

#[test]
fn an_auv_tells_position_sigma_depth_and_velocity() {
    let mut message = odometry([30.0, 40.0], 0.0, NOW_S);
    message.pose.pose.position[2] = -12.5;
    let mut refused = Refused::default();
    let told = conversion().auv("red", &message, NOW_S, &mut refused);
    let Some(Measurement::Auv(fix)) = told else {
        panic!("{told:?}");
    };
    assert_eq!((fix.auv.as_str(), fix.t_s), ("red", NOW_S));
    assert_eq!((fix.sigma_m, fix.depth_m), (Some(2.0), Some(12.5)));
    let velocity = fix.ground_velocity.expect("was told");
    assert!((velocity - Vector2::new(1.0, 0.0)).norm() < ROUNDING);
}

#[test]
fn a_stamp_that_is_not_the_time_of_day_gives_way_to_the_arrival() {
    let (early, late) = (NOW_S - AGE_MAX_S, NOW_S + AHEAD_MAX_S);
    for (stamp_s, t_s, times) in [
        (early, early, 0),
        (late, late, 0),
        (early - 1.0, NOW_S, 1),
        (late + 1.0, NOW_S, 1),
        (0.0, NOW_S, 1),
    ] {
        let mut refused = Refused::default();
        let message = odometry([0.0, 0.0], 0.0, stamp_s);
        let told = conversion().auv("red", &message, NOW_S, &mut refused);
        let Some(Measurement::Auv(fix)) = told else {
            panic!("{told:?}");
        };
        assert_eq!((fix.t_s, refused.total()), (t_s, times), "{stamp_s}");
    }
}

#[test]
fn what_is_not_of_this_map_is_refused_by_name() {
    type Spoil = fn(&mut Odometry);
    let cases: [(Spoil, &str); 6] = [
        (
            |o| o.header.frame_id = "odom".to_owned(),
            "odometry: frame_id is not map_frame",
        ),
        (
            |o| o.header.frame_id.clear(),
            "odometry: frame_id is not map_frame",
        ),
        (
            |o| o.child_frame_id = "base_link_frd".to_owned(),
            "odometry: child_frame_id is not forward-left-up",
        ),
        (
            |o| o.pose.pose.position[0] = 200e3,
            "odometry: position is off the map",
        ),
        (
            |o| o.pose.pose.position[0] = 1e300,
            "odometry: position is off the map",
        ),
        (
            |o| o.pose.pose.orientation = [0.0; 4],
            "odometry: orientation is no unit quaternion",
        ),
    ];
    for (spoil, reason) in cases {
        let mut message = odometry([0.0, 0.0], 0.0, NOW_S);
        spoil(&mut message);
        let (mut conversion, mut refused) = (conversion(), Refused::default());
        assert_eq!(conversion.craft(&message, NOW_S, &mut refused), []);
        assert_eq!(conversion.auv("red", &message, NOW_S, &mut refused), None);
        assert_eq!(refused.iter().collect::<Vec<_>>(), [(reason, 2)]);
    }
}

#[test]
fn the_turn_is_the_shorter_one_by_the_declared_loop_and_no_faster_than_allowed() {
    for (heading, reference, yaw_rate) in [
        (0.2, 0.2, 0.0),
        (0.2, 0.4, 0.1),
        (0.4, 0.2, -0.1),
        (PI - 0.1, -PI + 0.1, 0.1),
        (0.0, 3.0, 0.25),
        (0.0, -3.0, -0.25),
    ] {
        let (mut conversion, mut refused) = (conversion(), Refused::default());
        conversion.craft(&odometry([0.0, 0.0], heading, NOW_S), NOW_S, &mut refused);
        let reference = Reference {
            speed: 0.8,
            heading: reference,
        };
        let twist = conversion
            .twist(&reference, NOW_S, &mut refused)
            .expect("knows the heading");
        assert_eq!(twist.header.frame_id, "base_link");
        assert_eq!(twist.twist.linear, [0.8, 0.0, 0.0]);
        // Counter-clockwise is positive in ROS.
        assert!(
            (twist.twist.angular[2] + yaw_rate).abs() < ROUNDING,
            "{heading} {reference:?}"
        );
    }
}

#[test]
fn without_a_recent_heading_or_a_number_there_is_no_twist() {
    let reference = Reference {
        speed: 0.8,
        heading: 0.0,
    };
    let (mut conversion, mut refused) = (conversion(), Refused::default());
    assert_eq!(conversion.twist(&reference, NOW_S, &mut refused), None);
    conversion.craft(&odometry([0.0, 0.0], 0.0, NOW_S), NOW_S, &mut refused);
    let old_s = NOW_S + 2.0 * HEADING_AGE_MAX_S;
    assert_eq!(conversion.twist(&reference, old_s, &mut refused), None);
    for reference in [
        Reference {
            speed: f64::NAN,
            ..reference
        },
        Reference {
            heading: f64::NAN,
            ..reference
        },
    ] {
        assert_eq!(conversion.twist(&reference, NOW_S, &mut refused), None);
    }
    assert_eq!(
        refused.iter().collect::<Vec<_>>(),
        [
            ("reference: no recent heading of the craft", 2),
            ("reference: not finite", 2)
        ]
    );
}

#[test]
fn a_path_is_on_the_map_wherever_the_mission_has_its_origin() {
    let datum = Datum::new(&radians(ORIGIN)).expect("is on Earth");
    let place = datum.from_local(&Vector2::new(30.0, -50.0));
    let stage = Stage {
        t_s: NOW_S + 5.0,
        // From the mission's origin, which is elsewhere.
        position: Vector2::new(1234.0, 567.0),
        geographic: Geographic::new(place.latitude.to_degrees(), place.longitude.to_degrees()),
        reference: Reference {
            speed: 0.8,
            heading: 0.6,
        },
    };
    let mut plan = PlannedReference {
        planned_s: NOW_S,
        first: stage.reference,
        stages: vec![stage],
        lags: [0.0, 0.0],
        current: Vector2::zeros(),
        valid_until_s: NOW_S + 10.0,
    };
    let (conversion, mut refused) = (conversion(), Refused::default());
    let path = conversion.path(&plan, &mut refused).expect("is on the map");
    assert_eq!(
        (path.header.frame_id.as_str(), path.header.stamp.sec),
        ("map", 1_700_000_000)
    );
    let [pose] = &path.poses[..] else {
        panic!("{path:?}");
    };
    assert_eq!(pose.header.stamp.sec, 1_700_000_005);
    let [east, north, up] = pose.pose.position;
    assert!((east + 50.0).abs() < ROUNDING && (north - 30.0).abs() < ROUNDING && up == 0.0);
    let mut message = odometry([0.0, 0.0], 0.0, NOW_S);
    message.pose.pose = pose.pose;
    let motion = Motion::from_odometry(&message).expect("is motion");
    assert!((motion.heading() - 0.6).abs() < ROUNDING);

    plan.stages[0].geographic = None;
    assert_eq!(conversion.path(&plan, &mut refused), None);
    plan.stages[0].geographic = Geographic::new(-38.0, 170.0);
    assert_eq!(conversion.path(&plan, &mut refused), None);
    assert_eq!(
        refused.iter().collect::<Vec<_>>(),
        [("plan: a stage is not on the map", 2)]
    );
}
