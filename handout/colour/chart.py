"""The calibration chart: which colours it has, and where everything is on its pages.

The chart has the RGB cube in 8 × 8 × 8 steps and 256 greys, as in the paper.  White, greys, black and primaries are
repeated all over the page: from the repeats a reading learns the shading and the noise.  The order is shuffled, so that
what changes over the page is not taken for a change of colour.  A version of the chart fixes all places, and the
numbers of a page's marks name version and page: the reading needs nothing but the scan.

Source: seed 000, Appendix K; shuffling, repeats and marks are this project's.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from functools import cache, cached_property
from hashlib import blake2b
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from handout import units
from handout.errors import DoesNotFit, InputError
from handout.libraries import cv2
from handout.page_sizes import page
from handout.summary import one_line
from handout.values import Array, Page, readonly, readonly_indices

_T = TypeVar("_T")

VERSION = 1  # of the chart's places and colours, in the numbers of its marks
FRAME = 0.3  # mm, width of the line about the field for the pen
CELLS = 7  # of a mark, along a side, its black edge included
MARKS = 16  # a page, in four rows of four
_PER_VERSION = 8 * MARKS  # numbers of marks kept for a version
_LEVELS = np.rint(np.linspace(0, 255, 8)).astype(int)
_ROOT = 1.32471795724474602596  # the root of x³ = x + 1: Roberts' additive recurrence R2 (2018)
_TOP = 8.0  # mm from the upper edge to the first line of words
_GRID_TOP = 17.9  # mm from there to the first patches, for charts that begin at _TOP
_FIELD = (66.0, 1.6, 8.0)  # mm: of the field under the patches its left edge, its distance from them, its height
_LABEL = 3.2  # mm beside and above the patches, for the names of rows and columns
# colours that come again, the more often the more there are of them in a turn
_REPEATS = (
    (255, 255, 255), (128, 128, 128), (255, 255, 255), (0, 0, 0), (255, 255, 255), (64, 64, 64), (0, 255, 255),
    (255, 0, 255), (255, 255, 0), (128, 128, 128), (255, 255, 255), (0, 0, 0), (192, 192, 192), (255, 0, 0),
    (0, 255, 0), (0, 0, 255),
)  # fmt: skip


@dataclass(frozen=True)
class _Sheet:
    """How one size of paper is divided: cells of `pitch` mm, `columns` × `rows` of them, from `top` mm down."""

    paper: Page
    pages: int
    pitch: float
    columns: int
    rows: int
    top: float

    @property
    def left_edge(self) -> float:
        return (self.paper.width - self.columns * self.pitch) / 2


_A4, _LETTER = page("A4"), page("letter")
# the place in this list is in the numbers of the marks: a change of it is a new version
_SHEETS = (
    _Sheet(_A4, 1, 7.0, 27, 37, _TOP),
    _Sheet(_LETTER, 1, 7.0, 28, 34, _TOP),
    _Sheet(_A4, 2, 7.5, 21, 31, 21.0),
    _Sheet(_LETTER, 2, 7.5, 21, 29, 21.0),
)
# number of the first page of each sheet, in the order of _SHEETS
_FIRST = (0, 1, 2, 4)
PAPERS = (_A4, _LETTER)


@dataclass(frozen=True, eq=False)
class ChartPage:
    """One page of a chart.

    version : of the chart.
    paper : the sheet, upright.
    number, pages : of this page, from 1, and of all.
    pitch : mm, side of a patch.
    origin : (x, y), mm, the top left corner of the grid of patches.
    columns, rows : cells of the grid.
    device : (n, 3) float 0–1, what is sent to the printer for each patch: whole 255ths.
    cells : (n, 2) int, column and row of each patch.
    ids : (16,) int, the numbers of the marks.
    mark_cells : (16, 2) int, column and row of the first of the four cells that a mark takes.
    """

    version: int
    paper: Page
    number: int
    pages: int
    pitch: float
    origin: tuple[float, float]
    columns: int
    rows: int
    device: Array
    cells: NDArray[np.intp]
    ids: NDArray[np.intp]
    mark_cells: NDArray[np.intp]

    __repr__ = one_line

    def __post_init__(self) -> None:
        object.__setattr__(self, "device", readonly(self.device, None, 3))
        object.__setattr__(self, "cells", readonly_indices(self.cells, len(self.device), 2))
        object.__setattr__(self, "ids", readonly_indices(self.ids, MARKS))
        object.__setattr__(self, "mark_cells", readonly_indices(self.mark_cells, MARKS, 2))

    @cached_property
    def boxes(self) -> Array:
        """(n, 4) mm: left, top, right, bottom of each patch."""
        corner = self.cells * self.pitch + self.origin
        return readonly(np.hstack([corner, corner + self.pitch]), None, 4)

    @cached_property
    def marks(self) -> Array:
        """(16, 4, 2) mm: corners of each mark's black square, clockwise from its top left."""
        module = 2 * self.pitch / (CELLS + 2)
        corner = self.mark_cells * self.pitch + self.origin + module
        square = np.array([(0, 0), (1, 0), (1, 1), (0, 1)], dtype=np.float64) * CELLS * module
        return readonly(corner[:, None] + square, MARKS, 4, 2)

    @cached_property
    def names(self) -> tuple[str, ...]:
        """What each patch is called: its column in letters and its row in figures, from A1."""
        return tuple(f"{letters(column)}{row + 1}" for column, row in self.cells.tolist())

    @cached_property
    def title(self) -> tuple[float, float, float]:
        """x and y of the words at the top and their width, mm."""
        return self.origin[0], self.origin[1] - (_GRID_TOP - _TOP), self.columns * self.pitch

    @property
    def scribble_field(self) -> tuple[float, float, float, float]:
        """Left, top, right and bottom, mm, of the framed field in which a person writes with the pen itself."""
        aside, under, height = _FIELD
        x, top = self.origin[0], self.origin[1] + self.rows * self.pitch + under
        return x + aside, top, x + self.columns * self.pitch - FRAME, top + height

    @property
    def bounds(self) -> tuple[float, float, float, float]:
        """Left, top, right and bottom of all that is printed, mm."""
        x = self.origin[0]
        return (
            x - _LABEL, self.title[1], x + self.columns * self.pitch, self.scribble_field[3] + FRAME,
        )  # fmt: skip

    @property
    def label(self) -> str:
        """What the page is called in a message."""
        which = f", page {self.number} of {self.pages}" if self.pages > 1 else ""
        return f"chart {self.version} on {self.paper.name}{which}"


