"""Which text is on which line, and whether it is there at all."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from handout.errors import InputError
from handout.tagging.alphabet import JUNK, SPACE
from handout.tagging.decoder import Decoded, Reading, decode, in_a_row
from handout.tagging.features import STEP
from handout.tagging.transcript import Written, in_one

_SHUFFLES = 3
# Measured on 79 lines of seven real pages: right texts 0.41 to 0.88; texts of other lines or pages, broken as suits
# them best, −0.08 to 0.27
POOR = 0.3  # fit of a line under which its text is reported
REFUSED = 0.25  # median fit of a page under which the transcript is refused


def chance(reading: Reading, line: Written, widths: Mapping[str, float], rng: np.random.Generator) -> float:
    """Score of the line's letters in another order, the words' lengths kept: mean of a few."""
    at = [i for i, letter in enumerate(line.letters) if letter not in (SPACE, JUNK)]
    scores = []
    for _ in range(_SHUFFLES):
        letters = list(line.letters)
        for i, j in zip(at, rng.permutation(at), strict=True):
            letters[i] = line.letters[j]
        scores.append(decode(reading, letters, widths).score)
    return float(np.mean(scores))


def fit(
    reading: Reading, line: Written, found: Decoded, widths: Mapping[str, float], rng: np.random.Generator
) -> float:
    """How far the line's text comes from chance, 0, to what would suit every column best, 1."""
    least = chance(reading, line, widths, rng)
    most = np.maximum(np.diff(reading.letters, axis=0).max(axis=1), np.diff(reading.space)).sum()
    return (found.score - least) / max(float(most) - least, 1e-6)


def broken_freely(readings: Sequence[Reading], lines: Sequence[Written], widths: Mapping[str, float]) -> list[Written]:
    """The text that stands on each line of the page, whatever the line breaks of the transcript; it may be none."""
    text = in_one(lines)
    row = in_a_row(readings)
    found = decode(row, text.letters, widths)
    middle = 0.5 * (found.left + found.right) / STEP
    owner = np.searchsorted(np.array(row.lines), middle, side="right") - 1
    parts = []
    for number in range(len(readings)):
        own = [i for i in np.flatnonzero(owner == number) if text.letters[i] != SPACE]
        parts.append(text.part(int(own[0]), int(own[-1]) + 1) if own else text.part(0, 0))
    return parts


def typical(fits: Sequence[float]) -> float:
    """The middle line's fit; 0 without lines."""
    return float(np.median(fits)) if len(fits) else 0.0


def check(fits: Sequence[float], counts: Sequence[int]) -> None:
    """Refuse a transcript that is not this page's.

    Raises
    ------
    InputError
        The middle line's text fits no better than any other would.
    """
    if typical(fits) < REFUSED:
        raise InputError(refusal(typical(fits), counts))


def refusal(fits: float, counts: Sequence[int]) -> str:
    """What is said of a transcript that fits so well a page with counts[0] lines; it has counts[1]."""
    return (
        f"The transcript does not seem to be this page's: its lines fit by {max(fits, 0):.0%}, where right ones have "
        f"40 % or more and another page's about 5 %. Check that it belongs to this scan; the page has {counts[0]} "
        f"lines of writing, the transcript {counts[1]}."
    )
