"""Calls in httpx's words. The clients alone know it beside."""

from __future__ import annotations

import ssl
from importlib.metadata import version
from typing import Any

import httpx

from .core import Call, Lost

OK = 200

URL = "http://127.0.0.1:8080"

# For an answer, s: a mission that has not answered after 10 s is said to by the service itself.
TIMEOUT_S = 15.0

# How long a mission's service may be away, s: it is started again within that.
PATIENCE_S = 60.0


def settings(url: str, token: str | None, timeout_s: float, verify: ssl.SSLContext | bool) -> dict[str, Any]:
    """Of a client of httpx."""
    if not url.startswith(("http://", "https://")):
        raise ValueError(f"{url!r} does not begin with http:// or https://")
    headers = {"user-agent": f"pilotfish-python/{version('pilotfish')}"}
    if token is not None:
        headers["authorization"] = f"Bearer {token}"
    return {"base_url": url, "headers": headers, "timeout": timeout_s, "verify": verify}


def request(call: Call[Any], timeout_s: float) -> dict[str, Any]:
    """What httpx is to send."""
    return {
        "method": call.method,
        "url": call.path,
        "params": dict(call.query),
        "headers": dict(call.headers),
        "content": call.body,
        "timeout": httpx.Timeout(timeout_s, read=timeout_s + call.waits_s),
    }


def lost(error: httpx.RequestError) -> Lost:
    """A call without an answer."""
    return Lost(error, connected=not isinstance(error, httpx.ConnectError | httpx.ConnectTimeout))
