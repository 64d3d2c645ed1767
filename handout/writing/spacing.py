"""How far apart letters and words stand on a line of a scanned hand, and how high.

Letters: predicts the clearance of each pair and derives the distance of the centres from it.

The clearance of a pair is the least horizontal distance of its two bodies, without ligatures, at any one height, with
the slant of the hand taken out.  `spacing_model` measures the clearances on the pages; `SpacingModel.between` predicts
each pair's from what both glyphs had beside them there.  The shapes then give the distance of the centres, so that an
l after an m neither collides nor gapes.  On held-out pairs of real hands this errs by a tenth to a third less than
predicting the distance of the centres, and for three hands of four less than the distance of edges in any band.
Between words loose connectors count as ink too, and ink counts over a band around each height.

Gaps between words do not depend on the letters at the gap: on the pages of seven people the gaps beside the same
letter predict no more than all gaps do.  So they are drawn from all gaps of the pages.

How high letters stand: each by the one before it, and the whole line smoothly.  Where two letters are joined, the ends
of their ligatures say how high the second stands over the first.  In all cases it is told by their shapes: a Gaussian
process has learnt from the hand how high over the line the centre of a glyph of such a shape stands.  The difference
of two such heights errs by a sixth to a third less on held-out pairs of real hands than a regression forest on pairs
does.

The paper trusts ligatures as far as their two ends agree and lets heights go with a deviation of a whole pitch; lines
then wander five to seven times as far as their author's.  Here each is trusted as far as it proves right in the hand.

Source: seed 000, §6.3.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache, partial
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from handout.hand import measures
from handout.hand.learnt import learnt
from handout.hand.scanned import NOBODY
from handout.libraries import lapack
from handout.values import Array, Indices
from handout.writing.bending import Bend
from handout.writing.forms import Forms, GlyphLine, LineVertices, square_distances
from handout.writing.joining import matches, meets, partners, rises
from handout.writing.joints import Joints
from handout.writing.neighbours import Neighbours, neighbours
from handout.writing.variation import Chances

_STEP = 0.04  # line space
_HEIGHTS = np.arange(-0.48, 1.13, _STEP)  # over the baseline
LETTERS, WORDS, MARKS = range(3)  # kinds of pairs: two letters of a word, across a space, with punctuation in a word
_ZONE = (-0.1, 1.15)  # x-heights over the baseline: where readers see the gap between two words
_SEEN = (_STEP, 3 * _STEP, 0.0)  # ink within this much of a height counts there: whole steps, see `_levels`


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
        if reach:
            left[kind], right[kind] = _levels(of, low, high, height, round(reach / _STEP), len(forms))
        first = np.searchsorted(of, np.arange(len(forms)))
        edges[kind] = np.column_stack([np.minimum.reduceat(low, first), np.maximum.reduceat(high, first)])
        if kind == WORDS:
            in_zone = (low_zone < height) & (height < high_zone)
            zone[:, 0] = np.minimum.reduceat(np.where(in_zone, low, np.inf), first)
            zone[:, 1] = np.maximum.reduceat(np.where(in_zone, high, -np.inf), first)
    return Sides(left, right, edges, zone)


def side(outline: Outline, kind: int) -> Side:
    """The left and right ends of one outline for a kind of pair: at every height, and over all heights."""
    low, high, height = outline
    near = np.abs(height - _HEIGHTS[:, None]) < _SEEN[kind]
    left, right = np.where(near, low, np.inf).min(axis=1), np.where(near, high, -np.inf).max(axis=1)
    return left, right, float(low.min()), float(high.max())


def nearness(first: Side, second: Side) -> float:
    """The clearance of two sides; see `Sides.clearance`."""
    near = float((second[0] - first[1]).min())
    return near if np.isfinite(near) else second[2] - first[3]


def _levels(of: Indices, low: Array, high: Array, height: Array, steps: int, count: int) -> tuple[Array, Array]:
    """(count, heights) twice: where the ink within `steps` of each height begins and ends, for each glyph.

    Each vertex belongs to glyph `of` and has ink from `low` to `high` at `height`.
    """
    # from one height to the next is a band; so many of them below a height, and above it, are within reach
    bands = len(_HEIGHTS) + 2 * steps - 1
    left = np.full((count, bands), np.inf)
    right = -left
    band = np.floor((height - _HEIGHTS[0]) / _STEP).astype(np.intp) + steps
    near = np.flatnonzero((band >= 0) & (band < bands))
    cell = of[near] * bands + band[near]
    np.minimum.at(left.ravel(), cell, low[near])
    np.maximum.at(right.ravel(), cell, high[near])
    parts = [slice(k, k + len(_HEIGHTS)) for k in range(2 * steps)]
    return np.minimum.reduce([left[:, k] for k in parts]), np.maximum.reduce([right[:, k] for k in parts])


def _outlines(forms: Forms, slant: float, of: Indices, xy: Array, radius: Array) -> tuple[Indices, Array, Array, Array]:
    """For every vertex: its glyph, its left and right end without slant, and its height over the baseline."""
    upright = xy[:, 0] - slant * xy[:, 1]
    return of, upright - radius, upright + radius, xy[:, 1] + forms.centre[of, 1]


def apart(first: LineVertices | GlyphLine, second: LineVertices | GlyphLine, shift: Array) -> float:
    """Distance of the ink of two bodies, the second shifted (2,) from the first by its centre; line space."""
    away = np.sqrt(square_distances(first.xy, second.xy + shift)) - first.radius[:, None] - second.radius
    return float(away.min())


_MARGIN = 0.15  # by which the range of two estimates is widened: share of their difference, and of the deviation
_EVEN = 0.02  # line space: least deviation that the distance at which ligatures meet is taken to have
_MOST_PUSHES = 2
_KEPT = 4096  # letters, or pairs of them, whose places are kept: 900 words, as `word_layout` keeps their bends
_ENOUGH = 8  # pairs of a kind, or letters, from which on something is learnt of them
# mean, deviation, least and most of hands that show too few
_USUAL = [[0.05, 0.3, 0.03], [0.05, 0.08, 0.05], [0.0, 0.15, -0.05], [0.2, 0.6, 0.2]]
_WORD_SHARES = (12.0, 84.0)  # per cent: word gaps are drawn from between; narrower look closed, wider are exceptions
_LIFTED = 75.0  # per cent: letters that are not joined stand no further apart than so many of the author's
_SHARE = 2.0  # per cent: clearances outside these percentiles are slips of the pen or of the reading
_FENCE = 1.5  # quartile distances outside the quartiles: Tukey, Exploratory Data Analysis, 1977
_NEAREST = 10.0  # per cent: letters that are not joined stand no nearer than so many of the author's
_CLEAR = 0.06  # x-heights between two such letters where a hand shows few
_NARROW = 10.0  # per cent: the same percentile of word gaps over all heights, higher because cut strokes reach in
VERSION = 3  # of what is kept of a hand; tests/hand/test_house_scanned.py says when to raise it
_OVER = 2  # letters on each side of a gap between words whose bars may reach across it


@dataclass(frozen=True, eq=False)
class Gaps:
    """The clearances on a hand's pages, for each kind of pair; see `Sides`.

    mean, deviation, low, high : (3,) float: statistics; `low` and `high` bound what is written.
    to_right, to_left : (3, n) float: clearance of each glyph to its right and left neighbour; nan without one.
    words : (m,) float: clearances between words, rising, without those before the last word of a line, which writers
        narrow near the edge.
    of_letter : (2, n) float: the usual clearance of each glyph's letter to its right and to its left, in words.
    lifted : greatest clearance of two letters of a word that are not joined.
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
    of_letter: Array
    lifted: float
    word: float
    zone: float


