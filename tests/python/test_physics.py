"""Figures that the vehicles must show, from the equations and from SciPy. `pytest -s` prints them."""

from collections.abc import Callable

import numpy as np
import pytest
from scipy.optimize import brentq

from integrate import Derivative, Vector, adaptive, rk4
from path_following import Gains, Leg, Path, sine_quotient
from vehicles import (
    DRAG_SURGE,
    IDEAL_THRUSTERS,
    PERIOD,
    STILL_WATER,
    SurfaceCraft,
    Thrusters,
    UnderwaterVehicle,
)

# How near a figure is to the one stated for the plant: those are given with two digits and depend on how
# rise and settling are read off.
STATED = 0.15
RISE = 1.0 - np.exp(-1.0)


def first_time(times: Vector, values: Vector, level: float) -> float:
    """When `values` first come past `level`, by linear interpolation, s."""
    beyond = (values - level) * (level - values[0]) >= 0.0
    assert beyond.any(), f"{level} is never reached"
    i = int(np.argmax(beyond))
    share = (level - values[i - 1]) / (values[i] - values[i - 1])
    return float(times[i - 1] + share * (times[i] - times[i - 1]))


def last_outside(times: Vector, deviations: Vector, band: float) -> float:
    """The first time after which the deviation stays within ± `band`, s."""
    return float(times[np.flatnonzero(np.abs(deviations) > band)[-1] + 1])


def history(step: Callable[[], None], state: Callable[[], Vector], duration: float) -> tuple[Vector, Vector]:
    """Times, s, and states at every period."""
    states = [state().copy()]
    n_steps = round(duration / PERIOD)
    for _ in range(n_steps):
        step()
        states.append(state().copy())
    return np.linspace(0.0, n_steps * PERIOD, n_steps + 1), np.array(states)


def surface_response(
    craft: SurfaceCraft, speed: float, heading: float, duration: float
) -> tuple[Vector, Vector]:
    """Times and states after a change of the references."""
    return history(lambda: craft.step(speed, heading, integrator=adaptive), lambda: craft.state, duration)


def auv_response(
    vehicle: UnderwaterVehicle, duration: float, current: Vector = STILL_WATER
) -> tuple[Vector, Vector]:
    """Times and states along the path."""
    return history(lambda: vehicle.step(current, adaptive), lambda: vehicle.state, duration)


@pytest.mark.parametrize(("thrust", "stated"), [(14.0, 0.714), (15.0, 0.739), (60.0, 1.477)])
def test_steady_speed_balances_thrust_and_drag(thrust: float, stated: float) -> None:
    balance = brentq(lambda u: thrust - DRAG_SURGE.resistance(u), 0.0, 5.0)
    craft = SurfaceCraft.under_way(0.3)
    commands = np.full(2, 0.5 * thrust)
    craft.state[6:8] = commands
    settled = adaptive(lambda x: craft.derivative(x, commands, STILL_WATER), craft.state, 120.0)[3]
    print(
        f"steady speed at {thrust:g} N: {balance:.4f} m/s by balance, {settled:.4f} integrated, "
        f"stated {stated}"
    )
    assert settled == pytest.approx(balance, abs=1e-8)
    assert balance == pytest.approx(stated, abs=0.0006), "stated with three decimals"


@pytest.mark.parametrize(
    ("to", "feed_forward", "stated"),
    [(0.7, False, 4.9), (0.7, True, 2.3), (1.5, False, 39.0), (1.5, True, 5.7)],
)
def test_surge_rises_as_stated(to: float, feed_forward: bool, stated: float) -> None:
    rises = {}
    for name, thrusters in [("ideal", IDEAL_THRUSTERS), ("real", Thrusters())]:
        craft = SurfaceCraft.under_way(0.3, feed_forward, thrusters)
        times, states = surface_response(craft, to, 0.0, duration=60.0)
        rises[name] = first_time(times, states[:, 3], 0.3 + RISE * (to - 0.3))
    print(
        f"surge 0.3 to {to} m/s, feed-forward {feed_forward!s:5}: 63 % in {rises['ideal']:.2f} s, "
        f"with lag and dead zone {rises['real']:.2f} s, stated {stated} s"
    )
    assert rises["ideal"] == pytest.approx(stated, rel=STATED)
    assert rises["real"] == pytest.approx(stated, rel=STATED)
    assert rises["real"] > rises["ideal"], "thrusters that lag cannot be quicker"


