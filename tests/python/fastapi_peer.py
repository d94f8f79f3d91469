"""`POST /v1/plan` in FastAPI: the service that a Python programmer would put in Pilotfish's place.

    PEER=hand   uvicorn fastapi_peer:app --workers 2 --no-access-log    # the cone program written by hand
    PEER=cvxpy  uvicorn fastapi_peer:app --workers 2 --no-access-log    # the same stated in CVXPY, parameters reused

The plan is `peer_planner`'s, from the snapshot alone: nothing of it comes from Pilotfish. What it does less is said there.

A plan is nothing but work for the processor, so that it runs in the event loop itself: a thread would only add its
switches. The body goes from bytes to checked models in one step of pydantic's core, and out by orjson. `GET /parts` says
what processor time read, plan and write took, of all workers that share the directory `PEER_PARTS`.
"""

import mmap
import os
import tempfile
import time
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path as File
from typing import Annotated, Any, Literal

import orjson
from fastapi import FastAPI, Request, Response
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from peer_planner import SOLVERS, NotKnown, plan

Coordinate = Annotated[float, Field(ge=-1e6, le=1e6)]
Angle = Annotated[float, Field(ge=-6.2832, le=6.2832)]
Speed = Annotated[float, Field(ge=0.0, le=10.0)]
Signed = Annotated[float, Field(ge=-10.0, le=10.0)]
Point = tuple[Coordinate, Coordinate]


class Model(BaseModel):
    model_config = ConfigDict(extra="forbid", allow_inf_nan=False)


class Asc(Model):
    north_m: Coordinate
    east_m: Coordinate
    heading_rad: Angle
    speed_mps: Signed
    sway_mps: Signed = 0.0
    yaw_rate_radps: Annotated[float, Field(ge=-3.0, le=3.0)] = 0.0
    ground_north_mps: Signed | None = None
    ground_east_mps: Signed | None = None


class AuvState(Model):
    north_m: Coordinate
    east_m: Coordinate
    depth_m: Annotated[float, Field(ge=0.0, le=12000.0)]
    course_rad: Angle
    speed_mps: Speed
    turn_rate_radps: Annotated[float, Field(ge=-3.0, le=3.0)] = 0.0
    age_s: Annotated[float, Field(ge=0.0, le=900.0)] = 0.0
    covariance: list[list[float]] | None = None


class Segment(Model):
    kind: Literal["line", "arc", "waypoints"]
    from_: Annotated[Point | None, Field(alias="from")] = None
    to: Point | None = None
    centre: Point | None = None
    angle_rad: Angle | None = None
    points: list[Point] | None = None
    fillet_m: Annotated[float, Field(ge=0.0)] | None = None
    turn_radius_m: Annotated[float, Field(gt=0.0)] | None = None


class Path(Model):
    segments: Annotated[list[Segment], Field(min_length=1, max_length=10_000)]
    closed: bool = False
    speed_mps: Annotated[float, Field(ge=0.01, le=10.0)]


class Auv(Model):
    id: Annotated[str, Field(min_length=1, max_length=64)]
    state: AuvState | None = None
    reports: list[dict[str, float]] | None = None
    path: Path | None = None
    dive: dict[str, Any] | None = None


class Goal(Model):
    kind: Literal["track", "midpoint", "weighted", "intermittent", "range"]
    auv: str | None = None
    auvs: list[str] | None = None
    weights: dict[str, Annotated[float, Field(ge=0.0)]] | None = None
    dwell_s: Annotated[float, Field(gt=0.0)] | None = None
    epoch_s: float | None = None
    range_m: Annotated[float, Field(gt=0.0)] | None = None
    offset: dict[str, Any] | None = None


class Current(Model):
    north_mps: Annotated[float, Field(ge=-3.0, le=3.0)] = 0.0
    east_mps: Annotated[float, Field(ge=-3.0, le=3.0)] = 0.0


class Limits(Model):
    speed_min_mps: Speed = 0.05
    speed_max_mps: Speed = 1.5


