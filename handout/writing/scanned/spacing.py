"""How far apart letters stand: from centre to centre, by what each had beside it in the source.

What is kept of a pair is its clearance: how near its two bodies, without their ligatures, come at any one height,
measured level in the upright frame, where the slant of the hand is taken out.  The clearance is predicted, and the
distance of the centres follows from the shapes, so that an l after an m neither collides nor gapes.  On held-out pairs
of real hands this errs by a tenth to a third less than the distance of the centres, or of the edges in a band, does.
Between words the strokes that are left loose count too, and at a height everything within a part of the pitch.

Source: seed 000, §6.3.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from handout.values import Array, Indices
from handout.writing.scanned.beside import Beside
from handout.writing.scanned.forms import Forms

_HEIGHTS = np.arange(-0.48, 1.13, 0.04)  # over the baseline, line space
_SEEN = 0.04  # ink within this much of a height counts there
_SEEN_APART = 0.12  # the same between words
_MARGIN = 0.15  # of the difference of two estimates, and of the usual spread, that the range is widened by
_SHARE = 2.0  # per cent: clearances outside these percentiles are slips of the pen or of the reading


@dataclass(frozen=True, eq=False)
class Gaps:
    """What a hand's clearances are: in words (0) and between words (1).

    mean, deviation, low, high : (2,) float: of all of them; `low` and `high` are the least and the most it ever has.
    to_right, to_left : (2, n) float: what every glyph had on either side in the source, nan where nothing.
    """

    mean: Array
    deviation: Array
    low: Array
    high: Array
    to_right: Array
    to_left: Array


@dataclass(frozen=True, eq=False)
class Spacing:
    """The sides of every glyph, and the clearances of a hand; line space.

    left, right : (2, n, heights) float: the outermost ink of each body from the glyph's upright centre, in words (0)
        and between words (1), ±inf where it has none.
    edges : (2, n, 2) float: the same over all heights.
    lean : (n,) float: how much further right the centre stands than its foot, for the slant of the hand.
    """

    left: Array
    right: Array
    edges: Array
    lean: Array
    gaps: Gaps

    def clearance(self, first: Indices, second: Indices, parted: Indices) -> Array:
        """(n,): of pairs of glyphs whose upright centres coincide; mostly negative."""
        near = (self.left[parted, second] - self.right[parted, first]).min(axis=1, initial=np.inf)
        edge = self.edges[parted, second, 0] - self.edges[parted, first, 1]
        return np.where(np.isfinite(near), near, edge)

    def between(
        self, numbers: Indices, new_word: NDArray[np.bool_], rng: np.random.Generator, variation: float
    ) -> Array:
        """(n − 1,): see `gaps`."""
        first, second, parted = numbers[:-1], numbers[1:], new_word[1:].astype(np.intp)
        estimates = np.stack([self.gaps.to_right[parted, first], self.gaps.to_left[parted, second]])
        usual, spread = self.gaps.mean[parted], self.gaps.deviation[parted]
        wanted = _drawn(estimates, usual, spread, rng, variation)
        low, high = self.gaps.low[parted], self.gaps.high[parted]
        # what two neighbours of the source had is theirs, be it more or less than is usual
        own = estimates[0] == estimates[1]
        held = np.where(own, wanted, np.clip(wanted, low, high))
        return np.asarray(held - self.clearance(first, second, parted) + self.lean[second] - self.lean[first])


def _drawn(estimates: Array, mean: Array, deviation: Array, rng: np.random.Generator, variation: float) -> Array:
    """(n,): between two estimates, the one that there is, or from the Gaussian of all."""
    uniform, normal = rng.uniform(-1, 1, len(mean)), rng.standard_normal(len(mean))
    low, high = np.fmin(*estimates), np.fmax(*estimates)
    reach = (high - low) / 2 * (1 + _MARGIN) + _MARGIN * deviation / 2
    drawn = (low + high) / 2 + variation * uniform * reach
    return np.where(np.isnan(low), mean + variation * normal * deviation, drawn)


def spacing(forms: Forms, beside: Beside) -> Spacing:
    """How a hand spaces its letters."""
    slant = float(np.mean([page.slant for page in forms.hand.pages]))
    bodies = [_outline(forms, number, slant) for number in range(len(forms))]
    wholes = [_outline(forms, number, slant, loose=True) for number in range(len(forms))]
    left, right = np.full((2, 2, len(forms), len(_HEIGHTS)), np.inf)
    edges = np.zeros((2, len(forms), 2))
    for parted, (outlines, seen) in enumerate(((bodies, _SEEN), (wholes, _SEEN_APART))):
        for number, (low, high, height) in enumerate(outlines):
            near = np.abs(height[:, None] - _HEIGHTS) < seen
            left[parted, number] = np.where(near, low[:, None], np.inf).min(axis=0)
            right[parted, number] = np.where(near, high[:, None], -np.inf).max(axis=0)
            edges[parted, number] = low.min(), high.max()
    lean = slant * forms.centre[:, 1]
    empty = np.zeros((2, len(forms)))
    shapes = Spacing(left, right, edges, lean, Gaps(*np.zeros((4, 2)), empty, empty))
    return Spacing(left, right, edges, lean, _gaps(shapes, beside, forms.centre[:, 0] - lean))


def _outline(forms: Forms, number: int, slant: float, *, loose: bool = False) -> tuple[Array, Array, Array]:
    """Left and right side of a glyph's line at every vertex, upright, and its height over the baseline."""
    form = forms[number]
    parts = [(form.xy, form.radius)]
    if loose:
        parts += [(way.xy[: way.own], way.radius[: way.own]) for way in form.exits]
        parts += [(way.xy[-way.own :], way.radius[-way.own :]) for way in form.entries]
    xy, radius = (np.concatenate(values) for values in zip(*parts, strict=True))
    upright = xy[:, 0] - slant * xy[:, 1]
    return upright - radius, upright + radius, xy[:, 1] + forms.centre[number, 1]


def _gaps(shapes: Spacing, beside: Beside, x: Array) -> Gaps:
    """The clearances of the source; where a hand shows none, a usual one."""
    to_right, to_left = np.full((2, 2, len(x)), np.nan)
    mean, deviation, low, high = np.array([[0.05, 0.3], [0.05, 0.08], [0.0, 0.15], [0.2, 0.6]])
    for parted in (0, 1):
        first, second = beside.pairs(bool(parted)).T
        found = x[second] - x[first] + shapes.clearance(first, second, np.full(len(first), parted))
        to_right[parted, first], to_left[parted, second] = found, found
        if len(found) > 1:
            low[parted], high[parted] = np.percentile(found, [_SHARE, 100 - _SHARE])
            kept = found[(found >= low[parted]) & (found <= high[parted])]
            mean[parted], deviation[parted] = kept.mean(), kept.std()
    return Gaps(mean, deviation, low, high, to_right, to_left)
