"""The node with a real service and rclpy: a boat that does what it is told, above two AUVs.

PILOTFISH names the program. Positions, headings and rates are compared with formulas in angles, where the node computes
with matrices. Nothing leaves the machine.
"""

import json
import math
import os
import subprocess
import sys
import time

# Read by the middleware when it starts. A domain that nothing else on the machine uses by habit.
os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"
os.environ["ROS_DOMAIN_ID"] = str(30 + os.getpid() % 60)

import pytest
import rclpy
import yaml
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import PoseWithCovarianceStamped, TwistStamped
from nav_msgs.msg import Odometry, Path
from pilotfish_ros2.pilotfish import Client
from rcl_interfaces.srv import SetParameters
from rclpy.parameter import Parameter
from rclpy.qos import QoSDurabilityPolicy, QoSProfile, QoSReliabilityPolicy
from rclpy.time import Time
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import Range
from std_msgs.msg import String
from std_srvs.srv import Trigger

PERIOD_S, PATIENCE_S = 0.1, 60.0
TIME_CONSTANT_S, RATE_MAX = 2.0, 0.25
# Doubles that are printed to the last digit; stamps of 1 ns at 1.8e9 s.
ROUNDING, STAMP_S = 1e-9, 1e-6
CURRENT = (0.0, 0.1)
# A simulator's clock begins anywhere, s.
SIMULATED_START_S = 100.0


class Vehicle:
    """Moves level in the map (east, north), with a yaw counter-clockwise from east."""

    def __init__(self, name, east, north, up, yaw, sigmas=(0.5, 0.5), turned=0.0):
        self.name, self.east, self.north, self.up, self.yaw = name, east, north, up, yaw
        self.speed, self.rate, self.sigmas, self.turned = 0.0, 0.0, sigmas, turned
        self.drift = (0.0, 0.0)
        # What was published, by the stamp.
        self.sent = {}

    def move(self, seconds):
        self.yaw += self.rate * seconds
        self.east += (self.speed * math.cos(self.yaw) + self.drift[0]) * seconds
        self.north += (self.speed * math.sin(self.yaw) + self.drift[1]) * seconds

    def odometry(self, stamp):
        # Over ground, along the body's axes.
        (east, north), c, s = self.drift, math.cos(self.yaw), math.sin(self.yaw)
        surge, to_port = self.speed + east * c + north * s, north * c - east * s
        message = Odometry()
        message.header.stamp = stamp.to_msg()
        message.header.frame_id, message.child_frame_id = "map", f"{self.name}/base_link"
        pose, twist = message.pose.pose, message.twist.twist
        pose.position.x, pose.position.y, pose.position.z = self.east, self.north, self.up
        pose.orientation.z, pose.orientation.w = math.sin(self.yaw / 2), math.cos(self.yaw / 2)
        twist.linear.x, twist.linear.y, twist.angular.z = surge, to_port, self.rate
        # An ellipse with its axes at `turned` from east.
        (a, b), c, s = [sigma**2 for sigma in self.sigmas], math.cos(self.turned), math.sin(self.turned)
        covariance = [0.0] * 36
        covariance[0], covariance[7] = a * c * c + b * s * s, a * s * s + b * c * c
        covariance[1] = covariance[6] = (a - b) * c * s
        covariance[14] = covariance[21] = covariance[28] = covariance[35] = 0.01
        message.pose.covariance = covariance
        heading = math.remainder(math.pi / 2 - self.yaw, math.tau)
        speed, course = math.hypot(surge, to_port), heading - math.atan2(to_port, surge)
        self.sent[message.header.stamp.sec + message.header.stamp.nanosec * 1e-9] = {
            "north_m": self.north,
            "east_m": self.east,
            "heading_rad": heading,
            "yaw_rate_radps": -self.rate,
            "ground_north_mps": speed * math.cos(course),
            "ground_east_mps": speed * math.sin(course),
            "depth_m": -self.up,
            "sigma_m": max(self.sigmas),
            "course_rad": course,
            "speed_mps": speed,
        }
        return message

    def sent_at(self, t_s):
        nearest = min(self.sent, key=lambda sent_s: abs(sent_s - t_s))
        assert abs(nearest - t_s) < STAMP_S, f"{self.name}: nothing was published at {t_s}"
        return self.sent[nearest]


