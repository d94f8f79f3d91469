#!/usr/bin/env python3
"""Pictures of records (docs/records.md) as SVG, for the lessons (docs/lessons): standard library only.

    draw.py tracks RUN.csv...                    from above
    draw.py time COLUMN RUN.csv...               a column of the craft's true rows over time
    draw.py ages RUN.csv --within 20             seconds since each AUV last had the craft that near
    draw.py beside COLUMN LOG.csv                a column of any table beside its reference_ one

The first of several records gives the AUVs. Each ends with --out FILE.svg; --from and --to cut the time, s. It prints what is drawn, in numbers.
"""

import argparse
import csv
import math
from pathlib import Path

import paper

CRAFT = ["#0072b2", "#d55e00", "#56b4e9", "#000"]
AUVS = ["#009e73", "#cc79a7", "#e69f00", "#999", "#7b3294"]
# Points of a curve: more than the picture has pixels are only bytes.
POINTS_MAX = 270


def rows_of(file, begin, end):
    """The rows from `begin` to `end`, s, with numbers where cells have them."""
    with Path(file).open(encoding="utf-8") as lines:
        rows = [{name: paper.number(cell) for name, cell in row.items()} for row in csv.DictReader(lines)]
    return [row for row in rows if begin <= row["t_s"] <= end]


def truth(rows, vehicle):
    return [row for row in rows if row.get("kind") == "truth" and row["vehicle"] == vehicle]


def auvs_of(rows):
    return sorted({row["vehicle"] for row in rows if row.get("kind") == "truth"} - {"asc"})


def thinned(points):
    step = math.ceil(len(points) / POINTS_MAX)
    return points[::step] + points[-1:]


def ages(rows, auv, within):
    """(time, s; seconds since the craft was within so many metres of the AUV): a visit begins by being near."""
    near, out = rows[0]["t_s"], []
    for craft, other in zip(truth(rows, "asc"), truth(rows, auv), strict=True):
        if math.hypot(craft["north_m"] - other["north_m"], craft["east_m"] - other["east_m"]) <= within:
            near = craft["t_s"]
        out.append((craft["t_s"], craft["t_s"] - near))
    return out


def curves(arguments):
    """Names and points, and what the axes are."""
    files = {Path(file).stem: rows_of(file, arguments.begin, arguments.end) for file in arguments.files}
    first = next(iter(files.values()))
    if arguments.what == "tracks":
        lines = {auv: paper.plane(truth(first, auv)) for auv in auvs_of(first)}
        return lines | {name: paper.plane(truth(rows, "asc")) for name, rows in files.items()}, paper.from_above
    if arguments.what == "time":
        lines = {name: paper.over_time(truth(rows, "asc"), arguments.column) for name, rows in files.items()}
        for name, points in lines.items():
            values = [value for _, value in points]
            print(f"{name}: {arguments.column} {paper.rms(values):.2f} (RMS), {max(values):.2f} at most")
        return lines, lambda title, all_curves: paper.in_time(title, arguments.column, all_curves)
    if arguments.what == "ages":
        lines = {auv: ages(first, auv, arguments.within) for auv in auvs_of(first)}
        for name, points in lines.items():
            visits = sum(a > 0 and b == 0 for (_, a), (_, b) in zip(points, points[1:]))
            values = [value for _, value in points]
            print(f"{name}: {visits} visits, {sum(values) / len(values):.0f} s since the last one at the mean, {max(values):.0f} s at most")
        return lines, lambda title, all_curves: paper.in_time(title, "s since the last visit", all_curves)
    columns = [f"reference_{arguments.column}", arguments.column]
    return {name: paper.over_time(first, name) for name in columns}, lambda title, all_curves: paper.in_time(title, arguments.column, all_curves)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=["tracks", "time", "ages", "beside"])
    parser.add_argument("files", nargs="+", help="for time and beside, the column comes first")
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--title", default="")
    parser.add_argument("--from", dest="begin", type=float, default=-math.inf)
    parser.add_argument("--to", dest="end", type=float, default=math.inf)
    parser.add_argument("--within", type=float, default=20, help="m")
    arguments = parser.parse_args()
    if arguments.what in ("time", "beside"):
        arguments.column, *arguments.files = arguments.files
    lines, draw = curves(arguments)
    craft, auvs = iter(CRAFT), iter(AUVS)
    paper.COLOURS.update({name: next(auvs if name.startswith("auv") else craft) for name in lines})
    drawn = [(name, thinned(points), name.startswith("reference_")) for name, points in lines.items()]
    paper.write(arguments.out, draw(arguments.title, drawn))


if __name__ == "__main__":
    main()
