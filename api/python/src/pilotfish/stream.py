"""A mission's server-sent events, across connections."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass

from . import types
from .core import Backoff, Call, NoReply, Reply, error_of

# Longest time between two lines of the service, s.
HEARTBEAT_S = 15.0

NO_CONTENT = 204


@dataclass(frozen=True)
class Event:
    """An event of a mission."""

    sequence: int
    """Its number in the mission: `events(after=sequence)` resumes after it."""
    data: types.Event

    @property
    def kind(self) -> str:
        """What happened, such as `planned`."""
        return self.data["kind"]


class EventStream:
    """Reads a mission's events. None is missed and none comes twice.

    Until it is `over`: send `call`, `feed` the answer's pieces, and pause as `ended` says.
    """

    def __init__(self, mission: str, after: int, patience_s: float) -> None:
        self._path = f"{mission}/events"
        self.after = after
        """Number of the last event that was read."""
        self.over = False
        self.behind = False
        """Whether the service left events out, for a slow reader. A new connection gets them."""
        self._backoff = Backoff(patience_s)
        self._left = b""

    def call(self) -> Call[bytes]:
        """The next connection."""
        self._left, self.behind = b"", False
        headers = {"accept": "text/event-stream", "last-event-id": str(self.after)}
        return Call("GET", self._path, bytes, headers=headers, waits_s=HEARTBEAT_S)

    def feed(self, piece: bytes) -> Iterator[Event]:
        """The events that this piece completes."""
        self._backoff.reset()
        # Not by `splitlines`: JSON may hold other ends of lines, such as U+2028.
        *blocks, self._left = (self._left + piece).replace(b"\r\n", b"\n").split(b"\n\n")
        for block in blocks:
            event = self._read(block)
            if self.behind:
                return
            if event is not None and self.after < event.sequence:
                self.after = event.sequence
                self.over = event.kind in ("finished", "failed")
                yield event

    def _read(self, block: bytes) -> Event | None:
        """An event; None for a comment, which keeps the connection open."""
        fields: dict[bytes, list[bytes]] = {}
        for line in block.split(b"\n"):
            name, _, value = line.partition(b":")
            fields.setdefault(name, []).append(value.removeprefix(b" "))
        if fields.get(b"event") == [b"gap"]:
            self.behind = True
        if b"id" not in fields:
            return None
        return Event(int(fields[b"id"][-1]), json.loads(b"\n".join(fields[b"data"])))

    def ended(self, got: Reply | NoReply | None) -> float:
        """Pause before the next connection, s. Raises a refusal, or the last error after too many failures.

        `got` is the refusal or the lost connection; None if the service closed it.
        """
        if isinstance(got, Reply) and got.status == NO_CONTENT:
            self.over = True
        if self.over or self.behind:
            return 0.0
        error = error_of(got)
        assert error is not None, "the answer is fed, not given here"
        return self._backoff.pause_after(error)
