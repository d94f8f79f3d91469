#!/usr/bin/env python3
"""The program of one SCP iteration: how long the planner's solver takes and how long others do, as one table.

    python3 tests/python/solvers.py    # runs `cargo bench` too: a build from nothing takes minutes

All solve the same programs, which the benchmark `solvers` leaves, and are timed in one run, in turns: what else the
machine does slows all of them, those of some milliseconds most, so that it should be idle. Times are medians over
all programs. From Python they are those of the wall clock around the call; where a solver has a clock of its own, the
notes say what that showed. Solvers that can replace the numbers of a program are set up once, untimed, and timed
from there: replacing the numbers, and solving. Putting the numbers into a solver's own order is timed for none.
"""

import argparse
import itertools
import json
import os
import platform
import subprocess
import tempfile
import time
from dataclasses import dataclass, field
from pathlib import Path as File

import numpy as np

from peers import PEERS, ConeProgram, Solve

ROOT = File(__file__).resolve().parents[2]
HORIZONS = ["20", "default", "60"]  # as the benchmark names them
TURNS = 3  # how often every solver has its turn
ROUNDS = 10  # of the benchmark in a turn: 400 solves
SECONDS = 0.7  # of every other solver in a turn and horizon


@dataclass
class Sample:
    """What a solver showed on the programs of a horizon."""

    medians: list[float] = field(default_factory=list)  # wall clock, µs, one a turn
    own_medians: list[float] = field(default_factory=list)  # the solver's own clock, µs
    sure: list[bool] = field(default_factory=list)
    apart: float = 0.0  # farthest from the planner in the first velocity, m/s

    def median(self) -> float:
        return float(np.median(self.medians))

    def take(self, programs: list[ConeProgram], solves: list[Solve], seconds: float) -> None:
        """Solves all programs, round after round."""
        wall, own = [], []
        end = time.perf_counter() + seconds
        while not wall or time.perf_counter() < end:
            for program, solve in zip(programs, solves, strict=True):
                start = time.perf_counter()
                answer = solve()
                wall.append(1e6 * (time.perf_counter() - start))
                own.append(1e6 * answer.own_seconds)
                self.sure.append(answer.sure)
                difference = (answer.x - program.solution)[program.velocity_columns]
                self.apart = max(self.apart, float(np.linalg.norm(difference)))
        self.medians.append(float(np.median(wall)))
        self.own_medians.append(float(np.median(own)))


def benchmark(command: list[str], folder: File) -> dict:
    """Runs the benchmark in Rust, which leaves the programs; returns its times."""
    arguments = ["--rounds", str(ROUNDS), "--dump", str(folder)]
    subprocess.run([*command, *arguments], cwd=ROOT, check=True)
    return json.loads((folder / "times.json").read_text())


def print_row(name: str, medians: dict[str, float], reference: dict[str, float], note: str) -> None:
    times = " | ".join(f"{medians[horizon]:,.0f}" for horizon in HORIZONS)
    ratios = " / ".join(f"{medians[horizon] / reference[horizon]:.2f}" for horizon in HORIZONS)
    print(f"| {name} | {times} | {ratios} | {note} |")


def print_table(rust: list[dict], samples: dict[tuple[str, str], Sample]) -> None:
    """One row a solver."""
    planner = {h: float(np.median([turn[h]["median_us"] for turn in rust])) for h in HORIZONS}
    as_it_comes = {h: samples[PEERS[0].name, h].median() for h in HORIZONS}
    sizes = [rust[0][horizon] for horizon in HORIZONS]
    names = " | ".join(
        f"{'default, ' if h == 'default' else ''}N = {s['n_stages']}"
        for h, s in zip(HORIZONS, sizes, strict=True)
    )
    print(
        f"\n{platform.machine()}, {os.cpu_count()} processors under a load of {os.getloadavg()[0]:.1f}; "
        f"{sizes[1]['n_variables']} variables and {sizes[1]['n_rows']} rows at the default horizon\n"
    )
    print(f"| median, µs | {names} | to Clarabel as it comes | notes, at the default horizon |")
    print("|---|--:|--:|--:|--:|---|")
    print_row("planner", planner, as_it_comes, f"updated; {rust[0]['default']['iterations']:.1f} iterations")
    for peer in PEERS:
        of_peer = {horizon: samples[peer.name, horizon] for horizon in HORIZONS}
        default = of_peer["default"]
        note = (
            f"{peer.note}; {np.median(default.own_medians):,.0f} µs by its own clock; "
            f"{np.mean(default.sure):.0%} within its tolerance; "
            f"v_1 up to {1e3 * default.apart:.2g} mm/s from the planner's"
        )
        print_row(peer.name, {h: s.median() for h, s in of_peer.items()}, as_it_comes, note)


def main() -> None:
    """Measures and prints."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "--bench", help="the benchmark, already built [default: `cargo bench` builds and runs it]"
    )
    built = parser.parse_args().bench
    cargo = ["cargo", "bench", "-p", "tests", "--bench", "solvers", "--"]
    command = cargo if built is None else [str(File(built).resolve())]
    with tempfile.TemporaryDirectory() as folder:
        rust = [benchmark(command, File(folder))]
        programs = {
            horizon: [ConeProgram.read(file) for file in sorted(File(folder).glob(f"{horizon}-*.json"))]
            for horizon in HORIZONS
        }
        cases = list(itertools.product(PEERS, HORIZONS))
        solves = {(peer.name, horizon): peer.set_up(programs[horizon]) for peer, horizon in cases}
        samples = {case: Sample() for case in solves}
        for turn in range(TURNS):
            if turn > 0:
                rust.append(benchmark(command, File(folder)))
            for peer, horizon in cases:
                case = peer.name, horizon
                if turn == 0:
                    solves[case][0]()  # caches, and what is done at the first call only
                samples[case].take(programs[horizon], solves[case], SECONDS)
    print_table(rust, samples)


if __name__ == "__main__":
    main()
