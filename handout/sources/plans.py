"""Reads pages of plans in JSON, as `sinks.plans` writes and describes them, changed by hand or not."""

from __future__ import annotations

from typing import Any, Literal

import msgspec
import numpy as np

from handout.errors import InputError
from handout.motion.reconstruction.plan import LognormalPlan
from handout.motion.reconstruction.planned_page import PlannedPage, PlannedStroke
from handout.sources.drawing_json import JsonPage, decode
from handout.sources.recorded import refuse_far


class _PlanStroke(msgspec.Struct, forbid_unknown_fields=True):
    onset: float
    duration: float
    asymmetry: float
    theta: float


class _PlanMovement(msgspec.Struct, forbid_unknown_fields=True):
    start: float
    end: float
    targets: list[tuple[float, float]]
    strokes: list[_PlanStroke]
    place_db: float | None = None
    speed_db: float | None = None
    word: int = -1


class _PlansFile(msgspec.Struct, forbid_unknown_fields=True):
    format: Literal["handout-plans"]
    version: Literal[1]
    page: JsonPage
    timed: bool
    about: dict[str, Any]
    movements: list[_PlanMovement]


def from_json(data: bytes) -> PlannedPage:
    """Read what `sinks.plans.to_json` wrote.

    Raises
    ------
    InputError
        Not JSON, not of this form (the message says where), or plans that cannot be.
    """
    file = decode(data, _PlansFile, "a page of plans")
    page = file.page.page()
    fits = tuple(_read_movement(movement, number) for number, movement in enumerate(file.movements, 1))
    return PlannedPage(fits, page, file.timed, file.about)


def _read_movement(movement: _PlanMovement, number: int) -> PlannedStroke:
    columns = np.array([(s.onset, s.duration, s.asymmetry, s.theta) for s in movement.strokes]).reshape(-1, 4).T
    if (columns[1] <= 0).any():
        raise InputError(f"Movement {number} has a stroke whose duration is not above 0 s.")
    targets = np.array(movement.targets, dtype=np.float64).reshape(-1, 2)
    onset, duration, asymmetry, theta = columns
    refuse_far(f"Movement {number}", targets, [movement.start, movement.end], asymmetry=asymmetry, theta=theta)
    refuse_far(f"Movement {number}", targets, np.concatenate([onset, onset + duration]))
    try:
        plan = LognormalPlan(targets, onset, duration, asymmetry, theta, movement.start, movement.end)
    except ValueError as error:
        raise InputError(
            f"Movement {number} cannot be used: {error} (it needs one target more than strokes)."
        ) from error
    place = np.inf if movement.place_db is None else movement.place_db
    return PlannedStroke(plan, place, movement.speed_db, movement.word)
