"""The strokes of the glyphs of one scanned hand, each traced with what is known of the glyphs beside it on its page.

Where the pen of a page was recorded its vertices are numbered in the order of writing, and nothing need be traced.
"""

from __future__ import annotations

import copy
import operator
from collections import OrderedDict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from handout.hand import measures
from handout.hand.learnt import learnt, recall
from handout.hand.scanned import NOBODY, ScannedGlyph, ScannedHand
from handout.motion.recovery.carried_strokes import carried_cost, carry_strokes
from handout.motion.recovery.crossbars import WordCrossbars
from handout.motion.recovery.ink_gaps import Endpoint, endpoints, log_odds, prior_log_odds, severed_pairs
from handout.motion.recovery.kept_strokes import part_by_glyph, strokes_as_numbers, strokes_of_numbers
from handout.motion.recovery.letter_line import Candidate, LetterLine, LetterStrokes, trace_as_told
from handout.motion.recovery.letter_tracing import candidates
from handout.motion.recovery.writer_habits import (
    CANDIDATES,
    DOUBT,
    MARGIN,
    POOL,
    REORDERED,
    Instance,
    WriterHabit,
    costs_of,
    instance_of,
    learn_habit,
    measure_reordering,
)
from handout.values import POSE, Array, Indices, LineGraph
from handout.writing.forms import Connector, Forms, GlyphLine

_ALONG = 0.6  # of a ligature that lies in a crossbar
_TOUCHED = 8  # vertices of a body that a crossbar may share where it only ends there
VERSION = 11  # of what is kept of a hand; tests/hand/test_house_scanned.py says when to raise it
_JOINING = 0.2  # share of a hand's letters joined to the one before, from which crossbars wait for the end of the word


