"""A mission of the simulator and the same mission through SciPy, second by second.

PILOTFISH is the path of the release binary.
"""

import os
import subprocess
from pathlib import Path as File

import numpy as np
import pandas as pd
import pytest

from integrate import Integrator, adaptive, rk4
from path_following import Path
from vehicles import UnderwaterVehicle

STEPS_PER_ROW = 10  # a row a second, ten periods a second

# Positions in m, angles in rad, speed in m/s. The record has six decimals, so its start and every row are
# each off by up to 5e-7; with the same method that is all (1.0e-6 measured, in the position, which keeps an error
# of the start). SciPy integrates each period exactly where the simulator takes one Runge-Kutta step: 8e-6 measured,
# in the heading during the first turn, 4e-6 m after ten minutes. A leg that switched one period earlier would be
# 0.02 m of depth.
TOLERANCE = {rk4: 3e-6, adaptive: 5e-5}

COLUMNS = ["north_m", "east_m", "depth_m", "pitch_rad", "heading_rad", "surge_mps"]


@pytest.fixture(scope="module")
def run_of_the_simulator(tmp_path_factory: pytest.TempPathFactory) -> pd.DataFrame:
    """The record of `paper-path-following`, a row a second."""
    binary = os.environ.get("PILOTFISH")
    if binary is None:
        pytest.skip("PILOTFISH does not say where the binary is")
    out: File = tmp_path_factory.mktemp("record") / "run.csv"
    subprocess.run(
        [binary, "simulate", "paper-path-following", "--out", str(out)], check=True, stdout=subprocess.DEVNULL
    )
    record = pd.read_csv(out)
    assert np.array_equal(record["t_s"], np.arange(len(record))), "a row a second"
    return record[[f"auv_1_{name}" for name in COLUMNS]].set_axis(COLUMNS, axis=1)


def second_run(start: pd.Series, n_rows: int, integrator: Integrator) -> pd.DataFrame:
    """The same mission from the same start: loops settled, no rotation, leg down."""
    vehicle = UnderwaterVehicle.under_way(
        path=Path.lawn_mower(np.zeros(2)),
        position=(start["north_m"], start["east_m"]),
        depth=start["depth_m"],
        heading=start["heading_rad"],
        speed=start["surge_mps"],
        pitch=start["pitch_rad"],
    )
    rows = [vehicle.state[:6]]
    for _ in range(n_rows - 1):
        for _ in range(STEPS_PER_ROW):
            vehicle.step(integrator=integrator)
        rows.append(vehicle.state[:6])
    return pd.DataFrame(rows, columns=COLUMNS)


@pytest.mark.parametrize("integrator", [adaptive, rk4], ids=["scipy", "rk4"])
def test_the_simulator_and_an_independent_implementation_fly_the_same_mission(
    run_of_the_simulator: pd.DataFrame, integrator: Integrator
) -> None:
    expected = second_run(run_of_the_simulator.iloc[0], len(run_of_the_simulator), integrator)
    difference = run_of_the_simulator - expected
    difference["heading_rad"] = (difference["heading_rad"] + np.pi) % (2.0 * np.pi) - np.pi
    largest = difference.abs().max()
    moments = difference.abs().idxmax()
    for name in COLUMNS:
        print(
            f"{integrator.__name__:9} {name:12} largest difference {largest[name]:.1e} at {moments[name]:3} s "
            f"(range {np.ptp(expected[name]):.3f})"
        )
    # Otherwise agreement would say little: two lanes' ends are passed, and both legs of the sawtooth are flown.
    assert np.ptp(expected["east_m"]) > 40.0 and np.ptp(expected["depth_m"]) > 22.0
    assert largest.max() < TOLERANCE[integrator], largest
