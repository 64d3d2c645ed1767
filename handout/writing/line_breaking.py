"""Breaks paragraphs into rows as wide as the page allows, and makes them fit a number of pages when asked to."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from statistics import median
from typing import Generic

import numpy as np

from handout.errors import DoesNotFit
from handout.writing.layout import Layout
from handout.writing.line_writer import Unit, W

LEAST_GAP = 0.55  # between the ink of two words, x-heights
_SQUEEZE = 0.22  # people bunch the words of a line by at most this share of its gaps to get one more word in
_SMALLEST_FIT = 0.55  # --fit never makes writing smaller than this share of what was asked for
_BUNCHED = (0.72, 0.88)  # what --fit then makes of word gaps and line distance
_CUT = 0.01  # x-heights before what a word that is wider than its line goes on with: it is still one word
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


def fitted_rows(
    paragraphs: Sequence[tuple[float, list[Unit[W]]]], pitch: float, layout: Layout, limit: int
) -> tuple[Layout, list[Row[W]]]:
    """Rows that fit the pages, and the layout they fit with (smaller or tighter, where `layout.fit` allows it)."""
    rows = list(rows_of(paragraphs, layout))
    fits = _pages(len(rows), pitch, layout) <= limit
    if fits and (not layout.fit or _widest(rows) <= layout.room):
        return layout, rows
    if not layout.fit:
        raise _too_long(len(rows), pitch, layout, limit)
    for scale in np.linspace(1.0, _SMALLEST_FIT, 46)[1:]:
        smaller = _scaled(layout, pitch, float(scale))
        rows = list(rows_of(paragraphs, smaller))
        if _pages(len(rows), pitch, smaller) <= limit and _widest(rows) <= smaller.room:
            return smaller, rows
    tight = _scaled(layout, pitch, _SMALLEST_FIT, _BUNCHED[1])
    rows = list(rows_of([(indent, _bunch(units)) for indent, units in paragraphs], tight))
    if _pages(len(rows), pitch, tight) <= limit:
        return tight, rows
    raise _too_long(len(rows), pitch, tight, limit)


def _scaled(layout: Layout, pitch: float, scale: float, tighter: float = 1.0) -> Layout:
    if layout.ruling is not None:  # the rules stay where they are
        return replace(layout, x_height=layout.x_height * scale)
    distance = layout.baseline_distance(pitch) * scale * tighter
    return replace(layout, x_height=layout.x_height * scale, line_spacing=max(distance, layout.x_height * scale))


def _bunch(units: Sequence[Unit[W]]) -> list[Unit[W]]:
    return [replace(unit, gap=unit.gap * _BUNCHED[0]) for unit in units]


def _widest(rows: Sequence[Row[W]]) -> float:
    return max(row.indent + row.width for row in rows)


def rows_of(paragraphs: Iterable[tuple[float, Iterable[Unit[W]]]], layout: Layout) -> Iterator[Row[W]]:
    """The rows of all paragraphs, one after the other; of an indent no more than half the room is kept."""
    width = layout.room
    for indent, units in paragraphs:
        parts = (part for unit in units for part in _broken(unit, width))
        yield from wrap(parts, min(indent, 0.5 * width), width)


def _broken(unit: Unit[W], room: float) -> list[Unit[W]]:
    """A word wider than the line, cut between letters; any other as it is."""
    first, *others = unit.word.parts(room)
    intended = None if unit.intended is None else ""  # a slip is told of once
    return [replace(unit, word=first), *(Unit(part, _CUT, intended) for part in others)]


def _pages(rows: int, pitch: float, layout: Layout) -> int | float:
    lines = layout.lines_a_page(pitch)
    return math.ceil(rows / lines) if lines else math.inf


def _too_long(rows: int, pitch: float, layout: Layout, limit: int) -> DoesNotFit:
    held = layout.lines_a_page(pitch) * limit
    over = (rows - held) * layout.baseline_distance(pitch)
    way_out = "a larger page or less text" if layout.fit else "--fit, a smaller --x-height, or a larger page"
    sheets = "the page holds" if limit == 1 else f"{limit} pages hold"
    return DoesNotFit(
        f"The text needs {rows} lines at an x-height of {layout.x_height:.2g} mm, but {sheets} {held}: "
        f"{rows - held} lines or {over:.0f} mm too many; use {way_out}."
    )
