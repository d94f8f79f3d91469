"""The lessons (docs/lessons) are run as they stand: every command, what it prints, and the pictures that it draws.

A block of `bash` is followed by what it prints, a block of `text`: its lines come in this order, `…` is anything. Numbers may differ a little, since
another processor rounds another way. PILOTFISH is the path of the program. UPDATE_DOCS=1 puts the pictures that were drawn into the pages' folder.
"""

import os
import re
import shutil
import socket
import subprocess
import sys
from pathlib import Path

import pytest

from program import program

ROOT = Path(__file__).resolve().parents[2]
LESSONS = ROOT / "docs" / "lessons"
# Share of a printed number, and its last digits.
RELATIVE, ABSOLUTE = 0.03, 0.02
# Pixels by which a point of a drawing may be elsewhere.
PIXELS = 3.0
NUMBER = re.compile(r"-?\d+(?:\.\d+)?")
MARK = "end of a block"
# What the pages call the ports of this machine; the bridge's is of UDP.
SERVICE, LAW, BRIDGE = "8080", "8000", "14560"
# A reader waits a second for a law to start; the test until it is there.
LISTENING = 'listening() { until (exec 3<>"/dev/tcp/127.0.0.1/$1") 2>/dev/null; do sleep 0.05; done; }\n'
PAGES = [
    "1-follow-one-auv",
    "2-hand-over",
    pytest.param("3-serve-five", marks=pytest.mark.soak),
    pytest.param("4-my-boat", marks=pytest.mark.soak),
    "5-my-law",
]


def blocks(page: str) -> list[tuple[str, str]]:
    """Languages and texts of a page's fenced blocks."""
    return re.findall(r"^```(\w+)\n(.*?)^```$", page, re.M | re.S)


def free_port() -> str:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return str(probe.getsockname()[1])


def alike(shown: str, printed: str) -> bool:
    """Whether a line is printed as it is shown, but for the last digits and what `…` leaves out."""
    shown, printed = " ".join(shown.split()), " ".join(printed.split())
    parts = [rf"({NUMBER.pattern})".join(map(re.escape, NUMBER.split(part))) for part in shown.split("…")]
    found = re.fullmatch(".*".join(parts), printed)
    wanted = map(float, NUMBER.findall(shown.replace("…", " ")))
    return bool(found) and all(
        abs(float(b) - a) <= max(RELATIVE * abs(a), ABSOLUTE) for a, b in zip(wanted, found.groups(), strict=True)
    )


def missing(shown: str, printed: str) -> list[str]:
    """The lines that are shown and were not printed after those before them."""
    rest = iter(printed.splitlines())
    return [line for line in shown.splitlines() if line != "…" and not any(alike(line, other) for other in rest)]


def run(page: str, folder: Path) -> list[str]:
    """What each block of `bash` printed."""
    (folder / "target" / "lessons").mkdir(parents=True)
    for name in ("examples", "docs"):
        # A copy: scripts have ports of their own.
        shutil.copytree(ROOT / name, folder / name)
    (folder / "bin").mkdir()
    (folder / "bin" / "pilotfish").symlink_to(program())
    steps = [f"{text}echo '{MARK}'\n" for language, text in blocks(page) if language == "bash"]
    script = "set -euo pipefail\ntrap 'kill $(jobs -p) 2>/dev/null || true' EXIT\n" + LISTENING + "".join(steps)
    script = re.sub(r"(_law\.py\b.*&.*\n\s*)sleep 1\n", rf"\1listening {LAW}\n", script)
    for port in (SERVICE, LAW, BRIDGE):
        other = free_port()
        script = script.replace(port, other)
        for file in ("own_law.py", "boat.py"):
            path = folder / "examples" / file
            path.write_text(path.read_text(encoding="utf-8").replace(port, other), encoding="utf-8")
    paths = [folder / "bin", Path(sys.executable).parent, *os.environ["PATH"].split(":")]
    env = {name: value for name, value in os.environ.items() if not name.startswith("PILOTFISH")}
    env |= {"PATH": ":".join(map(str, paths)), "PILOTFISH_PORT": re.search(r"127\.0\.0\.1:(\d+)/v1", script + "127.0.0.1:0/v1")[1]}
    with (folder / "errors.txt").open("w") as errors:
        ran = subprocess.run(["bash", "-c", script], cwd=folder, env=env, stdout=subprocess.PIPE, stderr=errors, text=True, timeout=400)
    assert ran.returncode == 0, ran.stdout + (folder / "errors.txt").read_text()
    return ran.stdout.split(f"{MARK}\n")[: len(steps)]


def picture_differs(drawn: Path, kept: Path) -> bool:
    """Whether a drawing shows something else than the one that is kept: other words, or a point elsewhere."""
    if drawn.suffix != ".svg":
        # The size in the head of a PNG file.
        return drawn.read_bytes()[:24] != kept.read_bytes()[:24]
    texts = [file.read_text(encoding="utf-8") for file in (drawn, kept)]
    if NUMBER.sub("#", texts[0]) != NUMBER.sub("#", texts[1]):
        return True
    return any(abs(float(a) - float(b)) > PIXELS for a, b in zip(*map(NUMBER.findall, texts), strict=True))


@pytest.mark.parametrize("name", PAGES)
def test_a_lesson_runs_as_it_stands(name: str, tmp_path: Path) -> None:
    page = (LESSONS / f"{name}.md").read_text(encoding="utf-8")
    printed = iter(run(page, tmp_path))
    faults, output = [], ""
    for language, text in blocks(page):
        if language == "bash":
            output = next(printed)
        elif language in ("text", "python"):
            faults += [f"not printed: {line}" for line in missing(text, output)]
            if faults:
                pytest.fail("\n".join([*faults, "but:", output]))
    for picture in re.findall(r"!\[.*?\]\((.*?)\)", page):
        drawn, kept = tmp_path / "target" / "lessons" / picture, LESSONS / picture
        if os.environ.get("UPDATE_DOCS"):
            shutil.copy(drawn, kept)
        elif picture_differs(drawn, kept):
            faults.append(f"{picture} is another picture: look at it, then UPDATE_DOCS=1 .ci/python-tests -k lesson")
    assert not faults


def test_a_changed_digit_and_a_missing_line_are_seen() -> None:
    assert not missing("rms_m 1.00\n…\nanswers.mpc 5", "rms_m  1.01\nmean_m 3\nanswers.mpc  5\n")
    assert missing("rms_m 1.00", "rms_m 1.10") and missing("a 1\nb 2", "b 2\na 1") and missing("a …", "b 1")


def test_every_lesson_is_in_the_list_and_its_pictures_are_small() -> None:
    listed = re.findall(r"\]\((\d-[\w-]+)\.md\)", (LESSONS / "README.md").read_text(encoding="utf-8"))
    assert listed == sorted(path.stem for path in LESSONS.glob("[0-9]*.md")) == [getattr(page, "values", [page])[0] for page in PAGES]
    pictures = [path for path in LESSONS.iterdir() if path.suffix != ".md"]
    assert sum(path.stat().st_size for path in pictures) < 1_000_000
