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
    if rows and not any(row.get("kind") == "truth" for row in rows) and rows[0].get("kind"):
        began = rows[0]["t_s"]
        rows = sorted(({**row, "t_s": row["t_s"] - began} for row in rows), key=lambda row: row["t_s"])
    return [row for row in rows if begin <= row["t_s"] <= end]


def truth(rows, vehicle):
    """Where a vehicle was; of a live record, as the craft reported itself and as an AUV was estimated."""
    kinds = ("truth", "asc_state", "estimated")
    return [row for row in rows if row.get("kind") in kinds and row["vehicle"] == vehicle]


def auvs_of(rows):
    crafts = {"asc"} | {row["vehicle"] for row in rows if row.get("kind") == "asc_state"}
    return sorted({row["vehicle"] for row in rows if row.get("kind") in ("truth", "estimated")} - crafts)


def crafts_of(rows):
    return sorted({row["vehicle"] for row in rows if row.get("kind") == "asc_state"}) or ["asc"]


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
            yield (name if len(crafts_of(rows)) == 1 else craft), rows, craft


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


def curves(arguments):
    """Names and points, and what the axes are."""
    files = {Path(file).stem: rows_of(file, arguments.begin, arguments.end) for file in arguments.files}
    first = next(iter(files.values()))
    if arguments.what == "tracks":
        lines = {auv: paper.plane(truth(first, auv)) for auv in auvs_of(first)}
        return lines | {name: paper.plane(truth(rows, craft)) for name, rows, craft in each_craft(files)}, paper.from_above
    if arguments.what == "time":
        lines = {name: paper.over_time(of_craft(rows, craft, arguments.column), arguments.column) for name, rows, craft in each_craft(files)}
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
