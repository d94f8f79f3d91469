"""The planner's cone programs, solved again by solvers that share no code with the one that it uses.

Only the standard form is relied on, as `pilotfish plan --dump` writes it:

    minimise  1/2 x'Px + q'x   subject to   A x + s = b,  s in K

    python oracle.py DIR             compares the dumps in DIR and prints the worst differences
    python oracle.py DIR --fill N    first fills DIR with N programs of missions in all built-in scenarios, each
                                     at the planner's own tolerance and at 1e-9 (needs PILOTFISH, the program)
"""

import argparse
import json
import os
import subprocess
import sys
import warnings
from collections import defaultdict
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from pathlib import Path as File

import cvxpy as cp
import numpy as np
from scipy import sparse


@dataclass(frozen=True)
class Solver:
    """A solver: the names of its tolerances, and whether it is asked for the step from the planner's solution."""

    tolerances: list[str]
    from_the_solution: bool


#: ECOS has no quadratic costs, so that CVXPY gives it a factor of P and another cone: a second formulation as well
#: as a second solver. That cone costs digits when it is as large as the whole cost. Asked for the step from the
#: planner's solution to the best, which is another name for the same variables and hides nothing, it keeps them.
SOLVERS = {
    "QOCO": Solver(["abstol", "reltol"], from_the_solution=False),
    "ECOS": Solver(["abstol", "reltol", "feastol"], from_the_solution=True),
}
#: What they are asked for, until they say that they got there. Tighter, both give up on most of these programs.
TOLERANCES = [1e-10, 1e-9, 3e-9, 1e-8]
ITERATIONS_MAX = 500

#: What 1 of the cost as weighed is in a program, whose unit of cost is 300 (`planner::program::COST_UNIT`).
LEAST = 1.0 / 300.0
#: Promised at the planner's own tolerance: difference of the objective over max(1/300, |p*|), and of the first
#: velocity, m/s.
OBJECTIVE_IN_PRODUCTION = 1e-5
VELOCITY_IN_PRODUCTION = 1e-3
#: Promised of a program solved again at 1e-9.
OBJECTIVE_WHEN_TIGHT = 1e-6

#: Part of the name of a dump that was solved at 1e-9.
TIGHT = ".tight."


@dataclass(frozen=True)
class Program:
    """A dumped program, and what the planner's solver made of it."""

    quadratic: sparse.csc_matrix
    linear: np.ndarray
    constraints: sparse.csc_matrix
    bounds: np.ndarray
    cones: list[tuple[str, int]]
    velocity_columns: list[int]
    velocity_unit: float
    status: str
    solution: np.ndarray | None

    @staticmethod
    def read(file: File) -> "Program":
        dump = json.loads(file.read_text())
        upper = matrix(dump["P"])
        solution = dump.get("solution")
        return Program(
            quadratic=(upper + sparse.triu(upper, 1).T).tocsc(),
            linear=np.array(dump["q"]),
            constraints=matrix(dump["A"]),
            bounds=np.array(dump["b"]),
            cones=[(cone["type"], cone["dim"]) for cone in dump["cones"]],
            velocity_columns=dump["v1"]["columns"],
            velocity_unit=dump["v1"]["unit_mps"],
            status=dump["status"],
            solution=None if solution is None else np.array(solution["x"]),
        )

    def objective(self, x: np.ndarray) -> float:
        return float(0.5 * x @ (self.quadratic @ x) + self.linear @ x)

    def velocity(self, x: np.ndarray) -> np.ndarray:
        """First planned velocity, m/s."""
        return x[self.velocity_columns] * self.velocity_unit

    def solved_by(self, solver: str) -> np.ndarray:
        """A minimiser, as tight as the solver gets. One that it is not sure of counts too: it must agree all the same."""
        unsure = None
        origin = self.solution if SOLVERS[solver].from_the_solution else np.zeros_like(self.linear)
        x = cp.Variable(len(self.linear))
        slope = self.quadratic @ origin + self.linear
        cost = 0.5 * cp.quad_form(x, cp.psd_wrap(self.quadratic)) + slope @ x
        problem = cp.Problem(cp.Minimize(cost), self.rows(x, self.bounds - self.constraints @ origin))
        for tolerance in TOLERANCES:
            tolerances = dict.fromkeys(SOLVERS[solver].tolerances, tolerance)
            with warnings.catch_warnings():
                # That it is not sure shows in its status, too.
                warnings.simplefilter("ignore")
                try:
                    # A solver that CVXPY keeps goes on with the tolerances that it began with.
                    problem.solve(solver=solver, warm_start=False, max_iters=ITERATIONS_MAX, **tolerances)
                except cp.error.SolverError:
                    continue
            if problem.status == cp.OPTIMAL:
                return origin + x.value
            if problem.status == cp.OPTIMAL_INACCURATE and unsure is None:
                unsure = origin + x.value
        if unsure is not None:
            return unsure
        raise RuntimeError(f"{solver} ended with {problem.status}")

    def rows(self, x: cp.Variable, bounds: np.ndarray) -> list[cp.Constraint]:
        """Ax + s = bounds with s in K. Second-order cones of one size are stated together, which changes nothing."""
        constraints, balls, start = [], defaultdict(list), 0
        for kind, size in self.cones:
            rows = np.arange(start, start + size)
            start += size
            if kind == "soc":
                balls[size].append(rows)
                continue
            slack = bounds[rows] - self.constraints[rows] @ x
            constraints.append({"zero": slack == 0, "nonneg": slack >= 0}[kind])
        if start != len(bounds):
            raise ValueError(f"cones of {start} rows, and there are {len(bounds)}")
        for size, of_a_size in balls.items():
            rows = np.array(of_a_size)
            first = bounds[rows[:, 0]] - self.constraints[rows[:, 0]] @ x
            rest = [bounds[rows[:, i]] - self.constraints[rows[:, i]] @ x for i in range(1, size)]
            constraints.append(cp.SOC(first, cp.vstack(rest)))
        return constraints


