"""A boat under ArduPilot's Rover and an AUV, as MAVLink tells of them, with the faults of both.

Places and velocities (north, east), m and m/s, are complex numbers; headings are clockwise from north, rad.
"""

import cmath
import math
import os
import random
import time
from typing import NamedTuple

os.environ["MAVLINK20"] = "1"
from pymavlink.dialects.v20 import ardupilotmega as mav

SPEED_MAX, TURN_MAX, ACCELERATION = 1.2, math.radians(45), 0.5  # m/s, rad/s, m/s²: the autopilot's parameters
PAUSE_MAX = 3.0  # after a longer one a reference counts from the craft's own state, s
PARAMETERS = {"WP_SPEED": SPEED_MAX, "ATC_STR_RAT_MAX": math.degrees(TURN_MAX), "ATC_ACCEL_MAX": ACCELERATION}
PARAMETERS |= {"ATC_DECEL_MAX": ACCELERATION, "ATC_SPEED_I": 0.2, "GUID_OPTIONS": 0.0, "CRUISE_SPEED": SPEED_MAX}
PARAMETERS |= {"SERVO1_FUNCTION": 73.0, "SERVO3_FUNCTION": 74.0}
GUIDED, HOLD, MANUAL = 15, 4, 0
ORIGIN = (38.41, -9.12)
DEGREE = (111_000.0, 111_320.0 * math.cos(math.radians(ORIGIN[0])))  # m of latitude, of longitude
CURRENT = complex(0.05, 0.1)  # m/s
STEP = 0.05  # s


class Reference(NamedTuple):
    """Speed, m/s, and heading, rad, that a bridge sent, s since the start and s of the bridge's clock."""

    t: float
    bridge_s: float
    speed: float
    heading: float


def wrapped(angle: float) -> float:
    return (angle + math.pi) % math.tau - math.pi


def clamp(value: float, most: float) -> float:
    return max(-most, min(most, value))


def degrees(place: complex) -> tuple[int, int]:
    """Latitude and longitude, 1e-7°."""
    return round(1e7 * (ORIGIN[0] + place.real / DEGREE[0])), round(1e7 * (ORIGIN[1] + place.imag / DEGREE[1]))


