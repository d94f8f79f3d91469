"""The same command writes the same bytes: again, beside itself, and without optimisation.

PILOTFISH is the path of the release binary, PILOTFISH_DEBUG that of the debug binary.
"""

import subprocess
from collections.abc import Callable
from functools import cache
from pathlib import Path as File

import pytest

from program import NAMES, pilotfish, program, read

DURATION_S = 120
FILES = ["record.parquet", "record.csv", "record.geojson", "record.mcap", "record.ndjson"]
PAGE = "mission.html"
pytestmark = pytest.mark.soak

Mission = tuple[File, bytes]  # folder of its files, what it printed


def start(binary: str, scenario: str, folder: File) -> subprocess.Popen[bytes]:
    """Begins a mission that leaves in every format."""
    folder.mkdir()
    command = [binary, "simulate", scenario, "--untimed", "--duration-s", str(DURATION_S), "--report", PAGE]
    for file in FILES:
        command += ["--out", file]
    return subprocess.Popen(command, cwd=folder, stdout=subprocess.PIPE)


def end(mission: subprocess.Popen[bytes]) -> bytes:
    """What a mission printed."""
    printed, _ = mission.communicate()
    assert mission.returncode == 0
    return printed


@pytest.fixture(scope="module")
def alone(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Mission]:
    """A mission of a scenario without another beside it, flown when first asked for."""
    folder = tmp_path_factory.mktemp("alone")

    @cache
    def flown(name: str) -> Mission:
        return folder / name, end(start(program(), name, folder / name))

    return flown


def assert_same(folder: File, printed: bytes, expected: Mission) -> None:
    """Output and every file, byte by byte; says first which columns are not the same."""
    tables = [read(of / "record.csv") for of in (folder, expected[0])]
    assert tables[1]["t_s"].nunique() == DURATION_S
    assert list(tables[0].columns) == list(tables[1].columns)
    assert [name for name in tables[0] if not tables[0][name].equals(tables[1][name])] == []
    for file in [*FILES, PAGE]:
        # Compared outside the assertion, whose message would be megabytes.
        same = (folder / file).read_bytes() == (expected[0] / file).read_bytes()
        assert same, file
    assert printed == expected[1]


def test_the_program_lists_the_scenarios_of_the_repository() -> None:
    listed = [line.split()[0] for line in pilotfish("scenarios").stdout.splitlines()]
    assert sorted(listed) == NAMES


@pytest.mark.parametrize("scenario", NAMES)
def test_two_missions_at_once_write_the_same_bytes_as_one_alone(
    tmp_path: File, alone: Callable[[str], Mission], scenario: str
) -> None:
    expected = alone(scenario)
    folders = [tmp_path / "one", tmp_path / "two"]
    missions = [start(program(), scenario, folder) for folder in folders]
    for folder, mission in zip(folders, missions):
        assert_same(folder, end(mission), expected)


@pytest.mark.parametrize("scenario", NAMES)
def test_without_optimisation_the_program_writes_the_same_bytes(
    tmp_path: File, alone: Callable[[str], Mission], scenario: str
) -> None:
    debug = tmp_path / "debug"
    assert_same(debug, end(start(program("PILOTFISH_DEBUG"), scenario, debug)), alone(scenario))


@pytest.mark.parametrize("scenario", NAMES)
def test_another_seed_makes_another_mission(
    tmp_path: File, alone: Callable[[str], Mission], scenario: str
) -> None:
    # Otherwise sameness would say little.
    out = tmp_path / "other.csv"
    arguments = ["--untimed", "--duration-s", str(DURATION_S), "--seed", "2", "--out", str(out)]
    assert pilotfish("simulate", scenario, *arguments).returncode == 0
    assert out.read_bytes() != (alone(scenario)[0] / "record.csv").read_bytes()