class Sea:
    """Vehicles, service and node, and what the node publishes. On the system's clock, or on a simulator's at `rate`."""

    def __init__(self, folder, rate=None):
        self.rate, self.began_s = rate, time.monotonic()
        self.boat = Vehicle("medusa", 20.0, -10.0, 0.0, 0.5)
        self.boat.drift = (CURRENT[1], CURRENT[0])
        red = Vehicle("red", -5.0, 20.0, -12.5, math.pi / 2, (3.0, 1.0), 0.7)
        black = Vehicle("black", 5.0, 20.0, -3.25, math.pi / 2, (0.8, 2.5), -0.4)
        red.speed = black.speed = 0.2
        # Another vessel, far off and farther every second.
        ferry = Vehicle("ferry", 4000.0, 0.0, 0.0, 0.3, (20.0, 10.0))
        ferry.speed = 5.0
        self.vehicles = {vehicle.name: vehicle for vehicle in (self.boat, red, black, ferry)}
        self.is_heard = True
        self.twists, self.paths, self.told_s = [], [], -math.inf
        self.states, self.diagnostics = [], []

        self.ros = rclpy.create_node("sea")
        best_effort = QoSProfile(depth=10, reliability=QoSReliabilityPolicy.BEST_EFFORT)
        self.publishers = {
            "medusa": self.ros.create_publisher(Odometry, "/fleet/medusa/odom", 10),
            "red": self.ros.create_publisher(Odometry, "/fleet/red/odom", best_effort),
            "black": self.ros.create_publisher(Odometry, "/black/odometry/filtered", 10),
            "ferry": self.ros.create_publisher(Odometry, "/fleet/traffic", best_effort),
        }
        self.ranges = self.ros.create_publisher(Range, "/fleet/red/range", best_effort)
        self.poses = self.ros.create_publisher(PoseWithCovarianceStamped, "/fleet/red/pose", best_effort)
        self.subscribe()
        self.ros.create_subscription(DiagnosticArray, "/diagnostics", lambda it: self.diagnostics.extend(it.status), 10)
        latched = QoSProfile(depth=1, durability=QoSDurabilityPolicy.TRANSIENT_LOCAL)
        self.ros.create_subscription(String, "/fleet/pilotfish/state", lambda it: self.states.append(it.data), latched)
        self.goal = self.ros.create_publisher(String, "/fleet/pilotfish/goal", 10)
        self.clock = self.ros.create_publisher(Clock, "/clock", best_effort) if rate else None
        self.ros.create_timer(PERIOD_S, self.step)

        serve = [os.environ["PILOTFISH"], "serve", "--data", str(folder / "data"), "--port", "0", "--log", "warn"]
        self.service = subprocess.Popen(serve, stdout=subprocess.PIPE, text=True)
        url = "http://" + self.service.stdout.readline().split("http://")[1].strip()
        self.client = Client(url)
        parameters = folder / "parameters.yaml"
        values = {
            "craft": "medusa",
            "auvs": ["red", "black"],
            "goal": "midpoint",
            "url": url,
            "origin.lat_deg": 38.41,
            "origin.lon_deg": -9.12,
            "heading_loop.time_constant_s": TIME_CONSTANT_S,
        }
        parameters.write_text(yaml.dump({"/fleet/pilotfish": {"ros__parameters": values}}))
        command = [sys.executable, "-m", "pilotfish_ros2.node", "--ros-args", "-r", "__ns:=/fleet"]
        command += ["--params-file", str(parameters), "-p", f"heading_loop.rate_max_radps:={RATE_MAX}"]
        command += ["-r", "black/odom:=/black/odometry/filtered"]
        command += ["-p", "use_sim_time:=true"] if rate else []
        self.start_node = lambda: subprocess.Popen(command)
        self.node = self.start_node()

    def subscribe(self):
        self.subscriptions = [
            self.ros.create_subscription(TwistStamped, "/fleet/medusa/cmd_vel", self.steer, 10),
            self.ros.create_subscription(Path, "/fleet/medusa/plan", self.paths.append, 10),
        ]

    def unsubscribe(self):
        for subscription in self.subscriptions:
            self.ros.destroy_subscription(subscription)

    def steer(self, twist):
        self.twists.append(twist)
        self.told_s = time.monotonic()
        self.boat.speed, self.boat.rate = twist.twist.linear.x, twist.twist.angular.z

    def now(self):
        if not self.rate:
            return self.ros.get_clock().now()
        return Time(nanoseconds=round(1e9 * (SIMULATED_START_S + self.rate * (time.monotonic() - self.began_s))))

    def call(self, kind, name, request):
        """The answer of a service of the node."""
        client = self.ros.create_client(kind, f"/fleet/pilotfish/{name}")
        self.until(client.service_is_ready, f"{name} is not offered")
        future = client.call_async(request)
        self.until(future.done, f"{name} does not answer")
        return future.result()

    def step(self):
        if self.clock:
            self.clock.publish(Clock(clock=self.now().to_msg()))
        # The time-out that docs/ros2.md asks every craft to have.
        if time.monotonic() - self.told_s > 3.0:
            self.boat.speed = self.boat.rate = 0.0
        for name, vehicle in self.vehicles.items():
            vehicle.move(PERIOD_S)
            if self.is_heard or vehicle is not self.boat:
                self.publishers[name].publish(vehicle.odometry(self.now()))
        red = self.vehicles["red"]
        distance = math.dist((self.boat.east, self.boat.north, 0.0), (red.east, red.north, red.up))
        message = Range(range=distance, max_range=500.0)
        message.header.stamp = self.now().to_msg()
        self.ranges.publish(message)

    def until(self, condition, complaint, patience_s=PATIENCE_S):
        assert self.node.poll() in (None, -9), "the node ended"
        end_s = time.monotonic() + patience_s
        while not condition():
            assert time.monotonic() < end_s, complaint
            rclpy.spin_once(self.ros, timeout_sec=PERIOD_S)

    def published_within(self, seconds):
        """How many references come in this time."""
        before, end_s = len(self.twists), time.monotonic() + seconds
        self.until(lambda: time.monotonic() > end_s, "the clock stands")
        return len(self.twists) - before

    def distance(self):
        red, black = self.vehicles["red"], self.vehicles["black"]
        goal = (red.east + black.east) / 2, (red.north + black.north) / 2
        return math.dist((self.boat.east, self.boat.north), goal)

    def mission(self):
        [mission] = self.client.missions()
        return self.client.mission(mission["id"])

    def heard(self):
        """What the mission heard: all `reported` events."""
        lines = self.mission().record("events_ndjson").decode().splitlines()
        return [event["heard"] for event in map(json.loads, lines) if "heard" in event]

    def close(self):
        for process in (self.node, self.service):
            process.kill()
            process.wait()
        self.ros.destroy_node()


