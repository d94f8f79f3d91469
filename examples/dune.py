"""A surface craft and an AUV as DUNE shows them on IMC, for rehearsals at a desk: `pip install imcpy` (CPython 3.11).

The craft announces itself as asv-1, follows References in the manoeuvre FollowReference as DUNE does (within 15 m of a
place it stops; without References it gives up), and hears lauv-1 by a USBL modem every four seconds. It is a stand-in:
nothing of DUNE runs.

    python3 examples/dune.py --at 60=stop --at 80=start --at 120=restart

Each line has the time, s, the mode, place (north, east), m, speed, m/s, course, degrees, the distance from the AUV, m,
and the References of that second.
"""

import argparse
import math
import random
import socket
import time

import imcpy

GROUP, PORTS = "224.0.75.69", range(30100, 30105)
PILOTFISH, ANYBODY = 0x4F15, 0xFFFF
LAT, LON, EARTH = math.radians(41.185), math.radians(-8.705), 6_378_137.0
SERVICE, MANEUVER, BOOT = 0, 3, 5
FOLLOW_REFERENCE, NONE = 478, 0xFFFF
TOLERANCE = 15.0
STEP = 0.1


class Craft:
    """A boat with first-order loops of course and speed, and DUNE's supervisor, plan engine and FollowReference."""

    def __init__(self):
        self.north, self.east, self.course, self.speed, self.turn = 0.0, 0.0, 1.0, 0.0, 0.0
        self.target = None
        self.boot(3.0)

    def boot(self, ready_at):
        self.mode, self.spec, self.reference, self.heard, self.error = BOOT, None, None, 0.0, ""
        self.ready_at = ready_at

    def start(self, spec, now):
        self.mode, self.spec, self.reference, self.heard, self.error = MANEUVER, spec, None, now, ""

    def stop(self, error=""):
        self.mode, self.spec, self.reference, self.error = SERVICE, None, None, error

    def refer(self, message, now):
        """Takes a Reference, if it is from the system in control."""
        if self.mode == MANEUVER and self.spec.control_src in (ANYBODY, message.src):
            self.reference, self.heard = message, now
            if message.flags & 0x80:
                self.stop()
            return True
        return False

    def step(self, now):
        if self.mode == BOOT and now >= self.ready_at:
            self.mode = SERVICE
        if self.mode == MANEUVER and now - self.heard > self.spec.timeout:
            self.stop("reference source timed out")
        speed, course = 0.0, self.course
        if self.mode == MANEUVER and self.reference is not None:
            north = (self.reference.lat - LAT) * EARTH - self.north
            east = (self.reference.lon - LON) * EARTH * math.cos(LAT) - self.east
            if math.hypot(north, east) >= TOLERANCE:
                speed, course = min(self.reference.speed.value, 2.0), math.atan2(east, north)
        self.speed += STEP * (speed - self.speed) / 1.5
        self.turn = max(-0.5, min(0.5, math.remainder(course - self.course, math.tau) / 1.5))
        self.course = math.remainder(self.course + STEP * self.turn, math.tau)
        self.north += STEP * self.speed * math.cos(self.course)
        self.east += STEP * self.speed * math.sin(self.course)


class Network:
    """Sockets, and the addresses of those who announce themselves."""

    def __init__(self, address, number):
        self.number = number
        self.own = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.own.bind((address, 0))
        self.group = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        for port in PORTS:
            try:
                self.group.bind(("", port))
                break
            except OSError:
                continue
        self.group.setsockopt(
            socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, socket.inet_aton(GROUP) + socket.inet_aton(address)
        )
        for one in (self.own, self.group):
            one.setblocking(False)
        self.peers = {}

    def address(self):
        return "{}:{}".format(*self.own.getsockname())

    def send(self, message, to=ANYBODY):
        message.src, message.dst, message.timestamp = self.number, to, time.time()
        packet = message.serialize()
        if isinstance(message, imcpy.Announce):
            for port in PORTS:
                self.own.sendto(packet, (GROUP, port))
        for address in self.peers.values():
            self.own.sendto(packet, address)

    def receive(self):
        for one in (self.own, self.group):
            while True:
                try:
                    packet, _ = one.recvfrom(65535)
                except BlockingIOError:
                    break
                message = imcpy.Packet.deserialize(packet)
                if message.src == self.number:
                    continue
                if isinstance(message, imcpy.Announce):
                    for service in message.services.split(";"):
                        if service.startswith("imc+udp://"):
                            host, port = service.removeprefix("imc+udp://").rstrip("/").split(":")
                            self.peers[message.src] = (host, int(port))
                yield message


def vehicle_state(craft):
    state = imcpy.VehicleState()
    state.op_mode = type(state.op_mode)(craft.mode)
    state.maneuver_type = FOLLOW_REFERENCE if craft.mode == MANEUVER else NONE
    state.last_error = craft.error
    return state


