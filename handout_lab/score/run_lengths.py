"""Run lengths: how thick the line is and how wide the white between lines, across and down the page.

Four distributions: runs of ink and of paper, along rows and along columns.  Runs of paper that reach the edge of the
writing are left out, and so are those longer than `LONGEST`: they are gaps between words and lines, and tell of the
layout, not of the hand.

Source: after M. Bulacu, L. Schomaker, 2007, §4.4 (run-length distributions of white); those of ink are added since
they measure the pen.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from handout.scanning.baselines import spans
from handout.values import Array
from handout_lab.score.hinge import chi_square

LONGEST = 60  # pixels, 5 mm at 300 dpi: about two heights of a small letter
KINDS = ("ink across", "ink down", "paper across", "paper down")


def runs(mask: NDArray[np.bool_], longest: int = LONGEST) -> Array:
    """Distributions of the lengths of runs.

    Parameters
    ----------
    mask : (h, w) bool, True where there is ink, at about 300 dpi.
    longest : pixels; longer runs do not count.

    Returns
    -------
    (4, longest) float: for each of `KINDS`, the share of the runs of 1, 2, … pixels; a row sums to 1, or to 0
    where there is no run.
    """
    counts = run_counts(mask, longest)
    return np.asarray(counts / np.maximum(counts.sum(axis=1, keepdims=True), 1.0))


def run_counts(mask: NDArray[np.bool_], longest: int = LONGEST) -> Array:
    """How many runs of `KINDS` have 1, 2, … pixels, (4, longest): those of several pieces may be added up."""
    rows: list[Array] = []
    for ink in (mask, mask.T):
        line, begin, end = spans(ink)
        gap = (begin[1:] - end[:-1])[line[1:] == line[:-1]]
        rows += [_counts(end - begin, longest), _counts(gap, longest)]
    return np.stack([rows[0], rows[2], rows[1], rows[3]])


def run_distance(a: Array, b: Array) -> float:
    """Mean of the χ² distances of the four distributions: 0 for the same, 1 for four that share no length."""
    return float(np.mean([chi_square(first, other) for first, other in zip(a, b, strict=True)]))


def _counts(lengths: NDArray[np.intp], longest: int) -> Array:
    return np.bincount(lengths[lengths <= longest], minlength=longest + 1)[1:].astype(np.float64)
