"""Words cut from a writer's pages, and his hand without the lines that they stand on.

A real snippet is the ink of some words as it was lifted from its page, by the same matte that the glyphs of the hand
were lifted by, and it is laid on the same white: paper, crop and compression of the scan are gone from both.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from handout.hand.places import graphemes
from handout.hand.scanned import ScannedGlyph, ScannedHand, ScannedPage, Texture
from handout.values import Indices

WIDEST = 72.0  # mm of a real snippet; its made twin may be wider by the rest of its frame
NARROWEST = 22.0  # mm: less shows too little of a hand; set by eye
_FEWEST = 2  # words
_STRANGE = 0.12  # share of a run's line that is no letter's: more is something struck out, or a word misread; by eye
_CUT = 2  # vertices of another word that hang on a run: more is a stroke that would be cut off
_REACH = 0.3  # distances of lines, within which ink that is no letter's is its neighbour's; set by eye
_FAINTEST = 1 / 255  # of the cover: less is a rounding of the interpolation
_NOWHERE = -1


@dataclass(frozen=True)
class Run:
    """Some words of a page that stand beside each other.

    words : numbers of the words of the page's transcript, which are parted by white space.
    """

    page: int
    line: int
    words: tuple[int, ...]
    text: str


@dataclass(frozen=True, eq=False)
class Picture:
    """Ink on white.

    rgb : (h, w, 3) uint8, cut close around the ink.
    base : pixels from its upper edge to the baseline.
    """

    rgb: NDArray[np.uint8]
    base: float
    dpi: float

    @property
    def width(self) -> float:
        """mm."""
        return float(self.rgb.shape[1] * 25.4 / self.dpi)


class WrittenWords:
    """The words of one page of a hand, with their ink."""

    def __init__(self, hand: ScannedHand, number: int) -> None:
        self.hand, self.number = hand, number
        self.page: ScannedPage = hand.pages[number]
        self._glyphs = [glyph for glyph in hand.glyphs if glyph.page == number]
        self.words = list(_words(self.page.transcript))
        self._of_letter = {at: k for k, (_, places) in enumerate(self.words) for at in places}

    @cached_property
    def lines(self) -> dict[int, list[int]]:
        """Line → the words on it of which every letter was found, in order; `_NOWHERE` parts them where one was not."""
        found: dict[tuple[int, int], set[int]] = defaultdict(set)
        for glyph in self._glyphs:
            if (word := self._of_letter.get(glyph.at)) is not None:
                found[glyph.line, word].add(glyph.at)
        on: dict[int, list[int]] = defaultdict(list)
        for line, word in sorted(found):
            text, places = self.words[word]
            whole = len(found[line, word]) == len(places) and "~" not in text
            beside = not on[line] or on[line][-1] == word - 1
            on[line] += ([] if beside else [_NOWHERE]) + [word if whole else _NOWHERE]
        return dict(on)

    @cached_property
    def owner(self) -> tuple[Indices, NDArray[np.bool_], Indices]:
        """(n,) the word of every vertex of the page, (n,) whether that is a letter's own, (n,) its line."""
        count = len(self.page.graph)
        word, line = np.full(count, _NOWHERE, dtype=np.intp), np.full(count, _NOWHERE, dtype=np.intp)
        for glyph in self._glyphs:
            word[glyph.vertices] = self._of_letter.get(glyph.at, len(self.words) + glyph.word)
            line[glyph.vertices] = glyph.line
        own = word >= 0
        if own.any() and not own.all():
            from scipy.spatial import cKDTree

            reach = _REACH * self.page.unit
            away, near = cKDTree(self.page.graph.uv[own]).query(self.page.graph.uv[~own])
            word[~own] = np.where(away <= reach, word[own][near], _NOWHERE)
            line[~own] = line[own][near]
        return word, own, line

    @cached_property
    def nearest(self) -> tuple[Indices, Indices, Indices]:
        """Row and column (m,) in the texture of every pixel of ink, and (m,) the vertex that is nearest to it."""
        from scipy.spatial import cKDTree

        rows, columns = np.nonzero(self.page.texture.alpha)
        places = np.column_stack([columns, rows]) + np.array(self.page.texture.corner)
        return rows, columns, np.asarray(cKDTree(self.page.graph.uv).query(places)[1], dtype=np.intp)

    def runs(self, widest: float = WIDEST) -> Iterator[Run]:
        """The snippets of the page, as wide as they may be (mm), none over another."""
        spans = self._spans()
        for line, words in sorted(self.lines.items()):
            for piece in _pieces(words):
                for run in _cut(piece, spans, widest):
                    if len(run) >= _FEWEST and self._clean(run, line):
                        text = " ".join(self.words[word][0] for word in run)
                        yield Run(self.number, line, tuple(run), text)

    def _spans(self) -> dict[int, tuple[float, float]]:
        """Word → where its ink begins and ends, mm."""
        word, _, _ = self.owner
        x = self.page.graph.uv[:, 0] * self.page.pixel
        return {int(k): (float(x[word == k].min()), float(x[word == k].max())) for k in np.unique(word) if k >= 0}

    def _clean(self, run: Sequence[int], on: int) -> bool:
        """Whether the ink of a run is its letters', and none of it is joined to that of other words of its line."""
        word, own, line = self.owner
        here = np.isin(word, run)
        joined = np.isin(self.page.graph.components, np.unique(self.page.graph.components[here]))
        cut = int((joined & ~here & (line == on)).sum())
        return float((~own[here]).mean()) <= _STRANGE and cut <= _CUT

    def picture(self, run: Run, slope: float, dpi: float) -> Picture:
        """The ink of a run as it was scanned, at `dpi` on white, its line turned so that it rises by `slope`.

        So the line of the page, and how the page lay on the scanner, tell nothing; and the ink is interpolated once,
        by the same method as ink that is written anew (`inking.warping`), so that neither is the sharper.
        """
        import cv2

        word, _, _ = self.owner
        rows, columns, vertex = self.nearest
        here = np.isin(word[vertex], run.words)
        rows, columns = rows[here], columns[here]
        (top, foot), (left, right) = ((int(at.min()), int(at.max()) + 1) for at in (rows, columns))
        (x, y), middle = self.page.texture.corner, (left + right) / 2
        a, b = self.page.base(run.line, np.array([left, right], dtype=np.float64) + x) - y
        rgba = np.zeros((foot - top, right - left, 4), dtype=np.float32)
        ink = self.page.texture.rgba[rows, columns].astype(np.float32) / 255
        ink[:, :3] *= ink[:, 3:]
        rgba[rows - top, columns - left] = ink
        turn, finer = float(np.arctan2(float(b - a), right - left) + np.arctan(slope)), dpi / self.page.dpi
        matrix = cv2.getRotationMatrix2D((middle - left, float((a + b) / 2) - top), float(np.degrees(turn)), finer)
        height, width = rgba.shape[:2]
        rim = np.ceil(0.5 * abs(np.sin(turn)) * finer * max(height, width)) + 2
        size = [int(np.ceil(finer * side + 2 * rim)) for side in (width, height)]
        matrix[:, 2] += rim + (finer - 1) * np.array([middle - left, float((a + b) / 2) - top])
        turned = np.asarray(cv2.warpAffine(rgba, matrix, size, flags=cv2.INTER_CUBIC), dtype=np.float32).clip(0, 1)
        turned[turned[:, :, 3] < _FAINTEST] = 0
        return on_white(turned, finer * (float((a + b) / 2) - top) + float(rim), dpi)


