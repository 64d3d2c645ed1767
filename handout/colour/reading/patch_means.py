"""The mean colour of each patch in a scan, and the shading of the page, which is taken out of it.

Shading is estimated from white and grey patches that come again and again over the page.  Lamp and lens act on all
colours by a factor; its logarithm is a polynomial of the place, of the degree that best predicts patches that it was
not fitted to.  Without shading the factor is constant, and nothing is changed.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from handout.colour.reading.registration import ChartPlacement
from handout.libraries import cv2
from handout.values import Array, readonly

INNER = 0.6  # of a patch's side is looked at
BLOCKS = 6  # along a side of that, each much larger than the dots of a printer: a mean of dots is what a patch is
_MOST = 10  # samples along a side of a block
_APART = 3.0  # deviations: a block further from the middle of all is dust, or an edge
_FLOOR = 1.0 / 255


@dataclass(frozen=True, eq=False)
class Sampled:
    """What was seen; n patches in the order of the page, in 0–1 of full scale.

    inside : (n,) bool, whether the whole inner part lies in the picture; elsewhere all is 0.
    values : (n, 3), mean of the blocks that are like most of the patch.
    blocks : (n, 6, 6, 3), means of the parts of a patch, from its top left.
    odd : (n,) share of blocks that are unlike the rest.
    high, low : (n, 3), share of pixels at the upper and lower end of the scale.
    distinct : how many different numbers there are among the samples.
    """

    inside: NDArray[np.bool_]
    values: Array
    blocks: Array
    odd: Array
    high: Array
    low: Array
    distinct: int


def sample(pixels: NDArray[Any], placement: ChartPlacement) -> Sampled:
    """Look at every patch.

    pixels : (h, w, 3) uint8 or uint16
    placement : where the page lies in them.
    """
    page = placement.page
    side = max(1, min(_MOST, math.ceil(INNER * page.pitch / placement.pixel / BLOCKS)))
    count = side * BLOCKS
    at = sample_grid(placement, (np.arange(count) + 0.5) / count)
    height, width = pixels.shape[:2]
    corners = at[:, [0, 0, -1, -1], [0, -1, 0, -1]]
    inside = np.asarray(((corners >= 0) & (corners <= (width - 1, height - 1))).all(axis=(1, 2)), dtype=bool)
    # samples down, patches across: a picture of OpenCV's has at most 32767 pixels a side
    maps = np.ascontiguousarray(at.reshape(len(at), -1, 2).transpose(1, 0, 2).astype(np.float32))
    samples = cv2.remap(pixels, maps[..., 0], maps[..., 1], cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    full = np.iinfo(pixels.dtype).max
    high, low = (samples == full).mean(axis=0), (samples == 0).mean(axis=0)
    parts = samples.reshape(BLOCKS, side, BLOCKS, side, len(at), 3).mean(axis=(1, 3), dtype=np.float64)
    blocks = parts.transpose(2, 0, 1, 3) / full
    # means (n, 3) of the blocks (n, m, 3) that are like most of their patch, and the share (n,) of the others
    flat = blocks.reshape(len(at), -1, 3)
    off = np.abs(flat - np.median(flat, axis=1, keepdims=True))
    spread = 1.4826 * np.median(off, axis=1, keepdims=True)
    like = np.asarray(off <= _APART * spread + _FLOOR).all(axis=2)
    weight = np.expand_dims(like, -1)
    values, odd = (flat * weight).sum(axis=1) / np.maximum(weight.sum(axis=1), 1), 1.0 - like.mean(axis=1)
    for array in (values, blocks, odd, high, low):
        array[~inside] = 0.0
    return Sampled(inside, values, blocks, odd, high, low, len(np.unique(samples[::7])))


def sample_grid(placement: ChartPlacement, parts: Array) -> Array:
    """(n, k, k, 2) pixels: a grid of points in each patch's inner part, `parts` (k,) being shares of its side."""
    page = placement.page
    xs, ys = (np.arange(size + 1) * page.pitch + start for size, start in
              zip((page.columns, page.rows), page.origin, strict=True))  # fmt: skip
    nodes = np.stack(np.meshgrid(xs, ys), axis=-1)
    pixels = placement.pixels(nodes.reshape(-1, 2)).reshape(nodes.shape)
    column, row = page.cells.T
    a, b, c, d = (pixels[row + j, column + i][:, None, None] for j, i in ((0, 0), (0, 1), (1, 0), (1, 1)))
    u = ((1 - INNER) / 2 + INNER * parts)[None, None, :, None]
    v = ((1 - INNER) / 2 + INNER * parts)[None, :, None, None]
    return np.asarray((1 - v) * ((1 - u) * a + u * b) + v * ((1 - u) * c + u * d))


