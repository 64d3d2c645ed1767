"""How long users wait: whole commands in CPU seconds, beside a fixed piece of arithmetic on the same machine.

Each row is the least of some runs, the interpreter's start included, with one thread of linear algebra; a yardstick is
`benchmarks.write`'s, taken beside each row, so that figures from two machines, or from a busy one, can be compared.
A row of a batch is what 24 rows take more than 8, divided by 16; `benchmarks.scale` tells what several processes cost.
The first page of a merged letter is there when the destination is given it; until then the whole table was checked.
"""

from __future__ import annotations

import csv
import os
import resource
import subprocess
import sys
import tempfile
from pathlib import Path

from benchmarks.write import SENTENCE, TEXT, yardstick

_EXAMPLES = Path(__file__).resolve().parents[1] / "examples"
_SCANNED, _DRAWN = "house-joined-ballpoint", "house-joined"
_FEW, _MORE = 8, 24  # rows of tables
_FIRST_PAGE = """
import sys
from handout.cli import main
from handout.printing.batch import PdfFile
PdfFile.take = lambda *_: sys.exit(0)
main()
"""
_TWICE = """
from handout.cli import main
for _ in range(2):
    try:
        main()
    except SystemExit:
        pass
"""


def spend(*arguments: str | Path, runs: int = 3, program: tuple[str, ...] = ("-m", "handout")) -> float:
    """The least CPU seconds of some runs of the command."""
    own = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
    own |= {f"{library}_NUM_THREADS": "1" for library in ("OMP", "OPENBLAS")}
    least = float("inf")
    for _ in range(runs):
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        subprocess.run([sys.executable, *program, *map(str, arguments)], env=own, capture_output=True, check=True)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        least = min(least, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime)
    return least


def _table(folder: Path, rows: int) -> Path:
    """The people of the example, over and over."""
    with (_EXAMPLES / "people.csv").open(encoding="utf-8", newline="") as stream:
        people = list(csv.DictReader(stream))
    with (path := folder / f"{rows}.csv").open("w", encoding="utf-8", newline="") as stream:
        writer = csv.DictWriter(stream, people[0].keys())
        writer.writeheader()
        writer.writerows(people[number % len(people)] for number in range(rows))
    return path


def main() -> None:
    """Print the rows as they are found."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        few, more = (_table(folder, rows) for rows in (_FEW, _MORE))
        letter = folder / "letter.txt"
        letter.write_text("Dear {First name},\nthank you for coming, all the way from {City}!\n", encoding="utf-8")

        def show(what: str, spent: float, goal: float) -> None:
            print(f"{what:<52}{spent:8.2f} s{spent / yardstick():9.1f} yardsticks   goal {goal:.3g} s", flush=True)

        show("handout --help", spend("--help"), 0.15)
        for text, what, runs in ((SENTENCE, "a sentence", 3), (TEXT, "300 words", 1)):
            for hand, file, goal in (
                (_DRAWN, "a.svg", 0.5 if runs > 1 else 2.5),
                (_SCANNED, "a.png", 1.2 if runs > 1 else 4.0),
                (_SCANNED, "a.svg", 1.2 if runs > 1 else 4.0),
            ):
                spent = spend("write", text, "--hand", hand, "--seed", "1", "-o", folder / file, runs=runs)
                show(f"{what}, {hand}, {file[1:]}", spent, goal)
        paths = ("write", TEXT, "--hand", _SCANNED, "--seed", "1", "-o", folder / "a.svg")
        once, twice = spend(*paths, runs=1), spend(*paths, program=("-c", _TWICE), runs=1)
        show(f"300 words, {_SCANNED}, svg, again in the process", twice - once, 2.5)
        fine = ("--dpi", "600", "-o", folder / "b.png")
        show("300 words, scanned, 600 dpi", spend("write", TEXT, "--hand", _SCANNED, *fine, runs=1), 7.0)
        page = ("--scan", _EXAMPLES / "page.jpg", "--text", _EXAMPLES / "page.txt", "-o", folder / "read.hand")
        show("reading a page", spend("hand", "read", "read", *page, runs=1), 15.0)
        first = (
            "print",
            more,
            "--letter",
            letter,
            "--dry-run",
            folder / "first.pdf",
            "--jobs",
            "1",
            "--fallback",
            "--hand",
        )
        for hand, goal in ((_DRAWN, 2.0), (_SCANNED, 2.0)):
            spent = spend(*first, hand, program=("-c", _FIRST_PAGE), runs=1)
            show(f"first page of {_MORE} merged letters, {hand}", spent, goal)
        for hand, goal in ((_DRAWN, 0.25), (_SCANNED, 0.5)):
            batch = ("--hand", hand, "--fallback", "--dry-run", folder / "out.pdf", "--jobs")
            little, much = (spend("print", table, *batch, "1", runs=1) for table in (few, more))
            show(f"an envelope, {hand}, 600 dpi", (much - little) / (_MORE - _FEW), goal)


if __name__ == "__main__":
    main()
