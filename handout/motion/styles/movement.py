"""A sequence of targets moved through in a style: where the pen is, how wide its mark is, and how it is held.

The path is that of optimal control with the style's covariances and guides.  The width follows speed, direction or
pull, by the style's brush.  What a pen recorded along a line (pressure, tilt, azimuth, rotation) is read off where each
target lies, as a share of the line's length, and changes evenly between targets.

Source: seed 003, §3, §4.1 and §4 (a brush grows as the speed falls: width ~ 1 / (c + speed)); the pose: own method.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from handout.libraries import ndimage
from handout.motion import covariance
from handout.motion.optimal_control import HOLD, targets_through
from handout.motion.styles.style import Style
from handout.motion.tracker import STEPS, Ends, Guide, relative, tracker
from handout.values import NIB_THICKNESS, POSE, TURNS, Array, Stroke

_ENDS = 0.2  # size of the first and the last target against the others: strokes begin and end where they were drawn
_TURN = 6  # targets before and after the turn of a ring that is drawn
_EVEN = 2.0  # samples over which a width is smoothed: a pen does not swell at once
_REST = 0.65  # of its usual speed: slower makes no wider mark
_TIP = 0.12  # share of the width that a tapered end keeps


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
    spreads: Array | None = None,
) -> tuple[Array, Array]:
    """The movement of a style near some points.

    points : (m, 2) float, mm: where the curve would pass, one an interval.
    corner : (m,) bool: where the letter has one.
    height : mm, of a letter.
    rng : of the sizes of the targets, and of motor noise.
    guide : instead of the style's own.
    spreads : (m, 2, 2), covariances of the points instead of the style's own; only their relative sizes matter.

    Returns t : (n,) float, s, from 0.
        xy : (n, 2) float, mm.
    """
    if len(points) == 1:
        return np.array([0.0, style.movement.interval]), np.repeat(points, 2, axis=0)
    sizes = covariances(corner, style, rng) if spreads is None else covariance.settle_covariances(spreads, points)
    xy = _path(points, sizes, style, height, rng, guide, style.movement.end)
    if style.movement.end == "free":  # the pen touches down and leaves in flight, above the first and the last target
        xy = xy[STEPS // 2 : len(xy) - STEPS // 2]
    return _clock(len(xy), style), xy


def move_around(
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
    if not guide and style.guide.mode != "none" and style.guide.strength != 0:
        guide = Guide(vector(style.guide.direction), style.guide.strength, style.guide.mode)
    solver = tracker(
        precision,
        smooth=movement.smooth,
        order=movement.order,
        ends=ends,
        hold=HOLD if ends == "rest" else 1.0,
        guide=guide,
    )
    through = targets_through(points, smooth=movement.drawn_at, order=movement.order)
    xy = solver.path(points + style.form.overshoot * (through - points))
    if style.jitter.size > 0:
        # the geometric mean of the standard deviations of a usual target
        size = math.sqrt(abs(float(np.linalg.det(_basis(style)))))
        xy = xy + style.jitter.size * height * usual / size * solver.noise(rng, 2)
    return xy


def _clock(samples: int, style: Style) -> Array:
    return np.asarray(np.arange(samples, dtype=np.float64) * (style.movement.interval / STEPS))


def covariances(corner: NDArray[np.bool_], style: Style, rng: np.random.Generator, ends: float = _ENDS) -> Array:
    """(m, 2, 2): semi-tied covariances, of one oblique shape; sizes vary, and differ at corners and by `ends`."""
    shape = style.covariance
    sizes = np.exp(shape.spread * rng.standard_normal(len(corner)))
    sizes[corner] *= shape.corners**2
    sizes[[0, -1]] *= ends
    return covariance.tie_covariances(_basis(style), sizes)


def _basis(style: Style) -> Array:
    """(2, 2): the oblique axes of the covariances, as columns."""
    shape = style.covariance
    return np.column_stack([size * vector(angle) for size, angle in zip(shape.axes, shape.angles, strict=True)])


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
        width = ndimage.gaussian_filter1d(width, _EVEN, mode="nearest")
    elif brush.kind == "nib":
        # (n,) rad on the page: where the pen is going; at rest, where it last went or will go
        step = np.gradient(xy, axis=0)
        moving = np.flatnonzero(np.hypot(step[:, 0], step[:, 1]) > 1e-6 * np.ptp(xy, axis=0).max())
        nearest = moving[np.clip(np.searchsorted(moving, np.arange(len(xy))), 0, len(moving) - 1)]
        along = np.arctan2(step[nearest, 1], step[nearest, 0])
        width = full * np.hypot(np.sin(along + brush.angle), NIB_THICKNESS)
    elif brush.kind == "pointed":
        pull = np.clip(velocity[:, 1] / np.maximum(speed, 1e-9 * speed.max()), 0.0, 1.0)
        ease = np.minimum(1.0, speed / (0.3 * speed.max()))
        width = ndimage.gaussian_filter1d(thin + (full - thin) * pull**2 * ease, 2 * _EVEN, mode="nearest")
    else:
        width = np.full(len(t), full)
    if tapered and brush.taper * height > 0:  # thin at both ends
        along, whole = _measure_path(xy)
        inside = np.minimum(along, whole - along) / (min(brush.taper * height, 0.45 * whole) or 1.0)
        width = width * (_TIP + (1 - _TIP) * np.clip(inside, 0.0, 1.0) ** 0.7)
    return np.asarray(width)


def pose_at_targets(stroke: Stroke, points: Array, *, ring: bool) -> dict[str, Array]:
    """The channels of a stroke, (m,) each, at targets (m, 2) that were found along it.

    ring : the targets may begin anywhere on the line, which is closed.
    """
    there = stroke.pose
    if not there:
        return {}
    along, whole = _measure_path(stroke.xy)
    at, length = _measure_path(points)
    if ring:
        # the last of a ring's targets is not its first again
        length += float(np.linalg.norm(points[0] - points[-1]))
        begin = along[np.linalg.norm(stroke.xy - points[0], axis=1).argmin()] / max(whole, 1e-12)
        share = (begin + at / max(length, 1e-12)) % 1.0
    else:
        share = at / max(length, 1e-12)
    turned = {name: np.unwrap(values) if name in TURNS else values for name, values in there.items()}
    return {name: np.interp(share * whole, along, values) for name, values in turned.items()}


def _measure_path(xy: Array) -> tuple[Array, float]:
    """(n,) mm: lengths along a path, and its whole length."""
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(xy, axis=0), axis=1))])
    return along, float(along[-1])


def join_poses(
    parts: Sequence[Mapping[str, Array]], sizes: Sequence[int], remaining: NDArray[np.bool_]
) -> dict[str, Array]:
    """Channels of sequences of targets that are joined, of so many targets each; those that all of them have."""
    shared = [name for name in POSE if all(name in part for part in parts)]
    assert len(remaining) == sum(sizes)
    joined = {name: np.concatenate([part[name] for part in parts])[remaining] for name in shared}
    return {name: np.unwrap(values) if name in TURNS else values for name, values in joined.items()}


def pose_along(channels: Mapping[str, Array], samples: int, *, free: bool, ring: bool) -> dict[str, Array]:
    """(samples,) each: channels at targets as they are along the movement through these.

    free, ring : whether the movement begins and ends at its targets' own places, and whether it comes round again.
    """
    joined = {}
    for name, values in channels.items():
        if name in TURNS:
            values = np.unwrap(values)
        number = np.arange(samples) / STEPS if free or ring else (np.arange(samples) + 0.5) / STEPS - 0.5
        if ring:
            whole = np.append(values, values[0])
            joined[name] = np.interp(number % len(values), np.arange(len(whole)), whole)
        else:
            joined[name] = np.interp(number, np.arange(len(values)), values)
    return joined
