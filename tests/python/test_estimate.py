"""The planner's estimate of an underwater vehicle from its reports, beside FilterPy's from the same.

PILOTFISH is the path of the program.
"""

import json
import subprocess
import urllib.request
from collections.abc import Iterator

import numpy as np
import pytest
from filterpy.common import van_loan_discretization
from filterpy.kalman import IMMEstimator, KalmanFilter

from program import program

# The planner's numbers, SI units: planner/src/estimate/*.rs says why.
STRAIGHT_DENSITY, STRAIGHT_DENSITY_OF_SPEED = 1.5e-4, 1e-4
FORGETTING_LENGTH = 20.0
STRAIGHT_LENGTH, MANOEUVRE_LENGTH = 100.0, 30.0
MANOEUVRE_SPEED_MIN, ACCELERATION_MAX = 0.1, 0.1
PROBABILITY_MIN = 1e-9
UNKNOWN_SPEED_SIGMA = 3.0
SPEED_SIGMA, COURSE_SIGMA = 0.03, 0.05
FORECAST_DENSITY = 2e-4

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
    # In the planner's order: the most exact first of those of one time. Least probabilities depend on it.
    return sorted(reports, key=lambda report: (report["t_s"], report["sigma_m"]))


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


def motion(forgetting: float, density: float, t: float) -> tuple[np.ndarray, np.ndarray]:
    """F and Q over t seconds of v' = -forgetting v + w, by Van Loan's method, to the order of the state."""
    axis = np.array([[0, 1], [0, -forgetting]])
    f, q = van_loan_discretization(axis, np.array([[0], [np.sqrt(density)]]), t)
    return np.kron(f, np.eye(2)), np.kron(q, np.eye(2))


def transition(speed: float, t: float) -> np.ndarray:
    """Probabilities from (straight, manoeuvre) to the same, t seconds later."""
    begin, end = speed / STRAIGHT_LENGTH, speed / MANOEUVRE_LENGTH
    changed = 1 - np.exp(-(begin + end) * t)
    stationary = np.array([end, begin]) / (begin + end)
    return (1 - changed) * np.eye(2) + changed * np.tile(stationary, (2, 1))


def take(both: IMMEstimator, z: np.ndarray, r: np.ndarray, h: np.ndarray) -> None:
    """Takes a measurement in, with no time gone by since the one before."""
    for kalman in both.filters:
        kalman.R, kalman.H = r, h
    both.M = np.eye(2)
    both._compute_mixing_probabilities()
    before = both.mu
    both.update(z)
    # No measurement rules a model out for good.
    left = np.maximum(before * both.likelihood / np.max(both.likelihood), PROBABILITY_MIN)
    both.mu = left / np.sum(left)
    both._compute_state_estimate()


def predict(both: IMMEstimator, report: dict, t: float) -> None:
    known = np.sqrt(np.sum(both.x[2:] ** 2) + np.trace(both.P[2:, 2:]))
    reported = min(report.get("speed_mps", 0), known + ACCELERATION_MAX * t)
    speed = max(reported, known, MANOEUVRE_SPEED_MIN)
    straight, manoeuvre = both.filters
    straight.F, straight.Q = motion(0, STRAIGHT_DENSITY + STRAIGHT_DENSITY_OF_SPEED * speed**2, t)
    manoeuvre.F, manoeuvre.Q = motion(speed / FORGETTING_LENGTH, 2 * speed**3 / FORGETTING_LENGTH, t)
    both.M = transition(speed, t)
    both._compute_mixing_probabilities()
    both.predict()
    both.mu = both.cbar


def started(report: dict) -> KalmanFilter:
    kalman = KalmanFilter(dim_x=4, dim_z=2)
    kalman.x = np.array([[report["north_m"]], [report["east_m"]], [0], [0]])
    variance = report["sigma_m"] ** 2
    kalman.P = np.diag([variance, variance, UNKNOWN_SPEED_SIGMA**2, UNKNOWN_SPEED_SIGMA**2])
    return kalman


def filtered(reports: list[dict]) -> IMMEstimator:
    """FilterPy's estimate, of two motion models, at the time of the last report."""
    length = STRAIGHT_LENGTH + MANOEUVRE_LENGTH
    shares = [STRAIGHT_LENGTH / length, MANOEUVRE_LENGTH / length]
    both = IMMEstimator([started(reports[0]), started(reports[0])], shares, np.eye(2))
    for i, report in enumerate(reports):
        if i > 0:
            predict(both, report, report["t_s"] - reports[i - 1]["t_s"])
        if "course_rad" in report:
            course, speed = report["course_rad"], report["speed_mps"]
            velocity = speed * np.array([[np.cos(course)], [np.sin(course)]])
            take(both, velocity, velocity_noise(report), VELOCITY)
        if i > 0:
            position = np.array([[report["north_m"]], [report["east_m"]]])
            take(both, position, report["sigma_m"] ** 2 * np.eye(2), POSITION)
    return both


@pytest.mark.parametrize("telemetry", [0.0, 0.5, 1.0])
@pytest.mark.parametrize("seed", range(10))
def test_the_estimate_is_that_of_another_filter_of_two_models(url: str, seed: int, telemetry: float) -> None:
    reports = flight(seed, telemetry)
    ours, theirs = estimate(url, reports), filtered(reports)
    assert ours["rejected"] == [], "none is outside the gate"
    assert ours["age_s"] == NOW - reports[-1]["t_s"]
    mean = [ours[name] for name in ("north_m", "east_m", "north_mps", "east_mps")]
    # Twenty updates in double precision, of numbers below a hundred.
    np.testing.assert_allclose(mean, theirs.x.ravel(), rtol=0, atol=1e-9)
    np.testing.assert_allclose(ours["covariance"], theirs.P, rtol=0, atol=1e-9)

    # From there on it goes straight.
    f, q = motion(0, FORECAST_DENSITY, ours["age_s"])
    now = f @ theirs.P @ f.T + q
    assert ours["position_sigma_m"] == pytest.approx(np.sqrt(np.trace(now[:2, :2])), abs=1e-9)


def test_an_outlier_is_named_and_changes_nothing(url: str) -> None:
    reports = flight(3, 1.0)
    clean = estimate(url, reports)
    wrong = reports[10] | {"t_s": reports[10]["t_s"] + 0.5, "north_m": reports[10]["north_m"] + 30}
    assert estimate(url, [*reports, wrong])["north_m"] == clean["north_m"]
    shuffled = np.random.default_rng(1).permutation([*reports, wrong]).tolist()
    assert estimate(url, [*reports, wrong])["rejected"] == [shuffled.index(wrong)]
