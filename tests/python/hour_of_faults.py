#!/usr/bin/env python3
"""An hour in real time through `pilotfish serve` and `pilotfish bridge mavlink`, with a fault each 90 s.

    python3 tests/python/hour_of_faults.py target/release/pilotfish --minutes 60 --seed 1 --out hour

Needs hour-requirements.txt. A stand-in of ArduPilot's Rover in GUIDED follows an AUV on a lawn-mower pattern. A fault
lasts 30 to 40 s; every kind occurs before one occurs again. A proxy can change the service's answers to the bridge.
Printed: what was sent above the limits, and a row a fault. The directory gets every reference, the true state ten times
a second, what the programs printed and what plans warned of. Places (north, east), m, are complex numbers.
"""

import argparse
import http.client
import itertools
import json
import math
import os
import random
import re
import socket
import statistics
import subprocess
import sys
import tempfile
import threading
import time
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path as File
from typing import NamedTuple

import pandas as pd
from stand_in import (
    ACCELERATION,
    GUIDED,
    HOLD,
    MANUAL,
    PARAMETERS,
    PAUSE_MAX,
    SPEED_MAX,
    STEP,
    TURN_MAX,
    Auv,
    Boat,
    Reference,
    mav,
    wrapped,
)

RISE_MAX = 4 * ACCELERATION  # of speed references, m/s²: docs/at-sea.md
WARM_UP, EACH = 60.0, 90.0  # s
NEAR = 10.0  # m from the AUV

KINDS = {  # by what should follow: nothing is sent; a warning; neither is needed
    "stops": "position stays, position and its clock stay, position 0° 0°, GNSS lost, heading stays, heading missing, "
    "two vehicles with one number, service killed, service silent with a plan for an hour, token revoked, "
    "bridge killed, autopilot restarts, heartbeats cease, HOLD",
    "warns": "position 50 m off, position drifts off at 1 m/s, velocity 0, heading and yaw rate stay, heading 40° off, "
    "rudder amidships, rudder over, no thrust, half thrust, thrust stays, messages 3 s late, "
    "half of the checksums wrong, no fixes, fixes of two vehicles",
    "goes on": "velocity 60 m/s, velocity wrong for 2 s, velocity 0 below 0.5 m/s, messages doubled, "
    "fixes claim 3 mm, a fix 2 km off, AUV reports speed 0, service answers 20 m/s",
}
EXPECTED = {kind: what for what, kinds in KINDS.items() for kind in kinds.split(", ")}


class Fault(NamedTuple):
    """What goes wrong, s since the start."""

    kind: str
    begin: float
    end: float


class Truth(NamedTuple):
    """Craft and AUV at t, s: places, m; the craft's heading, rad, and speed over ground, m/s; their distance, m."""

    t: float
    north: float
    east: float
    heading: float
    speed: float
    auv_north: float
    auv_east: float
    distance: float


class Proxy(BaseHTTPRequestHandler):
    """Passes requests on to the service, and answers back."""

    protocol_version = "HTTP/1.1"

    def pass_on(self) -> None:
        sea, body = self.server.sea, self.rfile.read(int(self.headers.get("content-length", 0)))
        try:
            service = http.client.HTTPConnection("127.0.0.1", sea.port, timeout=10)
            service.request(self.command, self.path, body, dict(self.headers))
            answer = service.getresponse()
            data = answer.read()
            if answer.status == 200 and "/reference" in self.path:
                data = sea.planned(json.loads(data))
            while sea.kind.startswith("service silent") and sea.since > 1:
                time.sleep(0.1)
            self.send_response(answer.status)
            self.send_header("content-type", answer.headers["content-type"] or "")
            self.send_header("content-length", str(len(data)))
            self.end_headers()
            self.wfile.write(data)
        except (OSError, http.client.HTTPException):
            self.close_connection = True  # as without a service

    do_GET = do_POST = pass_on  # noqa: N815

    def log_message(self, *_: object) -> None:
        pass


