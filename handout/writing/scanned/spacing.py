"""Spaces the letters of a line: predicts the clearance of each pair and derives the distance of the centres from it.

The clearance of a pair is the least horizontal distance of its two bodies, without ligatures, at any one height, with
the slant of the hand taken out.  `spacing_model` measures the clearances on the pages; `SpacingModel.between` predicts
each pair's from what both glyphs had beside them there.  The shapes then give the distance of the centres, so that an l
after an m neither collides nor gapes.  On held-out pairs of real hands this errs by a tenth to a third less than
predicting the distance of the centres, and for three hands of four less than the distance of edges in any band.
Between words loose connectors count as ink too, and ink counts over a band around each height.

Gaps between words do not depend on the letters at the gap: on the pages of seven people the gaps beside the same letter
predict no more than all gaps do.  So they are drawn from all gaps of the pages.

Source: seed 000, §6.3.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.distance import cdist

from handout.hand import measures
from handout.values import Array, Indices
from handout.writing.scanned.extraction import Line
from handout.writing.scanned.forms import Form, Forms
from handout.writing.scanned.glyph_index import Neighbours
from handout.writing.scanned.joining import matches, meets

_HEIGHTS = np.arange(-0.48, 1.13, 0.04)  # over the baseline, line space
LETTERS, WORDS, MARKS = range(3)  # kinds of pairs: two letters of a word, across a space, with punctuation in a word
_ZONE = (-0.1, 1.15)  # x-heights over the baseline: where readers see the gap between two words
_SEEN = (0.04, 0.12, 0.0)  # ink within this much of a height counts there


Side = tuple[Array, Array, float, float]  # left and right, at every level and over all heights
Outline = tuple[Array, Array, Array]  # left and right side at every vertex, upright, and its height over the baseline


@dataclass(frozen=True, eq=False)
class Sides:
    """Left and right ends of the ink of each glyph, from its centre, with the slant taken out; line space.

    The first axis is the kind of pair.  `LETTERS`: bodies alone.  `WORDS`: bodies with the loose connectors that a
    letter joined in the source has at the end of a word.  `MARKS`: over all heights, since punctuation stands above or
    below letters.

    left, right : (3, n, heights) float: ±inf at heights where there is no ink.
    edges : (3, n, 2) float: left and right end over all heights.
    zone : (n, 2) float: left and right end, of `WORDS`, within `_ZONE`; ±inf where there is no ink.
    """

    left: Array
    right: Array
    edges: Array
    zone: Array

    def clearance(self, first: Indices, second: Indices, kind: Indices) -> Array:
        """(n,): clearance of pairs of glyphs if their centres were in one place; mostly negative."""
        near = (self.left[kind, second] - self.right[kind, first]).min(axis=1, initial=np.inf)
        edge = self.edges[kind, second, 0] - self.edges[kind, first, 1]
        return np.asarray(np.where(np.isfinite(near), near, edge))

    def between(self, first: Indices, second: Indices) -> Array:
        """(n,): distance over all heights of pairs at a gap between words, if their centres were in one place."""
        return np.asarray(self.edges[WORDS, second, 0] - self.edges[WORDS, first, 1])

    def across(self, first: Indices, second: Indices) -> Array:
        """(n,): the same within `_ZONE`; inf where either has no ink there."""
        return np.asarray(self.zone[second, 0] - self.zone[first, 1])


def sides(forms: Forms, slant: float) -> Sides:
    """The sides of a hand's glyphs; `slant` is dx/dy, upwards."""
    left = np.full((3, len(forms), len(_HEIGHTS)), np.inf)
    right, edges = -left, np.zeros((3, len(forms), 2))
    zone = np.tile([np.inf, -np.inf], (len(forms), 1))
    low_zone, high_zone = np.multiply(_ZONE, 1 / forms.hand.pitch)
    bodies = np.repeat(np.arange(len(forms)), forms.bodies.count), forms.bodies.xy, forms.bodies.radius
    alone, loose = (_outlines(forms, slant, *lines) for lines in (bodies, forms.wholes()))
    for kind, reach in enumerate(_SEEN):
        of, low, high, height = alone if kind == LETTERS else loose
        left[kind], right[kind] = _levels(of, low, high, height, reach, len(forms))
        first = np.searchsorted(of, np.arange(len(forms)))
        edges[kind] = np.column_stack([np.minimum.reduceat(low, first), np.maximum.reduceat(high, first)])
        if kind == WORDS:
            in_zone = (low_zone < height) & (height < high_zone)
            zone[:, 0] = np.minimum.reduceat(np.where(in_zone, low, np.inf), first)
            zone[:, 1] = np.maximum.reduceat(np.where(in_zone, high, -np.inf), first)
    return Sides(left, right, edges, zone)


