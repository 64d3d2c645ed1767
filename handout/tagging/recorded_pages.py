"""Recorded pens, and single-line fonts, as pages that a hand can be read from: laid out, inked, with their texts.

Labelled pieces may have been written over one another, each in the same window of a tablet.  So only their shapes are
taken, not where they lie: a text or word stands where most of its strokes turn upwards, a single letter as high as the
built-in hand has it.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import accumulate, pairwise
from typing import Any

import numpy as np

from handout.errors import InputError
from handout.hand.drawn import Hand
from handout.hand.library import load
from handout.hand.places import graphemes
from handout.inking import curves, plain
from handout.motion.trace import letters_of_samples, trace
from handout.page_sizes import page
from handout.scanning.scan import Scan
from handout.scanning.written_page import prepare
from handout.summary import one_line
from handout.tagging.page_sources import PageSource, Say
from handout.values import TURNS, Array, Drawing, Indices, Page, Stroke
from handout.writing.compose import compose
from handout.writing.layout import Layout

_TURN = 0.08  # of a stroke's usual height: a turn back that is smaller is none
_LEAST = 8  # turns of the pen, of writing whose size can be told
_NOTHING = 0.02  # of the greatest piece: what is smaller is a placeholder for something that was taken out
_LINE_PITCH = (3.4, 5.5)  # x-heights, least and greatest distance of lines: a hand keeps it as its own
_GAP = 1.6  # x-heights between pieces of a row
_HAND = "house-print"  # whose letters are as high as letters are
_TELLING = 0.5  # x-heights: what is lower, such as a comma, does not tell the size
_LEAST_PIECES = 8  # single letters from which the size of the writing can be told


@dataclass(frozen=True, eq=False)
class RecordedPage:
    """A recorded page with what is written on it.

    name : for messages.
    text : "" where the recording itself is to say it.
    letters : for every stroke (n,) int, index of the grapheme of the text that each sample writes; () if not known.
    lines : how many lines of writing there are, if that is known.
    x_height : mm; 0 if not known.
    """

    name: str
    drawing: Drawing
    text: str = ""
    letters: tuple[Indices, ...] = ()
    lines: int | None = None
    x_height: float = 0.0

    __repr__ = one_line


def x_height_of_strokes(strokes: Sequence[Stroke]) -> float:
    """The x-height, mm, which is the height that most ups and downs of a pen have; 0 if there are too few."""
    heights = np.concatenate([np.zeros(0), *(np.abs(np.diff(stroke_heights)) for stroke_heights in turns(strokes))])
    return float(np.median(heights)) if len(heights) >= _LEAST else 0.0


def turns(strokes: Sequence[Stroke]) -> list[Array]:
    """Of every stroke that is no dot or bar the heights y between which the pen goes up and down."""
    high = [float(np.ptp(stroke.xy[:, 1])) for stroke in strokes]
    usual = float(np.median([h for h in high if h > 0.1 * max(high)] or [0.0]))
    extremes = [
        _turning_points(stroke.xy[:, 1], _TURN * usual) for stroke, h in zip(strokes, high, strict=True) if h > 0
    ]
    return [heights for heights in extremes if len(heights) > 1]


def _turning_points(y: Array, least: float) -> Array:
    """The extremes of `y` in turn, each more than `least` from the one before; both ends count as such."""
    extremes, direction, extreme = [float(y[0])], 0, float(y[0])
    for value in y.tolist():
        if direction * (value - extreme) >= 0 and (direction or abs(value - extremes[0]) > least):
            direction, extreme = direction or (1 if value > extremes[0] else -1), value
        elif direction and abs(value - extreme) > least:
            extremes.append(extreme)
            direction, extreme = -direction, value
    return np.array([*extremes, extreme] if direction else extremes)


@dataclass(frozen=True, eq=False)
class RecordedPiece:
    """Writing that a recording names: a line of text, a word, or a letter.

    base : y of its baseline, mm.
    letters : for each stroke the index of its grapheme in the label; () if not known.
    """

    strokes: tuple[Stroke, ...]
    label: str
    base: float
    letters: tuple[int, ...] = ()

    @property
    def box(self) -> Array:
        """(4,) left, top, right, bottom, mm."""
        xy = np.concatenate([stroke.xy for stroke in self.strokes])
        return np.concatenate([xy.min(axis=0), xy.max(axis=0)])

    @property
    def height(self) -> float:
        """mm."""
        return float(self.box[3] - self.box[1])

    @property
    def size(self) -> float:
        """Its longer side, mm."""
        left, top, right, bottom = self.box.tolist()
        return float(max(right - left, bottom - top))


def labelled_pieces(name: str, drawing: Drawing) -> list[RecordedPiece]:
    """What a recording's labels name, in its order: texts, else words, else letters.

    Raises InputError: there are no labels.
    """
    segments = [s for s in drawing.about.get("segments", ()) if s["label"].strip() and s["strokes"]]
    letters = [s for s in segments if s["level"] == "CHARACTER"]
    for level in ("TEXT", "LINE", "WORD", "CHARACTER"):
        pieces = [_piece(drawing, s, level, letters) for s in segments if s["level"] == level]
        least = _NOTHING * max((piece.size for piece in pieces), default=0.0)
        if large := [piece for piece in pieces if piece.size > least]:
            return large
    raise InputError(
        f"{name}: what is written in it? Give its text with --text; only recordings with labels of texts, words or "
        "letters, as UNIPEN has them, say it themselves."
    )


def _piece(
    drawing: Drawing, segment: Mapping[str, Any], level: str, letters: Sequence[Mapping[str, Any]]
) -> RecordedPiece:
    label, numbers = " ".join(segment["label"].split()), segment["strokes"]
    strokes = tuple(drawing.strokes[i] for i in numbers)
    if level == "CHARACTER":
        low, high = _extent(label)
        alone = RecordedPiece(strokes, label, 0.0, (0,) * len(strokes))
        return replace(alone, base=float(alone.box[3]) + low / (high - low) * alone.height)
    turned = np.concatenate(
        [np.maximum(heights[:-1], heights[1:]) for heights in turns(strokes)] or [strokes[0].xy[:1, 1]]
    )
    return RecordedPiece(strokes, label, float(np.median(turned)), _match_spelling(label, numbers, letters))


def _match_spelling(label: str, strokes: Sequence[int], letters: Sequence[Mapping[str, Any]]) -> tuple[int, ...]:
    """Which grapheme of a label each stroke writes, if labels of single letters spell it, each with its own strokes."""
    units = graphemes(label)
    written = [i for i, unit in enumerate(units) if not unit.isspace()]
    inside = [letter for letter in letters if set(letter["strokes"]) <= set(strokes)]
    of = {stroke: at for at, letter in zip(written, inside, strict=False) for stroke in letter["strokes"]}
    spelt = [letter["label"] for letter in inside] == [units[i] for i in written]
    alone = sum(len(letter["strokes"]) for letter in inside) == len(of) == len(strokes)
    return tuple(of[stroke] for stroke in strokes) if spelt and alone else ()


def pieces_x_height(pieces: Sequence[RecordedPiece]) -> float:
    """The x-height of some pieces, mm; 0 if that cannot be told."""
    if any(set(piece.letters) != {0} for piece in pieces):
        return x_height_of_strokes([stroke for piece in pieces for stroke in piece.strokes])
    sizes = [(piece.height, high - low) for piece in pieces for low, high in [_extent(piece.label)]]
    x_heights = [height / usual for height, usual in sizes if usual > _TELLING]
    return float(np.median(x_heights)) if len(x_heights) >= _LEAST_PIECES else 0.0


@lru_cache(maxsize=256)
def _extent(letter: str) -> tuple[float, float]:
    """From where to where a letter reaches, small letters over the baseline."""
    forms = load(_HAND).glyphs.get(letter, ())
    y = np.concatenate([np.array([0.0, 1.0])] if not forms else [stroke[:, 1] for stroke in forms[0].strokes])
    return float(y.min()), float(y.max())


def laid_out(
    name: str, pieces: Sequence[RecordedPiece], x_height: float, column: float, row: float, most: float
) -> Iterator[RecordedPage]:
    """Pages with the pieces in rows, each piece on the baseline of its row.

    x_height : of the writing, mm of the recording, as the others are.
    column, row, most : greatest height of the lines of a page, length of a line, and distance of lines.
    """
    above = max(piece.base - piece.box[1] for piece in pieces)
    below = max(piece.box[3] - piece.base for piece in pieces)
    pitch = float(
        np.clip(above + below + 0.4 * x_height, _LINE_PITCH[0] * x_height, min(_LINE_PITCH[1] * x_height, most))
    )
    rows, x = list[list[RecordedPiece]](), row
    for piece in pieces:
        left, _, right, _ = piece.box.tolist()
        if not rows or x + right - left > row:
            rows.append([])
            x = 0.0
        shift = np.array([x - left, -piece.base])
        rows[-1].append(replace(piece, strokes=tuple(replace(s, xy=s.xy + shift) for s in piece.strokes)))
        x += right - left + _GAP * x_height
    count = max(1, int(column / pitch))
    for first in range(0, len(rows), count):
        yield replace(_page(name, rows[first : first + count], pitch), x_height=x_height)


def _page(name: str, rows: Sequence[Sequence[RecordedPiece]], pitch: float) -> RecordedPage:
    """Rows of pieces, which stand on the height 0, one below the other."""
    pieces = [piece for row in rows for piece in row]
    counts = [len(graphemes(piece.label)) + 1 for piece in pieces]
    strokes: list[Stroke] = []
    for number, row in enumerate(rows):
        shift = np.array([0.0, pitch * number])
        strokes += [replace(stroke, xy=stroke.xy + shift) for piece in row for stroke in piece.strokes]
    first = accumulate(counts, initial=0)
    of = [at + letter for piece, at in zip(pieces, first, strict=False) for letter in piece.letters]
    letters = tuple(np.full(len(s.t), at, dtype=np.intp) for s, at in zip(strokes, of, strict=False))
    text = "\n".join(" ".join(piece.label for piece in row) for row in rows)
    stroke_letters = letters if len(letters) == len(strokes) else ()
    return RecordedPage(name, Drawing(tuple(strokes), Page(1.0, 1.0)), text, stroke_letters, len(rows))


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

    recordings : with drawings of any format; without a text, a recording's own labels are taken.
    say : takes sentences to show the user.

    Raises InputError: nothing written, no text and no labels, or writing of which the size cannot be told.
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
    rgb = plain.shades()[plain.coverage(drawing, _DPI, width=width, variation=0.0)]
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
