"""The client for asyncio. What its methods do stands at those of `Client` and `Mission`."""

from __future__ import annotations

import asyncio
import ssl
from collections.abc import AsyncIterator, Coroutine, Generator, Mapping, Sequence
from contextlib import closing
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any, Self, TypeVar, Unpack, cast

import httpx

from . import frames, http, orders, plans, types
from .comparison import Comparison
from .core import Call, Lost, Reply, Rest, Steps
from .errors import Refused
from .orders import Orders, RecordFormat
from .stream import Event

if TYPE_CHECKING:
    from pandas import DataFrame

T = TypeVar("T")


class AsyncClient:
    """A service that plans and keeps missions. As `Client`."""

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
        await self._http.aclose()

    async def __aenter__(self) -> Self:
        return self

    async def __aexit__(self, *_: object) -> None:
        await self.close()

    async def plan(self, snapshot: types.PlanRequest, previous: types.PlanResponse | None = None) -> types.PlanResponse:
        return await self._do(plans.plan(snapshot, previous))

    async def validate(self, snapshot: types.PlanRequest) -> types.Validation:
        return await self._do(plans.validate(snapshot))

    async def plan_batch(self, snapshots: Sequence[types.PlanRequest]) -> list[types.PlanResponse | Refused]:
        return await self._do(plans.plan_batch(snapshots))

    async def compare(self, snapshot: types.PlanRequest, previous: types.PlanResponse | None = None) -> Comparison:
        return await self._do(plans.compare(snapshot, previous))

    async def limits(self) -> types.ServiceLimits:
        return await self._do(plans.limits())

    async def crafts(self) -> list[types.CraftEntry]:
        return await self._do(plans.crafts())

    async def examples(self) -> list[types.ExampleEntry]:
        return await self._do(plans.examples())

    async def example(self, name: str) -> types.PlanRequest:
        return await self._do(plans.example(name))

    async def missions(self) -> AsyncIterator[types.Mission]:
        after: int | None = None
        while True:
            page = await self._do(plans.missions(after))
            for mission in page["missions"]:
                yield mission
            after = page.get("next")
            if after is None:
                return

    def mission(self, id: str, *, finish_at_exit: bool = False) -> AsyncMission:
        return AsyncMission(self, id, finish_at_exit=finish_at_exit)

    def create_mission(
        self,
        *,
        live: types.Live | None = None,
        simulated: types.Simulated | None = None,
        title: str | None = None,
        metadata: Mapping[str, Any] | None = None,
        finish_at_exit: bool = True,
    ) -> Made:
        """`await client.create_mission(…)`, or `async with client.create_mission(…) as mission:`."""
        creation = orders.create(self.patience_s, live, simulated, title, metadata)
        return Made(self._make(creation, finish_at_exit))

    def simulate(
        self,
        scenario: str | Path,
        seed: int = 1,
        *,
        controller: types.Controller = "mpc",
        title: str | None = None,
        finish_at_exit: bool = True,
    ) -> Made:
        """`await client.simulate(…)`, or `async with client.simulate(…) as mission:`."""
        simulated = orders.of_scenario(scenario, seed, controller)
        return self.create_mission(simulated=simulated, title=title, finish_at_exit=finish_at_exit)

    async def _make(self, creation: Steps[types.Mission], finish_at_exit: bool) -> AsyncMission:
        made = await self._do(creation)
        return AsyncMission(self, made["id"], finish_at_exit=finish_at_exit)

    async def _do(self, steps: Steps[T]) -> T:
        got: Reply | Lost | None = None
        with closing(steps):
            try:
                while True:
                    step = steps.send(got)
                    if isinstance(step, Rest):
                        await asyncio.sleep(step.seconds)
                        got = None
                    else:
                        got = await self._send(step)
            except StopIteration as end:
                return cast(T, end.value)

    async def _send(self, call: Call[Any]) -> Reply | Lost:
        try:
            async with self._http.stream(**http.request(call, self.timeout_s)) as response:
                if call.to is None or not response.is_success:
                    return Reply(response.status_code, response.headers, await response.aread())
                call.to.seek(0)
                call.to.truncate()
                async for piece in response.aiter_bytes():
                    call.to.write(piece)
                return Reply(response.status_code, response.headers, b"")
        except httpx.RequestError as error:
            return http.lost(error)

    async def _events(self, mission: Orders, after: int | None) -> AsyncIterator[Event]:
        if after is None:
            after = (await self._do(mission.look()))["sequence"]
        stream = mission.stream(after)
        while not stream.over:
            got: Reply | Lost | None = None
            try:
                async with self._http.stream(**http.request(stream.call(), self.timeout_s)) as response:
                    if response.status_code != http.OK:
                        got = Reply(response.status_code, response.headers, await response.aread())
                    else:
                        async for piece in response.aiter_bytes():
                            for event in stream.feed(piece):
                                yield event
                            if stream.over or stream.behind:
                                break
            except httpx.RequestError as error:
                got = http.lost(error)
            await asyncio.sleep(stream.ended(got))


