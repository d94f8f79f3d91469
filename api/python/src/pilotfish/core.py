"""Requests, answers and retries, without input or output."""

from __future__ import annotations

import json
import time
import uuid
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, BinaryIO, Generic, Literal, TypeAlias, TypeVar

from .errors import PilotfishError, Refused, Unreachable

T = TypeVar("T")

# Of the whole workspace: tests/test_package.py compares.
__version__ = "0.2.0"

# Pause between two tries if the service does not give one, s: doubled each time.
PAUSE_FIRST_S = 0.1
PAUSE_MAX_S = 2.0

# The service marks these with `Retry-After` if the request may be sent again; a proxy does not.
RETRIED_STATUSES = (429, 502, 503, 504)

RecordFormat: TypeAlias = Literal["csv", "parquet", "ndjson", "mcap", "geojson", "events_ndjson"]

FORMATS: Mapping[str, RecordFormat] = {
    ".csv": "csv",
    ".parquet": "parquet",
    ".ndjson": "ndjson",
    ".mcap": "mcap",
    ".geojson": "geojson",
}


@dataclass(frozen=True)
class Call(Generic[T]):
    """A request, and how its answer is read. A repeated request has the same bytes and the same key."""

    method: str
    path: str
    read: Callable[[bytes], T]
    query: Mapping[str, str | int | float] = field(default_factory=dict)
    headers: Mapping[str, str] = field(default_factory=dict)
    body: bytes | None = None
    waits_s: float = 0.0
    """How long the service may wait on purpose."""
    to: BinaryIO | None = None
    """File for a long answer. Its old content is overwritten."""
    done: str = ""
    """Problem code of a repeated request that was carried out the first time."""


@dataclass(frozen=True)
class Reply:
    """An answer. Its body is empty if it went to a file."""

    status: int
    headers: Mapping[str, str]
    body: bytes


@dataclass(frozen=True)
class NoReply:
    """No answer, or an incomplete one."""

    error: Exception
    connected: bool
    """Whether there was a connection, so that the service may have received the request."""
    url: str = ""
    """What was asked for."""


def get(path: str, read: Callable[[bytes], Any] = json.loads, **query: str | int | float | None) -> Call[Any]:
    """A GET request. Parameters that are None are left out."""
    given = {name: value for name, value in query.items() if value is not None}
    return Call("GET", path, read, query=given)


def post(path: str, body: object = None, *, key: str | None = None, method: str = "POST") -> Call[Any]:
    """A request with a JSON body, if any, and a JSON answer. The service carries it out once for each key."""
    headers = {} if key is None else {"idempotency-key": key}
    if body is None:
        return Call(method, path, json.loads, headers=headers)
    headers["content-type"] = "application/json"
    written = json.dumps(body, allow_nan=False, default=_plain).encode()
    return Call(method, path, json.loads, headers=headers, body=written)


def new_key() -> str:
    """A unique key of a request."""
    return uuid.uuid4().hex


def _plain(value: Any) -> Any:
    """NumPy numbers and arrays as Python's own."""
    if hasattr(value, "tolist"):
        return value.tolist()
    raise TypeError(f"{type(value).__name__} cannot be written as JSON: {value!r}")


class Backoff:
    """How long to try again. The time runs from the first failure; an answer resets it."""

    def __init__(self, limit_s: float, clock: Callable[[], float] = time.monotonic) -> None:
        self.limit_s = limit_s
        self._clock = clock
        self._since: float | None = None
        self._pause_s = PAUSE_FIRST_S

    def reset(self) -> None:
        """There was an answer."""
        self._since, self._pause_s = None, PAUSE_FIRST_S

    def pause_after(self, error: PilotfishError) -> float:
        """Pause before the next try, s. Raises the error if there is no next try."""
        if self._since is None:
            self._since = self._clock()
        left = self._since + self.limit_s - self._clock()
        if left <= 0 or (isinstance(error, Refused) and not _is_temporary(error)):
            raise error
        wanted = error.retry_after_s if isinstance(error, Refused) else None
        pause = wanted or self._pause_s
        self._pause_s = min(2 * self._pause_s, PAUSE_MAX_S)
        return min(pause, left)


def _is_temporary(refused: Refused) -> bool:
    """Whether the same request may be answered later. An answer without a code is from a proxy."""
    return refused.status in RETRIED_STATUSES and (refused.retry_after_s is not None or not refused.code)


def error_of(got: Reply | NoReply | None) -> PilotfishError | None:
    """The error of a call, if any."""
    if isinstance(got, Reply):
        return None if 200 <= got.status < 300 else Refused.of(got.status, got.headers, got.body)
    cause = got.error if got is not None else EOFError("the answer broke off")
    place = f" from {got.url}" if isinstance(got, NoReply) and got.url else ""
    error = Unreachable(f"no answer{place}: {str(cause) or type(cause).__name__}")
    error.__cause__ = cause
    return error
