"""What the craft is asked for, by formulas; and what stops it."""

import math

import numpy as np
import pytest
from pilotfish_ros2.following import (
    Arrivals,
    CurrentObserver,
    Plan,
    Reference,
    ahead,
    starboard,
    steering,
    why_silent,
    wrap,
)


def turning(lags_s=(0.0, 0.0), current=(0.0, 0.0)):
    """From 100 s on, 3 rad and 1 m/s: turns 0.1 rad/s to starboard and accelerates by 0.01 m/s²."""
    after = np.arange(30.0)
    stages = np.column_stack([100.0 + after, after, after, 1.0 + 0.01 * after, 3.0 + 0.1 * after])
    first = Reference(1.2, wrap(3.0 + 0.1 * lags_s[0]))
    return Plan(100.0, 110.0, first, stages, lags_s, current, "")


def test_between_two_plans_the_reference_changes_as_the_planned_motion_does_a_lag_later():
    plan = turning(lags_s=(2.0, 1.5))
    for after in np.linspace(0.0, 10.0, 101):
        reference = plan.at(100.0 + after)
        assert abs(wrap(reference.heading_rad - (3.2 + 0.1 * after))) < 1e-12
        assert reference.speed_mps == pytest.approx(1.2 + 0.01 * after, abs=1e-12)


def test_a_speed_over_ground_contains_the_current_along_the_bow():
    reference = turning(current=(0.3, 0.0)).at(105.0)
    carried = 0.3 * (math.cos(3.5) - math.cos(3.0))
    assert reference.speed_mps == pytest.approx(1.2 + 0.05 + carried, abs=1e-12)


def test_a_plan_that_is_too_old_gives_no_reference():
    plan = turning()
    assert plan.at(110.0) is not None
    assert plan.at(110.001) is None and plan.at(math.nan) is None


@pytest.mark.parametrize(
    ("changed", "reason"),
    [
        ({}, None),
        ({"state_age_s": None}, "no recent odometry of the craft"),
        ({"state_age_s": 3.1}, "no recent odometry of the craft"),
        ({"status": "paused"}, "the mission is paused"),
        ({"status": "finished"}, "the mission is finished"),
        ({"reference": None}, "the newest plan is too old"),
        ({"reference": None, "has_planned": False}, "no plan yet"),
    ],
)
def test_each_missing_condition_stops_the_references(changed, reason):
    known = {"state_age_s": 0.1, "reference": Reference(1.0, 0.0), "status": "running", "has_planned": True}
    assert why_silent(**(known | changed)) == reason


def test_what_should_keep_coming_is_overdue_two_seconds_after_its_longest_interval():
    arrivals = Arrivals()
    for at_s in [0.0, 5.0, 10.0]:
        arrivals.push(at_s)
    assert not arrivals.is_overdue(100.0)
    arrivals.push(15.0)
    assert [arrivals.is_overdue(at_s) for at_s in (22.0, 22.1)] == [False, True]


@pytest.mark.parametrize(
    ("known", "state"),
    [
        ((None, False, [], []), ("steering", "")),
        ((None, False, [], ["no new plan", "no new fix of auv-1"]), ("steering", "no new plan; no new fix of auv-1")),
        ((None, False, ["deadline"], ["no new plan"]), ("degraded", "deadline")),
        (("no plan yet", True, ["deadline"], []), ("waiting", "no plan yet")),
        (("no recent odometry of the craft", False, [], []), ("not_steering", "no recent odometry of the craft")),
    ],
)
def test_the_state_of_the_steering_is_the_worst_with_its_reason(known, state):
    assert steering(*known) == state


def test_two_headings_show_both_components_of_the_current():
    current, observer = np.array([-0.1, 0.3]), CurrentObserver()
    for tenth in range(1200):
        heading = 0.0 if tenth < 600 else 1.5
        across = starboard(heading)
        observer.update(0.1 * tenth, heading, 0.0, ahead(heading) + across * (across @ current))
    assert np.linalg.norm(observer.current - current) < 0.03
    surge, sway = observer.through_water(1.5, ahead(1.5) + observer.current)
    assert (surge, sway) == pytest.approx((1.0, 0.0), abs=1e-12)
