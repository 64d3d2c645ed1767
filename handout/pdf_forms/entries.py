"""An answer in its field, as a person fills it in: how large, on which line, a letter a cell, a cross in a box.

Every field has a frame of its own, mm, in which its text runs to the right: the field's upper left corner lies at
(`AROUND`, `AROUND`), with blank paper around it for what reaches out of the field.  People write on the lines printed
in and under a field.

Source: own method.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import groupby
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from handout.errors import InputError
from handout.hand.protocol import AnyHand
from handout.pdf_forms.fields import Box, Field, Widget
from handout.values import Array, Glyph, Line, Manuscript, Page, Placed
from handout.writing.layout import FOOT_ABOVE_RULE, Align, Layout, Ruling

Mark = Literal["cross", "tick"]
Rules = Callable[[int, Box], Sequence[float]]  # of a page and a box on it: see `rules`
AROUND = 60.0  # mm


@dataclass(frozen=True)
class EntrySettings:
    """How people fill in forms; set by eye, beside forms that were filled in."""

    of_height: float = 0.3  # x-height as a share of a field's height, where a line of text fills it
    of_room: float = 0.4  # as a share of the room over a printed rule
    least_mm: float = 0.95  # x-height below which writing of a usual pen cannot be read
    of_cell: float = 0.48  # x-height as a share of a cell's width
    narrowest_cell: float = 1.5  # mm: narrower ones are no cells to write in
    cell_filled: float = 0.86  # of a cell's width, which the widest letter takes at most
    varies: float = 0.03  # standard deviation of the size from field to field, share
    below_middle: float = 0.7  # x-heights from a box's middle down to the feet of its text
    in_cell: float = 0.85  # the same of a cell, where capitals and digits stand
    wanders: float = 0.12  # mm, of a line that has no rule, and of a letter in its cell; standard deviation
    edge: tuple[float, float] = (0.6, 2.0)  # mm from a field's edge to its text, least and most
    of_width: float = 0.08  # of its width that this takes at most
    pitch: float = 3.1  # x-heights between lines where none are printed: closer than in a letter
    least_pitch: float = 4.0  # mm: printed rules that are closer are no rules to write on
    foot: float = 0.6  # of a field's height: a rule below is what its text stands on
    head: float = 0.3  # a rule above it is the upper edge of a box,
    over: float = 0.8  # mm: unless it lies that far over the field, as the rule of the line above does
    narrowest: float = 8.0  # mm: narrower frames are enlarged to this while their text is set


SETTINGS = EntrySettings()


@dataclass(frozen=True)
class FieldFrame:
    """A field's own frame; scale : how many times as large as on the page all is in it."""

    box: Box
    turn: int
    scale: float = 1.0

    @property
    def size(self) -> tuple[float, float]:
        """Width and height of the field in its frame, mm."""
        left, top, right, bottom = self.box
        across, down = (right - left) * self.scale, (bottom - top) * self.scale
        return (down, across) if self.turn % 2 else (across, down)

    def to_page(self, points: Array) -> Array:
        """Places (n, 2) of the frame on the page, mm."""
        x, y = (points - AROUND).T / self.scale
        left, top, right, bottom = self.box
        places = ((left + x, top + y), (left + y, bottom - x), (right - x, bottom - y), (right - y, top + x))
        return np.column_stack(places[self.turn])

    def place_glyph(self, glyph: Placed) -> Placed:
        """Place a glyph of the frame on the page."""
        return _map_glyph(glyph, self.to_page, 1 / self.scale)


@dataclass(frozen=True)
class FieldEntry:
    """What is written in one place of a field.

    text, layout : "" and None for a mark in a box.
    cells : of a field with a letter a cell, the number of the cell of every letter, and how many cells there are.
    free : its line stands on no rule, and is moved up or down where its ink would leave the field.
    """

    field: str
    page: int
    frame: FieldFrame
    text: str = ""
    layout: Layout | None = None
    cells: tuple[tuple[int, ...], int] | None = None
    free: bool = False


