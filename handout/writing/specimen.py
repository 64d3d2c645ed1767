"""A specimen of a hand: every form of every character, and text, on one sheet as long as it needs."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import accumulate

import numpy as np

from handout.hand.drawn import Hand
from handout.values import Array, Glyph, Line, Manuscript, Page, Placed
from handout.writing.choosing import GlyphChooser, choices
from handout.writing.compose import compose, handwriting
from handout.writing.layout import Layout
from handout.writing.text import paragraphs_of

_PITCH = 4.2  # x-heights from one row of forms to the next
_BETWEEN_FORMS, _BETWEEN_LETTERS = 0.55, 1.3  # x-heights
_MARGIN = 3.0  # x-heights round the sheet


def specimen(hand: Hand, text: str, rng: np.random.Generator, *, width: float, x_height: float) -> Manuscript:
    """All drawn forms as they were drawn, a row after the other, and below them `text` as the hand writes it.

    width, x_height : mm: of the sheet, whose height follows, and of the letters.
    """
    room = width / x_height - 2 * _MARGIN
    rows = list(_rows(hand, room))
    sides = _MARGIN * x_height
    layout = Layout(Page(width, 5000.0), (0.0, sides, 0.0, sides), x_height)
    (written,) = compose(text, hand, layout, rng, pages=1)
    words = [0, *accumulate(map(len, rows))]  # each form is one, before each row and before the text
    lines = [_line(hand, row, number, words[number], x_height) for number, row in enumerate(rows)]
    top = (_MARGIN + 2.2 + _PITCH * len(rows)) * x_height
    lines += [_lower_line(line, top, words[-1]) for line in written.lines]
    height = lines[-1].baseline + (_MARGIN + 1.2) * x_height
    return Manuscript(tuple(lines), Page(width, height, "specimen"), x_height, {"hand": hand.name})


def forms(glyphs: Sequence[Glyph]) -> tuple[Glyph, ...]:
    """One glyph of each drawn form of a character: the joined one, where there are several."""
    chosen: dict[int, Glyph] = {}
    for glyph in glyphs:
        have = chosen.get(glyph.form)
        if have is None or (have.exit == "lifted" and glyph.exit != "lifted"):
            chosen[glyph.form] = glyph
    return tuple(chosen.values())


def single_letter(letter: str, hand: Hand, rng: np.random.Generator, x_height: float) -> Manuscript:
    """One letter alone as the hand writes it, on a level baseline; `x_height` in mm."""
    writer = handwriting(hand, (rng, rng), 1.0)
    pieces = paragraphs_of(letter, writer.repertoire)
    (words,) = choices(pieces, [GlyphChooser(writer.stock, rng)])
    (unit,) = writer.set_paragraph(words)
    side = 10 * x_height  # room on all sides

    def to_page(points: Array) -> Array:
        return np.column_stack([points[:, 0] + side, side - points[:, 1]])

    placed = tuple(writer.place([unit.word], [0.0], x_height, to_page))
    return Manuscript((Line(letter, placed, side),), Page(2 * side, 2 * side), x_height, {"hand": hand.name})


def _rows(hand: Hand, room: float) -> Iterator[list[tuple[float, Glyph]]]:
    """(x, glyph) in rows of `room` x-heights; the forms of a letter stay together where they fit."""
    row: list[tuple[float, Glyph]] = []
    x = 0.0
    for glyphs in map(forms, hand.glyphs.values()):
        xs = [np.concatenate([stroke[:, 0] for stroke in glyph.strokes]) for glyph in glyphs]
        extents = [(float(x.min()), float(x.max())) for x in xs]
        together = sum(right - left + _BETWEEN_FORMS for left, right in extents)
        if row and x + min(together, room) > room:
            yield row
            row, x = [], 0.0
        for glyph, (left, right) in zip(glyphs, extents, strict=True):
            if row and x + right - left > room:
                yield row
                row, x = [], 0.0
            row.append((x - left, glyph))
            x += right - left + _BETWEEN_FORMS
        x += _BETWEEN_LETTERS
    if row:
        yield row


def _line(hand: Hand, row: list[tuple[float, Glyph]], number: int, words: int, x_height: float) -> Line:
    baseline = (_MARGIN + 2.2 + _PITCH * number) * x_height

    def to_page(points: Array, x: float) -> Array:
        slanted = points[:, 0] + hand.slant * points[:, 1] + x + _MARGIN
        return np.column_stack([slanted * x_height, baseline - points[:, 1] * x_height])

    placed = [
        Placed(glyph, tuple(to_page(s, x) for s in glyph.strokes), joined=False, word=words + i, at=i)
        for i, (x, glyph) in enumerate(row)
    ]
    return Line("".join(glyph.letter for _, glyph in row), tuple(placed), baseline)


def _lower_line(line: Line, dy: float, words: int) -> Line:
    placed = tuple(
        Placed(p.glyph, tuple(s + np.array([0.0, dy]) for s in p.strokes), p.joined, p.word + words, p.at)
        for p in line.placed
    )
    return Line(line.text, placed, line.baseline + dy, line.rise)
