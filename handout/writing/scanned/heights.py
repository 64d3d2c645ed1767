"""How high letters stand on their line: each by the one before it, and the whole line smoothly.

Where two letters are joined, the ends of their ligatures say how high the second stands over the first.  In all cases
it is told by their shapes: a Gaussian process has learnt from the hand how high over the line the centre of a glyph of
such a shape stands.  The difference of two such heights errs by a sixth to a third less on held-out pairs of real hands
than a regression forest on pairs does.

The paper trusts ligatures as far as their two ends agree and lets heights go with a deviation of a whole pitch; lines
then wander five to seven times as far as their author's.  Here each is trusted as far as it proves right in the hand.

Source: seed 000, §6.3.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solveh_banded
from scipy.linalg.lapack import dpotrf, dpotrs, dtrtri
from scipy.spatial.distance import cdist

from handout.hand.scanned import NOBODY
from handout.values import Array, Indices
from handout.writing.scanned.forms import Forms
from handout.writing.scanned.glyph_index import Neighbours
from handout.writing.scanned.joining import matches, partners, rises

LEAST = 0.01  # line space: deviation of a rise that is never undercut
HOLD = 0.1  # line space: with this, lines in four real hands wander as far as their authors' own do
_TURNS = (5, 17, 43, 71)  # glyphs further on, to pair those that were no neighbours
_RANKS = (0.05, 0.25, 0.5, 0.75, 0.95)  # of a body's ink from its foot to its top
_ENOUGH = 8  # letters that heights can be learnt from
_MOST = 1500  # letters that they are learnt from: the time goes with the third power
_LENGTH, _NOISE = 2.5, 0.2  # of the process: deviations of the shapes, and share of the variance


@dataclass(frozen=True, eq=False)
class HeightModel:
    """How high the glyphs of a hand stand; line space.

    height : (n,) float: of each centre over the source's baseline.
    predicted : (n,) float: the height that its shape tells.
    deviation : of the rise from one letter to the next, in words (0) and between words (1), from what is predicted.
    ligature_deviation : least deviation of the rise that ligatures tell.
    hold : deviation of a letter's height from its own.
    marks : (n,) bool: punctuation, which stands at its own height.
    neighbours : which glyphs were neighbours.
    """

    forms: Forms
    height: Array
    predicted: Array
    deviation: Array
    ligature_deviation: float
    hold: float
    marks: NDArray[np.bool_]
    neighbours: Neighbours

    def heights_of(
        self, numbers: Indices, new_word: NDArray[np.bool_], rng: np.random.Generator, variation: float
    ) -> Array:
        """(n,): see `heights`."""
        joined = self._ligature_rises(numbers, new_word)
        free = self.marks[numbers].copy()
        for k in np.flatnonzero([pairs is not None for pairs in joined]):
            free[k : k + 2] = False
        y = self.height[numbers].copy()
        chain = np.flatnonzero(~free)
        if len(chain) > 1:
            rise, deviation = self._rises(numbers, chain, new_word, joined)
            rise = rise + variation * deviation * rng.standard_normal(len(rise))
            y[chain] = smoothed(y[chain], rise, np.maximum(deviation, LEAST), self.hold)
        return y

    def _ligature_rises(self, numbers: Indices, new_word: NDArray[np.bool_]) -> list[Array | None]:
        """What the ligatures from each glyph to the next say of the rise; None without any."""
        all_rises: list[Array | None] = []
        for k in range(len(numbers) - 1):
            first, second = self.forms[int(numbers[k])], self.forms[int(numbers[k + 1])]
            pairs = () if new_word[k + 1] else matches(first, second)
            all_rises.append(rises(first, second, pairs) if pairs else None)
        return all_rises

    def _sourced(self, numbers: Indices, new_word: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """(n − 1,) whether each glyph and the next were neighbours in the source, in one word or not as here."""
        neighbours, second = self.neighbours, numbers[1:]
        return np.asarray((neighbours.after[numbers[:-1]] == second) & (neighbours.parted[second] == new_word[1:]))

    def _rises(
        self, numbers: Indices, chain: Indices, new_word: NDArray[np.bool_], joined: list[Array | None]
    ) -> tuple[Array, Array]:
        """Mean and deviation of the rises along the letters `chain` of a line."""
        first, second = numbers[chain[:-1]], numbers[chain[1:]]
        parted = np.logical_or.reduceat(new_word[: chain[-1] + 1], chain[:-1] + 1)
        rise = self.predicted[second] - self.predicted[first]
        deviation = self.deviation[parted.astype(np.intp)]
        source = np.logical_and.reduceat(self._sourced(numbers, new_word)[: chain[-1]], chain[:-1])
        rise = np.where(source, self.height[second] - self.height[first], rise)
        deviation = np.where(source, 0.0, deviation)
        for k in np.flatnonzero((np.diff(chain) == 1) & ~source):
            ligature_rises = joined[chain[k]]
            if ligature_rises is not None:
                rise[k], deviation[k] = self._combined(ligature_rises, rise[k], deviation[k])
        return rise, deviation

    def _combined(self, ligature_rises: Array, predicted: float, deviation: float) -> tuple[float, float]:
        """What ligatures and shapes say together: each weighs as far as it can be trusted in this hand."""
        ours, theirs = max(float(np.ptp(ligature_rises)) / 4, self.ligature_deviation) ** -2.0, deviation**-2.0
        return (ours * float(ligature_rises.mean()) + theirs * predicted) / (ours + theirs), (ours + theirs) ** -0.5


def smoothed(height: Array, rise: Array, deviation: Array, hold: float = 1.0) -> Array:
    """The likeliest heights of a line's letters.

    Parameters
    ----------
    height : (n,) float: where each stood on its own line, unary N(height, hold²).
    rise, deviation : (n − 1,) float: of each letter over the one before it.
    """
    weight = deviation**-2.0
    band = np.zeros((2, len(height)))
    band[0, 1:] = -weight
    band[1] = hold**-2.0
    band[1, :-1] += weight
    band[1, 1:] += weight
    # the unknown is what the line departs from its own heights by: where they agree with the rises it is nothing
    pull = weight * (rise - np.diff(height))
    force = np.zeros(len(height))
    force[1:] += pull
    force[:-1] -= pull
    return np.asarray(height + solveh_banded(band, force))


def height_model(forms: Forms, neighbours: Neighbours) -> HeightModel:
    """How high a hand's glyphs stand, learnt from its pages."""
    height = forms.centre[:, 1]
    marks = forms.marks
    predicted = _predicted_heights(forms, height, ~marks)
    deviation = np.array(
        [_rise_deviation(neighbours.pairs(parted), height - predicted, marks) for parted in (False, True)]
    )
    ligature_deviation = _ligature_deviation(forms, predicted, float(deviation[0]))
    return HeightModel(forms, height, predicted, deviation, ligature_deviation, HOLD, marks, neighbours)


