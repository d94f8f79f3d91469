#!/usr/bin/env python3
"""What a client that means harm takes from the others: 20 live missions, /livez and a small plan beside each attack.

    python3 tests/python/attacks.py target/release/pilotfish            # all, a row each
    python3 tests/python/attacks.py target/release/pilotfish long-plans --seconds 30
    python3 tests/python/attacks.py target/release/pilotfish everything --seconds 600 --memory-mib 512    # as root
    python3 tests/python/attacks.py target/release/pilotfish none --missions 50 --seconds 3600            # does memory grow?
    python3 tests/python/attacks.py target/release/pilotfish --dearest 100    # CPU and memory of each route's dearest request

Everything comes from this machine, at a lower priority (nice 10) than the clients that are measured. The service has not
been told anything but its port and its directory.
"""

import argparse
import http.client
import itertools
import json
import multiprocessing
import os
import signal
import socket
import statistics
import subprocess
import sys
import tempfile
import threading
import time
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path as File

import dear_requests

EXAMPLES = File(__file__).resolve().parents[2] / "examples" / "snapshots"
LIVE_MISSIONS = 20
PERIOD = 1.0  # of live missions, s
PATIENCE = 30.0
JSON = {"content-type": "application/json"}
LOWER_PRIORITY = 10


@dataclass
class Service:
    """The program under attack."""

    process: subprocess.Popen
    port: int
    headers: dict[str, str] = field(default_factory=dict)

    def connect(self) -> http.client.HTTPConnection:
        return http.client.HTTPConnection("127.0.0.1", self.port, timeout=PATIENCE)

    def socket(self) -> socket.socket:
        return socket.create_connection(("127.0.0.1", self.port), timeout=PATIENCE)

    def ask(self, method: str, path: str, body: str | None = None) -> tuple[int, bytes]:
        return exchange(self.connect(), method, path, body, self.headers)

    def made(self, mission: dict) -> str:
        status, answer = self.ask("POST", "/v1/missions", json.dumps({"schema_version": "1.0"} | mission))
        if status != 201:
            raise RuntimeError(f"no mission: {answer.decode()}")
        name = json.loads(answer)["id"]
        self.ask("POST", f"/v1/missions/{name}/run", "{}")
        return name

    def memory_mib(self) -> tuple[float, float]:
        """Now, and at the peak."""
        lines = File(f"/proc/{self.process.pid}/status").read_text().splitlines()
        found = {line.split(":")[0]: line.split()[1] for line in lines if line.startswith(("VmRSS", "VmHWM"))}
        return int(found["VmRSS"]) / 1024, int(found["VmHWM"]) / 1024


def exchange(
    connection: http.client.HTTPConnection,
    method: str,
    path: str,
    body: str | bytes | None = None,
    headers: dict[str, str] | None = None,
) -> tuple[int, bytes]:
    connection.request(method, path, body, (JSON if body is not None else {}) | (headers or {}))
    answer = connection.getresponse()
    return answer.status, answer.read()


@contextmanager
def memory_limit(mib: int | None) -> Iterator[Callable[[], None] | None]:
    """What a process does to be killed beyond that memory, by a control group (version 1 or 2), which needs root."""
    if mib is None:
        yield None
        return
    root = File("/sys/fs/cgroup")
    first = (root / "memory").is_dir()
    group = (root / "memory" if first else root) / f"pilotfish-{os.getpid()}"
    group.mkdir()
    (group / ("memory.limit_in_bytes" if first else "memory.max")).write_text(str(mib << 20))
    try:
        yield lambda: (group / "cgroup.procs").write_text(str(os.getpid()))
    finally:
        group.rmdir()


@contextmanager
def started(program: File, with_tokens: bool, mib: int | None = None) -> Iterator[Service]:
    """The service on a free port, with an empty directory."""
    with memory_limit(mib) as limited, tempfile.TemporaryDirectory() as data:
        headers = {}
        if with_tokens:
            token = subprocess.run(
                [program, "token", "add", "ship", "--role", "operator", "--data", data],
                check=True,
                capture_output=True,
                text=True,
            )
            headers["authorization"] = f"Bearer {token.stdout.split()[0]}"
        process = subprocess.Popen(
            [program, "serve", "--data", data, "--port", "0"],
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
            preexec_fn=limited,
        )
        try:
            greeting = process.stdout.readline()
            yield Service(process, int(greeting.strip().rsplit(":", 1)[1]), headers)
        finally:
            process.send_signal(signal.SIGTERM)
            process.wait()


