"""Letters as the author of a scanned hand might write them, and those of a drawn hand in his proportions.

What is drawn of a letter in the author's manner (`manner`) is made a line as ink shows it.  Of a hand with too few
letters, and for marks, the forms of the drawn hand most like it are taken, as slanting, wide and tall as the author
writes.  How he would enter such a letter, and leave it: as those of his letters that look like it from that side.

Lengths are in line space, y up from the baseline.

Source: own method.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from handout.completion.manner import LEAST, WritingManner
from handout.completion.specimens import Specimen, SpecimenPart
from handout.completion.ways import evenly
from handout.hand import measures
from handout.hand.diacritics import NOT_ABOVE
from handout.hand.drawn import Hand
from handout.hand.letter_classes import X_HEIGHT
from handout.hand.library import load
from handout.hand.places import Place
from handout.hand.scanned import NO_PAGE, ScannedHand
from handout.inking.sweep import InkedWay
from handout.libraries import ndimage, spatial
from handout.motion.timing import arc_length
from handout.motion.trace import trace
from handout.values import Array, Indices, LineGraph
from handout.writing.forms import Forms, spread_evenly
from handout.writing.joining import cubic
from handout.writing.specimen import single_letter

_STEP = 0.03  # x-heights between vertices of a line that is drawn; .9 pixels at 300 dpi and 2.5 mm
_HASTY = 0.85  # share of joins from which an author writes as the quick hand does
_WIDER = (0.7, 1.45)  # least and most that letters are made narrower or broader, however odd the widths measured
_PARALLEL = 0.95  # cosine, from which on two lines run side by side: of .87, .93 and .95 letters are read best
_ONE_LINE = 2.6  # half widths of the line, within which two strokes side by side are one line; by eye
_LENS = 2.0  # of that: a gap no wider than this between two strokes that are one line before and after is none
_LED = 2.0  # half widths along the way over which a stroke is led on to the one beside it; by eye
_PLACES: tuple[Place, ...] = ("middle", "start", "end")  # in a word, of the forms of a small letter that may be joined


class DrawnLetters:
    """The drawn hand that lends letters to a scanned one, and the measures that they are fitted to.

    radius : half the width of the author's line; slant : dx/dy; x_height : of a small letter.
    """

    def __init__(self, hand: ScannedHand) -> None:
        self._hand = hand
        self.radius = measures.letter_half_width(hand)
        self.slant = measures.slant(hand)
        self.x_height = measures.x_height(hand)

    @cached_property
    def house(self) -> Hand:
        """The drawn hand that is most like it."""
        if self._share < measures.JOINED_SHARE:
            return load("house-print")
        return load("house-quick" if self._share > _HASTY else "house-joined")

    @cached_property
    def _share(self) -> float:
        return measures.joins(self._hand).share

    @cached_property
    def capital(self) -> float:
        """Height of the author's capitals."""
        return measures.capital_height(self._hand)

    @cached_property
    def _ascender(self) -> float:
        return measures.ascender_height(self._hand)

    def forms(self, letter: str, count: int, rng: np.random.Generator) -> list[Specimen]:
        """A letter written `count` times; [] if the drawn hand has none."""
        written = [self._strokes(letter, rng) for _ in range(count)]
        return [Specimen(letter, (self._part(strokes),)) for strokes in written if strokes]

    def in_manner(self, letter: str, count: int, rng: np.random.Generator) -> list[Specimen]:
        """A letter as the author might write it, `count` times; [] if none is drawn, or he wrote too few letters.

        Where he joins letters those within a word end where their ways to the next letter begin.
        """
        if len(self._manner.letters) < LEAST:
            return []
        places: list[Place] = ["alone"] * count
        if self._share >= measures.JOINED_SHARE and letter.islower():
            places = [_PLACES[k % len(_PLACES)] for k in range(count)]
        parted = [place in ("start", "middle") for place in places]
        written, last = self._manner.ways(letter, parted, rng)
        return [
            self._specimen(letter, [*map(self._leant, strokes)], last, place, rng)
            for strokes, place in zip(written, places, strict=False)
        ]

    def _specimen(
        self, letter: str, strokes: Sequence[Array], last: int, place: Place, rng: np.random.Generator
    ) -> Specimen:
        """A letter with the ligatures that it has in its place; `last` is the stroke that leads to the next."""
        strokes = _close_strokes(strokes, self.radius)
        body, ways = self._line(*_weld_strokes(strokes, self.radius), strokes), [InkedWay(stroke) for stroke in strokes]
        lines, roles, edges, paths = (
            [body.graph.xy],
            [body.role],
            [body.graph.edges],
            [list[Indices](), list[Indices]()],
        )
        for side, links in enumerate(self._links):
            link = (
                links.link(strokes, (0, last)[side], rng)
                if place == "middle" or place == ("end", "start")[side]
                else None
            )
            if link is None:
                continue
            first, count = sum(map(len, lines)), len(link.xy) - 1
            at = int(np.hypot(*(body.graph.xy - link.xy[0]).T).argmin())
            path = np.concatenate([[at], first + np.arange(count)])
            lines.append(link.xy[1:])
            roles.append(np.where(np.arange(1, count + 1) < link.own, 0, (-1, 1)[side]))
            edges.append(np.column_stack([path[:-1], path[1:]]))
            paths[side].append(path[:: 1 if side else -1])
            _lead_on(ways, link, leaving=bool(side))
        whole = self._line(np.concatenate(lines), np.concatenate(edges), ())
        part = SpecimenPart(whole.graph, NO_PAGE, np.concatenate(roles).astype(np.intp), tuple(ways))
        beside: list[Place | None] = ["middle" if some else None for some in paths]
        return Specimen(letter, (part,), (beside[0], place, beside[1]), tuple(paths[0]), tuple(paths[1]))

    @cached_property
    def _links(self) -> tuple[Links, Links]:
        """The ligatures to the letter before, and to the one after."""
        forms = Forms(self._hand)
        return Links(self._hand, forms, leaving=False), Links(self._hand, forms, leaving=True)

    @cached_property
    def _manner(self) -> WritingManner:
        return WritingManner(self._hand)

    def _leant(self, upright: Array) -> Array:
        """A curve (m, 2) in line space through places (n, 2), upright x-heights."""
        x, y = evenly(upright, _STEP).T * self.x_height
        return np.column_stack([x + self.slant * y, y])

    def mark(self, mark: str, rng: np.random.Generator) -> list[SpecimenPart]:
        """An accent over (under) the baseline at x = 0, its lowest point at the gap that it keeps from its letter."""
        forms = self.house.marks[mark]
        form = forms[int(rng.integers(len(forms)))]
        curves = [evenly(stroke, _STEP) for stroke in form.strokes]
        upright = [np.column_stack([xy[:, 0] - self.house.slant * xy[:, 1], xy[:, 1]]) for xy in curves]
        strokes = [self.x_height * xy for xy in upright]
        if mark not in NOT_ABOVE:
            strokes = [xy - [0.0, self.x_height] for xy in strokes]
        low = min(float(xy[:, 1].min()) for xy in strokes)
        leant = [np.column_stack([xy[:, 0] + self.slant * (xy[:, 1] - low), xy[:, 1]]) for xy in strokes]
        return [self._part(leant)]

    def _strokes(self, letter: str, rng: np.random.Generator) -> list[Array]:
        """The strokes of a letter in the author's proportions; [] if the drawn hand has none."""
        if letter not in self.house.glyphs:
            return []
        strokes = _trace_letter(letter, self.house, rng)
        top = max(self._ascender_drawn, *(float(xy[:, 1].max()) for xy in strokes))
        rise = ((self._ascender if letter.islower() else self.capital) - self.x_height) / (top - 1)
        return [self._fit_to_line(xy, rise) for xy in strokes]

    def _fit_to_line(self, upright: Array, rise: float) -> Array:
        """Upright x-heights to line space; what is over small letters is `rise` an x-height."""
        x, y = upright.T * self.x_height
        over = np.maximum(upright[:, 1] - 1, 0)
        high = np.minimum(y, self.x_height) + rise * over
        return np.column_stack([x * self._breadth + self.slant * high, high])

    def _part(self, strokes: Sequence[Array]) -> SpecimenPart:
        """Strokes in line space as a line that is still to be inked; each is sampled already, or one point."""
        count, edges = 0, [np.zeros((0, 2), dtype=np.intp)]
        for stroke in strokes:
            numbers = count + np.arange(len(stroke))
            edges.append(np.column_stack([numbers[:-1], numbers[1:]]))
            count += len(stroke)
        return self._line(np.concatenate(list(strokes)), np.concatenate(edges), strokes)

    def _line(self, xy: Array, edges: Indices, strokes: Sequence[Array]) -> SpecimenPart:
        """A line of places (n, 2) that is still to be inked."""
        count = len(xy)
        graph = LineGraph(xy, np.full(count, self.radius), np.ones(count), np.zeros((count, 2)), edges)
        return SpecimenPart(graph, NO_PAGE, np.zeros(count, dtype=np.intp), tuple(map(InkedWay, strokes)))

    @cached_property
    def _ascender_drawn(self) -> float:
        """Height of the drawn hand's letters with an ascender, x-heights."""
        rng = np.random.default_rng(0)
        return float(np.median([max(xy[:, 1].max() for xy in _trace_letter(x, self.house, rng)) for x in "bhl"]))

    @cached_property
    def _breadth(self) -> float:
        """Widths of the author's small letters by those of the drawn hand."""
        rng, ratios = np.random.default_rng(0), []
        for letter in sorted(X_HEIGHT):
            numbers = self._hand.numbers_of_letter(letter)[:7]
            if len(numbers) < 2:
                continue
            outlines = [self._hand.outline(int(i)) for i in numbers]
            widths = [float(np.ptp(xy[:, 0] - self.slant * xy[:, 1])) for xy in outlines]
            drawn_width = np.ptp(np.concatenate(_trace_letter(letter, self.house, rng))[:, 0]) * self.x_height
            ratios.append(float(np.median(widths)) / max(float(drawn_width), 1e-6))
        return float(np.clip(np.median(ratios), *_WIDER)) if ratios else 1.0