def estimated_state(craft):
    state = imcpy.EstimatedState()
    state.lat, state.lon, state.x, state.y = LAT, LON, craft.north, craft.east
    state.psi, state.r, state.u = craft.course, craft.turn, craft.speed
    state.vx, state.vy = craft.speed * math.cos(craft.course), craft.speed * math.sin(craft.course)
    state.alt = -1.0
    return state


def usbl_fix(auv):
    fix = imcpy.UsblFixExtended()
    fix.target, fix.z, fix.accuracy = "lauv-1", 5.0, 1.0
    fix.z_units = type(fix.z_units)(1)
    fix.lat = LAT + (auv[0] + random.gauss(0.0, 0.7)) / EARTH
    fix.lon = LON + (auv[1] + random.gauss(0.0, 0.7)) / EARTH / math.cos(LAT)
    return fix


def announce(address):
    said = imcpy.Announce()
    said.sys_name, said.sys_type, said.services = "asv-1", type(said.sys_type)(3), f"imc+udp://{address}/"
    return said


def plan_control(craft, asked, now, refuses):
    """DUNE's answers to a request: a started manoeuvre names who controls it, a refused plan its reason."""
    if asked.type != imcpy.PlanControl.TypeEnum.REQUEST:
        return []
    operation = int(asked.op)
    if operation in (0, 2) and refuses:
        answer = imcpy.PlanControl()
        answer.type, answer.op, answer.plan_id = imcpy.PlanControl.TypeEnum.FAILURE, asked.op, asked.plan_id
        answer.info = "maneuver FollowReference is not supported"
        return [answer]
    if operation == 0:
        craft.start(asked.arg, now)
        return [asked.arg]
    if operation == 1:
        craft.stop()
    if operation == 2:
        loaded = imcpy.PlanControlState()
        loaded.state, loaded.plan_id = type(loaded.state)(1), asked.plan_id
        return [loaded]
    return []


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--address", default="127.0.0.1", help="address of this computer on the network")
    parser.add_argument("--number", type=int, default=0x0C01, help="of the craft as a system of IMC")
    parser.add_argument("--at", action="append", default=[], help="SECOND=stop, start, restart or silent")
    parser.add_argument("--seconds", type=float, default=math.inf)
    parser.add_argument("--refuses", action="store_true", help="FollowReference is disabled")
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    random.seed(arguments.seed)
    events = sorted((float(second), event) for second, event in (at.split("=") for at in arguments.at))
    network, craft, begin = Network(arguments.address, arguments.number), Craft(), time.monotonic()
    auv, step, references, silent_until = [30.0, 20.0], 0, 0, 0.0
    while step * STEP < arguments.seconds:
        now = time.monotonic() - begin
        while events and events[0][0] <= now:
            _, event = events.pop(0)
            print(f"{now:6.1f} operator or fault: {event}", flush=True)
            if event == "stop":
                craft.stop("stopped by the operator")
            elif event == "start":
                spec = imcpy.FollowReference()
                spec.control_src, spec.control_ent, spec.timeout = PILOTFISH, 0xFF, 2.5
                craft.start(spec, now)
            else:
                silent_until = now + 5.0
                if event == "restart":
                    craft.boot(now + 8.0)
        is_heard = now >= silent_until
        for message in network.receive():
            if not is_heard:
                continue
            if isinstance(message, imcpy.Reference):
                references += craft.refer(message, now)
            elif isinstance(message, imcpy.PlanControl):
                for answer in plan_control(craft, message, now, arguments.refuses):
                    network.send(answer)
            elif isinstance(message, imcpy.LogBookEntry):
                print(f"{now:6.1f} log book: {message.text}", flush=True)
        craft.step(now)
        heading = 0.4 if (now // 60) % 2 == 0 else -1.1
        auv[0] += STEP * 0.7 * math.cos(heading)
        auv[1] += STEP * 0.7 * math.sin(heading)
        if is_heard:
            network.send(estimated_state(craft))
            if step % 10 == 0:
                network.send(vehicle_state(craft))
                network.send(imcpy.Heartbeat())
            if step % 40 == 0:
                network.send(usbl_fix(auv))
            if step % 20 == 0:
                network.send(announce(network.address()))
        if step % 10 == 0:
            name = {SERVICE: "SERVICE", MANEUVER: "FollowReference", BOOT: "BOOT"}[craft.mode]
            away = math.hypot(craft.north - auv[0], craft.east - auv[1])
            print(
                f"{now:6.1f} {name:15} {craft.north:7.1f} {craft.east:7.1f} {craft.speed:5.2f} m/s "
                f"{math.degrees(craft.course) % 360:4.0f} deg {away:6.1f} m from the AUV, {references} references",
                flush=True,
            )
            references = 0
        step += 1
        time.sleep(max(0.0, begin + step * STEP - time.monotonic()))


if __name__ == "__main__":
    main()
