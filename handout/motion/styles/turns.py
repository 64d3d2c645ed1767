"""The upper and lower turns of a path, made anew after an example: looped, rounded or sharp.

Source: own method; the numbers are set by eye on words of the drawn hands.
"""

from __future__ import annotations

import numpy as np

from handout.motion.timing import arc_length
from handout.peaks import peaks
from handout.values import Array

_LEAST = 0.15  # heights that a path goes to and fro at a turn
_LOOPED = 0.28  # loops in a height of an example's path: more than plain writing has, so that turns are looped
_ROUND = 0.22  # heights: turns that are as wide a tenth below them are round
_STRAIGHT = 0.6  # rad that a path turns in a height beside its corners: its ways are straight
_LOOP, _LOOP_SAMPLES = 0.6, 40  # heights, length of a loop; its samples
_OVAL, _BACK = 0.3, 0.7  # of its length, about its width; cosine of the angle of ways between which there is one
_DEPTH, _ROUND_DEPTH, _WAY = 0.22, 0.35, 0.5  # heights on either side of a turn that are made anew; of straight ways
_OPEN = 0.4  # of its width: what a turn that is made round must have; of others it would make a drop


def find_turns(path: Array, height: float) -> list[tuple[int, int]]:
    """Samples of a path (n, 2), y down, at its turns, rising, each with −1 for an upper and 1 for a lower one."""
    if len(path) < 5:
        return []
    found = [
        (at, side) for side in (-1, 1) for at in peaks(side * path[:, 1], prominence=_LEAST * height, apart=1).tolist()
    ]
    return sorted(found)


def shape_turn(path: Array, at: int, side: int, wanted: Array, height: float) -> Array | None:
    """The path (n, 2) with one turn shaped as those of an example; None: there is no room.

    at, side : as of `find_turns`; wanted : (9,) the manner of the example, see `measure_manner`; height : mm.
    """
    loops, turning, sided, corners, *widths = wanted[:6].tolist()
    looped, width = loops > _LOOPED, widths[side > 0] * height
    rounded = not looped and width > _ROUND * height
    straight = not looped and turning * (1 - corners) < _STRAIGHT
    depth = _LOOP if looped else _ROUND_DEPTH if rounded else _WAY if straight else _DEPTH
    off = np.hypot(*(path - path[at]).T) >= depth * height
    before, after = np.flatnonzero(off[:at]), np.flatnonzero(off[at:])
    i, j = (int(before[-1]) if len(before) else 0), (at + int(after[0]) if len(after) else len(path) - 1)
    if min(at - i, j - at) < 2:
        return None
    apex, first, last = path[at], path[i], path[j]
    if looped:
        into, out = apex - first, apex - last
        if into @ out < _BACK * np.hypot(*into) * np.hypot(*out):
            return None  # it does not turn back: with a loop it would be another letter
        axis, t = complex(*(into + out)) / 2, np.linspace(0.0, np.pi, _LOOP_SAMPLES)
        loop = axis * np.sin(t) * (np.sin(t) - _OVAL * np.sign(sided) * 1j * np.sin(2 * t))
        passing = first + 0.5 * (1 - np.cos(t[:, None])) * (last - first)
        return np.concatenate([path[:i], passing + np.column_stack([loop.real, loop.imag]), path[j + 1 :]])
    share = arc_length(path[i : j + 1])
    share = (share / share[-1])[:, None]
    middle, rest = float(share[at - i, 0]), 1 - share
    if not rounded:
        into, out = first + share / middle * (apex - first), last + rest / (1 - middle) * (apex - last)
        return np.concatenate([path[:i], np.where(share <= middle, into, out), path[j + 1 :]])
    if abs(last[0] - first[0]) < _OPEN * width:
        return None
    way = np.sign(path[min(at + 2, j), 0] - path[max(at - 2, i), 0]) or 1.0
    level = (apex[1] - 0.125 * (first[1] + last[1])) / 0.75  # of the controls of a cubic whose middle is at the apex
    one, other = (np.array([apex[0] + sign * way * 0.6 * width, level]) for sign in (-1, 1))
    piece = rest**3 * first + 3 * rest**2 * share * one + 3 * rest * share**2 * other + share**3 * last
    return np.concatenate([path[:i], piece, path[j + 1 :]])