@pytest.fixture(scope="module")
def sea(tmp_path_factory):
    if "PILOTFISH" not in os.environ:
        pytest.skip("PILOTFISH names no program")
    rclpy.init()
    sea = Sea(tmp_path_factory.mktemp("sea"))
    yield sea
    sea.close()
    rclpy.shutdown()


def near(what, found, expected, tolerance=ROUNDING):
    assert abs(found - expected) <= tolerance, f"{what}: {found} is not {expected}"


def test_a_boat_that_follows_its_references_comes_to_the_goal(sea):
    sea.until(lambda: sea.distance() < 2.0, f"the boat is still {sea.distance():.1f} m from the goal", 90.0)
    assert sea.paths, "no plan was published"


def test_the_mission_hears_what_was_published_in_its_own_frame(sea):
    counts = dict.fromkeys([*sea.vehicles, "ranges"], 0)
    for heard in sea.heard():
        vessels = {vessel["id"]: [vessel] for vessel in heard.get("traffic", [])}
        for name, reports in (heard.get("auvs", {}) | vessels).items():
            for report in reports:
                if "range_m" in report:
                    assert name == "red" and 3.0 < report["range_m"] < 100.0, report
                    counts["ranges"] += 1
                    continue
                sent = sea.vehicles[name].sent_at(report["t_s"])
                for member in {"north_m", "east_m", "depth_m", "sigma_m", "speed_mps"} & report.keys():
                    near(f"{name} {member}", report[member], sent[member])
                near(f"{name} course", math.remainder(report["course_rad"] - sent["course_rad"], math.tau), 0.0)
                counts[name] += 1
        for report in heard.get("asc", []):
            sent, state = sea.boat.sent_at(report["t_s"]), report["state"]
            for member in ("north_m", "east_m", "yaw_rate_radps", "ground_north_mps", "ground_east_mps"):
                near(f"craft {member}", state[member], sent[member])
            near("heading", math.remainder(state["heading_rad"] - sent["heading_rad"], math.tau), 0.0)
            counts["medusa"] += 1
    assert min(counts.values()) > 30, counts
    # The boat drifts with the current, on headings that differ by then.
    newest = [report for heard in sea.heard() for report in heard.get("asc", [])][-1]["current"]
    near("current north", newest["north_mps"], CURRENT[0], 0.1)
    near("current east", newest["east_mps"], CURRENT[1], 0.1)