@dataclass(frozen=True, eq=False)
class SpacingModel:
    """How a hand spaces its letters; line space.

    slant : dx/dy of the letters, upwards.
    lean : (n,) float: how much further right each centre stands than its foot, because of the slant.
    least : (2,) least distance of the ink of two bodies in a word: that are joined, or a mark, and that are not.
    """

    forms: Forms
    joints: Joints
    sides: Sides
    slant: float
    lean: Array
    gaps: Gaps
    least: Array

    def between(self, numbers: Indices, new_word: NDArray[np.bool_], chances: Chances, variation: float) -> Array:
        """(n − 1,): see `gaps`."""
        first, second = numbers[:-1], numbers[1:]
        kind = kinds(self.forms, first, second, new_word[1:])
        estimates = np.stack([self.gaps.to_right[kind, first], self.gaps.to_left[kind, second]])
        of_letters = (self.gaps.of_letter[0, first] + self.gaps.of_letter[1, second]) / 2
        usual, spread = np.where(kind == LETTERS, of_letters, self.gaps.mean[kind]), self.gaps.deviation[kind]
        sourced = self.sourced(first, second, kind)
        parted = ~sourced & (kind == WORDS)
        estimates[:, parted] = self._word_gaps(chances.gap[1:][parted, 2], variation)
        wanted = _sampled_gaps(estimates, usual, np.where(parted, 0.0, spread), chances.gap[1:], variation)
        low, high = self.gaps.low[kind], self.gaps.high[kind]
        lifted = self.lifted(first, second, kind)
        high = np.where(lifted, np.maximum(self.gaps.lifted, low), high)
        held = np.where(sourced, wanted, np.clip(wanted, low, high))
        away = held - self.sides.clearance(first, second, kind) + self.lean[second] - self.lean[first]
        for k in np.flatnonzero(~sourced & (kind != WORDS)):
            i, j = int(first[k]), int(second[k])
            reach = float(low[k] - held[k]), float(high[k] - held[k])
            away[k] = self.settle(i, j, float(away[k]), reach, float(self.least[int(lifted[k])]))
        for k in np.flatnonzero(parted):
            away[k] = self._word_distance(numbers, new_word, away, int(k))
        return np.asarray(away)

    def lifted(self, first: Indices, second: Indices, kind: Indices) -> NDArray[np.bool_]:
        """(n,) whether pairs are letters of a word that no ligature joins."""
        pairs = zip(first.tolist(), second.tolist(), strict=True)
        alone = np.array([not self.joints.joints_between(i, j) for i, j in pairs], dtype=bool)
        return np.asarray((kind == LETTERS) & alone)

    def sourced(self, first: Indices, second: Indices, kind: Indices) -> NDArray[np.bool_]:
        """(n,) whether pairs were neighbours in the source; those keep their clearance, however unusual."""
        return np.isclose(self.gaps.to_right[kind, first], self.gaps.to_left[kind, second], rtol=0.0, atol=1e-12)

    def _word_gaps(self, chance: Array, variation: float) -> Array:
        """(n,) clearances drawn from those between words, the median at `variation` 0, wider around it above.

        chance : (n,) uniform from 0 to 1.
        """
        low, high = _WORD_SHARES
        shares = 50 + min(variation, 1.0) * (low + (high - low) * chance - 50)
        return np.percentile(self.gaps.words, shares) if len(self.gaps.words) else np.full(len(chance), np.nan)

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
        left, right, kind = numbers[[k]], numbers[[k + 1]], np.array([WORDS])
        clear = away[k] - self.lean[right[0]] + self.lean[left[0]] + self.sides.clearance(left, right, kind)[0]
        less = min(less, max(float(clear - self.gaps.low[WORDS]), 0.0))
        return float(away[k] - less + max(self.gaps.word - narrow + less, 0.0))

    @cached_property
    def settle(self) -> Callable[[int, int, float, tuple[float, float], float], float]:
        """The distance of two letters of a word, `_settle`, as it was where it was asked for before."""
        return lru_cache(_KEPT)(self._settle)

    @cached_property
    def bent(self) -> Callable[[int, Bend, float], _BentGlyph]:
        """A glyph that is bent so, at its height on the line, as it was where it was asked for before."""
        return lru_cache(_KEPT)(partial(_BentGlyph, self))

    def _with_ligatures(self, first: int, second: int, away: float) -> float:
        """The mean of a distance and of those at which the ligatures meet, weighted by their precisions."""
        meetings = [meets(out, into) for out, into in self.joints.joints_between(first, second)]
        if not meetings:
            return away
        if self.joints.is_new(first, second):
            return float(np.mean([distance for distance, _ in meetings]))
        ours = [max(deviation, _EVEN) ** -2.0 for _, deviation in meetings]
        theirs = float(self.gaps.deviation[LETTERS]) ** -2.0
        met = float(np.dot(ours, [distance for distance, _ in meetings]))
        return float((met + theirs * away) / (sum(ours) + theirs))

    def _settle(self, first: int, second: int, away: float, reach: tuple[float, float], least: float) -> float:
        """The distance of two letters, moved within `reach` to where their ligatures meet; further apart where their
        ink meets at an angle."""
        away = float(np.clip(self._with_ligatures(first, second, away), away + reach[0], away + reach[1]))
        rise = self.forms.centre[second, 1] - self.forms.centre[first, 1]
        more = 0.0
        for _ in range(_MOST_PUSHES):
            shift = np.array([away + more, rise])
            more += max(least - apart(self.forms.bodies[first], self.forms.bodies[second], shift), 0.0)
        return away + more