class Sea:
    """Programs, stand-in and faults, and what happened."""

    def __init__(self, program: File, data: File, draw: random.Random):
        self.program, self.data, self.running, self.draw = program, data, {}, draw
        self.boat, self.auv, self.fault, self.then, self.waiting = Boat(draw), Auv(draw), None, {}, []
        self.references, self.truth, self.said, self.codes, self.planned_max = [], [], [], set(), 0.0
        self.senders = [mav.MAVLink(None, srcSystem=n, srcComponent=1) for n in (1, 2)]
        self.reader, self.socket = mav.MAVLink(None), socket.socket(type=socket.SOCK_DGRAM)
        self.socket.setblocking(False)
        with socket.socket() as tcp, socket.socket(type=socket.SOCK_DGRAM) as udp:
            tcp.bind(("127.0.0.1", 0))
            udp.bind(("127.0.0.1", 0))
            self.port, self.wire = tcp.getsockname()[1], udp.getsockname()
        self.proxy, self.start = ThreadingHTTPServer(("127.0.0.1", 0), Proxy), time.monotonic()
        self.proxy.sea = self
        threading.Thread(target=self.proxy.serve_forever, daemon=True).start()
        (data / "service").mkdir()
        for what in ("token", "service", "bridge"):
            self.begin_again(what)

    now = property(lambda self: time.monotonic() - self.start)
    kind = property(lambda self: self.fault.kind if self.fault else "")
    since = property(lambda self: self.now - self.fault.begin if self.fault else 0.0)

    def token(self, *arguments: str) -> str:
        command = [self.program, "token", *arguments, "--data", self.data / "service"]
        return subprocess.run(command, check=True, capture_output=True, text=True).stdout

    def begin_again(self, what: str) -> None:
        if what == "token":
            (self.data / "token").write_text(self.token("add", "bridge", "--role", "operator"))
            return
        command = f"serve --port {self.port} --data service"
        if what == "bridge":
            wires = f"--connect udp:127.0.0.1:{self.wire[1]} --url http://127.0.0.1:{self.proxy.server_port}"
            command = f"bridge mavlink --auv 2=auv-1 --name hour --token-file token {wires}"
        options = {"stdout": subprocess.PIPE, "stderr": subprocess.STDOUT, "env": os.environ | {"NO_COLOR": "1"}}
        process = subprocess.Popen([self.program, *command.split()], cwd=self.data, text=True, **options)
        self.running[what] = process
        threading.Thread(target=self.listen, args=[what, process.stdout], daemon=True).start()

    def listen(self, what: str, printed: object) -> None:
        for line in printed:
            self.said.append((self.now, what, line.strip()))

    def planned(self, answer: dict) -> bytes:
        """An answer with a plan, as the bridge gets it; takes down new warnings."""
        plan = answer["plan"]
        codes, self.codes = self.codes, {warning["code"] for warning in plan["warnings"]}
        self.said += [(self.now, "plan", code) for code in sorted(self.codes - codes)]
        self.planned_max = max(self.planned_max, plan["reference"]["speed_mps"])
        if self.kind == "service answers 20 m/s":
            for point in (plan["reference"], *plan["trajectory"]):
                point["speed_mps"] = 20.0
        if self.kind.startswith("service silent"):
            plan["reference"]["valid_until_s"] += 3600
        return json.dumps(answer).encode()

    def send(self, sender: int, message: mav.MAVLink_message) -> None:
        frame = bytearray(message.pack(self.senders[sender]))
        if self.kind == "half of the checksums wrong" and self.draw.random() < 0.5:
            frame[-1] ^= 0xFF
        due = self.now + 3.0 * (self.kind == "messages 3 s late")
        self.waiting += [(due, frame)] * (1 + (self.kind == "messages doubled"))

    def exchange(self, is_second: bool) -> None:
        """Sends what is due and takes what has come."""
        now, boat, heard = self.now, self.boat, []
        if boat.booted <= now:
            for message in boat.messages(now, self.kind, self.since, self.then, is_second):
                self.send(0, message)
        for message in self.auv.messages(now, self.kind):
            self.send(1, message)
        for _, frame in [late for late in self.waiting if late[0] <= self.now]:
            self.socket.sendto(frame, self.wire)
        self.waiting = [late for late in self.waiting if late[0] > self.now]
        try:
            while True:
                heard += self.reader.parse_buffer(self.socket.recv(8192)) or []
        except BlockingIOError:
            pass  # there is no more
        for message in heard:
            if message.get_type() == "PARAM_REQUEST_READ" and message.param_id in PARAMETERS:
                value = (message.param_id.encode(), PARAMETERS[message.param_id], 9, 9, 1)
                self.send(0, mav.MAVLink_param_value_message(*value))
            elif message.get_type() == "SET_POSITION_TARGET_LOCAL_NED":
                speed = abs(complex(message.vx, message.vy))
                boat.asked = Reference(now, 1e-3 * message.time_boot_ms, speed, message.yaw)
                self.references.append(boat.asked)
        here, there = boat.place, self.auv.place
        moves = (boat.heading, abs(boat.velocity))
        self.truth.append(Truth(now, here.real, here.imag, *moves, there.real, there.imag, abs(here - there)))

    def begin(self, fault: Fault) -> None:
        self.fault, self.then, self.auv.fixes = fault, self.boat.said, 0
        match fault.kind.split():
            case [("service" | "bridge") as what, "killed"]:
                self.running[what].kill()
            case ["token", _]:
                self.token("revoke", "bridge")
            case ["HOLD"]:
                self.boat.mode = HOLD
            case ["autopilot", _]:
                self.boat.booted, self.boat.mode, self.boat.is_armed = self.now + 5, MANUAL, False

    def end(self, fault: Fault) -> None:
        self.fault, self.boat.mode, self.boat.is_armed = None, GUIDED, True
        if fault.kind in ("service killed", "bridge killed", "token revoked"):
            self.begin_again(fault.kind.split()[0])

    def sail(self, faults: list[Fault]) -> None:
        due = [(at, do, f) for f in faults for at, do in ((f.begin, self.begin), (f.end, self.end))]
        for tick in range(round((WARM_UP + EACH * len(faults)) / STEP)):
            time.sleep(max(0.0, tick * STEP - self.now))
            if due and due[0][0] <= self.now:
                _, do, fault = due.pop(0)
                do(fault)
            self.boat.step(self.now, self.kind)
            self.auv.step()
            if tick % 2 == 0:
                self.exchange(is_second=tick % 20 == 0)

    def above_limits(self) -> str:
        """How many references are above the limits, and the most."""
        sent, truth = pd.DataFrame(self.references), pd.DataFrame(self.truth)[["t", "speed", "heading"]]
        elapsed, turn, rise = sent.bridge_s.diff(), sent.heading.diff().map(wrapped).abs(), sent.speed.diff()
        goes_on = elapsed.between(0.0, PAUSE_MAX, inclusive="right")
        slack = elapsed + 0.001  # the bridge states its clock in ms
        fast = {
            f"above {SPEED_MAX} m/s": (sent.speed > SPEED_MAX + 1e-4, sent.speed),
            "turn too fast, rad/s": (goes_on & (turn > TURN_MAX * slack + 1e-4), (turn / elapsed)[goes_on]),
            "rise too fast, m/s²": (goes_on & (rise > RISE_MAX * slack + 1e-4), (rise / elapsed)[goes_on]),
        }
        first = pd.merge_asof(sent[~goes_on], truth, on="t")
        faster, off = first.speed_x - first.speed_y, (first.heading_x - first.heading_y).map(wrapped).abs()
        self.n_above = sum(above.sum() for above, _ in fast.values())
        found = "; ".join(f"{name}: {above.sum()}, at most {value.max():.3f}" for name, (above, value) in fast.items())
        return (
            f"{len(sent)} references; {found}; {len(first)} after a pause, at most {faster.max():.2f} m/s above the "
            f"craft's speed and {off.max():.2f} rad off its bow. Plans ask for at most {self.planned_max:.4f} m/s."
        )

    def told(self) -> list[tuple[float, str]]:
        """Warnings, why nothing is sent, and counts that grow in the status line."""
        found, counts = [], {}
        for now, who, line in self.said:
            text = re.sub(r"^\S+Z +(INFO|WARN|ERROR) \S+: ", "", line).removeprefix("warning: ")
            if re.search(r"^steering|^not steering|^NOT STEERING|^DEGRADED|^dry run| heard \d", text):
                rejected = text.partition("rejected: ")[2].partition("references limited")[0]
                for name, count in re.findall(r"([A-Za-z0-9 ']+): (\d+)", rejected):
                    found += [(now, f"counts {name.strip()}")] * (int(count) > counts.get(name, 0) + 4)
                    counts[name] = int(count)
            elif who == "plan":
                found.append((now, f"`{text}`"))
            elif who == "bridge" and not re.search("^over: |are sent$|answers again|origin|url=|waiting for", text):
                found.append((now, re.split("[:;] ", text)[0]))
        return found

    def row(self, number: int, fault: Fault, told: list[tuple[float, str]]) -> str:
        """A fault's row of the table."""
        kind, begin, end = fault
        sent = [-math.inf, *(reference.t for reference in self.references), math.inf]
        gaps = [max(a, begin) - begin for a, b in itertools.pairwise(sent) if a < end and b - max(a, begin) > 1]
        back = next(at for at in sent if at >= end) - end
        stopped = (f"{gaps[0]:.1f}", f"{back:.1f}") if gaps else ("–", "–")
        share = sum(begin <= at < end for at in sent) / (10 * (end - begin))
        seen = [craft for craft in self.truth if begin <= craft.t < begin + EACH]
        near = next((f"{at.t - end:.1f}" for at in seen if at.t >= end and at.distance <= NEAR), "not")
        texts = {text: at - begin for at, text in reversed(told) if begin <= at < end + 5}
        said = "; ".join(f"{at:.1f} {text}" for text, at in reversed(texts.items())) or "–"
        distances = f"{seen[0].distance:.1f} | {max(craft.distance for craft in seen):.1f}"
        does = f"{kind} | {EXPECTED[kind]} | {end - begin:.0f} | {share:.0%} | {stopped[0]} | {said}"
        return f"| {number} | {does} | {distances} | {stopped[1]} | {near} |"