def test_a_quarter_turn_settles_as_stated() -> None:
    settled = {}
    for name, thrusters in [("ideal", IDEAL_THRUSTERS), ("real", Thrusters())]:
        craft = SurfaceCraft.under_way(0.3, thrusters=thrusters)
        times, states = surface_response(craft, 0.3, 0.5 * np.pi, duration=15.0)
        settled[name] = last_outside(times, states[:, 2] - 0.5 * np.pi, 0.05 * 0.5 * np.pi)
    print(
        f"yaw 90 deg: within 5 % after {settled['ideal']:.1f} s, with lag and dead zone "
        f"{settled['real']:.1f} s, stated 3.1 s"
    )
    assert settled["ideal"] == pytest.approx(3.1, rel=STATED)
    assert settled["real"] == pytest.approx(3.1, rel=STATED)


def pitch_reversal() -> float:
    """Time for −50° to +50° to come within 5 % of the step, s."""
    pitch = np.radians(50.0)
    vehicle = UnderwaterVehicle.under_way(Path.line(np.zeros(2), 0.0), (0.0, 0.0), 12.0, 0.0, pitch=-pitch)
    vehicle.leg = Leg.UP
    times, states = auv_response(vehicle, 20.0)
    return last_outside(times, states[:, 3] - pitch, 0.05 * 2.0 * pitch)


def test_a_dive_cycle_is_its_straight_legs_and_two_reversals() -> None:
    vehicle = UnderwaterVehicle.under_way(Path.line(np.zeros(2), 0.0), (0.0, 0.0), 1.0, 0.0)
    times, states = auv_response(vehicle, 700.0)
    depth = states[:, 2]
    shallow = [i for i in range(1, len(depth)) if depth[i] <= 1.0 < depth[i - 1]]
    cycle = times[shallow[1]] - times[shallow[0]]
    straight = 2.0 * 22.0 / (0.3 * np.sin(np.radians(50.0)))
    reversal = pitch_reversal()
    settled = depth[shallow[0] :]
    print(
        f"dive cycle 1-23 m: {cycle:.1f} s; straight legs {straight:.1f} s + 2 reversals of {reversal:.1f} s "
        f"= {straight + 2.0 * reversal:.1f} s; depth {settled.min():.2f} to {settled.max():.2f} m"
    )
    assert straight == pytest.approx(191.0, abs=0.5)
    assert reversal == pytest.approx(4.0, rel=STATED)
    assert cycle == pytest.approx(straight + 2.0 * reversal, rel=0.03)
    assert cycle > straight, "while pitch swings through, no depth is gained"


U_H = 0.3 * np.cos(np.radians(50.0))
CURRENT_ACROSS = 0.1


def offset_by_balance(knows_current: bool) -> float:
    """Where the heading rate vanishes with the bow held into the current, m.

    0 = −k₁ψ̃ − k₂ y₁ u_h q + δ̇        ψ_e = −asin(v_c⊥/u_h)
    """
    gains = Gains()
    psi_e = -np.arcsin(CURRENT_ACROSS / U_H)

    def heading_rate(y_1: float) -> float:
        delta = -gains.theta_a * np.tanh(gains.k_delta * y_1)
        delta_slope = -gains.theta_a * gains.k_delta / np.cosh(gains.k_delta * y_1) ** 2
        y_1_rate = U_H * np.sin(psi_e) + (CURRENT_ACROSS if knows_current else 0.0)
        pull = gains.k_2 * y_1 * U_H * sine_quotient(psi_e, delta)
        return -gains.k_1 * (psi_e - delta) - pull + delta_slope * y_1_rate

    return brentq(heading_rate, 0.0, 5.0)


