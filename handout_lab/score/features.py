"""What is measured of a page and of each of its lines, and how far two pages are apart.

The three histograms of a page are those of writer identification: `hinge`, `quill`, `run_lengths`.  A measure of
likeness is added here: as a field of `PageFeatures`, `LineFeatures` and `Distance`, and a name in `KINDS`.  What ink
belongs to which line is told as it is for a scan (`scanning.text_lines`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from handout.errors import InputError
from handout.scanning.text_lines import line_owners
from handout.values import Array
from handout_lab.score.hinge import chi_square, hinge, hinge_counts
from handout_lab.score.quill import quill, quill_counts
from handout_lab.score.run_lengths import run_counts, run_distance, runs
from handout_lab.score.statistics import line_figures
from handout_lab.score.written_lines import WrittenLine, find_lines, find_words, ink

KINDS = ("hinge", "runs", "quill")
_SHORT = 0.35  # of the usual ink of a line: the last word of a paragraph


@dataclass(frozen=True, eq=False)
class PageFeatures:
    """What is compared of a page: `hinge` (24, 24), `runs` (4, 60), `quill` (24, 20), see the modules so named."""

    hinge: Array
    runs: Array
    quill: Array


@dataclass(frozen=True)
class Distance:
    """Two pages compared: χ² of `hinge` and `quill`, mean χ² of the run lengths, all 0–1."""

    hinge: float
    runs: float
    quill: float


def page_features(mask: NDArray[np.bool_]) -> PageFeatures:
    """Measure the ink (h, w) of a page at about 300 dpi.

    Raises
    ------
    InputError
        Less ink than a word has.
    """
    rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    if not len(rows):
        raise InputError("There is no ink on the page: nothing can be compared.")
    part = mask[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1]
    bends = hinge(part)
    if not bends.any():
        raise InputError("There is too little ink on the page to compare: it needs at least a word.")
    return PageFeatures(bends, runs(part), quill(part))


def distance(a: PageFeatures, b: PageFeatures) -> Distance:
    """How far two pages are from each other; the order does not matter."""
    return Distance(chi_square(a.hinge, b.hinge), run_distance(a.runs, b.runs), chi_square(a.quill, b.quill))


def least(distances: Sequence[Distance]) -> Distance:
    """The least of each kind."""
    return Distance(*(min(getattr(d, kind) for d in distances) for kind in KINDS))


def mean(distances: Sequence[Distance]) -> Distance:
    """The mean of each kind."""
    return Distance(*(float(np.mean([getattr(d, kind) for d in distances])) for kind in KINDS))


@dataclass(frozen=True, eq=False)
class LineFeatures:
    """One written line, measured.

    hinge : (24, 24) counts of contour points; runs : (4, 60) counts of runs; quill : (24, 20) counts.
    figures : (k,) what a ruler says of it, see `statistics.line_figures`.
    """

    hinge: Array
    runs: Array
    quill: Array
    figures: Array

    @property
    def amount(self) -> float:
        """Contour points: how much there is to measure."""
        return float(self.hinge.sum())


def measure_lines(grey: NDArray[np.uint8]) -> list[LineFeatures]:
    """The lines of a page from top to bottom, measured.

    Parameters
    ----------
    grey : (h, w) uint8, dark ink on light paper, at about 300 dpi.

    Raises
    ------
    InputError
        No written line can be told on the page.
    """
    mask = ink(grey)
    page = find_lines(mask)
    lines = find_words(mask, page.lines, page.x_height, page.slant) if page.lines else []
    if not lines:
        raise InputError(
            "No written line can be told on the page: it needs at least a line of dark ink on light paper."
        )
    owner = line_owners(mask, lines)
    measured = [_measured(grey, owner == i, line, page.x_height, page.slant) for i, line in enumerate(lines)]
    return [line for line in measured if line is not None]


def full_lines(lines: Sequence[LineFeatures]) -> list[LineFeatures]:
    """Without those far shorter than the others: the last words of paragraphs."""
    usual = float(np.median([line.amount for line in lines])) if lines else 0.0
    return [line for line in lines if line.amount >= _SHORT * usual]


def pool_lines(parts: Sequence[LineFeatures]) -> PageFeatures:
    """What is compared of a page, of some lines together."""
    hinge, runs, quill = (
        np.sum([getattr(part, kind) for part in parts], axis=0) for kind in ("hinge", "runs", "quill")
    )
    return PageFeatures(
        hinge / max(float(hinge.sum()), 1.0),
        runs / np.maximum(runs.sum(axis=1, keepdims=True), 1.0),
        quill / max(float(quill.sum()), 1.0),
    )


def _measured(
    grey: NDArray[np.uint8], ink: NDArray[np.bool_], line: WrittenLine, x_height: float, slant: float
) -> LineFeatures | None:
    """One line from its own ink (h, w); None where there is too little."""
    rows, columns = np.flatnonzero(ink.any(axis=1)), np.flatnonzero(ink.any(axis=0))
    if not len(rows):
        return None
    box = (slice(rows[0], rows[-1] + 1), slice(columns[0], columns[-1] + 1))
    top, left = float(rows[0]), float(columns[0])
    moved = replace(
        line,
        curve=(line.curve[0] - top, *line.curve[1:]),
        left=line.left - left,
        right=line.right - left,
        words=tuple((a - left, b - left) for a, b in line.words),
    )
    mask = ink[box]
    bends = hinge_counts(mask)
    if not bends.any():
        return None
    figures = line_figures(grey[box], mask, moved, x_height, slant)
    return LineFeatures(bends, run_counts(mask), quill_counts(mask), np.array(list(figures.values())))