def _sampled_gaps(estimates: Array, mean: Array, deviation: Array, chance: Array, variation: float) -> Array:
    """(n,): drawn from between two estimates, around the only one, or without any from the Gaussian of all pairs.

    chance : (n, 3), see `Chances.gap`.
    """
    uniform, normal = chance[:, 0], chance[:, 1]
    low, high = np.fmin(*estimates), np.fmax(*estimates)
    reach = (high - low) / 2 * (1 + _MARGIN) + _MARGIN * deviation / 2
    drawn = (low + high) / 2 + variation * uniform * reach
    return np.where(np.isnan(low), mean + variation * normal * deviation, drawn)


def letters_at_gap(new_word: NDArray[np.bool_], k: int) -> tuple[Indices, Indices]:
    """The letters next to the gap after letter `k` of a line, in the word before it and in the word after it."""
    before = [k - i for i in range(_OVER) if k - i >= 0 and not new_word[k - i + 1 : k + 1].any()]
    after = [k + 1 + i for i in range(_OVER) if k + 1 + i < len(new_word) and not new_word[k + 2 : k + 2 + i].any()]
    return np.array(before), np.array(after)


def spacing_model(forms: Forms, near: Neighbours) -> SpacingModel:
    """How a hand spaces its letters, from its pages."""
    slant = measures.mean_slant(forms.hand)
    beyond = sides(forms, slant)
    lean = slant * forms.centre[:, 1]
    least = learnt(forms.hand.author or forms.hand, "least distances", VERSION, 2, lambda: _least(forms.of_author))
    joints = Joints(forms)
    return SpacingModel(
        forms, joints, beyond, slant, lean, _gaps(forms, beyond, near, forms.centre[:, 0] - lean), least
    )


