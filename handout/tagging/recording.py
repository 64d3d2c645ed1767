"""A recorded pen with what is written; and pieces of writing with labels, laid out as the lines of a page.

Labelled pieces may have been written over one another, each in the same window of a tablet.  So only their shapes are
taken, not where they lie: a text or word stands where most of its strokes turn upwards, a single letter as high as the
built-in hand has it.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import accumulate
from typing import Any

import numpy as np

from handout.errors import InputError
from handout.hand.library import load
from handout.hand.places import graphemes
from handout.summary import one_line
from handout.values import Array, Drawing, Indices, Page, Stroke

_TURN = 0.08  # of a stroke's usual height: a turn back that is smaller is none
_LEAST = 8  # turns of the pen, of writing whose size can be told
_NOTHING = 0.02  # of the greatest piece: what is smaller is a placeholder for something that was taken out
_PITCH = (3.4, 5.5)  # x-heights, least and greatest distance of lines: a hand keeps it as its own
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

    Raises
    ------
    InputError
        There are no labels.
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

    Parameters
    ----------
    x_height : of the writing, mm of the recording, as the others are.
    column, row, most : greatest height of the lines of a page, length of a line, and distance of lines.
    """
    above = max(piece.base - piece.box[1] for piece in pieces)
    below = max(piece.box[3] - piece.base for piece in pieces)
    pitch = float(np.clip(above + below + 0.4 * x_height, _PITCH[0] * x_height, min(_PITCH[1] * x_height, most)))
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