def repeated(
    connections: int, request: Callable[[Service, int, int], tuple[str, str, str | bytes | None]]
) -> Callable[[Service], Callable[[float], Counter]]:
    """So many connections, each with one request after another and without a pause."""

    def prepare(service: Service) -> Callable[[float], Counter]:
        def one(client: int, end: float, statuses: Counter) -> None:
            connection = service.connect()
            for turn in itertools.count():
                if end <= time.monotonic():
                    break
                try:
                    status, _ = exchange(connection, *request(service, client, turn), headers=service.headers)
                    statuses[str(status)] += 1
                except (OSError, http.client.HTTPException):
                    statuses["not answered"] += 1
                    connection.close()

        def attack(end: float) -> Counter:
            statuses = Counter()
            in_parallel([lambda c=c: one(c, end, statuses) for c in range(connections)])
            return statuses

        return attack

    return prepare


def in_parallel(tasks: list[Callable[[], None]]) -> None:
    threads = [threading.Thread(target=task, daemon=True) for task in tasks]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()


def held(
    connections: int, opening: Callable[[Service, int], bytes], dripped: bytes = b""
) -> Callable[[Service], Callable[[float], Counter]]:
    """So many connections that begin a request and read nothing; `dripped` is sent on each of them every second."""

    def prepare(service: Service) -> Callable[[float], Counter]:
        openings = [opening(service, client) for client in range(connections)]

        def attack(end: float) -> Counter:
            said, sockets = Counter(), []
            for i, first in enumerate(openings):
                try:
                    taken = service.socket()
                    taken.sendall(first)
                    sockets.append(taken)
                except OSError:
                    said["not connected"] += 1
                if end <= time.monotonic():
                    said["not tried"] = connections - i - 1
                    break
            said["held"] = len(sockets)
            while time.monotonic() < end:
                time.sleep(min(1.0, max(0.0, end - time.monotonic())))
                for taken in sockets:
                    with suppress(OSError):
                        taken.sendall(dripped)
            return said

        return attack

    return prepare


def long_plan(segments: int, reports: int) -> str:
    """A valid snapshot of 16 AUVs with straight paths of many segments, and many reports each."""

    def auv(i: int) -> dict:
        corner = [[10.0 * k + i / 7, 100.0 * i + i / 7] for k in range(segments + 1)]
        lines = [{"kind": "line", "from": a, "to": b} for a, b in itertools.pairwise(corner)]
        heard = [
            {"t_s": 100.0 + k + 1 / 3, "north_m": k / 7, "east_m": 100.0 * i + 1 / 3, "sigma_m": 1.5}
            for k in range(reports)
        ]
        where = {"reports": heard} if reports else {"state": moving(corner[0])}
        return {"id": f"auv-{i}", "path": {"segments": lines, "speed_mps": 0.3}} | where

    auvs = [auv(i) for i in range(16)]
    asc = {"north_m": 0.0, "east_m": 0.0, "heading_rad": 0.0, "speed_mps": 0.2}
    goal = {"kind": "track", "auv": "auv-0"}
    return json.dumps({"schema_version": "1.0", "t_s": 170.0, "asc": asc, "auvs": auvs, "goal": goal})


def moving(at: list[float]) -> dict:
    return {"north_m": at[0], "east_m": at[1], "depth_m": 5.0, "course_rad": 0.0, "speed_mps": 0.3, "age_s": 1.0}


def nested_metadata() -> str:
    nested: dict | str = ""
    for _ in range(100):
        nested = {"": nested}
    many = {f"{i:x}": nested for i in range(1_500)}
    snapshot = json.loads((EXAMPLES / "track.json").read_text())
    return json.dumps(snapshot | {"metadata": many})


def live(auvs: int, segments: int = 0) -> dict:
    listed = [{"id": f"auv-{i}"} for i in range(auvs)]
    if segments:
        paths = json.loads(long_plan(segments, 0))["auvs"]
        listed = [{"id": auv["id"], "path": auv["path"]} for auv in paths[:auvs]]
    goal = {"kind": "midpoint", "auvs": ["auv-0", "auv-1"]}
    return {"live": {"auvs": listed, "goal": goal, "period_s": PERIOD}}


def heard(auvs: int, north_m: float) -> str:
    now = time.time()
    fixes = {
        f"auv-{i}": [{"t_s": now, "north_m": north_m, "east_m": 60.0 * i, "sigma_m": 1.0}] for i in range(auvs)
    }
    state = {"north_m": north_m, "east_m": 30.0, "heading_rad": 0.0, "speed_mps": 0.2}
    return json.dumps({"auvs": fixes, "asc": [{"t_s": now, "state": state}]})


