"""A scanned hand while it is being corrected: its glyphs in a list that changes, found by places on a page."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import regex
from numpy.typing import NDArray

from handout.hand.ligatures import LigatureFinder
from handout.hand.places import Place
from handout.hand.scanned import NOBODY, ScannedGlyph, ScannedHand, ScannedPage
from handout.values import Array, Indices, readonly_indices

if TYPE_CHECKING:
    from scipy.spatial import cKDTree

_NEAR = 1.0  # mm from a place to the ink it means

Spot = tuple[float, float]


class CorrectionError(Exception):
    """A correction cannot be made; its text says why."""


class HandEditor:
    """The glyphs of a hand under correction; a glyph that is gone is None until the numbers are closed up."""

    def __init__(self, hand: ScannedHand) -> None:
        self._hand = hand
        self._glyphs: list[ScannedGlyph | None] = list(hand.glyphs)
        self._order = list(range(len(hand.glyphs)))
        self._owners: dict[int, Indices] = {}
        self._trees: dict[int, cKDTree] = {}
        self._finders: dict[int, LigatureFinder] = {}
        self._page = 0

    def done(self) -> ScannedHand:
        """The corrected hand, its glyphs numbered in the order of writing; what was named by hand comes last."""
        numbers = [i for i in self._order if self._glyphs[i] is not None]
        number = {old: new for new, old in enumerate(numbers)} | {NOBODY: NOBODY}
        glyphs = (self._glyph(i) for i in numbers)
        numbered = (replace(glyph, before=number[glyph.before], after=number[glyph.after]) for glyph in glyphs)
        return replace(self._hand, glyphs=tuple(numbered))

    def turn_to(self, page: int) -> None:
        """Let the places that follow be on that page."""
        from scipy.spatial import cKDTree

        count = len(self._hand.pages)
        if not 0 <= page < count:
            raise CorrectionError(f"there is no such page; the hand has {count}, numbered from 0")
        self._page = page
        if page not in self._owners:
            owner = np.full(len(self._scan.graph), NOBODY, dtype=np.intp)
            for i, glyph in enumerate(self._glyphs):
                if glyph is not None and glyph.page == page:
                    owner[glyph.vertices] = i
            self._owners[page] = owner
            self._trees[page] = cKDTree(self._scan.graph.uv)

    def label(self, at: Spot, text: str, place: Place | None) -> None:
        """Name a letter, or make one of writing that belongs to none."""
        _one_letter(text)
        vertex = self._vertex(at)
        number = int(self._owner[vertex])
        if number == NOBODY:
            self._new(self._loose(vertex), text, place or "alone")
            return
        glyph = self._glyph(number)
        self._glyphs[number] = replace(glyph, letter=text, place=place or glyph.place, confidence=1.0)

    def merge(self, at: Spot, other: Spot, text: str | None) -> None:
        """Give what is at `other` to the letter at `at`."""
        number, vertex = self._number(at), self._vertex(other)
        second = int(self._owner[vertex])
        if second == number:
            raise CorrectionError(f"both places are on one letter, {self._glyph(number).letter!r}, already")
        letter = self._glyph(number).letter if text is None else _one_letter(text)
        if second == NOBODY:
            self._given(number, self._loose(vertex))
        else:
            self._united(number, second)
        self._glyphs[number] = replace(self._glyph(number), letter=letter, confidence=1.0)
        self._rejoin(number)

    def split(self, a: Spot, b: Spot, texts: tuple[str, str] | None) -> None:
        """Part the letter that the line from `a` to `b` crosses."""
        for text in texts or ():
            _one_letter(text)
        for end in (a, b):
            self._on_page(end)
        number, edges = self._crossed(np.array(a), np.array(b))
        first, second = self._parts(number, edges, np.array(a), np.array(b))
        glyph = self._glyph(number)
        names = texts or ((glyph.letter, "") if len(first) >= len(second) else ("", glyph.letter))
        new = len(self._glyphs)
        self._order.insert(self._order.index(number) + 1, new)
        self._owner[second] = new
        sure = replace(glyph, confidence=1.0, ligatures=())
        places = _halves(glyph.place)
        self._glyphs[number] = replace(sure, letter=names[0], vertices=first, after=new, place=places[0])
        at = NOBODY if names[1] != glyph.letter else glyph.at
        self._glyphs.append(replace(sure, letter=names[1], vertices=second, before=number, place=places[1], at=at))
        if glyph.after != NOBODY:
            self._glyphs[glyph.after] = replace(self._glyph(glyph.after), before=new)
        self._rejoin(number)
        self._rejoin(new)

    def remove(self, at: Spot) -> None:
        """Let what is at `at` be no letter."""
        number = self._number(at)
        glyph = self._glyph(number)
        self._part(glyph.before)
        self._part(number)
        self._owner[glyph.vertices] = NOBODY
        self._glyphs[number] = None

    def unlink(self, at: Spot) -> None:
        """Take away the ligatures from a letter to the next."""
        number = self._number(at)
        glyph = self._glyph(number)
        if not glyph.ligatures:
            raise CorrectionError(f"{glyph.letter!r} there is not joined to a next letter")
        self._glyphs[number] = replace(glyph, ligatures=())

    def link(self, at: Spot, other: Spot) -> None:
        """Put one letter after another in a word."""
        number, second = self._number(at), self._number(other)
        if number == second:
            raise CorrectionError("both places are on one letter: name the next one too")
        if self._glyph(number).line != self._glyph(second).line:
            raise CorrectionError("the two letters are on different lines")
        self._part(number)
        self._part(self._glyph(second).before)
        self._glyphs[number] = replace(self._glyph(number), after=second)
        self._glyphs[second] = replace(self._glyph(second), before=number, word=self._glyph(number).word)
        self._rejoin(number)

    def place(self, at: Spot, place: Place) -> None:
        """Say where in its word a letter is."""
        number = self._number(at)
        self._glyphs[number] = replace(self._glyph(number), place=place)

    @property
    def _scan(self) -> ScannedPage:
        return self._hand.pages[self._page]

    @property
    def _owner(self) -> Indices:
        """(n,) the glyph of every vertex of the page."""
        return self._owners[self._page]

    def _glyph(self, number: int) -> ScannedGlyph:
        glyph = self._glyphs[number]
        assert glyph is not None, "owners name only glyphs that are there"
        return glyph

    def _on_page(self, at: Spot) -> None:
        height, width = self._scan.shape
        if not (-width < at[0] < 2 * width and -height < at[1] < 2 * height):
            raise CorrectionError(f"no letter at ({at[0]:g}, {at[1]:g}): the scan has {width} x {height} pixels")

    def _vertex(self, at: Spot) -> int:
        """The vertex that a place means."""
        self._on_page(at)
        away, vertex = self._trees[self._page].query(at)
        if not away * self._scan.pixel <= _NEAR:
            near = f"the nearest is {away * self._scan.pixel:.1f} mm away" if np.isfinite(away) else "there is none"
            raise CorrectionError(f"no writing within {_NEAR:g} mm of ({at[0]:g}, {at[1]:g}); {near}")
        return int(vertex)

    def _number(self, at: Spot) -> int:
        """The glyph that a place means: of those within reach the one whose ink is nearest."""
        self._on_page(at)
        near = self._trees[self._page].query_ball_point(at, _NEAR / self._scan.pixel)
        owned = [v for v in near if self._owner[v] != NOBODY]
        if not owned:
            raise CorrectionError(f"no letter within {_NEAR:g} mm of ({at[0]:g}, {at[1]:g})")
        away = np.linalg.norm(self._scan.graph.uv[owned] - np.array(at), axis=1)
        return int(self._owner[owned[int(away.argmin())]])

    def _loose(self, vertex: int) -> Indices:
        """The vertices without a letter that hang together with one of them."""
        loose = self._owner == NOBODY
        edges = self._scan.graph.edges
        piece = _pieces(edges[loose[edges].all(axis=1)], len(loose))
        return np.flatnonzero(loose & (piece == piece[vertex]))

    def _new(self, vertices: Indices, text: str, place: Place) -> None:
        middle = self._scan.graph.uv[vertices].mean(axis=0)
        height = np.array([self._scan.to_line(i, middle)[0, 1] for i in range(len(self._scan.baselines))])
        line = int(np.abs(height - 0.5 * self._scan.x_height / self._scan.pitch).argmin())
        word = max((g.word for g in self._glyphs if g is not None and g.page == self._page), default=-1) + 1
        self._owner[vertices] = len(self._glyphs)
        self._order.append(len(self._glyphs))
        self._glyphs.append(ScannedGlyph(text, place, self._page, line, word, NOBODY, vertices))

    def _given(self, number: int, vertices: Indices) -> None:
        glyph = self._glyph(number)
        self._owner[vertices] = number
        self._glyphs[number] = replace(glyph, vertices=np.union1d(glyph.vertices, vertices))

    def _united(self, number: int, second: int) -> None:
        """Glyph `second` is taken up by glyph `number`; in a word the outer neighbours of both remain."""
        glyph, partner = self._glyph(number), self._glyph(second)
        adjoining = glyph.after == second or partner.after == number
        before, after = glyph.before, glyph.after
        if glyph.after == second:
            after = partner.after
        elif partner.after == number:
            before = partner.before
        place = _whole(glyph.place, partner.place, glyph.after == second) if adjoining else glyph.place
        for beside in (glyph.before, number, partner.before, second):
            self._part(beside)
        self._glyphs[second] = None
        self._glyphs[number] = replace(self._glyph(number), place=place)
        self._given(number, partner.vertices)
        if before != NOBODY:
            self._glyphs[before] = replace(self._glyph(before), after=number)
        if after != NOBODY:
            self._glyphs[after] = replace(self._glyph(after), before=number)
        self._glyphs[number] = replace(self._glyph(number), before=before, after=after)

    def _part(self, number: int) -> None:
        """Let nothing come after a glyph."""
        if number == NOBODY:
            return
        glyph = self._glyphs[number]
        if glyph is None:
            return
        if glyph.after != NOBODY:
            self._glyphs[glyph.after] = replace(self._glyph(glyph.after), before=NOBODY)
        self._glyphs[number] = replace(glyph, after=NOBODY, ligatures=())

    def _rejoin(self, number: int) -> None:
        """Find the ligatures of a glyph, and of the one before it, again."""
        if self._page not in self._finders:
            self._finders[self._page] = LigatureFinder(self._scan, self._owner)
        joining = self._finders[self._page]
        for left in (number, self._glyph(number).before):
            if left != NOBODY and self._glyph(left).after != NOBODY:
                glyph = self._glyph(left)
                self._glyphs[left] = replace(glyph, ligatures=joining.between(left, glyph.after, glyph.line))

    def _crossed(self, a: Array, b: Array) -> tuple[int, NDArray[np.bool_]]:
        """The glyph that a line crosses nearest to its middle, and which edges of the page are its and are crossed."""
        uv, edges = self._scan.graph.uv, self._scan.graph.edges
        p, q = uv[edges[:, 0]], uv[edges[:, 1]]
        across = (_side(a, b, p) > 0) != (_side(a, b, q) > 0)
        across &= _side(p, q, a) * _side(p, q, b) <= 0
        same = self._owner[edges[:, 0]] == self._owner[edges[:, 1]]
        within = np.flatnonzero(across & same & (self._owner[edges[:, 0]] != NOBODY))
        if not len(within):
            raise CorrectionError(
                f"the line from ({a[0]:g}, {a[1]:g}) to ({b[0]:g}, {b[1]:g}) does not cross the inside of a letter"
            )
        away = np.linalg.norm((p[within] + q[within]) / 2 - (a + b) / 2, axis=1)
        number = int(self._owner[edges[within[int(away.argmin())], 0]])
        crossed = np.zeros(len(edges), dtype=bool)
        crossed[within] = self._owner[edges[within, 0]] == number
        return number, crossed

    def _parts(self, number: int, crossed: NDArray[np.bool_], a: Array, b: Array) -> tuple[Indices, Indices]:
        """The vertices of a glyph on the two sides of a cut, the left part first."""
        graph, vertices = self._scan.graph, self._glyph(number).vertices
        inside = (self._owner[graph.edges] == number).all(axis=1)
        piece = _pieces(graph.edges[inside & ~crossed], len(graph))
        cut = graph.edges[crossed]
        if (piece[cut[:, 0]] == piece[cut[:, 1]]).any():
            raise CorrectionError(
                f"the line does not part {self._glyph(number).letter!r}: what it cuts still hangs together elsewhere; "
                "draw it across every stroke between the parts"
            )
        right = _side(a, b, graph.uv) > 0
        held: dict[int, bool] = {int(piece[v]): bool(right[v]) for v in cut.ravel().tolist()}
        for loose in set(piece[vertices].tolist()) - set(held):
            held[loose] = bool(np.mean(right[vertices[piece[vertices] == loose]]) > 0.5)
        on = np.array([held[int(n)] for n in piece[vertices].tolist()])
        parts = sorted((vertices[on], vertices[~on]), key=lambda part: float(graph.uv[part, 0].mean()))
        return readonly_indices(parts[0], None), readonly_indices(parts[1], None)


def _one_letter(text: str) -> str:
    if len(regex.findall(r"\X", text)) != 1 or text.isspace():
        raise CorrectionError(f"text {text!r} is not one letter")
    return text


def _pieces(edges: Indices, count: int) -> Indices:
    """(count,) number of the connected piece of every vertex."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    a, b = edges.T
    joined = coo_matrix((np.ones(len(a), np.int8), (a, b)), shape=(count, count))
    return np.asarray(connected_components(joined, directed=False)[1], dtype=np.intp)


def _side(a: Array, b: Array, c: Array) -> Array:
    """Positive where c lies on one side of the line through a and b, negative on the other; rows of points."""
    ab, ac = b - a, c - a
    return np.asarray(ab[..., 0] * ac[..., 1] - ab[..., 1] * ac[..., 0])


def _halves(place: Place) -> tuple[Place, Place]:
    """Places of the two letters that one is parted into."""
    return "start" if place in ("start", "alone") else "middle", "end" if place in ("end", "alone") else "middle"


def _whole(place: Place, other_place: Place, in_order: bool) -> Place:
    """The place of a letter made of two that follow each other."""
    first, last = (place, other_place) if in_order else (other_place, place)
    begins, ends = first in ("start", "alone"), last in ("end", "alone")
    return "alone" if begins and ends else "start" if begins else "end" if ends else "middle"