def side(outline: Outline, kind: int) -> Side:
    """The left and right ends of one outline for a kind of pair: at every height, and over all heights."""
    left, right = _levels(np.zeros(len(outline[0]), dtype=np.intp), *outline, _SEEN[kind], 1)
    return left[0], right[0], float(outline[0].min()), float(outline[1].max())


def nearness(first: Side, second: Side) -> float:
    """The clearance of two sides; see `Sides.clearance`."""
    near = float((second[0] - first[1]).min())
    return near if np.isfinite(near) else second[2] - first[3]


def _levels(of: Indices, low: Array, high: Array, height: Array, reach: float, count: int) -> tuple[Array, Array]:
    """(count, heights) twice: where the ink within `reach` of each height begins and ends, for each glyph.

    Each vertex belongs to glyph `of` and has ink from `low` to `high` at `height`.
    """
    left = np.full(count * len(_HEIGHTS), np.inf)
    right = -left
    step = _HEIGHTS[1] - _HEIGHTS[0]
    lowest = np.ceil((height - reach - _HEIGHTS[0]) / step).astype(np.intp) - 1
    for level in range(int(2 * reach / step) + 3) if reach else ():
        at = np.clip(lowest + level, 0, len(_HEIGHTS) - 1)
        near = np.abs(height - _HEIGHTS[at]) < reach
        cell = (of * len(_HEIGHTS) + at)[near]
        np.minimum.at(left, cell, low[near])
        np.maximum.at(right, cell, high[near])
    return left.reshape(count, -1), right.reshape(count, -1)


def _outlines(forms: Forms, slant: float, of: Indices, xy: Array, radius: Array) -> tuple[Indices, Array, Array, Array]:
    """For every vertex: its glyph, its left and right end without slant, and its height over the baseline."""
    upright = xy[:, 0] - slant * xy[:, 1]
    return of, upright - radius, upright + radius, xy[:, 1] + forms.centre[of, 1]


def apart(first: Line | Form, second: Line | Form, shift: Array) -> float:
    """Distance of the ink of two bodies, the second shifted (2,) from the first by its centre; line space."""
    away = cdist(first.xy, second.xy + shift) - first.radius[:, None] - second.radius
    return float(away.min())


_MARGIN = 0.15  # by which the range of two estimates is widened: share of their difference, and of the deviation
_EVEN = 0.02  # line space: least deviation that the distance at which ligatures meet is taken to have
_MOST_PUSHES = 2
_ENOUGH = 8  # pairs of a kind from which on its statistics are measured
# mean, deviation, least and most of hands that show too few
_USUAL = [[0.05, 0.3, 0.03], [0.05, 0.08, 0.05], [0.0, 0.15, -0.05], [0.2, 0.6, 0.2]]
_HALF = 35.0  # per cent on either side of the median: word gaps are drawn from these; wider and narrower are exceptions
_SHARE = 2.0  # per cent: clearances outside these percentiles are slips of the pen or of the reading
_NARROW = 10.0  # per cent: the same percentile of word gaps over all heights, higher because cut strokes reach in
_OVER = 2  # letters on each side of a gap between words whose bars may reach across it