def _least(forms: Forms) -> Array:
    """(2,): the least distances of two bodies in a word, of all and of letters that are not joined."""
    pairs = neighbours(forms.hand, forms.centre[:, 0]).pairs(parted=False)
    distances = np.array(
        [apart(forms.bodies[i], forms.bodies[j], forms.centre[j] - forms.centre[i]) for i, j in pairs.tolist()]
    )
    alone = np.array([i not in forms.paths for i in pairs[:, 0].tolist()], dtype=bool) & ~forms.marks[pairs].any(axis=1)
    least = max(float(np.percentile(distances, _SHARE)), 0.0) if len(pairs) else 0.0
    if alone.sum() < _ENOUGH:
        return np.array([least, max(least, _CLEAR * measures.mean_x_height(forms.hand))])
    return np.array([least, max(least, float(np.percentile(distances[alone], _NEAREST)))])


def kinds(forms: Forms, first: Indices, second: Indices, parted: NDArray[np.bool_]) -> Indices:
    """(n,) int: of what kind pairs of glyphs are."""
    return np.where(parted, WORDS, np.where(forms.marks[first] | forms.marks[second], MARKS, LETTERS))


def _gaps(forms: Forms, beyond: Sides, near: Neighbours, x: Array) -> Gaps:
    """The clearances of the source; where a hand shows none, a usual one."""
    to_right, to_left = np.full((2, 3, len(x)), np.nan)
    mean, deviation, low, high = np.array(_USUAL)
    word, zone, words = float(low[WORDS]), np.inf, np.zeros(0)
    first, second = np.concatenate([near.pairs(parted=False), near.pairs(parted=True)]).T
    kind = kinds(forms, first, second, near.parted[second])
    clearances = x[second] - x[first] + beyond.clearance(first, second, kind)
    to_right[kind, first], to_left[kind, second] = clearances, clearances
    for pair_kind in (LETTERS, WORDS, MARKS):
        of_kind = clearances[kind == pair_kind]
        if len(of_kind):
            mean[pair_kind], deviation[pair_kind], low[pair_kind], high[pair_kind] = _usual_gap(
                of_kind, float(deviation[pair_kind])
            )
        if pair_kind == WORDS and len(of_kind) >= _ENOUGH:
            words = of_kind[~near.closes(second[kind == pair_kind])]
            words = np.sort(words if len(words) >= _ENOUGH else of_kind)
            level = (x[second] - x[first] + beyond.between(first, second))[kind == pair_kind]
            word = float(np.percentile(level, _NARROW, method="inverted_cdf"))
            across = (x[second] - x[first] + beyond.across(first, second))[kind == pair_kind]
            across = across[np.isfinite(across)]
            zone = float(np.percentile(across, 100 - _SHARE, method="inverted_cdf")) if len(across) else np.inf
    letters = clearances[kind == LETTERS]
    of_letter = np.stack(
        [_of_letter(forms, side[kind == LETTERS], letters, float(mean[LETTERS])) for side in (first, second)]
    )
    small = np.array([glyph.letter.islower() for glyph in forms.hand.glyphs], dtype=bool)
    within = (small[first] & small[second])[kind == LETTERS]
    alone = within & np.array([int(i) not in forms.paths for i in first[kind == LETTERS]], dtype=bool)
    of_lifted = letters[alone if alone.sum() >= _ENOUGH else within]
    lifted = float(np.percentile(of_lifted, _LIFTED)) if len(of_lifted) >= _ENOUGH else float(high[LETTERS])
    return Gaps(mean, deviation, low, high, to_right, to_left, words, of_letter, lifted, word, zone)


