"""The ROS 2 adapter against the real `rclpy`: `ros2_peer.py PROGRAM`, where PROGRAM is the bridge's example `ros2_echo`.

A node publishes `nav_msgs/Odometry` of a craft and two AUVs on known orbits; the program prints what it took from them, and
sends `geometry_msgs/TwistStamped` and `nav_msgs/Path`. Numbers are compared with formulas written here, in angles instead of
the adapter's matrices. Nothing leaves the machine; everything is over after `DEADLINE_S`.
"""

import json
import math
import os
import subprocess
import sys
import tempfile
import threading
import time

# Read by the middleware when it starts. A domain that nothing else on the machine uses by habit.
os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"
os.environ["ROS_DOMAIN_ID"] = str(30 + os.getpid() % 60)

import rclpy
import yaml
from geometry_msgs.msg import TwistStamped
from nav_msgs.msg import Odometry, Path
from rcl_interfaces.srv import GetParameters, SetParameters
from rclpy.parameter import Parameter
from rclpy.qos import QoSDurabilityPolicy, QoSProfile, QoSReliabilityPolicy

DEADLINE_S = 60.0
PERIOD_S = 0.1
# Exchanged after the nodes have found each other.
ROUNDS = 50
LATITUDE_DEG, LONGITUDE_DEG = 38.41, -9.12
SPEED_MPS, HEADING_DEG = 0.8, 100.0
TIME_CONSTANT_S, RATE_MAX = 2.0, 0.25
# Doubles on the wire, printed to the last digit: what is left are roundings, and stamps of 1 ns at 1.8e9 s.
ROUNDING = 1e-9
STAMP_S = 1e-6
# Of positions that go to degrees and back, m: what `local` is good to.
POSITION_M = 1e-5
# Of the path: 12 m straight ahead, by the meridian where the craft is instead of the origin's, 3e-6 rad from it.
PATH_M = 1e-4
A, F = 6378137.0, 1 / 298.257223563


class Vehicle:
    """Circles about a point of the map, nose along its track, with a sideways velocity and a depth."""

    def __init__(self, name, east, north, up, radius, rate, sigmas, turned):
        self.name, self.centre, self.up, self.sent = name, (east, north), up, {}
        self.radius, self.rate, self.sigmas, self.turned = radius, rate, sigmas, turned

    def odometry(self, stamp):
        t = stamp.nanoseconds * 1e-9
        angle = self.rate * (t % 10_000.0)
        yaw = angle + math.copysign(math.pi / 2, self.rate)
        east = self.centre[0] + self.radius * math.cos(angle)
        north = self.centre[1] + self.radius * math.sin(angle)
        surge, to_port = self.radius * abs(self.rate), 0.05
        message = Odometry()
        message.header.stamp = stamp.to_msg()
        message.header.frame_id, message.child_frame_id = "map", f"{self.name}/base_link"
        pose, twist = message.pose.pose, message.twist.twist
        pose.position.x, pose.position.y, pose.position.z = east, north, self.up
        pose.orientation.z, pose.orientation.w = math.sin(yaw / 2), math.cos(yaw / 2)
        twist.linear.x, twist.linear.y, twist.angular.z = surge, to_port, self.rate
        # An ellipse with its axes at `turned` from east: its larger axis is the sigma.
        (a, b), c, s = [sigma**2 for sigma in self.sigmas], math.cos(self.turned), math.sin(self.turned)
        covariance = [0.0] * 36
        covariance[0], covariance[7] = a * c * c + b * s * s, a * s * s + b * c * c
        covariance[1] = covariance[6] = (a - b) * c * s
        covariance[14] = covariance[21] = covariance[28] = covariance[35] = 0.01
        message.pose.covariance = covariance
        heading = math.remainder(math.pi / 2 - yaw, 2 * math.pi)
        speed, drift = math.hypot(surge, to_port), math.atan2(to_port, surge)
        self.sent[message.header.stamp.sec + message.header.stamp.nanosec * 1e-9] = {
            "local": (north, east),
            "depth_m": -self.up,
            "heading": heading,
            "yaw_rate": -self.rate,
            "ground_velocity": (speed * math.cos(heading - drift), speed * math.sin(heading - drift)),
            "sigma_m": max(self.sigmas),
        }
        return message

    def sent_at(self, t_s):
        nearest = min(self.sent, key=lambda sent_s: abs(sent_s - t_s))
        assert abs(nearest - t_s) < STAMP_S, f"{self.name}: nothing was sent at {t_s}"
        return self.sent[nearest]


def local(lat_deg, lon_deg):
    """(north, east), m: Gauss's mid-latitude formulas, good to a micrometre over 100 m."""
    middle = math.radians((lat_deg + LATITUDE_DEG) / 2)
    lon = math.radians(lon_deg - LONGITUDE_DEG)
    e2 = F * (2 - F)
    w2 = 1 - e2 * math.sin(middle) ** 2
    north = math.radians(lat_deg - LATITUDE_DEG) * A * (1 - e2) / w2**1.5
    east = lon * A / math.sqrt(w2) * math.cos(middle)
    # Half of the convergence of the meridians lies between the middle and the origin.
    turn = lon * math.sin(middle) / 2
    return north * math.cos(turn) + east * math.sin(turn), east * math.cos(turn) - north * math.sin(turn)


