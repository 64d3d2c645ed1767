"""Recorded pens as pages that a hand can be read from: their lines laid out, inked, and with their texts."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np

from handout.errors import InputError
from handout.inking import curves, plain
from handout.scanning.page import Scan
from handout.scanning.reading import prepare
from handout.tagging.sources import Say, Source
from handout.values import Array, Drawing, Page, Stroke

_DPI = 300.0
_PEN = 0.16  # of a small letter: width of the line
_SIZES, _SIZE = (1.2, 5.5), 2.6  # mm: small letters as people write them, and as they are made where they are not so
_TURN = 0.08  # of a stroke's usual height: a turn back that is smaller is none
_NOTHING = 0.3  # mm: writing that is smaller is a placeholder for some that was taken out
_MARGIN = 12.0  # mm of paper around the writing
_PITCH = (3.4, 27.0)  # least distance of lines laid out, small letters; greatest, mm
_ROW, _GAP = 170.0, 1.6  # mm, longest row of words laid out; small letters between them
_COLUMN = 250.0  # mm, of lines on a page
_LARGEST = 600.0  # mm, of a page
_LEAST = 8  # turns of the pen, of writing whose size can be told


@dataclass(frozen=True, eq=False)
class Recording:
    """A recorded page with what is written on it.

    name : for messages.
    text : "" where the recording itself is to say it.
    """

    name: str
    drawing: Drawing
    text: str = ""


@dataclass(frozen=True, eq=False)
class _Piece:
    """Writing that the recording names: a line of text, or a word.

    base : y of its baseline, mm.
    timed : whether the times of the strokes mean anything.
    """

    strokes: tuple[Stroke, ...]
    label: str
    base: float
    timed: bool

    @property
    def box(self) -> Array:
        """(4,) left, top, right, bottom, mm."""
        xy = np.concatenate([stroke.xy for stroke in self.strokes])
        return np.concatenate([xy.min(axis=0), xy.max(axis=0)])


def recordings(given: Sequence[Recording], say: Say) -> list[Recording]:
    """The pages of some recordings: each one that has a text; labelled pieces of the others, laid out line by line.

    Parameters
    ----------
    given : as `sources.read_drawing` gives their drawings; without a text, a recording's own labels are taken.
    say : takes sentences to show the user.

    Raises
    ------
    InputError
        Nothing written, no text and no labels, or writing of which the size cannot be told.
    """
    found, pieces = list[Recording](), list[_Piece]()
    for one in given:
        drawing = _sized(one.name, _inky(one.name, one.drawing), say)
        if not _clocked(drawing):
            say(f"  {one.name} does not say when the pen was where: the order is known, the pace is not.")
        if one.text:
            found.append(replace(one, drawing=_page(drawing.strokes, timed=_clocked(drawing))))
        else:
            pieces += _pieces(one.name, drawing)
    timed = all(piece.timed for piece in pieces)
    for rows in _laid(pieces):
        strokes = [stroke for row, _ in rows for stroke in row]
        found.append(Recording(given[0].name, _page(strokes, timed=timed), "\n".join(label for _, label in rows)))
    return found


def source(recording: Recording) -> Source:
    """A recorded page as one to be read: its ink, as a pen of even width leaves it, and the way of the pen.

    Raises
    ------
    InputError
        The page is larger than paper is.
    """
    drawing = recording.drawing
    page = drawing.page
    if max(page.width, page.height) > _LARGEST:
        raise InputError(
            f"{recording.name}: the writing is {page.width:.0f} × {page.height:.0f} mm large, and a page has at most "
            f"{_LARGEST:g}: record a page a file."
        )
    width = _PEN * _x_height(drawing.strokes)
    rgb = plain.image(drawing, _DPI, width=width, variation=0.0)
    ways = tuple(_even(stroke, curve, width) for stroke, curve in _curved(drawing))
    return Source(prepare(Scan(rgb, _DPI, recording.name)), recording.text, ways, drawing.timed)


def _curved(drawing: Drawing) -> Iterator[tuple[Stroke, curves.Curve]]:
    return zip(drawing.strokes, curves.fit(drawing.strokes), strict=True)


def _even(stroke: Stroke, curve: curves.Curve, width: float) -> Stroke:
    """A stroke with a sample about every pixel of its page."""
    fine = np.concatenate([np.linspace(a, b, 8, endpoint=False) for a, b in pairwise(stroke.t)] + [stroke.t[-1:]])
    xy = curve.at(fine)
    run = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(xy, axis=0).T))])
    count = round(run[-1] * _DPI / 25.4) + 1
    # where the pen rests, it is left at the last moment
    moving = np.concatenate([[True], np.diff(run) > 1e-6])
    t = np.interp(np.linspace(0.0, run[-1], count), run[moving], fine[moving])
    if count == 1:
        t = stroke.t[:1]
    pressure = None if stroke.pressure is None else np.interp(t, stroke.t, stroke.pressure)
    return Stroke(t, curve.at(t), pressure, width=np.full(count, width), word=stroke.word)


def _inky(name: str, drawing: Drawing) -> Drawing:
    """The drawing, if there is writing in it."""
    bounds = drawing.bounds
    if bounds is None or max(bounds[2] - bounds[0], bounds[3] - bounds[1]) <= 0:
        raise InputError(f"{name}: the pen never moves on the paper, so there is nothing to read.")
    return drawing


def _sized(name: str, drawing: Drawing, say: Say) -> Drawing:
    """The drawing at a size at which people write."""
    small = _x_height(drawing.strokes)
    if not small:
        raise InputError(f"{name}: there is too little writing in it to make a hand of; record at least a line.")
    if _SIZES[0] <= small <= _SIZES[1]:
        return drawing
    said = f"{small:.2g}"
    say(f"  {name}: small letters would be {said} mm tall, which nobody writes; they are taken as {_SIZE:g} mm.")
    factor = _SIZE / small
    strokes = tuple(replace(stroke, xy=stroke.xy * factor) for stroke in drawing.strokes)
    return replace(drawing, strokes=strokes, page=Page(drawing.page.width * factor, drawing.page.height * factor))


def _x_height(strokes: Sequence[Stroke]) -> float:
    """Height of a small letter, mm, which is what most ups and downs of a pen have; 0 if there are too few."""
    heights = np.concatenate([np.zeros(0), *(np.abs(np.diff(turns)) for turns in _turns(strokes))])
    return float(np.median(heights)) if len(heights) >= _LEAST else 0.0


def _turns(strokes: Sequence[Stroke]) -> list[Array]:
    """Of every stroke the heights y between which the pen goes up and down."""
    high = [float(np.ptp(stroke.xy[:, 1])) for stroke in strokes]
    usual = float(np.median([h for h in high if h > 0.1 * max(high)] or [0.0]))
    return [_turning(stroke.xy[:, 1], _TURN * usual) for stroke, h in zip(strokes, high, strict=True) if h > 0]


def _turning(y: Array, least: float) -> Array:
    """The extremes of `y` in turn, each at least `least` from the one before; both ends count as such."""
    found, way, far = [float(y[0])], 0, float(y[0])
    for value in y.tolist():
        if way * (value - far) >= 0 and (way or abs(value - found[0]) > least):
            way, far = way or (1 if value > found[0] else -1), value
        elif way and abs(value - far) > least:
            found.append(far)
            way, far = -way, value
    return np.array([*found, far] if way else found)


def _pieces(name: str, drawing: Drawing) -> list[_Piece]:
    """What a recording's labels name, in its order."""
    segments: Sequence[Mapping[str, Any]] = drawing.about.get("segments", ())
    for level in ("TEXT", "LINE", "WORD"):
        chosen = [s for s in segments if s["level"] == level and s["label"].strip() and s["strokes"]]
        pieces = [_piece([drawing.strokes[i] for i in s["strokes"]], s["label"], _clocked(drawing)) for s in chosen]
        pieces = [piece for piece in pieces if np.ptp(piece.box.reshape(2, 2), axis=0).max() > _NOTHING]
        if pieces:
            return pieces
    raise InputError(
        f"{name}: what is written in it? Give its text with --text; only recordings with labels of texts or words, as "
        "UNIPEN files may have them, say it themselves."
    )


