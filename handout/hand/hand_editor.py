"""A scanned hand while it is being corrected: its glyphs in a list that changes, found by places on a page.

A letter that is named is a letter of the page's transcript: the one of that name on its line whose place is nearest,
between the letters that are confirmed on its left and on its right.  Unassigned ink that is named may belong to any of
the nearest lines.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import regex
from numpy.typing import NDArray

from handout import units
from handout.branching import number_pieces
from handout.hand import page_editor, resegmentation
from handout.hand.ligatures import LigatureFinder
from handout.hand.page_editor import PaintError
from handout.hand.places import Place, graphemes, places, word_numbers
from handout.hand.scanned import NOBODY, ScannedGlyph, ScannedHand, ScannedPage
from handout.libraries import csgraph, sparse, spatial
from handout.values import Array, Indices, readonly_indices

if TYPE_CHECKING:
    from scipy.spatial import cKDTree

_NEAR = 1.0  # mm from a place to the ink it means
_FARTHEST = 3.0  # mm between two ends that are joined: a pen that skipped further did not write
_NO_SCAN = (
    "This hand keeps no scan of the page, so painting moves only the ink under the brush, and painted ink has the "
    "page's usual colour; a hand that is read anew keeps it."
)
# both set by eye: x-heights by which a line may be further from some ink than the nearest, a third of what lies between
# lines; and what a letter costs in x-heights off its line for each that it lies aside of its place
_AS_NEAR, _ASIDE = 1.0, 0.25
_MOST_BRUSH = 20.0  # mm: wider brushes would take lines of writing

Spot = tuple[float, float]


class CorrectionError(Exception):
    """A correction cannot be made; its text says why."""


class HandEditor:
    """The glyphs of a hand under correction; a glyph that is gone is None until the numbers are closed up."""

    def __init__(self, hand: ScannedHand, strict: bool = True) -> None:
        self._hand = hand
        self._strict = strict
        self._pages = list(hand.pages)
        self._glyphs: list[ScannedGlyph | None] = list(hand.glyphs)
        self._order = list(range(len(hand.glyphs)))
        self._owners: dict[int, Indices] = {}
        self._trees: dict[int, cKDTree] = {}
        self._finders: dict[int, LigatureFinder] = {}
        self._page = 0
        self.notes: list[str] = []
        self.removed: set[tuple[int, int]] = set()

    def finish(self) -> ScannedHand:
        """The corrected hand, its glyphs numbered in the order of writing; what was named by hand comes last."""
        numbers = [i for i in self._order if self._glyphs[i] is not None]
        number = {old: new for new, old in enumerate(numbers)} | {NOBODY: NOBODY}
        numbered = tuple(self._glyph(i).with_neighbours(number) for i in numbers)
        return replace(self._hand, pages=tuple(self._pages), glyphs=numbered)

    def turn_to(self, page: int) -> None:
        """Let the places that follow be on that page."""
        count = len(self._hand.pages)
        if not 0 <= page < count:
            raise CorrectionError(f"there is no such page; the hand has {count}, numbered from 0")
        self._page = page
        if page not in self._owners:
            owner = np.full(len(self._scan.graph), NOBODY, dtype=np.intp)
            for i, glyph in self._on_this_page():
                owner[glyph.vertices] = i
            self._owners[page] = owner

    def label(self, at: Spot, text: str, place: Place | None) -> None:
        """Name a letter, or make one of writing that belongs to none."""
        _one_letter(text)
        vertex = self._vertex(at)
        number = int(self._owner[vertex])
        if number == NOBODY:
            self._new(self._loose(vertex), text, place)
        else:
            self._name_letter(number, text, place)

    def confirm(self, at: Spot, text: str | None, kept_out: bool | None = None) -> None:
        """Let the letter at `at` be sure; `kept_out` : whether it is left unwritten from now on, None: as before."""
        number = self._number(at)
        glyph = self._glyph(number)
        if not glyph.letter:
            raise CorrectionError("what is there has no name yet: label it")
        if text is not None and text != glyph.letter:
            raise CorrectionError(f"what is there is called {glyph.letter!r}, not {text!r}: label it")
        kept_out = glyph.kept_out if kept_out is None else kept_out
        self._glyphs[number] = replace(glyph, confidence=1.0, confirmed=True, kept_out=kept_out)

    def letter(self, within: Sequence[Spot], text: str) -> None:
        """Let the writing inside a polygon be one letter, whosever it was."""
        _one_letter(text)
        if len(within) < 3:
            raise CorrectionError(f"{len(within)} corners make no polygon; give three or more")
        for corner in within:
            self._on_page(corner)
        inside = page_editor.fill_polygon(self._scan, within).covers_places(self._scan.graph.uv)
        if not inside.any():
            x, y = np.mean(np.array(within), axis=0)
            raise CorrectionError(f"no writing inside the polygon around ({x:g}, {y:g})")
        vertices = np.flatnonzero(inside)
        for number, glyph in self._on_this_page():
            left = np.setdiff1d(glyph.vertices, vertices)
            if len(left) == len(glyph.vertices):
                continue
            if len(left):
                self._glyphs[number] = replace(self._glyph(number), vertices=left, confirmed=False, kept_out=False)
            else:
                self._part(self._glyph(number).before)
                self._part(number)
                self._glyphs[number] = None
        self._owner[vertices] = NOBODY
        self._new(vertices, text, None, taking=True)

    def merge(self, at: Spot, other: Spot, text: str | None) -> None:
        """Give what is at `other` to the letter at `at`."""
        number, vertex = self._number(at), self._vertex(other)
        second = int(self._owner[vertex])
        if second == number:
            raise CorrectionError(f"both places are on one letter, {self._glyph(number).letter!r}, already")
        letter = self._glyph(number).letter if text is None else _one_letter(text)
        if second == NOBODY:
            self._give_ink(number, self._loose(vertex))
        else:
            self._unite_glyphs(number, second)
        self._name_letter(number, letter, None)
        self._rejoin(number)

    def split_letter(self, a: Spot, b: Spot, texts: tuple[str, str] | None) -> None:
        """Part the letter that the line from `a` to `b` crosses."""
        for text in texts or ():
            _one_letter(text)
        for end in (a, b):
            self._on_page(end)
        number, edges = self._find_crossed(np.array(a), np.array(b))
        first, second = self._parts(number, edges, np.array(a), np.array(b))
        glyph = self._glyph(number)
        names = texts or ((glyph.letter, "") if len(first) >= len(second) else ("", glyph.letter))
        new = len(self._glyphs)
        self._order.insert(self._order.index(number) + 1, new)
        self._owner[second] = new
        sure = replace(glyph, confidence=1.0, confirmed=False, kept_out=False, ligatures=())
        # the places of the two parts
        halves: tuple[Place, Place] = (
            "start" if glyph.place in ("start", "alone") else "middle",
            "end" if glyph.place in ("end", "alone") else "middle",
        )
        self._glyphs[number] = replace(sure, letter=names[0], vertices=first, after=new, place=halves[0])
        at = NOBODY if names[1] != glyph.letter else glyph.at
        self._glyphs.append(replace(sure, letter=names[1], vertices=second, before=number, place=halves[1], at=at))
        if glyph.after != NOBODY:
            self._glyphs[glyph.after] = replace(self._glyph(glyph.after), before=new)
        for part, name, half in zip((number, new), texts or (), halves, strict=False):
            self._name_letter(part, name, half)
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
        for i, other in self._on_this_page():  # what was ink of both is that one's
            self._owner[np.intersect1d(other.vertices, glyph.vertices)] = i
        self.removed.add((self._page, glyph.at))
        gone = glyph.vertices[self._owner[glyph.vertices] == NOBODY]
        self._scan = replace(self._scan, dismissed=np.union1d(self._scan.dismissed, gone))

    def unlink(self, at: Spot) -> None:
        """Cut what leads from a letter to the next."""
        number = self._number(at)
        glyph = self._glyph(number)
        if not glyph.ligatures:
            raise CorrectionError(f"{glyph.letter!r} there is not joined to a next letter")
        owner = np.sort(self._owner[self._scan.graph.edges], axis=1)
        self._cut_edges((owner == sorted((number, glyph.after))).all(axis=1))

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
        self._join_nearest(self._glyph(number).vertices, self._glyph(second).vertices, _NEAR)
        self._rejoin(number)

    def place(self, at: Spot, place: Place) -> None:
        """Say where in its word a letter is."""
        number = self._number(at)
        self._glyphs[number] = replace(self._glyph(number), place=place)

    def strokes(self, at: Spot, ways: Sequence[Sequence[Spot]]) -> None:
        """Say along which places the strokes of a letter were written, in order."""
        number = self._number(at)
        glyph, graph = self._glyph(number), self._scan.graph
        if not ways or not all(len(way) for way in ways):
            raise CorrectionError("a stroke needs places: give those that the pen passed, in order")
        found = tuple(page_editor.vertices_along(graph, glyph.vertices, np.array(way)) for way in ways)
        for way, path in zip(ways, found, strict=True):
            away = np.linalg.norm(graph.uv[path[0]] - np.array(way[0])) * self._scan.pixel
            if away > _FARTHEST:
                raise CorrectionError(f"a stroke begins {away:.1f} mm from the ink of {glyph.letter!r}")
        self._glyphs[number] = replace(glyph, ways=found)

    def paint_paper(self, cover: Sequence[Spot], width: float | None) -> None:
        """Take away the ink under a brush `width` pixels wide, or inside a polygon."""
        self._check_brush(cover, width)
        scan = self._scan
        under = page_editor.fill_polygon(scan, cover) if width is None else page_editor.brush(scan, cover, width)
        confirmed = [glyph.vertices for _, glyph in self._on_this_page() if glyph.confirmed]
        held = np.concatenate([np.zeros(0, dtype=np.intp), *confirmed])
        segmented = resegmentation.without_ink(scan, under, held) if scan.scan is not None else None
        try:
            self._take_page(*(segmented or page_editor.as_paper(scan, under)), adopting=segmented is not None)
        except PaintError as error:
            raise CorrectionError(f"{error} at ({cover[0][0]:g}, {cover[0][1]:g})") from error

    def paint_ink(self, stroke: Sequence[Spot], width: float) -> None:
        """Put ink along a brush `width` pixels wide."""
        self._check_brush(stroke, width)
        scan = self._scan
        segmented = resegmentation.with_ink(scan, stroke, width) if scan.scan is not None else None
        self._take_page(*(segmented or page_editor.as_ink(scan, stroke, width)), adopting=segmented is not None)
        if scan.scan is None:
            self.notes.append(_NO_SCAN)
        elif segmented is None:
            self.notes.append("Where it was painted the scan shows no more ink, so it has the page's usual colour.")

    def rule(self, a: Spot, b: Spot, width: float) -> None:
        """Take away a printed rule that was taken for ink, and its likes."""
        self._check_brush((a, b), width)
        try:
            page, number, count = page_editor.without_rule(self._scan, a, b, width)
        except PaintError as error:
            raise CorrectionError(f"{error} from ({a[0]:g}, {a[1]:g}) to ({b[0]:g}, {b[1]:g})") from error
        self._take_page(page, number)
        if count > 1:
            self.notes.append(f"{units.count(count - 1, 'rule')} like the one that was corrected went with it.")

    def baseline(self, line: int, a: Spot, b: Spot) -> None:
        """Let the baseline of a line run through two places."""
        for end in (a, b):
            self._on_page(end)
        if not 0 <= line < len(self._scan.baselines):
            raise CorrectionError(f"there is no line {line}; the page has {len(self._scan.baselines)}, from 0")
        if abs(a[0] - b[0]) < self._scan.x_height / self._scan.pixel:
            raise CorrectionError("the two places lie above each other: a baseline runs along a line")
        self._scan = page_editor.on_baseline(self._scan, line, a, b)
        for i, glyph in self._on_this_page():
            if glyph.line == line and glyph.ligatures:
                ways = tuple(self._scan.ligature(line, way.path) for way in glyph.ligatures)
                self._glyphs[i] = replace(glyph, ligatures=ways)

    def cut_strokes(self, a: Spot, b: Spot) -> None:
        """Cut every stroke that the line from `a` to `b` crosses; the letters keep what they have."""
        for end in (a, b):
            self._on_page(end)
        across = self._edges_across(np.array(a), np.array(b))
        if not across.any():
            raise CorrectionError(f"the line from ({a[0]:g}, {a[1]:g}) to ({b[0]:g}, {b[1]:g}) crosses no stroke")
        self._cut_edges(across)

    def join(self, at: Spot, other: Spot) -> None:
        """Join the stroke at one place to the stroke at another."""
        one, second = self._vertex(at), self._vertex(other)
        edges = np.sort(self._scan.graph.edges, axis=1)
        if one == second or (edges == sorted((one, second))).all(axis=1).any():
            raise CorrectionError("both places are on one stroke, that hangs together already")
        uv = self._scan.graph.uv
        away = float(np.linalg.norm(uv[one] - uv[second])) * self._scan.pixel
        if away > _FARTHEST:
            raise CorrectionError(f"the two places are {away:.1f} mm apart; strokes within {_FARTHEST:g} mm are joined")
        self._scan = page_editor.join_vertices(self._scan, one, second)
        self._rejoin_some({int(self._owner[one]), int(self._owner[second])} - {NOBODY})

    @property
    def _scan(self) -> ScannedPage:
        return self._pages[self._page]

    @_scan.setter
    def _scan(self, page: ScannedPage) -> None:
        self._pages[self._page] = page

    @property
    def _owner(self) -> Indices:
        """(n,) the glyph of every vertex of the page."""
        return self._owners[self._page]

    @property
    def _tree(self) -> spatial.cKDTree:
        """The vertices of the page."""
        if self._page not in self._trees:
            self._trees[self._page] = spatial.cKDTree(self._scan.graph.uv)
        return self._trees[self._page]

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
        away, vertex = self._tree.query(at)
        if not away * self._scan.pixel <= _NEAR:
            near = f"the nearest is {away * self._scan.pixel:.1f} mm away" if np.isfinite(away) else "there is none"
            raise CorrectionError(f"no writing within {_NEAR:g} mm of ({at[0]:g}, {at[1]:g}); {near}")
        return int(vertex)

    def _number(self, at: Spot) -> int:
        """The glyph at a place: the nearest ink within reach."""
        self._on_page(at)
        near = self._tree.query_ball_point(at, _NEAR / self._scan.pixel)
        owned = [v for v in near if self._owner[v] != NOBODY]
        if not owned:
            raise CorrectionError(f"no letter within {_NEAR:g} mm of ({at[0]:g}, {at[1]:g})")
        away = np.linalg.norm(self._scan.graph.uv[owned] - np.array(at), axis=1)
        return int(self._owner[owned[int(away.argmin())]])

    def _loose(self, vertex: int) -> Indices:
        """The unassigned vertices that are connected to a given one."""
        loose = self._owner == NOBODY
        edges = self._scan.graph.edges
        piece = number_pieces(edges[loose[edges].all(axis=1)], len(loose))
        return np.flatnonzero(loose & (piece == piece[vertex]))

    def _new(self, vertices: Indices, text: str, place: Place | None, taking: bool = False) -> None:
        """Make a letter of loose vertices: one that the transcript lacks there, or else an additional one.

        taking : it may be one that other ink was taken for.
        """
        # Of the lines that are about as near, take the one whose text has the letter there: where a baseline is off by
        # half a line the nearest may be a neighbour's, whose letter of that name would be moved across the page.
        page, unit = self._scan, self._scan.x_height / self._scan.pitch
        x, y = page.graph.uv[vertices].mean(axis=0)
        off = np.array([abs(page.to_line(i, (x, y))[0, 1] / unit - 0.5) for i in range(len(page.baselines))])
        near = np.flatnonzero(off <= off.min() + _AS_NEAR).tolist()
        found = {line: self._nearest(line, float(x), text, not taking, NOBODY) for line in near}
        costs = {line: off[line] + _ASIDE * one[1] for line, one in found.items() if one is not None}
        line = int(min(costs, key=costs.__getitem__) if costs else off.argmin())
        word = max((g.word for g in self._glyphs if g is not None and g.page == self._page), default=-1) + 1
        number = len(self._glyphs)
        self._owner[vertices] = number
        self._order.append(number)
        glyph = ScannedGlyph(text, place or "alone", self._page, line, word, NOBODY, vertices, confirmed=True)
        self._glyphs.append(glyph)
        self._scan = replace(self._scan, dismissed=np.setdiff1d(self._scan.dismissed, vertices))
        if taking or self._grapheme(number, text, missing=True) is not None:
            self._name_letter(number, text, place)

    def _name_letter(self, number: int, text: str, place: Place | None) -> None:
        """Let a glyph be the letter `text` of the transcript, which other ink is then no longer."""
        glyph = self._glyph(number)
        at = glyph.at
        if text != glyph.letter or at == NOBODY:
            found = self._grapheme(number, text)
            if found is None and self._strict:
                raise CorrectionError(self._not_there(glyph.line, text))
            at, glyph = NOBODY if found is None else found, replace(glyph, kept_out=False)
        written = graphemes(self._scan.transcript)
        for i, other in self._on_this_page():
            if i != number and other.at == at != NOBODY:
                self._glyphs[i] = replace(other, letter="", at=NOBODY, confidence=0.0, confirmed=False, kept_out=False)
        usual = places(written)[at] if at >= 0 else glyph.place
        if at >= 0:
            glyph = replace(glyph, word=word_numbers(written)[at])
        self._glyphs[number] = replace(glyph, letter=text, at=at, place=place or usual, confidence=1.0, confirmed=True)

    def _grapheme(self, number: int, text: str, missing: bool = False) -> int | None:
        """Index in the transcript of the letter `text` that a glyph can be, None if there is none.

        missing : only one that no ink was taken for.
        """
        glyph = self._glyph(number)
        x = float(self._scan.graph.uv[glyph.vertices, 0].mean())
        found = self._nearest(glyph.line, x, text, missing, number)
        return None if found is None else found[0]

    def _nearest(self, line: int, x: float, text: str, missing: bool, number: int) -> tuple[int, float] | None:
        """The letter `text` of a line that ink at `x` can be, by its index, and x-heights to where it is expected.

        number : of the glyph that has the ink, `NOBODY` if it is none yet.
        """
        others = [(i, g) for i, g in self._on_this_page() if i != number]
        on_line = [(g.at, float(self._scan.graph.uv[g.vertices, 0].mean()), g.confirmed) for _, g in others
                   if g.line == line and g.at >= 0]  # fmt: skip
        written = graphemes(self._scan.transcript)
        elsewhere = [(g.at, g.line) for _, g in self._on_this_page() if g.at >= 0 and g.line != line]
        low = max([at for at, there, sure in on_line if sure and there < x]
                  + [at for at, on in elsewhere if on < line], default=-1)  # fmt: skip
        high = min([at for at, there, sure in on_line if sure and there > x]
                   + [at for at, on in elsewhere if on > line], default=len(written))  # fmt: skip
        held = {g.at for _, g in others if g.confirmed or missing}
        fitting = [at for at in range(low + 1, high) if written[at] == text and at not in held]
        if not fitting:
            return None
        known = np.array(sorted((at, there) for at, there, _ in on_line)).reshape(-1, 2)
        if not len(known):
            return fitting[0], 0.0
        away = np.abs(np.interp(fitting, known[:, 0], known[:, 1]) - x) * self._scan.pixel / self._scan.x_height
        best = int(away.argmin())
        return fitting[best], float(away[best])

    def _not_there(self, line: int, text: str) -> str:
        """Why a letter of the transcript cannot be named so."""
        written = graphemes(self._scan.transcript)
        own = sorted(g.at for _, g in self._on_this_page() if g.line == line and g.at >= 0)
        quoted = "".join(written[own[0] : own[-1] + 1]) if own else ""
        return (
            f"the transcript of line {line + 1}, “{' '.join(quoted.split())}”, has no {text!r} that could be there; "
            "where the author wrote something else, remove the letter first and then label its ink"
        )

    def _on_this_page(self) -> list[tuple[int, ScannedGlyph]]:
        return [(i, g) for i, g in enumerate(self._glyphs) if g is not None and g.page == self._page]

    def _check_brush(self, places_: Sequence[Spot], width: float | None) -> None:
        """Raise CorrectionError for a brush off the page, or one that is too wide, or of no way."""
        if not places_ or (width is None and len(places_) < 3):
            raise CorrectionError("a brush needs a place, a polygon three")
        height, wide = self._scan.shape
        for x, y in places_:
            if not (0 <= x < wide and 0 <= y < height):
                raise CorrectionError(f"({x:g}, {y:g}) is off the page: the scan has {wide} x {height} pixels")
        if self._scan.moments is not None:
            raise CorrectionError("the page was recorded from a pen, so nothing was taken for ink that is none")
        if width is not None and not 1.0 <= width <= _MOST_BRUSH / self._scan.pixel:
            most = _MOST_BRUSH / self._scan.pixel
            raise CorrectionError(f"a brush {width:g} pixels wide is outside 1 to {most:.0f}")

    def _take_page(self, page: ScannedPage, number: Indices, adopting: bool = False) -> None:
        """Take a changed page; (n,) the new number of each old vertex, −1 if it is gone.

        adopting : what is new belongs to the letter that it hangs together with.
        """
        cut: list[int] = []
        same = np.array_equal(number, np.arange(len(number)))
        for i, _ in [] if same else self._on_this_page():
            glyph = self._glyph(i)
            left = number[glyph.vertices]
            left = np.sort(left[left >= 0])
            if len(left):
                ways = [number[way.path] for way in glyph.ligatures]
                if all((way >= 0).all() for way in ways):
                    known = tuple(replace(way, path=path) for way, path in zip(glyph.ligatures, ways, strict=True))
                else:
                    known, cut = (), [*cut, i]
                said = tuple(number[way] for way in glyph.ways)
                said = said if all((way >= 0).all() for way in said) else ()
                self._glyphs[i] = replace(glyph, vertices=left, ligatures=known, ways=said)
            else:
                self._part(glyph.before)
                self._part(i)
                self._glyphs[i] = None
        self._scan = page
        self._owners.pop(self._page)
        self._trees.pop(self._page, None)
        self.turn_to(self._page)
        new = np.ones(len(page.graph), dtype=bool)
        new[number[number >= 0]] = False
        adopted = self._adopt_vertices(new) if adopting else set()
        self._rejoin_some({i for i in cut if self._glyphs[i] is not None} | adopted)

    def _adopt_vertices(self, new: NDArray[np.bool_]) -> set[int]:
        """Give each of some vertices (n,) to the letter that is nearest along their line; the letters that got any."""
        uv, edges = self._scan.graph.uv, self._scan.graph.edges
        near, at = np.unique(edges[new[edges].any(axis=1)], return_inverse=True)
        a, b = at.reshape(-1, 2).T
        ends = np.flatnonzero(self._owner[near] != NOBODY)
        if not len(ends):
            return set()
        length = np.linalg.norm(uv[near[a]] - uv[near[b]], axis=1) + 1e-6
        line = sparse.coo_matrix((length, (a, b)), shape=(len(near), len(near)))
        _, _, nearest = csgraph.dijkstra(line, directed=False, indices=ends, return_predecessors=True, min_only=True)
        found = np.flatnonzero(new[near] & (nearest >= 0))
        reached, owners = near[found], self._owner[near[nearest[found]]]
        for number in np.unique(owners).tolist():
            self._give_ink(number, reached[owners == number])
        return set(owners.tolist())

    def _cut_edges(self, edges: NDArray[np.bool_]) -> None:
        beside = set(self._owner[self._scan.graph.edges[edges]].ravel().tolist()) - {NOBODY}
        self._scan = page_editor.cut_edges(self._scan, edges)
        self._rejoin_some(beside)

    def _join_nearest(self, first: Indices, second: Indices, most: float) -> None:
        """Put an edge where two letters that do not hang together come nearest, if that is within `most` mm."""
        owner = np.sort(self._owner[self._scan.graph.edges], axis=1)
        pair = sorted((int(self._owner[first[0]]), int(self._owner[second[0]])))
        if (owner == pair).all(axis=1).any():
            return
        uv = self._scan.graph.uv
        away, index = spatial.cKDTree(uv[second]).query(uv[first])
        if away.min() * self._scan.pixel <= most:
            nearest = int(away.argmin())
            self._scan = page_editor.join_vertices(self._scan, int(first[nearest]), int(second[index[nearest]]))
            self._finders.pop(self._page, None)

    def _rejoin_some(self, numbers: set[int]) -> None:
        """Find the ligatures of some glyphs, and towards them, again on a graph that has changed."""
        self._finders.pop(self._page, None)
        for number in sorted(numbers):
            self._rejoin(number)

    def _edges_across(self, a: Array, b: Array) -> NDArray[np.bool_]:
        """(m,) which edges of the page the line from `a` to `b` crosses."""
        uv, edges = self._scan.graph.uv, self._scan.graph.edges
        p, q = uv[edges[:, 0]], uv[edges[:, 1]]
        across = (_side(a, b, p) > 0) != (_side(a, b, q) > 0)
        return np.asarray(across & (_side(p, q, a) * _side(p, q, b) <= 0))

    def _give_ink(self, number: int, vertices: Indices) -> None:
        glyph = self._glyph(number)
        self._owner[vertices] = number
        self._glyphs[number] = replace(glyph, vertices=np.union1d(glyph.vertices, vertices))

    def _unite_glyphs(self, number: int, second: int) -> None:
        """Glyph `second` is taken up by glyph `number`; in a word the outer neighbours of both remain."""
        glyph, partner = self._glyph(number), self._glyph(second)
        adjoining = glyph.after == second or partner.after == number
        before, after = glyph.before, glyph.after
        if glyph.after == second:
            after = partner.after
        elif partner.after == number:
            before = partner.before
        place = glyph.place
        if adjoining:
            first, last = (glyph, partner) if glyph.after == second else (partner, glyph)
            begins, ends = first.place in ("start", "alone"), last.place in ("end", "alone")
            place = "alone" if begins and ends else "start" if begins else "end" if ends else "middle"
        for beside in (glyph.before, number, partner.before, second):
            self._part(beside)
        self._glyphs[second] = None
        self._glyphs[number] = replace(self._glyph(number), place=place)
        self._give_ink(number, partner.vertices)
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
                self._glyphs[left] = replace(glyph, ligatures=joining.ligatures_between(left, glyph, glyph.after))

    def _find_crossed(self, a: Array, b: Array) -> tuple[int, NDArray[np.bool_]]:
        """The glyph that a line crosses nearest to its middle, and which edges of the page are its and are crossed."""
        uv, edges = self._scan.graph.uv, self._scan.graph.edges
        p, q = uv[edges[:, 0]], uv[edges[:, 1]]
        across = self._edges_across(a, b)
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
        piece = number_pieces(graph.edges[inside & ~crossed], len(graph))
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


def _side(a: Array, b: Array, c: Array) -> Array:
    """Positive where c lies on one side of the line through a and b, negative on the other; rows of points."""
    ab, ac = b - a, c - a
    return np.asarray(ab[..., 0] * ac[..., 1] - ab[..., 1] * ac[..., 0])
