"""A page of plans: fits a plan to every stroke of a drawing, and draws plans."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from handout.motion import sigma_lognormal_model as lognormal
from handout.motion.reconstruction import recording_fit, shape_fit
from handout.motion.reconstruction.key_points import extent, resample_path, snr
from handout.motion.reconstruction.plan import LognormalPlan
from handout.summary import one_line
from handout.values import Array, Drawing, Page, Stroke

if TYPE_CHECKING:
    from handout.motion.learned.training import PlanVariation

_DOT = 0.2  # mm: a stroke of this extent or less is a dot
_RATE = 200.0  # samples a second of a drawing made of plans
_SPARSE = 4.0  # samples a second: with fewer the speed of the pen cannot be told
_LIFT = 0.1  # s between strokes whose plan has no times of its own


@dataclass(frozen=True)
class PlannedStroke:
    """A stroke and its plan.

    plan : LognormalPlan; a dot is a plan of one target.
    place : dB, signal to noise of the path: at the same times if they are known, else at equal shares of its length.
    speed : dB, of the velocities; None if the times are not known.
    word : as in `Stroke`.
    """

    plan: LognormalPlan
    place: float
    speed: float | None
    word: int = -1


@dataclass(frozen=True)
class PlannedPage:
    """The plans of a page, in the order of writing; `timed`: whether they keep the times of a recording."""

    fits: tuple[PlannedStroke, ...]
    page: Page
    timed: bool
    about: Mapping[str, Any] = field(default_factory=dict)

    __repr__ = one_line


def fit(drawing: Drawing, *, timed: bool = True) -> PlannedPage:
    """Fit a plan of lognormal strokes to every stroke of a page.

    timed : keep the times of the drawing; otherwise only its shapes count, and strokes get the times of their plans.
        A stroke whose samples are too sparse to tell how the pen moved is always taken by its shape alone.

    Source: seed 002, §3.2.
    """
    clock, fits = 0.0, []
    timed = timed and not all(_sparse(stroke) for stroke in drawing.strokes)
    for stroke in drawing.strokes:
        if timed:
            fits.append(_fit_shape(stroke, float(stroke.t[0])) if _sparse(stroke) else _fit_timed(stroke))
        else:
            fits.append(_fit_shape(stroke, clock))
            clock = fits[-1].plan.end + _LIFT
    return PlannedPage(tuple(fits), drawing.page, timed, drawing.about)


def _sparse(stroke: Stroke) -> bool:
    """Whether a stroke has too few samples for the time that it took."""
    lasted = float(stroke.t[-1] - stroke.t[0])
    return lasted > recording_fit.SHORTEST and (len(stroke.t) - 1) / lasted < _SPARSE


def _dot(stroke: Stroke, start: float) -> PlannedStroke:
    lasts = max(float(stroke.t[-1] - stroke.t[0]), 0.05)
    none = np.zeros(0)
    plan = LognormalPlan(stroke.xy.mean(axis=0)[None], none, none, none, none, start, start + lasts)
    return PlannedStroke(plan, np.inf, None, stroke.word)


def _fit_timed(stroke: Stroke) -> PlannedStroke:
    start = float(stroke.t[0])
    if extent(stroke.xy) <= _DOT or len(stroke.t) < 3 or stroke.t[-1] - start < recording_fit.SHORTEST:
        return _dot(stroke, start)
    recording = recording_fit.prepare_recording(stroke.t, stroke.xy)
    plan = recording_fit.from_recording(stroke.t, stroke.xy)
    place = np.column_stack([recording.place.real, recording.place.imag])
    velocity = np.column_stack([recording.velocity.real, recording.velocity.imag])
    speed = snr(velocity, plan.velocity(recording.t), about_mean=False)
    return PlannedStroke(plan, snr(place, plan.position_at(recording.t)), speed, stroke.word)


def _fit_shape(stroke: Stroke, start: float) -> PlannedStroke:
    if extent(stroke.xy) <= _DOT or len(stroke.xy) < 2:
        return _dot(stroke, start)
    # moved to begin at `start`, with no pulse cut off by its times
    plan = shape_fit.from_shape(stroke.xy)
    begin, end = plan.pulses().span
    shift = start - begin
    plan = replace(plan, onset=plan.onset + shift, start=start, end=end + shift)
    count = 400
    return PlannedStroke(
        plan,
        snr(resample_path(stroke.xy, count), resample_path(plan.position_at(sample_times(plan)), count)),
        None,
        stroke.word,
    )


def vary_page(page: PlannedPage, variation: PlanVariation, rng: np.random.Generator) -> PlannedPage:
    """The same page, made a little differently: targets, overlaps and bends of its plans are perturbed.

    Source: seed 002, §3.3 and fig. 7.
    """
    from handout.motion.learned import sequences, training

    sequence = training.vary(sequences.of_plans([fit.plan for fit in page.fits]), variation, rng)
    fits, at = [], 0.0
    for fit, part in zip(page.fits, sequence.parts, strict=True):
        plan, ways, onset = fit.plan, slice(part.start, part.stop - 1), fit.plan.onset
        lasts = plan.end - plan.start
        if plan.strokes:
            onset = onset[0] + lognormal.onsets(sequence.dt[ways], plan.duration)
            lasts = max(lasts + float(onset[-1] - plan.onset[-1]), 0.5 * lasts)
        start, targets, theta = plan.start + at, sequence.targets[part], sequence.theta[ways]
        changed = replace(plan, targets=targets, onset=onset + at, theta=theta, start=start, end=start + lasts)
        fits.append(replace(fit, plan=changed))
        at += lasts - (plan.end - plan.start)
    return replace(page, fits=tuple(fits))


def sample_times(plan: LognormalPlan) -> Array:
    """(n,) float, s: times from the start to the end of a plan, 200 a second."""
    return np.linspace(plan.start, plan.end, max(round((plan.end - plan.start) * _RATE) + 1, 2))


def drawing(page: PlannedPage) -> Drawing:
    """Draw the plans."""
    strokes = []
    for fit in page.fits:
        t = sample_times(fit.plan)
        strokes.append(Stroke(t, fit.plan.position_at(t), word=fit.word))
    return Drawing(tuple(strokes), page.page, page.about)
