"""The paths of a pen over a page of scanned glyphs: each letter's strokes, joined along the ligatures of its word."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from itertools import groupby, pairwise

import numpy as np

from handout.hand.scanned import NOBODY, ScannedHand
from handout.motion.recovery.letters import Line, Written, write
from handout.motion.recovery.models import HANDS
from handout.motion.optimal_control import follow
from handout.values import ActionPlan, Array, Indices, LineGraph, Placed
from handout.writing.scanned.forms import Form, Forms, Way

_BARRED = "tfTFHAE"
_BAR = 0.7  # of a small letter: no bar is lower
_TIP = 10  # vertices from a tip that tell its direction
_GAP = 5.7  # half widths that ink may fail
_AHEAD = 0.15  # cosine
_SMOOTH = 0.28  # of a line that strikes out, see ActionPlan
_SAME = 1e-6  # mm between two places that are one
_JOINED = 0.45  # share of a hand's letters joined to the one before, from which dots wait for the end of the word


@dataclass(frozen=True, eq=False)
class Path:
    """One pen-down movement over ink.

    xy : (n, 2) float, mm on the page.
    width : (n,) float, mm; density : (n,) float: of the ink there.
    word : index of its word on the page; of : (n,) int, index in the text of the letter it belongs to.
    late : whether it is a dot or bar that is written after the letters it belongs to.
    """

    xy: Array
    width: Array
    density: Array
    word: int
    of: Indices
    late: bool = False


def paths(
    placed: Sequence[Placed], hand: ScannedHand, hands: tuple[str, ...] = HANDS, *, late_after: str = ""
) -> list[Path]:
    """The pen's paths over a line that is written in a scanned hand, in the order of writing.

    Parameters
    ----------
    placed : glyphs of `hand`, and strokes, in the order of the text.
    hands : drawn hands whose forms tell how letters are written.
    late_after : {"word", "letter"}, optional
        When dots, bars and accents are written, which ink does not show; default: after the word in joined hands, else
        after their letter.
    """
    scribe = _scribe(hand, hands)
    patient = late_after == "word" if late_after else scribe.patient
    found: list[Path] = []
    for _, word in groupby(placed, key=lambda one: one.word):
        units = list(word)
        found += _word([one for one in units if one.ink is not None], scribe, patient)
        found += [_drawn(points, one, scribe) for one in units for points in one.strokes]
    return found


def _drawn(points: Array, placed: Placed, scribe: Scribe) -> Path:
    """What was drawn over ink, such as the line that strikes a word out."""
    _, xy = follow(ActionPlan(points, 1.0, _SMOOTH), baked_at=_SMOOTH)
    count = len(xy)
    return Path(xy, np.full(count, scribe.width), np.ones(count), placed.word, np.full(count, placed.at, dtype=np.intp))


class Scribe:
    """How the letters of a hand are written, each worked out when it is first asked for.

    width : mm, of the hand's usual line.
    patient : whether dots and bars wait for the end of the word, as they do where letters are joined; people who print
        dot every i at once.
    """

    def __init__(self, hand: ScannedHand, hands: tuple[str, ...]) -> None:
        self._hand, self._hands = hand, hands
        self.forms = Forms(hand)
        beside = [glyph for glyph in hand.glyphs if glyph.before != NOBODY]
        joined = sum(bool(hand.glyphs[glyph.before].ligatures) for glyph in beside)
        self.patient = joined >= _JOINED * max(len(beside), 1)
        self.width = 2 * float(np.median(np.concatenate([page.graph.radius for page in hand.pages])))
        self._small = float(np.median([page.x_height / page.pitch for page in hand.pages]))
        self._slant = float(np.median([page.slant for page in hand.pages]))
        self._known: dict[int, tuple[Written, tuple[Indices, ...]]] = {}

    def written(self, number: int) -> tuple[Written, tuple[Indices, ...]]:
        """The strokes of a glyph, and which vertices of its line are those of each of its ways, anchor left out,
        outwards: entries, then exits."""
        found = self._known.get(number)
        if found is None:
            line, sections = _line(self.forms[number], self._small)
            line = self._beside(number, line)
            letter = self._hand.glyphs[number].letter
            found = self._known[number] = (write(line, letter, hands=self._hands), sections)
        return found


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
        return replace(line, begin=tuple(begin), finish=tuple(finish), through=tuple(through), either=tuple(either), base=-float(self.forms.centre[number, 1]))

    def _facing(self, other: int, number: int, line: Line, *, entering: bool) -> list[int]:
        """The tip of a glyph's body that goes on in its neighbour's, if a little ink is missing between them."""
        form, beside = self.forms[number], self.forms[other]
        shift = self.forms.centre[other] - self.forms.centre[number]
        ours, theirs = tips(form.xy, form.edges), tips(beside.xy + shift, beside.edges)
        anchors = {way.anchor for way in (*form.entries, *form.exits)}
        best, found = 0.0, []
        half = float(np.median(form.radius))
        for vertex, place, aim in ours:
            for _, there, away in theirs:
                good = bridged(place, aim, there, away, half)
                if good > best and vertex not in anchors and (there[0] < place[0] + half) == entering:
                    best, found = good, [vertex]
        return found


def tips(xy: Array, edges: Indices) -> list[tuple[int, Array, Array]]:
    """Loose ends of a line: vertex, place, and direction outwards."""
    degree = np.bincount(edges.ravel(), minlength=len(xy))
    found = []
    for end in np.flatnonzero(degree == 1).tolist():
        chain, before = [end], -1
        for _ in range(_TIP):
            rows = edges[(edges == chain[-1]).any(axis=1)]
            following = [v for v in rows.ravel().tolist() if v not in (chain[-1], before)]
            if len(following) != 1:
                break
            before = chain[-1]
            chain.append(following[0])
        aim = xy[end] - xy[chain[-1]]
        found.append((end, xy[end], aim / max(float(np.hypot(*aim)), 1e-9)))
    return found


def bridged(place: Array, aim: Array, there: Array, away: Array, half: float) -> float:
    """0–1: how well two tips, each with its direction outwards, go on in one another over a little missing ink."""
    way = there - place
    far = float(np.hypot(*way)) / half
    if far > _GAP:
        return 0.0
    if far < 1e-6:
        return 1.0
    straight = min(float(aim @ way), -float(away @ way)) / (far * half)
    return max(0.0, straight - _AHEAD) if far > 2.5 else 1.0


@lru_cache(maxsize=4)
def _scribe(hand: ScannedHand, hands: tuple[str, ...]) -> Scribe:
    return Scribe(hand, hands)


def _line(form: Form, small: float) -> tuple[Line, tuple[Indices, ...]]:
    """A form with its ways as one line, and the vertices of each way."""
    parts = [(form.xy, form.radius, form.density)]
    edges, sections = [form.edges], []
    count = len(form.xy)
    for way, outwards in _outwards(form):
        own = np.arange(len(way))[::outwards][1:]
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


def _outwards(form: Form) -> Iterator[tuple[Way, int]]:
    """A form's ways, entries first, and the step with which their vertices go away from its body."""
    yield from ((way, -1) for way in form.entries)
    yield from ((way, 1) for way in form.exits)


