"""Calls that plan, and those that tell of the service. Each is sent once: an old plan is of no use to anyone."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from urllib.parse import quote

from . import types
from .comparison import Comparison
from .core import Steps, ask, get, post
from .errors import Refused


def plan(snapshot: types.PlanRequest, previous: types.PlanResponse | None) -> Steps[types.PlanResponse]:
    return ask(post("/v1/plan", _after(previous, snapshot)))


def validate(snapshot: types.PlanRequest) -> Steps[types.Validation]:
    return ask(post("/v1/plan/validate", snapshot))


def compare(snapshot: types.PlanRequest, previous: types.PlanResponse | None) -> Steps[Comparison]:
    answer: types.Comparison = yield from ask(post("/v1/plan/compare", _after(previous, snapshot)))
    return Comparison(answer)


def _after(previous: types.PlanResponse | None, snapshot: types.PlanRequest) -> Mapping[str, object]:
    """The snapshot with the answer before it."""
    return snapshot if previous is None else {**snapshot, "previous_plan": previous}


def plan_batch(snapshots: Sequence[types.PlanRequest]) -> Steps[list[types.PlanResponse | Refused]]:
    answer: types.BatchAnswer = yield from ask(post("/v1/plan/batch", {"requests": list(snapshots)}))
    return [item.get("plan") or Refused(item["status"], item.get("problem") or {}) for item in answer["answers"]]


def limits() -> Steps[types.ServiceLimits]:
    return ask(get("/v1/limits"))


def crafts() -> Steps[list[types.CraftEntry]]:
    answer: types.CraftList = yield from ask(get("/v1/crafts"))
    return answer["crafts"]


def examples() -> Steps[list[types.ExampleEntry]]:
    answer: types.ExampleList = yield from ask(get("/v1/examples"))
    return answer["examples"]


def example(name: str) -> Steps[types.PlanRequest]:
    return ask(get(f"/v1/examples/{quote(name, safe='')}"))


def missions(after: int | None) -> Steps[types.MissionList]:
    return ask(get("/v1/missions", after=after))