class Boat:
    """Surge and yaw of first order, with the errors of its sensors; ArduPilot's rules of GUIDED."""

    def __init__(self, draw: random.Random):
        self.draw, self.asked, self.said = draw, Reference(-math.inf, 0.0, 0.0, 0.0), {}
        self.place, self.velocity, self.surge, self.heading, self.rate = 0j, 0j, 0.0, 0.0, 0.0
        self.error = 0j  # of the position: correlated over half a minute
        self.mode, self.is_armed, self.booted = GUIDED, True, 0.0

    def noise(self, sigma: float) -> complex:
        return complex(self.draw.gauss(0, sigma), self.draw.gauss(0, sigma))

    def step(self, now: float, fault: str) -> None:
        follows = now - self.asked.t <= PAUSE_MAX and self.mode == GUIDED and self.is_armed
        speed, heading = self.asked[2:] if follows else (0.0, self.heading)
        surge = speed - (CURRENT * cmath.rect(1, -self.heading)).real  # it holds speed over ground
        surge = {"no thrust": 0.0, "half thrust": 0.5 * surge, "thrust stays": 1.0}.get(fault, surge)
        rate = clamp(1.2 * wrapped(heading - self.heading), TURN_MAX)
        rate = {"rudder amidships": 0.0, "rudder over": 0.3}.get(fault, rate)
        self.rate += (rate - self.rate) * STEP / 0.4
        self.surge += clamp((surge - self.surge) / 0.8, ACCELERATION) * STEP
        self.heading = wrapped(self.heading + self.rate * STEP)
        self.velocity = cmath.rect(self.surge, self.heading) + CURRENT
        self.place += self.velocity * STEP
        self.error += self.noise(0.5) * math.sqrt(2 * STEP / 30) - self.error * STEP / 30

    def messages(self, now: float, fault: str, since: float, then: dict, is_second: bool) -> list:
        """What it says; `then` is what it said when the fault began, `since` s ago."""
        ms, place = max(1, round(1000 * (now - self.booted))), self.place + self.error + self.noise(0.02)
        velocity, heading = self.velocity + self.noise(0.03), self.heading + self.draw.gauss(0, 0.01)
        wrong = {
            "position stays": {"place": then.get("place")},
            "position and its clock stay": {"place": then.get("place"), "ms": then.get("ms")},
            "position 50 m off": {"place": place + 50j},
            "position drifts off at 1 m/s": {"place": place + 1j * since},
            "GNSS lost": {"place": place + 0.3j * since},
            "velocity 60 m/s": {"velocity": 60 + 0j},
            "velocity wrong for 2 s": {"velocity": -15 + 9j if since < 2 else velocity},
            "velocity 0": {"velocity": 0j},
            "velocity 0 below 0.5 m/s": {"velocity": 0j if abs(velocity) < 0.5 else velocity},
            "heading stays": {"heading": then.get("heading")},
            "heading and yaw rate stay": {"heading": then.get("heading")},
            "heading 40° off": {"heading": heading + math.radians(40)},
        }.get(fault, {})
        self.said = {"ms": ms, "place": place, "velocity": velocity, "heading": heading} | wrong
        ms, place, velocity, heading = self.said.values()
        rate = 0.0 if fault == "heading and yaw rate stay" else self.rate + self.draw.gauss(0.005, 0.01)
        there = (0, 0) if fault == "position 0° 0°" else degrees(place)
        motion = (round(100 * velocity.real), round(100 * velocity.imag), 0)
        course = 65535 if fault == "heading missing" else round(100 * math.degrees(heading)) % 36000
        sent = [mav.MAVLink_global_position_int_message(ms, *there, 0, 0, *motion, course)]
        if fault == "two vehicles with one number":
            there = degrees(self.place + 300)
            sent.append(mav.MAVLink_global_position_int_message(ms + 7, *there, 0, 0, 0, 0, 0, 9000))
        if fault != "heading missing":
            sent.append(mav.MAVLink_attitude_message(ms, 0, 0, wrapped(heading), 0, 0, rate))
        if is_second:
            known = 0x81 if fault == "GNSS lost" else 0x7B  # constant position, or all of the filter
            sent.append(mav.MAVLink_system_time_message(round(1e6 * time.time()), ms))
            sent.append(mav.MAVLink_ekf_status_report_message(known, 0, 0, 0, 0, 0))
        if is_second and fault != "heartbeats cease":
            kind = (mav.MAV_TYPE_SURFACE_BOAT, mav.MAV_AUTOPILOT_ARDUPILOTMEGA, 0x81 if self.is_armed else 0x01)
            sent.append(mav.MAVLink_heartbeat_message(*kind, self.mode, 4, 3))
        return sent


class Auv:
    """Legs of 80 m, 12 m apart, each at its own speed; fixes each 5 to 10 s with 1.5 m, of which 30 % are lost."""

    def __init__(self, draw: random.Random):
        self.draw, self.place, self.speed, self.leg, self.left = draw, 15 + 5j, 0.7, 0, 80.0
        self.due, self.fixes = 0.0, 0

    def step(self) -> None:
        self.left -= self.speed * STEP
        self.place += self.speed * STEP * (1, 1j, -1, 1j)[self.leg % 4]
        if self.left <= 0:
            self.leg, self.speed = self.leg + 1, self.draw.uniform(0.5, 0.9)
            self.left = 12.0 if self.leg % 2 else 80.0

    def messages(self, now: float, fault: str) -> list:
        if now < self.due:
            return []
        self.due = now + self.draw.uniform(5, 10)
        if self.draw.random() < 0.3 or fault == "no fixes":
            return []
        self.fixes += 1
        place = self.place + complex(self.draw.gauss(0, 1.5), self.draw.gauss(0, 1.5))
        is_far = fault == "a fix 2 km off" and self.fixes == 1
        places = [place + 2000 * is_far] + [place + 60j] * (fault == "fixes of two vehicles")
        sigma = 0.003 if fault == "fixes claim 3 mm" else 1.5
        rest = (-10, [0] * 3, [0] * 3, [1, 0, 0, 0], [0] * 3, [sigma] * 3, 0)
        knows = 3 if fault == "AUV reports speed 0" else 1  # position and velocity, or position
        fixes = [(round(1000 * now) + k, knows, *degrees(place), *rest) for k, place in enumerate(places)]
        return [mav.MAVLink_follow_target_message(*fix) for fix in fixes]
