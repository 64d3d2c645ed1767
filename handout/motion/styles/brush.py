"""Width of the mark along a movement.

Source: seed 003, §4 (the brush grows as the speed falls: width ~ 1 / (c + speed)).
"""

from __future__ import annotations

import numpy as np
from scipy.ndimage import gaussian_filter1d

from handout.motion.styles.style import Style
from handout.values import NIB_THICKNESS, Array

_EVEN = 2.0  # samples over which a width is smoothed: a pen does not swell at once
_REST = 0.65  # of its usual speed: slower makes no wider mark
_TIP = 0.12  # share of the width that a tapered end keeps


def widths(t: Array, xy: Array, style: Style, height: float, *, tapered: bool = True) -> Array:
    """(n,) float, mm: width of the mark of a movement (t s, xy mm) in a style, where letters have that height."""
    brush = style.brush
    full, thin = brush.width * height, brush.thin * brush.width * height
    if len(t) < 3 or not np.ptp(xy, axis=0).any():
        return np.full(len(t), full)
    velocity = np.gradient(xy, t, axis=0)
    speed = np.hypot(velocity[:, 0], velocity[:, 1])
    if brush.kind == "speed":
        # of its own usual speed, so that small letters, whose strokes take as long as those of large ones, are no
        # bolder; a pen that comes to rest gives a little more, not a blob
        speed = np.maximum(speed / np.sqrt(np.mean(speed**2)), _REST)
        width = thin + (full - thin) * (brush.pace + _REST) / (brush.pace + speed)
        width = gaussian_filter1d(width, _EVEN, mode="nearest")
    elif brush.kind == "nib":
        along = _directions(xy)
        width = full * np.hypot(np.sin(along + brush.angle), NIB_THICKNESS)
    elif brush.kind == "pointed":
        pull = np.clip(velocity[:, 1] / np.maximum(speed, 1e-9 * speed.max()), 0.0, 1.0)
        ease = np.minimum(1.0, speed / (0.3 * speed.max()))
        width = gaussian_filter1d(thin + (full - thin) * pull**2 * ease, 2 * _EVEN, mode="nearest")
    else:
        width = np.full(len(t), full)
    return np.asarray(width * _tapered(xy, brush.taper * height) if tapered else width)


def _directions(xy: Array) -> Array:
    """(n,) rad on the page: where the pen is going; at rest, where it last went or will go."""
    step = np.gradient(xy, axis=0)
    moving = np.flatnonzero(np.hypot(step[:, 0], step[:, 1]) > 1e-6 * np.ptp(xy, axis=0).max())
    nearest = moving[np.clip(np.searchsorted(moving, np.arange(len(xy))), 0, len(moving) - 1)]
    return np.asarray(np.arctan2(step[nearest, 1], step[nearest, 0]))


def _tapered(xy: Array, length: float) -> Array:
    """(n,) shares of the width: thin at both ends of a movement over that length (mm)."""
    if length <= 0:
        return np.ones(len(xy))
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(xy, axis=0), axis=1))])
    length = min(length, 0.45 * float(along[-1])) or 1.0
    inside = np.clip(np.minimum(along, along[-1] - along) / length, 0.0, 1.0)
    return np.asarray(_TIP + (1 - _TIP) * inside**0.7)
