"""How calls are sent with httpx. Only this module and the clients use it."""

from __future__ import annotations

import ssl
from ipaddress import ip_address
from typing import Any
from urllib.request import getproxies, proxy_bypass

import httpx

from .core import Call, NoReply, __version__

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
    headers = {"user-agent": f"pilotfish-python/{__version__}"}
    if token is not None:
        headers["authorization"] = f"Bearer {token}"
    return {"base_url": url, "headers": headers, "timeout": timeout_s, "verify": verify, "mounts": _direct(url)}


def _direct(url: str) -> dict[str, None]:
    """Schemes that go without the environment's proxy: http, since a proxy would read tokens; all to this machine."""
    host = httpx.URL(url).host
    try:
        here = ip_address(host).is_loopback
    except ValueError:
        here = host == "localhost" or host.endswith(".localhost")
    return {"http://": None, "https://": None} if here else {"http://": None}


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
    """A call without an answer. A proxy that was asked instead is named."""
    connected = not isinstance(error, httpx.ConnectError | httpx.ConnectTimeout | httpx.ProxyError)
    proxy = _proxy(error.request.url)
    through = f" through the environment's proxy {proxy}" if proxy else ""
    return NoReply(error, connected, url=f"{error.request.url}{through}")


def _proxy(url: httpx.URL) -> str | None:
    """Host and port of the environment's proxy for `url`, if any, without its password."""
    proxy = getproxies().get("https") or getproxies().get("all")
    if not proxy or f"{url.scheme}://" in _direct(str(url)) or proxy_bypass(url.host):
        return None
    at = httpx.URL(proxy if "://" in proxy else f"http://{proxy}")
    return at.host if at.port is None else f"{at.host}:{at.port}"