def _of_letter(forms: Forms, glyphs: Indices, clearances: Array, mean: float) -> Array:
    """(n,): the mean clearance of each glyph's letter, `mean` counting for some pairs; bars let others stand near."""
    letters, number = np.unique([glyph.letter for glyph in forms.hand.glyphs], return_inverse=True)
    count = np.bincount(number[glyphs], minlength=len(letters))
    total = np.bincount(number[glyphs], weights=clearances, minlength=len(letters))
    return np.asarray(((total + _PRIOR * mean) / (count + _PRIOR))[number])


_PRIOR = 4.0  # pairs that all letters together count for, beside those of one letter


def _usual_gap(clearances: Array, deviation: float) -> tuple[float, float, float, float]:
    """Mean, deviation, least and most of clearances, without the slips of the pen or of the reading among them.

    deviation : of few of them: one that was set far off must not be what is written every time.
    """
    if len(clearances) < _ENOUGH:
        middle = float(np.median(clearances))
        return middle, deviation, middle - deviation, middle + deviation
    low, high = np.percentile(clearances, [_SHARE, 100 - _SHARE])
    if len(clearances) * _SHARE < 200:  # so few are beyond these that a single slip decides where they are
        first, third = np.percentile(clearances, [25, 75])
        reach = _FENCE * (third - first)
        low, high = max(low, first - reach), min(high, third + reach)
    usual = np.clip(clearances, low, high)
    return float(usual.mean()), float(usual.std()), float(low), float(high)