def main() -> None:
    """Sails the hour and prints its table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("program", type=File, help="the program")
    parser.add_argument("--minutes", type=float, default=60.0, help="a fault each 90 s [default: 60]")
    parser.add_argument("--seed", type=int, default=1, help="of faults and noise [default: 1]")
    parser.add_argument("--out", type=File, default=File("hour-of-faults"), help="directory of the records")
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    draw, kinds, faults = random.Random(arguments.seed), [], []
    for begin in range(int(WARM_UP), int(WARM_UP + 60 * arguments.minutes - EACH / 2), int(EACH)):
        kinds = kinds or draw.sample(list(EXPECTED), len(EXPECTED))
        faults.append(Fault(kinds.pop(), begin, begin + draw.uniform(30, 40)))
    with tempfile.TemporaryDirectory() as data:
        sea = Sea(arguments.program.resolve(), File(data), draw)
        try:
            sea.sail(faults)
        finally:
            for process in sea.running.values():
                process.terminate()
                process.wait()
            for name, rows in (("references", sea.references), ("truth", sea.truth), ("said", sea.said)):
                pd.DataFrame(rows).to_csv(arguments.out / f"{name}.csv", index=False)
    told = sea.told()
    rest = [text for at, text in told if at > WARM_UP and not any(f.begin <= at < f.end + 5 for f in faults)]
    quiet = [craft.distance for craft in sea.truth if not any(f.begin <= craft.t < f.end + 30 for f in faults)]
    print(sea.above_limits(), f"Median distance without a fault for 30 s: {statistics.median(quiet):.1f} m.")
    print("\n| | fault | should | s | sent | stops after, s | says after, s | m before | at most | back, s | near, s |")
    print("|---" * 11 + "|", *(sea.row(k, fault, told) for k, fault in enumerate(faults, 1)), sep="\n")
    print("\nSaid without a fault:", rest or "nothing")
    sys.exit(1 if sea.n_above else 0)


if __name__ == "__main__":
    main()
