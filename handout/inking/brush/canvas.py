"""The strokes of a drawing, painted with a brush.

A stroke begins with the brush full of paint and ends as the strokes in the photographs do.  One that is shorter than
the brush is wide, or a dot, is stamped: a head and a tail with nothing between, as long as the brush is wide.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from handout.inking import curves, plain
from handout.inking.brush.brushes import Brush
from handout.inking.brush.painting import bends, lay
from handout.inking.brush.ribbon import SEGMENTS
from handout.inking.brush.synthesis import SegmentChooser
from handout.inking.footprints import USUAL_PRESSURE, leaning
from handout.inking.pen import Pen, rgb
from handout.libraries import ndimage
from handout.values import Array, Drawing, Stroke

_PRESSED = 0.35  # of the width: wider at full pressure, thinner at none.  All these are set by eye
_LEAN = 0.8  # how much longer what touches the paper is when the brush lies flat; a brush pen's
_BEYOND = 0.3  # widths that a stroke reaches past both ends of its path, as a round point's does by half
_SHORTEST = 1.0  # widths: what is shorter is stamped
_DOT = np.array([0.8, 0.6])  # way of the brush in a dot, which has none of its own
_DOTTED = 0.2  # widths: a path that leads no further has no way of its own
_STIFF = 0.12  # widths, of the Gaussian that smooths a path: a brush follows no smaller turn
_FLAT_LEAST = 0.25  # of a flat nib's edge: how wide its line is along it
_FINE = 4  # points on the curve for each segment
_BAND = 1 << 22  # pixels of the page looked through at a time


def pass_brush(
    drawing: Drawing, dpi: float, brush: Brush, pen: Pen, rng: np.random.Generator
) -> Iterator[tuple[NDArray[np.intp], NDArray[np.float32]]]:
    """Flat indices (n,) of the pixels that are painted, and the light (n, 3) in 0–1 that they send back; in parts.

    pen : its width, mm, is that of strokes that have none of their own, its colour of those that have none, and it
        replaces the brush's.
    """
    canvas = np.zeros((*plain.shape(drawing, dpi, pen.width), 4), dtype=np.uint8)
    chooser = SegmentChooser(brush.library, rng)
    for stroke, curve in zip(drawing.strokes, curves.fit(drawing.strokes), strict=True):
        line, width = way(stroke, curve, pen.width)
        sized = brush.fit_width(float(width.mean()) * dpi / 25.4)
        pressed = USUAL_PRESSURE if stroke.pressure is None else float(stroke.pressure.mean())
        row = chooser.row(bends(line), pressed - USUAL_PRESSURE)
        ribbon, colour = sized.quilt_segments(row), stroke.colour or pen.colour
        if (
            colour != brush.colour
        ):  # what absorbs as one colour does absorbs as another: its streaks stay darker and lighter
            other, was = (1 - np.asarray(rgb(each), dtype=np.float32) for each in (colour, brush.colour))
            absorbed = (ribbon[..., 3:] - ribbon[..., :3]) * (other / np.maximum(was, 0.02))
            ribbon = np.concatenate([np.maximum(ribbon[..., 3:] - absorbed, 0), ribbon[..., 3:]], axis=-1)
        lay(canvas, ribbon, line * (dpi / 25.4), width * (dpi / 50.8))
    pixels = canvas.reshape(-1, 4)
    for start in range(0, len(pixels), _BAND):
        at = np.flatnonzero(pixels[start : start + _BAND, 3]) + start
        ink = pixels[at].astype(np.float32) / 255
        yield at, np.minimum(1 - (ink[:, 3:] - ink[:, :3]), 1)


def way(stroke: Stroke, curve: curves.Curve, width: float) -> tuple[Array, Array]:
    """The borders of a stroke's segments, (m + 1, 2) in mm, and the width of the line there, (m + 1,) in mm."""
    if not stroke.nib > 0 or stroke.rotation is None or len(stroke.xy) < 2:
        wide = plain.widths(stroke, width, _PRESSED)
        wide = wide if stroke.width is not None else wide * leaning(stroke, _LEAN)
    else:  # a flat nib's line is as wide as its direction makes it
        gone = np.gradient(stroke.xy, axis=0)
        across = np.abs(np.sin(np.arctan2(gone[:, 1], gone[:, 0]) - stroke.rotation))
        wide = stroke.nib * np.maximum(across, _FLAT_LEAST)
    usual = max(float(wide.mean()), 1e-3)
    t = np.linspace(stroke.t[0], stroke.t[-1], int(np.clip(_FINE * SEGMENTS * stroke.length / usual, 2, 1 << 16)))
    step = usual / (_FINE * SEGMENTS)
    line = _evenly(np.column_stack([curve.places_at(t), np.interp(t, stroke.t, wide)]), step)
    lacking = usual * (_SHORTEST - 2 * _BEYOND) - step * (len(line) - 1)
    if lacking > 0:
        chord = line[-1, :2] - line[0, :2]
        size = float(np.hypot(*chord))
        half = (lacking / 2 + size / 2) * (chord / size if size > _DOTTED * usual else _DOT)
        middle = line[:, :2].mean(axis=0)
        line = np.column_stack([np.array([middle - half, middle + half]), np.full(2, usual)])
        line = _evenly(line, step)
    # the line is as stiff as a brush is; its ends stay
    sigma = _STIFF * _FINE * SEGMENTS
    reach = min(len(line) - 1, round(3 * sigma))
    ends = 2 * line[0] - line[reach:0:-1], 2 * line[-1] - line[-2 : -reach - 2 : -1]
    smooth = ndimage.gaussian_filter1d(np.concatenate([ends[0], line, ends[1]]), sigma, axis=0, mode="nearest")
    line = smooth[reach : reach + len(line)]
    back = min(len(line) - 1, _FINE * SEGMENTS // 4)
    beyond = np.arange(1, round(_BEYOND * _FINE * SEGMENTS) + 1)[:, None] / max(back, 1)
    before, after = line[0] - line[back], line[-1] - line[-1 - back]
    before[2] = after[2] = 0
    line = np.concatenate([line[0] + beyond[::-1] * before, line, line[-1] + beyond * after])
    count = max(2, round((len(line) - 1) / _FINE))
    line = _evenly(line, step * (len(line) - 1) / count)
    return line[:, :2], line[:, 2]


def _evenly(line: Array, step: float) -> Array:
    """Rows (n, 3) of place and width about `step` apart along the line."""
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(line[:, :2], axis=0), axis=1))])
    keep = np.concatenate([[True], np.diff(along) > 1e-9])
    at = np.linspace(0, along[-1], max(1, round(along[-1] / step)) + 1)
    return np.stack([np.interp(at, along[keep], column[keep]) for column in line.T], axis=1)
