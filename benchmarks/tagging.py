"""How many letters of real pages the tagger finds, against 533 letters whose places were read by eye.

Needs the folder of real scans: HANDOUT_DATA names it (``scans/letters.json`` and the pages and transcripts beside it).
A letter is right when both its ends lie within a third of its width, or 3/20 of an x-height, and its middle lies inside
it; at the outer ends of words 0.6 of the width is allowed (where a last stroke ends is a matter of taste), for marks
8/20 of an x-height.
"""

from __future__ import annotations

import json
import os
import re
import time
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from handout.scanning.reading import WrittenPage, read_page
from handout.tagging.align import METHODS, align
from handout.tagging.alignment import AlignedLine, Alignment

GOALS = {"0013_1": 96, "0012_1": 96, "w0122": 96, "w0180": 96, "w0238": 93}
GOAL_SECONDS = 20
_DPI = 300
_HALF = 0.5  # x-heights over the baseline, where ends are compared
_MARKS = ".,:;'\""


def transcript(folder: Path, page: str) -> list[str]:
    """The lines of a page as they were read by eye."""
    text = (folder / "TRANSCRIPTS.md").read_text(encoding="utf-8")
    part = text.split(f"## {page}", 1)[1].split("\n", 1)[1].split("\n## ", 1)[0]
    return [line.strip() for line in part.strip().splitlines() if line.strip()]


def right(line: AlignedLine, true: Mapping[str, Any], slant: float, x_height: float) -> Iterator[bool]:
    """For every letter of a line whether it was found."""
    frame, unit = line.frame, x_height / 20
    a, b = true["baseline_y"]
    words = "".join(" " if letter == " " else "x" for letter in true["text"])
    at = [i for i, letter in enumerate(words) if letter != " "]
    for place, letter, (name, left, end) in zip(at, line.letters, true["letters"], strict=True):
        want = [x + slant * _HALF * x_height for x in (left, end)]
        # both slants and both baselines differ a little: compared at the same height of the page
        level = [a + b * x - _HALF * x_height for x in (left, end)]
        height = [float(frame.base(x)) - y for x, y in zip(want, level, strict=True)]
        found = [x + frame.slant * h for x, h in zip((letter.left, letter.right), height, strict=True)]
        width = want[1] - want[0]
        usual = max(width / 3, 3 * unit)
        allowed = []
        for beside in (place - 1, place + 1):
            outer = not 0 <= beside < len(words) or words[beside] == " "
            allowed.append(max(8 * unit, usual) if name in _MARKS else max(0.6 * width, usual) if outer else usual)
        off = [abs(x - y) for x, y in zip(found, want, strict=True)]
        middle = sum(found) / 2
        yield all(o <= most for o, most in zip(off, allowed, strict=True)) and (
            want[0] - 2 * unit <= middle <= want[1] + 2 * unit
        )


def share(alignment: Alignment, truth: Mapping[str, Any]) -> float:
    """Per cent of the letters of a page that were found."""
    lines = {line.number: line for line in alignment.lines}
    good = [
        hit
        for true in truth["lines"]
        for hit in right(lines[true["line"] - 1], true, truth["slant_dx_per_up"], truth["x_height_px"])
    ]
    return 100 * float(np.mean(good))


def _variants(page: WrittenPage, lines: list[str]) -> Iterator[tuple[str, Alignment, float]]:
    """Name, alignment and CPU seconds of every way of aligning a page."""
    text = "\n".join(lines)
    for method in METHODS:
        begin = time.process_time()
        yield method, align(page, text, method=method, rng=np.random.default_rng(1)), time.process_time() - begin
    begin = time.process_time()
    free = align(page, re.sub(r"\s+", " ", text), method="segments-once", rng=np.random.default_rng(1))
    yield "segments-once, line breaks unknown", free, time.process_time() - begin


def main() -> None:
    """Print a table: pages across, ways of aligning down."""
    folder = Path(os.environ.get("HANDOUT_DATA", "")) / "scans"
    if not (folder / "letters.json").is_file():
        print("Set HANDOUT_DATA to a folder that has scans/letters.json, the scans and their transcripts.")
        return
    truth = json.loads((folder / "letters.json").read_text(encoding="utf-8"))
    table: dict[str, list[tuple[float, float]]] = {}
    for name, page in truth.items():
        path = folder / name
        lines = transcript(path.parent, path.stem + (".png" if path.parent.name == "cvl" else ""))
        read = read_page(path, _DPI, lines=len(lines))
        for variant, alignment, seconds in _variants(read, lines):
            table.setdefault(variant, []).append((share(alignment, page), seconds))
    print(
        f"{'letters right, %':<42}"
        + "".join(f"{Path(name).stem.split('_s0')[0]:>9}" for name in truth)
        + "     mean  s/page"
    )
    for variant, found in table.items():
        row = "".join(f"{good:9.1f}" for good, _ in found)
        mean, spent = np.mean(found, axis=0)
        print(f"{variant:<42}{row}{mean:9.1f}{spent:8.1f}")
    print(f"goals: {', '.join(f'{page} {goal}' for page, goal in GOALS.items())}; {GOAL_SECONDS} s of CPU a page")
