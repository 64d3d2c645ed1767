"""One page held against another: the author's against one that was made in his hand."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from handout.errors import InputError
from handout.score.closeness import Closeness, closeness
from handout.score.measured import full_lines, measure_lines
from handout.score.two_sample import TwoSample, two_sample


@dataclass(frozen=True)
class Comparison:
    """What can be said of a made page, line by line.

    closeness : how far it is from the author, in units of his own halves; None with too few lines.
    test : whether a classifier tells the lines apart; None with too few lines.
    notes : sentences that say what could not be measured, and why.
    """

    closeness: Closeness | None
    test: TwoSample | None
    notes: tuple[str, ...]


def compare(real: NDArray[np.uint8], made: NDArray[np.uint8], rng: np.random.Generator) -> Comparison:
    """Hold a made page against its author's.

    Parameters
    ----------
    real, made : (h, w) uint8, dark ink on light paper, at about 300 dpi.

    Raises
    ------
    InputError
        No written line can be told on one of the pages.
    """
    lines = full_lines(measure_lines(real)), full_lines(measure_lines(made))
    notes: list[str] = []
    near: Closeness | None = None
    test: TwoSample | None = None
    try:
        near = closeness(*lines, rng)
    except InputError as error:
        notes.append(str(error))
    try:
        test = two_sample(*lines, rng)
    except InputError as error:
        notes.append(str(error))
    return Comparison(near, test, tuple(notes))
