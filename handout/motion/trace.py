"""From a manuscript to timed strokes: what the pen does, in the order in which a person does it.

Letters that are joined become one component; dots, bars and accents follow their word (or their letter, in a hand
that writes so).  A motor engine gives each component its movement; pressure follows from direction and speed.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from importlib import import_module
from itertools import groupby
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from handout.errors import InputError
from handout.motion import ENGINES
from handout.motion.timing import time_in_air
from handout.values import ActionPlan, Array, Drawing, Manuscript, Placed, Stroke
from handout.writing.variation import USUAL, tremor

if TYPE_CHECKING:
    from handout.hand.drawn import Hand
    from handout.hand.scanned import ScannedHand

Engine = Callable[[ActionPlan], tuple[Array, Array]]

STEPS = 12  # samples a point of the plan: about 140 a second


@dataclass(frozen=True)
class PressureModel:
    """Pressure along strokes of drawn hands, 0–1; set by hand, since engines have no model of it."""

    mean: float = 0.55
    pull: float = 0.2  # more in down strokes, which the fingers pull
    ease: float = 0.14  # less where the pen is fast
    landing: float = 0.05  # s from landing to full pressure
    leaving: float = 0.13  # s from full pressure to leaving the paper
    landed: float = 0.55  # of full pressure, on landing
    left: float = 0.12  # of full pressure, on leaving


_PRESS = PressureModel()


@dataclass(frozen=True, eq=False)
class _Component:
    """The points of one pen-down movement, for each the index of its letter in the text, and the word and line."""

    points: Array
    of: NDArray[np.intp]
    word: int
    line: int


def trace(
    manuscript: Manuscript,
    hand: Hand | ScannedHand,
    rng: np.random.Generator,
    engine: str = "optimal-control",
    *,
    speed: float = 1.0,
    jitter: float = 1.0,
) -> Drawing:
    """Timed strokes for a manuscript.

    A drawn hand's letters are plans, which `engine` moves through.  A scanned hand's are ink: `recovery` finds the
    pen's paths over it and `timing` their pace, whatever the engine; each stroke has the colour of its page's ink, and
    there is no tremor.

    engine : {"optimal-control", "sigma-lognormal"}: Source: seed 003 and seed 002; both take the same points.
    speed : pace of the writing, 1 is the hand's own.
    jitter : scale of the variation of pace and of the pen's tremor.

    Raises InputError: unknown engine, or a speed outside 0.05 to 50.
    """
    if not 0.05 <= speed <= 50:
        raise InputError(f"speed: {speed:g} is outside 0.05 to 50 (1 is the pace of a person).")
    if engine not in ENGINES:
        raise InputError(f"kinematics: {engine!r} is unknown; use {' or '.join(ENGINES)}.")
    if hand.pages is not None:
        return _trace_ink(manuscript, hand, rng, speed, jitter)
    module = import_module(f"handout.motion.{engine.replace('-', '_')}")
    follow = partial(module.follow, steps=STEPS, baked_at=hand.drawn_at)
    clock = 0.0
    before: _Component | None = None
    strokes = []
    for component in _components(manuscript, hand):
        if before is not None:
            way = float(np.linalg.norm(component.points[0] - before.points[-1])) / manuscript.x_height
            clock += time_in_air(way, line=component.line != before.line, word=component.word != before.word)
        pace = hand.interval * math.exp(rng.normal(0.0, USUAL.pace * min(jitter, 2.0)))
        t, xy = follow(ActionPlan(component.points, pace, hand.smooth))
        trembling = tremor(rng, len(t), STEPS / pace, USUAL.tremor * jitter * manuscript.x_height)
        strokes.append(Stroke((clock + t) / speed, xy + trembling, pressure=_press(t, xy), word=component.word))
        clock += float(t[-1])
        before = component
    about = {**manuscript.about, "kinematics": engine}
    return Drawing(tuple(strokes), manuscript.page, about)


def _trace_ink(
    manuscript: Manuscript, hand: ScannedHand, rng: np.random.Generator, speed: float, jitter: float
) -> Drawing:
    from handout.hand.measures import ink_colours
    from handout.motion.recovery.pen_paths import list_guessed, pen_paths
    from handout.motion.timing import timed_strokes

    inks = ink_colours(hand)
    ink_of = {
        placed.at: int(inks.of[placed.ink.number]) for line in manuscript.lines for placed in line.placed if placed.ink
    }
    paths = [(path, n) for n, line in enumerate(manuscript.lines) for path in pen_paths(line.placed, hand)]
    timed = timed_strokes(
        [path for path, _ in paths], [n for _, n in paths], manuscript.x_height, rng, speed=speed, jitter=jitter
    )
    guessed = [facts for line in manuscript.lines for facts in list_guessed(line.placed, hand)]
    # a stroke over letters of several inks has that of most of it
    most = (int(np.bincount([ink_of.get(at, 0) for at in path.of.tolist()]).argmax()) for path, _ in paths)
    coloured = tuple(replace(stroke, colour=inks.colours[ink]) for stroke, ink in zip(timed, most, strict=True))
    about = {"hand": hand.name, **manuscript.about}
    return Drawing(coloured, manuscript.page, about | ({"order": guessed} if guessed else {}))


def letters_of_samples(manuscript: Manuscript, hand: Hand) -> tuple[NDArray[np.intp], ...]:
    """Which letter every sample of `trace` writes: for each of its strokes (n,) int, index of the grapheme in the text.

    Between the last point of a letter and the first of the next, joined to it, the samples change hands half way in
    motor time.  That is where they do with optimal control; Sigma-Lognormal pulses reach a point sooner or later.
    """
    steps = (STEPS if len(c.points) > 1 else 2 for c in _components(manuscript, hand))
    return tuple(np.repeat(c.of, n) for c, n in zip(_components(manuscript, hand), steps, strict=True))


def _components(manuscript: Manuscript, hand: Hand) -> Iterator[_Component]:
    """Every pen-down movement of the page in the order of writing."""
    for number, line in enumerate(manuscript.lines):
        for word, placed in groupby(line.placed, key=lambda p: p.word):
            units = list(placed)
            parts = [units] if hand.delayed_after == "word" else [[unit] for unit in units]
            for part in parts:
                yield from (_Component(points, of, word, number) for points, of in _strokes(part))


def _strokes(placed: Sequence[Placed]) -> Iterator[tuple[Array, NDArray[np.intp]]]:
    """The movements of some neighbouring glyphs: joined ones as one, then the delayed strokes.

    With each the index in the text of the letter that every point belongs to.
    """
    current: list[Array] = []
    of: list[int] = []
    delayed: list[tuple[Array, int]] = []
    for unit in placed:
        main, after_word = unit.glyph.part_strokes(unit.strokes)
        delayed += [(stroke, unit.at) for stroke in after_word]
        if unit.joined and current:
            current.append(main.pop(0))
            of.append(unit.at)
        for stroke in main:
            if current:
                yield _join_strokes(current, of)
            current, of = [stroke], [unit.at]
    if current:
        yield _join_strokes(current, of)
    yield from (_join_strokes([stroke], [at]) for stroke, at in delayed)


def _join_strokes(strokes: Sequence[Array], of: Sequence[int]) -> tuple[Array, NDArray[np.intp]]:
    return np.vstack(strokes), np.repeat(np.asarray(of, dtype=np.intp), [len(stroke) for stroke in strokes])


def _press(t: Array, xy: Array) -> Array:
    """Pressure along a stroke: heavier pulling down and where it is slow, light at both tips.  (n,) in 0–1."""
    n = len(t)
    if n < 3:
        return np.full(n, _PRESS.mean)
    velocity = np.zeros((n, 2))
    # both engines sample evenly; at both ends the pen rests
    velocity[1:-1] = (xy[2:] - xy[:-2]) / (2 * (t[1] - t[0]))
    square = velocity[:, 0] ** 2 + velocity[:, 1] ** 2
    usual = math.sqrt(float(square.sum()) / n) or 1.0
    shift = np.tanh(np.stack([velocity[:, 1], np.sqrt(square)]) / usual)
    pressure = _PRESS.mean + 0.6 * _PRESS.ease + _PRESS.pull * shift[0] - _PRESS.ease * shift[1]
    # the pen lands on the paper and flies off it, so strokes taper towards their ends, short ones less
    leaving = min(_PRESS.leaving, 0.3 * float(t[-1] - t[0]))
    landed = _PRESS.landed + (1 - _PRESS.landed) * np.minimum(1.0, (t - t[0]) / _PRESS.landing)
    left = _PRESS.left + (1 - _PRESS.left) * np.minimum(1.0, (t[-1] - t) / leaving)
    return np.asarray(np.minimum(np.maximum(pressure * landed * left, 0.03), 1.0))
