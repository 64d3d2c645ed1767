"""How the letters of one scanned hand are written, each with what is known of those beside it on its page."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import cached_property, lru_cache

import numpy as np

from handout.hand import measures
from handout.hand.letter_classes import CROSSED, CROSSED_CAPITALS
from handout.hand.scanned import NOBODY, ScannedHand
from handout.motion.recovery.author import MARGIN, POOL, WAYS, Habit, Instance, habit, instance, usual
from handout.motion.recovery.failing import Tip, odds, prior, tips
from handout.motion.recovery.letters import ways
from handout.motion.recovery.lines import Line, Way, Written
from handout.motion.recovery.recorded import clocks, recorded
from handout.motion.recovery.spanning import Spanning
from handout.values import Array, Indices
from handout.writing.scanned.bending import measures as body_sizes
from handout.writing.scanned.forms import Form, Forms
from handout.writing.scanned.forms import Way as Ligature

_BAR = 0.7  # of a small letter: no bar is lower
_ALONG = 0.6  # of a way that lies in a bar
_TOUCHED = 8  # vertices of a body that a bar may share where it only ends there
_JOINING = 0.2  # share of a hand's letters joined to the one before, from which bars wait for the end of the word


class Scribe:
    """How the letters of a hand are written, each worked out when it is first asked for.

    width : mm, of the hand's usual line.
    patient : whether dots and bars wait for the end of the word, as they do where letters are joined; people who print
        dot every i at once.
    rate : share of letters that are joined to the next, of those that have one.
    """

    def __init__(self, hand: ScannedHand, hands: tuple[str, ...]) -> None:
        self._hand, self._hands = hand, hands
        self.forms = Forms(hand)
        joins = measures.joins(hand)
        self.patient = joins.share >= measures.JOINED_SHARE
        self._joining = joins.share >= _JOINING
        self.rate = (joins.joined + 0.5) / (joins.pairs + 1)
        self.width = 2 * measures.half_width(hand)
        self._small = measures.x_height(hand)
        self.small_in_halves = measures.x_height_in_half_widths(hand)
        self._slant = measures.slant(hand)
        self._spanning = Spanning(hand, self.forms.paths)
        self._loose: dict[int, list[Tip]] = {}
        self._traced: dict[int, tuple[Instance, tuple[Indices, ...]]] = {}
        self._habits: dict[str, tuple[tuple[int, ...], Habit | None]] = {}
        self._known: dict[int, Written] = {}

    def written(self, number: int) -> tuple[Written, tuple[Indices, ...]]:
        """The strokes of a glyph, and which vertices of its line are those of each of its ways, anchor left out,
        outwards: entries, then exits."""
        traced, sections = self._instance(number)
        found = self._known.get(number)
        if found is None:
            found = self._known[number] = self._chosen(number, traced).written
        return found, sections

    def _chosen(self, number: int, traced: Instance) -> Way:
        """Of the ways in which a glyph may have been written that which its author has the habit of."""
        if len(traced.ways) == 1 or self.forms.marks[number]:
            return traced.ways[0]
        letter = self._hand.glyphs[number].letter
        if letter not in self._habits:
            pool = self._pool(letter)
            self._habits[letter] = pool, habit([self._instance(other)[0] for other in pool])
        pool, known = self._habits[letter]
        if known is None:
            return traced.ways[0]
        return known.choose(traced, pool.index(number) if number in pool else -1)

    def _pool(self, letter: str) -> tuple[int, ...]:
        """Instances of a letter, those that are most as its others are."""
        own = self._hand.of(letter)
        return tuple(own[usual(self._measured[own], POOL)].tolist())

    @cached_property
    def _measured(self) -> Array:
        """(n, 4): of every glyph, see `body_sizes`, and how much line it has."""
        bodies = self.forms.bodies
        size = body_sizes(bodies.xy, bodies.radius, bodies.first, self._small)
        return np.column_stack([size[:, [0, 1, 3]], np.log(bodies.count)])

    def _instance(self, number: int) -> tuple[Instance, tuple[Indices, ...]]:
        """A glyph with the ways in which it may have been written, and the vertices of its ligatures."""
        found = self._traced.get(number)
        if found is None:
            line, sections = _line(self.forms[number], self._small)
            line = self._beside(number, line, sections)
            made = instance(self._ways(number, line), line, len(self.forms[number].xy))
            found = self._traced[number] = (made, sections)
        return found

    def _ways(self, number: int, line: Line) -> list[Way]:
        glyph = self._hand.glyphs[number]
        if self._hand.pages[glyph.page].moments is not None:
            known = recorded(self._hand, self.forms, number, line)
            return [Way(known.strokes, 0.0, lambda: (known.late, known.bars))]
        return ways(line, glyph.letter, hands=self._hands, most=WAYS, margin=MARGIN)

    def clocks(self, number: int) -> tuple[Array, Array] | None:
        """See `recorded.clocks`."""
        return clocks(self._hand, self.forms, number)

    def _beside(self, number: int, line: Line, sections: tuple[Indices, ...]) -> Line:
        """A line with what is known from the letters beside it: bars that come in, and tips where ink has failed."""
        glyph, form = self._hand.glyphs[number], self.forms[number]
        line = self._crossed(number, line, sections)
        begin, through, either = list(line.begin), list(line.through), list(line.either)
        finish = list(line.finish)
        tips = [int(section[-1]) for section in sections[: len(form.entries)]]
        high = [t for t, way in zip(tips, form.entries, strict=True) if way.height > _BAR * self._small and t in begin]
        known = any(bar.letter == glyph.before for bar in self._spanning[number])
        letter_before = self._hand.glyphs[glyph.before].letter if glyph.before != NOBODY else ""
        barred = not known and letter_before in CROSSED | CROSSED_CAPITALS
        facing: list[int] = []
        if glyph.before != NOBODY and (not begin or (barred and high)):
            facing = self._facing(glyph.before, number, entering=True)
        if barred and high:
            begin = [tip for tip in begin if tip not in high]
            sure = bool(begin or facing)
            through, either = (through + high, either) if sure else (through, either + high)
        if not begin and not either:
            begin += facing
        if glyph.after != NOBODY and not finish:
            finish += self._facing(glyph.after, number, entering=False)
        return replace(
            line,
            begin=tuple(begin),
            finish=tuple(finish),
            through=tuple(through),
            either=tuple(either),
            joining=self._joining,
            base=-float(self.forms.centre[number, 1]),
        )

    def _crossed(self, number: int, line: Line, sections: tuple[Indices, ...]) -> Line:
        """A line with the bars that its word has there."""
        bars = self._spanning[number] if self._hand.pages[self._hand.glyphs[number].page].moments is None else ()
        if not bars:
            return line
        glyph, form = self._hand.glyphs[number], self.forms[number]
        paths = (*self.forms.paths.get(glyph.before, ()), *self.forms.paths.get(number, ()))
        place = {int(v): i for i, v in enumerate(self.forms.vertices(number))}
        for (_, step), path, section in zip(outwards(form), paths, sections, strict=True):
            place |= dict(zip(path[::step][1:].tolist(), section.tolist(), strict=True))
        own, others, through, either, gone = list[Indices](), list[Indices](), set[int](), set[int](), set[int]()
        count, shared = len(form.xy), list[list[tuple[Indices, Indices]]]([[], []])
        for bar in bars:
            before, here, after = (
                np.array([place[v] for v in some.tolist() if v in place], dtype=np.intp)
                for some in (bar.before, bar.vertices, bar.after)
            )
            if not len(here):
                continue
            (own if bar.letter == number else others).append(here)
            shared[bar.letter != number].append((before, after))
            over = int((here < count).sum()) > _TOUCHED  # whether it runs over the body, too
            for k, section in enumerate(sections):
                if np.isin(section, here).mean() < _ALONG:
                    continue
                tip = int(section[-1])
                if k < len(form.entries):
                    sure = over and (bar.letter != number or bar.loose[0])
                    (through if sure else either).add(tip)
                elif bar.loose[0] or over:
                    gone.add(tip)
        return replace(
            line,
            begin=tuple(v for v in line.begin if v not in through | either),
            finish=tuple(v for v in line.finish if v not in gone),
            through=tuple(sorted(through)),
            either=tuple(sorted(either - through)),
            across=tuple(sorted(gone)),
            bars=tuple(own),
            others=tuple(others),
            shared=(*shared[0], *shared[1]),
        )

    def _facing(self, other: int, number: int, *, entering: bool) -> list[int]:
        """The tip of a glyph's body that goes on in its neighbour's, if a little ink is missing between them."""
        form = self.forms[number]
        anchors = {way.anchor for way in (*form.entries, *form.exits)}
        ours = [one for one in self._tips(number) if one.vertex not in anchors]
        if not ours:
            return []
        theirs, shift = self._tips(other), self.forms.centre[other] - self.forms.centre[number]
        half = float(np.median(form.radius))
        best, found, chance = 0.0, [], prior(self.rate)
        for one in ours:
            for facing in theirs:
                there = facing.place + shift
                good = odds(one, replace(facing, place=there), half) + chance
                if good > best and (there[0] < one.place[0] + half) == entering:
                    best, found = good, [one.vertex]
        return found

    def _tips(self, number: int) -> list[Tip]:
        found = self._loose.get(number)
        if found is None:
            form = self.forms[number]
            found = self._loose[number] = tips(form.xy, form.radius, form.edges, float(np.median(form.radius)))
        return found


@lru_cache(maxsize=4)
def scribe_of(hand: ScannedHand, hands: tuple[str, ...]) -> Scribe:
    return Scribe(hand, hands)


def _line(form: Form, small: float) -> tuple[Line, tuple[Indices, ...]]:
    """A form with its ways as one line, and the vertices of each way."""
    parts = [(form.xy, form.radius, form.density)]
    edges, sections = [form.edges], []
    count = len(form.xy)
    for way, step in outwards(form):
        own = np.arange(len(way))[::step][1:]
        parts.append((way.xy[own], way.radius[own], way.density[own]))
        numbers = np.arange(count, count + len(own))
        chain = np.concatenate([[way.anchor], numbers])
        edges.append(np.column_stack([chain[:-1], chain[1:]]))
        sections.append(numbers)
        count += len(own)
    xy, radius, density = (np.concatenate(values) for values in zip(*parts, strict=True))
    tips = [int(section[-1]) for section in sections]
    begin, finish = tips[: len(form.entries)], tips[len(form.entries) :]
    return Line(xy, radius, density, np.concatenate(edges), small, tuple(begin), tuple(finish)), tuple(sections)


def outwards(form: Form) -> Iterator[tuple[Ligature, int]]:
    """A form's ways, entries first, and the step with which their vertices go away from its body."""
    yield from ((way, -1) for way in form.entries)
    yield from ((way, 1) for way in form.exits)