@dataclass(frozen=True, eq=False)
class Chart:
    """All pages of a chart, and the version that they are of."""

    version: int
    paper: Page
    pages: tuple[ChartPage, ...]

    __repr__ = one_line

    @cached_property
    def colours(self) -> Array:
        """(m, 3) float 0–1: the different colours of all pages, sorted by red, green and blue."""
        return readonly(np.unique(np.vstack([page.device for page in self.pages]), axis=0), None, 3)


def chart(
    paper: str = "A4", *, pages: int | None = None, margins: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)
) -> Chart:
    """The chart for a paper and a printer.

    paper : "A4" or "letter".
    pages : 1, or 2 with more room about them; None: 1 if the printer reaches far enough, else 2.
    margins : (top, right, bottom, left), mm: what the printer cannot print on.

    Raises InputError: another paper, or another number of pages. DoesNotFit: the printer does not reach as far as the
    chart does.
    """
    names = {sheet.paper.name.lower() for sheet in _SHEETS}
    if paper.lower() not in names:
        raise InputError(f"The chart is made for A4 and letter, not for {paper!r}: print it on one of these.")
    if pages not in (None, 1, 2):
        raise InputError(f"The chart has 1 or 2 pages, not {pages}.")
    fitting = [i for i, sheet in enumerate(_SHEETS) if sheet.paper.name.lower() == paper.lower()]
    reasons = []
    for index in fitting:
        if pages in (None, _SHEETS[index].pages):
            layout = _chart(VERSION, index)
            if not (reason := _outside(layout, margins)):
                return layout
            reasons.append(reason)
    raise DoesNotFit(
        f"The chart does not fit: {reasons[-1]}. Use a printer, or a tray, with smaller margins"
        + ("." if pages != 1 else ", or the chart in 2 pages.")
    )


def _outside(chart: Chart, margins: tuple[float, float, float, float]) -> str:
    """A sentence on the edge at which a printer's margins cut the chart, and by how much; empty if they do not."""
    top, right, bottom, left = margins
    page = chart.pages[0]
    x0, y0, x1, y1 = page.bounds
    room = {
        "top": (top, y0), "right": (right, chart.paper.width - x1),
        "bottom": (bottom, chart.paper.height - y1), "left": (left, x0),
    }  # fmt: skip
    for edge, (margin, free) in room.items():
        if margin > free + 1e-9:
            return (
                f"it keeps {free:.1f} mm from the {edge} of {chart.paper.name} in "
                f"{units.count(len(chart.pages), 'page')}, and the "
                f"printer cannot print on {margin:.1f} mm there"
            )
    return ""