@dataclass(eq=False)
class _Stroke:
    """A movement while its word is put together.

    vertices : of the glyph's graph; begin, end : the way at whose outer end it begins, ends, or None.
    """

    vertices: Indices
    late: bool
    begin: int | None
    end: int | None


@dataclass(eq=False)
class _Glyph:
    """A placed glyph with its strokes.

    chains : for each way its vertices in the placed graph, anchor first, outwards; None where it is not there.
    """

    placed: Placed
    graph: LineGraph
    entries: int
    chains: list[Indices | None]
    strokes: list[_Stroke] = field(default_factory=list)


def _word(placed: Sequence[Placed], scribe: Scribe, patient: bool) -> Iterator[Path]:
    """The paths of one word."""
    glyphs = [_glyph(one, scribe) for one in placed]
    joins = [{}, *(_joins(a, b) for a, b in pairwise(glyphs))]
    current, late = _Movement([], None), list[_Movement]()
    for glyph, joined, onward in zip(glyphs, joins, [*joins[1:], {}], strict=True):
        if not joined and not patient:
            yield from _ended([current, *late])
            current, late = _Movement([], None), []
        main, after = _shared(glyph, onward)
        entered = False
        for stroke in main:
            part = (glyph, _trimmed(glyph, stroke, joined))
            if not entered and _goes_on(current, stroke, part, joined):
                current, entered = _Movement([*current.parts, part], stroke.end), True
            else:
                yield from _ended([current])
                current = _Movement([part], stroke.end)
        before = [movement for movement in late if movement.leaving is not None]
        late = [movement for movement in late if movement.leaving is None]
        for stroke in after:
            part = (glyph, _trimmed(glyph, stroke, joined))
            # a bar that comes over from the letter before
            whole = [m for m in before if stroke.begin in joined and joined[stroke.begin] == m.leaving]
            before = [m for m in before if m not in whole]
            late.append(_Movement([*(p for m in whole[:1] for p in m.parts), part], stroke.end))
        late = [*(_Movement(m.parts, None) for m in before), *late]
    yield from _ended([current])
    yield from (_path(movement.parts, True) for movement in late)