def on_white(rgba: NDArray[np.float32], base: float, dpi: float) -> Picture:
    """Ink (h, w, 4), colours times alpha, on white, cut close around it; `base` is the row of its baseline."""
    rows, columns = (np.flatnonzero((rgba[:, :, 3] > 0).any(axis=axis)) for axis in (1, 0))
    part = rgba[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1]
    mixed = part[:, :, :3] + (1 - part[:, :, 3:])
    return Picture(np.rint(np.clip(mixed, 0, 1) * 255).astype(np.uint8), base - float(rows[0]), dpi)


def _words(transcript: str) -> Iterator[tuple[str, tuple[int, ...]]]:
    """The words of a transcript, each with the places of its graphemes."""
    places: list[int] = []
    units = [*graphemes(transcript), " "]
    for at, unit in enumerate(units):
        if not unit.isspace():
            places.append(at)
        elif places:
            yield "".join(units[k] for k in places), tuple(places)
            places = []


def _pieces(words: Sequence[int]) -> Iterator[list[int]]:
    """The words between those that are not whole."""
    piece: list[int] = []
    for word in [*words, _NOWHERE]:
        if word != _NOWHERE:
            piece.append(word)
        elif piece:
            yield piece
            piece = []


def _cut(piece: Sequence[int], spans: dict[int, tuple[float, float]], widest: float) -> Iterator[list[int]]:
    """A piece of a line in runs of about the same width, each within the bounds."""
    whole = spans[piece[-1]][1] - spans[piece[0]][0]
    wanted = whole / max(1, np.ceil(whole / widest))
    run: list[int] = []
    for word in piece:
        if run and spans[word][1] - spans[run[0]][0] > widest:
            yield from _wide(run, spans, widest)
            run = []
        run.append(word)
        if spans[word][1] - spans[run[0]][0] >= wanted:
            yield from _wide(run, spans, widest)
            run = []
    yield from _wide(run, spans, widest)


