"""How vehicles move, what the craft is asked for, and when nothing may be published. No clock, no input, no output."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass
from typing import Any, Self

import numpy as np

# A craft that has not reported its position for this long gets no reference, s.
STATE_AGE_MAX_S = 3.0
# Warnings of a plan that the craft does not respond.
NOT_FOLLOWED = ("craft_does_not_follow", "heading_does_not_respond", "speed_does_not_respond")


@dataclass(frozen=True)
class Motion:
    """Position and motion of a vehicle."""

    t_s: float
    """Unix time."""
    north_m: float
    east_m: float
    depth_m: float
    heading_rad: float
    ground_velocity: np.ndarray | None
    """(north, east), m/s; None where the twist is empty."""
    yaw_rate_radps: float
    """Positive to starboard."""
    sigma_m: float | None
    """Standard deviation of the horizontal position in its worst direction; None where the covariance is empty."""


@dataclass(frozen=True)
class Reference:
    """What the craft is asked for."""

    speed_mps: float
    """Speed ahead, never negative, as the craft's speed loop measures it."""
    heading_rad: float
    """Heading, clockwise from north, within ±π."""


@dataclass(frozen=True)
class Plan:
    """A plan as the craft follows it. Times are on the node's monotonic clock, s."""

    planned_s: float
    valid_until_s: float
    first: Reference
    """The plan's reference at `planned_s`."""
    stages: np.ndarray
    """A row for each stage: time, north, east, speed through the water, unwrapped heading."""
    lags_s: tuple[float, float]
    """How far references are ahead of the planned motion: heading loop, speed loop."""
    current: tuple[float, float]
    """Current (north, east) that a speed over ground contains, m/s; zero where the craft holds speed through water."""
    status: str
    """One line for the log."""
    faults: tuple[str, ...] = ()
    """Why it is degraded, or why the craft does not follow it."""
    sequence: int = 0
    """Number of the event that stored it."""

    @classmethod
    def from_answer(cls, answer: Any, now_s: float) -> Self:
        """The plan in an answer of `…/reference` that arrived at `now_s`."""
        plan = answer["plan"]
        # From the mission's clock to the node's.
        shift = now_s - answer["age_s"] - answer["t_s"]
        rows = [
            [point["t_s"] + shift, *(point[name] for name in ("north_m", "east_m", "speed_mps", "heading_rad"))]
            for point in plan["trajectory"]
        ]
        stages = np.array(rows, dtype=float)
        stages[:, 4] = np.unwrap(stages[:, 4])
        reference, craft = plan["reference"], plan["craft_estimate"]
        is_over_ground = craft["speed_held"] == "over_ground" and plan["current"] is not None
        goal = plan["goal"]["trajectory"][0]
        distance_m = math.dist(stages[0, 1:3], (goal["north_m"], goal["east_m"]))
        warnings = [warning["code"] for warning in plan["warnings"]]
        return cls(
            planned_s=answer["t_s"] + shift,
            valid_until_s=reference["valid_until_s"] + shift,
            first=Reference(reference["speed_mps"], reference["heading_rad"]),
            stages=stages,
            lags_s=(_lag(craft, "heading_lag_s"), _lag(craft, "surge_lag_s")),
            current=(plan["current"]["north_mps"], plan["current"]["east_mps"]) if is_over_ground else (0.0, 0.0),
            status=", ".join([f"{plan['method']} {plan['outcome']}", f"{distance_m:.1f} m from the goal", *warnings]),
            faults=tuple(
                code.replace("_", " ")
                for code in [*(code for code in warnings if code in NOT_FOLLOWED), plan.get("reason")]
                if code
            ),
            sequence=answer["sequence"],
        )

    def at(self, t_s: float) -> Reference | None:
        """The reference at `t_s`: the plan's own, plus what the planned motion changes from then on; None once the
        plan is too old.

            psi_ref(t) = psi_ref(t0) + psi(t + T_psi) - psi(t0 + T_psi)
            u_ref(t)   = u_ref(t0) + u(t + T_u) - u(t0 + T_u), plus the change of the current along the bow

        The planner asks for what the loops need in order to be on the planned motion one lag later.
        """
        if not t_s <= self.valid_until_s:
            return None
        since = max(t_s, self.planned_s)

        def change(column: int, lag_s: float) -> float:
            ends = np.array([self.planned_s, since]) + lag_s
            before, after = np.interp(ends, self.stages[:, 0], self.stages[:, column])
            return float(after - before)

        heading = wrap(self.first.heading_rad + change(4, self.lags_s[0]))
        speed = self.first.speed_mps + change(3, self.lags_s[1])
        north, east = self.current
        speed += north * (math.cos(heading) - math.cos(self.first.heading_rad))
        speed += east * (math.sin(heading) - math.sin(self.first.heading_rad))
        return Reference(max(speed, 0.0), heading)


