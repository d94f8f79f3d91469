"""Retries and streams, without a service."""

import json

import httpx
import pytest

from pilotfish import Client, MissionFailed, Refused, Unreachable
from pilotfish.core import Backoff, NoReply, Reply
from pilotfish.stream import EventStream

OK = httpx.Response(200, content=b'{"sequence": 3}')
BUSY = httpx.Response(
    503, headers={"retry-after": "2"}, content=b'{"code": "mission_behind", "title": "", "detail": ""}'
)
BROKEN = httpx.ReadError("reset")
GONE = httpx.Response(404, content=b'{"code": "no_mission"}')


class Service:
    """A client whose requests get `answers`; `pauses` are the times that it waited."""

    def __init__(self, monkeypatch, *answers):
        self.requests, self.pauses = [], []
        self._answers = iter(answers)
        self.client = Client(patience_s=60.0)
        self.client._http = httpx.Client(transport=httpx.MockTransport(self._answer), base_url="http://service")
        monkeypatch.setattr("time.sleep", self.pauses.append)

    def _answer(self, request):
        self.requests.append(request)
        answer = next(self._answers)
        if isinstance(answer, Exception):
            raise answer
        return answer


def test_a_report_is_sent_again_with_its_key_until_it_is_acknowledged(monkeypatch):
    service = Service(monkeypatch, BROKEN, BUSY, httpx.Response(502, content=b"bad gateway"), OK)
    assert service.client.mission("m-1").report(auvs={}, asc=[]) == {"sequence": 3}
    assert len(service.requests) == 4
    assert len({(each.headers["idempotency-key"], each.content) for each in service.requests}) == 1
    assert service.pauses == [0.1, 2.0, 0.4]


@pytest.mark.parametrize("status, code", [(422, "invalid_request"), (409, "conflict"), (503, "no_missions")])
def test_a_final_refusal_is_raised_at_once(status, code, monkeypatch):
    service = Service(monkeypatch, httpx.Response(status, content=json.dumps({"code": code}).encode()))
    with pytest.raises(Refused, match=code):
        service.client.mission("m-1").look()


def test_a_plan_is_asked_for_once(monkeypatch):
    service = Service(monkeypatch, BUSY, BROKEN)
    with pytest.raises(Refused) as caught:
        service.client.plan({})
    assert caught.value.retry_after_s == 2.0
    with pytest.raises(Unreachable, match=r"^no answer from http://service/v1/plan: reset$"):
        service.client.plan({})


def test_a_mission_that_fails_says_why(monkeypatch):
    failed = httpx.Response(200, content=b'{"status": "failed", "sequence": 7}')
    event = b'id: 7\nevent: failed\ndata: {"kind":"failed","at_s":1.0,"reason":"no water"}\n\n'
    service = Service(monkeypatch, failed, httpx.Response(200, content=event))
    with pytest.raises(MissionFailed, match="m-1 failed: no water"):
        service.client.mission("m-1").wait()


def test_a_repeated_deletion_succeeds(monkeypatch):
    service = Service(monkeypatch, BROKEN, GONE, GONE)
    mission = service.client.mission("m-1")
    assert mission.delete() is None
    with pytest.raises(Refused):
        mission.delete()


def test_backoff_runs_from_the_first_failure_and_is_reset_by_an_answer():
    # Looked at once more at the first failure.
    clock = iter([100.0, 100.0, 105.0, 109.9, 115.0, 115.0, 125.0])
    backoff = Backoff(10.0, lambda: next(clock))
    error = Unreachable("away")
    pauses = [backoff.pause_after(error) for _ in range(3)]
    assert pauses == [0.1, 0.2, pytest.approx(0.1)], "no longer than is left"
    backoff.reset()
    assert backoff.pause_after(error) == 0.1
    with pytest.raises(Unreachable):
        backoff.pause_after(error)


def sent(number, kind="planned", **more):
    """An event as the service sends it."""
    data = json.dumps({"kind": kind, **more}, ensure_ascii=False)
    return f"id: {number}\nevent: {kind}\nretry: 1000\ndata: {data}\n\n".encode()


def test_events_are_read_from_pieces_of_any_length():
    # U+2028 ends a line for some, not for server-sent events.
    text = sent(4, title="a\u2028b") + b":\n\n" + sent(5) + sent(6, "finished")
    for length in (1, 2, 7, 1000):
        stream = EventStream("/m", 3, 60.0)
        pieces = [text[begin : begin + length] for begin in range(0, len(text), length)]
        events = [event for piece in pieces for event in stream.feed(piece)]
        assert [event.sequence for event in events] == [4, 5, 6]
        assert events[0].data["title"] == "a\u2028b"
        assert stream.over
        assert stream.ended(None) == 0.0


def test_a_stream_resumes_after_its_last_event_and_repeats_none():
    stream = EventStream("/m", 0, 60.0)
    assert stream.call().headers["last-event-id"] == "0"
    events = list(stream.feed(sent(1) + sent(2) + b"id: 3\nevent: pla"))
    assert stream.ended(NoReply(BROKEN, connected=True)) == 0.1
    assert stream.call().headers["last-event-id"] == "2"
    events += stream.feed(sent(2) + sent(3))
    assert [event.sequence for event in events] == [1, 2, 3]
    assert not stream.over


def test_what_a_slow_reader_missed_is_asked_for_at_once():
    stream = EventStream("/m", 0, 60.0)
    gap = b'event: gap\ndata: {"kind":"gap","from":2,"to":70}\n\n'
    assert [event.sequence for event in stream.feed(sent(1) + gap + sent(71))] == [1]
    assert stream.behind
    assert stream.ended(None) == 0.0
    assert stream.call().headers["last-event-id"] == "1"
    assert [event.sequence for event in stream.feed(sent(2))] == [2]


def test_a_stream_ends_with_the_mission_and_with_its_refusal():
    stream = EventStream("/m", 9, 60.0)
    stream.ended(Reply(204, {}, b""))
    assert stream.over
    with pytest.raises(Refused, match="no_mission"):
        EventStream("/m", 0, 60.0).ended(Reply(404, {}, b'{"code": "no_mission"}'))


@pytest.mark.parametrize("proxy", ["HTTP_PROXY", "HTTPS_PROXY", "ALL_PROXY"])
@pytest.mark.parametrize(
    ("url", "is_proxied"),
    [
        ("http://127.0.0.1:8080", False),
        ("http://plans.ship:8080", False),
        ("https://localhost:8443", False),
        ("https://[::1]:8443", False),
        ("https://plans.ship", True),
    ],
)
def test_a_proxy_carries_https_to_other_machines_alone(url, is_proxied, proxy, monkeypatch):
    for name in ("HTTP_PROXY", "HTTPS_PROXY", "ALL_PROXY", "NO_PROXY"):
        monkeypatch.delenv(name, raising=False)
        monkeypatch.delenv(name.lower(), raising=False)
    monkeypatch.setenv(proxy, "http://captain:secret@127.0.0.1:9")
    with Client(url, patience_s=0.0) as client:
        direct = client._http._transport
        is_used = client._http._transport_for_url(httpx.URL(url)) is not direct
        assert is_used == (is_proxied and proxy != "HTTP_PROXY")
        if is_used:
            with pytest.raises(Unreachable, match=r"through the environment's proxy 127\.0\.0\.1:9: "):
                client.limits()


def test_what_is_no_problem_document_is_quoted():
    refused = Refused.of(502, {}, b"<html>bad gateway</html>")
    assert str(refused) == "502: Bad Gateway: <html>bad gateway</html>"
