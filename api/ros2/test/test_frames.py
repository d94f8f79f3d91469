"""Transforms of TF that are used and rejected. TF is played: the wheels of ROS on PyPI have none."""

from types import SimpleNamespace

import pytest
from geometry_msgs.msg import TransformStamped
from nav_msgs.msg import Odometry
from pilotfish_ros2 import frames
from pilotfish_ros2.conversion import Rejected

NOW_S = 1_800_000_000


def in_map(monkeypatch, stamp_s):
    """Odometry of now that is in the frame `odom`, with the newest transform from it to the map."""
    transform = TransformStamped(child_frame_id="odom")
    transform.header.frame_id, transform.header.stamp.sec = "map", stamp_s
    transform.transform.translation.x = 7.0
    buffer = SimpleNamespace(lookup_transform=lambda *_: transform)
    tf = SimpleNamespace(Buffer=lambda: buffer, TransformListener=lambda *_: None, TransformException=LookupError)
    monkeypatch.setattr(frames, "tf2_ros", tf)
    return frames.Frames(None, "map").in_map(odometry())


def odometry():
    message = Odometry()
    message.header.frame_id, message.header.stamp.sec = "odom", NOW_S
    return message


@pytest.mark.parametrize("stamp_s", [0, NOW_S - 2, NOW_S, NOW_S + 5])
def test_a_transform_that_is_static_or_recent_is_used(monkeypatch, stamp_s):
    moved = in_map(monkeypatch, stamp_s)
    assert (moved.header.frame_id, moved.pose.pose.position.x) == ("map", 7.0)


def test_a_transform_that_froze_is_rejected_by_name(monkeypatch):
    with pytest.raises(Rejected, match=r"^the transform from odom to map is more than 2 s older than the odometry$"):
        in_map(monkeypatch, NOW_S - 3)


def test_another_frame_without_tf_says_that_it_is_not_installed(monkeypatch):
    monkeypatch.setattr(frames, "tf2_ros", None)
    with pytest.raises(Rejected, match=r"^frame_id is odom, not map, and tf2_ros is not installed$"):
        frames.Frames(None, "map").in_map(odometry())
