"""The node with the package's parameters and no service: what it says, and its topics."""

import os
import subprocess
import sys
import time
from pathlib import Path

os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"
os.environ["ROS_DOMAIN_ID"] = str(30 + os.getpid() % 60)

import pytest
import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from nav_msgs.msg import Odometry
from rclpy.qos import QoSDurabilityPolicy, QoSProfile
from std_msgs.msg import String

PARAMETERS = Path(__file__).parents[1] / "config" / "pilotfish.yaml"
PATIENCE_S = 20.0


class Alone:
    """A node whose service is away, and what it says."""

    def __init__(self):
        self.ros = rclpy.create_node("bench")
        self.states, self.rows = [], {}
        latched = QoSProfile(depth=1, durability=QoSDurabilityPolicy.TRANSIENT_LOCAL)
        self.ros.create_subscription(String, "/alone/pilotfish/state", lambda it: self.states.append(it.data), latched)
        self.ros.create_subscription(DiagnosticArray, "/diagnostics", self.diagnose, 10)
        self.odometry = self.ros.create_publisher(Odometry, "/alone/medusa/odom", 10)
        command = [sys.executable, "-m", "pilotfish_ros2.node", "--ros-args", "-r", "__ns:=/alone"]
        command += ["--params-file", str(PARAMETERS), "-p", "url:=http://127.0.0.1:9"]
        self.node = subprocess.Popen([*command, "-p", "enable_stamped_cmd_vel:=false"])

    def diagnose(self, array):
        self.rows = {row.key: row.value for status in array.status for row in status.values}

    def publish(self, frame):
        message = Odometry(child_frame_id="base_link")
        message.header.frame_id, message.header.stamp = frame, self.ros.get_clock().now().to_msg()
        self.odometry.publish(message)

    def until(self, condition, complaint):
        end_s = time.monotonic() + PATIENCE_S
        while not condition():
            assert time.monotonic() < end_s and self.node.poll() is None, complaint
            self.publish("odom")
            rclpy.spin_once(self.ros, timeout_sec=0.1)

    def close(self):
        self.node.kill()
        self.node.wait()
        self.ros.destroy_node()


@pytest.fixture(scope="module")
def alone():
    rclpy.init()
    alone = Alone()
    yield alone
    alone.close()
    rclpy.shutdown()


def test_the_topic_that_nothing_usable_came_on_is_named(alone):
    expected = "waiting: no recent odometry of the craft: nothing usable on /alone/medusa/odom"
    alone.until(lambda: expected in alone.states, f"not said: {alone.states}")


def test_a_hyphen_in_a_name_is_an_underscore_in_topics(alone):
    subscribed = lambda: alone.ros.get_subscriptions_info_by_topic("/alone/auv_1/odom")  # noqa: E731
    alone.until(subscribed, "no subscription for auv-1")


def test_a_frame_that_nothing_connects_with_the_map_is_named(alone):
    said = lambda: [row for row in alone.rows if row.startswith("rejected: frame_id is odom, not map")]  # noqa: E731
    alone.until(said, f"not said: {alone.rows}")


def test_references_without_stamps_are_twists(alone):
    published = lambda: alone.ros.get_publishers_info_by_topic("/alone/medusa/cmd_vel")  # noqa: E731
    alone.until(published, "no publisher")
    assert [end.topic_type for end in published()] == ["geometry_msgs/msg/Twist"]


def test_odometry_in_a_frame_that_tf_connects_with_the_map_is_used(alone):
    tf2_ros = pytest.importorskip("tf2_ros", reason="no tf2_ros here: PyPI has none")
    from geometry_msgs.msg import TransformStamped

    transform = TransformStamped(child_frame_id="odom")
    transform.header.frame_id = "map"
    broadcaster = tf2_ros.StaticTransformBroadcaster(alone.ros)
    broadcaster.sendTransform(transform)
    # The craft is heard: now the service is what is missing.
    expected = "waiting: the mission is not found yet: the service at http://127.0.0.1:9 does not answer"
    alone.until(lambda: alone.states[-1] == expected, f"not used: {alone.states[-1]}")
