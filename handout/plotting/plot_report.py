"""The report of a plot: how the motion that was executed, or is predicted, compares with the writing's, by page."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from handout import atomic
from handout.motion.timing import arc_length
from handout.plotting.driver import PlotReport
from handout.plotting.observation import (
    Observation,
    compare_strokes,
    goes_somewhere,
    has_speed,
    measure_times,
)
from handout.plotting.planning import feed_segments, hooking
from handout.plotting.planning.plan import Plan
from handout.plotting.ports import InstrumentedPort, Port
from handout.units import MOST_NAMED
from handout.values import Array, Drawing, Stroke

_WINDOW = 0.5  # s over which time is compared with time; over less, a pen that hardly moves tells nothing
_DOUBT = 0.005  # of a correlation that is told with its bounds
_NOTED = 1.03  # a stretch beyond this is told with its place

Row = dict[str, Any]


def row(
    plan: Plan,
    page: int,
    *,
    executed: Drawing | None = None,
    min_queue: int | None = None,
    observation: Observation | None = None,
) -> Row:
    """What is to be said of one page.

    page : its number, from 1.
    executed : what the simulated plotter drew, or the strokes that were observed; None: what the plan predicts.
    min_queue : as the machine said; None: as the plan predicts.
    observed : what the machine's answers tell; None: nothing was plotted.

    Returns a dict:
        correlation, rms_of_peak : of the speeds at the same times; in_place : the same at the same places.
        intended_s, executed_s : time of the strokes alone; stretched : their ratio; announced_s : of everything.
        segments, segments_per_s : of the strokes; min_queue : moves in hand in the middle of a stroke, the least.
        measured : whether these are of what was executed; unknown : why not, if something was plotted.
        rests : where the pen stood within strokes, by the machine's answers: stroke, word, text, at_s, seconds;
        rested_s : in all; least_rest_s : shorter ones may not have been noticed; all None if that is not known.
        deviation_mm : greatest distance of the paths; stretched_at : strokes in which time was stretched, and how far.
    """
    intended, done = plan.intended_drawing(), plan.predicted_drawing() if executed is None else executed
    segments = int(np.count_nonzero(plan.toolpath.draws))
    took = float(plan.motion.duration[plan.toolpath.draws].sum())
    if min_queue is None:
        min_queue = feed_segments.least_queue(plan)
    intended_s, executed_s = measure_times(intended, done)
    return {
        "page": page,
        "measured": executed is not None,
        **_likeness(intended, done),
        "intended_s": round(intended_s, 3),
        "executed_s": round(executed_s, 3),
        "stretched": round(executed_s / intended_s, 5) if intended_s > 0 else 1.0,
        "announced_s": round(plan.duration, 3),
        "segments": segments,
        "segments_per_s": round(segments / took, 1) if took > 0 else 0.0,
        "min_queue": min_queue,
        "stretched_at": stretches(intended, done),
        **_rests(observation),
    }


def _rests(observation: Observation | None) -> Row:
    if observation is None or observation.unknown:
        unknown = "" if observation is None else observation.unknown
        return {"unknown": unknown, "rests": None, "rested_s": None, "least_rest_s": None}
    rests = [
        rest._asdict() | {"at_s": round(rest.at_s, 3), "seconds": round(rest.seconds, 3)} for rest in observation.rests
    ]
    seconds = {"rested_s": round(observation.rested_s, 3), "least_rest_s": round(observation.least_s, 3)}
    return {"unknown": "", "rests": rests, **seconds}


def _likeness(intended: Drawing, executed: Drawing) -> Row:
    """How alike two drawings of the same strokes are; all None if nothing in them moves."""
    if not any(has_speed(*pair) for pair in _pairs(intended, executed)):
        return {"correlation": None, "rms_of_peak": None, "in_place": None, "deviation_mm": None}
    likeness = compare_strokes(intended, executed)
    return {
        "correlation": round(likeness.timed, 5),
        "rms_of_peak": round(likeness.timed_rms, 5),
        "in_place": {"correlation": round(likeness.correlation, 5), "rms_of_peak": round(likeness.rms, 5)},
        "deviation_mm": round(likeness.deviation, 4),
    }


def tell_plotted_page(report: PlotReport, port: Port, page: int) -> Row:
    """What is to be said of a page that has just been plotted.

    What a simulated plotter drew is known; what a real one did, as far as its answers tell; of one that says nothing,
    it is what the plan predicts.
    """
    assert report.plan is not None
    executed, many = report.observation.executed, len(report.plan.drawing.strokes)
    if isinstance(port, InstrumentedPort):
        executed, sheet = None, hooking.without_pots(port.executed_drawing(), report.plan.profile)
        if len(sheet.strokes) >= many:  # what was drawn on the same sheet before comes first
            executed = Drawing(sheet.strokes[-many:], sheet.page)
    return row(report.plan, page, executed=executed, min_queue=report.min_queue, observation=report.observation)


def facts(reports: Sequence[PlotReport]) -> Row:
    """What is known of how parts were executed, for machines to read.

    Returns a dict:
        measured : whether the plotter's answers tell what was executed; unknown : why not.
        rests, rested_s : how often and how long the pen stood within strokes; None if that is not known.
        dips, hooks_s : how often the pen was dipped, and what of the announced time hooks take; only if there are any.
        unsecured_mm : ink that was drawn and not yet certain on the disk, at most.
    """
    unknown = next((report.observation.unknown for report in reports if report.observation.unknown), "")
    measured = bool(reports) and not unknown
    hooked = sum(report.hooked_s for report in reports)
    return {
        "measured": measured,
        **({"dips": sum(report.dips for report in reports), "hooks_s": round(hooked, 2)} if hooked else {}),
        **({"unknown": unknown} if unknown else {}),
        "rests": sum(len(report.observation.rests) for report in reports) if measured else None,
        "rested_s": round(sum(report.observation.rested_s for report in reports), 2) if measured else None,
        "unsecured_mm": round(max((report.unsecured for report in reports), default=0.0), 1),
    }


def sentence(reports: Sequence[PlotReport]) -> str:
    """How faithful a plot was, in one sentence; "" if nothing was plotted."""
    figures = facts(reports)
    if not reports:
        return ""
    if not figures["measured"]:
        return f"Whether the pen rested is not known: {figures['unknown']}"
    least = max(report.observation.least_s for report in reports)
    time = max(report.observation.stretched for report in reports)
    measured = f"Measured: {_speeds(reports)}strokes in {time:.3f} of their time;"
    if not figures["rests"]:
        return f"{measured} the pen never rested on the paper for longer than {least:.2f} s."
    words = dict.fromkeys(rest.text for report in reports for rest in report.observation.rests if rest.text)
    times = "once" if figures["rests"] == 1 else f"{figures['rests']} times"
    named = [*words][:MOST_NAMED] + ([f"{len(words) - MOST_NAMED} more"] if len(words) > MOST_NAMED else [])
    where = f", in: {', '.join(named)}" if words else ""
    return f"{measured} the pen rested {times}, {figures['rested_s']:.2f} s in all{where}."


def _speeds(reports: Sequence[PlotReport]) -> str:
    """How well the speeds were kept; with its bounds where answers were heard too late to tell it exactly."""
    seen = [report.observation for report in reports]
    r = [one.correlation for one in seen if one.correlation is not None]
    least = [one.least_correlation for one in seen if one.least_correlation is not None]
    if not r or not least:
        return ""
    span = f"{min(r):.3f}" if min(r) - min(least) < _DOUBT else f"{min(least):.2f} to {min(r):.2f}"
    return f"speeds as meant (r {span}), "


def stretches(intended: Drawing, executed: Drawing) -> list[Row]:
    """The strokes in which half a second took noticeably longer than it was meant to.

    Returns dicts:
        stroke, word : their numbers, from 0 (word −1: unknown); factor : of the whole stroke; worst : of the half of a
        second that was stretched most; at_s : when that begins, from the start of the stroke as it was meant.
    """
    rows = []
    for number, (a, b) in enumerate(_pairs(intended, executed)):
        if not goes_somewhere(a, b):
            continue
        clock = np.arange(0.0, max(a.t[-1] - a.t[0] - _WINDOW, 0.0) + 1e-9, _WINDOW / 10)
        share = np.interp(np.append(clock, clock + _WINDOW), a.t - a.t[0], _share(a.xy))
        when = np.interp(share, _share(b.xy), b.t)
        local = (when[len(clock) :] - when[: len(clock)]) / min(_WINDOW, a.t[-1] - a.t[0])
        worst = int(np.argmax(local))
        if local[worst] > _NOTED:
            factor = (b.t[-1] - b.t[0]) / (a.t[-1] - a.t[0])
            factors = {"factor": round(float(factor), 4), "worst": round(float(local[worst]), 3)}
            rows.append({"stroke": number, "word": a.word, **factors, "at_s": round(float(clock[worst]), 3)})
    return rows


def whole(rows: Sequence[Row]) -> Row:
    """The report of all pages: the same keys, of the worst page or in all, and the rows themselves as `pages`."""

    def list_known(key: str) -> list[Any]:
        return [row[key] for row in rows if row[key] is not None]

    def total(key: str) -> float:
        return float(sum(row[key] for row in rows))

    intended, executed = total("intended_s"), total("executed_s")
    rested = len(list_known("rests")) == len(rows) > 0
    return {
        "measured": all(row["measured"] for row in rows),
        "correlation": min(list_known("correlation"), default=None),
        "rms_of_peak": max(list_known("rms_of_peak"), default=None),
        "intended_s": round(intended, 3),
        "executed_s": round(executed, 3),
        "stretched": round(executed / intended, 5) if intended > 0 else 1.0,
        "announced_s": round(total("announced_s"), 3),
        "segments": sum(row["segments"] for row in rows),
        "min_queue": min(list_known("min_queue"), default=None),
        "rests": sum(map(len, list_known("rests"))) if rested else None,
        "rested_s": round(total("rested_s"), 3) if rested else None,
        "pages": list(rows),
    }


def write(path: Path, rows: Sequence[Row]) -> None:
    """Write the report of all pages as JSON; all of it or nothing."""
    atomic.write(path, (json.dumps(whole(rows), indent=1) + "\n").encode())


def _pairs(intended: Drawing, executed: Drawing) -> Iterator[tuple[Stroke, Stroke]]:
    return zip(intended.strokes, executed.strokes, strict=True)


def _share(xy: Array) -> Array:
    """How much of the length of a path lies before each of its points, 0 to 1."""
    along = arc_length(xy)
    return np.asarray(along / along[-1])
