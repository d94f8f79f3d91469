"""How the service is asked, without any input or output.

What is to be done is a generator that yields steps: a `Call` to send, or a `Rest` to take. Clients carry them
out, one with threads and one with asyncio, and send back what came of each. So whatever is decided, is decided once.
"""

from __future__ import annotations

import json
import time
import uuid
from collections.abc import Callable, Generator, Mapping
from dataclasses import dataclass, field
from typing import Any, BinaryIO, Generic, TypeAlias, TypeVar

from .errors import PilotfishError, Refused, Unreachable

T = TypeVar("T")

# Between two tries, s, where the service does not say when: doubled each time.
REST_FIRST_S = 0.1
REST_MAX_S = 2.0

# Said of what may be asked again by the service with `Retry-After`, by a proxy without.
LATER = (429, 502, 503, 504)


@dataclass(frozen=True)
class Call(Generic[T]):
    """A request, and how its answer is read. Sent again it is the same, to the byte and with the same key."""

    method: str
    path: str
    read: Callable[[bytes], T]
    query: Mapping[str, str | int | float] = field(default_factory=dict)
    headers: Mapping[str, str] = field(default_factory=dict)
    body: bytes | None = None
    waits_s: float = 0.0
    """How long the service may take on purpose."""
    to: BinaryIO | None = None
    """Where the answer goes, where it may be long: from its beginning, whatever is there."""
    done: str = ""
    """How it is refused when it is sent again after it was carried out."""


@dataclass(frozen=True)
class Rest:
    """Time to let pass."""

    seconds: float


@dataclass(frozen=True)
class Reply:
    """An answer. Where it went elsewhere, the body is empty."""

    status: int
    headers: Mapping[str, str]
    body: bytes


@dataclass(frozen=True)
class Lost:
    """No answer, or none that is whole."""

    error: Exception
    connected: bool
    """Whether there was a connection, so that the service may have heard."""


Steps: TypeAlias = Generator[Call[Any] | Rest, Reply | Lost | None, T]


def get(path: str, read: Callable[[bytes], Any] = json.loads, **query: str | int | float | None) -> Call[Any]:
    """A call that asks for something, JSON if not said otherwise. What is None is not asked for."""
    given = {name: value for name, value in query.items() if value is not None}
    return Call("GET", path, read, query=given)


def post(path: str, body: object = None, *, key: str | None = None, method: str = "POST") -> Call[Any]:
    """A call that brings JSON, if anything, and asks for JSON. With a key it is carried out once."""
    headers = {} if key is None else {"idempotency-key": key}
    if body is None:
        return Call(method, path, json.loads, headers=headers)
    headers["content-type"] = "application/json"
    written = json.dumps(body, allow_nan=False, default=_plain).encode()
    return Call(method, path, json.loads, headers=headers, body=written)


def new_key() -> str:
    """A name that no other request has."""
    return uuid.uuid4().hex


def _plain(value: Any) -> Any:
    """Numbers and arrays of NumPy as Python's own."""
    if hasattr(value, "tolist"):
        return value.tolist()
    raise TypeError(f"{type(value).__name__} is nothing that JSON can say: {value!r}")


class Patience:
    """How long to go on asking. Runs from the first failure, and is whole again after a success."""

    def __init__(self, limit_s: float, clock: Callable[[], float] = time.monotonic) -> None:
        self.limit_s = limit_s
        self._clock = clock
        self._since: float | None = None
        self._rest_s = REST_FIRST_S

    def restore(self) -> None:
        """There was an answer."""
        self._since, self._rest_s = None, REST_FIRST_S

    def rest_after(self, error: PilotfishError) -> float:
        """How long to rest before the next try. Raises the error where there is to be none."""
        if self._since is None:
            self._since = self._clock()
        left = self._since + self.limit_s - self._clock()
        if left <= 0 or (isinstance(error, Refused) and not _is_passing(error)):
            raise error
        wanted = error.retry_after_s if isinstance(error, Refused) else None
        rest = wanted or self._rest_s
        self._rest_s = min(2 * self._rest_s, REST_MAX_S)
        return min(rest, left)


def _is_passing(refused: Refused) -> bool:
    """Whether the same request may be answered later. The service says so; what has no code is from a proxy."""
    return refused.status in LATER and (refused.retry_after_s is not None or not refused.code)


def error_of(got: Reply | Lost | None) -> PilotfishError | None:
    """What is wrong with what came of a call, if anything is."""
    if isinstance(got, Reply):
        return None if 200 <= got.status < 300 else Refused.of(got.status, got.headers, got.body)
    cause = got.error if got is not None else EOFError("the answer broke off")
    error = Unreachable(f"no answer: {str(cause) or type(cause).__name__}")
    error.__cause__ = cause
    return error


def ask(call: Call[T], patience_s: float = 0.0, *, unmet: bool = True) -> Steps[T]:
    """Asks until there is an answer, for as long as patience lasts.

    Unless `unmet`, an address at which nothing listens is not asked again.
    """
    patience = Patience(patience_s)
    again = False
    while True:
        got = yield call
        error = error_of(got)
        if error is None:
            assert isinstance(got, Reply)
            return call.read(got.body)
        if again and isinstance(error, Refused) and error.code and error.code == call.done:
            return call.read(b"")
        if isinstance(got, Lost) and not got.connected and not unmet:
            raise error
        yield Rest(patience.rest_after(error))
        again = True
