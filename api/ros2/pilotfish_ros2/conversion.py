"""Messages of ROS (east-north-up, forward-left-up) from and to north-east-down: frames, signs, ranges.

Source: REP 103 (units and axes), REP 105 (frames), `nav_msgs/Odometry`.
"""

from __future__ import annotations

import math

import numpy as np
from builtin_interfaces.msg import Time
from geometry_msgs.msg import PoseStamped, Quaternion, TransformStamped, TwistStamped
from nav_msgs.msg import Odometry, Path
from sensor_msgs.msg import Range
from std_msgs.msg import Header

from .following import Motion, Plan, Reference, wrap

# How far the square of a quaternion's length may be from one: `QUATERNION_NORMALIZATION_TOLERANCE` of tf2.
QUATERNION_TOLERANCE = 0.01
# Covariances are often kept in single precision and rotated a few times: relative error of a correlation.
CORRELATION_TOLERANCE = 1e-6
# North at the map's origin differs from true north by 0.9° at 100 km and 45° of latitude.
MAP_RADIUS_MAX_M = 100e3
# A stamp may be this much older than its arrival (an acoustic link and a filter), or ahead of it (NTP), s.
AGE_MAX_S, AHEAD_MAX_S = 60.0, 0.5


# Ranges that the service accepts, m.
RANGE_MIN_M, RANGE_MAX_M = 0.1, 20e3


class Rejected(ValueError):
    """A message that cannot be used, and why."""


def motion(odometry: Odometry, map_frame: str, received_s: float) -> tuple[Motion, bool]:
    """The motion in a message that arrived at `received_s`, and whether its stamp was plausible. Otherwise the arrival
    is the time of the motion."""
    if odometry.header.frame_id.lstrip("/") != map_frame:
        raise Rejected(f"frame_id is {odometry.header.frame_id or 'empty'}, not {map_frame}")
    # MAVROS names PX4's own axes so.
    if odometry.child_frame_id.endswith("_frd"):
        raise Rejected("child_frame_id is not forward-left-up")
    pose, twist = odometry.pose.pose, odometry.twist.twist
    position = np.array([pose.position.x, pose.position.y, pose.position.z])
    if not math.hypot(position[0], position[1]) <= MAP_RADIUS_MAX_M or not math.isfinite(position[2]):
        raise Rejected("position is not within 100 km of the origin")
    rotation = _rotation(pose.orientation)
    linear = np.array([twist.linear.x, twist.linear.y, twist.linear.z])
    angular = np.array([twist.angular.x, twist.angular.y, twist.angular.z])
    if not np.isfinite([linear, angular]).all():
        raise Rejected("twist is not finite")
    # Many publishers leave the twist empty: zeros with a covariance of zeros are no measurement.
    has_twist = bool(np.any(odometry.twist.covariance) or np.any(linear) or np.any(angular))
    east, north, _ = rotation @ linear
    t_s, is_plausible = _measured(odometry.header, received_s)
    return (
        Motion(
            t_s=t_s,
            north_m=float(position[1]),
            east_m=float(position[0]),
            depth_m=max(float(-position[2]), 0.0),
            # Where the forward axis points, seen from above.
            heading_rad=math.atan2(rotation[0, 0], rotation[1, 0]),
            ground_velocity=np.array([north, east]) if has_twist else None,
            yaw_rate_radps=float(-angular[2]),
            sigma_m=_sigma(np.array(odometry.pose.covariance).reshape(6, 6)),
        ),
        is_plausible,
    )


def in_map(odometry: Odometry, transform: TransformStamped) -> Odometry:
    """The odometry with its pose in the frame that `transform` leads to. The twist is the body's, and stays."""
    to_map, pose = transform.transform, odometry.pose.pose
    rotation = _rotation(to_map.rotation)
    moved = Odometry(child_frame_id=odometry.child_frame_id, twist=odometry.twist)
    moved.header.stamp, moved.header.frame_id = odometry.header.stamp, transform.header.frame_id
    origin, at = to_map.translation, moved.pose.pose.position
    position = rotation @ [pose.position.x, pose.position.y, pose.position.z]
    at.x, at.y, at.z = (position + np.array([origin.x, origin.y, origin.z])).tolist()
    moved.pose.pose.orientation = _product(to_map.rotation, pose.orientation)
    both = np.kron(np.eye(2), rotation)
    moved.pose.covariance = (both @ np.array(odometry.pose.covariance).reshape(6, 6) @ both.T).ravel()
    return moved


