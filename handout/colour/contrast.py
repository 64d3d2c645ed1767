"""An S-shaped contrast curve that a scanner lays on its pictures, as the patches of a chart show it.

A tone of one ink is a mixture of paper and full ink: light of all three channels moves along a straight line between
both, or along one that is straight in a power of the light (Yule and Nielsen 1951), however dots grow.  A scanner's
gamma is such a power as well.  An S is none: it bends the ramps of inks, and what straightens them is its strength.
The pen's own lines tell it badly, because a line that is thinner looks much like one with more contrast.

Source: own method on the model of Yule, Nielsen and Neugebauer.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from handout.values import Array

_STRENGTHS = np.linspace(-0.3, 0.45, 26)  # beyond ±.5 a curve turns back
_POWERS = np.geomspace(0.3, 60.0, 48)  # of gamma × Yule and Nielsen's factor; beyond them nothing changes any more
_LEAST_TONES = 5  # of a ramp
_LEAST_RAMPS = 4
_SEEN = 1.1  # of the error without an S: printers whose drivers mix all inks into a ramp have 1.05 at most
_WEAKEST = 0.08  # of what makes a difference; sRGB's own curve looks like .06 at most
_DARKEST = 1e-3
_SHARES = np.linspace(0, 1, 1001)
_FULL = 255


def curved(share: Any, strength: float) -> NDArray[np.float64]:
    """What an S of some strength, −.5 to .5, makes of colours as shares of the paper's, 0–1."""
    v = np.asarray(share, dtype=np.float64)
    return np.asarray(v + 2 * strength * v * (1 - v) * (2 * v - 1))


def straightened(shown: Any, strength: float) -> NDArray[np.float64]:
    """The colours, 0–1, of which `curved` makes `shown`."""
    if not strength:
        return np.asarray(shown, dtype=np.float64)
    return np.asarray(np.interp(shown, curved(_SHARES, strength), _SHARES))


def of_chart(device: ArrayLike, scanned: ArrayLike) -> float:
    """Strength of the S that lies on the scan of a chart; 0 where none is seen, or where the chart cannot tell.

    Parameters
    ----------
    device : (n, 3) RGB that was sent, 0–1.
    scanned : (n, 3) RGB that was seen of it, 0–1.
    """
    levels = np.rint(np.asarray(device) * _FULL).astype(int)
    white = (levels == _FULL).all(axis=1)
    if not white.any():
        return 0.0
    seen = np.asarray(scanned, dtype=np.float64)
    ramps = list(_ramps(levels, np.clip(seen / seen[white].mean(axis=0), _DARKEST, 1)))
    if len(ramps) < _LEAST_RAMPS:
        return 0.0
    errors = np.sqrt([sum(_bent(ramp, leading, c) for ramp, leading in ramps) for c in _STRENGTHS])
    if np.interp(0, _STRENGTHS, errors) < _SEEN * errors.min():
        return 0.0
    strength = float(_STRENGTHS[errors.argmin()])
    return strength if abs(strength) >= _WEAKEST else 0.0


def _ramps(levels: NDArray[np.int_], shares: Array) -> Iterable[tuple[Array, int]]:
    """Tones (k, 3) of one ink from none to full, over bare paper or one other full ink, and the ink's channel."""
    for leading in range(3):
        others = [channel for channel in range(3) if channel != leading]
        for under in ((_FULL, _FULL), (0, _FULL), (_FULL, 0)):
            rows = np.flatnonzero((levels[:, others] == under).all(axis=1))
            rows = rows[np.argsort(-levels[rows, leading])]
            if len(rows) >= _LEAST_TONES and levels[rows[0], leading] == _FULL and levels[rows[-1], leading] == 0:
                yield shares[rows], leading


def _bent(ramp: Array, leading: int, strength: float) -> float:
    """Sum of squares by which a ramp is off a straight line without an S, in the power that makes it straightest."""
    straight = np.maximum(straightened(ramp, strength), _DARKEST) ** (1 / _POWERS[:, None, None])
    paper, full = straight[:, :1], straight[:, -1:]
    ink = (straight - paper)[..., leading] / (full - paper)[..., leading]
    line = paper + ink[..., None] * (full - paper)
    back = curved(np.maximum(line, 1e-6) ** _POWERS[:, None, None], strength)
    return float(np.square(back - ramp).sum(axis=(1, 2)).min())
