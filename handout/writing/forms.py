"""Forms: the line of each glyph's body, with the connectors to its neighbours, extracted from a scanned hand's pages.

A form lies in line space with the glyph's centre at the origin, so that it can be set anywhere.  `ExtractedStrokes`
takes the lines of all glyphs off their pages in one go, one glyph's after the other's; there glyphs and vertices are
told apart by one number, glyph · vertices + vertex, with the vertices of all pages counted through, so that whole
hands are compared by sorting.  `tails` estimates how much of a connector remains where no letter joins it, and
`targets` finds the points that the strokes of a body aim at.

Source: seed 000, §6.3, §6.4; seed 002, §3.2 (key points).
"""

from __future__ import annotations

import unicodedata
from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import dataclass
from functools import cached_property, lru_cache
from operator import itemgetter
from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from handout.branching import branches
from handout.hand.learnt import learnt
from handout.hand.letter_classes import DOTTED, LOWERCASE
from handout.hand.measures import mean_x_height
from handout.hand.scanned import NOBODY, ScannedHand, stretches
from handout.peaks import peaks
from handout.values import Array, Indices, readonly_indices


class LineVertices(NamedTuple):
    """Vertices of one line; see `Lines`."""

    xy: Array
    radius: Array
    density: Array
    uv: Array


@dataclass(frozen=True, eq=False)
class Lines:
    """Vertices of many lines, in line space from their glyphs' centres.

    first : (lines + 1,) int: where each line begins, and where the last one ends.
    xy, radius, density, uv : as in `values.LineGraph`.
    """

    first: Indices
    xy: Array
    radius: Array
    density: Array
    uv: Array

    @property
    def count(self) -> Indices:
        """(lines,): how many vertices each has."""
        return np.diff(self.first)

    def extend(self, more: Lines) -> Lines:
        """These and more of them."""
        both = ((getattr(self, name), getattr(more, name)) for name in ("xy", "radius", "density", "uv"))
        return Lines(np.append(self.first, self.first[-1] + more.first[1:]), *map(np.concatenate, both))

    def __getitem__(self, line: int) -> LineVertices:
        part = slice(self.first[line], self.first[line + 1])
        return LineVertices(self.xy[part], self.radius[part], self.density[part], self.uv[part])


@dataclass(frozen=True, eq=False)
class Connectors:
    """The ways that leave the glyphs of a hand, or those that come to them, sorted by glyph.

    lines : of each way, from the letter on the left to the one on the right.
    of : (ways,) int: the glyph that has it.
    away : (vertices,) int: how many vertices of its way are between each and the glyph's body.
    owned : (ways,) int: how many of its vertices belong to the glyph, counted from its body outwards; one at least.
    anchor : (ways,) int: the vertex of the glyph's body that it begins (ends) at.
    """

    lines: Lines
    of: Indices
    away: Indices
    owned: Indices
    anchor: Indices

    def extend(self, more: Connectors, glyphs: int) -> Connectors:
        """These and those of glyphs that come after the `glyphs` whose these are."""
        parts = (np.append(getattr(self, name), getattr(more, name)) for name in ("away", "owned", "anchor"))
        return Connectors(self.lines.extend(more.lines), np.append(self.of, more.of + glyphs), *parts)

    def are_within(self, reach: Indices) -> NDArray[np.bool_]:
        """(vertices,): which are among the first so many (ways,) of their way, counted from the glyph's body."""
        return np.asarray(self.away < np.repeat(reach, self.lines.count))


