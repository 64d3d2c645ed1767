"""The paths of a pen over a page of scanned glyphs: each letter's strokes, joined along the ligatures of its word."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from itertools import compress, groupby, pairwise
from typing import Any

import numpy as np

from handout.hand.letter_classes import CROSSED, CROSSED_ASLANT, CROSSED_CAPITALS
from handout.hand.scanned import NOBODY, ScannedHand
from handout.motion.optimal_control import follow
from handout.motion.recovery.letter_forms import HANDS
from handout.motion.recovery.letter_line import LetterLine
from handout.motion.recovery.letter_tracing import trace_letter
from handout.motion.recovery.placed_strokes import (
    Part,
    PlacedGlyph,
    PlacedStroke,
    WordInk,
    goes_on_over_gap,
    place_strokes,
    shared_ligatures,
    without_shared,
)
from handout.motion.recovery.stroke_order import StrokeOrderModel, stroke_order_model
from handout.networks import one_thread
from handout.values import POSE, ActionPlan, Array, Indices, Placed

_BACK = 3.0  # x-heights that the pen goes back over its ink rather than be lifted
_DELAYED = CROSSED | CROSSED_ASLANT | CROSSED_CAPITALS  # letters whose last strokes may come after the next letter
_X_HEIGHT = 13.0  # half widths of a usual line in an x-height: of ink of no letters nothing else tells the size
_SMALL = 0.6  # x-heights: what is no larger is a dot or an accent
_SMOOTH = 0.28  # of a line that strikes out, see ActionPlan


@dataclass(frozen=True, eq=False)
class PenPath:
    """One pen-down movement over ink.

    xy : (n, 2) float, mm on the page.
    width : (n,) float, mm; density : (n,) float: of the ink there.
    word : index of its word on the page; of : (n,) int, index in the text of the letter it belongs to.
    delayed : whether it is a dot or crossbar that is written after the letters it belongs to.
    steps : (n − 1,) float, s: how long a recorded pen took from each place to the next, nan where that is not known.
    pose : (n, 4) float: how it was held (the channels of `POSE`), nan where that is not known.
    """

    xy: Array
    width: Array
    density: Array
    word: int
    of: Indices
    delayed: bool = False
    steps: Array | None = None
    pose: Array | None = None


@one_thread
def pen_paths(
    placed: Sequence[Placed], hand: ScannedHand, hands: tuple[str, ...] = HANDS, *, delayed_after: str = "letter"
) -> list[PenPath]:
    """The pen's paths over a line that is written in a scanned hand, in the order of writing.

    placed : glyphs of `hand`, and strokes, in the order of the text.
    hands : drawn hands whose forms tell how letters are written.
    delayed_after : {"letter", "word"}: when dots, crossbars and accents are written, which ink does not show: once the
        pen is lifted after their letter, as most recorded writers do, or at the end of the word.
    """
    model = stroke_order_model(hand, hands)
    paths: list[PenPath] = []
    for _, word in groupby(placed, key=lambda glyph: glyph.word):
        units = list(word)
        if inked := [unit for unit in units if unit.ink is not None and unit.ink.number != NOBODY]:
            paths += _word_paths(inked, model, delayed_after == "word")
        paths += [path for unit in units if unit.ink and unit.ink.number == NOBODY for path in _follow_scribble(unit)]
        for unit, points in [(each, points) for each in units for points in each.strokes]:
            # what was drawn over ink, such as the line that strikes a word out
            _, xy = follow(ActionPlan(points, 1.0, _SMOOTH), baked_at=_SMOOTH)
            of = np.full(len(xy), unit.at, dtype=np.intp)
            paths.append(PenPath(xy, np.full(len(xy), model.width), np.ones(len(xy)), unit.word, of))
    return paths


def list_guessed(placed: Sequence[Placed], hand: ScannedHand, hands: tuple[str, ...] = HANDS) -> list[dict[str, Any]]:
    """The words of a line of whose letters some may as well have been written in another order.

    Of each its letters, its first one's index in the text, and the letters whose order is a guess, as `--json` has it.
    """
    model, found = stroke_order_model(hand, hands), []
    for _, word in groupby(placed, key=lambda glyph: glyph.word):
        units = [unit for unit in word if unit.glyph.letter]
        inked = ((unit.glyph.letter, unit.ink.number) for unit in units if unit.ink and unit.ink.number != NOBODY)
        if guessed := [letter for letter, number in inked if model.strokes_of(number)[0].guessed]:
            name = "".join(unit.glyph.letter for unit in units)
            found.append({"word": name, "at": units[0].at, "order": "guessed", "letters": guessed})
    return found


def _follow_scribble(placed: Placed) -> Iterator[PenPath]:
    """Follow ink that is no letters, such as a signature: piece after piece from the left, then the small ones."""
    assert placed.ink is not None
    graph = placed.ink.graph
    x_height = _X_HEIGHT * float(np.median(graph.radius)) if len(graph) else 0.0
    pieces = [np.flatnonzero(graph.components == number) for number in np.unique(graph.components)]
    small = [float(np.ptp(graph.xy[piece], axis=0).max()) < _SMALL * x_height for piece in pieces]
    for late, piece in sorted(zip(small, pieces, strict=True), key=lambda p: (p[0], graph.xy[p[1], 0].min())):
        part = graph.take(piece)
        line = LetterLine(part.xy * (1.0, -1.0), part.radius, part.density, part.edges, x_height, joined_hand=True)
        for stroke in trace_letter(line, "").strokes:
            of = np.full(len(stroke), placed.at, dtype=np.intp)
            yield PenPath(part.xy[stroke], 2 * part.radius[stroke], part.density[stroke], placed.word, of, late)


def _word_paths(placed: Sequence[Placed], model: StrokeOrderModel, delays: bool) -> Iterator[PenPath]:
    """The paths of one word."""
    glyphs = [place_strokes(glyph, model) for glyph in placed]
    shared: list[dict[int, int]] = [{}, *(shared_ligatures(a, b) for a, b in pairwise(glyphs))]
    delays = delays or any(glyph.clocks is not None for glyph in glyphs)
    # ligatures out of each glyph by which the pen comes into the next that writes it, and not only a crossbar
    begun = [{s.begin for s in glyph.strokes if not s.delayed} for glyph in glyphs[1:]]
    onward = [{out for into, out in j.items() if into in b} for b, j in zip(begun, shared[1:], strict=True)]
    onward.append(set())
    written = _Written()
    for glyph, joins, leads in zip(glyphs, shared, onward, strict=True):
        if written.delayed and not joins and not delays:
            yield from written.paths(glyphs, model)
            written = _Written()
        at_once, later = _divide(glyph, leads)
        written.write(glyph, at_once, joins, model.joined_share)
        written.delay(glyph, later, joins)
    yield from written.paths(glyphs, model)


@dataclass(frozen=True, eq=False)
class _GlyphsMovement:
    """Parts of several glyphs that are written in one go.

    leaving : the ligature by which it left the last of them.
    bar : whether it is nothing but a crossbar, which the pen is lifted for.
    """

    parts: list[Part]
    leaving: int | None
    bar: bool = False


@dataclass(eq=False)
class _Written:
    """What of a word is written so far: movements that are done, the current one, and those that wait for its end."""

    done: list[_GlyphsMovement] = field(default_factory=list)
    current: _GlyphsMovement = field(default_factory=lambda: _GlyphsMovement([], None))
    delayed: list[_GlyphsMovement] = field(default_factory=list)

    def write(
        self, glyph: PlacedGlyph, strokes: Sequence[PlacedStroke], joins: dict[int, int], joined_share: float
    ) -> None:
        """Write a glyph's strokes; the first that can goes on from what was written before, without a lift."""
        entered = False
        for stroke in strokes:
            part = (glyph, without_shared(glyph, stroke, joins))
            if not entered and self._goes_on(stroke, part, joins, joined_share):
                self.current, entered = _GlyphsMovement([*self.current.parts, part], stroke.end), True
            else:
                self.done.append(self.current)
                self.current = _GlyphsMovement([part], stroke.end, stroke.bar)

    def _goes_on(self, stroke: PlacedStroke, part: Part, joins: dict[int, int], joined_share: float) -> bool:
        """Whether a stroke is written without a lift after what was written before it."""
        if not self.current.parts:
            return False
        if stroke.begin is not None and stroke.begin in joins:
            return joins[stroke.begin] == self.current.leaving
        # where the pen was recorded it is known that it was lifted
        recorded = any(glyph.clocks is not None for glyph, _ in (self.current.parts[-1], part))
        if self.current.leaving is not None or recorded:
            return False
        return goes_on_over_gap(self.current.parts[-1], part, joined_share)

    def delay(self, glyph: PlacedGlyph, strokes: Sequence[PlacedStroke], joins: dict[int, int]) -> None:
        """Delay a glyph's strokes; one that comes from the last glyph continues what waits of that glyph."""
        waiting, crossing = _split_by_ligature(self.delayed, None)
        for stroke in strokes:
            ligature = None if stroke.begin is None else joins.get(stroke.begin)
            begun, crossing = _split_by_ligature(crossing, ligature)
            over = (glyph, without_shared(glyph, stroke, joins))
            if begun:
                waiting.append(_GlyphsMovement([*begun[0].parts, over], stroke.end))
            else:
                waiting.append(_GlyphsMovement([(glyph, stroke.vertices)], stroke.end))
        self.delayed = [*(_GlyphsMovement(m.parts, None) for m in crossing), *waiting]

    def paths(self, glyphs: Sequence[PlacedGlyph], model: StrokeOrderModel) -> Iterator[PenPath]:
        """The paths of all that is written, then of what waited."""
        movements = join_over_ink([*self.done, self.current], glyphs, model)
        yield from (_path(movement.parts, False) for movement in movements if movement.parts)
        yield from (_path(movement.parts, True) for movement in self.delayed if movement.parts)


