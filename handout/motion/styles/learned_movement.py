"""Moves through a drawing, or through targets, in a manner that was learned.

Source: seed 002, §4.1 (targets of a user) and §4.2 (drawings: their virtual targets with other dynamics).
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import groupby

import numpy as np
from msgspec.structs import replace

from handout.motion import sigma_lognormal_model as lognormal
from handout.motion.learned.model import LearnedMovement, plan_dot, taken_apart
from handout.motion.learned.sequences import MovementSequence, of_plans
from handout.motion.reconstruction.plan import LognormalPlan
from handout.motion.reconstruction.shape_fit import path_matrix, plan_of
from handout.motion.styles.movement import widths
from handout.motion.styles.style import Style
from handout.motion.timing import arc_length, time_in_air
from handout.values import TURNS, Array, Drawing, Stroke

_SAMPLES = 60  # in the duration of a stroke: 200 a second at the usual .3 s
_TOGETHER = 64  # ways after which the style is primed anew, where the pen is up: so long were the windows of training
_RIDGE = 0.03  # how much virtual targets stay, against the places that they lead through, as in `optimal_control`
_HEIGHTS_IN_X = 1.5  # x-heights in the height of a letter


@dataclass(frozen=True, eq=False)
class _PlannedPart:
    """A movement on the paper: its plan before, and the stroke that it was taken from, if any."""

    plan: LognormalPlan
    stroke: Stroke | None


def move_drawing(drawing: Drawing, style: Style, rng: np.random.Generator, height: float) -> tuple[Stroke, ...]:
    """The strokes of a drawing, moved through in the style's learned manner; `height` of a letter, mm."""
    parts = [
        _PlannedPart(plan, stroke) for plan, stroke in zip(taken_apart(drawing, height), drawing.strokes, strict=True)
    ]
    return _draw_groups(_groups(parts), style, rng, height)


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
    return _draw_groups(_groups(parts), plain, rng, height)


def _groups(parts: Sequence[_PlannedPart]) -> Iterator[list[_PlannedPart]]:
    """The parts of each word; of a long one, or of a drawing without words, so many as are moved through together."""
    for _, word in groupby(parts, key=lambda part: -1 if part.stroke is None else part.stroke.word):
        group: list[_PlannedPart] = []
        for part in word:
            if group and sum(len(p.plan.targets) for p in group) + len(part.plan.targets) > _TOGETHER:
                yield group
                group = []
            group.append(part)
        if group:
            yield group


def _draw_groups(
    groups: Iterator[list[_PlannedPart]], style: Style, rng: np.random.Generator, height: float
) -> tuple[Stroke, ...]:
    manner, learned = style.model, style.learned
    assert isinstance(manner, LearnedMovement)
    state = manner.state(style.primer)
    clock, before, strokes = 0.0, None, list[Stroke]()
    for group in groups:
        # the plans with dynamics between those of the manner and their own, as far as they keep them
        known = of_plans([part.plan for part in group])
        told, keep = manner.dynamics.predict(known, rng, learned.temperature, state), learned.keep
        dt, theta = ((1 - keep) * new + keep * old for new, old in ((told.dt, known.dt), (told.theta, known.theta)))
        for part, plan in zip(group, plans_of(dataclasses.replace(told, dt=dt, theta=theta)), strict=True):
            xy = _path(part.plan, plan, learned.hold)
            if before is not None:
                way = float(np.linalg.norm(xy[0] - before)) * _HEIGHTS_IN_X / height
                clock += time_in_air(way, line=False, word=False)
            t = clock + np.arange(len(xy)) * learned.duration / _SAMPLES
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
            strokes.append(Stroke(t, xy, **carried, width=width, nib=nib, word=word, layer=layer, colour=colour))
            clock, before = float(t[-1]), xy[-1]
    return tuple(strokes)


def plans_of(sequence: MovementSequence) -> list[LognormalPlan]:
    """A plan for each movement of a sequence."""
    plans = []
    for part in sequence.parts:
        targets, ways = sequence.targets[part], slice(part.start, part.stop - 1)
        plans.append(
            plan_of(targets, sequence.dt[ways], sequence.theta[ways]) if len(targets) > 1 else plan_dot(targets)
        )
    return plans


def _path(known: LognormalPlan, plan: LognormalPlan, hold: float) -> Array:
    """(n, 2) mm, evenly in time: the path of a plan, led by `hold` through the places that the known one passes."""
    if not plan.strokes:
        return np.repeat(plan.targets, 2, axis=0)
    z = plan.targets @ np.array([1.0, 1j])
    if hold > 0:
        passing = _passing(plan)
        linear = path_matrix(lognormal.arc(lognormal.progress(plan.pulses(), passing), plan.theta[:, None]))
        places = known.position_at(_passing(known)) @ np.array([1.0, 1j])
        rows = np.concatenate([linear, np.sqrt(_RIDGE) * np.eye(len(z))])
        led = np.linalg.lstsq(rows, np.concatenate([places, np.sqrt(_RIDGE) * z]), rcond=None)[0]
        z = z + hold * (led - z)
    pulses = plan.pulses()
    start, end = pulses.span
    samples = max(round((end - start) * _SAMPLES / float(plan.duration[0])), 2)
    path = z[0] + lognormal.path(pulses, np.diff(z), start, (end - start) / (samples - 1), samples)
    return np.column_stack([path.real, path.imag])


def _passing(plan: LognormalPlan) -> Array:
    """(m,) s: when a plan passes from each stroke to the next: half-way between their medians; at its ends, those."""
    pulses = plan.pulses()
    middle = pulses.time(0.0)
    start, end = pulses.span
    return np.concatenate([[start], 0.5 * (middle[1:] + middle[:-1]), [end]])
