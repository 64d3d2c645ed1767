"""Bends a glyph a little each time it is written, within the range over which its author's own letters vary.

A bend is the sum of an affine map, a smooth warp and small shifts around the glyph's targets (the points its strokes
aim at).  All three map the plane, so strokes stay smooth and ligatures follow their glyph; line widths do not change.

Source: own method; seed 000, §6.2 for the need; seed 002, §3.3 for the targets.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from statistics import NormalDist

import numpy as np
from numpy.typing import NDArray

from handout.hand.learnt import learnt
from handout.hand.measures import body_sizes, mean_x_height
from handout.values import Array, Indices
from handout.writing.forms import Forms, GlyphLine, square_distances

_SHARE = 0.7  # standard deviation of a bend over that of the letter's instances
_WARP = 1.5  # size of the warp over the usual difference in shape between two instances
_WAVES = 3
_MISSED = 0.8  # shift of targets over the usual difference in shape; never more than _FARTHEST
_WORST = 2.0  # deviations
_NORMAL = NormalDist()  # scipy's takes longer to load than the rest of a sentence
_FARTHEST = 0.06  # x-heights
_AROUND = 0.4  # x-heights: reach of a target's shift
_AWAY = 0.15  # weight of no shift, against those of the targets
_ENOUGH = 5  # instances from which on a letter's range is measured
_SUREST = 10  # per cent of the letters
_PRIOR = 4.0  # instances that the deviation common to all letters counts as
_TRIES = (1.0, 0.7, 0.5)
_EVEN = np.eye(2)  # the affine map that leaves everything where it is
VERSION = 2  # of what is kept of a hand; tests/hand/test_house_scanned.py says when to raise it


@dataclass(frozen=True, eq=False)
class InstanceSpread:
    """How much the instances of each letter vary.

    size : (n, 4) float, of every glyph: logarithms of width, height and aspect, and slant.
    deviation : (n, 4) float: usual deviation of its letter.
    low, high : (n, 4) float: range of its letter; it always includes the glyph itself.
    warp : line space: usual distance of the strokes of two instances when their boxes are laid over each other.
    x_height : line space.
    """

    size: Array
    deviation: Array
    low: Array
    high: Array
    warp: float
    x_height: float


@dataclass(frozen=True, eq=False)
class Bend:
    """A smooth map of the plane about a glyph's centre.

    affine : (2, 2) float.
    foot : height of the point on the axis of the centre that stays where it is.
    waves : (k, 2) float: wave vectors, rad; pushes : (k, 2) float: displacements; phases : (k,).
    targets : (m, 2) float: places that are shifted; misses : (m, 2) float: the shifts; around : their reach.
    """

    affine: Array
    foot: float
    waves: Array
    pushes: Array
    phases: Array
    targets: Array
    misses: Array
    around: float
    _kept: dict[int, tuple[Array, Array]] = field(default_factory=dict, init=False, repr=False)

    def __call__(self, xy: Array) -> Array:
        """Where places (n, 2) go."""
        moved = xy + (xy - (0.0, self.foot)) @ (self.affine - _EVEN).T
        moved += np.sin(xy @ self.waves.T + self.phases) @ self.pushes
        near = np.exp(square_distances(xy, self.targets) / (-2 * self.around**2))
        return np.asarray(moved + near @ self.misses / (near.sum(axis=1) + _AWAY)[:, None])

    def of_form(self, xy: Array) -> Array:
        """The same, read-only, for places (n, 2) of a form, which are asked for when it is bent, spaced and laid."""
        found = self._kept.get(id(xy))
        if found is None:
            found = self._kept[id(xy)] = (xy, self(xy))
            found[1].flags.writeable = False
        return found[1]

    def scale_by(self, share: float) -> Bend:
        """The bend, `share` times as strong."""
        affine = _EVEN + share * (self.affine - _EVEN)
        return replace(self, affine=affine, pushes=share * self.pushes, misses=share * self.misses)


def unbent() -> Bend:
    """The bend that leaves everything where it is."""
    none = np.zeros((0, 2))
    return Bend(_EVEN, 0.0, none, none, np.zeros(0), none, none, 1.0)


def bend(
    form: GlyphLine,
    number: int,
    spread: InstanceSpread,
    height: float,
    drift: Array,
    rng: np.random.Generator,
    variation: float,
) -> Bend:
    """A bend of a glyph within its author's own spread for the letter.

    drift : (3,): width, height and slant of the writing here, in deviations of the letter's.
    height : of the glyph's centre over its baseline; letters grow and lean from the baseline.
    variation : 0 none, 1 usual; the author's range bounds it however great it is.
    """
    directions = rng.uniform(0, 2 * np.pi, (3, _WAVES))
    # a normal cut off at its worst, so that no two targets are missed alike
    shares = rng.uniform(_NORMAL.cdf(-_WORST), _NORMAL.cdf(_WORST), form.targets.shape)
    missed = np.array([*map(_NORMAL.inv_cdf, shares.ravel().tolist())]).reshape(shares.shape)
    if variation == 0:
        return unbent()
    reach = min(variation * _MISSED * spread.warp, _FARTHEST * spread.x_height)
    low, high = spread.low[number] - 1e-9, spread.high[number] + 1e-9
    # a glyph at the edge of its letter's range can only be bent back into it: the other way, or without the affine part
    for affine, side in ((1.0, 1.0), (-1.0, -1.0), (0.0, 1.0), (0.0, -1.0)):
        full = _make_warp(_affine(number, spread, affine * variation * drift), -height, directions, spread, variation)
        full = replace(full, pushes=side * full.pushes, targets=form.targets, misses=side * reach * missed)
        moved = full(form.xy) - form.xy
        for share in _TRIES:
            then = measure(form.xy + share * moved, form.radius, spread.x_height)
            if ((then >= low) & (then <= high)).all():
                return full.scale_by(share)
    return unbent()


def _affine(number: int, spread: InstanceSpread, normal: Array) -> Array:
    """(2, 2): width, height and slant changed by so many of their deviations, within their ranges."""
    size, step = spread.size[number], np.zeros(4)
    step[[0, 1, 3]] = _SHARE * normal * spread.deviation[number][[0, 1, 3]]
    low, high = spread.low[number] - size, spread.high[number] - size
    step = np.clip(step, low, high)
    # width gives way where the two together would make a shape that the letter never has
    aspect = np.clip(step[0] - step[1], low[2], high[2])
    wide, tall = np.exp([step[1] + aspect, step[1]])
    return np.array([[wide, tall * (size[3] + step[3]) - wide * size[3]], [0.0, tall]])


def _make_warp(affine: Array, foot: float, directions: Array, spread: InstanceSpread, variation: float) -> Bend:
    """The affine map and the warp: waves longer than an x-height, none steep enough to fold the plane."""
    length = 2 * np.pi / (spread.x_height * np.array([2.0, 2.6, 3.4]))
    waves = length[:, None] * np.column_stack([np.cos(directions[0]), np.sin(directions[0])])
    reach = min(variation * _WARP * spread.warp, 0.1 * spread.x_height) / _WAVES
    pushes = reach * np.column_stack([np.cos(directions[1]), np.sin(directions[1])])
    return Bend(affine, foot, waves, pushes, directions[2], waves[:0], waves[:0], _AROUND * spread.x_height)


def measure_spread(forms: Forms) -> InstanceSpread:
    """How much a hand's letters vary, from their instances."""
    hand = forms.hand
    x_height = mean_x_height(hand)
    size = body_sizes(forms.bodies.xy, forms.bodies.radius, forms.bodies.first, x_height)
    groups = [hand.numbers_of_letter(letter) for letter in hand.letters]
    unjoined = np.ones(len(hand.glyphs), dtype=bool)
    for number, glyph in enumerate(hand.glyphs):
        if glyph.ligatures:
            unjoined[[number, glyph.after]] = False
    common = _common_deviation(size, groups, unjoined)
    deviation, low, high = np.tile(common, (len(size), 1)), size - common, size + common
    for numbers in groups:
        middle = np.median(size[numbers], axis=0)
        # letters whose ends were read wrongly are far off: medians do not see them
        rough = 1.4826 * np.median(np.abs(size[numbers] - middle), axis=0)
        usual = np.sqrt((len(numbers) * rough**2 + _PRIOR * common**2) / (len(numbers) + _PRIOR))
        deviation[numbers] = np.clip(rough, common / 2, common)
        if len(numbers) >= _ENOUGH:
            # slips of the pen and of the reading lie outside twice the usual
            low[numbers] = np.maximum(size[numbers].min(axis=0), middle - 2 * usual)
            high[numbers] = np.minimum(size[numbers].max(axis=0), middle + 2 * usual)
    author = hand.author or hand
    warp = float(learnt(author, "shape difference", VERSION, 1, lambda: [_shape_difference(forms.of_author)])[0])
    return InstanceSpread(size, deviation, np.minimum(low, size), np.maximum(high, size), warp, x_height)


