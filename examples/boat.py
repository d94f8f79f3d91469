"""A boat and an AUV that speak MAVLink like ArduPilot's Rover: for a first try of `pilotfish bridge` without a craft.

Needs pymavlink. The bridge listens: pilotfish bridge mavlink --connect udp:127.0.0.1:14560 --auv 2=auv-1 --name rehearsal
With --modem the boat has an EvoLogics USBL, too, which hears two AUVs: --modem tcp:127.0.0.1:9200=examples/usbl.json
`kill -USR1` moves the mode switch (GUIDED, HOLD, GUIDED, …); `kill -USR2` silences the AUVs, or lets them be heard again.
Places and velocities (north, east), m and m/s, are complex numbers; headings are clockwise from north, rad.
"""

import argparse
import cmath
import math
import os
import random
import signal
import socket
import time

os.environ["MAVLINK20"] = "1"
from pymavlink.dialects.v20 import ardupilotmega as mav

ORIGIN = (38.41, -9.12)  # latitude and longitude, °
DEGREE = (111_000.0, 111_320.0 * math.cos(math.radians(ORIGIN[0])))  # m of latitude, of longitude
GUIDED, HOLD = 15, 4
SPEED_MAX, TURN_MAX, ACCELERATION = 1.2, 0.8, 0.5  # m/s, rad/s, m/s²
PARAMETERS = {"WP_SPEED": SPEED_MAX, "ATC_STR_RAT_MAX": math.degrees(TURN_MAX), "ATC_ACCEL_MAX": ACCELERATION}
PARAMETERS |= {"ATC_DECEL_MAX": ACCELERATION, "ATC_SPEED_I": 0.2, "GUID_OPTIONS": 0.0, "CRUISE_SPEED": SPEED_MAX}
PARAMETERS |= {"SERVO1_FUNCTION": 73.0, "SERVO3_FUNCTION": 74.0}
PARAMETERS |= {"FS_ACTION": 2.0, "FS_GCS_ENABLE": 0.0, "FENCE_ENABLE": 1.0}
REFERENCE_MAX = 3.0  # a boat without a reference stops after this time, s
STEP = 0.1  # s


def clamp(value: float, most: float) -> float:
    return max(-most, min(most, value))


def wrapped(angle: float) -> float:
    return (angle + math.pi) % math.tau - math.pi


def degrees(place: complex) -> tuple[int, int]:
    """Latitude and longitude, 1e-7°."""
    return round(1e7 * (ORIGIN[0] + place.real / DEGREE[0])), round(1e7 * (ORIGIN[1] + place.imag / DEGREE[1]))


def auv(t: float) -> complex:
    """A lane of 120 m to the north and back, at 0.5 m/s."""
    along = 0.5 * t % 240
    return complex(min(along, 240 - along), 10)


parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
parser.add_argument("--host", default="127.0.0.1", help="machine of the bridge")
parser.add_argument("--port", type=int, default=14560, help="UDP port of the bridge")
parser.add_argument("--modem", type=int, help="TCP port on which a USBL modem says where two AUVs are, every five seconds in turn")
parser.add_argument("--lag", type=float, default=STEP, help="time constant of speed and heading, s")
parser.add_argument("--duration", type=float, default=math.inf, help="s")
parser.add_argument("--start", type=complex, default=-20 - 20j, help="where the boat begins, north+eastj, m (default: -20-20j)")
parser.add_argument("--dived-at", type=float, help="Unix time at which the AUVs began; give two boats the same (default: now)")
arguments = parser.parse_args()
usbl = socket.create_server(("", arguments.modem)) if arguments.modem else None
listeners: list[socket.socket] = []
if usbl:
    usbl.setblocking(False)
wire = socket.socket(type=socket.SOCK_DGRAM)
wire.setblocking(False)
boat, submarine = (mav.MAVLink(None, srcSystem=system, srcComponent=1) for system in (1, 2))
reader = mav.MAVLink(None)
place, heading, speed = arguments.start, 0.0, 0.0
asked, asked_at, began, tick = (0.0, 0.0), -math.inf, time.monotonic(), 0
ahead = 0.0 if arguments.dived_at is None else time.time() - arguments.dived_at  # of the AUVs' time, s
mode, heard = GUIDED, True


def send(sender: mav.MAVLink, message: mav.MAVLink_message) -> None:
    try:
        wire.sendto(message.pack(sender), (arguments.host, arguments.port))
    except OSError:
        pass  # in a container: the bridge has no name yet


