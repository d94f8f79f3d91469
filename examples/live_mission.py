#!/usr/bin/env python3
"""A live mission, rehearsed in Python: what a surface craft's computer does all day, against a world in a hurry.

    cargo run --release -- serve --data /tmp/missions       # the server, in a terminal of its own
    pip install -r examples/requirements.txt
    python3 examples/live_mission.py
    python3 examples/live_mission.py --duration 600 --clock-rate 5

Two autonomous underwater vehicles (AUVs) follow lawn-mower paths, a little slower than planned. The surface craft is
to stay above their midpoint, and hears of them by sound: a metre off, up to eight seconds late, out of turn, some of
it twice, and of one of them nothing for three minutes. Once a second of mission time it posts what it heard and asks
for the reference.

Kill the server on the way, and start it again with the same --data: the mission goes on. Until then the craft follows
the last reference for as long as that is valid, and what the server did not acknowledge is posted again under the same key.

Everywhere: metres, seconds, radians; north, east, depth positive down; headings clockwise from north.
"""

import argparse
import sys
import time
import uuid

import numpy as np
import requests

STEPS_PER_S = 10
STEP = 1 / STEPS_PER_S  # s

# The AUVs.
IDS = ("auv-1", "auv-2")
SILENT = "auv-2"
START_EAST = {"auv-1": 0.0, "auv-2": 60.0}
LANE_LENGTH, LANES_APART = 60.0, 20.0
FILLET = 1.0  # the path that is sent has round corners; the AUVs turn on the spot
SPEED_PLANNED, SPEED = 0.40, 0.38  # m/s
DEPTH = 10.0
SILENCE_MAX = 180.0  # s, in the middle of the mission

# Their fixes.
FIX_STEPS = 50  # between two of the same AUV, the AUVs by turns
FIX_SIGMA = 1.0  # m
DELAY_MAX = 8.0  # s
TWICE = 0.1  # share of the fixes that arrive twice

# The surface craft: speed and heading follow their references like this, and change no faster.
SURGE_LAG, HEADING_LAG = 2.5, 1.0  # s
ACCELERATION_MAX, TURN_RATE_MAX = 0.09, 0.3  # m/s², rad/s

LINE_INTERVAL = 20  # s of mission time
SETTLED_AFTER = 60  # s: settled_rms_m leaves out the approach
ANSWER_TIME = 10.0  # s: a server that has not answered by then is taken to be gone
PATIENCE = 60.0  # s, when there is nothing else to do but wait
REST = 0.2  # s, between two attempts then
LATER = (429, 502, 503, 504)  # what a server with too much to do says


def wrap(angle):
    """The same angle within ±π."""
    return np.arctan2(np.sin(angle), np.cos(angle))


def path(start_east, duration):
    """Corners (north, east) of as many lanes as are travelled in `duration`, and one more."""
    points, east, travelled = [(0.0, start_east)], start_east, -LANE_LENGTH
    while travelled < SPEED_PLANNED * duration:
        end = LANE_LENGTH if points[-1][0] == 0.0 else 0.0
        points += [(end, east), (end, east + LANES_APART)]
        east += LANES_APART
        travelled += LANE_LENGTH + LANES_APART
    return np.array(points)


