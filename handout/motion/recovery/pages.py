"""The paths of a pen over a page of scanned glyphs: each letter's strokes, joined along the ligatures of its word."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import groupby, pairwise

import numpy as np

from handout.hand.letter_classes import CROSSED, CROSSED_ASLANT, CROSSED_CAPITALS
from handout.hand.scanned import ScannedHand
from handout.motion.optimal_control import follow
from handout.motion.recovery.models import HANDS
from handout.motion.recovery.placing import PlacedGlyph, PlacedStroke, fails, place, shared, trimmed
from handout.motion.recovery.scribe import Scribe, scribe_of
from handout.motion.recovery.stitching import Ink
from handout.motion.recovery.weaving import unwound, weave
from handout.values import POSE, ActionPlan, Array, Indices, Placed

_BACK = 3.0  # of a small letter that the pen goes back over its ink rather than be lifted
_WAITING = CROSSED | CROSSED_ASLANT | CROSSED_CAPITALS  # letters whose last strokes may come after the next letter
_SMOOTH = 0.28  # of a line that strikes out, see ActionPlan


@dataclass(frozen=True, eq=False)
class Path:
    """One pen-down movement over ink.

    xy : (n, 2) float, mm on the page.
    width : (n,) float, mm; density : (n,) float: of the ink there.
    word : index of its word on the page; of : (n,) int, index in the text of the letter it belongs to.
    late : whether it is a dot or bar that is written after the letters it belongs to.
    steps : (n − 1,) float, s: how long a recorded pen took from each place to the next, nan where that is not known.
    pose : (n, 4) float: how it was held (the channels of `POSE`), nan where that is not known.
    """

    xy: Array
    width: Array
    density: Array
    word: int
    of: Indices
    late: bool = False
    steps: Array | None = None
    pose: Array | None = None


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
    scribe = scribe_of(hand, hands)
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


def _word(placed: Sequence[Placed], scribe: Scribe, patient: bool) -> Iterator[Path]:
    """The paths of one word."""
    glyphs = [place(one, scribe) for one in placed]
    joins: list[dict[int, int]] = [{}, *(shared(a, b) for a, b in pairwise(glyphs))]
    for (a, b), joined in zip(pairwise(glyphs), joins[1:], strict=True):
        weave(a, b, joined)
    current, late, done = _Movement([], None), list[_Movement](), list[_Movement]()
    patient = patient or any(glyph.clocks is not None for glyph in glyphs)
    behind = [None, *glyphs[:-1]]
    leads = [*map(_led, glyphs[1:], joins[1:]), {}]
    for glyph, last, joined, onward in zip(glyphs, behind, joins, leads, strict=True):
        if late and not joined and not patient:
            yield from _ended(_stitched([*done, current], glyphs, scribe), late)
            current, late, done = _Movement([], None), [], []
        main, after = _parted(glyph, onward)
        entered = False
        for stroke in main:
            part = (glyph, trimmed(glyph, stroke, joined))
            if not entered and _goes_on(current, stroke, part, joined, scribe.rate):
                parts = [*current.parts, part, *stroke.then]
                current, entered = _Movement(unwound(parts) if stroke.then else parts, stroke.end), True
            else:
                done.append(current)
                current = _Movement([part, *stroke.then], stroke.end, stroke.bar)
        before = [movement for movement in late if movement.leaving is not None]
        late = [movement for movement in late if movement.leaving is None]
        for stroke in after:
            # a bar that comes over from the letter before
            whole = [m for m in before if stroke.begin in joined and joined[stroke.begin] == m.leaving]
            part = (glyph, trimmed(glyph, stroke, joined if whole else {}))
            before = [m for m in before if m not in whole]
            if not whole and last is not None and stroke.begin in joined:
                over = (glyph, trimmed(glyph, stroke, joined))
                if _led_on(done, last, joined[stroke.begin], over, stroke.end):
                    continue
            late.append(_Movement([*(p for m in whole[:1] for p in m.parts), part], stroke.end))
        late = [*(_Movement(m.parts, None) for m in before), *late]
    yield from _ended(_stitched([*done, current], glyphs, scribe), late)


def _led_on(
    done: list[_Movement], last: PlacedGlyph, way: int, over: tuple[PlacedGlyph, Indices], end: int | None
) -> bool:
    """Whether a bar of the last letter, which did not wait, has left it by a way; then it is led on over this one."""
    for i, movement in enumerate(done):
        if movement.bar and movement.leaving == way and movement.parts[-1][0] is last:
            done[i] = _Movement([*movement.parts, over], end, bar=True)
            return True
    return False


@dataclass(frozen=True, eq=False)
class _Movement:
    """Parts of several glyphs that are written in one go.

    leaving : the way by which it left the last of them.
    bar : whether it is nothing but a bar, which the pen is lifted for.
    """

    parts: list[tuple[PlacedGlyph, Indices]]
    leaving: int | None
    bar: bool = False


def _stitched(movements: Sequence[_Movement], glyphs: Sequence[PlacedGlyph], scribe: Scribe) -> list[_Movement]:
    """The movements of a word, those in one that go on in one another over a little of their own ink."""
    written = [movement for movement in movements if movement.parts]
    if len(written) < 2:
        return written
    ink: Ink | None = None
    half = float(np.median(np.concatenate([glyph.graph.radius for glyph in glyphs])))
    found = written[:1]
    for movement in written[1:]:
        before, after = found[-1].parts[-1], movement.parts[0]
        # capitals and marks are lifted for by nearly everybody; of a recorded pen it is known when it was lifted
        free = all(g.placed.glyph.letter.islower() and g.clocks is None for g, _ in (before, after))
        free = free and not (found[-1].bar or movement.bar)
        way = None
        if free:
            ink = ink or Ink(glyphs, scribe.rate)
            way = ink.way(before, after, _BACK * half * scribe.small_in_halves)
        if way is None:
            found.append(movement)
        else:
            found[-1] = _Movement([*found[-1].parts, *way, *movement.parts], movement.leaving)
    return found


def _ended(movements: Sequence[_Movement], late: Sequence[_Movement]) -> Iterator[Path]:
    yield from (_path(movement.parts, False) for movement in movements if movement.parts)
    yield from (_path(movement.parts, True) for movement in late if movement.parts)


def _led(glyph: PlacedGlyph, joined: dict[int, int]) -> dict[int, int]:
    """Of the ways into a glyph those by which the pen comes in that writes it, not a bar."""
    return {into: out for into, out in joined.items() if any(s.begin == into and not s.late for s in glyph.strokes)}


def _parted(glyph: PlacedGlyph, onward: dict[int, int]) -> tuple[list[PlacedStroke], list[PlacedStroke]]:
    """A glyph's strokes: those that are written with the word, and those that come after it."""
    leads = set(onward.values())
    main = [s for s in glyph.strokes if not s.late]
    exits = [n for n, stroke in enumerate(main) if stroke.end is not None and stroke.end >= glyph.entries]
    # a bar by which alone the word goes on is no bar
    if not exits and (led := [s for s in glyph.strokes if s.late and s.end in leads]):
        return [*main, led[0]], [s for s in glyph.strokes if s.late and s is not led[0]]
    late = [s for s in glyph.strokes if s.late]
    if not exits:
        return main, late
    leaving = next((n for n in exits if main[n].end in leads), exits[-1])
    if glyph.placed.glyph.letter in _WAITING or main[leaving].begin is not None:
        return main[: exits[0] + 1], [*main[exits[0] + 1 :], *late]
    # who has no bar to come back for leaves a letter when all of it is there
    return [*main[:leaving], *main[leaving + 1 :], main[leaving]], late


