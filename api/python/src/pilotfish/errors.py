"""What can go wrong."""

from __future__ import annotations

import json
from collections.abc import Mapping
from http.client import responses
from typing import Any

# Most of an answer that is no problem document which is repeated, characters.
QUOTE_LENGTH_MAX = 200


class PilotfishError(Exception):
    """Something that the service, or the way to it, did not do."""


class Unreachable(PilotfishError):
    """The service did not answer, or its answer broke off."""


class MissionFailed(PilotfishError):
    """A mission that was waited for could not go on."""

    def __init__(self, mission: str, reason: str) -> None:
        super().__init__(f"mission {mission} failed: {reason}")
        self.mission = mission
        self.reason = reason


class Refused(PilotfishError):
    """The service's problem document (RFC 9457), or what a proxy before it said instead of an answer."""

    def __init__(self, status: int, document: Mapping[str, Any], retry_after_s: float | None = None) -> None:
        super().__init__(status, document)
        self.status = status
        self.retry_after_s = retry_after_s
        """When to ask again, where the service said so."""
        self.code: str = document.get("code", "")
        """The kind of problem, for programs; empty where the service did not say it."""
        self.title: str = document.get("title", "")
        self.detail: str = document.get("detail", "")
        self.request_id: str = document.get("request_id", "")
        """Of the request, as in the service's log."""
        self.errors: list[dict[str, Any]] = document.get("errors", [])
        """The fields at fault: `pointer` or `parameter`, `code`, `detail`; some have `given` and `limit`."""

    def __str__(self) -> str:
        kind = f"{self.status} {self.code}".strip()
        if not self.errors:
            return f"{kind}: {self.title}: {self.detail}"
        return "\n  ".join([f"{kind}: {self.title}", *map(_sentence, self.errors)])

    @classmethod
    def of(cls, status: int, headers: Mapping[str, str], body: bytes) -> Refused:
        """What an answer of that status says."""
        try:
            document = json.loads(body)
        except ValueError:
            document = None
        if not isinstance(document, dict):
            detail = body.decode(errors="replace")[:QUOTE_LENGTH_MAX]
            document = {"title": responses.get(status, "unknown status"), "detail": detail}
        return cls(status, document, _seconds(headers.get("retry-after")))


def _seconds(text: str | None) -> float | None:
    """`Retry-After` in seconds. A date, as some proxies send, counts as none."""
    return float(text) if text is not None and text.isdecimal() else None


def _sentence(error: Mapping[str, Any]) -> str:
    """One field at fault: where, what, which value, which limit."""
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
