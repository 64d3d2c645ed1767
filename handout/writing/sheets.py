"""Rows of words on sheets: edges, baselines, and the page coordinates of every stroke."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from itertools import chain, groupby, islice
from typing import Any, NamedTuple

import numpy as np

from handout.errors import DoesNotFit
from handout.values import Array, Glyph, Line, Manuscript, Placed
from handout.writing.baseline_model import FOOT_ABOVE_RULE, line_geometries, on_rules
from handout.writing.layout import ASCENT, DESCENT, Layout
from handout.writing.line_breaking import Row
from handout.writing.line_writer import LineWriter, ToPage, W
from handout.writing.slips import StrikeThrough


class Sheet(NamedTuple):
    """A page as it is made.

    rng : where its variation goes on, when it is given time or ink.
    last : whether the text ends on it.
    """

    manuscript: Manuscript
    rng: np.random.Generator
    last: bool


def paginate(
    rows: Iterable[Row[W]], writer: LineWriter[W], layout: Layout, rng: np.random.Generator
) -> Iterator[Sheet]:
    """Give every row its place, page after page, asking for no more rows than it takes.

    The last page varies by `rng` itself, those before it each by a stream of its own, so that none waits for the words
    of those behind it.

    Raises
    ------
    DoesNotFit
        Not even one line fits between the margins.
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
    strike_through = StrikeThrough(rng.spawn(1)[0])
    coming, number = iter(rows), 0
    page = list(islice(coming, held))
    while page:
        number += 1
        following = list(islice(coming, 1))  # all words are written when there is nothing behind a page
        page_rng = rng.spawn(1)[0] if following else rng
        yield Sheet(_sheet(page, writer, layout, page_rng, strike_through, number), page_rng, not following)
        page = list(islice(chain(following, coming), held))


def _sheet(
    rows: Sequence[Row[W]],
    writer: LineWriter[W],
    layout: Layout,
    rng: np.random.Generator,
    strike_through: StrikeThrough,
    page: int,
) -> Manuscript:
    """Place the rows of one page."""
    scale, pitch = layout.x_height, layout.baseline_distance(writer.pitch)
    lines, words, slips = list[Line](), 0, list[dict[str, Any]]()
    half_width = 0.5 * layout.width
    even = _even(layout, pitch, len(rows))
    model = writer.baseline_model if layout.ruling is None else on_rules(writer.baseline_model)
    wandering = line_geometries(model, len(rows), layout.jitter, 0.5 * layout.room, rng)
    for number, (row, geometry, (height, slope)) in enumerate(zip(rows, wandering, even, strict=True)):
        if not row.units:
            continue
        baseline = height - geometry.above * scale
        if layout.ruling is None:
            baseline = layout.margin[0] + (ASCENT - geometry.above) * scale + number * pitch
        x = layout.margin[3] + scale * (_left(row, layout, geometry.edge) + row.indent)
        rise = (geometry.slope - slope, geometry.sag * scale, layout.margin[3] + half_width, half_width)
        starts, to_page = _starts(row, x, scale), _to_page(baseline, rise)
        placed = writer.place([unit.word for unit in row.units], starts, scale, to_page)
        if any(unit.intended is not None for unit in row.units):
            placed = _struck(placed, row, starts, layout, to_page, strike_through)
        lines.append(Line(_text(row), tuple(replace(p, word=words + p.word) for p in placed), baseline, rise))
        slips += [{"page": page, "line": len(lines), **slip} for slip in _slips(row)]
        words += len(row.units)
    lower = 0.0
    if layout.ruling is None:  # what is written on rules stays there
        lines, lower = _inside(lines, layout, layout.height - (ASCENT + DESCENT) * scale - (len(rows) - 1) * pitch)
    ruling = {"baseline": round(even[0][0] + lower, 3), "line_spacing": round(pitch, 3)}
    about = {"hand": writer.name, "x_height": round(scale, 3), **ruling, **({"slips": slips} if slips else {})}
    return Manuscript(tuple(lines), layout.page, scale, about)


def _even(layout: Layout, pitch: float, count: int) -> list[tuple[float, float]]:
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
        moved.append(_shifted(line, down + alone) if down + alone else line)
    return moved, down


def _extent(line: Line) -> tuple[float, float]:
    """Where the ink of a line begins and ends, mm from the top of the page."""
    graphs = [placed.ink.graph for placed in line.placed if placed.ink is not None]
    tops, bottoms = ([graph.xy[:, 1] + side * graph.radius for graph in graphs] for side in (-1, 1))
    return float(np.concatenate(tops).min()), float(np.concatenate(bottoms).max())


def _shifted(line: Line, down: float) -> Line:
    """The line further down its page, mm."""
    by = np.array([0.0, down])
    placed = []
    for glyph in line.placed:
        ink = glyph.ink and replace(glyph.ink, graph=replace(glyph.ink.graph, xy=glyph.ink.graph.xy + by))
        placed.append(replace(glyph, strokes=tuple(stroke + by for stroke in glyph.strokes), ink=ink))
    return replace(line, placed=tuple(placed), baseline=line.baseline + down)


def _struck(
    placed: Iterable[Placed],
    row: Row[W],
    starts: Sequence[float],
    layout: Layout,
    to_page: ToPage,
    strike_through: StrikeThrough,
) -> Iterator[Placed]:
    """The glyphs of a row, each word that is wrong with the strokes through it, which stay inside the margins."""
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


def _slips(row: Row[W]) -> list[dict[str, str]]:
    """What was written in a row, and what was meant."""
    return [{"written": "".join(unit.word.spelt), "meant": unit.intended} for unit in row.units if unit.intended]


def _starts(row: Row[W], x: float, scale: float) -> list[float]:
    """Where the words of a row start, mm."""
    starts = []
    for unit, gap in zip(row.units, row.gaps, strict=True):
        x += gap * scale
        starts.append(x)
        x += unit.word.advance * scale
    return starts


def _left(row: Row[W], layout: Layout, edge: float) -> float:
    """Where a row begins, x-heights from the left margin; its ink stays inside the margins."""
    spare = layout.room - row.indent - row.width
    if layout.align == "right":
        return max(0.0, spare - abs(edge))
    if layout.align == "centre":
        return max(0.0, 0.5 * spare + edge)
    wander = edge if layout.align == "ragged" else 0.25 * edge
    return min(max(wander, -0.5), max(0.0, spare))


def _to_page(baseline: float, curve: tuple[float, float, float, float]) -> ToPage:
    slope, sag, middle, half_width = curve

    def to_page(points: Array) -> Array:
        u = points[:, 0] - middle
        lift = slope * u + sag * ((u / half_width) ** 2 - 0.33)
        return np.column_stack([points[:, 0], baseline - points[:, 1] - lift])

    return to_page


def _text(row: Row[W]) -> str:
    """What is written in a row, struck words ~~so~~, as transcripts have them."""
    return "".join(
        (" " if i and unit.gap else "")
        + ("".join(unit.word.spelt) if unit.intended is None else f"~~{''.join(unit.word.spelt)}~~")
        for i, unit in enumerate(row.units)
    )
