"""What a pen recorded along a line (pressure, tilt, azimuth, rotation), carried to a movement that is made anew.

A channel is read off where each target lies along the recorded line, as a share of its length, and between targets it
changes evenly.  Angles go the shorter way round.

Source: own method.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from handout.motion.tracker import STEPS
from handout.values import POSE, TURNS, Array, Stroke


def at_targets(stroke: Stroke, points: Array, *, ring: bool) -> dict[str, Array]:
    """The channels of a stroke, (m,) each, at targets (m, 2) that were found along it.

    ring : the targets may begin anywhere on the line, which is closed.
    """
    there = stroke.pose
    if not there:
        return {}
    along, whole = _shares(stroke.xy)
    at, length = _shares(points)
    if ring:
        # the last of a ring's targets is not its first again
        length += float(np.linalg.norm(points[0] - points[-1]))
        begin = along[np.linalg.norm(stroke.xy - points[0], axis=1).argmin()] / max(whole, 1e-12)
        share = (begin + at / max(length, 1e-12)) % 1.0
    else:
        share = at / max(length, 1e-12)
    turned = {name: np.unwrap(values) if name in TURNS else values for name, values in there.items()}
    return {name: np.interp(share * whole, along, values) for name, values in turned.items()}


def _shares(xy: Array) -> tuple[Array, float]:
    """(n,) mm along a path, and all of it."""
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(xy, axis=0), axis=1))])
    return along, float(along[-1])


def together(parts: Sequence[Mapping[str, Array]], sizes: Sequence[int], kept: NDArray[np.bool_]) -> dict[str, Array]:
    """Channels of sequences of targets that are joined, of so many targets each; those that all of them have."""
    shared = [name for name in POSE if all(name in part for part in parts)]
    assert len(kept) == sum(sizes)
    joined = {name: np.concatenate([part[name] for part in parts])[kept] for name in shared}
    return {name: np.unwrap(values) if name in TURNS else values for name, values in joined.items()}


def along(channels: Mapping[str, Array], samples: int, *, free: bool, ring: bool) -> dict[str, Array]:
    """(samples,) each: channels at targets as they are along the movement through these.

    free, ring : whether the movement begins and ends at its targets' own places, and whether it comes round again.
    """
    made = {}
    for name, values in channels.items():
        if name in TURNS:
            values = np.unwrap(values)
        number = np.arange(samples) / STEPS if free or ring else (np.arange(samples) + 0.5) / STEPS - 0.5
        if ring:
            whole = np.append(values, values[0])
            made[name] = np.interp(number % len(values), np.arange(len(whole)), whole)
        else:
            made[name] = np.interp(number, np.arange(len(values)), values)
    return made
