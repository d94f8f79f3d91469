"""Decisions, without a service: what is sent again, and how a stream is read."""

import json

import httpx
import pytest

from pilotfish import Refused, Unreachable
from pilotfish.core import Call, Lost, Patience, Reply, Rest, ask, post
from pilotfish.orders import Orders
from pilotfish.stream import EventStream

OK = Reply(200, {}, b'{"sequence": 3}')
BUSY = Reply(503, {"retry-after": "2"}, b'{"code": "mission_behind", "title": "", "detail": ""}')
BROKEN = Lost(httpx.ReadError("reset"), connected=True)


def answered(steps, *answers):
    """What came of the steps when calls were answered so, and the calls and rests."""
    answers, done, got = iter(answers), [], None
    while True:
        try:
            step = steps.send(got)
        except StopIteration as end:
            return end.value, done
        done.append(step)
        got = next(answers) if isinstance(step, Call) else None


def test_a_report_is_sent_again_with_its_key_until_it_is_acknowledged():
    report = Orders("m-1", 60.0).report({}, [], None, None)
    accepted, done = answered(report, BROKEN, BUSY, Reply(502, {}, b"bad gateway"), OK)
    assert accepted == {"sequence": 3}
    calls = [step for step in done if isinstance(step, Call)]
    assert len(calls) == 4
    assert len({(call.headers["idempotency-key"], call.body) for call in calls}) == 1
    assert [step.seconds for step in done if isinstance(step, Rest)] == [0.1, 2.0, 0.4]


def test_two_reports_have_two_keys():
    keys = {next(Orders("m-1", 60.0).report({}, [], None, None)).headers["idempotency-key"] for _ in range(2)}
    assert len(keys) == 2


@pytest.mark.parametrize("status, code", [(422, "invalid_request"), (409, "conflict"), (503, "no_missions")])
def test_what_will_never_be_answered_is_asked_once(status, code):
    refusal = Reply(status, {}, json.dumps({"code": code}).encode())
    with pytest.raises(Refused, match=code):
        answered(ask(post("/v1/x"), 60.0), refusal)


def test_a_plan_is_asked_for_once():
    with pytest.raises(Refused) as caught:
        answered(ask(post("/v1/plan")), BUSY)
    assert caught.value.retry_after_s == 2.0
    with pytest.raises(Unreachable, match="reset"):
        answered(ask(post("/v1/plan")), BROKEN)


def test_what_was_deleted_by_an_earlier_try_is_deleted():
    gone = Reply(404, {}, b'{"code": "no_mission"}')
    assert answered(Orders("m-1", 60.0).delete(), BROKEN, gone)[0] is None
    with pytest.raises(Refused):
        answered(Orders("m-1", 60.0).delete(), gone)


def test_patience_runs_from_the_first_failure_and_is_restored_by_an_answer():
    # Looked at once more at the first failure.
    clock = iter([100.0, 100.0, 105.0, 109.9, 115.0, 115.0, 125.0])
    patience = Patience(10.0, lambda: next(clock))
    error = Unreachable("away")
    rests = [patience.rest_after(error) for _ in range(3)]
    assert rests == [0.1, 0.2, pytest.approx(0.1)], "no longer than is left"
    patience.restore()
    assert patience.rest_after(error) == 0.1
    with pytest.raises(Unreachable):
        patience.rest_after(error)


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
    assert stream.ended(BROKEN) == 0.1
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


def test_what_is_no_problem_document_is_quoted():
    refused = Refused.of(502, {}, b"<html>bad gateway</html>")
    assert str(refused) == "502: Bad Gateway: <html>bad gateway</html>"
