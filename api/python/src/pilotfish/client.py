"""The client without asyncio.

Generated from aio.py by generate.py: do not edit.
"""

from __future__ import annotations

import ssl
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import replace
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any, Self, TypeVar, Unpack
from urllib.parse import quote

import httpx

from . import frames, http, types
from .comparison import Comparison
from .core import FORMATS, Backoff, Call, NoReply, RecordFormat, Reply, error_of, get, new_key, post
from .errors import MissionFailed, PilotfishError, Refused
from .stream import Event, EventStream

if TYPE_CHECKING:
    from pandas import DataFrame

T = TypeVar("T")

# Between two requests for the status of a mission, s.
POLL_FIRST_S = 0.05
POLL_MAX_S = 1.0


class Client:
    """A service that plans and keeps missions.

    `timeout_s` is the time for one answer. When the service is away or overloaded, calls about a mission are sent
    again for `patience_s`; calls that change a mission carry a key, so that the service carries them out once. All
    other calls are sent once. `verify` is httpx's: for HTTPS with a certificate of your own.
    """

    def __init__(
        self,
        url: str = http.URL,
        token: str | None = None,
        *,
        timeout_s: float = http.TIMEOUT_S,
        patience_s: float = http.PATIENCE_S,
        verify: ssl.SSLContext | bool = True,
    ) -> None:
        self.timeout_s = timeout_s
        self.patience_s = patience_s
        self._http = httpx.Client(**http.settings(url, token, timeout_s, verify))

    def close(self) -> None:
        """Closes the connections."""
        self._http.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def plan(self, snapshot: types.PlanRequest, previous: types.PlanResponse | None = None) -> types.PlanResponse:
        """Speed and heading references for the surface craft. `previous` is the last answer: the service keeps none."""
        return self._ask(post("/v1/plan", _with_previous(snapshot, previous)))

    def plan_fleet(self, fleet: types.FleetRequest, previous: types.FleetResponse | None = None) -> types.FleetResponse:
        """Who serves whom, and references for each surface craft. `previous` is the last answer."""
        return self._ask(post("/v1/plan", _with_previous(fleet, previous)))

    def validate(self, snapshot: types.PlanRequest) -> types.Validation:
        """Checks a snapshot without planning. The answer has the snapshot with its defaults."""
        return self._ask(post("/v1/plan/validate", snapshot))

    def plan_batch(self, snapshots: Sequence[types.PlanRequest]) -> list[types.PlanResponse | Refused]:
        """A plan for each of up to 64 snapshots, or why there is none."""
        answer: types.BatchAnswer = self._ask(post("/v1/plan/batch", {"requests": list(snapshots)}))
        return [item.get("plan") or Refused(item["status"], item.get("problem") or {}) for item in answer["answers"]]

    def compare(self, snapshot: types.PlanRequest, previous: types.PlanResponse | None = None) -> Comparison:
        """The plans of the planner and of every line-of-sight law."""
        return Comparison(self._ask(post("/v1/plan/compare", _with_previous(snapshot, previous))))

    def limits(self) -> types.ServiceLimits:
        """Largest requests and longest times that the service accepts."""
        return self._ask(get("/v1/limits"))

    def crafts(self) -> list[types.CraftEntry]:
        """The built-in craft."""
        answer: types.CraftList = self._ask(get("/v1/crafts"))
        return answer["crafts"]

    def examples(self) -> list[types.ExampleEntry]:
        """Names and titles of the example snapshots."""
        answer: types.ExampleList = self._ask(get("/v1/examples"))
        return answer["examples"]

    def example(self, name: str) -> types.PlanRequest:
        """An example snapshot, ready to plan for."""
        return self._ask(get(f"/v1/examples/{quote(name, safe='')}"))

    def missions(self) -> Iterator[types.Mission]:
        """All missions, in the order in which they were created."""
        after: int | None = None
        while True:
            page: types.MissionList = self._ask(get("/v1/missions", after=after))
            yield from page["missions"]
            after = page.get("next")
            if after is None:
                return

    def mission(self, id: str, *, finish_at_exit: bool = False) -> Mission:
        """A mission that exists already. Sends no request."""
        return Mission(self, id, finish_at_exit=finish_at_exit)

    def create_mission(
        self,
        *,
        live: types.Live | None = None,
        simulated: types.Simulated | None = None,
        title: str | None = None,
        metadata: Mapping[str, Any] | None = None,
        finish_at_exit: bool = True,
    ) -> Mission:
        """Creates a mission, of real vehicles or of the simulator. `run` begins it.

        Either `mission = client.create_mission(…)` or `with client.create_mission(…) as mission:`.
        """
        given = {"live": live, "simulated": simulated, "title": title, "metadata": metadata}
        return self._create({"schema_version": "1.0"} | _without_none(given), finish_at_exit)

    def simulate(
        self,
        scenario: str | Path,
        seed: int = 1,
        *,
        controller: types.Controller = "mpc",
        title: str | None = None,
        finish_at_exit: bool = True,
    ) -> Mission:
        """Creates a mission of the simulator: of a built-in scenario, or of a scenario file, given as a `Path`.

        With `controller`, a line-of-sight law steers it.
        """
        simulated: types.Simulated = {"seed": seed}
        if isinstance(scenario, Path):
            simulated["scenario_file"] = scenario.read_text(encoding="utf-8")
        else:
            simulated["scenario"] = scenario
        if controller != "mpc":
            simulated["controller"] = controller
        return self.create_mission(simulated=simulated, title=title, finish_at_exit=finish_at_exit)

    def _create(self, body: Mapping[str, Any], finish_at_exit: bool) -> Mission:
        created: types.Mission = self._ask(
            post("/v1/missions", body, key=new_key()), self.patience_s, retry_connect=False
        )
        return Mission(self, created["id"], finish_at_exit=finish_at_exit)

    def _ask(self, call: Call[T], patience_s: float = 0.0, *, retry_connect: bool = True) -> T:
        """Sends until there is an answer, for as long as patience lasts.

        Unless `retry_connect`, an address at which nothing listens is tried once.
        """
        backoff = Backoff(patience_s)
        again = False
        while True:
            got = self._send(call)
            error = error_of(got)
            if error is None:
                assert isinstance(got, Reply)
                return call.read(got.body)
            if again and isinstance(error, Refused) and error.code and error.code == call.done:
                return call.read(b"")
            if isinstance(got, NoReply) and not got.connected and not retry_connect:
                raise error
            time.sleep(backoff.pause_after(error))
            again = True

    def _stream(self, call: Call[Any]) -> AbstractContextManager[httpx.Response]:
        return self._http.stream(**http.request(call, self.timeout_s))

    def _send(self, call: Call[Any]) -> Reply | NoReply:
        try:
            with self._stream(call) as response:
                if call.to is None or not response.is_success:
                    return Reply(response.status_code, response.headers, response.read())
                call.to.seek(0)
                call.to.truncate()
                for piece in response.iter_bytes():
                    call.to.write(piece)
                return Reply(response.status_code, response.headers, b"")
        except httpx.RequestError as error:
            return http.no_reply(error)


