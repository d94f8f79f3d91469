"""A mission's events as they are sent (server-sent events), across connections."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass

from . import types
from .core import Call, Lost, Patience, Reply, error_of

# The service says something at least so often, s.
HEARTBEAT_S = 15.0

NO_CONTENT = 204


@dataclass(frozen=True)
class Event:
    """An event of a mission."""

    sequence: int
    """Its number in the mission: `events(after=sequence)` goes on after it."""
    data: types.Event

    @property
    def kind(self) -> str:
        """What happened, such as `planned`."""
        return self.data["kind"]


class EventStream:
    """What was read of a mission's events, and what is to be asked for next.

    While it is not `over`: sends `call`, feeds what comes, and rests as `ended` says. No event is missed and none
    comes twice.
    """

    def __init__(self, mission: str, after: int, patience_s: float) -> None:
        self._path = f"{mission}/events"
        self.after = after
        """Number of the last event that was read."""
        self.over = False
        self.behind = False
        """Whether the service left events out, for a slow reader. It sends them to one that connects again."""
        self._patience = Patience(patience_s)
        self._left = b""

    def call(self) -> Call[bytes]:
        """The next connection."""
        self._left, self.behind = b"", False
        headers = {"accept": "text/event-stream", "last-event-id": str(self.after)}
        return Call("GET", self._path, bytes, headers=headers, waits_s=HEARTBEAT_S)

    def feed(self, piece: bytes) -> Iterator[Event]:
        """The events that are whole with this piece."""
        self._patience.restore()
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
        """An event; None where a comment says that the stream lives."""
        fields: dict[bytes, list[bytes]] = {}
        for line in block.split(b"\n"):
            name, _, value = line.partition(b":")
            fields.setdefault(name, []).append(value.removeprefix(b" "))
        if fields.get(b"event") == [b"gap"]:
            self.behind = True
        if b"id" not in fields:
            return None
        return Event(int(fields[b"id"][-1]), json.loads(b"\n".join(fields[b"data"])))

    def ended(self, got: Reply | Lost | None) -> float:
        """How long to rest before the next connection, s. Raises what was refused, or that patience is over.

        `got` is the refusal, or how the connection was lost; None where it was closed.
        """
        if isinstance(got, Reply) and got.status == NO_CONTENT:
            self.over = True
        if self.over or self.behind:
            return 0.0
        error = error_of(got)
        assert error is not None, "a stream that was answered is fed"
        return self._patience.rest_after(error)
