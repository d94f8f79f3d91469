"""Odometry and ranges that are rejected, and attitudes other than level."""

import math

import numpy as np
import pytest
from geometry_msgs.msg import TransformStamped
from nav_msgs.msg import Odometry
from pilotfish_ros2.conversion import Rejected, in_map, motion, slant_range, twist_message
from pilotfish_ros2.following import Reference
from sensor_msgs.msg import Range

NOW_S = 1.8e9


def odometry():
    """At 3 m east, 4 m north, 5 m deep, bow to the east, level, at 1 m/s."""
    message = Odometry()
    message.header.frame_id, message.child_frame_id = "map", "base_link"
    message.header.stamp.sec = int(NOW_S)
    message.pose.pose.position.x, message.pose.pose.position.y, message.pose.pose.position.z = 3.0, 4.0, -5.0
    message.twist.twist.linear.x = 1.0
    return message


def covariance(**entries):
    p = np.eye(6)
    for place, value in entries.items():
        p[int(place[1]), int(place[2])] = value
    return p.ravel()


@pytest.mark.parametrize(
    ("path", "value", "reason"),
    [
        ("header.frame_id", "odom", "frame_id is odom, not map"),
        ("header.frame_id", "", "frame_id is empty, not map"),
        ("child_frame_id", "base_link_frd", "child_frame_id is not forward-left-up"),
        ("pose.pose.position.x", math.nan, "position is not within 100 km of the origin"),
        ("pose.pose.position.y", 1.1e5, "position is not within 100 km of the origin"),
        ("pose.pose.position.z", math.inf, "position is not within 100 km of the origin"),
        ("pose.pose.orientation.w", 0.0, "orientation is not a unit quaternion"),
        ("pose.pose.orientation.w", math.nan, "orientation is not a unit quaternion"),
        ("twist.twist.linear.y", math.nan, "twist is not finite"),
        ("twist.twist.angular.z", math.inf, "twist is not finite"),
        ("pose.covariance", covariance(p00=-1.0), "pose covariance is not positive definite"),
        ("pose.covariance", covariance(p00=0.0), "pose covariance is not positive definite"),
        ("pose.covariance", covariance(p01=0.5), "pose covariance is not positive definite"),
        ("pose.covariance", covariance(p01=2.0, p10=2.0), "pose covariance is not positive definite"),
        ("pose.covariance", covariance(p22=math.nan), "pose covariance is not positive definite"),
    ],
)
def test_odometry_that_cannot_be_true_is_rejected_by_name(path, value, reason):
    message = odometry()
    *parents, last = path.split(".")
    at = message
    for parent in parents:
        at = getattr(at, parent)
    setattr(at, last, value)
    with pytest.raises(Rejected, match=f"^{reason}$"):
        motion(message, "map", NOW_S)


def test_an_empty_covariance_and_an_empty_twist_state_nothing():
    message = odometry()
    message.twist.twist.linear.x = 0.0
    read, _ = motion(message, "map", NOW_S)
    assert read.sigma_m is None and read.ground_velocity is None
    message.twist.covariance = covariance()
    assert motion(message, "map", NOW_S)[0].ground_velocity is not None


def test_a_vehicle_that_pitches_moves_less_over_ground_and_keeps_its_heading():
    message, pitch = odometry(), 0.3
    # ROS pitch is positive nose down: a turn about the left axis, bow to the east.
    q = message.pose.pose.orientation
    q.y, q.w = math.sin(pitch / 2), math.cos(pitch / 2)
    read, _ = motion(message, "map", NOW_S)
    assert read.heading_rad == pytest.approx(math.pi / 2)
    assert read.ground_velocity == pytest.approx([0.0, math.cos(pitch)], abs=1e-12)
    assert (read.north_m, read.east_m, read.depth_m) == (4.0, 3.0, 5.0)


