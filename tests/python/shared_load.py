#!/usr/bin/env python3
"""What live missions cost on services that share them through PostgreSQL, beside one service with SQLite.

    python3 tests/python/shared_load.py target/release/pilotfish target/release/load --missions 500 --minutes 3

Everything runs on this machine: a primary with a synchronous standby, two services with half of the missions each, and
two clients (`tests/load.rs`), whose processor time the services lack; then as many missions on one service with SQLite.
"""

import argparse
import re
import subprocess
import tempfile
import time
import urllib.request
from pathlib import Path as File

from shared_missions import DATABASE, HOST, Pair, Service, cpu_s, until

HOUR = 3600.0
QUANTILES = (0.5, 0.99, 1.0)


class Direct:
    """No proxies."""

    @staticmethod
    def open(port: int) -> int:
        return port


def metrics(services: list[Service]) -> dict[str, float]:
    """Sums of the services' metrics."""
    sums: dict[str, float] = {}
    for service in services:
        with urllib.request.urlopen(f"http://{HOST}:{service.port}/metrics") as answer:
            for line in answer.read().decode().splitlines():
                name, _, value = line.rpartition(" ")
                if not line.startswith("#"):
                    sums[name] = sums.get(name, 0.0) + float(value)
    return sums


def quantiles(histogram: str, before: dict[str, float], after: dict[str, float]) -> str:
    """Upper bounds of the buckets with the median, the 99th percentile and the worst, ms."""
    buckets = {}
    for name, count in after.items():
        if found := re.fullmatch(rf'pilotfish_{histogram}_bucket\{{.*?le="([^"]+)".*\}}', name):
            bound = float(found[1].replace("+Inf", "inf"))
            buckets[bound] = buckets.get(bound, 0.0) + count - before.get(name, 0.0)
    bounds, total = sorted(buckets), max(buckets.values(), default=0.0)
    at_least = [next((b for b in bounds if 0 < q * total <= buckets[b]), float("nan")) for q in QUANTILES]
    return f"{total:.0f}: ≤ " + " / ".join(f"{1e3 * bound:g}" for bound in at_least) + " ms"


def disk_bytes(folder: File) -> int:
    return sum(file.stat().st_size for file in folder.rglob("*") if file.is_file())


def measure(arguments: argparse.Namespace, folder: File, count: int, with_database: bool) -> None:
    pair = Pair(folder / "postgresql") if with_database else None
    databases = [node.port for node in pair.nodes] if pair else []
    program = arguments.program.resolve()
    services = [Service(i, program, folder, Direct, databases, 2.0) for i in range(count)]
    try:
        for service in services:
            service.start()
            until(service.is_live, 60, f"service {service.number} is live: {service.log}")
        share = ["--missions", str(arguments.missions // count), "--minutes", str(arguments.minutes)]
        loads = [
            subprocess.Popen(
                [arguments.load, "--url", f"http://{HOST}:{service.port}", "--pid", str(service.process.pid), *share],
                stdout=(folder / f"load-{service.number}").open("wb"),
            )
            for service in services
        ]
        # All missions are made in the first third.
        time.sleep(20.0 * arguments.minutes)
        first = state(services, pair, folder)
        time.sleep(40.0 * arguments.minutes - 5.0)
        last = state(services, pair, folder)
        for load in loads:
            load.wait()
        tell(first, last, [(folder / f"load-{service.number}").read_text() for service in services])
    finally:
        for service in services:
            if service.process:
                service.end()
        if pair:
            pair.stop()


def state(services: list[Service], pair: Pair | None, folder: File) -> dict:
    now = {
        "at": time.monotonic(),
        "services": sum(service.cpu_s() for service in services),
        "metrics": metrics(services),
    }
    if pair:
        now["database"] = sum(cpu_s(process) for node in pair.nodes for process in node.everyone())
        query = f"SELECT pg_database_size('{DATABASE}'), pg_current_wal_lsn() - '0/0'"
        now["size"], now["wal"] = map(float, pair.primary.sql(query).split("|"))
    else:
        now["size"] = float(disk_bytes(folder / "service-0/data"))
    return now


def tell(first: dict, last: dict, said: list[str]) -> None:
    seconds = last["at"] - first["at"]
    rate = {
        name: (last[name] - first[name]) / seconds for name in ("services", "database", "size", "wal") if name in last
    }
    print(
        f"cores: services {rate['services']:.2f}"
        + (f", databases {rate['database']:.2f}" if "database" in rate else "")
    )
    print(
        f"GB an hour: {rate['size'] * HOUR / 1e9:.2f}"
        + (f", WAL {rate['wal'] * HOUR / 1e9:.2f}" if "wal" in rate else "")
    )
    for histogram in ("store_commit_duration_seconds", "mission_plan_late_seconds", "solve_duration_seconds"):
        print(f"{histogram} {quantiles(histogram, first['metrics'], last['metrics'])}")
    events = "pilotfish_store_events_total"
    print(f"events a second {(last['metrics'][events] - first['metrics'][events]) / seconds:.0f}")
    print(*said, sep="\n", flush=True)


def main() -> None:
    """Measures services with PostgreSQL, then one with SQLite."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", type=File)
    parser.add_argument("load", type=File, help="the program of tests/load.rs")
    parser.add_argument("--missions", type=int, default=500)
    parser.add_argument("--minutes", type=float, default=3.0)
    parser.add_argument("--only", choices=["postgresql", "sqlite"])
    arguments = parser.parse_args()
    for name, count, with_database in (("postgresql", 2, True), ("sqlite", 1, False)):
        if arguments.only in (None, name):
            # Beside the program, not in /tmp, which on some machines is no disk.
            with tempfile.TemporaryDirectory(dir=arguments.program.resolve().parent) as folder:
                print(f"\n{name}, {count} service(s), {arguments.missions} missions", flush=True)
                File(folder).chmod(0o755)
                measure(arguments, File(folder), count, with_database)


if __name__ == "__main__":
    main()
