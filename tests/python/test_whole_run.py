"""Missions of the simulator and the same missions through SciPy, second by second.

PILOTFISH is the path of the release binary.
"""

from pathlib import Path as File

import numpy as np
import pandas as pd
import pytest

from integrate import Integrator, adaptive, rk4
from path_following import Path, wrap
from program import pilotfish, read, rows_of
from vehicles import SurfaceCraft, Thrusters, UnderwaterVehicle

pytestmark = pytest.mark.soak

THRUSTERS_OF_THE_SIMULATOR = Thrusters()
STEPS_PER_ROW = 10  # a row a second, ten periods a second

# Largest differences, m, rad, m/s and rad/s; of thrusts, N. With the same method they are of rounding alone: 1.4e-14 m
# and 2.1e-14 N measured. SciPy integrates each period exactly where the simulator takes one Runge-Kutta step: 1.3e-5 m
# measured for the auv. The craft's thrusters lag by as much as that step, after which the method leaves 0.375 of a thrust's
# way where e⁻¹ = 0.368 is exact: 3.1e-3 m measured, and 0.13 N at one instant of the approach. Ten Runge-Kutta steps a period come to
# within 1.2e-7 m and 1.3e-6 N of SciPy. Without the dead zone the craft would be off by 1.4e-2 m and 0.14 N,
# with a lag of 0.11 s by 7.6e-2 m and 0.38 N. A leg of the sawtooth that began one period late would be
# 0.02 m of depth.
DIVER_TOLERANCES = [(rk4, 1e-11), (adaptive, 5e-5)]
CRAFT_TOLERANCES = [(rk4, 1e-11, 1e-11), (adaptive, 5e-3, 0.2)]

AUV = ["north_m", "east_m", "depth_m", "pitch_rad", "heading_rad", "speed_mps"]
CRAFT = ["north_m", "east_m", "heading_rad", "speed_mps", "sway_mps", "yaw_rate_radps"]
THRUSTS = ["thrust_port_n", "thrust_starboard_n"]
REFERENCES = ["reference_speed_mps", "reference_heading_rad"]


def record(folder: File, *arguments: str) -> pd.DataFrame:
    """The record of `pilotfish simulate`."""
    out = folder / "run.csv"
    run = pilotfish("simulate", *arguments, "--out", str(out))
    assert run.returncode == 0, run.stderr
    return read(out)


def columns_of(table: pd.DataFrame, vehicle: str, names: list[str]) -> pd.DataFrame:
    """Where a vehicle truly was, a row a second."""
    truths = rows_of(table, "truth", vehicle)
    assert np.array_equal(truths["t_s"], np.arange(len(truths))), "a row a second"
    return truths[names]


def flown_again(start: pd.Series, n_rows: int, integrator: Integrator) -> pd.DataFrame:
    """The underwater vehicle's mission: loops settled, no rotation, leg down at the start."""
    vehicle = UnderwaterVehicle.under_way(
        path=Path.lawn_mower(np.zeros(2)),
        position=(start["north_m"], start["east_m"]),
        depth=start["depth_m"],
        heading=start["heading_rad"],
        speed=start["speed_mps"],
        pitch=start["pitch_rad"],
    )
    states = [vehicle.state[:6]]
    for _ in range(n_rows - 1):
        for _ in range(STEPS_PER_ROW):
            vehicle.step(integrator=integrator)
        states.append(vehicle.state[:6])
    return pd.DataFrame(states, columns=AUV)


def steered_again(start: pd.Series, references: pd.DataFrame, integrator: Integrator) -> pd.DataFrame:
    """The surface craft under the recorded references, each held for a second."""
    craft = SurfaceCraft.under_way(
        speed=start["speed_mps"],
        feed_forward=True,
        thrusters=THRUSTERS_OF_THE_SIMULATOR,
        position=(start["north_m"], start["east_m"]),
        heading=start["heading_rad"],
    )
    states = [craft.state]
    for speed, heading in references.to_numpy()[:-1]:
        for _ in range(STEPS_PER_ROW):
            craft.step(speed, heading, integrator=integrator)
        states.append(craft.state)
    return pd.DataFrame(states, columns=CRAFT + THRUSTS)


def largest_differences(who: str, simulator: pd.DataFrame, expected: pd.DataFrame) -> pd.Series:
    """Prints a line for each column; the largest difference in each."""
    difference = (simulator - expected).abs()
    difference["heading_rad"] = difference["heading_rad"].map(wrap).abs()
    for name in difference:
        print(
            f"{who:17} {name:18} largest difference {difference[name].max():.1e} "
            f"at {difference[name].idxmax():4} s (range {np.ptp(expected[name]):.3f})"
        )
    return difference.max()


@pytest.mark.parametrize(("integrator", "tolerance"), DIVER_TOLERANCES)
def test_an_independent_underwater_vehicle_flies_the_same_mission(
    tmp_path: File, integrator: Integrator, tolerance: float
) -> None:
    simulator = columns_of(record(tmp_path, "paper-path-following"), "auv-1", AUV)
    expected = flown_again(simulator.iloc[0], len(simulator), integrator)
    largest = largest_differences(f"auv, {integrator.__name__}", simulator, expected)
    # Otherwise agreement would say little: two lanes' ends are passed, and both legs are flown.
    assert np.ptp(expected["east_m"]) > 40.0 and np.ptp(expected["depth_m"]) > 22.0
    assert largest.max() < tolerance


@pytest.mark.parametrize(("integrator", "tolerance", "thrust_tolerance"), CRAFT_TOLERANCES)
def test_an_independent_surface_craft_answers_the_same_references_alike(
    tmp_path: File, integrator: Integrator, tolerance: float, thrust_tolerance: float
) -> None:
    rows = record(tmp_path, "paper-tracking", "--controller", "saturated_los")
    simulator = columns_of(rows, "asc", CRAFT + THRUSTS)
    expected = steered_again(simulator.iloc[0], rows_of(rows, "planned")[REFERENCES], integrator)
    largest = largest_differences(f"craft, {integrator.__name__}", simulator, expected)
    assert np.ptp(expected["speed_mps"]) > 0.5 and np.ptp(expected["heading_rad"]) > 3.0
    assert np.ptp(expected["thrust_port_n"]) > 20.0
    assert largest[CRAFT].max() < tolerance
    assert largest[THRUSTS].max() < thrust_tolerance


def test_the_surface_craft_starts_under_the_thrust_of_steady_cruising(tmp_path: File) -> None:
    rows = record(tmp_path, "paper-tracking", "--duration-s", "1")
    start = columns_of(rows, "asc", CRAFT + THRUSTS).iloc[0]
    # Half the drag each, 27.5 N/(m/s)² at 0.3 m/s.
    assert start["speed_mps"] == 0.3
    assert start[THRUSTS].to_numpy() == pytest.approx(0.5 * 27.5 * 0.3**2, rel=1e-15)
    assert start["sway_mps"] == start["yaw_rate_radps"] == 0.0
