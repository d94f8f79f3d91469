#!/usr/bin/env python3
"""A whole mission through the HTTP API, in Python: the world is simulated here, the server guides it.

    cargo run --release                              # the server, in a terminal of its own
    pip install -r examples/requirements.txt
    python3 examples/mission.py
    python3 examples/mission.py --duration 300 --plot mission.png     # the plot needs matplotlib

An autonomous underwater vehicle (AUV) dives in a sawtooth along a lawn-mower path; a surface craft is
to stay above it. Once a second of mission time, what is known is posted to /v1/plan, and the speed and
heading that come back are held by the craft's inner loops.

The surface craft is a MEDUSA-class vehicle with the same hull, thrusters and inner loops as in the
project's Rust simulator (surge, sway and yaw, ten steps a second). The AUV is simpler than there, and on
purpose: it is always exactly on its path and at its speed, turns with the path at once, and only its
pitch takes time, a steady 25 degrees a second, from one leg of the dive to the next. There is no current
and no noise. Expect figures like those of `pilotfish simulate paper-tracking`, not the same.

Everywhere: metres, seconds, radians; north, east, depth positive down; headings clockwise from north.
"""

import argparse
import sys
import time

import numpy as np
import requests

STEP = 0.1  # s, period of the inner loops and of the integration
STEPS_PER_PLAN = 10  # the server is asked once a second

# The surface craft, SI units. Masses include the added mass of the water.
MASS_SURGE, MASS_SWAY, INERTIA_YAW = 50.0, 60.0, 4.64
DRAG_LINEAR = np.array([0.0, 55.1, 4.14])
DRAG_QUADRATIC = np.array([27.5, 101.0, 6.23])
THRUST_MAX, THRUSTER_ARM = 36.0, 0.15  # N and m, each of two stern thrusters

# Its inner loops.
SURGE_P, SURGE_I, SURGE_ERROR_MAX = 26.0, 3.0, 0.2
YAW_FREQUENCY, YAW_DAMPING = 1.6, 0.8

# The AUV.
AUV_SPEED = 0.3  # m/s along the body
PITCH, PITCH_RATE = np.radians(50.0), np.radians(25.0)
DEPTH_MIN, DEPTH_MAX = 1.0, 23.0
LANE_LENGTH, TURN_RADIUS = 100.0, 10.0


def wrap(angle):
    """The same angle within ±π."""
    return np.arctan2(np.sin(angle), np.cos(angle))


class SurfaceCraft:
    """Hull, two thrusters, and the loops that hold a speed and a heading.

    The state is (north, east, heading, surge, sway, yaw rate).
    """

    def __init__(self, north, east, heading, surge):
        self.state = np.array([north, east, heading, surge, 0.0, 0.0])
        self.surge_integral = 0.0  # N
        self.energy = 0.0  # J, integral of |thrust * surge speed|
        self.heading_travel = 0.0  # rad, integral of |yaw rate|

    def step(self, speed, heading):
        """Lets one period pass while the loops hold `speed` and `heading`."""
        force, moment = self.thrust(speed, heading)
        before = self.state
        self.state = runge_kutta(lambda state: self.derivative(state, force, moment), before)
        _, _, _, surge, _, yaw_rate = (before + self.state) / 2
        self.energy += abs(force * surge) * STEP
        self.heading_travel += abs(yaw_rate) * STEP

    def thrust(self, speed, heading):
        """Force ahead and moment to starboard that the loops get out of the thrusters."""
        _, _, psi, u, _, r = self.state
        error = np.clip(speed - u, -SURGE_ERROR_MAX, SURGE_ERROR_MAX)
        # Drag is made up for at once, so that the integral part has only what is left to learn.
        force_wanted = SURGE_P * error + self.surge_integral + DRAG_QUADRATIC[0] * abs(u) * u
        damping = 2 * YAW_DAMPING * YAW_FREQUENCY * INERTIA_YAW - DRAG_LINEAR[2]
        moment_wanted = INERTIA_YAW * YAW_FREQUENCY**2 * wrap(heading - psi) - damping * r

        # The thrusters turn first and push with what is left.
        differential = np.clip(moment_wanted / (2 * THRUSTER_ARM), -THRUST_MAX, THRUST_MAX)
        left = THRUST_MAX - abs(differential)
        force = 2 * np.clip(force_wanted / 2, -left, left)
        # No learning from an error that the thrusters cannot remove.
        if (force_wanted - force) * error <= 0:
            self.surge_integral += SURGE_I * error * STEP
        return force, 2 * THRUSTER_ARM * differential

    @staticmethod
    def derivative(state, force, moment):
        """Rate of change of the state: three degrees of freedom, Coriolis terms that do no work."""
        _, _, psi, u, v, r = state
        drag = (DRAG_LINEAR + DRAG_QUADRATIC * np.abs(state[3:])) * state[3:]
        return np.array([
            u * np.cos(psi) - v * np.sin(psi),
            u * np.sin(psi) + v * np.cos(psi),
            r,
            (force + MASS_SWAY * v * r - drag[0]) / MASS_SURGE,
            (-MASS_SURGE * u * r - drag[1]) / MASS_SWAY,
            (moment + (MASS_SURGE - MASS_SWAY) * u * v - drag[2]) / INERTIA_YAW,
        ])


