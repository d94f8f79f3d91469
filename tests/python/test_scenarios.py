"""Scenario files, the schema that is published for them, and the program: they say the same.

PILOTFISH is the path of the program.
"""

import json
import tomllib
from dataclasses import dataclass
from pathlib import Path as File

import pytest
from jsonschema import Draft202012Validator

from program import NAMES, SCENARIOS, pilotfish

# Somebody's own file, with what the built-in ones leave out.
OWN = (File(__file__).parent / "own_scenario.toml").read_text()


@dataclass(frozen=True)
class Mistake:
    """What somebody got wrong in `OWN`, and the member that the program is to name.

    A member that is missing is on no line: `table` is then the line of its table, or the file's first.
    """

    right: str
    wrong: str
    member: str
    table: str | None = None

    def text(self) -> str:
        """The file with the mistake."""
        assert OWN.count(self.right) == 1, "one place"
        return OWN.replace(self.right, self.wrong)

    def line(self) -> int:
        """Line to name, from 1 on."""
        lines, right = self.text().splitlines(), OWN.splitlines()
        if self.table is not None:
            return 1 + lines.index(self.table)
        return 1 + next(i for i, line in enumerate(lines) if line != right[i])


WRONG_TYPES = [
    Mistake("duration_s = 600", 'duration_s = "long"', "duration_s"),
    Mistake('name = "own"', "name = 7", "name"),
    Mistake("lat_deg = -33.9", "lat_deg = [-33.9]", "origin.lat_deg"),
    Mistake("speed_mps = 0.5\n", "speed_mps = true\n", "surface_craft.speed_mps"),
    Mistake("drag_feed_forward = true", "drag_feed_forward = 1", "surface_craft.drag_feed_forward"),
    Mistake('leg = "up"', 'leg = "sideways"', "auvs[1].leg"),
    Mistake('class = "otter"', 'class = "catamaran"', "surface_craft.class"),
    Mistake("closed = true", 'closed = "yes"', "auvs[0].path.waypoints.closed"),
    Mistake("centre = [0, 40]", "centre = 40", "auvs[1].path.circle.centre"),
    Mistake("[60, 0], [60, 60]", "[60], [60, 60]", "auvs[0].path.waypoints.points[1]"),
    Mistake('turn = "port"', 'turn = "left"', "auvs[1].path.circle.turn"),
    Mistake('schema_version = "1"', 'schema_version = "2"', "schema_version"),
]
UNKNOWN_MEMBERS = [
    Mistake("settled_after_s = 120", "settled_after_s = 120\nauthor = 1", "author"),
    Mistake("contact_range_m = 50", "contact_range = 50", "contact_range"),
    Mistake("radius_m = 30", "radius_m = 30\ndiameter_m = 60", "diameter_m"),
    Mistake("paths = true", "paths = true\nfuture = true", "future"),
    Mistake("[water.waves]", "[water.tide]", "tide"),
    Mistake("fillet_m = 5", "fillet_m = 5\nradius_m = 5", "radius_m"),
    Mistake("east_m = {normal = [0, 2]}", "east_m = {gamma = [0, 2]}", "surface_craft.east_m"),
    Mistake("what.thruster", "what.rudder", "rudder"),
]
OUT_OF_RANGE = [
    Mistake("duration_s = 600", "duration_s = 0", "duration_s"),
    Mistake("lat_deg = -33.9", "lat_deg = -91", "origin.lat_deg"),
    Mistake("lon_deg = 151.4", "lon_deg = 1e9", "origin.lon_deg"),
    Mistake("depth_m = 12", "depth_m = -1", "auvs[1].depth_m"),
    Mistake("share = 0.6", "share = 1.1", "faults[0].what.thruster.share"),
    Mistake("loss = 0.3", "loss = -0.1", "knowledge.acoustics.loss"),
    Mistake("damping = 0.1", "damping = inf", "water.waves.damping"),
    Mistake("pitch_rad = 0.6", "pitch_rad = 3", "auvs[1].dive.pitch_rad"),
    Mistake("{normal = [0, 2]}", "{normal = [0, -2]}", "surface_craft.east_m"),
    Mistake("{choice = [-10, -20]}", "{choice = []}", "surface_craft.north_m"),
    Mistake("{uniform = [-0.1, 0.1]}", "{uniform = [-0.1, 1e3]}", "water.current.constant.east_mps"),
]
MISSING = [
    Mistake("duration_s = 600\n", "", "duration_s", OWN.splitlines()[0]),
    Mistake("contact_range_m = 50\n", "", "contact_range_m", "[surface_craft]"),
    Mistake("lon_deg = 151.4\n", "", "lon_deg", "[origin]"),
    Mistake("points = [[0, 0], [60, 0], [60, 60]]\n", "", "points", "[auvs.path.waypoints]"),
    Mistake("correlation_s = 300\n", "", "correlation_s", "[water.gauss_markov]"),
    Mistake("latency_s = 2\n", "", "latency_s", "[knowledge.acoustics]"),
    Mistake('side = "port", ', "", "side"),
    Mistake(", radius_m = 12", "", "radius_m"),
]
TOO_LONG = [
    Mistake("[60, 0], [60, 60]", "[60, 0, 1], [60, 60]", "auvs[0].path.waypoints.points[1]"),
    Mistake("centre = [0, 40]", 'centre = [0, 40, "m"]', "auvs[1].path.circle.centre"),
    Mistake("{uniform = [0, 1]}", "{uniform = [0, 1, 2]}", "surface_craft.heading_rad"),
]
MISTAKES = WRONG_TYPES + UNKNOWN_MEMBERS + OUT_OF_RANGE + MISSING + TOO_LONG


