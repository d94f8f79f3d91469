"""Odometry in other frames than the map, by the transforms of TF."""

from __future__ import annotations

import rclpy.time
from builtin_interfaces.msg import Time
from nav_msgs.msg import Odometry
from rclpy.node import Node

try:
    import tf2_ros
except ImportError:  # The wheels of ROS on PyPI have no TF.
    tf2_ros = None

from .conversion import Rejected, in_map

# A transform may be so much older than the odometry, s; one without a stamp is static.
TRANSFORM_AGE_MAX_S = 2.0


class Frames:
    """Listens to TF from the first odometry that is in another frame."""

    def __init__(self, node: Node, map_frame: str) -> None:
        self._node, self._map_frame = node, map_frame
        self._buffer: tf2_ros.Buffer | None = None
        self._listener: tf2_ros.TransformListener | None = None

    def in_map(self, odometry: Odometry) -> Odometry:
        """The odometry with its pose in the map."""
        frame = odometry.header.frame_id.lstrip("/")
        if frame in ("", self._map_frame):
            return odometry
        if tf2_ros is None:
            raise Rejected(f"frame_id is {frame}, not {self._map_frame}, and tf2_ros is not installed")
        if self._buffer is None:
            self._buffer = tf2_ros.Buffer()
            self._listener = tf2_ros.TransformListener(self._buffer, self._node)
        try:
            # The newest one: the transform of a localisation that corrects drift is often older than the odometry.
            transform = self._buffer.lookup_transform(self._map_frame, frame, rclpy.time.Time())
        except tf2_ros.TransformException as error:
            raise Rejected(f"frame_id is {frame}, not {self._map_frame}, and TF does not connect them") from error
        stamp_s, odometry_s = _seconds(transform.header.stamp), _seconds(odometry.header.stamp)
        if stamp_s != 0.0 and odometry_s - stamp_s > TRANSFORM_AGE_MAX_S:
            raise Rejected(f"the transform from {frame} to {self._map_frame} is more than 2 s older than the odometry")
        return in_map(odometry, transform)


def _seconds(stamp: Time) -> float:
    return stamp.sec + 1e-9 * stamp.nanosec
