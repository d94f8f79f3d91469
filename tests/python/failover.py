#!/usr/bin/env python3
"""Checks missions that several services share through PostgreSQL, while services, links, clocks and databases fail.

    python3 tests/python/failover.py target/release/pilotfish --faults 200 --seed 1
    python3 tests/python/failover.py target/release/pilotfish --sqlite --faults 10     # one service, without a database

Three services, a primary with a synchronous standby and eight clients, each with reports, orders, references and a
stream, write a history. From it and from what the database noted follow the claims that are checked (`verdict`). A
table says how long each kind of fault left missions without an owner, a new plan and a valid reference. Ends with 1 if
a claim is broken.
"""

import argparse
import collections
import contextlib
import hashlib
import http.client
import itertools
import json
import random
import signal
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path as File

from failover_clients import Client, History
from shared_missions import FAKETIME, HOST, PASSWORD, SERVICES, Pair, Proxies, Service, until

CLIENTS, MISSIONS = 8, 6
SETTLE = (2.5, 4.0)  # between two faults, s
AFTER = 1.5  # between begin or end of a fault and the begin of a gap that it makes, s
GOES_ON = 15.0  # within which every mission plans again when all faults are over, s
AGE_ERROR = 1.0  # by which a plan may be older than the service says, s
BOTH_SEEN = 0.25  # after which what one client has seen counts as seen by all, s

# What the database notes by itself: who took which mission, and who appended what, by the names of the services' roles.
AUDIT = """
CREATE TABLE audit (
    n bigserial PRIMARY KEY, at timestamptz DEFAULT clock_timestamp(),
    app text DEFAULT session_user,
    mission bigint, epoch bigint, owner text, sequence bigint);
CREATE FUNCTION note_owner() RETURNS trigger LANGUAGE plpgsql AS $$ BEGIN
    INSERT INTO audit (mission, epoch, owner) VALUES (NEW.number, NEW.epoch, NEW.owner_service); RETURN NULL; END $$;
CREATE FUNCTION note_event() RETURNS trigger LANGUAGE plpgsql AS $$ BEGIN
    INSERT INTO audit (mission, epoch, sequence)
        SELECT NEW.mission, epoch, NEW.sequence FROM missions WHERE number = NEW.mission; RETURN NULL; END $$;
CREATE TRIGGER owner_made AFTER INSERT ON missions FOR EACH ROW
    WHEN (NEW.owner_service IS NOT NULL) EXECUTE FUNCTION note_owner();
CREATE TRIGGER owner_changed AFTER UPDATE ON missions FOR EACH ROW
    WHEN ((OLD.owner_service, OLD.epoch) IS DISTINCT FROM (NEW.owner_service, NEW.epoch)) EXECUTE FUNCTION note_owner();
CREATE TRIGGER event_made AFTER INSERT ON events FOR EACH ROW EXECUTE FUNCTION note_event();
CREATE VIEW owned AS SELECT mission, epoch, app, owner, at, n, xmin AS x FROM audit WHERE owner IS NOT NULL;
CREATE VIEW appended AS SELECT mission, epoch, app, sequence, xmin AS x FROM audit WHERE sequence IS NOT NULL;
"""
# Waits in the database, which is quicker than asking it again and again; 5 s at most.
AWAIT = """
DO $$ BEGIN FOR k IN 1..2500 LOOP
    PERFORM 1 FROM audit WHERE {}; EXIT WHEN FOUND; PERFORM pg_sleep(0.002); END LOOP; END $$"""
BROKEN = {
    "an epoch has two owners": """
        SELECT mission, epoch FROM owned GROUP BY 1, 2 HAVING count(DISTINCT owner || app) > 1""",
    "an event was appended by a service that was not the owner": """
        SELECT e.mission, e.sequence, e.app, o.app FROM appended e JOIN owned o USING (mission, epoch)
        WHERE e.app <> o.app""",
    "an event was committed after the next owner": """
        SELECT e.mission, e.sequence, e.app, o.app FROM appended e JOIN owned o USING (mission)
        WHERE o.epoch > e.epoch AND pg_xact_commit_timestamp(e.x) > pg_xact_commit_timestamp(o.x)""",
}
HEAD = """
| fault | times | until a new owner, s | without a new plan, s | without a valid reference, s |
|---|---|---|---|---|
| | | median, worst | median, worst | worst |"""