def _split_by_ligature(
    movements: Sequence[_GlyphsMovement], ligature: int | None
) -> tuple[list[_GlyphsMovement], list[_GlyphsMovement]]:
    """The movements that leave by a ligature, and the others."""
    leaving = [movement.leaving == ligature for movement in movements]
    return list(compress(movements, leaving)), [m for m, left in zip(movements, leaving, strict=True) if not left]


def join_over_ink(
    movements: Sequence[_GlyphsMovement], glyphs: Sequence[PlacedGlyph], model: StrokeOrderModel
) -> list[_GlyphsMovement]:
    """The movements of a word, those joined that go on in one another over a little of the word's own ink.

    Where a stem is gone over twice, or a letter is closed by retracing, the line shows one way only, and it is easily
    taken for the end of a movement.  Who joins letters does not lift the pen there.
    """
    written = [movement for movement in movements if movement.parts]
    if len(written) < 2:
        return written
    ink: WordInk | None = None
    half_width = float(np.median(np.concatenate([glyph.graph.radius for glyph in glyphs])))
    joined = written[:1]
    for movement in written[1:]:
        before, after = joined[-1].parts[-1], movement.parts[0]
        # capitals and marks are lifted for by nearly everybody; of a recorded pen it is known when it was lifted
        free = all(g.placed.glyph.letter.islower() and g.clocks is None for g, _ in (before, after))
        way = None
        if free and not (joined[-1].bar or movement.bar):
            ink = ink or WordInk(glyphs, model.joined_share)
            way = ink.path_between(before, after, _BACK * half_width * model.half_widths)
        if way is None:
            joined.append(movement)
        else:
            joined[-1] = _GlyphsMovement([*joined[-1].parts, *way, *movement.parts], movement.leaving)
    return joined


