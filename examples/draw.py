#!/usr/bin/env python3
"""Pictures of records (docs/records.md) as SVG, for the lessons (docs/lessons): standard library only.

    draw.py tracks RUN.csv...                    from above
    draw.py time COLUMN RUN.csv...               a column of the craft's rows over time
    draw.py ages RUN.csv --within 20             seconds since each AUV last had the craft that near
    draw.py beside COLUMN LOG.csv                a column of any table beside its reference_ one

The first of several records gives the AUVs. Each ends with --out FILE.svg; --from and --to cut the time, s. It prints what is drawn, in numbers.
Simulated records are drawn as it truly was; live ones as the craft reported itself and as the AUVs were estimated, in seconds since the first row.
"""

import argparse
import csv
import itertools
import math
import sys
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
    if rows and not any(row.get("kind") == "truth" for row in rows) and rows[0].get("kind"):
        began = rows[0]["t_s"]
        rows = sorted(({**row, "t_s": row["t_s"] - began} for row in rows), key=lambda row: row["t_s"])
    return [row for row in rows if begin <= row["t_s"] <= end]


def truth(rows, vehicle):
    """Where a vehicle was; of a live record, as the craft reported itself and as an AUV was estimated."""
    kinds = ("truth", "asc_state", "estimated")
    return [row for row in rows if row.get("kind") in kinds and row["vehicle"] == vehicle]


def auvs_of(rows):
    return sorted({row["vehicle"] for row in rows if row.get("kind") in ("truth", "estimated")} - {"asc", *crafts_of(rows)})


def crafts_of(rows):
    """Craft report themselves in live records, and have plans of their own in those of fleets; a single simulated one is `asc`."""
    return sorted({row["vehicle"] for row in rows if row.get("kind") in ("asc_state", "planned")} - {""}) or ["asc"]


def of_craft(rows, craft, column):
    """The craft's rows that have the column: those of its plans have its goal and its references."""
    own = truth(rows, craft)
    if any(isinstance(row.get(column), float) for row in own):
        return own
    return [row for row in rows if row.get("kind") == "planned" and row["vehicle"] in (craft, "")]


def each_craft(files):
    """(name of the curve, rows of the file, craft) of every craft of every file."""
    for name, rows in files.items():
        for craft in crafts_of(rows):
            if len(crafts_of(rows)) == 1:
                yield name, rows, craft
            else:
                yield (craft if len(files) == 1 else f"{name}: {craft}"), rows, craft


def required(name, points, column, rows):
    """The points of a curve; ends with the record's columns if it has none."""
    if not points:
        columns = [column for column in rows[0] if any(isinstance(row[column], float) for row in rows)] if rows else []
        sys.exit(f"{name} has no {column or 'positions'} at these times; columns with numbers: {', '.join(columns) or 'none'}")
    return points


def thinned(points):
    step = math.ceil(len(points) / POINTS_MAX)
    return points[::step] + points[-1:]


def ages(rows, auv, within):
    """(time, s; seconds since the craft was within so many metres of the AUV): a visit begins by being near."""
    near, out, places = rows[0]["t_s"], [], {}
    crafts = crafts_of(rows)
    for row in rows:
        if row.get("kind") not in ("truth", "asc_state", "estimated"):
            continue
        places[row["vehicle"]] = row
        if row["vehicle"] != auv:
            continue
        for craft in (places[name] for name in crafts if name in places):
            if math.hypot(craft["north_m"] - row["north_m"], craft["east_m"] - row["east_m"]) <= within:
                near = row["t_s"]
        out.append((row["t_s"], row["t_s"] - near))
    return out


def read(arguments):
    """The rows of each file by its name, or by its path where two have the same name."""
    names = [Path(file).stem for file in arguments.files]
    names = [name if names.count(name) == 1 else file for name, file in zip(names, arguments.files)]
    return {name: rows_of(file, arguments.begin, arguments.end) for name, file in zip(names, arguments.files)}


def column_of(name, rows, column, all_rows):
    """A column over time."""
    return required(name, paper.over_time([row for row in rows if column in row], column), column, all_rows)


def curves(arguments, files):
    """Names and points, and what the axes are."""
    title, column = arguments.title, arguments.column
    first_name, first = next(iter(files.items()))
    if arguments.what == "tracks":
        lines = {auv: paper.plane(truth(first, auv)) for auv in auvs_of(first)}
        for name, rows, craft in each_craft(files):
            lines[name] = required(name, paper.plane(truth(rows, craft)), None, rows)
        return lines, lambda drawn: paper.from_above(title, drawn)
    if arguments.what == "time":
        lines = {name: column_of(name, of_craft(rows, craft, column), column, rows) for name, rows, craft in each_craft(files)}
        for name, points in lines.items():
            values = [value for _, value in points]
            print(f"{name}: {column} {paper.rms(values):.2f} (RMS), {max(values):.2f} at most")
        return lines, lambda drawn: paper.in_time(title, column, drawn)
    if arguments.what == "ages":
        lines = {auv: ages(first, auv, arguments.within) for auv in auvs_of(first)}
        for name, points in lines.items():
            visits = sum(a > 0 and b == 0 for (_, a), (_, b) in zip(points, points[1:]))
            values = [value for _, value in points]
            print(f"{name}: {visits} visits, {sum(values) / len(values):.0f} s since the last one at the mean, {max(values):.0f} s at most")
        required(first_name, lines, "AUVs", first)
        return lines, lambda drawn: paper.in_time(title, "s since the last visit", drawn)
    columns = [f"reference_{column}", column]
    return {name: column_of(first_name, first, name, first) for name in columns}, lambda drawn: paper.in_time(title, column, drawn)


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
    arguments.column = None
    if arguments.what in ("time", "beside"):
        arguments.column, *arguments.files = arguments.files
        if not arguments.files:
            parser.error(f"{arguments.what} needs a column and a record")
    files = read(arguments)
    lines, draw = curves(arguments, files)
    known = auvs_of(next(iter(files.values())))
    craft, auvs = itertools.cycle(CRAFT), itertools.cycle(AUVS)
    paper.COLOURS.update({name: next(auvs if name in known else craft) for name in lines})
    drawn = [(name, thinned(points), name.startswith("reference_")) for name, points in lines.items()]
    paper.write(arguments.out, draw(drawn))


if __name__ == "__main__":
    main()