def runge_kutta(derivative, state):
    """The state one step later, fourth order."""
    k1 = derivative(state)
    k2 = derivative(state + STEP / 2 * k1)
    k3 = derivative(state + STEP / 2 * k2)
    k4 = derivative(state + STEP * k3)
    return state + STEP / 6 * (k1 + 2 * k2 + 2 * k3 + k4)


class Auv:
    """A vehicle that is always on its lawn-mower path and dives in a sawtooth."""

    def __init__(self):
        self.travelled = 0.0  # m along the path
        self.depth = DEPTH_MIN
        self.pitch = 0.0  # nose-up
        self.leg = -1  # -1 dives, +1 climbs

    @property
    def speed(self):
        """Horizontal speed."""
        return AUV_SPEED * np.cos(self.pitch)

    def step(self):
        """Lets one period pass."""
        if self.depth >= DEPTH_MAX:
            self.leg = 1
        elif self.depth <= DEPTH_MIN:
            self.leg = -1
        most = PITCH_RATE * STEP
        self.pitch += np.clip(self.leg * PITCH - self.pitch, -most, most)
        self.travelled += self.speed * STEP
        self.depth -= AUV_SPEED * np.sin(self.pitch) * STEP

    def where(self):
        """North, east, course and the path's curvature (positive to starboard) under the vehicle."""
        turn_length = np.pi * TURN_RADIUS
        lane, along = divmod(self.travelled, LANE_LENGTH + turn_length)
        out = lane % 2 == 0  # lanes lead north and south in turn
        ahead, side = (1, 1) if out else (-1, -1)
        start = 0.0 if out else LANE_LENGTH
        east = lane * 2 * TURN_RADIUS
        course = 0.0 if out else np.pi
        if along <= LANE_LENGTH:
            return start + ahead * along, east, course, 0.0
        turned = (along - LANE_LENGTH) / TURN_RADIUS
        north = start + ahead * (LANE_LENGTH + TURN_RADIUS * np.sin(turned))
        east += TURN_RADIUS * (1 - np.cos(turned))
        return north, east, wrap(course + side * turned), side / TURN_RADIUS


def snapshot(now, craft, auv, previous_plan):
    """What is known now, as /v1/plan wants it."""
    north, east, heading, surge, sway, yaw_rate = craft.state.tolist()
    auv_north, auv_east, course, curvature = auv.where()
    return {
        "schema_version": "1.0",
        "t_s": now,
        "asc": {
            "north_m": north,
            "east_m": east,
            "heading_rad": float(wrap(heading)),
            "speed_mps": surge,
            "sway_mps": sway,
            "yaw_rate_radps": yaw_rate,
        },
        "auvs": [{
            "id": "auv-1",
            "state": {
                "north_m": float(auv_north),
                "east_m": float(auv_east),
                "depth_m": float(auv.depth),
                "course_rad": float(course),
                "speed_mps": float(auv.speed),
                "turn_rate_radps": float(auv.speed * curvature),
            },
        }],
        "goal": {"kind": "track", "auv": "auv-1"},
        "current": {"north_mps": 0.0, "east_mps": 0.0},
        # The server remembers nothing: its last answer goes back to it as it came.
        "previous_plan": previous_plan,
    }


