"""What a stroke looks like around each of its samples, as numbers by which similar places are found.

Strokes are resampled evenly along their length, one sample a hand unit (a twentieth of a letter's height).  Every
feature begins with how near the stroke's ends are, since a pen lands and leaves in ways of its own.

Source: seed 001, §4.1; Belongie, Malik & Puzicha 2001 (shape contexts).
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np
from numpy.typing import NDArray

from handout.values import Array

Features = NDArray[np.float32]

UNITS = (
    20.0  # hand units in the height of a letter, 1.5 x-heights: strokes are 40 to 80 samples long, as in the source.
)
# Measured on two writers of its recordings: r of what is synthesised is .36, .49, .54 and .56 at 60, 30, 20 and 15
TAPS = 7  # before a sample, and after it; the source's
_WIDENING = 1.35  # of each tap against the one nearer the sample: seven reach 20 samples, half an x-height
_SHAPE = 0.3  # weight of the shape against the ends; the source's
_HISTORY = 32  # samples before, and after, that shape contexts see; the source uses 25 to 40
_ANGLES, _RADII = 6, 5  # bins of a shape context; the source's
_NEAREST = 2.0  # samples: outer edge of the innermost ring


def resample_path(xy: Array, unit: float) -> tuple[Array, Array]:
    """A path (m, 2), mm, evenly sampled along its length.

    Returns points : (n, 2) float, hand units of `unit` mm, about one apart; one point where the path is shorter than
        half that.
        at : (n,) float: which sample of the path each is, between its whole numbers.
    """
    scaled = xy / unit
    step = np.hypot(*np.diff(scaled, axis=0).T)
    along = np.concatenate([[0.0], np.cumsum(step)])
    count = round(float(along[-1]))
    if count == 0:
        return scaled[:1], np.zeros(1)
    moved = np.concatenate([[True], step > 0])
    place = np.linspace(0.0, along[-1], count + 1)
    at = np.interp(place, along[moved], np.flatnonzero(moved))
    return np.column_stack([np.interp(place, along[moved], scaled[moved, i]) for i in (0, 1)]), at


def velocities(xy: Array) -> Array:
    """(n, 2): from each sample's forerunner to it; the first has that of the second."""
    step = np.diff(xy, axis=0)
    return np.concatenate([step[:1], step]) if len(step) else np.zeros((1, 2))


def _ends(xy: Array, reach: float) -> Array:
    """(n, 2) in 0–1: how far the beginning and the end of the stroke are; 1 beyond `reach` samples."""
    n = np.arange(len(xy), dtype=np.float64)
    return np.sqrt(np.minimum(1.0, np.column_stack([n, n[::-1]]) / reach))


@cache
def _filters() -> Array:
    """(2 reach + 1, taps): triangles over the samples around one; each ends where its neighbours have their middles."""
    beyond = np.concatenate([[0.0], np.cumsum(_WIDENING ** np.arange(TAPS + 1))])
    centres = np.concatenate([-beyond[:0:-1], beyond])
    reach = int(np.ceil(centres[-1]))
    away = np.arange(-reach, reach + 1)[:, None]
    left, middle, right = centres[:-2], centres[1:-1], centres[2:]
    return np.asarray(np.maximum(np.minimum((away - left) / (middle - left), (right - away) / (right - middle)), 0.0))


def filtered_velocities(xy: Array) -> Features:
    """(n, 32) features of a stroke (n, 2) in hand units: mean velocities, over more samples the further away they are.

    Source: seed 001, §4.1.2; taps beyond the ends are 0, those across them means of the samples that there are.
    """
    weights = _filters()
    reach, n = len(weights) // 2, len(xy)
    padded = np.zeros((3, n + 2 * reach))
    padded[:2, reach : reach + n] = velocities(xy).T
    padded[2, reach : reach + n] = 1.0
    x, y, there = np.lib.stride_tricks.sliding_window_view(padded, len(weights), axis=1) @ weights
    there = np.maximum(there, 1e-9)
    shape = np.stack([x / there, y / there], axis=2).reshape(n, -1)
    widest = float(_WIDENING ** np.arange(TAPS) @ np.ones(TAPS))
    return np.concatenate([_ends(xy, widest), _SHAPE * shape], axis=1).astype(np.float32)


def shape_contexts(xy: Array) -> Features:
    """(n, 62) features of a stroke (n, 2) in hand units: where the samples before and after lie, in polar bins.

    Each half is a histogram of 6 angles and 5 logarithmic radii, divided by the samples that a half holds.

    Source: seed 001, §4.1.1.
    """
    n = len(xy)
    edges = np.geomspace(_NEAREST, _HISTORY, _RADII)
    bins = np.zeros((n, 2, _ANGLES * _RADII))
    for half, way in enumerate((-1, 1)):
        away = np.arange(1, _HISTORY + 1) * way
        other = np.arange(n)[:, None] + away
        inside = (other >= 0) & (other < n)
        offset = (xy[np.clip(other, 0, n - 1)] - xy[:, None]) @ np.array([1.0, 1j])
        angle = np.floor(np.angle(offset) / (2 * np.pi) * _ANGLES).astype(np.intp) % _ANGLES
        radius = np.minimum(np.searchsorted(edges, np.abs(offset)), _RADII - 1)
        rows, columns = np.nonzero(inside)
        cell = (rows * 2 + half) * _ANGLES * _RADII + (angle * _RADII + radius)[rows, columns]
        np.add.at(bins.reshape(-1), cell, 1.0 / _HISTORY)
    return np.concatenate([_ends(xy, _HISTORY), _SHAPE * bins.reshape(n, -1)], axis=1).astype(np.float32)


FEATURES: dict[str, Callable[[Array], Features]] = {
    "velocities": filtered_velocities,
    "shape-contexts": shape_contexts,
}
