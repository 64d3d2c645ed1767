"""Reads GML, the Graffiti Markup Language: recorded graffiti tags, in the unit square of a screen.

Both spellings in use are read: ``<GML>`` and ``<gml>``, ``<time>`` and ``<t>``, ``screenBounds`` in any case.  A real
scale with its unit in the environment sets the size; without one the longer side of the screen is 200 mm.

Source: the example files of the Graffiti Markup Language, versions 0.1c and 1.0.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import count
from typing import Any
from xml.etree.ElementTree import Element

import numpy as np

from handout import markup
from handout.errors import InputError
from handout.sources import recorded
from handout.sources.recorded import Raw
from handout.values import Array, Drawing

_LONGER = 200.0  # mm
_UNITS = {"mm": 1.0, "cm": 10.0, "m": 1000.0, "in": 25.4, "inch": 25.4, "ft": 304.8}
_GAP = 0.1  # of the largest side of a drawing: room between the drawings of one file
_LEAST = 3  # points: a file with fewer holds no tag


def from_gml(data: bytes) -> Drawing:
    """Read a GML file; `about` holds the entries of the header's ``client``.

    Every drawing of a file uses the whole screen, so several are laid out in rows.  The strokes of each have its number
    as their word, from 0; `about["drawings"]` is how many there are, `about["letters"]` the ``letter`` of each ("" if
    it has none), where any has one.

    Raises InputError: not GML, a point without numbers, or fewer than three points in all.
    """
    root = markup.parse(data, "GML")
    if root.tag.lower() != "gml":
        raise InputError(f"This is not GML: its root element is <{root.tag}>, not <gml>.")
    scale, rotated = _scale(root)
    numbers = count(1)
    drawings = [e for e in root.iter() if e.tag.lower() == "drawing"] or [root]
    strokes_of, letters = [], []
    for drawing in drawings:
        if strokes := _strokes(drawing, scale, rotated, numbers):
            strokes_of.append(strokes)
            letters.append(next(((e.text or "").strip() for e in drawing.iter() if e.tag.lower() == "letter"), ""))
    points = sum(len(stroke.xy) for strokes in strokes_of for stroke in strokes)
    if points < _LEAST:
        raise InputError(f"This GML has {points} points of a pen that draws; at least {_LEAST} are needed.")
    several: dict[str, Any] = {"drawings": len(strokes_of)} if len(strokes_of) > 1 else {}
    several |= {"letters": letters} if any(letters) else {}
    return recorded.make_drawing(_spread_drawings(strokes_of), "GML", _client_texts(root) | several)


def _client_texts(root: Element) -> dict[str, Any]:
    client = next((e for e in root.iter() if e.tag.lower() == "client"), None)
    texts = {e.tag.lower(): (e.text or "").strip() for e in (client if client is not None else [])}
    return {key: text for key, text in texts.items() if text}


def _strokes(drawing: Element, scale: Array, rotated: bool, numbers: Iterator[int]) -> list[Raw]:
    """The strokes of one drawing; `numbers` counts through the whole file."""
    strokes = []
    for stroke in (e for e in drawing.iter() if e.tag.lower() == "stroke"):
        number = next(numbers)
        if (stroke.get("isdrawing") or stroke.get("isDrawing") or "true").lower() == "false":
            continue
        if found := [p for e in stroke if e.tag.lower() == "pt" and (p := _point(e, number))]:
            points = np.array(found)
            xy = points[:, :2] * scale
            if rotated:
                xy = np.column_stack([xy[:, 1], scale[0] - xy[:, 0]])
            t = points[:, 2] if np.isfinite(points[:, 2]).all() else None
            channels = {"pressure": np.clip(points[:, 3], 0.0, 1.0)} if np.isfinite(points[:, 3]).all() else {}
            strokes.append(Raw(xy, t, channels))
    return strokes


def _spread_drawings(drawings: Sequence[Sequence[Raw]]) -> list[Raw]:
    """The strokes of all drawings, laid out in rows so that no drawing covers another."""
    if len(drawings) == 1:
        return list(drawings[0])
    boxes = [np.concatenate([stroke.xy for stroke in strokes]) for strokes in drawings]
    lows, sizes = np.array([b.min(axis=0) for b in boxes]), np.array([np.ptp(b, axis=0) for b in boxes])
    gap = _GAP * float(sizes.max())
    room = max(float(sizes[:, 0].max()), math.sqrt(len(drawings)) * float(sizes.max()))
    placed, corner, lowest = [], np.zeros(2), 0.0
    for word, (strokes, low, size) in enumerate(zip(drawings, lows, sizes, strict=True)):
        if corner[0] > 0 and corner[0] + size[0] > room:
            corner = np.array([0.0, lowest + gap])
        placed += [replace(stroke, xy=stroke.xy - low + corner, word=word) for stroke in strokes]
        lowest = max(lowest, corner[1] + size[1])
        corner = corner + np.array([size[0] + gap, 0.0])
    return placed


def _child(element: Element | None, *names: str) -> Element | None:
    """The first child of one of the names, whatever their case."""
    return next((e for e in (element if element is not None else []) if e.tag.lower() in names), None)


def _number(element: Element | None) -> float:
    try:
        return float((element.text or "") if element is not None else "")
    except ValueError:
        return float("nan")


def _point(element: Element, stroke: int) -> tuple[float, float, float, float] | None:
    """x, y, time and pressure (NaN where absent); None for a point without x and y."""
    if _child(element, "x") is None and _child(element, "y") is None:
        return None
    x, y = _number(_child(element, "x")), _number(_child(element, "y"))
    if not (np.isfinite(x) and np.isfinite(y)):
        raise InputError(f"Stroke {stroke} of this GML has a point whose x or y is not a number.")
    return x, y, _number(_child(element, "t", "time")), _number(_child(element, "pres"))


def _scale(root: Element) -> tuple[Array, bool]:
    """mm, sides of the unit square; and whether the tag lies on its side, because its `up` is along x."""
    environment = next((e for e in root.iter() if e.tag.lower() == "environment"), None)
    screen, real = _child(environment, "screenbounds"), _child(environment, "realscale")
    up = _child(environment, "up")
    rotated = up is not None and abs(_number(_child(up, "x"))) == 1
    unit = _child(real, "unit")
    if real is not None and unit is not None:
        factor = _UNITS.get((unit.text or "").strip().lower())
        size = np.array([_number(_child(real, "x")), _number(_child(real, "y"))])
        if factor and np.isfinite(size).all() and (size > 0).all() and size.max() * factor <= 5000:
            return size * factor, rotated
    size = np.array([_number(_child(screen, "x")), _number(_child(screen, "y"))])
    if not (np.isfinite(size).all() and (size > 0).all()):
        size = np.ones(2)
    return _LONGER * size / size.max(), rotated
