"""The pages of a letter: every row that `flow` has given its place gets its slope and bend, its glyphs and ornaments.

Source: own method.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import groupby
from typing import Any

import numpy as np

from handout.errors import DoesNotFit
from handout.letters.flow import flow_letter
from handout.letters.ornaments import Ornaments
from handout.letters.rows import FlowPage, LetterSetting, Mark, Pasted, Segment, SetRow, Voice, voice_of
from handout.letters.runs import LetterWord
from handout.values import Array, Glyph, Line, Manuscript, Placed
from handout.writing.layout import LineGeometry, line_geometries, on_rules
from handout.writing.pages import SMALLEST_FIT, FormulaWord, ToPage, extent, on_page, place_words
from handout.writing.slips import StrikeThrough


@dataclass(frozen=True, eq=False)
class LetterPage:
    """A page of a letter, still without ink and without time.

    layers : what is written in one voice; rows : of each layer, which row of the page each of its lines is.
    whole : all of it, in the order of writing.
    """

    layers: Mapping[Voice, Manuscript]
    rows: Mapping[Voice, tuple[int, ...]]
    whole: Manuscript
    pictures: tuple[Pasted, ...]
    signatures: tuple[Pasted, ...]
    rng: np.random.Generator


def set_letter(
    setting: LetterSetting, lines: Mapping[int, Sequence[Sequence[LetterWord]]], seed: Sequence[int]
) -> list[LetterPage]:
    """The pages of a letter.

    lines : the words of each paragraph, see `runs.lines_of`.

    Raises DoesNotFit: something is too wide or too high for its place, or there are too many pages; the message has the
    line.
    """
    layout = setting.first
    scales = np.linspace(1.0, SMALLEST_FIT, 19) if layout.fit else np.ones(1)
    for scale in scales.tolist():
        smaller = setting if scale == 1.0 else setting.scale_letters(scale)
        flow_rng, rng = np.random.default_rng(seed).spawn(2)
        try:
            pages = flow_letter(smaller, lines, flow_rng)
        except DoesNotFit:
            if scale == scales[-1]:
                raise
            continue
        return _Placing(smaller, rng).pages(pages)
    raise AssertionError("the last scale either fits or raises")


@dataclass(frozen=True)
class _MarkedRun:
    """Glyphs of neighbouring words of a row under or through which something is drawn.

    left, right : its ends, mm; most : how far what is drawn may go on; last : the word that it ends with.
    """

    kind: str
    left: float
    right: float
    most: float
    last: int


class _Placing:
    """Gives the rows of a letter's pages their slopes and bends, their glyphs and their ornaments."""

    def __init__(self, setting: LetterSetting, rng: np.random.Generator) -> None:
        self._setting, self._rng = setting, rng
        ornaments, strikes = rng.spawn(2)
        jitter = setting.first.jitter
        self._ornaments, self._strikes = Ornaments(ornaments, jitter), StrikeThrough(strikes)
        self._xh, self._jitter = setting.first.x_height, jitter

    def pages(self, pages: Sequence[FlowPage]) -> list[LetterPage]:
        """The pages, in order."""
        return [self._page(page, number) for number, page in enumerate(pages, 1)]

    def _page(self, page: FlowPage, number: int) -> LetterPage:
        rng = self._rng.spawn(1)[0]
        geometries = self._geometries(page.rows, rng)
        self._words, self._slips, self._formulas = 0, list[dict[str, Any]](), list[str]()
        layers: dict[Voice, list[Line]] = {}
        places: dict[Voice, list[int]] = {}
        whole = []
        signatures = list[Pasted]()
        for at, (row, geometry) in enumerate(zip(page.rows, geometries, strict=True)):
            signatures += [replace(each, word=self._take()) for each in page.signatures if each.row == at]
            line, of_voice = self._row(row, geometry, number, at + 1)
            whole.append(line)
            for voice, placed in of_voice.items():
                text = "".join(glyph.glyph.letter for glyph in placed)
                layers.setdefault(voice, []).append(replace(line, text=text, placed=tuple(placed)))
                places.setdefault(voice, []).append(at)
        signatures += [replace(each, word=self._take()) for each in page.signatures if each.row == len(page.rows)]
        writers, layout = self._setting.writers, self._setting.first
        spacing = layout.baseline_distance(writers[""].handwriting.pitch)
        about: dict[str, Any] = {"line_spacing": round(spacing, 3), **layout.told}
        if page.rows:
            about["baseline"] = round(page.rows[0].baseline, 3)
        if self._slips:
            about["slips"] = self._slips
        if self._formulas:
            about["formulas"] = self._formulas
        manuscripts = {}
        for voice, lines in layers.items():
            writer = writers[voice.hand]
            x_height = self._xh * writer.ratio * voice.size
            own = {"hand": writer.handwriting.name, "x_height": round(x_height, 3), **about}
            manuscripts[voice] = Manuscript(tuple(lines), layout.page, x_height, own)
        about = {"hand": writers[""].handwriting.name, "x_height": round(self._xh, 3), **about}
        return LetterPage(
            manuscripts,
            {voice: tuple(rows) for voice, rows in places.items()},
            Manuscript(tuple(whole), layout.page, self._xh, about),
            tuple(page.pictures),
            tuple(signatures),
            rng,
        )

    def _geometries(self, rows: Sequence[SetRow], rng: np.random.Generator) -> list[LineGeometry]:
        """How each row lies; those of a box by themselves."""
        model = self._setting.writers[""].handwriting.baseline_model
        ruled = self._setting.first.ruling is not None
        found: dict[int, LineGeometry] = {}
        frames = {id(row.frame): row.frame for row in rows}
        for frame in frames.values():
            own = [n for n, row in enumerate(rows) if row.frame is frame]
            reach = 0.5 * frame.width / self._xh
            lying = line_geometries(on_rules(model) if ruled else model, len(own), self._jitter, reach, rng)
            found |= dict(zip(own, lying, strict=True))
        return [found[n] for n in range(len(rows))]

    def _row(
        self, row: SetRow, geometry: LineGeometry, page: int, number: int
    ) -> tuple[Line, dict[Voice, list[Placed]]]:
        frame, scale = row.frame, self._xh
        half = 0.5 * frame.width
        baseline = row.baseline - geometry.above * scale
        rise = (geometry.slope - row.slope, geometry.sag * scale, frame.left + half, half)
        to_page = on_page(baseline, rise)
        placed = [(mark.voice, self._mark(mark, to_page)) for mark in row.marks]
        texts = []
        for segment in row.segments:
            placed += self._segment(segment, geometry.edge, to_page)
            texts.append(_text(segment.words))
            self._slips += [
                {"page": page, "line": number, "written": "".join(w.written.spelt), "meant": w.intended}
                for w in segment.words
                if w.intended
            ]
            words = [w.written for w in segment.words if isinstance(w.written, FormulaWord)]
            self._formulas += [source for word in words for source in word.sources]
        layers: dict[Voice, list[Placed]] = {}
        for voice, glyph in placed:
            layers.setdefault(voice, []).append(glyph)
        return Line(" ".join(texts), tuple(glyph for _, glyph in placed), baseline, rise), layers

    def _segment(self, segment: Segment, edge: float, to_page: ToPage) -> list[tuple[Voice, Placed]]:
        scale = self._xh
        starts, x = [], segment.x + scale * self._find_left(segment, edge)
        for word, gap in zip(segment.words, segment.gaps, strict=True):
            x += gap * scale
            starts.append(x)
            x += word.word.advance * scale
        runs = list(_find_marked(segment.words, starts, scale))
        numbers = []
        marks: list[tuple[_MarkedRun, int]] = []
        for i in range(len(segment.words)):
            numbers.append(self._take())
            marks += [(run, self._take()) for run in runs if run.last == i]
        placed: list[tuple[Voice, Placed]] = []
        for voice, group in groupby(range(len(segment.words)), key=lambda i: voice_of(segment.words[i].manner)):
            own = list(group)
            words = [segment.words[i].written for i in own]
            writer = self._setting.writers[voice.hand]
            size = scale * segment.words[own[0]].scale
            glyphs = place_words(writer.handwriting, words, [starts[i] for i in own], size, to_page)
            placed += [(voice, replace(glyph, word=numbers[own[glyph.word]])) for glyph in glyphs]
        for i, word in enumerate(segment.words):
            if word.intended is not None:
                placed.append(self._strike_slip(word, starts[i], numbers[i], segment, to_page))
        for run, number in marks:
            word = segment.words[run.last]
            size = scale * word.scale
            kind: Any = run.kind
            left, right = run.left / size, run.right / size
            struck = run.kind == "struck"
            strokes = self._strikes.strokes(left, right) if struck else self._ornaments.underline(kind, left, right)
            for points in strokes:  # the next word is not marked
                points[:, 0] = np.minimum(points[:, 0], max(run.most / size, left + 0.3))
            drawn = _place_strokes([points * size for points in strokes], number, word.written.at[-1], to_page)
            placed.append((voice_of(word.manner), drawn))
        return sorted(placed, key=lambda pair: pair[1].word)

    def _take(self) -> int:
        """The number of the next word of the page."""
        self._words += 1
        return self._words - 1

    def _strike_slip(
        self, word: LetterWord, start: float, number: int, segment: Segment, to_page: ToPage
    ) -> tuple[Voice, Placed]:
        """The strokes through a slip of the pen, which stay within the column."""
        size = self._xh * word.scale
        left, right = word.written.left, word.written.right
        low, high = min(segment.x, start + left * size), max(segment.x + segment.width, start + right * size)
        strokes = [stroke * size + (start, 0.0) for stroke in self._strikes.strokes(left, right)]
        for points in strokes:
            points[:, 0] = np.clip(points[:, 0], low, high)
        return voice_of(word.manner), _place_strokes(strokes, number, word.written.at[-1], to_page)

    def _mark(self, mark: Mark, to_page: ToPage) -> Placed:
        size = self._xh * mark.voice.size
        (x, y), (end, lower) = mark.start, mark.end
        if mark.kind == "ruled":
            strokes = [self._ornaments.rule_line(np.array([x, -y]) / size, np.array([end, -lower]) / size)]
        elif mark.kind in ("short", "wide", "flourish"):
            strokes = self._ornaments.rule(x / size, end / size, mark.kind)
        else:
            strokes = [stroke + np.array([x / size, 0.0]) for stroke in self._ornaments.bullet(mark.kind)]
        return _place_strokes([stroke * size for stroke in strokes], self._take(), mark.at, to_page)

    def _find_left(self, segment: Segment, edge: float) -> float:
        """Where a row begins, usual x-heights from the left end of its column."""
        spare = segment.width / self._xh - extent(segment.words, segment.gaps)
        side = segment.side or self._setting.first.align
        if side == "right":
            return max(0.0, spare - abs(edge))
        if side == "centre":
            return max(0.0, 0.5 * spare + edge)
        wander = edge if side == "ragged" else 0.25 * edge
        # in a column of a table there is a line to keep away from
        return min(max(wander, -0.12 if segment.side else -0.5), max(0.0, spare))


