"""A recorded pen with what is written, and how large the writing is."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from handout.summary import one_line
from handout.values import Array, Drawing, Indices, Stroke

_TURN = 0.08  # of a stroke's usual height: a turn back that is smaller is none
_LEAST = 8  # turns of the pen, of writing whose size can be told


@dataclass(frozen=True, eq=False)
class Recording:
    """A recorded page with what is written on it.

    name : for messages.
    text : "" where the recording itself is to say it.
    letters : for every stroke (n,) int, index of the grapheme of the text that each sample writes; () if not known.
    lines : how many lines of writing there are, if that is known.
    small : height of a small letter, mm; 0 if not known.
    """

    name: str
    drawing: Drawing
    text: str = ""
    letters: tuple[Indices, ...] = ()
    lines: int | None = None
    small: float = 0.0

    __repr__ = one_line


def x_height(strokes: Sequence[Stroke]) -> float:
    """Height of a small letter, mm, which is what most ups and downs of a pen have; 0 if there are too few."""
    heights = np.concatenate([np.zeros(0), *(np.abs(np.diff(one)) for one in turns(strokes))])
    return float(np.median(heights)) if len(heights) >= _LEAST else 0.0


def turns(strokes: Sequence[Stroke]) -> list[Array]:
    """Of every stroke that is no dot or bar the heights y between which the pen goes up and down."""
    high = [float(np.ptp(stroke.xy[:, 1])) for stroke in strokes]
    usual = float(np.median([h for h in high if h > 0.1 * max(high)] or [0.0]))
    found = [_turning(stroke.xy[:, 1], _TURN * usual) for stroke, h in zip(strokes, high, strict=True) if h > 0]
    return [one for one in found if len(one) > 1]


def _turning(y: Array, least: float) -> Array:
    """The extremes of `y` in turn, each more than `least` from the one before; both ends count as such."""
    found, way, far = [float(y[0])], 0, float(y[0])
    for value in y.tolist():
        if way * (value - far) >= 0 and (way or abs(value - found[0]) > least):
            way, far = way or (1 if value > found[0] else -1), value
        elif way and abs(value - far) > least:
            found.append(far)
            way, far = -way, value
    return np.array([*found, far] if way else found)
