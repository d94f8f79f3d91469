"""What is said of the package, in files beside it."""

import os
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

import pilotfish

PACKAGE = Path(__file__).resolve().parents[1]
README = (PACKAGE / "README.md").read_text(encoding="utf-8")

# "A new user's afternoon": lines from nothing to a plot, the installation included.
LINES_MAX = 14


def test_the_version_is_the_workspaces():
    root = PACKAGE.parents[1]
    workspace = tomllib.loads((root / "Cargo.toml").read_text(encoding="utf-8"))
    assert pilotfish.__version__ == workspace["workspace"]["package"]["version"]
    for file, has_it in [("CITATION.cff", "\nversion: {}\n"), ("api/ros2/package.xml", "<version>{}</version>")]:
        assert has_it.format(pilotfish.__version__) in (root / file).read_text(encoding="utf-8"), file


@pytest.mark.soak
def test_the_wheel_brings_the_program():
    program = Path(sys.executable).with_name("pilotfish")
    said = subprocess.run([program, "--version"], check=True, capture_output=True, text=True).stdout
    assert said == f"pilotfish {pilotfish.__version__}\n"


def test_types_are_as_the_service_says(url):
    subprocess.run([sys.executable, PACKAGE / "generate.py", url, "--check"], check=True)


def test_the_synchronous_client_is_that_of_the_asynchronous_one():
    subprocess.run([sys.executable, PACKAGE / "generate.py", "--check"], check=True)
    text = (PACKAGE / "src" / "pilotfish" / "client.py").read_text(encoding="utf-8")
    assert not re.findall(r"async|await|Async|__a", text.split("\n", 3)[3])


def test_the_readme_gets_from_pip_to_a_plot(url, tmp_path):
    install, code = re.findall(r"```(?:bash|python)\n(.*?)```", README, re.DOTALL)[:2]
    lines = [line for line in (install + code).splitlines() if line.strip()]
    assert len(lines) <= LINES_MAX
    script = code.replace("Client()", f"Client({url!r})")
    assert script != code
    environment = {**os.environ, "MPLBACKEND": "Agg"}
    subprocess.run([sys.executable, "-c", script], cwd=tmp_path, env=environment, check=True)
    assert (tmp_path / "mission.png").stat().st_size > 10_000


@pytest.mark.soak
def test_the_readmes_other_pieces_run(client, url):
    """In order, in one place, as a reader would type them."""
    pieces = re.findall(r"```python\n(.*?)```", README, re.DOTALL)[1:]
    assert pieces
    scope = {"client": client}
    for piece in pieces:
        exec(piece.replace("AsyncClient()", f"AsyncClient({url!r})"), scope)
