"""A report as a document: Markdown with GitHub's tables, or one page of HTML that needs no other file."""

from __future__ import annotations

import html
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from .charts import front
from .words import NONE, integer, interval, number, probability, signed

# Failures that are shown.
FAILURES = 20
# Craft whose names are shown; of more there are the first and the last.
CRAFT = 4
# Probability of an error in any comparison below which a difference is significant.
LEVEL = 0.05

METHOD = """Controllers are compared under the same conditions: same start, water, noise and parameters. A ratio is
the geometric mean of the paired ratios to the reference; below 1 is better. Brackets hold 95 % intervals. The
interval is Student's, of the mean logarithm. With one scenario and one craft, each replicate is an observation.
With several craft or scenarios, the mean of each case (a scenario with a craft) is one observation: the interval
then describes other scenarios and craft, not more replicates. Where a value is 0 or below, a difference replaces
the ratio, marked Δ. Wins are the share of pairs in which the controller has less (a tie counts half), with Wilson's
interval. p is that of the paired t-test on the same observations; Holm's correction covers all comparisons of this
report. **Bold** marks a significant difference from the reference (5 %, after the correction)."""

CLAIMS = """The claims of the campaign file, decided for each controller and scenario. `beside` is the controller,
of those that the claim names, with the least mean of the first objective under the scored conditions, which favours
it. A controller that does not use paths which the scenario grants is not judged there. Intervals are Student's."""

WINNERS = """The least mean of each metric among controllers that know no more than the scenario grants. After `=`
follow those that a paired 95 % interval does not distinguish from it. A law is judged at the gains that were tuned
for the metric's objective, if the file asks for them."""

SCORES = """Means ± half of their 95 % interval (Student): over replicates of one craft, or over craft where there
are several. **Bold** marks the least (the first of equals). `beyond` counts episodes per run beyond a limit or
bound. Gains of tuned laws are look-ahead, m / along-track, 1/s / integral, m/s."""

PARETO = """Means over the conditions of a scenario. The table lists the planners and those points of the laws that
no other law's point dominates. The picture shows all points that are at most twice as far off as the nearest."""

ESTIMATED = """What the planner learnt of its craft after 300 s, compared with step tests of the craft. The error is
the absolute difference. The stated interval is ± 1.96 standard deviations and should contain the step test in 95 %
of the runs."""

ALARMS = """An alarm is `craft_does_not_follow`; it is false wherever nothing breaks. `noticed` counts runs with a
new alarm after the breakdown."""

WORST = """For each planner, the ten conditions with the largest ratio to the reference. `pilotfish campaign replay
DIR RUN` flies a run again and writes its page; DIR is the campaign's directory."""

EFFECTS = """Spearman's rank correlation between a parameter and the ratio to the reference: below 0, a larger
parameter favours the controller. Each replicate is one observation, as its parameters are the same in all cases.
Holm's correction covers all rows of this table. Thirds are by the parameter's value; each cell shows the range, the
ratio and its Student interval."""

STYLE = """body{font:15px/1.5 system-ui,sans-serif;max-width:75rem;margin:2rem auto;padding:0 1rem}
table{border-collapse:collapse;display:block;overflow-x:auto;margin:1rem 0}
td,th{padding:.2rem .6rem;border-bottom:1px solid #ddd;text-align:left}
.n{text-align:right;white-space:nowrap}svg{max-width:100%;height:auto}"""

Json = dict[str, Any]
Column = tuple[str, Callable[[Any], str]]


@dataclass
class Table:
    """Rows of cells; columns behind the first `words` hold numbers and are aligned right."""

    words: int
    columns: list[str]
    rows: list[list[str]]


@dataclass
class Heading:
    level: int
    words: str


@dataclass
class Figure:
    """A picture as SVG; Markdown has its title alone."""

    title: str
    svg: str


Block = Heading | Table | Figure | str


@dataclass
class Document:
    """Blocks, of which strings are paragraphs; text between `**` is bold, between backticks code."""

    blocks: list[Block]

    def markdown(self) -> str:
        return "\n\n".join(map(markdown, self.blocks)) + "\n"

    def html(self) -> str:
        title = next(block.words for block in self.blocks if isinstance(block, Heading))
        head = f'<meta charset="utf-8"><title>{html.escape(title)}</title><style>{STYLE}</style>'
        return f'<!doctype html>\n<html lang="en">{head}\n' + "\n".join(map(element, self.blocks)) + "\n</html>\n"