@pytest.mark.parametrize(
    ("age_s", "is_plausible"), [(0.0, True), (60.0, True), (61.0, False), (-0.5, True), (-1.0, False)]
)
def test_a_stamp_far_from_its_arrival_is_replaced_by_it(age_s, is_plausible):
    read, plausible = motion(odometry(), "map", NOW_S + age_s)
    assert plausible == is_plausible
    assert read.t_s == (NOW_S if is_plausible else NOW_S + age_s)


@pytest.mark.parametrize(
    ("reference", "heading", "yaw_rate"),
    [(0.2, 0.0, 0.1), (0.0, 0.2, -0.1), (3.1, -3.1, (6.2 - math.tau) / 2.0), (2.0, 0.0, 0.3), (-2.0, 0.0, -0.3)],
)
def test_a_twist_turns_the_shorter_way_to_the_reference_and_no_faster_than_the_limit(reference, heading, yaw_rate):
    message = twist_message(Reference(0.8, reference), heading, (2.0, 0.3), "base_link", NOW_S + 0.25)
    assert message.twist.linear.x == 0.8
    # Counter-clockwise is positive.
    assert message.twist.angular.z == pytest.approx(-yaw_rate, abs=1e-12)
    assert (message.header.stamp.sec, message.header.stamp.nanosec) == (1_800_000_000, 250_000_000)


@pytest.mark.parametrize(
    ("range_m", "most_m", "reason"),
    [
        (43.5, 500.0, None),
        (43.5, 0.0, None),
        (math.inf, 500.0, "range is not within 0.1 m and 20 km"),
        (math.nan, 500.0, "range is not within 0.1 m and 20 km"),
        (-1.0, 500.0, "range is not within 0.1 m and 20 km"),
        (1e9, 0.0, "range is not within 0.1 m and 20 km"),
        (501.0, 500.0, "range is not within its sensor's limits"),
    ],
)
def test_a_range_that_was_not_measured_is_rejected_by_name(range_m, most_m, reason):
    message = Range(range=range_m, min_range=0.0, max_range=most_m)
    message.header.stamp.sec = int(NOW_S)
    if reason is None:
        assert slant_range(message, NOW_S + 2.0) == (NOW_S, range_m, True)
        assert slant_range(message, NOW_S + 61.0) == (NOW_S + 61.0, range_m, False)
    else:
        with pytest.raises(Rejected, match=f"^{reason}$"):
            slant_range(message, NOW_S)


@pytest.mark.parametrize("turned", [0.0, 0.4, 2.0, -2.8])
def test_odometry_in_another_frame_is_turned_and_moved_to_the_map_by_its_transform(turned):
    message = odometry()
    message.header.frame_id = "odom"
    message.pose.covariance = covariance(p00=9.0)
    transform = TransformStamped()
    transform.header.frame_id, transform.child_frame_id = "map", "odom"
    shift, rotation = transform.transform.translation, transform.transform.rotation
    shift.x, shift.y, shift.z = 100.0, -50.0, 2.0
    # Both signs are the same rotation.
    rotation.z, rotation.w = -math.sin(turned / 2), -math.cos(turned / 2)
    moved, is_plausible = motion(in_map(message, transform), "map", NOW_S)
    c, s = math.cos(turned), math.sin(turned)
    assert is_plausible and moved.t_s == NOW_S
    assert moved.east_m == pytest.approx(100.0 + 3.0 * c - 4.0 * s, abs=1e-12)
    assert moved.north_m == pytest.approx(-50.0 + 3.0 * s + 4.0 * c, abs=1e-12)
    assert moved.depth_m == pytest.approx(3.0, abs=1e-12)
    assert math.remainder(moved.heading_rad - (math.pi / 2 - turned), math.tau) == pytest.approx(0.0, abs=1e-12)
    assert moved.ground_velocity == pytest.approx([s, c], abs=1e-12)
    # The ellipse turns with the frame: its axes stay.
    assert moved.sigma_m == pytest.approx(3.0, abs=1e-12)