_DEGREES = (0, 1, 2, 3)  # of the shading that is tried; set by eye
_AGAIN = 4  # times that a colour must come to be of use
_ROUNDS = 8
_DARKEST = 0.08  # values below it are mostly the scanner's own stray light


@dataclass(frozen=True, eq=False)
class Shading:
    """How light varies over a page: a factor, whose logarithm is a polynomial of the place.

    coefficients : (terms, 3); no terms: 1 everywhere.
    degree : of the polynomial.
    middle, half : (2,) mm, centre and half size of the area over which its variables run from −1 to 1.
    """

    coefficients: Array
    degree: int
    middle: Array
    half: Array

    def __post_init__(self) -> None:
        object.__setattr__(self, "coefficients", readonly(self.coefficients, None, 3))

    def factors_at(self, mm: Array) -> Array:
        """(n, 3) factors at points (n, 2) in mm."""
        return np.asarray(np.exp(_terms((mm - self.middle) / self.half, self.degree) @ self.coefficients))


def shading_of(values: Array, device: Array, mm: Array, usable: NDArray[np.bool_]) -> Shading:
    """The shading of a page.

    values : (n, 3): what was read of the patches, 0–1.
    device : (n, 3): what was printed.
    mm : (n, 2): middles of the patches.
    usable : (n,) bool

    Returns shading with a mean of 1 over the patches.
    """
    low, high = mm.min(axis=0), mm.max(axis=0)
    middle, half = (low + high) / 2, (high - low) / 2
    colours, group = np.unique(device, axis=0, return_inverse=True)
    group = group.ravel()
    neutral = (np.ptp(colours, axis=1) == 0) & (np.bincount(group[usable], minlength=len(colours)) >= _AGAIN)
    chosen = usable & neutral[group] & (values > _DARKEST).all(axis=1)
    none = Shading(np.zeros((0, 3)), 0, middle, half)
    if chosen.sum() < 3 * _AGAIN:
        return none
    levels = np.equal.outer(group[chosen], np.unique(group[chosen])).astype(np.float64)
    target, spot = np.log(values[chosen]), (mm[chosen] - middle) / half
    best, score = none, np.inf
    for degree in _DEGREES:
        design = np.hstack([levels, _terms(spot, degree)])
        if len(design) < 2 * design.shape[1]:
            break
        fitted, left_out = _robust_fit(design, target)
        # a higher degree has to be clearly better: each one more bends more between the patches
        if left_out < 0.98 * score:
            score, best = left_out, Shading(fitted[levels.shape[1] :], degree, middle, half)
    shift = np.log(best.factors_at(mm)).mean(axis=0)
    # the constant is the last of the terms: it is subtracted from the logarithm
    if best.degree == 0:
        return best
    coefficients = np.array(best.coefficients)
    coefficients[-1] -= shift
    return Shading(coefficients, best.degree, best.middle, best.half)


def _terms(spot: Array, degree: int) -> Array:
    """(n, terms): products of powers of x and y, the constant (which fitting leaves at 0) last; none for degree 0."""
    if degree == 0:
        return np.zeros((len(spot), 0))
    powers = [(i, total - i) for total in range(1, degree + 1) for i in range(total + 1)]
    columns = [spot[:, 0] ** i * spot[:, 1] ** j for i, j in powers]
    return np.column_stack([*columns, np.ones(len(spot))])


def _robust_fit(design: Array, target: Array) -> tuple[Array, float]:
    """Least squares (p, 3) that outliers do not move, and the mean absolute error at points left out."""
    weight = np.ones(len(design))
    answer: Array = np.zeros((design.shape[1], target.shape[1]))
    for _ in range(_ROUNDS):
        root = np.sqrt(weight)[:, None]
        answer = np.asarray(np.linalg.lstsq(design * root, target * root, rcond=None)[0], dtype=np.float64)
        off = np.abs(target - design @ answer).max(axis=1)
        scale = max(1.4826 * float(np.median(off)), 1e-6)
        weight = np.minimum(1.0, 2 * scale / np.maximum(off, 1e-9))
    inverse = np.linalg.pinv((design * weight[:, None]).T @ design)
    leverage = np.einsum("ij,jk,ik->i", design, inverse, design) * weight
    error = np.abs(target - design @ answer).max(axis=1) / np.maximum(1 - leverage, 0.05)
    return answer, float(np.minimum(error, 6 * np.median(error)).mean())
