"""Words on pages: rows as wide as the page allows, made to fit where that is asked for, and the place of every glyph.

Words come set by a `Handwriting`, in x-heights, with the gaps before them; `rows_of` breaks them into rows, `paginate`
gives each row its place and asks the handwriting for its glyphs there.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import chain, groupby, islice, pairwise
from statistics import median
from typing import TYPE_CHECKING, Any, Generic, NamedTuple, Protocol, Self, TypeVar

import numpy as np

from handout.errors import DoesNotFit
from handout.hand.protocol import Repertoire
from handout.values import Array, Glyph, Line, Manuscript, Placed
from handout.writing.choosing import Choice, GlyphStock
from handout.writing.kept_text import Resumable
from handout.writing.layout import ASCENT, DESCENT, FOOT_ABOVE_RULE, BaselineModel, Layout, line_geometries, on_rules
from handout.writing.slips import StrikeThrough
from handout.writing.text import may_part

if TYPE_CHECKING:
    from handout.mathematics.shapes import Wander

# places (n, 2), mm from the left edge of the page and mm over the baseline → page coordinates (n, 2)
ToPage = Callable[[Array], Array]

_MORE_SPACE = 0.75  # of a gap between words, for every further space; set by eye
_MOST_SPACES = 12  # in a row that widen a gap


class SetGlyph(Protocol):
    """A glyph in its word; a glyph with a plan, or one with ink."""

    def move_by(self, x: float) -> Self:
        """The same, so many x-heights further right."""


G = TypeVar("G", bound=SetGlyph)


@dataclass(frozen=True, eq=False)
class Word(Generic[G]):
    """What is written in one go, set but without a place; lengths in x-heights, its first letter begins at x = 0.

    extents : (n, 2) float: where the ink of each glyph begins and ends.
    at, spelt : index in the text and grapheme of each.
    advance : where it ends, as the next word sees it.
    left, right : horizontal extent of the ink within reach of the neighbouring words.
    glued : whether it goes on with the word before, without a space.
    low, high : where its ink ends below and above its baseline, if it may be more than that of letters.
    displayed : whether it stands in the middle of lines of its own.
    """

    glyphs: tuple[G, ...]
    extents: Array
    at: tuple[int, ...]
    spelt: tuple[str, ...]
    advance: float
    left: float
    right: float
    glued: bool = False
    low: float = -DESCENT
    high: float = ASCENT
    displayed: bool = False

    def parts(self, room: float) -> list[Word[G]]:
        """The word itself, or its parts, cut between letters, if it is wider than `room`."""
        if max(self.right, self.advance) <= room or len(self.glyphs) == 1:
            return [self]
        cuts = [0]
        for i in range(1, len(self.glyphs)):
            if self.extents[i, 1] - self.extents[cuts[-1], 0] > room:
                cuts.append(i)
        return [self._part(a, b) for a, b in pairwise([*cuts, len(self.glyphs)])]

    def _part(self, a: int, b: int) -> Word[G]:
        begin = float(self.extents[a, 0]) if a else 0.0
        glyphs = tuple(glyph.move_by(-begin) for glyph in self.glyphs[a:b])
        extents = self.extents[a:b] - begin
        left, right = float(extents[:, 0].min()), float(extents[:, 1].max())
        return Word(glyphs, extents, self.at[a:b], self.spelt[a:b], right, left, right, self.glued or a > 0)


@dataclass(frozen=True, eq=False)
class FormulaWord(Word[Any]):
    """A formula, or a piece of one that a line may end behind: words in several sizes and heights, and what is drawn.

    parts_of : in the order of writing, words with x, y (x-heights of the line) and size; and strokes, each (n, 2).
    sources : the TeX of the formulas that begin with it.
    """

    parts_of: tuple[tuple[Word[Any], float, float, float] | tuple[Array, ...], ...] = ()
    sources: tuple[str, ...] = ()

    def parts(self, room: float) -> list[Word[Any]]:
        """Itself: a formula is not cut anywhere."""
        return [self]


@dataclass(frozen=True, eq=False)
class Unit(Generic[G]):
    """A word, or the part of one up to a hyphen, with the gap before it (0: no space, part of the word before).

    intended : the word that was to be written, where this one is struck out; "" for what is left of one that was cut.
    tied : whether no line may end before it.
    """

    word: Word[G]
    gap: float
    intended: str | None = None
    tied: bool = False


class Handwriting(Protocol[G]):
    """How a hand of some kind writes one text, drawn or scanned: what the steps of `compose` ask of it.

    name : of the hand.
    pitch : usual distance of lines, x-heights; space : usual gap between words.
    repertoire : what the hand can write.
    stock : its glyphs, for choosing.
    writers : what its words change for the next ones.
    baseline_model : how its lines lie on a page.
    """

    @property
    def name(self) -> str: ...
    @property
    def pitch(self) -> float: ...
    @property
    def space(self) -> float: ...
    @property
    def repertoire(self) -> Repertoire: ...
    @property
    def stock(self) -> GlyphStock: ...
    @property
    def writers(self) -> Sequence[Resumable]: ...
    @property
    def baseline_model(self) -> BaselineModel: ...
    def wander(self, key: Sequence[int]) -> Wander:
        """By which a formula varies; `key` : of its first word, see `Choice`."""

    def ink_box(self, word: Word[G]) -> tuple[float, float, float, float]:
        """Where the ink of a word ends: left, bottom, right and top, x-heights."""

    def set_paragraph(self, words: Iterable[Choice]) -> Iterator[Unit[G]]:
        """The words of a paragraph, each set side by side, with the gap before it; before the first, the indent."""

    def place(
        self, words: Sequence[Word[G]], starts: Sequence[float], scale: float, to_page: ToPage
    ) -> Iterator[Placed]:
        """The glyphs of a line whose words, numbered from 0, start at `starts` mm; `scale` is mm an x-height."""


def place_words(
    writer: Handwriting[Any], words: Sequence[Word[Any]], starts: Sequence[float], scale: float, to_page: ToPage
) -> Iterator[Placed]:
    """The glyphs of a line as `Handwriting.place` gives them, and those of its formulas with what is drawn of these."""

    def higher(up: float, points: Array) -> Array:
        return to_page(points + np.array([0.0, up]))

    numbered = list(zip(range(len(words)), words, starts, strict=True))
    for formula, group in groupby(numbered, key=lambda each: isinstance(each[1], FormulaWord)):
        some = list(group)
        if not formula:
            placed = writer.place([word for _, word, _ in some], [start for *_, start in some], scale, to_page)
            yield from (replace(glyph, word=some[glyph.word][0]) for glyph in placed)
            continue
        for number, word, start in some:
            assert isinstance(word, FormulaWord)
            for part in word.parts_of:
                if isinstance(part[0], Word):
                    inner, x, y, size = part
                    raised = partial(higher, y * scale)
                    placed = writer.place([inner], [start + x * scale], size * scale, raised)
                    yield from (replace(glyph, word=number) for glyph in placed)
                else:
                    strokes = tuple(to_page(stroke * scale + (start, 0.0)) for stroke in part)
                    mark = Glyph("", (), (False,) * len(strokes), 0.0)
                    yield Placed(mark, strokes, joined=False, word=number, at=word.at[0])


def wide_gap(usual: float, spaces: int) -> float:
    """The gap that some spaces make, where one makes `usual`."""
    return usual * (1 + _MORE_SPACE * (min(spaces, _MOST_SPACES) - 1))


def indent_paragraph(units: Iterator[Unit[G]]) -> tuple[float, Iterator[Unit[G]]]:
    """A paragraph with its indent; words behind the first are not asked for."""
    first = list(islice(units, 1))
    return (first[0].gap if first else 0.0), chain(first, units)


LEAST_GAP = 0.55  # between the ink of two words, x-heights
SQUEEZE = 0.22  # people bunch the words of a line by at most this share of its gaps to get one more word in
SMALLEST_FIT = 0.55  # --fit never makes writing smaller than this share of what was asked for
_UNBROKEN = 0.7  # of the size that was asked for: rather than that small, a line is broken; set by eye
_BUNCHED = (0.72, 0.88)  # what --fit then makes of word gaps and line distance
APART = 0.45  # x-heights between the ink of a formula and that of the line above or below; set by eye
_SLACK = 0.45  # x-heights that formulas between two lines may be higher and deeper than letters are, and take no more
_NEAR = 0.25  # x-heights between the ink of two formulas of which one is more than letters are; set by eye
_CUT = 0.01  # x-heights before what a word that is wider than its line goes on with: it is still one word
_EXACT = 1e-6  # x-heights that a line which is bunched to its room may be wider by rounding
_BUNCH = 0.25  # share of the usual gap that a gap near the edge gives up before those further from it do


@dataclass(frozen=True, eq=False)
class UnitRow(Generic[G]):
    """The units of one written line; `gaps` may be narrower than the units ask for."""

    units: tuple[Unit[G], ...]
    gaps: tuple[float, ...]
    indent: float

    @property
    def width(self) -> float:
        """From the start of the first unit to the end of the ink of the last, x-heights."""
        return extent(self.units, self.gaps)

    @property
    def displayed(self) -> bool:
        """Whether it stands in the middle."""
        return any(unit.word.displayed for unit in self.units)


def extent(units: Sequence[Unit[G]], gaps: Sequence[float]) -> float:
    """Width of units side by side, x-heights."""
    if not units:
        return 0.0
    last = units[-1].word
    reach = max(last.right, last.advance)
    return sum(gaps[1:]) + sum(unit.word.advance for unit in units[:-1]) + reach


def wrap(paragraph: Iterable[Unit[G]], indent: float, room: float, squeeze: float = SQUEEZE) -> Iterator[UnitRow[G]]:
    """Break a paragraph into rows of at most `room` x-heights; an empty one gives one empty row."""
    units: list[Unit[G]] = []
    for unit in paragraph:
        units.append(unit)
        if len(units) > 1 and squeeze_gaps(units, room - indent, squeeze) is None:
            ends = range(len(units) - 1, 0, -1)
            parts = (k for k in ends if not units[k].tied and may_part(units[k - 1].word.spelt, units[k].word.spelt))
            end = next((k for k in parts if squeeze_gaps(units[k:], room, squeeze) is not None), ends[0])
            yield _row(units[:end], indent, room, squeeze)
            units, indent = units[end:], 0.0
    yield _row(units, indent, room, squeeze)


def _row(units: list[Unit[G]], indent: float, room: float, squeeze: float) -> UnitRow[G]:
    gaps = squeeze_gaps(units, room - indent, squeeze)
    return UnitRow(tuple(units), tuple(gaps if gaps is not None else _gaps(units)), indent)


def _gaps(units: Sequence[Unit[G]]) -> list[float]:
    """The gaps before the units, none before the first; ink never closes a gap."""
    gaps = [0.0]
    for before, unit in pairwise(units):
        overhang = before.word.right - before.word.advance - unit.word.left
        gaps.append(max(unit.gap, LEAST_GAP + overhang) if unit.gap else 0.0)
    return gaps[: len(units)]


def squeeze_gaps(units: Sequence[Unit[G]], room: float, squeeze: float) -> list[float] | None:
    """The gaps with which the units fit into `room`, narrowed if need be; None if they cannot fit."""
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


def rows_on_pages(
    paragraphs: Iterable[Iterator[Unit[G]]], pitch: float, layout: Layout, pages: int | None
) -> tuple[Layout, Iterable[UnitRow[G]]]:
    """The rows of a text, and the layout they fit with (smaller or tighter, where `layout.fit` allows it).

    Rows are made when they are asked for, unless `pages` or `layout.fit` ask how many there are.

    Raises DoesNotFit: more rows than the pages hold.
    """
    written = map(indent_paragraph, paragraphs)
    limit = pages or (1 if layout.fit else None)
    if limit is None:
        return layout, rows_of(written, layout, pitch)
    return _fitted_rows([(indent, list(units)) for indent, units in written], pitch, layout, limit)


def _fitted_rows(
    paragraphs: Sequence[tuple[float, list[Unit[G]]]], pitch: float, layout: Layout, limit: int
) -> tuple[Layout, list[UnitRow[G]]]:
    """Rows that fit the pages, and the layout they fit with."""
    fitting = _fitting_rows(paragraphs, pitch, layout, limit)
    best = next(fitting, None)
    if best is not None and layout.unbroken:
        whole = (each for each in chain([best], fitting) if len(each[1]) <= len(paragraphs))
        best = next((each for each in islice(whole, 1) if each[0].shrunk >= _UNBROKEN), best)
    if best is not None:
        return best
    if not layout.fit:
        raise _too_long(len(list(rows_of(paragraphs, layout, pitch))), pitch, layout, limit)
    tight = _scale_layout(layout, pitch, SMALLEST_FIT, _BUNCHED[1])
    bunched = [(indent, [replace(unit, gap=unit.gap * _BUNCHED[0]) for unit in units]) for indent, units in paragraphs]
    rows = list(rows_of(bunched, tight, pitch))
    if _pages(len(rows), pitch, tight) <= limit:
        return tight, rows
    raise _too_long(len(rows), pitch, tight, limit)


def _fitting_rows(
    paragraphs: Sequence[tuple[float, list[Unit[G]]]], pitch: float, layout: Layout, limit: int
) -> Iterator[tuple[Layout, list[UnitRow[G]]]]:
    """The layouts with which rows fit the pages, ever smaller ones if `layout.fit` allows it, and those rows."""
    for scale in (np.linspace(1.0, SMALLEST_FIT, 46) if layout.fit else np.ones(1)).tolist():
        smaller = layout if scale == 1.0 else _scale_layout(layout, pitch, scale)
        rows = list(rows_of(paragraphs, smaller, pitch))
        within = max(row.indent + row.width for row in rows) <= smaller.room + _EXACT
        if _pages(len(rows), pitch, smaller) <= limit and (within or not layout.fit):
            yield smaller, rows


def _scale_layout(layout: Layout, pitch: float, scale: float, tighter: float = 1.0) -> Layout:
    if layout.ruling is not None:  # the rules stay where they are
        return replace(layout, x_height=layout.x_height * scale, shrunk=scale)
    distance, size = layout.baseline_distance(pitch) * scale * tighter, layout.x_height * scale
    return replace(layout, x_height=size, line_spacing=max(distance, size), shrunk=scale)


def rows_of(
    paragraphs: Iterable[tuple[float, Iterable[Unit[G]]]], layout: Layout, pitch: float
) -> Iterator[UnitRow[G]]:
    """The rows of all paragraphs, one after the other; of an indent no more than half the room is kept."""
    width = layout.room

    def rows() -> Iterator[UnitRow[G]]:
        for indent, units in paragraphs:
            parts = (part for unit in units for part in _break_unit(unit, width))
            yield from wrap(parts, min(indent, 0.5 * width), width)

    return _space_rows(rows(), layout.baseline_distance(pitch) / layout.x_height, layout.lines_a_page(pitch))


def _space_rows(rows: Iterable[UnitRow[G]], distance: float, held: int) -> Iterator[UnitRow[G]]:
    """Rows with empty ones where a formula needs the room of more lines than one, which stay on one page.

    distance : of lines, x-heights; held : how many a page has.
    """
    empty, taken, below, deep = UnitRow[G]((), (), 0.0), 0, DESCENT, 0.0
    for row in rows:
        high = max((unit.word.high for unit in row.units), default=ASCENT)
        low = min((unit.word.low for unit in row.units), default=-DESCENT)
        formulas = [unit.word for unit in row.units if isinstance(unit.word, FormulaWord)]
        top = max((formula.high for formula in formulas), default=0.0)
        at_top = _lines_in(high - ASCENT - _SLACK, distance)
        after = _lines_in(-DESCENT - _SLACK - low, distance)
        before = at_top
        if taken:
            slack = _SLACK if deep + top + _NEAR <= distance else 0.0
            tall = max(high - ASCENT, 0.0) + below - DESCENT > slack
            before = _lines_in(below + high + APART - distance, distance) if tall else 0
        if taken and taken + before + 1 + after > held > 0:
            yield from [empty] * (held - taken)
            taken, before = 0, at_top
        before = 0 if before + 1 + after > held else before  # then it has no room on any page, which is said later
        yield from [empty] * before
        yield row
        taken, below = taken + before + 1, max(-low, DESCENT)
        deep = max((-formula.low for formula in formulas), default=0.0)
        taken = 0 if taken == held else taken


def _lines_in(room: float, distance: float) -> int:
    return max(0, math.ceil(room / distance - 1e-9))


def _break_unit(unit: Unit[G], room: float) -> list[Unit[G]]:
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


class Sheet(NamedTuple):
    """A page as it is made.

    number : from 1.
    rng : where its variation goes on, when it is given time or ink.
    last : whether the text ends on it.
    """

    number: int
    manuscript: Manuscript
    rng: np.random.Generator
    last: bool


def paginate(
    rows: Iterable[UnitRow[G]], writer: Handwriting[G], layout: Layout, rng: np.random.Generator
) -> Iterator[Sheet]:
    """Give every row its place, page after page, asking for no more rows than it takes.

    Each page varies by a stream of its own, so that none waits for the words of those behind it.

    Raises DoesNotFit: not even one line fits between the margins; at once.
    """
    held = layout.lines_a_page(writer.pitch)
    if held == 0 and layout.ruling is not None:
        raise DoesNotFit(
            f"None of the paper's rules has room for letters of {layout.x_height:.2g} mm between the margins: use a "
            "smaller --x-height, smaller margins, or a larger page."
        )
    if held == 0:
        raise DoesNotFit(
            f"A line of {layout.x_height:g} mm x-height needs {(ASCENT + DESCENT) * layout.x_height:.1f} mm between "
            f"the margins, but there are {layout.height:.1f} mm: use a smaller --x-height, smaller margins or a "
            "larger page."
        )
    return _paginate_rows(rows, writer, layout, rng, held)


def _paginate_rows(
    rows: Iterable[UnitRow[G]], writer: Handwriting[G], layout: Layout, rng: np.random.Generator, held: int
) -> Iterator[Sheet]:
    """Pages of `held` rows, or the one that holds a place."""
    strike_through = StrikeThrough(rng.spawn(1)[0])
    coming, number, at = iter(rows), 0, layout.at
    page = list(islice(coming, held))
    while page:
        number += 1
        following = list(islice(coming, 1))  # all words are written when there is nothing behind a page
        page_rng = rng.spawn(1)[0]
        units = [unit for row in page for unit in row.units]
        before = at is not None and following and max((max(unit.word.at) for unit in units), default=-1) < at
        if not before or any(unit.intended is not None for unit in units):  # words are struck through in turn
            placed = _sheet(page, writer, layout, page_rng, strike_through, number)
        if not before:
            yield Sheet(number, placed, page_rng, not following)
            if at is not None:
                return
        page = list(islice(chain(following, coming), held))


def _sheet(
    rows: Sequence[UnitRow[G]],
    writer: Handwriting[G],
    layout: Layout,
    rng: np.random.Generator,
    strike_through: StrikeThrough,
    page: int,
) -> Manuscript:
    """Place the rows of one page."""
    scale, pitch = layout.x_height, layout.baseline_distance(writer.pitch)
    lines, words, slips = list[Line](), 0, list[dict[str, Any]]()
    half_width = 0.5 * layout.width
    even = _even_baselines(layout, pitch, len(rows))
    model = writer.baseline_model if layout.ruling is None else on_rules(writer.baseline_model)
    # by a stream of its own: a line more changes nothing behind it
    wandering = line_geometries(model, len(rows), layout.jitter, 0.5 * layout.room, rng.spawn(1)[0])
    for number, (row, geometry, (height, slope)) in enumerate(zip(rows, wandering, even, strict=True)):
        if not row.units:
            continue
        _check_formulas(row, layout, height)
        baseline = height - geometry.above * scale
        if layout.ruling is None:
            baseline = layout.margin[0] + (ASCENT - geometry.above) * scale + number * pitch
        x = layout.margin[3] + scale * (_find_left(row, layout, geometry.edge) + row.indent)
        rise = (geometry.slope - slope, geometry.sag * scale, layout.margin[3] + half_width, half_width)
        starts, to_page = _starts(row, x, scale), on_page(baseline, rise)
        placed = place_words(writer, [unit.word for unit in row.units], starts, scale, to_page)
        if any(unit.intended is not None for unit in row.units):
            placed = _strike_words(placed, row, starts, layout, to_page, strike_through)
        lines.append(Line(_text(row), tuple(replace(p, word=words + p.word) for p in placed), baseline, rise))
        slips += [
            {"page": page, "line": len(lines), "written": "".join(unit.word.spelt), "meant": unit.intended}
            for unit in row.units
            if unit.intended
        ]
        words += len(row.units)
    lower = 0.0
    if layout.ruling is None:  # what is written on rules stays there
        lines, lower = _inside(lines, layout, layout.height - (ASCENT + DESCENT) * scale - (len(rows) - 1) * pitch)
    ruling = {"baseline": round(even[0][0] + lower, 3), "line_spacing": round(pitch, 3)}
    about = {"hand": writer.name, "x_height": round(scale, 3), **ruling, **({"slips": slips} if slips else {})}
    about |= layout.told
    return Manuscript(tuple(lines), layout.page, scale, {**about, **_tell_formulas(rows)})


def _tell_formulas(rows: Sequence[UnitRow[Any]]) -> Mapping[str, Sequence[str]]:
    """What a page tells of its formulas: the TeX of each; nothing where there are none."""
    words = (unit.word for row in rows for unit in row.units)
    found = [source for word in words if isinstance(word, FormulaWord) for source in word.sources]
    return {"formulas": found} if found else {}


def _check_formulas(row: UnitRow[Any], layout: Layout, baseline: float) -> None:
    """Refuse a formula that is wider or higher than the page, where words would be cut."""
    formulas = [unit.word for unit in row.units if isinstance(unit.word, FormulaWord)]
    if not formulas:
        return
    scale, wide = layout.x_height, row.width > layout.room + 1e-6
    high, low = max(word.high for word in formulas) - _SLACK, min(word.low for word in formulas) + _SLACK
    above, below = baseline - high * scale - layout.margin[0], baseline - low * scale + layout.margin[2]
    over = max(-above, below - layout.page.height)
    if wide or over > 1e-6:
        word = max(formulas, key=lambda word: word.high - word.low)
        said = f"{row.width * scale:.0f} mm wide, and there are {layout.room * scale:.0f} mm for it"
        if not wide:
            said = f"{(high - low + 2 * _SLACK) * scale:.0f} mm high, and reaches {over:.1f} mm over the margin"
        raise DoesNotFit(
            f"The formula {' '.join(word.sources) or ''.join(word.spelt)} is {said}: use a smaller --x-height, a "
            "larger page, or write it in parts."
        )


def _even_baselines(layout: Layout, pitch: float, count: int) -> list[tuple[float, float]]:
    """(height, slope) of the even baselines of a page: mm at the middle between its margins, and tangent, down."""
    if layout.ruling is None:
        return [(layout.margin[0] + ASCENT * layout.x_height + number * pitch, 0.0) for number in range(count)]
    off = layout.margin[3] + 0.5 * layout.width - 0.5 * layout.page.width
    return [(height - FOOT_ABOVE_RULE + slope * off, slope) for height, slope in layout.rules[:count]]


def _inside(lines: Sequence[Line], layout: Layout, slack: float) -> tuple[list[Line], float]:
    """The lines with scanned ink between the upper and lower margin, and how far, mm, all of them went down for it.

    ASCENT and DESCENT are those of drawn letters; what an author writes may be taller.

    slack : mm that there are below the last line.
    """
    if not any(placed.ink for line in lines for placed in line.placed):
        return list(lines), 0.0
    upper, lower = layout.margin[0], layout.page.height - layout.margin[2]
    down = min(max(upper - _extent(lines[0])[0], 0.0), max(slack, 0.0))
    moved = []
    for line in lines:
        top, bottom = _extent(line)
        alone = max(upper - top - down, 0.0) or -min(max(bottom + down - lower, 0.0), max(top + down - upper, 0.0))
        moved.append(_shift_line(line, down + alone) if down + alone else line)
    return moved, down


def _extent(line: Line) -> tuple[float, float]:
    """Where the ink of a line begins and ends, mm from the top of the page."""
    graphs = [placed.ink.graph for placed in line.placed if placed.ink is not None]
    tops, bottoms = ([graph.xy[:, 1] + side * graph.radius for graph in graphs] for side in (-1, 1))
    return float(np.concatenate(tops).min()), float(np.concatenate(bottoms).max())


def _shift_line(line: Line, down: float) -> Line:
    """The line further down its page, mm."""
    by = np.array([0.0, down])
    placed = []
    for glyph in line.placed:
        ink = glyph.ink and replace(glyph.ink, graph=replace(glyph.ink.graph, xy=glyph.ink.graph.xy + by))
        placed.append(replace(glyph, strokes=tuple(stroke + by for stroke in glyph.strokes), ink=ink))
    return replace(line, placed=tuple(placed), baseline=line.baseline + down)


def _strike_words(
    placed: Iterable[Placed],
    row: UnitRow[G],
    starts: Sequence[float],
    layout: Layout,
    to_page: ToPage,
    strike_through: StrikeThrough,
) -> Iterator[Placed]:
    """The glyphs of a row, wrong words with strokes through them that stay inside the margins."""
    scale = layout.x_height
    margins = np.array([layout.margin[3], layout.page.width - layout.margin[1]])
    for number, letters in groupby(placed, key=lambda p: p.word):
        glyphs = list(letters)
        yield from glyphs
        unit = row.units[number]
        if unit.intended is None:
            continue
        ends = starts[number] + scale * np.array([unit.word.left, unit.word.right])
        low, high = min(margins[0], ends[0]), max(margins[1], ends[1])
        strokes = []
        for stroke in strike_through.strokes(unit.word.left, unit.word.right):
            points = stroke * scale + (starts[number], 0.0)
            points[:, 0] = np.clip(points[:, 0], low, high)
            strokes.append(to_page(points))
        # last of its word, after the dots
        mark = Glyph("", (), (True,) * len(strokes), 0.0)
        yield Placed(mark, tuple(strokes), joined=False, word=number, at=glyphs[-1].at)


def _starts(row: UnitRow[G], x: float, scale: float) -> list[float]:
    """Where the words of a row start, mm."""
    starts = []
    for unit, gap in zip(row.units, row.gaps, strict=True):
        x += gap * scale
        starts.append(x)
        x += unit.word.advance * scale
    return starts


def _find_left(row: UnitRow[G], layout: Layout, edge: float) -> float:
    """Where a row begins, x-heights from the left margin; its ink stays inside the margins."""
    spare = layout.room - row.indent - row.width
    if row.displayed:
        return max(0.0, 0.5 * spare)
    if layout.align == "right":
        return max(0.0, spare - abs(edge))
    if layout.align == "centre":
        return max(0.0, 0.5 * spare + edge)
    wander = edge if layout.align == "ragged" else 0.25 * edge
    return min(max(wander, -0.5), max(0.0, spare))


def on_page(baseline: float, curve: tuple[float, float, float, float]) -> ToPage:
    """Places of a line that leaves the level as `Line.rise` says, on its page."""
    slope, sag, middle, half_width = curve

    def to_page(points: Array) -> Array:
        u = points[:, 0] - middle
        lift = slope * u + sag * ((u / half_width) ** 2 - 0.33)
        return np.column_stack([points[:, 0], baseline - points[:, 1] - lift])

    return to_page


def _text(row: UnitRow[G]) -> str:
    """What is written in a row, struck words ~~so~~, as transcripts have them."""
    return "".join(
        (" " if i and unit.gap else "")
        + ("".join(unit.word.spelt) if unit.intended is None else f"~~{''.join(unit.word.spelt)}~~")
        for i, unit in enumerate(row.units)
    )
