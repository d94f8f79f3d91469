"""Clients of live missions that ask one service after another, and the history of what they were told."""

import contextlib
import hashlib
import http.client
import itertools
import json
import random
import threading
import time

from shared_missions import HOST

TIMEOUT = 2.5  # of a client, as the bridge has it, s
PAUSE = 0.4  # between two reports of a client, s


class History:
    """What clients and faults did, with times of one monotonic clock."""

    def __init__(self) -> None:
        self.rows, self.lock, self.is_over = [], threading.Lock(), threading.Event()

    def add(self, what: str, **row: object) -> None:
        with self.lock:
            self.rows.append({"what": what, "at": time.monotonic(), **row})

    def of(self, what: str) -> list[dict]:
        with self.lock:
            return [row for row in self.rows if row["what"] == what]


class Client(threading.Thread):
    """Asks one service after another about one mission."""

    def __init__(self, number: int, mission: str, ports: list[int], history: History, seed: int):
        super().__init__(daemon=True)
        self.number, self.mission, self.ports, self.history = number, mission, ports, history
        self.at, self.draw = number % len(ports), random.Random(f"{seed} {number}")
        self.threads = [threading.Thread(target=each, daemon=True) for each in (self.report, self.look, self.watch)]

    def run(self) -> None:
        for thread in self.threads:
            thread.start()
        for thread in self.threads:
            thread.join()

    def ask(
        self, method: str, path: str, body: object = None, key: str = "", at: int | None = None
    ) -> tuple[int, dict, int]:
        """Status, answer and which service gave it. After none, or a 5xx, the next service is asked from then on."""
        at = self.at if at is None else at
        link = http.client.HTTPConnection(HOST, self.ports[at], timeout=TIMEOUT)
        try:
            headers = {"content-type": "application/json"} | ({"idempotency-key": key} if key else {})
            link.request(method, f"/v1/missions{path}", json.dumps(body) if body is not None else None, headers)
            answer = link.getresponse()
            status, text = answer.status, answer.read()
            if status < 500 and status != 429:
                return status, json.loads(text) if text else {}, at
            error = f"{status} {text[:120]!r}"
        except (OSError, http.client.HTTPException, ValueError) as broken:
            status, error = 0, repr(broken)[:120]
        finally:
            link.close()
        self.history.add("unanswered", client=self.number, service=at, status=status, error=error)
        self.at = (at + 1) % len(self.ports)
        return 0, {}, at

    def report(self) -> None:
        for count in itertools.count():
            if self.history.is_over.wait(PAUSE):
                return
            key, method, path, body = f"c{self.number}-{count}", "POST", f"/{self.mission}/reports", self.heard(count)
            if count % 5 == 4:
                method, path = "PATCH", f"/{self.mission}"
                # Out of the craft's way, and different each time.
                body = {"keep_outs": [{"north_m": 5e3 + self.number, "east_m": 1e3 + count, "radius_m": 4.0}]}
            begin, status, answer = time.monotonic(), 0, {}
            self.history.add("begun", mission=self.mission, key=key)
            while status == 0 and not self.history.is_over.is_set():
                status, answer, at = self.ask(method, path, body, key)
                time.sleep(0.0 if status else 0.3)
            row = {
                "client": self.number,
                "mission": self.mission,
                "key": key,
                "is_order": method == "PATCH",
                "begin": begin,
            }
            is_stored = 200 <= status < 300
            self.history.add(
                "sent",
                **row,
                status=status,
                service=at,
                sequence=answer.get("sequence") if is_stored else None,
                answer=answer,
            )
            if is_stored and self.draw.random() < 0.1:
                again, repeated, _ = self.ask(method, path, body, key, (at + 1) % len(self.ports))
                if again and repeated.get("sequence") != answer.get("sequence"):
                    self.history.add(
                        "broken",
                        claim="a repeated key gets another answer",
                        detail=f"{key}: {answer} {again} {repeated}",
                    )

    def heard(self, count: int) -> dict:
        now = time.time()
        craft = {
            "north_m": 0.0,
            "east_m": 0.0,
            "heading_rad": 0.0,
            "speed_mps": 0.2,
            "sway_mps": 0.0,
            "yaw_rate_radps": 0.0,
        }
        fix = {
            "t_s": now,
            "north_m": 20.0 + self.draw.gauss(0, 1),
            "east_m": -20.0 + self.draw.gauss(0, 1),
            "sigma_m": 1.5,
        }
        note = {"t_s": now, "text": f"c{self.number}-{count}"}
        return {"notes": [note], "auvs": {"auv-1": [fix]}, "asc": [{"t_s": now, "state": craft}]}

    def look(self) -> None:
        newest = 0
        while not self.history.is_over.is_set():
            begin = time.monotonic()
            at = self.draw.randrange(len(self.ports)) if self.draw.random() < 0.2 else None
            status, answer, at = self.ask("GET", f"/{self.mission}/reference?wait_s=1&after={newest}", at=at)
            if status != 200:
                time.sleep(0.3)
                continue
            newest, plan = max(newest, answer["sequence"]), answer["plan"]["reference"]
            valid = plan["valid_until_s"] - answer["t_s"]
            row = {
                "client": self.number,
                "mission": self.mission,
                "service": at,
                "begin": begin,
                "sequence": answer["sequence"],
            }
            self.history.add(
                "reference",
                **row,
                valid=valid,
                age=answer["age_s"],
                speed=plan["speed_mps"],
                heading=plan["heading_rad"],
            )
            time.sleep(0.1)

    def watch(self) -> None:
        last, at = 0, self.at
        while not self.history.is_over.is_set():
            drops = time.monotonic() + self.draw.uniform(20, 40)
            with contextlib.suppress(OSError, http.client.HTTPException):
                # A mission plans every second: silence means a link or an owner that is gone.
                link = http.client.HTTPConnection(HOST, self.ports[at], timeout=2 * TIMEOUT)
                link.request("GET", f"/v1/missions/{self.mission}/events", headers={"last-event-id": str(last)})
                answer, fields = link.getresponse(), {}
                while answer.status == 200 and time.monotonic() < drops and not self.history.is_over.is_set():
                    line = answer.readline()
                    if not line:
                        break
                    name, _, value = line.decode().rstrip("\n").partition(": ")
                    fields[name] = value
                    if not name and "data" in fields:
                        last, fields = self.event(last, at, fields), {}
                link.close()
            time.sleep(0.3)
            at = (at + 1) % len(self.ports)

    def event(self, last: int, at: int, fields: dict) -> int:
        row = {"client": self.number, "mission": self.mission, "service": at, "after": last}
        if fields.get("event") == "gap":
            gap = json.loads(fields["data"])
            self.history.add("gap", **row, gap=gap)
            return max(value for value in gap.values() if isinstance(value, int))
        sequence, digest = int(fields["id"]), hashlib.sha256(fields["data"].encode()).hexdigest()
        kind = fields.get("event")
        self.history.add("event", **row, sequence=sequence, kind=kind, digest=digest)
        return sequence