def near(what, is_, expected, tolerance):
    is_, expected = (list(x) if isinstance(x, (list, tuple)) else [x] for x in (is_, expected))
    error = max(abs(i - e) for i, e in zip(is_, expected, strict=True))
    assert error <= tolerance, f"{what}: {is_} is not {expected}"
    return error


class Program:
    """The example program, started with the arguments that a launch file makes."""

    def __init__(self, path, directory):
        parameters = os.path.join(directory, "launch_params.yaml")
        values = {
            "craft": "medusa",
            "auvs": ["red", "black"],
            "origin.lat_deg": LATITUDE_DEG,
            "origin.lon_deg": LONGITUDE_DEG,
            "heading_loop.time_constant_s": TIME_CONSTANT_S,
        }
        with open(parameters, "w") as file:
            yaml.dump({"/fleet/bridge": {"ros__parameters": values}}, file, default_flow_style=False)
        command = [path, str(SPEED_MPS), str(HEADING_DEG), "--ros-args"]
        command += ["-r", "__node:=bridge", "-r", "__ns:=/fleet", "--params-file", parameters]
        command += ["-p", f"heading_loop.rate_max_radps:={RATE_MAX}", "-r", "black/odom:=/black/odometry/filtered"]
        self.process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        self.lines = []
        self.reader = threading.Thread(target=self._read, daemon=True)
        self.reader.start()

    def _read(self):
        for line in self.process.stdout:
            self.lines.append(json.loads(line))

    def end(self):
        self.process.stdin.close()
        code = self.process.wait(timeout=10)
        self.reader.join(timeout=10)
        assert code == 0, f"the program ended with {code}"
        return self.lines


def parameter_services(node, until):
    """The launch file's parameters can be read and not set."""
    get = node.create_client(GetParameters, "/fleet/bridge/get_parameters")
    set_ = node.create_client(SetParameters, "/fleet/bridge/set_parameters")

    def call(client, request):
        until(client.service_is_ready, "the parameter services are not offered")
        future = client.call_async(request)
        until(future.done, "the parameter services do not answer")
        return future.result()

    names = ["craft", "auvs", "origin.lat_deg"]
    craft, auvs, latitude = call(get, GetParameters.Request(names=names)).values
    assert craft.string_value == "medusa" and list(auvs.string_array_value) == ["red", "black"]
    near("origin.lat_deg", latitude.double_value, LATITUDE_DEG, 0.0)
    other = Parameter("craft", value="otter").to_parameter_msg()
    [answer] = call(set_, SetParameters.Request(parameters=[other])).results
    assert not answer.successful and "start" in answer.reason, answer


def check_measurements(lines, vehicles):
    """Compares each line with the message of the same stamp; returns counts and the largest errors."""
    counts, errors = {}, {}

    def compare(name, quantity, is_, expected, tolerance):
        error = near(f"{name} {quantity}", is_, expected, tolerance)
        counts[name, quantity] = counts.get((name, quantity), 0) + 1
        errors[quantity] = max(errors.get(quantity, 0.0), error)

    for line in lines:
        name = line.get("auv", "medusa")
        sent = vehicles[name].sent_at(line["t_s"])
        if "craft" in line:
            quantity, value = line["craft"], line["value"]
            if quantity == "position":
                compare(name, quantity, local(*value), sent["local"], POSITION_M)
            else:
                compare(name, quantity, value, sent[quantity], ROUNDING)
        else:
            compare(name, "position", local(*line["position"]), sent["local"], POSITION_M)
            for quantity in ("sigma_m", "depth_m", "ground_velocity"):
                compare(name, quantity, line[quantity], sent[quantity], ROUNDING)
    return counts, errors


def check_twists(twists, craft):
    """The speed ahead, and the turn rate of the declared loop from a heading that the craft had when it was sent."""
    for twist in twists:
        assert twist.header.frame_id == "base_link"
        near("speed", twist.twist.linear.x, SPEED_MPS, 0.0)
        sent_s = twist.header.stamp.sec + twist.header.stamp.nanosec * 1e-9
        # The program had this message or, at the edge of a poll, one of its neighbours.
        headings = [sent["heading"] for t_s, sent in craft.sent.items() if abs(t_s - sent_s) < 5 * PERIOD_S]
        rates = [math.remainder(math.radians(HEADING_DEG) - h, 2 * math.pi) / TIME_CONSTANT_S for h in headings]
        expected = [-max(-RATE_MAX, min(RATE_MAX, rate)) for rate in rates]
        assert any(abs(twist.twist.angular.z - e) < ROUNDING for e in expected), (twist, expected)