class World:
    """The truth, and what is on its way to the surface craft. `start` is what the mission's clock shows then."""

    def __init__(self, start, duration, seed):
        self.start = start
        self.steps = 0
        self.paths = {name: path(START_EAST[name], duration) for name in IDS}
        silent = min(SILENCE_MAX, duration / 3)
        self.silence = ((duration - silent) / 2, (duration + silent) / 2)
        self.north, self.east, self.heading, self.speed, self.yaw_rate = -10.0, 30.0, 0.0, 0.0, 0.0
        self.on_their_way = []  # (arrival, AUV, fix)
        self.random = np.random.default_rng(seed)

    @property
    def time(self):
        """Time since the start."""
        return self.steps / STEPS_PER_S

    @property
    def clock(self):
        """What the mission's clock shows."""
        return self.start + self.time

    @property
    def is_silent(self):
        """Whether one AUV is not heard."""
        return self.silence[0] <= self.time < self.silence[1]

    @property
    def distance(self):
        """From the craft to the midpoint of the AUVs."""
        north, east = (self.auv(IDS[0]) + self.auv(IDS[1])) / 2
        return float(np.hypot(north - self.north, east - self.east))

    def auv(self, name):
        """Where the AUV is: on its path, as far as it came."""
        points = self.paths[name]
        travelled = np.concatenate([[0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))])
        return np.array([np.interp(SPEED * self.time, travelled, points[:, axis]) for axis in (0, 1)])

    def step(self, reference):
        """Lets a tenth of a second pass. Without a reference the craft keeps its heading and stops."""
        speed, heading = reference or (0.0, self.heading)
        self.speed += STEP * np.clip((speed - self.speed) / SURGE_LAG, -ACCELERATION_MAX, ACCELERATION_MAX)
        self.yaw_rate = np.clip(wrap(heading - self.heading) / HEADING_LAG, -TURN_RATE_MAX, TURN_RATE_MAX)
        self.heading = wrap(self.heading + STEP * self.yaw_rate)
        self.north += STEP * self.speed * np.cos(self.heading)
        self.east += STEP * self.speed * np.sin(self.heading)
        self.steps += 1
        for turn, name in enumerate(IDS):
            if self.steps % FIX_STEPS == turn * FIX_STEPS // 2:
                self.send(name)

    def send(self, name):
        """Lets the AUV be located."""
        error = self.random.normal(0.0, FIX_SIGMA, 2)
        delay, again, twice = self.random.random(3)
        if name == SILENT and self.is_silent:
            return
        north, east = (self.auv(name) + error).tolist()
        fix = {"t_s": self.clock, "north_m": north, "east_m": east, "sigma_m": FIX_SIGMA, "depth_m": DEPTH}
        arrival = self.time + DELAY_MAX * delay
        self.on_their_way.append((arrival, name, fix))
        if twice < TWICE:
            self.on_their_way.append((arrival + DELAY_MAX * again, name, fix))

    def heard(self):
        """What the craft has heard since it was last asked, and where it is."""
        auvs = {}
        for arrival, name, fix in self.on_their_way:
            if arrival <= self.time:
                auvs.setdefault(name, []).append(fix)
        self.on_their_way = [late for late in self.on_their_way if late[0] > self.time]
        state = {
            "north_m": float(self.north),
            "east_m": float(self.east),
            "heading_rad": float(self.heading),
            "speed_mps": float(self.speed),
            "yaw_rate_radps": float(self.yaw_rate),
        }
        return {"received_s": self.clock, "auvs": auvs, "asc": [{"t_s": self.clock, "state": state}]}


class NoAnswer(Exception):
    """The server is away, or has too much to do: the same request may have an answer later."""


class Missions:
    """The missions of a server.

    Whatever changes something is asked for under a key, and asked for again under the same key until there is an
    answer: nothing happens twice.
    """

    def __init__(self, url):
        self.url = f"{url}/v1/missions"
        self.session = requests.Session()
        # The environment's proxy does not lead to this machine.
        self.session.trust_env = False

    def post(self, path, body, key):
        """The server's answer."""
        return self.answer("POST", path, json=body, headers={"Idempotency-Key": key}).json()

    def insist(self, path, body, key):
        """The same, asked for as long as patience lasts."""
        end = time.monotonic() + PATIENCE
        while True:
            try:
                return self.post(path, body, key)
            except NoAnswer as error:
                if end < time.monotonic():
                    sys.exit(str(error))
                time.sleep(REST)

    def reference(self, mission):
        """What to steer now; None before the first plan."""
        response = self.answer("GET", f"/{mission}/reference", refusals=("no_plan_yet",))
        return response.json() if response.ok else None

    def answer(self, method, path, refusals=(), **more):
        """The response, if it is none to give up at."""
        url = self.url + path
        try:
            response = self.session.request(method, url, timeout=ANSWER_TIME, **more)
        except requests.RequestException as error:
            raise NoAnswer(f"no answer from {url} ({error}): start a server with `cargo run --release`") from error
        if response.status_code in LATER:
            raise NoAnswer(f"{url} is to be asked again later: {response.text}")
        if not response.ok and response.json().get("code") not in refusals:
            sys.exit(f"{url} refused: {response.text}")
        return response


class Bridge:
    """What the craft's computer remembers, and how it asks."""

    def __init__(self, missions, mission, run):
        self.missions, self.mission, self.run = missions, mission, run
        self.posts = 0
        self.waiting = []  # reports that the server has not acknowledged, with their keys, the newest last
        self.acknowledged = self.retries = 0
        self.reference = None

    def steer(self, clock):
        """Speed and heading when the mission's clock shows `clock`: the last reference, while it is valid."""
        if self.reference is None or clock > self.reference["plan"]["reference"]["valid_until_s"]:
            return None
        reference = self.reference["plan"]["reference"]
        return reference["speed_mps"], reference["heading_rad"]

    def keep(self, clock, heard):
        """Takes up what is to be posted, with whether the craft is steered when the mission's clock shows `clock`."""
        state = "steering" if self.steer(clock) else "not_steering"
        heard["steering"] = [{"t_s": clock, "state": state}]
        self.waiting.append((f"{self.run}-{self.posts}", heard))
        self.posts += 1

    def post(self, end):
        """Posts what waits until there is nothing more, the time is over, or the server away.

        The newest goes first: where the craft is now matters more than where it was.
        """
        try:
            while self.waiting:
                key, heard = self.waiting[-1]
                self.missions.post(f"/{self.mission}/reports", heard, key)
                self.waiting.pop()
                self.acknowledged += 1
                if end <= time.monotonic():
                    return
        except NoAnswer:
            self.retries += 1

    def ask(self):
        """Asks for the reference. Where there is no answer, or no plan since the server was started, the last stays."""
        try:
            self.reference = self.missions.reference(self.mission) or self.reference
        except NoAnswer:
            pass


