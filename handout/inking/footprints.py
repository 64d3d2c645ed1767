"""Footprints: how wide a line a pen leaves when it is pressed, tilted and turned.

A point touches the paper over an ellipse, longer along the way it leans the further it leans; a line is as wide as the
ellipse is across the line.  A chisel touches over an edge, which lies along the rotation of the barrel, or else across
the way the pen leans.

Source: own method.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from handout.inking.pen import Pen
from handout.libraries import spatial
from handout.values import Array, Drawing, Stroke

USUAL_PRESSURE = 0.55  # at which a pen's line has its usual width; see `flow.PRESSURE`
_THINNEST = 0.04  # of the usual width
_EDGE = -np.radians(40)  # of a chisel of which nothing is known: as scribes hold it, rising to the right
_DOT = 1.0  # widths of an edge: a shorter stroke is a dot
_DRAWN = 0.7  # widths of an edge that it is drawn in a dot: wider than high, as scribes' are; set by eye
_DOTTING = 0.05  # s
_APART = 0.65  # of the distance of two dots: how long each is
_LEAST = 0.3  # of the edge: the smallest corner that draws a dot
_SMOOTH = 2  # samples on either side over which the direction of a line is taken


@dataclass(frozen=True)
class Footprint:
    """What a pen's point does; set by eye, the swell of ink pens as in `pens`.

    swell : how much wider at full pressure than at none, in usual widths.
    lean : how much longer the ellipse is when the pen lies flat.
    share : for a nib, how much thinner a line along its edge is than one across it.
    flat : whether it is an edge.
    """

    swell: float
    lean: float = 0.0
    share: float = 0.0
    flat: bool = False


FOOTPRINTS = {
    "plain": Footprint(0.15),
    "ballpoint": Footprint(0.45),
    "fineliner": Footprint(0.75),
    "fountain": Footprint(0.9, share=0.3),
    "pencil": Footprint(0.7, lean=0.6),
    "brushpen": Footprint(2.2, lean=0.8),
    "chisel": Footprint(0.25, flat=True),
}


def mark_drawing(drawing: Drawing, pen: Pen) -> Drawing:
    """The drawing with the width, or the edge, that the pen's footprint gives each stroke.

    Strokes that have a width of their own keep it, as those of a handstyle; a stroke without pressure is pressed as
    usual.
    """
    footprint = FOOTPRINTS.get(pen.model)
    if footprint is None:
        return drawing
    widths = _room(drawing.strokes, pen.width) if footprint.flat else [pen.width] * len(drawing.strokes)
    each = zip(drawing.strokes, widths, strict=True)
    return replace(drawing, strokes=tuple(_mark_stroke(stroke, width, footprint, pen.width) for stroke, width in each))


def _room(strokes: Sequence[Stroke], width: float) -> list[float]:
    """mm: how long an edge draws each stroke; dots side by side, as those of ë, are drawn with a corner of it."""
    widths = np.full(len(strokes), width)
    dots = [k for k, stroke in enumerate(strokes) if stroke.length < _DOT * width]
    if len(dots) > 1:
        middles = np.array([strokes[k].xy.mean(axis=0) for k in dots])
        nearest, _ = spatial.cKDTree(middles).query(middles, 2)
        widths[dots] = np.clip(_APART * nearest[:, 1], _LEAST * width, width)
    return widths.tolist()


def _mark_stroke(stroke: Stroke, width: float, footprint: Footprint, usual: float) -> Stroke:
    if stroke.width is not None or stroke.nib > 0:
        return stroke
    pressure = np.full(len(stroke.t), USUAL_PRESSURE) if stroke.pressure is None else stroke.pressure
    wide = width * np.maximum(1 + footprint.swell * (pressure - USUAL_PRESSURE), _THINNEST)
    if footprint.flat:
        if stroke.length < _DOT * usual:
            # a dot as an edge makes it: put down, and drawn a little across itself
            ends = [0, -1]
            known = {name: values[ends] for name, values in stroke.pose.items()}
            t = stroke.t[ends] if len(stroke.t) > 1 else stroke.t[0] + np.array([0.0, _DOTTING])
            angle = float(edge(stroke)[0])
            way = np.array([-np.sin(angle), np.cos(angle)]) * (1 if np.cos(angle) > 0 else -1)  # downwards
            middle = (stroke.xy.min(axis=0) + stroke.xy.max(axis=0)) / 2
            stroke = replace(stroke, t=t, xy=middle + np.outer([-0.5, 0.5], way) * _DRAWN * width, **known)
            wide = wide[[0, -1]]
        return replace(stroke, nib=width, rotation=edge(stroke), width=wide)
    wide = wide * leaning(stroke, footprint.lean)
    if footprint.share and (stroke.rotation is not None or stroke.azimuth is not None):
        across = np.abs(np.sin(_direction(stroke.xy) - edge(stroke)))
        wide = wide * (1 - footprint.share * (1 - across))
    return replace(stroke, width=wide)


def leaning(stroke: Stroke, lean: float) -> Array:
    """(n,): how much wider a pen's line is for leaning; 1 where it stands upright, or nobody knows how it leans."""
    if not lean or stroke.tilt is None or stroke.azimuth is None:
        return np.ones(len(stroke.t))
    long = 1 + lean * np.sin(np.clip(stroke.tilt, 0.0, np.pi / 2))
    off = _direction(stroke.xy) - stroke.azimuth
    # as much ink as upright: the ellipse is as much narrower as it is longer
    return np.asarray(np.hypot(np.sqrt(long) * np.sin(off), np.cos(off) / np.sqrt(long)))


def edge(stroke: Stroke) -> Array:
    """(n,) rad on the page: how the edge of a nib lies."""
    if stroke.rotation is not None:
        return stroke.rotation
    return np.full(len(stroke.t), _EDGE) if stroke.azimuth is None else np.unwrap(stroke.azimuth) + np.pi / 2


def _direction(xy: Array) -> Array:
    """(n,) rad: which way a line goes at each sample."""
    n = np.arange(len(xy))
    step = xy[np.minimum(n + _SMOOTH, len(xy) - 1)] - xy[np.maximum(n - _SMOOTH, 0)]
    return np.asarray(np.arctan2(step[:, 1], step[:, 0]))