def _ligature_deviation(forms: Forms, predicted: Array, deviation: float) -> float:
    """How far the rises that ligatures tell are from the true ones, where the two letters were no neighbours."""
    out, into = forms.ends()
    first, second = (np.flatnonzero(~np.isnan(ends[:, 0, 0])) for ends in (out, into))
    away = [np.zeros(0)]
    for turn in _TURNS if len(first) > 1 else ():
        pairs = min(len(first), len(second))
        i, j = first[:pairs], np.roll(second, -turn)[:pairs]
        height = (ends[k].mean(axis=-1) + forms.centre[k, 1, None] for ends, k in ((out, i), (into, j)))
        partner = partners(*height)[:, :, None]
        rise = np.where(partner == NOBODY, np.nan, out[i] - np.take_along_axis(into[j], partner, axis=1))
        away.append(np.nanmean(rise, axis=(1, 2)) - predicted[j] + predicted[i])
    missed = np.abs(np.concatenate(away))
    together = 1.4826 * float(np.median(missed)) if len(missed) else 0.0
    # what is seen is the miss of both, of the ligatures and of what the shapes tell
    return float(np.sqrt(max(together**2 - deviation**2, deviation**2)))


def _rise_deviation(pairs: Indices, rest: Array, marks: NDArray[np.bool_]) -> float:
    """How far the rises of the source are from what was predicted, robustly."""
    letters = pairs[~marks[pairs].any(axis=1)]
    away = np.abs(rest[letters[:, 1]] - rest[letters[:, 0]])
    return max(float(1.4826 * np.median(away)), LEAST) if len(away) > 1 else 3 * LEAST


def _predicted_heights(forms: Forms, height: Array, letters: NDArray[np.bool_]) -> Array:
    """(n,) the height that a glyph's shape tells by what the other glyphs have."""
    sample = np.flatnonzero(letters)
    if len(sample) < _ENOUGH:
        return height.copy()
    sample = sample[:: -(-len(sample) // _MOST)]
    shapes = _shapes(forms)
    shapes = (shapes - shapes[sample].mean(axis=0)) / (shapes[sample].std(axis=0) + 1e-9)
    alike = np.exp(-cdist(shapes, shapes[sample], "sqeuclidean") / (2 * _LENGTH**2))
    factor = dpotrf(alike[sample] + _NOISE * np.eye(len(sample)), lower=1)[0]
    middle = height[sample].mean()
    weights = dpotrs(factor, height[sample] - middle, lower=1)[0]
    predicted = middle + alike @ weights
    # what is known of a glyph itself is left out; of the inverse nothing but the diagonal is asked for that
    predicted[sample] = height[sample] - weights / np.square(dtrtri(factor, lower=1)[0]).sum(axis=0)
    return np.asarray(predicted)


def _shapes(forms: Forms) -> Array:
    """(n, 8): where the ink of each body lies from its centre."""
    lines = forms.bodies
    y, first = lines.xy[:, 1], lines.first[:-1]
    order = np.concatenate([at + np.argsort(y[at:end], kind="stable") for at, end in pairwise(lines.first.tolist())])
    run = np.cumsum((lines.density * lines.radius**2 + 1e-12)[order])
    before = np.where(first > 0, run[first - 1], 0.0)
    wanted = before[:, None] + (run[lines.first[1:] - 1] - before)[:, None] * _RANKS
    at = np.clip(np.searchsorted(run, wanted), first[:, None], lines.first[1:, None] - 1)
    foot, top = np.minimum.reduceat(y - lines.radius, first), np.maximum.reduceat(y + lines.radius, first)
    wide = np.maximum.reduceat(lines.xy[:, 0], first) - np.minimum.reduceat(lines.xy[:, 0], first)
    return np.column_stack([y[order][at], foot, top, wide])
