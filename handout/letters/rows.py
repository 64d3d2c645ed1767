"""Rows of words on the pages of a letter, still even, and how a letter is set: what `flow` gives its place."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import NamedTuple

from handout.letters.document import LetterFile, Side, SpanManner
from handout.letters.runs import LetterWord, Runs, Writer
from handout.writing.layout import Layout
from handout.writing.pages import squeeze_gaps


class Voice(NamedTuple):
    """What is written without changing the pen or the size: a hand, "" that of the letter, an ink and a size."""

    hand: str
    ink: str
    size: float


@dataclass(frozen=True, eq=False)
class Segment:
    """Words side by side in a column.

    x, width : mm, of the column; side : None as the letter is aligned.
    """

    x: float
    width: float
    words: tuple[LetterWord, ...]
    gaps: tuple[float, ...]
    side: Side | None = None


@dataclass(frozen=True)
class Mark:
    """Something drawn.

    kind : of a bullet ("dash", "dot", "ring") or rule ("short", "wide", "flourish"), or "ruled", a line of a table.
    start, end : mm from the left, and down from its row's baseline.
    """

    kind: str
    start: tuple[float, float]
    end: tuple[float, float]
    voice: Voice
    at: int = 0


@dataclass(frozen=True, eq=False)
class RowFrame:
    """Where rows go on one page: the page's margins, or a box."""

    left: float
    top: float
    right: float
    bottom: float

    @property
    def width(self) -> float:
        return self.right - self.left


@dataclass(frozen=True, eq=False)
class SetRow:
    """One written line, still even: height of its baseline, mm, with its words, and what is drawn about them."""

    baseline: float
    slope: float
    frame: RowFrame
    segments: tuple[Segment, ...]
    marks: tuple[Mark, ...] = ()


@dataclass(frozen=True)
class Pasted:
    """A picture or a signature at its place: x, y, width, height in mm.

    row : how many rows of the page are written before it; word : its number among the words of the page.
    """

    source: str | Path
    x: float
    y: float
    width: float
    height: float
    ink: str = ""
    row: int = 0
    word: int = 0


@dataclass(eq=False)
class FlowPage:
    rows: list[SetRow] = field(default_factory=list)
    pictures: list[Pasted] = field(default_factory=list)
    signatures: list[Pasted] = field(default_factory=list)
    # left, top, right, bottom, mm, of what words stand beside, and of what only a date stands beside
    taken: list[tuple[float, float, float, float]] = field(default_factory=list)
    boxes: list[tuple[float, float, float, float]] = field(default_factory=list)


@dataclass(frozen=True, eq=False)
class LetterSetting:
    """How a letter is set.

    first, following : layouts of the first page and the others, that differ in their margins alone.
    sizes : of each picture and signature, width and height, mm or in any unit.
    """

    letter: LetterFile
    runs: Runs
    writers: Mapping[str, Writer]
    first: Layout
    following: Layout
    sizes: Mapping[str | Path, tuple[float, float]] = field(default_factory=dict)
    pages: int | None = None

    def scale_letters(self, scale: float) -> LetterSetting:
        """The same in smaller letters."""

        def smaller(layout: Layout) -> Layout:
            spacing = layout.line_spacing and max(layout.line_spacing * scale, layout.x_height * scale)
            return replace(layout, x_height=layout.x_height * scale, line_spacing=spacing, shrunk=scale)

        return replace(self, first=smaller(self.first), following=smaller(self.following))


def voice_of(manner: SpanManner) -> Voice:
    return Voice(manner.hand, manner.ink, manner.size)


def gaps_of(words: Sequence[LetterWord]) -> tuple[float, ...]:
    """The gaps before some words, with nothing narrowed."""
    return tuple(squeeze_gaps(words, math.inf, 0.0) or ())
