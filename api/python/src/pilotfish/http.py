"""How calls are sent with httpx. Only this module and the clients use it."""

from __future__ import annotations

import ssl
from importlib.metadata import version
from typing import Any

import httpx

from .core import Call, NoReply

OK = 200

URL = "http://127.0.0.1:8080"

# For an answer, s: after 10 s the service itself reports a mission that does not answer.
TIMEOUT_S = 15.0

# How long a mission's service may be away, s: enough for a restart.
PATIENCE_S = 60.0


def settings(url: str, token: str | None, timeout_s: float, verify: ssl.SSLContext | bool) -> dict[str, Any]:
    """Arguments of an httpx client."""
    if not url.startswith(("http://", "https://")):
        raise ValueError(f"{url!r} does not begin with http:// or https://")
    headers = {"user-agent": f"pilotfish-python/{version('pilotfish')}"}
    if token is not None:
        headers["authorization"] = f"Bearer {token}"
    return {"base_url": url, "headers": headers, "timeout": timeout_s, "verify": verify}


def request(call: Call[Any], timeout_s: float) -> dict[str, Any]:
    """Arguments of an httpx request."""
    return {
        "method": call.method,
        "url": call.path,
        "params": dict(call.query),
        "headers": dict(call.headers),
        "content": call.body,
        "timeout": httpx.Timeout(timeout_s, read=timeout_s + call.waits_s),
    }


def no_reply(error: httpx.RequestError) -> NoReply:
    """A call without an answer."""
    connected = not isinstance(error, httpx.ConnectError | httpx.ConnectTimeout)
    return NoReply(error, connected, url=str(error.request.url))
