"""The words of a letter given their places: rows as wide as there is room, lists, tables, boxes, room for pictures.

Places are in mm; whatever is too wide or too high is found here, before anything is drawn.

Source: own method; distances between blocks are set by eye.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from handout.errors import DoesNotFit
from handout.letters.document import (
    Block,
    Boxed,
    DrawnRule,
    List,
    Paragraph,
    PictureRoom,
    Quote,
    Side,
    Signature,
    TableBlock,
)
from handout.letters.rows import (
    FlowPage,
    LetterSetting,
    Mark,
    Pasted,
    RowFrame,
    Segment,
    SetRow,
    Voice,
    gaps_of,
    voice_of,
)
from handout.letters.runs import LetterWord
from handout.writing.layout import ASCENT, DESCENT, FOOT_ABOVE_RULE, Layout
from handout.writing.pages import APART, SQUEEZE, extent, squeeze_gaps

_NARROWEST = 9.0  # x-heights: nobody writes in less room beside a picture
_LEAST_ROOM = 2.5  # x-heights: room for a letter or two
_PARAGRAPH, _PARAGRAPH_SD = 0.55, 0.06  # of the distance of lines, beside it
_INDENT = 2.6  # x-heights, of a first line
_ITEM, _ITEM_SD = 2.1, 0.1  # x-heights that the text of an item stands further in
_LABEL_GAP = 0.9  # x-heights from an item's number to its text
_QUOTE = 3.2  # x-heights that a quotation stands further in, left and half of it right
_COLUMN_GAP = 2.2  # x-heights between what two columns of a table hold
_BESIDE = 2.0  # x-heights between a picture or a box and the words beside it
_FOOT = 0.55  # share of the lower margin that is below a page number
# gaps above and below blocks, in distances of lines
_ABOVE = {"heading": 0.8, "table": 0.45, "signature": 0.35, "postscript": 1.0, "rule": 0.1, "list": 0.3}
_BELOW = {"heading": 0.25, "date": 1.0, "table": 0.5, "rule": 0.1, "list": 0.3}


class _At(NamedTuple):
    """Where a row may go: its baseline, mm, and the tangent of the rule there; left end and width of its room, mm."""

    baseline: float
    slope: float
    x: float
    width: float


@dataclass(eq=False)
class _Label:
    """What stands before the first row of an item."""

    words: Sequence[LetterWord]
    bullet: str
    voice: Voice
    room: float


def flow_letter(
    setting: LetterSetting, lines: Mapping[int, Sequence[Sequence[LetterWord]]], rng: np.random.Generator
) -> list[FlowPage]:
    """The pages of a letter, with all in its place."""
    flow = _Flow(setting, lines, rng)
    flow.blocks(setting.letter.blocks)
    flow.number_pages()
    return flow.pages


class _Flow:
    """Gives the blocks of a letter their places, one below the other.

    last, pitch : baseline of the row above, mm, None at the top; distance of lines there.
    gap : mm that the next row stands lower than usual.
    """

    def __init__(
        self, setting: LetterSetting, lines: Mapping[int, Sequence[Sequence[LetterWord]]], rng: np.random.Generator
    ) -> None:
        self._setting, self._letter, self._lines, self._rng = setting, setting.letter, lines, rng
        self._writers = setting.writers
        self._number = {id(paragraph): n for n, paragraph in enumerate(setting.runs.paragraphs)}
        self._xh = setting.first.x_height
        self._jitter = min(setting.first.jitter, 2.0)
        self._usual = self._layout(0).baseline_distance(self._writers[""].handwriting.pitch)
        self.pages = [FlowPage()]
        self._frame, self._page, self._boxed = self._frame_of(0), self.pages[0], ""
        self._last: float | None = None
        self._pitch, self._gap, self._skipped = self._usual, 0.0, 0.0
        self._low, self._formula = DESCENT, False  # how deep the row above is, x-heights, and whether by a formula
        self._tight, self._after_text, self._after_heading = False, False, False
        self._label: _Label | None = None
        self._right = False  # whether the row that is placed stands to the right
        self._side: Side | None = None  # of paragraphs that say nothing of it
        self._line = 1
        for name in dict.fromkeys(block.name for block in self._letter.blocks if isinstance(block, Boxed)):
            place = self._letter.boxes[name]
            self._page.boxes.append((place.x, place.y, place.x + place.w, place.y + place.h))

    def blocks(self, blocks: Sequence[Block], left: float = 0.0, right: float = 0.0) -> None:
        """Place some blocks, so many mm further in than the margins."""
        for block in blocks:
            self._line = block.line
            if block.new_page and self._last is not None:
                self._turn()
            match block:
                case Paragraph():
                    self._paragraph(block, left, right)
                case List():
                    self._list(block, left, right)
                case TableBlock():
                    self._table(block, left, right)
                case DrawnRule():
                    self._rule(block, left, right)
                case PictureRoom():
                    self._picture(block, left, right)
                case Quote():
                    self._space(_PARAGRAPH)
                    self.blocks(block.blocks, left + _QUOTE * self._xh, right + 0.5 * _QUOTE * self._xh)
                    self._space(_PARAGRAPH)
                case Boxed():
                    self._box(block)
                case Signature():
                    self._signature(block, left, right)
            self._after_text = isinstance(block, Paragraph) and not block.level
            self._after_heading = isinstance(block, Paragraph) and block.level > 0

    def number_pages(self) -> None:
        """Write the numbers of all pages but the first, where the head asks for them."""
        where = self._letter.head.page_numbers
        if where == "none":
            return
        own = {id(paragraph) for paragraph in self._letter.paragraphs}
        numbered = [n for n, paragraph in enumerate(self._setting.runs.paragraphs) if id(paragraph) not in own]
        for page, number in zip(range(1, len(self.pages)), numbered, strict=False):
            layout, words = self._layout(page), tuple(self._lines[number][0])
            foot = where == "foot"
            margin = layout.margin[2 if foot else 0]
            y = layout.page.height - _FOOT * margin if foot else max(_FOOT * margin, ASCENT * self._xh)
            frame = self._frame_of(page)
            room = Segment(frame.left, frame.width, words, gaps_of(words), "centre" if foot else "right")
            self.pages[page].rows.append(SetRow(y, 0.0, frame, (room,)))

    def _layout(self, page: int) -> Layout:
        return self._setting.first if page == 0 else self._setting.following

    def _frame_of(self, page: int) -> RowFrame:
        layout = self._layout(page)
        top, right, bottom, left = layout.margin
        return RowFrame(left, top, layout.page.width - right, layout.page.height - bottom)

    # Where a row goes

    def _find_place(self, words: Sequence[LetterWord], left: float, right: float, least: float = 0.0) -> _At:
        """Where a row of some words may go next, on this page or the next; `least` : mm that it is wide."""
        scale = max((word.scale for word in words), default=1.0)
        high, low = _heights(words)
        formula = max(high - ASCENT * scale, low - DESCENT * scale) > 0
        pitch, whole = self._pitch_of(words), self._frame.width - left - right
        if whole < _LEAST_ROOM * self._xh:
            raise self._letter.wrong(
                self._line, f"it stands so far in that {max(whole, 0.0):.0f} mm are left for it.", DoesNotFit
            )
        while True:
            baseline, slope = self._next_baseline(high, pitch, formula)
            if baseline + low * self._xh > self._frame.bottom + 1e-6:
                self._turn()
                continue
            x, width = self._room(baseline, scale, left, right)
            if width < min(max(_NARROWEST * self._xh, least), 0.9 * whole if least < 0.9 * whole else whole - 1e-6):
                self._skipped += 0.25 * self._usual
                continue
            return _At(baseline, slope, x, width)

    def _next_baseline(self, high: float, pitch: float, formula: bool) -> tuple[float, float]:
        """The baseline of the next row, mm, and its slope; on a rule where there are some.

        high : above it, x-heights; formula : whether it holds one that is higher or deeper than letters.
        """
        layout = self._layout(self.pages.index(self._page))
        if self._last is None:
            baseline = self._frame.top + high * self._xh + self._skipped
        else:
            baseline = self._last + self._gap + 0.4 * self._pitch + 0.6 * pitch + self._skipped
            if formula or self._formula:
                baseline = max(baseline, self._last + self._gap + (self._low + high + APART) * self._xh + self._skipped)
        if layout.ruling is None:
            return baseline, 0.0
        off = 0.5 * (self._frame.left + self._frame.right - layout.page.width)
        nearest = (
            -math.inf
            if self._last is None
            else baseline - (0.1 if formula or self._formula else 0.5) * layout.ruling.pitch
        )
        # a box is not measured by the rules: what stands in it may look out of it a little
        upper = (
            self._frame.top + ASCENT * self._xh + self._skipped - (0.2 * layout.ruling.pitch if self._boxed else 1e-6)
        )
        for height, slope in layout.ruling.rules:
            on_rule = height - FOOT_ABOVE_RULE + slope * off
            if on_rule > max(nearest, upper):
                return on_rule, slope
        return math.inf, 0.0

    def _pitch_of(self, words: Sequence[LetterWord]) -> float:
        layout = self._setting.first
        if layout.ruling is not None or layout.line_spacing is not None:
            return self._usual * max((word.manner.size for word in words), default=1.0)
        own = (self._writers[word.manner.hand].handwriting.pitch * word.scale * self._xh for word in words)
        return max(own, default=self._usual)

    def _room(self, baseline: float, scale: float, left: float, right: float) -> tuple[float, float]:
        """The widest room for a row between what is on the page, and further in: its left end and its width, mm."""
        free = [(self._frame.left, self._frame.right)]
        top, bottom = baseline - 1.6 * self._xh * scale, baseline + 0.5 * self._xh * scale
        boxes = [] if self._boxed else self._page.boxes
        # beside an address stands the date, and what else is put to the right
        if not self._right and any(upper < bottom and lower > top for _, upper, _, lower in boxes):
            return 0.0, 0.0
        beside = _BESIDE * self._xh
        set_apart = [(a - beside, upper, b + beside, lower) for a, upper, b, lower in boxes]
        for a, upper, b, lower in [] if self._boxed else [*set_apart, *self._page.taken]:
            if upper < bottom and lower > top:
                free = [part for p, q in free for part in ((p, min(q, a)), (max(p, b), q)) if part[1] > part[0]]
        x, end = max(free, key=lambda part: part[1] - part[0], default=(0.0, 0.0))
        return x + left, end - right - x - left

    def _turn(self) -> None:
        """Go on at the top of the next page."""
        if self._boxed:
            place = self._letter.boxes[self._boxed]
            raise self._letter.wrong(
                self._line,
                f"the box {self._boxed}, {place.w:g} x {place.h:g} mm, is too small for its text: make it larger, or "
                "its letters smaller ({size=0.8} in a line before it).",
                DoesNotFit,
            )
        if self._last is None and not self._skipped:
            raise self._letter.wrong(
                self._line,
                f"not even a line of it fits between the margins ({self._frame.bottom - self._frame.top:.0f} mm): use "
                "smaller letters, smaller margins or a larger page.",
                DoesNotFit,
            )
        number = len(self.pages)
        if number == self._setting.pages:
            raise self._letter.wrong(
                self._line,
                f"here {'the page is' if number == 1 else f'the {number} pages are'} full: use --fit, a smaller "
                "--x-height, or a larger page.",
                DoesNotFit,
            )
        self._page = FlowPage()
        self.pages.append(self._page)
        self._frame, self._last, self._gap, self._skipped = self._frame_of(number), None, 0.0, 0.0

    def _space(self, share: float) -> None:
        """Leave a gap of at least a share of the distance of lines before what comes next."""
        wander = 1 + _PARAGRAPH_SD / _PARAGRAPH * float(self._rng.normal(0.0, self._jitter))
        if self._last is not None:
            self._gap = max(self._gap, share * self._usual * max(wander, 0.3))

    def _keep(self, height: float) -> None:
        """Begin a new page where less than so many mm are left of this one."""
        below = self._frame.bottom - DESCENT * self._xh
        if self._last is not None and self._last + self._gap + height > below and not self._boxed:
            self._turn()

    def _add(
        self, at: _At, segments: Sequence[Segment], words: Sequence[LetterWord], marks: Sequence[Mark] = ()
    ) -> None:
        self._page.rows.append(SetRow(at.baseline, at.slope, self._frame, tuple(segments), tuple(marks)))
        self._last, self._pitch, self._gap, self._skipped = at.baseline, self._pitch_of(words), 0.0, 0.0
        self._low = _heights(words)[1]
        self._formula = self._low > DESCENT * max((word.scale for word in words), default=1.0)

    # Blocks

    def _paragraph(self, paragraph: Paragraph, left: float, right: float) -> None:
        lines = self._lines.get(self._number[id(paragraph)], [])
        begin_indented = self._letter.head.paragraphs == "indented" and self._after_text and not self._tight
        self._space_before(paragraph, begin_indented)
        if paragraph.level:
            self._keep((1 + max((word.scale for line in lines for word in line), default=1.0)) * self._usual)
        first = _INDENT * self._xh if begin_indented and not paragraph.side else 0.0
        for line in lines:
            rest = list(line)
            while rest:
                rest = rest[self._row(rest, left + first, right, paragraph.side or self._side) :]
                first = 0.0
        if paragraph.level or paragraph.kind == "date":
            self._space(_BELOW["date" if paragraph.kind == "date" else "heading"])

    def _space_before(self, paragraph: Paragraph, begin_indented: bool) -> None:
        if paragraph.level:
            self._space(_ABOVE["heading"])
        elif paragraph.kind == "postscript":
            self._space(_ABOVE["postscript"])
        elif not (self._tight or begin_indented or self._after_heading):
            self._space(_PARAGRAPH)

    def _row(self, words: Sequence[LetterWord], left: float, right: float, side: Side | None) -> int:
        """Place as many of some words as one row holds."""
        taken, self._right = words[:1], side == "right"
        first = next(_clusters(words))
        if words[0].written.displayed:
            side = "centre"
        while True:
            at = self._find_place(taken, left, right, self._width(first))
            count, gaps = self._fill_row(words, at.width)
            before = self._pitch_of(taken), max(word.scale for word in taken)
            taken = words[:count]
            if (self._pitch_of(taken), max(word.scale for word in taken)) <= before:
                break
        segments, marks = [Segment(at.x, at.width, tuple(taken), tuple(gaps), side)], list[Mark]()
        if self._label is not None:
            self._put_label(self._label, at, segments, marks)
            self._label = None
        self._add(at, segments, taken, marks)
        self._right = False
        return count

    def _fill_row(self, words: Sequence[LetterWord], width: float) -> tuple[int, list[float]]:
        """How many words a row of so many mm holds, and the gaps before them, usual x-heights."""
        best: tuple[int, list[float]] | None = None
        for end in range(1, len(words) + 1):
            if end < len(words) and not words[end].breakable:
                continue
            gaps = squeeze_gaps(words[:end], width / self._xh, SQUEEZE)
            if gaps is None:
                break
            best = end, gaps
        if best is None:
            whole = words[:end]
            text = "".join("".join(word.written.spelt) for word in whole)
            raise self._letter.wrong(
                whole[0].line,
                f"{text!r} is {extent(whole, gaps_of(whole)) * self._xh:.0f} mm wide, and there are {width:.0f} mm for "
                "it: use smaller letters, a hyphen, or more room.",
                DoesNotFit,
            )
        return best

    def _put_label(self, label: _Label, at: _At, segments: list[Segment], marks: list[Mark]) -> None:
        """Put the number or the bullet of an item before its first row."""
        begin = at.x - label.room
        if label.words:
            segments.insert(0, Segment(begin, label.room, tuple(label.words), gaps_of(label.words), "left"))
        else:
            place = begin + 0.32 * label.room + 0.08 * self._xh * float(self._rng.normal(0.0, self._jitter))
            marks.append(Mark(label.bullet, (place, 0.0), (place, 0.0), label.voice))

    def _list(self, block: List, left: float, right: float) -> None:
        if not self._tight:
            self._space(_ABOVE["list"] if block.tight else _PARAGRAPH)
        labels = [self._words(item.label) for item in block.items]
        size, voice = block.manner.size * self._xh, voice_of(block.manner)
        widest = max((extent(words, gaps_of(words)) for words in labels), default=0.0) * self._xh
        room = max(_ITEM * size, widest + _LABEL_GAP * size)
        outer = self._tight
        for item, words in zip(block.items, labels, strict=True):
            own = room + _ITEM_SD * size * float(self._rng.normal(0.0, self._jitter))
            self._line, self._label = item.line, _Label(words, block.marker, voice, own)
            self._tight = True
            if not item.blocks or not isinstance(item.blocks[0], Paragraph):
                at, segments, marks = self._find_place(words, left + own, right), list[Segment](), list[Mark]()
                self._put_label(self._label, at, segments, marks)
                self._label = None
                self._add(at, segments, words, marks)
            first, rest = item.blocks[:1], item.blocks[1:]
            self.blocks(first, left + own, right)
            self._tight = block.tight
            self.blocks(rest, left + own, right)
            if not block.tight:
                self._space(_PARAGRAPH)
        self._tight = outer
        if not outer:
            self._space(_BELOW["list"])

    def _words(self, paragraph: Paragraph) -> tuple[LetterWord, ...]:
        lines = self._lines.get(self._number[id(paragraph)], [])
        return tuple(lines[0]) if lines else ()

    def _rule(self, rule: DrawnRule, left: float, right: float) -> None:
        self._space(_ABOVE["rule"])
        self._keep(2 * self._usual)  # it parts two things, and stands with what follows
        at = self._find_place((), left, right)
        share = {"wide": 1.0, "short": 0.38, "flourish": 0.3}[rule.kind]
        length = at.width * share * math.exp(float(self._rng.normal(0.0, 0.06 * self._jitter)) if share < 1 else 0.0)
        begin = at.x + 0.5 * (at.width - length)
        self._add(at, (), (), [Mark(rule.kind, (begin, 0.0), (begin + length, 0.0), Voice("", rule.ink, 1.0))])
        self._space(_BELOW["rule"])

    def _box(self, block: Boxed) -> None:
        place = self._letter.boxes[block.name]
        page = self._setting.first.page
        if place.x + place.w > page.width or place.y + place.h > page.height or min(place.x, place.y) < 0:
            raise self._letter.wrong(
                block.line,
                f"the box {block.name} reaches beyond the page of {page.width:g} x {page.height:g} mm.",
            )
        kept = self._frame, self._page, self._last, self._pitch, self._gap, self._skipped, self._after_text
        self._frame = RowFrame(place.x, place.y, place.x + place.w, place.y + place.h)
        self._page, self._last, self._boxed, self._after_text = self.pages[0], None, block.name, False
        self._gap = self._skipped = 0.0
        self.blocks(block.blocks)
        self._boxed = ""
        self._frame, self._page, self._last, self._pitch, self._gap, self._skipped, self._after_text = kept

    def _picture(self, picture: PictureRoom, left: float, right: float) -> None:
        wide, high = self._setting.sizes[picture.path]
        frame, alone = self._frame, picture.side == "centre"
        room = frame.width - left - right
        width = picture.width or room * (0.6 if alone else 0.36)
        height, beside = width * high / wide, _BESIDE * self._xh
        if not 5 <= width <= room:
            raise self._letter.wrong(
                picture.line, f"a picture {width:.0f} mm wide is outside 5 mm to the {room:.0f} mm of its column."
            )
        if height > frame.bottom - frame.top:
            raise self._letter.wrong(picture.line, f"the picture is {height:.0f} mm high, more than the page holds.")
        self._space(_PARAGRAPH)
        top = frame.top if self._last is None else self._last + self._gap + 0.9 * self._xh
        if top + height > frame.bottom:
            self._turn()
            frame, top = self._frame, self._frame.top
        x = {"left": frame.left + left, "right": frame.right - right - width}.get(
            picture.side, frame.left + left + 0.5 * (room - width)
        )
        self._page.pictures.append(Pasted(picture.path, x, top, width, height))
        if alone:
            self._go_below(top + height)
        else:
            self._page.taken.append(
                (x - beside, top - 0.4 * self._xh, x + width + beside, top + height + 0.6 * self._xh)
            )

    def _go_below(self, y: float) -> None:
        """What comes next stands below y mm."""
        self._last, self._pitch, self._gap = y + 0.1 * self._usual, self._usual, 0.0

    def _signature(self, block: Signature, left: float, right: float) -> None:
        self._space(_ABOVE["signature"])
        if block.name:
            wide, high = (block.size * side for side in self._setting.sizes[block.name])
            room = self._frame.width - left - right
            if wide > room:
                raise self._letter.wrong(
                    block.line, f"the signature {block.name} is {wide:.0f} mm wide, and there are {room:.0f} mm."
                )
            self._keep(high + (len(block.blocks) + 1) * self._usual)
            top = (self._frame.top if self._last is None else self._last + self._gap) + 0.35 * self._usual
            spare = {"left": 0.0, "right": room - wide}.get(block.side, 0.5 * (room - wide))
            wander = 1.5 * self._xh * abs(float(self._rng.normal(0.0, self._jitter)))
            x = self._frame.left + left + min(spare + wander, max(room - wide, 0.0))
            self._page.signatures.append(Pasted(block.name, x, top, wide, high, block.ink, len(self._page.rows)))
            self._go_below(top + high)
        self._tight, self._side = True, block.side
        self.blocks(block.blocks, left, right)
        self._tight, self._side = False, None

    def _table(self, block: TableBlock, left: float, right: float) -> None:
        self._space(_ABOVE["table"])
        self._clear()
        cells = [[self._lines.get(self._number[id(cell)], []) for cell in row] for row in block.rows]
        gap, size = _COLUMN_GAP * block.manner.size * self._xh, block.manner.size
        # room between the margins of a page that comes, too
        narrowest = self._frame.width if self._boxed else min(self._frame.width, self._setting.following.width)
        starts, widths = self._columns(block, cells, narrowest - left - right, gap)
        end, voice = starts[-1] + widths[-1], voice_of(block.manner)
        page, x, top = self._page, 0.0, math.inf  # of the part of the table that is on a page
        rows = [[self._break_cell(lines, width) for lines, width in zip(row, widths, strict=True)] for row in cells]
        depths = [max(1, *map(len, broken)) for broken in rows] + [0]
        for number, (broken, paragraphs, deep) in enumerate(zip(rows, block.rows, depths, strict=False)):
            sides = [paragraph.side or "left" for paragraph in paragraphs]
            # the head stays with the row below it
            self._keep((deep + (0 if number else depths[1] + 0.3)) * self._usual * size)
            for depth in range(deep):
                at = self._table_row(broken, depth, sides, (starts, widths), (left, right))
                if self._page is not page:
                    self._rule_columns(page, x, (starts, gap), top, voice)
                    page, top = self._page, math.inf
                x, top = at.x, min(top, at.baseline - 1.6 * self._xh * size)
            if deep > 1:  # rows of several lines are kept apart
                self._gap = 0.22 * self._usual * size
            if number == 0:
                y = 0.42 * self._usual * size
                self._mark(page, Mark("ruled", (x - 0.4 * gap, y), (x + end + 0.3 * gap, y), voice))
                self._gap = 0.3 * self._usual * size
        self._rule_columns(page, x, (starts, gap), top, voice)
        self._space(_BELOW["table"])

    def _table_row(
        self,
        cells: Sequence[Sequence[tuple[Sequence[LetterWord], Sequence[float]]]],
        depth: int,
        sides: Sequence[Side],
        columns: tuple[Sequence[float], Sequence[float]],
        indent: tuple[float, float],
    ) -> _At:
        """Place line number `depth` of every cell that has so many."""
        some = [k for k, lines in enumerate(cells) if depth < len(lines)]
        words = [word for k in some for word in cells[k][depth][0]]
        at = self._find_place(words, *indent)
        starts, widths = columns
        segments = [
            Segment(at.x + starts[k], widths[k], tuple(cells[k][depth][0]), tuple(cells[k][depth][1]), sides[k])
            for k in some
        ]
        self._add(at, segments, words)
        return at

    def _columns(
        self, block: TableBlock, cells: Sequence[Sequence[Sequence[Sequence[LetterWord]]]], room: float, gap: float
    ) -> tuple[list[float], list[float]]:
        """Where the columns of a table begin, and how wide they are, mm: as what they hold, or as far as there is room.

        Raises DoesNotFit: there is no room for their longest words.
        """
        columns = list(zip(*cells, strict=True))
        natural = [max((self._width(line) for lines in column for line in lines), default=0.0) for column in columns]
        least = [
            max((self._width(part) for lines in column for line in lines for part in _clusters(line)), default=0.0)
            for column in columns
        ]
        room -= gap * (len(columns) - 1)
        if sum(least) > room:
            raise self._letter.wrong(
                block.line,
                f"the table is {sum(least) + gap * (len(columns) - 1):.0f} mm wide at least, and there are "
                f"{room + gap * (len(columns) - 1):.0f} mm: use fewer columns, shorter words, smaller letters "
                "({size=0.8} in a line before it) or a larger page.",
                DoesNotFit,
            )
        widths = _share_room(natural, least, room)
        left = max(room - sum(widths), 0.0) / len(widths)
        # who rules columns by eye leaves one a little wider than it had to be
        eased = [width + min(left, 0.5 * gap * abs(float(self._rng.normal(0.0, self._jitter)))) for width in widths]
        starts = np.cumsum([0.0, *(width + gap for width in eased[:-1])])
        return starts.tolist(), eased

    def _width(self, words: Sequence[LetterWord]) -> float:
        return extent(words, gaps_of(words)) * self._xh

    def _break_cell(
        self, lines: Sequence[Sequence[LetterWord]], width: float
    ) -> list[tuple[Sequence[LetterWord], Sequence[float]]]:
        """The lines of a cell, broken into rows of so many mm."""
        rows = list[tuple[Sequence[LetterWord], Sequence[float]]]()
        for line in lines:
            rest = line
            while rest:
                count, gaps = self._fill_row(rest, width)
                rows.append((rest[:count], gaps))
                rest = rest[count:]
        return rows

    def _mark(self, page: FlowPage, mark: Mark) -> None:
        """Draw something with the last row of a page."""
        last = page.rows[-1]
        page.rows[-1] = replace(last, marks=(*last.marks, mark))

    def _rule_columns(
        self, page: FlowPage, x: float, columns: tuple[Sequence[float], float], top: float, voice: Voice
    ) -> None:
        """Draw the lines between the columns of a table, from `top` mm to the last row of a page.

        x : where the table begins, mm; columns : where each begins in it, and the gap between two.
        """
        if not math.isfinite(top):  # no row of it is on the page
            return
        starts, gap = columns
        upper = top - page.rows[-1].baseline
        for start in starts[1:]:
            place = x + start - 0.58 * gap
            self._mark(page, Mark("ruled", (place, upper), (place, 0.35 * self._usual), voice))

    def _clear(self) -> None:
        """Go on below the pictures that words stand beside."""
        here = self._frame.top if self._last is None else self._last
        lower = [rect[3] for rect in self._page.taken if rect[3] > here]
        if lower and not self._boxed:
            self._go_below(max(lower))


def _share_room(natural: Sequence[float], least: Sequence[float], room: float) -> list[float]:
    """Widths of columns that share some room: those of their contents; the widest give way where that is too much."""
    low, high = 0.0, max(natural)
    if sum(natural) > room:
        for _ in range(40):
            middle = (low + high) / 2
            wide = sum(max(min(a, middle), b) for a, b in zip(natural, least, strict=True)) > room
            low, high = (low, middle) if wide else (middle, high)
        high = low
    return [max(min(a, high), b) + 1e-6 for a, b in zip(natural, least, strict=True)]


def _heights(words: Sequence[LetterWord]) -> tuple[float, float]:
    """How far the letters and formulas of a row reach above and below its baseline, usual x-heights."""
    scale = max((word.scale for word in words), default=1.0)
    high = max((word.scale * word.written.high for word in words), default=0.0)
    low = max((-word.scale * word.written.low for word in words), default=0.0)
    return max(ASCENT * scale, high), max(DESCENT * scale, low)


def _clusters(words: Sequence[LetterWord]) -> Iterator[list[LetterWord]]:
    """Words between which a line must not end."""
    cluster: list[LetterWord] = []
    for word in words:
        if cluster and word.breakable:
            yield cluster
            cluster = []
        cluster.append(word)
    if cluster:
        yield cluster
