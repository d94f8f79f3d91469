#!/usr/bin/env python3
"""`POST /v1/plan` under load: Pilotfish beside FastAPI with CVXPY and beside FastAPI with the program written by hand.

    PILOTFISH=target/release/pilotfish python3 tests/python/throughput.py    # needs throughput-requirements.txt, and wrk

Every service has its turn in every round: it is started anew, warmed up, and driven over loopback by `wrk`, each client
with its next request as soon as it has the answer to the one before. Only answers 200 count. Numbers are medians of the
rounds. Latencies are wrk's, which adds those of requests that a stall of more than twice the mean kept from being sent.
The machine should be idle: services and clients share its processors, and Pilotfish plans at a lower priority (nice 5).

Processor time is that of the service's whole process tree. By part, Pilotfish's is that of its threads: those called
`read` and `plan` do these; the rest is Tokio's, which speak HTTP and write the answer. What HTTP alone costs, a request to
`/livez` shows; `write` of Pilotfish is what the rest has beyond that, with the body's arrival and the hand-overs between
threads. A peer takes the time of its parts itself, in the one thread that a worker has.

What Pilotfish does and the peers do not is in `peer_planner.py`. `--check` first shows that they solve the same programs.
"""

import argparse
import json
import os
import platform
import re
import resource
import signal
import socket
import subprocess
import sys
import tempfile
import time
import urllib.error
import urllib.request
from collections import defaultdict
from dataclasses import dataclass, field
from importlib.metadata import version
from pathlib import Path as File

