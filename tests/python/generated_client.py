"""A client that openapi-python-client made of /openapi.json, at work: plans a snapshot, keeps a live mission.

    python generated_client.py URL DOCUMENT

The package `pilotfish_client` is that client. Times of the mission are Unix times, s; positions m, north and east.
"""

import json
import pkgutil
import sys
import time
import uuid
from http import HTTPStatus

import pilotfish_client
from pilotfish_client import api, models
from pilotfish_client.api.examples import get_example
from pilotfish_client.api.missions import (
    create_mission,
    finish_mission,
    get_record,
    get_reference,
    list_missions,
    patch_mission,
    post_reports,
    run_mission,
)
from pilotfish_client.api.plan import plan
from pilotfish_client.models import ProblemDocument

AUV = "auv-1"
# Longest wait for a plan of a mission that plans once a second, s.
WAIT = 10.0


def answer(response, status=HTTPStatus.OK):
    """What was answered with `status`, as the client reads it."""
    assert response.status_code == status, f"{response.status_code}: {response.content.decode(errors='replace')}"
    return response.parsed


def check_every_call_has_a_function(document):
    """A call that the generator could not make a function of would go unseen."""
    calls = {
        operation["operationId"]
        for path in document["paths"].values()
        for operation in path.values()
    }
    made = {module.name.rsplit(".", 1)[-1] for module in pkgutil.walk_packages(api.__path__, f"{api.__name__}.")}
    assert calls <= made, f"no function for {sorted(calls - made)}"


def check_plan(client):
    """An example is planned for; one with an impossible heading is refused, and the field is named."""
    snapshot = answer(get_example.sync_detailed("track", client=client))
    planned = answer(plan.sync_detailed(client=client, body=snapshot))
    assert planned.outcome == models.Outcome.OK, planned
    assert len(planned.trajectory) > 10, planned
    snapshot.asc.heading_rad = 19.0
    refused = answer(plan.sync_detailed(client=client, body=snapshot), HTTPStatus.UNPROCESSABLE_ENTITY)
    assert isinstance(refused, ProblemDocument), refused
    assert [error.pointer for error in refused.errors] == ["/asc/heading_rad"], refused


def new_mission():
    """A live mission that follows one AUV."""
    live = models.Live(
        auvs=[models.LiveAuv(id=AUV)],
        goal=models.GoalTrack(kind=models.GoalTrackKind.TRACK, auv=AUV),
        origin=models.Origin(lat_deg=38.41, lon_deg=-9.12),  # the record as GeoJSON needs it
    )
    return models.NewMission(schema_version="1.0", title="generated client", live=live)


def heard():
    """A fix of the AUV and a state of the surface craft, 10 m apart, as of now."""
    now = time.time()
    fix = models.Report(t_s=now, north_m=10.0, east_m=0.0, sigma_m=1.0)
    auvs = models.ReportsAuvs()
    auvs[AUV] = [fix]
    state = models.Asc(north_m=0.0, east_m=0.0, heading_rad=0.0, speed_mps=0.5)
    return models.Reports(auvs=auvs, asc=[models.AscReport(t_s=now, state=state)])


def check_mission(client):
    """A mission is made, run, fed and changed; it is listed, gives a reference, and leaves a record. Keys do what they are for."""
    run = uuid.uuid4().hex
    made = answer(
        create_mission.sync_detailed(client=client, body=new_mission(), idempotency_key=f"{run}-create"),
        HTTPStatus.CREATED,
    )
    again = answer(
        create_mission.sync_detailed(client=client, body=new_mission(), idempotency_key=f"{run}-create"),
        HTTPStatus.CREATED,
    )
    assert again.id == made.id, "a key makes one mission"
    listed = answer(list_missions.sync_detailed(client=client, after=0, limit=1000))
    assert made.id in [mission.id for mission in listed.missions], listed

    posted = heard()
    first = answer(post_reports.sync_detailed(made.id, client=client, body=posted, idempotency_key=f"{run}-0"))
    second = answer(post_reports.sync_detailed(made.id, client=client, body=posted, idempotency_key=f"{run}-0"))
    assert first.sequence == second.sequence, "a key stores one report"
    running = answer(
        run_mission.sync_detailed(made.id, client=client, body=models.Run(), idempotency_key=f"{run}-run")
    )
    assert running.status == models.Status.RUNNING, running

    # Where there is none yet, the wait is over with the first plan.
    reference = answer(get_reference.sync_detailed(made.id, client=client, wait_s=WAIT))
    assert reference.mission == made.id, reference
    assert reference.plan.reference.valid_until_s > posted.asc[0].t_s, reference
    disc = models.KeepOut(north_m=90.0, east_m=0.0, radius_m=5.0)
    changed = answer(patch_mission.sync_detailed(made.id, client=client, body=models.Setting(keep_outs=[disc])))
    assert changed.setting.keep_outs == [disc] and changed.setting.goal == new_mission().live.goal, changed
    cleared = answer(patch_mission.sync_detailed(made.id, client=client, body=models.Setting(keep_outs=None)))
    assert cleared.setting.keep_outs is None, cleared
    over = answer(finish_mission.sync_detailed(made.id, client=client, idempotency_key=f"{run}-finish"))
    assert over.status == models.Status.FINISHED, over

    record = answer(get_record.sync_detailed(made.id, client=client, format_=models.GetRecordFormat.GEOJSON))
    assert record["type"] == "FeatureCollection", record


def main():
    url, path = sys.argv[1:]
    with open(path, encoding="utf-8") as file:
        check_every_call_has_a_function(json.load(file))
    with pilotfish_client.Client(base_url=url, timeout=2 * WAIT) as client:
        check_plan(client)
        check_mission(client)
    print("a generated client planned, kept a mission, and read its reference and its record")


if __name__ == "__main__":
    main()
