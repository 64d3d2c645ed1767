"""How the letters of one scanned hand are written, each with what is known of those beside it on its page."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import lru_cache

import numpy as np

from handout.hand.scanned import NOBODY, ScannedHand
from handout.motion.recovery.failing import Tip, odds, prior, tips
from handout.motion.recovery.letters import Line, Written, write
from handout.motion.recovery.recorded import clocks, recorded
from handout.values import Array, Indices
from handout.writing.scanned.forms import Form, Forms, Way

_BARRED = "tfTFHAE"
_BAR = 0.7  # of a small letter: no bar is lower
_JOINED = 0.45  # share of a hand's letters joined to the one before, from which dots wait for the end of the word


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
        beside = [glyph for glyph in hand.glyphs if glyph.before != NOBODY]
        joined = sum(bool(hand.glyphs[glyph.before].ligatures) for glyph in beside)
        self.patient = joined >= _JOINED * max(len(beside), 1)
        self.rate = (joined + 0.5) / (len(beside) + 1)
        self.width = 2 * float(np.median(np.concatenate([page.graph.radius for page in hand.pages])))
        self._small = float(np.median([page.x_height / page.pitch for page in hand.pages]))
        wide = [float(np.median(page.graph.radius)) / page.pitch for page in hand.pages]
        self.small_in_halves = self._small / float(np.median(wide))
        self._slant = float(np.median([page.slant for page in hand.pages]))
        self._loose: dict[int, list[Tip]] = {}
        self._known: dict[int, tuple[Written, tuple[Indices, ...]]] = {}

    def written(self, number: int) -> tuple[Written, tuple[Indices, ...]]:
        """The strokes of a glyph, and which vertices of its line are those of each of its ways, anchor left out,
        outwards: entries, then exits."""
        found = self._known.get(number)
        if found is None:
            line, sections = _line(self.forms[number], self._small)
            line = self._beside(number, line)
            found = self._known[number] = (self._write(number, line), sections)
        return found

    def _write(self, number: int, line: Line) -> Written:
        glyph = self._hand.glyphs[number]
        if self._hand.pages[glyph.page].moments is not None:
            return recorded(self._hand, self.forms, number, line)
        return write(line, glyph.letter, hands=self._hands)

    def clocks(self, number: int) -> tuple[Array, Array] | None:
        """See `recorded.clocks`."""
        return clocks(self._hand, self.forms, number)

    def _beside(self, number: int, line: Line) -> Line:
        """A line with what is known from the letters beside it: bars that come in, and tips where ink has failed."""
        glyph, form = self._hand.glyphs[number], self.forms[number]
        begin, through, either = list(line.begin), list[int](), list[int]()
        finish = list(line.finish)
        facing = self._facing(glyph.before, number, line, entering=True) if glyph.before != NOBODY else []
        high = [tip for tip, way in zip(line.begin, form.entries, strict=True) if way.height > _BAR * self._small]
        barred = glyph.before != NOBODY and self._hand.glyphs[glyph.before].letter in _BARRED
        if barred and high:
            begin = [tip for tip in begin if tip not in high]
            through, either = (high, []) if begin or facing else ([], high)
        if not begin and not either:
            begin += facing
        if glyph.after != NOBODY and not finish:
            finish += self._facing(glyph.after, number, line, entering=False)
        return replace(
            line,
            begin=tuple(begin),
            finish=tuple(finish),
            through=tuple(through),
            either=tuple(either),
            base=-float(self.forms.centre[number, 1]),
        )

    def _facing(self, other: int, number: int, line: Line, *, entering: bool) -> list[int]:
        """The tip of a glyph's body that goes on in its neighbour's, if a little ink is missing between them."""
        form = self.forms[number]
        shift = self.forms.centre[other] - self.forms.centre[number]
        ours, theirs = self._tips(number), self._tips(other)
        anchors = {way.anchor for way in (*form.entries, *form.exits)}
        half = float(np.median(form.radius))
        best, found, chance = 0.0, [], prior(self.rate)
        for one in ours:
            for facing in theirs:
                there = facing.place + shift
                good = odds(one, replace(facing, place=there), half) + chance
                if good > best and one.vertex not in anchors and (there[0] < one.place[0] + half) == entering:
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


def outwards(form: Form) -> Iterator[tuple[Way, int]]:
    """A form's ways, entries first, and the step with which their vertices go away from its body."""
    yield from ((way, -1) for way in form.entries)
    yield from ((way, 1) for way in form.exits)