@pytest.mark.parametrize(("knows_current", "stated"), [(True, 0.75), (False, 0.84)])
def test_a_cross_current_leaves_the_offset_at_which_the_law_balances(
    knows_current: bool, stated: float
) -> None:
    balance = offset_by_balance(knows_current)
    vehicle = UnderwaterVehicle.under_way(
        Path.line(np.zeros(2), 0.0), (0.0, 0.0), 5.0, 0.0, speed=U_H, sawtooth=None
    )
    vehicle.knows_current = knows_current
    auv_response(vehicle, 300.0, np.array([0.0, CURRENT_ACROSS]))
    _, settled, psi_e = vehicle.path_error()
    print(
        f"offset in 0.1 m/s across, u_h {U_H:.3f} m/s, current known {knows_current!s:5}: "
        f"{balance:.4f} m by balance, {settled:.4f} flown, stated {stated}; bow {np.degrees(psi_e):.1f} deg"
    )
    assert balance == pytest.approx(stated, abs=0.006), "stated with two decimals"
    assert settled == pytest.approx(balance, abs=1e-4)


def moving_craft(thrusters: Thrusters) -> tuple[Derivative, Vector]:
    """A turning craft that gathers speed; no velocity changes sign, where drag has no third derivative."""
    craft = SurfaceCraft.under_way(0.3, thrusters=thrusters)
    craft.state[3:8] = [0.6, -0.05, 0.3, 12.0, 8.0]
    commands = np.array([14.0, 6.0]) if thrusters.lag > 0.0 else craft.state[6:8]
    return lambda x: craft.derivative(x, commands, np.array([0.05, -0.1])), craft.state


def moving_auv() -> tuple[Derivative, Vector]:
    """A auv that pitches, turns and gathers speed; no velocity changes sign."""
    vehicle = UnderwaterVehicle.under_way(
        Path.line(np.zeros(2), 0.0), (0.0, 0.0), 5.0, 0.0, speed=0.3, pitch=-0.6
    )
    vehicle.state[6:8] = [0.2, 0.3]
    return lambda x: vehicle.derivative(x, np.array([6.0, 3.0, 2.0]), np.array([0.05, -0.1])), vehicle.state


@pytest.mark.parametrize(
    ("name", "moving", "coarsest"),
    [
        ("surface craft", moving_craft(IDEAL_THRUSTERS), PERIOD),
        # A period is as long as the lag itself: the order shows at a fraction of it only.
        ("surface craft with lag", moving_craft(Thrusters()), PERIOD / 8.0),
        ("auv", moving_auv(), PERIOD),
    ],
    ids=["surface craft", "surface craft with lag", "auv"],
)
def test_halving_the_step_divides_the_error_by_sixteen(
    name: str, moving: tuple[Derivative, Vector], coarsest: float
) -> None:
    derivative, start = moving
    duration = 1.0
    exact = adaptive(derivative, start, duration)
    errors = []
    for step in coarsest / np.array([1.0, 2.0, 4.0]):
        state = start
        for _ in range(round(duration / step)):
            state = rk4(derivative, state, step)
        errors.append(np.abs(state - exact).max())
    ratios = [errors[0] / errors[1], errors[1] / errors[2]]
    print(
        f"RK4, {name}: error after {duration:g} s {errors[0]:.1e} at a step of {coarsest:g} s, "
        f"{errors[1]:.1e} at half, {errors[2]:.1e} at a quarter; ratios {ratios[0]:.1f}, {ratios[1]:.1f}"
    )
    # The error's next term is one order of the step higher: up to 15 % of the first at these steps.
    assert ratios == pytest.approx([16.0, 16.0], rel=0.15)


def test_the_heading_turns_at_the_rate_that_the_law_asks_of_a_pitched_vehicle() -> None:
    path = Path.lawn_mower(np.zeros(2))
    for pitch in np.radians([-50.0, 0.0, 50.0]):
        vehicle = UnderwaterVehicle.under_way(path, (3.0, -2.0), 12.0, 0.4, pitch=pitch)
        _, psi_rate = vehicle.guidance(STILL_WATER)
        # Obeyed at once: ψ̇ = r / cosθ with r = ψ̇ cosθ.
        vehicle.state[7] = psi_rate * np.cos(pitch)
        turned = vehicle.derivative(vehicle.state, np.zeros(3), STILL_WATER)[4]
        assert abs(psi_rate) > 0.1 and turned == pytest.approx(psi_rate, abs=1e-12)