class StrokeOrderModel:
    """The strokes of a hand's glyphs, each glyph's worked out when it is first asked for.

    width : mm, of the hand's usual line.
    joined_share : share of letters that are joined to the next, of those that have one.
    half_widths : half widths of the usual line in an x-height.
    """

    def __init__(self, hand: ScannedHand, hands: tuple[str, ...]) -> None:
        self._hand, self._hands = hand, hands
        self.forms = Forms(hand)
        joins = measures.joins(hand)
        self._joined_hand = joins.share >= _JOINING
        self.joined_share = (joins.joined + 0.5) / (joins.pairs + 1)
        self.width = 2 * measures.half_width(hand)
        self._x_height = measures.x_height(hand)
        self.half_widths = measures.x_height_in_half_widths(hand)
        # radius, in x-heights of its forms, and density of the line of the letters on each page
        self._usual = list[tuple[float, float]]()
        for number, page in enumerate(hand.pages):
            letters = [glyph.vertices for glyph in hand.glyphs if glyph.page == number]
            vertices = np.concatenate(letters) if letters else np.arange(len(page.graph.radius))
            radius, density = (float(np.median(values[vertices])) for values in (page.graph.radius, page.graph.density))
            self._usual.append((radius / page.pitch, density))
        self._crossbars = WordCrossbars(hand, self.forms.paths)
        self._endpoints: dict[int, list[Endpoint]] = {}
        self._inked: dict[int, tuple[LetterLine, tuple[Indices, ...]]] = {}
        self._lines: dict[int, tuple[LetterLine, list[Candidate]]] = {}
        self._instances: dict[int, Instance] = {}
        self._habits: dict[str, tuple[tuple[int, ...], WriterHabit | None]] = {}
        self._strokes: dict[int, LetterStrokes] = {}
        kept = recall(hand.author or hand, _name(hands), VERSION)
        self._kept = {} if kept is None else part_by_glyph(kept, hand.own_count)

    def heir(self, hand: ScannedHand) -> StrokeOrderModel | None:
        """This model for a hand that differs only in what a person said of strokes; None for any other hand."""
        pairs = list(zip(self._hand.glyphs, hand.glyphs, strict=False))
        if len(self._hand.glyphs) != len(hand.glyphs) or not all(map(operator.is_, self._hand.pages, hand.pages)):
            return None
        if len(self._hand.pages) != len(hand.pages) or not all(_inked_alike(a, b) for a, b in pairs):
            return None
        said = self._letters_told_anew(hand)
        other = copy.copy(self)
        other._hand = hand
        other._habits = {letter: habit for letter, habit in self._habits.items() if letter not in said}
        other._instances = {n: one for n, one in self._instances.items() if hand.glyphs[n].letter not in said}
        other._strokes = {n: one for n, one in self._strokes.items() if hand.glyphs[n].letter not in said}
        other._kept = {n: one for n, one in self._kept.items() if hand.glyphs[n].letter not in said}
        return other

    def list_rewritten(self, before: StrokeOrderModel) -> list[int]:
        """List glyphs whose strokes differ from an earlier model of the same ink, though nobody named them."""
        letters, found = before._letters_told_anew(self._hand), list[int]()
        for number in (n for letter in sorted(letters) for n in self._hand.numbers_of_letter(letter).tolist()):
            old, new = ([way for way, _ in model.ways_of(number)] for model in (before, self))
            if not self._hand.glyphs[number].ways and not _are_same(old, new):
                found.append(number)
        return found

    def _letters_told_anew(self, hand: ScannedHand) -> set[str]:
        """The letters of whose strokes a person said something else in another hand of the same glyphs."""
        pairs = zip(self._hand.glyphs, hand.glyphs, strict=True)
        return {a.letter for a, b in pairs if a is not b and not _are_same(a.ways, b.ways)}

    def strokes_of(self, number: int) -> tuple[LetterStrokes, tuple[Indices, ...]]:
        """The strokes of a glyph, and which vertices of its line are those of each of its ligatures, anchor left out,
        outwards: entries, then exits."""
        line, sections = self._letter_line(number)
        if number not in self._strokes:
            kept = strokes_of_numbers(self._kept[number], line.edges, len(line.xy)) if number in self._kept else None
            self._strokes[number] = kept or self._choose(number, self._instance(number))
        return self._strokes[number], sections

    def all_as_numbers(self) -> list[int]:
        """The strokes of all glyphs, as `kept_strokes` has them."""
        lines = ((number, self._letter_line(number)[0]) for number in range(len(self.forms)))
        return [n for number, line in lines for n in strokes_as_numbers(self.strokes_of(number)[0], line.edges)]

    def ways_of(self, number: int) -> list[tuple[Indices, bool]]:
        """The strokes of a glyph along the vertices of its page, and of each whether it comes after the word."""
        found, sections = self.strokes_of(number)
        there = {place: vertex for vertex, place in self._places_on_page(number, sections).items()}
        own = set(self._hand.glyphs[number].vertices.tolist())
        ways = []
        for stroke, late in zip(found.strokes, found.delayed, strict=True):
            way = [there[place] for place in stroke.tolist() if there.get(place) in own]
            if way:
                ways.append((np.array(way, dtype=np.intp), bool(late)))
        return ways

    def _on_line(
        self, number: int, given: Sequence[Indices], line: LetterLine, sections: tuple[Indices, ...]
    ) -> list[Indices]:
        """Strokes along vertices of its page on a glyph's line; each ligature goes on where one begins or ends."""
        place = self._places_on_page(number, sections)
        told = ([place[v] for v in way.tolist() if v in place] for way in given)
        ways = [way for way in told if way]
        for (way, _), section in zip(outwards(self.forms[number]), sections, strict=True) if ways else ():
            _lead(line.xy, ways, [way.anchor, *section.tolist()])
        return [np.array(way, dtype=np.intp) for way in ways]

    def _choose(self, number: int, instance: Instance) -> LetterStrokes:
        """Choose among the candidates of a glyph the one that its writer is used to; tell whether it is a guess."""
        found = instance.candidates
        if len(found) == 1 or self.forms.marks[number]:
            return found[0].letter_strokes
        letter = self._hand.glyphs[number].letter
        if letter not in self._habits:
            pool = self._pool(letter)
            self._habits[letter] = pool, learn_habit([self._instance(other) for other in pool])
        pool, habit = self._habits[letter]
        at = pool.index(number) if number in pool else -1
        costs = costs_of(instance) if habit is None else habit.weigh(instance, at)
        best = int(costs.argmin())
        near = (k for k in np.flatnonzero(costs <= costs[best] + DOUBT).tolist() if k != best)
        guessed = any(measure_reordering(found[best].strokes, found[k].strokes) >= REORDERED for k in near)
        return replace(found[best].letter_strokes, guessed=guessed)

    def _pool(self, letter: str) -> tuple[int, ...]:
        """The first instances of a letter."""
        numbers = self._hand.numbers_of_letter(letter).tolist()
        # those of which a person said how they were written tell most
        return tuple(sorted(numbers, key=lambda number: not self._hand.glyphs[number].ways)[:POOL])

    def _letter_line(self, number: int) -> tuple[LetterLine, tuple[Indices, ...]]:
        """A glyph's line as its own ink has it, and the vertices of its ligatures."""
        if number not in self._inked:
            self._inked[number] = _letter_line(self.forms[number], self._x_height)
        return self._inked[number]

    def _line(self, number: int) -> tuple[LetterLine, list[Candidate]]:
        """A glyph's line with what its neighbours tell, and the candidates that its ink and its letter tell of."""
        if number not in self._lines:
            line, sections = self._letter_line(number)
            line = self._with_neighbours(number, line, sections)
            glyph = self._hand.glyphs[number]
            if self._hand.pages[glyph.page].moments is not None:
                recorded = recorded_strokes(self._hand, self.forms, number, line)
                found = [Candidate(recorded.strokes, 0.0, lambda: (recorded.delayed, recorded.bars))]
            else:
                found = candidates(line, glyph.letter, hands=self._hands, most=CANDIDATES, margin=MARGIN)
            self._lines[number] = line, found
        return self._lines[number]

    def _instance(self, number: int) -> Instance:
        """A glyph with its candidates."""
        line, found = self._line(number)
        if number not in self._instances:
            if said := self._on_line(number, self._hand.glyphs[number].ways, line, self._letter_line(number)[1]):
                found = [trace_as_told(found, said)]
            else:
                found = sorted([*found, *self._carry_candidates(number)], key=lambda way: way.cost)
            self._instances[number] = instance_of(found, line, len(self.forms[number].xy), bool(said))
        return self._instances[number]

    def _carry_candidates(self, number: int) -> list[Candidate]:
        """Carry over the strokes that a person gave for the glyph of this letter whose ink is most alike, if any."""
        glyph, told = self._hand.glyphs[number], []
        if self._hand.pages[glyph.page].moments is not None:
            return []  # how it was written is known
        for like in (self._hand.glyphs[other] for other in self._pool(glyph.letter)):
            if like.ways:
                graph, uv = self._hand.pages[glyph.page].graph, self._hand.pages[like.page].graph.uv
                told.append(carry_strokes(graph, glyph.vertices, [uv[way] for way in like.ways], uv[like.vertices]))
        best = min((way for way in told if way is not None), key=lambda way: way.apart, default=None)
        if best is None:
            return []
        line, found = self._line(number)
        strokes = self._on_line(number, best.ways, line, self._letter_line(number)[1])
        places, others = ([line.xy[way] for way in ways] for ways in (strokes, found[0].strokes))
        more = carried_cost(places, others, best.apart, line.x_height)
        return [replace(trace_as_told(found, strokes), cost=found[0].cost + more)]

    def clocks(self, number: int) -> tuple[Array, Array] | None:
        """(n,) s and (n, 4): when the pen was at each vertex of a glyph's body and how it was held (channels as in
        `POSE`), nan where that is not known; None for a glyph that was not recorded.
        """
        moments = self._hand.pages[self._hand.glyphs[number].page].moments
        if moments is None:
            return None
        vertices = self.forms.vertices(number)
        times, *pose = (
            np.full(len(vertices), np.nan) if channel is None else channel[vertices]
            for channel in (getattr(moments, name) for name in ("times", *POSE))
        )
        return times, np.column_stack(pose)

    def _with_neighbours(self, number: int, line: LetterLine, sections: tuple[Indices, ...]) -> LetterLine:
        """A line with what the letters beside it tell: crossbars that come in, and loose ends where ink has failed."""
        glyph = self._hand.glyphs[number]
        line = self._with_crossbars(number, line, sections)
        entries = list(line.entries)
        if glyph.before != NOBODY and not entries:
            entries += self._facing(glyph.before, number, entering=True)
        exits = list(line.exits)
        if glyph.after != NOBODY and not exits:
            exits += self._facing(glyph.after, number, entering=False)
        return replace(
            line,
            edges=np.concatenate([line.edges, *self._edges_over_neighbours(number, sections)]),
            entries=tuple(entries),
            exits=tuple(exits),
            joined_hand=self._joined_hand,
            usual=self._usual[glyph.page],
            baseline=-float(self.forms.centre[number, 1]),
        )

    def _edges_over_neighbours(self, number: int, sections: tuple[Indices, ...]) -> Iterator[Indices]:
        """(1, 2) each: edges by which a glyph's line goes on where a neighbour's cuts it in two."""
        glyph = self._hand.glyphs[number]
        page = self._hand.pages[glyph.page]
        pairs = severed_pairs(page.graph, glyph.vertices) if page.moments is None else []
        place = self._places_on_page(number, sections) if pairs else {}
        yield from (np.array([[place[v], place[w]]]) for v, w in pairs if v in place and w in place)

    def _with_crossbars(self, number: int, line: LetterLine, sections: tuple[Indices, ...]) -> LetterLine:
        """A line with the crossbars that its word has there."""
        recorded = self._hand.pages[self._hand.glyphs[number].page].moments is not None
        bars = () if recorded else self._crossbars[number]
        if not bars:
            return line
        place = self._places_on_page(number, sections)
        form, ends = self.forms[number], _BarEnds()
        for bar in bars:
            before, here, after = (
                np.array([place[v] for v in vertices.tolist() if v in place], dtype=np.intp)
                for vertices in (bar.before, bar.vertices, bar.after)
            )
            if not len(here):
                continue
            side = ends.own if bar.glyph == number else ends.foreign
            side.append((here, (before, after)))
            over_body = int((here < len(form.xy)).sum()) > _TOUCHED
            if over_body and (bar.glyph != number or bar.loose[0]):
                entries = sections[: len(form.entries)]
                ends.entering.update(int(way[-1]) for way in entries if np.isin(way, here).mean() >= _ALONG)
        return ends.put_on(line)

    def _places_on_page(self, number: int, sections: tuple[Indices, ...]) -> dict[int, int]:
        """Vertex of the page → vertex of a glyph's line."""
        glyph = self._hand.glyphs[number]
        paths = (*self.forms.paths.get(glyph.before, ()), *self.forms.paths.get(number, ()))
        place = {int(v): i for i, v in enumerate(self.forms.vertices(number))}
        for (_, step), path, section in zip(outwards(self.forms[number]), paths, sections, strict=True):
            place |= dict(zip(path[::step][1:].tolist(), section.tolist(), strict=True))
        return place

    def _facing(self, other: int, number: int, *, entering: bool) -> list[int]:
        """The loose end of a glyph's body that goes on in its neighbour's, if a little ink is missing between them."""
        form = self.forms[number]
        anchors = {way.anchor for way in (*form.entries, *form.exits)}
        ours = [end for end in self._endpoints_of(number) if end.vertex not in anchors]
        if not ours:
            return []
        theirs, shift = self._endpoints_of(other), self.forms.centre[other] - self.forms.centre[number]
        half_width = float(np.median(form.radius))
        best, facing, prior = 0.0, [], prior_log_odds(self.joined_share)
        for end in ours:
            for opposite in theirs:
                there = opposite.place + shift
                odds = log_odds(end, replace(opposite, place=there), half_width) + prior
                if odds > best and (there[0] < end.place[0] + half_width) == entering:
                    best, facing = odds, [end.vertex]
        return facing

    def _endpoints_of(self, number: int) -> list[Endpoint]:
        ends = self._endpoints.get(number)
        if ends is None:
            form = self.forms[number]
            ends = endpoints(form.xy, form.radius, form.edges, float(np.median(form.radius)))
            self._endpoints[number] = ends
        return ends