class Checker:
    """Services, database and clients, what happens to them, and what is claimed of it."""

    def __init__(self, arguments: argparse.Namespace, folder: File):
        self.arguments, self.draw, self.history = arguments, random.Random(arguments.seed), History()
        self.proxies, self.faults, self.broken = Proxies(), [], []
        self.pair = None if arguments.sqlite else Pair(folder / "postgresql")
        databases = [node.port for node in self.pair.nodes] if self.pair else []
        count = SERVICES if self.pair else 1
        program = arguments.program.resolve()
        self.services = [Service(i, program, folder, self.proxies, databases, arguments.lease_s) for i in range(count)]
        self.missions, self.clients = [], []

    def start(self) -> None:
        for service in self.services:
            service.start()
            until(service.is_live, 60, f"service {service.number} is live: {service.log}")
            if self.pair and service is self.services[0]:
                self.pair.primary.sql(AUDIT)
        ports = [service.clients for service in self.services]
        self.missions = [self.mission(Client(i, "", ports, self.history, 0)) for i in range(MISSIONS)]
        for i in range(CLIENTS):
            self.clients.append(Client(i, self.missions[i % MISSIONS], ports, self.history, self.arguments.seed))

    def mission(self, client: Client) -> str:
        live = {"auvs": [{"id": "auv-1"}], "goal": {"kind": "track", "auv": "auv-1"}}
        status, answer, _ = client.ask("POST", "", {"schema_version": "1.0", "live": live}, f"make-{client.number}")
        if status != 201:
            raise RuntimeError(f"no mission: {status} {answer}")
        client.ask("POST", f"/{answer['id']}/run", {}, f"run-{client.number}")
        return answer["id"]

    def sql(self, text: str) -> list[list[str]]:
        return [line.split("|") for line in self.pair.primary.sql(text).splitlines()]

    def victim(self) -> Service:
        """Mostly a service that owns missions."""
        if self.pair and self.draw.random() < 0.8:
            rows = self.sql("SELECT DISTINCT ON (mission) app FROM owned ORDER BY mission, n DESC")
            return self.services[int(self.draw.choice(rows)[0][1:])]
        return self.draw.choice(self.services)

    # A fault: what happens before `yield`, and what ends it.

    def service_killed(self, service: Service) -> Iterator[None]:
        service.end(signal.SIGKILL)
        yield
        service.start()

    def service_stopped(self, service: Service) -> Iterator[None]:
        service.send(signal.SIGSTOP)
        yield
        service.send(signal.SIGCONT)

    def service_terminated(self, service: Service) -> Iterator[None]:
        service.end(signal.SIGTERM)
        yield
        service.start()

    def cut(self, *ports: int) -> Iterator[None]:
        self.proxies.cut(*ports)
        yield
        self.proxies.mend(*ports)

    def cut_from_the_database(self, service: Service) -> Iterator[None]:
        return self.cut(*service.databases)

    def cut_from_clients(self, service: Service) -> Iterator[None]:
        return self.cut(service.clients)

    def cut_from_services(self, service: Service) -> Iterator[None]:
        return self.cut(service.peers)

    def cut_from_all(self, service: Service) -> Iterator[None]:
        return self.cut(*service.databases, service.clients, service.peers)

    def appends_arrive_late(self, service: Service) -> Iterator[None]:
        """What an owner sent in time reaches the database after the next owner has taken its missions.

        The next owner is held up then: its appends would refuse the late ones by their sequence, not by their epoch.
        """
        others = [port for each in self.services if each is not service for port in each.databases]
        taken = f"owner IS NOT NULL AND app <> 's{service.number}' AND n > {self.sql('SELECT max(n) FROM audit')[0][0]}"
        self.proxies.cut(*service.databases)
        self.sql(AWAIT.format(taken))
        self.proxies.cut(*others)
        self.proxies.mend(*service.databases)
        time.sleep(0.5)
        self.proxies.mend(*others)
        yield

    def clock_set(self, service: Service) -> Iterator[None]:
        service.set_clock(self.draw.choice([-1, 1]) * 10 ** self.draw.uniform(0, 2.5))
        yield
        service.set_clock(0.0)

    def primary_killed_and_standby_promoted(self, _: Service) -> Iterator[None]:
        self.pair.primary.kill()
        time.sleep(self.draw.uniform(0.5, 2.0))  # until a tool is sure
        self.pair.fail_over()
        yield
        self.pair.add_standby()

    def primary_silent_and_standby_promoted(self, service: Service) -> Iterator[None]:
        """As if its computer had lost power: nothing refuses a connection."""
        node = self.pair.nodes.index(self.pair.primary)
        silent = [each.databases[node] for each in self.services]
        self.proxies.cut(*silent)
        yield from self.primary_killed_and_standby_promoted(service)
        self.proxies.mend(*silent)

    def primary_killed_and_started(self, _: Service) -> Iterator[None]:
        self.pair.primary.kill()
        yield
        self.pair.primary.start()
        until(self.pair.is_synchronous, 60, "the standby returns")

    def standby_stopped(self, _: Service) -> Iterator[None]:
        self.pair.standby.send(signal.SIGSTOP)
        yield
        self.pair.standby.send(signal.SIGCONT)
        until(self.pair.is_synchronous, 60, "the standby returns")

    def kinds(self) -> list:
        if not FAKETIME.exists():
            print("SKIPPED: no clock is set without libfaketime (apt-get install faketime)", file=sys.stderr)
        alone = [self.service_killed, self.service_stopped, self.service_terminated, self.cut_from_clients]
        clock = [self.clock_set] if FAKETIME.exists() else []
        links = [self.cut_from_the_database, self.cut_from_services, self.cut_from_all, self.appends_arrive_late]
        databases = [self.primary_killed_and_standby_promoted, self.primary_silent_and_standby_promoted]
        databases += [self.primary_killed_and_started, self.standby_stopped]
        kinds = alone + clock + (links + databases if self.pair else [])
        return [kind for kind in kinds if kind.__name__ in (self.arguments.kind or [kind.__name__])]

    def run(self) -> None:
        for client in self.clients:
            client.start()
        time.sleep(self.draw.uniform(*SETTLE))
        kinds, order = self.kinds(), []
        for number in range(self.arguments.faults):
            order = order or self.draw.sample(kinds, len(kinds))
            kind, service = order.pop(), self.victim()
            fault = {"kind": kind.__name__, "service": service.number, "begin": time.monotonic(), "unix": time.time()}
            going = kind(service)
            next(going)
            time.sleep(self.draw.uniform(1.0, 6.0))
            fault["end"] = time.monotonic()
            with contextlib.suppress(StopIteration):
                next(going)
            time.sleep(self.draw.uniform(*SETTLE))
            fault["over"] = time.monotonic()
            self.faults.append(fault)
            self.history.add("fault", **fault)
            print(
                f"{number + 1}: {fault['kind']} {service.number}, {fault['end'] - fault['begin']:.1f} s",
                file=sys.stderr,
            )
        healed = time.monotonic()
        until_s = healed + GOES_ON
        while (late := self.without_plan_since(healed)) and time.monotonic() < until_s:
            time.sleep(0.2)
        self.broken += [("a mission does not go on", mission) for mission in late]
        self.history.is_over.set()
        for client in self.clients:
            client.join(10)

    def without_plan_since(self, moment: float) -> set[str]:
        events = self.history.of("event")
        return set(self.missions) - {
            row["mission"] for row in events if row["kind"] == "planned" and row["at"] > moment
        }

    # What is claimed.

    def verdict(self) -> list[tuple[str, str]]:
        self.broken += [(row["claim"], row["detail"]) for row in self.history.of("broken")]
        for mission in self.missions:
            lines = self.record(mission)
            stored = {json.loads(line)["sequence"]: line for line in lines}
            if list(stored) != list(range(1, len(lines) + 1)):
                self.broken.append(("stored events have a gap or repeat", mission))
            self.check_sent(mission, stored)
            self.check_streams(mission, stored)
            self.check_references(mission, stored)
            self.check_replay(mission)
        if self.pair:
            for claim, query in BROKEN.items():
                self.broken += [(claim, " ".join(row)) for row in self.sql(query)]
        for service in self.services:
            log = service.log.read_text(errors="replace")
            self.broken += [("a password is in the log", service.log)] if PASSWORD in log else []
            self.broken += [("a panic", line) for line in log.splitlines() if "panicked" in line]
        return self.broken

    def record(self, mission: str) -> list[str]:
        """The events as every service tells them, which is the same."""
        told = []
        for service in self.services:
            link = http.client.HTTPConnection(HOST, service.port, timeout=30)
            link.request("GET", f"/v1/missions/{mission}/record?format=events_ndjson")
            told.append(link.getresponse().read().decode().splitlines())
        shortest = min(map(len, told))
        if any(lines[:shortest] != told[0][:shortest] for lines in told):
            self.broken.append(("services return different records", mission))
        return max(told, key=len)

    def check_sent(self, mission: str, stored: dict[int, str]) -> None:
        found = collections.defaultdict(list)
        for sequence, line in stored.items():
            event = json.loads(line)
            for note in event.get("heard", {}).get("notes", []):
                found[note["text"]].append(sequence)
            for disc in (event.get("setting", {}).get("keep_outs") or []) if event["kind"] == "changed" else []:
                found[f"c{disc['north_m'] - 5e3:.0f}-{disc['east_m'] - 1e3:.0f}"].append(sequence)
        last = collections.Counter()
        for row in (row for row in self.history.of("sent") if row["mission"] == mission):
            at, key = found.pop(row["key"], []), row["key"]
            is_stored = 200 <= row["status"] < 300
            if is_stored and len(at) != 1:
                self.broken.append(("acknowledged and not stored once", f"{mission} {key}: {at}"))
            elif is_stored and (at[0] != row["sequence"] or at[0] <= last[row["client"]]):
                self.broken.append(("acknowledged and stored out of order", f"{mission} {key}: {at} {row['sequence']}"))
            elif row["status"] == 0 and len(at) > 1:
                self.broken.append(("stored twice", f"{mission} {key}: {at}"))
            last[row["client"]] = max([last[row["client"]], *at])
        # Those whose answer did not come before the end are left.
        begun = {row["key"] for row in self.history.of("begun") if row["mission"] == mission}
        self.broken += [("stored and never sent", f"{mission} {key}") for key in found.keys() - begun]
        self.broken += [("stored twice", f"{mission} {key}: {at}") for key, at in found.items() if len(at) > 1]

    def check_streams(self, mission: str, stored: dict[int, str]) -> None:
        for row in (row for row in self.history.of("event") if row["mission"] == mission):
            place = f"{mission} client {row['client']} service {row['service']}: {row['sequence']} after {row['after']}"
            if row["sequence"] != row["after"] + 1:
                self.broken.append(("a stream has a gap or repeats", place))
            line = stored.get(row["sequence"], "")
            data = "{" + line.partition(",")[2]
            if hashlib.sha256(data.encode()).hexdigest() != row["digest"]:
                self.broken.append(("a stream told what is not stored", place))

    def check_references(self, mission: str, stored: dict[int, str]) -> None:
        """What a client saw, later calls of all clients see; and no plan is older than the service says."""
        references = [row for row in self.history.of("reference") if row["mission"] == mission]
        streamed = [row for row in self.history.of("event") if row["mission"] == mission and row["kind"] == "planned"]
        first_seen, seen, newest = {}, [], 0
        for row in sorted(references + streamed, key=lambda row: row["at"]):
            first_seen.setdefault(row["sequence"], row["at"])
            if row["sequence"] > newest:
                newest = row["sequence"]
                seen.append((row["at"], newest))
        for row in references:
            place = f"{mission} client {row['client']} service {row['service']}: {row['sequence']}"
            event = json.loads(stored.get(row["sequence"], "{}"))
            told = event.get("reference", {})
            if (told.get("speed_mps"), told.get("heading_rad")) != (row["speed"], row["heading"]):
                self.broken.append(("a reference is not a stored plan's", place))
            before = max((sequence for at, sequence in seen if at < row["begin"] - BOTH_SEEN), default=0)
            age = row["begin"] - first_seen[row["sequence"]]
            if row["sequence"] < before:
                self.broken.append(("a reference of a stale owner", f"{place}, {before} was known, {age:.2f} s old"))
            if row["age"] + AGE_ERROR < age:
                self.broken.append(
                    ("a plan is older than told", f"{place}, {row['age']:.2f} s told, {age:.2f} s or older")
                )

    def check_replay(self, mission: str) -> None:
        service = self.services[0]
        where = ["--store", service.store] if self.pair else ["--data", service.folder / "data"]
        done = subprocess.run([service.command[0], "replay", mission, *where], capture_output=True, text=True)
        if done.returncode or ", 0 different" not in done.stdout:
            self.broken.append(("replay is not equal", f"{mission}: {done.stdout} {done.stderr}"))

    # Time without owner, plan and reference.

    def table(self) -> Iterator[str]:
        yield HEAD
        plans = {mission: self.plans(mission) for mission in self.missions}
        for kind in sorted({fault["kind"] for fault in self.faults}):
            faults = [fault for fault in self.faults if fault["kind"] == kind]
            gaps = [max(self.gaps(plans[mission], fault) for mission in self.missions) for fault in faults]
            taken = [after for fault in faults for after in self.taken(fault)]
            new, bare = [gap[0] for gap in gaps], max(gap[1] for gap in gaps)
            owner = f"{statistics.median(taken):.1f}, {max(taken):.1f}" if taken else "–"
            plan = f"{statistics.median(new):.1f}, {max(new):.1f}"
            yield f"| {kind.replace('_', ' ')} | {len(faults)} | {owner} | {plan} | {bare:.1f} |"

    def plans(self, mission: str) -> list[tuple[float, float]]:
        """When each newer plan first reached a client, and how long it was valid then, s."""
        newest, found = 0, []
        rows = sorted(
            (row for row in self.history.of("reference") if row["mission"] == mission), key=lambda row: row["at"]
        )
        for row in rows:
            if row["sequence"] > newest:
                newest = row["sequence"]
                found.append((row["at"], row["valid"] - row["age"]))
        return found

    @staticmethod
    def gaps(plans: list[tuple[float, float]], fault: dict) -> tuple[float, float]:
        """The longest times without a new plan and without a valid one around a fault, s."""
        # A gap that begins earlier or later is another fault's.
        first, last, pairs = fault["begin"] - AFTER, fault["end"] + AFTER, itertools.pairwise(plans)
        near = [(b[0] - a[0], a[1]) for a, b in pairs if first < a[0] < last and b[0] > fault["begin"]]
        return max((gap for gap, _ in near), default=0.0), max(
            (gap - valid for gap, valid in near if gap > valid), default=0.0
        )

    def taken(self, fault: dict) -> list[float]:
        """After which times other services took the missions of the one that failed, s."""
        if not self.pair or "primary" in fault["kind"] or "standby" in fault["kind"]:
            return []
        end = fault["unix"] + fault["over"] - fault["begin"]
        rows = self.sql(
            f"SELECT mission, app, extract(epoch FROM at) FROM owned WHERE at < to_timestamp({end}) ORDER BY mission, n"
        )
        pairs = [
            (a, b) for a, b in itertools.pairwise(rows) if a[0] == b[0] and float(a[2]) < fault["unix"] <= float(b[2])
        ]
        return [float(b[2]) - fault["unix"] for a, b in pairs if a[1] == f"s{fault['service']}"]

    def end(self) -> None:
        for service in self.services:
            if service.process and service.process.poll() is None:
                service.end()
        if self.pair:
            self.pair.stop()