def _goes_on(
    current: _Movement, stroke: PlacedStroke, part: tuple[PlacedGlyph, Indices], joined: dict[int, int], rate: float
) -> bool:
    """Whether a stroke is written without a lift after what was written before it."""
    if not current.parts:
        return False
    if stroke.begin is not None and stroke.begin in joined:
        return joined[stroke.begin] == current.leaving
    # where the pen was recorded it is known that it was lifted
    known = any(glyph.clocks is not None for glyph, _ in (current.parts[-1], part))
    return current.leaving is None and not known and fails(current.parts[-1], part, rate)


def _path(parts: Sequence[tuple[PlacedGlyph, Indices]], late: bool) -> Path:
    """One path of the parts that several glyphs have in it."""
    xy = np.concatenate([glyph.graph.xy[own] for glyph, own in parts])
    radius = np.concatenate([glyph.graph.radius[own] for glyph, own in parts])
    density = np.concatenate([glyph.graph.density[own] for glyph, own in parts])
    of = np.concatenate([np.full(len(own), glyph.placed.at, dtype=np.intp) for glyph, own in parts])
    return Path(xy, 2 * radius, density, parts[0][0].placed.word, of, late, *_recorded(parts))


def _recorded(parts: Sequence[tuple[PlacedGlyph, Indices]]) -> tuple[Array | None, Array | None]:
    """How long a recorded pen took for the steps of a path, and how it was held; None where no pen was recorded."""
    if all(glyph.clocks is None for glyph, _ in parts):
        return None, None
    steps, pose = list[Array](), list[Array]()
    for glyph, own in parts:
        known, held = np.full(len(glyph.graph), np.nan), np.full((len(glyph.graph), len(POSE)), np.nan)
        if glyph.clocks is not None:
            known[: len(glyph.clocks[0])], held[: len(glyph.clocks[1])] = glyph.clocks
        following = np.abs(np.diff(own)) == 1
        steps += [np.where(following, np.abs(np.diff(known[own])), np.nan), np.array([np.nan])]
        pose.append(held[own])
    return np.concatenate(steps)[:-1], np.concatenate(pose)