LEAST = 0.01  # line space: deviation of a rise that is never undercut
HOLD = 0.1  # line space: with this, lines in four real hands wander as far as their authors' own do
_TURNS = (5, 17, 43, 71)  # glyphs further on, to pair those that were no neighbours
_RANKS = (0.05, 0.25, 0.5, 0.75, 0.95)  # of a body's ink from its foot to its top
_MOST_LEARNT = 1500  # letters that they are learnt from: the time goes with the third power
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

    def heights_of(self, numbers: Indices, new_word: NDArray[np.bool_], chances: Chances, variation: float) -> Array:
        """(n,): see `heights`."""
        joined: list[Array | None] = []  # what the ligatures from each glyph to the next say of the rise
        for at in range(len(numbers) - 1):
            first, second = self.forms[int(numbers[at])], self.forms[int(numbers[at + 1])]
            pairs = () if new_word[at + 1] else matches(first, second)
            joined.append(rises(first, second, pairs) if pairs else None)
        free = self.marks[numbers].copy()
        for k in np.flatnonzero([said is not None for said in joined]):
            free[k : k + 2] = False
        y = self.height[numbers].copy()
        chain = np.flatnonzero(~free)
        if len(chain) > 1:
            rise, deviation = self._rises(numbers, chain, new_word, joined)
            rise = rise + variation * deviation * chances.rise[chain[1:]]
            y[chain] = smoothed(y[chain], rise, np.maximum(deviation, LEAST), self.hold)
        return y

    def _rises(
        self, numbers: Indices, chain: Indices, new_word: NDArray[np.bool_], joined: list[Array | None]
    ) -> tuple[Array, Array]:
        """Mean and deviation of the rises along the letters `chain` of a line."""
        first, second = numbers[chain[:-1]], numbers[chain[1:]]
        parted = np.logical_or.reduceat(new_word[: chain[-1] + 1], chain[:-1] + 1)
        rise = self.predicted[second] - self.predicted[first]
        deviation = self.deviation[parted.astype(np.intp)]
        # whether each glyph and the next were neighbours in the source, in one word or not as here
        after, beside = self.neighbours.after[numbers[:-1]], self.neighbours.parted[numbers[1:]]
        sourced = (after == numbers[1:]) & (beside == new_word[1:])
        source = np.logical_and.reduceat(sourced[: chain[-1]], chain[:-1])
        rise = np.where(source, self.height[second] - self.height[first], rise)
        deviation = np.where(source, 0.0, deviation)
        for k in np.flatnonzero((np.diff(chain) == 1) & ~source):
            ligature_rises = joined[chain[k]]
            if ligature_rises is not None:
                # each of ligatures and shapes weighs as far as it can be trusted in this hand
                ours = max(float(np.ptp(ligature_rises)) / 4, self.ligature_deviation) ** -2.0
                theirs = deviation[k] ** -2.0
                rise[k] = (ours * float(ligature_rises.mean()) + theirs * rise[k]) / (ours + theirs)
                deviation[k] = (ours + theirs) ** -0.5
        return rise, deviation


def smoothed(height: Array, rise: Array, deviation: Array, hold: float = 1.0) -> Array:
    """The likeliest heights of a line's letters.

    height : (n,) float: where each stood on its own line, unary N(height, hold²).
    rise, deviation : (n − 1,) float: of each letter over the one before it.
    """
    weight = deviation**-2.0
    diagonal = np.full(len(height), hold**-2.0)
    diagonal[:-1] += weight
    diagonal[1:] += weight
    # the unknown is what the line departs from its own heights by: where they agree with the rises it is nothing
    pull = weight * (rise - np.diff(height))
    force = np.zeros(len(height))
    force[1:] += pull
    force[:-1] -= pull
    return np.asarray(height + lapack.dptsv(diagonal, -weight, force)[2])


def height_model(forms: Forms, near: Neighbours) -> HeightModel:
    """How high a hand's glyphs stand, learnt from its pages."""
    height = forms.centre[:, 1]
    marks = forms.marks
    author, own = forms.hand.author or forms.hand, forms.hand.own_count
    known = learnt(author, "heights", VERSION, own, lambda: _predicted_heights(forms.of_author))
    predicted = np.concatenate([known, height[own:]])  # letters that were added stand as they were made to
    deviation = np.array([_rise_deviation(near.pairs(parted), height - predicted, marks) for parted in (False, True)])
    ligature_deviation = _ligature_deviation(forms, predicted, float(deviation[0]))
    return HeightModel(forms, height, predicted, deviation, ligature_deviation, HOLD, marks, near)


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


