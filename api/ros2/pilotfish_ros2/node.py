"""The node: topics, parameters, timer."""

from __future__ import annotations

import json
import math
import re
import ssl
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from itertools import islice
from pathlib import Path as File
from typing import Any

import rclpy
from geometry_msgs.msg import PoseWithCovarianceStamped, Twist, TwistStamped
from nav_msgs.msg import Odometry, Path
from rcl_interfaces.msg import FloatingPointRange, ParameterDescriptor, SetParametersResult
from rclpy.clock import Clock, ClockType
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.qos import QoSDurabilityPolicy, QoSProfile, QoSReliabilityPolicy
from sensor_msgs.msg import Range

from . import conversion
from .console import Console
from .doubts import Alarm, Doubts
from .following import Arrivals, CurrentObserver, Motion, steering, why_silent
from .frames import Frames
from .mission import MissionLink
from .pilotfish import Client

# Best effort matches every publisher; 0.3 s of a filter that publishes at 100 Hz.
ODOMETRY_QOS = QoSProfile(depth=32, reliability=QoSReliabilityPolicy.BEST_EFFORT)
REFERENCE_QOS = QoSProfile(depth=1, reliability=QoSReliabilityPolicy.RELIABLE)
# Subscribers that join later receive the last plan.
PLAN_QOS = QoSProfile(depth=1, durability=QoSDurabilityPolicy.TRANSIENT_LOCAL)
# A turn rate needs a heading that is no older: at 0.3 rad/s the bow turns 17° in this time, s.
HEADING_AGE_MAX_S = 1.0
# A state that is older is not reported, s.
REPORT_AGE_MAX_S = 2.0
# Between two words whether the craft is steered; after three that are missing it is not known any more.
WORD_INTERVAL_S = 1.0
STATUS_INTERVAL_S = 5.0
# For an answer of the service, and for retries inside the client, s: a plan may be followed for 10 s.
TIMEOUT_S, PATIENCE_S = 4.0, 4.0

# Name, default or type of a parameter without one, range, meaning.
PARAMETERS: list[tuple[str, Any, tuple[float, float] | None, str]] = [
    ("craft", "", None, "name of the craft in topics"),
    ("auvs", Parameter.Type.STRING_ARRAY, None, "names of the AUVs in topics and in the mission"),
    ("map_frame", "map", None, "frame of the mission (east, north, up); TF leads to it from the others"),
    ("base_frame", "base_link", None, "frame_id of the published twist (forward, left, up)"),
    ("enable_stamped_cmd_vel", True, None, "publish TwistStamped; false: Twist"),
    ("origin.lat_deg", Parameter.Type.DOUBLE, (-90.0, 90.0), "latitude of the origin of map_frame, WGS 84"),
    ("origin.lon_deg", Parameter.Type.DOUBLE, (-180.0, 180.0), "longitude of the origin of map_frame, WGS 84"),
    ("heading_loop.time_constant_s", 1.0, (0.05, 60.0), "T of r = (psi_ref - psi)/T"),
    ("heading_loop.rate_max_radps", 0.3, (0.001, 3.0), "largest turn rate that is published"),
    ("url", "http://127.0.0.1:8080", None, "address of the service"),
    ("token_file", "", None, "file with the token of a service that needs one"),
    ("certificate", "", None, "PEM file of the service's certificate, or of its authority"),
    ("name", "craft", None, "name under which the node finds its mission again"),
    ("goal", "track", None, "track (the first AUV), midpoint, intermittent or visit"),
    ("dwell_s", 240.0, None, "time with each AUV (goal intermittent)"),
    ("period_s", 0.5, None, "time between two plans"),
    ("setup_file", "", None, "file with the body of POST /v1/missions, instead of goal"),
    ("mission", "", None, "ID of a mission to join, instead of creating one"),
    ("rate_hz", 10.0, (2.0, 50.0), "references per second"),
    ("report_interval_s", 0.2, (0.05, 5.0), "time between two reports"),
    ("sigma_m", 1.0, (0.01, 1000.0), "standard deviation of AUV positions without a covariance"),
    ("range_sigma_m", 1.5, (0.01, 1000.0), "standard deviation of ranges, with the error of the craft's position"),
    ("dry_run", False, None, "publish no velocity reference"),
]
# Parameters that can be set while the node runs; of the others topics and the mission are made.
CHANGEABLE = ("heading_loop.time_constant_s", "heading_loop.rate_max_radps", "sigma_m", "range_sigma_m", "dry_run")
# Simulated time that runs slower or faster than this is said; how long it is looked at, s.
RATE_OFF_MAX, RATE_OVER_S = 0.1, 5.0


