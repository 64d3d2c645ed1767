"""What a scan shows in each patch: the mean of its inner part, and how even it is."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from handout.colour.reading.registration import Placement
from handout.values import Array

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


def sample(pixels: NDArray[Any], placement: Placement) -> Sampled:
    """Look at every patch.

    Parameters
    ----------
    pixels : (h, w, 3) uint8 or uint16
    placement : Placement
        Where the page lies in them.
    """
    import cv2

    page = placement.page
    side = max(1, min(_MOST, math.ceil(INNER * page.pitch / placement.pixel / BLOCKS)))
    count = side * BLOCKS
    at = placed(placement, (np.arange(count) + 0.5) / count)
    height, width = pixels.shape[:2]
    corners = at[:, [0, 0, -1, -1], [0, -1, 0, -1]]
    inside = np.asarray(((corners >= 0) & (corners <= (width - 1, height - 1))).all(axis=(1, 2)), dtype=bool)
    # samples down, patches across: a picture of OpenCV's has at most 32767 pixels a side
    maps = np.ascontiguousarray(at.reshape(len(at), -1, 2).transpose(1, 0, 2).astype(np.float32))
    seen = cv2.remap(pixels, maps[..., 0], maps[..., 1], cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    full = np.iinfo(pixels.dtype).max
    high, low = (seen == full).mean(axis=0), (seen == 0).mean(axis=0)
    parts = seen.reshape(BLOCKS, side, BLOCKS, side, len(at), 3).mean(axis=(1, 3), dtype=np.float64)
    blocks = parts.transpose(2, 0, 1, 3) / full
    values, odd = _robust(blocks.reshape(len(at), -1, 3))
    for array in (values, blocks, odd, high, low):
        array[~inside] = 0.0
    return Sampled(inside, values, blocks, odd, high, low, len(np.unique(seen[::7])))


def placed(placement: Placement, parts: Array) -> Array:
    """(n, len(parts), len(parts), 2) pixels: a grid in each patch's inner part, at such parts of its side."""
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


def _robust(blocks: Array) -> tuple[Array, Array]:
    """Means (n, 3) of the blocks (n, m, 3) that are like most of their patch, and the share (n,) of the others."""
    middle = np.median(blocks, axis=1, keepdims=True)
    off = np.abs(blocks - middle)
    spread = 1.4826 * np.median(off, axis=1, keepdims=True)
    like = np.asarray(off <= _APART * spread + _FLOOR).all(axis=2)
    weight = np.expand_dims(like, -1)
    return (blocks * weight).sum(axis=1) / np.maximum(weight.sum(axis=1), 1), 1.0 - like.mean(axis=1)
