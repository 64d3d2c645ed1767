"""Where a row of values has its peaks, without the seconds that `scipy.signal` takes to be imported."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

Indices = NDArray[np.intp]


def peaks(values: NDArray[np.float64], *, prominence: float, apart: int = 1) -> Indices:
    """Places of values higher than those on either side, of a level top its middle, as `scipy.signal.find_peaks`.

    values : (n,) float.
    prominence : 0 or more: how far one must go down from a peak, on both sides, before anything higher comes.
    apart : least distance of two peaks; the higher one stays.
    """
    places = _tops(values)
    if apart > 1:
        places = _keep_apart(places, values[places], apart)
    places = places[values[places] - values.min(initial=np.inf) >= prominence]
    row = values.tolist()
    stands = [
        _falls(row, range(top - 1, -1, -1), row[top], prominence)
        and _falls(row, range(top + 1, len(row)), row[top], prominence)
        for top in places.tolist()
    ]
    return np.asarray(places[np.array(stands, dtype=bool)])


def _tops(values: NDArray[np.float64]) -> Indices:
    """Middles of level stretches that are higher than what is on both sides of them."""
    if len(values) < 3:
        return np.zeros(0, dtype=np.intp)
    rises = np.diff(values)
    steps = np.flatnonzero(rises != 0)
    up = rises[steps] > 0
    top = up[:-1] & ~up[1:]
    return np.asarray((steps[:-1][top] + 1 + steps[1:][top]) // 2)


def _keep_apart(places: Indices, height: NDArray[np.float64], apart: int) -> Indices:
    """Peaks without those that are too near to a higher one."""
    keep = np.ones(len(places), dtype=bool)
    for peak in np.argsort(height)[::-1].tolist():
        if keep[peak]:
            near = np.abs(places - places[peak]) < apart
            near[peak] = False
            keep[near] = False
    return places[keep]


def _falls(row: list[float], way: Iterable[int], top: float, by: float) -> bool:
    """Whether the values along `way` fall by `by` from `top` before one is higher."""
    for place in way:
        if row[place] > top:
            return False
        if top - row[place] >= by:
            return True
    return False
