"""Drawings whose pen is held as in a pose library, and which may be drawn as its writer draws."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, Literal

import numpy as np

from handout.errors import InputError
from handout.motion.pose.features import UNITS, resampled
from handout.motion.pose.library import extracted
from handout.motion.pose.synthesis import PoseModel
from handout.motion.pose.trajectory import anchors, shaped
from handout.motion.styles.targets import letter_height
from handout.values import POSE, Array, Drawing, Stroke

Passes = Literal[0, 1, 2]

_SPARSE = 2.0  # hand units between samples, from which on others are put between them


def posed(
    drawing: Drawing, model: PoseModel, method: str = "optimal", *, passes: Passes = 0, height: float | None = None
) -> Drawing:
    """The drawing with the pose that a library suggests; every stroke is taken by itself.

    What strokes knew of their pose and of their width is replaced; what the library does not know they do not have.  A
    flat nib keeps its edge, unless the stroke is drawn anew.

    Parameters
    ----------
    method : one of `POSE_METHODS`.
    passes : 0: the strokes stay where they are.  1: they are drawn as the library's writer draws, and held as the
        strokes that were drawn suggest.  2: they are held as they are drawn now.
    height : mm of a letter; default: as `letter_height` finds it.

    Raises
    ------
    InputError
        No strokes.
    """
    if not drawing.strokes:
        raise InputError("There is no stroke to give a pose to.")
    unit = (letter_height(drawing) if height is None else height) / UNITS
    strokes = tuple(_posed(stroke, model, method, passes, unit) for stroke in drawing.strokes)
    about = {**drawing.about, "pose": model.library.title or "untitled", "pose_method": method}
    return replace(drawing, strokes=strokes, about=about)


def _posed(stroke: Stroke, model: PoseModel, method: str, passes: Passes, unit: float) -> Stroke:
    xy, at = resampled(stroke.xy, unit)
    if passes == 0 or len(xy) < 2:
        return _held(stroke, model.pose(xy, method), at, model)
    drawn = shaped(xy, model.movement(xy, method), anchors(xy))
    t = np.interp(at, np.arange(len(stroke.t)), stroke.t)
    bare: dict[str, Any] = dict.fromkeys((*POSE, "width"))
    moved = replace(stroke, t=t, xy=drawn * unit, **bare, nib=0.0)
    if passes == 1:
        return _held(moved, model.pose(xy, method), np.arange(len(xy), dtype=np.float64), model)
    again, where = resampled(moved.xy, unit)
    return _held(moved, model.pose(again, method), where, model)


def _held(stroke: Stroke, pose: Array, at: Array, model: PoseModel) -> Stroke:
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
    channels |= extracted(known, model.library.channels)
    if stroke.nib > 0 and stroke.rotation is not None:  # a flat nib keeps its edge
        channels["rotation"] = np.interp(place, np.arange(n), stroke.rotation)
    return replace(stroke, t=t, xy=xy, **channels)
