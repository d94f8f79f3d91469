"""The client for asyncio. `generate.py` makes client.py, the client without asyncio, of this file."""

from __future__ import annotations

import asyncio
import ssl
import time
from collections.abc import AsyncIterator, Coroutine, Generator, Mapping, Sequence
from contextlib import AbstractAsyncContextManager
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


class AsyncClient:
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
        self._http = httpx.AsyncClient(**http.settings(url, token, timeout_s, verify))

    async def close(self) -> None:
        """Closes the connections."""
        await self._http.aclose()

    async def __aenter__(self) -> Self:
        return self

    async def __aexit__(self, *_: object) -> None:
        await self.close()

    async def plan(self, snapshot: types.PlanRequest, previous: types.PlanResponse | None = None) -> types.PlanResponse:
        """Speed and heading references for the surface craft. `previous` is the last answer: the service keeps none."""
        return await self._ask(post("/v1/plan", _with_previous(snapshot, previous)))

    async def plan_fleet(
        self, fleet: types.FleetRequest, previous: types.FleetResponse | None = None
    ) -> types.FleetResponse:
        """Who serves whom, and references for each surface craft. `previous` is the last answer."""
        return await self._ask(post("/v1/plan", _with_previous(fleet, previous)))

    async def validate(self, snapshot: types.PlanRequest) -> types.Validation:
        """Checks a snapshot without planning. The answer has the snapshot with its defaults."""
        return await self._ask(post("/v1/plan/validate", snapshot))

    async def plan_batch(self, snapshots: Sequence[types.PlanRequest]) -> list[types.PlanResponse | Refused]:
        """A plan for each of up to 64 snapshots, or why there is none."""
        answer: types.BatchAnswer = await self._ask(post("/v1/plan/batch", {"requests": list(snapshots)}))
        return [item.get("plan") or Refused(item["status"], item.get("problem") or {}) for item in answer["answers"]]

    async def compare(self, snapshot: types.PlanRequest, previous: types.PlanResponse | None = None) -> Comparison:
        """The plans of the planner and of every line-of-sight law."""
        return Comparison(await self._ask(post("/v1/plan/compare", _with_previous(snapshot, previous))))

    async def limits(self) -> types.ServiceLimits:
        """Largest requests and longest times that the service accepts."""
        return await self._ask(get("/v1/limits"))

    async def crafts(self) -> list[types.CraftEntry]:
        """The built-in craft."""
        answer: types.CraftList = await self._ask(get("/v1/crafts"))
        return answer["crafts"]

    async def examples(self) -> list[types.ExampleEntry]:
        """Names and titles of the example snapshots."""
        answer: types.ExampleList = await self._ask(get("/v1/examples"))
        return answer["examples"]

    async def example(self, name: str) -> types.PlanRequest:
        """An example snapshot, ready to plan for."""
        return await self._ask(get(f"/v1/examples/{quote(name, safe='')}"))

    async def missions(self) -> AsyncIterator[types.Mission]:
        """All missions, in the order in which they were created."""
        after: int | None = None
        while True:
            page: types.MissionList = await self._ask(get("/v1/missions", after=after))
            for mission in page["missions"]:
                yield mission
            after = page.get("next")
            if after is None:
                return

    def mission(self, id: str, *, finish_at_exit: bool = False) -> AsyncMission:
        """A mission that exists already. Sends no request."""
        return AsyncMission(self, id, finish_at_exit=finish_at_exit)

    def create_mission(
        self,
        *,
        live: types.Live | None = None,
        simulated: types.Simulated | None = None,
        title: str | None = None,
        metadata: Mapping[str, Any] | None = None,
        finish_at_exit: bool = True,
    ) -> Creation:
        """Creates a mission, of real vehicles or of the simulator. `run` begins it.

        Either `mission = await client.create_mission(…)` or `async with client.create_mission(…) as mission:`.
        """
        given = {"live": live, "simulated": simulated, "title": title, "metadata": metadata}
        return Creation(self._create({"schema_version": "1.0"} | _without_none(given), finish_at_exit))

    def simulate(
        self,
        scenario: str | Path,
        seed: int = 1,
        *,
        controller: types.Controller = "mpc",
        title: str | None = None,
        finish_at_exit: bool = True,
    ) -> Creation:
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

    async def _create(self, body: Mapping[str, Any], finish_at_exit: bool) -> AsyncMission:
        created: types.Mission = await self._ask(
            post("/v1/missions", body, key=new_key()), self.patience_s, retry_connect=False
        )
        return AsyncMission(self, created["id"], finish_at_exit=finish_at_exit)

    async def _ask(self, call: Call[T], patience_s: float = 0.0, *, retry_connect: bool = True) -> T:
        """Sends until there is an answer, for as long as patience lasts.

        Unless `retry_connect`, an address at which nothing listens is tried once.
        """
        backoff = Backoff(patience_s)
        again = False
        while True:
            got = await self._send(call)
            error = error_of(got)
            if error is None:
                assert isinstance(got, Reply)
                return call.read(got.body)
            if again and isinstance(error, Refused) and error.code and error.code == call.done:
                return call.read(b"")
            if isinstance(got, NoReply) and not got.connected and not retry_connect:
                raise error
            await asyncio.sleep(backoff.pause_after(error))
            again = True

    def _stream(self, call: Call[Any]) -> AbstractAsyncContextManager[httpx.Response]:
        return self._http.stream(**http.request(call, self.timeout_s))

    async def _send(self, call: Call[Any]) -> Reply | NoReply:
        try:
            async with self._stream(call) as response:
                if call.to is None or not response.is_success:
                    return Reply(response.status_code, response.headers, await response.aread())
                call.to.seek(0)
                call.to.truncate()
                async for piece in response.aiter_bytes():
                    call.to.write(piece)
                return Reply(response.status_code, response.headers, b"")
        except httpx.RequestError as error:
            return http.no_reply(error)