class Craft(Model):
    preset: Literal["generic", "medusa", "otter"]


class KeepOut(Model):
    north_m: Coordinate
    east_m: Coordinate
    radius_m: Annotated[float, Field(gt=0.0, le=1e4)]


class Acoustics(Model):
    range_max_m: Annotated[float, Field(gt=0.0, le=1e5)]


class Snapshot(Model):
    """What Pilotfish's `PlanRequest` holds, as far as `peer_planner` can plan with it."""

    schema_version: Literal["1.0"]
    t_s: float
    asc: Asc
    auvs: Annotated[list[Auv], Field(min_length=1, max_length=16)]
    goal: Goal
    current: Current = Current()
    limits: Limits = Limits()
    craft: Craft | None = None
    keep_outs: Annotated[list[KeepOut], Field(max_length=32)] = []
    area: Annotated[list[Point], Field(max_length=64)] = []
    acoustics: Acoustics | None = None
    surfacing_separation_m: Annotated[float, Field(ge=0.5, le=100.0)] | None = None
    forecast: Literal["auto", "constant_velocity", "constant_turn", "hold", "path"] = "auto"
    fallback: Literal["los", "previous_plan", "none"] = "los"
    hold: Literal["slow_turn", "stop"] = "slow_turn"
    deadline_ms: Annotated[float, Field(ge=0.05, le=60000.0)] | None = None
    previous_plan: dict[str, Any] | None = None
    metadata: dict[str, Any] = {}


class Parts:
    """Processor time of the parts of requests, s: in a file each worker, so that any of them can tell of all."""

    NAMES = ("requests", "read", "plan", "write", "solve")

    def __init__(self, folder: File) -> None:
        self.folder = folder
        folder.mkdir(parents=True, exist_ok=True)
        self.file = folder / f"{os.getpid()}"
        self.file.write_bytes(bytes(8 * len(self.NAMES)))
        with self.file.open("r+b") as file:
            self.sums = memoryview(mmap.mmap(file.fileno(), 0)).cast("d")

    def add(self, *numbers: float) -> None:
        for i, number in enumerate(numbers):
            self.sums[i] += number

    def of_all(self) -> dict[str, dict[str, float]]:
        """By worker."""
        files = sorted(self.folder.iterdir())
        return {file.name: dict(zip(self.NAMES, self.read(file), strict=True)) for file in files}

    def read(self, file: File) -> list[float]:
        return memoryview(file.read_bytes()).cast("d").tolist()


@asynccontextmanager
async def kept(app: FastAPI) -> AsyncIterator[None]:
    """What a worker keeps from request to request."""
    app.state.solver = SOLVERS[os.environ.get("PEER", "hand")]()
    with tempfile.TemporaryDirectory() as folder:
        app.state.parts = Parts(File(os.environ.get("PEER_PARTS", folder)))
        yield


app = FastAPI(lifespan=kept)


def problem(status: int, title: str, errors: list[Any]) -> Response:
    body = {"title": title, "status": status, "errors": errors}
    return Response(orjson.dumps(body, default=str), status, media_type="application/problem+json")


@app.post("/v1/plan")
async def post_plan(request: Request) -> Response:
    body, solver = await request.body(), app.state.solver
    begun = time.thread_time()
    try:
        snapshot = Snapshot.model_validate_json(body)
    except ValidationError as error:
        return problem(422, "the snapshot is not valid", error.errors(include_context=False))
    read, solved = time.thread_time(), solver.seconds
    try:
        planned = plan(snapshot, solver)
    except NotKnown as error:
        return problem(422, str(error), [])
    planning = time.thread_time()
    response = Response(orjson.dumps(planned), media_type="application/json")
    written = time.thread_time()
    app.state.parts.add(1, read - begun, planning - read, written - planning, solver.seconds - solved)
    return response


@app.get("/parts")
async def get_parts() -> dict[str, dict[str, float]]:
    return app.state.parts.of_all()


@app.get("/livez")
async def get_livez() -> Response:
    return Response()