def _place_strokes(strokes: Sequence[Array], number: int, at: int, to_page: ToPage) -> Placed:
    """Strokes, mm over their baseline, as a word of no letters."""
    mark = Glyph("", (), (True,) * len(strokes), 0.0)
    return Placed(mark, tuple(map(to_page, strokes)), joined=False, word=number, at=at)


def _find_marked(words: Sequence[LetterWord], starts: Sequence[float], scale: float) -> Iterator[_MarkedRun]:
    """The runs of a row that are underlined, then those that are struck out."""
    for what in (lambda manner: manner.underline, lambda manner: "struck" if manner.struck else ""):
        glyphs = [
            (what(manner), i, start + scale * word.scale * left, start + scale * word.scale * right)
            for i, (word, start) in enumerate(zip(words, starts, strict=True))
            for manner, (left, right) in zip(word.manners, word.written.extents.tolist(), strict=True)
        ]
        for kind, group in groupby(glyphs, key=lambda glyph: glyph[0]):
            some = list(group)
            if kind:
                last = some[-1][1]
                right = max(glyph[3] for glyph in some)
                behind = starts[last + 1] + scale * words[last + 1].word.left if last + 1 < len(words) else np.inf
                most = min(right + 0.6 * (behind - right), behind - 0.2 * scale)
                yield _MarkedRun(kind, min(glyph[2] for glyph in some), right, most, last)


def _text(words: Sequence[LetterWord]) -> str:
    return "".join(
        (" " if i and (word.gap or word.breakable) else "")
        + ("".join(word.written.spelt) if word.intended is None else f"~~{''.join(word.written.spelt)}~~")
        for i, word in enumerate(words)
    )