def _predicted_heights(forms: Forms) -> Array:
    """(n,) the height that a glyph's shape tells by what the other glyphs have."""
    height, sample = forms.centre[:, 1], np.flatnonzero(~forms.marks)
    if len(sample) < _ENOUGH:
        return height.copy()
    sample = sample[:: -(-len(sample) // _MOST_LEARNT)]
    shapes = _shapes(forms)
    shapes = (shapes - shapes[sample].mean(axis=0)) / (shapes[sample].std(axis=0) + 1e-9)
    alike = np.exp(-square_distances(shapes, shapes[sample]) / (2 * _LENGTH**2))
    factor = lapack.dpotrf(alike[sample] + _NOISE * np.eye(len(sample)), lower=1)[0]
    middle = height[sample].mean()
    weights = lapack.dpotrs(factor, height[sample] - middle, lower=1)[0]
    predicted = middle + alike @ weights
    # what is known of a glyph itself is left out; of the inverse nothing but the diagonal is asked for that
    predicted[sample] = height[sample] - weights / np.square(lapack.dtrtri(factor, lower=1)[0]).sum(axis=0)
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


_COLLISION_PUSHES = 3  # that two letters are moved apart by: one sideways takes them less far apart than it is long


def resolve_collisions(
    spacing: SpacingModel, numbers: Indices, new_word: NDArray[np.bool_], apart: Array, y: Array, bends: Sequence[Bend]
) -> Array:
    """How far each glyph's centre stands to the right of the one before it, where they are bent and at their heights.

    numbers : (n,) int; new_word : (n,) bool: see `gaps`.
    apart : (n − 1,) float, line space: the same of glyphs that are as they were in the source.
    y : (n,) float, line space: how high the centres stand.
    bends : n, of the glyphs.

    Returns (n − 1,) float, line space.
    """
    if len(numbers) < 2:
        return apart
    first, second = numbers[:-1], numbers[1:]
    kind = kinds(spacing.forms, first, second, new_word[1:])
    sourced = spacing.sourced(first, second, kind)
    least = spacing.least[spacing.lifted(first, second, kind).astype(np.intp)]
    glyphs = [
        spacing.bent(number, bend, height)
        for number, bend, height in zip(numbers.tolist(), bends, y.tolist(), strict=True)
    ]
    away = apart + spacing.sides.clearance(first, second, kind) + np.diff([glyph.shifted for glyph in glyphs])
    for k, of in enumerate(kind.tolist()):
        free = float(least[k]) if of != WORDS and not sourced[k] else -np.inf
        away[k] = _push_apart(glyphs[k], glyphs[k + 1], float(away[k]), of, free)
    for k in np.flatnonzero(~sourced & (kind == WORDS)).tolist():
        before, after = letters_at_gap(new_word, k)
        begin, end = int(before[-1]), int(after[-1]) + 1
        upright = np.concatenate([[0.0], np.cumsum(away[begin : end - 1])]) - spacing.slant * y[begin:end]
        right = max(upright[i - begin] + glyphs[i].edges[1] for i in before)
        left = min(upright[i - begin] + glyphs[i].edges[0] for i in after)
        away[k] += max(spacing.gaps.word - (left - right), 0.0)
    return np.asarray(away)


@lru_cache(_KEPT)
def _push_apart(first: _BentGlyph, second: _BentGlyph, away: float, kind: int, least: float) -> float:
    """How far right of a glyph's centre the next one stands, whose sides are `away`; no nearer than `least` or −inf."""
    away -= nearness(first.side(kind), second.side(kind))
    for _ in range(_COLLISION_PUSHES if least > -np.inf else 0):
        short = least - first.apart(second, np.array([away, second.y - first.y]))
        if short <= 0:
            break
        away += short
    return away


class _BentGlyph:
    """A glyph bent, at its height on the line.

    shifted : how much further right the slant takes its centre than at its height in the source.
    """

    def __init__(self, spacing: SpacingModel, number: int, bend: Bend, y: float) -> None:
        self._form, self._bend, self.y, self._slant = spacing.forms[number], bend, y, spacing.slant
        self._sides: dict[int, Side] = {}
        self.shifted = spacing.slant * (y - float(spacing.forms.centre[number, 1]))

    def side(self, kind: int) -> Side:
        """What `sides.Sides` has of a glyph in a pair of this kind, from its centre."""
        if kind not in self._sides:
            xy, radius = (self._body.xy, self._body.radius) if kind == LETTERS else self._whole
            upright = xy[:, 0] - self._slant * xy[:, 1]
            self._sides[kind] = side((upright - radius, upright + radius, xy[:, 1] + self.y), kind)
        return self._sides[kind]

    @property
    def edges(self) -> tuple[float, float]:
        """How far its ink goes to either side, upright, where it begins or ends a word."""
        return self.side(WORDS)[2:]

    def apart(self, other: _BentGlyph, shift: Array) -> float:
        """See `spacing.apart`."""
        return apart(self._body, other._body, shift)

    @cached_property
    def _body(self) -> GlyphLine:
        return replace(self._form, xy=self._bend.of_form(self._form.xy))

    @cached_property
    def _whole(self) -> tuple[Array, Array]:
        xy, radius = self._form.whole
        return self._bend.of_form(xy), radius