def _divide(glyph: PlacedGlyph, leads: set[int]) -> tuple[list[PlacedStroke], list[PlacedStroke]]:
    """A glyph's strokes: those that are written with the word, and those that come after it.

    leads : ligatures by which the pen goes to the next letter.
    """
    main, delayed = ([s for s in glyph.strokes if s.delayed == late] for late in (False, True))
    exits = [n for n, stroke in enumerate(main) if glyph.is_left_by(stroke)]
    if not exits:
        # a bar that is the only way on to the next letter is no bar
        onward = [s for s in delayed if s.end in leads][:1]
        return [*main, *onward], [s for s in delayed if s not in onward]
    leaving = next((n for n in exits if main[n].end in leads), exits[-1])
    if glyph.placed.glyph.letter in _DELAYED or main[leaving].begin is not None:
        return main[: exits[0] + 1], [*main[exits[0] + 1 :], *delayed]
    # where there is no bar to come back for the pen leaves a letter when all of it is written
    return [*main[:leaving], *main[leaving + 1 :], main[leaving]], delayed


def _path(parts: Sequence[Part], delayed: bool) -> PenPath:
    """One path of the parts that several glyphs have in it."""
    xy = np.concatenate([glyph.graph.xy[vertices] for glyph, vertices in parts])
    radius = np.concatenate([glyph.graph.radius[vertices] for glyph, vertices in parts])
    density = np.concatenate([glyph.graph.density[vertices] for glyph, vertices in parts])
    of = np.concatenate([np.full(len(vertices), glyph.placed.at, dtype=np.intp) for glyph, vertices in parts])
    return PenPath(xy, 2 * radius, density, parts[0][0].placed.word, of, delayed, *_gather_recording(parts))


def _gather_recording(parts: Sequence[Part]) -> tuple[Array | None, Array | None]:
    """How long a recorded pen took for the steps of a path, and how it was held; None where no pen was recorded."""
    if all(glyph.clocks is None for glyph, _ in parts):
        return None, None
    steps, poses = list[Array](), list[Array]()
    for glyph, vertices in parts:
        times, pose = np.full(len(glyph.graph), np.nan), np.full((len(glyph.graph), len(POSE)), np.nan)
        if glyph.clocks is not None:
            times[: len(glyph.clocks[0])], pose[: len(glyph.clocks[1])] = glyph.clocks
        following = np.abs(np.diff(vertices)) == 1
        steps += [np.where(following, np.abs(np.diff(times[vertices])), np.nan), np.array([np.nan])]
        poses.append(pose[vertices])
    return np.concatenate(steps)[:-1], np.concatenate(poses)