def test_twists_are_in_the_frame_of_the_craft_and_within_its_turn_rate(sea):
    for twist in sea.twists:
        assert twist.header.frame_id == "base_link"
        assert twist.twist.linear.x >= 0.0 and abs(twist.twist.angular.z) <= RATE_MAX


def test_a_path_is_the_planned_trajectory_in_the_map_and_late_subscribers_get_it(sea):
    late = []
    latched = QoSProfile(depth=1, durability=QoSDurabilityPolicy.TRANSIENT_LOCAL)
    subscription = sea.ros.create_subscription(Path, "/fleet/medusa/plan", late.append, latched)
    sea.until(lambda: late, "no plan for subscribers that join later", 5.0)
    # Stamps do not tell plans apart: they are late by the way of the answer to the node, which passes some plans over.
    references, pair = [], []

    def is_found():
        references.append(sea.mission().reference())
        for path in reversed(late):
            start = path.poses[0].pose.position
            for reference in references:
                stage = reference["plan"]["trajectory"][0]
                if math.dist((start.y, start.x), (stage["north_m"], stage["east_m"])) < ROUNDING:
                    pair[:] = path, reference["plan"]["trajectory"]
                    return True
        return False

    sea.until(is_found, "no path starts where a plan starts", 10.0)
    sea.ros.destroy_subscription(subscription)
    for path in late:
        assert path.header.frame_id == "map"
    path, trajectory = pair
    assert len(path.poses) == len(trajectory)
    for pose, stage in zip(path.poses, trajectory, strict=True):
        near("north", pose.pose.position.y, stage["north_m"])
        near("east", pose.pose.position.x, stage["east_m"])
        yaw = 2 * math.atan2(pose.pose.orientation.z, pose.pose.orientation.w)
        near("yaw", math.remainder(math.pi / 2 - stage["heading_rad"] - yaw, math.tau), 0.0)


def test_a_pose_of_an_auv_is_a_fix_without_a_velocity(sea):
    odometry = sea.vehicles["red"].odometry(sea.now())
    sea.poses.publish(PoseWithCovarianceStamped(header=odometry.header, pose=odometry.pose))

    def fixes():
        reports = [report for heard in sea.heard() for report in heard.get("auvs", {}).get("red", [])]
        return [report for report in reports if "north_m" in report and "speed_mps" not in report]

    sea.until(fixes, "the mission heard no fix without a velocity", 10.0)
    [fix] = fixes()
    sent = sea.vehicles["red"].sent_at(fix["t_s"])
    for member in ("north_m", "east_m", "depth_m", "sigma_m"):
        near(member, fix[member], sent[member])


def test_references_and_paths_that_nothing_subscribes_to_are_said(sea):
    sea.unsubscribe()
    fault = "nothing subscribes to /fleet/medusa/cmd_vel (geometry_msgs/TwistStamped)"
    sea.until(lambda: sea.states[-1].startswith(f"degraded: {fault}"), f"it is {sea.states[-1]}", 10.0)
    sea.subscribe()
    sea.until(lambda: fault not in sea.states[-1], f"it is still {sea.states[-1]}", 10.0)
    sea.until(lambda: sea.published_within(0.5) > 0, "no references", 10.0)