def page_of_marks(number: int) -> ChartPage | None:
    """The page that has a mark of that number; None if no chart of a known version has."""
    version, rest = divmod(number, _PER_VERSION)
    place = rest // MARKS
    for index, sheet in enumerate(_SHEETS):
        if version + 1 == VERSION and _FIRST[index] <= place < _FIRST[index] + sheet.pages:
            return _chart(VERSION, index).pages[place - _FIRST[index]]
    return None


def whole(page: ChartPage) -> Chart:
    """The chart that a page belongs to."""
    index = next(i for i, sheet in enumerate(_SHEETS) if sheet.paper == page.paper and sheet.pages == page.pages)
    return _chart(page.version, index)


def letters(column: int) -> str:
    """A column's name: A … Z, AA, AB …"""
    return (letters(column // 26 - 1) if column >= 26 else "") + chr(ord("A") + column % 26)


@cache
def _chart(version: int, index: int) -> Chart:
    sheet = _SHEETS[index]
    cube = itertools.product(_LEVELS.tolist(), repeat=3)
    unique = _shuffle_by_salt([*cube, *((grey, grey, grey) for grey in range(256))], f"{version}")
    share = [unique[i :: sheet.pages] for i in range(sheet.pages)]
    pages = [_page(version, index, number, share[number - 1]) for number in range(1, sheet.pages + 1)]
    return Chart(version, sheet.paper, tuple(pages))


def _page(version: int, index: int, number: int, unique: list[tuple[int, int, int]]) -> ChartPage:
    sheet = _SHEETS[index]
    free, marks = grid_cells(sheet.columns, sheet.rows)
    repeats = list(itertools.islice(itertools.cycle(_REPEATS), len(free) - len(unique)))
    placed = _scatter_repeats(repeats, free, sheet)
    rest = _shuffle_by_salt([cell for cell in free if cell not in placed], f"{version} {index} {number}")
    placed |= dict(zip(rest, unique, strict=True))
    cells = [cell for cell in free if cell in placed]
    first = (version - 1) * _PER_VERSION + (_FIRST[index] + number - 1) * MARKS
    return ChartPage(
        version, sheet.paper, number, sheet.pages, sheet.pitch,
        (sheet.left_edge, sheet.top + _GRID_TOP - _TOP), sheet.columns, sheet.rows,
        np.array([placed[cell] for cell in cells]) / 255, np.array(cells), first + np.arange(MARKS), np.array(marks),
    )  # fmt: skip


def grid_cells(columns: int, rows: int) -> tuple[list[tuple[int, int]], list[tuple[int, int]]]:
    """(column, row) of the cells that are free for patches, and of the first of the four cells of every mark."""
    across = np.rint(np.linspace(0, columns - 2, 4)).astype(int).tolist()
    down = np.rint(np.linspace(0, rows - 2, 4)).astype(int).tolist()
    marks = [(x, y) for y in down for x in across]
    covered = {(x + i, y + j) for x, y in marks for i in (0, 1) for j in (0, 1)}
    return [(x, y) for y in range(rows) for x in range(columns) if (x, y) not in covered], marks


def _shuffle_by_salt(items: list[_T], salt: str) -> list[_T]:
    """Shuffle items by the salt alone: no random generator promises the same numbers for ever."""

    def key(i: int) -> bytes:
        return blake2b(f"{salt} {i}".encode(), digest_size=16).digest()

    return [items[i] for i in sorted(range(len(items)), key=key)]


def _scatter_repeats(
    repeats: list[tuple[int, int, int]], free: list[tuple[int, int]], sheet: _Sheet
) -> dict[tuple[int, int], tuple[int, int, int]]:
    """Give each repeat a cell; the repeats of one colour are spread evenly over the page."""
    left = set(free)
    placed = {}
    for colour in sorted(set(repeats), key=lambda c: (-repeats.count(c), c)):
        first = sum(map(int, colour)) + 1
        for i in range(first, first + repeats.count(colour)):
            u, v = (0.5 + i / _ROOT) % 1.0, (0.5 + i / _ROOT**2) % 1.0  # any first few of them evenly spread
            x, y = u * (sheet.columns - 1), v * (sheet.rows - 1)
            cell = min(left, key=lambda c: ((c[0] - x) ** 2 + (c[1] - y) ** 2, c))
            left.remove(cell)
            placed[cell] = colour
    return placed


@cache
def dictionary() -> Any:
    """The family of the marks."""
    return cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_5X5_1000)
