"""Puts the program into the wheel if `.ci/wheel` names it; `pip install ./api/python` installs the client alone."""

import os
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface


class Program(BuildHookInterface):
    def initialize(self, _version: str, build_data: dict[str, Any]) -> None:
        if program := os.environ.get("WHEEL_PROGRAM"):
            build_data["shared_scripts"][program] = "pilotfish"
            build_data["tag"] = f"py3-none-{os.environ['WHEEL_PLATFORM']}"
            build_data["pure_python"] = False
