"""The live mission in the service: reports out, plans in, on threads of their own: a slow service delays no message."""

from __future__ import annotations

import hashlib
import json
import threading
import time
from collections import deque
from collections.abc import Callable
from typing import Any

from .following import Plan
from .pilotfish import Client, Mission, PilotfishError, Refused

# Members of a mission's metadata by which a node finds its own: its name, and the digest of what was asked for.
NAME, DIGEST = "bridge", "bridge_setup"
# Reports of one AUV, and notes, that wait for the service; it accepts as many in one request.
WAITING_MAX = 64
# How long the service may hold a request for a plan; between two tries, s.
PLAN_WAIT_S, RETRY_S = 2.0, 1.0


class NoMission(Exception):
    """The mission cannot be kept."""


class MissionLink:
    """A mission that is kept by two threads until the program ends.

    `body` is that of `POST /v1/missions`; `mission_id`, if not empty, joins a mission instead. Read `plan`, `status`,
    `trouble` and `failed` at any time.
    """

    def __init__(
        self,
        client: Client,
        name: str,
        body: dict[str, Any],
        mission_id: str,
        interval_s: float,
        log: Callable[[str], None],
    ) -> None:
        self.plan: Plan | None = None
        self.status = "not found yet"
        self.has_planned = False
        self.trouble = ""
        """Why the service did not answer the last request."""
        self.failed = ""
        """Why there can be no such mission."""
        self._client, self._name, self._body, self._id = client, name, body, mission_id
        self._interval_s, self._log = interval_s, log
        self._lock = threading.Lock()
        self._asc: dict[str, Any] | None = None
        self._auvs: dict[str, deque[dict[str, Any]]] = {}
        self._vessels: dict[str, dict[str, Any]] = {}
        self._notes: deque[dict[str, Any]] = deque(maxlen=WAITING_MAX)
        self._steering: dict[str, Any] | None = None
        self._orders: deque[tuple[str, Callable[[Mission], Any]]] = deque(maxlen=WAITING_MAX)

    def start(self) -> None:
        """Starts both threads."""
        threading.Thread(target=self._run, daemon=True).start()

    def report_craft(self, report: dict[str, Any]) -> None:
        """Posts a state of the craft soon; a newer one replaces it."""
        with self._lock:
            self._asc = report

    def report_auv(self, auv: str, report: dict[str, Any]) -> None:
        """Posts a fix soon."""
        with self._lock:
            self._auvs.setdefault(auv, deque(maxlen=WAITING_MAX)).append(report)

    def report_vessel(self, vessel: str, report: dict[str, Any]) -> None:
        """Posts where another vessel is soon; a newer report replaces it."""
        with self._lock:
            if vessel in self._vessels or len(self._vessels) < WAITING_MAX:
                self._vessels[vessel] = {"id": vessel} | report

    def note(self, t_s: float, text: str) -> None:
        """Writes into the mission's log soon."""
        with self._lock:
            self._notes.append({"t_s": t_s, "text": text})

    def report_steering(self, word: dict[str, Any]) -> None:
        """Posts soon whether the craft is steered; a newer word replaces it."""
        with self._lock:
            self._steering = word

    def order(self, words: str, call: Callable[[Mission], Any]) -> None:
        """Gives the mission an order soon, once; the log says what became of it."""
        self._orders.append((words, call))

    def _obey(self, mission: Mission) -> None:
        while self._orders:
            words, call = self._orders.popleft()
            try:
                status = call(mission)["status"]
            except (PilotfishError, TypeError, ValueError) as error:
                self._log(f"{words}: not done: {error}")
            else:
                # A pause ends the references at once, not after the request for a plan that is under way.
                if status != "running":
                    self.status = status
                self._log(f"{words}: done")

    def _run(self) -> None:
        try:
            mission = self._insist(self._find)
        except (NoMission, Refused) as error:
            self.failed = str(error)
            return
        self._log(f"mission {mission.id}")
        threading.Thread(target=self._follow_plans, args=(mission,), daemon=True).start()
        while True:
            started_s = time.monotonic()
            self._post(mission)
            self._obey(mission)
            time.sleep(max(self._interval_s - (time.monotonic() - started_s), 0.0))

    def _insist(self, call: Callable[[], Any]) -> Any:
        """Repeats a call until the service answers."""
        while True:
            try:
                answer = call()
            except Refused as error:
                # Too busy is an answer, too, but not the last word.
                if error.status < 500 and error.status != 429:
                    raise
                self.trouble = str(error)
            except PilotfishError as error:
                self.trouble = str(error)
            else:
                self.trouble = ""
                return answer
            time.sleep(RETRY_S)

    def _find(self) -> Mission:
        """Joins, continues or creates the mission, and starts it if it is new."""
        client = self._client
        if self._id:
            found, mission = client.mission(self._id).look(), client.mission(self._id)
        else:
            digest = hashlib.sha256(json.dumps(self._body, sort_keys=True).encode()).hexdigest()
            ours = (
                mission
                for mission in client.missions()
                if (mission.get("metadata") or {}).get(NAME) == self._name
                and mission["status"] not in ("finished", "failed")
            )
            if (found := next(ours, None)) is None:
                metadata = (self._body.get("metadata") or {}) | {NAME: self._name, DIGEST: digest}
                title = self._body.get("title", self._name)
                mission = client.create_mission(
                    live=self._body["live"], title=title, metadata=metadata, finish_at_exit=False
                )
                found = mission.look()
            elif found["metadata"].get(DIGEST) != digest:
                raise NoMission(
                    f"mission {found['id']} has the name {self._name!r} and another setup: "
                    "finish it or choose another name"
                )
            else:
                mission = client.mission(found["id"])
        self.status = found["status"]
        if self.status == "created":
            self.status = mission.run()["status"]
        return mission

    def _post(self, mission: Mission) -> None:
        with self._lock:
            auvs = {auv: list(reports) for auv, reports in self._auvs.items()}
            vessels, asc = list(self._vessels.values()), self._asc
            notes, steering = list(self._notes), self._steering
            self._asc = self._steering = None
            self._auvs.clear()
            self._vessels.clear()
            self._notes.clear()
        known, said = [asc] if asc else [], [steering] if steering else []
        if not (auvs or vessels or known or notes or said):
            return
        key = f"ros2-{time.time_ns()}"
        try:
            reports = {"auvs": auvs, "asc": known, "traffic": vessels, "notes": notes, "steering": said}
            accepted = self._insist(lambda: mission.report(**reports, key=key))
        except Refused as error:
            self._log(f"all reports rejected by the service: {error}")
            return
        # The others are stored.
        for fault in accepted.get("rejected", []):
            self._log(f"report rejected by the service: {fault['pointer']}: {fault['detail']}")

    def _follow_plans(self, mission: Mission) -> None:
        after = 0
        while True:
            try:
                answer = mission.reference(PLAN_WAIT_S, after)
                now_s = time.monotonic()
                if answer is None:
                    self.status = mission.look()["status"]
                else:
                    self.status = answer["status"]
                    # A mission that does not run makes no plans, and its last one is not followed.
                    # A plan older than the last one is not taken, as from a service that lost the mission.
                    if self.status != "running":
                        self.plan = None
                    elif after <= answer["sequence"]:
                        self.plan = Plan.from_answer(answer, now_s)
                    self.has_planned = True
                    is_new, after = answer["sequence"] > after, max(after, answer["sequence"])
                    if is_new:
                        continue
            except PilotfishError as error:
                self.trouble = str(error)
            time.sleep(RETRY_S)