def why_silent(state_age_s: float | None, reference: Reference | None, status: str, has_planned: bool) -> str | None:
    """Why no reference may be published now; None where it may.

    `state_age_s` is the age of the craft's newest state, `reference` what the newest plan asks for now, `status` that
    of the mission.
    """
    if state_age_s is None or state_age_s > STATE_AGE_MAX_S:
        return "no recent odometry of the craft"
    if status != "running":
        return f"the mission is {status}"
    if reference is None:
        return "the newest plan is too old" if has_planned else "no plan yet"
    return None


class Arrivals:
    """Arrivals of what should keep coming: plans, or the fixes of an AUV. Times are monotonic, s."""

    # Number of kept times between arrivals, and the least number that predicts the next one; when it is overdue, s.
    INTERVALS, INTERVALS_MIN, OVERDUE_S = 8, 3, 2.0

    def __init__(self) -> None:
        self._newest_s: float | None = None
        self._intervals: deque[float] = deque(maxlen=self.INTERVALS)

    def push(self, at_s: float) -> None:
        """Something came at `at_s`."""
        if self._newest_s is not None:
            self._intervals.append(at_s - self._newest_s)
        self._newest_s = at_s

    def is_overdue(self, now_s: float) -> bool:
        """Whether another one should have come: after the longest of the last intervals."""
        if self._newest_s is None or len(self._intervals) < self.INTERVALS_MIN:
            return False
        return now_s - self._newest_s > max(self._intervals) + self.OVERDUE_S


def steering(silence: str | None, is_meant: bool, faults: list[str], missing: list[str]) -> tuple[str, str]:
    """The state of the steering and its reason, for every display.

    `silence` is why nothing is published, which `is_meant` or not; `faults` make the steering degraded, `missing` is
    what it lacks to be called good.
    """
    if silence is not None:
        return ("waiting" if is_meant else "not_steering", silence)
    return ("degraded", "; ".join(faults)) if faults else ("steering", "; ".join(missing))


class CurrentObserver:
    """The current, from velocity over ground and heading: a craft that drifts across its bow drifts with the current.

        n(psi)' v_g = n(psi)' c + noise        n: to starboard
        dc/dt = noise

    A Kalman filter on (north, east). Headings that differ show both components.
    """

    # Of the current at the start, m/s; its change, m/s per root second; of the drift that is not current, m/s, and
    # that per rad/s of yaw rate; how long waves correlate the drift, s; the longest gap that counts, s.
    SIGMA, CHANGE, DRIFT, DRIFT_PER_YAW_RATE, CORRELATION_S, GAP_MAX_S = 0.3, 0.1 / 24.5, 0.1, 1.0, 2.0, 60.0

    def __init__(self) -> None:
        self.current = np.zeros(2)
        self._covariance = np.eye(2) * self.SIGMA**2
        self._updated_s: float | None = None

    def update(self, t_s: float, heading: float, yaw_rate: float, over_ground: np.ndarray) -> None:
        """Takes a measurement at `t_s`: velocity over ground (north, east), m/s, and yaw rate, rad/s."""
        gap_s = self.CORRELATION_S if self._updated_s is None else t_s - self._updated_s
        self._updated_s = t_s
        if gap_s <= 0.0:
            return
        self._covariance += np.eye(2) * self.CHANGE**2 * min(gap_s, self.GAP_MAX_S)
        across = starboard(heading)
        noise = self.DRIFT**2 + (self.DRIFT_PER_YAW_RATE * yaw_rate) ** 2
        noise *= max(self.CORRELATION_S / gap_s, 1.0)
        gain = self._covariance @ across
        gain /= across @ gain + noise
        self.current += gain * (across @ (over_ground - self.current))
        self._covariance -= np.outer(gain, across @ self._covariance)

    def through_water(self, heading: float, over_ground: np.ndarray) -> tuple[float, float]:
        """Surge and sway through the water, m/s."""
        velocity = over_ground - self.current
        return float(ahead(heading) @ velocity), float(starboard(heading) @ velocity)


def ahead(heading: float) -> np.ndarray:
    """Unit vector (north, east) where the bow points."""
    return np.array([math.cos(heading), math.sin(heading)])


def starboard(heading: float) -> np.ndarray:
    """Unit vector (north, east) to starboard."""
    return np.array([-math.sin(heading), math.cos(heading)])


def wrap(angle: float) -> float:
    """The same angle within ±π."""
    return math.remainder(angle, math.tau)


def _lag(craft: Any, name: str) -> float:
    return max(craft[name]["value"], 0.0)