def posted(path: str, body: str) -> Callable[[Service, int, int], tuple[str, str, str]]:
    return lambda _service, _client, _turn: ("POST", path, body)


def reports_to_a_large_mission(service: Service) -> Callable[[float], Counter]:
    name = service.made(live(16, 256))
    return repeated(8, lambda _s, _c, turn: ("POST", f"/v1/missions/{name}/reports", heard(16, 1e-3 * turn)))(
        service
    )


def changes_of_a_mission(service: Service) -> Callable[[float], Counter]:
    name = service.made(live(16, 256))
    changes = [json.dumps({"goal": {"kind": "track", "auv": f"auv-{i}"}}) for i in range(16)]
    return repeated(8, lambda _s, _c, turn: ("PATCH", f"/v1/missions/{name}", changes[turn % 16]))(service)


def missions_beside_simulations(service: Service) -> Callable[[float], Counter]:
    for seed in range(100):
        service.made({"simulated": {"scenario": "paper-intermittent", "seed": seed}})
    body = json.dumps({"schema_version": "1.0"} | live(2))
    return repeated(4, posted("/v1/missions", body))(service)


def heavy_simulations(service: Service) -> Callable[[float], Counter]:
    """Eight missions whose visits are dear to schedule, each paused and continued; beside them others are created."""
    file = dear_requests.scenario({"within_m": 5_000, "spread_m": 1})
    names = [service.made({"simulated": {"scenario_file": file, "seed": seed}}) for seed in range(8)]

    def request(_service: Service, client: int, turn: int) -> tuple[str, str, str]:
        if client == len(names):
            small = {"simulated": {"scenario": "paper-tracking", "seed": turn}}
            return "POST", "/v1/missions", json.dumps({"schema_version": "1.0"} | small)
        return "POST", f"/v1/missions/{names[client]}/{('pause', 'run')[turn % 2]}", "{}"

    return repeated(len(names) + 1, request)(service)


def reads(service: Service) -> Callable[[float], Counter]:
    name = service.made(live(16, 256))
    for turn in range(50):
        service.ask("POST", f"/v1/missions/{name}/reports", heard(16, 1e-3 * turn))
    paths = [f"/v1/missions/{name}{rest}" for rest in ("", "/scene", "/record?format=parquet", "/record?format=events_ndjson")]
    paths += ["/v1/missions?limit=100", "/v1/audit?limit=100"]
    return repeated(8, lambda _s, _c, turn: ("GET", paths[turn % len(paths)], None))(service)


def routes(service: Service) -> Callable[[float], Counter]:
    files = [body for _, body in dear_requests.routes()]
    return repeated(8, lambda _s, _c, turn: ("POST", "/v1/routes", files[turn % len(files)]))(service)


def everything(service: Service) -> Callable[[float], Counter]:
    """Eight clients of the worst of each kind."""
    kinds = ("plans", "comparisons", "batches", "metadata", "routes", "reports", "changes", "reads", "heavy-simulations", "streams")
    attacks = [ATTACKS[kind].prepare(service) for kind in kinds]

    def attack(end: float) -> Counter:
        statuses = Counter()
        in_parallel([lambda run=run: statuses.update(run(end)) for run in attacks])
        return statuses

    return attack


def unread_records(service: Service) -> Callable[[float], Counter]:
    name = service.made({"simulated": {"scenario": "paper-intermittent", "seed": 1}})
    begun = time.monotonic()
    while b'"finished"' not in service.ask("GET", f"/v1/missions/{name}")[1]:
        if time.monotonic() - begun > 120:
            raise RuntimeError("the simulation does not end")
        time.sleep(0.2)
    return held(64, opening(f"GET /v1/missions/{name}/record?format=csv"))(service)


def unread_streams(service: Service) -> Callable[[float], Counter]:
    name = service.made({"simulated": {"scenario": "paper-intermittent", "seed": 1}})
    return held(512, opening(f"GET /v1/missions/{name}/events?after=0"))(service)


def opening(line: str, rest: str = "\r\n") -> Callable[[Service, int], bytes]:
    def bytes_of(service: Service, _client: int) -> bytes:
        fields = "".join(f"{name}: {value}\r\n" for name, value in service.headers.items())
        return f"{line} HTTP/1.1\r\nhost: 127.0.0.1\r\n{fields}{rest}".encode()

    return bytes_of


