"""Breaking a text into lines, and making it fit when asked to."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from statistics import median
from typing import Generic

from handout.writing.line_writer import Unit, W

LEAST_GAP = 0.55  # between the ink of two words, x-heights
_SQUEEZE = 0.22  # people bunch the words of a line by at most this share of its gaps to get one more word in
_BUNCH = 0.25  # share of the usual gap that a gap near the edge gives up before those further from it do


@dataclass(frozen=True, eq=False)
class Row(Generic[W]):
    """The units of one written line; `gaps` may be narrower than the units ask for."""

    units: tuple[Unit[W], ...]
    gaps: tuple[float, ...]
    indent: float

    @property
    def width(self) -> float:
        """From the start of the first unit to the end of the ink of the last, x-heights."""
        return extent(self.units, self.gaps)


def extent(units: Sequence[Unit[W]], gaps: Sequence[float]) -> float:
    """Width of units side by side, x-heights."""
    if not units:
        return 0.0
    last = units[-1].word
    reach = max(last.right, last.advance)
    return sum(gaps[1:]) + sum(unit.word.advance for unit in units[:-1]) + reach


def wrap(paragraph: Iterable[Unit[W]], indent: float, room: float, squeeze: float = _SQUEEZE) -> Iterator[Row[W]]:
    """Break a paragraph into rows of at most `room` x-heights; an empty one gives one empty row."""
    units: list[Unit[W]] = []
    for unit in paragraph:
        if units and _squeezed([*units, unit], room - indent, squeeze) is None:
            yield _row(units, indent, room, squeeze)
            units, indent = [], 0.0
        units.append(unit)
    yield _row(units, indent, room, squeeze)


def _row(units: list[Unit[W]], indent: float, room: float, squeeze: float) -> Row[W]:
    gaps = _squeezed(units, room - indent, squeeze)
    return Row(tuple(units), tuple(gaps if gaps is not None else _gaps(units)), indent)


def _gaps(units: Sequence[Unit[W]]) -> list[float]:
    """The gaps before the units, none before the first; ink never closes a gap."""
    gaps = [0.0]
    for before, unit in pairwise(units):
        overhang = before.word.right - before.word.advance - unit.word.left
        gaps.append(max(unit.gap, LEAST_GAP + overhang) if unit.gap else 0.0)
    return gaps[: len(units)]


def _squeezed(units: Sequence[Unit[W]], room: float, squeeze: float) -> list[float] | None:
    """The gaps with which the units fit into `room`, narrowed where they must be; None where they cannot."""
    gaps = _gaps(units)
    over = extent(units, gaps) - room
    if over <= 0:
        return gaps
    # what is narrow already stays: two words must not become one
    spare = [max(gap - LEAST_GAP, 0.0) for gap in gaps]
    if len(gaps) < 2 or over > min(squeeze * sum(gaps), sum(spare)):
        return None
    # the edge is only seen when it is near: the last gaps are the narrow ones
    least = (1 - _BUNCH) * median(gaps[1:])
    for number in reversed(range(1, len(gaps))):
        less = min(spare[number], over, max(gaps[number] - least, 0.0))
        gaps[number], spare[number], over = gaps[number] - less, spare[number] - less, over - less
    rest = over / sum(spare) if sum(spare) else 0.0
    return [gap - more * rest for gap, more in zip(gaps, spare, strict=True)]