@dataclass(frozen=True, eq=False)
class _Movement:
    """Parts of several glyphs that are written in one go, and the way by which it left the last of them."""

    parts: list[tuple[_Glyph, Indices]]
    leaving: int | None


def _ended(movements: Sequence[_Movement]) -> Iterator[Path]:
    yield from (_path(movement.parts, number > 0) for number, movement in enumerate(movements) if movement.parts)


def _shared(glyph: _Glyph, onward: dict[int, int]) -> tuple[list[_Stroke], list[_Stroke]]:
    """A glyph's strokes: those that are written with the word, and those that come after it."""
    leads = set(onward.values())
    main = [s for s in glyph.strokes if not s.late]
    exits = [n for n, stroke in enumerate(main) if stroke.end is not None and stroke.end >= glyph.entries]
    last = exits[0] + 1 if exits else len(main)
    # a bar by which alone the word goes on is no bar
    if not exits and (led := [s for s in glyph.strokes if s.late and s.end in leads]):
        return [*main, led[0]], [s for s in glyph.strokes if s.late and s is not led[0]]
    return main[:last], [*main[last:], *(s for s in glyph.strokes if s.late)]


def _goes_on(
    current: _Movement, stroke: _Stroke, part: tuple[_Glyph, Indices], joined: dict[int, int]
) -> bool:
    """Whether a stroke is written without a lift after what was written before it."""
    if not current.parts:
        return False
    if stroke.begin is not None and stroke.begin in joined:
        return joined[stroke.begin] == current.leaving
    return current.leaving is None and _fails(current.parts[-1], part)


def _fails(first: tuple[_Glyph, Indices], second: tuple[_Glyph, Indices]) -> bool:
    """Whether a movement goes on in another with a little ink missing."""
    (one, end), (other, begin) = first, second
    a, b = one.graph.xy[end[-_TIP:]], other.graph.xy[begin[:_TIP]]
    aims = [(xy[i] - xy[j]) / max(float(np.hypot(*(xy[i] - xy[j]))), 1e-9) for xy, i, j in ((a, -1, 0), (b, 0, -1))]
    return bridged(a[-1], aims[0], b[0], aims[1], float(np.median(one.graph.radius))) > 0


def _joins(first: _Glyph, second: _Glyph) -> dict[int, int]:
    """Way into the second → way out of the first that is the same line."""
    found = {}
    for i in range(second.entries):
        into = second.chains[i]
        if into is None or not len(into):
            continue
        for j in range(first.entries, len(first.chains)):
            out = first.chains[j]
            if out is None or not len(out):
                continue
            ends = np.abs(second.graph.xy[into[[0, -1]]] - first.graph.xy[out[[-1, 0]]]).max()
            if ends < _SAME:
                found[i] = j
    return found


