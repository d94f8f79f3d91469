"""Odometry in other frames than the map, by the transforms of TF."""

from __future__ import annotations

import rclpy.time
from nav_msgs.msg import Odometry
from rclpy.node import Node

try:
    import tf2_ros
except ImportError:  # The wheels of ROS on PyPI have no TF.
    tf2_ros = None

from .conversion import Rejected, in_map


class Frames:
    """Listens to TF from the first message that is in another frame."""

    def __init__(self, node: Node, map_frame: str) -> None:
        self._node, self._map_frame = node, map_frame
        self._buffer = self._listener = None

    def in_map(self, odometry: Odometry) -> Odometry:
        """The odometry with its pose in the map."""
        frame = odometry.header.frame_id.lstrip("/")
        if frame in ("", self._map_frame) or tf2_ros is None:
            return odometry
        if self._buffer is None:
            self._buffer = tf2_ros.Buffer()
            self._listener = tf2_ros.TransformListener(self._buffer, self._node)
        try:
            # The newest one: the transform of a localisation that corrects drift is often older than the odometry.
            transform = self._buffer.lookup_transform(self._map_frame, frame, rclpy.time.Time())
        except tf2_ros.TransformException as error:
            raise Rejected(f"frame_id is {frame}, not {self._map_frame}, and TF does not connect them") from error
        return in_map(odometry, transform)