def slant_range(message: Range, received_s: float) -> tuple[float, float, bool]:
    """Time and slant range, m, of a message that arrived at `received_s`, and whether its stamp was plausible.

    A range beyond the limits of its sensor is no measurement (REP 117: infinite if nothing was heard).
    """
    if not RANGE_MIN_M <= message.range <= RANGE_MAX_M:
        raise Rejected("range is not within 0.1 m and 20 km")
    if message.max_range > 0.0 and not message.min_range <= message.range <= message.max_range:
        raise Rejected("range is not within its sensor's limits")
    t_s, is_plausible = _measured(message.header, received_s)
    return t_s, float(message.range), is_plausible


def twist_message(
    reference: Reference, heading_rad: float, loop: tuple[float, float], base_frame: str, unix_s: float
) -> TwistStamped:
    """The twist that follows `reference`: `r = (psi_ref - psi) / T`, at most `r_max`, with `loop` = (T, r_max).

    A twist has no heading: this closes the heading loop around the craft's yaw-rate loop.
    """
    time_constant_s, rate_max = loop
    rate = wrap(reference.heading_rad - heading_rad) / time_constant_s
    message = TwistStamped()
    message.header.stamp, message.header.frame_id = stamp(unix_s), base_frame
    message.twist.linear.x = reference.speed_mps
    message.twist.angular.z = -min(max(rate, -rate_max), rate_max)
    return message


def path_message(plan: Plan, map_frame: str, unix_offset_s: float) -> Path:
    """The planned trajectory: the stamp of a pose is its stage's time, the orientation the planned heading, level.

    `unix_offset_s` leads from the plan's clock to Unix time.
    """
    path = Path()
    path.header.stamp, path.header.frame_id = stamp(plan.planned_s + unix_offset_s), map_frame
    for t_s, north, east, _, heading in plan.stages:
        pose = PoseStamped()
        pose.header.stamp, pose.header.frame_id = stamp(t_s + unix_offset_s), map_frame
        pose.pose.position.x, pose.pose.position.y = float(east), float(north)
        yaw = math.pi / 2 - heading
        pose.pose.orientation.z, pose.pose.orientation.w = math.sin(yaw / 2), math.cos(yaw / 2)
        path.poses.append(pose)
    return path


def stamp(unix_s: float) -> Time:
    """A time as messages have it."""
    whole = math.floor(unix_s)
    return Time(sec=whole, nanosec=int((unix_s - whole) * 1e9))


def _measured(header: Header, received_s: float) -> tuple[float, bool]:
    """The time of a measurement, and whether its stamp was plausible: otherwise that of its arrival."""
    stamp_s = header.stamp.sec + header.stamp.nanosec * 1e-9
    is_plausible = received_s - AGE_MAX_S <= stamp_s <= received_s + AHEAD_MAX_S
    return (stamp_s if is_plausible else received_s), is_plausible


def _rotation(q) -> np.ndarray:
    """ENU from FLU."""
    norm2 = q.x**2 + q.y**2 + q.z**2 + q.w**2
    if not abs(norm2 - 1.0) <= QUATERNION_TOLERANCE:
        raise Rejected("orientation is not a unit quaternion")
    v = np.array([q.x, q.y, q.z])
    cross = np.array([[0.0, -q.z, q.y], [q.z, 0.0, -q.x], [-q.y, q.x, 0.0]])
    return ((q.w**2 - v @ v) * np.eye(3) + 2.0 * np.outer(v, v) + 2.0 * q.w * cross) / norm2


def _product(a: Quaternion, b: Quaternion) -> Quaternion:
    """The rotation `b`, then `a`."""
    return Quaternion(
        w=a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z,
        x=a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y,
        y=a.w * b.y - a.x * b.z + a.y * b.w + a.z * b.x,
        z=a.w * b.z + a.x * b.y - a.y * b.x + a.z * b.w,
    )


def _sigma(p: np.ndarray) -> float | None:
    """The root of the larger eigenvalue of the covariance of x and y; None for a covariance of zeros."""
    if not np.any(p):
        return None
    deviations = np.sqrt(np.diag(p), where=np.diag(p) > 0.0, out=np.zeros(6))
    scale = np.where(deviations > 0.0, deviations, 1.0)
    # Of the correlations, not of P: a variance of 1e9 for an unknown axis would hide an error in the others.
    correlations = p / np.outer(scale, scale)
    is_valid = (
        np.isfinite(p).all()
        and (np.diag(p) >= 0.0).all()
        and (deviations[:2] > 0.0).all()
        and np.allclose(correlations, correlations.T, rtol=0.0, atol=CORRELATION_TOLERANCE)
        and np.linalg.eigvalsh(correlations)[0] >= -CORRELATION_TOLERANCE
    )
    if not is_valid:
        raise Rejected("pose covariance is not positive definite")
    return math.sqrt(np.linalg.eigvalsh(p[:2, :2])[-1])
