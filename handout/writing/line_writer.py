"""Who writes: what the setting of lines and pages needs to know of a hand, be it drawn or scanned.

`LineWriter` is the protocol that every kind of hand implements: `drawn_line_writer` and `scanned.line_writer` do.  A
text comes to it in pieces: what is written in one go, and the spaces between.  Lengths are in x-heights.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Generic, Protocol, Self, TypeVar

from handout.values import Array, Placed
from handout.writing.baseline_model import BaselineModel
from handout.writing.text import Piece, Repertoire

MORE_SPACE = 0.75  # of a gap between words, for every further space; set by eye
MOST_SPACES = 12  # in a row that widen a gap


class Word(Protocol):
    """What is written in one go, set but without a place; its first letter begins at x = 0.

    advance : where it ends, as the next word sees it.
    left, right : horizontal extent of the ink within reach of the neighbouring words.
    spelt : its graphemes.
    """

    @property
    def advance(self) -> float: ...
    @property
    def left(self) -> float: ...
    @property
    def right(self) -> float: ...
    @property
    def spelt(self) -> tuple[str, ...]: ...
    def parts(self, room: float) -> Sequence[Self]:
        """Itself, or where it is wider than `room` what is left when it is cut between letters."""


W = TypeVar("W", bound=Word)

# places (n, 2), mm from the left edge of the page and mm over the baseline → page coordinates (n, 2)
ToPage = Callable[[Array], Array]


@dataclass(frozen=True, eq=False)
class Unit(Generic[W]):
    """A word, or the part of one up to a hyphen, with the gap before it (0: no space, part of the word before).

    intended : the word that was to be written, where this one is struck out; "" for what is left of one that was cut.
    """

    word: W
    gap: float
    intended: str | None = None


class LineWriter(Protocol[W]):
    """Writes one text from its first letter to its last.

    name : of the hand.
    pitch : usual distance of lines.
    repertoire : what the hand can write.
    baseline_model : how its lines lie on a page.
    """

    @property
    def name(self) -> str: ...
    @property
    def pitch(self) -> float: ...
    @property
    def repertoire(self) -> Repertoire: ...
    @property
    def baseline_model(self) -> BaselineModel: ...
    def paragraphs(self, pieces: Iterable[Sequence[Piece]]) -> Iterator[tuple[float, Iterator[Unit[W]]]]:
        """(indent, units) of one paragraph after the other; each is to be used up before the next is asked for."""

    def place(self, words: Sequence[W], starts: Sequence[float], scale: float, to_page: ToPage) -> Iterator[Placed]:
        """The glyphs of a line whose words, numbered from 0, start at `starts` mm; `scale` is mm an x-height."""