class ExtractedStrokes:
    """The bodies of all glyphs of a hand, and the ways between them.

    ways : glyph → the paths of its ligatures to the next.
    centre : (n, 2) float, line space.

    bodies : Lines, one a glyph: what is not on the way to another, with the ends of those ways.
    entries, exits : Connectors
    """

    def __init__(self, hand: ScannedHand, ways: Mapping[int, tuple[Indices, ...]], centre: Array) -> None:
        self._hand, self._centre, self._paths = hand, centre, ways
        self._more: ExtractedStrokes  # where there are strokes of glyphs that come after these
        self._before = np.cumsum([0, *(len(page.graph) for page in hand.pages)])  # vertices of the pages before
        self._count = int(self._before[-1])
        self._owned = self._code_vertices(list(enumerate(_undotted(hand))))
        out = [(number, path) for number, paths in sorted(ways.items()) for path in paths]
        into = sorted(((hand.glyphs[number].after, path) for number, path in out), key=itemgetter(0))
        gone = self._code_vertices([(i, path[1:]) for i, path in out] + [(i, path[:-1]) for i, path in into])
        ends = self._code_vertices([(i, path[:1]) for i, path in out] + [(i, path[-1:]) for i, path in into])
        kept = self._owned[~_are_among(self._owned, np.sort(gone, kind="stable"))]
        # the distinct ones of what are mostly rising runs; `np.unique` hashes numbers, which takes ten times as long
        codes = np.sort(np.concatenate([kept, ends]), kind="stable")
        self._codes = codes[np.diff(codes, prepend=-1) > 0]
        self.bodies = self._lines(self._codes, np.searchsorted(self._codes, np.arange(len(centre) + 1) * self._count))
        self.exits, self.entries = self._strokes(out, leaving=True), self._strokes(into, leaving=False)

    def extend(self, more: ExtractedStrokes) -> ExtractedStrokes:
        """These and those of glyphs that come after them."""
        both, count = copy(self), len(self._centre)
        both._more, both.bodies = more, self.bodies.extend(more.bodies)
        both.exits, both.entries = self.exits.extend(more.exits, count), self.entries.extend(more.entries, count)
        return both

    def vertices(self, number: int) -> Indices:
        """(n,) int, rising: of a glyph's body, by their numbers on its page."""
        if number >= len(self._centre):
            return self._more.vertices(number - len(self._centre))
        codes = self._codes[self.bodies.first[number] : self.bodies.first[number + 1]]
        return np.asarray(codes % self._count - self._before[self._hand.glyphs[number].page])

    def edges(self, number: int) -> Indices:
        """(m, 2) int: the edges between vertices of a glyph's body, by their place in it, without those of its ways."""
        if number >= len(self._centre):
            return self._more.edges(number - len(self._centre))
        glyph, vertices = self._hand.glyphs[number], self.vertices(number)
        pairs = self._hand.pages[glyph.page].graph.edges_between(vertices)
        paths = (*self._paths.get(number, ()), *self._paths.get(glyph.before, ()))
        walked = np.concatenate([np.zeros((0, 2), np.intp), *(np.column_stack([way[:-1], way[1:]]) for way in paths)])
        own = _are_among(self._code_vertices([(number, vertices)]), self._owned)[pairs].all(axis=1)
        return np.asarray(pairs[own & ~_are_among(self._steps(vertices[pairs]), np.sort(self._steps(walked)))])

    def _code_vertices(self, lines: Sequence[tuple[int, Indices]]) -> Indices:
        """The numbers of the vertices of lines, each with the glyph that has it."""
        number = np.array([number for number, _ in lines], dtype=np.intp)
        page = np.array([glyph.page for glyph in self._hand.glyphs], dtype=np.intp)[number]
        codes = np.concatenate([np.zeros(0, dtype=np.intp), *(vertices for _, vertices in lines)])
        size = [len(vertices) for _, vertices in lines]
        return np.asarray(codes + np.repeat(number * self._count + self._before[page], size))

    def _steps(self, pairs: Indices) -> Indices:
        """(m,): one number for each pair of vertices (m, 2) of one page, the same in either order."""
        return np.asarray(np.minimum(*pairs.T) * self._count + np.maximum(*pairs.T))

    def _strokes(self, ways: Sequence[tuple[int, Indices]], *, leaving: bool) -> Connectors:
        codes, first = self._code_vertices(ways), np.cumsum([0, *(len(path) for _, path in ways)])
        begin, end, size = first[:-1], first[1:] - 1, np.diff(first)
        away = np.arange(len(codes)) - np.repeat(begin, size)
        if not leaving:
            away = np.repeat(size, size) - 1 - away
        theirs = np.where(_are_among(codes, self._owned), np.repeat(size, size), away)
        owned = np.maximum(np.minimum.reduceat(theirs, begin), 1) if len(begin) else size
        of = codes[begin] // self._count
        anchor = np.searchsorted(self._codes, codes[begin if leaving else end]) - self.bodies.first[of]
        return Connectors(self._lines(codes, first), of, away, owned, anchor)

    def _lines(self, codes: Indices, first: Indices) -> Lines:
        number, vertex = codes // self._count, codes % self._count
        row = np.array([glyph.line for glyph in self._hand.glyphs], dtype=np.intp)[number]
        page = np.array([glyph.page for glyph in self._hand.glyphs], dtype=np.intp)[number]
        place, uv = np.empty((2, len(codes), 2))
        radius, density = np.empty((2, len(codes)))
        for on, here in stretches(page):
            scan, vertices = self._hand.pages[on], vertex[here] - self._before[on]
            uv[here], density[here] = scan.graph.uv[vertices], scan.graph.density[vertices]
            place[here], radius[here] = scan.to_line(row[here], uv[here]), scan.graph.radius[vertices] / scan.pitch
        return Lines(first, place - self._centre[number], radius, density, uv)