def markdown(block: Block) -> str:
    match block:
        case Heading(level, words):
            return f"{'#' * level} {words}"
        case Figure(title):
            return f"Picture in the HTML report: {title}"
        case Table(words, columns, rows):
            lines = [columns, *rows]
            cells = ["| " + " | ".join(cell.replace("|", "\\|") for cell in line) + " |" for line in lines]
            cells.insert(1, "|" + "---|" * words + "---:|" * (len(columns) - words))
            return "\n".join(cells)
        case _:
            return block


def element(block: Block) -> str:
    match block:
        case Heading(level, words):
            return f"<h{level}>{inline(words)}</h{level}>"
        case Figure(title, svg):
            return f"<figure>{svg}<figcaption>{inline(title)}</figcaption></figure>"
        case Table(words, columns, rows):
            lines = [("th", columns), *(("td", row) for row in rows)]
            return "<table>" + "\n".join(row_of(tag, cells, words) for tag, cells in lines) + "</table>"
        case _:
            return f"<p>{inline(block)}</p>"


def row_of(tag: str, cells: Sequence[str], words: int) -> str:
    kinds = ["" if place < words else ' class="n"' for place in range(len(cells))]
    row = (f"<{tag}{kind}>{inline(cell)}</{tag}>" for kind, cell in zip(kinds, cells, strict=True))
    return f"<tr>{''.join(row)}</tr>"


def inline(words: str) -> str:
    words = re.sub(r"`([^`]*)`", r"<code>\1</code>", html.escape(words, quote=False))
    return re.sub(r"\*\*(.*?)\*\*", r"<strong>\1</strong>", words)


def table(words: int, items: Sequence[Any], *columns: Column) -> Table:
    """A table with a row for each item."""
    return Table(words, [name for name, _ in columns], [[cell(item) for _, cell in columns] for item in items])


def member(name: str, shown: Callable[[Any], str]) -> Callable[[Json], str]:
    return lambda item: shown(item[name])


def code(words: str | None) -> str:
    return f"`{words}`"


def place(scenario: str | None) -> str:
    return "all" if scenario is None else code(scenario)


def case(item: Json) -> str:
    return f"`{item['scenario']}`, {item['craft']}"


def bold(words: str, is_bold: bool) -> str:
    return f"**{words}**" if is_bold else words


def replay(item: Json) -> str:
    return f"`pilotfish campaign replay DIR {item['run']}`"


def percent(share: float) -> str:
    return f"{100 * share:.2f} %"


def document(numbers: Json) -> Document:
    """All tables and pictures of a report."""
    about, metrics = numbers["campaign"], numbers["metrics"]
    blocks: list[Block] = [Heading(1, about["title"]), introduction(numbers)]

    def section(title: str, text: str, shown: Table) -> None:
        if shown.rows:
            blocks.extend([Heading(2, title), *([" ".join(text.split("\n"))] if text else []), shown])

    section("Controllers, scenarios, parameters", "", controllers(numbers))
    blocks.append(cases(numbers))
    if numbers["parameters"]:
        columns = ("parameter", member("key", code)), ("drawn from", drawn_from)
        blocks.append(table(2, numbers["parameters"], *columns))
    section("Claims", CLAIMS, claims(numbers))
    if len(numbers["controllers"]) > 1:
        section("Winners", WINNERS, winners(numbers))
    if numbers["pareto"]:
        axes = numbers["pareto_metrics"]
        picture = Figure(f"Mean {axes[1]} against mean {axes[0]}, by scenario", front(numbers["pareto"], axes))
        blocks.extend([Heading(2, " and ".join(axes)), " ".join(PARETO.split("\n")), picture, pareto(numbers, axes)])
    if numbers["comparisons"]:
        blocks.extend([Heading(2, f"Beside {about['reference']}"), " ".join(METHOD.split("\n"))])
    for metric in metrics:
        if of_it := [found for found in numbers["comparisons"] if found["metric"] == metric]:
            blocks.extend([Heading(3, metric), comparisons(of_it)])
    section("Worst runs", WORST, worst(numbers))
    section("Effect of parameters", EFFECTS, effects(numbers))
    section("Learning the craft", ESTIMATED, estimated(numbers))
    section("Detection of breakdowns", ALARMS, alarms(numbers))
    if numbers["scores"]:
        blocks.extend([Heading(2, "Scenarios"), " ".join(SCORES.split("\n"))])
    for scenario in dict.fromkeys(score["scenario"] for score in numbers["scores"]):
        blocks.extend([Heading(3, scenario), scores(numbers, scenario)])
    failed = numbers["failures"]
    counts = integer(len(failed)), integer(about["n_rows"]), min(len(failed), FAILURES)
    text = "{} of {} missions failed; {} are listed. They are in no ratio.".format(*counts)
    section("Failures", text, failures(failed))
    return Document(blocks)


