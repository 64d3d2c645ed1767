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
import sys
import time
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.haines_2016 import by_chain
from handout.alphabet import SPACE
from handout.scanning.written_page import WrittenPage, read_page
from handout.tagging.alignment import AlignedLine, Alignment, Method, PageLetter, align
from handout.tagging.segmentation import by_segments, by_segments_once
from handout.tagging.transcript import read_transcript

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


def is_right(
    line: AlignedLine, letter: PageLetter, true: Sequence[Any], page: Mapping[str, Any], outer: Sequence[bool]
) -> bool:
    """Whether a letter was found.

    true : its name, and x of its ends on the baseline, pixels.
    outer : whether nothing of its word is before it, and after it.
    """
    slant, x_height, (a, b) = page["slant_dx_per_up"], page["x_height_px"], page["baseline_y"]
    frame, unit = line.frame, x_height / 20
    name, *ends = true
    want = [x + slant * _HALF * x_height for x in ends]
    # both slants and both baselines differ a little: compared at the same height of the page
    height = [float(frame.base(x)) - (a + b * end - _HALF * x_height) for x, end in zip(want, ends, strict=True)]
    found = [x + frame.slant * h for x, h in zip((letter.left, letter.right), height, strict=True)]
    width = want[1] - want[0]
    usual = max(width / 3, 3 * unit)
    allowed = [max(8 * unit, usual) if name in _MARKS else max(0.6 * width, usual) if end else usual for end in outer]
    near = all(abs(x - y) <= most for x, y, most in zip(found, want, allowed, strict=True))
    return near and want[0] - 2 * unit <= sum(found) / 2 <= want[1] + 2 * unit


def share(alignment: Alignment, lines: Sequence[str], truth: Mapping[str, Any]) -> float:
    """Per cent of the letters of a page that were found; one on another line than its own was not."""
    every = [(line, letter) for line in alignment.lines for letter in line.letters]
    written = read_transcript("\n".join(lines))
    counts = [sum(letter != SPACE for letter in line.letters) for line in written]
    good = []
    for true in truth["lines"]:
        number, page = true["line"] - 1, {**truth, "baseline_y": true["baseline_y"]}
        letters = [" ", *written[number].letters, " "]
        outer = [
            (a == SPACE, c == SPACE) for a, b, c in zip(letters, letters[1:], letters[2:], strict=False) if b != SPACE
        ]
        first = sum(counts[:number])
        own = every[first : first + counts[number]]
        for (line, letter), each, ends in zip(own, true["letters"], outer, strict=True):
            good.append(line.number == number and is_right(line, letter, each, page, ends))
    return 100 * float(np.mean(good))


def _variants(page: WrittenPage, lines: list[str]) -> Iterator[tuple[str, Alignment, float]]:
    """Name, alignment and CPU seconds of every way of aligning a page."""
    text = "\n".join(lines)
    methods: dict[str, Method] = {
        "segments": by_segments, "segments-once": by_segments_once, "haines_2016": by_chain,
    }  # fmt: skip
    for name, method in methods.items():
        begin = time.process_time()
        yield name, align(page, text, method=method, rng=np.random.default_rng(1)), time.process_time() - begin
    begin = time.process_time()
    free = align(page, re.sub(r"\s+", " ", text), method=by_segments_once, rng=np.random.default_rng(1))
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
            table.setdefault(variant, []).append((share(alignment, lines, page), seconds))
            print(f"{name}: {variant}: {table[variant][-1][0]:.1f} % in {seconds:.1f} s", file=sys.stderr, flush=True)
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
