"""How far apart letters stand: from centre to centre, by what each had beside it in the source.

What is kept of a pair is its clearance: how near its two bodies, without their ligatures, come at any one height,
measured level in the upright frame, where the slant of the hand is taken out.  The clearance is predicted, and the
distance of the centres follows from the shapes, so that an l after an m neither collides nor gapes.  On held-out pairs
of real hands this errs by a tenth to a third less than the distance of the centres, and in three of four less than any
edges in a band do.  Between words the strokes that are left loose count too, and at a height all that is near it.

How far apart two words stand has nothing to do with the letters that they end and begin with: on the pages of seven
people what the same letter had elsewhere tells no more than what all had.  So it is drawn from all gaps of the pages,
and glyphs that are written often bring no gap of theirs along.

Source: seed 000, §6.3.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from handout.hand import measures
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
_HALF = 35.0  # per cent on either side of the middle: what word gaps are drawn from; the rest has reasons of its own
_SHARE = 2.0  # per cent: clearances outside these percentiles are slips of the pen or of the reading
_NARROW = 10.0  # per cent: the same of the gaps between words over all heights, where cut strokes are in the way
_OVER = 2  # letters at the end, and at the beginning, of a word that bars may reach across the gap from


@dataclass(frozen=True, eq=False)
class Gaps:
    """What a hand's clearances are, for each kind of pair: see `sides`.

    mean, deviation, low, high : (3,) float: of all of them; `low` and `high` are the least and the most it ever has.
    to_right, to_left : (3, n) float: what every glyph had on either side in the source, nan where nothing.
    words : (m,) float: the clearances of words, rising, without those before the last word of a line, which is bunched
        where the edge is near.
    word : the least that two words are apart over all heights; they were one to the eye if each height had its own.
    zone : the most that they are apart over the heights of small letters.
    """

    mean: Array
    deviation: Array
    low: Array
    high: Array
    to_right: Array
    to_left: Array
    words: Array
    word: float
    zone: float


@dataclass(frozen=True, eq=False)
class Spacing:
    """How a hand spaces its letters; line space.

    slant : dx/dy of the letters, upwards.
    lean : (n,) float: how much further right each centre stands than its foot, for the slant of the hand.
    least : how far the ink of two bodies in a word is apart at the least.
    """

    forms: Forms
    sides: Sides
    slant: float
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
        own = self.sourced(first, second, kind)
        parted = ~own & (kind == WORDS)
        estimates[:, parted] = self._word_gaps(int(parted.sum()), rng, variation)
        wanted = _drawn(estimates, usual, np.where(parted, 0.0, spread), rng, variation)
        low, high = self.gaps.low[kind], self.gaps.high[kind]
        held = np.where(own, wanted, np.clip(wanted, low, high))
        away = held - self.sides.clearance(first, second, kind) + self.lean[second] - self.lean[first]
        for k in np.flatnonzero(~own & (kind != WORDS)):
            i, j = int(first[k]), int(second[k])
            reach = away[k] + np.array([low[k] - held[k], high[k] - held[k]])
            away[k] = np.clip(self._met(i, j, float(away[k])), *reach)
            away[k] += self._short(i, j, float(away[k]))
        for k in np.flatnonzero(parted):
            away[k] = self._bounded(numbers, new_word, away, int(k))
        return np.asarray(away)

    def sourced(self, first: Indices, second: Indices, kind: Indices) -> NDArray[np.bool_]:
        """(n,) whether pairs were neighbours in the source: what they had is theirs, however far from what is usual."""
        return np.isclose(self.gaps.to_right[kind, first], self.gaps.to_left[kind, second], rtol=0.0, atol=1e-12)

    def _word_gaps(self, count: int, rng: np.random.Generator, variation: float) -> Array:
        """(count,) clearances as words have them, from the middle one to as far from it as they come."""
        shares = 50 + _HALF * min(variation, 1.0) * rng.uniform(-1, 1, count)
        return np.percentile(self.gaps.words, shares) if len(self.gaps.words) else np.full(count, np.nan)

    def _bounded(self, numbers: Indices, new_word: NDArray[np.bool_], away: Array, k: int) -> float:
        """How far the centres on both sides of a gap between words are, the words seen as the eye sees them.

        No further over the heights of small letters than the author's words come, and no nearer over all heights; bars
        and loops of the letters before the last, and after the first, count too.
        """
        before, after = hanging(new_word, k)
        first, second = (side.ravel() for side in np.meshgrid(before, after, indexing="ij"))
        place = np.concatenate([[0.0], np.cumsum(away)]) - self.lean[numbers]
        upright = place[second] - place[first]
        wide = (upright + self.sides.across(numbers[first], numbers[second])).min()
        narrow = (upright + self.sides.between(numbers[first], numbers[second])).min()
        less = max(wide - self.gaps.zone, 0.0) if np.isfinite(wide) else 0.0
        less = min(less, max(self._slack(numbers[k], numbers[k + 1], away[k]), 0.0))
        return float(away[k] - less + max(self.gaps.word - narrow + less, 0.0))

    def _slack(self, first: int, second: int, away: float) -> float:
        """By how much the clearance of two words is more than the least that there is."""
        upright = away - self.lean[second] + self.lean[first]
        one, other, kind = np.array([first]), np.array([second]), np.array([WORDS])
        return float(upright + self.sides.clearance(one, other, kind)[0] - self.gaps.low[WORDS])

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
            more += max(self.least - apart(self.forms.bodies[first], self.forms.bodies[second], shift), 0.0)
        return more


def _drawn(estimates: Array, mean: Array, deviation: Array, rng: np.random.Generator, variation: float) -> Array:
    """(n,): between two estimates, the one that there is, or from the Gaussian of all."""
    uniform, normal = rng.uniform(-1, 1, len(mean)), rng.standard_normal(len(mean))
    low, high = np.fmin(*estimates), np.fmax(*estimates)
    reach = (high - low) / 2 * (1 + _MARGIN) + _MARGIN * deviation / 2
    drawn = (low + high) / 2 + variation * uniform * reach
    return np.where(np.isnan(low), mean + variation * normal * deviation, drawn)


def hanging(new_word: NDArray[np.bool_], k: int) -> tuple[Indices, Indices]:
    """The letters next to the gap after letter `k` of a line, in the word before it and in the word after it."""
    before = [k - i for i in range(_OVER) if k - i >= 0 and not new_word[k - i + 1 : k + 1].any()]
    after = [k + 1 + i for i in range(_OVER) if k + 1 + i < len(new_word) and not new_word[k + 2 : k + 2 + i].any()]
    return np.array(before), np.array(after)


def spacing(forms: Forms, beside: Beside) -> Spacing:
    """How a hand spaces its letters, from its pages."""
    slant = measures.mean_slant(forms.hand)
    beyond = sides(forms, slant)
    lean = slant * forms.centre[:, 1]
    pairs = beside.pairs(parted=False).tolist()
    found = [apart(forms.bodies[i], forms.bodies[j], forms.centre[j] - forms.centre[i]) for i, j in pairs]
    least = max(float(np.percentile(found, _SHARE)), 0.0) if found else 0.0
    return Spacing(forms, beyond, slant, lean, _gaps(forms, beyond, beside, forms.centre[:, 0] - lean), least)


def kinds(forms: Forms, first: Indices, second: Indices, parted: NDArray[np.bool_]) -> Indices:
    """(n,) int: of what kind pairs of glyphs are."""
    return np.where(parted, WORDS, np.where(forms.marks[first] | forms.marks[second], MARKS, LETTERS))


def _gaps(forms: Forms, beyond: Sides, beside: Beside, x: Array) -> Gaps:
    """The clearances of the source; where a hand shows none, a usual one."""
    to_right, to_left = np.full((2, 3, len(x)), np.nan)
    mean, deviation, low, high = np.array(_USUAL)
    word, zone, words = float(low[WORDS]), np.inf, np.zeros(0)
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
                words = own[~beside.closes(second[kind == one])]
                words = np.sort(words if len(words) >= _ENOUGH else own)
                level = (x[second] - x[first] + beyond.between(first, second))[kind == one]
                word = float(np.percentile(level, _NARROW, method="inverted_cdf"))
                across = (x[second] - x[first] + beyond.across(first, second))[kind == one]
                across = across[np.isfinite(across)]
                zone = float(np.percentile(across, 100 - _SHARE, method="inverted_cdf")) if len(across) else np.inf
        elif len(own):
            mean[one], low[one], high[one] = _few(own, float(deviation[one]))
    return Gaps(mean, deviation, low, high, to_right, to_left, words, word, zone)


def _few(own: Array, deviation: float) -> tuple[float, float, float]:
    """Middle, least and most of few clearances: one that was set far off must not be what is written every time."""
    middle = float(np.median(own))
    return middle, middle - deviation, middle + deviation