def test_names_cannot_be_set_while_the_node_runs_and_a_dry_run_can(sea):
    def put(name, value):
        request = SetParameters.Request(parameters=[Parameter(name, value=value).to_parameter_msg()])
        [result] = sea.call(SetParameters, "set_parameters", request).results
        return result

    refused = put("craft", "otter")
    assert not refused.successful and "read-only" in refused.reason
    assert not put("heading_loop.rate_max_radps", 30.0).successful, "out of range"
    assert put("dry_run", True).successful
    sea.published_within(0.5)  # What was on its way.
    assert sea.published_within(2.0) == 0, "references in a dry run"
    assert put("dry_run", False).successful
    sea.until(lambda: sea.published_within(0.5) > 0, "no references after the dry run", 10.0)


def test_the_state_is_shown_to_late_subscribers_and_in_the_diagnostics(sea):
    sea.until(lambda: sea.states and sea.states[-1] == "steering", f"the state is {sea.states[-1:]}", 20.0)
    sea.diagnostics.clear()
    sea.until(lambda: sea.diagnostics, "no diagnostics", 5.0)
    status = sea.diagnostics[-1]
    assert (status.level, status.hardware_id) == (DiagnosticStatus.OK, "medusa")
    assert {"mission": "running"}.items() <= {row.key: row.value for row in status.values}.items()


def test_another_goal_and_a_pause_reach_the_mission(sea):
    goal = {"kind": "visit", "auvs": ["red", "black"], "within_m": 15.0}
    sea.goal.publish(String(data=json.dumps(goal)))
    look = lambda: sea.mission().look()  # noqa: E731
    sea.until(lambda: look()["setting"]["goal"]["kind"] == "visit", "the goal is the old one", 10.0)
    # What is no goal changes nothing, and does not end the node.
    for wrong in ("no JSON", '{"kind": "visit"}'):
        sea.goal.publish(String(data=wrong))
    sea.goal.publish(String(data='{"kind": "midpoint", "auvs": ["red", "black"]}'))
    sea.until(lambda: look()["setting"]["goal"]["kind"] == "midpoint", "the goal is still to visit", 10.0)
    assert sea.call(Trigger, "pause", Trigger.Request()).success
    sea.until(lambda: look()["status"] == "paused", "the mission is not paused", 10.0)
    sea.until(lambda: sea.states[-1].startswith("waiting: the mission is paused"), f"it is {sea.states[-1]}", 10.0)
    assert sea.call(Trigger, "run", Trigger.Request()).success
    sea.until(lambda: sea.published_within(0.5) > 0, "no references after the mission runs again", 10.0)


def test_references_end_with_the_odometry_of_the_craft_and_go_on_with_it(sea):
    assert sea.published_within(1.5) > 0
    sea.is_heard = False
    sea.published_within(1.5)
    assert sea.published_within(3.0) == 0, "references without a recent heading"
    sea.is_heard = True
    sea.until(lambda: sea.published_within(0.5) > 0, "no references after the odometry is back", 10.0)


def test_references_end_while_the_mission_is_paused(sea):
    sea.mission().pause()
    sea.until(lambda: sea.published_within(1.0) == 0, "references of a paused mission", 10.0)
    assert sea.published_within(2.0) == 0
    sea.mission().run()
    sea.until(lambda: sea.published_within(0.5) > 0, "no references after the mission runs again", 10.0)


def test_a_second_node_of_the_same_name_continues_the_mission(sea):
    sea.node.kill()
    sea.node.wait()
    sea.published_within(0.5)  # What was on its way.
    assert sea.published_within(2.0) == 0
    sea.node = sea.start_node()
    sea.until(lambda: sea.published_within(0.5) > 0, "no references of the second node", 20.0)
    assert len(list(sea.client.missions())) == 1


def test_references_end_when_the_newest_plan_is_too_old(sea):
    notes = [note["text"] for heard in sea.heard() for note in heard.get("notes", [])]
    assert "references are sent" in notes
    assert "no references are sent: the heading of the craft is too old" in notes
    sea.service.kill()
    # A plan may be followed for ten seconds.
    assert sea.published_within(3.0) > 0, "a plan that is valid is followed"
    sea.published_within(9.0)
    assert sea.published_within(2.0) == 0, "references after the plan's validity"