def introduction(numbers: Json) -> str:
    about = numbers["campaign"]
    n_cases = sum(len(case["craft"]) for case in numbers["cases"])
    lasting = "" if about["duration_s"] is None else f" of at most {about['duration_s']:g} s"
    planned = "" if about["n_rows"] == about["n_runs_at_most"] else f" (of at most {integer(about['n_runs_at_most'])})"
    text = (
        f"Campaign `{about['name']}`, seed {about['seed']}: {len(numbers['cases'])} scenarios, {n_cases} cases "
        f"(scenarios with a craft), {integer(about['replicates'])} replicates of each; {integer(about['n_rows'])} runs"
        f"{lasting}{planned}; {integer(about['n_failed'])} failed. "
        f"The reference is `{about['reference']}`. Digest of the rows: `{about['digest']}`."
    )
    if about["repeated"]:
        text += (
            f" **All replicates are the same mission** in {', '.join(map(code, about['repeated']))}: nothing is drawn "
            "there, and only the first one counts. Give the scenario noise or distributions, or the campaign "
            "`[[parameters]]`, or ask for one replicate."
        )
    return text


def controllers(numbers: Json) -> Table:
    parts = {"knows_more": "compared; knows more than the scenario grants"}
    return table(
        3,
        numbers["controllers"],
        ("controller", member("name", code)),
        ("information", member("information", str)),
        ("part", lambda flown: parts.get(flown["part"], flown["part"])),
        ("runs", member("n_runs", integer)),
        ("failed", member("n_failed", integer)),
    )


def cases(numbers: Json) -> Table:
    def names(craft: list[str]) -> str:
        return ", ".join(craft) if len(craft) <= CRAFT else f"{len(craft)} from {craft[0]} to {craft[-1]}"

    columns = ("scenario", member("scenario", code)), ("title", member("title", str)), ("craft", member("craft", names))
    return table(3, numbers["cases"], *columns)


def drawn_from(parameter: Json) -> str:
    if parameter["uniform"]:
        return "{:g} to {:g}, uniform".format(*parameter["uniform"])
    return ", ".join(f"{value:g}" for value in parameter["choice"]) + ", equally likely"


def comparisons(found: list[Json]) -> Table:
    """One metric, by controller and scenario."""
    clusters = {"replicate": "replicates", "craft": "craft", "scenario": "scenarios", "scenario_and_craft": "cases"}

    def pairs(found: Json) -> str:
        counts = {"failed": "n_failed", "failed of the reference": "n_reference_failed", "without a value": "n_missing"}
        others = [f", {integer(found[count])} {why}" for why, count in counts.items() if found[count]]
        return integer(found["n_pairs"]) + "".join(others)

    def estimate(found: Json) -> str:
        shown = number(found["estimate"])
        if found["measure"] == "difference" and found["estimate"] is not None:
            shown = f"Δ {shown} {found['unit']}"
        return bold(shown, found["p_holm"] is not None and found["p_holm"] < LEVEL)

    def wins(wins: Json | None) -> str:
        if wins is None:
            return NONE
        low, high = (f"{100 * share:.0f}" for share in wins["wilson_95"])
        return f"{100 * wins['share']:.0f} % [{low}, {high}]"

    return table(
        2,
        found,
        ("controller", member("controller", code)),
        ("scenario", member("scenario", place)),
        ("pairs", pairs),
        ("observations", lambda found: f"{integer(found['n_clusters'])} {clusters[found['cluster']]}"),
        ("mean", member("mean", number)),
        ("reference's", member("reference_mean", number)),
        ("ratio", estimate),
        ("Student", lambda found: interval(found["student_95"]) or NONE),
        ("median / 90 % / worst", lambda found: " / ".join(map(number, found["quantiles"] or [None]))),
        ("wins", member("wins", wins)),
        ("p", member("p", probability)),
        ("p, Holm", member("p_holm", probability)),
    )


def claims(numbers: Json) -> Table:
    return table(
        4,
        numbers["claims"],
        ("claim", member("claim", str)),
        ("scenario", lambda verdict: verdict["scenario"] or "all"),
        ("controller", member("controller", str)),
        ("beside", lambda verdict: verdict["beside"] or ""),
        ("measured", member("words", str)),
        ("claimed", member("limit", str)),
        ("holds", lambda verdict: "yes" if verdict["holds"] else "**no**"),
    )


