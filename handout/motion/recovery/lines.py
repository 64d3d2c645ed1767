"""The line of one letter, and the strokes that it was written with."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

from handout.values import Array, Indices


@dataclass(frozen=True, eq=False)
class Line:
    """The line of one letter: its body, and where it is joined the way to its neighbours.

    xy : (n, 2), y up; radius, density : (n,); edges : (m, 2), as in `values.LineGraph`.
    small : height of a small letter, in the unit of `xy`.
    base : y of the line that the letter stands on, None where that is not known.
    begin, finish : vertices at loose ends where the pen comes from the letter before, and goes to the next.
    through : vertices at loose ends where a bar comes in from the letter before.
    either : vertices at loose ends where the pen comes from the letter before, or a bar does.
    across : vertices at loose ends where a bar goes over to the next letter.
    joining : whether it is of a hand that joins letters, if not all.
    bars, others : vertices along the bars that are known from the whole word: the letter's own, and those of others.
    shared : for each of both vertices before and after it that it shares with other strokes.
    """

    xy: Array
    radius: Array
    density: Array
    edges: Indices
    small: float
    begin: tuple[int, ...] = ()
    finish: tuple[int, ...] = ()
    through: tuple[int, ...] = ()
    either: tuple[int, ...] = ()
    across: tuple[int, ...] = ()
    joining: bool = False
    base: float | None = None
    bars: tuple[Indices, ...] = ()
    others: tuple[Indices, ...] = ()
    shared: tuple[tuple[Indices, Indices], ...] = ()

    @property
    def joints(self) -> set[int]:
        """Where it is cut off from what else the pen wrote."""
        return {*self.begin, *self.finish, *self.through, *self.either, *self.across}


@dataclass(frozen=True, eq=False)
class Written:
    """How a letter was written.

    strokes : vertices of its line in order, for each pen-down movement.
    late : for each, whether it is written after the word.
    bars : for each, whether it is a bar, or what else forms of the letter write late, whenever this one was written.
    """

    strokes: tuple[Indices, ...]
    late: tuple[bool, ...]
    bars: tuple[bool, ...] = ()


@dataclass(frozen=True, eq=False)
class Way:
    """A way in which a letter may have been written.

    strokes : as in `Written`.
    cost : what it costs a hand, and how unlike the usual ways of writing the letter it is.
    later : tells which of the strokes are written after the word, and which are bars.
    """

    strokes: tuple[Indices, ...]
    cost: float
    later: Callable[[], tuple[tuple[bool, ...], tuple[bool, ...]]]

    @cached_property
    def written(self) -> Written:
        """The letter written so."""
        return Written(self.strokes, *self.later())