def _lead_on(ways: list[InkedWay], link: NeighbourLigature, *, leaving: bool) -> None:
    """Make a ligature part of the way that it goes on from, or a way of its own, which nobody begins or ends there."""
    if link.stroke < 0:
        ways.append(InkedWay(link.xy if leaving else link.xy[::-1], (False, False)))
        return
    way = ways[link.stroke]
    if leaving:
        ways[link.stroke] = InkedWay(np.concatenate([way.xy, link.xy[1:]]), (way.ends[0], False))
    else:
        ways[link.stroke] = InkedWay(np.concatenate([link.xy[:0:-1], way.xy]), (False, way.ends[1]))


def _close_strokes(strokes: Sequence[Array], radius: float) -> list[Array]:
    """Strokes (n, 2) of which what runs beside an earlier part, within a line's width, is led on to that."""
    number, xy = _earlier_places(strokes, radius), np.concatenate(list(strokes))
    led, first = [], np.cumsum([0, *map(len, strokes)]).tolist()
    for a, b in pairwise(first):
        aside = xy[number[a:b]] - xy[a:b]
        if aside.any():
            step = float(np.median(np.hypot(*np.diff(xy[a:b], axis=0).T)))
            aside = ndimage.gaussian_filter1d(aside, _LED * radius / max(step, 1e-9), axis=0, mode="nearest")
        led.append(xy[a:b] + aside)
    return led


