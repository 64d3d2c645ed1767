"""Loops and bowls, which hands write one way round.

A loop of l or d goes up on its right and comes down on its left, and so do the bowls of a and o; the tail of g or y
goes down on its right and comes up on its left.  The two lines of a narrow one part so smoothly that how they go on
does not tell which is which.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from handout.hand.letter_classes import BOWLED, LOOPED_ABOVE, LOOPED_BELOW
from handout.motion.recovery.network import Network

_HIGH = 0.6  # of such a letter's height, above which the middle of such a loop is
_ABOVE, _BELOW = 0.95, -0.05  # of a small letter: where loops of stems and of tails are
_LEAST = 6.0  # square half widths: what encloses less is a line gone over twice


def amiss(net: Network, strokes: Sequence[Sequence[int]], letter: str, base: float | None, small: float) -> int:
    """How many loops are the wrong way round.

    Parameters
    ----------
    strokes : for each the ends by which the pen leaves one knot after the other.
    base : height of the line that the letter stands on, None where that is not known.
    small : height of a small letter, in the unit of the network.
    """
    if base is None and letter not in LOOPED_BELOW | BOWLED | LOOPED_ABOVE:
        return 0
    stem = np.inf if base is None else base + _ABOVE * small
    if letter in LOOPED_ABOVE and base is None:
        heights = np.concatenate([net.xy[path, 1] for path in net.branches])
        low, high = float(heights.min()), float(heights.max())
        stem = low + _HIGH * (high - low)
    wrong, knots = 0, net.knot.tolist()
    for stroke in strokes:
        seen: dict[int, int] = {}
        for step, end in enumerate(stroke):
            knot = knots[end]
            first = seen.get(knot)
            if first is not None:
                wrong += _wrong([net.extent(e) for e in stroke[first:step]], net.half, letter, base, stem, small)
            seen[knot] = step
        last = knots[stroke[-1] ^ 1]
        if last in seen:
            wrong += _wrong([net.extent(e) for e in stroke[seen[last] :]], net.half, letter, base, stem, small)
    return wrong


def _wrong(
    branches: Sequence[tuple[float, float, float]],
    half: float,
    letter: str,
    base: float | None,
    above: float,
    small: float,
) -> bool:
    """Whether a loop over some branches, measured, is the wrong way round; loops of stems are above a height."""
    middle = (min(low for low, _, _ in branches) + max(high for _, high, _ in branches)) / 2
    tail = letter in LOOPED_BELOW and (base is None or middle < base + _BELOW * small)
    stem = middle > above
    if (base is None and tail) or not (tail or stem or letter in BOWLED):
        return False
    area = sum(twice for _, _, twice in branches) / 2
    if abs(area) < _LEAST * half**2:
        return False
    return area > 0 if tail else area < 0