@dataclass(frozen=True, eq=False)
class Gaps:
    """The clearances on a hand's pages, for each kind of pair; see `Sides`.

    mean, deviation, low, high : (3,) float: statistics; `low` and `high` bound what is written.
    to_right, to_left : (3, n) float: clearance of each glyph to its right and left neighbour; nan without one.
    words : (m,) float: clearances between words, rising, without those before the last word of a line, which writers
        narrow near the edge.
    word : least distance of two words over all heights, so that they never look like one.
    zone : greatest distance of two words within `_ZONE`.
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
class SpacingModel:
    """How a hand spaces its letters; line space.

    slant : dx/dy of the letters, upwards.
    lean : (n,) float: how much further right each centre stands than its foot, because of the slant.
    least : least distance of the ink of two bodies in a word.
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
        sourced = self.sourced(first, second, kind)
        parted = ~sourced & (kind == WORDS)
        estimates[:, parted] = self._word_gaps(int(parted.sum()), rng, variation)
        wanted = _sampled_gaps(estimates, usual, np.where(parted, 0.0, spread), rng, variation)
        low, high = self.gaps.low[kind], self.gaps.high[kind]
        held = np.where(sourced, wanted, np.clip(wanted, low, high))
        away = held - self.sides.clearance(first, second, kind) + self.lean[second] - self.lean[first]
        for k in np.flatnonzero(~sourced & (kind != WORDS)):
            i, j = int(first[k]), int(second[k])
            reach = away[k] + np.array([low[k] - held[k], high[k] - held[k]])
            away[k] = np.clip(self._with_ligatures(i, j, float(away[k])), *reach)
            away[k] += self._extra_room(i, j, float(away[k]))
        for k in np.flatnonzero(parted):
            away[k] = self._word_distance(numbers, new_word, away, int(k))
        return np.asarray(away)

    def sourced(self, first: Indices, second: Indices, kind: Indices) -> NDArray[np.bool_]:
        """(n,) whether pairs were neighbours in the source; those keep their clearance, however unusual."""
        return np.isclose(self.gaps.to_right[kind, first], self.gaps.to_left[kind, second], rtol=0.0, atol=1e-12)

    def _word_gaps(self, count: int, rng: np.random.Generator, variation: float) -> Array:
        """(count,) clearances drawn from those between words, the median at `variation` 0, wider around it above."""
        shares = 50 + _HALF * min(variation, 1.0) * rng.uniform(-1, 1, count)
        return np.percentile(self.gaps.words, shares) if len(self.gaps.words) else np.full(count, np.nan)

    def _word_distance(self, numbers: Indices, new_word: NDArray[np.bool_], away: Array, k: int) -> float:
        """Distance of the centres on the two sides of a gap between words.

        Within `_ZONE` the words come no further apart than the author's do, and over all heights no nearer; bars and
        loops of the `_OVER` letters on each side count.
        """
        before, after = letters_at_gap(new_word, k)
        first, second = (side.ravel() for side in np.meshgrid(before, after, indexing="ij"))
        place = np.concatenate([[0.0], np.cumsum(away)]) - self.lean[numbers]
        upright = place[second] - place[first]
        wide = (upright + self.sides.across(numbers[first], numbers[second])).min()
        narrow = (upright + self.sides.between(numbers[first], numbers[second])).min()
        less = max(wide - self.gaps.zone, 0.0) if np.isfinite(wide) else 0.0
        less = min(less, max(self._slack(numbers[k], numbers[k + 1], away[k]), 0.0))
        return float(away[k] - less + max(self.gaps.word - narrow + less, 0.0))

    def _slack(self, first: int, second: int, away: float) -> float:
        """By how much the clearance of two words exceeds the least on the pages."""
        upright = away - self.lean[second] + self.lean[first]
        left, right, kind = np.array([first]), np.array([second]), np.array([WORDS])
        return float(upright + self.sides.clearance(left, right, kind)[0] - self.gaps.low[WORDS])

    def _with_ligatures(self, first: int, second: int, away: float) -> float:
        """The mean of a distance and of those at which the ligatures meet, weighted by their precisions."""
        forms = self.forms[first], self.forms[second]
        meetings = [meets(forms[0].exits[i], forms[1].entries[j]) for i, j in matches(*forms)]
        if not meetings:
            return away
        ours = [max(deviation, _EVEN) ** -2.0 for _, deviation in meetings]
        theirs = float(self.gaps.deviation[LETTERS]) ** -2.0
        met = float(np.dot(ours, [distance for distance, _ in meetings]))
        return float((met + theirs * away) / (sum(ours) + theirs))

    def _extra_room(self, first: int, second: int, away: float) -> float:
        """How much further two letters must be moved apart, since ink may also meet at an angle."""
        rise = self.forms.centre[second, 1] - self.forms.centre[first, 1]
        more = 0.0
        for _ in range(_MOST_PUSHES):
            shift = np.array([away + more, rise])
            more += max(self.least - apart(self.forms.bodies[first], self.forms.bodies[second], shift), 0.0)
        return more