@dataclass(frozen=True)
class Filler:
    """What all entries of a form have in common.

    hand, x_height : whose writing, and its usual size, mm.
    rules : the lines printed at a field.
    jitter : scale of all variation.
    """

    hand: AnyHand
    x_height: float
    rules: Rules
    jitter: float = 1.0

    def entries(
        self, fields: Mapping[str, Field], values: Mapping[str, str], rng: np.random.Generator
    ) -> list[FieldEntry]:
        """All that is written into a form, from top to bottom."""
        entries = [
            self._entry(fields[name], widget, value, rng)
            for name, value in values.items()
            for widget in fields[name].widgets
            # all places of a field, or the buttons that stand for the answer
            if fields[name].kind not in ("check", "radio") or value in ("x", widget.state)
        ]
        # fields beside each other are filled in from left to right
        return sorted(entries, key=lambda e: (e.page, round((e.frame.box[1] + e.frame.box[3]) / 8), e.frame.box[0]))

    def _entry(self, field: Field, widget: Widget, value: str, rng: np.random.Generator) -> FieldEntry:
        frame = FieldFrame(widget.box, widget.turn)
        if field.kind in ("check", "radio"):
            return FieldEntry(field.name, widget.page, frame)
        usual = self.x_height * float(np.exp(SETTINGS.varies * self.jitter * rng.standard_normal()))
        printed = self.rules(widget.page, widget.box) if widget.turn == 0 else ()
        if field.cells and frame.size[0] >= SETTINGS.narrowest_cell * field.cells:
            return self._comb_entry(FieldEntry(field.name, widget.page, frame, value), field.cells, usual, rng)
        frame = replace(frame, scale=max(1.0, SETTINGS.narrowest / frame.size[0]))
        entry = FieldEntry(field.name, widget.page, frame, value)
        # of the lines printed at the field those to write on, where they are far enough apart
        half = 0.5 * SETTINGS.least_pitch
        inner = [at for at in printed if at > half and at <= frame.size[1] / frame.scale + half]
        if field.multiline and len(inner) > 1 and all(np.diff(inner) >= SETTINGS.least_pitch):
            size = _bound_size(SETTINGS.of_room * float(np.median(np.diff(inner))), usual)
            return replace(entry, layout=self._layout(entry.frame, size, inner, field.align, 0.0))
        if field.multiline and frame.size[1] >= 2 * SETTINGS.pitch * SETTINGS.least_mm * frame.scale:
            return self._filling(entry, usual, field.align)
        return self._one_line(entry, printed, usual, field.align, rng)

    def _one_line(
        self, entry: FieldEntry, printed: Sequence[float], usual: float, align: Align, rng: np.random.Generator
    ) -> FieldEntry:
        """On the rule under the field, or in the middle of its box."""
        scale = entry.frame.scale
        height = entry.frame.size[1] / scale
        under = [at for at in printed if at > SETTINGS.foot * height]
        ruled = bool(under) and not any(-SETTINGS.over < at < SETTINGS.head * height for at in printed)
        if ruled:
            rule, size = under[0], _bound_size(SETTINGS.of_room * under[0], usual)
        else:
            size = _bound_size(SETTINGS.of_height * height, usual)
            wanders = min(SETTINGS.wanders, 0.03 * height) * self.jitter * float(rng.standard_normal())
            rule = height / 2 + SETTINGS.below_middle * size + FOOT_ABOVE_RULE + wanders
        spare = float(rng.uniform(0, 0.5 * self.jitter))
        return replace(entry, layout=self._layout(entry.frame, size, [rule], align, spare), free=not ruled)

    def _layout(self, frame: FieldFrame, size: float, rules: Sequence[float], align: Align, spare: float) -> Layout:
        """A text on lines at heights in the field, mm of the page."""
        width, height = frame.size
        edge = self._edge(frame)
        side = AROUND + edge
        heights = tuple((AROUND + at * frame.scale, 0.0) for at in rules)
        return Layout(
            Page(width + 2 * AROUND, height + 2 * AROUND),
            (0.0, side, 0.0, side + min(spare, edge) * (align == "left")),
            size * frame.scale,
            align=align,
            fit=True,
            jitter=self.jitter,
            ruling=Ruling(heights),
        )

    def _edge(self, frame: FieldFrame) -> float:
        """From the edge of a field to its text, mm of its frame."""
        width = frame.size[0]
        edge = min(SETTINGS.edge[1], max(SETTINGS.edge[0], SETTINGS.of_width * width / frame.scale))
        return min(edge * frame.scale, 0.1 * width)

    def _filling(self, entry: FieldEntry, usual: float, align: Align) -> FieldEntry:
        """Line under line in a field without rules."""
        width, height = entry.frame.size
        size = _bound_size(SETTINGS.of_height * height / entry.frame.scale, usual) * entry.frame.scale
        side = AROUND + self._edge(entry.frame)
        layout = Layout(
            Page(width + 2 * AROUND, height + 2 * AROUND),
            (AROUND + 0.2 * size, side, AROUND, side),
            size,
            min(SETTINGS.pitch, self.hand.pitch) * size,
            align=align,
            fit=True,
            jitter=self.jitter,
        )
        return replace(entry, layout=layout)

    def _comb_entry(self, entry: FieldEntry, cells: int, usual: float, rng: np.random.Generator) -> FieldEntry:
        """Set one letter in each cell: with spaces between them first, then each is moved to its cell."""
        width, height = entry.frame.size
        size = _bound_size(min(SETTINGS.of_height * height, SETTINGS.of_cell * width / cells), usual)
        filled = tuple(n for n, letter in enumerate(entry.text) if not letter.isspace())
        text = " ".join(entry.text[n] for n in filled)
        wanders = 0.5 * SETTINGS.wanders * self.jitter * float(rng.standard_normal())
        baseline = AROUND + height / 2 + SETTINGS.in_cell * size + FOOT_ABOVE_RULE + wanders
        layout = Layout(
            Page(2 * AROUND + 20 * size * len(text), height + 2 * AROUND),
            (0.0, 0.0, 0.0, AROUND),
            size,
            align="left",
            jitter=self.jitter,
            ruling=Ruling(((baseline, 0.0),)),
        )
        return replace(entry, text=text, layout=layout, cells=(filled, cells), free=True)


