"""Words cut from a writer's pages, and his hand without the lines that they stand on.

A real snippet is the ink of some words as it was lifted from its page, by the same matte that the glyphs of the hand
were lifted by, and it is laid on the same white: paper, crop and compression of the scan are gone from both.
"""

from __future__ import annotations

import unicodedata
from collections import defaultdict
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
import regex
from numpy.typing import NDArray

from handout.hand.places import graphemes
from handout.hand.scanned import ScannedGlyph, ScannedHand, ScannedPage, Texture
from handout.values import Indices

if TYPE_CHECKING:
    from scipy.spatial import cKDTree

WIDEST = 72.0  # mm of a real snippet; its made twin may be wider by the rest of its frame
NARROWEST = 22.0  # mm: less shows too little of a hand; set by eye
_FEWEST = 2  # words
_STRANGE = 0.12  # share of a run's line that is no letter's: more is something struck out, or a word misread; by eye
_CUT = 2  # vertices of another word that hang on a run: more is a stroke that would be cut off
_REACH = 0.3  # distances of lines, within which ink that is no letter's is its neighbour's; set by eye
_FAINTEST = 1 / 255  # of the cover: less is a rounding of the interpolation
_NOWHERE = -1
_GAPS = 0.05, 1.2  # x-heights, where a page does not show how far letters and words are apart; set by eye
_OPENS, _ENDS = "[(\"'“„«‹‘‚¿¡]*", "[.,;:?!…)\"'”“»›’]*"  # what stands before a word in running text, and after it
_LETTER = r"(?:\p{L}\p{M}*)"
_LETTERS = regex.compile(rf"{_OPENS}({_LETTER}+(?:['’-]{_LETTER}+)*){_ENDS}")
_NUMBER_OR_DASH = regex.compile(rf"\p{{Nd}}+{_ENDS}|[-–—]")


