"""The example of a law of one's own, flown over HTTP and computed again from the record.

PILOTFISH is the path of the program.
"""

import math
import socket
import subprocess
import sys
import time
from pathlib import Path

import pytest

from program import pilotfish, read, rows_of

ROOT = Path(__file__).resolve().parents[2]
SOURCE = (ROOT / "examples" / "own_law.py").read_text()
DURATION = 60
GAIN = 0.15


@pytest.fixture(scope="module")
def url(tmp_path_factory):
    """Where the example serves, on a port of its own."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    assert SOURCE.count("8000") == 1
    file = tmp_path_factory.mktemp("law") / "own_law.py"
    file.write_text(SOURCE.replace("8000", str(port)))
    with subprocess.Popen([sys.executable, str(file)]) as law:
        for _ in range(100):
            with socket.socket() as probe:
                if probe.connect_ex(("127.0.0.1", port)) == 0:
                    break
            time.sleep(0.1)
        yield f"http://127.0.0.1:{port}/"
        law.kill()


def test_the_example_is_at_most_30_lines_of_the_standard_library():
    assert len(SOURCE.splitlines()) <= 30
    imported = [line.split()[1].split(".")[0] for line in SOURCE.splitlines() if line.startswith(("import ", "from "))]
    assert set(imported) <= sys.stdlib_module_names


def test_the_craft_is_steered_as_the_law_says(url, tmp_path):
    """In still water with everything known exactly, the reference follows from the truth in the record."""
    out = tmp_path / "calm.csv"
    ran = pilotfish("simulate", "paper-tracking", "--duration-s", str(DURATION), "--guide", url, "--out", str(out))
    assert ran.returncode == 0, ran.stderr
    table = read(out)
    planned, known = rows_of(table, "planned"), rows_of(table, "known", "auv-1")
    craft = rows_of(table, "truth", "asc")
    assert len(planned) == DURATION and (planned["method"] == "own_law").all()
    for k in range(DURATION):
        auv, asc = known.loc[k], craft.loc[k]
        wanted = complex(
            GAIN * (auv["north_m"] - asc["north_m"]) + auv["speed_mps"] * math.cos(auv["course_rad"]),
            GAIN * (auv["east_m"] - asc["east_m"]) + auv["speed_mps"] * math.sin(auv["course_rad"]),
        )
        speed, heading = planned.loc[k, ["reference_speed_mps", "reference_heading_rad"]]
        assert speed == pytest.approx(min(abs(wanted), 1.5), abs=1e-9)
        assert math.remainder(heading - math.atan2(wanted.imag, wanted.real), math.tau) == pytest.approx(0, abs=1e-9)


def test_a_campaign_flies_it_beside_the_planner_with_any_number_of_cores(url, tmp_path):
    text = (ROOT / "examples" / "campaigns" / "own-law.toml").read_text()
    assert "replicates = 50\n" in text and "duration_s = 300\n" in text
    text = text.replace("replicates = 50", "replicates = 2").replace("duration_s = 300", "duration_s = 30")
    file = tmp_path / "own-law.toml"
    file.write_text(text.replace("http://127.0.0.1:8000/", url))
    digests = set()
    for jobs in ("1", "3"):
        out = tmp_path / jobs
        ran = pilotfish("campaign", "run", str(file), "--jobs", jobs, "--out", str(out))
        assert ran.returncode == 0, ran.stderr
        digests.add(pilotfish("campaign", "digest", str(out)).stdout)
    assert len(digests) == 1


def test_a_law_that_is_not_there_is_named_with_what_to_do(tmp_path):
    with socket.socket() as unused:
        unused.bind(("127.0.0.1", 0))
        url = f"http://127.0.0.1:{unused.getsockname()[1]}/"
        ran = pilotfish("simulate", "paper-tracking", "--duration-s", "9", "--guide", url)
    assert ran.returncode == 1
    assert f"the guide {url} gave no reference at 0 s" in ran.stderr and "start the law" in ran.stderr
    ran = pilotfish("simulate", "paper-tracking", "--guide", "localhost:8000")
    assert ran.returncode == 2 and "is no address of a law, such as http://127.0.0.1:8000/" in ran.stderr