def _earlier_places(strokes: Sequence[Array], radius: float) -> Indices:
    """(n,): for each place of strokes the earlier one that it runs beside, within a line's width, or else its own."""
    xy, first = np.concatenate(list(strokes)), np.cumsum([0, *map(len, strokes)]).tolist()
    along = np.concatenate([np.gradient(x, axis=0) if len(x) > 1 else np.zeros((1, 2)) for x in strokes])
    along /= np.maximum(np.hypot(*along.T), 1e-9)[:, None]
    number, reach = np.arange(len(xy)), _ONE_LINE * radius
    for a, b in pairwise(first):
        turns = a + 1 + np.flatnonzero(np.diff(np.sign(along[a:b, 1])) != 0)
        for begin, end in pairwise([a, *turns.tolist(), b]):
            steps = np.hypot(*np.diff(xy[a : begin + 1], axis=0).T)
            leading = int((np.cumsum(steps[::-1]) < 2 * reach).sum())  # to the turn, which is no place beside it
            if begin - leading > 0 and begin < end:
                away, at = spatial.cKDTree(xy[: begin - leading]).query(xy[begin:end])
                parallel = np.abs((along[at] * along[begin:end]).sum(axis=1)) > _PARALLEL
                beside = _fill_between((away < reach) & parallel, away < _LENS * reach)
                number[begin:end] = np.where(beside, number[at], number[begin:end])
                back = begin - 1 - np.arange(min(int(beside.argmax()), begin - a))  # a hairpin: as the pen came
                off = np.hypot(*(xy[back] - xy[begin : begin + len(back)]).T)
                if beside.any() and len(back) and off.max() < _LENS * reach:
                    number[begin : begin + len(back)] = number[back]
    return number


