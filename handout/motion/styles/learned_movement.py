"""Moves through a drawing, or through targets, in a manner that was learned.

Source: seed 002, §4.1 (targets of a user) and §4.2 (drawings: their virtual targets with other dynamics).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import groupby

import numpy as np
from msgspec.structs import replace

from handout.motion.learned.dynamics import State
from handout.motion.learned.model import LearnedMovement, plan_dot, taken_apart
from handout.motion.learned.sequences import MovementSequence, of_plans
from handout.motion.reconstruction.plan import LognormalPlan
from handout.motion.reconstruction.shape_fit import plan_of
from handout.motion.styles.manner import measure_manner
from handout.motion.styles.movement import widths
from handout.motion.styles.style import Style
from handout.motion.styles.targets import USUAL_HEIGHT, letter_height
from handout.motion.styles.word_paths import SAMPLES, ReadingOf, WrittenWord, draw_path
from handout.motion.timing import arc_length, time_in_air
from handout.values import TURNS, Array, Drawing, Page, Stroke

_TOGETHER = 64  # ways after which the style is primed anew, where the pen is up: so long were the windows of training
_DRAWS = 2  # times that the dynamics of a word are drawn; of them one is taken


@dataclass(frozen=True, eq=False)
class _PlannedPart:
    """A movement on the paper: its plan before, and the stroke that it was taken from, if any."""

    plan: LognormalPlan
    stroke: Stroke | None


def move_drawing(
    drawing: Drawing, style: Style, rng: np.random.Generator, height: float, reading: ReadingOf | None = None
) -> tuple[Stroke, ...]:
    """The strokes of a drawing, moved through in the style's learned manner; `height` of a letter, mm.

    reading : as in `restyling.restyle`.
    """
    plans = taken_apart(drawing, height)
    parts = [_PlannedPart(plan, stroke) for plan, stroke in zip(plans, drawing.strokes, strict=True)]
    return _draw_parts(parts, style, rng, height, reading)


def through_targets(
    targets: Sequence[Array], style: Style, rng: np.random.Generator, height: float
) -> tuple[Stroke, ...]:
    """Strokes through virtual targets (m, 2) of movements, mm, with dynamics of the style's manner."""
    parts = []
    for each in targets:
        ways = max(len(each) - 1, 0)
        known = plan_of(each, np.full(ways, 0.5), np.zeros(ways)) if ways else plan_dot(each)
        parts.append(_PlannedPart(known, None))
    plain = replace(style, learned=replace(style.learned, hold=0.0, keep=0.0))
    return _draw_parts(parts, plain, rng, height)


@lru_cache(maxsize=8)
def see_manner(primer: MovementSequence) -> Array:
    """What can be seen of the manner of an example that primes a style, as `measure_manner` has it."""
    paths = [draw_path(plan, plan, 0.0) for plan in plans_of(primer)]
    return see_strokes([Stroke(np.arange(len(xy), dtype=np.float64), xy) for xy in paths])


def see_strokes(strokes: Sequence[Stroke]) -> Array:
    """The same of strokes whose letters have whatever size."""
    height = letter_height(Drawing(tuple(strokes), Page(1.0, 1.0)))
    return measure_manner([stroke.xy for stroke in strokes], height)


def _draw_parts(
    parts: Sequence[_PlannedPart],
    style: Style,
    rng: np.random.Generator,
    height: float,
    reading: ReadingOf | None = None,
) -> tuple[Stroke, ...]:
    model, learned = style.model, style.learned
    assert isinstance(model, LearnedMovement)
    state = model.state(style.primer)
    wanted = None if style.primer is None else see_manner(style.primer)
    clock, before, strokes = 0.0, None, list[Stroke]()
    for number, group in groupby(parts, key=lambda part: -1 if part.stroke is None else part.stroke.word):
        word = list(group)
        draws = [_draw_dynamics(word, model, rng, learned.temperature, state) for _ in range(_DRAWS)]
        reads = None if reading is None or number < 0 else reading(number)
        known = WrittenWord([part.plan for part in word], height, learned.hold, wanted, reads)
        for part, xy in zip(word, known.choose_paths(draws, learned.keep), strict=True):
            if before is not None:
                way = float(np.linalg.norm(xy[0] - before)) * USUAL_HEIGHT / height
                clock += time_in_air(way, line=False, word=False)
            strokes.append(_make_stroke(part, clock, xy, style, height))
            clock, before = float(strokes[-1].t[-1]), xy[-1]
    return tuple(strokes)


def _make_stroke(part: _PlannedPart, clock: float, xy: Array, style: Style, height: float) -> Stroke:
    """A stroke along a path that begins at a time, with what the stroke before carries."""
    t = clock + np.arange(len(xy)) * style.learned.duration / SAMPLES
    width = widths(t, xy, style, height)
    nib = style.brush.width * height if style.brush.kind == "nib" else 0.0
    carried = dict[str, Array]()
    if part.stroke is not None:  # its channels along this path, at equal shares of their lengths
        was, now = arc_length(part.stroke.xy), arc_length(xy)
        share = now / max(float(now[-1]), 1e-12) * float(was[-1])
        for name, values in part.stroke.pose.items():
            carried[name] = np.interp(share, was, np.unwrap(values) if name in TURNS else values)
    if nib:
        carried["rotation"] = np.full(len(t), -style.brush.angle)
    source = part.stroke
    word, layer, colour = (-1, "", "") if source is None else (source.word, source.layer, source.colour)
    return Stroke(t, xy, **carried, width=width, nib=nib, word=word, layer=layer, colour=colour)


def _draw_dynamics(
    word: Sequence[_PlannedPart],
    model: LearnedMovement,
    rng: np.random.Generator,
    temperature: float,
    state: State | None,
) -> list[LognormalPlan]:
    """The plans of a word with dynamics of the manner; a long one is moved through in several turns."""
    plans, turn = list[LognormalPlan](), list[LognormalPlan]()
    for k, part in enumerate(word):
        turn.append(part.plan)
        ahead = len(word[k + 1].plan.targets) if k + 1 < len(word) else _TOGETHER
        if sum(len(plan.targets) for plan in turn) + ahead > _TOGETHER:
            plans += plans_of(model.dynamics.predict(of_plans(turn), rng, temperature, state))
            turn.clear()
    return plans


def plans_of(sequence: MovementSequence) -> list[LognormalPlan]:
    """A plan for each movement of a sequence."""
    plans = []
    for part in sequence.parts:
        targets, ways = sequence.targets[part], slice(part.start, part.stop - 1)
        plans.append(
            plan_of(targets, sequence.dt[ways], sequence.theta[ways]) if len(targets) > 1 else plan_dot(targets)
        )
    return plans