_KEPT = 4  # models
_MODELS: OrderedDict[tuple[int, tuple[str, ...]], StrokeOrderModel] = OrderedDict()


def stroke_order_model(hand: ScannedHand, hands: tuple[str, ...]) -> StrokeOrderModel:
    """The model of a hand; that of the last few hands is kept, and what holds of one that is much the same is taken."""
    key = id(hand), hands
    if key not in _MODELS:
        kin = (model.heir(hand) for (_, known), model in reversed(_MODELS.items()) if known == hands)
        _MODELS[key] = next((heir for heir in kin if heir is not None), None) or StrokeOrderModel(hand, hands)
        while len(_MODELS) > _KEPT:
            _MODELS.popitem(last=False)
    _MODELS.move_to_end(key)
    return _MODELS[key]


def learn_strokes(hand: ScannedHand, hands: tuple[str, ...]) -> Array:
    """Find the strokes of all glyphs of a hand, to be kept with it."""
    return learnt(hand, _name(hands), VERSION, None, lambda: stroke_order_model(hand, hands).all_as_numbers())


def _name(hands: tuple[str, ...]) -> str:
    return f"strokes by {', '.join(hands)}"


def _inked_alike(a: ScannedGlyph, b: ScannedGlyph) -> bool:
    """Whether two glyphs of one number are the same but for what a person said of them."""
    where = operator.attrgetter("letter", "page", "line", "before", "after")
    joins = ([way.path for way in glyph.ligatures] for glyph in (a, b))
    return a is b or (where(a) == where(b) and _are_same([a.vertices], [b.vertices]) and _are_same(*joins))


