"""Calls about a mission. They are sent again, with the same key, as long as patience lasts: nothing happens twice."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Literal, TypeAlias
from urllib.parse import quote

from . import types
from .core import Call, Rest, Steps, ask, get, new_key, post
from .errors import MissionFailed, PilotfishError, Refused
from .stream import EventStream

RecordFormat: TypeAlias = Literal["csv", "parquet", "ndjson", "mcap", "geojson", "events_ndjson"]

FORMATS: Mapping[str, RecordFormat] = {
    ".csv": "csv",
    ".parquet": "parquet",
    ".ndjson": "ndjson",
    ".mcap": "mcap",
    ".geojson": "geojson",
}

# Between two looks at a mission that is waited for, s.
LOOK_FIRST_S = 0.05
LOOK_MAX_S = 1.0


def create(
    patience_s: float,
    live: types.Live | None = None,
    simulated: types.Simulated | None = None,
    title: str | None = None,
    metadata: Mapping[str, Any] | None = None,
) -> Steps[types.Mission]:
    """Makes a mission. A service that was never there is not waited for."""
    given = {"live": live, "simulated": simulated, "title": title, "metadata": metadata}
    body = {"schema_version": "1.0"} | {name: value for name, value in given.items() if value is not None}
    return ask(post("/v1/missions", body, key=new_key()), patience_s, unmet=False)


def of_scenario(scenario: str | Path, seed: int, controller: types.Controller) -> types.Simulated:
    """A built-in scenario by its name, or one of a file."""
    simulated: types.Simulated = {"seed": seed}
    if isinstance(scenario, Path):
        simulated["scenario_file"] = scenario.read_text(encoding="utf-8")
    else:
        simulated["scenario"] = scenario
    if controller != "mpc":
        simulated["controller"] = controller
    return simulated


class Orders:
    """What can be asked of one mission."""

    def __init__(self, mission: str, patience_s: float) -> None:
        self.mission = mission
        self.patience_s = patience_s
        self.path = f"/v1/missions/{quote(mission, safe='')}"

    def look(self) -> Steps[types.Mission]:
        return ask(get(self.path), self.patience_s)

    def order(self, what: str, body: object = None) -> Steps[types.Mission]:
        return ask(post(f"{self.path}/{what}", body, key=new_key()), self.patience_s)

    def run(self, speed_factor: float | None) -> Steps[types.Mission]:
        return self.order("run", None if speed_factor is None else {"speed_factor": speed_factor})

    def change(self, setting: types.Setting) -> Steps[types.Mission]:
        return ask(post(self.path, setting, key=new_key(), method="PATCH"), self.patience_s)

    def report(
        self,
        auvs: Mapping[str, Sequence[types.Report]] | None,
        asc: Sequence[types.AscReport] | None,
        received_s: float | None,
        key: str | None,
    ) -> Steps[types.Accepted]:
        given = {"auvs": auvs, "asc": asc, "received_s": received_s}
        body = {name: value for name, value in given.items() if value is not None}
        return ask(post(f"{self.path}/reports", body, key=key or new_key()), self.patience_s)

    def reference(self, wait_s: float, after: int | None) -> Steps[types.CurrentReference | None]:
        call = get(f"{self.path}/reference", wait_s=wait_s, after=after)
        try:
            reference: types.CurrentReference = yield from ask(replace(call, waits_s=wait_s), self.patience_s)
        except Refused as refused:
            if refused.code == "no_plan_yet":
                return None
            raise
        return reference

    def wait(self, timeout_s: float | None) -> Steps[types.Mission]:
        """Looks until the mission is over."""
        end = None if timeout_s is None else time.monotonic() + timeout_s
        rest = LOOK_FIRST_S
        while True:
            mission = yield from self.look()
            if mission["status"] == "failed":
                raise MissionFailed(self.mission, (yield from self._reason(mission["sequence"])))
            if mission["status"] == "finished":
                return mission
            if end is not None and end < time.monotonic():
                raise TimeoutError(f"mission {self.mission} is {mission['status']} after {timeout_s} s")
            yield Rest(rest)
            rest = min(1.5 * rest, LOOK_MAX_S)

    def _reason(self, last: int) -> Steps[str]:
        """Why the mission failed, as its last event says."""
        stream = self.stream(last - 1)
        body = yield from ask(stream.call(), self.patience_s)
        for event in stream.feed(body):
            if event.data["kind"] == "failed":
                return event.data["reason"]
        return "its events do not say why"

    def end(self, error: BaseException | None) -> Steps[None]:
        """Finishes the mission, if it is there and not over. An error that is on its way already is not replaced."""
        try:
            yield from self.order("finish")
        except PilotfishError as unfinished:
            if isinstance(unfinished, Refused) and unfinished.code in ("conflict", "no_mission"):
                return
            if error is None:
                raise
            error.add_note(f"mission {self.mission} was not finished: {unfinished}")

    def delete(self) -> Steps[None]:
        # What an earlier try deleted is not found by the next.
        return ask(Call("DELETE", self.path, lambda _: None, done="no_mission"), self.patience_s)

    def record(self, format: RecordFormat) -> Steps[bytes]:
        return ask(get(f"{self.path}/record", bytes, format=format), self.patience_s)

    def save(self, path: Path, format: RecordFormat | None) -> Steps[Path]:
        """Writes the record to a file, which is there when it is whole."""
        which = format or FORMATS.get(path.suffix)
        if which is None:
            raise ValueError(f"{path} does not end in {', '.join(FORMATS)}: say the format")
        part = path.with_name(f"{path.name}.part")
        try:
            with part.open("wb") as file:
                call = get(f"{self.path}/record", bytes, format=which)
                yield from ask(replace(call, to=file), self.patience_s)
            part.replace(path)
        finally:
            part.unlink(missing_ok=True)
        return path

    def stream(self, after: int) -> EventStream:
        return EventStream(self.path, after, self.patience_s)