class AsyncMission:
    """A mission of the service. As a context, it is finished at the end unless `finish_at_exit` is false."""

    def __init__(self, client: AsyncClient, id: str, *, finish_at_exit: bool) -> None:
        self.id = id
        self.finish_at_exit = finish_at_exit
        self._client = client
        self._path = f"/v1/missions/{quote(id, safe='')}"

    async def __aenter__(self) -> Self:
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if not self.finish_at_exit:
            return
        try:
            await self.finish()
        except PilotfishError as unfinished:
            if isinstance(unfinished, Refused) and unfinished.code in ("conflict", "no_mission"):
                return
            # An exception that is under way is not replaced.
            if error is None:
                raise
            error.add_note(f"mission {self.id} was not finished: {unfinished}")

    def __repr__(self) -> str:
        return f"<AsyncMission {self.id}>"

    async def look(self) -> types.Mission:
        """Its present state."""
        return await self._ask(get(self._path))

    async def run(self, speed_factor: float | None = None) -> types.Mission:
        """Begins or resumes it. A simulated one runs `speed_factor` times as fast as real time; None: at full speed."""
        return await self._command("run", None if speed_factor is None else {"speed_factor": speed_factor})

    async def pause(self) -> types.Mission:
        """Pauses it. `run` resumes it."""
        return await self._command("pause")

    async def step(self, ticks: int = 1) -> types.Mission:
        """Runs a paused simulated mission for so many plans, from 1 to 60."""
        return await self._command("step", {"ticks": ticks})

    async def finish(self) -> types.Mission:
        """Ends it. Its events are kept."""
        return await self._command("finish")

    async def delete(self) -> None:
        """Ends it and deletes its events."""
        # A repeated request does not find what the first one deleted.
        await self._ask(Call("DELETE", self._path, lambda _: None, done="no_mission"))

    async def change(self, **setting: Unpack[types.Setting]) -> types.Mission:
        """Changes a live mission. Given members replace the old ones, None removes one, the others stay."""
        return await self._ask(post(self._path, setting, key=new_key(), method="PATCH"))

    async def report(
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
        return await self._ask(post(f"{self._path}/reports", body, key=key or new_key()))

    async def reference(
        self, wait_s: float = 0.0, after: int | None = None, craft: str | None = None
    ) -> types.CurrentReference | None:
        """The present reference, with the whole plan; None while there is no plan. A fleet has one for each `craft`.

        Waits up to `wait_s`, at most 60 s, for a newer plan than the last, or than that of the event `after`.
        """
        call = get(f"{self._path}/reference", wait_s=wait_s, after=after, craft=craft)
        try:
            reference: types.CurrentReference = await self._ask(replace(call, waits_s=wait_s))
        except Refused as refused:
            if refused.code == "no_plan_yet":
                return None
            raise
        return reference

    async def wait(self, timeout_s: float | None = None) -> types.Mission:
        """Waits until it is over. Raises `MissionFailed` if it failed, `TimeoutError` after `timeout_s`."""
        end = None if timeout_s is None else time.monotonic() + timeout_s
        pause = POLL_FIRST_S
        while True:
            mission = await self.look()
            if mission["status"] == "failed":
                raise MissionFailed(self.id, await self._reason(mission["sequence"]))
            if mission["status"] == "finished":
                return mission
            if end is not None and end < time.monotonic():
                raise TimeoutError(f"mission {self.id} is {mission['status']} after {timeout_s} s")
            await asyncio.sleep(pause)
            pause = min(1.5 * pause, POLL_MAX_S)

    async def events(self, after: int | None = 0) -> AsyncIterator[Event]:
        """Every event after that number, once and in order, until the mission is over; across broken connections
        and restarts of the service. None: events from now on."""
        if after is None:
            after = (await self.look())["sequence"]
        stream = EventStream(self._path, after, self._client.patience_s)
        while not stream.over:
            got: Reply | NoReply | None = None
            try:
                async with self._client._stream(stream.call()) as response:
                    if response.status_code != http.OK:
                        got = Reply(response.status_code, response.headers, await response.aread())
                    else:
                        async for piece in response.aiter_bytes():
                            for event in stream.feed(piece):
                                yield event
                            if stream.over or stream.behind:
                                break
            except httpx.RequestError as error:
                got = http.no_reply(error)
            await asyncio.sleep(stream.ended(got))

    async def record(self, format: RecordFormat) -> bytes:
        """The whole record in a format for other programs."""
        return await self._ask(get(f"{self._path}/record", bytes, format=format))

    async def save(self, path: str | Path, format: RecordFormat | None = None) -> Path:
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
                await self._ask(replace(call, to=file))
            part.replace(path)
        finally:
            part.unlink(missing_ok=True)
        return path

    async def frame(self) -> DataFrame:
        """The record as a pandas table: one row for each observation."""
        return frames.of_parquet(await self.record("parquet"))

    async def _command(self, name: str, body: object = None) -> types.Mission:
        return await self._ask(post(f"{self._path}/{name}", body, key=new_key()))

    async def _ask(self, call: Call[T]) -> T:
        return await self._client._ask(call, self._client.patience_s)

    async def _reason(self, last: int) -> str:
        """Why the mission failed: its last event says so."""
        stream = EventStream(self._path, last - 1, self._client.patience_s)
        for event in stream.feed(await self._ask(stream.call())):
            if event.data["kind"] == "failed":
                return event.data["reason"]
        return "its events do not say why"


def _without_none(given: Mapping[str, Any]) -> dict[str, Any]:
    return {name: value for name, value in given.items() if value is not None}


def _with_previous(snapshot: Mapping[str, object], previous: Mapping[str, object] | None) -> Mapping[str, object]:
    return snapshot if previous is None else {**snapshot, "previous_plan": previous}


class Creation:
    """A mission that is being created: await it, or enter it as a context. client.py has no such class."""

    def __init__(self, creating: Coroutine[Any, Any, AsyncMission]) -> None:
        self._creating = creating
        self._mission: AsyncMission | None = None

    def __await__(self) -> Generator[Any, None, AsyncMission]:
        return self._creating.__await__()

    async def __aenter__(self) -> AsyncMission:
        self._mission = await self._creating
        return await self._mission.__aenter__()

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        assert self._mission is not None, "it was entered"
        await self._mission.__aexit__(kind, error, trace)