def main() -> None:
    """Runs the faults, prints the table and what is broken."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", type=File)
    parser.add_argument("--faults", type=int, default=10, help="how many [default: 10]")
    parser.add_argument("--kind", action="append", help="only of this kind, such as service_stopped; may be repeated")
    parser.add_argument("--seed", type=int, default=1, help="of faults and clients [default: 1]")
    parser.add_argument("--lease-s", type=float, default=2.0, help="of the services, s [default: 2]")
    parser.add_argument("--sqlite", action="store_true", help="one service without a database")
    parser.add_argument("--out", type=File, help="directory for the history and the logs, which is kept")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as temporary:
        folder = (arguments.out or File(temporary)).resolve()
        folder.mkdir(parents=True, exist_ok=True)
        folder.chmod(0o755)
        checker = Checker(arguments, folder)
        try:
            checker.start()
            checker.run()
            broken, table = checker.verdict(), list(checker.table())
        finally:
            checker.end()
            (folder / "history.ndjson").write_text("".join(json.dumps(row) + "\n" for row in checker.history.rows))
    counts = collections.Counter(row["what"] for row in checker.history.rows)
    counts["stored"] = sum(200 <= row["status"] < 300 for row in checker.history.of("sent"))
    print(", ".join(f"{count} {what}" for what, count in counts.items()), *table, sep="\n")
    for claim, count in collections.Counter(claim for claim, _ in broken).items():
        print(f"BROKEN {count} times: {claim}, such as {next(detail for other, detail in broken if other == claim)}")
    if broken:
        sys.exit(1)
    print("every claim holds")


if __name__ == "__main__":
    main()