def measure(xy: Array, radius: Array, x_height: float) -> Array:
    """(4,): logarithms of width, height and aspect of a body, and its slant; 0 for one too low to have any."""
    return np.asarray(body_sizes(xy, radius, np.array([0, len(xy)]), x_height)[0])


def _common_deviation(size: Array, groups: Sequence[Indices], free: NDArray[np.bool_]) -> Array:
    """(4,) the deviation within a letter that all letters have in common.

    Among letters that stand free it is the median.  Instances of joined letters vary mostly in where they were cut
    apart, which the author did not do: among those a low percentile is taken, from letters with the surest ends.
    """
    alone = [size[group[free[group]]] for group in groups]
    samples, share = [sizes for sizes in alone if len(sizes) >= _ENOUGH], 50.0
    if len(samples) < _ENOUGH:
        samples, share = [size[group] for group in groups if len(group) >= _ENOUGH], _SUREST
    if not samples:
        return np.array([0.1, 0.06, 0.1, 0.06])
    rough = [1.4826 * np.median(np.abs(sample - np.median(sample, axis=0)), axis=0) for sample in samples]
    return np.asarray(np.percentile(rough, share, axis=0)) + 1e-3


def _shape_difference(forms: Forms) -> float:
    """How far the strokes of two instances of a letter lie apart, boxes laid over each other; line space."""
    first, count = forms.bodies.first[:-1], np.diff(forms.bodies.first)
    low = np.minimum.reduceat(forms.bodies.xy, first)
    sides = np.maximum(np.maximum.reduceat(forms.bodies.xy, first) - low, 1e-3)
    boxed = np.split((forms.bodies.xy - np.repeat(low, count, axis=0)) / np.repeat(sides, count, axis=0), first[1:])
    groups = [forms.hand.numbers_of_letter(letter) for letter in forms.hand.letters]
    pairs = [pair for numbers in groups if len(numbers) >= _ENOUGH for pair in pairwise(numbers.tolist())]
    if not pairs:
        return 0.01
    first_glyphs, second_glyphs = np.array(pairs).T
    squares = (square_distances(boxed[i], boxed[j]).min(axis=0) for i, j in pairs)
    away, size = np.concatenate([np.sort(np.sqrt(each)) for each in squares]), count[second_glyphs]
    first = np.cumsum(size) - size
    medians = (away[first + (size - 1) // 2] + away[first + size // 2]) / 2
    return float(np.median(medians * sides[first_glyphs].mean(axis=1)))