def _bound_size(size: float, usual: float) -> float:
    return max(SETTINGS.least_mm, min(size, usual))


def page_manuscript(
    page: Page,
    entries: Iterable[tuple[FieldEntry, Manuscript | None]],
    hand: AnyHand,
    mark: Mark,
    jitter: float,
    rng: np.random.Generator,
) -> Manuscript:
    """The writing on one page of a form.

    entries : what was set of each; None for a mark.
    """
    lines: list[Line] = []
    words, doubts, sizes = 0, [], []
    about: dict[str, object] = {"hand": hand.name}
    for entry, setting in entries:
        if setting is None:
            made = [_draw_mark(entry.frame, mark, jitter, rng)]
        else:
            sizes.append(setting.x_height / entry.frame.scale)
            made = [*setting.lines] if entry.cells is None else [_in_cells(entry, setting, jitter, rng)]
            if entry.free:
                least = min(1.0, SETTINGS.least_mm * entry.frame.scale / setting.x_height)
                made = [_inside(line, entry.frame.size[1], least) for line in made]
            told = setting.about.get("doubtful", ())
            doubts += [{**doubt, "field": entry.field, "page": entry.page + 1} for doubt in told]
            about |= {name: setting.about[name] for name in ("borrowed",) if name in setting.about}
        for line in made:
            placed = map(entry.frame.place_glyph, line.placed)
            lines.append(replace(line, placed=tuple(replace(p, word=words + p.word) for p in placed)))
            words = max((p.word + 1 for p in lines[-1].placed), default=words)
    size = float(np.median(sizes)) if sizes else hand.x_height
    return Manuscript(tuple(lines), page, size, {**about, "x_height": round(size, 3), "doubtful": doubts})


