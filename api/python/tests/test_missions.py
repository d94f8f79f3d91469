"""Missions that the service keeps."""

import subprocess
import sys
import threading
import time
from pathlib import Path

import pandas as pd
import pytest
from conftest import Service, program
from live import LIVE, heard

from pilotfish import Client, Refused, Unreachable

# From a kill until the service is started again, s.
OUTAGE_S = 1.0

SHORT = """
schema_version = "1"
name = "short"
title = "twenty seconds"
duration_s = 20
settled_after_s = 10

[surface_craft]
class = "medusa"
north_m = 0
east_m = 10
heading_rad = 0
speed_mps = 0.3
contact_range_m = 30
goal.track.auv = "auv-1"

[[auvs]]
id = "auv-1"
north_of_path_m = 0
east_of_path_m = 0
heading_off_path_rad = 0
depth_m = 1
leg = "down"
path.lawn_mower = {from = [0, 0], heading_rad = 0, lane_length_m = 100, lane_spacing_m = 20, lanes = 4}
"""


def test_a_simulated_mission_becomes_a_table_and_files(client, tmp_path):
    with client.simulate("paper-tracking", seed=2, title="table") as mission:
        assert mission.step(30)["t_s"] == 29
        table = mission.frame()
        saved = mission.save(tmp_path / "mission.csv")
    assert mission.look()["status"] == "finished"
    assert len(table[(table.kind == "truth") & (table.vehicle == "asc")]) == 30
    pd.testing.assert_series_equal(pd.read_csv(saved).north_m, table.north_m)
    assert mission.save(tmp_path / "all", "events_ndjson").read_bytes() == mission.record("events_ndjson")
    with pytest.raises(ValueError, match=r"\.parquet"):
        mission.save(tmp_path / "mission.xlsx")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["all", "mission.csv"]


@pytest.mark.soak
def test_a_simulated_mission_runs_to_its_end(client, tmp_path):
    scenario = tmp_path / "short.toml"
    scenario.write_text(SHORT)
    with client.simulate(scenario) as mission:
        mission.run()
        assert mission.wait(timeout_s=60)["status"] == "finished"
        assert [event.kind for event in mission.events(after=20)] == ["planned", "planned", "finished"]
        assert list(mission.events(after=None)) == []


def test_a_mission_is_finished_at_the_end_of_its_context(client):
    with client.create_mission(live=LIVE) as mission:
        mission.run()
    assert mission.look()["status"] == "finished"

    with pytest.raises(ZeroDivisionError), client.create_mission(live=LIVE) as mission:
        raise ZeroDivisionError
    assert mission.look()["status"] == "finished"

    with client.create_mission(live=LIVE, finish_at_exit=False) as mission:
        mission.run()
    assert mission.look()["status"] == "running"
    with client.mission(mission.id) as same:
        pass
    assert same.look()["status"] == "running"
    with client.mission(mission.id, finish_at_exit=True) as same:
        same.delete()
    with pytest.raises(Refused, match="404 no_mission"):
        mission.look()


def test_all_missions_are_listed_page_by_page(client):
    made = [client.create_mission(live=LIVE).id for _ in range(101)]
    listed = [mission["id"] for mission in client.missions()]
    assert len(listed) == len(set(listed))
    assert listed[-101:] == made
    for name in made:
        client.mission(name).delete()


@pytest.mark.soak
def test_a_live_mission_is_fed_steered_by_and_changed(client):
    with client.create_mission(live=LIVE) as mission:
        mission.run()
        assert mission.reference() is None
        mission.report(**heard())
        reference = mission.reference(wait_s=10)
        assert reference["plan"]["reference"]["valid_until_s"] > time.time()
        changed = mission.change(keep_outs=[{"north_m": 90.0, "east_m": 0.0, "radius_m": 5.0}])
        assert changed["setting"]["keep_outs"]
        newer = mission.reference(wait_s=10, after=changed["sequence"])
        assert newer["sequence"] > changed["sequence"]
        assert mission.change(keep_outs=None)["setting"]["keep_outs"] is None
        assert mission.pause()["status"] == "paused"
        with pytest.raises(TimeoutError, match="paused"):
            mission.wait(timeout_s=0.1)


