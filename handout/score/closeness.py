"""How far made writing is from its author, in units of how far the author is from himself.

Half of the author's lines, drawn at random, is compared with his other half, and as much of the made writing with as
much of his: distances between histograms shrink with the amount of ink, so all amounts are the same.  The ratio is 1
for writing that is his.  Goal: hinge at most 1.5 (handwriting specification, "Measuring likeness without people").
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from handout.errors import InputError
from handout.score.crowd import KINDS, Distance, distance, mean
from handout.score.measured import MeasuredLine, pooled

DRAWS = 24
LEAST = 4  # lines: with fewer a half is one line


@dataclass(frozen=True)
class Closeness:
    """Means over random draws.

    own : between halves of the author's lines.
    across : between as much of the author's lines and of the made ones.
    lines, made : how many lines there were.
    draws : how many draws; where they all hold the same lines, fewer.
    """

    own: Distance
    across: Distance
    lines: int
    made: int
    draws: int

    @property
    def ratio(self) -> Distance:
        """`across` over `own`, of each kind."""
        return Distance(*(getattr(self.across, kind) / max(getattr(self.own, kind), 1e-9) for kind in KINDS))


def half_to_half(
    lines: Sequence[MeasuredLine], rng: np.random.Generator, *, draws: int = DRAWS, amount: float = np.inf
) -> list[Distance]:
    """Distances between random halves of an author's lines.

    Parameters
    ----------
    lines : at least `LEAST`.
    amount : contour points of either half, if less than half of all.

    Raises
    ------
    InputError
        Too few lines.
    """
    if len(lines) < LEAST:
        raise InputError(f"There are {len(lines)} lines, and comparing halves needs at least {LEAST}.")
    found = []
    for _ in range(draws):
        order = rng.permutation(len(lines))
        one, other = ([lines[i] for i in part] for part in (order[::2], order[1::2]))
        found.append(distance(pooled(_as_much(one, amount)), pooled(_as_much(other, amount))))
    return found


def closeness(
    real: Sequence[MeasuredLine],
    made: Sequence[MeasuredLine],
    rng: np.random.Generator,
    *,
    author: Sequence[MeasuredLine] | None = None,
    draws: int = DRAWS,
) -> Closeness:
    """How far made lines are from real ones of their author.

    Parameters
    ----------
    real : lines that the made ones are compared with: none that they were made from.
    made : lines of writing in that hand.
    author : all lines of the author that there are, for the distance between halves; by default `real`.

    Raises
    ------
    InputError
        Fewer than `LEAST` lines of the author, or none that were made.
    """
    author = real if author is None else author
    if not real or not made:
        raise InputError("There is no line to compare.")
    half = sum(line.amount for line in author) / 2
    amount = min(half, *(sum(line.amount for line in lines) for lines in (real, made)))
    own = half_to_half(author, rng, draws=draws, amount=amount)
    across = []
    for _ in range(draws):
        one, other = ([lines[i] for i in rng.permutation(len(lines))] for lines in (real, made))
        across.append(distance(pooled(_as_much(one, amount)), pooled(_as_much(other, amount))))
    return Closeness(mean(own), mean(across), len(author), len(made), draws)


def _as_much(lines: Sequence[MeasuredLine], amount: float) -> Sequence[MeasuredLine]:
    """The first lines that come nearest to an amount of contour points together, one at least."""
    total = np.cumsum([line.amount for line in lines])
    return lines[: int(np.argmin(np.abs(total - amount))) + 1] if np.isfinite(amount) else lines