def _are_same(some: Sequence[Indices], others: Sequence[Indices]) -> bool:
    return len(some) == len(others) and all(map(np.array_equal, some, others))


def _lead(xy: Array, ways: list[list[int]], out: Sequence[int]) -> None:
    """Extend the stroke that begins or ends nearest to a ligature along the part of it that no stroke covers yet."""
    known = {v for way in ways for v in way}
    last = max((k for k, v in enumerate(out) if v in known), default=0)
    i, end = min(
        ((i, end) for i in range(len(ways)) for end in (0, -1)),
        key=lambda tip: float(np.linalg.norm(xy[ways[tip[0]][tip[1]]] - xy[out[last]])),
    )
    rest = list(out[last + 1 :])
    ways[i] = [*rest[::-1], *ways[i]] if end == 0 else [*ways[i], *rest]


@dataclass(frozen=True, eq=False)
class _BarEnds:
    """Crossbars on one letter's line, and at which ends of its ligatures they come in and leave.

    own, foreign : the letter's own crossbars, and others': vertices, and those before and after them.
    """

    own: list[tuple[Indices, tuple[Indices, Indices]]] = field(default_factory=list)
    foreign: list[tuple[Indices, tuple[Indices, Indices]]] = field(default_factory=list)
    entering: set[int] = field(default_factory=set)

    def put_on(self, line: LetterLine) -> LetterLine:
        """Put these crossbars on the line."""
        return replace(
            line,
            entries=tuple(v for v in line.entries if v not in self.entering),
            bar_entries=tuple(sorted(self.entering)),
            own_bars=tuple(vertices for vertices, _ in self.own),
            foreign_bars=tuple(vertices for vertices, _ in self.foreign),
            bar_overlaps=tuple(overlap for _, overlap in (*self.own, *self.foreign)),
        )