def half_a_body(_service: Service, _client: int) -> bytes:
    length = 1 << 20
    head = f"POST /v1/plan HTTP/1.1\r\nhost: 127.0.0.1\r\n{''.join(f'{k}: {v}' for k, v in JSON.items())}\r\n"
    return f"{head}content-length: {length}\r\n\r\n".encode() + b" " * (length // 2)


def guessed_tokens(service: Service) -> Callable[[float], Counter]:
    intruder = Service(service.process, service.port)

    def request(_service: Service, client: int, turn: int) -> tuple[str, str, None]:
        intruder.headers["authorization"] = f"Bearer pf_{client:032x}{turn:032x}"
        return "GET", "/v1/missions", None

    return lambda end: repeated(8, request)(intruder)(end)


def batch() -> str:
    track = json.loads((EXAMPLES / "intermittent.json").read_text())
    return json.dumps({"requests": [track] * 64})


@dataclass(frozen=True)
class Attack:
    """What is done, and how: with the service before the clock runs, then until a moment."""

    what: str
    prepare: Callable[[Service], Callable[[float], Counter]]
    with_tokens: bool = False


ATTACKS = {
    "none": Attack("nothing", lambda _: lambda end: time.sleep(end - time.monotonic()) or Counter()),
    "plans": Attack("8 clients post plans of 187 kB", repeated(8, posted("/v1/plan", long_plan(110, 0)))),
    "long-plans": Attack("64 clients post plans of 536 kB", repeated(64, posted("/v1/plan", long_plan(256, 64)))),
    "reports": Attack("8 clients report to a mission of 16 AUVs, 256 segments each", reports_to_a_large_mission),
    "metadata": Attack("8 clients post 917 kB of nested metadata", repeated(8, posted("/v1/plan", nested_metadata()))),
    "simulations": Attack("4 clients make missions beside 100 simulations", missions_beside_simulations),
    "records": Attack("64 clients ask for a record and do not read", unread_records),
    "streams": Attack("512 clients ask for a mission's events and do not read", unread_streams),
    "connections": Attack("5,000 connections that say nothing", held(5_000, lambda _s, _c: b"")),
    "slow-heads": Attack("1,000 requests, a header's byte each second", held(1_000, opening("GET /livez", "x: "), b"x")),
    "slow-bodies": Attack("200 bodies of 1 MiB, half sent, a byte each second", held(200, half_a_body, b" ")),
    "batches": Attack("8 clients post batches of 64 plans", repeated(8, posted("/v1/plan/batch", batch()))),
    "comparisons": Attack(
        "8 clients compare 16 AUVs side by side",
        repeated(8, posted("/v1/plan/compare", json.dumps(dear_requests.snapshot(dear_requests.SIDE_BY_SIDE)))),
    ),
    "routes": Attack("8 clients post files of routes, as long as is accepted", routes),
    "reads": Attack("8 clients read a mission of 16 AUVs, lists and records", reads),
    "heavy-simulations": Attack("8 simulations of 16 AUVs side by side, paused and run", heavy_simulations),
    "everything": Attack("8 clients of the worst of each kind", everything),
    "changes": Attack("8 clients change the goal of a mission of 16 AUVs", changes_of_a_mission),
    "openapi": Attack("16 clients get /openapi.json", repeated(16, lambda *_: ("GET", "/openapi.json", None))),
    "tokens": Attack("8 clients guess tokens", guessed_tokens, with_tokens=True),
}


@dataclass
class Beside:
    """What the other clients get: latencies in ms, and what became of live plans."""

    livez: list[float] = field(default_factory=list)
    plan: list[float] = field(default_factory=list)
    report: list[float] = field(default_factory=list)
    not_answered: Counter = field(default_factory=Counter)

    def every(self, service: Service, period: float, end: float, into: str, request: Callable[[], tuple]) -> None:
        """A request each `period` s, s, on a connection of its own."""
        connection = service.connect()
        due = time.monotonic()
        while due < end:
            time.sleep(max(0.0, due - time.monotonic()))
            try:
                status, _ = exchange(connection, *request(), headers=service.headers)
                if status == 200:
                    getattr(self, into).append(1e3 * (time.monotonic() - due))
                else:
                    self.not_answered[f"{into} {status}"] += 1
            except (OSError, http.client.HTTPException):
                self.not_answered[into] += 1
                connection.close()
            due = max(due + period, time.monotonic() - period)


def spread(samples: list[float]) -> str:
    if len(samples) < 2:
        return "none"
    ordered = sorted(samples)
    return f"{statistics.median(ordered):.1f} / {ordered[int(0.99 * (len(ordered) - 1))]:.0f}"


def at_lower_priority(attack: Callable[[float], Counter], end: float, queue: multiprocessing.Queue) -> None:
    os.nice(LOWER_PRIORITY)
    queue.put(attack(end))


def measured(program: File, attack: Attack, seconds: float, n_missions: int, mib: int | None) -> str:
    """A row of the table."""
    with started(program, attack.with_tokens, mib) as service:
        names = [service.made(live(2)) for _ in range(n_missions)]
        for name in names:
            service.ask("POST", f"/v1/missions/{name}/reports", heard(2, 0.0))
        run = attack.prepare(service)
        beside, small = Beside(), (EXAMPLES / "track.json").read_text()
        start, unix_start = time.monotonic() + 1.0, time.time() + 1.0
        end = start + seconds
        queue = multiprocessing.Queue()
        process = multiprocessing.Process(target=at_lower_priority, args=(run, end, queue))
        clients = [
            lambda: beside.every(service, 0.05, end, "livez", lambda: ("GET", "/livez")),
            lambda: beside.every(service, 0.1, end, "plan", lambda: ("POST", "/v1/plan", small)),
        ]
        clients += [
            lambda path=f"/v1/missions/{name}/reports": beside.every(
                service, PERIOD, end, "report", lambda: ("POST", path, heard(2, time.monotonic() - start))
            )
            for name in names
        ]
        process.start()
        time.sleep(1.0)
        in_parallel(clients)
        now, peak = service.memory_mib()
        did = queue.get(timeout=60)
        process.join()
        plans = Counter()
        for name in names:
            status, record = service.ask("GET", f"/v1/missions/{name}/record?format=events_ndjson")
            for line in record.splitlines() if status == 200 else []:
                event = json.loads(line)
                if event["kind"] == "planned" and unix_start <= event["t_s"] < unix_start + seconds:
                    plans[event["outcome"]] += 1
        due = round(n_missions * seconds / PERIOD)
        others = ", ".join(f"{outcome} {n}" for outcome, n in plans.items() if outcome != "ok")
        refused = ", ".join(f"{what} {n}" for what, n in beside.not_answered.items())
        answers = ", ".join(f"{status}: {n}" for status, n in sorted(did.items()))
        return (
            f"| {attack.what} | {plans['ok']} of {due}{f' ({others})' if others else ''} | {spread(beside.livez)} "
            f"| {spread(beside.plan)}{f' ({refused})' if refused else ''} | {spread(beside.report)} | {answers} "
            f"| {now:.0f} ({peak:.0f}) |"
        )


def main() -> None:
    """Attacks, and prints a row of a table for each."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("program", type=File, help="the service's binary")
    parser.add_argument("attacks", nargs="*", metavar="ATTACK", help=f"of {', '.join(ATTACKS)} [default: all]")
    parser.add_argument("--seconds", type=float, default=10.0, help="how long each goes on [default: 10]")
    parser.add_argument("--missions", type=int, default=LIVE_MISSIONS, help="live missions [default: 20]")
    parser.add_argument("--memory-mib", type=int, help="the service is killed beyond that memory")
    parser.add_argument("--dearest", type=int, metavar="N", help="search the dearest request of each route, N tries")
    parser.add_argument("--seed", type=int, default=1, help="of the search [default: 1]")
    arguments = parser.parse_args()
    if arguments.dearest is not None:
        print("| route | request | status | CPU, s | wall, s | MiB more | of what it may |\n|---|---|---|---|---|---|---|")
        too_dear = 0
        with started(arguments.program, False) as service:
            for row in dear_requests.dearest(service, arguments.dearest, arguments.seed):
                print(row, flush=True)
                too_dear |= dear_requests.TOO_DEAR in row
        sys.exit(too_dear)
    print("| attack | live plans solved of those due | /livez, ms | small plan, ms | report, ms | attacker's answers | MiB (peak) |")
    print("|---|---|---|---|---|---|---|")
    failed = 0
    for name in arguments.attacks or ATTACKS:
        try:
            row = measured(arguments.program, ATTACKS[name], arguments.seconds, arguments.missions, arguments.memory_mib)
        except Exception as error:  # the service of a version before may not answer at all
            row, failed = f"| {ATTACKS[name].what} | not measured: {error!r} |", 1
        print(row, flush=True)
    sys.exit(failed)


if __name__ == "__main__":
    main()
