"""SVG files as drawings: what they stroke, as lines; and this program's own previews with their times.

`document` walks the elements, `styles` says where and how they are drawn; here strokes are made of them.  Kept by hand
beside `handout.pathdata` rather than taken from svgelements 1.9: that gives the same cubics, a third as fast for path
data, but draws what is hidden, masked, behind a `switch` or a `symbol` nobody uses (and that unscaled), takes broken
paths and transforms in silence, recurses without end where a `use` uses itself, and counts nothing of what is left out.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import Any
from xml.etree.ElementTree import Element

import msgspec
import numpy as np

from handout import markup, pathdata
from handout.errors import InputError
from handout.sources.drawing_json import JsonPage
from handout.sources.recorded import LIFT, MARGIN, MOST, PACE, refuse_far, refuse_many
from handout.sources.svg.document import Subpath, Walk, size
from handout.sources.svg.styles import PX
from handout.values import Drawing, Page, Stroke

__all__ = ["from_svg"]


_TOLERANCE = 0.02  # mm between a curve and its points
_MOST_POINTS = 1_000_000
_NEAREST = 1e-4  # mm; points nearer to the one before are the same
_RATE = 140.0  # samples a second where times are known
_MOMENT = 0.0015  # s by which whole milliseconds may make one stroke end after the next begins


def from_svg(data: bytes, *, texts: bool = False) -> Drawing:
    """Read what an SVG file strokes.

    texts : keep its texts as `about["texts"]`, a tuple of `document.Text`, for who writes them; else they are left out.

    Paths, basic shapes, nested groups and viewports, transforms, units, ``use`` and style sheets of simple rules are
    understood; curves become points within 0.02 mm of them.  A stroke has the name of its Inkscape layer, and the
    colour it is stroked with.  A file that this program wrote gives back strokes with their times, as long as its
    paths are as they were written.

    The drawing is not `timed`, except that of a file of this program's own.  `about["left_out"]` lists in words what
    is not in it: text, pictures, filled outlines; and clips and dashes, which are not obeyed.

    Raises InputError: not SVG, nothing in it that is stroked, an element that cannot be read (the message says which),
    entities, or more than a million points.
    """
    root = markup.parse(data, "SVG", doctype=True)
    if root.tag != "svg":
        raise InputError(f"This is not SVG: its root element is <{root.tag}>, not <svg>.")
    walk = Walk(root, texts=[] if texts else None)
    lines, needed = [], 0.0
    for line in walk.lines():
        needed += pathdata.points_needed([line.path], _TOLERANCE)
        if needed > _MOST_POINTS:
            raise InputError(f"The drawing has more than {_MOST_POINTS} points: simplify it, or split it into several.")
        lines.append(line)
    if not lines and not walk.texts:
        raise InputError(_nothing(walk.left_out))
    about: dict[str, Any] = {}
    if walk.left_out:
        about["left_out"] = [f"{count} x {what}" for what, count in sorted(walk.left_out.items()) if count]
    drawing = _read_own_preview(root, lines)
    if drawing is not None:
        return drawing
    if walk.texts:
        about["texts"] = tuple(walk.texts)
    strokes = tuple(_strokes(lines))
    title = root.findtext("title") or ""
    return Drawing(strokes, _page(root, strokes), {"title": " ".join(title.split())[:60]} | about, timed=False)


def _nothing(left_out: Counter[str]) -> str:
    outlines = left_out["filled outline without a stroke"]
    if outlines:
        return (
            f"There is no line to draw: {outlines} filled outline{'s' if outlines > 1 else ''} without a stroke. A pen "
            "draws lines, so give the shapes a stroke, or fill them with hatching first."
        )
    others = ", ".join(f"{count} x {what}" for what, count in sorted(left_out.items()) if count)
    if others:
        return f"There is no line to draw, only {others}: turn it into paths with a stroke first."
    return "There is no line to draw: nothing in it is visible and has a stroke."


def _strokes(lines: Sequence[Subpath]) -> Iterator[Stroke]:
    """Strokes at an even pace."""
    clock = 0.0
    for line in lines:
        # points each away from the one before; a path that goes nowhere is one point
        xy = pathdata.flatten_path(line.path, _TOLERANCE)[0]
        refuse_far("A line", xy)
        moved = np.hypot(*np.diff(xy, axis=0).T) > _NEAREST
        xy = pathdata.anchor_ends(xy[np.concatenate([[True], moved])])
        step = np.hypot(*np.diff(xy, axis=0).T)
        t = clock + np.concatenate([[0.0], np.cumsum(step) / PACE])
        yield Stroke(t, xy, layer=line.layer, colour=line.colour)
        clock = float(t[-1]) + LIFT


def _page(root: Element, strokes: Sequence[Stroke]) -> Page:
    width, height = (side * PX for side in size(root))
    if not (width > 0 and height > 0):
        if not strokes:
            raise InputError("It holds text alone and says no size: give its <svg> a width and a height.")
        reach = np.max([stroke.xy.max(axis=0) for stroke in strokes], axis=0)
        width, height = (max(float(side) + MARGIN, 2 * MARGIN) for side in reach)
    return JsonPage(width, height).page()


def _read_own_preview(root: Element, lines: Sequence[Subpath]) -> Drawing | None:
    """The drawing of a preview that this program wrote; None for any other file, or one that was changed since."""
    note = next((element for element in root.findall("metadata") if element.get("id") == "about"), None)
    if note is None:
        return None
    try:
        metadata = msgspec.json.decode(note.text or "")
        page = msgspec.convert(metadata["page"], JsonPage).page()
        # layers may part what was written one after the other
        strokes = tuple(sorted((_read_timed_stroke(line) for line in lines), key=lambda stroke: float(stroke.t[0])))
    except (ValueError, KeyError, TypeError, RecursionError):
        return None
    if any(b.t[0] < a.t[-1] - _MOMENT for a, b in pairwise(strokes)):  # parts of one stroke touch
        return None
    about = metadata.get("about")
    return Drawing(strokes, page, about if isinstance(about, dict) else {})


def _read_timed_stroke(line: Subpath) -> Stroke:
    """A stroke with the times that its path carries: what each of its cubics takes."""
    attributes = line.attributes
    begin, end = float(attributes["data-t0"]), float(attributes["data-t1"])
    word = int(attributes.get("data-word", -1))
    spans = np.array([float(span) for span in attributes.get("data-k", "").split()]) / 1000
    refuse_far("A line", line.path, np.array([begin, end, begin + np.abs(spans).sum()]))
    if not -1 <= word <= MOST:
        raise ValueError("no number of a word")
    layer, colour = attributes.get("data-layer", ""), attributes.get("stroke", "")
    if "data-k" not in attributes:
        samples = 2 if end > begin else 1
        rest = np.array([begin, end][:samples])
        return Stroke(rest, line.path[[0, -1][:samples]], word=word, layer=layer, colour=colour)
    if len(spans) != len(line.path) // 3:
        raise ValueError("the path was changed")
    pieces = np.maximum(np.ceil(spans * _RATE), 1).astype(np.intp)
    refuse_many(int(pieces.sum()), "line")
    cubic = np.repeat(np.arange(len(spans)), pieces)
    u = (np.arange(len(cubic)) - np.repeat(np.cumsum(pieces) - pieces, pieces) + 1) / pieces[cubic]
    knots = begin + np.concatenate([[0.0], np.cumsum(spans)])
    t = np.concatenate([[begin], knots[cubic] + u * spans[cubic]])
    a, b, c, d = (line.path[3 * cubic + j] for j in range(4))
    u = u[:, None]
    v = 1 - u
    xy = np.concatenate([line.path[:1], v**3 * a + 3 * v**2 * u * b + 3 * v * u**2 * c + u**3 * d])
    # width of a stroke, and its flat nib, where the file has them at its knots (k,) s, for samples (n,) s
    mark: dict[str, Any] = {}
    for name, channel in (("data-w", "width"), ("data-rotation", "rotation")):
        if name in attributes:
            values = np.array([float(value) for value in attributes[name].split()]) / 1000
            mark[channel] = np.interp(t, knots, np.broadcast_to(values, len(knots)))
    if "data-nib" in attributes:
        mark["nib"] = float(attributes["data-nib"])
    return Stroke(t, xy, word=word, layer=layer, colour=colour, **mark)
