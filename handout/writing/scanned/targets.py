"""What a hand aimed at when it wrote a glyph: the ends of its lines, where they meet, and where they bend most.

Source: seed 002, §3.2 (key points).
"""

from __future__ import annotations

import numpy as np

from handout.branching import branches
from handout.peaks import peaks
from handout.values import Array, Indices

_ARM = 8  # vertices on either side, whose directions are compared
_BEND = 0.35  # rad that a bend must stand out
_BETWEEN = 5  # vertices between two bends
_APART = 3.2  # half widths between two targets


def targets(xy: Array, radius: Array, edges: Indices) -> Array:
    """(k, 2): the targets of a line, none very near another.

    Parameters
    ----------
    xy, radius, edges : as in `values.LineGraph`.
    """
    apart = _APART * float(np.median(radius))
    kept: list[Array] = []
    for branch in branches(edges, len(xy)):
        line = xy[branch]
        for place in line[[0, len(line) - 1, *_bends(line)]]:
            if all(np.hypot(*(place - other)) > apart for other in kept):
                kept.append(place)
    return np.array(kept)


def _bends(line: Array) -> list[int]:
    """Where a line (n, 2) bends most."""
    if len(line) < 2 * _ARM:
        return []
    arm = min(_ARM, len(line) // 4)
    ahead = line[arm:] @ np.array([1.0, 1j]) - line[:-arm] @ np.array([1.0, 1j])
    turned = np.abs(np.angle(ahead[arm:] * np.conj(ahead[:-arm])))
    return [int(peak) + arm for peak in peaks(turned, prominence=_BEND, apart=_BETWEEN)]
