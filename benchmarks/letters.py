"""How well a scanned page's letters are found, measured where the truth is known: on pages of the simulated author.

Letters: share of those whose name is right, where most of their line is given to a letter (in brackets: to that very
letter, not to an equal one beside it).  Splits: share of the places between joined letters that are found within .15
rule heights (in brackets: within .25), and share of the found ones that are true.  CPU seconds a megapixel, for ink,
path and rules, then for letters.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import AbstractContextManager
from unittest.mock import patch

import numpy as np

from benchmarks.haines_2016 import by_chain
from benchmarks.reading import BY_HYSTERESIS, HANDS, PENS, written
from handout.scanning.written_page import WrittenPage
from handout.tagging.alignment import Method
from handout.tagging.page_tagging import tag_page
from handout.tagging.segmentation import by_segments, by_segments_once
from handout_lab.author import page_score
from handout_lab.author.truth import Simulated

RESOLUTIONS = (300, 600)
LETTERS, SPLITS = 0.97, 0.95  # goals


def read(simulated: Simulated) -> tuple[WrittenPage, float]:
    """The page read, and the CPU seconds of it."""
    begin = time.process_time()
    return page_score.read(simulated), time.process_time() - begin


def row(name: str, simulated: Simulated, page: tuple[WrittenPage, float], method: Method = by_segments) -> str:
    """A line of the table; ! marks what misses its goal."""
    begin = time.process_time()
    made = tag_page(page[0], page_score.transcript(simulated), rng=np.random.default_rng(1), method=method)
    seconds = time.process_time() - begin
    score = page_score.score(simulated.truth, made)
    split = score.splits
    flags = ["!" if missed else " " for missed in (score.right < LETTERS, split.placed < SPLITS)]
    size = simulated.truth.labels.size / 1e6
    return (
        f"{name:<32} {score.right:.3f}{flags[0]}({score.identity:.3f})  {split.placed:.3f}{flags[1]}"
        f"({split.recall:.3f}) {split.precision:.3f}  {page[1] / size:5.2f} {seconds / size:5.2f}"
    )


def ablations() -> Iterator[tuple[str, AbstractContextManager[object]]]:
    """Name, and what is changed while the page is read."""
    yield "no smoothing", patch("handout.scanning.mask.smooth", lambda ink: ink)
    yield "hysteresis for the cut", BY_HYSTERESIS


def main() -> None:
    """Print the table, then what single steps are worth."""
    print(f"{'':<32} letters right  splits placed true   CPU s/MP: ink, letters")
    for dpi in RESOLUTIONS:
        for pen in PENS:
            for hand in HANDS:
                simulated = written(pen, hand, dpi)
                print(row(f"{dpi} {pen} {hand}", simulated, read(simulated)), flush=True)
    for pen in ("ballpoint", "pencil"):
        steps(pen)


def steps(pen: str) -> None:
    """What single steps are worth on one page."""
    simulated = written(pen, HANDS[0], RESOLUTIONS[0])
    page, name = read(simulated), f"{RESOLUTIONS[0]} {pen}"
    print(row(f"{name} all steps", simulated, page), flush=True)
    print(row(f"{name} no self-training", simulated, page, by_segments_once), flush=True)
    print(row(f"{name} chain haines_2016", simulated, page, by_chain), flush=True)
    for change, changed in ablations():
        with changed:
            page = read(simulated)
        print(row(f"{name} {change}", simulated, page), flush=True)
