"""Drawings whose pen is held as in a pose library, and which may be drawn as its writer draws.

To draw a stroke as the writer does, the library's movements along it are held to where it was meant to go.  The
velocities that the library suggests, added up, drift away from the stroke.  So places are sought whose steps and bends
are those of the velocities, and which lie near the stroke at a few anchors: near its ends, where it turns sharply, and
at the vertices of a polygon through the rest.  That is a linear least-squares problem whose matrix has five diagonals.

Source: seed 001, §4.3.2.  In eq. 4 as printed the bends near the anchors are to be those of the stroke, which brings
back its shakiness; here they are those of the library, as the text says.  McCrae & Singh 2009 for the polygon.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any, Literal

import numpy as np
from scipy.linalg import solveh_banded

from handout.errors import InputError
from handout.motion.pose.features import UNITS, resample_path
from handout.motion.pose.library import extract_channels
from handout.motion.pose.synthesis import PoseModel
from handout.motion.styles.targets import letter_height
from handout.values import POSE, Array, Drawing, Indices, Stroke

Passes = Literal[0, 1, 2]

_SPARSE = 2.0  # hand units between samples, from which on others are put between them
_HOLD, _BEND = 0.25, 2.0  # weights of the anchors and of the bends there; the source's
_NEAR = 2  # samples on either side of an anchor whose bends count; the source's
_FROM_ENDS = 3  # samples: "a few"
_ARM = 4  # samples on either side between which a turn is measured, about the width of an n's arch
_SHARP = np.radians(60)  # the source's
_VERTEX = 8.0  # squares of hand units that a vertex of the polygon must save; set by eye
_LONGEST = 120  # samples of a side of the polygon


def pose_drawing(
    drawing: Drawing, model: PoseModel, method: str = "optimal", *, passes: Passes = 0, height: float | None = None
) -> Drawing:
    """The drawing with the pose that a library suggests; every stroke is taken by itself.

    What strokes knew of their pose and of their width is replaced; what the library does not know they do not have.  A
    flat nib keeps its edge, unless the stroke is drawn anew.

    method : one of `POSE_METHODS`.
    passes : 0: the strokes stay where they are.  1: they are drawn as the library's writer draws, and held as the
        strokes that were drawn suggest.  2: they are held as they are drawn now.
    height : mm of a letter; default: as `letter_height` finds it.

    Raises InputError: no strokes.
    """
    if not drawing.strokes:
        raise InputError("There is no stroke to give a pose to.")
    unit = (letter_height(drawing) if height is None else height) / UNITS
    strokes = tuple(_pose_stroke(stroke, model, method, passes, unit) for stroke in drawing.strokes)
    about = {**drawing.about, "pose": model.library.title or "untitled", "pose_method": method}
    return replace(drawing, strokes=strokes, about=about)


def _pose_stroke(stroke: Stroke, model: PoseModel, method: str, passes: Passes, unit: float) -> Stroke:
    xy, at = resample_path(stroke.xy, unit)
    if passes == 0 or len(xy) < 2:
        return _lay_pose(stroke, model.pose(xy, method), at, model)
    drawn = shape_stroke(xy, model.movement(xy, method), anchors(xy))
    t = np.interp(at, np.arange(len(stroke.t)), stroke.t)
    bare: dict[str, Any] = dict.fromkeys((*POSE, "width"))
    moved = replace(stroke, t=t, xy=drawn * unit, **bare, nib=0.0)
    if passes == 1:
        return _lay_pose(moved, model.pose(xy, method), np.arange(len(xy), dtype=np.float64), model)
    again, where = resample_path(moved.xy, unit)
    return _lay_pose(moved, model.pose(again, method), where, model)


def _lay_pose(stroke: Stroke, pose: Array, at: Array, model: PoseModel) -> Stroke:
    """A stroke with the pose (m, c) at places `at` (m,) between its samples, and with samples enough to show it."""
    n = len(stroke.t)
    gap = np.diff(np.interp(np.arange(n), at, np.arange(len(at)))) if len(at) > 1 else np.zeros(n - 1)
    wide = np.flatnonzero(gap > _SPARSE)
    inside = at[np.isin(np.floor(at).astype(np.intp), wide)]
    place = np.unique(np.concatenate([np.arange(n, dtype=np.float64), inside]))
    t = np.interp(place, np.arange(n), stroke.t)
    place = place[np.concatenate([[True], np.diff(t) > 0])]
    t = np.interp(place, np.arange(n), stroke.t)
    xy = np.column_stack([np.interp(place, np.arange(n), stroke.xy[:, i]) for i in (0, 1)])
    channels: dict[str, Any] = dict.fromkeys((*POSE, "width"))
    known = np.column_stack([np.interp(place, at, column) for column in pose.T])
    channels |= extract_channels(known, model.library.channels)
    if stroke.nib > 0 and stroke.rotation is not None:  # a flat nib keeps its edge
        channels["rotation"] = np.interp(place, np.arange(n), stroke.rotation)
    return replace(stroke, t=t, xy=xy, **channels)


def anchors(xy: Array) -> Indices:
    """Which samples of a stroke (n, 2), in hand units, a stylised one must pass near; at least one."""
    n = len(xy)
    ends = np.unique(np.clip([_FROM_ENDS, n - 1 - _FROM_ENDS], 0, n - 1))
    fixed = np.unique(np.concatenate([ends, _sharp_turns(xy)]))
    between = [a + _polygon(xy[a : b + 1]) for a, b in zip(fixed[:-1].tolist(), fixed[1:].tolist(), strict=True)]
    return np.unique(np.concatenate([fixed, *between])).astype(np.intp)


def _sharp_turns(xy: Array) -> Indices:
    """Samples at which the direction turns by more than 60°, the most of those around."""
    if len(xy) <= 2 * _ARM:
        return np.zeros(0, dtype=np.intp)
    z = xy @ np.array([1.0, 1j])
    before, after = z[_ARM:-_ARM] - z[: -2 * _ARM], z[2 * _ARM :] - z[_ARM:-_ARM]
    turn = np.abs(np.angle(after * before.conj()))
    around = np.lib.stride_tricks.sliding_window_view(np.pad(turn, _ARM), 2 * _ARM + 1).max(axis=1)
    return np.flatnonzero((turn >= _SHARP) & (turn == around)) + _ARM


def _polygon(xy: Array) -> Indices:
    """Inner vertices of the polygon through a path (n, 2) that is cheapest in squared distances and vertices."""
    n = len(xy)
    best, back = np.zeros(n), np.zeros(n, dtype=np.intp)
    for j in range(1, n):
        first = max(0, j - _LONGEST)
        total = best[first:j] + _misfit(xy[first : j + 1]) + _VERTEX
        back[j] = first + int(total.argmin())
        best[j] = total.min()
    vertices, at = [], int(back[-1])
    while at > 0:
        vertices.append(at)
        at = int(back[at])
    return np.array(vertices[::-1], dtype=np.intp)


def _misfit(xy: Array) -> Array:
    """(n − 1,): squared distances of the samples after each from its chord to the last, by sums from the end."""
    away = (xy[:-1] - xy[-1])[::-1]
    xx, xy_, yy = np.cumsum(np.column_stack([away[:, 0] ** 2, away[:, 0] * away[:, 1], away[:, 1] ** 2]), axis=0).T
    length = np.maximum(np.hypot(*away.T), 1e-9)
    across_x, across_y = -away[:, 1] / length, away[:, 0] / length
    return np.asarray(np.maximum(across_x**2 * xx + 2 * across_x * across_y * xy_ + across_y**2 * yy, 0.0)[::-1])


def shape_stroke(xy: Array, velocity: Array, at: Indices) -> Array:
    """(n, 2): places whose steps and bends are those of velocities (n, 2), held to a stroke (n, 2) at its anchors.

    Minimises Σ‖x_i − x_{i−1} − v_i‖² + .25 Σ_A ‖x_i − q_i‖² + 2 Σ_A Σ_{|j−i|≤2} ‖κ_j(x) − (v_{j+1} − v_j)‖².

    Raises ValueError: no anchor, without which the place would be free.
    """
    n = len(xy)
    if not len(at):
        raise ValueError("a stroke needs an anchor")
    band, right = np.zeros((3, n)), np.zeros((n, 2))
    band[2, 1:] += 1.0
    band[2, :-1] += 1.0
    band[1, 1:] -= 1.0
    right[1:] += velocity[1:]
    right[:-1] -= velocity[1:]
    np.add.at(band[2], at, _HOLD)
    np.add.at(right, at, _HOLD * xy[at])
    around = (at[:, None] + np.arange(-_NEAR, _NEAR + 1)).ravel()
    for j in around[(around > 0) & (around < n - 1)].tolist():
        bend = velocity[j + 1] - velocity[j]
        band[2, j - 1 : j + 2] += _BEND * np.array([1.0, 4.0, 1.0])
        band[1, j : j + 2] -= 2 * _BEND
        band[0, j + 1] += _BEND
        right[j - 1 : j + 2] += _BEND * np.array([1.0, -2.0, 1.0])[:, None] * bend
    return np.asarray(solveh_banded(band[max(3 - n, 0) :], right))