def _fill_between(sure: NDArray[np.bool_], maybe: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """(n,): what is sure, and what lies between two sure places if all of it may be."""
    filled, at = sure.copy(), np.flatnonzero(sure)
    for a, b in pairwise(at.tolist()):
        filled[a:b] = maybe[a:b].all()
    return filled


def _weld_strokes(strokes: Sequence[Array], radius: float) -> tuple[Array, Indices]:
    """Strokes (n, 2) as one line, places and edges: what runs beside an earlier part, within its width, is that part.

    Ink shows no more than that of a stem that the pen goes up and down again.
    """
    number, xy = _earlier_places(strokes, radius), np.concatenate(list(strokes))
    edges, first = list[Indices](), np.cumsum([0, *map(len, strokes)]).tolist()
    own = number == np.arange(len(xy))
    for a, b in pairwise(first):
        pairs = np.column_stack([number[a : b - 1], number[a + 1 : b]])
        edges.append(pairs[own[a : b - 1] | own[a + 1 : b]])
    kept = np.flatnonzero(own)
    return xy[kept], np.searchsorted(kept, np.concatenate(edges))


def _trace_letter(letter: str, house: Hand, rng: np.random.Generator) -> list[Array]:
    """Strokes of a letter as a drawn hand writes it: x-heights, upright, the baseline at y = 0."""
    size = 10.0  # mm: large, so that what depends on mm is small in x-heights
    sheet = single_letter(letter, house, rng, size)
    baseline = sheet.lines[0].baseline
    strokes = []
    for stroke in trace(sheet, house, rng).strokes:
        x, y = stroke.xy[:, 0] / size, (baseline - stroke.xy[:, 1]) / size
        strokes.append(np.column_stack([x - house.slant * y, y]))
    return strokes


_HEIGHTS = np.linspace(-0.5, 2.1, 14)  # x-heights over the baseline at which letters are compared
# set by eye on letters made for csafe w0154 w0238 and cvl 0013
_BAND = 0.15  # x-heights: half the height of the band that shows at each
_REACH = 0.7  # x-heights from the ligature's height, at which what letters look like counts 1/e
_INSIDE = 0.6  # x-heights: what lies further in than that is not seen from the side
_OUTER = 0.15  # x-heights that a ligature may begin inside its letter's side
_LEVEL = 0.12  # x-heights from a ligature's height to a place that it can begin at
_AT_END = 0.25  # x-heights from there to the end of a stroke that is taken for it
_LED_INTO = 0.35  # x-heights over which a ligature takes on the direction of the stroke that it goes on from
_ALIKE, _SOME, _COMPARED = 10, 6, 6  # ligatures that fit best; of those most like them one is taken; places compared


@dataclass(frozen=True, eq=False)
class NeighbourLigature:
    """A ligature to a letter's neighbour.

    xy : (n, 2) line space, from the letter outwards; the first place is where it touches the letter.
    own : how many of its places count as the letter's.
    stroke : of the letter's, that it goes on from, or comes to; -1: it begins beside an end.
    """

    xy: Array
    own: int
    stroke: int


class Links:
    """The ligatures of an author's letters on one side, with what each letter looks like from there.

    leaving : whether they lead to the letter after.
    """

    def __init__(self, hand: ScannedHand, forms: Forms, *, leaving: bool) -> None:
        self._leaving, self._x_height, self._slant = leaving, measures.x_height(hand), measures.slant(hand)
        ways = forms.connectors(leaving=leaving)
        self._ways, self._kept, self._shapes, self._heights = ways, list[int](), list[Array](), list[float]()
        for way in range(len(ways.of)):
            number = int(ways.of[way])
            if not hand.glyphs[number].letter.islower() or ways.lines.count[way] < 4:
                continue
            body = forms.bodies[number].xy + forms.centre[number]
            anchor = body[ways.anchor[way]]
            look = self._look(body)
            side = self._side(anchor)
            at = int(np.abs(_HEIGHTS * self._x_height - anchor[1]).argmin())
            if look[at] - side < _OUTER * self._x_height:
                self._kept.append(way)
                self._shapes.append(look - side)
                self._heights.append(float(anchor[1]))

    def _side(self, xy: Array) -> Array:
        """How far out places (…, 2) are on this side, line space, upright."""
        out = xy[..., 0] - self._slant * xy[..., 1]
        return np.asarray(out if self._leaving else -out)

    def _look(self, xy: Array) -> Array:
        """(heights,): how far out a line (n, 2) reaches at each height; −inf where it does not."""
        out, y = self._side(xy), xy[:, 1] / self._x_height
        near = np.abs(y[:, None] - _HEIGHTS) <= _BAND
        return np.asarray(np.where(near, out[:, None], -np.inf).max(axis=0))

    def link(self, strokes: Sequence[Array], joined: int, rng: np.random.Generator) -> NeighbourLigature | None:
        """A ligature for a letter of strokes (n, 2); None if none fits.

        joined : the stroke that is written on with the neighbour, where it ends on this side.
        """
        x_height, body = self._x_height, np.concatenate(list(strokes))
        if not self._kept:
            return None
        heights, look = np.array(self._heights), self._look(body)
        starts = [self._start(body, strokes, joined, height) for height in heights]
        sides = np.array([np.nan if start is None else self._side(start[0]) for start in starts])
        apart = np.clip(look - sides[:, None], -_INSIDE * x_height, None)
        apart -= np.clip(np.array(self._shapes), -_INSIDE * x_height, None)
        weight = np.exp(-np.abs(_HEIGHTS - heights[:, None] / x_height) / _REACH)
        cost = (np.minimum(np.abs(apart), x_height) * weight).sum(axis=1) / weight.sum(axis=1)
        some = np.argsort(np.where(np.isnan(cost), np.inf, cost), kind="stable")[:_ALIKE]
        some = some[~np.isnan(cost[some])]
        if not len(some):
            return None
        # those that are most like all others of them come first
        lines = [self._ways.lines[self._kept[k]].xy[:: 1 if self._leaving else -1] for k in some.tolist()]
        each = spread_evenly([line - line[0] for line in lines], _COMPARED)
        between = np.hypot(*np.moveaxis(each[:, None] - each, -1, 0)).mean(axis=2)
        usual = some[np.median(between, axis=1).argsort(kind="stable")][:_SOME]
        which = int(usual[int(rng.integers(len(usual)))])
        start, way = starts[which], self._kept[which]
        assert start is not None
        line = self._ways.lines[way].xy[:: 1 if self._leaving else -1]
        line = line - line[0] + start[0]
        if start[1] >= 0:
            line = _lead_line(strokes[start[1]][:: 1 if self._leaving else -1], line, _LED_INTO * x_height)
        return NeighbourLigature(line, int(np.clip(self._ways.owned[way], 1, len(line) - 2)), start[1])

    def _start(self, body: Array, strokes: Sequence[Array], joined: int, height: float) -> tuple[Array, int] | None:
        """Where a ligature can begin at a height, and the number of the stroke that ends there, or else -1.

        It comes to, or leaves, the outermost place of a letter, or its stroke's end near there; a pen leaves at the
        height at which its last stroke ends.
        """
        end, near = strokes[joined][-1 if self._leaving else 0], _AT_END * self._x_height
        if self._leaving and abs(end[1] - height) > near:
            return None
        level = body[np.abs(body[:, 1] - height) < _LEVEL * self._x_height]
        if not len(level):
            return None
        furthest = level[self._side(level).argmax()]
        if np.hypot(*(end - furthest)) < near and len(strokes[joined]) > 1:
            return end, joined
        return furthest, -1


def _lead_line(stroke: Array, line: Array, reach: float) -> Array:
    """A line (n, 2) from the end of a stroke (m, 2), which it leaves in the stroke's direction."""
    run = arc_length(line)
    k = int(np.clip(np.searchsorted(run, reach), 1, len(line) - 1))
    back = stroke[-1] - stroke[max(len(stroke) - 4, 0)]
    ahead = line[min(k + 2, len(line) - 1)] - line[max(k - 2, 0)]
    if k < 2 or not back.any() or not ahead.any() or back @ (line[k] - line[0]) < 0:
        return line
    span = float(np.hypot(*(line[k] - line[0])))
    back, ahead = (span * way / np.hypot(*way) for way in (back, ahead))
    led = cubic(line[0], back, line[k], ahead, run[: k + 1] / run[k])
    return np.concatenate([led, line[k + 1 :]])
