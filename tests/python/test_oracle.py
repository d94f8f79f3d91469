"""The planner's programs against solvers that share no code with its own."""

import subprocess
import sys
from pathlib import Path as File

import numpy as np
import pytest
from oracle import (
    LEAST,
    OBJECTIVE_IN_PRODUCTION,
    OBJECTIVE_WHEN_TIGHT,
    SOLVERS,
    VELOCITY_IN_PRODUCTION,
    Program,
    differences,
    dump,
)
from program import program

EXAMPLES = File(__file__).resolve().parents[2] / "examples"
SNAPSHOTS = sorted((EXAMPLES / "snapshots").glob("*.json"))


@pytest.fixture(scope="module", params=SNAPSHOTS, ids=lambda file: file.stem)
def snapshot(request: pytest.FixtureRequest) -> str:
    """An example, as a request."""
    return request.param.read_text()


def test_there_are_examples_to_try() -> None:
    assert len(SNAPSHOTS) > 5
    assert len(SOLVERS) == 2


def test_two_other_solvers_find_the_same_plan(snapshot: str, tmp_path: File) -> None:
    file = tmp_path / "program.json"
    dump(program(), snapshot, file)
    for found in differences(file):
        assert found.objective <= OBJECTIVE_IN_PRODUCTION, found
        assert found.velocity <= VELOCITY_IN_PRODUCTION, found


def test_solved_again_at_a_tight_tolerance_the_objectives_agree_to_a_millionth(
    snapshot: str, tmp_path: File
) -> None:
    file = tmp_path / "program.json"
    dump(program(), snapshot, file, "--tolerance", "1e-9")
    for found in differences(file):
        assert found.objective <= OBJECTIVE_WHEN_TIGHT, found


def test_the_example_script_solves_a_dump(tmp_path: File) -> None:
    file = tmp_path / "program.json"
    dump(program(), SNAPSHOTS[0].read_text(), file)
    script = [sys.executable, str(EXAMPLES / "solve_dump.py"), str(file)]
    printed = subprocess.run(script, capture_output=True, text=True, check=True).stdout
    status, found, dumped = printed.split()[:3]
    assert status == "Solved"
    assert float(found) == pytest.approx(float(dumped), rel=OBJECTIVE_IN_PRODUCTION)


def test_an_error_in_the_solution_does_not_go_unseen(tmp_path: File) -> None:
    # The promises would be worth nothing if a solution that is 1 % wrong kept them.
    file = tmp_path / "program.json"
    dump(program(), SNAPSHOTS[0].read_text(), file)
    whole = Program.read(file)
    x = 1.01 * whole.solution
    best = whole.objective(whole.solution)
    assert abs(whole.objective(x) - best) > OBJECTIVE_IN_PRODUCTION * max(LEAST, abs(best))
    assert np.linalg.norm(whole.velocity(x) - whole.velocity(whole.solution)) > VELOCITY_IN_PRODUCTION