def _in_cells(entry: FieldEntry, setting: Manuscript, jitter: float, rng: np.random.Generator) -> Line:
    """The letters of a line, each in the middle of its cell; all smaller where one is wider than that.

    Raises InputError: a character is left out, since the hand lacks it: which cell stays empty is not known then.
    """
    assert entry.cells is not None
    filled, count = entry.cells
    cell = entry.frame.size[0] / count
    (line,) = setting.lines
    letters = [list(group) for _, group in groupby(line.placed, key=lambda p: p.word)]
    if len(letters) != len(filled):
        raise InputError(f"{entry.field}: the hand lacks a letter of {entry.text!r}, and each has a cell of its own.")
    extents = [_extent(letter, 0) for letter in letters]
    widest = max(right - left for left, right in extents)
    scale = min(1.0, SETTINGS.cell_filled * cell / max(widest, 1e-6))
    placed = []
    for number, letter, (left, right) in zip(filled, letters, extents, strict=True):
        middle = AROUND + (number + 0.5) * cell + min(SETTINGS.wanders, 0.04 * cell) * jitter * rng.standard_normal()
        about, to = np.array([(left + right) / 2, line.baseline]), np.array([middle, line.baseline])
        placed += [_map_glyph(glyph, partial(_move_points, about=about, to=to, scale=scale), scale) for glyph in letter]
    return replace(line, placed=tuple(placed))


def _inside(line: Line, height: float, least: float) -> Line:
    """A line moved up or down until its ink is in its field, so many mm high.

    least : how many times as large the line may be at least, where its ink is higher than the field; what is higher
        even so goes over both edges.
    """
    upper, lower = _extent(line.placed, 1)
    scale = min(1.0, max(least, height / max(lower - upper, 1e-6)))
    middle, half = (upper + lower) / 2, scale * (lower - upper) / 2
    room = height / 2 - half
    to = AROUND + height / 2 + (0.0 if room < 0 else float(np.clip(middle - AROUND - height / 2, -room, room)))
    across = sum(_extent(line.placed, 0)) / 2
    move = partial(_move_points, about=np.array([across, middle]), to=np.array([across, to]), scale=scale)
    placed = tuple(_map_glyph(glyph, move, scale) for glyph in line.placed)
    return replace(line, placed=placed, baseline=(line.baseline - middle) * scale + to)


def _extent(glyphs: Sequence[Placed], axis: int) -> tuple[float, float]:
    """Where the ink of some glyphs begins and ends, mm from the left (axis 0) or from above (1)."""
    places = [stroke[:, axis] for glyph in glyphs for stroke in glyph.strokes]
    places += [glyph.ink.graph.xy[:, axis] for glyph in glyphs if glyph.ink is not None]
    every = np.concatenate(places) if places else np.full(1, AROUND)
    return float(every.min()), float(every.max())


def _move_points(points: Array, about: Array, to: Array, scale: float) -> Array:
    """Places (n, 2) scaled about a point, which comes to lie on another."""
    return np.asarray((points - about) * scale + to)


def _map_glyph(glyph: Placed, move: Callable[[Array], Array], scale: float) -> Placed:
    """Move the places of a glyph, and make its line so many times as wide."""
    ink = glyph.ink
    if ink is not None:
        ink = replace(ink, graph=replace(ink.graph, xy=move(ink.graph.xy), radius=ink.graph.radius * scale))
    return replace(glyph, strokes=tuple(map(move, glyph.strokes)), ink=ink)


