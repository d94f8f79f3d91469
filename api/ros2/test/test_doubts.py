"""Odometry that is wrong in one way each, and odometry that is right."""

import ast
import math
import re
from pathlib import Path

import numpy as np
import pytest
from pilotfish_ros2 import doubts
from pilotfish_ros2.doubts import Alarm, Doubts
from pilotfish_ros2.following import Motion, ahead, wrap

STEP_S = 0.1
SPEED = 1.0


def sailed(seconds, distort=lambda _, motion: motion, rate=0.05, speed=SPEED):
    """A craft whose odometry `distort` changes: the checks; (time, true velocity, what is believed, alarms)."""
    checks, seen = Doubts(), []
    position, heading = np.array([100.0, -40.0]), 0.3
    for k in range(round(seconds / STEP_S)):
        t_s = STEP_S * k
        heading += rate * STEP_S
        velocity = speed * ahead(heading)
        position = position + velocity * STEP_S
        motion = Motion(t_s, *position, 0.0, wrap(heading), velocity, rate, 0.1)
        seen.append((t_s, velocity, checks.admit(t_s, distort(t_s, motion)), set(checks.alarms)))
    return checks, seen


def changed(**members):
    return lambda t_s, motion: Motion(
        **{**motion.__dict__, **{k: v(t_s, motion) if callable(v) else v for k, v in members.items()}}
    )


def first(seen, alarm):
    return next((t_s for t_s, *_, alarms in seen if alarm in alarms), math.inf)


def in_world_axes(_, motion):
    """The twist of a publisher that gives the world's axes, as the node reads it: turned by the yaw once more."""
    yaw = math.pi / 2 - motion.heading_rad
    return SPEED * ahead(math.pi / 2 - 2 * yaw)


def test_a_craft_under_way_raises_no_doubt_and_is_believed_to_the_bit():
    noise = np.random.default_rng(1)
    checks, seen = sailed(600.0)
    assert not checks.alarms and all(believed.ground_velocity is not None for _, _, believed, _ in seen)
    jitter = changed(
        north_m=lambda _, m: m.north_m + noise.normal(0.0, 0.5), east_m=lambda _, m: m.east_m + noise.normal(0.0, 0.5)
    )
    assert not any(alarms for *_, alarms in sailed(600.0, jitter)[1])


def test_a_twist_in_the_worlds_axes_is_named_and_the_positions_velocity_counts():
    checks, seen = sailed(60.0, changed(ground_velocity=in_world_axes), rate=0.0)
    assert first(seen, Alarm.VELOCITY_CONTRADICTS) < 15.0
    assert checks.distrusted() is None
    _, true, believed, _ = seen[-1]
    assert np.linalg.norm(believed.ground_velocity - true) < 1e-9


def test_a_pose_that_stays_while_the_twist_says_way_stops_the_references():
    places = []

    def held(t_s, motion):
        if t_s <= 20.0:
            places.append((motion.north_m, motion.east_m))
        north_m, east_m = places[-1]
        return changed(north_m=north_m, east_m=east_m)(t_s, motion)

    checks, seen = sailed(40.0, held)
    assert 20.0 < first(seen, Alarm.POSITION_FROZEN) < 30.0
    assert "position does not change" in checks.distrusted()


def test_a_pose_that_stays_under_references_is_named_without_a_twist():
    checks, seen = Doubts(), []
    for k in range(400):
        checks.admit(STEP_S * k, Motion(STEP_S * k, 0.0, 0.0, 0.0, 0.0, None, 0.0, None))
        checks.sent(SPEED, STEP_S)
        seen.append((STEP_S * k, set(checks.alarms)))
    # 10 m that were asked for are a doubt, and 30 s of them the end of trust.
    assert first(seen, Alarm.NO_WAY) == pytest.approx(10.0, abs=2 * STEP_S)
    assert first(seen, Alarm.POSITION_FROZEN) == pytest.approx(30.0, abs=2 * STEP_S)


@pytest.mark.parametrize("apart_m", [20.0, 500.0])
def test_two_publishers_of_one_topic_stop_the_references(apart_m):
    count = iter(range(10_000))
    two = changed(north_m=lambda _, m: m.north_m + apart_m * (next(count) % 2))
    checks, seen = sailed(20.0, two)
    assert first(seen, Alarm.POSITION_JUMPS) < 5.0
    assert "two publishers" in checks.distrusted()


def test_a_compass_that_stays_while_the_craft_turns_stops_the_references():
    checks, _ = sailed(40.0, changed(heading_rad=0.3))
    assert "compass frozen" in checks.distrusted()


def test_a_yaw_that_is_mirrored_and_a_pose_that_drifts_are_named():
    mirrored = changed(heading_rad=lambda _, m: -m.heading_rad, yaw_rate_radps=lambda _, m: -m.yaw_rate_radps)
    assert first(sailed(40.0, mirrored, rate=0.1)[1], Alarm.HEADING_CONTRADICTS) < 16.0
    drifts = changed(north_m=lambda t_s, m: m.north_m + 0.5 * max(t_s - 20.0, 0.0))
    assert 20.0 < first(sailed(60.0, drifts)[1], Alarm.POSITION_DRIFTS) < 36.0


def test_a_craft_at_rest_without_a_twist_has_a_velocity_and_no_doubt():
    empty = changed(ground_velocity=None, yaw_rate_radps=0.0)
    checks, seen = sailed(120.0, empty, rate=0.0, speed=0.0)
    for t_s, _, believed, alarms in seen:
        assert not alarms
        assert (believed.ground_velocity is None) == (t_s < 2.0)
    assert np.linalg.norm(believed.ground_velocity) == 0.0 and not checks.is_measured


def test_the_constants_are_the_bridges():
    bridge = Path(__file__).parents[2] / "bridge/src"
    files = ("integrity.rs", "integrity/track.rs", "integrity/turns.rs", "recent_positions.rs")
    text = "".join((bridge / name).read_text() for name in files)
    theirs = dict(re.findall(r"^const (\w+): [^=]+ = ([^;]+);", text, re.MULTILINE))
    own = {name: value for name, value in vars(doubts).items() if name.isupper()}
    assert len(own) > 30
    for name, value in own.items():
        expected = ast.literal_eval(theirs[name])
        assert value == (tuple(expected) if isinstance(expected, list) else expected), name