def check_path(path, craft):
    """Three poses 5 s apart on the heading, from where the craft was."""
    assert path.header.frame_id == "map" and len(path.poses) == 3
    planned_s = path.header.stamp.sec + path.header.stamp.nanosec * 1e-9
    heading, starts = math.radians(HEADING_DEG), []
    for stage, pose in enumerate(path.poses, start=1):
        t_s = pose.header.stamp.sec + pose.header.stamp.nanosec * 1e-9
        near("stage's time", t_s, planned_s + 5.0 * stage, STAMP_S)
        q = pose.pose.orientation
        near("stage's yaw", 2 * math.atan2(q.z, q.w), math.pi / 2 - heading, ROUNDING)
        gone = SPEED_MPS * 5.0 * stage
        p = pose.pose.position
        starts.append((p.y - gone * math.cos(heading), p.x - gone * math.sin(heading)))
    recent = [sent["local"] for t_s, sent in craft.sent.items() if abs(t_s - planned_s) < 5 * PERIOD_S]
    for start in starts:
        assert min(math.dist(start, place) for place in recent) < PATH_M, (starts, recent)


def main(program_path):
    started_s = time.monotonic()
    craft = Vehicle("medusa", 20.0, -10.0, 0.0, 15.0, 0.06, (0.5, 0.5), 0.0)
    red = Vehicle("red", -30.0, 40.0, -12.5, 10.0, -0.08, (3.0, 1.0), 0.7)
    black = Vehicle("black", 60.0, 5.0, -3.25, 8.0, 0.1, (0.8, 2.5), -0.4)
    vehicles = {vehicle.name: vehicle for vehicle in (craft, red, black)}

    rclpy.init()
    node = rclpy.create_node("peer")
    best_effort = QoSProfile(depth=10, reliability=QoSReliabilityPolicy.BEST_EFFORT)
    latched = QoSProfile(depth=1, durability=QoSDurabilityPolicy.TRANSIENT_LOCAL)
    publishers = {
        "medusa": node.create_publisher(Odometry, "/fleet/medusa/odom", 10),
        "red": node.create_publisher(Odometry, "/fleet/red/odom", best_effort),
        "black": node.create_publisher(Odometry, "/black/odometry/filtered", 10),
    }
    twists, paths, late_paths = [], [], []
    node.create_subscription(TwistStamped, "/fleet/medusa/cmd_vel", twists.append, 10)
    node.create_subscription(Path, "/fleet/medusa/plan", paths.append, 10)

    def publish():
        for name, publisher in publishers.items():
            publisher.publish(vehicles[name].odometry(node.get_clock().now()))

    def until(condition, complaint):
        while not condition():
            assert time.monotonic() - started_s < DEADLINE_S, complaint
            rclpy.spin_once(node, timeout_sec=PERIOD_S)

    def silent():
        seen = {line.get("auv", "medusa") for line in program.lines}
        return [name for name in vehicles if name not in seen]

    def heard(since_s):
        return any("craft" in line and line["t_s"] > since_s for line in program.lines[-20:])

    with tempfile.TemporaryDirectory() as directory:
        program = Program(program_path, directory)
        try:
            timer = node.create_timer(PERIOD_S, publish)
            until(lambda: not silent() and twists and paths, "the nodes do not find each other")
            found_s = time.monotonic() - started_s
            until(lambda: len(craft.sent) >= ROUNDS, "the clock stands")
            wrong = craft.odometry(node.get_clock().now())
            wrong.header.frame_id = "odom"
            publishers["medusa"].publish(wrong)
            zeros = Odometry()
            zeros.header.frame_id = "map"
            zeros.pose.pose.orientation.w = 0.0
            publishers["medusa"].publish(zeros)
            wrong_s = time.time()
            parameter_services(node, until)
            # Messages of one publisher come in their order.
            until(lambda: heard(wrong_s), "the craft is no longer heard")
            node.destroy_timer(timer)
            node.create_subscription(Path, "/fleet/medusa/plan", late_paths.append, latched)
            until(lambda: late_paths, "a plan is not there for those who come late")
            lines = program.end()
        finally:
            program.process.kill()

    refused = lines.pop()["refused"]
    assert refused.pop("odometry: frame_id is not map_frame") == 1, refused
    assert refused.pop("odometry: orientation is no unit quaternion") == 1, refused
    # Before the first odometry, and after the last.
    refused.pop("reference: no recent heading of the craft", None)
    assert not refused, refused
    counts, errors = check_measurements(lines, vehicles)
    check_twists(twists, craft)
    for path in paths + late_paths:
        check_path(path, craft)
    sent = {name: len(vehicle.sent) for name, vehicle in vehicles.items()}
    assert all(count >= ROUNDS // 2 for count in counts.values()) and len(counts) == 12, counts
    print(f"discovered after {found_s:.1f} s; all in {time.monotonic() - started_s:.1f} s; sent {sent}")
    print("received:", ", ".join(f"{count} {' '.join(key)}" for key, count in counts.items()))
    print(f"largest errors: {errors}")
    print(f"published: {len(twists)} TwistStamped, {len(paths)} Path, {len(late_paths)} late")
    node.destroy_node()
    rclpy.shutdown()


if __name__ == "__main__":
    main(sys.argv[1])