# ways of a pen through a box of side 1, from its upper left corner: a cross, which leaves the corners a little free,
# and a tick, which leaves the box
_WAYS: Mapping[Mark, tuple[tuple[tuple[float, float], ...], ...]] = {
    "cross": (((0.12, 0.1), (0.5, 0.48), (0.9, 0.92)), ((0.9, 0.08), (0.52, 0.5), (0.1, 0.94))),
    "tick": (((0.06, 0.46), (0.24, 0.72), (0.38, 0.98), (0.7, 0.4), (1.2, -0.26)),),
}
_SWAY = 0.05  # of a box, standard deviation of every point; set by eye
_LARGEST_MARK = 5.0  # mm: in a larger box people make no larger cross


def _draw_mark(frame: FieldFrame, mark: Mark, jitter: float, rng: np.random.Generator) -> Line:
    """Draw a cross or a tick in the middle of its box."""
    width, height = frame.size
    side = min(width, height, _LARGEST_MARK) * (1 + 0.06 * jitter * float(rng.standard_normal()))
    corner = np.array([AROUND + (width - side) / 2, AROUND + (height - side) / 2])
    ways = [np.array(way) for way in _WAYS[mark]]
    strokes = tuple(corner + side * (way + _SWAY * jitter * rng.standard_normal(way.shape)) for way in ways)
    glyph = Glyph("", (), (True,) * len(strokes), 0.0)
    return Line("", (Placed(glyph, strokes, joined=False, word=0, at=-1),), float(corner[1] + side))


DPI = 150.0  # at which a page is drawn to look for lines


@dataclass(frozen=True)
class RuleSearch:
    """What counts as a line of a field; set by eye on forms with boxes, rules and dotted rules."""

    beyond: float = 1.5  # mm above and below a field within which its lines may lie
    dark: float = 0.12  # share of light that a line takes at least
    dots: float = 1.6  # mm between the dots of a rule that are one line
    share: float = 0.85  # of a field's width that a line covers
    thick: float = 0.9  # mm: what is thicker is an edge of a shaded field, or a bar


_SEARCH = RuleSearch()


def rules(page: NDArray[np.uint8], box: Box) -> tuple[float, ...]:
    """Heights of level lines as wide as a field, mm from the field's top, downwards.

    page : (h, w, 3) uint8, drawn at `DPI`.
    box : of the field, mm, as it is shown.
    """
    scale = DPI / 25.4
    left, top, right, bottom = box
    beyond = _SEARCH.beyond
    first = max(0, round((top - beyond) * scale))
    part = page[
        first : max(first, round((bottom + beyond) * scale)), max(0, round(left * scale)) : round(right * scale)
    ]
    if part.shape[0] < 3 or part.shape[1] < 3:
        return ()
    light = part.mean(axis=2)
    paper = float(np.percentile(light, 80))  # most of a field is empty
    dark = light < (1 - _SEARCH.dark) * paper
    # rows with the gaps between dots closed: what has ink within `reach` pixels on both sides
    reach = max(1, round(_SEARCH.dots * scale))
    before = np.zeros((len(dark), dark.shape[1] + 1), dtype=np.int64)
    np.cumsum(dark, axis=1, out=before[:, 1:])
    at = np.arange(dark.shape[1])
    on_left = before[:, at + 1] - before[:, np.maximum(at + 1 - reach, 0)] > 0
    on_right = before[:, np.minimum(at + reach, dark.shape[1])] - before[:, at] > 0
    found = ((on_left & on_right) | dark).mean(axis=1) > _SEARCH.share
    edges = np.flatnonzero(np.diff(np.concatenate([[False], found, [False]]).astype(np.int8)))
    bands = [(a, b) for a, b in edges.reshape(-1, 2).tolist() if b - a <= _SEARCH.thick * scale]
    return tuple((first + (a + b) / 2) / scale - top for a, b in bands)