class PilotfishNode(Node):
    """Subscribes to odometry of the craft and its AUVs, keeps the mission, and publishes reference and path."""

    def __init__(self) -> None:
        super().__init__("pilotfish")
        self._read_parameters()
        self._is_simulated = bool(self.get_parameter("use_sim_time").value)
        # Simulated and monotonic time when the rate was looked at, and the rate.
        self._rate: tuple[float, float, float] | None = None
        p = self._settings
        self._rejected: Counter[str] = Counter()
        self._observer = CurrentObserver()
        self._doubts = Doubts()
        self._alarms: set[Alarm] = set()
        # The craft's newest motion, and when it was measured on the monotonic clock.
        self._craft: tuple[Motion, float] | None = None
        self._reported_s = -math.inf
        self._is_steering = False
        self._said: str | None = "nothing yet"
        self._word: tuple[tuple[str, str], float] = (("", ""), -math.inf)
        self._trouble = ""
        self._published_plan: int | None = None
        self._plans, self._fixes = Arrivals(), dict[str, Arrivals]()

        token = File(p["token_file"]).read_text("utf-8-sig").strip() if p["token_file"] else None
        verify = ssl.create_default_context(cafile=p["certificate"]) if p["certificate"] else True
        client = Client(p["url"], token, timeout_s=TIMEOUT_S, patience_s=PATIENCE_S, verify=verify)
        self._link = MissionLink(
            client, p["name"], mission_body(p), p["mission"], p["report_interval_s"], self.get_logger().info
        )
        craft = topic_name(p["craft"])
        twist = TwistStamped if p["enable_stamped_cmd_vel"] else Twist
        self._twist = self.create_publisher(twist, f"{craft}/cmd_vel", REFERENCE_QOS)
        self._path = self.create_publisher(Path, f"{craft}/plan", PLAN_QOS)
        self._frames = Frames(self, p["map_frame"])
        self._craft_topic = self._hear(Odometry, f"{craft}/odom", self._take_craft)
        self._auv_topics = {auv: self._hear_auv(auv) for auv in p["auvs"]}
        self._hear(Odometry, "traffic", self._take_vessel)
        self._console = Console(self, self._link, p["craft"])
        # They go on when simulated time stands.
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self.create_timer(1.0 / p["rate_hz"], self._tick, clock=steady)
        self.create_timer(STATUS_INTERVAL_S, self._log_status, clock=steady)
        self.add_on_set_parameters_callback(self._change)
        self._link.start()

    def _hear(self, kind: type, topic: str, take: Callable[[Any], None]) -> str:
        """Subscribes, and returns the topic's full name."""
        return self.create_subscription(kind, topic, take, ODOMETRY_QOS).topic_name

    def _hear_auv(self, auv: str) -> list[str]:
        name = topic_name(auv)
        return [
            self._hear(Odometry, f"{name}/odom", lambda message: self._take_auv(auv, message)),
            self._hear(PoseWithCovarianceStamped, f"{name}/pose", lambda message: self._take_pose(auv, message)),
            self._hear(Range, f"{name}/range", lambda message: self._take_range(auv, message)),
        ]

    def _change(self, parameters: list[Parameter]) -> SetParametersResult:
        """Takes new values; those that are read-only or out of range do not come here."""
        for parameter in parameters:
            if parameter.name in self._settings:
                self._settings[parameter.name] = parameter.value
        return SetParametersResult(successful=True)

    def _ros_s(self) -> float:
        """The time of stamps, s: Unix time, or the simulator's."""
        return self.get_clock().now().nanoseconds * 1e-9

    def _unix(self, stamp_s: float, received_s: float) -> float:
        """The Unix time of a stamp in a message that arrived at `received_s`."""
        return stamp_s + (time.time() - received_s) if self._is_simulated else stamp_s

    def _simulated_rate(self, now_s: float) -> str | None:
        """What is wrong with simulated time: missions run in real time."""
        if not self._is_simulated:
            return None
        if self._rate is None or now_s - self._rate[1] >= RATE_OVER_S:
            ros_s = self._ros_s()
            rate = 1.0 if self._rate is None else (ros_s - self._rate[0]) / (now_s - self._rate[1])
            self._rate = (ros_s, now_s, rate)
        rate = self._rate[2]
        return f"simulated time runs at {rate:.2f} of real time" if abs(rate - 1.0) > RATE_OFF_MAX else None

    def _read_parameters(self) -> None:
        """Most parameters are read-only: topics and the mission are made of them."""
        self._settings: dict[str, Any] = {}
        for name, default, limits, meaning in PARAMETERS:
            descriptor = ParameterDescriptor(description=meaning, read_only=name not in CHANGEABLE)
            if limits is not None:
                descriptor.floating_point_range = [FloatingPointRange(from_value=limits[0], to_value=limits[1])]
            self.declare_parameter(name, default, descriptor)
            self._settings[name] = self.get_parameter_or(name).value
        if not self._settings["craft"]:
            raise ValueError("parameter craft is missing: the name of the craft in topics")
        self._settings["auvs"] = list(self._settings["auvs"] or [])
        check_names(self._settings["craft"], self._settings["auvs"])
        self._settings["map_frame"] = self._settings["map_frame"].lstrip("/")
        # REP 103 has this suffix for frames whose z points down.
        if self._settings["map_frame"].endswith("_ned"):
            raise ValueError("parameter map_frame must name an east-north-up frame")

    def _motion(self, odometry: Odometry) -> Motion | None:
        received_s = self._ros_s()
        try:
            odometry = self._frames.in_map(odometry)
            motion, is_plausible = conversion.motion(odometry, self._settings["map_frame"], received_s)
        except conversion.Rejected as rejected:
            self._rejected[str(rejected)] += 1
            return None
        if not is_plausible:
            self._rejected["stamp implausible, arrival time used"] += 1
        return replace(motion, t_s=self._unix(motion.t_s, received_s))

    def _take_craft(self, odometry: Odometry) -> None:
        if (motion := self._motion(odometry)) is None:
            return
        t_s = time.monotonic() - (time.time() - motion.t_s)
        motion = self._doubts.admit(t_s, motion)
        self._note_alarms()
        if motion is None:
            self._rejected["position or heading jumps"] += 1
            return
        self._craft = (motion, t_s)
        if self._doubts.is_measured:
            self._observer.update(t_s, motion.heading_rad, motion.yaw_rate_radps, motion.ground_velocity)

    def _note_alarms(self) -> None:
        """Says once what contradicts, and when it is over."""
        alarms = set(self._doubts.alarms)
        for alarm in sorted(alarms ^ self._alarms, key=list(Alarm).index):
            self._note(alarm.value if alarm in alarms else f"over: {alarm.value}")
        if Alarm.VELOCITY_CONTRADICTS in alarms - self._alarms:
            # It was learnt from a wrong velocity.
            self._observer = CurrentObserver()
        self._alarms = alarms

    def _take_auv(self, auv: str, odometry: Odometry) -> None:
        if (motion := self._motion(odometry)) is None:
            return
        self._fixes.setdefault(auv, Arrivals()).push(time.monotonic())
        known = {"depth_m": motion.depth_m, "sigma_m": self._settings["sigma_m"]}
        self._link.report_auv(auv, known | _place(motion))

    def _take_pose(self, auv: str, message: PoseWithCovarianceStamped) -> None:
        """A position without a velocity, as an acoustic positioning system publishes it."""
        self._take_auv(auv, Odometry(header=message.header, pose=message.pose))

    def _take_vessel(self, odometry: Odometry) -> None:
        """Another vessel: `child_frame_id` says which."""
        vessel = odometry.child_frame_id.strip("/").removesuffix("/base_link")
        if not vessel:
            self._rejected["a vessel without a child_frame_id"] += 1
        elif (motion := self._motion(odometry)) is not None:
            self._link.report_vessel(vessel, _place(motion))

    def _take_range(self, auv: str, message: Range) -> None:
        """The mission knows where the craft was when it measured the range."""
        received_s = self._ros_s()
        try:
            t_s, range_m, is_plausible = conversion.slant_range(message, received_s)
        except conversion.Rejected as rejected:
            self._rejected[str(rejected)] += 1
            return
        if not is_plausible:
            self._rejected["stamp implausible, arrival time used"] += 1
        self._fixes.setdefault(auv, Arrivals()).push(time.monotonic())
        t_s = self._unix(t_s, received_s)
        self._link.report_auv(auv, {"t_s": t_s, "range_m": range_m, "sigma_m": self._settings["range_sigma_m"]})

    def _tick(self) -> None:
        if self._link.failed:
            raise RuntimeError(f"the mission cannot be kept: {self._link.failed}")
        if self._link.status in ("finished", "failed"):
            self.get_logger().info(f"the mission is {self._link.status}")
            raise ExternalShutdownException
        now_s = time.monotonic()
        self._report_craft(now_s)
        plan = self._link.plan
        reference = plan.at(now_s) if plan is not None else None
        age_s = None if self._craft is None else now_s - self._craft[1]
        silence = why_silent(age_s, reference, self._link.status, self._link.has_planned)
        if silence is None and age_s > HEADING_AGE_MAX_S:
            silence = "the heading of the craft is too old"
        silence = silence or self._doubts.distrusted()
        if silence is not None and not self._link.has_planned:
            silence = ": ".join([silence, *self._lacks()])
        self._is_steering = silence is None and not self._settings["dry_run"]
        if silence != self._said:
            self._said = silence
            sending = "references would be sent: dry run" if self._settings["dry_run"] else "references are sent"
            self._note(sending if silence is None else f"no references are sent: {silence}")
        self._report_steering(now_s, silence)
        if plan is not None and plan.sequence != self._published_plan:
            self._published_plan = plan.sequence
            self._plans.push(now_s)
            self._path.publish(conversion.path_message(plan, self._settings["map_frame"], self._ros_s() - now_s))
        if self._is_steering:
            heading = self._craft[0].heading_rad
            base_frame = self._settings["base_frame"]
            loop = (self._settings["heading_loop.time_constant_s"], self._settings["heading_loop.rate_max_radps"])
            message = conversion.twist_message(reference, heading, loop, base_frame, self._ros_s())
            self._twist.publish(message if self._settings["enable_stamped_cmd_vel"] else message.twist)
            self._doubts.sent(reference.speed_mps, 1.0 / self._settings["rate_hz"])

    def _lacks(self) -> list[str]:
        """What the first plan waits for: the service, or the topics of the first vehicle that nothing was heard of."""
        if self._craft is None:
            return [f"nothing usable on {self._craft_topic}"]
        if self._link.trouble:
            return [f"the service at {self._settings['url']} does not answer"]
        unheard = (topics for auv, topics in self._auv_topics.items() if auv not in self._fixes)
        return [f"nothing usable on {', '.join(topics)}" for topics in islice(unheard, 1)]

    def _is_unread(self) -> bool:
        """Whether nothing subscribes to the references, nor to the path, which a craft may steer by instead."""
        return self._twist.get_subscription_count() == 0 and self._path.get_subscription_count() == 0

    def _report_craft(self, now_s: float) -> None:
        """Posts the newest state, once, if it has a velocity and is trustworthy."""
        if self._craft is None or self._doubts.distrusted():
            return
        motion, t_s = self._craft
        velocity = motion.ground_velocity
        if velocity is None or t_s <= self._reported_s or now_s - t_s > REPORT_AGE_MAX_S:
            return
        self._reported_s = t_s
        surge, sway = self._observer.through_water(motion.heading_rad, velocity)
        state = {
            "north_m": motion.north_m,
            "east_m": motion.east_m,
            "heading_rad": motion.heading_rad,
            "speed_mps": surge,
            "sway_mps": sway,
            "yaw_rate_radps": motion.yaw_rate_radps,
            "ground_north_mps": float(velocity[0]),
            "ground_east_mps": float(velocity[1]),
        }
        north, east = map(float, self._observer.current)
        current = {"north_mps": north, "east_mps": east}
        self._link.report_craft({"t_s": motion.t_s, "state": state, "steered": self._is_steering, "current": current})

    def _report_steering(self, now_s: float, silence: str | None) -> None:
        """Says once a second, and as soon as it has changed, whether the craft is steered."""
        if self._settings["dry_run"]:
            word = ("waiting", f"a dry run; {silence}" if silence else "a dry run")
        else:
            word = self._steering(now_s, silence)
        before, said_s = self._word
        if word != before or now_s - said_s >= WORD_INTERVAL_S:
            self._word = (word, now_s)
            self._link.report_steering({"t_s": time.time(), "state": word[0], "why": _cut(word[1])})
            rows = [("mission", self._link.status), ("plan", self._link.plan.status if self._link.plan else "none")]
            rows += [("service", self._link.trouble)] if self._link.trouble else []
            rows += [(f"rejected: {reason}", str(count)) for reason, count in self._rejected.items()]
            rows.append(("subscribers of cmd_vel", str(self._twist.get_subscription_count())))
            self._console.show(self._ros_s(), word, rows)
        if word != before:
            self._log_status()

    def _steering(self, now_s: float, silence: str | None) -> tuple[str, str]:
        """The state of the steering, decided here alone."""
        is_meant = self._link.status != "running" or not self._link.has_planned
        faults = []
        if self._is_unread():
            kind = self._twist.msg_type.__name__
            faults.append(f"nothing subscribes to {self._twist.topic_name} (geometry_msgs/{kind})")
        faults += [alarm.value for alarm in Alarm if alarm in self._alarms]
        faults += self._link.plan.faults if self._link.plan else ()
        missing = [f"no new fix of {auv}" for auv, fixes in self._fixes.items() if fixes.is_overdue(now_s)]
        if (off := self._simulated_rate(now_s)) is not None:
            missing.append(off)
        if self._plans.is_overdue(now_s):
            missing.insert(0, "the service does not answer" if self._link.trouble else "no new plan")
        return steering(silence, is_meant, faults, missing)

    def _log_status(self) -> None:
        if self._link.trouble != self._trouble:
            self._trouble = self._link.trouble
            self._note(
                f"the service does not answer: {self._trouble}" if self._trouble else "the service answers again"
            )
        (state, why), _ = self._word
        parts = [f"{state.replace('_', ' ')}: {why}" if why else state.replace("_", " ")]
        parts.append(self._link.plan.status if self._link.plan else "no plan")
        parts += [alarm.value for alarm in Alarm if alarm in self._alarms and alarm.value not in why]
        parts += [f"rejected: {reason}: {count}" for reason, count in self._rejected.items()]
        self.get_logger().info("; ".join(parts))

    def _note(self, text: str) -> None:
        """Writes to the node's log and to the mission's."""
        self.get_logger().info(text)
        self._link.note(time.time(), _cut(text))


