"""Doubts about the craft's odometry: position, heading and velocity are claims, compared with each other.

These are the bridge's checks for one source, with its constants: `api/bridge/src/integrity.rs` says why each of them is
what it is, and a test compares them. Times are s on one clock, positions and velocities (north, east) in m and m/s.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from enum import Enum
from itertools import takewhile
from typing import Any

import numpy as np

from .following import Motion, wrap

SPEED_MAX, YAW_RATE_MAX = 20.0, 3.0
POSITION_GATE = (15.0, 5.0)
HEADING_GATE, HEADING_GATE_BY_RATE = (0.5, 1.5), (0.5, 0.2)
VELOCITY_GATE = (2.0, 3.0)
MISMATCH, MISMATCH_AFTER_S, MISMATCH_FOR_S = (8.0, 0.3), 5.0, 2.0
DRIFT, DRIFT_SIGMAS, DRIFT_AFTER_S = (0.35, 0.05), 5.0, 10.0
STILL_M, STILL_MIN_S = 0.1, 3.0
FROZEN_TRAVEL_M, FROZEN_SPEED = 5.7, 0.3
REQUESTED_M, REQUESTED_S = 10.0, 30.0
HEADING_STILL, STEADY_MIN_S = 0.005, 5.0
TURN_BY_RATE, TURN_WINDOW_S, TURN_BY_COURSE = 0.8, 20.0, 1.0
COURSE_SPEED, COURSE_OFF, COURSE_OFF_FOR_S = 0.7, 0.9, 10.0
LATCH_S, JUMP_SHOWN_S, FRESH_S, RATE_GAP_MAX_S = 60.0, 10.0, 2.0, 1.0
# integrity/turns.rs
TURN_EACH_S, TURN_KEPT_S, MEAN_S, MEAN_SPEED = 1.0, 20.0, 5.0, 0.7
OPPOSITE, OFF_RATE, SWING, SWING_AFTER_S, SETTLES_S = (0.8, 2.2), 0.8, 0.015, 8.0, 2.0
# integrity/track.rs
SETTLE_S, RIVAL_KEPT_S, RIVAL_COUNT_MIN, UNSETTLED_S = 3.0, 5.0, 3, 2.5
# recent_positions.rs
KEEP_EACH_S, KEPT_S, GAP_MAX_S = 0.5, 20.0, 3.0
VELOCITY_SPAN_S, TREND_COUNT_MIN = (2.0, 5.0), 5


class Alarm(Enum):
    """What contradicts what, the worst first."""

    POSITION_JUMPS = "the position jumps between places: two vehicles, or two publishers, on one topic"
    POSITION_FROZEN = (
        "the position does not change although twist or reference speed is not zero: odometry frozen, or no thrust"
    )
    HEADING_JUMPS = "the heading jumps: two vehicles, or two publishers, on one topic"
    HEADING_FROZEN = "the heading stays while the craft turns: compass frozen"
    POSITION_JUMPED = "the position jumped: the new position is used"
    NO_WAY = "the position does not change although the reference speed is not zero: check thrust and odometry"
    VELOCITY_CONTRADICTS = "the twist contradicts the positions: those count; is it in the axes of child_frame_id?"
    POSITION_DRIFTS = "positions and twist drift apart: check the odometry; the positions count"
    HEADING_JUMPED = "the heading jumped: the new heading is used; check the compass"
    HEADING_CONTRADICTS = (
        "the heading turns otherwise than the craft: yaw mirrored or compass off, or a current faster than the craft"
    )
    COURSE_OFF_HEADING = "the course is far off the heading: compass off, strong current, or astern"

    @property
    def stops(self) -> bool:
        """Whether the craft has no trustworthy state meanwhile: nothing is published."""
        return self in (Alarm.POSITION_JUMPS, Alarm.POSITION_FROZEN, Alarm.HEADING_JUMPS, Alarm.HEADING_FROZEN)


class Fit(Enum):
    """What became of a measurement."""

    FITS = 0
    JUMPED = 1
    MISSED = 2


@dataclass
class Track:
    """Innovation gating: the trusted measurement (time, value), and a second hypothesis that may replace it."""

    trusted: tuple[float, Any] | None = None
    rival: tuple[float, int, tuple[float, Any]] | None = None
    """Since when, how many measurements, the newest."""
    seen_s: float | None = None

    def take(self, t_s: float, value: Any, fits: Callable[[float, Any], bool]) -> Fit:
        """Takes a measurement; `fits` says whether it is inside the gate about an earlier one."""
        newest, rival = (t_s, value), self.rival
        is_first_in_a_while = self.seen_s is None or t_s - self.seen_s > UNSETTLED_S
        self.seen_s = t_s
        if self.trusted is None or t_s < self.trusted[0] - RIVAL_KEPT_S:
            self.trusted, self.rival = newest, None
            return Fit.FITS
        if rival is not None and t_s - rival[2][0] > RIVAL_KEPT_S:
            rival = None
        # The gate opens in silence. Among misses it would only let one of them pass.
        may_fit = is_first_in_a_while or t_s - self.trusted[0] <= UNSETTLED_S
        if may_fit and fits(*self.trusted):
            self.trusted = newest
            is_one = rival is not None and fits(*rival[2])
            self.rival = None if is_one else rival
            return Fit.JUMPED if is_one and rival[1] >= RIVAL_COUNT_MIN else Fit.FITS
        is_same = rival is not None and fits(*rival[2])
        since_s, count = (rival[0], rival[1] + 1) if is_same else (t_s, 1)
        self.rival = (since_s, count, newest)
        if self.trusted[0] < since_s and t_s - since_s >= SETTLE_S and count >= RIVAL_COUNT_MIN:
            self.trusted, self.rival = newest, None
            return Fit.JUMPED
        return Fit.MISSED

    def is_contested(self, t_s: float) -> bool:
        """Whether two hypotheses go on side by side, or no measurement has fitted for a while."""
        if self.trusted is None:
            return False
        is_double = False
        if self.rival is not None:
            since_s, count, (last_s, _) = self.rival
            is_double = count >= RIVAL_COUNT_MIN and self.trusted[0] > since_s and t_s - last_s <= RIVAL_KEPT_S
        return is_double or t_s - self.trusted[0] > UNSETTLED_S


@dataclass
class Trend:
    """The straight line through values by time: slope with standard deviation, and what the values are off it."""

    span_s: float
    slope: np.ndarray
    slope_sigma: float
    freedom: float
    rms: float

    def slope_beyond(self, sigmas: float) -> float:
        """The length of a slope that noise exceeds as rarely as a normal one of two axes exceeds so many `sigmas`.

        P(|slope| > k s) = (1 + k²/ν)^(−ν/2) = exp(−sigmas²/2)        |slope|²/2s²: F(2, ν)
        """
        return self.slope_sigma * math.sqrt(self.freedom * math.expm1(sigmas**2 / self.freedom))


def trend(values: list[tuple[float, np.ndarray]]) -> Trend | None:
    """Least squares through (time, value); None of a few."""
    if len(values) < TREND_COUNT_MIN:
        return None
    times, points = np.array([t_s for t_s, _ in values]), np.array([value for _, value in values])
    count, times, off = len(values), times - times.mean(), points - points.mean(axis=0)
    spread = float(times @ times)
    slope = times @ off / spread
    residual = max(float((off**2).sum() - slope @ slope * spread), 0.0)
    freedom = 2.0 * (count - 2.0)
    sigma = math.sqrt(residual / freedom / spread)
    return Trend(abs(times[-1] - times[0]), slope, sigma, freedom, math.sqrt(residual / count))


@dataclass
class _Moment:
    """Heading without jumps, its integral, those of yaw rate (with its error; None without one) and velocity."""

    t_s: float
    heading: float
    swept: float
    turned: tuple[float, float] | None
    travelled: np.ndarray


class Turns:
    """How heading, yaw rate and course have turned in the last seconds: `integrity/turns.rs`."""

    def __init__(self) -> None:
        self._kept: deque[_Moment] = deque()
        self._newest: _Moment | None = None

    def push(self, t_s: float, heading: float, turned: tuple[float, float] | None, travelled: np.ndarray) -> bool:
        """Adds a heading, with the integrals of yaw rate and velocity so far. Whether it is kept."""
        newest, before = _Moment(t_s, heading, 0.0, turned, travelled), self._newest
        if before is not None and 0.0 <= t_s - before.t_s <= TURN_EACH_S:
            change = wrap(heading - before.heading)
            newest.heading = before.heading + change
            newest.swept = before.swept + (before.heading + 0.5 * change) * (t_s - before.t_s)
        else:
            self._kept.clear()
        self._newest = newest
        is_kept = not self._kept or t_s - self._kept[-1].t_s >= TURN_EACH_S
        if is_kept:
            self._kept.append(newest)
        while t_s - self._kept[0].t_s > TURN_KEPT_S:
            self._kept.popleft()
        return is_kept

    def contradict_rate(self) -> bool:
        """Whether the heading turned otherwise than the yaw rate says."""
        now = self._newest
        if now is None or now.turned is None:
            return False
        (by_rate, error), heading = now.turned, now.heading
        return any(
            abs((heading - before.heading) - (by_rate - before.turned[0])) >= OFF_RATE + error - before.turned[1]
            for before in self._rated()
        )

    def contradict_course(self) -> bool:
        """Whether the heading turned to the other side than the course."""
        now = self._newest and self._mean_until(self._newest)
        if now is None:
            return False
        for moment in self._kept:
            if (before := self._mean_until(moment)) is not None:
                turns = wrap(now[0] - before[0]), wrap(now[1] - before[1])
                if turns[0] * turns[1] < 0.0 and all(OPPOSITE[0] <= abs(turn) <= OPPOSITE[1] for turn in turns):
                    return True
        return False

    def swing_since(self, since_s: float) -> bool:
        """True if the yaw rate has swung while the heading stayed, which it did from `since_s` on, s."""
        steady = [moment for moment in self._rated() if since_s + SETTLES_S <= moment.t_s]
        rated = [(moment.t_s, np.array([moment.turned[0]])) for moment in steady]
        found = trend(rated)
        return found is not None and found.span_s >= SWING_AFTER_S and found.rms >= SWING

    def _rated(self) -> list[_Moment]:
        return list(takewhile(lambda moment: moment.turned is not None, reversed(self._kept)))

    def _mean_until(self, end: _Moment) -> tuple[float, float] | None:
        """Mean heading and course of the seconds before `end`; None if they are not known or the craft was slow."""
        start = next((kept for kept in self._kept if end.t_s - kept.t_s <= MEAN_S + 0.5 * TURN_EACH_S), end)
        if (span := end.t_s - start.t_s) < MEAN_S - 0.5 * TURN_EACH_S:
            return None
        velocity = (end.travelled - start.travelled) / span
        if np.linalg.norm(velocity) < MEAN_SPEED:
            return None
        return (end.swept - start.swept) / span, math.atan2(velocity[1], velocity[0])


class RecentPositions:
    """The positions of the last seconds, and how far the measured velocity leads in the same time."""

    def __init__(self) -> None:
        # Time, position, integral of the measured velocity.
        self._kept: deque[tuple[float, np.ndarray, np.ndarray]] = deque()
        self._newest: tuple[float, np.ndarray, np.ndarray] | None = None
        self.travelled = np.zeros(2)
        self._velocity: tuple[float, np.ndarray] | None = None
        self._measured_since_s = 0.0

    def push(self, t_s: float, position: np.ndarray) -> bool:
        """Adds a position. After a gap, or if the clock was set back, it is the first one. Whether it is kept."""
        if self._newest is not None and not 0.0 <= t_s - self._newest[0] <= GAP_MAX_S:
            self._kept.clear()
        travelled = self.travelled
        if self._velocity is not None and 0.0 <= (elapsed := t_s - self._velocity[0]) <= GAP_MAX_S:
            # The velocity of this moment comes later.
            travelled = travelled + self._velocity[1] * elapsed
        self._newest = (t_s, position, travelled)
        is_kept = not self._kept or t_s - self._kept[-1][0] >= KEEP_EACH_S
        if is_kept:
            self._kept.append(self._newest)
        while t_s - self._kept[0][0] > KEPT_S:
            self._kept.popleft()
        return is_kept

    def travel(self, t_s: float, velocity: np.ndarray) -> None:
        """Adds the measured velocity."""
        if self._velocity is not None and 0.0 <= t_s - self._velocity[0] <= GAP_MAX_S:
            before_s, before = self._velocity
            self.travelled = self.travelled + 0.5 * (before + velocity) * (t_s - before_s)
        else:
            self._measured_since_s = t_s
        self._velocity = (t_s, velocity)

    def clear(self) -> None:
        """Forgets all positions: the next one is of another motion."""
        self._kept.clear()
        self._newest = None

    def velocity(self) -> np.ndarray | None:
        """Mean velocity of the last seconds by positions; None if they cover less than two."""
        if self._newest is None:
            return None
        t_s, position, _ = self._newest
        start_s, start, _ = next(kept for kept in self._kept if t_s - kept[0] <= VELOCITY_SPAN_S[1])
        span = t_s - start_s
        return (position - start) / span if span >= VELOCITY_SPAN_S[0] else None

    def drift(self) -> Trend | None:
        """How positions and the integral of the measured velocity drift apart."""
        if self._newest is None or self._velocity is None or self._newest[0] - self._velocity[0] > GAP_MAX_S:
            return None
        return trend([(t_s, at - gone) for t_s, at, gone in self._kept if t_s >= self._measured_since_s])

    def mismatch(self) -> tuple[float, float] | None:
        """Time and distance between where positions and where velocities have led, over the longest time with both."""
        both = (kept for kept in self._kept if kept[0] >= self._measured_since_s)
        if self._newest is None or self._velocity is None or (start := next(both, None)) is None:
            return None
        t_s, position, travelled = self._newest
        apart = (position - start[1]) - (travelled - start[2])
        return t_s - start[0], float(np.linalg.norm(apart))


@dataclass
class _Still:
    """A position that has not moved: since when, where, integral of the velocity then, distance asked for since."""

    since_s: float
    place: np.ndarray
    travelled: np.ndarray
    asked: float = 0.0


@dataclass
class _Steady:
    """A heading that has not changed: since when, which, integral of the yaw rate and course at the start."""

    began_s: float
    since_s: float
    heading: float
    turned: float
    course: float | None = None


@dataclass
class Doubts:
    """The checks with their memory."""

    alarms: set[Alarm] = field(default_factory=set)
    recent: RecentPositions = field(default_factory=RecentPositions)
    is_measured: bool = False
    """Whether the newest velocity was the twist's, and nothing speaks against it."""
    _place: Track = field(default_factory=Track)
    _bow: Track = field(default_factory=Track)
    _motion: Track = field(default_factory=Track)
    _rate: tuple[float, float] | None = None
    _turned: float = 0.0
    _turned_error: float = 0.0
    """Integral of the yaw rate, and the most that it is off by what the rate did between two measurements."""
    _turns: Turns = field(default_factory=Turns)
    _still: _Still | None = None
    _steady: _Steady | None = None
    _since_s: dict[str, float] = field(default_factory=dict)
    """When a condition began, or a fault was last seen."""

    def admit(self, t_s: float, motion: Motion) -> Motion | None:
        """What to believe of `motion`; None where position or heading are not to be believed. A velocity that is not
        measured, or contradicted, is that of the positions, and None until they show one."""
        velocity = motion.ground_velocity
        if velocity is not None:
            if np.linalg.norm(velocity) > SPEED_MAX or abs(motion.yaw_rate_radps) > YAW_RATE_MAX:
                velocity = None
            elif motion.yaw_rate_radps != 0.0 or self._rate is not None:
                # A rate that was always 0 is not measured.
                self._turn(t_s, motion.yaw_rate_radps)
        is_there = self._admits_position(t_s, np.array([motion.north_m, motion.east_m]))
        is_so = self._admits_heading(t_s, motion.heading_rad)
        self.is_measured = velocity is not None and self._admits_velocity(t_s, velocity)
        if not (is_there and is_so):
            return None
        return motion if self.is_measured else replace(motion, ground_velocity=self.recent.velocity())

    def sent(self, speed: float, seconds: float) -> None:
        """Takes note of a reference that was published, followed for `seconds`."""
        if self._still is not None:
            self._still.asked += speed * seconds

    def distrusted(self) -> str | None:
        """Why there is no trustworthy state."""
        return next((alarm.value for alarm in Alarm if alarm in self.alarms and alarm.stops), None)

    def _set(self, alarm: Alarm, is_raised: bool) -> None:
        (self.alarms.add if is_raised else self.alarms.discard)(alarm)

    def _lasts(self, what: str, t_s: float, is_so: bool) -> float | None:
        """For how long it has been so, s; None if it is not."""
        if not is_so:
            self._since_s.pop(what, None)
            return None
        return t_s - self._since_s.setdefault(what, t_s)

    def _is_recent(self, what: str, t_s: float, limit_s: float) -> bool:
        return t_s - self._since_s.get(what, -math.inf) <= limit_s

    def _admits_position(self, t_s: float, position: np.ndarray) -> bool:
        known = self._motion.trusted
        velocity = known[1] if known is not None and abs(t_s - known[0]) <= FRESH_S else np.zeros(2)

        def fits(at: float, before: np.ndarray) -> bool:
            moved = position - before - velocity * (t_s - at)
            return bool(np.linalg.norm(moved) <= _gate(POSITION_GATE, t_s - at))

        fit = self._place.take(t_s, position, fits)
        if fit is Fit.JUMPED:
            self._since_s["position jumped"] = t_s
            self.recent.clear()
            self._still = None
        self._set(Alarm.POSITION_JUMPS, self._place.is_contested(t_s))
        self._set(Alarm.POSITION_JUMPED, self._is_recent("position jumped", t_s, JUMP_SHOWN_S))
        if fit is Fit.MISSED:
            return False
        if self.recent.push(t_s, position):
            self._compare_drift()
        self._compare_with_velocity(t_s)
        self._compare_still(t_s, position)
        return True

    def _admits_velocity(self, t_s: float, velocity: np.ndarray) -> bool:
        def fits(at: float, before: np.ndarray) -> bool:
            return bool(np.linalg.norm(velocity - before) <= _gate(VELOCITY_GATE, t_s - at))

        if self._motion.take(t_s, velocity, fits) is Fit.MISSED:
            return False
        self.recent.travel(t_s, velocity)
        return Alarm.VELOCITY_CONTRADICTS not in self.alarms

    def _compare_drift(self) -> None:
        drift = self.recent.drift()
        if drift is not None and drift.span_s >= DRIFT_AFTER_S:
            speed = 0.0 if self._motion.trusted is None else float(np.linalg.norm(self._motion.trusted[1]))
            most = max(_gate(DRIFT, speed), drift.slope_beyond(DRIFT_SIGMAS))
            # It ends well inside its gate.
            least = 0.5 * most if Alarm.POSITION_DRIFTS in self.alarms else most
            is_apart = bool(np.linalg.norm(drift.slope) > least)
            self._set(Alarm.POSITION_DRIFTS, is_apart and Alarm.VELOCITY_CONTRADICTS not in self.alarms)

    def _compare_with_velocity(self, t_s: float) -> None:
        found = self.recent.mismatch()
        if found is None or found[0] < MISMATCH_AFTER_S:
            return
        span, apart = found
        most = _gate(MISMATCH, span)
        if Alarm.VELOCITY_CONTRADICTS in self.alarms:
            # It ends well inside its gate.
            self._set(Alarm.VELOCITY_CONTRADICTS, apart > 0.5 * most)
            return
        lasts = self._lasts("apart", t_s, apart > most)
        self._set(Alarm.VELOCITY_CONTRADICTS, lasts is not None and lasts >= MISMATCH_FOR_S)

    def _compare_still(self, t_s: float, position: np.ndarray) -> None:
        travelled = self.recent.travelled
        still = self._still = self._still or _Still(t_s, position, travelled)
        has_no_way = False
        if np.linalg.norm(position - still.place) > STILL_M:
            self._still = _Still(t_s, position, travelled)
            if self._since_s.pop("position frozen", None) is not None:
                # What stayed was of no motion.
                self.recent.clear()
        else:
            travel, time = (float(np.linalg.norm(travelled - still.travelled)), t_s - still.since_s)
            pace = FROZEN_SPEED * time
            has_no_way = still.asked >= REQUESTED_M and still.asked >= pace
            is_way = travel >= FROZEN_TRAVEL_M and travel >= pace
            if (is_way and time >= STILL_MIN_S) or (has_no_way and time >= REQUESTED_S):
                self._since_s["position frozen"] = t_s
                # The next evidence must be new.
                self._still = _Still(t_s, still.place, travelled)
            elif travel < pace and still.asked < pace:
                # What came at rest is no evidence.
                self._still = _Still(t_s, still.place, travelled)
        is_frozen = self._is_recent("position frozen", t_s, LATCH_S)
        self._set(Alarm.POSITION_FROZEN, is_frozen)
        self._set(Alarm.NO_WAY, has_no_way and not is_frozen)

    def _admits_heading(self, t_s: float, heading: float) -> bool:
        is_known = self._rate is not None and abs(t_s - self._rate[0]) <= FRESH_S
        rate, limits = (self._rate[1], HEADING_GATE_BY_RATE) if is_known else (0.0, HEADING_GATE)

        def fits(at: float, before: float) -> bool:
            return abs(wrap(heading - before - rate * (t_s - at))) <= _gate(limits, t_s - at)

        fit = self._bow.take(t_s, heading, fits)
        if fit is Fit.JUMPED:
            self._since_s["heading jumped"] = t_s
        self._set(Alarm.HEADING_JUMPS, self._bow.is_contested(t_s))
        self._set(Alarm.HEADING_JUMPED, self._is_recent("heading jumped", t_s, JUMP_SHOWN_S))
        if fit is Fit.MISSED:
            return False
        is_measured = self._rate is not None and abs(t_s - self._rate[0]) <= RATE_GAP_MAX_S
        turned = (self._turned, self._turned_error) if is_measured else None
        is_new = self._turns.push(t_s, heading, turned, self.recent.travelled)
        self._compare_steady(t_s, heading)
        measured = self._motion.trusted
        velocity = measured[1] if measured is not None and abs(t_s - measured[0]) <= FRESH_S else None
        course = _course(velocity)
        is_off = course is not None and abs(wrap(course - heading)) >= COURSE_OFF
        lasts = self._lasts("off course", t_s, is_off)
        self._set(Alarm.COURSE_OFF_HEADING, lasts is not None and lasts >= COURSE_OFF_FOR_S)
        if is_new:
            self._compare_turns(t_s)
        return True

    def _compare_turns(self, t_s: float) -> None:
        is_moving = Alarm.VELOCITY_CONTRADICTS not in self.alarms
        if self._turns.contradict_rate() or (is_moving and self._turns.contradict_course()):
            self._since_s["heading contradicts"] = t_s
        is_so = self._is_recent("heading contradicts", t_s, JUMP_SHOWN_S)
        self._set(Alarm.HEADING_CONTRADICTS, is_so and Alarm.HEADING_FROZEN not in self.alarms)

    def _compare_steady(self, t_s: float, heading: float) -> None:
        steady = self._steady = self._steady or _Steady(t_s, t_s, heading, self._turned)
        if abs(wrap(heading - steady.heading)) > HEADING_STILL:
            self._steady = _Steady(t_s, t_s, heading, self._turned)
            self._since_s.pop("heading frozen", None)
        else:
            course = _course(self.recent.velocity())
            if steady.course is None or course is None:
                steady.course = course
            changed = 0.0 if course is None else abs(wrap(course - steady.course))
            is_turned = abs(self._turned - steady.turned) >= TURN_BY_RATE or changed >= TURN_BY_COURSE
            is_turned = is_turned or self._turns.swing_since(steady.began_s)
            time = t_s - steady.since_s
            if is_turned and time >= STEADY_MIN_S:
                self._since_s["heading frozen"] = t_s
                self._steady = _Steady(t_s, t_s, heading, self._turned)
            elif time > TURN_WINDOW_S:
                steady.since_s, steady.turned = t_s, self._turned
        self._set(Alarm.HEADING_FROZEN, self._is_recent("heading frozen", t_s, LATCH_S))

    def _turn(self, t_s: float, rate: float) -> None:
        if self._rate is not None:
            before_s, before = self._rate
            elapsed = min(max(t_s - before_s, 0.0), RATE_GAP_MAX_S)
            self._turned += 0.5 * (before + rate) * elapsed
            self._turned_error += 0.5 * abs(rate - before) * elapsed
        self._rate = (t_s, rate)


def _gate(limits: tuple[float, float], elapsed: float) -> float:
    """A gate that widens with the time since, s."""
    return limits[0] + limits[1] * abs(elapsed)


def _course(velocity: np.ndarray | None) -> float | None:
    """The course of a craft that has way."""
    if velocity is None or np.linalg.norm(velocity) < COURSE_SPEED:
        return None
    return math.atan2(velocity[1], velocity[0])