def test_a_report_has_its_key(client):
    with client.create_mission(live=LIVE) as mission:
        posted = heard()
        first = mission.report(**posted)
        assert mission.report(**posted) != first, "each call has a key of its own"
        again = [mission.report(**posted, key="k")["sequence"] for _ in range(2)]
        assert again[0] == again[1]


@pytest.mark.soak
def test_a_killed_service_costs_no_event_and_no_report(own_service: Service):
    with Client(own_service.url) as client, client.create_mission(live=LIVE) as mission:
        seen = []
        watcher = threading.Thread(target=lambda: seen.extend(mission.events()))
        watcher.start()
        mission.run()
        accepted = []
        for post in range(30):
            if post == 15:
                own_service.kill()
                threading.Timer(OUTAGE_S, own_service.start).start()
            accepted.append(mission.report(**heard(10 + 0.02 * post))["sequence"])
            time.sleep(0.1)
        last = mission.finish()["sequence"]
        watcher.join(timeout=30)
    assert [event.sequence for event in seen] == list(range(1, last + 1))
    assert seen[-1].kind == "finished"
    assert [event.sequence for event in seen if event.kind == "reported"] == accepted
    assert len(accepted) == 30
    assert sum(event.kind == "planned" for event in seen) >= 2


@pytest.mark.soak
def test_five_auvs_are_served_by_the_same_schedule_after_a_kill(own_service: Service):
    example = Path(__file__).parents[3] / "examples" / "visits.py"
    assert len(example.read_text(encoding="utf-8").splitlines()) < 30
    command = [sys.executable, str(example), own_service.url, "20"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as flight:
        time.sleep(10)
        own_service.kill()
        time.sleep(OUTAGE_S)
        own_service.start()
        lines = flight.communicate(timeout=60)[0].splitlines()
    assert flight.returncode == 0
    assert len(lines) > 12
    # The first is reached after 27 s. A schedule that was forgotten would start anew, with ages of 0.
    served = {line.split("s: ")[1].split(" next")[0] for line in lines}
    assert len(served) == 1, lines
    ages = [float(line.split("next: ")[1].split(" s ")[0]) for line in lines]
    assert ages == sorted(ages), lines
    assert ages[-1] > 15, lines


@pytest.mark.soak
def test_a_fleet_that_was_killed_half_way_goes_on_and_replays_equal(own_service: Service):
    example = Path(__file__).parents[3] / "examples" / "fleet_mission.py"
    assert len(example.read_text(encoding="utf-8").splitlines()) < 40
    for _ in range(2):
        subprocess.run([sys.executable, example, "6", own_service.url], check=True)
        own_service.kill()
        own_service.start()
    with Client(own_service.url) as client:
        [mission] = client.missions()
    own_service.kill()
    replay = [program(), "replay", mission["id"], "--data", own_service.data]
    told = subprocess.run(replay, capture_output=True, text=True, check=False)
    assert told.returncode == 0 and " 0 different" in told.stdout, told


@pytest.mark.soak
def test_patience_with_a_service_that_stays_away_is_bounded(own_service: Service):
    with Client(own_service.url, patience_s=1.0) as client:
        mission = client.create_mission(live=LIVE)
        events = mission.events()
        assert next(events).kind == "created"
        own_service.kill()
        for ask in (lambda: next(events), lambda: mission.report(**heard()), mission.look):
            begin = time.monotonic()
            with pytest.raises(Unreachable):
                ask()
            assert 1.0 <= time.monotonic() - begin < 5.0
        with pytest.raises(ZeroDivisionError) as caught, mission:
            raise ZeroDivisionError
        assert "was not finished" in caught.value.__notes__[0]