def winners(numbers: Json) -> Table:
    found = {(winner["scenario"], winner["metric"]): winner for winner in numbers["winners"]}

    def cell(metric: str) -> Column:
        def names(scenario: str) -> str:
            winner = found.get((scenario, metric))
            return " = ".join(map(code, [winner["controller"], *winner["as_good"]])) if winner else NONE

        return metric, names

    scenarios = [case["scenario"] for case in numbers["cases"]]
    flown = [scenario for scenario in scenarios if any((scenario, metric) in found for metric in numbers["metrics"])]
    return table(1 + len(numbers["metrics"]), flown, ("scenario", code), *map(cell, numbers["metrics"]))


def scores(numbers: Json, scenario: str) -> Table:
    def cell(place: int) -> Column:
        def value(scores: Json) -> str:
            half = scores["half_widths"][place]
            words = number(scores["means"][place]) + (f" ± {number(half)}" if half is not None else "")
            return bold(words, scores["is_least"][place])

        return numbers["metrics"][place], value

    return table(
        1,
        [each for each in numbers["scores"] if each["scenario"] == scenario],
        ("controller", member("controller", code)),
        *map(cell, range(len(numbers["metrics"]))),
        ("beyond", lambda scores: ", ".join(f"{name} {number(mean)}" for name, mean in scores["beyond"])),
        ("gains", member("gains", "; ".join)),
    )


def pareto(numbers: Json, axes: list[str]) -> Table:
    """Planners, and the laws' points that no other law's point dominates."""

    kinds = {True: "laws' points", False: "planners"}

    def dominated(point: Json) -> str:
        return f"{point['beaten_by']} of the {kinds[point['is_planner']]}"

    return table(
        2,
        [point for point in numbers["pareto"] if point["is_planner"] or not point["beaten_by_its_kind"]],
        ("scenario", member("scenario", code)),
        ("controller", member("controller", code)),
        (axes[0], lambda point: number(point["means"][0])),
        (axes[1], lambda point: number(point["means"][1])),
        ("dominated by", dominated),
    )


def worst(numbers: Json) -> Table:
    def ratio(run: Json) -> str:
        return ("Δ " if run["measure"] == "difference" else "") + number(run["by"])

    return table(
        3,
        numbers["worst"],
        ("controller", member("controller", code)),
        ("scenario, craft", case),
        ("replay", replay),
        ("run", member("run", str)),
        ("value", member("value", number)),
        ("reference's run", lambda run: NONE if run["reference_run"] is None else str(run["reference_run"])),
        ("its value", member("reference_value", number)),
        ("ratio", ratio),
    )


def effects(numbers: Json) -> Table:
    def third(number_of: int) -> Callable[[Json], str]:
        def words(effect: Json) -> str:
            third = effect["thirds"][number_of]
            if third is None:
                return NONE
            least, most = map(number, third["parameter"])
            delta = "Δ " if effect["measure"] == "difference" else ""
            return f"{least} to {most}: {delta}{number(third['estimate'])} {interval(third['student_95'])}".rstrip()

        return words

    return table(
        3,
        numbers["effects"],
        ("parameter", lambda effect: code(effect["parameter"].removeprefix("param."))),
        ("controller", member("controller", code)),
        ("metric", member("metric", code)),
        ("replicates", member("n_replicates", integer)),
        ("Spearman", lambda effect: NONE if effect["spearman"] is None else signed(f"{effect['spearman']:.2f}")),
        ("p", member("p", probability)),
        ("p, Holm", member("p_holm", probability)),
        ("lowest third", third(0)),
        ("middle third", third(1)),
        ("highest third", third(2)),
    )


def estimated(numbers: Json) -> Table:
    return table(
        2,
        numbers["estimated"],
        ("controller", member("controller", code)),
        ("estimate", member("quantity", code)),
        ("runs", member("n_runs", integer)),
        ("error, median, s", member("error_median_s", number)),
        ("error, 90 %, s", member("error_90_s", number)),
        ("interval holds", member("held", percent)),
    )


def alarms(numbers: Json) -> Table:
    def noticed(found: Json) -> str:
        return f"{integer(found['n_noticed'])} of {integer(found['n_runs'])}" if found["breaks"] else NONE

    def after(found: Json) -> str:
        if not found["n_noticed"]:
            return NONE
        return f"{number(found['noticed_after_median_s'])} / {number(found['noticed_after_worst_s'])}"

    return table(
        1,
        numbers["alarms"],
        ("controller", member("controller", code)),
        ("runs", member("n_runs", integer)),
        ("alarms an hour", member("per_hour", number)),
        ("runs with an alarm", member("alarmed", percent)),
        ("noticed", noticed),
        ("after, median / longest, s", after),
    )


def failures(failed: list[Json]) -> Table:
    return table(
        4,
        failed[:FAILURES],
        ("controller", member("controller", code)),
        ("scenario, craft", case),
        ("failure", member("reason", str)),
        ("replay", replay),
        ("run", member("run", str)),
    )