def under_water(t: float, which: int) -> complex:
    """One of two lanes of 120 m, 50 m apart, at 0.5 m/s, the second 20 m ahead."""
    along = (0.5 * t + 20 * which) % 240
    return complex(min(along, 240 - along), 10 + 50 * which)


def usbllong(address: int, from_modem: complex, down: float) -> bytes:
    """What the modem prints of a signal that arrived just now: east, north and up, turned by its own compass."""
    east, north = (part + random.gauss(0, 1) for part in (from_modem.imag, from_modem.real))
    propagation_us = 1e6 * math.hypot(east, north, down) / 1500
    now = time.time()
    where = f"{east:.4f},{north:.4f},{-down:.4f}"
    return f"USBLLONG,{now:.6f},{now:.6f},{address},{where},{where},0,0,0,{propagation_us:.0f},-36,77,1.4\r\n".encode()


def moved(*_: object) -> None:
    """A person moves the mode switch."""
    global mode
    mode = HOLD if mode == GUIDED else GUIDED
    print("HOLD" if mode == HOLD else "GUIDED", flush=True)


def silenced(*_: object) -> None:
    """The AUVs go silent, or are heard again."""
    global heard
    heard = not heard
    print("the AUVs are heard" if heard else "the AUVs are silent", flush=True)


def say(line: bytes) -> None:
    """Prints a line of the modem to everyone who is connected."""
    try:
        listeners.append(usbl.accept()[0])
    except BlockingIOError:
        pass
    for one in list(listeners):
        try:
            one.sendall(line)
        except OSError:
            listeners.remove(one)


signal.signal(signal.SIGUSR1, moved)
signal.signal(signal.SIGUSR2, silenced)
while (t := tick * STEP) < arguments.duration:
    follows = mode == GUIDED and t - asked_at < REFERENCE_MAX
    share = min(1.0, STEP / arguments.lag)
    speed += clamp(share * ((asked[0] if follows else 0.0) - speed), ACCELERATION * STEP)
    heading = wrapped(heading + clamp(share * wrapped(asked[1] - heading) if follows else 0.0, TURN_MAX * STEP))
    velocity = cmath.rect(speed, heading)
    place += velocity * STEP
    ms, cm_s = round(1000 * t) + 1, [round(100 * part) for part in (velocity.real, velocity.imag, 0.0)]
    course = round(100 * math.degrees(heading)) % 36_000
    send(boat, mav.MAVLink_global_position_int_message(ms, *degrees(place), 0, 0, *cm_s, course))
    send(boat, mav.MAVLink_attitude_message(ms, 0, 0, heading, 0, 0, 0))
    if tick % 10 == 0:
        send(
            boat,
            mav.MAVLink_heartbeat_message(
                mav.MAV_TYPE_SURFACE_BOAT, mav.MAV_AUTOPILOT_ARDUPILOTMEGA, 0x81, mode, 4, 3
            ),
        )
        send(boat, mav.MAVLink_system_time_message(round(1e6 * time.time()), ms))
        send(boat, mav.MAVLink_ekf_status_report_message(0x7B, 0, 0, 0, 0, 0))
    if tick % 50 == 0:
        rest = (-10, [0] * 3, [0] * 3, [1, 0, 0, 0], [0] * 3, [1.5] * 3, 0)
        dive = t + ahead
        if heard:
            send(submarine, mav.MAVLink_follow_target_message(ms, 1, *degrees(auv(dive)), *rest))
        if usbl and heard:
            which = tick // 50 % 2
            say(usbllong(which + 2, under_water(dive, which) - place, 8.0 + 4 * which))
        print(
            f"{t:5.0f} s: {speed:.2f} m/s, heading {math.degrees(heading) % 360:3.0f}°, {abs(place - auv(dive)):5.1f} m from the AUV",
            flush=True,
        )
    try:
        while True:
            for message in reader.parse_buffer(wire.recv(8192)) or []:
                if message.get_type() == "PARAM_REQUEST_READ" and message.param_id in PARAMETERS:
                    send(
                        boat,
                        mav.MAVLink_param_value_message(
                            message.param_id.encode(), PARAMETERS[message.param_id], 9, 9, 1
                        ),
                    )
                elif message.get_type() == "SET_POSITION_TARGET_LOCAL_NED":
                    asked, asked_at = (math.hypot(message.vx, message.vy), message.yaw), t
                elif message.get_type() == "STATUSTEXT":
                    print(f"the ground station reads: {message.text}", flush=True)
    except (BlockingIOError, ConnectionRefusedError):
        pass  # no more messages, or no bridge yet
    tick += 1
    time.sleep(max(0.0, began + tick * STEP - time.monotonic()))
