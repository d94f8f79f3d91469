"""`python -m pilotfish.analysis report RUNS`."""

import argparse
from pathlib import Path

from .report import write
from .runs import NotReportableError

parser = argparse.ArgumentParser(prog="python -m pilotfish.analysis", description="Statistics of campaigns.")
commands = parser.add_subparsers(required=True)
command = commands.add_parser("report", help="write report.html, report.md and report.json into the directory")
command.add_argument("runs", type=Path, metavar="RUNS", help="directory of a campaign that was flown")
try:
    for file in write(parser.parse_args().runs):
        print(file)
except NotReportableError as why:
    parser.exit(1, f"error: {why}\n")
