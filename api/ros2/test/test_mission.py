"""What is posted again, and what is not."""

from pilotfish_ros2 import mission as module
from pilotfish_ros2.mission import MissionLink
from pilotfish_ros2.pilotfish import Unreachable


class Service:
    """Answers the first `lost` requests not at all, and rejects reports of AUVs."""

    def __init__(self, lost=0):
        self.lost, self.posted = lost, []

    def report(self, *, auvs=None, asc=None, notes=None, key=None, **_):
        self.posted.append((bool(auvs), bool(asc), bool(notes), key))
        if len(self.posted) <= self.lost:
            raise Unreachable("no answer")
        rejected = [{"pointer": f"/auvs/{auv}", "detail": "the mission has no such AUV"} for auv in auvs or {}]
        return {"sequence": 2, "rejected": rejected}


def link_with_everything(log):
    link = MissionLink(None, "craft", {}, "", 0.2, log)
    link.report_craft({"t_s": 0.0})
    link.report_auv("unknown", {"t_s": 0.0})
    link.note(0.0, "something happened")
    return link


def test_an_auv_that_the_mission_does_not_know_does_not_stop_reports_of_the_craft():
    logged = []
    link, service = link_with_everything(logged.append), Service()
    link._post(service)
    assert [posted[:3] for posted in service.posted] == [(True, True, True)]
    assert logged == ["report rejected by the service: /auvs/unknown: the mission has no such AUV"]
    link._post(service)
    assert len(service.posted) == 1, "nothing waits any more"


def test_reports_without_an_answer_are_sent_again_under_the_same_key(monkeypatch):
    monkeypatch.setattr(module, "RETRY_S", 0.0)
    link, service = MissionLink(None, "craft", {}, "", 0.2, lambda _: None), Service(lost=2)
    link.report_craft({"t_s": 0.0})
    link._post(service)
    assert len(service.posted) == 3 and len({posted[3] for posted in service.posted}) == 1
    assert link.trouble == ""