def check_names(craft: str, auvs: list[str]) -> None:
    """Names make topics: each has to be one, and no two the same."""
    used: dict[str, str] = {}
    for parameter, vehicle in [("craft", craft), *(("auvs", auv) for auv in auvs)]:
        name = topic_name(vehicle)
        if not re.fullmatch(r"[A-Za-z_][A-Za-z0-9_]*", name):
            raise ValueError(f"parameter {parameter}: {vehicle!r} cannot be in topics: letters, digits, - and _ can")
        if name in used:
            raise ValueError(f"parameter {parameter}: {used[name]!r} and {vehicle!r} have the same topic {name}/odom")
        used[name] = vehicle


def _cut(text: str) -> str:
    """The beginning of `text` that the service accepts."""
    return text.encode()[:500].decode(errors="ignore")


def topic_name(vehicle: str) -> str:
    """A vehicle's name in topics, which cannot hold a hyphen."""
    return vehicle.replace("-", "_")


def mission_body(p: dict[str, Any]) -> dict[str, Any]:
    """The body of `POST /v1/missions` that the parameters describe."""
    if p["setup_file"]:
        body = json.loads(File(p["setup_file"]).read_text())
    else:
        auvs = p["auvs"]
        if not auvs and not p["mission"]:
            raise ValueError("parameter auvs is missing: the names of the AUVs")
        goals: dict[str, Any] = {
            "track": {"kind": "track", "auv": (auvs or [""])[0]},
            "midpoint": {"kind": "midpoint", "auvs": auvs},
            "intermittent": {"kind": "intermittent", "auvs": auvs, "dwell_s": p["dwell_s"], "epoch_s": 0.0},
            "visit": {"kind": "visit", "auvs": auvs},
        }
        if p["goal"] not in goals:
            raise ValueError(f"parameter goal must be one of {', '.join(goals)}")
        live = {"auvs": [{"id": auv} for auv in auvs], "goal": goals[p["goal"]], "period_s": p["period_s"]}
        body = {"title": p["name"], "live": live}
    latitude, longitude = p["origin.lat_deg"], p["origin.lon_deg"]
    if (latitude is None) != (longitude is None):
        raise ValueError("parameters origin.lat_deg and origin.lon_deg belong together")
    if latitude is not None:
        origin = {"lat_deg": latitude, "lon_deg": longitude}
        # Positions are posted in metres of map_frame: the mission's origin must be the map's.
        if body["live"].setdefault("origin", origin) != origin:
            raise ValueError("origin.lat_deg and origin.lon_deg differ from the origin in setup_file")
    return body


def _place(motion: Motion) -> dict[str, Any]:
    """What a motion tells of an AUV or a vessel. A value that nothing was published of is left out."""
    place = {"t_s": motion.t_s, "north_m": motion.north_m, "east_m": motion.east_m}
    if motion.sigma_m:
        place["sigma_m"] = motion.sigma_m
    if motion.ground_velocity is not None:
        north, east = motion.ground_velocity
        place |= {"course_rad": math.atan2(east, north), "speed_mps": math.hypot(north, east)}
    return place


def main() -> None:
    """Runs the node until the mission is over."""
    rclpy.init()
    try:
        rclpy.spin(PilotfishNode())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        rclpy.try_shutdown()


if __name__ == "__main__":
    main()
