"""The program under test, and the scenario files of the repository."""

import os
import subprocess
from pathlib import Path as File

import pandas as pd
import pytest

SCENARIOS = File(__file__).resolve().parents[2] / "sim" / "scenarios"
NAMES = sorted(file.stem for file in SCENARIOS.glob("*.toml"))


def program(variable: str = "PILOTFISH") -> str:
    """Path of the program that an environment variable names; skips the test if it does not."""
    path = os.environ.get(variable)
    if path is None:
        pytest.skip(f"{variable} does not say where the program is")
    return path


def read(path: File) -> pd.DataFrame:
    """A record's table from its CSV, to the bit."""
    return pd.read_csv(path, dtype={"sequence": "Int64"})


def rows_of(table: pd.DataFrame, kind: str, vehicle: str | None = None) -> pd.DataFrame:
    """The rows of a kind, and of one vehicle if wanted."""
    rows = table[table["kind"] == kind]
    if vehicle is not None:
        rows = rows[rows["vehicle"] == vehicle]
    return rows.reset_index(drop=True)


def pilotfish(*arguments: str, cwd: File | None = None) -> subprocess.CompletedProcess[str]:
    """A run of the program, whatever becomes of it."""
    return subprocess.run([program(), *arguments], cwd=cwd, capture_output=True, text=True, check=False)
