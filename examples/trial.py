"""Sails the trial of docs/commissioning.md with an ArduPilot Rover, and writes the log that `pilotfish identify` reads.

Needs pymavlink, for a serial port pyserial, too. python3 examples/trial.py --connect /dev/ttyACM0,115200 --top 1.5 --log trial.csv
It waits for positions and GUIDED, sends references of speed and heading for 26 minutes, and ends when the mode changes: keep the mode switch in your
hand. It also ends after 3 s without a heartbeat or a position of the autopilot.
To try it without a boat: python3 examples/boat.py --lag 2 & python3 examples/trial.py --connect udpin:127.0.0.1:14560 --top 1.2 --log trial.csv
"""

import argparse
import csv
import math
import os
import time
from collections.abc import Iterator

os.environ["MAVLINK20"] = "1"
from pymavlink import mavutil

GUIDED = 15
AUTOPILOT = 1  # its component; companions and gimbals of the boat send heartbeats, too
STEP = 0.1  # s between two references
SILENCE_MAX = 3.0  # s
VELOCITY_AND_YAW = 2503  # type_mask: the rest is ignored

parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
parser.add_argument("--connect", required=True, help="the autopilot: DEVICE,BAUD or udpin:HOST:PORT or tcp:HOST:PORT")
parser.add_argument("--top", type=float, required=True, help="the fastest speed that you will plan with, m/s")
parser.add_argument("--turn-rate", type=float, default=20, help="your turn rate, °/s (default: 20)")
parser.add_argument("--course", type=float, default=0, help="course with room ahead, ° (default: 0)")
parser.add_argument("--longer", type=float, default=1, help="holds every step so many times as long: 2 for lags above 5 s")
parser.add_argument("--log", default="trial.csv", help="CSV file to write")
parser.add_argument("--minutes", type=float, default=math.inf, help="ends after so many minutes")
arguments = parser.parse_args()


def steps() -> Iterator[tuple[float, float, float, float]]:
    """Time, s; speed as a share of the top speed; heading from the course, °; its rate of turn, °/s."""
    speeds = [(30, share) for share in (0.6, 0.5, 0.4, 0.5)] + [(45, share) for share in (0.25, 0.85, 0.25, 0.85, 0.25)]
    for heading in (0, 170):
        yield 60, 0.5, heading, 0
        for time_s, share in speeds:
            yield time_s, share, heading, 0
    for turn in (0, 10, 0, -30, 0, 60, 0, 90, 180, -20, 0):
        yield 35, 0.5, 170 + turn, 0
    for turn in (20, -20, 20, -20, 45, -45, 45, -45):
        yield 15, 0.5, 170 + turn, 0
    for side in (1, -1):
        yield 30, 0.5, 170, 0
        yield 400 / (arguments.turn_rate / 2), 0.5, 170, side * arguments.turn_rate / 2
    yield 120, 0, 170, 0


device, *baud = arguments.connect.split(",")
wire = mavutil.mavlink_connection(device, *map(int, baud), source_system=255)
while not (boat := wire.target_system):  # a ground station's heartbeat does not set it
    wire.wait_heartbeat()
heard = dict.fromkeys(("HEARTBEAT", "GLOBAL_POSITION_INT"), -math.inf)  # when the autopilot sent the last one, s
guided, logged = False, 0


def positions() -> Iterator[mavutil.mavlink.MAVLink_global_position_int_message]:
    """The positions that arrived since the last call; notes the mode on the way."""
    global guided
    while message := wire.recv_match(type=list(heard)):
        if (message.get_srcSystem(), message.get_srcComponent()) != (boat, AUTOPILOT):
            continue
        heard[message.get_type()] = time.monotonic()
        if message.get_type() == "HEARTBEAT":
            guided = message.custom_mode == GUIDED and bool(message.base_mode & 128)
        else:
            yield message


def missing() -> str:
    """What the trial lacks, or nothing."""
    silent = [name for name, at in heard.items() if time.monotonic() - at > SILENCE_MAX]
    return f"no {silent[0]} of the autopilot" if silent else "" if guided else "the autopilot is not in GUIDED, or disarmed"


print("switch to GUIDED, armed; any other mode ends the trial", flush=True)
asked, said = -math.inf, ""
while lack := missing():
    if time.monotonic() - asked > 1:
        asked = time.monotonic()
        wire.mav.command_long_send(boat, AUTOPILOT, 511, 0, 33, 1e6 * STEP * 2, 0, 0, 0, 0, 0)  # GLOBAL_POSITION_INT
    time.sleep(STEP)
    for _ in positions():
        pass
    if lack != said:
        said = lack
        print(f"waiting: {lack}", flush=True)

began, limit = time.monotonic(), 60 * arguments.minutes
with open(arguments.log, "w", newline="") as file:
    rows = csv.writer(file)
    names = ("reference_speed_mps", "reference_heading_deg", "heading_deg", "ground_north_mps", "ground_east_mps")
    rows.writerow(("t_s", *names))
    step_ends = 0.0
    for lasts, share, from_course, turn_rate in steps():
        step_began, step_ends = step_ends, step_ends + lasts * (arguments.longer if not turn_rate else 1)
        if step_began >= limit or missing():
            break
        print(f"{step_began:5.0f} s: {share * arguments.top:.2f} m/s, heading {(arguments.course + from_course) % 360:3.0f}°", flush=True)
        while (now := time.monotonic() - began) < min(step_ends, limit) and not missing():
            speed = share * arguments.top
            heading = (arguments.course + from_course + turn_rate * (now - step_began)) % 360
            yaw = math.remainder(math.radians(heading), math.tau)
            wire.mav.set_position_target_local_ned_send(0, boat, AUTOPILOT, 1, VELOCITY_AND_YAW, 0, 0, 0, speed, 0, 0, 0, 0, 0, yaw, 0)
            for position in positions():
                measured = "" if position.hdg == 65535 else position.hdg / 100
                at = f"{time.monotonic() - began:.3f}"
                rows.writerow((at, f"{speed:.3f}", f"{heading:.2f}", measured, position.vx / 100, position.vy / 100))
                logged += 1
            time.sleep(STEP)
lack = missing()
print(f"{arguments.log} has {logged} positions", flush=True)
if lack:
    raise SystemExit(f"the trial ended early: {lack}")