HERE = File(__file__).resolve().parent
SNAPSHOTS = HERE.parents[1] / "examples" / "snapshots"
SERVICES = {"Pilotfish": None, "FastAPI, CVXPY": "cvxpy", "FastAPI, by hand": "hand"}
DEFAULT_SNAPSHOTS = ["track", "intermittent", "crowded"]
CLIENTS = [1, 4]
PACKAGES = ["fastapi", "uvicorn", "pydantic", "orjson", "numpy", "scipy", "cvxpy", "clarabel"]
TRIES = 10
#: Share of the busier worker from which the other one had no connection.
NO_CONNECTION = 0.9
TICK = os.sysconf("SC_CLK_TCK")
#: Libraries that would else start threads of their own beside the workers.
ONE_THREAD = dict.fromkeys(["OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "RAYON_NUM_THREADS"], "1")

LOAD = """
local threads = {}
function setup(thread) table.insert(threads, thread) end
function init(arguments) ok, other = 0, 0 end
function response(status) if status == 200 then ok = ok + 1 else other = other + 1 end end
function done(summary, latency, requests)
   local ok, other = 0, 0
   for _, thread in ipairs(threads) do ok, other = ok + thread:get("ok"), other + thread:get("other") end
   local errors = summary.errors
   print(string.format(
      '{"ok": %d, "other": %d, "failed": %d, "seconds": %f, "p50_ms": %f, "p99_ms": %f, "max_ms": %f}',
      ok, other, errors.connect + errors.read + errors.write + errors.timeout, summary.duration / 1e6,
      latency:percentile(50) / 1e3, latency:percentile(99) / 1e3, latency.max / 1e3))
end
"""


@dataclass(frozen=True)
class Load:
    """What the clients saw."""

    ok: int
    other: int
    failed: int
    seconds: float
    p50_ms: float
    p99_ms: float
    max_ms: float


@dataclass
class Sample:
    """What the rounds showed of a service, a snapshot and a number of clients."""

    rates: list[float] = field(default_factory=list)
    p50_ms: list[float] = field(default_factory=list)
    p99_ms: list[float] = field(default_factory=list)
    cpu_ms: list[float] = field(default_factory=list)
    parts_ms: dict[str, list[float]] = field(default_factory=lambda: defaultdict(list))
    client_share: list[float] = field(default_factory=list)  # of a processor
    busiest: list[float] = field(default_factory=list)  # share of the busiest worker
    again: int = 0  # turns taken again as a worker got no connection
    not_ok: int = 0

    def add(self, turn: "Sample") -> None:
        for name in ["rates", "p50_ms", "p99_ms", "cpu_ms", "client_share", "busiest"]:
            getattr(self, name).extend(getattr(turn, name))
        for part, ms in turn.parts_ms.items():
            self.parts_ms[part].extend(ms)
        self.not_ok += turn.not_ok


def median(numbers: list[float]) -> float:
    numbers = sorted(numbers)
    half = len(numbers) // 2
    return numbers[half] if len(numbers) % 2 else 0.5 * (numbers[half - 1] + numbers[half])


@dataclass
class Service:
    """A service that runs."""

    process: subprocess.Popen
    url: str
    peer: bool

    def get(self, path: str) -> bytes:
        with urllib.request.urlopen(self.url + path, timeout=10) as answer:
            return answer.read()

    def cpu_seconds(self) -> float:
        """Of the process and what it started, user and system."""
        return sum(sum(map(int, fields(f"/proc/{pid}/stat")[11:13])) for pid in tree(self.process.pid)) / TICK

    def answered(self) -> list[float]:
        """Requests that each worker has answered."""
        return [worker["requests"] for worker in json.loads(self.get("/parts")).values()]

    def part_seconds(self) -> dict[str, float]:
        """Processor time by part, as far as the service shows it."""
        sums: dict[str, float] = defaultdict(float)
        if self.peer:
            for worker in json.loads(self.get("/parts")).values():
                for name, seconds in worker.items():
                    sums[name] += seconds
            return sums
        for task in File(f"/proc/{self.process.pid}/task").iterdir():
            name = (task / "comm").read_text().strip()
            sums[name] += int((task / "schedstat").read_text().split()[0]) / 1e9
        return sums

    def stop(self) -> None:
        self.process.send_signal(signal.SIGTERM)
        try:
            self.process.wait(20)
        except subprocess.TimeoutExpired:
            for pid in tree(self.process.pid):
                os.kill(pid, signal.SIGKILL)
            self.process.wait()


def fields(stat: str) -> list[str]:
    """The fields of a stat file after the name, which may have blanks in it."""
    return File(stat).read_text().rpartition(")")[2].split()


def tree(pid: int) -> list[int]:
    """A process and all that it started."""
    children = File(f"/proc/{pid}/task/{pid}/children").read_text().split()
    return [pid, *(grandchild for child in children for grandchild in tree(int(child)))]


def started(name: str, folder: File, workers: int) -> Service:
    """A service that answers."""
    peer = SERVICES[name]
    if peer is None:
        data = tempfile.mkdtemp(dir=folder)
        command = [os.environ["PILOTFISH"], "serve", "--data", data, "--port", "0", "--log", "warn"]
        process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
        found = re.search(r"http://[\d.]+:\d+", process.stdout.readline())
        return Service(process, found.group(), peer=False)
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    command = [sys.executable, "-m", "uvicorn", "fastapi_peer:app", "--workers", f"{workers}", "--port", f"{port}"]
    command += ["--no-access-log", "--log-level", "warning"]
    parts = tempfile.mkdtemp(dir=folder)
    process = subprocess.Popen(command, cwd=HERE, env=os.environ | ONE_THREAD | {"PEER": peer, "PEER_PARTS": parts})
    service = Service(process, f"http://127.0.0.1:{port}", peer=True)
    for _ in range(300):
        try:
            if len(json.loads(service.get("/parts"))) == workers:
                return service
        except (urllib.error.URLError, ConnectionError):
            pass
        time.sleep(0.1)
    service.stop()
    raise RuntimeError(f"{name} does not answer")


def drive(url: str, script: File, clients: int, seconds: float) -> tuple[Load, float]:
    """What the clients saw, and what processor time they took, s."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    command = ["wrk", "-t1", f"-c{clients}", f"-d{seconds:.0f}s", "--timeout", "10s", "-s", f"{script}", url]
    output = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    own = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return Load(**json.loads(output.strip().splitlines()[-1])), own


def warm_up(service: Service, script: File, seconds: float) -> None:
    """Until every worker of a peer has answered: whose a connection is, chance says."""
    before = service.answered() if service.peer else []
    for _ in range(TRIES):
        drive(f"{service.url}/v1/plan", script, max(CLIENTS), seconds)
        if not service.peer or all(now > then for now, then in zip(service.answered(), before, strict=True)):
            return
    raise RuntimeError("a worker gets no connection")


def measured(service: Service, script: File, clients: int, seconds: float, http_ms: float, sample: Sample) -> None:
    """One turn; again where chance gave a worker of a peer none of the connections, which is not the service's limit."""
    for _ in range(TRIES):
        turn = Sample()
        one_turn(service, script, clients, seconds, http_ms, turn)
        if not turn.busiest or clients == 1 or turn.busiest[0] < NO_CONNECTION:
            break
        sample.again += 1
    sample.add(turn)


def one_turn(service: Service, script: File, clients: int, seconds: float, http_ms: float, sample: Sample) -> None:
    cpu, parts, shares = service.cpu_seconds(), service.part_seconds(), service.answered() if service.peer else []
    load, client_seconds = drive(f"{service.url}/v1/plan", script, clients, seconds)
    answered = load.ok + load.other
    cpu_ms = 1e3 * (service.cpu_seconds() - cpu) / answered
    part_ms = {
        name: 1e3 * (sum_after - parts.get(name, 0.0)) / answered for name, sum_after in service.part_seconds().items()
    }
    sample.not_ok += load.other + load.failed
    sample.rates.append(load.ok / load.seconds)
    sample.p50_ms.append(load.p50_ms)
    sample.p99_ms.append(load.p99_ms)
    sample.cpu_ms.append(cpu_ms)
    sample.client_share.append(client_seconds / load.seconds)
    read, plan = part_ms["read"], part_ms["plan"]
    rest = cpu_ms - read - plan
    write = part_ms["write"] if service.peer else max(rest - http_ms, 0.0)
    sample.parts_ms["read"].append(read)
    sample.parts_ms["plan"].append(plan)
    sample.parts_ms["write"].append(write)
    sample.parts_ms["http"].append(rest - write)
    if service.peer:
        sample.parts_ms["solve"].append(part_ms["solve"])
        done = [now - then for now, then in zip(service.answered(), shares, strict=True)]
        sample.busiest.append(max(done) / sum(done))


def http_alone(service: Service, folder: File) -> float:
    """Processor time of a request that asks for nothing, ms."""
    script = folder / "livez.lua"
    script.write_text(LOAD)
    cpu = service.cpu_seconds()
    load, _ = drive(f"{service.url}/livez", script, 1, 1)
    return 1e3 * (service.cpu_seconds() - cpu) / max(load.ok, 1)


def script_of(snapshot: str, folder: File) -> File:
    """What wrk is to send."""
    script, body = folder / f"{snapshot}.lua", (SNAPSHOTS / f"{snapshot}.json").read_text()
    head = f'wrk.method = "POST"\nwrk.headers["content-type"] = "application/json"\nwrk.body = [==[{body}]==]\n'
    script.write_text(head + LOAD)
    return script


def take(arguments: argparse.Namespace, folder: File) -> dict[tuple[str, str, int], Sample]:
    """All rounds."""
    samples: dict[tuple[str, str, int], Sample] = defaultdict(Sample)
    scripts = {snapshot: script_of(snapshot, folder) for snapshot in arguments.snapshots}
    for turn in range(arguments.rounds):
        for name in SERVICES:
            print(f"round {turn + 1} of {arguments.rounds}: {name}", file=sys.stderr)
            service = started(name, folder, arguments.workers)
            try:
                for script in scripts.values():
                    warm_up(service, script, arguments.warm_up)
                http_ms = http_alone(service, folder)
                for snapshot, script in scripts.items():
                    for clients in CLIENTS:
                        sample = samples[snapshot, name, clients]
                        measured(service, script, clients, arguments.seconds, http_ms, sample)
            finally:
                service.stop()
    return samples


def print_tables(samples: dict[tuple[str, str, int], Sample], snapshots: list[str]) -> None:
    print("\n| snapshot | clients | service | requests/s | p50, ms | p99, ms | CPU a request, ms | not 200 |")
    print("|---|---:|---|---:|---:|---:|---:|---:|")
    for snapshot in snapshots:
        for clients in CLIENTS:
            for name in SERVICES:
                s = samples[snapshot, name, clients]
                print(
                    f"| `{snapshot}` | {clients} | {name} | {median(s.rates):,.0f} ({min(s.rates):,.0f}–{max(s.rates):,.0f}) "
                    f"| {median(s.p50_ms):.2f} | {median(s.p99_ms):.2f} | {median(s.cpu_ms):.2f} | {s.not_ok} |"
                )
    print("\n| CPU a request, ms, 1 client | | read | plan | in the solver, by its clock | write | HTTP and the rest |")
    print("|---|---|---:|---:|---:|---:|---:|")
    for snapshot in snapshots:
        for name in SERVICES:
            parts = {part: median(ms) for part, ms in samples[snapshot, name, 1].parts_ms.items()}
            solve = f"{parts['solve']:.2f}" if "solve" in parts else "–"
            print(
                f"| `{snapshot}` | {name} | {parts['read']:.3f} | {parts['plan']:.2f} | {solve} | {parts['write']:.3f} "
                f"| {parts['http']:.3f} |"
            )
    for service in SERVICES:
        several = [s for (_, name, clients), s in samples.items() if name == service and clients > 1]
        shares = [share for s in several for share in s.busiest]
        if shares:
            print(
                f"\n{service}: the busier worker answered {min(shares):.0%} to {max(shares):.0%} of several clients; "
                f"{sum(s.again for s in several)} turns taken again, as a worker had no connection."
            )
    share = max(max(s.client_share) for s in samples.values())
    print(f"\nThe clients took {share:.0%} of a processor at most.")


def print_agreement(snapshots: list[str], folder: File) -> None:
    """How far the peers' programs, their solutions and their answers are from the planner's."""
    import numpy as np
    from scipy import sparse

    import peer_planner as peer
    from fastapi_peer import Snapshot
    from oracle import Program

    print("\n| snapshot | program | first velocity, m/s: by hand, CVXPY | solves | speed, m/s | heading, ° |")
    print("|---|---:|---:|---:|---:|---:|")
    for name in snapshots:
        file, dump = SNAPSHOTS / f"{name}.json", folder / f"{name}.json"
        command = [os.environ["PILOTFISH"], "plan", f"{file}", "--dump", f"{dump}"]
        answer = json.loads(subprocess.run(command, capture_output=True, check=True).stdout)
        theirs = Program.read(dump)
        snapshot = Snapshot.model_validate_json(file.read_bytes())
        horizon = peer.horizon_of(snapshot)
        pattern = peer.Pattern(horizon.shape)
        about = linearisation_of(theirs, pattern, horizon)
        quadratic, rows, q, b = pattern.numbers(horizon, about)
        pattern.quadratic.data[:], pattern.constraints.data[:] = quadratic, rows
        pairs = [(pattern.quadratic, sparse.triu(theirs.quadratic)), (pattern.constraints, theirs.constraints)]
        apart = [abs(ours - planners).max() for ours, planners in pairs]
        apart += [np.abs(q - theirs.linear).max(), np.abs(b - theirs.bounds).max()]
        first = theirs.solution[theirs.velocity_columns]
        solvers = [make() for make in (peer.ByHand, peer.WithCvxpy)]
        off = [np.linalg.norm(solver.solve(horizon, about).velocities[1] - first) for solver in solvers]
        ours, planners = peer.plan(snapshot, solvers[0]), answer["reference"]
        turned = (ours["reference"]["heading_deg"] - planners["heading_deg"] + 180.0) % 360.0 - 180.0
        solves = f"{ours['solver']['scp_iterations']} ({answer['solver']['scp_iterations']})"
        speeds = f"{ours['reference']['speed_mps']:.3f} ({planners['speed_mps']:.3f})"
        print(f"| `{name}` | {max(apart):.0e} | {off[0]:.0e}, {off[1]:.0e} | {solves} | {speeds} | {turned:+.2f} |")


def linearisation_of(theirs, pattern, horizon):
    """What the planner linearised its last program about, as the program's own rows say."""
    import numpy as np

    import peer_planner as peer

    n, rows, bounds = peer.N, theirs.constraints.toarray(), theirs.bounds
    stages = np.arange(n)
    directions = np.vstack([[1.0, 0.0], -rows[4 * n + stages[:, None], pattern.v]])
    disturbance = 0.5 * (bounds[2 * n : 4 * n : 2] - bounds[2 * n + 1 : 4 * n : 2])
    speeds_max = bounds[pattern.rows_speed : pattern.rows_range : 3]
    about = peer.linearised_about(horizon, directions, disturbance, speeds_max, np.zeros((n + 1, 2)))
    disturbance[0] -= about.mean[0] @ horizon.velocity / peer.STEPS[0]
    if n_discs := horizon.shape.n_discs:
        places = pattern.rows_disc + n_discs * stages[None, :, None] + np.arange(n_discs)[:, None, None]
        about.disc_normals = -rows[places, 4 * stages[:, None] + np.arange(2)]
    return about


def main() -> None:
    """Measures and prints."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--snapshots", nargs="+", default=DEFAULT_SNAPSHOTS, help="names in examples/snapshots")
    parser.add_argument("--rounds", type=int, default=3, help="turns of each service [default: 3]")
    parser.add_argument("--seconds", type=float, default=6.0, help="of each measurement [default: 6]")
    parser.add_argument("--warm-up", type=float, default=2.0, help="for each snapshot, s [default: 2]")
    parser.add_argument("--workers", type=int, default=2, help="of uvicorn [default: 2]")
    parser.add_argument("--check", action="store_true", help="first show that all solve the same programs")
    arguments = parser.parse_args()
    cpu = re.search(r"model name\s*: (.*)", File("/proc/cpuinfo").read_text())
    print(
        f"{platform.machine()}, {cpu.group(1) if cpu else 'unknown'}, {os.cpu_count()} processors under a load of "
        f"{os.getloadavg()[0]:.1f}, Python {platform.python_version()}, "
        + ", ".join(f"{package} {version(package)}" for package in PACKAGES)
    )
    with tempfile.TemporaryDirectory() as name:
        folder = File(name)
        if arguments.check:
            os.environ |= ONE_THREAD
            print_agreement(arguments.snapshots, folder)
        print_tables(take(arguments, folder), arguments.snapshots)


if __name__ == "__main__":
    main()
