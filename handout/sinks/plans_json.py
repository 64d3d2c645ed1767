"""A page of plans as JSON, to be looked at and changed.

::

    {"format": "handout-plans", "version": 1,
     "page": {"width": 148.0, "height": 210.0, "name": "A5"},      mm
     "timed": true,                                                whether the times are those of a recording
     "about": {…},
     "movements": [{"start": 0.0, "end": 0.81,                     s, pen down to pen up
                    "targets": [[12.1, 30.4], [13.9, 27.0], …],    mm, y down; one more than strokes
                    "strokes": [{"onset": 0.012, "duration": 0.21, s
                                 "asymmetry": 0.08,                1 − mode / median of its speed
                                 "theta": -0.6}, …],               rad, half of how far it turns
                    "place_db": 38.2, "speed_db": 26.0,            how well it explains the trace; not read
                    "word": 3}, …]}
"""

from __future__ import annotations

from typing import Any, Literal

import msgspec
import numpy as np

from handout.errors import InputError
from handout.motion.reconstruction.plan import LognormalPlan
from handout.motion.reconstruction.planned_page import Fit, PlannedPage
from handout.sinks import about
from handout.values import Page


class _Page(msgspec.Struct, forbid_unknown_fields=True):
    width: float
    height: float
    name: str = ""


class _Stroke(msgspec.Struct, forbid_unknown_fields=True):
    onset: float
    duration: float
    asymmetry: float
    theta: float


class _Movement(msgspec.Struct, forbid_unknown_fields=True, omit_defaults=True):
    start: float
    end: float
    targets: list[tuple[float, float]]
    strokes: list[_Stroke]
    place_db: float | None = None
    speed_db: float | None = None
    word: int = -1


class _File(msgspec.Struct, forbid_unknown_fields=True):
    format: Literal["handout-plans"]
    version: Literal[1]
    page: _Page
    timed: bool
    about: dict[str, Any]
    movements: list[_Movement]


def to_json(page: PlannedPage) -> bytes:
    """A page of plans in the form described at the top of this file."""
    sheet = _Page(float(page.page.width), float(page.page.height), about.plain(page.page.name))
    movements = [_written(fit) for fit in page.fits]
    file = _File("handout-plans", 1, sheet, page.timed, about.plain(dict(page.about)), movements)
    return msgspec.json.format(msgspec.json.encode(file), indent=1) + b"\n"


def _written(fit: Fit) -> _Movement:
    plan = fit.plan
    rows = zip(plan.onset.tolist(), plan.duration.tolist(), plan.asymmetry.tolist(), plan.theta.tolist(), strict=True)
    place = None if not np.isfinite(fit.place) else round(fit.place, 2)
    speed = None if fit.speed is None else round(fit.speed, 2)
    targets = [(x, y) for x, y in plan.targets.tolist()]
    return _Movement(plan.start, plan.end, targets, [_Stroke(*row) for row in rows], place, speed, fit.word)


def from_json(data: bytes) -> PlannedPage:
    """Read what `to_json` wrote, changed by hand or not.

    Raises
    ------
    InputError
        Not JSON, not of this form (the message says where), or plans that cannot be.
    """
    try:
        file = msgspec.json.decode(data, type=_File)
    except (msgspec.MsgspecError, UnicodeDecodeError, RecursionError) as error:
        raise InputError(f"This is not a page of plans in JSON: {error}.") from error
    if not (file.page.width > 0 and file.page.height > 0):
        raise InputError(f"A page of {file.page.width:g} x {file.page.height:g} mm cannot be.")
    fits = tuple(_read(movement, number) for number, movement in enumerate(file.movements, 1))
    return PlannedPage(fits, Page(file.page.width, file.page.height, file.page.name), file.timed, file.about)


def _read(movement: _Movement, number: int) -> Fit:
    columns = np.array([(s.onset, s.duration, s.asymmetry, s.theta) for s in movement.strokes]).reshape(-1, 4).T
    if (columns[1] <= 0).any():
        raise InputError(f"Movement {number} has a stroke whose duration is not above 0 s.")
    try:
        targets = np.array(movement.targets, dtype=np.float64).reshape(-1, 2)
        onset, duration, asymmetry, theta = columns
        plan = LognormalPlan(targets, onset, duration, asymmetry, theta, movement.start, movement.end)
    except ValueError as error:
        raise InputError(
            f"Movement {number} cannot be used: {error} (it needs one target more than strokes)."
        ) from error
    place = np.inf if movement.place_db is None else movement.place_db
    return Fit(plan, place, movement.speed_db, movement.word)
