"""What a form of a letter says of a pen's way over a network: which branches come when, in which direction.

Most ways over a letter of many strokes cost a hand about the same, so that the one that was written need not be among
the cheapest.  A guide changes what movements cost, so that a search finds the way that a form would take.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from handout.motion.recovery.likeness import aims
from handout.motion.recovery.network import Network
from handout.values import Array

_PLACES = 6  # of a branch that are compared with a form
_NEAR = 0.82  # of a letter's size: places so far apart are unlike
_AIMED = 0.59  # cost of a right angle between directions
_PASSED = 10.0  # cost of passing a whole letter, for one of unlikeness
_LEFT_OUT = 15.0  # cost of leaving out a whole form, or going back over it
_MOST_LEFT_OUT = 0.3  # of a form
_LIFTED = 2.0  # spared where the form is lifted for, too, or cost of going on there
_TINY = 5.0  # half widths: a branch so short is a crossing drawn out, which may be passed at any time


@dataclass(frozen=True, eq=False)
class Guide:
    """What movements cost more, or less, where a form is followed.

    passing : (2 b,) of passing the branch that is left for by each end.
    onward, air : (2 b, 2 b) of passing one after another, without and with a lift.
    """

    passing: Array
    onward: Array
    air: Array


def guides(net: Network, laid: Array, of: NDArray[np.intp]) -> Iterator[Guide]:
    """A guide for each of some forms.

    Parameters
    ----------
    laid : (f, s, 2) float: forms of the letter, laid over it; of : (f, s) int: the stroke that each place is on.
    """
    count = 2 * len(net.branches)
    places = np.array([_spread(net.xy[net.way(end)]) for end in range(count)])
    size = max(float(np.sqrt((places.reshape(-1, 2).std(axis=0) ** 2).sum())), 1e-9)
    share = np.repeat(net.length / max(float(net.length.sum()), 1e-9), 2)
    tiny = np.repeat(net.length < _TINY, 2)
    aimed = aims(places)
    for form, stroke in zip(laid, of, strict=True):
        away = ((places[:, :, None] - form) ** 2).sum(axis=-1) / (size * _NEAR) ** 2
        cost = away + _AIMED * (1 - aimed @ aims(form[None])[0].T)
        unlike, begin, end = _matched(cost, stroke)
        left_out = np.abs(begin[None] - end[:, None] - 0.5) / len(form)
        left_out[tiny] = 0.0
        left_out[:, tiny] = 0.0
        price = _LEFT_OUT * np.minimum(left_out, _MOST_LEFT_OUT)
        parted = stroke[end][:, None] != stroke[begin][None]
        yield Guide(_PASSED * share * unlike, price + _LIFTED * parted, price - _LIFTED * parted)


def _spread(xy: Array) -> Array:
    """(`_PLACES`, 2): places at even distances on a way."""
    if len(xy) < 2:
        return np.repeat(xy, _PLACES, axis=0)
    run = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(xy, axis=0).T))])
    at = np.linspace(0.0, run[-1], _PLACES)
    return np.column_stack([np.interp(at, run, xy[:, k]) for k in (0, 1)])


def _matched(cost: Array, stroke: NDArray[np.intp]) -> tuple[Array, NDArray[np.intp], NDArray[np.intp]]:
    """The part of one stroke of a form that each of some ways is most like: how unlike, and its first and last place.

    cost : (e, p, s): of each place of each way at each of the form.
    """
    count = cost.shape[2]
    total, first = cost[:, 0].copy(), np.tile(np.arange(count), (len(cost), 1))
    here = np.arange(count)
    barred = np.where((stroke[:, None] == stroke) & (here[:, None] <= here), 0.0, np.inf)  # before, after
    for place in range(1, cost.shape[1]):
        ways = total[:, :, None] + barred
        before = ways.argmin(axis=1)
        total = np.take_along_axis(total, before, axis=1) + cost[:, place]
        first = np.take_along_axis(first, before, axis=1)
    last = total.argmin(axis=1)
    rows = np.arange(len(cost))
    return total[rows, last] / cost.shape[1], first[rows, last], last