@pytest.fixture(scope="session")
def schema() -> Draft202012Validator:
    """The schema as the program prints it."""
    printed = json.loads(pilotfish("scenarios", "--schema").stdout)
    assert printed["$schema"] == "https://json-schema.org/draft/2020-12/schema"
    Draft202012Validator.check_schema(printed)
    return Draft202012Validator(printed)


@pytest.mark.parametrize("name", NAMES)
def test_every_scenario_keeps_to_the_schema(schema: Draft202012Validator, name: str) -> None:
    text = (SCENARIOS / f"{name}.toml").read_text()
    schema.validate(tomllib.loads(text))
    # The printed file says how to write the schema beside it.
    first, rest = text.split("\n", 1)
    hint = "# The schema beside this file: pilotfish scenarios --schema > scenario.schema.json"
    assert pilotfish("scenarios", name).stdout == f"{first}\n{hint}\n{rest}"


def test_a_file_of_one_s_own_keeps_to_the_schema_and_flies(
    tmp_path: File, schema: Draft202012Validator
) -> None:
    schema.validate(tomllib.loads(OWN))
    (tmp_path / "own.toml").write_text(OWN)
    run = pilotfish("simulate", "./own.toml", "--duration-s", "30", cwd=tmp_path)
    assert run.returncode == 0, run.stderr
    assert run.stdout.startswith("own, seed 1\n")


@pytest.mark.parametrize("mistake", MISTAKES, ids=lambda mistake: f"{mistake.member}: {mistake.wrong}")
def test_schema_and_program_refuse_the_same_mistakes(
    tmp_path: File, schema: Draft202012Validator, mistake: Mistake
) -> None:
    text = mistake.text()
    assert not schema.is_valid(tomllib.loads(text))
    (tmp_path / "mutated.toml").write_text(text)
    run = pilotfish("simulate", "./mutated.toml", "--duration-s", "1", cwd=tmp_path)
    assert run.returncode == 1
    assert run.stdout == ""
    said = run.stderr.removeprefix(f"pilotfish: ./mutated.toml:{mistake.line()}: ")
    assert said != run.stderr, f"line {mistake.line()} is wrong, and not: {run.stderr}"
    assert mistake.member in said


@pytest.mark.parametrize("value", ["nan", "-nan", "+inf", "-inf"])
def test_what_json_has_no_word_for_is_no_number(tmp_path: File, value: str) -> None:
    # NaN is below no maximum and above none: a JSON Schema lets it pass.
    (tmp_path / "mutated.toml").write_text(OWN.replace("damping = 0.1", f"damping = {value}"))
    run = pilotfish("simulate", "./mutated.toml", "--duration-s", "1", cwd=tmp_path)
    assert run.returncode == 1
    assert "water.waves.damping" in run.stderr


def test_a_copy_of_a_scenario_is_that_scenario(tmp_path: File) -> None:
    (tmp_path / "mine.toml").write_text(pilotfish("scenarios", "paper-tracking").stdout)
    for out, scenario in [("built-in.csv", "paper-tracking"), ("mine.csv", "./mine.toml")]:
        arguments = ["simulate", scenario, "--duration-s", "60", "--untimed", "--out", out]
        run = pilotfish(*arguments, cwd=tmp_path)
        assert run.returncode == 0, run.stderr
    assert (tmp_path / "mine.csv").read_bytes() == (tmp_path / "built-in.csv").read_bytes()