@dataclass(frozen=True)
class Run:
    """Some words of a page that stand beside each other.

    words : numbers of the words of the page's transcript, which are parted by white space: words of running text,
        and fewer numbers and dashes than those.
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
        """Line → the words of running text on it of which every letter was found, in order; others are `_NOWHERE`."""
        found: dict[tuple[int, int], set[int]] = defaultdict(set)
        for glyph in self._glyphs:
            if (word := self._of_letter.get(glyph.at)) is not None:
                found[glyph.line, word].add(glyph.at)
        on: dict[int, list[int]] = defaultdict(list)
        for line, word in sorted(found):
            text, places = self.words[word]
            whole = len(found[line, word]) == len(places) and runs_on(text)
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
                    said = sum(is_word(self.words[word][0]) for word in run)
                    if said >= _FEWEST and 2 * said > len(run) and self._clean(run, line):
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


class LooseLetters:
    """Words of any glyph of each letter, equally far apart and as high over the line as on its page.

    Nothing is chosen, bent or joined: how well people tell such words is what better ways are compared with.

    Source: "random selection" in seed 000, §8.2 and Appendix F.
    """

    def __init__(self, hand: ScannedHand) -> None:
        self.hand = hand

    @cached_property
    def _gaps(self) -> tuple[float, float]:
        """Between the letters of a word, and between words: the middle ones of the hand's own pages, x-heights."""
        beside = {(glyph.page, glyph.at): k for k, glyph in enumerate(self.hand.glyphs) if glyph.at >= 0}
        gaps: tuple[list[float], list[float]] = ([], [])
        for (page, at), k in beside.items():
            for further, found in enumerate(gaps, 1):
                other = beside.get((page, at + further))
                if other is None or self.hand.glyphs[other].line != self.hand.glyphs[k].line:
                    continue
                if further == 1 or (page, at + 1) not in beside:
                    found.append((self._ends(other)[0] - self._ends(k)[1]) / self.hand.pages[page].x_height)
        within, between = (
            float(np.median(found)) if found else usual for found, usual in zip(gaps, _GAPS, strict=True)
        )
        return within, between

    def _ends(self, number: int) -> tuple[float, float]:
        """Where a glyph begins and ends on its page, mm."""
        page = self.hand.pages[self.hand.glyphs[number].page]
        body = self.hand.body(number)
        x, half = page.graph.uv[body, 0] * page.pixel, page.graph.radius[body]
        return float((x - half).min()), float((x + half).max())

    @cached_property
    def _nearest(self) -> list[cKDTree]:
        from scipy.spatial import cKDTree

        return [cKDTree(page.graph.uv) for page in self.hand.pages]

    def _cut(self, number: int) -> tuple[NDArray[np.float32], float, float]:
        """The ink of a glyph (h, w, 4), colours times alpha; where it begins in x, and the row of its baseline."""
        glyph = self.hand.glyphs[number]
        page, body = self.hand.pages[glyph.page], self.hand.body(number)
        uv = page.graph.uv[body] - np.array(page.texture.corner)
        reach = 2 * float(page.graph.radius[body].max()) / page.pixel + 2
        low = np.maximum(np.floor(uv.min(axis=0) - reach).astype(int), 0)
        high = np.ceil(uv.max(axis=0) + reach).astype(int)
        part = page.texture.part(slice(low[1], high[1]), slice(low[0], high[0]))
        ink: NDArray[np.float32] = part.astype(np.float32) / np.float32(255)
        corner = low + np.array(page.texture.corner)
        rows, columns = np.nonzero(ink[:, :, 3])
        _, vertex = self._nearest[glyph.page].query(np.column_stack([columns, rows]) + corner)
        others = ~np.isin(vertex, body)
        ink[rows[others], columns[others]] = 0
        ink[:, :, :3] *= ink[:, :, 3:]
        left, _ = self._ends(number)
        middle = float(corner[0]) + ink.shape[1] / 2
        return ink, left / page.pixel - float(corner[0]), float(page.base(glyph.line, middle)) - float(corner[1])

    def picture(self, text: str, x_height: float, rise: float, dpi: float, rng: np.random.Generator) -> Picture | None:
        """Words at an x-height (mm), their line rising by `rise`; None where the hand lacks a letter of them."""
        import cv2

        units = graphemes(text)
        if any(not unit.isspace() and not len(self.hand.numbers_of_letter(unit)) for unit in units):
            return None
        numbers = [None if unit.isspace() else int(rng.choice(self.hand.numbers_of_letter(unit))) for unit in units]
        pixel, (within, between) = 25.4 / dpi, self._gaps
        placed, x = [], 0.0
        for number in numbers:
            if number is None:
                x += (between - within) * x_height
                continue
            page = self.hand.pages[self.hand.glyphs[number].page]
            placed.append((number, x, x_height / page.x_height))
            left, right = self._ends(number)
            x += (right - left) * x_height / page.x_height + within * x_height
        rim = 4 * x_height  # no letter reaches further from its line
        size = [round(side / pixel) for side in (x + 2 * rim, 2 * rim)]
        sheet = np.zeros((size[1], size[0], 4), dtype=np.float32)
        for number, at, scale in placed:
            ink, left, base = self._cut(number)
            finer = scale * dpi / self.hand.pages[self.hand.glyphs[number].page].dpi
            corner = np.array([(at + rim) / pixel - finer * left, (rim - rise * at) / pixel - finer * base])
            column, row = np.maximum(np.floor(corner).astype(int) - 1, 0).tolist()
            moved = np.column_stack([finer * np.eye(2), corner - (column, row)])
            box = [int(np.ceil(finer * side)) + 4 for side in ink.shape[1::-1]]
            own = np.asarray(cv2.warpAffine(ink, moved, box, flags=cv2.INTER_CUBIC), dtype=np.float32).clip(0, 1)
            own[own[:, :, 3] < _FAINTEST] = 0
            under = sheet[row : row + box[1], column : column + box[0]]
            own = own[: under.shape[0], : under.shape[1]]
            under[:] = own + under * (1 - own[:, :, 3:])
        return on_white(sheet, (rim - rise * x / 2) / pixel, dpi)


def on_white(rgba: NDArray[np.float32], base: float, dpi: float) -> Picture:
    """Ink (h, w, 4), colours times alpha, on white, cut close around it; `base` is the row of its baseline."""
    rows, columns = (np.flatnonzero((rgba[:, :, 3] > 0).any(axis=axis)) for axis in (1, 0))
    part = rgba[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1]
    mixed = part[:, :, :3] + (1 - part[:, :, 3:])
    return Picture(np.rint(np.clip(mixed, 0, 1) * 255).astype(np.uint8), base - float(rows[0]), dpi)


def is_word(text: str) -> bool:
    """Whether a text without spaces is a word of running text, with the marks that may stand beside it.

    A word has two letters that are not the same (rows of accents have not), or is one letter with no mark beside it:
    with one it is an initial, or the name of a thing.
    """
    text = unicodedata.normalize("NFC", text)
    found = _LETTERS.fullmatch(text)
    return found is not None and (len(set(found[1].casefold())) > 1 or len(text) == 1)


def runs_on(text: str) -> bool:
    """Whether a text without spaces belongs to running text: a word, a plain number, a dash."""
    return is_word(text) or _NUMBER_OR_DASH.fullmatch(text) is not None


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
    fewer = hand.take_glyphs(kept)
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