def _piece(strokes: Sequence[Stroke], label: str, timed: bool) -> _Piece:
    turns = [one for one in _turns(strokes) if len(one) > 1]
    low = np.concatenate([np.maximum(one[:-1], one[1:]) for one in turns] or [strokes[0].xy[:1, 1]])
    return _Piece(tuple(strokes), " ".join(label.split()), float(np.median(low)), timed)


def _laid(pieces: Sequence[_Piece]) -> Iterator[list[tuple[list[Stroke], str]]]:
    """Pages of rows, each its strokes and its text; short pieces share a row, all stand on its baseline."""
    if not pieces:
        return
    small = _x_height([stroke for piece in pieces for stroke in piece.strokes])
    above = max(piece.base - piece.box[1] for piece in pieces)
    below = max(piece.box[3] - piece.base for piece in pieces)
    pitch = min(max(above + below + 0.4 * small, _PITCH[0] * small), _PITCH[1])
    rows, x = list[list[_Piece]](), _ROW
    for piece in pieces:
        wide = float(piece.box[2] - piece.box[0])
        if x + wide > _ROW:
            rows.append([])
            x = 0.0
        rows[-1].append(piece)
        x += wide + _GAP * small
    most = max(1, int(_COLUMN / pitch))
    for first in range(0, len(rows), most):
        yield [_row(row, pitch * number, small) for number, row in enumerate(rows[first : first + most])]


def _row(pieces: Sequence[_Piece], base: float, small: float) -> tuple[list[Stroke], str]:
    strokes, x = list[Stroke](), 0.0
    for piece in pieces:
        left, _, right, _ = piece.box.tolist()
        shift = np.array([x - left, base - piece.base])
        strokes += [replace(stroke, xy=stroke.xy + shift) for stroke in piece.strokes]
        x += right - left + _GAP * small
    return strokes, " ".join(piece.label for piece in pieces)


def _clocked(drawing: Drawing) -> bool:
    """Whether its times were measured."""
    return drawing.timed and "timing" not in drawing.about


def _page(strokes: Sequence[Stroke], *, timed: bool) -> Drawing:
    """Strokes on a sheet of their own."""
    xy = np.concatenate([stroke.xy for stroke in strokes])
    low, high = xy.min(axis=0), xy.max(axis=0)
    moved = tuple(replace(stroke, xy=stroke.xy - low + _MARGIN, width=None) for stroke in strokes)
    width, height = (high - low + 2 * _MARGIN).tolist()
    return Drawing(moved, Page(width, height), timed=timed)