def _wide(run: list[int], spans: dict[int, tuple[float, float]], widest: float) -> Iterator[list[int]]:
    if run and NARROWEST <= spans[run[-1]][1] - spans[run[0]][0] <= widest:
        yield run


def without_lines(hand: ScannedHand, lines: Collection[tuple[int, int]]) -> ScannedHand:
    """A hand that never saw some lines, given as (page, line): neither their glyphs nor their ink are in it.

    The distance of lines, x-height and slant of its pages stay those of all lines.
    """
    kept = [k for k, glyph in enumerate(hand.glyphs) if (glyph.page, glyph.line) not in lines]
    fewer = hand.only(kept)
    pages, vertices = [], []
    for number, page in enumerate(hand.pages):
        gone = {line for scan, line in lines if scan == number}
        cleared, renumbered = _cleared(WrittenWords(hand, number), gone) if gone else (page, None)
        pages.append(cleared)
        vertices.append(renumbered)
    glyphs = [glyph if (new := vertices[glyph.page]) is None else _renumbered(glyph, new) for glyph in fewer.glyphs]
    return replace(fewer, pages=tuple(pages), glyphs=tuple(glyphs))


def _cleared(words: WrittenWords, gone: Collection[int]) -> tuple[ScannedPage, Indices]:
    """The page without the ink of some lines, and the new number of every vertex, −1 where it is gone."""
    page = words.page
    _, _, line = words.owner
    kept = ~np.isin(line, list(gone))
    for glyph in words.hand.glyphs:  # half of a ligature may be both letters'
        if glyph.page == words.number and glyph.line not in gone:
            kept[glyph.vertices] = True
    number = np.where(kept, np.cumsum(kept) - 1, -1)
    rows, columns, vertex = words.nearest
    pixels = page.texture.pixels.copy()
    away = ~kept[vertex]
    pixels[rows[away], columns[away]] = 0
    texture = Texture(page.texture.corner, page.texture.shape, lambda: pixels, page.texture.blue_first)
    dismissed = number[page.dismissed]
    moments = None  # times of vertices that are gone would have to go, too
    cleared = replace(
        page, graph=page.graph.take(kept), texture=texture, dismissed=dismissed[dismissed >= 0], moments=moments
    )
    return cleared, number


def _renumbered(glyph: ScannedGlyph, number: Indices) -> ScannedGlyph:
    """A glyph whose vertices have other numbers."""
    ligatures = tuple(replace(way, path=number[way.path]) for way in glyph.ligatures)
    ways = tuple(number[way] for way in glyph.ways)
    return replace(glyph, vertices=number[glyph.vertices], ligatures=ligatures, ways=ways)