class Mission:
    """A mission of the service. As a context, it is finished at the end unless `finish_at_exit` is false."""

    def __init__(self, client: Client, id: str, *, finish_at_exit: bool) -> None:
        self.id = id
        self.finish_at_exit = finish_at_exit
        self._client = client
        self._path = f"/v1/missions/{quote(id, safe='')}"

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if not self.finish_at_exit:
            return
        try:
            self.finish()
        except PilotfishError as unfinished:
            if isinstance(unfinished, Refused) and unfinished.code in ("conflict", "no_mission"):
                return
            # An exception that is under way is not replaced.
            if error is None:
                raise
            error.add_note(f"mission {self.id} was not finished: {unfinished}")

    def __repr__(self) -> str:
        return f"<Mission {self.id}>"

    def look(self) -> types.Mission:
        """Its present state."""
        return self._ask(get(self._path))

    def run(self, speed_factor: float | None = None) -> types.Mission:
        """Begins or resumes it. A simulated one runs `speed_factor` times as fast as real time; None: at full speed."""
        return self._command("run", None if speed_factor is None else {"speed_factor": speed_factor})

    def pause(self) -> types.Mission:
        """Pauses it. `run` resumes it."""
        return self._command("pause")

    def step(self, ticks: int = 1) -> types.Mission:
        """Runs a paused simulated mission for so many plans, from 1 to 60."""
        return self._command("step", {"ticks": ticks})

    def finish(self) -> types.Mission:
        """Ends it. Its events are kept."""
        return self._command("finish")

    def delete(self) -> None:
        """Ends it and deletes its events."""
        # A repeated request does not find what the first one deleted.
        self._ask(Call("DELETE", self._path, lambda _: None, done="no_mission"))

    def change(self, **setting: Unpack[types.Setting]) -> types.Mission:
        """Changes a live mission. Given members replace the old ones, None removes one, the others stay."""
        return self._ask(post(self._path, setting, key=new_key(), method="PATCH"))

    def report(
        self,
        *,
        auvs: Mapping[str, Sequence[types.Report]] | None = None,
        asc: Sequence[types.AscReport] | None = None,
        traffic: Sequence[types.Vessel] | None = None,
        notes: Sequence[types.Note] | None = None,
        steering: Sequence[types.Steering] | None = None,
        received_s: float | None = None,
        craft: str | None = None,
        key: str | None = None,
    ) -> types.Accepted:
        """Reports fixes and states to a live mission. Returns when they are on the service's disk.

        `craft` is the one of a fleet that they are from.

        Who steers the craft says so by `steering`, once a second: nobody else knows, and the page shows what was said.
        Each call has its own `key`. Give one to repeat a report that another process may have sent.
        """
        vehicles = {"auvs": auvs, "asc": asc, "traffic": traffic}
        said = {"notes": notes, "steering": steering, "received_s": received_s, "craft": craft}
        body = _without_none({**vehicles, **said})
        return self._ask(post(f"{self._path}/reports", body, key=key or new_key()))

    def reference(
        self, wait_s: float = 0.0, after: int | None = None, craft: str | None = None
    ) -> types.CurrentReference | None:
        """The present reference, with the whole plan; None while there is no plan. A fleet has one for each `craft`.

        Waits up to `wait_s`, at most 60 s, for a newer plan than the last, or than that of the event `after`.
        """
        call = get(f"{self._path}/reference", wait_s=wait_s, after=after, craft=craft)
        try:
            reference: types.CurrentReference = self._ask(replace(call, waits_s=wait_s))
        except Refused as refused:
            if refused.code == "no_plan_yet":
                return None
            raise
        return reference

    def wait(self, timeout_s: float | None = None) -> types.Mission:
        """Waits until it is over. Raises `MissionFailed` if it failed, `TimeoutError` after `timeout_s`."""
        end = None if timeout_s is None else time.monotonic() + timeout_s
        pause = POLL_FIRST_S
        while True:
            mission = self.look()
            if mission["status"] == "failed":
                raise MissionFailed(self.id, self._reason(mission["sequence"]))
            if mission["status"] == "finished":
                return mission
            if end is not None and end < time.monotonic():
                raise TimeoutError(f"mission {self.id} is {mission['status']} after {timeout_s} s")
            time.sleep(pause)
            pause = min(1.5 * pause, POLL_MAX_S)

    def events(self, after: int | None = 0) -> Iterator[Event]:
        """Every event after that number, once and in order, until the mission is over; across broken connections
        and restarts of the service. None: events from now on."""
        if after is None:
            after = (self.look())["sequence"]
        stream = EventStream(self._path, after, self._client.patience_s)
        while not stream.over:
            got: Reply | NoReply | None = None
            try:
                with self._client._stream(stream.call()) as response:
                    if response.status_code != http.OK:
                        got = Reply(response.status_code, response.headers, response.read())
                    else:
                        for piece in response.iter_bytes():
                            yield from stream.feed(piece)
                            if stream.over or stream.behind:
                                break
            except httpx.RequestError as error:
                got = http.no_reply(error)
            time.sleep(stream.ended(got))

    def record(self, format: RecordFormat) -> bytes:
        """The whole record in a format for other programs."""
        return self._ask(get(f"{self._path}/record", bytes, format=format))

    def save(self, path: str | Path, format: RecordFormat | None = None) -> Path:
        """Writes the record to a file, which may be larger than memory. The default format follows the file's suffix.

        The file appears when it is complete.
        """
        path = Path(path)
        which = format or FORMATS.get(path.suffix)
        if which is None:
            raise ValueError(f"{path} does not end in {', '.join(FORMATS)}: give the format")
        part = path.with_name(f"{path.name}.part")
        try:
            with part.open("wb") as file:
                call = get(f"{self._path}/record", bytes, format=which)
                self._ask(replace(call, to=file))
            part.replace(path)
        finally:
            part.unlink(missing_ok=True)
        return path

    def frame(self) -> DataFrame:
        """The record as a pandas table: one row for each observation."""
        return frames.of_parquet(self.record("parquet"))

    def _command(self, name: str, body: object = None) -> types.Mission:
        return self._ask(post(f"{self._path}/{name}", body, key=new_key()))

    def _ask(self, call: Call[T]) -> T:
        return self._client._ask(call, self._client.patience_s)

    def _reason(self, last: int) -> str:
        """Why the mission failed: its last event says so."""
        stream = EventStream(self._path, last - 1, self._client.patience_s)
        for event in stream.feed(self._ask(stream.call())):
            if event.data["kind"] == "failed":
                return event.data["reason"]
        return "its events do not say why"


def _without_none(given: Mapping[str, Any]) -> dict[str, Any]:
    return {name: value for name, value in given.items() if value is not None}


def _with_previous(snapshot: Mapping[str, object], previous: Mapping[str, object] | None) -> Mapping[str, object]:
    return snapshot if previous is None else {**snapshot, "previous_plan": previous}
