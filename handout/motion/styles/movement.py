"""A sequence of targets moved through in a style: optimal control with the style's covariances and guides.

Source: seed 003, §3 and §4.1; specification D2, D7–D10, D13.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from handout.motion import covariance
from handout.motion.guides import Guide
from handout.motion.optimal_control import HOLD, targets_through
from handout.motion.styles.style import Style
from handout.motion.tracker import STEPS, Ends, relative, tracker
from handout.values import Array

_ENDS = 0.2  # size of the first and the last target against the others: strokes begin and end where they were drawn
_TURN = 6  # targets before and after the turn of a ring that is drawn


def vector(angle: float) -> Array:
    """(2,) on the page, y down: the direction at an angle (rad) anticlockwise from the line of writing."""
    return np.array([math.cos(angle), -math.sin(angle)])


def move(
    points: Array,
    corner: NDArray[np.bool_],
    style: Style,
    height: float,
    rng: np.random.Generator,
    guide: Guide | None = None,
) -> tuple[Array, Array]:
    """The movement of a style near some points.

    Parameters
    ----------
    points : (m, 2) float, mm: where the curve would pass, one an interval.
    corner : (m,) bool: where the letter has one.
    style : Style
    height : mm, of a letter.
    rng : of the sizes of the targets, and of motor noise.
    guide : instead of the style's own.

    Returns
    -------
    t : (n,) float, s, from 0.
    xy : (n, 2) float, mm.
    """
    if len(points) == 1:
        return np.array([0.0, style.movement.interval]), np.repeat(points, 2, axis=0)
    xy = _path(points, covariances(corner, style, rng), style, height, rng, guide, style.movement.end)
    if style.movement.end == "free":  # the pen touches down and leaves in flight, above the first and the last target
        xy = xy[STEPS // 2 : len(xy) - STEPS // 2]
    return _clock(len(xy), style), xy


def around(
    points: Array,
    corner: NDArray[np.bool_],
    style: Style,
    height: float,
    rng: np.random.Generator,
    guide: Guide | None = None,
) -> tuple[Array, Array]:
    """The movement of a style around a ring, whose first point follows the last; it ends where it began.

    The ring is moved around several times, and one turn is taken out, so that nothing shows where it closes; a
    little of its beginning is drawn twice.  Parameters and values as in `move`.
    """
    m = len(points)
    sizes = covariances(corner, style, rng, ends=1.0)
    before = -(-_TURN // m) * m
    turns = np.arange(m + 2 * before) % m
    xy = _path(points[turns], sizes[turns], style, height, rng, guide, "free")
    first = before * STEPS + STEPS // 2
    turn = xy[first : first + m * STEPS + 1]
    turn = turn - np.linspace(-0.5, 0.5, len(turn))[:, None] * (turn[-1] - turn[0])
    xy = np.concatenate([turn, turn[1 : 1 + STEPS // 2]])
    return _clock(len(xy), style), xy


def _path(
    points: Array,
    spreads: Array,
    style: Style,
    height: float,
    rng: np.random.Generator,
    guide: Guide | None,
    ends: Ends,
) -> Array:
    """(m · steps, 2) mm: the path near the points, with motor noise."""
    movement = style.movement
    precision, usual = relative(spreads)
    solver = tracker(
        precision,
        smooth=movement.smooth,
        order=movement.order,
        ends=ends,
        hold=HOLD if ends == "rest" else 1.0,
        guide=guide or _guide(style),
    )
    through = targets_through(points, smooth=movement.drawn_at, order=movement.order)
    xy = solver.path(points + style.form.overshoot * (through - points))
    if style.jitter.size > 0:
        xy = xy + style.jitter.size * height * usual / _size(style) * solver.noise(rng, 2)
    return xy


def _clock(samples: int, style: Style) -> Array:
    return np.asarray(np.arange(samples, dtype=np.float64) * (style.movement.interval / STEPS))


def covariances(corner: NDArray[np.bool_], style: Style, rng: np.random.Generator, ends: float = _ENDS) -> Array:
    """(m, 2, 2): semi-tied covariances, of one oblique shape; sizes vary, and differ at corners and by `ends`."""
    shape = style.covariance
    sizes = np.exp(shape.spread * rng.standard_normal(len(corner)))
    sizes[corner] *= shape.corners**2
    sizes[[0, -1]] *= ends
    return covariance.semi_tied(_basis(style), sizes)


def _basis(style: Style) -> Array:
    """(2, 2): the oblique axes of the covariances, as columns."""
    shape = style.covariance
    return np.column_stack([size * vector(angle) for size, angle in zip(shape.axes, shape.angles, strict=True)])


def _size(style: Style) -> float:
    """Geometric mean of the standard deviations of a usual target, in the unit of `covariances`."""
    return math.sqrt(abs(float(np.linalg.det(_basis(style)))))


def _guide(style: Style) -> Guide | None:
    guide = style.guide
    if guide.mode == "none" or guide.strength == 0:
        return None
    return Guide(vector(guide.direction), guide.strength, guide.mode)
