"""The node on the clock of a simulator, which began elsewhere and may run slowly."""

import math
import time

import pytest
import rclpy
from test_node import SIMULATED_START_S, Sea


@pytest.fixture
def sea(tmp_path, request):
    rclpy.init()
    sea = Sea(tmp_path, rate=request.param)
    yield sea
    sea.close()
    rclpy.shutdown()


@pytest.mark.parametrize("sea", [1.0], indirect=True)
def test_a_boat_on_a_simulators_clock_is_steered_and_reported_in_unix_time(sea):
    far = sea.distance()
    sea.until(lambda: sea.distance() < far - 10.0, f"the boat is still {sea.distance():.1f} m from the goal", 90.0)
    # References and paths are stamped by the simulator's clock.
    ahead = SIMULATED_START_S + time.monotonic() - sea.began_s
    stamp = sea.twists[-1].header.stamp
    assert abs(stamp.sec + 1e-9 * stamp.nanosec - ahead) < 2.0
    assert 0.0 < sea.paths[-1].poses[-1].header.stamp.sec - ahead < 120.0
    # The mission hears when it was in the time of its own clock, and what was where then.
    newest = sea.mission().look()["t_s"]
    states = [report for heard in sea.heard() for report in heard.get("asc", [])]
    assert abs(states[-1]["t_s"] - newest) < 5.0
    offset = time.time() - (SIMULATED_START_S + time.monotonic() - sea.began_s)
    for report in states:
        sent = min(sea.boat.sent.items(), key=lambda one: abs(one[0] + offset - report["t_s"]))[1]
        off = math.dist((sent["north_m"], sent["east_m"]), (report["state"]["north_m"], report["state"]["east_m"]))
        assert off < 0.5, "half a second at the boat's speed"
    assert sea.states[-1].startswith("steering")


@pytest.mark.parametrize("sea", [0.5], indirect=True)
def test_simulated_time_that_runs_slowly_is_said(sea):
    words = "simulated time runs at 0.5"
    sea.until(lambda: any(words in state for state in sea.states), f"not said: {sea.states[-3:]}", 60.0)
