#!/usr/bin/env python3
"""Simulated seconds per second of wall clock: the vehicles in Python, and the simulator in Rust.

    python3 tests/python/speed.py    # runs `cargo bench` too: a build from nothing takes minutes

The vehicles are those of `paper-tracking`, ten inner-loop periods of 0.1 s a second, one Runge-Kutta step
each: a surface craft that holds a speed and a heading, and an underwater vehicle on its path.
"""

import argparse
import json
import os
import platform
import subprocess
import time
from collections.abc import Callable
from pathlib import Path as File

import numpy as np

from path_following import Path
from plain_math import PlainSurfaceCraft, PlainUnderwaterVehicle
from vehicles import SurfaceCraft, UnderwaterVehicle

ROOT = File(__file__).resolve().parents[2]
STEPS_PER_SECOND = 10
SPEED, HEADING = 0.5, 0.25 * np.pi  # references of the surface craft, m/s and rad
BOTH, DIVER = "craft and diver", "diver alone"

RUST_BENCHES = {
    ("vehicles alone", BOTH): "vehicles_alone/paper-tracking",
    ("vehicles alone", DIVER): "vehicles_alone/paper-path-following",
    ("mission with line of sight at 1 Hz", BOTH): "with_los/paper-tracking",
    ("mission with the planner at 1 Hz", BOTH): "with_mpc/paper-tracking",
}


def surface_craft() -> SurfaceCraft:
    """The craft of `paper-tracking` at its start."""
    return SurfaceCraft.under_way(0.3, feed_forward=True, position=(-15.0, -8.0), heading=0.25 * np.pi)


def diver() -> UnderwaterVehicle:
    """The underwater vehicle of `paper-tracking` at its start."""
    return UnderwaterVehicle.under_way(Path.lawn_mower(np.zeros(2)), (0.0, -4.0), depth=1.0, heading=0.0)


def simulated_per_wall_second(steps: list[Callable[[], None]], wall: float) -> float:
    """Steps all vehicles, second after simulated second, for about `wall` s."""
    begin = time.perf_counter()
    simulated, elapsed = 0, 0.0
    while elapsed < wall:
        for _ in range(STEPS_PER_SECOND):
            for step in steps:
                step()
        simulated += 1
        elapsed = time.perf_counter() - begin
    return simulated / elapsed


def python_rates(wall: float) -> dict[tuple[str, str], float]:
    """Simulated seconds per second, by implementation and vehicles."""
    craft, auv = surface_craft(), diver()
    plain_craft, plain_auv = PlainSurfaceCraft(craft), PlainUnderwaterVehicle(auv)
    cases: dict[tuple[str, str], list[Callable[[], None]]] = {
        ("NumPy", BOTH): [lambda: craft.step(SPEED, HEADING), auv.step],
        ("NumPy", DIVER): [diver().step],
        ("plain math", BOTH): [lambda: plain_craft.step(SPEED, HEADING), plain_auv.step],
        ("plain math", DIVER): [PlainUnderwaterVehicle(diver()).step],
    }
    return {case: simulated_per_wall_second(steps, wall / len(cases)) for case, steps in cases.items()}


def rust_rates() -> dict[tuple[str, str], float]:
    """The same from `cargo bench`: criterion's mean time of an iteration and the simulated seconds in it."""
    subprocess.run(["cargo", "bench", "-p", "tests", "--bench", "simulation"], cwd=ROOT, check=True)
    target = File(os.environ.get("CARGO_TARGET_DIR", ROOT / "target"))
    rates = {}
    for case, bench in RUST_BENCHES.items():
        folder = target / "criterion" / bench / "new"
        estimates = json.loads((folder / "estimates.json").read_text())
        simulated = json.loads((folder / "benchmark.json").read_text())["throughput"]["Elements"]
        rates[case] = simulated / (1e-9 * estimates["mean"]["point_estimate"])
    return rates


def main() -> None:
    """Measures and prints the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "--wall", type=float, default=10.0, help="time for all of Python's cases, s [default: 10]"
    )
    wall = parser.parse_args().wall
    rust, python = rust_rates(), python_rates(wall)
    print(
        f"\n{platform.machine()}, {os.cpu_count()} processors under a load of {os.getloadavg()[0]:.1f}, "
        f"Python {platform.python_version()}, NumPy {np.__version__}; simulated seconds per second:"
    )
    for (name, vehicles), rate in python.items():
        print(f"{'Python, ' + name:44} {vehicles:16} {rate:12,.0f}")
    for (name, vehicles), rate in rust.items():
        print(f"{'Rust, ' + name:44} {vehicles:16} {rate:12,.0f}")
    for name in ["NumPy", "plain math"]:
        for vehicles in [BOTH, DIVER]:
            ratio = rust["vehicles alone", vehicles] / python[name, vehicles]
            print(f"{'ratio of Rust to ' + name:44} {vehicles:16} {ratio:12,.0f}")


if __name__ == "__main__":
    main()
