"""Stand-ins for the tests of the printing room: a writer that rules lines, and a print system of shell scripts."""

import os
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from handout.errors import MissingCharacters
from handout.printing.batch import BatchOptions, PrinterWay, chosen_rows, destination, make_rows
from handout.printing.envelope import address_layout
from handout.printing.journal import ENVELOPE, Journal
from handout.printing.prepared import BatchPage, prepare_row
from handout.printing.rows import TableRow
from handout.progress import silent
from handout.sinks import drawing_file
from handout.values import Drawing, Raster, Stroke

_LP = """#!/bin/sh
n=$(($(cat "$FAKE/count" 2>/dev/null || echo 0) + 1))
echo $n >"$FAKE/count"
for argument; do printf '%s\\n' "$argument" >>"$FAKE/call-$n.txt"; last=$argument; done
if [ -f "$FAKE/fail-$n" ]; then cat "$FAKE/fail-$n" >&2; exit 1; fi
cp "$last" "$FAKE/job-$n.pdf"
echo "request id is envelopes-$n (1 file(s))"
"""
_LPSTAT = """#!/bin/sh
case "$1" in
  -e) cat "$FAKE/queues";;
  -d) cat "$FAKE/default";;
  -H) cat "$FAKE/server";;
esac
"""


class PrintSystem:
    """A folder in which ``lp`` leaves what it was given, and finds what it should answer."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        (folder / "queues").write_text("envelopes\nlaser\n")
        (folder / "default").write_text("no system default destination\n")

    def fail(self, call: int, words: str) -> None:
        (self.folder / f"fail-{call}").write_text(words)

    def call(self, number: int) -> list[str]:
        return (self.folder / f"call-{number}.txt").read_text().splitlines()

    @property
    def calls(self) -> int:
        return len(list(self.folder.glob("call-*.txt")))

    def pdf(self, number: int) -> Path:
        return self.folder / f"job-{number}.pdf"


def install(folder: Path, monkeypatch: pytest.MonkeyPatch) -> PrintSystem:
    programs = folder / "bin"
    programs.mkdir()
    for name, script in (("lp", _LP), ("lpstat", _LPSTAT)):
        (programs / name).write_text(script)
        (programs / name).chmod(0o755)
    monkeypatch.setenv("PATH", f"{programs}{os.pathsep}{os.environ['PATH']}")
    monkeypatch.setenv("FAKE", str(folder))
    return PrintSystem(folder)


def rule(text, layout, row):
    """A 'hand' that writes every line as a straight stroke of a length of its own; it knows no £."""
    if "£" in text:
        raise MissingCharacters("The hand has no form for '£'.")
    top, left = layout.margin[0], layout.margin[3]
    strokes = []
    for n, line in enumerate(text.split("\n")):
        y = top + layout.x_height * 2 + n * layout.line_spacing
        x = np.array([left, left + len(line) * layout.x_height * 0.9])
        strokes.append(Stroke(np.array([n, n + 0.5]), np.column_stack([x, [y, y]])))
    return Drawing(tuple(strokes), layout.page, {"row": row})


def block(drawing, dpi):
    """An 'ink' that fills the bounds of the drawing with a dark colour, as a raster no larger than that."""
    x0, y0, x1, y1 = drawing.bounds
    scale = dpi / 25.4
    height, width = max(1, round((y1 - y0) * scale)), max(1, round((x1 - x0) * scale))
    rgba = np.zeros((height, width, 4), dtype=np.float32)
    rgba[...] = (0.1, 0.2, 0.3, 1.0)
    return Raster(rgba, dpi, (x0, y0))


def rows(count, **changed):
    """`count` good rows, numbered from 2; `changed` gives rows by name: ``r4={"problem": "…"}``."""
    table = []
    for n in range(2, count + 2):
        given = {"lines": (f"Name {n}", f"Street {n}", "01067 Dresden", "GERMANY")} | changed.get(f"r{n}", {})
        table.append(TableRow(n, **given))
    return table


def print_all(table, write, profile, page, *, ink=block, select="", copies=1, again="", out=None, **given):
    """Address an envelope for every row and print it, or write it to a file; `write` gets text, layout and number."""
    record, x_height = given.pop("journal", None) or Journal(), given.pop("x_height", None)
    tell = given.pop("tell", silent)
    options = BatchOptions(select, copies, again, out, given.pop("all_or_none", False))
    chosen_rows(table, options, record.resumed)
    address_layout(page, 1, 1, x_height)
    way = PrinterWay(profile, lambda page: profile, given.pop("about", {}), resumed=record.resumed, **given)

    def envelope(row):
        layout = address_layout(page, len(row.lines), max(map(len, row.lines)), x_height)
        drawing = write("\n".join(row.lines), layout, row.number)
        return [BatchPage(ENVELOPE, drawing, partial(ink, drawing), file=partial(drawing_file, drawing))]

    with destination(way, options, [page]) as place:
        make = partial(map, partial(prepare_row, envelope, place.prepare))
        return make_rows(table, make, place, options, record, tell=tell)
