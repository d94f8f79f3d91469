"""Plans of the service, and its refusals."""

import copy
import subprocess

import numpy as np
import pytest
from conftest import Service, program
from live import LIVE

from pilotfish import Client, Refused, Unreachable


def test_a_plan_is_handed_back_for_the_next(client):
    snapshot = client.example("track")
    plan = client.plan(snapshot)
    assert plan["outcome"] == "ok"
    assert plan["trajectory"][0]["t_s"] == snapshot["t_s"]
    again = client.plan({**snapshot, "t_s": snapshot["t_s"] + 1}, plan)
    assert again["outcome"] == "ok"
    assert "previous_plan" not in snapshot
    alone = client.plan({**snapshot, "t_s": snapshot["t_s"] + 1})
    assert again["plan_id"] != alone["plan_id"], "it is planned from the one before"


def test_a_refusal_names_field_value_and_limit(client):
    snapshot = client.example("track")
    snapshot["asc"]["heading_rad"] = 19.0
    with pytest.raises(Refused) as caught:
        client.plan(snapshot)
    refused = caught.value
    assert (refused.status, refused.code) == (422, "invalid_request")
    assert refused.request_id
    assert [error["pointer"] for error in refused.errors] == ["/asc/heading_rad"]
    assert "\n  /asc/heading_rad: must be from -6.28" in str(refused)
    assert "(given 19.0, limit -6.28" in str(refused)


def test_a_refused_parameter_is_named(client):
    with pytest.raises(Refused, match=r"wait_s: .*given 61\.0, limit 0.* to 60"):
        client.mission(client.create_mission(live=LIVE).id).reference(wait_s=61)


def test_a_wrong_snapshot_spoils_no_other_of_a_batch(client):
    snapshot = client.example("track")
    wrong = copy.deepcopy(snapshot)
    wrong["asc"]["speed_mps"] = 1e9
    plan, refused, other = client.plan_batch([snapshot, wrong, client.example("midpoint")])
    assert plan["outcome"] == other["outcome"] == "ok"
    assert isinstance(refused, Refused)
    assert "/requests/1/asc/speed_mps" in str(refused)


def test_numbers_of_numpy_are_numbers(client):
    snapshot = client.example("track")
    snapshot["asc"]["north_m"] = np.float32(1.5)
    snapshot["area"] = np.array([[-500, -500], [-500, 500], [500, 500], [500, -500]])
    assert client.validate(snapshot)["request"]["asc"]["north_m"] == 1.5
    snapshot["asc"]["north_m"] = float("nan")
    with pytest.raises(ValueError, match="JSON"):
        client.plan(snapshot)


def test_a_comparison_is_a_table_with_a_winner_in_each_row(client):
    comparison = client.compare(client.example("intermittent"))
    frame = comparison.frame()
    assert list(frame.index) == list(comparison.plans)
    assert {"mpc", "saturated_los"} <= comparison.plans.keys()
    assert comparison.winner("predicted cost") == frame.predicted_cost.idxmin()
    html = comparison._repr_html_()
    assert html.count("<b>") == 3
    assert html.count("<th>") == 1 + len(frame) + 3


def test_the_service_tells_of_itself(client):
    assert client.limits()["auvs"] == 16
    assert "medusa" in [craft["name"] for craft in client.crafts()]
    names = [example["name"] for example in client.examples()]
    assert names[0] == "track"
    with pytest.raises(Refused, match="no_example"):
        client.example("no/such ?")


def test_a_service_with_tokens_wants_one(own_service: Service):
    command = [program(), "token", "add", "bridge", "--role", "read-only", "--data", str(own_service.data)]
    token = subprocess.run(command, check=True, capture_output=True, text=True).stdout.strip()
    # The service looks at the file of tokens once a second.
    own_service.kill()
    own_service.start()
    with Client(own_service.url) as client, pytest.raises(Refused, match="401 unauthenticated"):
        client.limits()
    with Client(own_service.url, token) as client:
        assert client.plan(client.example("track"))["outcome"] == "ok"
        with pytest.raises(Refused, match=r"403 forbidden.*operator"):
            client.simulate("paper-tracking")


def test_where_nothing_listens_is_said_at_once(own_service: Service):
    own_service.kill()
    with Client(own_service.url) as client:
        with pytest.raises(Unreachable, match="no answer"):
            client.plan({})
        with pytest.raises(Unreachable):
            client.simulate("paper-tracking")
    with pytest.raises(ValueError, match="http://"):
        Client("127.0.0.1:8080")
