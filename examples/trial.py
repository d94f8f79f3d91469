"""Sails the trial of docs/commissioning.md with an ArduPilot Rover, and writes the log that `pilotfish identify` reads.

Needs pymavlink, for a serial port pyserial, too. python3 examples/trial.py --connect /dev/ttyACM0,115200 --top 1.5 --log trial.csv
It waits for GUIDED, sends references of speed and heading for 26 minutes, and ends when the mode changes: keep the mode switch in your hand.
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
STEP = 0.1  # s between two references
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
wire.wait_heartbeat()
wire.mav.command_long_send(wire.target_system, wire.target_component, 511, 0, 33, 1e6 * STEP * 2, 0, 0, 0, 0, 0)  # GLOBAL_POSITION_INT
print("switch to GUIDED, armed; any other mode ends the trial", flush=True)
boat = wire.target_system
while True:
    heartbeat = wire.recv_match(type="HEARTBEAT", blocking=True)
    if heartbeat.get_srcSystem() == boat and heartbeat.custom_mode == GUIDED and heartbeat.base_mode & 128:
        break

began = time.monotonic()
with open(arguments.log, "w", newline="") as file:
    rows = csv.writer(file)
    names = ("reference_speed_mps", "reference_heading_deg", "heading_deg", "ground_north_mps", "ground_east_mps")
    rows.writerow(("t_s", *names))
    step_ends = 0.0
    for lasts, share, from_course, turn_rate in steps():
        step_began, step_ends = step_ends, step_ends + lasts * (arguments.longer if not turn_rate else 1)
        print(f"{step_began:5.0f} s: {share * arguments.top:.2f} m/s, heading {(arguments.course + from_course) % 360:3.0f}°", flush=True)
        while (now := time.monotonic() - began) < min(step_ends, 60 * arguments.minutes):
            speed = share * arguments.top
            heading = (arguments.course + from_course + turn_rate * (now - step_began)) % 360
            yaw = math.remainder(math.radians(heading), math.tau)
            wire.mav.set_position_target_local_ned_send(
                0, boat, wire.target_component, 1, VELOCITY_AND_YAW, 0, 0, 0, speed, 0, 0, 0, 0, 0, yaw, 0
            )
            while message := wire.recv_match(type=["GLOBAL_POSITION_INT", "HEARTBEAT"]):
                if message.get_srcSystem() != boat:
                    continue
                if message.get_type() == "GLOBAL_POSITION_INT":
                    at = f"{time.monotonic() - began:.3f}"
                    rows.writerow((at, f"{speed:.3f}", f"{heading:.2f}", message.hdg / 100, message.vx / 100, message.vy / 100))
                elif message.custom_mode != GUIDED or not message.base_mode & 128:
                    raise SystemExit(f"the autopilot left GUIDED, or is disarmed: the trial ends; {arguments.log} has what was sailed")
            time.sleep(STEP)
