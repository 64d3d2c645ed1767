"""A brush shown on a sheet: the strokes that it was learned from, and strokes that it paints."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from handout.inking import pens
from handout.inking.brush.brushes import Brush
from handout.inking.brush.painting import lay, spread_places
from handout.inking.brush.ribbon import SEGMENTS, SPAN
from handout.inking.pen import Pen
from handout.values import Array, Drawing, Page, Stroke

DPI = 300.0  # of the sheet
_WIDE, _MARGIN = 210.0, 10.0  # mm: of the sheet
_LINE = 7.0  # mm: width of the lines on it
_ROW = 1.5 * SPAN * _LINE  # mm


def show(brush: Brush, name: str, rng: np.random.Generator) -> NDArray[np.uint8]:
    """(h, w, 3) uint8 at `DPI`: every ribbon as it was painted; below, a wave, a spiral, dashes and dots by the brush.

    name : of the brush, or its file.
    """
    lengths = [len(ribbon) * _LINE / SEGMENTS for ribbon in brush.ribbons]
    starts, at = list[Array](), np.array([_MARGIN, _MARGIN + _ROW / 2])
    for length in lengths:
        if at[0] > _MARGIN and at[0] + length > _WIDE - _MARGIN:
            at = np.array([_MARGIN, at[1] + _ROW])
        starts.append(at)
        at = at + np.array([length + _LINE / 2, 0])
    top = starts[-1][1] + 1.5 * _ROW
    page = Page(_WIDE, top + 3 * _ROW + _MARGIN)
    drawing = Drawing(tuple(_samples(top)), page)
    picture = pens.image(drawing, DPI, Pen(_LINE, brush.colour, name), rng)
    canvas = np.zeros((*picture.shape[:2], 4), dtype=np.uint8)
    sized, scale, first = brush.fit_width(_LINE * DPI / 25.4), DPI / 25.4, 0
    for ribbon, start, length in zip(brush.ribbons, starts, lengths, strict=True):
        line = spread_places(np.array([start, start + np.array([length, 0])]) * scale, len(ribbon))
        row = np.arange(first, first + len(ribbon))
        lay(canvas, sized.hard(row), line, np.full(len(line), _LINE / 2 * scale))
        first += 2 * len(ribbon)  # its mirror image follows each
    alpha = canvas[..., 3:].astype(np.float32) / 255
    return np.asarray(np.rint(picture * (1 - alpha) + canvas[..., :3]), dtype=np.uint8)


def _samples(top: float) -> list[Stroke]:
    """Strokes below `top`, mm."""
    share = np.linspace(0, 1, 200)
    wave = np.stack([_MARGIN + 5 + 120 * share, top + 6 * np.sin(4 * np.pi * share)], axis=1)
    turn, radius = 4.5 * np.pi * share, 17 - 14 * share
    spiral = np.array([168, top + _ROW]) + radius[:, None] * np.stack([np.cos(turn), np.sin(turn)], axis=1)
    dashes = [
        np.array([[x, top + 1.4 * _ROW], [x + long, top + 1.2 * _ROW]]) for x, long in ((16, 30), (56, 18), (86, 8))
    ]
    dots = [np.array([[x, top + 2.4 * _ROW]]) for x in (20.0, 34.0, 48.0)]
    paths = [wave, spiral, *dashes, *dots]
    return [Stroke(np.linspace(0, len(p) / 100, len(p)), p, width=np.full(len(p), _LINE)) for p in paths]