def _trimmed(glyph: _Glyph, stroke: _Stroke, joins: dict[int, int]) -> Indices:
    """The vertices of a stroke without a way in that the letter before has already."""
    vertices = stroke.vertices
    if stroke.begin in joins:
        chain = glyph.chains[stroke.begin]
        assert chain is not None
        vertices = vertices[len(chain) - 1 :]
    if stroke.end in joins:
        chain = glyph.chains[stroke.end]
        assert chain is not None
        vertices = vertices[: len(vertices) - len(chain) + 1]
    return vertices


def _path(parts: Sequence[tuple[_Glyph, Indices]], late: bool) -> Path:
    """One path of the parts that several glyphs have in it."""
    xy = np.concatenate([glyph.graph.xy[own] for glyph, own in parts])
    radius = np.concatenate([glyph.graph.radius[own] for glyph, own in parts])
    density = np.concatenate([glyph.graph.density[own] for glyph, own in parts])
    of = np.concatenate([np.full(len(own), glyph.placed.at, dtype=np.intp) for glyph, own in parts])
    return Path(xy, 2 * radius, density, parts[0][0].placed.word, of, late)


def _glyph(placed: Placed, scribe: Scribe) -> _Glyph:
    assert placed.ink is not None
    number, graph = placed.ink.number, placed.ink.graph
    form = scribe.forms[number]
    written, sections = scribe.written(number)
    chains = _chains(graph, form)
    made = _Glyph(placed, graph, len(form.entries), chains)
    section = np.full(len(form.xy) + sum(map(len, sections)), -1, dtype=np.intp)
    for k, own in enumerate(sections):
        section[own] = k
    for vertices, late in zip(written.strokes, written.late, strict=True):
        stroke = _laid(vertices, section, sections, chains, late)
        if stroke is not None:
            made.strokes.append(stroke)
    return made


def _laid(
    vertices: Indices, section: Indices, sections: tuple[Indices, ...], chains: list[Indices | None], late: bool
) -> _Stroke | None:
    """A stroke of a glyph's line on the graph of the placed glyph, whose ways are other than they were."""
    of = section[vertices]
    bounds = [0, *(np.flatnonzero(np.diff(of)) + 1).tolist(), len(of)]
    parts: list[Indices] = []
    begin = end = None
    for a, b in zip(bounds[:-1], bounds[1:], strict=True):
        way = int(of[a])
        if way < 0:
            parts.append(vertices[a:b])
            continue
        chain = chains[way]
        if chain is None:
            continue
        outer = int(sections[way][-1])
        if vertices[a] == outer and a == 0:
            begin = way
        if vertices[b - 1] == outer and b == len(of):
            end = way
        inward = vertices[a] == outer
        parts.append(chain[:0:-1] if inward else chain[1:])
    whole = np.concatenate([np.zeros(0, dtype=np.intp), *parts])
    return _Stroke(whole, late, begin, end) if len(whole) else None


def _chains(graph: LineGraph, form: Form) -> list[Indices | None]:
    """For each way of a form its vertices in a placed graph, anchor first; told by where their ink is from."""
    count = len(form.xy)
    ways = [(way, step) for way, step in _outwards(form)]
    chains: list[Indices | None] = [None] * len(ways)
    added = graph.edges[len(form.edges) :]
    starts = np.flatnonzero(added[:, 0] < count)
    for a, b in pairwise([*starts.tolist(), len(added)]):
        chain = np.concatenate([added[a : a + 1, 0], added[a:b, 1]])
        uv = graph.uv[chain[-1]]
        best, chosen = np.inf, None
        for k, (way, step) in enumerate(ways):
            if chains[k] is not None or way.anchor != chain[0]:
                continue
            away = float(np.hypot(*(way.uv - uv).T).min()) + float(np.hypot(*(way.uv - graph.uv[chain[len(chain) // 2]]).T).min())
            if away < best:
                best, chosen = away, k
        if chosen is not None:
            chains[chosen] = chain
    return chains