def _are_among(codes: Indices, rising: Indices) -> NDArray[np.bool_]:
    """(n,): which codes occur in a sorted array of others; by search, since `np.isin` is slower here."""
    if not len(rising):
        return np.zeros(len(codes), dtype=bool)
    return np.asarray(rising[np.minimum(np.searchsorted(rising, codes), len(rising) - 1)] == codes)


VERSION = 1  # of what is kept of a hand; tests/hand/test_house_scanned.py says when to raise it
_DOT = 0.5  # x-heights: no dot is longer, or so near to a letter that it is of it
_OVER = 1.2  # x-heights over the baseline, where the dots of an i and the apostrophes of words are
_UNDOTTED = LOWERCASE - DOTTED


def _undotted(hand: ScannedHand) -> list[Indices]:
    """The vertices of each glyph without a dot or an apostrophe that another letter has lost to it.

    Of 5,500 glyphs of sixteen people (csafe, cvl) five have one, two of the three f of one of them among these.
    """
    kept = [glyph.vertices for glyph in hand.glyphs]
    lost = learnt(hand, "lost dots", VERSION, None, lambda: _lost_dots(hand)).astype(np.intp).reshape(-1, 2)
    for number in np.unique(lost[:, 0]).tolist():
        kept[number] = np.setdiff1d(kept[number], lost[lost[:, 0] == number, 1])
    return kept


def _lost_dots(hand: ScannedHand) -> Array:
    """(2 m,): the glyph and the vertex, m times, of dots that other letters have lost; see `_undotted`."""
    lost = [np.zeros((0, 2))]
    pieces = [hand.pages[glyph.page].graph.components[glyph.vertices] for glyph in hand.glyphs]
    first, joined = np.cumsum([0, *map(len, pieces)])[:-1], np.concatenate([np.zeros(0, dtype=np.intp), *pieces])
    for number in np.flatnonzero(np.minimum.reduceat(joined, first) < np.maximum.reduceat(joined, first)).tolist():
        glyph, piece_of = hand.glyphs[number], pieces[number]
        if glyph.letter not in _UNDOTTED:
            continue
        page, graph, own = hand.pages[glyph.page], hand.pages[glyph.page].graph, glyph.vertices
        unit, uv, radius = page.x_height / page.pixel, graph.uv[own], graph.radius[own] / page.pixel
        body = piece_of == np.bincount(piece_of).argmax()
        height = (page.base(glyph.line, uv[:, 0]) - uv[:, 1]) / unit
        for piece in np.unique(piece_of[~body]):
            dot = piece_of == piece
            away = (np.sqrt(square_distances(uv[dot], uv[body])) - radius[dot][:, None] - radius[body]).min() / unit
            if away > _DOT and height[dot].min() > _OVER and np.ptp(uv[dot], axis=0).max() < _DOT * unit:
                lost.append(np.column_stack([np.full(dot.sum(), number), own[dot]]))
    return np.concatenate(lost).ravel()


_ARM = 8  # vertices on either side, whose directions are compared
_BEND = 0.35  # rad that a bend must stand out
_BENDS_APART = 5  # vertices between two bends
_TARGETS_APART = 3.2  # half widths between two targets


