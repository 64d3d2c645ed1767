"""The steps from a drawing to a plan, in order; `plan` is where the time of every stroke is decided.

1. `hooking`: strokes longer than the pen has ink for are parted; `order`: in which order they are drawn.
2. `bed`: where the page lies on the machine; what lies outside is refused.
3. `PlanRequest.path`: all strokes as one trajectory, on the clock of the drawing.
4. `_PLANNERS`, by who makes the speeds of the machine (`Dialect.motion`):
   `feed_segments` for controllers with a planner of their own, which are given feeds (GRBL, Marlin);
   `time_slices` for boards that do each move in the time they are told (EBB);
   `vectors` for plotters that draw every stroke at one speed (HP-GL).
   Each of them cuts the trajectory, lays out the `toolpath`, times it, and makes the `Plan`.
"""

from __future__ import annotations

import dataclasses

import numpy as np
from msgspec import structs

from handout.errors import InputError
from handout.plotting import bed
from handout.plotting.dialects import dialect
from handout.plotting.planning import feed_segments, time_slices, vectors
from handout.plotting.planning.hooking import hooking, part_strokes
from handout.plotting.planning.order import shorten_travel
from handout.plotting.planning.plan import Order, Plan, PlanRequest, Speed
from handout.plotting.planning.segments import on_one_clock
from handout.profiles import Plotter
from handout.values import Drawing, Stroke

# who makes the speeds of a machine, as its `Dialect` says → what plans for it
_PLANNERS = {"planned": feed_segments.plan, "timed": time_slices.plan, "vectors": vectors.plan}


def plan(
    drawing: Drawing,
    profile: Plotter,
    *,
    speed: Speed = 1.0,
    order: Order = "writing",
    pace: float = 1.0,
    whole: tuple[bool, bool] = (True, True),
) -> Plan:
    """Turn a drawing into motion within a machine's limits, at the speeds of the hand as far as it can keep them.

    speed : multiple of the speed of the drawing, or "fast": as fast as the machine can, as a drawing without times is
        always drawn; pace : times that speed, or where the machine is as fast as it can, times its greatest with the
        pen down.
    order : "writing" keeps the order of the strokes; "travel" shortens the way between them: by moving whole words
        about, or in a drawing without times in any way.
    whole : whether the page begins with the drawing, and ends with it, for the hooks before and after a page.

    Raises DoesNotFit: part of the drawing, or the place of a hook, lies outside the bed. InputError: nothing to draw,
    or a speed that is not positive.
    """
    drawing = part_strokes(drawing, profile.hooks.dip_every)
    drawing = dataclasses.replace(drawing, strokes=_order_strokes(drawing, profile, speed, order))
    if speed != "fast" and drawing.timed:
        speed *= pace
    else:
        speed, most = "fast", profile.limits.draw_speed
        limits = structs.replace(profile.limits, draw_speed=type(most)(most * min(pace, 1.0)))
        profile = structs.replace(profile, limits=limits)
    placement = bed.place(drawing.page, profile)
    paths = [placement.to_machine(stroke.xy) for stroke in drawing.strokes]
    bed.check(np.concatenate(paths), profile)
    path = on_one_clock([stroke.t for stroke in drawing.strokes], paths)
    hooked = hooking(drawing, profile, whole)
    request = PlanRequest(drawing, profile, speed, order, placement, path, whole, hooked)
    return _PLANNERS[dialect(profile.dialect).motion](request)


def _order_strokes(drawing: Drawing, profile: Plotter, speed: Speed, order: Order) -> tuple[Stroke, ...]:
    """The strokes in the order asked for; refuses what cannot be planned."""
    if not drawing.strokes:
        raise InputError("The page has no strokes: there is nothing to plot.")
    if speed != "fast" and not (isinstance(speed, int | float) and 0.01 <= speed <= 100):
        raise InputError(f'speed: {speed} is not "fast" and not between 0.01 and 100 times the speed of the hand.')
    if order not in ("writing", "travel"):
        raise InputError(f'order: {order!r} is neither "writing" nor "travel".')
    if order == "writing":
        return drawing.strokes
    return shorten_travel(drawing, bed.place(drawing.page, profile).to_page(np.zeros((1, 2)))[0])
