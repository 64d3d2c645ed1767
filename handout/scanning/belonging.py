"""Which line of writing every pixel of ink belongs to."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from handout.values import Array

_MIDDLE, _BAND = 0.5, 0.55  # x-heights: where the body of a line lies, and half its height
_UPPER = 0.9  # a speck above a line is nearer to it than one as far below: ascenders, dots and accents
_SHARED = 0.25  # a component with so much of its ink in a second body belongs to both lines


class Baseline(Protocol):
    """Where a line of writing lies.  x_height : of its small letters, pixels."""

    @property
    def x_height(self) -> float: ...

    def base(self, x: Array, /) -> Array:
        """y of the baseline at x, pixels."""
        ...


def owners(mask: NDArray[np.bool_], lines: Sequence[Baseline]) -> NDArray[np.int16]:
    """(h, w) int16: the number of the line that every pixel of ink belongs to, −1 for paper.

    A component belongs to the line in whose body it lies.  One that lies in the bodies of several is shared among them
    along its strokes: every pixel goes to the body that is nearest on the way through the ink.

    Parameters
    ----------
    mask : (h, w) bool, where there is ink.
    lines : at least one.
    """
    import cv2

    count, label, stats, _ = cv2.connectedComponentsWithStats(mask.astype(np.uint8), connectivity=8)
    y, x = np.nonzero(mask)
    part = label[y, x]
    over = np.stack([(line.base(x.astype(np.float64)) - y) / line.x_height - _MIDDLE for line in lines])
    inside = np.abs(over) < _BAND
    body = np.stack([np.bincount(part[one], minlength=count) for one in inside])
    away = np.where(over > 0, over * _UPPER, -over)
    far = np.stack([np.bincount(part, one, minlength=count) for one in away])
    most = body.max(axis=0)
    owner = np.where(most > 0, body.argmax(axis=0), far.argmin(axis=0)).astype(np.int16)
    own = np.where(mask, owner[label], np.int16(-1))
    for number in np.flatnonzero((body > _SHARED * np.maximum(most, 1)).sum(axis=0) > 1):
        left, top, wide, high, _ = stats[number]
        corner = (slice(top, top + high), slice(left, left + wide))
        piece = label[corner] == number
        among = np.flatnonzero(body[:, number] > _SHARED * most[number])
        own[corner][piece] = _shared(piece, (left, top), lines, among)[piece]
    return own


def _shared(
    piece: NDArray[np.bool_], corner: tuple[int, int], lines: Sequence[Baseline], among: NDArray[np.intp]
) -> NDArray[np.int16]:
    """(h, w) the line of every pixel of a component that lies in the bodies of several lines."""
    from skimage.segmentation import watershed

    y, x = np.nonzero(piece)
    seeds = np.zeros(piece.shape, dtype=np.int32)
    for number in among:
        line = lines[number]
        over = (line.base(x + float(corner[0])) - y - corner[1]) / line.x_height - _MIDDLE
        core = np.abs(over) < _BAND
        seeds[y[core], x[core]] = number + 1
    # on a level floor the flood from the bodies meets half way along the strokes
    flooded = watershed(np.zeros(piece.shape, np.uint8), seeds, mask=piece)  # type: ignore[no-untyped-call]
    return np.asarray(flooded - 1, dtype=np.int16)