def _letter_line(form: GlyphLine, x_height: float) -> tuple[LetterLine, tuple[Indices, ...]]:
    """A form with its ligatures as one line, and the vertices of each ligature."""
    parts = [(form.xy, form.radius, form.density)]
    edges, sections = [form.edges], []
    count = len(form.xy)
    for way, step in outwards(form):
        places = np.arange(len(way))[::step][1:]
        parts.append((way.xy[places], way.radius[places], way.density[places]))
        numbers = np.arange(count, count + len(places))
        chain = np.concatenate([[way.anchor], numbers])
        edges.append(np.column_stack([chain[:-1], chain[1:]]))
        sections.append(numbers)
        count += len(places)
    xy, radius, density = (np.concatenate(values) for values in zip(*parts, strict=True))
    ends = tuple(int(section[-1]) for section in sections)
    entries, exits = ends[: len(form.entries)], ends[len(form.entries) :]
    return LetterLine(xy, radius, density, np.concatenate(edges), x_height, entries, exits), tuple(sections)


def outwards(form: GlyphLine) -> Iterator[tuple[Connector, int]]:
    """A form's ligatures, entries first, and the step with which their vertices go away from its body."""
    yield from ((way, -1) for way in form.entries)
    yield from ((way, 1) for way in form.exits)


def recorded_strokes(hand: ScannedHand, forms: Forms, number: int, line: LetterLine) -> LetterStrokes:
    """How a glyph of a recorded page was written.

    line : its body, whose vertices are in the order of writing, and after it its ligatures.
    """
    body = forms.vertices(number)
    graph = LineGraph(line.xy, line.radius, line.density, np.zeros((len(line.xy), 2)), line.edges)
    paths = [_from_beginning(path, line, len(body)) for path in graph.branches]
    strokes = sorted(paths, key=lambda path: _first_written(path, body))
    beside = hand.glyphs[number].after
    onward = forms.vertices(beside).min() if beside != NOBODY else np.inf
    return LetterStrokes(tuple(strokes), tuple(bool(body[_first_written(path, body)] > onward) for path in strokes))


def _first_written(path: Indices, body: Indices) -> int:
    """The place in the body of what of a path was written first; a path that is all ligature has the last."""
    return int(min(path[path < len(body)], default=len(body) - 1))


def _from_beginning(path: Indices, line: LetterLine, count: int) -> Indices:
    """Turn a path so that it begins where the pen began."""
    letter_part = path[path < count]
    if len(letter_part) > 1:
        return path if letter_part[0] < letter_part[-1] else path[::-1]
    return path[::-1] if path[-1] in line.entries or path[0] in line.exits else path