class Tally:
    """How well it goes, seen once a second."""

    def __init__(self):
        self.distances, self.silence_max = [], 0.0
        self.degraded = self.unguided = 0

    def see(self, world, bridge):
        """Takes a look, and prints a line now and then."""
        distance, reference = world.distance, bridge.reference
        self.distances.append(distance)
        if world.is_silent:
            self.silence_max = max(self.silence_max, distance)
        if bridge.steer(world.clock) is None:
            self.unguided += 1
        elif reference["outcome"] != "ok":
            self.degraded += 1
        if world.steps % (LINE_INTERVAL * STEPS_PER_S) == 0:
            line = f"t_s {world.time:6.0f}  distance_m {distance:6.2f}"
            if reference is None:
                print(f"{line}  outcome none", flush=True)
            else:
                age = world.clock - reference["t_s"]
                print(f"{line}  outcome {reference['outcome']}  method {reference['method']}  age_s {age:.1f}",
                      flush=True)


def new_mission(duration, clock_rate):
    """The mission as the server wants it."""
    auvs = [{
        "id": name,
        "path": {
            "segments": [{
                "kind": "waypoints",
                "points": path(START_EAST[name], duration).tolist(),
                "fillet_m": FILLET,
            }],
            "speed_mps": SPEED_PLANNED,
        },
    } for name in IDS]
    return {
        "schema_version": "1.0",
        "title": "rehearsal in Python",
        "live": {
            "auvs": auvs,
            "goal": {"kind": "midpoint", "auvs": IDS},
            "clock_rate": clock_rate,
            "origin": {"lat_deg": 38.41, "lon_deg": -9.12},  # records as GeoJSON need it
        },
    }


def fly(url, duration, clock_rate, seed):
    """What came of it: the mission's name, what was seen, and who asked."""
    missions = Missions(url)
    run = str(uuid.uuid4())  # keys of this run alone: those of another would bring back what was answered then
    mission = missions.insist("", new_mission(duration, clock_rate), f"{run}-create")
    name, created = mission["id"], mission["created_s"]
    missions.insist(f"/{name}/run", {}, f"{run}-run")

    def clock():
        # With a rate of 1 it is everybody's, and the server's must agree with this computer's.
        return created + clock_rate * (time.time() - created)

    world, bridge, tally = World(clock(), duration, seed), Bridge(missions, name, run), Tally()
    while world.time < duration:
        # As far as the clock is, however long the server took to answer.
        while world.time < duration and world.clock < clock():
            world.step(bridge.steer(world.clock))
            if world.steps % STEPS_PER_S == 0:
                tally.see(world, bridge)
        following = time.monotonic() + max(0.0, world.clock + 1.0 - clock()) / clock_rate
        bridge.keep(world.clock, world.heard())
        bridge.post(following)
        bridge.ask()
        time.sleep(max(0.0, following - time.monotonic()))
    # What is left counts as well.
    end = time.monotonic() + PATIENCE
    while bridge.waiting and time.monotonic() < end:
        bridge.post(end)
        time.sleep(REST)
    missions.insist(f"/{name}/finish", None, f"{run}-finish")
    return name, tally, bridge


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("--url", default="http://127.0.0.1:8080", help="the server (default: %(default)s)")
    parser.add_argument("--duration", type=int, default=900, metavar="S", help="mission time (default: %(default)s)")
    parser.add_argument("--clock-rate", type=int, default=20, metavar="RATE",
                        help="seconds of mission time in one, from 1 to 20 (default: %(default)s)")
    parser.add_argument("--seed", type=int, default=1, help="of the fixes' errors and delays (default: %(default)s)")
    arguments = parser.parse_args()
    if arguments.duration < 1:
        parser.error("--duration must be at least 1")

    name, tally, bridge = fly(arguments.url.rstrip("/"), arguments.duration, arguments.clock_rate, arguments.seed)
    print(f"mission             {name:>10}")
    print(f"rms_m               {np.sqrt(np.mean(np.square(tally.distances))):10.2f}")
    if tally.distances[SETTLED_AFTER:]:
        print(f"settled_rms_m       {np.sqrt(np.mean(np.square(tally.distances[SETTLED_AFTER:]))):10.2f}")
    print(f"silence_max_m       {tally.silence_max:10.2f}")
    print(f"degraded_s          {tally.degraded:10d}")
    print(f"unguided_s          {tally.unguided:10d}")
    print(f"acknowledged        {bridge.acknowledged:10d}")
    print(f"retries             {bridge.retries:10d}")


if __name__ == "__main__":
    main()
