"""Statistics and reports of campaigns: `python -m pilotfish.analysis report RUNS`, where RUNS is what `campaign
run` wrote.

`report` returns all numbers of a report; `write` writes them as report.json, report.md and report.html. Needs the
extra `analysis` of the package.
"""

from .report import report, write

__all__ = ["report", "write"]