def _sampled_gaps(estimates: Array, mean: Array, deviation: Array, rng: np.random.Generator, variation: float) -> Array:
    """(n,): drawn from between two estimates, around the only one, or without any from the Gaussian of all pairs."""
    uniform, normal = rng.uniform(-1, 1, len(mean)), rng.standard_normal(len(mean))
    low, high = np.fmin(*estimates), np.fmax(*estimates)
    reach = (high - low) / 2 * (1 + _MARGIN) + _MARGIN * deviation / 2
    drawn = (low + high) / 2 + variation * uniform * reach
    return np.where(np.isnan(low), mean + variation * normal * deviation, drawn)


def letters_at_gap(new_word: NDArray[np.bool_], k: int) -> tuple[Indices, Indices]:
    """The letters next to the gap after letter `k` of a line, in the word before it and in the word after it."""
    before = [k - i for i in range(_OVER) if k - i >= 0 and not new_word[k - i + 1 : k + 1].any()]
    after = [k + 1 + i for i in range(_OVER) if k + 1 + i < len(new_word) and not new_word[k + 2 : k + 2 + i].any()]
    return np.array(before), np.array(after)


def spacing_model(forms: Forms, neighbours: Neighbours) -> SpacingModel:
    """How a hand spaces its letters, from its pages."""
    slant = measures.mean_slant(forms.hand)
    beyond = sides(forms, slant)
    lean = slant * forms.centre[:, 1]
    pairs = neighbours.pairs(parted=False).tolist()
    distances = [apart(forms.bodies[i], forms.bodies[j], forms.centre[j] - forms.centre[i]) for i, j in pairs]
    least = max(float(np.percentile(distances, _SHARE)), 0.0) if distances else 0.0
    return SpacingModel(forms, beyond, slant, lean, _gaps(forms, beyond, neighbours, forms.centre[:, 0] - lean), least)


def kinds(forms: Forms, first: Indices, second: Indices, parted: NDArray[np.bool_]) -> Indices:
    """(n,) int: of what kind pairs of glyphs are."""
    return np.where(parted, WORDS, np.where(forms.marks[first] | forms.marks[second], MARKS, LETTERS))


def _gaps(forms: Forms, beyond: Sides, neighbours: Neighbours, x: Array) -> Gaps:
    """The clearances of the source; where a hand shows none, a usual one."""
    to_right, to_left = np.full((2, 3, len(x)), np.nan)
    mean, deviation, low, high = np.array(_USUAL)
    word, zone, words = float(low[WORDS]), np.inf, np.zeros(0)
    first, second = np.concatenate([neighbours.pairs(parted=False), neighbours.pairs(parted=True)]).T
    kind = kinds(forms, first, second, neighbours.parted[second])
    clearances = x[second] - x[first] + beyond.clearance(first, second, kind)
    to_right[kind, first], to_left[kind, second] = clearances, clearances
    for pair_kind in (LETTERS, WORDS, MARKS):
        of_kind = clearances[kind == pair_kind]
        if len(of_kind) >= _ENOUGH:
            low[pair_kind], high[pair_kind] = np.percentile(of_kind, [_SHARE, 100 - _SHARE])
            usual = np.clip(of_kind, low[pair_kind], high[pair_kind])
            mean[pair_kind], deviation[pair_kind] = usual.mean(), usual.std()
            if pair_kind == WORDS:
                words = of_kind[~neighbours.closes(second[kind == pair_kind])]
                words = np.sort(words if len(words) >= _ENOUGH else of_kind)
                level = (x[second] - x[first] + beyond.between(first, second))[kind == pair_kind]
                word = float(np.percentile(level, _NARROW, method="inverted_cdf"))
                across = (x[second] - x[first] + beyond.across(first, second))[kind == pair_kind]
                across = across[np.isfinite(across)]
                zone = float(np.percentile(across, 100 - _SHARE, method="inverted_cdf")) if len(across) else np.inf
        elif len(of_kind):
            mean[pair_kind], low[pair_kind], high[pair_kind] = _few_gaps(of_kind, float(deviation[pair_kind]))
    return Gaps(mean, deviation, low, high, to_right, to_left, words, word, zone)


def _few_gaps(clearances: Array, deviation: float) -> tuple[float, float, float]:
    """Middle, least and most of few clearances: one that was set far off must not be what is written every time."""
    middle = float(np.median(clearances))
    return middle, middle - deviation, middle + deviation
