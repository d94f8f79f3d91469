"""The planner's estimate of an underwater vehicle from its reports, beside FilterPy's from the same.

PILOTFISH is the path of the program.
"""

import json
import subprocess
import urllib.request
from collections.abc import Iterator

import numpy as np
import pytest
from filterpy.common import Q_continuous_white_noise
from filterpy.kalman import KalmanFilter

from program import program

# The planner's numbers, SI units: planner/src/estimate/kalman.rs says why.
ACCELERATION_DENSITY = 2e-4
UNKNOWN_SPEED_SIGMA = 3.0
SPEED_SIGMA, COURSE_SIGMA = 0.03, 0.05

NOW = 200.0
POSITION, VELOCITY = np.eye(2, 4), np.eye(2, 4, k=2)


@pytest.fixture(scope="module")
def url() -> Iterator[str]:
    """Where the program serves, on a free port."""
    command = [program(), "serve", "--port", "0"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as server:
        try:
            yield "http://" + server.stdout.readline().strip().rpartition("http://")[2]
        finally:
            server.terminate()


def flight(seed: int, telemetry: float) -> list[dict]:
    """Reports of a vehicle that goes straight on, at irregular times, some of them twice at one time.

    `telemetry`: share of the reports in which it says how it moves.
    """
    rng = np.random.default_rng(seed)
    velocity = rng.normal(0, 0.3, 2)
    reports = []
    for t in np.sort(np.round(rng.uniform(50, NOW, 20))):
        sigma = rng.uniform(0.5, 3)
        report = {"t_s": t, "sigma_m": sigma}
        report["north_m"], report["east_m"] = velocity * (t - 50) + rng.normal(0, sigma, 2)
        if rng.uniform() < telemetry:
            said = velocity + rng.normal(0, SPEED_SIGMA, 2)
            report["course_rad"], report["speed_mps"] = np.arctan2(said[1], said[0]), np.hypot(*said)
        reports.append(report)
    return reports


def estimate(url: str, reports: list[dict]) -> dict:
    """The planner's, from the reports in another order."""
    shuffled = np.random.default_rng(1).permutation(reports).tolist()
    request = {
        "schema_version": "1.0",
        "t_s": NOW,
        "asc": {"north_m": 0, "east_m": 0, "heading_rad": 0, "speed_mps": 0.3},
        "auvs": [{"id": "auv-1", "reports": shuffled}],
        "goal": {"kind": "track", "auv": "auv-1"},
    }
    body = json.dumps(request).encode()
    post = urllib.request.Request(url + "/v1/plan", body, {"content-type": "application/json"})
    with urllib.request.urlopen(post) as answer:
        return json.load(answer)["targets"][0]["estimate"]


def velocity_noise(report: dict) -> np.ndarray:
    """Covariance of a telemetered velocity: along the course the speed errs, across it the course too."""
    c, s = np.cos(report["course_rad"]), np.sin(report["course_rad"])
    across = SPEED_SIGMA**2 + (COURSE_SIGMA * report["speed_mps"]) ** 2
    turn = np.array([[c, -s], [s, c]])
    return turn @ np.diag([SPEED_SIGMA**2, across]) @ turn.T


def predict(kalman: KalmanFilter, t: float) -> None:
    kalman.F = np.eye(4) + t * np.eye(4, k=2)
    kalman.Q = Q_continuous_white_noise(2, t, ACCELERATION_DENSITY, block_size=2, order_by_dim=False)
    kalman.predict()


def filtered(reports: list[dict]) -> KalmanFilter:
    """FilterPy's estimate at the time of the last report."""
    kalman = KalmanFilter(dim_x=4, dim_z=2)
    for i, report in enumerate(reports):
        position = np.array([[report["north_m"]], [report["east_m"]]])
        variance = report["sigma_m"] ** 2
        if i == 0:
            kalman.x = np.vstack([position, np.zeros((2, 1))])
            kalman.P = np.diag([variance, variance, UNKNOWN_SPEED_SIGMA**2, UNKNOWN_SPEED_SIGMA**2])
        else:
            predict(kalman, report["t_s"] - reports[i - 1]["t_s"])
        if "course_rad" in report:
            course, speed = report["course_rad"], report["speed_mps"]
            velocity = speed * np.array([[np.cos(course)], [np.sin(course)]])
            kalman.update(velocity, R=velocity_noise(report), H=VELOCITY)
        if i > 0:
            kalman.update(position, R=variance * np.eye(2), H=POSITION)
    return kalman


@pytest.mark.parametrize("telemetry", [0.0, 0.5, 1.0])
@pytest.mark.parametrize("seed", range(10))
def test_the_estimate_is_that_of_another_kalman_filter(url: str, seed: int, telemetry: float) -> None:
    reports = flight(seed, telemetry)
    ours, theirs = estimate(url, reports), filtered(reports)
    assert ours["rejected"] == [], "none is outside the gate"
    assert ours["age_s"] == NOW - reports[-1]["t_s"]
    mean = [ours[name] for name in ("north_m", "east_m", "north_mps", "east_mps")]
    # Twenty updates in double precision, of numbers below a hundred.
    np.testing.assert_allclose(mean, theirs.x.ravel(), rtol=0, atol=1e-9)
    np.testing.assert_allclose(ours["covariance"], theirs.P, rtol=0, atol=1e-9)

    predict(theirs, ours["age_s"])
    sigma = np.sqrt(np.trace(theirs.P[:2, :2]))
    assert ours["position_sigma_m"] == pytest.approx(sigma, abs=1e-9)


def test_an_outlier_is_named_and_changes_nothing(url: str) -> None:
    reports = flight(3, 1.0)
    clean = estimate(url, reports)
    wrong = reports[10] | {"t_s": reports[10]["t_s"] + 0.5, "north_m": reports[10]["north_m"] + 30}
    assert estimate(url, [*reports, wrong])["north_m"] == clean["north_m"]
    shuffled = np.random.default_rng(1).permutation([*reports, wrong]).tolist()
    assert estimate(url, [*reports, wrong])["rejected"] == [shuffled.index(wrong)]
