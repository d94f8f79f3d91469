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
from dataclasses import dataclass
from pathlib import Path as File

import numpy as np

from path_following import Path
from plain_math import PlainSurfaceCraft, PlainUnderwaterVehicle
from vehicles import SurfaceCraft, Thrusters, UnderwaterVehicle

ROOT = File(__file__).resolve().parents[2]
STEPS_PER_SECOND = 10
SPEED, HEADING = 0.5, 0.25 * np.pi  # references of the surface craft, m/s and rad
SECONDS_PER_SAMPLE = 1  # simulated: a few milliseconds, so that some samples are not interrupted
BOTH, AUV = "craft and auv", "auv alone"
Case = tuple[str, str]  # implementation, vehicles

RUST_BENCHES = {
    ("vehicles alone", BOTH): "vehicles_alone/paper-tracking",
    ("vehicles alone", AUV): "vehicles_alone/paper-path-following",
    ("mission with line of sight at 1 Hz", BOTH): "with_los/paper-tracking",
    ("mission with the planner at 1 Hz", BOTH): "with_mpc/paper-tracking",
}


def surface_craft() -> SurfaceCraft:
    """The craft of `paper-tracking` at its start."""
    return SurfaceCraft.under_way(
        0.3, feed_forward=True, thrusters=Thrusters(), position=(-15.0, -8.0), heading=0.25 * np.pi
    )


def simulated_auv() -> UnderwaterVehicle:
    """The underwater vehicle of `paper-tracking` at its start."""
    return UnderwaterVehicle.under_way(Path.lawn_mower(np.zeros(2)), (0.0, -4.0), depth=1.0, heading=0.0)


@dataclass(frozen=True)
class Rate:
    """Simulated seconds per second of wall clock: over the whole measurement, and in its fastest part.

    Whatever else runs on the machine slows both down, the fastest part least.
    """

    mean: float
    fastest: float


def python_rate(steps: list[Callable[[], None]], wall: float) -> Rate:
    """Steps all vehicles, second after simulated second, for about `wall` s."""
    times = [time.perf_counter()]
    while times[-1] < times[0] + wall:
        for _ in range(SECONDS_PER_SAMPLE * STEPS_PER_SECOND):
            for step in steps:
                step()
        times.append(time.perf_counter())
    durations = np.diff(times)
    return Rate(SECONDS_PER_SAMPLE / durations.mean(), SECONDS_PER_SAMPLE / durations.min())


def python_rates(wall: float) -> dict[Case, Rate]:
    """Every implementation in Python."""
    craft, auv = surface_craft(), simulated_auv()
    plain_craft, plain_auv = PlainSurfaceCraft(craft), PlainUnderwaterVehicle(auv)
    cases: dict[Case, list[Callable[[], None]]] = {
        ("NumPy", BOTH): [lambda: craft.step(SPEED, HEADING), auv.step],
        ("NumPy", AUV): [simulated_auv().step],
        ("plain math", BOTH): [lambda: plain_craft.step(SPEED, HEADING), plain_auv.step],
        ("plain math", AUV): [PlainUnderwaterVehicle(simulated_auv()).step],
    }
    return {case: python_rate(steps, wall / len(cases)) for case, steps in cases.items()}


def rust_rate(folder: File) -> Rate:
    """From what criterion left of a benchmark; times there are in nanoseconds."""
    simulated = json.loads((folder / "benchmark.json").read_text())["throughput"]["Elements"]
    mean = json.loads((folder / "estimates.json").read_text())["mean"]["point_estimate"]
    sample = json.loads((folder / "sample.json").read_text())
    fastest = (np.array(sample["times"]) / np.array(sample["iters"])).min()
    return Rate(simulated / (1e-9 * mean), simulated / (1e-9 * fastest))


def rust_rates() -> dict[Case, Rate]:
    """Every benchmark of the simulator."""
    subprocess.run(["cargo", "bench", "-p", "tests", "--bench", "simulation"], cwd=ROOT, check=True)
    target = File(os.environ.get("CARGO_TARGET_DIR", ROOT / "target"))
    return {case: rust_rate(target / "criterion" / bench / "new") for case, bench in RUST_BENCHES.items()}


def print_table(python: dict[Case, Rate], rust: dict[Case, Rate]) -> None:
    """All rates, and how many times as fast Rust is."""
    print(
        f"\n{platform.machine()}, {os.cpu_count()} processors under a load of {os.getloadavg()[0]:.1f}, "
        f"Python {platform.python_version()}, NumPy {np.__version__}"
    )
    print(f"{'simulated seconds per second':44} {'':16} {'mean':>12} {'fastest':>12}")
    for language, rates in [("Python", python), ("Rust", rust)]:
        for (name, vehicles), rate in rates.items():
            print(f"{f'{language}, {name}':44} {vehicles:16} {rate.mean:12,.0f} {rate.fastest:12,.0f}")
    for (name, vehicles), slow in python.items():
        fast = rust["vehicles alone", vehicles]
        mean, fastest = fast.mean / slow.mean, fast.fastest / slow.fastest
        print(f"{f'ratio of Rust to {name}':44} {vehicles:16} {mean:12,.0f} {fastest:12,.0f}")


def main() -> None:
    """Measures and prints."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "--wall", type=float, default=10.0, help="time for all cases in Python, s [default: 10]"
    )
    wall = parser.parse_args().wall
    rust = rust_rates()
    print_table(python_rates(wall), rust)


if __name__ == "__main__":
    main()
