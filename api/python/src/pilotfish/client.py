"""The client that waits for its answers."""

from __future__ import annotations

import ssl
import time
from collections.abc import Iterator, Mapping, Sequence
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


class Client:
    """A service that plans and keeps missions.

    `timeout_s` is the time for one answer. When the service is away or has too much to do, calls about a mission are
    sent again for `patience_s`; those that change one have a key, so that they are carried out once. All others are
    sent once. `verify` is httpx's: for HTTPS with a certificate of your own.
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
        """What the surface craft is to steer now. `previous` is the last answer: the service remembers nothing."""
        return self._do(plans.plan(snapshot, previous))

    def validate(self, snapshot: types.PlanRequest) -> types.Validation:
        """What a snapshot is taken for, every default spelled out. Plans nothing."""
        return self._do(plans.validate(snapshot))

    def plan_batch(self, snapshots: Sequence[types.PlanRequest]) -> list[types.PlanResponse | Refused]:
        """A plan for each of up to 64 snapshots, or why there is none."""
        return self._do(plans.plan_batch(snapshots))

    def compare(self, snapshot: types.PlanRequest, previous: types.PlanResponse | None = None) -> Comparison:
        """The plans of the planner and of every line-of-sight law."""
        return self._do(plans.compare(snapshot, previous))

    def limits(self) -> types.ServiceLimits:
        """What the service takes on."""
        return self._do(plans.limits())

    def crafts(self) -> list[types.CraftEntry]:
        """The craft that are known by name."""
        return self._do(plans.crafts())

    def examples(self) -> list[types.ExampleEntry]:
        """Names and titles of snapshots that are ready to plan for."""
        return self._do(plans.examples())

    def example(self, name: str) -> types.PlanRequest:
        """A snapshot that is ready to plan for."""
        return self._do(plans.example(name))

    def missions(self) -> Iterator[types.Mission]:
        """All missions, in the order in which they were made."""
        after: int | None = None
        while True:
            page = self._do(plans.missions(after))
            yield from page["missions"]
            after = page.get("next")
            if after is None:
                return

    def mission(self, id: str, *, finish_at_exit: bool = False) -> Mission:
        """A mission that was made before. It is asked for nothing yet."""
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
        """Makes a mission, of real vehicles or of the simulator. `run` begins it."""
        made = self._do(orders.create(self.patience_s, live, simulated, title, metadata))
        return Mission(self, made["id"], finish_at_exit=finish_at_exit)

    def simulate(
        self,
        scenario: str | Path,
        seed: int = 1,
        *,
        controller: types.Controller = "mpc",
        title: str | None = None,
        finish_at_exit: bool = True,
    ) -> Mission:
        """Makes a mission of the simulator: of a built-in scenario, or of a file of yours, given as its
        `Path`; a law may steer it."""
        simulated = orders.of_scenario(scenario, seed, controller)
        return self.create_mission(simulated=simulated, title=title, finish_at_exit=finish_at_exit)

    def _do(self, steps: Steps[T]) -> T:
        got: Reply | Lost | None = None
        with closing(steps):
            try:
                while True:
                    step = steps.send(got)
                    if isinstance(step, Rest):
                        time.sleep(step.seconds)
                        got = None
                    else:
                        got = self._send(step)
            except StopIteration as end:
                return cast(T, end.value)

    def _send(self, call: Call[Any]) -> Reply | Lost:
        try:
            with self._http.stream(**http.request(call, self.timeout_s)) as response:
                if call.to is None or not response.is_success:
                    return Reply(response.status_code, response.headers, response.read())
                call.to.seek(0)
                call.to.truncate()
                for piece in response.iter_bytes():
                    call.to.write(piece)
                return Reply(response.status_code, response.headers, b"")
        except httpx.RequestError as error:
            return http.lost(error)

    def _events(self, mission: Orders, after: int | None) -> Iterator[Event]:
        if after is None:
            after = self._do(mission.look())["sequence"]
        stream = mission.stream(after)
        while not stream.over:
            got: Reply | Lost | None = None
            try:
                with self._http.stream(**http.request(stream.call(), self.timeout_s)) as response:
                    if response.status_code != http.OK:
                        got = Reply(response.status_code, response.headers, response.read())
                    else:
                        for piece in response.iter_bytes():
                            yield from stream.feed(piece)
                            if stream.over or stream.behind:
                                break
            except httpx.RequestError as error:
                got = http.lost(error)
            time.sleep(stream.ended(got))


class Mission:
    """A mission, which the service keeps. As a context it is finished at the end, unless it was made otherwise."""

    def __init__(self, client: Client, id: str, *, finish_at_exit: bool) -> None:
        self.id = id
        self.finish_at_exit = finish_at_exit
        self._client = client
        self._orders = Orders(id, client.patience_s)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self.finish_at_exit:
            self._client._do(self._orders.end(error))

    def __repr__(self) -> str:
        return f"<Mission {self.id}>"

    def look(self) -> types.Mission:
        """Where it is."""
        return self._client._do(self._orders.look())

    def run(self, speed_factor: float | None = None) -> types.Mission:
        """Begins it, or goes on. A simulated one passes `speed_factor` as fast as life; None: as fast as it can."""
        return self._client._do(self._orders.run(speed_factor))

    def pause(self) -> types.Mission:
        """Holds it."""
        return self._client._do(self._orders.order("pause"))

    def step(self, ticks: int = 1) -> types.Mission:
        """Goes on with a simulated mission for so many plans, from 1 to 60."""
        return self._client._do(self._orders.order("step", {"ticks": ticks}))

    def finish(self) -> types.Mission:
        """Ends it. Its events are kept."""
        return self._client._do(self._orders.order("finish"))

    def delete(self) -> None:
        """Ends it and forgets it."""
        self._client._do(self._orders.delete())

    def change(self, **setting: Unpack[types.Setting]) -> types.Mission:
        """Other orders for a live mission. What is given replaces what was, None leaves none, all else stays."""
        return self._client._do(self._orders.change(setting))

    def report(
        self,
        *,
        auvs: Mapping[str, Sequence[types.Report]] | None = None,
        asc: Sequence[types.AscReport] | None = None,
        received_s: float | None = None,
        key: str | None = None,
    ) -> types.Accepted:
        """Says what was heard in a live mission; returns when it is on the service's disk.

        Every call has a `key` of its own. Give one to send a report again that another process may have sent.
        """
        return self._client._do(self._orders.report(auvs, asc, received_s, key))

    def reference(self, wait_s: float = 0.0, after: int | None = None) -> types.CurrentReference | None:
        """The reference that counts now, with the whole plan; None while there is no plan.

        Waits up to `wait_s`, at most 60 s, for a newer plan than the last, or than that of the event `after`.
        """
        return self._client._do(self._orders.reference(wait_s, after))

    def wait(self, timeout_s: float | None = None) -> types.Mission:
        """Waits until it is over. Raises `MissionFailed` where it failed, `TimeoutError` where it took too long."""
        return self._client._do(self._orders.wait(timeout_s))

    def events(self, after: int | None = 0) -> Iterator[Event]:
        """What happens, until the mission is over: every event after that number once, across broken connections and
        restarts of the service. None: from now on."""
        return self._client._events(self._orders, after)

    def record(self, format: RecordFormat) -> bytes:
        """All of it, in a format for other programs."""
        return self._client._do(self._orders.record(format))

    def save(self, path: str | Path, format: RecordFormat | None = None) -> Path:
        """The same as a file, which may be larger than memory. Without a format, that of the file's ending."""
        return self._client._do(self._orders.save(Path(path), format))

    def frame(self) -> DataFrame:
        """The record as a table of pandas: one row an observation."""
        return frames.of_parquet(self.record("parquet"))
