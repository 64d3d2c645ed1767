"""One page held against another: the author's against one that was made in his hand."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from handout.errors import InputError
from handout.score.closeness import Closeness, closeness
from handout.score.measured import MeasuredLine, full_lines
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


def compare(real: Sequence[MeasuredLine], made: Sequence[MeasuredLine], rng: np.random.Generator) -> Comparison:
    """Hold a made page against its author's.

    Parameters
    ----------
    real, made : their lines, as `measured.measure_lines` gives them; short ones are left out here.
    """
    lines = full_lines(real), full_lines(made)
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