def targets(xy: Array, radius: Array, edges: Indices) -> Array:
    """(k, 2): the targets of a line, none very near another.

    xy, radius, edges : as in `values.LineGraph`.
    """
    apart = _TARGETS_APART * float(np.median(radius))
    chosen: list[Array] = []
    for branch in branches(edges, len(xy)):
        line = xy[branch]
        for place in line[[0, len(line) - 1, *_bends(line)]]:
            if all(np.hypot(*(place - other)) > apart for other in chosen):
                chosen.append(place)
    return np.array(chosen)


def _bends(line: Array) -> list[int]:
    """Where a line (n, 2) bends most."""
    if len(line) < 2 * _ARM:
        return []
    arm = min(_ARM, len(line) // 4)
    ahead = line[arm:] @ np.array([1.0, 1j]) - line[:-arm] @ np.array([1.0, 1j])
    turned = np.abs(np.angle(ahead[arm:] * np.conj(ahead[:-arm])))
    return [int(peak) + arm for peak in peaks(turned, prominence=_BEND, apart=_BENDS_APART)]


_ENOUGH = 8  # instances of letters that occur both joined and free, from which on the length of tails is estimated


def tails(hand: ScannedHand, strokes: ExtractedStrokes) -> tuple[float, float]:
    """How much of the neighbour's half of a ligature a loose entry and a loose exit keep, each 0 to 1."""
    entry = _share(hand, strokes.bodies, strokes.entries, leaving=False)
    return entry, _share(hand, strokes.bodies, strokes.exits, leaving=True)


def _share(hand: ScannedHand, bodies: Lines, ways: Connectors, *, leaving: bool) -> float:
    letters = np.array([glyph.letter for glyph in hand.glyphs], dtype=np.str_)
    named = np.array([glyph.letter.isalpha() for glyph in hand.glyphs], dtype=bool)
    alone = np.array([(glyph.after if leaving else glyph.before) == NOBODY for glyph in hand.glyphs], dtype=bool)
    met = np.zeros(len(letters), dtype=bool)
    met[ways.of] = True
    free, joined = named & alone & ~met, named & met
    body, owned, whole = _widths(hand, bodies, ways, leaving)
    rows = []
    for letter in np.intersect1d(letters[free], letters[joined]):
        ended, led = (of & (letters == letter) for of in (free, joined))
        count = min(ended.sum(), led.sum())
        rows.append((count, np.median(body[ended]), np.median(owned[led]), np.median(whole[led])))
    counts, wanted, short, long = np.array(rows).reshape(-1, 4).T
    if counts.sum() < _ENOUGH:
        return 0.0
    return float(np.clip(counts @ (wanted - short) / max(counts @ (long - short), 1e-9), 0.0, 1.0))


def _widths(hand: ScannedHand, bodies: Lines, ways: Connectors, leaving: bool) -> Array:
    """(3, n) line space, upright: width of each body alone, with its half of its connectors, and with all of them."""
    slant = np.array([hand.pages[glyph.page].slant for glyph in hand.glyphs])
    letter, way = (
        (1 if leaving else -1) * (lines.xy[:, 0] - np.repeat(slant[of], lines.count) * lines.xy[:, 1])
        for lines, of in ((bodies, np.arange(len(slant))), (ways.lines, ways.of))
    )
    begin = bodies.first[:-1]
    ends = np.tile(np.maximum.reduceat(letter, begin), (3, 1))
    of, owned = np.repeat(ways.of, ways.lines.count), ways.are_within(ways.owned)
    np.maximum.at(ends[1], of[owned], way[owned])
    np.maximum.at(ends[2], of, way)
    thick = np.add.reduceat(bodies.radius, begin) / bodies.count
    return np.asarray(ends - np.minimum.reduceat(letter, begin) + 2 * thick)


_CLEAR = (
    0.25  # x-heights before the letter that a connector led to, where a loose one ends: beyond is that letter's ink
)


_TURN = 0.12  # x-heights that a loose connector may come back from its furthest; set by eye


@dataclass(frozen=True, eq=False)
class Connector:
    """One ligature as one of its two glyphs has it, from the letter on the left to the one on the right.

    xy, radius : (n, 2), (n,) float, line space, from the glyph's centre.
    density : (n,) float.
    uv : (n, 2) float, pixels of the glyph's picture.
    anchor : the vertex of the form's body at which the connector begins (ends).
    owned : how many of its vertices, counted from the anchor, belong to the glyph.
    loose : how many of its vertices remain where nothing joins it; see `tails`.
    height : of its middle over the source's baseline, line space.
    """

    xy: Array
    radius: Array
    density: Array
    uv: Array
    anchor: int
    owned: int
    loose: int
    height: float

    def __len__(self) -> int:
        return len(self.xy)

    @cached_property
    def share_along(self) -> Array:
        """(n,) float: how far each vertex is along the way, 0 to 1."""
        run = np.append(0.0, np.cumsum(np.maximum(np.hypot(*np.diff(self.xy, axis=0).T), 1e-12)))
        return np.asarray(run / run[-1])


@dataclass(frozen=True, eq=False)
class GlyphLine:
    """The line of one glyph; all lengths in line space, from its centre.

    xy, radius, density, uv, edges : as in `values.LineGraph`, of the body.
    entries, exits : the connectors from the glyph before and to the glyph after, from the lowest upwards.
    """

    xy: Array
    radius: Array
    density: Array
    uv: Array
    edges: Indices
    entries: tuple[Connector, ...]
    exits: tuple[Connector, ...]

    @cached_property
    def targets(self) -> Array:
        """(k, 2): what the hand aimed at in the body."""
        return targets(self.xy, self.radius, self.edges)

    @cached_property
    def whole(self) -> tuple[Array, Array]:
        """(n, 2), (n,): places and radii of the glyph where nothing joins it: its body and its loose connectors."""
        parts = [(self.xy, self.radius)]
        parts += [(way.xy[: way.loose], way.radius[: way.loose]) for way in self.exits]
        parts += [(way.xy[-way.loose :], way.radius[-way.loose :]) for way in self.entries]
        return np.concatenate([xy for xy, _ in parts]), np.concatenate([radius for _, radius in parts])


class Forms:
    """The forms of a hand, each taken off its page when it is first asked for.

    centre : (n, 2) float, line space of each glyph's own line: see `ScannedHand.centre`.
    marks : (n,) bool: what is neither a letter nor a digit.
    bodies : Lines: the bodies of all forms, one line each.
    paths : glyph → its connectors to the glyph after, as vertices of its page's graph.
    """

    def __init__(self, hand: ScannedHand) -> None:
        self.hand = hand
        self.centre = hand.centres
        self.marks = np.array([is_mark(glyph.letter) for glyph in hand.glyphs], dtype=bool)
        self.paths, self._extracted, self._loose = _extract_connectors(hand)
        self.bodies = self._extracted.bodies
        self._exits, self._entries = _group_ways(self._extracted.exits), _group_ways(self._extracted.entries)
        self._made: dict[int, GlyphLine] = {}

    def __len__(self) -> int:
        return len(self.centre)

    @property
    def of_author(self) -> Forms:
        """The forms of what the author wrote, without letters that were added."""
        return Forms(self.hand.author) if self.hand.author else self

    def __getitem__(self, number: int) -> GlyphLine:
        form = self._made.get(number)
        if form is None:
            form = self._made[number] = GlyphLine(
                *self.bodies[number],
                self._extracted.edges(number),
                tuple(self._way(self._extracted.entries, way, self._loose[0]) for way in self._entries.get(number, ())),
                tuple(self._way(self._extracted.exits, way, self._loose[1]) for way in self._exits.get(number, ())),
            )
        return form

    def _way(self, strokes: Connectors, way: int, loose: Indices) -> Connector:
        place, radius, density, uv = strokes.lines[way]
        height = float((place[0, 1] + place[-1, 1]) / 2 + self.centre[strokes.of[way], 1])
        anchor, owned = int(strokes.anchor[way]), int(strokes.owned[way])
        return Connector(place, radius, density, uv, anchor, owned, int(loose[way]), height)

    def vertices(self, number: int) -> Indices:
        """(n,) int, rising: the vertices of a form's body, by their numbers in the graph of its page."""
        return self._extracted.vertices(number)

    def connectors(self, *, leaving: bool) -> Connectors:
        """All ways out of the hand's glyphs, or all ways into them."""
        return self._extracted.exits if leaving else self._extracted.entries

    def ends(self) -> tuple[Array, Array]:
        """Twice (n, k, 2): y of the first and of the last vertex of each glyph's exits, and of its entries; nan where
        there are fewer."""
        both = []
        for strokes in (self._extracted.exits, self._extracted.entries):
            rank = np.arange(len(strokes.of)) - np.searchsorted(strokes.of, strokes.of)
            ends = np.full((len(self), int(rank.max(initial=0)) + 1, 2), np.nan)
            first, y = strokes.lines.first, strokes.lines.xy[:, 1]
            ends[strokes.of, rank] = np.column_stack([y[first[:-1]], y[first[1:] - 1]])
            both.append(ends)
        return both[0], both[1]

    def wholes(self) -> tuple[Indices, Array, Array]:
        """(m,), (m, 2), (m,): the glyph, place and radius of every vertex of `GlyphLine.whole`, form after form."""
        of, xy, radius = [np.repeat(np.arange(len(self)), self.bodies.count)], [self.bodies.xy], [self.bodies.radius]
        for strokes, loose in zip((self._extracted.entries, self._extracted.exits), self._loose, strict=True):
            near = strokes.are_within(loose)
            of.append(np.repeat(strokes.of, strokes.lines.count)[near])
            xy.append(strokes.lines.xy[near])
            radius.append(strokes.lines.radius[near])
        order = np.argsort(np.concatenate(of), kind="stable")
        return np.concatenate(of)[order], np.concatenate(xy)[order], np.concatenate(radius)[order]


def spread_evenly(lines: Sequence[Array], count: int) -> Array:
    """(m, count, 2): places at even distances along each of m lines (n, 2), from its first to its last."""
    size, line = np.array([len(xy) for xy in lines], dtype=np.intp), np.arange(len(lines))[:, None]
    there = np.arange(size.max(initial=2)) < size[:, None]
    xy, far = np.zeros((*there.shape, 2)), np.zeros(there.shape)
    xy[there] = np.concatenate([np.zeros((0, 2)), *lines])
    steps = np.diff(xy, axis=1)
    np.cumsum(np.maximum(np.hypot(steps[..., 0], steps[..., 1]), 1e-12), axis=1, out=far[:, 1:])
    far = np.where(there, far / far[line, size[:, None] - 1], np.inf)
    wanted = np.linspace(0, 1, count)
    low = (far[:, None] <= wanted[:, None]).sum(axis=2) - 1
    high = np.minimum(low + 1, size[:, None] - 1)
    slope = (xy[line, high] - xy[line, low]) / np.where(high > low, far[line, high] - far[line, low], 1.0)[..., None]
    return np.asarray(slope * (wanted - far[line, low])[..., None] + xy[line, low])


def square_distances(first: Array, second: Array) -> Array:
    """(n, m): squares of the distances of places (n, k) from others (m, k), as scipy's, which takes long to load."""
    squares = np.square(first[:, :1] - second[:, 0])
    for mine, theirs in zip(first.T[1:], second.T[1:], strict=True):
        squares += np.square(mine[:, None] - theirs)
    return np.asarray(squares)


def is_mark(letter: str) -> bool:
    """Whether a grapheme is punctuation or a symbol."""
    return bool(letter) and unicodedata.category(letter[0])[0] in "PS"


_Loose: TypeAlias = "tuple[Indices, Indices]"


@lru_cache(maxsize=4)
def _extract_connectors(
    hand: ScannedHand,
) -> tuple[Mapping[int, Sequence[Indices]], ExtractedStrokes, _Loose]:
    """A hand's connectors as paths, all its lines, and the loose lengths of entries and exits.

    Cached, since it takes a while and a hand's forms are needed when a text is set and again when it is traced.
    """
    paths = ways(hand)
    if hand.author is None:
        strokes = ExtractedStrokes(hand, paths, hand.centres)
    else:
        added = ExtractedStrokes(hand.added, ways(hand.added), hand.added.centres)
        strokes = _extract_connectors(hand.author)[1].extend(added)
    entry, leave = learnt(hand, "tails", VERSION, 2, lambda: tails(hand, strokes)).tolist()
    clear = _CLEAR / hand.pitch
    turn = _TURN * mean_x_height(hand)
    loose = (
        np.minimum(_loose(strokes.entries, entry, clear, entering=True), _before_turn(strokes.entries, turn, -1)),
        np.minimum(_loose(strokes.exits, leave, clear, entering=False), _before_turn(strokes.exits, turn, 1)),
    )
    return paths, strokes, loose


def _loose(strokes: Connectors, share: float, clear: float, *, entering: bool) -> Indices:
    """(ways,): how many vertices of each way remain if nothing joins it; `share` of the other letter, see `tails`."""
    lines = strokes.lines
    end = lines.xy[lines.first[:-1] if entering else lines.first[1:] - 1]
    far = np.linalg.norm(lines.xy - np.repeat(end, lines.count, axis=0), axis=1) > clear
    theirs = np.maximum(np.add.reduceat(far, lines.first[:-1], dtype=np.intp) - strokes.owned, 0)
    return np.asarray(strokes.owned + np.rint(share * theirs).astype(np.intp))


def _before_turn(strokes: Connectors, turn: float, direction: int) -> Indices:
    """(ways,): how many vertices of each, counted from its glyph, there are before it turns back, outside its letter.

    An exit (direction 1) rises to the letter that it led to, and an entry, seen from its letter, falls (−1): where it
    has come back by `turn` from its furthest, it belongs to the other letter, of which it would look like a piece.
    """
    count = strokes.lines.count
    outward = np.full((len(count), int(count.max(initial=0)) + 1), -np.inf)  # after the last vertex all have come back
    outward[np.repeat(np.arange(len(count)), count), strokes.away] = direction * strokes.lines.xy[:, 1]
    back = (np.maximum.accumulate(outward, axis=1) - outward > turn).argmax(axis=1)
    outward[np.arange(outward.shape[1]) >= back[:, None]] = -np.inf
    kept = np.where(back < count, outward.argmax(axis=1) + 1, count)
    # what is the letter's own stays: the first arch of an m rises and falls too
    return np.maximum(kept, strokes.owned)


def _group_ways(strokes: Connectors) -> Mapping[int, range]:
    """Glyph → the numbers of its ways."""
    glyphs, first, count = np.unique(strokes.of, return_index=True, return_counts=True)
    groups = zip(glyphs.tolist(), first.tolist(), count.tolist(), strict=True)
    return {glyph: range(at, at + size) for glyph, at, size in groups}


@lru_cache(maxsize=4)
def ways(hand: ScannedHand) -> Mapping[int, tuple[Indices, ...]]:
    """Glyph → the paths of its ligatures, without what two ligatures of a letter share: that belongs to its body."""
    often = [np.zeros(len(page.graph), dtype=np.intp) for page in hand.pages]
    for glyph in hand.glyphs:
        for way in glyph.ligatures:
            often[glyph.page][way.path] += 1
    paths_of = {}
    for number, glyph in enumerate(hand.glyphs):
        if glyph.ligatures:
            paths = [way.path for way in glyph.ligatures]
            if any((often[glyph.page][path] > 1).any() for path in paths):
                entries = [way.path for way in hand.glyphs[glyph.before].ligatures] if glyph.before >= 0 else []
                beyond = [way.path for way in hand.glyphs[glyph.after].ligatures]
                paths = [_clear(path, entries, beyond) for path in paths]
            paths_of[number] = tuple(paths)
    return paths_of


def _clear(path: Indices, entries: list[Indices], beyond: list[Indices]) -> Indices:
    """A path without what it shares with the ligatures on the far sides of its two letters; two vertices at least."""
    first, last = 0, len(path) - 1
    for other in entries:
        first = max(first, *np.flatnonzero(_are_among(path, np.sort(other))).tolist(), 0)
    for other in beyond:
        last = min(last, *np.flatnonzero(_are_among(path, np.sort(other))).tolist(), last)
    if last <= first:
        first = min(first, len(path) - 2)
        last = first + 1
    return readonly_indices(path[first : last + 1], None)
