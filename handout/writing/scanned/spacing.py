"""How far apart letters stand: from centre to centre, by what each had beside it in the source.

What is kept of a pair is its clearance: how near its two bodies, without their ligatures, come at any one height,
measured level in the upright frame, where the slant of the hand is taken out.  The clearance is predicted, and the
distance of the centres follows from the shapes, so that an l after an m neither collides nor gapes.  On held-out pairs
of real hands this errs by a tenth to a third less than the distance of the centres, and in three of four less than any
edges in a band do.  Between words the strokes that are left loose count too, and at a height all that is near it.

Source: seed 000, §6.3.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from handout.values import Array, Indices
from handout.writing.scanned.beside import Beside
from handout.writing.scanned.forms import Forms
from handout.writing.scanned.joining import matches, meets
from handout.writing.scanned.sides import LETTERS, MARKS, WORDS, Sides, apart, sides

_MARGIN = 0.15  # of the difference of two estimates, and of the usual spread, that the range is widened by
_EVEN = 0.02  # line space: ligatures are never trusted further than this
_PUSHES = 2
_ENOUGH = 8  # pairs that tell what is usual
# mean, deviation, least and most of hands that show too few
_USUAL = [[0.05, 0.3, 0.03], [0.05, 0.08, 0.05], [0.0, 0.15, -0.05], [0.2, 0.6, 0.2]]
_SHARE = 2.0  # per cent: clearances outside these percentiles are slips of the pen or of the reading
_NARROW = 4.0  # per cent: the same of the gaps between words over all heights, where cut strokes are in the way


@dataclass(frozen=True, eq=False)
class Gaps:
    """What a hand's clearances are, for each kind of pair: see `sides`.

    mean, deviation, low, high : (3,) float: of all of them; `low` and `high` are the least and the most it ever has.
    to_right, to_left : (3, n) float: what every glyph had on either side in the source, nan where nothing.
    word : the least that two words are apart over all heights; they were one to the eye if each height had its own.
    """

    mean: Array
    deviation: Array
    low: Array
    high: Array
    to_right: Array
    to_left: Array
    word: float


@dataclass(frozen=True, eq=False)
class Spacing:
    """How a hand spaces its letters; line space.

    lean : (n,) float: how much further right each centre stands than its foot, for the slant of the hand.
    least : how far the ink of two bodies in a word is apart at the least.
    """

    forms: Forms
    sides: Sides
    lean: Array
    gaps: Gaps
    least: float

    def between(
        self, numbers: Indices, new_word: NDArray[np.bool_], rng: np.random.Generator, variation: float
    ) -> Array:
        """(n − 1,): see `gaps`."""
        first, second = numbers[:-1], numbers[1:]
        kind = kinds(self.forms, first, second, new_word[1:])
        estimates = np.stack([self.gaps.to_right[kind, first], self.gaps.to_left[kind, second]])
        usual, spread = self.gaps.mean[kind], self.gaps.deviation[kind]
        wanted = _drawn(estimates, usual, spread, rng, variation)
        low, high = self.gaps.low[kind], self.gaps.high[kind]
        # what two neighbours of the source had is theirs, be it more or less than is usual
        own = estimates[0] == estimates[1]
        held = np.where(own, wanted, np.clip(wanted, low, high))
        upright = held - self.sides.clearance(first, second, kind)
        parted = ~own & (kind == WORDS)
        upright[parted] += np.maximum(self.gaps.word - upright - self.sides.between(first, second), 0.0)[parted]
        away = upright + self.lean[second] - self.lean[first]
        for k in np.flatnonzero(~own & (kind != WORDS)):
            i, j = int(first[k]), int(second[k])
            reach = away[k] + np.array([low[k] - held[k], high[k] - held[k]])
            away[k] = np.clip(self._met(i, j, float(away[k])), *reach)
            away[k] += self._short(i, j, float(away[k]))
        return np.asarray(away)

    def _met(self, first: int, second: int, away: float) -> float:
        """A distance and that at which the ligatures meet, each as far as it can be trusted."""
        forms = self.forms[first], self.forms[second]
        found = [meets(forms[0].exits[i], forms[1].entries[j]) for i, j in matches(*forms)]
        if not found:
            return away
        ours = [max(deviation, _EVEN) ** -2.0 for _, deviation in found]
        theirs = float(self.gaps.deviation[LETTERS]) ** -2.0
        met = float(np.dot(ours, [distance for distance, _ in found]))
        return float((met + theirs * away) / (sum(ours) + theirs))

    def _short(self, first: int, second: int, away: float) -> float:
        """What two letters must still be moved apart, since ink may meet from below too."""
        rise = self.forms.centre[second, 1] - self.forms.centre[first, 1]
        more = 0.0
        for _ in range(_PUSHES):
            shift = np.array([away + more, rise])
            more += max(self.least - apart(self.forms[first], self.forms[second], shift), 0.0)
        return more


def _drawn(estimates: Array, mean: Array, deviation: Array, rng: np.random.Generator, variation: float) -> Array:
    """(n,): between two estimates, the one that there is, or from the Gaussian of all."""
    uniform, normal = rng.uniform(-1, 1, len(mean)), rng.standard_normal(len(mean))
    low, high = np.fmin(*estimates), np.fmax(*estimates)
    reach = (high - low) / 2 * (1 + _MARGIN) + _MARGIN * deviation / 2
    drawn = (low + high) / 2 + variation * uniform * reach
    return np.where(np.isnan(low), mean + variation * normal * deviation, drawn)


def spacing(forms: Forms, beside: Beside) -> Spacing:
    """How a hand spaces its letters, from its pages."""
    slant = float(np.mean([page.slant for page in forms.hand.pages]))
    beyond = sides(forms, slant)
    lean = slant * forms.centre[:, 1]
    found = [
        apart(forms[int(i)], forms[int(j)], forms.centre[j] - forms.centre[i]) for i, j in beside.pairs(parted=False)
    ]
    least = max(float(np.percentile(found, _SHARE)), 0.0) if found else 0.0
    return Spacing(forms, beyond, lean, _gaps(forms, beyond, beside, forms.centre[:, 0] - lean), least)


def kinds(forms: Forms, first: Indices, second: Indices, parted: NDArray[np.bool_]) -> Indices:
    """(n,) int: of what kind pairs of glyphs are."""
    return np.where(parted, WORDS, np.where(forms.marks[first] | forms.marks[second], MARKS, LETTERS))


def _gaps(forms: Forms, beyond: Sides, beside: Beside, x: Array) -> Gaps:
    """The clearances of the source; where a hand shows none, a usual one."""
    to_right, to_left = np.full((2, 3, len(x)), np.nan)
    mean, deviation, low, high = np.array(_USUAL)
    word = float(low[WORDS])
    first, second = np.concatenate([beside.pairs(parted=False), beside.pairs(parted=True)]).T
    kind = kinds(forms, first, second, beside.parted[second])
    found = x[second] - x[first] + beyond.clearance(first, second, kind)
    to_right[kind, first], to_left[kind, second] = found, found
    for one in (LETTERS, WORDS, MARKS):
        own = found[kind == one]
        if len(own) >= _ENOUGH:
            low[one], high[one] = np.percentile(own, [_SHARE, 100 - _SHARE])
            kept = np.clip(own, low[one], high[one])
            mean[one], deviation[one] = kept.mean(), kept.std()
            if one == WORDS:
                level = (x[second] - x[first] + beyond.between(first, second))[kind == one]
                word = float(np.percentile(level, _NARROW))
        elif len(own):
            low[one], high[one] = min(low[one], own.min()), max(high[one], own.max())
    return Gaps(mean, deviation, low, high, to_right, to_left, word)