class AsyncMission:
    """A mission, which the service keeps. As `Mission`."""

    def __init__(self, client: AsyncClient, id: str, *, finish_at_exit: bool) -> None:
        self.id = id
        self.finish_at_exit = finish_at_exit
        self._client = client
        self._orders = Orders(id, client.patience_s)

    async def __aenter__(self) -> Self:
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self.finish_at_exit:
            await self._client._do(self._orders.end(error))

    def __repr__(self) -> str:
        return f"<AsyncMission {self.id}>"

    async def look(self) -> types.Mission:
        return await self._client._do(self._orders.look())

    async def run(self, speed_factor: float | None = None) -> types.Mission:
        return await self._client._do(self._orders.run(speed_factor))

    async def pause(self) -> types.Mission:
        return await self._client._do(self._orders.order("pause"))

    async def step(self, ticks: int = 1) -> types.Mission:
        return await self._client._do(self._orders.order("step", {"ticks": ticks}))

    async def finish(self) -> types.Mission:
        return await self._client._do(self._orders.order("finish"))

    async def delete(self) -> None:
        await self._client._do(self._orders.delete())

    async def change(self, **setting: Unpack[types.Setting]) -> types.Mission:
        return await self._client._do(self._orders.change(setting))

    async def report(
        self,
        *,
        auvs: Mapping[str, Sequence[types.Report]] | None = None,
        asc: Sequence[types.AscReport] | None = None,
        received_s: float | None = None,
        key: str | None = None,
    ) -> types.Accepted:
        return await self._client._do(self._orders.report(auvs, asc, received_s, key))

    async def reference(self, wait_s: float = 0.0, after: int | None = None) -> types.CurrentReference | None:
        return await self._client._do(self._orders.reference(wait_s, after))

    async def wait(self, timeout_s: float | None = None) -> types.Mission:
        return await self._client._do(self._orders.wait(timeout_s))

    def events(self, after: int | None = 0) -> AsyncIterator[Event]:
        return self._client._events(self._orders, after)

    async def record(self, format: RecordFormat) -> bytes:
        return await self._client._do(self._orders.record(format))

    async def save(self, path: str | Path, format: RecordFormat | None = None) -> Path:
        return await self._client._do(self._orders.save(Path(path), format))

    async def frame(self) -> DataFrame:
        return frames.of_parquet(await self.record("parquet"))


class Made:
    """A mission that is about to be made: to be awaited, or entered as a context."""

    def __init__(self, making: Coroutine[Any, Any, AsyncMission]) -> None:
        self._making = making
        self._mission: AsyncMission | None = None

    def __await__(self) -> Generator[Any, None, AsyncMission]:
        return self._making.__await__()

    async def __aenter__(self) -> AsyncMission:
        self._mission = await self._making
        return await self._mission.__aenter__()

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        assert self._mission is not None, "it was entered"
        await self._mission.__aexit__(kind, error, trace)