def ask(session, url, body):
    """The server's plan. Says what to do where there is none."""
    try:
        response = session.post(f"{url}/v1/plan", json=body, timeout=10)
    except requests.ConnectionError:
        sys.exit(f"no server at {url}: start one with `cargo run --release`")
    if not response.ok:
        sys.exit(f"the snapshot was refused: {response.text}")
    return response.json()


def fly(url, duration):
    """One row a second: time, craft's and AUV's north and east; how often each method answered, and how often degraded."""
    craft = SurfaceCraft(north=-15.0, east=-8.0, heading=np.pi / 4, surge=0.3)
    auv = Auv()
    session = requests.Session()
    session.trust_env = False  # The environment's proxy does not lead to this machine.
    rows, answers, degraded, plan = [], {}, 0, None
    for second in range(duration):
        plan = ask(session, url, snapshot(float(second), craft, auv, plan))
        answers[plan["method"]] = answers.get(plan["method"], 0) + 1
        degraded += plan["outcome"] != "ok"
        rows.append([second, *craft.state[:2], *auv.where()[:2]])
        for _ in range(STEPS_PER_PLAN):
            craft.step(plan["reference"]["speed_mps"], plan["reference"]["heading_rad"])
            auv.step()
        if sys.stderr.isatty():
            print(f"\r{second + 1} s of {duration} s ", end="", file=sys.stderr, flush=True)
    if sys.stderr.isatty():
        print("\r", end="", file=sys.stderr)
    return np.array(rows), craft, answers, degraded


def plot(rows, file):
    """Both tracks, north up."""
    try:
        import matplotlib
    except ImportError:
        sys.exit("--plot needs matplotlib: pip install matplotlib")
    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(figsize=(6, 8))
    axes.plot(rows[:, 4], rows[:, 3], "--", label="AUV")
    axes.plot(rows[:, 2], rows[:, 1], label="surface craft")
    axes.set(xlabel="east, m", ylabel="north, m", aspect="equal")
    axes.legend(loc="lower left", bbox_to_anchor=(0, 1))  # above: a short mission is a narrow picture
    figure.savefig(file, dpi=150, bbox_inches="tight")


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("--url", default="http://127.0.0.1:8080", help="the server (default: %(default)s)")
    parser.add_argument("--duration", type=int, default=1800, metavar="S", help="mission time (default: %(default)s)")
    parser.add_argument("--settled-after", type=int, default=60, metavar="S",
                        help="settled_rms_m leaves out the approach, so long (default: %(default)s)")
    parser.add_argument("--plot", metavar="FILE", help="draw both tracks")
    arguments = parser.parse_args()
    if arguments.duration < 1:
        parser.error("--duration must be at least 1")

    start = time.perf_counter()
    rows, craft, answers, degraded = fly(arguments.url.rstrip("/"), arguments.duration)
    elapsed = time.perf_counter() - start

    distance = np.hypot(rows[:, 1] - rows[:, 3], rows[:, 2] - rows[:, 4])
    settled = distance[arguments.settled_after:]
    print(f"rms_m               {np.sqrt(np.mean(distance**2)):10.3f}")
    if settled.size:
        print(f"settled_rms_m       {np.sqrt(np.mean(settled**2)):10.3f}")
    print(f"energy_j            {craft.energy:10.0f}")
    print(f"heading_travel_rad  {craft.heading_travel:10.2f}")
    for method, count in sorted(answers.items()):
        print(f"{'answers.' + method:<20}{count:10d}")
    print(f"degraded            {degraded:10d}")
    print(f"requests_per_s      {len(rows) / elapsed:10.1f}")
    if arguments.plot:
        plot(rows, arguments.plot)


if __name__ == "__main__":
    main()
