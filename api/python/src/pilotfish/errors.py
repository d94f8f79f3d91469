"""What can go wrong."""

from __future__ import annotations

import json
from collections.abc import Mapping
from http.client import responses
from typing import Any

# Longest quotation of an answer that is not a problem document, characters.
QUOTE_LENGTH_MAX = 200


class PilotfishError(Exception):
    """A call failed."""


class Unreachable(PilotfishError):
    """The service did not answer, or its answer broke off."""


class MissionFailed(PilotfishError):
    """A mission ended with the status `failed`."""

    def __init__(self, mission: str, reason: str) -> None:
        super().__init__(f"mission {mission} failed: {reason}")
        self.mission = mission
        self.reason = reason


class Refused(PilotfishError):
    """The service's problem document (RFC 9457), or a proxy's error."""

    def __init__(self, status: int, document: Mapping[str, Any], retry_after_s: float | None = None) -> None:
        super().__init__(status, document)
        self.status = status
        self.retry_after_s = retry_after_s
        """When to try again, if the service says so."""
        self.code: str = document.get("code", "")
        """The kind of problem, for programs; empty if the answer is not from the service."""
        self.title: str = document.get("title", "")
        self.detail: str = document.get("detail", "")
        self.request_id: str = document.get("request_id", "")
        """The request's id in the service's log."""
        self.errors: list[dict[str, Any]] = document.get("errors", [])
        """The wrong fields: `pointer` or `parameter`, `code`, `detail`; some have `given` and `limit`."""

    def __str__(self) -> str:
        kind = f"{self.status} {self.code}".strip()
        if not self.errors:
            return f"{kind}: {self.title}: {self.detail}"
        return "\n  ".join([f"{kind}: {self.title}", *map(_sentence, self.errors)])

    @classmethod
    def of(cls, status: int, headers: Mapping[str, str], body: bytes) -> Refused:
        """The error of an answer with that status."""
        try:
            document = json.loads(body)
        except ValueError:
            document = None
        if not isinstance(document, dict):
            detail = body.decode(errors="replace")[:QUOTE_LENGTH_MAX]
            document = {"title": responses.get(status, "unknown status"), "detail": detail}
        return cls(status, document, _seconds(headers.get("retry-after")))


def _seconds(text: str | None) -> float | None:
    """`Retry-After` in seconds. Dates, which some proxies send, are ignored."""
    return float(text) if text is not None and text.isdecimal() else None


def _sentence(error: Mapping[str, Any]) -> str:
    """One wrong field: where, what, the value and the limit."""
    place = error.get("parameter") or error.get("pointer") or "the body"
    facts = []
    if "given" in error:
        facts.append(f"given {_words(error['given'])}")
    if "limit" in error:
        facts.append(f"limit {_limit(error['limit'])}")
    return f"{place}: {error.get('detail', '')}" + (f" ({', '.join(facts)})" if facts else "")


def _limit(limit: Any) -> str:
    match limit:
        case {"least": least, "most": most}:
            return f"{least} to {most}"
        case {"least": least}:
            return f"at least {least}"
        case {"most": most}:
            return f"at most {most}"
        case {"above": above}:
            return f"above {above}"
        case _:
            return _words(limit)


def _words(value: Any) -> str:
    return json.dumps(value, ensure_ascii=False)