def matrix(dump: dict) -> sparse.csc_matrix:
    columns = (dump["nzval"], dump["rowval"], dump["colptr"])
    return sparse.csc_matrix(columns, shape=(dump["m"], dump["n"]))


@dataclass(frozen=True)
class Difference:
    """How far the planner's solution of a dump is from another solver's."""

    dump: str
    solver: str
    #: Over max(1/300, |p*|).
    objective: float
    #: m/s.
    velocity: float


def differences(file: File) -> list[Difference]:
    """One for every other solver."""
    program = Program.read(file)
    if program.solution is None:
        raise ValueError(f"{file.name}: ended with {program.status}, so there is nothing to compare")
    result = []
    for solver in SOLVERS:
        other = program.solved_by(solver)
        best = program.objective(other)
        result.append(
            Difference(
                file.name,
                solver,
                abs(program.objective(program.solution) - best) / max(LEAST, abs(best)),
                float(np.linalg.norm(program.velocity(program.solution) - program.velocity(other))),
            )
        )
    return result


def dump(program: str, snapshot: str, to: File, *more: str) -> None:
    """Plans for `snapshot`, a request in JSON, and writes the last program to `to`."""
    subprocess.run(
        [program, "plan", "-", "--dump", str(to), *more],
        input=snapshot,
        check=True,
        capture_output=True,
        text=True,
    )


def fill(folder: File, count: int) -> None:
    """`count` programs from missions in all scenarios, evenly over their time, each in two files."""
    program = os.environ["PILOTFISH"]
    folder.mkdir(parents=True, exist_ok=True)
    listed = subprocess.run([program, "scenarios"], check=True, capture_output=True, text=True).stdout
    names = [line.split()[0] for line in listed.splitlines() if line.strip()]
    asked = {name: snapshots(program, name, folder) for name in names}
    asked = {name: lines for name, lines in asked.items() if lines}
    for i, (name, lines) in enumerate(asked.items()):
        share = count // len(asked) + (i < count % len(asked))
        for k in np.linspace(0, len(lines) - 1, share).astype(int):
            try:
                dump(program, lines[k], folder / f"{name}-{k:04}.json")
                dump(program, lines[k], folder / f"{name}-{k:04}{TIGHT}json", "--tolerance", "1e-9")
            except subprocess.CalledProcessError as error:
                # A goal that rests on old news, say, which no program is solved for.
                print(f"{name}, snapshot {k}: {error.stderr.strip()}")


def snapshots(program: str, scenario: str, folder: File) -> list[str]:
    """The requests of a mission; none where the scenario has no surface craft."""
    file = folder / f"{scenario}.ndjson"
    if not file.exists():
        run = [program, "simulate", scenario, "--untimed", "--every", "7", "--snapshots", str(file)]
        subprocess.run(run, check=True, capture_output=True)
    return file.read_text().splitlines()


def worst(found: list[Difference]) -> str:
    """A table: for each solver, the largest differences and where."""
    lines = []
    for solver in SOLVERS:
        for measure, unit in [("objective", "of max(1/300, |p*|)"), ("velocity", "m/s")]:
            of_solver = [difference for difference in found if difference.solver == solver]
            largest = max(of_solver, key=lambda difference: getattr(difference, measure))
            value = getattr(largest, measure)
            lines.append(f"  {solver}  {measure:9}  {value:.1e} {unit:15}  {largest.dump}")
    return "\n".join(lines)


def tried(file: File) -> tuple[File, list[Difference] | str]:
    try:
        return file, differences(file)
    except (RuntimeError, ValueError) as error:
        return file, str(error)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=File, metavar="DIR")
    parser.add_argument("--fill", type=int, metavar="N", help="first fill DIR with N programs")
    parser.add_argument("--jobs", type=int, default=os.cpu_count(), help="processes at once")
    arguments = parser.parse_args()
    if arguments.fill is not None:
        fill(arguments.folder, arguments.fill)

    with ProcessPoolExecutor(arguments.jobs) as pool:
        results = list(pool.map(tried, sorted(arguments.folder.glob("*.json"))))
    failed = [(file, why) for file, why in results if isinstance(why, str)]
    for file, why in failed:
        print(f"{file.name}: {why}")
    kept = not failed
    for tight, objective, velocity in [
        (False, OBJECTIVE_IN_PRODUCTION, VELOCITY_IN_PRODUCTION),
        (True, OBJECTIVE_WHEN_TIGHT, VELOCITY_IN_PRODUCTION),
    ]:
        of_kind = [found for file, found in results if isinstance(found, list) and (TIGHT in file.name) == tight]
        found = [difference for each in of_kind for difference in each]
        if not found:
            continue
        beyond = [each for each in found if objective < each.objective or velocity < each.velocity]
        kept = kept and not beyond
        print(f"{len(of_kind)} programs at {'1e-9' if tight else 'the tolerance of the planner'}, worst:")
        print(worst(found))
        print(f"  {len(beyond)} beyond {objective:.0e} of max(1/300, |p*|) or {velocity:.0e} m/s")
    return 0 if kept and results else 1


if __name__ == "__main__":
    sys.exit(main())
