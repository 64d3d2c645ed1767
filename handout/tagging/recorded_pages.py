"""Recorded pens, and single-line fonts, as pages that a hand can be read from: laid out, inked, with their texts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np

from handout.errors import InputError
from handout.hand.drawn import Hand
from handout.inking import curves, plain
from handout.motion.trace import letters_of_samples, trace
from handout.page_sizes import page
from handout.scanning.scan import Scan
from handout.scanning.written_page import prepare
from handout.tagging.page_sources import PageSource, Say
from handout.tagging.recording import (
    RecordedPage,
    RecordedPiece,
    labelled_pieces,
    laid_out,
    pieces_x_height,
    x_height_of_strokes,
)
from handout.values import TURNS, Drawing, Page, Stroke
from handout.writing.compose import compose
from handout.writing.layout import Layout

_DPI = 300.0  # at which a recording is drawn: that of a usual scan
_PEN = 0.16  # of the x-height: width of the line
_SIZES, _SIZE = (1.2, 5.5), 2.6  # mm: small letters as people write them, and as they are made where they are not so
_MARGIN = 12.0  # mm of paper around the writing
_ROW, _COLUMN, _PITCH = 170.0, 250.0, 26.0  # mm, at most: pieces laid out on a page, from a line to the next
_LARGEST = 600.0  # mm, of a page
_TEXT = """\
the quick brown fox jumps over the lazy dog sphinx of black quartz judge my vow
pack my box with five dozen liquor jugs how vexingly quick daft zebras jump
amazingly few discotheques provide jukeboxes we promptly judged antique ivory buckles"""
_EACH = 3  # times that every other character is written
_SEED = 0


def recorded_pages(recordings: Sequence[RecordedPage], say: Say) -> list[RecordedPage]:
    """The pages of some recordings: each with a text as it is, labelled pieces of the others laid out in lines.

    Parameters
    ----------
    recordings : with drawings of any format; without a text, a recording's own labels are taken.
    say : takes sentences to show the user.

    Raises
    ------
    InputError
        Nothing written, no text and no labels, or writing of which the size cannot be told.
    """
    pages, pieces = list[RecordedPage](), list[RecordedPiece]()
    for recording in recordings:
        bounds = recording.drawing.bounds
        if bounds is None or max(bounds[2] - bounds[0], bounds[3] - bounds[1]) <= 0:
            raise InputError(f"{recording.name}: the pen never moves on the paper, so there is nothing to read.")
        if not _has_clock(recording.drawing):
            say(f"  {recording.name} does not say when the pen was where: the order is known, the pace is not.")
        if recording.text:
            x_height = recording.x_height or x_height_of_strokes(recording.drawing.strokes)
            factor = _factor(recording.name, x_height, say)
            pages.append(_sheet(replace(recording, x_height=x_height), factor, _has_clock(recording.drawing)))
        else:
            pieces += labelled_pieces(recording.name, recording.drawing)
    if pieces:
        name = next(recording.name for recording in recordings if not recording.text)
        timed = all(_has_clock(recording.drawing) for recording in recordings if not recording.text)
        x_height = pieces_x_height(pieces)
        factor = _factor(name, x_height, say)
        pages += [
            _sheet(page, factor, timed)
            for page in laid_out(name, pieces, x_height, _COLUMN / factor, _ROW / factor, _PITCH / factor)
        ]
    return pages


def page_source(recording: RecordedPage) -> PageSource:
    """A recorded page as one to be read: its ink, as a pen of even width leaves it, and the way of the pen."""
    drawing = recording.drawing
    width = _PEN * recording.x_height
    rgb = plain.image(drawing, _DPI, width=width, variation=0.0)
    ways = tuple(
        _resample_evenly(stroke, curve, width)
        for stroke, curve in zip(drawing.strokes, curves.fit(drawing.strokes), strict=True)
    )
    named = [
        of[np.searchsorted((stroke.t[1:] + stroke.t[:-1]) / 2, way.t)]
        for of, stroke, way in zip(recording.letters, drawing.strokes, ways, strict=False)
    ]
    scan = prepare(Scan(rgb, _DPI, recording.name))
    return PageSource(
        scan, recording.text, ways, drawing.timed, np.concatenate(named) if named else None, recording.lines
    )


def _resample_evenly(stroke: Stroke, curve: curves.Curve, width: float) -> Stroke:
    """A stroke with a sample about every pixel of its page."""
    fine = np.concatenate([np.linspace(a, b, 8, endpoint=False) for a, b in pairwise(stroke.t)] + [stroke.t[-1:]])
    xy = curve.places_at(fine)
    run = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(xy, axis=0).T))])
    count = round(run[-1] * _DPI / 25.4) + 1
    # where the pen rests, it is left at the last moment
    moving = np.concatenate([[True], np.diff(run) > 1e-6])
    at, run = np.linspace(0.0, run[-1], count), run[moving]
    t = np.interp(at, run, fine[moving]) if count > 1 else stroke.t[:1]
    place = np.column_stack([np.interp(at, run, xy[moving, k]) for k in (0, 1)])
    # angles are unwrapped: between two samples a pen turns the shorter way
    unwrapped = {name: np.unwrap(values) if name in TURNS else values for name, values in stroke.pose.items()}
    pose: dict[str, Any] = {name: np.interp(t, stroke.t, values) for name, values in unwrapped.items()}
    return Stroke(t, place, **pose, width=np.full(count, width), word=stroke.word)


def _factor(name: str, x_height: float, say: Say) -> float:
    """What writing is to be enlarged by to be of a size at which people write."""
    if not x_height:
        raise InputError(f"{name}: there is too little writing in it to make a hand of; record at least a line.")
    if _SIZES[0] <= x_height <= _SIZES[1]:
        return 1.0
    say(
        f"  {name}: small letters would be {x_height:.2g} mm tall, which nobody writes; they are taken as {_SIZE:g} mm."
    )
    return _SIZE / x_height


def _has_clock(drawing: Drawing) -> bool:
    """Whether its times were measured."""
    return drawing.timed and "timing" not in drawing.about


def _sheet(recording: RecordedPage, factor: float, timed: bool) -> RecordedPage:
    """A recording on a sheet of its own, `factor` times as large."""
    xy = np.concatenate([stroke.xy for stroke in recording.drawing.strokes]) * factor
    low, high = xy.min(axis=0), xy.max(axis=0)
    width, height = (high - low + 2 * _MARGIN).tolist()
    if max(width, height) > _LARGEST:
        raise InputError(
            f"{recording.name}: the writing is {width:.0f} × {height:.0f} mm large, and a page has at most "
            f"{_LARGEST:g}: record a page a file."
        )
    moved = tuple(replace(s, xy=s.xy * factor - low + _MARGIN, width=None) for s in recording.drawing.strokes)
    return replace(
        recording, drawing=Drawing(moved, Page(width, height), timed=timed), x_height=recording.x_height * factor
    )


def font_specimen(name: str, font: Hand) -> list[RecordedPage]:
    """Pages in a font, as recordings whose letters are known.

    Parameters
    ----------
    name : of its file, for messages.
    font : as `hand.svg_font.read` gives it.
    """
    words = ["".join(letter for letter in word if letter in font.glyphs) for word in _TEXT.split()]
    others = [letter for letter in font.glyphs if letter not in set("".join(words))]
    text = " ".join([word for word in words if word] + _EACH * others)
    rng, pages = np.random.default_rng(_SEED), list[RecordedPage]()
    layout = Layout(page("A4"), x_height=font.x_height)
    for sheet in compose(text, font, layout, rng):
        drawing = trace(sheet, font, rng, jitter=0.0)
        letters = letters_of_samples(sheet, font)
        pages.append(RecordedPage(name, drawing, text, letters, len(sheet.lines), layout.x_height))
    return pages
